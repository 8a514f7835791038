//! Constants that depend on temperature, at the temperature that the steps prescribe.

use std::collections::{BTreeMap, BTreeSet};

use slipstick_meshio::{Centre, FileMesh};

use crate::bodies::{Bodies, find};
use crate::ledger::Ledger;
use crate::read::{Condition, Deck, Elastic, TableOf, Target};

/// The temperature of a node at the start and at the ends of all steps.
type History = Vec<f64>;

impl Deck {
    /// Replaces the first row of tables by the constants at the temperature of all nodes of their material, which
    /// must be the same at the ends of all steps. A deck without temperatures keeps the first row, as in CalculiX.
    pub fn evaluate_constants(&mut self, mesh: &FileMesh, centres: &[Centre], bodies: &Bodies, ledger: &mut Ledger) {
        if self.materials.values().all(|material| material.tables.is_empty()) {
            return;
        }
        let histories = self.temperature_histories(mesh, bodies);
        let between: BTreeSet<u32> = centres.iter().map(|centre| centre.node).collect();
        for (name, material) in &mut self.materials {
            let sets = self.sections.iter().filter(|section| section.material == *name);
            let sets = sets.filter_map(|section| find(&mesh.cell_sets, &section.set));
            let cells = sets.flat_map(|set| &mesh.cell_sets[set]);
            let nodes: BTreeSet<u32> = cells.flat_map(|&cell| mesh.cells.nodes(cell as usize)).copied().collect();
            let none = vec![0.0; self.steps.len() + 1];
            let mut found: Vec<&History> = nodes
                .difference(&between)
                .map(|node| histories.as_ref().map_or(&none, |of| of.get(node).unwrap_or(&none)))
                .collect();
            found.dedup();
            let tables = std::mem::take(&mut material.tables);
            let Some(of) = found.first().filter(|_| histories.is_some()) else { continue };
            let alike = found.len() == 1 && of[1..].iter().all(|at| at == of.last().unwrap_or(at));
            for table in tables {
                let keyword = match table.of {
                    TableOf::Elastic => "ELASTIC",
                    TableOf::Density => "DENSITY",
                    TableOf::Expansion { .. } => "EXPANSION",
                };
                if !alike {
                    let why = "constants that depend on temperature need one temperature of all nodes of the material, \
                               the same at the ends of all steps";
                    let cure = "keep the row for the temperature of the analysis";
                    ledger.refuse(keyword, table.line, why, cure);
                    material.refused = true;
                    continue;
                }
                let (start, end) = (of[0], of[of.len() - 1]);
                let constants = table.at(end);
                match table.of {
                    TableOf::Elastic => {
                        let [youngs_modulus, poisson_ratio] = [constants[0], constants[1]];
                        let line = table.line;
                        material.elastic = Some((Elastic::Isotropic { youngs_modulus, poisson_ratio }, line));
                    }
                    TableOf::Density => material.density = Some(constants[0]).filter(|&density| density > 0.0),
                    TableOf::Expansion { zero } => {
                        // strains are those from `zero`, less those at the start
                        let strain = |at: f64| table.at(at)[0] * (at - zero);
                        let secant =
                            if start == end { constants[0] } else { (strain(end) - strain(start)) / (end - start) };
                        material.expansion = Some(secant).filter(|&alpha| alpha != 0.0);
                    }
                }
            }
        }
    }

    /// The temperatures of all nodes that a keyword names; `None` without any.
    fn temperature_histories(&self, mesh: &FileMesh, bodies: &Bodies) -> Option<BTreeMap<u32, History>> {
        let nodes = |condition: &Condition| -> Vec<u32> {
            match &condition.target {
                Target::Node(number) => bodies.position(*number).into_iter().collect(),
                Target::Set(name) => find(&mesh.node_sets, name).map_or(Vec::new(), |set| mesh.node_sets[set].clone()),
            }
        };
        let given = self.steps.iter().any(|step| !step.temperatures.is_empty());
        if self.initial_temperatures.is_empty() && !given {
            return None;
        }
        let count = self.steps.len() + 1;
        let mut histories: BTreeMap<u32, History> = BTreeMap::new();
        let steps = self.steps.iter().map(|step| &step.temperatures);
        for (k, conditions) in std::iter::once(&self.initial_temperatures).chain(steps).enumerate() {
            for condition in conditions {
                for node in nodes(condition) {
                    histories.entry(node).or_insert_with(|| vec![0.0; count])[k..].fill(condition.value);
                }
            }
        }
        Some(histories)
    }
}

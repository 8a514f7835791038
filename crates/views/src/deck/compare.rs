//! What CalculiX can report of a case: reactions, contact forces, displacements.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};
use slipstick_case::file::{
    ForceComponent, ForceWord, ObservedSteps, Promise, Quantity, QuantityKind, VectorComponent, VectorWord,
};
use slipstick_mesh::facet_area_vector;
use slipstick_solid::load::nodal_areas;
use toml::{Table, Value};

use super::{DeckRecord, Writer};

/// A number that both programs report.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Compared {
    /// A column of `quantities.csv` of the deck's case.
    pub column: String,
    /// What the design promised.
    pub promised: Option<f64>,
    /// How it follows from the results of CalculiX.
    pub source: Source,
}

/// How a number follows from the results of CalculiX.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// Sum of the reactions of components (from 0) of nodes.
    Reaction {
        /// Numbers of nodes, with components.
        unknowns: Vec<(u32, u8)>,
        /// Sum of the loads on these unknowns, at reference positions, which the forces that CalculiX
        /// reports contain. \[F\]
        loads: [f64; 3],
        /// The direction of the component; `None`: the norm of the sum.
        along: Option<[f64; 3]>,
    },
    /// Mean displacement.
    Displacement {
        /// Numbers of nodes with their weights, which add up to 1.
        nodes: Vec<(u32, f64)>,
        /// The direction of the component; `None`: the norm of the mean.
        along: Option<[f64; 3]>,
    },
    /// Force on the slave of a contact pair.
    Contact {
        /// Slave surface in the deck.
        slave: String,
        /// Master surface in the deck.
        master: String,
        /// Which part.
        part: ContactPart,
    },
}

/// Part of a contact force.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ContactPart {
    /// The sum of normal forces on a flat slave; pressure is positive. CalculiX reports the resultant along the mean
    /// normal, which is less on a curved one.
    Normal,
    /// A component of the resultant.
    Along([f64; 3]),
    /// The norm of the resultant.
    Norm,
}

/// A surface is flat if the sum of its facets' area vectors falls short of its area by less than this fraction.
const FLAT: f64 = 1e-6;

/// Why normal forces on curved slaves are not compared.
const CURVED: &str = "the surface is curved: CalculiX reports the resultant, not the sum of normal forces";

/// Why forces that drive tied rigid bodies are not compared.
const TIED: &str = "CalculiX reports other forces at the nodes of a rigid body that is tied";

/// Name of the quantity for a component of the resultant on a curved slave.
fn resultant(slave: &str, axis: &str) -> String {
    format!("{slave}_resultant_{axis}")
}

/// The direction of a component; `None`: the norm.
fn along(component: &VectorComponent) -> Option<[f64; 3]> {
    match component {
        VectorComponent::Direction(v) => {
            let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
            Some(v.map(|x| x / length))
        }
        VectorComponent::Word(VectorWord::X) => Some([1.0, 0.0, 0.0]),
        VectorComponent::Word(VectorWord::Y) => Some([0.0, 1.0, 0.0]),
        VectorComponent::Word(VectorWord::Z) => Some([0.0, 0.0, 1.0]),
        VectorComponent::Word(VectorWord::Norm) => None,
    }
}

impl Writer<'_> {
    /// What is compared: reactions of supports, contact forces, and the quantities of the case.
    pub(super) fn compared(&mut self, deck: &str, case: &str) -> DeckRecord {
        let (deck, case) = (deck.to_owned(), case.to_owned());
        let load_case = self.case.load_cases.get(self.options.load_case).map(|of| of.name.clone());
        let mut record =
            DeckRecord { deck, case, load_case, compared: vec![], left_out: vec![], contact_stiffness: self.slope };
        for quantity in &self.case.quantities {
            match self.source(quantity) {
                Ok(source) => {
                    let promised = self.promised(&quantity.name);
                    record.compared.push(Compared { column: quantity.name.clone(), promised, source });
                }
                Err(why) => record.left_out.push((quantity.name.clone(), why.into())),
            }
        }
        let mut seen = BTreeSet::new();
        for motion in &self.case.dirichlet {
            for (set, unknowns) in self.held(&motion.set) {
                // as in the columns of slipstick, a component that several supports prescribe belongs to the first
                let rigid = self.mesh.rigid.iter().any(|rigid| self.names.bodies[rigid.body] == set);
                if rigid && self.is_tied(&motion.set) {
                    record.left_out.push((format!("reaction_{set}"), TIED.to_owned()));
                    continue;
                }
                let unknowns = if rigid { unknowns } else { self.owned(&set, unknowns) };
                for (c, axis) in ["x", "y", "z"].into_iter().enumerate() {
                    let own: Vec<(u32, u8)> =
                        unknowns.iter().copied().filter(|(_, of)| usize::from(*of) == c).collect();
                    let column = format!("reaction_{set}_{axis}");
                    if own.is_empty()
                        || !motion.components.iter().any(|of| of.index() == c)
                        || !seen.insert(column.clone())
                    {
                        continue;
                    }
                    let mut along = [0.0; 3];
                    along[c] = 1.0;
                    let promised = self.promised(&format!("reaction_{}_{axis}", motion.set));
                    let source = Source::Reaction { loads: self.loads_on(&own), unknowns: own, along: Some(along) };
                    record.compared.push(Compared { column, promised, source });
                }
            }
        }
        for contact in self.case.contacts.iter().filter(|contact| !contact.tied) {
            let names = [&contact.slave, &contact.master].map(|name| self.names.surfaces.get(name).cloned());
            let [Some(slave), Some(master)] = names else { continue };
            let column = format!("{slave}_normal_force");
            if self.is_flat(&contact.slave) {
                let promised = self.promised(&format!("{}_normal_force", contact.slave));
                let source = Source::Contact { slave, master, part: ContactPart::Normal };
                record.compared.push(Compared { column, promised, source });
                continue;
            }
            record.left_out.push((column, CURVED.to_owned()));
            for (c, axis) in ["x", "y", "z"].into_iter().enumerate() {
                let mut along = [0.0; 3];
                along[c] = 1.0;
                let source =
                    Source::Contact { slave: slave.clone(), master: master.clone(), part: ContactPart::Along(along) };
                record.compared.push(Compared { column: resultant(&slave, axis), promised: None, source });
            }
        }
        record
    }

    /// Whether this is a rigid body with a tie.
    fn is_tied(&self, name: &str) -> bool {
        let Some(b) = self.mesh.rigid.iter().map(|of| of.body).find(|&b| self.mesh.bodies[b].name == name) else {
            return false;
        };
        let on = |surface: &String| {
            let facets = self.mesh.surfaces.get(surface).map_or(&[][..], |of| &of.facets[..]);
            facets.first().is_some_and(|facet| self.mesh.body_of_element(facet.element as usize) == Some(b))
        };
        self.case.contacts.iter().any(|pair| pair.tied && (on(&pair.slave) || on(&pair.master)))
    }

    /// Whether all facets of a surface have the same normal.
    fn is_flat(&self, surface: &str) -> bool {
        let Some(surface) = self.mesh.surfaces.get(surface) else { return true };
        let normals = || surface.facets.iter().map(|facet| facet_area_vector(&self.mesh.facet_coordinates(facet)));
        let norm = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let sum = normals().fold([0.0; 3], |sum, n| std::array::from_fn(|c| sum[c] + n[c]));
        norm(sum) > (1.0 - FLAT) * normals().map(norm).sum::<f64>()
    }

    /// Quantities that only the deck's case has: the resultants on curved slaves.
    fn resultants(&self) -> Vec<Value> {
        let mut all = Vec::new();
        let curved = self.case.contacts.iter().filter(|contact| !contact.tied && !self.is_flat(&contact.slave));
        for slave in curved.filter_map(|contact| self.names.surfaces.get(&contact.slave)) {
            for axis in ["x", "y", "z"] {
                let force = Table::from_iter(
                    [("slave", slave.as_str()), ("component", axis)].map(|(k, v)| (k.to_owned(), v.into())),
                );
                all.push(Value::Table(Table::from_iter([
                    ("name".to_owned(), resultant(slave, axis).into()),
                    ("contact_force".to_owned(), force.into()),
                ])));
            }
        }
        all
    }

    fn promised(&self, column: &str) -> Option<f64> {
        let promise = self
            .options
            .promises
            .iter()
            .find(|promise| promise.quantity == column && promise.steps == ObservedSteps::Last)?;
        promise.values.get(self.options.load_case).copied()
    }

    /// The sum of the loads on unknowns, numbered from 1.
    fn loads_on(&self, unknowns: &[(u32, u8)]) -> [f64; 3] {
        // loads on centres, which the deck lacks, act on the nodes from which these follow
        let mut external = self.external.clone();
        for centre in self.mesh.serendipity_centres(0..self.mesh.elements.len(), &BTreeSet::new()) {
            for c in 0..3 {
                let own = std::mem::take(&mut external[3 * centre.node as usize + c]);
                centre.terms.iter().for_each(|&(node, weight)| external[3 * node as usize + c] += weight * own);
            }
        }
        let mut sum = [0.0; 3];
        for &(node, c) in unknowns {
            sum[usize::from(c)] += external[3 * (node as usize - 1) + usize::from(c)];
        }
        sum
    }

    /// The sets of a support in the deck's case, each with its prescribed unknowns.
    fn held(&mut self, set: &str) -> Vec<(String, Vec<(u32, u8)>)> {
        let prescribed = |nodes: &[u32], writer: &Self| -> Vec<(u32, u8)> {
            let all = nodes.iter().flat_map(|&node| (0..3).map(move |c| (node, c)));
            let own = all.filter(|key| writer.history.supports.hold_at_end(key));
            own.map(|(node, c)| (node + 1, c)).collect()
        };
        if let Some(reference) = self.mesh.reference_of(set) {
            let Some(b) = self.mesh.bodies.iter().position(|body| body.name == set) else {
                // CalculiX reports no force at the reference node of a coupling
                return Vec::new();
            };
            // the force that drives a rigid body is the sum over its nodes
            let components: Vec<u8> = prescribed(&[reference.node], self).into_iter().map(|(_, c)| c).collect();
            let nodes = self.mesh.bodies[b].nodes.clone().map(|node| node as u32 + 1);
            let all = nodes.flat_map(|node| components.iter().map(move |&c| (node, c)));
            return vec![(self.names.bodies[b].clone(), all.collect())];
        }
        if self.case.points.iter().any(|point| point.name == set) {
            return Vec::new();
        }
        let turned = |motion: &slipstick_case::file::Dirichlet| motion.set == set && motion.rotation.is_some();
        if self.case.dirichlet.iter().any(turned) {
            return Vec::new();
        }
        let sets = self.node_sets(set);
        sets.into_iter().map(|name| (name.clone(), prescribed(&self.names.nodes[&name], self))).collect()
    }

    /// Those of the unknowns, numbered from 1, that belong to a set of the deck and to none that it prescribes earlier.
    fn owned(&self, set: &str, unknowns: Vec<(u32, u8)>) -> Vec<(u32, u8)> {
        unknowns.into_iter().filter(|&(node, c)| self.history.supports.owns(set, &(node - 1, c))).collect()
    }

    /// How a quantity follows from the results of CalculiX, or why not.
    fn source(&mut self, quantity: &Quantity) -> Result<Source, &'static str> {
        Ok(match &quantity.kind {
            QuantityKind::Reaction(of) if self.is_tied(&of.set) => return Err(TIED),
            QuantityKind::Reaction(of) => {
                let held = self.held(&of.set);
                let own: Vec<(u32, u8)> =
                    held.iter().flat_map(|(set, unknowns)| self.owned(set, unknowns.clone())).collect();
                // a set that owns nothing has all that is prescribed at its nodes, as here
                let all = match own.is_empty() {
                    true => held.into_iter().flat_map(|(_, unknowns)| unknowns).collect(),
                    false => own,
                };
                if all.is_empty() {
                    return Err("nothing is prescribed at its set, or it turns");
                }
                Source::Reaction { loads: self.loads_on(&all), unknowns: all, along: along(&of.component) }
            }
            QuantityKind::Displacement(of) if self.mesh.cuts.iter().any(|cut| cut.name == of.set) => {
                return Err("CalculiX writes no displacements of nodes without elements");
            }
            QuantityKind::Displacement(of) if of.relative_to.is_none() => {
                let weights: Vec<(u32, f64)> = match self.mesh.surfaces.get(&of.set) {
                    Some(surface) => nodal_areas(&self.mesh.faces_of_surface(surface), self.mesh.nodes.as_flattened()),
                    None => self.mesh.set_nodes(&of.set).unwrap_or_default().iter().map(|&node| (node, 1.0)).collect(),
                };
                if !self.dropped().is_empty() {
                    return Err("CalculiX has no nodes at the centres of faces");
                }
                let total: f64 = weights.iter().map(|(_, weight)| weight).sum();
                let nodes = weights.into_iter().map(|(node, weight)| (node + 1, weight / total)).collect();
                Source::Displacement { nodes, along: along(&of.component) }
            }
            QuantityKind::ContactForce(of) if of.within.is_none() => {
                let pair = self.case.contacts.iter().find(|pair| pair.slave == of.slave && !pair.tied);
                let pair = pair.ok_or("CalculiX does not report the force of a tie")?;
                let names = [&pair.slave, &pair.master].map(|name| self.names.surfaces.get(name).cloned());
                let [Some(slave), Some(master)] = names else { return Err("nothing is left of its pair") };
                let part = match &of.component {
                    ForceComponent::Direction(v) => {
                        let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
                        ContactPart::Along(v.map(|x| x / length))
                    }
                    ForceComponent::Word(ForceWord::X) => ContactPart::Along([1.0, 0.0, 0.0]),
                    ForceComponent::Word(ForceWord::Y) => ContactPart::Along([0.0, 1.0, 0.0]),
                    ForceComponent::Word(ForceWord::Z) => ContactPart::Along([0.0, 0.0, 1.0]),
                    ForceComponent::Word(ForceWord::Norm) => ContactPart::Norm,
                    ForceComponent::Word(ForceWord::Normal) if self.is_flat(&pair.slave) => ContactPart::Normal,
                    ForceComponent::Word(ForceWord::Normal) => return Err(CURVED),
                    ForceComponent::Word(ForceWord::Tangential | ForceWord::Nodal) => {
                        return Err("CalculiX does not report sums of magnitudes over nodes");
                    }
                };
                Source::Contact { slave, master, part }
            }
            // the energies that CalculiX 2.20 prints for an elastic block depend on the number of increments
            QuantityKind::StrainEnergy(_) => return Err("the energies that CalculiX prints depend on the increments"),
            _ => return Err("CalculiX does not report it"),
        })
    }

    /// A case that takes its tables from the deck, with the quantities and promises of this one.
    pub(super) fn case_text(&mut self, deck: &str) -> (String, Vec<(String, String)>) {
        let mut text = format!(
            "# The case of a deck: bodies, contact, supports, loads and steps come from {deck}.\n\
             deck = {{ file = \"{deck}\" }}\n"
        );
        let mut left_out = Vec::new();
        let mut root = Table::new();
        let mut put = |key: &str, value: Result<Value, toml::ser::Error>| {
            if let Ok(value) = value {
                root.insert(key.into(), value);
            }
        };
        if self.case.units.length.is_some() || self.case.units.force.is_some() {
            put("units", Value::try_from(&self.case.units));
        }
        put("load_path", Value::try_from(self.case.load_path));
        let (mut quantities, mut promises) = (Vec::new(), Vec::new());
        let mut columns: BTreeMap<String, String> = BTreeMap::new();
        for quantity in &self.case.quantities {
            let Ok(Value::Table(mut table)) = Value::try_from(quantity) else { continue };
            let support = self.support(&quantity.kind);
            let renamed = match (table.get_mut(quantity.kind.key()).and_then(Value::as_table_mut), support) {
                (Some(own), Some(set)) => own.insert("set".into(), set.into()).is_some(),
                (Some(own), None) => self.renamed(own),
                (None, _) => true,
            };
            if renamed && !matches!(quantity.kind, QuantityKind::SpringForce(_)) {
                columns.insert(quantity.name.clone(), quantity.name.clone());
                quantities.push(Value::Table(table));
            } else {
                left_out.push((quantity.name.clone(), "the deck has no such set of one body".to_owned()));
            }
        }
        for motion in &self.case.dirichlet {
            if let [(set, _)] = &self.held(&motion.set)[..] {
                let pair = |axis| (format!("reaction_{}_{axis}", motion.set), format!("reaction_{set}_{axis}"));
                columns.extend(["x", "y", "z"].map(pair));
            }
        }
        for contact in self.case.contacts.iter().filter(|contact| !contact.tied) {
            if let Some(slave) = self.names.surfaces.get(&contact.slave) {
                let of_pair = ["normal_force", "friction_force", "peak_pressure"];
                columns.extend(of_pair.map(|what| (format!("{}_{what}", contact.slave), format!("{slave}_{what}"))));
            }
        }
        columns
            .extend(["strain_energy", "friction_work", "external_work"].map(|name| (name.to_owned(), name.to_owned())));
        for promise in self.options.promises.iter().filter(|promise| promise.steps == ObservedSteps::Last) {
            let value = promise.values.get(self.options.load_case);
            if let (Some(column), Some(&value)) = (columns.get(&promise.quantity), value) {
                promises.extend(
                    Value::try_from(Promise {
                        quantity: column.clone(),
                        values: vec![value],
                        max: None,
                        min: None,
                        steps: ObservedSteps::Last,
                    })
                    .ok(),
                );
            }
        }
        quantities.extend(self.resultants());
        if !quantities.is_empty() {
            root.insert("quantity".into(), Value::Array(quantities));
        }
        if !promises.is_empty() {
            root.insert("promise".into(), Value::Array(promises));
        }
        text.push_str(&toml::to_string(&root).unwrap_or_default());
        (text, left_out)
    }

    /// The set of the deck that is the support of a reaction, if it is a set of one body.
    fn support(&mut self, kind: &QuantityKind) -> Option<String> {
        let QuantityKind::Reaction(of) = kind else { return None };
        let held = self.case.dirichlet.iter().any(|motion| motion.set == of.set);
        if !held || self.mesh.reference_of(&of.set).is_some() {
            return None;
        }
        match &self.node_sets(&of.set)[..] {
            [one] => Some(one.clone()),
            _ => None,
        }
    }

    /// Replaces names in the table of a quantity by those of the deck; whether all have one.
    fn renamed(&mut self, table: &mut Table) -> bool {
        for (key, value) in table.iter_mut() {
            let Value::String(name) = value else { continue };
            let new = match key.as_str() {
                "set" | "within" | "relative_to" => self.read_again(name),
                "bolt" => self.bolt(name),
                "slave" | "surface" => self.names.surfaces.get(name.as_str()).cloned(),
                "body" => {
                    self.mesh.bodies.iter().position(|body| body.name == *name).map(|b| self.names.bodies[b].clone())
                }
                _ => continue,
            };
            match new {
                Some(new) => *name = new,
                None => return false,
            }
        }
        true
    }

    /// The name that a bolt has in the deck's case.
    fn bolt(&self, name: &str) -> Option<String> {
        let cut = self.mesh.cuts.iter().find(|cut| cut.name == name)?;
        self.names.surfaces.get(&cut.surface()).cloned()
    }

    /// The name that a set has in the deck's case.
    fn read_again(&mut self, name: &str) -> Option<String> {
        if let Some(b) = self.mesh.rigid.iter().map(|rigid| rigid.body).find(|&b| self.mesh.bodies[b].name == name) {
            return Some(self.names.bodies[b].clone());
        }
        if self.mesh.couplings.iter().any(|coupling| coupling.name == name) {
            return Some(super::text::proper(name));
        }
        if self.mesh.surfaces.contains_key(name) {
            return self.surface(name);
        }
        match &self.node_sets(name)[..] {
            [one] => Some(one.clone()),
            _ => None,
        }
    }
}

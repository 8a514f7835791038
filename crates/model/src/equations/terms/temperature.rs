//! Prescribed changes of temperature along the load path.

use crate::equations::motion::{Temperature, factor};
use slipstick_mesh::Mesh;
use slipstick_path::LoadTime;
use std::ops::Range;

/// The changes of temperature of a model.
#[derive(Debug, Clone, Default)]
pub struct Temperatures {
    changes: Vec<Applied>,
}

#[derive(Debug, Clone)]
struct Applied {
    temperature: Temperature,
    /// Number of its load case; `None` if it acts in all.
    case: Option<usize>,
    /// The mean over the nodes of each element, at factor 1.
    of_elements: Vec<f64>,
}

impl Temperatures {
    /// `cases` are the names of the load cases. A change at nodes acts on an element with its mean over the
    /// nodes of the element.
    pub fn new(temperatures: Vec<Temperature>, mesh: &Mesh, cases: &[&str]) -> Self {
        let apply = |temperature: Temperature| {
            let case = temperature.load_case.as_ref().and_then(|name| cases.iter().position(|case| case == name));
            let mut of_elements = vec![0.0; mesh.elements.len()];
            if let Some(set) = &temperature.set {
                let mut inside = vec![false; mesh.nodes.len()];
                let nodes = mesh.set_nodes(set).unwrap_or_default();
                nodes.iter().for_each(|&node| inside[node as usize] = true);
                // sets do not have the copies of nodes at the sections of bolts
                mesh.copies().into_iter().for_each(|(copy, node)| inside[copy as usize] |= inside[node as usize]);
                for (mean, element) in of_elements.iter_mut().zip(&mesh.elements) {
                    let within = element.nodes().iter().filter(|&&node| inside[node as usize]).count();
                    *mean = temperature.change * within as f64 / element.nodes().len() as f64;
                }
            } else {
                let body = temperature.body.as_ref().and_then(|name| mesh.body(name));
                let elements = body.map_or(0..mesh.elements.len(), |body| body.elements.clone());
                of_elements[elements].fill(temperature.change);
            }
            Applied { temperature, case, of_elements }
        };
        Self { changes: temperatures.into_iter().map(apply).collect() }
    }

    /// Whether no temperature changes.
    pub fn is_empty(&self) -> bool {
        self.changes.is_empty()
    }

    /// Number of changes.
    pub(in crate::equations) fn len(&self) -> usize {
        self.changes.len()
    }

    /// Whether a change ever acts on some of these elements.
    pub(in crate::equations) fn reach(&self, elements: &Range<usize>) -> bool {
        self.changes.iter().any(|applied| applied.of_elements[elements.clone()].iter().any(|change| *change != 0.0))
    }

    /// The change at factor 1 of each element, for every change.
    pub(in crate::equations) fn changes(&self) -> impl Iterator<Item = &[f64]> {
        self.changes.iter().map(|applied| &applied.of_elements[..])
    }

    /// Factors of all changes at pseudo-time `time`.
    pub(in crate::equations) fn factors(&self, LoadTime { case, t }: LoadTime) -> Vec<f64> {
        let acts = |applied: &Applied| applied.case.is_none_or(|own| own == case);
        let of = |applied: &Applied| if acts(applied) { factor(&applied.temperature.amplitude, t) } else { 0.0 };
        self.changes.iter().map(of).collect()
    }

    /// Change of the temperature of every element; empty if no temperature ever changes.
    pub(in crate::equations) fn of_elements(&self, time: LoadTime) -> Vec<f64> {
        let mut changes = vec![0.0; self.changes.first().map_or(0, |applied| applied.of_elements.len())];
        for (applied, factor) in self.changes.iter().zip(self.factors(time)).filter(|(_, factor)| *factor != 0.0) {
            changes.iter_mut().zip(&applied.of_elements).for_each(|(sum, change)| *sum += factor * change);
        }
        changes
    }

    /// Pseudo-times of all waypoints.
    pub(in crate::equations) fn times(&self) -> impl Iterator<Item = LoadTime> {
        self.changes.iter().flat_map(|applied| {
            let case = applied.case.unwrap_or(0);
            applied.temperature.amplitude.iter().map(move |point| LoadTime { case, t: point.t })
        })
    }
}

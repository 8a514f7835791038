//! Pressures that the facets of a slave surface do not resolve.
//!
//! With standard shapes, the multiplier is a combination of the functions of the nodes, and the force on a node divided by
//! its area is a mean of the multipliers around it. Where the pressure is smooth over a few facets, both agree. Where one
//! row of nodes carries all, or where the areas of neighbouring nodes differ much and few of them touch, the multiplier
//! of a node is far above this mean, and changes with the mesh. With dual shapes, the two are the same.
//! Test: `pressures_of_one_node_are_told` (tests/suite/pressures.rs).

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use serde::Serialize;
use slipstick_design::quantity::Quantity;

use crate::equations::{ContactModel, ContactResults, ModelInterface, NodalContact, point_forces};
use crate::words::{counted, quantity};

/// Ratio of the largest multiplier to the largest force per area from which pressures are rough: 1.5 is that of a single
/// row of nodes among equal facets.
const ROUGH: f64 = 1.4;

/// The largest pressure of a contact pair, and what the forces say.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RoughPressure {
    /// Number of the pair.
    pub pair: usize,
    /// Names of slave and master.
    pub surfaces: [String; 2],
    /// The quantity that combines these pressures.
    pub quantity: String,
    /// The load step with the largest traction, counted through all load cases.
    pub step: usize,
    /// The largest magnitude of a multiplier at its end. \[F/L²\]
    pub multiplier: f64,
    /// The largest nodal force divided by the area around the node. \[F/L²\]
    pub force_per_area: f64,
    /// Slave node with the largest multiplier.
    pub node: u32,
    /// Position of that node in the reference configuration. \[L\]
    pub position: [f64; 3],
    /// Number of slave nodes that transmit a force.
    pub nodes: usize,
}

impl fmt::Display for RoughPressure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.position.map(quantity);
        write!(
            f,
            "the facets of `{}` do not resolve the pressures that `{}` combines: at load step {}, the largest traction is {}, at \
             node {}, [{x}, {y}, {z}], but no nodal force divided by its area exceeds {} ({} in contact)",
            self.surfaces[0],
            self.quantity,
            self.step,
            quantity(self.multiplier),
            self.node,
            quantity(self.force_per_area),
            counted(self.nodes, "node"),
        )
    }
}

impl RoughPressure {
    /// The remedy.
    pub fn help(&self) -> String {
        "use `multiplier_shape = \"dual\"`, whose pressures are forces per area, or smaller facets on both sides where they \
         touch; `within` of the quantity leaves out an edge"
            .into()
    }
}

/// The largest pressures so far of the pairs that quantities look at.
#[derive(Debug, Default)]
pub(crate) struct RoughPressures {
    /// By pair: the quantity, and what it combines at the load step with the largest traction.
    worst: BTreeMap<usize, RoughPressure>,
}

impl RoughPressures {
    /// Adds the end of a load step.
    pub fn add(
        &mut self,
        (model, own): (&ContactModel, &[Arc<dyn Quantity>]),
        reference: &[[f64; 3]],
        step: usize,
        contact: &ContactResults,
    ) {
        for (quantity, patch) in own.iter().filter_map(|of| Some((of.name(), of.combines_pressures_of()?))) {
            let pair = patch.pair();
            let own = |of: &&ModelInterface| !of.is_bonded() && !of.interface.is_with_itself();
            let Some(interface) = model.interfaces().get(pair).filter(own) else { continue };
            let Some(nodes) = model.by_pair(&contact.nodes).nth(pair) else { continue };
            let Some(rows) = model.by_pair(&contact.transfer).nth(pair) else { continue };
            let forces = point_forces(nodes, rows);
            let size = |v: &[f64; 3]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
            let (mut largest, mut node, mut force_per_area, mut count) = (0.0, 0, 0.0_f64, 0);
            let touches = |at: &&NodalContact| at.status.is_closed() && at.covered_area > 0.0;
            for at in nodes.iter().filter(touches).filter(|at| patch.contains(at.node)) {
                let multiplier = size(&at.global_multiplier);
                count += 1;
                if multiplier > largest {
                    (largest, node) = (multiplier, at.node);
                }
                let force = forces.get(&at.node).map_or(0.0, size);
                force_per_area = force_per_area.max(force / at.covered_area);
            }
            if largest <= self.worst.get(&pair).map_or(0.0, |known| known.multiplier) {
                continue;
            }
            let found = RoughPressure {
                pair,
                surfaces: interface.surfaces.clone(),
                quantity: quantity.to_owned(),
                step,
                multiplier: largest,
                force_per_area,
                node,
                position: reference.get(node as usize).copied().unwrap_or_default(),
                nodes: count,
            };
            self.worst.insert(pair, found);
        }
    }

    /// Those that are rough.
    pub fn reported(self) -> Vec<RoughPressure> {
        self.worst.into_values().filter(|of| of.multiplier > ROUGH * of.force_per_area).collect()
    }
}

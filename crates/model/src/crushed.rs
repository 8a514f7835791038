//! Void that a march crushes.
//!
//! The stiffness of an element with a low density hardly resists its collapse. Where solid parts move
//! towards each other, or a contact surface is void, such elements invert or contact facets fold, and
//! each failed attempt costs iterations. Energy interpolation avoids this: void then follows linear
//! elasticity, which no deformation can invert.

use std::fmt;

use serde::{Deserialize, Serialize};
use slipstick_design::ElementValues;
use slipstick_path::StateError;

use crate::problem::Problem;

/// Designed elements below this density count as void.
pub const VOID: f64 = 0.3;

/// The cure, with its key in the case file.
pub const CURE: &str =
    "void that follows linear elasticity, which cannot invert: `energy_interpolation = {}` in `[design]`";

/// What to do about void that follows linear elasticity only from an iteration on.
pub const RESCUED: &str =
    "set `energy_interpolation = {}` in `[design]`, so that all commands analyse the design like this";

/// Void that inverted or folded in failed attempts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CrushedVoid {
    /// Failed attempts in which it did.
    pub attempts: usize,
    /// One of the elements.
    pub element: u32,
    /// Name of its body.
    pub body: String,
    /// Its density.
    pub density: f64,
}

impl fmt::Display for CrushedVoid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { attempts, element, body, density } = self;
        let times = if *attempts == 1 { "an attempt".into() } else { format!("{attempts} attempts") };
        write!(
            f,
            "void collapses: {times} at load steps failed because elements of low density inverted or folded, such as \
             element {element} of body `{body}` with the density {density:.3}"
        )
    }
}

impl CrushedVoid {
    /// Says that, because of this, void follows linear elasticity from an iteration on.
    pub fn rescued_from(&self, iteration: usize) -> String {
        format!("{self}; from iteration {iteration} on, void follows linear elasticity")
    }
}

impl Problem {
    /// Void that inverted, or whose contact facets folded, in these failed attempts at a design with
    /// these densities; `None` with energy interpolation.
    pub fn crushed_void<'a>(
        &self,
        density: &ElementValues,
        failed: impl Iterator<Item = &'a StateError>,
    ) -> Option<CrushedVoid> {
        let model = self.analysis.model();
        if model.interpolates_energies() {
            return None;
        }
        let void = |element: &u32| model.is_designed(*element) && density[*element as usize] < VOID;
        let (mut attempts, mut first) = (0, None);
        for error in failed {
            let found = match error {
                StateError::InvertedElements { elements } => elements.iter().copied().find(|element| void(element)),
                StateError::FoldedSurface { node } => self.elements_with(&[*node]).find(void),
                StateError::FoldedFacet { nodes } => self.elements_with(nodes).find(void),
                _ => None,
            };
            attempts += usize::from(found.is_some());
            first = first.or(found);
        }
        let element = first?;
        let body = self.mesh.bodies.iter().find(|body| body.elements.contains(&(element as usize)));
        let body = body.map_or_else(String::new, |body| body.name.clone());
        Some(CrushedVoid { attempts, element, body, density: density[element as usize] })
    }

    /// The elements that have all of these nodes.
    fn elements_with<'a>(&'a self, nodes: &'a [u32]) -> impl Iterator<Item = u32> + 'a {
        let each = (0u32..).zip(&self.mesh.elements);
        each.filter(|(_, element)| nodes.iter().all(|node| element.nodes().contains(node))).map(|(number, _)| number)
    }
}

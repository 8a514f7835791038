//! A problem that can be analysed and, with a design and an objective, optimized.

use crate::analysis::Analysis;
use slipstick_design::{DesignVariables, ElementValues, Quantity};
use slipstick_mesh::Mesh;
use std::sync::Arc;

/// Mesh, model, load path and design: the contents of a case file.
pub struct Problem {
    /// The mesh of all bodies.
    pub mesh: Mesh,
    /// Its analysis.
    pub analysis: Analysis,
    /// Which elements are designed, passive or not part of the design; `None` without a `[design]`.
    pub variables: Option<DesignVariables>,
    /// Densities of all elements at the start (1 outside the design).
    pub initial_density: ElementValues,
    /// Names of the load cases; empty if there is only one load path without a name.
    pub load_cases: Vec<String>,
    /// Quantities that every analysis reports, in addition to those of supports, pairs and bodies.
    pub quantities: Vec<Arc<dyn Quantity>>,
}

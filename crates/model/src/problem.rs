//! A problem that can be analysed and, with a design and an objective, optimized.

use crate::analysis::Analysis;
use slipstick_design::DesignVariables;
use slipstick_mesh::Mesh;

/// Mesh, model, load path and design: what a case file describes.
pub struct Problem {
    /// The mesh of all bodies.
    pub mesh: Mesh,
    /// What solves it.
    pub analysis: Analysis,
    /// Which elements are designed, passive or not part of the design; `None` without a `[design]`.
    pub variables: Option<DesignVariables>,
    /// Densities of all elements at the start (1 outside of the design).
    pub initial_density: Vec<f64>,
    /// Names of the load cases; none where there is but the one load path.
    pub load_cases: Vec<String>,
}

//! A problem that can be analysed and, with a design and an objective, optimized.

use crate::analysis::Analysis;
use slipstick_design::{DensityMap, DesignVariables, ElementValues, Quantity, VariableValues};
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
    /// From their values to densities; `None` without a `[design]`.
    pub map: Option<DensityMap>,
    /// Densities of all elements at the start (1 outside the design).
    pub initial_density: ElementValues,
    /// The variables whose densities these are; `None`: the densities of the designed elements.
    pub initial_variables: Option<VariableValues>,
    /// Names of the load cases; empty if there is only one load path without a name.
    pub load_cases: Vec<String>,
    /// Quantities that every analysis reports, in addition to those of supports, pairs and bodies.
    pub quantities: Vec<Arc<dyn Quantity>>,
}

impl Problem {
    /// Starts from these variables; does nothing without a design.
    pub fn start_from_variables(&mut self, x: VariableValues) {
        let Some(map) = &self.map else { return };
        self.initial_density = map.densities(&x);
        self.initial_variables = Some(x);
    }

    /// Starts from the variables whose values are these densities: a filter blurs them, a
    /// projection sharpens them. The densities of elements that are not designed have no effect.
    pub fn start_from_densities(&mut self, density: &ElementValues) {
        let Some(map) = &self.map else { return };
        self.start_from_variables(map.variables().restrict(density));
    }
}

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
    /// `None` without a `[design]`.
    start: Option<Start>,
    /// Of all elements at the start.
    initial_density: ElementValues,
    /// Names of the load cases; empty if there is only one load path without a name.
    pub load_cases: Vec<String>,
    /// Quantities that every analysis reports, in addition to those of supports, pairs and bodies.
    pub quantities: Vec<Arc<dyn Quantity>>,
}

/// How design variables become densities, and where they start.
struct Start {
    map: DensityMap,
    variables: VariableValues,
}

impl Problem {
    /// A problem without further quantities and names of load cases. `design` maps variables to
    /// densities, and lists the variables at the start; without it, all densities are 1.
    pub fn new(mesh: Mesh, analysis: Analysis, design: Option<(DensityMap, VariableValues)>) -> Self {
        let initial_density = match &design {
            Some((map, variables)) => map.densities(variables),
            None => vec![1.0; mesh.elements.len()].into(),
        };
        let start = design.map(|(map, variables)| Start { map, variables });
        Self { mesh, analysis, start, initial_density, load_cases: Vec::new(), quantities: Vec::new() }
    }

    /// From design variables to densities; `None` without a `[design]`.
    pub fn map(&self) -> Option<&DensityMap> {
        self.start.as_ref().map(|start| &start.map)
    }

    /// Which elements are designed, passive or not part of the design; `None` without a `[design]`.
    pub fn variables(&self) -> Option<&DesignVariables> {
        self.map().map(DensityMap::variables)
    }

    /// The design variables at the start; `None` without a `[design]`.
    pub fn initial_variables(&self) -> Option<&VariableValues> {
        self.start.as_ref().map(|start| &start.variables)
    }

    /// Densities of all elements at the start (1 outside the design).
    pub fn initial_density(&self) -> &ElementValues {
        &self.initial_density
    }

    /// Densities of all elements if the design starts with this one. `None` without a design, or for a density outside
    /// [0, 1].
    pub fn uniform_start(&self, density: f64) -> Option<ElementValues> {
        let map = &self.start.as_ref()?.map;
        Some(map.densities(&map.uniform(density).ok()?))
    }

    /// Starts from variables with these values at the designed elements, or with their mean where
    /// elements share a variable; the other values have no effect. Densities may serve as variables: a filter then blurs
    /// them, and a projection sharpens them. Does nothing without a design.
    pub fn start_from(&mut self, values: &ElementValues) {
        let Some(start) = &mut self.start else { return };
        start.variables = start.map.variables().mean(values);
        self.initial_density = start.map.densities(&start.variables);
    }
}

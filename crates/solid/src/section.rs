//! Material and integration of a body's elements.

use crate::law::Material;
use schemars::JsonSchema;
use serde::Serialize;
use slipstick_mesh::Mesh;

/// How an element uses the deformation gradient.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Formulation {
    /// Unmodified, at each Gauss point. Locks if the material is nearly incompressible.
    #[default]
    Full,
    /// F̄ = (J̄/J)^(1/3) F, where J̄ is the element's mean of J: the volume change is uniform over
    /// the element, which avoids locking of nearly incompressible material.
    FBar,
    /// As `Full`, with 2 × 2 × 2 instead of 3 × 3 × 3 points in hexahedra of second order. These points do not
    /// hold all motions of 27 nodes; of 20 nodes, six motions of a single element have no energy.
    Reduced,
}

/// Material, formulation and mass of a body's elements.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Section {
    /// The solid's law.
    pub material: Material,
    /// The element's formulation.
    pub formulation: Formulation,
    /// Mass per reference volume of the solid, ≥ 0. \[M/L³\]
    pub mass_density: f64,
    /// Coefficient of thermal expansion α: a change ΔT of the temperature stretches by 1 + α ΔT.
    pub thermal_expansion: f64,
    /// Poisson's ratio of elements of density 0, for a bulk modulus that falls faster with the density than the shear
    /// modulus; `None`: both fall alike. It has no effect on laws without a bulk modulus and on those with memory
    /// ([`Material::with_poisson_ratio`]).
    pub void_poisson_ratio: Option<f64>,
}

impl Section {
    /// Elements without mass, thermal expansion and Poisson's ratio of the void.
    pub fn new(material: Material, formulation: Formulation) -> Self {
        Self { material, formulation, mass_density: 0.0, thermal_expansion: 0.0, void_poisson_ratio: None }
    }
}

impl<M: Into<Material>> From<M> for Section {
    /// Fully integrated elements of a material.
    fn from(material: M) -> Self {
        Self::new(material.into(), Formulation::Full)
    }
}

/// The sections of all elements of a mesh: each body has one, and regions of bodies may have others.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sections {
    /// One per body, in the order of the bodies, and then those of regions.
    pub list: Vec<Section>,
    /// The body, and the elements, of each region. Where regions overlap, the last one counts.
    pub regions: Vec<(usize, Vec<u32>)>,
}

impl Sections {
    /// The formulation of each element.
    pub fn formulations(&self, mesh: &Mesh) -> Vec<Formulation> {
        let mut out = vec![Formulation::Full; mesh.elements.len()];
        for (body, section) in mesh.bodies.iter().zip(&self.list) {
            out[body.elements.clone()].fill(section.formulation);
        }
        for ((_, elements), section) in self.regions.iter().zip(&self.list[mesh.bodies.len()..]) {
            elements.iter().for_each(|&element| out[element as usize] = section.formulation);
        }
        out
    }
}

impl<S: Into<Section>> From<Vec<S>> for Sections {
    /// One section per body.
    fn from(sections: Vec<S>) -> Self {
        Self { list: sections.into_iter().map(Into::into).collect(), regions: Vec::new() }
    }
}

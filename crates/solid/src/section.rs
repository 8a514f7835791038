//! What the elements of a body are made of, and how they are integrated.

use crate::law::Material;

/// How an element sees the deformation gradient.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Formulation {
    /// As it is at each Gauss point. Locks where the material is nearly incompressible.
    #[default]
    Full,
    /// F̄ = (J̄/J)^(1/3) F, where J̄ is the element's mean of J: the volume may change only as a whole, which unlocks nearly
    /// incompressible material.
    FBar,
}

/// Material and formulation of a body's elements.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Section {
    /// The solid's law.
    pub material: Material,
    /// The element's formulation.
    pub formulation: Formulation,
}

impl<M: Into<Material>> From<M> for Section {
    /// Fully integrated elements of a material.
    fn from(material: M) -> Self {
        Self { material: material.into(), formulation: Formulation::Full }
    }
}

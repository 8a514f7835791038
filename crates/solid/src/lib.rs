//! Deformable solids: hex8, wedge6, tet4, hex27 and tet10 elements, elastic laws, SIMP-scaled
//! stiffness.
//!
//! Total Lagrangian formulation, 2×2×2 Gauss points in hexahedra and wedges, one in tetrahedra; 3×3×3
//! and eight in quadratic ones. The crate has no notion of time or contact; a density enters only as a scaling of each element's
//! energy ([`simp`], [`interpolation`]).

mod assembly;
mod block;
pub mod body_force;
mod clusters;
mod dual;
mod evaluations;
mod heat;
pub mod hex8;
mod inelastic;
pub mod interpolation;
pub mod law;
pub mod load;
mod memory;
pub mod model;
mod position;
mod power;
mod quadratic;
#[cfg(test)]
mod reference;
mod registers;
pub mod section;
pub mod simp;
mod softened;
pub mod spring;
pub mod stress;
mod tet4;

pub use body_force::{Acceleration, MassiveElements};
pub use evaluations::Evaluation;
pub use inelastic::Energies;
pub use interpolation::{ElementScaling, EnergyInterpolation, Interpolation};
pub use law::*;
pub use memory::{EnergyWeights, SolidAdjoint};
pub use model::{InvertedElements, SolidModel, SolidStep};
pub use section::{Formulation, Section, Sections};
pub use simp::Simp;

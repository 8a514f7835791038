//! Deformable solids: hex8 elements, coupled neo-Hooke, SIMP-scaled stiffness.
//!
//! Total Lagrangian, 2×2×2 Gauss. The crate knows neither time nor contact; a density enters only as a stiffness
//! factor per element ([`simp`]).

mod assembly;
mod clusters;
pub mod hex8;
pub mod material;
pub mod model;
pub mod simp;

pub use material::{MaterialError, NeoHooke};
pub use model::{InvertedElements, SolidModel};
pub use simp::Simp;

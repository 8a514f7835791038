//! Generators of single bodies: watertight, all hexahedra, all outer facets on named surfaces that
//! face outward.
//!
//! Surfaces are called `{body}_{face}`. y is up.

mod box_mesh;
mod half_ball;
mod lattice;
mod round;
mod swept;

pub use box_mesh::{BoxShape, box_mesh};
pub use half_ball::{BallShape, HalfBallShape, ball, half_ball};
pub use round::{HalfRingShape, HollowCylinderShape, half_ring, hollow_cylinder};
pub use swept::{ConeShape, TorusShape, cone, torus};

use crate::MeshError;

/// The length if it is positive and finite.
fn positive(parameter: &str, value: f64) -> Result<f64, MeshError> {
    if value.is_finite() && value > 0.0 {
        Ok(value)
    } else {
        Err(MeshError::parameter(parameter, value, "must be positive and finite"))
    }
}

/// The number of elements if it is at least `least`.
fn at_least(least: usize, parameter: &str, value: usize) -> Result<usize, MeshError> {
    if value >= least {
        Ok(value)
    } else {
        Err(MeshError::parameter(parameter, value, format!("must be at least {least}")))
    }
}

/// Rejects a body without a name, whose surfaces could not be distinguished.
fn named(name: &str) -> Result<(), MeshError> {
    if name.is_empty() { Err(MeshError::parameter("name", "empty", "give the body a name")) } else { Ok(()) }
}

/// Inner and outer radius if they enclose a wall.
fn wall(inner: f64, outer: f64) -> Result<(), MeshError> {
    positive("inner_radius", inner)?;
    positive("outer_radius", outer)?;
    if inner < outer {
        Ok(())
    } else {
        Err(MeshError::parameter("inner_radius", inner, format!("must be less than outer_radius = {outer}")))
    }
}

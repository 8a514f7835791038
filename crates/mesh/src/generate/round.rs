//! Bodies around an axis: the hollow cylinder and the half-ring.

use std::f64::consts::PI;

use super::lattice::Lattice;
use super::{at_least, named, positive, wall};
use crate::{Mesh, MeshError};

/// A tube around the y axis, standing on y = 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HollowCylinderShape {
    /// Radius of the bore. \[L\]
    pub inner_radius: f64,
    /// Outer radius. \[L\]
    pub outer_radius: f64,
    /// Height along y. \[L\]
    pub height: f64,
    /// Elements through the wall (≥ 1), around (≥ 3) and along the axis (≥ 1).
    pub elements: [usize; 3],
}

/// Half a tube with its axis along z, open at the top: the arch extends down from its two ends on
/// y = 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HalfRingShape {
    /// Radius of the outer side. \[L\]
    pub outer_radius: f64,
    /// Radius of the inner side. \[L\]
    pub inner_radius: f64,
    /// Width along z, from −width/2 to width/2. \[L\]
    pub width: f64,
    /// Elements around the half circle (≥ 2), through the wall (≥ 1) and across the width (≥ 1).
    pub elements: [usize; 3],
}

/// A tube of hexahedra, closed in the circumferential direction. Surfaces: `{name}_bottom`, `_top`,
/// `_inner`, `_outer`.
///
/// # Errors
/// [`MeshError::Parameter`] if a size or number of elements is out of range;
/// [`MeshError::TooLarge`] if the numbers do not fit 32 bits.
pub fn hollow_cylinder(name: &str, shape: &HollowCylinderShape) -> Result<Mesh, MeshError> {
    named(name)?;
    wall(shape.inner_radius, shape.outer_radius)?;
    positive("height", shape.height)?;
    let radial = at_least(1, "elements[0] (radial)", shape.elements[0])?;
    let around = at_least(3, "elements[1] (around)", shape.elements[1])?;
    let axial = at_least(1, "elements[2] (axial)", shape.elements[2])?;
    let lattice =
        Lattice { name, elements: shape.elements, closed: true, sides: ["inner", "outer", "", "", "bottom", "top"] };
    lattice.mesh(|[i, j, k]| {
        let radius = between(shape.inner_radius, shape.outer_radius, i, radial);
        let (sine, cosine) = (2.0 * PI * j as f64 / around as f64).sin_cos();
        // Radius, angle, y are right-handed with the angle from x to −z.
        [radius * cosine, between(0.0, shape.height, k, axial), -radius * sine]
    })
}

/// Half a tube of hexahedra. Surfaces: `{name}_outer`, `_inner`, `_ends` (both end faces on y = 0),
/// `_zmin`, `_zmax`.
///
/// # Errors
/// [`MeshError::Parameter`] if a size or number of elements is out of range;
/// [`MeshError::TooLarge`] if the numbers do not fit 32 bits.
pub fn half_ring(name: &str, shape: &HalfRingShape) -> Result<Mesh, MeshError> {
    named(name)?;
    wall(shape.inner_radius, shape.outer_radius)?;
    positive("width", shape.width)?;
    // A single chord through the centre would form no arch.
    let around = at_least(2, "elements[0] (around)", shape.elements[0])?;
    let radial = at_least(1, "elements[1] (radial)", shape.elements[1])?;
    let across = at_least(1, "elements[2] (across)", shape.elements[2])?;
    let lattice = Lattice {
        name,
        elements: [radial, around, across],
        closed: false,
        sides: ["inner", "outer", "ends", "ends", "zmin", "zmax"],
    };
    lattice.mesh(|[i, j, k]| {
        let radius = between(shape.inner_radius, shape.outer_radius, i, radial);
        let (x, y) = down_arc(j, around);
        [radius * x, radius * y, between(-0.5 * shape.width, 0.5 * shape.width, k, across)]
    })
}

/// Point `step` of `steps` on the lower half of the unit circle, from (−1, 0) to (1, 0), the ends
/// exact.
fn down_arc(step: usize, steps: usize) -> (f64, f64) {
    // From the lowest point in both directions: the two halves are mirror images to the last bit.
    let from_lowest = 2.0 * step as f64 / steps as f64 - 1.0;
    if step == 0 || step == steps {
        return (from_lowest, 0.0);
    }
    let (sine, cosine) = (0.5 * PI * from_lowest).sin_cos();
    (sine, -cosine)
}

/// Point `step` of `steps` from `start` to `end`, the ends exact.
fn between(start: f64, end: f64, step: usize, steps: usize) -> f64 {
    if step == steps { end } else { start + (end - start) * (step as f64 / steps as f64) }
}

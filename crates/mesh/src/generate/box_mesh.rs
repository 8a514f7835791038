//! Boxes, with elements of equal or graded size.

use super::lattice::Lattice;
use super::{at_least, named};
use crate::{Mesh, MeshError};

/// A box with faces normal to the axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoxShape {
    /// Corner with the smallest coordinates. \[L\]
    pub min: [f64; 3],
    /// Corner with the largest coordinates. \[L\]
    pub max: [f64; 3],
    /// Elements along x, y, z; each at least 1.
    pub elements: [usize; 3],
    /// Ratio of the last to the first element size along x, y, z; sizes change by a constant
    /// factor; 1 is uniform.
    pub grading: [f64; 3],
}

/// A box of hexahedra. Surfaces: `{name}_xmin`, `_xmax`, `_ymin`, `_ymax`, `_zmin`, `_zmax`.
///
/// # Errors
/// [`MeshError::Parameter`] if a size, number of elements or grading is not positive and finite;
/// [`MeshError::TooLarge`] if the numbers do not fit 32 bits.
pub fn box_mesh(name: &str, shape: &BoxShape) -> Result<Mesh, MeshError> {
    named(name)?;
    let lattice = Lattice {
        name,
        elements: shape.elements,
        closed: false,
        sides: ["xmin", "xmax", "ymin", "ymax", "zmin", "zmax"],
    };
    lattice.points()?;
    let mut ticks: [Vec<f64>; 3] = Default::default();
    for d in 0..3 {
        ticks[d] = graded(d, shape)?;
    }
    lattice.mesh(|index| std::array::from_fn(|d| ticks[d][index[d]]))
}

/// Coordinates of the nodes along direction `d`.
fn graded(d: usize, shape: &BoxShape) -> Result<Vec<f64>, MeshError> {
    let (min, max, ratio) = (shape.min[d], shape.max[d], shape.grading[d]);
    let count = at_least(1, &format!("elements[{d}]"), shape.elements[d])?;
    if !(min.is_finite() && max.is_finite() && (max - min).is_finite() && max > min) {
        let cure = format!("must be finite and greater than min[{d}] = {min}");
        return Err(MeshError::parameter(format!("max[{d}]"), max, cure));
    }
    if !(ratio.is_finite() && ratio > 0.0) {
        let cure = "must be positive and finite; 1 makes all elements equal";
        return Err(MeshError::parameter(format!("grading[{d}]"), ratio, cure));
    }
    // Sizes q⁰ … qⁿ⁻¹ add up to (qⁱ − 1)/(q − 1) at node i; expm1 preserves accuracy near q = 1.
    let log_growth = if count > 1 { ratio.ln() / (count - 1) as f64 } else { 0.0 };
    let share = |i: usize| {
        if log_growth == 0.0 {
            i as f64 / count as f64
        } else {
            (log_growth * i as f64).exp_m1() / (log_growth * count as f64).exp_m1()
        }
    };
    let ticks: Vec<f64> = (0..=count).map(|i| if i == count { max } else { min + (max - min) * share(i) }).collect();
    if ticks.is_sorted_by(|a, b| a < b) {
        Ok(ticks)
    } else {
        let cure = format!("makes elements without length in {min}..{max}: use a ratio closer to 1 or fewer elements");
        Err(MeshError::parameter(format!("grading[{d}]"), ratio, cure))
    }
}

//! Measures the symmetry of a design.

use std::collections::BTreeMap;

use slipstick_design::ElementValues;
use slipstick_mesh::Mesh;

/// Centroids count as equal when they agree to this fraction of the design's extent. Not a round
/// number, because centroids of a regular mesh must not lie on the border between two cells, where
/// round-off decides.
const EQUAL: f64 = 1.234_567e-6;

/// The image that a design is compared with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Image {
    /// Its mirror image about the plane normal to an axis (0: x, 1: y, 2: z).
    Mirror(usize),
    /// Its image under half a turn about an axis.
    HalfTurn(usize),
}

impl Image {
    /// The coordinates that change their sign.
    fn reversed(self) -> [bool; 3] {
        match self {
            Self::Mirror(axis) => std::array::from_fn(|c| c == axis),
            Self::HalfTurn(axis) => std::array::from_fn(|c| c != axis),
        }
    }
}

/// The share of the material without an image: Σ |φ(e) − φ(e′)| V(e) / (2 Σ φ(e) V(e)) over
/// `elements`, where e′ is the image of e about the middle of the elements. 0 is symmetric, 1 has
/// no material in common with its image. `None` if the mesh is not symmetric or there is no
/// material.
///
/// # Panics
/// If there is not one density per element of the mesh, or the axis is above 2.
pub fn asymmetry(mesh: &Mesh, density: &ElementValues, elements: &[usize], image: Image) -> Option<f64> {
    let (Image::Mirror(axis) | Image::HalfTurn(axis)) = image;
    assert!(axis < 3, "an axis of space");
    let reversed = image.reversed();
    assert_eq!(density.len(), mesh.elements.len(), "one density per element");
    let (centroids, volumes) = (mesh.centroids(), mesh.element_volumes());
    let bound = |pick: fn(f64, f64) -> f64, axis: usize, start: f64| {
        elements.iter().map(|&e| centroids[e][axis]).fold(start, pick)
    };
    let low: [f64; 3] = std::array::from_fn(|axis| bound(f64::min, axis, f64::INFINITY));
    let high: [f64; 3] = std::array::from_fn(|axis| bound(f64::max, axis, f64::NEG_INFINITY));
    let cell = EQUAL * (0..3).map(|axis| high[axis] - low[axis]).fold(0.0, f64::max);
    if !(cell > 0.0 && cell.is_finite()) {
        return None;
    }
    let key = |at: [f64; 3]| -> [i64; 3] { std::array::from_fn(|axis| ((at[axis] - low[axis]) / cell).round() as i64) };
    let places: BTreeMap<[i64; 3], usize> = elements.iter().map(|&e| (key(centroids[e]), e)).collect();
    let (mut apart, mut all) = (0.0, 0.0);
    for &e in elements {
        let at = centroids[e];
        let across = std::array::from_fn(|c| if reversed[c] { low[c] + high[c] - at[c] } else { at[c] });
        let image = *places.get(&key(across))?;
        apart += (density[e] - density[image]).abs() * volumes[e];
        all += density[e] * volumes[e];
    }
    (all > 0.0).then_some(apart / (2.0 * all))
}

#[cfg(test)]
mod tests {
    use super::*;
    use slipstick_mesh::{BoxShape, box_mesh};

    /// Computed by hand: of four elements in a row, mirrored about the middle, the first pair
    /// shares 0.2 of 1.2 and the second all of its material.
    #[test]
    fn the_share_without_image_is_measured() {
        let shape = BoxShape { min: [0.0; 3], max: [4.0, 1.0, 1.0], elements: [4, 1, 1], grading: [1.0; 3] };
        let mesh = box_mesh("row", &shape).expect("a mesh");
        let elements: Vec<usize> = (0..4).collect();
        let density = [1.0, 0.5, 0.5, 0.2].into();
        let found = asymmetry(&mesh, &density, &elements, Image::Mirror(0)).expect("a symmetric mesh");
        assert!((found - 2.0 * 0.8 / (2.0 * 2.2)).abs() < 1e-12, "{found}");
        assert_eq!(asymmetry(&mesh, &density, &elements, Image::Mirror(1)), Some(0.0));
        assert_eq!(asymmetry(&mesh, &[0.0; 4].into(), &elements, Image::Mirror(0)), None);
        assert_eq!(asymmetry(&mesh, &density, &[0, 1, 3], Image::Mirror(0)), None);
    }

    /// Computed by hand: two by two elements with material in opposite corners equal their image
    /// under half a turn, and have no material in common with either mirror image.
    #[test]
    fn half_a_turn_is_no_mirror_image() {
        let shape = BoxShape { min: [0.0; 3], max: [2.0, 1.0, 2.0], elements: [2, 1, 2], grading: [1.0; 3] };
        let mesh = box_mesh("square", &shape).expect("a mesh");
        let opposite = |e: usize| {
            let [x, _, z] = mesh.centroid(e);
            if (x > 1.0) == (z > 1.0) { 1.0 } else { 0.0 }
        };
        let elements: Vec<usize> = (0..4).collect();
        let density: ElementValues = elements.iter().map(|&e| opposite(e)).collect();
        let found = |image| asymmetry(&mesh, &density, &elements, image);
        assert_eq!(found(Image::HalfTurn(1)), Some(0.0));
        assert_eq!([0, 1, 2].map(|axis| found(Image::Mirror(axis))), [Some(1.0), Some(0.0), Some(1.0)]);
    }
}

//! How symmetric a design is.

use std::collections::BTreeMap;

use slipstick_mesh::Mesh;

/// Centroids count as equal when they agree to this fraction of the design's extent. No round number: centroids of a
/// regular mesh must not lie at the border between two cells, where round-off decides.
const EQUAL: f64 = 1.234_567e-6;

/// The share of the material without a mirror image: Σ |φ(e) − φ(e′)| V(e) / (2 Σ φ(e) V(e)) over `elements`, where e′
/// mirrors e about the plane through the middle of the elements, normal to `direction` (0: x, 1: y, 2: z). 0 is
/// symmetric, 1 has no material in common with its mirror image. None where the mesh is not symmetric, or without
/// material.
///
/// # Panics
/// If densities are not one per element of the mesh, or `direction` is above 2.
pub fn asymmetry(mesh: &Mesh, density: &[f64], elements: &[usize], direction: usize) -> Option<f64> {
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
        let mut mirrored = centroids[e];
        mirrored[direction] = low[direction] + high[direction] - mirrored[direction];
        let image = *places.get(&key(mirrored))?;
        apart += (density[e] - density[image]).abs() * volumes[e];
        all += density[e] * volumes[e];
    }
    (all > 0.0).then_some(apart / (2.0 * all))
}

#[cfg(test)]
mod tests {
    use super::*;
    use slipstick_mesh::{BoxShape, box_mesh};

    /// By hand: of four elements in a row, mirrored about the middle, the first pair shares 0.2 of 1.2, the second all.
    #[test]
    fn the_share_without_image_is_measured() {
        let shape = BoxShape { min: [0.0; 3], max: [4.0, 1.0, 1.0], elements: [4, 1, 1], grading: [1.0; 3] };
        let mesh = box_mesh("row", &shape).expect("a mesh");
        let elements: Vec<usize> = (0..4).collect();
        let density = [1.0, 0.5, 0.5, 0.2];
        let found = asymmetry(&mesh, &density, &elements, 0).expect("a symmetric mesh");
        assert!((found - 2.0 * 0.8 / (2.0 * 2.2)).abs() < 1e-12, "{found}");
        assert_eq!(asymmetry(&mesh, &density, &elements, 1), Some(0.0));
        assert_eq!(asymmetry(&mesh, &[0.0; 4], &elements, 0), None);
        assert_eq!(asymmetry(&mesh, &density, &[0, 1, 3], 0), None);
    }
}

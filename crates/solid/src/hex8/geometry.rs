//! The parent cube of a hex8 and the reference geometry of an element.

use crate::registers::{AtPoints, POINTS};

/// Signs of the corners in the parent cube, VTK numbering. Gauss point p lies at corner p, divided
/// by √3.
pub(super) const CORNER: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
];

/// ∂N_i/∂ξ_β at point p as `[i][β][p]`, for loops over points.
pub(super) static PARENT_BY_CORNER: [[AtPoints; 3]; 8] = parent_gradients(true);

/// ∂N_i/∂ξ_β at point p as `[p][β][i]`, for loops over corners.
pub(super) static PARENT_BY_POINT: [[[f64; 8]; 3]; POINTS] = parent_gradients(false);

/// ∂N_i/∂ξ_β at all points; the corner is the first or the last index.
const fn parent_gradients(corner_first: bool) -> [[[f64; 8]; 3]; 8] {
    const ABSCISSA: f64 = 0.577_350_269_189_625_8; // 1/√3
    let mut out = [[[0.0; 8]; 3]; 8];
    let mut i = 0;
    while i < 8 {
        let mut p = 0;
        while p < POINTS {
            let mut beta = 0;
            while beta < 3 {
                let (s, x) = (&CORNER[i], &CORNER[p]);
                let (b, c) = ((beta + 1) % 3, (beta + 2) % 3);
                let value = 0.125 * s[beta] * (1.0 + s[b] * x[b] * ABSCISSA) * (1.0 + s[c] * x[c] * ABSCISSA);
                if corner_first {
                    out[i][beta][p] = value;
                } else {
                    out[p][beta][i] = value;
                }
                beta += 1;
            }
            p += 1;
        }
        i += 1;
    }
    out
}

/// The data of an element's reference configuration that its integrals need.
///
/// The gradients of the shape functions themselves are not stored: G_i = ∂N_i/∂X = (∂ξ/∂X)ᵀ
/// ∂N_i/∂ξ, and the second factor is the same for all elements. Reading 0.9 kB instead of 1.6 kB
/// from memory saves more time than computing G_i costs.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C, align(32))]
pub struct ReferenceGeometry {
    /// ∂ξ_β/∂X_B at each point, as `[β][B][point]`. \[1/L\]
    pub(super) inverse: [[AtPoints; 3]; 3],
    /// Weight times det(∂X/∂ξ) at each point. \[L³\]
    pub(super) weights: AtPoints,
    /// ∫ G_i·G_k dV for i ≤ k, row by row. \[L\]
    pub(super) laplacian: [f64; 36],
}

impl ReferenceGeometry {
    /// G_i = ∂N_i/∂X of all corners at a point. \[1/L\]
    pub(crate) fn shape_gradients(&self, point: usize) -> [[f64; 3]; 8] {
        let along = |i: usize, b: usize| {
            (0..3).map(|beta| PARENT_BY_POINT[point][beta][i] * self.inverse[beta][b][point]).sum()
        };
        std::array::from_fn(|i| std::array::from_fn(|b| along(i, b)))
    }

    /// Weight times det(∂X/∂ξ) at a point. \[L³\]
    pub(crate) fn weight(&self, point: usize) -> f64 {
        self.weights[point]
    }

    /// `None` if the Jacobian determinant is not positive at a Gauss point.
    pub fn new(corners: &[[f64; 3]; 8]) -> Option<Self> {
        let mut out = Self { inverse: [[[0.0; POINTS]; 3]; 3], weights: [0.0; POINTS], laplacian: [0.0; 36] };
        for p in 0..POINTS {
            let mut jacobian = [[0.0; 3]; 3];
            for i in 0..8 {
                for a in 0..3 {
                    for b in 0..3 {
                        jacobian[a][b] += corners[i][a] * PARENT_BY_POINT[p][b][i];
                    }
                }
            }
            let (inverse, det) = invert(&jacobian);
            if !(det > 0.0 && det.is_finite()) {
                return None;
            }
            out.weights[p] = det;
            for (beta, row) in inverse.iter().enumerate() {
                for (b, value) in row.iter().enumerate() {
                    out.inverse[beta][b][p] = *value;
                }
            }
            let gradients = out.gradients(p);
            for i in 0..8 {
                for k in i..8 {
                    let dot: f64 = (0..3).map(|b| gradients[i][b] * gradients[k][b]).sum();
                    out.laplacian[pair(i, k)] += det * dot;
                }
            }
        }
        Some(out)
    }

    /// Volume by the quadrature, Σ w. \[L³\]
    pub fn volume(&self) -> f64 {
        self.weights.iter().sum()
    }

    /// G_i = ∂N_i/∂X at one point.
    fn gradients(&self, p: usize) -> [[f64; 3]; 8] {
        let parent = &PARENT_BY_POINT[p];
        std::array::from_fn(|i| {
            std::array::from_fn(|b| (0..3).map(|beta| parent[beta][i] * self.inverse[beta][b][p]).sum())
        })
    }
}

/// Index of the pair i ≤ k among all such pairs, row by row.
#[inline(always)]
pub(super) fn pair(i: usize, k: usize) -> usize {
    const BEFORE: [usize; 8] = [0, 7, 13, 18, 22, 25, 27, 28];
    BEFORE[i] + k
}

/// Inverse and determinant of a 3×3 matrix; the inverse is meaningless if the determinant vanishes.
fn invert(m: &[[f64; 3]; 3]) -> ([[f64; 3]; 3], f64) {
    let cofactor = |a: usize, b: usize| {
        let (a1, a2, b1, b2) = ((a + 1) % 3, (a + 2) % 3, (b + 1) % 3, (b + 2) % 3);
        m[a1][b1] * m[a2][b2] - m[a1][b2] * m[a2][b1]
    };
    let det = m[0][0] * cofactor(0, 0) + m[0][1] * cofactor(0, 1) + m[0][2] * cofactor(0, 2);
    (std::array::from_fn(|a| std::array::from_fn(|b| cofactor(b, a) / det)), det)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Σ_i N_i = 1 and Σ_i ξ_i ⊗ ∂N_i/∂ξ = 1 at every point, in both orders of the indices.
    #[test]
    fn parent_gradients_reproduce_linear_fields() {
        for p in 0..POINTS {
            for beta in 0..3 {
                let by_point: f64 = PARENT_BY_POINT[p][beta].iter().sum();
                assert!(by_point.abs() < 1e-15);
                for a in 0..3 {
                    let sum: f64 = (0..8).map(|i| CORNER[i][a] * PARENT_BY_CORNER[i][beta][p]).sum();
                    assert!((sum - f64::from(a == beta)).abs() < 1e-15);
                }
                for i in 0..8 {
                    assert_eq!(PARENT_BY_CORNER[i][beta][p], PARENT_BY_POINT[p][beta][i]);
                }
            }
        }
    }

    /// By hand: the box [0, 2] × [0, 3] × [0, 4] has volume 24, and ∫ |∇N_0|² dV = V/9
    /// (1/2² + 1/3² + 1/4²).
    #[test]
    fn geometry_of_a_box() {
        let corners = CORNER.map(|c| [1.0 + c[0], 1.5 * (1.0 + c[1]), 2.0 * (1.0 + c[2])]);
        let geometry = ReferenceGeometry::new(&corners).unwrap();
        assert!((geometry.volume() - 24.0).abs() < 1e-13);
        let expected = 24.0 / 9.0 * (0.25 + 1.0 / 9.0 + 1.0 / 16.0);
        assert!((geometry.laplacian[0] - expected).abs() < 1e-14);
        assert!(ReferenceGeometry::new(&corners.map(|x| [-x[0], x[1], x[2]])).is_none());
    }
}

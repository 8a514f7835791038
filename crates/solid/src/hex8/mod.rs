//! One hex8 element: internal force, tangent, energy.
//!
//! With G_i = ∂N_i/∂X at a Gauss point, F = I + Σ d_i ⊗ G_i, J = det F and the spatial gradients g_i = F⁻ᵀ G_i:
//!
//! ```text
//! f_ia     = Σ w 2c (F_aB G_iB − J^(−2β) g_ia)
//! K_ia,kb  = Σ w 2c [ δ_ab G_i·G_k + J^(−2β) (2β g_ia g_kb + g_ka g_ib) ]
//! ```

mod geometry;
pub(crate) mod kernel;
mod power;

pub use geometry::{POINTS, ReferenceGeometry};

use crate::material::NeoHooke;
use kernel::{Deformation, Scratch};
use pulp::{Arch, Simd, WithSimd};

/// Internal force f = ∂W/∂d of the element at displacements `d`. \[F\]. `None` if J ≤ 0 at a Gauss point, or if the
/// force is not finite.
///
/// Paper: (18), (100). Tests: `force_is_the_gradient_of_the_energy`, `reference_element` (tests/reference.rs).
pub fn internal_force(material: &NeoHooke, at: &ReferenceGeometry, d: &[[f64; 3]; 8]) -> Option<[[f64; 3]; 8]> {
    struct Force<'a>(&'a NeoHooke, &'a ReferenceGeometry, &'a [[f64; 3]; 8]);
    impl WithSimd for Force<'_> {
        type Output = Option<[[f64; 3]; 8]>;

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
            kernel::internal_force(simd, &mut Scratch::new(), self.0, self.1, 1.0, self.2)
        }
    }
    Arch::new().dispatch(Force(material, at, d))
}

/// Tangent ∂f/∂d: block (i, k) at `[8 i + k]`, row-major 3×3. \[F/L\]. Symmetric. `None` if J ≤ 0 at a Gauss point.
///
/// Test: `tangent_is_the_derivative_of_the_force`.
pub fn tangent(material: &NeoHooke, at: &ReferenceGeometry, d: &[[f64; 3]; 8], out: &mut [[f64; 9]; 64]) -> Option<()> {
    struct Tangent<'a>(&'a NeoHooke, &'a ReferenceGeometry, &'a [[f64; 3]; 8], &'a mut [[f64; 9]; 64]);
    impl WithSimd for Tangent<'_> {
        type Output = Option<()>;

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
            kernel::tangent(simd, &mut Scratch::new(), self.0, self.1, 1.0, self.2, |i, k, block| {
                self.3[8 * i + k] = block;
                self.3[8 * k + i] = transposed(block);
            })
        }
    }
    Arch::new().dispatch(Tangent(material, at, d, out))
}

/// Transpose of a 3×3 block.
#[inline(always)]
pub(crate) fn transposed(b: [f64; 9]) -> [f64; 9] {
    [b[0], b[3], b[6], b[1], b[4], b[7], b[2], b[5], b[8]]
}

/// Strain energy of the element. \[F L\]. `None` if J ≤ 0 at a Gauss point.
pub fn energy(material: &NeoHooke, at: &ReferenceGeometry, d: &[[f64; 3]; 8]) -> Option<f64> {
    let mut deformation = Deformation::new();
    deformation.evaluate(pulp::Scalar, at, d);
    deformation.is_admissible().then(|| {
        (0..POINTS)
            .map(|p| {
                let i1 = deformation.gradient.as_flattened().iter().map(|f| f[p] * f[p]).sum();
                at.weights[p] * material.energy(deformation.determinant[p], i1)
            })
            .sum()
    })
}

/// Smallest J over the Gauss points: what says how near an element is to inversion. −∞ where J is no number.
pub fn smallest_determinant(at: &ReferenceGeometry, d: &[[f64; 3]; 8]) -> f64 {
    let mut deformation = Deformation::new();
    deformation.evaluate(pulp::Scalar, at, d);
    let smallest = |least: f64, j: f64| if j.is_nan() { f64::NEG_INFINITY } else { least.min(j) };
    deformation.determinant.into_iter().fold(f64::INFINITY, smallest)
}

#[cfg(test)]
mod tests {
    use super::geometry::CORNER;
    use super::*;

    fn element() -> (NeoHooke, ReferenceGeometry, [[f64; 3]; 8]) {
        let corners = std::array::from_fn(|i| {
            let c = CORNER[i];
            [c[0] + 0.1 * c[1] * c[2], 0.8 * c[1] - 0.1 * c[0], 1.2 * c[2] + 0.05 * c[0] * c[1]]
        });
        let d = std::array::from_fn(|i| std::array::from_fn(|a| 0.1 * ((3 * i + a) as f64 * 1.7).sin()));
        (NeoHooke::new(210.0, 0.3).unwrap(), ReferenceGeometry::new(&corners).unwrap(), d)
    }

    #[test]
    fn force_is_the_gradient_of_the_energy() {
        let (material, geometry, d) = element();
        let force = internal_force(&material, &geometry, &d).unwrap();
        for i in 0..8 {
            for a in 0..3 {
                let at = |h: f64| {
                    let mut moved = d;
                    moved[i][a] += h;
                    energy(&material, &geometry, &moved).unwrap()
                };
                let fd = (8.0 * (at(1e-3) - at(-1e-3)) - (at(2e-3) - at(-2e-3))) / 12e-3;
                assert!((fd - force[i][a]).abs() < 1e-7, "{fd} {}", force[i][a]);
            }
        }
    }

    #[test]
    fn tangent_is_the_derivative_of_the_force() {
        let (material, geometry, d) = element();
        let mut k = [[0.0; 9]; 64];
        tangent(&material, &geometry, &d, &mut k).unwrap();
        for node in 0..8 {
            for b in 0..3 {
                let at = |h: f64| {
                    let mut moved = d;
                    moved[node][b] += h;
                    internal_force(&material, &geometry, &moved).unwrap()
                };
                let (p, m, pp, mm) = (at(1e-3), at(-1e-3), at(2e-3), at(-2e-3));
                for i in 0..8 {
                    for a in 0..3 {
                        let fd = (8.0 * (p[i][a] - m[i][a]) - (pp[i][a] - mm[i][a])) / 12e-3;
                        assert!((fd - k[8 * i + node][3 * a + b]).abs() < 1e-7);
                    }
                }
            }
        }
    }

    /// The portable loops and those for the instruction set at hand agree up to round-off.
    #[test]
    fn instruction_sets_agree() {
        let (material, geometry, d) = element();
        let scale = 210.0;
        let found = internal_force(&material, &geometry, &d).unwrap();
        let mut scratch = Scratch::new();
        let portable = kernel::internal_force(pulp::Scalar, &mut scratch, &material, &geometry, 1.0, &d).unwrap();
        for (x, y) in found.as_flattened().iter().zip(portable.as_flattened()) {
            assert!((x - y).abs() < 1e-14 * scale, "{x} {y}");
        }
        let mut k = [[0.0; 9]; 64];
        tangent(&material, &geometry, &d, &mut k).unwrap();
        let mut blocks = 0;
        kernel::tangent(pulp::Scalar, &mut scratch, &material, &geometry, 1.0, &d, |i, j, block| {
            for (x, y) in k[8 * i + j].iter().zip(&block) {
                assert!((x - y).abs() < 1e-14 * scale, "{x} {y}");
            }
            blocks += 1;
        });
        assert_eq!(blocks, 36);
    }

    /// No force, not even round-off, without strain: at rest and after a large translation.
    #[test]
    fn a_translation_has_no_force() {
        let (material, geometry, _) = element();
        for shift in [0.0, 1e6] {
            let d = [[shift, -0.3 * shift, 0.7 * shift]; 8];
            assert_eq!(internal_force(&material, &geometry, &d), Some([[0.0; 3]; 8]));
        }
    }

    #[test]
    fn an_inverted_element_has_no_force() {
        let (material, geometry, mut d) = element();
        d[6] = [-5.0, -5.0, -5.0];
        assert!(internal_force(&material, &geometry, &d).is_none());
        assert!(smallest_determinant(&geometry, &d) < 0.0);
    }
}

//! One hex8 element: internal force, tangent, energy, of any [`Section`].
//!
//! Fully integrated neo-Hooke, with G_i = ∂N_i/∂X at a Gauss point, F = I + Σ d_i ⊗ G_i, J = det F
//! and the spatial gradients g_i = F⁻ᵀ G_i:
//!
//! ```text
//! f_ia     = Σ w 2c (F_aB G_iB − J^(−2β) g_ia)
//! K_ia,kb  = Σ w 2c [ δ_ab G_i·G_k + J^(−2β) (2β g_ia g_kb + g_ka g_ib) ]
//! ```
//!
//! `full.rs` and `f_bar.rs` contain the formulations, `moduli.rs` the tangent of any
//! [law](crate::law), and `kernel.rs` chooses among them. If the energy is interpolated
//! ([`ElementScaling::gamma`] below 1), they are evaluated at γ d, and the integrals of linear
//! elasticity, K(0), are added with the weight 1 − γ².
//!
//! **Wedges** are integrated as hexahedra in which two edges have no length
//! ([`slipstick_mesh::WEDGE_AS_HEX`]). The sums of the shape functions of coincident corners are
//! those of the wedge, so it suffices to add their forces and tangent blocks at the common node.
//! The 2×2×2 points are exact for integrands that are quadratic over the triangle and cubic along
//! the axis. Volume, patch test, and the linear stiffness of a prism between two equal, parallel
//! triangles are therefore exact. All laws, F̄ and the interpolated energy work without a second
//! kernel. The disadvantages: a wedge costs as much as a hexahedron (8 points; 6 would suffice),
//! and in a distorted wedge the integration error depends on which node comes first.
//! Tests: `wedges_deform_uniformly`, `a_wedge_has_the_stiffness_of_its_shape_functions`
//! (tests/suite/wedges.rs).

mod block;
mod f_bar;
mod full;
mod geometry;
mod integrate;
pub(crate) mod interpolated;
pub(crate) mod kernel;
mod moduli;

pub use crate::registers::POINTS;
pub(crate) use block::block;
pub use geometry::ReferenceGeometry;

use crate::interpolation::ElementScaling;
use crate::section::{Formulation, Section};
use kernel::{Deformation, Scratch};
use pulp::{Arch, Simd, WithSimd};

/// Internal force f = ∂W/∂d of the element at displacements `d`. \[F\]. `None` if J ≤ 0 at a Gauss
/// point (at γ d if the energy is interpolated), or if the force is not finite.
///
/// Paper: (18), (100). Test: `kernels_agree_with_the_reference_element`.
pub fn internal_force(
    section: &Section,
    scaling: ElementScaling,
    at: &ReferenceGeometry,
    d: &[[f64; 3]; 8],
) -> Option<[[f64; 3]; 8]> {
    struct Force<'a>(&'a Section, ElementScaling, &'a ReferenceGeometry, &'a [[f64; 3]; 8]);
    impl WithSimd for Force<'_> {
        type Output = Option<[[f64; 3]; 8]>;

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
            interpolated::internal_force(simd, &mut Scratch::new(), self.0, self.2, self.1, self.3)
        }
    }
    Arch::new().dispatch(Force(section, scaling, at, d))
}

/// Tangent ∂f/∂d: block (i, k) at `[8 i + k]`, row-major 3×3. \[F/L\]. Symmetric. `None` as for
/// [`internal_force`].
///
/// Test: `kernels_agree_with_the_reference_element`.
pub fn tangent(
    section: &Section,
    scaling: ElementScaling,
    at: &ReferenceGeometry,
    d: &[[f64; 3]; 8],
    out: &mut [[f64; 9]; 64],
) -> Option<()> {
    struct Tangent<'a> {
        section: &'a Section,
        scaling: ElementScaling,
        at: &'a ReferenceGeometry,
        d: &'a [[f64; 3]; 8],
        out: &'a mut [[f64; 9]; 64],
    }
    impl WithSimd for Tangent<'_> {
        type Output = Option<()>;

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
            let Self { section, scaling, at, d, out } = self;
            interpolated::tangent(simd, &mut Scratch::new(), section, at, scaling, d, |i, k, block| {
                for c in 0..9 {
                    out[8 * i + k][c] += block[c];
                }
            })
        }
    }
    out.fill([0.0; 9]);
    Arch::new().dispatch(Tangent { section, scaling, at, d, out })?;
    for i in 0..8 {
        for k in 0..i {
            out[8 * i + k] = transposed(out[8 * k + i]);
        }
    }
    Some(())
}

/// Transpose of a 3×3 block.
#[inline(always)]
pub(crate) fn transposed(b: [f64; 9]) -> [f64; 9] {
    [b[0], b[3], b[6], b[1], b[4], b[7], b[2], b[5], b[8]]
}

/// Energy W of the element. \[F L\]. `None` if J ≤ 0 at a Gauss point, at γ d if the energy is
/// interpolated.
pub fn energy(section: &Section, scaling: ElementScaling, at: &ReferenceGeometry, d: &[[f64; 3]; 8]) -> Option<f64> {
    let ElementScaling { factor, gamma, .. } = scaling.effective(section.material.small_strains());
    let finite = finite_strain_energy(section, at, &d.map(|d| d.map(|d| gamma * d)))?;
    if gamma == 1.0 {
        return Some(factor * finite);
    }
    // the small-strain energy is the second-order term at rest
    let linear = ElementScaling { factor: 1.0, gamma: 0.0, ..ElementScaling::SOLID };
    let force = internal_force(section, linear, at, d)?;
    let work: f64 = force.as_flattened().iter().zip(d.as_flattened()).map(|(f, d)| f * d).sum();
    Some(factor * (finite + (1.0 - gamma * gamma) * 0.5 * work))
}

fn finite_strain_energy(section: &Section, at: &ReferenceGeometry, d: &[[f64; 3]; 8]) -> Option<f64> {
    let mut deformation = Deformation::new();
    deformation.evaluate(pulp::Scalar, at, d);
    if !deformation.is_admissible() {
        return None;
    }
    let volume: f64 = at.weights.iter().zip(&deformation.determinant).map(|(w, j)| w * j).sum();
    let energies = (0..POINTS).map(|p| {
        let ratio = match section.formulation {
            Formulation::Full | Formulation::Reduced => 1.0,
            Formulation::FBar => (volume / at.volume() / deformation.determinant[p]).cbrt(),
        };
        at.weights[p] * section.material.energy(&deformation.gradient.map(|row| row.map(|f| ratio * f[p])))
    });
    Some(energies.sum())
}

/// Smallest J over the Gauss points, which measures how close an element is to inversion. −∞ if J
/// is not a number.
pub fn smallest_determinant(at: &ReferenceGeometry, d: &[[f64; 3]; 8]) -> f64 {
    let mut deformation = Deformation::new();
    deformation.evaluate(pulp::Scalar, at, d);
    let smallest = |least: f64, j: f64| if j.is_nan() { f64::NEG_INFINITY } else { least.min(j) };
    deformation.determinant.into_iter().fold(f64::INFINITY, smallest)
}

#[cfg(test)]
mod tests;

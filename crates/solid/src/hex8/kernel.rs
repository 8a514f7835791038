//! The element integrals by material and formulation, generic over the instruction set.
//!
//! A register holds a few Gauss points while strains and stresses are computed, and a few corners
//! while they are integrated. Each integral is one function for each law and instruction set (the one
//! detected at run time, [`pulp::Arch`], is used), so that no law slows down the others. It is not
//! inlined into its callers, and takes no closures: otherwise the compiler would repeat it for each
//! of them, which took most of the time of a build.

use super::f_bar::{self, Mean};
use super::full;
use super::geometry::ReferenceGeometry;
use super::integrate::{Corners, displacement_gradient};
use super::moduli::Moduli;
use crate::law::{Stress, with_stress};
use crate::registers::{AtPoints, Matrices, POINTS, invert, once, store, store_matrix};
use crate::section::{Formulation, Section};
use pulp::{Simd, WithSimd};

/// Zero displacements. Small-strain laws are evaluated here, where no element is inverted: the
/// force is K(0) d.
pub(super) const REST: Corners = [[0.0; 3]; 8];

/// F, F⁻¹ and J at the Gauss points.
pub(super) struct Deformation {
    pub gradient: Matrices,
    /// As `[B][a]`.
    pub inverse: Matrices,
    pub determinant: AtPoints,
}

/// Intermediate results of one element. Their memory is reused for the next element, because
/// clearing it every time would take a noticeable part of the time.
pub(crate) struct Scratch {
    pub(super) deformation: Deformation,
    /// Stresses, or gradients of the parent coordinates.
    pub(super) matrices: Matrices,
    /// Spatial gradients times the weight of the point, as `[point][a][i]`.
    pub(super) weighted: [[[f64; 8]; 3]; POINTS],
    /// Spatial gradients g_ia, as `[point][3 i + a]`.
    pub(super) gradients: [[f64; 24]; POINTS],
    /// Sums over the points, see `by_spatial_gradients` in full.rs.
    pub(super) sums: [[f64; 24]; 3],
    /// The result of [`tangent`].
    pub(super) tangent: Pairs,
    pub(super) further: Further,
}

/// The row-major 3×3 blocks of a tangent, for the pairs of corners i ≤ k, at [`pair`](super::geometry::pair).
pub(super) type Pairs = [[f64; 9]; 36];

/// Data that only some materials and formulations need, computed on first use.
#[derive(Default)]
pub(super) struct Further {
    moduli: Option<Box<Moduli>>,
    mean: Option<Box<Mean>>,
}

impl Further {
    #[inline(always)]
    pub fn moduli(&mut self) -> &mut Moduli {
        self.moduli.get_or_insert_with(|| Box::new(Moduli::new()))
    }

    #[inline(always)]
    pub fn mean(&mut self) -> &mut Mean {
        self.mean.get_or_insert_with(|| Box::new(Mean::new()))
    }

    #[inline(always)]
    pub fn both(&mut self) -> (&mut Moduli, &mut Mean) {
        let Self { moduli, mean } = self;
        (moduli.get_or_insert_with(|| Box::new(Moduli::new())), mean.get_or_insert_with(|| Box::new(Mean::new())))
    }
}

impl Scratch {
    pub fn new() -> Self {
        Self {
            deformation: Deformation::new(),
            matrices: [[[0.0; POINTS]; 3]; 3],
            weighted: [[[0.0; 8]; 3]; POINTS],
            gradients: [[0.0; 24]; POINTS],
            sums: [[0.0; 24]; 3],
            tangent: [[0.0; 9]; 36],
            further: Further::default(),
        }
    }
}

impl Deformation {
    pub fn new() -> Self {
        let zero = [[[0.0; POINTS]; 3]; 3];
        Self { gradient: zero, inverse: zero, determinant: [0.0; POINTS] }
    }

    /// Evaluates the deformation at corner displacements `d`. The caller checks whether the element
    /// is admissible.
    #[inline(always)]
    pub fn evaluate<S: Simd>(&mut self, simd: S, at: &ReferenceGeometry, d: &[[f64; 3]; 8]) {
        for v in 0..POINTS / S::F64_LANES {
            let mut f = displacement_gradient(simd, at, d, v);
            for a in 0..3 {
                f[a][a] = simd.add_f64s(f[a][a], simd.splat_f64s(1.0));
            }
            let (inverse, j) = invert(simd, &f);
            store_matrix::<S>(&mut self.gradient, v, &f);
            store_matrix::<S>(&mut self.inverse, v, &inverse);
            store::<S>(&mut self.determinant, v, j);
        }
    }

    /// Whether J is positive and finite at all points; false for NaN.
    #[inline(always)]
    pub fn is_admissible(&self) -> bool {
        let mut admissible = true;
        for j in self.determinant {
            admissible &= j >= f64::MIN_POSITIVE && j.is_finite();
        }
        admissible
    }
}

/// Internal force at stiffness `factor` times that of the material, or `None` if the element is
/// inverted or its force is not finite.
pub(super) fn internal_force<S: Simd>(
    simd: S,
    scratch: &mut Scratch,
    section: &Section,
    at: &ReferenceGeometry,
    factor: f64,
    d: &Corners,
) -> Option<Corners> {
    let formulation = section.formulation;
    with_stress!(S, &section.material, law => once(simd, Force { law, formulation, scratch, at, factor, d }))
}

/// Product of the tangent at stiffness `factor` times that of the material with corner
/// displacements `direction`; `None` as for [`internal_force`].
pub(super) fn tangent_product<S: Simd>(
    simd: S,
    scratch: &mut Scratch,
    section: &Section,
    at: &ReferenceGeometry,
    factor: f64,
    d: &Corners,
    direction: &Corners,
) -> Option<Corners> {
    let formulation = section.formulation;
    with_stress!(S, &section.material, law => {
        once(simd, Product { law, formulation, scratch, at, factor, d, direction })
    })
}

/// Tangent at stiffness `factor` times that of the material, into [`Scratch::tangent`]. `None` if the
/// element is inverted.
pub(super) fn tangent<S: Simd>(
    simd: S,
    scratch: &mut Scratch,
    section: &Section,
    at: &ReferenceGeometry,
    factor: f64,
    d: &Corners,
) -> Option<()> {
    let formulation = section.formulation;
    with_stress!(S, &section.material, law => once(simd, Tangent { law, formulation, scratch, at, factor, d }))
}

struct Force<'a, L> {
    law: L,
    formulation: Formulation,
    scratch: &'a mut Scratch,
    at: &'a ReferenceGeometry,
    factor: f64,
    d: &'a Corners,
}

impl<L: Stress> WithSimd for Force<'_, L> {
    type Output = Option<Corners>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { law, formulation, scratch, at, factor, d } = self;
        if law.small_strains() {
            return once(simd, Product { law, formulation, scratch, at, factor, d: &REST, direction: d });
        }
        match formulation {
            Formulation::Full | Formulation::Reduced => full::internal_force(simd, scratch, &law, at, factor, d),
            Formulation::FBar => f_bar::internal_force(simd, scratch, &law, at, factor, d),
        }
    }
}

struct Product<'a, L> {
    law: L,
    formulation: Formulation,
    scratch: &'a mut Scratch,
    at: &'a ReferenceGeometry,
    factor: f64,
    d: &'a Corners,
    direction: &'a Corners,
}

impl<L: Stress> WithSimd for Product<'_, L> {
    type Output = Option<Corners>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { law, formulation, scratch, at, factor, d, direction } = self;
        let d = if law.small_strains() { &REST } else { d };
        match formulation {
            Formulation::Full | Formulation::Reduced => {
                full::tangent_product(simd, scratch, &law, at, factor, d, direction)
            }
            Formulation::FBar => f_bar::tangent_product(simd, scratch, &law, at, factor, d, direction),
        }
    }
}

struct Tangent<'a, L> {
    law: L,
    formulation: Formulation,
    scratch: &'a mut Scratch,
    at: &'a ReferenceGeometry,
    factor: f64,
    d: &'a Corners,
}

impl<L: Stress> WithSimd for Tangent<'_, L> {
    type Output = Option<()>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { law, formulation, scratch, at, factor, d } = self;
        let d = if law.small_strains() { &REST } else { d };
        match formulation {
            Formulation::Full | Formulation::Reduced => full::tangent(simd, scratch, &law, at, factor, d),
            Formulation::FBar => f_bar::tangent(simd, scratch, &law, at, factor, d),
        }
    }
}

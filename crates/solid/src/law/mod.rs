//! Elastic laws: one file each, one list.
//!
//! A law does not depend on the element. It provides its energy density at a deformation gradient
//! F, and the first Piola–Kirchhoff stress with its derivative at eight points at once; elements
//! integrate these. Elements do not depend on the law: they are written for any `Law`, and
//! `with_law!` selects the law of a body.
//!
//! **To add a law**, write its file, declare it below, add a line to the list and a row to
//! `docs/case_file.md`. Enum, dispatch, the word in case files and their JSON schema follow from
//! the list. The tests also follow from it: they compare every law of the list, in every element,
//! with the derivatives of its energy (`reference.rs`).

mod linear_elastic;
mod neo_hooke;
mod st_venant_kirchhoff;

use crate::registers::{AtPoints, Matrices, Matrix, POINTS, load};
use pulp::Simd;
use std::ops::{Add, Div, Mul, Sub};

/// Generates `Material`, `LawKind` and `with_law!` from the list. The word in front of a law is
/// both the name of its file and its name in case files. `$d` is the dollar sign in the generated
/// macro.
macro_rules! laws {
    ($d:tt $( #[doc = $about:literal] $word:ident: $law:ident, )+) => {
        $( pub use $word::$law; )+

        /// The law of a body with its constants. All laws have the same small-strain limit.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub enum Material {
            $( #[doc = $about] $law($law), )+
        }

        $(
            impl From<$law> for Material {
                fn from(law: $law) -> Self {
                    Self::$law(law)
                }
            }
        )+

        /// A law without its constants: an entry of the list of laws.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum LawKind {
            $( #[doc = $about] $law, )+
        }

        impl LawKind {
            /// All laws, in the order of the documentation.
            pub const ALL: &[Self] = &[$( Self::$law, )+];
            /// Their names in case files, in the same order.
            pub const WORDS: &[&str] = &[$( stringify!($word), )+];

            /// A one-sentence description of the law.
            pub fn about(self) -> &'static str {
                match self {
                    $( Self::$law => $about.trim_ascii(), )+
                }
            }

            /// The law with Young's modulus E \[F/L²\] and Poisson's ratio ν of its small-strain
            /// limit.
            ///
            /// # Errors
            /// E ≤ 0, ν outside (−1, 0.5), or a value that is not finite.
            pub fn with_constants(self, youngs_modulus: f64, poisson_ratio: f64) -> Result<Material, MaterialError> {
                let constants = Constants::new(youngs_modulus, poisson_ratio)?;
                Ok(match self {
                    $( Self::$law => $law::from(constants).into(), )+
                })
            }
        }

        impl Material {
            /// The law, without its constants.
            pub fn kind(&self) -> LawKind {
                match self {
                    $( Self::$law(_) => LawKind::$law, )+
                }
            }
        }

        /// `with_law!(material, law => expression)`: the expression, compiled for each law, with
        /// `law` as the body's.
        macro_rules! with_law {
            ($d material:expr, $d bound:ident => $d body:expr) => {
                match $d material {
                    $( $crate::law::Material::$law($d bound) => $d body, )+
                }
            };
        }
        pub(crate) use with_law;
    };
}

laws! { $
    /// Coupled compressible neo-Hooke. Paper: (100).
    neo_hooke: NeoHooke,
    /// St. Venant-Kirchhoff; softens in compression.
    st_venant_kirchhoff: StVenantKirchhoff,
    /// Hooke's law at small strains; for small displacements and rotations.
    linear_elastic: LinearElastic,
}

impl LawKind {
    /// Its name in case files.
    pub fn word(self) -> &'static str {
        Self::WORDS[self as usize]
    }

    /// The law with the name `word` in case files.
    pub fn from_word(word: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|law| law.word() == word)
    }
}

/// Deformation at the points of register `v`, read on demand.
#[derive(Clone, Copy)]
pub(crate) struct Local<'a> {
    /// F.
    pub gradient: &'a Matrices,
    /// F⁻¹, as `[B][a]`.
    pub inverse: &'a Matrices,
    /// The result of [`Law::volumetric`].
    pub volumetric: &'a AtPoints,
    pub v: usize,
}

impl Local<'_> {
    #[inline(always)]
    pub fn gradient<S: Simd>(&self, a: usize, b: usize) -> S::f64s {
        load::<S>(&self.gradient[a][b], self.v)
    }

    #[inline(always)]
    pub fn inverse<S: Simd>(&self, b: usize, a: usize) -> S::f64s {
        load::<S>(&self.inverse[b][a], self.v)
    }
}

/// An elastic law. Stresses and their changes are divided by the shear modulus.
///
/// Tests: `stresses_are_derivatives_of_the_energy`, `kernels_agree_with_the_reference_element`.
pub(crate) trait Law: Copy {
    /// Constants of the small-strain limit.
    fn constants(&self) -> &Constants;

    /// Energy density Ψ at F, det F > 0. \[F/L²\]. Generic over the type of numbers, so that its
    /// derivatives can be computed with dual numbers.
    fn energy<T: Real>(&self, f: &[[T; 3]; 3]) -> T;

    /// The shear modulus μ of the small-strain limit, the unit of the stresses below. \[F/L²\]
    fn shear_modulus(&self) -> f64;

    /// The quantity that the stress needs from J > 0, at all points.
    #[inline(always)]
    fn volumetric<S: Simd>(&self, _: S, _determinant: &AtPoints) -> AtPoints {
        [0.0; POINTS]
    }

    /// P/μ, where P = ∂Ψ/∂F.
    fn stress<S: Simd>(&self, simd: S, at: &Local<'_>) -> Matrix<S>;

    /// Derivative of P/μ in the direction `change` of F.
    fn stress_change<S: Simd>(&self, simd: S, at: &Local<'_>, change: &Matrix<S>) -> Matrix<S>;

    /// The number e if, with v from [`Law::volumetric`] and A = F⁻¹ dF, the stress changes by
    /// dP/μ = dF + v (e tr(A) F⁻ᵀ + (A F⁻¹)ᵀ). Elements integrate the tangents of such laws more
    /// efficiently.
    #[inline(always)]
    fn volumetric_exponent(&self) -> Option<f64> {
        None
    }

    /// Whether P is linear in ∂u/∂X. Elements evaluate such a law at rest instead of F. Its tangent
    /// is constant, F̄ becomes B̄, which replaces tr ε by its mean over the element, and an
    /// inverted element is not an error.
    #[inline(always)]
    fn small_strains(&self) -> bool {
        false
    }
}

/// Types of numbers for computing an energy: f64 and dual numbers.
pub trait Real:
    Copy + From<f64> + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// ln x.
    fn ln(self) -> Self;
    /// eˣ − 1.
    fn exp_m1(self) -> Self;
}

impl Real for f64 {
    fn ln(self) -> Self {
        self.ln()
    }

    fn exp_m1(self) -> Self {
        self.exp_m1()
    }
}

/// Why a material cannot be built.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum MaterialError {
    /// Young's modulus must be positive and finite.
    #[error("Young's modulus {0} must be positive")]
    YoungsModulus(f64),
    /// Poisson's ratio must lie in (−1, 0.5).
    #[error("Poisson's ratio {0} must be greater than -1 and less than 0.5")]
    PoissonRatio(f64),
}

impl Material {
    /// Young's modulus E of the small-strain limit. \[F/L²\]
    pub fn youngs_modulus(&self) -> f64 {
        self.constants().youngs_modulus
    }

    /// Poisson's ratio ν of the small-strain limit.
    pub fn poisson_ratio(&self) -> f64 {
        self.constants().poisson_ratio
    }

    /// The same law with Young's modulus, and so every stress, times `factor`.
    ///
    /// # Errors
    /// [`MaterialError::YoungsModulus`] if the product is not positive and finite.
    pub fn stiffened(&self, factor: f64) -> Result<Self, MaterialError> {
        self.kind().with_constants(factor * self.youngs_modulus(), self.poisson_ratio())
    }

    /// Energy density Ψ at deformation gradient F, det F > 0 (any F with
    /// [`small_strains`](Self::small_strains)). \[F/L²\]
    pub fn energy<T: Real>(&self, f: &[[T; 3]; 3]) -> T {
        with_law!(self, law => law.energy(f))
    }

    /// Whether this is a small-strain law: its stress is linear in ∂u/∂X, and inverted elements are
    /// not an error.
    #[inline(always)]
    pub fn small_strains(&self) -> bool {
        with_law!(self, law => law.small_strains())
    }

    pub(crate) fn constants(&self) -> &Constants {
        with_law!(self, law => law.constants())
    }
}

/// Constants of the small-strain limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Constants {
    youngs_modulus: f64,
    poisson_ratio: f64,
}

impl Constants {
    fn new(youngs_modulus: f64, poisson_ratio: f64) -> Result<Self, MaterialError> {
        if !(youngs_modulus > 0.0 && youngs_modulus.is_finite()) {
            return Err(MaterialError::YoungsModulus(youngs_modulus));
        }
        if !(poisson_ratio > -1.0 && poisson_ratio < 0.5) {
            return Err(MaterialError::PoissonRatio(poisson_ratio));
        }
        Ok(Self { youngs_modulus, poisson_ratio })
    }

    /// Shear modulus μ = E/(2(1+ν)). \[F/L²\]
    fn shear_modulus(&self) -> f64 {
        self.youngs_modulus / (2.0 * (1.0 + self.poisson_ratio))
    }
}

/// Energy density of Hooke's law, the small-strain limit of all laws, at H = ∂u/∂X. \[F/L²\]
pub(crate) fn small_strain_energy<T: Real>(constants: &Constants, h: &[[T; 3]; 3]) -> T {
    let Constants { youngs_modulus: e, poisson_ratio: nu } = constants;
    let lambda = e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
    let trace = h[0][0] + h[1][1] + h[2][2];
    let strain = |n: usize| T::from(0.5) * (h[n / 3][n % 3] + h[n % 3][n / 3]);
    let squares = (0..9).fold(T::from(0.0), |sum, n| sum + strain(n) * strain(n));
    T::from(0.5 * lambda) * trace * trace + T::from(constants.shear_modulus()) * squares
}

/// Hooke's law: stress divided by μ for twice a strain, `doubled`: λ/(2μ) tr(2ε) 1 + 2ε.
#[inline(always)]
fn hooke<S: Simd>(simd: S, lame_ratio: f64, mut doubled: Matrix<S>) -> Matrix<S> {
    let trace = simd.add_f64s(simd.add_f64s(doubled[0][0], doubled[1][1]), doubled[2][2]);
    let pressure = simd.mul_f64s(simd.splat_f64s(0.5 * lame_ratio), trace);
    for a in 0..3 {
        doubled[a][a] = simd.add_f64s(doubled[a][a], pressure);
    }
    doubled
}

pub(crate) fn determinant<T: Real>(f: &[[T; 3]; 3]) -> T {
    let minor = |a: usize, b: usize| f[1][a] * f[2][b] - f[1][b] * f[2][a];
    f[0][0] * minor(1, 2) - f[0][1] * minor(0, 2) + f[0][2] * minor(0, 1)
}

#[cfg(test)]
mod tests;

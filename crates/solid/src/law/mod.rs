//! Elastic laws: one file for each law, and one list of all laws.
//!
//! A law does not depend on the element. It provides its energy density at a deformation gradient
//! F, and the first Piola–Kirchhoff stress with its derivative at eight points at once; elements
//! integrate these. Elements do not depend on the law: they are written for any `Stress`, and
//! `with_stress!` selects the stress of a body.
//!
//! **To add a law**, write its file with the list of its constants, declare it below, add a line to
//! the list and a row to `docs/case_file/bodies.md`. Enum, dispatch, the words and keys in case files,
//! their checks, their JSON schema and the tests (`reference.rs`) follow from the lists. A further form
//! of a law, which shares its name in case files, goes into the block of other forms and sets `Law::FORM`.

mod any;
mod constants;
mod hencky;
mod invariants;
mod j2;
mod linear_elastic;
pub(crate) mod memory;
mod mooney_rivlin;
mod neo_hooke;
mod neo_hooke_isochoric;
mod neo_hooke_ln;
mod ogden;
mod orthotropic;
mod principal;
mod schema;
mod st_venant_kirchhoff;
mod volume;
mod yeoh;

pub(crate) use any::AnyLaw;
pub use constants::{Constant, Form, Range, Value};
pub use j2::HardeningTable;
pub use memory::HISTORY;

use crate::registers::{AtPoints, Matrices, Matrix, POINTS, load};
use any::any_law;
pub(crate) use constants::Hooke;
use pulp::Simd;
use std::ops::{Add, Div, Mul, Sub};

/// Generates `Material`, `LawKind`, `with_law!` and `with_stress!` from the list. The word in front
/// of a law is both the name of its file and, except for other forms, its name in case files. Element kernels are compiled
/// for each law of the first block but only once for all laws of the second block, so a law in the
/// second block hardly lengthens the build. `$d` is the dollar sign in the generated macros.
macro_rules! laws {
    (
        $d:tt
        own kernels { $( #[doc = $own_about:literal] $own_word:ident: $own:ident, )+ }
        one kernel { $( #[doc = $shared_about:literal] $shared_word:ident: $shared:ident, )+ }
        other forms { $( #[doc = $other_about:literal] $other_file:ident: $other:ident of $other_word:ident, )+ }
        with memory { $( #[doc = $memory_about:literal] $memory_file:ident: $memory:ident of $memory_word:ident, )+ }
    ) => {
        list! {
            $d
            $( #[doc = $own_about] $own_word: $own of $own_word, )+
            $( #[doc = $shared_about] $shared_word: $shared of $shared_word, )+
            $( #[doc = $other_about] $other_file: $other of $other_word, )+
            $( #[doc = $memory_about] $memory_file: $memory of $memory_word, )+
        }

        impl LawKind {
            /// The names of all laws in case files, in the order of the documentation; one name for
            /// all [forms](Self::form) of a law.
            pub const WORDS: &[&str] = &[
                $( stringify!($own_word), )+ $( stringify!($shared_word), )+ $( stringify!($memory_word), )+
            ];

            /// Whether the stress depends on the deformations before, not only on the present one.
            pub fn has_memory(self) -> bool {
                matches!(self, $( Self::$memory )|+)
            }
        }

        /// `with_memory!(material, law => expression)`: the expression, compiled for each law with memory,
        /// with `law` as the body's.
        macro_rules! with_memory {
            ($d material:expr, $d bound:ident => $d body:expr) => {
                match $d material {
                    $( $crate::law::Material::$memory($d bound) => $d body, )+
                    _ => unreachable!("only laws with memory have histories"),
                }
            };
        }
        pub(crate) use with_memory;

        /// `with_stress!(S, &material, law => expression)`: the expression, compiled for each law with
        /// its own kernels, and once for all others, with `law` as the body's [`Stress`]. Without
        /// vector registers, an instruction set S for old processors, it is compiled once for all
        /// laws.
        macro_rules! with_stress {
            ($d simd:ident, $d material:expr, $d bound:ident => $d body:expr) => {
                match $d material {
                    $( $crate::law::Material::$own(law) if const { $d simd::F64_LANES > 1 } => {
                        let $d bound = *law;
                        $d body
                    } )+
                    other => {
                        let $d bound = $crate::law::AnyLaw::new(other);
                        $d body
                    }
                }
            };
        }
        pub(crate) use with_stress;
    };
}

macro_rules! list {
    ( $d:tt $( #[doc = $about:literal] $file:ident: $law:ident of $word:ident, )+ ) => {
        $( pub use $file::$law; )+

        /// The law of a body, with its constants.
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

            /// Its name in case files.
            pub fn word(self) -> &'static str {
                match self {
                    $( Self::$law => stringify!($word), )+
                }
            }

            /// The value of the key `form` in case files, which tells laws with the same
            /// [`word`](Self::word) apart; `None` if there is only one.
            pub fn form(self) -> Option<&'static str> {
                match self {
                    $( Self::$law => $law::FORM, )+
                }
            }

            /// A one-sentence description of the law.
            pub fn about(self) -> &'static str {
                match self {
                    $( Self::$law => $about.trim_ascii(), )+
                }
            }

            /// Its constants, in the order of the documentation.
            pub fn constants(self) -> &'static [Constant] {
                match self {
                    $( Self::$law => $law::CONSTANTS, )+
                }
            }

            /// The law with a value for each of its [`constants`](Self::constants).
            ///
            /// # Errors
            /// If a constant is out of range, or the constants contradict each other.
            ///
            /// # Panics
            /// If the number of values is wrong.
            pub fn with_values(self, values: &[Value]) -> Result<Material, MaterialError> {
                Ok(match self {
                    $( Self::$law => $law::from_values(values)?.into(), )+
                })
            }

            /// A typical material of this law, whose small-strain limit has, at least on average
            /// over all directions, Young's modulus E \[F/L²\] and Poisson's ratio ν. It is used in
            /// examples and tests of all laws.
            ///
            /// # Errors
            /// E ≤ 0, ν outside (−1, 0.5), or a value that is not finite.
            pub fn like(self, youngs_modulus: f64, poisson_ratio: f64) -> Result<Material, MaterialError> {
                constants::check(constants::ELASTIC, &[youngs_modulus.into(), poisson_ratio.into()])?;
                let limit = Hooke::new(youngs_modulus, poisson_ratio);
                Ok(match self {
                    $( Self::$law => $law::like(limit)?.into(), )+
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

        any_law! { $( $law )+ }
    };
}

laws! { $
    own kernels {
        /// Coupled compressible neo-Hooke. Paper: (100).
        neo_hooke: NeoHooke,
        /// St. Venant-Kirchhoff; softens in compression.
        st_venant_kirchhoff: StVenantKirchhoff,
        /// Hooke's law at small strains; for small displacements and rotations.
        linear_elastic: LinearElastic,
    }
    one kernel {
        /// Mooney-Rivlin; rubber up to moderate stretches.
        mooney_rivlin: MooneyRivlin,
        /// Yeoh; filled rubber, stiffening at large stretches.
        yeoh: Yeoh,
        /// Ogden; rubber at any stretch, in principal stretches.
        ogden: Ogden,
        /// Hooke's law in logarithmic strains; metals.
        hencky: Hencky,
        /// Orthotropic elasticity; printed and rolled parts at small strains and any rotation.
        orthotropic: Orthotropic,
    }
    other forms {
        /// Neo-Hooke with the logarithm of J: μ/2 (I₁ − 3) − μ ln J + λ/2 (ln J)².
        neo_hooke_ln: NeoHookeLn of neo_hooke,
        /// Neo-Hooke with split energy: μ/2 (J^(−2/3) I₁ − 3) + K/2 (J − 1)².
        neo_hooke_isochoric: NeoHookeIsochoric of neo_hooke,
    }
    with memory {
        /// J2 plasticity at finite strains with linear hardening; metals.
        j2: J2Linear of j2_linear,
        /// J2 plasticity at finite strains with hardening that saturates (Voce).
        j2: J2Voce of j2_voce,
        /// J2 plasticity at finite strains with hardening by a power law (Swift).
        j2: J2Swift of j2_swift,
        /// J2 plasticity at finite strains with hardening from a table.
        j2: J2Table of j2_table,
    }
}

impl LawKind {
    /// The law with the name `word` in case files, in its default form.
    pub fn from_word(word: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|law| law.word() == word)
    }

    /// All forms of the law with the name `word` in case files, the default first; none if the law
    /// has only one. All have the same constants.
    pub fn forms(word: &str) -> Vec<(&'static str, Self)> {
        Self::ALL.iter().filter(|law| law.word() == word).filter_map(|law| Some((law.form()?, *law))).collect()
    }

    /// The value of the key `form` that a case needs for this law; `None` for a default.
    pub fn form_other_than_default(self) -> Option<&'static str> {
        self.form().filter(|_| Self::from_word(self.word()) != Some(self))
    }
}

/// Deformation at the points of register `v`, read on demand.
#[derive(Clone, Copy)]
pub(crate) struct Local<'a> {
    /// F.
    pub gradient: &'a Matrices,
    /// F⁻¹, as `[B][a]`.
    pub inverse: &'a Matrices,
    /// J.
    pub determinant: &'a AtPoints,
    /// The result of [`Stress::volumetric`].
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

/// An elastic law: its constants and its energy. Its stress is [`Stress`].
///
/// Tests: `stresses_are_derivatives_of_the_energy`, `kernels_agree_with_the_reference_element`.
pub(crate) trait Law: Stress {
    /// The constants, as keys of case files.
    const CONSTANTS: &'static [Constant];

    /// See [`LawKind::form`].
    const FORM: Option<&'static str> = None;

    /// The law with these constants, each of which is in its range.
    ///
    /// # Errors
    /// If they contradict each other, or the undeformed solid would not be stable.
    fn with_constants(values: &[Value]) -> Result<Self, MaterialError>;

    /// See [`LawKind::with_values`].
    fn from_values(values: &[Value]) -> Result<Self, MaterialError> {
        constants::check(Self::CONSTANTS, values)?;
        Self::with_constants(values)
    }

    /// The constants with which it was built.
    fn values(&self) -> Vec<Value>;

    /// See [`LawKind::like`].
    fn like(limit: Hooke) -> Result<Self, MaterialError>;

    /// The small-strain limit, averaged over all directions if the law is anisotropic.
    fn hooke(&self) -> &Hooke;

    /// Energy density Ψ at F, det F > 0. \[F/L²\]. Generic over the type of numbers, so that its
    /// derivatives can be computed with dual numbers.
    fn energy<T: Real>(&self, f: &[[T; 3]; 3]) -> T;

    /// Energy density Ψ_L of the small-strain limit at H = ∂u/∂X: the second-order terms of Ψ. \[F/L²\]
    fn small_strain_energy<T: Real>(&self, h: &[[T; 3]; 3]) -> T {
        self.hooke().energy(h)
    }
}

/// The stress of a law in the form that element kernels need: divided by the shear modulus, at the
/// points of a register.
///
/// Tests: as for [`Law`].
pub(crate) trait Stress: Copy {
    /// Intermediate results at the points of a register that the stress and its changes share.
    type Prepared<S: Simd>: Copy;

    /// The shear modulus μ of the small-strain limit, the unit of the stresses below. \[F/L²\]
    fn shear_modulus(&self) -> f64;

    /// The quantity that the stress needs from J > 0, at all points.
    #[inline(always)]
    fn volumetric<S: Simd>(&self, _: S, _determinant: &AtPoints) -> AtPoints {
        [0.0; POINTS]
    }

    /// Computes the intermediate results that [`stress`](Self::stress) and
    /// [`stress_change`](Self::stress_change) need at these points.
    fn prepare<S: Simd>(&self, simd: S, at: &Local<'_>) -> Self::Prepared<S>;

    /// P/μ, where P = ∂Ψ/∂F.
    fn stress<S: Simd>(&self, simd: S, at: &Local<'_>, prepared: &Self::Prepared<S>) -> Matrix<S>;

    /// Derivative of P/μ in the direction `change` of F.
    fn stress_change<S: Simd>(
        &self,
        simd: S,
        at: &Local<'_>,
        prepared: &Self::Prepared<S>,
        change: &Matrix<S>,
    ) -> Matrix<S>;

    /// The number e, if the stress changes by dP/μ = dF + v (e tr(A) F⁻ᵀ + (A F⁻¹)ᵀ), with v from
    /// [`Stress::volumetric`] and A = F⁻¹ dF. Elements integrate the tangents of such laws more
    /// efficiently.
    #[inline(always)]
    fn volumetric_exponent(&self) -> Option<f64> {
        None
    }

    /// Whether P is linear in ∂u/∂X. Elements evaluate such a law at F = 1. Its tangent is
    /// constant, an inverted element is not an error, and F̄ becomes B̄, which replaces tr ε by its
    /// mean over the element.
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
    /// The number without derivatives, used to decide whether an iteration has converged.
    fn value(self) -> f64;
}

impl Real for f64 {
    fn ln(self) -> Self {
        self.ln()
    }

    fn exp_m1(self) -> Self {
        self.exp_m1()
    }

    fn value(self) -> f64 {
        self
    }
}

/// Why a material cannot be built.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{problem}")]
pub struct MaterialError {
    /// The key of the constant.
    pub key: &'static str,
    /// What is wrong.
    pub problem: String,
    /// How to correct it; empty if that is obvious.
    pub help: &'static str,
}

impl MaterialError {
    fn new(key: &'static str, problem: String, help: &'static str) -> Self {
        Self { key, problem, help }
    }
}

impl Material {
    /// Young's modulus E of the small-strain limit, averaged over all directions if the law is
    /// anisotropic. \[F/L²\]
    pub fn youngs_modulus(&self) -> f64 {
        with_law!(self, law => law.hooke().youngs_modulus)
    }

    /// Poisson's ratio ν of the small-strain limit, averaged over all directions if the law is
    /// anisotropic.
    pub fn poisson_ratio(&self) -> f64 {
        with_law!(self, law => law.hooke().poisson_ratio)
    }

    /// The values of its [constants](LawKind::constants).
    pub fn values(&self) -> Vec<Value> {
        with_law!(self, law => law.values())
    }

    /// Energy density Ψ_L of the small-strain limit at H = ∂u/∂X. \[F/L²\]
    pub fn small_strain_energy<T: Real>(&self, h: &[[T; 3]; 3]) -> T {
        with_law!(self, law => law.small_strain_energy(h))
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

/// F⁻¹.
pub(crate) fn inverse<T: Real>(f: &[[T; 3]; 3]) -> [[T; 3]; 3] {
    let cofactor = |a: usize, b: usize| {
        let (a1, a2, b1, b2) = ((a + 1) % 3, (a + 2) % 3, (b + 1) % 3, (b + 2) % 3);
        f[a1][b1] * f[a2][b2] - f[a1][b2] * f[a2][b1]
    };
    let factor = T::from(1.0) / determinant(f);
    std::array::from_fn(|a| std::array::from_fn(|b| factor * cofactor(b, a)))
}

#[cfg(test)]
mod tests;

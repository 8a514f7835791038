//! One type for all laws; with it, a kernel is compiled once instead of once for each law.

use super::Material;
use crate::registers::once;
use pulp::{Simd, WithSimd};

/// Generates [`AnyLaw`] from the list of laws.
macro_rules! any_law {
    ( $( $law:ident )+ ) => {
        /// [`Stress::Prepared`] of any law.
        #[derive(Clone, Copy)]
        pub(crate) enum Prepared<S: Simd> {
            $( $law(<$law as Stress>::Prepared<S>), )+
        }

        impl Stress for AnyLaw<'_> {
            type Prepared<S: Simd> = Prepared<S>;

            #[inline(always)]
            fn shear_modulus(&self) -> f64 {
                with_law!(self.0, law => law.shear_modulus())
            }

            #[inline(always)]
            fn small_strains(&self) -> bool {
                self.0.small_strains()
            }

            #[inline(always)]
            fn volumetric<S: Simd>(&self, simd: S, determinant: &AtPoints) -> AtPoints {
                with_law!(self.0, law => any::call_once(simd, #[inline(always)] || law.volumetric(simd, determinant)))
            }

            #[inline(always)]
            fn prepare<S: Simd>(&self, simd: S, at: &Local<'_>) -> Prepared<S> {
                match self.0 {
                    $( Material::$law(law) => Prepared::$law(any::call_once(simd, #[inline(always)] || law.prepare(simd, at))), )+
                }
            }

            #[inline(always)]
            fn stress<S: Simd>(&self, simd: S, at: &Local<'_>, prepared: &Prepared<S>) -> Matrix<S> {
                match (self.0, prepared) {
                    $( (Material::$law(law), Prepared::$law(prepared)) => {
                        any::call_once(simd, #[inline(always)] || law.stress(simd, at, prepared))
                    } )+
                    _ => unreachable!("prepared by the same law"),
                }
            }

            #[inline(always)]
            fn stress_change<S: Simd>(
                &self,
                simd: S,
                at: &Local<'_>,
                prepared: &Prepared<S>,
                change: &Matrix<S>,
            ) -> Matrix<S> {
                match (self.0, prepared) {
                    $( (Material::$law(law), Prepared::$law(prepared)) => {
                        any::call_once(simd, #[inline(always)] || law.stress_change(simd, at, prepared, change))
                    } )+
                    _ => unreachable!("prepared by the same law"),
                }
            }
        }
    };
}
pub(super) use any_law;

/// A law that is known only at run time. It never uses the shortcut of
/// [`Stress::volumetric_exponent`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct AnyLaw<'a>(pub(super) &'a Material);

impl<'a> AnyLaw<'a> {
    pub fn new(material: &'a Material) -> Self {
        Self(material)
    }
}

/// Calls a function that is compiled once for an instruction set instead of within every kernel.
#[inline(always)]
pub(super) fn call_once<S: Simd, R>(simd: S, f: impl FnOnce() -> R) -> R {
    once(simd, Call(f))
}

struct Call<F>(F);

impl<R, F: FnOnce() -> R> WithSimd for Call<F> {
    type Output = R;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> R {
        (self.0)()
    }
}

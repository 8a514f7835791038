//! The number formats of the factors.

use super::dense::Register;
use pulp::Simd;
use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

/// Rows and columns of a tile.
pub(super) const SIDE: usize = 8;

/// Single or double precision.
pub(super) trait Scalar:
    Copy
    + Debug
    + PartialOrd
    + Send
    + Sync
    + 'static
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + DivAssign
{
    /// Pivots below this size are rejected; the scaled matrix has entries of about one. In double
    /// precision this is slightly above the round-off that remains for a singular matrix. In single
    /// precision, where even true pivots of ill-conditioned matrices can be smaller than round-off,
    /// it only detects zeros: such factors are still good preconditioners.
    const SMALLEST_PIVOT: f64;
    /// Largest difference between two entries of the scaled matrix that counts as round-off.
    const SYMMETRY: Self;
    const ZERO: Self;
    const ONE: Self;
    /// A register.
    type Vector<S: Simd>: Copy;
    /// Registers of the dense kernels, by instruction set: any, AVX2, AVX-512.
    type Narrow: Register<Self>;
    #[cfg(target_arch = "x86_64")]
    type Middle: Register<Self>;
    #[cfg(target_arch = "x86_64")]
    type Wide: Register<Self>;
    fn from_f64(x: f64) -> Self;
    fn from_i16(x: i16) -> Self;
    /// The nearest integer; halves go away from zero.
    fn round_to_i16(self) -> i16;
    fn to_f64(self) -> f64;
    fn absolute(self) -> Self;
    fn square_root(self) -> Self;
    /// The registers for a column of a tile.
    fn vectors<S: Simd>(x: &[Self; SIDE]) -> &[Self::Vector<S>];
    fn splat<S: Simd>(simd: S, x: Self) -> Self::Vector<S>;
    /// a b + c, with or without rounding of the product.
    fn multiply_add<S: Simd>(simd: S, a: Self::Vector<S>, b: Self::Vector<S>, c: Self::Vector<S>) -> Self::Vector<S>;
    /// Sum of the lanes.
    fn total<S: Simd>(simd: S, x: Self::Vector<S>) -> Self;
}

/// Implements the trait with the registers of a number format.
macro_rules! scalar {
    ($t:ident, $smallest:expr, $registers:ident, $as_simd:ident, $splat:ident, $mul_add:ident, $sum:ident,
     $narrow:literal, $middle:ident, $wide:ident) => {
        impl Scalar for $t {
            const SMALLEST_PIVOT: f64 = $smallest;
            const SYMMETRY: Self = 16.0 * $t::EPSILON;
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            type Vector<S: Simd> = S::$registers;
            type Narrow = [$t; $narrow];
            #[cfg(target_arch = "x86_64")]
            type Middle = std::arch::x86_64::$middle;
            #[cfg(target_arch = "x86_64")]
            type Wide = std::arch::x86_64::$wide;

            fn from_f64(x: f64) -> Self {
                x as $t
            }

            #[inline(always)]
            fn from_i16(x: i16) -> Self {
                x.into()
            }

            #[inline(always)]
            fn round_to_i16(self) -> i16 {
                // `round` would call a library routine in portable builds
                (self + if self < 0.0 { -0.5 } else { 0.5 }) as i16
            }

            fn to_f64(self) -> f64 {
                self.into()
            }

            #[inline(always)]
            fn absolute(self) -> Self {
                self.abs()
            }

            #[inline(always)]
            fn square_root(self) -> Self {
                self.sqrt()
            }

            #[inline(always)]
            fn vectors<S: Simd>(x: &[Self; SIDE]) -> &[Self::Vector<S>] {
                S::$as_simd(x).0
            }

            #[inline(always)]
            fn splat<S: Simd>(simd: S, x: Self) -> Self::Vector<S> {
                simd.$splat(x)
            }

            #[inline(always)]
            fn multiply_add<S: Simd>(
                simd: S,
                a: Self::Vector<S>,
                b: Self::Vector<S>,
                c: Self::Vector<S>,
            ) -> Self::Vector<S> {
                simd.$mul_add(a, b, c)
            }

            #[inline(always)]
            fn total<S: Simd>(simd: S, x: Self::Vector<S>) -> Self {
                simd.$sum(x)
            }
        }
    };
}

scalar!(f64, 1e-14, f64s, as_simd_f64s, splat_f64s, mul_add_e_f64s, reduce_sum_f64s, 2, __m256d, __m512d);
scalar!(f32, 1e-9, f32s, as_simd_f32s, splat_f32s, mul_add_e_f32s, reduce_sum_f32s, 4, __m256, __m512);

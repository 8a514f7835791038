//! Vectorized powers.

use crate::registers::{AtPoints, POINTS, load, store};
use pulp::Simd;
use std::f64::consts::{FRAC_1_SQRT_2, LN_2, LOG2_E};

/// Bits of the fraction of an f64.
const FRACTION: u32 = f64::MANTISSA_DIGITS - 1;
const ONE: u64 = 1.0_f64.to_bits();
/// 2⁵²: in [2⁵², 2⁵³) the spacing of floats is 1, so that the fraction is an integer.
const INTEGERS: f64 = (1_u64 << FRACTION) as f64;
/// Adding this to a small number rounds it to an integer, which is then in the low bits.
const ROUNDING: f64 = 1.5 * INTEGERS;
/// Arguments of the exponential function beyond which its value is replaced by infinity or zero.
const LARGEST: f64 = 708.0;

/// x^(−exponent) of positive normal numbers, relative error about (1 + 2 |exponent ln x|) 2⁻⁵²: the
/// logarithm and its product with the exponent take four roundings of 2⁻⁵³ each, near x = 1 all of
/// them relative to ln x. Exactly 1 at x = 1.
///
/// An overflow gives infinity, an underflow 0. The result is meaningless for anything but a
/// positive normal number; the caller must check this.
///
/// With x = 2ᵏ m and m in [√½, √2): ln x = k ln 2 + 2 artanh s, s = (m − 1)/(m + 1); then exp
/// y = 2ⁿ exp r with |r| ≤ ½ ln 2. Both series are truncated where the next term is below 2⁻⁵⁵ of
/// the result.
#[inline(always)]
pub(crate) fn inverse_power<S: Simd>(simd: S, x: &AtPoints, exponent: f64) -> AtPoints {
    let mut fraction = [0.0; POINTS];
    let mut binary_exponent = [0.0; POINTS];
    for p in 0..POINTS {
        (fraction[p], binary_exponent[p]) = split(x[p]);
    }
    let (mut y, mut n, mut value) = ([0.0; POINTS], [0.0; POINTS], [0.0; POINTS]);
    for v in 0..POINTS / S::F64_LANES {
        let logarithm = logarithm(simd, load::<S>(&fraction, v), load::<S>(&binary_exponent, v));
        let argument = simd.mul_f64s(simd.splat_f64s(-exponent), logarithm);
        let (rounded, remainder) = exponential(simd, argument);
        store::<S>(&mut y, v, argument);
        store::<S>(&mut n, v, rounded);
        store::<S>(&mut value, v, remainder);
    }
    for p in 0..POINTS {
        // The low bits of the rounded number are n: this is 2ⁿ.
        n[p] = f64::from_bits((n[p].to_bits() << FRACTION).wrapping_add(ONE));
    }
    for v in 0..POINTS / S::F64_LANES {
        let (y, product) = (load::<S>(&y, v), simd.mul_f64s(load::<S>(&n, v), load::<S>(&value, v)));
        let (largest, least) = (simd.splat_f64s(LARGEST), simd.splat_f64s(-LARGEST));
        let bounded = simd.select_f64s(simd.less_than_f64s(largest, y), simd.splat_f64s(f64::INFINITY), product);
        let bounded = simd.select_f64s(simd.less_than_f64s(y, least), simd.splat_f64s(0.0), bounded);
        store::<S>(&mut value, v, bounded);
    }
    value
}

/// ln x of positive normal numbers; meaningless for others. Exactly 0 at x = 1, relative error about
/// 2⁻⁵¹.
#[inline(always)]
pub(crate) fn natural_logarithm<S: Simd>(simd: S, x: &AtPoints) -> AtPoints {
    let mut fraction = [0.0; POINTS];
    let mut binary_exponent = [0.0; POINTS];
    for p in 0..POINTS {
        (fraction[p], binary_exponent[p]) = split(x[p]);
    }
    let mut value = [0.0; POINTS];
    for v in 0..POINTS / S::F64_LANES {
        store::<S>(&mut value, v, logarithm(simd, load::<S>(&fraction, v), load::<S>(&binary_exponent, v)));
    }
    value
}

/// x = 2ᵏ m as (m, k).
#[inline(always)]
fn split(x: f64) -> (f64, f64) {
    const LEAST: u64 = FRAC_1_SQRT_2.to_bits();
    let shifted = x.to_bits().wrapping_add(ONE - LEAST);
    let m = f64::from_bits((shifted & ((1 << FRACTION) - 1)) + LEAST);
    let k = f64::from_bits(INTEGERS.to_bits() | (shifted >> FRACTION)) - (INTEGERS + 1023.0);
    (m, k)
}

/// ln (2ᵏ m).
#[inline(always)]
fn logarithm<S: Simd>(simd: S, m: S::f64s, k: S::f64s) -> S::f64s {
    let one = simd.splat_f64s(1.0);
    let s = simd.div_f64s(simd.sub_f64s(m, one), simd.add_f64s(m, one));
    let z = simd.mul_f64s(s, s);
    let twice = simd.add_f64s(s, s);
    let series = simd.mul_f64s(z, polynomial(simd, z, &ARTANH));
    simd.mul_add_e_f64s(k, simd.splat_f64s(LN_2), simd.mul_add_e_f64s(twice, series, twice))
}

/// exp y = 2ⁿ exp r as (n + [`ROUNDING`], exp r).
#[inline(always)]
fn exponential<S: Simd>(simd: S, y: S::f64s) -> (S::f64s, S::f64s) {
    // ln 2 in two parts; the first has so few digits that its product with n is exact.
    const LN_2_HIGH: f64 = f64::from_bits(LN_2.to_bits() & !0xffff_ffff);
    const LN_2_LOW: f64 = LN_2 - LN_2_HIGH;
    let rounded = simd.mul_add_e_f64s(y, simd.splat_f64s(LOG2_E), simd.splat_f64s(ROUNDING));
    let n = simd.sub_f64s(rounded, simd.splat_f64s(ROUNDING));
    let r = simd.negate_mul_add_e_f64s(n, simd.splat_f64s(LN_2_HIGH), y);
    let r = simd.negate_mul_add_e_f64s(n, simd.splat_f64s(LN_2_LOW), r);
    let series = simd.mul_add_e_f64s(simd.mul_f64s(r, r), polynomial(simd, r, &EXP), r);
    (rounded, simd.add_f64s(simd.splat_f64s(1.0), series))
}

/// Σ coefficients[n] xⁿ.
#[inline(always)]
fn polynomial<S: Simd, const N: usize>(simd: S, x: S::f64s, coefficients: &[f64; N]) -> S::f64s {
    let mut sum = simd.splat_f64s(coefficients[N - 1]);
    for n in (0..N - 1).rev() {
        sum = simd.mul_add_e_f64s(sum, x, simd.splat_f64s(coefficients[n]));
    }
    sum
}

/// 1/n for n = 3, 5 … 19.
const ARTANH: [f64; 9] =
    [1.0 / 3.0, 1.0 / 5.0, 1.0 / 7.0, 1.0 / 9.0, 1.0 / 11.0, 1.0 / 13.0, 1.0 / 15.0, 1.0 / 17.0, 1.0 / 19.0];

/// 1/n! for n = 2, 3 … 13.
const EXP: [f64; 12] = {
    let mut out = [0.0; 12];
    let (mut n, mut factorial) = (2, 1.0);
    while n <= 13 {
        factorial *= n as f64;
        out[n - 2] = 1.0 / factorial;
        n += 1;
    }
    out
};

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Expected values: the power function of the standard library.
        #[test]
        fn powers_agree_with_the_library(log in -20.0..20.0, exponent in -1.0..30.0) {
            let x: f64 = f64::exp(log);
            let (found, expected) = (inverse_power(pulp::Scalar, &[x; 8], exponent)[7], x.powf(-exponent));
            let bound = (1.0 + 2.0 * (exponent * log).abs()) * f64::EPSILON;
            prop_assert!((found / expected - 1.0).abs() < bound, "{x}^-{exponent}: {found} {expected}");
        }
    }

    proptest! {
        /// Expected values: the logarithm of the standard library.
        #[test]
        fn logarithms_agree_with_the_library(log in -20.0..20.0) {
            let x: f64 = f64::exp(log);
            let (found, expected) = (natural_logarithm(pulp::Scalar, &[x; 8])[7], x.ln());
            prop_assert!((found - expected).abs() <= 2.0 * f64::EPSILON * expected.abs(), "{x}: {found} {expected}");
        }
    }

    #[test]
    fn limits_are_exact() {
        assert_eq!(natural_logarithm(pulp::Scalar, &[1.0; 8]), [0.0; 8]);
        let [one, large, small, two, ..] =
            inverse_power(pulp::Scalar, &[1.0, 1e-300, 1e300, 2.0, 1.0, 1.0, 1.0, 1.0], 9.0);
        assert_eq!((one, large, small), (1.0, f64::INFINITY, 0.0));
        assert!((two * 512.0 - 1.0).abs() < 1e-15);
        assert_eq!(inverse_power(pulp::Scalar, &[0.3; 8], 0.0), [1.0; 8]);
    }

    /// Expected values: the exponential function of the standard library. The error of ln 2 in two
    /// parts is its own rounding, 0.15 ε of the argument.
    #[test]
    fn exponentials_agree_with_the_library() {
        for y in (-200..=200).map(|k| 3.5 * f64::from(k)) {
            let (shifted, remainder) = exponential(pulp::Scalar, y);
            let n = shifted - ROUNDING;
            assert!((n - y * LOG2_E).abs() <= 0.5 + 1e-9);
            let error = (n.exp2() * remainder / f64::exp(y) - 1.0).abs();
            assert!(error < (2.0 + 0.2 * y.abs()) * f64::EPSILON, "exp {y}: {error:e}");
        }
    }
}

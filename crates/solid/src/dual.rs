//! Dual numbers, with which functions of numbers give exact derivatives.

use crate::law::Real;
use std::ops::{Add, Div, Mul, Sub};

/// x + Σ xₖ′εₖ with εᵢεⱼ = 0: a number and its derivatives in N directions. Nested dual numbers give
/// second derivatives: `slopes[k].slopes[l]`.
#[derive(Debug, Clone, Copy)]
pub struct Dual<T, const N: usize = 1> {
    pub value: T,
    pub slopes: [T; N],
}

impl<T: Real, const N: usize> Dual<T, N> {
    /// f(x), given f and its derivative at the value of x.
    fn chain(self, value: T, derivative: T) -> Self {
        Self { value, slopes: self.slopes.map(|slope| slope * derivative) }
    }
}

impl<T: Real, const N: usize> From<f64> for Dual<T, N> {
    fn from(x: f64) -> Self {
        Self { value: x.into(), slopes: [0.0.into(); N] }
    }
}

macro_rules! rule_of_differentiation {
    ($trait:ident, $name:ident, $x:ident, $y:ident, $k:ident, $value:expr, $slope:expr) => {
        impl<T: Real, const N: usize> $trait for Dual<T, N> {
            type Output = Self;
            fn $name(self, $y: Self) -> Self {
                let ($x, mut slopes) = (self, self.slopes);
                for $k in 0..N {
                    slopes[$k] = $slope;
                }
                Self { value: $value, slopes }
            }
        }
    };
}
rule_of_differentiation!(Add, add, x, y, k, x.value + y.value, x.slopes[k] + y.slopes[k]);
rule_of_differentiation!(Sub, sub, x, y, k, x.value - y.value, x.slopes[k] - y.slopes[k]);
rule_of_differentiation!(Mul, mul, x, y, k, x.value * y.value, x.slopes[k] * y.value + x.value * y.slopes[k]);
rule_of_differentiation!(
    Div,
    div,
    x,
    y,
    k,
    x.value / y.value,
    (x.slopes[k] - x.value / y.value * y.slopes[k]) / y.value
);

impl<T: Real, const N: usize> Real for Dual<T, N> {
    fn ln(self) -> Self {
        Self { value: self.value.ln(), slopes: self.slopes.map(|slope| slope / self.value) }
    }
    fn exp_m1(self) -> Self {
        let value = self.value.exp_m1();
        self.chain(value, value + 1.0.into())
    }
    fn value(self) -> f64 {
        self.value.value()
    }
}

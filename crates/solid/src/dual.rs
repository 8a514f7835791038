//! Dual numbers, with which functions of numbers give exact derivatives.

use crate::law::Real;
use std::ops::{Add, Div, Mul, Sub};

/// x + x′ε with ε² = 0. Nested dual numbers give second derivatives: `slope.slope`.
#[derive(Debug, Clone, Copy)]
pub struct Dual<T> {
    pub value: T,
    pub slope: T,
}

impl<T: Real> From<f64> for Dual<T> {
    fn from(x: f64) -> Self {
        Self { value: x.into(), slope: 0.0.into() }
    }
}

macro_rules! rule_of_differentiation {
    ($trait:ident, $name:ident, $x:ident, $y:ident, $value:expr, $slope:expr) => {
        impl<T: Real> $trait for Dual<T> {
            type Output = Self;
            fn $name(self, $y: Self) -> Self {
                let $x = self;
                Self { value: $value, slope: $slope }
            }
        }
    };
}
rule_of_differentiation!(Add, add, x, y, x.value + y.value, x.slope + y.slope);
rule_of_differentiation!(Sub, sub, x, y, x.value - y.value, x.slope - y.slope);
rule_of_differentiation!(Mul, mul, x, y, x.value * y.value, x.slope * y.value + x.value * y.slope);
rule_of_differentiation!(Div, div, x, y, x.value / y.value, (x.slope - x.value / y.value * y.slope) / y.value);

impl<T: Real> Real for Dual<T> {
    fn ln(self) -> Self {
        Self { value: self.value.ln(), slope: self.slope / self.value }
    }
    fn exp_m1(self) -> Self {
        Self { value: self.value.exp_m1(), slope: self.slope * (self.value.exp_m1() + 1.0.into()) }
    }
    fn value(self) -> f64 {
        self.value.value()
    }
}

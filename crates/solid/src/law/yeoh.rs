//! Yeoh.

use super::constants::{BULK_MODULUS, Hooke};
use super::invariants::{Invariants, Slopes, change_of_shape, trace_and_second};
use super::volume::{self, Volume};
use super::{Constant, Form, Law, Local, MaterialError, Range, Real, Stress, Value};
use crate::registers::{AtPoints, Matrix};
use pulp::Simd;

/// Yeoh's law, for filled rubber, which stiffens at large stretches.
///
/// ```text
/// Ψ = c₁₀ x + c₂₀ x² + c₃₀ x³ + U(J),   x = Ī₁ − 3,   μ = 2 c₁₀
/// ```
///
/// with Ī₁ = J^(−2/3) I₁ and the volumetric energy U that all rubber laws share (`law/volume.rs`).
/// c₂₀ is often negative: shear then softens before it stiffens.
///
/// Reference: Yeoh, Rubber Chem. Technol. 66 (1993) 754–771.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Yeoh {
    /// c₁₀, c₂₀ and c₃₀.
    c: [f64; 3],
    bulk: f64,
    limit: Hooke,
}

impl Yeoh {
    /// From c₁₀, c₂₀, c₃₀ and the bulk modulus K. \[F/L²\]
    ///
    /// # Errors
    /// K ≤ 0, c₁₀ ≤ 0, or a value that is not finite.
    pub fn new(c: [f64; 3], bulk_modulus: f64) -> Result<Self, MaterialError> {
        Self::from_values(&[c[0].into(), c[1].into(), c[2].into(), bulk_modulus.into()])
    }
}

impl Law for Yeoh {
    const CONSTANTS: &'static [Constant] = &[
        Constant {
            key: "c10",
            about: "Factor c₁₀ > 0 of Ī₁ − 3, half the shear modulus. [F/L²]",
            help: "half the shear modulus",
            form: Form::Modulus(Range::Positive),
        },
        Constant {
            key: "c20",
            about: "Factor c₂₀ of (Ī₁ − 3)². [F/L²]",
            help: "the factor of the square; 0 for none",
            form: Form::Modulus(Range::Any),
        },
        Constant {
            key: "c30",
            about: "Factor c₃₀ of (Ī₁ − 3)³. [F/L²]",
            help: "the factor of the cube; 0 for none",
            form: Form::Modulus(Range::Any),
        },
        BULK_MODULUS,
    ];

    fn with_constants(values: &[Value]) -> Result<Self, MaterialError> {
        let [c10, c20, c30, bulk] = [0, 1, 2, 3].map(|i| values[i].number());
        Ok(Self { c: [c10, c20, c30], bulk, limit: Hooke::from_moduli(bulk, 2.0 * c10) })
    }

    fn values(&self) -> Vec<Value> {
        let [c10, c20, c30] = self.c;
        [c10, c20, c30, self.bulk].map(Value::from).to_vec()
    }

    fn like(limit: Hooke) -> Result<Self, MaterialError> {
        Self::new([0.5 * limit.mu, -0.05 * limit.mu, 0.02 * limit.mu], limit.bulk())
    }

    fn hooke(&self) -> &Hooke {
        &self.limit
    }

    fn energy<T: Real>(&self, f: &[[T; 3]; 3]) -> T {
        let (change, u) = volume::energy(self.bulk, f);
        let [first, _] = trace_and_second(f);
        let x = change * first - T::from(3.0);
        let [c10, c20, c30] = self.c.map(T::from);
        (c10 + (c20 + c30 * x) * x) * x + u
    }
}

impl Stress for Yeoh {
    type Prepared<S: Simd> = Invariants<S>;

    #[inline(always)]
    fn shear_modulus(&self) -> f64 {
        self.limit.mu
    }

    #[inline(always)]
    fn volumetric<S: Simd>(&self, simd: S, determinant: &AtPoints) -> AtPoints {
        change_of_shape(simd, determinant)
    }

    #[inline(always)]
    fn prepare<S: Simd>(&self, simd: S, at: &Local<'_>) -> Invariants<S> {
        let over = |c: f64| simd.splat_f64s(c / self.limit.mu);
        let [c10, c20, c30] = self.c;
        Invariants::new(
            simd,
            at,
            Volume::new(simd, at, self.bulk / self.limit.mu),
            #[inline(always)]
            |x| {
                let slope = simd.mul_add_e_f64s(over(3.0 * c30), x, over(2.0 * c20));
                let first = simd.mul_add_e_f64s(slope, x, over(c10));
                let curvature = simd.mul_add_e_f64s(over(6.0 * c30), x, over(2.0 * c20));
                Slopes { first, second: None, curvature: Some(curvature) }
            },
        )
    }

    #[inline(always)]
    fn stress<S: Simd>(&self, simd: S, at: &Local<'_>, prepared: &Invariants<S>) -> Matrix<S> {
        prepared.stress(simd, at)
    }

    #[inline(always)]
    fn stress_change<S: Simd>(
        &self,
        simd: S,
        at: &Local<'_>,
        prepared: &Invariants<S>,
        change: &Matrix<S>,
    ) -> Matrix<S> {
        prepared.stress_change(simd, at, change)
    }
}

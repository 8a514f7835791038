//! Mooney-Rivlin.

use super::constants::{BULK_MODULUS, Hooke};
use super::invariants::{Invariants, Slopes, change_of_shape, trace_and_second};
use super::volume::{self, Volume};
use super::{Constant, Form, Law, Local, MaterialError, Range, Real, Stress, Value};
use crate::registers::{AtPoints, Matrix};
use pulp::Simd;

/// Mooney-Rivlin, for rubber up to moderate stretches.
///
/// ```text
/// Ψ = c₁₀ (Ī₁ − 3) + c₀₁ (Ī₂ − 3) + U(J),   μ = 2 (c₁₀ + c₀₁)
/// ```
///
/// with the deviatoric invariants Ī₁ = J^(−2/3) I₁ and Ī₂ = J^(−4/3) I₂, and the volumetric energy
/// U that all rubber laws share (`law/volume.rs`).
///
/// References: Mooney, J. Appl. Phys. 11 (1940) 582–592; Rivlin, Phil. Trans. R. Soc. Lond. A 241
/// (1948) 379–397.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MooneyRivlin {
    c10: f64,
    c01: f64,
    bulk: f64,
    limit: Hooke,
}

impl MooneyRivlin {
    /// From c₁₀, c₀₁ and the bulk modulus K. \[F/L²\]
    ///
    /// # Errors
    /// K ≤ 0, c₁₀ + c₀₁ ≤ 0, or a value that is not finite.
    pub fn new(c10: f64, c01: f64, bulk_modulus: f64) -> Result<Self, MaterialError> {
        Self::from_values(&[c10.into(), c01.into(), bulk_modulus.into()])
    }
}

impl Law for MooneyRivlin {
    const CONSTANTS: &'static [Constant] = &[
        Constant {
            key: "c10",
            about: "Factor c₁₀ of the first invariant; c₁₀ + c₀₁ > 0. [F/L²]",
            help: "the factor of the first invariant: c10 + c01 is half the shear modulus",
            form: Form::Modulus(Range::Any),
        },
        Constant {
            key: "c01",
            about: "Factor c₀₁ of the second invariant. [F/L²]",
            help: "the factor of the second invariant; 0 if only c10 is known",
            form: Form::Modulus(Range::Any),
        },
        BULK_MODULUS,
    ];

    fn with_constants(values: &[Value]) -> Result<Self, MaterialError> {
        let [c10, c01, bulk] = [0, 1, 2].map(|i| values[i].number());
        let mu = 2.0 * (c10 + c01);
        if !(mu > 0.0) {
            let problem = format!("the shear modulus 2 (c10 + c01) is {mu}: the undeformed solid is not stable");
            return Err(MaterialError::new("c10", problem, "give constants whose sum is greater than zero"));
        }
        Ok(Self { c10, c01, bulk, limit: Hooke::from_moduli(bulk, mu) })
    }

    fn values(&self) -> Vec<Value> {
        [self.c10, self.c01, self.bulk].map(Value::from).to_vec()
    }

    fn like(limit: Hooke) -> Result<Self, MaterialError> {
        Self::new(0.4 * limit.mu, 0.1 * limit.mu, limit.bulk())
    }

    fn hooke(&self) -> &Hooke {
        &self.limit
    }

    fn energy<T: Real>(&self, f: &[[T; 3]; 3]) -> T {
        let (change, u) = volume::energy(self.bulk, f);
        let [first, second] = trace_and_second(f);
        let (first, second) = (change * first - T::from(3.0), change * change * second - T::from(3.0));
        T::from(self.c10) * first + T::from(self.c01) * second + u
    }
}

impl Stress for MooneyRivlin {
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
        let volume = Volume::new(simd, at, self.bulk / self.limit.mu);
        let [first, second] = [self.c10, self.c01].map(|c| simd.splat_f64s(c / self.limit.mu));
        Invariants::new(simd, at, volume, |_| Slopes { first, second: Some(second), curvature: None })
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

//! J2 plasticity at finite strains: von Mises' yield condition with isotropic hardening, the
//! multiplicative split F = Fᵉ Fᵖ, and Hencky's elasticity.
//!
//! ```text
//! bᵉ = F Cᵖ⁻¹ Fᵀ      ε = ½ ln bᵉ      τ = K tr ε 1 + 2μ dev ε      P = τ F⁻ᵀ
//! q = √(3/2) ‖dev τ‖ ≤ k σ_y(α)
//! ```
//!
//! A step starts from Cᵖ⁻¹ and the equivalent plastic strain α of the previous one. The backward
//! exponential map keeps det Cᵖ = 1 exactly, and in logarithmic strains it is the radial return of small
//! strains:
//!
//! ```text
//! q_trial − 3μ Δα = k σ_y(α + Δα)      dev ε = (1 − 3μ Δα/q_trial) dev ε_trial      Cᵖ⁻¹ = F⁻¹ exp(2ε) F⁻ᵀ
//! ```
//!
//! k is the factor by which the density scales the yield stress relative to the stiffness. The history
//! of a point holds Cᵖ⁻¹ − 1 and α, so it is zero at rest.
//!
//! References: Weber, Anand, Comput. Methods Appl. Mech. Engrg. 79 (1990) 173–202; Eterovic, Bathe, Int.
//! J. Numer. Methods Engrg. 30 (1990) 1099–1114; Simo, Comput. Methods Appl. Mech. Engrg. 99 (1992)
//! 61–112. Tests: `uniaxial_stress_is_analytic`, `simple_shear_agrees_with_small_steps`,
//! `derivatives_of_an_update_match_differences`.

mod linear;
mod swift;
mod table;
#[cfg(test)]
mod tests;
mod voce;

pub use linear::Linear;
pub use swift::Swift;
pub use table::Table;
pub use voce::Voce;

use super::constants::{ELASTIC, Hooke};
use super::hencky::Hencky;
use super::memory::{Differentiable, HISTORY, Inelastic, Isotropic, Tensor};
use super::principal::Spectrum;
use super::{Constant, Law, Local, Material, MaterialError, Real, Stress, Value, inverse, with_memory};
use crate::registers::{AtPoints, Matrix};
use pulp::Simd;
use std::array::from_fn;

/// A hardening law: the yield stress σ_y as a function of the equivalent plastic strain α ≥ 0. It must
/// not decrease.
pub trait Hardening: Copy {
    /// The constants of elasticity, then its own.
    const CONSTANTS: &'static [Constant];

    /// From values of its own constants, each of which is in its range.
    ///
    /// # Errors
    /// If they contradict each other.
    fn with_constants(values: &[Value]) -> Result<Self, MaterialError>;

    /// The values of its own constants.
    fn values(&self) -> Vec<Value>;

    /// A hardening for a solid with this Young's modulus, for [`super::LawKind::like`]: so strong that a
    /// solid remains elastic.
    fn like(youngs_modulus: f64) -> Self;

    /// σ_y. \[F/L²\]
    fn yield_stress<R: Real>(&self, strain: R) -> R;

    /// dσ_y/dα ≥ 0. \[F/L²\]
    fn slope(&self, strain: f64) -> f64;

    /// ∫ σ_y dα from 0: the plastic work per volume. \[F/L²\]
    fn work<R: Real>(&self, strain: R) -> R;

    /// The plastic strains of a table that stands for the curve, from 0 to beyond those that occur, and
    /// whether the curve is linear between them.
    fn rows(&self) -> (Vec<f64>, bool);
}

/// J2 plasticity with a hardening law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct J2<H> {
    elastic: Hencky,
    hardening: H,
}

/// J2 plasticity with linear hardening.
pub type J2Linear = J2<Linear>;
/// J2 plasticity with Swift's hardening.
pub type J2Swift = J2<Swift>;
/// J2 plasticity with hardening from a table.
pub type J2Table = J2<Table>;
/// J2 plasticity with Voce's hardening.
pub type J2Voce = J2<Voce>;

/// A curve of hardening as a table.
#[derive(Debug, Clone, PartialEq)]
pub struct HardeningTable {
    /// Equivalent plastic strains, from 0.
    pub strains: Vec<f64>,
    /// True yield stresses. \[F/L²\]
    pub stresses: Vec<f64>,
    /// Whether the curve is linear between the rows.
    pub exact: bool,
}

impl Material {
    /// The curve of hardening, of laws that have one.
    pub fn hardening(&self) -> Option<HardeningTable> {
        fn table<H: Hardening>(law: &J2<H>) -> HardeningTable {
            let (strains, exact) = law.hardening.rows();
            let stresses = strains.iter().map(|strain| law.hardening.yield_stress(*strain)).collect();
            HardeningTable { strains, stresses, exact }
        }
        self.kind().has_memory().then(|| with_memory!(self, law => table(law)))
    }
}

/// ½ ln bᵉ.
fn elastic_strain<R: Differentiable>(f: &Tensor<R>, history: &[R; HISTORY]) -> Tensor<R> {
    let flexible = plastic(history);
    let half = product(f, &flexible);
    let b = from_fn(|i| from_fn(|j| sum(|k| half[i][k] * f[j][k])));
    R::isotropic(&b, Isotropic::Logarithm).map(|row| row.map(|x| R::from(0.5) * x))
}

/// Cᵖ⁻¹.
fn plastic<R: Real>(history: &[R; HISTORY]) -> Tensor<R> {
    let one = R::from(1.0);
    let &[xx, yy, zz, xy, yz, xz, _] = history;
    [[one + xx, xy, xz], [xy, one + yy, yz], [xz, yz, one + zz]]
}

fn sum<R: Real>(term: impl Fn(usize) -> R) -> R {
    term(0) + term(1) + term(2)
}

fn product<R: Real>(a: &Tensor<R>, b: &Tensor<R>) -> Tensor<R> {
    from_fn(|i| from_fn(|j| sum(|k| a[i][k] * b[k][j])))
}

/// The mean of the diagonal, and the deviator.
fn split<R: Real>(strain: &Tensor<R>) -> (R, Tensor<R>) {
    let mean = R::from(1.0 / 3.0) * sum(|i| strain[i][i]);
    (mean, from_fn(|i| from_fn(|j| if i == j { strain[i][j] - mean } else { strain[i][j] })))
}

/// √(3/2) ‖x‖ of a deviator.
fn equivalent<R: Real>(deviator: &Tensor<R>) -> R {
    let square = sum(|i| sum(|j| deviator[i][j] * deviator[i][j]));
    (R::from(0.5) * (R::from(1.5) * square).ln()).exp_m1() + R::from(1.0)
}

impl<H: Hardening> J2<H> {
    /// K tr ε 1 + 2μ dev ε.
    fn kirchhoff_of<R: Real>(&self, mean: R, deviator: &Tensor<R>) -> Tensor<R> {
        let limit = self.elastic.hooke();
        let pressure = R::from(3.0 * limit.bulk()) * mean;
        let stress = deviator.map(|row| row.map(|x| R::from(2.0 * limit.mu) * x));
        from_fn(|i| from_fn(|j| if i == j { stress[i][j] + pressure } else { stress[i][j] }))
    }

    /// Δα of the return from q_trial, without derivatives.
    fn flow(&self, trial: f64, strain: f64, strength: f64) -> f64 {
        let modulus = 3.0 * self.elastic.hooke().mu;
        let excess = |x: f64| trial - modulus * x - strength * self.hardening.yield_stress(strain + x);
        // the yield stress does not decrease, so the root lies between these
        let (mut low, mut high) = (0.0, excess(0.0) / modulus);
        let mut x = 0.0;
        for _ in 0..60 {
            let value = excess(x);
            if value >= 0.0 {
                low = x
            } else {
                high = x
            }
            let next = x + value / (modulus + strength * self.hardening.slope(strain + x));
            let next = if next > low && next < high { next } else { 0.5 * (low + high) };
            if (next - x).abs() <= 1e-16 * (strain + x) || value.abs() <= 1e-15 * trial {
                break;
            }
            x = next;
        }
        x
    }
}

impl<H: Hardening> Inelastic for J2<H> {
    fn update<R: Differentiable>(
        &self,
        f: &Tensor<R>,
        previous: &[R; HISTORY],
        strength: R,
    ) -> (Tensor<R>, [R; HISTORY]) {
        let (mean, trial) = split(&elastic_strain(f, previous));
        let back = inverse(f);
        let piola = |deviator: &Tensor<R>| -> Tensor<R> {
            let stress = self.kirchhoff_of(mean, deviator);
            from_fn(|i| from_fn(|j| sum(|k| stress[i][k] * back[j][k])))
        };
        let shear = self.elastic.hooke().mu;
        let values = trial.map(|row| row.map(Real::value));
        let size = 2.0 * shear * (1.5 * values.as_flattened().iter().map(|x| x * x).sum::<f64>()).sqrt();
        let limit = strength.value() * self.hardening.yield_stress(previous[HISTORY - 1].value());
        if !(size > limit) {
            return (piola(&trial), *previous);
        }
        let q = R::from(2.0 * shear) * equivalent(&trial);
        let (strain, modulus) = (previous[HISTORY - 1], R::from(3.0 * shear));
        let flow = self.flow(q.value(), strain.value(), strength.value());
        // one step of Newton's method with derivatives: exact at the root
        let at = strain + R::from(flow);
        let excess = q - modulus * R::from(flow) - strength * self.hardening.yield_stress(at);
        let slope = 3.0 * shear + strength.value() * self.hardening.slope(at.value());
        let flow = R::from(flow) + excess / R::from(slope);
        let share = R::from(1.0) - modulus * flow / q;
        let deviator = trial.map(|row| row.map(|x| share * x));
        let doubled: Tensor<R> =
            from_fn(|i| from_fn(|j| R::from(2.0) * if i == j { deviator[i][j] + mean } else { deviator[i][j] }));
        let b = R::isotropic(&doubled, Isotropic::Exponential);
        let half = product(&back, &b);
        let flexible: Tensor<R> = from_fn(|i| from_fn(|j| sum(|k| half[i][k] * back[j][k])));
        let entry = |i: usize, j: usize| if i == j { flexible[i][j] - R::from(1.0) } else { flexible[i][j] };
        let history = [entry(0, 0), entry(1, 1), entry(2, 2), entry(0, 1), entry(1, 2), entry(0, 2), strain + flow];
        (piola(&deviator), history)
    }

    fn kirchhoff<R: Differentiable>(&self, f: &Tensor<R>, history: &[R; HISTORY]) -> Tensor<R> {
        let (mean, deviator) = split(&elastic_strain(f, history));
        self.kirchhoff_of(mean, &deviator)
    }

    fn energies<R: Differentiable>(&self, f: &Tensor<R>, history: &[R; HISTORY], strength: R) -> [R; 2] {
        let elastic = self.elastic.hooke().energy(&elastic_strain(f, history));
        [elastic, strength * self.hardening.work(history[HISTORY - 1])]
    }
}

impl<H: Hardening> Law for J2<H> {
    const CONSTANTS: &'static [Constant] = H::CONSTANTS;

    fn with_constants(values: &[Value]) -> Result<Self, MaterialError> {
        let (elastic, rest) = values.split_at(ELASTIC.len());
        Ok(Self { elastic: Hencky::with_constants(elastic)?, hardening: H::with_constants(rest)? })
    }

    fn values(&self) -> Vec<Value> {
        let mut values = self.elastic.values();
        values.extend(self.hardening.values());
        values
    }

    fn like(limit: Hooke) -> Result<Self, MaterialError> {
        Ok(Self { elastic: Hencky::like(limit)?, hardening: H::like(limit.youngs_modulus) })
    }

    fn hooke(&self) -> &Hooke {
        self.elastic.hooke()
    }

    /// Before any plastic strain.
    fn energy<T: Real>(&self, f: &Tensor<T>) -> T {
        self.elastic.energy(f)
    }
}

/// The stress before any plastic strain.
impl<H: Hardening> Stress for J2<H> {
    type Prepared<S: Simd> = Spectrum<S>;

    #[inline(always)]
    fn shear_modulus(&self) -> f64 {
        self.elastic.shear_modulus()
    }

    #[inline(always)]
    fn volumetric<S: Simd>(&self, simd: S, determinant: &AtPoints) -> AtPoints {
        self.elastic.volumetric(simd, determinant)
    }

    #[inline(always)]
    fn prepare<S: Simd>(&self, simd: S, at: &Local<'_>) -> Spectrum<S> {
        self.elastic.prepare(simd, at)
    }

    #[inline(always)]
    fn stress<S: Simd>(&self, simd: S, at: &Local<'_>, prepared: &Spectrum<S>) -> Matrix<S> {
        self.elastic.stress(simd, at, prepared)
    }

    #[inline(always)]
    fn stress_change<S: Simd>(&self, simd: S, at: &Local<'_>, prepared: &Spectrum<S>, change: &Matrix<S>) -> Matrix<S> {
        self.elastic.stress_change(simd, at, prepared, change)
    }
}

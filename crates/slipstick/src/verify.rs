//! The gradient against finite differences of the objective, on the user's own model.
//!
//! For a direction v in the design space and a step h, the central difference (θ(φ+hv) − θ(φ−hv))/2h is compared with
//! the adjoint's dθ/dφ · v, and the remainder |θ(φ+hv) − θ(φ) − h dθ/dφ·v| with h². A slave node that changes its status
//! between φ − hv and φ + hv makes θ kink there; that is reported as a kink, because no difference quotient across it
//! means anything.

use crate::analysis::{Analysis, AnalysisError, Forward};
use serde::Serialize;
use slipstick_path::{MarchObserver, Tolerance, Tolerances};

/// Difference of the one-sided quotients, over the derivative, that counts as none.
const ROUNDING_APART: f64 = 1e-6;

/// What to compare.
#[derive(Debug, Clone, PartialEq)]
pub struct VerifyOptions {
    /// Number of random directions over all designed elements.
    pub directions: usize,
    /// Number of single elements, spread over the design.
    pub elements: usize,
    /// Largest step in density; smaller ones follow by halving.
    pub step: f64,
    /// How often the step is halved.
    pub halvings: u32,
    /// Relative tolerance of the forward analyses.
    pub forward_tolerance: f64,
}

impl Default for VerifyOptions {
    fn default() -> Self {
        Self { directions: 2, elements: 3, step: 1e-3, halvings: 4, forward_tolerance: 1e-11 }
    }
}

/// One difference quotient.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Quotient {
    /// Step h.
    pub step: f64,
    /// Central difference.
    pub difference: f64,
    /// |difference − adjoint| / max(|adjoint|, noise-free size of the gradient in this direction).
    pub relative_error: f64,
    /// |θ(φ+hv) − θ(φ) − h dθ/dφ·v|.
    pub remainder: f64,
    /// log₂ of the remainder's ratio to that of twice the step: 2 where θ is smooth.
    pub order: Option<f64>,
    /// Slave nodes that change status between φ − hv, φ and φ + hv, as (user step, global node), where θ's one-sided
    /// differences disagree too; empty: no kink.
    pub kink: Vec<(usize, u32)>,
}

/// All quotients along one direction.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DirectionCheck {
    /// What was varied: "element 17 (body plate)" or "random direction 1".
    pub name: String,
    /// dθ/dφ · v from the adjoint.
    pub adjoint: f64,
    /// Quotients, largest step first.
    pub quotients: Vec<Quotient>,
    /// Smallest relative error among the quotients without a kink; `None` if all have one.
    pub best: Option<f64>,
}

/// Outcome of a verification.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GradientCheck {
    /// θ.
    pub objective: f64,
    /// Euclidean norm of dθ/dφ over the designed elements.
    pub gradient_norm: f64,
    /// Direction by direction.
    pub directions: Vec<DirectionCheck>,
    /// Largest of the directions' best errors; `None` if every direction has a kink at every step.
    pub worst: Option<f64>,
}

/// Compares adjoint and differences at `density`; `designed` are the elements that may vary.
///
/// The forward tolerances are tightened for the purpose and restored. Directions leave out elements whose density is so
/// near to 0 or 1 that a step would leave [0, 1].
///
/// # Errors
/// [`AnalysisError`] if an analysis fails.
pub fn verify_gradient(
    analysis: &mut Analysis,
    density: &[f64],
    designed: &[u32],
    options: &VerifyOptions,
    observer: &mut dyn MarchObserver,
) -> Result<GradientCheck, AnalysisError> {
    let saved = (analysis.march.newton, analysis.model.method().clone());
    let bound = Tolerance::Relative(options.forward_tolerance);
    analysis.march.newton.tolerances =
        Tolerances { residual: bound, displacement: bound, contact: bound, multiplier: bound };
    analysis.march.newton.max_iterations += 5;
    analysis.march.newton.linear_tolerance = 1e-12;
    analysis.model.set_uzawa_tolerance(options.forward_tolerance);
    let result = compare(analysis, density, designed, options, observer);
    analysis.march.newton = saved.0;
    analysis.model.set_method(saved.1);
    result
}

fn compare(
    analysis: &mut Analysis,
    density: &[f64],
    designed: &[u32],
    options: &VerifyOptions,
    observer: &mut dyn MarchObserver,
) -> Result<GradientCheck, AnalysisError> {
    let base = analysis.forward(density, observer)?;
    let gradient = analysis.gradient(&base)?;
    let free: Vec<u32> = designed
        .iter()
        .copied()
        .filter(|&e| (options.step..=1.0 - options.step).contains(&density[e as usize]))
        .collect();
    let norm = free.iter().map(|&e| gradient[e as usize].powi(2)).sum::<f64>().sqrt();
    let mut directions = Vec::new();
    for (name, direction) in directions_of(&free, density.len(), options) {
        directions.push(along(analysis, density, &base, &gradient, norm, name, &direction, options, observer)?);
    }
    let worst = directions.iter().filter_map(|d| d.best).reduce(f64::max);
    Ok(GradientCheck { objective: base.value, gradient_norm: norm, directions, worst })
}

fn directions_of(free: &[u32], elements: usize, options: &VerifyOptions) -> Vec<(String, Vec<f64>)> {
    let mut all = Vec::new();
    if free.is_empty() {
        return all;
    }
    for k in 0..options.directions {
        // a fixed sequence of signs and sizes (SplitMix64), so that a report can be repeated
        let mut state = 0x9E37_79B9_7F4A_7C15u64.wrapping_mul(k as u64 + 1);
        let mut direction = vec![0.0; elements];
        for &e in free {
            state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
            let mut z = state;
            z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
            direction[e as usize] = (z ^ (z >> 31)) as f64 / u64::MAX as f64 * 2.0 - 1.0;
        }
        all.push((format!("random direction {}", k + 1), direction));
    }
    let count = options.elements.min(free.len());
    for k in 0..count {
        let e = free[(2 * k + 1) * free.len() / (2 * count)];
        let mut direction = vec![0.0; elements];
        direction[e as usize] = 1.0;
        all.push((format!("element {e}"), direction));
    }
    all
}

fn along(
    analysis: &mut Analysis,
    density: &[f64],
    base: &Forward,
    gradient: &[f64],
    norm: f64,
    name: String,
    direction: &[f64],
    options: &VerifyOptions,
    observer: &mut dyn MarchObserver,
) -> Result<DirectionCheck, AnalysisError> {
    let adjoint: f64 = gradient.iter().zip(direction).map(|(g, v)| g * v).sum();
    let size = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
    // a direction nearly orthogonal to the gradient is measured against the gradient's typical share in it
    let count = direction.iter().filter(|v| **v != 0.0).count().max(1) as f64;
    let scale = adjoint.abs().max(1e-3 * norm * size / count.sqrt()).max(f64::MIN_POSITIVE);
    let mut quotients: Vec<Quotient> = Vec::new();
    let mut last_apart = None;
    for k in 0..=options.halvings {
        let h = options.step * 0.5f64.powi(k as i32);
        let mut at = |sign: f64| -> Result<Forward, AnalysisError> {
            let moved: Vec<f64> = density.iter().zip(direction).map(|(d, v)| d + sign * h * v).collect();
            analysis.forward(&moved, observer)
        };
        let (plus, minus) = (at(1.0)?, at(-1.0)?);
        let difference = (plus.value - minus.value) / (2.0 * h);
        let remainder = (plus.value - base.value - h * adjoint).abs();
        let order = quotients.last().map(|q| (q.remainder / remainder.max(f64::MIN_POSITIVE)).log2());
        let mut kink = changes(base, &plus, &analysis.model.slave_nodes());
        kink.extend(changes(base, &minus, &analysis.model.slave_nodes()));
        kink.sort_unstable();
        kink.dedup();
        // On the friction cone at rest both branches have the same derivative, and rounding chooses one. A true kink
        // shows as one-sided differences that stay apart while the step is halved.
        let apart = (plus.value - 2.0 * base.value + minus.value).abs() / h;
        if apart <= ROUNDING_APART * scale || last_apart.is_some_and(|last: f64| apart < 0.75 * last) {
            kink.clear();
        }
        last_apart = Some(apart);
        quotients.push(Quotient {
            step: h,
            difference,
            relative_error: (difference - adjoint).abs() / scale,
            remainder,
            order,
            kink,
        });
    }
    let best = quotients.iter().filter(|q| q.kink.is_empty()).map(|q| q.relative_error).reduce(f64::min);
    Ok(DirectionCheck { name, adjoint, quotients, best })
}

/// Slave nodes with another status in one of the states, as (user step, global node). Paths that were cut back
/// differently are different functions: every node of the step counts as changed.
fn changes(a: &Forward, b: &Forward, slaves: &[u32]) -> Vec<(usize, u32)> {
    let mut all = Vec::new();
    if a.path.states.len() != b.path.states.len() {
        return slaves.iter().map(|&node| (0, node)).collect();
    }
    let mut step = 1;
    for (p, q) in a.path.states.iter().zip(&b.path.states).skip(1) {
        for (j, (s, t)) in p.active_set.iter().zip(&q.active_set).enumerate() {
            if s != t {
                all.push((step, slaves[j]));
            }
        }
        step += usize::from(p.completes.is_some());
    }
    all
}

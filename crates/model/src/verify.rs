//! Compares the gradient with finite differences of the objective, on the user's own model.
//!
//! For a direction v in the design space and a step h, the central difference
//! (θ(φ+hv) − θ(φ−hv))/2h is compared with the adjoint's dθ/dφ · v, and the remainder
//! |θ(φ+hv) − θ(φ) − h dθ/dφ·v| with h². If φ is so close to 0 or 1 that φ ± hv would leave [0, 1],
//! v points inwards and the one-sided difference (4θ(φ+hv) − θ(φ+2hv) − 3θ(φ))/2h is used instead,
//! which is also of second order. Three effects spoil a difference although the gradient is right,
//! and the check distinguishes them:
//!
//! * if a slave node changes its status between φ − hv and φ + hv, or a point begins or ceases to flow
//!   plastically, θ has a kink there;
//! * a path that is cut back differently has different steps, so its θ is a different function. All
//!   paths therefore use the sub-steps of the path at φ, as long as they converge;
//! * θ is only known up to round-off, which the difference divides by h. A few more analyses near φ
//!   estimate the round-off from high-order differences of θ and from a tolerance ten times as
//!   large.

mod directions;
mod function;
mod kinks;
mod options;
mod round_off;
mod stencil;
mod verdict;

use crate::analysis::{Analysis, Forward, ForwardNotice};
use directions::Varied;
pub use function::VerifyError;
use function::{Function, set_tolerance};
use kinks::{changes, same_steps};
pub use options::VerifyOptions;
use round_off::round_off;
use serde::Serialize;
use slipstick_design::{DensityMap, ElementValues, VariableValues};
use slipstick_path::{Guide, MarchObserver};
use stencil::Stencil;
use verdict::verdict;

pub use verdict::{Quotient, Verdict};

/// Distance between one-sided differences, in units of round-off, above which they count as a kink
/// even without a change of status.
const FAR_APART: f64 = 10.0;

/// One-sided quotients that differ by less than this, relative to the derivative, count as equal.
const ROUNDING_APART: f64 = 1e-6;

/// All quotients along one direction.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DirectionCheck {
    /// The varied elements: "element 17 (body plate)" or "random direction 1".
    pub name: String,
    /// dθ/dφ · v from the adjoint.
    pub adjoint: f64,
    /// Whether the differences are one-sided, because the densities are at a bound.
    pub one_sided: bool,
    /// Quotients, largest step first.
    pub quotients: Vec<Quotient>,
    /// Smallest relative error among the quotients at which θ is smooth; `None` if there are none.
    pub best: Option<f64>,
    /// The conclusion.
    pub verdict: Verdict,
}

/// Outcome of a verification.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GradientCheck {
    /// θ.
    pub objective: f64,
    /// Estimated round-off of θ.
    pub round_off: f64,
    /// A likely mistake in the path at the densities themselves.
    pub notice: Option<ForwardNotice>,
    /// Euclidean norm of dθ/dφ over the designed elements.
    pub gradient_norm: f64,
    /// Results for each direction.
    pub directions: Vec<DirectionCheck>,
    /// Largest of the best errors of the directions that are right or off; `None` if there are
    /// none.
    pub worst: Option<f64>,
}

impl GradientCheck {
    /// How many directions have this verdict.
    pub fn count(&self, verdict: Verdict) -> usize {
        self.directions.iter().filter(|direction| direction.verdict == verdict).count()
    }
}

/// Compares adjoint and differences at `density`; `designed` are the elements that may vary.
///
/// The forward tolerances are tightened for the comparison and then restored, and so is the guide.
/// Elements whose density is so close to 0 or 1 that a step would leave [0, 1] are varied inwards,
/// in separate random directions. An element is skipped if there is no room even for two steps
/// inwards; this requires a step of more than 1/4.
///
/// # Errors
/// [`VerifyError`].
pub fn verify_gradient(
    analysis: &mut Analysis,
    density: &ElementValues,
    designed: &[u32],
    options: &VerifyOptions,
    observer: &mut dyn MarchObserver,
) -> Result<GradientCheck, VerifyError> {
    verify(&mut Function { analysis, map: None }, density, designed, options, observer)
}

/// Like [`verify_gradient`], for the gradient with respect to design variables: compares the
/// derivatives that `map` pulls back with differences of θ(φ(x)).
///
/// # Errors
/// [`VerifyError`].
pub fn verify_variables(
    analysis: &mut Analysis,
    map: &DensityMap,
    x: &VariableValues,
    options: &VerifyOptions,
    observer: &mut dyn MarchObserver,
) -> Result<GradientCheck, VerifyError> {
    let variables = map.variables();
    let (at, varied) = (variables.densities(x), variables.first_elements());
    verify(&mut Function { analysis, map: Some(map) }, &at, varied, options, observer)
}

fn verify(
    function: &mut Function<'_>,
    density: &ElementValues,
    designed: &[u32],
    options: &VerifyOptions,
    observer: &mut dyn MarchObserver,
) -> Result<GradientCheck, VerifyError> {
    let analysis = &mut *function.analysis;
    let saved = (analysis.march.newton, analysis.model().uzawa(), analysis.guide.take());
    analysis.march.newton.max_iterations += 5;
    analysis.march.newton.linear_tolerance = saved.0.linear_tolerance.min(1e-12);
    set_tolerance(analysis, options.forward_tolerance);
    let result = compare(function, density, designed, options, observer);
    let analysis = &mut *function.analysis;
    analysis.march.newton = saved.0;
    analysis.set_uzawa(saved.1);
    analysis.guide = saved.2;
    result
}

fn compare(
    function: &mut Function<'_>,
    density: &ElementValues,
    designed: &[u32],
    options: &VerifyOptions,
    observer: &mut dyn MarchObserver,
) -> Result<GradientCheck, VerifyError> {
    let base = function.forward(density, observer)?;
    if let Some(rounding) = base.rounding {
        return Err(VerifyError::Rounding(rounding));
    }
    let gradient = function.gradient(&base, density)?;
    let varied = Varied::of(designed, density, options.step);
    let free: Vec<u32> = varied.all();
    let of = |elements: &[u32]| elements.iter().map(|&e| gradient[e as usize].powi(2)).sum::<f64>().sqrt();
    let (norm, gradient_norm) = (of(&free), of(designed));
    function.analysis.guide = Some(Guide::steps_of(&base.path));
    let round_off = round_off(function, density, &free, &base, options, observer)?;
    let at = Base { density, forward: &base, gradient: &gradient, norm, round_off };
    let mut directions = Vec::new();
    for (name, direction, stencil) in varied.directions(density, options) {
        directions.push(along(function, &at, name, &direction, stencil, options, observer)?);
    }
    let is_conclusive = |d: &&DirectionCheck| matches!(d.verdict, Verdict::Right | Verdict::Off);
    let worst = directions.iter().filter(is_conclusive).filter_map(|d| d.best).reduce(f64::max);
    Ok(GradientCheck { objective: base.value, round_off, notice: base.notice, gradient_norm, directions, worst })
}

/// The state at φ that all directions share.
struct Base<'a> {
    density: &'a ElementValues,
    forward: &'a Forward,
    gradient: &'a ElementValues,
    /// Norm of the gradient over the elements that vary.
    norm: f64,
    /// Round-off of θ.
    round_off: f64,
}

fn along(
    function: &mut Function<'_>,
    base: &Base<'_>,
    name: String,
    direction: &[f64],
    stencil: Stencil,
    options: &VerifyOptions,
    observer: &mut dyn MarchObserver,
) -> Result<DirectionCheck, VerifyError> {
    let adjoint: f64 = base.gradient.iter().zip(direction).map(|(g, v)| g * v).sum();
    let size = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
    // in a direction nearly orthogonal to the gradient, errors are relative to the gradient's
    // typical component
    let count = direction.iter().filter(|v| **v != 0.0).count().max(1) as f64;
    let scale = adjoint.abs().max(1e-3 * base.norm * size / count.sqrt()).max(f64::MIN_POSITIVE);
    let value = base.forward.value;
    let mut quotients: Vec<Quotient> = Vec::new();
    let mut last_apart = None;
    let mut last_remainders = [0.0; 2];
    let mut last_near: Option<Forward> = None;
    for k in 0..=options.halvings {
        let h = options.step * 0.5f64.powi(k as i32);
        let mut at = |steps: f64| {
            let moved: ElementValues = base.density.iter().zip(direction).map(|(d, v)| d + steps * h * v).collect();
            function.forward(&moved, observer)
        };
        let [near, far] = stencil.places();
        let near_at = at(near)?;
        // the previous step is twice this one
        let far_at = match last_near.take().filter(|_| far == 2.0) {
            Some(known) => known,
            None => at(far)?,
        };
        let round_off = stencil.amplification() * base.round_off / h;
        // a derivative smaller than round-off counts as zero
        let scale = scale.max(round_off);
        let difference = stencil.difference(h, value, [near_at.value, far_at.value]);
        let remainders =
            [(&near_at, near), (&far_at, far)].map(|(other, steps)| (other.value - value - steps * h * adjoint).abs());
        let remainder = remainders[0];
        let order = quotients.last().map(|q| (q.remainder / remainder.max(f64::MIN_POSITIVE)).log2());
        // On the friction cone at rest both branches have the same derivative, and round-off
        // selects one. At a true kink, the one-sided differences stay apart while the step is
        // halved.
        let apart = stencil.second_difference(value, [near_at.value, far_at.value]).abs() / h;
        let rounding = ROUNDING_APART * scale + round_off;
        let none = apart <= rounding;
        let smooth = none || last_apart.is_some_and(|last: f64| apart < 0.75 * last);
        let kinked = apart > FAR_APART * rounding && last_apart.is_some_and(|last: f64| apart >= 0.75 * last);
        last_apart = Some(apart);
        let others = [&near_at, &far_at];
        let cut_back = others.iter().any(|other| !same_steps(base.forward, other));
        // A kink may be small compared to θ's curvature, or about one step away, and then looks
        // smooth. But if one side agrees to second order, as it does only with the derivative of
        // its own branch, the other side is another branch.
        let relative_error = (difference - adjoint).abs() / scale;
        let sides = others.map(|other| changes(base.forward, [other, other], function.analysis));
        let second_order = |side: usize| sides[side].is_empty() && remainders[side] < last_remainders[side] / 3.0;
        let other_branch = (0..2).any(|side| second_order(side) && !sides[1 - side].is_empty());
        // with a one-sided difference, another status means that the branch may be another one
        let other_status = stencil == Stencil::OneSided && sides.iter().any(|side| !side.is_empty());
        // each point that begins or ceases to flow is a small kink of its own
        let other_flow = function.analysis.model().has_memory() && sides.iter().any(|side| !side.is_empty());
        let spans_kink = (other_branch || other_status || other_flow) && relative_error > options.tolerance;
        last_remainders = remainders;
        let kink = if cut_back || smooth && !spans_kink {
            Vec::new()
        } else {
            changes(base.forward, others, function.analysis)
        };
        quotients.push(Quotient {
            step: h,
            difference,
            relative_error,
            round_off: round_off / scale,
            remainder,
            order,
            kink,
            kinked,
            cut_back: cut_back && !none,
        });
        last_near = Some(near_at);
    }
    // the result of the first halving also applies to the step before it
    if quotients.get(1).is_some_and(|second| second.kinked) {
        quotients[0].kinked = true;
    }
    let best = verdict::best(&quotients);
    let verdict = verdict(&quotients, best, options.tolerance);
    let one_sided = stencil == Stencil::OneSided;
    Ok(DirectionCheck { name, adjoint, one_sided, quotients, best, verdict })
}

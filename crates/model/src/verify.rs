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

mod stencil;
mod verdict;

use crate::analysis::{Analysis, AnalysisError, Forward, ForwardNotice, Rounding};
use serde::Serialize;
use slipstick_design::{DensityMap, ElementValues, VariableValues};
use slipstick_path::{Guide, MarchObserver, StepFailureKind, SweepError, Tolerance, Tolerances};
use stencil::{Stencil, inwards};
use verdict::verdict;

pub use verdict::{Quotient, Verdict};

/// Distance between one-sided differences, in units of round-off, above which they count as a kink
/// even without a change of status.
const FAR_APART: f64 = 10.0;

/// One-sided quotients that differ by less than this, relative to the derivative, count as equal.
const ROUNDING_APART: f64 = 1e-6;

/// Safety factor on the round-off estimated from a few samples.
const SAMPLES_SHORT: f64 = 4.0;

/// Largest distance in density between the samples of round-off.
const LARGEST_SPACING: f64 = 1e-5;

/// Options of the comparison.
#[derive(Debug, Clone, PartialEq)]
pub struct VerifyOptions {
    /// Number of random directions over all designed elements.
    pub directions: usize,
    /// Number of single elements, spread over the design.
    pub elements: usize,
    /// Largest step in density; smaller ones are obtained by halving it.
    pub step: f64,
    /// How many times the step is halved.
    pub halvings: u32,
    /// Relative tolerance of the forward analyses.
    pub forward_tolerance: f64,
    /// Relative error up to which a direction is [`Verdict::Right`].
    pub tolerance: f64,
}

impl Default for VerifyOptions {
    fn default() -> Self {
        Self { directions: 2, elements: 3, step: 1e-3, halvings: 4, forward_tolerance: 1e-11, tolerance: 1e-5 }
    }
}

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

/// Why there is no comparison.
#[derive(Debug, thiserror::Error)]
pub enum VerifyError {
    /// An analysis failed.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// The objective is only round-off, and so are its differences.
    #[error("{0}")]
    Rounding(Rounding),
    /// Interrupted; differences of incomplete paths have no meaning.
    #[error("interrupted")]
    Interrupted,
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

/// θ as a function of one number per element: its density or, with a map, the variable of which it is
/// the first element.
struct Function<'a> {
    analysis: &'a mut Analysis,
    map: Option<&'a DensityMap>,
}

impl Function<'_> {
    /// Computes the whole path at these numbers.
    fn forward(&mut self, at: &ElementValues, observer: &mut dyn MarchObserver) -> Result<Forward, VerifyError> {
        let mapped = self.map.map(|map| map.densities(&map.variables().at_first(at)));
        let forward = self.analysis.forward(mapped.as_ref().unwrap_or(at), observer)?;
        if forward.path.steps < self.analysis.times.len() { Err(VerifyError::Interrupted) } else { Ok(forward) }
    }

    /// The gradient with respect to these numbers.
    fn gradient(&mut self, forward: &Forward, at: &ElementValues) -> Result<ElementValues, VerifyError> {
        let gradient = self.analysis.gradient(forward).map_err(|error| match error {
            AnalysisError::Sweep(SweepError { kind: StepFailureKind::Interrupted, .. }) => VerifyError::Interrupted,
            error => error.into(),
        })?;
        Ok(match self.map {
            Some(map) => map.variables().spread(&map.pull_back(&map.variables().at_first(at), &gradient)),
            None => gradient,
        })
    }
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

fn set_tolerance(analysis: &mut Analysis, tolerance: f64) {
    let bound = Tolerance::Relative(tolerance);
    analysis.march.newton.tolerances =
        Tolerances { residual: bound, displacement: bound, contact: bound, multiplier: bound };
    analysis.set_uzawa_tolerance(tolerance);
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
    let tells = |d: &&DirectionCheck| matches!(d.verdict, Verdict::Right | Verdict::Off);
    let worst = directions.iter().filter(tells).filter_map(|d| d.best).reduce(f64::max);
    Ok(GradientCheck { objective: base.value, round_off, notice: base.notice, gradient_norm, directions, worst })
}

/// Estimates the error of θ due to round-off and the tolerance of the iterations.
///
/// Neither |θ| nor the tolerance predicts this error: a stiff body next to a soft one, or
/// coordinates that are large compared to the body, cost many digits. The error is therefore
/// measured.
fn round_off(
    function: &mut Function<'_>,
    density: &ElementValues,
    free: &[u32],
    base: &Forward,
    options: &VerifyOptions,
    observer: &mut dyn MarchObserver,
) -> Result<f64, VerifyError> {
    set_tolerance(function.analysis, 10.0 * options.forward_tolerance);
    let loose = function.forward(density, observer);
    set_tolerance(function.analysis, options.forward_tolerance);
    let loose = loose?;
    // A path with different steps is a different function and gives no information.
    let by_tolerance = if same_steps(base, &loose) { (loose.value - base.value).abs() } else { 0.0 };
    // from here on, the path at φ provides the initial guesses
    function.analysis.guide = Some(Guide::of(&base.path, function.analysis.linear.ranks()).holding_steps());
    let spacing = (options.step * 0.5f64.powi(options.halvings as i32)).min(LARGEST_SPACING);
    let (mut by_digits, smooth) = noise(function, density, free, base, spacing, observer)?;
    if !smooth {
        // The contribution of a kink decreases with the spacing, that of round-off does not.
        by_digits = by_digits.min(noise(function, density, free, base, 0.01 * spacing, observer)?.0);
    }
    let by_digits = if by_digits.is_finite() { by_digits } else { 0.0 };
    let least = f64::EPSILON * base.step_values.iter().map(|value| value.abs()).sum::<f64>();
    Ok(SAMPLES_SHORT * by_digits.max(by_tolerance).max(least))
}

/// Standard deviation of θ's round-off from its third and fourth differences at nine equally spaced
/// densities, in which the smooth part of θ cancels; infinite if the paths there have different
/// steps. Also returns whether all paths have the same statuses.
///
/// J. J. Moré, S. M. Wild: Estimating computational noise. SIAM J. Sci. Comput. 33 (2011)
/// 1292–1314, (3.4).
fn noise(
    function: &mut Function<'_>,
    density: &ElementValues,
    free: &[u32],
    base: &Forward,
    spacing: f64,
    observer: &mut dyn MarchObserver,
) -> Result<(f64, bool), VerifyError> {
    let mut values = [base.value; 9];
    let (mut smooth, mut same) = (true, true);
    let along: Vec<f64> = (0..free.len()).map(|k| if k % 2 == 0 { spacing } else { -0.7 * spacing }).collect();
    // on both sides of the density, or inwards from it if there is no room
    let room = free.iter().zip(&along).all(|(&e, along)| {
        let reach = 4.0 * along.abs();
        (reach..=1.0 - reach).contains(&density[e as usize])
    });
    let (along, first) = if room {
        (along, -4i32)
    } else {
        let turned = |(&e, along): (&u32, f64)| inwards(density[e as usize], 8.0 * along.abs()) * along.abs();
        (free.iter().zip(along).map(turned).collect(), 0)
    };
    for (value, place) in values.iter_mut().zip(first..).filter(|(_, place)| *place != 0) {
        let mut moved = density.clone();
        for (&e, along) in free.iter().zip(&along) {
            moved[e as usize] = (moved[e as usize] + f64::from(place) * along).clamp(0.0, 1.0);
        }
        let at = function.forward(&moved, observer)?;
        same &= same_steps(base, &at);
        smooth &= same && changes(base, [&at, &at], function.analysis).is_empty();
        *value = at.value;
    }
    if !same {
        return Ok((f64::INFINITY, false));
    }
    let third: Vec<f64> = values.windows(4).map(|v| (v[3] - v[0]) - 3.0 * (v[2] - v[1])).collect();
    let fourth: Vec<f64> = third.windows(2).map(|v| v[1] - v[0]).collect();
    // variances of differences of independent numbers: sums of squared binomial coefficients,
    // C(6, 3) and C(8, 4)
    let deviation = |differences: &[f64], variance: f64| {
        (differences.iter().map(|x| x * x).sum::<f64>() / (differences.len() as f64 * variance)).sqrt()
    };
    Ok((deviation(&third, 20.0).max(deviation(&fourth, 70.0)), smooth))
}

/// The elements that may vary: those inside (0, 1) in both directions, those at a bound only
/// inwards.
struct Varied {
    within: Vec<u32>,
    at_bounds: Vec<u32>,
}

impl Varied {
    fn of(designed: &[u32], density: &ElementValues, step: f64) -> Self {
        let phi = |e: &u32| density[*e as usize];
        let (within, others): (Vec<u32>, Vec<u32>) =
            designed.iter().partition(|e| (step..=1.0 - step).contains(&phi(e)));
        let has_room = |e: &u32| (0.0..=1.0).contains(&(phi(e) + 2.0 * step * inwards(phi(e), 2.0 * step)));
        Self { within, at_bounds: others.into_iter().filter(has_room).collect() }
    }

    /// All of them, ascending.
    fn all(&self) -> Vec<u32> {
        let mut all = [&self.within[..], &self.at_bounds].concat();
        all.sort_unstable();
        all
    }

    /// Random directions over the elements within the bounds, others over those at a bound, and
    /// single elements, preferably within the bounds.
    fn directions(&self, density: &ElementValues, options: &VerifyOptions) -> Vec<(String, Vec<f64>, Stencil)> {
        let step = options.step;
        let inwards = |e: u32| inwards(density[e as usize], 2.0 * step);
        let mut all = Vec::new();
        for k in (0..options.directions).filter(|_| !self.within.is_empty()) {
            let mut direction = vec![0.0; density.len()];
            for (&e, v) in self.within.iter().zip(random(k)) {
                direction[e as usize] = v;
            }
            all.push((format!("random direction {}", k + 1), direction, Stencil::Central));
        }
        for k in (0..options.directions).filter(|_| !self.at_bounds.is_empty()) {
            let mut direction = vec![0.0; density.len()];
            for (&e, v) in self.at_bounds.iter().zip(random(k)) {
                direction[e as usize] = v.abs() * inwards(e);
            }
            all.push((format!("random direction {} off the bounds", k + 1), direction, Stencil::OneSided));
        }
        // at 0 the stiffness has zero slope, so such an element gives no information
        let single = if self.within.is_empty() { &self.at_bounds } else { &self.within };
        let stencil = if self.within.is_empty() { Stencil::OneSided } else { Stencil::Central };
        let count = options.elements.min(single.len());
        for k in 0..count {
            let e = single[(2 * k + 1) * single.len() / (2 * count)];
            let mut direction = vec![0.0; density.len()];
            direction[e as usize] = if stencil == Stencil::OneSided { inwards(e) } else { 1.0 };
            all.push((format!("element {e}"), direction, stencil));
        }
        all
    }
}

/// A fixed sequence of signs and magnitudes in [−1, 1] (SplitMix64), so that a report is
/// reproducible.
fn random(number: usize) -> impl Iterator<Item = f64> {
    let mut state = 0x9E37_79B9_7F4A_7C15u64.wrapping_mul(number as u64 + 1);
    std::iter::from_fn(move || {
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        Some((z ^ (z >> 31)) as f64 / u64::MAX as f64 * 2.0 - 1.0)
    })
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

/// Whether both paths have the same steps and sub-steps.
fn same_steps(a: &Forward, b: &Forward) -> bool {
    a.path.states.len() == b.path.states.len()
        && a.path.states.iter().zip(&b.path.states).all(|(p, q)| p.time == q.time)
}

/// Slave nodes whose status differs in another path with the same steps, and nodes of elements with a
/// point that flows in only one of the paths, as (user step, global node).
fn changes(base: &Forward, others: [&Forward; 2], analysis: &Analysis) -> Vec<(usize, u32)> {
    let model = analysis.model();
    let slaves = model.slave_nodes();
    let mut all = Vec::new();
    for other in others {
        let mut step = 1;
        let both: Vec<_> = base.path.states.iter().zip(&other.path.states).collect();
        for pair in both.windows(2) {
            let [before, now] = [pair[0], pair[1]].map(|(p, q)| [p, q].map(|at| model.solid_history(&at.state)));
            if model.has_memory() && !pair[1].0.rest {
                let flow = [0, 1].map(|path| model.solid().flowing(before[path], now[path]));
                all.extend(flow[0].symmetric_difference(&flow[1]).map(|(_, node)| (step, *node)));
            }
            let (p, q) = pair[1];
            let nodes = p.active_set.iter().zip(&q.active_set).zip(&slaves);
            all.extend(nodes.filter(|((s, t), _)| s != t).map(|(_, &node)| (step, node)));
            step += usize::from(p.completes.is_some());
        }
    }
    all.sort_unstable();
    all.dedup();
    all
}

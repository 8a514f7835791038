//! Explains a failed analysis: where and why it failed, what was tried, and what may help.

use std::collections::BTreeMap;
use std::fmt;
use std::mem::discriminant;

use serde::Serialize;
use slipstick_mesh::Mesh;
use slipstick_path::{FailedAttempt, IterationRecord, MarchFailure, Rung, StateError, StepFailureKind, still_falls};

use super::loosening::loosened;
use super::places::{LISTED, Place, Trial, conditions, places, reason};
use slipstick_model::analysis::AnalysisError;
use slipstick_model::crushed::CURE;
use slipstick_model::model::Method;
use slipstick_model::problem::Problem;
use slipstick_model::words::counted;

/// One Newton iteration that led to a failure.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Iteration {
    /// Its number in the attempt.
    pub number: usize,
    /// Norm of the residual of the force balance after it. \[F\]
    pub residual: f64,
    /// Norm of the contact conditions; 0 in methods without multipliers. \[F/L²\]
    pub contact: f64,
    /// Norm of the increment of displacements that was taken. \[L\]
    pub displacement: f64,
    /// Fraction of Newton's increment that was taken.
    pub step_length: f64,
    /// Numbers of open, sticking and slipping contact nodes.
    pub status: [usize; 3],
}

impl Iteration {
    fn of(record: &IterationRecord) -> Self {
        let IterationRecord { iteration, residual, contact, displacement, step_length, status, .. } = *record;
        Self { number: iteration, residual, contact, displacement, step_length, status }
    }
}

impl fmt::Display for Iteration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { number, residual, contact, displacement, step_length, status: [open, stick, slip] } = self;
        write!(f, "{number}: residual {residual:.1e}, contact {contact:.1e}, increment {displacement:.1e}")?;
        if *step_length < 1.0 {
            write!(f, " (damped by {step_length})")?;
        }
        write!(f, "; open {open}, stick {stick}, slip {slip}")
    }
}

/// The attempts on one rung of the ladder at the failed step.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RungCost {
    /// How they iterated.
    pub rung: String,
    /// Their number.
    pub attempts: usize,
    /// Their Newton iterations.
    pub iterations: usize,
}

impl fmt::Display for RungCost {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { rung, attempts, iterations } = self;
        write!(f, "{rung}: {}, {}", counted(*attempts, "attempt"), counted(*iterations, "iteration"))
    }
}

/// The cost of each rung, in their order.
fn rungs(tried: &[FailedAttempt]) -> Vec<RungCost> {
    let mut costs: BTreeMap<Rung, (usize, usize)> = BTreeMap::new();
    for FailedAttempt { rung, iterations, .. } in tried {
        let (attempts, all) = costs.entry(*rung).or_default();
        *attempts += 1;
        *all += iterations;
    }
    let cost = |(rung, (attempts, iterations)): (Rung, _)| RungCost { rung: rung.to_string(), attempts, iterations };
    costs.into_iter().map(cost).collect()
}

/// Why an analysis failed, for people and programs.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct FailureReport {
    /// The user's load step (from 1) that failed; `None` if no load step failed.
    pub step: Option<usize>,
    /// The load case (from 1) of the step, unless it is the first: load steps are counted through
    /// all load cases.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub load_case: Option<usize>,
    /// Pseudo-time that was reached.
    pub reached: Option<f64>,
    /// The cause.
    pub cause: String,
    /// The first few places.
    pub places: Vec<Place>,
    /// Conditions that meet at the first place: supports, contact pairs, rigid motions; without them, bodies that
    /// came loose from contact.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub conditions: Vec<String>,
    /// The last iterations of the last attempt.
    pub iterations: Vec<Iteration>,
    /// The attempts at that step; consecutive failures of the same kind are counted together.
    pub attempts: Vec<String>,
    /// The rungs that were tried at that step, each with its cost.
    pub rungs: Vec<RungCost>,
    /// Whether smaller increments were left untried, because these attempts had cost too much.
    pub exhausted: bool,
    /// Newton iterations of all failed attempts of the path; 0 if no load step failed.
    pub failed_iterations: usize,
    /// Changes that may help.
    pub cures: Vec<String>,
}

impl FailureReport {
    /// Explains a failed analysis of a design.
    pub fn new(error: &AnalysisError, problem: &Problem) -> Self {
        let (mesh, design) = (&problem.mesh, &problem.analysis.design);
        let model = Trial { model: design.model(), contact: None };
        match error {
            AnalysisError::March(failure) => Self::of_march(failure, problem),
            AnalysisError::Realisation { design, source } => {
                let mut report = Self::new(source, problem);
                report.cause = format!("the {design} design: {}", report.cause);
                report
            }
            AnalysisError::Sweep(error) => {
                let mut report = Self::of_kind(&error.kind, mesh, model);
                report.load_case = number(error.time.case);
                report.reached = Some(error.time.t);
                report.cause = format!("adjoint at t = {:.6}: {}", error.time.t, report.cause);
                report
            }
            AnalysisError::State(error) => {
                let mut report = Self::of_kind(&StepFailureKind::State(error.clone()), mesh, model);
                report.cause = format!("a converged state cannot be evaluated: {}", report.cause);
                report
            }
            AnalysisError::Unfinished { .. } | AnalysisError::Infinite { .. } | AnalysisError::Positions { .. } => {
                Self { cause: error.to_string(), ..Self::default() }
            }
        }
    }

    /// Explains a failed march.
    pub fn of_march(failure: &MarchFailure, problem: &Problem) -> Self {
        let (mesh, design) = (&problem.mesh, problem.analysis.design_at(failure.increment.end()));
        let contact = failure.path.states.last().filter(|last| {
            // the last state is complete on every rank
            let whole = failure.iterate.len() == last.state.unknowns.len();
            whole && failure.iterate.iter().all(|value| value.is_finite())
        });
        let contact = contact.and_then(|last| {
            let time = failure.increment.end();
            design.contact_at(&last.state, &failure.iterate, time, failure.at_start).ok()
        });
        let model = Trial { model: design.model(), contact: contact.as_ref() };
        let mut report = match failure.attempts.last() {
            Some((_, kind)) => Self::of_kind(kind, mesh, model),
            None => Self::empty("no attempt was made".into()),
        };
        report.step = Some(failure.step);
        report.load_case = number(failure.increment.case);
        report.reached = failure.path.states.last().map(|state| state.time.t);
        let shown = failure.iterations.len().saturating_sub(LISTED);
        report.iterations = failure.iterations[shown..].iter().map(Iteration::of).collect();
        report.attempts = attempts(failure, mesh, model);
        report.rungs = rungs(&failure.tried);
        report.exhausted = failure.exhausted;
        report.failed_iterations = failure.failed_iterations;
        let loose = if report.conditions.is_empty() { loosened(failure, problem) } else { Vec::new() };
        let loosens = !loose.is_empty();
        report.conditions.extend(loose);
        if let (true, Some((_, StepFailureKind::TooManyIterations { .. }))) =
            (still_falls(&failure.iterations), failure.attempts.last())
        {
            report.cures.insert(0, format!("{MORE_ITERATIONS}: the residual was still decreasing"));
        }
        // The last failure is not always the decisive one, so the cures for the earlier ones are
        // added.
        for cure in failure.attempts.iter().rev().flat_map(|(_, kind)| cures(kind, mesh, model)) {
            if !report.cures.iter().any(|own| own.starts_with(&cure)) {
                report.cures.push(cure);
            }
        }
        let states = failure.tried.iter().filter_map(|failed| match &failed.kind {
            StepFailureKind::State(error) => Some(error),
            _ => None,
        });
        if problem.crushed_void(design.density(), states).is_some() {
            report.cures.insert(0, CURE.into());
        }
        let diverged = |kind: &StepFailureKind| {
            use StepFailureKind::{Diverged, State, TooManyIterations};
            matches!(kind, Diverged | TooManyIterations { .. } | State(StateError::InvertedElements { .. }))
        };
        if failure.exhausted {
            report.cures.push(MORE_PATIENCE.into());
        }
        let loads = model.has_loads() && failure.attempts.last().is_some_and(|(_, kind)| diverged(kind));
        if loosens {
            report.cures.insert(0, SMALLER_LOAD.into());
        } else if loads {
            report.cures.push(SMALLER_LOAD.into());
        }
        report
    }

    fn empty(cause: String) -> Self {
        Self { cause, ..Self::default() }
    }

    fn of_kind(kind: &StepFailureKind, mesh: &Mesh, model: Trial<'_>) -> Self {
        let (places, conditions) = (places(kind, mesh, model), conditions(kind, mesh, model).facts);
        Self { places, conditions, cures: cures(kind, mesh, model), ..Self::empty(reason(kind, mesh, model)) }
    }
}

impl fmt::Display for FailureReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.step {
            Some(step) => match self.load_case {
                Some(case) => write!(f, "load step {step}, in load case {case}, failed: {}", self.cause)?,
                None => write!(f, "load step {step} failed: {}", self.cause)?,
            },
            None => write!(f, "{}", self.cause)?,
        }
        for place in &self.places {
            write!(f, "\n    at {place}")?;
        }
        for condition in &self.conditions {
            write!(f, "\n      {condition}")?;
        }
        if let Some(reached) = self.reached {
            write!(f, "\n    reached: t = {reached:.6}")?;
        }
        if !self.iterations.is_empty() {
            write!(f, "\n    last Newton iterations:")?;
        }
        for iteration in &self.iterations {
            write!(f, "\n      {iteration}")?;
        }
        if !self.attempts.is_empty() {
            write!(f, "\n    tried:")?;
        }
        for attempt in &self.attempts {
            write!(f, "\n      {attempt}")?;
        }
        if self.failed_iterations > 0 {
            write!(f, "\n    cost: {} in failed attempts", counted(self.failed_iterations, "Newton iteration"))?;
        }
        for rung in &self.rungs {
            write!(f, "\n      {rung}")?;
        }
        if self.exhausted {
            write!(f, "\n    halved no further: smaller increments would cost more than the step is worth")?;
        }
        for cure in &self.cures {
            write!(f, "\n    help: {cure}")?;
        }
        Ok(())
    }
}

/// The number of a later load case, from 1.
fn number(case: usize) -> Option<usize> {
    (case > 0).then_some(case + 1)
}

/// The attempts at the failed step in order; consecutive failures of the same kind share a line,
/// and the middle of a long list is left out.
fn attempts(failure: &MarchFailure, mesh: &Mesh, model: Trial<'_>) -> Vec<String> {
    let mut groups: Vec<(f64, f64, usize, &StepFailureKind)> = Vec::new();
    for (time, kind) in &failure.attempts {
        match groups.last_mut() {
            Some((_, last, count, same)) if discriminant(*same) == discriminant(kind) => {
                (*last, *count, *same) = (time.t, *count + 1, kind);
            }
            _ => groups.push((time.t, time.t, 1, kind)),
        }
    }
    let line = |(first, last, count, kind): &(f64, f64, usize, &StepFailureKind)| {
        let place = places(kind, mesh, model).first().map_or(String::new(), |place| format!(", first: {place}"));
        let why = reason(kind, mesh, model);
        match count {
            1 => format!("to t = {first:.6}: {why}{place}"),
            _ => format!("to t = {first:.6} … {last:.6}, {count} times, finally: {why}{place}"),
        }
    };
    let mut lines: Vec<String> = groups.iter().map(line).collect();
    if lines.len() > LISTED {
        let hidden = lines.len() - (LISTED - 1);
        lines.splice(LISTED - 2..lines.len() - 2, [format!("… {hidden} more …")]);
    }
    lines
}

const MORE_ITERATIONS: &str = "more Newton iterations (`load_path.max_newton_iterations`)";

const MORE_PATIENCE: &str = "a larger `load_path.max_newton_iterations`, of which failed attempts without progress may \
                             take fifteen times as many before the step is given up";

const SMALLER_LOAD: &str = "a smaller load, or a prescribed motion (`dirichlet.motion`) instead: beyond a limit point, \
                            there is no equilibrium under the load nearby";

/// Changes that may help, most promising first: those that follow from the place, or those that
/// usually help.
fn cures(kind: &StepFailureKind, mesh: &Mesh, model: Trial<'_>) -> Vec<String> {
    let own = conditions(kind, mesh, model).cures;
    if own.is_empty() { usual_cures(kind).into_iter().filter(|cure| applies(cure, mesh, model)).collect() } else { own }
}

/// Whether the case has what a cure changes: a design, a slave that may be exchanged, multipliers.
fn applies(cure: &str, mesh: &Mesh, model: Trial<'_>) -> bool {
    let uses = |method: Method| model.interfaces().iter().any(|pair| pair.enforcement.method == method);
    let designed = || (0..mesh.elements.len() as u32).any(|element| model.is_designed(element));
    (!cure.contains("`design.simp.min`") || designed())
        && (!cure.contains("`complementarity_parameter`") || uses(Method::Lagrange))
        && (!cure.contains("`enforcement.augmented` or `penalty`") || uses(Method::Penalty) || uses(Method::Augmented))
        && (!cure.contains("`contact.") || !model.interfaces().is_empty())
}

/// Changes that usually help against such a failure; keys of the case file are in backquotes.
fn usual_cures(kind: &StepFailureKind) -> Vec<String> {
    let steps = "more load steps (`load_path.steps`), so that each moves the bodies less";
    let cuts = "more halvings of a failing step (`load_path.max_cutbacks`)";
    let void = "a stiffer void (`design.simp.min`), if the place is in material of low density";
    let sides = "slave and master exchanged (`contact.slave`, `contact.master`): nodes of a small or sharp-edged slave open and close \
                 as edges pass them";
    let active_set =
        "another `complementarity_parameter` (of `lagrange`) or a slightly different mesh of one contact surface";
    let support = "bodies held from the start: `slipstick check` lists rigid motions that nothing prevents";
    let list: &[&str] = match kind {
        StepFailureKind::State(StateError::InvertedElements { .. }) => {
            &[steps, void, "a smaller motion (`dirichlet.motion`) or a finer mesh at the place"]
        }
        StepFailureKind::State(StateError::FoldedSurface { .. } | StateError::FoldedFacet { .. }) => {
            &[steps, void, "slave and master exchanged (`contact.slave`, `contact.master`)"]
        }
        StepFailureKind::State(StateError::PassedThrough { .. }) => {
            &[steps, cuts, "a larger `contact.search_radius`, or none, which lets the program choose it"]
        }
        StepFailureKind::State(StateError::TurnedTooFar { .. }) => {
            &[steps, cuts, "a prescribed rotation of the rigid body (`dirichlet.motion`), if it is known"]
        }
        StepFailureKind::State(StateError::PrescribedPenetration { .. }) | StepFailureKind::Interrupted => &[],
        StepFailureKind::State(StateError::Unheld { .. }) => &[
            "a support (`[[dirichlet]]`) of the body against this motion",
            "a contact pair with the surface that is to hold the body",
            "friction in the pair that is to hold the body, if it slides",
        ],
        StepFailureKind::State(StateError::NotFinite { .. }) => &[steps, cuts],
        StepFailureKind::State(StateError::RanksDisagree) => &["the same program and libraries on all machines"],
        StepFailureKind::Singular { .. } | StepFailureKind::Linear(_) => &[
            support,
            "φ_min above 0 (`design.simp.min`), if the design has void elements",
            "a stiffness of `enforcement.augmented` or `penalty` closer to that of the bodies, which is the default",
        ],
        StepFailureKind::TooManyIterations { changing, .. } if changing.is_empty() => {
            &[steps, cuts, MORE_ITERATIONS, support]
        }
        StepFailureKind::TooManyIterations { .. } => &[sides, steps, cuts, active_set],
        StepFailureKind::Diverged | StepFailureKind::Mispredicted => &[steps, cuts, support],
        StepFailureKind::Cycling { .. } => &[sides, steps, cuts, active_set],
        StepFailureKind::Uzawa { .. } => &[
            "a higher stiffness, or more iterations (`enforcement.augmented`: `stiffness`, `max_uzawa`)",
            "Lagrange multipliers (`enforcement = { lagrange = {} }`), which need no such iteration",
        ],
    };
    list.iter().map(|cure| (*cure).to_owned()).collect()
}

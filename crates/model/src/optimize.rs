//! The optimization loop: analyse, differentiate, filter, update.
//!
//! ```text
//! x ──design map──▶ φ ──march──▶ θ ──sweep──▶ dθ/dφ ──pull back──▶ dθ/dx ──▶ MMA ──▶ x
//! ```
//!
//! Without a density filter and a projection, x are the densities of the designed elements; a
//! sensitivity filter then replaces the pull-back.
//!
//! With GCMMA, a design may be rejected after its march and before its sweep; the next candidate is
//! then marched instead. The approximations by which candidates are judged are part of the state,
//! so each march is made once, and an interrupted iteration is repeated from its first candidate.
//!
//! [`Optimization`] only advances; the caller handles time, files and terminals. Everything that
//! the next iteration depends on is in [`OptimizationState`] and the path of the last design. Both
//! can be stored and restored bit for bit.

mod maps;
mod stop;

pub use stop::StopCriteria;

use maps::Maps;

use crate::analysis::{AnalysisError, Forward};
use crate::problem::Problem;
use serde::{Deserialize, Serialize};
use slipstick_design::{
    DensityMap, DomainValues, ElementValues, FilterError, Functions, Judgement, Method, MmaError, MmaParameters,
    Optimizer, Scaling, Schedule, SensitivityFilter, VariableValues, VolumeConstraint, VolumeError,
};
use slipstick_path::{Guide, MarchFailure, MarchObserver};

/// One evaluated design.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct IterationRecord {
    /// 0 is the start design.
    pub iteration: usize,
    /// θ.
    pub objective: f64,
    /// Filled fraction of the design domain.
    pub volume_fraction: f64,
    /// Largest change of a variable in the update that followed, before halvings and inner
    /// iterations shortened it; `None` after the last evaluation.
    pub change: Option<f64>,
    /// Norm of the optimality residual of the (filtered, scaled) problem at this design, as the
    /// optimizer sees it.
    pub optimality: Option<f64>,
    /// Newton iterations of the whole path.
    pub newton_iterations: usize,
    /// Newton iterations of failed attempts, including the paths that failed before the update was
    /// halved, and of the paths of rejected candidates.
    #[serde(default)]
    pub failed_iterations: usize,
    /// Uzawa iterations of the whole path.
    pub uzawa_iterations: usize,
    /// Accepted (sub-)steps.
    pub increments: usize,
    /// Constraints, in the order of [`OptimizationState::constraints`].
    pub constraints: Vec<ConstraintRecord>,
    /// Largest violation of a constraint, relative to its bound; 0 if all are met.
    pub violation: f64,
    /// Share of intermediate densities, 4 Σ V φ (1 − φ) / Σ V over the design domain: 0 for a
    /// design of solid and void, 1 if all densities are 0.5. Source: Sigmund, Struct. Multidiscip.
    /// Optim. 33 (2007) 401–424.
    pub discreteness: f64,
    /// Slave nodes open, sticking, slipping at the end of the path.
    pub status: [usize; 3],
    /// How many times the update was halved because the path could not be marched with the full
    /// one.
    pub halvings: usize,
    /// Inner iterations of GCMMA: candidates that were marched and rejected before this design.
    #[serde(default)]
    pub inner_iterations: usize,
}

/// A constraint at a design.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct ConstraintRecord {
    /// The value that is bounded.
    pub value: f64,
    /// Multiplier: how much θ would fall if the bound were relaxed by its own magnitude (by 1 if
    /// the bound is 0), to first order. `None` after the last evaluation.
    pub multiplier: Option<f64>,
}

/// Everything that the next iteration depends on.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct OptimizationState {
    /// Number of updates made.
    pub iteration: usize,
    /// Design variables.
    pub x: VariableValues,
    /// The variables before the last update, for halving it.
    pub x_before: Option<VariableValues>,
    /// The optimizer's memory, under the name of its method.
    #[serde(flatten)]
    pub optimizer: Optimizer,
    /// Scales of objective and constraints, each from the first gradient that is not zero.
    pub scaling: Option<Scaling>,
    /// Names of the constraints: the bound on the volume, if any, then those of the analysis.
    pub constraints: Vec<String>,
    /// All evaluated designs.
    pub history: Vec<IterationRecord>,
}

/// How a problem is optimized.
#[derive(Debug, Clone, PartialEq)]
pub struct OptimizationOptions {
    /// Bound on the fraction of the design domain's volume that is filled, in (0, 1]; `None`: no
    /// bound.
    pub volume_fraction: Option<f64>,
    /// Filter of the sensitivities; `None` for none. It requires a design map that is the identity.
    pub filter: Option<FilterOptions>,
    /// Number of updates.
    pub iterations: usize,
    /// When the optimization stops earlier.
    pub stop: StopCriteria,
    /// Parameters that change over the iterations.
    pub schedule: Schedule,
    /// MMA or GCMMA.
    pub method: Method,
    /// Parameters of either method.
    pub mma: MmaParameters,
    /// Whether each march takes its start values from the path of the previous design.
    pub follow_previous_design: bool,
}

/// A filter of sensitivities.
#[derive(Debug, Clone, PartialEq)]
pub struct FilterOptions {
    /// Radius. \[L\]
    pub radius: f64,
    /// Symmetry planes, across which elements have mirror images: axis (0, 1 or 2) and coordinate.
    /// \[L\]
    pub planes: Vec<(usize, f64)>,
}

/// Why a problem cannot be optimized.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PrepareError {
    /// It has no objective.
    #[error("an optimization needs an objective")]
    NoObjective,
    /// It has no design.
    #[error("an optimization needs a design")]
    NoDesign,
    /// The sensitivity filter is impossible.
    #[error(transparent)]
    Filter(FilterError),
    /// The sensitivity filter would falsify gradients that are exact with respect to the variables.
    #[error("a sensitivity filter cannot be combined with a density filter, a projection or an overhang filter")]
    TwoFilters,
    /// The schedule of the sharpness is impossible.
    #[error(transparent)]
    Sharpness(FilterError),
    /// The schedule of the filter radius is impossible.
    #[error(transparent)]
    FilterRadius(FilterError),
    /// The bound on the volume is impossible.
    #[error(transparent)]
    Volume(VolumeError),
    /// The schedule of the bound on the volume is impossible.
    #[error(transparent)]
    VolumeSchedule(VolumeError),
}

/// Why an optimization stopped short.
#[derive(Debug, thiserror::Error)]
pub enum OptimizeError {
    /// The analysis failed.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// The optimizer failed.
    #[error("optimizer: {0}")]
    Mma(#[from] MmaError),
    /// The objective of a design is only round-off, so it permits no update; the state is that of
    /// the last finished iteration.
    #[error("{}", .0.rounding.map_or(String::new(), |rounding| rounding.to_string()))]
    Rounding(Box<Forward>),
    /// Stopped from outside, in the middle of an iteration; the state is that of the last finished
    /// one.
    #[error("interrupted")]
    Interrupted,
}

/// The last analysed design.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluated {
    /// Design variables.
    pub x: VariableValues,
    /// Densities of all elements.
    pub density: ElementValues,
    /// dθ/dφ of all elements, unfiltered; `None` for the last evaluation, which needs no gradient.
    pub gradient: Option<ElementValues>,
}

/// An optimization in progress.
pub struct Optimization {
    /// The problem being designed.
    pub problem: Problem,
    maps: Maps,
    filter: Option<SensitivityFilter>,
    volume: VolumeConstraint,
    /// Its bound before the first entry of the schedule.
    limit: f64,
    /// Whether the volume is bounded.
    bounded: bool,
    iterations: usize,
    stop: StopCriteria,
    schedule: Schedule,
    /// Whether a march follows the path of the previous design, in `problem.analysis.guide`.
    follow: bool,
    evaluated: Option<Evaluated>,
    /// All data that the next iteration depends on.
    pub state: OptimizationState,
}

/// A design whose path could be marched.
struct Marched {
    x: VariableValues,
    density: ElementValues,
    forward: Forward,
    halvings: usize,
    /// Newton iterations of the paths that failed earlier, and of rejected candidates.
    lost: usize,
}

/// Lower and upper bound of every variable.
struct Bounds {
    lower: Vec<f64>,
    upper: Vec<f64>,
}

impl Bounds {
    fn of_variables(n: usize) -> Self {
        Self { lower: vec![0.0; n], upper: vec![1.0; n] }
    }

    fn both(&self) -> [&[f64]; 2] {
        [&self.lower, &self.upper]
    }
}

/// Name of the bound on the volume.
const VOLUME: &str = "volume_fraction";

/// How many times an update is halved when the path of the new design cannot be marched.
const MAX_HALVINGS: usize = 3;

impl Optimization {
    /// Prepares the optimization of a problem.
    ///
    /// # Errors
    /// [`PrepareError`] if the problem has no design or no objective, or an option is out of its
    /// range.
    pub fn new(problem: Problem, options: OptimizationOptions) -> Result<Self, PrepareError> {
        if problem.analysis.objective.is_none() {
            return Err(PrepareError::NoObjective);
        }
        let (map, x) = problem.map().zip(problem.initial_variables()).ok_or(PrepareError::NoDesign)?;
        let (map, x) = (map.clone(), x.clone());
        if options.filter.is_some() && !map.is_identity() {
            return Err(PrepareError::TwoFilters);
        }
        let variables = map.variables();
        let volumes = variables.on_domain(&problem.mesh.element_volumes().into());
        let OptimizationOptions { volume_fraction, filter, iterations, stop, schedule, method, mma, .. } = options;
        let filter = filter.map(|FilterOptions { radius, planes }| {
            let centroids = problem.mesh.centroids();
            let centroids: Vec<[f64; 3]> = variables.domain().iter().map(|&e| centroids[e as usize]).collect();
            let ranks = problem.analysis.model().share().ranks().clone();
            SensitivityFilter::on_ranks(&centroids, &volumes, radius, &planes, ranks)
        });
        let filter = filter.transpose().map_err(PrepareError::Filter)?;
        let limit = volume_fraction.unwrap_or(1.0);
        let volume = VolumeConstraint::new(volumes, limit).map_err(PrepareError::Volume)?;
        let scheduled = schedule.volume_fraction.entries().iter();
        let scheduled = scheduled.map(|entry| VolumeConstraint::check_limit(entry.1));
        scheduled.collect::<Result<(), _>>().map_err(PrepareError::VolumeSchedule)?;
        let of_analysis = problem.analysis.constraints.iter().map(|constraint| constraint.response.name().to_owned());
        let constraints: Vec<String> =
            volume_fraction.map(|_| VOLUME.to_owned()).into_iter().chain(of_analysis).collect();
        let maps = Maps::new(map, &schedule)?;
        let state = OptimizationState {
            iteration: 0,
            optimizer: Optimizer::new(method, x.len(), constraints.len(), mma),
            x,
            x_before: None,
            scaling: None,
            constraints,
            history: Vec::new(),
        };
        Ok(Self {
            problem,
            maps,
            filter,
            volume,
            limit,
            bounded: volume_fraction.is_some(),
            iterations,
            stop,
            schedule,
            follow: options.follow_previous_design,
            evaluated: None,
            state,
        })
    }

    /// Densities of all elements at the current variables.
    pub fn density(&self) -> ElementValues {
        self.map().densities(&self.state.x)
    }

    /// The map from variables to densities at the current iteration.
    pub fn map(&self) -> &DensityMap {
        self.maps.at(self.state.iteration)
    }

    /// The design of the last [`advance`](Self::advance); `None` before the first.
    pub fn evaluated(&self) -> Option<&Evaluated> {
        self.evaluated.as_ref()
    }

    /// Bound on the volume fraction at the current iteration.
    pub fn volume_limit(&self) -> Option<f64> {
        self.bounded.then(|| self.schedule.volume_fraction.at(self.state.iteration).unwrap_or(self.limit))
    }

    /// Whether each march takes its start values from the path of the previous design. The next
    /// iteration then depends not only on the state, but also on that path, in
    /// `problem.analysis.guide`.
    pub fn follows_previous_design(&self) -> bool {
        self.follow
    }

    /// Number of updates requested.
    pub fn iterations(&self) -> usize {
        self.iterations
    }

    /// Sets the number of updates requested.
    pub fn set_iterations(&mut self, iterations: usize) {
        self.iterations = iterations;
    }

    /// Whether all updates are made (or the criteria for stopping were met) and the last design is
    /// evaluated.
    pub fn finished(&self) -> bool {
        let evaluated = self.state.history.len() > self.state.iteration;
        evaluated && self.done(&self.state.x)
    }

    /// Whether no further update is needed after the one that ended at `x`.
    fn done(&self, x: &VariableValues) -> bool {
        let change = self.state.x_before.as_ref().map(|before| largest_change(x, before));
        let updated = self.state.history.iter().rev().find(|record| record.change.is_some());
        let ended = |record: &IterationRecord| record.iteration >= self.schedule.end();
        let settled = |record: &IterationRecord| ended(record) && self.stop.met(record, change);
        self.state.iteration >= self.iterations || updated.is_some_and(settled)
    }

    /// Evaluates the current design and, unless all updates are made, updates it. Returns the
    /// forward analysis of the evaluated design, whose record is the last one of the state's
    /// history.
    ///
    /// If the path of an updated design cannot be marched, the update is halved, up to a few times.
    /// With GCMMA, a marched design at which the approximations are not conservative is rejected,
    /// and the candidate of the next inner iteration is marched. The optimization stops at a design
    /// whose objective is only round-off.
    ///
    /// # Errors
    /// See [`OptimizeError`]; the state is then that of the last finished iteration.
    pub fn advance(&mut self, observer: &mut dyn MarchObserver) -> Result<Forward, OptimizeError> {
        let mut optimizer = self.state.optimizer.clone();
        if let Some(p) = self.schedule.p.at(self.state.iteration) {
            self.problem.analysis.set_penalization(p);
        }
        if let Some(limit) = self.volume_limit() {
            self.volume.set_limit(limit);
        }
        let Marched { x, density, mut forward, halvings, lost } = self.march_accepted(&mut optimizer, observer)?;
        if forward.rounding.is_some() {
            forward.path.forget_factors();
            return Err(OptimizeError::Rounding(Box::new(forward)));
        }
        let domain = self.maps.variables().on_domain(&density);
        let mut record = record(self.state.iteration, &forward, self.volume.fraction(&domain));
        record.discreteness = self.volume.discreteness(&domain);
        let functions = self.constraint_functions(&domain, &forward);
        record.constraints = functions.iter().map(|f| ConstraintRecord { value: f.value, multiplier: None }).collect();
        record.violation = functions.iter().fold(0.0, |worst: f64, f| worst.max(f.violation.0));
        record.halvings = halvings;
        record.inner_iterations = optimizer.inner_iterations();
        record.failed_iterations += lost;
        let done = self.done(&x);
        let evaluated = Evaluated { x: x.clone(), density, gradient: None };
        let mut next = OptimizationState { x, optimizer, ..self.state.clone() };
        let mut derivative = None;
        if !done {
            let gradients = self.problem.analysis.response_gradients(&forward, false);
            forward.path.forget_factors();
            // also if the sweep was interrupted
            if observer.cancelled() {
                return Err(OptimizeError::Interrupted);
            }
            let gradients = gradients?;
            let gradients: Vec<ElementValues> = gradients.into_iter().map(|gradient| gradient.density).collect();
            self.update(&mut next, &mut record, &domain, &forward, (&functions, &gradients))?;
            derivative = gradients.into_iter().next();
        }
        if self.follow && next.iteration > self.state.iteration {
            let analysis = &mut self.problem.analysis;
            analysis.guide = Some(Guide::of(&forward.path, analysis.linear.ranks()));
        }
        next.history.push(record);
        self.state = next;
        self.evaluated = Some(Evaluated { gradient: derivative, ..evaluated });
        Ok(forward)
    }

    /// Marches with the variables of the state and, as long as the optimizer rejects the result,
    /// with its next candidate.
    ///
    /// Where the schedule changes the functions or the bound on the volume, there is nothing to compare
    /// a design with, and it is accepted. A halved update is judged like a full one. It does not raise the objective
    /// either: the approximations are convex, so where both ends are no worse than the last design,
    /// nor is the middle.
    fn march_accepted(
        &mut self,
        optimizer: &mut Optimizer,
        observer: &mut dyn MarchObserver,
    ) -> Result<Marched, OptimizeError> {
        let bounds = Bounds::of_variables(self.state.x.len());
        let comparable = !self.schedule.changes_values_at(self.state.iteration);
        let (mut x, mut halvings, mut lost) = (self.state.x.clone(), 0, 0);
        loop {
            let mut marched = self.march_or_step_back(x, observer)?;
            marched.halvings += halvings;
            marched.lost += lost;
            let judged = comparable && marched.forward.rounding.is_none();
            // without scales, nothing has been approximated yet
            let Some(scaling) = self.state.scaling.as_ref().filter(|_| judged) else {
                return Ok(marched);
            };
            let forward = &marched.forward;
            let domain = self.maps.variables().on_domain(&marched.density);
            let functions = self.constraint_functions(&domain, forward);
            let scaled = functions.iter().zip(scaling.constraints()).map(|(f, factor)| factor * f.violation.0);
            let (objective, constraints) = (scaling.objective() * forward.value, scaled.collect::<Vec<f64>>());
            let ranks = self.problem.analysis.linear.ranks();
            match optimizer.judge(&marched.x, bounds.both(), objective, &constraints, ranks)? {
                Judgement::Conservative | Judgement::Exhausted => return Ok(marched),
                Judgement::Rejected(next) => x = next.x.into(),
            }
            halvings = marched.halvings;
            lost = marched.lost + forward.path.newton_iterations() + forward.path.failed_iterations();
            if observer.cancelled() {
                return Err(OptimizeError::Interrupted);
            }
        }
    }

    /// Marches with these variables or, if that fails, with half of the update that led to them.
    fn march_or_step_back(
        &mut self,
        mut x: VariableValues,
        observer: &mut dyn MarchObserver,
    ) -> Result<Marched, OptimizeError> {
        let (mut halvings, mut lost) = (0, 0);
        loop {
            let density = self.map().densities(&x);
            let failure = match self.problem.analysis.forward(&density, observer) {
                Ok(forward) if forward.path.steps < self.problem.analysis.times.len() => {
                    return Err(OptimizeError::Interrupted);
                }
                Ok(forward) => return Ok(Marched { x, density, forward, halvings, lost }),
                Err(failure) => failure,
            };
            let back = match (&failure, &self.state.x_before) {
                (AnalysisError::March(march), Some(before)) if halvings < MAX_HALVINGS => {
                    lost += march.path.newton_iterations() + march.failed_iterations;
                    before
                }
                _ => return Err(failure.into()),
            };
            halvings += 1;
            x.iter_mut().zip(back).for_each(|(x, b)| *x = 0.5 * (*x + b));
        }
    }

    /// Values and violations of all constraints.
    fn constraint_functions(&self, domain: &DomainValues, forward: &Forward) -> Vec<ConstraintFunction> {
        let volume = self.bounded.then(|| ConstraintFunction {
            value: self.volume.fraction(domain),
            violation: (self.volume.value(domain), 1.0),
        });
        let bounds = self.problem.analysis.constraints.iter().map(|constraint| constraint.bound);
        let others = bounds.zip(&forward.constraints);
        let others = others.map(|(bound, &value)| ConstraintFunction { value, violation: bound.violation(value) });
        volume.into_iter().chain(others).collect()
    }

    /// Pulls the gradients back to the variables or filters them, scales, and lets the optimizer
    /// choose the next variables. `gradients` are those of the objective and of the constraints of
    /// the analysis.
    fn update(
        &self,
        next: &mut OptimizationState,
        record: &mut IterationRecord,
        domain: &DomainValues,
        forward: &Forward,
        (functions, gradients): (&[ConstraintFunction], &[ElementValues]),
    ) -> Result<(), OptimizeError> {
        let (map, variables, x) = (self.maps.at(next.iteration), self.maps.variables(), next.x.clone());
        let on_variables = |gradient: &ElementValues, depends_on_state: bool| -> Vec<f64> {
            match &self.filter {
                Some(filter) if depends_on_state => {
                    variables.restrict_domain(&filter.apply(domain, &variables.on_domain(gradient))).into()
                }
                _ => map.pull_back(&x, gradient).into(),
            }
        };
        let analysis = &self.problem.analysis;
        let responses = analysis.objective.iter().chain(analysis.constraints.iter().map(|of| &of.response));
        // all that depend on the state are filtered alike: a gain that one gradient shows and
        // another hides would mislead the optimizer
        let mut of_responses =
            responses.zip(gradients).map(|(response, gradient)| on_variables(gradient, response.depends_on_state()));
        let objective_gradient = of_responses.next().unwrap_or_default();
        let volume = self.bounded.then(|| on_variables(&variables.spread_domain(&self.volume.gradient()), false));
        let bounds = functions.iter().map(|function| function.violation.1);
        let constraint_gradients: Vec<Vec<f64>> = volume
            .into_iter()
            .chain(of_responses)
            .zip(bounds)
            .map(|(gradient, slope): (Vec<f64>, f64)| gradient.into_iter().map(|g| slope * g).collect())
            .collect();
        if self.schedule.changes_functions_at(next.iteration) {
            next.optimizer.restart();
        }
        if let Some(move_limit) = self.schedule.move_limit.at(next.iteration) {
            next.optimizer.set_move_limit(move_limit);
        }
        let violations: Vec<f64> = functions.iter().map(|function| function.violation.0).collect();
        let scaling = next.scaling.get_or_insert_with(|| Scaling::new(violations.len()));
        scaling.learn(&objective_gradient, &constraint_gradients);
        let (f, df) = scaling.scale_objective(forward.value, &objective_gradient);
        let (g, dg) = scaling.scale_constraints(&violations, &constraint_gradients);
        let bounds = Bounds::of_variables(next.x.len());
        let functions = Functions::new(f, &df, &g, &dg);
        let step = next.optimizer.update(&next.x, bounds.both(), &functions, analysis.linear.ranks())?;
        record.change = Some(largest_change(&step.x, &next.x));
        record.optimality = Some(step.kkt_residual.norm);
        for ((constraint, lambda), factor) in record.constraints.iter_mut().zip(&step.lambda).zip(scaling.constraints())
        {
            constraint.multiplier = Some(lambda * factor / scaling.objective());
        }
        next.x_before = Some(std::mem::replace(&mut next.x, step.x.into()));
        next.iteration += 1;
        Ok(())
    }
}

fn largest_change(x: &[f64], before: &[f64]) -> f64 {
    x.iter().zip(before).map(|(x, before)| (x - before).abs()).fold(0.0, f64::max)
}

/// A constraint at a design: the bounded value, g ≤ 0, and ∂g/∂value.
struct ConstraintFunction {
    value: f64,
    violation: (f64, f64),
}

fn record(iteration: usize, forward: &Forward, volume_fraction: f64) -> IterationRecord {
    let states = &forward.path.states;
    let last = states.last().and_then(|s| s.report.iterations.last());
    IterationRecord {
        iteration,
        objective: forward.value,
        volume_fraction,
        newton_iterations: forward.path.newton_iterations(),
        failed_iterations: forward.path.failed_iterations(),
        uzawa_iterations: states.iter().map(|s| s.report.uzawa).sum(),
        increments: forward.path.increments(),
        status: last.map_or([0; 3], |r| r.status),
        ..IterationRecord::default()
    }
}

impl OptimizeError {
    /// The failed march, if a march failed.
    pub fn march_failure(&self) -> Option<&MarchFailure> {
        match self {
            Self::Analysis(AnalysisError::March(failure)) => Some(failure),
            _ => None,
        }
    }
}

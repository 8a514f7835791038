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
//! then marched instead. The default, MMA with a guard (`guard.rs`), does so only if a step goes too far, and in
//! the iterations after it. The approximations by which candidates are judged are part of the state,
//! so each march is made once, and an interrupted iteration is repeated from its first candidate.
//!
//! [`Optimization`] only advances; the caller handles time, files and terminals. Everything that
//! the next iteration depends on is in [`OptimizationState`] and the path of the last design. Both
//! can be stored and restored bit for bit.

mod best;
mod columns;
mod functions;
mod guard;
mod maps;
mod marching;
mod realisations;
mod state;
mod stop;

pub use best::{Best, FEASIBLE, MostViolated};
pub use columns::{COLUMNS, Column, Entry, SECONDS};
pub use state::{
    FilterOptions, FunctionRecord, Interpolation, IterationRecord, OptimizationOptions, OptimizationState,
    OptimizeError, PrepareError,
};
pub use stop::StopCriteria;

use functions::{Counts, Designs, Gradients, Values};
use marching::Marched;
use realisations::Realisations;

use crate::analysis::Forward;
use crate::problem::Problem;
use slipstick_design::{
    DensityMap, ElementValues, Functions, Optimizer, Scaling, Schedule, SensitivityFilter, VariableValues,
    VolumeConstraint,
};
use slipstick_path::{Guide, MarchObserver};

/// The last analysed design.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluated {
    /// Design variables.
    pub x: VariableValues,
    /// Densities of all elements.
    pub density: ElementValues,
    /// dθ/dφ of all elements, unfiltered; `None` for the last evaluation, which needs no gradient,
    /// and if θ also depends on an eroded and a dilated design. Of several load cases whose worst
    /// counts, the sum with their multipliers.
    pub gradient: Option<ElementValues>,
}

/// An optimization in progress.
pub struct Optimization {
    /// The problem being designed.
    pub problem: Problem,
    realisations: Realisations,
    filter: Option<SensitivityFilter>,
    volume: VolumeConstraint,
    /// Its bound before the first entry of the schedule.
    limit: f64,
    /// Whether the volume is bounded.
    bounded: bool,
    iterations: usize,
    /// Number of updates for which the schedule is made.
    planned: usize,
    stop: StopCriteria,
    schedule: Schedule,
    /// Whether a march follows the path of the previous design.
    follow: bool,
    /// Whether void follows linear elasticity once it makes a path fail.
    rescue_void: bool,
    evaluated: Option<Evaluated>,
    /// All data that the next iteration depends on.
    pub state: OptimizationState,
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

impl Optimization {
    /// Prepares the optimization of a problem.
    ///
    /// # Errors
    /// [`PrepareError`] if the problem has no design or no objective, or an option is out of its
    /// range.
    pub fn new(mut problem: Problem, options: OptimizationOptions) -> Result<Self, PrepareError> {
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
        let OptimizationOptions { volume_fraction, filter, iterations, stop, schedule, method, mma, margin, .. } =
            options;
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
        let n = x.len();
        let model = problem.analysis.model();
        let rescue_void = options.rescue_void && !model.interpolates_energies();
        let first = usize::from(volume_fraction.is_some());
        let smooth = problem.analysis.constraints.iter().enumerate();
        let smooth = smooth.filter(|(_, constraint)| constraint.response.extreme().is_some());
        let extremes = smooth.map(|(number, _)| first + number).collect();
        let realisations = Realisations::new(&mut problem, map, &schedule, margin)?;
        let parts = realisations.part_names(&problem);
        let counts = Counts::new(&parts, volume_fraction.is_some(), &problem, realisations.count());
        let state = OptimizationState {
            iteration: 0,
            optimizer: Optimizer::new(method, n, counts.of_optimizer(), mma),
            x,
            x_before: None,
            scaling: None,
            parts,
            constraints,
            dilated_limit: None,
            shifts: Vec::new(),
            extremes,
            best: None,
            interpolation: None,
            divided: Vec::new(),
            history: Vec::new(),
        };
        Ok(Self {
            problem,
            realisations,
            filter,
            volume,
            limit,
            bounded: volume_fraction.is_some(),
            iterations,
            planned: iterations,
            stop,
            schedule,
            follow: options.follow_previous_design,
            rescue_void,
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
        self.realisations.map(self.state.iteration, &self.state.divided)
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
    /// iteration then depends not only on the state, but also on [`guides`](Self::guides).
    pub fn follows_previous_design(&self) -> bool {
        self.follow
    }

    /// Number of realizations of a design: 1, or 3 with an eroded and a dilated one.
    pub fn realisations(&self) -> usize {
        self.realisations.count()
    }

    /// The paths of the previous design that the next march follows, one for each realization; empty
    /// before the first update, and if it follows none.
    pub fn guides(&self) -> Vec<&Guide> {
        self.problem.analysis.guide.iter().chain(self.realisations.guides()).collect()
    }

    /// Sets the paths that the next march follows.
    pub fn set_guides(&mut self, guides: Vec<Guide>) {
        let mut guides = guides.into_iter();
        self.problem.analysis.guide = guides.next();
        self.realisations.set_guides(guides.collect());
    }

    /// Numbers of constraints in the memory of the optimizer and in the scaling.
    pub fn function_counts(&self) -> [usize; 2] {
        let counts = Counts::new(&self.state.parts, self.bounded, &self.problem, self.realisations());
        [counts.of_optimizer(), counts.constraints]
    }

    /// Number of updates requested.
    pub fn iterations(&self) -> usize {
        self.iterations
    }

    /// Sets the number of updates requested.
    pub fn set_iterations(&mut self, iterations: usize) {
        self.iterations = iterations;
    }

    /// When the optimization stops before its last update.
    pub fn stop_criteria(&self) -> StopCriteria {
        self.stop
    }

    /// The iteration of the last entry of the schedule or, if its rise is divided, of the second half, before which the criteria for stopping do
    /// not count.
    pub fn last_scheduled(&self) -> usize {
        let divided = self.state.divided.last().map_or(0, |from| from + maps::WAIT);
        self.schedule.end().max(divided)
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
        let ended = |record: &IterationRecord| record.iteration >= self.last_scheduled();
        let settled = |record: &IterationRecord| ended(record) && self.stop.met(record, change);
        self.state.iteration >= self.iterations || updated.is_some_and(settled)
    }

    /// Whether the sharpness rises at this iteration, and may do so in two halves: an update must follow the
    /// second one, also if this run ends earlier and is continued.
    fn can_divide(&self) -> bool {
        self.realisations.can_divide(self.state.iteration) && self.state.iteration + maps::WAIT < self.planned
    }

    /// Whether objective and constraints are other functions of the variables at an iteration than before.
    fn changes_functions_at(&self, iteration: usize) -> bool {
        let rest = iteration.checked_sub(maps::WAIT).is_some_and(|from| self.state.divided.contains(&from));
        self.schedule.changes_functions_at(iteration) || rest
    }

    /// Whether their values cannot be compared with those before.
    fn changes_values_at(&self, iteration: usize) -> bool {
        self.schedule.changes_values_at(iteration) || self.changes_functions_at(iteration)
    }

    /// Evaluates the current design and, unless all updates are made, updates it. Returns the
    /// forward analysis of the evaluated design, whose record is the last one of the state's
    /// history.
    ///
    /// If the path of an updated design cannot be marched, the update is halved, up to a few times.
    /// If a rise of the sharpness breaks a bound, it is divided.
    /// With GCMMA, a marched design at which the approximations are not conservative is rejected,
    /// and the candidate of the next inner iteration is marched. The optimization stops at a design
    /// whose objective is only round-off.
    ///
    /// # Errors
    /// See [`OptimizeError`]; the state is then that of the last finished iteration.
    pub fn advance(&mut self, observer: &mut dyn MarchObserver) -> Result<Forward, OptimizeError> {
        let divided = self.state.divided.len();
        let advanced = self.evaluate_and_update(observer);
        if advanced.is_err() {
            self.state.divided.truncate(divided);
        }
        advanced
    }

    fn evaluate_and_update(&mut self, observer: &mut dyn MarchObserver) -> Result<Forward, OptimizeError> {
        let mut optimizer = self.state.optimizer.clone();
        if let Some(p) = self.schedule.p.at(self.state.iteration) {
            self.realisations.set_penalization(&mut self.problem.analysis, p);
        }
        if let Some(limit) = self.volume_limit() {
            self.volume.set_limit(limit);
        }
        if self.rescue_void {
            self.interpolate_energies(self.state.interpolation.is_some());
        }
        let Marched { x, mut designs, halvings, lost, crushed } = self.march_accepted(&mut optimizer, observer)?;
        if designs.is_rounded() {
            designs.forget_factors();
        }
        if let Some(rounded) = designs.take_rounded() {
            return Err(OptimizeError::Rounding(Box::new(rounded)));
        }
        let dilated_limit = self.dilated_limit(&designs);
        let values = self.values(&designs, dilated_limit, None);
        let mut record = self.record(&designs, &values);
        record.halvings = halvings;
        record.inner_iterations = optimizer.inner_iterations();
        record.failed_iterations += lost;
        let done = self.done(&x);
        let changed = self.changes_values_at(self.state.iteration) || crushed.is_some();
        let interpolation = crushed.map(|void| Interpolation { from: self.state.iteration, void });
        let interpolation = interpolation.or_else(|| self.state.interpolation.clone());
        let evaluated = Evaluated { x: x.clone(), density: designs.nominal().clone(), gradient: None };
        let shifts = if values.shifts.iter().all(|shift| *shift == 0.0) { Vec::new() } else { values.shifts.clone() };
        let mut next = OptimizationState { x, optimizer, dilated_limit, shifts, interpolation, ..self.state.clone() };
        let mut derivative = None;
        if !done {
            let gradients = self.realisations.gradients(&mut self.problem.analysis, &designs);
            designs.forget_factors();
            // also if the sweep was interrupted
            if observer.cancelled() {
                return Err(OptimizeError::Interrupted);
            }
            let gradients = gradients?;
            self.update(&mut next, &mut record, &values, &designs, &gradients)?;
            derivative = self.realisations.derivative(gradients, &record.parts);
        }
        if self.follow && next.iteration > self.state.iteration {
            let analysis = &mut self.problem.analysis;
            analysis.guide = Some(Guide::of(&designs.first().path, analysis.linear.ranks()));
            self.realisations.follow(&designs);
        }
        next.keep_best(&record, &evaluated.x, changed);
        next.history.push(record);
        self.state = next;
        self.evaluated = Some(Evaluated { gradient: derivative, ..evaluated });
        Ok(designs.into_first())
    }

    /// Evaluates the [result](OptimizationState::result) again if it is not the last design. The state
    /// stays as it is, so that the optimization can go on; [`evaluated`](Self::evaluated) is then the
    /// result.
    ///
    /// # Errors
    /// As [`advance`](Self::advance). Its path could be marched before, but may follow another one now.
    pub fn recall(&mut self, observer: &mut dyn MarchObserver) -> Result<Option<Forward>, OptimizeError> {
        let last = self.state.history.last().map(|record| record.iteration);
        let result = self.state.result().map(|record| record.iteration).filter(|result| Some(*result) != last);
        let Some(best) = self.state.best.clone().filter(|best| Some(best.iteration) == result) else {
            return Ok(None);
        };
        let densities = self.realisations.densities(best.iteration, &self.state.divided, &best.x);
        let mut designs = self.realisations.march(&mut self.problem.analysis, densities, observer)?;
        if !designs.finished(self.problem.analysis.times.len()) {
            return Err(OptimizeError::Interrupted);
        }
        designs.forget_factors();
        self.evaluated = Some(Evaluated { density: designs.nominal().clone(), x: best.x, gradient: None });
        Ok(Some(designs.into_first()))
    }

    /// The constraint that a design violates most, relative to its bound. `None` if it violates none by
    /// more than [`FEASIBLE`].
    pub fn most_violated(&self, record: &IterationRecord) -> Option<MostViolated<'_>> {
        let volume = self.bounded.then(|| {
            let limit = self.schedule.volume_fraction.at(record.iteration).unwrap_or(self.limit);
            slipstick_design::Bound::AtMost(limit)
        });
        let bounds = self.problem.analysis.constraints.iter().map(|constraint| constraint.bound);
        let bounds = volume.into_iter().chain(bounds);
        let each = self.state.constraints.iter().zip(&record.constraints).zip(bounds);
        // the extreme counts where the smooth value hides a violation
        let each = each.map(|((name, of), bound)| {
            let correction = of.extreme.map_or(0.0, |extreme| bound.correction(of.value, extreme));
            let value = of.value + correction;
            MostViolated { name, value, of_extreme: correction != 0.0, violation: bound.violation(value).0 }
        });
        each.filter(|of| of.violation > FEASIBLE).reduce(|a, b| if b.violation > a.violation { b } else { a })
    }

    /// Pulls the gradients back to the variables or filters them, scales, and lets the optimizer
    /// choose the next variables. `gradients` are, for each realization, those of the parts of the
    /// objective and of the constraints of the analysis.
    fn update(
        &self,
        next: &mut OptimizationState,
        record: &mut IterationRecord,
        values: &Values,
        designs: &Designs,
        gradients: &[Vec<ElementValues>],
    ) -> Result<(), OptimizeError> {
        let x = next.x.clone();
        let analysis = &self.problem.analysis;
        let Gradients { parts, constraints } = self.gradients_of(&x, values, designs, gradients);
        let interpolates = next.interpolation.as_ref().is_some_and(|of| of.from == next.iteration);
        if self.changes_functions_at(next.iteration) || interpolates {
            next.optimizer.restart();
        }
        if let Some(move_limit) = self.schedule.move_limit.at(next.iteration) {
            next.optimizer.set_move_limit(move_limit);
        }
        let scaling = next.scaling.get_or_insert_with(|| Scaling::new(constraints.len()));
        scaling.learn(&parts.concat(), &constraints);
        let scaled = values.scaled(scaling);
        let slopes = functions::scaled_gradients(scaling, parts, constraints);
        let functions = Functions::new(scaled.objective, &slopes.objective, &scaled.constraints, &slopes.constraints)
            .minimising_the_largest_of(scaled.largest_of);
        let bounds = Bounds::of_variables(x.len());
        let step = next.optimizer.update(&x, bounds.both(), &functions, analysis.linear.ranks())?;
        record.change = Some(largest_change(&step.x, &x));
        record.optimality = Some(step.kkt_residual.norm);
        functions::set_multipliers(record, &step.lambda, scaling, self.bounded);
        next.x_before = Some(std::mem::replace(&mut next.x, step.x.into()));
        next.iteration += 1;
        Ok(())
    }
}

fn largest_change(x: &[f64], before: &[f64]) -> f64 {
    x.iter().zip(before).map(|(x, before)| (x - before).abs()).fold(0.0, f64::max)
}

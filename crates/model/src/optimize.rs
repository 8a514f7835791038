//! The optimization loop: analyse, differentiate, filter, update.
//!
//! ```text
//! x ──design variables──▶ φ ──march──▶ θ ──sweep──▶ dθ/dφ ──sensitivity filter──▶ MMA ──▶ x
//! ```
//!
//! [`Optimization`] only advances; the caller handles time, files and screens. All that the next iteration depends on
//! is in [`OptimizationState`] and the path of the last design. Both can be stored and restored bit for bit.

use crate::analysis::{AnalysisError, Forward};
use crate::problem::Problem;
use serde::{Deserialize, Serialize};
use slipstick_design::{
    DesignVariables, DomainValues, ElementValues, FilterError, Functions, Mma, MmaError, MmaParameters, Scaling,
    SensitivityFilter, VariableValues, VolumeConstraint, VolumeError,
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
    /// Largest change of a density in the update that followed; `None` after the last evaluation.
    pub change: Option<f64>,
    /// Norm of the optimality residual of the (filtered, scaled) problem at this design, as MMA sees it.
    pub optimality: Option<f64>,
    /// Newton iterations of the whole path.
    pub newton_iterations: usize,
    /// Newton iterations of failed attempts, including the paths that failed before the update was halved.
    #[serde(default)]
    pub failed_iterations: usize,
    /// Uzawa iterations of the whole path.
    pub uzawa_iterations: usize,
    /// Accepted (sub-)steps.
    pub increments: usize,
    /// Slave nodes open, sticking, slipping at the end of the path.
    pub status: [usize; 3],
    /// How often the update was halved because the path could not be marched with the full one.
    pub halvings: usize,
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
    /// The optimizer's memory.
    pub mma: Mma,
    /// Scales of objective and constraint from the first iteration.
    pub scaling: Option<Scaling>,
    /// All evaluated designs.
    pub history: Vec<IterationRecord>,
}

/// How a problem is optimized.
#[derive(Debug, Clone, PartialEq)]
pub struct OptimizationOptions {
    /// Bound on the fraction of the design domain's volume that is filled, in (0, 1].
    pub volume_fraction: f64,
    /// Filter of the sensitivities; `None` for none.
    pub filter: Option<FilterOptions>,
    /// Number of updates.
    pub iterations: usize,
    /// The optimization stops early if no density changes by more than this.
    pub tolerance: Option<f64>,
    /// Parameters of MMA.
    pub mma: MmaParameters,
    /// Whether each march takes its start values from the path of the previous design.
    pub follow_previous_design: bool,
}

/// A filter of sensitivities.
#[derive(Debug, Clone, PartialEq)]
pub struct FilterOptions {
    /// Radius. \[L\]
    pub radius: f64,
    /// Symmetry planes, across which elements have mirror images: axis (0, 1 or 2) and coordinate. \[L\]
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
    /// The filter is impossible.
    #[error(transparent)]
    Filter(FilterError),
    /// The bound on the volume is impossible.
    #[error(transparent)]
    Volume(VolumeError),
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
    /// The objective of a design is only round-off, so it permits no update; the state is that of the last finished
    /// iteration.
    #[error("{}", .0.rounding.map_or(String::new(), |rounding| rounding.to_string()))]
    Rounding(Box<Forward>),
    /// Stopped from outside, in the middle of an iteration; the state is that of the last finished one.
    #[error("interrupted")]
    Interrupted,
}

/// The last analysed design.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluated {
    /// Densities of all elements.
    pub density: ElementValues,
    /// dθ/dφ of all elements, unfiltered; `None` for the last evaluation, which needs no gradient.
    pub gradient: Option<ElementValues>,
}

/// An optimization in progress.
pub struct Optimization {
    /// The problem being designed.
    pub problem: Problem,
    variables: DesignVariables,
    filter: Option<SensitivityFilter>,
    volume: VolumeConstraint,
    limit: f64,
    iterations: usize,
    tolerance: Option<f64>,
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
    /// Newton iterations of the paths that failed earlier.
    lost: usize,
}

/// How often an update is halved when the path of the new design cannot be marched.
const MAX_HALVINGS: usize = 3;

impl Optimization {
    /// Prepares the optimization of a problem.
    ///
    /// # Errors
    /// [`PrepareError`] if the problem has no design or no objective, or an option is out of its range.
    pub fn new(problem: Problem, options: OptimizationOptions) -> Result<Self, PrepareError> {
        if problem.analysis.objective.is_none() {
            return Err(PrepareError::NoObjective);
        }
        let variables = problem.variables.clone().ok_or(PrepareError::NoDesign)?;
        let volumes = variables.on_domain(&problem.mesh.element_volumes().into());
        let OptimizationOptions { volume_fraction, filter, iterations, tolerance, mma, follow_previous_design } =
            options;
        let filter = filter.map(|FilterOptions { radius, planes }| {
            let centroids = problem.mesh.centroids();
            let centroids: Vec<[f64; 3]> = variables.domain().iter().map(|&e| centroids[e as usize]).collect();
            let ranks = problem.analysis.model().share().ranks().clone();
            SensitivityFilter::on_ranks(&centroids, &volumes, radius, &planes, ranks)
        });
        let filter = filter.transpose().map_err(PrepareError::Filter)?;
        let volume = VolumeConstraint::new(volumes, volume_fraction).map_err(PrepareError::Volume)?;
        let x = variables.restrict(&problem.initial_density);
        let state = OptimizationState {
            iteration: 0,
            mma: Mma::new(x.len(), 1, mma),
            x,
            x_before: None,
            scaling: None,
            history: Vec::new(),
        };
        Ok(Self {
            problem,
            variables,
            filter,
            volume,
            limit: volume_fraction,
            iterations,
            tolerance,
            follow: follow_previous_design,
            evaluated: None,
            state,
        })
    }

    /// Densities of all elements at the current variables.
    pub fn density(&self) -> ElementValues {
        self.variables.densities(&self.state.x)
    }

    /// The design of the last [`advance`](Self::advance); `None` before the first.
    pub fn evaluated(&self) -> Option<&Evaluated> {
        self.evaluated.as_ref()
    }

    /// Bound on the volume fraction.
    pub fn volume_limit(&self) -> f64 {
        self.limit
    }

    /// Whether each march takes its start values from the path of the previous design. The next iteration then depends
    /// not only on the state, but also on that path, in `problem.analysis.guide`.
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

    /// Whether all updates are made (or the change fell below the tolerance) and the last design is evaluated.
    pub fn finished(&self) -> bool {
        let evaluated = self.state.history.len() > self.state.iteration;
        evaluated && self.done()
    }

    /// Whether no further update is needed.
    fn done(&self) -> bool {
        let settled = self.state.history.iter().rev().find_map(|r| r.change);
        self.state.iteration >= self.iterations
            || matches!((self.tolerance, settled), (Some(bound), Some(change)) if change <= bound)
    }

    /// Evaluates the current design and, unless all updates are made, updates it. Returns the forward analysis of the
    /// evaluated design, whose record is the last one of the state's history.
    ///
    /// If the path of an updated design cannot be marched, the update is halved, up to a few times. The optimization
    /// stops at a design whose objective is only round-off.
    ///
    /// # Errors
    /// See [`OptimizeError`]; the state is then that of the last finished iteration.
    pub fn advance(&mut self, observer: &mut dyn MarchObserver) -> Result<Forward, OptimizeError> {
        let Marched { x, density, mut forward, halvings, lost } = self.march_or_step_back(observer)?;
        if forward.rounding.is_some() {
            forward.path.forget_factors();
            return Err(OptimizeError::Rounding(Box::new(forward)));
        }
        let domain = self.variables.on_domain(&density);
        let mut record = record(self.state.iteration, &forward, self.volume.fraction(&domain));
        record.halvings = halvings;
        record.failed_iterations += lost;
        let mut next = OptimizationState { x, ..self.state.clone() };
        let mut derivative = None;
        if !self.done() {
            let gradient = self.problem.analysis.gradient(&forward)?;
            forward.path.forget_factors();
            if observer.cancelled() {
                return Err(OptimizeError::Interrupted);
            }
            self.update(&mut next, &mut record, &domain, forward.value, &gradient)?;
            derivative = Some(gradient);
        }
        if self.follow && next.iteration > self.state.iteration {
            let analysis = &mut self.problem.analysis;
            analysis.guide = Some(Guide::of(&forward.path, analysis.linear.ranks()));
        }
        next.history.push(record);
        self.state = next;
        self.evaluated = Some(Evaluated { density, gradient: derivative });
        Ok(forward)
    }

    /// Marches with the variables of the state or, if that fails, with half of their last update.
    fn march_or_step_back(&mut self, observer: &mut dyn MarchObserver) -> Result<Marched, OptimizeError> {
        let mut x = self.state.x.clone();
        let (mut halvings, mut lost) = (0, 0);
        loop {
            let density = self.variables.densities(&x);
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

    /// Filters the gradient, scales, and lets MMA choose the next variables.
    fn update(
        &self,
        next: &mut OptimizationState,
        record: &mut IterationRecord,
        domain_density: &DomainValues,
        value: f64,
        gradient: &ElementValues,
    ) -> Result<(), OptimizeError> {
        let on_domain = self.variables.on_domain(gradient);
        let filtered = match &self.filter {
            Some(filter) => filter.apply(domain_density, &on_domain),
            None => on_domain,
        };
        let objective_gradient = Vec::from(self.variables.restrict_domain(&filtered));
        let volume_gradient = vec![self.variables.restrict_domain(&self.volume.gradient()).into()];
        let scaling =
            next.scaling.get_or_insert_with(|| Scaling::from_first(&objective_gradient, &volume_gradient)).clone();
        let (f, df) = scaling.scale_objective(value, &objective_gradient);
        let (g, dg) = scaling.scale_constraints(&[self.volume.value(domain_density)], &volume_gradient);
        let n = next.x.len();
        let ranks = self.problem.analysis.linear.ranks();
        let (lower, upper) = (vec![0.0; n], vec![1.0; n]);
        let step = next.mma.update_on(&next.x, [&lower, &upper], &Functions::new(f, &df, &g, &dg), ranks)?;
        record.change = Some(step.x.iter().zip(&next.x).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max));
        record.optimality = Some(step.kkt_residual.norm);
        next.x_before = Some(std::mem::replace(&mut next.x, step.x.into()));
        next.iteration += 1;
        Ok(())
    }
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
        increments: states.len() - 1,
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

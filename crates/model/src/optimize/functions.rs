//! Objective and constraints of the realizations of a design, as the optimizer sees them.
//!
//! The objective has one or more parts, of which the largest counts: one for each realization of the
//! design, and for each load case if the worst of them counts. With more than one, the optimizer
//! bounds all parts by a variable ([`slipstick_design::Functions::largest_of`]).

use crate::analysis::Forward;
use crate::problem::Problem;
use slipstick_design::{Bound, DomainValues, ElementValues, Scaling, VariableValues};

use super::{FunctionRecord, IterationRecord, Optimization};

/// The analysed realizations of a design: the nominal one, then the eroded and the dilated one, if
/// there are three.
pub(super) struct Designs {
    pub forwards: Vec<Forward>,
}

impl Designs {
    /// Of the nominal design.
    pub fn first(&self) -> &Forward {
        &self.forwards[0]
    }

    pub fn into_first(mut self) -> Forward {
        self.forwards.swap_remove(0)
    }

    /// The first one whose objective is only round-off.
    pub fn take_rounded(&mut self) -> Option<Forward> {
        let rounded = self.forwards.iter().position(|forward| forward.rounding.is_some())?;
        Some(self.forwards.swap_remove(rounded))
    }

    /// Whether the objective of any of them is only round-off.
    pub fn is_rounded(&self) -> bool {
        self.forwards.iter().any(|forward| forward.rounding.is_some())
    }

    /// Densities of the nominal design.
    pub fn nominal(&self) -> &ElementValues {
        &self.first().density
    }

    /// Whether all paths have this number of steps.
    pub fn finished(&self, steps: usize) -> bool {
        self.forwards.iter().all(|forward| forward.path.steps == steps)
    }

    pub fn forget_factors(&mut self) {
        self.forwards.iter_mut().for_each(|forward| forward.path.forget_factors());
    }

    pub fn newton_iterations(&self) -> usize {
        self.forwards.iter().map(|forward| forward.path.newton_iterations()).sum()
    }

    pub fn failed_iterations(&self) -> usize {
        self.forwards.iter().map(|forward| forward.path.failed_iterations()).sum()
    }
}

/// Numbers of functions.
pub(super) struct Counts {
    /// Parts of the objective; 0 if there is only one.
    parts: usize,
    /// Bounds on the volume and on the quantities of all realizations.
    pub constraints: usize,
}

impl Counts {
    pub fn new(parts: &[String], bounded: bool, problem: &Problem, realisations: usize) -> Self {
        let parts = parts.len();
        Self { parts, constraints: usize::from(bounded) + realisations * problem.analysis.constraints.len() }
    }

    /// Constraints in the optimizer: those of the problem, and the bounds on the parts.
    pub fn of_optimizer(&self) -> usize {
        self.parts + self.constraints
    }
}

/// A constraint at a design: the bounded value, the extreme for which it stands, g ≤ 0, and ∂g/∂value.
struct ConstraintFunction {
    value: f64,
    extreme: Option<f64>,
    violation: (f64, f64),
}

/// Values of all functions at a design.
pub(super) struct Values {
    /// The parts of the objective.
    parts: Vec<f64>,
    /// The bound on the volume, if any; then, for each realization, the constraints of the analysis.
    constraints: Vec<ConstraintFunction>,
    /// What was added to the values of the constraints of the analysis.
    pub shifts: Vec<f64>,
}

/// The same, as the optimizer sees them.
pub(super) struct Scaled {
    pub objective: f64,
    pub constraints: Vec<f64>,
    pub largest_of: usize,
}

impl Values {
    /// The largest part of the objective.
    pub fn objective(&self) -> f64 {
        self.parts.iter().copied().fold(f64::NEG_INFINITY, f64::max)
    }

    /// Largest violation of a constraint, relative to its bound; 0 if all are met.
    pub fn violation(&self) -> f64 {
        self.constraints.iter().fold(0.0, |worst: f64, of| worst.max(of.violation.0))
    }

    pub fn scaled(&self, scaling: &Scaling) -> Scaled {
        let bounds = scaling.constraints().zip(&self.constraints).map(|(factor, of)| factor * of.violation.0);
        match self.parts[..] {
            [only] => Scaled { objective: scaling.objective() * only, constraints: bounds.collect(), largest_of: 0 },
            _ => {
                let parts = self.parts.iter().map(|value| scaling.objective() * value);
                Scaled { objective: 0.0, constraints: parts.chain(bounds).collect(), largest_of: self.parts.len() }
            }
        }
    }
}

/// Gradients of all functions with respect to the variables.
pub(super) struct Gradients {
    pub parts: Vec<Vec<f64>>,
    pub constraints: Vec<Vec<f64>>,
}

/// The same, as the optimizer sees them.
pub(super) struct ScaledGradients {
    pub objective: Vec<f64>,
    pub constraints: Vec<Vec<f64>>,
}

pub(super) fn scaled_gradients(
    scaling: &Scaling,
    mut parts: Vec<Vec<f64>>,
    mut constraints: Vec<Vec<f64>>,
) -> ScaledGradients {
    parts.iter_mut().flatten().for_each(|slope| *slope *= scaling.objective());
    for (gradient, factor) in constraints.iter_mut().zip(scaling.constraints()) {
        gradient.iter_mut().for_each(|slope| *slope *= factor);
    }
    if parts.len() == 1 {
        return ScaledGradients { objective: parts.swap_remove(0), constraints };
    }
    let objective = vec![0.0; parts.first().map_or(0, Vec::len)];
    ScaledGradients { objective, constraints: parts.into_iter().chain(constraints).collect() }
}

/// Writes the multipliers of a step into the record.
pub(super) fn set_multipliers(record: &mut IterationRecord, lambda: &[f64], scaling: &Scaling, bounded: bool) {
    let (of_parts, of_constraints) = lambda.split_at(record.parts.len());
    record.parts.iter_mut().zip(of_parts).for_each(|(part, lambda)| part.multiplier = Some(*lambda));
    let first = usize::from(bounded);
    let others = (record.constraints.len() - first).max(1);
    for (number, (lambda, factor)) in of_constraints.iter().zip(scaling.constraints()).enumerate() {
        // the constraints of the analysis repeat for each realization
        let at = if number < first { number } else { first + (number - first) % others };
        let multiplier = lambda * factor / scaling.objective();
        let sum = &mut record.constraints[at].multiplier;
        *sum = Some(sum.unwrap_or(0.0) + multiplier);
    }
}

impl Optimization {
    /// The bound on the volume of the dilated design in the next update: the nominal design keeps its
    /// own bound if the ratio of both volumes stays. `None` if there is no dilated design.
    ///
    /// Wang, Lazarov and Sigmund (2011) update it only every 20 iterations. From a grey design, whose
    /// dilated volume is far larger than the nominal one, the nominal volume would rise by a third
    /// meanwhile.
    pub(super) fn dilated_limit(&self, designs: &Designs) -> Option<f64> {
        let [nominal, _, dilated] = &designs.forwards[..] else { return None };
        let fraction = |forward: &Forward| self.volume.fraction(&self.on_domain(forward));
        let ratio = fraction(dilated) / fraction(nominal);
        Some(self.volume.limit() * if ratio.is_finite() { ratio } else { 1.0 })
    }

    fn on_domain(&self, forward: &Forward) -> DomainValues {
        self.realisations.variables().on_domain(&forward.density)
    }

    /// Values of all functions. Smooth values of bounded extremes are shifted to these: by `held`, with
    /// which the current approximations were made, or by what these designs need.
    pub(super) fn values(&self, designs: &Designs, dilated_limit: Option<f64>, held: Option<&[f64]>) -> Values {
        let volume = designs.forwards.last().filter(|_| self.bounded).map(|largest| {
            let (value, limit) = (self.volume.fraction(&self.on_domain(largest)), self.volume.limit());
            let bound = dilated_limit.unwrap_or(limit);
            ConstraintFunction { value, extreme: None, violation: (value / bound - 1.0, limit / bound) }
        });
        let constraints = || self.problem.analysis.constraints.iter();
        let of_forward = |forward: &Forward| -> Vec<(Bound, bool, f64, Option<f64>)> {
            let values = forward.constraints.iter().zip(&forward.extremes);
            let each = constraints().zip(values);
            each.map(|(of, (value, extreme))| (of.bound, of.corrected, *value, *extreme)).collect()
        };
        let others = designs.forwards.iter().flat_map(of_forward).enumerate();
        let (others, shifts): (Vec<ConstraintFunction>, Vec<f64>) = others
            .map(|(number, (bound, corrected, value, extreme))| {
                let own = || extreme.filter(|_| corrected).map_or(0.0, |extreme| bound.correction(value, extreme));
                let shift = held.and_then(|held| held.get(number).copied()).unwrap_or_else(own);
                (ConstraintFunction { value, extreme, violation: bound.violation(value + shift) }, shift)
            })
            .unzip();
        Values {
            parts: designs.forwards.iter().flat_map(|forward| forward.parts.iter().copied()).collect(),
            constraints: volume.into_iter().chain(others).collect(),
            shifts,
        }
    }

    /// Gradients of all functions with respect to the variables `x`; `gradients` are those with
    /// respect to the densities of each realization, of the parts of the objective and of the
    /// constraints of the analysis.
    pub(super) fn gradients_of(
        &self,
        x: &VariableValues,
        values: &Values,
        designs: &Designs,
        gradients: &[Vec<ElementValues>],
    ) -> Gradients {
        let variables = self.realisations.variables();
        let on_variables = |realisation: usize, gradient: &ElementValues, depends_on_state: bool| -> Vec<f64> {
            match &self.filter {
                Some(filter) if depends_on_state => {
                    let domain = self.on_domain(&designs.forwards[realisation]);
                    variables.restrict_domain(&filter.apply(&domain, &variables.on_domain(gradient))).into()
                }
                _ => self
                    .realisations
                    .map_of(realisation, self.state.iteration, &self.state.divided)
                    .pull_back(x, gradient)
                    .into(),
            }
        };
        // all that depend on the state are filtered alike: a gain that one gradient shows and
        // another hides would mislead the optimizer
        let analysis = &self.problem.analysis;
        let objective = analysis.objective.as_ref().is_some_and(|objective| objective.depends_on_state());
        let constrained: Vec<bool> =
            analysis.constraints.iter().map(|constraint| constraint.response.depends_on_state()).collect();
        let (mut parts, mut others) = (Vec::new(), Vec::new());
        for (number, (forward, gradients)) in designs.forwards.iter().zip(gradients).enumerate() {
            let (of_parts, of_constraints) = gradients.split_at(forward.parts.len());
            parts.extend(of_parts.iter().map(|gradient| on_variables(number, gradient, objective)));
            let each = of_constraints.iter().zip(&constrained);
            others.extend(each.map(|(gradient, depends)| on_variables(number, gradient, *depends)));
        }
        let last = designs.forwards.len() - 1;
        let volume = self.bounded.then(|| on_variables(last, &variables.spread_domain(&self.volume.gradient()), false));
        let constraints = volume.into_iter().chain(others).zip(&values.constraints);
        let scaled = |(gradient, function): (Vec<f64>, &ConstraintFunction)| {
            gradient.into_iter().map(|slope| function.violation.1 * slope).collect()
        };
        Gradients { parts, constraints: constraints.map(scaled).collect() }
    }

    /// The record of analysed designs, without multipliers.
    pub(super) fn record(&self, designs: &Designs, values: &Values) -> IterationRecord {
        let domain = self.on_domain(designs.first());
        let volume_fraction = self.volume.fraction(&domain);
        let states = || designs.forwards.iter().flat_map(|forward| &forward.path.states);
        let last = designs.first().path.states.last().and_then(|state| state.report.iterations.last());
        let first = usize::from(self.bounded);
        let each = self.problem.analysis.constraints.len();
        // the bound on the volume is that of the nominal design
        let volume = self.bounded.then(|| (volume_fraction, None, volume_fraction / self.volume.limit() - 1.0));
        let worst = |constraint: usize| {
            let of_realisations = values.constraints[first + constraint..].iter().step_by(each.max(1));
            let of_realisations = of_realisations.map(|of| (of.value, of.extreme, of.violation.0));
            of_realisations.reduce(|a, b| if b.2 > a.2 { b } else { a }).unwrap_or_default()
        };
        let constraints: Vec<(f64, Option<f64>, f64)> = volume.into_iter().chain((0..each).map(worst)).collect();
        let function = |&value: &f64| FunctionRecord { value, ..FunctionRecord::default() };
        let bounded = |&(value, extreme, _): &_| FunctionRecord { value, extreme, multiplier: None };
        IterationRecord {
            iteration: self.state.iteration,
            objective: values.parts.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            volume_fraction,
            discreteness: self.volume.discreteness(&domain),
            newton_iterations: designs.newton_iterations(),
            failed_iterations: designs.failed_iterations(),
            uzawa_iterations: states().map(|state| state.report.uzawa).sum(),
            increments: designs.forwards.iter().map(|forward| forward.path.increments()).sum(),
            status: last.map_or([0; 3], |report| report.status),
            parts: if values.parts.len() > 1 { values.parts.iter().map(function).collect() } else { Vec::new() },
            constraints: constraints.iter().map(bounded).collect(),
            violation: constraints.iter().fold(0.0, |worst: f64, (.., violation)| worst.max(*violation)),
            ..IterationRecord::default()
        }
    }
}

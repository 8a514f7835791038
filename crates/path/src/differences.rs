//! Comparison of a problem's [pull-back](StepProblem::pull_back) with central differences, for every
//! [input](Inputs) of a step. It knows the inputs only as a list, so that a new one is compared in
//! every problem before anybody writes a test for it.

use crate::failure::StateError;
use crate::inputs::Inputs;
use crate::problem::{Adjoint, Iteration, StepProblem, Wanted};
use crate::time::Span;
use std::ops::Range;

/// A converged step of a problem, and how to vary its inputs.
pub struct Comparison<'a, P: StepProblem> {
    /// The problem with the density, the parameters and the positions of these inputs.
    pub problem: &'a dyn Fn(&Inputs) -> P,
    /// A workspace of a problem.
    pub workspace: &'a dyn Fn(&P) -> P::Workspace,
    /// When the step starts and ends.
    pub span: Span,
    /// The inputs, with unknowns that solve the step's equations. All derivatives are exact there; elsewhere,
    /// the equations may depend on settings of the iteration. An empty list is not compared.
    pub at: Inputs,
    /// Increment of the differences for each field of the inputs, in the order of their
    /// [names](Inputs::NAMES).
    pub increments: [f64; 6],
    /// Parts of the history, which are compared separately.
    pub history: Vec<(&'a str, Range<usize>)>,
}

/// How far the derivatives with respect to an input are from differences.
#[derive(Debug, Clone, PartialEq)]
pub struct Deviation {
    /// The input: its field's name, and for the history, its part.
    pub input: String,
    /// Largest derivative, by differences.
    pub size: f64,
    /// Largest deviation of a derivative from the difference.
    pub largest: f64,
}

impl Deviation {
    /// The largest deviation relative to the largest derivative.
    pub fn relative(&self) -> f64 {
        if self.largest == 0.0 { 0.0 } else { self.largest / self.size }
    }
}

impl<P: StepProblem> Comparison<'_, P> {
    /// Compares the derivatives of ψ = λᵀF + ηᵀG + μᵀŷ, for random λ, η and μ, with central differences of
    /// order 4.
    ///
    /// # Errors
    /// If the equations have no value at the inputs or near them.
    ///
    /// # Panics
    /// If `at` does not have the problem's numbers of inputs.
    pub fn deviations(&self) -> Result<Vec<Deviation>, StateError> {
        let problem = (self.problem)(&self.at);
        let unknowns = problem.unknowns();
        let mut into = Inputs::zero(unknowns);
        let lengths = self.at.fields().map(<[f64]>::len);
        for (to, &length) in into.fields_mut().into_iter().zip(&lengths) {
            assert!(length == 0 || length == to.len(), "{length} inputs instead of {}", to.len());
            to.truncate(length);
        }
        let mut seed = 1u64;
        let mut random = |count: usize| -> Vec<f64> { (0..count).map(|_| next(&mut seed)).collect() };
        let (lambda, eta) = (random(unknowns.count()), random(unknowns.history));
        let fixed = unknowns.fixed(crate::Held::None);
        let only = |of: Vec<f64>, wanted: bool| -> Vec<f64> {
            of.into_iter().zip(fixed).map(|(value, &fixed)| if fixed == wanted { value } else { 0.0 }).collect()
        };
        let mut mu = only(random(unknowns.count()), true);
        // the rows and columns of unknowns that follow from others belong to these
        let lambda = if let Some(dependent) = problem.dependent() {
            dependent.gather(&self.at.unknowns, &mut mu);
            only(lambda, false)
        } else {
            lambda
        };
        self.pull_back(&problem, &Adjoint { lambda: &lambda, eta: &eta, mu: &mu }, &mut into)?;

        let value = |inputs: &Inputs, of_forces: bool| -> Result<f64, StateError> {
            let [residual, history, prescribed] = self.outputs(inputs)?;
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let forces = if of_forces { dot(&lambda, &residual) } else { 0.0 };
            Ok(forces + dot(&eta, &history) + dot(&mu, &prescribed))
        };
        let mut deviations = Vec::new();
        for (f, name) in Inputs::<f64>::NAMES.into_iter().enumerate() {
            let whole = vec![("", 0..lengths[f])];
            let parts = if name == "history" && !self.history.is_empty() { self.history.clone() } else { whole };
            for (part, range) in parts.into_iter().filter(|(_, range)| !range.is_empty()) {
                let (mut size, mut largest) = (0.0f64, 0.0f64);
                for i in range {
                    // the derivative of F by y_n is the tangent
                    let at = |s: f64| {
                        let mut moved = self.at.clone();
                        moved.fields_mut()[f][i] += s * self.increments[f];
                        value(&moved, name != "unknowns")
                    };
                    let expected =
                        (8.0 * (at(1.0)? - at(-1.0)?) - (at(2.0)? - at(-2.0)?)) / (12.0 * self.increments[f]);
                    size = size.max(expected.abs());
                    let deviation = (into.fields()[f][i] - expected).abs();
                    largest = if deviation.is_nan() { f64::NAN } else { largest.max(deviation) };
                }
                let input = [name, part].join(" ").trim_end().to_string();
                deviations.push(Deviation { input, size, largest });
            }
        }
        Ok(deviations)
    }

    fn pull_back(&self, problem: &P, adjoint: &Adjoint<'_>, into: &mut Inputs) -> Result<(), StateError> {
        let workspace = &mut (self.workspace)(problem);
        let previous = self.at.previous_state();
        let geometry = problem.geometry(&previous.unknowns, Wanted::Derivatives, workspace)?;
        let step = problem.begin(&previous, &geometry, self.span, workspace)?;
        let (y, iteration) = (&self.at.unknowns, Iteration::default());
        let at = problem.evaluate(&step, y, None, iteration, Wanted::Both, workspace)?;
        let mut lambda = adjoint.lambda.to_vec();
        if let Some(dependent) = problem.dependent() {
            dependent.spread(&at.unknowns, &mut lambda);
        }
        // as the sweep does: first with respect to y_n, then to all others
        let mut current = Inputs { unknowns: std::mem::take(&mut into.unknowns), ..Inputs::default() };
        problem.pull_back(&step, &at, &Adjoint { eta: adjoint.eta, ..Adjoint::default() }, &mut current)?;
        problem.pull_back(&step, &at, &Adjoint { lambda: &lambda, ..*adjoint }, into)?;
        into.unknowns = current.unknowns;
        if let Some(dependent) = problem.dependent() {
            dependent.gather(&at.unknowns, &mut into.unknowns);
            dependent.gather(&previous.unknowns, &mut into.previous);
        }
        Ok(())
    }

    /// F, G and the prescribed unknowns.
    fn outputs(&self, inputs: &Inputs) -> Result<[Vec<f64>; 3], StateError> {
        let problem = (self.problem)(inputs);
        let workspace = &mut (self.workspace)(&problem);
        let previous = inputs.previous_state();
        let geometry = problem.geometry(&previous.unknowns, Wanted::Residual, workspace)?;
        let step = problem.begin(&previous, &geometry, self.span, workspace)?;
        let at = problem.evaluate(&step, &inputs.unknowns, None, Iteration::default(), Wanted::Both, workspace)?;
        let mut prescribed = vec![0.0; inputs.unknowns.len()];
        problem.prescribe(self.span.end(), &mut prescribed);
        Ok([at.residual.clone(), problem.finish(&step, &at)?, prescribed])
    }
}

/// The next number of a linear congruential generator, between −1 and 1 (Knuth's MMIX constants).
fn next(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::equations::Differentiated;
    use crate::slider::Slider;
    use crate::spring::Spring;

    fn assert_small(deviations: &[Deviation], inputs: usize, bound: f64) {
        assert_eq!(deviations.len(), inputs, "{deviations:?}");
        for deviation in deviations {
            assert!(deviation.relative() < bound && deviation.size > 0.0, "{deviation:?}");
        }
    }

    fn spring() -> Inputs {
        Inputs {
            unknowns: vec![0.8, -0.4, 0.2, 0.3, 0.1, -0.2],
            previous: vec![0.4, -0.2, 0.1, 0.2, 0.05, -0.1],
            history: vec![0.1, -0.3, 0.2],
            density: vec![1.3, 0.7, 2.1],
            parameters: vec![0.8],
            position: vec![0.4, -0.3, 0.7],
        }
    }

    fn of_spring(inputs: &Inputs) -> Spring {
        let stiffness = [inputs.density[0], inputs.density[1], inputs.density[2]];
        let position = [inputs.position[0], inputs.position[1], inputs.position[2]];
        Spring { stiffness, position, amplitude: inputs.parameters[0], ..Spring::default() }
    }

    /// A spring with every input, whose equations hold no settings, at any state.
    #[test]
    fn all_inputs_of_a_spring() {
        let (problem, workspace) = (of_spring, |_: &Spring| Spring::workspace());
        let comparison = Comparison {
            problem: &problem,
            workspace: &workspace,
            span: [0.5, 1.0].into(),
            at: spring(),
            increments: [1e-3; 6],
            history: vec![("first", 0..1), ("others", 1..3)],
        };
        assert_small(&comparison.deviations().unwrap(), 7, 1e-10);
    }

    /// Automatic differentiation agrees with differences, in stick and in slip.
    #[test]
    fn all_inputs_of_the_slider() {
        let problem = |inputs: &Inputs| Differentiated(Slider::new(inputs.density[0]));
        for before in [0.018, 0.01] {
            let comparison = Comparison {
                problem: &problem,
                workspace: &Differentiated::workspace,
                span: [0.5, 1.0].into(),
                at: Inputs {
                    unknowns: vec![0.02, -0.02, 0.0],
                    previous: vec![before, -0.02, 0.0],
                    history: vec![0.1],
                    density: vec![2.0],
                    ..Inputs::default()
                },
                increments: [1e-4; 6],
                history: Vec::new(),
            };
            let deviations = comparison.deviations().unwrap();
            assert_eq!(deviations.len(), 4, "{deviations:?}");
            // in slip, nothing depends on the previous state
            let slips = deviations.iter().filter(|deviation| deviation.size < 1e-9).count();
            assert_eq!(slips, if before < 0.015 { 2 } else { 0 }, "{deviations:?}");
            assert!(deviations.iter().all(|d| d.largest < 1e-9), "{deviations:?}");
        }
    }
}

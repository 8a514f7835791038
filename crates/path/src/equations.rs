//! Small problems defined by their residual only; automatic differentiation supplies all
//! derivatives.

use crate::{
    Adjoint, ContactStatus, Evaluated, Explicit, Inputs, Iteration, LoadTime, Observed, PathResponses, Scales, Span,
    StateError, StepProblem, StepState, Unknowns, Wanted,
};
use nalgebra::DMatrix;
use num_dual::Dual64;
use slipstick_linalg::{BlockMatrix, BlockPattern};
use std::sync::Arc;

/// The equations of a load step with a few unknowns, for which [`Differentiated`] implements
/// [`StepProblem`].
///
/// [`step`](Self::step) computes F and h in dual numbers. It may branch on real parts (`x.re`); the
/// derivatives are those of the branch taken.
pub trait Equations {
    /// Numbers of unknowns and inputs, and which unknowns are prescribed. There must be a multiple of
    /// three unknowns, because matrices consist of 3 × 3 blocks: prescribe those left over. Parameters
    /// and multipliers are not supported.
    fn unknowns(&self) -> &Unknowns;

    /// φ: one value per design.
    fn design(&self) -> Vec<f64>;

    /// Writes the prescribed unknowns of this time into `y`; by default they remain as they are.
    fn prescribe(&self, time: LoadTime, y: &mut [f64]) {
        let _ = (time, y);
    }

    /// Factors of the external forces at this time; by default there are no such forces.
    fn load_factors(&self, time: LoadTime) -> Vec<f64> {
        let _ = time;
        Vec::new()
    }

    /// F and h of the step over `span`.
    fn step(&self, span: Span, at: &Inputs<Dual64>) -> Outputs;
}

/// The results of the equations of a step.
#[derive(Debug, Clone)]
pub struct Outputs {
    /// F: one entry per unknown; those of prescribed unknowns are not used.
    pub residual: Vec<Dual64>,
    /// h_n.
    pub history: Vec<Dual64>,
    /// Status of every contact node; empty if there are none.
    pub status: Vec<ContactStatus>,
}

/// A problem given by its [`Equations`]. Each evaluation computes them once for every input, and keeps
/// h_n with the derivatives of F and h_n with respect to y_n, y_{n−1}, h_{n−1} and φ (the columns, in
/// this order).
///
/// Tolerances are relative to forces and displacements of 1, so choose units in which they are of
/// this order. Panics if the lengths returned by `step` do not match [`Equations::unknowns`].
#[derive(Debug, Clone)]
pub struct Differentiated<E>(pub E);

impl<E: Equations + 'static> Differentiated<E> {
    /// The state at time 0, with y = 0 and h = 0.
    pub fn rest(&self) -> StepState {
        let unknowns = self.0.unknowns();
        StepState { unknowns: vec![0.0; unknowns.count()], history: vec![0.0; unknowns.history] }
    }

    /// A matrix for the tangent.
    ///
    /// # Panics
    /// If the number of unknowns is not a multiple of three.
    pub fn workspace(&self) -> BlockMatrix {
        let count = self.0.unknowns().count();
        assert!(count.is_multiple_of(3), "{count} unknowns: add prescribed ones up to a multiple of three");
        let rows = count / 3;
        BlockMatrix::new(Arc::new(BlockPattern::from_rows(&vec![(0..rows as u32).collect(); rows])))
    }
}

impl<E: Equations + 'static> StepProblem for Differentiated<E> {
    type Geometry = ();
    /// The previous state, and the start and end of the step.
    type Step = (StepState, Span);
    /// h, and the derivatives of (F, h).
    type State = (Vec<f64>, DMatrix<f64>);
    type Workspace = BlockMatrix;

    fn unknowns(&self) -> &Unknowns {
        self.0.unknowns()
    }

    fn prescribe(&self, time: LoadTime, y: &mut [f64]) {
        self.0.prescribe(time, y);
    }

    fn load_factors(&self, time: LoadTime) -> Vec<f64> {
        self.0.load_factors(time)
    }

    fn geometry(&self, _: &[f64], _: Wanted, _: &mut BlockMatrix) -> Result<(), StateError> {
        Ok(())
    }

    fn begin(&self, previous: &StepState, (): &(), span: Span, _: &mut BlockMatrix) -> Result<Self::Step, StateError> {
        Ok((previous.clone(), span))
    }

    fn evaluate(
        &self,
        (previous, span): &Self::Step,
        y: &[f64],
        _: Option<&()>,
        _: Iteration,
        _: Wanted,
        _: &mut BlockMatrix,
    ) -> Result<Evaluated<Self>, StateError> {
        let StepState { unknowns: before, history } = previous.clone();
        let values =
            Inputs { unknowns: y.to_vec(), previous: before, history, density: self.0.design(), ..Inputs::default() };
        let mut inputs = values.map(|&value| Dual64::from_re(value));
        let columns: Vec<Outputs> = (0..values.fields().map(<[f64]>::len).iter().sum())
            .map(|column| {
                let all = inputs.fields_mut().into_iter().flatten();
                all.enumerate().for_each(|(i, x)| x.eps = f64::from(u8::from(i == column)));
                self.0.step(*span, &inputs)
            })
            .collect();
        let Outputs { residual, history, status } = &columns[0];
        let unknowns = self.0.unknowns();
        assert_eq!(residual.len(), unknowns.count(), "`step` must return one residual per unknown");
        assert_eq!(history.len(), unknowns.history, "`step` must return as many history values as `unknowns` states");
        let slopes = columns.iter().flat_map(|o| o.residual.iter().chain(&o.history).map(|value| value.eps));
        let rows = y.len() + previous.history.len();
        let values = |of: &[Dual64]| of.iter().map(|value| value.re).collect();
        Ok(Evaluated {
            unknowns: y.to_vec(),
            residual: values(residual),
            scales: Scales { force: 1.0, displacement: 1.0, multiplier: 1.0, position: 1.0, rigidity: 0.0 },
            active_set: status.clone(),
            geometry: (),
            state: (values(history), DMatrix::from_iterator(rows, columns.len(), slopes)),
        })
    }

    fn tangent<'w>(
        &self,
        _: &Self::Step,
        at: &Evaluated<Self>,
        matrix: &'w mut BlockMatrix,
    ) -> Result<&'w BlockMatrix, StateError> {
        let (n, slopes) = (at.unknowns.len(), &at.state.1);
        matrix.set_zero();
        for (row, column) in (0..n / 3).flat_map(|row| (0..n / 3).map(move |column| (row, column))) {
            let block: [f64; 9] = std::array::from_fn(|k| slopes[(3 * row + k / 3, 3 * column + k % 3)]);
            matrix.add(row, column, &block);
        }
        Ok(matrix)
    }

    fn finish(&self, _: &Self::Step, at: &Evaluated<Self>) -> Result<Vec<f64>, StateError> {
        Ok(at.state.0.clone())
    }

    fn pull_back(
        &self,
        _: &Self::Step,
        at: &Evaluated<Self>,
        adjoint: &Adjoint<'_>,
        into: &mut Inputs,
    ) -> Result<(), StateError> {
        let (n, slopes) = (at.unknowns.len(), &at.state.1);
        let by = |column: usize| {
            // that of F by y_n is the tangent
            let lambda = if column < n { &[] } else { adjoint.lambda };
            let of_forces: f64 = lambda.iter().enumerate().map(|(row, l)| l * slopes[(row, column)]).sum();
            let of_history: f64 = adjoint.eta.iter().enumerate().map(|(row, e)| e * slopes[(n + row, column)]).sum();
            of_forces + of_history
        };
        let mut first = 0;
        for (field, count) in into.fields_mut().into_iter().zip([n, n, at.state.0.len(), self.0.unknowns().designs]) {
            field.iter_mut().enumerate().for_each(|(i, to)| *to += by(first + i));
            first += count;
        }
        Ok(())
    }
}

/// θ = an unknown at the end of a step.
#[derive(Debug, Clone, Copy)]
pub struct UnknownAt {
    /// Index of the state in the path.
    pub state: usize,
    /// Index of the unknown.
    pub unknown: usize,
}

impl<P: StepProblem> PathResponses<P> for UnknownAt {
    fn count(&self) -> usize {
        1
    }

    fn observes(&self, _: usize, index: usize) -> bool {
        index == self.state
    }

    fn add_derivative(
        &mut self,
        _: usize,
        _: &P,
        _: &Observed<'_, P>,
        to: &mut Explicit<'_>,
    ) -> Result<(), StateError> {
        to.unknowns[self.unknown] += 1.0;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// F = φ u − t for each of `count` unknowns, but only the first `returned` of them.
    struct Springs {
        unknowns: Unknowns,
        returned: usize,
    }

    impl Springs {
        fn new(count: usize, returned: usize) -> Differentiated<Self> {
            Differentiated(Self { unknowns: Unknowns::displacements(&vec![false; count], 1), returned })
        }
    }

    impl Equations for Springs {
        fn unknowns(&self) -> &Unknowns {
            &self.unknowns
        }

        fn design(&self) -> Vec<f64> {
            vec![2.0]
        }

        fn step(&self, span: Span, at: &Inputs<Dual64>) -> Outputs {
            let residual = at.unknowns[..self.returned].iter().map(|u| at.density[0] * u - span.to).collect();
            Outputs { residual, history: Vec::new(), status: Vec::new() }
        }
    }

    fn evaluated(springs: &Differentiated<Springs>) -> Evaluated<Differentiated<Springs>> {
        let (y, step) = ([0.1, 0.2, 0.3], (springs.rest(), Span::from([0.0, 1.0])));
        springs.evaluate(&step, &y, None, Iteration::default(), Wanted::Both, &mut springs.workspace()).unwrap()
    }

    /// By hand: F = 2 u − 1, ∂F/∂u = 2, and (∂F/∂φ)ᵀ λ = u · λ.
    #[test]
    fn springs_have_the_derivatives_found_by_hand() {
        let springs = Springs::new(3, 3);
        let at = evaluated(&springs);
        assert_eq!(at.residual, [-0.8, -0.6, -0.4]);
        let mut matrix = springs.workspace();
        let tangent = springs.tangent(&(springs.rest(), [0.0, 1.0].into()), &at, &mut matrix).unwrap();
        assert_eq!(tangent.values(), [[2.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 2.0]]);
        let mut into = Inputs { density: vec![0.5], ..Inputs::default() };
        let adjoint = Adjoint { lambda: &[1.0, 10.0, 100.0], ..Adjoint::default() };
        springs.pull_back(&(springs.rest(), [0.0, 1.0].into()), &at, &adjoint, &mut into).unwrap();
        assert!((into.density[0] - 32.6).abs() < 1e-13, "{into:?}");
    }

    #[test]
    #[should_panic(expected = "one residual per unknown")]
    fn a_missing_residual_is_named() {
        evaluated(&Springs::new(3, 2));
    }

    #[test]
    #[should_panic(expected = "4 unknowns: add prescribed ones")]
    fn unknowns_fill_blocks_of_three() {
        Springs::new(4, 4).workspace();
    }
}

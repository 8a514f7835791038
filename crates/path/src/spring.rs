//! The smallest load path with all features relevant to a sweep, for tests: a driven node pulls a
//! free one through a nonlinear spring.
//!
//! ```text
//! F = φ ∘ (e + κ e³) + S e + (1 + X²) u + m (h_{n−1} − 0.2 u_{n−1}) − f(t),   e = u − v,   v = a t (1, −0.5, 0.25)
//! h = 0.5 h_{n−1} + 0.3 u² + 0.1 u_{n−1}
//! ```
//!
//! u is the free node's displacement, v that of the driven one, S is unsymmetric. The design is φ,
//! the only parameter is a, and X is the free node's reference position.

use crate::{
    Adjoint, Evaluated, Inputs, Iteration, LoadTime, Scales, Span, StateError, StepProblem, StepState, Unknowns, Wanted,
};
use slipstick_linalg::{BlockMatrix, BlockPattern};
use std::sync::Arc;

pub const DIRECTION: [f64; 3] = [1.0, -0.5, 0.25];
const COUPLING: [[f64; 3]; 3] = [[0.0, 0.3, -0.2], [0.1, 0.0, 0.4], [-0.5, 0.2, 0.0]];

pub struct Spring {
    /// φ
    pub stiffness: [f64; 3],
    /// a
    pub amplitude: f64,
    /// κ
    pub cubic: f64,
    /// m
    pub memory: f64,
    /// X
    pub position: [f64; 3],
    /// Scale of S.
    pub coupling: f64,
    /// f(t) = load(t) (1, 1, 1).
    pub load: fn(f64) -> f64,
    /// A step in which u₁ moves farther is rejected.
    pub longest_step: f64,
    pub unknowns: Unknowns,
}

impl Default for Spring {
    fn default() -> Self {
        Self {
            stiffness: [1.3, 0.7, 2.1],
            amplitude: 0.8,
            cubic: 0.6,
            memory: 0.9,
            position: [0.0; 3],
            coupling: 1.0,
            load: |_| 0.0,
            longest_step: f64::INFINITY,
            unknowns: Unknowns {
                history: 3,
                parameters: 1,
                positions: 3,
                ..Unknowns::displacements(&[true, true, true, false, false, false], 3)
            },
        }
    }
}

impl Spring {
    /// A matrix for the tangent.
    pub fn workspace() -> BlockMatrix {
        BlockMatrix::new(Arc::new(BlockPattern::from_rows(&[vec![0, 1], vec![0, 1]])))
    }

    /// ∂F/∂y at `y`.
    pub fn tangent_at<'w>(&self, y: [f64; 6], matrix: &'w mut BlockMatrix) -> &'w BlockMatrix {
        let step = self.begin(&Self::rest(), &(), [0.0, 1.0].into(), matrix).unwrap();
        let at = self.evaluate(&step, &y, None, Iteration::default(), Wanted::Both, matrix).unwrap();
        self.tangent(&step, &at, matrix).unwrap()
    }

    /// A linear spring without a memory: u = φ/(φ + 1) v.
    pub fn linear() -> Self {
        Self { cubic: 0.0, memory: 0.0, coupling: 0.0, ..Self::default() }
    }

    pub fn rest() -> StepState {
        StepState { unknowns: vec![0.0; 6], history: vec![0.0; 3] }
    }

    /// 1 + X².
    fn of_ground(&self, c: usize) -> f64 {
        1.0 + self.position[c].powi(2)
    }

    /// ∂(spring force)_c/∂e_b.
    fn slope(&self, y: &[f64], c: usize, b: usize) -> f64 {
        let e = y[3 + c] - y[c];
        let own = if c == b { self.stiffness[c] * (1.0 + 3.0 * self.cubic * e * e) } else { 0.0 };
        own + self.coupling * COUPLING[c][b]
    }
}

impl StepProblem for Spring {
    type Geometry = ();
    /// The previous state, and the time at the end of the step.
    type Step = (StepState, f64);
    type State = ();
    type Workspace = BlockMatrix;

    fn unknowns(&self) -> &Unknowns {
        &self.unknowns
    }

    fn prescribe(&self, time: LoadTime, y: &mut [f64]) {
        for c in 0..3 {
            y[c] = self.amplitude * time.t * DIRECTION[c];
        }
    }

    fn load_factors(&self, time: LoadTime) -> Vec<f64> {
        vec![(self.load)(time.t)]
    }

    fn geometry(&self, _: &[f64], _: Wanted, _: &mut BlockMatrix) -> Result<(), StateError> {
        Ok(())
    }

    fn begin(&self, previous: &StepState, (): &(), span: Span, _: &mut BlockMatrix) -> Result<Self::Step, StateError> {
        Ok((previous.clone(), span.to))
    }

    fn evaluate(
        &self,
        (previous, time): &Self::Step,
        y: &[f64],
        _: Option<&()>,
        _: Iteration,
        _: Wanted,
        _: &mut BlockMatrix,
    ) -> Result<Evaluated<Self>, StateError> {
        let StepState { unknowns, history } = previous;
        let mut residual = vec![0.0; 6];
        for c in 0..3 {
            let e: [f64; 3] = std::array::from_fn(|b| y[3 + b] - y[b]);
            let coupled: f64 = (0..3).map(|b| COUPLING[c][b] * e[b]).sum();
            let spring = self.stiffness[c] * (e[c] + self.cubic * e[c].powi(3)) + self.coupling * coupled;
            residual[c] = -spring;
            residual[3 + c] =
                spring + self.of_ground(c) * y[3 + c] + self.memory * (history[c] - 0.2 * unknowns[3 + c])
                    - (self.load)(*time);
        }
        let scales = Scales { force: 1.0, displacement: 1.0, multiplier: 1.0, position: 1.0, rigidity: 0.0 };
        Ok(Evaluated { unknowns: y.to_vec(), residual, scales, active_set: Vec::new(), geometry: (), state: () })
    }

    fn tangent<'w>(
        &self,
        _: &Self::Step,
        at: &Evaluated<Self>,
        matrix: &'w mut BlockMatrix,
    ) -> Result<&'w BlockMatrix, StateError> {
        let spring: [f64; 9] = std::array::from_fn(|k| self.slope(&at.unknowns, k / 3, k % 3));
        let ground: [f64; 9] = std::array::from_fn(|k| if k % 4 == 0 { self.of_ground(k / 4) } else { 0.0 });
        matrix.set_zero();
        for (row, column, sign) in [(0, 0, 1.0), (0, 1, -1.0), (1, 0, -1.0), (1, 1, 1.0)] {
            matrix.add(row, column, &spring.map(|s| sign * s));
        }
        matrix.add(1, 1, &ground);
        Ok(matrix)
    }

    fn finish(&self, (previous, _): &Self::Step, at: &Evaluated<Self>) -> Result<Vec<f64>, StateError> {
        let (StepState { unknowns, history }, y) = (previous, &at.unknowns);
        let depth = (y[3] - unknowns[3]).abs();
        if depth > self.longest_step {
            return Err(StateError::PassedThrough { node: 1, depth, reach: self.longest_step });
        }
        Ok((0..3).map(|c| 0.5 * history[c] + 0.3 * y[3 + c].powi(2) + 0.1 * unknowns[3 + c]).collect())
    }

    fn pull_back(
        &self,
        (_, time): &Self::Step,
        at: &Evaluated<Self>,
        &Adjoint { lambda, eta, mu }: &Adjoint<'_>,
        into: &mut Inputs,
    ) -> Result<(), StateError> {
        let y = &at.unknowns;
        for c in 0..3 {
            let add = |to: &mut Vec<f64>, i: usize, value: &dyn Fn() -> f64| {
                if let Some(to) = to.get_mut(i) {
                    *to += value();
                }
            };
            add(&mut into.unknowns, 3 + c, &|| 0.6 * y[3 + c] * eta[c]);
            add(&mut into.previous, 3 + c, &|| -0.2 * self.memory * lambda[3 + c] + 0.1 * eta[c]);
            add(&mut into.history, c, &|| self.memory * lambda[3 + c] + 0.5 * eta[c]);
            let e = y[3 + c] - y[c];
            add(&mut into.density, c, &|| (lambda[3 + c] - lambda[c]) * (e + self.cubic * e.powi(3)));
            // v = a v(1)
            add(&mut into.parameters, 0, &|| time * DIRECTION[c] * mu[c]);
            add(&mut into.position, c, &|| 2.0 * self.position[c] * y[3 + c] * lambda[3 + c]);
        }
        Ok(())
    }
}

//! The smallest load path with all that a sweep meets, for tests: a driven node pulls a free one by a nonlinear spring.
//!
//! ```text
//! F = φ ∘ (e + κ e³) + S e + u + m (h_{n−1} − 0.2 u_{n−1}) − f(t),   e = u − v,   v = a t (1, −0.5, 0.25)
//! h = 0.5 h_{n−1} + 0.3 u² + 0.1 u_{n−1}
//! ```
//!
//! u is the free node's displacement, v that of the driven one, S has no symmetry. The design is φ, the one parameter a.

use crate::{PreviousPullBack, Scales, StateError, StepProblem, StepState};
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
    /// Of S.
    pub coupling: f64,
    /// f(t) = load(t) (1, 1, 1).
    pub load: fn(f64) -> f64,
    /// A step in which u₁ moves farther is not accepted.
    pub longest_step: f64,
    pub previous: StepState,
    pub matrix: BlockMatrix,
}

impl Default for Spring {
    fn default() -> Self {
        Self {
            stiffness: [1.3, 0.7, 2.1],
            amplitude: 0.8,
            cubic: 0.6,
            memory: 0.9,
            coupling: 1.0,
            load: |_| 0.0,
            longest_step: f64::INFINITY,
            previous: Self::rest(),
            matrix: BlockMatrix::new(Arc::new(BlockPattern::from_rows(&[vec![0, 1], vec![0, 1]]))),
        }
    }
}

impl Spring {
    /// A linear spring without a memory: u = φ/(φ + 1) v.
    pub fn linear() -> Self {
        Self { cubic: 0.0, memory: 0.0, coupling: 0.0, ..Self::default() }
    }

    pub fn rest() -> StepState {
        StepState { unknowns: vec![0.0; 6], history: vec![0.0; 3] }
    }

    /// ∂(spring force)_c/∂e_b.
    fn slope(&self, y: &[f64], c: usize, b: usize) -> f64 {
        let e = y[3 + c] - y[c];
        let own = if c == b { self.stiffness[c] * (1.0 + 3.0 * self.cubic * e * e) } else { 0.0 };
        own + self.coupling * COUPLING[c][b]
    }
}

impl StepProblem for Spring {
    fn unknowns(&self) -> usize {
        6
    }

    fn displacements(&self) -> usize {
        6
    }

    fn history_length(&self) -> usize {
        3
    }

    fn designs(&self) -> usize {
        3
    }

    fn fixed(&self) -> &[bool] {
        &[true, true, true, false, false, false]
    }

    fn groups(&self) -> &[u32] {
        &[0, 1]
    }

    fn prescribe(&self, time: f64, y: &mut [f64]) {
        for c in 0..3 {
            y[c] = self.amplitude * time * DIRECTION[c];
        }
    }

    fn load_factors(&self, time: f64) -> Vec<f64> {
        vec![(self.load)(time)]
    }

    fn begin_step(&mut self, previous: &StepState, time: f64, _: bool) -> Result<(), StateError> {
        self.previous = previous.clone();
        // the load belongs to the time of the step
        self.previous.history.push((self.load)(time));
        Ok(())
    }

    fn residual(&mut self, y: &[f64], out: &mut [f64]) -> Result<(), StateError> {
        let StepState { unknowns, history } = &self.previous;
        for c in 0..3 {
            let e: [f64; 3] = std::array::from_fn(|b| y[3 + b] - y[b]);
            let coupled: f64 = (0..3).map(|b| COUPLING[c][b] * e[b]).sum();
            let spring = self.stiffness[c] * (e[c] + self.cubic * e[c].powi(3)) + self.coupling * coupled;
            out[c] = -spring;
            out[3 + c] = spring + y[3 + c] + self.memory * (history[c] - 0.2 * unknowns[3 + c]) - history[3];
        }
        Ok(())
    }

    fn tangent(&mut self, y: &[f64]) -> Result<&BlockMatrix, StateError> {
        let spring: [f64; 9] = std::array::from_fn(|k| self.slope(y, k / 3, k % 3));
        let ground: [f64; 9] = std::array::from_fn(|k| f64::from(u8::from(k % 4 == 0)));
        self.matrix.set_zero();
        for (row, column, sign) in [(0, 0, 1.0), (0, 1, -1.0), (1, 0, -1.0), (1, 1, 1.0)] {
            self.matrix.add(row, column, &spring.map(|s| sign * s));
        }
        self.matrix.add(1, 1, &ground);
        Ok(&self.matrix)
    }

    fn scales(&self) -> Scales {
        Scales { force: 1.0, displacement: 1.0, multiplier: 1.0, position: 1.0 }
    }

    fn active_set(&self) -> &[u8] {
        &[]
    }

    fn accept(&mut self, y: &[f64]) -> Result<(), StateError> {
        let depth = (y[3] - self.previous.unknowns[3]).abs();
        if depth > self.longest_step {
            return Err(StateError::PassedThrough { node: 1, depth, reach: self.longest_step });
        }
        Ok(())
    }

    fn advance_history(&mut self, y: &[f64], out: &mut Vec<f64>) -> Result<(), StateError> {
        let StepState { unknowns, history } = &self.previous;
        *out = (0..3).map(|c| 0.5 * history[c] + 0.3 * y[3 + c].powi(2) + 0.1 * unknowns[3 + c]).collect();
        Ok(())
    }

    fn pull_back_current(&mut self, y: &[f64], eta: &[f64], out: &mut [f64]) -> Result<(), StateError> {
        for c in 0..3 {
            out[3 + c] += 0.6 * y[3 + c] * eta[c];
        }
        Ok(())
    }

    fn pull_back_previous(
        &mut self,
        _: &[f64],
        lambda: &[f64],
        eta: &[f64],
        out: &mut PreviousPullBack,
    ) -> Result<(), StateError> {
        out.unknowns = vec![0.0; 6];
        for c in 0..3 {
            out.unknowns[3 + c] = -0.2 * self.memory * lambda[3 + c] + 0.1 * eta[c];
        }
        out.history = (0..3).map(|c| self.memory * lambda[3 + c] + 0.5 * eta[c]).collect();
        Ok(())
    }

    fn pull_back_design(&mut self, y: &[f64], lambda: &[f64], out: &mut [f64]) -> Result<(), StateError> {
        for c in 0..3 {
            let e = y[3 + c] - y[c];
            out[c] += (lambda[3 + c] - lambda[c]) * (e + self.cubic * e.powi(3));
        }
        Ok(())
    }

    fn parameters(&self) -> usize {
        1
    }

    fn pull_back_parameters(
        &mut self,
        _: &[f64],
        time: f64,
        _: &[f64],
        _: &[f64],
        by_prescribed: &[f64],
        out: &mut [f64],
    ) -> Result<(), StateError> {
        out[0] += (0..3).map(|c| time * DIRECTION[c] * by_prescribed[c]).sum::<f64>();
        Ok(())
    }
}

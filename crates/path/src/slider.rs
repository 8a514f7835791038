//! A frictional slider: the smallest problem with contact, and an example for users with their own
//! problem.
//!
//! A spring of stiffness φ pulls a block along the ground. Its other end moves by a t along x, and
//! by −b along y, which presses the block down. The unknowns are the block's displacements u_x and
//! u_y; u_z is prescribed, because blocks of a matrix have three rows. The ground pushes back with
//! a penalty ε, and Coulomb friction acts with a return map:
//!
//! ```text
//! p = max(0, −ε u_y)        T = h_{n−1} + ε (u_x − u_{x,n−1}),  at most μ p in size        h_n = T
//! F_x = φ (u_x − a t) + T = 0        F_y = φ (u_y + b) − p = 0
//! ```
//!
//! [`Slider`] implements [`StepProblem`] for these equations. The march and the sweep need nothing
//! else: they provide the exact derivative of the last position with respect to the stiffness φ,
//! through stick and slip.
//!
//! ```
//! use slipstick_linalg::SolverChoice;
//! use slipstick_path::slider::{PositionAt, Slider};
//! use slipstick_path::{LinearSystem, LoadPath, MarchOptions, Silent, Solver, SweepOptions, march, sweep};
//!
//! let pulled = |stiffness: f64| -> Result<(f64, f64), Box<dyn std::error::Error>> {
//!     let slider = Slider::new(stiffness);
//!     let mut linear = LinearSystem::new(SolverChoice::Auto);
//!     let mut solver = Solver { problem: &slider, linear: &mut linear, workspace: &mut Slider::workspace() };
//!     let load_path = LoadPath::new(Slider::rest(), &[0.2, 0.4, 0.6, 0.8, 1.0]);
//!     let path = march(&mut solver, &load_path, &MarchOptions::default(), &mut Silent)?;
//!     let gradient = sweep(&mut solver, &path, &mut PositionAt { index: 5 }, &SweepOptions::default())?;
//!     Ok((path.states[5].state.unknowns[0], gradient[0].design[0]))
//! };
//! let (_, gradient) = pulled(2.0)?;
//! let difference = (pulled(2.0 + 1e-5)?.0 - pulled(2.0 - 1e-5)?.0) / 2e-5;
//! assert!((gradient - difference).abs() < 1e-7);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use crate::{
    Evaluated, Explicit, Iteration, Observed, PathResponses, PreviousPullBack, Scales, StateError, StepProblem,
    StepState, Unknowns, Wanted,
};
use slipstick_linalg::{BlockMatrix, BlockPattern};
use std::sync::Arc;

/// The problem; its numbers do not change along a path.
#[derive(Debug, Clone)]
pub struct Slider {
    /// φ of the spring, the design. \[F/L\]
    pub stiffness: f64,
    /// μ.
    pub friction: f64,
    /// ε of the ground. \[F/L\]
    pub penalty: f64,
    /// a and b: how far the spring is pulled at t = 1, and pressed down from the first step on.
    /// \[L\]
    pub pull: [f64; 2],
    unknowns: Unknowns,
}

/// The forces of the ground on the block, with derivatives.
#[derive(Debug, Clone, Copy)]
pub struct Ground {
    /// 0 open, 1 stick, 2 slip.
    pub status: u8,
    /// p and T. \[F\]
    pub force: [f64; 2],
    /// ∂p/∂u_y; ∂T/∂u_x, which is −∂T/∂u_{x,n−1}; ∂T/∂u_y; ∂T/∂h_{n−1}.
    slopes: [f64; 4],
}

/// A step: the state before it, and the time at its end.
#[derive(Debug, Clone)]
pub struct Pull {
    previous: StepState,
    time: f64,
}

impl Slider {
    /// With μ = 0.3, ε = 50, a = 1, b = 0.5.
    pub fn new(stiffness: f64) -> Self {
        let unknowns = Unknowns { history: 1, ..Unknowns::displacements(&[false, false, true], 1) };
        Self { stiffness, friction: 0.3, penalty: 50.0, pull: [1.0, 0.5], unknowns }
    }

    /// The state at time 0.
    pub fn rest() -> StepState {
        StepState { unknowns: vec![0.0; 3], history: vec![0.0] }
    }

    /// A matrix for the tangent.
    pub fn workspace() -> BlockMatrix {
        BlockMatrix::new(Arc::new(BlockPattern::from_rows(&[vec![0]])))
    }

    fn ground(&self, previous: &StepState, y: &[f64]) -> Ground {
        let pressure = -self.penalty * y[1];
        let trial = previous.history[0] + self.penalty * (y[0] - previous.unknowns[0]);
        let limit = self.friction * pressure;
        if pressure <= 0.0 {
            Ground { status: 0, force: [0.0; 2], slopes: [0.0; 4] }
        } else if trial.abs() <= limit {
            Ground { status: 1, force: [pressure, trial], slopes: [-self.penalty, self.penalty, 0.0, 1.0] }
        } else {
            let slope = -self.penalty * self.friction * trial.signum();
            let force = [pressure, limit * trial.signum()];
            Ground { status: 2, force, slopes: [-self.penalty, 0.0, slope, 0.0] }
        }
    }
}

impl StepProblem for Slider {
    // nothing worth keeping depends only on the displacements
    type Geometry = ();
    type Step = Pull;
    type State = Ground;
    type Workspace = BlockMatrix;

    fn unknowns(&self) -> &Unknowns {
        &self.unknowns
    }

    fn prescribe(&self, _: f64, y: &mut [f64]) {
        y[2] = 0.0;
    }

    fn load_factors(&self, time: f64) -> Vec<f64> {
        vec![time]
    }

    fn geometry(&self, _: &[f64], _: Wanted, _: &mut BlockMatrix) -> Result<(), StateError> {
        Ok(())
    }

    fn begin(
        &self,
        previous: &StepState,
        (): &(),
        [_, time]: [f64; 2],
        _: &mut BlockMatrix,
    ) -> Result<Pull, StateError> {
        Ok(Pull { previous: previous.clone(), time })
    }

    fn evaluate(
        &self,
        step: &Pull,
        y: &[f64],
        _: Option<&()>,
        _: Iteration,
        _: Wanted,
        _: &mut BlockMatrix,
    ) -> Result<Evaluated<Self>, StateError> {
        let ground = self.ground(&step.previous, y);
        let [pressure, friction] = ground.force;
        let spring = [y[0] - self.pull[0] * step.time, y[1] + self.pull[1]].map(|stretch| self.stiffness * stretch);
        Ok(Evaluated {
            unknowns: y.to_vec(),
            residual: vec![spring[0] + friction, spring[1] - pressure, 0.0],
            scales: Scales { force: 1.0, displacement: 1.0, multiplier: 1.0, position: 1.0 },
            active_set: vec![ground.status],
            geometry: (),
            state: ground,
        })
    }

    fn tangent<'w>(
        &self,
        _: &Pull,
        at: &Evaluated<Self>,
        matrix: &'w mut BlockMatrix,
    ) -> Result<&'w BlockMatrix, StateError> {
        let [p_y, t_x, t_y, _] = at.state.slopes;
        matrix.set_zero();
        matrix.add(0, 0, &[self.stiffness + t_x, t_y, 0.0, 0.0, self.stiffness - p_y, 0.0, 0.0, 0.0, 1.0]);
        Ok(matrix)
    }

    fn finish(&self, _: &Pull, at: &Evaluated<Self>) -> Result<Vec<f64>, StateError> {
        Ok(vec![at.state.force[1]])
    }

    fn pull_back_current(
        &self,
        _: &Pull,
        at: &Evaluated<Self>,
        eta: &[f64],
        out: &mut [f64],
    ) -> Result<(), StateError> {
        let [_, t_x, t_y, _] = at.state.slopes;
        out[0] += t_x * eta[0];
        out[1] += t_y * eta[0];
        Ok(())
    }

    fn pull_back_previous(&self, _: &Pull, at: &Evaluated<Self>, lambda: &[f64], eta: &[f64]) -> PreviousPullBack {
        let [_, t_x, _, t_h] = at.state.slopes;
        // T appears in F_x, and is the new history
        let by_friction = lambda[0] + eta[0];
        PreviousPullBack { unknowns: vec![-t_x * by_friction, 0.0, 0.0], history: vec![t_h * by_friction] }
    }

    fn pull_back_design(&self, at: &Evaluated<Self>, lambda: &[f64], out: &mut [f64]) -> Result<(), StateError> {
        // the spring's forces are φ times its stretch, and so is the residual without the ground's
        // forces
        let [pressure, friction] = at.state.force;
        let spring = [at.residual[0] - friction, at.residual[1] + pressure];
        out[0] += (lambda[0] * spring[0] + lambda[1] * spring[1]) / self.stiffness;
        Ok(())
    }
}

/// θ = u_x at the end of a step.
#[derive(Debug, Clone, Copy)]
pub struct PositionAt {
    /// Index of the state in the path.
    pub index: usize,
}

impl PathResponses<Slider> for PositionAt {
    fn count(&self) -> usize {
        1
    }

    fn observes(&self, _: usize, index: usize) -> bool {
        index == self.index
    }

    fn add_derivative(
        &mut self,
        _: usize,
        _: &Slider,
        _: &Observed<'_, Slider>,
        to: &mut Explicit<'_>,
    ) -> Result<(), StateError> {
        to.unknowns[0] += 1.0;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{LinearSystem, LoadPath, MarchOptions, Path, Silent, Solver, SweepOptions, march, sweep};
    use slipstick_linalg::SolverChoice;

    fn pulled(slider: &Slider, times: &[f64]) -> (Path, f64) {
        let mut linear = LinearSystem::new(SolverChoice::Auto);
        let mut solver = Solver { problem: slider, linear: &mut linear, workspace: &mut Slider::workspace() };
        let load_path = LoadPath::new(Slider::rest(), times);
        let path = march(&mut solver, &load_path, &MarchOptions::default(), &mut Silent).unwrap();
        let mut objective = PositionAt { index: path.states.len() - 1 };
        let gradient = sweep(&mut solver, &path, &mut objective, &SweepOptions::default()).unwrap();
        (path, gradient[0].design[0])
    }

    /// By hand: p = ε φ b/(ε + φ). The block sticks with u_x = φ a t/(φ + ε) until φ a t ε/(φ + ε)
    /// reaches μ p, then slides with u_x = a t − μ p/φ.
    #[test]
    fn it_sticks_and_slides() {
        let slider = Slider::new(2.0);
        let Slider { stiffness: k, friction, penalty: e, pull: [a, b], .. } = slider;
        let times = [0.05, 0.1, 0.3, 1.0];
        let (path, _) = pulled(&slider, &times);
        let limit = friction * e * k * b / (e + k);
        for (at, time) in path.states[1..].iter().zip(times) {
            let sticks = k * a * time * e / (k + e) <= limit;
            let exact = if sticks { k * a * time / (k + e) } else { a * time - limit / k };
            assert!((at.state.unknowns[0] - exact).abs() < 1e-12, "{time}: {:?} for {exact}", at.state.unknowns);
            assert_eq!(at.active_set, [if sticks { 1 } else { 2 }]);
        }
        assert_eq!(path.states.iter().skip(1).map(|s| s.active_set[0]).collect::<Vec<_>>(), [1, 1, 2, 2]);
    }

    /// Only stick, only slip, and a reversal from slip to stick to slip: compared with central
    /// differences.
    #[test]
    fn its_gradient_matches_differences() {
        for (pull, times) in
            [([0.1, 0.5], vec![0.5, 1.0]), ([1.0, 0.5], vec![0.3, 1.0]), ([-1.0, 0.5], vec![0.02, 0.04, 0.4, 0.7, 1.0])]
        {
            let of = |stiffness: f64| {
                let slider = Slider { pull, ..Slider::new(stiffness) };
                let (path, gradient) = pulled(&slider, &times);
                (path.states.last().unwrap().state.unknowns[0], gradient)
            };
            let (found, h) = (of(2.0).1, 1e-4);
            let difference = (of(2.0 + h).0 - of(2.0 - h).0) / (2.0 * h);
            assert!((found - difference).abs() < 1e-8, "{found} for {difference}");
        }
    }
}

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
//! [`Slider`] states these equations; [`Differentiated`](crate::equations::Differentiated) makes them
//! a [`StepProblem`](crate::StepProblem). The march and the sweep need nothing else: they provide
//! the exact derivative of the last position with respect to the stiffness φ, through stick and slip.
//!
//! ```
//! use slipstick_linalg::SolverChoice;
//! use slipstick_path::equations::{Differentiated, UnknownAt};
//! use slipstick_path::slider::Slider;
//! use slipstick_path::{LinearSystem, LoadPath, MarchOptions, Silent, Solver, SweepOptions, march, sweep};
//!
//! let pulled = |stiffness: f64| -> Result<(f64, f64), Box<dyn std::error::Error>> {
//!     let slider = Differentiated(Slider::new(stiffness));
//!     let mut linear = LinearSystem::new(SolverChoice::Auto);
//!     let mut solver = Solver { problem: &slider, linear: &mut linear, workspace: &mut slider.workspace() };
//!     let load_path = LoadPath::new(slider.rest(), &[0.2, 0.4, 0.6, 0.8, 1.0]);
//!     let path = march(&mut solver, &load_path, &MarchOptions::default(), &mut Silent)?;
//!     let mut position = UnknownAt { state: 5, unknown: 0 };
//!     let gradient = sweep(&mut solver, &path, &mut position, &SweepOptions::default())?;
//!     Ok((path.states[5].state.unknowns[0], gradient[0].design[0]))
//! };
//! let (_, gradient) = pulled(2.0)?;
//! let difference = (pulled(2.0 + 1e-5)?.0 - pulled(2.0 - 1e-5)?.0) / 2e-5;
//! assert!((gradient - difference).abs() < 1e-7);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use crate::equations::{Equations, Outputs};
use crate::{ContactStatus, Inputs, LoadTime, Span, Unknowns};
use num_dual::Dual64;

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

impl Slider {
    /// With μ = 0.3, ε = 50, a = 1, b = 0.5.
    pub fn new(stiffness: f64) -> Self {
        let unknowns = Unknowns { history: 1, ..Unknowns::displacements(&[false, false, true], 1) };
        Self { stiffness, friction: 0.3, penalty: 50.0, pull: [1.0, 0.5], unknowns }
    }
}

impl Equations for Slider {
    fn unknowns(&self) -> &Unknowns {
        &self.unknowns
    }

    fn design(&self) -> Vec<f64> {
        vec![self.stiffness]
    }

    fn load_factors(&self, time: LoadTime) -> Vec<f64> {
        vec![time.t] // the moving end of the spring loads the block
    }

    fn step(&self, span: Span, at: &Inputs<Dual64>) -> Outputs {
        let (u, zero) = (&at.unknowns, Dual64::from_re(0.0));
        let pressure = -u[1] * self.penalty;
        let trial = at.history[0] + (u[0] - at.previous[0]) * self.penalty;
        let limit = pressure * self.friction;
        let (status, pressure, friction) = if pressure.re <= 0.0 {
            (ContactStatus::Inactive, zero, zero)
        } else if trial.re.abs() <= limit.re {
            (ContactStatus::Stick, pressure, trial)
        } else {
            (ContactStatus::Slip, pressure, limit * trial.re.signum())
        };
        let pulled = at.density[0] * (u[0] - self.pull[0] * span.to);
        let pressed = at.density[0] * (u[1] + self.pull[1]);
        Outputs {
            residual: vec![pulled + friction, pressed - pressure, u[2]],
            history: vec![friction],
            status: vec![status],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::equations::{Differentiated, UnknownAt};
    use crate::{LinearSystem, LoadPath, MarchOptions, Path, Silent, Solver, SweepOptions, march, sweep};
    use slipstick_linalg::SolverChoice;

    fn pulled(slider: &Slider, times: &[f64]) -> (Path, f64) {
        let slider = Differentiated(slider.clone());
        let mut linear = LinearSystem::new(SolverChoice::Auto);
        let mut solver = Solver { problem: &slider, linear: &mut linear, workspace: &mut slider.workspace() };
        let load_path = LoadPath::new(slider.rest(), times);
        let path = march(&mut solver, &load_path, &MarchOptions::default(), &mut Silent).unwrap();
        let mut objective = UnknownAt { state: path.states.len() - 1, unknown: 0 };
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
            assert_eq!(at.active_set, [if sticks { ContactStatus::Stick } else { ContactStatus::Slip }]);
        }
        assert_eq!(path.states.iter().skip(1).map(|s| s.active_set[0].code()).collect::<Vec<_>>(), [1, 1, 2, 2]);
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

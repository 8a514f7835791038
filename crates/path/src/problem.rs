//! What a load step has to offer so that it can be marched and differentiated.

use crate::failure::StateError;
use slipstick_linalg::BlockMatrix;

/// State at the end of a (sub-)step.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StepState {
    /// y: displacements (3 per node), then multipliers where the method has them (3 per slave node).
    pub unknowns: Vec<f64>,
    /// h: explicit, node-local history; empty where the method has none.
    pub history: Vec<f64>,
}

/// Sizes against which relative tolerances are measured; all positive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scales {
    /// Norm of the forces that balance. \[F\]
    pub force: f64,
    /// Norm of the displacements. \[L\]
    pub displacement: f64,
    /// Norm of the multipliers. \[F/L²\]
    pub multiplier: f64,
    /// Norm of the positions x = X + d, whose rounding no iteration can undercut. \[L\]
    pub position: f64,
}

/// Transposed derivatives with respect to the previous state.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PreviousPullBack {
    /// (∂F_n/∂y_{n−1})ᵀ λ + (∂G_n/∂y_{n−1})ᵀ η.
    pub unknowns: Vec<f64>,
    /// (∂F_n/∂h_{n−1})ᵀ λ + (∂G_n/∂h_{n−1})ᵀ η.
    pub history: Vec<f64>,
}

/// Which multipliers an inner solve holds fixed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Held {
    /// None: displacements and multipliers are solved for together.
    #[default]
    None,
    /// Those that Uzawa's iteration updates: of the augmented Lagrangian.
    Augmented,
    /// All, also those of the Lagrange method, while a step is [rescued](StepProblem::rescue).
    All,
}

/// How far Uzawa's iteration goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UzawaOptions {
    /// Largest violation of the contact conditions that is left, in the measure of
    /// [`StepProblem::update_multipliers`].
    pub tolerance: f64,
    /// Most iterations in a step.
    pub max_iterations: usize,
    /// Updates that the acceleration remembers; 0 is the plain iteration, without second-order updates.
    pub memory: usize,
}

/// The equations of a load step. One implementation serves the march, the adjoint and every check of both.
///
/// The previous state is set once by [`begin_step`](Self::begin_step); all other calls refer to it. Every derivative is
/// exact for the equations that hold **at convergence**, whatever algorithm reached them.
pub trait StepProblem {
    /// Number of unknowns, 3 × block rows.
    fn unknowns(&self) -> usize;

    /// Number of displacement unknowns; they come first.
    fn displacements(&self) -> usize;

    /// Length of the history.
    fn history_length(&self) -> usize;

    /// Length of the design gradient.
    fn designs(&self) -> usize;

    /// Which unknowns are prescribed (or held, during Uzawa's inner iteration).
    fn fixed(&self) -> &[bool];

    /// Elimination group of every block row, see [`slipstick_linalg::Reduction`].
    fn groups(&self) -> &[u32];

    /// Writes the prescribed displacements of pseudo-time `time` into `y`.
    fn prescribe(&self, time: f64, y: &mut [f64]);

    /// Factors of the external forces at pseudo-time `time`; none where there are no such forces.
    fn load_factors(&self, time: f64) -> Vec<f64> {
        let _ = time;
        Vec::new()
    }

    /// Sets the previous state (and what follows from it) and the pseudo-time at the end of the step; `for_adjoint` prepares
    /// the pull-backs too.
    ///
    /// # Errors
    /// If the previous state cannot be evaluated.
    fn begin_step(&mut self, previous: &StepState, time: f64, for_adjoint: bool) -> Result<(), StateError>;

    /// F(y).
    ///
    /// # Errors
    /// If `y` is no state.
    fn residual(&mut self, y: &[f64], out: &mut [f64]) -> Result<(), StateError>;

    /// ∂F/∂y at `y`, including rows and columns of prescribed unknowns.
    ///
    /// # Errors
    /// If `y` is no state.
    fn tangent(&mut self, y: &[f64]) -> Result<&BlockMatrix, StateError>;

    /// Tells whether [`tangent`](Self::tangent) will probably be asked for where [`residual`](Self::residual) is evaluated
    /// next: what both need can then be computed at once.
    fn foresee_tangent(&mut self, likely: bool) {
        let _ = likely;
    }

    /// Sizes for relative tolerances, at the state of the last [`residual`](Self::residual).
    fn scales(&self) -> Scales;

    /// Status of every contact node (0 open, 1 stick, 2 slip) at the last [`residual`](Self::residual).
    fn active_set(&self) -> &[u8];

    /// Asked once for a converged state, before it is accepted: whether the step to it was small enough for the equations
    /// to have seen everything on the way.
    ///
    /// # Errors
    /// If it was not; the increment is then cut back.
    fn accept(&mut self, y: &[f64]) -> Result<(), StateError> {
        let _ = y;
        Ok(())
    }

    /// h = G(y).
    ///
    /// # Errors
    /// If `y` is no state.
    fn advance_history(&mut self, y: &[f64], out: &mut Vec<f64>) -> Result<(), StateError>;

    /// Adds (∂G/∂y)ᵀ η.
    ///
    /// # Errors
    /// If `y` is no state.
    fn pull_back_current(&mut self, y: &[f64], eta: &[f64], out: &mut [f64]) -> Result<(), StateError>;

    /// Transposed derivatives of F and G with respect to the previous unknowns and history.
    ///
    /// # Errors
    /// If `y` is no state.
    fn pull_back_previous(
        &mut self,
        y: &[f64],
        lambda: &[f64],
        eta: &[f64],
        out: &mut PreviousPullBack,
    ) -> Result<(), StateError>;

    /// Adds (∂F/∂φ)ᵀ λ.
    ///
    /// # Errors
    /// If `y` is no state.
    fn pull_back_design(&mut self, y: &[f64], lambda: &[f64], out: &mut [f64]) -> Result<(), StateError>;

    /// Number of parameters p beside the design that the path can be differentiated by: coefficients of friction, moduli,
    /// amplitudes of prescribed motions and loads.
    fn parameters(&self) -> usize {
        0
    }

    /// Adds (∂F/∂p)ᵀ λ + (∂G/∂p)ᵀ η + (∂ŷ/∂p)ᵀ μ at pseudo-time `time`, with ŷ the prescribed unknowns and μ what θ changes by
    /// with them, `by_prescribed`: an entry per unknown, of which the prescribed ones count.
    ///
    /// # Errors
    /// If `y` is no state.
    fn pull_back_parameters(
        &mut self,
        y: &[f64],
        time: f64,
        lambda: &[f64],
        eta: &[f64],
        by_prescribed: &[f64],
        out: &mut [f64],
    ) -> Result<(), StateError> {
        let _ = (y, time, lambda, eta, by_prescribed, out);
        Ok(())
    }

    /// Offers another setting of parameters that change the iteration but not its solution, for retry number
    /// `attempt` ≥ 1; `false` if there is none. `attempt` = 0 restores the default.
    fn vary_iteration(&mut self, attempt: usize) -> bool {
        attempt == 0
    }

    /// Uzawa's iteration, if the method solves its steps by it.
    fn uzawa(&self) -> Option<UzawaOptions> {
        None
    }

    /// Offers Uzawa's iteration over all multipliers, for a step at which Newton's method fails, and prepares attempt number
    /// `attempt` ≥ 0 of it; `None` if there is none. [`vary_iteration`](Self::vary_iteration) ends it.
    fn rescue(&mut self, attempt: usize) -> Option<UzawaOptions> {
        let _ = attempt;
        None
    }

    /// Holds multipliers in `y` fixed and uses the augmented traction around them, or ends that.
    fn hold_multipliers(&mut self, held: Held) {
        let _ = held;
    }

    /// Replaces the multipliers that Uzawa's iteration updates, of `y`, by the augmented traction at its displacements; returns the largest violation of
    /// the contact conditions before the update, relative so that it is unit-free (or as the method's option says).
    ///
    /// # Errors
    /// If `y` is no state.
    fn update_multipliers(&mut self, y: &mut [f64]) -> Result<f64, StateError> {
        let _ = y;
        Ok(0.0)
    }
}

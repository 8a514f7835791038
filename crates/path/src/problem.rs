//! The interface of a load step that can be marched and differentiated.

use crate::failure::StateError;
use crate::inputs::Inputs;
use crate::time::{LoadTime, Span};
use crate::unknowns::{Held, StepState, Unknowns};
use slipstick_linalg::BlockMatrix;

/// Sizes against which relative tolerances are measured; all positive, except possibly the last.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scales {
    /// Norm of the forces in equilibrium. \[F\]
    pub force: f64,
    /// Norm of the displacements. \[L\]
    pub displacement: f64,
    /// Norm of the multipliers. \[F/L²\]
    pub multiplier: f64,
    /// Norm of the positions x = X + d, whose round-off limits every iteration. \[L\]
    pub position: f64,
    /// Force that a displacement by the positions themselves would cause, whose round-off remains in
    /// the residual even without stress; 0 if it is not known. \[F\]
    pub rigidity: f64,
}

/// When Uzawa's iteration stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UzawaOptions {
    /// Largest violation of the contact conditions that is accepted, in the measure of
    /// [`StepProblem::update_multipliers`].
    pub tolerance: f64,
    /// Maximum number of iterations in a step.
    pub max_iterations: usize,
    /// Number of updates that the acceleration uses; 0 is the plain iteration, without second-order
    /// updates.
    pub memory: usize,
}

/// A way to iterate to a state; all have the same solutions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Attempt {
    /// With the problem's own settings (0), or with others after those have failed.
    Setting(usize),
    /// By Newton's method with the traction of a penalty around the held multipliers, which grows with
    /// this number, from the result of the stage before. Newton's method with the problem's own settings
    /// continues from the last stage.
    Penalty(usize),
    /// By Uzawa's iteration over all multipliers, with its settings of this number, if Newton's
    /// method fails. Newton's method then continues from its result.
    Rescue(usize),
}

/// The method that solves a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// Newton's method.
    Newton,
    /// Uzawa's iteration around Newton's method.
    Uzawa(UzawaOptions),
}

/// The stage of the iteration at which an evaluation takes place. It affects the iteration, not its
/// solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Iteration {
    /// The way to iterate.
    pub attempt: Attempt,
    /// The multipliers that are held fixed.
    pub held: Held,
    /// Whether this is the beginning of the iteration, at the state where the step starts.
    pub at_start: bool,
}

impl Default for Iteration {
    fn default() -> Self {
        Self { attempt: Attempt::Setting(0), held: Held::None, at_start: false }
    }
}

/// The results that an evaluation must provide.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wanted {
    /// The residual.
    Residual,
    /// Tangent and pull-backs: the residual stays empty.
    Derivatives,
    /// Both.
    Both,
}

impl Wanted {
    /// Whether the residual is required.
    pub fn residual(self) -> bool {
        self != Self::Derivatives
    }

    /// Whether derivatives are required.
    pub fn derivatives(self) -> bool {
        self != Self::Residual
    }
}

/// The equations of a step at unknowns y. It never changes: other unknowns require another
/// evaluation.
#[derive(Debug, Clone)]
pub struct Evaluated<P: StepProblem> {
    /// y.
    pub unknowns: Vec<f64>,
    /// F(y), if it was [wanted](Wanted): forces, then contact conditions. \[F, F/L²\]
    pub residual: Vec<f64>,
    /// Sizes for relative tolerances, with the residual.
    pub scales: Scales,
    /// Status of every contact node (0 open, 1 stick, 2 slip).
    pub active_set: Vec<u8>,
    /// Geometry of the displacements.
    pub geometry: P::Geometry,
    /// Further data of the problem.
    pub state: P::State,
}

/// Free motions that a step [holds](HoldFreeMotions).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HeldMotions {
    /// Those that are free at the end of the step, in words.
    pub free: Vec<String>,
    /// Norm of the forces that hold them, relative to the forces in equilibrium.
    pub share: f64,
    /// Work that these forces take in the step. \[F L\]
    pub work: f64,
}

/// The equations of a load step. One implementation is used by the march, the adjoint and every
/// check of both.
///
/// A problem does not change while a path is marched. A step is a value: [`begin`](Self::begin)
/// creates it from the previous state, [`evaluate`](Self::evaluate) creates an [`Evaluated`] from a
/// step and unknowns y, and everything else is computed from these two. Reusable buffers are in a
/// workspace that the caller provides.
///
/// Every derivative is exact for the equations that hold **at convergence**, whatever algorithm
/// reached them.
///
/// [`equations`](crate::equations) implements it for small problems that are given by their equations
/// alone, such as the [`slider`](crate::slider).
pub trait StepProblem: Sized + 'static {
    /// Data that depend only on the displacements, with or without their derivatives, such as a
    /// mesh's contact kinematics. The march passes them from the end of a step to the beginning of
    /// the next, the sweep from the beginning of a step to the end of the previous one. Cloning
    /// them should be cheap.
    type Geometry: Clone;
    /// The fixed data of a step: previous state, pseudo-time.
    type Step;
    /// The data that an evaluation keeps for its derivatives.
    type State;
    /// Buffers.
    type Workspace;

    /// Numbers of unknowns and inputs, and which unknowns are prescribed.
    fn unknowns(&self) -> &Unknowns;

    /// Writes the prescribed displacements of this time into `y`.
    fn prescribe(&self, time: LoadTime, y: &mut [f64]);

    /// Factors of the external forces at this time; empty if there are no such forces.
    fn load_factors(&self, time: LoadTime) -> Vec<f64> {
        let _ = time;
        Vec::new()
    }

    /// Geometry of the displacements in `y`, with the data that `wanted` requires.
    ///
    /// # Errors
    /// If the equations have no value at `y`.
    fn geometry(
        &self,
        y: &[f64],
        wanted: Wanted,
        workspace: &mut Self::Workspace,
    ) -> Result<Self::Geometry, StateError>;

    /// The step from the previous state, whose geometry is given; for the adjoint, with derivatives.
    /// `span`: when it starts and ends, and how long it takes.
    ///
    /// # Errors
    /// If no step can begin there.
    fn begin(
        &self,
        previous: &StepState,
        geometry: &Self::Geometry,
        span: Span,
        workspace: &mut Self::Workspace,
    ) -> Result<Self::Step, StateError>;

    /// The equations at `y`; `geometry` is that of its displacements, if the caller has it.
    ///
    /// # Errors
    /// If the equations have no value at `y`.
    fn evaluate(
        &self,
        step: &Self::Step,
        y: &[f64],
        geometry: Option<&Self::Geometry>,
        iteration: Iteration,
        wanted: Wanted,
        workspace: &mut Self::Workspace,
    ) -> Result<Evaluated<Self>, StateError>;

    /// ∂F/∂y, including rows and columns of prescribed unknowns, if derivatives were wanted.
    ///
    /// # Errors
    /// If the equations have no value at `y`.
    fn tangent<'w>(
        &self,
        step: &Self::Step,
        at: &Evaluated<Self>,
        workspace: &'w mut Self::Workspace,
    ) -> Result<&'w BlockMatrix, StateError>;

    /// The unknowns that follow from others, if there are any.
    fn dependent(&self) -> Option<&dyn DependentUnknowns> {
        None
    }

    /// How motions that nothing restrains are held, if there may be any.
    fn free_motions(&self) -> Option<&dyn HoldFreeMotions<Self>> {
        None
    }

    /// h = G(y) of a converged state, before it is accepted.
    ///
    /// # Errors
    /// If the step was so large that the equations may have missed something on the way. The
    /// increment is then cut back.
    fn finish(&self, step: &Self::Step, at: &Evaluated<Self>) -> Result<Vec<f64>, StateError>;

    /// Adds (∂F/∂x)ᵀ λ + (∂G/∂x)ᵀ η + (∂ŷ/∂x)ᵀ μ for every input x of which `into` has a list; an
    /// empty list is not wanted. ŷ are the prescribed unknowns.
    ///
    /// For y_n, it adds only (∂G/∂y_n)ᵀ η: ∂F/∂y_n is the [tangent](Self::tangent).
    ///
    /// # Errors
    /// If the equations have no value at `y`, or ranks disagree.
    fn pull_back(
        &self,
        step: &Self::Step,
        at: &Evaluated<Self>,
        adjoint: &Adjoint<'_>,
        into: &mut Inputs,
    ) -> Result<(), StateError>;

    /// The method that solves a step in attempt `attempt`; `None` if there is no such attempt.
    fn method(&self, attempt: Attempt) -> Option<Method> {
        (attempt == Attempt::Setting(0)).then_some(Method::Newton)
    }

    /// y with the multipliers that Uzawa's iteration updates replaced by the augmented traction,
    /// and the largest violation of the contact conditions before the update: dimensionless, or in
    /// the measure of the method's option.
    ///
    /// # Errors
    /// If ranks disagree.
    fn update_multipliers(&self, step: &Self::Step, at: &Evaluated<Self>) -> Result<(Vec<f64>, f64), StateError> {
        let _ = step;
        Ok((at.unknowns.clone(), 0.0))
    }
}

/// Unknowns that follow from others, such as the positions of a rigid body's nodes, with
/// T = ∂y/∂(independent unknowns).
///
/// They count as prescribed. They follow from the others in every [evaluation](Evaluated::unknowns), and
/// have no column in the tangent.
pub trait DependentUnknowns {
    /// Replaces derivatives with respect to dependent unknowns by derivatives with respect to those on
    /// which they depend: ∂/∂y ↦ Tᵀ ∂/∂y, at y.
    fn gather(&self, y: &[f64], derivative: &mut [f64]);

    /// Adds T λ to the entries of dependent unknowns.
    fn spread(&self, y: &[f64], lambda: &mut [f64]);
}

/// Motions that may be free, such as rigid motions of a body without supports and contact.
pub trait HoldFreeMotions<P: StepProblem> {
    /// Adds to a step that free motions remain as they are in the previous state; the equations of all
    /// other motions stay the same. Without `hold`, it removes that again.
    fn hold(&self, step: &mut P::Step, previous: &StepState, hold: bool);

    /// Whether a motion is free at a state of a step, or nearly free.
    fn are_free(&self, step: &P::Step, at: &Evaluated<P>, nearly: bool) -> bool;

    /// In a step that holds free motions, y with loaded bodies moved up to their first contact; `None`
    /// if nothing can be moved. It is a better initial guess.
    ///
    /// # Errors
    /// If the equations have no value at `y`.
    fn approach(&self, step: &P::Step, y: &[f64], workspace: &mut P::Workspace)
    -> Result<Option<Vec<f64>>, StateError>;

    /// The motions that are free at a state of a step that holds them, and what holds them.
    fn left_free(&self, step: &P::Step, at: &Evaluated<P>) -> HeldMotions;
}

/// Adjoint variables of a step.
#[derive(Debug, Clone, Copy, Default)]
pub struct Adjoint<'a> {
    /// λ of the equations, zero at prescribed unknowns unless a response observes their residual.
    pub lambda: &'a [f64],
    /// η of the history.
    pub eta: &'a [f64],
    /// μ = dθ/dŷ: one entry per unknown, of which only the prescribed ones count. Only derivatives with
    /// respect to parameters and positions need it.
    pub mu: &'a [f64],
}

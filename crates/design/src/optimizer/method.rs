//! The methods to choose from.

use serde::{Deserialize, Serialize};
use slipstick_ranks::Ranks;

use super::{Functions, Gcmma, Judgement, Mma, MmaError, MmaParameters, MmaStep};

/// Which optimizer chooses the next design.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Method {
    /// [`Mma`]: one evaluation of all functions per iteration.
    #[default]
    Mma,
    /// [`Gcmma`]: further evaluations until the approximations are conservative.
    Gcmma {
        /// Maximum number of inner iterations per iteration.
        inner_iterations: usize,
    },
    /// MMA that turns to GCMMA for some iterations when a step goes too far: [`Gcmma::guarded`].
    Guarded {
        /// Maximum number of repetitions per iteration.
        inner_iterations: usize,
    },
}

impl Method {
    /// Default maximum number of inner iterations of [`Method::Gcmma`]. Each raises ρ at most
    /// tenfold, so ρ, which starts at a tenth of the mean slope, can end far above it.
    pub const INNER_ITERATIONS: usize = 10;

    /// Maximum number of repetitions of a step of [`Method::Guarded`].
    pub const REPETITIONS: usize = 5;
}

/// An optimizer of either method, with its memory.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Optimizer {
    /// Accepts every design.
    Mma(Mma),
    /// Accepts a design if the approximations that led to it are conservative.
    Gcmma(Gcmma),
    /// Accepts a design that is not judged; otherwise as GCMMA.
    Guarded(Gcmma),
}

impl Optimizer {
    /// An optimizer without history for `n` variables and `m` constraints.
    pub fn new(method: Method, n: usize, m: usize, parameters: MmaParameters) -> Self {
        match method {
            Method::Mma => Self::Mma(Mma::new(n, m, parameters)),
            Method::Gcmma { inner_iterations } => Self::Gcmma(Gcmma::new(n, m, parameters, inner_iterations)),
            Method::Guarded { inner_iterations } => Self::Guarded(Gcmma::guarded(n, m, parameters, inner_iterations)),
        }
    }

    /// Name of the method, as in a case file.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Mma(_) => "mma",
            Self::Gcmma(_) => "gcmma",
            Self::Guarded(_) => "guarded",
        }
    }

    /// Designs and asymptotes of earlier iterations, and the parameters.
    pub fn memory(&self) -> &Mma {
        match self {
            Self::Mma(mma) => mma,
            Self::Gcmma(gcmma) | Self::Guarded(gcmma) => gcmma.memory(),
        }
    }

    fn memory_mut(&mut self) -> &mut Mma {
        match self {
            Self::Mma(mma) => mma,
            Self::Gcmma(gcmma) | Self::Guarded(gcmma) => gcmma.memory_mut(),
        }
    }

    /// Whether it is MMA with a guard.
    pub fn is_guarded(&self) -> bool {
        matches!(self, Self::Guarded(_))
    }

    /// Whether a step need not be [judged](Self::judge) if it does not go too far.
    pub fn is_lenient(&self) -> bool {
        matches!(self, Self::Guarded(gcmma) if !gcmma.is_strict())
    }

    /// Forgets earlier designs and asymptotes: see [`Mma::restart`]. Call it only before
    /// [`update`](Self::update).
    pub fn restart(&mut self) {
        self.memory_mut().restart();
    }

    /// Sets the largest change of a variable from the next step on: see [`Mma::set_move_limit`].
    pub fn set_move_limit(&mut self, move_limit: f64) {
        self.memory_mut().set_move_limit(move_limit);
    }

    /// Inner iterations since the last [`update`](Self::update); 0 for MMA.
    pub fn inner_iterations(&self) -> usize {
        match self {
            Self::Mma(_) => 0,
            Self::Gcmma(gcmma) | Self::Guarded(gcmma) => gcmma.inner_iterations(),
        }
    }

    /// Checks a history that was read back: that it is complete and belongs to `n` variables and
    /// `m` constraints.
    ///
    /// # Errors
    ///
    /// Those of [`Mma::check`] and [`Gcmma::check`].
    pub fn check(&self, n: usize, m: usize) -> Result<(), MmaError> {
        match self {
            Self::Mma(mma) => mma.check(n, m),
            Self::Gcmma(gcmma) | Self::Guarded(gcmma) => gcmma.check(n, m),
        }
    }

    /// Computes the next design: see [`Mma::update_on`] and [`Gcmma::update`].
    ///
    /// # Errors
    ///
    /// Those of [`Mma::update`].
    pub fn update(
        &mut self,
        x: &[f64],
        bounds: [&[f64]; 2],
        functions: &Functions<'_>,
        ranks: &dyn Ranks,
    ) -> Result<MmaStep, MmaError> {
        match self {
            Self::Mma(mma) => mma.update_on(x, bounds, functions, ranks),
            Self::Gcmma(gcmma) | Self::Guarded(gcmma) => gcmma.update(x, bounds, functions, ranks),
        }
    }

    /// Accepts the design `x` with these values of objective and constraints, or returns another
    /// one: see [`Gcmma::judge`]. MMA accepts every design.
    ///
    /// # Errors
    ///
    /// Those of [`Gcmma::judge`].
    pub fn judge(
        &mut self,
        x: &[f64],
        bounds: [&[f64]; 2],
        objective: f64,
        constraints: &[f64],
        ranks: &dyn Ranks,
    ) -> Result<Judgement, MmaError> {
        match self {
            Self::Mma(_) => Ok(Judgement::Conservative),
            Self::Gcmma(gcmma) | Self::Guarded(gcmma) => gcmma.judge(x, bounds, objective, constraints, ranks),
        }
    }
}

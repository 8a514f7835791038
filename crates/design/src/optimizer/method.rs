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
}

impl Method {
    /// Default maximum number of inner iterations of [`Method::Gcmma`]. Each raises ρ at most
    /// tenfold, so ρ, which starts at a tenth of the mean slope, can end far above it.
    pub const INNER_ITERATIONS: usize = 10;
}

/// An optimizer of either method, with its memory.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Optimizer {
    /// Accepts every design.
    Mma(Mma),
    /// Accepts a design if the approximations that led to it are conservative.
    Gcmma(Gcmma),
}

impl Optimizer {
    /// An optimizer without history for `n` variables and `m` constraints.
    pub fn new(method: Method, n: usize, m: usize, parameters: MmaParameters) -> Self {
        match method {
            Method::Mma => Self::Mma(Mma::new(n, m, parameters)),
            Method::Gcmma { inner_iterations } => Self::Gcmma(Gcmma::new(n, m, parameters, inner_iterations)),
        }
    }

    /// Name of the method, as in a case file.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Mma(_) => "mma",
            Self::Gcmma(_) => "gcmma",
        }
    }

    /// Designs and asymptotes of earlier iterations, and the parameters.
    pub fn memory(&self) -> &Mma {
        match self {
            Self::Mma(mma) => mma,
            Self::Gcmma(gcmma) => gcmma.memory(),
        }
    }

    /// Inner iterations since the last [`update`](Self::update); 0 for MMA.
    pub fn inner_iterations(&self) -> usize {
        match self {
            Self::Mma(_) => 0,
            Self::Gcmma(gcmma) => gcmma.inner_iterations(),
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
            Self::Gcmma(gcmma) => gcmma.check(n, m),
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
            Self::Gcmma(gcmma) => gcmma.update(x, bounds, functions, ranks),
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
            Self::Gcmma(gcmma) => gcmma.judge(x, bounds, objective, constraints, ranks),
        }
    }
}

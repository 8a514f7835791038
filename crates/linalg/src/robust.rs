//! A solver that falls back to a more robust method when one fails.

use crate::csr::{CsrMatrix, CsrPattern};
use crate::layout::Layout;
use crate::multifrontal::MultifrontalSolver;
use crate::operator::Operator;
use crate::ranks::{Alone, Ranks};
use crate::solver::{Backend, Factorization, FactorizationError, LinearSolver, Precision};
use crate::supernodal::SupernodalSolver;
use crate::verified::{SolveOptions, solve_weighted};
use std::sync::Arc;

/// Relative residual that factors must reach on a test vector, with the help of GMRES. A singular
/// matrix cannot reach it, for the vector has a part of about 1/√n outside of its range.
const TEST_TOLERANCE: f64 = 1e-4;

/// Pivots of the scaled matrix that, together with a failed test, mean that it is singular rather
/// than that the method is too weak. Rounding leaves up to about 1e-13 in place of a zero.
const SINGULAR_PIVOT: f64 = 1e-11;

/// Iterations granted to that test. Single precision needs two to six on hard problems.
const TEST_ITERATIONS: usize = 12;

/// Unknowns above which faer is not tried as a fallback: it would need more than 12 GB.
const LARGEST_FALLBACK: usize = 120_000;

/// Which direct solver to use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SolverChoice {
    /// Multifrontal in single precision, then in double, then faer.
    #[default]
    Auto,
    /// Multifrontal in the given precision; single precision falls back to double, then to faer.
    Multifrontal {
        /// Number format of the factors.
        precision: Precision,
    },
    /// faer's supernodal LU only.
    Faer,
}

/// Facade over the solvers: tries them in turn until factors pass a test solve.
///
/// The chain is multifrontal in single precision (unless double is chosen), multifrontal in double precision, faer
/// (up to 120 000 unknowns). A matrix that double precision finds singular is reported at once.
#[derive(Debug)]
pub struct RobustSolver {
    choice: SolverChoice,
    multifrontal: MultifrontalSolver,
    supernodal: SupernodalSolver,
    used: Option<Method>,
}

/// A link of the chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Method {
    Multifrontal(Precision),
    Supernodal,
}

impl Method {
    fn name(self) -> &'static str {
        match self {
            Self::Multifrontal(Precision::F64) => "multifrontal LU in double precision",
            Self::Multifrontal(Precision::F32) => "multifrontal LU in single precision",
            Self::Supernodal => "supernodal LU",
        }
    }
}

impl RobustSolver {
    /// A solver of the given kind, without an analysis yet.
    pub fn new(choice: SolverChoice) -> Self {
        Self {
            choice,
            multifrontal: MultifrontalSolver::new(Precision::F64),
            supernodal: SupernodalSolver::new(),
            used: None,
        }
    }

    /// Name of the method behind the latest successful factorization.
    pub fn used(&self) -> Option<&'static str> {
        self.used.map(Method::name)
    }

    /// Drops what is kept of earlier patterns, so that what follows does not depend on them.
    pub fn forget(&mut self) {
        self.multifrontal.forget();
    }

    fn chain(&self, n: usize) -> Vec<Method> {
        use Method::{Multifrontal, Supernodal};
        let mut chain = match self.choice {
            SolverChoice::Faer => return vec![Supernodal],
            SolverChoice::Auto | SolverChoice::Multifrontal { precision: Precision::F32 } => {
                vec![Multifrontal(Precision::F32), Multifrontal(Precision::F64)]
            }
            SolverChoice::Multifrontal { precision: Precision::F64 } => vec![Multifrontal(Precision::F64)],
        };
        if n <= LARGEST_FALLBACK {
            chain.push(Supernodal);
        }
        chain
    }

    fn attempt(&mut self, method: Method, a: &CsrMatrix) -> Result<Box<dyn Factorization>, FactorizationError> {
        let factors: Box<dyn Factorization> = match method {
            Method::Multifrontal(precision) => {
                self.multifrontal.set_precision(precision);
                let factors = self.multifrontal.factorize_matrix(a)?;
                let facts = factors.statistics();
                test_on(a, factors.row_scaling(), &factors, false, method.name()).map_err(|error| {
                    if precision == Precision::F64 && facts.smallest_pivot < SINGULAR_PIVOT {
                        let (unknown, pivot) = (facts.weakest_unknown, facts.smallest_pivot);
                        FactorizationError::Singular { unknown, pivot }
                    } else {
                        error
                    }
                })?;
                Box::new(factors)
            }
            Method::Supernodal => {
                let factors = self.supernodal.factorize_matrix(a)?;
                test_on(a, &a.row_weights(false), &factors, false, method.name())?;
                Box::new(factors)
            }
        };
        self.used = Some(method);
        Ok(factors)
    }
}

impl LinearSolver for RobustSolver {
    fn name(&self) -> &'static str {
        match self.choice {
            SolverChoice::Faer => "supernodal LU",
            _ => "multifrontal LU with fallbacks",
        }
    }

    fn factorize(&mut self, a: &CsrMatrix) -> Result<Box<dyn Factorization>, FactorizationError> {
        use FactorizationError::{NonFinite, Pattern, Singular};
        let mut failure = None;
        for method in self.chain(a.n()) {
            match self.attempt(method, a) {
                Ok(factors) => return Ok(factors),
                Err(error @ (NonFinite { .. } | Pattern { .. })) => return Err(error),
                Err(error @ Singular { .. }) if method != Method::Multifrontal(Precision::F32) => {
                    return Err(error);
                }
                // The latest failure is that of the most accurate method.
                Err(error) => failure = Some(error),
            }
        }
        Err(failure.unwrap_or(FactorizationError::Backend {
            solver: self.name(),
            n: a.n(),
            reason: "no method is available".to_owned(),
        }))
    }

    fn insist_on_double(&mut self) -> bool {
        let single = SolverChoice::Multifrontal { precision: Precision::F32 };
        let changes = self.choice == SolverChoice::Auto || self.choice == single;
        if changes {
            self.choice = SolverChoice::Multifrontal { precision: Precision::F64 };
        }
        changes
    }

    fn analyse(&mut self, pattern: &Arc<CsrPattern>) -> Result<(), FactorizationError> {
        match self.choice {
            SolverChoice::Faer => Ok(()),
            _ => self.multifrontal.analyse(pattern),
        }
    }
}

impl Backend for SolverChoice {
    fn solver(&self) -> Box<dyn LinearSolver> {
        Box::new(RobustSolver::new(*self))
    }

    fn ranks(&self) -> &dyn Ranks {
        &Alone
    }

    fn layout(&self, pattern: &CsrPattern) -> Layout {
        Layout::whole(pattern.n)
    }
}

/// Solves with `a`, or its transpose, for a fixed vector without structure, and looks at the true residual.
///
/// `weights` brings all rows (columns, of the transpose) to one size: right-hand sides are in proportion to these sizes, and
/// residuals are measured by them. All are of the unknowns of this rank.
///
/// # Errors
/// [`FactorizationError::Inaccurate`] if the factors are of no use, even as a preconditioner.
pub fn test_on(
    a: &dyn Operator,
    weights: &[f64],
    factors: &dyn Factorization,
    transpose: bool,
    solver: &'static str,
) -> Result<(), FactorizationError> {
    // another one on each rank
    let rank = a.ranks().rank() as f64;
    let entry = |i: usize| (i as f64 * i as f64 * 0.618_034 + rank).sin();
    let rhs: Vec<f64> = weights.iter().enumerate().map(|(i, weight)| entry(i) / weight).collect();
    let (tolerance, most) = (TEST_TOLERANCE, TEST_ITERATIONS);
    let options = SolveOptions { tolerance, max_iterations: most, restart: most, give_up_early: false };
    let residual = match solve_weighted(a, factors, transpose, &rhs, weights, &options) {
        Ok(report) => report.relative_residual,
        Err(_) => f64::NAN,
    };
    if residual <= TEST_TOLERANCE { Ok(()) } else { Err(FactorizationError::Inaccurate { solver, residual }) }
}

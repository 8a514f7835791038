//! A chain of solvers: if one fails, the next one is tried.

use crate::csr::{CsrMatrix, CsrPattern};
use crate::multifrontal::MultifrontalSolver;
use crate::operator::Operator;
use crate::solver::{Backend, Factorization, FactorizationError, LinearSolver, Pivot, Precision};
use crate::symbolic::Symbolic;
use crate::verified::{SolveOptions, solve_weighted};
use std::borrow::Cow;
use std::fmt;
use std::sync::{Arc, OnceLock};

/// Relative residual that factors must reach on a test vector, with the help of GMRES. With a
/// singular matrix they cannot reach it, because a fraction of about 1/√n of the vector lies
/// outside the range.
const TEST_TOLERANCE: f64 = 1e-4;

/// Pivots of the scaled matrix below which a failed test means that the matrix is singular, and not
/// that the method is too weak. Round-off leaves up to about 1e-13 in place of a zero.
const SINGULAR_PIVOT: f64 = 1e-11;

/// Number of iterations allowed in that test. Single precision needs two to six on hard problems.
const TEST_ITERATIONS: usize = 12;

/// Which direct solvers to use: names of the standard chains.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SolverChoice {
    /// Multifrontal in single precision, then in double, then with strict pivoting.
    #[default]
    Auto,
    /// Multifrontal in the given precision; single precision falls back to double, then to strict
    /// pivoting.
    Multifrontal {
        /// Number format of the factors.
        precision: Precision,
    },
    /// Only multifrontal in double precision with [strict pivoting](MultifrontalSolver::strict).
    Strict,
}

impl SolverChoice {
    /// The solvers in sequence.
    pub fn chain(self) -> Vec<Link> {
        let strict = Link::new(MultifrontalSolver::strict());
        let double = MultifrontalSolver::new(Precision::F64);
        match self {
            Self::Strict => vec![strict],
            Self::Auto | Self::Multifrontal { precision: Precision::F32 } => {
                let single = double.in_precision(Precision::F32);
                vec![Link::new(single), Link::new(double), strict]
            }
            Self::Multifrontal { precision: Precision::F64 } => vec![Link::new(double), strict],
        }
    }
}

impl Backend for SolverChoice {
    fn solver(&self) -> Box<dyn LinearSolver> {
        Box::new(RobustSolver::new(*self))
    }
}

/// A solver in a chain, and the sizes of the matrices for which it is tried.
pub struct Link {
    solver: Box<dyn LinearSolver>,
    most_unknowns: usize,
    /// Whether it is no longer tried because its factors are in single precision or only a
    /// preconditioner.
    passed_over: bool,
}

impl Link {
    /// `solver`, tried for matrices of any size.
    pub fn new(solver: impl LinearSolver + 'static) -> Self {
        Self { solver: Box::new(solver), most_unknowns: usize::MAX, passed_over: false }
    }

    /// The same solver, tried only for matrices of at most `unknowns` unknowns.
    pub fn up_to(self, unknowns: usize) -> Self {
        Self { most_unknowns: unknowns, ..self }
    }

    fn takes(&self, n: usize) -> bool {
        !self.passed_over && n <= self.most_unknowns
    }

    /// Factors that have passed a test. Safe ones and those of an iterative solver are not tested: that
    /// would take as long as a solve, and every solve is verified anyway.
    fn attempt(&mut self, symbolic: &Symbolic, a: &CsrMatrix) -> Result<Box<dyn Factorization>, FactorizationError> {
        let factors = self.solver.factorize(symbolic, a)?;
        if self.solver.is_iterative() || factors.is_safe() {
            return Ok(factors);
        }
        let weights = factors.row_scaling().map_or_else(|| Cow::Owned(a.row_weights(false)), Cow::Borrowed);
        test_on(a, &weights, factors.as_ref(), false, self.solver.name()).map_err(|error| {
            let double = factors.precision() == Precision::F64;
            match factors.weakest_pivot().filter(|pivot| double && pivot.size < SINGULAR_PIVOT) {
                Some(Pivot { unknown, size }) => FactorizationError::Singular { unknown, pivot: size },
                None => error,
            }
        })?;
        Ok(factors)
    }
}

impl fmt::Debug for Link {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (name, most) = (self.solver.name(), self.most_unknowns);
        f.debug_struct("Link").field("solver", &name).field("most_unknowns", &most).finish_non_exhaustive()
    }
}

/// Tries a chain of solvers in turn until factors pass a test solve. For a single rank.
///
/// If a solver fails, or its factors fail the test, the next solver is tried. Two failures end the
/// chain at once: a matrix that is not finite, and one that a solver in double precision finds
/// singular. If all solvers fail, the error is that of the last one.
///
/// A chain is a list; any [`LinearSolver`] can be in it:
///
/// ```
/// use slipstick_linalg::{Link, MultifrontalSolver, RobustSolver, SolverChoice};
///
/// let usual = RobustSolver::new(SolverChoice::Auto);
/// // strict pivoting up to 5000 unknowns, then the usual ones
/// let mut chain = SolverChoice::Auto.chain();
/// chain.insert(0, Link::new(MultifrontalSolver::strict()).up_to(5000));
/// let solver = RobustSolver::of(chain);
/// ```
#[derive(Debug)]
pub struct RobustSolver {
    chain: Vec<Link>,
    used: Option<&'static str>,
}

/// The analyses of a chain. Those of the fallbacks are computed when they are first needed.
struct Analyses {
    /// Names of the solvers that these belong to.
    solvers: Vec<&'static str>,
    made: Vec<OnceLock<Symbolic>>,
}

impl RobustSolver {
    /// With the chain of `choice`.
    pub fn new(choice: SolverChoice) -> Self {
        Self::of(choice.chain())
    }

    /// With the solvers of `chain`, the first one first.
    pub fn of(chain: Vec<Link>) -> Self {
        Self { chain, used: None }
    }

    /// Name of the solver behind the latest successful factorization.
    pub fn used(&self) -> Option<&'static str> {
        self.used
    }

    fn solvers(&self) -> Vec<&'static str> {
        self.chain.iter().map(|link| link.solver.name()).collect()
    }

    /// The analyses in `symbolic`, if they belong to this pattern and this chain.
    fn analyses<'s>(&self, symbolic: &'s Symbolic, pattern: &CsrPattern) -> Option<&'s Analyses> {
        let of_pattern = symbolic.content::<Analyses>().filter(|_| symbolic.is_of(pattern));
        of_pattern.filter(|analyses| analyses.solvers == self.solvers())
    }
}

impl Analyses {
    /// The analysis of a link, computed if needed, with the help of those of the other links and of
    /// `earlier` ones.
    fn of(
        &self,
        link: usize,
        solver: &dyn LinearSolver,
        pattern: &Arc<CsrPattern>,
        earlier: &[Symbolic],
    ) -> Result<&Symbolic, FactorizationError> {
        if let Some(symbolic) = self.made[link].get() {
            return Ok(symbolic);
        }
        let symbolic = solver.analyse_after(pattern, &[&self.all(), earlier].concat())?;
        Ok(self.made[link].get_or_init(|| symbolic))
    }

    fn all(&self) -> Vec<Symbolic> {
        self.made.iter().filter_map(|symbolic| symbolic.get().cloned()).collect()
    }
}

impl LinearSolver for RobustSolver {
    fn name(&self) -> &'static str {
        match self.chain.as_slice() {
            [link] => link.solver.name(),
            _ => "chain of solvers",
        }
    }

    /// Analyses for the first solver; `factorize` adds the analyses of the fallbacks if it needs
    /// them.
    fn analyse_after(&self, pattern: &Arc<CsrPattern>, earlier: &[Symbolic]) -> Result<Symbolic, FactorizationError> {
        if let Some(symbolic) = earlier.iter().find(|symbolic| self.analyses(symbolic, pattern).is_some()) {
            return Ok(symbolic.clone());
        }
        let parts = |symbolic: &Symbolic| match symbolic.content::<Analyses>() {
            Some(analyses) => analyses.all(),
            None => vec![symbolic.clone()],
        };
        let earlier: Vec<Symbolic> = earlier.iter().flat_map(parts).collect();
        let analyses = Analyses { solvers: self.solvers(), made: vec![OnceLock::new(); self.chain.len()] };
        let first = self.chain.iter().enumerate().find(|(_, link)| link.takes(pattern.n()));
        if let Some((index, link)) = first {
            // if this fails, so does the same call in `factorize`, which then tries the next solver
            let _ = analyses.of(index, link.solver.as_ref(), pattern, &earlier);
        }
        Ok(Symbolic::new(pattern, analyses))
    }

    fn factorize(&mut self, symbolic: &Symbolic, a: &CsrMatrix) -> Result<Box<dyn Factorization>, FactorizationError> {
        use FactorizationError::{Analysis, NonFinite, Singular, Values};
        let analyses = self.analyses(symbolic, &a.pattern).ok_or(Analysis { n: a.n() })?;
        let mut failure = None;
        for (index, link) in self.chain.iter_mut().enumerate().filter(|(_, link)| link.takes(a.n())) {
            let symbolic = analyses.of(index, link.solver.as_ref(), &a.pattern, &[]);
            match symbolic.and_then(|symbolic| link.attempt(symbolic, a)) {
                Ok(factors) => {
                    self.used = Some(link.solver.name());
                    return Ok(factors);
                }
                Err(error @ (NonFinite { .. } | Values { .. } | Analysis { .. })) => return Err(error),
                Err(error @ Singular { .. }) if link.solver.precision() == Precision::F64 => return Err(error),
                // The last failure is that of the most accurate method.
                Err(error) => failure = Some(error),
            }
        }
        Err(failure.unwrap_or(FactorizationError::Backend {
            solver: self.name(),
            n: a.n(),
            reason: "no method is available".to_owned(),
        }))
    }

    /// The precision of the first solver.
    fn precision(&self) -> Precision {
        let first = self.chain.iter().find(|link| !link.passed_over);
        first.map_or(Precision::F64, |link| link.solver.precision())
    }

    /// Whether the first solver is iterative.
    fn is_iterative(&self) -> bool {
        self.chain.iter().find(|link| !link.passed_over).is_some_and(|link| link.solver.is_iterative())
    }

    /// Skips iterative solvers, if there are others.
    fn insist_on_direct(&mut self) -> bool {
        let alternative = self.chain.iter().any(|link| !link.passed_over && !link.solver.is_iterative());
        let mut changes = false;
        for link in self.chain.iter_mut().filter(|link| !link.passed_over && link.solver.is_iterative()) {
            link.passed_over = alternative;
            changes |= alternative;
        }
        changes
    }

    /// Skips the solvers in single precision; if there are no others, insists with each of them.
    fn insist_on_double(&mut self) -> bool {
        let is_double = |link: &Link| link.solver.precision() == Precision::F64;
        let alternative = self.chain.iter().any(is_double);
        let mut changes = false;
        for link in self.chain.iter_mut().filter(|link| !link.passed_over && !is_double(link)) {
            link.passed_over = alternative;
            changes |= alternative || link.solver.insist_on_double();
        }
        changes
    }
}

/// Solves with `a`, or its transpose, for a fixed vector without structure, and measures the true
/// residual.
///
/// `weights` scales all rows (of the transpose: columns) to the same size: right-hand sides are
/// proportional to these sizes, and residuals are measured relative to them. All vectors cover the
/// unknowns of this rank.
///
/// # Errors
/// [`FactorizationError::Inaccurate`] if the factors are useless, even as a preconditioner.
pub fn test_on(
    a: &dyn Operator,
    weights: &[f64],
    factors: &dyn Factorization,
    transpose: bool,
    solver: &'static str,
) -> Result<(), FactorizationError> {
    // a different vector on each rank
    let rank = a.ranks().rank() as f64;
    let entry = |i: usize| (i as f64 * i as f64 * 0.618_034 + rank).sin();
    let rhs: Vec<f64> = weights.iter().enumerate().map(|(i, weight)| entry(i) / weight).collect();
    let (tolerance, most) = (TEST_TOLERANCE, TEST_ITERATIONS);
    let options = SolveOptions { tolerance, max_iterations: most, restart: most, alternative: None };
    let residual = match solve_weighted(a, factors, transpose, &rhs, weights, &options) {
        Ok(report) => report.relative_residual,
        Err(_) => f64::NAN,
    };
    if residual <= TEST_TOLERANCE { Ok(()) } else { Err(FactorizationError::Inaccurate { solver, residual }) }
}

//! Chains of solvers, with solvers that the crate does not know.

use crate::common::{Brick, Random, relative_residual};
use slipstick_linalg::{
    Backend, CsrMatrix, CsrPattern, Factorization, FactorizationError, LinearSolver, Link, MultifrontalSolver,
    Precision, RobustSolver, SolverChoice, Symbolic,
};
use std::sync::{Arc, Mutex};

const BRICK: Brick = Brick { nodes: [6, 5, 4], multipliers: true, contrast: 1.0, nonsymmetry: 0.1, fixed_bottom: true };

const SINGULAR: FactorizationError = FactorizationError::Singular { unknown: 3, pivot: 0.0 };

/// Takes every matrix for its diagonal, or fails; says what it is asked.
struct Diagonal {
    precision: Precision,
    failure: Option<FactorizationError>,
    asked: Arc<Mutex<Vec<&'static str>>>,
}

impl Diagonal {
    fn new(asked: &Arc<Mutex<Vec<&'static str>>>) -> Self {
        Self { precision: Precision::F64, failure: None, asked: Arc::clone(asked) }
    }
}

impl LinearSolver for Diagonal {
    fn name(&self) -> &'static str {
        "diagonal"
    }

    fn analyse_after(&self, pattern: &Arc<CsrPattern>, _: &[Symbolic]) -> Result<Symbolic, FactorizationError> {
        self.asked.lock().unwrap().push("analyse");
        Ok(Symbolic::new(pattern, ()))
    }

    fn factorize(&mut self, symbolic: &Symbolic, a: &CsrMatrix) -> Result<Box<dyn Factorization>, FactorizationError> {
        self.asked.lock().unwrap().push("factorize");
        symbolic.content_for::<()>(a)?;
        let entry = |i: usize| a.row(i).0.iter().position(|&j| j as usize == i).map_or(0.0, |k| a.row(i).1[k]);
        let factors = DiagonalFactors((0..a.n()).map(entry).collect());
        self.failure.clone().map_or_else(|| Ok(Box::new(factors) as Box<dyn Factorization>), Err)
    }

    fn precision(&self) -> Precision {
        self.precision
    }
}

struct DiagonalFactors(Vec<f64>);

impl Factorization for DiagonalFactors {
    fn solve(&self, rhs: &mut [f64]) {
        rhs.iter_mut().zip(&self.0).for_each(|(x, d)| *x /= d);
    }

    fn solve_transpose(&self, rhs: &mut [f64]) {
        self.solve(rhs);
    }

    fn n(&self) -> usize {
        self.0.len()
    }

    fn bytes(&self) -> usize {
        8 * self.n()
    }

    fn precision(&self) -> Precision {
        Precision::F64
    }
}

fn diagonal(n: usize) -> CsrMatrix {
    let unknowns: Vec<u32> = (0..n as u32).collect();
    let pattern = CsrPattern::new((0..=n).collect(), unknowns.clone(), unknowns, vec![]).unwrap();
    CsrMatrix { pattern: Arc::new(pattern), values: (0..n).map(|i| 1.0 + i as f64).collect() }
}

/// The usual chain behind another solver.
fn behind(first: Link) -> RobustSolver {
    let mut chain = SolverChoice::Auto.chain();
    chain.insert(0, first);
    RobustSolver::of(chain)
}

/// A solver from outside serves where its factors pass the test, and only where it is to be tried;
/// else the next one does.
#[test]
fn a_solver_can_be_added_to_a_chain() {
    let asked = Arc::default();
    let mut solver = behind(Link::new(Diagonal::new(&asked)).up_to(500));
    let single = "multifrontal LU in single precision";
    for (a, used, expected) in [
        (diagonal(500), "diagonal", &["analyse", "factorize"][..]),
        (diagonal(501), single, &[]),
        (BRICK.reduced(1).0, single, &["analyse", "factorize"]),
    ] {
        asked.lock().unwrap().clear();
        let b = Random(2).vector(a.n());
        let mut x = b.clone();
        solver.analyse_and_factorize(&a).unwrap().solve(&mut x);
        assert!(relative_residual(&a, false, &x, &b) < 1e-4);
        assert_eq!((solver.used(), asked.lock().unwrap().as_slice()), (Some(used), expected), "{} unknowns", a.n());
    }
}

/// What passes a matrix on to the next solver: a failure, also to find regular in single precision
/// what may be so; not a matrix that is singular in double precision, or unusable.
#[test]
fn failures_pass_a_matrix_on_unless_it_is_to_blame() {
    let a = BRICK.reduced(1).0;
    let failed = FactorizationError::Backend { solver: "diagonal", n: a.n(), reason: "no".into() };
    let broken = FactorizationError::NonFinite { row: 0, column: 0 };
    for (failure, precision, passed_on) in [
        (failed, Precision::F64, true),
        (SINGULAR, Precision::F32, true),
        (SINGULAR, Precision::F64, false),
        (broken, Precision::F32, false),
    ] {
        let first = Diagonal { precision, failure: Some(failure.clone()), ..Diagonal::new(&Arc::default()) };
        let result = behind(Link::new(first)).analyse_and_factorize(&a);
        assert_eq!(result.err(), (!passed_on).then_some(failure));
    }
    assert!(RobustSolver::of(vec![]).analyse_and_factorize(&a).is_err());
}

/// The analysis of a fallback is made once, when a matrix first comes to it.
#[test]
fn analyses_are_made_when_they_are_needed() {
    let asked = Arc::default();
    let mut chain = SolverChoice::Multifrontal { precision: Precision::F64 }.chain();
    chain.insert(1, Link::new(Diagonal::new(&asked)));
    let mut solver = RobustSolver::of(chain);
    let good = BRICK.reduced(1).0;
    let symbolic = solver.analyse(&good.pattern).unwrap();
    solver.factorize(&symbolic, &good).unwrap();
    assert!(asked.lock().unwrap().is_empty());
    let first = Diagonal { failure: Some(SINGULAR), precision: Precision::F32, ..Diagonal::new(&Arc::default()) };
    let mut solver = RobustSolver::of(vec![Link::new(first), Link::new(Diagonal::new(&asked))]);
    let a = diagonal(9);
    let symbolic = solver.analyse(&a.pattern).unwrap();
    let again = solver.analyse_after(&a.pattern, std::slice::from_ref(&symbolic)).unwrap();
    for symbolic in [&symbolic, &again] {
        solver.factorize(symbolic, &a).unwrap();
    }
    assert_eq!(*asked.lock().unwrap(), ["analyse", "factorize", "factorize"]);
    // that of another chain is refused
    let foreign = RobustSolver::new(SolverChoice::Strict).factorize(&symbolic, &a).err();
    assert_eq!(foreign, Some(FactorizationError::Analysis { n: 9 }));
}

/// A multifrontal solver that keeps, of every analysis it is asked for, what was at hand for it.
struct Spy(MultifrontalSolver, Arc<Mutex<Vec<Vec<Symbolic>>>>);

impl LinearSolver for Spy {
    fn name(&self) -> &'static str {
        "spy"
    }

    fn analyse_after(&self, pattern: &Arc<CsrPattern>, earlier: &[Symbolic]) -> Result<Symbolic, FactorizationError> {
        self.1.lock().unwrap().push(earlier.to_vec());
        self.0.analyse_after(pattern, earlier)
    }

    fn factorize(&mut self, symbolic: &Symbolic, a: &CsrMatrix) -> Result<Box<dyn Factorization>, FactorizationError> {
        self.0.factorize(symbolic, a)
    }
}

/// The solvers of a chain hand on what they know: of this pattern, so that single and double
/// precision share an analysis, and of the one before.
#[test]
fn solvers_of_a_chain_share_what_they_know() {
    let told = Arc::default();
    let single = MultifrontalSolver::new(Precision::F32);
    let double = Spy(single.in_precision(Precision::F64), Arc::clone(&told));
    let mut solver = RobustSolver::of(vec![Link::new(single), Link::new(double)]);
    let (first, second) = (BRICK.reduced(1).0, Brick { nodes: [5, 5, 4], ..BRICK }.reduced(1).0);
    let symbolic = solver.analyse(&first.pattern).unwrap();
    assert!(solver.insist_on_double() && !solver.insist_on_double());
    assert_eq!(solver.factorize(&symbolic, &first).unwrap().precision(), Precision::F64);
    let next = solver.analyse_after(&second.pattern, &[symbolic]).unwrap();
    solver.factorize(&next, &second).unwrap();
    let told = told.lock().unwrap();
    let of_first: Vec<usize> =
        told.iter().map(|at_hand| at_hand.iter().filter(|s| s.is_of(&first.pattern)).count()).collect();
    assert_eq!((of_first, told.iter().map(Vec::len).collect::<Vec<_>>()), (vec![1, 2], vec![1, 2]));
}

/// A chain of one precision only changes to the other.
#[test]
fn a_chain_in_single_precision_changes_to_double() {
    let a = BRICK.reduced(1).0;
    let mut solver = RobustSolver::of(vec![Link::new(MultifrontalSolver::new(Precision::F32))]);
    let symbolic = solver.analyse(&a.pattern).unwrap();
    assert_eq!(solver.factorize(&symbolic, &a).unwrap().precision(), Precision::F32);
    assert!(solver.insist_on_double() && !solver.insist_on_double());
    let symbolic = solver.analyse_after(&a.pattern, &[symbolic]).unwrap();
    assert_eq!(solver.factorize(&symbolic, &a).unwrap().precision(), Precision::F64);
    assert_eq!(solver.used(), Some("multifrontal LU in double precision"));
}

/// A backend of one rank says how to make its solver, and nothing else.
#[test]
fn a_chain_makes_a_backend() {
    #[derive(Debug)]
    struct Mine;

    impl Backend for Mine {
        fn solver(&self) -> Box<dyn LinearSolver> {
            Box::new(behind(Link::new(Diagonal::new(&Arc::default()))))
        }
    }

    let a = diagonal(4);
    assert_eq!((Mine.ranks().size(), Mine.layout(&a.pattern).own()), (1, 4));
    assert!(Mine.solver().analyse_and_factorize(&a).is_ok());
}

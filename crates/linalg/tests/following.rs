//! Factors that reuse a part of earlier ones.

mod common;

use common::{Brick, Random, relative_residual};
use slipstick_linalg::{
    CsrMatrix, CsrPattern, Factorization, LinearSolver, MultifrontalSolver, Precision, Symbolic, solve_verified,
};
use std::sync::Arc;

const BRICK: Brick =
    Brick { nodes: [14, 12, 10], multipliers: true, contrast: 2.0, nonsymmetry: 0.3, fixed_bottom: true };

/// The matrix with all entries of some of its last rows and columns multiplied by `factor`, and all
/// others by a factor between 1 and 1 + `drift`.
fn changed(a: &CsrMatrix, rows: usize, factor: f64, drift: f64) -> CsrMatrix {
    let first = a.n() - rows;
    let mut values = a.values.clone();
    for i in 0..a.n() {
        for k in a.pattern.row_range(i) {
            let j = a.pattern.columns()[k] as usize;
            let wave = 1.0 + drift * (0.5 + 0.5 * ((i + j) as f64).sin());
            values[k] *= if i >= first && j >= first { factor } else { wave };
        }
    }
    CsrMatrix { pattern: a.pattern.clone(), values }
}

/// The matrix with a small coupling of two more unknowns, on a pattern of its own.
fn coupled(a: &CsrMatrix, [first, second]: [usize; 2]) -> CsrMatrix {
    let (mut offsets, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
    for i in 0..a.n() {
        let (places, entries) = a.row(i);
        let mut row: Vec<(u32, f64)> = places.iter().copied().zip(entries.iter().copied()).collect();
        for (from, to) in [(first, second), (second, first)] {
            if i == from {
                assert!(row.iter().all(|(j, _)| *j as usize != to), "already coupled");
                row.push((to as u32, 0.01));
            }
        }
        row.sort_by_key(|(j, _)| *j);
        columns.extend(row.iter().map(|(j, _)| *j));
        values.extend(row.iter().map(|(_, value)| *value));
        offsets.push(columns.len());
    }
    let pattern = CsrPattern::new(offsets, columns, a.pattern.groups().to_vec(), vec![]).unwrap();
    CsrMatrix { pattern: Arc::new(pattern), values }
}

/// Solutions of A x = b and Aᵀ x = b.
fn solutions(factors: &dyn Factorization, b: &[f64]) -> [Vec<f64>; 2] {
    let [mut x, mut y] = [b.to_vec(), b.to_vec()];
    factors.solve(&mut x);
    factors.solve_transpose(&mut y);
    [x, y]
}

fn equal_bits(a: &[Vec<f64>; 2], b: &[Vec<f64>; 2]) -> bool {
    a.iter().flatten().zip(b.iter().flatten()).all(|(a, b)| a.to_bits() == b.to_bits())
}

/// Factors of one matrix after the other.
fn sequence(mut solver: MultifrontalSolver, matrices: &[&CsrMatrix]) -> Vec<Box<dyn Factorization>> {
    let mut symbolic: Option<Symbolic> = None;
    let mut factors = Vec::new();
    for a in matrices {
        let analysis = solver.analyse_after(&a.pattern, symbolic.as_slice()).unwrap();
        factors.push(solver.factorize(&analysis, a).unwrap());
        symbolic = Some(analysis);
    }
    factors
}

/// Without a tolerance, only fronts with changed entries are computed again, with those above them:
/// the factors are those of a solver that computes all fronts, bit for bit, with fewer operations.
#[test]
fn reused_fronts_are_those_that_would_be_computed() {
    for multipliers in [true, false] {
        let (a, _) = Brick { multipliers, ..BRICK }.reduced(3);
        let (b, c) = (changed(&a, 12, 1.3, 0.0), changed(&a, 30, 0.9, 0.0));
        let rhs = Random(5).vector(a.n());
        for precision in [Precision::F64, Precision::F32] {
            let solver = || MultifrontalSolver::new(precision);
            let matrices = [&a, &b, &b, &c, &a];
            let all = sequence(solver(), &matrices);
            let some = sequence(solver().following(0.0), &matrices);
            for (k, (all, some)) in all.iter().zip(&some).enumerate() {
                assert!(equal_bits(&solutions(&**all, &rhs), &solutions(&**some, &rhs)), "{k}");
                assert_eq!((all.reuses_earlier(), some.reuses_earlier()), (false, k > 0));
                let share = some.part().operations / all.part().operations;
                assert!(if k == 0 { share == 1.0 } else { share < 0.9 }, "{k}: {share}");
            }
            assert_eq!(some[2].part().operations, 0.0);
        }
    }
}

/// The same if the pattern changes: fronts with the same unknowns are found in the new order.
#[test]
fn fronts_are_reused_on_another_pattern() {
    let (a, _) = Brick { multipliers: false, ..BRICK }.reduced(3);
    let b = coupled(&a, [a.n() - 1, a.n() - 7]);
    let c = changed(&b, 12, 1.3, 0.0);
    let rhs = Random(6).vector(a.n());
    let matrices = [&a, &b, &c, &a];
    let all = sequence(MultifrontalSolver::new(Precision::F64), &matrices);
    let some = sequence(MultifrontalSolver::new(Precision::F64).following(0.0), &matrices);
    for (k, (all, some)) in all.iter().zip(&some).enumerate() {
        assert!(equal_bits(&solutions(&**all, &rhs), &solutions(&**some, &rhs)), "{k}");
        let share = some.part().operations / all.part().operations;
        assert!(if k == 0 { share == 1.0 } else { share < 0.95 }, "{k}: {share}");
    }
}

/// With a tolerance, factors precondition a matrix whose entries have drifted less, and drift does not
/// add up: each front is compared with the entries that it was computed from. By any number of threads,
/// they are the same, bit for bit.
#[test]
fn small_changes_are_left_to_the_iteration() {
    let (a, _) = BRICK.reduced(3);
    let rhs = Random(7).vector(a.n());
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let matrices: Vec<CsrMatrix> =
                (0..8).map(|k| changed(&a, 12, 1.0 + 0.2 * k as f64, 0.02 * k as f64)).collect();
            let solver = MultifrontalSolver::new(Precision::F32).following(0.05);
            let all = sequence(solver, &matrices.iter().collect::<Vec<_>>());
            let each = matrices.iter().zip(&all).map(|(matrix, factors)| {
                let mut x = vec![0.0; a.n()];
                let report = solve_verified(matrix, &**factors, false, &rhs, &mut x, 1e-10).unwrap();
                assert!(report.iterations <= 15, "{report:?}");
                assert!(relative_residual(matrix, false, &x, &rhs) <= 1e-10);
                (x, factors.part().operations)
            });
            each.collect::<Vec<_>>()
        })
    };
    let reference = run(1);
    let operations: Vec<f64> = reference.iter().map(|(_, operations)| *operations).collect();
    // the far fronts follow once the drift exceeds the tolerance
    assert!(operations[1] < 0.9 * operations[0], "{operations:?}");
    assert!(operations[2..].iter().any(|later| *later > 0.9 * operations[0]), "{operations:?}");
    for threads in [2, 3] {
        for ((x, _), (y, _)) in run(threads).iter().zip(&reference) {
            assert!(x.iter().zip(y).all(|(x, y)| x.to_bits() == y.to_bits()));
        }
    }
}

/// By definition: once earlier factors are forgotten, all fronts are computed.
#[test]
fn earlier_factors_can_be_forgotten() {
    let (a, _) = BRICK.reduced(3);
    let mut solver = MultifrontalSolver::new(Precision::F32).following(0.1);
    let symbolic = solver.analyse(&a.pattern).unwrap();
    let mut operations = || solver.factorize(&symbolic, &a).unwrap().part().operations;
    let (first, second) = (operations(), operations());
    assert!(first > 0.0 && second == 0.0);
    assert!(solver.forget_factors());
    assert!(!solver.forget_factors());
    let third = solver.factorize(&symbolic, &a).unwrap();
    assert!(!third.reuses_earlier() && third.part().operations == first);
    assert!(!MultifrontalSolver::new(Precision::F32).forget_factors());
}

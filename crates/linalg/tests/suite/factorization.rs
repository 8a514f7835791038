//! Direct solvers against dense elimination, against each other and by their residuals.

use crate::common::{Brick, Random, difference, relative_residual};
use crate::supernodal::SupernodalSolver;
use slipstick_linalg::{
    CsrMatrix, CsrPattern, Factorization, FactorizationError, LinearSolver, MultifrontalFactorization,
    MultifrontalSolver, Precision, RobustSolver, SolverChoice, Symbolic, Transposed, solve_verified,
};
use std::sync::Arc;

const BRICK: Brick =
    Brick { nodes: [9, 8, 7], multipliers: true, contrast: 3.0, nonsymmetry: 0.05, fixed_bottom: true };

/// Gaussian elimination with partial pivoting, written out: the independent reference.
fn dense_solve(a: &CsrMatrix, transpose: bool, b: &[f64]) -> Vec<f64> {
    let n = a.n();
    let mut m = vec![vec![0.0; n + 1]; n];
    for i in 0..n {
        let (columns, values) = a.row(i);
        for (&j, &v) in columns.iter().zip(values) {
            let (r, c) = if transpose { (j as usize, i) } else { (i, j as usize) };
            m[r][c] = v;
        }
        m[i][n] = b[i];
    }
    for k in 0..n {
        let pivot = (k..n).max_by(|&i, &j| m[i][k].abs().total_cmp(&m[j][k].abs())).unwrap();
        m.swap(k, pivot);
        let (head, tail) = m.split_at_mut(k + 1);
        for row in tail {
            let factor = row[k] / head[k][k];
            if factor != 0.0 {
                row[k..].iter_mut().zip(&head[k][k..]).for_each(|(x, p)| *x -= factor * p);
            }
        }
    }
    let mut x = vec![0.0; n];
    for k in (0..n).rev() {
        let sum: f64 = (k + 1..n).map(|j| m[k][j] * x[j]).sum();
        x[k] = (m[k][n] - sum) / m[k][k];
    }
    x
}

fn solvers() -> Vec<Box<dyn LinearSolver>> {
    vec![
        Box::new(SupernodalSolver::new()),
        Box::new(MultifrontalSolver::strict()),
        Box::new(MultifrontalSolver::new(Precision::F64)),
        Box::new(RobustSolver::new(SolverChoice::Multifrontal { precision: Precision::F64 })),
    ]
}

fn csr(rows: &[Vec<(u32, f64)>], groups: Vec<u32>) -> CsrMatrix {
    let (mut row_offsets, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
    for row in rows {
        columns.extend(row.iter().map(|e| e.0));
        values.extend(row.iter().map(|e| e.1));
        row_offsets.push(values.len());
    }
    let pattern = CsrPattern::new(row_offsets, columns, groups, vec![]).unwrap();
    CsrMatrix { pattern: Arc::new(pattern), values }
}

#[test]
fn both_solves_agree_with_dense_elimination() {
    let brick = Brick { nodes: [5, 4, 4], ..BRICK };
    let (a, _) = brick.reduced(1);
    let b = Random(2).vector(a.n());
    for mut solver in solvers() {
        let factors = solver.analyse_and_factorize(&a).unwrap();
        for transpose in [false, true] {
            let mut x = b.clone();
            if transpose {
                factors.solve_transpose(&mut x)
            } else {
                factors.solve(&mut x)
            }
            let error = difference(&x, &dense_solve(&a, transpose, &b));
            assert!(error < 1e-10, "{} transpose {transpose}: {error:e}", solver.name());
        }
    }
}

#[test]
fn saddle_points_on_many_fronts_are_solved_to_rounding() {
    let (a, _) = BRICK.reduced(3);
    let b = Random(4).vector(a.n());
    let factors = MultifrontalFactorization::of(&a, Precision::F64).unwrap();
    assert!(factors.statistics().fronts > 10, "{:?}", factors.statistics());
    for transpose in [false, true] {
        let mut x = b.clone();
        if transpose {
            factors.solve_transpose(&mut x)
        } else {
            factors.solve(&mut x)
        }
        let residual = relative_residual(&a, transpose, &x, &b);
        assert!(residual < 1e-10, "transpose {transpose}: {residual:e}");
    }
}

/// Multipliers in separate groups may be eliminated first, on zero pivots. These pivots must be
/// delayed, without loss of accuracy. The brick is large enough for solves by subtrees. Of several
/// right-hand sides, each is solved as it would be alone, bit for bit. Minimum degree, the ordering without METIS,
/// happens to place no multiplier first.
#[cfg(feature = "metis")]
#[test]
fn multipliers_apart_from_their_nodes_are_delayed() {
    let brick = Brick { nodes: [13, 12, 10], ..BRICK };
    let (a, _) = brick.reduced(5);
    let first_multiplier = a.n() - 3 * 13 * 12;
    let mut groups = a.pattern.groups().to_vec();
    for (i, group) in groups.iter_mut().enumerate().skip(first_multiplier) {
        *group = 1_000_000 + i as u32 / 3;
    }
    let (offsets, columns) = (a.pattern.row_offsets().to_vec(), a.pattern.columns().to_vec());
    let pattern = CsrPattern::new(offsets, columns, groups, vec![]).unwrap();
    let a = CsrMatrix { pattern: Arc::new(pattern), values: a.values };
    let b = Random(6).vector(a.n());
    for precision in [Precision::F64, Precision::F32] {
        let factors = MultifrontalFactorization::of(&a, precision).unwrap();
        assert!(factors.statistics().delayed_pivots > 0 && factors.statistics().factor_entries > 1_000_000);
        for transpose in [false, true] {
            let mut x = vec![0.0; a.n()];
            let report = solve_verified(&a, &factors, transpose, &b, &mut x, 1e-10).unwrap();
            assert!(report.iterations <= 6, "{precision:?} {report:?}");
            let mut columns: Vec<f64> = b.iter().chain(&b).map(|b| 2.0 * b).collect();
            if transpose {
                factors.solve_transpose_many(&mut columns);
            } else {
                factors.solve_many(&mut columns);
            }
            let mut alone = b.clone();
            if transpose {
                factors.solve_transpose(&mut alone);
            } else {
                factors.solve(&mut alone);
            }
            let half: Vec<f64> = columns[a.n()..].iter().map(|x| 0.5 * x).collect();
            assert_eq!(half, alone);
            let bound = if precision == Precision::F64 { 1e-9 } else { 1e-1 };
            assert!(difference(&half, &x) < bound);
        }
    }
}

#[test]
fn several_right_hand_sides_equal_single_solves() {
    let (a, _) = BRICK.reduced(9);
    let b = Random(10).vector(40 * a.n());
    for mut solver in solvers() {
        let factors = solver.analyse_and_factorize(&a).unwrap();
        let (mut together, mut transposed) = (b.clone(), b.clone());
        factors.solve_many(&mut together);
        factors.solve_transpose_many(&mut transposed);
        for (k, b) in b.chunks_exact(a.n()).enumerate().step_by(13) {
            let range = k * a.n()..(k + 1) * a.n();
            let (mut x, mut y) = (b.to_vec(), b.to_vec());
            factors.solve(&mut x);
            factors.solve_transpose(&mut y);
            assert!(difference(&together[range.clone()], &x) < 1e-10);
            assert!(difference(&transposed[range], &y) < 1e-10);
        }
    }
}

/// The adjoint identity ⟨w, A⁻¹ v⟩ = ⟨A⁻ᵀ w, v⟩.
#[test]
fn transposed_solves_are_adjoint() {
    let (a, _) = BRICK.reduced(11);
    let (v, w) = (Random(12).vector(a.n()), Random(13).vector(a.n()));
    let factors = MultifrontalSolver::new(Precision::F64).analyse_and_factorize(&a).unwrap();
    let (mut x, mut y) = (v.clone(), w.clone());
    factors.solve(&mut x);
    factors.solve_transpose(&mut y);
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let scale = x.iter().map(|x| x.abs()).sum::<f64>();
    assert!((dot(&w, &x) - dot(&y, &v)).abs() < 1e-10 * scale);
}

/// One, two and three threads: the same bits, in factors (through solutions) and products. The
/// brick is large enough for parallel subtrees and tiles.
#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let brick = Brick { nodes: [16, 15, 14], ..BRICK };
    let (a, _) = brick.reduced(14);
    let b = Random(15).vector(a.n());
    let run = |threads: usize, precision: Precision| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let factors = MultifrontalSolver::new(precision).analyse_and_factorize(&a).unwrap();
            let (mut x, mut y) = (b.clone(), b.clone());
            factors.solve(&mut x);
            factors.solve_transpose(&mut y);
            let mut product = vec![0.0; a.n()];
            a.mul(&x, &mut product);
            [x, y, product]
        })
    };
    for precision in [Precision::F64, Precision::F32] {
        let reference = run(1, precision);
        for threads in [2, 3] {
            for (x, y) in run(threads, precision).iter().zip(&reference) {
                assert!(x.iter().zip(y).all(|(x, y)| x.to_bits() == y.to_bits()));
            }
        }
    }
}

/// Random sparse matrices without structure, with isolated unknowns and empty systems.
#[test]
fn unstructured_matrices_agree_with_dense_elimination() {
    let mut random = Random(19);
    for n in [0usize, 1, 2, 7, 60, 250] {
        let rows: Vec<Vec<(u32, f64)>> = (0..n)
            .map(|i| {
                let mut columns: Vec<usize> =
                    (0..4).map(|_| ((random.next() + 1.0) * 0.5 * n as f64) as usize).collect();
                columns.push((i * 17 + 3) % n);
                columns.retain(|&j| j != i && i % 9 != 4 && j % 9 != 4);
                columns.push(i);
                columns.sort_unstable();
                columns.dedup();
                columns.iter().map(|&j| (j as u32, random.next())).collect()
            })
            .collect();
        let a = csr(&rows, (0..n as u32).collect());
        let b = random.vector(n);
        for mut solver in solvers() {
            let factors = solver.analyse_and_factorize(&a).unwrap();
            for transpose in [false, true] {
                let mut x = b.clone();
                if transpose {
                    factors.solve_transpose(&mut x)
                } else {
                    factors.solve(&mut x)
                }
                let reference = dense_solve(&a, transpose, &b);
                if n > 0 {
                    let error = difference(&x, &reference);
                    assert!(error < 1e-7, "{} n = {n}: {error:e}", solver.name());
                }
            }
        }
    }
}

/// An analysis serves for new values on its pattern, in any order with those of other patterns, and
/// for no other pattern: not even for an equal one that was made apart.
#[test]
fn analyses_serve_for_their_patterns() {
    let (first, _) = BRICK.reduced(20);
    let mut second = first.clone();
    second.values.iter_mut().enumerate().for_each(|(k, v)| *v *= 1.0 + 0.1 * (k as f64).sin());
    let (third, _) = Brick { nodes: [6, 5, 4], ..BRICK }.reduced(21);
    let (apart, _) = BRICK.reduced(20);
    assert_eq!(apart.pattern, first.pattern);
    for mut solver in solvers() {
        let (large, small) = (solver.analyse(&first.pattern).unwrap(), solver.analyse(&third.pattern).unwrap());
        for (symbolic, a) in [(&large, &first), (&small, &third), (&large, &second), (&large, &first)] {
            let b = Random(22).vector(a.n());
            let mut x = b.clone();
            solver.factorize(symbolic, a).unwrap().solve(&mut x);
            assert!(relative_residual(a, false, &x, &b) < 1e-9, "{}", solver.name());
        }
        for a in [&third, &apart] {
            let error = solver.factorize(&large, a).err();
            assert_eq!(error, Some(FactorizationError::Analysis { n: a.n() }), "{}", solver.name());
        }
        let foreign = Symbolic::new(&first.pattern, ());
        assert_eq!(solver.factorize(&foreign, &first).err(), Some(FactorizationError::Analysis { n: first.n() }));
        // what is at hand is returned, whatever else there is
        let again = solver.analyse_after(&first.pattern, &[foreign, small, large]).unwrap();
        assert!(again.is_of(&first.pattern) && solver.factorize(&again, &second).is_ok());
    }
}

/// By definition: the elimination order of an earlier pattern serves for one with a few entries
/// more, in which METIS alone would find another one, and no longer where it would cost too much.
#[test]
fn an_elimination_order_is_taken_over_while_it_serves() {
    let n = 1000;
    let band = |extra: &[usize]| {
        let coupled = |i: usize, j: usize| i.abs_diff(j) <= 2 || extra.contains(&i) && extra.contains(&j);
        let entry = |i: usize, j: usize| (j as u32, if i == j { 9.0 } else { -1.0 });
        let row = |i: usize| (0..n).filter(|&j| coupled(i, j)).map(|j| entry(i, j)).collect();
        csr(&(0..n).map(row).collect::<Vec<_>>(), (0..n as u32).collect())
    };
    let solver = MultifrontalSolver::new(Precision::F64);
    let operations = |symbolic: &Symbolic, a: &CsrMatrix| {
        let mut solver = MultifrontalSolver::new(Precision::F64);
        solver.factorize_matrix(symbolic, a).unwrap().statistics().operations
    };
    let (plain, near, far) = (band(&[]), band(&[500, 503]), band(&(0..n).step_by(9).collect::<Vec<_>>()));
    let first = solver.analyse(&plain.pattern).unwrap();
    let followed = solver.analyse_after(&near.pattern, std::slice::from_ref(&first)).unwrap();
    let ratio = operations(&followed, &near) / operations(&first, &plain);
    assert!((1.0..1.15).contains(&ratio), "{ratio}");
    let renewed = solver.analyse_after(&far.pattern, &[first]).unwrap();
    assert_eq!(operations(&renewed, &far), operations(&solver.analyse(&far.pattern).unwrap(), &far));
}

/// Dense blocks of unknowns, and which of them are coupled.
fn blocks(sizes: &[usize], coupled: impl Fn(usize, usize) -> bool) -> CsrMatrix {
    let block: Vec<usize> = sizes.iter().enumerate().flat_map(|(b, &size)| vec![b; size]).collect();
    let n = block.len();
    let entry = |i: usize, j: usize| if i == j { n as f64 } else { ((i * 7 + j * 3) as f64).sin() };
    let row = |i: usize| (0..n).filter(|&j| coupled(block[i], block[j])).map(|j| (j as u32, entry(i, j))).collect();
    csr(&(0..n).map(row).collect::<Vec<_>>(), (0..n as u32).collect())
}

/// By hand: a front of p pivots and r rows beyond takes ⅔ p³ + 2 p² r + 2 p r² operations. Each of its
/// two factors has P (P + 1) / 2 + P R tiles of 8 × 8 entries, with P = p / 8 and R = r / 8, rounded up. A dense matrix is one front; of two blocks of 100 that a third one of 30
/// joins, one leaves its 30 rows to the front of the others.
#[test]
fn entries_and_operations_are_those_of_the_fronts() {
    let tiles = |p: f64, r: f64| p * (p + 1.0) / 2.0 + p * r;
    let entries = |p: f64, r: f64| 2.0 * 64.0 * tiles((p / 8.0).ceil(), (r / 8.0).ceil());
    let front = |p: f64, r: f64| [entries(p, r), 2.0 / 3.0 * p * p * p + 2.0 * p * p * r + 2.0 * p * r * r];
    let (one, other) = (front(100.0, 30.0), front(130.0, 0.0));
    for (a, fronts, [entries, operations]) in [
        (blocks(&[60], |_, _| true), 1, front(60.0, 0.0)),
        (blocks(&[100, 100, 30], |a, b| a == b || a == 2 || b == 2), 2, [one[0] + other[0], one[1] + other[1]]),
    ] {
        let close = |found: f64, exact: f64| assert!((found / exact - 1.0).abs() < 1e-12, "{found} instead of {exact}");
        let (predicted_entries, predicted_operations) = MultifrontalSolver::predict(&a.pattern).unwrap();
        close(predicted_entries, entries);
        close(predicted_operations, operations);
        for (precision, size) in [(Precision::F64, 8.0), (Precision::F32, 4.0)] {
            let factors = MultifrontalFactorization::of(&a, precision).unwrap();
            assert_eq!((factors.statistics().fronts, factors.statistics().delayed_pivots), (fronts, 0));
            close(factors.statistics().factor_entries as f64, entries);
            close(factors.part().operations, operations);
            // and a few lists
            let bytes = factors.bytes() as f64;
            assert!(bytes >= size * entries && bytes < 1.5 * size * entries, "{bytes}");
            let transposed = Transposed(&factors);
            assert_eq!((transposed.bytes(), transposed.cost()), (factors.bytes(), factors.cost()));
            assert_eq!((transposed.precision(), transposed.part()), (precision, factors.part()));
            // by hand: 0.4 bytes in the time of an operation, 0.2 in single precision; a solve
            // passes over the factors
            let cost = factors.cost().unwrap();
            close(cost.factorization, 0.05 * size * operations);
            assert_eq!(cost.substitution, bytes);
        }
    }
}

/// By definition: once double precision is insisted on, factors are of it; solvers that make no
/// others change nothing.
#[test]
fn double_precision_can_be_insisted_on() {
    let a = blocks(&[20], |_, _| true);
    let single = SolverChoice::Multifrontal { precision: Precision::F32 };
    let double = SolverChoice::Multifrontal { precision: Precision::F64 };
    for (choice, changes) in
        [(SolverChoice::Auto, true), (single, true), (double, false), (SolverChoice::Strict, false)]
    {
        let mut solver = RobustSolver::new(choice);
        assert_eq!((solver.insist_on_double(), solver.insist_on_double()), (changes, false), "{choice:?}");
        assert_eq!(solver.analyse_and_factorize(&a).unwrap().precision(), Precision::F64, "{choice:?}");
    }
    assert_eq!(RobustSolver::new(single).analyse_and_factorize(&a).unwrap().precision(), Precision::F32);
}

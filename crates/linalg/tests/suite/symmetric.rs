//! Matrices that are symmetric outside the contact zone, against an independent LU factorization.

use crate::common::{Brick, Random, difference};
use crate::supernodal::SupernodalSolver;
use slipstick_linalg::{CsrMatrix, Factorization, LinearSolver, MultifrontalFactorization, Precision, solve_verified};

const TALL: Brick = Brick { nodes: [6, 6, 60], multipliers: true, contrast: 3.0, nonsymmetry: 0.0, fixed_bottom: true };

/// A tall brick with contact conditions on its top face, whose rows differ from the columns of their
/// multipliers; `shift` times its average is subtracted from each diagonal entry of the brick.
fn brick(nonsymmetry: f64, shift: f64) -> CsrMatrix {
    let (mut a, reduction) = Brick { nonsymmetry, ..TALL }.reduced(31);
    let nodes: usize = TALL.nodes.iter().product();
    let pattern = a.pattern.clone();
    let diagonal = |a: &CsrMatrix, i: usize| {
        let (columns, values) = a.row(i);
        let at = columns.binary_search(&(i as u32)).unwrap();
        (pattern.row_range(i).start + at, values[at])
    };
    for i in 0..a.n() {
        if reduction.origin(i).0 < nodes {
            let (at, value) = diagonal(&a, i);
            a.values[at] -= shift * value;
        } else {
            pattern.row_range(i).for_each(|k| a.values[k] *= 1.7);
        }
    }
    a
}

/// Solutions of both systems, for one and for three right-hand sides, are those of faer's LU; the
/// three are solved as each would be alone, bit for bit.
fn check(a: &CsrMatrix, factors: &MultifrontalFactorization) {
    let b = Random(32).vector(a.n());
    let exact = SupernodalSolver::new().analyse_and_factorize(a).unwrap();
    for transpose in [false, true] {
        let solve = |factors: &dyn Factorization, x: &mut [f64]| {
            if transpose { factors.solve_transpose_many(x) } else { factors.solve_many(x) }
        };
        let (mut expected, mut alone) = (b.clone(), b.clone());
        solve(exact.as_ref(), &mut expected);
        solve(factors, &mut alone);
        let error = difference(&alone, &expected);
        let bound = if factors.precision() == Precision::F64 { 1e-10 } else { 0.05 };
        assert!(error < bound, "{:?}, transpose {transpose}: {error:e}", factors.precision());
        let mut together: Vec<f64> = [1.0, 2.0, 0.5].iter().flat_map(|s| b.iter().map(move |b| s * b)).collect();
        solve(factors, &mut together);
        for (column, scale) in together.chunks_exact(a.n()).zip([1.0, 2.0, 0.5]) {
            assert!(column.iter().zip(&alone).all(|(x, y)| *x == scale * y));
        }
        let mut x = vec![0.0; a.n()];
        let report = solve_verified(a, factors, transpose, &b, &mut x, 1e-10).unwrap();
        assert!(report.iterations <= 4 && difference(&x, &expected) < 1e-8, "{report:?}");
    }
}

/// By counting: with a small contact zone, more than 80 % of the operations are in symmetric fronts,
/// and the factors have less than 70 % of the entries of a matrix that is unsymmetric everywhere and
/// has the same pattern.
#[test]
fn bodies_are_factorized_symmetrically() {
    let (a, unsymmetric) = (brick(0.0, 0.0), brick(0.05, 0.0));
    for precision in [Precision::F64, Precision::F32] {
        let factors = MultifrontalFactorization::of(&a, precision).unwrap();
        let facts = factors.statistics();
        assert!(facts.symmetric_operations > 0.8 * facts.operations, "{facts:?}");
        let other = MultifrontalFactorization::of(&unsymmetric, precision).unwrap().statistics();
        assert!(other.symmetric_operations < 0.01 * other.operations, "{other:?}");
        assert!((facts.factor_entries as f64) < 0.7 * other.factor_entries as f64, "{facts:?} {other:?}");
        // one entry of L21 is read in place of an entry of U12
        assert!(facts.entries_read > facts.factor_entries && other.entries_read >= other.factor_entries);
        check(&a, &factors);
    }
}

/// A symmetric matrix with negative eigenvalues is factorized too: fronts that are not positive
/// definite change to LU, the others stay symmetric.
#[test]
fn indefinite_bodies_are_factorized() {
    let a = brick(0.0, 0.3);
    for precision in [Precision::F64, Precision::F32] {
        let factors = MultifrontalFactorization::of(&a, precision).unwrap();
        let facts = factors.statistics();
        let share = facts.symmetric_operations / facts.operations;
        assert!((0.01..0.9).contains(&share), "{facts:?}");
        check(&a, &factors);
    }
}

/// By comparison, bit for bit.
#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let (a, _) = Brick { nodes: [10, 10, 60], ..TALL }.reduced(33);
    let b = Random(34).vector(a.n());
    let run = |threads: usize, precision: Precision| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let factors = MultifrontalFactorization::of(&a, precision).unwrap();
            assert!(factors.statistics().symmetric_operations > 0.5 * factors.statistics().operations);
            let (mut x, mut y) = (b.clone(), b.clone());
            factors.solve(&mut x);
            factors.solve_transpose(&mut y);
            [x, y]
        })
    };
    for precision in [Precision::F64, Precision::F32] {
        let reference = run(1, precision);
        for (x, y) in run(3, precision).iter().zip(&reference) {
            assert!(x.iter().zip(y).all(|(x, y)| x.to_bits() == y.to_bits()));
        }
    }
}

/// Factors of a brick that is held need no test solve. Those of one that is free to move, if there are
/// any, do: the six zero pivots of its rigid motions show.
#[test]
fn only_factors_with_sound_pivots_are_safe() {
    let held = brick(0.0, 0.0);
    let (free, _) = Brick { nodes: [6, 6, 20], multipliers: false, fixed_bottom: false, ..TALL }.reduced(35);
    for precision in [Precision::F64, Precision::F32] {
        assert!(MultifrontalFactorization::of(&held, precision).unwrap().is_safe());
        let unsafe_or_none = MultifrontalFactorization::of(&free, precision).map(|factors| factors.is_safe());
        assert!(!unsafe_or_none.unwrap_or(false), "{precision:?}");
    }
}

//! Verified solves: single-precision and lagged factors, stalls and bad input.

use crate::common::{Brick, Random, difference, relative_residual};
use crate::supernodal::SupernodalSolver;
use slipstick_linalg::{
    Alternative, CsrMatrix, CsrPattern, Factorization, LinearSolver, MultifrontalFactorization, MultifrontalSolver,
    Precision, RobustSolver, SolveError, SolveOptions, SolverChoice, Transposed, solve_from, solve_many_from,
    solve_verified, solve_with,
};
use std::sync::Arc;

const BRICK: Brick =
    Brick { nodes: [9, 8, 7], multipliers: true, contrast: 3.0, nonsymmetry: 0.05, fixed_bottom: true };

#[test]
fn single_precision_factors_give_double_precision_solutions() {
    let (a, _) = BRICK.reduced(1);
    let b = Random(2).vector(a.n());
    let mut solver = RobustSolver::new(SolverChoice::Multifrontal { precision: Precision::F32 });
    let factors = solver.analyse_and_factorize(&a).unwrap();
    assert_eq!(factors.precision(), Precision::F32);
    let reference = SupernodalSolver::new().analyse_and_factorize(&a).unwrap();
    for transpose in [false, true] {
        let mut x = vec![f64::NAN; a.n()];
        let report = solve_verified(&a, factors.as_ref(), transpose, &b, &mut x, 1e-12).unwrap();
        assert!(report.iterations >= 1 && report.iterations <= 8, "{report:?}");
        assert!((relative_residual(&a, transpose, &x, &b) - report.relative_residual).abs() < 1e-15);
        let mut y = b.clone();
        if transpose {
            reference.solve_transpose(&mut y)
        } else {
            reference.solve(&mut y)
        }
        assert!(difference(&x, &y) < 1e-8);
    }
}

/// Right-hand sides far outside of the range of single precision.
#[test]
fn single_precision_factors_take_any_scale_of_right_hand_side() {
    let (a, _) = BRICK.reduced(3);
    let factors = MultifrontalSolver::new(Precision::F32).analyse_and_factorize(&a).unwrap();
    for scale in [1e-200, 1e150] {
        let b: Vec<f64> = Random(4).vector(a.n()).iter().map(|b| b * scale).collect();
        let mut x = vec![0.0; a.n()];
        let report = solve_verified(&a, factors.as_ref(), false, &b, &mut x, 1e-10).unwrap();
        assert!(report.iterations <= 8, "{report:?}");
    }
}

#[test]
fn factors_of_a_nearby_matrix_precondition() {
    let (a, _) = BRICK.reduced(5);
    let factors = MultifrontalSolver::new(Precision::F32).analyse_and_factorize(&a).unwrap();
    let mut nearby = a.clone();
    let mut random = Random(6);
    nearby.values.iter_mut().for_each(|v| *v *= 1.0 + 0.01 * random.next());
    let b = random.vector(a.n());
    for transpose in [false, true] {
        let mut x = vec![0.0; a.n()];
        let report = solve_verified(&nearby, factors.as_ref(), transpose, &b, &mut x, 1e-10).unwrap();
        assert!(report.relative_residual <= 1e-10 && report.iterations > 2);
        assert!(relative_residual(&nearby, transpose, &x, &b) <= 1e-10);
    }
}

/// From the solution no iteration is needed, from near it fewer than from nothing, from any other
/// start it is reached as well; the factors of A serve Aᵀ.
#[test]
fn a_given_start_is_used_and_does_no_harm() {
    let (a, _) = BRICK.reduced(5);
    let factors = MultifrontalFactorization::of(&a, Precision::F32).unwrap();
    let mut nearby = a.clone();
    let mut random = Random(6);
    nearby.values.iter_mut().for_each(|v| *v *= 1.0 + 0.01 * random.next());
    let b = random.vector(a.n());
    let mut exact = vec![0.0; a.n()];
    let options = SolveOptions::new(1e-10);
    let from_nothing = solve_with(&nearby, &factors, true, &b, &mut exact, &SolveOptions::new(1e-13)).unwrap();
    let mut x = exact.clone();
    assert_eq!(solve_from(&nearby, &factors, true, &b, &mut x, &options).unwrap().iterations, 0);
    x.iter_mut().zip(random.vector(a.n())).for_each(|(x, r)| *x *= 1.0 + 1e-6 * r);
    let start = relative_residual(&nearby, true, &x, &b);
    let from_near = solve_from(&nearby, &factors, true, &b, &mut x, &options).unwrap();
    assert!(from_near.iterations < from_nothing.iterations, "{from_near:?}, {from_nothing:?}");
    assert!((from_near.initial_residual / start - 1.0).abs() < 1e-6, "{from_near:?}, {start:e}");
    // the first solve with the factors is not counted as an iteration if there is no start
    assert_eq!(from_near.solves(), from_near.iterations);
    assert_eq!((from_nothing.initial_residual, from_nothing.solves()), (1.0, from_nothing.iterations + 1));
    let mut far: Vec<f64> = random.vector(a.n()).iter().map(|r| 1e3 * r).collect();
    solve_from(&nearby, &factors, true, &b, &mut far, &options).unwrap();
    assert!(relative_residual(&nearby, true, &far, &b) <= 1e-10);
    // a zero right-hand side gives zero whatever the start, and NaN is refused as a start
    solve_from(&nearby, &factors, true, &vec![0.0; a.n()], &mut far, &options).unwrap();
    assert!(far.iter().all(|x| *x == 0.0));
    far[3] = f64::NAN;
    assert_eq!(solve_from(&nearby, &factors, true, &b, &mut far, &options), Err(SolveError::NonFinite));
    // transposed twice, the factors of A solve with A itself
    let mut y = vec![0.0; a.n()];
    let swapped = solve_with(&a, &Transposed(&Transposed(&factors)), false, &b, &mut y, &options).unwrap();
    assert!(swapped.relative_residual <= 1e-10 && swapped.iterations <= 8);
}

/// Solved together, right-hand sides have the solutions that they have alone, up to the tolerance, in
/// fewer iterations: cold and warm starts, one that is zero, one that is refused, one that repeats
/// another, and one of another size.
#[test]
fn right_hand_sides_share_directions() {
    let (a, _) = BRICK.reduced(5);
    let mut nearby = a.clone();
    let mut random = Random(6);
    // factors that are wrong in a few directions, as after a change of contact
    for row in (0..12).map(|row| row * a.n() / 12) {
        let entries = nearby.pattern.row_range(row);
        nearby.values[entries].iter_mut().for_each(|v| *v *= 1.0 + 0.3 * random.next());
    }
    let options = SolveOptions::new(1e-10);
    for precision in [Precision::F32, Precision::F64] {
        let factors = MultifrontalFactorization::of(&a, precision).unwrap();
        for transpose in [false, true] {
            let mut rhs: Vec<Vec<f64>> = (0..6).map(|_| random.vector(a.n())).collect();
            rhs[1].fill(0.0);
            rhs[2][7] = f64::NAN;
            rhs[3].iter_mut().for_each(|b| *b *= 1e9);
            rhs[4] = rhs[0].clone();
            let cold = vec![vec![0.0; a.n()]; rhs.len()];
            let warm: Vec<Vec<f64>> = rhs.iter().map(|_| random.vector(a.n())).collect();
            for start in [cold, warm] {
                let sides: Vec<&[f64]> = rhs.iter().map(Vec::as_slice).collect();
                let mut together = start.clone();
                let reports = solve_many_from(&nearby, &factors, transpose, &sides, &mut together, &options);
                for k in [0, 3, 4, 5] {
                    let mut alone = start[k].clone();
                    let report = solve_from(&nearby, &factors, transpose, &rhs[k], &mut alone, &options).unwrap();
                    let shared = reports[k].as_ref().unwrap();
                    let measured = relative_residual(&nearby, transpose, &together[k], &rhs[k]);
                    assert!(measured <= 1e-10 && (measured - shared.relative_residual).abs() < 1e-14);
                    assert!(difference(&together[k], &alone) < 1e-7, "{k}: {:e}", difference(&together[k], &alone));
                    assert!(2 * shared.iterations <= report.iterations + 2, "{k}: {shared:?} {report:?}");
                }
                assert!(
                    together[1].iter().all(|&x| x == 0.0) && reports[1].as_ref().is_ok_and(|of| of.iterations == 0)
                );
                assert_eq!(reports[2], Err(SolveError::NonFiniteRightHandSide { index: Some(7) }));
            }
        }
    }
}

/// Factors of an unrelated matrix: no convergence, reported with the best iterate.
#[test]
fn hopeless_factors_are_reported() {
    let (a, _) = BRICK.reduced(7);
    let mut other = a.clone();
    let mut random = Random(8);
    other.values.iter_mut().for_each(|v| *v = *v * random.next() + 0.1 * random.next());
    let factors = SupernodalSolver::new().analyse_and_factorize(&other).unwrap();
    let b = random.vector(a.n());
    let mut x = vec![0.0; a.n()];
    let options = SolveOptions { tolerance: 1e-10, max_iterations: 5, restart: 5, alternative: None };
    match solve_with(&a, factors.as_ref(), false, &b, &mut x, &options) {
        Err(SolveError::NotConverged { report, tolerance }) => {
            assert_eq!(tolerance, 1e-10);
            let measured = relative_residual(&a, false, &x, &b);
            assert!((measured / report.relative_residual - 1.0).abs() < 1e-10);
        }
        other => panic!("{other:?}"),
    }
}

/// A tolerance below rounding: accepted because the backward error cannot be improved.
#[test]
fn a_tolerance_below_rounding_ends_at_the_attainable_accuracy() {
    let (a, _) = BRICK.reduced(9);
    let factors = MultifrontalSolver::new(Precision::F64).analyse_and_factorize(&a).unwrap();
    let b = Random(10).vector(a.n());
    let mut x = vec![0.0; a.n()];
    let report = solve_verified(&a, factors.as_ref(), false, &b, &mut x, 1e-30).unwrap();
    assert!(report.backward_error <= f64::EPSILON && report.iterations < 10, "{report:?}");
}

#[test]
fn bad_right_hand_sides_are_refused() {
    let (a, _) = Brick { nodes: [3, 3, 3], ..BRICK }.reduced(11);
    let factors = MultifrontalSolver::new(Precision::F64).analyse_and_factorize(&a).unwrap();
    let mut x = vec![0.0; a.n()];
    let mut b = vec![1.0; a.n()];
    b[4] = f64::NAN;
    let error = solve_verified(&a, factors.as_ref(), false, &b, &mut x, 1e-10);
    assert_eq!(error, Err(SolveError::NonFiniteRightHandSide { index: Some(4) }));
    let error = solve_verified(&a, factors.as_ref(), false, &b[1..], &mut x, 1e-10);
    assert!(matches!(error, Err(SolveError::Dimension { .. })));
    let zero = vec![0.0; a.n()];
    x.fill(f64::NAN);
    solve_verified(&a, factors.as_ref(), false, &zero, &mut x, 1e-10).unwrap();
    assert!(x.iter().all(|&x| x == 0.0));
}

/// A matrix that turns NaN after the factorization must not pass.
#[test]
fn a_matrix_with_nan_does_not_pass() {
    let (a, _) = Brick { nodes: [3, 3, 3], ..BRICK }.reduced(12);
    let factors = MultifrontalSolver::new(Precision::F64).analyse_and_factorize(&a).unwrap();
    let mut values = a.values.clone();
    values[7] = f64::NAN;
    let broken = CsrMatrix { pattern: a.pattern.clone(), values };
    let b = vec![1.0; a.n()];
    let mut x = vec![0.0; a.n()];
    let error = solve_verified(&broken, factors.as_ref(), false, &b, &mut x, 1e-10);
    assert_eq!(error, Err(SolveError::NonFinite));
}

/// Factors that have overflowed.
struct Overflowing(usize);

impl Factorization for Overflowing {
    fn solve(&self, rhs: &mut [f64]) {
        rhs.fill(f64::NAN);
    }

    fn solve_transpose(&self, rhs: &mut [f64]) {
        self.solve(rhs);
    }

    fn n(&self) -> usize {
        self.0
    }

    fn bytes(&self) -> usize {
        0
    }

    fn precision(&self) -> Precision {
        Precision::F64
    }
}

/// Neither alone nor together, from a start that is not the solution.
#[test]
fn factors_that_give_nan_do_not_pass() {
    let (a, _) = Brick { nodes: [3, 3, 3], ..BRICK }.reduced(12);
    let (mut random, options) = (Random(13), SolveOptions::new(1e-10));
    for count in [1, 2, 6] {
        let rhs: Vec<Vec<f64>> = (0..count).map(|_| random.vector(a.n())).collect();
        let mut x: Vec<Vec<f64>> = (0..count).map(|_| random.vector(a.n())).collect();
        let sides: Vec<&[f64]> = rhs.iter().map(Vec::as_slice).collect();
        let reports = solve_many_from(&a, &Overflowing(a.n()), false, &sides, &mut x, &options);
        assert!(reports.iter().all(|report| *report == Err(SolveError::NonFinite)), "{reports:?}");
    }
}

/// A body beside one of 10¹² times its stiffness, in other units: its part of the solution, found
/// by factors of single precision, is that of the body alone, found in double precision.
#[test]
fn soft_parts_beside_stiff_ones_are_solved_as_well() {
    let (soft, _) = Brick { multipliers: false, contrast: 1.0, ..BRICK }.reduced(1);
    let n = soft.n();
    let (offsets, columns, entries) = (soft.pattern.row_offsets(), soft.pattern.columns(), soft.values.len());
    let offsets = offsets.iter().copied().chain(offsets[1..].iter().map(|offset| offset + entries)).collect();
    let columns = [0, n].iter().flat_map(|first| columns.iter().map(|&j| j + *first as u32)).collect();
    let pattern = CsrPattern::new(offsets, columns, (0..2 * n as u32).collect(), vec![]).unwrap();
    let values = [1e12, 1.0].iter().flat_map(|factor| soft.values.iter().map(move |value| factor * value)).collect();
    let both = CsrMatrix { pattern: pattern.into(), values };
    let b = Random(3).vector(2 * n);
    let alone = SupernodalSolver::new().analyse_and_factorize(&soft).unwrap();
    let single = MultifrontalSolver::new(Precision::F32).analyse_and_factorize(&both).unwrap();
    for transpose in [false, true] {
        let mut x = vec![0.0; 2 * n];
        solve_verified(&both, single.as_ref(), transpose, &b, &mut x, 1e-10).unwrap();
        for (of_both, factor, b) in [(&x[..n], 1e12, &b[..n]), (&x[n..], 1.0, &b[n..])] {
            let mut expected = vec![0.0; n];
            solve_verified(&soft, alone.as_ref(), transpose, b, &mut expected, 1e-13).unwrap();
            let found: Vec<f64> = of_both.iter().map(|x| factor * x).collect();
            let error = difference(&found, &expected);
            assert!(error < 1e-10, "{factor:e}: {error:e}");
        }
    }
}

/// By hand: on a cyclic shift of 40 unknowns, the residual e₀ − e₁ cannot fall below 1 before the
/// 39th direction. So the iteration is given up as soon as its pace is seen, where that is asked
/// for.
#[test]
fn hopeless_iterations_are_given_up() {
    let n = 40;
    let matrix = |column: &dyn Fn(usize) -> usize| {
        let columns = (0..n).map(|i| column(i) as u32).collect();
        let pattern = CsrPattern::new((0..=n).collect(), columns, (0..n as u32).collect(), vec![]).unwrap();
        CsrMatrix { pattern: Arc::new(pattern), values: vec![1.0; n] }
    };
    let (shift, identity) = (matrix(&|i| (i + n - 1) % n), matrix(&|i| i));
    let factors = SupernodalSolver::new().analyse_and_factorize(&identity).unwrap();
    let mut b = vec![0.0; n];
    b[0] = 1.0;
    let alternative = Some(Alternative { preparation: 30.0, per_digit: 0.0 });
    for (alternative, most) in [(None, 30), (alternative, 6)] {
        let options = SolveOptions { tolerance: 1e-10, max_iterations: 30, restart: 30, alternative };
        let mut x = vec![0.0; n];
        match solve_with(&shift, factors.as_ref(), false, &b, &mut x, &options) {
            Err(SolveError::NotConverged { report, .. }) => {
                assert!(
                    report.iterations <= most && (alternative.is_some() || report.iterations == most),
                    "{report:?}"
                );
                assert!(report.relative_residual >= 1.0 - 1e-12, "{report:?}");
            }
            other => panic!("{other:?}"),
        }
    }
}

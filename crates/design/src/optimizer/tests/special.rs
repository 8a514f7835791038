//! Optima known by hand, multipliers and residuals.

use super::*;

/// Both residuals decrease with the distance from the optimum, and the check of the notes detects a
/// wrong design.
#[test]
fn kkt_residual_vanishes_at_the_optimum_only() {
    let parameters = tight();
    let residual_after = |steps| {
        let result = run(two_balls, &[4.0, 3.0, 2.0], (0.0, 5.0), parameters, steps);
        let (_, gradient, constraints, constraint_gradients) = two_balls(&result.x);
        let (lower, upper) = ([0.0; 3], [5.0; 3]);
        kkt_residual(
            &parameters,
            &result.last,
            [&lower, &upper],
            &Functions::new(0.0, &gradient, &constraints, &constraint_gradients),
        )
        .unwrap()
    };
    let residuals = [1, 8, 30].map(|steps| residual_after(steps).norm);
    assert!(residuals[0] > 1e-1 && residuals[1] < 0.1 * residuals[0] && residuals[2] < 1e-8, "{residuals:?}");
}

/// Without constraints and with an optimum at the bounds: min Σ (−1)ʲ x_j.
#[test]
fn no_constraints_and_optimum_at_the_bounds() {
    let functions = |x: &[f64]| -> Evaluated {
        let gradient = vec![1.0, -1.0, 1.0, -1.0];
        (x.iter().zip(&gradient).map(|(x, g)| x * g).sum(), gradient, vec![], vec![])
    };
    let result = run(functions, &[0.5; 4], (0.0, 1.0), tight(), 20);
    for (value, expected) in result.x.iter().zip([0.0, 1.0, 0.0, 1.0]) {
        assert!((value - expected).abs() < 1e-8);
    }
    assert!(result.last.kkt_residual.max < 1e-7);
}

/// An infeasible problem is solved elastically: `y` is the violation, λ its penalty `c + d y`.
#[test]
fn infeasible_constraints_show_in_y() {
    let functions = |x: &[f64]| -> Evaluated { (x[0], vec![1.0], vec![2.0 - x[0]], vec![vec![-1.0]]) };
    let result = run(functions, &[0.5], (0.0, 1.0), tight(), 20);
    assert!((result.x[0] - 1.0).abs() < 1e-8);
    assert!((result.last.y[0] - 1.0).abs() < 1e-6);
    assert!((result.last.lambda[0] - 1001.0).abs() < 1e-5);
}

/// The largest of two lines: the solution is their intersection, x = 0.25 and z = 0.75 plus any
/// offset of both, also below 0; their multipliers are both 0.5. A constraint x ≥ 0.4 keeps its own
/// bound: z = 0.9 is the second line there, which counts alone, and the constraint's multiplier is
/// its slope.
#[test]
fn smallest_largest_value() {
    for offset in [0.0, -100.0] {
        let functions = |x: &[f64]| -> Evaluated {
            (0.0, vec![0.0], vec![offset + 1.0 - x[0], offset + 0.5 + x[0]], vec![vec![-1.0], vec![1.0]])
        };
        let Run { x, last } = run_with_largest(2, functions, &[0.9], (0.0, 1.0), tight(), 60);
        assert!((x[0] - 0.25).abs() < 1e-7 && (last.z - offset - 0.75).abs() < 1e-7, "{x:?} {}", last.z);
        assert!(last.lambda.iter().all(|lambda| (lambda - 0.5).abs() < 1e-6) && last.kkt_residual.max < 1e-6);
        let bounded = |x: &[f64]| -> Evaluated {
            let (f, df, mut g, mut dg) = functions(x);
            g.push(0.4 - x[0]);
            dg.push(vec![-1.0]);
            (f, df, g, dg)
        };
        let Run { x, last } = run_with_largest(2, bounded, &[0.9], (0.0, 1.0), tight(), 60);
        assert!((x[0] - 0.4).abs() < 1e-7 && (last.z - offset - 0.9).abs() < 1e-7, "{x:?} {}", last.z);
        for (found, exact) in last.lambda.iter().zip([0.0, 1.0, 1.0]) {
            assert!((found - exact).abs() < 1e-6, "{:?}", last.lambda);
        }
    }
}

/// A third function of −1, far below the two lines, is inactive: its slack is the difference to z =
/// 0.75, computed by hand as 1.75, and its multiplier is 0.
#[test]
fn slack_is_what_is_left_to_the_largest_value() {
    let functions = |x: &[f64]| -> Evaluated {
        (0.0, vec![0.0], vec![1.0 - x[0], 0.5 + x[0], -1.0], vec![vec![-1.0], vec![1.0], vec![0.0]])
    };
    let last = run_with_largest(3, functions, &[0.9], (0.0, 1.0), tight(), 60).last;
    let MmaStep { slack, lambda, kkt_residual, .. } = last;
    for (found, exact) in slack.iter().zip([0.0, 0.0, 1.75]) {
        assert!((found - exact).abs() < 1e-7, "{slack:?}");
    }
    assert!(lambda[2] < 1e-8 && kkt_residual.max < 1e-7, "{lambda:?} {kkt_residual:?}");
}

#[test]
fn fixed_variables_stay_and_count() {
    // min x₀ + x₁ with x₀ x₁ ≥ 4 and x₁ fixed at 2.5: x₀ = 1.6.
    let mut mma = Mma::new(2, 1, tight());
    let mut x = vec![3.0, 2.5];
    for _ in 0..40 {
        let gradients = [vec![-x[1], -x[0]]];
        let value = 4.0 - x[0] * x[1];
        let step = mma
            .update(&x, [&[1.0, 2.5], &[5.0, 2.5]], &Functions::new(x[0] + 2.5, &[1.0; 2], &[value], &gradients))
            .unwrap();
        assert_eq!(step.x[1], 2.5);
        x = step.x;
    }
    assert!((x[0] - 1.6).abs() < 1e-8);
}

/// A zero objective gradient leaves the design unchanged; it is not an error if all variables are
/// fixed.
#[test]
fn nothing_to_do() {
    let x = [0.3, 0.6];
    let zero = vec![vec![0.0; 2]];
    let step = Mma::new(2, 1, tight())
        .update(&x, [&[0.0; 2], &[1.0; 2]], &Functions::new(1.0, &[0.0; 2], &[-1.0], &zero))
        .unwrap();
    assert!((0..2).all(|j| (step.x[j] - x[j]).abs() < 1e-5), "{:?}", step.x);
    let step = Mma::new(2, 1, tight()).update(&x, [&x, &x], &Functions::new(1.0, &[1.0; 2], &[-1.0], &zero)).unwrap();
    assert_eq!(step.x, x);
}

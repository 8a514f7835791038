//! Scaling and many variables.

use super::*;

/// Volume-constrained compliance of `n` springs in series, min Σ a_j/x_j³ with mean 0.3: by
/// Lagrange's rule, x_j ∝ a_j^¼ if no bound is active. Gradients of size 1/n make it a test of
/// [`Scaling`] too.
pub(super) fn springs(n: usize) -> (impl Fn(&[f64]) -> Evaluated, Vec<f64>) {
    let stiffness: Vec<f64> = (0..n).map(|j| 1.0 + ((j * 7919) % 1009) as f64 / 1009.0).collect();
    let mean = stiffness.iter().map(|a| a.powf(0.25)).sum::<f64>() / n as f64;
    let optimum = stiffness.iter().map(|a| 0.3 * a.powf(0.25) / mean).collect();
    let functions = move |x: &[f64]| -> Evaluated {
        let value = (0..n).map(|j| stiffness[j] / x[j].powi(3)).sum();
        let gradient = (0..n).map(|j| -3.0 * stiffness[j] / x[j].powi(4)).collect();
        let volume = x.iter().sum::<f64>() / (0.3 * n as f64) - 1.0;
        (value, gradient, vec![volume], vec![vec![1.0 / (0.3 * n as f64); n]])
    };
    (functions, optimum)
}

/// A hundred thousand variables, gradients of the volume below `raa0` before scaling: close to the
/// analytic optimum after a few steps, and subproblems take no more Newton iterations than in small
/// problems.
#[test]
fn large_problem() {
    let n = 100_000;
    let (functions, optimum) = springs(n);
    let (lower, upper) = (vec![0.0; n], vec![1.0; n]);
    let mut mma = Mma::new(n, 1, MmaParameters { move_limit: 0.1, ..MmaParameters::default() });
    let mut x = vec![0.3; n];
    let (_, gradient, _, constraint_gradients) = functions(&x);
    assert!(constraint_gradients[0][0] < 4e-5);
    let mut scaling = Scaling::new(constraint_gradients.len());
    scaling.learn(&gradient, &constraint_gradients);
    for _ in 0..6 {
        let (value, gradient, constraints, constraint_gradients) = functions(&x);
        let (value, gradient) = scaling.scale_objective(value, &gradient);
        let (constraints, gradients) = scaling.scale_constraints(&constraints, &constraint_gradients);
        let step =
            mma.update(&x, [&lower, &upper], &Functions::new(value, &gradient, &constraints, &gradients)).unwrap();
        assert!(step.subproblem_iterations < 60, "{}", step.subproblem_iterations);
        x = step.x;
    }
    let distance = |(x, optimum): (&f64, &f64)| (x - optimum).abs();
    let error = x.iter().zip(&optimum).map(distance).fold(0.0, f64::max);
    assert!(error < 2e-4, "{error:e}");
}

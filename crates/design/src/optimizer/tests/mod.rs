//! Compares MMA with published results; also contains problems that the other tests share.

mod dual;
mod equality;
mod gcmma;
mod input;
mod large;
mod random;
mod special;
mod svanberg;

use super::*;
use slipstick_ranks::threads::on_ranks;
use slipstick_ranks::{Alone, Ranks};

/// Value and gradient of the objective, values and gradients of the constraints.
type Evaluated = (f64, Vec<f64>, Vec<f64>, Vec<Vec<f64>>);

/// Svanberg's first example: the point of two overlapping balls that is nearest to the origin.
fn two_balls(x: &[f64]) -> Evaluated {
    let centres = [[5.0, 2.0, 1.0], [3.0, 4.0, 3.0]];
    let squared = |c: [f64; 3]| (0..3).map(|j| (x[j] - c[j]).powi(2)).sum::<f64>();
    let gradient = |c: [f64; 3]| (0..3).map(|j| 2.0 * (x[j] - c[j])).collect();
    (squared([0.0; 3]), gradient([0.0; 3]), centres.map(|c| squared(c) - 9.0).to_vec(), centres.map(gradient).to_vec())
}

/// Svanberg's cantilever of five hollow beams: weight subject to a tip displacement.
fn cantilever(x: &[f64]) -> Evaluated {
    let coefficients = [61.0, 37.0, 19.0, 7.0, 1.0];
    let displacement = (0..5).map(|j| coefficients[j] / x[j].powi(3)).sum::<f64>() - 1.0;
    let gradient = (0..5).map(|j| -3.0 * coefficients[j] / x[j].powi(4)).collect();
    (0.0624 * x.iter().sum::<f64>(), vec![0.0624; 5], vec![displacement], vec![gradient])
}

struct Run {
    x: Vec<f64>,
    last: MmaStep,
}

fn run(
    functions: impl Fn(&[f64]) -> Evaluated,
    start: &[f64],
    bounds: (f64, f64),
    parameters: MmaParameters,
    steps: usize,
) -> Run {
    run_with_largest(0, functions, start, bounds, parameters, steps)
}

/// As [`run`], with the largest of the first `largest_of` constraints minimized.
fn run_with_largest(
    largest_of: usize,
    functions: impl Fn(&[f64]) -> Evaluated,
    start: &[f64],
    bounds: (f64, f64),
    parameters: MmaParameters,
    steps: usize,
) -> Run {
    let (lower, upper) = (vec![bounds.0; start.len()], vec![bounds.1; start.len()]);
    let m = functions(start).2.len();
    let mut mma = Mma::new(start.len(), m, parameters);
    let mut x = start.to_vec();
    let mut last = None;
    for _ in 0..steps {
        let (value, gradient, constraints, constraint_gradients) = functions(&x);
        let functions = Functions::new(value, &gradient, &constraints, &constraint_gradients);
        let step = mma.update(&x, [&lower, &upper], &functions.minimising_the_largest_of(largest_of)).unwrap();
        x = step.x.clone();
        last = Some(step);
    }
    Run { x, last: last.unwrap() }
}

/// Five variables and one constraint on one to seven ranks, some of which have no variables: the
/// results agree up to the order of sums, and are the same on all ranks bit for bit.
#[test]
fn ranks_update_as_one_does() {
    let steps = |ranks: &dyn Ranks| {
        let mut mma = Mma::new(5, 1, tight());
        let mut x = vec![5.0; 5];
        let mut last = None;
        for _ in 0..8 {
            let (f, df, g, dg) = cantilever(&x);
            let step = mma.update_on(&x, [&[1.0; 5], &[10.0; 5]], &Functions::new(f, &df, &g, &dg), ranks).unwrap();
            x = step.x.clone();
            last = Some(step);
        }
        (mma, last.unwrap())
    };
    let (_, alone) = steps(&Alone);
    for size in [2, 3, 7] {
        let all = on_ranks(size, |rank| steps(&rank));
        for (mma, step) in &all {
            assert!(*mma == all[0].0 && step.x == all[0].1.x);
            assert_eq!((step.xi.len(), step.eta.len(), mma.asymptotes().0.len()), (5, 5, 5));
            assert!(step.x.iter().zip(&alone.x).all(|(a, b)| (a - b).abs() < 1e-9));
            assert!((step.lambda[0] - alone.lambda[0]).abs() < 1e-9);
            assert!((step.kkt_residual.norm - alone.kkt_residual.norm).abs() < 1e-9);
        }
    }
}

fn tight() -> MmaParameters {
    MmaParameters { subproblem_tolerance: 1e-11, ..MmaParameters::default() }
}

fn assert_printed(values: &[f64], printed: &[f64]) {
    for (value, printed) in values.iter().zip(printed) {
        assert!((value - printed).abs() <= 0.5001e-8, "{value:.10} instead of {printed}");
    }
}

/// Published optimum, to the digits printed.
#[test]
fn two_balls_to_the_printed_digits() {
    let result = run(two_balls, &[4.0, 3.0, 2.0], (0.0, 5.0), tight(), 30);
    assert_printed(&result.x, &[2.01751859, 1.78001144, 1.23750715]);
    assert_printed(&[two_balls(&result.x).0], &[8.77024590]);
    assert!(result.last.kkt_residual.max < 1e-8);
}

/// Published optimum, to the digits printed.
#[test]
fn cantilever_to_the_printed_digits() {
    let result = run(cantilever, &[5.0; 5], (1.0, 10.0), tight(), 40);
    assert_printed(&result.x, &[6.01601589, 5.30917386, 4.49432957, 3.50147497, 2.15266533]);
    assert_printed(&[cantilever(&result.x).0], &[1.33995636]);
}

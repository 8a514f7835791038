//! The iterative solver on a whole path with friction, compared with the direct one and with finite
//! differences.

mod common;

use common::random_density;
use slipstick::build::{Problem, build};
use slipstick::case::parse_case;
use slipstick::design::ElementValues;
use slipstick::path::Silent;

/// The half-ball that is pressed into the plate and slid, with 10,000 unknowns in two parts, and the
/// first three of its load steps.
fn problem(linear: &str) -> Problem {
    let text = include_str!("../../../docs/performance/half_ball.toml")
        .replace("[14, 3, 14]", "[20, 4, 20]")
        .replace("[10, 2, 1]", "[14, 3, 1]")
        .replace("\"schwarz\"", linear);
    let mut problem = build(&parse_case(&text, "half_ball.toml").expect("a valid case").case).expect("a problem");
    problem.analysis.times.truncate(3);
    problem
}

fn value(problem: &mut Problem, density: &ElementValues) -> f64 {
    problem.analysis.forward(density, &mut Silent).expect("a path").value
}

fn size(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Sources: the direct solver, and a central difference in the direction of the gradient. Steps converge
/// to 1e-8, so values agree to about that; a difference quotient has half of the digits.
#[test]
fn values_and_gradients_are_those_of_the_direct_solver() {
    let mut direct = problem("\"auto\"");
    let mut iterative = problem("\"schwarz\"");
    let density = random_density(&direct, 5);
    let [expected, found] = [&mut direct, &mut iterative].map(|problem| {
        let forward = problem.analysis.forward(&density, &mut Silent).expect("a path");
        let gradient = problem.analysis.gradient(&forward).expect("a gradient");
        (forward.value, gradient)
    });
    println!("{:?} {:?}", expected.0, found.0);
    assert!((found.0 / expected.0 - 1.0).abs() < 1e-8);
    let difference: Vec<f64> = expected.1.iter().zip(found.1.iter()).map(|(a, b)| a - b).collect();
    println!("{:e} of {:e}", size(&difference), size(&expected.1));
    assert!(size(&difference) < 1e-6 * size(&expected.1));
    let step = 1e-4 / size(&found.1);
    let moved = |sign: f64| -> ElementValues {
        density.iter().zip(found.1.iter()).map(|(phi, g)| phi + sign * step * g).collect()
    };
    let (ahead, behind) = (moved(1.0), moved(-1.0));
    let quotient = (value(&mut iterative, &ahead) - value(&mut iterative, &behind)) / (2.0 * step);
    let slope = found.1.iter().map(|g| g * g).sum::<f64>();
    println!("{quotient:e} {slope:e}");
    assert!((quotient / slope - 1.0).abs() < 1e-4);
}

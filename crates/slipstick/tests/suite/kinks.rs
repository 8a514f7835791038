//! The remainder of a gradient is of second order, except at kinks.

use super::gradient::*;
use crate::common::scene::*;
use crate::common::*;
use slipstick::design::ElementValues;

/// θ(φ + h v) − θ(φ) − h g·v falls with h².
#[test]
fn taylor_remainder_is_of_second_order() {
    for (method, enforcement) in methods() {
        let mut problem = problem(&Scene { enforcement, ..Scene::default() }.text());
        let density = random_density(&problem, 8);
        let base = forward(&mut problem, &density);
        let statuses = status_path(&mut problem, &base);
        let gradient = problem.analysis.gradient(&base).unwrap();
        let direction = Random::new(1).vector(density.len(), 1.0);
        let slope: f64 = gradient.iter().zip(&direction).map(|(g, v)| g * v).sum();
        let remainders: Vec<f64> = (0..5)
            .map(|k| {
                let h = 1e-2 * 0.5f64.powi(k);
                let moved: ElementValues = density.iter().zip(&direction).map(|(x, v)| x + h * v).collect();
                let run = forward(&mut problem, &moved);
                assert_eq!(status_path(&mut problem, &run), statuses, "{method}: a kink lies within h = {h}");
                (run.value - base.value - h * slope).abs()
            })
            .collect();
        println!("{method}: remainders {remainders:?}");
        for pair in remainders.windows(2) {
            let order = (pair[0] / pair[1]).log2();
            assert!((order - 2.0).abs() < 0.1, "{method}: order {order} in {remainders:?}");
        }
    }
}

/// If a node changes its status within ±h, central differences are wrong and the active sets show
/// it; the adjoint is the derivative on the side on which it was computed.
#[test]
fn a_kink_is_recognised_by_its_active_sets() {
    let mut problem = problem(&Scene { friction: 0.5, ..Scene::default() }.text());
    let start = random_density(&problem, 13);
    let along = designed(&problem)[1];
    let at = |shift: f64| {
        let mut moved = start.clone();
        moved[along] += shift;
        moved
    };
    let mut run = |shift: f64| {
        let run = forward(&mut problem, &at(shift));
        (run.value, status_path(&mut problem, &run))
    };
    // bisection for a change of status along one design variable
    let first = run(-0.2).1;
    let (mut low, mut high) = (-0.2, (1..=20).map(|k| -0.2 + 0.02 * k as f64).find(|&s| run(s).1 != first).unwrap());
    while high - low > 1e-8 {
        let middle = 0.5 * (low + high);
        if run(middle).1 == first { low = middle } else { high = middle }
    }
    let h = 1e-3;
    let here = low - 1e-6;
    let (centre, left, far, right) = (run(here), run(here - h), run(here - 2.0 * h), run(here + h));
    assert_eq!(centre.1, left.1);
    assert_ne!(centre.1, right.1, "the change lies within the step");
    let central = (right.0 - left.0) / (2.0 * h);
    let third = run(here - 3.0 * h);
    let one_sided = (11.0 * centre.0 - 18.0 * left.0 + 9.0 * far.0 - 2.0 * third.0) / (6.0 * h);
    let base = forward(&mut problem, &at(here));
    let adjoint = problem.analysis.gradient(&base).unwrap()[along];
    println!("kink at {low}: adjoint {adjoint}, one-sided {one_sided}, central {central}");
    assert!((one_sided / adjoint - 1.0).abs() < 1e-5, "{one_sided} {adjoint}");
    assert!((central / adjoint - 1.0).abs() > 1e-4, "{central} {adjoint}: no kink to see");
}

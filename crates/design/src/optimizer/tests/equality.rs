//! Equalities, as two bounds on one function, and narrow bands. Expected optima from Lagrange
//! multipliers, by hand.

use super::*;

/// A function and its gradient.
type Function = fn(&[f64]) -> (f64, Vec<f64>);

/// `min f(x)` subject to `−w ≤ h(x) ≤ 0`, between the same bounds for all variables.
struct Problem {
    objective: Function,
    bounded: Function,
    band: f64,
    bounds: (f64, f64),
    start: &'static [f64],
}

impl Problem {
    fn evaluate(&self, x: &[f64]) -> Evaluated {
        let (f, df) = (self.objective)(x);
        let (h, dh) = (self.bounded)(x);
        let other = dh.iter().map(|slope| -slope).collect();
        (f, df, vec![h, -h - self.band], vec![dh, other])
    }

    /// The design after some iterations, and its h.
    fn solve(&self, method: Method, iterations: usize, ranks: &dyn Ranks) -> (Vec<f64>, f64) {
        let n = self.start.len();
        let (lower, upper) = (vec![self.bounds.0; n], vec![self.bounds.1; n]);
        let bounds: [&[f64]; 2] = [&lower, &upper];
        let mut optimizer = Optimizer::new(method, n, 2, MmaParameters::for_densities());
        let mut x = self.start.to_vec();
        for _ in 0..iterations {
            let (f, df, g, dg) = self.evaluate(&x);
            x = optimizer.update(&x, bounds, &Functions::new(f, &df, &g, &dg), ranks).unwrap().x;
            let judge = |optimizer: &mut Optimizer, x: &[f64]| {
                let (f, _, g, _) = self.evaluate(x);
                optimizer.judge(x, bounds, f, &g, ranks).unwrap()
            };
            while let Judgement::Rejected(next) = judge(&mut optimizer, &x) {
                x = next.x;
            }
        }
        let h = (self.bounded)(&x).0;
        (x, h)
    }
}

const METHODS: [Method; 2] = [Method::Mma, Method::Gcmma { inner_iterations: Method::INNER_ITERATIONS }];

/// Σ c_j²/x_j
fn compliance(x: &[f64]) -> (f64, Vec<f64>) {
    let c = [1.0, 2.0, 3.0, 6.0];
    (c.iter().zip(x).map(|(c, x)| c * c / x).sum(), c.iter().zip(x).map(|(c, x)| -c * c / (x * x)).collect())
}

/// Σ x_j − 1.2
fn volume(x: &[f64]) -> (f64, Vec<f64>) {
    (x.iter().sum::<f64>() - 1.2, vec![1.0; x.len()])
}

/// A volume that is prescribed: x_j ∝ c_j. It is kept in every iteration, not only at the end.
#[test]
fn a_prescribed_volume_does_not_block_the_design() {
    for method in METHODS {
        let problem =
            |band| Problem { objective: compliance, bounded: volume, band, bounds: (0.01, 1.0), start: &[0.3; 4] };
        for band in [0.0, 1e-6, 1e-3] {
            let (x, h) = problem(band).solve(method, 30, &Alone);
            let best = [0.1, 0.2, 0.3, 0.6];
            assert!(x.iter().zip(best).all(|(x, best)| (x - best).abs() < 2e-3), "{method:?} {band}: {x:?}");
            assert!(h.abs() < 1e-6, "{method:?} {band}: {h}");
        }
        for iterations in 1..6 {
            let (x, h) = problem(0.0).solve(method, iterations, &Alone);
            assert!(h.abs() < 1e-6, "{method:?} {iterations}: {h}");
            assert!(compliance(&x).0 < 166.0 - 4.0 * iterations as f64, "{method:?} {iterations}: {x:?}");
        }
    }
}

/// An equality whose lower side acts, and which is not linear: x₁x₂ = 1 with the least Σ x_j².
#[test]
fn a_prescribed_product() {
    let problem = Problem {
        objective: |x| (x[0] * x[0] + x[1] * x[1], vec![2.0 * x[0], 2.0 * x[1]]),
        bounded: |x| (x[0] * x[1] - 1.0, vec![x[1], x[0]]),
        band: 0.0,
        bounds: (0.1, 4.0),
        start: &[3.0, 1.0 / 3.0],
    };
    for method in METHODS {
        let (x, h) = problem.solve(method, 40, &Alone);
        assert!((x[0] - 1.0).abs() < 1e-3 && (x[1] - 1.0).abs() < 1e-3, "{method:?}: {x:?}");
        assert!(h.abs() < 1e-4, "{method:?}: {h}");
    }
}

/// The upper side acts, from a start that does not meet it: the lowest point of the unit circle in
/// the direction (1, 2).
#[test]
fn a_point_on_a_circle() {
    let problem = Problem {
        objective: |x| (x[0] + 2.0 * x[1], vec![1.0, 2.0]),
        bounded: |x| (x[0] * x[0] + x[1] * x[1] - 1.0, vec![2.0 * x[0], 2.0 * x[1]]),
        band: 0.0,
        bounds: (-2.0, 2.0),
        start: &[1.5, -0.5],
    };
    for method in METHODS {
        let (x, h) = problem.solve(method, 40, &Alone);
        let best = [-1.0 / 5.0f64.sqrt(), -2.0 / 5.0f64.sqrt()];
        assert!((x[0] - best[0]).abs() < 2e-3 && (x[1] - best[1]).abs() < 2e-3, "{method:?}: {x:?}");
        assert!(h.abs() < 1e-4, "{method:?}: {h}");
    }
}

/// Ranks agree up to the order of sums, and are the same bit for bit.
#[test]
fn equalities_on_several_ranks() {
    let problem = Problem { objective: compliance, bounded: volume, band: 0.0, bounds: (0.01, 1.0), start: &[0.3; 4] };
    let alone = problem.solve(Method::Mma, 8, &Alone);
    for size in [2, 3] {
        let all = on_ranks(size, |rank| problem.solve(Method::Mma, 8, &rank));
        assert!(all.iter().all(|one| *one == all[0]));
        assert!(all[0].0.iter().zip(&alone.0).all(|(a, b)| (a - b).abs() < 1e-7));
    }
}

//! Invariants on random problems.

use proptest::prelude::*;

use super::*;

/// A random problem: convex quadratic objective, linear constraints.
#[derive(Clone, Debug)]
struct RandomProblem {
    target: Vec<f64>,
    weight: Vec<f64>,
    rows: Vec<Vec<f64>>,
    limit: Vec<f64>,
}

impl RandomProblem {
    fn functions(&self, x: &[f64]) -> Evaluated {
        let n = x.len();
        let value = (0..n).map(|j| self.weight[j] * (x[j] - self.target[j]).powi(2)).sum();
        let gradient = (0..n).map(|j| 2.0 * self.weight[j] * (x[j] - self.target[j])).collect();
        let dot = |row: &[f64]| row.iter().zip(x).map(|(a, x)| a * x).sum::<f64>();
        let constraints = self.rows.iter().zip(&self.limit).map(|(row, limit)| dot(row) - limit).collect();
        (value, gradient, constraints, self.rows.clone())
    }

    fn reversed(&self) -> Self {
        let reverse = |values: &[f64]| values.iter().rev().copied().collect::<Vec<_>>();
        Self {
            target: reverse(&self.target),
            weight: reverse(&self.weight),
            rows: self.rows.iter().map(|row| reverse(row)).collect(),
            limit: self.limit.clone(),
        }
    }
}

fn random_problem() -> impl Strategy<Value = RandomProblem> {
    (1..12_usize, 0..4_usize).prop_flat_map(|(n, m)| {
        (
            prop::collection::vec(-0.5..1.5_f64, n),
            prop::collection::vec(0.0..10.0_f64, n),
            prop::collection::vec(prop::collection::vec(-1.0..1.0_f64, n), m),
            prop::collection::vec(-0.2..1.0_f64, m),
        )
            .prop_map(|(target, weight, rows, limit)| RandomProblem { target, weight, rows, limit })
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn iterates_keep_bounds_and_move_limit(problem in random_problem(), move_limit in 0.01..1.0_f64) {
        let n = problem.target.len();
        let mut mma = Mma::new(n, problem.limit.len(), MmaParameters { move_limit, ..MmaParameters::default() });
        let mut x = vec![0.4; n];
        for _ in 0..12 {
            let (value, gradient, constraints, rows) = problem.functions(&x);
            let step = mma.update(&x, [&vec![0.0; n], &vec![1.0; n]], &Functions::new(value, &gradient, &constraints, &rows)).unwrap();
            let (low, upp) = mma.asymptotes();
            for j in 0..n {
                prop_assert!((0.0..=1.0).contains(&step.x[j]));
                prop_assert!((step.x[j] - x[j]).abs() <= move_limit * (1.0 + 1e-12));
                prop_assert!(low[j] < step.x[j] && step.x[j] < upp[j]);
            }
            prop_assert!(step.lambda.iter().all(|lambda| *lambda >= 0.0));
            prop_assert!(step.subproblem_residual <= 1e-7);
            x = step.x;
        }
    }

    #[test]
    fn order_of_variables_does_not_matter(problem in random_problem()) {
        let n = problem.target.len();
        let start: Vec<f64> = (0..n).map(|j| 0.2 + 0.5 * j as f64 / n as f64).collect();
        let backward: Vec<f64> = start.iter().rev().copied().collect();
        let ordered = run(|x| problem.functions(x), &start, (0.0, 1.0), tight(), 6);
        let reversed = problem.reversed();
        let reversed = run(|x| reversed.functions(x), &backward, (0.0, 1.0), tight(), 6);
        for j in 0..n {
            prop_assert!((ordered.x[j] - reversed.x[n - 1 - j]).abs() < 1e-7);
        }
    }

    /// Strictly convex and without constraints: the optimum is the target, projected onto the
    /// bounds. Without a constraint that determines it, an interior optimum is reached up to the
    /// smallest distance of the asymptotes, 0.01.
    #[test]
    fn finds_the_projected_target(target in prop::collection::vec(-0.5..1.5_f64, 1..8)) {
        let n = target.len();
        let problem = RandomProblem { weight: vec![1.0; n], rows: vec![], limit: vec![], target };
        let result = run(|x| problem.functions(x), &vec![0.5; n], (0.0, 1.0), tight(), 60);
        for j in 0..n {
            prop_assert!((result.x[j] - problem.target[j].clamp(0.0, 1.0)).abs() < 0.01);
        }
    }
}

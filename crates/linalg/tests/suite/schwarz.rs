//! The Schwarz preconditioner on model problems with multipliers.

use crate::common::{Brick, Random, difference};
use slipstick_linalg::{
    Backend, CsrMatrix, Factorization, FactorizationError, LinearSolver, MultifrontalFactorization, Nodes, Precision,
    Schwarz, SchwarzSolver, SolveOptions, solve_verified, solve_with,
};

/// 27 000 unknowns in about ten parts, with sticking and open nodes on the top and stiffness over three decades.
fn brick() -> Brick {
    Brick { nodes: [20, 21, 22], multipliers: true, contrast: 3.0, nonsymmetry: 0.05, fixed_bottom: true }
}

fn nodes(brick: &Brick) -> Nodes {
    let [nx, ny, nz] = brick.nodes;
    let place = |node: usize| [node % nx, node / nx % ny, node / (nx * ny)].map(|i| i as f64);
    let coordinates: Vec<[f64; 3]> = (0..nx * ny * nz).map(place).collect();
    Nodes { bodies: vec![Some(0); coordinates.len()].into(), coordinates: coordinates.into() }
}

fn factors(brick: &Brick, a: &CsrMatrix) -> Box<dyn Factorization> {
    SchwarzSolver::new(nodes(brick)).analyse_and_factorize(a).expect("a regular matrix")
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Source: the direct solver in double precision. The number of iterations is that of a good
/// preconditioner; without the coarse space or with the wrong transpose it is beyond.
#[test]
fn solutions_are_those_of_the_direct_solver() {
    let brick = brick();
    let (a, _) = brick.reduced(1);
    let factors = factors(&brick, &a);
    let direct = MultifrontalFactorization::of(&a, Precision::F64).expect("a regular matrix");
    let b = Random(3).vector(a.n());
    for transpose in [false, true] {
        let (mut x, mut expected) = (vec![0.0; a.n()], vec![0.0; a.n()]);
        let options = SolveOptions { max_iterations: 60, ..SolveOptions::new(1e-10) };
        let report = solve_with(&a, factors.as_ref(), transpose, &b, &mut x, &options).expect("it converges");
        solve_verified(&a, &direct, transpose, &b, &mut expected, 1e-12).expect("direct factors");
        println!("{} iterations", report.iterations);
        assert!(difference(&x, &expected) < 1e-7, "{}", difference(&x, &expected));
    }
}

/// A matrix with other values in a corner of the top two layers, where the multipliers are: with what is kept of the
/// preconditioner of the earlier matrix, solutions are those of the direct solver, and take about as
/// many iterations as with a new preconditioner.
#[test]
fn a_preconditioner_follows_changes_near_contact() {
    let brick = brick();
    let (a, _) = brick.reduced(1);
    let mut solver = SchwarzSolver::new(nodes(&brick));
    let symbolic = solver.analyse(&a.pattern).expect("an analysis");
    solver.factorize(&symbolic, &a).expect("a regular matrix");
    let [nx, ny, nz] = brick.nodes;
    let in_corner = |node: usize| node % nx < 6 && node / nx % ny < 6 && node / (nx * ny) + 2 >= nz;
    let mut changed = a.clone();
    for row in (0..a.n()).filter(|&row| in_corner(a.pattern.groups()[row] as usize)) {
        let place = a.pattern.row_range(row);
        let diagonal = place.clone().zip(a.pattern.row(row)).find(|(_, column)| **column as usize == row);
        // multipliers have none
        if let Some((k, _)) = diagonal {
            let sum: f64 = a.values[place].iter().map(|x| x.abs()).sum();
            changed.values[k] += sum * f64::from(row as u32 % 3);
        }
    }
    let factors = solver.factorize(&symbolic, &changed).expect("a regular matrix");
    let anew = self::factors(&brick, &changed);
    let direct = MultifrontalFactorization::of(&changed, Precision::F64).expect("a regular matrix");
    let b = Random(3).vector(a.n());
    let once = |factors: &dyn Factorization| {
        let mut x = b.clone();
        factors.solve(&mut x);
        x
    };
    assert!(once(factors.as_ref()) != once(anew.as_ref()), "nothing is kept");
    for transpose in [false, true] {
        let mut expected = vec![0.0; a.n()];
        solve_verified(&changed, &direct, transpose, &b, &mut expected, 1e-12).expect("direct factors");
        let iterations = [&factors, &anew].map(|factors| {
            let mut x = vec![0.0; a.n()];
            let options = SolveOptions { max_iterations: 60, ..SolveOptions::new(1e-10) };
            let report = solve_with(&changed, factors.as_ref(), transpose, &b, &mut x, &options).expect("it converges");
            assert!(difference(&x, &expected) < 1e-7, "{}", difference(&x, &expected));
            report.iterations
        });
        println!("{iterations:?} iterations");
        assert!(iterations[0] <= iterations[1] + 3, "{iterations:?}");
    }
}

/// By definition: ⟨M⁻¹ x, y⟩ = ⟨x, M⁻ᵀ y⟩, to the single precision of the factors.
#[test]
fn the_transposed_preconditioner_is_the_transpose() {
    let brick = brick();
    let (a, _) = brick.reduced(2);
    let factors = factors(&brick, &a);
    let (b, c) = (Random(4).vector(a.n()), Random(5).vector(a.n()));
    let (mut forward, mut transposed) = (b.clone(), c.clone());
    factors.solve(&mut forward);
    factors.solve_transpose(&mut transposed);
    let size = dot(&forward, &forward).sqrt() * dot(&c, &c).sqrt();
    let error = (dot(&forward, &c) - dot(&b, &transposed)).abs() / size;
    assert!(error < 1e-5, "{error:e}");
}

/// By definition: several right-hand sides together have the solutions of each, to the single precision
/// of the factors.
#[test]
fn right_hand_sides_are_solved_together() {
    let brick = brick();
    let (a, _) = brick.reduced(2);
    let factors = factors(&brick, &a);
    let several: Vec<f64> = (4..7).flat_map(|seed| Random(seed).vector(a.n())).collect();
    for transpose in [false, true] {
        let (mut together, mut apart) = (several.clone(), several.clone());
        let solve = |x: &mut [f64]| if transpose { factors.solve_transpose(x) } else { factors.solve(x) };
        apart.chunks_exact_mut(a.n()).for_each(solve);
        if transpose {
            factors.solve_transpose_many(&mut together);
        } else {
            factors.solve_many(&mut together);
        }
        for (together, apart) in together.chunks_exact(a.n()).zip(apart.chunks_exact(a.n())) {
            assert!(difference(together, apart) < 1e-5, "{:e}", difference(together, apart));
        }
    }
}

/// The same bits with one thread and with three.
#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let brick = brick();
    let (a, _) = brick.reduced(3);
    let solve = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            let factors = factors(&brick, &a);
            let (mut x, mut y) = (Random(6).vector(a.n()), Random(7).vector(a.n()));
            factors.solve(&mut x);
            factors.solve_transpose(&mut y);
            (x, y)
        })
    };
    assert!(solve(1) == solve(3));
}

/// A body that nothing holds: its translations are coarse motions, and the matrix is singular.
#[test]
fn free_bodies_are_found() {
    let brick = Brick { multipliers: false, fixed_bottom: false, nonsymmetry: 0.0, ..brick() };
    let (a, _) = brick.reduced(4);
    let result = SchwarzSolver::new(nodes(&brick)).analyse_and_factorize(&a);
    assert!(matches!(result.err(), Some(FactorizationError::Singular { .. })));
}

/// In the chain, a direct solver replaces the preconditioner if that cannot be made.
#[test]
fn direct_solvers_are_the_fallback() {
    let brick = Brick { nodes: [4, 5, 6], ..brick() };
    let (a, _) = brick.reduced(5);
    let without = Nodes { coordinates: Vec::new().into(), bodies: Vec::new().into() };
    let factors = Schwarz(without).solver().analyse_and_factorize(&a).expect("a direct solver");
    assert_eq!(factors.cost().map(|cost| cost.solves_per_digit), Some(0.0));
    let mut solver = Schwarz(nodes(&brick)).solver();
    let iterative = solver.analyse_and_factorize(&a).expect("a preconditioner");
    assert!(solver.is_iterative() && iterative.cost().is_some_and(|cost| cost.solves_per_digit > 0.0));
    assert!(solver.insist_on_direct() && !solver.is_iterative() && !solver.insist_on_direct());
    let direct = solver.analyse_and_factorize(&a).expect("a direct solver");
    assert_eq!(direct.cost().map(|cost| cost.solves_per_digit), Some(0.0));
}

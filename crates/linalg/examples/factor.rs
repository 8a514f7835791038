//! Times of the solvers on model problems: bricks on a 27-point pattern of 3×3 blocks, with a
//! nonsymmetric part, clustered stiffness over three decades and multipliers on the top face.
//!
//! ```text
//! cargo run --release -p slipstick-linalg --example factor -- [nodes per edge ...] [--faer]
//! ```
//!
//! Without arguments: about 20 000 and 50 000 unknowns. `--faer` adds faer's LU and the ratio.

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../tests/supernodal/mod.rs"]
mod supernodal;

use common::{Brick, Random};
use slipstick_linalg::{CsrMatrix, Factorization, LinearSolver, MultifrontalSolver, Precision, solve_verified};
use std::error::Error;
use std::time::Instant;
use supernodal::SupernodalSolver;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let with_faer = arguments.iter().any(|a| a == "--faer");
    let mut edges: Vec<usize> = arguments.iter().filter_map(|a| a.parse().ok()).collect();
    if edges.is_empty() {
        edges = vec![19, 26];
    }
    for edge in edges {
        let brick = Brick { nodes: [edge; 3], multipliers: true, contrast: 3.0, nonsymmetry: 0.05, fixed_bottom: true };
        let (a, _) = brick.reduced(1);
        println!("{edge}³ nodes: {} unknowns, {} entries", a.n(), a.values.len());
        let double = multifrontal(&a, Precision::F64)?;
        multifrontal(&a, Precision::F32)?;
        if with_faer {
            let mut solver = SupernodalSolver::new();
            let symbolic = solver.analyse(&a.pattern)?;
            solver.factorize(&symbolic, &a)?;
            let start = Instant::now();
            let factors = solver.factorize(&symbolic, &a)?;
            let seconds = start.elapsed().as_secs_f64();
            println!("  faer LU       factor {seconds:7.3} s  ({:.1} × multifrontal)", seconds / double);
            solves(&a, factors.as_ref())?;
        }
    }
    Ok(())
}

/// Prints the times of analysis, factorization and solves; returns that of a refactorization.
fn multifrontal(a: &CsrMatrix, precision: Precision) -> Result<f64, Box<dyn Error>> {
    let mut solver = MultifrontalSolver::new(precision);
    let start = Instant::now();
    let symbolic = solver.analyse(&a.pattern)?;
    let analysis = start.elapsed().as_secs_f64();
    solver.factorize(&symbolic, a)?;
    let start = Instant::now();
    let factors = solver.factorize_matrix(&symbolic, a)?;
    let seconds = start.elapsed().as_secs_f64();
    let facts = factors.statistics();
    println!(
        "  {precision:?} multifrontal  analyse {analysis:6.3} s  factor {seconds:7.3} s  \
         {:6.1} Gflop/s  {} fronts  {:.1} M entries  {} delayed  growth {:.1}",
        facts.operations / seconds * 1e-9,
        facts.fronts,
        facts.factor_entries as f64 * 1e-6,
        facts.delayed_pivots,
        facts.growth
    );
    solves(a, &factors)?;
    Ok(seconds)
}

/// Right-hand sides that are solved together.
const TOGETHER: usize = 20;

/// Raw and verified solves, forward and transposed, and the time of one among several.
fn solves(a: &CsrMatrix, factors: &dyn Factorization) -> Result<(), Box<dyn Error>> {
    let b = Random(2).vector(a.n());
    for transpose in [false, true] {
        let mut x = b.clone();
        let start = Instant::now();
        if transpose {
            factors.solve_transpose(&mut x)
        } else {
            factors.solve(&mut x)
        }
        let raw = start.elapsed().as_secs_f64();
        let mut several = b.repeat(TOGETHER);
        let start = Instant::now();
        if transpose {
            factors.solve_transpose_many(&mut several)
        } else {
            factors.solve_many(&mut several)
        }
        let each = start.elapsed().as_secs_f64() / TOGETHER as f64;
        let start = Instant::now();
        let report = solve_verified(a, factors, transpose, &b, &mut x, 1e-10)?;
        let verified = start.elapsed().as_secs_f64();
        println!(
            "      {}  solve {raw:6.3} s  of {TOGETHER} {each:6.4} s each  verified {verified:6.3} s  {} iterations  residual {:.1e}",
            if transpose { "transposed" } else { "forward   " },
            report.iterations,
            report.relative_residual
        );
    }
    Ok(())
}

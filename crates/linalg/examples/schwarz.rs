//! Iterations, times and memory of the Schwarz preconditioner on matrices from files.
//!
//! ```text
//! cargo run --release -p slipstick-linalg --example schwarz -- FILE …
//! ```
//!
//! `crates/slipstick/examples/export_matrix.rs` writes such files. Each line has the seconds for
//! analysis and preconditioner, its memory, and iterations and seconds of a solve to 1e-4 and 1e-10,
//! with the matrix and with its transpose, for a right-hand side without structure, and the seconds
//! of one application of the preconditioner.

mod exported;

use exported::read;
use slipstick_linalg::{LinearSolver, Nodes, SchwarzSolver, SolveError, SolveOptions, solve_with};
use std::error::Error;
use std::time::Instant;

/// Right-hand sides to which the preconditioner is applied together.
const TOGETHER: usize = 20;

fn main() -> Result<(), Box<dyn Error>> {
    for file in std::env::args().skip(1) {
        let data = read(&file)?;
        let a = data.matrix;
        let bodies = data.bodies.iter().map(|&body| (body != u32::MAX).then_some(body)).collect();
        let mut solver = SchwarzSolver::new(Nodes { coordinates: data.coordinates.into(), bodies });
        let start = Instant::now();
        let symbolic = solver.analyse(&a.pattern)?;
        let analysed = start.elapsed().as_secs_f64();
        let start = Instant::now();
        let factors = solver.factorize(&symbolic, &a)?;
        let factored = start.elapsed().as_secs_f64();
        let megabytes = factors.bytes() as f64 * 1e-6;
        let gigaflop = factors.part().operations * 1e-9;
        print!(
            "{} unknowns: analysis {analysed:.2} s, factors {factored:.2} s, {megabytes:.0} MB, {gigaflop:.0} Gflop",
            a.n()
        );
        let b: Vec<f64> = (0..a.n()).map(|i| (i as f64 * i as f64 * 0.618_034).sin()).collect();
        for (transpose, tolerance) in [(false, 1e-4), (false, 1e-10), (true, 1e-4), (true, 1e-10)] {
            let mut x = vec![0.0; a.n()];
            let options = SolveOptions { tolerance, max_iterations: 300, restart: 300, alternative: None };
            let start = Instant::now();
            let report = match solve_with(&a, factors.as_ref(), transpose, &b, &mut x, &options) {
                Ok(report) | Err(SolveError::NotConverged { report, .. }) => report,
                Err(error) => return Err(error.into()),
            };
            let (seconds, kind) = (start.elapsed().as_secs_f64(), if transpose { "transposed" } else { "forward" });
            print!(", {kind} {:.0e} {} it. {seconds:.2} s", report.relative_residual, report.iterations);
        }
        let [one, each] = [1, TOGETHER].map(|count| {
            let mut several = b.repeat(count);
            let start = Instant::now();
            factors.solve_many(&mut several);
            start.elapsed().as_secs_f64() / count as f64
        });
        println!(", applied in {one:.3} s, to {TOGETHER} together in {each:.3} s each");
    }
    Ok(())
}

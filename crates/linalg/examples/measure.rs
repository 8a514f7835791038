//! Times and memory of the multifrontal solver on a matrix from a file, as one line of JSON.
//!
//! ```text
//! cargo run --release -p slipstick-linalg --example measure -- FILE [f64|f32] [factorizations]
//! ```
//!
//! `crates/slipstick/examples/export_matrix.rs` writes such files;
//! `crates/linalg/benches/compare_pardiso.py` compares this program with PARDISO. Times are the
//! shortest of several factorizations and of ten solves each. Memory, if the system reports it
//! (Linux), is the peak beyond the memory of the loaded matrix.

mod exported;

use exported::{read, status};
use slipstick_linalg::{Factorization, LinearSolver, MultifrontalSolver, Precision, solve_verified};
use std::error::Error;
use std::time::Instant;

/// Solves per factorization, of which the fastest counts.
const SOLVES: usize = 10;

fn main() -> Result<(), Box<dyn Error>> {
    // as in the program, the main thread takes part in parallel loops
    rayon::ThreadPoolBuilder::new().use_current_thread().build_global()?;
    let mut arguments = std::env::args().skip(1);
    let file = arguments.next().ok_or("arguments: FILE [f64|f32] [factorizations]")?;
    let precision = match arguments.next().as_deref() {
        None | Some("f64") => Precision::F64,
        Some("f32") => Precision::F32,
        Some(other) => return Err(format!("{other} is not a precision: use f64 or f32").into()),
    };
    let runs: usize = arguments.next().map_or(Ok(3), |text| text.parse())?;
    let a = read(&file)?.matrix;
    let b: Vec<f64> = (0..a.n()).map(|i| (i as f64 * i as f64 * 0.618_034).sin()).collect();
    let before = status("VmRSS:");
    let mut solver = MultifrontalSolver::new(precision);
    let (analysis, symbolic) = timed(|| solver.analyse(&a.pattern));
    let symbolic = symbolic?;
    let (mut factor, mut solves, mut kept) = (f64::INFINITY, [f64::INFINITY; 2], None);
    for _ in 0..runs.max(1) {
        drop(kept.take()); // free the old factors before computing new ones
        let (seconds, factors) = timed(|| solver.factorize_matrix(&symbolic, &a));
        factor = factor.min(seconds);
        kept = Some(factors?);
        let factors = kept.as_ref().ok_or("just set")?;
        for _ in 0..SOLVES {
            let mut x = b.clone();
            solves[0] = solves[0].min(timed(|| factors.solve(&mut x)).0);
            solves[1] = solves[1].min(timed(|| factors.solve_transpose(&mut x)).0);
        }
    }
    let factors = kept.ok_or("no factorization")?;
    let memory = status("VmHWM:").zip(before).map(|(peak, before)| (peak - before) / 1024.0);
    let mut report = String::new();
    for (name, transpose) in [("forward", false), ("transposed", true)] {
        let mut x = b.clone();
        if transpose {
            factors.solve_transpose(&mut x)
        } else {
            factors.solve(&mut x)
        };
        let norm = b.iter().map(|b| b * b).sum::<f64>().sqrt();
        let raw = a.residual_norm(transpose, &x, &b) / norm;
        let (seconds, verified) = timed(|| solve_verified(&a, &factors, transpose, &b, &mut x, 1e-10));
        let verified = verified?;
        report += &format!(
            ", \"{name}\": {{\"residual\": {raw:e}, \"verified\": {seconds:.4}, \"iterations\": {}, \"final\": {:e}}}",
            verified.iterations, verified.relative_residual
        );
    }
    let facts = factors.statistics();
    println!(
        "{{\"n\": {}, \"analyse\": {analysis:.4}, \"factor\": {factor:.4}, \"gflops\": {:.2}, \"gflop\": {:.1}, \
         \"solve\": {:.5}, \"solve_transpose\": {:.5}, \"entries\": {}, \"fronts\": {}, \"delayed\": {}, \
         \"growth\": {:.2}, \"symmetric\": {:.3}, \"smallest_pivot\": {:.1e}, \"megabytes\": {}{report}}}",
        a.n(),
        facts.operations / factor * 1e-9,
        facts.operations * 1e-9,
        solves[0],
        solves[1],
        facts.factor_entries,
        facts.fronts,
        facts.delayed_pivots,
        facts.growth,
        facts.symmetric_operations / facts.operations,
        facts.smallest_pivot,
        memory.map_or("null".to_owned(), |m| format!("{m:.0}")),
    );
    Ok(())
}

fn timed<R>(run: impl FnOnce() -> R) -> (f64, R) {
    let start = Instant::now();
    let result = run();
    (start.elapsed().as_secs_f64(), result)
}

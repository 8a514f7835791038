//! Times and memory of cuDSS on a matrix from a file.
//!
//! ```text
//! cargo run --release -p slipstick-cudss --example measure_gpu -- FILE [f32|f64]...
//! ```
//!
//! `crates/slipstick/examples/export_matrix.rs` writes such files. The first factorization contains
//! cuDSS's analysis; times of the next ones and of solves are the shortest of several, including
//! scaling and transfers. Iterations are those to a residual of 1e-10, after the first solve.

#[path = "../../linalg/examples/exported/mod.rs"]
mod exported;

use exported::read;
use slipstick_cudss::{CudssSolver, Device};
use slipstick_linalg::{CsrMatrix, Factorization, LinearSolver, Precision, solve_verified};
use std::error::Error;
use std::sync::Arc;
use std::time::Instant;

/// Factorizations after the first one, and solves.
const FACTORIZATIONS: usize = 4;
const SOLVES: usize = 10;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let file = arguments.next().ok_or("arguments: FILE [f32|f64]...")?;
    let mut precisions: Vec<String> = arguments.collect();
    if precisions.is_empty() {
        precisions = vec!["f32".into(), "f64".into()];
    }
    let a = read(&file)?.matrix;
    let device = Arc::new(Device::open()?);
    println!("{} unknowns, {} entries; {}, cuDSS {}", a.n(), a.values.len(), device.name(), device.version());
    println!("       order [s]  first [s]  next [s]  memory [GB]  solve [ms]  iterations  transposed [ms]  iterations");
    for name in precisions {
        let precision = match name.as_str() {
            "f32" => Precision::F32,
            "f64" => Precision::F64,
            other => return Err(format!("{other} is not a precision: use f32 or f64").into()),
        };
        let mut solver = CudssSolver::new(&device, precision);
        let free = device.memory()?[0];
        let (order, symbolic) = timed(|| solver.analyse(&a.pattern));
        let symbolic = symbolic?;
        let (first, factors) = timed(|| solver.factorize(&symbolic, &a));
        let mut factors = Some(factors?);
        let mut next = f64::INFINITY;
        for _ in 0..FACTORIZATIONS {
            drop(factors.take()); // then they are overwritten
            let (seconds, made) = timed(|| solver.factorize(&symbolic, &a));
            (next, factors) = (next.min(seconds), Some(made?));
        }
        let factors = factors.ok_or("no factorization")?;
        let used = free.saturating_sub(device.memory()?[0]) as f64 * 1e-9;
        let [forward, transposed] = [false, true].map(|transpose| solves(&a, factors.as_ref(), transpose));
        let ((solve, iterations), (back, again)) = (forward?, transposed?);
        println!(
            "{name}{order:13.2}{first:11.2}{next:10.3}{used:13.2}{:12.1}{iterations:12}{:17.1}{again:12}",
            1e3 * solve,
            1e3 * back
        );
    }
    Ok(())
}

/// Seconds of a solve, and iterations of a verified one.
fn solves(a: &CsrMatrix, factors: &dyn Factorization, transpose: bool) -> Result<(f64, usize), Box<dyn Error>> {
    let b: Vec<f64> = (0..a.n()).map(|i| (i as f64 * i as f64 * 0.618_034).sin()).collect();
    let mut x = b.clone();
    let mut shortest = f64::INFINITY;
    for _ in 0..SOLVES {
        x.copy_from_slice(&b);
        let run = || if transpose { factors.solve_transpose(&mut x) } else { factors.solve(&mut x) };
        shortest = shortest.min(timed(run).0);
    }
    Ok((shortest, solve_verified(a, factors, transpose, &b, &mut x, 1e-10)?.iterations))
}

fn timed<R>(run: impl FnOnce() -> R) -> (f64, R) {
    let start = Instant::now();
    let result = run();
    (start.elapsed().as_secs_f64(), result)
}

//! Times and memory of cuDSS on a matrix from a file.
//!
//! ```text
//! cargo run --release -p slipstick-cudss --example measure -- FILE [f32|f64]...
//! ```
//!
//! `crates/slipstick/examples/export_matrix.rs` writes such files. Each line is one factorization.

#[path = "../../linalg/examples/exported/mod.rs"]
mod exported;

use exported::read;
use slipstick_cudss::{CudssSolver, Device};
use slipstick_linalg::{Factorization, LinearSolver, Precision, solve_verified};
use std::error::Error;
use std::sync::Arc;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let file = arguments.next().ok_or("arguments: FILE [f32|f64]...")?;
    let precisions: Vec<String> = arguments.collect();
    let a = read(&file)?.matrix;
    let b: Vec<f64> = (0..a.n()).map(|i| (i as f64 * i as f64 * 0.618_034).sin()).collect();
    let norm = b.iter().map(|b| b * b).sum::<f64>().sqrt();
    let device = Arc::new(Device::open()?);
    let [free, total] = device.memory()?.map(|bytes| bytes as f64 * 1e-9);
    println!("{}, cuDSS {}, {free:.1} of {total:.1} GB free", device.name(), device.version());
    println!("{} unknowns, {} entries", a.n(), a.values.len());
    for name in precisions {
        let precision = if name == "f64" { Precision::F64 } else { Precision::F32 };
        let mut solver = CudssSolver::new(&device, precision);
        let (analysis, symbolic) = timed(|| solver.analyse(&a.pattern));
        let symbolic = symbolic?;
        let (first, factors) = timed(|| solver.factorize(&symbolic, &a));
        drop(factors?);
        let (second, factors) = timed(|| solver.factorize(&symbolic, &a));
        drop(factors?);
        let (third, factors) = timed(|| solver.factorize(&symbolic, &a));
        let factors = factors?;
        let used = device.memory()?[0] as f64 * 1e-9;
        println!(
            "{name}: analysis {analysis:.2} s, first {first:.3} s, then {second:.3} and {third:.3} s, {:.2} GB said, \
             {:.2} GB measured",
            factors.bytes() as f64 * 1e-9,
            free - used
        );
        for transpose in [false, true] {
            report(&a, factors.as_ref(), transpose, &b, norm);
        }
        let mut several = [b.clone(), b.clone(), b.clone()].concat();
        let (seconds, ()) = timed(|| factors.solve_many(&mut several));
        let mut one = b.clone();
        factors.solve(&mut one);
        let most = several.iter().zip(one.iter().cycle()).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
        let mut again = b.clone();
        factors.solve(&mut again);
        println!("  three right-hand sides: {seconds:.4} s, difference {most:e}, repeatable: {}", one == again);
    }
    Ok(())
}

fn report(a: &slipstick_linalg::CsrMatrix, factors: &dyn Factorization, transpose: bool, b: &[f64], norm: f64) {
    let mut x = b.to_vec();
    let mut seconds = f64::INFINITY;
    for _ in 0..5 {
        x.copy_from_slice(b);
        let run = || if transpose { factors.solve_transpose(&mut x) } else { factors.solve(&mut x) };
        seconds = seconds.min(timed(run).0);
    }
    let raw = a.residual_norm(transpose, &x, b) / norm;
    let (verified, outcome) = timed(|| solve_verified(a, factors, transpose, b, &mut x, 1e-10));
    println!("  transposed {transpose}: {seconds:.4} s, residual {raw:.1e}; verified {verified:.3} s, {outcome:?}");
}

fn timed<R>(run: impl FnOnce() -> R) -> (f64, R) {
    let start = Instant::now();
    let result = run();
    (start.elapsed().as_secs_f64(), result)
}

//! Compares the contact-zone preconditioner with MUMPS on a matrix from a file.
//!
//! ```text
//! mpirun -n 2 precondition matrix.bin zone [layers] ["options of PETSc"]
//! mpirun -n 2 precondition matrix.bin mumps
//! ```
//!
//! The file is written by `slipstick`'s example `export_matrix`. The output is one line of numbers:
//! ranks, unknowns, seconds to factorize (the second time, with the existing analysis and without
//! the test), seconds and iterations of a solve to 1e-10 and of one with the transpose, residuals,
//! largest peak memory of a process \[MB\]. Times are processor times.

#[path = "../../linalg/examples/exported/mod.rs"]
mod exported;

use slipstick_linalg::{Backend, CsrMatrix, CsrPattern, PatternError, Ranks, Summed, solve_verified};
use slipstick_petsc::{ContactZone, PetscBackend, Session};
use std::error::Error;
use std::sync::Arc;
use std::sync::atomic::Ordering;

const TOLERANCE: f64 = 1e-10;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [name, method, options @ ..] = arguments.as_slice() else {
        return Err("arguments: matrix file, zone or mumps, layers, options".into());
    };
    let session = Session::start()?;
    let file = exported::read(name)?;
    // bodies are numbered one after the other, so each rank gets an equal share of the nodes
    let nodes = file.coordinates.len();
    let owners: Vec<u32> = (0..nodes).map(|node| (node * session.size() / nodes) as u32).collect();
    let mine = part(&file.matrix, &owners, session.rank() as u32)?;
    let n = file.matrix.n();
    drop(file.matrix);
    let mut zone = ContactZone::new(file.coordinates, file.slaves);
    if let Some(layers) = options.first() {
        zone.layers = layers.parse()?;
    }
    session.set_options(options.get(1).map_or("", String::as_str))?;
    let count = zone.iterations.clone();
    let backend = PetscBackend::new(session.clone(), owners);
    let backend = if method == "zone" { backend.with_contact_zone(zone) } else { backend };
    let mut solver = backend.solver();
    // with the analysis, and the test that the transpose can be solved
    let start = seconds();
    let symbolic = solver.analyse(&mine.pattern)?;
    let factors = solver.factorize(&symbolic, &mine)?;
    let first = session.largest(seconds() - start);
    let bytes = factors.bytes();
    drop(factors);
    count.store(0, Ordering::Relaxed);
    let start = seconds();
    let factors = solver.factorize(&symbolic, &mine)?;
    let second = session.largest(seconds() - start);
    let test = count.load(Ordering::Relaxed);
    let layout = backend.layout(&mine.pattern);
    let summed = Summed { part: &mine, layout: &layout, ranks: &session };
    let whole: Vec<f64> = (0..n).map(|i| (i as f64 * i as f64 * 0.618_034).sin()).collect();
    let b = layout.restrict(&whole);
    let mut line = format!(
        "{} ranks, {n} unknowns, first {first:.2} s, again {second:.2} s (test {test} it.), {:.0} MB",
        session.size(),
        1e-6 * bytes as f64
    );
    for transpose in [false, true] {
        count.store(0, Ordering::Relaxed);
        let mut x = vec![0.0; b.len()];
        let start = seconds();
        let outcome = match solve_verified(&summed, factors.as_ref(), transpose, &b, &mut x, TOLERANCE) {
            Ok(report) => format!("{} outer, {:.0e}", report.iterations, report.relative_residual),
            Err(error) => error.to_string(),
        };
        let time = session.largest(seconds() - start);
        let kind = if transpose { "transposed" } else { "forward" };
        line += &format!(", {kind} {time:.2} s {} it. ({outcome})", count.load(Ordering::Relaxed));
    }
    let peak = session.largest(exported::status("VmHWM:").unwrap_or(f64::NAN) / 1024.0);
    if session.rank() == 0 {
        println!("{method} {}: {line}, peak {peak:.0} MB", options.join(" "));
    }
    Ok(())
}

/// Rows of the nodes of a rank.
fn part(a: &CsrMatrix, owners: &[u32], rank: u32) -> Result<CsrMatrix, PatternError> {
    let (mut row_offsets, mut all_columns, mut values) = (vec![0], Vec::new(), Vec::new());
    for i in 0..a.n() {
        if owners[a.pattern.groups()[i] as usize] == rank {
            let (columns, entries) = a.row(i);
            all_columns.extend(columns);
            values.extend(entries);
        }
        row_offsets.push(values.len());
    }
    let (groups, origins) = (a.pattern.groups().to_vec(), a.pattern.origins().to_vec());
    Ok(CsrMatrix { pattern: Arc::new(CsrPattern::new(row_offsets, all_columns, groups, origins)?), values })
}

/// Processor time that this process has used. \[s\]
fn seconds() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after = text.rsplit(')').next().unwrap_or_default();
    let ticks: f64 = after.split_whitespace().skip(11).take(2).filter_map(|t| t.parse::<f64>().ok()).sum();
    0.01 * ticks
}

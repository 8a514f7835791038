//! Reads the file that `slipstick`'s example `export_matrix` writes: a matrix, and data of the
//! bodies that it comes from.
#![allow(dead_code)] // each program uses a part

use slipstick_linalg::{CsrMatrix, CsrPattern};
use std::error::Error;
use std::sync::Arc;

/// The contents of the file.
pub struct File {
    pub matrix: CsrMatrix,
    pub coordinates: Vec<[f64; 3]>,
    pub slaves: Vec<u32>,
    /// Body of each node; the largest number for nodes of rigid bodies.
    pub bodies: Vec<u32>,
}

/// Little-endian: n, entries (u64), row offsets (u64), columns, groups (u32), values (f64), origins
/// (u32); number of nodes (u64) and their coordinates (f64), number of slave nodes (u64) and their
/// numbers (u32); the body of each node (u32).
pub fn read(file: &str) -> Result<File, Box<dyn Error>> {
    let bytes = std::fs::read(file)?;
    let mut rest = bytes.as_slice();
    let mut take = |count: usize, size: usize| -> Result<&[u8], Box<dyn Error>> {
        let length = count.checked_mul(size).filter(|&l| l <= rest.len()).ok_or("the file is too short")?;
        let (head, tail) = rest.split_at(length);
        rest = tail;
        Ok(head)
    };
    let long = |bytes: &[u8]| u64::from_le_bytes(std::array::from_fn(|i| bytes[i])) as usize;
    let short = |bytes: &[u8]| u32::from_le_bytes(std::array::from_fn(|i| bytes[i]));
    let double = |bytes: &[u8]| f64::from_le_bytes(std::array::from_fn(|i| bytes[i]));
    let (n, entries) = (long(take(1, 8)?), long(take(1, 8)?));
    let row_offsets = take(n + 1, 8)?.chunks_exact(8).map(long).collect();
    let columns = take(entries, 4)?.chunks_exact(4).map(short).collect();
    let groups = take(n, 4)?.chunks_exact(4).map(short).collect();
    let values = take(entries, 8)?.chunks_exact(8).map(double).collect();
    let origins = take(n, 4)?.chunks_exact(4).map(short).collect();
    let nodes = long(take(1, 8)?);
    let coordinates = take(nodes, 24)?.chunks_exact(24).map(|x| std::array::from_fn(|b| double(&x[8 * b..]))).collect();
    let count = long(take(1, 8)?);
    let slaves = take(count, 4)?.chunks_exact(4).map(short).collect();
    let bodies = take(nodes, 4)?.chunks_exact(4).map(short).collect();
    let pattern = CsrPattern::new(row_offsets, columns, groups, origins)?;
    Ok(File { matrix: CsrMatrix { pattern: Arc::new(pattern), values }, coordinates, slaves, bodies })
}

/// A number of kibibytes from the process status, if it is available.
pub fn status(key: &str) -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find(|line| line.starts_with(key))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

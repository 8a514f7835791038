//! Entries of nodal vectors and matrices that an element reads and adds to.

use crate::clusters::Target;
use rayon::prelude::*;
use slipstick_linalg::BlockPattern;

/// Positions in a pattern of the blocks of each element, one for each pair of its nodes, element by
/// element.
///
/// # Panics
/// If the pattern lacks a pair.
pub(crate) fn positions<'a, const PAIRS: usize, E: Sync>(
    elements: &'a [E],
    pattern: &BlockPattern,
    nodes: impl Fn(&'a E) -> &'a [u32] + Sync,
) -> Vec<u32> {
    let mut out = vec![0; PAIRS * elements.len()];
    out.par_chunks_mut(PAIRS).zip(elements).for_each(|(out, element)| find_pairs(pattern, nodes(element), out));
    out
}

/// Positions of the blocks of one element.
///
/// # Panics
/// If the pattern lacks a pair.
pub(crate) fn find_pairs(pattern: &BlockPattern, nodes: &[u32], out: &mut [u32]) {
    for (out, &i) in out.chunks_exact_mut(nodes.len()).zip(nodes) {
        for (out, &k) in out.iter_mut().zip(nodes) {
            *out = pattern.find(i as usize, k as usize).expect("pattern holds all element pairs") as u32;
        }
    }
}

/// The entries of a nodal vector at the corners of an element.
#[inline(always)]
pub(crate) fn local<const N: usize>(nodes: &[u32; N], v: &[f64]) -> [[f64; 3]; N] {
    let mut out = [[0.0; 3]; N];
    for (out, &node) in out.iter_mut().zip(nodes) {
        out.copy_from_slice(&v[3 * node as usize..][..3]);
    }
    out
}

#[inline(always)]
pub(crate) fn add_to_nodes<const N: usize>(nodes: &[u32; N], force: &[[f64; 3]; N], target: &Target<'_, [f64; 3]>) {
    for (&node, force) in nodes.iter().zip(*force) {
        // SAFETY: a node of the element.
        add(unsafe { target.at(node as usize) }, force);
    }
}

#[inline(always)]
pub(crate) fn add<const N: usize>(target: &mut [f64; N], term: [f64; N]) {
    for c in 0..N {
        target[c] += term[c];
    }
}

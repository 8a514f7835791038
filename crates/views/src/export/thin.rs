//! Keeps walls and gaps that are one element thick.
//!
//! The nodes on both sides of such a wall are means over solid and void elements. If they are below the
//! threshold, so is the whole edge between them, although all elements around it are solid: each edge would
//! be a hole through the wall. Both nodes then count as solid, with the surface next to them. The other
//! way round, an edge among void elements only whose nodes are above the threshold would be a pin through
//! a gap: its nodes count as void, but a node that alone keeps a wall whole stays solid.
//!
//! Test: `thin_walls_and_gaps_stay_whole`.

use std::collections::BTreeMap;

use super::lattice::{Lattice, LatticeEdge};

/// Whether each vertex counts as above the threshold.
pub(super) fn above(lattice: &Lattice, threshold: f64) -> Vec<bool> {
    let mut above: Vec<bool> = lattice.values.iter().map(|&value| value > threshold).collect();
    let solid = || lattice.edges.iter().filter(|edge| edge.least > threshold);
    let holes: Vec<&LatticeEdge> = solid().filter(|edge| edge.ends.iter().all(|&n| !above[n as usize])).collect();
    for edge in holes {
        edge.ends.iter().for_each(|&n| above[n as usize] = true);
    }
    let void = lattice.edges.iter().filter(|edge| edge.most <= threshold);
    let pins: Vec<&LatticeEdge> = void.filter(|edge| edge.ends.iter().all(|&n| above[n as usize])).collect();
    if pins.is_empty() {
        return above;
    }
    // the other ends of the solid edges of each node of a pin
    let mut partners: BTreeMap<u32, Vec<u32>> =
        pins.iter().flat_map(|edge| edge.ends).map(|n| (n, Vec::new())).collect();
    for &[a, b] in solid().map(|edge| &edge.ends) {
        partners.entry(a).and_modify(|others| others.push(b));
        partners.entry(b).and_modify(|others| others.push(a));
    }
    for n in pins.iter().flat_map(|edge| edge.ends) {
        above[n as usize] &= !partners[&n].iter().all(|&other| above[other as usize]);
    }
    above
}

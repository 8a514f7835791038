//! Keeps walls and gaps that are one element thick.
//!
//! The nodes on both sides of such a wall are means over solid and void elements. If they are below the
//! threshold, so is the whole edge between them, although all elements around it are solid: each edge would
//! be a hole through the wall. Both nodes then count as solid, with the surface next to them. The other
//! way round, an edge among void elements only whose nodes are above the threshold would be a pin through
//! a gap. A node is not lifted if that made a pin.
//!
//! Test: `thin_walls_and_gaps_stay_whole`.

use super::lattice::{Lattice, LatticeEdge};

/// Whether each vertex counts as above the threshold.
pub(super) fn above(lattice: &Lattice, threshold: f64) -> Vec<bool> {
    let by_value: Vec<bool> = lattice.values.iter().map(|&value| value > threshold).collect();
    let mut above = by_value.clone();
    let alike = |edge: &LatticeEdge, is: bool| edge.ends.iter().all(|&n| by_value[n as usize] == is);
    let void = |edge: &LatticeEdge| edge.most <= threshold;
    for edge in lattice.edges.iter().filter(|edge| void(edge) && alike(edge, true)) {
        edge.ends.iter().for_each(|&n| above[n as usize] = false);
    }
    let walls: Vec<&LatticeEdge> =
        lattice.edges.iter().filter(|edge| edge.least > threshold && alike(edge, false)).collect();
    if walls.is_empty() {
        return above;
    }
    for edge in &walls {
        edge.ends.iter().for_each(|&n| above[n as usize] = true);
    }
    // of two nodes across a gap that are both above now, those that were lifted go back
    for edge in lattice.edges.iter().filter(|edge| void(edge)) {
        if edge.ends.iter().all(|&n| above[n as usize]) {
            edge.ends.iter().filter(|&&n| !by_value[n as usize]).for_each(|&n| above[n as usize] = false);
        }
    }
    above
}

//! The graph of the nodes: which unknowns belong to a node, and which nodes are coupled.

use crate::csr::CsrPattern;
use rayon::prelude::*;
use std::ops::Range;

/// A node with more neighbours than this many times the average has long rows. These are the nodes
/// of rigid bodies, which couple to whole surfaces.
const LONG: usize = 16;

/// The elimination groups of a pattern, with their couplings. A vertex is a node with its
/// displacements and, for a slave node, its multipliers.
#[derive(Debug)]
pub(super) struct Vertices {
    /// Vertex of each unknown.
    pub of: Vec<u32>,
    /// Group number of each vertex, which is the number of its node.
    pub nodes: Vec<u32>,
    offsets: Vec<usize>,
    members: Vec<u32>,
    graph_offsets: Vec<usize>,
    neighbours: Vec<u32>,
    long: usize,
}

impl Vertices {
    /// Vertices are numbered in the order of their first unknown.
    pub fn new(pattern: &CsrPattern) -> Self {
        let groups = pattern.groups();
        let largest = groups.iter().max().map_or(0, |&group| group as usize + 1);
        let mut number = vec![u32::MAX; largest];
        let mut nodes = Vec::new();
        let mut of = Vec::with_capacity(groups.len());
        for &group in groups {
            let slot = &mut number[group as usize];
            if *slot == u32::MAX {
                *slot = nodes.len() as u32;
                nodes.push(group);
            }
            of.push(*slot);
        }
        let mut offsets = vec![0; nodes.len() + 1];
        of.iter().for_each(|&v| offsets[v as usize + 1] += 1);
        (0..nodes.len()).for_each(|v| offsets[v + 1] += offsets[v]);
        let mut next = offsets.clone();
        let mut members = vec![0; of.len()];
        for (i, &v) in of.iter().enumerate() {
            members[next[v as usize]] = i as u32;
            next[v as usize] += 1;
        }
        let row = |v: usize| {
            let around = members[offsets[v]..offsets[v + 1]].iter().flat_map(|&i| pattern.row(i as usize));
            let mut row: Vec<u32> = around.map(|&j| of[j as usize]).filter(|&w| w as usize != v).collect();
            row.sort_unstable();
            row.dedup();
            row
        };
        let rows: Vec<Vec<u32>> = (0..nodes.len()).into_par_iter().map(row).collect();
        let mut graph_offsets = vec![0];
        let mut neighbours = Vec::with_capacity(rows.iter().map(Vec::len).sum());
        for row in rows {
            neighbours.extend(row);
            graph_offsets.push(neighbours.len());
        }
        let long = LONG * (neighbours.len() / nodes.len().max(1) + 1);
        Self { of, nodes, offsets, members, graph_offsets, neighbours, long }
    }

    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Unknowns of a vertex, ascending.
    pub fn members(&self, v: usize) -> &[u32] {
        &self.members[self.range(v)]
    }

    fn range(&self, v: usize) -> Range<usize> {
        self.offsets[v]..self.offsets[v + 1]
    }

    /// Coupled vertices, ascending.
    pub fn adjacent(&self, v: usize) -> &[u32] {
        &self.neighbours[self.graph_offsets[v]..self.graph_offsets[v + 1]]
    }

    /// Whether a vertex couples to far more others than usual.
    pub fn is_long(&self, v: usize) -> bool {
        self.adjacent(v).len() > self.long
    }
}

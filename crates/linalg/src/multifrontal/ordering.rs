//! Quotient graph of nodes and multipliers, and the elimination order of the groups.

use crate::csr::CsrPattern;
use std::collections::HashMap;

/// Number of groups below which the order does not matter.
const SMALL: usize = 48;

/// Undirected graph, without loops, whose vertices are the consecutive unknowns of an elimination
/// group: a node, or the multipliers of a slave node.
///
/// Each group is ordered as a unit, with its vertices in the order of the unknowns: a multiplier
/// directly follows its node, so that its pivots are not zero. The structure of the factors,
/// however, is based on vertices: multipliers are coupled to fewer others than their nodes are, and
/// one vertex for both would cost up to a tenth more operations.
pub(super) struct QuotientGraph {
    /// Unknowns of each vertex, ascending.
    pub members: Vec<Vec<u32>>,
    /// Start of each vertex' neighbours, then their total number.
    pub offsets: Vec<usize>,
    /// Neighbours, ascending per vertex.
    pub neighbours: Vec<u32>,
    /// Vertices of each group, ascending.
    groups: Vec<Vec<u32>>,
}

impl QuotientGraph {
    /// Vertices and groups are numbered in the order of their first unknown.
    pub fn new(pattern: &CsrPattern) -> Self {
        let (vertex, members, groups) = number_vertices(pattern.groups());
        let count = members.len();
        let mut rows: Vec<Vec<u32>> = members
            .iter()
            .enumerate()
            .map(|(v, unknowns)| {
                let mut row: Vec<u32> = unknowns
                    .iter()
                    .flat_map(|&i| pattern.row(i as usize))
                    .map(|&j| vertex[j as usize])
                    .filter(|&w| w as usize != v)
                    .collect();
                row.sort_unstable();
                row.dedup();
                row
            })
            .collect();
        let mut incoming: Vec<Vec<u32>> = vec![Vec::new(); count];
        for (v, row) in rows.iter().enumerate() {
            row.iter().for_each(|&w| incoming[w as usize].push(v as u32));
        }
        let mut offsets = vec![0];
        let mut neighbours = Vec::new();
        for (row, incoming) in rows.iter_mut().zip(&incoming) {
            row.extend(incoming);
            row.sort_unstable();
            row.dedup();
            neighbours.extend_from_slice(row);
            offsets.push(neighbours.len());
        }
        Self { members, offsets, neighbours, groups }
    }

    pub fn len(&self) -> usize {
        self.members.len()
    }

    pub fn adjacent(&self, v: usize) -> &[u32] {
        &self.neighbours[self.offsets[v]..self.offsets[v + 1]]
    }

    /// Whether each vertex lies in the contact zone: in a group with a multiplier that is coupled to
    /// other groups, or in one of these. Elsewhere, matrices of elastic bodies are symmetric.
    pub fn contact_zone(&self) -> Vec<bool> {
        let group = self.group_of_vertices();
        let mut in_zone = vec![false; self.groups.len()];
        for (g, vertices) in self.groups.iter().enumerate() {
            for &w in vertices[1..].iter().flat_map(|&multiplier| self.adjacent(multiplier as usize)) {
                let other = group[w as usize] as usize;
                if other != g {
                    (in_zone[g], in_zone[other]) = (true, true);
                }
            }
        }
        group.iter().map(|&g| in_zone[g as usize]).collect()
    }

    /// Vertices in an elimination order with little fill: METIS' nested dissection of the groups,
    /// or their minimum degree in builds without METIS; isolated groups first, and groups with
    /// vertices in `last` at the end.
    pub fn fill_reducing_order(&self, last: &[bool]) -> Result<Vec<u32>, String> {
        let is_last: Vec<bool> = self.groups.iter().map(|vertices| last[vertices[0] as usize]).collect();
        let mut couplings = self.couplings();
        couplings.iter_mut().for_each(|row| row.retain(|&g| !is_last[g as usize]));
        let (isolated, connected): (Vec<usize>, Vec<usize>) =
            (0..self.groups.len()).filter(|&g| !is_last[g]).partition(|&g| couplings[g].is_empty());
        let mut order = isolated;
        if connected.len() < SMALL {
            order.extend(connected);
        } else {
            let (offsets, neighbours) = compact(&connected, &couplings)?;
            #[cfg(feature = "metis")]
            let reduced = {
                let unknowns = |g: usize| self.groups[g].iter().map(|&v| self.members[v as usize].len() as i32).sum();
                crate::metis::nested_dissection(offsets, neighbours, connected.iter().map(|&g| unknowns(g)).collect())?
            };
            #[cfg(not(feature = "metis"))]
            let reduced = minimum_degree(&offsets, &neighbours);
            order.extend(reduced.iter().map(|&k| connected[k as usize]));
        }
        order.extend((0..self.groups.len()).filter(|&g| is_last[g]));
        Ok(order.iter().flat_map(|&g| self.groups[g].iter().copied()).collect())
    }

    fn group_of_vertices(&self) -> Vec<u32> {
        let mut group = vec![0u32; self.len()];
        for (g, vertices) in self.groups.iter().enumerate() {
            vertices.iter().for_each(|&v| group[v as usize] = g as u32);
        }
        group
    }

    /// Neighbouring groups of each group, ascending.
    fn couplings(&self) -> Vec<Vec<u32>> {
        let group = self.group_of_vertices();
        let coupled = |(g, vertices): (usize, &Vec<u32>)| {
            let around = vertices.iter().flat_map(|&v| self.adjacent(v as usize));
            let mut row: Vec<u32> = around.map(|&w| group[w as usize]).filter(|&h| h as usize != g).collect();
            row.sort_unstable();
            row.dedup();
            row
        };
        self.groups.iter().enumerate().map(coupled).collect()
    }
}

/// Offsets and neighbours of the `connected` groups, renumbered by their positions in this list.
fn compact(connected: &[usize], couplings: &[Vec<u32>]) -> Result<(Vec<i32>, Vec<i32>), String> {
    let mut position = vec![0i32; couplings.len()];
    for (k, &g) in connected.iter().enumerate() {
        position[g] = k as i32;
    }
    let too_large = |_| "too many couplings for the ordering".to_owned();
    let mut offsets = vec![0i32];
    let mut neighbours = Vec::with_capacity(couplings.iter().map(Vec::len).sum());
    for &g in connected {
        neighbours.extend(couplings[g].iter().map(|&h| position[h as usize]));
        offsets.push(i32::try_from(neighbours.len()).map_err(too_large)?);
    }
    Ok((offsets, neighbours))
}

/// Vertices of a symmetric graph by approximate minimum degree: Amestoy, Davis and Duff, SIAM J.
/// Matrix Anal. Appl. 17 (1996), without supervariables. More fill than nested dissection, but pure Rust.
///
/// Each eliminated vertex becomes an element: the set of vertices that it has joined to each other.
#[cfg(any(test, not(feature = "metis")))]
fn minimum_degree(offsets: &[i32], neighbours: &[i32]) -> Vec<i32> {
    let n = offsets.len() - 1;
    let row = |v: usize| neighbours[offsets[v] as usize..offsets[v + 1] as usize].iter().map(|&w| w as usize);
    let mut around: Vec<Vec<usize>> = (0..n).map(|v| row(v).filter(|&w| w != v).collect()).collect();
    let mut elements: Vec<Vec<usize>> = vec![Vec::new(); n];
    let mut members: Vec<Vec<usize>> = vec![Vec::new(); n];
    let mut degrees: Vec<usize> = around.iter().map(Vec::len).collect();
    let mut queue: std::collections::BTreeSet<(usize, usize)> = (0..n).map(|v| (degrees[v], v)).collect();
    // the last element that has taken a vertex, and, of the others, the members that it has not
    let (mut taken, mut outside) = (vec![usize::MAX; n], vec![(usize::MAX, 0); n]);
    let mut order = Vec::with_capacity(n);
    while let Some((_, v)) = queue.pop_first() {
        order.push(v as i32);
        taken[v] = v;
        let mut joined = Vec::new();
        let absorbed = std::mem::take(&mut elements[v]);
        let lists = absorbed.iter().map(|&e| std::mem::take(&mut members[e]));
        for w in lists.chain([std::mem::take(&mut around[v])]).flatten() {
            if taken[w] != v {
                taken[w] = v;
                joined.push(w);
            }
        }
        for &w in &joined {
            elements[w].retain(|&e| !members[e].is_empty());
            for &e in &elements[w] {
                let before = if outside[e].0 == v { outside[e].1 } else { members[e].len() };
                outside[e] = (v, before - 1);
            }
        }
        let remaining = queue.len();
        for &w in &joined {
            around[w].retain(|&u| taken[u] != v);
            let beyond: usize = elements[w].iter().map(|&e| outside[e].1).sum();
            let bounds = [remaining - 1, degrees[w] + joined.len() - 1, around[w].len() + joined.len() - 1 + beyond];
            queue.remove(&(degrees[w], w));
            degrees[w] = bounds.into_iter().min().unwrap_or(0);
            elements[w].push(v);
            queue.insert((degrees[w], w));
        }
        members[v] = joined;
    }
    order
}

/// Vertex of each unknown, unknowns of each vertex, vertices of each group.
fn number_vertices(groups: &[u32]) -> (Vec<u32>, Vec<Vec<u32>>, Vec<Vec<u32>>) {
    let mut numbers = HashMap::new();
    let mut members: Vec<Vec<u32>> = Vec::new();
    let mut vertices: Vec<Vec<u32>> = Vec::new();
    let mut vertex = Vec::with_capacity(groups.len());
    for (i, group) in groups.iter().enumerate() {
        if i == 0 || *group != groups[i - 1] {
            let g = *numbers.entry(*group).or_insert_with(|| {
                vertices.push(Vec::new());
                vertices.len() - 1
            });
            vertices[g].push(members.len() as u32);
            members.push(Vec::new());
        }
        let v = members.len() - 1;
        members[v].push(i as u32);
        vertex.push(v as u32);
    }
    (vertex, members, vertices)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fill of the factors of a graph, computed by eliminating vertex by vertex.
    fn fill(offsets: &[i32], neighbours: &[i32], order: impl Iterator<Item = usize>) -> usize {
        let n = offsets.len() - 1;
        let row = |v: usize| neighbours[offsets[v] as usize..offsets[v + 1] as usize].iter().map(|&w| w as usize);
        let mut rows: Vec<std::collections::BTreeSet<usize>> = (0..n).map(|v| row(v).collect()).collect();
        let mut entries = 0;
        for v in order {
            let around = std::mem::take(&mut rows[v]);
            entries += around.len();
            for &w in &around {
                rows[w].extend(around.iter().filter(|&&u| u != w));
                rows[w].remove(&v);
            }
        }
        entries
    }

    /// A grid of 16 × 16: each vertex occurs once, and there is less fill than row by row, which is
    /// 16 × 16 × 16 minus the border.
    #[test]
    fn minimum_degree_is_a_permutation_with_less_fill_than_a_band() {
        let n = 16;
        let mut offsets = vec![0];
        let mut neighbours = Vec::new();
        for v in 0..n * n {
            let (i, j) = (v / n, v % n);
            neighbours.extend((i > 0).then_some(v - n));
            neighbours.extend((j > 0).then_some(v - 1));
            neighbours.extend((j + 1 < n).then_some(v + 1));
            neighbours.extend((i + 1 < n).then_some(v + n));
            offsets.push(neighbours.len() as i32);
        }
        let neighbours: Vec<i32> = neighbours.into_iter().map(|v| v as i32).collect();
        let order = minimum_degree(&offsets, &neighbours);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, (0..(n * n) as i32).collect::<Vec<_>>());
        let by_degree = fill(&offsets, &neighbours, order.iter().map(|&v| v as usize));
        let by_rows = fill(&offsets, &neighbours, 0..n * n);
        assert!(by_rows > 3700 && 2 * by_degree < by_rows, "{by_degree} instead of {by_rows}");
    }
}

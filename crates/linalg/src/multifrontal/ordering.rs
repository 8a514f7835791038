//! Quotient graph of nodes and multipliers, and the nested dissection of the elimination groups.

use crate::csr::CsrPattern;
use std::collections::HashMap;
use std::sync::Mutex;

/// Seed of METIS' random numbers.
const SEED: i32 = 20_011;

/// Vertices below which dissection gains nothing.
const SMALL: usize = 48;

/// METIS draws from the random numbers of the C library, which all threads share: two orderings at
/// the same time would disturb each other and no longer be reproducible.
static ONE_ORDERING_AT_A_TIME: Mutex<()> = Mutex::new(());

/// Undirected graph, without loops, whose vertices are the consecutive unknowns of an elimination group: a node, or the
/// multipliers of a slave node.
///
/// Groups are ordered as a whole, their vertices in the order of the unknowns: a multiplier follows its node at once, so
/// that its pivots are not zero. The structure of the factors, however, goes by vertices. Multipliers are coupled to
/// fewer others than their nodes are; one vertex for both would cost up to a tenth more operations.
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
        let (vertex, members, groups) = number_vertices(&pattern.groups);
        let count = members.len();
        let mut rows: Vec<Vec<u32>> = members
            .iter()
            .enumerate()
            .map(|(v, unknowns)| {
                let mut row: Vec<u32> = unknowns
                    .iter()
                    .flat_map(|&i| {
                        let i = i as usize;
                        &pattern.columns[pattern.row_offsets[i]..pattern.row_offsets[i + 1]]
                    })
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

    /// Vertices in elimination order: METIS nested dissection of the groups, isolated groups first.
    pub fn nested_dissection(&self) -> Result<Vec<u32>, String> {
        let couplings = self.couplings();
        let (isolated, connected): (Vec<usize>, Vec<usize>) =
            (0..self.groups.len()).partition(|&g| couplings[g].is_empty());
        let mut order = isolated;
        if connected.len() < SMALL {
            order.extend(connected);
        } else {
            let dissected = self.dissect(&connected, &couplings)?;
            order.extend(dissected.iter().map(|&k| connected[k as usize]));
        }
        Ok(order.iter().flat_map(|&g| self.groups[g].iter().copied()).collect())
    }

    /// Neighbouring groups of each group, ascending.
    fn couplings(&self) -> Vec<Vec<u32>> {
        let mut group = vec![0u32; self.len()];
        for (g, vertices) in self.groups.iter().enumerate() {
            vertices.iter().for_each(|&v| group[v as usize] = g as u32);
        }
        let coupled = |(g, vertices): (usize, &Vec<u32>)| {
            let around = vertices.iter().flat_map(|&v| self.adjacent(v as usize));
            let mut row: Vec<u32> = around.map(|&w| group[w as usize]).filter(|&h| h as usize != g).collect();
            row.sort_unstable();
            row.dedup();
            row
        };
        self.groups.iter().enumerate().map(coupled).collect()
    }

    /// Positions in `connected` in elimination order.
    fn dissect(&self, connected: &[usize], couplings: &[Vec<u32>]) -> Result<Vec<i32>, String> {
        let mut compact = vec![0i32; couplings.len()];
        for (k, &g) in connected.iter().enumerate() {
            compact[g] = k as i32;
        }
        let too_large = |_| "too many couplings for the ordering".to_owned();
        let mut offsets = vec![0i32];
        let mut neighbours = Vec::with_capacity(couplings.iter().map(Vec::len).sum());
        for &g in connected {
            neighbours.extend(couplings[g].iter().map(|&h| compact[h as usize]));
            offsets.push(i32::try_from(neighbours.len()).map_err(too_large)?);
        }
        let unknowns = |g: usize| self.groups[g].iter().map(|&v| self.members[v as usize].len() as i32).sum();
        let weights = connected.iter().map(|&g| unknowns(g)).collect();
        metis_node_nd(offsets, neighbours, weights)
    }
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

/// Calls METIS; returns the vertices in elimination order.
fn metis_node_nd(mut offsets: Vec<i32>, mut neighbours: Vec<i32>, mut weights: Vec<i32>) -> Result<Vec<i32>, String> {
    let mut count = weights.len() as i32;
    let mut order = vec![0i32; weights.len()];
    let mut position = vec![0i32; weights.len()];
    let mut options = [0i32; metis_sys::METIS_NOPTIONS as usize];
    let guard = ONE_ORDERING_AT_A_TIME.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    // SAFETY: `options` has METIS_NOPTIONS items; offsets and neighbours form a valid symmetric
    // graph without loops; the other arrays have one item per vertex. METIS keeps no pointer.
    let status = unsafe {
        metis_sys::METIS_SetDefaultOptions(options.as_mut_ptr());
        options[metis_sys::moptions_et_METIS_OPTION_SEED as usize] = SEED;
        metis_sys::METIS_NodeND(
            &mut count,
            offsets.as_mut_ptr(),
            neighbours.as_mut_ptr(),
            weights.as_mut_ptr(),
            options.as_mut_ptr(),
            order.as_mut_ptr(),
            position.as_mut_ptr(),
        )
    };
    drop(guard);
    if status == metis_sys::rstatus_et_METIS_OK {
        Ok(order)
    } else {
        Err(format!("METIS ordering failed with status {status}"))
    }
}

//! Quotient graph of the elimination groups and its nested dissection.

use crate::csr::CsrPattern;
use std::sync::Mutex;

/// Seed of METIS' random numbers.
const SEED: i32 = 20_011;

/// Vertices below which dissection gains nothing.
const SMALL: usize = 48;

/// METIS draws from the random numbers of the C library, which all threads share: two orderings at
/// the same time would disturb each other and no longer be reproducible.
static ONE_ORDERING_AT_A_TIME: Mutex<()> = Mutex::new(());

/// Undirected graph of the elimination groups, without loops.
pub(super) struct QuotientGraph {
    /// Unknowns of each vertex, ascending.
    pub members: Vec<Vec<u32>>,
    /// Start of each vertex' neighbours, then their total number.
    pub offsets: Vec<usize>,
    /// Neighbours, ascending per vertex.
    pub neighbours: Vec<u32>,
}

impl QuotientGraph {
    /// Groups are numbered in the order of their first unknown.
    pub fn new(pattern: &CsrPattern) -> Self {
        let (vertex, members) = number_groups(&pattern.groups);
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
        Self { members, offsets, neighbours }
    }

    pub fn len(&self) -> usize {
        self.members.len()
    }

    pub fn adjacent(&self, v: usize) -> &[u32] {
        &self.neighbours[self.offsets[v]..self.offsets[v + 1]]
    }

    /// Vertices in elimination order: METIS nested dissection, isolated vertices first.
    pub fn nested_dissection(&self) -> Result<Vec<u32>, String> {
        let (isolated, connected): (Vec<u32>, Vec<u32>) =
            (0..self.len() as u32).partition(|&v| self.adjacent(v as usize).is_empty());
        let mut order = isolated;
        if connected.len() < SMALL {
            order.extend(connected);
            return Ok(order);
        }
        let mut compact = vec![0u32; self.len()];
        for (k, &v) in connected.iter().enumerate() {
            compact[v as usize] = k as u32;
        }
        let too_large = |_| "too many couplings for the ordering".to_owned();
        let mut offsets = vec![0i32];
        let mut neighbours = Vec::with_capacity(self.neighbours.len());
        for &v in &connected {
            neighbours.extend(self.adjacent(v as usize).iter().map(|&w| compact[w as usize] as i32));
            offsets.push(i32::try_from(neighbours.len()).map_err(too_large)?);
        }
        let weights = connected.iter().map(|&v| self.members[v as usize].len() as i32).collect();
        let dissected = metis_node_nd(offsets, neighbours, weights)?;
        order.extend(dissected.iter().map(|&k| connected[k as usize]));
        Ok(order)
    }
}

/// Vertex of each unknown and unknowns of each vertex.
fn number_groups(groups: &[u32]) -> (Vec<u32>, Vec<Vec<u32>>) {
    let mut numbers = std::collections::HashMap::new();
    let mut members: Vec<Vec<u32>> = Vec::new();
    let vertex = groups
        .iter()
        .enumerate()
        .map(|(i, &group)| {
            let v = *numbers.entry(group).or_insert_with(|| {
                members.push(Vec::new());
                members.len() as u32 - 1
            });
            members[v as usize].push(i as u32);
            v
        })
        .collect();
    (vertex, members)
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

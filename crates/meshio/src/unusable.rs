//! Reports unsupported elements of a body, counted by kind.

use std::collections::BTreeMap;

use crate::body::Order;
use crate::{CellKind, FileMesh, MeshFileError};

/// Maximum number of sets of solid elements that an error lists.
const MOST_PARTS: usize = 8;

impl FileMesh {
    /// Number of solid elements of each kind in a part, or in the whole file.
    pub fn solids(&self, part: Option<&str>) -> BTreeMap<CellKind, usize> {
        match part {
            None => self.count(0..self.cells.len() as u32),
            Some(part) => self.count(self.cell_sets.get(part).into_iter().flatten().copied()),
        }
    }

    fn count(&self, cells: impl IntoIterator<Item = u32>) -> BTreeMap<CellKind, usize> {
        let mut counts = BTreeMap::new();
        for kind in cells.into_iter().map(|cell| self.cells.kind(cell as usize)).filter(|kind| kind.dimension() == 3) {
            *counts.entry(kind).or_default() += 1;
        }
        counts
    }

    /// The mean position of nodes, for messages.
    pub(crate) fn middle(&self, nodes: &[u32]) -> String {
        let mut mean = [0.0; 3];
        let points = nodes.iter().map(|&node| self.points[node as usize]);
        points.for_each(|x| (0..3).for_each(|c| mean[c] += x[c] / nodes.len() as f64));
        format!("({:.4}, {:.4}, {:.4})", mean[0], mean[1], mean[2])
    }
}

/// Returns an error if some of a body's cells cannot become elements. It states how many of which
/// kind there are, in which parts of the file if the body is the whole file, and where the first
/// one is.
pub(crate) fn refuse_unusable(
    file: &FileMesh,
    body: &str,
    part: Option<&str>,
    chosen: &[u32],
    order: Order,
) -> Result<(), MeshFileError> {
    let usable = |kind: CellKind| order.of(kind).is_element();
    let Some(&first) = chosen.iter().find(|&&cell| !usable(file.cells.kind(cell as usize))) else { return Ok(()) };
    let mut counts = file.count(chosen.iter().copied());
    counts.retain(|&kind, _| !usable(kind));
    let Some((kind, _)) = counts.first_key_value() else { return Ok(()) };
    let count: usize = counts.values().sum();
    let mut message = format!("{count} of {} elements are pyramids: {}", chosen.len(), listed(&counts));
    if part.is_none() {
        message += &by_part(file, usable);
    }
    let (number, nodes) = (file.cells.number(first as usize), file.cells.nodes(first as usize));
    message += &format!("; the first is element {number} at {}", file.middle(nodes));
    Err(MeshFileError::new(format!("body `{body}`"), message, kind.cure()))
}

/// `20 tet10 (C3D10), 4 hex20 (C3D20)`.
fn listed(counts: &BTreeMap<CellKind, usize>) -> String {
    counts.iter().map(|(kind, count)| format!("{count} {}", kind.label())).collect::<Vec<_>>().join(", ")
}

/// Their number in each part of the file; empty without named parts.
fn by_part(file: &FileMesh, usable: impl Fn(CellKind) -> bool) -> String {
    let mut parts = Vec::new();
    for part in file.parts() {
        let mut counts = file.solids(Some(part));
        counts.retain(|&kind, _| !usable(kind));
        if !counts.is_empty() {
            parts.push(format!("part `{part}` has {}", listed(&counts)));
        }
    }
    if parts.is_empty() {
        return String::new();
    }
    let more = parts.len().saturating_sub(MOST_PARTS);
    parts.truncate(MOST_PARTS);
    let rest = if more > 0 { format!(", and {more} more parts have some") } else { String::new() };
    format!("; {}{rest}", parts.join(", "))
}

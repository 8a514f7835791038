//! Initial gaps and penetrations that a pair counts as closed.

use crate::construct::remaining_gap;
use crate::file::Contact;
use serde::Serialize;
use slipstick_mesh::Mesh;
use slipstick_model::model::{ModelInterface, NodalContact, OffsetPoint};

/// What `adjust` of a contact pair has removed, and what it has left.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Adjustment {
    /// Gaps and penetrations up to this change; `None`: any. \[L\]
    pub distance: Option<f64>,
    /// The gap that they get; 0: closed. \[L\]
    pub gap: f64,
    /// Whether only the nodes of a set are adjusted.
    pub chosen: bool,
    /// Number of slave nodes whose gap differs from that in the mesh.
    pub nodes: usize,
    /// The largest difference; negative: the gap becomes larger. \[L\]
    pub largest: f64,
    /// Its node.
    pub at_node: Option<u32>,
    /// Number of slave nodes that face the master and whose gap remains different from `gap`.
    pub left: usize,
    /// The deepest penetration that remains; 0 if there is none. \[L\]
    pub deepest_left: f64,
}

/// Gaps below this fraction of the distance are round-off.
const ROUND_OFF: f64 = 1e-9;

/// The adjustment of a pair with the contact of its slave nodes at the start; `None` without `adjust`. `points`: those
/// of the contact surfaces.
pub(super) fn adjustment(
    contact: &Contact,
    model: &ModelInterface,
    nodes: &[NodalContact],
    (mesh, points): (&Mesh, &[[f64; 3]]),
) -> Option<Adjustment> {
    let adjust = contact.adjust.as_ref()?;
    let distance = Some(adjust.distance()).filter(|distance| distance.is_finite());
    let size = distance.unwrap_or(model.interface.reach());
    let moved = |gap: f64| gap.abs() > ROUND_OFF * size;
    // nodes with what is removed of their gaps, and the gaps that remain
    let (removed, remaining): (Vec<(u32, f64)>, Vec<f64>) = match contact.enforcement.is_at_points() {
        true => {
            let remains = remaining_gap(contact, adjust, mesh);
            let offset = OffsetPoint::at(&contact.offset, contact.active[0]);
            let least = model.interface.least_gaps(points.as_flattened()).into_iter();
            let both = least.map(|(node, gap)| {
                let rest = remains(node, gap).unwrap_or(gap);
                ((node, gap - rest), rest - offset)
            });
            both.unzip()
        }
        false => {
            let removed = nodes.iter().zip(&model.adjusted).map(|(node, gap)| (node.node, *gap));
            (removed.collect(), nodes.iter().filter_map(|node| node.gap).collect())
        }
    };
    let removed = removed.into_iter().filter(|(_, gap)| moved(*gap));
    let worst = removed.clone().reduce(|a, b| if b.1.abs() > a.1.abs() { b } else { a });
    let left = remaining.into_iter().filter(|gap| moved(*gap - adjust.gap()));
    Some(Adjustment {
        distance,
        gap: adjust.gap(),
        chosen: adjust.nodes().is_some(),
        nodes: removed.count(),
        largest: worst.map_or(0.0, |(_, gap)| gap),
        at_node: worst.map(|(node, _)| node),
        left: left.clone().count(),
        deepest_left: left.fold(0.0, |deepest: f64, gap| deepest.max(-gap)),
    })
}

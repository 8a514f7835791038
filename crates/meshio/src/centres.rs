//! Second-order hexahedra and wedges: the order of the nodes at the centres of their faces and at their own,
//! and these nodes of cells that lack them.

use std::collections::HashMap;
use std::sync::LazyLock;

use slipstick_mesh::{Element, HEX_EDGES, HEX_FACE_CENTRES, HEX_FACES, WEDGE_EDGES, WEDGE_QUADRILATERALS};

use crate::CellKind;

/// A local node at the centre of a face or of an element.
#[derive(Debug)]
pub(crate) struct Place {
    /// Its number in the element.
    pub node: usize,
    /// The four or eight corners around it.
    pub corners: Vec<usize>,
    /// The nodes between them.
    pub middles: Vec<usize>,
}

impl Place {
    fn new(node: usize, corners: &[usize], edges: &[[usize; 2]], first: usize) -> Self {
        let on = |edge: &[usize; 2]| edge.iter().all(|corner| corners.contains(corner));
        let middles = (0..edges.len()).filter(|&edge| on(&edges[edge])).map(|edge| first + edge).collect();
        Self { node, corners: corners.to_vec(), middles }
    }

    /// Its position on the serendipity shape: −1/4 of each corner, and of each node between them what is missing
    /// to 1.
    pub fn position(&self, nodes: &[u32], at: impl Fn(u32) -> [f64; 3]) -> [f64; 3] {
        let sum = |of: &[usize], c: usize| of.iter().map(|&local| at(nodes[local])[c]).sum::<f64>();
        let by_middle = (1.0 + 0.25 * self.corners.len() as f64) / self.middles.len() as f64;
        std::array::from_fn(|c| by_middle * sum(&self.middles, c) - 0.25 * sum(&self.corners, c))
    }

    /// Its corners, sorted.
    pub fn key(&self, nodes: &[u32]) -> Vec<u32> {
        let mut key: Vec<u32> = self.corners.iter().map(|&corner| nodes[corner]).collect();
        key.sort_unstable();
        key
    }
}

static OF_HEXAHEDRA: LazyLock<Vec<Place>> = LazyLock::new(|| {
    let faces = HEX_FACES.iter().zip(HEX_FACE_CENTRES).map(|(face, node)| Place::new(node, face, &HEX_EDGES, 8));
    faces.chain([Place::new(26, &[0, 1, 2, 3, 4, 5, 6, 7], &HEX_EDGES, 8)]).collect()
});

static OF_WEDGES: LazyLock<Vec<Place>> = LazyLock::new(|| {
    let faces = WEDGE_QUADRILATERALS.iter().zip(15..);
    faces.map(|(face, node)| Place::new(node, face, &WEDGE_EDGES, 6)).collect()
});

impl CellKind {
    /// The centres of cells of second order: of their quadrilaterals, and of hexahedra. Empty for other cells.
    pub(crate) fn centres(self) -> &'static [Place] {
        match self {
            Self::Hex20 | Self::Hex27 => &OF_HEXAHEDRA,
            Self::Wedge15 | Self::Wedge18 => &OF_WEDGES,
            _ => &[],
        }
    }

    /// The same cell with all centres, if it lacks them.
    pub(crate) fn completed(self) -> Option<Self> {
        match self {
            Self::Hex20 => Some(Self::Hex27),
            Self::Wedge15 => Some(Self::Wedge18),
            _ => None,
        }
    }

    /// A hexahedron or wedge of second order with this number of nodes.
    fn of_second_order(nodes: usize) -> Option<Self> {
        [Self::Hex20, Self::Hex27, Self::Wedge15, Self::Wedge18].into_iter().find(|kind| kind.node_count() == nodes)
    }
}

/// The nodes of a cell of second order with its centres in the order of [`Element`]. Programs order
/// these differently, so positions decide: each place gets the node nearest to its position on the
/// serendipity shape of the others.
pub(crate) fn in_order(kind: CellKind, nodes: &[u32], at: impl Fn(u32) -> [f64; 3]) -> Vec<u32> {
    let mut out = nodes.to_vec();
    let places = kind.centres();
    let mut rest: Vec<u32> = nodes[nodes.len() - places.len()..].to_vec();
    for place in places {
        let wanted = place.position(nodes, &at);
        let distance = |node: u32| -> f64 { at(node).iter().zip(wanted).map(|(x, y)| (x - y) * (x - y)).sum() };
        let nearest = (0..rest.len()).min_by(|&a, &b| distance(rest[a]).total_cmp(&distance(rest[b])));
        if let Some(nearest) = nearest {
            out[place.node] = rest.remove(nearest);
        }
    }
    out
}

/// The element of a complete cell; `None` for other numbers of nodes.
pub(crate) fn complete_element(nodes: &[u32]) -> Option<Element> {
    <[u32; 27]>::try_from(nodes)
        .map(Element::Hex27)
        .or_else(|_| <[u32; 18]>::try_from(nodes).map(Element::Wedge18))
        .ok()
}

/// Second-order hexahedra and wedges as elements, from cells of 20 or 27, and 15 or 18 nodes.
///
/// Nodes at centres may be in any order. Cells without them get nodes at the centres of
/// their quadrilaterals, and hexahedra at their own, on the serendipity shape. These nodes are added to
/// `points`; two cells with a common face share its centre.
///
/// # Panics
/// If a cell has a different number of nodes, or a node without a point.
pub fn second_order_elements(cells: &[&[u32]], points: &mut Vec<[f64; 3]>) -> Vec<Element> {
    let mut centres: HashMap<Vec<u32>, u32> = HashMap::new();
    let mut elements: Vec<Vec<u32>> = Vec::with_capacity(cells.len());
    let kind = |nodes: &[u32]| CellKind::of_second_order(nodes.len()).expect("15, 18, 20 or 27 nodes");
    for nodes in cells {
        let kind = kind(nodes);
        elements.push(match kind.completed() {
            Some(_) => nodes.to_vec(),
            None => {
                let all = in_order(kind, nodes, |node| points[node as usize]);
                centres.extend(kind.centres().iter().map(|place| (place.key(nodes), all[place.node])));
                all
            }
        });
    }
    for (nodes, all) in cells.iter().zip(&mut elements) {
        let kind = kind(nodes);
        let Some(completed) = kind.completed() else { continue };
        all.resize(completed.node_count(), u32::MAX);
        for place in kind.centres() {
            let position = place.position(nodes, |node| points[node as usize]);
            all[place.node] = *centres.entry(place.key(nodes)).or_insert_with(|| {
                points.push(position);
                (points.len() - 1) as u32
            });
        }
    }
    elements.iter().map(|nodes| complete_element(nodes).expect("18 or 27 nodes")).collect()
}

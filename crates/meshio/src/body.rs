//! Extracts one body from a file's mesh.

mod extraction;
mod orientation;

use std::collections::BTreeMap;

use slipstick_mesh::{Body, Mesh};

use crate::{CellKind, FileMesh, MeshFileError};
use extraction::Extraction;

/// A body and the changes that were made while reading it.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadBody {
    /// The mesh of only this body, as from a generator of [`slipstick_mesh`].
    pub mesh: Mesh,
    /// The file's numbers of the nodes. Nodes that the file does not have come last, without numbers.
    pub numbers: Vec<u64>,
    /// Repairs and omissions, for the user's information.
    pub notices: Vec<String>,
    /// Surfaces of the file, by their names in the mesh, that cannot be surfaces of the body, and why.
    pub unusable: BTreeMap<String, MeshFileError>,
}

/// How second-order cells are treated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Order {
    /// Unchanged.
    AsWritten,
    /// By their corners.
    First,
}

impl FileMesh {
    /// Extracts a body with the given name: the tetrahedra, wedges and hexahedra of the set `part`
    /// (or of the whole file), with coordinates multiplied by `scale`.
    ///
    /// Nodes and elements keep their order. Hexahedra of 20 nodes and wedges of 15 get nodes at the centres of
    /// their quadrilaterals, and hexahedra at their own, which follow the others; they lie on the serendipity
    /// shape. If hexahedra or wedges are numbered inside out, bottom
    /// and top are swapped; for tetrahedra, the first two nodes are swapped. An element that
    /// appears twice with the same nodes is used once. A set becomes `{name}_{set}`, or keeps its
    /// name if it already begins with `{name}_`. Sets of triangles, quadrilaterals and faces become
    /// surfaces; sets of nodes, points and lines become node sets; sets of solid cells, sets of elements. Anything on other parts is left
    /// out, and so is a node set with the same name as a surface. Surfaces that are not on the boundary of
    /// the body, such as pretension sections, are listed in [`ReadBody::unusable`].
    ///
    /// # Errors
    /// If there is no such part, if solid cells are not valid tetrahedra, wedges or hexahedra, or if they are of
    /// different orders.
    pub fn body(&self, name: &str, part: Option<&str>, scale: f64) -> Result<ReadBody, MeshFileError> {
        self.read(name, part, scale, Order::AsWritten)
    }

    /// Like [`body`](Self::body), but drops mid-side nodes: second-order cells become first-order
    /// cells with the same corners, both solids and the triangles, quadrilaterals and lines of
    /// sets. Node sets keep their corners. Curved edges become straight.
    ///
    /// # Errors
    /// Those of [`body`](Self::body); and if a mid-side node is a corner of another element, since
    /// the two would no longer be conforming.
    pub fn first_order_body(&self, name: &str, part: Option<&str>, scale: f64) -> Result<ReadBody, MeshFileError> {
        self.read(name, part, scale, Order::First)
    }

    fn read(&self, name: &str, part: Option<&str>, scale: f64, order: Order) -> Result<ReadBody, MeshFileError> {
        let extraction = Extraction::new(self, name, part, order)?;
        let (elements, flipped) = extraction.elements()?;
        let nodes: Vec<[f64; 3]> = extraction.points.iter().map(|point| point.map(|x| x * scale)).collect();
        let body = Body { name: name.to_owned(), elements: 0..elements.len(), nodes: 0..nodes.len() };
        let mut mesh = Mesh { nodes, elements, bodies: vec![body], ..Mesh::default() };
        let own = |set: &str| Self::name_on_body(name, set);
        let (surfaces, unusable) = extraction.surfaces(&mesh)?;
        let unusable = unusable.into_iter().map(|(set, error)| (own(set), error)).collect();
        for (set, surface) in surfaces {
            if mesh.surfaces.insert(own(set), surface).is_some() {
                return Err(doubled(&own(set)));
            }
        }
        for (set, elements) in extraction.element_sets() {
            if mesh.element_sets.insert(own(set), elements).is_some() {
                return Err(doubled(&own(set)));
            }
        }
        let mut notices = self.notices.clone();
        let repeated = self.solid_cells(part).len() - extraction.chosen.len();
        if repeated > 0 {
            notices.push(match repeated {
                1 => "1 element repeats the nodes of an earlier one and is used once".into(),
                _ => format!("{repeated} elements repeat the nodes of an earlier one and are used once"),
            });
        }
        for (kind, what, repair) in [
            (CellKind::Hex8, "hexahedra", "bottom and top are swapped"),
            (CellKind::Wedge6, "wedges", "bottom and top are swapped"),
            (CellKind::Tet4, "tetrahedra", "two nodes are swapped"),
            (CellKind::Hex20, "hexahedra of 20 nodes", "bottom and top are swapped"),
            (CellKind::Hex27, "hexahedra of second order", "bottom and top are swapped"),
            (CellKind::Wedge15, "wedges of 15 nodes", "bottom and top are swapped"),
            (CellKind::Wedge18, "wedges of second order", "bottom and top are swapped"),
            (CellKind::Tet10, "tetrahedra of 10 nodes", "two corners are swapped"),
        ] {
            let cells: Vec<u32> = flipped.iter().copied().filter(|&cell| extraction.kind(cell) == kind).collect();
            if let [first, ..] = cells[..] {
                notices.push(format!(
                    "{} {what} are numbered inside out (the first: element {}); {repair}",
                    cells.len(),
                    self.cells.number(first as usize)
                ));
            }
        }
        for (set, nodes) in extraction.node_sets() {
            if nodes.is_empty() {
                notices.push(format!("the node set `{set}` is left out: it has only mid-side nodes"));
                continue;
            }
            match mesh.surfaces.get(&own(set)) {
                Some(surface) if surface.nodes() == nodes => {}
                Some(_) => notices.push(format!("the node set `{set}` is left out: a surface has the same name")),
                None if mesh.node_sets.insert(own(set), nodes).is_some() => return Err(doubled(&own(set))),
                None => {}
            }
        }
        Ok(ReadBody { mesh, numbers: extraction.numbers(), notices, unusable })
    }
}

/// Two sets would have the same name.
fn doubled(name: &str) -> MeshFileError {
    let message = format!("two sets of the file are called `{name}` on this body");
    MeshFileError::new("the file", message, "rename one of them")
}

impl Order {
    /// The kind as which a cell is taken.
    pub(crate) fn of(self, kind: CellKind) -> CellKind {
        match self {
            Self::AsWritten => kind,
            Self::First => kind.first_order(),
        }
    }
}

//! Extracts one body from a file's mesh.

use std::collections::{BTreeMap, BTreeSet, HashSet};

use slipstick_mesh::{
    Body, Element, FacetNodes, HEX_CORNERS, Mesh, MeshError, Surface, WEDGE_CORNERS, hex_jacobian, tet_volume,
    wedge_jacobian,
};

use crate::unusable::refuse_unusable;
use crate::{CellKind, FileMesh, MeshFileError};

/// A body and the changes that were made while reading it.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadBody {
    /// The mesh of only this body, as from a generator of [`slipstick_mesh`].
    pub mesh: Mesh,
    /// Repairs and omissions, for the user's information.
    pub notices: Vec<String>,
}

/// How second-order cells are treated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Order {
    /// Unchanged.
    AsWritten,
    /// By their corners.
    First,
}

/// A node of the file that belongs to no element of the body.
const ELSEWHERE: u32 = u32::MAX;
/// A mid-side node that was dropped from the body's elements.
const DROPPED: u32 = u32::MAX - 1;

impl FileMesh {
    /// Extracts a body with the given name: the tetrahedra, wedges and hexahedra of the set `part`
    /// (or of the whole file), with coordinates multiplied by `scale`.
    ///
    /// Nodes and elements keep their order. If hexahedra or wedges are numbered inside out, bottom
    /// and top are swapped; for tetrahedra, the first two nodes are swapped. An element that
    /// appears twice with the same nodes is used once. A set becomes `{name}_{set}`, or keeps its
    /// name if it already begins with `{name}_`. Sets of triangles, quadrilaterals and faces become
    /// surfaces; sets of nodes, points and lines become node sets; sets of solid cells, sets of elements. Anything on other parts is left
    /// out, and so is a node set with the same name as a surface.
    ///
    /// # Errors
    /// If there is no such part, if solid cells are not valid first-order tetrahedra, wedges or
    /// hexahedra, or if a facet on the body's nodes is not on its boundary.
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
        let nodes = extraction.kept.iter().map(|&node| self.points[node as usize].map(|x| x * scale)).collect();
        let body = Body { name: name.to_owned(), elements: 0..elements.len(), nodes: 0..extraction.kept.len() };
        let mut mesh = Mesh { nodes, elements, bodies: vec![body], ..Mesh::default() };
        let own = |set: &str| match set.strip_prefix(name) {
            Some(rest) if rest.starts_with('_') => set.to_owned(),
            _ => format!("{name}_{set}"),
        };
        for (set, surface) in extraction.surfaces(&mesh)? {
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
        for (kind, what, repair) in [
            (CellKind::Hex8, "hexahedra", "bottom and top are swapped"),
            (CellKind::Wedge6, "wedges", "bottom and top are swapped"),
            (CellKind::Tet4, "tetrahedra", "two nodes are swapped"),
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
        Ok(ReadBody { mesh, notices })
    }
}

/// Two sets would have the same name.
fn doubled(name: &str) -> MeshFileError {
    let message = format!("two sets of the file are called `{name}` on this body");
    MeshFileError::new("the file", message, "rename one of them")
}

/// The part of the file that is extracted.
struct Extraction<'a> {
    file: &'a FileMesh,
    order: Order,
    /// Whether all solid cells are extracted.
    whole: bool,
    /// The cells of the body, without cells that repeat the nodes of another.
    chosen: Vec<u32>,
    /// The nodes of the body, in the file's order.
    kept: Vec<u32>,
    /// Position in `kept` of each of the file's nodes, or [`ELSEWHERE`] or [`DROPPED`].
    local: Vec<u32>,
}

impl<'a> Extraction<'a> {
    fn new(file: &'a FileMesh, body: &str, part: Option<&str>, order: Order) -> Result<Self, MeshFileError> {
        let chosen = chosen(file, part, order)?;
        refuse_unusable(file, body, part, &chosen, order)?;
        let mut out = Self { file, order, whole: part.is_none(), chosen, kept: vec![], local: vec![] };
        let mut local = vec![ELSEWHERE; file.points.len()];
        for &node in out.chosen.iter().flat_map(|&cell| out.nodes(cell)) {
            local[node as usize] = 0;
        }
        out.kept = (0..).zip(&local).filter(|&(_, &mark)| mark == 0).map(|(node, _)| node).collect();
        (0..).zip(&out.kept).for_each(|(position, &node)| local[node as usize] = position);
        for &cell in &out.chosen {
            for &node in &file.cells.nodes(cell as usize)[out.nodes(cell).len()..] {
                if local[node as usize] < DROPPED {
                    return Err(out.torn(cell, node));
                }
                local[node as usize] = DROPPED;
            }
        }
        out.local = local;
        Ok(out)
    }

    /// Shape and order as which a cell is read.
    fn kind(&self, cell: u32) -> CellKind {
        self.order.of(self.file.cells.kind(cell as usize))
    }

    /// Nodes of a cell of that kind, as positions in the file.
    fn nodes(&self, cell: u32) -> &'a [u32] {
        &self.file.cells.nodes(cell as usize)[..self.kind(cell).node_count()]
    }

    /// A mid-side node of a cell is a corner of another one.
    fn torn(&self, cell: u32, node: u32) -> MeshFileError {
        let has = |other: &&u32| self.nodes(**other).contains(&node);
        let number = |cell: u32| self.file.cells.number(cell as usize);
        let other = self.chosen.iter().find(has).map_or(0, |&other| number(other));
        let node = self.file.point_numbers[node as usize];
        let message = format!(
            "its mid-side node {node} is a corner of element {other}; without it, the two elements would not be \
             conforming"
        );
        self.at(cell, &message, "write all elements of the body with the same order")
    }

    /// The elements in the body's node numbers, and the cells that were inside out.
    fn elements(&self) -> Result<(Vec<Element>, Vec<u32>), MeshFileError> {
        let mut flipped = Vec::new();
        let mut elements = Vec::with_capacity(self.chosen.len());
        for &cell in &self.chosen {
            let mut element = self.element(cell)?;
            match orientation(&element, &self.file.points) {
                Orientation::Sound => {}
                Orientation::InsideOut => {
                    match &mut element {
                        Element::Tet4(nodes) => nodes.swap(0, 1),
                        Element::Wedge6(nodes) => nodes.rotate_left(3),
                        Element::Hex8(nodes) => nodes.rotate_left(4),
                    }
                    flipped.push(cell);
                }
                Orientation::Folded => {
                    let (message, cure) = match element {
                        Element::Tet4(_) => ("the tetrahedron is flat", "correct its nodes, or remesh"),
                        Element::Wedge6(_) => ("the wedge is folded or flat", ANGLES),
                        Element::Hex8(_) => ("the hexahedron is folded or flat", ANGLES),
                    };
                    return Err(self.at(cell, message, cure));
                }
            }
            elements.push(element.map(|node| self.local[node as usize]));
        }
        Ok((elements, flipped))
    }

    /// A cell that must be a genuine tetrahedron, wedge or hexahedron, in the file's nodes.
    fn element(&self, cell: u32) -> Result<Element, MeshFileError> {
        let (kind, nodes) = (self.kind(cell), self.nodes(cell));
        let element = match (kind, nodes) {
            (CellKind::Tet4, &[a, b, c, d]) => Element::Tet4([a, b, c, d]),
            (CellKind::Wedge6, &[a, b, c, d, e, f]) => Element::Wedge6([a, b, c, d, e, f]),
            (CellKind::Hex8, &[a, b, c, d, e, f, g, h]) => Element::Hex8([a, b, c, d, e, f, g, h]),
            _ => return Err(self.at(cell, &format!("a {} cannot be an element", kind.label()), kind.cure())),
        };
        if (1..nodes.len()).any(|i| nodes[..i].contains(&nodes[i])) {
            let cure = "collapsed elements are not supported: write wedges as such (Gmsh: prisms; Abaqus: C3D6; VTK: \
                        type 13), or mesh with true tetrahedra, wedges and hexahedra";
            return Err(self.at(cell, "the element contains a node twice", cure));
        }
        Ok(element)
    }

    /// An error at a cell: its number, position and nodes.
    fn at(&self, cell: u32, message: &str, cure: &str) -> MeshFileError {
        let place = format!("element {} {}", self.file.cells.number(cell as usize), self.around(self.nodes(cell)));
        MeshFileError::new(place, message, cure)
    }

    /// Mean position and numbers of nodes.
    fn around(&self, nodes: &[u32]) -> String {
        let numbers: Vec<u64> = nodes.iter().map(|&node| self.file.point_numbers[node as usize]).collect();
        format!("at {}, nodes {numbers:?}", self.file.middle(nodes))
    }

    /// Whether a node of the file belongs to the body.
    fn has(&self, node: u32) -> bool {
        self.local[node as usize] < DROPPED
    }

    fn local_of(&self, nodes: FacetNodes) -> Option<FacetNodes> {
        nodes.iter().all(|&node| self.has(node)).then(|| nodes.map(|node| self.local[node as usize]))
    }

    /// Surfaces with at least one facet on the body.
    fn surfaces(&self, mesh: &Mesh) -> Result<BTreeMap<&'a str, Surface>, MeshFileError> {
        let found = self.facets()?;
        let local: Vec<FacetNodes> = found.iter().map(|facet| facet.local).collect();
        // A single call for all sets, since it sorts the faces of the whole body.
        let facets = mesh.surface_of_facets(&local).map_err(|error| match error {
            MeshError::NotOnBoundary { facet, reason, .. } => {
                let SetFacet { set, nodes, .. } = found[facet];
                let place = format!("surface `{set}`, facet {}", self.around(&nodes));
                let cure = "surfaces must consist of outer faces of the body's elements: correct the set, and mesh \
                            volume and surface together";
                MeshFileError::new(place, format!("the facet {reason}"), cure)
            }
            other => MeshFileError::new("the file", other.to_string(), "correct the mesh"),
        })?;
        let mut surfaces: BTreeMap<&str, Surface> = BTreeMap::new();
        let mut seen = BTreeSet::new();
        for (of_set, facet) in found.iter().zip(facets.facets) {
            if seen.insert((of_set.set, (facet.element, facet.nodes))) {
                surfaces.entry(of_set.set).or_default().facets.push(facet);
            }
        }
        Ok(surfaces)
    }

    /// The facets of all sets with all their nodes on the body.
    fn facets(&self) -> Result<Vec<SetFacet<'a>>, MeshFileError> {
        let mut facets = Vec::new();
        let cells = &self.file.cells;
        for (set, members) in &self.file.cell_sets {
            for &cell in members.iter().filter(|&&cell| cells.kind(cell as usize).dimension() == 2) {
                let (kind, nodes) = (self.kind(cell), self.nodes(cell));
                if !self.whole && !nodes.iter().all(|&node| self.has(node)) {
                    continue;
                }
                let (CellKind::Triangle3 | CellKind::Quad4, Some(nodes)) = (kind, FacetNodes::new(nodes)) else {
                    let message = format!("a {} of the surface `{set}` is not a face of an element", kind.label());
                    return Err(self.at(cell, &message, kind.cure()));
                };
                let Some(local) = self.local_of(nodes) else {
                    let message = format!("a facet of the surface `{set}` has nodes that belong to no element");
                    return Err(self.at(cell, &message, "mesh volume and surface together, and merge duplicate nodes"));
                };
                facets.push(SetFacet { set, nodes, local });
            }
        }
        let chosen: HashSet<u32> = self.chosen.iter().copied().collect();
        for (set, faces) in &self.file.face_sets {
            for face in faces.iter().filter(|face| chosen.contains(&face.cell)) {
                let element = self.element(face.cell)?;
                let nodes = element.side(usize::from(face.side).min(element.sides() - 1));
                facets.extend(self.local_of(nodes).map(|local| SetFacet { set, nodes, local }));
            }
        }
        Ok(facets)
    }

    /// Node sets, and sets of points and lines, with at least one node on the body; empty if all
    /// nodes of the set were dropped.
    fn node_sets(&self) -> BTreeMap<&'a str, Vec<u32>> {
        let cells = &self.file.cells;
        let mut sets: BTreeMap<&str, Vec<u32>> = BTreeMap::new();
        for (set, nodes) in &self.file.node_sets {
            sets.entry(set).or_default().extend(nodes);
        }
        for (set, members) in &self.file.cell_sets {
            for &cell in members.iter().filter(|&&cell| cells.kind(cell as usize).dimension() < 2) {
                sets.entry(set).or_default().extend(cells.nodes(cell as usize));
            }
        }
        for nodes in sets.values_mut() {
            nodes.iter_mut().for_each(|node| *node = self.local[*node as usize]);
            nodes.retain(|&node| node != ELSEWHERE);
            nodes.sort_unstable();
            nodes.dedup();
        }
        sets.retain(|_, nodes| !nodes.is_empty());
        sets.values_mut().for_each(|nodes| nodes.retain(|&node| node != DROPPED));
        sets
    }
}

impl<'a> Extraction<'a> {
    /// The body's elements in each set of solid cells.
    fn element_sets(&self) -> impl Iterator<Item = (&'a str, Vec<u32>)> {
        self.file.cell_sets.iter().filter_map(|(set, cells)| {
            let own = |(element, cell): (u32, &u32)| cells.binary_search(cell).is_ok().then_some(element);
            let elements: Vec<u32> = (0..).zip(&self.chosen).filter_map(own).collect();
            (!elements.is_empty()).then_some((set.as_str(), elements))
        })
    }
}

/// A facet of a set on the body.
struct SetFacet<'a> {
    set: &'a str,
    nodes: FacetNodes,
    local: FacetNodes,
}

/// The solid cells of a part, in the file's order, without those that repeat the nodes of an
/// earlier one.
fn chosen(file: &FileMesh, part: Option<&str>, order: Order) -> Result<Vec<u32>, MeshFileError> {
    let solid = |&cell: &u32| file.cells.kind(cell as usize).dimension() == 3;
    let mut chosen: Vec<u32> = match part {
        None => (0..file.cells.len() as u32).filter(solid).collect(),
        Some(part) => file.cell_sets.get(part).into_iter().flatten().copied().filter(solid).collect(),
    };
    if chosen.is_empty() {
        let parts: Vec<&str> = file.parts().collect();
        return Err(match (part, parts.is_empty()) {
            (Some(part), false) => MeshFileError::new(
                format!("part `{part}`"),
                "the file has no such set of solid elements",
                format!("sets of solid elements: {}", parts.join(", ")),
            ),
            (Some(part), true) if (0..file.cells.len() as u32).any(|cell| solid(&cell)) => MeshFileError::new(
                format!("part `{part}`"),
                "the file names no set of solid elements",
                "omit `part`, or name the volume (Gmsh: a physical volume; Abaqus: *ELSET)",
            ),
            _ => MeshFileError::new(
                "the file",
                "there are no solid elements",
                "mesh the volume and save it (Gmsh: a physical volume, or Mesh.SaveAll = 1)",
            ),
        });
    }
    let mut seen = HashSet::with_capacity(chosen.len());
    chosen.retain(|&cell| {
        let count = order.of(file.cells.kind(cell as usize)).node_count();
        seen.insert(&file.cells.nodes(cell as usize)[..count])
    });
    Ok(chosen)
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

const ANGLES: &str =
    "correct its nodes: they must be in the order of Gmsh and Abaqus, and all angles must be below 180°";

enum Orientation {
    Sound,
    InsideOut,
    Folded,
}

/// Orientation from the Jacobian determinants at the corners: all positive, all negative, or of
/// mixed sign.
fn orientation(element: &Element, points: &[[f64; 3]]) -> Orientation {
    let at = |node: u32| points[node as usize];
    let jacobians = match element {
        Element::Tet4(nodes) => vec![tet_volume(&nodes.map(at))],
        Element::Wedge6(nodes) => WEDGE_CORNERS.map(|xi| wedge_jacobian(&nodes.map(at), xi)).to_vec(),
        Element::Hex8(nodes) => HEX_CORNERS.map(|xi| hex_jacobian(&nodes.map(at), xi)).to_vec(),
    };
    if jacobians.iter().all(|&jacobian| jacobian > 0.0) {
        Orientation::Sound
    } else if jacobians.iter().all(|&jacobian| jacobian < 0.0) {
        Orientation::InsideOut
    } else {
        Orientation::Folded
    }
}

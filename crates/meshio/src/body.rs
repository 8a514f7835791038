//! Extracts one body from a file's mesh.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use slipstick_mesh::second_order::{hex27_jacobians, tet10_jacobians};
use slipstick_mesh::{
    Body, Element, FaceNodes, FacetNodes, HEX_CORNERS, HEX_EDGES, HEX_FACE_CENTRES, HEX_FACES, Mesh, MeshError,
    Surface, WEDGE_CORNERS, hex_jacobian, tet_volume, wedge_jacobian,
};

use crate::hexahedra::{in_order, keys, serendipity_centres};
use crate::unusable::refuse_unusable;
use crate::{CellKind, FileMesh, MeshFileError};

/// A body and the changes that were made while reading it.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadBody {
    /// The mesh of only this body, as from a generator of [`slipstick_mesh`].
    pub mesh: Mesh,
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

/// A node of the file that belongs to no element of the body.
const ELSEWHERE: u32 = u32::MAX;
/// A mid-side node that was dropped from the body's elements.
const DROPPED: u32 = u32::MAX - 1;

impl FileMesh {
    /// Extracts a body with the given name: the tetrahedra, wedges and hexahedra of the set `part`
    /// (or of the whole file), with coordinates multiplied by `scale`.
    ///
    /// Nodes and elements keep their order. Hexahedra of 20 nodes get nodes at the centres of their
    /// faces and at their own, which follow the others; they lie on the serendipity shape. If hexahedra or wedges are numbered inside out, bottom
    /// and top are swapped; for tetrahedra, the first two nodes are swapped. An element that
    /// appears twice with the same nodes is used once. A set becomes `{name}_{set}`, or keeps its
    /// name if it already begins with `{name}_`. Sets of triangles, quadrilaterals and faces become
    /// surfaces; sets of nodes, points and lines become node sets; sets of solid cells, sets of elements. Anything on other parts is left
    /// out, and so is a node set with the same name as a surface. Surfaces that are not on the boundary of
    /// the body, such as pretension sections, are listed in [`ReadBody::unusable`].
    ///
    /// # Errors
    /// If there is no such part, if solid cells are not valid tetrahedra, wedges or hexahedra (wedges
    /// only of first order), or if they are of different orders.
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
            (CellKind::Hex27, "hexahedra of 27 nodes", "bottom and top are swapped"),
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
        Ok(ReadBody { mesh, notices, unusable })
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
    /// Nodes at the centres of faces and elements with 20 nodes, by the sorted corners.
    centres: HashMap<Vec<u32>, u32>,
    /// Positions of the body's nodes.
    points: Vec<[f64; 3]>,
}

impl<'a> Extraction<'a> {
    fn new(file: &'a FileMesh, body: &str, part: Option<&str>, order: Order) -> Result<Self, MeshFileError> {
        let chosen = chosen(file, part, order)?;
        refuse_unusable(file, body, part, &chosen, order)?;
        let mut out = Self {
            file,
            order,
            whole: part.is_none(),
            chosen,
            kept: vec![],
            local: vec![],
            centres: HashMap::new(),
            points: vec![],
        };
        out.refuse_mixed_orders()?;
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
        out.points = out.kept.iter().map(|&node| file.points[node as usize]).collect();
        for cell in out.chosen.clone() {
            if out.kind(cell) == CellKind::Hex20 {
                out.complete(cell)?;
            }
        }
        Ok(out)
    }

    /// Elements of different orders do not fit together.
    fn refuse_mixed_orders(&self) -> Result<(), MeshFileError> {
        let second = |cell: &u32| self.kind(*cell).is_second_order();
        let (Some(&linear), Some(&quadratic)) =
            (self.chosen.iter().find(|cell| !second(cell)), self.chosen.iter().find(|cell| second(cell)))
        else {
            return Ok(());
        };
        let other = self.file.cells.number(linear as usize);
        let message = format!("it is of second order, and element {other} of first order");
        let cure =
            "write all elements of the body with the same order, or use `first_order = true` in the body's `mesh`";
        Err(self.at(quadratic, &message, cure))
    }

    /// Adds the nodes at the centres of the faces of a hexahedron of 20 nodes, unless a neighbour has
    /// added them, and at its own centre.
    fn complete(&mut self, cell: u32) -> Result<(), MeshFileError> {
        let nodes = self.nodes(cell);
        let centres = serendipity_centres(nodes, |node| self.file.points[node as usize]);
        for (key, point) in keys(nodes).into_iter().zip(centres) {
            let next = self.points.len() as u32;
            if next >= DROPPED {
                return Err(self.at(cell, "there are too many nodes", "use a coarser mesh"));
            }
            if let std::collections::hash_map::Entry::Vacant(entry) = self.centres.entry(key) {
                entry.insert(next);
                self.points.push(point);
            }
        }
        Ok(())
    }

    /// A node that was added at the centre of a face or element with these corners in the file.
    fn centre(&self, corners: &[u32]) -> Option<u32> {
        let mut key = corners.to_vec();
        key.sort_unstable();
        self.centres.get(&key).copied()
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
            match orientation(&element, &self.points) {
                Orientation::Sound => {}
                Orientation::InsideOut => {
                    turn(&mut element);
                    flipped.push(cell);
                }
                Orientation::Folded => {
                    let (message, cure) = match element {
                        Element::Tet4(_) => ("the tetrahedron is flat", "correct its nodes, or remesh"),
                        Element::Wedge6(_) => ("the wedge is folded or flat", ANGLES),
                        Element::Hex8(_) => ("the hexahedron is folded or flat", ANGLES),
                        Element::Tet10(_) => ("the tetrahedron of 10 nodes is folded or flat", CURVED),
                        Element::Hex27(_) => ("the hexahedron of second order is folded or flat", CURVED),
                    };
                    return Err(self.at(cell, message, cure));
                }
            }
            elements.push(element);
        }
        Ok((elements, flipped))
    }

    /// A cell that must be a genuine tetrahedron, wedge or hexahedron, in the body's nodes.
    fn element(&self, cell: u32) -> Result<Element, MeshFileError> {
        let (kind, nodes) = (self.kind(cell), self.nodes(cell));
        let element = match (kind, nodes) {
            (CellKind::Tet4, &[a, b, c, d]) => Element::Tet4([a, b, c, d]),
            (CellKind::Wedge6, &[a, b, c, d, e, f]) => Element::Wedge6([a, b, c, d, e, f]),
            (CellKind::Hex8, &[a, b, c, d, e, f, g, h]) => Element::Hex8([a, b, c, d, e, f, g, h]),
            (CellKind::Tet10, nodes) if nodes.len() == 10 => Element::Tet10(std::array::from_fn(|i| nodes[i])),
            (CellKind::Hex27, nodes) if nodes.len() == 27 => {
                Element::Hex27(in_order(nodes, |node| self.file.points[node as usize]))
            }
            (CellKind::Hex20, nodes) if nodes.len() == 20 => Element::Hex27(std::array::from_fn(|i| nodes[i.min(19)])),
            _ => return Err(self.at(cell, &format!("a {} cannot be an element", kind.label()), kind.cure())),
        };
        if (1..nodes.len()).any(|i| nodes[..i].contains(&nodes[i])) {
            let cure = "collapsed elements are not supported: write wedges as such (Gmsh: prisms; Abaqus: C3D6; VTK: \
                        type 13), or mesh with true tetrahedra, wedges and hexahedra";
            return Err(self.at(cell, "the element contains a node twice", cure));
        }
        let mut element = element.map(|node| self.local[node as usize]);
        if let (CellKind::Hex20, Element::Hex27(all)) = (kind, &mut element) {
            let centre = |corners: &[usize]| {
                let corners: Vec<u32> = corners.iter().map(|&corner| nodes[corner]).collect();
                self.centre(&corners).expect("completed before")
            };
            for (face, corners) in HEX_FACES.iter().enumerate() {
                all[HEX_FACE_CENTRES[face]] = centre(corners);
            }
            all[26] = centre(&[0, 1, 2, 3, 4, 5, 6, 7]);
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

    fn local_of(&self, nodes: &[u32]) -> Option<FacetNodes> {
        let nodes = FacetNodes::new(nodes).filter(|nodes| nodes.iter().all(|&node| self.has(node)))?;
        Some(nodes.map(|node| self.local[node as usize]))
    }

    /// Surfaces with at least one facet on the body.
    fn surfaces(&self, mesh: &Mesh) -> Result<(BTreeMap<&'a str, Surface>, Unusable<'a>), MeshFileError> {
        let (found, mut unusable) = self.facets(mesh)?;
        let local: Vec<FacetNodes> = found.iter().map(|facet| facet.local).collect();
        let mut surfaces: BTreeMap<&str, Surface> = BTreeMap::new();
        let mut seen = BTreeSet::new();
        // A single call for all sets, since it sorts the faces of the whole body.
        for (SetFacet { set, nodes, .. }, facet) in found.iter().zip(mesh.facets_on_boundary(&local)) {
            match facet {
                Ok(facet) if seen.insert((*set, (facet.element, facet.nodes))) => {
                    surfaces.entry(set).or_default().facets.push(facet);
                }
                Ok(_) => {}
                Err(error) => {
                    let reason = match error {
                        MeshError::NotOnBoundary { reason, .. } => format!("the facet {reason}"),
                        other => other.to_string(),
                    };
                    let place = || format!("surface `{set}`, facet {}", self.around(nodes));
                    let cure = "surfaces must consist of outer faces of the body's elements: correct the set, and mesh \
                                volume and surface together";
                    unusable.entry(set).or_insert_with(|| MeshFileError::new(place(), reason, cure));
                }
            }
        }
        surfaces.retain(|set, _| !unusable.contains_key(set));
        Ok((surfaces, unusable))
    }

    /// The facets of all sets with all their nodes on the body, and the sets with other facets.
    fn facets(&self, mesh: &Mesh) -> Result<(Vec<SetFacet<'a>>, Unusable<'a>), MeshFileError> {
        let (mut facets, mut unusable) = (Vec::new(), Unusable::new());
        let cells = &self.file.cells;
        let faces = second_order_faces(mesh);
        for (set, members) in &self.file.cell_sets {
            for &cell in members.iter().filter(|&&cell| cells.kind(cell as usize).dimension() == 2) {
                let (kind, nodes) = (self.kind(cell), self.nodes(cell));
                if !self.whole && !nodes.iter().all(|&node| self.has(node)) {
                    continue;
                }
                let corners = &nodes[..kind.first_order().node_count()];
                let whole = self.local_of(corners).and_then(|corners| faces.get(&corners.sorted()));
                if let (true, Some(face)) = (kind.is_second_order(), whole) {
                    facets.extend(face.facets().into_iter().map(|local| SetFacet {
                        set,
                        nodes: nodes.to_vec(),
                        local,
                    }));
                    continue;
                }
                let (CellKind::Triangle3 | CellKind::Quad4, Some(_)) = (kind, FacetNodes::new(nodes)) else {
                    let message = format!("a {} of the surface `{set}` is not a face of an element", kind.label());
                    unusable.entry(set).or_insert_with(|| self.at(cell, &message, kind.cure()));
                    continue;
                };
                let Some(local) = self.local_of(nodes) else {
                    let message = format!("a facet of the surface `{set}` has nodes that belong to no element");
                    let cure = "mesh volume and surface together, and merge duplicate nodes";
                    unusable.entry(set).or_insert_with(|| self.at(cell, &message, cure));
                    continue;
                };
                facets.push(SetFacet { set, nodes: nodes.to_vec(), local });
            }
        }
        let chosen: HashSet<u32> = self.chosen.iter().copied().collect();
        for (set, faces) in &self.file.face_sets {
            for face in faces.iter().filter(|face| chosen.contains(&face.cell)) {
                let element = self.element(face.cell)?;
                for side in element.sides_of(usize::from(face.side).min(element.faces() - 1)) {
                    let local = element.side(side);
                    let nodes = local.iter().filter_map(|&node| self.kept.get(node as usize).copied()).collect();
                    facets.push(SetFacet { set, nodes, local });
                }
            }
        }
        Ok((facets, unusable))
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
            self.add_centres(nodes);
        }
        sets.retain(|_, nodes| !nodes.is_empty());
        sets.values_mut().for_each(|nodes| nodes.retain(|&node| node != DROPPED));
        sets
    }
}

impl<'a> Extraction<'a> {
    /// Adds the added centre of each face with all other nodes in the set.
    fn add_centres(&self, set: &mut Vec<u32>) {
        if self.centres.is_empty() {
            return;
        }
        let mut new = Vec::new();
        for &cell in self.chosen.iter().filter(|&&cell| self.kind(cell) == CellKind::Hex20) {
            let nodes = self.nodes(cell);
            let has = |local: usize| set.binary_search(&self.local[nodes[local] as usize]).is_ok();
            for corners in HEX_FACES {
                let on = |edge: &[usize; 2]| edge.iter().all(|corner| corners.contains(corner));
                let middles = (0..12).filter(|&edge| on(&HEX_EDGES[edge])).map(|edge| 8 + edge);
                if corners.into_iter().chain(middles).all(has) {
                    new.extend(self.centre(&corners.map(|corner| nodes[corner])));
                }
            }
        }
        set.extend(new);
        set.sort_unstable();
        set.dedup();
    }

    /// The body's elements in each set of solid cells.
    fn element_sets(&self) -> impl Iterator<Item = (&'a str, Vec<u32>)> {
        self.file.cell_sets.iter().filter_map(|(set, cells)| {
            let own = |(element, cell): (u32, &u32)| cells.binary_search(cell).is_ok().then_some(element);
            let elements: Vec<u32> = (0..).zip(&self.chosen).filter_map(own).collect();
            (!elements.is_empty()).then_some((set.as_str(), elements))
        })
    }
}

/// Sets that cannot be surfaces of the body, and why.
type Unusable<'a> = BTreeMap<&'a str, MeshFileError>;

/// A facet of a set on the body.
struct SetFacet<'a> {
    set: &'a str,
    /// Nodes in the file of the facet or of its face, for messages.
    nodes: Vec<u32>,
    local: FacetNodes,
}

/// Faces of second-order elements by their sorted corners.
fn second_order_faces(mesh: &Mesh) -> HashMap<FacetNodes, FaceNodes> {
    let elements = mesh.elements.iter().filter(|element| element.is_second_order());
    let faces = elements.flat_map(|element| (0..element.faces()).map(|face| element.face(face)));
    let corners = |face: &FaceNodes| FacetNodes::new(&face[..if face.len() == 6 { 3 } else { 4 }]);
    faces.filter_map(|face| Some((corners(&face)?.sorted(), face))).collect()
}

/// Turns an element that is inside out: swaps bottom and top, or two corners of a tetrahedron.
fn turn(element: &mut Element) {
    match element {
        Element::Tet4(nodes) => nodes.swap(0, 1),
        Element::Wedge6(nodes) => nodes.rotate_left(3),
        Element::Hex8(nodes) => nodes.rotate_left(4),
        Element::Tet10(nodes) => [[0, 1], [5, 6], [7, 8]].into_iter().for_each(|[a, b]| nodes.swap(a, b)),
        Element::Hex27(nodes) => {
            nodes[..8].rotate_left(4);
            nodes[8..16].rotate_left(4);
            nodes.swap(24, 25);
        }
    }
}

/// The solid cells of a part, in the file's order, without those that repeat the nodes of an
/// earlier one.
fn chosen(file: &FileMesh, part: Option<&str>, order: Order) -> Result<Vec<u32>, MeshFileError> {
    let mut chosen = file.solid_cells(part);
    if chosen.is_empty() {
        let parts: Vec<&str> = file.parts().collect();
        return Err(match (part, parts.is_empty()) {
            (Some(part), false) => MeshFileError::new(
                format!("part `{part}`"),
                "the file has no such set of solid elements",
                format!("sets of solid elements: {}", parts.join(", ")),
            ),
            (Some(part), true) if !file.solid_cells(None).is_empty() => MeshFileError::new(
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

const CURVED: &str = "correct its nodes: mid-side nodes must lie near the middle of their edges and faces; or use \
                      `first_order = true` in the body's `mesh`";

enum Orientation {
    Sound,
    InsideOut,
    Folded,
}

/// Orientation from the Jacobian determinants at the corners (and other nodes): all positive, all negative, or of
/// mixed sign.
fn orientation(element: &Element, points: &[[f64; 3]]) -> Orientation {
    let at = |node: u32| points[node as usize];
    let jacobians = match element {
        Element::Tet4(nodes) => vec![tet_volume(&nodes.map(at))],
        Element::Wedge6(nodes) => WEDGE_CORNERS.map(|xi| wedge_jacobian(&nodes.map(at), xi)).to_vec(),
        Element::Hex8(nodes) => HEX_CORNERS.map(|xi| hex_jacobian(&nodes.map(at), xi)).to_vec(),
        Element::Tet10(nodes) => tet10_jacobians(&nodes.map(at)),
        Element::Hex27(nodes) => hex27_jacobians(&nodes.map(at)),
    };
    if jacobians.iter().all(|&jacobian| jacobian > 0.0) {
        Orientation::Sound
    } else if jacobians.iter().all(|&jacobian| jacobian < 0.0) {
        Orientation::InsideOut
    } else {
        Orientation::Folded
    }
}

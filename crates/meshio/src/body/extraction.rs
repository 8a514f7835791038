//! The part of a file that becomes a body: its cells, nodes and sets.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use slipstick_mesh::{Element, FaceNodes, FacetNodes, Mesh, MeshError, Surface};

use super::Order;
use super::orientation::{ANGLES, CURVED, Orientation, orientation, turn};
use crate::centres::{Place, complete_element, in_order};
use crate::unusable::refuse_unusable;
use crate::{CellKind, FileMesh, MeshFileError};

/// A mid-side node that was dropped from the body's elements.
const DROPPED: u32 = u32::MAX - 1;
/// A node of the file that belongs to no element of the body.
const ELSEWHERE: u32 = u32::MAX;
/// The part of the file that is extracted.
pub(super) struct Extraction<'a> {
    file: &'a FileMesh,
    order: Order,
    /// Whether all solid cells are extracted.
    whole: bool,
    /// The cells of the body, without cells that repeat the nodes of another.
    pub(super) chosen: Vec<u32>,
    /// The nodes of the body, in the file's order.
    kept: Vec<u32>,
    /// Position in `kept` of each of the file's nodes, or [`ELSEWHERE`] or [`DROPPED`].
    local: Vec<u32>,
    /// Nodes at the centres of faces and elements that lack them in the file, by the sorted corners.
    centres: HashMap<Vec<u32>, u32>,
    /// Positions of the body's nodes.
    pub(super) points: Vec<[f64; 3]>,
}

impl<'a> Extraction<'a> {
    /// The file's numbers of the nodes that it has.
    pub(super) fn numbers(&self) -> Vec<u64> {
        self.kept.iter().map(|&node| self.file.point_numbers[node as usize]).collect()
    }

    pub(super) fn new(file: &'a FileMesh, body: &str, part: Option<&str>, order: Order) -> Result<Self, MeshFileError> {
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
            out.complete(cell)?;
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

    /// The centres that a cell lacks in the file.
    fn lacking(&self, cell: u32) -> &'static [Place] {
        let kind = self.kind(cell);
        if kind.completed().is_some() { kind.centres() } else { &[] }
    }

    /// Adds the centres that a cell lacks, unless a neighbour has added them.
    fn complete(&mut self, cell: u32) -> Result<(), MeshFileError> {
        let nodes = self.nodes(cell);
        for place in self.lacking(cell) {
            let next = self.points.len() as u32;
            if next >= DROPPED {
                return Err(self.at(cell, "there are too many nodes", "use a coarser mesh"));
            }
            if let std::collections::hash_map::Entry::Vacant(entry) = self.centres.entry(place.key(nodes)) {
                entry.insert(next);
                self.points.push(place.position(nodes, |node| self.file.points[node as usize]));
            }
        }
        Ok(())
    }

    /// Shape and order as which a cell is read.
    pub(super) fn kind(&self, cell: u32) -> CellKind {
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
    pub(super) fn elements(&self) -> Result<(Vec<Element>, Vec<u32>), MeshFileError> {
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
                        Element::Wedge18(_) => ("the wedge of second order is folded or flat", CURVED),
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
            (CellKind::Wedge18, nodes) if nodes.len() == 18 => self.ordered(kind, nodes),
            (CellKind::Hex27, nodes) if nodes.len() == 27 => self.ordered(kind, nodes),
            // the first node stands for the centres
            (CellKind::Wedge15, nodes) if nodes.len() == 15 => {
                Element::Wedge18(std::array::from_fn(|i| nodes.get(i).copied().unwrap_or(nodes[0])))
            }
            (CellKind::Hex20, nodes) if nodes.len() == 20 => {
                Element::Hex27(std::array::from_fn(|i| nodes.get(i).copied().unwrap_or(nodes[0])))
            }
            _ => return Err(self.at(cell, &format!("a {} cannot be an element", kind.label()), kind.cure())),
        };
        if (1..nodes.len()).any(|i| nodes[..i].contains(&nodes[i])) {
            let cure = "collapsed elements are not supported: write wedges as such (Gmsh: prisms; Abaqus: C3D6; VTK: \
                        type 13), or mesh with true tetrahedra, wedges and hexahedra";
            return Err(self.at(cell, "the element contains a node twice", cure));
        }
        let element = element.map(|node| self.local[node as usize]);
        let lacking = self.lacking(cell);
        if lacking.is_empty() {
            return Ok(element);
        }
        let mut all = element.nodes().to_vec();
        for place in lacking {
            all[place.node] = self.centres[&place.key(nodes)];
        }
        Ok(complete_element(&all).expect("18 or 27 nodes"))
    }

    /// An element whose centres the file has.
    fn ordered(&self, kind: CellKind, nodes: &[u32]) -> Element {
        let all = in_order(kind, nodes, |node| self.file.points[node as usize]);
        complete_element(&all).expect("18 or 27 nodes")
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
    pub(super) fn surfaces(&self, mesh: &Mesh) -> Result<(BTreeMap<&'a str, Surface>, Unusable<'a>), MeshFileError> {
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
    pub(super) fn node_sets(&self) -> BTreeMap<&'a str, Vec<u32>> {
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
        let mut new: Vec<u32> = Vec::new();
        for &cell in &self.chosen {
            let nodes = self.nodes(cell);
            let has = |local: &usize| set.binary_search(&self.local[nodes[*local] as usize]).is_ok();
            for face in self.lacking(cell).iter().filter(|place| place.corners.len() == 4) {
                if face.corners.iter().chain(&face.middles).all(has) {
                    new.extend(self.centres.get(&face.key(nodes)));
                }
            }
        }
        set.extend(new);
        set.sort_unstable();
        set.dedup();
    }

    /// The body's elements in each set of solid cells.
    pub(super) fn element_sets(&self) -> impl Iterator<Item = (&'a str, Vec<u32>)> {
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

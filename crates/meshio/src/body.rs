//! One body out of a file's mesh.

use std::collections::{BTreeMap, BTreeSet, HashSet};

use slipstick_mesh::{Body, Element, FacetNodes, HEX_CORNERS, Mesh, MeshError, Surface, hex_jacobian, tet_volume};

use crate::{CellKind, FileMesh, MeshFileError};

/// A body that was read, and what was done to it on the way.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadBody {
    /// The body alone, as the generators of [`slipstick_mesh`] make theirs.
    pub mesh: Mesh,
    /// What was repaired or left out, for the user to know.
    pub notices: Vec<String>,
}

/// Node of the file that is not of the body.
const ELSEWHERE: u32 = u32::MAX;

impl FileMesh {
    /// The body of the given name: the tetrahedra and hexahedra of the set `part` (of the whole file without one), with
    /// coordinates multiplied by `scale`.
    ///
    /// Nodes and elements keep their order. Hexahedra that are numbered inside out get bottom and top swapped, tetrahedra
    /// their first two nodes; an element that stands twice with the same nodes is taken once. Sets become `{name}_{set}`,
    /// or keep their name if it begins so already: of triangles, quadrilaterals and faces, surfaces; of nodes, points and
    /// lines, node sets. What lies on other parts
    /// is left out, and so is a set of nodes that a surface has the name of.
    ///
    /// # Errors
    /// No such part, a solid cell that is no sound tetrahedron or hexahedron, or a facet on the body's nodes that is not on
    /// its boundary.
    pub fn body(&self, name: &str, part: Option<&str>, scale: f64) -> Result<ReadBody, MeshFileError> {
        let extraction = Extraction::new(self, part)?;
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
        let mut notices = self.notices.clone();
        for (kind, what, repair) in [
            (CellKind::Hex8, "hexahedra", "bottom and top are swapped"),
            (CellKind::Tet4, "tetrahedra", "two nodes are swapped"),
        ] {
            let cells: Vec<u32> = flipped.iter().copied().filter(|&c| self.cells.kind(c as usize) == kind).collect();
            if let [first, ..] = cells[..] {
                notices.push(format!(
                    "{} {what} are numbered inside out (the first: element {}); {repair}",
                    cells.len(),
                    self.cells.number(first as usize)
                ));
            }
        }
        for (set, nodes) in extraction.node_sets() {
            match mesh.surfaces.get(&own(set)) {
                Some(surface) if surface.nodes() == nodes => {}
                Some(_) => notices.push(format!("the node set `{set}` is left out: a surface has its name")),
                None if mesh.node_sets.insert(own(set), nodes).is_some() => return Err(doubled(&own(set))),
                None => {}
            }
        }
        Ok(ReadBody { mesh, notices })
    }
}

/// Two sets would have one name.
fn doubled(name: &str) -> MeshFileError {
    let message = format!("two sets of the file are called `{name}` on this body");
    MeshFileError::new("the file", message, "rename one of them")
}

/// What is taken out of the file.
struct Extraction<'a> {
    file: &'a FileMesh,
    /// Whether all solid cells are.
    whole: bool,
    /// The cells of the body, each set of nodes once.
    chosen: Vec<u32>,
    /// The nodes of the body, in the file's order.
    kept: Vec<u32>,
    /// Position in `kept` of each of the file's nodes, or [`ELSEWHERE`].
    local: Vec<u32>,
}

impl<'a> Extraction<'a> {
    fn new(file: &'a FileMesh, part: Option<&str>) -> Result<Self, MeshFileError> {
        let chosen = chosen(file, part)?;
        let mut local = vec![ELSEWHERE; file.points.len()];
        for &node in chosen.iter().flat_map(|&cell| file.cells.nodes(cell as usize)) {
            local[node as usize] = 0;
        }
        let kept: Vec<u32> = (0..).zip(&local).filter(|&(_, &mark)| mark == 0).map(|(node, _)| node).collect();
        (0..).zip(&kept).for_each(|(position, &node)| local[node as usize] = position);
        Ok(Self { file, whole: part.is_none(), chosen, kept, local })
    }

    /// The elements by the body's nodes, and those cells that were inside out.
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
                        Element::Hex8(nodes) => nodes.rotate_left(4),
                    }
                    flipped.push(cell);
                }
                Orientation::Folded => {
                    let (message, cure) = match element {
                        Element::Tet4(_) => ("the tetrahedron is flat", "correct its nodes, or mesh anew"),
                        Element::Hex8(_) => (
                            "the hexahedron is folded or flat",
                            "correct its nodes: all angles must be below 180°, in the order of Gmsh, Abaqus and VTK",
                        ),
                    };
                    return Err(self.at(cell, message, cure));
                }
            }
            elements.push(element.map(|node| self.local[node as usize]));
        }
        Ok((elements, flipped))
    }

    /// A cell that must be a true tetrahedron or hexahedron, by the file's nodes.
    fn element(&self, cell: u32) -> Result<Element, MeshFileError> {
        let kind = self.file.cells.kind(cell as usize);
        let nodes = self.file.cells.nodes(cell as usize);
        let element = match (kind, nodes) {
            (CellKind::Tet4, &[a, b, c, d]) => Element::Tet4([a, b, c, d]),
            (CellKind::Hex8, &[a, b, c, d, e, f, g, h]) => Element::Hex8([a, b, c, d, e, f, g, h]),
            _ => return Err(self.at(cell, &format!("a {} is no element that can be used", kind.name()), kind.cure())),
        };
        if (1..nodes.len()).any(|i| nodes[..i].contains(&nodes[i])) {
            let cure = "collapsed elements cannot be used: mesh with true tetrahedra or hexahedra";
            return Err(self.at(cell, "the element names a node twice", cure));
        }
        Ok(element)
    }

    /// An error at a cell: its number, position and nodes.
    fn at(&self, cell: u32, message: &str, cure: &str) -> MeshFileError {
        let nodes = self.file.cells.nodes(cell as usize);
        let place = format!("element {} {}", self.file.cells.number(cell as usize), self.around(nodes));
        MeshFileError::new(place, message, cure)
    }

    /// Where some nodes are, and their numbers.
    fn around(&self, nodes: &[u32]) -> String {
        let points = nodes.iter().map(|&node| self.file.points[node as usize]);
        let mut mean = [0.0; 3];
        points.for_each(|x| (0..3).for_each(|c| mean[c] += x[c] / nodes.len() as f64));
        let numbers: Vec<u64> = nodes.iter().map(|&node| self.file.point_numbers[node as usize]).collect();
        format!("at ({:.4}, {:.4}, {:.4}), nodes {numbers:?}", mean[0], mean[1], mean[2])
    }

    fn local_of(&self, nodes: FacetNodes) -> Option<FacetNodes> {
        let local = nodes.map(|node| self.local[node as usize]);
        (!local.contains(&ELSEWHERE)).then_some(local)
    }

    /// Surfaces with at least one facet on the body.
    fn surfaces(&self, mesh: &Mesh) -> Result<BTreeMap<&'a str, Surface>, MeshFileError> {
        let found = self.facets()?;
        let local: Vec<FacetNodes> = found.iter().map(|facet| facet.local).collect();
        // One call for all: it sorts the faces of the whole body.
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

    /// The facets of all sets that have all their nodes on the body.
    fn facets(&self) -> Result<Vec<SetFacet<'a>>, MeshFileError> {
        let mut facets = Vec::new();
        let cells = &self.file.cells;
        for (set, members) in &self.file.cell_sets {
            for &cell in members.iter().filter(|&&cell| cells.kind(cell as usize).dimension() == 2) {
                let nodes = cells.nodes(cell as usize);
                if !self.whole && nodes.iter().any(|&node| self.local[node as usize] == ELSEWHERE) {
                    continue;
                }
                let kind = cells.kind(cell as usize);
                let (CellKind::Triangle3 | CellKind::Quad4, Some(nodes)) = (kind, FacetNodes::new(nodes)) else {
                    let message = format!("a {} of the surface `{set}` is no face of an element", kind.name());
                    return Err(self.at(cell, &message, kind.cure()));
                };
                let Some(local) = self.local_of(nodes) else {
                    let message = format!("a facet of the surface `{set}` has nodes that no element has");
                    return Err(self.at(cell, &message, "mesh volume and surface together, and merge doubled nodes"));
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

    /// Node sets, and sets of points and lines, with at least one node on the body.
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
        sets
    }
}

/// A facet of a set on the body.
struct SetFacet<'a> {
    set: &'a str,
    nodes: FacetNodes,
    local: FacetNodes,
}

/// The solid cells of a part, in the file's order, without those that repeat the nodes of an earlier one.
fn chosen(file: &FileMesh, part: Option<&str>) -> Result<Vec<u32>, MeshFileError> {
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
                "leave `part` out, or name the volume (Gmsh: a physical volume; Abaqus: *ELSET)",
            ),
            _ => MeshFileError::new(
                "the file",
                "there are no solid elements",
                "mesh the volume and save it (Gmsh: a physical volume, or Mesh.SaveAll = 1)",
            ),
        });
    }
    let mut seen = HashSet::with_capacity(chosen.len());
    chosen.retain(|&cell| seen.insert(file.cells.nodes(cell as usize)));
    Ok(chosen)
}

enum Orientation {
    Sound,
    InsideOut,
    Folded,
}

/// By the Jacobian determinants at the corners: all positive, all negative, or not of one sign.
fn orientation(element: &Element, points: &[[f64; 3]]) -> Orientation {
    let at = |node: u32| points[node as usize];
    let jacobians = match element {
        Element::Tet4(nodes) => vec![tet_volume(&nodes.map(at))],
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

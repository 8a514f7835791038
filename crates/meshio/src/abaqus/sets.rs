//! Sets, given by numbers or by names of other sets, resolved when all nodes and elements are
//! known.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet, VecDeque};

use slipstick_mesh::{Element, HEX_FACES, TET_FACES, WEDGE_QUADRILATERALS, WEDGE_TRIANGLES};

use super::lines::number;
use crate::builder::Numbers;
use crate::centres::{complete_element, in_order};
use crate::cursor::shortened;
use crate::{CellKind, ElementFace, FileMesh, MeshFileError};

/// The members that a line adds to a set, with the number of the line.
enum Member {
    One(u64),
    /// From the first to the second number in steps of the third; numbers that do not exist are
    /// skipped.
    Range([u64; 3]),
    Set(String),
    NodesOfElements(String),
}

/// Signed numbers of Gmsh's entities, which the Python package meshio writes as a set of elements.
const MESHIO_ENTITIES: &str = "gmsh:bounding_entities";

/// Members of sets, each with its line, in the order of the file; a name can appear several times.
#[derive(Default)]
struct Definitions {
    members: Vec<Definition>,
}

/// The name of a set and its members, each with its line.
type Definition = (String, Vec<(usize, Member)>);

impl Definitions {
    fn add(&mut self, name: &str, line: usize, member: Member) {
        match self.members.last_mut() {
            Some((last, members)) if last == name => members.push((line, member)),
            _ => self.members.push((name.to_owned(), vec![(line, member)])),
        }
    }

    fn line(&mut self, name: &str, line: usize, fields: &[&str], generate: bool) -> Result<(), MeshFileError> {
        if generate {
            let member = match *fields {
                [first, last] => [number(first, line)?, number(last, line)?, 1],
                [first, last, step] => [number(first, line)?, number(last, line)?, number(step, line)?.max(1)],
                _ => {
                    return Err(error(
                        line,
                        "GENERATE needs a first number, a last number and a step",
                        "give three numbers",
                    ));
                }
            };
            self.add(name, line, Member::Range(member));
            return Ok(());
        }
        for field in fields.iter().filter(|field| !field.is_empty()) {
            let member = match field.parse() {
                Ok(number) => Member::One(number),
                Err(_) => Member::Set(field.trim_matches('"').to_owned()),
            };
            self.add(name, line, member);
        }
        Ok(())
    }
}

impl Definitions {
    /// The definitions, each after those of the sets that it names.
    fn in_order(self) -> Result<Vec<Definition>, MeshFileError> {
        let mut groups: BTreeMap<String, Vec<(usize, Member)>> = BTreeMap::new();
        let mut order: Vec<String> = Vec::new();
        for (name, members) in self.members {
            if !groups.contains_key(&name) {
                order.push(name.clone());
            }
            groups.entry(name).or_default().extend(members);
        }
        let lower: HashMap<String, String> =
            order.iter().rev().map(|name| (name.to_ascii_lowercase(), name.clone())).collect();
        // the sets that a set names and that are not yet placed
        let mut wanted: HashMap<&str, HashSet<&str>> = HashMap::new();
        let mut users: HashMap<&str, Vec<&str>> = HashMap::new();
        for (name, members) in &groups {
            let named = members.iter().filter_map(|(_, member)| match member {
                Member::Set(set) if groups.contains_key(set) => Some(groups.get_key_value(set)?.0.as_str()),
                Member::Set(set) => lower.get(&set.to_ascii_lowercase()).map(String::as_str),
                _ => None,
            });
            let named: HashSet<&str> = named.filter(|other| other != name).collect();
            named.iter().for_each(|other| users.entry(other).or_default().push(name));
            wanted.insert(name, named);
        }
        let mut ready: VecDeque<&str> =
            order.iter().map(String::as_str).filter(|name| wanted[name].is_empty()).collect();
        let mut placed: Vec<String> = Vec::new();
        while let Some(name) = ready.pop_front() {
            placed.push(name.to_owned());
            for user in users.remove(name).unwrap_or_default() {
                if wanted.get_mut(user).is_some_and(|wanted| wanted.remove(name) && wanted.is_empty()) {
                    ready.push_back(user);
                }
            }
        }
        if let Some(name) = order.iter().find(|name| !wanted[name.as_str()].is_empty()) {
            let message = format!("the set `{}` contains itself through other sets", shortened(name));
            return Err(error(groups[name][0].0, message, "remove one of the references"));
        }
        Ok(placed.into_iter().filter_map(|name| groups.remove_entry(&name)).collect())
    }
}

/// All sets and surfaces of a file.
#[derive(Default)]
pub(super) struct Sets {
    nodes: Definitions,
    elements: Definitions,
    faces: Vec<Faces>,
    /// Sets with a solid section.
    sections: Vec<String>,
    /// Numbers of elements of types that are not read.
    pub skipped: HashSet<u64>,
}

/// One line of a surface.
struct Faces {
    surface: String,
    line: usize,
    of: Member,
    side: Side,
}

#[derive(Clone, Copy)]
enum Side {
    /// A face of a solid, from 0.
    Solid(u8),
    /// The facet itself, of a shell or membrane.
    Shell,
    /// All faces of solids that no other solid shares.
    Free,
}

impl Sets {
    pub fn node(&mut self, set: &str, number: u64, line: usize) {
        self.nodes.add(set, line, Member::One(number));
    }

    pub fn element(&mut self, set: &str, number: u64, line: usize) {
        self.elements.add(set, line, Member::One(number));
    }

    pub fn nodes(&mut self, set: &str, line: usize, fields: &[&str], generate: bool) -> Result<(), MeshFileError> {
        self.nodes.line(set, line, fields, generate)
    }

    pub fn elements(&mut self, set: &str, line: usize, fields: &[&str], generate: bool) -> Result<(), MeshFileError> {
        self.elements.line(set, line, fields, generate)
    }

    pub fn nodes_of_elements(&mut self, set: String, elements: &str, line: usize) {
        self.nodes.add(&set, line, Member::NodesOfElements(elements.to_owned()));
    }

    /// A set of elements that a solid section names.
    pub fn section(&mut self, set: &str) {
        self.sections.push(set.to_owned());
    }

    /// A line of a surface: an element or a set, and a face.
    pub fn faces(&mut self, surface: &str, line: usize, fields: &[&str]) -> Result<(), MeshFileError> {
        let of = match fields[0].parse() {
            Ok(number) => Member::One(number),
            Err(_) => Member::Set(fields[0].trim_matches('"').to_owned()),
        };
        let side = match fields.get(1).copied().unwrap_or_default().to_ascii_uppercase().as_str() {
            "" => Side::Free,
            "SPOS" | "SNEG" => Side::Shell,
            "S1" => Side::Solid(0),
            "S2" => Side::Solid(1),
            "S3" => Side::Solid(2),
            "S4" => Side::Solid(3),
            "S5" => Side::Solid(4),
            "S6" => Side::Solid(5),
            other => {
                let message = format!("`{}` is not a face of an element", shortened(other));
                return Err(error(line, message, "name the face: S1 to S6, or SPOS for a shell"));
            }
        };
        self.faces.push(Faces { surface: surface.to_owned(), line, of, side });
        Ok(())
    }

    /// Adds the sets to the mesh.
    pub fn resolve(self, mesh: &mut FileMesh, nodes: &Numbers) -> Result<(), MeshFileError> {
        let elements = Numbers::new(&mesh.cells.numbers).map_err(|number| {
            let message = "the element is defined twice";
            MeshFileError::new(format!("element {number}"), message, "give each element a unique number")
        })?;
        let mut room = Room(64 * (mesh.points.len() + mesh.cells.len()) + 1000);
        for (name, members) in self.elements.in_order()? {
            if name.eq_ignore_ascii_case(MESHIO_ENTITIES) {
                continue;
            }
            for (line, member) in members {
                let found = members_of(&member, line, &elements, &mesh.cell_sets, &self.skipped, "element")?;
                extend(mesh.cell_sets.entry(name.clone()).or_default(), found, &mut room, line)?;
            }
        }
        mesh.cell_sets.values_mut().for_each(sort);
        for (name, members) in self.nodes.in_order()? {
            for (line, member) in members {
                let found = match &member {
                    Member::NodesOfElements(set) => {
                        let cells = find(&mesh.cell_sets, set).ok_or_else(|| unknown(line, set))?;
                        cells.iter().flat_map(|&cell| mesh.cells.nodes(cell as usize)).copied().collect()
                    }
                    _ => members_of(&member, line, nodes, &mesh.node_sets, &HashSet::new(), "node")?,
                };
                extend(mesh.node_sets.entry(name.clone()).or_default(), found, &mut room, line)?;
            }
        }
        mesh.node_sets.values_mut().for_each(sort);
        let mut free: Option<FreeFaces> = None;
        for Faces { surface, line, of, side } in self.faces {
            if let Member::Set(name) = &of {
                mesh.sets_of_faces.extend(known(&mesh.cell_sets, name));
            }
            let found = members_of(&of, line, &elements, &mesh.cell_sets, &self.skipped, "element")?;
            match side {
                Side::Free => {
                    let free = free.get_or_insert_with(|| FreeFaces::new(mesh));
                    let (solid, shells): (Vec<u32>, Vec<u32>) =
                        found.into_iter().partition(|&cell| mesh.cells.kind(cell as usize).dimension() == 3);
                    let faces = solid.into_iter().flat_map(|cell| free.of(mesh, cell)).collect();
                    extend(mesh.face_sets.entry(surface.clone()).or_default(), faces, &mut room, line)?;
                    if !shells.is_empty() {
                        add_faces(mesh, &surface, shells, Side::Shell, &mut room, line)?;
                    }
                }
                side => add_faces(mesh, &surface, found, side, &mut room, line)?,
            }
        }
        for section in &self.sections {
            let set = known(&mesh.cell_sets, section).filter(|set| !mesh.sections.contains(set));
            mesh.sections.extend(set);
        }
        mesh.cell_sets.values_mut().for_each(sort);
        mesh.face_sets.values_mut().for_each(sort);
        Ok(())
    }
}

/// How many solids have each face, by its sorted corners.
struct FreeFaces(HashMap<Vec<u32>, usize>);

impl FreeFaces {
    fn new(mesh: &FileMesh) -> Self {
        let mut counts = HashMap::new();
        for cell in mesh.solid_cells(None) {
            Self::corners(mesh, cell).into_iter().for_each(|face| *counts.entry(face).or_default() += 1);
        }
        Self(counts)
    }

    /// The faces of a solid that no other one has.
    fn of<'a>(&'a self, mesh: &FileMesh, cell: u32) -> impl Iterator<Item = ElementFace> + use<'a> {
        let faces = Self::corners(mesh, cell).into_iter().enumerate();
        faces
            .filter(|(_, face)| self.0.get(face) == Some(&1))
            .map(move |(side, _)| ElementFace { cell, side: side as u8 })
    }

    /// The sorted corners of each face.
    fn corners(mesh: &FileMesh, cell: u32) -> Vec<Vec<u32>> {
        let mut faces = mesh.corners_of_faces(cell);
        faces.iter_mut().for_each(|corners| corners.sort_unstable());
        faces
    }
}

impl FileMesh {
    /// The corners of each face of a solid, in Abaqus' order of faces, counter-clockwise seen from outside; none of a
    /// pyramid.
    fn corners_of_faces(&self, cell: u32) -> Vec<Vec<u32>> {
        let nodes = self.cells.nodes(cell as usize);
        let faces: Vec<&[usize]> = match self.cells.kind(cell as usize).first_order() {
            CellKind::Tet4 => TET_FACES.iter().map(|face| &face[..]).collect(),
            CellKind::Wedge6 => {
                WEDGE_TRIANGLES.iter().map(|f| &f[..]).chain(WEDGE_QUADRILATERALS.iter().map(|f| &f[..])).collect()
            }
            CellKind::Hex8 => HEX_FACES.iter().map(|face| &face[..]).collect(),
            _ => Vec::new(),
        };
        faces.into_iter().map(|face| face.iter().map(|&corner| nodes[corner]).collect()).collect()
    }

    /// The corners of faces of solids, counter-clockwise seen from outside; those of pyramids are left out.
    pub fn corners_of(&self, faces: &[ElementFace]) -> Vec<Vec<u32>> {
        let corners = |face: &ElementFace| self.corners_of_faces(face.cell).get(usize::from(face.side)).cloned();
        faces.iter().filter_map(corners).collect()
    }

    /// All nodes of faces of solids, also between corners and at centres.
    pub fn nodes_of_faces(&self, faces: &[ElementFace]) -> BTreeSet<u32> {
        let between = |face: &ElementFace| {
            let (kind, nodes) = (self.cells.kind(face.cell as usize), self.cells.nodes(face.cell as usize));
            let element = match kind {
                CellKind::Tet10 => Element::Tet10(std::array::from_fn(|i| nodes[i])),
                CellKind::Wedge18 | CellKind::Hex27 => {
                    complete_element(&in_order(kind, nodes, |node| self.points[node as usize]))?
                }
                _ => return None,
            };
            Some(element.face(usize::from(face.side)).to_vec())
        };
        let corners = self.corners_of(faces).into_iter().flatten();
        corners.chain(faces.iter().filter_map(between).flatten()).collect()
    }

    /// Faces of solids that no other solid shares and whose corners are all among these nodes.
    pub fn free_faces(&self, nodes: &HashSet<u32>) -> Vec<ElementFace> {
        let free = FreeFaces::new(self);
        let touched = self
            .solid_cells(None)
            .into_iter()
            .filter(|&cell| self.cells.nodes(cell as usize).iter().filter(|node| nodes.contains(node)).count() > 2);
        let inside = |face: &ElementFace| {
            let corners = &FreeFaces::corners(self, face.cell)[usize::from(face.side)];
            corners.iter().all(|corner| nodes.contains(corner))
        };
        touched.flat_map(|cell| free.of(self, cell).filter(inside).collect::<Vec<_>>()).collect()
    }

    /// Faces of solids that no other solid shares and that have a corner among these nodes.
    pub fn free_faces_at(&self, nodes: &HashSet<u32>) -> Vec<ElementFace> {
        let free = FreeFaces::new(self);
        let cells = self.solid_cells(None).into_iter();
        let touched = cells.filter(|&cell| self.cells.nodes(cell as usize).iter().any(|node| nodes.contains(node)));
        let at = |face: &ElementFace| {
            let corners = &FreeFaces::corners(self, face.cell)[usize::from(face.side)];
            corners.iter().any(|corner| nodes.contains(corner))
        };
        touched.flat_map(|cell| free.of(self, cell).filter(at).collect::<Vec<_>>()).collect()
    }

    /// The area of a face between its corners, along its outward normal. \[L²\]
    pub fn area_vector(&self, face: ElementFace) -> [f64; 3] {
        let corners = self.corners_of(&[face]).pop().unwrap_or_default();
        let point = |at: usize| self.points[corners[at % corners.len()] as usize];
        let mut area = [0.0; 3];
        for at in 0..corners.len() {
            let (p, q) = (point(at), point(at + 1));
            for c in 0..3 {
                area[c] += 0.5 * (p[(c + 1) % 3] * q[(c + 2) % 3] - p[(c + 2) % 3] * q[(c + 1) % 3]);
            }
        }
        area
    }
}

/// Adds faces of elements to a surface: faces of solids to the set of faces, shells to the set of
/// cells with the same name.
fn add_faces(
    mesh: &mut FileMesh,
    name: &str,
    cells: Vec<u32>,
    side: Side,
    room: &mut Room,
    line: usize,
) -> Result<(), MeshFileError> {
    let dimension = if matches!(side, Side::Solid(_)) { 3 } else { 2 };
    if let Some(&cell) = cells.iter().find(|&&cell| mesh.cells.kind(cell as usize).dimension() != dimension) {
        let (kind, number) = (mesh.cells.kind(cell as usize).name(), mesh.cells.number(cell as usize));
        let message = format!("element {number}, a {kind}, has no such face");
        return Err(error(line, message, "solids have faces S1 to S6, shells SPOS and SNEG"));
    }
    let sides = |cell: u32| match mesh.cells.kind(cell as usize).first_order() {
        CellKind::Tet4 => 4,
        CellKind::Pyramid5 | CellKind::Wedge6 => 5,
        _ => 6,
    };
    if let Side::Solid(side) = side
        && let Some(&cell) = cells.iter().find(|&&cell| side >= sides(cell))
    {
        let (kind, number) = (mesh.cells.kind(cell as usize).name(), mesh.cells.number(cell as usize));
        let message = format!("element {number}, a {kind}, has no face S{}", side + 1);
        return Err(error(line, message, "tetrahedra have faces S1 to S4, wedges S1 to S5, hexahedra S1 to S6"));
    }
    match side {
        Side::Shell | Side::Free => extend(mesh.cell_sets.entry(name.to_owned()).or_default(), cells, room, line),
        Side::Solid(side) => {
            let faces = cells.into_iter().map(|cell| ElementFace { cell, side }).collect();
            extend(mesh.face_sets.entry(name.to_owned()).or_default(), faces, room, line)
        }
    }
}

/// Positions of the items that a member refers to.
fn members_of(
    member: &Member,
    line: usize,
    numbers: &Numbers,
    sets: &BTreeMap<String, Vec<u32>>,
    skipped: &HashSet<u64>,
    what: &str,
) -> Result<Vec<u32>, MeshFileError> {
    match member {
        Member::One(number) => match numbers.position(*number) {
            Some(position) => Ok(vec![position]),
            None if skipped.contains(number) => Ok(Vec::new()),
            None => Err(error(line, format!("there is no {what} {number}"), "remove it from the set")),
        },
        Member::Range([first, last, step]) => {
            let range = numbers.range(*first, *last).filter(|(number, _)| (number - first).is_multiple_of(*step));
            Ok(range.map(|(_, position)| position).collect())
        }
        Member::Set(name) | Member::NodesOfElements(name) => {
            find(sets, name).cloned().ok_or_else(|| unknown(line, name))
        }
    }
}

/// The set with this name: with the same case, otherwise ignoring case.
fn find<'a, T>(sets: &'a BTreeMap<String, T>, name: &str) -> Option<&'a T> {
    let alike = || sets.iter().find(|(other, _)| other.eq_ignore_ascii_case(name)).map(|(_, set)| set);
    sets.get(name).or_else(alike)
}

/// The name of the set that [`find`] finds.
fn known<T>(sets: &BTreeMap<String, T>, name: &str) -> Option<String> {
    let alike = || sets.keys().find(|other| other.eq_ignore_ascii_case(name)).cloned();
    sets.contains_key(name).then(|| name.to_owned()).or_else(alike)
}

fn unknown(line: usize, set: &str) -> MeshFileError {
    let message = format!("there is no set `{}`", shortened(set));
    error(line, message, "define it, or remove it here")
}

fn error(line: usize, message: impl Into<String>, cure: impl Into<String>) -> MeshFileError {
    MeshFileError::new(format!("line {line}"), message, cure)
}

fn sort<T: Ord>(members: &mut Vec<T>) {
    members.sort_unstable();
    members.dedup();
}

/// How many more entries sets may hold: nested names of sets would let a small file request a lot
/// of memory.
struct Room(usize);

fn extend<T>(set: &mut Vec<T>, found: Vec<T>, room: &mut Room, line: usize) -> Result<(), MeshFileError> {
    room.0 = room.0.checked_sub(found.len()).ok_or_else(|| {
        error(
            line,
            "the sets contain far more entries than there are nodes and elements",
            "remove sets that repeat others",
        )
    })?;
    set.extend(found);
    Ok(())
}

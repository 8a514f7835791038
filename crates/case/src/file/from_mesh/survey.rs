//! Surveys the contents of a mesh file, and which of its surfaces face each other.

use std::cmp::Reverse;
use std::collections::BTreeSet;

use nalgebra::Vector3;
use slipstick_mesh::{Mesh, Surface, facet_area_vector};
use slipstick_meshio::{FileMesh, MeshFileError};

use super::pairs::{self, Measured};

/// Maximum number of facets of a surface that are compared with those of another one.
const SAMPLES: usize = 400;

/// Maximum cosine of the angle between the normals of facets that face each other.
const OPPOSED: f64 = -0.7;

/// Minimum fraction of its area that a plane surface has in projection.
const PLANE: f64 = 0.999;

/// Maximum number of bodies that are considered for contact: the largest ones.
const MOST_BODIES: usize = 8;

type Point = Vector3<f64>;

/// A body of the file.
pub struct Part {
    /// Its name in the case.
    pub name: String,
    /// The set of the file that makes up the body; `None`: the whole file.
    pub part: Option<String>,
    /// Its mesh.
    pub mesh: Mesh,
    /// Its named surfaces; if there are none, the parts of its skin that face the six coordinate
    /// directions.
    pub faces: Vec<Face>,
    /// Lowest and highest corner.
    pub bounds: [Point; 2],
    /// Volume.
    pub volume: f64,
}

impl Part {
    /// Edge length of a cube with the mean volume of the elements.
    pub fn element_size(&self) -> f64 {
        (self.volume / self.mesh.elements.len() as f64).cbrt()
    }

    /// Lowest and highest corner of a surface.
    pub fn bounds_of(&self, face: &Face) -> [Point; 2] {
        let nodes = face.nodes.iter().map(|&node| Point::from(self.mesh.nodes[node as usize]));
        let (low, high) = (Point::repeat(f64::INFINITY), Point::repeat(f64::NEG_INFINITY));
        nodes.fold([low, high], |[low, high], x| [low.inf(&x), high.sup(&x)])
    }

    /// Its extent along a direction: smallest and largest coordinate.
    pub fn range(&self, direction: &Point) -> [f64; 2] {
        let along = self.mesh.nodes.iter().map(|node| Point::from(*node).dot(direction));
        along.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
    }
}

/// A surface of a body.
pub struct Face {
    /// Its name in the case.
    pub name: String,
    /// The direction by which the case selects the surface, if the file does not name it.
    pub selected: Option<[f64; 3]>,
    pub nodes: Vec<u32>,
    centroids: Vec<Point>,
    areas: Vec<Point>,
}

impl Face {
    fn new(mesh: &Mesh, name: &str, surface: &Surface, selected: Option<[f64; 3]>) -> Self {
        let corners: Vec<_> = surface.facets.iter().map(|facet| mesh.facet_coordinates(facet)).collect();
        let centroid = |facet: &slipstick_mesh::Facet| {
            let nodes: Vec<Point> = facet.nodes.iter().map(|&node| Point::from(mesh.nodes[node as usize])).collect();
            nodes.iter().sum::<Point>() / nodes.len() as f64
        };
        Self {
            name: name.to_owned(),
            selected,
            nodes: surface.nodes(),
            centroids: surface.facets.iter().map(centroid).collect(),
            areas: corners.iter().map(|corners| Point::from(facet_area_vector(corners))).collect(),
        }
    }

    /// Number of facets.
    pub fn facets(&self) -> usize {
        self.areas.len()
    }

    /// Area.
    pub fn area(&self) -> f64 {
        self.areas.iter().map(|area| area.norm()).sum()
    }

    /// Mean of the centroids.
    pub fn centre(&self) -> Point {
        self.centroids.iter().sum::<Point>() / self.centroids.len().max(1) as f64
    }

    /// Direction of the mean outward normal; zero for a closed surface.
    pub fn direction(&self) -> Point {
        self.areas.iter().sum::<Point>().try_normalize(1e-6 * self.area()).unwrap_or_else(Point::zeros)
    }

    /// Whether the surface is plane.
    pub fn is_plane(&self) -> bool {
        self.areas.iter().sum::<Point>().norm() > PLANE * self.area()
    }

    /// Whether all of its nodes are nodes of another surface of the body.
    pub fn is_within(&self, other: &Self) -> bool {
        self.nodes.iter().all(|node| other.nodes.binary_search(node).is_ok())
    }

    /// Positive if the surface is convex, negative if it is concave, close to zero if it is plane: the mean of the
    /// cosine between the normals and the directions from the centre.
    pub fn convexity(&self) -> f64 {
        let centre = self.centre();
        let cosine = |(at, area): (&Point, &Point)| (at - centre).try_normalize(0.0).map_or(0.0, |out| out.dot(area));
        self.centroids.iter().zip(&self.areas).map(cosine).sum::<f64>() / self.area()
    }

    /// The share of the surface that presses along a direction: the mean square of the cosine between them.
    pub fn bearing(&self, direction: &Point) -> f64 {
        let share = |area: &Point| area.dot(direction).powi(2) / area.norm();
        self.areas.iter().map(share).sum::<f64>() / self.area()
    }

    /// Side length of a square with the mean area of the facets.
    pub(super) fn facet_size(&self) -> f64 {
        (self.area() / self.facets().max(1) as f64).sqrt()
    }
}

/// Two surfaces that face each other.
pub struct Pair {
    /// Body and surface that carry the multipliers.
    pub slave: [usize; 2],
    /// The other body and surface.
    pub master: [usize; 2],
    /// Smallest and largest distance along the normals; negative if they overlap. If it was not measured on the
    /// geometry, both are the smallest distance of the facets.
    pub gap: [f64; 2],
    /// Why this is the slave, if the names of the surfaces make them a pair.
    pub reason: Option<&'static str>,
    pub(super) worth: f64,
}

impl Pair {
    /// Whether a body is on either side.
    pub fn has(&self, body: usize) -> bool {
        self.slave[0] == body || self.master[0] == body
    }
}

/// The bodies of a file and where they face each other.
pub struct Survey {
    /// The bodies, the largest first.
    pub parts: Vec<Part>,
    /// The pairs that the names of the surfaces make; otherwise the pair that is most likely in contact. The first
    /// one has the largest area.
    pub pairs: Vec<Pair>,
    /// Number of solid elements of the file that are in no body.
    pub left_out: usize,
}

impl Survey {
    /// Surveys all parts of a file.
    ///
    /// # Errors
    /// If a part of it cannot be used.
    pub fn new(file: &FileMesh, measured: &[Measured]) -> Result<Self, MeshFileError> {
        let mut parts = Vec::new();
        for (part, name) in disjoint(file) {
            parts.push(read(file, part, name)?);
        }
        parts.sort_by(|a: &Part, b| b.volume.total_cmp(&a.volume));
        let mut pairs = pairs::named(&parts, measured);
        if pairs.is_empty() {
            pairs.extend(best_pair(&parts));
        }
        let taken: BTreeSet<u32> = parts.iter().flat_map(|part| file.solid_cells(part.part.as_deref())).collect();
        let left_out = file.solid_cells(None).len() - taken.len();
        Ok(Self { parts, pairs, left_out })
    }
}

/// The sets of a file that become bodies, with the names of the bodies: those with a section of an
/// Abaqus deck; otherwise disjoint sets that cover as much of the file as possible, the small ones
/// first, without sets that only serve to define surfaces. Without any sets, the whole file is one
/// body.
fn disjoint(file: &FileMesh) -> Vec<(Option<String>, String)> {
    let sections = file.sections.iter().map(String::as_str);
    let sections: Vec<&str> = sections.filter(|set| !file.solid_cells(Some(set)).is_empty()).collect();
    let sets = match sections.is_empty() {
        false => without_overlap(file, sections).0,
        true => {
            let all: Vec<&str> = file.parts().collect();
            let mut sets: Vec<&str> = all.iter().copied().filter(|set| !file.sets_of_faces.contains(*set)).collect();
            if sets.is_empty() {
                sets = all;
            }
            // the groups that the user made, if they leave out nothing
            let named: Vec<&str> = sets.iter().copied().filter(|set| !is_elementary(set)).collect();
            let (of_named, of_all) = (best_cover(file, named), best_cover(file, sets));
            if of_named.1 == of_all.1 { of_named.0 } else { of_all.0 }
        }
    };
    let mut names = BTreeSet::new();
    let named = |set: &str| {
        let mut name = proper(set);
        while !names.insert(name.clone()) {
            name.push('_');
        }
        (Some(set.to_owned()), name)
    };
    let chosen: Vec<_> = sets.into_iter().map(named).collect();
    if chosen.is_empty() { vec![(None, "part".into())] } else { chosen }
}

/// Disjoint sets that cover as many elements as possible, taken in ascending or in descending order of their sizes; and
/// the number of these elements.
fn best_cover<'a>(file: &FileMesh, mut sets: Vec<&'a str>) -> (Vec<&'a str>, usize) {
    sets.sort_by_key(|set| file.cell_sets[*set].len());
    let small = without_overlap(file, sets.clone());
    sets.sort_by_key(|set| Reverse(file.cell_sets[*set].len()));
    let large = without_overlap(file, sets);
    if large.1 > small.1 { large } else { small }
}

/// Whether Gmsh gave a set its name, when it wrote a deck: that of an entity of the geometry, such as `Volume1`, beside
/// the groups of the user.
fn is_elementary(set: &str) -> bool {
    let number = ["volume", "surface"].iter().find_map(|kind| {
        let (start, number) = set.split_at_checked(kind.len())?;
        start.eq_ignore_ascii_case(kind).then_some(number)
    });
    number.is_some_and(|number| !number.is_empty() && number.bytes().all(|c| c.is_ascii_digit()))
}

/// The sets that share no element with an earlier one, and the number of their elements.
fn without_overlap<'a>(file: &FileMesh, sets: Vec<&'a str>) -> (Vec<&'a str>, usize) {
    let mut taken: BTreeSet<u32> = BTreeSet::new();
    let mut chosen = Vec::new();
    for set in sets {
        let cells = file.solid_cells(Some(set));
        if cells.iter().all(|cell| !taken.contains(cell)) {
            taken.extend(cells);
            chosen.push(set);
        }
    }
    (chosen, taken.len())
}

/// A valid name for a body.
fn proper(set: &str) -> String {
    let allowed = |c: char| if c.is_ascii_alphanumeric() || c == '_' || c == '-' { c } else { '_' };
    let name: String = set.chars().map(allowed).collect();
    if name.is_empty() { "part".into() } else { name }
}

fn read(file: &FileMesh, part: Option<String>, name: String) -> Result<Part, MeshFileError> {
    let mesh = file.body(&name, part.as_deref(), 1.0)?.mesh;
    // facets of groups that the user made are not listed again as faces of Gmsh's geometry
    let prefix = format!("{name}_");
    let of_geometry = |surface: &str| is_elementary(surface.strip_prefix(&prefix).unwrap_or(surface));
    let groups = mesh.surfaces.iter().filter(|(name, _)| !of_geometry(name));
    let grouped: BTreeSet<_> =
        groups.flat_map(|(_, surface)| &surface.facets).map(|facet| facet.nodes.sorted()).collect();
    let again = |name: &str, surface: &Surface| {
        of_geometry(name) && surface.facets.iter().all(|facet| grouped.contains(&facet.nodes.sorted()))
    };
    let faces = mesh.surfaces.iter().filter(|(name, surface)| !again(name, surface));
    let mut faces: Vec<Face> = faces.map(|(name, surface)| Face::new(&mesh, name, surface, None)).collect();
    if faces.is_empty() {
        faces = sides(&mesh, &name);
    }
    let bounds = mesh.bounding_box().unwrap_or_default();
    let volume = mesh.element_volumes().iter().sum();
    Ok(Part { name, part, faces, bounds: [bounds.0.into(), bounds.1.into()], volume, mesh })
}

/// The parts of the skin that face the six coordinate directions, as `surface.normal` selects them
/// within 45°.
fn sides(mesh: &Mesh, name: &str) -> Vec<Face> {
    let skin = mesh.boundary(0);
    let mut sides = Vec::new();
    for (c, axis) in ["x", "y", "z"].into_iter().enumerate() {
        for (end, sign) in [("min", -1.0), ("max", 1.0)] {
            let mut direction = [0.0; 3];
            direction[c] = sign;
            let mut side = skin.clone();
            side.facets.retain(|facet| {
                let area = Point::from(facet_area_vector(&mesh.facet_coordinates(facet)));
                area.dot(&Point::from(direction)) >= area.norm() * std::f64::consts::FRAC_1_SQRT_2
            });
            if !side.facets.is_empty() {
                sides.push(Face::new(mesh, &format!("{name}_{axis}{end}"), &side, Some(direction)));
            }
        }
    }
    sides
}

fn best_pair(parts: &[Part]) -> Option<Pair> {
    let mut best: Option<Pair> = None;
    for a in 0..parts.len().min(MOST_BODIES) {
        for b in a + 1..parts.len().min(MOST_BODIES) {
            for (i, first) in parts[a].faces.iter().enumerate() {
                for (j, second) in parts[b].faces.iter().enumerate() {
                    let finer = second.facet_size() <= first.facet_size();
                    let (slave, master) = if finer { ([b, j], [a, i]) } else { ([a, i], [b, j]) };
                    let of = |[body, face]: [usize; 2]| &parts[body].faces[face];
                    let Some((worth, gap)) = facing(of(slave), of(master)) else { continue };
                    if best.as_ref().is_none_or(|best| worth > best.worth) {
                        best = Some(Pair { slave, master, gap: [gap; 2], reason: None, worth });
                    }
                }
            }
        }
    }
    best
}

/// The slave's area that faces the master, weighted down by the distance and by the remaining area
/// of both surfaces; and the smallest distance.
pub(super) fn facing(slave: &Face, master: &Face) -> Option<(f64, f64)> {
    let reach = slave.facet_size() + master.facet_size();
    let every = slave.facets().div_ceil(SAMPLES);
    let (mut area, mut gap) = (0.0, f64::INFINITY);
    for (centroid, vector) in slave.centroids.iter().zip(&slave.areas).step_by(every) {
        let normal = vector / vector.norm();
        let distance = |(other, facing): (&Point, &Point)| {
            let towards = other - centroid;
            let along = towards.dot(&normal);
            let beside = (towards - along * normal).norm();
            let opposite = facing.dot(&normal) < OPPOSED * facing.norm();
            (opposite && beside <= reach && along > -reach).then_some((towards.norm(), along))
        };
        let candidates = master.centroids.iter().zip(&master.areas).filter_map(distance);
        let nearest = candidates.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, along)| along);
        if let Some(nearest) = nearest {
            area += vector.norm() * every as f64 / (1.0 + nearest.max(0.0) / reach);
            gap = gap.min(nearest);
        }
    }
    (area > 0.0).then(|| (area / (slave.area() * master.area()).powf(0.25), gap))
}

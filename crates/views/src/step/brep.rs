//! Faces, edges and vertices of a solid, from its regions and facets.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::curve::{Curve, meeting};
use super::facets::Facets;
use super::pairs::pairs;
use super::seams::Frame;
use super::surface::{Surface, V, across};

/// The boundary of a solid.
#[derive(Debug, Default)]
pub(super) struct Brep {
    pub vertices: Vec<V>,
    pub edges: Vec<Edge>,
    pub faces: Vec<Face>,
    /// The faces of each connected part of the boundary, the outer one first.
    pub shells: Vec<Vec<usize>>,
}

/// A part of a curve between two vertices.
#[derive(Debug)]
pub(super) struct Edge {
    pub ends: [usize; 2],
    pub curve: Curve,
}

/// The edges of a loop, and whether each runs from its first to its last vertex.
pub(super) type Ring = Vec<(usize, bool)>;

/// A connected part of a surface.
#[derive(Debug)]
pub(super) struct Face {
    pub surface: Surface,
    /// Its region; none for a facet.
    pub region: Option<usize>,
    /// Whether the normal of its surface points out of the solid.
    pub outward: bool,
    /// Edges around it, counter-clockwise seen from outside, and whether each runs from its first to its last vertex;
    /// the outer loop first.
    pub loops: Vec<Ring>,
}

/// Largest angle of a conic edge. \[rad\]
const LONGEST: f64 = 3.5;

/// The boundary of a solid with these facets; `frames` are those of its regions.
pub(super) fn brep(facets: &Facets, frames: &[Frame]) -> Brep {
    let pairs = pairs(facets);
    let (face_of, count) = faces(facets, &pairs);
    let mut first = vec![usize::MAX; count];
    for (t, &face) in face_of.iter().enumerate() {
        first[face] = first[face].min(t);
    }
    let surfaces: Vec<Surface> = first.iter().map(|&t| surface(facets, &pairs, t)).collect();
    let mut along_normal = vec![0.0; count];
    for (t, &face) in face_of.iter().enumerate() {
        let centre = facets.corners(t).iter().sum::<V>() / 3.0;
        along_normal[face] += surfaces[face].normal(&centre).dot(&facets.area(t));
    }
    let mut builder =
        Builder { facets, face_of: &face_of, surfaces: &surfaces, numbers: BTreeMap::new(), brep: Brep::default() };
    let along = builder.edges();
    let mut brep = builder.brep;
    let mut loops: Vec<Vec<(f64, Ring)>> = vec![Vec::new(); count];
    let mut walked: BTreeSet<[u32; 2]> = BTreeSet::new();
    for (t, &face) in face_of.iter().enumerate() {
        for k in 0..3 {
            let start = [facets.triangles[t][k], facets.triangles[t][(k + 1) % 3]];
            if !along.contains_key(&start) || walked.contains(&start) {
                continue;
            }
            let mut ring = Ring::new();
            let mut corners = Vec::new();
            let mut at = start;
            loop {
                walked.insert(at);
                let (edge, forward) = along[&at];
                if ring.last() != Some(&(edge, forward)) {
                    ring.push((edge, forward));
                }
                corners.push(facets.points[at[0] as usize]);
                at = next(facets, &along, at);
                if at == start {
                    break;
                }
            }
            // the loop may start within an edge
            if ring.len() > 1 && ring.first() == ring.last() {
                ring.pop();
            }
            let frame = facets.region[t].and_then(|region| frames[region]);
            let size = surfaces[face].enclosed(frame, &corners) * f64::signum(along_normal[face]);
            loops[face].push((size, ring));
        }
    }
    for (face, mut loops) in loops.into_iter().enumerate() {
        loops.sort_by(|a, b| b.0.total_cmp(&a.0));
        let t = first[face];
        brep.faces.push(Face {
            surface: surfaces[face],
            region: facets.region[t],
            outward: along_normal[face] > 0.0,
            loops: loops.into_iter().map(|(_, ring)| ring).collect(),
        });
    }
    brep.shells = shells(facets, &face_of);
    brep
}

/// The directed edge that follows within a face.
fn next(facets: &Facets, along: &BTreeMap<[u32; 2], (usize, bool)>, [a, b]: [u32; 2]) -> [u32; 2] {
    let mut edge = [a, b];
    loop {
        let corners = facets.triangles[facets.left[&edge] as usize];
        let k = corners.iter().position(|&n| n == b).unwrap_or(0);
        let out = [b, corners[(k + 1) % 3]];
        if along.contains_key(&out) {
            return out;
        }
        edge = [out[1], b];
    }
}

/// The other triangle of a facet's face, and the corners of the face.
type Pairs = HashMap<usize, (usize, [V; 4])>;

/// The surface of a triangle.
fn surface(facets: &Facets, pairs: &Pairs, t: usize) -> Surface {
    match (facets.region[t], pairs.get(&t)) {
        (Some(region), _) => facets.regions[region].surface,
        (None, Some((_, corners))) => Surface::Bilinear { corners: *corners },
        (None, None) => {
            let [a, b, _] = facets.corners(t);
            let beside = || (b - a).try_normalize(0.0).map_or_else(V::z, |edge| across(&edge));
            Surface::Plane { origin: a, normal: facets.area(t).try_normalize(0.0).unwrap_or_else(beside) }
        }
    }
}

/// The face of each triangle: connected triangles of a region are one, and so are pairs.
fn faces(facets: &Facets, pairs: &Pairs) -> (Vec<usize>, usize) {
    components(facets, |s, t| match facets.region[s] {
        Some(_) => facets.region[s] == facets.region[t],
        None => pairs.get(&s).is_some_and(|(other, _)| *other == t),
    })
}

fn components(facets: &Facets, continues: impl Fn(usize, usize) -> bool) -> (Vec<usize>, usize) {
    let mut found = vec![usize::MAX; facets.triangles.len()];
    let mut count = 0;
    for start in 0..found.len() {
        if found[start] != usize::MAX {
            continue;
        }
        found[start] = count;
        let mut open = vec![start];
        while let Some(s) = open.pop() {
            for t in facets.beside(s) {
                if found[t] == usize::MAX && continues(s, t) {
                    found[t] = count;
                    open.push(t);
                }
            }
        }
        count += 1;
    }
    (found, count)
}

/// The faces of each connected part of the boundary, that of the largest volume first.
fn shells(facets: &Facets, face_of: &[usize]) -> Vec<Vec<usize>> {
    let (shell, count) = components(facets, |_, _| true);
    let mut found: Vec<(f64, BTreeSet<usize>)> = vec![(0.0, BTreeSet::new()); count];
    let origin = facets.points[0];
    for (t, &number) in shell.iter().enumerate() {
        found[number].0 += (facets.corners(t)[0] - origin).dot(&facets.area(t));
        found[number].1.insert(face_of[t]);
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.into_iter().map(|(_, faces)| faces.into_iter().collect()).collect()
}

struct Builder<'a> {
    facets: &'a Facets,
    face_of: &'a [usize],
    surfaces: &'a [Surface],
    /// The vertex at each point.
    numbers: BTreeMap<u32, usize>,
    brep: Brep,
}

impl Builder<'_> {
    /// Makes all edges; returns the edge along each directed edge of triangles between two faces, and whether in the
    /// same direction.
    fn edges(&mut self) -> BTreeMap<[u32; 2], (usize, bool)> {
        let face = |edge: [u32; 2]| self.face_of[self.facets.left[&edge] as usize];
        let mut around: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        let mut single: Vec<[u32; 2]> = Vec::new();
        for corners in &self.facets.triangles {
            for k in 0..3 {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                if face([a, b]) != face([b, a]) {
                    around.entry(a).or_default().push(b);
                    if a < b {
                        single.push([a, b]);
                    }
                }
            }
        }
        let pair = |a: u32, b: u32| {
            let faces = [face([a, b]), face([b, a])];
            [faces[0].min(faces[1]), faces[0].max(faces[1])]
        };
        let passes = |n: u32| match around[&n][..] {
            [a, b] if pair(a, n) == pair(b, n) => {
                let straight = pair(a, n).map(|f| self.surfaces[f].has_straight_sides());
                !(straight[0] && straight[1]) || self.straight(&[a, n, b])
            }
            _ => false,
        };
        let mut chains: Vec<Vec<u32>> = Vec::new();
        let walk = |start: u32, then: u32| {
            let mut chain = vec![start, then];
            loop {
                let (before, at) = (chain[chain.len() - 2], chain[chain.len() - 1]);
                if at == start || !passes(at) {
                    return chain;
                }
                let ends = &around[&at];
                chain.push(ends[usize::from(ends[0] == before)]);
            }
        };
        let mut seen: BTreeSet<[u32; 2]> = BTreeSet::new();
        for only_corners in [true, false] {
            for &[a, b] in &single {
                for (start, then) in [(a, b), (b, a)] {
                    if seen.contains(&[a, b]) || (only_corners && passes(start)) {
                        continue;
                    }
                    let chain = walk(start, then);
                    seen.extend(chain.windows(2).map(|pair| [pair[0].min(pair[1]), pair[0].max(pair[1])]));
                    chains.push(chain);
                }
            }
        }
        let mut along = BTreeMap::new();
        for chain in chains {
            self.add(&chain, &mut along);
        }
        along
    }

    /// Whether points lie on the straight line from the first to the last.
    fn straight(&self, chain: &[u32]) -> bool {
        let at = |n: u32| self.facets.points[n as usize];
        let (first, last) = (at(chain[0]), at(chain[chain.len() - 1]));
        let Some(direction) = (last - first).try_normalize(0.0) else { return false };
        let off = |&n: &u32| (at(n) - first).cross(&direction).norm() <= self.facets.tolerance;
        chain.iter().all(off)
    }

    /// Adds the edges along a chain: one, or two or more if it is closed, or turns too far.
    fn add(&mut self, chain: &[u32], along: &mut BTreeMap<[u32; 2], (usize, bool)>) {
        let points: Vec<V> = chain.iter().map(|&n| self.facets.points[n as usize]).collect();
        let edge = [chain[0], chain[1]];
        let sides = [edge, [edge[1], edge[0]]].map(|e| self.face_of[self.facets.left[&e] as usize]);
        let surfaces = sides.map(|face| &self.surfaces[face]);
        let closed = chain[0] == chain[chain.len() - 1];
        let halves = |builder: &mut Self, along: &mut BTreeMap<_, _>| {
            let middle = chain.len() / 2;
            builder.add(&chain[..=middle], along);
            builder.add(&chain[middle..], along);
        };
        if closed && chain.len() > 3 {
            return halves(self, along);
        }
        let curve = meeting(surfaces, &points, self.facets.tolerance);
        let fits = match &curve {
            Curve::Line => self.straight(chain),
            Curve::Conic { .. } => {
                let turn = curve.turn(&points);
                let all: f64 = points.windows(2).map(|pair| curve.turn(pair).abs()).sum();
                turn < LONGEST && all - turn < 1e-6 && curve.passes(&points, 10.0 * self.facets.tolerance)
            }
            Curve::Spline { .. } => true,
        };
        if !fits && chain.len() > 2 {
            return halves(self, along);
        }
        let number = self.brep.edges.len();
        let ends = [chain[0], chain[chain.len() - 1]].map(|n| self.vertex(n));
        self.brep.edges.push(Edge { ends, curve });
        for pair in chain.windows(2) {
            along.insert([pair[0], pair[1]], (number, true));
            along.insert([pair[1], pair[0]], (number, false));
        }
    }

    fn vertex(&mut self, n: u32) -> usize {
        let brep = &mut self.brep;
        *self.numbers.entry(n).or_insert_with(|| {
            brep.vertices.push(self.facets.points[n as usize]);
            brep.vertices.len() - 1
        })
    }
}

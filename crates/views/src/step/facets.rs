//! The triangles of a solid, the surfaces on which they lie, and how edges between them are divided.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::Source;
use super::surface::{Surface, V, onto, touching};

/// A part of the boundary on one surface.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Region {
    pub surface: Surface,
    /// The name of its faces.
    pub name: String,
}

/// The closed triangulated boundary of a solid. Triangles without a region are facets.
#[derive(Debug, Clone)]
pub(super) struct Facets {
    pub points: Vec<V>,
    pub triangles: Vec<[u32; 3]>,
    pub region: Vec<Option<usize>>,
    /// The triangle of the source of which each is a part.
    pub origin: Vec<usize>,
    pub regions: Vec<Region>,
    /// The triangle to the left of each directed edge.
    pub left: HashMap<[u32; 2], u32>,
    /// Lengths below this are round-off. \[L\]
    pub tolerance: f64,
}

/// Tolerance relative to the diagonal of the bounding box.
const ROUND_OFF: f64 = 1e-9;

/// Largest height of an arc above its chord, relative to the height of the facet at the chord.
const BULGE: f64 = 0.3;

/// Largest tangent of the angle between an arc and its chord at its ends, relative to that between the chord and the
/// other edges of the facet.
const INCLINED: f64 = 0.7;

/// How often edges beside facets are divided, at most.
const ROUNDS: usize = 4;

impl Facets {
    /// The triangles of a solid. Flat neighbours of one name in one plane share a region; so do those on one shape. Those
    /// that are `loose` have none, so that their points may move.
    pub fn new(source: &Source, shapes: &[Option<Surface>], loose: &[bool]) -> Self {
        let points: Vec<V> = source.points.iter().map(|&p| p.into()).collect();
        let (low, high) = points
            .iter()
            .fold((V::repeat(f64::INFINITY), V::repeat(f64::NEG_INFINITY)), |(l, h), p| (l.inf(p), h.sup(p)));
        let mut found = Self {
            tolerance: ROUND_OFF * (high - low).norm(),
            points,
            triangles: source.triangles.clone(),
            region: vec![None; source.triangles.len()],
            origin: (0..source.triangles.len()).collect(),
            regions: Vec::new(),
            left: HashMap::new(),
        };
        for t in 0..found.triangles.len() {
            found.connect(t);
        }
        let mut numbers: Vec<(Surface, &str)> = Vec::new();
        for (t, shape) in shapes.iter().enumerate() {
            let Some(shape) = shape else { continue };
            let key = (*shape, source.names[t].as_str());
            let number = numbers.iter().position(|other| *other == key).unwrap_or(numbers.len());
            if number == numbers.len() {
                numbers.push(key);
                found.regions.push(Region { surface: *shape, name: key.1.to_owned() });
            }
            found.region[t] = Some(number);
        }
        found.add_planes(source, loose);
        found
    }

    fn connect(&mut self, t: usize) {
        let corners = self.triangles[t];
        for k in 0..3 {
            self.left.insert([corners[k], corners[(k + 1) % 3]], t as u32);
        }
    }

    pub fn corners(&self, t: usize) -> [V; 3] {
        self.triangles[t].map(|n| self.points[n as usize])
    }

    /// Twice the vector area of a triangle. \[L²\]
    pub fn area(&self, t: usize) -> V {
        let [a, b, c] = self.corners(t);
        (b - a).cross(&(c - a))
    }

    /// The triangles beside a triangle.
    pub fn beside(&self, t: usize) -> [usize; 3] {
        let corners = self.triangles[t];
        std::array::from_fn(|k| self.left[&[corners[(k + 1) % 3], corners[k]]] as usize)
    }

    /// Gives a plane to each set of two or more connected triangles in it: the outer ones of a name, and the others.
    fn add_planes(&mut self, source: &Source, loose: &[bool]) {
        let mut order: Vec<usize> =
            (0..self.triangles.len()).filter(|&t| self.region[t].is_none() && !loose[t]).collect();
        let size: Vec<f64> = (0..self.triangles.len()).map(|t| self.area(t).norm()).collect();
        order.sort_by(|&a, &b| size[b].total_cmp(&size[a]));
        let mut seen = vec![false; self.triangles.len()];
        for start in order {
            if seen[start] || size[start] == 0.0 {
                continue;
            }
            let (normal, origin) = (self.area(start).normalize(), self.corners(start)[0]);
            let lies = |t: usize| {
                self.region[t].is_none()
                    && !loose[t]
                    && source.outer[t] == source.outer[start]
                    && source.names[t] == source.names[start]
                    && self.area(t).dot(&normal) > 0.9 * size[t]
                    && self.corners(t).iter().all(|x| (x - origin).dot(&normal).abs() < self.tolerance)
            };
            let mut plane = vec![start];
            seen[start] = true;
            let mut next = 0;
            while next < plane.len() {
                for t in self.beside(plane[next]) {
                    if !seen[t] && lies(t) {
                        seen[t] = true;
                        plane.push(t);
                    }
                }
                next += 1;
            }
            if plane.len() == 1 && !source.outer[start] {
                continue;
            }
            let normal = plane.iter().map(|&t| self.area(t)).sum::<V>().normalize();
            let number = self.regions.len();
            self.regions.push(Region { surface: Surface::Plane { origin, normal }, name: source.names[start].clone() });
            plane.iter().for_each(|&t| self.region[t] = Some(number));
        }
    }

    /// Divides an edge at a point, and the triangles beside it.
    pub fn split(&mut self, [a, b]: [u32; 2], point: V) -> u32 {
        let new = self.points.len() as u32;
        self.points.push(point);
        for (from, to) in [(a, b), (b, a)] {
            let Some(t) = self.left.remove(&[from, to]) else { continue };
            let t = t as usize;
            let k = self.triangles[t].iter().position(|&n| n == from).unwrap_or(0);
            let apex = self.triangles[t][(k + 2) % 3];
            self.triangles[t] = [from, new, apex];
            self.triangles.push([new, to, apex]);
            self.region.push(self.region[t]);
            self.origin.push(self.origin[t]);
            self.connect(t);
            self.connect(self.triangles.len() - 1);
        }
        new
    }

    /// Divides a region along a plane through its centre or axis, also the facets beside it; the part on the side of
    /// `normal` becomes a new region. Returns false, and adds none, if all triangles are on one side.
    pub fn divide(&mut self, region: usize, through: &V, normal: &V) -> bool {
        let own: Vec<usize> = (0..self.triangles.len()).filter(|&t| self.region[t] == Some(region)).collect();
        let mut on: BTreeSet<u32> = BTreeSet::new();
        let side = |facets: &Self, n: u32| (facets.points[n as usize] - through).dot(normal);
        let mut edges: BTreeSet<[u32; 2]> = BTreeSet::new();
        for &t in &own {
            let [a, b, c] = self.triangles[t];
            edges.extend([[a, b], [b, c], [c, a]].map(|[a, b]| [a.min(b), a.max(b)]));
            on.extend([a, b, c].into_iter().filter(|&n| side(self, n).abs() < self.tolerance));
        }
        for [a, b] in edges {
            let (p, q) = (side(self, a), side(self, b));
            if on.contains(&a) || on.contains(&b) || (p > 0.0) == (q > 0.0) {
                continue;
            }
            let at = self.points[a as usize] * (q / (q - p)) - self.points[b as usize] * (p / (q - p));
            let mut surfaces = vec![Surface::Plane { origin: *through, normal: *normal }];
            surfaces.extend(self.surfaces_beside([a, b]));
            let reach = (self.points[a as usize] - self.points[b as usize]).norm();
            let at = onto(&at, &surfaces, reach, self.tolerance).unwrap_or(at);
            on.insert(self.split([a, b], at));
        }
        let above = |t: usize| {
            let sides = self.triangles[t].iter().filter(|n| !on.contains(n)).map(|&n| side(self, n));
            sides.sum::<f64>() > 0.0
        };
        let own = (0..self.triangles.len()).filter(|&t| self.region[t] == Some(region));
        let (upper, lower): (Vec<usize>, Vec<usize>) = own.partition(|&t| above(t));
        if upper.is_empty() || lower.is_empty() {
            return false;
        }
        upper.iter().for_each(|&t| self.region[t] = Some(self.regions.len()));
        self.regions.push(self.regions[region].clone());
        true
    }

    /// The different surfaces of the triangles beside an edge; a facet's is its plane.
    fn surfaces_beside(&self, [a, b]: [u32; 2]) -> Vec<Surface> {
        let mut found: Vec<Surface> = Vec::new();
        for t in [[a, b], [b, a]].into_iter().filter_map(|edge| self.left.get(&edge)) {
            let surface = match self.region[*t as usize] {
                Some(region) => self.regions[region].surface,
                None => Surface::Plane {
                    origin: self.points[a as usize],
                    normal: self.area(*t as usize).try_normalize(0.0).unwrap_or_default(),
                },
            };
            if !found.contains(&surface) {
                found.push(surface);
            }
        }
        found
    }

    /// Moves the points onto all surfaces of the regions around them; returns the triangles of curved regions around points
    /// that do not reach these surfaces within `reach` times the shortest edge beside them, and around triangles that
    /// turn over.
    pub fn settle(&mut self, reach: f64) -> BTreeSet<usize> {
        let mut around: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        let mut shortest = vec![f64::INFINITY; self.points.len()];
        for (t, corners) in self.triangles.iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                let length = (self.points[a as usize] - self.points[b as usize]).norm();
                for n in [a, b] {
                    shortest[n as usize] = shortest[n as usize].min(length);
                }
                around.entry(a).or_default().push(t);
            }
        }
        let before: Vec<(V, f64)> = (0..self.triangles.len()).map(|t| (self.area(t), self.upward(t))).collect();
        let mut unreached: BTreeSet<usize> = BTreeSet::new();
        for (&n, triangles) in &around {
            let regions: BTreeSet<usize> = triangles.iter().filter_map(|&t| self.region[t]).collect();
            let mut surfaces: Vec<Surface> = regions.iter().map(|&r| self.regions[r].surface).collect();
            // parts of a divided surface are one
            for k in (1..surfaces.len()).rev() {
                if surfaces[..k].contains(&surfaces[k]) {
                    surfaces.remove(k);
                }
            }
            if surfaces.is_empty() {
                continue;
            }
            let reach = (reach * shortest[n as usize]).max(self.tolerance);
            // surfaces that touch may be a little apart
            let to = |tolerance: f64| onto(&self.points[n as usize], &surfaces, reach, tolerance * self.tolerance);
            match to(1e-3).or_else(|| to(0.5)) {
                Some(at) => {
                    self.points[n as usize] = touching(&surfaces, &at, 0.5 * self.tolerance).unwrap_or(at);
                }
                None => unreached.extend(triangles),
            }
        }
        for (t, (area, upward)) in before.iter().enumerate() {
            // a triangle of a region may stand on edge, as between points on one circle
            let (before, after) = match self.region[t] {
                Some(_) => (*upward, self.upward(t) * upward.signum()),
                None => (area.norm(), self.area(t).dot(area)),
            };
            if before.abs() > self.tolerance * self.longest(t) && after <= 0.0 {
                unreached.extend(self.triangles[t].iter().flat_map(|n| &around[n]));
            }
        }
        unreached.retain(|&t| self.curved(t).is_some());
        unreached
    }

    /// The curved surface of a triangle.
    pub fn curved(&self, t: usize) -> Option<Surface> {
        let surface = self.regions[self.region[t]?].surface;
        (!matches!(surface, Surface::Plane { .. })).then_some(surface)
    }

    /// Twice the area of a triangle along the normal of its region's surface. \[L²\]
    fn upward(&self, t: usize) -> f64 {
        let centre = self.corners(t).iter().sum::<V>() / 3.0;
        self.region[t].map_or(0.0, |region| self.regions[region].surface.normal(&centre).dot(&self.area(t)))
    }

    /// The longest edge of a triangle. \[L\]
    fn longest(&self, t: usize) -> f64 {
        let [a, b, c] = self.corners(t);
        (b - a).norm().max((c - b).norm()).max((a - c).norm())
    }

    /// Divides edges between curved regions and facets until the arc in the plane of a facet stays close to its chord.
    pub fn refine(&mut self) {
        for _ in 0..ROUNDS {
            let mut steep: BTreeMap<[u32; 2], V> = BTreeMap::new();
            for t in 0..self.triangles.len() {
                if self.region[t].is_some() {
                    continue;
                }
                for k in 0..3 {
                    let corners = self.triangles[t];
                    let edge = [corners[k], corners[(k + 1) % 3]];
                    let other = self.left[&[edge[1], edge[0]]] as usize;
                    let Some(region) = self.region[other] else { continue };
                    if matches!(self.regions[region].surface, Surface::Plane { .. }) {
                        continue;
                    }
                    if let Some(point) = self.steep(t, k, region) {
                        steep.insert([edge[0].min(edge[1]), edge[0].max(edge[1])], point);
                    }
                }
            }
            if steep.is_empty() {
                return;
            }
            for (edge, point) in steep {
                self.split(edge, point);
            }
        }
    }

    /// The point of a surface above the middle of an edge of a facet, if the arc through it comes too close to other edges.
    fn steep(&self, t: usize, k: usize, region: usize) -> Option<V> {
        let corners = self.corners(t);
        let (a, b, apex) = (corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]);
        let chord = b - a;
        let plane = Surface::Plane { origin: a, normal: self.area(t).try_normalize(0.0)? };
        let surface = self.regions[region].surface;
        let middle = (a + b) / 2.0;
        let above = onto(&middle, &[surface], chord.norm(), self.tolerance)?;
        if (above - middle).norm() < self.tolerance {
            return None;
        }
        let height = self.area(t).norm() / chord.norm();
        let bad = match onto(&middle, &[surface, plane], chord.norm(), self.tolerance) {
            Some(top) => {
                let bulge = (top - middle).norm();
                let slope = 4.0 * bulge / chord.norm();
                let feet = [(apex - a).dot(&chord) / chord.norm(), (b - apex).dot(&chord) / chord.norm()];
                let angles = feet.map(|foot| if foot > 0.0 { height / foot } else { f64::INFINITY });
                bulge > BULGE * height || angles.iter().any(|&angle| slope > INCLINED * angle)
            }
            None => true,
        };
        bad.then_some(above)
    }
}

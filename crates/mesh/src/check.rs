//! Checks whether a mesh is suitable for analysis, and repairs facets.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use crate::topology::{Face, faces_of, keys, single};
use crate::{Element, Facet, FacetNodes, Mesh, MeshDefect, MeshError, Surface};

impl Mesh {
    /// All defects of the mesh; empty if it is suitable for analysis. Never panics, whatever the
    /// mesh contains.
    ///
    /// Elements with node numbers out of range are excluded from the checks of shape and ownership.
    pub fn check(&self) -> Vec<MeshDefect> {
        let mut check = Check::new(self);
        check.bodies();
        check.coordinates();
        check.shapes();
        check.owners();
        check.shared_faces();
        check.node_sets();
        for (name, surface) in &self.surfaces {
            check.surface(name, surface);
        }
        check.defects
    }

    /// Like [`Mesh::check`], with all defects in one error.
    ///
    /// # Errors
    /// [`MeshError::Defects`] if there is any.
    pub fn validate(&self) -> Result<(), MeshError> {
        let defects = self.check();
        if defects.is_empty() { Ok(()) } else { Err(MeshError::Defects(defects)) }
    }

    /// Orients all facets that are faces of their elements outward, and corrects crosswise node
    /// orders; returns how many it changed.
    ///
    /// Each keeps its first node. Facets that are not faces of their elements are left unchanged;
    /// [`Mesh::check`] reports them.
    pub fn orient_facets(&mut self) -> usize {
        let mut changed = 0;
        for facet in self.surfaces.values_mut().flat_map(|surface| &mut surface.facets) {
            let element = self.elements.get(facet.element as usize);
            let Some(outward) = element.and_then(|element| outward_nodes(element, facet)) else {
                continue;
            };
            if outward != facet.nodes {
                facet.nodes = outward;
                changed += 1;
            }
        }
        changed
    }
}

/// The facet's nodes as the outward face of its element, starting at the same node; `None` if it is
/// not a face.
fn outward_nodes(element: &Element, facet: &Facet) -> Option<FacetNodes> {
    let key = facet.nodes.sorted();
    let side = (0..element.sides()).map(|side| element.side(side)).find(|side| side.sorted() == key)?;
    side.starting_at(facet.nodes[0])
}

/// The element belongs to no body.
const NOBODY: usize = usize::MAX;

struct Check<'a> {
    mesh: &'a Mesh,
    /// The body of each element, or [`NOBODY`].
    owner: Vec<usize>,
    /// Whether all nodes of each element exist.
    in_range: Vec<bool>,
    /// All faces, sorted by their nodes.
    faces: Vec<Face>,
    /// Quadrilaterals that are covered by two triangles, and these triangles, sorted by their
    /// nodes.
    divided: BTreeSet<FacetNodes>,
    defects: Vec<MeshDefect>,
}

impl<'a> Check<'a> {
    fn new(mesh: &'a Mesh) -> Self {
        let mut owner = vec![NOBODY; mesh.elements.len()];
        for (body, range) in mesh.bodies.iter().map(|body| &body.elements).enumerate() {
            let end = range.end.min(owner.len());
            owner[range.start.min(end)..end].fill(body);
        }
        let exists = |&n: &u32| (n as usize) < mesh.nodes.len();
        let in_range = mesh.elements.iter().map(|element| element.nodes().iter().all(exists)).collect();
        let faces = mesh.sorted_faces(0..mesh.elements.len());
        let divided = keys(&mesh.divided_faces(&single(&faces)));
        Self { mesh, owner, in_range, faces, divided, defects: Vec::new() }
    }

    fn body_name(&self, body: usize) -> String {
        self.mesh.bodies.get(body).map_or_else(|| "(none)".into(), |body| body.name.clone())
    }

    /// Elements for which `bad` is true, by body.
    fn by_body(&self, bad: impl Fn(usize) -> bool) -> BTreeMap<usize, Vec<u32>> {
        let mut elements: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
        for element in (0..self.owner.len()).filter(|&element| bad(element)) {
            elements.entry(self.owner[element]).or_default().push(element as u32);
        }
        elements
    }

    fn bodies(&mut self) {
        let (mut element_end, mut node_end, mut names) = (0, 0, BTreeSet::new());
        for body in &self.mesh.bodies {
            let mut reasons = Vec::new();
            reasons.extend(range_fault("elements", &body.elements, element_end, self.mesh.elements.len()));
            reasons.extend(range_fault("nodes", &body.nodes, node_end, self.mesh.nodes.len()));
            if !names.insert(&body.name) {
                reasons.push("has the name of another body: rename one of them".into());
            }
            (element_end, node_end) = (body.elements.end, body.nodes.end);
            let defect = |reason| MeshDefect::BodyRange { body: body.name.clone(), reason };
            self.defects.extend(reasons.into_iter().map(defect));
        }
        let elements: Vec<u32> = (0..).zip(&self.owner).filter(|(_, o)| **o == NOBODY).map(|(e, _)| e).collect();
        if !elements.is_empty() {
            self.defects.push(MeshDefect::ElementsWithoutBody { elements });
        }
    }

    fn coordinates(&mut self) {
        let bad = |x: &[f64; 3]| !x.iter().all(|c| c.is_finite());
        let nodes: Vec<u32> = (0..).zip(&self.mesh.nodes).filter(|(_, x)| bad(x)).map(|(n, _)| n).collect();
        if !nodes.is_empty() {
            self.defects.push(MeshDefect::NotFinite { nodes });
        }
    }

    fn shapes(&mut self) {
        let mesh = self.mesh;
        for (body, elements) in self.by_body(|element| !self.in_range[element]) {
            let body = self.body_name(body);
            self.defects.push(MeshDefect::NodeOutOfRange { body, elements, nodes: mesh.nodes.len() });
        }
        let repeats = |element: usize| {
            let nodes = mesh.elements[element].nodes();
            (1..nodes.len()).any(|i| nodes[..i].contains(&nodes[i]))
        };
        for (body, elements) in self.by_body(repeats) {
            self.defects.push(MeshDefect::RepeatedNode { body: self.body_name(body), elements });
        }
        // NaN means a defect that other checks report: it does not count as inverted here.
        let least: Vec<f64> = (0..mesh.elements.len())
            .map(|element| if self.in_range[element] { mesh.least_jacobian(element) } else { f64::NAN })
            .collect();
        for (body, elements) in self.by_body(|element| least[element] <= 0.0) {
            let worst = elements.iter().fold(0.0_f64, |worst, &element| worst.min(least[element as usize]));
            self.defects.push(MeshDefect::Inverted { body: self.body_name(body), elements, worst });
        }
    }

    /// Each node must belong to the elements of exactly one body, and lie in that body's range.
    fn owners(&mut self) {
        let mesh = self.mesh;
        let mut body_of = vec![NOBODY; mesh.nodes.len()];
        let mut used = vec![false; mesh.nodes.len()];
        let mut shared: BTreeMap<[usize; 2], BTreeSet<u32>> = BTreeMap::new();
        let mut outside: BTreeMap<usize, BTreeSet<u32>> = BTreeMap::new();
        for element in (0..mesh.elements.len()).filter(|&element| self.in_range[element]) {
            let body = self.owner[element];
            for &node in mesh.elements[element].nodes() {
                used[node as usize] = true;
                let known = &mut body_of[node as usize];
                if *known == NOBODY {
                    *known = body;
                }
                if *known != body && body != NOBODY {
                    shared.entry([*known, body]).or_default().insert(node);
                } else if mesh.bodies.get(body).is_some_and(|body| !body.nodes.contains(&(node as usize))) {
                    outside.entry(body).or_default().insert(node);
                }
            }
        }
        for ([a, b], nodes) in shared {
            let bodies = [self.body_name(a), self.body_name(b)];
            self.defects.push(MeshDefect::SharedNodes { bodies, nodes: nodes.into_iter().collect() });
        }
        for (body, nodes) in outside {
            let body = self.body_name(body);
            self.defects.push(MeshDefect::NodesOutsideBody { body, nodes: nodes.into_iter().collect() });
        }
        let nodes: Vec<u32> = (0..).zip(&used).filter(|(_, used)| !**used).map(|(n, _)| n).collect();
        if !nodes.is_empty() {
            self.defects.push(MeshDefect::UnusedNodes { nodes });
        }
    }

    /// A face may bound at most two elements, on opposite sides.
    fn shared_faces(&mut self) {
        let mut elements = BTreeSet::new();
        for same in self.faces.chunk_by(|a, b| a.key == b.key).filter(|same| same.len() > 1) {
            let side = |face: &Face| self.mesh.side_nodes(face.element, face.side as usize);
            if same.len() > 2 || same_winding(side(&same[0]), side(&same[1])) {
                elements.extend(same.iter().map(|face| face.element));
            }
        }
        if !elements.is_empty() {
            self.defects.push(MeshDefect::OverlappingFaces { elements: elements.into_iter().collect() });
        }
    }

    fn node_sets(&mut self) {
        for (name, set) in &self.mesh.node_sets {
            let nodes: Vec<u32> = set.iter().copied().filter(|&n| n as usize >= self.mesh.nodes.len()).collect();
            if !nodes.is_empty() {
                self.defects.push(MeshDefect::SetOutOfRange { set: name.clone(), nodes });
            }
            if !set.is_sorted_by(|a, b| a < b) {
                self.defects.push(MeshDefect::SetNotSorted { set: name.clone() });
            }
        }
    }

    fn surface(&mut self, name: &str, surface: &Surface) {
        let (mut stray, mut inward, mut interior, mut repeated) = (vec![], vec![], vec![], vec![]);
        let mut seen = BTreeSet::new();
        for (position, facet) in (0..).zip(&surface.facets) {
            let element = self.mesh.elements.get(facet.element as usize);
            let Some(outward) = element.and_then(|element| outward_nodes(element, facet)) else {
                stray.push(position);
                continue;
            };
            // Both start at the same node: outward, reversed, or crosswise.
            if facet.nodes == outward.reversed() {
                inward.push(position);
            } else if facet.nodes != outward {
                stray.push(position);
            }
            let key = facet.nodes.sorted();
            if faces_of(&self.faces, key).len() > 1 || self.divided.contains(&key) {
                interior.push(position);
            }
            if !seen.insert(key) {
                repeated.push(position);
            }
        }
        let name = || name.to_owned();
        let defects = [
            (!stray.is_empty()).then(|| MeshDefect::StrayFacets { surface: name(), facets: stray }),
            (!inward.is_empty()).then(|| MeshDefect::InwardFacets { surface: name(), facets: inward }),
            (!interior.is_empty()).then(|| MeshDefect::InteriorFacets { surface: name(), facets: interior }),
            (!repeated.is_empty()).then(|| MeshDefect::RepeatedFacets { surface: name(), facets: repeated }),
        ];
        self.defects.extend(defects.into_iter().flatten());
    }
}

/// Whether the two are the same cycle, regardless of their first node.
fn same_winding(a: FacetNodes, b: FacetNodes) -> bool {
    b.starting_at(a[0]) == Some(a)
}

/// The error in a body's range, which must start at or after the end of the previous one and end
/// within `count`.
fn range_fault(what: &str, range: &Range<usize>, last_end: usize, count: usize) -> Option<String> {
    if range.is_empty() {
        Some(format!("has no {what}: remove the body or add some"))
    } else if range.end > count {
        Some(format!("has {what} up to {}, but the mesh has only {count}: correct its range", range.end))
    } else if range.start < last_end {
        Some(format!("has {what} {range:?} that belong to the previous body: number {what} body by body"))
    } else {
        None
    }
}

//! Sections at which a body is cut, so that its two parts can be pulled together.

use crate::{Facet, Mesh, Surface, facet_area_vector};
use std::collections::{BTreeMap, BTreeSet, HashSet};

/// A section of a body: the part that its normal points to has its own copies of the nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct Cut {
    /// Its name.
    pub name: String,
    /// Number of the body.
    pub body: usize,
    /// Unit normal n.
    pub normal: [f64; 3],
    /// Each node of the section with its copy, in the part to which n points.
    pub nodes: Vec<[u32; 2]>,
    /// Its faces: elements of the part to which n points, with their [sides](crate::Element::side).
    pub sides: Vec<[u32; 2]>,
    /// Area of its faces, projected along n. \[L²\]
    pub area: f64,
    /// A node that belongs to no element, and is a node set with the name of the cut: its first displacement
    /// is the distance by which the parts overlap.
    pub reference: u32,
}

/// Why a body cannot be cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CutError {
    /// No face lies between elements on both sides of the plane.
    Nothing,
    /// Faces of the section lie partly beyond the radius.
    Partial {
        /// The largest distance of one of their nodes. \[L\]
        distance: f64,
    },
}

impl Cut {
    /// The name of the surface with its faces in a mesh that is [not cut](Mesh::uncut).
    pub fn surface(&self) -> String {
        format!("section of {}", self.name)
    }
}

impl Mesh {
    /// Cuts a body along the faces between elements whose centroids lie on different sides of the plane through
    /// `point`; nodes farther than `radius` from the point stay joined. Sets keep the nodes that they have,
    /// without the copies. [`Cut::reference`] is 0 until [`add_references`](Self::add_references).
    ///
    /// # Errors
    /// [`CutError`]; the mesh is then unchanged.
    ///
    /// # Panics
    /// If the body does not exist, or if rigid bodies, couplings or points have been added.
    pub fn cut(
        &mut self,
        name: &str,
        body: usize,
        point: [f64; 3],
        normal: [f64; 3],
        radius: f64,
    ) -> Result<(), CutError> {
        assert!(self.rigid.is_empty() && self.couplings.is_empty(), "nodes of no body come last");
        let from = |x: [f64; 3]| -> [f64; 3] { std::array::from_fn(|c| x[c] - point[c]) };
        let along = |x: [f64; 3]| (0..3).map(|c| from(x)[c] * normal[c]).sum::<f64>();
        let near = |node: &u32| from(self.nodes[*node as usize]).iter().map(|c| c * c).sum::<f64>() <= radius * radius;
        let elements = self.bodies[body].elements.clone();
        let above: Vec<bool> = elements
            .clone()
            .map(|e| self.elements[e].corners().iter().map(|&node| along(self.nodes[node as usize])).sum::<f64>() > 0.0)
            .collect();
        let on = |side: bool| elements.clone().zip(&above).filter(move |(_, above)| **above == side).map(|(e, _)| e);
        let nodes_of =
            |side: bool| -> BTreeSet<u32> { on(side).flat_map(|e| self.elements[e].nodes()).copied().collect() };
        let between: BTreeSet<u32> = nodes_of(true).intersection(&nodes_of(false)).copied().collect();
        let sides = |e: usize| {
            let element = &self.elements[e];
            let all = (0..element.sides()).map(move |side| (side, element.side(side)));
            all.filter(|(_, facet)| facet.iter().all(|node| between.contains(node)))
        };
        let below: HashSet<Vec<u32>> =
            on(false).flat_map(|e| sides(e).map(|(_, facet)| facet.sorted().to_vec())).collect();
        let mut cut =
            Cut { name: name.to_owned(), body, normal, nodes: vec![], sides: vec![], area: 0.0, reference: 0 };
        let mut farthest: Option<f64> = None;
        for e in on(true) {
            for (side, facet) in sides(e).filter(|(_, facet)| below.contains(&facet.sorted()[..])) {
                let inside = facet.iter().filter(|node| near(node)).count();
                if inside == facet.len() {
                    let vector = facet_area_vector(&facet.corners(&self.nodes));
                    cut.area -= (0..3).map(|c| vector[c] * normal[c]).sum::<f64>();
                    cut.sides.push([e as u32, side as u32]);
                } else if inside > 0 {
                    let distance =
                        |node: &u32| from(self.nodes[*node as usize]).iter().map(|c| c * c).sum::<f64>().sqrt();
                    farthest = Some(facet.iter().map(distance).fold(farthest.unwrap_or(0.0), f64::max));
                }
            }
        }
        if let Some(distance) = farthest {
            return Err(CutError::Partial { distance });
        }
        if cut.sides.is_empty() || cut.area <= 0.0 {
            return Err(CutError::Nothing);
        }
        let shared: Vec<u32> = between.into_iter().filter(near).collect();
        let end = self.bodies[body].nodes.end as u32;
        let count = shared.len() as u32;
        let copies: BTreeMap<u32, u32> = shared.iter().copied().zip(end..).collect();
        let later = |node: u32| if node < end { node } else { node + count };
        let copied = |e: usize| elements.contains(&e) && above[e - elements.start];
        let number = |e: usize, node: u32| match copies.get(&node) {
            Some(&copy) if copied(e) => copy,
            _ => later(node),
        };
        for (e, element) in self.elements.iter_mut().enumerate() {
            *element = element.map(|node| number(e, node));
        }
        for facet in self.surfaces.values_mut().flat_map(|surface| &mut surface.facets) {
            let e = facet.element as usize;
            facet.nodes = facet.nodes.map(|node| number(e, node));
        }
        self.node_sets.values_mut().flatten().for_each(|node| *node = later(*node));
        self.cuts.iter_mut().flat_map(|cut| cut.nodes.as_flattened_mut()).for_each(|node| *node = later(*node));
        let places: Vec<[f64; 3]> = shared.iter().map(|&node| self.nodes[node as usize]).collect();
        self.nodes.splice(end as usize..end as usize, places);
        self.bodies[body].nodes.end += count as usize;
        for other in &mut self.bodies[body + 1..] {
            other.nodes = other.nodes.start + count as usize..other.nodes.end + count as usize;
        }
        cut.nodes = copies.into_iter().map(|(node, copy)| [node, copy]).collect();
        self.cuts.push(cut);
        Ok(())
    }

    /// The copies of nodes at all cuts, each with the node that it was.
    pub fn copies(&self) -> BTreeMap<u32, u32> {
        let pairs = || self.cuts.iter().flat_map(|cut| &cut.nodes).map(|&[node, copy]| (copy, node));
        let direct: BTreeMap<u32, u32> = pairs().collect();
        let original = |mut node: u32| {
            while let Some(&of) = direct.get(&node) {
                node = of;
            }
            node
        };
        pairs().map(|(copy, _)| (copy, original(copy))).collect()
    }

    /// Number of elements in the part to which the normal of a cut points that touch its section with nodes or edges
    /// only.
    pub fn touching(&self, cut: &Cut) -> usize {
        let copies: BTreeSet<u32> = cut.nodes.iter().map(|[_, copy]| *copy).collect();
        let with_faces: BTreeSet<u32> = cut.sides.iter().map(|[e, _]| *e).collect();
        let touches = |e: &usize| self.elements[*e].nodes().iter().any(|node| copies.contains(node));
        let all = self.bodies[cut.body].elements.clone().filter(touches);
        all.filter(|e| !with_faces.contains(&(*e as u32))).count()
    }

    /// The same nodes, with elements that are joined at the cuts: they do not have the copies.
    #[must_use]
    pub fn joined(&self) -> Self {
        let copies = self.copies();
        let mut out = self.clone();
        let original = |node: u32| copies.get(&node).copied().unwrap_or(node);
        out.elements.iter_mut().for_each(|element| *element = element.map(original));
        out
    }

    /// The mesh before its bodies were cut. The faces of each cut on the side of its normal are a
    /// [surface](Cut::surface), and its reference node remains.
    #[must_use]
    pub fn uncut(&self) -> Self {
        let copies = self.copies();
        let original = |node: u32| copies.get(&node).copied().unwrap_or(node);
        let mut numbers = Vec::with_capacity(self.nodes.len());
        let mut next = 0;
        for node in 0..self.nodes.len() as u32 {
            numbers.push(next);
            next += u32::from(!copies.contains_key(&node));
        }
        numbers.push(next);
        let number = |node: u32| numbers[original(node) as usize];
        let facet = |facet: &Facet| Facet { nodes: facet.nodes.map(number), element: facet.element };
        let renumbered = |surface: &Surface| Surface { facets: surface.facets.iter().map(facet).collect() };
        let mut out = self.clone();
        out.nodes =
            (0..).zip(&self.nodes).filter(|(node, _)| !copies.contains_key(node)).map(|(_, place)| *place).collect();
        out.elements.iter_mut().for_each(|element| *element = element.map(number));
        for body in &mut out.bodies {
            body.nodes = numbers[body.nodes.start] as usize..numbers[body.nodes.end] as usize;
        }
        out.node_sets.values_mut().flatten().for_each(|node| *node = number(*node));
        out.surfaces = self.surfaces.iter().map(|(name, of)| (name.clone(), renumbered(of))).collect();
        out.rigid.iter_mut().for_each(|rigid| rigid.reference = number(rigid.reference));
        out.couplings.iter_mut().for_each(|coupling| coupling.reference = number(coupling.reference));
        for cut in &self.cuts {
            let side = |&[e, side]: &[u32; 2]| Facet {
                nodes: self.elements[e as usize].side(side as usize).map(number),
                element: e,
            };
            out.surfaces.insert(cut.surface(), Surface { facets: cut.sides.iter().map(side).collect() });
        }
        out.cuts.iter_mut().for_each(|cut| (cut.reference, cut.nodes) = (number(cut.reference), Vec::new()));
        out
    }

    /// Adds the reference nodes of all cuts, at the centres of their sections.
    pub fn add_references(&mut self) {
        for at in 0..self.cuts.len() {
            let cut = &self.cuts[at];
            let places = cut.nodes.iter().map(|[node, _]| self.nodes[*node as usize]);
            let sum = places.fold([0.0; 3], |sum, x| std::array::from_fn(|c| sum[c] + x[c]));
            let (centre, name) = (sum.map(|x| x / cut.nodes.len() as f64), cut.name.clone());
            self.cuts[at].reference = self.nodes.len() as u32;
            self.add_point(&name, centre);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::CutError;
    use crate::{BoxShape, Element, Mesh, box_mesh};

    fn boxes() -> Mesh {
        let shape = BoxShape { min: [0.0; 3], max: [2.0, 4.0, 3.0], elements: [2, 4, 3], grading: [1.0; 3] };
        Mesh::merge(["low", "high"].map(|name| box_mesh(name, &shape).unwrap()).into()).unwrap()
    }

    /// A box of 2 × 3 elements in a plane has 12 nodes there, and an area of 6.
    #[test]
    fn a_cut_has_copies_of_its_nodes() {
        let (whole, mut mesh) = (boxes(), boxes());
        mesh.cut("bolt", 0, [0.0, 1.9, 0.0], [0.0, 1.0, 0.0], f64::INFINITY).unwrap();
        mesh.validate().unwrap();
        mesh.add_references();
        let cut = &mesh.cuts[0];
        assert_eq!(mesh.touching(cut), 0);
        assert_eq!((cut.nodes.len(), cut.area, cut.reference), (12, 6.0, mesh.nodes.len() as u32 - 1));
        assert_eq!(mesh.nodes[cut.reference as usize], [1.0, 2.0, 1.5]);
        assert!(cut.nodes.iter().all(|[node, copy]| mesh.nodes[*node as usize] == mesh.nodes[*copy as usize]));
        assert_eq!((mesh.bodies[0].nodes.len(), mesh.bodies[1].nodes.len()), (60 + 12, 60));
        let joined = mesh.uncut();
        assert_eq!((&joined.elements, &joined.bodies), (&whole.elements, &whole.bodies));
        assert_eq!(joined.nodes[..120], whole.nodes[..]);
        assert_eq!((joined.surfaces["section of bolt"].facets.len(), joined.cuts[0].reference), (6, 120));
        assert!(whole.surfaces.iter().all(|(name, surface)| joined.surfaces[name] == *surface));
        // every element and facet is where it was
        let places = |mesh: &Mesh, nodes: &[u32]| nodes.iter().map(|&n| mesh.nodes[n as usize]).collect::<Vec<_>>();
        for (old, new) in whole.elements.iter().zip(&mesh.elements) {
            assert_eq!(places(&whole, old.nodes()), places(&mesh, new.nodes()));
        }
        for (name, surface) in &whole.surfaces {
            for (old, new) in surface.facets.iter().zip(&mesh.surfaces[name].facets) {
                assert_eq!(places(&whole, &old.nodes), places(&mesh, &new.nodes));
            }
        }
        let below = |e: usize| (mesh.elements[e].nodes().iter()).all(|&n| mesh.nodes[n as usize][1] <= 2.0);
        let shared: Vec<u32> = cut.nodes.iter().map(|[_, copy]| *copy).collect();
        for e in 0..24 {
            let copies = mesh.elements[e].nodes().iter().filter(|node| shared.contains(node)).count();
            let touches = mesh.elements[e].nodes().iter().any(|&n| mesh.nodes[n as usize][1] == 2.0);
            assert_eq!(copies > 0, touches && !below(e));
        }
    }

    /// In tetrahedra, the section is jagged: its faces lie between elements of both sides, and close it.
    #[test]
    fn a_section_through_tetrahedra_is_closed() {
        let shape = BoxShape { min: [0.0; 3], max: [2.0, 4.0, 3.0], elements: [4, 8, 6], grading: [1.0; 3] };
        let mut mesh = box_mesh("rod", &shape).unwrap().divided(|_| true);
        mesh.cut("bolt", 0, [0.0, 1.9, 0.0], [0.0, 1.0, 0.0], f64::INFINITY).unwrap();
        assert!(matches!(mesh.elements[0], Element::Tet4(_)));
        assert!((mesh.cuts[0].area - 6.0).abs() < 1e-12, "the projection of a closed section");
        let copies = mesh.copies();
        for [e, side] in &mesh.cuts[0].sides {
            assert!(mesh.elements[*e as usize].side(*side as usize).iter().all(|node| copies.contains_key(node)));
        }
        assert!(mesh.touching(&mesh.cuts[0]) > 0, "tetrahedra touch it with edges");
        mesh.validate().unwrap();
        assert_eq!(mesh.connected_parts(0).len(), 2);
    }

    #[test]
    fn a_plane_beside_the_body_cuts_nothing() {
        let mut mesh = boxes();
        let mut refused = |point, radius| mesh.cut("bolt", 0, point, [0.0, 1.0, 0.0], radius).unwrap_err();
        assert_eq!(refused([0.0, 5.0, 0.0], f64::INFINITY), CutError::Nothing);
        assert_eq!(refused([9.0, 2.0, 0.0], 1.0), CutError::Nothing);
        // a radius that ends inside the section
        assert_eq!(refused([0.0, 2.0, 0.0], 1.5), CutError::Partial { distance: 2.0_f64.hypot(2.0) });
        assert_eq!(mesh, boxes());
    }
}

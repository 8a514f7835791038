//! Rigid bodies: six unknowns determine the positions of all their nodes.

use crate::Mesh;

/// A body that does not deform. Two extra nodes at the end of the mesh, which belong to no element,
/// hold its unknowns: the displacement of the first is that of the reference point, and the
/// "displacement" of the second is [`length`](Self::length) times the rotation vector.
#[derive(Debug, Clone, PartialEq)]
pub struct Rigid {
    /// Number of the body in [`Mesh::bodies`].
    pub body: usize,
    /// The node at the reference point.
    pub reference: u32,
    /// Largest distance of a node of the body from the reference point, a scale that makes forces
    /// and moments comparable. \[L\]
    pub length: f64,
}

/// A reference point to which nodes are coupled, with two nodes like those of a rigid body.
#[derive(Debug, Clone, PartialEq)]
pub struct Coupling {
    /// Its name.
    pub name: String,
    /// The node at the reference point.
    pub reference: u32,
    /// Largest distance of a coupled node from the reference point. \[L\]
    pub length: f64,
}

impl Coupling {
    /// The node that holds the rotation.
    pub fn rotation(&self) -> u32 {
        self.reference + 1
    }
}

/// The unknowns of a rigid body or a coupling.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reference {
    /// The node at the reference point; the next node holds the rotation.
    pub node: u32,
    /// The scale of the rotation. \[L\]
    pub length: f64,
}

impl Rigid {
    /// The node that holds the rotation.
    pub fn rotation(&self) -> u32 {
        self.reference + 1
    }
}

impl Mesh {
    /// Makes a body rigid, with its reference point at `point`; its nodes become a node set with
    /// the body's name.
    ///
    /// # Panics
    /// If the body does not exist.
    pub fn make_rigid(&mut self, body: usize, point: [f64; 3]) {
        let nodes = self.bodies[body].nodes.clone();
        let distance = |x: &[f64; 3]| (0..3).map(|c| (x[c] - point[c]).powi(2)).sum::<f64>().sqrt();
        let length = self.nodes[nodes.clone()].iter().map(distance).fold(f64::MIN_POSITIVE, f64::max);
        let reference = self.nodes.len() as u32;
        self.nodes.extend([point; 2]);
        self.node_sets.insert(self.bodies[body].name.clone(), nodes.map(|node| node as u32).collect());
        self.rigid.push(Rigid { body, reference, length });
    }

    /// Adds a node that belongs to no element, and a node set with this name.
    pub fn add_point(&mut self, name: &str, at: [f64; 3]) {
        self.node_sets.insert(name.to_owned(), vec![self.nodes.len() as u32]);
        self.nodes.push(at);
    }

    /// Adds a reference point for these nodes, and a node set with its name.
    pub fn add_coupling(&mut self, name: &str, at: [f64; 3], nodes: &[u32]) {
        let distance = |x: [f64; 3]| (0..3).map(|c| (x[c] - at[c]).powi(2)).sum::<f64>().sqrt();
        let length = nodes.iter().map(|&node| distance(self.nodes[node as usize])).fold(f64::MIN_POSITIVE, f64::max);
        let reference = self.nodes.len() as u32;
        self.nodes.extend([at; 2]);
        self.node_sets.insert(name.to_owned(), vec![reference]);
        self.couplings.push(Coupling { name: name.to_owned(), reference, length });
    }

    /// The unknowns of the rigid body or the coupling with this name.
    pub fn reference_of(&self, name: &str) -> Option<Reference> {
        let rigid = self.rigid.iter().find(|rigid| self.bodies[rigid.body].name == name);
        let rigid = rigid.map(|rigid| Reference { node: rigid.reference, length: rigid.length });
        let of = |coupling: &Coupling| Reference { node: coupling.reference, length: coupling.length };
        rigid.or_else(|| self.couplings.iter().find(|coupling| coupling.name == name).map(of))
    }

    /// The rigid body to which all these nodes belong.
    pub fn rigid_body_of(&self, nodes: &[u32]) -> Option<&Rigid> {
        let all_in = |rigid: &&Rigid| {
            let range = &self.bodies[rigid.body].nodes;
            !nodes.is_empty() && nodes.iter().all(|&node| range.contains(&(node as usize)))
        };
        self.rigid.iter().find(all_in)
    }

    /// Whether an element belongs to a rigid body.
    pub fn is_rigid(&self, element: usize) -> bool {
        self.rigid.iter().any(|rigid| self.bodies[rigid.body].elements.contains(&element))
    }
}

//! The nodes that equations join.

use std::collections::{BTreeMap, BTreeSet, HashSet};

use super::turned::ALONG;
use super::{Finder, Held, POINT};
use crate::bodies::{find, rigid_nodes};
use crate::history::Track;
use crate::read::Coupling;

/// A term: a set of the file on bodies, a point or a rigid body, with a component from 0 and a factor.
#[derive(Debug)]
pub struct Joined {
    /// `None`: the rigid body itself.
    pub set: Option<String>,
    pub body: usize,
    pub component: u8,
    pub factor: f64,
}

/// A surface or a set of nodes of the file on a body that is coupled to a node of no body.
#[derive(Debug)]
pub struct CoupledFace {
    pub node: u32,
    /// The node whose displacements are the rotation, for a rigid body.
    pub rotation: Option<u32>,
    pub name: String,
    pub surface: String,
    pub body: usize,
    pub kinematic: bool,
    /// The keyword that says so.
    pub keyword: &'static str,
    pub line: usize,
}

/// An equation, and the line of its keyword.
pub type EquationOfSets = (Vec<Joined>, usize);

impl Finder<'_> {
    /// The nodes of no body that equations and springs use: they become points.
    pub(super) fn find_points(&mut self) {
        let (deck, constraints) = (self.deck, std::mem::take(&mut self.constraints));
        let mut nodes = BTreeSet::new();
        for equation in deck.equations.iter().chain(&constraints) {
            for term in &equation.terms {
                nodes.extend(self.own_nodes(&term.target, "EQUATION", equation.lines));
            }
        }
        self.constraints = constraints;
        nodes.retain(|&node| self.bodies.of(node).is_none() && self.reference(node).is_none());
        nodes.retain(|&node| self.couplings.iter().all(|coupling| coupling.node != node));
        for rigid in &deck.rigids {
            let Some(node) = rigid_nodes(self.mesh, rigid).into_iter().find(|node| nodes.contains(node)) else {
                continue;
            };
            let number = self.mesh.point_numbers[node as usize];
            let why = format!("its node {number} belongs to no element, and an equation joins it");
            self.ledger.refuse("RIGID BODY", rigid.line, why, "name the reference node in the equation");
        }
        for node in nodes {
            let name = format!("node_{}", self.mesh.point_numbers[node as usize]);
            self.points.push((node, name));
        }
    }

    /// The motions of points, which are taken from `of_node`.
    pub(super) fn held_points(&self, of_node: &mut BTreeMap<u32, Vec<(u8, &Track)>>) -> Vec<Held> {
        let mut held = Vec::new();
        let couplings = self.couplings.iter().map(|coupling| (&coupling.node, &coupling.name));
        for (node, name) in self.points.iter().map(|(node, name)| (node, name)).chain(couplings) {
            let Some(components) = of_node.remove(node) else { continue };
            let line = components[0].1.line;
            let components = components.iter().map(|(component, track)| (*component, track.simple())).collect();
            held.push(Held { set: Some(name.clone()), bodies: vec![POINT], components, line, from: 0.0, until: None });
        }
        held
    }

    /// The couplings whose surfaces and reference nodes exist.
    pub(super) fn find_couplings(&mut self) {
        let deck = self.deck;
        for coupling in &deck.couplings {
            let line = coupling.line;
            let mut wrong = |why: String, cure: &str| self.ledger.wrong("COUPLING", [line; 2], why, cure);
            let Some(node) = self.bodies.position(coupling.reference) else {
                wrong(format!("there is no node {}", coupling.reference), "define the reference node");
                continue;
            };
            if coupling.kinematic.is_none() {
                wrong("it does not say how".into(), "write *KINEMATIC or *DISTRIBUTING after it");
                continue;
            }
            let Some(surface) = self.surface_of_coupling(coupling) else { continue };
            let bodies = match self.surface(&surface) {
                Some(_) => self.bodies.under(self.mesh, &surface),
                None => self.bodies_at(&surface),
            };
            let (&[body], None) = (&bodies[..], self.bodies.of(node)) else {
                let why = "the surface must lie on one body, and the reference node on none";
                self.ledger.refuse("COUPLING", line, why, "write a coupling for each body, with a node of its own");
                continue;
            };
            let mut name = crate::bodies::proper(&coupling.name);
            while self.couplings.iter().any(|other| other.name == name) {
                name.push('_');
            }
            let kinematic = coupling.kinematic == Some(true);
            let (rotation, keyword) = (None, "COUPLING");
            self.couplings.push(CoupledFace { node, rotation, name, surface, body, kinematic, keyword, line });
        }
    }

    /// The surface of a coupling. A surface of nodes is the set of these if the coupling is kinematic, otherwise the
    /// faces all of whose nodes it has. `None` after an error.
    fn surface_of_coupling(&mut self, coupling: &Coupling) -> Option<String> {
        if let Some(surface) = self.surface(&coupling.surface) {
            return Some(surface);
        }
        let line = coupling.line;
        let Some(set) = find(&self.mesh.node_sets, &coupling.surface).map(str::to_owned) else {
            let why = format!("there is no surface `{}`", coupling.surface);
            self.ledger.wrong("COUPLING", [line; 2], why, "define it with *SURFACE");
            return None;
        };
        if coupling.kinematic == Some(false) {
            let nodes: HashSet<u32> = self.mesh.node_sets[&set].iter().copied().collect();
            let faces = self.mesh.free_faces(&nodes);
            let covered = self.mesh.nodes_of_faces(&faces);
            let own = |node: &u32| self.centres.first().is_none_or(|first| *node < first.node);
            let loose = self.mesh.node_sets[&set].iter().copied().find(|node| own(node) && !covered.contains(node));
            if let Some(node) = loose {
                let number = self.mesh.point_numbers[node as usize];
                let why = format!("node {number} of `{set}` is on no free face all of whose corners are in this set");
                let cure = "name a surface of faces, or add the other corners of the faces around the node";
                self.ledger.refuse("COUPLING", line, why, cure);
                return None;
            }
            let how = "`[[coupling]]`, for small rotations; nodes are weighted by the area of the faces around them, \
                       where Abaqus weights all nodes of a surface of nodes equally";
            self.mesh.notices.push(format!("line {line}: {how}"));
            self.ledger.translated("COUPLING", line, how);
            self.mesh.face_sets.insert(set.clone(), faces);
        }
        Some(set)
    }

    /// The bodies at the nodes of a set.
    fn bodies_at(&self, set: &str) -> Vec<usize> {
        let nodes = self.mesh.node_sets.get(set).into_iter().flatten();
        let bodies: BTreeSet<usize> = nodes.filter_map(|&node| self.bodies.of(node)).collect();
        bodies.into_iter().collect()
    }

    /// The name of the point at a node, and the number of its components: with rotations, that of a coupling.
    pub(super) fn point(&self, node: u32) -> Option<(&str, u8)> {
        let coupling = self.couplings.iter().find(|coupling| coupling.node == node);
        let coupling = coupling.map(|coupling| (coupling.name.as_str(), 6));
        let point = || self.points.iter().find(|(known, _)| *known == node);
        coupling.or_else(|| point().map(|(_, name)| (name.as_str(), 3)))
    }

    pub(super) fn equations(&mut self) -> Vec<EquationOfSets> {
        let (deck, constraints, mut found) = (self.deck, std::mem::take(&mut self.constraints), Vec::new());
        let all = || deck.equations.iter().chain(&constraints);
        let targets =
            all().filter(|of| !of.global).flat_map(|of| of.terms.iter().map(move |term| (&term.target, of.lines)));
        let used: BTreeSet<u32> =
            targets.flat_map(|(target, lines)| self.own_nodes(target, "EQUATION", lines)).collect();
        let axes = self.local_axes(|node| used.contains(&node));
        for equation in all() {
            let columns: Vec<Vec<u32>> =
                equation.terms.iter().map(|term| self.own_nodes(&term.target, "EQUATION", equation.lines)).collect();
            let count = columns.iter().map(Vec::len).max().unwrap_or(0);
            if let Some(odd) = columns.iter().find(|nodes| nodes.len() != 1 && nodes.len() != count) {
                let why = format!("a set of {} nodes does not fit to one of {count}", odd.len());
                self.ledger.wrong("EQUATION", equation.lines, why, "name sets of equally many nodes, or single nodes");
                continue;
            }
            for at in 0..count {
                let mut terms = Vec::new();
                for (term, nodes) in equation.terms.iter().zip(&columns) {
                    let node = nodes[if nodes.len() == 1 { 0 } else { at }];
                    let (set, body) = self.joined_node(node);
                    let local = axes.get(&node).filter(|_| term.component < 3 && !equation.global);
                    let Some((axes, on_axis, line)) = local else {
                        terms.push(Joined { set, body, component: term.component, factor: term.factor });
                        continue;
                    };
                    if *on_axis && term.component < 2 {
                        let why = "an equation has a node on the axis, where no direction is radial or tangential";
                        self.ledger.refuse("TRANSFORM", *line, why, "leave the node out of the set");
                    }
                    for (component, cosine) in (0..3).zip(axes[usize::from(term.component)]) {
                        if cosine.abs() > ALONG {
                            terms.push(Joined { set: set.clone(), body, component, factor: term.factor * cosine });
                        }
                    }
                }
                found.push((terms, equation.lines[0]));
            }
        }
        found
    }

    /// The set with a single node, and its body.
    pub(super) fn joined_node(&mut self, node: u32) -> (Option<String>, usize) {
        if let Some((body, _)) = self.reference(node) {
            return (None, body);
        }
        if let Some((name, _)) = self.point(node) {
            return (Some(name.to_owned()), POINT);
        }
        let name = format!("node_{}", self.mesh.point_numbers[node as usize]);
        self.mesh.node_sets.entry(name.clone()).or_insert_with(|| vec![node]);
        (Some(name), self.bodies.of(node).unwrap_or(0))
    }
}

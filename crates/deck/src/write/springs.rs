//! Springs.

use super::{Writer, quoted, vector};
use crate::targets::{End, Sprung};

impl Writer<'_> {
    pub(super) fn springs(&mut self) {
        let mut number = 0;
        for sprung in &self.targets.sprung {
            for set in self.attached(&sprung.end) {
                number += 1;
                self.spring(sprung, &set, number);
            }
        }
    }

    /// The sets of an end in the case, one for each body.
    fn attached(&self, end: &End) -> Vec<String> {
        match end {
            End::Nodes(set, bodies) => bodies.iter().map(|&body| self.on(body, set)).collect(),
            End::Body(body) => vec![self.bodies.list[*body].name.clone()],
            End::Held(_) => Vec::new(),
        }
    }

    /// Where an end with a single node is.
    fn position(&self, end: &End) -> [f64; 3] {
        let node = match end {
            End::Nodes(set, _) => self.mesh.node_sets.get(set).and_then(|nodes| nodes.first().copied()),
            End::Body(body) => {
                self.bodies.list[*body].rigid.and_then(|rigid| self.bodies.position(self.deck.rigids[rigid].reference))
            }
            End::Held(node) => Some(*node),
        };
        node.map_or([0.0; 3], |node| self.mesh.points[node as usize])
    }

    fn spring(&mut self, sprung: &Sprung, set: &str, number: usize) {
        self.table("spring", "SPRING", sprung.line);
        self.line(format!("name = \"spring_{number}\"\nset = {}", quoted(set)));
        match &sprung.to {
            // along an axis, any fixed point is the ground
            Some(End::Held(node)) if sprung.direction.is_none() => {
                let point = vector(&self.mesh.points[*node as usize]);
                self.line(format!("to = {point}"));
            }
            Some(end) => self.attached(end).iter().for_each(|to| self.line(format!("to = {}", quoted(to)))),
            None => {}
        }
        match sprung.direction {
            Some(axis) => self.line(format!("direction = {}", vector(&axis))),
            None if self.deck.steps.iter().any(|step| step.nlgeom) => self.line("direction = \"line\""),
            // linear steps keep the line of the mesh
            None => {
                let (from, to) =
                    (self.position(&sprung.end), sprung.to.as_ref().map_or([0.0; 3], |to| self.position(to)));
                let line: [f64; 3] = std::array::from_fn(|c| from[c] - to[c]);
                self.line(format!("direction = {}", vector(&line)));
            }
        }
        self.line(format!("nodal_stiffness = {:?}", sprung.stiffness));
    }
}

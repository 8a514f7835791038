//! Rigid bodies that are only a part of a deformable one.

use std::collections::{BTreeMap, BTreeSet};

use super::{CoupledFace, Finder, OfNode};
use crate::bodies::{find, rigid_nodes};
use crate::history::Track;
use crate::read::{Rigid, Target};

/// Rotation up to which a coupling, which is linear in it, is close: displacements then deviate by 2 %.
const SMALL: f64 = 0.04;

impl Finder<'_> {
    /// Couples the nodes of rigid bodies that are a part of a deformable one to their reference nodes, unless all
    /// motions of these are prescribed: then [`Finder::rigid_faces`] prescribes those of the nodes.
    pub(super) fn couple_rigid_faces(&mut self) {
        for (index, rigid) in self.deck.rigids.iter().enumerate() {
            let Some(node) = self.bodies.position(rigid.reference) else { continue };
            let (driven, turns) = self.driven(rigid);
            if self.is_whole(index) || (0..6).all(|c| driven.contains(&c)) || self.bodies.of(node).is_some() {
                continue;
            }
            if turns > SMALL && self.deck.steps.iter().any(|step| step.nlgeom) {
                let why = format!(
                    "a part of a deformable body turns by {turns}, and only rotations up to {SMALL} are linear"
                );
                self.ledger.refuse("RIGID BODY", rigid.line, why, "make the whole body rigid");
                continue;
            }
            let nodes: Vec<u32> =
                rigid_nodes(self.mesh, rigid).into_iter().filter(|&node| self.bodies.of(node).is_some()).collect();
            let of: BTreeSet<usize> = nodes.iter().filter_map(|&node| self.bodies.of(node)).collect();
            let (Some(&body), 1) = (of.first(), of.len()) else { continue };
            let sets: Vec<String> =
                rigid.nodes.iter().filter_map(|set| find(&self.mesh.node_sets, set)).map(str::to_owned).collect();
            let (surface, _) = self.set_of(&nodes, &sets, "rigid");
            let (name, line) = (format!("rigid_{}", rigid.reference), rigid.line);
            let how = "`[[coupling]]` of its nodes to the reference node, for small rotations";
            self.ledger.translated("RIGID BODY", line, how);
            let rotation = rigid.rotation.and_then(|number| self.bodies.position(number));
            let keyword = "RIGID BODY";
            self.couplings.push(CoupledFace { node, rotation, name, surface, body, kinematic: true, keyword, line });
        }
    }

    /// Whether whole bodies are this rigid body.
    fn is_whole(&self, index: usize) -> bool {
        self.bodies.list.iter().any(|body| body.rigid == Some(index))
    }

    /// The components of the motion of a rigid body that conditions name, and the largest prescribed rotation.
    fn driven(&self, rigid: &Rigid) -> (BTreeSet<u8>, f64) {
        let steps = self.deck.steps.iter().flat_map(|step| &step.conditions.items);
        let (mut driven, mut turns) = (BTreeSet::new(), 0.0_f64);
        for condition in self.deck.conditions.iter().chain(steps) {
            let names = |number: u64| match &condition.target {
                Target::Node(own) => *own == number,
                Target::Set(set) => self.bodies.position(number).is_some_and(|node| {
                    find(&self.mesh.node_sets, set).is_some_and(|set| self.mesh.node_sets[set].contains(&node))
                }),
            };
            let of_rotation = rigid.rotation.is_some_and(names).then_some(condition.component + 3);
            for component in names(rigid.reference).then_some(condition.component).into_iter().chain(of_rotation) {
                driven.insert(component);
                turns = if component > 2 { turns.max(condition.value.abs()) } else { turns };
            }
        }
        (driven, turns)
    }

    /// The same tracks, with those of the rotation nodes of couplings at their reference nodes.
    pub(super) fn with_rotations(&self, mut tracks: BTreeMap<OfNode, Track>) -> BTreeMap<OfNode, Track> {
        for coupling in &self.couplings {
            for component in 0..3 {
                let rotation = coupling.rotation.and_then(|node| tracks.remove(&(node, component)));
                if let Some(track) = rotation {
                    tracks.insert((coupling.node, component + 3), track);
                }
            }
        }
        tracks
    }

    /// Rigid bodies that are faces of deformable ones: their nodes move as the reference node does, if it
    /// does not turn.
    pub(super) fn rigid_faces(&mut self, tracks: &mut BTreeMap<OfNode, Track>) {
        for (index, rigid) in self.deck.rigids.iter().enumerate() {
            let Some(reference) = self.bodies.position(rigid.reference) else { continue };
            let known = self.ledger.uses.iter().any(|of| of.line == rigid.line && of.how.word() == "refused");
            if self.is_whole(index) || known || self.couplings.iter().any(|coupling| coupling.node == reference) {
                continue;
            }
            let rotation = rigid.rotation.and_then(|number| self.bodies.position(number));
            let known = |component: u8| match (rotation, component) {
                (Some(node), 3..) => tracks.get(&(node, component - 3)),
                _ => tracks.get(&(reference, component)),
            };
            let held: Option<Vec<Track>> = (0..6).map(|component| known(component).cloned()).collect();
            let turns =
                |held: &Vec<Track>| held[3..].iter().any(|track| track.curve.iter().any(|point| point[1] != 0.0));
            let Some(held) = held.filter(|held| !turns(held)) else {
                let why = "a part of a deformable body can only be rigid if all components of its motion are prescribed, \
                           without rotation, or if its reference node belongs to no body";
                let cure = "choose another reference node, or make the whole body rigid";
                self.ledger.refuse("RIGID BODY", rigid.line, why, cure);
                continue;
            };
            self.ledger.translated("RIGID BODY", rigid.line, "its nodes move as prescribed for the reference node");
            for node in rigid_nodes(self.mesh, rigid) {
                for (component, track) in (0..3).zip(&held) {
                    tracks.insert((node, component), Track { set: rigid.nodes.clone(), ..track.clone() });
                }
            }
        }
    }
}

//! Sections that are pulled together.

use std::collections::BTreeMap;

use super::{Finder, OfNode};
use crate::bodies::proper;
use crate::history::{Curve, Timeline, Track, value_at};
use crate::read::{Condition, Pretension, Target};

/// A body, the plane at which it is cut, and its force.
#[derive(Debug)]
pub struct Tightened {
    pub name: String,
    pub body: usize,
    pub point: [f64; 3],
    pub normal: [f64; 3],
    pub radius: f64,
    pub force: Curve,
    /// Whether it keeps its length after the last waypoint.
    pub keeps_length: bool,
    pub line: usize,
}

/// How far nodes of the section may lie from its centre, relative to those of the surface.
const BEYOND: f64 = 1.25;

/// Cosine of the largest angle between the direction of a section and the normal of its faces: five degrees.
const OBLIQUE: f64 = 0.9962;

impl Finder<'_> {
    /// Whether a condition keeps the nodes of sections, and no others.
    pub(super) fn is_of_sections(&mut self, condition: &Condition) -> bool {
        let nodes = self.nodes(&condition.target, "BOUNDARY", condition.lines);
        let is_section =
            |node: &u32| self.deck.pretensions.iter().any(|section| self.bodies.position(section.node) == Some(*node));
        nodes.iter().all(is_section)
    }

    /// Whether a condition keeps this node.
    fn keeps(&self, condition: &Condition, node: u64) -> bool {
        let is = match &condition.target {
            Target::Node(number) => *number == node,
            Target::Set(name) => {
                let set = crate::bodies::find(&self.mesh.node_sets, name);
                let position = self.bodies.position(node);
                position.is_some_and(|at| set.is_some_and(|set| self.mesh.node_sets[set].contains(&at)))
            }
        };
        condition.fixed && condition.component == 0 && is
    }

    /// The step from whose start a node is kept.
    fn kept_from(&self, node: u64) -> Option<usize> {
        self.deck.steps.iter().position(|step| step.conditions.items.iter().any(|of| self.keeps(of, node)))
    }

    /// The line of a keyword in a step after this one that ends all conditions and does not keep the node again.
    fn released(&self, node: u64, from: usize) -> Option<usize> {
        let later = self.deck.steps.iter().skip(from + 1).map(|step| &step.conditions);
        let mut ends = later.filter(|of| of.replaces && !of.items.iter().any(|of| self.keeps(of, node)));
        ends.next().map(|of| of.items.first().map_or(1, |of| of.lines[0]))
    }

    /// The bolts; their motions and forces are taken from the others.
    pub(super) fn bolts(
        &mut self,
        timeline: &Timeline,
        motions: &mut BTreeMap<OfNode, Track>,
        forces: &mut BTreeMap<OfNode, Track>,
    ) -> Vec<Tightened> {
        let mut bolts: Vec<Tightened> = Vec::new();
        for (k, section) in self.deck.pretensions.iter().enumerate() {
            if self.deck.pretensions[..k].iter().any(|other| other.node == section.node) {
                let why = format!("node {} belongs to another section", section.node);
                self.ledger.wrong("PRE-TENSION SECTION", [section.line; 2], why, "give each section a node of its own");
                continue;
            }
            let Some(mut bolt) = self.tightened(section, timeline, motions, forces) else { continue };
            while bolts.iter().any(|other| other.name == bolt.name) {
                bolt.name.push('_');
            }
            bolts.push(bolt);
        }
        bolts
    }

    fn tightened(
        &mut self,
        section: &Pretension,
        timeline: &Timeline,
        motions: &mut BTreeMap<OfNode, Track>,
        forces: &mut BTreeMap<OfNode, Track>,
    ) -> Option<Tightened> {
        const KEYWORD: &str = "PRE-TENSION SECTION";
        let line = section.line;
        let Some(node) = self.bodies.position(section.node).filter(|&node| self.bodies.of(node).is_none()) else {
            let why = format!("node {} does not exist, or belongs to an element", section.node);
            self.ledger.wrong(KEYWORD, [line; 2], why, "define a node of its own for the section");
            return None;
        };
        let Some(surface) = self.surface(&section.surface) else {
            let why = format!("there is no surface `{}`", section.surface);
            self.ledger.wrong(KEYWORD, [line; 2], why, "define it with *SURFACE, by faces of elements");
            return None;
        };
        let &[body] = &self.bodies.under(self.mesh, &surface)[..] else {
            let why = "the surface must lie in one body";
            self.ledger.refuse(KEYWORD, line, why, "write a section for each body, with a node of its own");
            return None;
        };
        let (centre, area, radius) = self.plane_of(&surface);
        let normal = section.normal.unwrap_or(area);
        let size = normal.iter().map(|n| n * n).sum::<f64>().sqrt();
        let along = (0..3).map(|c| normal[c] * area[c]).sum::<f64>() / size.max(f64::MIN_POSITIVE);
        if area != [0.0; 3] && along.abs() < OBLIQUE {
            let why = "the direction is oblique to the faces of the surface";
            self.ledger.refuse(KEYWORD, line, why, "remove the line of data, or name faces across the direction");
            return None;
        }
        // a force along the outward normal of the faces pulls the parts together
        let sign = if along < 0.0 { -1.0 } else { 1.0 };
        if normal == [0.0; 3] {
            let why = format!("the faces of `{surface}` have no common normal");
            self.ledger.refuse(KEYWORD, line, why, "give the direction in a line of data");
            return None;
        }
        (1..6).for_each(|component| _ = motions.remove(&(node, component)));
        if let Some(track) = motions.remove(&(node, 0)) {
            let why = "a prescribed displacement of the section is not supported";
            self.ledger.refuse("BOUNDARY", track.line, why, "give its force with *CLOAD, and FIXED in a later step");
            return None;
        }
        (1..6).for_each(|component| _ = forces.remove(&(node, component)));
        let of_track =
            |track: Track| (track.simple().iter().map(|[t, force]| [*t, sign * force]).collect(), track.line);
        let force: Option<(Curve, usize)> = forces.remove(&(node, 0)).map(of_track);
        let Some((mut force, of_force)) = force.filter(|(force, _)| force.iter().any(|point| point[1] != 0.0)) else {
            let why = "the section has no force";
            self.ledger.refuse(KEYWORD, line, why, "load its node with *CLOAD, component 1");
            return None;
        };
        if force.iter().any(|point| point[1] < 0.0) {
            self.ledger.refuse("CLOAD", of_force, "the force of a section pushes its parts apart", "reverse its sign");
        }
        let kept = self.kept_from(section.node);
        if let Some(released) = kept.and_then(|from| self.released(section.node, from)) {
            let why = "a section that is kept and then released is not supported";
            self.ledger.refuse("BOUNDARY", released, why, "keep it in all later steps: name it again after OP=NEW");
        }
        if let Some(step) = kept {
            let start = timeline.at(step, 0);
            let reached = value_at(&force, start);
            force.retain(|point| point[0] < start - 1e-9);
            force.push([start, reached]);
            if start <= 0.0 {
                self.ledger.refuse(
                    KEYWORD,
                    line,
                    "the section is kept from the start",
                    "tighten it in an earlier step",
                );
                return None;
            }
        }
        let name = proper(&section.surface);
        Some(Tightened { name, body, point: centre, normal, radius, force, keeps_length: kept.is_some(), line })
    }

    /// Centre, vector area and radius of a surface.
    fn plane_of(&self, surface: &str) -> ([f64; 3], [f64; 3], f64) {
        let faces = self.mesh.face_sets.get(surface).map(|faces| self.mesh.corners_of(faces)).unwrap_or_default();
        let place = |node: &u32| self.mesh.points[*node as usize];
        let mut area = [0.0; 3];
        let (mut sum, mut count) = ([0.0; 3], 0.0);
        for face in &faces {
            let x: Vec<[f64; 3]> = face.iter().map(place).collect();
            for k in 1..x.len() - 1 {
                let [a, b] = [k, k + 1].map(|j| [0, 1, 2].map(|c| x[j][c] - x[0][c]));
                let cross = |c: usize| a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3];
                (0..3).for_each(|c| area[c] += 0.5 * cross(c));
            }
            x.iter().for_each(|x| (0..3).for_each(|c| sum[c] += x[c]));
            count += x.len() as f64;
        }
        let centre = sum.map(|x| x / f64::max(count, 1.0));
        let distance = |x: [f64; 3]| (0..3).map(|c| (x[c] - centre[c]).powi(2)).sum::<f64>().sqrt();
        let radius = faces.iter().flatten().map(|node| distance(place(node))).fold(0.0, f64::max);
        let size = area.iter().map(|c| c * c).sum::<f64>().sqrt();
        let normal = if size > 0.0 { area.map(|c| c / size) } else { area };
        (centre, normal, BEYOND * radius)
    }
}

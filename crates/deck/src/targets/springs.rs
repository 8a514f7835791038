//! The nodes that springs join.

use std::collections::BTreeMap;

use super::{Finder, OfNode, POINT};
use crate::history::Track;
use crate::read::{CONNECTOR, SpringSection};
use crate::vector::cross;

/// Equal springs on nodes of the file.
#[derive(Debug)]
pub struct Sprung {
    /// Their first ends.
    pub end: End,
    /// Their second ends; `None`: the ground.
    pub to: Option<End>,
    /// The direction in which they act; `None`: along the line.
    pub direction: Option<[f64; 3]>,
    pub stiffness: f64,
    pub line: usize,
}

/// What an end of springs is attached to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum End {
    /// Nodes of a set of the file, on these bodies, or a point.
    Nodes(String, Vec<usize>),
    /// The reference point of a rigid body.
    Body(usize),
    /// A node that is held, and belongs to no body.
    Held(u32),
}

impl Finder<'_> {
    /// The springs of all sections.
    pub(super) fn springs(&mut self, motions: &BTreeMap<OfNode, Track>) -> Vec<Sprung> {
        let (deck, mut sprung) = (self.deck, Vec::new());
        for section in &deck.springs {
            let elements: Vec<_> =
                deck.spring_elements.iter().filter(|element| element.sets.contains(&section.set)).collect();
            if elements.is_empty() {
                let why = format!("there is no set of spring elements `{}`", section.set);
                self.ledger.wrong(
                    section.keyword,
                    [section.line; 2],
                    why,
                    "name an *ELSET of SPRING1, SPRING2, SPRINGA or CONN3D2",
                );
            }
            let Some(axes) = self.spring_axes(section) else { continue };
            let along = |component: u8| axes[usize::from(component)];
            let mut grounded: Vec<u32> = Vec::new();
            for element in elements {
                let nodes: Option<Vec<u32>> =
                    element.nodes.iter().map(|&number| self.spring_node(number, section)).collect();
                let Some(nodes) = nodes else { continue };
                match (element.kind, &section.components[..]) {
                    ('1', [_]) => grounded.push(nodes[0]),
                    ('2' | CONNECTOR, [first, second]) if first == second => {
                        sprung.extend(self.joined([nodes[0], nodes[1]], Some(along(*first)), section, motions));
                    }
                    ('2', [_, _]) => {
                        let why = "a spring between different components is not supported";
                        self.ledger.refuse(section.keyword, section.line, why, "join equal components");
                    }
                    ('A', _) | (CONNECTOR, []) => {
                        sprung.extend(self.joined([nodes[0], nodes[1]], None, section, motions))
                    }
                    _ => {
                        let why = "SPRING1 needs a line with one component, and SPRING2 one with two";
                        self.ledger.wrong(section.keyword, [section.line; 2], why, "add the components");
                    }
                }
            }
            let direction = section.components.first().map(|&component| along(component));
            self.grounded(grounded, direction, section, motions, &mut sprung);
        }
        sprung
    }

    /// The axes to which the components of springs belong; `None` after an error.
    fn spring_axes(&mut self, section: &SpringSection) -> Option<[[f64; 3]; 3]> {
        let Some(name) = &section.orientation else {
            return Some([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        };
        let Some(orientation) = self.deck.orientations.get(name) else {
            let why = format!("there is no orientation `{name}`");
            self.ledger.wrong(section.keyword, [section.line; 2], why, "define it with *ORIENTATION");
            return None;
        };
        if orientation.about.is_some() {
            let why = "springs along cylindrical axes are not supported";
            self.ledger.refuse(section.keyword, section.line, why, "write an *ORIENTATION with SYSTEM=RECTANGULAR");
            return None;
        }
        let [first, second] = orientation.axes?;
        self.ledger.translated("ORIENTATION", orientation.line, "`direction` of the springs");
        Some([first, second, cross(first, second)])
    }

    fn spring_node(&mut self, number: u64, section: &SpringSection) -> Option<u32> {
        let node = self.bodies.position(number);
        if node.is_none() {
            let why = format!("there is no node {number}");
            self.ledger.wrong(section.keyword, [section.line; 2], why, "name nodes of the deck in the spring elements");
        }
        node
    }

    /// Springs to the ground; a node that has several appears as often.
    fn grounded(
        &mut self,
        mut nodes: Vec<u32>,
        direction: Option<[f64; 3]>,
        section: &SpringSection,
        motions: &BTreeMap<OfNode, Track>,
        sprung: &mut Vec<Sprung>,
    ) {
        nodes.sort_unstable();
        while !nodes.is_empty() {
            let (mut once, mut rest): (Vec<u32>, Vec<u32>) = (Vec::new(), Vec::new());
            nodes.iter().for_each(|&node| if once.last() == Some(&node) { rest.push(node) } else { once.push(node) });
            let (on_bodies, others): (Vec<u32>, Vec<u32>) =
                once.into_iter().partition(|&node| self.bodies.of(node).is_some());
            let mut ends: Vec<End> =
                others.into_iter().filter_map(|node| self.end(node, direction, motions, section)).collect();
            // a spring from a node that is held
            ends.retain(|end| !matches!(end, End::Held(_)));
            if !on_bodies.is_empty() {
                let (set, bodies) = self.set_of(&on_bodies, &[], "sprung");
                ends.push(End::Nodes(set, bodies));
            }
            let of = |end| Sprung { end, to: None, direction, stiffness: section.stiffness, line: section.line };
            sprung.extend(ends.into_iter().map(of));
            nodes = rest;
        }
    }

    /// A spring between two nodes; an end that is held is the second one.
    fn joined(
        &mut self,
        nodes: [u32; 2],
        direction: Option<[f64; 3]>,
        section: &SpringSection,
        motions: &BTreeMap<OfNode, Track>,
    ) -> Option<Sprung> {
        let [first, second] = nodes.map(|node| self.end(node, direction, motions, section));
        let (end, to) = match (first?, second?) {
            (End::Held(_), End::Held(_)) => return None,
            (held @ End::Held(_), end) => (end, held),
            (end, to) => (end, to),
        };
        Some(Sprung { end, to: Some(to), direction, stiffness: section.stiffness, line: section.line })
    }

    /// What a spring at a node is attached to, if this can be translated.
    fn end(
        &mut self,
        node: u32,
        direction: Option<[f64; 3]>,
        motions: &BTreeMap<OfNode, Track>,
        section: &SpringSection,
    ) -> Option<End> {
        if let Some((body, 0)) = self.reference(node) {
            return Some(End::Body(body));
        }
        if self.bodies.of(node).is_some() {
            let (set, bodies) = self.set_of(&[node], &[], "sprung");
            return Some(End::Nodes(set, bodies));
        }
        if let Some((name, _)) = self.point(node) {
            return Some(End::Nodes(name.to_owned(), vec![POINT]));
        }
        let held = |component: u8| {
            let track = motions.get(&(node, component));
            track.is_some_and(|track| track.curve.iter().all(|point| point[1] == 0.0))
        };
        // only components along which the spring acts count
        if (0..3).all(|c| direction.is_some_and(|axis| axis[usize::from(c)] == 0.0) || held(c)) {
            return Some(End::Held(node));
        }
        let why = "an end is a node of no body, which is not held";
        self.ledger.refuse(
            section.keyword,
            section.line,
            why,
            "attach springs to bodies, and to nodes that *BOUNDARY holds",
        );
        None
    }
}

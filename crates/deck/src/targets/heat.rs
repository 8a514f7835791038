//! Changes of temperature.

use std::collections::{BTreeMap, BTreeSet};

use super::centres::between;
use super::{Bits, Finder, bits};
use crate::history::{Curve, Timeline, Track, Tracks};

/// A change of the temperature.
#[derive(Debug)]
pub struct Heated {
    /// The nodes of the set of the file; `None`: whole bodies.
    pub set: Option<String>,
    pub bodies: Vec<usize>,
    pub curve: Curve,
    pub line: usize,
}

impl Finder<'_> {
    /// Changes of the temperature over the steps, of whole bodies or of sets of nodes.
    pub(super) fn heated(&mut self, timeline: &Timeline) -> Vec<Heated> {
        let deck = self.deck;
        let given: Vec<usize> = deck.steps.iter().flat_map(|step| &step.temperatures).map(|of| of.lines[0]).collect();
        if given.is_empty() {
            return Vec::new();
        }
        if deck.materials.values().all(|material| material.expansion.is_none()) {
            given.iter().for_each(|&line| self.ledger.ignored("TEMPERATURE", line, "no material expands"));
            return Vec::new();
        }
        let mut initial: BTreeMap<u32, f64> = BTreeMap::new();
        for condition in &deck.initial_temperatures {
            let nodes = self.nodes(&condition.target, "INITIAL CONDITIONS", condition.lines);
            initial.extend(nodes.into_iter().map(|node| (node, condition.value)));
        }
        let mut tracks = Tracks::new(timeline, deck, false);
        for (k, step) in deck.steps.iter().enumerate() {
            for condition in &step.temperatures {
                let amplitude = self.amplitude(deck, &condition.amplitude, "TEMPERATURE", condition.lines);
                for node in self.own_nodes(&condition.target, "TEMPERATURE", condition.lines) {
                    let start = initial.get(&node).copied().unwrap_or(0.0);
                    if amplitude.is_some() && start != 0.0 {
                        let why = "an amplitude of temperatures that do not start from 0 is not supported";
                        let cure = "write a step for each part of the course";
                        self.ledger.refuse_at("TEMPERATURE", condition.lines, why, cure);
                    }
                    tracks.say(node, condition.value - start, amplitude, condition.lines[0], None);
                }
            }
            tracks.step(k, false);
        }
        let mut tracks = tracks.tracks;
        for centre in self.centres {
            // linear in between, as there
            let share = 1.0 / centre.corners.len() as f64;
            let corners: Option<Vec<(&Track, f64)>> =
                centre.corners.iter().map(|node| Some((tracks.get(node)?, share))).collect();
            if let Some(track) = corners.map(|corners| between(&corners)) {
                tracks.insert(centre.node, track);
            }
        }
        self.grouped(tracks)
    }

    /// Nodes that are heated alike: all nodes of some bodies, and others.
    fn grouped(&mut self, tracks: BTreeMap<u32, Track>) -> Vec<Heated> {
        let mut groups: BTreeMap<Bits, (Vec<u32>, Curve, usize)> = BTreeMap::new();
        for (node, track) in tracks {
            let curve = track.simple();
            if curve.iter().all(|point| point[1] == 0.0) || self.bodies.of(node).is_none() {
                continue;
            }
            let group = groups.entry(bits(&curve)).or_insert_with(|| (Vec::new(), curve, track.line));
            group.0.push(node);
        }
        let mut sizes = vec![0; self.bodies.list.len()];
        (0..self.mesh.points.len() as u32).filter_map(|node| self.bodies.of(node)).for_each(|body| sizes[body] += 1);
        let mut found = Vec::new();
        for (nodes, curve, line) in groups.into_values() {
            let mut counts = vec![0; sizes.len()];
            nodes.iter().filter_map(|&node| self.bodies.of(node)).for_each(|body| counts[body] += 1);
            let whole: BTreeSet<usize> = (0..sizes.len()).filter(|&body| counts[body] == sizes[body]).collect();
            let rest: Vec<u32> = nodes
                .into_iter()
                .filter(|&node| self.bodies.of(node).is_none_or(|body| !whole.contains(&body)))
                .collect();
            if !whole.is_empty() {
                found.push(Heated { set: None, bodies: whole.into_iter().collect(), curve: curve.clone(), line });
            }
            if !rest.is_empty() {
                let (set, bodies) = self.set_of(&rest, &[], "heated");
                found.push(Heated { set: Some(set), bodies, curve, line });
            }
        }
        found.sort_by_key(|heated| (heated.line, heated.set.is_some(), heated.bodies.clone()));
        found
    }
}

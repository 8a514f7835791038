//! Loads on the mass of bodies.

use std::collections::{BTreeMap, BTreeSet};

use super::{Bits, Finder, bits};
use crate::history::{Curve, Timeline, Tracks};
use crate::read::{Field, On, Target};

/// Gravity or rotation on the mass of a body.
#[derive(Debug)]
pub struct MassLoad {
    pub field: Field,
    /// Whole bodies.
    pub bodies: Vec<usize>,
    pub curve: Curve,
    pub line: usize,
}

/// A load that can be compared.
type FieldBits = (bool, [u64; 6]);

fn field_bits(field: Field) -> FieldBits {
    let (rotates, [a, b, c], [d, e, f]) = match field {
        Field::Gravity(direction) => (false, direction, [0.0; 3]),
        Field::Centrifugal(point, direction) => (true, point, direction),
    };
    (rotates, [a, b, c, d, e, f].map(|x: f64| (x + 0.0).to_bits()))
}

fn field_of((rotates, bits): FieldBits) -> Field {
    let [a, b, c, d, e, f] = bits.map(f64::from_bits);
    if rotates { Field::Centrifugal([a, b, c], [d, e, f]) } else { Field::Gravity([a, b, c]) }
}

impl Finder<'_> {
    /// Loads on mass over the steps, each with the bodies on which it acts alike.
    pub(super) fn masses(&mut self, timeline: &Timeline) -> Vec<MassLoad> {
        let deck = self.deck;
        let mut tracks = Tracks::new(timeline, deck, true);
        for (k, step) in deck.steps.iter().enumerate() {
            for load in &step.loads {
                let On::Mass(target, field) = &load.on else { continue };
                let amplitude = self.amplitude(deck, &load.amplitude, load.keyword, load.lines);
                // Abaqus: no name, the whole model
                let cells = match target {
                    Target::Set(name) if name.is_empty() => self.mesh.solid_cells(None),
                    _ => self.cells(target, load.keyword, load.lines),
                };
                for body in self.whole_bodies(&cells, load.keyword, load.lines) {
                    tracks.say((field_bits(*field), body), load.value, amplitude, load.lines[0], None);
                }
            }
            tracks.step(k, step.replaces("DLOAD"));
        }
        let mut groups: BTreeMap<(FieldBits, Bits), MassLoad> = BTreeMap::new();
        for ((field, body), track) in tracks.tracks {
            let curve = track.simple();
            if curve.iter().all(|point| point[1] == 0.0) {
                continue;
            }
            let new = || MassLoad { field: field_of(field), bodies: vec![], curve: curve.clone(), line: track.line };
            groups.entry((field, bits(&curve))).or_insert_with(new).bodies.push(body);
        }
        let mut loads: Vec<MassLoad> = groups.into_values().collect();
        loads.sort_by_key(|load| load.line);
        if let Some(load) = loads.first().filter(|_| deck.materials.values().all(|of| of.density.is_none())) {
            self.ledger.wrong("DLOAD", [load.line; 2], "no material has a density", "add *DENSITY to the *MATERIAL");
        }
        loads
    }

    /// The bodies whose elements are these.
    fn whole_bodies(&mut self, cells: &[u32], keyword: &str, lines: [usize; 2]) -> Vec<usize> {
        let body_of = |cell: u32| self.bodies.of(self.mesh.cells.nodes(cell as usize)[0]);
        let solid: BTreeSet<u32> = self.mesh.solid_cells(None).into_iter().collect();
        let inside: BTreeSet<u32> = cells.iter().copied().filter(|cell| solid.contains(cell)).collect();
        let bodies: BTreeSet<usize> = inside.iter().filter_map(|&cell| body_of(cell)).collect();
        let missing = solid.difference(&inside).any(|&cell| body_of(cell).is_some_and(|body| bodies.contains(&body)));
        if missing {
            let why = "a load on the mass of a part of a body is not supported";
            self.ledger.refuse_at(keyword, lines, why, "name all elements of the body");
        }
        bodies.into_iter().collect()
    }
}

//! Pressures and tractions on surfaces.

use std::collections::BTreeMap;

use slipstick_meshio::{CellKind, ElementFace};

use super::{Bits, Finder, bits};
use crate::bodies::find;
use crate::history::{Curve, Timeline, Track, Tracks};
use crate::read::{NORMAL, On};

/// A pressure or a traction on a surface of the file.
#[derive(Debug)]
pub struct Pressure {
    pub surface: String,
    pub bodies: Vec<usize>,
    /// Of a traction, of length 1; [`NORMAL`] for a pressure.
    pub direction: [f64; 3],
    pub curve: Curve,
    pub line: usize,
}

impl Finder<'_> {
    /// Pressures over the steps, on surfaces and on faces of elements.
    pub(super) fn pressures(&mut self, timeline: &Timeline) -> Vec<Pressure> {
        let deck = self.deck;
        let mut surfaces = Tracks::new(timeline, deck, true);
        let mut faces = Tracks::new(timeline, deck, true);
        for (k, step) in deck.steps.iter().enumerate() {
            for load in &step.loads.items {
                let amplitude = self.amplitude(deck, &load.amplitude, load.keyword, load.lines);
                match &load.on {
                    On::Nodes(..) | On::Mass(..) => {}
                    On::Surface(name, direction) => match self.surface(name) {
                        Some(surface) => surfaces.say(
                            (surface, direction.map(f64::to_bits)),
                            load.value,
                            amplitude,
                            load.lines[0],
                            None,
                        ),
                        None => {
                            let why = format!("there is no surface `{name}`");
                            self.ledger.wrong(load.keyword, load.lines, why, "define it with *SURFACE");
                        }
                    },
                    On::Face(target, side) => {
                        for cell in self.cells(target, load.keyword, load.lines) {
                            let sides = match self.mesh.cells.kind(cell as usize).first_order() {
                                CellKind::Tet4 => 4,
                                CellKind::Wedge6 => 5,
                                CellKind::Hex8 => 6,
                                _ => 0,
                            };
                            if *side >= sides {
                                let why = format!(
                                    "element {} has no face {}",
                                    self.mesh.cells.number(cell as usize),
                                    side + 1
                                );
                                self.ledger.wrong(load.keyword, load.lines, why, "name a face of a solid element");
                                break;
                            }
                            faces.say((cell, *side), load.value, amplitude, load.lines[0], None);
                        }
                    }
                }
            }
            surfaces.step(k, step.loads.replaces);
            faces.step(k, step.loads.replaces);
        }
        let mut found: Vec<((String, [u64; 3]), Track)> = surfaces.tracks.into_iter().collect();
        let mut groups: BTreeMap<Bits, (Vec<ElementFace>, Track)> = BTreeMap::new();
        for ((cell, side), track) in faces.tracks {
            let group = groups.entry(bits(&track.simple())).or_insert_with(|| (Vec::new(), track));
            group.0.push(ElementFace { cell, side });
        }
        for (faces, track) in groups.into_values() {
            let fresh = |name: &String| {
                find(&self.mesh.face_sets, name).is_none() && find(&self.mesh.node_sets, name).is_none()
            };
            let name = (1..).map(|k| format!("pressed_{k}")).find(fresh).unwrap_or_default();
            self.mesh.face_sets.insert(name.clone(), faces);
            found.push(((name, NORMAL.map(f64::to_bits)), track));
        }
        let pressure = |((surface, direction), track): ((String, [u64; 3]), Track)| {
            let (bodies, curve) = (self.bodies.under(self.mesh, &surface), track.simple());
            Pressure { surface, bodies, direction: direction.map(f64::from_bits), curve, line: track.line }
        };
        let mut pressures: Vec<Pressure> = found.into_iter().map(pressure).collect();
        pressures.retain(|pressure| pressure.curve.iter().any(|point| point[1] != 0.0));
        pressures.sort_by_key(|pressure| pressure.line);
        pressures
    }
}

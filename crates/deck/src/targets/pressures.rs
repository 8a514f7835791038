//! Pressures and tractions on surfaces.

use std::collections::BTreeMap;

use slipstick_meshio::{CellKind, ElementFace};

use super::{Bits, Finder, bits};
use crate::bodies::find;
use crate::history::{Curve, Timeline, Track, Tracks};
use crate::read::{NORMAL, On};
use crate::vector::{cross, dot};

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

/// Sine of the angle up to which directions are the same: of (1, 1, −1) and (3, 3, −3), or of rounded components.
const SAME: f64 = 1e-5;

/// A direction of tractions on a surface.
#[derive(Debug)]
struct Traction {
    surface: String,
    direction: [f64; 3],
    /// The first step in which it acts, without interruption.
    first: usize,
    /// Whether `OP=NEW` ended it, and no later load names it.
    ended: bool,
}

/// The directions of tractions up to a step.
#[derive(Debug, Default)]
struct Tractions {
    acting: Vec<Traction>,
}

impl Tractions {
    /// The direction of a load in step `k`, that of an earlier one if it is the same; `None` if it differs from those
    /// of tractions that act since earlier steps, which it could add to or replace.
    fn direction(&mut self, surface: &str, direction: [f64; 3], k: usize) -> Option<[f64; 3]> {
        if direction == NORMAL {
            return Some(direction);
        }
        let on = |known: &&mut Traction| known.surface == surface;
        let same = |known: &&mut Traction| {
            let across = cross(known.direction, direction);
            dot(across, across).sqrt() < SAME && dot(known.direction, direction) > 0.0
        };
        if let Some(known) = self.acting.iter_mut().filter(on).find(same) {
            if std::mem::take(&mut known.ended) {
                known.first = k;
            }
            return Some(known.direction);
        }
        if self.acting.iter_mut().filter(on).any(|known| !known.ended && known.first < k) {
            return None;
        }
        self.acting.push(Traction { surface: surface.to_owned(), direction, first: k, ended: false });
        Some(direction)
    }
}

impl Finder<'_> {
    /// Pressures over the steps, on surfaces and on faces of elements.
    pub(super) fn pressures(&mut self, timeline: &Timeline) -> Vec<Pressure> {
        let deck = self.deck;
        let mut surfaces = Tracks::new(timeline, deck, true);
        let mut faces = Tracks::new(timeline, deck, true);
        let mut tractions = Tractions::default();
        for (k, step) in deck.steps.iter().enumerate() {
            if step.replaces("DSLOAD") {
                tractions.acting.iter_mut().for_each(|known| known.ended = true);
            }
            for load in &step.loads {
                let amplitude = self.amplitude(deck, &load.amplitude, load.keyword, load.lines);
                match &load.on {
                    On::Nodes(..) | On::Mass(..) => {}
                    On::Surface(name, direction) => match self.surface(name) {
                        Some(surface) => {
                            let direction = tractions.direction(&surface, *direction, k).unwrap_or_else(|| {
                                let why = "the direction of the traction on this surface changes";
                                let cure = "write OP=NEW in this step, with all loads that act in it";
                                self.ledger.refuse_at(load.keyword, load.lines, why, cure);
                                *direction
                            });
                            let key = (surface, direction.map(f64::to_bits));
                            surfaces.say(key, load.value, amplitude, load.lines[0], None);
                        }
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
            surfaces.step(k, step.replaces("DSLOAD"));
            faces.step(k, step.replaces("DLOAD"));
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

//! Supports that begin after the first step, or that a later step removes.

use std::collections::{BTreeMap, HashSet};

use super::{Finder, Held, OfNode};
use crate::bodies::find;
use crate::history::{Timeline, Track};

impl Finder<'_> {
    /// Refuses supports that begin or end where the case has no equivalent.
    pub(super) fn check_temporary(&mut self, tracks: &BTreeMap<OfNode, Track>) {
        let sets = self.deck.transforms.iter().filter_map(|of| find(&self.mesh.node_sets, &of.set));
        let turned: HashSet<u32> = sets.flat_map(|set| &self.mesh.node_sets[set]).copied().collect();
        for ((node, _), track) in tracks.iter().filter(|(_, track)| track.is_temporary()) {
            let cure = "prescribe the same components in all steps";
            if track.returns {
                let why = "a condition that a step removes and a later one prescribes again is not supported";
                self.ledger.wrong("BOUNDARY", [track.line, track.line], why, cure);
            }
            if track.moves_on {
                let why = "a condition that FIXED begins and a later step moves is not supported";
                self.ledger.wrong("BOUNDARY", [track.line, track.line], why, "let the motion begin in the later step");
            }
            let rigid = |body: usize| self.bodies.list[body].rigid.is_some();
            let solid = self.bodies.of(*node).is_some_and(|body| !rigid(body)) && !turned.contains(node);
            if solid {
                continue;
            }
            let why = match track.first {
                0 => {
                    "a condition that a later step removes is supported at nodes of deformable bodies only, along x, y and z"
                }
                _ => {
                    "a motion that begins after the first step is supported at nodes of deformable bodies only, along x, \
                     y and z"
                }
            };
            self.ledger.refuse("BOUNDARY", track.line, why, cure);
        }
    }

    /// Groups nodes with the same motion, which begins and ends with the same steps.
    pub(super) fn held_in_their_steps(&mut self, timeline: &Timeline, tracks: BTreeMap<OfNode, Track>) -> Vec<Held> {
        let mut classes: BTreeMap<(usize, Option<usize>, bool), BTreeMap<OfNode, Track>> = BTreeMap::new();
        for (key, track) in tracks {
            classes.entry((track.first, track.ended, track.stays)).or_default().insert(key, track);
        }
        let mut all = Vec::new();
        for ((first, ended, _), class) in classes {
            let from = timeline.at(first, 0);
            let until = ended.map(|step| timeline.at(step, 0));
            all.extend(self.held(class).into_iter().map(|held| Held { from, until, ..held }));
        }
        all.sort_by_key(|held| held.line);
        all
    }
}

//! Nodes that hexahedra of 20 nodes and wedges of 15 lack.

use std::collections::{BTreeMap, HashSet};

use super::{Finder, OfNode};
use slipstick_meshio::Centre;

use crate::bodies::find;
use crate::history::{Track, value_at};

impl Finder<'_> {
    /// Prescribes the motions of centres of which all other nodes of the face or hexahedron are prescribed: those of
    /// the serendipity shape. The others are not prescribed: the deck says nothing about them.
    pub(super) fn prescribe_centres(&self, tracks: &mut BTreeMap<OfNode, Track>) {
        let sets = self.deck.transforms.iter().filter_map(|of| find(&self.mesh.node_sets, &of.set));
        let turned: HashSet<u32> = sets.flat_map(|set| &self.mesh.node_sets[set]).copied().collect();
        for centre in self.centres {
            let nodes = || centre.corners.iter().chain(&centre.middles);
            let turns = nodes().chain([&centre.node]).any(|node| turned.contains(node));
            for component in 0..3 {
                tracks.remove(&(centre.node, component));
                let all: Option<Vec<(&Track, f64)>> =
                    weights(centre).map(|(node, weight)| Some((tracks.get(&(node, component))?, weight))).collect();
                // a support that begins or ends holds the others, which the centre follows
                let always = |all: &Vec<(&Track, f64)>| all.iter().all(|(track, _)| !track.is_temporary());
                if let Some(track) = all.filter(|all| !turns && always(all)).map(|all| between(&all)) {
                    tracks.insert((centre.node, component), track);
                }
            }
        }
    }
}

/// The values of the serendipity shape at a centre: −1/4 for corners, and what is missing to 1 for the nodes between
/// them.
fn weights(centre: &Centre) -> impl Iterator<Item = (u32, f64)> + '_ {
    let middle = (1.0 + 0.25 * centre.corners.len() as f64) / centre.middles.len() as f64;
    let corners = centre.corners.iter().map(|&node| (node, -0.25));
    corners.chain(centre.middles.iter().map(move |&node| (node, middle)))
}

/// The weighted mean of some tracks; the weights add up to 1.
pub fn between(tracks: &[(&Track, f64)]) -> Track {
    let (first, _) = tracks[0];
    let mut times: Vec<f64> = tracks.iter().flat_map(|(track, _)| track.curve.iter().map(|point| point[0])).collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    // of equal values exactly this value, so that nodes that move alike stay together
    let value = |t: f64| {
        let of_first = value_at(&first.curve, t);
        of_first + tracks.iter().map(|(track, weight)| weight * (value_at(&track.curve, t) - of_first)).sum::<f64>()
    };
    let curve: Vec<[f64; 2]> = times.into_iter().map(|t| [t, value(t)]).collect();
    let current = curve.last().map_or(0.0, |point| point[1]);
    Track { curve, current, ..first.clone() }
}

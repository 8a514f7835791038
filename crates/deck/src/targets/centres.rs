//! Nodes that hexahedra of 20 nodes lack.

use std::collections::{BTreeMap, HashSet};

use super::{EquationOfSets, Finder, Joined, OfNode};
use slipstick_meshio::Centre;

use crate::bodies::find;
use crate::history::{Track, value_at};

impl Finder<'_> {
    /// Prescribes the motions of centres of which all other nodes of the face or hexahedron are prescribed: those of
    /// the shape with 20 nodes.
    pub(super) fn prescribe_centres(&self, tracks: &mut BTreeMap<OfNode, Track>) {
        let sets = self.deck.transforms.iter().filter_map(|of| find(&self.mesh.node_sets, &of.set));
        let turned: HashSet<u32> = sets.flat_map(|set| &self.mesh.node_sets[set]).copied().collect();
        for centre in self.centres {
            let nodes = || centre.corners.iter().chain(&centre.middles);
            if nodes().any(|node| turned.contains(node) != turned.contains(&centre.node)) {
                continue;
            }
            for component in 0..3 {
                let all: Option<Vec<(&Track, f64)>> =
                    weights(centre).map(|(node, weight)| Some((tracks.get(&(node, component))?, weight))).collect();
                let together = |all: &Vec<(&Track, f64)>| {
                    all.iter().all(|(of, _)| (of.first, of.ended) == (all[0].0.first, all[0].0.ended))
                };
                if let Some(track) = all.filter(together).map(|all| between(&all)) {
                    tracks.insert((centre.node, component), track);
                }
            }
        }
    }

    /// Where equations or forces of the deck name all other nodes of a face, its centre moves as on the shape with 20
    /// nodes: as the deck says, neither the equations nor the forces have it. Faces in contact keep a free centre.
    pub(super) fn keep_shape(&mut self, equations: &mut Vec<EquationOfSets>, forces: &BTreeMap<OfNode, Track>) {
        let deck = self.deck;
        let mut named: BTreeMap<u32, usize> = forces.iter().map(|((node, _), track)| (*node, track.line)).collect();
        for equation in &deck.equations {
            for term in &equation.terms {
                let nodes = self.own_nodes(&term.target, "EQUATION", equation.lines);
                named.extend(nodes.into_iter().map(|node| (node, equation.lines[0])));
            }
        }
        let touching = self.contact_nodes();
        for centre in self.centres.iter().filter(|centre| centre.corners.len() == 4) {
            let lines: Option<Vec<usize>> = weights(centre).map(|(node, _)| named.get(&node).copied()).collect();
            let Some(&line) = lines.as_ref().and_then(|lines| lines.iter().max()) else { continue };
            if touching.contains(&centre.node) {
                continue;
            }
            for component in 0..3 {
                let nodes = weights(centre).chain([(centre.node, -1.0)]);
                let term = |(node, factor): (u32, f64)| {
                    let (set, body) = self.joined_node(node);
                    Joined { set, body, component, factor }
                };
                let terms = nodes.map(term).collect();
                equations.push((terms, line));
            }
        }
    }

    /// The nodes of the elements at surfaces in contact, as far as they lie on these.
    fn contact_nodes(&self) -> HashSet<u32> {
        let pairs = self.deck.pairs.iter().flat_map(|pair| [&pair.slave, &pair.master]);
        let names = pairs.chain(self.deck.ties.iter().flat_map(|tie| [&tie.slave, &tie.master]));
        let sets = names.filter_map(|name| find(&self.mesh.face_sets, name));
        let faces: HashSet<(u32, u8)> =
            sets.flat_map(|set| &self.mesh.face_sets[set]).map(|face| (face.cell, face.side)).collect();
        let nodes = |(cell, side): (u32, u8)| {
            // the centres of faces come first among the last seven nodes, in the order of the faces
            self.mesh.cells.nodes(cell as usize).get(20 + usize::from(side)).copied()
        };
        faces.into_iter().filter_map(nodes).collect()
    }
}

/// The values of the shape with 20 nodes at a centre: −1/4 for corners, and what is missing to 1 for the nodes between
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

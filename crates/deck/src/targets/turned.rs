//! Motions and forces along local axes of nodes.

use std::collections::BTreeMap;

use super::{EquationOfSets, Finder, Held, Joined, OfNode, POINT};
use crate::bodies::find;
use crate::history::{Curve, Track, value_at};

/// Directions of unit length.
pub type Axes = [[f64; 3]; 3];

/// What local axes need besides motions and forces along the global ones.
#[derive(Debug, Default)]
pub struct Turned {
    /// Prescribed local components of nodes of which others are free.
    pub equations: Vec<EquationOfSets>,
    /// Points with these motions, at the places of these nodes.
    pub points: Vec<(u32, String)>,
    pub held: Vec<Held>,
}

/// Components of directions below this are round-off.
pub const ALONG: f64 = 1e-9;

const ROTATED: &str = "local axes at the reference node of a rigid body, a coupling or a section are not supported";

impl Finder<'_> {
    /// Replaces motions and forces along local axes by those along the global ones where this is possible.
    pub(super) fn turned(
        &mut self,
        motions: &mut BTreeMap<OfNode, Track>,
        forces: &mut BTreeMap<OfNode, Track>,
    ) -> Turned {
        let mut turned = Turned::default();
        let says = |of: &BTreeMap<OfNode, Track>, node: u32| (0..6).any(|c| of.contains_key(&(node, c)));
        let all = self.local_axes(|node| says(motions, node) || says(forces, node));
        for (node, (axes, on_axis, line)) in all {
            if on_axis && !self.on_axis(node, line, motions, forces) {
                continue;
            }
            let tracks = [0, 1, 2].map(|k| forces.remove(&(node, k)));
            for (c, track) in (0..3).zip(sums(&tracks, &axes)) {
                track.into_iter().for_each(|track| _ = forces.insert((node, c), track));
            }
            let tracks = [0, 1, 2].map(|k| motions.remove(&(node, k)));
            if tracks.iter().all(Option::is_some) {
                for (c, track) in (0..3).zip(sums(&tracks, &axes)) {
                    let held = tracks[0].clone().map(|of| Track { curve: vec![], current: 0.0, set: None, ..of });
                    track.or(held).into_iter().for_each(|track| _ = motions.insert((node, c), track));
                }
                continue;
            }
            for (track, axis) in tracks.into_iter().zip(axes) {
                let Some(track) = track else { continue };
                match (0..3).find(|&c| (0..3).all(|other| other == c || axis[other].abs() <= ALONG)) {
                    Some(c) => {
                        let curve = track.curve.iter().map(|&[t, value]| [t, value * axis[c]]).collect();
                        motions.insert((node, c as u8), Track { curve, ..track });
                    }
                    None => self.slides(node, &track, axis, &mut turned),
                }
            }
        }
        turned
    }

    /// A node on the axis of cylindrical axes: what holds its radial or tangential component holds both. Returns
    /// whether anything else is left to do.
    fn on_axis(
        &mut self,
        node: u32,
        line: usize,
        motions: &mut BTreeMap<OfNode, Track>,
        forces: &BTreeMap<OfNode, Track>,
    ) -> bool {
        let held = [0, 1].map(|k| motions.get(&(node, k)).cloned());
        let moves = held.iter().flatten().any(|track| track.curve.iter().any(|point| point[1] != 0.0));
        if moves || [0, 1].iter().any(|k| forces.contains_key(&(node, *k))) {
            let number = self.mesh.point_numbers[node as usize];
            let why = format!("node {number} lies on the axis, where no direction is radial or tangential");
            self.ledger.refuse("TRANSFORM", line, why, "leave the node out of the set");
            return false;
        }
        if let Some(track) = held.into_iter().flatten().next() {
            (0..2).for_each(|k| _ = motions.insert((node, k), track.clone()));
        }
        true
    }

    /// An equation for the displacement of a node along an axis.
    fn slides(&mut self, node: u32, track: &Track, axis: [f64; 3], turned: &mut Turned) {
        let name = format!("node_{}", self.mesh.point_numbers[node as usize]);
        self.mesh.node_sets.entry(name.clone()).or_insert_with(|| vec![node]);
        let body = self.bodies.of(node).unwrap_or(0);
        let term = |c: u8| Joined { set: Some(name.clone()), body, component: c, factor: axis[usize::from(c)] };
        let mut terms: Vec<Joined> = (0..3).filter(|&c| axis[usize::from(c)].abs() > ALONG).map(term).collect();
        let curve = track.simple();
        if curve.iter().any(|point| point[1] != 0.0) {
            let point = format!("{name}_motion_{}", turned.points.len() + 1);
            terms.push(Joined { set: Some(point.clone()), body: POINT, component: 0, factor: -1.0 });
            turned.points.push((node, point.clone()));
            let (set, components) = (Some(point), vec![(0, curve)]);
            turned.held.push(Held { set, bodies: vec![POINT], components, line: track.line, from: 0.0, until: None });
        }
        turned.equations.push((terms, track.line));
    }

    /// The local axes of nodes that are `used`, whether they lie on the axis of cylindrical ones, and the line of the
    /// keyword.
    pub(super) fn local_axes(&mut self, used: impl Fn(u32) -> bool) -> BTreeMap<u32, (Axes, bool, usize)> {
        let mut all = BTreeMap::new();
        for transform in &self.deck.transforms {
            let line = transform.line;
            let Some(set) = find(&self.mesh.node_sets, &transform.set) else {
                let why = format!("there is no set of nodes `{}`", transform.set);
                self.ledger.wrong("TRANSFORM", [line; 2], why, "define it with *NSET");
                continue;
            };
            for &node in self.mesh.node_sets[set].iter().filter(|node| used(**node)) {
                if self.bodies.of(node).is_none() {
                    self.ledger.refuse("TRANSFORM", line, ROTATED, "leave the node out of the set");
                    break;
                }
                match transform.axes(self.mesh.points[node as usize]) {
                    Some((axes, on_axis)) => _ = all.insert(node, (axes, on_axis, line)),
                    None => {
                        let why = "the points do not determine the axes";
                        self.ledger.wrong("TRANSFORM", [line; 2], why, "rectangular axes need two points that do not lie on a line through the origin, cylindrical ones two \
                                    points of the axis");
                        break;
                    }
                }
            }
        }
        all
    }
}

/// Values along the global axes: Σ_k v_k e_k, `None` where they vanish.
fn sums(tracks: &[Option<Track>; 3], axes: &[[f64; 3]; 3]) -> [Option<Track>; 3] {
    [0, 1, 2].map(|c| {
        let parts: Vec<(&Track, f64)> =
            tracks.iter().zip(axes).filter_map(|(track, axis)| Some((track.as_ref()?, axis[c]))).collect();
        let parts: Vec<(&Track, f64)> = parts.into_iter().filter(|(_, factor)| factor.abs() > ALONG).collect();
        let mut times: Vec<f64> =
            parts.iter().flat_map(|(track, _)| track.curve.iter().map(|point| point[0])).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        let value = |t: f64| parts.iter().map(|(track, factor)| factor * value_at(&track.curve, t)).sum::<f64>();
        let curve: Curve = times.into_iter().map(|t| [t, value(t)]).collect();
        let (first, _) = parts.first()?;
        let current = curve.last().map_or(0.0, |point| point[1]);
        Some(Track { curve, current, set: None, ..(*first).clone() })
    })
}

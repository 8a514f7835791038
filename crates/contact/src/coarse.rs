//! Surfaces at the start of the path: curved ones of few facets, those that end at an edge on an inclined surface, and
//! those that lie on each other.

use crate::ContactInterface;
use crate::cones::{KINK, SHARP_KINK};
use crate::kinematics::frame::RingCorner;
use crate::kinematics::height::FacetHeight;
use crate::slave_node::{SAME_COSINE, SlaveNode, normal};
use nalgebra::Vector3;
use slipstick_mesh::FacetNodes;
use std::collections::{HashMap, HashSet};

impl ContactInterface {
    /// Whether the slave is a curved surface of few facets, and no facet of the master stands for a
    /// curved surface: two facets of the slave that share an edge meet at 15° or more, but not at a
    /// sharp edge, and both stand for a curved surface ([`Self::with_heights`]). An edge is sharp if
    /// its facets belong to different entries of [`Self::slave_nodes`] at both of its ends.
    /// Where the master is curved too, as a hub around a shaft, its facets would determine the
    /// normals no better than those of the slave. `coordinates` as in [`Self::new`].
    ///
    /// Tests: `facets_of_fifteen_degrees_are_coarse`, `a_torus_of_eight_facets_around_its_tube_is_coarse`.
    pub fn is_coarse(&self, coordinates: &[f64]) -> bool {
        self.turns(COARSE, coordinates)
    }

    /// As [`Self::is_coarse`], for facets that meet at 10° or more. Where the master's facets are larger than such
    /// facets, the master cannot follow their shape, and averaged normals are off by up to half of that angle.
    ///
    /// Test: `facets_of_fifteen_degrees_are_coarse`.
    pub fn has_kinks(&self, coordinates: &[f64]) -> bool {
        self.turns(KINK, coordinates)
    }

    /// Whether curved facets of the slave turn by at least an angle at a common edge that is not sharp, and the master
    /// has no curved facets.
    fn turns(&self, angle: f64, x: &[f64]) -> bool {
        let [heights, master] = self.heights();
        if master.iter().any(Option::is_some) {
            return false;
        }
        let smooth: HashSet<[u32; 3]> = self.slave_nodes().iter().flat_map(pairs_around).collect();
        let mut known: HashMap<[u32; 2], (u32, Vector3<f64>)> = HashMap::new();
        for ((f, facet), _) in (0_u32..).zip(self.slave_facets()).zip(heights).filter(|(_, height)| height.is_some()) {
            let own = normal(facet, x);
            for (i, &a) in facet.iter().enumerate() {
                let b = facet[(i + 1) % facet.len()];
                let Some((other, normal)) = known.insert([a.min(b), a.max(b)], (f, own)) else { continue };
                let is_smooth = [a, b].iter().any(|&node| smooth.contains(&[node, other, f]));
                if own.dot(&normal) <= angle.cos() + SAME_COSINE && is_smooth {
                    return true;
                }
            }
        }
        false
    }

    /// Whether both sides are curved ([`Self::with_heights`]) and meet at an edge of the slave's body at an
    /// angle, as a plug that tapers meets the rim of a bore: the normal of some slave node at an edge would turn
    /// by more than 2°, towards the face beyond the edge, if it followed the master. `touched` is this interface
    /// [with such normals](Self::with_touched_edges), and `coordinates` are those of the start, 3 per node.
    /// Surfaces that are parallel, as a shaft and a hub, are not inclined; nor are those out of reach.
    ///
    /// Test: `a_plug_that_tapers_is_inclined_to_the_rim_of_a_bore`.
    pub fn is_inclined(&self, touched: &Self, coordinates: &[f64]) -> bool {
        let curved = |side: &Vec<Option<FacetHeight>>| side.iter().any(Option::is_some);
        if !self.heights().iter().all(curved) {
            return false;
        }
        let normals = [self, touched].map(|interface| {
            let mut rows = Vec::new();
            let evaluated = interface.evaluate(coordinates, false, &mut interface.workspace(|_| true), &mut rows);
            evaluated.map(|()| rows.into_iter().map(|row| (row.area, row.frame.vector(0))).collect::<Vec<_>>())
        });
        let of_touched = touched.slave_nodes().iter();
        let [Ok(averaged), Ok(touched)] = normals else { return false };
        let at = |node: u32| Vector3::from_column_slice(&coordinates[3 * node as usize..][..3]);
        let beyond = |slave: &SlaveNode, turn: &Vector3<f64>| {
            let towards = |corner: &RingCorner| {
                let [own, next, previous] =
                    [corner.own, corner.next, corner.previous].map(|position| at(slave.ring[position]));
                (next - own).cross(&(previous - own)).dot(turn)
            };
            // the widening of the cone turns the other way
            slave.cone.iter().skip(1).any(|patch| patch.iter().map(towards).sum::<f64>() > 0.0)
        };
        of_touched.enumerate().any(|(k, slave)| {
            let ((area, own), (_, other)) = (&averaged[k], &touched[k]);
            *area > 0.0 && own.angle(other) > INCLINED && beyond(slave, &(other - own))
        })
    }
}

impl ContactInterface {
    /// Whether slave and master lie on each other at the start, as a block on a slab: of the area of some smooth part of
    /// the slave that faces the master, almost half or more belongs to slave nodes at a distance of less than a tenth of
    /// the square root of the area around them, or below the master, whose averaged normals are opposite to the master's
    /// within 5°. Smooth parts are bounded by kinks of 30°. `coordinates` are those of the start, 3 per node. Surfaces
    /// whose rows cannot be evaluated count as seated. A part with nodes that are `driven` along the normal of a facet, of
    /// length 1, does not count, since its edge may be driven into the master.
    ///
    /// Tests: `a_block_that_rests_on_a_slab_is_seated`, `a_bent_arm_whose_end_touches_is_not_seated`.
    pub fn is_seated(&self, coordinates: &[f64], driven: impl Fn(u32, &Vector3<f64>) -> bool) -> bool {
        let rows = |interface: &Self| {
            let mut rows = Vec::new();
            let evaluated = interface.evaluate(coordinates, false, &mut interface.workspace(|_| true), &mut rows);
            evaluated.map(|()| rows)
        };
        let [averaged, masters] = [false, true].map(|sharp| rows(&self.clone().with_frames(sharp)));
        let (Ok(averaged), Ok(masters)) = (averaged, masters) else { return true };
        let parts = smooth_parts(self.slave_facets(), coordinates);
        let (mut seated, mut facing) = (vec![0.0; parts.len()], vec![0.0; parts.len()]);
        for ((own, master), slave) in averaged.iter().zip(&masters).zip(self.slave_nodes()) {
            let parallel = own.frame.vector(0).angle(&master.frame.vector(0)) < PARALLEL;
            let close = own.gap() < SEATED * own.area.sqrt() * own.area;
            let share = own.area / slave.facets.len() as f64;
            for part in slave.facets.iter().map(|&(facet, _)| parts[facet as usize]).filter(|_| own.area > 0.0) {
                facing[part] += share;
                seated[part] += if parallel && close { share } else { 0.0 };
            }
        }
        for (facet, &part) in self.slave_facets().iter().zip(&parts) {
            let normal = normal(facet, coordinates);
            if facet.iter().any(|&node| driven(node, &normal)) {
                seated[part] = 0.0;
            }
        }
        seated.iter().zip(&facing).any(|(seated, facing)| *seated > 0.0 && *seated >= SEATED_SHARE * facing)
    }
}

/// The smooth part to which each facet belongs, by the number of one of its facets: facets that share an edge at which
/// they meet at less than [`SHARP_KINK`].
fn smooth_parts(facets: &[FacetNodes], x: &[f64]) -> Vec<usize> {
    let mut parent: Vec<usize> = (0..facets.len()).collect();
    let root = |parent: &[usize], mut of: usize| {
        while parent[of] != of {
            of = parent[of];
        }
        of
    };
    let normals: Vec<Vector3<f64>> = facets.iter().map(|facet| normal(facet, x)).collect();
    let mut known: HashMap<[u32; 2], usize> = HashMap::new();
    for (f, facet) in facets.iter().enumerate() {
        for (i, &a) in facet.iter().enumerate() {
            let b = facet[(i + 1) % facet.len()];
            let Some(other) = known.insert([a.min(b), a.max(b)], f) else { continue };
            if normals[f].dot(&normals[other]) > SHARP_KINK.cos() {
                let (one, two) = (root(&parent, f), root(&parent, other));
                parent[one.max(two)] = one.min(two);
            }
        }
    }
    (0..facets.len()).map(|f| root(&parent, f)).collect()
}

/// Share of the facing area that lies on the other surface if the surfaces lie on each other. Not a half, which
/// round-off would decide: half of a coarse ring of two rows of facets.
const SEATED_SHARE: f64 = 0.45;

/// Distance at which surfaces lie on each other, relative to the square root of the area around a node.
const SEATED: f64 = 0.1;

/// Angle within which they are parallel then. \[rad\]
const PARALLEL: f64 = std::f64::consts::PI / 36.0;

/// Angle between a slave surface at its edge and the master from which on they are inclined. \[rad\]
const INCLINED: f64 = std::f64::consts::PI / 90.0;

/// Angle between curved facets from which on they are coarse: that of 24 facets around a circle.
/// \[rad\]
const COARSE: f64 = std::f64::consts::PI / 12.0;

/// Node and numbers of all pairs of facets, ascending, that belong to the same smooth patch around a slave node.
fn pairs_around(slave: &SlaveNode) -> Vec<[u32; 3]> {
    let facets = || slave.facets.iter().map(|&(facet, _)| facet);
    facets().flat_map(|f| facets().filter(move |&g| g > f).map(move |g| [slave.node, f, g])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::InterfaceOptions;
    use crate::kinematics::{CellRule, MultiplierShape};

    /// Three facets of an arc, by the angle between them; as a master they do not count.
    #[test]
    fn facets_of_fifteen_degrees_are_coarse() {
        let is_coarse = |degrees: f64, curved: bool, slave: bool| {
            let mut x: Vec<f64> = (0..4)
                .flat_map(|i| {
                    let (sin, cos) = (degrees * f64::from(i)).to_radians().sin_cos();
                    [[cos, sin, 0.0], [cos, sin, 1.0]]
                })
                .flatten()
                .collect();
            x.extend([[3.0, 0.0, 0.0], [3.0, 1.0, 0.0], [3.0, 1.0, 1.0], [3.0, 0.0, 1.0]].as_flattened());
            let arc: Vec<FacetNodes> = (0..3).map(|i| [2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1].into()).collect();
            let plane = vec![FacetNodes::from([8, 11, 10, 9])];
            let height = FacetHeight::new([1e-3; 25], &[Vector3::x(), Vector3::y(), Vector3::z()]);
            let heights = if curved { vec![Some(height); 3] } else { Vec::new() };
            let (sides, heights) = match slave {
                true => ([arc, plane], [heights, Vec::new()]),
                false => ([plane, arc], [Vec::new(), heights]),
            };
            let (shape, rule) = (MultiplierShape::Standard, CellRule::Six);
            let options = InterfaceOptions { shape, rule, reach: 1.0, feature_angle: 0.5 };
            let [first, second] = sides;
            let interface = ContactInterface::new(first, second, &x, options).unwrap().with_heights(heights);
            [interface.has_kinks(&x), interface.is_coarse(&x)]
        };
        let found =
            [5.0, 9.9, 10.0, 14.9, 15.0, 0.5_f64.to_degrees(), 29.0].map(|degrees| is_coarse(degrees, true, true));
        let [kinks, coarse] = [0, 1].map(|i| found.map(|found| found[i]));
        assert_eq!(kinks, [false, false, true, true, true, true, false]);
        assert_eq!(coarse, [false, false, false, false, true, true, false]);
        assert_eq!(is_coarse(20.0, false, true), [false; 2], "facets that are the surface itself");
        assert_eq!(is_coarse(20.0, true, false), [false; 2], "a flat slave");
    }

    /// The bore of a plate, with the face around its rim, and a plug in it whose radius grows by `slope` per length;
    /// the plug's side has other divisions than the bore. Only a slope above 2° counts, and only of curved surfaces.
    #[test]
    fn a_plug_that_tapers_is_inclined_to_the_rim_of_a_bore() {
        let is_inclined = |degrees: f64, curved: [bool; 2]| {
            let mut x: Vec<[f64; 3]> = Vec::new();
            let mut arc = |from: f64, by: f64, [radius, y]: [f64; 2]| {
                let first = x.len() as u32;
                x.extend((0..5).map(|i| {
                    let (sin, cos) = (from + by * f64::from(i)).to_radians().sin_cos();
                    [radius * cos, y, radius * sin]
                }));
                first
            };
            let slope = degrees.to_radians().tan();
            let rings = [[0.5, 0.0], [0.5, 0.5], [0.8, 0.5]].map(|ring| arc(-40.0, 20.0, ring));
            let plug = [-0.2, 0.6].map(|y| arc(-50.0, 25.0, [0.49 + slope * (y - 0.5), y]));
            let strip = |a: u32, b: u32| -> Vec<FacetNodes> {
                (0..4).map(|i| [a + i, b + i, b + i + 1, a + i + 1].into()).collect()
            };
            let (bore, face) = (strip(rings[1], rings[0]), strip(rings[2], rings[1]));
            let side = strip(plug[0], plug[1]);
            let height = FacetHeight::new([1e-3; 25], &[Vector3::x(), Vector3::y(), Vector3::z()]);
            let heights = curved.map(|curved| if curved { vec![Some(height); 4] } else { Vec::new() });
            let (shape, rule) = (MultiplierShape::Standard, CellRule::Six);
            let options = InterfaceOptions { shape, rule, reach: 0.3, feature_angle: 0.8 };
            let x = x.as_flattened();
            let interface = ContactInterface::new(bore.clone(), side, x, options).unwrap().with_heights(heights);
            let touched = interface.clone().with_touched_edges(&[bore, face].concat(), x, 0.8);
            interface.is_inclined(&touched, x)
        };
        let found = [0.0, 1.9, 2.1, 9.0, -9.0].map(|degrees| is_inclined(degrees, [true; 2]));
        assert_eq!(found, [false, false, true, true, false], "a plug that is narrow at this rim does not meet it");
        assert!(!is_inclined(9.0, [true, false]), "a flat master");
    }
}

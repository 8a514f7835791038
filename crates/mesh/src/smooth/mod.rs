//! The smooth surface for which the facets of a mesh stand, as heights above these facets.
//!
//! A surface is divided into patches at edges sharper than the feature angle. The facets of a patch
//! stand for
//!
//! * a sphere, cylinder, cone or torus ([`Shape`]) that is known, or on which all nodes of the patch
//!   lie;
//! * otherwise, where it is flat, themselves;
//! * elsewhere, a surface through the nodes with averaged normals: along an edge from a to b with
//!   the unit normals n_a and n_b at its ends, the middle of a cubic with these tangent planes
//!   stands off the edge by ((n_b · e) n_b − (n_a · e) n_a)/8, e = x_b − x_a (after Nagata,
//!   Comput. Aided Geom. Des. 22 (2005), 327–347). A node of a flat region has the normal of that
//!   region, so that a fillet ends where it should.

mod control_points;
mod facets;
mod middles;
mod shape;

pub use control_points::control_points;
pub use shape::Shape;

use crate::FacetNodes;
use control_points::bulges;
use facets::{Bend, FLAT, Facets, edges, normal};
use nalgebra::Vector3;
use std::collections::{BTreeMap, BTreeSet};

/// A part of a surface that is smooth, and curved.
#[derive(Debug, Clone, PartialEq)]
pub struct SmoothPatch {
    /// The shape on which all its nodes lie, if there is one.
    pub shape: Option<Shape>,
    /// Its facets, ascending.
    pub facets: Vec<u32>,
    /// The largest distance of the smooth surface from a facet. \[L\]
    pub sagitta: f64,
}

/// Heights above the control points of a facet; a triangle has 15, and the other values are zero.
pub type FacetHeights = [f64; 25];

/// Heights of the smooth surface above the facets of a surface.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SmoothSurface {
    /// For each facet, none where it is the surface itself: the heights along its outward normal
    /// above its [`control_points`]. \[L\]
    pub heights: Vec<Option<FacetHeights>>,
    /// The curved patches, by their first facet.
    pub patches: Vec<SmoothPatch>,
}

/// Nodes are on a shape if they are not farther from it than this fraction of the largest distance
/// of a facet from it.
const ON_SHAPE: f64 = 0.02;

/// Heights below this fraction of a facet's size are round-off.
const ROUND_OFF: f64 = 1e-9;

/// Bending of an edge relative to that of the other smooth edges of its facets beyond which the edge is
/// a kink, where flat faces meet.
const KINK: f64 = 3.0;

/// Facets belong to a known shape if their normals differ from its own by less than this. \[rad\]
const ALONG_SHAPE: f64 = std::f64::consts::FRAC_PI_3;

/// The smooth surface for which `facets` stand.
///
/// `known` are shapes from which the mesh was made: facets between nodes on them stand for them,
/// however coarse they are. `mirrored` are the coordinate axes normal to a symmetry plane through a
/// node: there, the surface continues with its mirror image. `nodes` are the positions of the nodes,
/// which lie on the surface; `points` are those of the facets' corners. They differ for quadratic
/// elements ([`crate::ContactMap`]).
///
/// Tests: `arcs_get_their_sagitta`, `half_a_surface_is_half_of_the_whole`, `known_shapes_need_no_fit`,
/// `flat_faces_and_kinks_stay_as_they_are`, `a_fillet_ends_at_the_flat_face`.
pub fn smooth_surface(
    facets: &[FacetNodes],
    nodes: &[[f64; 3]],
    points: &[[f64; 3]],
    feature_angle: f64,
    known: &[Shape],
    mirrored: impl Fn(u32) -> [bool; 3],
) -> SmoothSurface {
    let surface = Facets::new(facets, nodes, feature_angle, &mirrored);
    let mut out = SmoothSurface { heights: vec![None; facets.len()], patches: Vec::new() };
    let mut all: BTreeSet<u32> = (0..facets.len() as u32).collect();
    for shape in known {
        let on: BTreeSet<u32> = all.iter().copied().filter(|&facet| surface.is_on(facet, shape)).collect();
        if !on.is_empty() && surface.add_on_shape(&on, *shape, points, &mut out) {
            all.retain(|facet| !on.contains(facet));
        }
    }
    let smooth = |edge: &Bend| edge.angle <= feature_angle + 1e-9;
    for patch in surface.components(&all, smooth) {
        if surface.add_shape(&patch, points, &mut out) {
            continue;
        }
        let flat = surface.flat(&patch);
        let curved: BTreeSet<u32> = patch.difference(&flat).copied().collect();
        for patch in surface.components(&curved, smooth) {
            if !surface.add_shape(&patch, points, &mut out) {
                surface.add_averaged(&patch, &flat, points, &mut out);
            }
        }
    }
    out.patches.sort_by_key(|patch| patch.facets[0]);
    out
}

impl Facets<'_> {
    /// Adds the heights of a patch whose nodes lie on a shape; `false` if there is none, or it is
    /// flat.
    fn add_shape(&self, patch: &BTreeSet<u32>, points: &[[f64; 3]], out: &mut SmoothSurface) -> bool {
        let numbers: BTreeSet<u32> = patch.iter().flat_map(|&f| self.facets[f as usize].iter().copied()).collect();
        let nodes: Vec<_> = numbers.iter().map(|&node| self.position(node)).collect();
        let facets: Vec<_> = patch
            .iter()
            .map(|&f| {
                let facet = &self.facets[f as usize];
                let sum: Vector3<f64> = facet.iter().map(|&node| self.position(node)).sum();
                (sum / facet.len() as f64, self.normals[f as usize])
            })
            .collect();
        // a chord of length l between tangents that differ by an angle a has the sagitta a l/8
        let sagitta = |facet: &u32| {
            let nodes = &self.facets[*facet as usize];
            let bends = edges(nodes).filter_map(|edge| self.bends.get(&edge));
            let largest = bends.map(|bend| bend.angle).filter(|a| *a <= self.feature_angle).fold(0.0, f64::max);
            largest * self.size(*facet) / 8.0
        };
        let sagitta = patch.iter().map(sagitta).fold(0.0, f64::max);
        if !(sagitta > ROUND_OFF * patch.iter().map(|&f| self.size(f)).fold(0.0, f64::max)) {
            return false;
        }
        let doubly_curved = self.surrounds_a_node(patch);
        let Some(shape) = shape::fit(&nodes, &facets, ON_SHAPE * sagitta, doubly_curved) else { return false };
        self.add_on_shape(patch, shape, points, out)
    }

    /// Whether the facets of a patch surround a node, so that they show how it bends in all directions: nodes of a
    /// single row, as of a tube with one element along its axis, lie on spheres too.
    fn surrounds_a_node(&self, patch: &BTreeSet<u32>) -> bool {
        let mut ends: BTreeMap<u32, bool> = BTreeMap::new();
        for &facet in patch {
            for edge in edges(&self.facets[facet as usize]) {
                let goes_on = self.bends.get(&edge).is_some_and(|bend| {
                    let [f, g] = bend.facets;
                    patch.contains(&f) && patch.contains(&g) && (f != g || bend.angle > FLAT)
                });
                edge.iter().for_each(|&node| *ends.entry(node).or_insert(false) |= !goes_on);
            }
        }
        ends.values().any(|ends| !ends)
    }

    /// Whether all nodes of a facet lie on a shape, and the facet along it.
    fn is_on(&self, facet: u32, shape: &Shape) -> bool {
        let nodes: Vec<_> = self.facets[facet as usize].iter().map(|&node| self.position(node)).collect();
        let (centre, size) = (nodes.iter().sum::<Vector3<f64>>() / nodes.len() as f64, self.size(facet));
        let on = shape.residual(&nodes) <= ROUND_OFF * (size + centre.norm());
        on && self.normals[facet as usize].dot(&shape.normal(&centre, 1e-3 * size)).abs() > ALONG_SHAPE.cos()
    }

    /// Adds the heights of facets that stand for a shape; `false` if one does not.
    fn add_on_shape(&self, patch: &BTreeSet<u32>, shape: Shape, points: &[[f64; 3]], out: &mut SmoothSurface) -> bool {
        let height = |facet: u32, point: &Vector3<f64>, _: &[f64]| {
            let normal = normal(&self.facets[facet as usize], points);
            shape.along(point, &normal, self.size(facet))
        };
        self.add(patch, Some(shape), points, height, out)
    }

    /// Adds the heights of a patch of a surface with averaged normals.
    fn add_averaged(&self, patch: &BTreeSet<u32>, flat: &BTreeSet<u32>, points: &[[f64; 3]], out: &mut SmoothSurface) {
        let bending = |facet: u32, but: [u32; 2]| {
            let others = edges(&self.facets[facet as usize]).filter(|edge| *edge != but);
            let smooth =
                others.filter_map(|edge| self.bends.get(&edge)).filter(|bend| bend.angle <= self.feature_angle);
            smooth.map(|bend| bend.angle).fold(0.0, f64::max)
        };
        let kinks: BTreeSet<[u32; 2]> = self
            .bends
            .iter()
            .filter(|(edge, bend)| {
                let [f, g] = bend.facets;
                bend.angle > self.feature_angle
                    || bend.angle > FLAT.max(KINK * bending(f, **edge).max(bending(g, **edge)))
            })
            .map(|(edge, _)| *edge)
            .collect();
        let smooth = |edge: &Bend, key: &[u32; 2]| edge.angle <= self.feature_angle && !kinks.contains(key);
        // the normals at the corners of each facet: of the facets around the node that smooth edges
        // at the node connect with it
        let mut around: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for f in patch.union(flat) {
            self.facets[*f as usize].iter().for_each(|&node| around.entry(node).or_default().push(*f));
        }
        let normal_at = |facet: u32, node: u32| -> Vector3<f64> {
            let mut group = vec![facet];
            let mut next = 0;
            while next < group.len() {
                for edge in edges(&self.facets[group[next] as usize]).filter(|edge| edge.contains(&node)) {
                    let Some(bend) = self.bends.get(&edge).filter(|bend| smooth(bend, &edge)) else { continue };
                    let other = bend.facets[usize::from(bend.facets[0] == group[next])];
                    if around[&node].contains(&other) && !group.contains(&other) {
                        group.push(other);
                    }
                }
                next += 1;
            }
            match group.iter().find(|f| flat.contains(f)) {
                Some(&plane) => self.normals[plane as usize],
                None => {
                    let sum: Vector3<f64> = group.iter().map(|&f| self.normals[f as usize]).sum();
                    let across = (self.mirrored)(node);
                    Vector3::from_fn(|c, _| if across[c] { 0.0 } else { sum[c] }).normalize()
                }
            }
        };
        let mut stand_off: BTreeMap<u32, Vec<Vector3<f64>>> = BTreeMap::new();
        for &f in patch {
            let facet = &self.facets[f as usize];
            let normals: Vec<_> = facet.iter().map(|&node| normal_at(f, node)).collect();
            let middles = (0..facet.len()).map(|i| {
                let j = (i + 1) % facet.len();
                let e = self.position(facet[j]) - self.position(facet[i]);
                (normals[j] * normals[j].dot(&e) - normals[i] * normals[i].dot(&e)) / 8.0
            });
            stand_off.insert(f, middles.collect());
        }
        let height = |facet: u32, point: &Vector3<f64>, shape: &[f64]| {
            let corners = &self.facets[facet as usize];
            let middles = &stand_off[&facet];
            let off: Vector3<f64> = middles.iter().zip(bulges(shape)).map(|(off, weight)| off * weight).sum();
            let on: Vector3<f64> = corners.iter().zip(shape).map(|(&node, n)| self.position(node) * *n).sum();
            Some(normal(corners, points).dot(&(on + off - point)))
        };
        self.add(patch, None, points, height, out);
    }

    /// Adds the heights at the control points of the facets of a patch, and the patch if one is not
    /// round-off; adds nothing, and returns false, if there is no height at a point. `height` gets
    /// the facet, the point on it and the shape functions there.
    fn add(
        &self,
        patch: &BTreeSet<u32>,
        shape: Option<Shape>,
        points: &[[f64; 3]],
        height: impl Fn(u32, &Vector3<f64>, &[f64]) -> Option<f64>,
        out: &mut SmoothSurface,
    ) -> bool {
        let mut found = Vec::with_capacity(patch.len());
        let mut sagitta: f64 = 0.0;
        for &f in patch {
            let facet = &self.facets[f as usize];
            let mut heights: FacetHeights = [0.0; 25];
            for (at, shape) in heights.iter_mut().zip(control_points(facet.len())) {
                let corners = facet.iter().zip(&shape);
                let point: Vector3<f64> = corners.map(|(&n, s)| Vector3::from(points[n as usize]) * *s).sum();
                let Some(h) = height(f, &point, &shape[..facet.len()]).filter(|h| h.is_finite()) else { return false };
                *at = h;
            }
            let largest = heights.iter().fold(0.0, |largest: f64, h| largest.max(h.abs()));
            if largest > ROUND_OFF * self.size(f) {
                sagitta = sagitta.max(largest);
                found.push((f, heights));
            }
        }
        let facets: Vec<u32> = found.iter().map(|(f, _)| *f).collect();
        found.into_iter().for_each(|(f, heights)| out.heights[f as usize] = Some(heights));
        if !facets.is_empty() {
            out.patches.push(SmoothPatch { shape, facets, sagitta });
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of quadrilaterals, two wide, over the points of a profile in the plane z = 0.
    fn strip(profile: &[[f64; 2]]) -> (Vec<FacetNodes>, Vec<[f64; 3]>) {
        let nodes = profile.iter().flat_map(|p| [0.0, 0.4, 1.0].map(|z| [p[0], p[1], z])).collect();
        let at = |i: usize, j: usize| (3 * i + j) as u32;
        let facets = (0..profile.len() - 1).flat_map(|i| (0..2).map(move |j| (i, j)));
        (facets.map(|(i, j)| [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)].into()).collect(), nodes)
    }

    /// Angle of a right angle's quarter, 45°.
    const FEATURE: f64 = std::f64::consts::FRAC_PI_4;

    /// Ten degrees of a circle of radius 3 have the sagitta 3 (1 − cos 5°).
    #[test]
    fn arcs_get_their_sagitta() {
        let arc = |factor: f64| -> Vec<[f64; 2]> {
            (0..=6)
                .map(|i| f64::to_radians(10.0 * f64::from(i)).sin_cos())
                .map(|(s, c)| [3.0 * s, factor * 3.0 * c])
                .collect()
        };
        let exact = 3.0 * (1.0 - f64::to_radians(5.0).cos());
        let (facets, nodes) = strip(&arc(1.0));
        let found = smooth_surface(&facets, &nodes, &nodes, FEATURE, &[], |_| [false; 3]);
        assert!(matches!(found.patches[..], [SmoothPatch { shape: Some(Shape::Cone { slope: 0.0, .. }), .. }]));
        for heights in &found.heights {
            let heights = heights.unwrap();
            for (h, shape) in heights.iter().zip(control_points(4)) {
                // from the middle of the facet along its arc
                let from = 3.0 * f64::to_radians(5.0).sin() * (2.0 * (shape[0] + shape[1]) - 1.0);
                let on_arc = (9.0 - from * from).sqrt() - 3.0 * f64::to_radians(5.0).cos();
                assert!((h - on_arc).abs() < 1e-9, "{heights:?} {on_arc}");
            }
            assert!((heights[12] - exact).abs() < 1e-9);
        }
        // an elliptic arc has no shape; away from its ends the averaged normals give its sagitta
        let (facets, nodes) = strip(&arc(0.98));
        let found = smooth_surface(&facets, &nodes, &nodes, FEATURE, &[], |_| [false; 3]);
        assert!(matches!(found.patches[..], [SmoothPatch { shape: None, .. }]));
        for heights in &found.heights[2..10] {
            let middle = heights.unwrap()[12];
            assert!((middle / exact - 1.0).abs() < 0.05, "{middle} {exact}");
        }
    }

    #[test]
    fn flat_faces_and_kinks_stay_as_they_are() {
        let profiles: [&[[f64; 2]]; 4] = [
            &[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]],
            &[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.5], [4.0, 1.0]],
            &[[0.0, 0.0], [1.0, 0.0], [2.0, 0.5]],
            // the facet in the middle ends at a sharp edge and at a kink
            &[[0.0, 0.0], [1.0, 1.5], [2.0, 1.5], [3.0, 1.0], [4.0, 0.5]],
        ];
        for profile in profiles {
            let (facets, nodes) = strip(profile);
            let found = smooth_surface(&facets, &nodes, &nodes, FEATURE, &[], |_| [false; 3]);
            assert_eq!(found.patches, [], "{profile:?}");
        }
    }

    /// Facets between two arcs, whose nodes lie on spheres too. Four facets of 15° have the five lines that show a
    /// cylinder; three have averaged normals, whose cubic is 1.3 % lower than the arc, 3 (1 − cos 7.5°). Beside a symmetry
    /// plane through an arc, the surface continues straight.
    #[test]
    fn a_single_row_of_facets_is_no_sphere() {
        for (count, mirrored) in [(4, false), (3, false), (4, true)] {
            let arc = (0..=count).map(|i| f64::to_radians(15.0 * f64::from(i)).sin_cos());
            let nodes: Vec<[f64; 3]> = arc.flat_map(|(s, c)| [0.0, 5.0].map(|z| [3.0 * s, 3.0 * c, z])).collect();
            let facets: Vec<FacetNodes> =
                (0..count).map(|i| [0, 1, 3, 2].map(|corner| (2 * i + corner) as u32).into()).collect();
            let found =
                smooth_surface(&facets, &nodes, &nodes, FEATURE, &[], |node| [false, false, mirrored && node % 2 == 0]);
            let [patch] = &found.patches[..] else { panic!("{:?}", found.patches) };
            let cylinder = matches!(patch.shape, Some(Shape::Cone { slope: 0.0, .. }));
            assert_eq!((cylinder, patch.shape.is_none()), (count == 4, count == 3), "{patch:?}");
            let exact = 3.0 * (1.0 - f64::to_radians(7.5).cos());
            let middle = found.heights[1].unwrap()[12];
            assert!((middle / exact - 1.0).abs() < 0.015, "{middle} {exact}");
        }
    }

    /// A flat face of 3 × 2 facets that a fillet of radius 1 continues.
    #[test]
    fn a_fillet_ends_at_the_flat_face() {
        let mut profile: Vec<[f64; 2]> = (0..4).map(|i| [f64::from(i) - 3.0, 1.0]).collect();
        profile.extend((1..=5).map(|i| f64::to_radians(12.0 * f64::from(i)).sin_cos()).map(|(s, c)| [s, c]));
        let (facets, nodes) = strip(&profile);
        let found = smooth_surface(&facets, &nodes, &nodes, FEATURE, &[], |_| [false; 3]);
        assert!(found.heights[..6].iter().all(Option::is_none));
        let exact = 1.0 - f64::to_radians(6.0).cos();
        for heights in &found.heights[6..] {
            assert!((heights.unwrap()[12] - exact).abs() < 1e-9);
        }
    }

    /// A hexagonal prism is one, unless it is known to stand for a cylinder: then the height is
    /// 1 − cos 30°, and the ends, whose nodes lie on the cylinder too, remain flat.
    #[test]
    fn known_shapes_need_no_fit() {
        let hexagon: Vec<[f64; 2]> =
            (0..6).map(|i| f64::to_radians(60.0 * f64::from(i)).sin_cos()).map(|(s, c)| [s, c]).collect();
        let (mut facets, nodes) = strip(&hexagon);
        facets.extend([[0, 3, 6, 9], [0, 9, 12, 15]].map(FacetNodes::from));
        let known = [Shape::Cone { point: Vector3::zeros(), axis: Vector3::z(), radius: 1.0, slope: 0.0 }];
        let found = smooth_surface(&facets, &nodes, &nodes, FEATURE, &[], |_| [false; 3]);
        assert_eq!(found.patches, []);
        let found = smooth_surface(&facets, &nodes, &nodes, FEATURE, &known, |_| [false; 3]);
        let exact = 1.0 - f64::to_radians(30.0).cos();
        assert!(found.heights[..10].iter().all(|heights| (heights.unwrap()[12] - exact).abs() < 1e-12));
        assert!(found.heights[10..].iter().all(Option::is_none));
    }

    /// A bump, and its half that ends at a symmetry plane.
    #[test]
    fn half_a_surface_is_half_of_the_whole() {
        let bump: Vec<[f64; 2]> =
            (-6..=6).map(|i| 0.25 * f64::from(i)).map(|x: f64| [x, (-x * x).exp() + 0.2 * x.powi(4)]).collect();
        let (facets, nodes) = strip(&bump);
        let whole = smooth_surface(&facets, &nodes, &nodes, FEATURE, &[], |_| [false; 3]);
        let (facets, nodes) = strip(&bump[6..]);
        let half = smooth_surface(&facets, &nodes, &nodes, FEATURE, &[], |node| [node < 3, false, false]);
        assert_eq!(half.patches.len(), 1);
        for (part, all) in half.heights.iter().zip(&whole.heights[12..]) {
            let (part, all) = (part.unwrap(), all.unwrap());
            assert!(part.iter().zip(all).all(|(a, b)| (a - b).abs() < 1e-12), "{part:?} {all:?}");
        }
    }
}

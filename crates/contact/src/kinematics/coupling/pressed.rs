//! Integrals of a pressure at the points of a slave facet: the rows of a coupling, weighted by it.

use super::FacetCoupling;
use crate::enforcement::soft::Weight;
use crate::kinematics::facet_pair::PairHeights;
use crate::kinematics::height::{AlongRay, CurvedFacet};
use crate::kinematics::inverse_map::Unmappable;
use crate::kinematics::plane::{FacetNormal, Plane, Settings, position};
use crate::kinematics::pressed_pair::{ENTRIES, FACE, PairGap, PressedIntegrals, integrate_pressure};
use nalgebra::Vector3;

/// A pressure that depends on the gap at each point of a slave facet.
#[derive(Debug, Clone, Copy)]
pub struct PointPressure<'a> {
    /// What is integrated: the pressure, or the energy that it stores.
    pub weight: Weight<'a>,
    /// Offsets of the facet's corners, by which the surfaces touch before their meshes do. \[L\]
    pub offsets: [f64; 4],
    /// Initial gaps that count as closed, at the points of the facet or of its quadratic face. \[L\]
    pub closed: [f64; 9],
}

/// The factors of the heights of the true surfaces above a pair of facets, and their derivatives with
/// respect to the corners.
pub(in crate::kinematics) struct Factors<const S: usize, const M: usize> {
    pub value: [f64; 4],
    by_slave: [[Vector3<f64>; S]; 4],
    by_master: [[Vector3<f64>; M]; 4],
}

impl<const S: usize, const M: usize> Factors<S, M> {
    /// `None` for a collapsed facet.
    pub fn new(corners: &[Vector3<f64>; S], points: &[Vector3<f64>; M], heights: PairHeights<'_>) -> Option<Self> {
        let (own, other) = (FacetNormal::of(corners)?, FacetNormal::of(points)?);
        let ray = AlongRay::new(&-own.normal, points, &other.normal, &other.slope)?;
        let still = (1.0, [Vector3::zeros(); S]);
        let (own_stretch, own_slope) = heights[0].map_or(still, |height| height.stretch(corners));
        let still = (1.0, [Vector3::zeros(); M]);
        let (stretch, stretch_slope) = heights[1].map_or(still, |height| height.stretch(points));
        let mut out = Self {
            value: [own_stretch, 0.0, 0.0, 0.0],
            by_slave: [own_slope, [Vector3::zeros(); S], [Vector3::zeros(); S], [Vector3::zeros(); S]],
            by_master: [[Vector3::zeros(); M]; 4],
        };
        for k in 0..3 {
            // h² counts once, the products with its slopes twice
            let (grown, grows) = if k == 0 { (stretch, 1.0) } else { (stretch * stretch, 2.0 * stretch) };
            out.value[k + 1] = grown * ray.factors[k];
            out.by_slave[k + 1] = own.slope.map(|slope| slope.tr_mul(&ray.by_direction[k]) * -grown);
            let by = |i: usize| ray.by_corner[k][i] * grown + stretch_slope[i] * (grows * ray.factors[k]);
            out.by_master[k + 1] = std::array::from_fn(by);
        }
        Some(out)
    }
}

impl FacetCoupling {
    /// Integrates a pressure over the overlaps found by [`Self::evaluate`], with the same slave,
    /// `candidates` and `settings`, into [`pressed`](Self::pressed).
    ///
    /// Test: `pressed_coupling_matches_finite_differences`.
    pub fn press<'a>(
        &mut self,
        slave: CurvedFacet<'_>,
        candidates: impl Iterator<Item = CurvedFacet<'a>>,
        settings: Settings<'_>,
        pressure: PointPressure<'_>,
    ) {
        if self.nodes.is_empty() {
            return;
        }
        match slave.nodes[..] {
            [a, b, c] => self.press_facet(&[a, b, c], slave, candidates, settings, pressure),
            [a, b, c, d] => self.press_facet(&[a, b, c, d], slave, candidates, settings, pressure),
            _ => {}
        }
    }

    fn press_facet<'a, const S: usize>(
        &mut self,
        slave: &[u32; S],
        curved: CurvedFacet<'_>,
        candidates: impl Iterator<Item = CurvedFacet<'a>>,
        settings: Settings<'_>,
        pressure: PointPressure<'_>,
    ) {
        let corners = slave.map(|n| position(settings.x, n));
        let Some(plane) = Plane::of(&corners) else { return };
        let n = self.nodes.len();
        self.pressed.resize(S * n, 0.0);
        self.pressed_gradient.resize(if settings.with_gradient { 3 * S * n * n } else { 0 }, 0.0);
        let (mut next, mut pair) = (0, PressedIntegrals::default());
        for (index, master) in candidates.enumerate() {
            if self.overlapping.get(next) != Some(&index) {
                continue;
            }
            next += 1;
            let own = (&plane, &corners);
            let pressed = match master.nodes[..] {
                [a, b, c] => self.press_master(own, &[a, b, c], [curved, master], settings, pressure, &mut pair),
                [a, b, c, d] => self.press_master(own, &[a, b, c, d], [curved, master], settings, pressure, &mut pair),
                _ => Ok(()),
            };
            // every point has been mapped back before, for D and M
            debug_assert!(pressed.is_ok());
        }
    }

    fn press_master<const S: usize, const M: usize>(
        &mut self,
        (plane, corners): (&Plane<S>, &[Vector3<f64>; S]),
        master: &[u32; M],
        facets: [CurvedFacet<'_>; 2],
        Settings { x, rule, with_gradient, .. }: Settings<'_>,
        PointPressure { weight, offsets, closed }: PointPressure<'_>,
        pair: &mut PressedIntegrals,
    ) -> Result<(), Unmappable> {
        let points = master.map(|m| position(x, m));
        let flat = points.map(|p| plane.project(&p));
        // a quadratic face is the surface itself
        let faces = facets.map(|facet| facet.face);
        let heights = facets.map(|facet| facet.height.filter(|_| facet.face.is_none()));
        let curved = (heights != [None, None]).then(|| Factors::new(corners, &points, heights)).flatten();
        // the local nodes of all functions, with their numbers among the entries
        let of_slave = facets[0].face_nodes().iter().enumerate().map(|(k, node)| (k, self.place_of_slave(*node)));
        let of_master = facets[1].face_nodes().iter().enumerate();
        let of_master = of_master.map(|(l, node)| (FACE + l, self.place_of_master(*node)));
        let places: Vec<(usize, usize)> = of_slave.chain(of_master).collect();
        let mut gap = PairGap { faces, nodes: [0.0; ENTRIES], offsets, heights: [None, None], factors: [0.0; 4] };
        let at = |local: usize| position(x, self.nodes[local]);
        places.iter().for_each(|&(entry, local)| gap.nodes[entry] = plane.height(&at(local)));
        gap.nodes.iter_mut().zip(closed).for_each(|(height, closed)| *height += closed);
        if let Some(curved) = &curved {
            (gap.heights, gap.factors) = (heights, curved.value);
        }
        let projected = corners.map(|p| plane.project(&p));
        if !integrate_pressure(&projected, &flat, &gap, weight, (rule, with_gradient), pair)? {
            return Ok(());
        }
        let n = self.nodes.len();
        let place = master.map(|m| self.place_of_master(m));
        let local = |corner: usize| if corner < 4 { corner } else { place[corner - 4] };
        let positions: Vec<Vector3<f64>> = places.iter().map(|&(_, local)| at(local)).collect();
        for (j, &(entry, node)) in (0..S).flat_map(|j| places.iter().map(move |place| (j, place))) {
            let sign = if entry < FACE { 1.0 } else { -1.0 };
            let at = j * n + node;
            self.pressed[at] += sign * pair.values[j][entry];
            if !with_gradient {
                continue;
            }
            let row = &mut self.pressed_gradient[at * 3 * n..][..3 * n];
            let mut add = |local: usize, c: usize, value: f64| row[3 * local + c] += sign * value;
            plane.chain(&pair.gradient[j][entry], corners, &points, |corner, c, value| add(local(corner), c, value));
            let beside = &pair.beside[j][entry];
            let heights = places.iter().zip(&positions).map(|(&(by, local), point)| (local, *point, beside[by]));
            plane.chain_heights(heights, &mut add);
            let Some(curved) = &curved else { continue };
            for (k, by) in beside[ENTRIES..].iter().enumerate() {
                let of_slave = curved.by_slave[k].iter().enumerate();
                let of_master = curved.by_master[k].iter().enumerate().map(|(i, slope)| (place[i], slope));
                for (local, slope) in of_slave.chain(of_master) {
                    (0..3).for_each(|c| add(local, c, by * slope[c]));
                }
            }
        }
        Ok(())
    }

    /// The local node of a node of the slave.
    fn place_of_slave(&self, node: u32) -> usize {
        self.nodes[..self.own].iter().position(|&known| known == node).expect("the slave's nodes are the first")
    }
}

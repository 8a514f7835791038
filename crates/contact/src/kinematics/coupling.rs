//! Mortar coupling of one slave facet with all master facets that it overlaps.
//!
//! The auxiliary plane goes through the slave facet's centre with the centre normal n₀; both facets
//! are projected onto it along n₀ and integrated there ([`super::facet_pair`]). This module
//! differentiates the plane, sums over the masters and converts standard to dual multiplier shapes.
//!
//! Plane coordinates are `q_a = e_a · (x − x₀)`. D and M do not change when the plane's origin
//! moves or its basis rotates about n₀, so it suffices to let the basis follow the normal without
//! spin, `δe_a = −(e_a · δn₀) n₀`, which gives
//!
//! ```text
//! δq_a = e_a · δx − h (e_a · δn₀),   h = n₀ · (x − x₀)
//! ```

mod dual;
pub(super) mod pressed;

use super::clip::{PLANE_COORDINATES, Point};
use super::facet_pair::{PairHeights, PairIntegrals, integrate_pair};
use super::height::{AlongRay, CurvedFacet};
use super::inverse_map::Unmappable;
pub use super::plane::Settings;
use super::plane::{Coupled, FacetNormal, Plane, position};
use nalgebra::Vector3;
pub use pressed::PointPressure;
use schemars::JsonSchema;
use serde::Serialize;
use slipstick_mesh::FacetNodes;

/// Interpolation of the Lagrange multiplier, Φ. Paper: (13).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MultiplierShape {
    /// Φ_j = N¹_j, as in the paper's examples.
    #[default]
    Standard,
    /// On each covered slave facet, Φ is biorthogonal to N¹, so that D is diagonal; on a partially
    /// covered one, Φ lies between these shapes and N¹.
    Dual,
    /// The mean of both. Between equal facets, the second moment of Φ_j about node j vanishes, so that the mean gap of
    /// a curved surface is the gap at its node: a surface of few facets touches when its nodes do.
    Mean,
}

impl MultiplierShape {
    /// The share of the dual shapes in Φ.
    fn dual_share(self) -> f64 {
        match self {
            Self::Standard => 0.0,
            Self::Dual => 1.0,
            Self::Mean => 0.5,
        }
    }
}

/// A facet, given by its nodes, whose projection along the slave facet's normal is folded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FoldedFacet(pub FacetNodes);

/// Mortar rows of the corners of one slave facet over its local nodes: the slave's corners, then
/// the masters' nodes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FacetCoupling {
    /// Global numbers of the local nodes; the first ones are the facet's corners. Empty if nothing
    /// overlaps.
    pub nodes: Vec<u32>,
    /// Number of corners of the slave facet.
    pub corners: usize,
    /// Number of leading nodes that belong to the slave: its corners, and the other nodes of its quadratic face.
    pub own: usize,
    /// `coefficient[j * nodes.len() + s]` = b_js of corner j: +D for slave, −M for master
    /// nodes. \[L²\]
    pub coefficient: Vec<f64>,
    /// `gradient[(j * nodes.len() + s) * 3 nodes.len() + t]` = ∂b_js/∂x_t. \[L\]
    pub gradient: Vec<f64>,
    /// `facing[3 j + c]` = −Σ_p n_p ∫ N_j over the overlap with master facet p of normal n_p:
    /// opposite to the normals of the masters that face a corner on a sharp edge; zero for other
    /// corners. \[L²\]
    pub facing: Vec<f64>,
    /// `facing_gradient[(3 j + c) * 3 nodes.len() + t]` = ∂facing/∂x_t; empty if no corner lies on
    /// a sharp edge. \[L\]
    pub facing_gradient: Vec<f64>,
    /// `height[3 j + c]` = n₀_c ∫ Φ_j (σ¹ h¹ + t²) over the overlap: the heights of the true surfaces
    /// above the facets, along the normal n₀ ([`super::height`]). Empty if there are none. \[L³\]
    pub height: Vec<f64>,
    /// `height_gradient[(3 j + c) * 3 nodes.len() + t]` = ∂height/∂x_t; empty with `height`. \[L²\]
    pub height_gradient: Vec<f64>,
    /// Like `coefficient`, for the integrals ∫ p N_j N_s of a pressure p at the points; empty if there is
    /// none ([`Self::press`]). \[F\]
    pub pressed: Vec<f64>,
    /// Like `gradient`, ∂pressed/∂x_t. \[F/L\]
    pub pressed_gradient: Vec<f64>,
    sharp: [bool; 4],
    overlapping: Vec<usize>,
}

impl FacetCoupling {
    /// ∂b_js/∂x_t over all local coordinates t.
    pub fn gradient_row(&self, corner: usize, node: usize) -> &[f64] {
        let n = self.nodes.len();
        &self.gradient[(corner * n + node) * 3 * n..][..3 * n]
    }

    /// Integrates over the overlaps of the slave facet with its candidate masters.
    ///
    /// Masters that do not face the slave facet, or whose centre is further away than `reach` along
    /// n₀, are ignored, as are those whose projection is folded, unless they are so close that they
    /// may touch. So are masters behind the slave facet if that lies outside the master's body
    /// (`Plane::is_behind`). `sharp` marks the corners that lie on a sharp edge and need
    /// [`facing`](Self::facing).
    ///
    /// # Errors
    /// [`FoldedFacet`] if the projection of the slave facet, or of a master that may touch it, is
    /// folded; the coupling is then empty.
    ///
    /// Paper: (15), linearized as in Popp et al. (2010).
    /// Test: `coupling_gradient_matches_finite_differences`.
    pub fn evaluate<'a>(
        &mut self,
        slave: CurvedFacet<'_>,
        sharp: [bool; 4],
        candidates: impl Iterator<Item = CurvedFacet<'a>> + Clone,
        settings: Settings<'_>,
    ) -> Result<(), FoldedFacet> {
        self.nodes.clear();
        self.height.clear();
        self.height_gradient.clear();
        self.pressed.clear();
        self.pressed_gradient.clear();
        self.corners = slave.nodes.len();
        // the shapes of one corner combine the integrals of all
        let mixed = settings.shape == MultiplierShape::Mean && sharp.contains(&true);
        self.sharp = if mixed { [true; 4] } else { sharp };
        match slave.nodes[..] {
            [a, b, c] => self.evaluate_facet(&[a, b, c], slave, candidates, settings),
            [a, b, c, d] => self.evaluate_facet(&[a, b, c, d], slave, candidates, settings),
            _ => Ok(()),
        }
    }

    fn evaluate_facet<'a, const S: usize>(
        &mut self,
        slave: &[u32; S],
        curved: CurvedFacet<'_>,
        candidates: impl Iterator<Item = CurvedFacet<'a>> + Clone,
        settings: Settings<'_>,
    ) -> Result<(), FoldedFacet> {
        let Settings { x, shape, with_gradient, .. } = settings;
        let corners = slave.map(|n| position(x, n));
        let Some(plane) = Plane::of(&corners) else { return Ok(()) };
        let projected = corners.map(|p| plane.project(&p));
        self.nodes.extend_from_slice(slave);
        for node in curved.face_nodes() {
            if !self.nodes.contains(node) {
                self.nodes.push(*node);
            }
        }
        let own = self.nodes.len();
        self.own = own;
        // the first pass finds the overlapping masters, to determine the local nodes; the second
        // pass computes their integrals
        self.overlapping.clear();
        let mut has_height = curved.height.is_some();
        for (index, facet) in candidates.clone().enumerate() {
            let CurvedFacet { nodes: master, height, .. } = facet;
            let overlaps = match master[..] {
                [a, b, c] => plane.overlaps(&projected, &[a, b, c], settings),
                [a, b, c, d] => plane.overlaps(&projected, &[a, b, c, d], settings),
                _ => Coupled::No,
            };
            match overlaps {
                Coupled::No => continue,
                Coupled::FoldedMaster => return self.fail(&master),
                Coupled::FoldedSlave => return self.fail(slave),
                Coupled::Yes
                    if plane.is_behind(&projected, &master, candidates.clone().map(|facet| facet.nodes), settings) =>
                {
                    continue;
                }
                Coupled::Yes => {}
            }
            self.overlapping.push(index);
            has_height |= height.is_some();
            for &node in master.iter().chain(facet.face_nodes()) {
                if !self.nodes[own..].contains(&node) {
                    self.nodes.push(node);
                }
            }
        }
        if self.overlapping.is_empty() {
            self.nodes.clear();
            return Ok(());
        }
        let n = self.nodes.len();
        self.coefficient.clear();
        self.coefficient.resize(S * n, 0.0);
        self.gradient.clear();
        self.facing.clear();
        self.facing.resize(3 * S, 0.0);
        self.facing_gradient.clear();
        if with_gradient {
            self.gradient.resize(3 * S * n * n, 0.0);
            if self.sharp.contains(&true) {
                self.facing_gradient.resize(9 * S * n, 0.0);
            }
        }
        if has_height {
            self.height.resize(3 * S, 0.0);
            self.height_gradient.resize(if with_gradient { 9 * S * n } else { 0 }, 0.0);
        }
        let (mut next, mut pair) = (0, PairIntegrals::default());
        let own = (&plane, &corners, &projected);
        for (index, CurvedFacet { nodes: master, height, .. }) in candidates.enumerate() {
            if self.overlapping.get(next) != Some(&index) {
                continue;
            }
            next += 1;
            let heights = [curved.height, height];
            let added = match master[..] {
                [a, b, c] => self.add_master(own, &[a, b, c], heights, settings, &mut pair),
                [a, b, c, d] => self.add_master(own, &[a, b, c, d], heights, settings, &mut pair),
                _ => Ok(()),
            };
            if added.is_err() {
                return self.fail(&master);
            }
        }
        if shape != MultiplierShape::Standard {
            self.make_dual(&plane, &corners, shape.dual_share(), with_gradient);
        }
        Ok(())
    }

    /// Integrates over the overlap with one master facet, in `pair`.
    fn add_master<const S: usize, const M: usize>(
        &mut self,
        (plane, corners, projected): (&Plane<S>, &[Vector3<f64>; S], &[Point; S]),
        master: &[u32; M],
        heights: PairHeights<'_>,
        Settings { x, rule, with_gradient, .. }: Settings<'_>,
        pair: &mut PairIntegrals,
    ) -> Result<(), Unmappable> {
        let points = master.map(|m| position(x, m));
        let flat = points.map(|p| plane.project(&p));
        if integrate_pair(projected, &flat, heights, rule, with_gradient, pair)? {
            let place: [usize; M] = master.map(|m| self.place_of_master(m));
            self.add_pair(pair, plane, corners, &points, place, with_gradient);
            self.add_facing(pair, plane, corners, &points, place, with_gradient);
            if heights != [None, None] {
                self.add_height(pair, heights, plane, corners, &points, place, with_gradient);
            }
        }
        Ok(())
    }

    /// The local node of a node of a master.
    fn place_of_master(&self, node: u32) -> usize {
        let place = self.nodes[self.own..].iter().position(|&known| known == node);
        self.own + place.expect("collected in the first pass")
    }

    fn fail(&mut self, facet: &[u32]) -> Result<(), FoldedFacet> {
        self.nodes.clear();
        FacetNodes::new(facet).map_or(Ok(()), |facet| Err(FoldedFacet(facet)))
    }

    /// Adds the integrals of one pair, with the chain rule from plane coordinates to node
    /// positions.
    fn add_pair<const S: usize, const M: usize>(
        &mut self,
        pair: &PairIntegrals,
        plane: &Plane<S>,
        corners: &[Vector3<f64>; S],
        points: &[Vector3<f64>; M],
        column: [usize; M],
        with_gradient: bool,
    ) {
        let n = self.nodes.len();
        for j in 0..S {
            let of_slave = (0..S).map(|k| (4 * j + k, k, 1.0));
            let of_master = (0..M).map(|l| (16 + 4 * j + l, column[l], -1.0));
            for (entry, node, sign) in of_slave.chain(of_master) {
                let at = j * n + node;
                self.coefficient[at] += sign * pair.values[entry];
                if !with_gradient {
                    continue;
                }
                let row = &mut self.gradient[at * 3 * n..][..3 * n];
                plane.chain(&pair.gradient[entry], corners, points, |corner, c, value| {
                    let local = if corner < 4 { corner } else { column[corner - 4] };
                    row[3 * local + c] += sign * value;
                });
            }
        }
    }

    /// Adds the contribution of one master to `facing` of the sharp corners: minus its normal,
    /// times ∫ N_j over the overlap.
    fn add_facing<const S: usize, const M: usize>(
        &mut self,
        pair: &PairIntegrals,
        plane: &Plane<S>,
        corners: &[Vector3<f64>; S],
        points: &[Vector3<f64>; M],
        column: [usize; M],
        with_gradient: bool,
    ) {
        let columns = 3 * self.nodes.len();
        let sharp = self.sharp;
        let Some(seen) = FacetNormal::of(points).filter(|_| sharp.contains(&true)) else { return };
        for j in (0..S).filter(|&j| sharp[j]) {
            // Σ_k N_k = 1
            let weight: f64 = (0..S).map(|k| pair.values[4 * j + k]).sum();
            for c in 0..3 {
                self.facing[3 * j + c] -= weight * seen.normal[c];
            }
            if !with_gradient {
                continue;
            }
            let mut slope = [0.0; PLANE_COORDINATES];
            for k in 0..S {
                slope.iter_mut().zip(&pair.gradient[4 * j + k]).for_each(|(sum, s)| *sum += s);
            }
            let rows = &mut self.facing_gradient[3 * j * columns..][..3 * columns];
            plane.chain(&slope, corners, points, |corner, c, value| {
                let local = if corner < 4 { corner } else { column[corner - 4] };
                for r in 0..3 {
                    rows[r * columns + 3 * local + c] -= value * seen.normal[r];
                }
            });
            for (local, by_corner) in column.into_iter().zip(&seen.slope) {
                for (r, c) in (0..3).flat_map(|r| (0..3).map(move |c| (r, c))) {
                    rows[r * columns + 3 * local + c] -= weight * by_corner[(r, c)];
                }
            }
        }
    }

    /// Adds the heights above the two facets of a pair: n₀ ∫ N_j (σ¹ h¹ + t²) ([`super::height`]).
    ///
    /// Test: `coupling_gradient_matches_finite_differences`.
    fn add_height<const S: usize, const M: usize>(
        &mut self,
        pair: &PairIntegrals,
        heights: PairHeights<'_>,
        plane: &Plane<S>,
        corners: &[Vector3<f64>; S],
        points: &[Vector3<f64>; M],
        column: [usize; M],
        with_gradient: bool,
    ) {
        let columns = 3 * self.nodes.len();
        let (Some(own), Some(other)) = (FacetNormal::of(corners), FacetNormal::of(points)) else { return };
        let Some(ray) = AlongRay::new(&-own.normal, points, &other.normal, &other.slope) else { return };
        let still = (1.0, [Vector3::zeros(); S]);
        let (own_stretch, own_slope) = heights[0].map_or(still, |height| height.stretch(corners));
        let still = (1.0, [Vector3::zeros(); M]);
        let (stretch, stretch_slope) = heights[1].map_or(still, |height| height.stretch(points));
        // h² counts once, the products with its slopes twice
        let grown = [stretch, stretch * stretch, stretch * stretch];
        let grows = [1.0, 2.0 * stretch, 2.0 * stretch];
        let factors: [f64; 4] =
            std::array::from_fn(|k| if k == 0 { own_stretch } else { grown[k - 1] * ray.factors[k - 1] });
        for j in 0..S {
            let integrals: [f64; 4] = std::array::from_fn(|k| pair.heights[4 * k + j]);
            let height: f64 = factors.iter().zip(integrals).map(|(f, integral)| f * integral).sum();
            for c in 0..3 {
                self.height[3 * j + c] += height * own.normal[c];
            }
            if !with_gradient {
                continue;
            }
            let mut slope = [0.0; PLANE_COORDINATES];
            for (k, factor) in factors.iter().enumerate() {
                let row = &pair.heights_gradient[4 * k + j];
                slope.iter_mut().zip(row).for_each(|(sum, s)| *sum += factor * s);
            }
            let rows = &mut self.height_gradient[3 * j * columns..][..3 * columns];
            let mut add = |local: usize, c: usize, value: f64| {
                (0..3).for_each(|r| rows[r * columns + 3 * local + c] += value * own.normal[r]);
            };
            plane.chain(&slope, corners, points, |corner, c, value| {
                add(if corner < 4 { corner } else { column[corner - 4] }, c, value);
            });
            // through the factors, by the direction −n₀ and the master's corners
            let of_master: [f64; 3] = std::array::from_fn(|k| grown[k] * integrals[k + 1]);
            let by_direction: Vector3<f64> = ray.by_direction.iter().zip(of_master).map(|(by, i)| by * i).sum();
            for (local, by_corner) in own.slope.iter().enumerate() {
                let by = -by_corner.tr_mul(&by_direction);
                (0..3).for_each(|c| add(local, c, by[c]));
            }
            for (i, &local) in column.iter().enumerate() {
                let by: Vector3<f64> = ray.by_corner.iter().zip(of_master).map(|(by, integral)| by[i] * integral).sum();
                (0..3).for_each(|c| add(local, c, by[c]));
            }
            // through the stretches
            for (local, slope) in own_slope.iter().enumerate() {
                (0..3).for_each(|c| add(local, c, integrals[0] * slope[c]));
            }
            let by_stretch: f64 = (0..3).map(|k| grows[k] * ray.factors[k] * integrals[k + 1]).sum();
            for (&local, slope) in column.iter().zip(&stretch_slope) {
                (0..3).for_each(|c| add(local, c, by_stretch * slope[c]));
            }
            for (local, by_corner) in own.slope.iter().enumerate() {
                for (r, c) in (0..3).flat_map(|r| (0..3).map(move |c| (r, c))) {
                    rows[r * columns + 3 * local + c] += height * by_corner[(r, c)];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;

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

use super::clip::{PLANE_COORDINATES, Point};
use super::facet_pair::{PairHeights, PairIntegrals, integrate_pair};
use super::height::{AlongRay, CurvedFacet};
use super::inverse_map::Unmappable;
pub use super::plane::Settings;
use super::plane::{Coupled, FacetNormal, Plane, position};
use nalgebra::{SMatrix, SVector, Vector3};
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
    sharp: [bool; 4],
    pair: PairIntegrals,
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
    /// Paper: (15), linearised as in Popp et al. (2010).
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
        // the first pass finds the overlapping masters, to determine the local nodes; the second
        // pass computes their integrals
        self.overlapping.clear();
        let mut has_height = curved.height.is_some();
        for (index, CurvedFacet { nodes: master, height }) in candidates.clone().enumerate() {
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
            for &node in &master {
                if !self.nodes[S..].contains(&node) {
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
        let mut next = 0;
        for (index, CurvedFacet { nodes: master, height }) in candidates.enumerate() {
            if self.overlapping.get(next) != Some(&index) {
                continue;
            }
            next += 1;
            let heights = [curved.height, height];
            let added = match master[..] {
                [a, b, c] => self.add_master(&plane, &corners, &projected, &[a, b, c], heights, settings),
                [a, b, c, d] => self.add_master(&plane, &corners, &projected, &[a, b, c, d], heights, settings),
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

    /// Integrates over the overlap with one master facet.
    fn add_master<const S: usize, const M: usize>(
        &mut self,
        plane: &Plane<S>,
        corners: &[Vector3<f64>; S],
        projected: &[Point; S],
        master: &[u32; M],
        heights: PairHeights<'_>,
        Settings { x, rule, with_gradient, .. }: Settings<'_>,
    ) -> Result<(), Unmappable> {
        let points = master.map(|m| position(x, m));
        let flat = points.map(|p| plane.project(&p));
        let mut pair = std::mem::take(&mut self.pair);
        let integrated = integrate_pair(projected, &flat, heights, rule, with_gradient, &mut pair);
        if integrated == Ok(true) {
            let place: [usize; M] =
                master.map(|m| S + self.nodes[S..].iter().position(|&s| s == m).expect("collected in the first pass"));
            self.add_pair(&pair, plane, corners, &points, place, with_gradient);
            self.add_facing(&pair, plane, corners, &points, place, with_gradient);
            if heights != [None, None] {
                self.add_height(&pair, heights, plane, corners, &points, place, with_gradient);
            }
        }
        self.pair = pair;
        integrated.map(|_| ())
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

    /// Dual shapes Φ = A N with A = diag(r) m̂⁻¹, m̂ = m + diag(l), r = m̂ 1: m_jk = ∫ N_j N_k over
    /// the covered part of the facet, l_j = ∫ N_j over the rest.
    ///
    /// Then D ← A m and M ← A M. On a covered facet l = 0 and D = diag(r). As the covered part
    /// shrinks, Φ tends to N: without the uncovered part as a lumped mass, the gap on a sliver
    /// would be extrapolated to the facet's far corners. Σ_j Φ_j = 1 in either case. With a `share` s of the dual
    /// shapes below 1, A becomes s A + (1 − s) I.
    ///
    /// Tests: `coupling_gradient_matches_finite_differences`, `the_mean_gap_of_mean_shapes_is_that_at_the_node`.
    fn make_dual<const S: usize>(
        &mut self,
        plane: &Plane<S>,
        corners: &[Vector3<f64>; S],
        share: f64,
        with_gradient: bool,
    ) {
        let n = self.nodes.len();
        let whole = corner_integrals(&corners.map(|p| plane.project(&p)));
        let mass = SMatrix::<f64, S, S>::from_fn(|j, k| self.coefficient[j * n + k]);
        let rest: [f64; S] = std::array::from_fn(|j| {
            let rest = whole.value[j] - mass.row(j).sum();
            // negative where masters overlap each other
            if rest > COVERED * whole.value[j] { rest } else { 0.0 }
        });
        let completed = mass + SMatrix::from_diagonal(&SVector::from(rest));
        let Some(inverse) = completed.try_inverse() else { return };
        let sums: [f64; S] = std::array::from_fn(|j| completed.row(j).sum());
        let dual = SMatrix::<f64, S, S>::from_fn(|j, k| sums[j] * inverse[(j, k)]);
        let transform = dual * share + SMatrix::<f64, S, S>::identity() * (1.0 - share);
        let standard: Vec<f64> = self.coefficient.clone();
        for j in 0..S {
            for s in 0..n {
                self.coefficient[j * n + s] = (0..S).map(|i| transform[(j, i)] * standard[i * n + s]).sum();
            }
        }
        let heights = self.height.clone();
        if !heights.is_empty() {
            for (j, c) in (0..S).flat_map(|j| (0..3).map(move |c| (j, c))) {
                self.height[3 * j + c] = (0..S).map(|i| transform[(j, i)] * heights[3 * i + c]).sum();
            }
        }
        let facing = if share < 1.0 { self.facing.clone() } else { Vec::new() };
        if !facing.is_empty() {
            for (j, c) in (0..S).flat_map(|j| (0..3).map(move |c| (j, c))) {
                self.facing[3 * j + c] = (0..S).map(|i| transform[(j, i)] * facing[3 * i + c]).sum();
            }
        }
        if !with_gradient {
            return;
        }
        let columns = 3 * n;
        let mut whole_slope = [[0.0; 12]; S];
        for (row, slope) in whole_slope.iter_mut().zip(&whole.slope) {
            plane.chain(slope, corners, &[], |i, c, value| row[3 * i + c] += value);
        }
        let mut slopes = vec![0.0; S * n];
        for t in 0..columns {
            let slope_of = |j: usize, s: usize| self.gradient[(j * n + s) * columns + t];
            let d_mass = SMatrix::<f64, S, S>::from_fn(slope_of);
            let d_rest: [f64; S] = std::array::from_fn(|j| match rest[j] > 0.0 {
                true => whole_slope[j].get(t).unwrap_or(&0.0) - d_mass.row(j).sum(),
                false => 0.0,
            });
            let d_completed = d_mass + SMatrix::from_diagonal(&SVector::from(d_rest));
            let d_sums: [f64; S] = std::array::from_fn(|j| d_completed.row(j).sum());
            let d_transform = (SMatrix::from_diagonal(&SVector::from(d_sums)) - dual * d_completed) * inverse * share;
            for j in 0..S {
                for s in 0..n {
                    let product =
                        |i: usize| d_transform[(j, i)] * standard[i * n + s] + transform[(j, i)] * slope_of(i, s);
                    slopes[j * n + s] = (0..S).map(product).sum();
                }
            }
            for at in 0..S * n {
                self.gradient[at * columns + t] = slopes[at];
            }
            if !heights.is_empty() {
                let slopes: [f64; 12] = std::array::from_fn(|row| {
                    let (j, c) = (row / 3, row % 3);
                    let by = |i: usize| self.height_gradient[(3 * i + c) * columns + t];
                    let product = |i: usize| d_transform[(j, i)] * heights[3 * i + c] + transform[(j, i)] * by(i);
                    if j < S { (0..S).map(product).sum() } else { 0.0 }
                });
                (0..3 * S).for_each(|row| self.height_gradient[row * columns + t] = slopes[row]);
            }
            if !facing.is_empty() && !self.facing_gradient.is_empty() {
                let slopes: [f64; 12] = std::array::from_fn(|row| {
                    let (j, c) = (row / 3, row % 3);
                    let by = |i: usize| self.facing_gradient[(3 * i + c) * columns + t];
                    let product = |i: usize| d_transform[(j, i)] * facing[3 * i + c] + transform[(j, i)] * by(i);
                    if j < S { (0..S).map(product).sum() } else { 0.0 }
                });
                (0..3 * S).for_each(|row| self.facing_gradient[row * columns + t] = slopes[row]);
            }
        }
    }
}

/// An uncovered fraction of a facet below this is attributed to the error of the triangle rule on a
/// warped facet.
const COVERED: f64 = 1e-9;

/// ∫ N_j over a projected facet and its gradient in the facet's plane coordinates.
struct CornerIntegrals<const N: usize> {
    value: [f64; N],
    slope: [[f64; PLANE_COORDINATES]; N],
}

/// The area element is bilinear as well, J = Σ_i N_i J_i with J_i = ¼
/// (p_{i+1} − p_i) × (p_{i−1} − p_i), so that ∫ N_j = Σ_i m_ji J_i with the mass matrix m of the
/// parent square. On a triangle each integral is a third of the area: for the single corner i,
/// m_ji = 1/3 and J_i is half the cross product.
fn corner_integrals<const N: usize>(p: &[Point; N]) -> CornerIntegrals<N> {
    const PARENT: [f64; 4] = [4.0 / 9.0, 2.0 / 9.0, 1.0 / 9.0, 2.0 / 9.0];
    let mut out = CornerIntegrals { value: [0.0; N], slope: [[0.0; PLANE_COORDINATES]; N] };
    let (products, share) = if N == 3 { (1, 0.5) } else { (N, 0.25) };
    for i in 0..products {
        let (next, previous) = ((i + 1) % N, (i + N - 1) % N);
        let u = [p[next][0] - p[i][0], p[next][1] - p[i][1]];
        let v = [p[previous][0] - p[i][0], p[previous][1] - p[i][1]];
        let element = share * (u[0] * v[1] - u[1] * v[0]);
        let (by_next, by_previous) = ([share * v[1], -share * v[0]], [-share * u[1], share * u[0]]);
        for j in 0..N {
            let mass = if N == 3 { 1.0 / 3.0 } else { PARENT[(i + N - j) % N] };
            out.value[j] += mass * element;
            for c in 0..2 {
                out.slope[j][2 * next + c] += mass * by_next[c];
                out.slope[j][2 * previous + c] += mass * by_previous[c];
                out.slope[j][2 * i + c] -= mass * (by_next[c] + by_previous[c]);
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinematics::CellRule;
    use crate::kinematics::height::FacetHeight;

    const SHAPES: [MultiplierShape; 3] = [MultiplierShape::Standard, MultiplierShape::Dual, MultiplierShape::Mean];

    /// A warped slave facet (nodes 0–3) over a 2 × 2 patch of warped master facets (nodes 4–12)
    /// whose normals point up; the slave extends over the patch's edge if `shift` is large.
    /// Optionally, each master is replaced by two triangles.
    fn scene(shift: f64, triangles: bool) -> (Vec<f64>, Vec<FacetNodes>) {
        let mut x = vec![
            0.10, -0.10, 0.02, 0.15, 0.90, -0.03, 1.05, 1.00, 0.05, 0.95, -0.05, -0.02, //
        ];
        for node in 0..4 {
            x[3 * node] += shift;
        }
        for j in 0..3 {
            for i in 0..3 {
                let (u, v) = (-0.2 + 0.7 * i as f64, -0.3 + 0.75 * j as f64);
                x.extend([u + 0.05 * v, v - 0.04 * u, -0.05 + 0.04 * (2.0 * u + v).sin()]);
            }
        }
        let at = |i: u32, j: u32| 4 + i + 3 * j;
        let mut facets = Vec::new();
        for j in 0..2 {
            for i in 0..2 {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                match triangles {
                    true => facets.extend([[a, b, c], [a, c, d]].map(FacetNodes::from)),
                    false => facets.push([a, b, c, d].into()),
                }
            }
        }
        (x, facets)
    }

    // the slave facet faces down: 0 → 1 → 2 → 3 has its normal along −z
    const SLAVE: [u32; 4] = [0, 1, 2, 3];
    /// One triangular half of `SLAVE`.
    const HALF: [u32; 3] = [0, 1, 2];

    /// The slave facet, and whether the masters are triangles.
    fn mixtures() -> [(FacetNodes, bool); 4] {
        [(SLAVE.into(), false), (SLAVE.into(), true), (HALF.into(), false), (HALF.into(), true)]
    }

    fn evaluate(
        slave: FacetNodes,
        x: &[f64],
        facets: &[FacetNodes],
        shape: MultiplierShape,
        gradient: bool,
    ) -> FacetCoupling {
        let mut coupling = FacetCoupling::default();
        let settings =
            Settings { x, rule: &CellRule::Seven.points(), shape, reach: 1.0, trusted: 0.0, with_gradient: gradient };
        // on some facets, heights of their own
        let heights = [0.7, 1.9].map(|step| {
            let unit = [[0.0, 0.0], [0.6, 0.0], [0.6, 0.7], [0.0, 0.7]].map(|[x, y]| Vector3::new(x, y, 0.0));
            FacetHeight::new(std::array::from_fn(|i| (step * i as f64).sin()), &unit[..slave.len()])
        });
        let curved = |(i, &nodes): (usize, &FacetNodes)| CurvedFacet { nodes, height: heights.get(i % 3) };
        let slave = CurvedFacet { nodes: slave, height: Some(&heights[1]) };
        coupling.evaluate(slave, [true; 4], facets.iter().enumerate().map(curved), settings).unwrap();
        coupling
    }

    #[test]
    fn coupling_gradient_matches_finite_differences() {
        for ((slave, triangles), shift) in mixtures().into_iter().flat_map(|m| [(m, 0.0), (m, 0.6)]) {
            let (x, facets) = scene(shift, triangles);
            for shape in SHAPES {
                let base = evaluate(slave, &x, &facets, shape, true);
                let n = base.nodes.len();
                assert!(n > slave.len() + 3);
                let scale = base.coefficient.iter().fold(0.0, |m: f64, c| m.max(c.abs()));
                for t in 0..3 * n {
                    let dof = 3 * base.nodes[t / 3] as usize + t % 3;
                    let at = |h: f64| {
                        let mut moved = x.clone();
                        moved[dof] += h;
                        let moved = evaluate(slave, &moved, &facets, shape, false);
                        [moved.coefficient, moved.facing, moved.height].concat()
                    };
                    let (p1, m1, p2, m2) = (at(1e-4), at(-1e-4), at(2e-4), at(-2e-4));
                    let slopes = [base.gradient.as_slice(), &base.facing_gradient, &base.height_gradient].concat();
                    for e in 0..slave.len() * (n + 6) {
                        let fd = (8.0 * (p1[e] - m1[e]) - (p2[e] - m2[e])) / 12e-4;
                        let found = slopes[e * 3 * n + t];
                        assert!(
                            (fd - found).abs() < 2e-7 * scale.max(1.0),
                            "{slave:?} {triangles} {shape:?} entry {e} coordinate {t}: {fd} {found}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn rows_of_slave_and_master_cancel() {
        for ((slave, triangles), shape) in mixtures().into_iter().flat_map(|m| SHAPES.map(|shape| (m, shape))) {
            let (x, facets) = scene(0.6, triangles);
            let coupling = evaluate(slave, &x, &facets, shape, true);
            let n = coupling.nodes.len();
            for j in 0..slave.len() {
                let sum: f64 = coupling.coefficient[j * n..(j + 1) * n].iter().sum();
                assert!(sum.abs() < 1e-14, "{shape:?} corner {j}: Σ b = {sum}");
                for t in 0..3 * n {
                    let sum: f64 = (0..n).map(|s| coupling.gradient_row(j, s)[t]).sum();
                    assert!(sum.abs() < 1e-12, "{shape:?} corner {j}: Σ ∂b/∂x_{t} = {sum}");
                }
                // the tributary area of every corner, covered or not
                let area: f64 = coupling.coefficient[j * n..][..slave.len()].iter().sum();
                assert!(area > 0.0, "{shape:?} corner {j}: {area}");
            }
        }
    }

    /// Over a covering master, D is diagonal. As the slave moves off the edge, Φ tends to N.
    #[test]
    fn dual_shapes_diagonalise_where_covered_and_tend_to_the_standard_ones() {
        let off_diagonal = |coupling: &FacetCoupling| {
            let (n, corners) = (coupling.nodes.len(), coupling.corners);
            let entries = (0..corners).flat_map(|j| (0..corners).filter(move |&k| k != j).map(move |k| j * n + k));
            entries.map(|at| coupling.coefficient[at].abs()).fold(0.0, f64::max)
        };
        for (slave, triangles) in mixtures() {
            let (x, facets) = scene(0.0, triangles);
            let covered = evaluate(slave, &x, &facets, MultiplierShape::Dual, false);
            assert!(off_diagonal(&covered) < 1e-15, "{}", off_diagonal(&covered));
        }
        let mut last = f64::INFINITY;
        for shift in [0.7, 0.9, 1.02] {
            let (x, facets) = scene(shift, false);
            let [dual, standard] = [MultiplierShape::Dual, MultiplierShape::Standard]
                .map(|shape| evaluate(SLAVE.into(), &x, &facets, shape, false));
            assert!(!standard.nodes.is_empty());
            let size = standard.coefficient.iter().fold(0.0, |m: f64, c| m.max(c.abs()));
            let difference = standard.coefficient.iter().zip(&dual.coefficient);
            let difference = difference.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / size;
            println!("shift {shift}: largest entry {size:.1e}, difference {difference:.1e}");
            assert!(difference < 0.6 * last, "{shift}: {difference}");
            last = difference;
        }
    }

    /// By hand, at corner 0 of a unit square and of half of it, with the height r² of the distance from that corner:
    /// ∫ Φ r² is 1/12 on the square and 1/15 on the triangle with standard shapes, minus that with dual ones, and
    /// vanishes with their mean.
    #[test]
    fn the_mean_gap_of_mean_shapes_is_that_at_the_node() {
        let corners = [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]];
        let around = [[-1.0, -1.0], [2.0, -1.0], [2.0, 2.0], [-1.0, 2.0]];
        let x: Vec<f64> = corners.iter().chain(&around).flat_map(|p| [p[0], p[1], 0.0]).collect();
        for (slave, moment) in [(FacetNodes::from(SLAVE), 1.0 / 12.0), (FacetNodes::from(HALF), 1.0 / 15.0)] {
            let corners: Vec<Vector3<f64>> = slave.iter().map(|&node| position(&x, node)).collect();
            let mut values = [0.0; 25];
            for (value, weights) in values.iter_mut().zip(slipstick_mesh::control_points(slave.len())) {
                let point: Vector3<f64> = corners.iter().zip(weights).map(|(corner, weight)| corner * weight).sum();
                *value = point.norm_squared();
            }
            let height = FacetHeight::new(values, &corners);
            for (shape, factor) in SHAPES.into_iter().zip([1.0, -1.0, 0.0]) {
                let rule = &CellRule::Twelve.points();
                let settings = Settings { x: &x, rule, shape, reach: 1.0, trusted: 0.0, with_gradient: false };
                let mut coupling = FacetCoupling::default();
                let masters = std::iter::once(FacetNodes::from([4, 5, 6, 7]).into());
                let curved = CurvedFacet { nodes: slave, height: Some(&height) };
                coupling.evaluate(curved, [false; 4], masters, settings).unwrap();
                // along the normal of the facet, which points down, and times its stretch
                let found = -coupling.height[2];
                assert!((found - factor * moment).abs() < 1e-14, "{slave:?} {shape:?}: {found}");
            }
        }
    }

    /// Computed by hand: for corners of a unit square under a master plane that covers it, `facing`
    /// is minus the plane's normal, each on a quarter of the square.
    #[test]
    fn corners_on_sharp_edges_see_the_master() {
        let mut x = vec![0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0, 0.0, 0.0];
        let (a, b) = (0.3, -0.2);
        x.extend(
            [[-1.0, -1.0], [2.0, -1.0], [2.0, 2.0], [-1.0, 2.0]].iter().flat_map(|p| [p[0], p[1], a * p[0] + b * p[1]]),
        );
        let coupling = evaluate(SLAVE.into(), &x, &[[4, 5, 6, 7].into()], MultiplierShape::Standard, false);
        let normal = Vector3::new(-a, -b, 1.0).normalize();
        for j in 0..4 {
            let seen = Vector3::from_row_slice(&coupling.facing[3 * j..][..3]);
            assert!((seen + 0.25 * normal).norm() < 1e-15, "corner {j}: {seen}");
        }
    }

    /// D and M are areas and their derivatives lengths, so they scale with the square and the first
    /// power of the unit of length. The unit is a power of two, so that scaling the input does not
    /// change its digits.
    #[test]
    fn rows_do_not_depend_on_the_unit_of_length() {
        let unit = 0.5f64.powi(14);
        for ((slave, triangles), shape) in mixtures().into_iter().flat_map(|m| SHAPES.map(|shape| (m, shape))) {
            let (x, facets) = scene(0.6, triangles);
            let small: Vec<f64> = x.iter().map(|x| unit * x).collect();
            let [one, other] = [x, small].map(|x| evaluate(slave, &x, &facets, shape, true));
            assert_eq!(one.nodes, other.nodes);
            let close = |a: &[f64], b: &[f64], factor: f64| {
                let size = a.iter().fold(0.0, |m: f64, a| m.max(a.abs()));
                a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b / factor).abs() <= 1e-13 * size)
            };
            assert!(close(&one.coefficient, &other.coefficient, unit * unit), "{slave:?} {triangles} {shape:?}");
            assert!(close(&one.gradient, &other.gradient, unit), "{slave:?} {triangles} {shape:?}");
            assert!(close(&one.facing, &other.facing, unit * unit), "{slave:?} {triangles} {shape:?}");
        }
    }

    /// A facet that is folded into an arrowhead is an error if it may touch, and is ignored if it
    /// is farther away.
    #[test]
    fn a_folded_facet_is_named_where_it_may_touch() {
        let at = |height: f64| {
            // is counter-clockwise seen from above, so that its normal points up to the slave
            let arrow = [[-0.5, -0.5], [0.4, 0.4], [1.5, -0.5], [0.5, 1.5]];
            let mut x = scene(0.0, false).0[..12].to_vec();
            x.extend(arrow.iter().flat_map(|p| [p[0], p[1], height]));
            let mut coupling = FacetCoupling::default();
            let candidates = std::iter::once(FacetNodes::from([4, 5, 6, 7]).into());
            let rule = &CellRule::Seven.points();
            let settings = Settings {
                x: &x,
                rule,
                shape: MultiplierShape::Standard,
                reach: 10.0,
                trusted: 0.0,
                with_gradient: false,
            };
            coupling.evaluate(FacetNodes::from(SLAVE).into(), [false; 4], candidates, settings)
        };
        assert_eq!(at(-0.1), Err(FoldedFacet([4, 5, 6, 7].into())));
        assert_eq!(at(-5.0), Ok(()));
    }

    /// Computed by hand: a master square of size 20 whose centre is offset sideways by 9 still
    /// covers a slave square of size 0.1.
    #[test]
    fn a_large_master_couples_aside_of_its_centre() {
        let mut x = vec![0.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.1, 0.1, 0.0, 0.1, 0.0, 0.0];
        x.extend([[-1.0, -10.0], [19.0, -10.0], [19.0, 10.0], [-1.0, 10.0]].iter().flat_map(|p| [p[0], p[1], -0.2]));
        let coupling = evaluate(SLAVE.into(), &x, &[[4, 5, 6, 7].into()], MultiplierShape::Standard, false);
        assert_eq!(coupling.nodes.len(), 8);
        let area: f64 = (0..4).flat_map(|j| &coupling.coefficient[8 * j..][..4]).sum();
        assert!((area - 0.01).abs() < 1e-15, "{area}");
    }
}

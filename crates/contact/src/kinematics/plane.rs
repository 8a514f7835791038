//! The auxiliary plane of a slave facet: projection onto it, its derivative, and selection of the
//! master facets that couple.

use super::cell_rule::CellPoint;
use super::clip::{PLANE_COORDINATES, Point, clip, overlap};
use super::coupling::MultiplierShape;
use super::facet_pair::reversed;
use super::inverse_map::folded;
use nalgebra::{Matrix3, Vector3};
use slipstick_mesh::FacetNodes;

pub(super) fn position(x: &[f64], node: u32) -> Vector3<f64> {
    let at = 3 * node as usize;
    Vector3::new(x[at], x[at + 1], x[at + 2])
}

fn mean<const N: usize>(corners: &[Vector3<f64>; N]) -> Vector3<f64> {
    corners[1..].iter().fold(corners[0], |sum, p| sum + p) * (1.0 / N as f64)
}

/// The two vectors whose cross product is the normal at a facet's centre, as corner numbers of
/// their start and end: the diagonals of a quadrilateral, two edges of a triangle.
const fn spans<const N: usize>() -> [[usize; 2]; 2] {
    if N == 3 { [[0, 1], [0, 2]] } else { [[0, 2], [1, 3]] }
}

/// Both of them.
fn spanning<const N: usize>(corners: &[Vector3<f64>; N]) -> [Vector3<f64>; 2] {
    spans::<N>().map(|[start, end]| corners[end] - corners[start])
}

/// Centre of a facet and the distance of its farthest corner.
fn ball<const N: usize>(corners: &[Vector3<f64>; N]) -> (Vector3<f64>, f64) {
    let centre = mean(corners);
    (centre, corners.iter().map(|p| (p - centre).norm_squared()).fold(0.0, f64::max).sqrt())
}

/// Cosine of the angle from the opposite direction (84°) beyond which a master facet is seen
/// edge-on, so that its projection is meaningless.
const EDGE_ON: f64 = 0.1;

/// Options for coupling a slave facet with master facets, and their positions.
#[derive(Debug, Clone, Copy)]
pub struct Settings<'a> {
    /// Current positions, three per node. \[L\]
    pub x: &'a [f64],
    /// Integration rule of the cells.
    pub rule: &'a [CellPoint],
    /// Shape functions of the multipliers.
    pub shape: MultiplierShape,
    /// Distance along the slave normal within which facets are coupled. \[L\]
    pub reach: f64,
    /// Penetration up to which facets are coupled without asking whether the slave lies inside the
    /// master's body. \[L\]
    pub trusted: f64,
    /// Whether gradients are computed.
    pub with_gradient: bool,
}

/// Unit normal n of a facet at its centre, and its derivative with respect to each corner.
pub(super) struct FacetNormal<const N: usize> {
    pub normal: Vector3<f64>,
    /// `slope[i]` = ∂n/∂x_i. \[1/L\]
    pub slope: [Matrix3<f64>; N],
}

impl<const N: usize> FacetNormal<N> {
    /// `None` for a collapsed facet.
    pub fn of(corners: &[Vector3<f64>; N]) -> Option<Self> {
        let [a, b] = spanning(corners);
        let cross = a.cross(&b);
        let length = cross.norm();
        if !(length > 0.0) {
            return None;
        }
        let normal = cross / length;
        let along = (Matrix3::identity() - normal * normal.transpose()) / length;
        // δ(a × b) = a × δb − b × δa
        let by_span = [-along * b.cross_matrix(), along * a.cross_matrix()];
        let mut slope = [Matrix3::zeros(); N];
        for ([start, end], by) in spans::<N>().into_iter().zip(by_span) {
            slope[start] -= by;
            slope[end] += by;
        }
        Some(Self { normal, slope })
    }
}

/// Whether a master facet is coupled.
pub(super) enum Coupled {
    No,
    Yes,
    FoldedMaster,
    FoldedSlave,
}

/// The auxiliary plane of a slave facet of S corners.
pub(super) struct Plane<const S: usize> {
    origin: Vector3<f64>,
    normal: Vector3<f64>,
    axes: [Vector3<f64>; 2],
    /// `tilt[a][i]` = ∂(e_a · n₀)/∂x_i at fixed e_a, for the corners i. \[1/L\]
    tilt: [[Vector3<f64>; S]; 2],
    radius: f64,
}

impl<const S: usize> Plane<S> {
    /// The normal at the centre of a bilinear facet is that of its diagonals' cross product; a
    /// triangle has one normal.
    pub fn of(corners: &[Vector3<f64>; S]) -> Option<Self> {
        let [a, b] = spanning(corners);
        let cross = a.cross(&b);
        let length = cross.norm();
        if !(length > 0.0) {
            return None;
        }
        let normal = cross / length;
        let first = (a - normal * normal.dot(&a)).normalize();
        let axes = [first, normal.cross(&first)];
        let tilt = axes.map(|e| {
            let mut tilt = [Vector3::zeros(); S];
            for ([start, end], slope) in spans::<S>().into_iter().zip([b.cross(&e) / length, e.cross(&a) / length]) {
                tilt[start] -= slope;
                tilt[end] += slope;
            }
            tilt
        });
        let (origin, radius) = ball(corners);
        Some(Self { origin, normal, axes, tilt, radius })
    }

    pub fn project(&self, p: &Vector3<f64>) -> Point {
        let d = p - self.origin;
        [self.axes[0].dot(&d), self.axes[1].dot(&d)]
    }

    /// Cosine of the angle between n₀ and a facet's normal; 0 for a collapsed facet.
    pub fn cosine<const M: usize>(&self, facet: &[Vector3<f64>; M]) -> f64 {
        let [a, b] = spanning(facet);
        a.cross(&b).try_normalize(0.0).map_or(0.0, |normal| normal.dot(&self.normal))
    }

    /// Height of a point above the plane, along n₀. \[L\]
    pub fn height(&self, p: &Vector3<f64>) -> f64 {
        self.normal.dot(&(p - self.origin))
    }

    /// Converts a gradient in the plane coordinates of a pair to one in positions: calls `add` with
    /// corner (from 4 on for the master), component and value.
    #[inline]
    pub fn chain<const M: usize>(
        &self,
        slope: &[f64; PLANE_COORDINATES],
        corners: &[Vector3<f64>; S],
        points: &[Vector3<f64>; M],
        mut add: impl FnMut(usize, usize, f64),
    ) {
        let mut tilt = [0.0; 2];
        let masters = points.iter().enumerate().map(|(i, point)| (4 + i, point));
        for (i, point) in corners.iter().enumerate().chain(masters) {
            let slope = [slope[2 * i], slope[2 * i + 1]];
            let height = self.height(point);
            for a in 0..2 {
                tilt[a] -= height * slope[a];
            }
            for c in 0..3 {
                add(i, c, slope[0] * self.axes[0][c] + slope[1] * self.axes[1][c]);
            }
        }
        for i in 0..S {
            for c in 0..3 {
                add(i, c, tilt[0] * self.tilt[0][i][c] + tilt[1] * self.tilt[1][i][c]);
            }
        }
    }

    /// Converts a gradient in the heights of points above the plane to one in positions: calls `add` with the local
    /// node of a point, which is that of the corner for the first S, component and value. The gradient's sum is zero,
    /// so that it does not depend on the plane's origin.
    pub fn chain_heights(
        &self,
        slopes: impl Iterator<Item = (usize, Vector3<f64>, f64)>,
        mut add: impl FnMut(usize, usize, f64),
    ) {
        let mut tilt = [0.0; 2];
        for (local, point, slope) in slopes {
            // δh = n₀ · δx + Σ_a q_a (e_a · δn₀)
            let at = self.project(&point);
            (0..2).for_each(|a| tilt[a] += at[a] * slope);
            (0..3).for_each(|c| add(local, c, slope * self.normal[c]));
        }
        for i in 0..S {
            for c in 0..3 {
                add(i, c, tilt[0] * self.tilt[0][i][c] + tilt[1] * self.tilt[1][i][c]);
            }
        }
    }

    /// Whether a master facet is coupled with the slave facet, which is `projected` onto the plane.
    pub fn overlaps<const M: usize>(
        &self,
        projected: &[Point; S],
        master: &[u32; M],
        Settings { x, reach, .. }: Settings<'_>,
    ) -> Coupled {
        let points = master.map(|n| position(x, n));
        if !self.may_couple(&points, reach) {
            return Coupled::No;
        }
        let flat = points.map(|p| self.project(&p));
        let order = reversed::<M>();
        let turned = order.map(|i| flat[i]);
        if !overlap(projected, &turned) {
            return Coupled::No;
        }
        let near = self.is_near(&points);
        match (folded(&turned), near) {
            (true, true) => Coupled::FoldedMaster,
            (true, false) => Coupled::No,
            (false, true) if folded(projected) => Coupled::FoldedSlave,
            (false, _) => Coupled::Yes,
        }
    }

    /// Whether a master facet faces the slave facet, is within reach along the normal and close in
    /// the plane.
    ///
    /// The decision is invariant under rigid motion of the pair.
    fn may_couple<const M: usize>(&self, master: &[Vector3<f64>; M], reach: f64) -> bool {
        let (centre, radius) = ball(master);
        let offset = centre - self.origin;
        let height = self.normal.dot(&offset);
        let sideways = (offset - self.normal * height).norm();
        if height.abs() > reach + radius || sideways > self.radius + radius {
            return false;
        }
        let [a, b] = spanning(master);
        let facing = a.cross(&b);
        self.normal.dot(&facing) < -EDGE_ON * facing.norm()
    }

    /// Whether the slave facet lies outside the master's body although the master facet is behind it:
    /// the line along n₀ from the master facet leaves the master's body through another of the
    /// `masters` before it reaches the slave facet. Checked at the centre of the overlap, and only
    /// for penetrations beyond those that a step can cause and the size of the facets.
    ///
    /// Test: `a_slave_facet_does_not_touch_what_lies_behind_it` (interface.rs).
    pub fn is_behind(
        &self,
        projected: &[Point; S],
        master: &FacetNodes,
        masters: impl Iterator<Item = FacetNodes>,
        Settings { x, trusted, .. }: Settings<'_>,
    ) -> bool {
        let Some(depth) = (match master[..] {
            [a, b, c] => self.depth(projected, &[a, b, c].map(|n| position(x, n))),
            [a, b, c, d] => self.depth(projected, &[a, b, c, d].map(|n| position(x, n))),
            _ => None,
        }) else {
            return false;
        };
        let (at, below) = depth;
        let leaves = |other: FacetNodes| match other[..] {
            [a, b, c] => self.passed(&[a, b, c].map(|n| position(x, n)), at),
            [a, b, c, d] => self.passed(&[a, b, c, d].map(|n| position(x, n)), at),
            _ => None,
        };
        below < -trusted && masters.filter_map(leaves).any(|height| height < 0.0 && height > below)
    }

    /// Centre of the overlap with a master facet that is not near, and the facet's height there.
    fn depth<const M: usize>(&self, projected: &[Point; S], master: &[Vector3<f64>; M]) -> Option<(Point, f64)> {
        if self.height(&mean(master)) >= 0.0 || self.is_near(master) {
            return None;
        }
        let order = reversed::<M>();
        let overlap = clip(projected, &order.map(|i| self.project(&master[i])), &order)?;
        let (vertices, share) = (overlap.vertices(), 1.0 / overlap.vertices().len() as f64);
        let at = [0, 1].map(|c| share * vertices.iter().map(|vertex| vertex.position[c]).sum::<f64>());
        Some((at, self.height_at(master, at)))
    }

    /// Height at which the line through `at` along n₀ passes a facet that looks in the direction of
    /// n₀; `None` if it does not.
    fn passed<const M: usize>(&self, facet: &[Vector3<f64>; M], at: Point) -> Option<f64> {
        let [a, b] = spanning(facet);
        let cross = a.cross(&b);
        if self.normal.dot(&cross) <= 0.0 {
            return None;
        }
        let flat = facet.map(|p| self.project(&p));
        let left = |i: usize| {
            let (p, q) = (flat[i], flat[(i + 1) % M]);
            (q[0] - p[0]) * (at[1] - p[1]) - (q[1] - p[1]) * (at[0] - p[0]) >= 0.0
        };
        (0..M).all(left).then(|| self.height_at(facet, at))
    }

    /// Height at the point `at` of the mean plane of a facet that is not parallel to n₀.
    fn height_at<const M: usize>(&self, facet: &[Vector3<f64>; M], at: Point) -> f64 {
        let [a, b] = spanning(facet);
        let cross = a.cross(&b);
        let point = self.origin + self.axes[0] * at[0] + self.axes[1] * at[1];
        cross.dot(&(mean(facet) - point)) / cross.dot(&self.normal)
    }

    /// Whether the bounding spheres of the two facets intersect.
    fn is_near<const M: usize>(&self, master: &[Vector3<f64>; M]) -> bool {
        let (centre, radius) = ball(master);
        (centre - self.origin).norm() <= self.radius + radius
    }
}

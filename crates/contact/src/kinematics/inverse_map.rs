//! Maps points of the auxiliary plane back to a projected facet and evaluates the shape functions
//! there.

use super::clip::Point;

/// Corner signs of the bilinear shape functions N_i = ¼ (1 + ξ_i ξ)(1 + η_i η).
const CORNER: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];

/// A point has no preimage on a projected facet, which is degenerate or folded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unmappable;

/// Negative Jacobian of the bilinear map at a corner, relative to that at the centre, beyond which
/// a quadrilateral counts as folded. Below it, clipping cuts off the fold at the corner, about a
/// hundredth of the area.
const FOLD: f64 = 0.1;

/// Whether a counter-clockwise quadrilateral is folded: much of it has no preimage, or several, on
/// the facet.
///
/// A triangle is never folded: it keeps its orientation, or does not face the slave.
pub fn folded<const N: usize>(p: &[Point; N]) -> bool {
    let [a, b, c, d] = p[..] else { return false };
    let p = [a, b, c, d];
    let jacobian = |i: usize| {
        let (next, previous) = (p[(i + 1) % 4], p[(i + 3) % 4]);
        let (u, v) = ([next[0] - p[i][0], next[1] - p[i][1]], [previous[0] - p[i][0], previous[1] - p[i][1]]);
        0.25 * (u[0] * v[1] - u[1] * v[0])
    };
    let corners: [f64; 4] = std::array::from_fn(jacobian);
    // J is linear in ξ and in η without a mixed term
    let centre = 0.25 * corners.iter().sum::<f64>();
    corners.iter().any(|&j| j < -FOLD * centre.abs())
}

/// Number of points that are mapped back together.
pub(super) const POINTS: usize = 8;

/// One number for each of some points.
pub(super) type AtPoints = [f64; POINTS];

/// Points mapped back to a facet.
#[derive(Clone, Copy)]
pub(super) struct Images {
    pub shape: [AtPoints; 4],
    /// ∂N_i/∂y: gradient in the auxiliary plane.
    pub slope: [[AtPoints; 2]; 4],
}

impl Images {
    const NONE: Self = Self { shape: [[0.0; POINTS]; 4], slope: [[[0.0; POINTS]; 2]; 4] };

    /// Shape functions and their gradients at one of the points.
    #[inline(always)]
    pub fn at(&self, point: usize) -> ([f64; 4], [[f64; 2]; 4]) {
        (self.shape.map(|shape| shape[point]), self.slope.map(|slope| slope.map(|slope| slope[point])))
    }
}

/// Points mapped back to a facet of N corners, each as it would be alone.
#[inline(always)]
pub(super) fn map_back<const N: usize>(p: &[Point; N], y: &[AtPoints; 2]) -> Result<Images, Unmappable> {
    match p[..] {
        [a, b, c] => map_back_triangle(&[a, b, c], y),
        [a, b, c, d] => map_back_quadrilateral(&[a, b, c, d], y),
        _ => Err(Unmappable),
    }
}

/// Area coordinates `y = Σ N_i p_i`, Σ N_i = 1, with their gradients, which are constant.
#[inline(always)]
fn map_back_triangle(p: &[Point; 3], y: &[AtPoints; 2]) -> Result<Images, Unmappable> {
    let edge = |i: usize| [p[(i + 2) % 3][0] - p[(i + 1) % 3][0], p[(i + 2) % 3][1] - p[(i + 1) % 3][1]];
    let (u, v) = (edge(2), edge(1));
    let twice_area = u[1] * v[0] - u[0] * v[1];
    if !(twice_area > 0.0) {
        return Err(Unmappable);
    }
    let mut images = Images::NONE;
    for i in 0..3 {
        let (along, start) = (edge(i), p[(i + 1) % 3]);
        let slope = [-along[1] / twice_area, along[0] / twice_area];
        images.slope[i] = slope.map(|slope| [slope; POINTS]);
        for l in 0..POINTS {
            images.shape[i][l] = (y[0][l] - start[0]) * slope[0] + (y[1][l] - start[1]) * slope[1];
        }
    }
    Ok(images)
}

/// Inverse of the bilinear map `y = Σ N_i(ξ) p_i` by Newton's method, with the gradients of the
/// shape functions.
///
/// [`Unmappable`] if the quadrilateral is degenerate or so warped that Newton's method leaves it.
#[inline(always)]
fn map_back_quadrilateral(p: &[Point; 4], y: &[AtPoints; 2]) -> Result<Images, Unmappable> {
    let square = |u: Point| u[0] * u[0] + u[1] * u[1];
    let diagonal = |i: usize| square([p[i][0] - p[i + 2][0], p[i][1] - p[i + 2][1]]);
    let round_off = 1e-18 * diagonal(0).max(diagonal(1));
    let mut xi = [[0.0; POINTS]; 2];
    // 1 while a point moves, then 0
    let mut moves = [1.0; POINTS];
    for _ in 0..30 {
        let mut images = Images::NONE;
        let mut residual = *y;
        let mut jacobian = [[[0.0; POINTS]; 2]; 2];
        for i in 0..4 {
            for l in 0..POINTS {
                let (a, b) = (1.0 + CORNER[i][0] * xi[0][l], 1.0 + CORNER[i][1] * xi[1][l]);
                let (shape, slope) = (0.25 * a * b, [0.25 * CORNER[i][0] * b, 0.25 * CORNER[i][1] * a]);
                for c in 0..2 {
                    residual[c][l] -= shape * p[i][c];
                    jacobian[c][0][l] += slope[0] * p[i][c];
                    jacobian[c][1][l] += slope[1] * p[i][c];
                    images.slope[i][c][l] = slope[c];
                }
                images.shape[i][l] = shape;
            }
        }
        let mut det = [0.0; POINTS];
        for l in 0..POINTS {
            det[l] = jacobian[0][0][l] * jacobian[1][1][l] - jacobian[0][1][l] * jacobian[1][0][l];
        }
        if !det.iter().all(|&det| det > 0.0) {
            return Err(Unmappable);
        }
        if moves == [0.0; POINTS] {
            // ∂N/∂y = J⁻ᵀ ∂N/∂ξ
            for [s, t] in &mut images.slope {
                for l in 0..POINTS {
                    (s[l], t[l]) = (
                        (s[l] * jacobian[1][1][l] - t[l] * jacobian[1][0][l]) / det[l],
                        (-s[l] * jacobian[0][1][l] + t[l] * jacobian[0][0][l]) / det[l],
                    );
                }
            }
            return Ok(images);
        }
        let mut farthest: f64 = 0.0;
        for l in 0..POINTS {
            let step = [
                (jacobian[1][1][l] * residual[0][l] - jacobian[0][1][l] * residual[1][l]) / det[l],
                (-jacobian[1][0][l] * residual[0][l] + jacobian[0][0][l] * residual[1][l]) / det[l],
            ];
            let moving = moves[l] > 0.0;
            for c in 0..2 {
                xi[c][l] += if moving { step[c] } else { 0.0 };
                farthest = if xi[c][l].abs() > farthest { xi[c][l].abs() } else { farthest };
            }
            // quadratic convergence: after this step only round-off is left, so evaluate there and stop
            let there = square([residual[0][l], residual[1][l]]) <= round_off;
            moves[l] = if there { 0.0 } else { moves[l] };
        }
        if farthest > 10.0 {
            return Err(Unmappable);
        }
    }
    Err(Unmappable)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A kite whose obtuse corner is pushed in. Computed by hand: J = −y/2 at that corner and
    /// (1 − y)/4 at the centre.
    #[test]
    fn folded_quadrilaterals_are_told_from_convex_ones() {
        let kite = |y: f64| [[0.0, y], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]];
        for (y, is_folded) in [(-1.0, false), (0.0, false), (0.04, false), (0.06, true), (0.9, true)] {
            for turn in 0..4 {
                let p: [Point; 4] = std::array::from_fn(|i| kite(y)[(i + turn) % 4]);
                assert_eq!(folded(&p), is_folded, "{y}");
            }
        }
        assert!(folded(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]), "a bow tie");
    }

    /// Compared with the map itself: a point with given coordinates on a facet has the shape
    /// functions of these coordinates, up to the rounding of the positions, for any position of the
    /// facet and any unit of length.
    #[test]
    fn points_come_back_from_the_bilinear_map() {
        for (offset, unit) in [([0.0, 0.0], 1.0), ([3e5, -2e5], 1.0), ([-4e5, 1e5], 1e-6), ([0.0, 0.0], 1e6)] {
            let p = [[0.0, 0.1], [1.0, -0.2], [1.7, 1.9], [-0.4, 0.8]]
                .map(|q: Point| [unit * (q[0] + offset[0]), unit * (q[1] + offset[1])]);
            for xi in [[0.9, 0.9], [-1.0, 1.0], [0.95, -0.8], [-0.3, 0.2], [-0.9, -0.95]] {
                let shape = CORNER.map(|[a, b]| 0.25 * (1.0 + a * xi[0]) * (1.0 + b * xi[1]));
                let y = [0, 1].map(|c| (0..4).map(|i| shape[i] * p[i][c]).sum::<f64>());
                // the other points of the group lie elsewhere
                let all = [0, 1].map(|c| std::array::from_fn(|l| if l == 5 { y[c] } else { p[l % 4][c] }));
                let found = map_back(&p, &all).map(|images| images.at(5).0).unwrap();
                let rounding = 1e-15 * (10.0 + offset[0].abs() + offset[1].abs());
                assert!((0..4).all(|i| (found[i] - shape[i]).abs() < rounding), "{found:?} instead of {shape:?}");
            }
        }
    }

    /// A point more than ten widths away from the facet has no preimage on it: the centres of
    /// overlapping slave and master facets are closer.
    #[test]
    fn points_far_off_have_no_place() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let of = |y: Point| map_back(&square, &y.map(|y| [y; POINTS]));
        assert!(of([3.0, -2.0]).is_ok());
        for y in [[30.0, 0.5], [0.5, -30.0], [-30.0, 0.2], [0.9, 30.0]] {
            assert_eq!(of(y).err(), Some(Unmappable), "{y:?}");
        }
    }
}

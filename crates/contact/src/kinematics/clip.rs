//! Overlap of two triangles or convex quadrilaterals in the auxiliary plane, with the derivative of
//! every vertex.
//!
//! Sutherland–Hodgman clipping of the projected slave facet by the four edges of the projected
//! master facet. Each edge of the polygon stores the line on which it lies, so that each vertex of
//! the result is known either as a corner of one facet or as the intersection of two lines, and can
//! be differentiated accordingly. Reference: Puso and Laursen, CMAME 193 (2004) 601–629; Popp et
//! al., IJNME 83 (2010) 1428–1465.

/// A point or vector in the auxiliary plane.
pub type Point = [f64; 2];

/// Number of plane coordinates of a facet pair: 4 slave corners, then 4 master corners, two
/// coordinates each. The entries of a triangle's fourth corner are unused.
pub const PLANE_COORDINATES: usize = 16;

/// Distances below this fraction of the facet size count as "on the line". It makes coincident
/// edges well defined (their intersection would otherwise be noise) at the cost of a relative area
/// error of the same size.
const ON_LINE: f64 = 1e-12;

/// A vertex of the overlap and its derivative with respect to the 16 plane coordinates of the pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vertex {
    /// Position in the auxiliary plane. \[L\]
    pub position: Point,
    /// `gradient[a][q]` = ∂position_a / ∂(plane coordinate q). Dimensionless.
    pub gradient: [[f64; PLANE_COORDINATES]; 2],
}

/// The line that an edge lies on: through corner `i` and `i + 1` of one of the two facets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Line {
    Slave(usize),
    Master(usize),
}

/// The overlap polygon: at most 8 vertices, counter-clockwise.
#[derive(Debug, Clone)]
pub struct Overlap {
    vertices: [Vertex; 8],
    count: usize,
}

impl Overlap {
    /// The vertices, counter-clockwise.
    pub fn vertices(&self) -> &[Vertex] {
        &self.vertices[..self.count]
    }
}

#[derive(Clone, Copy)]
struct Corner {
    position: Point,
    /// Line of the edge that starts at this corner.
    leaving: Line,
}

/// Clips the slave facet with S corners by the master facet with M corners.
///
/// Both are given counter-clockwise in the auxiliary plane. `master_order[i]` is the facet's own
/// number of the i-th master corner, used for the columns of the vertex gradients. Returns `None`
/// if nothing is left, or less than a triangle of relative size 1e-12.
///
/// Test: `vertex_gradients_match_finite_differences`, `overlap_of_shifted_squares`.
pub fn clip<const S: usize, const M: usize>(
    slave: &[Point; S],
    master: &[Point; M],
    master_order: &[usize; M],
) -> Option<Overlap> {
    let (polygon, count) = polygon(slave, master)?;
    let mut overlap =
        Overlap { vertices: [Vertex { position: [0.0; 2], gradient: [[0.0; PLANE_COORDINATES]; 2] }; 8], count };
    for i in 0..count {
        let entering = polygon[(i + count - 1) % count].leaving;
        overlap.vertices[i] = vertex(polygon[i].position, entering, polygon[i].leaving, slave, master, master_order);
    }
    Some(overlap)
}

/// Whether [`clip`] leaves anything.
pub fn overlap<const S: usize, const M: usize>(slave: &[Point; S], master: &[Point; M]) -> bool {
    polygon(slave, master).is_some()
}

/// The corners that are left, and their number.
fn polygon<const S: usize, const M: usize>(slave: &[Point; S], master: &[Point; M]) -> Option<([Corner; 12], usize)> {
    let size = extent(slave).max(extent(master));
    let tolerance = ON_LINE * size;
    let mut polygon = [Corner { position: [0.0; 2], leaving: Line::Slave(0) }; 12];
    let mut count = S;
    for i in 0..S {
        polygon[i] = Corner { position: slave[i], leaving: Line::Slave(i) };
    }
    for edge in 0..M {
        count = clip_by_edge(&mut polygon, count, master, edge, tolerance);
        if count < 3 {
            return None;
        }
    }
    count = drop_short_edges(&mut polygon, count, tolerance);
    if !(3..=8).contains(&count) || area(&polygon[..count]) <= tolerance * size {
        return None;
    }
    Some((polygon, count))
}

/// Cuts the polygon by the half plane left of the master edge; returns the new number of corners.
fn clip_by_edge<const M: usize>(
    polygon: &mut [Corner; 12],
    count: usize,
    master: &[Point; M],
    edge: usize,
    tolerance: f64,
) -> usize {
    let (a, b) = (master[edge], master[(edge + 1) % M]);
    let length = (b[0] - a[0]).hypot(b[1] - a[1]);
    if length == 0.0 {
        return count;
    }
    let distance = |p: Point| ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])) / length;
    let mut out = [polygon[0]; 12];
    let mut kept = 0;
    let mut push = |corner: Corner| {
        // a convex polygon cut by a line gains at most one corner; more means a non-convex facet
        if kept < 12 {
            out[kept] = corner;
            kept += 1;
        }
    };
    for i in 0..count {
        let (from, to) = (polygon[i], polygon[(i + 1) % count]);
        let (d0, d1) = (distance(from.position), distance(to.position));
        let (inside0, inside1) = (d0 >= -tolerance, d1 >= -tolerance);
        let crossing = || {
            let t = d0 / (d0 - d1);
            [
                from.position[0] + t * (to.position[0] - from.position[0]),
                from.position[1] + t * (to.position[1] - from.position[1]),
            ]
        };
        match (inside0, inside1) {
            (true, true) => push(from),
            (true, false) => {
                if d0 <= tolerance {
                    push(Corner { position: from.position, leaving: Line::Master(edge) });
                } else {
                    push(from);
                    push(Corner { position: crossing(), leaving: Line::Master(edge) });
                }
            }
            (false, true) => {
                // a corner on the line starts the next edge itself
                if d1 > tolerance {
                    push(Corner { position: crossing(), leaving: from.leaving });
                }
            }
            (false, false) => {}
        }
    }
    *polygon = out;
    kept
}

/// Removes corners whose outgoing edge is shorter than the tolerance; returns the new number of
/// corners.
fn drop_short_edges(polygon: &mut [Corner; 12], count: usize, tolerance: f64) -> usize {
    let mut kept = 0;
    let source = *polygon;
    for i in 0..count {
        let next = source[(i + 1) % count].position;
        let here = source[i];
        if (next[0] - here.position[0]).abs() + (next[1] - here.position[1]).abs() > tolerance {
            polygon[kept] = here;
            kept += 1;
        }
    }
    kept
}

fn vertex<const S: usize, const M: usize>(
    position: Point,
    entering: Line,
    leaving: Line,
    slave: &[Point; S],
    master: &[Point; M],
    master_order: &[usize; M],
) -> Vertex {
    let mut gradient = [[0.0; PLANE_COORDINATES]; 2];
    let mut corner = |column: usize| {
        gradient[0][column] = 1.0;
        gradient[1][column + 1] = 1.0;
    };
    match (entering, leaving) {
        (Line::Slave(i), Line::Slave(j)) if (i + 1) % S == j => corner(2 * j),
        (Line::Master(i), Line::Master(j)) if (i + 1) % M == j => corner(8 + 2 * master_order[j]),
        _ => {
            let end = |line: Line, which: usize| match line {
                Line::Slave(i) => (slave[(i + which) % S], 2 * ((i + which) % S)),
                Line::Master(i) => (master[(i + which) % M], 8 + 2 * master_order[(i + which) % M]),
            };
            crossing_gradient(
                &mut gradient,
                position,
                [end(entering, 0), end(entering, 1)],
                [end(leaving, 0), end(leaving, 1)],
            );
        }
    }
    Vertex { position, gradient }
}

/// Derivative of the intersection p of two lines a₀a₁ and b₀b₁ with respect to their four end
/// points.
///
/// p satisfies (a₁ − a₀) × (p − a₀) = 0 and (b₁ − b₀) × (p − b₀) = 0; both are differentiated and
/// solved for δp.
fn crossing_gradient(
    gradient: &mut [[f64; PLANE_COORDINATES]; 2],
    p: Point,
    a: [(Point, usize); 2],
    b: [(Point, usize); 2],
) {
    let u = [a[1].0[0] - a[0].0[0], a[1].0[1] - a[0].0[1]];
    let v = [b[1].0[0] - b[0].0[0], b[1].0[1] - b[0].0[1]];
    let det = u[0] * v[1] - u[1] * v[0];
    if det.abs() <= 1e-10 * (u[0].hypot(u[1])) * (v[0].hypot(v[1])) {
        // The lines coincide: sliding along them does not change the area, so the vertex moves with
        // the first one.
        for (c, row) in gradient.iter_mut().enumerate() {
            let squared = u[0] * u[0] + u[1] * u[1];
            let t = ((p[0] - a[0].0[0]) * u[0] + (p[1] - a[0].0[1]) * u[1]) / squared;
            row[a[0].1 + c] = 1.0 - t;
            row[a[1].1 + c] = t;
        }
        return;
    }
    // a × δp = r_a and b × δp = r_b, where r is the cross product of the line and its own motion at
    // p: δp = (v r_a − u r_b) / det
    for (line, direction, sign) in [(a, v, 1.0), (b, u, -1.0)] {
        let (start, end) = (line[0], line[1]);
        // with t the position of p along the line, moving the start by δ moves the line at p by
        // (1 − t) δ, the end by t δ
        let along = [end.0[0] - start.0[0], end.0[1] - start.0[1]];
        let squared = along[0] * along[0] + along[1] * along[1];
        let t = ((p[0] - start.0[0]) * along[0] + (p[1] - start.0[1]) * along[1]) / squared;
        for ((_, column), share) in [(start, 1.0 - t), (end, t)] {
            for c in 0..2 {
                // along × δ for δ = unit vector c
                let cross = if c == 0 { -along[1] } else { along[0] };
                for r in 0..2 {
                    gradient[r][column + c] += sign * share * cross * direction[r] / det;
                }
            }
        }
    }
}

/// The longer diagonal of a quadrilateral, the longest edge of a triangle.
fn extent<const N: usize>(points: &[Point; N]) -> f64 {
    let d = |i: usize, j: usize| (points[i][0] - points[j][0]).hypot(points[i][1] - points[j][1]);
    let distances = if N == 3 { 3 } else { 2 };
    (0..distances).map(|i| d(i, (i + 2) % N)).fold(0.0, f64::max)
}

fn area(corners: &[Corner]) -> f64 {
    let origin = corners[0].position;
    let mut twice = 0.0;
    for k in 1..corners.len() - 1 {
        let (p, q) = (corners[k].position, corners[k + 1].position);
        twice += (p[0] - origin[0]) * (q[1] - origin[1]) - (p[1] - origin[1]) * (q[0] - origin[0]);
    }
    0.5 * twice
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const ORDER: [usize; 4] = [0, 1, 2, 3];
    const SQUARE: [Point; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

    fn overlap_area(overlap: &Overlap) -> f64 {
        let v = overlap.vertices();
        (0..v.len())
            .map(|i| {
                let (p, q) = (v[i].position, v[(i + 1) % v.len()].position);
                0.5 * (p[0] * q[1] - p[1] * q[0])
            })
            .sum()
    }

    #[test]
    fn overlap_of_shifted_squares() {
        let shifted = SQUARE.map(|p| [p[0] + 0.25, p[1] - 0.5]);
        let overlap = clip(&SQUARE, &shifted, &ORDER).unwrap();
        assert_eq!(overlap.vertices().len(), 4);
        assert!((overlap_area(&overlap) - 0.75 * 0.5).abs() < 1e-15);
    }

    #[test]
    fn identical_and_disjoint_squares() {
        let overlap = clip(&SQUARE, &SQUARE, &ORDER).unwrap();
        assert!((overlap_area(&overlap) - 1.0).abs() < 1e-15);
        assert!(clip(&SQUARE, &SQUARE.map(|p| [p[0] + 1.0, p[1]]), &ORDER).is_none(), "touching edges do not overlap");
        assert!(clip(&SQUARE, &SQUARE.map(|p| [p[0] + 2.0, p[1]]), &ORDER).is_none());
    }

    #[test]
    fn rotated_square_gives_an_octagon() {
        let c = std::f64::consts::FRAC_1_SQRT_2;
        let turned = SQUARE.map(|p| {
            let q = [p[0] - 0.5, p[1] - 0.5];
            [0.5 + c * (q[0] - q[1]), 0.5 + c * (q[0] + q[1])]
        });
        let overlap = clip(&SQUARE, &turned, &ORDER).unwrap();
        assert_eq!(overlap.vertices().len(), 8);
        // regular octagon of inradius 1/2: area 8 (√2 − 1) / 4
        assert!((overlap_area(&overlap) - 2.0 * (2f64.sqrt() - 1.0)).abs() < 1e-14);
    }

    fn quad() -> impl Strategy<Value = [Point; 4]> {
        (prop::array::uniform8(-0.15f64..0.15), -0.6f64..0.6, -0.6f64..0.6, 0.0f64..6.3, 0.5f64..1.5).prop_map(
            |(jitter, x, y, angle, scale)| {
                let mut out = [[0.0; 2]; 4];
                for (i, corner) in [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]].iter().enumerate() {
                    let q = [scale * (corner[0] + jitter[2 * i]), scale * (corner[1] + jitter[2 * i + 1])];
                    out[i] = [x + angle.cos() * q[0] - angle.sin() * q[1], y + angle.sin() * q[0] + angle.cos() * q[1]];
                }
                out
            },
        )
    }

    /// The first three corners of a quadrilateral.
    fn triangle(quad: &[Point; 4]) -> [Point; 3] {
        [quad[0], quad[1], quad[2]]
    }

    /// Computed by hand: half of the unit square below its diagonal, cut by the lines of a
    /// triangle.
    #[test]
    fn overlap_of_triangles() {
        let half = triangle(&SQUARE);
        let order = [0, 1, 2];
        assert!((overlap_area(&clip(&half, &half, &order).unwrap()) - 0.5).abs() < 1e-15);
        assert!((overlap_area(&clip(&half, &SQUARE, &ORDER).unwrap()) - 0.5).abs() < 1e-15);
        assert!((overlap_area(&clip(&SQUARE, &half, &order).unwrap()) - 0.5).abs() < 1e-15);
        let other = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        let overlap = clip(&half, &other, &order).unwrap();
        assert_eq!(overlap.vertices().len(), 3);
        assert!((overlap_area(&overlap) - 0.25).abs() < 1e-15);
        assert!(clip(&half, &other.map(|p| [p[0] - 1.0, p[1]]), &order).is_none());
    }

    fn vertex_gradients<const S: usize, const M: usize>(
        slave: [Point; S],
        master: [Point; M],
        order: [usize; M],
    ) -> Result<(), TestCaseError> {
        let Some(base) = clip(&slave, &master, &order) else { return Ok(()) };
        let h = 1e-6;
        for q in (0..2 * S).chain(8..8 + 2 * M) {
            let moved = |step: f64| {
                let (mut s, mut m) = (slave, master);
                if q < 8 {
                    s[q / 2][q % 2] += step;
                } else {
                    let own = (q - 8) / 2;
                    let i = order.iter().position(|&o| o == own).unwrap();
                    m[i][q % 2] += step;
                }
                clip(&s, &m, &order)
            };
            let (Some(plus), Some(minus)) = (moved(h), moved(-h)) else { continue };
            if plus.count != base.count || minus.count != base.count {
                continue;
            }
            for i in 0..base.count {
                for a in 0..2 {
                    let fd = (plus.vertices[i].position[a] - minus.vertices[i].position[a]) / (2.0 * h);
                    let an = base.vertices[i].gradient[a][q];
                    // the intersection of nearly parallel edges can move without bound: compare
                    // relatively
                    let jump = (plus.vertices[i].position[a] - base.vertices[i].position[a]).abs();
                    if an.abs() > 50.0 || jump > 1e-3 {
                        continue;
                    }
                    prop_assert!((fd - an).abs() < 1e-4 * (1.0 + an.abs()), "vertex {i}[{a}] q{q}: {fd} {an}");
                }
            }
        }
        Ok(())
    }

    /// Direction of the slave's bottom edge in the tests of intersections: not along an axis, with
    /// round components.
    const ALONG: Point = [0.8, 0.6];

    /// The vertex where the bottom edges of two facets intersect at the angle `slope`: at 0.3 of
    /// the slave's edge and 0.4 of the master's. All lengths are multiplied by `scale`.
    fn crossing_at(slope: f64, scale: f64) -> Vertex {
        let turned =
            |p: Point| [scale * (ALONG[0] * p[0] - ALONG[1] * p[1]), scale * (ALONG[1] * p[0] + ALONG[0] * p[1])];
        let slave = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]].map(turned);
        let master = [[-1.0, -1.6 * slope], [3.0, 2.4 * slope], [3.0, 2.0], [-1.0, 2.0]].map(turned);
        let overlap = clip(&slave, &master, &ORDER).unwrap();
        assert_eq!(overlap.vertices().len(), 5);
        let exact = turned([0.6, 0.0]);
        let apart = |v: &&Vertex| (v.position[0] - exact[0]).hypot(v.position[1] - exact[1]) < 1e-3 * scale;
        *overlap.vertices().iter().find(apart).unwrap()
    }

    /// Computed by hand, in any unit of length: if edges coincide up to an angle of 3e-11, the
    /// intersection stays at 0.3 of the slave's edge. It moves by 0.7 of the motion of the edge's
    /// start and by 0.3 of the motion of its end.
    #[test]
    fn a_crossing_of_coinciding_edges_rides_on_the_first() {
        for scale in [1e-3, 1.0, 1e3] {
            let crossing = crossing_at(3e-11, scale);
            for (r, row) in crossing.gradient.iter().enumerate() {
                for (q, found) in row.iter().enumerate() {
                    let exact = [0.7, 0.3].get(q / 2).filter(|_| q % 2 == r).unwrap_or(&0.0);
                    assert!((found - exact).abs() < 1e-4, "scale {scale}: {found} instead of {exact} in [{r}][{q}]");
                }
            }
        }
    }

    /// Computed by hand, in any unit of length: edges at an angle s of 3e-10 do not coincide. If
    /// one of them moves across, the intersection moves along by 1/s times that distance.
    #[test]
    fn a_crossing_of_nearly_coinciding_edges_moves_along_them() {
        for scale in [1e-3, 1.0, 1e3] {
            let slope = 3e-10;
            let Vertex { gradient, .. } = crossing_at(slope, scale);
            for (corner, share) in [(0, 0.7), (1, 0.3), (4, -0.6), (5, -0.4)] {
                let by_motion_across = gradient.map(|row| ALONG[0] * row[2 * corner + 1] - ALONG[1] * row[2 * corner]);
                let found = slope * (ALONG[0] * by_motion_across[0] + ALONG[1] * by_motion_across[1]);
                assert!((found - share).abs() < 1e-4, "scale {scale}: {found} instead of {share} at corner {corner}");
            }
        }
    }

    proptest! {
        /// Central differences of every vertex, if the topology of the overlap does not change
        /// within the step.
        #[test]
        fn vertex_gradients_match_finite_differences(slave in quad(), master in quad()) {
            vertex_gradients(slave, master, [2, 1, 3, 0])?;
            vertex_gradients(triangle(&slave), master, [2, 1, 3, 0])?;
            vertex_gradients(slave, triangle(&master), [2, 0, 1])?;
            vertex_gradients(triangle(&slave), triangle(&master), [2, 0, 1])?;
        }

        /// Cutting a square by a quadrilateral and by its complement pieces: area lies between 0
        /// and the smaller one, and does not depend on which of the two is the slave; the areas of
        /// the two triangles of a quadrilateral add up to it.
        #[test]
        fn overlap_area_is_symmetric(slave in quad(), master in quad()) {
            let a = clip(&slave, &master, &ORDER).map_or(0.0, |o| overlap_area(&o));
            let b = clip(&master, &slave, &ORDER).map_or(0.0, |o| overlap_area(&o));
            prop_assert!((a - b).abs() < 1e-11, "{a} {b}");
            let (half, rest) = (triangle(&slave), [slave[0], slave[2], slave[3]]);
            let parts = [half, rest].map(|part| clip(&part, &master, &ORDER).map_or(0.0, |o| overlap_area(&o)));
            prop_assert!((parts[0] + parts[1] - a).abs() < 1e-11, "{parts:?} {a}");
            let turned = clip(&master, &half, &[0, 1, 2]).map_or(0.0, |o| overlap_area(&o));
            prop_assert!((parts[0] - turned).abs() < 1e-11, "{parts:?} {turned}");
        }
    }
}

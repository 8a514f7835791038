//! Mortar integrals of a pair of facets in dual numbers, which give their derivatives without
//! differences. Only the points of the triangle rule are taken from the crate.

use nalgebra::{SMatrix, Vector3};
use num_dual::{Dual64, DualNum};
use slipstick_contact::kinematics::CellRule;

/// A number with its derivative in one direction.
pub type Number = Dual64;
type Point = [Number; 2];
type Position = [Number; 3];

fn number(value: f64) -> Number {
    Number::from(value)
}

/// Positions moved in the direction of coordinate `t`, or not at all.
pub fn positions(x: &[Vector3<f64>], t: Option<usize>) -> Vec<Position> {
    let eps = |i: usize, c: usize| f64::from(t == Some(3 * i + c));
    x.iter().enumerate().map(|(i, p)| std::array::from_fn(|c| Number::new(p[c], eps(i, c)))).collect()
}

fn minus(a: &Position, b: &Position) -> Position {
    std::array::from_fn(|c| a[c] - b[c])
}

fn dot(a: &Position, b: &Position) -> Number {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: &Position, b: &Position) -> Position {
    std::array::from_fn(|c| {
        let (d, e) = ((c + 1) % 3, (c + 2) % 3);
        a[d] * b[e] - a[e] * b[d]
    })
}

fn unit(a: Position) -> Position {
    let length = dot(&a, &a).sqrt();
    a.map(|x| x / length)
}

/// Shape functions and their derivatives with respect to the parent coordinates: bilinear for four
/// corners, linear for three.
fn shapes(corners: usize, [xi, eta]: Point) -> (Vec<Number>, Vec<Point>) {
    let one = number(1.0);
    if corners == 3 {
        let slopes = [[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]].map(|s| s.map(number));
        return (vec![one - xi - eta, xi, eta], slopes.to_vec());
    }
    let signs = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let factors = signs.map(|[a, b]| [one + xi * a, one + eta * b]);
    let values = factors.iter().map(|[a, b]| *a * *b * 0.25).collect();
    let slopes = signs.iter().zip(&factors).map(|(s, f)| [f[1] * (0.25 * s[0]), f[0] * (0.25 * s[1])]).collect();
    (values, slopes)
}

/// Plane through the mean of the slave's corners with its normal at the parent's centre: origin,
/// axes, normal. The axes rotate with the facet's first edge, which does not affect the integrals.
fn plane(slave: &[Position]) -> (Position, [Position; 2], Position) {
    let centre = if slave.len() == 3 { [number(1.0 / 3.0); 2] } else { [number(0.0); 2] };
    let (values, slopes) = shapes(slave.len(), centre);
    let sum = |weights: &dyn Fn(usize) -> Number| -> Position {
        std::array::from_fn(|c| (0..slave.len()).fold(number(0.0), |s, i| s + weights(i) * slave[i][c]))
    };
    let origin = sum(&|i| values[i]);
    let [a, b] = [0, 1].map(|d| sum(&|i| slopes[i][d]));
    let normal = unit(cross(&a, &b));
    let edge = minus(&slave[1], &slave[0]);
    let height = dot(&edge, &normal);
    let first = unit(std::array::from_fn(|c| edge[c] - height * normal[c]));
    (origin, [first, cross(&normal, &first)], normal)
}

fn area_of(a: &Point, b: &Point, c: &Point) -> Number {
    ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) * 0.5
}

/// The part of a polygon left of the line from `a` to `b`.
fn cut(polygon: &[Point], a: &Point, b: &Point) -> Vec<Point> {
    let mut kept = Vec::new();
    for (i, from) in polygon.iter().enumerate() {
        let to = &polygon[(i + 1) % polygon.len()];
        let (side, next) = (area_of(a, b, from), area_of(a, b, to));
        if side.re >= 0.0 {
            kept.push(*from);
        }
        if (side.re >= 0.0) != (next.re >= 0.0) {
            let t = side / (side - next);
            kept.push([from[0] + (to[0] - from[0]) * t, from[1] + (to[1] - from[1]) * t]);
        }
    }
    kept
}

/// Area and centroid of a polygon.
fn moments(polygon: &[Point]) -> (Number, Point) {
    let (mut area, mut first) = (number(0.0), [number(0.0); 2]);
    for i in 1..polygon.len().saturating_sub(1) {
        let (a, b, c) = (&polygon[0], &polygon[i], &polygon[i + 1]);
        let part = area_of(a, b, c);
        area += part;
        for d in 0..2 {
            first[d] += (a[d] + b[d] + c[d]) * part / 3.0;
        }
    }
    (area, first.map(|m| m / area))
}

/// Shape functions of the facet with these corners at a point of the plane.
fn back(corners: &[Point], at: &Point) -> Vec<Number> {
    let mut parent = if corners.len() == 3 { [number(1.0 / 3.0); 2] } else { [number(0.0); 2] };
    for _ in 0..12 {
        let (values, slopes) = shapes(corners.len(), parent);
        let (mut rest, mut jacobian) = (*at, [[number(0.0); 2]; 2]);
        for (i, corner) in corners.iter().enumerate() {
            for c in 0..2 {
                rest[c] -= values[i] * corner[c];
                (0..2).for_each(|d| jacobian[c][d] += slopes[i][d] * corner[c]);
            }
        }
        let [[a, b], [c, d]] = jacobian;
        let det = a * d - b * c;
        parent[0] += (d * rest[0] - b * rest[1]) / det;
        parent[1] += (a * rest[1] - c * rest[0]) / det;
    }
    shapes(corners.len(), parent).0
}

/// The expected results for a pair.
pub struct Pair {
    /// b_js of the slave's corners j over the slave's corners, then the master's. Empty where
    /// nothing overlaps. \[L²\]
    pub rows: Vec<Vec<Number>>,
    /// Of the overlap in the auxiliary plane. \[L²\]
    pub area: Number,
    /// Normal of the auxiliary plane.
    pub normal: Vector3<f64>,
}

/// Integrals over the overlap of a slave and a master facet, which run counter-clockwise seen from
/// outside their bodies.
pub fn pair(slave: &[Position], master: &[Position], rule: CellRule) -> Pair {
    let (origin, axes, normal) = plane(slave);
    let flat = |facet: &[Position]| -> Vec<Point> {
        facet.iter().map(|p| [0, 1].map(|a| dot(&axes[a], &minus(p, &origin)))).collect()
    };
    let (slave, master) = (flat(slave), flat(master));
    let mut overlap = slave.clone();
    for i in 0..master.len() {
        overlap = cut(&overlap, &master[(i + 1) % master.len()], &master[i]);
    }
    let mut found = Pair { rows: Vec::new(), area: number(0.0), normal: normal.map(|x| x.re).into() };
    if overlap.len() < 3 {
        return found;
    }
    let (area, centre) = moments(&overlap);
    found.area = area;
    found.rows = vec![vec![number(0.0); slave.len() + master.len()]; slave.len()];
    for i in 0..overlap.len() {
        let cell = [centre, overlap[i], overlap[(i + 1) % overlap.len()]];
        for point in rule.points() {
            let at = [0, 1].map(|c| (0..3).fold(number(0.0), |s, v| s + cell[v][c] * point.barycentric[v]));
            let (first, second) = (back(&slave, &at), back(&master, &at));
            let weight = area_of(&cell[0], &cell[1], &cell[2]) * point.weight;
            for (row, shape) in found.rows.iter_mut().zip(&first) {
                let factors = first.iter().copied().chain(second.iter().map(|s| -*s));
                row.iter_mut().zip(factors).for_each(|(entry, factor)| *entry += weight * *shape * factor);
            }
        }
    }
    found
}

/// Rows of dual shapes from those of the standard ones, on a slave triangle: Φ = A N, A = diag(r)
/// m̂⁻¹, where m̂ is the covered mass with that of the uncovered part lumped, and r its row sums.
pub fn dual_triangle(rows: &[Vec<Number>], slave: &[Position]) -> Vec<Vec<Number>> {
    let (_, [first, second], _) = plane(slave);
    let edges = [minus(&slave[1], &slave[0]), minus(&slave[2], &slave[0])].map(|e| [dot(&first, &e), dot(&second, &e)]);
    let third = area_of(&[number(0.0); 2], &edges[0], &edges[1]) / 3.0;
    let covered = |j: usize| rows[j][0] + rows[j][1] + rows[j][2];
    let mass = SMatrix::<Number, 3, 3>::from_fn(|j, k| {
        let rest = third - covered(j);
        if j == k && rest.re > 1e-9 * third.re { rows[j][k] + rest } else { rows[j][k] }
    });
    // the inverse's columns are cross products of the rows over the determinant
    let row = |j: usize| -> Position { [mass[(j, 0)], mass[(j, 1)], mass[(j, 2)]] };
    let columns = [cross(&row(1), &row(2)), cross(&row(2), &row(0)), cross(&row(0), &row(1))];
    let det = dot(&row(0), &columns[0]);
    let transform = |j: usize, k: usize| (mass[(j, 0)] + mass[(j, 1)] + mass[(j, 2)]) * columns[k][j] / det;
    let entry = |j: usize, s: usize| (0..3).fold(number(0.0), |sum, k| sum + transform(j, k) * rows[k][s]);
    (0..3).map(|j| (0..rows[0].len()).map(|s| entry(j, s)).collect()).collect()
}

//! Shape functions and integration points of the reference element's parent domains.

use crate::law::Real;
use std::array::from_fn;

/// Corner i of the parent cube.
fn corner(i: usize) -> [f64; 3] {
    [(i ^ (i >> 1)) & 1, (i >> 1) & 1, i >> 2].map(|bit| 2.0 * bit as f64 - 1.0)
}

/// Parent coordinates of the nodes of a hex27: corners, edges, faces −x, +x, −y, +y, −z, +z, centre.
pub(super) fn node_of_27(i: usize) -> [f64; 3] {
    let mean = |a: usize, b: usize| from_fn(|c| 0.5 * (corner(a)[c] + corner(b)[c]));
    match i {
        0..8 => corner(i),
        8..12 => mean(i - 8, (i - 7) % 4),
        12..16 => mean(i - 8, 4 + (i - 11) % 4),
        16..20 => mean(i - 16, i - 12),
        20..26 => from_fn(|c| if c == (i - 20) / 2 { 2.0 * ((i - 20) % 2) as f64 - 1.0 } else { 0.0 }),
        _ => [0.0; 3],
    }
}

/// Shape functions of a tetrahedron, wedge or hexahedron, by its number of nodes, at a point of the
/// parent element.
pub(super) fn shapes<T: Real>(nodes: usize, [x, y, z]: [T; 3]) -> Vec<T> {
    let (one, half) = (T::from(1.0), |sign: f64, x: T| T::from(0.5) + T::from(0.5 * sign) * x);
    // Lagrange polynomials through −1, 0, 1
    let line = |node: f64, x: T| match node {
        0.0 => (one + x) * (one - x),
        _ => T::from(0.5 * node) * x * (one + T::from(node) * x),
    };
    match nodes {
        4 => vec![one - x - y - z, x, y, z],
        10 => {
            let l = [one - x - y - z, x, y, z];
            let corners = l.map(|l| l * (l + l - one)).into_iter();
            let edges = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)];
            corners.chain(edges.map(|(a, b)| T::from(4.0) * l[a] * l[b])).collect()
        }
        18 => {
            // corner or edge of the triangle, and place on the axis
            let across = |i: usize| match ([one - x - y, x, y], i) {
                (l, 0..3) => l[i] * (l[i] + l[i] - one),
                (l, _) => T::from(4.0) * l[i - 3] * l[(i - 2) % 3],
            };
            let levels = [(0, -1.0), (0, 1.0), (3, -1.0), (3, 1.0), (0, 0.0), (3, 0.0)];
            levels
                .into_iter()
                .flat_map(|(first, at)| (first..first + 3).map(move |i| across(i) * line(at, z)))
                .collect()
        }
        27 => (0..27).map(node_of_27).map(|[a, b, c]| line(a, x) * line(b, y) * line(c, z)).collect(),
        6 => (0..6).map(|i| [one - x - y, x, y][i % 3] * half([-1.0, 1.0][i / 3], z)).collect(),
        _ => (0..8).map(corner).map(|[a, b, c]| half(a, x) * half(b, y) * half(c, z)).collect(),
    }
}

/// Points of the parent element and their weights. Those of a wedge are the points of a cube in
/// which two edges are collapsed to points.
pub(super) fn quadrature(nodes: usize) -> Vec<([f64; 3], f64)> {
    let gauss = (0..8).map(|i| corner(i).map(|sign| sign / 3.0_f64.sqrt()));
    let line = |i: usize| [(-0.6_f64.sqrt(), 5.0), (0.0, 8.0), (0.6_f64.sqrt(), 5.0)][i];
    match nodes {
        4 => vec![([0.25; 3], 1.0 / 6.0)],
        10 => {
            // two orbits of the tetrahedron's symmetry: Felippa, Engrg. Comput. 21 (2004) 867–890
            let orbit = |a: f64, weight: f64| {
                (0..4).map(move |far| (from_fn(|c| if c + 1 == far { 1.0 - 3.0 * a } else { a }), weight / 6.0))
            };
            let first = orbit(0.3281633025163817, 0.1362178425370874);
            first.chain(orbit(0.1080472498984286, 0.1137821574629126)).collect()
        }
        18 => {
            let triangle = |i: usize| [[1.0, 1.0], [4.0, 1.0], [1.0, 4.0]][i].map(|sixth| sixth / 6.0);
            let point = |[x, y]: [f64; 2], (z, weight): (f64, f64)| ([x, y, z], weight / 54.0);
            (0..9).map(|i| point(triangle(i % 3), line(i / 3))).collect()
        }
        27 => {
            let point = |[x, y, z]: [(f64, f64); 3]| ([x.0, y.0, z.0], x.1 * y.1 * z.1 / 729.0);
            (0..27).map(|i| point([i % 3, i / 3 % 3, i / 9].map(line))).collect()
        }
        6 => gauss.map(|[x, y, z]| ([0.25 * (1.0 + x) * (1.0 - y), 0.5 * (1.0 + y), z], 0.125 * (1.0 - y))).collect(),
        _ => gauss.map(|point| (point, 1.0)).collect(),
    }
}

//! The points of a facet above which the height of the smooth surface is given.

/// The four shape functions at the control points of a facet with three or four corners: the points of
/// a lattice with five on each edge, row by row from the first edge.
pub fn control_points(corners: usize) -> Vec<[f64; 4]> {
    let point = |i: usize, j: usize| {
        let (x, y) = (0.25 * i as f64, 0.25 * j as f64);
        match corners {
            3 => [1.0 - x - y, x, y, 0.0],
            _ => [(1.0 - x) * (1.0 - y), x * (1.0 - y), x * y, (1.0 - x) * y],
        }
    };
    let last = |j: usize| if corners == 3 { 4 - j } else { 4 };
    (0..5).flat_map(|j| (0..=last(j)).map(move |i| point(i, j))).collect()
}

/// How far a point of a facet follows the middles of the edges, as the quadratic or biquadratic
/// interpolation that vanishes at the corners; the centre of a quadrilateral follows them as that of
/// a Coons patch, with half their sum.
pub(super) fn bulges(shape: &[f64]) -> [f64; 4] {
    match *shape {
        [a, b, c] => [4.0 * a * b, 4.0 * b * c, 4.0 * c * a, 0.0],
        [_, b, c, d] => {
            let of = |x: f64| [(1.0 - x) * (1.0 - 2.0 * x), 4.0 * x * (1.0 - x), x * (2.0 * x - 1.0)];
            let (x, y) = (of(b + c), of(c + d));
            let centre = 0.5 * x[1] * y[1];
            [x[1] * y[0] + centre, x[2] * y[1] + centre, x[1] * y[2] + centre, x[0] * y[1] + centre]
        }
        _ => [0.0; 4],
    }
}

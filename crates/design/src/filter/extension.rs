//! The void beyond the free faces of a design domain, as a filter sees it.

use rayon::prelude::*;

use super::neighbours::{CellGrid, with_images};

/// A triangle, its corners counterclockwise seen from outside the domain. \[L\]
pub type Triangle = [[f64; 3]; 3];

/// For each centroid X: ∫ w dV of the weight w = r − ‖x − X‖ over that part of its ball of radius r
/// which rays from X reach through the faces. \[L⁴\]
///
/// The integral along a ray from a face at the distance s to the end of the ball is G(s) = ∫_s^r (r
/// − t) t² dt; over the directions, with the solid angle n·d/s³ dA of a face,
///
/// `∫ G(s) n·d/s³ dA,   d = x − X,   s = ‖d‖,   G(s) = r⁴/12 − r s³/3 + s⁴/4`
///
/// A ray that leaves the domain and enters it again counts only outside. Faces across `planes` are
/// seen, too. Test: `a_box_and_the_void_around_it_fill_the_ball`.
pub(super) fn weights_beyond(
    centroids: &[[f64; 3]],
    radius: f64,
    planes: &[(usize, f64)],
    faces: &[Triangle],
) -> Vec<f64> {
    let centres: Vec<[f64; 3]> = faces.iter().map(centre).collect();
    let largest = faces.iter().map(size).fold(0.0, f64::max);
    let reach = radius + largest;
    let grid = CellGrid::new(&centres, reach);
    let beyond = |centroid: &[f64; 3]| -> f64 {
        let (places, _) = with_images(std::slice::from_ref(centroid), reach, planes);
        let near = |place: &[f64; 3]| -> f64 {
            let found = grid.within(&centres, place, reach);
            found.iter().map(|&(face, _)| through(place, &faces[face as usize], radius, MAX_DIVISIONS)).sum()
        };
        places.iter().map(near).sum::<f64>().max(0.0)
    };
    centroids.par_iter().map(beyond).collect()
}

/// A triangle is divided until it is smaller than this, relative to its distance.
const SMALL: f64 = 0.2;

/// How often a triangle is divided in four at most.
const MAX_DIVISIONS: usize = 6;

/// The integral over one triangle.
fn through(x: &[f64; 3], triangle: &Triangle, radius: f64, divisions: usize) -> f64 {
    let (at, size) = (distance(x, &centre(triangle)), size(triangle));
    if at - size >= radius {
        return 0.0;
    }
    if divisions > 0 && size > SMALL * at {
        return divided(triangle).iter().map(|part| through(x, part, radius, divisions - 1)).sum();
    }
    let [a, b, c] = *triangle;
    // n dA
    let area = cross(sub(&b, &a), sub(&c, &a)).map(|component| 0.5 * component);
    let value = |&(weight, [u, v, w]): &(f64, [f64; 3])| {
        let point: [f64; 3] = std::array::from_fn(|k| u * a[k] + v * b[k] + w * c[k]);
        let d = sub(&point, x);
        let s = dot(&d, &d).sqrt();
        if s >= radius {
            return 0.0;
        }
        let along_ray = radius.powi(4) / 12.0 - radius * s.powi(3) / 3.0 + s.powi(4) / 4.0;
        weight * along_ray * dot(&area, &d) / s.powi(3)
    };
    POINTS.iter().map(value).sum()
}

/// Weights and barycentric coordinates of Radon's rule of degree 5.
const POINTS: [(f64, [f64; 3]); 7] = {
    const A: f64 = 0.470_142_064_105_115_1;
    const B: f64 = 0.101_286_507_323_456_3;
    const WA: f64 = 0.132_394_152_788_506_2;
    const WB: f64 = 0.125_939_180_544_827_2;
    [
        (0.225, [1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0]),
        (WA, [A, A, 1.0 - 2.0 * A]),
        (WA, [A, 1.0 - 2.0 * A, A]),
        (WA, [1.0 - 2.0 * A, A, A]),
        (WB, [B, B, 1.0 - 2.0 * B]),
        (WB, [B, 1.0 - 2.0 * B, B]),
        (WB, [1.0 - 2.0 * B, B, B]),
    ]
};

/// Four similar triangles.
fn divided(&[a, b, c]: &Triangle) -> [Triangle; 4] {
    let middle = |p: [f64; 3], q: [f64; 3]| std::array::from_fn(|k| 0.5 * (p[k] + q[k]));
    let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}

fn centre([a, b, c]: &Triangle) -> [f64; 3] {
    std::array::from_fn(|k| (a[k] + b[k] + c[k]) / 3.0)
}

/// Largest distance of a corner from the centre.
fn size(triangle: &Triangle) -> f64 {
    let centre = centre(triangle);
    triangle.iter().map(|corner| distance(corner, &centre)).fold(0.0, f64::max)
}

fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    let d = sub(a, b);
    dot(&d, &d).sqrt()
}

fn sub(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// The surface of a box, without the side at the lower end of the axes in `open`.
    pub(crate) fn surface(size: [f64; 3], open: &[usize]) -> Vec<Triangle> {
        let mut faces = Vec::new();
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for high in [false, true] {
                if !high && open.contains(&axis) {
                    continue;
                }
                let corner = |a: bool, b: bool| {
                    let mut x = [0.0; 3];
                    x[axis] = if high { size[axis] } else { 0.0 };
                    x[u] = if a { size[u] } else { 0.0 };
                    x[v] = if b { size[v] } else { 0.0 };
                    x
                };
                let [p, q, r, s] = [corner(false, false), corner(true, false), corner(true, true), corner(false, true)];
                faces.extend(if high { [[p, q, r], [p, r, s]] } else { [[p, r, q], [p, s, r]] });
            }
        }
        faces
    }

    /// Whatever the position and radius: the weight inside, summed over small cubes, and the weight
    /// beyond the faces add up to π r⁴/3.
    #[test]
    fn a_box_and_the_void_around_it_fill_the_ball() {
        let size = [1.0, 0.7, 0.9];
        let faces = surface(size, &[]);
        for (x, radius) in
            [([0.5, 0.35, 0.45], 0.3), ([0.1, 0.2, 0.3], 0.4), ([0.05, 0.05, 0.04], 0.6), ([0.9, 0.3, 0.1], 2.0)]
        {
            let beyond = weights_beyond(&[x], radius, &[], &faces)[0];
            let cells = 120;
            let step = size.map(|length| length / f64::from(cells));
            let mut inside = 0.0;
            for i in 0..cells {
                for j in 0..cells {
                    for k in 0..cells {
                        let at = [i, j, k].map(|n| f64::from(n) + 0.5);
                        let point: [f64; 3] = std::array::from_fn(|axis| at[axis] * step[axis]);
                        inside += (radius - distance(&point, &x)).max(0.0);
                    }
                }
            }
            inside *= step.iter().product::<f64>();
            let ball = PI * radius.powi(4) / 3.0;
            assert!(((inside + beyond) / ball - 1.0).abs() < 1e-4, "{x:?} {radius}: {inside} + {beyond} for {ball}");
        }
    }

    /// A plane at the distance a cuts off ∫_a^r (r − s) 2π s (s − a) ds.
    #[test]
    fn the_weight_beyond_a_plane() {
        let face = |x: f64| {
            [
                [[-9.0, 0.0, -9.0], [-9.0, 0.0, 9.0], [9.0, 0.0, 9.0]],
                [[-9.0, 0.0, -9.0], [9.0, 0.0, 9.0], [9.0, 0.0, -9.0]],
            ]
            .map(|t: Triangle| t.map(|[a, _, b]| [a, x, b]))
        };
        let (radius, a) = (1.5_f64, 0.5_f64);
        let antiderivative = |s: f64| -s.powi(4) / 4.0 + (radius + a) * s.powi(3) / 3.0 - radius * a * s * s / 2.0;
        let expected = 2.0 * PI * (antiderivative(radius) - antiderivative(a));
        let found = weights_beyond(&[[0.3, 0.0, 0.2]], radius, &[], &face(a))[0];
        assert!((found / expected - 1.0).abs() < 2e-4, "{found} for {expected}");
    }
}

//! Nodal frames on the slave surface: averaged normal and a pair of tangents that rotate with the
//! material.
//!
//! ```text
//! n_j = s / ‖s‖,  s = Σ_facets around j  (unit normal of the facet at its corner j)
//! τ^ξ = (I − n nᵀ) e / ‖·‖  with e the current edge from j to a fixed neighbour,      τ^η = n × τ^ξ
//! ```
//!
//! Because the edge is a material line, components in (τ^ξ, τ^η) are objective history: a rigid
//! rotation, even one about the normal, leaves them unchanged.
//!
//! At an edge of the slave surface that is sharper than the feature angle there is no single
//! normal. Each of the smooth patches that meet there has its own frame, whose normal is opposite
//! to that of the master facets that it faces:
//!
//! ```text
//! n_j = m / ‖m‖,  m = −Σ_master facets p  n_p ∫ N_j over the overlap with p,     τ^ξ = (I − n nᵀ) τ̄^ξ / ‖·‖
//! ```
//!
//! with τ̄^ξ the tangent of the patch's own averaged frame. An edge that slides on a flat face then
//! has the normal of that face, regardless of which of the two is the slave. With a normal cone, the
//! projection of m onto it takes the place of m, also where the slave surface ends at an edge of its
//! body ([`super::cone`]).
//!
//! On a symmetry plane, the frame is that of the whole body: s without its component normal to the
//! plane, which the facets on the other side cancel, and τ^ξ normal to the plane.

use nalgebra::{Matrix3, Vector3};

/// One corner of a slave facet at the node: positions in the node's ring of the node itself, the
/// next and the previous corner of the facet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RingCorner {
    /// Ring position of the node itself.
    pub own: usize,
    /// Ring position of the next corner, counter-clockwise seen from outside.
    pub next: usize,
    /// Ring position of the previous corner.
    pub previous: usize,
}

/// Orthonormal basis at a slave node with its gradient.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct NodalFrame {
    /// Rows: outward unit normal n, tangents τ^ξ and τ^η.
    pub basis: Matrix3<f64>,
    /// ∂basis/∂x: row `3 b + c` holds the derivative of component c of basis vector b with respect
    /// to the coordinates of the leading nodes of the row's support: of the ring, or of all at a
    /// sharp edge. \[1/L\]. Empty if no gradient was requested.
    pub gradient: Vec<f64>,
    /// The tangents that are normal to a symmetry plane: there is no slip and no traction along
    /// them.
    pub across: [bool; 2],
}

impl NodalFrame {
    /// Basis vector b (0 normal, 1 and 2 tangents).
    pub fn vector(&self, b: usize) -> Vector3<f64> {
        self.basis.row(b).transpose()
    }

    /// The 3-vector with the given components (normal, ξ, η) in this frame.
    pub fn to_global(&self, components: &Vector3<f64>) -> Vector3<f64> {
        self.basis.tr_mul(components)
    }

    /// Number of leading coordinates of the support that the gradient covers.
    #[inline]
    pub fn columns(&self) -> usize {
        self.gradient.len() / 9
    }

    /// ∂(basis vector b, component c)/∂(coordinate t of the support).
    #[inline]
    pub fn slope(&self, b: usize, c: usize, t: usize) -> f64 {
        self.gradient[(3 * b + c) * self.columns() + t]
    }

    /// Rotates the averaged frame of a patch at an edge so that its normal has the direction of
    /// `facing`.
    ///
    /// `facing_gradient[c * columns + t]` is its derivative over the whole support, with the ring
    /// first; `mirrored` as in [`nodal_frame`]. `None` if no direction is left.
    ///
    /// Ours. Tests: `a_turned_frame_has_the_normal_of_the_master`,
    /// `frame_gradient_matches_finite_differences`.
    pub fn turn_to(
        &mut self,
        facing: &Vector3<f64>,
        facing_gradient: &[f64],
        mirrored: [bool; 3],
        with_gradient: bool,
    ) -> Option<()> {
        let within = within(mirrored);
        let facing = within * facing;
        let length = facing.norm();
        let n = facing / length;
        let along = self.vector(1);
        let projected = along - n * n.dot(&along);
        let tangent_length = projected.norm();
        if !(length > 0.0) || !(tangent_length > 1e-8) {
            return None;
        }
        let xi = projected / tangent_length;
        self.basis = Matrix3::from_rows(&[n.transpose(), xi.transpose(), n.cross(&xi).transpose()]);
        if !with_gradient {
            return Some(());
        }
        let columns = facing_gradient.len() / 3;
        let ring = self.columns();
        let before = std::mem::replace(&mut self.gradient, vec![0.0; 9 * columns]);
        let (normal_slope, tangent_slope) =
            (normalisation_slope(&n, length) * within, normalisation_slope(&xi, tangent_length));
        for t in 0..columns {
            let row = |rows: &[f64], first: usize, columns: usize| {
                Vector3::from_fn(|c, _| if t < columns { rows[(first + c) * columns + t] } else { 0.0 })
            };
            let dn = normal_slope * row(facing_gradient, 0, columns);
            let d_along = row(&before, 3, ring);
            let d_projected = d_along - n * n.dot(&d_along) - dn * n.dot(&along) - n * dn.dot(&along);
            let d_xi = tangent_slope * d_projected;
            let d_eta = dn.cross(&xi) + n.cross(&d_xi);
            for c in 0..3 {
                self.gradient[c * columns + t] = dn[c];
                self.gradient[(3 + c) * columns + t] = d_xi[c];
                self.gradient[(6 + c) * columns + t] = d_eta[c];
            }
        }
        Some(())
    }
}

/// The projection onto all symmetry planes through a node.
pub(super) fn within(mirrored: [bool; 3]) -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::from(mirrored.map(|across| if across { 0.0 } else { 1.0 })))
}

/// Derivative of `v / ‖v‖` applied from the left: `(I − u uᵀ)/‖v‖`.
pub(super) fn normalisation_slope(unit: &Vector3<f64>, length: f64) -> Matrix3<f64> {
    (Matrix3::identity() - unit * unit.transpose()) / length
}

/// Evaluates the frame at a node whose ring has the current positions `ring`.
///
/// `edge` is the ring position of the neighbour that defines the material direction of the tangent;
/// `mirrored` are the coordinate axes normal to a symmetry plane through the node. Degenerate
/// corners (collinear edges) contribute nothing; `None` if no direction is left.
///
/// Paper: (19), (20) and §2.2; symmetry planes are ours.
/// Tests: `frame_gradient_matches_finite_differences`, `frame_turns_with_the_body`,
/// `a_mirrored_frame_is_that_of_the_whole_body`.
pub fn nodal_frame(
    ring: &[Vector3<f64>],
    corners: &[RingCorner],
    edge: usize,
    mirrored: [bool; 3],
    with_gradient: bool,
    out: &mut NodalFrame,
) -> Option<()> {
    let columns = 3 * ring.len();
    let own = corners.first()?.own;
    out.gradient.clear();
    out.gradient.resize(if with_gradient { 9 * columns } else { 0 }, 0.0);
    let n = averaged_normal(ring, corners, mirrored, &mut out.gradient)?;
    let axis = mirrored.iter().position(|&across| across);
    let e = match axis {
        Some(axis) => Vector3::ith(axis, 1.0),
        None => ring[edge] - ring[own],
    };
    let projected = e - n * n.dot(&e);
    let tangent_length = projected.norm();
    if !(tangent_length > 1e-8 * e.norm()) {
        return None;
    }
    let xi = projected / tangent_length;
    let eta = n.cross(&xi);
    out.across = [axis.is_some(), mirrored.iter().filter(|&&across| across).count() > 1];
    out.basis = Matrix3::from_rows(&[n.transpose(), xi.transpose(), eta.transpose()]);
    if !with_gradient {
        return Some(());
    }
    let gradient = &mut out.gradient;
    // tangents, column by column
    let tangent_slope = normalisation_slope(&xi, tangent_length);
    for t in 0..columns {
        let dn = Vector3::new(gradient[t], gradient[columns + t], gradient[2 * columns + t]);
        let mut de = Vector3::zeros();
        if axis.is_none() && t / 3 == edge {
            de[t % 3] = 1.0;
        } else if axis.is_none() && t / 3 == own {
            de[t % 3] = -1.0;
        }
        let d_projected = de - n * n.dot(&de) - dn * n.dot(&e) - n * dn.dot(&e);
        let d_xi = tangent_slope * d_projected;
        let d_eta = dn.cross(&xi) + n.cross(&d_xi);
        for c in 0..3 {
            gradient[(3 + c) * columns + t] = d_xi[c];
            gradient[(6 + c) * columns + t] = d_eta[c];
        }
    }
    Some(())
}

/// The normalized sum of the unit normals of facets, within the symmetry planes through the node; adds
/// its gradient over the ring, three rows, to `gradient` unless that is empty. `None` if no
/// direction is left.
pub fn averaged_normal(
    ring: &[Vector3<f64>],
    corners: &[RingCorner],
    mirrored: [bool; 3],
    gradient: &mut [f64],
) -> Option<Vector3<f64>> {
    let columns = 3 * ring.len();
    let mut sum = Vector3::zeros();
    for corner in corners {
        let normal = corner_normal(ring, corner).2;
        let length = normal.norm();
        if length > 0.0 {
            sum += normal / length;
        }
    }
    let within = within(mirrored);
    let sum = within * sum;
    let length = sum.norm();
    if !(length > 1e-8) {
        return None;
    }
    let n = sum / length;
    if gradient.is_empty() {
        return Some(n);
    }
    let outer = normalisation_slope(&n, length) * within;
    for corner in corners {
        let (a, b, normal) = corner_normal(ring, corner);
        let size = normal.norm();
        if size == 0.0 {
            continue;
        }
        let slope = outer * normalisation_slope(&(normal / size), size);
        let (by_next, by_previous) = (-slope * b.cross_matrix(), slope * a.cross_matrix());
        for (node, block) in
            [(corner.next, by_next), (corner.previous, by_previous), (corner.own, -by_next - by_previous)]
        {
            for r in 0..3 {
                for c in 0..3 {
                    gradient[r * columns + 3 * node + c] += block[(r, c)];
                }
            }
        }
    }
    Some(n)
}

/// Edges to the next and previous corner and their cross product, the facet's (not normalized)
/// normal at the corner.
fn corner_normal(ring: &[Vector3<f64>], corner: &RingCorner) -> (Vector3<f64>, Vector3<f64>, Vector3<f64>) {
    let a = ring[corner.next] - ring[corner.own];
    let b = ring[corner.previous] - ring[corner.own];
    (a, b, a.cross(&b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    /// A node with four warped facets around it, on an uneven 3 × 3 grid.
    fn patch() -> (Vec<Vector3<f64>>, Vec<RingCorner>) {
        let mut ring = Vec::new();
        for j in 0..3 {
            for i in 0..3 {
                let (x, y) = (i as f64 * (1.0 + 0.1 * j as f64), j as f64 * 0.9 + 0.07 * i as f64);
                ring.push(Vector3::new(x, y, 0.2 * (1.3 * x).sin() - 0.15 * (x * y + 0.4).cos()));
            }
        }
        let corners =
            [(5, 7), (7, 3), (3, 1), (1, 5)].map(|(next, previous)| RingCorner { own: 4, next, previous }).to_vec();
        (ring, corners)
    }

    #[test]
    fn frame_gradient_matches_finite_differences() {
        for mirrored in [[false; 3], [true, false, false], [false, false, true], [true, true, false]] {
            gradient_matches(mirrored);
        }
    }

    fn gradient_matches(mirrored: [bool; 3]) {
        let (mut ring, corners) = patch();
        // a slope, so that the normal has a component in every plane
        ring.iter_mut().for_each(|x| x[2] += 0.5 * x[0] - 0.7 * x[1]);
        let mut frame = NodalFrame::default();
        nodal_frame(&ring, &corners, 5, mirrored, true, &mut frame).unwrap();
        assert!((frame.basis * frame.basis.transpose() - Matrix3::identity()).norm() < 1e-14);
        let at = |t: usize, h: f64| {
            let mut moved = ring.clone();
            moved[t / 3][t % 3] += h;
            let mut frame = NodalFrame::default();
            nodal_frame(&moved, &corners, 5, mirrored, false, &mut frame).unwrap();
            frame.basis
        };
        for t in 0..27 {
            let fd = (8.0 * (at(t, 1e-3) - at(t, -1e-3)) - (at(t, 2e-3) - at(t, -2e-3))) / 12e-3;
            for b in 0..3 {
                for c in 0..3 {
                    assert!(
                        (fd[(b, c)] - frame.slope(b, c, t)).abs() < 1e-9,
                        "vector {b} component {c} coordinate {t}, {mirrored:?}"
                    );
                }
            }
        }
    }

    /// The `facing` vector of a patch, as some function of the positions of the ring and two more
    /// nodes.
    fn facing(x: &[Vector3<f64>]) -> Vector3<f64> {
        let (a, b) = (x[9] - x[0], x[10] - x[8]);
        a.cross(&b) * (0.3 + 0.1 * x[4].x)
    }

    fn turned(x: &[Vector3<f64>], mirrored: [bool; 3], with_gradient: bool) -> NodalFrame {
        let (_, corners) = patch();
        let columns = 3 * x.len();
        let mut gradient = vec![0.0; 3 * columns];
        for t in 0..columns {
            let at = |h: f64| {
                let mut moved = x.to_vec();
                moved[t / 3][t % 3] += h;
                facing(&moved)
            };
            // exact, since it is a polynomial of third degree
            let slope = (8.0 * (at(1e-2) - at(-1e-2)) - (at(2e-2) - at(-2e-2))) / 12e-2;
            (0..3).for_each(|c| gradient[c * columns + t] = slope[c]);
        }
        let mut frame = NodalFrame::default();
        nodal_frame(&x[..9], &corners, 5, mirrored, with_gradient, &mut frame).unwrap();
        frame.turn_to(&facing(x), &gradient, mirrored, with_gradient).unwrap();
        frame
    }

    #[test]
    fn a_turned_frame_has_the_normal_of_the_master() {
        let (mut x, _) = patch();
        x.extend([Vector3::new(1.9, 2.2, 0.9), Vector3::new(0.2, 1.7, 1.4)]);
        for mirrored in [[false; 3], [true, false, false], [false, true, false]] {
            let frame = turned(&x, mirrored, true);
            let normal = (within(mirrored) * facing(&x)).normalize();
            assert!((frame.vector(0) - normal).norm() < 1e-14);
            assert!((frame.basis * frame.basis.transpose() - Matrix3::identity()).norm() < 1e-14);
            assert_eq!(frame.columns(), 33);
            for t in 0..33 {
                let at = |h: f64| {
                    let mut moved = x.clone();
                    moved[t / 3][t % 3] += h;
                    turned(&moved, mirrored, false).basis
                };
                let fd = (8.0 * (at(1e-3) - at(-1e-3)) - (at(2e-3) - at(-2e-3))) / 12e-3;
                for (b, c) in (0..3).flat_map(|b| (0..3).map(move |c| (b, c))) {
                    let found = frame.slope(b, c, t);
                    assert!((fd[(b, c)] - found).abs() < 1e-8, "{mirrored:?} vector {b} component {c} coordinate {t}");
                }
            }
        }
    }

    #[test]
    fn frame_turns_with_the_body() {
        let (ring, corners) = patch();
        let rotation = Rotation3::from_euler_angles(0.4, -1.1, 2.3);
        let turned: Vec<_> = ring.iter().map(|x| rotation * x + Vector3::new(3.0, -1.0, 7.0)).collect();
        let (mut a, mut b) = (NodalFrame::default(), NodalFrame::default());
        nodal_frame(&ring, &corners, 5, [false; 3], false, &mut a).unwrap();
        nodal_frame(&turned, &corners, 5, [false; 3], false, &mut b).unwrap();
        for v in 0..3 {
            assert!((rotation * a.vector(v) - b.vector(v)).norm() < 1e-14);
        }
    }

    /// A node with two facets at x = 0, and the same node with the mirror images of these facets
    /// added.
    #[test]
    fn a_mirrored_frame_is_that_of_the_whole_body() {
        let half =
            [[0.0, 0.0, 0.1], [0.0, 1.0, 0.4], [1.1, 0.9, 0.2], [1.0, 0.1, -0.3], [0.9, -1.1, 0.2], [0.0, -0.8, 0.0]];
        let mut ring: Vec<Vector3<f64>> = half.map(Vector3::from).to_vec();
        let corner = |next, previous| RingCorner { own: 0, next, previous };
        let mut frame = NodalFrame::default();
        nodal_frame(&ring, &[corner(3, 1), corner(5, 3)], 1, [true, false, false], false, &mut frame).unwrap();
        // 6, 7, 8 are the images of 2, 3, 4; only 7 is a corner's neighbour
        ring.extend([2, 3, 4].map(|i| Vector3::new(-half[i][0], half[i][1], half[i][2])));
        let mut whole = NodalFrame::default();
        let corners = [corner(3, 1), corner(5, 3), corner(1, 7), corner(7, 5)];
        nodal_frame(&ring, &corners, 1, [false; 3], false, &mut whole).unwrap();
        assert!((frame.vector(0) - whole.vector(0)).norm() < 1e-15);
        assert_eq!((frame.vector(1), frame.across), (Vector3::x(), [true, false]));
        assert_eq!(whole.across, [false; 2]);
    }
}

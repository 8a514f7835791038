//! Loads on surfaces: dead tractions per reference area, and pressure that follows the surface.

use slipstick_mesh::FaceNodes;
use slipstick_mesh::second_order::face_shapes;

/// Positions ξ, η and weights of the integration points of a quadrilateral, exact for N_i
/// x,ξ × x,η.
const QUADRILATERAL: [(f64, f64, f64); 4] = {
    const G: f64 = 0.577_350_269_189_625_8;
    [(-G, -G, 1.0), (G, -G, 1.0), (G, G, 1.0), (-G, G, 1.0)]
};

/// The same for a triangle, whose x,ξ × x,η is constant.
const TRIANGLE: [(f64, f64, f64); 1] = [(1.0 / 3.0, 1.0 / 3.0, 0.5)];

/// Positions and weights of the rule for a triangle with six nodes, exact for degree 4, that of
/// N_i x,ξ × x,η. Source: D. A. Dunavant, Int. J. Numer. Methods Engrg. 21 (1985) 1129–1148.
const TRIANGLE_6: [(f64, f64, f64); 6] = {
    const A: f64 = 0.445_948_490_915_965;
    const B: f64 = 0.091_576_213_509_770_74;
    const WA: f64 = 0.5 * 0.223_381_589_678_011_46;
    const WB: f64 = 0.5 * 0.109_951_743_655_321_87;
    [
        (A, A, WA),
        (1.0 - 2.0 * A, A, WA),
        (A, 1.0 - 2.0 * A, WA),
        (B, B, WB),
        (1.0 - 2.0 * B, B, WB),
        (B, 1.0 - 2.0 * B, WB),
    ]
};

/// The same for a quadrilateral with nine nodes: 3×3 Gauss points, exact for degree 5.
const QUADRILATERAL_9: [(f64, f64, f64); 9] = {
    const G: f64 = 0.774_596_669_241_483_4; // √(3/5)
    const LINE: [(f64, f64); 3] = [(-G, 5.0 / 9.0), (0.0, 8.0 / 9.0), (G, 5.0 / 9.0)];
    let mut out = [(0.0, 0.0, 0.0); 9];
    let mut i = 0;
    while i < 9 {
        let (x, y) = (LINE[i % 3], LINE[i / 3]);
        out[i] = (x.0, y.0, x.1 * y.1);
        i += 1;
    }
    out
};

/// Shape functions of a face and their slopes at an integration point.
struct Point {
    weight: f64,
    value: [f64; 9],
    by_xi: [f64; 9],
    by_eta: [f64; 9],
}

/// Integration points of a face with three, four, six or nine nodes.
fn points(nodes: usize) -> impl Iterator<Item = Point> {
    let rule: &[(f64, f64, f64)] = match nodes {
        3 => &TRIANGLE,
        4 => &QUADRILATERAL,
        6 => &TRIANGLE_6,
        _ => &QUADRILATERAL_9,
    };
    rule.iter().map(move |&(xi, eta, weight)| {
        let mut point = Point { weight, value: [0.0; 9], by_xi: [0.0; 9], by_eta: [0.0; 9] };
        for (i, (value, slope)) in face_shapes(nodes, [xi, eta]).into_iter().enumerate() {
            (point.value[i], point.by_xi[i], point.by_eta[i]) = (value, slope[0], slope[1]);
        }
        point
    })
}

/// Σ w_k x_k of a face's nodes.
fn combine(facet: &FaceNodes, x: &[f64], weights: &[f64; 9]) -> [f64; 3] {
    let at = |c: usize| facet.iter().zip(weights).map(|(&n, w)| w * x[3 * n as usize + c]).sum();
    std::array::from_fn(at)
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// ∫ N_i dA of every node of the facets, ascending: the nodal forces of a unit traction on them.
/// `x` has three coordinates per node of the mesh. \[L²\]
pub fn nodal_areas(facets: &[FaceNodes], x: &[f64]) -> Vec<(u32, f64)> {
    let mut areas = std::collections::BTreeMap::new();
    for facet in facets {
        for point in points(facet.len()) {
            let normal = cross(combine(facet, x, &point.by_xi), combine(facet, x, &point.by_eta));
            let size = normal.iter().map(|n| n * n).sum::<f64>().sqrt();
            for (&node, value) in facet.iter().zip(point.value) {
                *areas.entry(node).or_insert(0.0) += point.weight * value * size;
            }
        }
    }
    areas.into_iter().collect()
}

/// Adds `factor` ∫ N_i n da, where n is the facets' normal on the side from which their nodes are
/// counter-clockwise: the residual of the pressure `factor`, that is, minus the force that it
/// exerts. `x`: positions, `out`: three entries per node. \[F/L²\] to \[F\]
pub fn add_pressure(facets: &[FaceNodes], x: &[f64], factor: f64, out: &mut [f64]) {
    for facet in facets {
        for point in points(facet.len()) {
            let normal = cross(combine(facet, x, &point.by_xi), combine(facet, x, &point.by_eta));
            for (&node, value) in facet.iter().zip(point.value) {
                for c in 0..3 {
                    out[3 * node as usize + c] += factor * point.weight * value * normal[c];
                }
            }
        }
    }
}

/// Passes the blocks of the derivative of [`add_pressure`] with respect to the positions to `add`:
/// row node, column node, and the row-major block. It is not symmetric at the edge of a surface.
///
/// Test: `pressure_tangent_matches_finite_differences`.
pub fn pressure_tangent(facets: &[FaceNodes], x: &[f64], factor: f64, mut add: impl FnMut(u32, u32, &[f64; 9])) {
    for facet in facets {
        for point in points(facet.len()) {
            let (a, b) = (combine(facet, x, &point.by_xi), combine(facet, x, &point.by_eta));
            for (k, &column) in facet.iter().enumerate() {
                // ∂(a × b) = ∂a × b + a × ∂b
                let v: [f64; 3] = std::array::from_fn(|c| point.by_eta[k] * a[c] - point.by_xi[k] * b[c]);
                for (&row, value) in facet.iter().zip(point.value) {
                    let f = factor * point.weight * value;
                    let v = v.map(|v| f * v);
                    add(row, column, &[0.0, -v[2], v[1], v[2], 0.0, -v[0], -v[1], v[0], 0.0]);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use slipstick_mesh::{Element, FacetNodes};

    fn face(nodes: &[u32]) -> FaceNodes {
        FacetNodes::new(nodes).expect("three or four nodes").into()
    }

    /// A warped quadrilateral and two triangles that together enclose a volume.
    fn open() -> (Vec<FaceNodes>, Vec<f64>) {
        let facets = vec![face(&[0, 1, 2, 3]), face(&[0, 4, 1]), face(&[1, 4, 2])];
        let x = vec![0.0, 0.1, 0.0, 1.2, 0.0, 0.1, 1.0, 0.9, -0.2, -0.1, 1.0, 0.3, 0.4, 0.5, -1.0];
        (facets, x)
    }

    fn force(facets: &[FaceNodes], x: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; x.len()];
        add_pressure(facets, x, 1.7, &mut out);
        out
    }

    #[test]
    fn pressure_tangent_matches_finite_differences() {
        let (facets, x) = open();
        let n = x.len();
        let mut exact = vec![0.0; n * n];
        pressure_tangent(&facets, &x, 1.7, |row, column, block| {
            for (at, value) in block.iter().enumerate() {
                exact[(3 * row as usize + at / 3) * n + 3 * column as usize + at % 3] += value;
            }
        });
        for j in 0..n {
            let moved = |h: f64| {
                let mut x = x.clone();
                x[j] += h;
                force(&facets, &x)
            };
            let (plus, minus) = (moved(1e-5), moved(-1e-5));
            for i in 0..n {
                let found = (plus[i] - minus[i]) / 2e-5;
                assert!((found - exact[i * n + j]).abs() < 1e-9, "entry {i}, {j}: {found} for {}", exact[i * n + j]);
            }
        }
    }

    /// On a closed surface, constant pressure has no resultant and no moment (Gauss' theorem), and
    /// its work is pressure times change of volume; on a tetrahedron, and on the skin of a
    /// hexahedron with warped faces.
    #[test]
    fn pressure_on_a_closed_surface_balances_itself() {
        let tetrahedron = vec![face(&[0, 2, 1]), face(&[0, 1, 3]), face(&[1, 2, 3]), face(&[0, 3, 2])];
        let corners = vec![0.0, 0.0, 0.0, 2.0, 0.1, 0.0, 0.3, 1.5, 0.2, 0.4, 0.3, 1.0];
        let sides = slipstick_mesh::HEX_FACES.map(|side| face(&side.map(|corner| corner as u32))).to_vec();
        let warped = vec![
            0.0, 0.1, 0.0, 1.1, 0.0, 0.2, 1.0, 1.0, 0.0, 0.0, 1.2, 0.1, 0.1, 0.0, 1.0, 1.0, 0.2, 1.1, 1.3, 1.0, 1.0,
            0.0, 1.0, 0.9,
        ];
        let all = |element: &Element| (0..element.faces()).map(|face| element.face(face)).collect::<Vec<_>>();
        let (tet10, hex27) =
            (Element::Tet10(std::array::from_fn(|i| i as u32)), Element::Hex27(std::array::from_fn(|i| i as u32)));
        let bent = |x: &[f64; 3]| x.map(|c| c + 0.1 * (7.0 * c + x[0] - 2.0 * x[1]).sin());
        let mut curved: Vec<[f64; 3]> = slipstick_mesh::second_order::HEX27_NODES.iter().map(bent).collect();
        let hex = curved.as_flattened().to_vec();
        curved = [0, 1, 3, 4, 8, 24, 11, 16, 22, 20].map(|i| curved[i]).to_vec();
        let tet = curved.as_flattened().to_vec();
        curved = slipstick_mesh::second_order::WEDGE18_NODES.iter().map(bent).collect();
        let (wedge18, wedge) = (Element::Wedge18(std::array::from_fn(|i| i as u32)), curved.as_flattened().to_vec());
        let cases =
            [(tetrahedron, corners), (sides, warped), (all(&tet10), tet), (all(&wedge18), wedge), (all(&hex27), hex)];
        for (facets, x) in cases {
            let f = force(&facets, &x);
            let (mut resultant, mut moment) = ([0.0; 3], [0.0; 3]);
            for (f, x) in f.chunks_exact(3).zip(x.chunks_exact(3)) {
                let m = cross([x[0], x[1], x[2]], [f[0], f[1], f[2]]);
                for c in 0..3 {
                    resultant[c] += f[c];
                    moment[c] += m[c];
                }
            }
            assert!(resultant.iter().chain(&moment).all(|v| v.abs() < 1e-14), "{resultant:?}, {moment:?}");
            // Σ f·x = p ∮ x·n da = 3 p V
            let volume = |x: &[f64]| {
                let mut out = vec![0.0; x.len()];
                add_pressure(&facets, x, 1.0, &mut out);
                out.iter().zip(x).map(|(f, x)| f * x).sum::<f64>() / 3.0
            };
            let velocity: Vec<f64> = (0..x.len()).map(|i| (i as f64 * 1.3).sin()).collect();
            let at = |h: f64| volume(&x.iter().zip(&velocity).map(|(x, v)| x + h * v).collect::<Vec<_>>());
            let rate = (at(1e-5) - at(-1e-5)) / 2e-5;
            let power: f64 = f.iter().zip(&velocity).map(|(f, v)| f * v).sum();
            assert!((power - 1.7 * rate).abs() < 1e-8, "{power} for {}", 1.7 * rate);
        }
    }

    /// A rectangle of 2 × 3, and a triangle that is half of it.
    #[test]
    fn nodal_areas_by_hand() {
        let x = [0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 2.0, 0.0, 3.0, 0.0, 0.0, 3.0];
        let quarter = nodal_areas(&[face(&[0, 1, 2, 3])], &x);
        assert!(
            quarter.iter().zip(0..).all(|(&(node, area), n)| node == n && (area - 1.5).abs() < 1e-15),
            "{quarter:?}"
        );
        let third = nodal_areas(&[face(&[0, 1, 2])], &x);
        assert!(third.iter().all(|(_, area)| (area - 1.0).abs() < 1e-15), "{third:?}");
    }
}

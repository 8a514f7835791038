//! Volumes, centroids, Jacobians and areas against closed forms and higher-order quadrature.

use proptest::prelude::*;
use slipstick_mesh::{
    Body, Element, Facet, FacetNodes, HEX_CORNERS, Mesh, Surface, WEDGE_AS_HEX, facet_area, facet_area_vector,
    facet_corner_areas, hex_jacobian, hex_scaled_jacobian, tet_scaled_jacobian, tet_volume, wedge_jacobian,
    wedge_scaled_jacobian,
};

use crate::support::{assert_close, cubes};

fn one_hex(corners: [[f64; 3]; 8]) -> Mesh {
    Mesh {
        nodes: corners.to_vec(),
        elements: vec![[0, 1, 2, 3, 4, 5, 6, 7].into()],
        bodies: vec![Body { name: "hex".into(), elements: 0..1, nodes: 0..8 }],
        ..Mesh::default()
    }
}

fn unit_cube() -> [[f64; 3]; 8] {
    HEX_CORNERS.map(|sign| sign.map(|c| 0.5 * (c + 1.0)))
}

/// By hand: two unit squares in a row, and a half of a third, as a triangle.
#[test]
fn node_areas_add_up_to_the_area() {
    let nodes: Vec<[f64; 3]> = (0..8).map(|i| [f64::from(i / 2), f64::from(i % 2), 0.0]).collect();
    let facet = |nodes: &[u32]| Facet { nodes: FacetNodes::new(nodes).expect("a facet"), element: 0 };
    let surface = Surface { facets: vec![facet(&[0, 2, 3, 1]), facet(&[2, 4, 5, 3]), facet(&[4, 6, 5])] };
    let areas = surface.node_areas(&nodes);
    assert_eq!(areas.iter().map(|(node, _)| *node).collect::<Vec<_>>(), [0, 1, 2, 3, 4, 5, 6]);
    let sixth = 0.5 / 3.0;
    for ((_, area), expected) in areas.iter().zip([0.25, 0.25, 0.5, 0.5, 0.25 + sixth, 0.25 + sixth, sixth]) {
        assert_close(*area, expected, 1e-15);
    }
}

#[test]
fn cube_with_a_raised_corner_has_the_volume_and_centroid_under_its_bilinear_lid() {
    // Lid z = 1 + a x y on the unit square: integrals of polynomials.
    let a = 0.7;
    let mut corners = unit_cube();
    corners[6][2] += a;
    let mesh = one_hex(corners);
    let volume = 1.0 + a / 4.0;
    assert_close(mesh.element_volume(0), volume, 1e-15);
    let expected = [(0.5 + a / 6.0) / volume, (0.5 + a / 6.0) / volume, 0.5 * (1.0 + a / 2.0 + a * a / 9.0) / volume];
    let centroid = mesh.centroid(0);
    for c in 0..3 {
        assert_close(centroid[c], expected[c], 1e-15);
    }
    assert_eq!(mesh.centroids(), vec![centroid]);
    assert_eq!(mesh.element_volumes(), vec![mesh.element_volume(0)]);
}

#[test]
fn scaled_jacobian_of_a_sheared_brick_is_the_sine_of_its_angle() {
    let angle = 0.4_f64;
    let sheared = unit_cube().map(|[x, y, z]| [3.0 * x + y * angle.cos(), y * angle.sin(), 7.0 * z]);
    assert_close(hex_scaled_jacobian(&sheared), angle.sin(), 1e-14);
    assert_close(hex_scaled_jacobian(&unit_cube()), 1.0, 1e-15);
    let mirrored = unit_cube().map(|[x, y, z]| [-x, y, z]);
    assert_close(hex_scaled_jacobian(&mirrored), -1.0, 1e-15);
    assert_eq!(hex_scaled_jacobian(&[[1.0; 3]; 8]), 0.0);
    assert!(hex_scaled_jacobian(&[[f64::NAN; 3]; 8]).is_nan());
    assert_close(hex_jacobian(&unit_cube(), [0.3, -0.2, 0.9]), 0.125, 1e-15);
}

#[test]
fn far_from_the_origin_volume_and_centroid_keep_their_digits() {
    let far = one_hex(unit_cube().map(|x| x.map(|c| c + 1e6)));
    assert_close(far.element_volume(0), 1.0, 1e-15);
    assert_eq!(far.centroid(0), [1e6 + 0.5; 3]);
}

#[test]
fn element_without_volume_still_has_a_finite_centroid() {
    let flat = one_hex(unit_cube().map(|[x, y, _]| [x, y, 2.0]));
    assert_eq!(flat.centroid(0), [0.5, 0.5, 2.0]);
    assert_eq!(flat.element_volume(0), 0.0);
}

/// By hand: the regular tetrahedron of edge length √8 in the corners of a cube of size 2 has a
/// third of its volume; that at a corner of the unit cube has a sixth of it, and edges 1, √2, √2 at
/// its other corners.
#[test]
fn tetrahedra_have_their_volume_and_quality() {
    let regular = [[1.0, 1.0, 1.0], [-1.0, -1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, -1.0]];
    assert_close(tet_volume(&regular), 8.0 / 3.0, 1e-14);
    assert_close(tet_scaled_jacobian(&regular), 1.0, 1e-14);
    let corner = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    assert_close(tet_volume(&corner), 1.0 / 6.0, 1e-14);
    assert_close(tet_scaled_jacobian(&corner), 0.5_f64.sqrt(), 1e-14);
    assert_close(tet_scaled_jacobian(&corner.map(|[x, y, z]| [y, x, z])), -(0.5_f64.sqrt()), 1e-14);
    assert_eq!(tet_scaled_jacobian(&[[1.0; 3]; 4]), 0.0);
    assert!(tet_scaled_jacobian(&[[f64::NAN; 3]; 4]).is_nan());
    let triangle = [corner[1], corner[2], corner[3]].into();
    assert_close(facet_area(&triangle), 0.75_f64.sqrt(), 1e-14);
    assert_eq!(facet_area_vector(&triangle), [0.5; 3]);
}

/// Nodes 0–2 below, 3–5 above.
const RIGHT_PRISM: [[f64; 3]; 6] =
    [[0.0; 3], [3.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 5.0], [3.0, 0.0, 5.0], [0.0, 2.0, 5.0]];

fn one_wedge(corners: [[f64; 3]; 6]) -> Mesh {
    Mesh {
        nodes: corners.to_vec(),
        elements: vec![[0, 1, 2, 3, 4, 5].into()],
        bodies: vec![Body { name: "wedge".into(), elements: 0..1, nodes: 0..6 }],
        ..Mesh::default()
    }
}

/// By hand: half of a brick; and the same with a raised corner, whose lid z = 5 + a x/3 is a plane.
#[test]
fn wedges_have_their_volume_and_centroid() {
    let mesh = one_wedge(RIGHT_PRISM);
    assert_eq!(mesh.check(), vec![]);
    assert_close(mesh.element_volume(0), 15.0, 1e-15);
    let expected = [1.0, 2.0 / 3.0, 2.5];
    assert!((0..3).all(|c| (mesh.centroid(0)[c] - expected[c]).abs() < 1e-14), "{:?}", mesh.centroid(0));
    assert_close(wedge_jacobian(&RIGHT_PRISM, [0.1, 0.6, -0.3]), 15.0, 1e-15);
    let a = 1.3;
    let mut raised = RIGHT_PRISM;
    raised[4][2] += a;
    let volume = 15.0 + a;
    let mesh = one_wedge(raised);
    assert_close(mesh.element_volume(0), volume, 1e-15);
    // ∫ x (5 + a x/3) with ∫ x = 3, ∫ x² = 9/2; ∫ z = ½ ∫ (5 + a x/3)²
    assert_close(mesh.centroid(0)[0], (15.0 + 1.5 * a) / volume, 1e-14);
    assert_close(mesh.centroid(0)[2], 0.5 * (75.0 + 10.0 * a + 0.5 * a * a) / volume, 1e-14);
    let upside_down = RIGHT_PRISM.map(|[x, y, z]| [x, y, -z]);
    assert_close(one_wedge(upside_down).element_volume(0), -15.0, 1e-15);
    assert!(one_wedge(upside_down).check()[0].to_string().contains("inverted"));
}

/// By hand: a right prism on an equilateral triangle, and on half a square. The last value is that
/// of VTK 9.5.2 (vtkMeshQuality, scaled Jacobian).
#[test]
fn wedges_have_their_quality() {
    let side = 0.75_f64.sqrt();
    let regular = [0.0, 7.0].map(|z| [[0.0, 0.0, z], [1.0, 0.0, z], [0.5, side, z]]).concat();
    let regular: [[f64; 3]; 6] = regular.try_into().unwrap();
    assert_close(wedge_scaled_jacobian(&regular), 1.0, 1e-14);
    assert_close(wedge_scaled_jacobian(&regular.map(|[x, y, z]| [-x, y, z])), -1.0, 1e-14);
    let half_square = RIGHT_PRISM.map(|[x, y, z]| [x, 1.5 * y, z]);
    assert_close(wedge_scaled_jacobian(&half_square), (2.0_f64 / 3.0).sqrt(), 1e-14);
    assert_eq!(wedge_scaled_jacobian(&[[1.0; 3]; 6]), 0.0);
    assert!(wedge_scaled_jacobian(&[[f64::NAN; 3]; 6]).is_nan());
    let crooked = [[0.0; 3], [1.1, 0.1, -0.1], [0.2, 0.9, 0.1], [0.1, -0.1, 1.2], [1.3, 0.0, 0.9], [0.1, 1.1, 1.4]];
    // VTK keeps coordinates in single precision
    assert_close(wedge_scaled_jacobian(&crooked), 0.754_651_309, 1e-7);
}

#[test]
fn facet_areas_are_those_of_the_plane_and_of_the_projection() {
    let trapezium = [[0.0, 0.0, 1.0], [4.0, 0.0, 1.0], [3.0, 2.0, 1.0], [1.0, 2.0, 1.0]];
    assert_close(facet_area(&trapezium.into()), 6.0, 1e-15);
    assert_eq!(facet_area_vector(&trapezium.into()), [0.0, 0.0, 6.0]);
    // A warped facet: its vector area is that of its rim's projections, ½ ∮ x × dx.
    let warped = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 1.0], [0.0, 1.0, 0.0]];
    let rim: [f64; 3] = (0..4).fold([0.0; 3], |sum, i| {
        let (a, b) = (warped[i], warped[(i + 1) % 4]);
        let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
        std::array::from_fn(|c| sum[c] + 0.5 * cross[c])
    });
    assert_eq!(facet_area_vector(&warped.into()), rim);
    let mesh = cubes("b", [2, 1, 1]);
    assert_eq!(mesh.bounding_box(), Some(([0.0; 3], [2.0, 1.0, 1.0])));
    assert_eq!(Mesh::default().bounding_box(), None);
}

/// By hand: of the trapezium, ¼ ∫ (1 ∓ η)(3 − η) dη at the wide and the narrow side.
#[test]
fn corner_areas_by_hand() {
    let trapezium = [[0.0, 0.0, 1.0], [4.0, 0.0, 1.0], [3.0, 2.0, 1.0], [1.0, 2.0, 1.0]];
    let areas = facet_corner_areas(&trapezium.into());
    for (area, expected) in areas.iter().zip([5.0, 5.0, 4.0, 4.0]) {
        assert_close(*area, expected / 3.0, 1e-15);
    }
    let triangle = [[0.0; 3], [3.0, 0.0, 0.0], [0.0, 2.0, 0.0]];
    assert_eq!(facet_corner_areas(&triangle.into()), [1.0, 1.0, 1.0, 0.0]);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    /// Five Gauss points per direction integrate polynomials of degree 9.
    #[test]
    fn volume_and_centroid_are_exact_for_any_trilinear_hexahedron(
        shift in prop::array::uniform8(prop::array::uniform3(-0.2_f64..0.2)),
    ) {
        let cube = unit_cube();
        let corners: [[f64; 3]; 8] = std::array::from_fn(|n| std::array::from_fn(|c| cube[n][c] + shift[n][c]));
        let root = (10.0_f64 / 7.0).sqrt();
        let (a, b) = ((5.0 - 2.0 * root).sqrt() / 3.0, (5.0 + 2.0 * root).sqrt() / 3.0);
        let (u, v) = ((322.0 + 13.0 * 70.0_f64.sqrt()) / 900.0, (322.0 - 13.0 * 70.0_f64.sqrt()) / 900.0);
        let rule = [(-b, v), (-a, u), (0.0, 128.0 / 225.0), (a, u), (b, v)];
        let (mut volume, mut moment) = (0.0, [0.0; 3]);
        for (xi, wx) in rule {
            for (eta, wy) in rule {
                for (zeta, wz) in rule {
                    let point = [xi, eta, zeta];
                    let weight = wx * wy * wz * hex_jacobian(&corners, point);
                    volume += weight;
                    for (x, sign) in corners.iter().zip(&HEX_CORNERS) {
                        let shape: f64 = (0..3).map(|d| 0.5 * (1.0 + sign[d] * point[d])).product();
                        (0..3).for_each(|c| moment[c] += weight * shape * x[c]);
                    }
                }
            }
        }
        let mesh = one_hex(corners);
        prop_assert!((mesh.element_volume(0) - volume).abs() < 1e-14);
        let centroid = mesh.centroid(0);
        prop_assert!((0..3).all(|c| (centroid[c] - moment[c] / volume).abs() < 1e-14));
    }

    /// The hexahedron has the wedge's map: with r = (1+ξ)(1−η)/4 and s = (1+η)/2, its Jacobian
    /// determinant is that of the wedge times ∂(r, s)/∂(ξ, η) = (1−η)/8. The volume is compared
    /// with another rule, the midpoints of a triangle's edges times two Gauss points: exact too,
    /// since the wedge's determinant is linear in r, s and quadratic in ζ.
    #[test]
    fn a_wedge_is_a_hexahedron_with_two_edges_of_no_length(
        shift in prop::array::uniform6(prop::array::uniform3(-0.2_f64..0.2)),
        at in prop::array::uniform3(-1.0_f64..1.0),
    ) {
        let corners: [[f64; 3]; 6] = std::array::from_fn(|n| std::array::from_fn(|c| RIGHT_PRISM[n][c] + shift[n][c]));
        let [xi, eta, zeta] = at;
        let wedge = wedge_jacobian(&corners, [0.25 * (1.0 + xi) * (1.0 - eta), 0.5 * (1.0 + eta), zeta]);
        let hex = hex_jacobian(&WEDGE_AS_HEX.map(|corner| corners[corner]), at);
        prop_assert!((hex - 0.125 * (1.0 - eta) * wedge).abs() < 1e-14 * 15.0);
        let mesh = one_wedge(corners);
        let nodes = mesh.elements[0].as_hex().unwrap();
        prop_assert_eq!(mesh.coordinates(&nodes), WEDGE_AS_HEX.map(|corner| corners[corner]));
        prop_assert_eq!(Element::Tet4([0; 4]).as_hex(), None);
        let gauss = 1.0 / 3.0_f64.sqrt();
        let edges = [(0.5, 0.0), (0.5, 0.5), (0.0, 0.5)];
        let points = edges.into_iter().flat_map(|(r, s)| [[r, s, -gauss], [r, s, gauss]]);
        let volume = points.map(|point| wedge_jacobian(&corners, point) / 6.0).sum::<f64>();
        prop_assert!((mesh.element_volume(0) - volume).abs() < 1e-14 * 15.0);
    }
}

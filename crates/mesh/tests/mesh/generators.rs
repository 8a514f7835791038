//! Volumes and areas of polyhedra in closed form, convergence to the smooth bodies, counts,
//! orientation, errors.

use std::f64::consts::PI;

use proptest::prelude::*;
use slipstick_mesh::{
    BallShape, BoxShape, ConeShape, HalfBallShape, HalfRingShape, HollowCylinderShape, Mesh, MeshError, TorusShape,
    ball, box_mesh, cone, half_ball, half_ring, hollow_cylinder, torus,
};

use crate::support::{area_vector, assert_close, assert_sound, quality, volume};

const BOX: BoxShape =
    BoxShape { min: [-1.0, 0.5, 2.0], max: [2.0, 1.5, 4.0], elements: [4, 3, 2], grading: [1.0, 3.0, 0.5] };

fn half(n: usize, h: usize, m: usize) -> Mesh {
    half_ball("ball", &HalfBallShape { radius: 2.0, elements: [n, h, m] }).unwrap()
}

fn tube(elements: [usize; 3]) -> Mesh {
    let shape = HollowCylinderShape { inner_radius: 1.5, outer_radius: 2.0, height: 3.0, elements };
    hollow_cylinder("tube", &shape).unwrap()
}

fn ring(elements: [usize; 3]) -> Mesh {
    half_ring("ring", &HalfRingShape { outer_radius: 2.0, inner_radius: 1.5, width: 3.0, elements }).unwrap()
}

/// Area of the named surface.
fn area(mesh: &Mesh, name: &str) -> f64 {
    mesh.surface_area(&mesh.surfaces[name])
}

#[test]
fn box_has_exact_volume_areas_and_counts() {
    let mesh = box_mesh("slab", &BOX).unwrap();
    assert_eq!(assert_sound(&mesh), 2);
    assert_eq!((mesh.elements.len(), mesh.nodes.len()), (24, 60));
    assert_close(volume(&mesh), 6.0, 1e-14);
    assert!((quality(&mesh) - 1.0).abs() < 1e-14);
    let normals =
        [[-2.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, -6.0, 0.0], [0.0, 6.0, 0.0], [0.0, 0.0, -3.0], [0.0, 0.0, 3.0]];
    for (face, expected) in ["xmin", "xmax", "ymin", "ymax", "zmin", "zmax"].iter().zip(normals) {
        let name = format!("slab_{face}");
        let vector = area_vector(&mesh, &mesh.surfaces[&name]);
        assert!((0..3).all(|c| (vector[c] - expected[c]).abs() < 1e-13), "{name}: {vector:?}");
        let direction = expected.iter().position(|c| *c != 0.0).unwrap();
        let plane = if expected[direction] < 0.0 { BOX.min[direction] } else { BOX.max[direction] };
        assert!(mesh.surfaces[&name].nodes().iter().all(|&n| mesh.nodes[n as usize][direction] == plane));
    }
    assert_eq!(mesh.surfaces.len(), 6);
}

#[test]
fn box_grading_is_the_ratio_of_the_end_sizes_with_a_constant_factor() {
    let shape = BoxShape { min: [0.0; 3], max: [7.0, 1.0, 1.0], elements: [3, 1, 1], grading: [4.0, 5.0, 1.0] };
    // 1 + 2 + 4 = 7, and a single element has nothing to grade.
    let mesh = box_mesh("b", &shape).unwrap();
    for (x, expected) in [0.0, 1.0, 3.0, 7.0].iter().enumerate() {
        assert!((mesh.nodes[x][0] - expected).abs() < 1e-14);
    }
    // The inverse ratio mirrors it; a ratio next to 1 is next to uniform.
    let mirrored = box_mesh("b", &BoxShape { grading: [0.25, 1.0, 1.0], ..shape }).unwrap();
    let nearly = box_mesh("b", &BoxShape { grading: [1.0 + 1e-12, 1.0, 1.0], ..shape }).unwrap();
    for i in 0..4 {
        assert!((mirrored.nodes[i][0] + mesh.nodes[3 - i][0] - 7.0).abs() < 1e-14);
        assert!((nearly.nodes[i][0] - 7.0 * i as f64 / 3.0).abs() < 1e-11);
    }
}

#[test]
fn half_ball_of_the_ironing_die_has_2900_good_elements() {
    let mesh = half(10, 5, 8);
    assert_eq!(assert_sound(&mesh), 2);
    assert_eq!(mesh.elements.len(), 2900);
    // Block 11·11·6; each layer the skin without the inner points of its top: 11·11 + 40·5.
    assert_eq!(mesh.nodes.len(), 726 + 8 * 321);
    assert!(quality(&mesh) > 0.73, "quality {}", quality(&mesh));
    assert_eq!(mesh.surfaces["ball_dome"].facets.len(), 300);
    assert_eq!(mesh.surfaces["ball_flat"].facets.len(), 100 + 8 * 40);
    for n in mesh.surfaces["ball_dome"].nodes() {
        let [x, y, z] = mesh.nodes[n as usize];
        assert_close((x * x + y * y + z * z).sqrt(), 2.0, 1e-15);
        assert!(y <= 0.0);
    }
    assert!(mesh.surfaces["ball_flat"].nodes().iter().all(|&n| mesh.nodes[n as usize][1] == 0.0));
    // The rim is a regular polygon of 4 n corners, and the flat face looks up.
    let polygon = 0.5 * 40.0 * (2.0 * PI / 40.0).sin() * 4.0;
    assert_close(area(&mesh, "ball_flat"), polygon, 1e-13);
    let flat = area_vector(&mesh, &mesh.surfaces["ball_flat"]);
    assert_close(flat[1], polygon, 1e-13);
}

#[test]
fn half_ball_converges_to_the_sphere_with_second_order() {
    let errors: Vec<[f64; 2]> = [4, 8, 16]
        .map(|n| {
            let mesh = half(n, n / 2, 2);
            [volume(&mesh) / (16.0 * PI / 3.0) - 1.0, area(&mesh, "ball_dome") / (8.0 * PI) - 1.0]
        })
        .to_vec();
    for which in 0..2 {
        for pair in errors.windows(2) {
            let order = (pair[0][which] / pair[1][which]).log2();
            assert!((order - 2.0).abs() < 0.1, "order {order}, errors {errors:?}");
        }
    }
    assert!(errors[2].iter().all(|e| e.abs() < 0.005), "{errors:?}");
}

#[test]
fn half_ball_mirrors_itself_to_the_last_bit() {
    let mesh = half(5, 3, 2);
    let bits = |x: [f64; 3]| x.map(|c| (c + 0.0).to_bits());
    let mut nodes: Vec<_> = mesh.nodes.iter().map(|&x| bits(x)).collect();
    nodes.sort_unstable();
    for mirror in [|x: [f64; 3]| [-x[0], x[1], x[2]], |x: [f64; 3]| [x[0], x[1], -x[2]]] {
        let mut mirrored: Vec<_> = mesh.nodes.iter().map(|&x| bits(mirror(x))).collect();
        mirrored.sort_unstable();
        assert_eq!(nodes, mirrored);
    }
}

#[test]
fn hollow_cylinder_is_a_prism_over_a_polygonal_annulus() {
    let mesh = tube([2, 12, 3]);
    // The boundary of a closed tube is a torus.
    assert_eq!(assert_sound(&mesh), 0);
    assert_eq!((mesh.elements.len(), mesh.nodes.len()), (72, 3 * 12 * 4));
    let annulus = 6.0 * (PI / 6.0).sin() * (4.0 - 2.25);
    assert_close(volume(&mesh), 3.0 * annulus, 1e-13);
    for (face, up) in [("tube_bottom", -1.0), ("tube_top", 1.0)] {
        assert_close(area_vector(&mesh, &mesh.surfaces[face])[1], up * annulus, 1e-13);
    }
    assert_close(area(&mesh, "tube_outer"), 24.0 * (PI / 12.0).sin() * 2.0 * 3.0, 1e-13);
    assert_close(area(&mesh, "tube_inner"), 24.0 * (PI / 12.0).sin() * 1.5 * 3.0, 1e-13);
    assert!(mesh.surfaces["tube_top"].nodes().iter().all(|&n| mesh.nodes[n as usize][1] == 3.0));
    assert!(mesh.surfaces["tube_bottom"].nodes().iter().all(|&n| mesh.nodes[n as usize][1] == 0.0));
    assert_eq!(assert_sound(&tube([1, 3, 1])), 0);
}

#[test]
fn half_ring_hangs_down_from_two_ends_that_look_up() {
    let mesh = ring([12, 2, 3]);
    assert_eq!(assert_sound(&mesh), 2);
    assert_eq!((mesh.elements.len(), mesh.nodes.len()), (72, 13 * 3 * 4));
    let segment = 6.0 * (PI / 12.0).sin() * (4.0 - 2.25);
    assert_close(volume(&mesh), 3.0 * segment, 1e-13);
    assert_close(area_vector(&mesh, &mesh.surfaces["ring_zmin"])[2], -segment, 1e-13);
    assert_close(area_vector(&mesh, &mesh.surfaces["ring_zmax"])[2], segment, 1e-13);
    assert_close(area_vector(&mesh, &mesh.surfaces["ring_ends"])[1], 2.0 * 0.5 * 3.0, 1e-14);
    assert_close(area(&mesh, "ring_outer"), 24.0 * (PI / 24.0).sin() * 2.0 * 3.0, 1e-13);
    assert_close(area(&mesh, "ring_inner"), 24.0 * (PI / 24.0).sin() * 1.5 * 3.0, 1e-13);
    assert!(mesh.surfaces["ring_ends"].nodes().iter().all(|&n| mesh.nodes[n as usize][1] == 0.0));
    // The outer side looks down, its lowest line is at −R, and all of it is at R.
    assert!(area_vector(&mesh, &mesh.surfaces["ring_outer"])[1] < 0.0);
    let lowest = mesh.nodes.iter().fold(0.0_f64, |y, x| y.min(x[1]));
    assert_close(lowest, -2.0, 1e-15);
    for n in mesh.surfaces["ring_outer"].nodes() {
        assert_close(mesh.nodes[n as usize][0].hypot(mesh.nodes[n as usize][1]), 2.0, 1e-15);
    }
}

#[test]
fn cone_is_a_frustum_of_a_pyramid_with_4n_sides() {
    let shape = ConeShape { bottom_radius: 2.0, top_radius: 0.5, height: 3.0, elements: [3, 2, 4] };
    let mesh = cone("cone", &shape).unwrap();
    assert_eq!(assert_sound(&mesh), 2);
    assert_eq!((mesh.elements.len(), mesh.nodes.len()), ((9 + 24) * 4, (16 + 24) * 5));
    // a regular polygon of 12 sides, since the nodes divide the circle into equal angles
    let polygon = |radius: f64| 6.0 * (PI / 6.0).sin() * radius * radius;
    assert_close(volume(&mesh), (polygon(2.0) + polygon(0.5) + polygon(1.0)) * 3.0 / 3.0, 1e-13);
    assert_close(area_vector(&mesh, &mesh.surfaces["cone_bottom"])[1], -polygon(2.0), 1e-13);
    assert_close(area_vector(&mesh, &mesh.surfaces["cone_top"])[1], polygon(0.5), 1e-13);
    for n in mesh.surfaces["cone_side"].nodes() {
        let [x, y, z] = mesh.nodes[n as usize];
        assert_close(x.hypot(z), 2.0 - 0.5 * y, 1e-14);
    }
    assert_eq!(mesh.surfaces.len(), 3);
}

#[test]
fn torus_and_ball_are_closed_and_lie_on_their_surfaces() {
    let ring = torus("ring", &TorusShape { radius: 3.0, tube_radius: 1.0, elements: [2, 2, 9] }).unwrap();
    assert_eq!(assert_sound(&ring), 0);
    assert_eq!((ring.elements.len(), ring.nodes.len()), ((4 + 16) * 9, (9 + 16) * 9));
    for n in ring.surfaces["ring_side"].nodes() {
        let [x, y, z] = ring.nodes[n as usize];
        assert_close((x.hypot(z) - 3.0).hypot(y), 1.0, 1e-14);
    }
    let solid = ball("ball", &BallShape { radius: 2.0, elements: [4, 2, 3] }).unwrap();
    let lower = half(4, 2, 3);
    assert_eq!(assert_sound(&solid), 2);
    assert_eq!(solid.elements.len(), 2 * lower.elements.len());
    // the halves share the disc at y = 0
    assert_eq!(solid.nodes.len(), 2 * lower.nodes.len() - 25 - 3 * 16);
    assert_close(volume(&solid), 2.0 * volume(&lower), 1e-13);
    assert_close(area(&solid, "ball_side"), 2.0 * area(&lower, "ball_dome"), 1e-13);
    for (mesh, name) in [(&ring, "ring_side"), (&solid, "ball_side")] {
        assert!(area_vector(mesh, &mesh.surfaces[name]).iter().all(|a| a.abs() < 1e-12));
    }
}

#[test]
fn round_bodies_converge_with_second_order() {
    let torus_error = |n: usize| {
        let shape = TorusShape { radius: 3.0, tube_radius: 1.0, elements: [n, 1, 8 * n] };
        volume(&torus("t", &shape).unwrap()) / (2.0 * PI * PI * 3.0) - 1.0
    };
    assert!(((torus_error(8) / torus_error(16)).log2() - 2.0).abs() < 0.02);
    let tube_error = |n: usize| volume(&tube([1, n, 1])) / (PI * 1.75 * 3.0) - 1.0;
    let ring_error = |n: usize| volume(&ring([n, 1, 1])) / (0.5 * PI * 1.75 * 3.0) - 1.0;
    assert!(((tube_error(32) / tube_error(64)).log2() - 2.0).abs() < 0.01);
    assert!(((ring_error(16) / ring_error(32)).log2() - 2.0).abs() < 0.01);
}

#[test]
fn bad_parameters_are_errors_that_name_them() {
    let name_of = |result: Result<Mesh, MeshError>| match result {
        Err(MeshError::Parameter { parameter, .. }) => parameter,
        Err(MeshError::TooLarge { what }) => format!("too many {what}"),
        other => panic!("{other:?}"),
    };
    let boxed = |change: fn(&mut BoxShape)| {
        let mut shape = BOX;
        change(&mut shape);
        name_of(box_mesh("b", &shape))
    };
    assert_eq!(boxed(|s| s.elements[1] = 0), "elements[1]");
    assert_eq!(boxed(|s| s.max[2] = 2.0), "max[2]");
    assert_eq!(boxed(|s| s.min[0] = f64::NAN), "max[0]");
    assert_eq!(boxed(|s| s.grading[0] = 0.0), "grading[0]");
    assert_eq!(boxed(|s| s.grading[1] = 1e300), "grading[1]");
    assert_eq!(boxed(|s| s.elements = [usize::MAX; 3]), "too many elements");
    assert_eq!(boxed(|s| s.elements = [65535, 65536, 1]), "too many nodes");
    assert_eq!(name_of(box_mesh("", &BOX)), "name");

    let dome = |radius, elements| name_of(half_ball("b", &HalfBallShape { radius, elements }));
    assert_eq!(dome(-1.0, [2, 1, 1]), "radius");
    assert_eq!(dome(f64::INFINITY, [2, 1, 1]), "radius");
    assert_eq!(dome(1.0, [2, 0, 1]), "elements[1] (h)");
    assert_eq!(dome(1.0, [2, 1, usize::MAX]), "too many nodes");

    let tube = |inner_radius, outer_radius, height, elements| {
        name_of(hollow_cylinder("t", &HollowCylinderShape { inner_radius, outer_radius, height, elements }))
    };
    assert_eq!(tube(1.0, 1.0, 1.0, [1, 4, 1]), "inner_radius");
    assert_eq!(tube(1.0, 2.0, 0.0, [1, 4, 1]), "height");
    assert_eq!(tube(1.0, 2.0, 1.0, [1, 2, 1]), "elements[1] (around)");

    let ring = |inner_radius, outer_radius, width, elements| {
        name_of(half_ring("r", &HalfRingShape { inner_radius, outer_radius, width, elements }))
    };
    assert_eq!(ring(0.0, 1.0, 1.0, [4, 1, 1]), "inner_radius");
    assert_eq!(ring(1.0, f64::NAN, 1.0, [4, 1, 1]), "outer_radius");
    assert_eq!(ring(1.0, 2.0, -1.0, [4, 1, 1]), "width");
    assert_eq!(ring(1.0, 2.0, 1.0, [1, 1, 1]), "elements[0] (around)");
    let frustum = |bottom_radius, top_radius, height, elements| {
        name_of(cone("c", &ConeShape { bottom_radius, top_radius, height, elements }))
    };
    assert_eq!(frustum(0.0, 1.0, 1.0, [1, 1, 1]), "bottom_radius");
    assert_eq!(frustum(1.0, 0.0, 1.0, [1, 1, 1]), "top_radius");
    assert_eq!(frustum(1.0, 1.0, f64::NAN, [1, 1, 1]), "height");
    assert_eq!(frustum(1.0, 1.0, 1.0, [1, 0, 1]), "elements[1] (m)");
    assert_eq!(frustum(1.0, 1.0, 1.0, [1, usize::MAX, 1]), "too many nodes");
    let ring = |radius, tube_radius, elements| name_of(torus("t", &TorusShape { radius, tube_radius, elements }));
    assert_eq!(ring(1.0, 1.0, [1, 1, 3]), "tube_radius");
    assert_eq!(ring(2.0, 1.0, [1, 1, 2]), "elements[2] (around)");
    assert_eq!(ring(2.0, 1.0, [1, 1, usize::MAX]), "too many elements");
    assert_eq!(name_of(ball("b", &BallShape { radius: 0.0, elements: [1, 1, 1] })), "radius");
    let message = half_ball("b", &HalfBallShape { radius: -1.0, elements: [2, 1, 1] }).unwrap_err().to_string();
    assert_eq!(message, "`radius` is -1: must be positive and finite");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_generated_body_is_sound(a in 1_usize..6, b in 1_usize..6, c in 1_usize..6, size in 0.01_f64..100.0, ratio in 0.2_f64..5.0) {
        let graded = BoxShape {
            min: [-size, 0.0, 1.0],
            max: [size * ratio, size, 1.0 + size],
            elements: [a, b, c],
            grading: [ratio, 1.0, 1.0 / ratio],
        };
        prop_assert_eq!(assert_sound(&box_mesh("b", &graded).unwrap()), 2);
        let dome = half_ball("b", &HalfBallShape { radius: size, elements: [a, b, c] }).unwrap();
        prop_assert_eq!(dome.elements.len(), a * a * b + c * (a * a + 4 * a * b));
        prop_assert_eq!(assert_sound(&dome), 2);
        prop_assert!(quality(&dome) > 0.3);
        let (inner_radius, outer_radius) = (size, size * (1.0 + ratio));
        let tube = HollowCylinderShape { inner_radius, outer_radius, height: ratio, elements: [a, b + 2, c] };
        prop_assert_eq!(assert_sound(&hollow_cylinder("b", &tube).unwrap()), 0);
        let solid = ball("b", &BallShape { radius: size, elements: [a, b, c] }).unwrap();
        prop_assert_eq!(assert_sound(&solid), 2);
        let frustum = ConeShape { bottom_radius: size, top_radius: size * ratio, height: size, elements: [a, b, c] };
        let frustum = cone("b", &frustum).unwrap();
        prop_assert_eq!(assert_sound(&frustum), 2);
        let tube_radius = size * ratio / 5.1;
        let tire = torus("b", &TorusShape { radius: size, tube_radius, elements: [a, b, c + 2] }).unwrap();
        prop_assert_eq!(assert_sound(&tire), 0);
        let ring = HalfRingShape { inner_radius, outer_radius, width: ratio, elements: [a + 1, b, c] };
        prop_assert_eq!(assert_sound(&half_ring("b", &ring).unwrap()), 2);
    }
}

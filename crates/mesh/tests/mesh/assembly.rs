//! Merging and placing bodies.

use proptest::prelude::*;
use slipstick_mesh::{Mesh, MeshError, Placement, Rotation};

use crate::support::{assert_close, cubes, volume};

fn placement(axis: [f64; 3], degrees: f64, translate: [f64; 3]) -> Placement {
    Placement { rotate: Some(Rotation { axis, degrees }), translate }
}

#[test]
fn merged_bodies_keep_their_shape_and_get_contiguous_numbers() {
    let (mut slab, mut die) = (cubes("slab", [3, 1, 2]), cubes("die", [1, 2, 1]));
    slab.node_sets.insert("corner".into(), vec![0]);
    die.node_sets.insert("tip".into(), vec![0, 4]);
    die.transform(&placement([0.0, 1.0, 0.0], 30.0, [0.0, 2.0, 0.0])).unwrap();
    let mesh = Mesh::merge(vec![slab.clone(), die.clone()]).unwrap();
    assert_eq!(mesh.check(), vec![]);
    assert_eq!(mesh.bodies[1].elements, 6..8);
    assert_eq!(mesh.bodies[1].nodes, 24..36);
    assert_eq!(mesh.node_sets["tip"], vec![24, 28]);
    assert_eq!(mesh.surfaces["die_ymin"].facets[0].element, 6);
    assert_eq!(
        mesh.surfaces["die_ymin"].nodes(),
        die.surfaces["die_ymin"].nodes().iter().map(|n| n + 24).collect::<Vec<_>>()
    );
    assert_eq!(mesh.centroid(7), die.centroid(1));
    assert_eq!(mesh.boundary(0), slab.boundary(0));
    assert_close(volume(&mesh), 8.0, 1e-14);
    assert_eq!(Mesh::merge(vec![]).unwrap(), Mesh::default());
}

#[test]
fn names_that_merged_meshes_share_are_errors() {
    let duplicate = |a: Mesh, b: Mesh| match Mesh::merge(vec![a, b]) {
        Err(MeshError::DuplicateName { kind, name }) => (kind, name),
        other => panic!("{other:?}"),
    };
    let (a, mut b) = (cubes("a", [1; 3]), cubes("b", [1; 3]));
    assert_eq!(duplicate(a.clone(), a.clone()), ("body", "a".into()));
    b.surfaces.insert("a_xmin".into(), b.surfaces["b_xmin"].clone());
    assert_eq!(duplicate(a.clone(), b.clone()), ("surface", "a_xmin".into()));
    b.surfaces.remove("a_xmin");
    b.node_sets.insert("a_xmax".into(), vec![0]);
    assert_eq!(duplicate(a.clone(), b.clone()), ("set or surface", "a_xmax".into()));
    assert_eq!(duplicate(b.clone(), a), ("set or surface", "a_xmax".into()));
    let mut c = cubes("c", [1; 3]);
    c.node_sets.insert("a_xmax".into(), vec![1]);
    assert_eq!(duplicate(b, c), ("node set", "a_xmax".into()));
}

#[test]
fn quarter_turns_about_axes_are_exact_and_right_handed() {
    let mut mesh = cubes("b", [1; 3]);
    mesh.nodes[7] = [0.1, 0.2, 0.3];
    let turned = |degrees| {
        let mut copy = mesh.clone();
        copy.transform(&placement([0.0, 0.0, 5.0], degrees, [0.0; 3])).unwrap();
        copy.nodes[7]
    };
    assert_eq!(turned(90.0), [-0.2, 0.1, 0.3]);
    assert_eq!(turned(180.0), [-0.1, -0.2, 0.3]);
    assert_eq!(turned(-90.0), [0.2, -0.1, 0.3]);
    assert_eq!(turned(360.0), [0.1, 0.2, 0.3]);
}

#[test]
fn the_rotation_comes_before_the_translation() {
    let mut mesh = cubes("b", [1; 3]);
    mesh.transform(&placement([0.0, 1.0, 0.0], 90.0, [10.0, 0.0, 0.0])).unwrap();
    // x → −z: the cube goes to z in −1..0 and then to x in 10..11.
    assert_eq!(mesh.bounding_box(), Some(([10.0, 0.0, -1.0], [11.0, 1.0, 0.0])));
    assert_eq!(mesh.check(), vec![]);
}

#[test]
fn bad_placements_are_errors_and_leave_the_mesh_alone() {
    let mut mesh = cubes("b", [1; 3]);
    let before = mesh.clone();
    for (bad, expected) in [
        (placement([0.0; 3], 90.0, [0.0; 3]), "rotate.axis"),
        (placement([0.0, f64::NAN, 1.0], 90.0, [0.0; 3]), "rotate.axis"),
        (placement([0.0, f64::INFINITY, 1.0], 90.0, [0.0; 3]), "rotate.axis"),
        (placement([0.0, 1.0, 0.0], f64::INFINITY, [0.0; 3]), "rotate.degrees"),
        (placement([0.0, 1.0, 0.0], 90.0, [0.0, f64::NAN, 0.0]), "translate"),
    ] {
        match mesh.transform(&bad) {
            Err(MeshError::Parameter { parameter, .. }) => assert_eq!(parameter, expected),
            other => panic!("{other:?}"),
        }
        assert_eq!(mesh, before);
    }
    // Any length of the axis will do.
    let tiny = Rotation { axis: [0.0, 1e-200, 0.0], degrees: 90.0 }.matrix().unwrap();
    assert_eq!(tiny, Rotation { axis: [0.0, 1e200, 0.0], degrees: 90.0 }.matrix().unwrap());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    /// What makes a matrix the rotation: orthonormal with determinant 1, the axis fixed, trace
    /// 1 + 2 cos, and a · (v × R v) ∝ sin with the positive sign.
    #[test]
    fn rotation_matrices_are_rotations(axis in prop::array::uniform3(-1.0_f64..1.0), degrees in -720.0_f64..720.0) {
        let length = axis.iter().map(|c| c * c).sum::<f64>().sqrt();
        prop_assume!(length > 1e-3);
        let unit = axis.map(|c| c / length);
        let r = Rotation { axis, degrees }.matrix().unwrap();
        let (sine, cosine) = degrees.to_radians().sin_cos();
        for i in 0..3 {
            for j in 0..3 {
                let product: f64 = (0..3).map(|k| r[i][k] * r[j][k]).sum();
                prop_assert!((product - f64::from(u8::from(i == j))).abs() < 1e-14);
            }
            let image: f64 = (0..3).map(|k| r[i][k] * unit[k]).sum();
            prop_assert!((image - unit[i]).abs() < 1e-14);
        }
        prop_assert!((r[0][0] + r[1][1] + r[2][2] - 1.0 - 2.0 * cosine).abs() < 1e-13);
        let skew = [r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]];
        prop_assert!((0..3).all(|c| (skew[c] - 2.0 * sine * unit[c]).abs() < 1e-13));
    }
}

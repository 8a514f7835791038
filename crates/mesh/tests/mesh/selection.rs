//! Nodes and names found in a box of unit cubes, where they can be counted.

use slipstick_mesh::{Mesh, MeshError};

use crate::support::cubes;

#[test]
fn sets_and_surfaces_have_nodes_and_names() {
    let mut mesh = cubes("b", [2, 1, 1]);
    mesh.node_sets.insert("pins".into(), vec![0, 5]);
    mesh.node_sets.insert("b_ymin".into(), vec![7]);
    assert_eq!(mesh.set_nodes("pins").unwrap().as_ref(), &[0, 5]);
    assert_eq!(mesh.set_nodes("b_xmin").unwrap().as_ref(), &[0, 3, 6, 9]);
    // A node set goes before a surface of its name.
    assert_eq!(mesh.set_nodes("b_ymin").unwrap().as_ref(), &[7]);
    assert!(mesh.set_nodes("b").is_none());
    assert_eq!(mesh.names(), vec!["b_xmax", "b_xmin", "b_ymax", "b_ymin", "b_zmax", "b_zmin", "pins"]);
    assert_eq!(mesh.body("b"), Some(&mesh.bodies[0]));
    assert_eq!(mesh.body("c"), None);
    assert_eq!((mesh.body_of_element(1), mesh.body_of_element(2)), (Some(0), None));
}

#[test]
fn nodes_are_found_by_place() {
    let mesh = cubes("b", [4, 4, 4]);
    let corner = mesh.nodes_in_box([0.0; 3], [1.0; 3], None);
    assert_eq!(corner, vec![0, 1, 5, 6, 25, 26, 30, 31]);
    assert_eq!(mesh.nodes_in_box([0.0; 3], [1.0; 3], Some(&[30, 2, 1, 30, 999])), vec![1, 30]);
    assert!(mesh.nodes_in_box([1.0; 3], [0.0; 3], None).is_empty());

    let top = mesh.nodes_on_plane([9.0, 4.0, 9.0], [0.0, -3.0, 0.0], 1e-9, None).unwrap();
    assert_eq!(top, mesh.surfaces["b_ymax"].nodes());
    // The diagonal x + z = 4 holds 5 columns of 5; the distance counts, not the length of the
    // normal.
    assert_eq!(mesh.nodes_on_plane([4.0, 0.0, 0.0], [10.0, 0.0, 10.0], 0.7, None).unwrap().len(), 25);
    assert_eq!(mesh.nodes_on_plane([4.0, 0.0, 0.0], [10.0, 0.0, 10.0], 0.71, None).unwrap().len(), 25 + 40);

    // Around the vertical centre line: 1 + 4 columns within 1, of which 3 levels.
    let core = mesh.nodes_in_cylinder([2.0, 1.0, 2.0], [2.0, 3.0, 2.0], 1.0, None).unwrap();
    assert_eq!(core.len(), 15);
    assert!(core.is_sorted());
    assert_eq!(mesh.nodes_in_cylinder([2.0, 3.0, 2.0], [2.0, 1.0, 2.0], 0.99, Some(&core)).unwrap().len(), 3);

    assert_eq!(mesh.nearest_node([0.9, 0.1, 0.2], None), Some(1));
    // Two nodes are equally near: the lower number.
    assert_eq!(mesh.nearest_node([0.5, 0.0, 0.0], Some(&[1, 0])), Some(0));
    assert_eq!(mesh.nearest_node([f64::NAN; 3], None), None);
    assert_eq!(Mesh::default().nearest_node([0.0; 3], None), None);
}

#[test]
fn selectors_without_direction_or_size_are_errors() {
    let mesh = cubes("b", [1; 3]);
    let name_of = |result: Result<Vec<u32>, MeshError>| match result {
        Err(MeshError::Parameter { parameter, .. }) => parameter,
        other => panic!("{other:?}"),
    };
    assert_eq!(name_of(mesh.nodes_on_plane([0.0; 3], [0.0; 3], 0.1, None)), "normal");
    assert_eq!(name_of(mesh.nodes_on_plane([0.0; 3], [0.0, 1.0, 0.0], f64::NAN, None)), "tolerance");
    assert_eq!(name_of(mesh.nodes_in_cylinder([1.0; 3], [1.0; 3], 1.0, None)), "end");
    assert_eq!(name_of(mesh.nodes_in_cylinder([1.0; 3], [2.0; 3], -1.0, None)), "radius");
}

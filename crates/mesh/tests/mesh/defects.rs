//! Every kind of defect, planted and found; the repair of facets; meshes that are pure nonsense.

use proptest::prelude::*;
use slipstick_mesh::{Body, Element, Facet, FacetNodes, Mesh, MeshDefect, MeshError, Surface};

use crate::support::cubes;

fn two_bodies() -> Mesh {
    let mut die = cubes("die", [1, 1, 1]);
    die.nodes.iter_mut().for_each(|x| x[1] += 5.0);
    Mesh::merge(vec![cubes("slab", [2, 1, 1]), die]).unwrap()
}

/// The defects after one change.
fn after(change: impl Fn(&mut Mesh)) -> Vec<MeshDefect> {
    let mut mesh = two_bodies();
    change(&mut mesh);
    mesh.check()
}

#[test]
fn defects_of_bodies_are_found() {
    assert_eq!(two_bodies().check(), vec![]);
    assert_eq!(two_bodies().validate(), Ok(()));
    let found = after(|mesh| mesh.bodies[1].name = "slab".into());
    assert!(matches!(&found[..], [MeshDefect::BodyRange { reason, .. }] if reason.contains("name of another")));
    let found = after(|mesh| mesh.bodies[1].elements = 2..9);
    assert!(
        matches!(&found[..], [MeshDefect::BodyRange { body, reason }] if body == "die" && reason.contains("up to 9"))
    );
    let found = after(|mesh| mesh.bodies[0].elements = 0..1);
    assert_eq!(found, vec![MeshDefect::ElementsWithoutBody { elements: vec![1] }]);
    let found = after(|mesh| mesh.bodies[1].elements = 1..3);
    assert!(matches!(&found[0], MeshDefect::BodyRange { reason, .. } if reason.contains("previous body")));
    assert!(matches!(&found[1], MeshDefect::SharedNodes { .. }));
    let found = after(|mesh| {
        mesh.bodies.remove(1);
    });
    assert_eq!(found, vec![MeshDefect::ElementsWithoutBody { elements: vec![2] }]);
}

/// The nodes of a hexahedron, to be changed.
fn hex(mesh: &mut Mesh, element: usize) -> &mut [u32; 8] {
    match &mut mesh.elements[element] {
        Element::Hex8(nodes) => nodes,
        other => panic!("{other:?}"),
    }
}

#[test]
fn defects_of_nodes_are_found() {
    // A far corner of the die.
    let found = after(|mesh| mesh.nodes[19][2] = f64::NAN);
    assert_eq!(found, vec![MeshDefect::NotFinite { nodes: vec![19] }]);
    let found = after(|mesh| mesh.nodes.push([9.0; 3]));
    assert_eq!(found, vec![MeshDefect::UnusedNodes { nodes: vec![20] }]);
    let found = after(|mesh| mesh.bodies[0].nodes = 0..11);
    assert_eq!(found, vec![MeshDefect::NodesOutsideBody { body: "slab".into(), nodes: vec![11] }]);
    let found = after(|mesh| {
        mesh.nodes[12] = mesh.nodes[11];
        hex(mesh, 2)[0] = 11;
        mesh.surfaces.clear();
    });
    let bodies = ["slab".to_owned(), "die".to_owned()];
    assert!(found.contains(&MeshDefect::SharedNodes { bodies, nodes: vec![11] }), "{found:?}");
    assert!(found.contains(&MeshDefect::UnusedNodes { nodes: vec![12] }));
}

#[test]
fn defects_of_elements_are_found() {
    let found = after(|mesh| hex(mesh, 1)[6] = 99);
    assert!(found.contains(&MeshDefect::NodeOutOfRange { body: "slab".into(), elements: vec![1], nodes: 20 }));
    let found = after(|mesh| {
        hex(mesh, 2)[1] = hex(mesh, 2)[0];
        mesh.surfaces.clear();
    });
    assert!(found.contains(&MeshDefect::RepeatedNode { body: "die".into(), elements: vec![2] }));
    assert!(found.iter().any(|d| matches!(d, MeshDefect::Inverted { elements, .. } if elements == &[2])));
    // One corner pushed through the middle of the element: only some Jacobians are negative.
    let found = after(|mesh| mesh.nodes[19] = [0.3, 5.3, 0.3]);
    let [MeshDefect::Inverted { body, elements, worst }] = &found[..] else { panic!("{found:?}") };
    assert_eq!((body.as_str(), elements.as_slice()), ("die", &[2][..]));
    assert!(*worst < 0.0);
    // A mirrored body: the whole of it.
    let found = after(|mesh| mesh.nodes.iter_mut().for_each(|x| x[0] = -x[0]));
    assert_eq!(
        found,
        vec![
            MeshDefect::Inverted { body: "slab".into(), elements: vec![0, 1], worst: -0.125 },
            MeshDefect::Inverted { body: "die".into(), elements: vec![2], worst: -0.125 },
        ]
    );
    // An element twice.
    let found = after(|mesh| {
        mesh.elements.push(mesh.elements[2]);
        mesh.bodies[1].elements = 2..4;
    });
    assert!(found.contains(&MeshDefect::OverlappingFaces { elements: vec![2, 3] }));
}

#[test]
fn defects_of_sets_and_surfaces_are_found() {
    let found = after(|mesh| drop(mesh.node_sets.insert("pins".into(), vec![3, 3, 50])));
    let set = || "pins".to_owned();
    let expected =
        vec![MeshDefect::SetOutOfRange { set: set(), nodes: vec![50] }, MeshDefect::SetNotSorted { set: set() }];
    assert_eq!(found, expected);

    let surface = || "slab_ymax".to_owned();
    let edit =
        |change: fn(&mut Vec<Facet>)| after(|mesh| change(&mut mesh.surfaces.get_mut("slab_ymax").unwrap().facets));
    let found = edit(|facets| facets[1].nodes.reverse());
    assert_eq!(found, vec![MeshDefect::InwardFacets { surface: surface(), facets: vec![1] }]);
    let found = edit(|facets| facets[1].nodes.swap(1, 2));
    assert_eq!(found, vec![MeshDefect::StrayFacets { surface: surface(), facets: vec![1] }]);
    let found = edit(|facets| facets[0].element = 1);
    assert_eq!(found, vec![MeshDefect::StrayFacets { surface: surface(), facets: vec![0] }]);
    let found = edit(|facets| facets[0].element = 77);
    assert_eq!(found, vec![MeshDefect::StrayFacets { surface: surface(), facets: vec![0] }]);
    let found = edit(|facets| facets.push(facets[0]));
    assert_eq!(found, vec![MeshDefect::RepeatedFacets { surface: surface(), facets: vec![2] }]);
    // A facet may start at any of its nodes.
    assert_eq!(edit(|facets| facets[0].nodes.rotate_left(1)), vec![]);
    // The face between the slab's two elements: nodes with x = 1.
    let found = after(|mesh| {
        let between = Facet { nodes: [1, 4, 10, 7].into(), element: 0 };
        drop(mesh.surfaces.insert("cut".into(), Surface { facets: vec![between] }));
    });
    assert_eq!(found, vec![MeshDefect::InteriorFacets { surface: "cut".into(), facets: vec![0] }]);
}

#[test]
fn orient_facets_turns_what_it_can_and_keeps_first_nodes() {
    let mut mesh = two_bodies();
    let sound = mesh.clone();
    assert_eq!(mesh.orient_facets(), 0);
    let facets = &mut mesh.surfaces.get_mut("slab_ymax").unwrap().facets;
    facets[0].nodes.swap(1, 3);
    facets[1].nodes.swap(1, 2);
    assert_eq!(mesh.orient_facets(), 2);
    assert_eq!(mesh, sound);
    let facets = &mut mesh.surfaces.get_mut("slab_ymax").unwrap().facets;
    facets[0].nodes.reverse();
    assert_eq!(mesh.orient_facets(), 1);
    assert_eq!(mesh.check(), vec![]);
    assert_eq!(mesh.surfaces["slab_ymax"].facets[0].nodes[0], sound.surfaces["slab_ymax"].facets[0].nodes[3]);
    mesh.surfaces.get_mut("slab_ymax").unwrap().facets[0].element = 2;
    assert_eq!(mesh.orient_facets(), 0);
}

#[test]
fn messages_name_the_place_and_the_cure() {
    let elements: Vec<u32> = (10..30).collect();
    let defect = MeshDefect::Inverted { body: "die".into(), elements, worst: -0.5 };
    let message = MeshError::Defects(vec![defect]).to_string();
    assert_eq!(
        message,
        "the mesh has 1 defect(s) (numbers count from 0):\n  - body `die`: element(s) 10, 11, 12, 13, 14, 15, 16, 17, … \
         (20 in all) are inverted or degenerate (smallest Jacobian determinant -5.000e-1): correct their numbering or shape"
    );
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever a reader may produce, the check reports it and does not panic.
    #[test]
    fn check_and_repair_survive_nonsense(
        nodes in prop::collection::vec(prop::array::uniform3(-1.0_f64..1.0), 0..12),
        hexes in prop::collection::vec(prop::array::uniform8(0_u32..14), 0..4),
        range in (0_usize..6, 0_usize..6, 0_usize..14, 0_usize..14),
        tets in prop::collection::vec(prop::array::uniform4(0_u32..14), 0..4),
        wedges in prop::collection::vec(prop::array::uniform6(0_u32..14), 0..4),
        facets in prop::collection::vec((prop::array::uniform4(0_u32..14), 3_usize..5, 0_u32..7), 0..4),
    ) {
        let nodes_of = |nodes: &[u32]| FacetNodes::new(nodes).unwrap();
        let facets: Vec<Facet> =
            facets.into_iter().map(|(nodes, n, element)| Facet { nodes: nodes_of(&nodes[..n]), element }).collect();
        let others = tets.into_iter().map(Element::Tet4).chain(wedges.into_iter().map(Element::Wedge6));
        let elements = hexes.into_iter().map(Element::Hex8).chain(others).collect();
        let body = Body { name: "b".into(), elements: range.0..range.1, nodes: range.2..range.3 };
        let mut mesh = Mesh { nodes, elements, bodies: vec![body], ..Mesh::default() };
        mesh.surfaces.insert("s".into(), Surface { facets });
        prop_assert!(!mesh.check().is_empty());
        mesh.orient_facets();
    }
}

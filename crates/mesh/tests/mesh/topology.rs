//! Adjacency and colours against brute force; surfaces made of quadrilaterals and of nodes.

use std::collections::BTreeSet;

use slipstick_mesh::{Body, BoxShape, Element, FacetNodes, HalfBallShape, Mesh, MeshError, box_mesh, half_ball};

use crate::support::{assert_sound, cubes};

fn ball() -> Mesh {
    half_ball("ball", &HalfBallShape { radius: 1.0, elements: [4, 2, 3] }).unwrap()
}

#[test]
fn adjacency_agrees_with_brute_force() {
    let mesh = Mesh::merge(vec![ball(), cubes("slab", [3, 2, 2])]).unwrap();
    let (elements, neighbours) = (mesh.node_elements(), mesh.node_neighbours());
    assert_eq!(elements.offsets.len(), mesh.nodes.len() + 1);
    assert_eq!(neighbours.len(), mesh.nodes.len());
    for node in 0..mesh.nodes.len() {
        let around: Vec<u32> = (0..mesh.elements.len() as u32)
            .filter(|&e| mesh.elements[e as usize].nodes().contains(&(node as u32)))
            .collect();
        assert_eq!(elements.of(node), around);
        let expected: BTreeSet<u32> = around.iter().flat_map(|&e| mesh.elements[e as usize].nodes()).copied().collect();
        assert!(neighbours[node].iter().eq(&expected));
    }
}

#[test]
fn inner_nodes_of_a_box_have_27_neighbours_and_free_nodes_only_themselves() {
    let mut mesh = cubes("b", [2, 2, 2]);
    mesh.nodes.push([9.0; 3]);
    let neighbours = mesh.node_neighbours();
    assert_eq!(neighbours[13], (0..27).collect::<Vec<_>>());
    assert_eq!(neighbours[0].len(), 8);
    assert_eq!(neighbours[27], vec![27]);
}

#[test]
fn elements_of_a_colour_share_no_node() {
    for (mesh, most) in [(cubes("b", [5, 4, 3]), 8), (ball(), 12), (Mesh::default(), 0)] {
        let colours = mesh.element_colours();
        let mut all: Vec<u32> = Vec::new();
        for colour in &colours {
            assert!(colour.is_sorted_by(|a, b| a < b));
            let mut nodes: Vec<u32> = colour.iter().flat_map(|&e| mesh.elements[e as usize].nodes()).copied().collect();
            nodes.sort_unstable();
            nodes.dedup();
            assert_eq!(nodes.len(), 8 * colour.len());
            all.extend(colour);
        }
        all.sort_unstable();
        assert!(all.into_iter().eq(0..mesh.elements.len() as u32));
        // Eight colours are the least for a box; the greedy order finds them.
        assert!(colours.len() <= most, "{} colours", colours.len());
    }
}

#[test]
fn quadrilaterals_find_their_elements_and_turn_outward() {
    let mesh = ball();
    let dome = &mesh.surfaces["ball_dome"];
    let mut quads: Vec<FacetNodes> = dome.facets.iter().map(|facet| facet.nodes).collect();
    quads[0].reverse();
    quads[1].swap(0, 1);
    assert_eq!(&mesh.surface_of_facets(&quads).unwrap(), dome);
    assert!(matches!(
        mesh.surface_of_facets(&[quads[0], [0, 1, 2, 3].into()]),
        Err(MeshError::NotOnBoundary { facet: 1, .. })
    ));
    let cut = cubes("b", [2, 1, 1]);
    let error = cut.surface_of_facets(&[[1, 4, 10, 7].into()]).unwrap_err();
    assert!(error.to_string().contains("between two elements"), "{error}");
}

#[test]
fn nodes_make_the_surface_that_they_cover() {
    let mesh = Mesh::merge(vec![cubes("slab", [3, 2, 2]), ball()]).unwrap();
    let top = mesh.surface_of_nodes(&mesh.surfaces["slab_ymax"].nodes());
    assert_eq!(top, mesh.surfaces["slab_ymax"]);
    let all: Vec<u32> = (0..mesh.nodes.len() as u32).collect();
    assert_eq!(mesh.surface_of_nodes(&all).facets.len(), mesh.boundary(0).facets.len() + mesh.boundary(1).facets.len());
    assert!(mesh.surface_of_nodes(&[0, 1, u32::MAX]).facets.is_empty());
}

#[test]
fn a_box_with_a_hole_through_it_is_a_torus() {
    // Removing the middle column of 3 × 3 × 1 leaves a closed boundary with Euler characteristic 0.
    let mut mesh = cubes("frame", [3, 3, 1]);
    mesh.elements.remove(4);
    mesh.bodies[0].elements = 0..8;
    mesh.surfaces.clear();
    let boundary = mesh.boundary(0);
    assert_eq!(boundary.facets.len(), 8 + 8 + 12 + 4);
    mesh.surfaces.insert("frame_all".into(), boundary);
    assert_eq!(assert_sound(&mesh), 0);
}

/// Two boxes in one body, face to face: the 3 × 3 nodes of the common face stand twice, nothing is
/// connected.
#[test]
fn unmerged_nodes_and_separate_parts_are_found() {
    let shape = |x: f64| BoxShape { min: [x, 0.0, 0.0], max: [x + 1.0, 1.0, 1.0], elements: [2; 3], grading: [1.0; 3] };
    let whole = box_mesh("a", &shape(0.0)).unwrap();
    assert_eq!(whole.connected_parts(0), [(0..27).collect::<Vec<u32>>()]);
    assert!(whole.coincident_nodes(0, 1e-6).is_empty());
    let mut two = Mesh::merge(vec![whole, box_mesh("b", &shape(1.0 + 1e-9)).unwrap()]).unwrap();
    two.bodies = vec![Body { name: "a".into(), elements: 0..16, nodes: 0..54 }];
    assert_eq!(two.connected_parts(0), [(0..27).collect::<Vec<u32>>(), (27..54).collect()]);
    let pairs = two.coincident_nodes(0, 1e-6);
    assert_eq!(pairs.len(), 9);
    for [a, b] in pairs {
        assert!(
            two.nodes[a as usize][0] == 1.0 && b == a + 25,
            "{a} {b}: node 2 of a row is node 0 of the other box's"
        );
    }
    assert!(two.coincident_nodes(0, 1e-10).is_empty());
    // in reach of each other on both sides of any grid
    for shift in [0.0, 1e-6, 1.7e-6, 3.3e-6] {
        two.nodes.iter_mut().for_each(|x| *x = x.map(|c| c + shift));
        assert_eq!(two.coincident_nodes(0, 1e-6).len(), 9);
    }
}

/// Expected values: the volume of the hexahedra with plane faces, their surfaces' areas, and closed
/// boundaries.
#[test]
fn hexahedra_are_divided_into_tetrahedra() {
    let whole = cubes("b", [3, 2, 2]);
    let parts = whole.divided(|_| true);
    assert_eq!(parts.elements.len(), 6 * 12);
    assert!(parts.elements.iter().all(|element| matches!(element, Element::Tet4(_))));
    assert_sound(&parts);
    assert_eq!(parts.connected_parts(0).len(), 1);
    let mut centroid = [0.0; 3];
    for (element, volume) in parts.element_volumes().into_iter().enumerate() {
        assert!((volume - 1.0 / 6.0).abs() < 1e-15, "{element}: {volume}");
        (0..3).for_each(|c| centroid[c] += volume / 12.0 * parts.centroid(element)[c]);
    }
    assert!((0..3).all(|c| (centroid[c] - [1.5, 1.0, 1.0][c]).abs() < 1e-14), "{centroid:?}");
    for (name, surface) in &whole.surfaces {
        let triangles = &parts.surfaces[name];
        assert_eq!(triangles.facets.len(), 2 * surface.facets.len());
        assert!((parts.surface_area(triangles) - whole.surface_area(surface)).abs() < 1e-14);
        assert_eq!(triangles.nodes(), surface.nodes());
    }
    let ball = ball();
    assert_sound(&ball.divided(|_| true));
}

/// Between hexahedra and tetrahedra two triangles cover each quadrilateral: no boundary, and no
/// place for a facet.
#[test]
fn hexahedra_and_tetrahedra_meet_inside_a_body() {
    let whole = cubes("b", [3, 2, 2]);
    let mixed = whole.divided(|element| element % 3 == 0);
    assert_eq!(mixed.elements.len(), 4 * 6 + 8);
    assert_sound(&mixed);
    let divided = mixed.divided_quadrilaterals(0);
    assert_eq!(divided.len(), 4);
    assert!(divided.iter().flatten().all(|face| face.iter().all(|&n| mixed.nodes[n as usize][0] == 1.0)));
    let error = mixed.surface_of_facets(&divided[0][1..]).unwrap_err();
    assert!(error.to_string().contains("between two elements"), "{error}");
    assert!(whole.divided_quadrilaterals(0).is_empty() && whole.divided(|_| true).divided_quadrilaterals(0).is_empty());
}

/// Expected values: half the volume of the cubes, their surfaces' areas, and closed boundaries.
/// Only the faces at the ends of the wedges are triangles.
#[test]
fn hexahedra_are_divided_into_wedges() {
    let whole = cubes("b", [3, 2, 2]);
    for axis in 0..3 {
        let parts = whole.divided_into_wedges(|_| Some(axis));
        assert_eq!(parts.elements.len(), 24);
        assert!(parts.elements.iter().all(|element| matches!(element, Element::Wedge6(_))));
        assert_sound(&parts);
        assert_eq!(parts.connected_parts(0).len(), 1);
        let mut centroid = [0.0; 3];
        for (element, volume) in parts.element_volumes().into_iter().enumerate() {
            assert!((volume - 0.5).abs() < 1e-15, "{element}: {volume}");
            (0..3).for_each(|c| centroid[c] += volume / 12.0 * parts.centroid(element)[c]);
        }
        assert!((0..3).all(|c| (centroid[c] - [1.5, 1.0, 1.0][c]).abs() < 1e-14), "{centroid:?}");
        for (name, surface) in &whole.surfaces {
            let parts_of = &parts.surfaces[name];
            let triangles = name.starts_with(["b_x", "b_y", "b_z"][axis]);
            assert_eq!(parts_of.facets.len(), surface.facets.len() * if triangles { 2 } else { 1 });
            assert!((parts.surface_area(parts_of) - whole.surface_area(surface)).abs() < 1e-14);
            assert_eq!(parts_of.nodes(), surface.nodes());
        }
    }
}

/// A cross of four quarters: hexahedra, wedges along z, wedges along x, tetrahedra. Wedges share
/// quadrilaterals with hexahedra and triangles with tetrahedra, so that all faces fit.
#[test]
fn wedges_join_hexahedra_and_tetrahedra() {
    let whole = cubes("b", [4, 2, 4]);
    let centre = |element: usize| whole.centroid(element).map(|c| c > 2.0);
    let wedges = whole.divided_into_wedges(|element| match centre(element) {
        [true, _, false] => Some(2),
        [false, _, true] => Some(0),
        _ => None,
    });
    let mixed = wedges.divided(|element| wedges.centroid(element)[0] > 2.0 && wedges.centroid(element)[2] > 2.0);
    assert_eq!(mixed.elements.len(), 8 + 16 + 16 + 48);
    assert_sound(&mixed);
    assert!(mixed.divided_quadrilaterals(0).is_empty());
    assert_eq!(mixed.connected_parts(0).len(), 1);
    assert!((mixed.element_volumes().iter().sum::<f64>() - 32.0).abs() < 1e-13);
}

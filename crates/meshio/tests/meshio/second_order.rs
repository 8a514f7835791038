//! Second-order elements: counted in errors, and read without their mid-side nodes.

use slipstick_mesh::{Element, Mesh};
use slipstick_meshio::{CellKind, FileMesh};

use crate::{data, parse, places, sound};

fn file(name: &str) -> FileMesh {
    FileMesh::parse(&data(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// The body of corners alone, fit for analysis.
fn of_corners(file: &FileMesh, name: &str, part: Option<&str>) -> Mesh {
    let read = file.first_order_body(name, part, 1.0).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((read.mesh.check(), &read.notices[..]), (vec![], &[][..]), "{name}");
    read.mesh
}

/// Counts by `make.py`: 16 hexahedra in the slab, 4 in the block, 16 wedges in the block of wedges.
#[test]
fn elements_are_counted_by_kind_and_part() {
    let hexahedra = file("gmsh_41_second_order.msh");
    let solids = |name: &str| file(name).solids(Some("block"));
    assert_eq!(solids("gmsh_wedges_second_order.msh"), [(CellKind::Wedge18, 16)].into());
    assert_eq!(solids("gmsh_wedges_second_order.inp"), [(CellKind::Wedge15, 16)].into());
    assert_eq!(hexahedra.solids(Some("block")), [(CellKind::Hex27, 4)].into());
    assert_eq!(hexahedra.solids(None), [(CellKind::Hex27, 20)].into());
}

/// Boxes as Gmsh wrote them: a file of second order, one of first order, and the body.
const BOXES: [(&str, &str, &str); 4] = [
    ("gmsh_41_second_order.msh", "gmsh_41_ascii.msh", "slab"),
    ("gmsh_41_second_order.msh", "gmsh_41_ascii.msh", "block"),
    ("gmsh_wedges_second_order.msh", "gmsh_wedges.msh", "block"),
    ("gmsh_wedges_second_order.inp", "gmsh_wedges.msh", "block"),
];

/// The same boxes, as first order from the same program: nodes, volumes and surfaces.
#[test]
fn corners_of_second_order_are_the_mesh_of_first_order() {
    for (second, first, body) in BOXES {
        let (found, expected) =
            (of_corners(&file(second), body, Some(body)), sound(&file(first), body, Some(body)).mesh);
        let all = |mesh: &Mesh| (0..mesh.nodes.len() as u32).collect::<Vec<_>>();
        assert_eq!(places(&found, &all(&found)), places(&expected, &all(&expected)), "{second} {body}");
        let volume = |mesh: &Mesh| mesh.element_volumes().iter().sum::<f64>();
        assert_eq!(found.elements.len(), expected.elements.len());
        assert!((volume(&found) - volume(&expected)).abs() < 1e-10, "{second} {body}");
        for end in ["bottom", "top", "corner"].map(|end| format!("{body}_{end}")) {
            let of = |mesh: &Mesh| places(mesh, &mesh.set_nodes(&end).unwrap_or_else(|| panic!("{second}: {end}")));
            assert_eq!(of(&found), of(&expected), "{second} {end}");
            let facets = |mesh: &Mesh| mesh.surfaces.get(&end).map(|surface| surface.facets.len());
            assert_eq!(facets(&found), facets(&expected), "{second} {end}");
        }
    }
}

/// First order stays what it is.
#[test]
fn meshes_of_first_order_do_not_change() {
    for (name, part) in [("gmsh_41_ascii.msh", "slab"), ("gmsh_tetrahedra.msh", "slab"), ("gmsh_wedges.msh", "block")] {
        let file = file(name);
        assert_eq!(of_corners(&file, "a", Some(part)), sound(&file, "a", Some(part)).mesh, "{name}");
    }
}

/// A tetrahedron of 10 nodes with an edge, a set of its mid-side nodes and a face: S3 of nodes 2,
/// 3, 4 in Abaqus' reference.
const TET10: &str = "*Node\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n5, .5, -.1, 0\n6, .5, .5, 0\n7, 0, .5, 0\n\
                     8, 0, 0, .5\n9, .5, 0, .5\n10, 0, .5, .5\n*Element, type=C3D10M, elset=tip\n\
                     7, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10\n*Element, type=S6\n8, 1, 3, 2, 7, 6, 5\n*Surface, name=slope\n7, S3\n\
                     *Elset, elset=under\n8\n*Nset, nset=some\n1, 5, 6\n*Nset, nset=middle\n5, 6\n";

#[test]
fn sets_of_second_order_keep_their_corners() {
    let file = parse(TET10);
    let whole = file.body("a", Some("tip"), 2.0).expect("a tetrahedron of 10 nodes").mesh;
    assert_eq!((whole.check(), whole.nodes.len()), (vec![], 10));
    assert_eq!(whole.surfaces["a_slope"].nodes(), [1, 2, 3, 5, 8, 9]);
    assert_eq!(whole.surfaces["a_under"].nodes(), [0, 1, 2, 4, 5, 6]);
    assert_eq!((&whole.node_sets["a_some"][..], &whole.node_sets["a_middle"][..]), (&[0, 4, 5][..], &[4, 5][..]));
    let read = file.first_order_body("a", Some("tip"), 2.0).expect("a body");
    let mesh = read.mesh;
    assert_eq!((mesh.check(), mesh.nodes.len()), (vec![], 4));
    assert_eq!(mesh.elements, [Element::Tet4([0, 1, 2, 3])]);
    assert!((mesh.element_volume(0) - 8.0 / 6.0).abs() < 1e-15);
    assert_eq!(mesh.surfaces["a_slope"].nodes(), [1, 2, 3]);
    assert_eq!(mesh.surfaces["a_under"].nodes(), [0, 1, 2]);
    assert_eq!(mesh.node_sets["a_some"], [0]);
    assert!(!mesh.node_sets.contains_key("a_middle"));
    assert_eq!(read.notices, ["the node set `middle` is left out: it has only mid-side nodes"]);
}

/// Beside the tetrahedron of second order, one of first order stands on half of its edge: without
/// the node between, the two would not fit.
#[test]
fn mid_side_nodes_that_are_corners_are_refused() {
    let text = TET10.replace("*Element, type=S6", "*Element, type=C3D4, elset=tip\n9, 1, 5, 8, 11\n*Element, type=S6");
    let text = text.replace("\n*Element, type=C3D10M", "\n11, 0, -1, 0\n*Element, type=C3D10M");
    let error = parse(&text).body("a", Some("tip"), 1.0).expect_err("mixed");
    assert!(error.message.starts_with("it is of second order, and element 9 of first order"), "{error}");
    let error = parse(&text).first_order_body("a", Some("tip"), 1.0).expect_err("torn");
    assert!(error.place.starts_with("element 7 at"), "{error}");
    assert!(error.message.starts_with("its mid-side node 5 is a corner of element 9"), "{error}");
    assert!(error.cure.contains("with the same order"), "{error}");
}

/// VTK's types 24 (tetrahedron of 10 nodes), 25 (hexahedron of 20), 26 (wedge of 15, as before VTK
/// 9.7 and since) and 27 (pyramid of 13), each with its corners first.
#[test]
fn cells_of_vtk_are_read_by_their_corners() {
    let cube = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];
    let text = |vtk: u8, corners: &[usize], nodes: usize| {
        let points: String = cube.iter().map(|[x, y, z]| format!("{x} {y} {z} ")).collect();
        let more: String = (corners.len()..nodes).map(|n| format!("{n} 9 9 ")).collect();
        let middle = (8..8 + nodes - corners.len()).map(|n| n.to_string());
        let connectivity: Vec<String> = corners.iter().map(usize::to_string).chain(middle).collect();
        let array = |name: &str, values: &str| {
            format!(
                "<DataArray type=\"Float64\" Name=\"{name}\" NumberOfComponents=\"3\" format=\"ascii\">{values}</DataArray>"
            )
        };
        let list = |name: &str, values: &str| {
            format!("<DataArray type=\"Int64\" Name=\"{name}\" format=\"ascii\">{values}</DataArray>")
        };
        format!(
            "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece NumberOfPoints=\"{}\" NumberOfCells=\"1\"><Points>{}\
             </Points><Cells>{}{}{}</Cells></Piece></UnstructuredGrid></VTKFile>",
            8 + nodes - corners.len(),
            array("Points", &(points + &more)),
            list("connectivity", &connectivity.join(" ")),
            list("offsets", &nodes.to_string()),
            list("types", &vtk.to_string()),
        )
    };
    let cases: [(u8, &[usize], usize, f64, &str); 4] = [
        (24, &[0, 1, 3, 4], 10, 1.0 / 6.0, "tet10"),
        (25, &[0, 1, 2, 3, 4, 5, 6, 7], 20, 1.0, "hex20"),
        (26, &[0, 1, 3, 4, 5, 7], 15, 0.5, "wedge15"),
        (26, &[0, 3, 1, 4, 7, 5], 15, 0.5, "wedge15"),
    ];
    for (vtk, corners, nodes, volume, name) in cases {
        let file = parse(&text(vtk, corners, nodes));
        let error = file.body("a", None, 1.0).expect_err(name);
        // mid-side nodes far from the edges
        assert!(error.message.contains(name) || error.message.contains("is folded or flat"), "{error}");
        let mesh = of_corners(&file, "a", None);
        assert!((mesh.element_volume(0) - volume).abs() < 1e-15, "{name}");
    }
    let pyramid = parse(&text(27, &[0, 1, 2, 3, 4], 13));
    for error in [pyramid.body("a", None, 1.0), pyramid.first_order_body("a", None, 1.0)] {
        let error = error.expect_err("a pyramid");
        assert!(error.message.starts_with("1 of 1 elements are pyramids: 1 pyramid13"), "{error}");
        assert!(error.cure.starts_with("pyramids are not supported"), "{error}");
    }
}

/// The hexahedra of 27 nodes and the wedges of 18 and 15 that Gmsh wrote: volumes, areas and the position of every
/// node, which is that of the shape functions of the linear element.
#[test]
fn elements_of_second_order_are_read_whole() {
    for (second, first, body) in BOXES {
        let found = sound(&file(second), body, Some(body)).mesh;
        let linear = sound(&file(first), body, Some(body)).mesh;
        assert_eq!(found.elements.len(), linear.elements.len());
        let raised = linear.second_order(mean).expect("linear elements");
        let all = |mesh: &Mesh| (0..mesh.nodes.len() as u32).collect::<Vec<_>>();
        assert_eq!(places(&found, &all(&found)), places(&raised, &all(&raised)), "{second}");
        let volume = |mesh: &Mesh| mesh.element_volumes().iter().sum::<f64>();
        assert!((volume(&found) - volume(&linear)).abs() < 1e-10, "{second}");
        for end in ["bottom", "top"].map(|end| format!("{body}_{end}")) {
            let nodes = |mesh: &Mesh| places(mesh, &mesh.set_nodes(&end).expect("a set"));
            assert_eq!(nodes(&found), nodes(&raised), "{second} {end}");
        }
        for element in &found.elements {
            let nodes = element.nodes();
            let at = |i: usize| found.nodes[nodes[i] as usize];
            let parents: &[[f64; 3]] = match element {
                Element::Hex27(_) => &slipstick_mesh::second_order::HEX27_NODES,
                Element::Wedge18(_) => &slipstick_mesh::second_order::WEDGE18_NODES,
                other => panic!("{other:?}"),
            };
            for (i, parent) in parents.iter().enumerate() {
                let shape = |corner: usize| -> f64 {
                    let [r, s, z] = *parent;
                    let along = 0.5 * (1.0 + z * if corner < 3 { -1.0 } else { 1.0 });
                    match element {
                        Element::Wedge18(_) => [1.0 - r - s, r, s][corner % 3] * along,
                        _ => {
                            let of = |c: usize| 0.5 * (1.0 + parent[c] * slipstick_mesh::HEX_CORNERS[corner][c]);
                            (0..3).map(of).product()
                        }
                    }
                };
                let corners = element.corners().len();
                let expected: [f64; 3] = std::array::from_fn(|c| (0..corners).map(|k| shape(k) * at(k)[c]).sum());
                assert!((0..3).all(|c| (at(i)[c] - expected[c]).abs() < 1e-9), "node {i}: {:?} {expected:?}", at(i));
            }
        }
    }
}

fn mean(of: &[[f64; 3]]) -> [f64; 3] {
    std::array::from_fn(|c| of.iter().map(|x| x[c]).sum::<f64>() / of.len() as f64)
}

/// Hexahedra of 20 nodes with curved edges, from Abaqus and VTK, one of them inside out: two
/// neighbours share the added node of their face, and the volume is that of the serendipity shape,
/// which is exact for a quadratic bulge of the top: z = 1 + 0.1 (1 − (x − 1)²) over 0 … 2.
#[test]
fn hexahedra_of_20_nodes_are_completed() {
    let top = |x: f64| 1.0 + 0.1 * (1.0 - (x - 1.0) * (x - 1.0));
    let point = |i: usize, j: usize, k: usize| {
        let x = 0.5 * i as f64;
        [x, 0.5 * j as f64, 0.5 * k as f64 * top(x)]
    };
    let number = |i: usize, j: usize, k: usize| 1 + i + 5 * (j + 3 * k);
    let mut text = String::from("*Node\n");
    for (k, j, i) in (0..3).flat_map(|k| (0..3).flat_map(move |j| (0..5).map(move |i| (k, j, i)))) {
        // no nodes at centres of faces
        if [i, j, k].iter().filter(|n| *n % 2 == 1).count() < 2 {
            let [x, y, z] = point(i, j, k);
            text += &format!("{}, {x}, {y}, {z}\n", number(i, j, k));
        }
    }
    text += "*Element, type=C3D20R, elset=both\n";
    for (element, turned) in [(0, false), (1, true)] {
        let at = |n: usize| {
            let [x, y, z] = slipstick_mesh::second_order::HEX27_NODES[n].map(|c| (c + 1.0) as usize);
            number(2 * element + x, y, if turned { 2 - z } else { z }).to_string()
        };
        text += &format!("{}, {}\n", element + 1, (0..20).map(at).collect::<Vec<_>>().join(", "));
    }
    text += "*Surface, name=under\n1, S1\n2, S2\n";
    let read = parse(&text).body("a", Some("both"), 1.0).expect("two hexahedra");
    let mesh = read.mesh;
    assert_eq!(mesh.check(), vec![]);
    assert_eq!(mesh.nodes.len(), 5 * 3 * 3);
    assert_eq!(read.notices.len(), 1, "{:?}", read.notices);
    let volume: f64 = mesh.element_volumes().iter().sum();
    // ∫ over 0 … 2 of the top
    assert!((volume - (2.0 + 0.1 * 4.0 / 3.0)).abs() < 1e-12, "{volume}");
    let area = mesh.surface_area(&mesh.surfaces["a_under"]);
    assert!((area - 2.0).abs() < 1e-12, "{area}");
}

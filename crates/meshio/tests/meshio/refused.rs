//! Meshes that are readable, but no bodies; and orders of nodes that are repaired.

use crate::{data, parse, refused, sound};
use slipstick_meshio::FileMesh;

/// One cube in Gmsh's old format, with its lower face as a physical surface of Gmsh's type
/// `surface`.
fn cube(hex: &str, surface: &str) -> String {
    let corners = ["0 0 0", "1 0 0", "1 1 0", "0 1 0", "0 0 1", "1 0 1", "1 1 1", "0 1 1", "9 9 9"];
    let nodes: String = corners.iter().enumerate().map(|(n, x)| format!("{} {x}\n", n + 1)).collect();
    format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n2 7 \"under\"\n3 8 \"cube\"\n$EndPhysicalNames\n\
         $Comments\nanything $Nodes\n$EndComments\n$Nodes\n9\n{nodes}$EndNodes\n\
         $Elements\n2\n1 {surface}\n2 {hex}\n$EndElements\n"
    )
}

const HEX: &str = "5 2 8 1 1 2 3 4 5 6 7 8";
const UNDER: &str = "3 2 7 1 1 2 3 4";

fn body_error(hex: &str, surface: &str) -> slipstick_meshio::MeshFileError {
    parse(&cube(hex, surface)).body("a", None, 1.0).expect_err("no body")
}

/// Bottom and top in the wrong order make the volume negative; swapped, it is the same cube.
#[test]
fn hexahedra_inside_out_are_repaired_and_said() {
    let right = sound(&parse(&cube(HEX, UNDER)), "a", None);
    assert_eq!((right.notices.len(), right.mesh.elements[0]), (0, [0, 1, 2, 3, 4, 5, 6, 7].into()));
    let turned = sound(&parse(&cube("5 2 8 1 5 6 7 8 1 2 3 4", UNDER)), "a", None);
    assert_eq!(turned.mesh.elements, right.mesh.elements);
    assert_eq!(turned.mesh.surfaces, right.mesh.surfaces);
    assert!(turned.notices[0].contains("1 hexahedra") && turned.notices[0].contains("element 2"), "{turned:?}");
    // mirrored: the numbers run the other way round
    let mirrored = sound(&parse(&cube("5 2 8 1 4 3 2 1 8 7 6 5", UNDER)), "a", None);
    assert_eq!(mirrored.notices.len(), 1);
    assert!((mirrored.mesh.element_volume(0) - 1.0).abs() < 1e-15);
}

/// Half of the cube, with bottom and top in the right and in the wrong order.
#[test]
fn wedges_are_read_and_repaired() {
    let right = sound(&parse(&cube("6 2 8 1 1 2 4 5 6 8", "2 2 7 1 1 2 4")), "a", None);
    assert_eq!((right.notices.len(), right.mesh.elements[0]), (0, [0, 1, 2, 3, 4, 5].into()));
    assert!((right.mesh.element_volume(0) - 0.5).abs() < 1e-15);
    assert_eq!(*right.mesh.surfaces["a_under"].facets[0].nodes, [0, 2, 1]);
    let turned = sound(&parse(&cube("6 2 8 1 5 6 8 1 2 4", "3 2 7 1 1 2 6 5")), "a", None);
    assert_eq!(turned.mesh.elements, right.mesh.elements);
    assert_eq!(turned.mesh.surfaces["a_under"].facets[0].nodes.len(), 4);
    assert!(turned.notices[0].contains("1 wedges") && turned.notices[0].contains("element 2"), "{turned:?}");
}

/// The corner of the cube at its first node, of a sixth of its volume; and with two nodes
/// exchanged.
#[test]
fn tetrahedra_are_read_and_repaired() {
    let right = sound(&parse(&cube("4 2 8 1 1 2 4 5", "2 2 7 1 1 2 4")), "a", None);
    assert_eq!((right.notices.len(), right.mesh.elements[0]), (0, [0, 1, 2, 3].into()));
    assert!((right.mesh.element_volume(0) - 1.0 / 6.0).abs() < 1e-15);
    assert_eq!(*right.mesh.surfaces["a_under"].facets[0].nodes, [0, 2, 1]);
    let turned = sound(&parse(&cube("4 2 8 1 1 4 2 5", "2 2 7 1 1 2 4")), "a", None);
    assert!((turned.mesh.element_volume(0) - 1.0 / 6.0).abs() < 1e-15);
    assert!(turned.notices[0].contains("1 tetrahedra") && turned.notices[0].contains("element 2"), "{turned:?}");
}

#[test]
fn elements_that_cannot_be_used_are_refused_by_number_and_place() {
    let cases = [
        ("5 2 8 1 1 2 4 3 5 6 7 8", "element 2 at (0.5000, 0.5000, 0.5000), nodes [1, 2, 4, 3,", "folded"),
        ("5 2 8 1 1 2 3 3 5 6 7 8", "element 2 ", "contains a node twice"),
        ("4 2 8 1 1 2 3 4", "element 2 ", "the tetrahedron is flat"),
        ("4 2 8 1 1 2 3 3", "element 2 ", "contains a node twice"),
        ("6 2 8 1 1 2 4 5 6 3", "element 2 ", "the wedge is folded"),
        ("6 2 8 1 1 2 4 5 6 6", "element 2 ", "contains a node twice"),
        ("7 2 8 1 1 2 3 4 5", "body `a`", "1 of 1 elements are pyramids: 1 pyramid5 (C3D5)"),
        ("11 2 8 1 1 2 3 4 5 6 7 8 9 1", "element 2 ", "contains a node twice"),
        ("18 2 8 1 1 2 4 5 6 8 1 2 3 4 5 6 7 8 9", "element 2 ", "contains a node twice"),
    ];
    for (hex, place, message) in cases {
        let error = body_error(hex, UNDER);
        assert!(error.place.starts_with(place) && error.message.contains(message), "{error}");
    }
    let error = refused(&cube("92 2 8 1 1 2 3 4 5 6 7 8", UNDER));
    assert!(error.message.contains("type 92") && error.place == "line 27", "{error}");
}

/// Why `under` cannot be a surface of the cube.
fn unusable(surface: &str) -> slipstick_meshio::MeshFileError {
    let read = sound(&parse(&cube(HEX, surface)), "a", None);
    assert!(read.mesh.surfaces.is_empty(), "{:?}", read.mesh.surfaces);
    read.unusable["a_under"].clone()
}

/// They are left out with the reason, so that they matter only to cases that use them.
#[test]
fn facets_must_be_faces_of_the_body() {
    let error = unusable("3 2 7 1 1 2 7 8");
    assert!(error.message.contains("is not a face of any element"), "{error}");
    assert_eq!(error.place, "surface `under`, facet at (0.5000, 0.5000, 0.5000), nodes [1, 2, 7, 8]");
    let error = unusable("2 2 7 1 1 2 3");
    assert!(error.message.contains("is not a face of any element"), "{error}");
    let error = unusable("9 2 7 1 1 2 3 4 5 6");
    assert!(error.message.contains("a triangle6 of the surface `under`"), "{error}");
    assert!(error.cure.contains("`first_order = true`"), "{error}");
    let error = unusable("3 2 7 1 1 2 3 9");
    assert!(error.message.contains("nodes that belong to no element"), "{error}");
    // of a part alone, what hangs elsewhere is not its surface
    let read = sound(&parse(&cube(HEX, "3 2 7 1 1 2 3 9")), "a", Some("cube"));
    assert!(read.mesh.surfaces.is_empty() && read.unusable.is_empty());
}

#[test]
fn unknown_parts_are_named_with_those_there_are() {
    let file = FileMesh::parse(&data("gmsh_41_ascii.msh")).expect("readable");
    let error = file.body("a", Some("slap"), 1.0).expect_err("no such part");
    assert_eq!(
        error.to_string(),
        "part `slap`: the file has no such set of solid elements; sets of solid elements: block, slab"
    );
    let unnamed = parse(&cube("5 2 0 1 1 2 3 4 5 6 7 8", UNDER));
    assert!(unnamed.body("a", Some("cube"), 1.0).expect_err("none").cure.contains("omit `part`"));
    let error = body_error("3 2 8 1 1 2 3 4", UNDER);
    assert!(error.message.contains("no solid elements"), "{error}");
}

#[test]
fn formats_that_are_not_read_are_said() {
    let with = |from: &str, to: &str| refused(&cube(HEX, UNDER).replacen(from, to, 1));
    assert!(with("2.2 0 8", "4 0 8").cure.contains("4.1"));
    assert!(refused("$NOD\n1\n1 0 0 0\n$ENDNOD\n").message.contains("1.0"));
    assert!(with("$Comments", "$PartitionedEntities").cure.contains("unpartitioned"));
    assert_eq!(with("2 1 0 0", "2 x 0 0").place, "line 15");
    assert!(with("2 1 0 0", "2 nan 0 0").cure.contains("finite"));
    assert!(with("9\n1 0 0 0", "8\n1 0 0 0").message.contains("$EndNodes is expected"));
    assert!(with("\n9 9 9 9", "\n8 9 9 9").message.contains("twice"));
    let step = refused("ISO-10303-21;\nHEADER;");
    assert!(step.message.contains("geometry (STEP)") && step.cure.contains("slipstick new part.step"), "{step}");
    assert!(refused("solid stl").message.contains("unknown mesh format"));
    assert!(refused("").message.contains("unknown mesh format"));
    assert!(refused("<VTKFile type=\"PolyData\"/>").message.contains("PolyData"));
    assert!(refused("<html></html>").message.contains("not a <VTKFile>"));
    let text = String::from_utf8(data("meshio_ascii.vtu")).expect("text");
    let with = |from: &str, to: &str| refused(&text.replacen(from, to, 1));
    let file = "<VTKFile type=\"UnstructuredGrid\"";
    // a compressor does not matter to arrays of text
    let named = text.replacen(file, &format!("{file} compressor=\"vtkZstdDataCompressor\""), 1);
    assert_eq!(parse(&named), parse(&text));
    assert!(with("NumberOfPoints=\"63\"", "NumberOfPoints=\"64\"").place.contains("Points"));
    assert!(with("NumberOfCells=\"44\"", "NumberOfCells=\"45\"").message.contains("number"));
    assert!(with("</Piece>", "</Piece><Piece>").message.contains("several pieces"));
}

/// A hexahedron and a tetrahedron as older programs write them, with attributes of all kinds.
const LEGACY: &str = "# vtk DataFile Version 2.0\ntwo cells\nASCII\nDATASET UNSTRUCTURED_GRID\n\
    FIELD FieldData 1\nTIME 1 1 double\n0.5\nPOINTS 9 float\n\
    0 0 0 1 0 0 1 1 0 0 1 0 0 0 1 1 0 1 1 1 1 0 1 1 2 0 0\n\
    CELLS 2 14\n8 0 1 2 3 4 5 6 7\n4 1 8 2 5\nCELL_TYPES 2\n12\n10\n\
    POINT_DATA 9\nVECTORS u float\n0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0\n\
    CELL_DATA 2\nSCALARS part int 1\nLOOKUP_TABLE default\n1 2\nSCALARS load double\nLOOKUP_TABLE default\n.5 1\n\
    LOOKUP_TABLE colours 1\n0 0 0 1\n";

#[test]
fn older_vtk_files() {
    let file = FileMesh::parse(LEGACY.as_bytes()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(file.parts().collect::<Vec<_>>(), ["part=1", "part=2"]);
    // a cube, and a tetrahedron with the base 1/2 and the height 1
    let volume = |part| sound(&file, "b", Some(part)).mesh.element_volumes().iter().sum::<f64>();
    assert!((volume("part=1") - 1.0).abs() < 1e-15);
    assert!((volume("part=2") - 1.0 / 6.0).abs() < 1e-15);
    let with = |from: &str, to: &str| {
        assert!(LEGACY.contains(from), "{from}");
        refused(&LEGACY.replacen(from, to, 1))
    };
    assert!(with("UNSTRUCTURED_GRID", "STRUCTURED_POINTS").message.contains("STRUCTURED_POINTS"));
    assert!(with("ASCII", "TEXT").message.contains("instead of ASCII or BINARY"));
    assert!(with("4 1 8 2 5", "4 1 9 2 5").message.contains("does not exist"));
    assert!(with("4 1 8 2 5", "5 1 8 2 5").message.contains("incomplete"));
    assert!(with("4 1 8 2 5", "4 1 -8 2 5").message.contains("-8 is not the number of a node"));
    assert!(with("CELL_DATA 2", "CELL_DATA 3").message.contains("a number is expected"));
    assert!(with("TIME 1 1 double", "TIME 1 1 string").message.contains("texts"));
    assert!(with("float", "half").message.contains("not understood"));
    assert!(with("2 0 0\n", "2 nan 0\n").cure.contains("finite"));
    assert!(with("CELL_TYPES 2\n12\n10", "CELL_TYPES 1\n12").message.contains("number of cells"));
}

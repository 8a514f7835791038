//! What Gmsh, meshio and VTK have written. The expected values are those of the boxes in
//! `tests/data/make.py`, and of the same boxes from the generator.

use slipstick_mesh::{BoxShape, Element, box_mesh};
use slipstick_meshio::FileMesh;

use crate::{data, places, sound};

const GMSH: [&str; 5] =
    ["gmsh_22_ascii.msh", "gmsh_22_binary.msh", "gmsh_41_ascii.msh", "gmsh_41_binary.msh", "gmsh.inp"];
const VTK: [&str; 15] = [
    "meshio_ascii.vtu",
    "meshio_base64.vtu",
    "meshio_base64_zlib.vtu",
    "vtk_ascii.vtu",
    "vtk_base64_big_endian.vtu",
    "vtk_appended_base64.vtu",
    "vtk_appended_base64_zlib.vtu",
    "vtk_raw.vtu",
    "vtk_raw_zlib.vtu",
    "meshio_42_ascii.vtk",
    "meshio_42_binary.vtk",
    "meshio_51_ascii.vtk",
    "meshio_51_binary.vtk",
    "vtk_42_binary.vtk",
    "vtk_51_ascii.vtk",
];

fn shape(body: &str) -> BoxShape {
    let (min, max, elements) = match body {
        "slab" => ([0.0, 0.0, 0.0], [4.0, 1.0, 2.0], [4, 2, 2]),
        _ => ([0.6, 1.0, 0.3], [2.0, 1.7, 1.6], [2, 1, 2]),
    };
    BoxShape { min, max, elements, grading: [1.0; 3] }
}

/// Reads a body out of a file and compares it with the generator's; `part`, `bottom` and `top` as
/// the file names them.
fn compare(file: &FileMesh, body: &str, part: &str, [bottom, top]: [&str; 2], what: &str) {
    let read = sound(file, body, Some(part)).mesh;
    let made = box_mesh(body, &shape(body)).expect("a box");
    let all = |mesh: &slipstick_mesh::Mesh| (0..mesh.nodes.len() as u32).collect::<Vec<_>>();
    assert_eq!(places(&read, &all(&read)), places(&made, &all(&made)), "{what} {body}");
    assert_eq!(read.elements.len(), made.elements.len(), "{what} {body}");
    let volume = |mesh: &slipstick_mesh::Mesh| mesh.element_volumes().iter().sum::<f64>();
    assert!((volume(&read) - volume(&made)).abs() < 1e-10, "{what} {body}");
    for (found, expected, outward) in [(bottom, "ymin", -1.0), (top, "ymax", 1.0)] {
        let surface = read.surfaces.get(found).unwrap_or_else(|| panic!("{what}: {:?}", read.surfaces.keys()));
        let made_surface = &made.surfaces[&format!("{body}_{expected}")];
        assert_eq!(surface.facets.len(), made_surface.facets.len(), "{what} {found}");
        assert_eq!(places(&read, &surface.nodes()), places(&made, &made_surface.nodes()), "{what} {found}");
        for facet in &surface.facets {
            let area = slipstick_mesh::facet_area_vector(&read.facet_coordinates(facet));
            assert!(area[1] * outward > 0.0, "{what} {found} faces outward");
        }
    }
}

#[test]
fn gmsh_files_are_read_with_their_groups() {
    for name in GMSH {
        let file = FileMesh::parse(&data(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
        let parts: Vec<_> = file.parts().filter(|part| !part.starts_with("Volume")).collect();
        assert_eq!(parts, ["block", "slab"], "{name}");
        compare(&file, "slab", "slab", ["slab_bottom", "slab_top"], name);
        compare(&file, "block", "block", ["block_bottom", "block_top"], name);
        // the corner (0, 0, 0) and the edge x = y = 0, of three nodes
        let slab = sound(&file, "slab", Some("slab")).mesh;
        assert_eq!(places(&slab, &slab.node_sets["slab_corner"]), [[0, 0, 0]], "{name}");
        let edge = [[0, 0, 0], [0, 0, 1_000_000], [0, 0, 2_000_000]];
        assert_eq!(places(&slab, &slab.node_sets["slab_edge"]), edge, "{name}");
        assert_eq!(slab.element_sets["slab_slab"].len(), slab.elements.len(), "{name}");
        assert!(!slab.surfaces.keys().any(|surface| surface.contains("block")), "{name}: {:?}", slab.surfaces.keys());
    }
}

/// The same mesh in all four layouts of Gmsh, number for number (ASCII has all digits).
#[test]
fn all_layouts_of_gmsh_are_one_mesh() {
    let files: Vec<_> = GMSH[..4].iter().map(|name| FileMesh::parse(&data(name)).expect("readable")).collect();
    for file in &files[1..] {
        for body in ["slab", "block"] {
            let [first, other] = [&files[0], file].map(|file| sound(file, body, Some(body)).mesh);
            assert_eq!(first.elements, other.elements);
            assert_eq!((&first.surfaces, &first.node_sets), (&other.surfaces, &other.node_sets));
            let apart = first.nodes.iter().flatten().zip(other.nodes.iter().flatten()).map(|(a, b)| (a - b).abs());
            assert!(apart.fold(0.0, f64::max) < 1e-15);
        }
    }
}

/// Integer fields on cells make sets.
#[test]
fn vtu_files_are_read_in_every_encoding() {
    for name in VTK {
        let file = FileMesh::parse(&data(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(file.parts().collect::<Vec<_>>(), ["group=1", "group=6"], "{name}");
        compare(&file, "slab", "group=1", ["slab_group=2", "slab_group=3"], name);
        compare(&file, "block", "group=6", ["block_group=7", "block_group=8"], name);
    }
}

#[test]
fn an_inp_file_of_meshio_is_read_whole() {
    let file = FileMesh::parse(&data("meshio.inp")).unwrap_or_else(|error| panic!("{error}"));
    let read = sound(&file, "both", None).mesh;
    assert_eq!((read.elements.len(), read.nodes.len()), (20, 63));
    // 4·1·2 + 1.4·0.7·1.3
    assert!((read.element_volumes().iter().sum::<f64>() - 9.274).abs() < 1e-10);
}

/// The slab, meshed with unstructured tetrahedra by Gmsh, has the volume and surface areas of the
/// drawing.
#[test]
fn tetrahedra_of_gmsh_fill_the_slab() {
    let file = FileMesh::parse(&data("gmsh_tetrahedra.msh")).expect("readable");
    let mesh = sound(&file, "slab", Some("slab")).mesh;
    assert!(mesh.elements.iter().all(|element| matches!(element, Element::Tet4(_))));
    assert!((mesh.element_volumes().iter().sum::<f64>() - 8.0).abs() < 1e-10);
    for (surface, area) in [("slab_top", 8.0), ("slab_bottom", 8.0)] {
        assert!((mesh.surface_area(&mesh.surfaces[surface]) - area).abs() < 1e-10);
    }
    assert!((mesh.surface_area(&mesh.boundary(0)) - 2.0 * (8.0 + 4.0 + 2.0)).abs() < 1e-10);
    compare(&file, "block", "block", ["block_bottom", "block_top"], "gmsh_tetrahedra.msh");
}

/// The slab and the block, meshed with wedges, have the volumes and surface areas of the drawing.
/// On top and bottom, the slab has triangles and the block has quadrilaterals. meshio writes the
/// nodes in VTK's earlier order, which must not cause a notice.
#[test]
fn wedges_fill_the_slab_and_the_block() {
    let groups = ["group=1", "group=2", "group=3", "group=5", "group=6", "group=7"];
    let names = ["slab", "slab_bottom", "slab_top", "block", "block_bottom", "block_top"];
    for (file, set) in [("gmsh_wedges.msh", names), ("meshio_wedges.vtu", groups)] {
        let file = FileMesh::parse(&data(file)).expect("readable");
        let own = |body: &str, set: &str| if set.contains('=') { format!("{body}_{set}") } else { set.to_owned() };
        let [slab, block] = [("slab", set[0]), ("block", set[3])].map(|(body, part)| sound(&file, body, Some(part)));
        assert!(slab.notices.is_empty() && block.notices.is_empty(), "{:?} {:?}", slab.notices, block.notices);
        let (slab, block) = (slab.mesh, block.mesh);
        assert_eq!((slab.elements.len(), block.elements.len()), (44, 16));
        let wedges = |mesh: &slipstick_mesh::Mesh| mesh.elements.iter().all(|e| matches!(e, Element::Wedge6(_)));
        assert!(wedges(&slab) && wedges(&block));
        let all = [
            (&slab, own("slab", set[1]), 3, -8.0, 8.0),
            (&slab, own("slab", set[2]), 3, 8.0, 8.0),
            (&block, own("block", set[4]), 4, -1.82, 1.274),
            (&block, own("block", set[5]), 4, 1.82, 1.274),
        ];
        for (mesh, name, corners, up, volume) in all {
            let surface = &mesh.surfaces[&name];
            assert!(surface.facets.iter().all(|facet| facet.nodes.len() == corners), "{name}");
            let area = |facet| slipstick_mesh::facet_area_vector(&mesh.facet_coordinates(facet))[1];
            assert!((surface.facets.iter().map(area).sum::<f64>() - up).abs() < 1e-10, "{name}");
            assert!((mesh.element_volumes().iter().sum::<f64>() - volume).abs() < 1e-10, "{name}");
        }
        assert!((slab.surface_area(&slab.boundary(0)) - 2.0 * (8.0 + 4.0 + 2.0)).abs() < 1e-10);
    }
}

#[test]
fn lengths_are_scaled() {
    let file = FileMesh::parse(&data("gmsh_41_binary.msh")).expect("readable");
    let mesh = file.body("slab", Some("slab"), 0.001).expect("a slab").mesh;
    let (min, max) = mesh.bounding_box().expect("nodes");
    assert_eq!(min, [0.0; 3]);
    for (found, expected) in max.iter().zip([0.004, 0.001, 0.002]) {
        assert!((found - expected).abs() < 1e-17, "{max:?}");
    }
}

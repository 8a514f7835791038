//! Tables for picked facets. Facets are those of faces that the generators of the shapes know by name; the names
//! are taken from the mesh, so that they have to be found by their places. The text of the tables is read and built,
//! and must select the facets of the generator.

use std::collections::BTreeSet;

use slipstick_case::construct::build_mesh;
use slipstick_case::construct::pick::{NotSelectable, Picked, facets_of_faces, pick};
use slipstick_case::file::parse_case;
use slipstick_mesh::{Facet, Mesh};

const SHAPES: [&str; 7] = [
    "box = { min = [0, 0, 0], max = [4, 1, 2], elements = [4, 2, 2] }",
    "ball = { radius = 2.5, elements = [4, 2, 2] }",
    "half_ball = { radius = 1, elements = [4, 2, 2] }",
    "cone = { bottom_radius = 3, top_radius = 1, height = 4, elements = [4, 2, 3] }",
    "hollow_cylinder = { inner_radius = 2, outer_radius = 3, height = 4, elements = [2, 16, 4] }",
    "half_ring = { outer_radius = 3, inner_radius = 2, width = 1, elements = [10, 2, 2] }",
    "torus = { radius = 4, tube_radius = 1, elements = [2, 1, 12] }",
];

/// A second body far away, so that a table must name its own.
fn case(shape: &str, more: &str) -> String {
    let material = "material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }";
    format!(
        "[[body]]\nname = 'part'\n{shape}\n{material}\n{more}\n[[body]]\nname = 'far'\n{shape}\n{material}\n\
         place = {{ translate = [100, 0, 0] }}\n[[set]]\nname = 'held'\nbody = 'far'\n[[dirichlet]]\nset = 'held'\n[load_path]\nsteps = 1\n"
    )
}

fn mesh(text: &str) -> Mesh {
    build_mesh(&parse_case(text, "case.toml").unwrap_or_else(|error| panic!("{error}\n{text}")).case)
        .unwrap_or_else(|error| panic!("{error}\n{text}"))
}

fn keys(facets: &[Facet]) -> BTreeSet<Vec<u32>> {
    facets.iter().map(|facet| facet.nodes.sorted().to_vec()).collect()
}

/// The tables for facets of a mesh whose surfaces have no names.
fn picked(mesh: &Mesh, facets: &[Facet]) -> Result<Picked, NotSelectable> {
    let mut unnamed = mesh.clone();
    unnamed.surfaces.clear();
    pick(&unnamed, facets, "picked", &[30.0])
}

/// Picks facets, adds the tables to the text, and compares what the case then selects.
fn check(text: &str, facets: &[Facet]) -> String {
    let found = picked(&mesh(text), facets).unwrap_or_else(|error| panic!("{error}; {}\n{text}", error.help));
    let tables: String = found.tables.iter().map(|table| table.toml()).collect();
    let built = mesh(&format!("{text}\n{tables}"));
    assert_eq!(keys(&built.surfaces[&found.surface].facets), keys(facets), "{tables}\n{text}");
    tables
}

#[test]
fn faces_of_all_shapes_are_selected() {
    let tilted = "place = { rotate = { axis = [1, 2, 3], degrees = 37 }, translate = [0.3, 7, -2] }";
    for (shape, more) in SHAPES.iter().flat_map(|shape| [(shape, ""), (shape, tilted), (shape, "order = 2")]) {
        let text = case(shape, more);
        let built = mesh(&text);
        let own: Vec<_> = built.surfaces.iter().filter(|(name, _)| name.starts_with("part_")).collect();
        assert!(!own.is_empty());
        for (name, surface) in own {
            let tables = check(&text, &surface.facets);
            let expected = match (shape.split(' ').next(), &name[5..]) {
                (Some("box"), _) | (_, "bottom" | "top" | "flat" | "zmin" | "zmax") => "normal = ",
                (Some("hollow_cylinder" | "half_ring"), "inner" | "outer") => "cylinder = ",
                (Some("ball" | "half_ball"), _) => "sphere = ",
                (Some("cone"), "side") => "connected = ",
                _ => "",
            };
            assert!(tables.contains(expected), "{name}: {tables}");
        }
    }
}

/// A fillet is a part of a cylinder; three faces of a box are joined; and a part of a face has a box.
#[test]
fn parts_of_faces_and_several_faces_are_selected() {
    let text = case(SHAPES[4], "");
    let built = mesh(&text);
    let centre = |facet: &Facet, axis: usize| {
        facet.nodes.iter().map(|&node| built.nodes[node as usize][axis]).sum::<f64>() / facet.nodes.len() as f64
    };
    let quarter: Vec<Facet> = built.surfaces["part_outer"]
        .facets
        .iter()
        .filter(|f| centre(f, 0) > 0.0 && centre(f, 2) > 0.0)
        .copied()
        .collect();
    assert_eq!(quarter.len(), 16);
    let tables = check(&text, &quarter);
    assert!(tables.contains("boxes = "), "{tables}");

    let text = case(SHAPES[0], "");
    let built = mesh(&text);
    let three: Vec<Facet> = ["xmin", "xmax", "zmax"]
        .iter()
        .flat_map(|face| built.surfaces[&format!("part_{face}")].facets.clone())
        .collect();
    let tables = check(&text, &three);
    assert!(tables.contains("of = [\"picked_1\", \"picked_2\", \"picked_3\"]"), "{tables}");
    // of both bodies
    let both: Vec<Facet> =
        ["part_ymin", "far_ymin"].iter().flat_map(|name| built.surfaces[*name].facets.clone()).collect();
    assert!(check(&text, &both).contains("body = \"far\""));
}

/// Surfaces that have names need no tables, and new ones do not take their names.
#[test]
fn names_are_used_and_not_taken() {
    let built = mesh(&case(SHAPES[0], ""));
    let facets =
        |names: &[&str]| names.iter().flat_map(|name| built.surfaces[*name].facets.clone()).collect::<Vec<_>>();
    let one = pick(&built, &facets(&["part_xmin"]), "picked", &[30.0]).expect("found");
    assert_eq!((one.tables.len(), &*one.surface), (0, "part_xmin"));
    let two = pick(&built, &facets(&["part_xmin", "part_xmax"]), "part_ymin", &[30.0]).expect("found");
    let tables: String = two.tables.iter().map(|table| table.toml()).collect();
    assert_eq!(tables, "[[surface]]\nname = \"part_ymin_2\"\nof = [\"part_xmin\", \"part_xmax\"]\n");
}

#[test]
fn what_no_table_selects_is_refused() {
    let built = mesh(&case(SHAPES[0], ""));
    assert!(picked(&built, &[]).expect_err("nothing").message.contains("no face is picked"));
    // an L of a flat face
    let centre = |facet: &Facet, axis: usize| {
        facet.nodes.iter().map(|&node| built.nodes[node as usize][axis]).sum::<f64>() / facet.nodes.len() as f64
    };
    let mut bent = built.surfaces["part_ymax"].facets.clone();
    bent.retain(|facet| centre(facet, 0) < 2.0 && !(centre(facet, 0) < 1.0 && centre(facet, 2) < 1.0));
    assert_eq!(bent.len(), 3);
    let error = picked(&built, &bent).expect_err("no table");
    assert!(error.message.contains("of part around") && error.help.contains("name the faces"), "{error}");
}

/// A page shows the faces of elements of second order by their corners.
#[test]
fn faces_are_known_by_their_corners() {
    for more in ["", "order = 2"] {
        let built = mesh(&case(SHAPES[0], more));
        let surface = &built.surfaces["part_xmax"];
        let faces: Vec<[u32; 4]> =
            built.faces_of_surface(surface).iter().map(|face| std::array::from_fn(|k| face[(k + 1) % 4])).collect();
        assert_eq!(faces.len(), 4);
        let found = facets_of_faces(&built, &faces).expect("on the boundary");
        assert_eq!(keys(&found), keys(&surface.facets));
        // a face between two elements
        assert!(facets_of_faces(&built, &[[0, 1, 2, 4]]).is_none());
    }
}

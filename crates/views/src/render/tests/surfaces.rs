//! Named surfaces.

use super::*;
use slipstick_mesh::{Surface, facet_area_vector};

/// In its own panel, a face has its own colour, seen from its side; nothing else in the panel has it. Names that
/// the mesh does not have need no panel.
#[test]
fn each_surface_has_its_colour_in_its_panel() {
    let mut cube = unit_cube();
    let skin = cube.boundary(0).facets;
    for (name, side) in [("low", [0.0, -1.0, 0.0]), ("right", [1.0, 0.0, 0.0])] {
        let faces = |facet: &&slipstick_mesh::Facet| facet_area_vector(&cube.facet_coordinates(facet)) == side;
        let facets: Vec<_> = skin.iter().filter(faces).copied().collect();
        assert_eq!(facets.len(), 1);
        cube.surfaces.insert(name.into(), Surface { facets });
    }
    let label = |name: &str| SurfaceLabel { name: name.into(), lines: vec!["area 1".into()], normal: None };
    let panel = Canvas { width: 200, height: 150, supersampling: 1 };
    let picture = surfaces_picture(&cube, &["low", "nowhere", "right"].map(label), &panel).unwrap();
    // two of all and two single ones, in rows of three
    assert_eq!((picture.width(), picture.height()), (600, 300));
    // orange has no blue and green no red, whatever the light
    let count = |[column, row]: [u32; 2], has: &dyn Fn([u8; 3]) -> bool| {
        let places = (0..200).flat_map(|x| (0..150).map(move |y| (200 * column + x, 150 * row + y)));
        places.filter(|&(x, y)| has(picture.pixel(x, y).unwrap())).count()
    };
    let (orange, green) =
        (|[r, g, b]: [u8; 3]| b == 0 && r > g && g > 60, |[r, g, b]: [u8; 3]| r == 0 && g > b && b > 40);
    assert!(count([2, 0], &orange) > 500 && count([2, 0], &green) == 0);
    assert!(count([0, 1], &green) > 500 && count([0, 1], &orange) == 0);
    // from above, only the right one is seen; from below and behind, only the low one
    assert!(count([0, 0], &green) > 500 && count([1, 0], &green) == 0);
    assert!(count([1, 0], &orange) > 500);
    assert_eq!(count([1, 1], &|pixel| pixel != [255; 3]), 0, "an empty place");
}

#[test]
fn too_many_surfaces_are_too_large() {
    let mut cube = unit_cube();
    let surface = cube.boundary(0);
    let labels: Vec<SurfaceLabel> =
        (0..1300).map(|n| SurfaceLabel { name: n.to_string(), lines: Vec::new(), normal: None }).collect();
    labels.iter().for_each(|label| drop(cube.surfaces.insert(label.name.clone(), surface.clone())));
    let error = surfaces_picture(&cube, &labels, &Canvas { width: 480, height: 400, supersampling: 1 }).unwrap_err();
    assert!(matches!(error, RenderError::Size { .. }), "{error}");
}

/// A part of a surface is drawn above it, whatever the order in which they are named: all of its pixels have its
/// colour.
#[test]
fn the_smaller_of_two_surfaces_is_on_top() {
    let mut plate = block("plate", [0.0; 3], [4.0, 1.0, 4.0], [4, 1, 4]);
    let top = |facet: &&slipstick_mesh::Facet| facet_area_vector(&plate.facet_coordinates(facet))[1] > 0.0;
    let facets: Vec<_> = plate.boundary(0).facets.iter().filter(top).copied().collect();
    let part = facets.iter().take(4).copied().collect();
    plate.surfaces.insert("whole".into(), Surface { facets });
    plate.surfaces.insert("part".into(), Surface { facets: part });
    let label = |name: &str| SurfaceLabel { name: name.into(), lines: Vec::new(), normal: None };
    let panel = Canvas { width: 300, height: 240, supersampling: 1 };
    // the first is orange, without blue; the second sky blue
    let orange = |picture: &Picture| {
        let places = (0..300).flat_map(|x| (0..240).map(move |y| (x, y)));
        places.filter(|&(x, y)| picture.pixel(x, y).is_some_and(|[r, _, b]| b == 0 && r > 60)).count() as f64
    };
    let drawn = |names: [&str; 2]| surfaces_picture(&plate, &names.map(label), &panel).unwrap();
    let (first, second) = (orange(&drawn(["part", "whole"])), orange(&drawn(["whole", "part"])));
    // 4 of 16 facets, or the other 12: 1 to 3
    assert!((second / first - 3.0).abs() < 0.2, "{first} {second}");
}

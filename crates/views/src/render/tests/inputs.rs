//! Input that cannot be drawn is rejected with its place.

use super::*;

#[test]
fn fields_must_fit_the_mesh_and_be_finite() {
    let cube = unit_cube();
    let mut scene = bare(&cube);
    let layer = |paint| Layer { cells: vec![0], paint, style: Style::Solid, edges: false };
    let error = scene.add(layer(Paint::Cells(&[1.0, 2.0]))).unwrap_err();
    assert!(matches!(error, RenderError::Length { expected: 1, found: 2, .. }), "{error}");
    let error = scene.add(layer(Paint::Cells(&[f64::NAN]))).unwrap_err();
    assert!(matches!(error, RenderError::NotFinite { entry: 0, .. }), "{error}");
    let error = scene.add(layer(Paint::Points(&[1.0]))).unwrap_err();
    assert!(matches!(error, RenderError::Length { expected: 8, found: 1, .. }), "{error}");
    let error = scene.add(plain(vec![0, 3], RED, Style::Solid)).unwrap_err();
    assert!(matches!(error, RenderError::CellOutOfRange { cell: 3, cells: 1 }), "{error}");
    let error = scene.displace(&[0.0; 23], 1.0).unwrap_err();
    assert!(matches!(error, RenderError::Length { expected: 24, found: 23, .. }), "{error}");
    let error = scene.displace(&[1e200; 24], 1e200).unwrap_err();
    assert!(matches!(error, RenderError::NotFinite { .. }), "{error}");
    let error = Scene::new(&cube.nodes[..7], &cube.elements).unwrap_err();
    assert!(matches!(error, RenderError::NodeOutOfRange { element: 0, node: 7, nodes: 7 }), "{error}");
    let error = design_picture(&cube, &[], 0.5, &RenderOptions::default()).unwrap_err();
    assert_eq!(error.to_string(), "`density` has 0 values, but the mesh needs 1: use a result on this mesh");
}

#[test]
fn a_field_needs_a_scale() {
    let cube = unit_cube();
    let mut scene = bare(&cube);
    let layer = Layer { cells: vec![0], paint: Paint::Cells(&[1.0]), style: Style::Solid, edges: false };
    scene.add(layer).unwrap();
    assert!(matches!(scene.picture(&canvas(50, 50)), Err(RenderError::NoScale)));
}

#[test]
fn ranges_views_and_sizes_are_checked() {
    for range in [[1.0, 1.0], [2.0, 1.0], [f64::NAN, 1.0], [0.0, f64::INFINITY]] {
        let error = ColourScale::new("p", ColourMap::Viridis, range).unwrap_err();
        assert!(matches!(error, RenderError::Range { .. }), "{error}");
    }
    let error = View::named("above").unwrap_err().to_string();
    assert!(error.contains("`above`") && error.contains("top"), "{error}");
    assert!(View::names().into_iter().all(|name| View::named(name).is_ok()));
    assert!(matches!(View::from_directions([0.0, 2.0, 0.0], [0.0, 1.0, 0.0]), Err(RenderError::Direction { .. })));
    assert!(matches!(View::from_directions([f64::NAN; 3], [0.0, 1.0, 0.0]), Err(RenderError::Direction { .. })));
    assert_eq!(View::from_directions([0.0, 0.0, 3.0], [0.0, 2.0, 0.0]).unwrap(), View::named("front").unwrap());
    let cube = unit_cube();
    let scene = bare(&cube);
    assert!(matches!(scene.picture(&canvas(0, 50)), Err(RenderError::Size { width: 0, .. })));
    assert!(matches!(scene.picture(&canvas(50, 40_000)), Err(RenderError::Size { height: 40_000, .. })));
    let none = Canvas { supersampling: 0, ..Canvas::default() };
    assert!(matches!(scene.picture(&none), Err(RenderError::Supersampling { found: 0, .. })));
    assert!(matches!(Picture::beside(&[]), Err(RenderError::Size { .. })));
    assert!(ColourMap::NAMES.into_iter().all(|name| ColourMap::named(name).is_some()));
}

#[test]
fn a_body_must_exist() {
    let cube = unit_cube();
    let options = RenderOptions { bodies: Some(vec!["sphere".into()]), ..RenderOptions::default() };
    let error = design_picture(&cube, &[1.0], 0.5, &options).unwrap_err();
    assert_eq!(error.to_string(), "there is no body `sphere`; bodies of this mesh: cube");
}

/// A picture so small that margins leave no room, and a scene without extent, still work.
#[test]
fn tiny_pictures_and_flat_scenes_are_drawn() {
    let mut flat = unit_cube();
    flat.nodes.iter_mut().for_each(|x| *x = [1.0, 2.0, 3.0]);
    let mut scene = Scene::new(&flat.nodes, &flat.elements).unwrap();
    scene.add(plain(vec![0], RED, Style::Outline)).unwrap();
    scene.scale = Some(ColourScale::new("value", ColourMap::Viridis, [0.0, 1.0]).unwrap());
    for size in [1, 2, 9, 33, 200] {
        assert_eq!(scene.picture(&canvas(size, size)).unwrap().pixels().len(), 3 * (size * size) as usize);
    }
    history_picture(&[IterationRecord::default()], None, &canvas(1, 1)).unwrap();
}

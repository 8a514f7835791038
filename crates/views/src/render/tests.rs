//! Checks of pixels.

use super::*;
use slipstick_mesh::{BoxShape, Mesh, Placement, box_mesh};
use slipstick_model::optimize::IterationRecord;

mod colours;
mod inputs;
mod marks;
mod results;
mod surfaces;

const BLACK: Colour = Colour([0; 3]);
const RED: Colour = Colour([255, 0, 0]);
const BLUE: Colour = Colour([0, 0, 255]);

fn canvas(width: u32, height: u32) -> Canvas {
    Canvas { width, height, supersampling: 3 }
}

fn block(name: &str, min: [f64; 3], max: [f64; 3], elements: [usize; 3]) -> Mesh {
    box_mesh(name, &BoxShape { min, max, elements, grading: [1.0; 3] }).unwrap()
}

fn unit_cube() -> Mesh {
    block("cube", [0.0; 3], [1.0; 3], [1; 3])
}

/// A scene without light, axes and scale.
fn bare(mesh: &Mesh) -> Scene<'_> {
    let mut scene = Scene::new(&mesh.nodes, &mesh.elements).unwrap();
    (scene.shaded, scene.axes) = (false, false);
    scene
}

fn plain(cells: Vec<u32>, colour: Colour, style: Style) -> Layer<'static> {
    Layer { cells, paint: Paint::Plain(colour), style, edges: false }
}

/// Number of pixels that a black body covers; partly covered pixels count by their light.
fn covered(picture: &Picture) -> f64 {
    let dark = |v: u8| 1.0 - f64::from(Colour([v; 3]).linear()[0]);
    picture.pixels().chunks(3).map(|p| dark(p[0])).sum()
}

/// Pixels of the frame in both directions, without the margin of seven dots of the font on either
/// side.
fn inside(width: u32, height: u32) -> [f64; 2] {
    let margin = 14.0 * (f64::from(width.min(height)) / 260.0).max(1.0);
    [f64::from(width) - margin, f64::from(height) - margin]
}

/// The projection of a unit cube along e has the area |e₁| + |e₂| + |e₃| and, along a direction d
/// of the picture, the extent |d₁| + |d₂| + |d₃|.
#[test]
fn a_cube_covers_the_pixels_that_geometry_predicts() {
    let cube = unit_cube();
    let one_norm = |v: [f64; 3]| v.iter().map(|v| v.abs()).sum::<f64>();
    let eye = space::unit([0.8, 0.75, 1.0]);
    let right = space::unit([1.0, 0.0, -0.8]);
    let up = space::cross(eye, right);
    let (x, y, z) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    for (name, eye, right, up) in [("front", z, x, y), ("top", y, x, z), ("side", x, z, y), ("iso", eye, right, up)] {
        let mut scene = bare(&cube);
        scene.add(plain(vec![0], BLACK, Style::Solid)).unwrap();
        scene.view = View::named(name).unwrap();
        let found = covered(&scene.picture(&canvas(400, 300)).unwrap());
        let [width, height] = inside(400, 300);
        let scale = (width / one_norm(right)).min(height / one_norm(up));
        let predicted = one_norm(eye) * scale * scale;
        assert!((found / predicted - 1.0).abs() < 0.01, "{name}: {found} instead of {predicted}");
    }
}

#[test]
fn named_views_show_the_sides_they_name() {
    // One cube at each end of the axes, in its own colour: the one nearest to the eye hides the
    // middle of the picture.
    let ends = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]];
    let colours = [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 0], [0, 255, 255], [255, 0, 255]];
    let cubes = ends.map(|end| {
        let middle = end.map(|v| f64::from(3 * v));
        block(&format!("{end:?}"), middle.map(|v| v - 1.0), middle.map(|v| v + 1.0), [1; 3])
    });
    let mesh = Mesh::merge(cubes.to_vec()).unwrap();
    for (view, nearest) in [("side", 0), ("left", 1), ("top", 2), ("bottom", 3), ("front", 4), ("back", 5)] {
        let mut scene = bare(&mesh);
        for (cell, colour) in colours.iter().enumerate() {
            scene.add(plain(vec![cell as u32], Colour(*colour), Style::Solid)).unwrap();
        }
        scene.view = View::named(view).unwrap();
        let picture = scene.picture(&canvas(200, 200)).unwrap();
        assert_eq!(picture.pixel(100, 100), Some(colours[nearest]), "{view}");
        // y is up, x to the right where the eye is in front of, above or below the scene.
        if view == "front" {
            assert_eq!(picture.pixel(100, 30), Some(colours[2]));
            assert_eq!(picture.pixel(170, 100), Some(colours[0]));
        }
        if view == "top" || view == "bottom" {
            assert_eq!(picture.pixel(170, 100), Some(colours[0]));
            assert_eq!(picture.pixel(100, 170), Some(colours[if view == "top" { 4 } else { 5 }]));
        }
    }
}

#[test]
fn nearer_faces_hide_farther_ones_in_any_order_and_glass_mixes() {
    let far = block("far", [-2.0, -2.0, 0.0], [2.0, 2.0, 1.0], [1; 3]);
    let near = block("near", [-1.0, -1.0, 3.0], [1.0, 1.0, 4.0], [1; 3]);
    let mesh = Mesh::merge(vec![far, near]).unwrap();
    let draw = |style: Style, view: &str, swapped: bool| {
        let mut scene = bare(&mesh);
        let mut layers = [plain(vec![0], BLUE, Style::Solid), plain(vec![1], RED, style)];
        if swapped {
            layers.reverse();
        }
        layers.into_iter().for_each(|layer| scene.add(layer).unwrap());
        scene.view = View::named(view).unwrap();
        scene.picture(&canvas(200, 200)).unwrap()
    };
    for swapped in [false, true] {
        let front = draw(Style::Solid, "front", swapped);
        assert_eq!(front.pixel(100, 100), Some(RED.0));
        assert_eq!(front.pixel(100, 30), Some(BLUE.0));
        assert_eq!(front.pixel(3, 3), Some([255; 3]));
        assert_eq!(draw(Style::Solid, "back", swapped).pixel(100, 100), Some(BLUE.0));
        // A quarter of red light and three of blue, encoded as sRGB: 0.25 is 137, 0.75 is 225 (IEC
        // 61966-2-1).
        let glass = draw(Style::Translucent(0.25), "front", swapped);
        assert_eq!(glass.pixel(100, 100), Some([137, 0, 225]));
        // From behind, the solid body hides the glass.
        assert_eq!(draw(Style::Translucent(0.25), "back", swapped).pixel(100, 100), Some(BLUE.0));
        // A frame of lines leaves its inside open.
        assert_eq!(draw(Style::Outline, "front", swapped).pixel(100, 100), Some(BLUE.0));
    }
}

#[test]
fn a_line_on_a_face_is_drawn_whole() {
    // The box's edges lie on the cube's: each must be seen from end to end, the hidden ones not at
    // all.
    let cube = unit_cube();
    let mut scene = bare(&cube);
    scene.add(plain(vec![0], BLACK, Style::Solid)).unwrap();
    scene.add_box([0.0; 3], [1.0; 3]).unwrap();
    let picture = scene.picture(&canvas(300, 300)).unwrap();
    // The three front edges meet at (1, 1, 1).
    let camera = view::Camera::framing(
        scene.view,
        cube.nodes.iter().copied(),
        view::Rectangle { left: 8.0769, top: 8.0769, right: 291.9231, bottom: 291.9231 },
    )
    .unwrap();
    let darkest = |a: [f64; 3], b: [f64; 3]| {
        let at = |t: f64| camera.project(std::array::from_fn(|c| a[c] + t * (b[c] - a[c])));
        let light = |p: [f64; 3]| picture.pixel(p[0] as u32, p[1] as u32).unwrap()[0];
        (1..100).map(|i| light(at(0.01 * f64::from(i)))).min().unwrap()
    };
    for end in [[0.0, 1.0, 1.0], [1.0, 0.0, 1.0], [1.0, 1.0, 0.0]] {
        assert!(darkest([1.0; 3], end) > 30, "{end:?}");
    }
    let hidden = (5..45).map(|i| camera.project([0.02 * f64::from(i), 0.0, 0.0]));
    let black = hidden.filter(|p| picture.pixel(p[0] as u32, p[1] as u32) == Some(BLACK.0)).count();
    // It may cross one of the front edges in the picture.
    assert!(black >= 36, "{black} of 40");
}

#[test]
fn the_skin_of_a_block_is_its_surface() {
    let mesh = block("block", [0.0; 3], [3.0, 2.0, 4.0], [3, 2, 4]);
    let all: Vec<u32> = (0..24).collect();
    let faces = skin::skin(&mesh.elements, &all);
    assert_eq!(faces.len(), 2 * (3 * 2 + 2 * 4 + 4 * 3));
    // Outward: the divergence theorem gives the volume from the mean of x·n over the faces of
    // area 1.
    let volume: f64 = faces
        .iter()
        .map(|f| {
            let mean: [f64; 3] =
                std::array::from_fn(|c| f.nodes.iter().map(|&n| mesh.nodes[n as usize][c]).sum::<f64>() / 4.0);
            space::dot(mean, f.normal(&mesh.nodes)) / 3.0
        })
        .sum();
    assert!((volume - 24.0).abs() < 1e-12);
    let eye = space::unit([0.3, 0.5, 0.7]);
    assert_eq!(skin::outline(&faces, &mesh.nodes, eye).len(), 4 * (3 + 2 + 4));
    // Of three faces in view with p × q quads each: their edges, those between two faces once.
    let visible = (3 * 3 + 4 * 2) + (2 * 5 + 4 * 3) + (4 * 4 + 5 * 3) - (3 + 2 + 4);
    assert_eq!(skin::wire(&faces, &mesh.nodes, eye).len(), visible);
    // Without the middle layer, two blocks remain.
    let rest: Vec<u32> = all.iter().copied().filter(|e| (mesh.centroid(*e as usize)[0] - 1.5).abs() > 0.1).collect();
    assert_eq!(skin::skin(&mesh.elements, &rest).len(), 2 * 2 * (2 + 2 * 4 + 4));
}

#[test]
fn bytes_do_not_depend_on_the_number_of_threads() {
    let mesh = block("block", [0.0; 3], [2.0, 1.0, 1.5], [8, 4, 6]);
    let density: Vec<f64> = (0..mesh.elements.len()).map(|e| 0.5 + 0.5 * (e as f64 * 0.7).sin()).collect();
    let draw = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let options = RenderOptions { canvas: canvas(211, 157), ..RenderOptions::default() };
        pool.install(|| design_picture(&mesh, &density, 0.4, &options).unwrap().png().unwrap())
    };
    let one = draw(1);
    assert_eq!(one, draw(2));
    assert_eq!(one, draw(7));
}

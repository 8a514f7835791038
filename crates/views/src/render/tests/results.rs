//! Pictures of results, charts, files.

use super::*;

/// A plate of 14 × 3 × 14 elements with a block above it.
fn plate_and_tool() -> (Mesh, Vec<f64>) {
    let plate = block("plate", [-1.5, -1.0, -1.5], [1.5, 0.0, 1.5], [14, 3, 14]);
    let mut tool = block("tool", [-0.5, 0.0, -0.5], [0.5, 1.0, 0.5], [3; 3]);
    tool.transform(&Placement { rotate: None, translate: [0.0, 0.2, 0.0] }).unwrap();
    let mesh = Mesh::merge(vec![plate, tool]).unwrap();
    let plates = 14 * 3 * 14;
    let density = (0..mesh.elements.len())
        .map(|e| if e < plates { 0.5 + 0.499 * (e as f64 * 0.37).sin() * (e as f64 * 0.011).cos() } else { 1.0 })
        .collect();
    (mesh, density)
}

fn options() -> RenderOptions {
    RenderOptions { canvas: canvas(240, 200), ..RenderOptions::default() }
}

#[test]
fn pictures_as_large_as_the_documentation_has_stay_small_files() {
    let (mesh, density) = plate_and_tool();
    let canvas = Canvas { width: 640, height: 560, supersampling: 2 };
    let options = RenderOptions { canvas, caption: Some("plate".into()), ..options() };
    let design = design_picture(&mesh, &density, 0.5, &options).unwrap();
    let displacement = vec![0.0; 3 * mesh.nodes.len()];
    let state = state_picture(&mesh, &displacement, &density, 0.5, &Field::density(&density), &options).unwrap();
    let both = Picture::beside(&[design, state]).unwrap();
    assert_eq!((both.width(), both.height()), (1280, 560));
    let size = both.png().unwrap().len();
    assert!(size <= 300_000, "{size} bytes");
}

/// The surface of a solid body is its skin: it covers the same pixels as the elements do.
#[test]
fn a_solid_body_has_the_same_contour_as_its_surface() {
    let mesh = block("beam", [0.0; 3], [3.0, 1.0, 1.0], [6, 2, 2]);
    let density = vec![1.0; mesh.elements.len()];
    let how = crate::export::ExportOptions { threshold: Some(0.5), ..Default::default() };
    let surface = crate::export::design_surface(&mesh, &density, &how).unwrap().surface;
    let bare = RenderOptions { edges: false, domain: false, ..options() };
    let shown = |picture: Picture| picture.pixels().chunks(3).filter(|p| *p != [255; 3]).count() as f64;
    for view in ["iso", "front", "top"] {
        let bare = RenderOptions { view: View::named(view).unwrap(), ..bare.clone() };
        // the colour bar takes up room: without it, both pictures have the same frame
        let smooth = shown(surface_picture(&mesh, &surface, None, &bare).unwrap());
        let mut scene = Scene::new(&mesh.nodes, &mesh.elements).unwrap();
        scene.view = bare.view;
        let cells = (0..mesh.elements.len() as u32).collect();
        scene.add(plain(cells, Colour::GLASS, Style::Solid)).unwrap();
        let elements = shown(scene.picture(&bare.canvas).unwrap());
        assert!((smooth / elements - 1.0).abs() < 2e-3, "{view}: {smooth} and {elements} pixels");
    }
    let mut scene = Scene::new(&mesh.nodes, &[]).unwrap();
    let beyond = scene.add_surface(&[[0, 1, 63]], Colour::GLASS);
    assert!(matches!(beyond, Err(RenderError::NodeOutOfRange { element: 0, node: 63, nodes: 63 })), "{beyond:?}");
}

#[test]
fn files_hold_the_pixels() {
    let (mesh, density) = plate_and_tool();
    let picture = design_picture(&mesh, &density, 0.5, &options()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("design.png");
    picture.save_png(&path).unwrap();
    let decoder = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(&path).unwrap()));
    let mut reader = decoder.read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    assert_eq!((info.width, info.height, info.color_type), (240, 200, png::ColorType::Rgb));
    assert_eq!(pixels, picture.pixels());
    let error = picture.save_png(&folder.path().join("missing/design.png")).unwrap_err();
    assert!(matches!(error, RenderError::Output(_)), "{error}");
}

#[test]
fn a_threshold_that_leaves_nothing_gives_a_note() {
    let (mesh, density) = plate_and_tool();
    let empty = design_picture(&mesh, &density, 2.0, &options()).unwrap();
    let saturated = |p: &[u8]| p.iter().max().unwrap() - p.iter().min().unwrap() > 60;
    assert!(empty.pixels().chunks(3).any(saturated), "the colour bar stays");
    // The note stands in the middle of the frame: dark ink on white.
    let note = (80..120).flat_map(|y| (0..180).map(move |x| (x, y)));
    assert!(note.filter_map(|(x, y)| empty.pixel(x, y)).filter(|p| p[0] < 200).count() > 100);
    let scene = Scene::new(&[], &[]).unwrap();
    scene.picture(&canvas(50, 40)).unwrap();
}

#[test]
fn a_cut_shows_what_remains_of_all_bodies() {
    let (mesh, density) = plate_and_tool();
    let half = RenderOptions { cut: Some(Cut { normal: [0.0, 0.0, 2.0], offset: 0.0 }), ..options() };
    let still = vec![0.0; 3 * mesh.nodes.len()];
    let field = Field::density(&density);
    let cut = state_picture(&mesh, &still, &density, 0.5, &field, &half).unwrap();
    let mut rest = density.clone();
    for (e, d) in rest.iter_mut().enumerate() {
        if mesh.centroid(e)[2] > 0.0 {
            *d = 0.0;
        }
    }
    let names = Some(vec!["plate".into()]);
    let emptied =
        state_picture(&mesh, &still, &rest, 0.5, &field, &RenderOptions { bodies: names, ..options() }).unwrap();
    assert_eq!(cut.pixels(), emptied.pixels());
    assert_ne!(cut.pixels(), state_picture(&mesh, &still, &density, 0.5, &field, &options()).unwrap().pixels());
}

/// Magnified by λ along x, a unit cube seen from the front is λ times as wide as high.
#[test]
fn displacements_are_magnified_by_their_factor() {
    let cube = unit_cube();
    let displacement: Vec<f64> = cube.nodes.iter().flat_map(|x| [0.25 * x[0], 0.0, 0.0]).collect();
    for (factor, aspect) in [(0.0, 1.0), (1.0, 1.25), (12.0, 4.0)] {
        let mut scene = bare(&cube);
        scene.displace(&displacement, factor).unwrap();
        scene.add(plain(vec![0], BLACK, Style::Solid)).unwrap();
        scene.view = View::named("front").unwrap();
        let picture = scene.picture(&canvas(300, 300)).unwrap();
        let side = inside(300, 300)[0];
        let predicted = side * side / aspect;
        assert!((covered(&picture) / predicted - 1.0).abs() < 0.01, "{factor}");
    }
}

#[test]
fn the_bodies_of_the_design_bear_the_field() {
    let (mesh, density) = plate_and_tool();
    let still = vec![0.0; 3 * mesh.nodes.len()];
    let heights: Vec<f64> = mesh.nodes.iter().map(|x| x[1]).collect();
    let field = Field { title: "height", values: FieldValues::Nodes(&heights) };
    let top = RenderOptions { view: View::named("top").unwrap(), edges: false, ..options() };
    let count = |picture: &Picture, colour: Colour| picture.pixels().chunks(3).filter(|p| **p == colour.0).count();
    let front = RenderOptions { others: Style::Solid, ..top.clone() };
    // From above, in the light that falls on a face towards the eye and upwards.
    let hidden = RenderOptions { others: Style::Hidden, ..top.clone() };
    let solid = state_picture(&mesh, &still, &density, 0.1, &field, &front).unwrap();
    let alone = state_picture(&mesh, &still, &density, 0.1, &field, &hidden).unwrap();
    assert_ne!(solid.pixels(), alone.pixels());
    let key = 0.75 / (0.35f64 * 0.35 + 0.6 * 0.6 + 0.75 * 0.75).sqrt();
    let fill = 0.5 / (0.8f64 * 0.8 + 0.1 * 0.1 + 0.5 * 0.5).sqrt();
    let light = (0.2 + 0.25 + 0.5 * key + 0.15 * fill) as f32;
    let lit = Colour(ColourMap::Viridis.at(1.0).linear().map(|v| colour::to_byte(v * light)));
    assert!(count(&alone, lit) > 2000, "the plate's top has the highest value");
    // Bodies without a density below 1 are all shown.
    let full = vec![1.0; density.len()];
    let all = state_picture(&mesh, &still, &full, 0.5, &field, &hidden).unwrap();
    assert!(count(&all, lit) > 100);
}

#[test]
fn a_chart_has_its_points_where_its_axes_say() {
    let record = |iteration: usize| IterationRecord {
        iteration,
        objective: -3.0 * iteration as f64,
        volume_fraction: 0.25,
        ..IterationRecord::default()
    };
    let history: Vec<IterationRecord> = (0..=10).map(record).collect();
    let picture = history_picture(&history, Some(0.25), &canvas(400, 300)).unwrap();
    // The curve falls on a straight line: halfway across the columns that it covers it is halfway
    // down.
    let colour = ColourMap::Viridis.at(0.2).0;
    let on: Vec<(u32, u32)> = (0..300)
        .flat_map(|y| (0..400).map(move |x| (x, y)))
        .filter(|&(x, y)| y > 30 && picture.pixel(x, y) == Some(colour))
        .collect();
    let (left, right) = (on.iter().map(|p| p.0).min().unwrap(), on.iter().map(|p| p.0).max().unwrap());
    let (top, bottom) = (on.iter().map(|p| p.1).min().unwrap(), on.iter().map(|p| p.1).max().unwrap());
    assert!(right - left > 250 && bottom - top > 80);
    for &(x, y) in &on {
        let (s, t) = (f64::from(x - left) / f64::from(right - left), f64::from(y - top) / f64::from(bottom - top));
        assert!((s - t).abs() < 0.04, "{x} {y}");
    }
    let empty = history_picture(&[], None, &canvas(400, 300)).unwrap();
    let below_title = (31..300).flat_map(|y| (0..400).map(move |x| (x, y)));
    assert!(below_title.into_iter().all(|(x, y)| empty.pixel(x, y) != Some(colour)), "no points without a history");
}

/// For three runs with different objectives, the lines lie above each other in that order, in the
/// published colours of Okabe and Ito; the legend has a sample of each, and a run without rows
/// appears only in the legend.
#[test]
fn several_runs_are_drawn_in_one_frame_with_a_legend() {
    let run = |name: &str, level: f64, count: usize| RunHistory {
        name: name.into(),
        rows: (0..count).map(|i| [i as f64, level, 0.3]).collect(),
    };
    let runs = [run("low", -30.0, 5), run("high", -10.0, 9), run("none", 0.0, 0)];
    let (canvas, axis) = (canvas(420, 340), ObjectiveAxis::default());
    let picture = histories_picture(Some("title"), &runs, &axis, Some(0.25), &canvas).unwrap();
    let rows = |colour: [u8; 3], columns: std::ops::Range<u32>| -> Vec<u32> {
        // lines of the legend may be thinner than two pixels
        let near = |found: [u8; 3]| (0..3).all(|c| found[c].abs_diff(colour[c]) < 60);
        (0..340).filter(|&y| columns.clone().any(|x| picture.pixel(x, y).is_some_and(near))).collect()
    };
    let (blue, vermillion, green) = ([0, 114, 178], [213, 94, 0], [0, 158, 115]);
    let [low, high, none] = [blue, vermillion, green].map(|colour| rows(colour, 0..420));
    // All in the legend, at the same height, above the plots.
    assert!(low[0] == high[0] && low[0].abs_diff(none[0]) <= 1 && low[0] > 15, "{low:?} {high:?} {none:?}");
    assert!(none.iter().all(|y| y - none[0] < 6), "no line without rows: {none:?}");
    // y is up: −10 lies above −30. The run with 5 of 9 iterations ends halfway.
    let below = |rows: &[u32]| *rows.iter().find(|y| **y > none[0] + 15).unwrap();
    assert!(below(&high) + 60 < below(&low), "{high:?} {low:?}");
    let right = rows(blue, 300..420);
    assert!(right.iter().all(|y| y - none[0] < 6), "{right:?}");
    // Without a title everything starts 18 units of text higher, each 1.1 pixels: 19.8.
    let bare = histories_picture(None, &runs, &axis, Some(0.25), &canvas).unwrap();
    let near = |p: [u8; 3]| (0..3).all(|c| p[c].abs_diff(blue[c]) < 60);
    let first = (0..340).find(|&y| (0..420).any(|x| bare.pixel(x, y).is_some_and(near))).unwrap();
    assert!((19..=20).contains(&(low[0] - first)), "{first} {low:?}");
    let error = histories_picture(None, &vec![run("run", 0.0, 1); 29], &axis, None, &canvas).unwrap_err();
    assert!(matches!(error, RenderError::TooManyLines { found: 29, limit: 28 }), "{error}");
    let wrong = RunHistory { name: "wrong".into(), rows: vec![[0.0, f64::NAN, 0.1]] };
    let error = histories_picture(None, &[wrong], &axis, None, &canvas).unwrap_err();
    assert!(matches!(error, RenderError::NotFinite { .. }), "{error}");
}

#[test]
fn pictures_stand_beside_each_other() {
    let (mesh, density) = plate_and_tool();
    let low = design_picture(&mesh, &density, 0.5, &options()).unwrap();
    let high = RenderOptions { canvas: canvas(100, 260), ..options() };
    let high = design_picture(&mesh, &density, 0.5, &high).unwrap();
    let both = Picture::beside(&[low.clone(), high.clone()]).unwrap();
    assert_eq!((both.width(), both.height()), (340, 260));
    assert_eq!(both.pixel(120, 29), Some([255; 3]));
    assert_eq!(both.pixel(100, 130), low.pixel(100, 100));
    assert_eq!(both.pixel(240 + 50, 130), high.pixel(50, 130));
    assert_eq!(both.pixel(340, 0), None);
}

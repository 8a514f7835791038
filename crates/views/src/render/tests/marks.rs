//! Symbols of supports, motions and forces; what is behind; scale bars.

use super::*;

fn count(picture: &Picture, of: impl Fn([u8; 3]) -> bool) -> usize {
    picture.pixels().chunks(3).filter(|p| of([p[0], p[1], p[2]])).count()
}

fn orange([r, g, b]: [u8; 3]) -> bool {
    r > 60 && b < 20 && g < r / 2 + 20
}

/// An arrow beside a cube is drawn, with its text; one behind the cube is not, nor is its text.
#[test]
fn arrows_are_hidden_by_bodies() {
    let cube = unit_cube();
    let draw = |from: [f64; 3], to: [f64; 3], label: &str| {
        let mut scene = bare(&cube);
        scene.add(plain(vec![0], Colour::GLASS, Style::Solid)).unwrap();
        scene.view = View::named("front").unwrap();
        scene.add_mark(&Mark::Motion { path: vec![from, to], label: label.into() }, 1.7).unwrap();
        scene.picture(&canvas(300, 300)).unwrap()
    };
    let beside = draw([-0.6, 0.5, 0.5], [-0.1, 0.5, 0.5], "");
    let named = draw([-0.6, 0.5, 0.5], [-0.1, 0.5, 0.5], "5 mm");
    assert!(count(&beside, orange) > 100, "{}", count(&beside, orange));
    assert_ne!(beside.pixels(), named.pixels());
    let behind = draw([0.3, 0.5, -0.7], [0.7, 0.5, -0.7], "5 mm");
    assert_eq!(count(&behind, orange), 0);
    let mut scene = bare(&cube);
    let wrong = Mark::Support { at: [f64::NAN; 3], outward: [1.0; 3] };
    assert!(matches!(scene.add_mark(&wrong, 1.0), Err(RenderError::NotFinite { .. })));
}

/// A motion and a force along the same arrow, and a motion of two legs, whose second begins where the first ends: the
/// texts change as many pixels together as each alone.
#[test]
fn texts_of_arrows_do_not_cover_each_other() {
    let cube = unit_cube();
    let draw = |arrows: [([f64; 3], [f64; 3]); 2], labels: [&str; 2]| {
        let mut scene = bare(&cube);
        scene.add(plain(vec![0], Colour::GLASS, Style::Solid)).unwrap();
        scene.view = View::named("front").unwrap();
        let [first, second] = [0, 1].map(|k| (vec![arrows[k].0, arrows[k].1], labels[k].to_owned()));
        scene.add_mark(&Mark::Motion { path: first.0, label: first.1 }, 1.7).unwrap();
        scene.add_mark(&Mark::Force { path: second.0, label: second.1 }, 1.7).unwrap();
        scene.picture(&canvas(500, 500)).unwrap()
    };
    let down = ([-0.9, 1.4, 0.5], [-0.9, 0.9, 0.5]);
    for arrows in [[down, down], [down, (down.1, [-0.9, 0.4, 0.5])]] {
        // blanks leave the same margin
        let base = draw(arrows, [" ", " "]);
        let changed = |labels: [&str; 2]| {
            let with = draw(arrows, labels);
            base.pixels().chunks(3).zip(with.pixels().chunks(3)).filter(|(a, b)| a != b).count()
        };
        let [one, two, both] = [["0.568", " "], [" ", "1000"], ["0.568", "1000"]].map(changed);
        assert!(one > 50 && two > 50 && 20 * both > 19 * (one + two), "{one} and {two}, together {both}");
    }
}

/// A cone touches its point: its base is outside of the body.
#[test]
fn supports_are_cones() {
    let cube = unit_cube();
    let mut scene = bare(&cube);
    scene.add(plain(vec![0], RED, Style::Solid)).unwrap();
    scene.view = View::named("front").unwrap();
    scene.add_mark(&Mark::Support { at: [0.5, 0.0, 0.9], outward: [0.0, -1.0, 0.0] }, 4.0).unwrap();
    let picture = scene.picture(&canvas(300, 300)).unwrap();
    let grey = |[r, g, b]: [u8; 3]| r.abs_diff(g) < 40 && b < 200 && g > 30;
    let rows: Vec<u32> = (0..300).filter(|&y| (0..300).any(|x| picture.pixel(x, y).is_some_and(grey))).collect();
    let width = |y: u32| (0..300).filter(|&x| picture.pixel(x, y).is_some_and(grey)).count();
    let (first, last) = (rows[0], rows[rows.len() - 1]);
    assert!(last - first > 10 && width(last - 2) > width(first + 2) + 5, "{first} to {last}");
}

/// The undeformed shape is behind the body wherever it is, and only its contour is dark.
#[test]
fn the_undeformed_shape_is_behind() {
    let cube = unit_cube();
    let draw = |ghost: bool| {
        let mut scene = bare(&cube);
        // towards the eye, which is behind everything else
        let nearer: Vec<[f64; 3]> = cube.nodes.iter().map(|x| [x[0] + 0.5, x[1], x[2] + 5.0]).collect();
        scene.add(plain(vec![0], RED, Style::Solid)).unwrap();
        scene.view = View::named("front").unwrap();
        if ghost {
            scene.add_ghost(&nearer, &[0]).unwrap();
        }
        scene.picture(&canvas(300, 200)).unwrap()
    };
    let (with, without) = (draw(true), draw(false));
    let red = |p: [u8; 3]| p == RED.0;
    let [all, whole] = [&with, &without].map(|picture| count(picture, red) as f64);
    // both fit the height of the picture: the body is drawn whole
    assert!((all / whole - 1.0).abs() < 0.02, "{all} {whole}");
    let pale = count(&with, |p| p == [246, 247, 249]) as f64;
    assert!((pale / all - 0.5).abs() < 0.05, "half of the shape is seen: {pale} of {all}");
    let mut scene = bare(&cube);
    assert!(matches!(scene.add_ghost(&cube.nodes, &[1]), Err(RenderError::CellOutOfRange { .. })));
    assert!(matches!(scene.add_ghost_surface(&cube.nodes, &[[0, 1, 8]]), Err(RenderError::NodeOutOfRange { .. })));
}

/// The bar is as long as its number says: a cube of side 2, seen from the front, has a known size.
#[test]
fn scale_bars_are_true() {
    let cube = block("cube", [0.0; 3], [2.0; 3], [1; 3]);
    let mut scene = bare(&cube);
    scene.add(plain(vec![0], RED, Style::Solid)).unwrap();
    scene.view = View::named("front").unwrap();
    scene.length_unit = Some("mm".into());
    let picture = scene.picture(&canvas(400, 300)).unwrap();
    let side = (0..400).filter(|&x| picture.pixel(x, 130) == Some(RED.0)).count() as f64;
    // the longest run of dark pixels in the strip below
    let longest = |y: u32| {
        let dark: Vec<bool> = (0..400).map(|x| picture.pixel(x, y).is_some_and(|p| p[0] < 200)).collect();
        dark.chunk_by(|a, b| a == b).filter(|run| run[0]).map(<[bool]>::len).max().unwrap_or(0)
    };
    let bar = (270..300).map(longest).max().unwrap() as f64;
    let length = 2.0 * bar / side;
    let round = [0.2, 0.5, 1.0].iter().any(|round| (length / round - 1.0).abs() < 0.04);
    assert!(round, "{length}");
}

/// Zero is grey, without a hue; the highest value is as in viridis reversed.
#[test]
fn nothing_is_grey() {
    let [r, g, b] = ColourMap::ViridisFromGrey.at(0.0).0;
    assert!(r == g && g == b && r > 200);
    for t in [0.2, 0.5, 1.0] {
        assert_eq!(ColourMap::ViridisFromGrey.at(t), ColourMap::ViridisReversed.at(t));
    }
}

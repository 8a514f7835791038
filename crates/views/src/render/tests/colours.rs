//! Colour maps, scales, fields.

use super::*;

/// matplotlib's viridis at the indices 0, 64, 128, 192, 255 of 255, rounded to bytes.
#[test]
fn viridis_has_its_published_colours() {
    let published: [(usize, [f64; 3]); 5] = [
        (0, [0.267004, 0.004874, 0.329415]),
        (64, [0.229739, 0.322361, 0.545706]),
        (128, [0.127568, 0.566949, 0.550556]),
        (192, [0.369214, 0.788888, 0.382914]),
        (255, [0.993248, 0.906157, 0.143936]),
    ];
    for (index, colour) in published {
        let found = ColourMap::Viridis.at(index as f64 / 255.0).0;
        for c in 0..3 {
            // The table keeps every 15th colour; between them it is linear.
            assert!((f64::from(found[c]) - 255.0 * colour[c]).abs() < 1.2, "{index}: {found:?}");
        }
        assert_eq!(ColourMap::ViridisReversed.at(1.0 - index as f64 / 255.0).0, found);
    }
}

/// CIE L*, a*, b* of an sRGB colour with white point D65.
fn lab(rgb: [f64; 3]) -> [f64; 3] {
    let [r, g, b] =
        rgb.map(|v| v / 255.0).map(|v| if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) });
    let f = |t: f64| if t > 0.008856 { t.cbrt() } else { 7.787 * t + 16.0 / 116.0 };
    let x = f((0.4124 * r + 0.3576 * g + 0.1805 * b) / 0.95047);
    let y = f(0.2126 * r + 0.7152 * g + 0.0722 * b);
    let z = f((0.0193 * r + 0.1192 * g + 0.9505 * b) / 1.08883);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// Moreland's construction (2009, section 4) in his polar form Msh of CIE Lab: M and s go linearly
/// from either end to a grey of M = 88, and the hue turns so that the change appears even.
#[test]
fn cool_warm_follows_its_construction() {
    let polar = |[l, a, b]: [f64; 3]| {
        let m = (l * l + a * a + b * b).sqrt();
        [m, (l / m).acos(), b.atan2(a)]
    };
    for (end, saturated) in [(0.0, [59.0, 76.0, 192.0]), (1.0, [180.0, 4.0, 38.0])] {
        let [m, s, h] = polar(lab(saturated));
        let turn = s * (88.0f64 * 88.0 - m * m).sqrt() / (m * s.sin());
        let grey_hue = if h > -std::f64::consts::PI / 3.0 { h + turn } else { h - turn };
        for i in 0..=16 {
            let t = f64::from(i) / 16.0;
            let (m, s, h) = (m + t * (88.0 - m), s * (1.0 - t), h + t * (grey_hue - h));
            let expected = [m * s.cos(), m * s.sin() * h.cos(), m * s.sin() * h.sin()];
            let at: f64 = end + t * (0.5 - end);
            let found = lab(ColourMap::CoolWarm.at(at).0.map(f64::from));
            let distance = (0..3).map(|c| (found[c] - expected[c]).powi(2)).sum::<f64>().sqrt();
            // His table is rounded to bytes and clipped to sRGB; 2.3 is a just noticeable
            // difference.
            assert!(distance < 2.3, "{at}: {found:?} instead of {expected:?}");
        }
    }
}

#[test]
fn scales_cover_their_values() {
    let covering = |map, values: &[f64]| ColourScale::covering("field", map, values.iter().copied()).unwrap().range();
    assert_eq!(covering(ColourMap::Viridis, &[3.0, -1.0, 2.0]), [-1.0, 3.0]);
    assert_eq!(covering(ColourMap::CoolWarm, &[3.0, -1.0, 2.0]), [-3.0, 3.0]);
    assert_eq!(covering(ColourMap::Viridis, &[]), [-0.5, 0.5]);
    assert_eq!(covering(ColourMap::Viridis, &[2.0, 2.0]), [1.8, 2.2]);
    let scale = ColourScale::new("field", ColourMap::Viridis, [10.0, 20.0]).unwrap();
    assert_eq!(scale.colour(-5.0), ColourMap::Viridis.at(0.0));
    assert_eq!(scale.colour(15.0), ColourMap::Viridis.at(0.5));
    assert_eq!(scale.colour(1e300), ColourMap::Viridis.at(1.0));
}

#[test]
fn cells_have_the_colours_of_their_values() {
    let mesh = block("bar", [0.0; 3], [3.0, 1.0, 1.0], [3, 1, 1]);
    let values = [2.0, 4.0, 6.0];
    let mut scene = bare(&mesh);
    scene.add(Layer { cells: vec![0, 1, 2], paint: Paint::Cells(&values), style: Style::Solid, edges: false }).unwrap();
    scene.view = View::named("front").unwrap();
    scene.scale = Some(ColourScale::new("x", ColourMap::Viridis, [2.0, 6.0]).unwrap());
    let picture = scene.picture(&canvas(400, 300)).unwrap();
    for value in values {
        let colour = ColourMap::Viridis.at((value - 2.0) / 4.0).0;
        let count = picture.pixels().chunks(3).filter(|p| **p == colour).count();
        assert!(count > 1000, "{value}: {count}");
    }
}

#[test]
fn point_values_are_linear_across_a_face() {
    let cube = unit_cube();
    let values: Vec<f64> = cube.nodes.iter().map(|x| 5.0 + 2.0 * x[0]).collect();
    let mut scene = bare(&cube);
    scene.add(Layer { cells: vec![0], paint: Paint::Points(&values), style: Style::Solid, edges: false }).unwrap();
    scene.view = View::named("front").unwrap();
    scene.scale = Some(ColourScale::new("x", ColourMap::Viridis, [5.0, 7.0]).unwrap());
    let picture = scene.picture(&canvas(400, 300)).unwrap();
    // The cube is as high as the frame; find its columns in the middle row.
    let row: Vec<[u8; 3]> = (0..400).map(|x| picture.pixel(x, 150).unwrap()).collect();
    let first = row.iter().position(|p| *p != [255; 3]).unwrap();
    let width = row[first..].iter().position(|p| *p == [255; 3]).unwrap();
    assert!((width as f64 - inside(400, 300)[1]).abs() < 1.5, "{width}");
    for i in (2..width - 2).step_by(7) {
        let expected = ColourMap::Viridis.at((i as f64 + 0.5) / width as f64).0;
        let found = row[first + i];
        assert!((0..3).all(|c| found[c].abs_diff(expected[c]) <= 3), "column {i}: {found:?}, {expected:?}");
    }
}

#[test]
fn ticks_are_round_and_named_with_the_digits_they_need() {
    let names = |low, high| legend::ticks(low, high, 5).into_iter().map(|(_, name)| name).collect::<Vec<_>>().join(" ");
    assert_eq!(names(0.0, 1.0), "0.0 0.2 0.4 0.6 0.8 1.0");
    assert_eq!(names(0.0, 135.1), "0 20 40 60 80 100 120");
    assert_eq!(names(-3.0, 3.0), "−3 −2 −1 0 1 2 3");
    assert_eq!(names(-0.02, 0.02), "−0.02 −0.01 0.00 0.01 0.02");
    assert_eq!(names(0.0, 2.1e6), "0 0.5·10⁶ 1.0·10⁶ 1.5·10⁶ 2.0·10⁶");
    assert_eq!(names(0.0, 4e-6), "0 1·10⁻⁶ 2·10⁻⁶ 3·10⁻⁶ 4·10⁻⁶");
    for (low, high) in [(0.1, 0.9), (-7.3, 1e4), (1e-30, 3e-30), (123.4, 123.5)] {
        let values = legend::ticks(low, high, 5);
        assert!((2..=9).contains(&values.len()), "{low} to {high}: {values:?}");
        assert!(values.iter().all(|(v, _)| (low - 1e-9 * high..=high * (1.0 + 1e-9)).contains(v)));
    }
}

//! Solids whose volumes and faces are known.

use super::*;
use slipstick_mesh::Shape;
use nalgebra::Vector3;

/// A tube along z with a square outline: a box of 4 × 4 × 2 with a bore of radius 1, whose circle has `count` chords.
fn bored_block(count: usize) -> Source {
    let mut source = Source::default();
    let at = |k: usize| std::f64::consts::TAU * k as f64 / count as f64;
    let square = |k: usize| {
        let (s, c) = at(k).sin_cos();
        let far = 2.0 / s.abs().max(c.abs());
        [far * c, far * s]
    };
    for z in [0.0, 2.0] {
        source.points.extend((0..count).map(|k| [at(k).cos(), at(k).sin(), z]));
        source.points.extend((0..count).map(|k| [square(k)[0], square(k)[1], z]));
    }
    let n = count as u32;
    let axis = Vector3::z();
    let bore = Shape::Cone { point: Vector3::zeros(), axis, radius: 1.0, slope: 0.0 };
    let mut quad = |corners: [u32; 4], shape: Option<Shape>, name: &str| {
        let [a, b, c, d] = corners;
        for triangle in [[a, b, c], [a, c, d]] {
            source.triangles.push(triangle);
            source.outer.push(true);
            source.shapes.push(shape);
            source.names.push(name.into());
        }
    };
    for k in 0..n {
        let l = (k + 1) % n;
        let (inner, outer, top) = ([k, l], [n + k, n + l], 2 * n);
        quad([inner[0], inner[1], outer[1], outer[0]], None, "bottom");
        quad([inner[1] + top, inner[0] + top, outer[0] + top, outer[1] + top], None, "top");
        quad([inner[1], inner[0], inner[0] + top, inner[1] + top], Some(bore), "bore");
        quad([outer[0], outer[1], outer[1] + top, outer[0] + top], None, "side");
    }
    source
}

#[test]
fn a_bored_block_has_eight_faces() {
    let (text, faces) = step(&[("block".into(), vec![bored_block(24)])], None).expect("mm");
    assert_eq!(faces, Faces { planes: 6, curved: 2, facets: 0, left: 0 });
    std::fs::write("/tmp/b1w/block.step", &text).unwrap();
}

//! Tori: fillets, rims and rings.

use super::*;

/// Points of a quarter of a circle of radius 1 about (r, z) from an angle on, in a half plane, with its torus about z.
fn round(r: f64, z: f64, from: f64) -> Vec<([f64; 2], Option<Shape>)> {
    let torus = Shape::Torus { centre: Vector3::new(0.0, 0.0, z), axis: Vector3::z(), radius: r, tube: 1.0 };
    let angle = |k: usize| from + 0.5 * PI * k as f64 / 6.0;
    (0..=6).map(|k| ([r + angle(k).cos(), z + angle(k).sin()], Some(torus))).collect()
}

/// Tori that touch planes and cylinders. Volumes are those of Pappus' theorem: a disc with a round rim, 2π times the first
/// moments of a rectangle and half a circle; and a disc with a hub and a fillet, whose section is a square without a
/// quarter of a circle.
#[test]
fn tori_are_exact() {
    let mut rim = vec![([0.0, 0.0], None)];
    rim.extend(round(2.0, 1.0, -0.5 * PI).into_iter().take(6));
    rim.extend(round(2.0, 1.0, 0.0));
    rim.last_mut().expect("the end of the rim").1 = None;
    rim.push(([0.0, 2.0], None));
    let disc = turned(&rim, 24);
    let brep = assert_closed(&disc, 8.0 * PI + 2.0 * PI * PI + 4.0 * PI / 3.0);
    assert_eq!(brep.faces.iter().filter(|face| matches!(face.surface, Surface::Torus { .. })).count(), 2);
    let (text, faces) = step(&[("disc".into(), vec![disc.clone()])], "millimeter");
    assert_eq!(faces, Faces { planes: 2, curved: 2, facets: 0, left: 0 });
    assert_eq!(text.matches("=TOROIDAL_SURFACE(").count(), 2, "the halves have their own seams");

    let hub = Shape::Cone { point: CENTRE, axis: Vector3::z(), radius: 2.0, slope: 0.0 };
    let outer = Shape::Cone { point: CENTRE, axis: Vector3::z(), radius: 4.0, slope: 0.0 };
    let mut profile = vec![([0.0, 0.0], None), ([4.0, 0.0], Some(outer)), ([4.0, 1.0], None)];
    profile.extend(round(3.0, 2.0, -PI).into_iter().rev());
    profile.last_mut().expect("the end of the fillet").1 = Some(hub);
    profile.extend([([2.0, 4.0], None), ([0.0, 4.0], None)]);
    let fillet = 2.0 * PI * (2.5 - 0.75 * PI + 1.0 / 3.0);
    let brep = assert_closed(&turned(&profile, 24), 28.0 * PI + fillet);
    assert_eq!(brep.faces.iter().filter(|face| matches!(face.surface, Surface::Torus { .. })).count(), 2);
}

/// A whole ring, which closes around its axis and its tube, has the volume 2π² R r².
#[test]
fn a_ring_has_four_faces() {
    let (count, rows) = (24_u32, 12_u32);
    let mut source = Source::default();
    let angle = |k: u32, of: u32| std::f64::consts::TAU * f64::from(k) / f64::from(of);
    for (k, v) in (0..count).flat_map(|k| (0..rows).map(move |v| (k, v))) {
        let (from, z) = (3.0 + angle(v, rows).cos(), angle(v, rows).sin());
        source.points.push([from * angle(k, count).cos(), from * angle(k, count).sin(), z]);
        let at = |k: u32, v: u32| (k % count) * rows + v % rows;
        let [a, b, c, d] = [at(k, v), at(k + 1, v), at(k + 1, v + 1), at(k, v + 1)];
        source.triangles.extend([[a, b, c], [a, c, d]]);
    }
    let torus = Shape::Torus { centre: CENTRE, axis: Vector3::z(), radius: 3.0, tube: 1.0 };
    source.shapes = vec![Some(torus); source.triangles.len()];
    source.outer = vec![true; source.triangles.len()];
    source.names = vec![String::new(); source.triangles.len()];
    let brep = assert_closed(&source, 6.0 * PI * PI);
    assert_eq!(brep.faces.len(), 4);
    // a torus that meets its own axis stays facets
    let torus = Shape::Torus { centre: CENTRE, axis: Vector3::z(), radius: 1.0, tube: 1.0 };
    source.shapes = vec![Some(torus); source.triangles.len()];
    let (_, faces) = step(&[("ring".into(), vec![source])], "millimeter");
    assert_eq!((faces.curved, faces.left), (0, 0));
}

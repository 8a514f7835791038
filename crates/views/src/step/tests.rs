//! Solids whose volumes and faces are known.

use super::*;
use nalgebra::Vector3;
use slipstick_mesh::Shape;

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
    let (text, faces) = step(&[("block".into(), vec![bored_block(24)])], "millimeter");
    assert_eq!(faces, Faces { planes: 6, curved: 2, facets: 0, left: 0 });
    assert_eq!(text.matches("CYLINDRICAL_SURFACE").count(), 2, "the halves have their own seams");
    assert_eq!((text.matches("=CIRCLE(").count(), text.matches("=LINE(").count()), (4, 14));
    assert_eq!(text.matches("=VERTEX_POINT(").count(), 12);
}

/// A body of revolution about z: the profile runs from the axis back to it; each of its segments lies on a shape, or in a
/// plane.
fn turned(profile: &[([f64; 2], Option<Shape>)], count: usize) -> Source {
    let mut source = Source::default();
    let mut rings: Vec<Vec<u32>> = Vec::new();
    for ([r, z], _) in profile {
        let first = source.points.len() as u32;
        if *r == 0.0 {
            source.points.push([0.0, 0.0, *z]);
            rings.push(vec![first; count]);
        } else {
            let at = |k: usize| std::f64::consts::TAU * k as f64 / count as f64;
            source.points.extend((0..count).map(|k| [r * at(k).cos(), r * at(k).sin(), *z]));
            rings.push((first..first + count as u32).collect());
        }
    }
    for (pair, (_, shape)) in rings.windows(2).zip(profile) {
        for k in 0..count {
            let l = (k + 1) % count;
            let [a, b, c, d] = [pair[0][k], pair[0][l], pair[1][l], pair[1][k]];
            for triangle in [[a, b, c], [a, c, d]] {
                if triangle[0] != triangle[1] && triangle[1] != triangle[2] && triangle[2] != triangle[0] {
                    source.triangles.push(triangle);
                    source.outer.push(true);
                    source.shapes.push(*shape);
                    source.names.push(String::new());
                }
            }
        }
    }
    source
}

const CENTRE: Vector3<f64> = Vector3::new(0.0, 0.0, 0.0);

/// A ball, from its lowest to its highest point.
fn ball(radius: f64, rows: usize, count: usize) -> Source {
    let shape = Some(Shape::Sphere { centre: CENTRE, radius });
    let at = |k: usize| std::f64::consts::PI * k as f64 / rows as f64;
    let ring =
        |k: usize| ([if k.is_multiple_of(rows) { 0.0 } else { radius * at(k).sin() }, -radius * at(k).cos()], shape);
    turned(&(0..=rows).map(ring).collect::<Vec<_>>(), count)
}

/// A frustum with a hemispherical pit in its wide end, radius 1 and 2, height 3.
fn pitted_frustum(count: usize) -> Source {
    let cone = Shape::Cone { point: CENTRE, axis: Vector3::z(), radius: 1.0, slope: 1.0 / 3.0 };
    let pit = Some(Shape::Sphere { centre: Vector3::new(0.0, 0.0, 3.0), radius: 0.8 });
    let mut profile = vec![([0.0, 0.0], None), ([1.0, 0.0], Some(cone)), ([2.0, 3.0], None)];
    let at = |k: usize| 0.5 * std::f64::consts::PI * k as f64 / 6.0;
    profile.extend((0..7).map(|k| ([if k == 6 { 0.0 } else { 0.8 * at(k).cos() }, 3.0 - 0.8 * at(k).sin()], pit)));
    turned(&profile, count)
}

/// The edges of a boundary lie on both surfaces beside them, and are used once in each direction; its loops are closed.
fn assert_closed(source: &Source) -> brep::Brep {
    let named = solid(source, &mut Faces::default());
    let tolerance = named.quantum / WRITTEN;
    let mut used = vec![[0; 2]; named.brep.edges.len()];
    for face in &named.brep.faces {
        for ring in &face.loops {
            for (k, &(edge, forward)) in ring.iter().enumerate() {
                used[edge][usize::from(forward)] += 1;
                let (then, ahead) = ring[(k + 1) % ring.len()];
                assert_eq!(
                    named.brep.edges[edge].ends[usize::from(forward)],
                    named.brep.edges[then].ends[usize::from(!ahead)],
                    "a gap in a loop"
                );
                for x in named.brep.edges[edge].samples(&named.brep.vertices) {
                    assert!(face.surface.distance(&x).abs() < 10.0 * tolerance, "an edge beside {:?}", face.surface);
                }
            }
        }
    }
    assert!(used.iter().all(|both| *both == [1, 1]), "an edge that is not used twice");
    named.brep
}

impl brep::Edge {
    /// Points between the ends.
    fn samples(&self, vertices: &[surface::V]) -> Vec<surface::V> {
        let [a, b] = self.ends.map(|end| vertices[end]);
        let between = [0.25, 0.5, 0.75];
        match &self.curve {
            curve::Curve::Line => between.map(|t| a * (1.0 - t) + b * t).to_vec(),
            curve::Curve::Conic { centre, normal, major, semi } => {
                let minor = normal.cross(major);
                let angle =
                    |x: &surface::V| ((x - centre).dot(&minor) / semi[1]).atan2((x - centre).dot(major) / semi[0]);
                let turn = (angle(&b) - angle(&a)).rem_euclid(std::f64::consts::TAU);
                let at = |t: f64| angle(&a) + t * turn;
                between.map(|t| centre + major * (semi[0] * at(t).cos()) + minor * (semi[1] * at(t).sin())).to_vec()
            }
            curve::Curve::Spline { points, tangents } => (0..points.len() - 1)
                .map(|k| {
                    let chord = (points[k + 1] - points[k]).norm();
                    (points[k] + points[k + 1]) / 2.0 + (tangents[k] - tangents[k + 1]) * (chord / 8.0)
                })
                .collect(),
        }
    }
}

#[test]
fn boundaries_are_closed_and_edges_on_both_surfaces() {
    let block = assert_closed(&bored_block(24));
    assert_eq!((block.faces.len(), block.edges.len(), block.vertices.len()), (8, 18, 12));
    let whole = assert_closed(&ball(1.0, 12, 24));
    assert!(whole.faces.len() <= 8, "{}", whole.faces.len());
    let frustum = assert_closed(&pitted_frustum(24));
    let planes = frustum.faces.iter().filter(|face| matches!(face.surface, Surface::Plane { .. })).count();
    assert_eq!(planes, 2);
}

/// A ball with 2304 triangles, of which at most points on its equator stay: the surface stays closed, and as close as asked.
#[test]
fn simple_surfaces_stay_close() {
    let source = ball(1.0, 24, 48);
    let free: Vec<bool> = source.points.iter().map(|x| x[2].abs() > 1e-9).collect();
    let volume = |triangles: &[[u32; 3]]| -> f64 {
        let at = |n: u32| Vector3::from(source.points[n as usize]);
        triangles.iter().map(|&[a, b, c]| at(a).dot(&at(b).cross(&at(c))) / 6.0).sum()
    };
    let whole = volume(&source.triangles);
    let kept = simplified(&source.points, &source.triangles, &free, (0.01, 5e-3 * whole));
    let triangles: Vec<[u32; 3]> = kept.iter().map(|(_, triangle)| *triangle).collect();
    assert!(triangles.len() < source.triangles.len() * 4 / 5, "{}", triangles.len());
    assert!((volume(&triangles) / whole - 1.0).abs() < 5e-3);
    let edges: std::collections::BTreeSet<[u32; 2]> =
        triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
    assert_eq!(edges.len(), 3 * triangles.len());
    assert!(edges.iter().all(|&[a, b]| edges.contains(&[b, a])));
    let used: std::collections::BTreeSet<u32> = triangles.iter().flatten().copied().collect();
    assert!((0..free.len() as u32).all(|n| free[n as usize] || used.contains(&n)), "the equator stays");
    // no triangle is farther inside the ball than its own chords and the tolerance
    for corners in &triangles {
        let middle: Vector3<f64> =
            corners.iter().map(|&n| Vector3::from(source.points[n as usize])).sum::<Vector3<f64>>() / 3.0;
        assert!(middle.norm() > 1.0 - 0.01 - 0.009, "{}", middle.norm());
    }
    assert_eq!(simplified(&source.points, &source.triangles, &free, (0.0, 1.0)).len(), source.triangles.len());
}

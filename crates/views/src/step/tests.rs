//! Solids whose volumes and faces are known.

use std::f64::consts::PI;

use super::*;
use nalgebra::Vector3;
use slipstick_mesh::Shape;

mod tori;

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
    let at = |k: usize| PI * k as f64 / rows as f64;
    let ring =
        |k: usize| ([if k.is_multiple_of(rows) { 0.0 } else { radius * at(k).sin() }, -radius * at(k).cos()], shape);
    turned(&(0..=rows).map(ring).collect::<Vec<_>>(), count)
}

/// A frustum with a hemispherical pit in its wide end, radius 1 and 2, height 3.
fn pitted_frustum(count: usize) -> Source {
    let cone = Shape::Cone { point: CENTRE, axis: Vector3::z(), radius: 1.0, slope: 1.0 / 3.0 };
    let pit = Some(Shape::Sphere { centre: Vector3::new(0.0, 0.0, 3.0), radius: 0.8 });
    let mut profile = vec![([0.0, 0.0], None), ([1.0, 0.0], Some(cone)), ([2.0, 3.0], None)];
    let at = |k: usize| 0.5 * PI * k as f64 / 6.0;
    profile.extend((0..7).map(|k| ([if k == 6 { 0.0 } else { 0.8 * at(k).cos() }, 3.0 - 0.8 * at(k).sin()], pit)));
    turned(&profile, count)
}

/// A tube of `kept` cells about z, 15° wide and of height 1, six above each other, between the radii 1 and 2.
fn cells(kept: impl Fn(usize, usize) -> bool) -> Source {
    let (count, rows) = (24, 6);
    let mut source = Source::default();
    for z in 0..=rows {
        for (k, r) in (0..count).flat_map(|k| [(k, 1.0), (k, 2.0)]) {
            let (s, c) = (std::f64::consts::TAU * k as f64 / count as f64).sin_cos();
            source.points.push([r * c, r * s, z as f64]);
        }
    }
    let cylinder = |radius: f64| Some(Shape::Cone { point: CENTRE, axis: Vector3::z(), radius, slope: 0.0 });
    let is_kept = |k: usize, z: usize| z < rows && kept(k % count, z);
    for (z, k) in (0..rows).flat_map(|z| (0..count).map(move |k| (z, k))).filter(|&(z, k)| is_kept(k, z)) {
        // corners: inner and outer, at the lower and the higher angle, below and above
        let at = |outer: usize, along: usize, up: usize| (((z + up) * count + (k + along) % count) * 2 + outer) as u32;
        let mut quad = |[a, b, c, d]: [u32; 4], shape: Option<Shape>| {
            source.triangles.extend([[a, b, c], [a, c, d]]);
            source.outer.extend([true; 2]);
            source.shapes.extend([shape; 2]);
            source.names.extend([String::new(), String::new()]);
        };
        quad([at(1, 0, 0), at(1, 1, 0), at(1, 1, 1), at(1, 0, 1)], cylinder(2.0));
        quad([at(0, 1, 0), at(0, 0, 0), at(0, 0, 1), at(0, 1, 1)], cylinder(1.0));
        if z == 0 || !is_kept(k, z - 1) {
            quad([at(0, 0, 0), at(0, 1, 0), at(1, 1, 0), at(1, 0, 0)], None);
        }
        if !is_kept(k, z + 1) {
            quad([at(0, 1, 1), at(0, 0, 1), at(1, 0, 1), at(1, 1, 1)], None);
        }
        if !is_kept(k + count - 1, z) {
            quad([at(0, 0, 0), at(1, 0, 0), at(1, 0, 1), at(0, 0, 1)], None);
        }
        if !is_kept(k + 1, z) {
            quad([at(1, 1, 0), at(0, 1, 0), at(0, 1, 1), at(1, 1, 1)], None);
        }
    }
    source
}

fn turned_inside_out(mut source: Source) -> Source {
    source.triangles.iter_mut().for_each(|triangle| triangle.swap(0, 1));
    source
}

/// The edges of a boundary lie on both surfaces beside them, and are used once in each direction; its loops are closed, and
/// enclose a volume.
fn assert_closed(source: &Source, volume: f64) -> brep::Brep {
    assert_closed_within(source, [volume - 1e-5 * volume.abs(), volume + 1e-5 * volume.abs()])
}

fn assert_closed_within(source: &Source, [least, most]: [f64; 2]) -> brep::Brep {
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
                for x in [0.23, 0.5, 0.79].map(|t| named.brep.edges[edge].at(&named.brep.vertices, t)) {
                    assert!(face.surface.distance(&x).abs() < 10.0 * tolerance, "an edge beside {:?}", face.surface);
                }
            }
        }
    }
    assert!(used.iter().all(|both| *both == [1, 1]), "an edge that is not used twice");
    let found = enclosed(&named);
    assert!(least < found && found < most, "{found} instead of {least} to {most}");
    named.brep
}

/// The volume within a boundary, from its surfaces and loops: ∫ x · n dA / 3. On each face, the first loop runs
/// counter-clockwise seen from outside, and the others clockwise.
fn enclosed(named: &Named) -> f64 {
    let brep = &named.brep;
    let mut volume = 0.0;
    for face in &brep.faces {
        let frame = face.region.and_then(|region| named.frames[region]);
        for (k, ring) in face.loops.iter().enumerate() {
            let along = |&(edge, forward): &(usize, bool)| {
                let at =
                    move |i: usize| f64::from(u8::from(!forward)) + if forward { 1.0 } else { -1.0 } * i as f64 / 1e3;
                (0..1000).map(move |i| brep.edges[edge].at(&brep.vertices, at(i)))
            };
            let points: Vec<surface::V> = ring.iter().flat_map(along).collect();
            let (area, flux) = integrals(&face.surface, frame, &points);
            assert_eq!((area > 0.0) == face.outward, k == 0, "loop {k} of a face on {:?}", face.surface);
            volume += flux / 3.0;
        }
    }
    volume
}

/// Integrals along the normal of a surface within a loop: one with the sign of the area, and that of x · n. On a surface of
/// revolution with radius r(z), by Green's theorem: ∫ f dθ dz = ∮ G dz, where f is the derivative of G with respect to θ.
fn integrals(surface: &Surface, frame: seams::Frame, points: &[surface::V]) -> (f64, f64) {
    let next = |k: usize| points[(k + 1) % points.len()];
    if let Surface::Bilinear { corners: [a, b, c, d] } = surface {
        // the mean of both divisions into two triangles: the normal is linear in both parameters
        let triangles = [[a, b, c], [a, c, d], [a, b, d], [b, c, d]];
        let flux = triangles.map(|[a, b, c]| a.dot(&b.cross(c)) / 2.0).iter().sum::<f64>() / 2.0;
        let normal = (c - a).cross(&(d - b));
        let twice = (0..points.len()).map(|k| (points[k] - points[0]).cross(&(next(k) - points[0])).dot(&normal));
        return (twice.sum::<f64>(), flux);
    }
    if let Surface::Plane { origin, normal } = surface {
        let twice = (0..points.len()).map(|k| (points[k] - points[0]).cross(&(next(k) - points[0])).dot(normal));
        let area = twice.sum::<f64>() / 2.0;
        return (area, area * origin.dot(normal));
    }
    let [axis, first] = frame.expect("a frame");
    let second = axis.cross(&first);
    let (through, _) = surface.axis().expect("a surface of revolution");
    // ∫ f dθ dv with the angle v about the tube of a torus, by which the points go on less than half a turn at a time
    if let Surface::Torus { radius, tube, .. } = surface {
        let primitives = |x: &surface::V| {
            let arm = x - through;
            let (across, along) = ([arm.dot(&first), arm.dot(&second)], arm.dot(&axis));
            let angle = across[1].atan2(across[0]).rem_euclid(std::f64::consts::TAU);
            let (from, v) = (across[0].hypot(across[1]), along.atan2(across[0].hypot(across[1]) - radius));
            let of_centre = v.cos() * (through.dot(&first) * angle.sin() - through.dot(&second) * angle.cos());
            let off = radius * v.cos() + tube + v.sin() * through.dot(&axis);
            (angle * tube * from, (angle * off + of_centre) * tube * from, v)
        };
        let mut sums = (0.0, 0.0);
        for k in 0..points.len() {
            let (a, b) = (primitives(&points[k]), primitives(&next(k)));
            let by = (b.2 - a.2 + PI).rem_euclid(2.0 * PI) - PI;
            sums = (sums.0 + (a.0 + b.0) / 2.0 * by, sums.1 + (a.1 + b.1) / 2.0 * by);
        }
        return sums;
    }
    let primitives = |x: &surface::V| {
        let arm = x - through;
        let (angle, z) = (arm.dot(&second).atan2(arm.dot(&first)).rem_euclid(std::f64::consts::TAU), arm.dot(&axis));
        let (r, growth) = match surface {
            Surface::Cone { radius, slope, .. } => (radius + slope * z, (radius + slope * z) * slope),
            Surface::Sphere { radius, .. } => ((radius * radius - z * z).sqrt(), -z),
            Surface::Torus { .. } | Surface::Plane { .. } | Surface::Bilinear { .. } => unreachable!("above"),
        };
        let of_centre = r * (through.dot(&first) * angle.sin() - through.dot(&second) * angle.cos());
        (angle * r, angle * (r * r - growth * (z + through.dot(&axis))) + of_centre, z)
    };
    let mut sums = (0.0, 0.0);
    for k in 0..points.len() {
        let (a, b) = (primitives(&points[k]), primitives(&next(k)));
        sums.0 += (a.0 + b.0) / 2.0 * (b.2 - a.2);
        sums.1 += (a.1 + b.1) / 2.0 * (b.2 - a.2);
    }
    sums
}

impl brep::Edge {
    /// The point at a fraction of the parameter.
    fn at(&self, vertices: &[surface::V], t: f64) -> surface::V {
        let [a, b] = self.ends.map(|end| vertices[end]);
        match &self.curve {
            curve::Curve::Line => a * (1.0 - t) + b * t,
            curve::Curve::Conic { centre, normal, major, semi } => {
                let minor = normal.cross(major);
                let angle =
                    |x: &surface::V| ((x - centre).dot(&minor) / semi[1]).atan2((x - centre).dot(major) / semi[0]);
                let at = angle(&a) + t * (angle(&b) - angle(&a)).rem_euclid(std::f64::consts::TAU);
                centre + major * (semi[0] * at.cos()) + minor * (semi[1] * at.sin())
            }
            curve::Curve::Spline { points, tangents } => {
                let k = ((t * (points.len() - 1) as f64) as usize).min(points.len() - 2);
                let s = t * (points.len() - 1) as f64 - k as f64;
                let (chord, rest) = ((points[k + 1] - points[k]).norm(), 1.0 - s);
                points[k] * (rest * rest * (1.0 + 2.0 * s))
                    + points[k + 1] * (s * s * (3.0 - 2.0 * s))
                    + (tangents[k] * rest - tangents[k + 1] * s) * (chord * s * rest)
            }
        }
    }
}

/// Volumes are those of the formulas for a box, a cylinder, a ball and a frustum.
#[test]
fn boundaries_are_closed_and_edges_on_both_surfaces() {
    let block = assert_closed(&bored_block(24), 32.0 - 2.0 * PI);
    assert_eq!((block.faces.len(), block.edges.len(), block.vertices.len()), (8, 18, 12));
    let whole = assert_closed(&ball(1.0, 12, 24), 4.0 / 3.0 * PI);
    assert!(whole.faces.len() <= 8, "{}", whole.faces.len());
    let frustum = assert_closed(&pitted_frustum(24), 7.0 * PI - 2.0 / 3.0 * PI * 0.512);
    let planes = frustum.faces.iter().filter(|face| matches!(face.surface, Surface::Plane { .. })).count();
    assert_eq!(planes, 2);
    assert_closed(&turned_inside_out(bored_block(24)), 2.0 * PI - 32.0);
}

/// Balls of radius 1 and 1/2 about one centre.
#[test]
fn a_cavity_is_a_second_shell() {
    let (mut source, inner) = (ball(1.0, 12, 24), turned_inside_out(ball(0.5, 12, 24)));
    let first = source.points.len() as u32;
    source.points.extend(inner.points);
    source.triangles.extend(inner.triangles.iter().map(|triangle| triangle.map(|n| n + first)));
    source.outer.extend(inner.outer);
    source.shapes.extend(inner.shapes);
    source.names.extend(inner.names);
    let brep = assert_closed(&source, 7.0 / 6.0 * PI);
    for (shell, outward) in brep.shells.iter().zip([true, false]) {
        assert!(shell.iter().all(|&face| brep.faces[face].outward == outward));
    }
    let (text, _) = step(&[("ball".into(), vec![source])], "millimeter");
    assert_eq!((brep.shells.len(), text.matches("=BREP_WITH_VOIDS(").count()), (2, 1));
}

/// A tube with a slot of 45° and a window of 180°, whose loop has the larger vector area: 2 r h sin of half the angle is
/// 16 for the window, and 9.2 for the face.
#[test]
fn a_window_is_no_outer_loop() {
    let source = cells(|k, z| k < 21 && !((4..16).contains(&k) && (1..5).contains(&z)));
    let brep = assert_closed(&source, (21.0 * 6.0 - 12.0 * 4.0) * 1.5 * PI / 12.0);
    let curved: Vec<_> = brep.faces.iter().filter(|face| !matches!(face.surface, Surface::Plane { .. })).collect();
    assert_eq!((brep.faces.len(), curved.len()), (10, 2));
    for face in curved {
        let lowest =
            |ring: &brep::Ring| ring.iter().map(|&(e, _)| brep.vertices[brep.edges[e].ends[0]].z).fold(9.0, f64::min);
        assert_eq!(face.loops.iter().map(lowest).collect::<Vec<_>>(), [0.0, 1.0]);
    }
}

/// A bore beside 1056 plane faces of one triangle each.
#[test]
fn a_bore_among_many_faces_is_divided() {
    let mut source = bored_block(176);
    for (t, name) in source.names.iter_mut().enumerate().filter(|(_, name)| *name != "bore") {
        *name = t.to_string();
    }
    let (_, faces) = step(&[("block".into(), vec![source.clone()])], "millimeter");
    assert_eq!(faces, Faces { planes: 1056, curved: 2, facets: 0, left: 0 });
    assert_closed(&source, 32.0 - 2.0 * PI);
}

/// The facets of a ball without a shape: all but a few become bilinear faces of two, and the volume is that of both
/// divisions of a face into two triangles, between those of the balls within and around them.
#[test]
fn facets_in_pairs_are_bilinear() {
    let mut source = ball(1.0, 24, 48);
    source.shapes.iter_mut().for_each(|shape| *shape = None);
    source.outer.iter_mut().for_each(|outer| *outer = false);
    // off every plane of four points
    for (k, x) in source.points.iter_mut().enumerate() {
        let factor = 1.0 - 1e-3 * (k as f64 * 0.7).sin().abs();
        *x = x.map(|c| c * factor);
    }
    let (text, faces) = step(&[("ball".into(), vec![source.clone()])], "millimeter");
    assert!(faces.facets < source.triangles.len() * 2 / 3, "{faces:?}");
    assert_eq!(
        text.matches("=PLANE(").count() + text.matches("=B_SPLINE_SURFACE_WITH_KNOTS(").count(),
        faces.facets + faces.planes
    );
    assert_closed_within(&source, [4.0 / 3.0 * PI * 0.98, 4.0 / 3.0 * PI]);
}

#[test]
fn a_surface_that_is_not_finite_stays_facets() {
    let mut source = bored_block(24);
    for shape in source.shapes.iter_mut().flatten() {
        *shape = Shape::Cone { point: CENTRE, axis: Vector3::z(), radius: f64::NAN, slope: 0.0 };
    }
    let (text, faces) = step(&[("block".into(), vec![source])], "millimeter");
    assert_eq!((faces.curved, faces.planes), (0, 30));
    assert!(!text.contains("NaN"));
}

/// A block with a point in a triangle of its top, `off` from the middle of the chord of the bore, and `above` the top.
fn pricked_block(off: f64, above: f64) -> Source {
    let mut source = bored_block(24);
    let top = source.names.iter().position(|name| name == "top").expect("a top");
    let [a, b, c] = source.triangles[top];
    let middle = (0..3).map(|i| (source.points[a as usize][i] + source.points[b as usize][i]) / 2.0);
    let middle: Vector3<f64> = Vector3::from_iterator(middle);
    let point = middle + Vector3::new(middle.x, middle.y, 0.0).normalize() * off + Vector3::z() * above;
    let new = source.points.len() as u32;
    source.points.push(point.into());
    source.triangles[top] = [a, b, new];
    source.outer[top] = false;
    source.triangles.extend([[b, c, new], [c, a, new]]);
    source.outer.extend([false; 2]);
    source.shapes.extend([None; 2]);
    source.names.extend(["top".to_owned(), "top".to_owned()]);
    source
}

/// Points that move outward by 0.03 would pass a point that is 0.01 beside the bore, but not one that is 0.05 beside it. The
/// bore then has facets there; the volume differs by less than one of its 24 sectors.
#[test]
fn triangles_do_not_turn_over() {
    for (off, left, above) in [(0.01, 1, 0.0), (0.01, 1, 0.005), (0.05, 0, 0.0), (0.05, 0, 0.005)] {
        let mut source = pricked_block(off, above);
        for shape in source.shapes.iter_mut().flatten() {
            *shape = Shape::Cone { point: CENTRE, axis: Vector3::z(), radius: 1.03, slope: 0.0 };
        }
        let (_, faces) = step(&[("block".into(), vec![source.clone()])], "millimeter");
        assert!(faces.left == left && faces.curved >= 2 - left, "{off} {above}: {faces:?}");

        let (exact, sector) = (32.0 - 2.0 * PI * 1.03 * 1.03, 2.0 * PI * 1.03 * 1.03 / 24.0);
        assert_closed_within(&source, [exact - 0.01, exact + (left as f64).max(0.01) * sector]);
    }
}

/// Points that would move by 0.45 of their shortest edge, a chord of the bore, stay.
#[test]
fn points_stay_apart() {
    let mut source = bored_block(24);
    let chord = 2.0 * (PI / 24.0).sin();
    for shape in source.shapes.iter_mut().flatten() {
        *shape = Shape::Cone { point: CENTRE, axis: Vector3::z(), radius: 1.0 - 0.45 * chord, slope: 0.0 };
    }
    let (_, faces) = step(&[("block".into(), vec![source])], "millimeter");
    assert_eq!((faces.left, faces.curved), (1, 0));
}

/// Two of three facets whose new corner is one of the others.
#[test]
fn a_triangle_without_area_has_directions() {
    let mut source = pricked_block(0.0, 0.0);
    let [a, _, new] = *source.triangles.iter().find(|triangle| triangle[2] == 96).expect("a triangle");
    source.points[new as usize] = source.points[a as usize];
    let (text, faces) = step(&[("block".into(), vec![source])], "millimeter");
    assert_eq!(faces.facets, 3);
    assert!(!text.contains("NaN"));
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

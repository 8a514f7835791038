//! Checks properties that hold for any surface, and known volumes.

use std::collections::{HashMap, HashSet};

use slipstick_mesh::{
    BoxShape, HalfBallShape, HalfRingShape, HollowCylinderShape, Mesh, Placement, Rotation, box_mesh, half_ball,
    half_ring, hollow_cylinder,
};

use super::extract::extract;
use super::lattice::Lattice;
use super::smooth::{Rules, smoothed};
use super::walls::Walls;
use super::*;

fn block(elements: [usize; 3]) -> Mesh {
    let max = elements.map(|n| n as f64);
    box_mesh("block", &BoxShape { min: [0.0; 3], max, elements, grading: [1.0; 3] }).expect("a box")
}

/// All shapes of the generators in one mesh.
fn shapes() -> Mesh {
    let cylinder = HollowCylinderShape { inner_radius: 1.0, outer_radius: 2.0, height: 1.5, elements: [2, 8, 3] };
    let ring = HalfRingShape { outer_radius: 2.0, inner_radius: 1.0, width: 1.0, elements: [6, 2, 2] };
    let parts = vec![
        block([4, 3, 5]),
        half_ball("ball", &HalfBallShape { radius: 2.0, elements: [4, 2, 2] }).expect("a ball"),
        hollow_cylinder("tube", &cylinder).expect("a tube"),
        half_ring("ring", &ring).expect("a ring"),
    ];
    Mesh::merge(parts).expect("different names")
}

/// The same shapes: of hexahedra, of tetrahedra, of both in each body, of wedges, and of wedges and
/// tetrahedra.
fn kinds() -> [Mesh; 5] {
    let mesh = shapes();
    let (tetrahedra, mixed) = (mesh.divided(|_| true), mesh.divided(|element| element % 3 == 0));
    let wedges = mesh.divided_into_wedges(|_| Some(1));
    let all = mesh.divided_into_wedges(|element| (element % 2 == 0).then_some(1)).divided(|element| element % 5 == 0);
    for mesh in [&wedges, &all] {
        assert!(mesh.check().is_empty(), "{:?}", mesh.check());
    }
    [mesh, tetrahedra, mixed, wedges, all]
}

/// Numbers in [0, 1) of a linear congruential generator (Knuth, MMIX).
fn random(count: usize, seed: u64) -> Vec<f64> {
    let mut state = seed;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    (0..count).map(|_| next()).collect()
}

/// Every edge occurs twice, in opposite directions; and the triangles around every point form one
/// ring, so that no two parts touch at a point.
fn assert_closed(surface: &TriangleSurface) {
    assert_eq!(surface.open_edges(), 0);
    let mut around: HashMap<u32, HashMap<u32, u32>> = HashMap::new();
    for t in &surface.triangles {
        for k in 0..3 {
            around.entry(t[k]).or_default().insert(t[(k + 1) % 3], t[(k + 2) % 3]);
        }
    }
    for (point, ring) in &around {
        let start = *ring.keys().next().expect("a triangle");
        let (mut at, mut seen) = (start, 0);
        loop {
            at = ring[&at];
            seen += 1;
            if at == start {
                break;
            }
        }
        assert_eq!(seen, ring.len(), "triangles around point {point} fall into parts");
    }
    assert_eq!(around.len(), surface.points.len(), "a point without triangles");
}

/// The lowest and highest coordinates of a body.
fn bounds(mesh: &Mesh, body: usize) -> [[f64; 3]; 2] {
    let nodes = &mesh.nodes[mesh.bodies[body].nodes.clone()];
    let of = |c: usize, pick: fn(f64, f64) -> f64| nodes.iter().map(|x| x[c]).reduce(pick).expect("nodes");
    [std::array::from_fn(|c| of(c, f64::min)), std::array::from_fn(|c| of(c, f64::max))]
}

/// Random densities, either only 0 and 1 or any values, have the most intricate surfaces.
#[test]
fn any_densities_give_closed_surfaces() {
    for mesh in kinds() {
        closed_surfaces(&mesh);
    }
}

fn closed_surfaces(mesh: &Mesh) {
    let bodies: Vec<usize> = (0..mesh.bodies.len()).collect();
    for seed in 0..6 {
        let mut density = random(mesh.elements.len(), seed);
        if seed % 2 == 0 {
            density.iter_mut().for_each(|value| *value = value.round());
        }
        let lattice = Lattice::new(mesh, &bodies, &density, &FaceLabels::default());
        let mut walls = Walls::new(mesh, &bodies);
        for threshold in [0.25, 0.45, 0.5, 0.6] {
            let raw = extract(&lattice, threshold, NEAREST);
            assert!(raw.triangles.len() > 200, "{}", raw.triangles.len());
            assert_closed(&raw);
            assert_eq!(raw.crossings(), 0);
            for keep_outer in [true, false] {
                let smooth = smoothed(raw.clone(), &Rules { passes: 10, keep_outer }, &mut walls);
                let beyond = smooth.triangles.iter().zip(&smooth.bodies).any(|(triangle, &body)| {
                    let [low, high] = bounds(mesh, body as usize);
                    let outside = |x: [f64; 3]| (0..3).any(|c| x[c] < low[c] - 1e-9 || x[c] > high[c] + 1e-9);
                    triangle.iter().any(|&n| outside(smooth.points[n as usize]))
                });
                assert!(!(keep_outer && beyond), "{} at {threshold}, seed {seed}", mesh.bodies[0].name);
                assert_eq!(smooth.triangles, raw.triangles);
                assert_eq!(smooth.crossings(), 0, "{} at {threshold}", mesh.bodies[0].name);
                assert!(smooth.points.as_flattened().iter().all(|c| c.is_finite()));
            }
        }
    }
}

/// The volume from the divergence theorem equals that of the parts of the tetrahedra, except where
/// points are kept apart.
#[test]
fn enclosed_volume_is_the_volume_above() {
    let mesh = shapes();
    let bodies: Vec<usize> = (0..mesh.bodies.len()).collect();
    let density = random(mesh.elements.len(), 7);
    let lattice = Lattice::new(&mesh, &bodies, &density, &FaceLabels::default());
    for target in [2.0, 10.0, 25.0, 45.0] {
        let surface = extract(&lattice, lattice.threshold_of_volume(target), [1e-9; 2]);
        assert!((surface.volume() / target - 1.0).abs() < 1e-6, "{} of {target}", surface.volume());
    }
    // All of it: the bodies themselves. Plane faces and straight edges: their own volume to
    // round-off.
    let mesh = block([3, 2, 2]);
    let wedges = mesh.divided_into_wedges(|_| Some(1));
    let all = mesh.divided_into_wedges(|element| (element % 3 == 0).then_some(2)).divided(|element| element % 2 == 0);
    for mesh in [mesh.clone(), mesh.divided(|_| true), mesh.divided(|element| element % 2 == 0), wedges, all] {
        let whole =
            extract(&Lattice::new(&mesh, &[0], &vec![1.0; mesh.elements.len()], &FaceLabels::default()), 0.5, NEAREST);
        assert!((whole.volume() / 12.0 - 1.0).abs() < 1e-14);
        assert_eq!((whole.outer.iter().all(|&outer| outer), whole.pieces()), (true, 1));
    }
}

/// A ball of density 1 in a block, as far as elements resolve it: its volume is preserved with and
/// without smoothing, and a smoothed surface is rounder.
#[test]
fn the_volume_of_the_densities_is_kept() {
    let mesh = block([12, 12, 12]);
    let radius = |x: [f64; 3]| x.map(|c| (c - 6.0).powi(2)).iter().sum::<f64>().sqrt();
    let density: Vec<f64> =
        (0..mesh.elements.len()).map(|e| f64::from(u8::from(radius(mesh.centroid(e)) < 4.0))).collect();
    let count: f64 = density.iter().sum();
    let mut spread = Vec::new();
    for smoothing in [0, 10, 30] {
        let export =
            design_surface(&mesh, &density, &ExportOptions { smoothing, ..Default::default() }).expect("a ball");
        assert!((export.density_volume / count - 1.0).abs() < 1e-12, "elements have volume 1");
        let volume = export.surface.volume();
        assert!((volume / count - 1.0).abs() < 1e-3, "{volume} of {count} after {smoothing} passes");
        assert_closed(&export.surface);
        assert_eq!(export.surface.pieces(), 1);
        let radii: Vec<f64> = export.surface.points.iter().map(|&p| radius(p)).collect();
        let mean = radii.iter().sum::<f64>() / radii.len() as f64;
        spread.push((radii.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / radii.len() as f64).sqrt());
    }
    assert!(spread[1] < spread[0] && spread[2] < spread[1], "{spread:?}");
}

/// A column through a block from face to face: its ends stay in the faces, bit for bit, and the
/// edge of the block stays in place; without this option, both are rounded.
#[test]
fn outer_faces_are_kept() {
    let mesh = block([6, 5, 6]);
    let inside = |e: usize| {
        let [x, _, z] = mesh.centroid(e);
        (x - 2.0).hypot(z - 2.0) < 2.2
    };
    let density: Vec<f64> = (0..mesh.elements.len()).map(|e| f64::from(u8::from(inside(e)))).collect();
    let mut options = ExportOptions { smoothing: 20, ..Default::default() };
    let kept = design_surface(&mesh, &density, &options).expect("a column").surface;
    let raw =
        design_surface(&mesh, &density, &ExportOptions { smoothing: 0, ..Default::default() }).expect("raw").surface;
    let tops = |surface: &TriangleSurface| -> HashSet<u32> {
        let triangles = (0..surface.triangles.len()).filter(|&t| surface.outer[t]);
        let on_top = triangles.filter(|&t| surface.corners(t).iter().all(|p| p[1] == 5.0));
        on_top.flat_map(|t| surface.triangles[t]).collect()
    };
    assert!(tops(&kept).len() > 30);
    for (t, triangle) in kept.triangles.iter().enumerate().filter(|(t, _)| kept.outer[*t]) {
        let area = kept.area_vector(t);
        let along = area.iter().filter(|c| c.abs() > 1e-12).count();
        assert_eq!(along, 1, "triangle {triangle:?} left its face: {area:?}");
        let corners = kept.corners(t);
        let axis = area.iter().position(|c| c.abs() > 1e-12).expect("an axis");
        let limit = if area[axis] > 0.0 { mesh.bounding_box().expect("nodes").1[axis] } else { 0.0 };
        assert!(corners.iter().all(|p| p[axis] == limit), "{corners:?} is not in the face at {limit}");
    }
    let within = |p: &[f64; 3]| (0..3).all(|c| (-1e-12..=[6.0, 5.0, 6.0][c] + 1e-12).contains(&p[c]));
    assert!(kept.points.iter().all(within), "nothing leaves the block");
    assert_closed(&kept);
    // Rims move along themselves, so the column becomes rounder there too.
    assert_ne!(raw.points, kept.points);
    options.keep_surfaces = false;
    let free = design_surface(&mesh, &density, &options).expect("a column").surface;
    assert!(free.points.iter().filter(|p| p[1] == 5.0).count() < tops(&kept).len() / 2);
}

/// Errors contain the reason and the cure.
#[test]
fn what_has_no_surface() {
    let mesh = block([4, 4, 4]);
    let export = |density: &[f64], threshold: Option<f64>, body: &str| {
        let bodies = if body.is_empty() { Vec::new() } else { vec![body.to_owned()] };
        let options = ExportOptions { threshold, bodies, ..Default::default() };
        design_surface(&mesh, density, &options).expect_err("nothing")
    };
    let half = vec![0.5; 64];
    let error = export(&half, None, "");
    assert!(error.to_string().contains("near 0.500") && error.cure().contains("--threshold"), "{error}");
    let error = export(&half, Some(0.9), "");
    assert!(error.to_string().contains("no density is above 0.9") && error.cure().contains("0.500"), "{error}");
    assert!(matches!(export(&[0.0; 64], None, ""), ExportError::NoThreshold { .. }));
    assert!(matches!(export(&half[1..], None, ""), ExportError::Length { found: 63, elements: 64 }));
    assert!(matches!(export(&[f64::NAN; 64], None, ""), ExportError::Density { element: 0, .. }));
    assert!(matches!(export(&half, Some(f64::NAN), ""), ExportError::Threshold { .. }));
    assert!(export(&half, None, "plate").cure().contains("block"));
    let whole = design_surface(&mesh, &[1.0; 64], &ExportOptions::default()).expect("all of it");
    assert!((whole.surface.volume() / 64.0 - 1.0).abs() < 1e-12);
}

/// Each file contains the surface: STL in its own layout (80 bytes, a count, 50 bytes per
/// triangle), OBJ and VTU as text.
#[test]
fn files_hold_the_surface() {
    let folder = tempfile::tempdir().expect("a folder");
    let mesh = block([5, 5, 5]);
    let within = |c: f64| (1.0..4.0).contains(&c);
    let density: Vec<f64> = (0..125).map(|e| f64::from(u8::from(mesh.centroid(e).into_iter().all(within)))).collect();
    let surface = design_surface(&mesh, &density, &ExportOptions::default()).expect("a lump").surface;
    let file = |name: &str| folder.path().join(name);
    write_stl(&file("a.stl"), &surface).expect("written");
    let bytes = std::fs::read(file("a.stl")).expect("read");
    assert_eq!(bytes.len(), 84 + 50 * surface.triangles.len());
    assert_eq!(u32::from_le_bytes([bytes[80], bytes[81], bytes[82], bytes[83]]) as usize, surface.triangles.len());
    assert!(!bytes.starts_with(b"solid"), "which would mean that it is text");
    let number = |at: usize| f32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
    let last = surface.triangles.len() - 1;
    for (corner, point) in surface.corners(last).iter().enumerate() {
        for c in 0..3 {
            assert_eq!(number(84 + 50 * last + 12 + 12 * corner + 4 * c), point[c] as f32);
        }
    }
    // The lump's normals point away from its centre.
    for t in 0..surface.triangles.len() {
        let outward: f32 = (0..3).map(|c| number(84 + 50 * t + 4 * c) * (surface.corners(t)[0][c] as f32 - 2.5)).sum();
        assert!(outward > 0.0);
    }
    write_obj(&file("a.obj"), &surface, &["block"]).expect("written");
    let text = std::fs::read_to_string(file("a.obj")).expect("read");
    let lines = |start: &str| text.lines().filter(|line| line.starts_with(start)).count();
    assert_eq!((lines("v "), lines("f "), lines("o block")), (surface.points.len(), surface.triangles.len(), 1));
    write_vtu(&file("a.vtu"), &surface).expect("written");
    let fields = slipstick_results::output::read_fields(&file("a.vtu")).expect("whole");
    assert_eq!(fields[1].values.len(), surface.triangles.len());

    let mut far = surface;
    far.points.iter_mut().for_each(|p| p[0] += 1e8);
    assert!(matches!(write_stl(&file("b.stl"), &far), Err(ExportError::TooFar)));
    assert!(!file("b.stl").exists());
}

/// A mesh turned about an oblique axis.
fn turned(mut mesh: Mesh) -> Mesh {
    let rotate = Some(Rotation { axis: [1.0, 2.0, 0.5], degrees: 37.0 });
    mesh.transform(&Placement { rotate, translate: [3.0, -1.0, 2.0] }).expect("a rotation");
    mesh
}

/// The elements of a mesh of one body whose centroids are in a region.
fn cut(mesh: &Mesh, region: impl Fn([f64; 3]) -> bool) -> Mesh {
    let mut part = Mesh { nodes: mesh.nodes.clone(), bodies: mesh.bodies.clone(), ..Mesh::default() };
    part.elements = (0..mesh.elements.len()).filter(|&e| region(mesh.centroid(e))).map(|e| mesh.elements[e]).collect();
    part.bodies[0].elements = 0..part.elements.len();
    part
}

/// The surface of all of a mesh.
fn whole(mesh: &Mesh) -> TriangleSurface {
    design_surface(mesh, &vec![1.0; mesh.elements.len()], &ExportOptions::default()).expect("a surface").surface
}

/// A slab's thickness is the shortest distance between its faces, whatever its edges and its
/// direction; it has no gap.
#[test]
fn a_slab_is_as_thick_as_it_is() {
    let shape = BoxShape { min: [0.0; 3], max: [4.0, 0.3, 2.0], elements: [8, 2, 4], grading: [1.0; 3] };
    let mesh = box_mesh("slab", &shape).expect("a box");
    for mesh in [mesh.clone(), turned(mesh)] {
        let found = measure(&whole(&mesh), &[]);
        let member = found.member.expect("opposite faces");
        assert!((member.length / 0.3 - 1.0).abs() < 1e-12, "{member:?}");
        assert_eq!(found.gap, None);
    }
}

/// A wall of one element between void, and a gap of one element between solid, with thresholds at which the
/// nodes beside them are on the wrong side: the Euler characteristic V − E + F of a closed surface is 2, and
/// each hole or pin takes 2 from it. The volume is right to the points that are kept off the nodes.
#[test]
fn thin_walls_and_gaps_stay_whole() {
    let shape = BoxShape { min: [0.0; 3], max: [9.0, 6.0, 5.0], elements: [9, 6, 5], grading: [1.0; 3] };
    let mesh = box_mesh("b", &shape).expect("a box");
    let of = |solid: &dyn Fn([f64; 3]) -> bool, threshold: f64| {
        let density: Vec<f64> =
            (0..mesh.elements.len()).map(|e| f64::from(u8::from(solid(mesh.centroid(e))))).collect();
        let options = ExportOptions { threshold: Some(threshold), smoothing: 0, ..ExportOptions::default() };
        let surface = design_surface(&mesh, &density, &options).expect("a surface").surface;
        let (points, triangles) = (surface.points.len() as i64, surface.triangles.len() as i64);
        (points - triangles / 2, surface.volume())
    };
    // a floor with a wall across it, and a block with a slot across it
    let wall = |[x, y, _]: [f64; 3]| y < 1.0 || (4.0..5.0).contains(&x);
    let slot = |[x, y, _]: [f64; 3]| y < 1.0 || !(4.0..5.0).contains(&x);
    for threshold in [0.45, 0.55, 0.7] {
        let (euler, volume) = of(&wall, threshold);
        assert_eq!(euler, 2, "wall at {threshold}");
        assert!((volume / 70.0 - 1.0).abs() < 0.2, "wall at {threshold}: {volume}");
    }
    // three fins and two gaps of one element on a floor
    let comb = |[x, y, _]: [f64; 3]| y < 1.0 || [2, 4, 6].contains(&(x as usize));
    for threshold in [0.3, 0.45, 0.55, 0.7] {
        let (euler, volume) = of(&comb, threshold);
        assert_eq!(euler, 2, "comb at {threshold}");
        assert!((volume / 120.0 - 1.0).abs() < 0.3, "comb at {threshold}: {volume}");
    }
    for threshold in [0.55, 0.45, 0.3] {
        let (euler, volume) = of(&slot, threshold);
        assert_eq!(euler, 2, "slot at {threshold}");
        assert!((volume / 245.0 - 1.0).abs() < 0.2, "slot at {threshold}: {volume}");
    }
}

/// A dent that leaves 0.01 of a slab of 0.3, by hand: under one facet, it is less than half the face of an
/// element (two edges of triangles) and does not count; under four, it does. Its rim is too steep to be
/// opposite to the other face.
#[test]
fn a_sliver_is_no_thin_member() {
    let shape = BoxShape { min: [0.0; 3], max: [4.0, 0.3, 2.0], elements: [8, 1, 4], grading: [1.0; 3] };
    for (end, expected) in [(1.0, 0.3), (1.5, 0.01)] {
        let mut mesh = box_mesh("slab", &shape).expect("a box");
        let inside = |x: f64, from: f64, end: f64| (from - 1e-9..end + 1e-9).contains(&x);
        for [x, y, z] in &mut mesh.nodes {
            if *y == 0.0 && inside(*x, 1.5, end + 1.0) && inside(*z, 0.5, end) {
                *y = 0.29;
            }
        }
        for mesh in [mesh.clone(), turned(mesh)] {
            let member = measure(&whole(&mesh), &[]).member.expect("opposite faces");
            assert!((member.length / expected - 1.0).abs() < 1e-9, "{member:?}, not {expected}");
        }
    }
}

/// Two blocks joined by a web have the gap between them; the web is the thinnest member. A symmetry
/// plane through the middle of the gap leaves one of the blocks, which sees its mirror image.
#[test]
fn a_slot_is_as_wide_as_it_is() {
    let shape = BoxShape { min: [0.0; 3], max: [5.0, 3.0, 2.0], elements: [20, 12, 8], grading: [1.0; 3] };
    let mesh = box_mesh("u", &shape).expect("a box");
    let slotted = cut(&mesh, |[x, y, _]| !((2.0..3.0).contains(&x) && y > 0.5));
    for mesh in [slotted.clone(), turned(slotted)] {
        let found = measure(&whole(&mesh), &[]);
        let (member, gap) = (found.member.expect("a web"), found.gap.expect("a slot"));
        assert!((member.length / 0.5 - 1.0).abs() < 1e-12, "{member:?}");
        assert!((gap.length - 1.0).abs() < 1e-12, "{gap:?}");
    }
    let surface = whole(&cut(&mesh, |[x, y, _]| x < 2.0 && y < 1.5));
    assert_eq!(measure(&surface, &[]).gap, None);
    let gap = measure(&surface, &[(0, 2.3)]).gap.expect("the mirror image");
    assert!((gap.length - 0.6).abs() < 1e-12 && (gap.at[0] - 2.3).abs() < 1e-12, "{gap:?}");
    // a symmetry plane on a face doubles the block there
    let across = |planes: &[MirrorPlane]| measure(&surface, planes).member.expect("a block").length;
    assert!((across(&[]) - 1.5).abs() < 1e-12 && (across(&[(1, 0.0)]) - 2.0).abs() < 1e-12);
}

/// The wall of a tube, and its hole as a gap. Its faces are polygons of 96 sides: distances are too
/// small by at most a fifth of a side.
#[test]
fn a_tube_is_as_thick_as_its_wall() {
    let shape = HollowCylinderShape { inner_radius: 0.7, outer_radius: 1.0, height: 2.0, elements: [2, 96, 8] };
    let mesh = hollow_cylinder("tube", &shape).expect("a tube");
    let outer = 2.0 * (std::f64::consts::PI / 96.0).sin();
    for mesh in [mesh.clone(), turned(mesh)] {
        let found = measure(&whole(&mesh), &[]);
        let (wall, hole) = (found.member.expect("a wall"), found.gap.expect("a hole"));
        assert!((0.3 - 0.2 * outer..0.3 + 1e-9).contains(&wall.length), "{wall:?}");
        assert!((1.4 - 0.2 * 0.7 * outer..1.4 + 1e-9).contains(&hole.length), "{hole:?}");
    }
}

/// Members of grey designs, by hand. A plate whose density falls across it encloses as much as its densities
/// represent, so its thickness is their sum over the rows. A web whose density falls from 1 to 0 over two rows,
/// antisymmetric about its faces, as after a filter, is as thick as between these faces at the threshold 1/2,
/// aligned with the grid or not.
#[test]
fn grey_members_are_as_thick_as_their_densities_represent() {
    let shape = BoxShape { min: [0.0; 3], max: [6.0, 3.0, 2.0], elements: [24, 12, 8], grading: [1.0; 3] };
    let mesh = box_mesh("grey", &shape).expect("a box");
    let thickness = |density: &dyn Fn([f64; 3]) -> f64, threshold: Option<f64>| {
        let density: Vec<f64> = (0..mesh.elements.len()).map(|e| density(mesh.centroid(e))).collect();
        let options = ExportOptions { threshold, ..ExportOptions::default() };
        let surface = design_surface(&mesh, &density, &options).expect("a surface").surface;
        measure(&crate::part::regular_surface(&mesh, &surface), &[]).member.expect("opposite faces")
    };
    // rows of 0.25
    let rows = [0.0, 0.0, 0.1, 0.35, 0.8, 1.0, 1.0, 0.9, 0.5, 0.2, 0.0, 0.0];
    let plate = thickness(&|[_, y, _]| rows[(y / 0.25) as usize], None);
    let expected = 0.25 * rows.iter().sum::<f64>();
    assert!((plate.length / expected - 1.0).abs() < 5e-3, "{plate:?}, not {expected}");
    for half in [0.5, 0.57] {
        let web = |[x, y, _]: [f64; 3]| match (x - 3.0).abs() < 1.0 {
            true => ((half - (y - 1.5).abs()) / 0.5 + 0.5).clamp(0.0, 1.0),
            false => 1.0,
        };
        let found = thickness(&web, Some(0.5));
        assert!((found.length / (2.0 * half) - 1.0).abs() < 0.02, "{found:?}, not {}", 2.0 * half);
        assert!((found.at[0] - 3.0).abs() < 1.0 && (found.at[1] - 1.5).abs() < 0.05, "{found:?}");
    }
}

/// Faces of an edge are not opposite unless it is sharper than 20°: a wedge of 40° has the
/// thickness between its other faces, one of 15° goes to zero.
#[test]
fn edges_are_no_thin_members() {
    let wedge = |degrees: f64| {
        let mut mesh = block([12, 12, 6]);
        let slope = f64::to_radians(0.5 * degrees).tan();
        // the face at x = 0 becomes an edge, the height grows along x
        for node in &mut mesh.nodes {
            *node = [node[0] + 0.05, (node[1] - 6.0) / 6.0 * (node[0] + 0.05) * slope, node[2]];
        }
        measure(&whole(&mesh), &[]).member.expect("the ends at z").length
    };
    assert!((wedge(40.0) - 6.0).abs() < 1e-9, "{}", wedge(40.0));
    assert!(wedge(15.0) < 0.2, "{}", wedge(15.0));
}

/// Area in which a closed surface crosses the plane at `x`: half the sum of p × q over the edges of the
/// section.
fn section(surface: &TriangleSurface, x: f64) -> f64 {
    let mut sum = 0.0;
    for t in &surface.triangles {
        let corners = t.map(|n| surface.points[n as usize]);
        let cut = |k: usize| {
            let (p, q) = (corners[k], corners[(k + 1) % 3]);
            ((p[0] < x) != (q[0] < x)).then(|| {
                let along = (x - p[0]) / (q[0] - p[0]);
                (q[0] > p[0], [p[1] + along * (q[1] - p[1]), p[2] + along * (q[2] - p[2])])
            })
        };
        let cuts: Vec<(bool, [f64; 2])> = (0..3).filter_map(cut).collect();
        let [(first, p), (_, q)] = cuts[..] else { continue };
        let area = 0.5 * (p[0] * q[1] - p[1] * q[0]);
        sum += if first { area } else { -area };
    }
    sum.abs()
}

/// A rod of 1 × 1 between two blocks keeps its sections when it is smoothed, of tetrahedra and of hexahedra.
#[test]
fn smoothing_keeps_the_sections_of_members() {
    let shape = BoxShape { min: [0.0; 3], max: [12.0, 3.0, 3.0], elements: [24, 6, 6], grading: [1.0; 3] };
    let hexahedra = box_mesh("block", &shape).expect("a box");
    let tetrahedra = hexahedra.divided(|_| true);
    for (mesh, smoothing, bound) in [(&tetrahedra, 10, 0.01), (&tetrahedra, 40, 0.01), (&hexahedra, 10, 0.05)] {
        let middle = |c: f64| (1.0..2.0).contains(&c);
        let inside = |[x, y, z]: [f64; 3]| !(3.0..9.0).contains(&x) || (middle(y) && middle(z));
        let density: Vec<f64> = mesh.centroids().into_iter().map(|x| f64::from(u8::from(inside(x)))).collect();
        let surface = |smoothing| {
            let options = ExportOptions { threshold: Some(0.5), smoothing, ..Default::default() };
            design_surface(mesh, &density, &options).expect("a surface").surface
        };
        let (raw, smooth) = (surface(0), surface(smoothing));
        for x in [5.1, 6.05, 6.9] {
            let (before, after) = (section(&raw, x), section(&smooth, x));
            assert!((after / before - 1.0).abs() < bound, "{after} of {before} at x = {x}");
        }
    }
}

//! Checks that patches stay what they are, and that triangles become regular.

use std::collections::HashMap;

use super::*;
use slipstick_mesh::{BoxShape, box_mesh};

use crate::export::{ExportOptions, FaceLabels, labelled_surface};

/// The faces of a block as six patches with numbers 1 to 6.
fn block(size: [f64; 3], elements: [usize; 3]) -> PatchedSurface {
    let mesh = box_mesh("block", &BoxShape { min: [0.0; 3], max: size, elements, grading: [1.0; 3] }).expect("a box");
    let mut labels = FaceLabels::default();
    for (number, surface) in (1..).zip(mesh.surfaces.values()) {
        labels.extend(surface.facets.iter().map(|facet| (facet.nodes.sorted(), number)));
    }
    let density = vec![1.0; mesh.elements.len()];
    let options = ExportOptions { threshold: Some(0.5), ..ExportOptions::default() };
    let surface = labelled_surface(&mesh, &density, &options, &labels).expect("a surface").surface;
    PatchedSurface { points: surface.points, triangles: surface.triangles, patch: surface.labels }
}

fn open_edges(surface: &PatchedSurface) -> usize {
    let mut directed: HashMap<(u32, u32), u32> = HashMap::new();
    for t in &surface.triangles {
        (0..3).for_each(|k| *directed.entry((t[k], t[(k + 1) % 3])).or_default() += 1);
    }
    directed.iter().filter(|((a, b), count)| **count != 1 || directed.get(&(*b, *a)) != Some(&1)).count()
}

/// A block keeps its volume, its six faces with their areas and its corners, whether the mesh
/// becomes finer or coarser; no triangle is worse than half a square (√3/2), as at the start.
#[test]
fn a_block_keeps_its_faces() {
    let size = [3.0, 1.0, 2.0];
    let surface = block(size, [6, 2, 4]);
    for edge in [0.12, 0.3] {
        let fine = remeshed(&surface, &Lengths::Uniform(edge), |_| false, |_| false, |x, _| Some(x));
        assert_eq!(open_edges(&fine), 0);
        assert!((fine.volume() / 6.0 - 1.0).abs() < 1e-12, "{}", fine.volume());
        let mut areas: BTreeMap<u32, f64> = BTreeMap::new();
        for (t, &patch) in fine.patch.iter().enumerate() {
            let twice = area(fine.corners(t));
            *areas.entry(patch).or_default() += 0.5 * norm(twice);
            // exactly in the plane of its face
            let along = twice.iter().filter(|c| **c != 0.0).count();
            assert_eq!(along, 1, "{twice:?}");
        }
        let mut found: Vec<f64> = areas.into_values().collect();
        found.sort_by(f64::total_cmp);
        for (found, expected) in found.iter().zip([2.0, 2.0, 3.0, 3.0, 6.0, 6.0]) {
            assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
        }
        for corner in 0..8 {
            let x = std::array::from_fn(|c| if corner >> c & 1 == 1 { size[c] } else { 0.0 });
            assert!(fine.points.contains(&x), "{x:?}");
        }
        let quality: Vec<f64> = (0..fine.triangles.len()).map(|t| shape(fine.corners(t)).1).collect();
        let worst = quality.iter().copied().fold(1.0, f64::min);
        let mean = quality.iter().sum::<f64>() / quality.len() as f64;
        assert!(worst > 0.5 && mean > 0.86, "worst {worst}, mean {mean} at {edge}");
        let ideal = 22.0 / (0.25 * 3f64.sqrt() * edge * edge);
        assert!((0.7..1.6).contains(&(quality.len() as f64 / ideal)), "{} of {ideal}", quality.len());
    }
}

/// A ball stays round, with the volume of its triangles, and a border around it stays in its plane.
#[test]
fn a_ball_stays_round() {
    let mut surface = block([2.0; 3], [10; 3]);
    for point in &mut surface.points {
        let centred = point.map(|c| c - 1.0);
        *point = unit(centred);
    }
    surface.patch = (0..surface.triangles.len())
        .map(|t| if surface.corners(t).iter().map(|p| p[1]).sum::<f64>() > 0.0 { 1 } else { 2 })
        .collect();
    let fine = remeshed(&surface, &Lengths::Uniform(0.15), |_| true, |_| false, |x, _| Some(x));
    assert_eq!(open_edges(&fine), 0);
    // points on chords: each edge of length h lies up to h²/8 below the sphere
    let ratio = fine.volume() / surface.volume();
    assert!((1.0 - 3.0 * 0.15 * 0.15 / 8.0..1.0).contains(&ratio), "{ratio}");
    for point in &fine.points {
        assert!((norm(*point) - 1.0).abs() < 0.01, "{point:?}");
    }
    let worst = (0..fine.triangles.len()).map(|t| shape(fine.corners(t)).1).fold(1.0, f64::min);
    assert!(worst > 0.4, "{worst}");
    let on_border = |a: u32, b: u32| fine.points[a as usize][1].abs().max(fine.points[b as usize][1].abs());
    assert!(borders(&fine).keys().all(|&[a, b]| on_border(a, b) < 0.2));
}

/// Without a given length, edges follow the elements: a block whose elements are eight times as long at one end gets
/// short edges at the other end only, and faces and volume stay.
#[test]
fn edges_follow_the_elements() {
    let (elements, grading) = ([10, 4, 4], [8.0, 1.0, 1.0]);
    let shape_of = BoxShape { min: [0.0; 3], max: [2.0, 1.0, 1.0], elements, grading };
    let mesh = box_mesh("block", &shape_of).expect("a box");
    let lengths = Lengths::of_elements(&mesh, 0);
    // sizes grow by 8^(1/9) from element to element: the first is 2 (q − 1)/(q^10 − 1)
    let ratio = 8f64.powf(1.0 / 9.0);
    let first = 2.0 * (ratio - 1.0) / (ratio.powi(10) - 1.0);
    let (short, long) = (lengths.at([0.0; 3]), lengths.at([2.0, 0.5, 0.5]));
    assert!((first..1.5 * first).contains(&short), "{short} {first}");
    assert!((long / 0.25 - 1.0).abs() < 0.05, "{long}");
    let surface = block([2.0, 1.0, 1.0], elements);
    let fine = remeshed(&surface, &lengths, |_| false, |_| false, |x, _| Some(x));
    assert_eq!((open_edges(&fine), fine.crossings()), (0, 0));
    assert!((fine.volume() / 2.0 - 1.0).abs() < 1e-12, "{}", fine.volume());
    let mean_edge = |inside: &dyn Fn(f64) -> bool| {
        let (mut sum, mut count) = (0.0, 0.0);
        for corners in (0..fine.triangles.len()).map(|t| fine.corners(t)).filter(|c| c.iter().all(|p| inside(p[0]))) {
            (0..3).for_each(|k| sum += norm(subtract(corners[(k + 1) % 3], corners[k])));
            count += 3.0;
        }
        sum / count
    };
    let ends = [mean_edge(&|x| x < 0.3), mean_edge(&|x| x > 1.5)];
    assert!((ends[0] / short - 1.0).abs() < 0.25 && (ends[1] / long - 1.0).abs() < 0.25, "{ends:?} {short} {long}");
    let everywhere_short = remeshed(&surface, &Lengths::Uniform(short), |_| false, |_| false, |x, _| Some(x));
    assert!(2 * fine.triangles.len() < everywhere_short.triangles.len(), "{}", fine.triangles.len());
    // the estimate of tetrahedra: volume over that of a regular one, where lengths are the same
    let all: Vec<usize> = (0..mesh.elements.len()).collect();
    let one = 0.25f64.powi(3) * 2f64.sqrt() / 12.0;
    assert!((Lengths::Uniform(0.25).tetrahedra(&mesh, &all) * one - 1.0).abs() < 1e-12);
    // between those of the longest and of the shortest edges everywhere
    let [shortest, longest] = lengths.range();
    let estimate = lengths.tetrahedra(&mesh, &all);
    let of_length = |length: f64| 2f64.sqrt() * 6.0 / length.powi(3);
    assert!((of_length(longest)..of_length(shortest)).contains(&estimate), "{estimate} {shortest} {longest}");
}

/// Random densities give surfaces with members, slots and skins thinner than the edges: without a check
/// of each change, hundreds of pairs of triangles would cross.
#[test]
fn remeshed_surfaces_do_not_cross_themselves() {
    let shape = BoxShape { min: [0.0; 3], max: [4.0, 3.0, 2.0], elements: [8, 6, 4], grading: [1.0; 3] };
    let whole = box_mesh("block", &shape).expect("a box");
    for (mesh, seed) in [(whole.clone(), 1u64), (whole.divided(|_| true), 2)] {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let density: Vec<f64> = mesh.elements.iter().map(|_| next()).collect();
        let options = ExportOptions { threshold: Some(0.5), ..ExportOptions::default() };
        let surface = labelled_surface(&mesh, &density, &options, &FaceLabels::default()).expect("a surface").surface;
        let patch = surface.outer.iter().map(|&outer| u32::from(outer)).collect();
        let surface = PatchedSurface { points: surface.points, triangles: surface.triangles, patch };
        assert_eq!(surface.crossings(), 0);
        for edge in [0.25, 0.6] {
            let fine = remeshed(&surface, &Lengths::Uniform(edge), |patch| patch == 0, |_| false, |x, _| Some(x));
            assert_eq!((fine.crossings(), open_edges(&fine)), (0, 0), "{edge}");
            assert!(fine.triangles.len() > 300, "{}", fine.triangles.len());
        }
    }
}

/// Each pass is the same from run to run.
#[test]
fn results_are_reproducible() {
    let surface = block([2.0, 1.0, 1.0], [4, 2, 2]);
    let (elements, grading) = ([8, 4, 4], [4.0, 1.0, 1.0]);
    let shape = BoxShape { min: [0.0; 3], max: [2.0, 1.0, 1.0], elements, grading };
    let mesh = box_mesh("block", &shape).expect("a box");
    let lengths = || [Lengths::Uniform(0.2), Lengths::of_elements(&mesh, 0)];
    for (one, other) in lengths().iter().zip(&lengths()) {
        assert_eq!(
            remeshed(&surface, one, |_| false, |_| false, |x, _| Some(x)),
            remeshed(&surface, other, |_| false, |_| false, |x, _| Some(x))
        );
    }
}

/// The rim of material on a face, a convex and a concave arc by hand: a quarter disc of radius 1 at a corner of a
/// block's face, and the face without it, keep their areas when the edges become five times as long.
#[test]
fn faces_keep_their_areas_where_the_rim_of_the_material_is_curved() {
    let shape = BoxShape { min: [0.0; 3], max: [3.0, 1.0, 3.0], elements: [36, 12, 36], grading: [1.0; 3] };
    let mesh = box_mesh("block", &shape).expect("a box");
    let mut labels = FaceLabels::default();
    for (number, surface) in (1..).zip(mesh.surfaces.values()) {
        labels.extend(surface.facets.iter().map(|facet| (facet.nodes.sorted(), number)));
    }
    let on_top = |surface: &PatchedSurface| {
        let top = (0..surface.triangles.len()).filter(|&t| surface.corners(t).iter().all(|x| x[1] == 1.0));
        top.map(|t| 0.5 * norm(area(surface.corners(t)))).sum::<f64>()
    };
    for convex in [true, false] {
        let near = |[x, _, z]: [f64; 3]| x.hypot(z) < 1.0;
        let density: Vec<f64> = mesh.centroids().into_iter().map(|x| f64::from(u8::from(near(x) == convex))).collect();
        let options = ExportOptions { threshold: Some(0.5), ..ExportOptions::default() };
        let surface = labelled_surface(&mesh, &density, &options, &labels).expect("a surface").surface;
        let patch = surface.labels.clone();
        let surface = PatchedSurface { points: surface.points, triangles: surface.triangles, patch };
        let coarse = remeshed(&surface, &Lengths::Uniform(0.45), |patch| patch == 0, |_| false, |x, _| Some(x));
        let (before, after) = (on_top(&surface), on_top(&coarse));
        assert!((after / before - 1.0).abs() < 2e-3, "{after} of {before}");
        assert_eq!((coarse.crossings(), open_edges(&coarse)), (0, 0));
        // points that would leave the faces of the design domain stay
        let held = remeshed(&surface, &Lengths::Uniform(0.45), |patch| patch == 0, |_| false, |_, _| None);
        let [missing, left] = [&held, &coarse].map(|surface| (on_top(surface) - before).abs());
        assert!(missing > 2.0 * left, "{missing} without moves, {left} with them");
    }
}

/// The round border between two faces in one plane stays: a polygon of 24 corners keeps them and its area,
/// n/2 r² sin(2π/n), although the triangles become larger than its edges.
#[test]
fn round_borders_within_a_plane_stay() {
    const N: u32 = 24;
    let ring = |radius: f64, y: f64| {
        (0..N).map(move |k| {
            let angle = f64::from(k) * std::f64::consts::TAU / f64::from(N);
            [radius * angle.cos(), y, -radius * angle.sin()]
        })
    };
    let points: Vec<[f64; 3]> = [[0.0, 1.0, 0.0], [0.0; 3]]
        .into_iter()
        .chain(ring(1.0, 1.0))
        .chain(ring(2.0, 1.0))
        .chain(ring(2.0, 0.0))
        .collect();
    let [inner, outer, below] = [2, 2 + N, 2 + 2 * N];
    let (mut triangles, mut patch) = (Vec::new(), Vec::new());
    for k in 0..N {
        let next = (k + 1) % N;
        let quad = |low: u32, high: u32| [[low + k, high + k, high + next], [low + k, high + next, low + next]];
        triangles.push([0, inner + k, inner + next]);
        triangles.extend(quad(inner, outer));
        triangles.extend(quad(outer, below));
        triangles.push([1, below + next, below + k]);
        patch.extend([0, 1, 1, 2, 2, 3]);
    }
    let surface = PatchedSurface { points, triangles, patch };
    assert!(surface.volume() > 0.0);
    let fine = remeshed(&surface, &Lengths::Uniform(0.4), |_| false, |_| false, |x, _| Some(x));
    let own = (0..fine.triangles.len()).filter(|&t| fine.patch[t] == 0);
    let area: f64 = own.map(|t| 0.5 * norm(area(fine.corners(t)))).sum();
    let n = f64::from(N);
    let exact = 0.5 * n * (std::f64::consts::TAU / n).sin();
    assert!((area / exact - 1.0).abs() < 1e-12, "{area} instead of {exact}");
    assert!(ring(1.0, 1.0).all(|corner| fine.points.contains(&corner)));
    assert_eq!(fine.crossings(), 0);
}

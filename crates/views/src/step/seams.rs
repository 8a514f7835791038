//! Divides faces that close around an axis, a tube or a pole, and places the seams of surfaces beside their faces.

use std::collections::{BTreeSet, VecDeque};
use std::f64::consts::{PI, TAU};

use super::facets::Facets;
use super::surface::{Surface, V, across};

/// Smallest angle about its axis, or about the tube of its torus, that a face leaves open for the seam.
const GAP: f64 = PI / 6.0;

/// Smallest angle between a face and a pole of its sphere.
const TO_POLE: f64 = PI / 12.0;

/// Most divisions of the faces of a solid.
const DIVISIONS: usize = 1000;

/// Directions that are tried.
const TRIED: usize = 72;

/// Where the parameters of a surface start: its axis, and the direction of its seam.
pub(super) type Frame = Option<[V; 2]>;

/// Divides regions that surround their axis or the tube of their torus, or from which no pole is far enough; returns the frame of each region,
/// none for planes.
pub(super) fn seams(facets: &mut Facets) -> Vec<Frame> {
    let curved = |region: &usize| !matches!(facets.regions[*region].surface, Surface::Plane { .. });
    let mut open: VecDeque<usize> = (0..facets.regions.len()).filter(curved).collect();
    let mut frames: Vec<Frame> = vec![None; facets.regions.len()];
    let most = facets.regions.len() + DIVISIONS;
    while let Some(region) = open.pop_front() {
        let points = points(facets, region);
        let (through, found) = match facets.regions[region].surface {
            Surface::Plane { .. } | Surface::Bilinear { .. } => continue,
            Surface::Cone { point, axis, .. } => {
                let seam = seam(&points, &point, &axis);
                (point, seam.map(|seam| [axis, seam]).ok_or((axis, clear(&points, &point, &axis))))
            }
            Surface::Torus { centre, axis, radius, .. } => {
                let found = match (open_tube(&points, (&centre, &axis), radius), seam(&points, &centre, &axis)) {
                    (_, None) => Err((axis, clear(&points, &centre, &axis))),
                    (false, _) => Err((axis, axis)),
                    (true, Some(seam)) => Ok([axis, seam]),
                };
                (centre, found)
            }
            Surface::Sphere { centre, .. } => {
                let found = poles(&points, &centre);
                (centre, found.map_err(|axis| (axis, clear(&points, &centre, &axis))))
            }
        };
        match found {
            Ok(frame) => frames[region] = Some(frame),
            Err((_, normal)) if frames.len() < most && facets.divide(region, &through, &normal) => {
                frames.push(None);
                open.extend([region, facets.regions.len() - 1]);
            }
            // too few points to divide it
            Err((axis, _)) => frames[region] = Some([axis, across(&axis)]),
        }
    }
    frames
}

fn points(facets: &Facets, region: usize) -> Vec<V> {
    let own = (0..facets.triangles.len()).filter(|&t| facets.region[t] == Some(region));
    let numbers: BTreeSet<u32> = own.flat_map(|t| facets.triangles[t]).collect();
    numbers.into_iter().map(|n| facets.points[n as usize]).collect()
}

/// The middle of the largest angle about an axis without points; `None` if there is no large one.
fn seam(points: &[V], through: &V, axis: &V) -> Option<V> {
    let first = across(axis);
    let second = axis.cross(&first);
    let angles = points.iter().map(|x| (x - through).dot(&second).atan2((x - through).dot(&first)));
    let middle = open(angles.collect())?;
    Some(first * middle.cos() + second * middle.sin())
}

/// Whether points leave a large angle about the tube of a torus open.
fn open_tube(points: &[V], (centre, axis): (&V, &V), radius: f64) -> bool {
    let angle = |x: &V| {
        let along = (x - centre).dot(axis);
        along.atan2((x - centre - axis * along).norm() - radius)
    };
    open(points.iter().map(angle).collect()).is_some()
}

/// The middle of the largest gap between angles; `None` if there is no large one.
fn open(mut angles: Vec<f64>) -> Option<f64> {
    angles.sort_by(f64::total_cmp);
    let start = *angles.first()?;
    angles.push(start + TAU);
    let gap = |pair: &[f64]| pair[1] - pair[0];
    let widest = angles.windows(2).max_by(|a, b| gap(a).total_cmp(&gap(b)))?;
    (gap(widest) > GAP).then_some((widest[0] + widest[1]) / 2.0)
}

/// The axis of a sphere, both of whose poles are farthest from a face, and its seam; an axis about which to divide the
/// face if the poles are too close.
fn poles(points: &[V], centre: &V) -> Result<[V; 2], V> {
    let out: Vec<V> = points.iter().map(|x| (x - centre).normalize()).collect();
    let nearest = |axis: &V| out.iter().map(|n| n.dot(axis).abs().min(1.0).acos()).fold(f64::INFINITY, f64::min);
    // the spiral of Fibonacci on a hemisphere
    let direction = |k: usize| {
        let (height, turn) = ((k as f64 + 0.5) / TRIED as f64, k as f64 * PI * (3.0 - 5f64.sqrt()));
        let from = (1.0 - height * height).sqrt();
        V::new(from * turn.cos(), from * turn.sin(), height)
    };
    let tried = (0..3).map(|c| V::ith(c, 1.0)).chain((0..TRIED).map(direction));
    let suited = tried.filter_map(|axis| Some((nearest(&axis), [axis, seam(points, centre, &axis)?])));
    match suited.max_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((angle, frame)) if angle > TO_POLE => Ok(frame),
        _ => Err(out.iter().sum::<V>().try_normalize(1e-3 * out.len() as f64).unwrap_or_else(V::x)),
    }
}

/// The normal of the plane through an axis that stays farthest from the points.
fn clear(points: &[V], through: &V, axis: &V) -> V {
    let first = across(axis);
    let second = axis.cross(&first);
    let clearance = |normal: &V| {
        let from = |x: &V| {
            let arm = x - through;
            arm.dot(normal).abs() / (arm - axis * arm.dot(axis)).norm().max(f64::MIN_POSITIVE)
        };
        points.iter().map(from).fold(f64::INFINITY, f64::min)
    };
    let normal = |k: usize| {
        let angle = PI * (k as f64 + 0.37) / (5 * TRIED) as f64;
        first * angle.cos() + second * angle.sin()
    };
    let best = (0..5 * TRIED).map(normal).max_by(|a, b| clearance(a).total_cmp(&clearance(b)));
    best.unwrap_or(first)
}

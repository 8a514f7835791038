//! Gives back the material that smoothing takes from thin members, or adds to them.
//!
//! A ring of six points around a member is a ripple for the filter of the smoothing: ten passes would make
//! the member 40 % thinner, while the volume of the whole surface is kept. The normal displacement of a
//! ripple is zero in the mean over a few points, that of a member that shrinks is not. So the mean is
//! taken back.

use super::surface::TriangleSurface;
use super::walls::{Wall, stop};
use crate::vector::{area, dot, norm, subtract, unit};

/// Steps of averaging, each half way to the mean of the neighbours: ripples of up to four points fade
/// to below 4 %.
const AVERAGING: usize = 5;

/// How often the mean is taken back: normals turn and points are stopped.
const TIMES: usize = 3;

/// Smallest share of the inner normal in the plane of an outer face for points that move in it.
const SLANT: f64 = 0.3;

/// Moves the points of a smoothed surface so that its material is where it was `before`, in the mean over
/// a few points. Points without `neighbours` stay; with `keep_outer`, those on outer faces move within them.
pub(super) fn restore(
    surface: &mut TriangleSurface,
    before: &[[f64; 3]],
    neighbours: &[Vec<u32>],
    walls: &[Vec<Wall>],
    keep_outer: bool,
) {
    let count = surface.points.len();
    let kept: Vec<bool> = surface.outer.iter().map(|&outer| outer && keep_outer).collect();
    let mut around: Vec<Vec<u32>> = vec![Vec::new(); count];
    for (triangle, _) in surface.triangles.iter().zip(&kept).filter(|(_, kept)| !**kept) {
        for k in 0..3 {
            around[triangle[k] as usize].push(triangle[(k + 1) % 3]);
            around[triangle[k] as usize].push(triangle[(k + 2) % 3]);
        }
    }
    // the normals of outer faces, which moves within them keep
    let mut plane = vec![[0.0; 3]; count];
    for (triangle, _) in surface.triangles.iter().zip(&kept).filter(|(_, kept)| **kept) {
        let area = area(triangle.map(|n| before[n as usize]));
        triangle.iter().for_each(|&n| (0..3).for_each(|c| plane[n as usize][c] += area[c]));
    }
    for _ in 0..TIMES {
        // normals and areas of the inner triangles at each point
        let mut inner = vec![[0.0; 3]; count];
        for (t, triangle) in surface.triangles.iter().enumerate().filter(|(t, _)| !kept[*t]) {
            let area = surface.area_vector(t);
            triangle.iter().for_each(|&n| (0..3).for_each(|c| inner[n as usize][c] += area[c]));
        }
        let normal: Vec<[f64; 3]> = inner.iter().map(|&v| unit(v)).collect();
        let weight: Vec<f64> = inner.iter().map(|&v| norm(v)).collect();
        let mut shift: Vec<f64> = (0..count).map(|n| dot(subtract(surface.points[n], before[n]), normal[n])).collect();
        for _ in 0..AVERAGING {
            let mean = |n: usize| {
                let (mut sum, mut total) = (0.0, 0.0);
                for &m in &around[n] {
                    sum += weight[m as usize] * shift[m as usize];
                    total += weight[m as usize];
                }
                if total > 0.0 { 0.5 * (shift[n] + sum / total) } else { 0.0 }
            };
            shift = (0..count).map(mean).collect();
        }
        for n in (0..count).filter(|&n| !neighbours[n].is_empty() && weight[n] > 0.0) {
            let mut way = normal[n];
            if norm(plane[n]) > 0.0 {
                // within its outer face
                let face = unit(plane[n]);
                let off = dot(way, face);
                way = std::array::from_fn(|c| way[c] - off * face[c]);
                let slant = dot(way, way).max(SLANT * SLANT);
                way = way.map(|w| w / slant);
            }
            (0..3).for_each(|c| surface.points[n][c] -= shift[n] * way[c]);
            stop(&mut surface.points[n], &walls[n]);
        }
    }
}

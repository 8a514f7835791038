//! Facets in pairs: two triangles beside each other become one bilinear face.

use std::collections::HashMap;

use super::facets::Facets;
use super::surface::{Surface, V};

/// Cosine of the largest angle between two triangles of a face (32°).
const BENT: f64 = 0.85;

/// Smallest sine of the angle at a corner of a face.
const SHARP: f64 = 0.1;

/// Largest distance between the middles of the diagonals of a face, relative to its shortest side; the face is at most
/// a quarter of that from its triangles.
const TWISTED: f64 = 0.3;

/// The other triangle of each facet's face, and the corners of that face, counter-clockwise seen from outside, under the smaller
/// number of its two triangles. All sides of a face are straight: a facet beside a curved surface stays alone.
pub(super) fn pairs(facets: &Facets) -> HashMap<usize, (usize, [V; 4])> {
    let straight = |t: usize| {
        facets.beside(t).iter().all(|&other| match facets.region[other] {
            Some(region) => matches!(facets.regions[region].surface, Surface::Plane { .. }),
            None => true,
        })
    };
    let alone: Vec<bool> = (0..facets.triangles.len()).map(|t| facets.region[t].is_none() && straight(t)).collect();
    let mut found: Vec<(f64, [usize; 2], [V; 4])> = Vec::new();
    for s in (0..alone.len()).filter(|&s| alone[s]) {
        for (k, t) in facets.beside(s).into_iter().enumerate() {
            if s < t
                && alone[t]
                && let Some((bad, corners)) = joined(facets, [s, t], k)
            {
                found.push((bad, [s, t], corners));
            }
        }
    }
    // those first that have the fewest others to pair with
    let mut choices = vec![0_u32; alone.len()];
    found.iter().flat_map(|(_, both, _)| both).for_each(|&t| choices[t] += 1);
    let fewest = |[s, t]: [usize; 2]| choices[s].min(choices[t]);
    found.sort_by(|a, b| fewest(a.1).cmp(&fewest(b.1)).then(a.0.total_cmp(&b.0)).then(a.1.cmp(&b.1)));
    let mut all = HashMap::new();
    for (_, [s, t], corners) in found {
        if !all.contains_key(&s) && !all.contains_key(&t) {
            all.insert(s, (t, corners));
            all.insert(t, (s, corners));
        }
    }
    all
}

/// The face of two triangles, of which the second lies beside the edge `k` of the first, and how far it is from a plane
/// rectangle; `None` if it is too bent or sharp.
fn joined(facets: &Facets, [s, t]: [usize; 2], k: usize) -> Option<(f64, [V; 4])> {
    let own = facets.triangles[s];
    let (from, to, apex) = (own[k], own[(k + 1) % 3], own[(k + 2) % 3]);
    let beyond = *facets.triangles[t].iter().find(|&&n| n != from && n != to)?;
    if beyond == apex {
        return None;
    }
    let corners = [apex, from, beyond, to].map(|n| facets.points[n as usize]);
    let (a, b) = (facets.area(s), facets.area(t));
    let bent = a.dot(&b) / (a.norm() * b.norm());
    let normal = (a + b).try_normalize(0.0)?;
    let side = |k: usize| corners[(k + 1) % 4] - corners[k];
    let shortest = (0..4).map(|k| side(k).norm()).fold(f64::INFINITY, f64::min);
    let twist = (corners[0] + corners[2] - corners[1] - corners[3]).dot(&normal).abs() / 2.0;
    let sine = |k: usize| side((k + 3) % 4).cross(&side(k)).dot(&normal) / (side((k + 3) % 4).norm() * side(k).norm());
    let least = (0..4).map(sine).fold(f64::INFINITY, f64::min);
    let suits = bent >= BENT && least >= SHARP && twist <= TWISTED * shortest;
    suits.then_some((1.0 - bent + 1.0 - least, corners))
}

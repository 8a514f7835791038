//! Division of points into compact parts: recursive coordinate bisection.

use super::vertices::Vertices;
use std::collections::BTreeMap;

/// Divides the points `ids` into parts with about the same number of unknowns, by planes normal to
/// the longest edge of the box around them. The result depends only on coordinates and weights.
///
/// Reference: Simon, Partitioning of unstructured problems for parallel processing, Comput. Syst.
/// Engrg. 2 (1991).
pub(super) fn bisect(
    mut ids: Vec<u32>,
    parts: usize,
    position: &(impl Fn(u32) -> [f64; 3] + Sync),
    weight: &(impl Fn(u32) -> usize + Sync),
) -> Vec<Vec<u32>> {
    if parts <= 1 || ids.len() <= 1 {
        return if ids.is_empty() { Vec::new() } else { vec![ids] };
    }
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for &id in &ids {
        for (k, x) in position(id).into_iter().enumerate() {
            low[k] = low[k].min(x);
            high[k] = high[k].max(x);
        }
    }
    // the first of equal edges
    let axis = (1..3).fold(0, |best, k| if high[k] - low[k] > high[best] - low[best] { k } else { best });
    ids.sort_unstable_by(|&a, &b| position(a)[axis].total_cmp(&position(b)[axis]).then(a.cmp(&b)));
    let total: usize = ids.iter().map(|&id| weight(id)).sum();
    let left = parts / 2;
    let (mut sum, mut at) = (0, 0);
    while at + 1 < ids.len() && (at == 0 || (sum + weight(ids[at]) / 2) * parts < total * left) {
        sum += weight(ids[at]);
        at += 1;
    }
    let rest = ids.split_off(at);
    let (mut first, second) =
        rayon::join(|| bisect(ids, left, position, weight), || bisect(rest, parts - left, position, weight));
    first.extend(second);
    first
}

/// Moves vertices within `layers` layers of those `at_contact` into the parts of those vertices. Layer
/// by layer, each joins the part that holds most of its placed neighbours; of several, the one with the
/// highest number. Empty parts are removed.
pub(super) fn keep_together(
    parts: &mut Vec<Vec<u32>>,
    vertices: &Vertices,
    layers: usize,
    at_contact: impl Fn(usize) -> bool,
) {
    let mut part = vec![0; vertices.len()];
    for (own, k) in parts.iter().zip(0_u32..) {
        own.iter().for_each(|&v| part[v as usize] = k);
    }
    let mut placed: Vec<bool> = (0..vertices.len()).map(at_contact).collect();
    for _ in 0..layers {
        let mut moved = Vec::new();
        for v in (0..vertices.len()).filter(|&v| !placed[v] && !vertices.is_long(v)) {
            let mut counts: BTreeMap<u32, usize> = BTreeMap::new();
            for &w in vertices.adjacent(v).iter().filter(|&&w| placed[w as usize]) {
                *counts.entry(part[w as usize]).or_default() += 1;
            }
            moved.extend(counts.into_iter().max_by_key(|&(_, count)| count).map(|(k, _)| (v, k)));
        }
        for (v, k) in moved {
            (placed[v], part[v]) = (true, k);
        }
    }
    parts.iter_mut().for_each(Vec::clear);
    part.iter().zip(0..).for_each(|(&k, v)| parts[k as usize].push(v));
    parts.retain(|own| !own.is_empty());
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::csr::CsrPattern;

    /// By definition: each point is in one part, the parts are as large as possible, and the parts
    /// of a bar are intervals.
    #[test]
    fn a_bar_is_cut_into_equal_pieces() {
        let position = |id: u32| [f64::from(id * 7 % 30), 0.1 * f64::from(id % 2), 0.0];
        let parts = bisect((0..30).collect(), 5, &position, &|_| 3);
        assert_eq!(parts.iter().map(Vec::len).collect::<Vec<_>>(), [6; 5]);
        for (k, part) in parts.iter().enumerate() {
            let mut along: Vec<u32> = part.iter().map(|id| id * 7 % 30).collect();
            along.sort_unstable();
            assert_eq!(along, (6 * k as u32..6 * k as u32 + 6).collect::<Vec<_>>());
        }
        assert!(bisect(Vec::new(), 3, &position, &|_| 1).is_empty());
    }

    /// By definition: of a chain that is cut next to the vertex at the contact, the next two vertices
    /// join its part, and a part of only these disappears.
    #[test]
    fn vertices_next_to_the_contact_join_its_part() {
        let rows: Vec<Vec<u32>> = (0..8_u32).map(|i| (i.saturating_sub(1)..(i + 2).min(8)).collect()).collect();
        let offsets = rows.iter().scan(0, |sum, row| {
            *sum += row.len();
            Some(*sum)
        });
        let offsets = std::iter::once(0).chain(offsets).collect();
        let pattern = CsrPattern::new(offsets, rows.concat(), (0..8).collect(), Vec::new()).unwrap();
        let vertices = Vertices::new(&pattern);
        let mut parts = vec![vec![0, 1, 2, 3], vec![4, 5], vec![6, 7]];
        keep_together(&mut parts, &vertices, 2, |v| v == 3);
        assert_eq!(parts, [vec![0, 1, 2, 3, 4, 5], vec![6, 7]]);
        keep_together(&mut parts, &vertices, 2, |_| false);
        assert_eq!(parts, [vec![0, 1, 2, 3, 4, 5], vec![6, 7]]);
    }
}

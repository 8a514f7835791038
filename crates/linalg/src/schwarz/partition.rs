//! Division of points into compact parts: recursive coordinate bisection.

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

#[cfg(test)]
mod tests {
    use super::*;

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
}

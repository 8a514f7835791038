//! Centroids of elements, their spacing, and the search for the one nearest to a point.

use rayon::prelude::*;

use crate::filter::CellGrid;

/// The centroids of a list of elements. \[L\]
#[derive(Clone, Debug)]
pub struct Places {
    points: Vec<[f64; 3]>,
    /// Distance of each centroid from the nearest other one, a measure of the element size;
    /// infinite if there is only one.
    spacing: Vec<f64>,
}

impl Places {
    /// Places at finite coordinates.
    pub fn new(points: Vec<[f64; 3]>) -> Self {
        let spacing = nearest(&points, &points, true).into_iter().map(|found| found.map_or(f64::INFINITY, |f| f.1));
        Self { spacing: spacing.collect(), points }
    }

    /// Number of elements.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there are no elements.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// The centroids.
    pub fn points(&self) -> &[[f64; 3]] {
        &self.points
    }

    /// Distance of each centroid from the nearest other one. \[L\]
    pub fn spacing(&self) -> &[f64] {
        &self.spacing
    }

    /// For each of these points, the element with the nearest centroid and the distance to it.
    pub fn nearest(&self, to: &[[f64; 3]]) -> Vec<(usize, f64)> {
        nearest(&self.points, to, false).into_iter().flatten().collect()
    }
}

/// For each of the places `to`, the nearest of the `points` (the first one if several are equally
/// near). With `others`, the two lists are the same, and a point is not compared with itself.
/// `None` if there is no point.
fn nearest(points: &[[f64; 3]], to: &[[f64; 3]], others: bool) -> Vec<Option<(usize, f64)>> {
    let mut found = vec![None; to.len()];
    let all = || points.iter().chain(to);
    let side = (0..3).map(|k| extent(all().map(|x| x[k]))).fold(0.0, f64::max);
    // the spacing of this many points evenly distributed in the bounding cube
    let mut radius = side / (points.len().max(1) as f64).cbrt() + f64::MIN_POSITIVE;
    let mut open: Vec<usize> = (0..to.len()).collect();
    while !open.is_empty() {
        let grid = CellGrid::new(points, radius);
        let search = |&query: &usize| {
            let near = grid.within(points, &to[query], radius).into_iter().map(|(at, weight)| (at as usize, weight));
            // the weight is the radius minus the distance
            near.filter(|(at, _)| !(others && *at == query))
                .reduce(|a, b| if b.1 > a.1 { b } else { a })
                .map(|(at, weight)| (at, radius - weight))
        };
        let results: Vec<_> = open.par_iter().map(search).collect();
        open.iter().zip(results).for_each(|(&query, result)| found[query] = result);
        if radius > 2.0 * side {
            break;
        }
        open.retain(|&query| found[query].is_none());
        radius *= 2.0;
    }
    found
}

fn extent(numbers: impl Iterator<Item = f64>) -> f64 {
    let (low, high) = numbers.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
    (high - low).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::tests::pseudo_random;

    #[test]
    fn nearest_of_all_pairs() {
        let numbers = pseudo_random(3 * 90, 1);
        let points: Vec<[f64; 3]> = numbers.chunks(3).map(|x| [x[0], 100.0 * x[1], 0.01 * x[2]]).collect();
        let distance = |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
        let places = Places::new(points[..60].to_vec());
        for (query, (at, found)) in points[60..].iter().zip(places.nearest(&points[60..])) {
            let expected = points[..60].iter().map(|x| distance(x, query)).fold(f64::INFINITY, f64::min);
            assert!((found - expected).abs() < 1e-12 && (distance(&points[at], query) - expected).abs() < 1e-12);
        }
        for (e, found) in places.spacing().iter().enumerate() {
            let others = (0..60).filter(|i| *i != e).map(|i| distance(&points[i], &points[e]));
            assert!((found - others.fold(f64::INFINITY, f64::min)).abs() < 1e-12);
        }
        assert_eq!(Places::new(vec![[1.0; 3]]).spacing(), [f64::INFINITY]);
        assert!(Places::new(Vec::new()).is_empty());
    }
}

//! Elements within the filter radius of each element, with conic weights.

use rayon::prelude::*;
use std::ops::Range;

use super::FilterError;

/// Squared distances of larger coordinates would overflow. \[L\]
const FARTHEST: f64 = 1e150;

/// For each element `e` the elements `i` with `w_ei = r − ‖X_e − X_i‖ > 0`, centroids `X`. \[L\]
///
/// Each element is its own neighbour, with weight `r`. Neighbours are in ascending order, and the
/// weights are symmetric to the last bit, so sums over them do not depend on the search algorithm.
#[derive(Clone, Debug)]
pub struct Neighbours {
    /// The element of the first list.
    first: usize,
    starts: Vec<usize>,
    elements: Vec<u32>,
    weights: Vec<f64>,
}

impl Neighbours {
    /// Finds all pairs closer than `radius` \[L\], with a grid of cells that are at least as large
    /// as the radius.
    ///
    /// # Errors
    ///
    /// A radius that is not positive and finite, a centroid that is not finite, more than 2³²
    /// elements.
    pub fn new(centroids: &[[f64; 3]], radius: f64) -> Result<Self, FilterError> {
        Self::mirrored(centroids, radius, &[])
    }

    /// The same with mirror images of the elements at symmetry planes, each given by its normal
    /// axis and its coordinate on that axis \[L\]: an element counts once for itself and once for
    /// each image within the radius. Weights of images are symmetric up to round-off.
    ///
    /// # Errors
    ///
    /// As [`new`](Self::new).
    pub fn mirrored(centroids: &[[f64; 3]], radius: f64, planes: &[(usize, f64)]) -> Result<Self, FilterError> {
        Self::of_some(centroids, radius, planes, 0..centroids.len())
    }

    /// Only the lists of a range of elements; neighbours may be outside the range.
    ///
    /// # Errors
    ///
    /// As [`new`](Self::new).
    ///
    /// # Panics
    ///
    /// If there are no such elements.
    pub fn of_some(
        centroids: &[[f64; 3]],
        radius: f64,
        planes: &[(usize, f64)],
        range: Range<usize>,
    ) -> Result<Self, FilterError> {
        if !(radius.is_finite() && radius > 0.0) {
            return Err(FilterError::Radius { radius });
        }
        if u32::try_from(centroids.len()).is_err() {
            return Err(FilterError::TooMany { elements: centroids.len() });
        }
        if let Some(element) = centroids.iter().position(|centroid| !centroid.iter().all(|x| x.abs() < FARTHEST)) {
            return Err(FilterError::Centroid { element });
        }
        let (places, owners) = with_images(centroids, radius, planes);
        let grid = CellGrid::new(&places, radius);
        let first = range.start;
        let centroids = &centroids[range];
        // Two passes, the first only for the lengths: the lists may be the largest data of a run
        // and must not be copied.
        let lengths = centroids.par_iter().map(|centroid| grid.within(&places, centroid, radius).len());
        let mut starts = vec![0];
        starts.extend(lengths.collect::<Vec<_>>().iter().scan(0, |end, length| {
            *end += length;
            Some(*end)
        }));
        let entries = starts[centroids.len()];
        let (mut elements, mut weights) = (vec![0; entries], vec![0.0; entries]);
        let rows = split(&mut elements, &starts).into_par_iter().zip(split(&mut weights, &starts));
        rows.zip(centroids).for_each(|((elements, weights), centroid)| {
            let mut row = grid.within(&places, centroid, radius);
            if !owners.is_empty() {
                row.iter_mut().for_each(|entry| entry.0 = owners[entry.0 as usize]);
                row.sort_by_key(|entry| entry.0);
            }
            elements.iter_mut().zip(weights).zip(row).for_each(|(at, entry)| (*at.0, *at.1) = entry);
        });
        Ok(Self { first, starts, elements, weights })
    }

    /// Number of lists.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Whether there are no lists.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Neighbours of `element`, including the element itself, and their weights \[L\].
    ///
    /// # Panics
    ///
    /// If there is no list of that element.
    pub fn of(&self, element: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let list = element - self.first;
        let row = self.starts[list]..self.starts[list + 1];
        let elements = self.elements[row.clone()].iter().map(|&element| element as usize);
        elements.zip(self.weights[row].iter().copied())
    }

    /// `Σ_i w_ei a_i` for each element `e` with a list; parallel over the elements, with a fixed
    /// order within each sum.
    pub(super) fn weighted_sums(&self, a: &[f64]) -> Vec<f64> {
        let sum = |element| self.of(element).map(|(neighbour, weight)| weight * a[neighbour]).sum();
        (self.first..self.first + self.len()).into_par_iter().map(sum).collect()
    }
}

/// Centroids, followed by those mirror images that may be within the radius of a centroid; and the
/// element of each, if there are images.
pub(super) fn with_images(centroids: &[[f64; 3]], radius: f64, planes: &[(usize, f64)]) -> (Vec<[f64; 3]>, Vec<u32>) {
    let mut places = centroids.to_vec();
    if planes.is_empty() {
        return (places, Vec::new());
    }
    let mut owners: Vec<u32> = (0..centroids.len() as u32).collect();
    for &(axis, at) in planes {
        for i in 0..places.len() {
            // elements lie on one side, so an image is at least as far from them as from the plane
            if (places[i][axis] - at).abs() < radius {
                let mut image = places[i];
                image[axis] = 2.0 * at - image[axis];
                places.push(image);
                owners.push(owners[i]);
            }
        }
    }
    (places, owners)
}

/// The rows of a list, given by the start of each.
fn split<'a, T>(mut list: &'a mut [T], starts: &[usize]) -> Vec<&'a mut [T]> {
    let rows = starts.windows(2).map(|row| {
        let (first, rest) = std::mem::take(&mut list).split_at_mut(row[1] - row[0]);
        list = rest;
        first
    });
    rows.collect()
}

/// Points sorted by cubic cells.
pub(crate) struct CellGrid {
    origin: [f64; 3],
    size: f64,
    cells: [usize; 3],
    starts: Vec<usize>,
    elements: Vec<u32>,
}

impl CellGrid {
    pub(crate) fn new(centroids: &[[f64; 3]], radius: f64) -> Self {
        let bound = |pick: fn(f64, f64) -> f64, start: f64| -> [f64; 3] {
            centroids.iter().fold([start; 3], |bound, x| std::array::from_fn(|k| pick(bound[k], x[k])))
        };
        let (low, high) = (bound(f64::min, f64::INFINITY), bound(f64::max, f64::NEG_INFINITY));
        let extent: [f64; 3] = std::array::from_fn(|k| (high[k] - low[k]).max(0.0));
        // A radius far below the element size must not create more cells than there are elements.
        let cells_along = |size: f64| extent.map(|length| (length / size).floor() + 1.0);
        let most = 4.0 * centroids.len() as f64 + 64.0;
        // Without the margin, round-off could put two elements closer than the radius two cells
        // apart.
        let mut size = 1.000_000_1 * radius;
        while cells_along(size).iter().product::<f64>() > most {
            size *= 1.25;
        }
        let cells = cells_along(size).map(|count| count as usize);
        let mut grid = Self { origin: low, size, cells, starts: Vec::new(), elements: Vec::new() };
        grid.sort(centroids);
        grid
    }

    /// A stable counting sort: within a cell, elements stay in ascending order.
    fn sort(&mut self, centroids: &[[f64; 3]]) {
        let cell_of: Vec<usize> = centroids.iter().map(|x| self.index(self.cell(x))).collect();
        self.starts = vec![0; self.cells.iter().product::<usize>() + 1];
        for &cell in &cell_of {
            self.starts[cell + 1] += 1;
        }
        for cell in 1..self.starts.len() {
            self.starts[cell] += self.starts[cell - 1];
        }
        let mut next = self.starts.clone();
        self.elements = vec![0; centroids.len()];
        for (element, &cell) in cell_of.iter().enumerate() {
            self.elements[next[cell]] = element as u32;
            next[cell] += 1;
        }
    }

    fn cell(&self, x: &[f64; 3]) -> [usize; 3] {
        std::array::from_fn(|k| (((x[k] - self.origin[k]) / self.size) as usize).min(self.cells[k] - 1))
    }

    fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        (i * self.cells[1] + j) * self.cells[2] + k
    }

    /// The points closer than `radius`, which is at most that of the grid, with the radius minus
    /// their distance.
    pub(crate) fn within(&self, centroids: &[[f64; 3]], x: &[f64; 3], radius: f64) -> Vec<(u32, f64)> {
        let centre = self.cell(x);
        let range = |k: usize| centre[k].saturating_sub(1)..=(centre[k] + 1).min(self.cells[k] - 1);
        let mut found = Vec::new();
        for i in range(0) {
            for j in range(1) {
                for k in range(2) {
                    let cell = self.index([i, j, k]);
                    for &element in &self.elements[self.starts[cell]..self.starts[cell + 1]] {
                        let weight = radius - distance(x, &centroids[element as usize]);
                        if weight > 0.0 {
                            found.push((element, weight));
                        }
                    }
                }
            }
        }
        found.sort_unstable_by_key(|entry| entry.0);
        found
    }
}

/// Symmetric to the last bit.
fn distance(x: &[f64; 3], y: &[f64; 3]) -> f64 {
    let [a, b, c] = [x[0] - y[0], x[1] - y[1], x[2] - y[2]];
    (a * a + b * b + c * c).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn brute_force(centroids: &[[f64; 3]], radius: f64, element: usize) -> Vec<(usize, f64)> {
        let weight = |i: usize| radius - distance(&centroids[element], &centroids[i]);
        (0..centroids.len()).map(|i| (i, weight(i))).filter(|entry| entry.1 > 0.0).collect()
    }

    proptest! {
        /// Compared with all pairs; radii from far below the spacing to beyond the extent, planar
        /// and linear point clouds.
        #[test]
        fn same_as_all_pairs(
            points in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 1..80),
            stretch in prop::array::uniform3(prop::sample::select(vec![0.0, 1e-3, 1.0, 50.0])),
            radius in prop::sample::select(vec![1e-9, 0.05, 0.3, 1.0, 300.0]),
        ) {
            let centroids: Vec<[f64; 3]> =
                points.iter().map(|p| std::array::from_fn(|k| p[k] * stretch[k])).collect();
            let neighbours = Neighbours::new(&centroids, radius).unwrap();
            for element in 0..centroids.len() {
                let found: Vec<_> = neighbours.of(element).collect();
                prop_assert_eq!(found, brute_force(&centroids, radius, element));
            }
        }
    }

    /// A quarter with its images in two planes has the same weights as the whole.
    #[test]
    fn images_are_those_of_the_whole() {
        let quarter: Vec<[f64; 3]> =
            (0..40).map(|i| [1.3, 2.1, 0.7].map(|f| 1.0 + (f * f64::from(i) + f).sin().abs())).collect();
        let planes = [(0, 1.0), (2, 0.9)];
        let mut whole = quarter.clone();
        for (axis, at) in planes {
            let images: Vec<_> = whole
                .iter()
                .map(|x| {
                    let mut x = *x;
                    x[axis] = 2.0 * at - x[axis];
                    x
                })
                .collect();
            whole.extend(images);
        }
        let (mirrored, all) =
            (Neighbours::mirrored(&quarter, 0.6, &planes).unwrap(), Neighbours::new(&whole, 0.6).unwrap());
        let mut images = 0;
        for element in 0..quarter.len() {
            let (mut found, mut expected) = (vec![0.0; quarter.len()], vec![0.0; quarter.len()]);
            mirrored.of(element).for_each(|(i, weight)| found[i] += weight);
            all.of(element).for_each(|(i, weight)| expected[i % quarter.len()] += weight);
            assert!(found.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-14), "{element}");
            images += mirrored.of(element).count() - mirrored.of(element).filter(|(i, _)| *i == element).count();
        }
        assert!(images > 0);
    }

    #[test]
    fn no_elements() {
        assert!(Neighbours::new(&[], 1.0).unwrap().is_empty());
    }

    #[test]
    fn errors_name_the_element() {
        for radius in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(Neighbours::new(&[[0.0; 3]], radius), Err(FilterError::Radius { .. })));
        }
        let error = Neighbours::new(&[[0.0; 3], [0.0, f64::NAN, 0.0]], 1.0).unwrap_err();
        assert_eq!(error, FilterError::Centroid { element: 1 });
    }
}

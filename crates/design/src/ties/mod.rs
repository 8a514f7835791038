//! Elements that share a design variable: symmetry, repetition and extrusion of a design.

mod motion;
mod places;

pub use motion::Motion;
pub use places::Places;

use thiserror::Error;

use crate::filter::CellGrid;

/// Largest allowed distance of the image of a centroid from a centroid, or of two centroids of a
/// column across its axis, relative to the distance between neighbouring centroids.
const TOLERANCE: f64 = 0.1;

/// Centroids of different columns are at least this far apart, relative to the distance between
/// neighbouring centroids.
const APART: f64 = 0.5;

/// Why elements cannot be tied. Elements are given as positions in the list of the [`Places`].
#[derive(Clone, Debug, Error, PartialEq)]
pub enum TieError {
    /// An element has no image. If several have none, this is the one whose image is farthest from
    /// a centroid.
    #[error("the image of element {element} lies {distance:e} from the nearest centroid, {ratio:.2} element sizes")]
    NoImage {
        /// The element.
        element: usize,
        /// The image of its centroid. \[L\]
        image: [f64; 3],
        /// The element with the nearest centroid.
        nearest: usize,
        /// The distance to it. \[L\]
        distance: f64,
        /// This distance divided by that between neighbouring centroids.
        ratio: f64,
        /// Number of elements without an image.
        count: usize,
    },
    /// An element has too many or too few repetitions.
    #[error("from element {element} on, the pattern has {found} repetitions instead of {count}")]
    Repetitions {
        /// The first element of its row.
        element: usize,
        /// Number of elements in its row.
        found: usize,
        /// Required number.
        count: usize,
        /// Distance of the image of its last element from the nearest centroid, divided by that
        /// between neighbouring centroids.
        ratio: f64,
    },
    /// Two elements are neither in the same column nor side by side.
    #[error("elements {first} and {second} lie {distance:e} apart across the axis, {ratio:.2} element sizes")]
    Columns {
        /// The first element.
        first: usize,
        /// The second element.
        second: usize,
        /// Distance of their centroids, measured across the axis. \[L\]
        distance: f64,
        /// This distance divided by that between neighbouring centroids.
        ratio: f64,
    },
}

/// Groups of elements of a list; initially, each element is its own group.
#[derive(Clone, Debug, PartialEq)]
pub struct Ties {
    /// A lower-numbered element of the same group, or the element itself if it is the lowest.
    parent: Vec<u32>,
}

impl Ties {
    /// No ties between this many elements.
    pub fn new(count: usize) -> Self {
        Self { parent: (0..count as u32).collect() }
    }

    /// Number of elements.
    pub fn len(&self) -> usize {
        self.parent.len()
    }

    /// Whether there are no elements.
    pub fn is_empty(&self) -> bool {
        self.parent.is_empty()
    }

    /// Unites the groups of two elements.
    ///
    /// # Panics
    ///
    /// If one of the elements does not exist.
    pub fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.first(a), self.first(b));
        self.parent[a.max(b)] = a.min(b) as u32;
    }

    /// The first element of an element's group.
    ///
    /// # Panics
    ///
    /// If there is no such element.
    pub fn first(&mut self, element: usize) -> usize {
        let mut at = element;
        while self.parent[at] as usize != at {
            // halves the path for the next search
            self.parent[at] = self.parent[self.parent[at] as usize];
            at = self.parent[at] as usize;
        }
        at
    }

    /// Ties each element to its image under a motion that maps the list onto itself.
    ///
    /// # Errors
    ///
    /// [`TieError::NoImage`] if the image of a centroid is not within a tenth of an element size of
    /// a centroid.
    pub fn symmetric(&mut self, places: &Places, motion: &Motion) -> Result<(), TieError> {
        let images = images(places, motion);
        let missing = |image: &&Image| image.ratio > TOLERANCE;
        let worst = images.iter().enumerate().filter(|(_, image)| missing(image));
        if let Some((element, image)) = worst.reduce(|a, b| if b.1.ratio > a.1.ratio { b } else { a }) {
            return Err(TieError::NoImage {
                element,
                image: motion.image(places.points()[element]),
                nearest: image.nearest,
                distance: image.distance,
                ratio: image.ratio,
                count: images.iter().filter(missing).count(),
            });
        }
        images.iter().enumerate().for_each(|(element, image)| self.join(element, image.nearest));
        Ok(())
    }

    /// Ties the corresponding elements of `count` equal cells, each displaced by `step` \[L\] from
    /// the previous one.
    ///
    /// # Errors
    ///
    /// [`TieError::Repetitions`] if an element does not have an image in each cell, or has one
    /// beyond the last.
    pub fn repeated(&mut self, places: &Places, step: [f64; 3], count: usize) -> Result<(), TieError> {
        let images = images(places, &Motion::Translation(step));
        let next = |element: usize| {
            let Image { nearest, ratio, .. } = images[element];
            (ratio <= TOLERANCE && nearest != element).then_some(nearest)
        };
        let mut starts = vec![true; images.len()];
        (0..images.len()).filter_map(next).for_each(|image| starts[image] = false);
        for start in (0..images.len()).filter(|&element| starts[element]) {
            let row: Vec<usize> = std::iter::successors(Some(start), |&element| next(element)).collect();
            if row.len() != count {
                let ratio = row.last().map_or(0.0, |&last| images[last].ratio);
                return Err(TieError::Repetitions { element: start, found: row.len(), count, ratio });
            }
            row.iter().for_each(|&element| self.join(start, element));
        }
        Ok(())
    }

    /// Ties the elements that lie in a column along a nonzero direction, which need not be a unit
    /// vector.
    ///
    /// # Errors
    ///
    /// [`TieError::Columns`] if the elements do not form columns, because two of them lie more than
    /// a tenth but less than half an element size apart across the direction.
    pub fn extruded(&mut self, places: &Places, direction: [f64; 3]) -> Result<(), TieError> {
        if places.len() < 2 {
            return Ok(());
        }
        let flat: Vec<[f64; 3]> = places.points().iter().map(|&point| motion::across(point, direction)).collect();
        let spacing = places.spacing();
        let farthest = APART * spacing.iter().fold(0.0_f64, |largest, size| largest.max(*size));
        let grid = CellGrid::new(&flat, farthest);
        for first in 0..flat.len() {
            for (second, weight) in grid.within(&flat, &flat[first], farthest) {
                let (second, distance) = (second as usize, farthest - weight);
                let ratio = distance / spacing[first].min(spacing[second]);
                if ratio <= TOLERANCE {
                    self.join(first, second);
                } else if ratio < APART {
                    return Err(TieError::Columns { first, second, distance, ratio });
                }
            }
        }
        Ok(())
    }

    /// Adds the ties of a part of the elements: element `k` of the part is `members[k]`.
    ///
    /// # Panics
    ///
    /// If the numbers of members and of elements of the part differ, or a member does not exist.
    pub fn add(&mut self, members: &[u32], mut part: Self) {
        assert_eq!(members.len(), part.len(), "one member for each element of the part");
        for element in 0..part.len() {
            self.join(members[element] as usize, members[part.first(element)] as usize);
        }
    }
}

/// The element nearest to the image of another one.
struct Image {
    nearest: usize,
    distance: f64,
    /// The distance divided by the smaller spacing of the two elements.
    ratio: f64,
}

fn images(places: &Places, motion: &Motion) -> Vec<Image> {
    let images: Vec<[f64; 3]> = places.points().iter().map(|&point| motion.image(point)).collect();
    let nearest = places.nearest(&images);
    let spacing = places.spacing();
    let image = |(element, (nearest, distance)): (usize, (usize, f64))| Image {
        nearest,
        distance,
        ratio: distance / spacing[element].min(spacing[nearest]),
    };
    nearest.into_iter().enumerate().map(image).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::tests::box_grid;

    /// The groups of more than one element, and the number of all groups.
    fn groups(ties: &mut Ties) -> (Vec<Vec<usize>>, usize) {
        let mut groups = vec![Vec::new(); ties.len()];
        (0..ties.len()).for_each(|element| groups[ties.first(element)].push(element));
        let all = groups.iter().filter(|group| !group.is_empty()).count();
        groups.retain(|group| group.len() > 1);
        (groups, all)
    }

    /// 4 × 2 × 2 unit cubes; element (i, j, k) is 4 i + 2 j + k.
    fn cubes() -> Places {
        Places::new(box_grid([4, 2, 2], 1.0).0)
    }

    #[test]
    fn mirrored_elements_are_tied() {
        let mut ties = Ties::new(16);
        ties.symmetric(&cubes(), &Motion::Mirror { through: [2.0, 0.0, 0.0], normal: [1.0, 0.0, 0.0] }).unwrap();
        let (pairs, count) = groups(&mut ties);
        assert_eq!((pairs[1].clone(), pairs[4].clone(), count), (vec![1, 13], vec![4, 8], 8));
        // a second plane, through elements that are their own images
        ties.symmetric(&cubes(), &Motion::Mirror { through: [0.0, 1.0, 1.0], normal: [0.0, 1.0, -1.0] }).unwrap();
        let (groups, count) = groups(&mut ties);
        assert_eq!((groups[0].clone(), groups[1].clone(), count), (vec![0, 12], vec![1, 2, 13, 14], 6));
    }

    #[test]
    fn rotations_and_patterns_make_orbits() {
        let mut ties = Ties::new(16);
        let middle = [2.0, 1.0, 1.0];
        ties.symmetric(&cubes(), &Motion::Rotation { through: middle, axis: [1.0, 0.0, 0.0], folds: 4 }).unwrap();
        assert_eq!(groups(&mut ties).0[0], [0, 1, 2, 3]);
        assert_eq!(groups(&mut ties).1, 4);
        let mut ties = Ties::new(16);
        ties.repeated(&cubes(), [2.0, 0.0, 0.0], 2).unwrap();
        assert_eq!((groups(&mut ties).0[1].clone(), groups(&mut ties).1), (vec![1, 9], 8));
    }

    #[test]
    fn columns_are_tied_in_any_direction() {
        let mut ties = Ties::new(16);
        ties.extruded(&cubes(), [-3.0, 0.0, 0.0]).unwrap();
        assert_eq!((groups(&mut ties).0[1].clone(), groups(&mut ties).1), (vec![1, 5, 9, 13], 4));
        // the same mesh, rotated
        let turn = Motion::Rotation { through: [0.3; 3], axis: [1.0, 2.0, 3.0], folds: 7 };
        let [start, end] = [[0.0; 3], [1.0, 0.0, 0.0]].map(|point| turn.image(point));
        let turned = Places::new(cubes().points().iter().map(|&point| turn.image(point)).collect());
        let mut again = Ties::new(16);
        again.extruded(&turned, std::array::from_fn(|k| end[k] - start[k])).unwrap();
        assert_eq!(groups(&mut again).0[1], [1, 5, 9, 13]);
    }

    #[test]
    fn ties_of_a_part_join_groups_of_the_whole() {
        let (mut whole, mut part) = (Ties::new(6), Ties::new(3));
        whole.join(0, 5);
        part.join(0, 2);
        whole.add(&[5, 1, 3], part);
        assert_eq!(groups(&mut whole), (vec![vec![0, 3, 5]], 4));
    }

    /// A twentieth of an element is within the tolerance; a fifth is not, and the error names the
    /// worst element.
    #[test]
    fn errors_say_by_how_much() {
        let mirror = Motion::Mirror { through: [2.0, 0.0, 0.0], normal: [1.0, 0.0, 0.0] };
        let moved = |by: f64| {
            let mut points = cubes().points().to_vec();
            points[6][1] += by;
            Places::new(points)
        };
        assert!(Ties::new(16).symmetric(&moved(0.05), &mirror).is_ok());
        let Err(TieError::NoImage { element: 6, nearest: 10, distance, ratio, count: 2, .. }) =
            Ties::new(16).symmetric(&moved(-0.2), &mirror)
        else {
            panic!("another error");
        };
        assert!((distance - 0.2).abs() < 1e-12 && (ratio - 0.25).abs() < 1e-12);
        let repeated = |step: f64, count: usize| Ties::new(16).repeated(&cubes(), [step, 0.0, 0.0], count);
        let error =
            |found: usize, count: usize, ratio: f64| Err(TieError::Repetitions { element: 0, found, count, ratio });
        assert_eq!(repeated(2.0, 3), error(2, 3, 1.0));
        assert_eq!(repeated(1.0, 2), error(4, 2, 1.0));
        assert_eq!(repeated(0.0, 2), error(1, 2, 0.0));
        let error = Ties::new(16).extruded(&moved(-0.2), [1.0, 0.0, 0.0]);
        assert!(matches!(error, Err(TieError::Columns { first: 2, second: 6, .. })), "{error:?}");
    }
}

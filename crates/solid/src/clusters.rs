//! Elements in compact clusters, for assembly in parallel.
//!
//! Elements of a cluster add to matrix rows that their neighbours have just used, so these rows are
//! in the cache. Clusters of one colour share no nodes, so they can be assembled in parallel;
//! colours are processed one after the other. The order of all additions is determined by the
//! clusters, which depend only on the mesh: results are the same, bit for bit, for any number of
//! threads.

use rayon::prelude::*;
use slipstick_mesh::{Element, Mesh};
use std::marker::PhantomData;
use std::ops::Range;

/// Maximum number of elements in a cluster, so that the rows of its nodes fit in the second-level
/// cache.
const LARGEST: usize = 256;
/// Minimum number of elements in a cluster, so that the overhead of starting one is small.
const SMALLEST: usize = 8;
/// Number of clusters that keeps many threads busy.
const MANY: usize = 256;

/// A numbering of the elements cluster by cluster, colour by colour.
#[derive(Debug, Clone)]
pub(crate) struct Clusters {
    /// The mesh's numbers of the elements, in the order of the clusters.
    pub order: Vec<u32>,
    /// Ranges of `order`, by colour.
    colours: Vec<Vec<Range<usize>>>,
}

/// Numbers to which all elements add.
///
/// Threads share it without locks, under the contract of [`Target::at`].
pub(crate) struct Target<'a, T> {
    first: *mut T,
    len: usize,
    lifetime: PhantomData<&'a mut [T]>,
}

// SAFETY: entries are accessed only through `Target::at`, whose callers guarantee that no two
// threads access the same entry.
unsafe impl<T: Send> Sync for Target<'_, T> {}

impl<T> Target<'_, T> {
    /// Entry `index`.
    ///
    /// # Safety
    /// Within [`Clusters::assemble`], `index` must belong to a node, or a pair of nodes, of an
    /// element of the current cluster; and the previous reference must no longer exist.
    ///
    /// # Panics
    /// If there is no such entry.
    #[inline(always)]
    #[allow(clippy::mut_from_ref)]
    pub unsafe fn at(&self, index: usize) -> &mut T {
        assert!(index < self.len, "entry {index} of {}", self.len);
        // SAFETY: in range; not shared, as the caller guarantees.
        unsafe { &mut *self.first.add(index) }
    }
}

impl Clusters {
    /// Clusters of some elements of a mesh.
    pub fn new(mesh: &Mesh, mut elements: Vec<u32>) -> Self {
        let corners = |element: &Element| element.nodes().iter().map(|&n| mesh.nodes[n as usize]).collect::<Vec<_>>();
        let centres: Vec<[f64; 3]> = mesh.elements.iter().map(|e| mean(corners(e).into_iter())).collect();
        let largest = (elements.len() / MANY).clamp(SMALLEST, LARGEST);
        let mut clusters = Vec::new();
        let (mut order, mut colours) = (Vec::with_capacity(elements.len()), Vec::new());
        bisect(&mut elements, &centres, largest, &mut clusters);
        for colour in colour(mesh, clusters) {
            let ranges = colour.into_iter().map(|cluster| {
                order.extend_from_slice(&cluster);
                order.len() - cluster.len()..order.len()
            });
            colours.push(ranges.collect());
        }
        Self { order, colours }
    }

    /// Clusters of items that replace their elements: `replace` receives the elements of each
    /// cluster in order, and returns the number of items of the cluster.
    pub fn replaced(mut self, mut replace: impl FnMut(&[u32]) -> usize) -> Self {
        let mut end = 0;
        for cluster in self.colours.iter_mut().flatten() {
            let start = end;
            end += replace(&self.order[cluster.clone()]);
            *cluster = start..end;
        }
        self
    }

    /// Calls `work` for all clusters, in parallel within a colour. Returns the elements that it
    /// rejected.
    ///
    /// `work` receives a cluster as a range of [`Self::order`], the target, and a list for the mesh
    /// numbers of the elements that it rejects.
    pub fn assemble<T: Send>(
        &self,
        target: &mut [T],
        work: impl Fn(Range<usize>, &Target<'_, T>, &mut Vec<u32>) + Sync,
    ) -> Vec<u32> {
        let target = Target { first: target.as_mut_ptr(), len: target.len(), lifetime: PhantomData };
        let mut rejected = Vec::new();
        for colour in &self.colours {
            rejected.par_extend(colour.par_iter().flat_map_iter(|cluster| {
                let mut rejected = Vec::new();
                work(cluster.clone(), &target, &mut rejected);
                rejected
            }));
        }
        rejected
    }
}

/// Bisects a set of elements across its longest extent until the parts are small.
fn bisect(elements: &mut [u32], centres: &[[f64; 3]], largest: usize, out: &mut Vec<Vec<u32>>) {
    if elements.len() <= largest {
        elements.sort_unstable();
        if !elements.is_empty() {
            out.push(elements.to_vec());
        }
        return;
    }
    let extension = |axis: usize| {
        let along = elements.iter().map(|&e| centres[e as usize][axis]);
        along.clone().fold(f64::NEG_INFINITY, f64::max) - along.fold(f64::INFINITY, f64::min)
    };
    let extensions = [extension(0), extension(1), extension(2)];
    let axis = (0..3).max_by(|&a, &b| extensions[a].total_cmp(&extensions[b])).unwrap_or(0);
    let half = elements.len() / 2;
    // Ties are broken by the element number, so the halves do not depend on the algorithm.
    elements.select_nth_unstable_by(half, |&a, &b| {
        centres[a as usize][axis].total_cmp(&centres[b as usize][axis]).then(a.cmp(&b))
    });
    let (lower, upper) = elements.split_at_mut(half);
    bisect(lower, centres, largest, out);
    bisect(upper, centres, largest, out);
}

/// Assigns each cluster the first colour that no cluster with a common node has.
fn colour(mesh: &Mesh, clusters: Vec<Vec<u32>>) -> Vec<Vec<Vec<u32>>> {
    // For each colour, the nodes at which it occurs.
    let mut taken: Vec<Vec<bool>> = Vec::new();
    let mut colours: Vec<Vec<Vec<u32>>> = Vec::new();
    for cluster in clusters {
        let nodes = || cluster.iter().flat_map(|&e| mesh.elements[e as usize].nodes()).map(|&n| n as usize);
        let colour = taken.iter().position(|taken| !nodes().any(|n| taken[n])).unwrap_or(taken.len());
        if colour == taken.len() {
            taken.push(vec![false; mesh.nodes.len()]);
            colours.push(Vec::new());
        }
        nodes().for_each(|n| taken[colour][n] = true);
        colours[colour].push(cluster);
    }
    colours
}

fn mean(points: impl ExactSizeIterator<Item = [f64; 3]>) -> [f64; 3] {
    let scale = 1.0 / points.len() as f64;
    points.fold([0.0; 3], |sum, x| std::array::from_fn(|c| sum[c] + scale * x[c]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use slipstick_mesh::{BoxShape, box_mesh};

    #[test]
    fn clusters_hold_every_element_once_and_share_no_node_in_a_colour() {
        for elements in [[1, 1, 1], [17, 9, 11], [200, 3, 2]] {
            let shape = BoxShape { min: [0.0; 3], max: [3.0, 2.0, 1.0], elements, grading: [1.0; 3] };
            let mesh = box_mesh("block", &shape).unwrap();
            let clusters = Clusters::new(&mesh, (0..mesh.elements.len() as u32).collect());
            let mut seen = vec![0; mesh.elements.len()];
            for colour in &clusters.colours {
                let mut owner = vec![None; mesh.nodes.len()];
                for (c, cluster) in colour.iter().enumerate() {
                    assert!(!cluster.is_empty());
                    for &e in &clusters.order[cluster.clone()] {
                        seen[e as usize] += 1;
                        for &n in mesh.elements[e as usize].nodes() {
                            assert_eq!(*owner[n as usize].get_or_insert(c), c);
                        }
                    }
                }
            }
            assert!(seen.iter().all(|&n| n == 1));
            assert!(clusters.colours.len() < 20, "{} colours", clusters.colours.len());
        }
    }

    /// By hand.
    #[test]
    fn centres_are_means() {
        assert_eq!(mean([[1.0, 2.0, 3.0], [3.0, 6.0, -1.0]].into_iter()), [2.0, 4.0, 1.0]);
    }
}

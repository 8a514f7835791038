//! Contact search: a tree of axis-aligned boxes over the facets of one surface.

use crate::FacetNodes;

/// An axis-aligned box.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    min: [f64; 3],
    max: [f64; 3],
}

/// The smaller one, or NaN if either is NaN (unlike `f64::min`).
fn smaller(a: f64, b: f64) -> f64 {
    if a.is_nan() || a < b { a } else { b }
}

/// The larger one, or NaN if either is NaN (unlike `f64::max`).
fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

impl Bounds {
    fn of_facet(facet: FacetNodes, coordinates: &[f64]) -> Self {
        let corner = |node: u32| -> [f64; 3] { std::array::from_fn(|c| coordinates[3 * node as usize + c]) };
        facet.iter().map(|&node| Self { min: corner(node), max: corner(node) }).reduce(Self::join).unwrap_or(EMPTY)
    }

    fn join(self, other: Self) -> Self {
        Self {
            min: std::array::from_fn(|c| smaller(self.min[c], other.min[c])),
            max: std::array::from_fn(|c| larger(self.max[c], other.max[c])),
        }
    }

    fn of_all(boxes: &[Self]) -> Self {
        boxes.iter().copied().reduce(Self::join).unwrap_or(EMPTY)
    }

    /// Formulated as a negated exclusion, so that a NaN counts as a hit: it then reaches the
    /// contact terms and is detected there.
    fn meets(&self, min: &[f64; 3], max: &[f64; 3]) -> bool {
        !(0..3).any(|c| self.min[c] > max[c] || self.max[c] < min[c])
    }

    /// Twice the centre.
    fn centre(&self, c: usize) -> f64 {
        self.min[c] + self.max[c]
    }
}

/// The empty box.
const EMPTY: Bounds = Bounds { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3] };

/// Facets per leaf: below this, testing each box is cheaper than descending.
const LEAF: usize = 4;

/// A node of the tree. Nodes are stored depth first, so the first child directly follows its
/// parent.
#[derive(Debug, Clone, Copy)]
struct Branch {
    bounds: Bounds,
    /// The next node of the traversal if this one is missed: the one after its whole subtree.
    skip: usize,
    /// A leaf's facets are `first..first + count` of the tree's order; an inner node has `count` 0.
    first: usize,
    count: usize,
}

/// A tree of axis-aligned boxes over the facets of one surface in the current configuration.
///
/// It is built once per surface and refitted as the bodies move. After very large motions a new
/// tree gives faster queries, but the results are the same. Queries allocate no memory and can run
/// in parallel.
#[derive(Debug, Clone)]
pub struct FacetTree {
    branches: Vec<Branch>,
    /// Facet numbers in the order of the leaves, with their nodes and boxes in the same order.
    order: Vec<u32>,
    facets: Vec<FacetNodes>,
    boxes: Vec<Bounds>,
}

impl FacetTree {
    /// A tree over `facets` at the current coordinates x (3 per node). \[L\]
    ///
    /// # Panics
    /// If a facet's node has no coordinates, or with more than 2³² − 1 facets.
    pub fn build(facets: &[FacetNodes], coordinates: &[f64]) -> Self {
        assert!(u32::try_from(facets.len()).is_ok(), "facet numbers must fit 32 bits");
        let mut order: Vec<u32> = (0..facets.len() as u32).collect();
        let boxes: Vec<Bounds> = facets.iter().map(|&facet| Bounds::of_facet(facet, coordinates)).collect();
        let mut branches = Vec::new();
        if !facets.is_empty() {
            split(&mut branches, &mut order, 0, &boxes);
        }
        Self {
            branches,
            facets: order.iter().map(|&f| facets[f as usize]).collect(),
            boxes: order.iter().map(|&f| boxes[f as usize]).collect(),
            order,
        }
    }

    /// Fits all boxes to new coordinates x (3 per node); the tree keeps its shape. \[L\]
    ///
    /// # Panics
    /// If a facet's node has no coordinates.
    pub fn refit(&mut self, coordinates: &[f64]) {
        for (bounds, &facet) in self.boxes.iter_mut().zip(&self.facets) {
            *bounds = Bounds::of_facet(facet, coordinates);
        }
        // Children follow their parents, so in reverse order they come first.
        for i in (0..self.branches.len()).rev() {
            let Branch { first, count, .. } = self.branches[i];
            self.branches[i].bounds = if count > 0 {
                Bounds::of_all(&self.boxes[first..first + count])
            } else {
                let left = self.branches[i + 1];
                left.bounds.join(self.branches[left.skip].bounds)
            };
        }
    }

    /// Pushes the numbers of all facets whose box meets the box `min..max` (touching counts),
    /// ascending.
    ///
    /// `hits` keeps its previous entries; nothing else is allocated. A box with a NaN meets
    /// everything.
    pub fn query(&self, min: [f64; 3], max: [f64; 3], hits: &mut Vec<u32>) {
        let start = hits.len();
        let mut i = 0;
        while let Some(branch) = self.branches.get(i) {
            if !branch.bounds.meets(&min, &max) {
                i = branch.skip;
                continue;
            }
            for leaf in branch.first..branch.first + branch.count {
                if self.boxes[leaf].meets(&min, &max) {
                    hits.push(self.order[leaf]);
                }
            }
            i += 1;
        }
        hits[start..].sort_unstable();
    }

    /// Number of facets.
    pub fn len(&self) -> usize {
        self.order.len()
    }

    /// Whether there are no facets.
    pub fn is_empty(&self) -> bool {
        self.order.is_empty()
    }

    /// Smallest and largest coordinates of the whole surface; `None` without facets. \[L\]
    pub fn bounds(&self) -> Option<([f64; 3], [f64; 3])> {
        self.branches.first().map(|root| (root.bounds.min, root.bounds.max))
    }
}

/// Appends the subtree of the facets `order`, which start at `first` in the whole order; halves
/// them at the median centre along the direction in which the centres spread most.
fn split(branches: &mut Vec<Branch>, order: &mut [u32], first: usize, boxes: &[Bounds]) {
    let bounds = order.iter().map(|&f| boxes[f as usize]).reduce(Bounds::join).unwrap_or(EMPTY);
    let here = branches.len();
    let leaf = order.len() <= LEAF;
    branches.push(Branch { bounds, skip: 0, first, count: if leaf { order.len() } else { 0 } });
    if !leaf {
        let spread = |c: usize| {
            let centres = order.iter().map(|&f| boxes[f as usize].centre(c));
            let (min, max) = centres.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
            max - min
        };
        let spreads = [spread(0), spread(1), spread(2)];
        let widest = (1..3).fold(0, |best, c| if spreads[c] > spreads[best] { c } else { best });
        let half = order.len() / 2;
        // Ties are broken by number, so the tree depends only on its input.
        order.select_nth_unstable_by(half, |&f, &g| {
            let (a, b) = (boxes[f as usize].centre(widest), boxes[g as usize].centre(widest));
            a.total_cmp(&b).then(f.cmp(&g))
        });
        let (left, right) = order.split_at_mut(half);
        split(branches, left, first, boxes);
        split(branches, right, first + half, boxes);
    }
    branches[here].skip = branches.len();
}

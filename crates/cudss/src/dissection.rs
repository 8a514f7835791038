//! The binary tree of a nested dissection, in the form that cuDSS expects.

use rayon::prelude::*;
use slipstick_linalg::{CsrPattern, EliminationTree};

/// Largest and smallest number of levels of the tree: cuDSS's default, and the least it accepts.
const MOST_LEVELS: usize = 10;
const LEAST_LEVELS: usize = 2;

/// Parts with fewer unknowns than this are not divided further.
const SMALL: usize = 64;

/// Largest share of the unknowns on one side of a separator.
const LARGEST_SIDE: f64 = 0.6;

/// An elimination order given by a binary tree of parts; each part is a separator of its two
/// subtrees: first the parts of the lowest level, then the separators, the root last.
///
/// Parts on the same level are not coupled, which is what a GPU needs to work on them at the same
/// time.
#[derive(Debug, PartialEq)]
pub(crate) struct Dissection {
    /// Unknowns in the order of their elimination.
    pub(crate) order: Vec<i32>,
    /// Number of levels.
    pub(crate) levels: i32,
    /// Number of unknowns of each part, of which there are 2^levels − 1, in the order of their
    /// elimination; parts can be empty.
    pub(crate) parts: Vec<i32>,
    /// The part of each unknown, by its number: the root has the number 1, and the parts below part
    /// k have the numbers 2 k and 2 k + 1.
    part: Vec<u32>,
}

/// The part of level `depth` below the root, and `place` from the left, in the order of elimination.
fn index(levels: usize, depth: usize, place: usize) -> usize {
    (1 << levels) - (1 << (depth + 1)) + place
}

impl Dissection {
    /// Builds the dissection from an elimination tree. If one branch holds most of the unknowns,
    /// its root joins the separator.
    pub(crate) fn of(tree: &EliminationTree) -> Self {
        let supernodes: Vec<_> = tree.supernodes().collect();
        let levels = LEAST_LEVELS.max(MOST_LEVELS.min((tree.order().len() / SMALL).max(1).ilog2() as usize));
        let mut division = Division { levels, children: vec![Vec::new(); supernodes.len()], ..Division::default() };
        let mut roots = Vec::new();
        for (k, (places, parent)) in supernodes.iter().enumerate() {
            division.own.push(places.len());
            match parent {
                Some(parent) => division.children[*parent].push(k),
                None => roots.push(k),
            }
        }
        division.below = division.own.clone();
        for (k, (_, parent)) in supernodes.iter().enumerate() {
            if let Some(parent) = parent {
                division.below[*parent] += division.below[k];
            }
        }
        division.parts = vec![Vec::new(); (1 << levels) - 1];
        division.divide(roots, 0, 0);
        let mut order = Vec::with_capacity(tree.order().len());
        let mut parts = Vec::with_capacity(division.parts.len());
        for members in &mut division.parts {
            // a supernode is eliminated before its ancestors
            members.sort_unstable();
            let start = order.len();
            for &member in members.iter() {
                order.extend(tree.order()[supernodes[member].0.clone()].iter().map(|&unknown| unknown as i32));
            }
            parts.push((order.len() - start) as i32);
        }
        let numbers = (0..levels).rev().flat_map(|depth| (1 << depth)..(2 << depth));
        let mut part = vec![0; order.len()];
        let mut unknowns = order.iter();
        for (number, &count) in numbers.zip(&parts) {
            unknowns.by_ref().take(count as usize).for_each(|&unknown| part[unknown as usize] = number);
        }
        Self { order, levels: levels as i32, parts, part }
    }

    /// Whether the dissection is still valid for `pattern` (same unknowns): every part separates
    /// its two subtrees, that is, of two coupled unknowns in different parts, one is in a part
    /// above the other's.
    pub(crate) fn suits(&self, pattern: &CsrPattern) -> bool {
        let above = |a: u32, b: u32| a <= b && b >> (b.ilog2() - a.ilog2()) == a;
        let suits = |i: usize| {
            let own = self.part[i];
            let related = |&j: &u32| above(own, self.part[j as usize]) || above(self.part[j as usize], own);
            pattern.row(i).iter().all(related)
        };
        self.part.len() == pattern.n() && (0..pattern.n()).into_par_iter().with_min_len(4096).all(suits)
    }
}

#[derive(Default)]
struct Division {
    levels: usize,
    /// Unknowns of each supernode, and of its whole branch.
    own: Vec<usize>,
    below: Vec<usize>,
    children: Vec<Vec<usize>>,
    /// Supernodes of each part.
    parts: Vec<Vec<usize>>,
}

impl Division {
    /// Distributes the branches with these roots over a part and those below it.
    fn divide(&mut self, mut branches: Vec<usize>, depth: usize, place: usize) {
        let part = index(self.levels, depth, place);
        let mut unknowns: usize = branches.iter().map(|&root| self.below[root]).sum();
        if depth + 1 == self.levels || unknowns <= SMALL {
            while let Some(root) = branches.pop() {
                branches.extend(&self.children[root]);
                self.parts[part].push(root);
            }
            return;
        }
        branches.sort_by_key(|&root| (self.below[root], root));
        while let Some(&largest) = branches.last() {
            if self.below[largest] as f64 <= LARGEST_SIDE * unknowns as f64 {
                break;
            }
            branches.pop();
            self.parts[part].push(largest);
            unknowns -= self.own[largest];
            branches.extend(&self.children[largest]);
            branches.sort_by_key(|&root| (self.below[root], root));
        }
        // the largest first, each to the smaller side
        let mut sides = [(0, Vec::new()), (0, Vec::new())];
        for root in branches.into_iter().rev() {
            let side = usize::from(sides[1].0 < sides[0].0);
            sides[side].0 += self.below[root];
            sides[side].1.push(root);
        }
        for ((_, branches), side) in sides.into_iter().zip(0..) {
            self.divide(branches, depth + 1, 2 * place + side);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use slipstick_linalg::CsrPattern;

    /// A grid of m × m unknowns, each coupled to its neighbours, and the first one to `others`.
    fn grid_with(m: usize, others: &[u32]) -> CsrPattern {
        let row = |k: usize| {
            let (i, j) = (k / m, k % m);
            let around = |c: usize| c.saturating_sub(1)..(c + 2).min(m);
            around(i).flat_map(|a| around(j).map(move |b| (a * m + b) as u32)).collect::<Vec<_>>()
        };
        let mut rows: Vec<Vec<u32>> = (0..m * m).map(row).collect();
        rows[0].extend(others);
        rows[0].sort_unstable();
        rows[0].dedup();
        let offsets = std::iter::once(0).chain(rows.iter().scan(0, |sum, row| {
            *sum += row.len();
            Some(*sum)
        }));
        CsrPattern::new(offsets.collect(), rows.concat(), (0..(m * m) as u32).collect(), vec![]).unwrap()
    }

    fn grid(m: usize) -> CsrPattern {
        grid_with(m, &[])
    }

    /// By definition: every unknown is in one part, and coupled ones are in parts of which one is
    /// above the other.
    #[test]
    fn separators_separate() {
        for m in [1, 2, 9, 70] {
            let pattern = grid(m);
            let dissection = Dissection::of(&EliminationTree::new(&pattern, None).unwrap());
            assert!(dissection.suits(&pattern));
            let Dissection { order, levels, parts, .. } = dissection;
            let mut sorted = order.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, (0..(m * m) as i32).collect::<Vec<_>>());
            assert_eq!(parts.len(), (1 << levels) - 1);
            assert_eq!(parts.iter().sum::<i32>() as usize, m * m);
            // number of each part in a heap with root 1
            let numbers = (0..levels).rev().flat_map(|depth| (1 << depth)..(2 << depth));
            let mut heap = vec![0usize; m * m];
            let mut unknowns = order.iter();
            for (number, &count) in numbers.zip(&parts) {
                unknowns.by_ref().take(count as usize).for_each(|&unknown| heap[unknown as usize] = number);
            }
            let above = |a: usize, b: usize| a <= b && b >> (b.ilog2() - a.ilog2()) == a;
            for i in 0..m * m {
                for &j in pattern.row(i) {
                    let (a, b) = (heap[i], heap[j as usize]);
                    assert!(above(a, b) || above(b, a), "{m}: {i} and {j} are in parts {a} and {b}");
                }
            }
        }
    }

    /// A coupling across a separator requires a new dissection; a coupling with the separator or within a
    /// part does not.
    #[test]
    fn couplings_across_separators_are_found() {
        let m = 70;
        let dissection = Dissection::of(&EliminationTree::new(&grid(m), None).unwrap());
        let of_part = |number: u32| (1..(m * m) as u32).filter(|&i| dissection.part[i as usize] == number).collect();
        let own = dissection.part[0];
        let [root, same, sibling]: [Vec<u32>; 3] = [1, own, own ^ 1].map(of_part);
        assert!(dissection.suits(&grid_with(m, &root)) && dissection.suits(&grid_with(m, &same)));
        assert!(!dissection.suits(&grid_with(m, &sibling[..1])));
    }

    /// The two sides of the root of a square grid are about as large, and the separator small.
    #[test]
    fn sides_are_balanced() {
        let m = 70;
        let Dissection { parts, levels, .. } = Dissection::of(&EliminationTree::new(&grid(m), None).unwrap());
        let below = |root: usize| -> i32 {
            (1..levels)
                .flat_map(|depth| {
                    let width = 1usize << (depth - 1);
                    (0..width).map(move |k| (depth as usize, root * width + k))
                })
                .map(|(depth, place)| parts[index(levels as usize, depth, place)])
                .sum()
        };
        let (left, right, separator) = (below(0), below(1), *parts.last().unwrap());
        assert_eq!((left + right + separator) as usize, m * m);
        assert!(left.max(right) < 2 * left.min(right) && separator < 4 * m as i32, "{left} | {separator} | {right}");
    }
}

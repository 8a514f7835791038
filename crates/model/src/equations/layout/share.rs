//! The part of a model that this rank assembles, and how the parts are combined.
//!
//! Each element belongs to one rank; a node, with its row of the mortar matrices if it is a slave,
//! belongs to the rank of its first element; work that is not worth dividing, such as loads on
//! surfaces, to the first rank. Sums of the parts are the same on all ranks, bit for bit, and so is
//! every decision based on them. On a single rank, none of this has any effect.

use crate::equations::partition::partition;
use slipstick_contact::ContactStatus;
use slipstick_linalg::{Alone, Ranks};
use slipstick_mesh::Mesh;
use slipstick_path::StateError;
use std::sync::Arc;

/// The part of this rank, and the communication with the other ranks.
#[derive(Debug, Clone)]
pub struct Share {
    ranks: Arc<dyn Ranks>,
    /// Rank of every element, and of every node; empty if there is only one rank.
    elements: Arc<[u32]>,
    nodes: Arc<[u32]>,
}

impl Share {
    /// The whole model, on one rank.
    pub fn whole() -> Self {
        Self { ranks: Arc::new(Alone), elements: Arc::new([]), nodes: Arc::new([]) }
    }

    /// Shares of about equal work on all ranks; `pairs` are the names of slave and master surface
    /// of every contact pair, whose elements stay together.
    pub fn of(mesh: &Mesh, pairs: &[(&str, &str)], ranks: Arc<dyn Ranks>) -> Self {
        if ranks.size() == 1 {
            return Self::whole();
        }
        // the first rank computes it for all: two machines might not agree
        let divide = || bytes(partition(mesh, pairs, ranks.size()).into_iter());
        let told: Vec<u8> = if ranks.rank() == 0 { divide() } else { Vec::new() };
        let elements = numbers(&ranks.gather(&told).swap_remove(0));
        let mut nodes = vec![u32::MAX; mesh.nodes.len()];
        for (element, rank) in mesh.elements.iter().zip(&elements) {
            for &node in element.nodes() {
                let owner = &mut nodes[node as usize];
                *owner = if *owner == u32::MAX { *rank } else { *owner };
            }
        }
        nodes.iter_mut().filter(|owner| **owner == u32::MAX).for_each(|owner| *owner = 0);
        Self { ranks, elements: elements.into(), nodes: nodes.into() }
    }

    /// The rank that assembles an element.
    pub fn rank_of(&self, element: usize) -> u32 {
        self.elements.get(element).copied().unwrap_or(0)
    }

    /// Whether this rank assembles an element.
    pub fn has_element(&self, element: usize) -> bool {
        self.rank_of(element) as usize == self.ranks.rank()
    }

    /// Whether this rank assembles the data of a node.
    pub fn has_node(&self, node: u32) -> bool {
        self.nodes.get(node as usize).is_none_or(|&rank| rank as usize == self.ranks.rank())
    }

    /// Whether this rank assembles the undivided work.
    pub fn has_rest(&self) -> bool {
        self.ranks.rank() == 0
    }

    /// Communication with the other ranks.
    pub fn ranks(&self) -> &Arc<dyn Ranks> {
        &self.ranks
    }

    /// Rank of every node; empty if there is only one rank.
    pub fn owners(&self) -> &[u32] {
        &self.nodes
    }

    /// Whether there are several ranks.
    pub fn is_part(&self) -> bool {
        self.ranks.size() > 1
    }

    /// Replaces vectors by their sums over the ranks.
    pub fn sum(&self, parts: &mut [&mut [f64]]) {
        if !self.is_part() {
            return;
        }
        let mut all: Vec<f64> = parts.iter().flat_map(|part| part.iter().copied()).collect();
        self.ranks.sum(&mut all);
        let mut rest = all.as_slice();
        for part in parts {
            let (own, tail) = rest.split_at(part.len());
            part.copy_from_slice(own);
            rest = tail;
        }
    }

    /// Sums the ranks' parts of numbers, and of statuses.
    pub fn join(&self, parts: &mut [&mut [f64]], status: &mut [ContactStatus]) {
        if self.is_part() {
            let mut own: Vec<f64> = status.iter().map(|s| f64::from(s.code())).collect();
            self.sum(parts);
            self.sum(&mut [&mut own]);
            // each node belongs to one rank; on the others it is open, with code 0
            let known = own.iter().map(|&code| ContactStatus::from_code(code as u8).expect("a code of one rank"));
            status.iter_mut().zip(known).for_each(|(to, status)| *to = status);
        }
    }

    /// Adds to `to`, which is the same on all ranks, the contributions of `add` on each of them.
    ///
    /// # Errors
    /// The error of `add`, on all ranks.
    pub fn add(
        &self,
        to: &mut [f64],
        add: impl FnOnce(&mut [f64]) -> Result<(), StateError>,
    ) -> Result<(), StateError> {
        if !self.is_part() {
            return add(to);
        }
        let mut part = vec![0.0; to.len()];
        let result = add(&mut part);
        self.agree(result)?;
        self.ranks.sum(&mut part);
        to.iter_mut().zip(part).for_each(|(to, part)| *to += part);
        Ok(())
    }

    /// The largest value of any rank.
    pub fn largest(&self, here: f64) -> f64 {
        self.ranks.largest(here)
    }

    /// The result if all ranks succeeded, otherwise the error of any.
    ///
    /// # Errors
    /// The same on all ranks: all inverted elements, the node that penetrated the deepest, or the
    /// first rank's error.
    pub fn agree<T>(&self, here: Result<T, StateError>) -> Result<T, StateError> {
        if !self.is_part() || !self.ranks.any(here.is_err()) {
            return here;
        }
        // a rank without an error sends `null`; an error consists of numbers and words, which JSON
        // can hold
        let message = serde_json::to_vec(&here.err()).unwrap_or_default();
        let all = self.ranks.gather(&message);
        Err(worst(all.iter().filter_map(|message| serde_json::from_slice(message).ok().flatten()).collect()))
    }

    /// Checks that all ranks have the same numbers, bit for bit.
    ///
    /// # Errors
    /// [`StateError::RanksDisagree`], on all ranks.
    pub fn check_same(&self, values: &[f64]) -> Result<(), StateError> {
        if !self.is_part() {
            return Ok(());
        }
        let hash = hash(values);
        let all = self.ranks.gather(&hash.to_le_bytes());
        if all.windows(2).all(|pair| pair[0] == pair[1]) { Ok(()) } else { Err(StateError::RanksDisagree) }
    }
}

/// FNV-1a over the bits, word by word: <http://www.isthe.com/chongo/tech/comp/fnv/>.
fn hash(values: &[f64]) -> u64 {
    values.iter().fold(0xcbf2_9ce4_8422_2325, |hash, value| (hash ^ value.to_bits()).wrapping_mul(0x0100_0000_01b3))
}

fn bytes(numbers: impl Iterator<Item = u32>) -> Vec<u8> {
    numbers.flat_map(u32::to_le_bytes).collect()
}

fn numbers(bytes: &[u8]) -> Vec<u32> {
    bytes.as_chunks::<4>().0.iter().map(|b| u32::from_le_bytes(*b)).collect()
}

/// A single error for all ranks.
fn worst(errors: Vec<StateError>) -> StateError {
    let mut inverted: Vec<u32> = errors
        .iter()
        .filter_map(|error| match error {
            StateError::InvertedElements { elements } => Some(elements),
            _ => None,
        })
        .flatten()
        .copied()
        .collect();
    inverted.sort_unstable();
    if !inverted.is_empty() {
        return StateError::InvertedElements { elements: inverted };
    }
    let depth = |error: &StateError| match error {
        StateError::PassedThrough { depth, .. } | StateError::PrescribedPenetration { depth, .. } => *depth,
        _ => f64::INFINITY,
    };
    // on a tie, the first
    let deepest = errors.into_iter().reduce(|a, b| if depth(&b) > depth(&a) { b } else { a });
    deepest.unwrap_or(StateError::RanksDisagree)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_travel_whole() {
        for error in [
            StateError::InvertedElements { elements: vec![3, 70_000] },
            StateError::PassedThrough { node: 9, depth: 0.1 + 0.2, reach: 1e-3 },
            StateError::NotFinite { quantity: "the residual".into(), index: 7 },
            StateError::RanksDisagree,
        ] {
            let message = serde_json::to_vec(&Some(&error)).unwrap();
            assert_eq!(serde_json::from_slice::<Option<StateError>>(&message).unwrap(), Some(error));
        }
    }

    #[test]
    fn the_worst_error_speaks_for_all() {
        let inverted = |elements: &[u32]| StateError::InvertedElements { elements: elements.to_vec() };
        let through = |node, depth| StateError::PassedThrough { node, depth, reach: 1.0 };
        let folded = StateError::FoldedSurface { node: 1 };
        assert_eq!(worst(vec![inverted(&[7]), folded.clone(), inverted(&[2, 9])]), inverted(&[2, 7, 9]));
        assert_eq!(worst(vec![through(4, 1.5), through(2, 2.5), through(8, 2.5)]), through(2, 2.5));
        assert_eq!(worst(vec![folded.clone(), StateError::FoldedSurface { node: 6 }]), folded);
    }

    #[test]
    fn one_rank_has_all_and_adds_in_place() {
        let share = Share::whole();
        assert!(share.has_element(7) && share.has_node(7) && share.has_rest() && !share.is_part());
        let mut values = [1.0, 2.0];
        let failed = StateError::FoldedSurface { node: 1 };
        let one_more = |values: &mut [f64]| {
            values[0] += 1.0;
            Ok(())
        };
        assert_eq!(share.add(&mut values, one_more), Ok(()));
        assert_eq!(share.add(&mut values, |_| Err(failed.clone())), Err(failed));
        share.sum(&mut [&mut values]);
        assert_eq!((values, share.largest(-3.0)), ([2.0, 2.0], -3.0));
    }
}

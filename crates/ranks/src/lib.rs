//! Ranks of a parallel run, and the messages between them.
//!
//! All ranks march the same path with the same states; each assembles a part of every residual and
//! tangent, and solves for a part of the unknowns (`Layout` of `slipstick-linalg`). The assembled
//! results are the same on all ranks, bit for bit, so that decisions based on them need no further
//! communication.

pub mod threads;

use std::fmt::Debug;
use std::ops::Range;

/// The data that a rank has sent to the others through [`Ranks`].
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Traffic {
    /// Number of calls.
    pub calls: u64,
    /// Data sent by this rank. \[bytes\]
    pub bytes: u64,
}

/// The ranks of a run. All of them must make the same calls in the same order.
///
/// Results are the same on all ranks, bit for bit, and reproducible for the same input and number
/// of ranks. A lost message ends the program on all ranks; none of these calls returns an error.
pub trait Ranks: Send + Sync + Debug {
    /// Number of this rank, from 0.
    fn rank(&self) -> usize;

    /// Number of ranks, at least 1.
    fn size(&self) -> usize;

    /// Replaces every entry by its sum over the ranks, all of which have the same number of
    /// entries.
    fn sum(&self, values: &mut [f64]);

    /// Whether `here` is true on any rank.
    fn any(&self, here: bool) -> bool;

    /// The messages of all ranks, in rank order. Their lengths may differ.
    fn gather(&self, message: &[u8]) -> Vec<Vec<u8>>;

    /// Sends the next `to[r]` numbers of `values` to each rank `r`, and returns the numbers that
    /// the ranks have sent to this one, in rank order: `from[r]` numbers from rank `r`.
    fn exchange(&self, values: &[f64], to: &[usize], from: &[usize]) -> Vec<f64>;

    /// The numbers of all ranks, one after the other.
    fn join(&self, values: &[f64]) -> Vec<f64> {
        if self.size() == 1 {
            return values.to_vec();
        }
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        let all = self.gather(&bytes);
        all.iter().flat_map(|told| told.as_chunks::<8>().0).map(|bytes| f64::from_le_bytes(*bytes)).collect()
    }

    /// The largest number of any rank, or NaN if any is NaN.
    fn largest(&self, here: f64) -> f64 {
        if self.size() == 1 {
            return here;
        }
        largest_or_nan(self.join(&[here]))
    }

    /// The numbers of the first rank; those of the others are ignored.
    fn of_first(&self, values: &[f64]) -> Vec<f64> {
        if self.size() == 1 {
            return values.to_vec();
        }
        let first = self.rank() == 0;
        let bytes: Vec<u8> = values.iter().filter(|_| first).flat_map(|value| value.to_le_bytes()).collect();
        let told = self.gather(&bytes).swap_remove(0);
        told.as_chunks::<8>().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect()
    }

    /// The data that this rank has sent to the others so far.
    fn traffic(&self) -> Traffic {
        Traffic::default()
    }
}

/// This rank's range of a list of `count` entries: the ranges of successive ranks follow each other
/// and are about equally long. [`Ranks::join`] puts the parts together again.
///
/// ```
/// use slipstick_ranks::{Alone, own_range};
///
/// assert_eq!(own_range(7, &Alone), 0..7);
/// ```
pub fn own_range(count: usize, ranks: &dyn Ranks) -> Range<usize> {
    let (rank, size) = (ranks.rank(), ranks.size());
    count * rank / size..count * (rank + 1) / size
}

/// The largest of some numbers, or NaN if any is NaN.
pub fn largest_or_nan(numbers: impl IntoIterator<Item = f64>) -> f64 {
    let larger = |a: f64, b: f64| if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) };
    numbers.into_iter().fold(f64::NEG_INFINITY, larger)
}

/// The only rank of a run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Alone;

impl Ranks for Alone {
    fn rank(&self) -> usize {
        0
    }

    fn size(&self) -> usize {
        1
    }

    fn sum(&self, _values: &mut [f64]) {}

    fn any(&self, here: bool) -> bool {
        here
    }

    fn gather(&self, message: &[u8]) -> Vec<Vec<u8>> {
        vec![message.to_vec()]
    }

    fn exchange(&self, values: &[f64], _to: &[usize], _from: &[usize]) -> Vec<f64> {
        values.to_vec()
    }
}

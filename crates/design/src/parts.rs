//! Which part of a list of elements or variables a rank works on.

use slipstick_linalg::Ranks;
use std::ops::Range;

/// The entries of a list of `count` that are this rank's: each rank's follow those of the rank before, in about equal
/// parts. [`Ranks::join`] puts them together again.
///
/// ```
/// use slipstick_design::parts::own_range;
/// use slipstick_linalg::Alone;
///
/// assert_eq!(own_range(7, &Alone), 0..7);
/// ```
pub fn own_range(count: usize, ranks: &dyn Ranks) -> Range<usize> {
    let (rank, size) = (ranks.rank(), ranks.size());
    count * rank / size..count * (rank + 1) / size
}

#[cfg(test)]
#[path = "../../linalg/tests/common/thread_ranks.rs"]
pub(crate) mod thread_ranks;

#[cfg(test)]
mod tests {
    use super::thread_ranks::on_ranks;
    use super::*;

    #[test]
    fn parts_make_up_the_whole() {
        for (count, size) in [(0, 3), (2, 3), (10, 4), (11, 1)] {
            let ranges = on_ranks(size, |rank| own_range(count, &rank));
            assert!(ranges.into_iter().flatten().eq(0..count));
        }
    }
}

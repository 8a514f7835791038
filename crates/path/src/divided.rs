//! Lists that are distributed over the ranks, for tasks that only the first rank performs, such as
//! writing files.
//!
//! Joining a list requires all ranks to send their parts. While the first rank works, the others
//! therefore wait for the number of the next list that it requests, until it reports that it is
//! done. On one rank nothing is sent.

use slipstick_linalg::Ranks;

/// The number that the first rank sends when it is done.
const END: f64 = -1.0;

/// Runs `work` on the first rank, where it may request lists by number, repeatedly and in any
/// order; returns `None` on the others. All ranks must call this function; `join` joins a list if
/// all ranks call it.
pub(crate) fn on_first<T, R>(
    ranks: &dyn Ranks,
    join: impl Fn(usize) -> T,
    work: impl FnOnce(&mut dyn FnMut(usize) -> T) -> R,
) -> Option<R> {
    if ranks.size() == 1 {
        return Some(work(&mut |index| join(index)));
    }
    if ranks.rank() == 0 {
        let result = work(&mut |index| {
            ranks.of_first(&[index as f64]);
            join(index)
        });
        ranks.of_first(&[END]);
        return Some(result);
    }
    while let Some(&wanted) = ranks.of_first(&[]).first().filter(|&&wanted| wanted != END) {
        join(wanted as usize);
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use slipstick_linalg::own_range;
    use slipstick_ranks::threads::on_ranks;

    /// Two lists, each with a part on each of three ranks: requested in any order, repeatedly, and
    /// not at all. Failing work also ends its turn, and another turn can follow.
    #[test]
    fn parts_are_put_together_when_asked() {
        let lists: [Vec<f64>; 2] = [vec![0.5, 1.5, 2.5, 3.5], vec![7.0]];
        let found = on_ranks(3, |rank| {
            let join = |index: usize| rank.join(&lists[index][own_range(lists[index].len(), &rank)]);
            let mut told = Vec::new();
            for turn in 0..3 {
                let wanted: &[usize] = [&[1, 0, 1][..], &[], &[0]][turn];
                let result = on_first(&rank, join, |get| {
                    told.extend(wanted.iter().map(|&index| get(index)));
                    if turn == 0 { Err("a full disk") } else { Ok(()) }
                });
                assert_eq!(result.is_some(), rank.rank() == 0);
                assert_eq!(result.is_some_and(|result| result.is_err()), rank.rank() == 0 && turn == 0);
            }
            told
        });
        let [first, second] = lists;
        assert_eq!(found, [vec![second.clone(), first.clone(), second, first], vec![], vec![]]);
    }
}

//! Things that the ranks hold in parts, and the first rank asks for.
//!
//! To put one together all ranks have to say their parts. So while the first rank [`ask`]s, the others [`serve`]: they hear
//! which one it wants, until it wants no more. On one rank both are nothing.

use slipstick_linalg::Ranks;

/// What the first rank says when it wants no more.
const END: f64 = -1.0;

/// Does the first rank's `work`, which may ask for things by number, also again and in any order; `fetch` puts one together
/// when all ranks call it.
pub(crate) fn ask<T, R>(
    ranks: &dyn Ranks,
    fetch: impl Fn(usize) -> T,
    work: impl FnOnce(&mut dyn FnMut(usize) -> T) -> R,
) -> R {
    if ranks.size() == 1 {
        return work(&mut |index| fetch(index));
    }
    let result = work(&mut |index| {
        ranks.of_first(&[index as f64]);
        fetch(index)
    });
    ranks.of_first(&[END]);
    result
}

/// Says this rank's parts of what the first rank asks for. On the first rank itself, asks for nothing.
pub(crate) fn serve<T>(ranks: &dyn Ranks, fetch: impl Fn(usize) -> T) {
    if ranks.rank() == 0 {
        return ask(ranks, fetch, |_| ());
    }
    while let Some(&wanted) = ranks.of_first(&[]).first().filter(|&&wanted| wanted != END) {
        fetch(wanted as usize);
    }
}

#[cfg(test)]
#[path = "../../linalg/tests/common/thread_ranks.rs"]
mod thread_ranks;

#[cfg(test)]
mod tests {
    use super::thread_ranks::on_ranks;
    use super::*;
    use slipstick_linalg::own_range;

    /// Two lists of which each of three ranks has a part: asked for in any order, again, and not at all; work that fails ends
    /// the turn as well, and another one can follow.
    #[test]
    fn parts_are_put_together_when_asked() {
        let lists: [Vec<f64>; 2] = [vec![0.5, 1.5, 2.5, 3.5], vec![7.0]];
        let found = on_ranks(3, |rank| {
            let fetch = |index: usize| rank.join(&lists[index][own_range(lists[index].len(), &rank)]);
            let mut told = Vec::new();
            for turn in 0..3 {
                let wanted: &[usize] = [&[1, 0, 1][..], &[], &[0]][turn];
                if rank.rank() > 0 {
                    serve(&rank, fetch);
                    continue;
                }
                let result = ask(&rank, fetch, |get| {
                    told.extend(wanted.iter().map(|&index| get(index)));
                    if turn == 0 { Err("a full disk") } else { Ok(()) }
                });
                assert_eq!(result.is_err(), turn == 0);
            }
            // the first rank may have nothing to ask for
            serve(&rank, fetch);
            told
        });
        let [first, second] = lists;
        assert_eq!(found, [vec![second.clone(), first.clone(), second, first], vec![], vec![]]);
    }
}

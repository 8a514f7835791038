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

//! Distribution of a vector's unknowns over ranks, and exchange between neighbours.

use crate::csr::CsrPattern;
use slipstick_ranks::Ranks;

/// Unknowns of the ranks; each has one owner. A rank holds the entries of its own unknowns,
/// ascending, and borrows those of other ranks' unknowns that its part of a matrix touches.
///
/// A vector can therefore have three forms. *Own*: the entries of this rank's unknowns, used by
/// solvers. *Whole*: all entries, the same on every rank, used by states. *Local*: as long as a
/// whole one, but only the entries that this rank touches have a meaning, as terms of a product
/// before they are collected, or as the argument of a product.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Layout {
    n: usize,
    /// `None` on one rank, which owns all unknowns.
    shared: Option<Shared>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
struct Shared {
    own: Vec<u32>,
    /// Number of every unknown if the unknowns are counted rank by rank.
    numbers: Vec<u32>,
    /// Entries of own vectors that others borrow: for the first rank first, ascending; and how many
    /// each borrows.
    lent: Vec<u32>,
    lent_to: Vec<usize>,
    /// Unknowns that this rank borrows, also by owner.
    borrowed: Vec<u32>,
    borrowed_from: Vec<usize>,
}

impl Layout {
    /// All unknowns on one rank.
    pub fn whole(n: usize) -> Self {
        Self { n, shared: None }
    }

    /// The rank of an elimination group among `size` ranks, where `owners` contains one rank for
    /// each group; further groups belong to the first rank.
    pub fn owner(owners: &[u32], group: u32, size: usize) -> usize {
        owners.get(group as usize).map_or(0, |&rank| rank as usize).min(size - 1)
    }

    /// By the elimination groups of a pattern: `owners` contains the rank of each group. Unknowns
    /// of further groups belong to the first rank. All ranks call this with patterns of the same
    /// unknowns in the same groups, each with the entries of its part.
    pub fn new(pattern: &CsrPattern, owners: &[u32], ranks: &dyn Ranks) -> Self {
        let (n, size) = (pattern.n(), ranks.size());
        if size == 1 {
            return Self::whole(n);
        }
        let owner = |unknown: usize| Self::owner(owners, pattern.groups()[unknown], size);
        let mut next = vec![0_u32; size + 1];
        for unknown in 0..n {
            next[owner(unknown) + 1] += 1;
        }
        for rank in 0..size {
            next[rank + 1] += next[rank];
        }
        let mut numbers = Vec::with_capacity(n);
        let mut touched = vec![false; n];
        for row in 0..n {
            touched[row] |= !pattern.row(row).is_empty();
            pattern.row(row).iter().for_each(|&column| touched[column as usize] = true);
        }
        let (mut own, mut by_owner) = (Vec::new(), vec![Vec::new(); size]);
        for unknown in 0..n {
            let rank = owner(unknown);
            numbers.push(next[rank]);
            next[rank] += 1;
            if rank == ranks.rank() {
                own.push(unknown as u32);
            } else if touched[unknown] {
                by_owner[rank].push(unknown as u32);
            }
        }
        let borrowed_from: Vec<usize> = by_owner.iter().map(Vec::len).collect();
        let borrowed = by_owner.concat();
        let told = ranks.gather(&borrowed.iter().flat_map(|unknown| unknown.to_le_bytes()).collect::<Vec<u8>>());
        let (mut lent, mut lent_to) = (Vec::new(), Vec::new());
        for bytes in told {
            let before = lent.len();
            let unknowns = bytes.as_chunks::<4>().0.iter().map(|bytes| u32::from_le_bytes(*bytes));
            let here = unknowns.filter(|&unknown| owner(unknown as usize) == ranks.rank());
            lent.extend(here.map(|unknown| own.binary_search(&unknown).expect("owners are those of own") as u32));
            lent_to.push(lent.len() - before);
        }
        Self { n, shared: Some(Shared { own, numbers, lent, lent_to, borrowed, borrowed_from }) }
    }

    /// Unknowns of this rank.
    pub fn own(&self) -> usize {
        self.shared.as_ref().map_or(self.n, |shared| shared.own.len())
    }

    /// The unknown that an entry of an own vector belongs to.
    pub fn unknown(&self, entry: usize) -> usize {
        self.shared.as_ref().map_or(entry, |shared| shared.own[entry] as usize)
    }

    /// The entry of own vectors that belongs to an unknown of this rank; `None` for unknowns of
    /// other ranks.
    pub fn entry(&self, unknown: usize) -> Option<usize> {
        match &self.shared {
            Some(shared) => shared.own.binary_search(&(unknown as u32)).ok(),
            None => Some(unknown),
        }
    }

    /// Number of an unknown if the unknowns are counted rank by rank.
    pub fn number(&self, unknown: usize) -> usize {
        self.shared.as_ref().map_or(unknown, |shared| shared.numbers[unknown] as usize)
    }

    /// The own part of a whole vector, or of a local one.
    ///
    /// # Panics
    /// If the vector has the wrong length.
    pub fn restrict(&self, whole: &[f64]) -> Vec<f64> {
        assert_eq!(whole.len(), self.n, "a whole vector has one entry per unknown");
        match &self.shared {
            Some(shared) => shared.own.iter().map(|&unknown| whole[unknown as usize]).collect(),
            None => whole.to_vec(),
        }
    }

    /// The whole vector from the own parts of all ranks.
    ///
    /// # Panics
    /// If the parts have wrong lengths.
    pub fn join(&self, own: &[f64], ranks: &dyn Ranks) -> Vec<f64> {
        let Some(shared) = &self.shared else { return own.to_vec() };
        let all = ranks.join(own);
        assert_eq!(all.len(), self.n, "the parts of a vector have one entry per unknown");
        shared.numbers.iter().map(|&number| all[number as usize]).collect()
    }

    /// The local vector of an own one: with the entries that this rank borrows.
    ///
    /// # Panics
    /// If the length is not that of the own unknowns.
    pub fn spread(&self, own: &[f64], ranks: &dyn Ranks) -> Vec<f64> {
        let Some(shared) = &self.shared else { return own.to_vec() };
        let mut local = vec![0.0; self.n];
        assert_eq!(own.len(), shared.own.len(), "an own vector has one entry per unknown of the rank");
        shared.own.iter().zip(own).for_each(|(&unknown, value)| local[unknown as usize] = *value);
        let lent: Vec<f64> = shared.lent.iter().map(|&entry| own[entry as usize]).collect();
        let borrowed = ranks.exchange(&lent, &shared.lent_to, &shared.borrowed_from);
        shared.borrowed.iter().zip(borrowed).for_each(|(&unknown, value)| local[unknown as usize] = value);
        local
    }

    /// The own part of the sum of local vectors: each rank's terms are sent to the owners, who add
    /// them to their own in the order of ranks.
    ///
    /// # Panics
    /// If the vector has the wrong length.
    pub fn collect(&self, local: &[f64], ranks: &dyn Ranks) -> Vec<f64> {
        let mut own = self.restrict(local);
        if let Some(shared) = &self.shared {
            let terms: Vec<f64> = shared.borrowed.iter().map(|&unknown| local[unknown as usize]).collect();
            let lent = ranks.exchange(&terms, &shared.borrowed_from, &shared.lent_to);
            shared.lent.iter().zip(lent).for_each(|(&entry, term)| own[entry as usize] += term);
        }
        own
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The second of three ranks; the unknowns that the others borrow are given by hand.
    #[derive(Debug)]
    struct SecondOfThree;

    impl Ranks for SecondOfThree {
        fn rank(&self) -> usize {
            1
        }
        fn size(&self) -> usize {
            3
        }
        fn sum(&self, _: &mut [f64]) {}
        fn any(&self, here: bool) -> bool {
            here
        }
        fn gather(&self, message: &[u8]) -> Vec<Vec<u8>> {
            let told = |unknowns: &[u32]| unknowns.iter().flat_map(|unknown| unknown.to_le_bytes()).collect();
            vec![told(&[0, 4, 2]), message.to_vec(), told(&[3, 4])]
        }
        /// The lent values come back, with ten times the rank in place of data from the others.
        fn exchange(&self, values: &[f64], to: &[usize], from: &[usize]) -> Vec<f64> {
            assert_eq!(values.len(), to.iter().sum::<usize>());
            from.iter().enumerate().flat_map(|(rank, &count)| vec![10.0 * (rank + 1) as f64; count]).collect()
        }
        fn join(&self, values: &[f64]) -> Vec<f64> {
            [&[1.5, 1.6], values, &[3.5]].concat()
        }
    }

    /// By hand: ranks 0, 1, 2 own the unknowns {1, 5}, {0, 3, 4}, {2}; the part of rank 1 touches
    /// 0, 2, 4 and 5.
    fn example() -> Layout {
        let (offsets, groups) = (vec![0, 1, 1, 3, 3, 3, 3], vec![7, 2, 4, 7, 7, 99]);
        let pattern = CsrPattern::new(offsets, vec![5, 0, 4], groups, vec![]).unwrap();
        Layout::new(&pattern, &[9, 9, 0, 9, 2, 9, 9, 1], &SecondOfThree)
    }

    #[test]
    fn unknowns_are_numbered_through_the_ranks() {
        let layout = example();
        assert_eq!((0..6).map(|unknown| layout.number(unknown)).collect::<Vec<_>>(), [2, 0, 5, 3, 4, 1]);
        assert_eq!(layout.own(), 3);
        assert_eq!((0..3).map(|entry| layout.unknown(entry)).collect::<Vec<_>>(), [0, 3, 4]);
        assert_eq!((layout.entry(4), layout.entry(2)), (Some(2), None));
    }

    #[test]
    fn vectors_change_their_form() {
        let layout = example();
        assert_eq!(layout.restrict(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]), [1.0, 4.0, 5.0]);
        assert_eq!(layout.join(&[2.5, 2.6, 2.7], &SecondOfThree), [2.5, 1.5, 3.5, 2.6, 2.7, 1.6]);
        // 5 is borrowed from rank 0, 2 from rank 2; 1 is neither owned nor touched
        assert_eq!(layout.spread(&[1.0, 4.0, 5.0], &SecondOfThree), [1.0, 0.0, 30.0, 4.0, 5.0, 10.0]);
        // rank 0 borrows 0 and 4, rank 2 borrows 3 and 4
        assert_eq!(layout.collect(&[1.0, 9.0, 3.0, 4.0, 5.0, 6.0], &SecondOfThree), [11.0, 34.0, 45.0]);
    }

    #[test]
    fn one_rank_has_all() {
        let layout = Layout::whole(3);
        let x = [1.0, 2.0, 3.0];
        assert_eq!((layout.own(), layout.number(2), layout.entry(1)), (3, 2, Some(1)));
        let alone = &slipstick_ranks::Alone;
        assert_eq!(layout.collect(&layout.spread(&layout.restrict(&x), alone), alone), x);
        assert_eq!(layout.join(&x, alone), x);
    }
}

//! Which rank owns which unknowns, and their numbers in PETSc.

use slipstick_linalg::{CsrPattern, Ranks};

/// Unknowns of the ranks. PETSc numbers those of the first rank first, then those of the next.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ownership {
    /// PETSc's number of every unknown.
    numbers: Vec<i32>,
    /// Unknowns of this rank, ascending: in PETSc's order.
    own: Vec<u32>,
}

impl Ownership {
    /// By the elimination groups of a pattern: `owners` has the rank of each group. Unknowns of groups beyond are the
    /// first rank's.
    pub fn new(pattern: &CsrPattern, owners: &[u32], ranks: &dyn Ranks) -> Self {
        let last = ranks.size() as u32 - 1;
        let owner = |group: u32| owners.get(group as usize).map_or(0, |&rank| rank.min(last)) as usize;
        let mut next = vec![0_i32; ranks.size() + 1];
        for &group in &pattern.groups {
            next[owner(group) + 1] += 1;
        }
        for rank in 0..ranks.size() {
            next[rank + 1] += next[rank];
        }
        let mut numbers = vec![0; pattern.n];
        let mut own = Vec::new();
        for (unknown, &group) in (0_u32..).zip(&pattern.groups) {
            let rank = owner(group);
            numbers[unknown as usize] = next[rank];
            next[rank] += 1;
            if rank == ranks.rank() {
                own.push(unknown);
            }
        }
        Self { numbers, own }
    }

    /// Unknowns of this rank, ascending.
    pub fn own(&self) -> &[u32] {
        &self.own
    }

    /// Rows and columns of all entries of the part of this rank, in PETSc's numbers.
    pub fn places(&self, pattern: &CsrPattern) -> (Vec<i32>, Vec<i32>) {
        let mut rows = Vec::with_capacity(pattern.entries());
        for (row, window) in pattern.row_offsets.windows(2).enumerate() {
            rows.resize(window[1], self.numbers[row]);
        }
        (rows, pattern.columns.iter().map(|&column| self.numbers[column as usize]).collect())
    }

    /// The entries of this rank of a vector.
    pub fn restrict(&self, whole: &[f64]) -> Vec<f64> {
        self.own.iter().map(|&i| whole[i as usize]).collect()
    }

    /// The vector whose part on each rank is `own`.
    pub fn join(&self, own: &[f64], whole: &mut [f64], ranks: &dyn Ranks) {
        // every entry has one owner: the sum copies it
        whole.fill(0.0);
        for (&i, value) in self.own.iter().zip(own) {
            whole[i as usize] = *value;
        }
        ranks.sum(whole);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
            vec![message.to_vec()]
        }
    }

    /// Numbers by hand: ranks 0, 1, 2 own the unknowns {1, 5}, {0, 3, 4}, {2}.
    #[test]
    fn numbers_run_through_the_ranks() {
        let pattern = CsrPattern {
            n: 6,
            row_offsets: vec![0, 1, 1, 3, 3, 3, 3],
            columns: vec![5, 0, 4],
            groups: vec![7, 2, 4, 7, 7, 99],
            origins: Vec::new(),
        };
        let owners = [9, 9, 0, 9, 2, 9, 9, 1];
        let ownership = Ownership::new(&pattern, &owners, &SecondOfThree);
        assert_eq!(ownership.own(), [0, 3, 4]);
        assert_eq!(ownership.numbers, [2, 0, 5, 3, 4, 1]);
        assert_eq!(ownership.places(&pattern), (vec![2, 5, 5], vec![1, 2, 4]));
        assert_eq!(ownership.restrict(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]), [1.0, 4.0, 5.0]);
        let mut whole = [9.0; 6];
        ownership.join(&[1.0, 4.0, 5.0], &mut whole, &SecondOfThree);
        assert_eq!(whole, [1.0, 0.0, 0.0, 4.0, 5.0, 0.0]);
    }
}

//! Which part of a list of elements or variables a rank works on.

use slipstick_linalg::Ranks;
use std::ops::Range;

/// The entries of a list of `count` that are this rank's: each rank's follow those of the rank before, in about equal shares.
/// [`Ranks::join`] puts the shares together again.
///
/// ```
/// use slipstick_design::share::own_range;
/// use slipstick_linalg::Alone;
///
/// assert_eq!(own_range(7, &Alone), 0..7);
/// ```
pub fn own_range(count: usize, ranks: &dyn Ranks) -> Range<usize> {
    let (rank, size) = (ranks.rank(), ranks.size());
    count * rank / size..count * (rank + 1) / size
}

/// Several threads that act as ranks, for tests.
#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use std::sync::{Barrier, Mutex};

    /// What ranks on threads have said, one place for each.
    #[derive(Debug)]
    pub(crate) struct Table {
        said: Mutex<Vec<Vec<f64>>>,
        barrier: Barrier,
    }

    /// One of these ranks.
    #[derive(Debug)]
    pub(crate) struct ThreadRank {
        rank: usize,
        table: std::sync::Arc<Table>,
    }

    impl ThreadRank {
        fn tell(&self, values: &[f64]) -> Vec<Vec<f64>> {
            self.table.said.lock().unwrap()[self.rank] = values.to_vec();
            self.table.barrier.wait();
            let all = self.table.said.lock().unwrap().clone();
            self.table.barrier.wait();
            all
        }
    }

    impl Ranks for ThreadRank {
        fn rank(&self) -> usize {
            self.rank
        }
        fn size(&self) -> usize {
            self.table.said.lock().unwrap().len()
        }
        fn sum(&self, values: &mut [f64]) {
            let all = self.tell(values);
            for (i, value) in values.iter_mut().enumerate() {
                *value = all.iter().map(|of_rank| of_rank[i]).sum();
            }
        }
        fn any(&self, here: bool) -> bool {
            self.tell(&[f64::from(u8::from(here))]).concat().contains(&1.0)
        }
        fn gather(&self, _: &[u8]) -> Vec<Vec<u8>> {
            unreachable!("nothing here gathers bytes")
        }
        fn exchange(&self, _: &[f64], _: &[usize], _: &[usize]) -> Vec<f64> {
            unreachable!("nothing here is exchanged")
        }
        fn join(&self, values: &[f64]) -> Vec<f64> {
            self.tell(values).concat()
        }
    }

    /// What `run` returns on each of so many ranks.
    pub(crate) fn on_ranks<T: Send>(size: usize, run: impl Fn(ThreadRank) -> T + Sync) -> Vec<T> {
        let table =
            std::sync::Arc::new(Table { said: Mutex::new(vec![Vec::new(); size]), barrier: Barrier::new(size) });
        std::thread::scope(|scope| {
            let start = |rank| {
                let (run, table) = (&run, table.clone());
                scope.spawn(move || run(ThreadRank { rank, table }))
            };
            let all: Vec<_> = (0..size).map(start).collect();
            all.into_iter().map(|thread| thread.join().unwrap()).collect()
        })
    }

    #[test]
    fn shares_make_up_the_whole() {
        for (count, size) in [(0, 3), (2, 3), (10, 4), (11, 1)] {
            let ranges = on_ranks(size, |rank| own_range(count, &rank));
            assert!(ranges.into_iter().flatten().eq(0..count));
        }
    }
}

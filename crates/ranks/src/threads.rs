//! Threads of one process that act as the ranks of a run, for tests.

use crate::Ranks;
use std::sync::{Arc, Barrier, Mutex};

/// The messages of the ranks, one entry for each.
#[derive(Debug)]
struct Table {
    said: Mutex<Vec<Vec<f64>>>,
    barrier: Barrier,
}

/// One of the ranks.
#[derive(Debug, Clone)]
pub struct ThreadRank {
    rank: usize,
    size: usize,
    table: Arc<Table>,
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
        self.size
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

    fn gather(&self, message: &[u8]) -> Vec<Vec<u8>> {
        let bytes: Vec<f64> = message.iter().map(|&byte| f64::from(byte)).collect();
        self.tell(&bytes).iter().map(|told| told.iter().map(|&byte| byte as u8).collect()).collect()
    }

    fn exchange(&self, values: &[f64], to: &[usize], from: &[usize]) -> Vec<f64> {
        assert_eq!(values.len(), to.iter().sum::<usize>());
        let counts: Vec<f64> = to.iter().map(|&count| count as f64).collect();
        let (counts, values) = (self.tell(&counts), self.tell(values));
        let parts = counts.iter().zip(&values).zip(from).map(|((counts, values), &expected)| {
            let begin = counts[..self.rank].iter().sum::<f64>() as usize;
            let part = &values[begin..begin + counts[self.rank] as usize];
            assert_eq!(part.len(), expected, "the number of values sent is the number expected");
            part.to_vec()
        });
        parts.collect::<Vec<_>>().concat()
    }

    fn join(&self, values: &[f64]) -> Vec<f64> {
        self.tell(values).concat()
    }
}

/// The results of `run` on each of `size` ranks.
pub fn on_ranks<T: Send>(size: usize, run: impl Fn(ThreadRank) -> T + Sync) -> Vec<T> {
    let table = Arc::new(Table { said: Mutex::new(vec![Vec::new(); size]), barrier: Barrier::new(size) });
    std::thread::scope(|scope| {
        let start = |rank| {
            let (run, table) = (&run, table.clone());
            scope.spawn(move || run(ThreadRank { rank, size, table }))
        };
        let all: Vec<_> = (0..size).map(start).collect();
        all.into_iter().map(|thread| thread.join().unwrap()).collect()
    })
}

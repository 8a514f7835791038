//! Reusable memory for the contributions.
//!
//! Each front near the root requests and returns megabytes. Fresh pages from the system cost more
//! time than clearing old ones, especially with several threads.

use super::scalar::Scalar;
use std::sync::Mutex;

/// Number of entries below which the allocator is just as good.
const WORTH_KEEPING: usize = 16_384;

/// Maximum number of buffers kept. A traversal in postorder needs few.
const KEPT: usize = 2;

/// Buffers that were returned and can be reused.
pub(super) struct Buffers<T> {
    free: Mutex<Vec<Vec<T>>>,
}

impl<T: Scalar> Buffers<T> {
    pub fn new() -> Self {
        Self { free: Mutex::new(Vec::new()) }
    }

    /// Zeros: in the smallest free buffer of at least this length and at most twice this length,
    /// otherwise in new memory.
    pub fn zeros(&self, length: usize) -> Vec<T> {
        let mut buffer = self.reuse(length).unwrap_or_default();
        buffer.clear();
        extend(&mut buffer, length);
        buffer
    }

    /// The same with zeros only on and below the diagonal of a square matrix with this number of rows;
    /// entries above may be anything.
    pub fn zeros_below(&self, rows: usize) -> Vec<T> {
        let mut buffer = self.reuse(rows * rows).unwrap_or_default();
        buffer.truncate(rows * rows);
        let written = buffer.len();
        extend(&mut buffer, rows * rows);
        for (j, column) in buffer[..written].chunks_mut(rows.max(1)).enumerate() {
            column.iter_mut().skip(j).for_each(|entry| *entry = T::ZERO);
        }
        buffer
    }

    fn reuse(&self, length: usize) -> Option<Vec<T>> {
        if length < WORTH_KEEPING {
            return None;
        }
        let mut free = self.lock();
        let fitting = free.iter().enumerate().filter(|(_, b)| (length..=2 * length).contains(&b.capacity()));
        let best = fitting.min_by_key(|(_, b)| b.capacity())?.0;
        Some(free.swap_remove(best))
    }

    /// Takes a buffer back; if there are too many, the smallest is dropped.
    pub fn put(&self, buffer: Vec<T>) {
        if buffer.capacity() < WORTH_KEEPING {
            return;
        }
        let mut free = self.lock();
        free.push(buffer);
        if free.len() > KEPT
            && let Some(smallest) = (0..free.len()).min_by_key(|&i| free[i].capacity())
        {
            free.swap_remove(smallest);
        }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<Vec<T>>> {
        self.free.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

/// Appends zeros. They are written immediately: memory that is read before it is written would be
/// mapped twice.
fn extend<T: Scalar>(buffer: &mut Vec<T>, length: usize) {
    buffer.reserve_exact(length - buffer.len());
    buffer.resize(length, T::ZERO);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The buffers contain zeros whatever was written to them, a fitting buffer is reused, and the
    /// smallest is dropped if there are too many.
    #[test]
    fn returned_buffers_are_cleared_and_used_again() {
        let buffers = Buffers::<f64>::new();
        let mut buffer = buffers.zeros(WORTH_KEEPING + 7);
        buffer.fill(3.0);
        let place = buffer.as_ptr();
        buffers.put(buffer);
        let small = buffers.zeros(WORTH_KEEPING / 2);
        assert_ne!(small.as_ptr(), place);
        let again = buffers.zeros(WORTH_KEEPING);
        assert_eq!(again.as_ptr(), place);
        assert_eq!(again, vec![0.0; WORTH_KEEPING]);
        buffers.put(vec![2.0; WORTH_KEEPING]);
        let (rows, mut lower) = (131, buffers.zeros_below(131));
        lower.iter_mut().enumerate().filter(|(k, _)| k % rows < k / rows).for_each(|(_, above)| *above = 0.0);
        assert_eq!(lower, vec![0.0; rows * rows]);
        for factor in 1..=KEPT + 1 {
            buffers.put(vec![1.0; factor * WORTH_KEEPING]);
        }
        let kept: Vec<usize> = buffers.lock().iter().map(Vec::len).collect();
        assert_eq!(kept.len(), KEPT);
        assert!(!kept.contains(&WORTH_KEEPING));
    }
}

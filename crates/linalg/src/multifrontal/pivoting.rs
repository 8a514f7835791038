//! Threshold pivoting with rejected columns, for fronts in which some pivot is too small.

use super::dense;
use super::dense::{View, ViewMut};
use super::scalar::Scalar;

/// Columns treated together before the rest of the front is updated.
const PANEL: usize = 32;

/// Fully summed columns of a front, including rows beyond, after the possible eliminations.
pub(super) struct PivotedColumns<T> {
    /// Column-major, all rows of the front: L below and U on and above the diagonal of the first
    /// `pivots` columns; the rest is updated but not eliminated.
    pub values: Vec<T>,
    /// Row of the given front at each of the fully summed rows.
    pub row_order: Vec<usize>,
    /// Column of the given front at each column.
    pub column_order: Vec<usize>,
    pub pivots: usize,
    /// Largest candidate in the first rejected column; zero if none was rejected.
    pub best_rejected: f64,
}

/// Eliminates fully summed columns with pivots from the fully summed rows.
///
/// A pivot must reach `threshold` times the largest entry of its column, including rows
/// beyond, and the smallest pivot of the format. Columns without a pivot are set aside and tried
/// again as long as other pivots have been found in the meantime.
pub(super) fn eliminate<T: Scalar>(values: Vec<T>, rows: usize, summed: usize, threshold: f64) -> PivotedColumns<T> {
    let mut state =
        State { values, rows, summed, row_order: (0..summed).collect(), column_order: (0..summed).collect() };
    let (mut pivots, mut untried, mut progress) = (0, summed, false);
    loop {
        if pivots == untried {
            if !progress || untried == summed {
                break;
            }
            (untried, progress) = (summed, false);
        }
        let end = untried.min(pivots + PANEL);
        let reached = state.panel(pivots, end, threshold);
        state.update_beyond(pivots, reached, end);
        state.set_aside(reached, end, untried);
        progress |= reached > pivots;
        untried -= end - reached;
        pivots = reached;
    }
    let best_rejected = if pivots < summed { state.candidate(pivots, pivots).1 } else { 0.0 };
    PivotedColumns {
        values: state.values,
        row_order: state.row_order,
        column_order: state.column_order,
        pivots,
        best_rejected,
    }
}

struct State<T> {
    values: Vec<T>,
    rows: usize,
    summed: usize,
    row_order: Vec<usize>,
    column_order: Vec<usize>,
}

impl<T: Scalar> State<T> {
    /// Row and size of the largest fully summed entry of a column at or below `from`, and the
    /// largest entry beyond the fully summed rows. A NaN counts as infinitely large beyond.
    fn candidate(&self, column: usize, from: usize) -> (usize, f64, f64) {
        let column = &self.values[column * self.rows..(column + 1) * self.rows];
        let (mut row, mut size) = (from, 0.0);
        for (i, value) in column[from..self.summed].iter().enumerate() {
            let absolute = value.absolute().to_f64();
            if absolute > size {
                (row, size) = (from + i, absolute);
            }
        }
        (row, size, dense::largest(&column[self.summed..]))
    }

    /// Eliminates within columns `start..end`; returns the end of the accepted columns. The
    /// rejected columns follow them, updated.
    fn panel(&mut self, start: usize, end: usize, threshold: f64) -> usize {
        let (mut k, mut last) = (start, end);
        while k < last {
            let (row, size, beyond) = self.candidate(k, k);
            let accepted = size >= T::SMALLEST_PIVOT && size >= threshold * beyond;
            if accepted && size.is_finite() {
                self.swap_rows(k, row);
                self.eliminate_column(k, end);
                k += 1;
            } else {
                last -= 1;
                self.swap_columns(k, last);
            }
        }
        k
    }

    /// Scales column `k` to multipliers and updates the columns up to `end`.
    fn eliminate_column(&mut self, k: usize, end: usize) {
        let rows = self.rows;
        let (head, tail) = self.values.split_at_mut((k + 1) * rows);
        let column = &mut head[k * rows + k..];
        let pivot = column[0];
        let multipliers = &mut column[1..];
        multipliers.iter_mut().for_each(|m| *m /= pivot);
        for other in tail[..(end - k - 1) * rows].chunks_exact_mut(rows) {
            let factor = other[k];
            if factor != T::ZERO {
                for (x, m) in other[k + 1..].iter_mut().zip(&*multipliers) {
                    *x -= *m * factor;
                }
            }
        }
    }

    /// Applies pivots `start..reached` to the columns from `end` on.
    fn update_beyond(&mut self, start: usize, reached: usize, end: usize) {
        let (rows, count) = (self.rows, reached - start);
        if count == 0 || end == self.summed {
            return;
        }
        let (head, tail) = self.values.split_at_mut(end * rows);
        let panel = View::new(head, rows, end);
        let panel = panel.block(start, start, rows - start, count);
        let rest = ViewMut::new(tail, rows, self.summed - end);
        let (mut upper, lower) = rest.split_rows(start).1.split_rows(count);
        dense::solve_unit_lower(panel.row_range(0, count), upper.borrow());
        dense::subtract_product(lower, panel.row_range(count, rows - reached), upper.read());
    }

    /// Moves the rejected columns `reached..end` behind the untried ones `end..untried`.
    fn set_aside(&mut self, reached: usize, end: usize, untried: usize) {
        let swaps = (end - reached).min(untried - end);
        for t in 0..swaps {
            self.swap_columns(reached + t, untried - 1 - t);
        }
    }

    fn swap_rows(&mut self, i: usize, j: usize) {
        if i != j {
            self.values.chunks_exact_mut(self.rows).for_each(|column| column.swap(i, j));
            self.row_order.swap(i, j);
        }
    }

    fn swap_columns(&mut self, i: usize, j: usize) {
        if i == j {
            return;
        }
        let (i, j) = (i.min(j), i.max(j));
        let (head, tail) = self.values.split_at_mut(j * self.rows);
        head[i * self.rows..(i + 1) * self.rows].swap_with_slice(&mut tail[..self.rows]);
        self.column_order.swap(i, j);
    }
}

#[cfg(test)]
mod tests {
    use super::super::PIVOT_THRESHOLD;
    use super::*;

    /// Column 0 has only zeros in the fully summed rows, and column 2 is dominated by a row beyond:
    /// both are set aside, and otherwise the factors reproduce the matrix.
    #[test]
    fn unacceptable_columns_are_set_aside() {
        let (rows, summed) = (5, 3);
        #[rustfmt::skip]
        let a: Vec<f64> = vec![
            0.0, 0.0, 0.0, 1.0, 0.0,
            2.0, 1.0, 3.0, 1.0, 0.5,
            0.0, 1e-3, 0.0, 4.0, 5.0,
        ];
        let p = eliminate(a.clone(), rows, summed, PIVOT_THRESHOLD);
        assert_eq!(p.pivots, 1);
        assert_eq!(p.column_order[0], 1);
        assert_eq!(p.row_order[0], 2);
        let multiplier = |i: usize| p.values[i];
        for c in 1..summed {
            let u = p.values[c * rows];
            for i in 1..rows {
                let source = if i < summed { p.row_order[i] } else { i };
                let restored = p.values[c * rows + i] + multiplier(i) * u;
                assert!((restored - a[p.column_order[c] * rows + source]).abs() < 1e-15);
            }
        }
    }

    /// A column that is unacceptable at first, but acceptable once its neighbour is eliminated.
    #[test]
    fn rejected_columns_are_tried_again() {
        let a = vec![0.0, 1e-20, 0.0, 1.0, 1.0, 0.0, 1.0, 0.0, 1.0];
        let mut third = a.clone();
        third[2] = 0.0;
        let p = eliminate(third, 3, 3, PIVOT_THRESHOLD);
        // Rank two: columns 1 and 2 are eliminated, the empty column remains.
        assert_eq!(p.pivots, 2);
        assert!(p.best_rejected < 1e-19);
        // [0 1; 1 0] pattern with a filled-in entry: regular after one elimination.
        let p = eliminate(vec![0.0, 1.0, 1.0, 0.0], 2, 2, PIVOT_THRESHOLD);
        assert_eq!(p.pivots, 2);
    }

    /// By definition: a pivot reaches a hundredth of the largest entry beyond, in any unit.
    #[test]
    fn pivots_reach_a_part_of_what_is_beyond() {
        for unit in [1e-6, 1.0, 1e6] {
            for (part, pivots) in [(1.01, 1), (0.99, 0), (50.0, 1)] {
                let pivot = -part * PIVOT_THRESHOLD * unit;
                let p = eliminate(vec![pivot, 0.3 * unit, -unit], 3, 1, PIVOT_THRESHOLD);
                assert_eq!(p.pivots, pivots, "{part} {unit}");
                if pivots == 1 {
                    assert_eq!(p.values, [pivot, 0.3 * unit / pivot, -unit / pivot]);
                }
            }
        }
    }
}

//! Equilibration of rows and columns by powers of two.

use crate::csr::CsrMatrix;
use rayon::prelude::*;

/// Rows per parallel task.
const ROWS_PER_TASK: usize = 8192;

/// Number of symmetric sweeps before the rows and then the columns are equilibrated at once.
const SWEEPS: usize = 3;

/// Range of sizes of rows and columns, as a factor in both directions, within which a scaling is
/// kept.
const LEVEL: f64 = 16.0;

/// Row and column factors that bring the largest entry of every row and column of
/// `diag(rows) A diag(columns)` close to one. Powers of two, so that scaling is free of rounding.
#[derive(Debug, Clone)]
pub(crate) struct Scaling {
    pub rows: Vec<f64>,
    pub columns: Vec<f64>,
}

impl Scaling {
    /// A few simultaneous sweeps in the maximum norm treat rows and columns alike; one pass over
    /// rows and one over columns then remove what remains due to widely spread entries.
    /// Reference: D. Ruiz, A scaling algorithm to equilibrate both rows and columns norms in
    /// matrices, RAL-TR-2001-034. Empty rows and columns keep the factor one.
    pub fn equilibrate(a: &CsrMatrix) -> Self {
        Self::equilibrate_by(a, |_| ())
    }

    /// The same for the sum of matrices on several ranks: `add` replaces the sizes of rows or
    /// columns, which are the largest entries of this rank's part, by their sums over the ranks.
    pub fn equilibrate_by(part: &CsrMatrix, add: impl Fn(&mut Vec<f64>)) -> Self {
        let n = part.n();
        let mut scaling = Self { rows: vec![1.0; n], columns: vec![1.0; n] };
        let largest = |scaling: &Self| {
            let (mut rows, mut columns) = scaling.largest_entries(part);
            add(&mut rows);
            add(&mut columns);
            (rows, columns)
        };
        for _ in 0..SWEEPS {
            let (rows, columns) = largest(&scaling);
            multiply(&mut scaling.rows, &rows, -0.5);
            multiply(&mut scaling.columns, &columns, -0.5);
        }
        let (rows, _) = largest(&scaling);
        multiply(&mut scaling.rows, &rows, -1.0);
        let (_, columns) = largest(&scaling);
        multiply(&mut scaling.columns, &columns, -1.0);
        scaling
    }

    /// The factors of the rows, or with `transpose` of the columns.
    pub fn of(self, transpose: bool) -> Vec<f64> {
        if transpose { self.columns } else { self.rows }
    }

    /// Adapts the scaling of an earlier matrix to `a`: keeps it if the rows and columns are still
    /// level, otherwise computes a new one.
    pub fn follow(earlier: Option<Self>, a: &CsrMatrix) -> Self {
        let still_fits = |scaling: &Self| {
            let (rows, columns) = scaling.largest_entries(a);
            rows.iter().chain(&columns).all(|&size| size == 0.0 || (1.0 / LEVEL..=LEVEL).contains(&size))
        };
        earlier
            .filter(|scaling| scaling.rows.len() == a.n() && still_fits(scaling))
            .unwrap_or_else(|| Self::equilibrate(a))
    }

    /// Largest absolute entry of each scaled row and column. Maxima do not depend on the order in
    /// which threads compute them.
    fn largest_entries(&self, a: &CsrMatrix) -> (Vec<f64>, Vec<f64>) {
        let n = a.n();
        let mut rows = vec![0.0f64; n];
        let columns = rows
            .par_chunks_mut(ROWS_PER_TASK)
            .enumerate()
            .fold(
                || vec![0.0f64; n],
                |mut columns, (task, rows)| {
                    for (k, row) in rows.iter_mut().enumerate() {
                        let i = task * ROWS_PER_TASK + k;
                        let (places, values) = a.row(i);
                        for (&j, value) in places.iter().zip(values) {
                            let j = j as usize;
                            let scaled = value.abs() * self.rows[i] * self.columns[j];
                            *row = row.max(scaled);
                            columns[j] = columns[j].max(scaled);
                        }
                    }
                    columns
                },
            )
            .reduce(
                || vec![0.0f64; n],
                |mut columns, other| {
                    columns.iter_mut().zip(other).for_each(|(c, o)| *c = c.max(o));
                    columns
                },
            );
        (rows, columns)
    }

    /// Entries of the scaled matrix, converted, in the order of the pattern.
    pub fn apply<T>(&self, a: &CsrMatrix, convert: impl Fn(f64) -> T) -> Vec<T> {
        let mut values = Vec::with_capacity(a.values.len());
        for i in 0..a.n() {
            let (columns, row) = a.row(i);
            let scaled =
                columns.iter().zip(row).map(|(&j, value)| convert(value * self.rows[i] * self.columns[j as usize]));
            values.extend(scaled);
        }
        values
    }
}

/// Multiplies each factor by the power of two next to `size^exponent`. Factors with a size of zero
/// are not changed, and all factors stay within 2^±400, so that neither they nor their products
/// overflow.
fn multiply(factors: &mut [f64], sizes: &[f64], exponent: f64) {
    for (factor, size) in factors.iter_mut().zip(sizes) {
        if *size > 0.0 && size.is_finite() {
            let power = factor.log2() + (exponent * size.log2()).round();
            *factor = power.clamp(-400.0, 400.0).exp2();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::csr::CsrPattern;
    use std::sync::Arc;

    /// A matrix that spans 24 decades: afterwards all row and column maxima are within [1/4, 4],
    /// and dividing the factors out restores the entries exactly.
    #[test]
    fn spans_of_many_decades_are_levelled_exactly() {
        let n = 12;
        let entry =
            |i: usize, j: usize| (1.0 + ((i * 7 + j * 3) % 5) as f64) * 10f64.powi(i as i32 * 2 - 12 + j as i32);
        let columns = (0..n * n).map(|k| (k % n) as u32).collect();
        let pattern = CsrPattern::new((0..=n).map(|i| i * n).collect(), columns, vec![0; n], vec![]).unwrap();
        let values: Vec<f64> = (0..n * n).map(|k| entry(k / n, k % n)).collect();
        let a = CsrMatrix { pattern: Arc::new(pattern), values };
        let scaling = Scaling::equilibrate(&a);
        let scaled = scaling.apply(&a, |x| x);
        for i in 0..n {
            let row = (0..n).map(|j| scaled[i * n + j].abs()).fold(0.0, f64::max);
            let column = (0..n).map(|j| scaled[j * n + i].abs()).fold(0.0, f64::max);
            assert!((0.25..=4.0).contains(&row) && (0.25..=4.0).contains(&column));
        }
        for (k, s) in scaled.iter().enumerate() {
            assert_eq!(s / (scaling.rows[k / n] * scaling.columns[k % n]), a.values[k]);
        }
    }

    /// By definition: an earlier scaling is kept, bit for bit, while the largest entries of rows
    /// and columns are between 1/16 and 16. Otherwise, the matrix is scaled again. Empty rows do
    /// not matter.
    #[test]
    fn a_scaling_is_kept_while_it_levels() {
        let matrix = |first: f64| {
            let pattern = CsrPattern::new(vec![0, 2, 3, 3], vec![0, 1, 1], vec![0; 3], vec![]).unwrap();
            CsrMatrix { pattern: Arc::new(pattern), values: vec![first, 0.5, 1.0] }
        };
        // all factors are one
        let earlier = Scaling { rows: vec![1.0; 3], columns: vec![1.0; 3] };
        for (first, kept) in [(1.0, true), (15.0, true), (1.0 / 15.0, true), (17.0, false), (1.0 / 17.0, false)] {
            let a = matrix(first);
            let found = Scaling::follow(Some(earlier.clone()), &a);
            let expected = if kept { earlier.clone() } else { Scaling::equilibrate(&a) };
            assert_eq!((&found.rows, &found.columns), (&expected.rows, &expected.columns), "{first}");
            assert_eq!(found.rows == earlier.rows && found.columns == earlier.columns, kept, "{first}");
        }
        let other = Scaling { rows: vec![1.0; 2], columns: vec![1.0; 2] };
        assert_eq!(Scaling::follow(Some(other), &matrix(1.0)).rows.len(), 3);
    }
}

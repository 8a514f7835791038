//! Equilibration of rows and columns by powers of two.

use crate::csr::CsrMatrix;
use rayon::prelude::*;

/// Rows per parallel task.
const ROWS_PER_TASK: usize = 8192;

/// Number of sweeps that treat rows and columns alike, before the rows and then the columns are
/// equilibrated at once.
const SWEEPS: usize = 3;

/// Part of the unknowns whose rows and columns may be out of level before the matrix is scaled from the
/// beginning.
const MOST_OUT_OF_LEVEL: f64 = 0.1;

/// Largest ratio of an entry to the geometric mean of its two diagonal entries for which these two
/// unknowns may share factors; 1 for a positive definite matrix.
const LARGEST_COUPLING: f64 = 4.0;

/// Largest ratio between the couplings of a multiplier with displacements that are scaled by their
/// diagonal entries. It is some hundred times that of a soft void next to steel.
const LARGEST_SPREAD: f64 = 1e5;

/// Least ratio of an entry to the geometric mean of its two diagonal entries that counts as a coupling.
const LEAST_COUPLING: f64 = 1e-3;

/// Range of sizes of rows and columns, as a factor in both directions, within which a scaling is
/// kept.
const LEVEL: f64 = 16.0;

/// Row and column factors that bring the largest entry of every row and column of
/// `diag(rows) A diag(columns)` close to one. Powers of two, so that scaling is free of rounding.
#[derive(Debug, Clone)]
pub struct Scaling {
    /// The factors of the rows.
    pub rows: Vec<f64>,
    /// The factors of the columns.
    pub columns: Vec<f64>,
    /// Unknowns whose row and column have the same factor, so that a symmetric part of the matrix
    /// stays symmetric. Of their row and their column, only the larger is close to one.
    shared: Vec<bool>,
}

impl Scaling {
    /// Row and column of an unknown share their factor, which brings the diagonal entry close to one,
    /// if no entry is much larger than the geometric mean of its two diagonal entries, and if the
    /// unknown is not a multiplier. For the others, simultaneous sweeps in the maximum norm treat rows
    /// and columns alike; one pass over rows and one over columns then remove what remains due to
    /// widely spread entries.
    /// References: D. Ruiz, A scaling algorithm to equilibrate both rows and columns norms in
    /// matrices, RAL-TR-2001-034; A. van der Sluis, Numer. Math. 14 (1969) for the diagonal. Empty rows
    /// and columns keep the factor one.
    pub fn equilibrate(a: &CsrMatrix) -> Self {
        let is_multiplier = a.pattern.multipliers();
        let diagonal = |i: usize| {
            let (places, values) = a.row(i);
            let at = places.binary_search(&(i as u32)).ok().filter(|_| !is_multiplier[i]);
            at.map_or(0.0, |k| values[k].abs())
        };
        let diagonals: Vec<f64> = (0..a.n()).map(diagonal).collect();
        let roots: Vec<f64> = diagonals.iter().map(|d| d.sqrt()).collect();
        let mut shared: Vec<bool> = diagonals.iter().map(|d| *d > 0.0 && d.is_finite()).collect();
        for i in (0..a.n()).filter(|&i| roots[i] > 0.0) {
            let (places, values) = a.row(i);
            for (&j, value) in places.iter().zip(values) {
                let bound = LARGEST_COUPLING * roots[i] * roots[j as usize];
                if bound > 0.0 && value.abs() > bound {
                    (shared[i], shared[j as usize]) = (false, false);
                }
            }
        }
        for i in outweighed(a, &roots) {
            shared[i] = false;
        }
        let of_shared: Vec<f64> = diagonals.iter().zip(&shared).map(|(d, s)| if *s { *d } else { 0.0 }).collect();
        let mut factors = vec![1.0; a.n()];
        multiply(&mut factors, &of_shared, -0.5);
        let mut scaling = Self { rows: factors.clone(), columns: factors, shared };
        scaling.level_within(SWEEPS, None, a);
        scaling
    }

    /// The same for the sum of matrices on several ranks, without shared factors: `add` replaces the
    /// sizes of rows or columns, which are the largest entries of this rank's part, by their sums
    /// over the ranks.
    pub fn equilibrate_by(part: &CsrMatrix, add: impl Fn(&mut Vec<f64>)) -> Self {
        let ones = vec![1.0; part.n()];
        let mut scaling = Self { rows: ones.clone(), columns: ones, shared: vec![false; part.n()] };
        scaling.level(SWEEPS, None, |scaling| {
            let (mut rows, mut columns) = scaling.largest_entries(part, &every_row(part));
            add(&mut rows);
            add(&mut columns);
            (rows, columns)
        });
        scaling
    }

    /// Levels the rows and columns of `a` that do not share factors. Sizes that are `known` are not
    /// computed.
    fn level_within(&mut self, sweeps: usize, known: Option<(Vec<f64>, Vec<f64>)>, a: &CsrMatrix) {
        let counts = |&i: &u32| {
            let alone = |j: u32| !self.shared[j as usize];
            alone(i) || a.row(i as usize).0.iter().any(|&j| alone(j))
        };
        let rows: Vec<u32> = every_row(a).into_iter().filter(counts).collect();
        self.level(sweeps, known, |scaling| scaling.largest_entries(a, &rows));
    }

    /// Levels rows and columns that do not share factors, whose sizes `largest` returns; sizes of the
    /// others are ignored. Sizes that are `known` are not computed.
    fn level(
        &mut self,
        sweeps: usize,
        mut known: Option<(Vec<f64>, Vec<f64>)>,
        largest: impl Fn(&Self) -> (Vec<f64>, Vec<f64>),
    ) {
        if self.shared.iter().all(|shared| *shared) {
            return;
        }
        let alone = |sizes: Vec<f64>, shared: &[bool]| -> Vec<f64> {
            sizes.into_iter().zip(shared).map(|(size, shared)| if *shared { 0.0 } else { size }).collect()
        };
        for _ in 0..sweeps {
            let (rows, columns) = known.take().unwrap_or_else(|| largest(self));
            multiply(&mut self.rows, &alone(rows, &self.shared), -0.5);
            multiply(&mut self.columns, &alone(columns, &self.shared), -0.5);
        }
        let (rows, _) = largest(self);
        multiply(&mut self.rows, &alone(rows, &self.shared), -1.0);
        let (_, columns) = largest(self);
        multiply(&mut self.columns, &alone(columns, &self.shared), -1.0);
    }

    /// Replaces the sizes of rows and columns that share a factor by the larger of the two.
    fn share(&self, rows: &mut [f64], columns: &mut [f64]) {
        for ((row, column), _) in rows.iter_mut().zip(columns).zip(&self.shared).filter(|(_, shared)| **shared) {
            let size = row.max(*column);
            (*row, *column) = (size, size);
        }
    }

    /// The factors of the rows, or with `transpose` of the columns.
    pub fn of(self, transpose: bool) -> Vec<f64> {
        if transpose { self.columns } else { self.rows }
    }

    /// Adapts the scaling of an earlier matrix to `a`: keeps it if the rows and columns are still
    /// level. If a few without shared factors are not, which happens to multipliers as contacts open
    /// and close, it continues from the earlier scaling; otherwise, it computes a new one.
    pub fn follow(earlier: Option<Self>, a: &CsrMatrix) -> Self {
        let Some(mut scaling) = earlier.filter(|scaling| scaling.rows.len() == a.n()) else {
            return Self::equilibrate(a);
        };
        let (mut rows, mut columns) = scaling.largest_entries(a, &every_row(a));
        scaling.share(&mut rows, &mut columns);
        let is_out = |size: f64| size != 0.0 && !(1.0 / LEVEL..=LEVEL).contains(&size);
        let out: Vec<usize> = (0..a.n()).filter(|&i| is_out(rows[i]) || is_out(columns[i])).collect();
        if out.is_empty() {
            return scaling;
        }
        if out.len() as f64 > MOST_OUT_OF_LEVEL * a.n() as f64 || out.iter().any(|&i| scaling.shared[i]) {
            return Self::equilibrate(a);
        }
        scaling.level_within(1, Some((rows, columns)), a);
        scaling
    }

    /// Largest absolute entry of each scaled row and column, among the entries in `rows`. Maxima do
    /// not depend on the order in which threads compute them.
    fn largest_entries(&self, a: &CsrMatrix, rows: &[u32]) -> (Vec<f64>, Vec<f64>) {
        let n = a.n();
        let mut sizes = vec![0.0f64; rows.len()];
        let columns = sizes
            .par_chunks_mut(ROWS_PER_TASK)
            .zip(rows.par_chunks(ROWS_PER_TASK))
            .fold(
                || vec![0.0f64; n],
                |mut columns, (sizes, rows)| {
                    for (size, &i) in sizes.iter_mut().zip(rows) {
                        let (places, values) = a.row(i as usize);
                        for (&j, value) in places.iter().zip(values) {
                            let j = j as usize;
                            let scaled = value.abs() * self.rows[i as usize] * self.columns[j];
                            *size = size.max(scaled);
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
        let mut of_rows = vec![0.0; n];
        rows.iter().zip(sizes).for_each(|(&i, size)| of_rows[i as usize] = size);
        (of_rows, columns)
    }

    /// Entries of the scaled matrix, converted, in the order of the pattern.
    pub fn apply<T: Copy + Send>(&self, a: &CsrMatrix, convert: impl Fn(f64) -> T + Sync) -> Vec<T> {
        let mut values = vec![convert(0.0); a.values.len()];
        let mut rest = values.as_mut_slice();
        let mut tasks = Vec::with_capacity(a.n().div_ceil(ROWS_PER_TASK));
        for first in (0..a.n()).step_by(ROWS_PER_TASK) {
            let rows = first..a.n().min(first + ROWS_PER_TASK);
            let entries = a.pattern.row_offsets()[rows.end] - a.pattern.row_offsets()[first];
            let (own, others) = rest.split_at_mut(entries);
            tasks.push((rows, own));
            rest = others;
        }
        tasks.into_par_iter().for_each(|(rows, mut values)| {
            for i in rows {
                let (columns, row) = a.row(i);
                let (scaled, others) = values.split_at_mut(row.len());
                for ((scaled, value), &j) in scaled.iter_mut().zip(row).zip(columns) {
                    *scaled = convert(value * self.rows[i] * self.columns[j as usize]);
                }
                values = others;
            }
        });
        values
    }
}

fn every_row(a: &CsrMatrix) -> Vec<u32> {
    (0..a.n() as u32).collect()
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

/// Displacements whose diagonal entry is so small that their scaled coupling with a multiplier
/// outweighs the others, and that do not couple with displacements of the usual size: for instance, a
/// rotation of a rigid body whose stiffness is only round-off. They would determine the scaling of
/// the multiplier.
fn outweighed(a: &CsrMatrix, roots: &[f64]) -> Vec<usize> {
    let is_multiplier = a.pattern.multipliers();
    let mut light = vec![false; a.n()];
    for i in (0..a.n()).filter(|&i| is_multiplier[i]) {
        let (places, values) = a.row(i);
        let couplings = places.iter().zip(values).filter(|(j, value)| roots[**j as usize] > 0.0 && **value != 0.0);
        let scaled: Vec<(usize, f64)> =
            couplings.map(|(&j, value)| (j as usize, value.abs() / roots[j as usize])).collect();
        let usual = scaled.iter().max_by(|x, y| roots[x.0].total_cmp(&roots[y.0])).map_or(0.0, |x| x.1);
        scaled.iter().filter(|x| x.1 > LARGEST_SPREAD * usual).for_each(|x| light[x.0] = true);
    }
    let held = |i: usize| {
        let (places, values) = a.row(i);
        let couples = |j: usize, value: f64| value.abs() > LEAST_COUPLING * roots[i] * roots[j];
        places
            .iter()
            .zip(values)
            .any(|(&j, &value)| roots[j as usize] > 0.0 && !light[j as usize] && couples(j as usize, value))
    };
    (0..a.n()).filter(|&i| light[i] && !held(i)).collect()
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

    /// A multiplier couples with an elastic displacement and with a rotation whose stiffness is only
    /// round-off. If the latter had the factor of its diagonal entry, 1e8, the scaled coupling with the
    /// former would be 1e-8, and the factorization would find the matrix singular.
    #[test]
    fn stiffness_of_round_off_gives_no_factor() {
        let pattern = CsrPattern::new(vec![0, 2, 4, 7], vec![0, 2, 1, 2, 0, 1, 2], vec![0, 1, 0], vec![]).unwrap();
        let a = CsrMatrix { pattern: Arc::new(pattern), values: vec![1.0, 1.0, 1e-16, 1.0, 1.0, 1.0, 0.0] };
        let scaling = Scaling::equilibrate(&a);
        assert_eq!(scaling.shared, [true, false, false]);
        let scaled = scaling.apply(&a, |x| x);
        for coupling in [1, 3, 4, 5] {
            assert!((0.25..=4.0).contains(&scaled[coupling]), "{scaled:?}");
        }
    }

    /// If a few multipliers leave the level, only their factors change. If a shared factor no longer
    /// fits, the matrix is scaled from the beginning.
    #[test]
    fn a_scaling_is_continued() {
        let n = 40;
        let matrix = |multiplier: f64, diagonal: f64| {
            let rows: Vec<Vec<u32>> = (0..n).map(|i| if i == 39 { vec![0, 39] } else { vec![i] }).collect();
            let offsets = rows.iter().scan(0, |sum, row| {
                *sum += row.len();
                Some(*sum)
            });
            let offsets = std::iter::once(0).chain(offsets).collect();
            // the last unknown is a multiplier of the first group
            let groups = (0..n).map(|i| if i == 39 { 0 } else { i }).collect();
            let pattern = CsrPattern::new(offsets, rows.concat(), groups, vec![]).unwrap();
            let mut values = vec![1.0; n as usize];
            values[5] = diagonal;
            values.extend([1.0]);
            values[39] = multiplier;
            CsrMatrix { pattern: Arc::new(pattern), values }
        };
        let first = Scaling::equilibrate(&matrix(1.0, 1.0));
        let next = Scaling::follow(Some(first.clone()), &matrix(1e6, 1.0));
        assert_eq!(next.rows[..39], first.rows[..39]);
        let (rows, columns) = next.largest_entries(&matrix(1e6, 1.0), &[39]);
        assert!([rows[39], columns[39]].iter().all(|size| (0.25..=4.0).contains(size)), "{rows:?}, {columns:?}");
        let other = matrix(1.0, 1e6);
        let again = Scaling::follow(Some(first), &other);
        assert_eq!(again.rows, Scaling::equilibrate(&other).rows);
        assert_eq!(again.rows[5], again.columns[5]);
    }

    /// A symmetric matrix with diagonal entries over 24 decades, bordered by a multiplier in another
    /// unit: the scaled matrix is symmetric without the multiplier, the larger of a row's and a
    /// column's largest entries is within [1/4, 4], and the factors of the multiplier differ.
    #[test]
    fn symmetric_parts_stay_symmetric() {
        let n = 9;
        let entry = |i: usize, j: usize| match (i < 8, j < 8) {
            (true, true) => 10f64.powf(1.5 * (i + j) as f64) * if i == j { 1.0 } else { 0.3 },
            (true, false) => 1e-7 * (1 + i) as f64,
            (false, true) => 1e9 * (2 + j) as f64,
            (false, false) => 0.0,
        };
        let columns = (0..n * n).map(|k| (k % n) as u32).collect();
        let groups = vec![0, 0, 0, 1, 1, 1, 2, 2, 0];
        let pattern = CsrPattern::new((0..=n).map(|i| i * n).collect(), columns, groups, vec![]).unwrap();
        let a = CsrMatrix { pattern: Arc::new(pattern), values: (0..n * n).map(|k| entry(k / n, k % n)).collect() };
        let scaling = Scaling::equilibrate(&a);
        let scaled = scaling.apply(&a, |x| x);
        for i in 0..n {
            let largest = (0..n).map(|j| scaled[i * n + j].abs().max(scaled[j * n + i].abs())).fold(0.0, f64::max);
            assert!((0.25..=4.0).contains(&largest), "{i}: {largest}");
            assert_eq!(scaling.rows[i] == scaling.columns[i], i < 8);
            (0..8).filter(|_| i < 8).for_each(|j| assert_eq!(scaled[i * n + j], scaled[j * n + i]));
        }
    }

    /// Rows in which all unknowns share their factors are not read. By definition, this changes nothing.
    #[test]
    fn rows_of_shared_factors_do_not_matter() {
        let n = 30;
        let near = |i: u32| i.saturating_sub(2)..(i + 3).min(n);
        let columns: Vec<u32> = (0..n).flat_map(near).collect();
        let offsets = (0..=n).map(|i| (0..i).flat_map(near).count()).collect();
        let pattern = CsrPattern::new(offsets, columns, (0..n).collect(), vec![]).unwrap();
        let values = (0..pattern.entries()).map(|k| 10f64.powf(4.0 * (k as f64 * k as f64 * 0.618).sin())).collect();
        let a = CsrMatrix { pattern: Arc::new(pattern), values };
        let factors = vec![1.0; n as usize];
        let shared = (0..n).map(|i| !(i == 3 || (12..15).contains(&i) || i == 29)).collect();
        let start = Scaling { rows: factors.clone(), columns: factors, shared };
        let (mut some, mut all) = (start.clone(), start.clone());
        some.level_within(SWEEPS, None, &a);
        all.level(SWEEPS, None, |scaling| scaling.largest_entries(&a, &every_row(&a)));
        assert_eq!((&some.rows, &some.columns), (&all.rows, &all.columns));
        assert_ne!((&some.rows, &some.columns), (&start.rows, &start.columns));
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
        let earlier = Scaling { rows: vec![1.0; 3], columns: vec![1.0; 3], shared: vec![false; 3] };
        for (first, kept) in [(1.0, true), (15.0, true), (1.0 / 15.0, true), (17.0, false), (1.0 / 17.0, false)] {
            let a = matrix(first);
            let found = Scaling::follow(Some(earlier.clone()), &a);
            let expected = if kept { earlier.clone() } else { Scaling::equilibrate(&a) };
            assert_eq!((&found.rows, &found.columns), (&expected.rows, &expected.columns), "{first}");
            assert_eq!(found.rows == earlier.rows && found.columns == earlier.columns, kept, "{first}");
        }
        let other = Scaling { rows: vec![1.0; 2], columns: vec![1.0; 2], shared: vec![false; 2] };
        assert_eq!(Scaling::follow(Some(other), &matrix(1.0)).rows.len(), 3);
    }
}

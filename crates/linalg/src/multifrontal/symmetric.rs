//! Cholesky's method for symmetric fronts.
//!
//! Outside the contact zone the matrix is that of elastic bodies, which is symmetric, and positive
//! definite unless a body buckles:
//!
//! ```text
//!   F = [ F11   ·  ]    F11 = L11 L11ᵀ,  L21 = F21 L11⁻ᵀ,
//!       [ F21  F22 ]    contribution to the parent:  F22 − L21 L21ᵀ
//! ```
//!
//! This takes half of the operations and half of the memory of an LU factorization. Only entries on
//! and below the diagonal are assembled, in the order of the unknowns, which children and parents
//! share.

use super::buffers::Buffers;
use super::dense::{self, View, ViewMut};
use super::front::{
    Assembly, COLUMNS_PER_TASK, Child, Content, Contribution, Front, NONE, Rejected, Run, WORTH_SHARING, smallest,
};
use super::scalar::Scalar;
use super::symbolic::Entry;
use super::trapezoid::Trapezoid;
use rayon::prelude::*;

/// Largest accepted entry of L21; the scaled matrix has entries of about one.
const LARGEST: f64 = 10.0;

impl<T: Scalar> Assembly<'_, T> {
    /// Eliminates a symmetric front. Fails if F11 is not safely positive definite.
    pub fn eliminate_symmetric(&mut self, buffers: &Buffers<T>) -> Result<(Front<T>, Contribution<T>), Rejected> {
        let (p, r) = (self.rows.len(), self.beyond);
        let (mut lu, mut lower) = self.lower_triangle();
        let pivot = |lu: &[T], i: usize| lu[i + i * p].to_f64();
        let least = T::SMALLEST_PIVOT;
        if !(0..p).all(|i| pivot(&lu, i) >= least)
            || !dense::cholesky(ViewMut::new(&mut lu, p, p))
            || !(0..p).all(|i| pivot(&lu, i).powi(2) >= least)
        {
            return Err(Rejected);
        }
        let factor = View::new(&lu, p, p);
        dense::solve_upper_right(factor.transpose(), ViewMut::new(&mut lower, r, p));
        // written so that NaN fails
        let largest = dense::largest(&lower);
        if !(largest <= LARGEST) {
            return Err(Rejected);
        }
        let mut f22 = self.lower_triangle_beyond(buffers);
        let multipliers = View::new(&lower, r, p);
        dense::subtract_symmetric_product(ViewMut::new(&mut f22, r, r), multipliers);
        let growth = (0..p).map(|i| pivot(&lu, i)).fold(largest, f64::max);
        let front = Front {
            pivot_rows: self.rows.clone(),
            pivot_columns: self.columns.clone(),
            delayed_rows: Vec::new(),
            delayed_columns: Vec::new(),
            lower: Trapezoid::of_lower(&lu, &lower, p),
            upper: None,
            growth,
            smallest_pivot: smallest((0..p).map(|i| pivot(&lu, i).powi(2)), &self.columns),
        };
        let (delayed_rows, delayed_columns) = (Vec::new(), Vec::new());
        let contribution = Contribution { delayed_rows, delayed_columns, values: f22, content: Content::LowerTriangle };
        Ok((front, contribution))
    }

    /// F11, p × p, and F21, r × p, on and below the diagonal; entries above may be anything.
    fn lower_triangle(&self) -> (Vec<T>, Vec<T>) {
        let (p, r, own) = (self.rows.len(), self.beyond, self.own());
        let (mut f11, mut f21) = (vec![T::ZERO; p * p], vec![T::ZERO; r * p]);
        for &Entry { source, row, column, .. } in self.entries() {
            let (i, j) = (row as usize, column as usize);
            if j < own && i >= j {
                let entry = if i < own { &mut f11[i + j * p] } else { &mut f21[i - own + j * r] };
                *entry += self.values[source as usize];
            }
        }
        let mut beyond = f21.chunks_exact_mut(r.max(1));
        let columns = f11.chunks_exact_mut(p).enumerate();
        let columns = columns.map(|(j, summed)| (j, summed, beyond.next().unwrap_or_default()));
        self.add_below(columns.collect(), |child, j| child.summed_sources[j]);
        (f11, f21)
    }

    /// F22, r × r, on and below the diagonal. Releases the contributions of the children.
    fn lower_triangle_beyond(&mut self, buffers: &Buffers<T>) -> Vec<T> {
        let r = self.beyond;
        let mut f22 = buffers.zeros_below(r);
        let columns = f22.chunks_exact_mut(r.max(1)).enumerate();
        self.add_below(columns.map(|(j, beyond)| (j, [].as_mut_slice(), beyond)).collect(), |child, j| {
            child.beyond_sources[j]
        });
        self.children.drain(..).for_each(|child| buffers.put(child.contribution.values));
        f22
    }

    /// Adds the contributions on and below the diagonal to `columns`: number, fully summed rows, and
    /// rows beyond. `source` is the column of a child for the number of a column.
    fn add_below(&self, columns: Vec<(usize, &mut [T], &mut [T])>, source: impl Fn(&Child<T>, usize) -> u32 + Sync) {
        let add = |(j, summed, beyond): (usize, &mut [T], &mut [T])| {
            for child in &self.children {
                let column = source(child, j);
                if column != NONE {
                    child.add_below(column as usize, summed, beyond);
                }
            }
        };
        if self.children.iter().map(|child| child.contribution.values.len()).sum::<usize>() < WORTH_SHARING {
            columns.into_iter().for_each(add);
        } else {
            columns.into_par_iter().with_min_len(COLUMNS_PER_TASK).for_each(add);
        }
    }
}

impl<T: Scalar> Child<T> {
    /// Adds column `j`, from the diagonal down, to the fully summed rows and the rows beyond of a
    /// column of the parent.
    #[inline]
    fn add_below(&self, j: usize, summed: &mut [T], beyond: &mut [T]) {
        let column = &self.contribution.values[j * self.size..(j + 1) * self.size];
        let (of_summed, of_beyond) = column.split_at(self.summed);
        if j < self.summed {
            add_runs_from(&self.summed_runs, j, of_summed, summed);
        }
        add_runs_from(&self.beyond_runs, j.saturating_sub(self.summed), of_beyond, beyond);
    }
}

/// Adds the entries from `first` on.
#[inline]
fn add_runs_from<T: Scalar>(runs: &[Run], first: usize, values: &[T], target: &mut [T]) {
    for run in runs {
        let above = first.saturating_sub(run.from).min(run.length);
        let target = &mut target[run.to + above..run.to + run.length];
        let values = &values[run.from + above..run.from + run.length];
        target.iter_mut().zip(values).for_each(|(entry, value)| *entry += *value);
    }
}

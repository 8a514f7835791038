//! Assembly and elimination of the fronts along the tree.

use super::scalar::Scalar;
use super::symbolic::{Supernode, Symbolic, local};
use super::{PIVOT_THRESHOLD, dense, pivoting};
use crate::solver::FactorizationError;
use faer::prelude::ReborrowMut;
use faer::{MatMut, MatRef};
use rayon::prelude::*;

/// Subtrees with fewer operations are not split among threads.
const SMALL_SUBTREE: f64 = 2e7;

/// Factors of one front: q pivots, t rows and columns beyond (delayed ones, then
/// [`Supernode::rows`]). Unknowns are in the permuted numbering; matrices are column-major.
#[derive(Debug)]
pub(super) struct Front<T> {
    pub pivot_rows: Vec<u32>,
    pub pivot_columns: Vec<u32>,
    pub delayed_rows: Vec<u32>,
    pub delayed_columns: Vec<u32>,
    /// L11 (unit diagonal not stored) and U11, q × q.
    pub lu: Vec<T>,
    /// U12, q × t.
    pub upper: Vec<T>,
    /// L21, t × q.
    pub lower: Vec<T>,
    /// Largest entry of U11 and U12.
    pub growth: f64,
}

impl<T: Scalar> Front<T> {
    /// Size and column of the smallest pivot.
    pub fn smallest_pivot(&self) -> Option<(f64, u32)> {
        let q = self.pivot_columns.len();
        let pivots = (0..q).map(|i| self.lu[i + i * q].absolute().to_f64());
        pivots.zip(self.pivot_columns.iter().copied()).min_by(|a, b| a.0.total_cmp(&b.0))
    }

    pub fn entries(&self) -> usize {
        self.lu.len() + self.upper.len() + self.lower.len()
    }
}

/// What a front passes to its parent: a square matrix over its delayed and its other rows.
struct Contribution<T> {
    delayed_rows: Vec<u32>,
    delayed_columns: Vec<u32>,
    values: Vec<T>,
}

/// Fronts of a subtree in postorder, and the contribution of its root.
type Subtree<T> = (Vec<Front<T>>, Contribution<T>);

/// Factorizes the matrix whose (scaled) entries are `values`. Fronts are returned in postorder.
pub(super) fn factorize<T: Scalar>(symbolic: &Symbolic, values: &[T]) -> Result<Vec<Front<T>>, FactorizationError> {
    let trees = children_in_order(&symbolic.roots, symbolic, values)?;
    Ok(trees.into_iter().flat_map(|(fronts, _)| fronts).collect())
}

/// Subtrees in parallel; of several errors the first in order is reported.
fn children_in_order<T: Scalar>(
    roots: &[usize],
    symbolic: &Symbolic,
    values: &[T],
) -> Result<Vec<Subtree<T>>, FactorizationError> {
    let results: Vec<_> = roots.par_iter().map(|&r| subtree(symbolic, values, r)).collect();
    results.into_iter().collect()
}

fn subtree<T: Scalar>(symbolic: &Symbolic, values: &[T], root: usize) -> Result<Subtree<T>, FactorizationError> {
    let supernode = &symbolic.supernodes[root];
    let mut fronts = Vec::with_capacity(root + 1 - supernode.first_descendant);
    if supernode.subtree_operations >= SMALL_SUBTREE && !supernode.children.is_empty() {
        let mut contributions = Vec::with_capacity(supernode.children.len());
        for (below, contribution) in children_in_order(&supernode.children, symbolic, values)? {
            fronts.extend(below);
            contributions.push(contribution);
        }
        let (front, contribution) = process(symbolic, values, root, contributions)?;
        fronts.push(front);
        return Ok((fronts, contribution));
    }
    let mut pending: Vec<Contribution<T>> = Vec::new();
    for k in supernode.first_descendant..root {
        let own = pending.split_off(pending.len() - symbolic.supernodes[k].children.len());
        let (front, contribution) = process(symbolic, values, k, own)?;
        fronts.push(front);
        pending.push(contribution);
    }
    let (front, contribution) = process(symbolic, values, root, pending)?;
    fronts.push(front);
    Ok((fronts, contribution))
}

fn process<T: Scalar>(
    symbolic: &Symbolic,
    values: &[T],
    k: usize,
    children: Vec<Contribution<T>>,
) -> Result<(Front<T>, Contribution<T>), FactorizationError> {
    let assembled = Assembled::new(symbolic, values, k, children);
    let is_root = symbolic.supernodes[k].parent.is_none();
    let (front, contribution, best_rejected) = assembled.eliminate();
    if is_root && let Some(&column) = front.delayed_columns.first() {
        let unknown = symbolic.permutation[column as usize] as usize;
        return Err(FactorizationError::Singular { unknown, pivot: best_rejected });
    }
    Ok((front, contribution))
}

/// A front before elimination: p fully summed rows and columns, r beyond.
struct Assembled<T> {
    rows: Vec<u32>,
    columns: Vec<u32>,
    beyond: usize,
    f11: Vec<T>,
    f12: Vec<T>,
    f21: Vec<T>,
    f22: Vec<T>,
}

impl<T: Scalar> Assembled<T> {
    /// Own pivots come first, then the delayed ones of the children in their order.
    fn new(symbolic: &Symbolic, values: &[T], k: usize, children: Vec<Contribution<T>>) -> Self {
        let supernode = &symbolic.supernodes[k];
        let own = supernode.first as u32..(supernode.first + supernode.pivots) as u32;
        let (mut rows, mut columns): (Vec<u32>, Vec<u32>) = (own.clone().collect(), own.collect());
        for child in &children {
            rows.extend(&child.delayed_rows);
            columns.extend(&child.delayed_columns);
        }
        let (p, r) = (rows.len(), supernode.rows.len());
        let zeros = |m: usize, n: usize| vec![T::ZERO; m * n];
        let (f11, f12, f21, f22) = (zeros(p, p), zeros(p, r), zeros(r, p), zeros(r, r));
        let mut front = Self { rows, columns, beyond: r, f11, f12, f21, f22 };
        let range = symbolic.entry_offsets[k]..symbolic.entry_offsets[k + 1];
        for &(source, i, j) in &symbolic.entries[range] {
            front.add_entry(supernode.pivots, i as usize, j as usize, values[source as usize]);
        }
        let mut delayed_before = supernode.pivots;
        for (child, &c) in children.into_iter().zip(&supernode.children) {
            let delayed = child.delayed_rows.len();
            front.extend_add(supernode, &symbolic.supernodes[c], delayed_before, &child);
            delayed_before += delayed;
        }
        front
    }

    /// Adds a matrix entry at local indices as of the analysis, where `own` pivots come first.
    fn add_entry(&mut self, own: usize, i: usize, j: usize, value: T) {
        let (p, r) = (self.rows.len(), self.beyond);
        let entry = match (i < own, j < own) {
            (true, true) => &mut self.f11[i + j * p],
            (true, false) => &mut self.f12[i + (j - own) * p],
            (false, true) => &mut self.f21[i - own + j * r],
            (false, false) => &mut self.f22[i - own + (j - own) * r],
        };
        *entry += value;
    }

    /// Adds the contribution of a child whose delayed rows start at `delayed_at`.
    fn extend_add(
        &mut self,
        supernode: &Supernode,
        child: &Supernode,
        delayed_at: usize,
        contribution: &Contribution<T>,
    ) {
        let (p, r, own) = (self.rows.len(), self.beyond, supernode.pivots);
        let delayed = contribution.delayed_rows.len();
        // Fully summed places first, then places beyond: both child lists keep this order.
        let past = (supernode.first + own) as u32;
        let inner = child.rows.partition_point(|&row| row < past);
        let mut summed: Vec<usize> = (delayed_at..delayed_at + delayed).collect();
        summed.extend(child.rows[..inner].iter().map(|&row| row as usize - supernode.first));
        let mut beyond = Vec::with_capacity(child.rows.len() - inner);
        let mut at = match child.rows.get(inner) {
            Some(&row) => local(supernode, row) as usize - own,
            None => 0,
        };
        for &row in &child.rows[inner..] {
            while supernode.rows[at] != row {
                at += 1;
            }
            beyond.push(at);
        }
        let m = summed.len() + beyond.len();
        let columns: Vec<&[T]> = contribution.values.chunks_exact(m.max(1)).collect();
        let add = |target: &mut [T], places: &[usize], values: &[T]| {
            for (&place, value) in places.iter().zip(values) {
                target[place] += *value;
            }
        };
        let (left, right) = columns.split_at(summed.len());
        for (&j, column) in summed.iter().zip(left) {
            let (upper, lower) = column.split_at(summed.len());
            add(&mut self.f11[j * p..(j + 1) * p], &summed, upper);
            add(&mut self.f21[j * r..(j + 1) * r], &beyond, lower);
        }
        for (&j, column) in beyond.iter().zip(right) {
            let (upper, lower) = column.split_at(summed.len());
            add(&mut self.f12[j * p..(j + 1) * p], &summed, upper);
            add(&mut self.f22[j * r..(j + 1) * r], &beyond, lower);
        }
    }

    /// Factors, contribution, and the best candidate of the first rejected column.
    fn eliminate(self) -> (Front<T>, Contribution<T>, f64) {
        match self.eliminate_all() {
            Ok((front, contribution)) => (front, contribution, 0.0),
            Err(front) => front.eliminate_some(),
        }
    }

    /// The fast path: partial pivoting within F11, then a check of all multipliers. Gives the
    /// front back unchanged if a pivot is too small.
    fn eliminate_all(mut self) -> Result<(Front<T>, Contribution<T>), Box<Self>> {
        let (p, r) = (self.rows.len(), self.beyond);
        let mut lu = self.f11.clone();
        let mut order = vec![0u32; p];
        dense::lu(MatMut::from_column_major_slice_mut(&mut lu, p, p), &mut order);
        let smallest = (0..p).map(|i| lu[i + i * p].absolute().to_f64());
        // Written so that NaN fails.
        if !smallest.into_iter().all(|pivot| pivot >= T::SMALLEST_PIVOT) {
            return Err(Box::new(self));
        }
        let factors = MatRef::from_column_major_slice(&lu, p, p);
        let mut lower = self.f21.clone();
        dense::solve_upper_right(factors, MatMut::from_column_major_slice_mut(&mut lower, r, p));
        if dense::largest(&lower) > 1.0 / PIVOT_THRESHOLD {
            return Err(Box::new(self));
        }
        reorder_rows(&mut self.f12, p, |i| order[i] as usize);
        let mut upper = MatMut::from_column_major_slice_mut(&mut self.f12, p, r);
        dense::solve_unit_lower(factors, upper.rb_mut());
        let schur = MatMut::from_column_major_slice_mut(&mut self.f22, r, r);
        let multipliers = MatRef::from_column_major_slice(&lower, r, p);
        dense::subtract_product(schur, multipliers, upper.as_ref());
        let growth = dense::largest(&lu).max(dense::largest(&self.f12));
        let pivot_rows = order.iter().map(|&i| self.rows[i as usize]).collect();
        let front = Front {
            pivot_rows,
            pivot_columns: self.columns,
            delayed_rows: Vec::new(),
            delayed_columns: Vec::new(),
            lu,
            upper: self.f12,
            lower,
            growth,
        };
        let (delayed_rows, delayed_columns) = (Vec::new(), Vec::new());
        Ok((front, Contribution { delayed_rows, delayed_columns, values: self.f22 }))
    }

    /// The careful path: threshold pivoting; what is rejected stays in the contribution.
    fn eliminate_some(mut self) -> (Front<T>, Contribution<T>, f64) {
        let (p, r) = (self.rows.len(), self.beyond);
        let mut stacked = Vec::with_capacity((p + r) * p);
        for j in 0..p {
            stacked.extend_from_slice(&self.f11[j * p..(j + 1) * p]);
            stacked.extend_from_slice(&self.f21[j * r..(j + 1) * r]);
        }
        let done = pivoting::eliminate(stacked, p + r, p);
        let (q, d) = (done.pivots, p - done.pivots);
        let columns = MatRef::from_column_major_slice(&done.values, p + r, p);
        reorder_rows(&mut self.f12, p, |i| done.row_order[i]);
        let f12 = MatMut::from_column_major_slice_mut(&mut self.f12, p, r);
        let (mut upper, mut delayed) = f12.split_at_row_mut(q);
        dense::solve_unit_lower(columns.submatrix(0, 0, q, q), upper.rb_mut());
        dense::subtract_product(delayed.rb_mut(), columns.submatrix(q, 0, d, q), upper.as_ref());
        let mut schur = MatMut::from_column_major_slice_mut(&mut self.f22, r, r);
        dense::subtract_product(schur.rb_mut(), columns.submatrix(p, 0, r, q), upper.as_ref());
        let (upper, delayed, schur) = (upper.as_ref(), delayed.as_ref(), schur.as_ref());
        let lu = gather(q, q, |i, j| columns[(i, j)]);
        let lower = gather(d + r, q, |i, j| columns[(q + i, j)]);
        let upper = gather(q, d + r, |i, j| if j < d { columns[(i, q + j)] } else { upper[(i, j - d)] });
        let values = gather(d + r, d + r, |i, j| match (i < d, j < d) {
            (_, true) => columns[(q + i, q + j)],
            (true, false) => delayed[(i, j - d)],
            (false, false) => schur[(i - d, j - d)],
        });
        let rows: Vec<u32> = done.row_order.iter().map(|&i| self.rows[i]).collect();
        let columns: Vec<u32> = done.column_order.iter().map(|&j| self.columns[j]).collect();
        let growth = dense::largest(&lu).max(dense::largest(&upper));
        let contribution =
            Contribution { delayed_rows: rows[q..].to_vec(), delayed_columns: columns[q..].to_vec(), values };
        let front = Front {
            pivot_rows: rows[..q].to_vec(),
            pivot_columns: columns[..q].to_vec(),
            delayed_rows: contribution.delayed_rows.clone(),
            delayed_columns: contribution.delayed_columns.clone(),
            lu,
            upper,
            lower,
            growth,
        };
        (front, contribution, done.best_rejected)
    }
}

/// Column-major matrix of the given entries.
fn gather<T>(rows: usize, columns: usize, entry: impl Fn(usize, usize) -> T) -> Vec<T> {
    let mut values = Vec::with_capacity(rows * columns);
    for j in 0..columns {
        values.extend((0..rows).map(|i| entry(i, j)));
    }
    values
}

/// Row i of a column-major matrix of `rows` rows becomes the former row `source(i)`.
fn reorder_rows<T: Scalar>(values: &mut [T], rows: usize, source: impl Fn(usize) -> usize + Sync) {
    if rows == 0 || (0..rows).all(|i| source(i) == i) {
        return;
    }
    let mut copy = vec![T::ZERO; rows];
    for column in values.chunks_exact_mut(rows) {
        copy.copy_from_slice(column);
        for (i, value) in column.iter_mut().enumerate() {
            *value = copy[source(i)];
        }
    }
}

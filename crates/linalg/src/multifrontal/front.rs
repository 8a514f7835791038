//! Assembly and elimination of one front.
//!
//! The fully summed columns F11, F21 are first assembled and factorized in place; the other columns
//! follow after a check of the pivots. If a pivot is too small, the columns are assembled again
//! from the contributions and treated by threshold pivoting. Symmetric fronts are first tried with
//! Cholesky's method ([`super::symmetric`]).

use super::buffers::Buffers;
use super::dense::{View, ViewMut};
use super::scalar::Scalar;
use super::symbolic::{Entry, MISSING, Places, Structure, Supernode, front_operations, local};
use super::trapezoid::Trapezoid;
use super::{dense, pivoting};
use rayon::prelude::*;

/// Number of entries of the contributions from which several threads add them.
pub(super) const WORTH_SHARING: usize = 200_000;

/// Columns per task for this.
pub(super) const COLUMNS_PER_TASK: usize = 32;

/// No column.
pub(super) const NONE: u32 = u32::MAX;

/// Factors of one front: its pivots, and rows and columns beyond (delayed ones, then
/// [`Supernode::rows`]). Unknowns are in the permuted numbering.
#[derive(Debug)]
pub(super) struct Front<T> {
    pub pivot_rows: Vec<u32>,
    pub pivot_columns: Vec<u32>,
    pub delayed_rows: Vec<u32>,
    pub delayed_columns: Vec<u32>,
    /// L11 over L21: Cholesky's factor if the front is symmetric, otherwise with a unit diagonal.
    pub lower: Trapezoid<T>,
    /// The transpose of U11 beside U12; none if the front is symmetric.
    pub upper: Option<Trapezoid<T>>,
    /// Largest entry of U11 and U12, or of L11 and L21.
    pub growth: f64,
    /// Size and column of the smallest pivot.
    pub smallest_pivot: Option<(f64, u32)>,
}

impl<T: Scalar> Front<T> {
    pub fn is_symmetric(&self) -> bool {
        self.upper.is_none()
    }

    pub fn entries(&self) -> usize {
        self.lower.entries() + self.upper.as_ref().map_or(0, Trapezoid::entries)
    }

    /// Memory of the entries. \[bytes\]
    pub fn bytes(&self) -> usize {
        self.lower.bytes() + self.upper.as_ref().map_or(0, Trapezoid::bytes)
    }

    /// Entries that a substitution reads: those of a symmetric front twice.
    pub fn entries_read(&self) -> usize {
        self.lower.entries() + self.upper.as_ref().unwrap_or(&self.lower).entries()
    }

    /// Stores the entries with 16 bits each.
    pub fn pack(&mut self) {
        self.lower.pack();
        self.upper.iter_mut().for_each(Trapezoid::pack);
    }

    /// Floating-point operations of the factorization.
    pub fn operations(&self) -> f64 {
        front_operations(self.pivot_rows.len() as f64, self.lower.beyond() as f64, self.is_symmetric())
    }
}

/// The smallest pivot among the `pivots` on the diagonal, and its column.
pub(super) fn smallest(pivots: impl Iterator<Item = f64>, columns: &[u32]) -> Option<(f64, u32)> {
    pivots.zip(columns.iter().copied()).min_by(|a, b| a.0.total_cmp(&b.0))
}

/// Which entries of a contribution have been computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Content {
    /// All entries of an unsymmetric matrix.
    All,
    /// All entries of a symmetric matrix.
    Symmetric,
    /// Those of a symmetric matrix on and below the diagonal.
    LowerTriangle,
}

/// The contribution of a front to its parent: a square matrix over its delayed and its other rows.
pub(super) struct Contribution<T> {
    pub delayed_rows: Vec<u32>,
    pub delayed_columns: Vec<u32>,
    pub values: Vec<T>,
    pub content: Content,
}

/// Assembles and eliminates front `k`. Returns factors, contribution, and the best candidate in the
/// first rejected column.
pub(super) fn process<T: Scalar>(
    (structure, places): (&Structure, &Places),
    values: &[T],
    k: usize,
    children: Vec<Contribution<T>>,
    buffers: &Buffers<T>,
    threshold: f64,
) -> (Front<T>, Contribution<T>, f64) {
    let mut assembly = Assembly::new((structure, places), values, k, children);
    let symmetric = assembly.is_symmetric();
    if symmetric && let Ok((front, contribution)) = assembly.eliminate_symmetric(buffers) {
        return (front, contribution, 0.0);
    }
    assembly.children.iter_mut().for_each(Child::complete);
    match assembly.eliminate_all(symmetric, buffers, threshold) {
        Ok((front, contribution)) => (front, contribution, 0.0),
        Err(Rejected) => assembly.eliminate_some(buffers, threshold),
    }
}

/// A pivot was too small for the fast path, or the front is not positive definite.
pub(super) struct Rejected;

/// Consecutive entries of a child that are added to consecutive places of its parent.
pub(super) struct Run {
    pub from: usize,
    pub to: usize,
    pub length: usize,
}

/// A contribution and its places in the parent, with those that are fully summed there first.
pub(super) struct Child<T> {
    pub contribution: Contribution<T>,
    /// Rows (columns) that are fully summed in the parent.
    pub summed: usize,
    /// Size of the contribution.
    pub size: usize,
    pub summed_runs: Vec<Run>,
    pub beyond_runs: Vec<Run>,
    /// Column of the contribution for each fully summed column of the parent, and for each column
    /// beyond; or [`NONE`].
    pub summed_sources: Vec<u32>,
    pub beyond_sources: Vec<u32>,
}

/// The data assembled into a front with p fully summed rows and columns, and r beyond.
pub(super) struct Assembly<'a, T> {
    structure: &'a Structure,
    places: &'a Places,
    pub values: &'a [T],
    k: usize,
    pub rows: Vec<u32>,
    pub columns: Vec<u32>,
    pub beyond: usize,
    pub children: Vec<Child<T>>,
}

impl<'a, T: Scalar> Assembly<'a, T> {
    /// Own pivots come first, then the delayed ones of the children in their order.
    fn new(
        (structure, places): (&'a Structure, &'a Places),
        values: &'a [T],
        k: usize,
        contributions: Vec<Contribution<T>>,
    ) -> Self {
        let supernode = &structure.supernodes[k];
        let own = supernode.first as u32..(supernode.first + supernode.pivots) as u32;
        let (mut rows, mut columns): (Vec<u32>, Vec<u32>) = (own.clone().collect(), own.collect());
        let mut delayed_at = Vec::with_capacity(contributions.len());
        for child in &contributions {
            delayed_at.push(rows.len());
            rows.extend(&child.delayed_rows);
            columns.extend(&child.delayed_columns);
        }
        let children = contributions.into_iter().zip(&supernode.children).zip(delayed_at);
        let children = children
            .map(|((contribution, &c), at)| {
                Child::new(supernode, &structure.supernodes[c], at, contribution, rows.len())
            })
            .collect();
        Self { structure, places, values, k, rows, columns, beyond: supernode.rows.len(), children }
    }

    /// Fully summed columns: F11, p × p, and F21, r × p.
    fn summed_columns(&self) -> (Vec<T>, Vec<T>) {
        let (p, r, own) = (self.rows.len(), self.beyond, self.own());
        let (mut f11, mut f21) = (zeros(p * p), zeros(r * p));
        for &Entry { source, row, column, .. } in self.entries() {
            let (i, j, value) = (row as usize, column as usize, self.values[source as usize]);
            if j < own {
                let entry = if i < own { &mut f11[i + j * p] } else { &mut f21[i - own + j * r] };
                *entry += value;
            }
        }
        self.add_children(&mut f11, &mut f21, |child| &child.summed_sources);
        (f11, f21)
    }

    /// Columns beyond: F12, p × r, and F22, r × r. Releases the contributions of the children.
    fn columns_beyond(&mut self, buffers: &Buffers<T>) -> (Vec<T>, Vec<T>) {
        let (p, r, own) = (self.rows.len(), self.beyond, self.own());
        let (mut f12, mut f22) = (zeros(p * r), buffers.zeros(r * r));
        for &Entry { source, row, column, .. } in self.entries() {
            let (i, j, value) = (row as usize, column as usize, self.values[source as usize]);
            if j >= own {
                let entry = if i < own { &mut f12[i + (j - own) * p] } else { &mut f22[i - own + (j - own) * r] };
                *entry += value;
            }
        }
        self.add_children(&mut f12, &mut f22, |child| &child.beyond_sources);
        self.children.drain(..).for_each(|child| buffers.put(child.contribution.values));
        (f12, f22)
    }

    /// Whether all data are those of a symmetric matrix, except for round-off.
    fn is_symmetric(&self) -> bool {
        let round_off = T::SYMMETRY;
        let is_mirrored = |entry: &Entry| {
            let value = self.values[entry.source as usize];
            match entry.mirror {
                MISSING => value == T::ZERO,
                mirror => (value - self.values[mirror as usize]).absolute() <= round_off,
            }
        };
        self.children.iter().all(|child| child.contribution.content != Content::All)
            && self.entries().iter().all(is_mirrored)
    }

    pub fn own(&self) -> usize {
        self.structure.supernodes[self.k].pivots
    }

    /// Matrix entries, local indices of the analysis, where the own pivots come first.
    pub fn entries(&self) -> &[Entry] {
        self.places.of(self.k)
    }

    /// Adds the contributions to the fully summed rows (`upper`) and the rows beyond (`lower`) of
    /// those columns for which `sources` names a column of the child.
    fn add_children(&self, upper: &mut [T], lower: &mut [T], sources: impl Fn(&Child<T>) -> &[u32] + Sync) {
        if self.children.is_empty() {
            return;
        }
        let add = |(j, upper, lower): (usize, &mut [T], &mut [T])| {
            for child in &self.children {
                let source = sources(child)[j];
                if source != NONE {
                    child.add_column(source as usize, upper, lower);
                }
            }
        };
        let mut lower = lower.chunks_exact_mut(self.beyond.max(1));
        let columns = upper.chunks_exact_mut(self.rows.len()).enumerate();
        let columns = columns.map(|(j, upper)| (j, upper, lower.next().unwrap_or_default()));
        if self.children.iter().map(|c| c.contribution.values.len()).sum::<usize>() < WORTH_SHARING {
            columns.for_each(add);
        } else {
            let columns: Vec<_> = columns.collect();
            columns.into_par_iter().with_min_len(COLUMNS_PER_TASK).for_each(add);
        }
    }

    /// The fast path: partial pivoting within F11, then a check of all multipliers. Fails if a
    /// pivot is too small.
    fn eliminate_all(
        &mut self,
        symmetric: bool,
        buffers: &Buffers<T>,
        threshold: f64,
    ) -> Result<(Front<T>, Contribution<T>), Rejected> {
        let (p, r) = (self.rows.len(), self.beyond);
        let (mut lu, mut lower) = self.summed_columns();
        let mut order = vec![0u32; p];
        dense::lu(ViewMut::new(&mut lu, p, p), &mut order);
        let mut pivots = (0..p).map(|i| lu[i + i * p].absolute().to_f64());
        // Written so that NaN fails.
        if !pivots.all(|pivot| pivot >= T::SMALLEST_PIVOT) {
            return Err(Rejected);
        }
        let factors = View::new(&lu, p, p);
        dense::solve_upper_right(factors, ViewMut::new(&mut lower, r, p));
        if dense::largest(&lower) > 1.0 / threshold {
            return Err(Rejected);
        }
        let (mut f12, mut f22) = self.columns_beyond(buffers);
        let mut upper = ViewMut::new(&mut f12, p, r);
        dense::permute_rows(upper.borrow(), &order);
        dense::solve_unit_lower(factors, upper.borrow());
        let schur = ViewMut::new(&mut f22, r, r);
        let multipliers = View::new(&lower, r, p);
        dense::subtract_product(schur, multipliers, upper.read());
        let front = Front {
            pivot_rows: order.iter().map(|&i| self.rows[i as usize]).collect(),
            pivot_columns: self.columns.clone(),
            delayed_rows: Vec::new(),
            delayed_columns: Vec::new(),
            lower: Trapezoid::of_unit_lower(&lu, &lower, p),
            upper: Some(Trapezoid::of_upper(&lu, &f12, p)),
            growth: dense::largest(&lu).max(dense::largest(&f12)),
            smallest_pivot: smallest((0..p).map(|i| lu[i + i * p].absolute().to_f64()), &self.columns),
        };
        let content = if symmetric { Content::Symmetric } else { Content::All };
        Ok((front, Contribution { delayed_rows: Vec::new(), delayed_columns: Vec::new(), values: f22, content }))
    }

    /// Threshold pivoting; rejected rows and columns stay in the contribution.
    fn eliminate_some(mut self, buffers: &Buffers<T>, threshold: f64) -> (Front<T>, Contribution<T>, f64) {
        let (p, r) = (self.rows.len(), self.beyond);
        let (f11, f21) = self.summed_columns();
        let mut stacked = Vec::with_capacity((p + r) * p);
        for j in 0..p {
            stacked.extend_from_slice(&f11[j * p..(j + 1) * p]);
            stacked.extend_from_slice(&f21[j * r..(j + 1) * r]);
        }
        let done = pivoting::eliminate(stacked, p + r, p, threshold);
        let (q, d) = (done.pivots, p - done.pivots);
        let columns = View::new(&done.values, p + r, p);
        let (mut f12, mut f22) = self.columns_beyond(buffers);
        let mut f12 = ViewMut::new(&mut f12, p, r);
        let order: Vec<u32> = done.row_order.iter().map(|&i| i as u32).collect();
        dense::permute_rows(f12.borrow(), &order);
        let (mut upper, mut delayed) = f12.split_rows(q);
        dense::solve_unit_lower(columns.block(0, 0, q, q), upper.borrow());
        dense::subtract_product(delayed.borrow(), columns.block(q, 0, d, q), upper.read());
        let mut schur = ViewMut::new(&mut f22, r, r);
        dense::subtract_product(schur.borrow(), columns.block(p, 0, r, q), upper.read());
        let (upper, delayed, schur) = (upper.read(), delayed.read(), schur.read());
        let lu = gather(q, q, |i, j| columns.get(i, j));
        let lower = gather(d + r, q, |i, j| columns.get(q + i, j));
        let upper = gather(q, d + r, |i, j| if j < d { columns.get(i, q + j) } else { upper.get(i, j - d) });
        let values = gather(d + r, d + r, |i, j| match (i < d, j < d) {
            (_, true) => columns.get(q + i, q + j),
            (true, false) => delayed.get(i, j - d),
            (false, false) => schur.get(i - d, j - d),
        });
        let rows: Vec<u32> = done.row_order.iter().map(|&i| self.rows[i]).collect();
        let columns: Vec<u32> = done.column_order.iter().map(|&j| self.columns[j]).collect();
        let front = Front {
            pivot_rows: rows[..q].to_vec(),
            pivot_columns: columns[..q].to_vec(),
            delayed_rows: rows[q..].to_vec(),
            delayed_columns: columns[q..].to_vec(),
            lower: Trapezoid::of_unit_lower(&lu, &lower, q),
            upper: Some(Trapezoid::of_upper(&lu, &upper, q)),
            growth: dense::largest(&lu).max(dense::largest(&upper)),
            smallest_pivot: smallest((0..q).map(|i| lu[i + i * q].absolute().to_f64()), &columns),
        };
        buffers.put(f22);
        let (delayed_rows, delayed_columns) = (rows[q..].to_vec(), columns[q..].to_vec());
        let contribution = Contribution { delayed_rows, delayed_columns, values, content: Content::All };
        (front, contribution, done.best_rejected)
    }
}

impl<T: Scalar> Child<T> {
    /// Finds the places in the parent `supernode`, which has `columns` fully summed columns
    /// including the delayed ones; the delayed columns of this child start at `delayed_at`.
    fn new(
        supernode: &Supernode,
        child: &Supernode,
        delayed_at: usize,
        contribution: Contribution<T>,
        columns: usize,
    ) -> Self {
        // Fully summed places first, then places beyond: both lists of the child keep this order.
        let past = (supernode.first + supernode.pivots) as u32;
        let inner = child.rows.partition_point(|&row| row < past);
        let delayed = contribution.delayed_rows.len();
        let mut summed: Vec<usize> = (delayed_at..delayed_at + delayed).collect();
        summed.extend(child.rows[..inner].iter().map(|&row| row as usize - supernode.first));
        let mut beyond = Vec::with_capacity(child.rows.len() - inner);
        let mut at = match child.rows.get(inner) {
            Some(&row) => local(supernode, row) as usize - supernode.pivots,
            None => 0,
        };
        for &row in &child.rows[inner..] {
            while supernode.rows[at] != row {
                at += 1;
            }
            beyond.push(at);
        }
        Self {
            contribution,
            summed: summed.len(),
            size: summed.len() + beyond.len(),
            summed_sources: sources(&summed, 0, columns),
            beyond_sources: sources(&beyond, summed.len(), supernode.rows.len()),
            summed_runs: runs(&summed),
            beyond_runs: runs(&beyond),
        }
    }

    /// Fills the upper triangle of a symmetric contribution.
    fn complete(&mut self) {
        if self.contribution.content == Content::LowerTriangle {
            dense::mirror(&mut self.contribution.values, self.size);
            self.contribution.content = Content::Symmetric;
        }
    }

    /// Adds column `source` to the fully summed rows and the rows beyond of a column of the parent.
    #[inline]
    fn add_column(&self, source: usize, upper: &mut [T], lower: &mut [T]) {
        let column = &self.contribution.values[source * self.size..(source + 1) * self.size];
        let (summed, beyond) = column.split_at(self.summed);
        add_runs(&self.summed_runs, summed, upper);
        add_runs(&self.beyond_runs, beyond, lower);
    }
}

#[inline]
fn add_runs<T: Scalar>(runs: &[Run], values: &[T], target: &mut [T]) {
    for run in runs {
        let target = &mut target[run.to..run.to + run.length];
        let values = &values[run.from..run.from + run.length];
        target.iter_mut().zip(values).for_each(|(entry, value)| *entry += *value);
    }
}

/// Index of each of `count` places in `places`, counted from `first`.
fn sources(places: &[usize], first: usize, count: usize) -> Vec<u32> {
    let mut sources = vec![NONE; count];
    for (i, &place) in places.iter().enumerate() {
        sources[place] = (first + i) as u32;
    }
    sources
}

fn runs(places: &[usize]) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for (from, &to) in places.iter().enumerate() {
        match runs.last_mut() {
            Some(run) if run.to + run.length == to => run.length += 1,
            _ => runs.push(Run { from, to, length: 1 }),
        }
    }
    runs
}

/// Written immediately: memory that is read before it is written would be mapped twice.
fn zeros<T: Scalar>(length: usize) -> Vec<T> {
    let mut values = Vec::with_capacity(length);
    values.resize(length, T::ZERO);
    values
}

/// Column-major matrix of the given entries.
fn gather<T>(rows: usize, columns: usize, entry: impl Fn(usize, usize) -> T) -> Vec<T> {
    let mut values = Vec::with_capacity(rows * columns);
    for j in 0..columns {
        values.extend((0..rows).map(|i| entry(i, j)));
    }
    values
}

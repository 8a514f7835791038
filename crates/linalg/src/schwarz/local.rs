//! Overlapping subdomains and the factors of their blocks of the matrix.

use super::vertices::Vertices;
use crate::csr::{CsrMatrix, CsrPattern};
use crate::multifrontal::{MultifrontalFactorization, MultifrontalSolver};
use crate::solver::{Factorization, FactorizationError, LinearSolver};
use crate::symbolic::Symbolic;
use rayon::prelude::*;
use std::sync::Arc;

/// Smallest relative change for which a row of a block counts as changed, and the number of changed
/// rows up to which the factors of the block are kept.
const CHANGE: f64 = 0.1;
const MOST_ROWS: usize = 6;

/// The factors of a subdomain, and the entries of its block.
#[derive(Debug)]
pub(super) struct SubdomainFactors {
    pub factors: MultifrontalFactorization,
    values: Vec<f32>,
}

impl SubdomainFactors {
    /// Memory in bytes.
    pub fn bytes(&self) -> usize {
        self.factors.bytes() + 4 * self.values.len()
    }
}

/// A subdomain: a set of unknowns, some of which it owns, and the analysis of its block.
#[derive(Debug)]
pub(super) struct Subdomain {
    /// Unknowns of the block, ascending.
    pub unknowns: Vec<u32>,
    /// Positions in `unknowns` of the unknowns that this subdomain owns.
    pub own: Vec<u32>,
    /// Position in the whole matrix of each entry of the block.
    entries: Vec<u32>,
    symbolic: Symbolic,
}

impl Subdomain {
    /// The vertices `own` with `layers` of neighbours. Vertices of rigid bodies, which couple to
    /// very many others, can be included, but their neighbours are not added.
    ///
    /// # Errors
    /// If the block cannot be analysed.
    pub fn new(
        pattern: &CsrPattern,
        vertices: &Vertices,
        own: &[u32],
        layers: usize,
    ) -> Result<Self, FactorizationError> {
        let mut inside: Vec<u32> = own.to_vec();
        inside.sort_unstable();
        let mut front = inside.clone();
        for _ in 0..layers {
            let expandable = front.iter().filter(|&&v| !vertices.is_long(v as usize));
            let mut next: Vec<u32> = expandable.flat_map(|&v| vertices.adjacent(v as usize)).copied().collect();
            next.sort_unstable();
            next.dedup();
            next.retain(|v| inside.binary_search(v).is_err());
            inside.extend(&next);
            inside.sort_unstable();
            front = next;
        }
        let gather = |set: &[u32]| {
            let mut unknowns: Vec<u32> = set.iter().flat_map(|&v| vertices.members(v as usize)).copied().collect();
            unknowns.sort_unstable();
            unknowns
        };
        let (unknowns, owned) = (gather(&inside), gather(own));
        let position = |i: u32| unknowns.binary_search(&i).ok();
        let own = owned.into_iter().filter_map(|i| Some(position(i)? as u32)).collect();
        let (mut offsets, mut columns, mut entries) = (vec![0], Vec::new(), Vec::new());
        for &i in &unknowns {
            // both lists ascend
            let mut at = 0;
            for (k, &column) in pattern.row_range(i as usize).zip(pattern.row(i as usize)) {
                at += gallop(&unknowns[at..], column);
                if unknowns.get(at) == Some(&column) {
                    columns.push(at as u32);
                    entries.push(k as u32);
                }
            }
            offsets.push(columns.len());
        }
        let groups = unknowns.iter().map(|&i| pattern.groups()[i as usize]).collect();
        let block = Arc::new(CsrPattern::new(offsets, columns, groups, Vec::new()).expect("columns ascend"));
        let symbolic = MultifrontalSolver::packed().analyse(&block)?;
        Ok(Self { unknowns, own, entries, symbolic })
    }

    /// The unknowns that this subdomain owns.
    pub fn own_unknowns(&self) -> impl Iterator<Item = u32> {
        self.own.iter().map(|&k| self.unknowns[k as usize])
    }

    /// Whether a vertex that this subdomain owns has a multiplier, or is coupled to a vertex with one
    /// or to very many others.
    pub fn touches(&self, vertices: &Vertices, multiplier: &impl Fn(u32) -> bool) -> bool {
        let is_slave = |v: usize| vertices.members(v).iter().any(|&i| multiplier(i));
        self.own_unknowns().map(|i| vertices.of[i as usize] as usize).any(|v| {
            let around = vertices.adjacent(v).iter().map(|&w| w as usize);
            is_slave(v) || vertices.is_long(v) || around.into_iter().any(|w| is_slave(w) || vertices.is_long(w))
        })
    }

    /// Factors of the block in single precision, and whether these are the `earlier` ones, which are
    /// kept if the block has hardly changed since.
    ///
    /// # Errors
    /// As [`LinearSolver::factorize`]; unknowns are those of the whole matrix.
    pub fn factorize(
        &self,
        a: &CsrMatrix,
        earlier: Option<Arc<SubdomainFactors>>,
    ) -> Result<(Arc<SubdomainFactors>, bool), FactorizationError> {
        if let Some(earlier) = earlier.filter(|earlier| self.has_hardly_changed(&earlier.values, a)) {
            return Ok((earlier, true));
        }
        // this solver no longer holds the earlier factors
        let values: Vec<f64> = self.entries.iter().map(|&k| a.values[k as usize]).collect();
        let kept = values.iter().map(|&value| value as f32).collect();
        let block = CsrMatrix { pattern: self.symbolic.pattern().clone(), values };
        let factors = MultifrontalSolver::packed().factorize_matrix(&self.symbolic, &block);
        let factors = factors.map_err(|error| match error {
            FactorizationError::Singular { unknown, pivot } => {
                FactorizationError::Singular { unknown: self.unknowns[unknown] as usize, pivot }
            }
            other => other,
        })?;
        Ok((Arc::new(SubdomainFactors { factors, values: kept }), false))
    }

    /// Whether all rows but a few have changed by at most a tenth of the sum of their absolute values.
    fn has_hardly_changed(&self, before: &[f32], a: &CsrMatrix) -> bool {
        let offsets = self.symbolic.pattern().row_offsets();
        let has_changed = |row: &&[usize]| {
            let (mut change, mut size) = (0.0, 0.0);
            for (before, &k) in before[row[0]..row[1]].iter().zip(&self.entries[row[0]..row[1]]) {
                let now = a.values[k as usize];
                change += (f64::from(*before) - now).abs();
                size += now.abs();
            }
            // also if something is not finite
            !(change <= CHANGE * size)
        };
        offsets.windows(2).filter(has_changed).take(MOST_ROWS + 1).count() <= MOST_ROWS
    }
}

/// Number of leading items below `wanted` in an ascending list; fast if this number is small.
fn gallop(list: &[u32], wanted: u32) -> usize {
    let mut step = 1;
    while step < list.len() && list[step] < wanted {
        step *= 2;
    }
    let low = step / 2;
    let high = (step + 1).min(list.len());
    low + list[low..high].partition_point(|&x| x < wanted)
}

/// Adds up the solutions of all subdomains for right-hand sides of n entries. Restricted additive
/// Schwarz uses only the owned unknowns of each solution; its transpose uses only the owned entries of
/// the right-hand sides.
///
/// The sums are evaluated in the order of the subdomains.
pub(super) fn solve(
    subdomains: &[Subdomain],
    factors: &[Arc<SubdomainFactors>],
    transpose: bool,
    n: usize,
    rhs: &[f64],
    x: &mut [f64],
) {
    let n = n.max(1);
    let one = |(subdomain, factors): (&Subdomain, &Arc<SubdomainFactors>)| {
        let unknowns = &subdomain.unknowns;
        let mut local = Vec::with_capacity(rhs.len() / n * unknowns.len());
        for rhs in rhs.chunks_exact(n) {
            let start = local.len();
            if transpose {
                local.resize(start + unknowns.len(), 0.0);
                let own = subdomain.own.iter().map(|&k| k as usize);
                own.for_each(|k| local[start + k] = rhs[unknowns[k] as usize]);
            } else {
                local.extend(unknowns.iter().map(|&i| rhs[i as usize]));
            }
        }
        if transpose {
            factors.factors.solve_transpose_many(&mut local);
        } else {
            factors.factors.solve_many(&mut local);
        }
        local
    };
    let solutions: Vec<Vec<f64>> = subdomains.par_iter().zip(factors).with_max_len(1).map(one).collect();
    for (Subdomain { unknowns, own, .. }, local) in subdomains.iter().zip(solutions) {
        for (local, x) in local.chunks_exact(unknowns.len().max(1)).zip(x.chunks_exact_mut(n)) {
            if transpose {
                unknowns.iter().zip(local).for_each(|(&i, value)| x[i as usize] += value);
            } else {
                own.iter().for_each(|&k| x[unknowns[k as usize] as usize] += local[k as usize]);
            }
        }
    }
}

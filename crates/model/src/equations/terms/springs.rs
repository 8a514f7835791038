//! Springs between nodes and to the ground, with [`Spring`](slipstick_solid::spring::Spring)'s equations.
//!
//! They do not depend on time or density, and add to the internal forces and to the stored energy.

use crate::equations::terms::{ForceTerm, TermState};
use crate::equations::{ContactModel, Share};
use slipstick_linalg::BlockMatrix;
use slipstick_solid::spring::Spring;

/// The springs of a model.
#[derive(Debug, Clone, Default)]
pub struct Springs {
    all: Vec<Spring>,
    /// Names, each with the end of its springs.
    names: Vec<(String, usize)>,
}

impl Springs {
    /// Adds springs under a name.
    pub fn add(&mut self, name: &str, springs: Vec<Spring>) {
        self.all.extend(springs);
        self.names.push((name.to_owned(), self.all.len()));
    }

    /// The names, in order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.names.iter().map(|(name, _)| name.as_str())
    }

    /// The springs with a name; none if there is no such name.
    pub fn of(&self, name: &str) -> &[Spring] {
        let Some(at) = self.names.iter().position(|(known, _)| known == name) else { return &[] };
        let start = if at == 0 { 0 } else { self.names[at - 1].1 };
        &self.all[start..self.names[at].1]
    }

    /// Whether there are no springs.
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// The springs.
    pub fn list(&self) -> &[Spring] {
        &self.all
    }

    /// Strain energy at displacements `d`. \[F L\]
    pub fn energy(&self, d: &[f64]) -> f64 {
        self.all.iter().map(|spring| spring.energy(d)).sum()
    }

    /// The rates at which they restrain motions, a row for each direction: `motions` are displacements.
    pub(in crate::equations) fn restrained(&self, d: &[f64], motions: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let rows = |spring: &Spring| {
            let along = |n| motions.iter().map(|motion| spring.along(n, motion)).collect::<Vec<f64>>();
            spring.restrained(d).into_iter().map(along).collect::<Vec<_>>()
        };
        self.all.iter().flat_map(rows).collect()
    }

    /// Adds the couplings of their ends to the rows of a part of the model, if this part has the springs.
    pub(in crate::equations) fn couple(&self, rows: &mut [Vec<u32>], share: &Share) {
        for spring in self.all.iter().filter(|_| share.has_rest()) {
            let ends = [spring.node, spring.to.unwrap_or(spring.node)];
            ends.iter().for_each(|&end| rows[end as usize].extend(ends));
        }
    }
}

impl ContactModel {
    /// The springs that this rank assembles.
    fn own_springs(&self) -> impl Iterator<Item = &Spring> {
        self.springs.all.iter().filter(|_| self.share.has_rest())
    }

    /// The springs.
    pub fn springs(&self) -> &Springs {
        &self.springs
    }

    /// Adds K v with their tangent K, which is symmetric.
    pub(in crate::equations) fn add_spring_tangent_product(&self, d: &[f64], v: &[f64], out: &mut [f64]) {
        self.own_springs().for_each(|spring| spring.add_tangent_product(d, v, out));
    }
}

impl ForceTerm for Springs {
    fn is_internal(&self) -> bool {
        true
    }

    fn add_force(&self, at: TermState<'_>, out: &mut [f64]) {
        at.model().own_springs().for_each(|spring| spring.add_force(at.y, out));
    }

    fn add_tangent(&self, at: TermState<'_>, matrix: &mut BlockMatrix) {
        at.model().own_springs().for_each(|spring| {
            spring.tangent(at.y, |row, column, block| matrix.add(row as usize, column as usize, block));
        });
    }
}

//! Transfer between unknowns and coarse unknowns.

use super::aggregates::{Aggregates, MODES};
use super::vertices::Vertices;
use rayon::prelude::*;

/// A sparse matrix with a row for every unknown, and [`MODES`] columns for every aggregate.
#[derive(Debug, Clone)]
pub(super) struct Transfer {
    offsets: Vec<usize>,
    aggregates: Vec<u32>,
    values: Vec<[f64; MODES]>,
}

/// The entries of a row or column of the matrix that are not zero.
pub(super) type Line = Vec<(u32, f64)>;

/// Rows of a transfer for the unknowns of a vertex: aggregates, and for each unknown one item per
/// aggregate.
type Patch = (Vec<u32>, Vec<Vec<[f64; MODES]>>);

impl Transfer {
    /// Each unknown follows the rigid motions of its aggregate.
    pub fn tentative(aggregates: &Aggregates) -> Self {
        let mut transfer = Self { offsets: vec![0], aggregates: Vec::new(), values: Vec::new() };
        for motion in &aggregates.motions {
            if let Some((aggregate, row)) = motion {
                transfer.aggregates.push(*aggregate);
                transfer.values.push(*row);
            }
            transfer.offsets.push(transfer.aggregates.len());
        }
        transfer
    }

    pub fn row(&self, i: usize) -> impl Iterator<Item = (u32, &[f64; MODES])> {
        let range = self.offsets[i]..self.offsets[i + 1];
        self.aggregates[range.clone()].iter().copied().zip(&self.values[range])
    }

    /// One step of block Jacobi for A P = 0 in the rows `part`, all of them unknowns of the vertices
    /// `which`: P ← P − ω E D⁻¹ E A P, where D are the blocks of these vertices on the diagonal, and E
    /// selects the rows `part`. `line` returns a row of A. Rows of a vertex whose block is singular
    /// stay as they are.
    pub fn relax(
        &self,
        vertices: &Vertices,
        which: &(impl Fn(usize) -> bool + Sync),
        part: &(impl Fn(u32) -> bool + Sync),
        line: &(impl Fn(u32) -> Line + Sync),
        damping: f64,
    ) -> Self {
        let patch = |v: usize| -> Option<Patch> {
            if !which(v) {
                return None;
            }
            let members = vertices.members(v);
            let lines: Vec<Line> = members.iter().map(|&i| line(i)).collect();
            let near = lines.iter().flatten().map(|(j, _)| j).chain(members);
            let mut near: Vec<u32> = near.copied().collect();
            near.sort_unstable();
            near.dedup();
            let mut reached: Vec<u32> = near.iter().flat_map(|&j| self.row(j as usize).map(|(a, _)| a)).collect();
            reached.sort_unstable();
            reached.dedup();
            let mut products = vec![vec![[0.0; MODES]; reached.len()]; members.len()];
            let mut block = vec![0.0; members.len() * members.len()];
            for (k, line) in lines.iter().enumerate() {
                for &(j, value) in line {
                    if let Ok(l) = members.binary_search(&j) {
                        block[k * members.len() + l] = value;
                    }
                    if !part(members[k]) {
                        continue;
                    }
                    for (aggregate, motion) in self.row(j as usize) {
                        let slot = reached.partition_point(|&a| a < aggregate);
                        products[k][slot].iter_mut().zip(motion).for_each(|(sum, m)| *sum += value * m);
                    }
                }
            }
            if !solve_dense(&mut block, &mut products) {
                return None;
            }
            for (k, &i) in members.iter().enumerate() {
                let factor = if part(i) { -damping } else { 0.0 };
                products[k].iter_mut().flatten().for_each(|x| *x *= factor);
                for (aggregate, motion) in self.row(i as usize) {
                    let slot = reached.partition_point(|&a| a < aggregate);
                    products[k][slot].iter_mut().zip(motion).for_each(|(sum, m)| *sum += m);
                }
            }
            Some((reached, products))
        };
        let patches: Vec<Option<Patch>> = (0..vertices.len()).into_par_iter().map(patch).collect();
        let mut relaxed = Self { offsets: vec![0], aggregates: Vec::new(), values: Vec::new() };
        for i in 0..vertices.of.len() {
            let v = vertices.of[i] as usize;
            match &patches[v] {
                None => {
                    for (aggregate, motion) in self.row(i) {
                        relaxed.aggregates.push(aggregate);
                        relaxed.values.push(*motion);
                    }
                }
                Some((reached, rows)) => {
                    let k = vertices.members(v).partition_point(|&j| (j as usize) < i);
                    for (aggregate, motion) in reached.iter().zip(&rows[k]) {
                        if motion.iter().any(|x| *x != 0.0) {
                            relaxed.aggregates.push(*aggregate);
                            relaxed.values.push(*motion);
                        }
                    }
                }
            }
            relaxed.offsets.push(relaxed.aggregates.len());
        }
        relaxed
    }

    /// Unknowns in the support of each aggregate, ascending.
    pub fn supports(&self, aggregates: usize) -> Vec<Vec<u32>> {
        let mut supports = vec![Vec::new(); aggregates];
        for i in 0..self.offsets.len() - 1 {
            for (aggregate, _) in self.row(i) {
                supports[aggregate as usize].push(i as u32);
            }
        }
        supports
    }

    /// Number of stored blocks.
    pub fn blocks(&self) -> usize {
        self.aggregates.len()
    }

    /// `coarse = Pᵀ fine`; the coarse vector has [`MODES`] entries per aggregate.
    pub fn restrict(&self, fine: &[f64], coarse: &mut [[f64; MODES]]) {
        coarse.fill([0.0; MODES]);
        for (i, value) in fine.iter().enumerate() {
            for (aggregate, motion) in self.row(i) {
                coarse[aggregate as usize].iter_mut().zip(motion).for_each(|(sum, m)| *sum += m * value);
            }
        }
    }

    /// `fine += P coarse`.
    pub fn prolong(&self, coarse: &[[f64; MODES]], fine: &mut [f64]) {
        fine.par_iter_mut().with_min_len(4096).enumerate().for_each(|(i, value)| {
            for (aggregate, motion) in self.row(i) {
                *value += motion.iter().zip(&coarse[aggregate as usize]).map(|(m, c)| m * c).sum::<f64>();
            }
        });
    }
}

/// Overwrites the right-hand sides with the solutions of a small dense system, by rows, with partial
/// pivoting; `false` if it is singular.
fn solve_dense(block: &mut [f64], rhs: &mut [Vec<[f64; MODES]>]) -> bool {
    let n = rhs.len();
    for k in 0..n {
        let pivot = (k..n).fold(k, |best, i| if block[i * n + k].abs() > block[best * n + k].abs() { i } else { best });
        let size = block[pivot * n + k];
        if size == 0.0 || !size.is_finite() {
            return false;
        }
        if pivot != k {
            (0..n).for_each(|j| block.swap(k * n + j, pivot * n + j));
            rhs.swap(k, pivot);
        }
        for i in k + 1..n {
            let factor = block[i * n + k] / size;
            if factor != 0.0 {
                (k..n).for_each(|j| block[i * n + j] -= factor * block[k * n + j]);
                let (upper, lower) = rhs.split_at_mut(i);
                subtract(&mut lower[0], factor, &upper[k]);
            }
        }
    }
    for k in (0..n).rev() {
        for j in k + 1..n {
            let factor = block[k * n + j];
            if factor != 0.0 {
                let (upper, lower) = rhs.split_at_mut(j);
                subtract(&mut upper[k], factor, &lower[0]);
            }
        }
        let inverse = 1.0 / block[k * n + k];
        rhs[k].iter_mut().flatten().for_each(|x| *x *= inverse);
    }
    rhs.iter().flatten().flatten().all(|x| x.is_finite())
}

fn subtract(from: &mut [[f64; MODES]], factor: f64, what: &[[f64; MODES]]) {
    for (from, what) in from.iter_mut().zip(what) {
        from.iter_mut().zip(what).for_each(|(x, y)| *x -= factor * y);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Source: the solution (1, 2, −1) of a system whose first pivot is zero, multiplied out by hand.
    #[test]
    fn small_systems_are_solved_with_pivoting() {
        let mut block = vec![0.0, 2.0, 1.0, 1.0, 1.0, 1.0, 4.0, -1.0, 0.0];
        let mut rhs: Vec<Vec<[f64; MODES]>> = [3.0, 2.0, 2.0].iter().map(|b| vec![[*b; MODES]]).collect();
        assert!(solve_dense(&mut block, &mut rhs));
        for (row, expected) in rhs.iter().zip([1.0, 2.0, -1.0]) {
            assert!(row[0].iter().all(|x| (x - expected).abs() < 1e-15));
        }
        assert!(!solve_dense(&mut [1.0, 1.0, 1.0, 1.0], &mut [vec![[1.0; MODES]], vec![[1.0; MODES]]]));
    }
}

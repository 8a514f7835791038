//! Model problems that the tests share: a hexahedral brick of springs with an interface.
#![allow(dead_code)] // each test file uses a part

use slipstick_linalg::{BlockMatrix, BlockPattern, CsrMatrix, Reduction};
use std::sync::Arc;

/// Reproducible numbers in [−1, 1) (64-bit linear congruential generator, Knuth's constants).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    pub fn vector(&mut self, n: usize) -> Vec<f64> {
        (0..n).map(|_| self.next()).collect()
    }
}

/// A brick of nx × ny × nz nodes on a 27-point pattern, with multipliers on its top nodes.
pub struct Brick {
    pub nodes: [usize; 3],
    pub multipliers: bool,
    /// Stiffness contrast in decades: node stiffness varies over 10^−contrast..1 in clusters.
    pub contrast: f64,
    /// Size of the nonsymmetric part relative to the couplings.
    pub nonsymmetry: f64,
    pub fixed_bottom: bool,
}

impl Brick {
    pub fn node(&self, i: usize, j: usize, k: usize) -> usize {
        i + self.nodes[0] * (j + self.nodes[1] * k)
    }

    fn count(&self) -> usize {
        self.nodes.iter().product()
    }

    fn neighbours(&self, node: usize) -> Vec<usize> {
        let [nx, ny, nz] = self.nodes;
        let (i, j, k) = (node % nx, node / nx % ny, node / (nx * ny));
        let around = |c: usize, n: usize| c.saturating_sub(1)..(c + 2).min(n);
        let mut list = Vec::new();
        for c in around(k, nz) {
            for b in around(j, ny) {
                list.extend(around(i, nx).map(|a| self.node(a, b, c)));
            }
        }
        list
    }

    fn top(&self) -> Vec<usize> {
        if self.multipliers {
            (self.count() - self.nodes[0] * self.nodes[1]..self.count()).collect()
        } else {
            Vec::new()
        }
    }

    /// Block matrix, prescribed unknowns and elimination groups.
    pub fn assemble(&self, seed: u64) -> (BlockMatrix, Vec<bool>, Vec<u32>) {
        let count = self.count();
        let top = self.top();
        let mut rows: Vec<Vec<u32>> =
            (0..count).map(|i| self.neighbours(i).iter().map(|&j| j as u32).collect()).collect();
        let mut groups: Vec<u32> = (0..count as u32).collect();
        for (m, &slave) in top.iter().enumerate() {
            let multiplier = (count + m) as u32;
            let coupled: Vec<u32> = self.neighbours(slave).iter().map(|&j| j as u32).collect();
            for &j in &coupled {
                rows[j as usize].push(multiplier);
            }
            let mut row = coupled;
            row.push(multiplier);
            rows.push(row);
            groups.push(slave as u32);
        }
        let mut a = BlockMatrix::new(Arc::new(BlockPattern::from_rows(&rows)));
        self.springs(&mut a, seed);
        for (m, &slave) in top.iter().enumerate() {
            self.constraint(&mut a, slave, count + m, m % 3 != 0);
        }
        let mut fixed = vec![false; 3 * rows.len()];
        if self.fixed_bottom {
            fixed[..3 * self.nodes[0] * self.nodes[1]].fill(true);
        }
        (a, fixed, groups)
    }

    /// Springs along and across each edge, rank-one blocks with a transverse part, plus a
    /// nonsymmetric part.
    fn springs(&self, a: &mut BlockMatrix, seed: u64) {
        let mut random = Random(seed);
        for i in 0..self.count() {
            for j in self.neighbours(i) {
                if j <= i {
                    continue;
                }
                let cluster = ((i / 5 + j / 7) % 4) as f64 / 3.0;
                let stiffness = 10f64.powf(-self.contrast * cluster);
                let direction = self.direction(i, j);
                let twist: [f64; 9] = std::array::from_fn(|_| self.nonsymmetry * random.next());
                let block: [f64; 9] = std::array::from_fn(|l| {
                    let (r, c) = (l / 3, l % 3);
                    let identity = if r == c { 0.3 } else { 0.0 };
                    stiffness * (direction[r] * direction[c] + identity)
                });
                let negative: [f64; 9] = std::array::from_fn(|l| stiffness * twist[l] - block[l]);
                a.add(i, i, &block);
                a.add(j, j, &block);
                a.add(i, j, &negative);
                let opposite: [f64; 9] = std::array::from_fn(|l| -block[l]);
                a.add(j, i, &opposite);
            }
        }
    }

    fn direction(&self, i: usize, j: usize) -> [f64; 3] {
        let [nx, ny, _] = self.nodes;
        let at = |n: usize| [(n % nx) as f64, (n / nx % ny) as f64, (n / (nx * ny)) as f64];
        let (p, q) = (at(i), at(j));
        let d = [q[0] - p[0], q[1] - p[1], q[2] - p[2]];
        let length = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
        d.map(|d| d / length)
    }

    /// Sticking: zero diagonal block, weighted averages of the displacements prescribed. Inactive:
    /// the multiplier itself vanishes.
    fn constraint(&self, a: &mut BlockMatrix, slave: usize, multiplier: usize, active: bool) {
        let identity = |s: f64| -> [f64; 9] { std::array::from_fn(|l| if l % 4 == 0 { s } else { 0.0 }) };
        for j in self.neighbours(slave) {
            let weight = if j == slave { 0.5 } else { 0.02 };
            a.add(j, multiplier, &identity(weight));
            if active {
                a.add(multiplier, j, &identity(weight));
            }
        }
        if !active {
            a.add(multiplier, multiplier, &identity(1.0));
        }
    }

    pub fn reduced(&self, seed: u64) -> (CsrMatrix, Reduction) {
        let (a, fixed, groups) = self.assemble(seed);
        let reduction = Reduction::new(a.pattern(), &fixed, &groups);
        (reduction.reduce(&a), reduction)
    }
}

/// ‖b − A x‖ / ‖b‖, of Aᵀ where `transpose` is set.
pub fn relative_residual(a: &CsrMatrix, transpose: bool, x: &[f64], b: &[f64]) -> f64 {
    a.residual_norm(transpose, x, b) / b.iter().map(|b| b * b).sum::<f64>().sqrt()
}

/// max |x − y| / max |y|.
pub fn difference(x: &[f64], y: &[f64]) -> f64 {
    let scale = y.iter().fold(0.0, |m: f64, y| m.max(y.abs()));
    x.iter().zip(y).fold(0.0, |m: f64, (x, y)| m.max((x - y).abs())) / scale
}

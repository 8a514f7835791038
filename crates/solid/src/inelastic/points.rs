//! One element with its integration points, of any type: F̄, and its first and second derivatives.
//!
//! With F_q = 1 + Σ_i u_i ⊗ G_qi and J_q = det F_q, the formulation F̄ is
//!
//! ```text
//! F̄_q = r_q F_q      r_q = (θ_q/J_q)^(1/3)      θ_q = Σ_p A_qp J_p
//! a_q = ∂ln J_q/∂u = F_q⁻ᵀ G_q      m_q = ∂ln θ_q/∂u = Σ_p A_qp J_p a_p/θ_q
//! δF̄_q = r_q (δF_q + ⅓ (m_q − a_q)·δu F_q)
//! ```
//!
//! where A projects onto the modes of the element: constants, and linear functions of X in hex27
//! (`quadratic/`). A tensor T_q at every point acts on the nodes as Σ_q T_q : δF̄_q. With S_q =
//! ⅓ r_q T_q:F_q and B_p = Σ_q S_q A_qp J_p/θ_q,
//!
//! ```text
//! f = Σ_q [ r_q T_q G_q + (B_q − S_q) a_q ]
//! T:δ²F̄ = Σ_q [ S_q ⅓ c cᵀ + ⅓ r_q (c (T G)ᵀ + (T G) cᵀ) + (B_q − S_q) δa_q + B_q a aᵀ − S_q m mᵀ ],   c = m − a
//! ```
//!
//! and δa_q has the entries −a_ib a_ka for the unknowns ia and kb.

use crate::law::{determinant, inverse};

pub(crate) use crate::stress::Tensor;

/// An element in its reference configuration.
#[derive(Debug, Clone)]
pub(crate) struct PointElement {
    /// Nodes of coincident corners (wedges) appear twice; their contributions are summed.
    pub nodes: Vec<u32>,
    /// The mesh's number of the element.
    pub number: u32,
    pub section: u32,
    /// Number of its first point among those of all elements with memory.
    pub first: usize,
    /// G_qi, as `[q][i]`. \[1/L\]
    pub gradients: Vec<Vec<[f64; 3]>>,
    /// \[L³\]
    pub weights: Vec<f64>,
    /// A_qp, for F̄.
    pub average: Option<Vec<Vec<f64>>>,
}

/// F̄ at all points, with what its derivatives need.
pub(crate) struct Deformed {
    /// F̄_q.
    pub bar: Vec<Tensor>,
    f: Vec<Tensor>,
    ratio: Vec<f64>,
    /// A_qp J_p/θ_q.
    shares: Vec<Vec<f64>>,
    /// a_q and m_q, one vector per node.
    logarithms: Vec<Vec<[f64; 3]>>,
    means: Vec<Vec<[f64; 3]>>,
}

impl PointElement {
    /// An element without history and without averages.
    pub fn elastic(
        (nodes, number, section): (&[u32], u32, u32),
        gradients: Vec<Vec<[f64; 3]>>,
        weights: Vec<f64>,
    ) -> Self {
        Self { nodes: nodes.to_vec(), number, section, first: 0, gradients, weights, average: None }
    }

    /// The mesh's number of the element.
    pub fn number(&self) -> usize {
        self.number as usize
    }

    pub fn points(&self) -> usize {
        self.weights.len()
    }

    /// Numbers of the entries of point q in the history.
    pub fn entries(&self, q: usize) -> std::ops::Range<usize> {
        let first = (self.first + q) * crate::law::HISTORY;
        first..first + crate::law::HISTORY
    }

    /// F̄ over the stretch of a uniform expansion, at the fraction γ of the displacements without it; `None` if
    /// J ≤ 0 at a point.
    pub fn deformed(&self, d: &[f64], stretch: f64, gamma: f64) -> Option<Deformed> {
        let d = self.gather(d);
        let of = |g: &Vec<[f64; 3]>| {
            let f = plus_identity(&gradient(g, &d)).map(|row| row.map(|x| x / stretch));
            if gamma == 1.0 { f } else { scaled(&f, gamma) }
        };
        self.at(self.gradients.iter().map(of).collect())
    }

    /// Values at the nodes.
    pub fn gather(&self, v: &[f64]) -> Vec<[f64; 3]> {
        self.nodes.iter().map(|&n| std::array::from_fn(|c| v[3 * n as usize + c])).collect()
    }

    /// From F at the points.
    pub(super) fn at(&self, f: Vec<Tensor>) -> Option<Deformed> {
        let j: Vec<f64> = f.iter().map(determinant).collect();
        if !j.iter().all(|&j| j >= f64::MIN_POSITIVE && j.is_finite()) {
            return None;
        }
        let Some(average) = &self.average else {
            let ratio = vec![1.0; f.len()];
            let (logarithms, means) = (Vec::new(), Vec::new());
            return Some(Deformed { bar: f.clone(), f, ratio, shares: Vec::new(), logarithms, means });
        };
        let theta: Vec<f64> = average.iter().map(|row| row.iter().zip(&j).map(|(a, j)| a * j).sum()).collect();
        if !theta.iter().all(|&theta| theta > 0.0) {
            return None;
        }
        let ratio: Vec<f64> = theta.iter().zip(&j).map(|(theta, j)| (theta / j).cbrt()).collect();
        let bar = f.iter().zip(&ratio).map(|(f, r)| f.map(|row| row.map(|x| r * x))).collect();
        let logarithms: Vec<Vec<[f64; 3]>> = f
            .iter()
            .zip(&self.gradients)
            .map(|(f, gradients)| {
                let inverse = inverse(f);
                let spatial = |g: &[f64; 3]| std::array::from_fn(|a| (0..3).map(|b| inverse[b][a] * g[b]).sum());
                gradients.iter().map(spatial).collect()
            })
            .collect();
        let share = |(row, theta): (&Vec<f64>, &f64)| row.iter().zip(&j).map(|(a, j)| a * j / theta).collect();
        let shares: Vec<Vec<f64>> = average.iter().zip(&theta).map(share).collect();
        let means = shares.iter().map(|row| combined(row, &logarithms)).collect();
        Some(Deformed { bar, f, ratio, shares, logarithms, means })
    }

    /// J at the points.
    pub fn determinants<'a>(&'a self, d: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
        let d = self.gather(d);
        self.gradients.iter().map(move |g| determinant(&plus_identity(&gradient(g, &d))))
    }

    /// δF̄ along displacements v of the nodes.
    pub fn change(&self, at: &Deformed, v: &[[f64; 3]]) -> Vec<Tensor> {
        let along = |vectors: &[[f64; 3]]| -> f64 {
            v.iter().zip(vectors).map(|(v, x)| (0..3).map(|c| x[c] * v[c]).sum::<f64>()).sum()
        };
        let of = |q: usize| {
            let change = gradient(&self.gradients[q], v);
            if at.shares.is_empty() {
                return change;
            }
            let third = (along(&at.means[q]) - along(&at.logarithms[q])) / 3.0;
            std::array::from_fn(|a| std::array::from_fn(|b| at.ratio[q] * (change[a][b] + third * at.f[q][a][b])))
        };
        (0..self.points()).map(of).collect()
    }

    /// Σ_q T_q : δF̄_q, as forces on the nodes.
    pub fn forces(&self, at: &Deformed, tensors: &[Tensor]) -> Vec<[f64; 3]> {
        let mut out = vec![[0.0; 3]; self.nodes.len()];
        let volumetric = at.volumetric(tensors);
        for (q, t) in tensors.iter().enumerate() {
            for (i, g) in self.gradients[q].iter().enumerate() {
                for a in 0..3 {
                    out[i][a] += at.ratio[q] * (0..3).map(|b| t[a][b] * g[b]).sum::<f64>();
                }
            }
            if let Some((s, b)) = &volumetric {
                for (out, x) in out.iter_mut().zip(&at.logarithms[q]) {
                    (0..3).for_each(|a| out[a] += (b[q] - s[q]) * x[a]);
                }
            }
        }
        out
    }

    /// Σ_q [∂F̄_qᵀ A_q ∂F̄_q + T_q : ∂²F̄_q] as `[3 i + a][3 k + b]`, with A_q = ∂T_q/∂F̄_q as
    /// `[3 a + B][3 b + D]`.
    pub fn tangent(&self, at: &Deformed, tensors: &[Tensor], moduli: &[[[f64; 9]; 9]]) -> Vec<f64> {
        let n = 3 * self.nodes.len();
        let mut out = vec![0.0; n * n];
        let volumetric = at.volumetric(tensors);
        let mut rows = vec![vec![0.0; n]; 9];
        for q in 0..self.points() {
            let gradients = &self.gradients[q];
            let r = at.ratio[q];
            rows.iter_mut().for_each(|row| row.fill(0.0));
            for (i, g) in gradients.iter().enumerate() {
                for a in 0..3 {
                    (0..3).for_each(|b| rows[3 * a + b][3 * i + a] = r * g[b]);
                }
            }
            if volumetric.is_some() {
                let c = at.difference(q);
                for (entry, row) in rows.iter_mut().enumerate() {
                    let f = r * at.f[q][entry / 3][entry % 3] / 3.0;
                    row.iter_mut().zip(&c).for_each(|(x, c)| *x += f * c);
                }
            }
            let mut product = vec![0.0; n];
            for entry in 0..9 {
                product.fill(0.0);
                for (modulus, row) in moduli[q][entry].iter().zip(&rows) {
                    product.iter_mut().zip(row).for_each(|(p, x)| *p += modulus * x);
                }
                add_outer(&mut out, 1.0, &rows[entry], &product);
            }
            let Some((s, b)) = &volumetric else { continue };
            let (c, a, m) = (at.difference(q), at.logarithms[q].as_flattened(), at.means[q].as_flattened());
            let traction: Vec<f64> = gradients
                .iter()
                .flat_map(|g| tensors[q].map(|row| r / 3.0 * (0..3).map(|b| row[b] * g[b]).sum::<f64>()))
                .collect();
            add_outer(&mut out, s[q] / 3.0, &c, &c);
            add_outer(&mut out, 1.0, &c, &traction);
            add_outer(&mut out, 1.0, &traction, &c);
            add_outer(&mut out, b[q], a, a);
            add_outer(&mut out, -s[q], m, m);
            let factor = b[q] - s[q];
            for (row, out) in out.chunks_exact_mut(n).enumerate() {
                let (i, a_of_row) = (row / 3, row % 3);
                for (k, out) in out.as_chunks_mut::<3>().0.iter_mut().enumerate() {
                    for b_of_column in 0..3 {
                        out[b_of_column] -= factor * a[3 * i + b_of_column] * a[3 * k + a_of_row];
                    }
                }
            }
        }
        out
    }
}

impl Deformed {
    /// S_q and B_q; `None` without F̄.
    fn volumetric(&self, tensors: &[Tensor]) -> Option<(Vec<f64>, Vec<f64>)> {
        if self.shares.is_empty() {
            return None;
        }
        let contract =
            |t: &Tensor, f: &Tensor| -> f64 { t.as_flattened().iter().zip(f.as_flattened()).map(|(t, f)| t * f).sum() };
        let s: Vec<f64> = tensors.iter().zip(&self.bar).map(|(t, bar)| contract(t, bar) / 3.0).collect();
        let mut b = vec![0.0; s.len()];
        for (s, row) in s.iter().zip(&self.shares) {
            b.iter_mut().zip(row).for_each(|(b, share)| *b += s * share);
        }
        Some((s, b))
    }

    /// m_q − a_q.
    fn difference(&self, q: usize) -> Vec<f64> {
        let (m, a) = (self.means[q].as_flattened(), self.logarithms[q].as_flattened());
        m.iter().zip(a).map(|(m, a)| m - a).collect()
    }
}

/// Adds factor x yᵀ.
fn add_outer(out: &mut [f64], factor: f64, x: &[f64], y: &[f64]) {
    for (row, x) in out.chunks_exact_mut(y.len()).zip(x) {
        let scale = factor * x;
        if scale != 0.0 {
            row.iter_mut().zip(y).for_each(|(out, y)| *out += scale * y);
        }
    }
}

/// Σ_p w_p v_p.
fn combined(weights: &[f64], vectors: &[Vec<[f64; 3]>]) -> Vec<[f64; 3]> {
    let mut out = vec![[0.0; 3]; vectors[0].len()];
    for (w, vectors) in weights.iter().zip(vectors) {
        for (out, v) in out.iter_mut().zip(vectors) {
            (0..3).for_each(|c| out[c] += w * v[c]);
        }
    }
    out
}

/// ∂v/∂X at a point, relative to the first node: even a large translation causes no round-off.
fn gradient(gradients: &[[f64; 3]], v: &[[f64; 3]]) -> Tensor {
    let mut h = [[0.0; 3]; 3];
    for (v_of_node, g) in v.iter().zip(gradients) {
        for a in 0..3 {
            let x = v_of_node[a] - v[0][a];
            (0..3).for_each(|b| h[a][b] += x * g[b]);
        }
    }
    h
}

/// 1 + γ (F − 1).
fn scaled(f: &Tensor, gamma: f64) -> Tensor {
    let one = |a: usize, b: usize| f64::from(u8::from(a == b));
    std::array::from_fn(|a| std::array::from_fn(|b| one(a, b) + gamma * (f[a][b] - one(a, b))))
}

fn plus_identity(h: &Tensor) -> Tensor {
    std::array::from_fn(|a| std::array::from_fn(|b| f64::from(a == b) + h[a][b]))
}

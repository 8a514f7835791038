//! One element in its reference configuration, and the tables for its type.

use crate::block::State;
use crate::heat::Power;
use crate::interpolation::ElementScaling;
use crate::law::determinant;
use crate::registers::{AtPoints, POINTS};
use crate::section::{Formulation, Section};
use slipstick_mesh::second_order::{
    HEX27_POINTS, Shapes, TET10_POINTS, WEDGE18_POINTS, hex27_shapes, tet10_shapes, wedge18_shapes,
};
use std::array::from_fn;
use std::sync::LazyLock;

/// Vectors at the nodes of an element.
pub(crate) type Corners<const N: usize> = [[f64; 3]; N];

pub(crate) use crate::stress::Tensor;

/// Gradients of the shape functions in the parent element.
pub(crate) struct Table<const N: usize, const B: usize, const P: usize> {
    /// ∂N_i/∂ξ_β as `[block][i][β][point]`, for loops over points; 0 beyond the last point.
    pub(super) by_node: Vec<[[AtPoints; 3]; N]>,
    /// As `[point][β][i]`, for loops over nodes; 0 beyond the last node.
    pub(super) by_point: Vec<[[f64; P]; 3]>,
    /// Weights in the parent element.
    pub(super) weights: Vec<f64>,
    /// Shape functions at the points.
    values: Vec<[f64; N]>,
    /// Shape functions and gradients at the points where stresses are evaluated.
    stress_points: Vec<Shapes<N>>,
}

impl<const N: usize, const B: usize, const P: usize> Table<N, B, P> {
    fn new(points: &[([f64; 3], f64)], stress_points: &[[f64; 3]], shapes: impl Fn([f64; 3]) -> Shapes<N>) -> Self {
        let mut out = Self {
            by_node: vec![[[[0.0; POINTS]; 3]; N]; B],
            by_point: vec![[[0.0; P]; 3]; points.len()],
            weights: points.iter().map(|point| point.1).collect(),
            values: points.iter().map(|&(at, _)| shapes(at).0).collect(),
            stress_points: stress_points.iter().map(|&at| shapes(at)).collect(),
        };
        for (p, (at, _)) in points.iter().enumerate() {
            for (i, slope) in shapes(*at).1.iter().enumerate() {
                for beta in 0..3 {
                    out.by_node[p / POINTS][i][beta][p % POINTS] = slope[beta];
                    out.by_point[p][beta][i] = slope[beta];
                }
            }
        }
        out
    }

    #[inline(always)]
    pub(super) fn points(&self) -> usize {
        self.by_point.len()
    }
}

pub(super) static TET10: LazyLock<Table<10, 1, 16>> = LazyLock::new(|| {
    let points = TET10_POINTS.map(|(at, _)| at);
    Table::new(&TET10_POINTS, &points, tet10_shapes)
});

pub(super) static WEDGE18: LazyLock<Table<18, 2, 32>> = LazyLock::new(|| {
    // two points along the axis, as of hex27
    let points = [-1.0, 1.0].map(|end| {
        [0, 1, 2].map(|i| {
            let [r, s, _] = WEDGE18_POINTS[i].0;
            [r, s, end / 3.0_f64.sqrt()]
        })
    });
    Table::new(&WEDGE18_POINTS, points.as_flattened(), wedge18_shapes)
});

pub(super) static HEX27: LazyLock<Table<27, 4, 32>> = LazyLock::new(|| {
    // the points of the 2×2×2 rule, where the stresses of quadratic elements are most accurate
    let points = slipstick_mesh::HEX_CORNERS.map(|corner| corner.map(|c| c / 3.0_f64.sqrt()));
    Table::new(&HEX27_POINTS, &points, hex27_shapes)
});

pub(super) static REDUCED_HEX27: LazyLock<Table<27, 1, 32>> = LazyLock::new(|| {
    let points = slipstick_mesh::HEX_CORNERS.map(|corner| corner.map(|c| c / 3.0_f64.sqrt()));
    Table::new(&points.map(|at| (at, 1.0)), &points, hex27_shapes)
});

/// Shape functions of hex27 at its integration points.
pub(crate) fn hex27_values() -> &'static [[f64; 27]] {
    &HEX27.values
}

/// One element in its reference configuration.
#[derive(Debug, Clone)]
#[repr(C, align(32))]
pub(crate) struct Cell<const N: usize, const B: usize, const M: usize> {
    /// ∂ξ_β/∂X_B at each point, as `[block][β][B][point]`; 0 beyond the last point. \[1/L\]
    pub(super) inverse: [[[AtPoints; 3]; 3]; B],
    /// Weight times det(∂X/∂ξ); 0 beyond the last point. \[L³\]
    pub(super) weights: [AtPoints; B],
    /// Functions φ_m with Σ w φ_m φ_n = δ_mn: the first is constant, the others are linear in X.
    /// \[L^(−3/2)\]
    pub(super) modes: [[AtPoints; B]; M],
    /// The modes at the stress points, as `[point][m]`.
    pub(super) stress_modes: Vec<[f64; M]>,
    /// ∂N_i/∂X at the stress points. \[1/L\]
    pub(super) stress_gradients: Vec<[[f64; 3]; N]>,
    pub nodes: [u32; N],
    /// The mesh's number of the element.
    pub number: u32,
    pub section: u32,
}

impl<const N: usize, const B: usize, const M: usize> Cell<N, B, M> {
    /// `None` if the Jacobian determinant is not positive at an integration point.
    pub(super) fn new<const P: usize>(
        table: &Table<N, B, P>,
        x: &[[f64; 3]; N],
        nodes: [u32; N],
        number: u32,
        section: u32,
    ) -> Option<Self> {
        let mut out = Self {
            inverse: [[[[0.0; POINTS]; 3]; 3]; B],
            weights: [[0.0; POINTS]; B],
            modes: [[[0.0; POINTS]; B]; M],
            stress_modes: Vec::with_capacity(table.stress_points.len()),
            stress_gradients: Vec::with_capacity(table.stress_points.len()),
            nodes,
            number,
            section,
        };
        // the modes at the integration points, then at the stress points
        let mut functions = vec![vec![0.0; table.points() + table.stress_points.len()]; M];
        let linear = |shapes: &[f64; N], m: usize| match m {
            0 => 1.0,
            _ => (0..N).map(|i| shapes[i] * (x[i][m - 1] - x[0][m - 1])).sum::<f64>(),
        };
        for p in 0..table.points() {
            let jacobian = from_fn(|a| {
                from_fn(|beta| {
                    (0..N).map(|i| (x[i][a] - x[0][a]) * table.by_node[p / POINTS][i][beta][p % POINTS]).sum()
                })
            });
            let (inverse, det) = inverted(&jacobian);
            if !(det > 0.0 && det.is_finite()) {
                return None;
            }
            out.weights[p / POINTS][p % POINTS] = table.weights[p] * det;
            for beta in 0..3 {
                for c in 0..3 {
                    out.inverse[p / POINTS][beta][c][p % POINTS] = inverse[beta][c];
                }
            }
            functions.iter_mut().enumerate().for_each(|(m, function)| function[p] = linear(&table.values[p], m));
        }
        for (s, (values, slopes)) in table.stress_points.iter().enumerate() {
            let place = table.points() + s;
            functions.iter_mut().enumerate().for_each(|(m, function)| function[place] = linear(values, m));
            let jacobian = from_fn(|a| from_fn(|beta| (0..N).map(|i| (x[i][a] - x[0][a]) * slopes[i][beta]).sum()));
            let (inverse, _) = inverted(&jacobian);
            let along = |i: usize, c: usize| (0..3).map(|beta| slopes[i][beta] * inverse[beta][c]).sum();
            out.stress_gradients.push(from_fn(|i| from_fn(|c| along(i, c))));
        }
        // Gram and Schmidt, twice for orthogonality to round-off
        let weight = |p: usize| out.weights[p / POINTS][p % POINTS];
        for m in 0..M {
            for _ in 0..2 {
                let (before, rest) = functions.split_at_mut(m);
                for other in before.iter() {
                    let share: f64 = (0..table.points()).map(|p| weight(p) * other[p] * rest[0][p]).sum();
                    rest[0].iter_mut().zip(other).for_each(|(x, y)| *x -= share * y);
                }
                let norm = (0..table.points()).map(|p| weight(p) * rest[0][p] * rest[0][p]).sum::<f64>().sqrt();
                rest[0].iter_mut().for_each(|x| *x /= norm);
            }
        }
        for (mode, function) in out.modes.iter_mut().zip(&functions) {
            (0..table.points()).for_each(|p| mode[p / POINTS][p % POINTS] = function[p]);
        }
        out.stress_modes = (table.points()..functions[0].len()).map(|place| from_fn(|m| functions[m][place])).collect();
        Some(out)
    }

    /// Π[x], and 1 beyond the last point.
    #[inline(always)]
    pub(super) fn project(&self, x: &[AtPoints; B]) -> [AtPoints; B] {
        let mut out = [[0.0; POINTS]; B];
        for b in 0..B {
            for p in 0..POINTS {
                out[b][p] = if self.weights[b][p] > 0.0 { 0.0 } else { 1.0 };
            }
        }
        for mode in &self.modes {
            let mut sum = 0.0;
            for b in 0..B {
                for p in 0..POINTS {
                    sum += self.weights[b][p] * mode[b][p] * x[b][p];
                }
            }
            for b in 0..B {
                for p in 0..POINTS {
                    out[b][p] += sum * mode[b][p];
                }
            }
        }
        out
    }

    /// The mesh's number of the element.
    pub fn number(&self) -> usize {
        self.number as usize
    }

    /// The displacements of its nodes without thermal expansion.
    #[inline(always)]
    pub fn local(&self, state: State<'_>) -> Corners<N> {
        state.local(&self.nodes, self.number(), self.section as usize)
    }

    #[inline(always)]
    pub fn scaling(&self, state: State<'_>, power: Power) -> ElementScaling {
        state.scaling(self.number(), self.section as usize, power)
    }

    /// Volume by numerical integration, Σ w. \[L³\]
    pub fn volume(&self) -> f64 {
        self.weights.as_flattened().iter().sum()
    }

    /// ∂N_i/∂X at an integration point.
    pub(super) fn gradients<const P: usize>(&self, table: &Table<N, B, P>, p: usize) -> [[f64; 3]; N] {
        let (block, lane) = (p / POINTS, p % POINTS);
        let along = |i: usize, c: usize| {
            (0..3).map(|beta| table.by_node[block][i][beta][lane] * self.inverse[block][beta][c][lane]).sum()
        };
        from_fn(|i| from_fn(|c| along(i, c)))
    }

    /// ∂u/∂X at the integration points.
    pub(super) fn displacement_gradients<const P: usize>(&self, table: &Table<N, B, P>, d: &Corners<N>) -> Vec<Tensor> {
        let gradients: Vec<_> = (0..table.points()).map(|p| self.gradients(table, p)).collect();
        gradients_of(&gradients, d)
    }

    /// Π[x] of a function at the integration points.
    fn averaged(&self, of: impl Fn(usize) -> f64, points: usize) -> Vec<f64> {
        let x = from_fn(|b| from_fn(|p| if POINTS * b + p < points { of(POINTS * b + p) } else { 0.0 }));
        self.project(&x).as_flattened()[..points].to_vec()
    }

    /// Energy; `None` if J ≤ 0 at an integration point. If the energy is interpolated, J is that of
    /// γ d. \[F L\]
    pub(super) fn energy<const P: usize>(
        &self,
        table: &Table<N, B, P>,
        section: &Section,
        scaling: ElementScaling,
        d: &Corners<N>,
    ) -> Option<f64> {
        let ElementScaling { factor, gamma, .. } = scaling.effective(section.material.small_strains());
        let (points, bar) = (table.points(), section.formulation == Formulation::FBar);
        let h = self.displacement_gradients(table, d);
        let weight = |p: usize| self.weights[p / POINTS][p % POINTS];
        let mut energy = 0.0;
        if gamma != 0.0 {
            let f: Vec<Tensor> = h.iter().map(|h| plus_identity(h, gamma, 0.0)).collect();
            if !f.iter().all(|f| determinant(f) > 0.0) {
                return None;
            }
            let theta = self.averaged(|p| determinant(&f[p]), points);
            if bar && !theta.iter().all(|&theta| theta > 0.0) {
                return None;
            }
            for (p, f) in f.iter().enumerate() {
                let ratio = if bar { (theta[p] / determinant(f)).cbrt() } else { 1.0 };
                energy += weight(p) * section.material.energy(&f.map(|row| row.map(|f| ratio * f)));
            }
        }
        if gamma != 1.0 {
            let trace = |p: usize| h[p][0][0] + h[p][1][1] + h[p][2][2];
            let mean = self.averaged(trace, points);
            for (p, h) in h.iter().enumerate() {
                let shift = if bar { (mean[p] - trace(p)) / 3.0 } else { 0.0 };
                let h = from_fn(|a| from_fn(|c| h[a][c] + if a == c { shift } else { 0.0 }));
                let linear = section.material.small_strain_energy(&h);
                energy += (1.0 - gamma * gamma) * weight(p) * linear;
            }
        }
        Some(factor * energy)
    }
}

/// 1 (1 + s) + γ H.
pub(super) fn plus_identity(h: &Tensor, gamma: f64, s: f64) -> Tensor {
    from_fn(|a| from_fn(|b| gamma * h[a][b] + if a == b { 1.0 + s } else { 0.0 }))
}

/// Inverse and determinant; the inverse is meaningless if the determinant vanishes.
fn inverted(m: &Tensor) -> (Tensor, f64) {
    let cofactor = |a: usize, b: usize| {
        let (a1, a2, b1, b2) = ((a + 1) % 3, (a + 2) % 3, (b + 1) % 3, (b + 2) % 3);
        m[a1][b1] * m[a2][b2] - m[a1][b2] * m[a2][b1]
    };
    let det = determinant(m);
    (from_fn(|a| from_fn(|b| cofactor(b, a) / det)), det)
}

/// ∂u/∂X at points, relative to the first node's displacement.
pub(super) fn gradients_of<const N: usize>(gradients: &[[[f64; 3]; N]], d: &Corners<N>) -> Vec<Tensor> {
    let at = |g: &[[f64; 3]; N]| from_fn(|a| from_fn(|c| (1..N).map(|i| (d[i][a] - d[0][a]) * g[i][c]).sum()));
    gradients.iter().map(at).collect()
}

/// Scaled displacements relative to the first node, so even a large translation causes no
/// round-off.
pub(super) fn scaled<const N: usize>(d: &Corners<N>, gamma: f64) -> Corners<N> {
    d.map(|v| from_fn(|c| gamma * (v[c] - d[0][c])))
}

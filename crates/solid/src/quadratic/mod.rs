//! Second-order elements: tet10 with eight integration points, hex27 with 3×3×3, of any [`Section`].
//!
//! The same integrals as in `hex8`, for any number of nodes and points: a register holds a few points
//! of one element, padded to blocks of eight. `kernel.rs` has the integrals of the solid, this file
//! the interpolation of the energy (`hex8/interpolated.rs`) and the assembly.
//!
//! F̄ averages the volume change over the modes of an element. Those of hex27 are the four linear
//! functions of X: the pair of triquadratic displacements and discontinuous linear pressure is stable
//! and keeps the order of convergence, which a constant would lower. Those of tet10 are the constants:
//! its quadratic displacements are too few for discontinuous linear pressures.

mod kernel;

use crate::assembly::local;
use crate::clusters::{Clusters, Target};
use crate::hex8::transposed;
use crate::interpolation::ElementScaling;
use crate::law::{Stress, determinant, with_stress};
use crate::registers::{AtPoints, POINTS};
use crate::section::{Formulation, Section};
use kernel::Scratch;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use slipstick_linalg::BlockPattern;
use slipstick_mesh::second_order::{HEX27_POINTS, Shapes, TET10_POINTS, hex27_shapes, tet10_shapes};
use slipstick_mesh::{Element, Mesh};
use std::array::from_fn;
use std::ops::Range;
use std::sync::LazyLock;

/// Vectors at the nodes of an element.
pub(crate) type Corners<const N: usize> = [[f64; 3]; N];

type Tensor = [[f64; 3]; 3];

/// Gradients of the shape functions in the parent element.
pub(crate) struct Table<const N: usize, const B: usize, const P: usize> {
    /// ∂N_i/∂ξ_β as `[block][i][β][point]`, for loops over points; 0 beyond the last point.
    by_node: Vec<[[AtPoints; 3]; N]>,
    /// As `[point][β][i]`, for loops over nodes; 0 beyond the last node.
    by_point: Vec<[[f64; P]; 3]>,
    /// Weights in the parent element.
    weights: Vec<f64>,
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
    fn points(&self) -> usize {
        self.by_point.len()
    }
}

static TET10: LazyLock<Table<10, 1, 16>> = LazyLock::new(|| {
    let points = TET10_POINTS.map(|(at, _)| at);
    Table::new(&TET10_POINTS, &points, tet10_shapes)
});

static HEX27: LazyLock<Table<27, 4, 32>> = LazyLock::new(|| {
    // the points of the 2×2×2 rule, where the stresses of quadratic elements are most accurate
    let points = slipstick_mesh::HEX_CORNERS.map(|corner| corner.map(|c| c / 3.0_f64.sqrt()));
    Table::new(&HEX27_POINTS, &points, hex27_shapes)
});

/// One element in its reference configuration.
#[derive(Debug, Clone)]
#[repr(C, align(32))]
pub(crate) struct Cell<const N: usize, const B: usize, const M: usize> {
    /// ∂ξ_β/∂X_B at each point, as `[block][β][B][point]`; 0 beyond the last point. \[1/L\]
    inverse: [[[AtPoints; 3]; 3]; B],
    /// Weight times det(∂X/∂ξ); 0 beyond the last point. \[L³\]
    weights: [AtPoints; B],
    /// Functions φ_m with Σ w φ_m φ_n = δ_mn: the first is constant, further ones are linear
    /// in X. \[L^(−3/2)\]
    modes: [[AtPoints; B]; M],
    /// The modes at the stress points, as `[point][m]`.
    stress_modes: Vec<[f64; M]>,
    /// ∂N_i/∂X at the stress points. \[1/L\]
    stress_gradients: Vec<[[f64; 3]; N]>,
    pub nodes: [u32; N],
    /// The mesh's number of the element.
    pub number: u32,
    pub section: u32,
}

impl<const N: usize, const B: usize, const M: usize> Cell<N, B, M> {
    /// `None` if the Jacobian determinant is not positive at an integration point.
    fn new<const P: usize>(
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
    fn project(&self, x: &[AtPoints; B]) -> [AtPoints; B] {
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

    /// Volume by the integration, Σ w. \[L³\]
    pub fn volume(&self) -> f64 {
        self.weights.as_flattened().iter().sum()
    }

    /// ∂N_i/∂X at an integration point.
    fn gradients<const P: usize>(&self, table: &Table<N, B, P>, p: usize) -> [[f64; 3]; N] {
        let (block, lane) = (p / POINTS, p % POINTS);
        let along = |i: usize, c: usize| {
            (0..3).map(|beta| table.by_node[block][i][beta][lane] * self.inverse[block][beta][c][lane]).sum()
        };
        from_fn(|i| from_fn(|c| along(i, c)))
    }

    /// ∂u/∂X at the integration points.
    fn displacement_gradients<const P: usize>(&self, table: &Table<N, B, P>, d: &Corners<N>) -> Vec<Tensor> {
        let gradients: Vec<_> = (0..table.points()).map(|p| self.gradients(table, p)).collect();
        gradients_of(&gradients, d)
    }

    /// Π[x] of a function at the integration points.
    fn averaged(&self, of: impl Fn(usize) -> f64, points: usize) -> Vec<f64> {
        let x = from_fn(|b| from_fn(|p| if POINTS * b + p < points { of(POINTS * b + p) } else { 0.0 }));
        self.project(&x).as_flattened()[..points].to_vec()
    }

    /// Energy; `None` if J ≤ 0 at an integration point, at γ d if the energy is interpolated. \[F L\]
    fn energy<const P: usize>(
        &self,
        table: &Table<N, B, P>,
        section: &Section,
        scaling: ElementScaling,
        d: &Corners<N>,
    ) -> Option<f64> {
        let ElementScaling { factor, gamma } = scaling.effective(section.material.small_strains());
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
fn plus_identity(h: &Tensor, gamma: f64, s: f64) -> Tensor {
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

/// All elements of one kind, or those of this rank.
#[derive(Debug, Clone)]
pub(crate) struct Group<const N: usize, const B: usize, const P: usize, const M: usize> {
    /// In the order of `clusters`.
    pub cells: Vec<Cell<N, B, M>>,
    clusters: Clusters,
}

/// Ten-node tetrahedra.
pub(crate) type Tet10 = Group<10, 1, 16, 1>;
/// 27-node hexahedra.
pub(crate) type Hex27 = Group<27, 4, 32, 4>;

/// A kind of second-order elements.
pub(crate) trait Kind<const N: usize, const B: usize, const P: usize> {
    fn table() -> &'static Table<N, B, P>;
    fn nodes(element: &Element) -> Option<[u32; N]>;
}

impl Kind<10, 1, 16> for Tet10 {
    fn table() -> &'static Table<10, 1, 16> {
        &TET10
    }

    fn nodes(element: &Element) -> Option<[u32; 10]> {
        if let Element::Tet10(nodes) = element { Some(*nodes) } else { None }
    }
}

impl Kind<27, 4, 32> for Hex27 {
    fn table() -> &'static Table<27, 4, 32> {
        &HEX27
    }

    fn nodes(element: &Element) -> Option<[u32; 27]> {
        if let Element::Hex27(nodes) = element { Some(*nodes) } else { None }
    }
}

/// Displacements, sections and scalings, by the mesh's numbers.
#[derive(Clone, Copy)]
pub(crate) struct State<'a> {
    pub sections: &'a [Section],
    pub d: &'a [f64],
    pub scalings: &'a [ElementScaling],
}

impl<const N: usize, const B: usize, const P: usize, const M: usize> Group<N, B, P, M>
where
    Self: Kind<N, B, P>,
{
    /// The elements of these numbers; those without a positive Jacobian are added to `flat`.
    pub fn new(mesh: &Mesh, numbers: Vec<u32>, section_of: &[u32], flat: &mut Vec<u32>) -> Self {
        let clusters = Clusters::new(mesh, numbers);
        let cells: Vec<Result<Cell<N, B, M>, u32>> = clusters
            .order
            .par_iter()
            .filter_map(|&number| {
                let nodes = Self::nodes(&mesh.elements[number as usize])?;
                let section = section_of[number as usize];
                let cell = Cell::new(Self::table(), &mesh.coordinates(&nodes), nodes, number, section);
                Some(cell.ok_or(number))
            })
            .collect();
        flat.extend(cells.iter().filter_map(|cell| cell.as_ref().err().copied()));
        Self { cells: cells.into_iter().flatten().collect(), clusters }
    }

    pub fn energy(&self, cell: &Cell<N, B, M>, state: State<'_>) -> Option<f64> {
        let (section, scaling) = (&state.sections[cell.section as usize], state.scalings[cell.number as usize]);
        cell.energy(Self::table(), section, scaling, &local(&cell.nodes, state.d))
    }

    /// Smallest J over the integration points; −∞ if J is not a number.
    pub fn smallest_determinant(&self, cell: &Cell<N, B, M>, d: &[f64]) -> f64 {
        let h = cell.displacement_gradients(Self::table(), &local(&cell.nodes, d));
        let smallest = |least: f64, j: f64| if j.is_nan() { f64::NEG_INFINITY } else { least.min(j) };
        h.iter().map(|h| determinant(&plus_identity(h, 1.0, 0.0))).fold(f64::INFINITY, smallest)
    }

    /// One number per element.
    pub fn add_by_number(&self, of: impl Fn(&Cell<N, B, M>) -> f64 + Sync, out: &mut [f64]) {
        let values: Vec<f64> = self.cells.par_iter().map(&of).collect();
        for (cell, value) in self.cells.iter().zip(values) {
            out[cell.number as usize] = value;
        }
    }

    /// Adds forces, or products of the tangent with a direction; returns the inverted elements.
    pub fn add_forces(&self, state: State<'_>, direction: Option<&[f64]>, nodes: &mut [[f64; 3]]) -> Vec<u32> {
        self.clusters.assemble(nodes, |cluster, target, inverted| {
            Arch::new().dispatch(AddForces { group: self, cluster, state, direction, target, inverted });
        })
    }

    /// Positions of the blocks of each element in a pattern.
    pub fn positions(&self, pattern: &BlockPattern) -> Vec<Vec<u32>> {
        let of = |cell: &Cell<N, B, M>| {
            let place = |i: u32, k: u32| pattern.find(i as usize, k as usize).expect("pattern holds all element pairs");
            cell.nodes.iter().flat_map(|&i| cell.nodes.iter().map(move |&k| place(i, k) as u32)).collect()
        };
        self.cells.par_iter().map(of).collect()
    }

    /// Adds tangents; returns the inverted elements.
    pub fn add_tangents(&self, state: State<'_>, positions: &[Vec<u32>], values: &mut [[f64; 9]]) -> Vec<u32> {
        self.clusters.assemble(values, |cluster, target, inverted| {
            Arch::new().dispatch(AddTangents { group: self, cluster, state, positions, target, inverted });
        })
    }

    /// λ · ∂f/∂φ of each element, added to `out`; returns the inverted elements, and then adds nothing
    /// meaningful.
    pub fn pull_back(&self, state: State<'_>, slopes: &[ElementScaling], adjoint: &[f64], out: &mut [f64]) -> Vec<u32> {
        const CHUNK: usize = 16;
        let mut products = vec![0.0; self.cells.len()];
        let chunks = products.par_chunks_mut(CHUNK).zip(self.cells.par_chunks(CHUNK));
        let rejected = chunks.flat_map_iter(|(out, cells)| {
            let mut inverted = Vec::new();
            Arch::new().dispatch(PullBack::<N, B, P, M, Self> {
                cells,
                state,
                slopes,
                adjoint,
                out,
                inverted: &mut inverted,
                group: self,
            });
            inverted
        });
        let rejected: Vec<u32> = rejected.collect();
        for (cell, product) in self.cells.iter().zip(products) {
            out[cell.number as usize] += product;
        }
        rejected
    }
}

impl<const N: usize, const B: usize, const P: usize, const M: usize> Group<N, B, P, M>
where
    Self: Kind<N, B, P>,
{
    /// An element's stress points, with what F̄ needs from its integration points.
    pub fn averaged_points(&self, cell: &Cell<N, B, M>, d: &[f64]) -> AveragedPoints<N> {
        let (table, d) = (Self::table(), local(&cell.nodes, d));
        let points = table.points();
        let mode = |m: usize, q: usize| cell.modes[m][q / POINTS][q % POINTS] * cell.weights[q / POINTS][q % POINTS];
        let weight = |at: &[f64; M], q: usize| (0..M).map(|m| at[m] * mode(m, q)).sum();
        let gradients: Vec<_> = (0..points).map(|q| cell.gradients(table, q)).collect();
        AveragedPoints {
            inner: (gradients, cell.displacement_gradients(table, &d)),
            average: cell.stress_modes.iter().map(|at| (0..points).map(|q| weight(at, q)).collect()).collect(),
            gradients: cell.stress_gradients.clone(),
            h: gradients_of(&cell.stress_gradients, &d),
        }
    }
}

/// An element's stress points, with what F̄ needs from its integration points.
pub(crate) struct AveragedPoints<const N: usize> {
    /// ∂N_i/∂X and ∂u/∂X at the stress points.
    pub gradients: Vec<[[f64; 3]; N]>,
    pub h: Vec<Tensor>,
    /// The same at the integration points.
    pub inner: (Vec<[[f64; 3]; N]>, Vec<Tensor>),
    /// The average at stress point s is Σ_q `average[s][q]` x_q.
    pub average: Vec<Vec<f64>>,
}

/// ∂u/∂X at points, relative to the first node's displacement.
fn gradients_of<const N: usize>(gradients: &[[[f64; 3]; N]], d: &Corners<N>) -> Vec<Tensor> {
    let at = |g: &[[f64; 3]; N]| from_fn(|a| from_fn(|c| (1..N).map(|i| (d[i][a] - d[0][a]) * g[i][c]).sum()));
    gradients.iter().map(at).collect()
}

/// Force of an element with interpolated energy; `None` if the finite-strain part is inverted or the
/// force is not finite.
#[inline(always)]
fn internal_force<S: Simd, const N: usize, const B: usize, const P: usize, const M: usize>(
    simd: S,
    table: &Table<N, B, P>,
    scratch: &mut Scratch<N, B, P>,
    section: &Section,
    cell: &Cell<N, B, M>,
    ElementScaling { factor, gamma }: ElementScaling,
    d: &Corners<N>,
) -> Option<Corners<N>> {
    if gamma == 1.0 {
        return force(simd, table, scratch, section, cell, factor, d, None);
    }
    let linear = force(simd, table, scratch, section, cell, factor * (1.0 - gamma * gamma), &[[0.0; 3]; N], Some(d))?;
    if gamma == 0.0 {
        return Some(linear);
    }
    let finite = force(simd, table, scratch, section, cell, factor * gamma, &scaled(d, gamma), None)?;
    Some(sum(&finite, &linear))
}

/// Product of the tangent with a direction; `None` as for [`internal_force`].
#[inline(always)]
fn tangent_product<S: Simd, const N: usize, const B: usize, const P: usize, const M: usize>(
    simd: S,
    table: &Table<N, B, P>,
    scratch: &mut Scratch<N, B, P>,
    section: &Section,
    cell: &Cell<N, B, M>,
    ElementScaling { factor, gamma }: ElementScaling,
    d: &Corners<N>,
    direction: &Corners<N>,
) -> Option<Corners<N>> {
    if gamma == 1.0 {
        return force(simd, table, scratch, section, cell, factor, d, Some(direction));
    }
    let square = gamma * gamma;
    let linear = force(simd, table, scratch, section, cell, factor * (1.0 - square), &[[0.0; 3]; N], Some(direction))?;
    if gamma == 0.0 {
        return Some(linear);
    }
    let finite = force(simd, table, scratch, section, cell, factor * square, &scaled(d, gamma), Some(direction))?;
    Some(sum(&finite, &linear))
}

/// Displacements relative to the first node, scaled: a translation, however large, causes no
/// round-off.
fn scaled<const N: usize>(d: &Corners<N>, gamma: f64) -> Corners<N> {
    d.map(|v| from_fn(|c| gamma * (v[c] - d[0][c])))
}

fn sum<const N: usize>(a: &Corners<N>, b: &Corners<N>) -> Corners<N> {
    from_fn(|i| from_fn(|c| a[i][c] + b[i][c]))
}

/// Force, or product of the tangent with a direction, without interpolation.
#[inline(always)]
fn force<S: Simd, const N: usize, const B: usize, const P: usize, const M: usize>(
    simd: S,
    table: &Table<N, B, P>,
    scratch: &mut Scratch<N, B, P>,
    section: &Section,
    cell: &Cell<N, B, M>,
    factor: f64,
    d: &Corners<N>,
    direction: Option<&Corners<N>>,
) -> Option<Corners<N>> {
    let bar = section.formulation == Formulation::FBar;
    with_stress!(&section.material, law => simd.vectorize(Force { law, bar, table, scratch, cell, factor, d, direction }))
}

struct Force<'a, L, const N: usize, const B: usize, const P: usize, const M: usize> {
    law: L,
    bar: bool,
    table: &'a Table<N, B, P>,
    scratch: &'a mut Scratch<N, B, P>,
    cell: &'a Cell<N, B, M>,
    factor: f64,
    d: &'a Corners<N>,
    direction: Option<&'a Corners<N>>,
}

impl<L: Stress, const N: usize, const B: usize, const P: usize, const M: usize> WithSimd for Force<'_, L, N, B, P, M> {
    type Output = Option<Corners<N>>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { law, bar, table, scratch, cell, factor, d, direction } = self;
        match direction {
            None => kernel::internal_force(simd, table, scratch, &law, bar, cell, factor, d),
            Some(v) => kernel::tangent_product(simd, table, scratch, &law, bar, cell, factor, d, v),
        }
    }
}

struct Tangent<'a, L, A, const N: usize, const B: usize, const P: usize, const M: usize> {
    law: L,
    bar: bool,
    table: &'a Table<N, B, P>,
    scratch: &'a mut Scratch<N, B, P>,
    cell: &'a Cell<N, B, M>,
    factor: f64,
    d: &'a Corners<N>,
    add: A,
}

impl<L: Stress, A, const N: usize, const B: usize, const P: usize, const M: usize> WithSimd
    for Tangent<'_, L, A, N, B, P, M>
where
    A: FnMut(usize, usize, [f64; 9]),
{
    type Output = Option<()>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { law, bar, table, scratch, cell, factor, d, add } = self;
        kernel::tangent(simd, table, scratch, &law, bar, cell, factor, d, add)
    }
}

struct AddForces<'a, G, T> {
    group: &'a G,
    cluster: Range<usize>,
    state: State<'a>,
    direction: Option<&'a [f64]>,
    target: &'a T,
    inverted: &'a mut Vec<u32>,
}

impl<const N: usize, const B: usize, const P: usize, const M: usize> WithSimd
    for AddForces<'_, Group<N, B, P, M>, Target<'_, [f64; 3]>>
where
    Group<N, B, P, M>: Kind<N, B, P>,
{
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let State { sections, d, scalings } = self.state;
        let (mut scratch, table) = (Scratch::new(), <Group<N, B, P, M> as Kind<N, B, P>>::table());
        for cell in &self.group.cells[self.cluster] {
            let (section, scaling) = (&sections[cell.section as usize], scalings[cell.number as usize]);
            let d = local(&cell.nodes, d);
            let force = match self.direction.map(|v| local(&cell.nodes, v)) {
                None => internal_force(simd, table, &mut scratch, section, cell, scaling, &d),
                Some(v) if v.as_flattened().iter().all(|&v| v == 0.0) => continue,
                Some(v) => tangent_product(simd, table, &mut scratch, section, cell, scaling, &d, &v),
            };
            let Some(force) = force else {
                self.inverted.push(cell.number);
                continue;
            };
            for (&node, force) in cell.nodes.iter().zip(&force) {
                // SAFETY: a node of the element.
                let to = unsafe { self.target.at(node as usize) };
                (0..3).for_each(|c| to[c] += force[c]);
            }
        }
    }
}

struct AddTangents<'a, G, T> {
    group: &'a G,
    cluster: Range<usize>,
    state: State<'a>,
    positions: &'a [Vec<u32>],
    target: &'a T,
    inverted: &'a mut Vec<u32>,
}

impl<const N: usize, const B: usize, const P: usize, const M: usize> WithSimd
    for AddTangents<'_, Group<N, B, P, M>, Target<'_, [f64; 9]>>
where
    Group<N, B, P, M>: Kind<N, B, P>,
{
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let State { sections, d, scalings } = self.state;
        let (mut scratch, table) = (Scratch::new(), <Group<N, B, P, M> as Kind<N, B, P>>::table());
        let cells = self.group.cells[self.cluster.clone()].iter().zip(&self.positions[self.cluster]);
        for (cell, positions) in cells {
            let section = &sections[cell.section as usize];
            let ElementScaling { factor, gamma } = scalings[cell.number as usize];
            let (bar, square) = (section.formulation == Formulation::FBar, gamma * gamma);
            let target = self.target;
            let mut add = |i: usize, k: usize, block: [f64; 9]| {
                let add = |position: u32, block: [f64; 9]| {
                    // SAFETY: the positions are those of pairs of the element's nodes.
                    let to = unsafe { target.at(position as usize) };
                    (0..9).for_each(|c| to[c] += block[c]);
                };
                add(positions[N * i + k], block);
                if i != k {
                    add(positions[N * k + i], transposed(block));
                }
            };
            let d = local(&cell.nodes, d);
            let mut part = |factor: f64, d: &Corners<N>| {
                let (scratch, add) = (&mut *scratch, &mut add);
                with_stress!(&section.material, law => {
                    simd.vectorize(Tangent { law, bar, table, scratch, cell, factor, d, add })
                })
            };
            // the finite-strain part first: if it is inverted, nothing is added
            let done = match gamma {
                1.0 => part(factor, &d),
                0.0 => Some(()),
                _ => part(factor * square, &scaled(&d, gamma)),
            };
            let done =
                if gamma == 1.0 { done } else { done.and_then(|()| part(factor * (1.0 - square), &[[0.0; 3]; N])) };
            if done.is_none() {
                self.inverted.push(cell.number);
            }
        }
    }
}

struct PullBack<'a, const N: usize, const B: usize, const P: usize, const M: usize, G> {
    cells: &'a [Cell<N, B, M>],
    state: State<'a>,
    slopes: &'a [ElementScaling],
    adjoint: &'a [f64],
    out: &'a mut [f64],
    inverted: &'a mut Vec<u32>,
    group: &'a G,
}

impl<const N: usize, const B: usize, const P: usize, const M: usize> WithSimd
    for PullBack<'_, N, B, P, M, Group<N, B, P, M>>
where
    Group<N, B, P, M>: Kind<N, B, P>,
{
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let _ = self.group;
        let State { sections, d, scalings } = self.state;
        let (mut scratch, table) = (Scratch::new(), <Group<N, B, P, M> as Kind<N, B, P>>::table());
        for (cell, out) in self.cells.iter().zip(self.out) {
            let section = &sections[cell.section as usize];
            let (scaling, slope) = (scalings[cell.number as usize], self.slopes[cell.number as usize]);
            if slope == (ElementScaling { factor: 0.0, gamma: 0.0 }) {
                continue;
            }
            let (d, lambda) = (local(&cell.nodes, d), local(&cell.nodes, self.adjoint));
            let dot = |force: Corners<N>| -> f64 {
                force.as_flattened().iter().zip(lambda.as_flattened()).map(|(f, l)| f * l).sum()
            };
            let ElementScaling { factor, gamma } = scaling;
            let mut of = |d: &Corners<N>, direction: Option<&Corners<N>>| {
                force(simd, table, &mut scratch, section, cell, 1.0, d, direction).map(dot)
            };
            let at = scaled(&d, gamma);
            let product = (|| {
                if gamma == 1.0 && slope.gamma == 0.0 {
                    return Some(slope.factor * of(&d, None)?);
                }
                let (force, finite) = (of(&at, None)?, of(&at, Some(&d))?);
                let linear = of(&[[0.0; 3]; N], Some(&d))?;
                let by_factor = gamma * force + (1.0 - gamma * gamma) * linear;
                let by_gamma = factor * (force + gamma * (finite - 2.0 * linear));
                Some(slope.factor * by_factor + slope.gamma * by_gamma)
            })();
            match product {
                Some(product) => *out = product,
                None => self.inverted.push(cell.number),
            }
        }
    }
}

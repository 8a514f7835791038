//! Second-order elements of any [`Section`]: tet10 with eight integration points, hex27 with 3×3×3.
//!
//! The integrals are those of `hex8`, for any number of nodes and points: a register holds a few
//! points of one element, padded to blocks of eight. `kernel.rs` contains the integrals of the
//! solid, `interpolated.rs` the interpolation of the energy, and this file the assembly. The
//! kernels are compiled once for all laws.
//!
//! F̄ averages the volume change over the modes of an element. The modes of hex27 are the four
//! linear functions of X: the pair of triquadratic displacements and discontinuous linear pressure
//! is stable and keeps the order of convergence, which a constant pressure would lower. The only
//! mode of tet10 is the constant: its displacements have too few unknowns for a discontinuous
//! linear pressure.

mod cell;
mod interpolated;
mod kernel;

use crate::assembly::local;
use crate::clusters::{Clusters, Target};
use crate::hex8::transposed;
use crate::inelastic::Reference;
use crate::interpolation::ElementScaling;
use crate::law::determinant;
use crate::registers::{AtPoints, POINTS};
use crate::section::Section;
use cell::{Cell, Corners, HEX27, TET10, Table, Tensor, gradients_of, plus_identity, scaled};
use interpolated::{force, interpolated, tangent};
use kernel::Scratch;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use slipstick_linalg::BlockPattern;
use slipstick_mesh::{Element, Mesh};
use std::ops::Range;

/// All elements of one kind, or those of this rank.
#[derive(Debug, Clone)]
pub(crate) struct Group<const N: usize, const B: usize, const P: usize, const M: usize> {
    /// The elements, in the order of `clusters`.
    pub cells: Vec<Cell<N, B, M>>,
    clusters: Clusters,
}

/// Ten-node tetrahedra.
pub(crate) type Tet10 = Group<10, 1, 16, 1>;
/// 27-node hexahedra.
pub(crate) type Hex27 = Group<27, 4, 32, 4>;

/// A type of second-order elements.
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

/// Displacements, sections and scalings, indexed by the mesh's numbers.
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
    /// The elements with these numbers; those without a positive Jacobian are added to `flat`.
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

    /// Adds one number per element.
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

    /// Adds λ · ∂f/∂φ of each element to `out`; returns the inverted elements. If there are any,
    /// `out` is meaningless.
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

/// The integration points of a second-order element, as elements with memory need them; `None` if a
/// Jacobian is not positive.
pub(crate) fn reference_points(mesh: &Mesh, number: u32) -> Option<Reference> {
    fn points<const N: usize, const B: usize, const P: usize, const M: usize>(
        mesh: &Mesh,
        number: u32,
    ) -> Option<Reference>
    where
        Group<N, B, P, M>: Kind<N, B, P>,
    {
        let nodes = Group::<N, B, P, M>::nodes(&mesh.elements[number as usize])?;
        let table = Group::<N, B, P, M>::table();
        let cell = Cell::<N, B, M>::new(table, &mesh.coordinates(&nodes), nodes, number, 0)?;
        let points = table.points();
        let at = |x: &[AtPoints; B], q: usize| x[q / POINTS][q % POINTS];
        let share = |q: usize, p: usize| -> f64 {
            cell.modes.iter().map(|mode| at(mode, q) * at(mode, p) * at(&cell.weights, p)).sum()
        };
        let gradients = (0..points).map(|q| cell.gradients(table, q).to_vec()).collect();
        let weights = (0..points).map(|q| at(&cell.weights, q)).collect();
        let average = (0..points).map(|q| (0..points).map(|p| share(q, p)).collect()).collect();
        Some((nodes.to_vec(), gradients, weights, average))
    }
    points::<10, 1, 16, 1>(mesh, number).or_else(|| points::<27, 4, 32, 4>(mesh, number))
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
            let direction = self.direction.map(|v| local(&cell.nodes, v));
            if direction.is_some_and(|v| v.as_flattened().iter().all(|&v| v == 0.0)) {
                continue;
            }
            let force = interpolated(simd, table, &mut scratch, section, cell, scaling, &d, direction.as_ref());
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
            let (section, scaling) = (&sections[cell.section as usize], scalings[cell.number as usize]);
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
            let done = tangent(simd, table, &mut scratch, section, cell, scaling, &local(&cell.nodes, d), &mut add);
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
            if slope == ElementScaling::NONE {
                continue;
            }
            let (d, lambda) = (local(&cell.nodes, d), local(&cell.nodes, self.adjoint));
            let dot = |force: Corners<N>| -> f64 {
                force.as_flattened().iter().zip(lambda.as_flattened()).map(|(f, l)| f * l).sum()
            };
            let ElementScaling { factor, gamma, .. } = scaling;
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

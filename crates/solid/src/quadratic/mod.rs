//! Second-order elements of any [`Section`]: tet10 with eight integration points, wedge18 with 3×3, hex27 with
//! 3×3×3, or 2×2×2.
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

mod block;
mod cell;
mod interpolated;
mod kernel;
mod tangent;

use crate::assembly::local;
use crate::block::{State, corners};
use crate::clusters::Clusters;
use crate::heat::Power;
use crate::inelastic::Reference;
use crate::law::determinant;
use crate::registers::{AtPoints, POINTS};
use crate::section::Formulation;
use crate::stress::AveragedPoints;
pub(crate) use cell::hex27_values;
use cell::{Cell, HEX27, REDUCED_HEX27, TET10, Table, WEDGE18, gradients_of, plus_identity};
use rayon::prelude::*;
use slipstick_mesh::{Element, Mesh};

/// All elements of one kind, or those of this rank.
#[derive(Debug)]
pub(crate) struct Group<const N: usize, const B: usize, const P: usize, const M: usize> {
    /// The elements, in the order of `clusters`.
    cells: Vec<Cell<N, B, M>>,
    clusters: Clusters,
}

/// Ten-node tetrahedra.
pub(crate) type Tet10 = Group<10, 1, 16, 1>;
/// 18-node wedges.
pub(crate) type Wedge18 = Group<18, 2, 32, 1>;
/// 27-node hexahedra.
pub(crate) type Hex27 = Group<27, 4, 32, 4>;
/// The same with 2×2×2 integration points.
pub(crate) type ReducedHex27 = Group<27, 1, 32, 4>;

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

impl Kind<18, 2, 32> for Wedge18 {
    fn table() -> &'static Table<18, 2, 32> {
        &WEDGE18
    }

    fn nodes(element: &Element) -> Option<[u32; 18]> {
        if let Element::Wedge18(nodes) = element { Some(*nodes) } else { None }
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

impl Kind<27, 1, 32> for ReducedHex27 {
    fn table() -> &'static Table<27, 1, 32> {
        &REDUCED_HEX27
    }

    fn nodes(element: &Element) -> Option<[u32; 27]> {
        Hex27::nodes(element)
    }
}

impl<const N: usize, const B: usize, const P: usize, const M: usize> Group<N, B, P, M>
where
    Self: Kind<N, B, P>,
{
    /// The elements with these numbers; those without a positive Jacobian are added to `flat`.
    fn new(mesh: &Mesh, numbers: Vec<u32>, section_of: &[u32], flat: &mut Vec<u32>) -> Self {
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

    fn energy(&self, cell: &Cell<N, B, M>, state: State<'_>) -> Option<f64> {
        let (section, scaling) = (&state.sections[cell.section as usize], cell.scaling(state, Power::Energy));
        cell.energy(Self::table(), section, scaling, &cell.local(state))
    }

    /// Smallest J over the integration points; −∞ if J is not a number.
    fn smallest_determinant(&self, cell: &Cell<N, B, M>, d: &[f64]) -> f64 {
        let h = cell.displacement_gradients(Self::table(), &local(&cell.nodes, d));
        let smallest = |least: f64, j: f64| if j.is_nan() { f64::NEG_INFINITY } else { least.min(j) };
        h.iter().map(|h| determinant(&plus_identity(h, 1.0, 0.0))).fold(f64::INFINITY, smallest)
    }

    /// An element's stress points, with what F̄ needs from its integration points.
    fn averaged_points(&self, cell: &Cell<N, B, M>, state: State<'_>) -> AveragedPoints<N> {
        let (table, d) = (Self::table(), cell.local(state));
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

/// The integration points of a second-order element, as elements with memory need them; `None` if a
/// Jacobian is not positive.
pub(crate) fn reference_points(x: &[[f64; 3]], nodes: &[u32], formulation: Formulation) -> Option<Reference> {
    fn points<const N: usize, const B: usize, const P: usize, const M: usize>(
        x: &[[f64; 3]],
        nodes: &[u32],
    ) -> Option<Reference>
    where
        Group<N, B, P, M>: Kind<N, B, P>,
    {
        let nodes: [u32; N] = nodes.try_into().ok()?;
        let table = Group::<N, B, P, M>::table();
        let cell = Cell::<N, B, M>::new(table, &corners(x, &nodes), nodes, 0, 0)?;
        let points = table.points();
        let at = |x: &[AtPoints; B], q: usize| x[q / POINTS][q % POINTS];
        let share = |q: usize, p: usize| -> f64 {
            cell.modes.iter().map(|mode| at(mode, q) * at(mode, p) * at(&cell.weights, p)).sum()
        };
        let gradients = (0..points).map(|q| cell.gradients(table, q).to_vec()).collect();
        let weights = (0..points).map(|q| at(&cell.weights, q)).collect();
        let average = (0..points).map(|q| (0..points).map(|p| share(q, p)).collect()).collect();
        Some(Reference { gradients, weights, average })
    }
    match (nodes.len(), formulation) {
        (10, _) => points::<10, 1, 16, 1>(x, nodes),
        (18, _) => points::<18, 2, 32, 1>(x, nodes),
        (_, Formulation::Reduced) => points::<27, 1, 32, 4>(x, nodes),
        (_, Formulation::Full | Formulation::FBar) => points::<27, 4, 32, 4>(x, nodes),
    }
}

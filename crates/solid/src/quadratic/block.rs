//! All elements of one second-order kind; compiled for the instruction set that is detected at run time.

use super::cell::{Cell, Corners, scaled};
use super::interpolated::{force, interpolated, tangent};
use super::kernel::Scratch;
use super::{Group, Kind};
use crate::assembly::{find_pairs, local};
use crate::block::{
    Build, ElementBlock, PullBack, State, StressSlopes, VisitStresses, Weights, all_or_flat, corners, in_chunks, visit,
    write,
};
use crate::clusters::Target;
use crate::heat::Power;
use crate::hex8::transposed;
use crate::inelastic::{Energies, PointElement};
use crate::interpolation::ElementScaling;
use crate::section::Section;
use crate::stress;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use slipstick_linalg::BlockPattern;
use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

/// Number of elements that a thread processes at a time.
const CHUNK: usize = 16;

impl<const N: usize, const B: usize, const P: usize, const M: usize> Group<N, B, P, M>
where
    Self: Kind<N, B, P>,
{
    /// The elements with these numbers.
    pub fn block(build: Build<'_>) -> Option<Arc<dyn ElementBlock>> {
        let Build { mesh, numbers, section_of, flat, .. } = build;
        let group = Self::new(mesh, numbers, section_of, flat);
        (!group.cells.is_empty()).then(|| Arc::new(group) as _)
    }
}

impl<const N: usize, const B: usize, const P: usize, const M: usize> ElementBlock for Group<N, B, P, M>
where
    Self: Kind<N, B, P>,
{
    fn positions(&self, pattern: &BlockPattern) -> Vec<u32> {
        let mut out = vec![0; N * N * self.cells.len()];
        let chunks = out.par_chunks_mut(N * N).zip(&self.cells);
        chunks.for_each(|(out, cell)| find_pairs(pattern, &cell.nodes, out));
        out
    }

    fn add_forces(&self, state: State<'_>, direction: Option<&[f64]>, nodes: &mut [[f64; 3]]) -> Vec<u32> {
        self.clusters.assemble(nodes, |cluster, target, inverted| {
            Arch::new().dispatch(AddForces { group: self, cluster, state, direction, target, inverted });
        })
    }

    fn add_tangents(&self, state: State<'_>, positions: &[u32], values: &mut [[f64; 9]]) -> Vec<u32> {
        assert_eq!(positions.len(), N * N * self.cells.len(), "the scatter belongs to a different model");
        self.clusters.assemble(values, |cluster, target, inverted| {
            Arch::new().dispatch(AddTangents { group: self, cluster, state, positions, target, inverted });
        })
    }

    fn pull_back(&self, state: State<'_>, weights: Weights<'_>, into: &mut PullBack<'_>) -> Vec<u32> {
        let (Some(adjoint), Some((slopes, out))) = (weights.forces, &mut into.density) else { return Vec::new() };
        let mut products = vec![0.0; self.cells.len()];
        let rejected = in_chunks(&self.cells, &mut products, CHUNK, |cells, out, inverted| {
            Arch::new().dispatch(PullBackCells::<N, B, P, M, Self> {
                cells,
                state,
                slopes,
                adjoint,
                out,
                inverted,
                group: self,
            });
        });
        for (cell, product) in self.cells.iter().zip(products) {
            out[cell.number as usize] += product;
        }
        rejected
    }

    fn write_volumes(&self, out: &mut [f64]) {
        write(&self.cells, Cell::volume, Cell::number, out);
    }

    fn write_energies(&self, state: State<'_>, out: &mut [Energies]) {
        write(&self.cells, |cell| Energies::elastic(self.energy(cell, state)), Cell::number, out);
    }

    fn write_determinants(&self, d: &[f64], out: &mut [f64]) {
        write(&self.cells, |cell| self.smallest_determinant(cell, d), Cell::number, out);
    }

    fn visit_stresses(&self, state: State<'_>, to: &mut VisitStresses<'_>) {
        let of = |cell: &Cell<N, B, M>| {
            let (section, gamma) = (&state.sections[cell.section as usize], state.scalings[cell.number()].gamma);
            stress::at_points(section, self.averaged_points(cell, state).deformation(section, gamma))
        };
        visit(&self.cells, of, |cell, stresses| to(cell.number(), &stresses));
    }

    fn pull_back_stresses(&self, state: State<'_>, weights: &stress::Weights<'_>, into: &mut StressSlopes<'_>) {
        for cell in &self.cells {
            let Some(own) = weights.of(cell.number()) else { continue };
            let (section, gamma) = (&state.sections[cell.section as usize], state.scalings[cell.number()].gamma);
            let (forces, by_gamma) = self.averaged_points(cell, state).pull_back(section, gamma, own);
            let factor = state.by_displacement(cell.number(), cell.section as usize);
            into.add(cell.number(), &cell.nodes, (factor, &forces), by_gamma);
        }
    }

    fn at_positions(&self, x: &[[f64; 3]], _: &[Section]) -> Result<Arc<dyn ElementBlock>, Vec<u32>> {
        let moved = |cell: &Cell<N, B, M>| {
            let moved = Cell::new(Self::table(), &corners(x, &cell.nodes), cell.nodes, cell.number, cell.section);
            moved.ok_or(cell.number)
        };
        let cells = all_or_flat(self.cells.par_iter().map(moved).collect())?;
        Ok(Arc::new(Self { cells, clusters: self.clusters.clone() }))
    }

    fn places(&self) -> usize {
        self.cells.len()
    }

    fn points(&self, place: usize) -> Option<Cow<'_, PointElement>> {
        let (cell, table) = (&self.cells[place], Self::table());
        let gradients = (0..table.points()).map(|p| cell.gradients(table, p).to_vec()).collect();
        let weights = cell.weights.as_flattened()[..table.points()].to_vec();
        Some(Cow::Owned(PointElement::elastic((&cell.nodes, cell.number, cell.section), gradients, weights)))
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
        let (state, sections) = (self.state, self.state.sections);
        let (mut scratch, table) = (Scratch::new(), <Group<N, B, P, M> as Kind<N, B, P>>::table());
        for cell in self.group.cells[self.cluster].iter().filter(|cell| !state.skips(cell.number)) {
            let power = if self.direction.is_some() { Power::Tangent } else { Power::Force };
            let (section, scaling) = (&sections[cell.section as usize], cell.scaling(state, power));
            let d = cell.local(state);
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
    positions: &'a [u32],
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
        let (state, sections) = (self.state, self.state.sections);
        let (mut scratch, table) = (Scratch::new(), <Group<N, B, P, M> as Kind<N, B, P>>::table());
        let cells = self.group.cells[self.cluster.clone()].iter();
        let positions = self.positions.chunks_exact(N * N).skip(self.cluster.start);
        for (cell, positions) in cells.zip(positions).filter(|(cell, _)| !state.skips(cell.number)) {
            let (section, scaling) = (&sections[cell.section as usize], cell.scaling(state, Power::Tangent));
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
            let done = tangent(simd, table, &mut scratch, section, cell, scaling, &cell.local(state), &mut add);
            if done.is_none() {
                self.inverted.push(cell.number);
            }
        }
    }
}

struct PullBackCells<'a, const N: usize, const B: usize, const P: usize, const M: usize, G> {
    cells: &'a [Cell<N, B, M>],
    state: State<'a>,
    slopes: &'a [ElementScaling],
    adjoint: &'a [f64],
    out: &'a mut [f64],
    inverted: &'a mut Vec<u32>,
    group: &'a G,
}

impl<const N: usize, const B: usize, const P: usize, const M: usize> WithSimd
    for PullBackCells<'_, N, B, P, M, Group<N, B, P, M>>
where
    Group<N, B, P, M>: Kind<N, B, P>,
{
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let _ = self.group;
        let (state, sections) = (self.state, self.state.sections);
        let (mut scratch, table) = (Scratch::new(), <Group<N, B, P, M> as Kind<N, B, P>>::table());
        for (cell, out) in self.cells.iter().zip(self.out) {
            let section = &sections[cell.section as usize];
            let (scaling, slope) = (cell.scaling(state, Power::Force), self.slopes[cell.number as usize]);
            if slope == ElementScaling::NONE || slope.factor == 0.0 && state.skips(cell.number) {
                continue;
            }
            let slope = state.scaled(slope, cell.number(), cell.section as usize, Power::Force);
            let (d, lambda) = (cell.local(state), local(&cell.nodes, self.adjoint));
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

//! All tetrahedra of first order, eight at a time; compiled for the instruction set that is detected at
//! run time.

use super::{Batch, LANES, Work, pull_back};
use crate::assembly::{add, add_to_nodes, find_pairs, local};
use crate::block::{Build, ElementBlock, PullBack, State, StressSlopes, VisitStresses, Weights, in_chunks, visit};
use crate::clusters::{Clusters, Target};
use crate::inelastic::{Energies, PointElement};
use crate::interpolation::ElementScaling;
use crate::section::Section;
use crate::stress;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use slipstick_linalg::BlockPattern;
use slipstick_mesh::{Element, Mesh};
use std::borrow::Cow;
use std::sync::Arc;

/// Number of batches that a thread processes at a time.
const CHUNK: usize = 64;
/// Positions of a batch's blocks.
const POSITIONS: usize = 16 * LANES;

/// All elements of this kind, or those of this rank.
#[derive(Debug)]
pub(crate) struct Tetrahedra {
    /// In the order of `clusters`.
    batches: Vec<Batch>,
    clusters: Clusters,
}

/// The elements with these numbers.
pub(crate) fn block(build: Build<'_>) -> Option<Arc<dyn ElementBlock>> {
    let Build { mesh, numbers, section_of, flat, .. } = build;
    let mut batches = Vec::with_capacity(numbers.len() / LANES + 1);
    let clusters = Clusters::new(mesh, numbers).replaced(|cluster| {
        let before = batches.len();
        for same in cluster.chunk_by(|&a, &b| section_of[a as usize] == section_of[b as usize]) {
            for part in same.chunks(LANES) {
                match batch(mesh, part, section_of[part[0] as usize]) {
                    Ok(batch) => batches.push(batch),
                    Err(elements) => flat.extend(elements),
                }
            }
        }
        batches.len() - before
    });
    (!batches.is_empty()).then(|| Arc::new(Tetrahedra { batches, clusters }) as _)
}

/// A batch of tetrahedra, given by their numbers.
fn batch(mesh: &Mesh, numbers: &[u32], section: u32) -> Result<Batch, Vec<u32>> {
    let nodes = |number: &u32| match mesh.elements[*number as usize] {
        Element::Tet4(nodes) => Some((*number, nodes)),
        _ => None,
    };
    let elements: Vec<(u32, [u32; 4])> = numbers.iter().filter_map(nodes).collect();
    Batch::new(&mesh.nodes, &elements, section as usize)
}

impl Tetrahedra {
    /// Writes what `of` returns for each element, by its number.
    fn write<T: Send>(&self, of: impl Fn(&Batch, usize) -> T + Sync, out: &mut [T]) {
        self.visit(of, |number, value| out[number] = value);
    }

    /// Calls `each` with the number of each element and what `of` returns for it.
    fn visit<T: Send>(&self, of: impl Fn(&Batch, usize) -> T + Sync, mut each: impl FnMut(usize, T)) {
        let of_batch = |batch: &Batch| -> Vec<T> { (0..batch.numbers().len()).map(|lane| of(batch, lane)).collect() };
        visit(&self.batches, of_batch, |batch, values| {
            batch.numbers().iter().zip(values).for_each(|(&number, value)| each(number as usize, value));
        });
    }
}

fn stress_points(batch: &Batch, lane: usize, state: State<'_>) -> stress::Points<4> {
    let d = state.local(&batch.nodes[lane], batch.numbers()[lane] as usize, batch.section);
    stress::Points::new(vec![batch.shape_gradients(lane)], vec![batch.volumes[lane]], &d)
}

impl ElementBlock for Tetrahedra {
    fn positions(&self, pattern: &BlockPattern) -> Vec<u32> {
        let mut out = vec![0; POSITIONS * self.batches.len()];
        out.par_chunks_mut(POSITIONS).zip(&self.batches).for_each(|(out, batch)| {
            out.chunks_exact_mut(16).zip(&batch.nodes).for_each(|(out, nodes)| find_pairs(pattern, nodes, out));
        });
        out
    }

    fn add_forces(&self, state: State<'_>, direction: Option<&[f64]>, nodes: &mut [[f64; 3]]) -> Vec<u32> {
        self.clusters.assemble(nodes, |cluster, target, inverted| {
            let batches = &self.batches[cluster];
            Arch::new().dispatch(AddForces { batches, state, direction, target, inverted });
        })
    }

    fn add_tangents(&self, state: State<'_>, positions: &[u32], values: &mut [[f64; 9]]) -> Vec<u32> {
        assert_eq!(positions.len(), POSITIONS * self.batches.len(), "the scatter belongs to a different model");
        let positions = positions.as_chunks::<16>().0.as_chunks::<LANES>().0;
        self.clusters.assemble(values, |cluster, target, inverted| {
            let (batches, positions) = (&self.batches[cluster.clone()], &positions[cluster]);
            Arch::new().dispatch(AddTangents { batches, positions, state, target, inverted });
        })
    }

    fn pull_back(&self, state: State<'_>, weights: Weights<'_>, into: &mut PullBack<'_>) -> Vec<u32> {
        let (Some(adjoint), Some((slopes, out))) = (weights.forces, &mut into.density) else { return Vec::new() };
        let mut products = vec![[0.0; LANES]; self.batches.len()];
        let inverted = in_chunks(&self.batches, &mut products, CHUNK, |batches, out, inverted| {
            Arch::new().dispatch(PullBackBatches { batches, state, slopes, adjoint, out, inverted });
        });
        for (batch, products) in self.batches.iter().zip(products) {
            for (&number, product) in batch.numbers().iter().zip(products) {
                out[number as usize] += product;
            }
        }
        inverted
    }

    fn write_volumes(&self, out: &mut [f64]) {
        self.write(|batch, lane| batch.volumes[lane], out);
    }

    fn write_energies(&self, state: State<'_>, out: &mut [Energies]) {
        let of = |batch: &Batch, lane: usize| Energies::elastic(batch.energy(lane, state));
        self.write(of, out);
    }

    fn write_determinants(&self, d: &[f64], out: &mut [f64]) {
        self.write(|batch, lane| batch.determinant(lane, d), out);
    }

    fn visit_stresses(&self, state: State<'_>, to: &mut VisitStresses<'_>) {
        let of = |batch: &Batch, lane: usize| {
            let section = &state.sections[batch.section];
            let gamma = state.scalings[batch.numbers()[lane] as usize].gamma;
            stress::at_points(section, stress_points(batch, lane, state).deformation(section, gamma))
        };
        self.visit(of, |number, stresses| to(number, &stresses));
    }

    fn pull_back_stresses(&self, state: State<'_>, weights: &stress::Weights<'_>, into: &mut StressSlopes<'_>) {
        for batch in &self.batches {
            for (lane, &number) in batch.numbers().iter().enumerate() {
                let e = number as usize;
                let Some(own) = weights.of(e) else { continue };
                let points = stress_points(batch, lane, state);
                let gamma = state.scalings[e].gamma;
                let (forces, by_gamma) = points.pull_back(&state.sections[batch.section], gamma, own);
                into.add(e, &batch.nodes[lane], (state.by_displacement(e, batch.section), &forces), by_gamma);
            }
        }
    }

    fn at_positions(&self, x: &[[f64; 3]], _: &[Section]) -> Result<Arc<dyn ElementBlock>, Vec<u32>> {
        let moved = |batch: &Batch| {
            let elements: Vec<(u32, [u32; 4])> = batch.numbers().iter().copied().zip(batch.nodes).collect();
            Batch::new(x, &elements, batch.section)
        };
        let (mut batches, mut flat) = (Vec::with_capacity(self.batches.len()), Vec::new());
        for batch in self.batches.par_iter().map(moved).collect::<Vec<_>>() {
            batch.map_or_else(|elements| flat.extend(elements), |batch| batches.push(batch));
        }
        if flat.is_empty() { Ok(Arc::new(Self { batches, clusters: self.clusters.clone() })) } else { Err(flat) }
    }

    fn places(&self) -> usize {
        LANES * self.batches.len()
    }

    fn points(&self, place: usize) -> Option<Cow<'_, PointElement>> {
        let (batch, lane) = (&self.batches[place / LANES], place % LANES);
        let element = (&batch.nodes[lane][..], *batch.numbers().get(lane)?, batch.section as u32);
        let (gradients, weights) = (vec![batch.shape_gradients(lane).to_vec()], vec![batch.volumes[lane]]);
        Some(Cow::Owned(PointElement::elastic(element, gradients, weights)))
    }
}

/// Adds internal forces of tetrahedra to the nodes, or, with a direction, products of the tangent
/// with it.
struct AddForces<'a> {
    batches: &'a [Batch],
    state: State<'a>,
    direction: Option<&'a [f64]>,
    target: &'a Target<'a, [f64; 3]>,
    inverted: &'a mut Vec<u32>,
}

impl WithSimd for AddForces<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let mut work = Work::new();
        let moves = |nodes: &[u32; 4], v: &[f64]| local(nodes, v).as_flattened().iter().any(|&v| v != 0.0);
        let counts = |batch: &&Batch| batch.numbers().iter().any(|&number| !self.state.skips(number));
        for batch in self.batches.iter().filter(counts) {
            match self.direction {
                None => work.internal_force(simd, batch, self.state),
                Some(v) if !batch.nodes.iter().any(|nodes| moves(nodes, v)) => continue,
                Some(v) => work.tangent_product(simd, batch, self.state, v),
            }
            for (lane, &number) in batch.numbers().iter().enumerate() {
                let nodes = &batch.nodes[lane];
                if self.direction.is_some_and(|v| !moves(nodes, v)) {
                    continue;
                }
                let forces = work.forces(lane);
                if forces.as_flattened().iter().all(|f| f.is_finite()) {
                    add_to_nodes(nodes, &forces, self.target);
                } else {
                    self.inverted.push(number);
                }
            }
        }
    }
}

/// Adds tangents of tetrahedra to the blocks of a matrix.
struct AddTangents<'a> {
    batches: &'a [Batch],
    state: State<'a>,
    positions: &'a [[[u32; 16]; LANES]],
    target: &'a Target<'a, [f64; 9]>,
    inverted: &'a mut Vec<u32>,
}

impl WithSimd for AddTangents<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let mut work = Work::new();
        let counts = |batch: &Batch| batch.numbers().iter().any(|&number| !self.state.skips(number));
        for (batch, positions) in self.batches.iter().zip(self.positions).filter(|(batch, _)| counts(batch)) {
            work.tangents(simd, batch, self.state);
            for (lane, &number) in batch.numbers().iter().enumerate() {
                if !work.is_admissible(lane) {
                    self.inverted.push(number);
                    continue;
                }
                for (&position, block) in positions[lane].iter().zip(work.tangent(lane)) {
                    // SAFETY: the positions are those of pairs of the element's nodes.
                    add(unsafe { self.target.at(position as usize) }, block);
                }
            }
        }
    }
}

/// λ · ∂f/∂φ of tetrahedra, one number per element of each batch; 0 if nothing depends on the
/// density.
struct PullBackBatches<'a> {
    batches: &'a [Batch],
    state: State<'a>,
    slopes: &'a [ElementScaling],
    adjoint: &'a [f64],
    out: &'a mut [[f64; LANES]],
    inverted: &'a mut Vec<u32>,
}

impl WithSimd for PullBackBatches<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let mut work = Work::new();
        let depends = |number: u32| {
            let slope = self.slopes[number as usize];
            slope != ElementScaling::NONE && (slope.factor != 0.0 || !self.state.skips(number))
        };
        for (batch, out) in self.batches.iter().zip(self.out) {
            if !batch.numbers().iter().any(|&number| depends(number)) {
                continue;
            }
            let products = pull_back(simd, &mut work, batch, self.state, self.slopes, self.adjoint);
            for (lane, &number) in batch.numbers().iter().enumerate().filter(|&(_, &number)| depends(number)) {
                out[lane] = products[lane];
                if !products[lane].is_finite() {
                    self.inverted.push(number);
                }
            }
        }
    }
}

//! The contributions of the elements of a cluster, hexahedra and wedges first, then batches of
//! tetrahedra; compiled for the instruction set that is detected at run time.

use crate::clusters::Target;
use crate::hex8::kernel::Scratch;
use crate::hex8::{interpolated, transposed};
use crate::interpolation::ElementScaling;
use crate::model::Hexahedron;
use crate::section::Section;
use crate::tet4::{self, Batch, Work};
use pulp::{Simd, WithSimd};

/// Adds internal forces to the nodes.
pub(crate) struct AddForces<'a> {
    pub sections: &'a [Section],
    pub elements: &'a [Hexahedron],
    pub d: &'a [f64],
    pub scalings: &'a [ElementScaling],
    pub target: &'a Target<'a, [f64; 3]>,
    pub inverted: &'a mut Vec<u32>,
}

impl WithSimd for AddForces<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let mut scratch = Scratch::new();
        for element in self.elements {
            let (section, scaling) = (&self.sections[element.section()], self.scalings[element.number()]);
            let d = local(&element.nodes, self.d);
            match interpolated::internal_force(simd, &mut scratch, section, &element.geometry, scaling, &d) {
                Some(force) => add_to_nodes(&element.nodes, &force, self.target),
                None => self.inverted.push(element.number),
            }
        }
    }
}

/// Adds products of the tangent with a direction to the nodes.
pub(crate) struct AddProducts<'a> {
    pub sections: &'a [Section],
    pub elements: &'a [Hexahedron],
    pub d: &'a [f64],
    pub scalings: &'a [ElementScaling],
    pub direction: &'a [f64],
    pub target: &'a Target<'a, [f64; 3]>,
    pub inverted: &'a mut Vec<u32>,
}

impl WithSimd for AddProducts<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let mut scratch = Scratch::new();
        for element in self.elements {
            let v = local(&element.nodes, self.direction);
            if v.as_flattened().iter().all(|&v| v == 0.0) {
                continue;
            }
            let (section, scaling) = (&self.sections[element.section()], self.scalings[element.number()]);
            let d = local(&element.nodes, self.d);
            match interpolated::tangent_product(simd, &mut scratch, section, &element.geometry, scaling, &d, &v) {
                Some(force) => add_to_nodes(&element.nodes, &force, self.target),
                None => self.inverted.push(element.number),
            }
        }
    }
}

/// Adds tangents to the blocks of a matrix.
pub(crate) struct AddTangents<'a> {
    pub sections: &'a [Section],
    pub elements: &'a [Hexahedron],
    pub d: &'a [f64],
    pub scalings: &'a [ElementScaling],
    pub positions: &'a [[u32; 64]],
    pub target: &'a Target<'a, [f64; 9]>,
    pub inverted: &'a mut Vec<u32>,
}

impl WithSimd for AddTangents<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let mut scratch = Scratch::new();
        for (element, positions) in self.elements.iter().zip(self.positions) {
            let (section, scaling) = (&self.sections[element.section()], self.scalings[element.number()]);
            let d = local(&element.nodes, self.d);
            let done = interpolated::tangent(
                simd,
                &mut scratch,
                section,
                &element.geometry,
                scaling,
                &d,
                #[inline(always)]
                |i, k, block| {
                    // SAFETY: the positions are those of pairs of the element's nodes.
                    add(unsafe { self.target.at(positions[8 * i + k] as usize) }, block);
                    // Coincident corners of a wedge share one position, where their blocks are
                    // summed.
                    if i != k {
                        // SAFETY: as above.
                        add(unsafe { self.target.at(positions[8 * k + i] as usize) }, transposed(block));
                    }
                },
            );
            if done.is_none() {
                self.inverted.push(element.number);
            }
        }
    }
}

/// λ · ∂f/∂φ of elements, one number per element; 0 if nothing depends on the density.
pub(crate) struct PullBack<'a> {
    pub sections: &'a [Section],
    pub elements: &'a [Hexahedron],
    pub d: &'a [f64],
    pub scalings: &'a [ElementScaling],
    pub slopes: &'a [ElementScaling],
    pub adjoint: &'a [f64],
    pub out: &'a mut [f64],
    pub inverted: &'a mut Vec<u32>,
}

impl WithSimd for PullBack<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let mut scratch = Scratch::new();
        for (element, out) in self.elements.iter().zip(self.out) {
            let scalings = [self.scalings[element.number()], self.slopes[element.number()]];
            if scalings[1] == ElementScaling::NONE {
                *out = 0.0;
                continue;
            }
            let section = &self.sections[element.section()];
            let (d, lambda) = (local(&element.nodes, self.d), local(&element.nodes, self.adjoint));
            match interpolated::pull_back(simd, &mut scratch, section, &element.geometry, scalings, &d, &lambda) {
                Some(product) => *out = product,
                None => self.inverted.push(element.number),
            }
        }
    }
}

/// Adds internal forces of tetrahedra to the nodes, or, with a direction, products of the tangent
/// with it.
pub(crate) struct AddBatchForces<'a> {
    pub sections: &'a [Section],
    pub batches: &'a [Batch],
    pub d: &'a [f64],
    pub scalings: &'a [ElementScaling],
    pub direction: Option<&'a [f64]>,
    pub target: &'a Target<'a, [f64; 3]>,
    pub inverted: &'a mut Vec<u32>,
}

impl WithSimd for AddBatchForces<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let mut work = Work::new();
        let moves = |nodes: &[u32; 4], v: &[f64]| local(nodes, v).as_flattened().iter().any(|&v| v != 0.0);
        for batch in self.batches {
            let material = &self.sections[batch.section].material;
            match self.direction {
                None => work.internal_force(simd, batch, material, self.scalings, self.d),
                Some(v) if !batch.nodes.iter().any(|nodes| moves(nodes, v)) => continue,
                Some(v) => work.tangent_product(simd, batch, material, self.scalings, self.d, v),
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
pub(crate) struct AddBatchTangents<'a> {
    pub sections: &'a [Section],
    pub batches: &'a [Batch],
    pub d: &'a [f64],
    pub scalings: &'a [ElementScaling],
    pub positions: &'a [[[u32; 16]; tet4::LANES]],
    pub target: &'a Target<'a, [f64; 9]>,
    pub inverted: &'a mut Vec<u32>,
}

impl WithSimd for AddBatchTangents<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let mut work = Work::new();
        for (batch, positions) in self.batches.iter().zip(self.positions) {
            work.tangents(simd, batch, &self.sections[batch.section].material, self.scalings, self.d);
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
pub(crate) struct PullBackBatches<'a> {
    pub sections: &'a [Section],
    pub batches: &'a [Batch],
    pub d: &'a [f64],
    pub scalings: &'a [ElementScaling],
    pub slopes: &'a [ElementScaling],
    pub adjoint: &'a [f64],
    pub out: &'a mut [[f64; tet4::LANES]],
    pub inverted: &'a mut Vec<u32>,
}

impl WithSimd for PullBackBatches<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let mut work = Work::new();
        let depends = |number: u32| self.slopes[number as usize] != ElementScaling::NONE;
        for (batch, out) in self.batches.iter().zip(self.out) {
            if !batch.numbers().iter().any(|&number| depends(number)) {
                continue;
            }
            let material = &self.sections[batch.section].material;
            let scalings = [self.scalings, self.slopes];
            let products = tet4::pull_back(simd, &mut work, batch, material, scalings, self.d, self.adjoint);
            for (lane, &number) in batch.numbers().iter().enumerate().filter(|&(_, &number)| depends(number)) {
                out[lane] = products[lane];
                if !products[lane].is_finite() {
                    self.inverted.push(number);
                }
            }
        }
    }
}

/// The entries of a nodal vector at the corners of an element.
#[inline(always)]
pub(crate) fn local<const N: usize>(nodes: &[u32; N], v: &[f64]) -> [[f64; 3]; N] {
    let mut out = [[0.0; 3]; N];
    for (out, &node) in out.iter_mut().zip(nodes) {
        out.copy_from_slice(&v[3 * node as usize..][..3]);
    }
    out
}

#[inline(always)]
fn add_to_nodes<const N: usize>(nodes: &[u32; N], force: &[[f64; 3]; N], target: &Target<'_, [f64; 3]>) {
    for (&node, force) in nodes.iter().zip(*force) {
        // SAFETY: a node of the element.
        add(unsafe { target.at(node as usize) }, force);
    }
}

#[inline(always)]
fn add<const N: usize>(target: &mut [f64; N], term: [f64; N]) {
    for c in 0..N {
        target[c] += term[c];
    }
}

//! What the elements of a cluster contribute, compiled for the instruction set found at run time.

use crate::clusters::Target;
use crate::hex8::kernel::Scratch;
use crate::hex8::{interpolated, transposed};
use crate::interpolation::ElementScaling;
use crate::model::Element;
use crate::section::Section;
use pulp::{Simd, WithSimd};

/// Adds internal forces to the nodes.
pub(crate) struct AddForces<'a> {
    pub sections: &'a [Section],
    pub elements: &'a [Element],
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
            let done = interpolated::internal_force(
                simd,
                &mut scratch,
                section,
                &element.geometry,
                scaling,
                &d,
                #[inline(always)]
                |force| add_to_nodes(&element.nodes, force, self.target),
            );
            if done.is_none() {
                self.inverted.push(element.number);
            }
        }
    }
}

/// Adds products of the tangent with a direction to the nodes.
pub(crate) struct AddProducts<'a> {
    pub sections: &'a [Section],
    pub elements: &'a [Element],
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
            let done = interpolated::tangent_product(
                simd,
                &mut scratch,
                section,
                &element.geometry,
                scaling,
                &d,
                &v,
                #[inline(always)]
                |force| add_to_nodes(&element.nodes, force, self.target),
            );
            if done.is_none() {
                self.inverted.push(element.number);
            }
        }
    }
}

/// Adds tangents to the blocks of a matrix.
pub(crate) struct AddTangents<'a> {
    pub sections: &'a [Section],
    pub elements: &'a [Element],
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

/// λ · ∂f/∂φ of elements, one number per element; 0 where nothing depends on the density.
pub(crate) struct PullBack<'a> {
    pub sections: &'a [Section],
    pub elements: &'a [Element],
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
            if scalings[1] == (ElementScaling { factor: 0.0, gamma: 0.0 }) {
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

/// The entries of a nodal vector at the corners of an element.
#[inline(always)]
pub(crate) fn local(nodes: &[u32; 8], v: &[f64]) -> [[f64; 3]; 8] {
    let mut out = [[0.0; 3]; 8];
    for (out, &node) in out.iter_mut().zip(nodes) {
        out.copy_from_slice(&v[3 * node as usize..][..3]);
    }
    out
}

#[inline(always)]
fn add_to_nodes(hex: &[u32; 8], force: &[[f64; 3]; 8], target: &Target<'_, [f64; 3]>) {
    for (&node, force) in hex.iter().zip(*force) {
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

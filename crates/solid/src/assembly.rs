//! What the elements of a cluster contribute, compiled for the instruction set found at run time.

use crate::clusters::Target;
use crate::hex8::kernel::{self, Scratch};
use crate::hex8::transposed;
use crate::material::NeoHooke;
use crate::model::Element;
use pulp::{Simd, WithSimd};

/// Adds internal forces to the nodes.
pub(crate) struct AddForces<'a> {
    pub materials: &'a [NeoHooke],
    pub elements: &'a [Element],
    pub d: &'a [f64],
    pub factors: &'a [f64],
    pub target: &'a Target<'a, [f64; 3]>,
    pub inverted: &'a mut Vec<u32>,
}

impl WithSimd for AddForces<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let mut scratch = Scratch::new();
        for element in self.elements {
            let (material, factor) = (&self.materials[element.material()], self.factors[element.number()]);
            let d = local(&element.nodes, self.d);
            match kernel::internal_force(simd, &mut scratch, material, &element.geometry, factor, &d) {
                Some(force) => add_to_nodes(&element.nodes, &force, self.target),
                None => self.inverted.push(element.number),
            }
        }
    }
}

/// Adds products of the tangent with a direction to the nodes.
pub(crate) struct AddProducts<'a> {
    pub materials: &'a [NeoHooke],
    pub elements: &'a [Element],
    pub d: &'a [f64],
    pub factors: &'a [f64],
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
            let (material, factor) = (&self.materials[element.material()], self.factors[element.number()]);
            let d = local(&element.nodes, self.d);
            match kernel::tangent_product(simd, &mut scratch, material, &element.geometry, factor, &d, &v) {
                Some(force) => add_to_nodes(&element.nodes, &force, self.target),
                None => self.inverted.push(element.number),
            }
        }
    }
}

/// Adds tangents to the blocks of a matrix.
pub(crate) struct AddTangents<'a> {
    pub materials: &'a [NeoHooke],
    pub elements: &'a [Element],
    pub d: &'a [f64],
    pub factors: &'a [f64],
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
            let (material, factor) = (&self.materials[element.material()], self.factors[element.number()]);
            let d = local(&element.nodes, self.d);
            let done = kernel::tangent(
                simd,
                &mut scratch,
                material,
                &element.geometry,
                factor,
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

/// λ · f of elements at the material's own stiffness, one number per element.
pub(crate) struct PullBack<'a> {
    pub materials: &'a [NeoHooke],
    pub elements: &'a [Element],
    pub d: &'a [f64],
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
            let material = &self.materials[element.material()];
            let d = local(&element.nodes, self.d);
            match kernel::internal_force(simd, &mut scratch, material, &element.geometry, 1.0, &d) {
                Some(force) => {
                    let lambda = local(&element.nodes, self.adjoint);
                    *out = 0.0;
                    for (f, l) in force.as_flattened().iter().zip(lambda.as_flattened()) {
                        *out += f * l;
                    }
                }
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

//! Elements of one kind: all that a model asks of them.
//!
//! A new element implements [`ElementBlock`] and gets a row in [`KINDS`].

use crate::heat::Heat;
use crate::inelastic::{self, Energies, Inelastic, PointElement};
use crate::interpolation::ElementScaling;
use crate::quadratic::{Hex27, ReducedHex27, Tet10, Wedge18};
use crate::section::{Formulation, Section};
use crate::stress::{self, STRESS_POINTS, Tensor};
use crate::{hex8, tet4};
use rayon::prelude::*;
use slipstick_linalg::BlockPattern;
use slipstick_mesh::{Element, Mesh};
use std::borrow::Cow;
use std::fmt::Debug;
use std::sync::Arc;

/// A kind of elements.
pub(crate) struct Kind {
    /// Whether elements of this type, with or without memory, integrated like this, belong to the kind.
    pub takes: fn(&Element, bool, Formulation) -> bool,
    /// Builds their block; `None` if there are none.
    pub build: fn(Build<'_>) -> Option<Arc<dyn ElementBlock>>,
}

/// All kinds, in the order in which their contributions are added.
pub(crate) const KINDS: &[Kind] = &[
    Kind { takes: |element, memory, _| !memory && element.as_hex().is_some(), build: hex8::block },
    Kind { takes: |element, memory, _| !memory && matches!(element, Element::Tet4(_)), build: tet4::block },
    Kind { takes: |element, memory, _| !memory && matches!(element, Element::Tet10(_)), build: Tet10::block },
    Kind { takes: |element, memory, _| !memory && matches!(element, Element::Wedge18(_)), build: Wedge18::block },
    Kind {
        takes: |element, memory, of| !memory && matches!(element, Element::Hex27(_)) && of != Formulation::Reduced,
        build: Hex27::block,
    },
    Kind {
        takes: |element, memory, of| !memory && matches!(element, Element::Hex27(_)) && of == Formulation::Reduced,
        build: ReducedHex27::block,
    },
    Kind { takes: |_, memory, _| memory, build: inelastic::block },
];

/// What blocks are built from.
pub(crate) struct Build<'a> {
    pub mesh: &'a Mesh,
    /// The elements that the block takes, by the mesh's numbers.
    pub numbers: Vec<u32>,
    pub sections: &'a [Section],
    /// By the mesh's number of the element, on all ranks.
    pub section_of: &'a [u32],
    /// Receives the elements without a positive Jacobian.
    pub flat: &'a mut Vec<u32>,
}

/// A state of a step. Lists are indexed by the mesh's numbers.
#[derive(Clone, Copy)]
pub(crate) struct State<'a> {
    pub sections: &'a [Section],
    /// Displacements, three per node.
    pub d: &'a [f64],
    pub scalings: &'a [ElementScaling],
    /// History of the elements with memory at the start of the step; empty: at rest.
    pub history: &'a [f64],
    /// Free expansion of the elements; `None`: none.
    pub heat: Option<Heat<'a>>,
    /// Whether this is a term of the energy that most elements may lack: those with a zero factor do not count.
    pub partial: bool,
}

impl State<'_> {
    /// Whether an element has no part in this term.
    #[inline(always)]
    pub fn skips(&self, element: u32) -> bool {
        self.partial && self.scalings[element as usize].factor == 0.0
    }
}

/// Weights of the equations: λ for the forces, η for the new history.
#[derive(Clone, Copy)]
pub(crate) struct Weights<'a> {
    pub forces: Option<&'a [f64]>,
    pub history: Option<&'a [f64]>,
}

/// Transposed derivatives, all of them added.
#[derive(Default)]
pub(crate) struct PullBack<'a> {
    /// With respect to displacements: that of the new history only. The derivative of the forces is the
    /// tangent.
    pub displacements: Option<&'a mut [f64]>,
    /// With respect to the previous history.
    pub history: Option<&'a mut [f64]>,
    /// With respect to the densities, through slopes of the scalings.
    pub density: Option<(&'a [ElementScaling], &'a mut [f64])>,
}

/// Derivatives of a function of the stresses at a state, all of them added.
pub(crate) struct StressSlopes<'a> {
    pub displacements: &'a mut [f64],
    pub history: &'a mut [f64],
    /// StressSlopes of the scalings, and the derivatives with respect to densities.
    pub density: (&'a [ElementScaling], &'a mut [f64]),
}

impl StressSlopes<'_> {
    /// Adds the derivatives of one element; `factor` applies to those with respect to displacements.
    pub fn add(&mut self, element: usize, nodes: &[u32], (factor, forces): (f64, &[[f64; 3]]), by_gamma: f64) {
        for (&node, force) in nodes.iter().zip(forces) {
            (0..3).for_each(|c| self.displacements[3 * node as usize + c] += factor * force[c]);
        }
        self.density.1[element] += self.density.0[element].gamma * by_gamma;
    }
}

/// Takes the number of an element and the stresses at its points.
pub(crate) type VisitStresses<'a> = dyn FnMut(usize, &[Tensor; STRESS_POINTS]) + 'a;

/// Elements of one kind. Methods that return element numbers return those that are inverted; what they
/// have written is then meaningless. No result depends on the number of threads.
pub(crate) trait ElementBlock: Debug + Send + Sync {
    /// Positions in a pattern of the blocks of each element, in an order of the implementation.
    fn positions(&self, pattern: &BlockPattern) -> Vec<u32>;

    /// Adds internal forces to the nodes or, with a direction, products of the tangent with it.
    fn add_forces(&self, state: State<'_>, direction: Option<&[f64]>, nodes: &mut [[f64; 3]]) -> Vec<u32>;

    /// Adds tangents to the blocks of a matrix.
    ///
    /// # Panics
    /// If the positions are those of other elements.
    fn add_tangents(&self, state: State<'_>, positions: &[u32], values: &mut [[f64; 9]]) -> Vec<u32>;

    /// Adds the transposed derivatives of λ · f + η · h′.
    fn pull_back(&self, state: State<'_>, weights: Weights<'_>, into: &mut PullBack<'_>) -> Vec<u32>;

    /// Writes the volume of each element, Σ w, by its number. \[L³\]
    fn write_volumes(&self, out: &mut [f64]);

    /// Writes the energies of each element, by its number; NaN if it is inverted.
    fn write_energies(&self, state: State<'_>, out: &mut [Energies]);

    /// Writes the smallest J of each element over its integration points, by its number; −∞ if it is not
    /// a number.
    fn write_determinants(&self, d: &[f64], out: &mut [f64]);

    /// Calls `visit` with the number of each element and the Cauchy stresses of the solid material at its
    /// stress points.
    fn visit_stresses(&self, state: State<'_>, visit: &mut VisitStresses<'_>);

    /// Adds the derivatives of Σ w σ_v over the stress points.
    fn pull_back_stresses(&self, state: State<'_>, weights: &stress::Weights<'_>, into: &mut StressSlopes<'_>);

    /// The same elements, in the same order, with nodes at other reference positions, or the elements that have no
    /// positive Jacobian there.
    fn at_positions(&self, x: &[[f64; 3]], sections: &[Section]) -> Result<Arc<dyn ElementBlock>, Vec<u32>>;

    /// Number of places that elements may occupy.
    fn places(&self) -> usize;

    /// The element at a place, with its integration points, but without the averages of F̄; `None` if there is none.
    fn points(&self, place: usize) -> Option<Cow<'_, PointElement>>;

    /// The elements, if their law has memory.
    fn memory(&self) -> Option<&Inelastic> {
        None
    }
}

/// The positions of an element's nodes.
pub(crate) fn corners<const N: usize>(x: &[[f64; 3]], nodes: &[u32; N]) -> [[f64; 3]; N] {
    nodes.map(|node| x[node as usize])
}

/// All elements, or those that have no reference geometry.
pub(crate) fn all_or_flat<E>(elements: Vec<Result<E, u32>>) -> Result<Vec<E>, Vec<u32>> {
    let flat: Vec<u32> = elements.iter().filter_map(|element| element.as_ref().err().copied()).collect();
    if flat.is_empty() { Ok(elements.into_iter().flatten().collect()) } else { Err(flat) }
}

/// Writes what `of` returns for each element, by its number.
pub(crate) fn write<E: Sync, T: Send>(
    elements: &[E],
    of: impl Fn(&E) -> T + Sync,
    number: impl Fn(&E) -> usize,
    out: &mut [T],
) {
    visit(elements, of, |element, found| out[number(element)] = found);
}

/// Calls `each` with every element and what `of` returns for it, in order. `of` runs in parallel, for some
/// elements at a time, so that their results need little memory.
pub(crate) fn visit<E: Sync, T: Send>(elements: &[E], of: impl Fn(&E) -> T + Sync, mut each: impl FnMut(&E, T)) {
    const AT_ONCE: usize = 1024;
    for elements in elements.chunks(AT_ONCE) {
        let found: Vec<T> = elements.par_iter().map(&of).collect();
        elements.iter().zip(found).for_each(|(element, found)| each(element, found));
    }
}

/// Calls `work` with chunks of the elements and of `out`, in parallel. Returns the elements that it
/// rejected.
pub(crate) fn in_chunks<E: Sync, T: Send>(
    elements: &[E],
    out: &mut [T],
    size: usize,
    work: impl Fn(&[E], &mut [T], &mut Vec<u32>) + Sync,
) -> Vec<u32> {
    let chunks = out.par_chunks_mut(size).zip(elements.par_chunks(size));
    let rejected = chunks.flat_map_iter(|(out, elements)| {
        let mut rejected = Vec::new();
        work(elements, out, &mut rejected);
        rejected
    });
    rejected.collect()
}

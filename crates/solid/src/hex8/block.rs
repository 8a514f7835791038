//! All hexahedra of first order, and wedges represented as hexahedra; compiled for the instruction set
//! that is detected at run time.

use super::kernel::Scratch;
use super::{POINTS, ReferenceGeometry, energy, interpolated, smallest_determinant, transposed};
use crate::assembly::{add, add_to_nodes, local, positions};
use crate::block::{
    Build, ElementBlock, PullBack, State, StressSlopes, VisitStresses, Weights, all_or_flat, corners, in_chunks, visit,
    write,
};
use crate::clusters::{Clusters, Target};
use crate::heat::Power;
use crate::inelastic::{Energies, PointElement};
use crate::interpolation::ElementScaling;
use crate::section::Section;
use crate::stress::{self, STRESS_POINTS};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use slipstick_linalg::BlockPattern;
use std::borrow::Cow;
use std::sync::Arc;

/// Number of elements that a thread processes at a time.
const CHUNK: usize = 64;

/// All elements of this kind, or those of this rank.
#[derive(Debug)]
pub(crate) struct Hexahedra {
    /// In the order of `clusters`.
    elements: Vec<Hexahedron>,
    clusters: Clusters,
}

/// All data that the integrals over a hexahedron or wedge read, in one place.
#[derive(Debug)]
struct Hexahedron {
    geometry: ReferenceGeometry,
    /// For a wedge, nodes of coincident corners appear twice; their contributions are summed.
    nodes: [u32; 8],
    /// The mesh's number of the element.
    number: u32,
    section: u32,
}

impl Hexahedron {
    #[inline(always)]
    fn number(&self) -> usize {
        self.number as usize
    }

    #[inline(always)]
    fn section(&self) -> usize {
        self.section as usize
    }

    fn stress_points(&self, state: State<'_>) -> stress::Points<8> {
        let gradients = (0..STRESS_POINTS).map(|p| self.geometry.shape_gradients(p)).collect();
        let weights = (0..STRESS_POINTS).map(|p| self.geometry.weight(p)).collect();
        stress::Points::new(gradients, weights, &self.local(state))
    }

    /// The displacements of its nodes without thermal expansion.
    #[inline(always)]
    fn local(&self, state: State<'_>) -> [[f64; 3]; 8] {
        state.local(&self.nodes, self.number(), self.section())
    }

    #[inline(always)]
    fn scaling(&self, state: State<'_>, power: Power) -> ElementScaling {
        state.scaling(self.number(), self.section(), power)
    }
}

/// The elements with these numbers.
pub(crate) fn block(build: Build<'_>) -> Option<Arc<dyn ElementBlock>> {
    let Build { mesh, numbers, section_of, flat, .. } = build;
    let clusters = Clusters::new(mesh, numbers);
    let elements: Vec<Result<Hexahedron, u32>> = clusters
        .order
        .par_iter()
        .filter_map(|&number| {
            let nodes = mesh.elements[number as usize].as_hex()?;
            let section = section_of[number as usize];
            let geometry = ReferenceGeometry::new(&mesh.coordinates(&nodes));
            Some(geometry.map(|geometry| Hexahedron { geometry, nodes, number, section }).ok_or(number))
        })
        .collect();
    flat.extend(elements.iter().filter_map(|e| e.as_ref().err().copied()));
    let elements: Vec<Hexahedron> = elements.into_iter().flatten().collect();
    (!elements.is_empty()).then(|| Arc::new(Hexahedra { elements, clusters }) as _)
}

impl ElementBlock for Hexahedra {
    fn positions(&self, pattern: &BlockPattern) -> Vec<u32> {
        positions::<64, _>(&self.elements, pattern, |element| &element.nodes)
    }

    fn add_forces(&self, state: State<'_>, direction: Option<&[f64]>, nodes: &mut [[f64; 3]]) -> Vec<u32> {
        self.clusters.assemble(nodes, |cluster, target, inverted| {
            let elements = &self.elements[cluster];
            match direction {
                None => Arch::new().dispatch(AddForces { elements, state, target, inverted }),
                Some(direction) => {
                    Arch::new().dispatch(AddProducts { elements, state, direction, target, inverted });
                }
            }
        })
    }

    fn add_tangents(&self, state: State<'_>, positions: &[u32], values: &mut [[f64; 9]]) -> Vec<u32> {
        assert_eq!(positions.len(), 64 * self.elements.len(), "the scatter belongs to a different model");
        let positions = positions.as_chunks::<64>().0;
        self.clusters.assemble(values, |cluster, target, inverted| {
            let (elements, positions) = (&self.elements[cluster.clone()], &positions[cluster]);
            Arch::new().dispatch(AddTangents { elements, positions, state, target, inverted });
        })
    }

    fn pull_back(&self, state: State<'_>, weights: Weights<'_>, into: &mut PullBack<'_>) -> Vec<u32> {
        let (Some(adjoint), Some((slopes, out))) = (weights.forces, &mut into.density) else { return Vec::new() };
        let mut products = vec![0.0; self.elements.len()];
        let inverted = in_chunks(&self.elements, &mut products, CHUNK, |elements, out, inverted| {
            Arch::new().dispatch(PullBackHexahedra { elements, state, slopes, adjoint, out, inverted });
        });
        self.elements.iter().zip(products).for_each(|(element, product)| out[element.number()] += product);
        inverted
    }

    fn write_volumes(&self, out: &mut [f64]) {
        self.elements.iter().for_each(|element| out[element.number()] = element.geometry.volume());
    }

    fn write_energies(&self, state: State<'_>, out: &mut [Energies]) {
        let of = |element: &Hexahedron| {
            let (section, scaling) = (&state.sections[element.section()], element.scaling(state, Power::Energy));
            let elastic = energy(section, scaling, &element.geometry, &element.local(state));
            Energies::elastic(elastic)
        };
        write(&self.elements, of, Hexahedron::number, out);
    }

    fn write_determinants(&self, d: &[f64], out: &mut [f64]) {
        let of = |element: &Hexahedron| smallest_determinant(&element.geometry, &local(&element.nodes, d));
        write(&self.elements, of, Hexahedron::number, out);
    }

    fn visit_stresses(&self, state: State<'_>, to: &mut VisitStresses<'_>) {
        let of = |element: &Hexahedron| {
            let (section, gamma) = (&state.sections[element.section()], state.scalings[element.number()].gamma);
            stress::at_points(section, element.stress_points(state).deformation(section, gamma))
        };
        visit(&self.elements, of, |element, stresses| to(element.number(), &stresses));
    }

    fn pull_back_stresses(&self, state: State<'_>, weights: &stress::Weights<'_>, into: &mut StressSlopes<'_>) {
        let of = |element: &Hexahedron| {
            let own = weights.of(element.number())?;
            let section = &state.sections[element.section()];
            Some(element.stress_points(state).pull_back(section, state.scalings[element.number()].gamma, own))
        };
        let found: Vec<_> = self.elements.par_iter().map(of).collect();
        for (element, found) in self.elements.iter().zip(found) {
            if let Some((forces, by_gamma)) = found {
                let factor = state.by_displacement(element.number(), element.section());
                into.add(element.number(), &element.nodes, (factor, &forces), by_gamma);
            }
        }
    }

    fn at_positions(&self, x: &[[f64; 3]], _: &[Section]) -> Result<Arc<dyn ElementBlock>, Vec<u32>> {
        let moved = |&Hexahedron { nodes, number, section, .. }: &Hexahedron| {
            let geometry = ReferenceGeometry::new(&corners(x, &nodes));
            geometry.map(|geometry| Hexahedron { geometry, nodes, number, section }).ok_or(number)
        };
        let elements = all_or_flat(self.elements.par_iter().map(moved).collect())?;
        Ok(Arc::new(Self { elements, clusters: self.clusters.clone() }))
    }

    fn places(&self) -> usize {
        self.elements.len()
    }

    fn points(&self, place: usize) -> Option<Cow<'_, PointElement>> {
        let Hexahedron { geometry, nodes, number, section } = &self.elements[place];
        let gradients = (0..POINTS).map(|p| geometry.shape_gradients(p).to_vec()).collect();
        let weights = (0..POINTS).map(|p| geometry.weight(p)).collect();
        Some(Cow::Owned(PointElement::elastic((nodes, *number, *section), gradients, weights)))
    }
}

/// Adds internal forces to the nodes.
struct AddForces<'a> {
    elements: &'a [Hexahedron],
    state: State<'a>,
    target: &'a Target<'a, [f64; 3]>,
    inverted: &'a mut Vec<u32>,
}

impl WithSimd for AddForces<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let mut scratch = Scratch::new();
        for element in self.elements.iter().filter(|element| !self.state.skips(element.number)) {
            let (section, scaling) =
                (&self.state.sections[element.section()], element.scaling(self.state, Power::Force));
            let d = element.local(self.state);
            match interpolated::internal_force(simd, &mut scratch, section, &element.geometry, scaling, &d) {
                Some(force) => add_to_nodes(&element.nodes, &force, self.target),
                None => self.inverted.push(element.number),
            }
        }
    }
}

/// Adds products of the tangent with a direction to the nodes.
struct AddProducts<'a> {
    elements: &'a [Hexahedron],
    state: State<'a>,
    direction: &'a [f64],
    target: &'a Target<'a, [f64; 3]>,
    inverted: &'a mut Vec<u32>,
}

impl WithSimd for AddProducts<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let mut scratch = Scratch::new();
        for element in self.elements.iter().filter(|element| !self.state.skips(element.number)) {
            let v = local(&element.nodes, self.direction);
            if v.as_flattened().iter().all(|&v| v == 0.0) {
                continue;
            }
            let (section, scaling) =
                (&self.state.sections[element.section()], element.scaling(self.state, Power::Tangent));
            let d = element.local(self.state);
            match interpolated::tangent_product(simd, &mut scratch, section, &element.geometry, scaling, &d, &v) {
                Some(force) => add_to_nodes(&element.nodes, &force, self.target),
                None => self.inverted.push(element.number),
            }
        }
    }
}

/// Adds tangents to the blocks of a matrix.
struct AddTangents<'a> {
    elements: &'a [Hexahedron],
    state: State<'a>,
    positions: &'a [[u32; 64]],
    target: &'a Target<'a, [f64; 9]>,
    inverted: &'a mut Vec<u32>,
}

impl WithSimd for AddTangents<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let mut scratch = Scratch::new();
        let all = self.elements.iter().zip(self.positions);
        for (element, positions) in all.filter(|(element, _)| !self.state.skips(element.number)) {
            let (section, scaling) =
                (&self.state.sections[element.section()], element.scaling(self.state, Power::Tangent));
            let d = element.local(self.state);
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
struct PullBackHexahedra<'a> {
    elements: &'a [Hexahedron],
    state: State<'a>,
    slopes: &'a [ElementScaling],
    adjoint: &'a [f64],
    out: &'a mut [f64],
    inverted: &'a mut Vec<u32>,
}

impl WithSimd for PullBackHexahedra<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let mut scratch = Scratch::new();
        for (element, out) in self.elements.iter().zip(self.out) {
            let slope = self.slopes[element.number()];
            if slope == ElementScaling::NONE || slope.factor == 0.0 && self.state.skips(element.number) {
                *out = 0.0;
                continue;
            }
            let slope = self.state.scaled(slope, element.number(), element.section(), Power::Force);
            let scalings = [element.scaling(self.state, Power::Force), slope];
            let section = &self.state.sections[element.section()];
            let (d, lambda) = (element.local(self.state), local(&element.nodes, self.adjoint));
            match interpolated::pull_back(simd, &mut scratch, section, &element.geometry, scalings, &d, &lambda) {
                Some(product) => *out = product,
                None => self.inverted.push(element.number),
            }
        }
    }
}

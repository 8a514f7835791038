//! All elements of a mesh: assembled internal force, tangent and density pull-back.

use crate::assembly::{
    AddBatchForces, AddBatchTangents, AddForces, AddProducts, AddTangents, PullBack, PullBackBatches, local,
};
use crate::clusters::Clusters;
use crate::hex8::{self, ReferenceGeometry};
use crate::inelastic::{self, Energies, Given, Inelastic, Weights};
use crate::interpolation::ElementScaling;
use crate::law::Material;
use crate::quadratic::{Hex27, State, Tet10};
use crate::section::{Section, Sections};
use crate::tet4::{self, Batch};
use pulp::Arch;
use rayon::prelude::*;
use slipstick_linalg::{BlockMatrix, BlockPattern};
use slipstick_mesh::{Element, Mesh};

/// Number of elements that a thread processes at a time.
const CHUNK: usize = 64;

/// Elements whose deformation gradient, at γ u with interpolated energy, has J ≤ 0 (or is not
/// finite) at a Gauss point: the trial state is invalid. Small-strain laws have no such limit: for
/// them, only elements whose force is not finite.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{} inverted element{}, first: {}", elements.len(), if elements.len() == 1 { "" } else { "s" }, elements[0])]
pub struct InvertedElements {
    /// Element numbers, ascending; never empty.
    pub elements: Vec<u32>,
}

/// What the bodies' equations depend on besides displacements. From scalings alone, bodies with memory
/// are at rest.
#[derive(Debug, Clone, Copy)]
pub struct SolidStep<'a> {
    /// Scaling of each element by its density (see [`crate::Interpolation`]).
    pub scalings: &'a [ElementScaling],
    /// History of the elements with memory at the start of the step, [`SolidModel::history`] entries;
    /// empty: at rest. For results at a state that a step has reached, this is the history at its end:
    /// forces and tangents with it are the same.
    pub history: &'a [f64],
}

impl<'a> From<&'a [ElementScaling]> for SolidStep<'a> {
    fn from(scalings: &'a [ElementScaling]) -> Self {
        Self { scalings, history: &[] }
    }
}

impl<'a> From<&'a Vec<ElementScaling>> for SolidStep<'a> {
    fn from(scalings: &'a Vec<ElementScaling>) -> Self {
        scalings[..].into()
    }
}

impl<'a, const N: usize> From<&'a [ElementScaling; N]> for SolidStep<'a> {
    fn from(scalings: &'a [ElementScaling; N]) -> Self {
        scalings[..].into()
    }
}

/// The solid bodies of a mesh.
///
/// Displacements and forces have three entries per node.
#[derive(Debug, Clone)]
pub struct SolidModel {
    /// Hexahedra, and wedges represented as hexahedra, in the order of `clusters`.
    pub(crate) hexahedra: Vec<Hexahedron>,
    clusters: Clusters,
    /// Tetrahedra, in the order of `batch_clusters`.
    pub(crate) batches: Vec<Batch>,
    batch_clusters: Clusters,
    pub(crate) tet10: Tet10,
    pub(crate) hex27: Hex27,
    /// Elements of all types whose law has memory.
    pub(crate) inelastic: Inelastic,
    pub(crate) sections: Vec<Section>,
    /// Body and elements of those that belong to regions.
    regions: Vec<(usize, Vec<u32>)>,
    /// By the mesh's number of the element.
    section_of: Vec<u32>,
}

/// All data that the integrals over a hexahedron or wedge read, in one place.
#[derive(Debug, Clone)]
pub(crate) struct Hexahedron {
    pub geometry: ReferenceGeometry,
    /// For a wedge, nodes of coincident corners appear twice; their contributions are summed.
    pub nodes: [u32; 8],
    /// The mesh's number of the element.
    pub number: u32,
    section: u32,
}

impl Hexahedron {
    #[inline(always)]
    pub fn number(&self) -> usize {
        self.number as usize
    }

    #[inline(always)]
    pub fn section(&self) -> usize {
        self.section as usize
    }
}

/// Positions of each element's blocks, one for each pair of its nodes, in the values of a matrix,
/// element by element in the order of the model; built once per pattern.
#[derive(Debug, Clone)]
pub struct Scatter {
    positions: Vec<[u32; 64]>,
    batch_positions: Vec<[[u32; 16]; tet4::LANES]>,
    tet10_positions: Vec<Vec<u32>>,
    hex27_positions: Vec<Vec<u32>>,
    inelastic_positions: Vec<Vec<u32>>,
    /// Number of blocks of the pattern.
    blocks: usize,
}

impl SolidModel {
    /// Builds the model; `sections` has one per body of the mesh, and those of regions. A material without
    /// a formulation means fully integrated elements.
    ///
    /// # Errors
    /// If elements have a non-positive Jacobian in the reference configuration.
    ///
    /// # Panics
    /// Without one section per body.
    pub fn new(mesh: &Mesh, sections: impl Into<Sections>) -> Result<Self, InvertedElements> {
        Self::part(mesh, sections, |_| true)
    }

    /// A model of only those elements that `has` selects by their numbers. It assembles their part
    /// of a sum, and its element results are 0 for the other elements. Element and node numbers are
    /// still those of the mesh.
    ///
    /// # Errors
    /// As for [`new`](Self::new), for the selected elements.
    ///
    /// # Panics
    /// Without one section per body.
    pub fn part(
        mesh: &Mesh,
        sections: impl Into<Sections>,
        has: impl Fn(usize) -> bool,
    ) -> Result<Self, InvertedElements> {
        let Sections { list: sections, regions } = sections.into();
        assert_eq!(mesh.bodies.len() + regions.len(), sections.len(), "one section per body and region");
        let mut section_of = vec![0; mesh.elements.len()];
        for (b, body) in mesh.bodies.iter().enumerate() {
            section_of[body.elements.clone()].fill(b as u32);
        }
        for (section, (body, elements)) in (mesh.bodies.len()..).zip(&regions) {
            let own = |e: &&u32| mesh.bodies[*body].elements.contains(&(**e as usize));
            elements.iter().filter(own).for_each(|&e| section_of[e as usize] = section as u32);
        }
        let (mut hexes, mut tets, mut tet10, mut hex27) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let mut inelastic = Vec::new();
        for (number, element) in (0_u32..).zip(&mesh.elements).filter(|(number, _)| has(*number as usize)) {
            match element {
                _ if sections[section_of[number as usize] as usize].material.kind().has_memory() => {
                    inelastic.push(number);
                }
                Element::Hex8(_) | Element::Wedge6(_) => hexes.push(number),
                Element::Tet4(_) => tets.push(number),
                Element::Tet10(_) => tet10.push(number),
                Element::Hex27(_) => hex27.push(number),
            }
        }
        let clusters = Clusters::new(mesh, hexes);
        let hexahedra: Vec<Result<Hexahedron, u32>> = clusters
            .order
            .par_iter()
            .filter_map(|&number| {
                let nodes = mesh.elements[number as usize].as_hex()?;
                let section = section_of[number as usize];
                let geometry = ReferenceGeometry::new(&mesh.coordinates(&nodes));
                Some(geometry.map(|geometry| Hexahedron { geometry, nodes, number, section }).ok_or(number))
            })
            .collect();
        let mut flat: Vec<u32> = hexahedra.iter().filter_map(|e| e.as_ref().err().copied()).collect();
        let mut batches = Vec::with_capacity(tets.len() / tet4::LANES + 1);
        let batch_clusters = Clusters::new(mesh, tets).replaced(|cluster| {
            let before = batches.len();
            for same in cluster.chunk_by(|&a, &b| section_of[a as usize] == section_of[b as usize]) {
                for part in same.chunks(tet4::LANES) {
                    match batch(mesh, part, section_of[part[0] as usize]) {
                        Ok(batch) => batches.push(batch),
                        Err(elements) => flat.extend(elements),
                    }
                }
            }
            batches.len() - before
        });
        let tet10 = Tet10::new(mesh, tet10, &section_of, &mut flat);
        let hex27 = Hex27::new(mesh, hex27, &section_of, &mut flat);
        let inelastic = Inelastic::new(mesh, inelastic, &sections, &section_of, &mut flat);
        refuse(flat)?;
        let hexahedra = hexahedra.into_iter().flatten().collect();
        Ok(Self {
            hexahedra,
            clusters,
            batches,
            batch_clusters,
            tet10,
            hex27,
            inelastic,
            sections,
            regions,
            section_of,
        })
    }

    /// Number of elements.
    pub fn elements(&self) -> usize {
        self.section_of.len()
    }

    /// Length of the history: a few numbers for each integration point of elements with memory, zero at
    /// rest.
    pub fn history(&self) -> usize {
        self.inelastic.history()
    }

    /// The same elements with other sections, in the same order.
    ///
    /// # Panics
    /// If there is not one section for each of the present ones, of a law that has memory if and only if
    /// the present one has.
    pub fn with_sections(self, sections: Vec<Section>) -> Self {
        let memories =
            |sections: &[Section]| sections.iter().map(|s| s.material.kind().has_memory()).collect::<Vec<_>>();
        assert_eq!(memories(&sections), memories(&self.sections), "one section for each, of the same kind");
        Self { sections, ..self }
    }

    /// Material and formulation of every body, and then of every region.
    pub fn sections(&self) -> &[Section] {
        &self.sections
    }

    /// The body of every section.
    pub fn bodies_of_sections(&self) -> impl Iterator<Item = usize> {
        (0..self.sections.len() - self.regions.len()).chain(self.regions.iter().map(|(body, _)| *body))
    }

    /// The sections with their elements, from which the same model can be built for another part.
    pub fn all_sections(&self) -> Sections {
        Sections { list: self.sections.clone(), regions: self.regions.clone() }
    }

    /// The material of an element.
    pub fn material(&self, element: usize) -> &Material {
        &self.sections[self.section_of[element] as usize].material
    }

    /// Element volumes by the model's quadrature, Σ w. \[L³\]
    pub fn element_volumes(&self) -> Vec<f64> {
        let mut out = self.by_number(|element| element.geometry.volume(), |batch, lane| batch.volumes[lane]);
        self.tet10.add_by_number(|cell| cell.volume(), &mut out);
        self.hex27.add_by_number(|cell| cell.volume(), &mut out);
        self.inelastic.elements.iter().for_each(|e| out[e.number as usize] = e.weights.iter().sum());
        out
    }

    /// Assembled internal force. \[F\]. Does not depend on the number of threads, bit for bit.
    ///
    /// # Errors
    /// [`InvertedElements`]; `out` is then unspecified.
    pub fn internal_force<'a>(
        &self,
        d: &[f64],
        step: impl Into<SolidStep<'a>>,
        out: &mut [f64],
    ) -> Result<(), InvertedElements> {
        let step = step.into();
        let scalings = step.scalings;
        out.fill(0.0);
        let sections = &self.sections[..];
        let nodes = out.as_chunks_mut::<3>().0;
        let mut rejected = self.clusters.assemble(nodes, |cluster, target, inverted| {
            let elements = &self.hexahedra[cluster];
            Arch::new().dispatch(AddForces { elements, sections, d, scalings, target, inverted });
        });
        rejected.extend(self.add_batch_forces(d, scalings, None, nodes));
        rejected.extend(self.add_quadratic_forces(d, scalings, None, nodes));
        rejected.extend(self.inelastic.add_forces(self.given(step), d, nodes));
        refuse(rejected)
    }

    fn state<'a>(&'a self, d: &'a [f64], scalings: &'a [ElementScaling]) -> State<'a> {
        State { sections: &self.sections, d, scalings }
    }

    pub(crate) fn given<'a>(&'a self, step: SolidStep<'a>) -> Given<'a> {
        Given { sections: &self.sections, scalings: step.scalings, history: step.history }
    }

    /// The same of the second-order elements.
    fn add_quadratic_forces(
        &self,
        d: &[f64],
        scalings: &[ElementScaling],
        direction: Option<&[f64]>,
        nodes: &mut [[f64; 3]],
    ) -> Vec<u32> {
        let mut rejected = self.tet10.add_forces(self.state(d, scalings), direction, nodes);
        rejected.extend(self.hex27.add_forces(self.state(d, scalings), direction, nodes));
        rejected
    }

    /// Adds forces of the tetrahedra, or products of their tangents with a direction; returns the
    /// inverted ones.
    fn add_batch_forces(
        &self,
        d: &[f64],
        scalings: &[ElementScaling],
        direction: Option<&[f64]>,
        nodes: &mut [[f64; 3]],
    ) -> Vec<u32> {
        let sections = &self.sections[..];
        self.batch_clusters.assemble(nodes, |cluster, target, inverted| {
            let batches = &self.batches[cluster];
            Arch::new().dispatch(AddBatchForces { batches, sections, d, scalings, direction, target, inverted });
        })
    }

    /// Finds the position of every element block in the pattern.
    ///
    /// # Panics
    /// If the pattern lacks a pair of nodes that share an element.
    pub fn scatter(&self, pattern: &BlockPattern) -> Scatter {
        let place = |i: u32, k: u32| -> u32 {
            pattern.find(i as usize, k as usize).expect("pattern holds all element pairs") as u32
        };
        let of_hexahedron =
            |nodes: &[u32; 8]| -> [u32; 64] { std::array::from_fn(|e| place(nodes[e / 8], nodes[e % 8])) };
        let of_tetrahedron =
            |nodes: [u32; 4]| -> [u32; 16] { std::array::from_fn(|e| place(nodes[e / 4], nodes[e % 4])) };
        Scatter {
            positions: self.hexahedra.par_iter().map(|element| of_hexahedron(&element.nodes)).collect(),
            batch_positions: self.batches.par_iter().map(|batch| batch.nodes.map(of_tetrahedron)).collect(),
            tet10_positions: self.tet10.positions(pattern),
            hex27_positions: self.hex27.positions(pattern),
            inelastic_positions: self.inelastic.positions(pattern),
            blocks: pattern.blocks(),
        }
    }

    /// Adds the tangent ∂f_int/∂d to a matrix; this model made `scatter` from the pattern of the
    /// matrix. The result does not depend on the number of threads, bit for bit.
    ///
    /// # Errors
    /// [`InvertedElements`]; the matrix is then unspecified.
    ///
    /// # Panics
    /// If `scatter` was made for a different number of blocks or elements.
    pub fn add_tangent<'a>(
        &self,
        d: &[f64],
        step: impl Into<SolidStep<'a>>,
        scatter: &Scatter,
        matrix: &mut BlockMatrix,
    ) -> Result<(), InvertedElements> {
        let step = step.into();
        let scalings = step.scalings;
        assert_eq!(
            scatter.inelastic_positions.len(),
            self.inelastic.elements.len(),
            "the scatter belongs to a different model"
        );
        assert_eq!(scatter.blocks, matrix.pattern().blocks(), "the scatter was made for a different pattern");
        let lengths = (scatter.positions.len(), scatter.batch_positions.len());
        assert_eq!(lengths, (self.hexahedra.len(), self.batches.len()), "the scatter belongs to a different model");
        let lengths = (scatter.tet10_positions.len(), scatter.hex27_positions.len());
        assert_eq!(
            lengths,
            (self.tet10.cells.len(), self.hex27.cells.len()),
            "the scatter belongs to a different model"
        );
        let sections = &self.sections[..];
        let mut rejected = self.clusters.assemble(matrix.values_mut(), |cluster, target, inverted| {
            let (elements, positions) = (&self.hexahedra[cluster.clone()], &scatter.positions[cluster]);
            Arch::new().dispatch(AddTangents { elements, positions, sections, d, scalings, target, inverted });
        });
        rejected.extend(self.batch_clusters.assemble(matrix.values_mut(), |cluster, target, inverted| {
            let (batches, positions) = (&self.batches[cluster.clone()], &scatter.batch_positions[cluster]);
            Arch::new().dispatch(AddBatchTangents { batches, positions, sections, d, scalings, target, inverted });
        }));
        let state = self.state(d, scalings);
        rejected.extend(self.tet10.add_tangents(state, &scatter.tet10_positions, matrix.values_mut()));
        rejected.extend(self.hex27.add_tangents(state, &scatter.hex27_positions, matrix.values_mut()));
        let given = self.given(step);
        rejected.extend(self.inelastic.add_tangents(given, d, &scatter.inelastic_positions, matrix.values_mut()));
        refuse(rejected)
    }

    /// Adds K v with K = ∂f_int/∂d, without a matrix: the product that an objective of internal
    /// forces needs. K is symmetric, so the result is also Kᵀ v. Elements are skipped if v vanishes
    /// at all their nodes. The result does not depend on the number of threads, bit for bit.
    ///
    /// # Errors
    /// [`InvertedElements`]; `out` is then unspecified.
    pub fn add_tangent_product<'a>(
        &self,
        d: &[f64],
        step: impl Into<SolidStep<'a>>,
        v: &[f64],
        out: &mut [f64],
    ) -> Result<(), InvertedElements> {
        let step = step.into();
        let scalings = step.scalings;
        let sections = &self.sections[..];
        let nodes = out.as_chunks_mut::<3>().0;
        let mut rejected = self.clusters.assemble(nodes, |cluster, target, inverted| {
            let elements = &self.hexahedra[cluster];
            Arch::new().dispatch(AddProducts { elements, sections, d, scalings, direction: v, target, inverted });
        });
        rejected.extend(self.add_batch_forces(d, scalings, Some(v), nodes));
        rejected.extend(self.add_quadratic_forces(d, scalings, Some(v), nodes));
        rejected.extend(self.inelastic.add_products(self.given(step), d, v, nodes));
        refuse(rejected)
    }

    /// Adds λᵀ ∂f_int/∂φ_e of every element to `out`; `slopes` holds the derivatives of the
    /// scalings with respect to the densities φ_e. Elements whose scaling does not depend on the
    /// density are skipped.
    ///
    /// Paper: (88), (89). Tests: `kernels_agree_with_the_reference_element`,
    /// `interpolated_pull_back_matches_differences`.
    ///
    /// # Errors
    /// [`InvertedElements`]; `out` is then unchanged.
    pub fn pull_back_density<'a>(
        &self,
        d: &[f64],
        step: impl Into<SolidStep<'a>>,
        slopes: &[ElementScaling],
        adjoint: &[f64],
        out: &mut [f64],
    ) -> Result<(), InvertedElements> {
        let step = step.into();
        let scalings = step.scalings;
        let sections = &self.sections[..];
        let mut products = vec![0.0; self.hexahedra.len()];
        let chunks = products.par_chunks_mut(CHUNK).zip(self.hexahedra.par_chunks(CHUNK));
        let inverted = chunks.flat_map_iter(|(out, elements)| {
            let mut inverted = Vec::new();
            Arch::new().dispatch(PullBack {
                elements,
                sections,
                d,
                scalings,
                slopes,
                adjoint,
                out,
                inverted: &mut inverted,
            });
            inverted
        });
        let mut rejected: Vec<u32> = inverted.collect();
        let mut batch_products = vec![[0.0; tet4::LANES]; self.batches.len()];
        let chunks = batch_products.par_chunks_mut(CHUNK).zip(self.batches.par_chunks(CHUNK));
        rejected.par_extend(chunks.flat_map_iter(|(out, batches)| {
            let mut inverted = Vec::new();
            Arch::new().dispatch(PullBackBatches {
                batches,
                sections,
                d,
                scalings,
                slopes,
                adjoint,
                out,
                inverted: &mut inverted,
            });
            inverted
        }));
        let state = self.state(d, scalings);
        let mut quadratic = vec![0.0; self.elements()];
        rejected.extend(self.tet10.pull_back(state, slopes, adjoint, &mut quadratic));
        rejected.extend(self.hex27.pull_back(state, slopes, adjoint, &mut quadratic));
        let weights = Weights { forces: Some(adjoint), history: None };
        let into = inelastic::PullBack { displacements: None, history: None, density: Some((slopes, &mut quadratic)) };
        rejected.extend(self.inelastic.pull_back(self.given(step), d, weights, into));
        refuse(rejected)?;
        out.iter_mut().zip(quadratic).for_each(|(to, from)| *to += from);
        for (element, product) in self.hexahedra.iter().zip(products) {
            out[element.number()] += product;
        }
        for (batch, products) in self.batches.iter().zip(batch_products) {
            for (&number, product) in batch.numbers().iter().zip(products) {
                out[number as usize] += product;
            }
        }
        Ok(())
    }

    /// Total strain energy. \[F L\]
    ///
    /// # Errors
    /// [`InvertedElements`].
    pub fn energy<'a>(&self, d: &[f64], step: impl Into<SolidStep<'a>>) -> Result<f64, InvertedElements> {
        Ok(self.energies(d, step)?.iter().sum())
    }

    /// Strain energy of each element; 0 for elements of other ranks. \[F L\]
    ///
    /// # Errors
    /// [`InvertedElements`].
    pub fn energies<'a>(&self, d: &[f64], step: impl Into<SolidStep<'a>>) -> Result<Vec<f64>, InvertedElements> {
        let step = step.into();
        let scalings = step.scalings;
        let of_hexahedron = |element: &Hexahedron| {
            let (section, scaling) = (&self.sections[element.section()], scalings[element.number()]);
            hex8::energy(section, scaling, &element.geometry, &local(&element.nodes, d)).unwrap_or(f64::NAN)
        };
        let of_tetrahedron = |batch: &Batch, lane: usize| {
            let scaling = scalings[batch.numbers()[lane] as usize];
            batch.energy(lane, &self.sections[batch.section].material, scaling, d).unwrap_or(f64::NAN)
        };
        let mut energies = self.by_number(of_hexahedron, of_tetrahedron);
        let state = self.state(d, scalings);
        self.tet10.add_by_number(|cell| self.tet10.energy(cell, state).unwrap_or(f64::NAN), &mut energies);
        self.hex27.add_by_number(|cell| self.hex27.energy(cell, state).unwrap_or(f64::NAN), &mut energies);
        let mut inelastic = vec![Energies::default(); if self.history() > 0 { self.elements() } else { 0 }];
        self.inelastic.add_energies(self.given(step), d, &mut inelastic);
        energies.iter_mut().zip(inelastic).for_each(|(energy, of)| *energy += of.elastic);
        refuse((0_u32..).zip(&energies).filter(|(_, w)| !w.is_finite()).map(|(e, _)| e).collect())?;
        Ok(energies)
    }

    /// Smallest J of each element, regardless of its scaling: an element with interpolated energy
    /// may have J ≤ 0.
    pub fn smallest_determinants(&self, d: &[f64]) -> Vec<f64> {
        let mut out = self.by_number(
            |element| hex8::smallest_determinant(&element.geometry, &local(&element.nodes, d)),
            |batch, lane| batch.determinant(lane, d),
        );
        self.tet10.add_by_number(|cell| self.tet10.smallest_determinant(cell, d), &mut out);
        self.hex27.add_by_number(|cell| self.hex27.smallest_determinant(cell, d), &mut out);
        self.inelastic.add_determinants(d, &mut out);
        out
    }

    /// One number per element of first order, in the order of the mesh; 0 for the others.
    fn by_number(
        &self,
        of_hexahedron: impl Fn(&Hexahedron) -> f64 + Sync,
        of_tetrahedron: impl Fn(&Batch, usize) -> f64 + Sync,
    ) -> Vec<f64> {
        let values: Vec<f64> = self.hexahedra.par_iter().map(&of_hexahedron).collect();
        let mut out = vec![0.0; self.elements()];
        for (element, value) in self.hexahedra.iter().zip(values) {
            out[element.number()] = value;
        }
        let of_batch = |batch: &Batch| -> Vec<f64> {
            (0..batch.numbers().len()).map(|lane| of_tetrahedron(batch, lane)).collect()
        };
        let values: Vec<Vec<f64>> = self.batches.par_iter().map(of_batch).collect();
        for (batch, values) in self.batches.iter().zip(values) {
            for (&number, value) in batch.numbers().iter().zip(values) {
                out[number as usize] = value;
            }
        }
        out
    }
}

/// A batch of tetrahedra, given by their numbers.
fn batch(mesh: &Mesh, numbers: &[u32], section: u32) -> Result<Batch, Vec<u32>> {
    let nodes = |number: &u32| match mesh.elements[*number as usize] {
        Element::Tet4(nodes) => Some((*number, nodes)),
        _ => None,
    };
    let elements: Vec<(u32, [u32; 4])> = numbers.iter().filter_map(nodes).collect();
    Batch::new(mesh, &elements, section as usize)
}

pub(crate) fn refuse(mut elements: Vec<u32>) -> Result<(), InvertedElements> {
    elements.sort_unstable();
    if elements.is_empty() { Ok(()) } else { Err(InvertedElements { elements }) }
}

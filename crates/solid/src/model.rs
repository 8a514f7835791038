//! All elements of a mesh: assembled internal force, tangent and density pull-back.

use crate::block::{Build, ElementBlock, KINDS, PullBack, State, Weights};
use crate::evaluations::{Counter, Evaluation};
use crate::heat::Heat;
use crate::inelastic::{self, Energies};
use crate::interpolation::ElementScaling;
use crate::law::Material;
use crate::section::{Section, Sections};
use crate::softened::{Term, Terms};
use slipstick_linalg::{BlockMatrix, BlockPattern};
use slipstick_mesh::Mesh;
use std::sync::Arc;

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
    /// Stretch of the free thermal expansion of each element, 1 + α ΔT; empty: no expansion.
    pub stretches: &'a [f64],
}

impl<'a> From<&'a [ElementScaling]> for SolidStep<'a> {
    fn from(scalings: &'a [ElementScaling]) -> Self {
        Self { scalings, history: &[], stretches: &[] }
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
    /// The elements, kind by kind.
    pub(crate) blocks: Vec<Arc<dyn ElementBlock>>,
    /// Length of the history, on all ranks.
    history: usize,
    sections: Vec<Section>,
    /// Body and elements of those that belong to regions.
    regions: Vec<(usize, Vec<u32>)>,
    /// By the mesh's number of the element.
    section_of: Vec<u32>,
    /// Of the nodes, three each.
    pub(crate) coordinates: Arc<[f64]>,
    pub(crate) counter: Counter,
}

/// Positions of each element's blocks, one for each pair of its nodes, in the values of a matrix,
/// element by element in the order of the model; built once per pattern.
#[derive(Debug, Clone)]
pub struct Scatter {
    /// Of each block of elements.
    positions: Vec<Vec<u32>>,
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
        Self::build(mesh, sections.into(), &has)
    }

    /// [`part`](Self::part) without type parameters: it names the kernels of all elements, which then are compiled
    /// in this crate only.
    fn build(mesh: &Mesh, sections: Sections, has: &dyn Fn(usize) -> bool) -> Result<Self, InvertedElements> {
        let Sections { list: sections, regions } = sections;
        assert_eq!(mesh.bodies.len() + regions.len(), sections.len(), "one section per body and region");
        let mut section_of = vec![0; mesh.elements.len()];
        for (b, body) in mesh.bodies.iter().enumerate() {
            section_of[body.elements.clone()].fill(b as u32);
        }
        for (section, (body, elements)) in (mesh.bodies.len()..).zip(&regions) {
            let own = |e: &&u32| mesh.bodies[*body].elements.contains(&(**e as usize));
            elements.iter().filter(own).for_each(|&e| section_of[e as usize] = section as u32);
        }
        let section = |number: u32| &sections[section_of[number as usize] as usize];
        let memory = |number: u32| section(number).material.kind().has_memory();
        let (mut blocks, mut flat) = (Vec::new(), Vec::new());
        for kind in KINDS {
            let takes = |e: u32| (kind.takes)(&mesh.elements[e as usize], memory(e), section(e).formulation);
            let taken = |e: &u32| has(*e as usize) && takes(*e);
            let numbers: Vec<u32> = (0..mesh.elements.len() as u32).filter(taken).collect();
            let build = Build { mesh, numbers, sections: &sections, section_of: &section_of, flat: &mut flat };
            blocks.extend((kind.build)(build));
        }
        refuse(flat)?;
        let history = inelastic::history(mesh, &sections, &section_of);
        let coordinates = mesh.nodes.iter().flatten().copied().collect();
        Ok(Self { blocks, history, sections, regions, section_of, coordinates, counter: Counter::default() })
    }

    /// How often each [`Evaluation`] was computed, in the order of [`Evaluation::ALL`], by this model and its
    /// clones.
    pub fn evaluations(&self) -> [u64; Evaluation::ALL.len()] {
        self.counter.counts()
    }

    /// Number of elements.
    pub fn elements(&self) -> usize {
        self.section_of.len()
    }

    /// Length of the history: a few numbers for each integration point of elements with memory, zero at
    /// rest.
    pub fn history(&self) -> usize {
        self.history
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

    /// The same elements, in the same order, with nodes at other reference positions `x`.
    ///
    /// # Errors
    /// If elements have a non-positive Jacobian there.
    ///
    /// # Panics
    /// If there is not one position for each node.
    pub fn at_positions(&self, x: &[[f64; 3]]) -> Result<Self, InvertedElements> {
        assert_eq!(3 * x.len(), self.coordinates.len(), "one position for each node");
        let (mut blocks, mut flat) = (Vec::with_capacity(self.blocks.len()), Vec::new());
        for block in &self.blocks {
            match block.at_positions(x, &self.sections) {
                Ok(block) => blocks.push(block),
                Err(elements) => flat.extend(elements),
            }
        }
        refuse(flat)?;
        Ok(Self { blocks, coordinates: x.as_flattened().into(), ..self.clone() })
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

    /// Mass of an element of the solid per reference volume. \[M/L³\]
    pub fn mass_density(&self, element: usize) -> f64 {
        self.sections[self.section_of[element] as usize].mass_density
    }

    /// Coefficient of thermal expansion α of an element. \[1/temperature\]
    pub fn thermal_expansion(&self, element: usize) -> f64 {
        self.sections[self.section_of[element] as usize].thermal_expansion
    }

    /// Element volumes by the model's quadrature, Σ w. \[L³\]
    pub fn element_volumes(&self) -> Vec<f64> {
        let mut out = vec![0.0; self.elements()];
        self.blocks.iter().for_each(|block| block.write_volumes(&mut out));
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
        self.counter.count(Evaluation::Force);
        out.fill(0.0);
        self.add_forces(self.state(d, step.into()), None, out)
    }

    /// Adds internal forces or, with a direction, products of the tangent with it.
    fn add_forces(&self, state: State<'_>, direction: Option<&[f64]>, out: &mut [f64]) -> Result<(), InvertedElements> {
        let nodes = out.as_chunks_mut::<3>().0;
        let mut inverted = Vec::new();
        for (term, state) in self.terms(state).each() {
            inverted.extend(self.blocks_of(term).flat_map(|block| block.add_forces(state, direction, nodes)));
        }
        refuse(inverted)
    }

    /// The blocks that have a term.
    fn blocks_of(&self, term: Term) -> impl Iterator<Item = &Arc<dyn ElementBlock>> {
        self.blocks.iter().filter(move |block| term.has(&***block))
    }

    /// The terms of the energy at a state.
    pub(crate) fn terms<'a>(&'a self, state: State<'a>) -> Terms<'a> {
        Terms::new(state, &self.section_of)
    }

    pub(crate) fn state<'a>(&'a self, d: &'a [f64], step: SolidStep<'a>) -> State<'a> {
        let SolidStep { scalings, history, stretches } = step;
        let coordinates = &self.coordinates[..];
        let heat = (!stretches.is_empty()).then_some(Heat { coordinates, stretches });
        State { sections: &self.sections, d, scalings, history, heat, partial: false }
    }

    /// Adds transposed derivatives.
    pub(crate) fn pull_back(
        &self,
        state: State<'_>,
        weights: Weights<'_>,
        into: &mut PullBack<'_>,
    ) -> Result<(), InvertedElements> {
        self.counter.count(Evaluation::PullBack);
        let terms = self.terms(state);
        let mut inverted = Vec::new();
        for (term, state) in terms.each() {
            let slopes = match &into.density {
                Some((slopes, _)) if term != Term::Whole => Some(terms.slopes(term, slopes)),
                _ => None,
            };
            let mut part = PullBack {
                displacements: into.displacements.as_deref_mut(),
                history: into.history.as_deref_mut(),
                density: into.density.as_mut().map(|(whole, out)| (slopes.as_deref().unwrap_or(whole), &mut **out)),
            };
            inverted.extend(self.blocks_of(term).flat_map(|block| block.pull_back(state, weights, &mut part)));
        }
        refuse(inverted)
    }

    /// Finds the position of every element block in the pattern.
    ///
    /// # Panics
    /// If the pattern lacks a pair of nodes that share an element.
    pub fn scatter(&self, pattern: &BlockPattern) -> Scatter {
        let positions = self.blocks.iter().map(|block| block.positions(pattern)).collect();
        Scatter { positions, blocks: pattern.blocks() }
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
        assert_eq!(scatter.blocks, matrix.pattern().blocks(), "the scatter was made for a different pattern");
        assert_eq!(scatter.positions.len(), self.blocks.len(), "the scatter belongs to a different model");
        self.counter.count(Evaluation::Tangent);
        let values = matrix.values_mut();
        let mut inverted = Vec::new();
        for (term, state) in self.terms(self.state(d, step.into())).each() {
            let blocks = self.blocks.iter().zip(&scatter.positions).filter(|(block, _)| term.has(&***block));
            inverted.extend(blocks.flat_map(|(block, positions)| block.add_tangents(state, positions, values)));
        }
        refuse(inverted)
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
        self.counter.count(Evaluation::Product);
        self.add_forces(self.state(d, step.into()), Some(v), out)
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
        let mut products = vec![0.0; self.elements()];
        let weights = Weights { forces: Some(adjoint), history: None };
        let mut into = PullBack { density: Some((slopes, &mut products)), ..PullBack::default() };
        self.pull_back(self.state(d, step.into()), weights, &mut into)?;
        out.iter_mut().zip(products).for_each(|(to, from)| *to += from);
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
        Ok(self.elastic_and_plastic(d, step)?.into_iter().map(|of| of.elastic).collect())
    }

    /// Strain energy and plastic work of each element, at a state with the history `step.history`; 0 for
    /// elements of other ranks. \[F L\]
    ///
    /// # Errors
    /// [`InvertedElements`].
    pub fn elastic_and_plastic<'a>(
        &self,
        d: &[f64],
        step: impl Into<SolidStep<'a>>,
    ) -> Result<Vec<Energies>, InvertedElements> {
        self.counter.count(Evaluation::Energy);
        let mut energies = vec![Energies::default(); self.elements()];
        for (term, state) in self.terms(self.state(d, step.into())).each() {
            if term == Term::Soft {
                let mut soft = vec![Energies::default(); self.elements()];
                self.blocks_of(term).for_each(|block| block.write_energies(state, &mut soft));
                energies.iter_mut().zip(soft).for_each(|(of, soft)| of.elastic += soft.elastic);
            } else {
                self.blocks.iter().for_each(|block| block.write_energies(state, &mut energies));
            }
        }
        let inverted = |(_, of): &(u32, &Energies)| !of.elastic.is_finite();
        refuse((0_u32..).zip(&energies).filter(inverted).map(|(e, _)| e).collect())?;
        Ok(energies)
    }

    /// Smallest J of each element, regardless of its scaling: an element with interpolated energy
    /// may have J ≤ 0.
    pub fn smallest_determinants(&self, d: &[f64]) -> Vec<f64> {
        self.counter.count(Evaluation::Determinant);
        let mut out = vec![0.0; self.elements()];
        self.blocks.iter().for_each(|block| block.write_determinants(d, &mut out));
        out
    }
}

pub(crate) fn refuse(mut elements: Vec<u32>) -> Result<(), InvertedElements> {
    elements.sort_unstable();
    elements.dedup();
    if elements.is_empty() { Ok(()) } else { Err(InvertedElements { elements }) }
}

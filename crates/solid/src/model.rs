//! All elements of a mesh: assembled internal force, tangent and density pull-back.

use crate::assembly::{AddForces, AddProducts, AddTangents, PullBack, local};
use crate::clusters::Clusters;
use crate::hex8::{self, ReferenceGeometry};
use crate::interpolation::ElementScaling;
use crate::material::Material;
use crate::section::Section;
use pulp::Arch;
use rayon::prelude::*;
use slipstick_linalg::{BlockMatrix, BlockPattern};
use slipstick_mesh::Mesh;

/// Elements that a thread takes at a time.
const CHUNK: usize = 64;

/// Elements whose deformation gradient, at γ u with interpolated energy, has J ≤ 0 (or is not finite) at a Gauss point: the
/// trial state is no state.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{} inverted element{}, first: {}", elements.len(), if elements.len() == 1 { "" } else { "s" }, elements[0])]
pub struct InvertedElements {
    /// Element numbers, ascending; never empty.
    pub elements: Vec<u32>,
}

/// The solid bodies of a mesh.
///
/// `scalings` in all calls is what the density makes of each element (see [`crate::Interpolation`]); displacements and
/// forces have three entries per node.
#[derive(Debug, Clone)]
pub struct SolidModel {
    /// In the order of `clusters`.
    elements: Vec<Element>,
    clusters: Clusters,
    sections: Vec<Section>,
    /// By the mesh's number of the element.
    section_of: Vec<u32>,
}

/// All that the integrals over an element read, in one place.
#[derive(Debug, Clone)]
pub(crate) struct Element {
    pub geometry: ReferenceGeometry,
    pub nodes: [u32; 8],
    /// The mesh's number of the element.
    pub number: u32,
    section: u32,
}

impl Element {
    #[inline(always)]
    pub fn number(&self) -> usize {
        self.number as usize
    }

    #[inline(always)]
    pub fn section(&self) -> usize {
        self.section as usize
    }
}

/// Where each element's 64 blocks go in a matrix's values, element by element in the order of the model; built once per
/// pattern.
#[derive(Debug, Clone)]
pub struct Scatter {
    positions: Vec<[u32; 64]>,
    /// Blocks of the pattern.
    blocks: usize,
}

impl SolidModel {
    /// Builds the model; `sections` has one per body of the mesh. A material alone stands for fully integrated elements.
    ///
    /// # Errors
    /// Elements with a non-positive Jacobian in the reference configuration.
    pub fn new<S: Into<Section>>(mesh: &Mesh, sections: Vec<S>) -> Result<Self, InvertedElements> {
        assert_eq!(mesh.bodies.len(), sections.len(), "one section per body");
        let sections = sections.into_iter().map(Into::into).collect();
        let mut section_of = vec![0; mesh.hexes.len()];
        for (b, body) in mesh.bodies.iter().enumerate() {
            section_of[body.elements.clone()].fill(b as u32);
        }
        let clusters = Clusters::new(mesh);
        let elements: Vec<_> = clusters
            .order
            .par_iter()
            .map(|&number| {
                let (nodes, section) = (mesh.hexes[number as usize], section_of[number as usize]);
                ReferenceGeometry::new(&mesh.hex_coordinates(number as usize))
                    .map(|geometry| Element { geometry, nodes, number, section })
                    .ok_or(number)
            })
            .collect();
        refuse(elements.iter().filter_map(|e| e.as_ref().err().copied()).collect())?;
        Ok(Self { elements: elements.into_iter().flatten().collect(), clusters, sections, section_of })
    }

    /// Number of elements.
    pub fn elements(&self) -> usize {
        self.elements.len()
    }

    /// The material of an element.
    pub fn material(&self, element: usize) -> &Material {
        &self.sections[self.section_of[element] as usize].material
    }

    /// Element volumes by the model's quadrature, Σ w. \[L³\]
    pub fn element_volumes(&self) -> Vec<f64> {
        self.by_number(|element| element.geometry.volume())
    }

    /// Assembled internal force. \[F\]. Does not depend on the number of threads, bit for bit.
    ///
    /// # Errors
    /// [`InvertedElements`]; `out` is then unspecified.
    pub fn internal_force(
        &self,
        d: &[f64],
        scalings: &[ElementScaling],
        out: &mut [f64],
    ) -> Result<(), InvertedElements> {
        out.fill(0.0);
        let sections = &self.sections[..];
        let nodes = out.as_chunks_mut::<3>().0;
        refuse(self.clusters.assemble(nodes, |cluster, target, inverted| {
            Arch::new().dispatch(AddForces {
                elements: &self.elements[cluster],
                sections,
                d,
                scalings,
                target,
                inverted,
            });
        }))
    }

    /// Finds the place of every element block in the pattern.
    ///
    /// # Panics
    /// If the pattern lacks a pair of nodes that share an element.
    pub fn scatter(&self, pattern: &BlockPattern) -> Scatter {
        let positions = self
            .elements
            .par_iter()
            .map(|element| {
                std::array::from_fn(|e| {
                    let (i, k) = (element.nodes[e / 8] as usize, element.nodes[e % 8] as usize);
                    pattern.find(i, k).expect("pattern holds all element pairs") as u32
                })
            })
            .collect();
        Scatter { positions, blocks: pattern.blocks() }
    }

    /// Adds the tangent ∂f_int/∂d to a matrix, from whose pattern this model made `scatter`. Does not depend on the
    /// number of threads, bit for bit.
    ///
    /// # Errors
    /// [`InvertedElements`]; the matrix is then unspecified.
    ///
    /// # Panics
    /// If `scatter` was made for another number of blocks or elements.
    pub fn add_tangent(
        &self,
        d: &[f64],
        scalings: &[ElementScaling],
        scatter: &Scatter,
        matrix: &mut BlockMatrix,
    ) -> Result<(), InvertedElements> {
        assert_eq!(scatter.blocks, matrix.pattern().blocks(), "the matrix has another pattern than the scatter");
        assert_eq!(scatter.positions.len(), self.elements.len(), "the scatter belongs to another model");
        let sections = &self.sections[..];
        refuse(self.clusters.assemble(matrix.values_mut(), |cluster, target, inverted| {
            let (elements, positions) = (&self.elements[cluster.clone()], &scatter.positions[cluster]);
            Arch::new().dispatch(AddTangents { elements, positions, sections, d, scalings, target, inverted });
        }))
    }

    /// Adds K v with K = ∂f_int/∂d, without a matrix: the product that an objective on internal forces needs. K is symmetric, so it serves for Kᵀ v as well. Elements at whose
    /// nodes v vanishes are passed over. Does not depend on the number of threads, bit for bit.
    ///
    /// # Errors
    /// [`InvertedElements`]; `out` is then unspecified.
    pub fn add_tangent_product(
        &self,
        d: &[f64],
        scalings: &[ElementScaling],
        v: &[f64],
        out: &mut [f64],
    ) -> Result<(), InvertedElements> {
        let sections = &self.sections[..];
        let nodes = out.as_chunks_mut::<3>().0;
        refuse(self.clusters.assemble(nodes, |cluster, target, inverted| {
            Arch::new().dispatch(AddProducts {
                elements: &self.elements[cluster],
                sections,
                d,
                scalings,
                direction: v,
                target,
                inverted,
            });
        }))
    }

    /// Adds λᵀ ∂f_int/∂φ_e of every element to `out`; `slopes` holds the derivatives of the scalings with respect to the
    /// densities φ_e. Elements whose scaling depends on nothing are passed over.
    ///
    /// Paper: (88), (89). Tests: `density_pull_back_matches_differences`, `interpolated_pull_back_matches_differences`.
    ///
    /// # Errors
    /// [`InvertedElements`]; `out` is then as before.
    pub fn pull_back_density(
        &self,
        d: &[f64],
        scalings: &[ElementScaling],
        slopes: &[ElementScaling],
        adjoint: &[f64],
        out: &mut [f64],
    ) -> Result<(), InvertedElements> {
        let mut products = vec![0.0; self.elements.len()];
        let chunks = products.par_chunks_mut(CHUNK).zip(self.elements.par_chunks(CHUNK));
        let inverted = chunks.flat_map_iter(|(out, elements)| {
            let (sections, mut inverted) = (&self.sections[..], Vec::new());
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
        refuse(inverted.collect())?;
        for (element, product) in self.elements.iter().zip(products) {
            out[element.number()] += product;
        }
        Ok(())
    }

    /// Total strain energy. \[F L\]
    ///
    /// # Errors
    /// [`InvertedElements`].
    pub fn energy(&self, d: &[f64], scalings: &[ElementScaling]) -> Result<f64, InvertedElements> {
        let energies = self.by_number(|element| {
            let (section, scaling) = (&self.sections[element.section()], scalings[element.number()]);
            hex8::energy(section, scaling, &element.geometry, &local(&element.nodes, d)).unwrap_or(f64::NAN)
        });
        refuse((0_u32..).zip(&energies).filter(|(_, w)| !w.is_finite()).map(|(e, _)| e).collect())?;
        Ok(energies.iter().sum())
    }

    /// Smallest J of each element, whatever its scaling: an element with interpolated energy may have J ≤ 0.
    pub fn smallest_determinants(&self, d: &[f64]) -> Vec<f64> {
        self.by_number(|element| hex8::smallest_determinant(&element.geometry, &local(&element.nodes, d)))
    }

    /// One number per element, in the order of the mesh.
    fn by_number(&self, value: impl Fn(&Element) -> f64 + Sync) -> Vec<f64> {
        let values: Vec<f64> = self.elements.par_iter().map(&value).collect();
        let mut out = vec![0.0; values.len()];
        for (element, value) in self.elements.iter().zip(values) {
            out[element.number()] = value;
        }
        out
    }
}

fn refuse(mut elements: Vec<u32>) -> Result<(), InvertedElements> {
    elements.sort_unstable();
    if elements.is_empty() { Ok(()) } else { Err(InvertedElements { elements }) }
}

//! All elements of a mesh: assembled internal force, tangent and density pull-back.

use crate::assembly::{AddForces, AddProducts, AddTangents, PullBack, local};
use crate::clusters::Clusters;
use crate::hex8::{self, ReferenceGeometry};
use crate::material::NeoHooke;
use pulp::Arch;
use rayon::prelude::*;
use slipstick_linalg::{BlockMatrix, BlockPattern};
use slipstick_mesh::Mesh;

/// Elements that a thread takes at a time.
const CHUNK: usize = 64;

/// Elements whose deformation gradient has J ≤ 0 (or is not finite) at a Gauss point: the trial state is no state.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{} inverted element{}, first: {}", elements.len(), if elements.len() == 1 { "" } else { "s" }, elements[0])]
pub struct InvertedElements {
    /// Element numbers, ascending; never empty.
    pub elements: Vec<u32>,
}

/// The solid bodies of a mesh.
///
/// `factors` in all calls is the stiffness factor E/E₀ of each element (see [`crate::Simp`]); displacements and forces
/// have three entries per node.
#[derive(Debug, Clone)]
pub struct SolidModel {
    /// In the order of `clusters`.
    elements: Vec<Element>,
    clusters: Clusters,
    materials: Vec<NeoHooke>,
    /// By the mesh's number of the element.
    material_of: Vec<u32>,
}

/// All that the integrals over an element read, in one place.
#[derive(Debug, Clone)]
pub(crate) struct Element {
    pub geometry: ReferenceGeometry,
    pub nodes: [u32; 8],
    /// The mesh's number of the element.
    pub number: u32,
    material: u32,
}

impl Element {
    #[inline(always)]
    pub fn number(&self) -> usize {
        self.number as usize
    }

    #[inline(always)]
    pub fn material(&self) -> usize {
        self.material as usize
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
    /// Builds the model; `materials` has one law per body of the mesh.
    ///
    /// # Errors
    /// Elements with a non-positive Jacobian in the reference configuration.
    pub fn new(mesh: &Mesh, materials: Vec<NeoHooke>) -> Result<Self, InvertedElements> {
        assert_eq!(mesh.bodies.len(), materials.len(), "one material per body");
        let mut material_of = vec![0; mesh.hexes.len()];
        for (b, body) in mesh.bodies.iter().enumerate() {
            material_of[body.elements.clone()].fill(b as u32);
        }
        let clusters = Clusters::new(mesh);
        let elements: Vec<_> = clusters
            .order
            .par_iter()
            .map(|&number| {
                let (nodes, material) = (mesh.hexes[number as usize], material_of[number as usize]);
                ReferenceGeometry::new(&mesh.hex_coordinates(number as usize))
                    .map(|geometry| Element { geometry, nodes, number, material })
                    .ok_or(number)
            })
            .collect();
        refuse(elements.iter().filter_map(|e| e.as_ref().err().copied()).collect())?;
        Ok(Self { elements: elements.into_iter().flatten().collect(), clusters, materials, material_of })
    }

    /// Number of elements.
    pub fn elements(&self) -> usize {
        self.elements.len()
    }

    /// The law of an element.
    pub fn material(&self, element: usize) -> &NeoHooke {
        &self.materials[self.material_of[element] as usize]
    }

    /// Element volumes by the model's quadrature, Σ w. \[L³\]
    pub fn element_volumes(&self) -> Vec<f64> {
        self.by_number(|element| element.geometry.volume())
    }

    /// Assembled internal force. \[F\]. Does not depend on the number of threads, bit for bit.
    ///
    /// # Errors
    /// [`InvertedElements`]; `out` is then unspecified.
    pub fn internal_force(&self, d: &[f64], factors: &[f64], out: &mut [f64]) -> Result<(), InvertedElements> {
        out.fill(0.0);
        let materials = &self.materials[..];
        let nodes = out.as_chunks_mut::<3>().0;
        refuse(self.clusters.assemble(nodes, |cluster, target, inverted| {
            Arch::new().dispatch(AddForces {
                elements: &self.elements[cluster],
                materials,
                d,
                factors,
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
        factors: &[f64],
        scatter: &Scatter,
        matrix: &mut BlockMatrix,
    ) -> Result<(), InvertedElements> {
        assert_eq!(scatter.blocks, matrix.pattern().blocks(), "the matrix has another pattern than the scatter");
        assert_eq!(scatter.positions.len(), self.elements.len(), "the scatter belongs to another model");
        let materials = &self.materials[..];
        refuse(self.clusters.assemble(matrix.values_mut(), |cluster, target, inverted| {
            let (elements, positions) = (&self.elements[cluster.clone()], &scatter.positions[cluster]);
            Arch::new().dispatch(AddTangents { elements, positions, materials, d, factors, target, inverted });
        }))
    }

    /// Adds K v with K = Σ factor · ∂f/∂d restricted to the given elements' own tangents, without a matrix: the product
    /// that an objective on internal forces needs. K is symmetric, so it serves for Kᵀ v as well. Elements at whose
    /// nodes v vanishes are passed over. Does not depend on the number of threads, bit for bit.
    ///
    /// # Errors
    /// [`InvertedElements`]; `out` is then unspecified.
    pub fn add_tangent_product(
        &self,
        d: &[f64],
        factors: &[f64],
        v: &[f64],
        out: &mut [f64],
    ) -> Result<(), InvertedElements> {
        let materials = &self.materials[..];
        let nodes = out.as_chunks_mut::<3>().0;
        refuse(self.clusters.assemble(nodes, |cluster, target, inverted| {
            Arch::new().dispatch(AddProducts {
                elements: &self.elements[cluster],
                materials,
                d,
                factors,
                direction: v,
                target,
                inverted,
            });
        }))
    }

    /// Adds `λ · f_e(E₀)` of every element to `out`: the derivative of λᵀ f_int with respect to each element's factor.
    ///
    /// Paper: (88), (89). Test: `factor_pull_back_matches_differences`.
    ///
    /// # Errors
    /// [`InvertedElements`]; `out` is then as before.
    pub fn pull_back_factors(&self, d: &[f64], adjoint: &[f64], out: &mut [f64]) -> Result<(), InvertedElements> {
        let mut products = vec![0.0; self.elements.len()];
        let chunks = products.par_chunks_mut(CHUNK).zip(self.elements.par_chunks(CHUNK));
        let inverted = chunks.flat_map_iter(|(out, elements)| {
            let (materials, mut inverted) = (&self.materials[..], Vec::new());
            Arch::new().dispatch(PullBack { elements, materials, d, adjoint, out, inverted: &mut inverted });
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
    pub fn energy(&self, d: &[f64], factors: &[f64]) -> Result<f64, InvertedElements> {
        let energies = self.by_number(|element| {
            let material = &self.materials[element.material()];
            hex8::energy(material, &element.geometry, &local(&element.nodes, d)).unwrap_or(f64::NAN)
        });
        refuse((0_u32..).zip(&energies).filter(|(_, w)| !w.is_finite()).map(|(e, _)| e).collect())?;
        Ok(energies.iter().zip(factors).map(|(w, factor)| factor * w).sum())
    }

    /// Smallest J of each element.
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

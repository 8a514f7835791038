//! All elements of a mesh: assembled internal force, tangent and density pull-back.

use crate::hex8::{self, ReferenceGeometry};
use crate::material::NeoHooke;
use rayon::prelude::*;
use slipstick_linalg::{BlockMatrix, BlockPattern};
use slipstick_mesh::{Mesh, NodeElements};

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
    hexes: Vec<[u32; 8]>,
    node_elements: NodeElements,
    geometry: Vec<ReferenceGeometry>,
    materials: Vec<NeoHooke>,
    material_of: Vec<u32>,
    colours: Vec<Vec<u32>>,
}

/// Where each element's 64 blocks go in a matrix's values; built once per pattern.
#[derive(Debug, Clone)]
pub struct Scatter {
    positions: Vec<[u32; 64]>,
}

impl SolidModel {
    /// Builds the model; `materials` has one law per body of the mesh.
    ///
    /// # Errors
    /// Elements with a non-positive Jacobian in the reference configuration.
    pub fn new(mesh: &Mesh, materials: Vec<NeoHooke>) -> Result<Self, InvertedElements> {
        assert_eq!(mesh.bodies.len(), materials.len(), "one material per body");
        let geometry: Vec<_> =
            (0..mesh.hexes.len()).into_par_iter().map(|e| ReferenceGeometry::new(&mesh.hex_coordinates(e))).collect();
        let elements: Vec<u32> =
            geometry.iter().enumerate().filter(|(_, g)| g.is_none()).map(|(e, _)| e as u32).collect();
        if !elements.is_empty() {
            return Err(InvertedElements { elements });
        }
        let mut material_of = vec![0; mesh.hexes.len()];
        for (b, body) in mesh.bodies.iter().enumerate() {
            material_of[body.elements.clone()].fill(b as u32);
        }
        Ok(Self {
            hexes: mesh.hexes.clone(),
            node_elements: mesh.node_elements(),
            geometry: geometry.into_iter().flatten().collect(),
            materials,
            material_of,
            colours: mesh.element_colours(),
        })
    }

    /// Number of elements.
    pub fn elements(&self) -> usize {
        self.hexes.len()
    }

    /// The law of an element.
    pub fn material(&self, element: usize) -> &NeoHooke {
        &self.materials[self.material_of[element] as usize]
    }

    /// Element volumes by the model's quadrature, Σ w. \[L³\]
    pub fn element_volumes(&self) -> Vec<f64> {
        self.geometry.iter().map(|g| g.weights.iter().sum()).collect()
    }

    /// Assembled internal force. \[F\]. Does not depend on the number of threads, bit for bit.
    ///
    /// # Errors
    /// [`InvertedElements`]; `out` is then unspecified.
    pub fn internal_force(&self, d: &[f64], factors: &[f64], out: &mut [f64]) -> Result<(), InvertedElements> {
        let forces = self.element_forces(d)?;
        out.par_chunks_exact_mut(3).enumerate().for_each(|(node, f)| {
            f.fill(0.0);
            for &e in self.node_elements.of(node) {
                let local =
                    self.hexes[e as usize].iter().position(|&n| n as usize == node).expect("node of its element");
                for c in 0..3 {
                    f[c] += factors[e as usize] * forces[e as usize][local][c];
                }
            }
        });
        Ok(())
    }

    /// Internal force of every element at stiffness E₀.
    fn element_forces(&self, d: &[f64]) -> Result<Vec<[[f64; 3]; 8]>, InvertedElements> {
        let forces: Vec<_> = (0..self.hexes.len())
            .into_par_iter()
            .map(|e| {
                hex8::internal_force(self.material(e), &self.geometry[e], &self.local(e, d))
                    .unwrap_or([[f64::NAN; 3]; 8])
            })
            .collect();
        let elements: Vec<u32> =
            forces.iter().enumerate().filter(|(_, f)| !f[0][0].is_finite()).map(|(e, _)| e as u32).collect();
        if elements.is_empty() { Ok(forces) } else { Err(InvertedElements { elements }) }
    }

    /// Finds the place of every element block in the pattern.
    ///
    /// # Panics
    /// If the pattern lacks a pair of nodes that share an element.
    pub fn scatter(&self, pattern: &BlockPattern) -> Scatter {
        let positions = self
            .hexes
            .par_iter()
            .map(|hex| {
                std::array::from_fn(|e| {
                    let (i, k) = (hex[e / 8] as usize, hex[e % 8] as usize);
                    pattern.find(i, k).expect("pattern holds all element pairs") as u32
                })
            })
            .collect();
        Scatter { positions }
    }

    /// Adds the tangent ∂f_int/∂d to a matrix. Does not depend on the number of threads, bit for bit.
    ///
    /// # Errors
    /// [`InvertedElements`]; the matrix is then unspecified.
    pub fn add_tangent(
        &self,
        d: &[f64],
        factors: &[f64],
        scatter: &Scatter,
        matrix: &mut BlockMatrix,
    ) -> Result<(), InvertedElements> {
        struct Values(*mut [f64; 9]);
        // SAFETY of sharing: elements of one colour share no node, hence no block, and colours run one after the other.
        unsafe impl Sync for Values {}
        let values = Values(matrix.values_mut().as_mut_ptr());
        let values = &values;
        let mut inverted = Vec::new();
        for colour in &self.colours {
            inverted.par_extend(colour.par_iter().filter_map(|&e| {
                let element = e as usize;
                let mut k = [[0.0; 9]; 64];
                let local = self.local(element, d);
                if hex8::tangent(self.material(element), &self.geometry[element], &local, &mut k).is_none() {
                    return Some(e);
                }
                let factor = factors[element];
                for (block, &position) in k.iter().zip(&scatter.positions[element]) {
                    // SAFETY: see above; positions come from `find` in this matrix's pattern.
                    let target = unsafe { &mut *values.0.add(position as usize) };
                    for (t, b) in target.iter_mut().zip(block) {
                        *t += factor * b;
                    }
                }
                None
            }));
        }
        inverted.sort_unstable();
        if inverted.is_empty() { Ok(()) } else { Err(InvertedElements { elements: inverted }) }
    }

    /// Adds K v with K = Σ factor · ∂f/∂d restricted to the given elements' own tangents, without a global matrix:
    /// the product that an objective on internal forces needs. K is symmetric, so it serves for Kᵀ v as well.
    ///
    /// # Errors
    /// [`InvertedElements`].
    pub fn add_tangent_product(
        &self,
        d: &[f64],
        factors: &[f64],
        v: &[f64],
        out: &mut [f64],
    ) -> Result<(), InvertedElements> {
        let mut k = [[0.0; 9]; 64];
        for e in 0..self.hexes.len() {
            let direction = self.local(e, v);
            if direction.iter().flatten().all(|&x| x == 0.0) {
                continue;
            }
            hex8::tangent(self.material(e), &self.geometry[e], &self.local(e, d), &mut k)
                .ok_or_else(|| InvertedElements { elements: vec![e as u32] })?;
            for i in 0..8 {
                let target = 3 * self.hexes[e][i] as usize;
                for j in 0..8 {
                    let block = &k[8 * i + j];
                    for a in 0..3 {
                        for b in 0..3 {
                            out[target + a] += factors[e] * block[3 * a + b] * direction[j][b];
                        }
                    }
                }
            }
        }
        Ok(())
    }

    /// Adds `λ · f_e(E₀)` of every element to `out`: the derivative of λᵀ f_int with respect to each element's factor.
    ///
    /// Paper: (88), (89). Test: `factor_pull_back_matches_differences`.
    ///
    /// # Errors
    /// [`InvertedElements`].
    pub fn pull_back_factors(&self, d: &[f64], adjoint: &[f64], out: &mut [f64]) -> Result<(), InvertedElements> {
        let forces = self.element_forces(d)?;
        out.par_iter_mut().enumerate().for_each(|(e, o)| {
            let lambda = self.local(e, adjoint);
            *o += (0..8).map(|i| (0..3).map(|a| lambda[i][a] * forces[e][i][a]).sum::<f64>()).sum::<f64>();
        });
        Ok(())
    }

    /// Total strain energy. \[F L\]
    ///
    /// # Errors
    /// [`InvertedElements`].
    pub fn energy(&self, d: &[f64], factors: &[f64]) -> Result<f64, InvertedElements> {
        (0..self.hexes.len())
            .map(|e| {
                hex8::energy(self.material(e), &self.geometry[e], &self.local(e, d))
                    .map(|w| factors[e] * w)
                    .ok_or_else(|| InvertedElements { elements: vec![e as u32] })
            })
            .sum()
    }

    /// Smallest J of each element.
    pub fn smallest_determinants(&self, d: &[f64]) -> Vec<f64> {
        (0..self.hexes.len())
            .into_par_iter()
            .map(|e| hex8::smallest_determinant(&self.geometry[e], &self.local(e, d)))
            .collect()
    }

    #[inline]
    fn local(&self, element: usize, v: &[f64]) -> [[f64; 3]; 8] {
        self.hexes[element].map(|n| {
            let at = 3 * n as usize;
            [v[at], v[at + 1], v[at + 2]]
        })
    }
}

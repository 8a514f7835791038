//! Tet4 elements, eight at a time: internal force, tangent, energy, for any material.
//!
//! The deformation gradient of a tetrahedron is constant, so one point integrates exactly, and
//! every [formulation](crate::Formulation) is the same. The laws of [`crate::hex8`] work on eight
//! points at once; here each point is an element of a [`Batch`]. With parent coordinates ξ,
//! N_0 = 1 − Σ ξ_β and N_β+1 = ξ_β:
//!
//! ```text
//! F = 1 + Σ_β (d_β+1 − d_0) ⊗ ∂ξ_β/∂X,     f_β+1 = V P ∂ξ_β/∂X,     f_0 = −Σ_β f_β+1
//! ```
//!
//! Energy interpolation is the same as in hexahedra, f = s [γ f(γd) + (1 − γ²) K(0) d], with s and
//! γ of each element.

mod block;
mod kernel;

pub(crate) use block::block;
use kernel::{Work, pull_back};

use crate::block::{State, corners};
use crate::heat::Power;
use crate::interpolation::ElementScaling;
use crate::law::determinant;
use crate::registers::{AtPoints, POINTS};
use slipstick_mesh::tet_volume;

/// Maximum number of elements in a batch.
pub(crate) const LANES: usize = POINTS;

/// Up to eight elements of one section.
#[derive(Debug, Clone)]
#[repr(C, align(32))]
pub(crate) struct Batch {
    /// ∂ξ_β/∂X_B of each element, as `[β][B][element]`. \[1/L\]
    pub inverse: [[AtPoints; 3]; 3],
    /// Volumes; 0 beyond the last element. \[L³\]
    pub volumes: AtPoints,
    pub nodes: [[u32; 4]; LANES],
    /// The mesh numbers of the elements; their number is the size of the batch.
    numbers: [u32; LANES],
    count: usize,
    pub section: usize,
}

impl Batch {
    /// A batch of elements, given by their numbers and nodes, with nodes at positions `x`; the error contains the numbers of
    /// elements without a positive volume.
    ///
    /// # Panics
    /// With no elements, or more than [`LANES`].
    pub fn new(x: &[[f64; 3]], elements: &[(u32, [u32; 4])], section: usize) -> Result<Self, Vec<u32>> {
        let mut out = Self {
            inverse: [[[0.0; LANES]; 3]; 3],
            volumes: [0.0; LANES],
            nodes: [elements[0].1; LANES],
            numbers: [elements[0].0; LANES],
            count: elements.len(),
            section,
        };
        let mut flat = Vec::new();
        for (lane, &(number, nodes)) in elements.iter().enumerate() {
            let corners = corners(x, &nodes);
            let volume = tet_volume(&corners);
            if !(volume > 0.0 && volume.is_finite()) {
                flat.push(number);
            }
            (out.nodes[lane], out.numbers[lane], out.volumes[lane]) = (nodes, number, volume);
            let edges: [[f64; 3]; 3] =
                std::array::from_fn(|i| std::array::from_fn(|c| corners[i + 1][c] - corners[0][c]));
            for beta in 0..3 {
                let (u, v) = (edges[(beta + 1) % 3], edges[(beta + 2) % 3]);
                for b in 0..3 {
                    let (b1, b2) = ((b + 1) % 3, (b + 2) % 3);
                    out.inverse[beta][b][lane] = (u[b1] * v[b2] - u[b2] * v[b1]) / (6.0 * volume);
                }
            }
        }
        if flat.is_empty() { Ok(out) } else { Err(flat) }
    }

    /// The mesh's numbers of the elements.
    #[inline(always)]
    pub fn numbers(&self) -> &[u32] {
        &self.numbers[..self.count]
    }

    /// Displacement gradient of one element, relative to its first corner: a translation causes no
    /// round-off.
    fn displacement_gradient(&self, lane: usize, d: &[f64]) -> [[f64; 3]; 3] {
        let at = |corner: usize, a: usize| d[3 * self.nodes[lane][corner] as usize + a];
        std::array::from_fn(|a| {
            std::array::from_fn(|b| (0..3).map(|beta| (at(beta + 1, a) - at(0, a)) * self.inverse[beta][b][lane]).sum())
        })
    }

    /// ∂N_i/∂X of one element's corners. \[1/L\]
    pub fn shape_gradients(&self, lane: usize) -> [[f64; 3]; 4] {
        let of = |beta: usize| -> [f64; 3] { std::array::from_fn(|b| self.inverse[beta][b][lane]) };
        let others = [of(0), of(1), of(2)];
        let first = std::array::from_fn(|b| -(others[0][b] + others[1][b] + others[2][b]));
        [first, others[0], others[1], others[2]]
    }

    /// Energy of one element; `None` if J ≤ 0, at γ d if the energy is interpolated. \[F L\]
    pub fn energy(&self, lane: usize, state: State<'_>) -> Option<f64> {
        let (number, material) = (self.numbers[lane] as usize, &state.sections[self.section].material);
        let scaling = state.scaling(number, self.section, Power::Energy);
        let ElementScaling { factor, gamma, .. } = scaling.effective(material.small_strains());
        let h = state.without_expansion(self.displacement_gradient(lane, state.d), number, self.section);
        let f = plus_identity(&h, gamma);
        if !(determinant(&f) > 0.0) {
            return None;
        }
        let mut energy = material.energy(&f);
        if gamma != 1.0 {
            energy += (1.0 - gamma * gamma) * material.small_strain_energy(&h);
        }
        Some(factor * self.volumes[lane] * energy)
    }

    /// J of one element; −∞ if it is not a number.
    pub fn determinant(&self, lane: usize, d: &[f64]) -> f64 {
        let j = determinant(&plus_identity(&self.displacement_gradient(lane, d), 1.0));
        if j.is_nan() { f64::NEG_INFINITY } else { j }
    }
}

/// 1 + γ H.
fn plus_identity(h: &[[f64; 3]; 3], gamma: f64) -> [[f64; 3]; 3] {
    std::array::from_fn(|a| std::array::from_fn(|b| f64::from(a == b) + gamma * h[a][b]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use slipstick_mesh::{BoxShape, box_mesh};

    /// Independent check: J is the ratio of the volumes of the deformed and the undeformed
    /// tetrahedron.
    #[test]
    fn determinants_are_ratios_of_volumes() {
        let shape = BoxShape { min: [0.0; 3], max: [1.0, 1.3, 0.7], elements: [1; 3], grading: [1.0; 3] };
        let mesh = box_mesh("block", &shape).unwrap().divided(|_| true);
        let elements: Vec<(u32, [u32; 4])> =
            mesh.elements.iter().zip(0..).map(|(e, number)| (number, e.nodes().try_into().unwrap())).collect();
        let batch = Batch::new(&mesh.nodes, &elements, 0).unwrap();
        let d: Vec<f64> = (0..3 * mesh.nodes.len()).map(|i| 0.2 * (i as f64 * 1.7).sin()).collect();
        for (lane, (_, nodes)) in elements.iter().enumerate() {
            let rest = mesh.coordinates(nodes);
            let moved: [[f64; 3]; 4] = std::array::from_fn(|corner| {
                std::array::from_fn(|c| rest[corner][c] + d[3 * nodes[corner] as usize + c])
            });
            let ratio = tet_volume(&moved) / tet_volume(&rest);
            assert!((batch.determinant(lane, &d) - ratio).abs() < 1e-13 * (1.0 + ratio.abs()), "{lane}: {ratio}");
        }
    }
}

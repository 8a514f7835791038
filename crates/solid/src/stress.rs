//! Cauchy stress at the Gauss points, and its derivatives.
//!
//! The stress is that of the solid material at the element's deformation, without the scaling of
//! the stiffness by the density: the stress in the microstructure, not its mean. With F = 1 + γH,
//! or F̄:
//!
//! ```text
//! P = ∂Ψ/∂F      σ = P Fᵀ/J      σ_v = √(3/2) ‖dev σ‖
//! ∂σ_v/∂F = ∂P/∂F : V + S P/J − σ_v F⁻ᵀ      V = S F/J      S = ∂σ_v/∂σ
//! ```
//!
//! ∂P/∂F is symmetric, so its product with V is a derivative of P along V. For small-strain laws σ
//! = P.

use crate::dual::Dual;
use crate::inelastic::ByState;
use crate::law::{Material, Real};
use crate::model::{Hexahedron, InvertedElements, SolidModel, SolidStep, refuse};
use crate::quadratic::AveragedPoints;
use crate::tet4::Batch;
use crate::{ElementScaling, Formulation, Section};
use rayon::prelude::*;
use slipstick_mesh::Element;
use std::array::from_fn;

/// Entries per element in lists of stresses: one per point. Linear tetrahedra have one point; their
/// other entries are 0.
///
/// The points of linear elements and of tet10 are those of their integration. Those of hex27 are the
/// points of the 2×2×2 rule, where the stresses of quadratic elements are most accurate. Source: J.
/// Barlow, Int. J. Numer. Methods Engrg. 10 (1976) 243–251.
pub const STRESS_POINTS: usize = 8;

/// Number of points of an element.
pub fn stress_points(element: &Element) -> usize {
    match element {
        Element::Tet4(_) => 1,
        Element::Wedge6(_) | Element::Hex8(_) | Element::Tet10(_) | Element::Hex27(_) => STRESS_POINTS,
    }
}

type Tensor = [[f64; 3]; 3];

/// σ_v of a symmetric stress.
pub fn von_mises(stress: &Tensor) -> f64 {
    let deviator = deviator(stress);
    (1.5 * contract(&deviator, &deviator)).sqrt()
}

fn deviator(stress: &Tensor) -> Tensor {
    let mean = (stress[0][0] + stress[1][1] + stress[2][2]) / 3.0;
    from_fn(|i| from_fn(|j| if i == j { stress[i][j] - mean } else { stress[i][j] }))
}

fn contract(a: &Tensor, b: &Tensor) -> f64 {
    (0..3).map(|i| (0..3).map(|j| a[i][j] * b[i][j]).sum::<f64>()).sum()
}

fn determinant(f: &Tensor) -> f64 {
    crate::law::determinant(f)
}

/// F⁻ᵀ times J.
fn cofactor(f: &Tensor) -> Tensor {
    from_fn(|i| {
        from_fn(|j| {
            let (i1, i2, j1, j2) = ((i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3);
            f[i1][j1] * f[i2][j2] - f[i1][j2] * f[i2][j1]
        })
    })
}

/// P = ∂Ψ/∂F.
fn first_piola_kirchhoff(material: &Material, f: &Tensor) -> Tensor {
    derivatives(material, |a, b| f[a][b])
}

/// ∂P/∂F : V.
fn stress_change(material: &Material, f: &Tensor, along: &Tensor) -> Tensor {
    let changes = derivatives(material, |a, b| Dual { value: f[a][b], slopes: [along[a][b]] });
    changes.map(|row| row.map(|entry| entry.slopes[0]))
}

/// ∂Ψ/∂F at the F with these entries.
fn derivatives<T: Real>(material: &Material, entry: impl Fn(usize, usize) -> T) -> [[T; 3]; 3] {
    let unit = |k: usize| from_fn(|l| T::from(f64::from(k == l)));
    let varied: [[Dual<T, 9>; 3]; 3] = from_fn(|a| from_fn(|b| Dual { value: entry(a, b), slopes: unit(3 * a + b) }));
    let slopes = material.energy(&varied).slopes;
    from_fn(|a| from_fn(|b| slopes[3 * a + b]))
}

/// σ at deformation gradient F. \[F/L²\]
pub fn cauchy_stress(material: &Material, f: &Tensor) -> Tensor {
    let p = first_piola_kirchhoff(material, f);
    if material.small_strains() {
        return p;
    }
    let j = determinant(f);
    from_fn(|a| from_fn(|b| (0..3).map(|c| p[a][c] * f[b][c]).sum::<f64>() / j))
}

/// σ_v at F and ∂σ_v/∂F, which is zero where σ_v is.
fn von_mises_slope(material: &Material, f: &Tensor) -> (f64, Tensor) {
    let stress = cauchy_stress(material, f);
    let size = von_mises(&stress);
    if size == 0.0 {
        return (0.0, [[0.0; 3]; 3]);
    }
    let by_stress = deviator(&stress).map(|row| row.map(|s| 1.5 * s / size));
    if material.small_strains() {
        return (size, stress_change(material, f, &by_stress));
    }
    let (j, p, cofactor) = (determinant(f), first_piola_kirchhoff(material, f), cofactor(f));
    let by_piola: Tensor = from_fn(|a| from_fn(|b| (0..3).map(|c| by_stress[a][c] * f[c][b]).sum::<f64>() / j));
    let through_piola = stress_change(material, f, &by_piola);
    // σ_ab = P_ac F_bc/J also depends on F_bc and J
    let direct = |b: usize, c: usize| (0..3).map(|a| by_stress[a][b] * p[a][c]).sum::<f64>() / j;
    let slope = from_fn(|b| from_fn(|c| through_piola[b][c] + direct(b, c) - size * cofactor[b][c] / j));
    (size, slope)
}

/// An element's points: gradients of its shape functions, weights, and ∂u/∂X.
struct Points<const N: usize> {
    gradients: Vec<[[f64; 3]; N]>,
    weights: Vec<f64>,
    h: Vec<Tensor>,
}

impl<const N: usize> Points<N> {
    fn new(gradients: Vec<[[f64; 3]; N]>, weights: Vec<f64>, nodes: &[u32; N], d: &[f64]) -> Self {
        // relative to the first corner: a translation causes no round-off
        let at = |i: usize, a: usize| d[3 * nodes[i] as usize + a] - d[3 * nodes[0] as usize + a];
        let h = |gradients: &[[f64; 3]; N]| from_fn(|a| from_fn(|b| (0..N).map(|i| at(i, a) * gradients[i][b]).sum()));
        let h = gradients.iter().map(h).collect();
        Self { gradients, weights, h }
    }

    /// F of the stress at every point.
    fn deformation(&self, section: &Section, gamma: f64) -> Vec<Tensor> {
        let volume: f64 = self.weights.iter().sum();
        let mean = |of: &dyn Fn(&Tensor) -> f64| {
            self.weights.iter().zip(&self.h).map(|(w, h)| w * of(h)).sum::<f64>() / volume
        };
        let small = section.material.small_strains();
        match section.formulation {
            Formulation::Full => self.h.iter().map(|h| plus_identity(h, if small { 1.0 } else { gamma })).collect(),
            Formulation::FBar if small => {
                let mean = mean(&trace);
                let moved = |h: &Tensor| {
                    let shift = (mean - trace(h)) / 3.0;
                    from_fn(|a| from_fn(|b| h[a][b] + f64::from(a == b) * (1.0 + shift)))
                };
                self.h.iter().map(moved).collect()
            }
            Formulation::FBar => {
                let mean = mean(&|h| determinant(&plus_identity(h, gamma)));
                let scaled = |h: &Tensor| {
                    let f = plus_identity(h, gamma);
                    let ratio = (mean / determinant(&f)).cbrt();
                    f.map(|row| row.map(|f| ratio * f))
                };
                self.h.iter().map(scaled).collect()
            }
        }
    }

    /// Forces on the nodes for weights of σ_v at the points, and the derivative with respect to γ.
    fn pull_back(&self, section: &Section, gamma: f64, weights: &[f64]) -> ([[f64; 3]; N], f64) {
        let material = &section.material;
        let small = material.small_strains();
        let gamma = if small { 1.0 } else { gamma };
        let deformation = self.deformation(section, gamma);
        let by_f = |(f, weight): (&Tensor, &f64)| -> Tensor {
            if *weight == 0.0 {
                return [[0.0; 3]; 3];
            }
            von_mises_slope(material, f).1.map(|row| row.map(|slope| weight * slope))
        };
        let slopes: Vec<Tensor> = deformation.iter().zip(weights).map(by_f).collect();
        let volume: f64 = self.weights.iter().sum();
        let slopes: Vec<Tensor> = match section.formulation {
            Formulation::Full => slopes,
            Formulation::FBar if small => {
                let sum: f64 = slopes.iter().map(trace).sum::<f64>() / 3.0;
                let of = |(slope, weight): (&Tensor, &f64)| -> Tensor {
                    let shift = sum * weight / volume - trace(slope) / 3.0;
                    from_fn(|a| from_fn(|b| slope[a][b] + f64::from(a == b) * shift))
                };
                slopes.iter().zip(&self.weights).map(of).collect()
            }
            Formulation::FBar => {
                let plain: Vec<Tensor> = self.h.iter().map(|h| plus_identity(h, gamma)).collect();
                let determinants: Vec<f64> = plain.iter().map(determinant).collect();
                let mean = self.weights.iter().zip(&determinants).map(|(w, j)| w * j).sum::<f64>() / volume;
                // F̄ = (J̄/J)^(1/3) F
                let along: Vec<f64> = slopes.iter().zip(&deformation).map(|(slope, f)| contract(slope, f)).collect();
                let by_mean = along.iter().sum::<f64>() / (3.0 * mean);
                let of = |p: usize| -> Tensor {
                    let ratio = (mean / determinants[p]).cbrt();
                    let cofactor = cofactor(&plain[p]);
                    let by_determinant = by_mean * self.weights[p] / volume - along[p] / (3.0 * determinants[p]);
                    from_fn(|a| from_fn(|b| ratio * slopes[p][a][b] + by_determinant * cofactor[a][b]))
                };
                (0..plain.len()).map(of).collect()
            }
        };
        let mut forces = [[0.0; 3]; N];
        let mut by_gamma = 0.0;
        for ((slope, gradients), h) in slopes.iter().zip(&self.gradients).zip(&self.h) {
            for (force, gradient) in forces.iter_mut().zip(gradients) {
                for a in 0..3 {
                    force[a] += gamma * (0..3).map(|b| slope[a][b] * gradient[b]).sum::<f64>();
                }
            }
            by_gamma += if small { 0.0 } else { contract(slope, h) };
        }
        (forces, by_gamma)
    }
}

impl<const N: usize> AveragedPoints<N> {
    /// F of the stress at every stress point.
    fn deformation(&self, section: &Section, gamma: f64) -> Vec<Tensor> {
        let small = section.material.small_strains();
        let gamma = if small { 1.0 } else { gamma };
        let averages = self.averages(section, gamma);
        let at = |(h, average): (&Tensor, f64)| -> Tensor {
            let f = plus_identity(h, gamma);
            match section.formulation {
                Formulation::Full => f,
                Formulation::FBar if small => {
                    let shift = (average - trace(h)) / 3.0;
                    from_fn(|a| from_fn(|b| f[a][b] + f64::from(a == b) * shift))
                }
                Formulation::FBar => {
                    let ratio = (average / determinant(&f)).cbrt();
                    f.map(|row| row.map(|f| ratio * f))
                }
            }
        };
        self.h.iter().zip(averages).map(at).collect()
    }

    /// The averages of J, or of tr H for small strains, at the stress points.
    fn averages(&self, section: &Section, gamma: f64) -> Vec<f64> {
        let of = |h: &Tensor| match section.material.small_strains() {
            true => trace(h),
            false => determinant(&plus_identity(h, gamma)),
        };
        let inner: Vec<f64> = self.inner.1.iter().map(of).collect();
        self.average.iter().map(|row| row.iter().zip(&inner).map(|(w, x)| w * x).sum()).collect()
    }

    /// As for [`Points::pull_back`].
    fn pull_back(&self, section: &Section, gamma: f64, weights: &[f64]) -> ([[f64; 3]; N], f64) {
        let small = section.material.small_strains();
        let gamma = if small { 1.0 } else { gamma };
        let deformation = self.deformation(section, gamma);
        let averages = self.averages(section, gamma);
        let mut at_points = vec![[[0.0; 3]; 3]; self.h.len()];
        // by the averages
        let mut inner = vec![0.0; self.inner.1.len()];
        for (s, slope) in at_points.iter_mut().enumerate().filter(|(s, _)| weights[*s] != 0.0) {
            *slope = von_mises_slope(&section.material, &deformation[s]).1.map(|row| row.map(|x| weights[s] * x));
            let by_average = match section.formulation {
                Formulation::Full => continue,
                Formulation::FBar if small => {
                    let third = trace(slope) / 3.0;
                    (0..3).for_each(|a| slope[a][a] -= third);
                    third
                }
                Formulation::FBar => {
                    let f = plus_identity(&self.h[s], gamma);
                    let (j, along) = (determinant(&f), contract(slope, &deformation[s]));
                    let (ratio, cofactor) = ((averages[s] / j).cbrt(), cofactor(&f));
                    *slope = from_fn(|a| from_fn(|b| ratio * slope[a][b] - along / (3.0 * j) * cofactor[a][b]));
                    along / (3.0 * averages[s])
                }
            };
            inner.iter_mut().zip(&self.average[s]).for_each(|(to, w)| *to += by_average * w);
        }
        let of_inner = |(h, by): (&Tensor, &f64)| -> Tensor {
            if small {
                return from_fn(|a| from_fn(|b| f64::from(a == b) * by));
            }
            cofactor(&plus_identity(h, gamma)).map(|row| row.map(|c| by * c))
        };
        let inner_slopes: Vec<Tensor> = self.inner.1.iter().zip(&inner).map(of_inner).collect();
        let slopes = at_points.iter().chain(&inner_slopes);
        let gradients = self.gradients.iter().chain(&self.inner.0);
        let (mut forces, mut by_gamma) = ([[0.0; 3]; N], 0.0);
        for ((slope, gradients), h) in slopes.zip(gradients).zip(self.h.iter().chain(&self.inner.1)) {
            for (force, gradient) in forces.iter_mut().zip(gradients) {
                for a in 0..3 {
                    force[a] += gamma * (0..3).map(|b| slope[a][b] * gradient[b]).sum::<f64>();
                }
            }
            by_gamma += if small { 0.0 } else { contract(slope, h) };
        }
        (forces, by_gamma)
    }
}

fn trace(h: &Tensor) -> f64 {
    h[0][0] + h[1][1] + h[2][2]
}

fn plus_identity(h: &Tensor, gamma: f64) -> Tensor {
    from_fn(|a| from_fn(|b| f64::from(a == b) + gamma * h[a][b]))
}

fn of_hexahedron(element: &Hexahedron, d: &[f64]) -> Points<8> {
    let gradients = (0..STRESS_POINTS).map(|p| element.geometry.shape_gradients(p)).collect();
    let weights = (0..STRESS_POINTS).map(|p| element.geometry.weight(p)).collect();
    Points::new(gradients, weights, &element.nodes, d)
}

fn of_tetrahedron(batch: &Batch, lane: usize, d: &[f64]) -> Points<4> {
    Points::new(vec![batch.shape_gradients(lane)], vec![batch.volumes[lane]], &batch.nodes[lane], d)
}

/// The stresses of an element at its points, padded with zeros.
fn stresses_at(section: &Section, deformation: Vec<Tensor>) -> [Tensor; STRESS_POINTS] {
    let mut out = [[[0.0; 3]; 3]; STRESS_POINTS];
    for (out, f) in out.iter_mut().zip(deformation) {
        *out = cauchy_stress(&section.material, &f);
    }
    out
}

impl SolidModel {
    /// Cauchy stress of the solid material at the Gauss points of every element, in the order of
    /// the mesh; 0 for elements of other ranks. \[F/L²\]
    ///
    /// # Errors
    /// [`InvertedElements`].
    pub fn cauchy_stresses<'a>(
        &self,
        d: &[f64],
        step: impl Into<SolidStep<'a>>,
    ) -> Result<Vec<[Tensor; STRESS_POINTS]>, InvertedElements> {
        let step = step.into();
        let scalings = step.scalings;
        let hexahedra: Vec<_> = self
            .hexahedra
            .par_iter()
            .map(|element| {
                let (section, gamma) = (&self.sections[element.section()], scalings[element.number()].gamma);
                stresses_at(section, of_hexahedron(element, d).deformation(section, gamma))
            })
            .collect();
        let mut out = vec![[[[0.0; 3]; 3]; STRESS_POINTS]; self.elements()];
        for (element, stresses) in self.hexahedra.iter().zip(hexahedra) {
            out[element.number()] = stresses;
        }
        for batch in &self.batches {
            for (lane, &number) in batch.numbers().iter().enumerate() {
                let section = &self.sections[batch.section];
                let gamma = scalings[number as usize].gamma;
                let deformation = of_tetrahedron(batch, lane, d).deformation(section, gamma);
                out[number as usize] = stresses_at(section, deformation);
            }
        }
        macro_rules! add_stresses {
            ($group:expr) => {
                let stresses: Vec<_> = $group
                    .cells
                    .par_iter()
                    .map(|cell| {
                        let section = &self.sections[cell.section as usize];
                        let points = $group.averaged_points(cell, d);
                        stresses_at(section, points.deformation(section, scalings[cell.number as usize].gamma))
                    })
                    .collect();
                $group.cells.iter().zip(stresses).for_each(|(cell, stresses)| out[cell.number as usize] = stresses);
            };
        }
        add_stresses!(self.tet10);
        add_stresses!(self.hex27);
        self.inelastic.add_stresses(self.given(step), d, &mut out);
        let finite =
            |stresses: &[Tensor; STRESS_POINTS]| stresses.as_flattened().as_flattened().iter().all(|s| s.is_finite());
        refuse((0_u32..).zip(&out).filter(|(_, of)| !finite(of)).map(|(e, _)| e).collect())?;
        Ok(out)
    }

    /// Adds the derivatives of Σ w σ_v over the Gauss points with respect to displacements, and to
    /// densities through γ. `weights` has [`STRESS_POINTS`] entries per element. The result does
    /// not depend on the number of threads. Those with respect to the history `step.history`, of elements
    /// with memory, are added to `by_history`.
    ///
    /// Test: `stress_slopes_match_differences`.
    pub fn pull_back_stresses<'a>(
        &self,
        d: &[f64],
        (step, slopes): (impl Into<SolidStep<'a>>, &[ElementScaling]),
        weights: &[f64],
        (by_displacement, by_history): (&mut [f64], &mut [f64]),
        by_density: &mut [f64],
    ) {
        let step = step.into();
        let scalings = step.scalings;
        let into = ByState { displacements: by_displacement, history: by_history };
        self.inelastic.pull_back_stresses(self.given(step), d, weights, into);
        let of = |e: usize| &weights[STRESS_POINTS * e..][..STRESS_POINTS];
        let counts = |e: usize| of(e).iter().any(|&weight| weight != 0.0);
        let hexahedra: Vec<_> = self
            .hexahedra
            .par_iter()
            .map(|element| {
                let e = element.number();
                counts(e).then(|| {
                    let section = &self.sections[element.section()];
                    of_hexahedron(element, d).pull_back(section, scalings[e].gamma, of(e))
                })
            })
            .collect();
        let mut add = |e: usize, nodes: &[u32], forces: &[[f64; 3]], by_gamma: f64| {
            for (&node, force) in nodes.iter().zip(forces) {
                (0..3).for_each(|c| by_displacement[3 * node as usize + c] += force[c]);
            }
            by_density[e] += slopes[e].gamma * by_gamma;
        };
        for (element, found) in self.hexahedra.iter().zip(hexahedra) {
            if let Some((forces, by_gamma)) = found {
                add(element.number(), &element.nodes, &forces, by_gamma);
            }
        }
        for batch in &self.batches {
            for (lane, &number) in batch.numbers().iter().enumerate() {
                let e = number as usize;
                if counts(e) {
                    let points = of_tetrahedron(batch, lane, d);
                    let (forces, by_gamma) = points.pull_back(&self.sections[batch.section], scalings[e].gamma, of(e));
                    add(e, &batch.nodes[lane], &forces, by_gamma);
                }
            }
        }
        macro_rules! pull_back {
            ($group:expr) => {
                for cell in $group.cells.iter().filter(|cell| counts(cell.number as usize)) {
                    let (e, section) = (cell.number as usize, &self.sections[cell.section as usize]);
                    let points = $group.averaged_points(cell, d);
                    let (forces, by_gamma) = points.pull_back(section, scalings[e].gamma, of(e));
                    add(e, &cell.nodes, &forces, by_gamma);
                }
            };
        }
        pull_back!(self.tet10);
        pull_back!(self.hex27);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LawKind;
    use slipstick_mesh::{BoxShape, box_mesh};

    /// By hand: uniaxial stress s gives σ_v = s, pure shear t gives √3 t.
    #[test]
    fn von_mises_by_hand() {
        assert!((von_mises(&[[-5.0, 0.0, 0.0], [0.0; 3], [0.0; 3]]) - 5.0).abs() < 1e-14);
        let shear = von_mises(&[[0.0, 2.0, 0.0], [2.0, 0.0, 0.0], [0.0; 3]]);
        assert!((shear - 2.0 * 3.0f64.sqrt()).abs() < 1e-14);
        assert_eq!(von_mises(&[[3.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 3.0]]), 0.0);
    }

    /// Uniaxial strain λ of the neo-Hooke material (100): P₁₁ = 2c (λ − λ^(−2β−1)), with 2c = μ and
    /// β = ν/(1 − 2ν).
    #[test]
    fn uniaxial_strain_of_neo_hooke() {
        let (e, nu, stretch) = (1000.0, 0.3, 1.2_f64);
        let material = LawKind::NeoHooke.like(e, nu).unwrap();
        let stress = cauchy_stress(&material, &[[stretch, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        let (mu, beta) = (e / (2.0 * (1.0 + nu)), nu / (1.0 - 2.0 * nu));
        // σ = P Fᵀ/J
        let along = mu * (stretch - stretch.powf(-2.0 * beta - 1.0));
        let across = mu * (1.0 - stretch.powf(-2.0 * beta)) / stretch;
        assert!((stress[0][0] - along).abs() < 1e-10 * along, "{stress:?} {along}");
        assert!((stress[1][1] - across).abs() < 1e-10 * across && stress[0][1].abs() < 1e-10);
    }

    /// Every law and formulation, hexahedra and tetrahedra, by displacements and, with interpolated
    /// energy, by densities: against central differences.
    #[test]
    fn stress_slopes_match_differences() {
        let shape = BoxShape { min: [0.0; 3], max: [1.0, 1.1, 0.9], elements: [2, 1, 1], grading: [1.0; 3] };
        let first = box_mesh("block", &shape).unwrap().divided(|element| element == 1);
        let bent = |of: &[[f64; 3]]| -> [f64; 3] {
            from_fn(|c| {
                of.iter().map(|x| x[c]).sum::<f64>() / of.len() as f64 + 0.02 * (of[0][(c + 1) % 3] * 7.0).sin()
            })
        };
        for mesh in [first.second_order(bent).unwrap(), first] {
            assert_slopes(&mesh);
        }
    }

    fn assert_slopes(mesh: &slipstick_mesh::Mesh) {
        let n = mesh.elements.len();
        let d: Vec<f64> = (0..3 * mesh.nodes.len()).map(|i| 0.05 * (i as f64 * 1.7).sin()).collect();
        let gamma = |e: usize, shift: f64| 0.5 + 0.05 * e as f64 + shift;
        let scalings = |moved: usize, h: f64| -> Vec<ElementScaling> {
            let of = |e: usize| ElementScaling {
                factor: 0.7,
                gamma: gamma(e, if e == moved { h } else { 0.0 }),
                strength: 1.0,
            };
            (0..n).map(of).collect()
        };
        let slopes = vec![ElementScaling { gamma: 1.0, ..ElementScaling::NONE }; n];
        let weights: Vec<f64> = (0..STRESS_POINTS * n).map(|i| (i as f64 * 0.9).cos()).collect();
        // laws with memory have no interpolated energy: tests/plasticity.rs
        for kind in LawKind::ALL.iter().filter(|kind| !kind.has_memory()) {
            for formulation in [Formulation::Full, Formulation::FBar] {
                let material = kind.like(100.0, 0.35).unwrap();
                let model = SolidModel::new(mesh, vec![Section { material, formulation }]).unwrap();
                let sum = |d: &[f64], scalings: &[ElementScaling]| -> f64 {
                    let stresses = model.cauchy_stresses(d, scalings).unwrap();
                    stresses.as_flattened().iter().zip(&weights).map(|(s, w)| w * von_mises(s)).sum()
                };
                let (mut by_d, mut by_density) = (vec![0.0; d.len()], vec![0.0; n]);
                model.pull_back_stresses(
                    &d,
                    (&scalings(0, 0.0), &slopes),
                    &weights,
                    (&mut by_d, &mut []),
                    &mut by_density,
                );
                let h = 3e-6;
                for i in 0..d.len() {
                    let at = |h: f64| {
                        let mut d = d.clone();
                        d[i] += h;
                        sum(&d, &scalings(0, 0.0))
                    };
                    let difference = (at(h) - at(-h)) / (2.0 * h);
                    assert!(
                        (difference - by_d[i]).abs() < 1e-5,
                        "{kind:?} {formulation:?} {i}: {} {difference}",
                        by_d[i]
                    );
                }
                for e in 0..n {
                    let difference = (sum(&d, &scalings(e, h)) - sum(&d, &scalings(e, -h))) / (2.0 * h);
                    assert!((difference - by_density[e]).abs() < 1e-6, "{kind:?} {e}: {} {difference}", by_density[e]);
                }
            }
        }
    }
}

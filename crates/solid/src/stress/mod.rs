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

mod averaged;
mod points;

pub(crate) use averaged::AveragedPoints;
pub(crate) use points::Points;

use crate::block::StressSlopes;
use crate::dual::Dual;
use crate::evaluations::Evaluation;
use crate::law::{Material, Real};
use crate::model::{InvertedElements, SolidModel, SolidStep, refuse};
use crate::{ElementScaling, Section};
use slipstick_mesh::Element;
use std::array::from_fn;

/// Entries per element in lists of stresses: one per point. Linear tetrahedra have one point and wedge18 six;
/// their other entries are 0.
///
/// The points of linear elements and of tet10 are those of their integration. Those of hex27 are the
/// points of the 2×2×2 rule, where the stresses of quadratic elements are most accurate, and those of wedge18
/// have the two of them along the axis and three in the triangle. Source: J. Barlow, Int. J. Numer. Methods
/// Engrg. 10 (1976) 243–251.
pub const STRESS_POINTS: usize = 8;

/// Number of points of an element.
pub fn stress_points(element: &Element) -> usize {
    match element {
        Element::Tet4(_) => 1,
        Element::Wedge18(_) => 6,
        Element::Wedge6(_) | Element::Hex8(_) | Element::Tet10(_) | Element::Hex27(_) => STRESS_POINTS,
    }
}

pub(crate) type Tensor = [[f64; 3]; 3];

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

fn trace(h: &Tensor) -> f64 {
    h[0][0] + h[1][1] + h[2][2]
}

fn plus_identity(h: &Tensor, gamma: f64) -> Tensor {
    from_fn(|a| from_fn(|b| f64::from(a == b) + gamma * h[a][b]))
}

/// The stresses of an element at its points, padded with zeros.
pub(crate) fn at_points(section: &Section, deformation: Vec<Tensor>) -> [Tensor; STRESS_POINTS] {
    let mut out = [[[0.0; 3]; 3]; STRESS_POINTS];
    for (out, f) in out.iter_mut().zip(deformation) {
        *out = cauchy_stress(&section.material, &f);
    }
    out
}

/// Weights of σ_v at the stress points, [`STRESS_POINTS`] per element.
pub(crate) struct Weights<'a>(pub &'a [f64]);

impl<'a> Weights<'a> {
    /// Those of an element, unless all are 0.
    pub fn of(&self, element: usize) -> Option<&'a [f64]> {
        let own = &self.0[STRESS_POINTS * element..][..STRESS_POINTS];
        own.iter().any(|&weight| weight != 0.0).then_some(own)
    }
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
        let mut out = vec![[[[0.0; 3]; 3]; STRESS_POINTS]; self.elements()];
        self.visit_stresses(d, step, |element, stresses| out[element] = *stresses)?;
        Ok(out)
    }

    /// Calls `visit` with the number of every element of this rank and its stresses as in
    /// [`cauchy_stresses`](Self::cauchy_stresses), which need no memory then.
    ///
    /// # Errors
    /// [`InvertedElements`], after all visits.
    pub fn visit_stresses<'a>(
        &self,
        d: &[f64],
        step: impl Into<SolidStep<'a>>,
        mut visit: impl FnMut(usize, &[Tensor; STRESS_POINTS]),
    ) -> Result<(), InvertedElements> {
        self.counter.count(Evaluation::Stress);
        let state = self.state(d, step.into());
        let mut wrong = Vec::new();
        let mut each = |element: usize, stresses: &[Tensor; STRESS_POINTS]| {
            if stresses.as_flattened().as_flattened().iter().any(|s| !s.is_finite()) {
                wrong.push(element as u32);
            }
            visit(element, stresses);
        };
        self.blocks.iter().for_each(|block| block.visit_stresses(state, &mut each));
        wrong.sort_unstable();
        refuse(wrong)
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
        self.counter.count(Evaluation::Stress);
        let state = self.state(d, step.into());
        let mut into =
            StressSlopes { displacements: by_displacement, history: by_history, density: (slopes, by_density) };
        self.blocks.iter().for_each(|block| block.pull_back_stresses(state, &Weights(weights), &mut into));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Formulation, LawKind};
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
        let wedges = box_mesh("block", &shape).unwrap().divided_into_wedges(|_| Some(1)).second_order(bent).unwrap();
        for mesh in [first.second_order(bent).unwrap(), first, wedges] {
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
                ..ElementScaling::SOLID
            };
            (0..n).map(of).collect()
        };
        let slopes = vec![ElementScaling { gamma: 1.0, ..ElementScaling::NONE }; n];
        let weights: Vec<f64> = (0..STRESS_POINTS * n).map(|i| (i as f64 * 0.9).cos()).collect();
        // laws with memory: tests/suite/plasticity.rs
        for kind in LawKind::ALL.iter().filter(|kind| !kind.has_memory()) {
            for formulation in [Formulation::Full, Formulation::FBar] {
                let material = kind.like(100.0, 0.35).unwrap();
                let model = SolidModel::new(mesh, vec![Section::new(material, formulation)]).unwrap();
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

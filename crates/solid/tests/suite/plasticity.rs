//! Elements of every type whose law has memory: against elastic elements, differences, and a bar.

use slipstick_linalg::BlockMatrix;
use slipstick_mesh::{BoxShape, Mesh, box_mesh};
use slipstick_solid::stress::{STRESS_POINTS, von_mises};
use slipstick_solid::{
    ElementScaling, EnergyWeights, Formulation, Hencky, InvertedElements, Material, Section, SolidAdjoint, SolidModel,
    SolidStep,
};
use std::array::from_fn;
use std::sync::Arc;

const E: f64 = 700.0;
const NU: f64 = 0.32;

fn plastic(yield_stress: f64) -> Material {
    let values = [E, NU, yield_stress, 200.0].map(Into::into);
    slipstick_solid::LawKind::from_word("j2_linear").unwrap().with_values(&values).unwrap()
}

/// A distorted block of every element type.
fn meshes() -> Vec<Mesh> {
    let shape = BoxShape { min: [0.0; 3], max: [1.0, 1.1, 0.9], elements: [2, 1, 1], grading: [1.0; 3] };
    let mut first = box_mesh("block", &shape).unwrap().divided(|element| element == 1);
    for (i, x) in first.nodes.iter_mut().enumerate() {
        (0..3).for_each(|c| x[c] += 0.03 * ((3 * i + c) as f64 * 1.3).sin());
    }
    let second = first.second_order(|of: &[[f64; 3]]| {
        from_fn(|c| of.iter().map(|x| x[c]).sum::<f64>() / of.len() as f64 + 0.01 * (of[0][(c + 1) % 3] * 7.0).sin())
    });
    vec![second.unwrap(), first]
}

fn displacements(mesh: &Mesh, size: f64) -> Vec<f64> {
    let of = |(i, x): (usize, &[f64; 3])| -> [f64; 3] {
        from_fn(|c| size * (0.5 * (x[(c + 1) % 3] * 1.7).sin() + x[c] * 0.8 + 0.1 * ((3 * i + c) as f64 * 1.7).sin()))
    };
    mesh.nodes.iter().enumerate().flat_map(of).collect()
}

/// A case of the tests below: a state after a step with flow, and displacements for the next one.
struct Loaded {
    model: SolidModel,
    scalings: Vec<ElementScaling>,
    history: Vec<f64>,
    /// Of thermal expansion; empty: none.
    stretches: Vec<f64>,
    d: Vec<f64>,
    mesh: Mesh,
}

fn loaded(each: impl Fn(&Loaded)) {
    for mesh in meshes() {
        let heated = (0..mesh.elements.len()).map(|e| 1.0 + 0.03 * (e as f64 + 0.5).sin()).collect();
        let kinds = [Formulation::Full, Formulation::FBar].map(|formulation| (formulation, Vec::new()));
        let all = kinds.into_iter().chain([(Formulation::FBar, heated)]);
        let cases = all.flat_map(|case| [false, true].map(|interpolated| (case.clone(), interpolated)));
        for ((formulation, stretches), interpolated) in cases {
            let model = SolidModel::new(&mesh, vec![Section::new(plastic(30.0), formulation)]).unwrap();
            let of = |e: usize| ElementScaling {
                // the first element has no stiffness
                factor: if e == 0 { 0.0 } else { 0.5 + 0.1 * e as f64 },
                gamma: if interpolated { [0.9, 0.0, 1.0, 0.7][e % 4] } else { 1.0 },
                strength: 0.9,
                ..ElementScaling::SOLID
            };
            let scalings: Vec<ElementScaling> = (0..mesh.elements.len()).map(of).collect();
            let mut history = vec![0.0; model.history()];
            let step = SolidStep { scalings: &scalings, history: &vec![0.0; model.history()], stretches: &stretches };
            model.update_history(&displacements(&mesh, 0.1), step, &mut history).unwrap();
            let strains = model.plastic_strains(&history);
            assert!(strains.as_flattened().iter().filter(|&&x| x > 0.01).count() > 2, "the step causes flow");
            let d = displacements(&mesh, 0.17);
            each(&Loaded { model, scalings, history, stretches, d, mesh: mesh.clone() });
        }
    }
}

impl Loaded {
    /// Whether the energy is interpolated in any element.
    fn interpolated(&self) -> bool {
        self.scalings.iter().any(|scaling| scaling.gamma != 1.0)
    }

    /// A slope of γ.
    fn slope(&self, e: usize) -> f64 {
        if self.interpolated() { 0.6 - 0.2 * e as f64 } else { 0.0 }
    }

    fn step(&self) -> SolidStep<'_> {
        SolidStep { scalings: &self.scalings, history: &self.history, stretches: &self.stretches }
    }

    fn force(&self, d: &[f64], step: SolidStep<'_>) -> Vec<f64> {
        let mut out = vec![0.0; d.len()];
        self.model.internal_force(d, step, &mut out).unwrap();
        out
    }

    fn next(&self, d: &[f64], step: SolidStep<'_>) -> Vec<f64> {
        let mut out = vec![0.0; self.history.len()];
        self.model.update_history(d, step, &mut out).unwrap();
        out
    }
}

fn weights(n: usize, shift: f64) -> Vec<f64> {
    (0..n).map(|i| (i as f64 * 0.9 + shift).cos()).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Elements that never yield have the forces and energies of the elastic elements of Hencky's law, which
/// share no code with them.
#[test]
fn strong_elements_are_elastic() {
    for mesh in meshes() {
        for formulation in [Formulation::Full, Formulation::FBar] {
            let d = displacements(&mesh, 0.1);
            let scalings = vec![ElementScaling::stiffness(0.7); mesh.elements.len()];
            let of = |material: Material| {
                let model = SolidModel::new(&mesh, vec![Section::new(material, formulation)]).unwrap();
                let mut force = vec![0.0; d.len()];
                model.internal_force(&d, &scalings, &mut force).unwrap();
                let (energies, volumes) = (model.energies(&d, &scalings).unwrap(), model.element_volumes());
                let (stress, j) = (model.cauchy_stresses(&d, &scalings).unwrap(), model.smallest_determinants(&d));
                let first: Vec<f64> =
                    stress.iter().filter(|_| d.len() < 100).flatten().flatten().flatten().copied().collect();
                [force, energies, volumes, j, first]
            };
            let (found, expected) = (of(plastic(1e9)), of(Hencky::new(E, NU).unwrap().into()));
            for (found, expected) in found.iter().zip(&expected) {
                assert_eq!(found.len(), expected.len());
                for (a, b) in found.iter().zip(expected) {
                    assert!((a - b).abs() < 1e-11 * E, "{a} {b}");
                }
            }
        }
    }
}

/// The assembled tangent against differences of the force; it is symmetric.
#[test]
fn tangents_match_differences() {
    loaded(|case| {
        let pattern = Arc::new(slipstick_linalg::BlockPattern::from_rows(&case.mesh.node_neighbours()));
        let scatter = case.model.scatter(&pattern);
        let mut matrix = BlockMatrix::new(pattern);
        case.model.add_tangent(&case.d, case.step(), &scatter, &mut matrix).unwrap();
        let v = weights(case.d.len(), 0.3);
        let mut product = vec![0.0; v.len()];
        matrix.mul(&v, &mut product);
        let mut direct = vec![0.0; v.len()];
        case.model.add_tangent_product(&case.d, case.step(), &v, &mut direct).unwrap();
        let h = 1e-6;
        let at = |s: f64| -> Vec<f64> {
            let d: Vec<f64> = case.d.iter().zip(&v).map(|(d, v)| d + s * v).collect();
            case.force(&d, case.step())
        };
        let (plus, minus) = (at(h), at(-h));
        for i in 0..v.len() {
            let difference = (plus[i] - minus[i]) / (2.0 * h);
            assert!((product[i] - difference).abs() < 1e-5 * E, "{i}: {} {difference}", product[i]);
            assert!((product[i] - direct[i]).abs() < 1e-10 * E);
        }
        let w = weights(v.len(), 1.1);
        let mut of_w = vec![0.0; w.len()];
        matrix.mul(&w, &mut of_w);
        assert!((dot(&w, &product) - dot(&v, &of_w)).abs() < 1e-9 * E, "the tangent is symmetric");
    });
}

/// λ·f + η·h′ by displacements (η only), previous history and densities, against differences.
#[test]
fn pull_backs_match_differences() {
    loaded(|case| {
        let (lambda, eta) = (weights(case.d.len(), 0.3), weights(case.history.len(), 0.8));
        let all = |d: &[f64], step: SolidStep<'_>| dot(&lambda, &case.force(d, step)) + dot(&eta, &case.next(d, step));
        let h = 1e-6;
        // displacements
        let mut out = vec![0.0; case.d.len()];
        case.model.pull_back_current(&case.d, case.step(), &eta, &mut out).unwrap();
        let v = weights(case.d.len(), 2.0);
        let at = |s: f64| {
            let d: Vec<f64> = case.d.iter().zip(&v).map(|(d, v)| d + s * v).collect();
            dot(&eta, &case.next(&d, case.step()))
        };
        let difference = (at(h) - at(-h)) / (2.0 * h);
        assert!((dot(&out, &v) - difference).abs() < 1e-6 * difference.abs(), "{} {difference}", dot(&out, &v));
        // previous history
        let mut out = vec![0.0; case.history.len()];
        let adjoint = SolidAdjoint { forces: &lambda, history: &eta };
        case.model.pull_back_previous(&case.d, case.step(), adjoint, &mut out).unwrap();
        let v = weights(case.history.len(), 3.0);
        let at = |s: f64| {
            let history: Vec<f64> = case.history.iter().zip(&v).map(|(x, v)| x + s * v).collect();
            all(&case.d, SolidStep { history: &history, ..case.step() })
        };
        let difference = (at(h) - at(-h)) / (2.0 * h);
        assert!((dot(&out, &v) - difference).abs() < 1e-6 * difference.abs(), "{} {difference}", dot(&out, &v));
        // densities
        let slopes: Vec<ElementScaling> = (0..case.scalings.len())
            .map(|e| ElementScaling {
                factor: 1.0 + 0.1 * e as f64,
                gamma: case.slope(e),
                strength: -0.4,
                ..ElementScaling::NONE
            })
            .collect();
        let mut out = vec![0.0; slopes.len()];
        case.model.pull_back_density(&case.d, case.step(), &slopes, &lambda, &mut out).unwrap();
        case.model.pull_back_history_density(&case.d, case.step(), &slopes, &eta, &mut out).unwrap();
        for e in 0..slopes.len() {
            let at = |s: f64| {
                let mut scalings = case.scalings.clone();
                scalings[e].factor += s * slopes[e].factor;
                scalings[e].strength += s * slopes[e].strength;
                scalings[e].gamma += s * slopes[e].gamma;
                all(&case.d, SolidStep { scalings: &scalings, ..case.step() })
            };
            let difference = (at(h) - at(-h)) / (2.0 * h);
            assert!((out[e] - difference).abs() < 2e-6 * (1.0 + difference.abs()), "{e}: {} {difference}", out[e]);
        }
    });
}

/// With the history at the end of a step, forces are those that the step has reached.
#[test]
fn a_state_has_the_forces_of_its_step() {
    loaded(|case| {
        let history = case.next(&case.d, case.step());
        let at_state = SolidStep { history: &history, ..case.step() };
        let (step, state) = (case.force(&case.d, case.step()), case.force(&case.d, at_state));
        assert!(step.iter().zip(&state).all(|(a, b)| (a - b).abs() < 1e-11 * E));
        let again = case.next(&case.d, at_state);
        assert!(history.iter().zip(&again).all(|(a, b)| (a - b).abs() < 1e-13));
    });
}

/// Stresses, energies and plastic strains by displacements, history and densities, against differences.
#[test]
fn results_at_a_state_match_differences() {
    loaded(|case| {
        let n = case.scalings.len();
        let mut by_stress = weights(STRESS_POINTS * n, 0.4);
        // von Mises' stress has a kink at rest, where an empty element is
        for (weights, scaling) in by_stress.as_chunks_mut::<STRESS_POINTS>().0.iter_mut().zip(&case.scalings) {
            weights.iter_mut().for_each(|weight| *weight *= f64::from(u8::from(scaling.gamma != 0.0)));
        }
        let (elastic, plastic) = (weights(n, 0.1), weights(n, 0.2));
        let slopes: Vec<ElementScaling> = (0..n)
            .map(|e| ElementScaling {
                factor: 1.0 + 0.1 * e as f64,
                gamma: case.slope(e),
                strength: -0.4,
                ..ElementScaling::NONE
            })
            .collect();
        let stress = |d: &[f64], step: SolidStep<'_>| {
            let stresses = case.model.cauchy_stresses(d, step).unwrap();
            let sizes: Vec<f64> = stresses.as_flattened().iter().map(von_mises).collect();
            dot(&sizes, &by_stress)
        };
        let energy = |d: &[f64], step: SolidStep<'_>| {
            let energies = case.model.elastic_and_plastic(d, step).unwrap();
            energies.iter().zip(&elastic).zip(&plastic).map(|((of, w), v)| w * of.elastic + v * of.plastic).sum::<f64>()
        };
        let strain = |step: SolidStep<'_>| dot(case.model.plastic_strains(step.history).as_flattened(), &by_stress);
        let (mut by_d, mut by_h) = (vec![0.0; case.d.len()], vec![0.0; case.history.len()]);
        let mut stress_by_density = vec![0.0; n];
        case.model.pull_back_stresses(
            &case.d,
            (case.step(), &slopes),
            &by_stress,
            (&mut by_d, &mut by_h),
            &mut stress_by_density,
        );
        assert!(case.interpolated() || stress_by_density.iter().all(|&x| x == 0.0));
        let (mut energy_by_d, mut energy_by_h) = (vec![0.0; by_d.len()], vec![0.0; by_h.len()]);
        let mut by_density = vec![0.0; n];
        let both = EnergyWeights { elastic: &elastic, plastic: &plastic };
        let density = (&slopes[..], &mut by_density[..]);
        let states = (&mut energy_by_d[..], &mut energy_by_h[..]);
        case.model.pull_back_inelastic_energies(&case.d, case.step(), both, states, density);
        let mut strain_by_h = vec![0.0; by_h.len()];
        case.model.pull_back_plastic_strains(&by_stress, &mut strain_by_h);
        let h = 1e-6;
        let v = weights(case.d.len(), 2.0);
        let moved = |s: f64| -> Vec<f64> { case.d.iter().zip(&v).map(|(d, v)| d + s * v).collect() };
        let near = |found: f64, f: &dyn Fn(f64) -> f64| {
            let difference = (f(h) - f(-h)) / (2.0 * h);
            assert!((found - difference).abs() < 1e-6 * (1.0 + difference.abs()), "{found} {difference}");
        };
        near(dot(&by_d, &v), &|s| stress(&moved(s), case.step()));
        near(dot(&energy_by_d, &v), &|s| energy(&moved(s), case.step()));
        let v = weights(case.history.len(), 3.0);
        let moved = |s: f64| -> Vec<f64> { case.history.iter().zip(&v).map(|(x, v)| x + s * v).collect() };
        near(dot(&by_h, &v), &|s| stress(&case.d, SolidStep { history: &moved(s), ..case.step() }));
        near(dot(&energy_by_h, &v), &|s| energy(&case.d, SolidStep { history: &moved(s), ..case.step() }));
        near(dot(&strain_by_h, &v), &|s| strain(SolidStep { history: &moved(s), ..case.step() }));
        for e in 0..n {
            let moved = |s: f64| {
                let mut scalings = case.scalings.clone();
                scalings[e].factor += s * slopes[e].factor;
                scalings[e].strength += s * slopes[e].strength;
                scalings[e].gamma += s * slopes[e].gamma;
                scalings
            };
            near(by_density[e], &|s| energy(&case.d, SolidStep { scalings: &moved(s), ..case.step() }));
            near(stress_by_density[e], &|s| stress(&case.d, SolidStep { scalings: &moved(s), ..case.step() }));
        }
    });
}

/// Inverted elements are named.
#[test]
fn inverted_elements_are_named() {
    let mesh = &meshes()[1];
    let model = SolidModel::new(mesh, vec![Section::from(plastic(30.0))]).unwrap();
    let d: Vec<f64> = mesh.nodes.iter().flatten().map(|x| -1.5 * x).collect();
    let scalings = vec![ElementScaling::SOLID; mesh.elements.len()];
    let found = model.internal_force(&d, &scalings, &mut vec![0.0; d.len()]).unwrap_err();
    assert_eq!(found, InvertedElements { elements: (0..mesh.elements.len() as u32).collect() });
}

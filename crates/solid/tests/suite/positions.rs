//! Derivatives with respect to reference positions, of every law in every element, against finite differences.

use slipstick_mesh::{BoxShape, Mesh, box_mesh};
use slipstick_solid::{
    ElementScaling, EnergyInterpolation, Formulation, Interpolation, LawKind, Section, Simp, SolidAdjoint, SolidModel,
    SolidStep,
};

/// A distorted box of hexahedra, of all linear elements, and of curved quadratic elements.
fn meshes() -> Vec<Mesh> {
    let shape = BoxShape { min: [0.0; 3], max: [2.0, 1.0, 1.5], elements: [2, 1, 2], grading: [1.5, 1.0, 1.0] };
    let mut mesh = box_mesh("block", &shape).unwrap();
    for (i, x) in mesh.nodes.iter_mut().enumerate() {
        (0..3).for_each(|c| x[c] += 0.05 * ((3 * i + c) as f64 * 1.3).sin());
    }
    let mixed = mesh.divided_into_wedges(|element| (element > 1).then_some(1)).divided(|element| element == 0);
    let bent = |of: &[[f64; 3]]| -> [f64; 3] {
        let mean = |c: usize| of.iter().map(|x| x[c]).sum::<f64>() / of.len() as f64;
        std::array::from_fn(|c| mean(c) + 0.01 * (5.0 * mean(c) + mean((c + 1) % 3)).sin())
    };
    let (hex27, tet10) = (mesh.second_order(bent).unwrap(), mesh.divided(|_| true).second_order(bent).unwrap());
    let wedge18 = mesh.divided_into_wedges(|_| Some(1)).second_order(bent).unwrap();
    vec![mesh, mixed, hex27, tet10, wedge18]
}

/// Every law, with F̄, and 2×2×2 points in hex27, of some, and with a Poisson's ratio of the void.
fn sections() -> Vec<Section> {
    let mut out: Vec<Section> = LawKind::ALL.iter().map(|law| law.like(100.0, 0.25).unwrap().into()).collect();
    let soft = LawKind::J2Linear.with_values(&[100.0, 0.25, 0.5, 20.0].map(Into::into)).unwrap();
    let some = [LawKind::NeoHooke, LawKind::LinearElastic, LawKind::Ogden].map(|law| law.like(100.0, 0.25).unwrap());
    for material in some.into_iter().chain([soft]) {
        let formulations = [Formulation::Full, Formulation::FBar, Formulation::Reduced];
        out.extend(formulations.map(|formulation| Section::new(material, formulation)));
    }
    let softened = out.iter().filter(|of| of.material.kind() == LawKind::NeoHooke);
    let softened: Vec<Section> = softened.map(|of| Section { void_poisson_ratio: Some(-0.1), ..*of }).collect();
    out.extend(softened);
    out
}

fn wave(n: usize, size: f64, k: f64) -> Vec<f64> {
    (0..n).map(|i| size * (i as f64 * k + 0.3).sin()).collect()
}

/// λ · f + η · h′ at fixed displacements and history, with and without thermal expansion, at densities below, in
/// and above the range where the energy is interpolated, while bodies with memory flow.
#[test]
fn forces_and_histories_by_positions() {
    let (mut compared, mut flowing) = (0, 0);
    for mesh in meshes() {
        let (n, count) = (3 * mesh.nodes.len(), mesh.elements.len());
        let simp = Simp { penalization: 3.0, minimum: 1e-3 };
        let interpolation = Interpolation { energy: Some(EnergyInterpolation::PUBLISHED), ..simp.into() };
        let densities = (0..count).map(|e| [0.6, 0.19, 0.22, 0.25, 0.05, 1.0][e % 6]);
        let elastic: Vec<ElementScaling> = densities.map(|x| interpolation.scaling(x)).collect();
        let gamma = |e: usize| [1.0, 0.85, 0.0, 0.6][e % 4];
        let of = |e: usize| ElementScaling {
            factor: 0.5 + 0.1 * e as f64,
            gamma: gamma(e),
            strength: 0.9,
            ..ElementScaling::SOLID
        };
        let inelastic: Vec<ElementScaling> = (0..count).map(of).collect();
        let heated: Vec<f64> = (0..count).map(|e| 1.0 + 0.05 * (e as f64 + 0.5).sin()).collect();
        let [before, d] = [wave(n, 0.02, 0.83), wave(n, 0.03, 1.31)];
        let [lambda, direction] = [wave(n, 1.0, 0.41), wave(n, 1.0, 0.77)];
        for section in sections() {
            let memory = section.material.kind().has_memory();
            let scalings = if memory { &inelastic } else { &elastic };
            for stretches in [&heated[..0], &heated] {
                let model = SolidModel::new(&mesh, vec![section]).unwrap();
                let mut history = vec![0.0; model.history()];
                let at_rest = SolidStep { scalings, history: &[], stretches };
                model.update_history(&before, at_rest, &mut history).unwrap();
                let step = SolidStep { scalings, history: &history, stretches };
                let eta = wave(history.len(), 1.0, 0.9);
                let mut value = |h: f64| -> f64 {
                    let mut moved = mesh.clone();
                    moved.nodes.iter_mut().flatten().zip(&direction).for_each(|(x, v)| *x += h * v);
                    let model = SolidModel::new(&moved, vec![section]).unwrap();
                    let (mut force, mut next) = (vec![0.0; n], vec![0.0; history.len()]);
                    model.internal_force(&d, step, &mut force).unwrap();
                    model.update_history(&d, step, &mut next).unwrap();
                    flowing += model.flowing(&history, &next).len();
                    force.iter().zip(&lambda).chain(next.iter().zip(&eta)).map(|(x, weight)| x * weight).sum()
                };
                let h = 1e-4;
                let expected = (8.0 * (value(h) - value(-h)) - (value(2.0 * h) - value(-2.0 * h))) / (12.0 * h);
                let mut found = vec![0.0; n];
                let adjoint = SolidAdjoint { forces: &lambda, history: &eta };
                model.pull_back_positions(&d, step, adjoint, &mut found).unwrap();
                let size: f64 = found.iter().zip(&direction).map(|(x, v)| (x * v).abs()).sum();
                let found: f64 = found.iter().zip(&direction).map(|(x, v)| x * v).sum();
                let what = (section.material.kind(), section.formulation, mesh.elements[0].nodes().len());
                assert!((found - expected).abs() < 1e-9 * size, "{what:?}: {found} {expected}, of {size}");
                compared += 1;
            }
        }
    }
    assert!(compared > 100 && flowing > 100, "{compared} {flowing}");
}

/// Forces do not change if all nodes move: the derivatives of λ · f sum up to zero.
#[test]
fn a_translation_changes_nothing() {
    for mesh in meshes() {
        let n = 3 * mesh.nodes.len();
        let (d, lambda) = (wave(n, 0.03, 1.31), wave(n, 1.0, 0.41));
        for section in sections().into_iter().filter(|section| !section.material.kind().has_memory()) {
            let model = SolidModel::new(&mesh, vec![section]).unwrap();
            let scalings = vec![ElementScaling::SOLID; mesh.elements.len()];
            let mut found = vec![0.0; n];
            let adjoint = SolidAdjoint { forces: &lambda, history: &[] };
            model.pull_back_positions(&d, SolidStep::from(&scalings), adjoint, &mut found).unwrap();
            let size: f64 = found.iter().map(|x| x.abs()).sum();
            for c in 0..3 {
                let sum: f64 = found.iter().skip(c).step_by(3).sum();
                assert!(sum.abs() < 1e-13 * size, "{sum} of {size}");
            }
        }
    }
}

/// Elements at other positions are those that a moved mesh has, and flat ones are refused.
#[test]
fn elements_at_other_positions_are_those_of_a_moved_mesh() {
    for mesh in meshes() {
        let n = 3 * mesh.nodes.len();
        let (d, shift) = (wave(n, 0.03, 1.31), wave(n, 0.02, 0.77));
        let mut moved = mesh.clone();
        moved.nodes.iter_mut().flatten().zip(&shift).for_each(|(x, shift)| *x += shift);
        for section in sections() {
            let model = SolidModel::new(&mesh, vec![section]).unwrap();
            let scalings = vec![ElementScaling::SOLID; mesh.elements.len()];
            let force = |model: &SolidModel| {
                let mut out = vec![0.0; n];
                model.internal_force(&d, &scalings, &mut out).unwrap();
                out
            };
            let found = force(&model.at_positions(&moved.nodes).unwrap());
            let expected = force(&SolidModel::new(&moved, vec![section]).unwrap());
            for (found, expected) in found.iter().zip(&expected) {
                assert!((found - expected).abs() < 1e-13 * 100.0, "{:?}: {found} {expected}", section.material.kind());
            }
            assert_eq!(force(&model.at_positions(&mesh.nodes).unwrap()), force(&model));
            let mut flat = mesh.nodes.clone();
            flat.iter_mut().for_each(|x| x[2] = 0.0);
            assert_eq!(model.at_positions(&flat).unwrap_err().elements.len(), mesh.elements.len());
        }
    }
}

//! Thermal expansion of every law in every element: against elements of another size, and finite differences.

use slipstick_mesh::{BoxShape, Mesh, box_mesh};
use slipstick_solid::stress::{STRESS_POINTS, von_mises};
use slipstick_solid::{
    ElementScaling, EnergyInterpolation, Formulation, Interpolation, LawKind, Section, Simp, SolidModel, SolidStep,
};

/// A box of hexahedra, of wedges and tetrahedra, and of curved quadratic elements.
fn meshes() -> Vec<Mesh> {
    let shape = BoxShape { min: [0.0; 3], max: [2.0, 1.0, 1.5], elements: [2, 1, 2], grading: [1.5, 1.0, 1.0] };
    let mesh = box_mesh("block", &shape).unwrap();
    let mixed = mesh.divided_into_wedges(|element| (element > 1).then_some(1)).divided(|element| element == 0);
    let bent = |of: &[[f64; 3]]| -> [f64; 3] {
        let mean = |c: usize| of.iter().map(|x| x[c]).sum::<f64>() / of.len() as f64;
        std::array::from_fn(|c| mean(c) + 0.01 * (5.0 * mean(c) + mean((c + 1) % 3)).sin())
    };
    let (hex27, tet10) = (mesh.second_order(bent).unwrap(), mesh.divided(|_| true).second_order(bent).unwrap());
    let wedge18 = mesh.divided_into_wedges(|_| Some(1)).second_order(bent).unwrap();
    vec![mesh, mixed, hex27, tet10, wedge18]
}

/// Every law, and F̄ elements of a large- and a small-strain law.
fn sections() -> Vec<Section> {
    let laws = LawKind::ALL.iter().map(|law| law.like(100.0, 0.25).unwrap());
    let mut out: Vec<Section> = laws.map(Section::from).collect();
    for law in [LawKind::NeoHooke, LawKind::LinearElastic] {
        out.push(Section::new(law.like(100.0, 0.25).unwrap(), Formulation::FBar));
    }
    out
}

fn displacements(n: usize) -> Vec<f64> {
    (0..n).map(|i| 0.03 * (i as f64 * 1.31).sin()).collect()
}

fn interpolated(elements: usize) -> (Interpolation, Vec<f64>) {
    let simp = Simp { penalization: 3.0, minimum: 1e-3 };
    let densities = (0..elements).map(|e| [0.6, 0.19, 0.22, 0.25, 0.05, 1.0][e % 6]).collect();
    (Interpolation { energy: Some(EnergyInterpolation::PUBLISHED), ..simp.into() }, densities)
}

/// Forces, energies and stresses of expanded elements are those of elements that are larger from the start,
/// at the same positions. Laws for small strains do not know the size.
#[test]
fn expanded_elements_are_those_of_another_size() {
    let stretch = 1.07;
    for mesh in meshes() {
        let mut larger = mesh.clone();
        larger.nodes.iter_mut().flatten().for_each(|x| *x *= stretch);
        let d = displacements(3 * mesh.nodes.len());
        let moved: Vec<f64> = d.iter().zip(mesh.nodes.iter().flatten()).map(|(d, x)| d - (stretch - 1.0) * x).collect();
        let stretches = vec![stretch; mesh.elements.len()];
        for section in sections().into_iter().filter(|section| !section.material.small_strains()) {
            let (model, other) =
                (SolidModel::new(&mesh, vec![section]).unwrap(), SolidModel::new(&larger, vec![section]).unwrap());
            let (interpolation, densities) = interpolated(mesh.elements.len());
            let scalings: Vec<ElementScaling> = densities.iter().map(|&x| interpolation.scaling(x)).collect();
            let heated = SolidStep { scalings: &scalings, history: &[], stretches: &stretches };
            let near = |what: &str, a: &[f64], b: &[f64]| {
                let size = b.iter().fold(0.0f64, |size, b| size.max(b.abs()));
                let off = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(off < 1e-11 * size, "{what}, {:?}: {off:e} of {size:e}", section.material.kind());
            };
            let (mut force, mut expected) = (vec![0.0; d.len()], vec![0.0; d.len()]);
            model.internal_force(&d, heated, &mut force).unwrap();
            other.internal_force(&moved, &scalings, &mut expected).unwrap();
            near("forces", &force, &expected);
            near("energies", &model.energies(&d, heated).unwrap(), &other.energies(&moved, &scalings).unwrap());
            let [found, expected] = [model.cauchy_stresses(&d, heated), other.cauchy_stresses(&moved, &scalings)]
                .map(|stresses| stresses.unwrap().into_iter().flatten().flatten().flatten().collect::<Vec<f64>>());
            near("stresses", &found, &expected);
        }
    }
}

/// Free expansion is free of stress, for every density.
#[test]
fn free_expansion_causes_no_force() {
    let stretch = 1.2;
    for mesh in meshes() {
        let (interpolation, densities) = interpolated(mesh.elements.len());
        let scalings: Vec<ElementScaling> = densities.iter().map(|&x| interpolation.scaling(x)).collect();
        let d: Vec<f64> = mesh.nodes.iter().flatten().map(|x| (stretch - 1.0) * x + 3.0).collect();
        let stretches = vec![stretch; mesh.elements.len()];
        for section in sections() {
            let model = SolidModel::new(&mesh, vec![section]).unwrap();
            let heated = SolidStep { scalings: &scalings, history: &[], stretches: &stretches };
            let mut force = vec![0.0; d.len()];
            model.internal_force(&d, heated, &mut force).unwrap();
            assert!(force.iter().all(|f| f.abs() < 1e-12 * 100.0), "{:?}", section.material.kind());
            assert!(model.energies(&d, heated).unwrap().iter().all(|energy| energy.abs() < 1e-14 * 100.0));
        }
    }
}

/// Force from energy, tangent from force, and the derivatives of forces and stresses with respect to densities
/// and displacements, with different temperatures of all elements. (Laws with memory: `plasticity.rs`.)
#[test]
fn derivatives_match_differences() {
    let fourth = |at: &dyn Fn(f64) -> f64, h: f64| (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
    for mesh in meshes() {
        let n = mesh.elements.len();
        let d = displacements(3 * mesh.nodes.len());
        let stretches: Vec<f64> = (0..n).map(|e| 1.0 + 0.05 * (e as f64 + 0.5).sin()).collect();
        let (interpolation, densities) = interpolated(n);
        let scalings: Vec<ElementScaling> = densities.iter().map(|&x| interpolation.scaling(x)).collect();
        let slopes: Vec<ElementScaling> = densities.iter().map(|&x| interpolation.derivative(x)).collect();
        let [v, lambda]: [Vec<f64>; 2] = [0.77, 0.41].map(|k| (0..d.len()).map(|i| (i as f64 * k).cos()).collect());
        let moved = |h: f64| -> Vec<f64> { d.iter().zip(&v).map(|(d, v)| d + h * v).collect() };
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        for section in sections().into_iter().filter(|section| !section.material.kind().has_memory()) {
            let model = SolidModel::new(&mesh, vec![section]).unwrap();
            let step = SolidStep { scalings: &scalings, history: &[], stretches: &stretches };
            let near = |what: &str, found: f64, expected: f64| {
                let kind = section.material.kind();
                assert!(
                    (found - expected).abs() < 1e-7 * (1.0 + expected.abs()),
                    "{what}, {kind:?}: {found} {expected}"
                );
            };
            let force = |d: &[f64], scalings: &[ElementScaling]| {
                let mut out = vec![0.0; d.len()];
                model.internal_force(d, SolidStep { scalings, ..step }, &mut out).unwrap();
                out
            };
            near("force", dot(&force(&d, &scalings), &v), fourth(&|h| model.energy(&moved(h), step).unwrap(), 1e-4));
            let mut product = vec![0.0; d.len()];
            model.add_tangent_product(&d, step, &v, &mut product).unwrap();
            near("tangent", dot(&product, &lambda), fourth(&|h| dot(&force(&moved(h), &scalings), &lambda), 1e-4));
            let pattern = std::sync::Arc::new(slipstick_linalg::BlockPattern::from_rows(&mesh.node_neighbours()));
            let mut matrix = slipstick_linalg::BlockMatrix::new(pattern.clone());
            model.add_tangent(&d, step, &model.scatter(&pattern), &mut matrix).unwrap();
            let mut assembled = vec![0.0; d.len()];
            matrix.mul(&v, &mut assembled);
            assert!(assembled.iter().zip(&product).all(|(a, b)| (a - b).abs() < 1e-10));
            let mut by_density = vec![0.0; n];
            model.pull_back_density(&d, step, &slopes, &lambda, &mut by_density).unwrap();
            let weights: Vec<f64> = (0..STRESS_POINTS * n).map(|i| (i as f64 * 0.9).sin()).collect();
            let stress = |d: &[f64], scalings: &[ElementScaling]| {
                let found = model.cauchy_stresses(d, SolidStep { scalings, ..step }).unwrap();
                found.as_flattened().iter().zip(&weights).map(|(s, w)| w * von_mises(s)).sum::<f64>()
            };
            let (mut by_d, mut stress_by_density) = (vec![0.0; d.len()], vec![0.0; n]);
            let into = (&mut by_d[..], &mut [][..]);
            model.pull_back_stresses(&d, (step, &slopes), &weights, into, &mut stress_by_density);
            near("stress", dot(&by_d, &v), fourth(&|h| stress(&moved(h), &scalings), 2e-5));
            for e in 0..n.min(6) {
                let varied = |h: f64| {
                    let mut scalings = scalings.clone();
                    scalings[e] = interpolation.scaling(densities[e] + h);
                    scalings
                };
                near("by density", by_density[e], fourth(&|h| dot(&force(&d, &varied(h)), &lambda), 1e-5));
                near("stress by density", stress_by_density[e], fourth(&|h| stress(&d, &varied(h)), 1e-5));
            }
        }
    }
}

//! The assembled model of every law, on meshes of hexahedra, tetrahedra, wedges and mixtures of
//! them, against finite differences. Single elements: `src/reference/tests.rs`.

use slipstick_linalg::{BlockMatrix, BlockPattern};
use slipstick_mesh::{BoxShape, Mesh, box_mesh};
use slipstick_solid::{
    ElementScaling, EnergyInterpolation, Formulation, Interpolation, LawKind, LinearElastic, Material, NeoHooke,
    Section, Simp, SolidModel,
};
use std::sync::Arc;

/// All laws, F̄ elements of the first, and laws whose bulk modulus falls faster than their shear modulus.
fn sections() -> Vec<Section> {
    let laws = LawKind::ALL.iter().map(|law| law.like(100.0, 0.25).unwrap());
    let mut out: Vec<Section> = laws.map(Section::from).collect();
    out.push(Section { formulation: Formulation::FBar, ..out[0] });
    out.push(Section { void_poisson_ratio: Some(0.05), ..out[0] });
    let rubber = LawKind::MooneyRivlin.like(100.0, 0.25).unwrap();
    let bar = Section::new(rubber, Formulation::FBar);
    out.push(Section { void_poisson_ratio: Some(-0.1), ..bar });
    out
}

/// A box of hexahedra; of tetrahedra; of both; of wedges along any direction; of all three.
fn meshes() -> [Mesh; 5] {
    let shape = BoxShape { min: [0.0; 3], max: [2.0, 1.0, 1.5], elements: [3, 2, 2], grading: [1.5, 1.0, 1.0] };
    let mesh = box_mesh("block", &shape).unwrap();
    let wedges = mesh.divided_into_wedges(|element| Some(element % 3));
    let all = mesh.divided_into_wedges(|element| [None, Some(element / 4), None][element % 3]);
    let all = all.divided(|element| element % 2 == 0);
    [mesh.clone(), mesh.divided(|_| true), mesh.divided(|element| element % 3 == 1), wedges, all]
}

/// Every section on every mesh of first order.
fn models() -> impl Iterator<Item = (Mesh, SolidModel, Vec<f64>, Vec<ElementScaling>)> {
    meshes().into_iter().flat_map(|mesh| sections().into_iter().map(move |section| model(mesh.clone(), section)))
}

/// Elements of second order whose bulk modulus falls faster than their shear modulus, with and without F̄.
fn softened_models() -> impl Iterator<Item = (Mesh, SolidModel, Vec<f64>, Vec<ElementScaling>)> {
    let middle = |of: &[[f64; 3]]| std::array::from_fn(|c| of.iter().map(|x| x[c]).sum::<f64>() / of.len() as f64);
    let [hexahedra, tetrahedra, _, wedges, _] = meshes();
    let quadratic = [hexahedra, tetrahedra, wedges].map(|mesh| mesh.second_order(middle).unwrap());
    let softened: Vec<Section> = sections().into_iter().filter(|of| of.void_poisson_ratio.is_some()).collect();
    quadratic.into_iter().flat_map(move |mesh| softened.clone().into_iter().map(move |of| model(mesh.clone(), of)))
}

fn model(mesh: Mesh, section: Section) -> (Mesh, SolidModel, Vec<f64>, Vec<ElementScaling>) {
    let model = SolidModel::new(&mesh, vec![section]).unwrap();
    let d: Vec<f64> = (0..3 * mesh.nodes.len()).map(|i| 0.03 * (i as f64 * 1.31).sin()).collect();
    let scalings = (0..mesh.elements.len()).map(|e| ElementScaling::stiffness(0.1 + 0.07 * (e % 12) as f64)).collect();
    (mesh, model, d, scalings)
}

/// Densities below, in and above the range where the energy is interpolated, with SIMP and the
/// published interpolation.
fn interpolated(elements: usize) -> (Interpolation, Vec<f64>) {
    let simp = Simp { penalization: 3.0, minimum: 1e-3 };
    let densities = (0..elements).map(|e| [0.05, 0.19, 0.22, 0.25, 0.6, 1.0][e % 6]).collect();
    (Interpolation { energy: Some(EnergyInterpolation::PUBLISHED), ..simp.into() }, densities)
}

#[test]
fn assembled_tangent_matches_differences_of_the_force() {
    for ((mesh, model, d, mut scalings), with_voids) in
        models().chain(softened_models()).flat_map(|m| [(m.clone(), false), (m, true)])
    {
        if with_voids {
            let (interpolation, densities) = interpolated(mesh.elements.len());
            scalings = densities.iter().map(|&x| interpolation.scaling(x)).collect();
        }
        let pattern = Arc::new(BlockPattern::from_rows(&mesh.node_neighbours()));
        let mut matrix = BlockMatrix::new(pattern.clone());
        model.add_tangent(&d, &scalings, &model.scatter(&pattern), &mut matrix).unwrap();
        let direction: Vec<f64> = (0..d.len()).map(|i| (i as f64 * 0.77).cos()).collect();
        let mut product = vec![0.0; d.len()];
        matrix.mul(&direction, &mut product);
        let mut matrix_free = vec![0.0; d.len()];
        model.add_tangent_product(&d, &scalings, &direction, &mut matrix_free).unwrap();
        let force = |h: f64| {
            let moved: Vec<f64> = d.iter().zip(&direction).map(|(d, v)| d + h * v).collect();
            let mut f = vec![0.0; d.len()];
            model.internal_force(&moved, &scalings, &mut f).unwrap();
            f
        };
        let (p, m, pp, mm) = (force(1e-4), force(-1e-4), force(2e-4), force(-2e-4));
        for i in 0..d.len() {
            let fd = (8.0 * (p[i] - m[i]) - (pp[i] - mm[i])) / 12e-4;
            assert!((fd - product[i]).abs() < 1e-8 * 100.0, "{fd} {}", product[i]);
            assert!((product[i] - matrix_free[i]).abs() < 1e-11);
        }
    }
}

/// λᵀ f_int with one scaling changed.
fn work(model: &SolidModel, d: &[f64], scalings: &[ElementScaling], adjoint: &[f64]) -> f64 {
    let mut f = vec![0.0; d.len()];
    model.internal_force(d, scalings, &mut f).unwrap();
    f.iter().zip(adjoint).map(|(f, l)| f * l).sum()
}

/// Through both the stiffness and the interpolation of the energy.
#[test]
fn interpolated_pull_back_matches_differences() {
    for (_, model, d, _) in models().chain(softened_models()) {
        let (interpolation, densities) = interpolated(model.elements());
        let scalings: Vec<_> = densities.iter().map(|&x| interpolation.scaling(x)).collect();
        let slopes: Vec<_> = densities.iter().map(|&x| interpolation.derivative(x)).collect();
        assert!(slopes.iter().filter(|slope| slope.gamma > 1.0).count() > 2);
        let adjoint: Vec<f64> = (0..d.len()).map(|i| (i as f64 * 0.41).sin()).collect();
        let mut found = vec![0.0; scalings.len()];
        model.pull_back_density(&d, &scalings, &slopes, &adjoint, &mut found).unwrap();
        for e in 0..scalings.len() {
            let product = |h: f64| {
                let mut moved = scalings.clone();
                moved[e] = interpolation.scaling(densities[e] + h);
                work(&model, &d, &moved, &adjoint)
            };
            let h = 2e-5;
            let fd = (8.0 * (product(h) - product(-h)) - (product(2.0 * h) - product(-2.0 * h))) / (12.0 * h);
            assert!((fd - found[e]).abs() < 1e-8, "density {}: {fd} {}", densities[e], found[e]);
        }
    }
}

#[test]
fn inverted_elements_are_named() {
    for mesh in meshes() {
        inverted_elements(model(mesh, sections()[0]));
    }
}

/// Small-strain laws accept displacements that turn elements inside out. NaN is still refused.
#[test]
fn small_strains_know_no_inversion() {
    let small = |section: &Section| section.material.small_strains();
    for (mesh, section) in
        meshes().into_iter().flat_map(|mesh| sections().into_iter().filter(small).map(move |s| (mesh.clone(), s)))
    {
        for formulation in [Formulation::Full, Formulation::FBar] {
            let (_, model, mut d, scalings) = model(mesh.clone(), Section { formulation, ..section });
            let force = |d: &[f64]| {
                let mut f = vec![0.0; d.len()];
                model.internal_force(d, &scalings, &mut f).map(|()| f)
            };
            let expected: Vec<f64> = force(&d).unwrap().iter().map(|f| -1e6 * f).collect();
            d.iter_mut().for_each(|d| *d *= -1e6);
            assert!(model.smallest_determinants(&d).iter().any(|&j| j < 0.0));
            for (found, expected) in force(&d).unwrap().iter().zip(expected) {
                assert!((found - expected).abs() < 1e-12 * 1e8, "{found} {expected}");
            }
            d[4] = f64::NAN;
            assert!(force(&d).is_err());
        }
    }
}

/// By hand: under the displacements of uniaxial stress, (ε x, −ν ε y, −ν ε z), a bar of linear
/// elastic material feels E ε on its ends and nothing elsewhere, however large ε is, and stores E
/// ε²/2 per volume.
#[test]
fn uniaxial_stress_of_linear_elasticity() {
    let (e, nu, strain) = (100.0, 0.25, 0.3);
    for (number, mesh) in meshes().into_iter().enumerate() {
        for formulation in [Formulation::Full, Formulation::FBar] {
            let material = LinearElastic::new(e, nu).unwrap().into();
            let model = SolidModel::new(&mesh, vec![Section::new(material, formulation)]).unwrap();
            let scalings = vec![ElementScaling::SOLID; model.elements()];
            let d: Vec<f64> =
                mesh.nodes.iter().flat_map(|x| [strain * x[0], -nu * strain * x[1], -nu * strain * x[2]]).collect();
            let mut force = vec![0.0; d.len()];
            model.internal_force(&d, &scalings, &mut force).unwrap();
            let mut resultant = 0.0;
            for (x, f) in mesh.nodes.iter().zip(force.as_chunks::<3>().0) {
                let end = x[0] == 0.0 || x[0] == 2.0;
                resultant += if x[0] == 2.0 { f[0] } else { 0.0 };
                for (a, f) in f.iter().enumerate() {
                    // Where the faces of neighbours do not fit, a uniform stress does not pass node
                    // by node.
                    assert!((end && a == 0) || number > 1 || f.abs() < 1e-13 * e, "{x:?}: {f:?}");
                }
            }
            assert!((resultant / (e * strain * 1.5) - 1.0).abs() < 1e-13, "{resultant}");
            let energy = model.energy(&d, &scalings).unwrap();
            assert!((energy / (3.0 * 0.5 * e * strain * strain) - 1.0).abs() < 1e-13, "{energy}");
        }
    }
}

/// By hand: with linear elasticity, the energies per volume under a uniform strain ε and a shear γ are 9/2 K ε² and
/// μ γ²/2. The shear modulus follows the stiffness, s μ; the bulk modulus is s (r K + (1 − r) K₀).
#[test]
fn bulk_modulus_of_light_elements() {
    let (nu, of_void, strain) = (0.49, 0.3, 0.01);
    let mu = 100.0 / (2.0 * (1.0 + nu));
    let [bulk, least] = [nu, of_void].map(|nu| 2.0 * mu * (1.0 + nu) / (3.0 * (1.0 - 2.0 * nu)));
    let section = Section::from(LinearElastic::new(100.0, nu).unwrap());
    let section = Section { void_poisson_ratio: Some(of_void), ..section };
    for mesh in meshes() {
        for density in [0.0, 0.3, 0.8, 1.0] {
            let model = SolidModel::new(&mesh, vec![section]).unwrap();
            let interpolation = Interpolation { bulk: 2.0, ..Simp::default().into() };
            let scalings = vec![interpolation.scaling(density); model.elements()];
            let (s, r): (f64, f64) = (1e-3 + (1.0 - 1e-3) * density.powi(3), density.powi(2));
            let grown: Vec<f64> = mesh.nodes.iter().flatten().map(|x| strain * x).collect();
            let sheared: Vec<f64> = mesh.nodes.iter().flat_map(|x| [strain * x[1], 0.0, 0.0]).collect();
            let expected = [s * (r * bulk + (1.0 - r) * least) * 4.5, s * mu * 0.5];
            for (d, expected) in [grown, sheared].iter().zip(expected) {
                let energy = model.energy(d, &scalings).unwrap() / (3.0 * strain * strain);
                assert!((energy / expected - 1.0).abs() < 1e-12, "{density}: {energy} {expected}");
            }
        }
    }
}

/// All isotropic elastic laws have a shear and a bulk modulus; the others refuse another Poisson's ratio.
#[test]
fn laws_with_another_poisson_ratio() {
    for law in LawKind::ALL {
        let material = law.like(100.0, 0.4).unwrap();
        let changed = material.with_poisson_ratio(0.3);
        assert_eq!(changed.is_none(), law.has_memory() || *law == LawKind::Orthotropic, "{law:?}");
        let Some(changed) = changed else { continue };
        let shear = |of: &Material| of.youngs_modulus() / (2.0 * (1.0 + of.poisson_ratio()));
        assert!((changed.poisson_ratio() - 0.3).abs() < 1e-14, "{law:?}");
        assert!((shear(&changed) / shear(&material) - 1.0).abs() < 1e-14, "{law:?}");
        assert_eq!(changed.kind(), material.kind());
        assert!([0.5, -1.0, f64::NAN].iter().all(|&nu| material.with_poisson_ratio(nu).is_none()));
    }
}

fn inverted_elements((mesh, model, mut d, scalings): (Mesh, SolidModel, Vec<f64>, Vec<ElementScaling>)) {
    let slopes = vec![ElementScaling::SOLID; scalings.len()];
    d[3 * 5 + 1] = 40.0;
    let smallest = model.smallest_determinants(&d);
    let expected: Vec<u32> = (0_u32..).zip(smallest).filter(|(_, j)| *j <= 0.0).map(|(e, _)| e).collect();
    assert!(!expected.is_empty() && expected.len() < mesh.elements.len());
    let pattern = Arc::new(BlockPattern::from_rows(&mesh.node_neighbours()));
    let mut matrix = BlockMatrix::new(pattern.clone());
    let (mut f, mut by_density) = (vec![0.0; d.len()], vec![0.0; scalings.len()]);
    for error in [
        model.internal_force(&d, &scalings, &mut f).unwrap_err(),
        model.add_tangent(&d, &scalings, &model.scatter(&pattern), &mut matrix).unwrap_err(),
        model.add_tangent_product(&d, &scalings, &vec![1.0; d.len()], &mut f).unwrap_err(),
        model.pull_back_density(&d, &scalings, &slopes, &vec![1.0; d.len()], &mut by_density).unwrap_err(),
        model.energy(&d, &scalings).unwrap_err(),
    ] {
        assert_eq!(error.elements, expected);
        assert!(error.to_string().contains("inverted element"));
    }
    assert!(by_density.iter().all(|&x| x == 0.0));
    d[3 * 5 + 1] = f64::NAN;
    assert!(model.internal_force(&d, &scalings, &mut f).is_err());
}

/// A uniform deformation of tetrahedra: the energy is the law's, inside no node feels a force, F̄ is F, and solid
/// elements do not feel the void's Poisson's ratio.
#[test]
fn tetrahedra_deform_uniformly() {
    let mesh = meshes()[1].clone();
    let h = [[-0.1, 0.2, 0.05], [0.1, 0.15, -0.1], [0.0, 0.1, 0.08]];
    let f = std::array::from_fn(|a| std::array::from_fn(|b| h[a][b] + f64::from(a == b)));
    let d: Vec<f64> =
        mesh.nodes.iter().flat_map(|x| h.map(|row| (0..3).map(|b| row[b] * x[b]).sum::<f64>() + 1.0)).collect();
    let mut forces = Vec::new();
    for section in sections() {
        let model = SolidModel::new(&mesh, vec![section]).unwrap();
        assert!((model.element_volumes().iter().sum::<f64>() - 3.0).abs() < 1e-14);
        let scalings = vec![ElementScaling::SOLID; model.elements()];
        let energy = model.energy(&d, &scalings).unwrap();
        assert!((energy / (3.0 * section.material.energy(&f)) - 1.0).abs() < 1e-13);
        let mut force = vec![0.0; d.len()];
        model.internal_force(&d, &scalings, &mut force).unwrap();
        for node in inner(&mesh) {
            assert!(force[3 * node..][..3].iter().all(|f| f.abs() < 1e-12 * 100.0), "{node}: {force:?}");
        }
        forces.push(force);
    }
    // of the first law: F̄, and solid elements whose void has a Poisson's ratio of its own
    let bar = LawKind::ALL.len();
    assert!(forces[0] == forces[bar] && forces[0] == forces[bar + 1]);
}

/// Nodes that are not on the boundary.
fn inner(mesh: &Mesh) -> Vec<usize> {
    let outer = mesh.boundary(0).nodes();
    let inner: Vec<usize> = (0..mesh.nodes.len()).filter(|n| outer.binary_search(&(*n as u32)).is_err()).collect();
    assert_eq!(inner.len(), 2);
    inner
}

/// Force, tangent, product and pull-back with one thread and with several, on a mesh of many
/// clusters.
#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let shape = BoxShape { min: [0.0; 3], max: [2.0, 1.0, 1.5], elements: [13, 11, 9], grading: [1.5, 1.0, 1.0] };
    let mesh = box_mesh("block", &shape).unwrap().divided(|element| element % 5 == 2);
    let model = SolidModel::new(&mesh, vec![NeoHooke::new(100.0, 0.25).unwrap()]).unwrap();
    let d: Vec<f64> = (0..3 * mesh.nodes.len()).map(|i| 0.01 * (i as f64 * 1.31).sin()).collect();
    let v: Vec<f64> = (0..d.len()).map(|i| (i as f64 * 0.77).cos()).collect();
    let (interpolation, densities) = interpolated(mesh.elements.len());
    let scalings: Vec<_> = densities.iter().map(|&x| interpolation.scaling(x)).collect();
    let slopes: Vec<_> = densities.iter().map(|&x| interpolation.derivative(x)).collect();
    let pattern = Arc::new(BlockPattern::from_rows(&mesh.node_neighbours()));
    let scatter = model.scatter(&pattern);
    let evaluate = |threads: usize| -> Vec<u64> {
        let mut matrix = BlockMatrix::new(pattern.clone());
        let (mut force, mut product, mut by_density) =
            (vec![0.0; d.len()], vec![0.0; d.len()], vec![0.0; scalings.len()]);
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| {
            model.internal_force(&d, &scalings, &mut force).unwrap();
            model.add_tangent(&d, &scalings, &scatter, &mut matrix).unwrap();
            model.add_tangent_product(&d, &scalings, &v, &mut product).unwrap();
            model.pull_back_density(&d, &scalings, &slopes, &v, &mut by_density).unwrap();
        });
        let numbers = force.iter().chain(&product).chain(&by_density).chain(matrix.values().as_flattened());
        numbers.map(|x| x.to_bits()).collect()
    };
    let expected = evaluate(1);
    for threads in [2, 3, 8] {
        assert!(evaluate(threads) == expected, "{threads} threads");
    }
}

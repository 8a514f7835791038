//! The three forms of the neo-Hookean law in one element against their closed forms, and how much
//! they differ. The table in docs/measurements/elements.md is written by
//!
//!     cargo test --release -p slipstick-solid --test suite forms -- --nocapture

use slipstick_mesh::{BoxShape, Mesh, box_mesh};
use slipstick_solid::{ElementScaling, Formulation, LawKind, Material, Section, SolidModel};

type Matrix = [[f64; 3]; 3];

/// The principal value P_i of the first Piola-Kirchhoff stress at principal stretches, derived by
/// hand from the energy of each form.
fn principal(form: &str, e: f64, nu: f64, stretches: [f64; 3], i: usize) -> f64 {
    let (mu, lambda) = (e / (2.0 * (1.0 + nu)), e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)));
    let (j, own) = (stretches.iter().product::<f64>(), stretches[i]);
    match form {
        "power" => mu * (own - j.powf(-2.0 * nu / (1.0 - 2.0 * nu)) / own),
        "ln" => mu * (own - 1.0 / own) + lambda * j.ln() / own,
        "isochoric" => {
            let (bulk, i1) = (lambda + 2.0 * mu / 3.0, stretches.iter().map(|x| x * x).sum::<f64>());
            mu * j.powf(-2.0 / 3.0) * (own - i1 / (3.0 * own)) + bulk * (j - 1.0) * j / own
        }
        _ => panic!("{form}"),
    }
}

/// Stretches under uniaxial stress (kind 0), equibiaxial stress (1) and uniaxial strain (2); free
/// faces have no stress.
fn stretches(form: &str, nu: f64, kind: usize, stretch: f64) -> [f64; 3] {
    let with = |free: f64| match kind {
        0 => [stretch, free, free],
        1 => [stretch, stretch, free],
        _ => [stretch, 1.0, 1.0],
    };
    let (mut low, mut high) = (0.1, 10.0);
    for _ in 0..200 {
        let mid = 0.5 * (low + high);
        if principal(form, 1.0, nu, with(mid), 2) > 0.0 { high = mid } else { low = mid }
    }
    with(low)
}

fn form(name: &str, e: f64, nu: f64) -> Material {
    let law = LawKind::forms("neo_hooke").into_iter().find(|(form, _)| *form == name).expect("a form").1;
    law.like(e, nu).expect("constants")
}

/// A cube of one element.
fn cube() -> Mesh {
    let shape = BoxShape { min: [0.0; 3], max: [1.0; 3], elements: [1; 3], grading: [1.0; 3] };
    box_mesh("cube", &shape).expect("a mesh")
}

/// P of an element under uniform deformation: the force on each of the faces at x, y, z = 1.
fn element_stress(material: Material, formulation: Formulation, f: &Matrix) -> Matrix {
    let mesh = cube();
    let model = SolidModel::new(&mesh, vec![Section::new(material, formulation)]).expect("a model");
    let moved = |x: &[f64; 3], a: usize| (0..3).map(|b| f[a][b] * x[b]).sum::<f64>() - x[a];
    let d: Vec<f64> = mesh.nodes.iter().flat_map(|x| [0, 1, 2].map(|a| moved(x, a))).collect();
    let mut force = vec![0.0; d.len()];
    model.internal_force(&d, &[ElementScaling::SOLID], &mut force).expect("a state");
    let on_face = |a: usize, b: usize| -> f64 {
        mesh.nodes.iter().enumerate().filter(|(_, x)| x[b] == 1.0).map(|(n, _)| force[3 * n + a]).sum()
    };
    std::array::from_fn(|a| std::array::from_fn(|b| on_face(a, b)))
}

fn assert_stress(material: Material, f: &Matrix, expected: &Matrix) {
    for formulation in [Formulation::Full, Formulation::FBar] {
        let found = element_stress(material, formulation, f);
        let scale = expected.as_flattened().iter().fold(1.0_f64, |most, p| most.max(p.abs()));
        for (p, q) in found.as_flattened().iter().zip(expected.as_flattened()) {
            assert!((p - q).abs() < 1e-12 * scale, "{material} {formulation:?}: {found:?} {expected:?}");
        }
    }
}

/// Uniaxial and equibiaxial stress, and uniaxial strain.
#[test]
fn stretched_elements_have_the_stress_of_the_closed_form() {
    for (name, _) in LawKind::forms("neo_hooke") {
        for nu in [0.0, 0.3, 0.45] {
            let material = form(name, 7.0, nu);
            for (kind, stretch) in [0, 1, 2].into_iter().flat_map(|kind| [0.7, 1.0, 1.5].map(|stretch| (kind, stretch)))
            {
                let stretches = stretches(name, nu, kind, stretch);
                let diagonal = |values: [f64; 3]| -> Matrix {
                    std::array::from_fn(|a| std::array::from_fn(|b| if a == b { values[a] } else { 0.0 }))
                };
                let expected = [0, 1, 2].map(|i| principal(name, 7.0, nu, stretches, i));
                assert_stress(material, &diagonal(stretches), &diagonal(expected));
            }
        }
    }
}

/// Simple shear by γ: J = 1 and σ₁₂ = μγ for every form; the normal stresses are μγ² and 0 of the
/// coupled forms, and their deviator for the isochoric one.
#[test]
fn sheared_elements_have_the_stress_of_the_closed_form() {
    let (mu, gamma, nu) = (2.5, 0.6, 0.4);
    for (name, _) in LawKind::forms("neo_hooke") {
        let f = [[1.0, gamma, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let mean = if name == "isochoric" { mu * gamma * gamma / 3.0 } else { 0.0 };
        let cauchy: Matrix =
            [[mu * gamma * gamma - mean, mu * gamma, 0.0], [mu * gamma, -mean, 0.0], [0.0, 0.0, -mean]];
        // P = J σ F⁻ᵀ, with F⁻ᵀ = 1 − γ e₂ ⊗ e₁
        let expected = cauchy.map(|row| [row[0] - gamma * row[1], row[1], row[2]]);
        assert_stress(form(name, 2.0 * mu * (1.0 + nu), nu), &f, &expected);
    }
}

/// docs/measurements/elements.md shows the differences of the forms as this test computes them.
#[test]
fn differences_are_documented() {
    let mut table =
        String::from("| ν | loading | strain | `power`, P/E | `ln` | `isochoric` |\n|---|---|---|---|---|---|\n");
    for nu in [0.3, 0.45] {
        for (kind, name) in [(0, "uniaxial stress"), (2, "uniaxial strain")] {
            for stretch in [0.5, 0.9, 1.1, 1.5] {
                let stress = |form: &str| principal(form, 1.0, nu, stretches(form, nu, kind, stretch), 0);
                let base = stress("power");
                let [ln, isochoric] = ["ln", "isochoric"].map(|form| 100.0 * (stress(form) / base - 1.0));
                let strain = 100.0 * (stretch - 1.0);
                table += &format!("| {nu} | {name} | {strain:+.0} % | {base:.4} | {ln:+.1} % | {isochoric:+.1} % |\n");
            }
        }
    }
    println!("{table}");
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/measurements/elements.md");
    assert!(
        std::fs::read_to_string(page).expect("a page").contains(&table),
        "docs/measurements/elements.md has another table"
    );
}

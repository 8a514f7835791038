//! Derivatives of all quantities with respect to coefficients of thermal expansion and changes of temperature,
//! compared with central differences of order 4 of whole paths: all kinds of elements and strains, plasticity,
//! interpolated energies; a bimetal strip, and a shrink fit with friction.

use crate::common::scene::{LAGRANGE, Scene, penalty};
use crate::common::{forward, problem, problem_with, random_density, status_path};
use crate::quantity_gradients::{responses, set};
use slipstick::build::Problem;
use slipstick::design::quantity::{Dimension, ElementData, Quantity, Reads, StateDerivative, StateView};
use slipstick::design::{ObservedSteps, Response};
use slipstick::model::Parameter;
use slipstick_mesh::{BoxShape, Mesh, box_mesh};
use slipstick_path::Silent;
use std::sync::Arc;

/// Plastic work plus a weighted sum of internal forces, data that no other quantity here reads.
struct Works;

impl Quantity for Works {
    fn name(&self) -> &str {
        "plastic work and internal forces"
    }

    fn dimension(&self) -> Dimension {
        Dimension { force: 1, length: 1, mass: 0 }
    }

    fn reads(&self) -> Reads {
        Reads { elements: ElementData { plastic_work: true, ..ElementData::default() }, ..Reads::default() }
    }

    fn value(&self, state: &StateView) -> f64 {
        let forces = state.internal_force.iter().enumerate().map(|(i, f)| f * (i as f64).cos());
        state.elements.plastic_work.iter().sum::<f64>() + forces.sum::<f64>()
    }

    fn pull_back(&self, _: &StateView, weight: f64, to: &mut StateDerivative) {
        to.elements.plastic_work.iter_mut().for_each(|work| *work += weight);
        to.internal_force.iter_mut().enumerate().for_each(|(i, f)| *f += weight * (i as f64).cos());
    }
}

/// Coefficients of both bodies, changes of temperature of the slab and at a face of the block.
const VALUES: [f64; 4] = [1e-3, 1.5e-3, 40.0, 30.0];
const PARAMETERS: [Parameter; 4] = [
    Parameter::Expansion { body: 0 },
    Parameter::Expansion { body: 1 },
    Parameter::Temperature { change: 0 },
    Parameter::Temperature { change: 1 },
];

struct Kind {
    name: &'static str,
    scene: Scene,
    /// What replaces what in the text.
    replaced: Vec<(&'static str, &'static str)>,
    meshes: Option<[Mesh; 2]>,
}

const ELASTIC: &str = "neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 }";
const LINEAR: &str = "linear_elastic = { youngs_modulus = 1000.0, poisson_ratio = 0.3 }";
const PLASTIC: &str =
    "j2_linear = { youngs_modulus = 1000.0, poisson_ratio = 0.3, yield_stress = 20, hardening_modulus = 150 }";

fn kinds() -> Vec<Kind> {
    let scene = |enforcement: &str, design: &str| Scene {
        slab: [3, 1, 1],
        friction: 0.35,
        enforcement: enforcement.into(),
        motion: "[{ t = 0.4, u = [0, -0.1, 0] }, { t = 1.0, u = [0.1, -0.12, 0.03] }]".into(),
        steps: 5,
        design: design.into(),
        ..Scene::default()
    };
    let kind = |name, enforcement: &str, design: &str, replaced: &[(&'static str, &'static str)]| Kind {
        name,
        scene: scene(enforcement, design),
        replaced: replaced.to_vec(),
        meshes: None,
    };
    let interpolated = "energy_interpolation = { threshold = 0.2, sharpness = 3 }";
    let shape = |min: [f64; 3], max: [f64; 3], elements: [usize; 3]| BoxShape { min, max, elements, grading: [1.0; 3] };
    let slab = box_mesh("slab", &shape([0.0; 3], [4.0, 1.0, 1.0], [3, 1, 1])).expect("a mesh");
    let block = box_mesh("block", &shape([0.6, 1.0, 0.1], [1.4, 1.8, 0.9], [1; 3])).expect("a mesh");
    let middle = |of: &[[f64; 3]]| -> [f64; 3] {
        std::array::from_fn(|c| of.iter().map(|x| x[c]).sum::<f64>() / of.len() as f64)
    };
    let quadratic = |mesh: &Mesh| mesh.second_order(middle).expect("a mesh");
    let with_meshes = |name, of: &[(&'static str, &'static str)], slab: Mesh, block: Mesh| Kind {
        meshes: Some([slab, block]),
        ..kind(name, LAGRANGE, "", of)
    };
    let wedges = slab.divided_into_wedges(|_| Some(1));
    let tetrahedra = [&slab, &block].map(|mesh| mesh.divided(|_| true));
    vec![
        kind("hexahedra", LAGRANGE, "", &[]),
        kind("penalty", &penalty(2e4), "", &[]),
        kind("interpolated", LAGRANGE, interpolated, &[]),
        kind("small strains", LAGRANGE, "", &[(ELASTIC, LINEAR)]),
        kind(
            "small strains, interpolated, F̄",
            LAGRANGE,
            interpolated,
            &[(ELASTIC, LINEAR), ("\nmaterial", "\nelement = \"f_bar\"\nmaterial")],
        ),
        kind("plastic", LAGRANGE, "yield_p = 2.5", &[(ELASTIC, PLASTIC)]),
        kind("plastic, interpolated", LAGRANGE, interpolated, &[(ELASTIC, PLASTIC)]),
        kind(
            "plastic, penalty, F̄",
            &penalty(2e4),
            "",
            &[(ELASTIC, PLASTIC), ("\nmaterial", "\nelement = \"f_bar\"\nmaterial")],
        ),
        with_meshes("tet4 and hexahedra", &[], tetrahedra[0].clone(), block.clone()),
        with_meshes("hex27 and tet10", &[], quadratic(&slab), quadratic(&tetrahedra[1])),
        with_meshes("wedge18 and hex27, plastic", &[(ELASTIC, PLASTIC)], quadratic(&wedges), quadratic(&block)),
    ]
}

impl Kind {
    fn problem(&self, values: [f64; 4]) -> Problem {
        let [slab, block, first, second] = values;
        let more = format!(
            "[[temperature]]\nbody = 'slab'\nchange = {first:?}\n\
             amplitude = [{{ t = 0.4, factor = 1.0 }}, {{ t = 1.0, factor = 0.4 }}]\n\
             [[temperature]]\nset = 'block_xmin'\nchange = {second:?}\n"
        );
        let mut text = Scene { more, ..self.scene.clone() }.text();
        for (from, to) in &self.replaced {
            text = text.replace(from, to);
        }
        let parts: Vec<&str> = text.split("\nmaterial").collect();
        let mut text = format!(
            "{}\nthermal_expansion = {slab:?}\nmaterial{}\nthermal_expansion = {block:?}\nmaterial{}",
            parts[0], parts[1], parts[2]
        );
        let Some(meshes) = &self.meshes else { return problem(&text) };
        for name in ["slab", "block"] {
            let start = text.find("box = ").expect("a box");
            let end = start + text[start..].find('\n').expect("a line");
            text.replace_range(start..end, &format!("mesh = {{ file = '{name}' }}"));
        }
        problem_with(&text, &[("slab", meshes[0].clone()), ("block", meshes[1].clone())])
    }
}

#[test]
fn derivatives_of_all_quantities_match_differences() {
    for kind in kinds() {
        let prepared = |values: [f64; 4]| {
            let mut problem = kind.problem(values);
            let mut all = responses(&problem, &[1.0]);
            all.push(Response::of(Arc::new(Works), ObservedSteps::All, 1.0));
            set(&mut problem, all);
            let density = random_density(&problem, 2);
            let forward = forward(&mut problem, &density);
            (problem, forward)
        };
        let (mut problem, base) = prepared(VALUES);
        let statuses = status_path(&mut problem, &base);
        let gradients = problem.analysis.response_gradients(&base, true).expect("differentiable");
        let mut worst = 0.0f64;
        for (i, parameter) in PARAMETERS.iter().enumerate() {
            let h = 5e-4;
            let at = |shift: f64| {
                let mut values = VALUES;
                values[i] *= 1.0 + shift;
                let (mut problem, forward) = prepared(values);
                assert_eq!(status_path(&mut problem, &forward), statuses, "{}: {parameter:?}", kind.name);
                forward.constraints
            };
            let (p1, m1, p2, m2) = (at(h), at(-h), at(2.0 * h), at(-2.0 * h));
            for (r, of) in gradients.iter().enumerate() {
                let name = problem.analysis.constraints[r].response.name();
                let difference = (8.0 * (p1[r] - m1[r]) - (p2[r] - m2[r])) / (12.0 * h);
                // a temperature is a factor, equal to 1
                let unit = if i < 2 { VALUES[i] } else { 1.0 };
                let found = unit * of.parameters.iter().find(|(known, _)| known == parameter).expect("there").1;
                // lengths of the scene are about 1, and closed gaps are 0 up to round-off
                let round_off = 1e-13 * base.constraints[r].abs().max(1.0) / h;
                let error = (found - difference).abs();
                let scale = difference.abs().max(1e-4 * base.constraints[r].abs());
                let known = error <= round_off && scale <= 1e3 * round_off;
                let error = if known { 0.0 } else { error / scale };
                // the largest of several has a kink where another one takes over; its derivative is that of a side
                let b = base.constraints[r];
                let sides = [4.0 * p1[r] - p2[r] - 3.0 * b, 3.0 * b - 4.0 * m1[r] + m2[r]].map(|side| side / (2.0 * h));
                if name == "largest" && (sides[0] - sides[1]).abs() > 1e-4 * scale {
                    let nearest = sides.iter().map(|side| (found - side).abs() / scale).fold(f64::INFINITY, f64::min);
                    assert!(nearest < 1e-5, "{}: {name} by {parameter:?}: {found:e}, sides {sides:?}", kind.name);
                    continue;
                }
                worst = worst.max(error);
                assert!(error < 1e-6, "{}: {name} by {parameter:?}: {found:e} instead of {difference:e}", kind.name);
            }
        }
        println!("{}: {worst:.1e}", kind.name);
    }
}

/// The derivative of a quantity `q` with respect to the last parameter of a case, and its difference quotient.
fn compare(text: impl Fn(f64) -> String, parameter: Parameter, unit: f64, h: f64) -> (f64, f64) {
    let value = |factor: f64| {
        let mut problem = problem(&text(factor));
        let density = random_density(&problem, 2);
        let forward = problem.analysis.forward(&density, &mut Silent).expect("converges");
        let value = forward.value;
        (problem, forward, value)
    };
    let (mut problem, base, _) = value(1.0);
    let gradients = problem.analysis.gradients(&base).expect("differentiable");
    let found = unit * gradients.parameters.iter().find(|(known, _)| *known == parameter).expect("there").1;
    let at = |shift: f64| value(1.0 + shift).2;
    (found, (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h))
}

/// The deflection of a strip of two layers, κ L²/2 with κ = 3/2 (α₂ − α₁) ΔT/h (Timoshenko, J. Opt. Soc. Am. 11
/// (1925) 233–255), is linear in the temperature and in the difference of the coefficients for small strains. In
/// the case, α₂ = 1.1 α₁ belongs to a region and follows α₁.
#[test]
fn the_deflection_of_a_bimetal_strip() {
    for (law, bound) in [("linear_elastic", 0.02), ("st_venant_kirchhoff", 0.1)] {
        let text = |[alpha, change]: [f64; 2]| {
            format!(
                "[[body]]\nname = 'strip'\norder = 2\nthermal_expansion = {:?}\n\
                 box = {{ min = [0, -0.5, 0], max = [20, 0.5, 0.5], elements = [20, 2, 1] }}\n\
                 material = {{ {law} = {{ youngs_modulus = 1000.0, poisson_ratio = 0.0 }} }}\n\
                 [[body.section]]\nregion = {{ min = [-1, -1, -1], max = [21, 0, 1] }}\nthermal_expansion = {:?}\n\
                 material = {{ {law} = {{ youngs_modulus = 1000.0, poisson_ratio = 0.0 }} }}\n\
                 [[dirichlet]]\nset = 'strip_xmin'\ncomponents = ['x']\n\
                 [[dirichlet]]\nset = 'strip_zmin'\ncomponents = ['z']\n\
                 [[set]]\nname = 'pivot'\nboxes = [{{ min = [-0.1, -0.01, -1], max = [0.1, 0.01, 1] }}]\n\
                 [[dirichlet]]\nset = 'pivot'\ncomponents = ['y']\n\
                 [[set]]\nname = 'end'\nboxes = [{{ min = [19.9, -0.01, -1], max = [20.1, 0.01, 1] }}]\n\
                 [[quantity]]\nname = 'q'\ndisplacement = {{ set = 'end', component = 'y' }}\n\
                 [objective]\nminimise = {{ quantity = 'q' }}\n\
                 [[temperature]]\nbody = 'strip'\nchange = {:?}\n\
                 [load_path]\nsteps = 2\ntolerance = {{ relative = 1e-12 }}\n",
                1e-4 * alpha,
                1.1e-4 * alpha,
                10.0 * change
            )
        };
        let expected = 1.5 * 1e-5 * 10.0 * 20.0 * 20.0 / 2.0;
        for (parameter, unit, of) in [
            (Parameter::Expansion { body: 0 }, 1e-4, [true, false]),
            (Parameter::Temperature { change: 0 }, 1.0, [false, true]),
        ] {
            let factors = |f: f64| of.map(|varied| if varied { f } else { 1.0 });
            let (found, difference) = compare(|f| text(factors(f)), parameter, unit, 1e-3);
            println!("{law}, {parameter:?}: {found:e}, {difference:e}; by hand {expected:e}");
            assert!((found / difference - 1.0).abs() < 1e-7, "{law}: {found} instead of {difference}");
            assert!((found / expected - 1.0).abs() < bound, "{law}: {found} instead of {expected}");
        }
    }
}

/// A warm shaft in a hub that is pulled out, with friction: the force follows the interference, which is
/// proportional to temperature and coefficient.
#[test]
fn the_pull_out_force_of_a_shrink_fit() {
    let text = |[alpha, change]: [f64; 2]| {
        format!(
            "[[body]]\nname = 'hub'\n\
             hollow_cylinder = {{ inner_radius = 10.0, outer_radius = 20.0, height = 4, elements = [2, 16, 2] }}\n\
             material = {{ neo_hooke = {{ youngs_modulus = 200000.0, poisson_ratio = 0.3 }} }}\n\
             [[body]]\nname = 'shaft'\nthermal_expansion = {:?}\n\
             hollow_cylinder = {{ inner_radius = 4.0, outer_radius = 10.0, height = 5, elements = [2, 16, 2] }}\n\
             material = {{ neo_hooke = {{ youngs_modulus = 200000.0, poisson_ratio = 0.3 }} }}\n\
             [[dirichlet]]\nset = 'hub_bottom'\n\
             [[dirichlet]]\nset = 'shaft_bottom'\n\
             motion = [{{ t = 0.5, u = [0, 0, 0] }}, {{ t = 1.0, u = [0, -0.02, 0] }}]\n\
             [[contact]]\nslave = 'hub_inner'\nmaster = 'shaft_outer'\nfriction = 0.2\n\
             [[quantity]]\nname = 'q'\nreaction = {{ set = 'shaft_bottom', component = 'y' }}\n\
             [objective]\nminimise = {{ quantity = 'q' }}\n\
             [[temperature]]\nbody = 'shaft'\nchange = {:?}\namplitude = [{{ t = 0.5, factor = 1.0 }}]\n\
             [load_path]\nsteps = 4\ntolerance = {{ relative = 1e-12 }}\n",
            1e-5 * alpha,
            100.0 * change
        )
    };
    for (parameter, unit, of) in [
        (Parameter::Expansion { body: 1 }, 1e-5, [true, false]),
        (Parameter::Temperature { change: 0 }, 1.0, [false, true]),
    ] {
        let factors = |f: f64| of.map(|varied| if varied { f } else { 1.0 });
        let (found, difference) = compare(|f| text(factors(f)), parameter, unit, 1e-4);
        println!("{parameter:?}: {found:e}, {difference:e}");
        assert!((found / difference - 1.0).abs() < 1e-6, "{parameter:?}: {found} instead of {difference}");
    }
}

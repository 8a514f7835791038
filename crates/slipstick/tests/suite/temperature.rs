//! Thermal expansion: free and constrained bodies, a bimetal strip, a shrink fit, energy, derivatives of whole
//! paths. Elements alone: `solid/tests/suite/heat.rs`.

use crate::common::scene::*;
use crate::common::*;
use crate::solved::{Scene as Case, Solved};
use slipstick::analysis::Forward;
use slipstick::build::Problem;
use slipstick::quantities::quantities;

/// A quantity at the end.
fn last(problem: &Problem, forward: &Forward, name: &str) -> f64 {
    let quantities = quantities(problem, &forward.path);
    *quantities.get(name).expect("a column").last().expect("a step")
}

/// A bar along x, 2 × 0.5 × 0.5, that may expand freely from its corner at the origin; α ΔT = 0.05.
fn bar(material: &str, more: &str) -> String {
    format!(
        "[[body]]\nname = 'bar'\nthermal_expansion = 1e-3\n\
         box = {{ min = [0, 0, 0], max = [2, 0.5, 0.5], elements = [3, 2, 1] }}\nmaterial = {{ {material} }}\n\
         [[dirichlet]]\nset = 'bar_xmin'\ncomponents = ['x']\n[[dirichlet]]\nset = 'bar_ymin'\ncomponents = ['y']\n\
         [[dirichlet]]\nset = 'bar_zmin'\ncomponents = ['z']\n{more}\
         [[temperature]]\nchange = 50\n[load_path]\nsteps = 2\ntolerance = {{ relative = 1e-13 }}\n"
    )
}

const ELASTIC: &str = "youngs_modulus = 1000.0, poisson_ratio = 0.3";

#[test]
fn a_free_bar_expands_without_stress() {
    for law in ["neo_hooke", "linear_elastic", "hencky"] {
        let text = bar(&format!("{law} = {{ {ELASTIC} }}"), "");
        check_free(&text);
        check_free(&text.replace("thermal_expansion", "order = 2\nthermal_expansion"));
    }
    let plastic = format!("j2_linear = {{ {ELASTIC}, yield_stress = 1.0, hardening_modulus = 10.0 }}");
    check_free(&bar(&plastic, "").replace("thermal_expansion", "element = 'f_bar'\nthermal_expansion"));
}

fn check_free(text: &str) {
    let solved = Case::from(text.to_owned()).solve();
    for (node, x) in solved.problem.mesh.nodes.iter().enumerate() {
        let d = solved.displacement(node as u32, 2);
        assert!((0..3).all(|c| (d[c] - 0.05 * x[c]).abs() < 1e-12), "{text}: {d:?} at {x:?}");
    }
    assert!(solved.reaction("bar_xmin", 2).norm() < 1e-9, "{text}");
    assert!(last(&solved.problem, &solved.forward, "strain_energy").abs() < 1e-12);
}

/// Held at both ends. For small strains, σ = −E α ΔT. With ν = 0 and the St. Venant-Kirchhoff law, F_e = 1/θ
/// along the bar and 1 across it, so that the force is that of the stress E (θ⁻² − 1)/2 θ over the area.
#[test]
fn a_bar_between_walls() {
    let wall = "[[dirichlet]]\nset = 'bar_xmax'\ncomponents = ['x']\n";
    let theta: f64 = 1.05;
    for (law, ratio, stress) in [
        ("linear_elastic", 0.3, -1000.0 * 0.05),
        ("st_venant_kirchhoff", 0.0, 0.5 * 1000.0 * (theta.powi(-2) - 1.0) * theta),
    ] {
        let text = bar(&format!("{law} = {{ youngs_modulus = 1000.0, poisson_ratio = {ratio:?} }}"), wall);
        let solved = Case::from(text).solve();
        let found = solved.reaction("bar_xmax", 2)[0] / 0.25;
        assert!((found / stress - 1.0).abs() < 1e-11, "{law}: {found} instead of {stress}");
    }
}

/// Two layers of equal thickness and modulus: κ = 3/2 (α₂ − α₁) ΔT/h (Timoshenko, J. Opt. Soc. Am. 11 (1925)
/// 233–255), here with ν = 0, at small rotations, and with geometric nonlinearity at rotations of 9°.
#[test]
fn a_bimetal_strip() {
    for (law, difference) in [("linear_elastic", 1e-6), ("st_venant_kirchhoff", 5e-4)] {
        let text = format!(
            "[[body]]\nname = 'strip'\norder = 2\nthermal_expansion = 1e-4\n\
             box = {{ min = [0, -0.5, 0], max = [20, 0.5, 0.5], elements = [20, 2, 1] }}\n\
             material = {{ {law} = {{ youngs_modulus = 1000.0, poisson_ratio = 0.0 }} }}\n\
             [[body.section]]\nregion = {{ min = [-1, -1, -1], max = [21, 0, 1] }}\nthermal_expansion = {:?}\n\
             material = {{ {law} = {{ youngs_modulus = 1000.0, poisson_ratio = 0.0 }} }}\n\
             [[dirichlet]]\nset = 'strip_xmin'\ncomponents = ['x']\n\
             [[dirichlet]]\nset = 'strip_zmin'\ncomponents = ['z']\n\
             [[set]]\nname = 'pivot'\nboxes = [{{ min = [-0.1, -0.01, -1], max = [0.1, 0.01, 1] }}]\n\
             [[dirichlet]]\nset = 'pivot'\ncomponents = ['y']\n\
             [[temperature]]\nbody = 'strip'\nchange = 10\n\
             [load_path]\nsteps = 4\ntolerance = {{ relative = 1e-10 }}\n",
            1e-4 + difference,
        );
        let solved = Case::from(text).solve();
        // the slope between two points of the middle line away from the ends
        let at = |x: f64| {
            let node =
                solved.problem.mesh.nodes.iter().position(|p| (p[0] - x).abs() < 1e-9 && p[1] == 0.0 && p[2] == 0.0);
            solved.position(node.expect("a node") as u32, solved.steps())
        };
        let slope = |x: f64| {
            let along = at(x + 0.5) - at(x - 0.5);
            along[1].atan2(along[0])
        };
        let stretched = (at(15.0) - at(14.0)).norm();
        let found = (slope(15.0) - slope(5.0)) / (10.0 * stretched);
        // the lower layer expands more: the strip bends upwards
        let expected = 1.5 * difference * 10.0;
        println!("{law}: {found:e} of {expected:e}");
        assert!((found / expected - 1.0).abs() < 0.01, "{law}: {found} instead of {expected}");
    }
}

/// A shaft that is 0.1 % larger when it is warm, in a hub: Lamé's pressure for plane stress, as of
/// `verification/press_fit.rs`.
#[test]
fn a_shrink_fit() {
    let text = "
[[body]]
name = 'hub'
hollow_cylinder = { inner_radius = 10.0, outer_radius = 20.0, height = 2.5, elements = [6, 64, 1] }
material = { neo_hooke = { youngs_modulus = 200000.0, poisson_ratio = 0.3 } }
[[body]]
name = 'shaft'
hollow_cylinder = { inner_radius = 4.0, outer_radius = 10.0, height = 2.5, elements = [5, 64, 1] }
material = { neo_hooke = { youngs_modulus = 200000.0, poisson_ratio = 0.3 } }
thermal_expansion = 1e-5
[[set]]
name = 'on_x'
plane = { point = [0, 0, 0], normal = [1, 0, 0] }
[[set]]
name = 'on_z'
plane = { point = [0, 0, 0], normal = [0, 0, 1] }
[[dirichlet]]
set = 'on_x'
components = ['x']
[[dirichlet]]
set = 'on_z'
components = ['z']
[[dirichlet]]
set = 'hub_bottom'
components = ['y']
[[dirichlet]]
set = 'shaft_bottom'
components = ['y']
[[contact]]
slave = 'hub_inner'
master = 'shaft_outer'
friction = 0.0
[[temperature]]
body = 'shaft'
change = 100.0
[load_path]
steps = 2
tolerance = { relative = 1e-10 }
";
    let mut solved = Case::from(text.to_owned()).solve();
    let (force, area) = solved.contact(2).into_iter().fold((0.0, 0.0), |(force, area), node| {
        (force + node.multiplier[0] * node.covered_area, area + node.covered_area)
    });
    let ratio = |outer: f64, inner: f64| (outer * outer + inner * inner) / (outer * outer - inner * inner);
    let expected = 1e-3 * 200_000.0 / (ratio(20.0, 10.0) + ratio(10.0, 4.0));
    println!("{} of {expected}", force / area);
    assert!((force / area / expected - 1.0).abs() < 0.01, "{} instead of {expected}", force / area);
}

/// The elastic energy of heated bodies is the work of temperatures and supports, so without motion and with
/// linear elasticity, it is ½ E (α ΔT)² V between walls.
#[test]
fn the_energy_of_a_bar_between_walls() {
    let wall = "[[dirichlet]]\nset = 'bar_xmax'\ncomponents = ['x']\n";
    let text = bar("linear_elastic = { youngs_modulus = 1000.0, poisson_ratio = 0.3 }", wall);
    let Solved { problem, forward } = Case::from(text).solve();
    let energy = last(&problem, &forward, "strain_energy");
    let expected = 0.5 * 1000.0 * 0.05f64.powi(2) * 0.5;
    assert!((energy / expected - 1.0).abs() < 1e-11, "{energy} instead of {expected}");
    let work = last(&problem, &forward, "thermal_work");
    assert!((work / expected - 1.0).abs() < 1e-11, "{work} instead of {expected}");
}

/// At finite strains, temperatures and motions together do the work that is stored, up to the error of the
/// trapezoidal rule, which falls by four with twice as many steps.
#[test]
fn thermal_work_is_stored() {
    let wall = "[[dirichlet]]\nset = 'bar_xmax'\ncomponents = ['x']\nmotion = [{ t = 1.0, u = [0.15, 0, 0] }]\n\
                [[temperature]]\nset = 'bar_ymin'\nchange = 90\n";
    let balance = |steps: usize| {
        let text = bar("neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 }", wall);
        let Solved { problem, forward } = Case::from(text.replace("steps = 2", &format!("steps = {steps}"))).solve();
        let [balance, energy, work] =
            ["energy_balance", "strain_energy", "thermal_work"].map(|name| last(&problem, &forward, name));
        assert!(work.abs() > 0.1 * energy, "{work} {energy}");
        balance.abs() / energy
    };
    let [coarse, fine] = [4, 8].map(balance);
    println!("{coarse:e} {fine:e}");
    assert!(coarse < 0.02 && (coarse / fine - 4.0).abs() < 0.4, "{coarse} {fine}");
}

/// A block that slides on a slab; the slab is heated and cooled, the block at one face.
const HEAT: &str = "
[[temperature]]
body = 'slab'
change = 40
amplitude = [{ t = 0.4, factor = 1.0 }, { t = 0.9, factor = -0.5 }]
[[temperature]]
set = 'block_xmin'
change = 30
";

/// Light elements whose bulk modulus falls faster than their shear modulus.
const VOID: &str =
    "void_poisson_ratio = -0.1\nbulk_p = 1.5\nenergy_interpolation = { threshold = 0.1, sharpness = 10 }";

#[test]
fn gradients_of_heated_bodies() {
    let plastic =
        "j2_linear = { youngs_modulus = 1000.0, poisson_ratio = 0.3, yield_stress = 20, hardening_modulus = 150 }";
    for (name, enforcement, design, objective) in [
        ("Lagrange", LAGRANGE.to_owned(), "", "contact_force = { steps = \"all\" }"),
        ("penalty", penalty(2e4), "", "contact_force = { steps = \"all\" }"),
        ("energy", LAGRANGE.to_owned(), "energy_interpolation = { threshold = 0.1, sharpness = 10 }", "energy"),
        ("stress", LAGRANGE.to_owned(), "energy_interpolation = { threshold = 0.1, sharpness = 10 }", "stress"),
        ("work", LAGRANGE.to_owned(), "", "work"),
        ("void", LAGRANGE.to_owned(), VOID, "energy"),
        ("void, stress", penalty(2e4), VOID, "stress"),
        ("plastic", LAGRANGE.to_owned(), "yield_p = 2.5", "energy"),
    ] {
        let kind = match objective {
            "energy" => "strain_energy = {}",
            "stress" => "stress = {}",
            _ => "external_work = {}",
        };
        let quantity = format!("[[quantity]]\nname = 'q'\n{kind}\n");
        let more = format!("{HEAT}{}", if objective.contains("force") { "" } else { &quantity });
        let scene = Scene { enforcement, observed: "\"all\"", more, design: design.into(), ..Scene::default() };
        let mut text = scene.text().replace("\nmaterial", "\nthermal_expansion = 1e-3\nmaterial");
        if !objective.contains("force") {
            text = text.replace("contact_force = { steps = \"all\" }", "minimise = { quantity = 'q' }");
        }
        if name == "plastic" {
            text = text.replace("neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 }", plastic);
        }
        let mut problem = problem(&text);
        let density = random_density(&problem, 5);
        let check = check_gradient(&mut problem, &density);
        println!("{name}: {:e}", check.error);
        assert!(check.error < if name == "plastic" { 1e-7 } else { 1e-8 }, "{name}: {}", check.error);
    }
}

/// The work of the loads does not measure stiffness where temperatures move the loads as well.
#[test]
fn the_compliance_of_heated_bodies_is_questioned() {
    let heated = |objective: &str, more: &str| {
        let load = "[[load]]\nsurface = 'bar_xmax'\npressure = 2.0\nload_case = 'pulled'\n\
                    [[load_case]]\nname = 'warm'\n[[load_case]]\nname = 'pulled'\n";
        let design = format!(
            "[design]\nbodies = ['bar']\nvolume_fraction = 0.5\n\
             [[quantity]]\nname = 'work'\ncompliance = {{}}\n[[quantity]]\nname = 'size'\nvolume = {{}}\n\
             [objective]\n{objective}\n[optimizer]\niterations = 2\n"
        );
        let text = bar(&format!("neo_hooke = {{ {ELASTIC} }}"), load) + &design;
        let case =
            slipstick::case::parse_case(&text.replace("change = 50", &format!("change = 50{more}")), "case.toml");
        let case = case.unwrap_or_else(|errors| panic!("{errors}")).case;
        let mut problem = slipstick::build::build(&case).unwrap_or_else(|error| panic!("{error}"));
        let notices = slipstick::check::inspect(&case, &mut problem).expect("the state at rest").notices;
        notices.iter().any(|notice| notice.kind == slipstick::check::NoticeKind::HeatedCompliance)
    };
    assert!(heated("compliance = { steps = 'last' }", ""));
    assert!(heated("minimise = { sum = [{ quantity = 'size' }, { quantity = 'work', weight = 2.0 }] }", ""));
    assert!(heated("compliance = { steps = 'last' }", "\nload_case = 'pulled'"));
    assert!(!heated("compliance = { steps = 'last' }", "\nload_case = 'warm'"));
    assert!(!heated("minimise = { quantity = 'size' }", ""));
}

/// Displacements at the end of a clamped bar in CalculiX 2.20 (`*NODE PRINT`), for the same decks: heated as a
/// whole, and along its upper face, from 20 to 120. In CalculiX, too, a linear element has the mean temperature of
/// its nodes. With `NLGEOM`, its thermal strain differs by terms of order (α ΔT)².
#[test]
fn another_program_agrees_on_heated_decks() {
    let (all, up) = ("NALL, 120.", "UP, 120.");
    for (step, alpha, heated, bound, expected) in [
        ("*STEP", "1e-5", all, 1e-6, [[3.186716e-3, 0.0, 0.0], [3.186709e-3, 5.000015e-4, 5.000015e-4]]),
        ("*STEP", "1e-5", up, 1e-6, [[7.966789e-4, -3.322774e-3, 0.0], [1.835397e-3, -3.116536e-3, 2.875004e-4]]),
        (
            "*STEP, NLGEOM",
            "1e-5",
            up,
            1e-3,
            [[7.942805e-4, -3.322647e-3, 0.0], [1.833110e-3, -3.117486e-3, 2.874878e-4]],
        ),
    ] {
        let upper: Vec<String> = (0..3).flat_map(|k| (15 + 21 * k..22 + 21 * k).map(|n| n.to_string())).collect();
        let upper: Vec<String> = upper.chunks(7).map(|row| row.join(", ")).collect();
        let step = format!(
            "*NSET, NSET=UP\n{}\n*INITIAL CONDITIONS, TYPE=TEMPERATURE\nNALL, 20.\n{step}\n*STATIC\n0.5, 1.\n\
             *TEMPERATURE\n{heated}",
            upper.join("\n")
        );
        let deck = crate::body_forces::bar_deck(&format!("*EXPANSION, ZERO=7.\n{alpha}"), &step);
        let text = "deck = { file = 'bar.inp' }\n".to_owned();
        let solved = Case { text, files: [("bar.inp".to_owned(), deck)].into() }.solve();
        for (end, expected) in [[3.0, 0.5, 0.5], [3.0, 1.0, 1.0]].into_iter().zip(expected) {
            let node = solved.problem.mesh.nodes.iter().position(|x| *x == end).expect("a node");
            let found = solved.displacement(node as u32, solved.steps());
            let expected = nalgebra::Vector3::from(expected);
            let deviation = (found - expected).norm() / expected.norm();
            println!("{heated}: {found:?}, {deviation:e}");
            assert!(deviation < bound, "{heated}: {found:?} instead of {expected:?}");
        }
    }
}

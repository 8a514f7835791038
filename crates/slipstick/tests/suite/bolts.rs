//! Bolts: the joint diagram of VDI 2230 with preload, service load, loss of preload and slip, gradients, and input
//! that cannot be right.

use crate::common::scene::{LAGRANGE, Scene, augmented, penalty};
use crate::common::*;
use crate::quantity_gradients::check;
use slipstick::analysis::Forward;
use slipstick::build::{Problem, build};
use slipstick::case::parse_case;
use slipstick::model::Parameter;
use slipstick::quantities::quantities;

/// A hollow screw in a sleeve, both under a rigid cap: with Poisson's ratio 0, two bars of equal length and modulus,
/// with areas in the ratio of r₂² − r₁². `more` has supports and loads of the cap.
fn joint(preload: f64, keeps: &str, friction: f64, more: &str) -> String {
    let tube = |name: &str, inner: f64, outer: f64| {
        format!(
            "[[body]]\nname = '{name}'\nhollow_cylinder = {{ inner_radius = {inner:?}, outer_radius = {outer:?}, \
             height = 20, elements = [1, 12, 4] }}\n\
             material = {{ linear_elastic = {{ youngs_modulus = 210000, poisson_ratio = 0 }} }}\n"
        )
    };
    format!(
        "{}{}[[body]]\nname = 'cap'\nhollow_cylinder = {{ inner_radius = 1, outer_radius = 8, height = 2, \
         elements = [2, 12, 1] }}\nrigid = {{}}\nplace = {{ translate = [0, 20, 0] }}\n\
         [[contact]]\nslave = 'screw_top'\nmaster = 'cap_bottom'\ntied = true\n\
         [[contact]]\nslave = 'sleeve_top'\nmaster = 'cap_bottom'\nfriction = {friction:?}\n\
         [[bolt]]\nname = 'M6'\nbody = 'screw'\nsection = {{ point = [0, 10.5, 0], normal = [0, 2, 0] }}\n\
         force = [{{ t = 0.5, force = {preload:?} }}]\nkeeps = '{keeps}'\n\
         [[dirichlet]]\nset = 'screw_bottom'\n[[dirichlet]]\nset = 'sleeve_bottom'\n{more}\
         [[quantity]]\nname = 'tension'\nbolt_force = {{ bolt = 'M6' }}\n\
         [[quantity]]\nname = 'clamp'\ncontact_force = {{ slave = 'sleeve_top', component = 'normal' }}\n\
         [[quantity]]\nname = 'overlap'\ndisplacement = {{ set = 'M6', component = 'x' }}\n\
         [load_path]\nsteps = 8\n",
        tube("screw", 1.0, 3.0),
        tube("sleeve", 4.0, 8.0)
    )
}

/// The cap moves along the bolt, and a service load pulls it in the second half of the path.
fn pulled(service: f64) -> String {
    format!(
        "[[dirichlet]]\nset = 'cap'\ncomponents = ['x', 'z', 'rx', 'ry', 'rz']\n[[load]]\nsurface = 'cap'\n\
         force = [0, {service:?}, 0]\namplitude = [{{ t = 0.5, factor = 0 }}, {{ t = 1, factor = 1 }}]\n"
    )
}

fn solved(text: &str) -> (Problem, Forward) {
    let mut problem = problem(text);
    let density = problem.initial_density().clone();
    let forward = forward(&mut problem, &density);
    (problem, forward)
}

fn near(value: f64, expected: f64, bound: f64) {
    assert!((value - expected).abs() <= bound * expected.abs().max(1.0), "{value} instead of {expected}");
}

/// The joint diagram: with the load factor Φ = k_b/(k_b + k_p) = 8/56, a service load F_A raises the force of the
/// bolt to F_V + Φ F_A and lowers the clamping force to F_V − (1 − Φ) F_A; once the joint is open, the bolt carries
/// F_A alone. If the force is kept instead, it stays F_V until then. (VDI 2230 part 1, section 5.1.)
#[test]
fn the_joint_diagram() {
    let phi = 8.0 / 56.0;
    let (preload, service) = (1000.0, 1400.0);
    for (keeps, phi) in [("length", phi), ("force", 0.0)] {
        // while the force is kept, nothing holds an open joint
        let service = if keeps == "length" { service } else { 0.6 * service };
        let (problem, forward) = solved(&joint(preload, keeps, 0.0, &pulled(service)));
        let found = quantities(&problem, &forward.path);
        let column = |name: &str| found.get(name).expect(name);
        for step in 1..=8 {
            let t = step as f64 / 8.0;
            let (tightened, pulled) = ((2.0 * t).min(1.0) * preload, (2.0 * t - 1.0).max(0.0) * service);
            let tension = (tightened + phi * pulled).max(pulled);
            near(column("tension")[step], tension, 1e-6);
            near(column("bolt_force_M6")[step], tension, 1e-6);
            near((column("clamp")[step] - (tension - pulled)) / preload, 0.0, 1e-6);
            near(column("reaction_screw_bottom_y")[step], -tension, 1e-6);
        }
        // both parts are as long as before; the screw has been stretched and the sleeve compressed
        let area = |inner: f64, outer: f64| 12.0 * 0.5 * (outer * outer - inner * inner) * 30_f64.to_radians().sin();
        let overlap = preload * 20.0 / 210e3 * (1.0 / area(1.0, 3.0) + 1.0 / area(4.0, 8.0));
        near(column("overlap")[4], overlap, 1e-9);
        near(column("overlap_M6")[4], overlap, 1e-9);
        if keeps == "length" {
            assert!((column("overlap")[8] / overlap - 1.0).abs() < 1e-6, "{} {overlap}", column("overlap")[8]);
        }
        // up to there, all forces are linear in the displacements: the rule for work is exact
        near(column("external_work")[7], column("strain_energy")[7], 1e-6);
    }
}

/// A stiff screw in a sleeve that is ten thousand times softer is shortened much more than it is stretched, and the
/// round-off of its kept length is a larger force than Newton's tolerance. The step ends there nevertheless, and the
/// joint diagram holds to a millionth of the preload.
#[test]
fn a_stiff_bolt_in_a_soft_joint_converges() {
    let (preload, service) = (100.0, 50.0);
    let [screw, sleeve] = ["name = 'screw'", "name = 'sleeve'"];
    let text = joint(preload, "length", 0.0, &pulled(service));
    let (before, after) = text.split_once(sleeve).expect("the sleeve");
    assert!(before.contains(screw));
    let text = format!("{before}{sleeve}{}", after.replacen("210000", "21", 1));
    let (problem, forward) = solved(&text);
    let phi = 8.0 / (8.0 + 48.0 * 1e-4);
    let found = quantities(&problem, &forward.path);
    let tension = *found.get("tension").expect("the tension").last().expect("a row");
    near(tension / (preload + phi * service), 1.0, 1e-6);
}

/// A preloaded joint slips once the lateral force exceeds μ F_K: beyond that, only the bending screw resists.
#[test]
fn a_joint_slips_at_the_friction_of_its_clamping_force() {
    let lateral = "[[dirichlet]]\nset = 'cap'\ncomponents = ['x', 'z', 'rx', 'ry', 'rz']\n\
                   motion = [{ t = 0.5, u = [0, 0, 0] }, { t = 1, u = [0.02, 0, 0] }]\n";
    let (problem, forward) = solved(&joint(1000.0, "length", 0.15, lateral));
    let found = quantities(&problem, &forward.path);
    let last = |name: &str| *found.get(name).expect(name).last().unwrap();
    assert!(last("sleeve_top_slip") > 0.0 && last("sleeve_top_stick") == 0.0);
    near(last("sleeve_top_friction_force"), 0.15 * last("clamp"), 1e-6);
    near(last("reaction_sleeve_bottom_x"), -0.15 * last("clamp"), 0.02);
}

/// A slab that a bolt stretches between its support and springs, while a block is pressed onto it and dragged.
pub fn stretched(scene: Scene, waypoints: &str, keeps: &str) -> String {
    let more = format!(
        "[[spring]]\nname = 'end'\nset = 'slab_xmax'\nstiffness_per_area = 400\n\
         [[spring]]\nname = 'foot'\nset = 'slab_ymin'\nstiffness_per_area = 900\ndirection = [0, 1, 0]\n\
         [[bolt]]\nname = 'tie'\nbody = 'slab'\nsection = {{ point = [2.7, 0.5, 0.5], normal = [3, 0.3, 0.2] }}\n\
         force = {waypoints}\nkeeps = '{keeps}'\n"
    );
    let text = Scene { more, ..scene }.text();
    text.replace("[\"slab\", \"block\"]", "[\"block\"]").replace("\"slab_ymin\"", "\"slab_xmin\"")
}

/// All quantities of a stretched slab, by differences, with a bolt that keeps its length or its force.
#[test]
fn quantities_with_bolts_match_finite_differences() {
    for enforcement in [LAGRANGE.to_owned(), penalty(4e3), augmented(4e3, 1e-12)] {
        for keeps in ["length", "force"] {
            let scene = Scene {
                slab: [3, 2, 1],
                friction: 0.35,
                motion: "[{ t = 0.4, u = [0, -0.1, 0] }, { t = 1.0, u = [0.1, -0.12, 0.03] }]".into(),
                steps: 5,
                enforcement: enforcement.clone(),
                ..Scene::default()
            };
            let mut problem = problem(&stretched(scene, "[{ t = 0.2, force = 15 }, { t = 0.6, force = 25 }]", keeps));
            check("bolts", &mut problem, 3, &[1.0]);
        }
    }
}

/// The derivative of the force of a bolt with respect to the force to which it was tightened: 1 with a closed joint,
/// by the joint diagram, and 0 once it is open. With respect to the service load: Φ, and 1.
#[test]
fn the_force_of_a_bolt_depends_on_its_preload() {
    for (service, by_preload, by_service) in [(700.0, 1.0, 8.0 / 56.0), (1400.0, 0.0, 1.0)] {
        let design =
            "[design]\nbodies = ['sleeve']\nvolume_fraction = 1\n[objective]\nmaximise = { quantity = 'tension' }\n";
        let text = joint(1000.0, "length", 0.0, &pulled(service)) + design;
        let (problem, forward) = solved(&text);
        let mut problem = problem;
        let gradients = problem.analysis.gradients(&forward).expect("differentiable");
        let by = |parameter: Parameter| {
            let found = gradients.parameters.iter().find(|(known, _)| *known == parameter);
            -found.expect("a parameter").1
        };
        near(by(Parameter::Preload { bolt: 0 }) / 1000.0, by_preload, 1e-6);
        near(by(Parameter::Load { load: 0 }) / 1000.0, service / 1000.0 * by_service, 1e-6);
    }
}

#[test]
fn wrong_bolts_are_refused() {
    let text = joint(1000.0, "length", 0.0, &pulled(100.0));
    let built = |text: &str| build(&parse_case(text, "case.toml").unwrap().case).err().map(|error| error.to_string());
    assert!(built(&text).is_none());
    let error = built(&text.replace("point = [0, 10.5, 0]", "point = [0, 30, 0]")).expect("no section");
    assert!(error.contains("does not divide `screw`"), "{error}");
    let error = built(&text.replace("normal = [0, 2, 0] }", "normal = [0, 2, 0], radius = 2 }")).expect("too small");
    assert!(error.contains("beyond `radius`"), "{error}");
    let across = "screw_outer'\nmaster = 'sleeve_inner'\nfriction = 0\n[[contact]]\nslave = 'sleeve_top";
    let error = built(&text.replacen("slave = 'sleeve_top", &format!("slave = '{across}"), 1)).expect("across a pair");
    assert!(error.contains("meets the slave surface `screw_outer`"), "{error}");
    let held = "[[dirichlet]]\nset = 'screw_inner'\ncomponents = ['y']\n";
    let error = built(&(text.clone() + held)).expect("held");
    assert!(error.contains("hold both sides"), "{error}");
    let designed = text.clone() + "[design]\nbodies = ['screw']\nvolume_fraction = 1\n";
    let error = built(&designed).expect("designed");
    assert!(error.contains("`screw` is designed"), "{error}");
    let read = |text: &str| parse_case(text, "case.toml").err().map(|error| format!("{error:?}")).unwrap_or_default();
    for (from, to, expected) in [
        ("body = 'screw'", "body = 'cap'", "`cap` is rigid"),
        ("body = 'screw'", "body = 'screws'", "there is no body called `screws`"),
        ("force = 1000.0", "force = -1000.0", "must not be negative"),
        ("force = 1000.0", "force = 0", "the bolt has no force"),
        ("bolt = 'M6'", "bolt = 'M8'", "there is no bolt called `M8`"),
        ("normal = [0, 2, 0]", "normal = [0, 0, 0]", "zero vector"),
    ] {
        let found = read(&text.replace(from, to));
        assert!(found.contains(expected), "{expected}: {found}");
    }
}

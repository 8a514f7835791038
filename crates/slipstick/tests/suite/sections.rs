//! Bodies of several materials: forces by hand, gradients against differences, and errors.

use crate::common::abaqus::abaqus;
use crate::common::scene::Scene;
use crate::common::{forward, problem, random_density};
use crate::quantity_gradients::check;
use slipstick::build::build;
use slipstick::case::{parse_case, parse_case_with};
use slipstick::check::inspect;
use slipstick::model::Parameter;
use slipstick::quantities::quantities;
use slipstick_mesh::{BoxShape, box_mesh};

/// A bar of length 4 and section 1 × 1 in tension, with a region from x = 2 on.
fn bar(shape: &str, region: &str) -> String {
    format!(
        r#"
[[body]]
name = "bar"
{shape}
material = {{ linear_elastic = {{ youngs_modulus = 1000, poisson_ratio = 0 }} }}
[[body.section]]
region = {{ {region} }}
material = {{ linear_elastic = {{ youngs_modulus = 250, poisson_ratio = 0 }} }}
[[dirichlet]]
set = "bar_xmin"
[[dirichlet]]
set = "bar_xmax"
motion = [{{ t = 1.0, u = [0.01, 0, 0] }}]
[load_path]
steps = 1
[[quantity]]
name = "pull"
reaction = {{ set = "bar_xmax", component = "x" }}
[objective]
maximise = {{ quantity = "pull" }}
[design]
bodies = ["bar"]
initial = 1.0
simp = {{ p = 3, min = 1e-3 }}
"#
    )
}

const BOX: &str = "box = { min = [0, 0, 0], max = [4, 1, 1], elements = [8, 2, 2] }";

/// Two materials in series: F = u/(2/1000 + 2/250) = 1 for u = 0.01, whichever kind of region is given and
/// whatever the elements. F is proportional to both moduli together.
#[test]
fn two_materials_in_series() {
    let regions = [
        "min = [2, 0, 0], max = [4, 1, 1]",
        "start = [2, 0.5, 0.5], end = [4, 0.5, 0.5], radius = 1",
        "axis = [0, 0, 1], through = [3, 0.5, 0], radius = 1.2",
        "centre = [3, 0.5, 0.5], radius = 1.2",
    ];
    for (region, shape) in
        regions.into_iter().flat_map(|region| [(region, BOX.to_owned()), (region, format!("{BOX}\norder = 2"))])
    {
        let mut problem = problem(&bar(&shape, region));
        let density = problem.initial_density().clone();
        let run = forward(&mut problem, &density);
        let force = *quantities(&problem, &run.path).get("pull").expect("a quantity").last().expect("a step");
        assert!((force - 1.0).abs() < 1e-12, "{region}: {force}");
        let gradient = problem.analysis.response_gradients(&run, true).expect("a gradient").remove(0);
        let of = |name: Parameter| gradient.parameters.iter().find(|(other, _)| *other == name).expect("a parameter").1;
        let by_modulus = of(Parameter::YoungsModulus { body: 0 });
        // the objective is minimized
        assert!((by_modulus + 1.0 / 1000.0).abs() < 1e-12, "{region}: {by_modulus}");
    }
}

/// A set of elements of a mesh file is a region; tetrahedra of both materials are in the same batches.
#[test]
fn a_set_of_a_mesh_file_is_a_region() {
    let shape = BoxShape { min: [0.0; 3], max: [4.0, 1.0, 1.0], elements: [8, 2, 2], grading: [1.0; 3] };
    let mesh = box_mesh("bar", &shape).expect("a mesh").divided(|_| true);
    let far =
        (1..).zip(mesh.centroids()).filter(|(_, x)| x[0] > 2.0).map(|(number, _): (usize, _)| format!("{number}\n"));
    let deck = abaqus(&mesh) + "*ELSET, ELSET=far\n" + &far.collect::<String>();
    let text = bar("mesh = { file = 'bar' }", "part = 'bar_far'");
    let read = |_: &str| Ok(deck.clone().into_bytes());
    let case = parse_case_with(&text, "bar.toml", &read).unwrap_or_else(|error| panic!("{error}")).case;
    let mut problem = build(&case).unwrap_or_else(|error| panic!("{error}"));
    let density = problem.initial_density().clone();
    let run = forward(&mut problem, &density);
    let force = *quantities(&problem, &run.path).get("pull").expect("a quantity").last().expect("a step");
    assert!((force - 1.0).abs() < 1e-12, "{force}");
    let misspelt = parse_case_with(&text.replace("part = 'bar_far'", "part = 'bar_fra'"), "bar.toml", &read);
    let error = misspelt.expect_err("no such set").to_string();
    assert!(
        error.contains("no set of elements called `bar_fra`") && error.contains("did you mean `bar_far`?"),
        "{error}"
    );
    // sets of a mesh belong to one body
    let other = "[[body]]\nname = \"other\"\nmesh = { file = \"bar\" }\nmaterial = { linear_elastic = { youngs_modulus = \
                 1000, poisson_ratio = 0 } }\n[[body.section]]\nregion = { part = \"bar_far\" }\nmaterial = { linear_elastic = \
                 { youngs_modulus = 250, poisson_ratio = 0 } }\n[[dirichlet]]";
    let case = parse_case_with(&text.replacen("[[dirichlet]]", other, 1), "bar.toml", &read).expect("a case").case;
    let error = build(&case).err().expect("of another body").to_string();
    let expected = "no element of `bar_far` belongs to `other`; sets of its own mesh: other_body, other_far";
    assert!(error.contains(expected), "{error}");
}

/// Contact on a slab of three materials, one of them plastic: every quantity by random directions in the
/// design, and the objective by the modulus of the slab, which scales all of its sections.
#[test]
fn gradients_of_several_materials() {
    let text = |factor: f64| {
        let scene = Scene { slab: [4, 2, 2], steps: 5, friction: 0.3, ..Scene::default() }.text();
        let body = "material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }\n";
        let moduli = [1000.0, 1500.0, 600.0].map(|modulus| modulus * factor);
        let slab = format!(
            "material = {{ neo_hooke = {{ youngs_modulus = {:?}, poisson_ratio = 0.3 }} }}\n\
             section = [\n\
             {{ region = {{ min = [0, 0, 0], max = [4, 0.5, 1] }}, material = {{ st_venant_kirchhoff = {{ youngs_modulus = {:?}, \
             poisson_ratio = 0.2 }} }} }},\n\
             {{ region = {{ centre = [1, 1, 0.5], radius = 0.8 }}, material = {{ j2_linear = {{ youngs_modulus = {:?}, \
             poisson_ratio = 0.3, yield_stress = 15, hardening_modulus = 100 }} }} }}]\n",
            moduli[0], moduli[1], moduli[2]
        );
        assert!(scene.contains(body));
        scene.replacen(body, &slab, 1)
    };
    check("several materials", &mut problem(&text(1.0)), 3, &[1.0]);
    let mut base = problem(&text(1.0));
    let density = random_density(&base, 3);
    let run = forward(&mut base, &density);
    let solid = run.path.states.last().expect("a state").state.history.len();
    assert!(solid > 0, "an element is plastic");
    let gradient = base.analysis.response_gradients(&run, true).expect("a gradient").remove(0);
    let name = Parameter::YoungsModulus { body: 0 };
    let found = gradient.parameters.iter().find(|(other, _)| *other == name).expect("a parameter").1;
    let h = 1e-5;
    let at = |steps: f64| forward(&mut problem(&text(1.0 + steps * h)), &density).value;
    let expected = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * h * 1000.0);
    assert!((found - expected).abs() < 1e-7 * expected.abs(), "{found} instead of {expected}");
}

/// A region without elements, and regions that bodies cannot have.
#[test]
fn impossible_sections_are_refused() {
    let case = parse_case(&bar(BOX, "centre = [9, 0, 0], radius = 1"), "bar.toml").expect("can be read").case;
    let error = build(&case).err().expect("no element").to_string();
    assert!(error.contains("no element of `bar` has its centroid in this region"), "{error}");
    for (region, expected) in [
        ("surface = 'bar_xmax', within = 1", "give one of: min, start, axis, centre, part"),
        ("part = 'bar_far'", "bar_far"),
    ] {
        let error = parse_case(&bar(BOX, region), "bar.toml").expect_err("no such region").to_string();
        assert!(error.contains(expected), "{error}");
    }
    let rigid = bar(BOX, "centre = [3, 0.5, 0.5], radius = 1").replacen("material = ", "rigid = {}\n# ", 1);
    let error = parse_case(&rigid, "bar.toml").expect_err("a rigid body").to_string();
    assert!(error.contains("`section` has no meaning for a rigid body"), "{error}");
}

/// Regions are listed with what they hold, the rest of the body first; where they overlap, the last one
/// counts. The bar has 32 elements with a volume of 1/8.
#[test]
fn sections_are_listed() {
    let further = r#"[[body.section]]
region = { min = [3, 0, 0], max = [4, 1, 1] }
material = { linear_elastic = { youngs_modulus = 50, poisson_ratio = 0 } }
[[dirichlet]]"#;
    let text = bar(BOX, "start = [2, 0.5, 0.5], end = [4, 0.5, 0.5], radius = 1").replacen("[[dirichlet]]", further, 1);
    let case = parse_case(&text, "case.toml").expect("a case").case;
    let listed = inspect(&case, &mut build(&case).expect("a problem")).expect("inspected").sections;
    let rows: Vec<_> = listed.iter().map(|of| (of.region.as_str(), of.elements)).collect();
    let expected = [
        ("elsewhere", 16),
        ("cylinder from [2, 0.5, 0.5] to [4, 0.5, 0.5], radius 1", 8),
        ("box from [3, 0, 0] to [4, 1, 1]", 8),
    ];
    assert_eq!(rows, expected);
    for (of, volume) in listed.iter().zip([2.0, 1.0, 1.0]) {
        assert!((of.volume - volume).abs() < 1e-14, "{of:?}");
    }
    let materials: Vec<_> = listed.iter().map(|of| of.material.as_str()).collect();
    for (material, modulus) in materials.iter().zip(["1000.0", "250.0", "50.0"]) {
        assert!(material.contains(&format!("youngs_modulus = {modulus}")), "{materials:?}");
    }
}

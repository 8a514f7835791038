//! The pull-back of a design's steps into every input, compared with central differences at converged
//! states: all enforcement methods, plastic bodies, rigid bodies, rotations, viscous forces, springs, supports
//! that begin and end, bolts, loads and temperatures.

use crate::bolts::stretched;
use crate::common::scene::*;
use crate::common::*;
use rayon::prelude::*;
use slipstick::design::ElementValues;
use slipstick::model::{Design, Parameter, Workspace};
use slipstick_path::differences::Comparison;
use slipstick_path::{Inputs, Span, StepProblem};
use std::collections::BTreeMap;

/// Relative to the largest derivative with respect to an input.
const BOUND: f64 = 1e-8;
/// Round-off of a difference of forces of order 1 to 100.
const ROUND_OFF: f64 = 1e-6;

/// What is compared: a case's text, with its parameters in braces.
struct Kind {
    name: String,
    text: String,
    /// Whether contact statuses of all kinds occur.
    varied: bool,
}

/// A case with names in place of its coefficient of friction, moduli and amplitudes: all motions and loads
/// are multiples of `amplitude` and `load`.
fn scene(name: &str, enforcement: &str, shape: &'static str) -> (String, Scene) {
    let scene = Scene {
        slab: [3, 1, 1],
        block: [2, 1, 2],
        enforcement: enforcement.into(),
        shape,
        motion: "[{ t = 0.4, u = [0, -0.1, 0] }, { t = 1.0, u = [0.15, -0.12, 0.04] }]".into(),
        steps: 5,
        ..Scene::default()
    };
    (name.into(), scene)
}

fn kinds() -> Vec<Kind> {
    let weighted = "{ penalty = { stiffness = { normal = 3e4, tangential = 4e3 }, scaling = \"weighted\" } }";
    let exponential = "{ penalty = { stiffness = 4e3, pressure_at = \"points\", \
                       pressure = { exponential = { contact_pressure = 20, clearance = 0.03 } } } }";
    let methods = [
        ("Lagrange", LAGRANGE.to_string()),
        ("penalty", penalty(4e3)),
        ("penalty weighted", weighted.into()),
        ("penalty relative", "{ penalty = {} }".into()),
        ("augmented", augmented(4e3, 1e-12)),
        ("penalty at points", "{ penalty = { stiffness = 4e3, pressure_at = \"points\" } }".into()),
        ("penalty at points, relative", "{ penalty = { pressure_at = \"points\" } }".into()),
        ("penalty at points, exponential", exponential.into()),
    ];
    let mut scenes = Vec::new();
    for (name, enforcement) in &methods {
        scenes.extend(["standard", "dual"].map(|shape| scene(&format!("{name}, {shape}"), enforcement, shape)));
    }
    for (name, enforcement) in [&methods[0], &methods[1]] {
        let (_, base) = scene("", enforcement, "standard");
        let tolerance = "tolerance = { relative = 1e-12 }";
        scenes.push((
            format!("{name}, turned, viscous"),
            Scene {
                drive: "rotation = { point = [1.0, 0, 0.5], direction = [0, 1, 0] }".into(),
                motion: base.motion.replace("0.04] }", "0.04], angle = 6 }"),
                load_path: format!("{tolerance}\nviscosity = 40"),
                ..base.clone()
            },
        ));
        scenes.push((
            format!("{name}, loaded"),
            Scene { more: "[[load]]\nsurface = \"slab_xmax\"\npressure = 20\n".into(), ..base.clone() },
        ));
        let springs = "[[spring]]\nname = 'foot'\nset = 'slab_xmax'\nstiffness_per_area = 80\n\
                       [[spring]]\nname = 'rope'\nset = 'block_xmax'\nto = 'slab_xmax'\ndirection = 'line'\n\
                       stiffness = 50\n";
        let turned = Scene {
            drive: "rotation = { point = [1.0, 0, 0.5], direction = [0, 1, 0] }".into(),
            motion: base.motion.replace("0.04] }", "0.04], angle = 6 }"),
            ..base.clone()
        };
        scenes.push((format!("{name}, turned"), turned));
        scenes.push((format!("{name}, springs"), Scene { more: springs.into(), ..base.clone() }));
        let side = "[[set]]\nname = 'front'\nwithin = 'slab_zmax'\nboxes = [{ min = [0, 0.5, 0], max = [9, 1, 9] }]\n\
                    [[dirichlet]]\nset = 'front'\ncomponents = ['z']\nfrom = 0.4\n";
        let begins = format!("{side}motion = [{{ t = 0.8, u = [0, 0, 0.03] }}, {{ t = 1.0, u = [0, 0, 0.05] }}]\n");
        scenes.push((format!("{name}, begins"), Scene { more: begins, ..base.clone() }));
        scenes.push((format!("{name}, ends"), Scene { more: format!("{side}until = 0.8\n"), ..base }));
    }
    // at the last states of the scene above, mesh lines of second-order elements nearly coincide
    let (_, mut base) = scene("", &methods[7].1, "standard");
    base.motion = base.motion.replace("u = [0.15, -0.12, 0.04]", "u = [0.163, -0.12, 0.047]");
    let text = base.text().replace("[[body]]", "[[body]]\norder = 2");
    let second_order = Kind { name: "penalty at points, second order".into(), text, varied: false };
    let mass = "\nmass_density = 2.0\nmaterial = { neo_hooke";
    let fields = "[[load]]\ncentrifugal = { point = [-3, 2, 1], direction = [1, 2, -2], angular_velocity = 2 }\n";
    // with a pressure at the points, all nodes slide at the end of this scene
    let varied = |name: &str| !name.contains("at points");
    let mut kinds: Vec<Kind> = scenes
        .iter()
        .map(|(name, scene)| Kind { name: name.clone(), text: scene.text(), varied: varied(name) })
        .collect();
    kinds.push(second_order);
    for (name, enforcement) in [&methods[0], &methods[1], &methods[4]] {
        let (_, base) = scene("", enforcement, "standard");
        let text = Scene { design: "yield_p = 2.5".into(), ..base }.text();
        let elastic = "neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 }";
        let plastic =
            "j2_linear = { youngs_modulus = 1000.0, poisson_ratio = 0.3, yield_stress = 20, hardening_modulus = 150 }";
        kinds.push(Kind { name: format!("{name}, plastic"), text: text.replace(elastic, plastic), varied: false });
    }
    for (name, enforcement) in [&methods[0], &methods[1]] {
        let (_, base) = scene("", enforcement, "standard");
        let text = Scene { design: "mass_p = 1.5".into(), more: fields.into(), ..base }.text();
        let text = text.replace("\nmaterial = { neo_hooke", mass);
        kinds.push(Kind { name: format!("{name}, rotating"), text, varied: false });
    }
    for (name, enforcement) in [&methods[0], &methods[1]] {
        let (_, base) = scene("", enforcement, "standard");
        let design =
            "void_poisson_ratio = -0.1\nbulk_p = 1.5\nenergy_interpolation = { threshold = 0.2, sharpness = 3 }";
        let text = Scene { design: design.into(), ..base }.text();
        kinds.push(Kind { name: format!("{name}, compressible void"), text, varied: false });
    }
    let (_, base) = scene("", LAGRANGE, "standard");
    let text = base.text();
    let (before, after) = text.rsplit_once("material = { neo_hooke").expect("the block's material");
    let (_, after) = after.split_once('\n').expect("a line");
    let rigid = format!("{before}rigid = {{ reference = [1.0, 1.5, 0.4] }}\n{after}")
        .replace("block_ymax", "block")
        .replace("[\"slab\", \"block\"]", "[\"slab\"]");
    let rigid = rigid.replace("block_ymin", "SLAVE").replace("slab_ymax", "block_ymin").replace("SLAVE", "slab_ymax");
    kinds.push(Kind { name: "rigid".into(), text: rigid, varied: false });
    for (name, enforcement) in [&methods[0], &methods[1], &methods[4]] {
        let (_, base) = scene("", enforcement, "standard");
        let text = stretched(base, "[{ t = 0.4, force = 9 }, { t = 0.8, force = 12 }]", "length");
        kinds.push(Kind { name: format!("{name}, bolt"), text, varied: false });
    }
    let elastic = "neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 }";
    for (name, law, other) in [
        ("", elastic, ""),
        ("penalty, ", elastic, "energy_interpolation = { threshold = 0.2, sharpness = 3 }"),
        ("small strains, ", "linear_elastic = { youngs_modulus = 1000.0, poisson_ratio = 0.3 }", ""),
        (
            "plastic, ",
            "j2_linear = { youngs_modulus = 1000.0, poisson_ratio = 0.3, yield_stress = 20, hardening_modulus = 150 }",
            "yield_p = 2.5",
        ),
        (
            "plastic, interpolated, ",
            "j2_linear = { youngs_modulus = 1000.0, poisson_ratio = 0.3, yield_stress = 20, hardening_modulus = 150 }",
            "energy_interpolation = { threshold = 0.2, sharpness = 3 }",
        ),
    ] {
        let (_, base) = scene("", if name.starts_with("penalty") { &methods[1].1 } else { LAGRANGE }, "standard");
        let heat = "[[temperature]]\nbody = 'slab'\nchange = 0.05\namplitude = [{ t = 0.4, factor = 1 }]\n\
                    [[temperature]]\nset = 'block_xmin'\nchange = 0.03\n";
        let text = Scene { design: other.into(), more: heat.into(), ..base }.text().replace(elastic, law);
        let text = text.replace("\nmaterial", "\nthermal_expansion = 0.5\nmaterial");
        kinds.push(Kind { name: format!("{name}heated"), text, varied: false });
    }
    kinds
}

/// The text with other values of its parameters; the last of them are amplitudes of motions and of loads.
fn with_parameters(text: &str, names: &[Parameter], values: &[f64]) -> String {
    let mut out = text.to_owned();
    for (name, value) in names.iter().zip(values) {
        out = match *name {
            Parameter::Friction { .. } => out.replace("friction = 0.4", &format!("friction = {value:?}")),
            // a rigid body has none
            Parameter::YoungsModulus { body } => with_number(&out, "youngs_modulus = ", body, *value),
            Parameter::Expansion { body } => with_number(&out, "thermal_expansion = ", body, *value),
            Parameter::Temperature { change } => {
                with_number(&out, "\nchange = ", change, *value * [0.05, 0.03][change])
            }
            // the slab's support does not move
            Parameter::Amplitude { motion: 0 } => out,
            Parameter::Amplitude { motion } => {
                // a support that stays where it is has none
                let mut lines = out.lines().filter(|line| line.starts_with("motion = "));
                let Some(line) = lines.nth(motion - 1).map(str::to_owned) else { continue };
                out.replace(&line, &scaled(&line, *value))
            }
            Parameter::Preload { .. } => out
                .replace("force = 9 ", &format!("force = {:?} ", 9.0 * value))
                .replace("force = 12 ", &format!("force = {:?} ", 12.0 * value)),
            Parameter::Load { .. } => out
                .replace("pressure = 20", &format!("pressure = {:?}", 20.0 * value))
                .replace("angular_velocity = 2", &format!("angular_velocity = {:?}", 2.0 * value.sqrt())),
        };
    }
    out
}

/// The text with another number after the key at this place; unchanged if there is none.
fn with_number(text: &str, key: &str, place: usize, value: f64) -> String {
    let place = text.match_indices(key).nth(place).map(|(place, key)| place + key.len());
    place.map_or(text.to_owned(), |from| {
        let length = text[from..].find([',', '\n']).expect("an end");
        format!("{}{value:?}{}", &text[..from], &text[from + length..])
    })
}

/// A line of waypoints with all displacements and angles multiplied by a factor.
fn scaled(line: &str, factor: f64) -> String {
    let document: toml::Table = line.parse().expect("a line of a case");
    let waypoints = document["motion"].as_array().expect("a list").iter().map(|waypoint| {
        let number = |value: &toml::Value| value.as_float().or(value.as_integer().map(|i| i as f64)).expect("a number");
        let keys = waypoint.as_table().expect("a table").iter().map(|(key, value)| match value.as_array() {
            Some(values) => {
                let values: Vec<f64> = values.iter().map(|u| factor * number(u)).collect();
                format!("{key} = {values:?}")
            }
            None if key == "angle" => format!("{key} = {:?}", factor * number(value)),
            None => format!("{key} = {:?}", number(value)),
        });
        format!("{{ {} }}", keys.collect::<Vec<_>>().join(", "))
    });
    format!("motion = [{}]", waypoints.collect::<Vec<_>>().join(", "))
}

/// Every input of the last steps of every kind. Together, all statuses of contact occur at the ends of
/// these steps.
#[test]
fn every_input_is_pulled_back() {
    let compared: Vec<(String, BTreeMap<String, f64>)> = kinds().into_par_iter().map(|kind| compare(&kind)).collect();
    for (kind, inputs) in &compared {
        println!("{kind}: {inputs:?}");
        for (input, relative) in inputs {
            assert!(*relative < BOUND, "{kind}, {input}: {relative:e}");
        }
        let history = kind.contains("penalty") || kind.contains("plastic");
        let expected = ["unknowns", "history", "previous", "density", "parameters", "position"];
        // these depend on the mesh in further ways
        let fixed = ["viscous", "springs", "begins", "ends", "rotating", "rigid", "bolt"];
        let fixed = fixed.iter().any(|what| kind.contains(what));
        assert_eq!(inputs.contains_key("position"), !fixed, "{kind}");
        let missing =
            |name: &&&str| fixed && **name == "position" || !history && ["unknowns", "history"].contains(*name);
        for name in expected.iter().filter(|name| !missing(name)) {
            assert!(inputs.keys().any(|input| input.starts_with(name)), "{kind} has no {name}");
        }
    }
}

/// The largest relative deviation for each input with a derivative.
fn compare(kind: &Kind) -> (String, BTreeMap<String, f64>) {
    let mut base = problem(&kind.text);
    let density = random_density(&base, 5);
    let path = forward(&mut base, &density).path;
    let design = &base.analysis.design;
    let (model, unknowns) = (design.model().clone(), design.unknowns().clone());
    // friction, the moduli of both bodies, also of a rigid one, the motions, the load if there is one, and heat
    let mut names = vec![Parameter::Friction { interface: 0 }];
    names.extend([0, 1].map(|body| Parameter::YoungsModulus { body }));
    let motions = kind.text.matches("[[dirichlet]]").count();
    names.extend((0..motions).map(|motion| Parameter::Amplitude { motion }));
    names.extend(kind.text.contains("[[bolt]]").then_some(Parameter::Preload { bolt: 0 }));
    names.extend(kind.text.contains("[[load]]").then_some(Parameter::Load { load: 0 }));
    names.extend([0, 1].map(|body| Parameter::Expansion { body }));
    let changes = kind.text.matches("[[temperature]]").count();
    names.extend((0..changes).map(|change| Parameter::Temperature { change }));
    let value = |name: &Parameter| match *name {
        Parameter::Friction { .. } => 0.4,
        Parameter::YoungsModulus { .. } => 1000.0,
        Parameter::Expansion { .. } => 0.5,
        _ => 1.0,
    };
    let parameters: Vec<f64> = names.iter().map(value).collect();
    assert_eq!(parameters.len(), unknowns.parameters, "{}: {names:?}", kind.name);
    let movable = model.fixes_positions().is_empty();
    let positions = if movable { model.reference_positions().to_vec() } else { Vec::new() };
    assert_eq!(positions.len(), unknowns.positions, "{}", kind.name);
    let of = |inputs: &Inputs| -> Design {
        let density: ElementValues = inputs.density.clone().into();
        if inputs.position != positions {
            return Design::new(model.clone(), &density).at_positions(&inputs.position).expect("elements stay convex");
        }
        if inputs.parameters == parameters {
            return Design::new(model.clone(), &density);
        }
        let text = with_parameters(&kind.text, &names, &inputs.parameters);
        Design::new(problem(&text).analysis.design.model().clone(), &density)
    };
    let mut largest = BTreeMap::new();
    let mut statuses = [0_usize; 3];
    for index in path.states.len() - 2..path.states.len() {
        let [previous, state] = [&path.states[index - 1], &path.states[index]];
        state.active_set.iter().for_each(|status| statuses[usize::from(status.code())] += 1);
        let split = unknowns.history - model.solid().history();
        let comparison = Comparison {
            problem: &of,
            workspace: &|_: &Design| Workspace::default(),
            span: Span::new(previous.time, state.time.t),
            at: Inputs {
                unknowns: state.state.unknowns.clone(),
                previous: previous.state.unknowns.clone(),
                history: previous.state.history.clone(),
                density: density.to_vec(),
                parameters: parameters.clone(),
                position: positions.clone(),
            },
            increments: [1e-5, 1e-5, 1e-4, 1e-4, 1e-4, 1e-5],
            history: vec![("of contact", 0..split), ("of elements", split..unknowns.history)],
        };
        for deviation in comparison.deviations().expect("has a value") {
            // of a derivative that is zero, the differences are round-off
            if deviation.size <= ROUND_OFF {
                assert!(deviation.largest <= 2.0 * ROUND_OFF, "{}: {deviation:?}", kind.name);
                continue;
            }
            let (relative, to) = (deviation.relative(), largest.entry(deviation.input).or_default());
            *to = if relative > *to || relative.is_nan() { relative } else { *to };
        }
    }
    assert!(!kind.varied || statuses[1..].iter().all(|&count| count > 0), "{}: {statuses:?}", kind.name);
    (kind.name.clone(), largest)
}

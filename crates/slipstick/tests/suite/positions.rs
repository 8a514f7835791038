//! dθ/dX with respect to the reference positions of nodes, compared with central differences (order 4) of whole forward
//! analyses, each of a problem that is built from files with moved nodes.

use crate::common::scene::*;
use crate::common::*;
use slipstick::analysis::Forward;
use slipstick::build::Problem;
use slipstick::mesh::{BoxShape, Mesh, box_mesh};
use slipstick_path::Silent;

/// Relative to the sum of the magnitudes of all terms of a directional derivative.
const BOUND: f64 = 1e-8;

/// A case's text with its boxes replaced by files. Planes whose nodes have moved are facets, not curved surfaces.
fn meshed(scene: &Scene) -> String {
    let mut text = scene.text().replace("multiplier_shape", "surfaces = \"faceted\"\nmultiplier_shape");
    for name in ["slab", "block"] {
        let start = text.find("box = ").expect("a box");
        let end = start + text[start..].find('\n').expect("its end");
        text.replace_range(start..end, &format!("mesh = {{ file = '{name}' }}"));
    }
    text
}

fn built(text: &str, meshes: &[Mesh; 2], shift: &[f64]) -> Problem {
    let mut meshes = meshes.clone();
    let nodes = meshes.iter_mut().flat_map(|mesh| mesh.nodes.iter_mut().flatten());
    nodes.zip(shift).for_each(|(x, shift)| *x += shift);
    let [slab, block] = meshes;
    problem_with(text, &[("slab", slab), ("block", block)])
}

/// The contact statuses of all states, and the points that flow before each.
fn branches(problem: &mut Problem, run: &Forward) -> Vec<String> {
    let mut out = status_path(problem, run);
    let solid = problem.analysis.model().solid();
    let histories: Vec<&[f64]> = run.path.states.iter().map(|state| &state.state.history[..]).collect();
    for pair in histories.windows(2).filter(|_| solid.history() > 0) {
        let [before, after] = [pair[0], pair[1]].map(|of| &of[of.len() - solid.history()..]);
        out.push(format!("{:?}", solid.flowing(before, after)));
    }
    out
}

/// Compares derivatives along two random directions, in which no branch changes within the step sizes. Returns the
/// contact statuses, among which is slip.
fn check(name: &str, text: &str, meshes: &[Mesh; 2]) -> String {
    let count = 3 * meshes.iter().map(|mesh| mesh.nodes.len()).sum::<usize>();
    let mut base = built(text, meshes, &vec![0.0; count]);
    let density = random_density(&base, 7);
    let run = forward(&mut base, &density);
    let statuses = branches(&mut base, &run);
    let found = base.analysis.gradient_by_positions(&run).unwrap_or_else(|e| panic!("{name}: {e}"));
    assert_eq!(found.len(), count, "{name}");
    let all = status_path(&mut base, &run).concat();
    assert!(all.contains('l'), "{name}: {statuses:?}");
    let mut random = Random::new(3);
    let mut compared = 0;
    for _ in 0..8 {
        let direction = random.vector(count, 1.0);
        let size: f64 = found.iter().zip(&direction).map(|(g, v)| (g * v).abs()).sum();
        let along: f64 = found.iter().zip(&direction).map(|(g, v)| g * v).sum();
        // `None` beyond a kink
        let value = |h: f64| {
            let shift: Vec<f64> = direction.iter().map(|v| h * v).collect();
            let mut moved = built(text, meshes, &shift);
            let run = forward(&mut moved, &density);
            (branches(&mut moved, &run) == statuses).then_some(run.value)
        };
        let error = |h: f64| {
            let difference = (8.0 * (value(h)? - value(-h)?) - (value(2.0 * h)? - value(-2.0 * h)?)) / (12.0 * h);
            Some((along - difference).abs() / size)
        };
        let errors: Vec<Option<f64>> = [2e-4, 5e-5, 1e-5, 2e-6].map(error).into();
        println!("{name}: {along}, terms of {size}, deviations {errors:?}");
        let Some(least) = errors.iter().flatten().copied().reduce(f64::min) else { continue };
        assert!(least < BOUND, "{name}: {along} of {size}, {errors:?}");
        compared += 1;
        if compared == 2 {
            break;
        }
    }
    assert_eq!(compared, 2, "{name}: too many kinks");
    all
}

/// Hexahedra, wedges and tetrahedra.
fn linear() -> [Mesh; 2] {
    let shape = |min: [f64; 3], max: [f64; 3], elements: [usize; 3]| BoxShape { min, max, elements, grading: [1.0; 3] };
    let slab = box_mesh("slab", &shape([0.0; 3], [4.0, 1.0, 1.0], [4, 1, 1])).unwrap();
    let slab = slab.divided_into_wedges(|e| [None, Some(1), Some(2), None][e]).divided(|element| element == 5);
    [slab, box_mesh("block", &shape([0.6, 1.0, 0.1], [1.4, 1.8, 0.9], [1, 2, 1])).unwrap()]
}

/// Curved elements of second order.
fn quadratic() -> [Mesh; 2] {
    let shape = |min: [f64; 3], max: [f64; 3], elements: [usize; 3]| BoxShape { min, max, elements, grading: [1.0; 3] };
    let bent = |of: &[[f64; 3]]| -> [f64; 3] {
        let size = if of.iter().all(|x| x[1] == 1.0) { 0.005 } else { 0.02 };
        std::array::from_fn(|c| {
            let mean = of.iter().map(|x| x[c]).sum::<f64>() / of.len() as f64;
            mean + size * (7.0 * mean + 5.0 * c as f64).sin()
        })
    };
    let slab = box_mesh("slab", &shape([0.0; 3], [2.0, 1.0, 1.0], [2, 1, 1])).unwrap();
    let block = box_mesh("block", &shape([0.6, 1.0, 0.1], [1.4, 1.8, 0.9], [1; 3])).unwrap();
    [slab.second_order(bent).unwrap(), block.divided(|_| true).second_order(bent).unwrap()]
}

fn methods() -> [(&'static str, String); 3] {
    [("Lagrange", LAGRANGE.into()), ("penalty", penalty(2e4)), ("augmented", augmented(1e4, 1e-12))]
}

fn scene(enforcement: &str, shape: &'static str) -> Scene {
    Scene {
        enforcement: enforcement.into(),
        shape,
        motion: "[{ t = 0.4, u = [0, -0.1, 0] }, { t = 1.0, u = [0.15, -0.12, 0.04] }]".into(),
        steps: 5,
        observed: "\"all\"",
        ..Scene::default()
    }
}

/// Elements of all kinds with friction, F̄, energy interpolation, a turning drive, and a pressure.
#[test]
fn gradients_by_positions_match_differences() {
    let mut statuses = String::new();
    for (k, (method, enforcement)) in methods().into_iter().enumerate() {
        for shape in ["standard", "dual"] {
            let turned = Scene {
                drive: "rotation = { point = [1.0, 0, 0.5], direction = [0, 1, 0] }".into(),
                motion: scene("", shape).motion.replace("0.04] }", "0.04], angle = 6 }"),
                more: "[[load]]\nsurface = 'slab_xmax'\npressure = 20\n".into(),
                ..scene(&enforcement, shape)
            };
            statuses += &check(&format!("{method} {shape}, linear, turned, loaded"), &meshed(&turned), &linear());
            let mut text = meshed(&scene(&enforcement, shape));
            text = match k {
                0 => text.replace("\nmaterial", "\nelement = \"f_bar\"\nmaterial"),
                1 => text.replace("[design]", "[design]\nenergy_interpolation = { threshold = 0.3, sharpness = 10 }"),
                _ => text,
            };
            statuses += &check(&format!("{method} {shape}, quadratic"), &text, &quadratic());
        }
    }
    assert!(statuses.contains('t'), "no node sticks");
}

/// Plastic bodies, whose history carries the shape of earlier steps along, with heat.
#[test]
fn gradients_by_positions_of_plastic_bodies_match_differences() {
    for (k, (method, enforcement)) in methods().into_iter().enumerate() {
        let elastic = "neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 }";
        let plastic =
            "j2_linear = { youngs_modulus = 1000.0, poisson_ratio = 0.3, yield_stress = 20, hardening_modulus = 150 }";
        let heat = "[[temperature]]\nbody = 'slab'\nchange = 0.02\namplitude = [{ t = 0.4, factor = 1 }]\n";
        let text = meshed(&Scene { more: heat.into(), ..scene(&enforcement, "standard") }).replace(elastic, plastic);
        let keys = ["", "element = \"f_bar\"\n"][k % 2];
        let text = text.replace("\nmaterial", &format!("\n{keys}thermal_expansion = 0.5\nmaterial"));
        for (name, meshes) in [("linear", linear()), ("quadratic", quadratic())] {
            check(&format!("{method}, plastic, {name}"), &text, &meshes);
        }
    }
}

/// What has no such derivatives says so.
#[test]
fn what_fixes_positions_is_named() {
    let springs = "[[spring]]\nname = 'foot'\nset = 'slab_xmax'\nstiffness_per_area = 80\n";
    let mut sprung = problem(&Scene { more: springs.into(), ..scene(LAGRANGE, "standard") }.text());
    let density = random_density(&sprung, 7);
    let run = sprung.analysis.forward(&density, &mut Silent).unwrap();
    let error = sprung.analysis.gradient_by_positions(&run).unwrap_err().to_string();
    assert!(error.ends_with("exist with these: springs"), "{error}");
    // quantities with areas, volumes or arms of the mesh, or of energies
    let text = scene(LAGRANGE, "standard").text();
    for (quantity, refused) in [
        ("volume = { body = 'slab' }", true),
        ("moment = { set = 'block_ymax', point = [0, 0, 0], direction = [0, 1, 0] }", true),
        ("gap = { slave = 'block_ymin', measure = 'minimum' }", true),
        ("strain_energy = {}", true),
        ("reaction = { set = 'block_ymax', component = 'y' }", false),
    ] {
        let (start, objective) = text.split_at(text.find("[objective]").expect("an objective"));
        let rest = objective.splitn(3, '\n').nth(2).unwrap_or_default();
        let text = format!(
            "{start}\n[[quantity]]\nname = 'q'\n{quantity}\n[objective]\nminimise = {{ quantity = 'q' }}\n{rest}"
        );
        let mut other = problem(&text);
        let run = other.analysis.forward(&density, &mut Silent).unwrap();
        let answer = other.analysis.gradient_by_positions(&run).map_err(|error| error.to_string());
        match refused {
            true => assert!(answer.unwrap_err().ends_with("exist with these: the quantity `q`"), "{quantity}"),
            false => assert!(answer.unwrap().iter().any(|x| *x != 0.0), "{quantity}"),
        }
    }
}

/// Moved nodes give what a problem with moved meshes gives; moved back, every bit.
#[test]
fn moved_nodes_are_a_moved_mesh() {
    let text = meshed(&scene(LAGRANGE, "standard"));
    let meshes = linear();
    let mut base = built(&text, &meshes, &[]);
    let density = random_density(&base, 7);
    let x = base.analysis.model().reference_positions().to_vec();
    let value = forward(&mut base, &density).value;
    let shift: Vec<f64> = x.iter().enumerate().map(|(i, x)| if i % 3 == 2 { 0.1 * x } else { 0.0 }).collect();
    let moved: Vec<f64> = x.iter().zip(&shift).map(|(x, shift)| x + shift).collect();
    base.analysis.set_positions(&moved).unwrap();
    let expected = forward(&mut built(&text, &meshes, &shift), &density).value;
    let found = forward(&mut base, &density).value;
    assert!((found / expected - 1.0).abs() < 1e-9 && (found / value - 1.0).abs() > 0.01, "{found} {expected} {value}");
    assert!(base.analysis.set_positions(&vec![0.0; x.len()]).unwrap_err().to_string().contains("inverted element"));
    base.analysis.set_positions(&x).unwrap();
    assert_eq!(forward(&mut base, &density).value, value);
}

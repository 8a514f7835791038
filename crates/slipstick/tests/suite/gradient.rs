//! The adjoint gradient compared with central differences (order 4) of the whole forward analysis,
//! for every enforcement method, multiplier shape and contact history, with a heterogeneous design;
//! each test checks that the statuses of interest occur.

use crate::common::scene::*;
use crate::common::*;
use slipstick::analysis::Forward;
use slipstick::build::Problem;
use slipstick::case::LawKind;
use slipstick_mesh::{BoxShape, box_mesh};
use slipstick_path::Silent;

/// The bound of all comparisons; most are better than 1e-10.
pub const BOUND: f64 = 1e-7;

/// Stiff enough that Uzawa's iteration converges fast, soft enough that 1e-12 of the force is still
/// above round-off.
pub const AUGMENTED: f64 = 1e4;

pub fn methods() -> [(&'static str, String); 3] {
    [("Lagrange", LAGRANGE.into()), ("penalty", penalty(2e4)), ("augmented", augmented(AUGMENTED, 1e-11))]
}

pub fn check(name: &str, problem: &mut Problem, seed: u64) -> GradientCheck {
    let density = random_density(problem, seed);
    let check = check_gradient(problem, &density);
    println!("{name}: error {:.1e}, {:?}", check.error, check.statuses);
    assert!(check.error < BOUND, "{name}: the gradient is off by {:e}; statuses {:?}", check.error, check.statuses);
    check
}

/// All methods and shapes in one scene; returns the statuses.
fn check_all(base: &Scene) -> Vec<(String, Vec<String>)> {
    let mut all = Vec::new();
    for (method, enforcement) in methods() {
        for shape in ["standard", "dual"] {
            let scene = Scene { enforcement: enforcement.clone(), shape, ..base.clone() };
            let name = format!("{method} {shape}");
            let checked = check(&name, &mut problem(&scene.text()), 7);
            all.push((name, checked.statuses));
        }
    }
    all
}

pub fn changes(statuses: &[String]) -> bool {
    statuses.windows(2).any(|w| w[0] != w[1])
}

#[test]
fn gradient_all_stick() {
    let motion = "[{ t = 0.5, u = [0, -0.1, 0] }, { t = 1.0, u = [0.03, -0.1, 0.01] }]".to_string();
    for (name, statuses) in check_all(&Scene { friction: 3.0, motion, ..Scene::default() }) {
        assert!(statuses.iter().all(|s| s == "tttt"), "{name}: {statuses:?}");
    }
}

#[test]
fn gradient_all_slip() {
    let motion = "[{ t = 1.0, u = [0.4, -0.1, 0.15] }]".to_string();
    for (name, statuses) in check_all(&Scene { friction: 0.1, motion, ..Scene::default() }) {
        assert!(statuses.iter().all(|s| s == "llll"), "{name}: {statuses:?}");
    }
}

#[test]
fn gradient_stick_and_slip_changing_along_the_path() {
    let motion = "[{ t = 0.4, u = [0, -0.1, 0] }, { t = 1.0, u = [0.15, -0.12, 0.04] }]".to_string();
    for (name, statuses) in check_all(&Scene { friction: 0.5, motion, ..Scene::default() }) {
        assert!(statuses.iter().any(|s| s.contains('t') && s.contains('l')), "{name}: {statuses:?}");
        assert!(changes(&statuses), "{name}: {statuses:?}");
    }
}

#[test]
fn gradient_opening_and_closing_again() {
    let motion =
        "[{ t = 0.3, u = [0.02, -0.08, 0.01] }, { t = 0.5, u = [0.05, 0.04, 0] }, { t = 1.0, u = [0.2, -0.1, 0.05] }]";
    for (name, statuses) in check_all(&Scene { friction: 0.3, motion: motion.into(), ..Scene::default() }) {
        let open = statuses.iter().position(|s| s == "oooo");
        assert!(open.is_some_and(|n| n > 0 && !statuses[n - 1].contains('o')), "{name}: {statuses:?}");
        assert!(statuses.last().unwrap().contains('l'), "{name}: {statuses:?}");
    }
}

/// A finer slave surface, partly beyond the slab's edge, tilted by a rotation about a horizontal
/// axis: nodes open while others stick and slip.
#[test]
fn gradient_of_a_rocking_block_over_the_edge() {
    for (method, enforcement) in methods() {
        for shape in ["standard", "dual"] {
            let scene = Scene {
                slab: [3, 1, 2],
                block: [2, 1, 2],
                corner: [0.9, 1.0, 0.37],
                enforcement: enforcement.clone(),
                shape,
                friction: 0.3,
                motion: "[{ t = 0.4, u = [0, -0.04, 0] }, { t = 1.0, u = [0.04, -0.02, 0], angle = 8 }]".into(),
                drive: "rotation = { point = [1.3, 1.8, 0.77], direction = [0.2, 0, 1] }".into(),
                ..Scene::default()
            };
            let checked = check(&format!("{method} {shape}"), &mut problem(&scene.text()), 5);
            let last = checked.statuses.last().unwrap();
            assert!(last.contains('o') && (last.contains('l') || last.contains('t')), "{last}");
            assert!(changes(&checked.statuses));
        }
    }
}

/// A block slides onto the slab from beyond its edge: nodes without a previous mortar row reach the
/// slab. For these, the first slip increment would vanish for every motion, so friction starts one
/// step later; the stiffness of their contact condition increases with their area. Otherwise, steps
/// that cover new nodes could not be solved.
#[test]
fn gradient_of_a_block_sliding_onto_the_slab() {
    for (method, enforcement) in methods() {
        for shape in ["standard", "dual"] {
            let scene = Scene {
                slab: [3, 1, 1],
                block: [3, 1, 2],
                corner: [-0.58, 1.0, 0.1],
                enforcement: enforcement.clone(),
                shape,
                friction: 0.3,
                motion: "[{ t = 0.2, u = [0.05, -0.06, 0] }, { t = 1.0, u = [0.38, -0.06, 0.02] }]".into(),
                ..Scene::default()
            };
            let checked = check(&format!("{method} {shape}"), &mut problem(&scene.text()), 9);
            let touching = |s: &String| s.len() - s.matches('o').count();
            let (first, last) = (&checked.statuses[0], checked.statuses.last().unwrap());
            assert!(touching(first) < touching(last), "no node came over: {first} {last}");
        }
    }
}

/// Every law except the default, and F̄ with nearly incompressible material.
#[test]
fn gradient_of_other_materials_and_elements() {
    let motion = "[{ t = 0.4, u = [0, -0.08, 0] }, { t = 1.0, u = [0.15, -0.1, 0.04] }]".to_string();
    for (method, enforcement) in methods() {
        let text = Scene { friction: 0.3, enforcement, motion: motion.clone(), ..Scene::default() }.text();
        let f_bar = text.replace("poisson_ratio = 0.3 } }", "poisson_ratio = 0.49 } }\nelement = \"f_bar\"");
        let laws = LawKind::ALL[1..].iter().map(|law| (law.form().unwrap_or(law.word()), of_law(&text, *law)));
        let others = laws.chain([("F-bar", f_bar)]);
        let plain = check(method, &mut problem(&text), 3).value;
        for (name, text) in others {
            // with the penalty, a node of the orthotropic block changes its status at design 3
            let design = if (method, name) == ("penalty", LawKind::Orthotropic.word()) { 4 } else { 3 };
            let checked = check(&format!("{method}, {name}"), &mut problem(&text), design);
            assert!(checked.statuses.last().unwrap().contains('l'));
            assert!((checked.value / plain - 1.0).abs() > 1e-6, "{name} makes no difference: {plain}");
        }
    }
}

/// Tetrahedra, and both kinds of elements in one body: a slab in which every second hexahedron is
/// divided, under a block of tetrahedra, so that triangles slide over triangles and quadrilaterals.
#[test]
fn gradient_of_tetrahedra_and_hexahedra() {
    let divided = |name: &str, min: [f64; 3], max: [f64; 3], elements: [usize; 3], every: usize| {
        let shape = BoxShape { min, max, elements, grading: [1.0; 3] };
        box_mesh(name, &shape).unwrap().divided(|element| element % every == 0)
    };
    let slab = divided("slab", [0.0; 3], [4.0, 1.0, 1.0], [4, 1, 1], 2);
    let block = divided("block", [0.6, 1.0, 0.1], [1.4, 1.8, 0.9], [1; 3], 1);
    let motion = "[{ t = 0.4, u = [0, -0.1, 0] }, { t = 1.0, u = [0.15, -0.12, 0.04] }]".to_string();
    for (method, enforcement) in methods() {
        for shape in ["standard", "dual"] {
            let (enforcement, motion) = (enforcement.clone(), motion.clone());
            let scene = Scene { friction: 0.4, enforcement, shape, motion, ..Scene::default() };
            let lines = scene.text().lines().map(|line| line.to_owned()).collect::<Vec<_>>();
            let mut names = ["slab", "block"].into_iter();
            let meshed = lines.iter().map(|line| match line.starts_with("box = ") {
                true => format!("mesh = {{ file = '{}' }}\n", names.next().unwrap()),
                false => format!("{line}\n"),
            });
            let mut problem =
                problem_with(&meshed.collect::<String>(), &[("slab", slab.clone()), ("block", block.clone())]);
            assert_eq!(problem.mesh.elements.len(), 2 + 3 * 6);
            let checked = check(&format!("{method} {shape}"), &mut problem, 7);
            let (all, last) = (checked.statuses.concat(), checked.statuses.last().unwrap());
            assert!(all.contains('t') && last.contains('l'), "{:?}", checked.statuses);
        }
    }
}

/// Wedges: a slab of hexahedra, standing wedges, lying wedges and tetrahedra, under a block of
/// standing or lying wedges, so that triangles and quadrilaterals of wedges slide over those of all
/// elements; with F̄, and with nearly empty elements.
#[test]
fn gradient_of_wedges() {
    let shape = |min: [f64; 3], max: [f64; 3], elements: [usize; 3]| BoxShape { min, max, elements, grading: [1.0; 3] };
    let slab = box_mesh("slab", &shape([0.0; 3], [4.0, 1.0, 1.0], [4, 1, 1])).unwrap();
    let slab =
        slab.divided_into_wedges(|element| [None, Some(1), Some(2), None][element]).divided(|element| element == 5);
    let block = box_mesh("block", &shape([1.6, 1.0, 0.1], [2.4, 1.8, 0.9], [1; 3])).unwrap();
    let motion = "[{ t = 0.4, u = [0, -0.1, 0] }, { t = 1.0, u = [0.15, -0.12, 0.04] }]".to_string();
    for (k, (method, enforcement)) in methods().into_iter().enumerate() {
        for (shape, along) in [("standard", 1), ("dual", 2)] {
            let (enforcement, motion) = (enforcement.clone(), motion.clone());
            let scene = Scene { friction: 0.4, enforcement, shape, motion, ..Scene::default() };
            let mut text = scene.text();
            for (name, mesh) in ["slab", "block"].map(|name| (name, format!("mesh = {{ file = '{name}' }}"))) {
                let start = text.find("box = ").unwrap();
                let end = start + text[start..].find('\n').unwrap();
                assert!(text[..start].ends_with(&format!("name = \"{name}\"\n")), "{text}");
                text.replace_range(start..end, &mesh);
            }
            if k == 1 {
                text = text.replacen("material", "element = \"f_bar\"\nmaterial", 1);
            }
            if k == 2 {
                text = text.replace("[design]", "[design]\nenergy_interpolation = { threshold = 0.3, sharpness = 10 }");
            }
            let block = block.divided_into_wedges(|_| Some(along));
            let mut problem = problem_with(&text, &[("slab", slab.clone()), ("block", block)]);
            assert_eq!(problem.mesh.elements.len(), 1 + 2 + 2 + 6 + 2);
            let checked = check(&format!("{method} {shape}"), &mut problem, 7);
            let (all, last) = (checked.statuses.concat(), checked.statuses.last().unwrap());
            assert!(all.contains('t') && last.contains('l'), "{:?}", checked.statuses);
        }
    }
}

/// Quadratic elements: hexahedra of 27 nodes on both sides, and tetrahedra of ten nodes on hexahedra of
/// 27 nodes, on linear ones and under them; fully integrated and with F̄, with nearly empty elements,
/// and with curved inner edges and surfaces.
#[test]
fn gradient_of_quadratic_elements() {
    let shape = |min: [f64; 3], max: [f64; 3], elements: [usize; 3]| BoxShape { min, max, elements, grading: [1.0; 3] };
    let linear_slab = box_mesh("slab", &shape([0.0; 3], [2.0, 1.0, 1.0], [2, 1, 1])).unwrap();
    let linear_block = box_mesh("block", &shape([0.6, 1.0, 0.1], [1.4, 1.8, 0.9], [1; 3])).unwrap();
    // middles of edges are moved, so that no edge is straight; those of the contact surface less
    let bent = |of: &[[f64; 3]]| -> [f64; 3] {
        let size = if of.iter().all(|x| x[1] == 1.0) { 0.005 } else { 0.02 };
        std::array::from_fn(|c| {
            let mean = of.iter().map(|x| x[c]).sum::<f64>() / of.len() as f64;
            mean + size * (7.0 * mean + 5.0 * c as f64).sin()
        })
    };
    let quadratic = |mesh: &slipstick_mesh::Mesh| mesh.second_order(bent).unwrap();
    let tetrahedra = |mesh: &slipstick_mesh::Mesh| mesh.divided(|_| true);
    let pairs = [
        (quadratic(&linear_slab), quadratic(&linear_block)),
        (quadratic(&linear_slab), quadratic(&tetrahedra(&linear_block))),
        (linear_slab.clone(), quadratic(&tetrahedra(&linear_block))),
        (quadratic(&tetrahedra(&linear_slab)), linear_block.clone()),
        (quadratic(&linear_slab.divided_into_wedges(|_| Some(1))), quadratic(&linear_block)),
        (quadratic(&linear_slab), quadratic(&linear_block.divided_into_wedges(|_| Some(2)))),
    ];
    let motion = "[{ t = 0.4, u = [0, -0.1, 0] }, { t = 1.0, u = [0.15, -0.12, 0.04] }]".to_string();
    for (k, (slab, block)) in pairs.into_iter().enumerate() {
        let mut all = String::new();
        for (m, (method, enforcement)) in methods().into_iter().enumerate() {
            let shape = ["standard", "dual"][(k + m) % 2];
            let scene =
                Scene { friction: 0.3, enforcement, shape, motion: motion.clone(), steps: 4, ..Scene::default() };
            let mut text = scene.text();
            for name in ["slab", "block"] {
                let start = text.find("box = ").unwrap();
                let end = start + text[start..].find('\n').unwrap();
                text.replace_range(start..end, &format!("mesh = {{ file = '{name}' }}"));
            }
            if m == 1 {
                text = text.replace("\nmaterial", "\nelement = \"f_bar\"\nmaterial");
            }
            if m == 2 {
                text = text.replace("[design]", "[design]\nenergy_interpolation = { threshold = 0.3, sharpness = 10 }");
            }
            let mut problem = problem_with(&text, &[("slab", slab.clone()), ("block", block.clone())]);
            let checked = check(&format!("pair {k}, {method} {shape}"), &mut problem, 7);
            assert!(checked.statuses.last().unwrap().contains('l'), "{:?}", checked.statuses);
            all += &checked.statuses.concat();
        }
        assert!(all.contains('t'), "pair {k}: no node sticks");
    }
}

/// Hexahedra of 20 nodes, or wedges of 15, on both sides, with curved inner edges: their centres follow, but those of
/// slave faces with multipliers.
#[test]
fn gradient_of_serendipity_elements() {
    let shape = |min: [f64; 3], max: [f64; 3], elements: [usize; 3]| BoxShape { min, max, elements, grading: [1.0; 3] };
    let bent = |of: &[[f64; 3]]| -> [f64; 3] {
        let size = if of.iter().all(|x| x[1] == 1.0) { 0.005 } else { 0.02 };
        std::array::from_fn(|c| {
            let mean = of.iter().map(|x| x[c]).sum::<f64>() / of.len() as f64;
            mean + size * (7.0 * mean + 5.0 * c as f64).sin()
        })
    };
    let quadratic = |name: &str, shape: &BoxShape| box_mesh(name, shape).unwrap().second_order(bent).unwrap();
    let slab = quadratic("slab", &shape([0.0; 3], [2.0, 1.0, 1.0], [2, 1, 1]));
    let block = quadratic("block", &shape([0.6, 1.0, 0.1], [1.4, 1.8, 0.9], [1; 3]));
    let motion = "[{ t = 0.4, u = [0, -0.1, 0] }, { t = 1.0, u = [0.15, -0.12, 0.04] }]".to_string();
    let wedges = |name: &str, shape: &BoxShape, along: usize| {
        box_mesh(name, shape).unwrap().divided_into_wedges(|_| Some(along)).second_order(bent).unwrap()
    };
    let of_wedges = [
        wedges("slab", &shape([0.0; 3], [2.0, 1.0, 1.0], [2, 1, 1]), 1),
        wedges("block", &shape([0.6, 1.0, 0.1], [1.4, 1.8, 0.9], [1; 3]), 2),
    ];
    let methods = methods().into_iter().enumerate();
    for ((m, (method, enforcement)), wedges) in methods.flat_map(|method| [(method.clone(), false), (method, true)]) {
        let shape = ["standard", "dual"][m % 2];
        let scene = Scene { friction: 0.3, enforcement, shape, motion: motion.clone(), steps: 4, ..Scene::default() };
        let mut text = scene.text();
        for name in ["slab", "block"] {
            let start = text.find("box = ").unwrap();
            let end = start + text[start..].find('\n').unwrap();
            text.replace_range(start..end, &format!("mesh = {{ file = '{name}' }}"));
        }
        let keys = ["", if wedges { "" } else { "element = \"reduced\"\n" }, "element = \"f_bar\"\n"][m % 3];
        text = text.replace("\nmaterial", &format!("\nshape_functions = \"serendipity\"\n{keys}material"));
        let [slab, block] = if wedges { of_wedges.clone() } else { [slab.clone(), block.clone()] };
        let mut problem = problem_with(&text, &[("slab", slab), ("block", block)]);
        let checked = check(&format!("{method} {shape} {keys}, wedges: {wedges}"), &mut problem, 7);
        assert!(checked.statuses.last().unwrap().contains('l'), "{:?}", checked.statuses);
    }
}

fn spinning() -> Scene {
    Scene {
        friction: 0.2,
        motion: "[{ t = 0.2, u = [0, -0.1, 0] }, { t = 1.0, angle = 25 }]".into(),
        drive: "rotation = { point = [1.0, 0, 0.5], direction = [0, 1, 0] }".into(),
        ..Scene::default()
    }
}

/// The clutch: the driven face spins about the contact normal.
#[test]
fn gradient_with_a_spinning_driven_face() {
    for (method, enforcement) in methods() {
        let scene = Scene { enforcement, ..spinning() };
        let checked = check(method, &mut problem(&scene.text()), 5);
        assert!(checked.statuses.last().unwrap().contains('l'));
    }
}

#[test]
fn gradient_of_an_objective_over_all_steps() {
    for (method, enforcement) in methods() {
        let scene = Scene { enforcement, observed: "\"all\"", ..Scene::default() };
        let checked = check(method, &mut problem(&scene.text()), 11);
        assert_eq!(checked.forward.step_values.iter().filter(|v| **v < 0.0).count(), 10);
    }
}

/// Each pair has its own method. Lagrange multipliers and the augmented Lagrangian have the same
/// solution, so the objective does not depend on which pair has which.
#[test]
fn gradient_of_three_bodies() {
    let mut exact: Vec<(String, f64)> = Vec::new();
    for (first, below) in methods() {
        for (second, above) in methods() {
            let name = format!("{first}, {second}");
            let checked = check(&name, &mut problem(&three_bodies(&below, &above)), 2);
            let last = checked.statuses.last().unwrap();
            assert!(last.len() == 8 && last.contains('l') && last.contains('t'), "{name}: {last}");
            if first != "penalty" && second != "penalty" {
                exact.push((name, checked.value));
            }
        }
    }
    assert_eq!(exact.len(), 4);
    for (name, value) in &exact {
        let apart = (value / exact[0].1 - 1.0).abs();
        assert!(apart < 1e-9, "{name}: {apart:e} from {}", exact[0].0);
    }
}

/// A step that crushes the bodies is cut back, and the adjoint follows the sub-steps. The test uses
/// the first depth that is too large for one increment.
#[test]
fn gradient_through_sub_steps() {
    for (method, enforcement) in methods() {
        let crushed = |depth: f64| {
            let motion = format!(
                "[{{ t = 0.2, u = [0.02, -0.05, 0] }}, {{ t = 0.3, u = [0.3, -{depth:?}, 0.1] }}, {{ t = 1.0, u = [0.4, -{depth:?}, 0.2] }}]"
            );
            problem(&Scene { enforcement: enforcement.clone(), motion, ..Scene::default() }.text())
        };
        let cut_back = |problem: &mut Problem| {
            let density = random_density(problem, 4);
            let run = problem.analysis.forward(&density, &mut Silent);
            run.is_ok_and(|run| run.path.states.iter().skip(1).any(|s| s.completes.is_none()))
        };
        let depths = (0..20).map(|k| 0.5 + 0.05 * k as f64);
        let mut problem =
            depths.map(crushed).find_map(|mut p| cut_back(&mut p).then_some(p)).expect("some depth is too much");
        let checked = check(method, &mut problem, 4);
        assert_eq!(checked.forward.path.steps, 10);
        assert!(checked.forward.path.states.len() > 11);
    }
}

fn last_step_only(forward: &Forward) -> Forward {
    let mut short = forward.clone();
    let from = short.path.states.len() - 2;
    short.path.states.drain(..from);
    short
}

/// A gradient without previous-step terms would be wrong by at least 1e-4 … 3e-2, so the
/// comparisons above do test these terms. Without friction they vanish, and only the observed step
/// is solved.
#[test]
fn previous_step_terms_matter_with_friction_and_vanish_without() {
    for (method, enforcement) in methods() {
        for friction in [0.2, 0.0] {
            let scene = Scene { enforcement: enforcement.clone(), friction, ..spinning() };
            let mut problem = problem(&scene.text());
            let density = random_density(&problem, 9);
            let base = forward(&mut problem, &density);
            let whole = problem.analysis.gradient(&base).unwrap();
            let last = problem.analysis.gradient(&last_step_only(&base)).unwrap();
            println!("{method} mu {friction}: last step alone deviates by {:.1e}", deviation(&last, &whole));
            if friction > 0.0 {
                assert!(deviation(&last, &whole) > 1e-4, "{method}: {:e}", deviation(&last, &whole));
            } else {
                assert_eq!(last, whole, "{method}");
                check(&format!("{method} without friction"), &mut problem, 9);
            }
        }
    }
}

/// Without memory no factors are kept, with little memory some, with much memory those of all
/// steps; the results agree to the tolerance of the transposed solves.
#[test]
fn the_gradient_is_the_same_with_any_memory_for_factors() {
    for (method, enforcement) in methods() {
        let mut problem = problem(&Scene { enforcement, ..Scene::default() }.text());
        let density = random_density(&problem, 6);
        let (mut gradients, mut kept) = (Vec::new(), Vec::new());
        let mut memory = 0;
        for part in [0.0, 0.5, 2.0] {
            problem.analysis.march.memory = (part * memory as f64) as usize;
            if part == 0.0 {
                problem.analysis.march.memory = usize::MAX;
                memory = forward(&mut problem, &density).path.factor_bytes;
                problem.analysis.march.memory = 0;
            }
            let base = forward(&mut problem, &density);
            assert!(base.path.factor_bytes <= problem.analysis.march.memory);
            kept.push(base.path.states_with_factors());
            gradients.push(problem.analysis.gradient(&base).unwrap());
        }
        println!("{method}: {memory} bytes, factors at {kept:?} states");
        assert!(kept[0] == 0 && 0 < kept[1] && kept[1] < kept[2], "{method}: {kept:?}");
        for gradient in &gradients[1..] {
            let error = deviation(gradient, &gradients[0]);
            assert!(error < 1e-9, "{method}: {error:e}");
        }
    }
}

/// Small problems are factorized again in every solve, since that is cheaper. If earlier factors
/// are enforced, those of the march, of the sweep itself or both, the sweep has the same result.
#[test]
fn the_gradient_is_the_same_with_earlier_factors() {
    for (method, enforcement) in methods() {
        let mut problem = problem(&Scene { enforcement, ..Scene::default() }.text());
        let density = random_density(&problem, 6);
        let mut gradients = Vec::new();
        for (budget, memory) in [(None, 0), (Some(60), 0), (Some(60), usize::MAX)] {
            problem.analysis.march.memory = memory;
            problem.analysis.linear.set_budget(None);
            let base = forward(&mut problem, &density);
            problem.analysis.linear.set_budget(budget);
            let before = problem.analysis.linear.counts();
            gradients.push(problem.analysis.gradients(&base).unwrap());
            let after = problem.analysis.linear.counts();
            let (new, earlier) = (after.factorizations - before.factorizations, after.lagged - before.lagged);
            println!("{method}: {new} factorizations, {earlier} solves with earlier factors");
            match (budget, memory) {
                (None, _) => assert!(new > 5 && earlier == 0, "{method}: {new}, {earlier}"),
                (_, 0) => assert!(new > 0 && earlier > 3, "{method}: {new}, {earlier}"),
                _ => assert!(new < 3 && earlier > 5, "{method}: {new}, {earlier}"),
            }
        }
        for gradient in &gradients[1..] {
            let error = deviation(&gradient.density, &gradients[0].density);
            assert!(error < 1e-8, "{method}: {error:e}");
            for ((_, found), (name, expected)) in gradient.parameters.iter().zip(&gradients[0].parameters) {
                assert!((found - expected).abs() <= 1e-8 * expected.abs(), "{method}, {name:?}: {found}, {expected}");
            }
        }
    }
}

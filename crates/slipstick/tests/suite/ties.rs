//! Tied surfaces. Gradients are compared with central differences (order 4) of the whole forward
//! analysis; expected states are computed by hand.

use super::joints::{check, joined};
use crate::common::scene::*;
use crate::common::*;
use slipstick::model::Parameter;

/// Tied blocks are pulled, sheared and turned.
#[test]
fn gradient_of_tied_blocks() {
    for shape in ["standard", "dual"] {
        for (slab, block) in [([4, 1, 1], [1, 1, 1]), ([3, 1, 2], [2, 1, 2])] {
            let scene = Scene {
                slab,
                block,
                shape,
                motion: "[{ t = 1.0, u = [0.1, 0.15, 0.05], angle = 20 }]".into(),
                drive: "rotation = { point = [1, 1, 0.5], direction = [0.2, 1, 0.1] }".into(),
                ..Scene::default()
            };
            let statuses = check(shape, problem(&joined(&scene, "tied = true\n")));
            assert!(statuses.iter().all(|s| s.chars().all(|s| s == 't')), "{statuses:?}");
        }
    }
}

/// Tied blocks with non-matching meshes under uniaxial strain, pulled apart: the displacement is
/// linear and the stress that of the law, P = 2c (λ − J^(−2β)/λ) with J = λ, up to round-off.
#[test]
fn a_uniform_stress_passes_through_a_tie() {
    // the second mesh of the upper block almost matches that of the lower one: slivers of facets overlap
    let meshes = ["elements = [3, 1, 3]", "elements = [2, 1, 2], grading = [2.000001, 1, 1.000001]"];
    for ((shape, slave, master), upper) in [
        ("standard", "upper_ymin", "lower_ymax"),
        ("dual", "upper_ymin", "lower_ymax"),
        ("standard", "lower_ymax", "upper_ymin"),
    ]
    .into_iter()
    .flat_map(|sides| meshes.map(|mesh| (sides, mesh)))
    {
        let wall = |component: &str, face: &str| {
            let of = |body: &str| format!("[[dirichlet]]\nset = '{body}_{face}'\ncomponents = ['{component}']\n");
            of("lower") + &of("upper")
        };
        let walls =
            [("x", "xmin"), ("x", "xmax"), ("z", "zmin"), ("z", "zmax")].map(|(c, face)| wall(c, face)).concat();
        let material = "material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }";
        let text = format!(
            "[[body]]\nname = 'lower'\nbox = {{ min = [0, 0, 0], max = [1, 1, 1], elements = [2, 2, 2], grading = [2, 1, 1] }}\n\
             {material}\n\
             [[body]]\nname = 'upper'\nbox = {{ min = [0, 1, 0], max = [1, 2, 1], {upper} }}\n{material}\n\
             [[contact]]\nslave = '{slave}'\nmaster = '{master}'\ntied = true\nmultiplier_shape = '{shape}'\n\
             [[dirichlet]]\nset = 'lower_ymin'\ncomponents = ['y']\n\
             [[dirichlet]]\nset = 'upper_ymax'\ncomponents = ['y']\nmotion = [{{ t = 1.0, u = [0, 0.6, 0] }}]\n{walls}\
             [load_path]\nsteps = 2\ntolerance = {{ relative = 1e-13 }}\n"
        );
        let mut problem = problem(&text);
        let density = problem.initial_density().clone();
        let run = forward(&mut problem, &density);
        let stretch: f64 = 1.3;
        let d = &run.path.states.last().unwrap().state.unknowns;
        for (n, x) in problem.mesh.nodes.iter().enumerate() {
            let expected = [0.0, (stretch - 1.0) * x[1], 0.0];
            (0..3).for_each(|c| assert!((d[3 * n + c] - expected[c]).abs() < 1e-11, "{shape}: node {n}"));
        }
        let (c, beta): (f64, f64) = (1000.0 / 5.2, 0.3 / 0.4);
        let stress = 2.0 * c * (stretch - stretch.powf(-2.0 * beta) / stretch);
        for node in contact_path(&mut problem, &run).pop().unwrap() {
            // the traction acts on the area, which does not change; tension is negative
            assert!((node.multiplier[0] + stress).abs() < 1e-9 * stress, "{shape}: {} {stress}", node.multiplier[0]);
        }
    }
}

/// A block of 4 × 4 facets pressed by 10 on a slab of the same size, tied to it and moved along x, so that
/// the slab ends `overlap` behind a row of the block's nodes.
fn overhanging(overlap: f64, shape: &str) -> String {
    let (start, end) = (0.5 - overlap, 2.5 - overlap);
    let material = "material = { linear_elastic = { youngs_modulus = 1000.0, poisson_ratio = 0.0 } }";
    format!(
        "[[body]]\nname = 'slab'\nbox = {{ min = [0, 0, 0], max = [2, 1, 2], elements = [4, 2, 4] }}\n{material}\n\
         [[body]]\nname = 'block'\nbox = {{ min = [{start}, 1, 0], max = [{end}, 2, 2], elements = [4, 2, 4] }}\n{material}\n\
         [[contact]]\nslave = 'block_ymin'\nmaster = 'slab_ymax'\ntied = true\nmultiplier_shape = '{shape}'\n\
         [[dirichlet]]\nset = 'slab_ymin'\n[[load]]\nsurface = 'block_ymax'\npressure = 10.0\n\
         [load_path]\nsteps = 1\ntolerance = {{ relative = 1e-11 }}\n\
         [design]\nbodies = ['slab', 'block']\ninitial = 1.0\n[objective]\ncompliance = {{}}\n"
    )
}

/// A row of nodes whose facets overlap the master by a sliver takes hardly any force, and its multipliers
/// are of the size of the stress at the edge, not 1e5 (a sliver of 1 % of a facet) to 1e11 (1e-4) as they
/// were when bonds over slivers were rigid. The solution depends continuously on the sliver, which is
/// there or not. Gradients with respect to densities and moduli are exact.
#[test]
fn ties_over_slivers() {
    for shape in ["standard", "dual"] {
        let run = |overlap: f64| {
            let mut problem = problem(&overhanging(overlap, shape));
            let density = slipstick::design::ElementValues::from(vec![1.0; problem.initial_density().len()]);
            let run = forward(&mut problem, &density);
            let last = contact_path(&mut problem, &run).pop().unwrap();
            let largest = last.iter().flat_map(|node| node.multiplier).map(f64::abs).fold(0.0, f64::max);
            (run.value, largest)
        };
        let (none, without) = run(-1e-9);
        for (overlap, bound) in [(5e-3, 1e-2), (5e-4, 1e-3), (5e-5, 1e-4)] {
            let (value, largest) = run(overlap);
            assert!(largest < 1.2 * without, "{shape}, {overlap}: {largest} instead of {without}");
            assert!((value / none - 1.0).abs() < bound, "{shape}, {overlap}: {value} instead of {none}");
        }
        check(&format!("{shape}, a sliver"), problem(&overhanging(0.05, shape)));
        // the stiffness of partly covered nodes follows both moduli
        let text = |modulus: f64| {
            let slab = format!("youngs_modulus = {modulus:?}");
            overhanging(0.05, shape).replacen("youngs_modulus = 1000.0", &slab, 1)
        };
        let mut base = problem(&text(1000.0));
        let density = random_density(&base, 7);
        let path = forward(&mut base, &density);
        let gradient = base.analysis.response_gradients(&path, true).expect("a gradient").remove(0);
        let name = Parameter::YoungsModulus { body: 0 };
        let found = gradient.parameters.iter().find(|(other, _)| *other == name).expect("a parameter").1;
        let h = 1e-3;
        let at = |steps: f64| forward(&mut problem(&text(1000.0 * (1.0 + steps * h))), &density).value;
        let expected = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * h * 1000.0);
        assert!((found / expected - 1.0).abs() < 1e-7, "{shape}: {found} instead of {expected}");
    }
}

/// What is tied neither separates nor slides, under forces along and across the surface.
#[test]
fn a_tied_block_does_not_move_on_the_slab() {
    let scene = Scene { motion: "[{ t = 1.0, u = [0.1, 0.1, 0.05] }]".into(), ..Scene::default() };
    let mut problem = problem(&joined(&scene, "tied = true\n"));
    let density = problem.initial_density().clone();
    let run = forward(&mut problem, &density);
    for node in contact_path(&mut problem, &run).pop().unwrap() {
        assert!(node.gap.unwrap().abs() < 1e-12 && node.slip.iter().all(|s| s.abs() < 1e-12), "{node:?}");
    }
}

/// A disc tied to a block beyond whose end it reaches: nodes with little of the block opposite move, because their
/// condition is compliant, but a tie dissipates nothing.
#[test]
fn ties_do_no_friction_work() {
    let material = "material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }";
    let text = format!(
        "[[body]]\nname = 'block'\nbox = {{ min = [0, 0, 0], max = [4, 1, 2], elements = [8, 2, 4] }}\n{material}\n\
         [[body]]\nname = 'disc'\ncone = {{ height = 0.5, bottom_radius = 0.7, top_radius = 0.9, elements = [3, 2, 2] }}\n\
         place = {{ translate = [1.6, 1, 1.7] }}\n{material}\n\
         [[contact]]\nslave = 'disc_bottom'\nmaster = 'block_ymax'\ntied = true\n\
         [[dirichlet]]\nset = 'block_xmin'\n[[dirichlet]]\nset = 'disc_top'\nmotion = [{{ t = 1, u = [0.1, -0.5, 0.2] }}]\n\
         [load_path]\nsteps = 3\n"
    );
    let mut problem = problem(&text);
    let density = problem.initial_density().clone();
    let run = forward(&mut problem, &density);
    let slips = contact_path(&mut problem, &run).pop().unwrap();
    assert!(slips.iter().any(|node| node.slip[0].abs() > 1e-6), "nothing seems to slip");
    let found = slipstick::quantities::quantities(&problem, &run.path);
    assert_eq!(found.get("friction_work"), Some(vec![0.0; 4]));
    assert_eq!(found.imbalance, None);
}

/// Bodies that `check` reports as loose, in a scene of a slab and a block on it: a tie during the whole
/// path joins their rigid motions, so that the supports of both count together.
#[test]
fn ties_hold_bodies() {
    let loose = |block: &str, pair: &str, supports: &str| {
        let text = format!(
            "[[body]]\nname = 'slab'\nbox = {{ min = [0, 0, 0], max = [2, 1, 2], elements = [2, 1, 2] }}\n\
             material = {{ neo_hooke = {{ youngs_modulus = 1000.0, poisson_ratio = 0.3 }} }}\n\
             [[body]]\nname = 'block'\nbox = {{ min = [0, 1, 0], max = [2, 2, 2], elements = [1, 1, 1] }}\n{block}\n\
             [[contact]]\nslave = 'slab_ymax'\nmaster = 'block_ymin'\n{pair}\n{supports}\
             [load_path]\nsteps = 2\n"
        );
        let case = slipstick::case::parse_case(&text, "ties.toml").unwrap_or_else(|e| panic!("{e}\n{text}")).case;
        let mut problem = slipstick::build::build(&case).unwrap_or_else(|e| panic!("{e}\n{text}"));
        let notices = slipstick::check::inspect(&case, &mut problem).expect("the state at rest").notices;
        let notices = notices.into_iter().filter(|notice| notice.kind == slipstick::check::NoticeKind::LooseBody);
        notices.map(|notice| notice.path).collect::<Vec<_>>()
    };
    let solid = "material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }";
    let held = "[[dirichlet]]\nset = 'slab_ymin'\n";
    let along_y = "[[dirichlet]]\nset = 'slab_ymin'\ncomponents = ['y']\n";
    let across = "[[dirichlet]]\nset = 'block_ymax'\ncomponents = ['x', 'z']\n";
    let [slab, block] = ["body[0]", "body[1]"];
    assert!(loose(solid, "tied = true", held).is_empty());
    assert!(loose("rigid = {}", "tied = true", held).is_empty());
    assert!(loose(solid, "tied = true", &format!("{along_y}{across}")).is_empty());
    assert_eq!(loose(solid, "tied = true", along_y), [slab, block]);
    assert_eq!(loose("rigid = {}", "tied = true", along_y), [slab, block]);
    assert_eq!(loose(solid, "tied = true\nactive = [0, 0.5]", held), [block]);
    assert_eq!(loose(solid, "friction = 0.3", held), [block]);
}

/// Tied rings with different numbers of elements, turned by 90 degrees at the inner face: a rigid
/// rotation stores no energy, although the facets of the two polygons do not lie on each other.
#[test]
fn tied_rings_turn_without_stress() {
    for (order, shape) in [(1, "standard"), (2, "standard"), (1, "dual")] {
        let ring = |name: &str, inner: f64, outer: f64, around: usize| {
            format!(
                "[[body]]\nname = '{name}'\norder = {order}\n\
                 hollow_cylinder = {{ inner_radius = {inner:?}, outer_radius = {outer:?}, height = 1.0, elements = [1, {around}, 1] }}\n\
                 material = {{ neo_hooke = {{ youngs_modulus = 1000.0, poisson_ratio = 0.3 }} }}\n"
            )
        };
        let text = ring("hub", 1.0, 2.0, 12)
            + &ring("rim", 2.0, 3.0, 16)
            + &format!(
                "[[contact]]\nslave = 'rim_inner'\nmaster = 'hub_outer'\ntied = true\nmultiplier_shape = '{shape}'\n\
                 [[dirichlet]]\nset = 'hub_inner'\nrotation = {{ point = [0, 0, 0], direction = [0, 1, 0] }}\n\
                 motion = [{{ t = 1, angle = 90 }}]\n[load_path]\nsteps = 6\n"
            );
        let mut problem = problem(&text);
        let density = problem.initial_density().clone();
        let run = forward(&mut problem, &density);
        let found = slipstick::quantities::quantities(&problem, &run.path);
        let energy = *found.get("strain_energy").unwrap().last().unwrap();
        // the volume is about 25, so a strain of 1e-3 would store 1e-2
        assert!(energy.abs() < 1e-9, "order {order}, {shape}: {energy}");
    }
}

/// A coating that is thin compared with the gap between the two polygons keeps its thickness, and
/// `check` warns that the gap remains; a wide gap that is closed is reported, too. Expected volume:
/// that of the ring of trapezia, n/2 sin(2π/n) (R² − r²) h.
#[test]
fn a_tie_does_not_change_thin_bodies() {
    let text = |inner: f64, outer: f64, around: usize| {
        let ring = |name: &str, inner: f64, outer: f64, around: usize| {
            format!(
                "[[body]]\nname = '{name}'\n\
                 hollow_cylinder = {{ inner_radius = {inner:?}, outer_radius = {outer:?}, height = 1.0, elements = [1, {around}, 1] }}\n\
                 material = {{ neo_hooke = {{ youngs_modulus = 1000.0, poisson_ratio = 0.3 }} }}\n"
            )
        };
        ring("hub", 1.0, 2.0, 12)
            + &ring("rim", inner, outer, around)
            + "[[contact]]\nslave = 'rim_inner'\nmaster = 'hub_outer'\ntied = true\n\
               [[dirichlet]]\nset = 'hub_inner'\n[load_path]\nsteps = 1\n"
    };
    let notices = |text: &str| {
        let case = slipstick::case::parse_case(text, "case.toml").expect("a case").case;
        let mut problem = slipstick::build::build(&case).expect("a problem");
        let volume: f64 = problem.mesh.element_volumes()[problem.mesh.bodies[1].elements.clone()].iter().sum();
        let found = slipstick::check::inspect(&case, &mut problem).expect("an inspection").notices;
        (volume, found.into_iter().map(|notice| notice.message).collect::<Vec<_>>().join("\n"))
    };
    let (volume, messages) = notices(&text(2.0, 2.02, 16));
    let expected = 8.0 * (std::f64::consts::TAU / 16.0).sin() * (2.02_f64.powi(2) - 4.0);
    assert!((volume / expected - 1.0).abs() < 1e-9, "{volume} for {expected}");
    assert!(messages.contains("apart"), "{messages}");
    let (_, messages) = notices(&text(2.0, 3.0, 16));
    assert!(!messages.contains("apart") && !messages.contains("moved"), "{messages}");
    let (_, messages) = notices(&text(2.06, 3.0, 12));
    assert!(messages.contains("are moved by up to 0.058"), "{messages}");
}

/// Two surfaces that are tied for the first half of the path and slide in the second, with their roles
/// swapped: friction is μ times the normal force. Spans that overlap are an error, and so is the
/// same slave in both pairs.
#[test]
fn a_tie_is_followed_by_friction() {
    let text = |slave: &str, master: &str, from: f64| {
        let body = |name: &str, min: [f64; 3], max: [f64; 3], elements: [usize; 3]| {
            format!(
                "[[body]]\nname = '{name}'\nbox = {{ min = {min:?}, max = {max:?}, elements = {elements:?} }}\n\
                 material = {{ neo_hooke = {{ youngs_modulus = 1000.0, poisson_ratio = 0.3 }} }}\n"
            )
        };
        body("slab", [0.0; 3], [2.0, 1.0, 1.0], [4, 2, 2])
            + &body("block", [0.5, 1.0, 0.0], [1.5, 2.0, 1.0], [3, 2, 3])
            + &format!(
                "[[contact]]\nslave = 'block_ymin'\nmaster = 'slab_ymax'\ntied = true\nactive = [0, 0.5]\n\
                 [[contact]]\nslave = '{slave}'\nmaster = '{master}'\nfriction = 0.2\nactive = [{from:?}, 1]\n\
                 [[dirichlet]]\nset = 'slab_ymin'\n[[dirichlet]]\nset = 'block_ymax'\n\
                 motion = [{{ t = 0.5, u = [0, -0.05, 0] }}, {{ t = 1, u = [0.3, -0.05, 0] }}]\n\
                 [load_path]\nsteps = 8\n"
            )
    };
    let mut problem = problem(&text("slab_ymax", "block_ymin", 0.5));
    let density = problem.initial_density().clone();
    let run = forward(&mut problem, &density);
    let found = slipstick::quantities::quantities(&problem, &run.path);
    let last = |name: &str| *found.get(name).unwrap().last().unwrap();
    let (normal, friction) = (last("slab_ymax_normal_force"), last("slab_ymax_friction_force"));
    assert!(normal > 10.0 && (friction / normal - 0.2).abs() < 1e-9, "{friction} for {normal}");
    assert_eq!(last("block_ymin_normal_force"), 0.0);
    for (slave, master, from, cure) in [
        ("slab_ymax", "block_ymin", 0.4, "contact would be counted twice"),
        ("block_ymin", "slab_ymax", 0.5, "exchange slave and master of one of them"),
    ] {
        let errors = slipstick::case::parse_case(&text(slave, master, from), "case.toml").expect_err("twice");
        assert!(format!("{errors:?}").contains(cure), "{errors:?}");
    }
}

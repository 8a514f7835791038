//! Pressures that are not in proportion to the penetration, and penetrations that the load path resolves: forces by
//! hand, and gradients against differences.

use crate::common::scene::Scene;
use crate::common::*;
use crate::gradient::check;

/// Two unit cubes without lateral contraction, pressed together by `pressed` over a gap; E A/L = 1000 each.
fn cubes(gap: f64, pressed: f64, contact: &str) -> String {
    let mut text = format!(
        "[[contact]]\nslave = 'a_ymin'\nmaster = 'b_ymax'\nfriction = 0\n{contact}\n\
         [[dirichlet]]\nset = 'b_ymin'\n\
         [[dirichlet]]\nset = 'a_ymax'\nmotion = [{{ t = 1, u = [0, -{pressed:?}, 0] }}]\n\
         [load_path]\nsteps = 4\ntolerance = {{ relative = 1e-12 }}\n"
    );
    for (body, elements, low) in [("a", [2, 1, 2], gap), ("b", [3, 2, 1], -1.0)] {
        text += &format!(
            "[[body]]\nname = '{body}'\nbox = {{ min = [0, {low:?}, 0], max = [1, {:?}, 1], elements = {elements:?} }}\n\
             material = {{ linear_elastic = {{ youngs_modulus = 1000, poisson_ratio = 0 }} }}\n",
            low + 1.0
        );
    }
    text
}

/// The normal force after each load step.
fn forces(text: &str) -> Vec<f64> {
    let mut problem = problem(text);
    let density = problem.initial_density().clone();
    let run = forward(&mut problem, &density);
    let force =
        |nodes: Vec<slipstick::model::NodalContact>| nodes.iter().map(|at| at.multiplier[0] * at.covered_area).sum();
    contact_path(&mut problem, &run).into_iter().map(force).collect()
}

/// Two cubes of edge 1, of one stiff element each, on a soft contact of stiffness K = 1e4: forces of
/// 0.4 and 0.6 on opposite edges, that is, of 1 with a moment M of −0.1, turn the upper one by M/(K/12) = −1.2e-4 if
/// the pressure follows the gap at each point. From the gaps at the nodes, the rotation is that of springs at
/// distances that the shapes of the multipliers determine.
#[test]
fn an_eccentric_force_turns_a_facet_by_the_second_moment_of_its_area() {
    let moduli = 1e9;
    let rotation = |keys: &str| {
        let mut text = format!(
            "[[contact]]\nslave = 'a_ymin'\nmaster = 'b_ymax'\nfriction = 0\n{keys}\n\
             [[dirichlet]]\nset = 'b_ymin'\n[[dirichlet]]\nset = 'a_zmin'\ncomponents = ['z']\n\
             [[set]]\nname = 'edge'\nwithin = 'a_ymin'\nboxes = [{{ min = [-1, -1, -1], max = [1e-6, 1, 2] }}]\n\
             [[dirichlet]]\nset = 'edge'\ncomponents = ['x']\n\
             [[set]]\nname = 'left'\nwithin = 'a_ymax'\nboxes = [{{ min = [-1, -1, -1], max = [1e-6, 2, 2] }}]\n\
             [[set]]\nname = 'right'\nwithin = 'a_ymax'\nboxes = [{{ min = [0.5, -1, -1], max = [2, 2, 2] }}]\n\
             [[load]]\nsurface = 'left'\nnodal_force = [0, -0.2, 0]\n\
             [[load]]\nsurface = 'right'\nnodal_force = [0, -0.3, 0]\n\
             [load_path]\nsteps = 1\ntolerance = {{ relative = 1e-10 }}\n"
        );
        for (body, low) in [("a", 0.0), ("b", -1.0)] {
            text += &format!(
                "[[body]]\nname = '{body}'\nbox = {{ min = [0, {low:?}, 0], max = [1, {:?}, 1], elements = [1, 1, 1] }}\n\
                 material = {{ linear_elastic = {{ youngs_modulus = {moduli:?}, poisson_ratio = 0 }} }}\n",
                low + 1.0
            );
        }
        let mut problem = problem(&text);
        let density = problem.initial_density().clone();
        let run = forward(&mut problem, &density);
        let (mesh, state) = (&problem.mesh, &run.path.states.last().expect("a state").state.unknowns);
        let at = |x: f64| {
            let node = mesh.nodes.iter().position(|p| *p == [x, 1.0, 0.0]).expect("a corner of the upper cube");
            state[3 * node + 1]
        };
        at(1.0) - at(0.0)
    };
    for shape in ["standard", "dual", "mean"] {
        let keys = |more: &str| {
            format!("multiplier_shape = '{shape}'\nenforcement = {{ penalty = {{ stiffness = 1e4{more} }} }}")
        };
        let [found, nodal] = [rotation(&keys(", pressure_at = 'points'")), rotation(&keys(""))];
        println!("{shape}: {found} at points, {nodal} at nodes");
        assert!((found + 1.2e-4).abs() < 1e-4 * 1.2e-4, "{shape}: {found}");
    }
}

/// The cubes are in series with the contact: p(g) = 1000 (pressed − gap + g)/2 for the gap g, which bisection finds.
#[test]
fn soft_contact_between_cubes() {
    let exponential = |g: f64| 3.0 * 100f64.powf(-g / 0.02);
    let table = |g: f64| match -g {
        d if d < 0.005 => 1000.0 * (d + 0.002).max(0.0),
        d => (7.0 + 3000.0 * (d - 0.005)).min(22.0),
    };
    let laws: [(&dyn Fn(f64) -> f64, &str); 2] = [
        (&exponential, "exponential = { contact_pressure = 3, clearance = 0.02 }"),
        (&table, "table = { penetration = [-0.002, 0.005, 0.01], pressure = [0, 7, 22] }"),
    ];
    for (law, keys) in laws {
        for (gap, pressed) in [(0.0, 0.03), (0.01, 0.012), (0.01, 0.2)] {
            for more in ["", "scaling = 'reference_area'", "pressure_at = 'points'"] {
                let contact = format!("enforcement = {{ penalty = {{ pressure = {{ {keys} }}, {more} }} }}");
                let found = *forces(&cubes(gap, pressed, &contact)).last().expect("a step");
                let excess = |g: f64| 500.0 * (pressed - gap + g) - law(g);
                let (mut low, mut high) = (-1.0, 1.0);
                for _ in 0..80 {
                    let middle = 0.5 * (low + high);
                    if excess(middle) < 0.0 { low = middle } else { high = middle }
                }
                println!("{keys}, pressed by {pressed} over {gap}: {found}, exact {}", law(low));
                assert!((found - law(low)).abs() < 1e-7 * law(low), "{keys}: {found} instead of {}", law(low));
            }
        }
    }
}

/// Cubes that overlap by 0.04 in the mesh, of which less and less is allowed: the force rises in proportion.
#[test]
fn an_interference_is_resolved_along_the_path() {
    let contact = "offset = [{ t = 0, offset = -0.04 }, { t = 1, offset = 0 }]";
    let found = forces(&cubes(-0.04, 0.0, contact));
    for (step, force) in found.iter().enumerate() {
        let expected = 500.0 * 0.04 * (step + 1) as f64 / 4.0;
        assert!((force - expected).abs() < 1e-8, "step {step}: {force} instead of {expected}");
    }
    assert_eq!(found.len(), 4);
}

/// `contact4` of CalculiX' own decks: a block of edge ½ on the middle of one of edge 1, each of one hexahedron of 20
/// nodes, pressed by 100 with 1e7 per penetration. Expected values: CalculiX 2.20, which converges to about five digits of
/// the largest.
#[test]
fn a_quadratic_facet_presses_on_part_of_another() {
    let mut text = String::from(
        "[[contact]]\nslave = 'upper_zmin'\nmaster = 'lower_zmax'\nfriction = 0\n\
         enforcement = { penalty = { stiffness = 1e7, pressure_at = 'points' } }\n\
         [[dirichlet]]\nset = 'lower_zmin'\n[[dirichlet]]\nset = 'upper_zmax'\ncomponents = ['x', 'y']\n\
         [[load]]\nsurface = 'upper_zmax'\npressure = 100\n\
         [load_path]\nsteps = 1\ntolerance = { relative = 1e-10 }\n",
    );
    for (name, range) in
        [("lower", "min = [0, 0, 0], max = [1, 1, 1]"), ("upper", "min = [0.25, 0.25, 1], max = [0.75, 0.75, 1.5]")]
    {
        text += &format!(
            "[[body]]\nname = '{name}'\norder = 2\nshape_functions = 'serendipity'\n\
             box = {{ {range}, elements = [1, 1, 1] }}\n\
             material = {{ st_venant_kirchhoff = {{ youngs_modulus = 210000, poisson_ratio = 0 }} }}\n"
        );
    }
    let mut problem = problem(&text);
    let density = problem.initial_density().clone();
    let run = forward(&mut problem, &density);
    let state = &run.path.states.last().expect("a state").state.unknowns;
    let expected = [
        ([1.0, 0.0, 1.0], [-2.80144e-5, 2.80144e-5, -5.47502e-5]),
        ([1.0, 0.5, 1.0], [-2.80119e-5, 0.0, -1.02992e-4]),
        ([0.75, 0.75, 1.0], [5.149e-6, 5.149e-6, -1.40056e-4]),
        ([0.75, 0.5, 1.0], [5.14925e-6, 0.0, -1.49909e-4]),
        ([0.75, 0.5, 1.5], [0.0, 0.0, -3.92717e-4]),
    ];
    for (place, values) in expected {
        let node = problem.mesh.nodes.iter().position(|p| *p == place).expect("a node");
        for c in 0..3 {
            let (found, value) = (state[3 * node + c], values[c]);
            assert!((found - value).abs() < 2e-5 * 3.92717e-4, "{place:?}, {c}: {found} instead of {value}");
        }
    }
}

/// With sticking, slipping and opening, for both laws and shapes of multipliers, and with the automatic stiffness of
/// sticking, which depends on the moduli.
#[test]
fn gradients_of_soft_contact() {
    let motions = [
        (3.0, "[{ t = 0.5, u = [0, -0.1, 0] }, { t = 1.0, u = [0.03, -0.1, 0.01] }]"),
        (
            0.3,
            "[{ t = 0.3, u = [0.02, -0.08, 0.01] }, { t = 0.5, u = [0.05, 0.04, 0] }, { t = 1.0, u = [0.2, -0.1, 0.05] }]",
        ),
    ];
    let laws = [
        "exponential = { contact_pressure = 20, clearance = 0.03 }",
        "table = { penetration = [-0.011, 0.013, 0.06], pressure = [0, 30, 400] }",
    ];
    for (law, (friction, motion)) in laws.into_iter().flat_map(|law| motions.map(|motion| (law, motion))) {
        for (shape, stiffness) in [
            ("standard", ", stiffness = 2e4"),
            ("dual", ", stiffness = 2e4"),
            ("dual", ""),
            ("standard", ", stiffness = 2e4, pressure_at = 'points'"),
            ("dual", ", pressure_at = 'points'"),
        ] {
            let enforcement = format!("{{ penalty = {{ pressure = {{ {law} }}{stiffness} }} }}");
            let scene = Scene { enforcement, shape, friction, motion: motion.into(), ..Scene::default() };
            check(&format!("{law} {shape} {friction}"), &mut problem(&scene.text()), 7);
        }
    }
    // quadratic faces, with closed gaps
    for (friction, motion) in motions {
        let enforcement = "{ penalty = { stiffness = 2e4, pressure_at = 'points' } }\nadjust = { gap = 0.01 }".into();
        let scene = Scene { enforcement, friction, motion: motion.into(), ..Scene::default() };
        let text = scene.text().replace("[[body]]", "[[body]]\norder = 2");
        check(&format!("second order, {friction}"), &mut problem(&text), 7);
    }
}

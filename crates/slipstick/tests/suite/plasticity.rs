//! Plasticity in the whole path: gradients through loading, unloading and reloading with friction, for all
//! methods and elements, and the energy balance.

use crate::common::scene::{LAGRANGE, Scene, augmented, penalty, three_bodies};
use crate::common::{forward, problem, problem_with};
use crate::quantity_gradients::check;
use slipstick::quantities::quantities;
use slipstick_linalg::Alone;
use slipstick_mesh::{BoxShape, box_mesh};
use slipstick_path::{MarchEvent, MarchObserver, StepState};

/// A text with plastic bodies in place of elastic ones of E = 1000.
fn plastic(text: &str, material: &str) -> String {
    let elastic = "{ neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }";
    assert!(text.contains(elastic));
    text.replace(elastic, material)
}

const LINEAR: &str =
    "{ j2_linear = { youngs_modulus = 1000, poisson_ratio = 0.3, yield_stress = 20, hardening_modulus = 150 } }";
const VOCE: &str = "{ j2_voce = { youngs_modulus = 1000, poisson_ratio = 0.3, yield_stress = 20, saturation_stress = 45, \
                    saturation_rate = 15, hardening_modulus = 30 } }";

const SWIFT: &str = "{ j2_swift = { youngs_modulus = 1000, poisson_ratio = 0.3, yield_stress = 20, reference_strain = 0.01, \
                     hardening_exponent = 0.3 } }";

/// Pressed, lifted, and pressed again with sliding.
fn scene() -> Scene {
    Scene {
        slab: [3, 1, 1],
        block: [1, 1, 1],
        friction: 0.35,
        motion: "[{ t = 0.4, u = [0, -0.12, 0] }, { t = 0.6, u = [0.004, -0.112, 0] }, { t = 1.0, u = [0.12, -0.16, 0.03] }]"
            .into(),
        steps: 5,
        design: "yield_p = 2.5".into(),
        ..Scene::default()
    }
}

/// Interpolated energies, with densities below, in and above the range of γ.
const INTERPOLATED: &str = "yield_p = 2.5\nenergy_interpolation = { threshold = 0.2, sharpness = 3 }";

/// Every quantity by random directions in the design, all methods and smooth hardening laws, also with interpolated
/// energies.
#[test]
fn gradients_through_plastic_states() {
    let methods = [
        ("Lagrange", LAGRANGE.to_owned(), ""),
        ("penalty", penalty(2e4), ""),
        ("augmented", augmented(1e4, 1e-11), ""),
        ("penalty, interpolated", penalty(2e4), INTERPOLATED),
    ];
    for ((method, enforcement, design), material) in methods.into_iter().zip([LINEAR, VOCE, SWIFT, LINEAR]) {
        let scene = scene();
        let design = if design.is_empty() { scene.design.clone() } else { design.into() };
        let text = plastic(&Scene { enforcement, design, ..scene }.text(), material);
        let mut problem = problem(&text);
        let errors = check(&format!("plastic {method}"), &mut problem, 3, &[1.0]);
        assert!(errors.iter().any(|(name, _)| name == "plastic strain"));
        // the steps do cause flow, and some of them do not
        let density = crate::common::random_density(&problem, 3);
        let run = forward(&mut problem, &density);
        let model = problem.analysis.model().clone();
        let largest = |index: usize| {
            let history = &run.path.states[index].state.history;
            let solid = &history[history.len() - model.solid().history()..];
            let strains = model.solid().plastic_strains(solid);
            strains.as_flattened().iter().copied().fold(0.0, f64::max)
        };
        assert!(largest(run.path.states.len() - 1) > 0.02, "{}", largest(run.path.states.len() - 1));
    }
}

/// Other elements and formulations; every second hexahedron of the slab is divided into tetrahedra.
#[test]
fn gradients_of_all_elements() {
    let divided = |name: &str, min: [f64; 3], max: [f64; 3], elements: [usize; 3], every: usize| {
        let shape = BoxShape { min, max, elements, grading: [1.0; 3] };
        box_mesh(name, &shape).expect("a mesh").divided(|element| element % every == 0)
    };
    let slab = divided("slab", [0.0; 3], [4.0, 1.0, 1.0], [3, 1, 1], 2);
    let block = divided("block", [0.6, 1.0, 0.1], [1.4, 1.8, 0.9], [1; 3], 1);
    let wedges = |name: &str, min: [f64; 3], max: [f64; 3], elements: [usize; 3]| {
        let shape = BoxShape { min, max, elements, grading: [1.0; 3] };
        box_mesh(name, &shape).expect("a mesh").divided_into_wedges(|_| Some(1))
    };
    let tetrahedra = [("slab", slab), ("block", block)];
    let wedges = [
        ("slab", wedges("slab", [0.0; 3], [4.0, 1.0, 1.0], [3, 1, 1])),
        ("block", wedges("block", [0.6, 1.0, 0.1], [1.4, 1.8, 0.9], [1; 3])),
    ];
    for (name, keys, files) in [
        ("f_bar", "element = \"f_bar\"\n", None),
        ("f_bar, interpolated", "element = \"f_bar\"\n", None),
        ("hex27", "order = 2\nelement = \"f_bar\"\n", None),
        ("tet4", "", Some(&tetrahedra)),
        ("tet10", "order = 2\n", Some(&tetrahedra)),
        ("wedge18", "order = 2\n", Some(&wedges)),
        ("wedge18 with F̄", "order = 2\nelement = \"f_bar\"\n", Some(&wedges)),
    ] {
        let mut text = plastic(&scene().text(), LINEAR).replace("place = {}\n", keys);
        if name.ends_with("interpolated") {
            text = text.replace("yield_p = 2.5", INTERPOLATED);
        }
        for name in ["slab", "block"].into_iter().filter(|_| files.is_some()) {
            let start = text.find("box = ").expect("a box");
            let end = start + text[start..].find('\n').expect("a line");
            text.replace_range(start..end, &format!("mesh = {{ file = '{name}' }}"));
        }
        let files = files.map_or(&[][..], |files| &files[..]);
        check(&format!("plastic {name}"), &mut problem_with(&text, files), 5, &[1.0]);
    }
}

/// External work is stored, or taken by plastic flow and friction: the balance of a fine path closes.
#[test]
fn the_energy_balance_closes() {
    let text = plastic(&Scene { steps: 80, ..scene() }.text(), LINEAR);
    let mut problem = problem(&text);
    let density = vec![1.0; problem.mesh.elements.len()].into();
    let run = forward(&mut problem, &density);
    let found = quantities(&problem, &run.path);
    let last = |name: &str| *found.get(name).unwrap().last().unwrap();
    let (work, plastic, balance) = (last("external_work"), last("plastic_work"), last("energy_balance"));
    assert!(plastic > 0.3 * work, "{plastic} {work}");
    assert!(balance.abs() < 0.02 * work, "{balance} {work}");
}

/// What has no meaning for plastic bodies, or only for them, is refused with its place and a cure.
#[test]
fn keys_that_do_not_fit_are_refused() {
    let refused = |text: &str| match slipstick::case::parse_case(text, "case.toml") {
        Err(errors) => errors.to_string(),
        Ok(resolved) => slipstick::build::build(&resolved.case).err().expect("an error").to_string(),
    };
    let text = plastic(&scene().text(), LINEAR);
    assert!(refused(&text.replace("min = 1e-3", "min = 0")).contains("set simp.min, usually to 1e-3"));
    assert!(refused(&scene().text()).contains("no design body has a law with a yield stress"));
    let strain = "[[quantity]]\nname = 'strain'\nplastic_strain = {}\n";
    let elastic = scene().text().replace("yield_p = 2.5", "") + strain;
    assert!(refused(&elastic).contains("no element here has a law with plastic strain"));
}

/// Histories that are not kept are computed again, bit for bit: with room for eight of 24, every quantity and
/// its gradient are the same, for plastic bodies pressed together by a penalty and for a body that only
/// contact holds.
#[test]
fn histories_are_the_same_when_computed_again() {
    let plastic = plastic(&Scene { enforcement: penalty(2e4), steps: 24, ..scene() }.text(), LINEAR);
    let free = three_bodies(&penalty(2e4), &penalty(1e4));
    for text in [plastic, free] {
        let run = |memory: usize| {
            let mut problem = problem(&text);
            problem.analysis.march.memory = memory;
            let density = crate::common::random_density(&problem, 3);
            let run = forward(&mut problem, &density);
            let gradients = problem.analysis.response_gradients(&run, true).expect("gradients");
            let kept = run.path.states.iter().filter(|state| !state.state.history.is_empty()).count();
            let found = quantities(&problem, &run.path);
            let middle = run.path.state(run.path.states.len() / 2, &Alone);
            (kept, run.path.states.len(), gradients, format!("{found:?} {:?}", middle.history))
        };
        let (all, states, gradients, values) = run(usize::MAX);
        let (kept, _, again, values_again) = run(0);
        assert_eq!(all, states);
        assert!(kept <= 8 && kept < states, "{kept} of {states}");
        assert_eq!(format!("{gradients:?}"), format!("{again:?}"));
        assert_eq!(values, values_again);
    }
}

/// Observers see a load case that runs beside the first only once it is complete, and they see all of its
/// histories, also those that are not kept: the files of a path are written from them.
#[test]
fn observers_see_histories_that_are_not_kept() {
    #[derive(Default)]
    struct Seen(Vec<StepState>);
    impl MarchObserver for Seen {
        fn on_event(&mut self, event: &MarchEvent<'_>) {
            if let MarchEvent::Accepted { state: at, .. } = event {
                self.0.push(at.state.clone());
            }
        }
    }
    let cases = "[[load_case]]\nname = 'soft'\n[[load_case]]\nname = 'stiff'\nmodulus_factor = 1.2\n";
    let scene = Scene { enforcement: penalty(2e4), steps: 24, more: cases.into(), ..scene() };
    let text = plastic(&scene.text(), LINEAR);
    let run = |threads: usize, memory: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut problem = problem(&text);
        problem.analysis.march.memory = memory;
        let (density, mut seen) = (problem.initial_density().clone(), Seen::default());
        let run = pool.install(|| problem.analysis.forward(&density, &mut seen)).expect("a path");
        let kept = run.path.states.iter().filter(|state| !state.state.history.is_empty()).count();
        (kept, seen.0)
    };
    let (all, seen) = run(1, usize::MAX);
    let (kept, again) = run(2, 0);
    assert!(kept < all, "{kept} of {all}");
    assert_eq!(seen.len(), 48);
    assert_eq!(again, seen);
}

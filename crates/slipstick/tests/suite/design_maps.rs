//! Density filter, projection, ties, overhang filter and schedules in the optimization loop.

mod shaping;

use crate::common::optimization::{finish, finish_in_pieces};
use crate::common::problem;
use slipstick::case::template;
use slipstick::design::{ElementValues, MapParameter, VariableValues};
use slipstick::optimize::Optimization;
use slipstick::verify::{Verdict, VerifyOptions, verify_gradient, verify_variables};
use slipstick_path::Silent;

/// Filter and projection of most tests.
const MAPS: &str = "density_filter = { radius = 1.3 }\nprojection = { sharpness = 4.0, threshold = 0.45 }";

/// The cube on a finer cuboid, with passive elements, a bound on a force and one on the volume.
fn text(maps: &str, optimizer: &str) -> String {
    let text = template("cube-on-cuboid").expect("a template").text;
    let (before, _) = text.split_once("[design]").expect("a design");
    let before = before.replace("elements = [4, 1, 1]", "elements = [6, 2, 2]").replace("steps = 10", "steps = 4");
    let bodies = if maps.contains("bodies =") { "" } else { "bodies = ['cuboid', 'cube']\n" };
    format!(
        "{before}
[design]
{bodies}volume_fraction = 0.6
{maps}
passive_solid = [{{ min = [0.6, 0.5, 0], max = [1.4, 1, 0.5] }}]
passive_void = [{{ min = [3.4, 0, 0], max = [4, 0.5, 0.5] }}]
[[quantity]]
name = 'push'
reaction = {{ set = 'cuboid_ymin', component = 'y' }}
[objective]
contact_force = {{ steps = 'all' }}
[[constraint]]
quantity = 'push'
max = 30.0
[optimizer]
{optimizer}
"
    )
}

fn prepared(maps: &str, optimizer: &str) -> Optimization {
    crate::common::optimization::prepared(&text(maps, optimizer))
}

/// Variables that differ from element to element.
fn uneven(count: usize) -> VariableValues {
    (0..count).map(|k| 0.3 + 0.5 * (0.618_033_988_749_894_9 * (k + 1) as f64).fract()).collect()
}

/// Gradients of all functions with respect to the variables as the optimizer received them, without
/// their scales: parts of the objective, then constraints.
fn received(optimization: &Optimization) -> Vec<Vec<f64>> {
    let state = serde_json::to_value(&optimization.state).unwrap();
    let numbers = |value: &serde_json::Value| serde_json::from_value::<Vec<f64>>(value.clone()).unwrap();
    let approximations = &state["gcmma"]["approximations"];
    let scaling = optimization.state.scaling.clone().unwrap();
    let parts = optimization.state.parts.len();
    let constraints = approximations["constraint_gradients"].as_array().unwrap().iter().map(numbers);
    // with several parts, the objective itself is 0
    let objective = (parts == 0).then(|| numbers(&approximations["objective_gradient"]));
    let factors = std::iter::repeat_n(scaling.objective(), parts.max(1)).chain(scaling.constraints());
    let all = objective.into_iter().chain(constraints).zip(factors);
    all.map(|(gradient, factor)| gradient.into_iter().map(|g| g / factor).collect()).collect()
}

/// Compares gradients with differences of order 4 of the functions, for every fourth variable.
fn compare(x: &VariableValues, gradients: &[Vec<f64>], mut values: impl FnMut(&VariableValues) -> Vec<f64>) {
    let (mut worst, mut entries) = (vec![0.0_f64; gradients.len()], 0);
    for entry in (0..x.len()).step_by(4) {
        let differences = [2e-3, 1e-3].map(|step| {
            let mut at = |sign: f64| {
                let mut moved = x.clone();
                moved[entry] += sign * step;
                values(&moved)
            };
            let (ahead, behind) = (at(1.0), at(-1.0));
            ahead.iter().zip(&behind).map(|(a, b)| (a - b) / (2.0 * step)).collect::<Vec<f64>>()
        });
        assert_eq!(differences[0].len(), gradients.len());
        for (of, gradient) in gradients.iter().enumerate() {
            // extrapolated to order 4
            let difference = (4.0 * differences[1][of] - differences[0][of]) / 3.0;
            let size = gradient.iter().fold(0.0_f64, |size, g| size.max(g.abs()));
            worst[of] = worst[of].max((difference - gradient[entry]).abs() / size);
        }
        entries += 1;
    }
    println!("{entries} entries, largest errors {worst:?}");
    assert!(entries > 5 && worst.iter().all(|error| *error < 1e-7), "{worst:?}");
}

/// The optimizer receives the derivatives of objective, volume and constraint with respect to the
/// variables: they agree with differences over the whole chain, analysis included.
#[test]
fn the_optimizer_gets_the_derivatives_with_respect_to_the_variables() {
    let mut optimization = prepared(MAPS, "iterations = 1\nmethod = 'gcmma'");
    optimization.state.x = uneven(optimization.state.x.len());
    let x = optimization.state.x.clone();
    optimization.advance(&mut Silent).unwrap();
    let gradients = received(&optimization);
    let map = optimization.map().clone();
    let volume = volume_fraction(&optimization);
    compare(&x, &gradients, |x| {
        let density: ElementValues = map.densities(x);
        let forward = optimization.problem.analysis.forward(&density, &mut Silent).unwrap();
        vec![forward.value, volume(&density) / 0.6 - 1.0, forward.constraints[0] / 30.0 - 1.0]
    });
}

/// The same of an eroded, the nominal and a dilated design: three parts of the objective, the volume
/// of the dilated design, and a constraint on each.
#[test]
fn the_optimizer_gets_the_derivatives_of_three_realisations() {
    let maps = "minimum_thickness = 1.1\nprojection = { sharpness = 4.0 }";
    let mut optimization = prepared(maps, "iterations = 1\nmethod = 'gcmma'");
    optimization.state.x = uneven(optimization.state.x.len());
    let x = optimization.state.x.clone();
    optimization.advance(&mut Silent).unwrap();
    let gradients = received(&optimization);
    let maps = [0.5, 0.75, 0.25].map(|threshold| optimization.map().with(MapParameter::Threshold, threshold).unwrap());
    let limit = optimization.state.dilated_limit.unwrap();
    let volume = volume_fraction(&optimization);
    let [nominal, _, dilated] = maps.each_ref().map(|map| volume(&map.densities(&x)));
    assert!((limit / 0.6 - dilated / nominal).abs() < 1e-12);
    compare(&x, &gradients, |x| {
        let densities = maps.each_ref().map(|map| map.densities(x));
        let forwards = densities.each_ref().map(|density| {
            let forward = optimization.problem.analysis.forward(density, &mut Silent).unwrap();
            (forward.value, forward.constraints[0] / 30.0 - 1.0)
        });
        let parts = forwards.iter().map(|(value, _)| *value);
        let constraints = forwards.iter().map(|(_, constraint)| *constraint);
        parts.chain([volume(&densities[2]) / limit - 1.0]).chain(constraints).collect()
    });
}

/// The solid fraction of the design domain.
fn volume_fraction(optimization: &Optimization) -> impl Fn(&ElementValues) -> f64 + use<> {
    let variables = optimization.map().variables().clone();
    let volumes = variables.domain_volumes(&optimization.problem.mesh.element_volumes()).unwrap();
    move |density| {
        let domain = variables.on_domain(density);
        let solid: f64 = domain.iter().zip(&volumes).map(|(density, volume)| density * volume).sum();
        solid / volumes.iter().sum::<f64>()
    }
}

/// Checks the gradient with respect to the variables along a direction and at two elements; returns
/// its norm, that of the gradient with respect to the densities, and the largest error.
fn verified(maps: &str) -> [f64; 3] {
    let mut problem = problem(&text(maps, "iterations = 1"));
    let map = problem.map().unwrap().clone();
    let x = uneven(map.variables().count());
    let options = VerifyOptions { directions: 1, elements: 2, ..VerifyOptions::default() };
    let check = verify_variables(&mut problem.analysis, &map, &x, &options, &mut Silent).unwrap();
    assert_eq!(check.count(Verdict::Right), 3, "{maps}\n{check:#?}");
    let (at, designed) = (map.densities(&x), map.variables().designed());
    let by_densities = verify_gradient(&mut problem.analysis, &at, designed, &options, &mut Silent).unwrap();
    [check.gradient_norm, by_densities.gradient_norm, check.worst.unwrap()]
}

/// `verify gradient` compares derivatives with respect to the variables.
#[test]
fn verification_varies_the_variables() {
    for maps in [MAPS, "density_filter = { radius = 0.9, boundary = 'void' }", "projection = { sharpness = 6 }"] {
        let [norm, by_densities, _] = verified(maps);
        assert!((by_densities / norm - 1.0).abs() > 0.05);
    }
}

/// Ties and the overhang filter, alone and after filter and projection, have exact derivatives.
#[test]
fn tied_and_printed_designs_have_exact_gradients() {
    let filtered = "density_filter = { radius = 1.3 }\nprojection = { sharpness = 4.0, threshold = 0.45 }";
    let turned = "symmetry = [{ axis = 'y', through = [2, 0, 0.5], folds = 2 }]\nbodies = ['cuboid']";
    let repeated = "pattern = [{ step = [0, 0, 0.5], count = 2 }]\nextrude = 'x'\nbodies = ['cuboid']";
    let printed = "overhang = { direction = 'y' }";
    for maps in
        ["", filtered, &format!("projection = {{ sharpness = 2 }}\n{printed}"), &format!("{filtered}\n{printed}")]
    {
        for ties in ["symmetry = [{ normal = 'z', at = 0.5 }]\nextrude = 'z'", turned, repeated] {
            let [_, _, worst] = verified(&format!("{maps}\n{ties}"));
            println!("{worst:.1e}: {maps} {ties}");
        }
    }
}

/// With exact gradients, GCMMA's approximations are conservative after a few attempts.
#[test]
fn gcmma_descends_with_filter_and_projection() {
    let history = finish(&mut prepared(MAPS, "iterations = 6\nmethod = 'gcmma'\nmma = { move_limit = 0.3 }"));
    let inner = history.iter().map(|record| record.inner_iterations).max();
    assert!(inner < Some(10), "{history:?}");
    for pair in history.windows(2) {
        let allowed = pair[0].objective + 1e-6 * pair[0].objective.abs();
        assert!(pair[0].violation > 1e-6 || pair[1].objective <= allowed, "{history:?}");
    }
    assert!(history.last().unwrap().objective < history[0].objective);
}

#[test]
fn the_start_has_the_initial_density_and_passive_elements_keep_theirs() {
    let optimization =
        prepared("density_filter = { radius = 0.3 }\nprojection = { threshold = 0.4 }", "iterations = 1");
    // no element has a neighbour
    let density = optimization.density();
    let variables = optimization.map().variables();
    assert!(variables.designed().iter().all(|&e| (density[e as usize] - 0.6).abs() < 1e-12));
    assert!(optimization.state.x.iter().all(|x| (x - 0.6).abs() > 0.05));
    let blurred = prepared(MAPS, "iterations = 1").density();
    let fixed = |value: f64| blurred.iter().filter(|density| **density == value).count();
    assert_eq!([fixed(1.0), fixed(0.0)], [1, 1]);
}

const SCHEDULE: &str = "mma = { move_limit = 0.2 }
schedule = { sharpness = [[0, 1], [2, 4], [5, 8]], p = [[0, 2], [3, 3]], move_limit = [[4, 0.05]] }";

const BOUNDS: &str = "mma = { move_limit = 0.2 }
schedule = { filter_radius = [[0, 1.6], [2, 1.3], [5, 0.9]], volume_fraction = [[0, 0.7], [3, 0.65], [4, 0.6]] }";

/// After every iteration, a scheduled optimization continues bit for bit from its written state.
#[test]
fn a_schedule_continues_bit_for_bit() {
    for (method, schedule) in [("mma", SCHEDULE), ("gcmma", SCHEDULE), ("mma", BOUNDS), ("gcmma", BOUNDS)] {
        let optimizer = format!("iterations = 7\nmethod = '{method}'\n{schedule}");
        let mut all = prepared(MAPS, &optimizer);
        let whole = finish(&mut all);
        assert_eq!(whole.len(), 8);
        let last = finish_in_pieces(&text(MAPS, &optimizer), whole.len());
        assert_eq!(last.history, whole);
        assert_eq!((last.x, last.optimizer), (all.state.x.clone(), all.state.optimizer.clone()));
    }
}

/// A change of sharpness or exponent restarts the asymptotes, and the design after it is not
/// compared with the one before; a change of the move limit only shortens the steps.
#[test]
fn changes_of_the_functions_restart_the_optimizer() {
    // whether all asymptotes are half a range away on both sides, after each update
    let advance = |optimization: &mut Optimization| -> Vec<bool> {
        let mut fresh = Vec::new();
        while !optimization.finished() {
            optimization.advance(&mut Silent).unwrap();
            let (low, upp) = optimization.state.optimizer.memory().asymptotes();
            fresh.push(low.iter().zip(upp).all(|(low, upp)| (upp - low - 1.0).abs() < 1e-12));
        }
        fresh
    };
    let mut optimization = prepared(MAPS, &format!("iterations = 7\nmethod = 'gcmma'\n{SCHEDULE}"));
    // for two updates from the start, and from each of the restarts at 2, 3 and 5
    assert_eq!(advance(&mut optimization)[..7], [true; 7]);
    let mut unscheduled = prepared(MAPS, "iterations = 7\nmethod = 'gcmma'\nmma = { move_limit = 0.2 }");
    assert_eq!(advance(&mut unscheduled)[..7], [true, true, false, false, false, false, false]);
    let history = &optimization.state.history;
    for restarted in [2, 3, 5] {
        assert_eq!(history[restarted].inner_iterations, 0, "{history:?}");
    }
    assert!(history[4..7].iter().all(|record| record.change.unwrap() <= 0.05 + 1e-12));
    assert!(history[..4].iter().any(|record| record.change.unwrap() > 0.1));
    let without = finish(&mut prepared(MAPS, "iterations = 3\nmma = { move_limit = 0.2 }"));
    assert!(
        (without[0].objective / history[0].objective - 1.0).abs() > 1e-3,
        "the exponent is scheduled from the start"
    );
}

/// A change of the filter radius restarts the asymptotes; a change of the bound on the volume does
/// not, but it changes the constraint, and the design after it is not compared with the one before.
#[test]
fn bounds_change_only_their_constraint() {
    let mut optimization = prepared(MAPS, &format!("iterations = 7\nmethod = 'gcmma'\n{BOUNDS}"));
    let mut fresh = Vec::new();
    while !optimization.finished() {
        optimization.advance(&mut Silent).unwrap();
        let (low, upp) = optimization.state.optimizer.memory().asymptotes();
        fresh.push(low.iter().zip(upp).all(|(low, upp)| (upp - low - 1.0).abs() < 1e-12));
    }
    // two updates from the start and from each change of the radius
    assert_eq!(fresh[..7], [true, true, true, true, false, true, true]);
    let history = &optimization.state.history;
    for (record, limit) in history.iter().zip([0.7, 0.7, 0.7, 0.65, 0.6, 0.6, 0.6, 0.6]) {
        let volume = record.volume_fraction / limit - 1.0;
        let push = record.constraints[1].value / 30.0 - 1.0;
        assert!((record.violation - volume.max(push).max(0.0)).abs() < 1e-12, "{record:?}");
    }
    assert!([2, 3, 4, 5].iter().all(|&changed: &usize| history[changed].inner_iterations == 0), "{history:?}");
    assert_eq!(optimization.volume_limit(), Some(0.6));
}

#[test]
fn criteria_apply_after_the_schedule() {
    let ends = |criteria: &str| {
        let schedule = "schedule = { sharpness = [[0, 1], [3, 2]] }";
        finish(&mut prepared(MAPS, &format!("iterations = 6\n{schedule}\n{criteria}"))).len()
    };
    assert_eq!(ends(""), 7);
    // met from the start on: the design after the update of iteration 3 is the last
    assert_eq!([ends("tolerance = 1.0"), ends("optimality = 1e9"), ends("discreteness = 0.999")], [5; 3]);
    assert_eq!([ends("tolerance = 1.0\noptimality = 1e-9"), ends("tolerance = 1.0\ndiscreteness = 1e-4")], [7; 2]);
}

/// Void weakens elements at free faces, but not those at the support below and the contact above.
#[test]
fn void_lies_beyond_free_faces_only() {
    let text = text("density_filter = { radius = 0.45, boundary = 'void' }", "iterations = 1")
        .replace("elements = [6, 2, 2]", "elements = [8, 3, 5]")
        .replace("bodies = ['cuboid', 'cube']", "bodies = ['cuboid']");
    let text: Vec<&str> = text.lines().filter(|line| !line.starts_with("passive")).collect();
    let mut problem = problem(&text.join("\n"));
    problem.start_from(&vec![1.0; problem.mesh.elements.len()].into());
    let centroids = problem.mesh.centroids();
    let mut full = [0, 0];
    for element in problem.mesh.bodies[0].elements.clone() {
        let [x, y, z] = centroids[element];
        let density = problem.initial_density()[element];
        let depth = x.min(4.0 - x).min(z).min(1.0 - z);
        assert!(if depth > 0.45 { density == 1.0 } else { density < 0.99 }, "{x} {y} {z}: {density}");
        full[0] += usize::from(density == 1.0 && y < 0.3);
        full[1] += usize::from(density == 1.0 && y > 0.7);
    }
    assert_eq!(full, [6, 6]);
}

/// Eroded and dilated designs with the nominal one: the objective is the worst of them, the shares
/// add up to 1, the nominal design keeps its volume, and the run continues bit for bit from its
/// written state, on one thread and on three.
#[test]
fn three_realisations() {
    let maps = "minimum_thickness = 1.1\nprojection = { sharpness = 6.0 }";
    for method in ["mma", "gcmma"] {
        let text = text(maps, &format!("iterations = 10\nmethod = '{method}'\nmma = {{ move_limit = 0.1 }}"));
        // its bound would have to hold for the dilated design too
        let text = text.replace("[[constraint]]\nquantity = 'push'\nmax = 30.0\n", "");
        let mut all = crate::common::optimization::prepared(&text);
        assert_eq!(
            (all.realisations(), &all.state.parts[..]),
            (3, &["nominal", "eroded", "dilated"].map(str::to_owned)[..])
        );
        let whole = finish(&mut all);
        for record in &whole {
            let values: Vec<f64> = record.parts.iter().map(|part| part.value).collect();
            assert_eq!(record.objective, values.iter().copied().fold(f64::NEG_INFINITY, f64::max));
            // less material carries less
            assert!(values[1] > values[0] && values[0] > values[2], "{values:?}");
        }
        let shares: Vec<f64> = whole[3].parts.iter().filter_map(|part| part.multiplier).collect();
        assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-5 && shares[1] > 0.99, "{shares:?}");
        assert!(whole.last().unwrap().objective < whole[0].objective);
        assert!(whole.last().unwrap().violation < 0.01, "{whole:?}");
        let pool = rayon::ThreadPoolBuilder::new().num_threads(if method == "mma" { 1 } else { 3 }).build().unwrap();
        let last = pool.install(|| finish_in_pieces(&text, whole.len()));
        assert_eq!(last.history, whole);
        assert_eq!((last.x, last.dilated_limit), (all.state.x.clone(), all.state.dilated_limit));
    }
}

/// A pair of mirrored load cases, of which the worst counts: both have the same value, and half of
/// the multiplier, as long as the design is symmetric.
#[test]
fn the_worst_of_mirrored_load_cases() {
    let scene = crate::common::scene::Scene {
        corner: [1.6, 1.0, 0.1],
        motion: "[{ t = 0.5, u = [0, -0.1, 0] }, { t = 1.0, u = [0.1, -0.1, 0] }]".into(),
        drive: "load_case = 'right'".into(),
        design: "volume_fraction = 0.5\ndensity_filter = { radius = 1.3 }\nprojection = {}".into(),
        more: "[[dirichlet]]\nset = 'block_ymax'\nload_case = 'left'\n\
               motion = [{ t = 0.5, u = [0, -0.1, 0] }, { t = 1.0, u = [-0.1, -0.1, 0] }]\n\
               [[load_case]]\nname = 'right'\n[[load_case]]\nname = 'left'\n[optimizer]\niterations = 5\n"
            .into(),
        ..crate::common::scene::Scene::default()
    };
    let text = scene.text().replace("steps = \"last\" }", "steps = \"last\" }\nload_cases = 'worst'");
    let mut optimization = crate::common::optimization::prepared(&text);
    assert_eq!(optimization.state.parts, ["right", "left"]);
    let history = finish(&mut optimization);
    for record in &history[..5] {
        let [right, left] = record.parts[..] else { panic!("{record:?}") };
        assert!((right.value / left.value - 1.0).abs() < 1e-6, "{record:?}");
        let shares = [right, left].map(|part| part.multiplier.unwrap());
        assert!(shares.iter().all(|share| (share - 0.5).abs() < 1e-3), "{shares:?}");
    }
    assert!(history[5].objective < history[0].objective);
    let gradient = optimization.evaluated().unwrap().gradient.clone();
    assert!(gradient.is_none(), "the last design needs none");
}

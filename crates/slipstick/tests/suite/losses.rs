//! Work that contact takes without a mechanism, against the energy balance of the bodies, which reactions and
//! strain energies give without it.

use slipstick::losses::LostWork;
use slipstick::quantities::{Quantities, quantities};
use slipstick_path::Silent;

/// A block on a plane-strain strip; `motion` of its top, and the contact table's further keys.
fn pressed(low: &str, up: &str, motion: &str, keys: &str) -> Quantities {
    pressed_in_steps(low, up, motion, keys, 20)
}

/// The same in a number of load steps.
fn pressed_in_steps(low: &str, up: &str, motion: &str, keys: &str, steps: usize) -> Quantities {
    let text = format!(
        "[[body]]\nname = 'low'\nbox = {low}\nmaterial = {{ neo_hooke = {{ youngs_modulus = 10.0, poisson_ratio = 0.3 }} }}\n\
         [[body]]\nname = 'up'\nbox = {up}\nmaterial = {{ neo_hooke = {{ youngs_modulus = 1000.0, poisson_ratio = 0.3 }} }}\n\
         [[contact]]\nslave = 'up_ymin'\nmaster = 'low_ymax'\n{keys}\n\
         [[dirichlet]]\nset = 'low_ymin'\n[[dirichlet]]\nset = 'low_zmin'\ncomponents = ['z']\n\
         [[dirichlet]]\nset = 'low_zmax'\ncomponents = ['z']\n\
         [[dirichlet]]\nset = 'up_ymax'\nmotion = {motion}\n[load_path]\nsteps = {steps}\n"
    );
    let mut problem = crate::common::problem(&text);
    let density = problem.initial_density().clone();
    let forward = problem.analysis.forward(&density, &mut Silent).unwrap_or_else(|e| panic!("{e}"));
    quantities(&problem, &forward.path)
}

const LONG: &str = "{ min = [0, 0, 0], max = [3, 1, 0.5], elements = [9, 3, 1] }";

/// The edge of a stiff block at x = 0.9 digs into a strip and is dragged along it, with averaged normals: without
/// friction, the external work would be stored. What is missing is lost by contact, at the edge.
#[test]
fn an_edge_that_digs_in_loses_work() {
    let up = "{ min = [-0.5, 1, 0], max = [0.9, 2, 0.5], elements = [4, 3, 1] }";
    let motion = "[{ t = 0.5, u = [0, -0.3, 0] }, { t = 1, u = [0.5, -0.3, 0] }]";
    for keys in ["friction = 0.0", "friction = 0.0\nmultiplier_shape = 'dual'"] {
        let found = pressed(LONG, up, motion, &format!("{keys}\nnormals = 'averaged'"));
        let [loss] = &found.losses[..] else { panic!("{:?}", found.losses) };
        let last = |name: &str| *found.get(name).expect(name).last().expect("a row");
        let missing = last("external_work") - last("strain_energy");
        assert!((loss.work - missing).abs() < 0.02 * missing.abs(), "{} of {missing}", loss.work);
        assert!((loss.fraction - loss.work / last("external_work")).abs() < 1e-9, "{loss:?}");
        assert!((loss.position[0], loss.position[1]) == (0.9, 1.0) && loss.at_node * loss.work > 0.0, "{loss:?}");
        assert!(loss.to_string().contains("contact of `up_ymin` with `low_ymax`"), "{loss}");
    }
}

/// The same with pressures at the points. The energy balance lacks what the penalty stores, too: with the stiffest one,
/// this is nothing beside the loss, and with each softer one more.
#[test]
fn points_that_dig_in_lose_work() {
    let up = "{ min = [-0.5, 1, 0], max = [0.9, 2, 0.5], elements = [4, 3, 1] }";
    let motion = "[{ t = 0.5, u = [0, -0.3, 0] }, { t = 1, u = [0.5, -0.3, 0] }]";
    let [soft, hard, hardest] = ["1e4", "1e5", "1e6"].map(|stiffness| {
        let law = format!("stiffness = {stiffness}, scaling = 'area', pressure_at = 'points'");
        let keys = format!("friction = 0.0\nenforcement = {{ penalty = {{ {law} }} }}\nnormals = 'averaged'");
        let found = pressed_in_steps(LONG, up, motion, &keys, 320);
        let [loss] = &found.losses[..] else { panic!("{:?}", found.losses) };
        assert!((loss.position[0], loss.position[1]) == (0.9, 1.0), "{loss:?}");
        let last = |name: &str| *found.get(name).expect(name).last().expect("a row");
        let missing = last("external_work") - last("strain_energy");
        println!("{stiffness}: {} of {missing}", loss.work);
        (missing - loss.work) / missing.abs()
    });
    assert!(hardest.abs() < 0.01 && hard > 2.0 * hardest && soft > 2.0 * hard, "{soft} {hard} {hardest}");
}

/// A block lifts a strip by a tie that ends at t = 0.5. The strip returns, and its energy, half the force times the
/// lift, disappears on purpose; with a tie that stays, nothing does.
#[test]
fn the_end_of_a_pair_is_no_release_by_mistake() {
    let up = "{ min = [0, 1, 0], max = [1, 2, 0.5], elements = [3, 3, 1] }";
    let motion = "[{ t = 0.5, u = [0, 0.1, 0] }, { t = 1, u = [0, 0.1, 0] }]";
    for (keys, remains) in [("tied = true\nactive = [0, 0.5]", 0.0), ("tied = true", 1.0)] {
        let found = pressed(LONG, up, motion, keys);
        let energy = found.get("strain_energy").expect("a column");
        assert!((energy[20] - remains * energy[10]).abs() < 1e-9 * energy[10] && energy[10] > 0.0, "{energy:?}");
        assert_eq!(found.released, None, "{keys}");
    }
}

/// A rigid roller of 16 facets slides over a soft slab without friction: its kinks close and open the nodes of the slab,
/// which slide past them instead of moving along their normals. What contact is said to add is what the energies gain; the
/// trapezoidal rule over the gaps of these nodes would be 14 % off.
#[test]
fn nodes_that_a_kink_closes_and_opens_lose_nothing_by_it() {
    let text = "[[body]]\nname = 'low'\nbox = { min = [0, 0, 0], max = [6, 1, 0.5], elements = [30, 4, 1] }\n\
                material = { neo_hooke = { youngs_modulus = 10.0, poisson_ratio = 0.3 } }\n\
                [[body]]\nname = 'tool'\nrigid = {}\n\
                cone = { height = 0.5, bottom_radius = 0.6, top_radius = 0.6, elements = [4, 2, 1] }\n\
                place = { rotate = { axis = [1, 0, 0], degrees = 90 }, translate = [1.0, 1.62, 0.0] }\n\
                [[contact]]\nslave = 'low_ymax'\nmaster = 'tool_side'\nfriction = 0.0\n\
                [[dirichlet]]\nset = 'low_ymin'\n[[dirichlet]]\nset = 'low_zmin'\ncomponents = ['z']\n\
                [[dirichlet]]\nset = 'low_zmax'\ncomponents = ['z']\n\
                [[dirichlet]]\nset = 'tool'\nmotion = [{ t = 0.2, u = [0, -0.15, 0], angle = 0 }, \
                { t = 1.0, u = [3.7, -0.15, 0], angle = 0 }]\n[load_path]\nsteps = 100\n";
    let mut problem = crate::common::problem(text);
    let density = problem.initial_density().clone();
    let forward = problem.analysis.forward(&density, &mut Silent).unwrap_or_else(|e| panic!("{e}"));
    let found = quantities(&problem, &forward.path);
    let last = |name: &str| *found.get(name).expect(name).last().expect("a row");
    let missing = last("external_work") - last("strain_energy");
    let [loss] = &found.losses[..] else { panic!("{:?}", found.losses) };
    assert!((loss.work / missing - 1.0).abs() < 0.03, "{} of {missing}", loss.work);
}

/// A column pressed by one of the same plan: the contact stays flat and as large as it is, so that nothing is lost,
/// whatever the method, even though the penalty method stores a third of the work in its penalties.
#[test]
fn flat_contact_loses_nothing() {
    let low = "{ min = [0, 0, 0], max = [1, 1, 0.5], elements = [2, 3, 1] }";
    let up = "{ min = [0, 1, 0], max = [1, 2, 0.5], elements = [2, 3, 1] }";
    let lagrange = pressed(low, up, "[{ t = 1, u = [0, -0.1, 0] }]", "friction = 0.0");
    assert_eq!(lagrange.losses, Vec::<LostWork>::new());
    for place in ["nodes", "points"] {
        let law = format!("stiffness = 30.0, scaling = 'area', pressure_at = '{place}'");
        let keys = format!("friction = 0.3\nenforcement = {{ penalty = {{ {law} }} }}");
        let penalty = pressed(low, up, "[{ t = 1, u = [0, -0.1, 0] }]", &keys);
        let last = |name: &str| *penalty.get(name).expect(name).last().expect("a row");
        assert!(last("energy_balance") > 0.1 * last("external_work"), "penalties store energy");
        assert_eq!(penalty.losses, Vec::<LostWork>::new(), "{place}");
    }
}

/// A ball of few facets is squeezed between two rigid plates, one of which moves sideways: the ball rolls off the nodes on
/// which it stands, and loses contact, since its chords are further inside than the plates have come. The strain energy
/// of the step before is what disappears, but for the work of the plates.
#[test]
fn a_coarse_ball_that_rolls_off_its_node_releases_energy() {
    let found = |motion: &str| {
        let plate = |name: &str, low: f64, high: f64| {
            format!(
                "[[body]]\nname = '{name}'\nrigid = {{}}\n\
                 box = {{ min = [-1.5, {low:?}, -1], max = [1.5, {high:?}, 1], elements = [2, 1, 2] }}\n"
            )
        };
        let text = format!(
            "[[body]]\nname = 'mid'\nball = {{ radius = 0.45, elements = [2, 1, 2] }}\n\
             material = {{ neo_hooke = {{ youngs_modulus = 300.0, poisson_ratio = 0.0 }} }}\n\
             place = {{ translate = [0, 0.45, 0] }}\n{}{}\
             [[surface]]\nname = 'dn'\nbody = 'mid'\nnormal = {{ direction = [0, -1, 0], degrees = 60 }}\n\
             [[surface]]\nname = 'up'\nbody = 'mid'\nnormal = {{ direction = [0, 1, 0], degrees = 60 }}\n\
             [[contact]]\nslave = 'dn'\nmaster = 'lo_ymax'\nfriction = 0.5\n\
             [[contact]]\nslave = 'up'\nmaster = 'hi_ymin'\nfriction = 0.5\n\
             [[dirichlet]]\nset = 'lo'\n[[dirichlet]]\nset = 'hi'\nmotion = {motion}\n[load_path]\nsteps = 8\n",
            plate("lo", -0.3, 0.0),
            plate("hi", 0.9, 1.2)
        );
        let mut problem = crate::common::problem(&text);
        let density = problem.initial_density().clone();
        let forward = problem.analysis.forward(&density, &mut Silent).unwrap_or_else(|e| panic!("{e}"));
        quantities(&problem, &forward.path)
    };
    let rolls = found("[{ t = 0.5, u = [0, -0.024, 0] }, { t = 1, u = [0.4, -0.024, 0] }]");
    let released = rolls.released.as_ref().expect("a release");
    let [stored, work, friction] =
        ["strain_energy", "external_work", "friction_work"].map(|name| rolls.get(name).expect(name));
    let (before, now) = (released.step - 1, released.step);
    let change = |values: &[f64]| values[now] - values[before];
    let gone = change(&work) - change(&stored) - change(&friction);
    assert!((released.energy - gone).abs() < 1e-9 * gone, "{released}: {gone}");
    let largest = stored.iter().copied().fold(0.0, f64::max);
    assert!((released.fraction - gone / largest).abs() < 1e-9 && released.fraction > 0.2, "{released}");
    assert!(stored[now] < 1e-6 * stored[before], "{released}");
    assert!(["dn", "up"].contains(&released.surfaces[0].as_str()), "{released}");
    // pressed and released again, slowly: nothing disappears
    let pressed = found("[{ t = 0.5, u = [0, -0.024, 0] }, { t = 1, u = [0, 0, 0] }]");
    assert_eq!(pressed.released, None);
}

/// A block is pressed on a strip and moves along it in proportion: pressure and slip grow with the time t, and friction
/// does work that grows with t². The sum over the steps, with the mean pressure of each, is exact; the tractions at
/// their ends would give 1 + 1/n times that. A block that arrives in the middle of the last step slides half of this
/// step without pressure, and does about half of the work that the step counts; friction tilts it, so that some
/// nodes arrive later.
#[test]
fn friction_of_coarse_steps_is_judged() {
    let up = |low: f64| format!("{{ min = [1, {low:?}, 0], max = [2, 2, 0.5], elements = [3, 3, 1] }}");
    let last = |found: &Quantities, name: &str| *found.get(name).expect(name).last().expect("a row");
    let found = |low, motion, steps| pressed_in_steps(LONG, &up(low), motion, "friction = 0.3", steps);
    let both = "[{ t = 1, u = [0.04, -0.02, 0] }]";
    let [coarse, fine] = [4, 64].map(|steps| found(1.0, both, steps));
    assert!(coarse.coarse_friction.is_empty() && fine.coarse_friction.is_empty(), "{:?}", coarse.coarse_friction);
    let [of_coarse, of_fine] = [&coarse, &fine].map(|found| last(found, "up_ymin_friction_work"));
    assert!((of_coarse / of_fine - 1.0).abs() < 0.005, "{of_coarse}: {of_fine}");
    let arrives = "[{ t = 1, u = [0.2, -0.04, 0] }]";
    let [coarse, fine] = [4, 256].map(|steps| found(1.035, arrives, steps));
    let [of_steps] = &coarse.coarse_friction[..] else { panic!("{:?}", coarse.coarse_friction) };
    assert!(fine.coarse_friction.is_empty(), "{:?}", fine.coarse_friction);
    assert_eq!(of_steps.work, last(&coarse, "up_ymin_friction_work"));
    let exact = last(&fine, "up_ymin_friction_work");
    assert!((of_steps.work / exact - 2.0).abs() < 0.2, "{of_steps}: {exact}");
    assert!((of_steps.error / (of_steps.work - exact) - 1.0).abs() < 0.1, "{of_steps}: {exact}");
    let part = of_steps.error / last(&coarse, "external_work");
    assert!((of_steps.fraction - part).abs() < 1e-9, "{of_steps}: {part}");
    let slides = "[{ t = 0.2, u = [0, -0.02, 0] }, { t = 1, u = [0.2, -0.02, 0] }]";
    assert_eq!(pressed(LONG, &up(1.0), slides, "friction = 0.3").coarse_friction, Vec::new());
    // a coefficient that rises while the block slides counts with its mean, too
    let rising = "friction = 0.3\nfriction_path = [{ t = 0.2, factor = 0.2 }, { t = 1, factor = 1 }]";
    let slides = "[{ t = 0.2, u = [0, -0.02, 0] }, { t = 1, u = [0.04, -0.02, 0] }]";
    let of = |steps| last(&pressed_in_steps(LONG, &up(1.0), slides, rising, steps), "up_ymin_friction_work");
    let [coarse, fine] = [5, 80].map(of);
    assert!((coarse / fine - 1.0).abs() < 0.02, "{coarse}: {fine}");
}

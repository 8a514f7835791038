//! Contact forces on void.

use slipstick::quantities::{Quantities, quantities};
use slipstick_path::Silent;

/// Two columns of solid and two of void, ν = 0, under a flat rigid plate; `swapped` exchanges slave and master.
fn columns(swapped: bool, within: f64) -> Quantities {
    let [slave, master] = if swapped { ["plate_ymin", "block_ymax"] } else { ["block_ymax", "plate_ymin"] };
    let plate =
        if swapped { "material = { neo_hooke = { youngs_modulus = 1e6, poisson_ratio = 0.0 } }" } else { "rigid = {}" };
    let motion = if swapped { "plate_ymax" } else { "plate" };
    let text = format!(
        "[[body]]\nname = 'block'\nbox = {{ min = [0, 0, 0], max = [4, 1, 1], elements = [4, 1, 1] }}\n\
         material = {{ linear_elastic = {{ youngs_modulus = 10.0, poisson_ratio = 0.0 }} }}\n\
         [[body]]\nname = 'plate'\nbox = {{ min = [0, 1, 0], max = [4, 2, 1], elements = [4, 1, 1] }}\n{plate}\n\
         [[contact]]\nslave = '{slave}'\nmaster = '{master}'\nfriction = 0.0\nmultiplier_shape = 'dual'\n\
         [[dirichlet]]\nset = 'block_ymin'\n[[dirichlet]]\nset = '{motion}'\nmotion = [{{ t = 1.0, u = [0, -0.01, 0] }}]\n\
         [load_path]\nsteps = 1\n\
         [design]\nbodies = ['block']\nvolume_fraction = 1.0\nsimp = {{ p = 3.0, min = 0.05 }}\n\
         passive_void = [{{ min = [2, 0, 0], max = [{within:?}, 1, 1] }}]\n[objective]\ncontact_force = {{}}\n"
    );
    let mut problem = crate::common::problem(&text);
    let mut density = problem.initial_density().clone();
    let void = density.iter().map(|&density| if density > 0.0 { 1.0 } else { density }).collect::<Vec<f64>>();
    density.copy_from_slice(&void);
    let forward = problem.analysis.forward(&density, &mut Silent).unwrap_or_else(|e| panic!("{e}"));
    quantities(&problem, &forward.path)
}

/// By hand, with dual shapes, whose multipliers are nodal forces per area: all columns are strained alike, so that the
/// void ones carry 2 × 0.05 of 2 + 2 × 0.05. A rim of void takes its part of the force on the nodes between, and without
/// void there is no finding.
#[test]
fn contact_on_void_is_reported() {
    for swapped in [false, true] {
        let found = columns(swapped, 4.0);
        let slave = if swapped { "plate_ymin" } else { "block_ymax" };
        let of = |what: &str| found.get(&format!("{slave}_{what}")).expect(what)[1];
        let expected = 0.1 / 2.1;
        let fraction = of("force_on_void") / of("normal_force");
        assert!((fraction / expected - 1.0).abs() < 1e-3, "{swapped}: {fraction} for {expected}");
        let [told] = &found.on_void[..] else { panic!("{:?}", found.on_void) };
        assert!((told.fraction / expected - 1.0).abs() < 1e-3 && told.step == 1, "{told:?}");
        assert_eq!(told.position[0], 3.0);
        assert!(told.to_string().contains("acts on void: in load step 1"), "{told}");
    }
    let solid = columns(false, 2.0);
    assert_eq!(solid.get("block_ymax_force_on_void"), Some(vec![0.0, 0.0]));
    assert!(solid.on_void.is_empty());
}

/// One pad on solid material, one on void; each is pressed in a load case of its own, while the other is lifted. By hand,
/// all of the second force acts on void, however small it is beside the first.
#[test]
fn each_load_case_is_judged_on_its_own() {
    let pad = |name: &str, x: f64| {
        format!(
            "[[body]]\nname = '{name}'\nbox = {{ min = [{x:?}, 1, 0], max = [{:?}, 2, 1], elements = [1, 1, 1] }}\n\
             material = {{ linear_elastic = {{ youngs_modulus = 10.0, poisson_ratio = 0.0 }} }}\n",
            x + 1.0
        )
    };
    let motion = |name: &str, case: &str, y: f64| {
        format!("[[dirichlet]]\nset = '{name}_ymax'\nload_case = '{case}'\nmotion = [{{ t = 1, u = [0, {y:?}, 0] }}]\n")
    };
    let text = format!(
        "[[body]]\nname = 'block'\nbox = {{ min = [0, 0, 0], max = [6, 1, 1], elements = [6, 1, 1] }}\n\
         material = {{ linear_elastic = {{ youngs_modulus = 10.0, poisson_ratio = 0.0 }} }}\n{}{}\
         [[load_case]]\nname = 'first'\n[[load_case]]\nname = 'second'\n\
         [[surface]]\nname = 'pads'\nof = ['left_ymin', 'right_ymin']\n\
         [[contact]]\nslave = 'pads'\nmaster = 'block_ymax'\nfriction = 0.0\nmultiplier_shape = 'dual'\n\
         [[dirichlet]]\nset = 'block_ymin'\n{}{}{}{}[load_path]\nsteps = 1\n\
         [design]\nbodies = ['block']\nvolume_fraction = 1.0\nsimp = {{ p = 3.0, min = 1e-3 }}\n\
         passive_void = [{{ min = [3, 0, 0], max = [6, 1, 1] }}]\n[objective]\ncontact_force = {{}}\n",
        pad("left", 1.0),
        pad("right", 4.0),
        motion("left", "first", -0.01),
        motion("right", "first", 0.01),
        motion("left", "second", 0.01),
        motion("right", "second", -0.01),
    );
    let mut problem = crate::common::problem(&text);
    let density = problem.initial_density().iter().map(|&density| if density > 0.0 { 1.0 } else { 0.0 });
    let density: Vec<f64> = density.collect();
    let forward = problem.analysis.forward(&density.into(), &mut Silent).unwrap_or_else(|e| panic!("{e}"));
    let found = quantities(&problem, &forward.path);
    let [told] = &found.on_void[..] else { panic!("{:?}", found.on_void) };
    assert!((told.fraction - 1.0).abs() < 1e-6 && told.step == 2, "{told:?}");
}

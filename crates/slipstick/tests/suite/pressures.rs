//! Whether the facets of a slave surface resolve its pressures.

use slipstick::quantities::{Quantities, quantities};
use slipstick_path::Silent;

/// A slab with facets of 1/2 that `upper` presses, with a peak pressure.
fn pressed(upper: &str, by: f64, keys: &str) -> Quantities {
    let text = format!(
        "[[body]]\nname = 'slab'\nbox = {{ min = [-2, -1, -2], max = [2, 0, 2], elements = [8, 2, 8] }}\n\
         material = {{ neo_hooke = {{ youngs_modulus = 10.0, poisson_ratio = 0.3 }} }}\n\
         [[body]]\nname = 'tool'\nrigid = {{}}\n{upper}\n\
         [[contact]]\nslave = 'slab_ymax'\nmaster = 'TOUCH'\nfriction = 0.0\n{keys}\n\
         [[dirichlet]]\nset = 'slab_ymin'\n[[dirichlet]]\nset = 'tool'\nmotion = [{{ t = 1.0, u = [0, {:?}, 0] }}]\n\
         [[quantity]]\nname = 'peak'\ncontact_pressure = {{ slave = 'slab_ymax', measure = 'peak' }}\n\
         [load_path]\nsteps = 2\n",
        -by
    );
    let touch = if upper.contains("half_ball") { "tool_dome" } else { "tool_ymin" };
    let mut problem = crate::common::problem(&text.replace("TOUCH", touch));
    let density = problem.initial_density().clone();
    let forward = problem.analysis.forward(&density, &mut Silent).unwrap_or_else(|e| panic!("{e}"));
    quantities(&problem, &forward.path)
}

/// A ball of radius 5 on facets of 1/2, whose mean gap around the node is 0.0083. By hand, for a single node in contact, whose function is a product of two hats: the force on its node is
/// z ∫N² = z (2h/3)² and its area h², so the multiplier is 9/4 of the force per area. With dual shapes, both are equal.
/// A flat tool that is larger than the slab touches everywhere; nothing is reported.
#[test]
fn pressures_of_one_node_are_told() {
    let ball = "half_ball = { radius = 5.0, elements = [6, 6, 6] }\nplace = { translate = [0, 5.0, 0] }";
    let found = pressed(ball, 0.012, "normals = 'averaged'\nmultiplier_shape = 'standard'");
    let [rough] = &found.rough_pressures[..] else { panic!("{:?}", found.rough_pressures) };
    assert_eq!((rough.nodes, rough.step, rough.position), (1, 2, [0.0, 0.0, 0.0]));
    assert!((rough.multiplier / rough.force_per_area - 2.25).abs() < 0.02, "{rough:?}");
    let peak = found.get("peak_extreme").expect("the extreme");
    assert!((rough.multiplier / peak[2] - 1.0).abs() < 1e-3, "{rough:?} {peak:?}");
    assert!(rough.to_string().contains("`slab_ymax` do not resolve the pressures that `peak` combines"), "{rough}");
    assert!(pressed(ball, 0.012, "multiplier_shape = 'dual'").rough_pressures.is_empty());
    let plate = "box = { min = [-3, 0, -3], max = [3, 1, 3], elements = [2, 1, 2] }";
    assert!(pressed(plate, 0.05, "").rough_pressures.is_empty());
}

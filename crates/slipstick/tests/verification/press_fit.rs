//! A shaft pressed into a hub, and pulled out: Lamé and Coulomb.

use crate::chapter::Chapter;
use crate::finding::Finding;
use crate::solved::{Scene, Solved, neo_hooke};
use std::f64::consts::PI;

pub fn chapter() -> Chapter {
    Chapter {
        key: "press_fit",
        title: "Press fit: hub on shaft",
        about: "
A hub (radius 10 … 20) sits on a hollow shaft (radius 4 … 10), both 2.5 high, E = 200000, ν = 0.3,
with an interference δ = 0.01 of the radii. Lamé's solution for plane stress gives the pressure p =
δ E/a / [(b² + a²)/(b² − a²) + (a² + c²)/(a² − c²)] with a = 10, b = 20, c = 4. The interference is
given in two ways: the meshes touch, and `offset` grows from 0 to δ; or the shaft is meshed with the
radius a + δ, so that the meshes overlap, and `offset` grows from −δ to 0. Pressure is the normal
force over the covered area. Then, with μ = 0.2, the shaft is pulled by its upper end until it
slides everywhere, while the lower end of the hub is held; the force is compared with that of
Coulomb's law at Lamé's pressure, μ p 2πa h. The meshes have 64 elements around.

The last two rows come from the [case](../../cases/press_fit/README.md) in which a bushing is tied to a
ring and a rigid tool pushes the shaft. They give (1) the pressure once the fit is closed, for a
shaft as long as the ring, against Lamé's three-layer solution, and (2) the final tool force over
the normal force.",
        remarks: "
The pressure found is that of 64-sided polygons instead of circles. Pulling stretches hub and shaft;
the shaft becomes thinner, which lowers the pressure slightly.",
        quick: true,
        run: || Some(run()),
    }
}

const INNER: f64 = 4.0;
const FIT: f64 = 10.0;
const OUTER: f64 = 20.0;
const HEIGHT: f64 = 2.5;
const INTERFERENCE: f64 = 0.01;
const MODULUS: f64 = 200_000.0;

fn run() -> Vec<Finding> {
    let ratio = |outer: f64, inner: f64| (outer * outer + inner * inner) / (outer * outer - inner * inner);
    let lame = INTERFERENCE * MODULUS / FIT / (ratio(OUTER, FIT) + ratio(FIT, INNER));
    let mut findings = Vec::new();
    let growing = "offset = [{ t = 0.5, offset = 0.01 }]\n";
    let overlapping = "offset = [{ t = 0, offset = -0.01 }, { t = 0.5, offset = 0 }]\n";
    for (name, radius, offset) in
        [("offset from 0 to δ", FIT, growing), ("overlapping meshes", FIT + INTERFERENCE, overlapping)]
    {
        let mut solved = Scene::from(text(radius, offset, 0.0, "")).solve();
        findings.push(Finding::value(format!("pressure, {name}"), lame, 0.01, pressure(&mut solved, 2)));
    }
    let pull = "motion = [{ t = 0.5, u = [0, 0, 0] }, { t = 1.0, u = [0, 0.01, 0] }]\n";
    let mut solved = Scene::from(text(FIT, growing, 0.2, pull)).solve();
    let last = solved.steps();
    let force: f64 = solved.contact(last).iter().map(|node| node.covered_area * node.global_multiplier[1].abs()).sum();
    findings.push(Finding::value("pull-out force", 0.2 * lame * 2.0 * PI * FIT * HEIGHT, 0.02, force));
    let normal = normal_force(&mut solved, last).0;
    findings.push(Finding::value("pull-out force over normal force", 0.2, 1e-3, force / normal));
    findings.extend(tied_ring());
    findings
}

/// `cases/press_fit`, and the same with a shaft as long as the ring, which can contract at the tool.
fn tied_ring() -> [Finding; 2] {
    let case = include_str!("../../../../cases/press_fit/case.toml");
    let mut short = case.to_owned();
    for (long, short_shaft) in [
        ("width = 6.0, elements = [32, 5, 8]", "width = 3.0, elements = [32, 5, 4]"),
        ("[0.0, 0.0, 3.5]", "[0.0, 0.0, 2.0]"),
        ("master = \"tool_zmin\"\ntied = true", "master = \"tool_zmin\"\nfriction = 0.0"),
    ] {
        assert!(case.contains(long), "{long}");
        short = short.replace(long, short_shaft);
    }
    let fit = |solved: &mut Solved, step: usize| {
        let slave = solved.problem.mesh.set_nodes("bushing_inner").expect("a surface").into_owned();
        solved.contact(step).into_iter().filter(|node| slave.contains(&node.node)).fold((0.0, 0.0), add)
    };
    let (force, area) = fit(&mut Scene::from(short).solve(), 5);
    let mut solved = Scene::from(case.to_owned()).solve();
    let last = solved.steps();
    let normal = fit(&mut solved, last).0;
    let found = slipstick::quantities::quantities(&solved.problem, &solved.forward.path);
    let push = -found.get("reaction_tool_z").expect("the tool")[last];
    [
        Finding::value("shaft, bushing and ring: pressure", layers(), 0.01, force / area),
        Finding::value("shaft, bushing and ring: force of the tool over normal force", 0.2, 5e-3, push / normal),
    ]
}

/// Lamé's pressure between shaft and bushing for the three layers of `cases/press_fit`: the radial
/// displacements differ by the interference there, and agree between bushing and ring.
fn layers() -> f64 {
    // u(r) of a cylinder in plane stress with radii a, b under the pressures p inside and q outside
    let u = |r: f64, [a, b]: [f64; 2], [p, q]: [f64; 2], (e, nu): (f64, f64)| {
        let of = |area: f64| area / (b * b - a * a);
        ((1.0 - nu) * of(p * a * a - q * b * b) * r + (1.0 + nu) * of((p - q) * a * a * b * b) / r) / e
    };
    let (steel, bronze) = ((200_000.0, 0.3), (110_000.0, 0.34));
    let apart = |p: f64, q: f64| {
        let fit = u(10.0, [10.0, 13.0], [p, q], bronze) - u(10.0, [4.0, 10.0], [0.0, p], steel);
        let tie = u(13.0, [10.0, 13.0], [p, q], bronze) - u(13.0, [13.0, 20.0], [q, 0.0], steel);
        [fit, tie]
    };
    let ([a, c], [b, d]) = (apart(1.0, 0.0), apart(0.0, 1.0));
    INTERFERENCE * d / (a * d - b * c)
}

/// Normal force and covered area.
fn normal_force(solved: &mut Solved, step: usize) -> (f64, f64) {
    solved.contact(step).into_iter().fold((0.0, 0.0), add)
}

/// Adds the normal force and the covered area of a node.
fn add((force, area): (f64, f64), node: slipstick::model::NodalContact) -> (f64, f64) {
    (force + node.multiplier[0] * node.covered_area, area + node.covered_area)
}

fn pressure(solved: &mut Solved, step: usize) -> f64 {
    let (force, area) = normal_force(solved, step);
    force / area
}

/// The hub is held at its lower end; without a motion, so is the shaft.
fn text(radius: f64, offset: &str, friction: f64, motion: &str) -> String {
    let material = neo_hooke(MODULUS, 0.3);
    let end = if motion.is_empty() { "bottom" } else { "top" };
    format!(
        "[[body]]\nname = 'hub'\nhollow_cylinder = {{ inner_radius = {FIT:?}, outer_radius = {OUTER:?}, \
         height = {HEIGHT:?}, elements = [6, 64, 1] }}\n{material}\n\
         [[body]]\nname = 'shaft'\nhollow_cylinder = {{ inner_radius = {INNER:?}, outer_radius = {radius:?}, \
         height = {HEIGHT:?}, elements = [5, 64, 1] }}\n{material}\n\
         [[set]]\nname = 'on_x'\nplane = {{ point = [0, 0, 0], normal = [1, 0, 0] }}\n\
         [[set]]\nname = 'on_z'\nplane = {{ point = [0, 0, 0], normal = [0, 0, 1] }}\n\
         [[dirichlet]]\nset = 'on_x'\ncomponents = ['x']\n\
         [[dirichlet]]\nset = 'on_z'\ncomponents = ['z']\n\
         [[dirichlet]]\nset = 'hub_bottom'\ncomponents = ['y']\n\
         [[dirichlet]]\nset = 'shaft_{end}'\ncomponents = ['y']\n{motion}\
         [[contact]]\nslave = 'hub_inner'\nmaster = 'shaft_outer'\nfriction = {friction:?}\n{offset}\
         [load_path]\nsteps = 4\ntolerance = {{ relative = 1e-10 }}\n"
    )
}

//! Contact between curved surfaces whose facets do not match.

use crate::common::*;
use slipstick::build::{Problem, build};
use slipstick::case::parse_case;
use slipstick::check::{Inspection, NoticeKind, SurfaceKind, inspect};
use slipstick::mesh::{HalfRingShape, Mesh, half_ring};

/// Two rings of which the inner one is too large by `FIT`, in plane strain: half of them, with
/// `around` elements along the half circle, inner ring first.
fn fit(around: [usize; 2], order: usize, friction: f64, more: &str) -> String {
    let ring = |name: &str, [inner, outer]: [f64; 2], around: usize| {
        format!(
            "[[body]]\nname = '{name}'\norder = {order}\n\
             half_ring = {{ inner_radius = {inner:?}, outer_radius = {outer:?}, width = 0.5, elements = [{around}, 4, 1] }}\n\
             material = {{ linear_elastic = {{ youngs_modulus = {YOUNG:?}, poisson_ratio = {POISSON:?} }} }}\n"
        )
    };
    let mut text = ring("shaft", [INNER, FITTED], around[0]) + &ring("hub", [FITTED, OUTER], around[1]);
    for set in ["shaft_zmin", "shaft_zmax", "hub_zmin", "hub_zmax"] {
        text += &format!("[[dirichlet]]\nset = '{set}'\ncomponents = ['z']\n");
    }
    for (set, within) in [("inside", "shaft_inner"), ("outside", "hub_outer")] {
        text += &format!(
            "[[set]]\nname = '{set}'\nwithin = '{within}'\nplane = {{ point = [0, 0, 0], normal = [1, 0, 0] }}\n\
             [[dirichlet]]\nset = '{set}'\ncomponents = ['x']\n"
        );
    }
    text + &format!(
        "[[symmetry]]\nnormal = 'y'\n[[contact]]\nslave = 'shaft_outer'\nmaster = 'hub_inner'\nfriction = {friction:?}\n\
         offset = [{{ t = 1, offset = {FIT:?} }}]\n{more}\n[load_path]\nsteps = 1\n"
    )
}

const YOUNG: f64 = 2.1e5;
const POISSON: f64 = 0.3;
const INNER: f64 = 6.0;
const FITTED: f64 = 10.0;
const OUTER: f64 = 15.0;
const FIT: f64 = 0.01;

/// Lamé: rings of one material whose radii differ by δ at r press on each other in plane strain with
/// p = E/(1 − ν²) δ/r · (r_o² − r²)(r² − r_i²) / (2 r² (r_o² − r_i²)).
fn lame() -> f64 {
    let [i, r, o] = [INNER, FITTED, OUTER].map(|r| r * r);
    YOUNG / (1.0 - POISSON * POISSON) * FIT / FITTED * (o - r) * (r - i) / (2.0 * r * (o - i))
}

/// Mean contact pressure of a fit and the spread of the nodal pressures, relative to Lamé's pressure
/// and to the mean.
fn pressure(around: [usize; 2], order: usize, surfaces: &str) -> [f64; 2] {
    pressure_of(&fit(around, order, 0.0, &format!("surfaces = '{surfaces}'")), &[])
}

/// The same for a case whose bodies may come from files.
fn pressure_of(fit: &str, meshes: &[(&str, Mesh)]) -> [f64; 2] {
    let text = fit.to_owned()
        + "[[quantity]]\nname = 'p'\ncontact_pressure = { slave = 'shaft_outer', measure = 'mean' }\n\
           [[quantity]]\nname = 'spread'\ncontact_pressure = { slave = 'shaft_outer', measure = 'spread' }\n\
           [design]\nbodies = ['hub']\ninitial = 1.0\n[objective]\ncontact_force = {}\n";
    let mut problem = problem_with(&text, meshes);
    let density = problem.initial_density().clone();
    let run = forward(&mut problem, &density);
    let found = slipstick::quantities::quantities(&problem, &run.path);
    let [p, spread] = ["p", "spread"].map(|name| *found.get(name).unwrap().last().unwrap());
    [p / lame(), spread]
}

/// The mean pressure is that of Lamé within 1 %, and the nodal pressures scatter by less than 5 % of
/// it, whatever the divisions; the facets of 12 divisions a quarter leave the circle by twice the
/// fit.
#[test]
fn a_fit_does_not_depend_on_the_divisions() {
    let linear = [[24, 24], [24, 26], [26, 24], [24, 34], [40, 26]].map(|around| (around, 1));
    for (around, order) in linear.into_iter().chain([([24, 32], 2), ([30, 24], 2)]) {
        let [p, spread] = pressure(around, order, "smooth");
        println!("{around:?} order {order}: {p:.5}, spread {spread:.4}");
        assert!((p - 1.0).abs() < 0.01, "{around:?} order {order}: {p}");
        assert!(spread < 0.05, "{around:?} order {order}: {spread}");
    }
}

/// Rings of linear elements from files that become quadratic: their new nodes lie on the circles for which the facets
/// stand. Midway between the corners, they would leave the fit to the facets, which differ from Lamé by −61 to +144 %.
#[test]
fn a_fit_of_raised_elements_does_not_depend_on_the_divisions() {
    type Divide = fn(&Mesh) -> Mesh;
    let around = [24, 32];
    let ring = |name, [inner_radius, outer_radius]: [f64; 2], around| {
        half_ring(name, &HalfRingShape { inner_radius, outer_radius, width: 0.5, elements: [around, 4, 1] }).unwrap()
    };
    let rings = [ring("shaft", [INNER, FITTED], around[0]), ring("hub", [FITTED, OUTER], around[1])];
    let kinds: [(&str, Divide); 4] = [
        ("hex27", Mesh::clone),
        ("tet10", |ring| ring.divided(|_| true)),
        ("wedge18 along ζ", |ring| ring.divided_into_wedges(|_| Some(2))),
        ("wedge18 along ξ", |ring| ring.divided_into_wedges(|_| Some(0))),
    ];
    for (kind, divide) in kinds {
        let [shaft, hub] = rings.each_ref().map(divide);
        let mut text = String::new();
        for line in fit(around, 2, 0.0, "").lines() {
            text += &if line.starts_with("half_ring") { "mesh = { file = 'NAME' }".into() } else { line.to_owned() };
            text.push('\n');
        }
        let text = text.replacen("NAME", "shaft", 1).replacen("NAME", "hub", 1)
            + "[[set]]\nname = 'bore'\nbody = 'hub'\n\
               cylinder = { start = [0, 0, -1], end = [0, 0, 1], radius = 10, tolerance = 1e-6 }\n";
        let meshes = [("shaft", shaft), ("hub", hub)];
        let mesh = problem_with(&text, &meshes).mesh;
        assert_eq!(mesh.node_sets["bore"], mesh.surfaces["hub_inner"].nodes(), "{kind}");
        let [p, spread] = pressure_of(&text, &meshes);
        println!("{kind}: {p:.5}, spread {spread:.4}");
        assert!((p - 1.0).abs() < 0.01, "{kind}: {p}");
        assert!(spread < 0.05, "{kind}: {spread}");
    }
}

/// Writes the table of docs/measurements/curved.md into the folder that `SLIPSTICK_TABLES` names.
#[test]
#[ignore = "takes minutes"]
fn table_of_fits() {
    const DIVISIONS: [usize; 6] = [12, 13, 16, 24, 37, 64];
    let mut table = String::from("| shaft | elements, gap |");
    DIVISIONS.iter().for_each(|n| table += &format!(" hub {n} |"));
    table += &format!("\n|---|---|{}\n", "---|".repeat(DIVISIONS.len()));
    let mut worst: f64 = 0.0;
    for (order, surfaces, name) in [
        (1, "faceted", "linear, facets"),
        (1, "smooth", "linear, surfaces"),
        (2, "faceted", "quadratic, facets"),
        (2, "smooth", "quadratic, surfaces"),
    ] {
        for shaft in DIVISIONS {
            table += &format!("| {shaft} | {name} |");
            for hub in DIVISIONS {
                let [p, spread] = pressure([2 * shaft, 2 * hub], order, surfaces);
                table += &format!(" {:+.3} ({:.2}) |", 100.0 * (p - 1.0), 100.0 * spread);
                if surfaces == "smooth" {
                    worst = worst.max((p - 1.0).abs());
                    assert!(spread < 0.01, "{shaft} on {hub}, order {order}: {spread}");
                }
            }
            table += "\n";
        }
    }
    println!("{table}\nlargest deviation between surfaces: {worst:.4}");
    assert!(worst < 0.01, "{worst}");
    if let Some(folder) = std::env::var_os("SLIPSTICK_TABLES") {
        std::fs::write(std::path::Path::new(&folder).join("fits.md"), table).expect("written");
    }
}

fn inspected(text: &str) -> Inspection {
    let case = parse_case(text, "case.toml").expect("a valid case").case;
    inspect(&case, &mut build(&case).expect("a problem")).expect("inspected")
}

/// A quarter of a ring of radius 10 with 12 elements stands for a cylinder and leaves it by
/// 10 (1 − cos 3.75°).
#[test]
fn check_names_the_surfaces_of_a_pair() {
    let found = inspected(&fit([24, 32], 1, 0.0, ""));
    let sagitta = |elements: f64| 10.0 * (1.0 - f64::to_radians(90.0 / (2.0 * elements)).cos());
    for (parts, elements) in found.contacts[0].surfaces.iter().zip([12.0, 16.0]) {
        let [part] = &parts[..] else { panic!("{parts:?}") };
        assert_eq!((part.kind, part.name.as_str()), (SurfaceKind::Cylinder, "cylinder of radius 10"));
        assert_eq!(part.facets as f64, 2.0 * elements);
        assert!((part.height / sagitta(elements) - 1.0).abs() < 1e-9, "{part:?}");
    }
    let found = inspected(&fit([24, 32], 1, 0.0, "surfaces = 'faceted'"));
    let kinds = found.contacts[0].surfaces.each_ref().map(|parts| parts[0].kind);
    assert_eq!(kinds, [SurfaceKind::Faceted; 2]);
}

/// Facets of 16 and 12 linear elements a quarter overlap and stand apart by up to 0.007 in the mean
/// around a node, quadratic ones by less. With `adjust`, they touch without stress, and a fit then has Lamé's pressure within 1 %.
/// Gaps beyond the distance remain, and cause stress.
#[test]
fn initial_gaps_and_penetrations_are_removed_without_stress() {
    for (order, enforcement, small) in
        [(1, "lagrange = {}", 0.003), (1, "penalty = {}", 0.003), (2, "lagrange = {}", 0.0003)]
    {
        let of = |offset: f64, adjust: f64| {
            let more = format!("surfaces = 'faceted'\nadjust = {adjust:?}\nenforcement = {{ {enforcement} }}");
            fit([32, 24], order, 0.0, &more)
                .replace(&format!("offset = {FIT:?} }}"), &format!("offset = {offset:?} }}"))
        };
        let force = |text: &str| {
            let mut problem = problem(text);
            let density = problem.initial_density().clone();
            let run = forward(&mut problem, &density);
            let found = slipstick::quantities::quantities(&problem, &run.path);
            *found.get("shaft_outer_normal_force").unwrap().last().unwrap()
        };
        let exact = lame() * std::f64::consts::PI * FITTED * 0.5;
        let (none, fitted) = (force(&of(0.0, 0.03)), force(&of(FIT, 0.03)));
        println!("order {order}, {enforcement}: {none:.1e}, {:.4}", fitted / exact);
        assert!(none.abs() < 1e-9 * exact, "order {order}, {enforcement}: {none}");
        assert!((fitted / exact - 1.0).abs() < 0.01, "order {order}, {enforcement}: {fitted} {exact}");
        let left = force(&of(0.0, small));
        assert!(left > 0.01 * exact, "order {order}, {enforcement}: {left}");

        let all = inspected(&of(0.0, 0.03)).contacts[0].adjusted.expect("an adjustment");
        assert!(all.left == 0 && all.nodes > 60 && all.largest.abs() > small, "{all:?}");
        let some = inspected(&of(0.0, small)).contacts[0].adjusted.expect("an adjustment");
        assert!(some.left > 0 && some.nodes + some.left == all.nodes, "{some:?} {all:?}");
        assert!(some.deepest_left > small && some.largest.abs() <= small, "{some:?}");
    }
}

/// A prescribed interference has Lamé's pressure within 1 %, whatever the facets' own gaps.
#[test]
fn an_interference_replaces_the_gaps_of_the_mesh() {
    let more = format!("surfaces = 'faceted'\nadjust = {{ gap = {:?} }}", -FIT);
    let text = fit([32, 24], 1, 0.0, &more).replace(&format!("offset = {FIT:?} }}"), "offset = 0.0 }");
    let [mean, spread] = pressure_of(&text, &[]);
    println!("{mean:.4} {spread:.3}");
    assert!((mean - 1.0).abs() < 0.01, "{mean}");
    let found = inspected(&text);
    let adjusted = found.contacts[0].adjusted.expect("an adjustment");
    assert_eq!((adjusted.gap, adjusted.distance, adjusted.left), (-FIT, None, 0));
    assert!(found.notices.iter().all(|notice| notice.kind != NoticeKind::PenetratingStart), "{:?}", found.notices);
}

/// Two cubes in one dimension (ν = 0) that touch in the mesh and count as 0.05 apart: pressed by δ, they transmit
/// E (δ − 0.05)/2 per area. Where only the nodes of one half are chosen, those of the other half touch at once.
#[test]
fn a_clearance_is_closed_before_forces_act() {
    let cubes = |adjust: &str, press: f64| {
        let cube = |name: &str, y: f64| {
            format!(
                "[[body]]\nname = '{name}'\nbox = {{ min = [0, {y:?}, 0], max = [1, {:?}, 1], elements = [4, 1, 1] }}\n\
                 material = {{ linear_elastic = {{ youngs_modulus = 1000.0, poisson_ratio = 0.0 }} }}\n",
                y + 1.0
            )
        };
        cube("low", 0.0)
            + &cube("high", 1.0)
            + &format!(
                "[[set]]\nname = 'right'\nwithin = 'high_ymin'\nboxes = [{{ min = [0.6, 1, 0], max = [1, 1, 1] }}]\n\
                 [[contact]]\nslave = 'high_ymin'\nmaster = 'low_ymax'\nfriction = 0.0\nadjust = {adjust}\n\
                 [[dirichlet]]\nset = 'low_ymin'\n[[dirichlet]]\nset = 'high_ymax'\n\
                 motion = [{{ t = 1, u = [0, {:?}, 0] }}]\n[load_path]\nsteps = 1\n",
                -press
            )
    };
    let force = |adjust: &str, press: f64| {
        let mut problem = problem(&cubes(adjust, press));
        let density = problem.initial_density().clone();
        let run = forward(&mut problem, &density);
        let found = slipstick::quantities::quantities(&problem, &run.path);
        *found.get("high_ymin_normal_force").unwrap().last().unwrap()
    };
    for (press, expected) in [(0.04, 0.0), (0.08, 15.0), (0.25, 100.0)] {
        let found = force("{ gap = 0.05 }", press);
        assert!((found - expected).abs() < 1e-8 * (1.0 + expected), "{press}: {found} {expected}");
    }
    // an overlap stresses the cubes before they are moved
    assert!((force("{ gap = -0.02 }", 1e-9) - 10.0).abs() < 1e-5);
    let [all, some, none] =
        ["{ gap = 0.05 }", "{ nodes = 'right', gap = 0.05 }", "{ nodes = 'right' }"].map(|of| force(of, 0.08));
    assert!(all < some && some < none && (none - 40.0).abs() < 1e-6, "{all} {some} {none}");
    let surface = force("{ nodes = 'high_ymin', gap = 0.05 }", 0.08);
    assert!((surface - all).abs() < 1e-9, "a surface is a set of nodes too: {surface} {all}");
    let within = force("{ distance = 0.01, gap = 0.05 }", 0.08);
    assert!((within - all).abs() < 1e-9, "they touch, so they are within the distance: {within} {all}");
    let adjusted = inspected(&cubes("{ nodes = 'right', gap = 0.05 }", 0.08)).contacts[0].adjusted.expect("adjusted");
    assert_eq!((adjusted.nodes, adjusted.left), (4, 6), "{adjusted:?}");
    // with pressures at the points, the gaps of nodes count, not their means: by hand, (0.01 + 0.1 x)/cos φ, of which only
    // that at x = 0 is below 0.015; the mean around this node is 0.018, and the nodes at x = 1 look past the other cube
    let tilted = cubes("0.015", 0.08).replace(
        "name = 'high'\n",
        "name = 'high'\n\
         place = { rotate = { axis = [0, 0, 1], degrees = 5.739170477266787 }, translate = [0.1, 0.01501256289338, 0] }\n",
    );
    let tilted = tilted.replace("min = [0.6, 1, 0], max = [1, 1, 1]", "min = [0.6, 1, 0], max = [1, 1.2, 1]");
    for (place, expected) in [("points", (2, 6)), ("nodes", (0, 10))] {
        let law = format!("adjust = 0.015\nenforcement = {{ penalty = {{ pressure_at = '{place}' }} }}");
        let adjusted = inspected(&tilted.replace("adjust = 0.015", &law)).contacts[0].adjusted.expect("adjusted");
        assert_eq!((adjusted.nodes, adjusted.left), expected, "{place}: {adjusted:?}");
    }
}

/// A fit of 6 on 8 facets with fewer elements, as a design whose objective is the contact force.
fn designed(fit: &str) -> String {
    fit.replace("elements = [6, 4, 1]", "elements = [6, 1, 1]")
        .replace("elements = [8, 4, 1]", "elements = [8, 1, 1]")
        .replace("steps = 1\n", "steps = 2\ntolerance = { relative = 1e-12 }\n")
        + "[design]\nbodies = ['shaft', 'hub']\ninitial = 0.7\n[objective]\ncontact_force = { steps = 'all' }\n\
           [[load]]\nsurface = 'hub_outer'\npressure = 300.0\n"
}

/// Adjoint gradients of a case with adjusted nodes agree with central differences.
#[test]
fn gradient_of_an_adjusted_fit() {
    let interference = "{ gap = -0.01 }";
    for (enforcement, shape, adjust) in [
        ("lagrange = {}", "standard", "0.5"),
        ("lagrange = {}", "dual", "0.5"),
        ("penalty = {}", "standard", "0.5"),
        ("lagrange = {}", "standard", interference),
    ] {
        let more = format!(
            "surfaces = 'faceted'\nadjust = {adjust}\nmultiplier_shape = '{shape}'\nenforcement = {{ {enforcement} }}"
        );
        let text = designed(&fit([6, 8], 1, 0.2, &more));
        let mut problem: Problem = problem(&text);
        let largest =
            problem.analysis.model().interfaces()[0].adjusted.iter().fold(0.0, |m: f64, gap| m.max(gap.abs()));
        let density = random_density(&problem, 5);
        let check = check_gradient(&mut problem, &density);
        println!("{enforcement} {shape}: adjusted by {largest:.3}, {:.1e} {:?}", check.error, check.statuses);
        assert!(largest > 0.05 && check.error < 1e-6, "{enforcement} {shape}: {largest} {:e}", check.error);
        assert!(check.statuses.last().unwrap().contains(['l', 't', 's']), "{:?}", check.statuses);
    }
}

/// Adjoint gradients with heights above the facets of both sides agree with central differences,
/// for all methods, shapes of multipliers and orders.
#[test]
fn gradient_of_a_fit_of_facets_that_do_not_match() {
    let cases = [("lagrange = {}", "standard", 1), ("lagrange = {}", "dual", 1), ("lagrange = {}", "standard", 2)];
    let methods = [("penalty = {}", "standard", 1), ("augmented = { tolerance = 1e-11 }", "dual", 1)];
    for (enforcement, shape, order) in cases.into_iter().chain(methods) {
        let more = format!("multiplier_shape = '{shape}'\nenforcement = {{ {enforcement} }}");
        // with the sides of both bodies held, nothing would determine the friction along z of the nodes
        // between the sides
        let friction = if order == 1 { 0.2 } else { 0.0 };
        let around = if order == 1 { [6, 8] } else { [4, 6] };
        let text = designed(&fit(around, order, friction, &more));
        let mut problem: Problem = problem(&text);
        let density = random_density(&problem, 5);
        let check = check_gradient(&mut problem, &density);
        println!("{enforcement} {shape} order {order}: {:.1e} {:?}", check.error, check.statuses);
        assert!(check.error < 1e-6, "{enforcement} {shape} order {order}: {:e} {:?}", check.error, check.statuses);
        assert!(check.statuses.last().unwrap().contains(['l', 't', 's']), "{:?}", check.statuses);
    }
}

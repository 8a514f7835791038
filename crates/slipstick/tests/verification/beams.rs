//! Two beams, one passing over the other: code_aster's test SSNV505.

use crate::chapter::Chapter;
use crate::common::{forward, problem};
use crate::finding::Finding;
use slipstick::quantities::quantities;

pub fn chapter() -> Chapter {
    Chapter {
        key: "beams",
        title: "Beam sliding over a beam, against code_aster",
        about: "
code_aster's test SSNV505. Two beams (2032 × 63.5 × 10.16, E = 6894.8, ν = 0.3333, St.
Venant–Kirchhoff, no friction) lie one above the other. The lower one is clamped at its left end,
the upper one at its right end. A line across the top of the upper beam, at two thirds of its length
from the clamp, is moved down by 790; the end of the upper beam touches the lower one and slides
along it. The numbers are the sums of the vertical reactions at both clamps at five times; at t =
0.2, the beams do not touch yet. Both programs use 40 × 3 × 1 elements per beam.

* *linear*: variant D, linear hexahedra in plane strain.
* *27 nodes*: variant L. Its mesh was converted from 20-node elements. Supports hold only the
  original nodes; the added face and centre nodes are free, including in the width direction.
* *27 nodes, plane strain*: compared with variant K, which has 20 nodes, all of them held.

The slave is the bottom and the end of the upper beam, and two facets of its top, because towards
the end of the path the edge between end and top touches the lower beam
([edges](edges.md#sharp-edges-of-the-slave)).",
        remarks: "
code_aster's two contact algorithms differ by 0.2 % with linear elements. The variants show what
matters: a slave without the top has normals of one side only at its upper edge, so contact pushes
along the beam at the end. Linear elements are too stiff in bending by a third, as the finer mesh
and the quadratic elements show.",
        quick: false,
        run: || Some(run()),
    }
}

/// Sum of the reactions along y at both clamps at t = 0.2, 0.4, 0.6, 0.8 and 1 in code_aster, with
/// linear hexahedra (variant D). At 0.2, the beams do not touch yet.
const LINEAR: [f64; 5] = [436.995, 1668.033, 3264.530, 2741.976, 3092.520];
/// With hexahedra of 20 nodes (variant K, contact on the whole surfaces).
const TWENTY_NODES: [f64; 5] = [348.709, 1330.027, 2604.895, 2191.790, 2468.556];
/// With hexahedra of 27 nodes (variant L, contact on the whole surfaces), converted from those of 20
/// nodes, whose supports do not hold the new nodes.
const TWENTY_SEVEN_NODES: [f64; 5] = [325.581, 1240.461, 2431.474, 2051.495, 2304.929];

/// Bound before contact: the elements alone.
const FIRST: f64 = 1e-4;
/// Bound with contact.
const LATER: f64 = 0.01;

/// The nodes that the supports hold.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Held {
    /// All nodes.
    All,
    /// Only those at corners and edges of the elements.
    Edges,
}

/// One calculation.
#[derive(Debug, Clone, Copy)]
struct Beams {
    order: usize,
    held: Held,
    /// Elements along and across a beam.
    elements: [usize; 2],
    /// Shape functions of the multipliers.
    shape: &'static str,
    /// Whether the first part of the top of the upper beam belongs to the slave.
    with_top: bool,
    /// The path ends after this many fifths of the motion.
    parts: usize,
}

/// The mesh of code_aster's test.
const LINEAR_BEAMS: Beams =
    Beams { order: 1, held: Held::All, elements: [40, 3], shape: "dual", with_top: true, parts: 5 };

/// `boxes = …` of a node set of a beam, whose width is 10.16.
fn held_nodes(held: Held, [nx, ny]: [usize; 2], [x0, x1]: [f64; 2], [y0, y1]: [f64; 2]) -> String {
    let x = |i: usize| x0 + (x1 - x0) * i as f64 / nx as f64;
    let y = |j: usize| y0 + (y1 - y0) * j as f64 / ny as f64;
    let (back, front) = (-5.08, 5.08);
    let mut boxes = Vec::new();
    match held {
        Held::All => boxes.push(([x0, y0, back], [x1, y1, front])),
        Held::Edges => {
            for z in [back, front] {
                boxes.extend((0..=ny).map(|j| ([x0, y(j), z], [x1, y(j), z])));
                boxes.extend((0..=nx).map(|i| ([x(i), y0, z], [x(i), y1, z])));
            }
            let across = |i: usize| (0..=ny).map(move |j| ([x(i), y(j), back], [x(i), y(j), front]));
            boxes.extend((0..=nx).flat_map(across));
        }
    }
    let around = |at: [f64; 3], margin: f64| at.map(|c| c + margin);
    let text = |(min, max): &([f64; 3], [f64; 3])| {
        format!("    {{ min = {:?}, max = {:?} }},\n", around(*min, -0.01), around(*max, 0.01))
    };
    format!("boxes = [\n{}]\n", boxes.iter().map(text).collect::<String>())
}

/// St. Venant-Kirchhoff, plane strain, without friction. The lower beam is clamped at x = 0, the
/// upper one at its other end; two thirds along it, a line across its top moves down, free along x.
/// The slave is the bottom and the end of the upper beam, and the first part of its top: towards the
/// end of the path, the edge between end and top touches the lower beam. Contact at an edge acts along
/// the normal of the master, as in code_aster, only if both sides of the edge belong to the slave.
fn case(beams: Beams) -> String {
    let Beams { order, held, elements, shape, with_top, parts } = beams;
    let [nx, ny] = elements;
    let (lower, upper) = (([0.0, 2032.0], [-31.75, 31.75]), ([914.4, 2946.4], [476.25, 539.75]));
    let top = if with_top { "    { min = [914.0, 539.5, -6.0], max = [1016.5, 540.0, 6.0] },\n" } else { "" };
    let mut bodies = String::new();
    for (name, clamp, (x, y)) in [("lower", "xmin", lower), ("upper", "xmax", upper)] {
        bodies += &format!(
            "[[body]]
name = '{name}'
order = {order}
box = {{ min = [{:?}, {:?}, -5.08], max = [{:?}, {:?}, 5.08], elements = [{nx}, {ny}, 1] }}
material = {{ st_venant_kirchhoff = {{ youngs_modulus = 6894.8, poisson_ratio = 0.3333 }} }}
[[set]]
name = '{name}_held'
{}[[dirichlet]]
set = '{name}_held'
components = ['z']
[[set]]
name = '{name}_clamp'
within = '{name}_{clamp}'
{}[[dirichlet]]
set = '{name}_clamp'
components = ['x', 'y']
",
            x[0],
            y[0],
            x[1],
            y[1],
            held_nodes(held, elements, x, y),
            held_nodes(held, elements, x, y)
        );
    }
    format!(
        "{bodies}
[[surface]]
name = 'edge'
body = 'upper'
boxes = [
    {{ min = [914.0, 476.0, -6.0], max = [2947.0, 476.5, 6.0] }},
    {{ min = [914.0, 476.0, -6.0], max = [914.5, 540.0, 6.0] }},
{top}]
[[set]]
name = 'line'
boxes = [{{ min = [1625.5, 539.5, -6.0], max = [1625.7, 540.0, 6.0] }}]
[[contact]]
slave = 'edge'
master = 'lower_ymax'
friction = 0.0
multiplier_shape = '{shape}'
[[dirichlet]]
set = 'line'
components = ['y']
motion = [{{ t = 1.0, u = [0.0, {:?}, 0.0] }}]
[load_path]
steps = {}
",
        -158.0 * parts as f64,
        10 * parts,
    )
}

/// The forces at the ends of all fifths.
fn forces(beams: Beams) -> Vec<f64> {
    let mut problem = problem(&case(beams));
    let density = problem.initial_density().clone();
    let run = forward(&mut problem, &density);
    let found = quantities(&problem, &run.path);
    let lower = found.get("reaction_lower_clamp_y").expect("a support");
    let upper = found.get("reaction_upper_clamp_y").expect("a support");
    (1..=beams.parts).map(|part| lower[10 * part] + upper[10 * part]).collect()
}

/// Findings for the forces; the one before contact has a bound of its own.
fn compare(name: &str, beams: Beams, expected: &[f64], first: f64) -> Vec<Finding> {
    let found = forces(beams).into_iter().zip(expected).enumerate();
    found
        .map(|(k, (force, &expected))| {
            let within = if k == 0 { first } else { LATER };
            Finding::value(format!("{name}, t = {:.1}", 0.2 * (k + 1) as f64), expected, within, force)
        })
        .collect()
}

const QUADRATIC_BEAMS: Beams = Beams { order: 2, ..LINEAR_BEAMS };

fn run() -> Vec<Finding> {
    let free_centres = Beams { held: Held::Edges, ..QUADRATIC_BEAMS };
    let mut findings = compare("linear", LINEAR_BEAMS, &LINEAR, FIRST);
    findings.extend(compare("27 nodes", free_centres, &TWENTY_SEVEN_NODES, FIRST));
    findings.extend(compare("27 nodes, plane strain", QUADRATIC_BEAMS, &TWENTY_NODES, LATER));
    let variants = [
        ("linear, slave without the top", Beams { with_top: false, ..LINEAR_BEAMS }),
        ("linear, standard shapes", Beams { shape: "standard", ..LINEAR_BEAMS }),
        ("linear, 80 × 6 elements", Beams { elements: [80, 6], ..LINEAR_BEAMS }),
    ];
    for (name, beams) in variants {
        let last = forces(beams)[4];
        findings.push(Finding::compare(format!("{name}, t = 1.0"), LINEAR[4], last));
    }
    findings
}

fn assert_all(findings: &[Finding]) {
    let outside: Vec<_> = findings.iter().filter(|finding| !finding.holds()).collect();
    assert!(outside.is_empty(), "{outside:#?}");
}

/// Before contact and shortly after.
#[test]
fn linear_hexahedra_find_code_asters_first_forces() {
    assert_all(&compare("linear", Beams { parts: 2, ..LINEAR_BEAMS }, &LINEAR, FIRST));
}

/// Before contact.
#[test]
fn quadratic_hexahedra_find_code_asters_first_force() {
    let beams = Beams { held: Held::Edges, parts: 1, ..QUADRATIC_BEAMS };
    assert_all(&compare("27 nodes", beams, &TWENTY_SEVEN_NODES, FIRST));
}

/// Before contact, the upper beam bends like a beam in plane strain, P = 3 E I δ/((1 − ν²) L³), up to
/// the stiffening by its deflection of 0.12 L.
#[test]
fn quadratic_hexahedra_bend_like_a_beam() {
    let force = forces(Beams { parts: 1, ..QUADRATIC_BEAMS })[0];
    let (modulus, ratio, length, height, width): (f64, f64, f64, f64, f64) = (6894.8, 0.3333, 1320.8, 63.5, 10.16);
    let inertia = width * height.powi(3) / 12.0;
    let expected = 3.0 * modulus / (1.0 - ratio * ratio) * inertia * 158.0 / length.powi(3);
    println!("{force:.3}, expected {expected:.3}");
    assert!((force / expected - 1.0).abs() < LATER, "{force} {expected}");
}

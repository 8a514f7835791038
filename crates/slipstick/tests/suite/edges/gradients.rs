//! The adjoint gradient compared with central differences if slave edges are sharp, and if the
//! other surface covers nodes only partly.

use super::nose::nose;
use crate::common::scene::{LAGRANGE, Scene, augmented, penalty};
use crate::common::{check_gradient, problem_with, random_density};
use slipstick::build::Problem;

/// As in `tests/suite/gradient.rs`.
const BOUND: f64 = 1e-7;

pub fn methods() -> [(&'static str, String); 3] {
    [("Lagrange", LAGRANGE.into()), ("penalty", penalty(2e4)), ("augmented", augmented(1e4, 1e-11))]
}

/// Compares, and returns the statuses of all states and the compliance of each row at the last one.
pub fn check(name: &str, problem: &mut Problem) -> (Vec<Vec<char>>, Vec<f64>) {
    let density = random_density(problem, 7);
    let checked = check_gradient(problem, &density);
    println!("{name}: error {:.1e}, {:?}", checked.error, checked.statuses);
    assert!(checked.error < BOUND, "{name}: the gradient is off by {:e}; {:?}", checked.error, checked.statuses);
    let [.., previous, last] = &checked.forward.path.states[..] else { panic!("two states") };
    let contact = problem.analysis.design.contact_at(&previous.state, &last.state.unknowns, last.time, false);
    let contact = contact.expect("a converged state");
    let statuses: Vec<Vec<char>> = checked.statuses.iter().map(|word| word.chars().collect()).collect();
    let compliance = (0..).map_while(|j| Some(contact.measures(j)?.compliance().0)).collect();
    (statuses, compliance)
}

/// A block that overhangs the slab by half of its first facets: nodes there have a compliant
/// condition.
#[test]
fn gradient_of_a_block_overhanging_the_slab() {
    for (method, enforcement) in methods() {
        for shape in ["standard", "dual"] {
            let scene = Scene {
                slab: [3, 1, 1],
                block: [2, 1, 1],
                corner: [-0.2, 1.0, 0.1],
                enforcement: enforcement.clone(),
                shape,
                friction: 0.1,
                motion: "[{ t = 0.5, u = [0, -0.06, 0] }, { t = 1.0, u = [0.05, -0.06, 0.03] }]".into(),
                steps: 4,
                ..Scene::default()
            };
            let (statuses, compliance) = check(&format!("{method} {shape}"), &mut problem_with(&scene.text(), &[]));
            let last = statuses.last().expect("a state").iter();
            let compliant = last.zip(&compliance).filter(|(status, k)| **status != 'o' && **k > 0.0).count();
            // the penalty method uses ε instead
            assert_eq!(compliant > 0, method != "penalty", "{method} {shape}: {compliance:?}");
        }
    }
}

/// An edge that is pressed into a slab and dragged along it, with its two nodes as sharp slave
/// nodes: the case, and the rows of these nodes, patch by patch.
fn dragged(
    enforcement: &str,
    shape: &'static str,
    angles: [f64; 2],
    elements: [usize; 3],
    press: f64,
) -> (Problem, Vec<usize>) {
    let motion = format!("[{{ t = 0.4, u = [0, -{press:?}, 0] }}, {{ t = 1.0, u = [0.06, -{press:?}, 0.02] }}]");
    let enforcement = enforcement.to_owned();
    let text =
        Scene { slab: [3, 1, 1], enforcement, shape, friction: 0.3, motion, steps: 5, ..Scene::default() }.text();
    // the block is read from a mesh, with both faces at its edge as the slave
    let start = text.find("name = \"block\"\nbox").expect("the block") + "name = \"block\"\n".len();
    let end = start + text[start..].find("place").expect("its place");
    let after = text[end..].replacen("place = {}", "place = { translate = [1.72, 0, 0.1] }", 1);
    let text = format!("{}mesh = {{ file = 'block' }}\n{after}", &text[..start]).replace("block_ymin", "block_nose");
    // differences need the whole path for each designed element: a few are sufficient
    let text = text.replace("bodies = [\"slab\", \"block\"]", "bodies = [\"slab\"]");
    let [angle, tilt] = angles;
    let problem = problem_with(&text, &[("block", nose(angle, tilt, 0.8, elements))]);
    let nodes = problem.analysis.model().interfaces()[0].interface.slave_nodes();
    let sharp: Vec<usize> = (0..nodes.len()).filter(|&j| nodes[j].sharp).collect();
    let slaves = problem.analysis.model().slave_nodes();
    assert_eq!(sharp.len(), 4, "two nodes with two patches each");
    assert!(sharp.chunks(2).all(|rows| slaves[rows[0]] == slaves[rows[1]]));
    (problem, sharp)
}

/// The bottom is in contact, rotated by 10 degrees: one patch of each node is in contact, with the
/// slab's normal.
#[test]
fn gradient_with_a_sharp_slave_edge() {
    for (method, enforcement) in methods() {
        for shape in ["standard", "dual"] {
            let (mut problem, sharp) = dragged(&enforcement, shape, [75.0, 10.0], [3, 2, 1], 0.1);
            let name = format!("{method} {shape}");
            let last = check(&name, &mut problem).0.pop().expect("a state");
            assert!(sharp.chunks(2).all(|pair| pair.iter().any(|&j| last[j] != 'o')), "{name}: {last:?}");
        }
    }
}

/// Both faces are pressed into the slab, and both patches are in contact during the path. With
/// standard shapes, because with dual ones both conditions of a node on a flat facet are the same
/// (docs/edges.md).
#[test]
fn gradient_with_both_sides_of_a_sharp_edge_in_contact() {
    for (method, enforcement) in methods() {
        let (mut problem, sharp) = dragged(&enforcement, "standard", [75.0, 50.0], [4, 4, 1], 0.24);
        let (statuses, _) = check(method, &mut problem);
        let both = |state: &Vec<char>| sharp.iter().all(|&j| state[j] != 'o');
        assert!(statuses.iter().any(both), "{method}: {statuses:?}");
    }
}

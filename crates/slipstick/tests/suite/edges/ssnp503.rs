//! A block slides between two others, μ = 0.5: problem SSNP503 (variant g) of code_aster's public
//! tests. Pressures at the nodes of the lower slave face; the edge of the sliding block is at one
//! of its nodes at t = 0.5 and 1 and in the middle of a facet at t = 0.25 and 0.75.
//!
//! At t = 0.25 and 0.75 code_aster's numbers are not compared: its contact condition is enforced at
//! each node, and the node of the half-covered facet beyond the edge stays open, so that the next
//! one carries its part (20439 at t = 0.75, where a fine mesh has 17091). The bounds there are on
//! the distance from a mesh four times as fine.

use super::overhang::largest;
use super::{even, grid, results, solve};
use crate::solved::Solved;

/// Our results are compared with these. Numbers of code_aster's test: t, then pressures at x = 0
/// … 4.
pub const MATCHED: [(usize, [f64; 5]); 2] =
    [(2, [0.0, 9947.0, 11458.0, 10645.0, 8116.0]), (4, [0.0, 0.0, 18513.0, 21053.0, 16538.0])];

/// Our results are not compared with these, which belong to half-covered facets.
pub const BETWEEN: [(usize, [f64; 5]); 2] =
    [(1, [0.0, 7439.0, 5560.0, 5789.0, 3872.0]), (3, [0.0, 0.0, 20439.0, 16585.0, 11025.0])];

/// Deviations of smaller pressures are relative to this one, which is small compared to the
/// pressures of 2e4.
const SMALL: f64 = 100.0;

/// Refinement factor of the reference.
const FINE: usize = 4;

/// The problem with every element divided by `fine` along x and y, and χ.
pub fn solved(fine: usize, edge_cover: f64) -> Solved {
    let layers = |heights: &[f64]| -> Vec<f64> {
        let mut ticks = vec![heights[0]];
        for pair in heights.windows(2) {
            ticks.extend_from_slice(&even(pair[0], pair[1], fine)[1..]);
        }
        ticks
    };
    let (along, across) = (even(0.0, 4.0, 4 * fine), [0.0, 1.0]);
    let heights: [&[f64]; 3] = [&[0.0, 1.0, 2.0, 2.5], &[2.5, 3.0, 4.0, 5.0, 6.0, 6.5], &[6.5, 7.0, 8.0, 9.0]];
    let names = ["lower", "middle", "upper"];
    let meshes: Vec<_> =
        names.iter().zip(heights).map(|(name, y)| (*name, grid(name, [&along, &layers(y), &across]))).collect();
    let mut text: String = names.iter().map(|name| super::body(name, 1e8)).collect();
    for (slave, master) in [("lower_ymax", "middle_ymin"), ("upper_ymin", "middle_ymax")] {
        text += &format!(
            "[[contact]]\nslave = '{slave}'\nmaster = '{master}'\nfriction = 0.5\nedge_cover = {edge_cover:?}\n"
        );
    }
    for (face, y, motion) in [("lower_ymin", 0.0, 1e-3), ("upper_ymax", 9.0, -1e-3)] {
        text += &format!(
            "[[dirichlet]]\nset = '{face}'\ncomponents = ['y', 'z']\nmotion = [{{ t = 1, u = [0, {motion:?}, 0] }}]\n\
             [[set]]\nname = '{face}_ends'\nboxes = [{{ min = [-0.1, {a:?}, -1], max = [0.1, {b:?}, 2] }}, \
             {{ min = [3.9, {a:?}, -1], max = [4.1, {b:?}, 2] }}]\nwithin = '{face}'\n\
             [[dirichlet]]\nset = '{face}_ends'\ncomponents = ['x']\n",
            a = y - 0.1,
            b = y + 0.1
        );
    }
    text += "[[dirichlet]]\nset = 'middle_xmin'\ncomponents = ['x', 'z']\nmotion = [{ t = 1, u = [2, 0, 0] }]\n\
             [load_path]\nsteps = 4\n";
    solve(&text, &meshes)
}

/// Nodal contact forces normal to the lower slave face, summed across, along x.
fn forces(solved: &mut Solved, step: usize) -> Vec<f64> {
    let found = results(solved, step);
    let mesh = &solved.problem.mesh;
    let mut nodes = mesh.surfaces["lower_ymax"].nodes();
    nodes.sort_by(|&a, &b| mesh.nodes[a as usize][0].total_cmp(&mesh.nodes[b as usize][0]));
    let force = |nodes: &[u32]| nodes.iter().map(|&n| -found.force[3 * n as usize + 1]).sum::<f64>();
    nodes.chunks(2).map(force).collect()
}

/// Pressures at the coarse nodes with z = 0.
pub fn pressures(solved: &mut Solved, step: usize) -> [f64; 5] {
    let found = results(solved, step);
    let mesh = &solved.problem.mesh;
    let at = |x: usize| {
        let node = mesh.surfaces["lower_ymax"].nodes().into_iter().find(|&n| {
            let [a, _, c] = mesh.nodes[n as usize];
            (a - x as f64).abs() < 1e-9 && c.abs() < 1e-9
        });
        found.pressure[node.expect("a node") as usize]
    };
    std::array::from_fn(at)
}

/// Pressures of the fine mesh at the nodes of the coarse one: nodal forces with the same virtual
/// work, divided by the coarse areas.
pub fn averaged(solved: &mut Solved, fine: usize, step: usize) -> [f64; 5] {
    let force = forces(solved, step);
    let hat = |k: usize, i: usize| (1.0 - (i as f64 / fine as f64 - k as f64).abs()).max(0.0);
    std::array::from_fn(|k| {
        let area = if [0, 4].contains(&k) { 0.5 } else { 1.0 };
        force.iter().enumerate().map(|(i, f)| hat(k, i) * f).sum::<f64>() / area
    })
}

/// Largest difference of two rows relative to the largest value of the second.
fn distance(a: [f64; 5], b: [f64; 5]) -> f64 {
    largest(a.iter().zip(b).map(|(a, b)| a - b)) / largest(b)
}

#[test]
fn pressures_of_a_block_between_blocks() {
    let (mut coarse, mut reference) = (solved(1, 0.5), solved(FINE, 0.5));
    for (step, expected) in MATCHED {
        let found = pressures(&mut coarse, step);
        println!("t = {}: {found:.0?}, code_aster {expected:.0?}", 0.25 * step as f64);
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 0.01 * largest([expected, SMALL]), "{found} for {expected}");
        }
    }
    for (step, node_wise) in BETWEEN {
        let (found, exact) = (pressures(&mut coarse, step), averaged(&mut reference, FINE, step));
        let (ours, theirs) = (distance(found, exact), distance(node_wise, exact));
        println!("t = {}: {found:.0?}, fine {exact:.0?}; off {ours:.3}, code_aster {theirs:.3}", 0.25 * step as f64);
        assert!(ours < 0.12 && ours < 0.6 * theirs, "{ours} {theirs}");
    }
}

//! A block on a slab, overhanging the slab's edge, in plane strain, and the nodal forces from fine
//! meshes.

use super::{body, even, grid, results, solve};
use crate::solved::Solved;

/// Pressure on the block's top, all of which is transferred to the slab. \[F/L²\]
pub const PRESSURE: f64 = 10.0;

/// Length of the block, whose depth is 1. \[L\]
pub const LENGTH: f64 = 4.0;

/// A block (4 × 1) is pressed onto a slab (5 × 1) and pushed over the slab's edge, one element
/// across.
#[derive(Debug, Clone, Copy)]
pub struct Overhang {
    /// Elements per unit length. In a reference with more than four times as many, both meshes
    /// match at all steps.
    pub fine: usize,
    /// "standard" or "dual".
    pub shape: &'static str,
    /// Coefficient of friction.
    pub friction: f64,
    /// χ; `None`: the default.
    pub edge_cover: Option<f64>,
    /// Overhang at the start and at the end. \[L\]
    pub overhang: [f64; 2],
    /// Number of sliding steps, after one pressing step.
    pub steps: usize,
}

impl Overhang {
    /// Solves: load step 1 presses, the other steps slide.
    pub fn solve(&self) -> Solved {
        let Self { fine, shape, friction, edge_cover, overhang: [start, end], steps } = *self;
        let (vertical, across) = (fine.max(2), [0.0, 1.0]);
        let block = [even(-start, LENGTH - start, 4 * fine), even(1.0, 2.0, vertical)];
        let slab = [even(0.0, 5.0, 5 * fine), even(0.0, 1.0, vertical)];
        let cover = edge_cover.map_or(String::new(), |cover| format!("edge_cover = {cover:?}\n"));
        let pressed = 1.0 / (1 + steps) as f64;
        let slide = if steps == 0 { String::new() } else { format!(", {{ t = 1, u = [{:?}, 0, 0] }}", start - end) };
        let text = format!(
            "{}{}[[set]]\nname = 'all'\nboxes = [{{ min = [-9, -9, -9], max = [9, 9, 9] }}]\n\
             [[contact]]\nslave = 'block_ymin'\nmaster = 'slab_ymax'\nfriction = {friction:?}\n\
             multiplier_shape = '{shape}'\n{cover}\
             [[dirichlet]]\nset = 'all'\ncomponents = ['z']\n\
             [[dirichlet]]\nset = 'slab_ymin'\ncomponents = ['x', 'y']\n\
             [[dirichlet]]\nset = 'block_ymax'\ncomponents = ['x']\n\
             motion = [{{ t = {pressed:?}, u = [0, 0, 0] }}{slide}]\n\
             [[load]]\nsurface = 'block_ymax'\npressure = {PRESSURE:?}\n\
             amplitude = [{{ t = {pressed:?}, factor = 1 }}]\n\
             [load_path]\nsteps = {}\ntolerance = {{ relative = 1e-11 }}\n",
            body("block", 1000.0),
            body("slab", 1000.0),
            1 + steps
        );
        let meshes = [
            ("block", grid("block", [&block[0], &block[1], &across])),
            ("slab", grid("slab", [&slab[0], &slab[1], &across])),
        ];
        solve(&text, &meshes)
    }

    /// Ratio of the elements per length to those of `coarse`, of which this is a refinement.
    fn ratio(&self, coarse: &Self) -> usize {
        assert_eq!(self.fine % coarse.fine, 0);
        self.fine / coarse.fine
    }
}

/// Nodal contact forces (x, y) on the block's bottom along x after a load step, as sums of both
/// nodes across, and the tributary areas.
pub fn forces(case: &Overhang, solved: &mut Solved, step: usize) -> (Vec<[f64; 2]>, Vec<f64>) {
    let found = results(solved, step);
    let mesh = &solved.problem.mesh;
    let surface = &mesh.surfaces["block_ymin"];
    let mut nodes = surface.nodes();
    nodes.sort_by(|&a, &b| mesh.nodes[a as usize][0].total_cmp(&mesh.nodes[b as usize][0]));
    let pair = |pair: &[u32]| -> [f64; 2] {
        std::array::from_fn(|c| pair.iter().map(|&n| found.force[3 * n as usize + c]).sum::<f64>())
    };
    let force: Vec<[f64; 2]> = nodes.chunks(2).map(pair).collect();
    assert_eq!(force.len(), 4 * case.fine + 1);
    // current lengths of the elements, each half of which belongs to a node
    let x: Vec<f64> = nodes.chunks(2).map(|pair| solved.position(pair[0], step).x).collect();
    let half = |a: usize, b: usize| 0.5 * (x[b] - x[a]);
    let last = force.len() - 1;
    let area = |k: usize| half(k.saturating_sub(1), k) + half(k, (k + 1).min(last));
    (force, (0..=last).map(area).collect())
}

/// Normal forces of a fine mesh on the nodes of a coarse one: Σ_i N_k(X_i) f_i, with the same
/// virtual work for every displacement that the coarse mesh can represent.
pub fn projected(fine: &Overhang, coarse: &Overhang, force: &[[f64; 2]]) -> Vec<f64> {
    let ratio = fine.ratio(coarse);
    let hat = |k: usize, i: usize| (1.0 - (i as f64 / ratio as f64 - k as f64).abs()).max(0.0);
    (0..=4 * coarse.fine).map(|k| force.iter().enumerate().map(|(i, f)| hat(k, i) * f[1]).sum()).collect()
}

/// Largest of some numbers.
pub fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, |a, b| f64::max(a, b.abs()))
}

//! Bodies that come loose before a step fails: only contact holds them, and their last motion was almost rigid.

use super::places::AXES;
use nalgebra::{Matrix3, Vector3};
use slipstick_mesh::Mesh;
use slipstick_model::problem::Problem;
use slipstick_path::{LoadTime, MarchFailure, PathState};

/// Share of the square of a body's motion that is a rigid motion if the body comes loose.
const RIGID: f64 = 0.8;

/// Ratio of the rate of its motion to that in the step [`BEFORE`] steps before the one that fails.
const FASTER: f64 = 1.5;

/// The user's steps over which rates are compared.
const BEFORE: usize = 3;

/// Components of a motion that are less than this fraction of the largest one are not told.
const LEADING: f64 = 0.3;

/// A sentence about each body that only contact holds and that moved almost as a rigid body, ever faster, in the last
/// states of a path under loads.
///
/// Test: `a_block_that_tips_over_is_named_with_its_motion`.
pub(super) fn loosened(failure: &MarchFailure, problem: &Problem) -> Vec<String> {
    let (mesh, model) = (&problem.mesh, problem.analysis.model());
    if !model.has_loads() {
        return Vec::new();
    }
    // other ranks may keep parts of earlier states
    let whole = |state: &&PathState| {
        state.time.case == failure.increment.case && state.state.unknowns.len() == failure.iterate.len()
    };
    let states: Vec<&PathState> = failure.path.states.iter().filter(whole).collect();
    // the end of the last complete step but BEFORE, which has a step of its own before it
    let earlier = failure.step.checked_sub(BEFORE + 1).filter(|&step| step > 0);
    let from = states.iter().position(|state| earlier.is_some() && state.completes == earlier);
    let Some([first, second, .., before, last]) = from.map(|from| &states[from..]) else { return Vec::new() };
    let end = LoadTime { t: failure.increment.to, ..last.time };
    let held = |body: &slipstick_mesh::Body| model.is_held_without_contact(&body.name, &last.state.unknowns, end);
    let bodies = mesh.bodies.iter().filter(|body| !held(body));
    let sentence = |body: &slipstick_mesh::Body| {
        let rate = |from: &PathState, to: &PathState| {
            let motion = Motion::between(mesh, body.nodes.clone(), &from.state.unknowns, &to.state.unknowns);
            (motion.square.sqrt() / (to.time.t - from.time.t), motion)
        };
        let (rate_before, (rate_now, motion)) = (rate(first, second).0, rate(before, last));
        (motion.rigid >= RIGID * motion.square && rate_now >= FASTER * rate_before && rate_before > 0.0).then(|| {
            format!(
                "only contact holds body `{}`, and the loads made it move {}, at last {:.1} times as fast as in step \
                 {}: they may exceed what contact can carry",
                body.name,
                motion.in_words(),
                rate_now / rate_before,
                failure.step - BEFORE
            )
        })
    };
    bodies.filter_map(sentence).collect()
}

/// The motion of a body between two states.
struct Motion {
    /// Mean square of the displacements of its nodes. \[L²\]
    square: f64,
    /// The part of it that the rigid motion below makes up. \[L²\]
    rigid: f64,
    /// Along the axes, and about them times the radius of gyration of the nodes. \[L\]
    components: [f64; 6],
}

impl Motion {
    fn between(mesh: &Mesh, nodes: impl Iterator<Item = usize> + Clone, from: &[f64], to: &[f64]) -> Self {
        let at = |d: &[f64], node: usize| Vector3::from_column_slice(&d[3 * node..][..3]);
        let place = |node: usize| Vector3::from(mesh.nodes[node]) + at(from, node);
        let count = nodes.clone().count() as f64;
        let mean = |of: &dyn Fn(usize) -> Vector3<f64>| nodes.clone().map(of).sum::<Vector3<f64>>() / count;
        let (centre, along) = (mean(&place), mean(&|node| at(to, node) - at(from, node)));
        let arm = |node: usize| place(node) - centre;
        let rest = |node: usize| at(to, node) - at(from, node) - along;
        // the rotation that fits best: its moment is that of the displacements
        let inertia = |arm: Vector3<f64>| Matrix3::identity() * arm.norm_squared() - arm * arm.transpose();
        let inertia = nodes.clone().map(|node| inertia(arm(node))).sum::<Matrix3<f64>>() / count;
        let moment = mean(&|node| arm(node).cross(&rest(node)));
        let about = inertia.try_inverse().unwrap_or_default() * moment;
        let square = along.norm_squared() + nodes.clone().map(|node| rest(node).norm_squared()).sum::<f64>() / count;
        let turn = inertia.diagonal().zip_map(&about, |inertia, about| inertia.max(0.0).sqrt() * about);
        let components = [along.x, along.y, along.z, turn.x, turn.y, turn.z];
        Self { square, rigid: along.norm_squared() + about.dot(&moment), components }
    }

    /// `along x and about −z`.
    fn in_words(&self) -> String {
        let largest = self.components.iter().fold(0.0, |largest: f64, c| largest.max(c.abs()));
        let signed = |k: usize| format!("{}{}", if self.components[k] < 0.0 { "−" } else { "" }, AXES[k % 3]);
        let of = |word: &str, range: std::ops::Range<usize>| {
            let leading = range.filter(|&k| self.components[k].abs() >= LEADING * largest);
            let leading: Vec<String> = leading.map(signed).collect();
            (!leading.is_empty()).then(|| format!("{word} {}", leading.join(", ")))
        };
        let words: Vec<String> = [of("along", 0..3), of("about", 3..6)].into_iter().flatten().collect();
        words.join(" and ")
    }
}

//! The contact part of the tangent, assembled by rows in parallel.
//!
//! Only one thread adds to a block row, node by node in ascending order, so the sum is the same,
//! bit for bit, for any number of threads.

use crate::equations::ContactModel;
use crate::equations::evaluated::{ContactState, NodeState};
use crate::equations::law::NodeLaw;
use crate::equations::node;
use nalgebra::Vector3;
use rayon::prelude::*;
use slipstick_contact::kinematics::NodeKinematics;
use slipstick_linalg::BlockMatrix;
use slipstick_mesh::ContactMap;

/// A slave node with the data for its blocks.
struct Prepared<'a> {
    now: &'a NodeKinematics,
    node: &'a NodeState,
    /// Multiplier row of the node.
    row: usize,
    /// The acting traction as a vector z, and ∂z/∂x; `None` if the node contributes only C = ζ.
    traction: Option<(Vector3<f64>, Vec<f64>)>,
}

/// The term that a node adds to a block row: the force on the `support`-th node, or its own C.
#[derive(Clone, Copy)]
enum Term {
    Force { node: u32, support: u32, weight: f64 },
    Condition { node: u32 },
}

/// Adds ∂R/∂(d, ζ) of contact and ∂C/∂(d, ζ) of this rank's slave nodes.
///
/// Test: `tangent_matches_finite_differences` (tests/suite/derivatives.rs).
pub(in crate::equations) fn add_tangent(model: &ContactModel, contact: &ContactState, matrix: &mut BlockMatrix) {
    let nodes = model.displacement_count() / 3;
    let own: Vec<_> = contact.nodes_here().collect();
    let prepare = |&(j, now, node): &(usize, &'_ NodeKinematics, &'_ NodeState)| {
        let contributes = node.law.contributes();
        (contributes || model.method_of(j).has_multipliers()).then(|| {
            let traction = contributes.then(|| {
                let traction = node.law.traction();
                (now.frame.to_global(&traction.value), node::traction_slope(now, &node.step, &traction))
            });
            (j, traction)
        })
    };
    let traction: Vec<_> = own.par_iter().map(prepare).collect();
    let prepared: Vec<Prepared<'_>> = own
        .iter()
        .zip(traction)
        .filter_map(|(&(_, now, node), prepared)| {
            let (j, traction) = prepared?;
            Some(Prepared { now, node, row: nodes + j, traction })
        })
        .collect();
    let (offsets, terms) = by_rows(&model.points.map, &prepared, matrix.pattern().rows());
    let pattern = matrix.pattern().clone();
    let (mut rest, mut begin) = (matrix.values_mut(), 0);
    let mut rows = Vec::new();
    for row in (0..pattern.rows()).filter(|&row| offsets[row + 1] > offsets[row]) {
        let range = pattern.row_range(row);
        let (blocks, after) = rest[range.start - begin..].split_at_mut(range.len());
        (rest, begin) = (after, range.end);
        rows.push((row, blocks, &terms[offsets[row]..offsets[row + 1]]));
    }
    rows.into_par_iter().for_each(|(row, blocks, terms)| {
        let first = pattern.row_range(row).start;
        let mut add = |column: usize, block: [f64; 9]| {
            let position = pattern.find(row, column).expect("the pattern covers all couplings") - first;
            blocks[position].iter_mut().zip(block).for_each(|(entry, term)| *entry += term);
        };
        for term in terms {
            match *term {
                Term::Force { node, support, weight } => {
                    prepared[node as usize].add_force_row(&model.points.map, support as usize, weight, &mut add);
                }
                Term::Condition { node } => prepared[node as usize].add_condition_row(&model.points.map, &mut add),
            }
        }
    });
}

/// The terms of each block row, in the order of the nodes, and the position where each row's terms
/// begin.
fn by_rows(map: &ContactMap, prepared: &[Prepared<'_>], rows: usize) -> (Vec<usize>, Vec<Term>) {
    let terms = || {
        prepared.iter().zip(0_u32..).flat_map(|(at, node)| {
            let multiplier = matches!(at.node.law, NodeLaw::Multiplier { .. }) || at.traction.is_none();
            let support: &[u32] = if at.traction.is_some() { &at.now.support } else { &[] };
            let forces = support.iter().zip(0_u32..).flat_map(move |(&point, support)| {
                let mut rows = Vec::with_capacity(1);
                map.each(point, |row, weight| rows.push((row as usize, Term::Force { node, support, weight })));
                rows
            });
            forces.chain(multiplier.then_some((at.row, Term::Condition { node })))
        })
    };
    let mut offsets = vec![0; rows + 1];
    terms().for_each(|(row, _)| offsets[row + 1] += 1);
    (0..rows).for_each(|row| offsets[row + 1] += offsets[row]);
    let mut next = offsets.clone();
    let mut sorted = vec![Term::Condition { node: 0 }; offsets[rows]];
    for (row, term) in terms() {
        sorted[next[row]] = term;
        next[row] += 1;
    }
    (offsets, sorted)
}

impl Prepared<'_> {
    /// ∂f_sc/∂x_t = ∂b_js/∂x_t z_c + b_js ∂z_c/∂x_t, and ∂f_s/∂ζ = b_js (frame), times `weight`; x are
    /// the points of the contact surfaces, of which `map` gives the nodes.
    fn add_force_row(&self, map: &ContactMap, s: usize, weight: f64, add: &mut impl FnMut(usize, [f64; 9])) {
        let Self { now, node, row, traction } = self;
        let Some((z, slope)) = traction else { return };
        let (own, columns) = (3 * now.support.len(), 3 * node.step.support.len());
        let (coefficients, gradients) = now.force_row();
        let coefficient = coefficients[s];
        let gradient = &gradients[s * own..][..own];
        for (t, &column) in node.step.support.iter().enumerate() {
            let mut block = [0.0; 9];
            for c in 0..3 {
                for d in 0..3 {
                    let at = 3 * t + d;
                    block[3 * c + d] = coefficient * slope[c * columns + at];
                    if at < own {
                        block[3 * c + d] += gradient[at] * z[c];
                    }
                }
            }
            map.each(column, |column, by_node| {
                let factor = weight * by_node;
                add(column as usize, block.map(|entry| factor * entry));
            });
        }
        if let NodeLaw::Multiplier { .. } = node.law {
            let coefficient = weight * coefficient;
            add(*row, std::array::from_fn(|e| coefficient * now.frame.basis[(e % 3, e / 3)]));
        }
    }

    /// ∂C/∂ζ, and ∂C/∂x through gap, slip and area. C = ζ for a node that contributes nothing else.
    fn add_condition_row(&self, map: &ContactMap, add: &mut impl FnMut(usize, [f64; 9])) {
        let NodeLaw::Multiplier { equation, .. } = &self.node.law else {
            return add(self.row, IDENTITY);
        };
        if self.traction.is_none() {
            return add(self.row, IDENTITY);
        }
        add(self.row, std::array::from_fn(|e| equation.by_multiplier[(e / 3, e % 3)]));
        let rows = node::condition_slopes(self.now, &self.node.step, equation);
        if rows.iter().flatten().all(|&v| v == 0.0) {
            return;
        }
        for (t, &node) in self.node.step.support.iter().enumerate() {
            map.each(node, |node, weight| {
                add(node as usize, std::array::from_fn(|e| weight * rows[e / 3][3 * t + e % 3]));
            });
        }
    }
}

const IDENTITY: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

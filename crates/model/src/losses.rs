//! Work that contact takes from the bodies and that neither gap, slip nor offset accounts for.
//!
//! The forces of slave node j take the work Σ_k b_jk z_j·δx_k from the bodies. The contact laws account for
//! −ζ_nj δg̃_j + ζ_τj·δũ_τj of it. The two are equal if the forces act along the derivatives of gap and slip;
//! at edges that dig in, and on coarse curved surfaces, they do not, and the difference is lost or gained
//! without a mechanism. Where pressures follow from the gaps at integration points, those account for the change of
//! the energy that they store, ∂E_j/∂x·δx, instead of −ζ_nj δg̃_j. Smaller load steps do not change the loss. Both
//! are integrated by the trapezoidal rule over the accepted (sub-)steps, so that coarse steps change both alike. In the step in which a node closes or opens, the
//! rule counts half of the node's force times its gap; this is not a loss. A node that faces no master at one end of a
//! step does not count in that step.
//! Tests: `an_edge_that_digs_in_loses_work`, `points_that_dig_in_lose_work`,
//! `nodes_that_a_kink_closes_and_opens_lose_nothing_by_it`
//! (tests/suite/losses.rs).

use slipstick_contact::ContactStatus;
use slipstick_path::LoadTime;
use std::fmt;

use serde::Serialize;

use crate::equations::{ByPoint, ContactModel, ContactResults, ModelInterface, NodalContact};
use crate::words::quantity;

/// Fraction of the work of loads, supports and offsets above which lost work is reported.
pub const COUNTED_LOSS: f64 = 0.02;

/// Lost work of a contact pair, if it is more than [a fraction](COUNTED_LOSS) of what loads, supports
/// and offsets do.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LostWork {
    /// Number of the pair.
    pub pair: usize,
    /// Names of slave and master.
    pub surfaces: [String; 2],
    /// Work that the pair takes without a mechanism; negative: that it adds. \[F L\]
    pub work: f64,
    /// The same as a fraction of the work done on the bodies, as a sum of magnitudes over the steps.
    pub fraction: f64,
    /// Slave node with the largest part.
    pub node: u32,
    /// Position of that node in the reference configuration. \[L\]
    pub position: [f64; 3],
    /// Its part. \[F L\]
    pub at_node: f64,
}

impl fmt::Display for LostWork {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [slave, master] = &self.surfaces;
        let [x, y, z] = self.position.map(quantity);
        let (verb, share) = (if self.work > 0.0 { "takes" } else { "adds" }, 100.0 * self.fraction.abs());
        write!(
            f,
            "contact of `{slave}` with `{master}` {verb} {} of energy, {share:.1} % of the work done on the bodies, that \
             neither friction nor a gap accounts for; most of it, {}, at node {} of `{slave}`, [{x}, {y}, {z}]: an edge \
             digs in there, or facets are coarse against the curvature",
            quantity(self.work.abs()),
            quantity(self.at_node.abs()),
            self.node,
        )
    }
}

impl LostWork {
    /// The remedy.
    pub fn help(&self) -> String {
        "at an edge, include both of its sides in the slave surface, use `normals = \"touched\"` in the [[contact]] \
         table, or let the other surface be the slave; elsewhere, refine the mesh"
            .into()
    }
}

/// Lost work of every slave node since the start of the path. \[F L\]
#[derive(Debug, Default)]
pub(crate) struct Losses {
    nodes: Vec<f64>,
}

/// A state of contact, as [`Losses::add`] needs it.
pub(crate) struct ContactAt<'a> {
    /// Positions of the points of the contact surfaces. \[L\]
    pub positions: &'a [f64],
    pub results: &'a ContactResults,
    pub time: LoadTime,
    /// [`Design::stored_slopes`](crate::equations::Design::stored_slopes).
    pub stored: &'a [ByPoint],
}

impl Losses {
    /// Lost work of all nodes. \[F L\]
    pub fn total(&self) -> f64 {
        self.nodes.iter().sum()
    }

    /// Adds what is lost between two neighbouring states.
    pub fn add(&mut self, model: &ContactModel, before: &ContactAt<'_>, now: &ContactAt<'_>) {
        self.nodes.resize(now.results.nodes.len(), 0.0);
        let pair_of = model.by_pair(&now.results.nodes).zip(model.interfaces());
        let pairs = pair_of.flat_map(|(nodes, pair)| nodes.iter().map(move |_| pair));
        for ((j, sum), pair) in self.nodes.iter_mut().enumerate().zip(pairs) {
            *sum += lost(pair, j, before, now);
        }
    }

    /// Pairs that lose more than [a fraction](COUNTED_LOSS) of the work done on the bodies. \[F L\]
    pub fn reported(&self, model: &ContactModel, reference: &[[f64; 3]], done: f64) -> Vec<LostWork> {
        let parts = counted_parts(&self.nodes, model, done);
        let found = parts.map(|part| LostWork {
            pair: part.pair,
            surfaces: model.interfaces()[part.pair].surfaces.clone(),
            work: part.work,
            fraction: part.fraction,
            node: part.node,
            position: reference.get(part.node as usize).copied().unwrap_or_default(),
            at_node: part.at_node,
        });
        found.collect()
    }
}

/// Work at the nodes of a pair that [counts](COUNTED_LOSS).
pub(crate) struct CountedPart {
    pub pair: usize,
    /// Sum over the slave nodes of the pair. \[F L\]
    pub work: f64,
    /// The same as a fraction of the work done on the bodies.
    pub fraction: f64,
    /// Slave node with the largest part, and that part. \[F L\]
    pub node: u32,
    pub at_node: f64,
}

/// Pairs whose work at slave nodes, `nodes`, adds up to more than [a fraction](COUNTED_LOSS) of the work done
/// on the bodies, `done`. \[F L\]
pub(crate) fn counted_parts<'a>(
    nodes: &'a [f64],
    model: &'a ContactModel,
    done: f64,
) -> impl Iterator<Item = CountedPart> + 'a {
    let known = !nodes.is_empty() && done > 0.0;
    let pairs = known.then(|| model.by_pair(nodes).zip(model.interfaces()).enumerate());
    pairs.into_iter().flatten().filter_map(move |(number, (nodes, pair))| {
        let work: f64 = nodes.iter().sum();
        let largest = (0..nodes.len()).max_by(|&a, &b| (nodes[a] * work).total_cmp(&(nodes[b] * work)))?;
        let node = pair.interface.slave_nodes().get(largest)?.node;
        let fraction = work / done;
        let counts = fraction.abs() > COUNTED_LOSS;
        counts.then(|| CountedPart { pair: number, work, fraction, node, at_node: nodes[largest] })
    })
}

/// What slave node j loses between two states. \[F L\]
fn lost(pair: &ModelInterface, j: usize, before: &ContactAt<'_>, now: &ContactAt<'_>) -> f64 {
    let [old, new] = [before, now].map(|at| at.results.nodes.get(j));
    let (Some(old), Some(new)) = (old, new) else { return 0.0 };
    if pair.is_bonded() || old.gap.is_none() || new.gap.is_none() {
        return 0.0;
    }
    let moved = |i: usize| now.positions[i] - before.positions[i];
    let taken: f64 = [before, now]
        .iter()
        .flat_map(|at| at.results.transfer.get(j).into_iter().flatten().map(|term| (term, at.results.nodes[j])))
        .map(|(&(point, weight), at)| {
            (0..3).map(|c| weight * at.global_multiplier[c] * moved(3 * point as usize + c)).sum::<f64>()
        })
        .sum();
    let opened = |at: &ContactAt<'_>| {
        let node = &at.results.nodes[j];
        node.weighted_gap + pair.offset_at(at.time) * node.covered_area
    };
    let mean = |c: usize| 0.5 * (old.multiplier[c] + new.multiplier[c]);
    let slipped = mean(1) * new.weighted_slip[0] + mean(2) * new.weighted_slip[1];
    // the gap of a node that is open at one end of the step counts apart
    let open = |at: &NodalContact| if at.status == ContactStatus::Inactive { at.weighted_gap.max(0.0) } else { 0.0 };
    let gap = mean(0) * (open(new) - open(old));
    let pressed = if pair.at_points {
        let slopes = [before, now].into_iter().flat_map(|at| at.stored.get(j).into_iter().flatten());
        let works = slopes.map(|(point, slope)| (0..3).map(|c| slope[c] * moved(3 * *point as usize + c)).sum::<f64>());
        0.5 * works.sum::<f64>()
    } else {
        mean(0) * (opened(before) - opened(now))
    };
    let rest = 0.5 * taken - slipped - pressed - gap;
    reduced(rest, gap)
}

/// A loss without what the trapezoidal rule counts for the gap of a node that closes (negative) or opens, `gap`; if
/// the node has not moved along its normal, because a kink of the other side closes or opens it by sliding, the loss
/// contains nothing of that and stays.
fn reduced(loss: f64, gap: f64) -> f64 {
    if loss * gap < 0.0 { loss.signum() * (loss.abs() - gap.abs()).max(0.0) } else { loss }
}

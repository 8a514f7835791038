//! Redundant conditions of ties that meet.
//!
//! Where ties meet along an edge or at a corner, their conditions at the nodes there depend on each
//! other: with matching meshes exactly, so that the tangent is singular, otherwise nearly. All but
//! the first tie therefore have no multiplier of their own at these cross points. It follows from
//! those at the neighbouring nodes of the tie,
//!
//! ```text
//! z_j = Σ_i w_ji z_i ,   Σ_i w_ji = 1        so that   b_i ← b_i + Σ_j w_ji b_j ,   b_j ← 0
//! ```
//!
//! with equal weights of the neighbours. A uniform traction remains in the space of multipliers, so
//! patch tests pass (Wohlmuth, SIAM J. Numer. Anal. 38 (2000), 989–1012; Puso, Int. J. Numer. Meth.
//! Engng 59 (2004), 315–336). Contact conditions are not affected: a tie gives way at slave nodes of
//! contact pairs.

use slipstick_contact::ContactInterface;
use slipstick_contact::kinematics::NodeKinematics;
use std::collections::{BTreeMap, BTreeSet};

/// Removes the redundant conditions of a tie with these rows. `taken`: the nodes at which other
/// pairs have conditions already.
pub(super) fn condense(interface: &ContactInterface, rows: &mut [NodeKinematics], taken: &BTreeSet<u32>) {
    let slaves = interface.slave_nodes();
    let mut cross: Vec<bool> = rows.iter().map(|row| row.area > 0.0 && taken.contains(&row.node)).collect();
    if !cross.contains(&true) {
        return;
    }
    let has_condition = |row: &NodeKinematics| row.area > 0.0;
    // a tie without other nodes keeps a single, constant multiplier
    if rows.iter().zip(&cross).all(|(row, cross)| *cross || !has_condition(row)) {
        let first = cross.iter().position(|cross| *cross).expect("checked above");
        cross[first] = false;
    }
    let place: BTreeMap<u32, usize> = rows.iter().enumerate().map(|(j, row)| (row.node, j)).collect();
    // nodes whose neighbours are all cross points follow once these are known
    let mut weights: Vec<Option<BTreeMap<usize, f64>>> =
        (0..rows.len()).map(|j| (has_condition(&rows[j]) && !cross[j]).then(|| BTreeMap::from([(j, 1.0)]))).collect();
    loop {
        let mut found = Vec::new();
        for j in (0..rows.len()).filter(|&j| cross[j] && weights[j].is_none()) {
            let known = slaves[j].ring.iter().filter_map(|node| place.get(node)).filter(|&&i| weights[i].is_some());
            let known: Vec<usize> = known.copied().collect();
            // those on the same symmetry planes have the same components
            let alike: Vec<usize> =
                known.iter().copied().filter(|&i| slaves[i].mirrored == slaves[j].mirrored).collect();
            let from = if alike.is_empty() { known } else { alike };
            let mut weight: BTreeMap<usize, f64> = BTreeMap::new();
            for &i in &from {
                for (&to, w) in weights[i].iter().flatten() {
                    *weight.entry(to).or_default() += w / from.len() as f64;
                }
            }
            if !weight.is_empty() {
                found.push((j, weight));
            }
        }
        if found.is_empty() {
            break;
        }
        found.into_iter().for_each(|(j, weight)| weights[j] = Some(weight));
    }
    let original: Vec<NodeKinematics> = rows.to_vec();
    for j in (0..rows.len()).filter(|&j| cross[j]) {
        let Some(weight) = &weights[j] else { continue };
        weight.iter().for_each(|(&to, &w)| add(&mut rows[to], w, &original[j]));
        rows[j].area = 0.0;
        rows[j].coefficient.iter_mut().for_each(|b| *b = 0.0);
    }
}

/// Adds `weight` times a row to another one, whose frame remains.
fn add(to: &mut NodeKinematics, weight: f64, row: &NodeKinematics) {
    to.area += weight * row.area;
    let part = |of: &NodeKinematics, master: bool| -> BTreeMap<u32, f64> {
        let range = if master { of.ring..of.support.len() } else { 0..of.ring };
        range.map(|s| (of.support[s], of.coefficient[s])).collect()
    };
    let sum = |master: bool| {
        let mut sum = part(to, master);
        part(row, master).into_iter().for_each(|(node, b)| *sum.entry(node).or_default() += weight * b);
        sum
    };
    let (slave, master) = (sum(false), sum(true));
    to.ring = slave.len();
    (to.support, to.coefficient) = slave.into_iter().chain(master).unzip();
}

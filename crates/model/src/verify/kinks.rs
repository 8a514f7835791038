//! Whether another path has the same steps, and where it has another status.

use crate::analysis::{Analysis, Forward};

/// Whether both paths have the same steps and sub-steps.
pub(super) fn same_steps(a: &Forward, b: &Forward) -> bool {
    a.path.states.len() == b.path.states.len()
        && a.path.states.iter().zip(&b.path.states).all(|(p, q)| p.time == q.time)
}

/// Slave nodes whose status differs in another path with the same steps, and nodes of elements with a
/// point that flows in only one of the paths, as (user step, global node).
pub(super) fn changes(base: &Forward, others: [&Forward; 2], analysis: &Analysis) -> Vec<(usize, u32)> {
    let model = analysis.model();
    let slaves = model.slave_nodes();
    let mut all = Vec::new();
    for other in others {
        let mut step = 1;
        let both: Vec<_> = base.path.states.iter().zip(&other.path.states).collect();
        for pair in both.windows(2) {
            let [before, now] = [pair[0], pair[1]].map(|(p, q)| [p, q].map(|at| model.solid_history(&at.state)));
            if model.has_memory() && !pair[1].0.rest {
                let flow = [0, 1].map(|path| model.solid().flowing(before[path], now[path]));
                all.extend(flow[0].symmetric_difference(&flow[1]).map(|(_, node)| (step, *node)));
            }
            let (p, q) = pair[1];
            let nodes = p.active_set.iter().zip(&q.active_set).zip(&slaves);
            all.extend(nodes.filter(|((s, t), _)| s != t).map(|(_, &node)| (step, node)));
            step += usize::from(p.completes.is_some());
        }
    }
    all.sort_unstable();
    all.dedup();
    all
}

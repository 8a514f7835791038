//! The elimination tree for other solvers, by its definition.

use crate::common::Brick;
use slipstick_linalg::EliminationTree;

const BRICK: Brick =
    Brick { nodes: [7, 6, 5], multipliers: true, contrast: 1.0, nonsymmetry: 0.05, fixed_bottom: true };

/// Every unknown is eliminated once. Coupled unknowns are in the same supernode, or one of them is in an
/// ancestor of the other's. A multiplier follows the unknowns of its node.
#[test]
fn coupled_unknowns_are_on_one_branch() {
    let (a, _) = BRICK.reduced(1);
    let tree = EliminationTree::new(&a.pattern, None).unwrap();
    let mut place = vec![usize::MAX; a.n()];
    for (k, &unknown) in tree.order().iter().enumerate() {
        assert_eq!(std::mem::replace(&mut place[unknown as usize], k), usize::MAX);
    }
    let supernodes: Vec<_> = tree.supernodes().collect();
    let mut supernode = vec![0; a.n()];
    let mut next = 0;
    for (k, (places, parent)) in supernodes.iter().enumerate() {
        assert_eq!(places.start, next);
        assert!(parent.is_none_or(|parent| parent > k));
        next = places.end;
        places.clone().for_each(|at| supernode[tree.order()[at] as usize] = k);
    }
    assert_eq!(next, a.n());
    for i in 0..a.n() {
        for &j in a.pattern.row(i) {
            let (low, high) = (supernode[i].min(supernode[j as usize]), supernode[i].max(supernode[j as usize]));
            let mut above = Some(low);
            while above.is_some_and(|at| at < high) {
                above = above.and_then(|at| supernodes[at].1);
            }
            assert_eq!(above, Some(high), "{i} and {j}");
        }
    }
    // multipliers follow all displacements in the numbering, and the order within a group is that
    let groups = a.pattern.groups();
    let members = |i: usize| (0..i).filter(|&j| groups[j] == groups[i]).collect::<Vec<_>>();
    let multipliers: Vec<usize> = (0..a.n()).filter(|&i| members(i).len() > 2).collect();
    assert_eq!(multipliers.len(), 3 * 7 * 6);
    for i in multipliers {
        assert!(members(i).into_iter().all(|j| place[j] < place[i]), "multiplier {i}");
    }
    assert!(tree.has_unknowns_of(&a.pattern));
    let (entries, operations) = tree.size();
    assert!(entries >= a.pattern.entries() as f64 && operations > entries);
}

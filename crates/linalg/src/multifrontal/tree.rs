//! Permutations, and forests that are given by the parent of each node.

/// The position of each entry of a permutation.
pub(super) fn inverse(order: &[u32]) -> Vec<u32> {
    let mut position = vec![0; order.len()];
    for (k, &v) in order.iter().enumerate() {
        position[v as usize] = k as u32;
    }
    position
}

/// The same of positions in memory.
pub(super) fn inverse_of(order: &[usize]) -> Vec<usize> {
    let mut position = vec![0; order.len()];
    for (k, &v) in order.iter().enumerate() {
        position[v] = k;
    }
    position
}

/// Children of each node, ascending; roots are the children of an extra last node.
pub(super) fn children_of(parents: &[usize]) -> Vec<Vec<usize>> {
    let mut children = vec![Vec::new(); parents.len() + 1];
    for (j, &parent) in parents.iter().enumerate() {
        children[parent.min(parents.len())].push(j);
    }
    children
}

/// Postorder of the forest below the extra last node, without that node.
pub(super) fn postorder(children: &[Vec<usize>]) -> Vec<usize> {
    let root = children.len() - 1;
    let mut order = Vec::with_capacity(root);
    let mut stack = vec![(root, 0)];
    while let Some((node, visited)) = stack.pop() {
        match children[node].get(visited) {
            Some(&child) => {
                stack.push((node, visited + 1));
                stack.push((child, 0));
            }
            None if node != root => order.push(node),
            None => {}
        }
    }
    order
}

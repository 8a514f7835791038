//! Motions that cannot be prescribed.

/// A motion moves a node off its symmetry plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("node {node} is moved off its symmetry plane in component {}", ["x", "y", "z"][*component as usize])]
pub struct OffThePlane {
    /// Global node number.
    pub node: u32,
    /// 0, 1, 2.
    pub component: u8,
    /// Number of the table that moves it.
    pub motion: usize,
}

/// Two motions prescribe different displacements of one node.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "node {node} also belongs to `{set}`: `dirichlet[{first}]` prescribes {} {} displacement for it{}",
    if *temporary { "the" } else { "a different" },
    ["x", "y", "z"][*component as usize],
    if *temporary { ", and one of the two tables begins or ends within the path" } else { "" }
)]
pub struct ConflictingMotion {
    /// Global node number.
    pub node: u32,
    /// 0, 1, 2.
    pub component: u8,
    /// Number of the first table.
    pub first: usize,
    /// Node set of the first table.
    pub set: String,
    /// Number of the second table.
    pub motion: usize,
    /// Whether one of the tables begins or ends within the path, so that it must be the only one.
    pub temporary: bool,
}

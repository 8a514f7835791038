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
    "node {node} also belongs to `{set}`: `dirichlet[{first}]` prescribes a different {} displacement for it",
    ["x", "y", "z"][*component as usize]
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
}

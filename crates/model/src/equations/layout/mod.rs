//! What the equations are made of, and how they are divided among ranks: pairs, slave nodes, points.

pub(in crate::equations) mod conditions;
pub(in crate::equations) mod pair;
pub(in crate::equations) mod partition;
pub(in crate::equations) mod points;
pub(in crate::equations) mod share;
pub(in crate::equations) mod slaves;

//! Runs of cases.

/// Sections of a case that an optimization needs.
pub const SECTIONS: &[&str] = &["dirichlet", "design", "objective", "optimizer"];

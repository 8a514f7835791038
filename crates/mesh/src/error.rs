//! Errors of generating meshes, merging them and selecting from them.

use crate::{FacetNodes, MeshDefect};

/// An error of this crate; the message contains the place and the cure.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// A parameter of a generator, placement or selector is out of range.
    #[error("`{parameter}` is {value}: {cure}")]
    Parameter {
        /// The parameter, by the name of its field.
        parameter: String,
        /// The value that was given.
        value: String,
        /// Which values are allowed.
        cure: String,
    },
    /// Two of the merged meshes use the same name.
    #[error("two merged meshes both have a {kind} called `{name}`: rename one of them")]
    DuplicateName {
        /// `body`, `node set`, `surface` or `set or surface`.
        kind: &'static str,
        /// The name.
        name: String,
    },
    /// More nodes or elements than the 32-bit numbering can hold.
    #[error("the mesh would have more than 4,294,967,295 {what}: use fewer elements")]
    TooLarge {
        /// `nodes` or `elements`.
        what: &'static str,
    },
    /// A facet that should lie on the boundary of a body does not.
    #[error("facet {facet} with nodes {nodes:?} {reason}: surfaces must consist of outer faces of the elements")]
    NotOnBoundary {
        /// Position in the list that was given.
        facet: usize,
        /// Its nodes.
        nodes: FacetNodes,
        /// Why it does not.
        reason: &'static str,
    },
    /// The mesh does not pass [`Mesh::check`](crate::Mesh::check).
    #[error("the mesh has {} defect(s) (numbers count from 0):{}", .0.len(), list(.0))]
    Defects(Vec<MeshDefect>),
}

fn list(defects: &[MeshDefect]) -> String {
    defects.iter().map(|defect| format!("\n  - {defect}")).collect()
}

impl MeshError {
    pub(crate) fn parameter(parameter: impl Into<String>, value: impl ToString, cure: impl Into<String>) -> Self {
        Self::Parameter { parameter: parameter.into(), value: value.to_string(), cure: cure.into() }
    }
}

/// The count of nodes or elements as a 32-bit number, or an error.
pub(crate) fn count32(what: &'static str, count: Option<usize>) -> Result<u32, MeshError> {
    count.and_then(|count| u32::try_from(count).ok()).ok_or(MeshError::TooLarge { what })
}

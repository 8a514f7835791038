//! What can be wrong with a mesh file.

/// A mesh file that cannot be read or used: where in the file, why, and what mends it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{place}: {message}; {cure}")]
pub struct MeshFileError {
    /// Line, byte, element or set of the file.
    pub place: String,
    /// What is wrong.
    pub message: String,
    /// What mends it.
    pub cure: String,
}

impl MeshFileError {
    pub(crate) fn new(place: impl Into<String>, message: impl Into<String>, cure: impl Into<String>) -> Self {
        Self { place: place.into(), message: message.into(), cure: cure.into() }
    }
}

/// What to do about a file that is not as its format asks.
pub(crate) const DAMAGED: &str = "the file is cut off or damaged: write it again";

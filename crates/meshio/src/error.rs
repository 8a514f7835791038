//! Errors of mesh files.

/// A mesh file that cannot be read or used: place in the file, reason and remedy.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{place}: {message}; {cure}")]
pub struct MeshFileError {
    /// Line, byte, element or set of the file.
    pub place: String,
    /// What is wrong.
    pub message: String,
    /// The remedy.
    pub cure: String,
}

impl MeshFileError {
    pub(crate) fn new(place: impl Into<String>, message: impl Into<String>, cure: impl Into<String>) -> Self {
        Self { place: place.into(), message: message.into(), cure: cure.into() }
    }
}

/// The remedy for a file that violates its format.
pub(crate) const DAMAGED: &str = "the file is incomplete or damaged: write it again";

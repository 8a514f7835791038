//! A case for a mesh of one's own: the file's bodies and surfaces by name, with a contact, supports and a motion to correct.
//!
//! What is chosen is a guess from geometry, and the case says so: the pair of surfaces of two bodies that face each other with
//! the largest area; the larger body held and the other one pressed on, each at its side away from the contact. A body alone
//! gets a block to be pressed on it. What the file does not name is selected by direction or place.

mod survey;
mod text;

use slipstick_meshio::{FileMesh, MeshFileError};

use survey::{Part, Survey};

/// A case for a mesh file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MeshCase {
    /// The text of the case.
    pub text: String,
    /// What the case does to the mesh, for the user to know: which bodies lose mid-side nodes.
    pub notices: Vec<String>,
}

/// Writes a case for the mesh in `bytes`; `file` is how the case names its file.
///
/// # Errors
/// What cannot be read or used of the file: place, message and cure.
pub fn case_of_mesh(bytes: &[u8], file: &str) -> Result<MeshCase, MeshFileError> {
    let survey = Survey::new(&FileMesh::parse(bytes)?)?;
    let notice = |part: &Part| {
        let elements = part.second_order()?;
        Some(format!("body `{}` has {elements}, of second order: `first_order = true` drops mid-side nodes", part.name))
    };
    let notices = survey.parts.iter().filter_map(notice).collect();
    Ok(MeshCase { text: text::case(&survey, file), notices })
}

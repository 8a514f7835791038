//! Writes a case for a user's mesh: the file's bodies and surfaces by name, with a contact pair,
//! supports and a motion for the user to correct.
//!
//! The choices are guesses based on geometry, and the case says so. The contact pair is the pair of
//! facing surfaces of two bodies with the largest area. The larger body is held and the other one
//! is pressed onto it, each at its side away from the contact. If there is only one body, the case
//! adds a block that is pressed onto it. Surfaces and sets that the file does not name are selected
//! by direction or position.

mod survey;
mod text;

use slipstick_meshio::{FileMesh, MeshFileError};
use slipstick_model::words::counted;

use survey::{Part, Survey};

/// A case for a mesh file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MeshCase {
    /// The text of the case.
    pub text: String,
    /// What the case leaves out of the mesh, for the user's information: mid-side nodes, and elements
    /// that are in no body.
    pub notices: Vec<String>,
}

/// Writes a case for the mesh in `bytes`; `file` is the name of the mesh file in the case.
///
/// # Errors
/// If the file cannot be read or used: place, message and cure.
pub fn case_of_mesh(bytes: &[u8], file: &str) -> Result<MeshCase, MeshFileError> {
    let survey = Survey::new(&FileMesh::parse(bytes)?)?;
    let notice = |part: &Part| {
        let elements = part.second_order()?;
        Some(format!(
            "body `{}` has second-order elements ({elements}): `first_order = true` drops their mid-side nodes",
            part.name
        ))
    };
    let mut notices: Vec<String> = survey.parts.iter().filter_map(notice).collect();
    if survey.left_out > 0 {
        let parts = survey.parts.iter().filter_map(|part| part.part.as_deref());
        let (elements, parts) = (counted(survey.left_out, "solid element"), parts.collect::<Vec<_>>().join(", "));
        notices.push(format!("{elements} of the file are in no body: bodies are made from {parts}"));
    }
    Ok(MeshCase { text: text::case(&survey, file), notices })
}

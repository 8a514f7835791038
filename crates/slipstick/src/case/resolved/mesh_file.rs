//! Meshes from files.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Serialize;
use slipstick_mesh::Mesh;

/// A body from a mesh file, which is read with the case.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct MeshFile {
    /// The file as the case names it: relative to the case file.
    pub file: String,
    /// The set of solid elements that the body is; `None`: all of the file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub part: Option<String>,
    /// What the file's coordinates are multiplied by.
    pub scale: f64,
    /// Whether elements of second order are read by their corners, without mid-side nodes.
    pub first_order: bool,
    /// SHA-256 of the file, in hexadecimal: with it, the case says all that the results depend on.
    pub sha256: String,
    /// The body alone, as the generators make theirs; its surfaces and node sets have their final names.
    #[serde(skip)]
    pub mesh: Arc<Mesh>,
}

//! Meshes from files.

use std::collections::BTreeMap;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::Serialize;
use slipstick_mesh::Mesh;

/// A body from a mesh file; the file is read together with the case.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct MeshFile {
    /// Path of the file in the case, relative to the case file.
    pub file: String,
    /// The set of solid elements that makes up the body; `None`: the whole file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub part: Option<String>,
    /// Factor on the file's coordinates.
    pub scale: f64,
    /// Whether second-order elements are read as first-order elements, without mid-side nodes.
    pub first_order: bool,
    /// SHA-256 of the file, in hexadecimal: with it, the case determines the results completely.
    /// Empty, and not written, in a case for a file that does not exist yet.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub sha256: String,
    /// The mesh of this body, as if it came from a generator; its surfaces and node sets have their
    /// final names.
    #[serde(skip)]
    pub mesh: Arc<Mesh>,
    /// The file's numbers of the first nodes of this mesh; it has no numbers for the others.
    #[serde(skip)]
    pub numbers: Arc<[u64]>,
    /// Surfaces of the file that the body cannot have, by their final names, with message and remedy.
    #[serde(skip)]
    pub unusable: BTreeMap<String, [String; 2]>,
}

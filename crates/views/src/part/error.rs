//! Errors of preparing a part.

use slipstick_case::construct::BuildError;

use crate::export::ExportError;

/// Why a design cannot become a part; [`PartError::cure`] is the remedy.
#[derive(Debug, thiserror::Error)]
pub enum PartError {
    /// The case has no design.
    #[error("the case has no section [design], so no body is a part")]
    NoDesign,
    /// The size of edges is too small.
    #[error("the surface of body `{body}` would have about {triangles:.0e} triangles")]
    TooFine {
        /// The body.
        body: String,
        /// Triangles of its surface.
        triangles: f64,
        /// The smallest size that is accepted. \[L\]
        least: f64,
    },
    /// A body has no material.
    #[error("no material of body `{body}` is above the threshold")]
    Empty {
        /// The body.
        body: String,
    },
    /// A surface or set that the case needs has no material.
    #[error("no material is left on `{name}`, which {used} needs")]
    NoMaterial {
        /// The surface or set.
        name: String,
        /// The table of the case that names it.
        used: String,
    },
    /// The material on a surface or set that the case needs is not connected to a support or a
    /// contact pair.
    #[error(
        "the material on `{name}`, which {used} needs, is a loose piece: neither a support nor a contact pair holds it"
    )]
    Loose {
        /// The surface or set.
        name: String,
        /// The table of the case that names it.
        used: String,
    },
    /// A node set of a mesh file does not consist of faces.
    #[error("the set `{name}` of a mesh file is made of edges or points, which the mesh of the part does not have")]
    NotFaces {
        /// The set.
        name: String,
    },
    /// A region with another material is a set of elements, which the mesh of the part does not have.
    #[error("a section of `{body}` is the set `{part}` of its mesh file, which the mesh of the part does not have")]
    SectionOfFile {
        /// The body.
        body: String,
        /// The set.
        part: String,
    },
    /// An equation relates each node of a face to one of another, and the mesh of the part has others.
    #[error("an equation relates each node of `{}` to one of `{}`, and the mesh of the part has other nodes there", names[0], names[1])]
    NodeToNode {
        /// The two surfaces or sets.
        names: [String; 2],
    },
    /// The smooth surface of the faces cannot be found.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// The surface of the design cannot be extracted.
    #[error(transparent)]
    Export(#[from] ExportError),
}

impl PartError {
    /// The remedy, for users of the program.
    pub fn cure(&self) -> String {
        match self {
            Self::NoDesign => "export the run of a case with a design".into(),
            Self::Empty { .. } => "give a lower --threshold".into(),
            Self::TooFine { least, .. } => format!("give --size {least:.2e} or more, or omit it"),
            Self::NoMaterial { .. } => {
                "keep the material there with `passive_solid` and run the optimization again, or give a lower --threshold"
                    .into()
            }
            Self::Loose { .. } => "give a lower --threshold, or a `passive_solid` region that connects it, and run the \
                                   optimization again"
                .into(),
            Self::NotFaces { .. } => "select its nodes by position with a [[set]] in the case of the design".into(),
            Self::SectionOfFile { .. } => "give the region of the section as a box, a cylinder or a ball".into(),
            Self::NodeToNode { .. } => {
                "relate means (`mean = true`) or move the faces by a [[coupling]] in the case of the design".into()
            }
            Self::Build(error) => error.help.clone(),
            Self::Export(error) => error.cure(),
        }
    }
}

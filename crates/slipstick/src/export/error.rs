//! Why there is no surface.

use crate::output::OutputError;

/// Why there is no surface: names the reason; [`ExportError::cure`] says what mends it.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// Densities that do not fit the mesh.
    #[error("{found} densities do not fit {elements} elements")]
    Length {
        /// Densities given.
        found: usize,
        /// Elements of the mesh.
        elements: usize,
    },
    /// A value that is no density.
    #[error("element {element} has {value}, which is no density in [0, 1]")]
    Density {
        /// The element.
        element: usize,
        /// Its value.
        value: f64,
    },
    /// A threshold outside of its range.
    #[error("the threshold {value} is not between 0 and 1")]
    Threshold {
        /// As given.
        value: f64,
    },
    /// A body that does not exist.
    #[error("there is no body `{name}`")]
    UnknownBody {
        /// As asked for.
        name: String,
        /// The bodies there are.
        known: String,
    },
    /// Nothing is above the threshold.
    #[error("no density is above {threshold}: the design is empty there")]
    Empty {
        /// As given.
        threshold: f64,
        /// Largest value of the density.
        largest: f64,
    },
    /// The volume jumps over that of the densities at every threshold.
    #[error(
        "no threshold keeps the volume of this design: too much of it is grey or thin, with densities near {near:.3}"
    )]
    NoThreshold {
        /// Where the volume jumps.
        near: f64,
    },
    /// Points that 32 bits cannot tell apart.
    #[error("the body is so far from the origin that 32-bit coordinates, as STL has them, merge points of its surface")]
    TooFar,
    /// A unit that 3MF has no name for.
    #[error("3MF has no unit `{unit}`")]
    Unit {
        /// As the case calls it.
        unit: String,
    },
    /// The file.
    #[error(transparent)]
    Output(#[from] OutputError),
}

impl ExportError {
    /// What mends it, in words for the program's user.
    pub fn cure(&self) -> String {
        match self {
            Self::Length { .. } => "take the densities of a run of the same case".into(),
            Self::Density { .. } => "densities lie between 0 and 1".into(),
            Self::Threshold { .. } => "give a number between 0 and 1, or leave it out".into(),
            Self::UnknownBody { known, .. } => format!("bodies there are: {known}"),
            Self::Empty { largest, .. } => format!("give a threshold below {largest:.3}, or leave it out"),
            Self::NoThreshold { .. } => {
                "take a later iteration, with less grey material, fewer passes of smoothing, or give a --threshold yourself"
                    .into()
            }
            Self::TooFar => "write OBJ or VTU files, or move the body with its `place.translate`".into(),
            Self::Unit { .. } => {
                "3MF has µm, mm, cm, m, in and ft: name one of them in `[units] length`, or write STL or OBJ".into()
            }
            Self::Output(_) => "check the permission to write there and the free space".into(),
        }
    }
}

//! Errors of exporting a surface.

use slipstick_results::output::OutputError;

/// Why a surface cannot be exported; [`ExportError::cure`] is the remedy.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// Densities that do not match the mesh.
    #[error("{found} densities do not match {elements} elements")]
    Length {
        /// Densities given.
        found: usize,
        /// Elements of the mesh.
        elements: usize,
    },
    /// A value that is not a density.
    #[error("element {element} has {value}, which is not a density in [0, 1]")]
    Density {
        /// The element.
        element: usize,
        /// Its value.
        value: f64,
    },
    /// A threshold out of range.
    #[error("the threshold {value} is not between 0 and 1")]
    Threshold {
        /// The given value.
        value: f64,
    },
    /// A body that does not exist.
    #[error("there is no body `{name}`")]
    UnknownBody {
        /// The requested name.
        name: String,
        /// The available bodies.
        known: String,
    },
    /// No density is above the threshold.
    #[error("no density is above {threshold}: the design is empty there")]
    Empty {
        /// The given value.
        threshold: f64,
        /// Largest value of the density.
        largest: f64,
    },
    /// At every threshold, the volume differs from that of the densities, because it jumps.
    #[error(
        "no threshold preserves the volume of this design: too much of it is grey or thin, with densities near \
         {near:.3}"
    )]
    NoThreshold {
        /// Where the volume jumps.
        near: f64,
    },
    /// Points that 32-bit coordinates cannot distinguish.
    #[error("the body is so far from the origin that the 32-bit coordinates of STL merge points of its surface")]
    TooFar,
    /// A unit that a format does not have.
    #[error("{format} has no unit `{unit}`")]
    Unit {
        /// Its name in the case.
        unit: String,
        /// The format, 3MF or STEP.
        format: &'static str,
    },
    /// The file.
    #[error(transparent)]
    Output(#[from] OutputError),
}

impl ExportError {
    /// The remedy, for users of the program.
    pub fn cure(&self) -> String {
        match self {
            Self::Length { .. } => "use the densities of a run of the same case".into(),
            Self::Density { .. } => "densities lie between 0 and 1".into(),
            Self::Threshold { .. } => "give a number between 0 and 1, or omit it".into(),
            Self::UnknownBody { known, .. } => format!("available bodies: {known}"),
            Self::Empty { largest, .. } => format!("give a threshold below {largest:.3}, or omit it"),
            Self::NoThreshold { .. } => {
                "use a later iteration, with less grey material, or fewer smoothing passes, or set --threshold".into()
            }
            Self::TooFar => "write OBJ or VTU files, or move the body with its `place.translate`".into(),
            Self::Unit { format, .. } => format!(
                "{format} has µm, mm, cm, m, in and ft: use one of them for `[units] length`, or write STL or OBJ"
            ),
            Self::Output(error) => error.cure(),
        }
    }
}

//! Errors of making a picture.

use slipstick_results::output::OutputError;

/// An error of making a picture; the message contains the input and the cure.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// A picture with no pixels or too many.
    #[error("a picture of {width} x {height} pixels cannot be made: choose a width and a height between 1 and {limit}")]
    Size {
        /// Requested. \[pixels\]
        width: u32,
        /// Requested. \[pixels\]
        height: u32,
        /// Maximum in either direction. \[pixels\]
        limit: u32,
    },
    /// Samples per pixel and direction out of range.
    #[error("supersampling {found} is out of range: choose 1 to {limit} samples per pixel and direction")]
    Supersampling {
        /// Requested.
        found: u32,
        /// Maximum.
        limit: u32,
    },
    /// A field whose number of values does not match the mesh.
    #[error("`{name}` has {found} values, but the mesh needs {expected}: use a result on this mesh")]
    Length {
        /// The field.
        name: String,
        /// Required number of values.
        expected: usize,
        /// Given number of values.
        found: usize,
    },
    /// A value that is infinite or not a number.
    #[error("`{name}` is {value} at entry {entry} (counted from 0): only finite values can be drawn")]
    NotFinite {
        /// The field.
        name: String,
        /// Position in its values.
        entry: usize,
        /// The value.
        value: f64,
    },
    /// An element with a node that does not exist.
    #[error("element {element} has node {node}, but there are {nodes} nodes (numbers count from 0): correct the mesh")]
    NodeOutOfRange {
        /// The element.
        element: usize,
        /// Its node.
        node: u32,
        /// Number of nodes.
        nodes: usize,
    },
    /// A cell that does not exist.
    #[error("a layer has cell {cell}, but there are {cells} cells (numbers count from 0): choose existing ones")]
    CellOutOfRange {
        /// The cell.
        cell: u32,
        /// Number of cells.
        cells: usize,
    },
    /// A body that does not exist.
    #[error("there is no body `{name}`; bodies of this mesh: {known}")]
    UnknownBody {
        /// The requested name.
        name: String,
        /// The available bodies.
        known: String,
    },
    /// A view that does not exist.
    #[error("there is no view `{name}`; views: {known}")]
    UnknownView {
        /// The requested name.
        name: String,
        /// The available views.
        known: String,
    },
    /// A view whose direction is parallel to its upward direction.
    #[error(
        "a view from direction {eye:?} with {up:?} upwards is undefined: give two directions that are not parallel"
    )]
    Direction {
        /// Towards the eye.
        eye: [f64; 3],
        /// Upwards.
        up: [f64; 3],
    },
    /// More lines in a chart than can be distinguished.
    #[error(
        "a chart of {found} runs is not legible: at most {limit} lines differ in colour or dash; select fewer runs"
    )]
    TooManyLines {
        /// Requested.
        found: usize,
        /// Maximum.
        limit: usize,
    },
    /// A layer is coloured by a field, but the scene has no colour scale.
    #[error("a layer is coloured by a field, but the scene has no colour scale: set one first")]
    NoScale,
    /// A colour range that is not ascending.
    #[error(
        "the colour range [{low}, {high}] of `{title}` is not ascending: give two finite numbers, the lower one first"
    )]
    Range {
        /// Title of the scale.
        title: String,
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
    /// The PNG encoder reports an error.
    #[error("the picture cannot be encoded as PNG: {0}; make it smaller")]
    Encode(#[from] png::EncodingError),
    /// The file cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// Checks that all values are finite; reports the first that is not.
pub(super) fn check_finite(name: &str, values: impl IntoIterator<Item = f64>) -> Result<(), RenderError> {
    match values.into_iter().enumerate().find(|(_, value)| !value.is_finite()) {
        Some((entry, value)) => Err(RenderError::NotFinite { name: name.into(), entry, value }),
        None => Ok(()),
    }
}

/// Checks that the number of values is as expected and that all of them are finite.
pub(super) fn check_field(name: &str, values: &[f64], expected: usize) -> Result<(), RenderError> {
    if values.len() != expected {
        return Err(RenderError::Length { name: name.into(), expected, found: values.len() });
    }
    check_finite(name, values.iter().copied())
}

//! What can go wrong when a picture is made.

use crate::output::OutputError;

/// An error of making pictures: names the input, and the cure.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// A picture without pixels, or with too many.
    #[error("a picture of {width} x {height} pixels cannot be made: choose a width and a height between 1 and {limit}")]
    Size {
        /// Asked for. \[pixels\]
        width: u32,
        /// Asked for. \[pixels\]
        height: u32,
        /// The most in either direction. \[pixels\]
        limit: u32,
    },
    /// Samples per pixel and direction out of range.
    #[error("supersampling {found} is out of range: choose 1 to {limit} samples per pixel and direction")]
    Supersampling {
        /// Asked for.
        found: u32,
        /// The most.
        limit: u32,
    },
    /// A field whose number of values does not fit the mesh.
    #[error("`{name}` has {found} values, but the mesh needs {expected}: give one result of this mesh")]
    Length {
        /// The field.
        name: String,
        /// How many values there must be.
        expected: usize,
        /// How many values were given.
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
    #[error("element {element} has node {node}, but there are {nodes} nodes (numbers count from 0): mend the mesh")]
    NodeOutOfRange {
        /// The element.
        element: usize,
        /// Its node.
        node: u32,
        /// How many nodes there are.
        nodes: usize,
    },
    /// A cell that does not exist.
    #[error("a layer has cell {cell}, but there are {cells} cells (numbers count from 0): choose existing ones")]
    CellOutOfRange {
        /// The cell.
        cell: u32,
        /// How many cells there are.
        cells: usize,
    },
    /// A body that does not exist.
    #[error("there is no body `{name}`; bodies of this mesh: {known}")]
    UnknownBody {
        /// As asked for.
        name: String,
        /// The bodies there are.
        known: String,
    },
    /// A view that does not exist.
    #[error("there is no view `{name}`; views: {known}")]
    UnknownView {
        /// As asked for.
        name: String,
        /// The views there are.
        known: String,
    },
    /// A view whose direction and upward direction span no plane.
    #[error(
        "a view from direction {eye:?} with {up:?} upwards is undefined: give two directions that are not parallel"
    )]
    Direction {
        /// Towards the eye.
        eye: [f64; 3],
        /// Upwards.
        up: [f64; 3],
    },
    /// More lines in a chart than can be told apart.
    #[error("a chart of {found} runs cannot be read: at most {limit} lines differ in colour or dash; name fewer runs")]
    TooManyLines {
        /// Asked for.
        found: usize,
        /// The most.
        limit: usize,
    },
    /// A layer is coloured by a field, but the scene has no colour scale.
    #[error("a layer is coloured by a field, but the scene has no colour scale: set one before the picture is made")]
    NoScale,
    /// Colour range that is not ascending.
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
    /// The PNG encoder refuses.
    #[error("the picture cannot be encoded as PNG: {0}; make it smaller")]
    Encode(#[from] png::EncodingError),
    /// The file cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// All values finite, or which one is not.
pub(super) fn check_finite(name: &str, values: impl IntoIterator<Item = f64>) -> Result<(), RenderError> {
    match values.into_iter().enumerate().find(|(_, value)| !value.is_finite()) {
        Some((entry, value)) => Err(RenderError::NotFinite { name: name.into(), entry, value }),
        None => Ok(()),
    }
}

/// As many values as expected, all finite.
pub(super) fn check_field(name: &str, values: &[f64], expected: usize) -> Result<(), RenderError> {
    if values.len() != expected {
        return Err(RenderError::Length { name: name.into(), expected, found: values.len() });
    }
    check_finite(name, values.iter().copied())
}

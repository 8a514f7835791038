//! Pictures of designs, states and histories as PNG files, without a display.
//!
//! [`design_picture`], [`state_picture`], [`history_picture`] and [`histories_picture`] make the
//! usual ones; [`Scene`] makes any other:
//!
//! ```text
//! cells in layers ──skin──▶ faces ──camera──▶ samples in a depth buffer ──mean──▶ pixels ──▶ Picture
//! ```
//!
//! * Only the skin of elements is shown: the faces that no other cell of the layer has. A threshold
//!   or a cut therefore reveals the faces behind.
//! * Views are orthographic: lengths in the plane of the picture are true to scale. y is up, as
//!   everywhere in slipstick.
//! * A translucent layer shows only its nearest face, so that the objects behind it remain legible.
//! * Shading dims colours: the colour bar shows them fully lit. Faces are smooth where no element edges are
//!   drawn, and surfaces shade each other where they are close. [`Scene::shaded`] turns it off.
//! * The same input gives the same bytes, on any number of threads.

mod chart;
mod colour;
mod compose;
mod coverage;
mod curve;
mod error;
mod follow;
mod font;
mod history;
mod ink;
mod legend;
mod marks;
mod occlusion;
mod picture;
mod raster;
mod read_history;
mod results;
mod scene;
mod skin;
mod space;
mod surfaces;
#[cfg(test)]
mod tests;
mod view;

pub use chart::{Dash, Line, Plot, chart};
pub use colour::{Colour, ColourMap, ColourScale};
pub use curve::{Curve, curves_picture, read_curves};
pub use error::RenderError;
pub use history::{ObjectiveAxis, RunHistory, histories_picture, history_picture};
pub use marks::Mark;
pub(crate) use marks::{ARROW, diagonal};
pub use picture::{Canvas, Picture};
pub use read_history::{is_table, read_histories};
pub use results::{Cut, Field, FieldValues, RenderOptions, design_picture, state_picture, surface_picture};
pub use scene::{Layer, Paint, Scene, Style, cells_above};
pub use surfaces::{SurfaceLabel, surfaces_picture};
pub use view::View;

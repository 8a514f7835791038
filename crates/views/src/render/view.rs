//! Views of a scene: named views and the orthographic camera.

use super::RenderError;
use super::space::{Vector, cross, dot, subtract, unit};

/// A viewing direction, without perspective. y is up in all named views except those along y.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Towards the right of the picture.
    right: Vector,
    /// Towards the top of the picture.
    up: Vector,
    /// From the scene towards the eye.
    eye: Vector,
}

impl Default for View {
    /// `iso`.
    fn default() -> Self {
        NAMED[0].1.view()
    }
}

/// Towards the eye, and upwards.
#[derive(Clone, Copy)]
struct Directions(Vector, Vector);

impl Directions {
    fn view(self) -> View {
        let eye = unit(self.0);
        let right = unit(cross(self.1, eye));
        View { right, up: cross(eye, right), eye }
    }
}

const Y: Vector = [0.0, 1.0, 0.0];

const NAMED: [(&str, Directions); 10] = [
    ("iso", Directions([0.8, 0.75, 1.0], Y)),
    ("iso_left", Directions([-0.8, 0.75, 1.0], Y)),
    ("iso_back", Directions([-0.8, 0.75, -1.0], Y)),
    ("iso_below", Directions([0.8, -0.75, 1.0], Y)),
    ("front", Directions([0.0, 0.0, 1.0], Y)),
    ("back", Directions([0.0, 0.0, -1.0], Y)),
    ("side", Directions([1.0, 0.0, 0.0], Y)),
    ("left", Directions([-1.0, 0.0, 0.0], Y)),
    ("top", Directions([0.0, 1.0, 0.0], [0.0, 0.0, -1.0])),
    ("bottom", Directions([0.0, -1.0, 0.0], [0.0, 0.0, 1.0])),
];

impl View {
    /// The view with a name from [`names`](Self::names).
    ///
    /// `front` looks along −z with x to the right, `side` along −x, `top` along −y with x to the
    /// right and z towards the bottom of the picture; `iso` sees the faces at +x, +y and +z.
    ///
    /// # Errors
    /// [`RenderError::UnknownView`].
    pub fn named(name: &str) -> Result<Self, RenderError> {
        match NAMED.iter().find(|(known, _)| *known == name) {
            Some((_, directions)) => Ok(directions.view()),
            None => Err(RenderError::UnknownView { name: name.into(), known: Self::names().join(", ") }),
        }
    }

    /// The names of views.
    pub fn names() -> Vec<&'static str> {
        NAMED.iter().map(|(name, _)| *name).collect()
    }

    /// The view whose eye lies in direction `eye`, with `up` upwards in the picture; lengths do not
    /// matter.
    ///
    /// # Errors
    /// [`RenderError::Direction`] if the two are parallel, zero or not finite.
    pub fn from_directions(eye: Vector, up: Vector) -> Result<Self, RenderError> {
        let across = cross(unit(up), unit(eye));
        if dot(across, across) > 1e-12 {
            Ok(Directions(eye, up).view())
        } else {
            Err(RenderError::Direction { eye, up })
        }
    }

    /// Components of a direction to the right, upwards and towards the eye.
    pub(super) fn components(&self, direction: Vector) -> Vector {
        [dot(direction, self.right), dot(direction, self.up), dot(direction, self.eye)]
    }
}

/// A rectangle of the picture: left, top, right, bottom. \[pixels\]
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rectangle {
    pub left: f64,
    pub top: f64,
    pub right: f64,
    pub bottom: f64,
}

impl Rectangle {
    pub fn width(&self) -> f64 {
        self.right - self.left
    }

    pub fn height(&self) -> f64 {
        self.bottom - self.top
    }

    pub fn centre(&self) -> [f64; 2] {
        [0.5 * (self.left + self.right), 0.5 * (self.top + self.bottom)]
    }
}

/// Projects positions into a picture.
#[derive(Debug, Clone, Copy)]
pub(super) struct Camera {
    pub view: View,
    /// The point in the middle of the frame.
    target: Vector,
    /// Pixels per unit of length.
    pub scale: f64,
    middle: [f64; 2],
}

impl Camera {
    /// The camera for which the positions fill the frame and are centred in it; `None` without
    /// positions.
    pub fn framing(view: View, positions: impl IntoIterator<Item = Vector>, frame: Rectangle) -> Option<Self> {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for position in positions {
            let at = view.components(position);
            for c in 0..3 {
                low[c] = low[c].min(at[c]);
                high[c] = high[c].max(at[c]);
            }
        }
        if low[0] > high[0] {
            return None;
        }
        let size = subtract(high, low);
        let scale = (frame.width() / size[0]).min(frame.height() / size[1]);
        let middle: Vector = std::array::from_fn(|c| 0.5 * (low[c] + high[c]));
        let target =
            std::array::from_fn(|c| view.right[c] * middle[0] + view.up[c] * middle[1] + view.eye[c] * middle[2]);
        // A point has no size: any scale will do.
        let scale = if scale.is_finite() && scale > 0.0 { scale } else { 1.0 };
        Some(Self { view, target, scale, middle: frame.centre() })
    }

    /// Pixels to the right and downwards, and depth away from the eye in pixels.
    pub fn project(&self, position: Vector) -> Vector {
        let at = self.view.components(subtract(position, self.target));
        [self.middle[0] + self.scale * at[0], self.middle[1] - self.scale * at[1], -self.scale * at[2]]
    }
}

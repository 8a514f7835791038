//! Flat marks on top of the picture: strokes, areas, text.

use super::colour::{Colour, Palette};
use super::font::{CAPITAL_ROWS, columns, glyph};
use super::view::Rectangle;

/// A flat mark; positions in pixels from the upper left corner. Later ones cover earlier ones.
#[derive(Debug, Clone)]
pub(super) enum Ink {
    /// A line with round ends.
    Stroke { from: [f64; 2], to: [f64; 2], radius: f64, light: [f32; 3] },
    /// A filled rectangle.
    Area { at: Rectangle, light: [f32; 3] },
    /// A rectangle with the colours of a scale, the lowest at the bottom.
    Gradient { at: Rectangle, palette: Palette, range: [f64; 2] },
}

impl Ink {
    pub fn stroke(from: [f64; 2], to: [f64; 2], width: f64, colour: Colour) -> Self {
        Self::Stroke { from, to, radius: 0.5 * width, light: colour.linear() }
    }

    /// Bounding rectangle of the mark.
    pub fn bounds(&self) -> Rectangle {
        match self {
            Self::Stroke { from, to, radius, .. } => Rectangle {
                left: from[0].min(to[0]) - radius,
                top: from[1].min(to[1]) - radius,
                right: from[0].max(to[0]) + radius,
                bottom: from[1].max(to[1]) + radius,
            },
            Self::Area { at, .. } | Self::Gradient { at, .. } => *at,
        }
    }

    /// The light at a position within the bounds, if the mark covers it.
    pub fn light(&self, x: f64, y: f64) -> Option<[f32; 3]> {
        match self {
            Self::Stroke { from, to, radius, light } => {
                let (d, p) = ([to[0] - from[0], to[1] - from[1]], [x - from[0], y - from[1]]);
                let square = d[0] * d[0] + d[1] * d[1];
                let t = if square > 0.0 { ((p[0] * d[0] + p[1] * d[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
                let (a, b) = (p[0] - t * d[0], p[1] - t * d[1]);
                (a * a + b * b <= radius * radius).then_some(*light)
            }
            Self::Area { light, .. } => Some(*light),
            Self::Gradient { at, palette, range } => {
                let t = (at.bottom - y) / at.height();
                Some(palette.light(range[0] + t * (range[1] - range[0])))
            }
        }
    }
}

/// Position of the anchor of a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Align {
    Left,
    Centre,
    Right,
}

/// A style of text.
#[derive(Debug, Clone, Copy)]
pub(super) struct Type {
    /// Size of a dot of the font: capitals are 7 high. \[pixels\]
    pub dot: f64,
    pub colour: Colour,
}

impl Type {
    /// Height of capitals. \[pixels\]
    pub fn height(&self) -> f64 {
        CAPITAL_ROWS * self.dot
    }

    /// Width of a text. \[pixels\]
    pub fn width(&self, text: &str) -> f64 {
        columns(text) * self.dot
    }

    /// The same style, reduced if necessary so that a text is not wider than given.
    pub fn fitting(&self, text: &str, width: f64) -> Self {
        let share = width.max(0.0) / self.width(text).max(f64::MIN_POSITIVE);
        Self { dot: self.dot * share.min(1.0), ..*self }
    }

    /// Writes a text: `at` is its anchor, at half the height of capitals.
    pub fn write(&self, text: &str, at: [f64; 2], align: Align, inks: &mut Vec<Ink>) {
        let width = self.width(text);
        let left = match align {
            Align::Left => at[0],
            Align::Centre => at[0] - 0.5 * width,
            Align::Right => at[0] - width,
        };
        let top = at[1] - 0.5 * self.height();
        let mut column = 0.0;
        for character in text.chars() {
            let glyph = glyph(character);
            let place = |p: [f64; 2]| [left + (column + p[0] + 0.5) * self.dot, top + (p[1] + 0.5) * self.dot];
            for [from, to] in &glyph.strokes {
                inks.push(Ink::stroke(place(*from), place(*to), 0.95 * self.dot, self.colour));
            }
            column += (glyph.width + 1) as f64;
        }
    }
}

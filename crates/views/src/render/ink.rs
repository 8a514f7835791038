//! Flat marks on top of the picture: strokes, areas, text.

use super::colour::{Colour, Palette};
use super::coverage::Coverage;
use super::font::{CAPITAL, glyph, width};
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
    /// A filled outline of closed polygons, on top of everything else.
    Outline { contours: Vec<Vec<[f64; 2]>>, colour: Colour },
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
            Self::Outline { contours, .. } => {
                let none = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
                let grown = |[l, t, r, b]: [f64; 4], p: &[f64; 2]| [l.min(p[0]), t.min(p[1]), r.max(p[0]), b.max(p[1])];
                let [left, top, right, bottom] = contours.iter().flatten().fold(none, grown);
                Rectangle { left, top, right, bottom }
            }
        }
    }

    /// Blends an outline with rows of pixels of 3 bytes, of which the first is `first`: by its part of each pixel, in
    /// sRGB, in which thin dark letters are not too thin.
    pub fn blend(&self, pixels: &mut [u8], columns: usize, first: usize) {
        let Self::Outline { contours, colour } = self else { return };
        let Coverage { left, top, columns: wide, cover } = Coverage::of(contours);
        for (i, cover) in cover.iter().enumerate().filter(|(_, cover)| **cover > 0.0) {
            let (x, y) = (left + (i % wide) as i64, top + (i / wide) as i64 - first as i64);
            let at = (0..columns as i64).contains(&x).then(|| 3 * (y * columns as i64 + x));
            let Some(pixel) = at.filter(|at| *at >= 0).and_then(|at| pixels.get_mut(at as usize..at as usize + 3))
            else {
                continue;
            };
            for (byte, ink) in pixel.iter_mut().zip(colour.0) {
                *byte = (f32::from(*byte) + cover * (f32::from(ink) - f32::from(*byte))).round() as u8;
            }
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
            Self::Outline { .. } => None,
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
    /// One seventh of the height of capitals, in which distances around text are measured. \[pixels\]
    pub unit: f64,
    pub colour: Colour,
}

impl Type {
    /// Height of capitals. \[pixels\]
    pub fn height(&self) -> f64 {
        7.0 * self.unit
    }

    /// Size of the font. \[pixels\]
    fn size(&self) -> f64 {
        self.height() / CAPITAL
    }

    /// Width of a text. \[pixels\]
    pub fn width(&self, text: &str) -> f64 {
        width(text) * self.size()
    }

    /// The same style, reduced if necessary so that a text is not wider than given.
    pub fn fitting(&self, text: &str, width: f64) -> Self {
        let share = width.max(0.0) / self.width(text).max(f64::MIN_POSITIVE);
        Self { unit: self.unit * share.min(1.0), ..*self }
    }

    /// Writes a text: `at` is its anchor, at half the height of capitals.
    pub fn write(&self, text: &str, at: [f64; 2], align: Align, inks: &mut Vec<Ink>) {
        // letters are sharp if they stand on the border between two rows of pixels
        let baseline = (at[1] + 0.5 * self.height()).round();
        let left = at[0] - self.before(text, align);
        self.set(text, |[x, y]| [left + x, baseline - y], inks);
    }

    /// Writes a text upwards, turned to the left: `at` is its anchor, at half the height of capitals.
    pub fn write_upwards(&self, text: &str, at: [f64; 2], align: Align, inks: &mut Vec<Ink>) {
        let baseline = (at[0] + 0.5 * self.height()).round();
        let bottom = at[1] + self.before(text, align);
        self.set(text, |[x, y]| [baseline - y, bottom - x], inks);
    }

    /// Width of the part of a text before its anchor.
    fn before(&self, text: &str, align: Align) -> f64 {
        match align {
            Align::Left => 0.0,
            Align::Centre => 0.5 * self.width(text),
            Align::Right => self.width(text),
        }
    }

    fn set(&self, text: &str, place: impl Fn([f64; 2]) -> [f64; 2], inks: &mut Vec<Ink>) {
        let size = self.size();
        let mut x = 0.0;
        for character in text.chars() {
            let glyph = glyph(character);
            let moved = |p: &[f64; 2]| place([size * (x + p[0]), size * p[1]]);
            let contours: Vec<Vec<[f64; 2]>> =
                glyph.contours.iter().map(|contour| contour.iter().map(moved).collect()).collect();
            if !contours.is_empty() {
                inks.push(Ink::Outline { contours, colour: self.colour });
            }
            x += glyph.advance;
        }
    }
}

//! Curves over the iterations of an optimization.

use super::RenderError;
use super::colour::{Colour, ColourMap};
use super::error::check_finite;
use super::ink::{Align, Ink, Type};
use super::legend::ticks;
use super::picture::{Canvas, Picture};
use super::view::Rectangle;
use crate::optimize::IterationRecord;

/// A curve with axes of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Text above.
    pub title: String,
    /// Abscissa and ordinate, in the order in which they are joined.
    pub points: Vec<[f64; 2]>,
    /// A level to show besides, like a bound.
    pub level: Option<f64>,
    /// Share of the picture's height.
    pub share: f64,
    /// Of the line.
    pub colour: Colour,
}

/// Objective and volume fraction over the iterations; `limit` is the bound on the volume fraction.
///
/// # Errors
/// [`RenderError::NotFinite`], [`RenderError::Size`], [`RenderError::Supersampling`].
pub fn history_picture(
    history: &[IterationRecord],
    limit: Option<f64>,
    canvas: &Canvas,
) -> Result<Picture, RenderError> {
    let over = |value: fn(&IterationRecord) -> f64| history.iter().map(|r| [r.iteration as f64, value(r)]).collect();
    let curve = |title: &str, points, level, share, tone| Curve {
        title: title.into(),
        points,
        level,
        share,
        colour: ColourMap::Viridis.at(tone),
    };
    let objective = curve("objective", over(|r| r.objective), None, 2.0, 0.2);
    let volume = curve("volume fraction", over(|r| r.volume_fraction), limit, 1.0, 0.55);
    chart(&[objective, volume], "iteration", canvas)
}

/// Curves one above the other over one abscissa. A curve without points is an empty frame.
///
/// # Errors
/// [`RenderError::NotFinite`] for points, levels and shares, [`RenderError::Size`], [`RenderError::Supersampling`].
pub fn chart(curves: &[Curve], abscissa: &str, canvas: &Canvas) -> Result<Picture, RenderError> {
    canvas.check()?;
    for curve in curves {
        check_finite(&curve.title, curve.points.as_flattened().iter().copied())?;
        check_finite(&curve.title, curve.level.into_iter().chain([curve.share]))?;
    }
    let mut drawing = canvas.drawing();
    let text = Type { dot: canvas.dot(), colour: Colour::INK };
    let across = range(curves.iter().flat_map(|c| &c.points).map(|p| p[0]), 0.0);
    let plots: Vec<Plot<'_>> = curves.iter().map(|curve| Plot::new(curve, across, text)).collect();
    let numbers = plots.iter().flat_map(|p| &p.ticks).map(|(_, t)| text.width(t)).fold(0.0, f64::max);
    let dot = text.dot;
    let (left, right) = (12.0 * dot + numbers, f64::from(canvas.width) - 12.0 * dot);
    let head = 20.0 * dot;
    let room = f64::from(canvas.height) - 30.0 * dot - head * curves.len() as f64;
    let shares: f64 = curves.iter().map(|c| c.share.max(0.0)).sum();
    let mut top = 0.0;
    for plot in &plots {
        let height = (room * plot.curve.share.max(0.0) / shares).max(1.0);
        let frame = Rectangle { left, right, top: top + head, bottom: top + head + height };
        plot.draw(frame, &mut drawing.inks);
        top = frame.bottom;
    }
    for (value, name) in ticks(across[0], across[1], 8) {
        let x = left + (value - across[0]) / (across[1] - across[0]) * (right - left);
        text.write(&name, [x, top + 8.0 * dot], Align::Centre, &mut drawing.inks);
    }
    text.write(abscissa, [0.5 * (left + right), top + 20.0 * dot], Align::Centre, &mut drawing.inks);
    Ok(Picture::draw(&drawing))
}

/// The interval of the values, widened by a share; an interval of length 1 if they have none.
fn range(values: impl Iterator<Item = f64>, margin: f64) -> [f64; 2] {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    if low > high {
        return [0.0, 1.0];
    }
    let size = high - low;
    // Below that, a difference is noise of the last digits.
    if size <= 1e-9 * low.abs().max(high.abs()) {
        let half = if low == 0.0 { 0.5 } else { 0.1 * low.abs() };
        return [low - half, high + half];
    }
    [low - margin * size, high + margin * size]
}

/// A curve with the ranges of its axes.
struct Plot<'a> {
    curve: &'a Curve,
    across: [f64; 2],
    upward: [f64; 2],
    ticks: Vec<(f64, String)>,
    text: Type,
}

impl<'a> Plot<'a> {
    fn new(curve: &'a Curve, across: [f64; 2], text: Type) -> Self {
        let upward = range(curve.points.iter().map(|p| p[1]).chain(curve.level), 0.08);
        let ticks = ticks(upward[0], upward[1], (3.0 * curve.share).clamp(3.0, 6.0) as usize);
        Self { curve, across, upward, ticks, text }
    }

    fn draw(&self, frame: Rectangle, inks: &mut Vec<Ink>) {
        let dot = self.text.dot;
        let x = |v: f64| frame.left + (v - self.across[0]) / (self.across[1] - self.across[0]) * frame.width();
        let y = |v: f64| frame.bottom - (v - self.upward[0]) / (self.upward[1] - self.upward[0]) * frame.height();
        let title = [frame.left, frame.top - 8.0 * dot];
        Type { colour: self.curve.colour, ..self.text }.write(&self.curve.title, title, Align::Left, inks);
        for (value, name) in &self.ticks {
            let at = y(*value);
            inks.push(Ink::stroke([frame.left, at], [frame.right, at], 0.3 * dot, GRID));
            self.text.write(name, [frame.left - 4.0 * dot, at], Align::Right, inks);
        }
        for (value, _) in ticks(self.across[0], self.across[1], 8) {
            inks.push(Ink::stroke([x(value), frame.top], [x(value), frame.bottom], 0.3 * dot, GRID));
        }
        if let Some(level) = self.curve.level {
            inks.push(Ink::stroke([frame.left, y(level)], [frame.right, y(level)], 0.5 * dot, Colour::GREY));
        }
        let corners = [
            [frame.left, frame.top],
            [frame.right, frame.top],
            [frame.right, frame.bottom],
            [frame.left, frame.bottom],
        ];
        for k in 0..4 {
            inks.push(Ink::stroke(corners[k], corners[(k + 1) % 4], 0.4 * dot, Colour::INK));
        }
        let points: Vec<[f64; 2]> = self.curve.points.iter().map(|p| [x(p[0]), y(p[1])]).collect();
        inks.extend(points.windows(2).map(|w| Ink::stroke(w[0], w[1], dot, self.curve.colour)));
        inks.extend(points.iter().map(|p| Ink::stroke(*p, *p, 2.2 * dot, self.curve.colour)));
    }
}

/// Of the lines of the grid.
const GRID: Colour = Colour([222, 225, 230]);

//! Line plots over the iterations of optimizations, one above the other.

use super::RenderError;
use super::colour::Colour;
use super::error::check_finite;
use super::ink::{Align, Ink, Type};
use super::legend::ticks;
use super::picture::{Canvas, Picture};
use super::view::Rectangle;

/// A line of a plot.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Its name in the legend; empty if the legend omits it.
    pub name: String,
    /// Abscissa and ordinate, in the order in which points are joined.
    pub points: Vec<[f64; 2]>,
    /// Its colour.
    pub colour: Colour,
    /// Its style.
    pub dash: Dash,
    /// Whether points have markers.
    pub marked: bool,
}

/// The style of a line.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Dash {
    /// Solid.
    #[default]
    Solid,
    /// Dashes.
    Dashed,
    /// Dots.
    Dotted,
    /// Alternating dashes and dots.
    DashDotted,
    /// No line, only markers.
    None,
}

impl Dash {
    /// Alternating lengths of strokes and gaps, in widths of the line; the ends of strokes are
    /// round and extend by half a width.
    fn pattern(self) -> &'static [f64] {
        match self {
            Self::Solid | Self::None => &[],
            Self::Dashed => &[5.0, 4.0],
            Self::Dotted => &[0.0, 2.5],
            Self::DashDotted => &[6.0, 3.0, 0.0, 3.0],
        }
    }

    /// The strokes of this dash pattern along joined points; `width` is the width of the line.
    fn strokes(self, points: &[[f64; 2]], width: f64) -> Vec<[[f64; 2]; 2]> {
        if self == Self::None {
            return Vec::new();
        }
        let pattern = self.pattern();
        if pattern.is_empty() || width <= 0.0 {
            return points.windows(2).map(|pair| [pair[0], pair[1]]).collect();
        }
        let mut strokes = Vec::new();
        let (mut part, mut left) = (0, pattern[0] * width);
        for pair in points.windows(2) {
            let (d, length) = difference(pair[0], pair[1]);
            let mut from = 0.0;
            let at = |s: f64| [pair[0][0] + s * d[0], pair[0][1] + s * d[1]];
            while from + left <= length {
                if part % 2 == 0 {
                    strokes.push([at(from), at(from + left)]);
                }
                from += left;
                part = (part + 1) % pattern.len();
                left = pattern[part] * width;
            }
            if part % 2 == 0 {
                strokes.push([at(from), pair[1]]);
            }
            left -= length - from;
        }
        strokes
    }
}

/// The direction from one point to another and their distance.
fn difference(from: [f64; 2], to: [f64; 2]) -> ([f64; 2], f64) {
    let d = [to[0] - from[0], to[1] - from[1]];
    let length = d[0].hypot(d[1]);
    let unit = if length > 0.0 { d.map(|component| component / length) } else { [0.0; 2] };
    (unit, length)
}

/// Lines with their own axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Plot {
    /// What its ordinate shows, with the unit.
    pub title: String,
    /// The lines; later ones cover earlier ones.
    pub lines: Vec<Line>,
    /// A level to show in addition, such as a bound.
    pub level: Option<f64>,
    /// Share of the picture's height.
    pub share: f64,
}

/// Plots one above the other with a common abscissa, a title and a legend of all names above them.
/// A plot without points is an empty frame.
///
/// # Errors
/// [`RenderError::NotFinite`] for points, levels and shares, [`RenderError::Size`],
/// [`RenderError::Supersampling`].
pub fn chart(title: Option<&str>, plots: &[Plot], abscissa: &str, canvas: &Canvas) -> Result<Picture, RenderError> {
    canvas.check()?;
    for plot in plots {
        let points = plot.lines.iter().flat_map(|line| line.points.as_flattened());
        check_finite(&plot.title, points.copied())?;
        check_finite(&plot.title, plot.level.into_iter().chain([plot.share]))?;
    }
    let mut drawing = canvas.drawing();
    let text = Type { unit: canvas.unit(), colour: Colour::INK };
    let points = plots.iter().flat_map(|plot| &plot.lines).flat_map(|line| &line.points);
    let across = range(points.map(|p| p[0]), 0.0);
    let axes: Vec<Axes<'_>> = plots.iter().map(|plot| Axes::new(plot, across, text)).collect();
    let numbers = axes.iter().flat_map(|p| &p.ticks).map(|(_, t)| text.width(t)).fold(0.0, f64::max);
    let unit = text.unit;
    let (left, right) = (27.0 * unit + numbers, f64::from(canvas.width) - 12.0 * unit);
    let mut top = 0.0;
    if let Some(title) = title {
        let fitting = text.fitting(title, right - left);
        fitting.write(title, [0.5 * (left + right), 12.0 * unit], Align::Centre, &mut drawing.inks);
        top = 18.0 * unit;
    }
    top = legend(plots, text, [left, right], top, &mut drawing.inks);
    let below = ticks_below(across, right - left, text);
    let head = 10.0 * unit;
    let room = f64::from(canvas.height) - top - 34.0 * unit - head * plots.len() as f64;
    let shares: f64 = plots.iter().map(|plot| plot.share.max(0.0)).sum();
    for one in &axes {
        let height = (room * one.plot.share.max(0.0) / shares).max(1.0);
        let frame = Rectangle { left, right, top: top + head, bottom: top + head + height };
        one.draw(frame, &below, &mut drawing.inks);
        top = frame.bottom;
    }
    for (value, name) in &below {
        let x = left + (value - across[0]) / (across[1] - across[0]) * (right - left);
        // the last number may not end beyond the picture
        let x = x.min(f64::from(canvas.width) - 0.5 * text.width(name) - 2.0 * unit);
        text.write(name, [x, top + 10.0 * unit], Align::Centre, &mut drawing.inks);
    }
    text.write(abscissa, [0.5 * (left + right), top + 24.0 * unit], Align::Centre, &mut drawing.inks);
    Ok(Picture::draw(&drawing))
}

/// Ticks of the abscissa: about 8, or fewer if their numbers would overlap.
fn ticks_below(across: [f64; 2], width: f64, text: Type) -> Vec<(f64, String)> {
    let fit = |ticks: &[(f64, String)]| {
        let apart = |pair: &[(f64, String)]| {
            let needed = 0.5 * (text.width(&pair[0].1) + text.width(&pair[1].1)) + 6.0 * text.unit;
            (pair[1].0 - pair[0].0) / (across[1] - across[0]) * width >= needed
        };
        ticks.windows(2).all(apart)
    };
    let of = |count: usize| ticks(across[0], across[1], count);
    (3..=8).rev().map(of).find(|ticks| fit(ticks)).unwrap_or_else(|| of(2))
}

/// Draws a sample and the name of each line with a name, in as many rows as needed; returns the end
/// of the last row.
fn legend(plots: &[Plot], text: Type, [left, right]: [f64; 2], top: f64, inks: &mut Vec<Ink>) -> f64 {
    let unit = text.unit;
    let (sample, between, row) = (26.0 * unit, 14.0 * unit, 13.0 * unit);
    let mut named: Vec<&Line> = Vec::new();
    for line in plots.iter().flat_map(|plot| &plot.lines).filter(|line| !line.name.is_empty()) {
        if !named.iter().any(|other| other.name == line.name) {
            named.push(line);
        }
    }
    if named.is_empty() {
        return top;
    }
    let (mut x, mut y) = (left, top + 12.0 * unit);
    for line in named {
        let fitting = text.fitting(&line.name, right - left - sample - 4.0 * unit);
        let width = sample + 4.0 * unit + fitting.width(&line.name);
        if x > left && x + width > right {
            (x, y) = (left, y + row);
        }
        let sampled = if line.marked { vec![[x + 0.5 * sample, y]] } else { Vec::new() };
        Line { marked: false, ..line.clone() }.draw(&[[x, y], [x + sample, y]], unit, inks);
        Line { dash: if line.dash == Dash::None { Dash::None } else { Dash::Solid }, ..line.clone() }
            .draw(&sampled, unit, inks);
        fitting.write(&line.name, [x + sample + 4.0 * unit, y], Align::Left, inks);
        x += width + between;
    }
    y + 0.5 * text.height()
}

impl Line {
    /// Draws it along points of the picture.
    fn draw(&self, points: &[[f64; 2]], unit: f64, inks: &mut Vec<Ink>) {
        let width = if self.marked { 1.3 * unit } else { 1.8 * unit };
        let strokes = self.dash.strokes(points, width);
        inks.extend(strokes.into_iter().map(|[from, to]| Ink::stroke(from, to, width, self.colour)));
        // A single point has no line.
        if self.marked || points.len() == 1 {
            let size = if self.dash == Dash::None { 6.0 * unit } else { 4.0 * unit };
            inks.extend(points.iter().map(|p| Ink::stroke(*p, *p, size, self.colour)));
            // rings, so that points on a line are seen
            if self.dash == Dash::None {
                inks.extend(points.iter().map(|p| Ink::stroke(*p, *p, 3.2 * unit, Colour::WHITE)));
            }
        }
    }
}

/// The interval of the values, widened by a share; an interval of length 1 if they have none.
fn range(values: impl Iterator<Item = f64>, margin: f64) -> [f64; 2] {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    if low > high {
        return [0.0, 1.0];
    }
    let size = high - low;
    // Smaller differences are noise in the last digits.
    if size <= 1e-9 * low.abs().max(high.abs()) {
        let half = if low == 0.0 { 0.5 } else { 0.1 * low.abs() };
        return [low - half, high + half];
    }
    [low - margin * size, high + margin * size]
}

/// A plot with the ranges of its axes.
struct Axes<'a> {
    plot: &'a Plot,
    across: [f64; 2],
    upward: [f64; 2],
    ticks: Vec<(f64, String)>,
    text: Type,
}

impl<'a> Axes<'a> {
    fn new(plot: &'a Plot, across: [f64; 2], text: Type) -> Self {
        let points = plot.lines.iter().flat_map(|line| &line.points);
        let upward = range(points.map(|p| p[1]).chain(plot.level), 0.08);
        let ticks = ticks(upward[0], upward[1], (3.0 * plot.share).clamp(3.0, 6.0) as usize);
        Self { plot, across, upward, ticks, text }
    }

    /// With grid lines at the ticks `below` of the abscissa.
    fn draw(&self, frame: Rectangle, below: &[(f64, String)], inks: &mut Vec<Ink>) {
        let unit = self.text.unit;
        let x = |v: f64| frame.left + (v - self.across[0]) / (self.across[1] - self.across[0]) * frame.width();
        let y = |v: f64| frame.bottom - (v - self.upward[0]) / (self.upward[1] - self.upward[0]) * frame.height();
        // With a single line, the title has its colour.
        let colour = if let [line] = &self.plot.lines[..] { line.colour } else { self.text.colour };
        let text = Type { colour, ..self.text }.fitting(&self.plot.title, frame.height() + 8.0 * unit);
        text.write_upwards(&self.plot.title, [11.0 * unit, frame.centre()[1]], Align::Centre, inks);
        for (value, name) in &self.ticks {
            let at = y(*value);
            inks.push(Ink::stroke([frame.left, at], [frame.right, at], 0.3 * unit, GRID));
            self.text.write(name, [frame.left - 4.0 * unit, at], Align::Right, inks);
        }
        for (value, _) in below {
            inks.push(Ink::stroke([x(*value), frame.top], [x(*value), frame.bottom], 0.3 * unit, GRID));
        }
        if let Some(level) = self.plot.level {
            inks.push(Ink::stroke([frame.left, y(level)], [frame.right, y(level)], 0.5 * unit, Colour::GREY));
        }
        let corner = [frame.left, frame.bottom];
        for end in [[frame.left, frame.top], [frame.right, frame.bottom]] {
            inks.push(Ink::stroke(corner, end, 0.5 * unit, Colour::INK));
        }
        for line in &self.plot.lines {
            let points: Vec<[f64; 2]> = line.points.iter().map(|p| [x(p[0]), y(p[1])]).collect();
            line.draw(&points, unit, inks);
        }
    }
}

/// Colour of the grid lines.
const GRID: Colour = Colour([222, 225, 230]);

#[cfg(test)]
mod tests {
    use super::*;

    /// Short and long numbers; with about eight ticks, those of the last two intervals would overlap.
    #[test]
    fn numbers_of_the_abscissa_do_not_overlap() {
        let text = Type { unit: 2.0, colour: Colour::INK };
        for across in [[0.0, 10.0], [-0.02, 0.0], [1.00001, 1.00002]] {
            let found = ticks_below(across, 760.0, text);
            assert!(found.len() >= 2, "{found:?}");
            for pair in found.windows(2) {
                let at = |tick: &(f64, String)| (tick.0 - across[0]) / (across[1] - across[0]) * 760.0;
                let widths = 0.5 * (text.width(&pair[0].1) + text.width(&pair[1].1));
                assert!(at(&pair[1]) - at(&pair[0]) > widths, "{found:?}");
            }
        }
    }

    /// Computed by hand: a line of 20 widths with a corner at 12. Dashes of 5 begin at 0, 9 and 18;
    /// the one from 9 is split at the corner, the one from 18 ends with the line.
    #[test]
    fn dashes_go_around_corners() {
        let points = [[0.0, 0.0], [12.0, 0.0], [12.0, 8.0]];
        let found = Dash::Dashed.strokes(&points, 1.0);
        let expected = [
            [[0.0, 0.0], [5.0, 0.0]],
            [[9.0, 0.0], [12.0, 0.0]],
            [[12.0, 0.0], [12.0, 2.0]],
            [[12.0, 6.0], [12.0, 8.0]],
        ];
        assert_eq!(found, expected);
        assert_eq!(Dash::Solid.strokes(&points, 1.0).len(), 2);
        // Dots at 0, 2.5, 5, 7.5 and 10 of a line of 10.
        assert_eq!(Dash::Dotted.strokes(&[[0.0, 0.0], [0.0, 10.0]], 1.0).len(), 5);
        assert!(Dash::DashDotted.strokes(&[[1.0, 1.0]], 1.0).is_empty());
    }
}

//! Ticks with numbers, and the colour bar.

use super::colour::{Colour, ColourScale, Palette};
use super::ink::{Align, Ink, Type};
use super::view::Rectangle;

/// About `count` round values between two values, with their labels. \[unit of the values\]
pub(super) fn ticks(low: f64, high: f64, count: usize) -> Vec<(f64, String)> {
    let step = round_step((high - low) / count.max(1) as f64);
    let (first, last) = ((low / step - 1e-9).ceil() as i64, (high / step + 1e-9).floor() as i64);
    let largest = low.abs().max(high.abs());
    (first..=last).map(|i| i as f64 * step).map(|v| (v, number(v, step, largest))).collect()
}

/// The largest of 1, 2, 5 times a power of ten that does not exceed 1.5 times the given step.
pub(super) fn round_step(step: f64) -> f64 {
    let power = 10f64.powf(step.log10().floor());
    let multiple = [1.0, 2.0, 5.0, 10.0].into_iter().rfind(|m| m * power <= 1.5 * step).unwrap_or(1.0);
    multiple * power
}

/// A number with as many digits as its step requires, in scientific notation if it is very large or
/// small.
pub(super) fn number(value: f64, step: f64, largest: f64) -> String {
    let digits = |unit: f64| (-(unit.log10() + 1e-9).floor()).max(0.0) as usize;
    let text = if !(1e-3..1e5).contains(&largest) {
        let power = largest.log10().floor();
        if value == 0.0 {
            "0".into()
        } else {
            let scale = 10f64.powf(power);
            let power: String = format!("{power}").chars().map(raised).collect();
            format!("{:.*}·10{power}", digits(step / scale), value / scale)
        }
    } else {
        format!("{:.*}", digits(step), value)
    };
    // No tick has the label minus zero.
    let text =
        if text.starts_with('-') && text.chars().all(|c| "-0.".contains(c)) { text[1..].to_owned() } else { text };
    text.replace('-', "−")
}

/// A digit or sign as an exponent.
fn raised(character: char) -> char {
    match character {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '0' => '⁰',
        '4'..='9' => char::from_u32(u32::from(character) + 0x2040).unwrap_or(character),
        other => other,
    }
}

/// A colour bar, laid out for a panel of a given height.
pub(super) struct ColourBar<'a> {
    scale: &'a ColourScale,
    ticks: Vec<(f64, String)>,
    text: Type,
}

impl<'a> ColourBar<'a> {
    pub fn new(scale: &'a ColourScale, text: Type) -> Self {
        let [low, high] = scale.range();
        Self { scale, ticks: ticks(low, high, 5), text }
    }

    fn bar_width(&self) -> f64 {
        8.0 * self.text.unit
    }

    /// Total width of the bar. \[pixels\]
    pub fn width(&self) -> f64 {
        let numbers = self.ticks.iter().map(|(_, t)| self.text.width(t)).fold(0.0, f64::max);
        let [name, unit] = self.title();
        self.text.width(name).max(self.text.width(unit)).max(self.bar_width() + 4.0 * self.text.unit + numbers)
    }

    /// The title's name and unit, which is in brackets.
    fn title(&self) -> [&str; 2] {
        let title = self.scale.title();
        let apart = title.split_once(" [").and_then(|(name, unit)| Some([name, unit.strip_suffix(']')?]));
        apart.unwrap_or([title, ""])
    }

    /// Draws the bar into the frame: title above, with the unit in its second line, numbers to the right.
    pub fn draw(&self, frame: Rectangle, inks: &mut Vec<Ink>) {
        let unit = self.text.unit;
        let [name, of] = self.title();
        let line = 12.0 * unit;
        let below = if of.is_empty() { 0.0 } else { line };
        for (text, y) in [(name, 0.0), (of, below)] {
            self.text.write(text, [frame.left, frame.top + 0.5 * self.text.height() + y], Align::Left, inks);
        }
        let at = Rectangle {
            left: frame.left,
            top: frame.top + below + self.text.height() + 7.0 * unit,
            right: frame.left + self.bar_width(),
            bottom: frame.bottom,
        };
        let [low, high] = self.scale.range();
        let line = 0.5 * unit;
        let border =
            Rectangle { left: at.left - line, top: at.top - line, right: at.right + line, bottom: at.bottom + line };
        inks.push(Ink::Area { at: border, light: Colour::INK.linear() });
        inks.push(Ink::Gradient { at, palette: Palette::scale(self.scale), range: [low, high] });
        for (value, text) in &self.ticks {
            let y = at.bottom - (value - low) / (high - low) * at.height();
            inks.push(Ink::stroke([at.right, y], [at.right + 2.0 * unit, y], line, Colour::INK));
            self.text.write(text, [at.right + 4.0 * unit, y], Align::Left, inks);
        }
    }
}

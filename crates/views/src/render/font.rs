//! The font of all text: Inter, an outline font, as a table of glyphs.
//!
//! Its licence is `font/OFL.txt`; `font/outlines.py` writes the table. A crate that reads font files would add
//! 5 to 6 seconds to a build, and the rest of a font file serves no purpose here.

use std::collections::HashMap;
use std::sync::OnceLock;

/// A character: its outline, in units of the font's size, with y upwards from the baseline.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Glyph {
    /// Distance to the next character.
    pub advance: f64,
    /// Closed polygons, of which inner ones run against the outer ones.
    pub contours: Vec<Vec<[f64; 2]>>,
}

/// Height of capitals in units of the font's size.
pub(super) const CAPITAL: f64 = 0.727;

/// A character of the font; an empty box for one that the font does not have.
pub(super) fn glyph(character: char) -> &'static Glyph {
    static GLYPHS: OnceLock<HashMap<char, Glyph>> = OnceLock::new();
    static UNKNOWN: OnceLock<Glyph> = OnceLock::new();
    let glyphs = GLYPHS.get_or_init(|| TABLE.lines().filter_map(read).collect());
    glyphs.get(&character).unwrap_or_else(|| UNKNOWN.get_or_init(unknown))
}

/// Width of a text in units of the font's size.
pub(super) fn width(text: &str) -> f64 {
    text.chars().map(|character| glyph(character).advance).sum()
}

/// A line per character: itself, its advance and its outline as relative SVG path data.
const TABLE: &str = include_str!("font/inter.txt");

/// The table's units per size of the font.
const UNITS: f64 = 500.0;

/// Straight lines in place of a curve: at the size of a heading, they deviate by less than 0.1 pixels.
const PIECES: u32 = 6;

fn read(line: &str) -> Option<(char, Glyph)> {
    let mut cells = line.split('\t');
    let character = cells.next()?.chars().next()?;
    let advance = cells.next()?.parse::<f64>().ok()? / UNITS;
    let mut contours: Vec<Vec<[f64; 2]>> = Vec::new();
    let mut at = [0.0; 2];
    let path = cells.next().unwrap_or("");
    let starts: Vec<usize> = path.match_indices(['m', 'l', 'c', 'z']).map(|(start, _)| start).collect();
    for (k, &start) in starts.iter().enumerate() {
        let end = starts.get(k + 1).map_or(path.len(), |next| *next);
        let mut points = numbers(&path[start + 1..end]).as_chunks::<2>().0.to_vec();
        // all of them are relative to the end of the command before
        points.iter_mut().for_each(|point| (0..2).for_each(|c| point[c] = at[c] + point[c] / UNITS));
        at = points.last().copied().unwrap_or(at);
        match (path.as_bytes()[start], &points[..]) {
            (b'm', [start]) => contours.push(vec![*start]),
            (b'l', [end]) => contours.last_mut()?.push(*end),
            (b'c', [first, second, end]) => {
                let contour = contours.last_mut()?;
                let from = *contour.last()?;
                contour.extend((1..=PIECES).map(|k| cubic([from, *first, *second, *end], k)));
            }
            _ => {}
        }
    }
    Some((character, Glyph { advance, contours }))
}

/// Numbers that are separated by spaces or by the sign of the next one.
fn numbers(text: &str) -> Vec<f64> {
    let apart = text.replace('-', " -");
    apart.split_whitespace().filter_map(|number| number.parse().ok()).collect()
}

/// The point of a Bézier curve after `k` of its pieces.
fn cubic([a, b, c, d]: [[f64; 2]; 4], k: u32) -> [f64; 2] {
    let t = f64::from(k) / f64::from(PIECES);
    let s = 1.0 - t;
    let weights = [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t];
    std::array::from_fn(|i| weights[0] * a[i] + weights[1] * b[i] + weights[2] * c[i] + weights[3] * d[i])
}

fn unknown() -> Glyph {
    let outside = vec![[0.08, 0.0], [0.52, 0.0], [0.52, CAPITAL], [0.08, CAPITAL]];
    let inside = vec![[0.14, 0.06], [0.14, CAPITAL - 0.06], [0.46, CAPITAL - 0.06], [0.46, 0.06]];
    Glyph { advance: 0.6, contours: vec![outside, inside] }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The area within the outline: positive outside, negative for holes.
    fn areas(glyph: &Glyph) -> Vec<f64> {
        let area = |contour: &Vec<[f64; 2]>| {
            let next = |k: usize| contour[(k + 1) % contour.len()];
            (0..contour.len()).map(|k| 0.5 * (contour[k][0] * next(k)[1] - next(k)[0] * contour[k][1])).sum()
        };
        glyph.contours.iter().map(area).collect()
    }

    #[test]
    fn letters_of_names_units_and_formulas_are_known() {
        let box_ = unknown();
        let ascii: String = (' '..='~').collect();
        for character in ascii.chars().chain("äéñøÅßσμεθνΔΩ²³·−×°±≤≥≠→…–⁰⁶⁻₀".chars())
        {
            assert!(*glyph(character) != box_, "{character}");
        }
        assert!(*glyph('漢') == box_);
        assert_eq!(TABLE.lines().count(), TABLE.lines().filter_map(read).count());
    }

    /// Capitals stand on the baseline and have the common height; a hole runs against its contour.
    #[test]
    fn outlines_are_those_of_letters() {
        let heights = |character| {
            let all = glyph(character).contours.iter().flatten().map(|point| point[1]);
            all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], y| [low.min(y), high.max(y)])
        };
        for character in ['E', 'H', 'T'] {
            let [low, high] = heights(character);
            assert!(low == 0.0 && (high - CAPITAL).abs() < 0.002, "{character}: {low} to {high}");
        }
        // round letters reach a little beyond
        for character in ['O', '0', '8', 'S'] {
            let [low, high] = heights(character);
            assert!(
                (-0.02..0.0).contains(&low) && (high - CAPITAL - 0.01).abs() < 0.01,
                "{character}: {low} to {high}"
            );
        }
        assert!(heights('p')[0] < -0.15 && heights('x')[1] < 0.6);
        assert!(glyph(' ').contours.is_empty() && glyph(' ').advance > 0.2);
        let of = areas(glyph('O'));
        assert!(of.len() == 2 && of[0] * of[1] < 0.0, "{of:?}");
        assert_eq!(areas(glyph('i')).len(), 2);
        assert!((width("ii") - 2.0 * glyph('i').advance).abs() < 1e-15 && width("W") > width("i"));
    }
}

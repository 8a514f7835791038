//! Counts and numbers as text for display.

use slipstick_design::Bound;
use std::borrow::Cow;
use std::fmt::Write;

/// A count with its noun: `1 design`, `2 designs`, `1 entry`, `3 entries`.
pub fn counted(count: usize, noun: &str) -> String {
    match noun.strip_suffix('y') {
        _ if count == 1 => format!("{count} {noun}"),
        Some(stem) if !stem.ends_with(['a', 'e', 'o']) => format!("{count} {stem}ies"),
        _ => format!("{count} {noun}s"),
    }
}

/// A number rounded to this many significant digits, which removes round-off.
pub fn rounded(value: f64, digits: usize) -> f64 {
    let rounded = format!("{value:.*e}", digits.saturating_sub(1)).parse().unwrap_or(value);
    // turns −0 into 0
    rounded + 0.0
}

/// A quantity in five significant digits, with an exponent if it is very large or small: `30.447`,
/// `-0.5`, `1.2e-7`.
pub fn quantity(value: f64) -> String {
    let value = rounded(value, 5);
    match value.abs() {
        size if size != 0.0 && !(1e-4..1e6).contains(&size) => format!("{value:e}"),
        _ => value.to_string(),
    }
}

/// A bound: `≤ 20`, `≥ 0.5`.
pub fn bound(of: Bound) -> String {
    match of {
        Bound::AtMost(value) => format!("≤ {}", quantity(value)),
        Bound::AtLeast(value) => format!("≥ {}", quantity(value)),
    }
}

/// A vector with components rounded relative to the largest: a component below 1e-9 of it, the
/// tolerance of a load path, is written as zero. `[0.3, -0.05, 0]`
pub fn vector(v: [f64; 3]) -> String {
    let size = v.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
    let [x, y, z] = v.map(|x| if x.abs() <= 1e-9 * size { "0".into() } else { quantity(x) });
    format!("[{x}, {y}, {z}]")
}

/// Ascending numbers as text, consecutive ones as a range: `0 to 4, 6`.
pub fn list(numbers: &[usize]) -> String {
    let runs = numbers.chunk_by(|a, b| b - a == 1);
    let words = runs.map(|run| match run {
        [one] => one.to_string(),
        [first, .., last] => format!("{first} to {last}"),
        [] => String::new(),
    });
    words.collect::<Vec<_>>().join(", ")
}

/// The text with control characters, except for line feeds and tabs, and marks that change the direction of text
/// written as `\\u{1b}`: names from mesh files must not move the cursor, recolour the terminal or reorder what a
/// message says.
///
/// ```
/// assert_eq!(slipstick_model::words::visible("a\u{1b}[31m\u{202e}b\n"), "a\\u{1b}[31m\\u{202e}b\n");
/// ```
pub fn visible(text: &str) -> Cow<'_, str> {
    if !text.contains(is_hidden) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        match is_hidden(c) {
            // Writing to a string cannot fail.
            true => drop(write!(out, "{}", c.escape_unicode())),
            false => out.push(c),
        }
    }
    Cow::Owned(out)
}

/// Whether [`visible`] replaces a character.
pub fn is_hidden(c: char) -> bool {
    let marks = ['\u{61c}', '\u{200e}', '\u{200f}', '\u{2028}', '\u{2029}', '\u{feff}'];
    let overrides = ['\u{202a}'..='\u{202e}', '\u{2066}'..='\u{2069}'];
    (c.is_control() && c != '\n' && c != '\t') || marks.contains(&c) || overrides.iter().any(|range| range.contains(&c))
}

/// A word of a command line, quoted for a shell where that is needed.
pub fn shell_word(word: &str) -> String {
    let bare = |c: char| c.is_alphanumeric() || "-_./,=:".contains(c);
    match word {
        _ if !word.is_empty() && word.chars().all(bare) => word.to_owned(),
        _ if word.contains(['"', '$', '`', '\\', '!']) => format!("'{}'", word.replace('\'', "'\\''")),
        _ => format!("\"{word}\""),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_listed_in_runs() {
        assert_eq!(list(&[0, 1, 2, 5, 7, 8]), "0 to 2, 5, 7 to 8");
    }

    #[test]
    fn words_are_quoted_for_a_shell() {
        let found = ["runs/arm_1.toml", "my arm (1).toml", "it's", "$HOME's", "", "arm_ü"].map(shell_word);
        assert_eq!(found, ["runs/arm_1.toml", "\"my arm (1).toml\"", "\"it's\"", "'$HOME'\\''s'", "\"\"", "arm_ü"]);
    }

    #[test]
    fn nouns_follow_their_counts() {
        let found = [(0, "design"), (1, "design"), (2, "load step"), (1, "entry"), (3, "entry"), (2, "day")]
            .map(|(count, noun)| counted(count, noun));
        assert_eq!(found, ["0 designs", "1 design", "2 load steps", "1 entry", "3 entries", "2 days"]);
    }

    #[test]
    fn numbers_are_short() {
        assert_eq!((rounded(0.771 + 0.7, 12), rounded(1.7 + 0.17, 12), rounded(-0.0, 3)), (1.471, 1.87, 0.0));
        let found = [30.446_98, -0.5, 0.0, -0.0, 1.2e-7, 8.123_456e9, 123_456.7].map(quantity);
        assert_eq!(found, ["30.447", "-0.5", "0", "0", "1.2e-7", "8.1235e9", "123460"]);
        assert_eq!(vector([0.1 + 0.2, -1e-17, 1.25]), "[0.3, 0, 1.25]");
        assert!(quantity(f64::NAN) == "NaN" && quantity(f64::INFINITY) == "inf");
    }
}

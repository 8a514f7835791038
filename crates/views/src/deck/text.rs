//! Numbers, names and lists in the format of a deck.

use std::fmt::Write as _;

/// A number in at most 20 characters, which is what CalculiX reads: exactly if possible, otherwise
/// with at least 13 digits.
pub(super) fn number(x: f64) -> String {
    let x = x + 0.0;
    let plain = format!("{x:?}");
    if plain.len() <= 20 {
        return plain;
    }
    let digits = (0..=16).rev().map(|digits| format!("{x:.digits$e}"));
    digits.into_iter().find(|text| text.len() <= 20).unwrap_or(plain)
}

/// Numbers with commas in between.
pub(super) fn numbers(all: &[f64]) -> String {
    all.iter().map(|x| number(*x)).collect::<Vec<_>>().join(", ")
}

/// Lines of at most ten numbers of nodes or elements, which count from 1 here.
pub(super) fn list(out: &mut String, all: impl IntoIterator<Item = u32>) {
    let all: Vec<String> = all.into_iter().map(|n| (n + 1).to_string()).collect();
    for line in all.chunks(10) {
        let _ = writeln!(out, "{}", line.join(", "));
    }
}

/// A name with only letters, digits, `_` and `-`, at most 60 characters.
pub(super) fn proper(name: &str) -> String {
    let allowed = |c: char| if c.is_ascii_alphanumeric() || c == '_' || c == '-' { c } else { '_' };
    let name: String = name.chars().map(allowed).take(60).collect();
    // a number would name a node or an element
    if name.starts_with(|c: char| c.is_ascii_alphabetic()) { name } else { format!("s{name}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_fit_into_twenty_characters() {
        for x in [0.0, -0.0, 1.0, 0.1, -0.30000000000000004, -0.012345678901234567, 1e-7, -1.2345678901234567e-105] {
            let text = number(x);
            let read: f64 = text.parse().expect("a number");
            // half a unit of the last of 13 digits
            assert!(text.len() <= 20 && (read - x).abs() <= 0.5e-12 * x.abs(), "{text} {x}");
        }
        assert_eq!((number(-0.0), number(1e-7)), ("0.0".into(), "1e-7".into()));
    }
}

//! Parsers for values of options.

use std::num::NonZeroUsize;

use slipstick::case::{Memory, Override};

pub fn memory(text: &str) -> Result<Memory, String> {
    Memory::parse(text).ok_or_else(|| "an amount like \"8 GiB\" is expected".into())
}

pub fn override_of(text: &str) -> Result<Override, String> {
    text.parse().map_err(|error: slipstick::case::OverrideError| format!("{error}; {}", error.cure()))
}

/// Smallest width and height at which the text of a picture is legible. \[pixels\]
const LEAST_SIZE: (u32, u32) = (160, 120);

pub fn size(text: &str) -> Result<(u32, u32), String> {
    let sides = text.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    match sides {
        Some((width, height)) if width < LEAST_SIZE.0 || height < LEAST_SIZE.1 => {
            Err(format!("at least {}x{} is expected, so that text is legible", LEAST_SIZE.0, LEAST_SIZE.1))
        }
        _ => sides.ok_or_else(|| "width and height are expected, for instance 900x720".into()),
    }
}

pub fn count(text: &str) -> Result<NonZeroUsize, String> {
    text.trim().parse().map_err(|_| "a whole number greater than zero is expected".into())
}

pub fn fraction(text: &str) -> Result<f64, String> {
    number(text, |value| (0.0..=1.0).contains(&value), "a number from 0 to 1")
}

pub fn number(text: &str, range: impl Fn(f64) -> bool, expected: &str) -> Result<f64, String> {
    let value = text.parse().map_err(|_| format!("{expected} is expected"))?;
    // Infinity and NaN parse as numbers too.
    if f64::is_finite(value) && range(value) { Ok(value) } else { Err(format!("{expected} is expected")) }
}

pub fn positive(text: &str) -> Result<f64, String> {
    number(text, |value| value > 0.0, "a number greater than zero")
}

pub fn not_negative(text: &str) -> Result<f64, String> {
    number(text, |value| value >= 0.0, "a number not less than zero")
}

pub fn step(text: &str) -> Result<f64, String> {
    number(text, |value| value > 0.0 && value < 1.0, "a number between 0 and 1")
}

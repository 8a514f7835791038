//! Lists of numbers as compact text.

use ::base64::Engine as _;
use ::base64::engine::general_purpose::STANDARD;
use serde::Serialize;

/// Base64 with padding. RFC 4648, section 4.
pub(super) fn base64(bytes: &[u8]) -> String {
    STANDARD.encode(bytes)
}

/// Whole numbers, little-endian, 32 bits each.
pub(super) fn integers(values: impl IntoIterator<Item = u32>) -> String {
    base64(&values.into_iter().flat_map(u32::to_le_bytes).collect::<Vec<u8>>())
}

/// Numbers in 32-bit floating point, little-endian.
pub(super) fn floats(values: impl IntoIterator<Item = f64>) -> String {
    base64(&values.into_iter().flat_map(|value| (value as f32).to_le_bytes()).collect::<Vec<u8>>())
}

/// Numbers quantized in equal steps between the smallest and the largest:
/// value = low + step · code, with an error of at most half a step.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Packed {
    /// 8 or 16 bits per code.
    bits: u8,
    low: f64,
    step: f64,
    /// Base64 of the codes, little-endian.
    data: String,
}

impl Packed {
    /// Densities in steps of 1/255.
    pub fn densities(values: impl IntoIterator<Item = f64>) -> Self {
        let codes: Vec<u8> = values.into_iter().map(|value| (value.clamp(0.0, 1.0) * 255.0).round() as u8).collect();
        Self { bits: 8, low: 0.0, step: 1.0 / 255.0, data: base64(&codes) }
    }

    /// Any finite numbers, in 65535 steps over their range.
    pub fn numbers(values: &[f64]) -> Self {
        let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &v| (a.min(v), b.max(v)));
        let low = if values.is_empty() { 0.0 } else { low };
        // Half of the range, since the range itself could overflow.
        let half = 0.5 * high - 0.5 * low;
        let step = if half > 0.0 { half / 32767.5 } else { 0.0 };
        let code = |value: f64| if step > 0.0 { ((value - low) / step).round().clamp(0.0, 65535.0) as u16 } else { 0 };
        let codes: Vec<u8> = values.iter().flat_map(|&value| code(value).to_le_bytes()).collect();
        Self { bits: 16, low, step, data: base64(&codes) }
    }
}

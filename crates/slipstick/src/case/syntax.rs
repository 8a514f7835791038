//! Which of the parser's complaints a person should see.

use super::CaseCode;
use super::reader::Reader;

/// Reports syntax errors without those that only follow from the one before.
///
/// After an unclosed bracket, say, every line is wrong. An error counts as a cause of its own where right lines lie
/// between it and the error before; lines without a value (blank, comment) tell nothing.
pub(super) fn report(reader: &Reader, text: &str, errors: &[toml::de::Error]) {
    let mut errors: Vec<_> = errors.iter().map(|error| (error.span().unwrap_or(0..0), error.message())).collect();
    errors.sort_by_key(|(span, _)| span.start);
    let line_of = |offset: usize| text.as_bytes()[..offset].iter().filter(|&&b| b == b'\n').count();
    let mut last: Option<usize> = None;
    for (span, message) in errors {
        let line = line_of(span.start.min(text.len()));
        let follows = last.is_some_and(|last| {
            let between = line.saturating_sub(last + 1);
            text.lines().skip(last + 1).take(between).all(|line| {
                let line = line.trim_start();
                line.is_empty() || line.starts_with('#')
            })
        });
        if !follows {
            reader.error_at(span, CaseCode::Syntax, message, "the format: https://toml.io");
        }
        last = Some(line);
    }
}

//! Selects the parser errors that are shown to the user.

use super::CaseCode;
use super::reader::Reader;

/// Reports syntax errors without those that are only a consequence of the previous one.
///
/// After an unclosed bracket, for instance, every line is wrong. An error counts as independent if
/// there are correct lines between it and the previous error; blank lines and comments do not
/// count.
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
            reader.error_at(span, CaseCode::Syntax, message, "for the format, see https://toml.io");
        }
        last = Some(line);
    }
}

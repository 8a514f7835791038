//! Keyword lines and data lines.

use std::borrow::Cow;

use crate::MeshFileError;
use crate::cursor::shortened;
use crate::error::DAMAGED;

/// A line with content.
pub enum Line<'a> {
    /// A keyword with its parameters.
    Keyword(Keyword<'a>),
    /// Its number from 1, and its fields without surrounding white space; at least one. An empty
    /// field after a trailing comma is dropped, unless it is the first.
    Data {
        /// Number of the line, from 1.
        number: usize,
        /// Its fields.
        fields: Vec<&'a str>,
    },
}

/// `*NAME, PARAMETER, PARAMETER=VALUE`; a trailing comma continues it on the next line.
#[derive(Debug, Clone)]
pub struct Keyword<'a> {
    /// Number of its line, from 1.
    pub line: usize,
    /// In capitals.
    pub name: String,
    /// Names in capitals, with values as written, without quotes.
    pub parameters: Vec<(String, Option<&'a str>)>,
}

impl<'a> Keyword<'a> {
    /// Whether it has a parameter, with or without value.
    pub fn has(&self, parameter: &str) -> bool {
        self.parameters.iter().any(|(name, _)| name == parameter)
    }

    /// The value of a parameter.
    pub fn parameter(&self, parameter: &str) -> Option<&'a str> {
        self.parameters.iter().find(|(name, _)| name == parameter).and_then(|&(_, value)| value)
    }

    /// The value of a parameter that must be there.
    ///
    /// # Errors
    /// If it is missing or empty.
    pub fn required(&self, parameter: &str) -> Result<String, MeshFileError> {
        let value = self.parameter(parameter).filter(|value| !value.is_empty());
        let value =
            value.ok_or_else(|| self.error(format!("*{} has no {parameter}=…", self.name), "add this parameter"))?;
        Ok(value.to_owned())
    }

    /// An error at this line.
    pub fn error(&self, message: impl Into<String>, cure: impl Into<String>) -> MeshFileError {
        MeshFileError::new(format!("line {}", self.line), message, cure)
    }

    fn add(&mut self, text: &'a str) {
        for parameter in text.split(',').map(str::trim).filter(|parameter| !parameter.is_empty()) {
            let (name, value) = match parameter.split_once('=') {
                Some((name, value)) => (name.trim(), Some(value.trim().trim_matches('"'))),
                None => (parameter, None),
            };
            self.parameters.push((name.to_ascii_uppercase(), value));
        }
    }
}

/// Keywords of several words, which may be written with any number of blanks, or without.
const OF_WORDS: &[&str] = &[
    "BEAM SECTION",
    "BOUNDARY PRINT",
    "CHANGE FRICTION",
    "CHANGE SURFACE BEHAVIOR",
    "CONTACT CONTROLS",
    "CONTACT FILE",
    "CONTACT INTERFERENCE",
    "CONTACT OUTPUT",
    "CONTACT PAIR",
    "CONTACT PRINT",
    "DISTRIBUTING COUPLING",
    "EL FILE",
    "EL PRINT",
    "ELEMENT OUTPUT",
    "END ASSEMBLY",
    "END INSTANCE",
    "END PART",
    "END STEP",
    "ENERGY FILE",
    "ENERGY PRINT",
    "FACE PRINT",
    "GAP CONDUCTANCE",
    "INITIAL CONDITIONS",
    "MEMBRANE SECTION",
    "MODEL CHANGE",
    "NO ANALYSIS",
    "NODE FILE",
    "NODE OUTPUT",
    "NODE PRINT",
    "PHYSICAL CONSTANTS",
    "PRE-TENSION SECTION",
    "RIGID BODY",
    "SECTION FILE",
    "SECTION PRINT",
    "SHELL SECTION",
    "SOLID SECTION",
    "SOLUTION TECHNIQUE",
    "SPECIFIC HEAT",
    "SURFACE BEHAVIOR",
    "SURFACE INTERACTION",
    "TIME POINTS",
];

/// A keyword in capitals, with one blank between its words.
fn spelt(name: &str) -> String {
    let words: Vec<&str> = name.split_whitespace().collect();
    let plain = words.concat().to_ascii_uppercase();
    let known = OF_WORDS.iter().find(|known| known.replace(' ', "") == plain);
    known.map_or_else(|| words.join(" ").to_ascii_uppercase(), |known| (*known).to_owned())
}

/// The text of a file, in which lines that are neither comments nor UTF-8 have become UTF-8 from Latin-1, as
/// European programs write headings and names.
pub fn decoded(bytes: &[u8]) -> Cow<'_, [u8]> {
    let other = |line: &[u8]| !line.starts_with(b"**") && std::str::from_utf8(line).is_err();
    if std::str::from_utf8(bytes).is_ok() || !bytes.split(|&byte| byte == b'\n').any(other) {
        return Cow::Borrowed(bytes);
    }
    let mut text = Vec::with_capacity(bytes.len() + bytes.len() / 8);
    for line in bytes.split_inclusive(|&byte| byte == b'\n') {
        match other(line) {
            true => text.extend(line.iter().map(|&byte| char::from(byte)).collect::<String>().into_bytes()),
            false => text.extend_from_slice(line),
        }
    }
    Cow::Owned(text)
}

/// The lines of a file without comments and empty lines.
pub struct Lines<'a> {
    rest: &'a [u8],
    /// Number of the last line read, from 1.
    number: usize,
}

impl<'a> Lines<'a> {
    /// The lines of a file.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes, number: 0 }
    }

    /// The lines of a part of a file, after so many lines.
    pub fn after(bytes: &'a [u8], lines: usize) -> Self {
        Self { rest: bytes, number: lines }
    }

    /// What is not yet read, and how many lines are.
    pub(super) fn rest(&self) -> (&'a [u8], usize) {
        (self.rest, self.number)
    }

    /// The place of the last line read, for messages.
    pub fn place(&self) -> String {
        format!("line {}", self.number)
    }

    /// The next line of text that is not a comment.
    fn text(&mut self) -> Result<Option<&'a str>, MeshFileError> {
        while !self.rest.is_empty() {
            let end = self.rest.iter().position(|&byte| byte == b'\n').unwrap_or(self.rest.len());
            let (bytes, rest) = self.rest.split_at(end);
            self.rest = rest.get(1..).unwrap_or_default();
            self.number += 1;
            if bytes.starts_with(b"**") {
                continue;
            }
            let Ok(line) = std::str::from_utf8(bytes) else {
                return Err(MeshFileError::new(self.place(), "the line is not UTF-8", "save the file as UTF-8"));
            };
            if !line.trim().is_empty() {
                return Ok(Some(line.trim()));
            }
        }
        Ok(None)
    }

    /// The next line with content; `None` at the end.
    ///
    /// # Errors
    /// If it is not UTF-8.
    #[expect(clippy::should_implement_trait, reason = "a fallible iterator")]
    pub fn next(&mut self) -> Result<Option<Line<'a>>, MeshFileError> {
        let Some(text) = self.text()? else { return Ok(None) };
        let Some(text) = text.strip_prefix('*') else {
            let text = text.strip_suffix(',').unwrap_or(text);
            let fields = text.split(',').map(str::trim).collect();
            return Ok(Some(Line::Data { number: self.number, fields }));
        };
        let (name, mut rest) = text.split_once(',').unwrap_or((text, ""));
        let name = spelt(name);
        let mut keyword = Keyword { line: self.number, name, parameters: Vec::new() };
        keyword.add(rest);
        let mut goes_on = text.ends_with(',');
        while goes_on {
            rest = self.text()?.unwrap_or_default();
            goes_on = rest.ends_with(',');
            keyword.add(rest);
        }
        Ok(Some(Line::Keyword(keyword)))
    }
}

/// A node or element number.
pub(super) fn number(field: &str, line: usize) -> Result<u64, MeshFileError> {
    field.parse().map_err(|_| {
        let message = format!("`{}` was found where a node or element number is expected", shortened(field));
        MeshFileError::new(format!("line {line}"), message, DAMAGED)
    })
}

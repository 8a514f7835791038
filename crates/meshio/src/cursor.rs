//! A position in a file's bytes, from which numbers are read as text or as binary.

use crate::MeshFileError;
use crate::error::DAMAGED;

/// How numbers are encoded in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// A position in a file's bytes.
#[derive(Clone)]
pub(crate) struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    pub encoding: Encoding,
}

impl<'a> Cursor<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, encoding: Encoding::Ascii }
    }

    /// The position, for messages.
    pub fn place(&self) -> String {
        match self.encoding {
            Encoding::Ascii => format!("line {}", 1 + self.bytes[..self.at].iter().filter(|&&b| b == b'\n').count()),
            _ => format!("byte {}", self.at),
        }
    }

    pub fn error(&self, message: impl Into<String>, cure: impl Into<String>) -> MeshFileError {
        MeshFileError::new(self.place(), message, cure)
    }

    /// A capacity for `count` items of at least `size` bytes each, limited by the rest of the file.
    pub fn capacity(&self, count: u64, size: usize) -> usize {
        usize::try_from(count).unwrap_or(usize::MAX).min((self.bytes.len() - self.at) / size)
    }

    pub fn skip_whitespace(&mut self) {
        let rest = &self.bytes[self.at..];
        self.at += rest.iter().position(|byte| !byte.is_ascii_whitespace()).unwrap_or(rest.len());
    }

    /// Whether only white space is left.
    pub fn at_end(&mut self) -> bool {
        self.skip_whitespace();
        self.at == self.bytes.len()
    }

    /// The rest of the line, trimmed; continues after it.
    pub fn line(&mut self) -> Result<&'a str, MeshFileError> {
        let rest = &self.bytes[self.at..];
        let length = rest.iter().position(|&byte| byte == b'\n').unwrap_or(rest.len());
        let line = std::str::from_utf8(&rest[..length]).map_err(|_| self.error("the line is not UTF-8", DAMAGED))?;
        self.at += (length + 1).min(rest.len());
        Ok(line.trim())
    }

    /// Continues after the next occurrence of `text`.
    pub fn skip_past(&mut self, text: &str) -> Result<(), MeshFileError> {
        let rest = &self.bytes[self.at..];
        let found = rest.windows(text.len()).position(|window| window == text.as_bytes());
        let found = found.ok_or_else(|| self.error(format!("there is no {text} after this place"), DAMAGED))?;
        self.at += found + text.len();
        Ok(())
    }

    /// The next word of text, with any encoding.
    pub fn word(&mut self) -> Result<&'a str, MeshFileError> {
        self.skip_whitespace();
        let rest = &self.bytes[self.at..];
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        if length == 0 {
            return Err(self.error("the file ends unexpectedly", DAMAGED));
        }
        let word = std::str::from_utf8(&rest[..length]).map_err(|_| self.error("text is expected here", DAMAGED))?;
        self.at += length;
        Ok(word)
    }

    /// The next word as a number; `what` is for the message.
    pub fn parsed<T: std::str::FromStr>(&mut self, what: &str) -> Result<T, MeshFileError> {
        self.skip_whitespace();
        let before = self.at;
        let word = self.word()?;
        word.parse().map_err(|_| {
            self.at = before;
            self.error(format!("`{}` was found where {what} is expected", shortened(word)), DAMAGED)
        })
    }

    /// The next N bytes, in little-endian order.
    pub fn binary<const N: usize>(&mut self) -> Result<[u8; N], MeshFileError> {
        let Some((&(mut bytes), _)) = self.bytes[self.at..].split_first_chunk::<N>() else {
            return Err(self.error("the file ends unexpectedly", DAMAGED));
        };
        self.at += N;
        if self.encoding == Encoding::BigEndian {
            bytes.reverse();
        }
        Ok(bytes)
    }

    /// A 32-bit integer.
    pub fn int(&mut self) -> Result<i32, MeshFileError> {
        match self.encoding {
            Encoding::Ascii => self.parsed("a whole number"),
            _ => Ok(i32::from_le_bytes(self.binary()?)),
        }
    }

    /// A 32-bit integer that is not negative.
    pub fn count(&mut self) -> Result<u64, MeshFileError> {
        let value = self.int()?;
        u64::try_from(value).map_err(|_| self.error(format!("{value} must not be negative"), DAMAGED))
    }

    /// A 64-bit count or number.
    pub fn size(&mut self) -> Result<u64, MeshFileError> {
        match self.encoding {
            Encoding::Ascii => self.parsed("a whole number"),
            _ => Ok(u64::from_le_bytes(self.binary()?)),
        }
    }

    /// A finite number.
    pub fn double(&mut self) -> Result<f64, MeshFileError> {
        let value = match self.encoding {
            Encoding::Ascii => self.parsed("a number")?,
            _ => f64::from_le_bytes(self.binary()?),
        };
        finite(value).ok_or_else(|| self.error(format!("a coordinate is {value}"), "coordinates must be finite"))
    }

    /// Three coordinates.
    pub fn point(&mut self) -> Result<[f64; 3], MeshFileError> {
        Ok([self.double()?, self.double()?, self.double()?])
    }
}

/// Limit that keeps squares and cubes of lengths finite.
const LARGEST: f64 = 1e50;

pub(crate) fn finite(value: f64) -> Option<f64> {
    (value.abs() <= LARGEST).then_some(value)
}

/// A word of a possibly damaged file, shortened for a message.
pub(crate) fn shortened(word: &str) -> String {
    word.chars().filter(|c| !c.is_control()).take(40).collect()
}

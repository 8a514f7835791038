//! Text files are UTF-8.

use std::fmt;

/// The place where bytes are not valid UTF-8.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NotUtf8 {
    /// The first invalid byte.
    pub byte: u8,
    /// Its position in the file, from 1.
    pub position: usize,
    /// Its line, from 1.
    pub line: usize,
    /// Its column in characters, from 1.
    pub column: usize,
}

impl fmt::Display for NotUtf8 {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { byte, position, .. } = self;
        write!(f, "byte {position} of the file, 0x{byte:02X}, is not UTF-8")
    }
}

impl std::error::Error for NotUtf8 {}

/// The text of a file, without the byte order mark that some editors write at its start.
///
/// # Errors
/// [`NotUtf8`] at the first byte that is not part of a character.
pub fn utf8(bytes: Vec<u8>) -> Result<String, NotUtf8> {
    let mut text = String::from_utf8(bytes).map_err(|error| {
        let (at, bytes) = (error.utf8_error().valid_up_to(), error.as_bytes());
        let before = String::from_utf8_lossy(&bytes[..at]);
        let last = before.rsplit('\n').next().unwrap_or_default();
        let (line, column) = (1 + before.matches('\n').count(), 1 + last.chars().count());
        NotUtf8 { byte: bytes[at], position: at + 1, line, column }
    })?;
    if text.starts_with('\u{feff}') {
        text.remove(0);
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `ö` is 0xF6 in ISO 8859-1, and two bytes, 0xC3 0xB6, in UTF-8.
    #[test]
    fn the_first_wrong_byte_is_named() {
        assert_eq!(utf8("größe".into()).as_deref(), Ok("größe"));
        let error = utf8(b"a = 1\n\xc3\xb6 = \"gr\xf6\xdfe\"".to_vec()).expect_err("ISO 8859-1");
        assert_eq!(error, NotUtf8 { byte: 0xf6, position: 15, line: 2, column: 8 });
        assert_eq!(utf8(b"\xef\xbb\xbftitle".to_vec()).as_deref(), Ok("title"));
        assert_eq!(utf8(b"ab\xc3".to_vec()).map_err(|e| e.position), Err(3), "incomplete character at the end");
    }
}

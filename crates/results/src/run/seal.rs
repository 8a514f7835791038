//! JSON objects that end with a hash of themselves.

use std::io::{self, Write};

use sha2::{Digest, Sha256};

use slipstick_case::file::hexadecimal;

/// The text between the last entry and the hash, and the text after the hash.
const BEFORE: &str = ",\"sha256\":\"";
const AFTER: &str = "\"}";

/// Writes a non-empty JSON object and adds, as its last entry `sha256`, the hash of the bytes
/// before that entry.
///
/// # Errors
/// Those of `write` and of the writer.
pub(super) fn write(writer: &mut dyn Write, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut hashing = Hashing { writer, hash: Sha256::new(), held: None };
    write(&mut hashing)?;
    let Hashing { writer, hash, held } = hashing;
    if held != Some(b'}') {
        return Err(io::Error::other("only a JSON object can contain its hash"));
    }
    write!(writer, "{BEFORE}{}{AFTER}", hexadecimal(&hash.finalize()))
}

/// Whether the bytes are those that [`write`] wrote.
pub(super) fn is_whole(bytes: &[u8]) -> bool {
    let Some(rest) = bytes.strip_suffix(AFTER.as_bytes()) else { return false };
    let Some((rest, found)) = rest.split_last_chunk::<64>() else { return false };
    let Some(hashed) = rest.strip_suffix(BEFORE.as_bytes()) else { return false };
    hexadecimal(&Sha256::digest(hashed)).as_bytes() == found
}

/// Passes on all bytes except the last.
struct Hashing<'w> {
    writer: &'w mut dyn Write,
    hash: Sha256,
    held: Option<u8>,
}

impl Write for Hashing<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let Some((&last, before)) = bytes.split_last() else { return Ok(0) };
        if let Some(held) = self.held.replace(last) {
            self.hash.update([held]);
            self.writer.write_all(&[held])?;
        }
        self.hash.update(before);
        self.writer.write_all(before)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The hash is that of the bytes before it, computed in another way; truncated text, a changed
    /// bit and appended text are detected.
    #[test]
    fn a_changed_bit_is_noticed() {
        let mut bytes = Vec::new();
        let pieces = ["{\"a\"", ":", "[1.5,2]", "", ",\"b\":null}"];
        write(&mut bytes, |writer| pieces.iter().try_for_each(|piece| writer.write_all(piece.as_bytes()))).unwrap();
        let text = String::from_utf8(bytes.clone()).unwrap();
        let hash = super::super::sha256("{\"a\":[1.5,2],\"b\":null");
        assert_eq!(text, format!("{{\"a\":[1.5,2],\"b\":null,\"sha256\":\"{hash}\"}}"));
        assert!(is_whole(&bytes));
        for at in 0..bytes.len() {
            assert!(!is_whole(&bytes[..at]), "{at}");
            for bit in 0..8 {
                let mut changed = bytes.clone();
                changed[at] ^= 1 << bit;
                assert!(!is_whole(&changed), "byte {at}, bit {bit}");
            }
        }
        bytes.push(b'\n');
        assert!(!is_whole(&bytes));
        assert!(write(&mut Vec::new(), |writer| writer.write_all(b"[1]")).is_err());
    }
}

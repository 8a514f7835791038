//! Hashes by which files are recognized.

use sha2::{Digest, Sha256};

/// SHA-256 of a text or file, in hexadecimal. FIPS 180-4.
pub fn sha256<T: AsRef<[u8]> + ?Sized>(bytes: &T) -> String {
    hexadecimal(&Sha256::digest(bytes.as_ref()))
}

/// Bytes in hexadecimal, two digits each.
pub fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

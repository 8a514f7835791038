//! The values of arrays: text, base64 or raw, compressed or not.

use std::io::{Read, Write};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::Array;
use super::xml::{Compression, Document, Section, Source, Values};
use crate::MeshFileError;
use crate::error::DAMAGED;

/// Decodes the arrays of one document.
pub(super) struct Decoder<'a> {
    document: &'a Document<'a>,
    /// Offsets of appended arrays, ascending: each array ends where the next one begins.
    offsets: Vec<usize>,
    /// Number of bytes to which the values of the current array may still be decompressed.
    room: u64,
}

/// Largest number of nodes of a cell of any type.
const MOST_NODES: u64 = 4096;

impl<'a> Decoder<'a> {
    pub fn new(document: &'a Document<'a>) -> Self {
        let appended = document.arrays.iter().filter_map(|source| match source.values {
            Values::Appended(offset) => Some(offset),
            _ => None,
        });
        let mut offsets: Vec<usize> = appended.collect();
        offsets.sort_unstable();
        Self { document, offsets, room: 0 }
    }

    /// The array with its values.
    pub fn array(&mut self, source: &Source<'_>) -> Result<Array, MeshFileError> {
        let error = |message: String| MeshFileError::new(format!("array `{}`", source.name), message, DAMAGED);
        let (size, integer) = number_type(&source.type_name).ok_or_else(|| {
            let message = format!("values of type `{}` are not supported", source.type_name);
            MeshFileError::new(format!("array `{}`", source.name), message, "use a type such as Float64 or Int64")
        })?;
        self.room = self.declared(source).saturating_mul(size as u64);
        let values = match &source.values {
            Values::Text(text) => ascii(text).map_err(error)?,
            Values::Base64(text) => {
                let bytes = self.block(&base64(text).map_err(error)?).map_err(error)?;
                numbers(&source.type_name, size, self.document.big_endian, &bytes).map_err(error)?
            }
            Values::Appended(offset) => {
                let bytes = self.appended(*offset).map_err(error)?;
                numbers(&source.type_name, size, self.document.big_endian, &bytes).map_err(error)?
            }
        };
        Ok(Array { name: source.name.clone(), components: source.components, integer, values })
    }

    /// The largest number of values that an array can have, from the numbers of points and cells.
    fn declared(&self, source: &Source<'_>) -> u64 {
        let [points, cells] = [self.document.points as u64, self.document.cells as u64];
        let items = match (source.section, source.name.as_str()) {
            (Section::Points | Section::PointData, _) => points,
            (Section::Cells, "offsets" | "types") | (Section::CellData, _) => cells,
            (Section::Cells, _) => cells.saturating_mul(MOST_NODES),
        };
        items.saturating_mul(source.components as u64)
    }

    fn appended(&mut self, offset: usize) -> Result<Vec<u8>, String> {
        let appended = self.document.appended.ok_or("the file has no appended data")?;
        let end = self.offsets.partition_point(|&other| other <= offset);
        let end = self.offsets.get(end).copied().unwrap_or(appended.bytes.len()).min(appended.bytes.len());
        let bytes = appended.bytes.get(offset..end).ok_or("the values lie beyond the end of the file")?;
        if !appended.base64 {
            return self.block(bytes);
        }
        let end = bytes.iter().position(|&byte| byte == b'<').unwrap_or(bytes.len());
        let decoded = base64(&bytes[..end])?;
        self.block(&decoded)
    }

    /// The values after a header, which contains their size in bytes, or the sizes of compressed
    /// blocks.
    fn block(&mut self, bytes: &[u8]) -> Result<Vec<u8>, String> {
        let mut rest = bytes;
        let size = self.header(&mut rest)?;
        if self.document.compression == Compression::None {
            let whole = usize::try_from(size).ok().and_then(|size| rest.get(..size));
            return Ok(whole.ok_or("the array ends early")?.to_vec());
        }
        let (count, block_size, last) = (size, self.header(&mut rest)?, self.header(&mut rest)?);
        let mut sizes = Vec::new();
        for _ in 0..count {
            sizes.push(self.header(&mut rest)?);
        }
        let mut values = Vec::new();
        for (number, size) in (1..).zip(sizes) {
            let size = usize::try_from(size).ok().filter(|&size| size <= rest.len()).ok_or("the array ends early")?;
            let (block, behind) = rest.split_at(size);
            rest = behind;
            let expected = if number == count && last > 0 { last } else { block_size };
            let too_many = "the compressed values are more than the numbers of points and cells allow";
            self.room = self.room.checked_sub(expected).ok_or(too_many)?;
            let before = values.len() as u64;
            self.decompress(block, expected, &mut values)?;
            if values.len() as u64 - before != expected {
                return Err("the size of a compressed block differs from the announced one".into());
            }
        }
        Ok(values)
    }

    /// Appends the values of a block, at most one byte more than expected.
    fn decompress(&self, block: &[u8], expected: u64, values: &mut Vec<u8>) -> Result<(), String> {
        let damaged = |error: &dyn std::fmt::Display| format!("the values cannot be decompressed: {error}");
        match &self.document.compression {
            Compression::Zlib => {
                let mut decoder = flate2::read::ZlibDecoder::new(block).take(expected + 1);
                decoder.read_to_end(values).map_err(|error| damaged(&error))?;
            }
            Compression::Lz4 => {
                let start = values.len();
                values.resize(start + expected as usize, 0);
                let written = lz4_flex::block::decompress_into(block, &mut values[start..]);
                values.truncate(start + written.map_err(|error| damaged(&error))?);
            }
            Compression::Lzma => {
                let mut bounded = Bounded { values, room: expected + 1 };
                lzma_rs::xz_decompress(&mut &*block, &mut bounded).map_err(|error| damaged(&format!("{error:?}")))?;
            }
            Compression::None => values.extend_from_slice(block),
            Compression::Unknown(name) => {
                return Err(format!(
                    "its values are compressed with {name}, which is not supported: write the file with zlib, LZ4 or \
                     LZMA, or without compression"
                ));
            }
        }
        Ok(())
    }

    /// A number of a header.
    fn header(&self, bytes: &mut &[u8]) -> Result<u64, String> {
        let size = if self.document.long_header { 8 } else { 4 };
        let (head, rest) = bytes.split_at_checked(size).ok_or("the array ends early")?;
        *bytes = rest;
        let mut wide = [0; 8];
        if self.document.big_endian {
            wide[8 - size..].copy_from_slice(head);
            Ok(u64::from_be_bytes(wide))
        } else {
            wide[..size].copy_from_slice(head);
            Ok(u64::from_le_bytes(wide))
        }
    }
}

/// Bytes that end with an error instead of growing beyond a limit.
struct Bounded<'a> {
    values: &'a mut Vec<u8>,
    room: u64,
}

impl Write for Bounded<'_> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let rest = self.room.checked_sub(bytes.len() as u64);
        self.room = rest.ok_or_else(|| std::io::Error::other("there are more values than announced"))?;
        self.values.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

fn ascii(text: &[u8]) -> Result<Vec<f64>, String> {
    let text = std::str::from_utf8(text).map_err(|_| "the values are not text")?;
    let number = |word: &str| word.parse().map_err(|_| format!("`{}` is not a number", crate::cursor::shortened(word)));
    text.split_ascii_whitespace().map(number).collect()
}

/// Decodes base64. The text may consist of several consecutive pieces, each with its own padding,
/// because writers encode header and values separately or together.
fn base64(text: &[u8]) -> Result<Vec<u8>, String> {
    let text: Vec<u8> = text.iter().copied().filter(|byte| !byte.is_ascii_whitespace()).collect();
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let mut rest = &text[..];
    while !rest.is_empty() {
        let padding = rest.iter().position(|&byte| byte == b'=');
        let end = padding.map_or(rest.len(), |padding| (padding / 4 + 1) * 4).min(rest.len());
        let (piece, behind) = rest.split_at(end);
        STANDARD.decode_vec(piece, &mut bytes).map_err(|error| format!("the values are not base64: {error}"))?;
        rest = behind;
    }
    Ok(bytes)
}

/// Number of bytes of a number, and whether it is an integer.
fn number_type(name: &str) -> Option<(usize, bool)> {
    Some(match name {
        "Float64" => (8, false),
        "Float32" => (4, false),
        "Int64" | "UInt64" => (8, true),
        "Int32" | "UInt32" => (4, true),
        "Int16" | "UInt16" => (2, true),
        "Int8" | "UInt8" => (1, true),
        _ => return None,
    })
}

fn numbers(type_name: &str, size: usize, big_endian: bool, bytes: &[u8]) -> Result<Vec<f64>, String> {
    if !bytes.len().is_multiple_of(size) {
        return Err("the number of bytes is not a multiple of the size of a value".into());
    }
    let value = |piece: &[u8]| {
        let mut wide = [0; 8];
        if big_endian {
            wide.iter_mut().zip(piece.iter().rev()).for_each(|(wide, &byte)| *wide = byte);
        } else {
            wide[..size].copy_from_slice(piece);
        }
        let [a, b, c, d, ..] = wide;
        match type_name {
            "Float64" => f64::from_le_bytes(wide),
            "Float32" => f64::from(f32::from_le_bytes([a, b, c, d])),
            "Int64" => i64::from_le_bytes(wide) as f64,
            "Int32" => f64::from(i32::from_le_bytes([a, b, c, d])),
            "Int16" => f64::from(i16::from_le_bytes([a, b])),
            "Int8" => f64::from(a as i8),
            _ => u64::from_le_bytes(wide) as f64,
        }
    };
    Ok(bytes.chunks_exact(size).map(value).collect())
}

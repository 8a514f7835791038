//! The XML of a file: its arrays, and the location of their values.

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use crate::MeshFileError;
use crate::error::DAMAGED;

/// Where an array belongs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Section {
    Points,
    Cells,
    PointData,
    CellData,
}

/// How blocks of binary values are compressed.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) enum Compression {
    #[default]
    None,
    Zlib,
    Lz4,
    Lzma,
    /// A compressor of this name; arrays of text can still be read.
    Unknown(String),
}

/// The location of the values of an array.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Values<'a> {
    Text(&'a [u8]),
    Base64(&'a [u8]),
    /// At an offset of the appended data.
    Appended(usize),
}

/// An array as declared in the file.
#[derive(Debug)]
pub(super) struct Source<'a> {
    pub section: Section,
    pub name: String,
    /// `Float64`, `Int32`, …
    pub type_name: String,
    pub components: usize,
    pub values: Values<'a>,
}

/// The appended data.
#[derive(Debug, Clone, Copy)]
pub(super) struct Appended<'a> {
    /// The bytes after the underscore that marks the beginning of the data, including the rest of
    /// the file.
    pub bytes: &'a [u8],
    pub base64: bool,
}

/// The contents of the XML.
#[derive(Debug, Default)]
pub(super) struct Document<'a> {
    pub points: usize,
    pub cells: usize,
    pub big_endian: bool,
    /// Whether block headers are UInt64 instead of UInt32 (`header_type`).
    pub long_header: bool,
    pub compression: Compression,
    pub arrays: Vec<Source<'a>>,
    pub appended: Option<Appended<'a>>,
}

fn error(place: usize, message: impl Into<String>, cure: impl Into<String>) -> MeshFileError {
    MeshFileError::new(format!("byte {place}"), message, cure)
}

/// Reads the XML up to the appended data, if there are any.
pub(super) fn document(bytes: &[u8]) -> Result<Document<'_>, MeshFileError> {
    let mut reader = Reader::from_reader(bytes);
    let (mut document, mut section) = (Document::default(), None);
    let (mut has_head, mut has_piece) = (false, false);
    loop {
        let before = reader.buffer_position() as usize;
        let event = reader.read_event().map_err(|e| error(before, format!("invalid XML: {e}"), DAMAGED))?;
        let after = (reader.buffer_position() as usize).min(bytes.len());
        let (tag, is_empty) = match &event {
            Event::Eof if has_piece => return Ok(document),
            Event::Eof => return Err(error(before, "there is no <Piece> of a grid", DAMAGED)),
            Event::Start(tag) => (tag, false),
            Event::Empty(tag) => (tag, true),
            Event::End(tag) => {
                if section_of(tag.name().as_ref()).is_some() {
                    section = None;
                }
                continue;
            }
            _ => continue,
        };
        match tag.name().as_ref() {
            "VTKFile" => {
                head(tag, before, &mut document)?;
                has_head = true;
            }
            _ if !has_head => {
                return Err(error(before, "the file is not a <VTKFile>", "write an unstructured grid, .vtu"));
            }
            "Piece" if has_piece => {
                return Err(error(before, "the file has several pieces", "merge them into one before writing"));
            }
            "Piece" => {
                document.points = number(tag, "NumberOfPoints", before)?;
                document.cells = number(tag, "NumberOfCells", before)?;
                has_piece = true;
            }
            "DataArray" => {
                let Some(section) = section else { continue };
                document.arrays.push(array(tag, is_empty, section, &bytes[after..], before)?);
            }
            "AppendedData" => {
                let base64 = match attribute(tag, "encoding").as_deref() {
                    Some("raw") => false,
                    Some("base64") => true,
                    _ => return Err(error(before, "unknown encoding of the appended data", DAMAGED)),
                };
                let start = bytes[after..].iter().position(|&byte| byte == b'_');
                let start = start.ok_or_else(|| error(after, "the appended data do not begin with _", DAMAGED))?;
                document.appended = Some(Appended { bytes: &bytes[after + start + 1..], base64 });
                return Ok(document);
            }
            name if !is_empty => section = section_of(name).or(section),
            _ => {}
        }
    }
}

fn section_of(name: &str) -> Option<Section> {
    Some(match name {
        "Points" => Section::Points,
        "Cells" => Section::Cells,
        "PointData" => Section::PointData,
        "CellData" => Section::CellData,
        _ => return None,
    })
}

/// The attributes of `<VTKFile>`.
fn head(tag: &BytesStart<'_>, place: usize, document: &mut Document<'_>) -> Result<(), MeshFileError> {
    let of_type = attribute(tag, "type").unwrap_or_default();
    if of_type != "UnstructuredGrid" {
        let message = format!("the file contains a `{of_type}`");
        return Err(error(place, message, "write an unstructured grid, .vtu"));
    }
    document.big_endian = attribute(tag, "byte_order").as_deref() == Some("BigEndian");
    document.long_header = attribute(tag, "header_type").as_deref() == Some("UInt64");
    document.compression = match attribute(tag, "compressor").as_deref() {
        None | Some("") => Compression::None,
        Some("vtkZLibDataCompressor") => Compression::Zlib,
        Some("vtkLZ4DataCompressor") => Compression::Lz4,
        Some("vtkLZMADataCompressor") => Compression::Lzma,
        Some(other) => Compression::Unknown(other.to_owned()),
    };
    Ok(())
}

/// A `<DataArray>`; `rest` is the text after the tag.
fn array<'a>(
    tag: &BytesStart<'_>,
    is_empty: bool,
    section: Section,
    rest: &'a [u8],
    place: usize,
) -> Result<Source<'a>, MeshFileError> {
    let inside = || {
        let end = rest.iter().position(|&byte| byte == b'<').filter(|_| !is_empty);
        &rest[..end.unwrap_or(0)]
    };
    let values = match attribute(tag, "format").as_deref() {
        None | Some("ascii") => Values::Text(inside()),
        Some("binary") => Values::Base64(inside()),
        Some("appended") => Values::Appended(number(tag, "offset", place)?),
        Some(other) => return Err(error(place, format!("unknown format `{other}`"), DAMAGED)),
    };
    let name = match attribute(tag, "Name") {
        Some(name) => name,
        None if section == Section::Points => "Points".into(),
        None => return Err(error(place, "an array has no name", DAMAGED)),
    };
    let components = match attribute(tag, "NumberOfComponents") {
        // ParaView writes 0 where it means 1.
        Some(text) => text.parse().map(|n: usize| n.max(1)).ok(),
        None => Some(1),
    };
    let components = components.ok_or_else(|| error(place, "the number of components is not a number", DAMAGED))?;
    Ok(Source { section, name, type_name: attribute(tag, "type").unwrap_or_default(), components, values })
}

fn attribute(tag: &BytesStart<'_>, name: &str) -> Option<String> {
    let found = tag.attributes().flatten().find(|attribute| attribute.key.as_ref() == name)?;
    quick_xml::escape::unescape(&found.value).ok().map(|text| text.into_owned())
}

fn number(tag: &BytesStart<'_>, name: &str, place: usize) -> Result<usize, MeshFileError> {
    let found = attribute(tag, name).and_then(|text| text.trim().parse().ok());
    found.ok_or_else(|| error(place, format!("the number {name} is missing"), DAMAGED))
}

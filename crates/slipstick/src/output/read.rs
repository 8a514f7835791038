//! Fields of a VTU file that [`Vtu`](super::Vtu) has written, read back.

use std::fs;
use std::path::Path;

use super::OutputError;

/// What stands before the first byte of appended data.
const MARKER: &[u8] = b"<AppendedData encoding=\"raw\">\n_";

/// A field as it stands in a file.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredField {
    /// Name.
    pub name: String,
    /// Whether it has values on points; else on cells.
    pub on_points: bool,
    /// Values per point or cell.
    pub components: usize,
    /// Values, the components of a point or cell together; integers as numbers.
    pub values: Vec<f64>,
}

/// Reads the fields on points and cells of a file of [`Vtu`](super::Vtu); other writers' files are refused.
///
/// # Errors
/// [`OutputError::Io`], [`OutputError::NotRead`] at what is no such file, or a part of one.
pub fn read_fields(path: &Path) -> Result<Vec<StoredField>, OutputError> {
    let bytes = fs::read(path).map_err(OutputError::io("read", path))?;
    fields(&bytes).map_err(|reason| OutputError::NotRead { path: path.to_owned(), reason })
}

fn fields(bytes: &[u8]) -> Result<Vec<StoredField>, String> {
    let split = bytes.windows(MARKER.len()).position(|window| window == MARKER).ok_or("has no appended data")?;
    let header = std::str::from_utf8(&bytes[..split]).map_err(|_| "has a header that is no text")?;
    if !header.contains("byte_order=\"LittleEndian\" header_type=\"UInt64\"") {
        return Err("has another layout than slipstick writes".into());
    }
    let data = &bytes[split + MARKER.len()..];
    let number = |name: &str| {
        let found = header.split('<').find_map(|tag| attribute(tag, name)).and_then(|text| text.parse().ok());
        found.ok_or_else(|| format!("says no {name}"))
    };
    let (points, cells): (usize, usize) = (number("NumberOfPoints")?, number("NumberOfCells")?);
    let (mut found, mut items) = (Vec::new(), None);
    for tag in header.split('<') {
        match tag.split_once('>').map_or(tag, |(name, _)| name) {
            "PointData" => items = Some((true, points)),
            "CellData" => items = Some((false, cells)),
            "Points" | "Cells" => items = None,
            _ => {}
        }
        if let (Some((on_points, count)), Some(offset)) = (items, attribute(tag, "offset")) {
            found.push(field(tag, offset, on_points, count, data)?);
        }
    }
    Ok(found)
}

fn field(tag: &str, offset: &str, on_points: bool, items: usize, data: &[u8]) -> Result<StoredField, String> {
    let name = unescaped(attribute(tag, "Name").ok_or("has a field without a name")?);
    let components: usize = attribute(tag, "NumberOfComponents").map_or(Some(1), |n| n.parse().ok()).unwrap_or(0);
    let values = offset
        .parse()
        .ok()
        .and_then(|offset| array(data, offset))
        .and_then(|bytes| numbers(attribute(tag, "type")?, bytes))
        .filter(|values| components > 0 && components.checked_mul(items) == Some(values.len()));
    let values = values.ok_or_else(|| format!("ends early, or has a wrong number of values of `{name}`"))?;
    Ok(StoredField { name, on_points, components, values })
}

/// The bytes of the array at an offset, after their number.
fn array(data: &[u8], offset: usize) -> Option<&[u8]> {
    let (size, rest) = data.get(offset..)?.split_first_chunk()?;
    rest.get(..usize::try_from(u64::from_le_bytes(*size)).ok()?)
}

fn numbers(type_name: &str, bytes: &[u8]) -> Option<Vec<f64>> {
    Some(match type_name {
        "Float64" => bytes.as_chunks().0.iter().map(|&b| f64::from_le_bytes(b)).collect(),
        "Float32" => bytes.as_chunks().0.iter().map(|&b| f64::from(f32::from_le_bytes(b))).collect(),
        "Int64" => bytes.as_chunks().0.iter().map(|&b| i64::from_le_bytes(b) as f64).collect(),
        "UInt8" => bytes.iter().map(|&b| f64::from(b)).collect(),
        _ => return None,
    })
}

/// Value of an attribute in a tag.
fn attribute<'a>(tag: &'a str, name: &str) -> Option<&'a str> {
    let start = tag.find(&format!(" {name}=\""))? + name.len() + 3;
    tag[start..].split('"').next()
}

/// The inverse of what attributes are written with.
fn unescaped(text: &str) -> String {
    text.replace("&quot;", "\"").replace("&gt;", ">").replace("&lt;", "<").replace("&amp;", "&")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::{Values, Vtu};

    const POINTS: [[f64; 3]; 8] = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [1.0, 0.0, 1.0],
        [1.0, 1.0, 1.0],
        [0.0, 1.0, 1.0],
    ];

    fn written() -> Vec<u8> {
        let displacement: Vec<f64> = (0..24).map(|i| (f64::from(i) * 0.7).sin() / 3.0).collect();
        let mut vtu = Vtu::new(&POINTS, &[[0, 1, 2, 3, 4, 5, 6, 7]]).expect("a mesh");
        vtu.time(0.5).expect("finite");
        vtu.point_field("displacement", 3, Values::F64(&displacement)).expect("fits");
        vtu.point_field("a<b & \"c\"", 1, Values::I64(&[-1, 0, 1, 2, 3, 4, 5, 6])).expect("fits");
        vtu.cell_field("density", 1, Values::F64(&[0.1])).expect("fits");
        let mut bytes = Vec::new();
        vtu.write(&mut bytes).expect("memory");
        bytes
    }

    #[test]
    fn what_was_written_is_read() {
        let found = fields(&written()).expect("whole");
        let names: Vec<_> = found.iter().map(|f| (f.name.as_str(), f.on_points, f.components)).collect();
        assert_eq!(names, [("displacement", true, 3), ("a<b & \"c\"", true, 1), ("density", false, 1)]);
        assert_eq!(found[0].values[5], (5.0 * 0.7f64).sin() / 3.0);
        assert_eq!(found[1].values, [-1.0, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!(found[2].values, [0.1]);
    }

    /// No part of a file is taken for a whole one, and none makes the reader panic.
    #[test]
    fn parts_are_refused() {
        let whole = written();
        let end = whole.len() - b"\n</AppendedData>\n</VTKFile>\n".len();
        for length in 0..end {
            assert!(fields(&whole[..length]).is_err(), "{length}");
        }
        let text = String::from_utf8_lossy(&whole).into_owned();
        let offset = text.replace("offset=\"0\"", "offset=\"99999999999\"").replace("offset=\"8", "offset=\"9");
        assert!(fields(offset.as_bytes()).is_err());
    }
}

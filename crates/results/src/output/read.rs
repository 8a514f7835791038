//! Reads the fields of a VTU file.

use std::fs;
use std::path::Path;

use slipstick_meshio::vtu;

use super::OutputError;

/// A field as stored in a file.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredField {
    /// Name.
    pub name: String,
    /// Whether its values are on points; otherwise they are on cells.
    pub on_points: bool,
    /// Values per point or cell.
    pub components: usize,
    /// Values, grouped by point or cell; integers are converted.
    pub values: Vec<f64>,
}

/// Reads the fields on points and cells of a file.
///
/// # Errors
/// [`OutputError::Io`], [`OutputError::NotRead`] if the file is not a VTU file or is incomplete.
pub fn read_fields(path: &Path) -> Result<Vec<StoredField>, OutputError> {
    let bytes = fs::read(path).map_err(OutputError::io("read", path))?;
    fields(&bytes).map_err(|reason| OutputError::NotRead { path: path.to_owned(), reason })
}

fn fields(bytes: &[u8]) -> Result<Vec<StoredField>, String> {
    let grid = vtu::read(bytes).map_err(|error| format!("cannot be read: {}: {}", error.place, error.message))?;
    let stored = |on_points| {
        move |array: vtu::Array| StoredField {
            name: array.name,
            on_points,
            components: array.components,
            values: array.values,
        }
    };
    Ok(grid.point_data.into_iter().map(stored(true)).chain(grid.cell_data.into_iter().map(stored(false))).collect())
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
        let mut vtu = Vtu::new(&POINTS, &[[0, 1, 2, 3, 4, 5, 6, 7].into()]).expect("a mesh");
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

    /// No part of a file is accepted as a complete one, and none makes the reader panic.
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

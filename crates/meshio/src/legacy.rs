//! VTK's older files of unstructured grids, `.vtk` (VTK file formats, "Simple legacy formats").
//!
//! Up to version 4.2, each cell is listed with its number of nodes; from version 5.1 on, cells are
//! two arrays, offsets and connectivity. Binary numbers are big-endian.

use crate::MeshFileError;
use crate::cursor::{Cursor, Encoding, shortened};
use crate::error::DAMAGED;
use crate::vtu::{Array, Grid, check};

/// The start of the first line.
const START: &[u8] = b"# vtk DataFile Version";

/// Whether bytes are a file of this kind.
pub(crate) fn recognises(bytes: &[u8]) -> bool {
    bytes.trim_ascii_start().starts_with(START)
}

/// The type of the numbers of an array.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Scalar {
    Unsigned(u8),
    Signed(u8),
    Float,
    Double,
}

impl Scalar {
    fn named(word: &str) -> Option<Self> {
        Some(match word.to_ascii_lowercase().as_str() {
            "unsigned_char" | "vtktypeuint8" => Self::Unsigned(1),
            "char" | "signed_char" | "vtktypeint8" => Self::Signed(1),
            "unsigned_short" | "vtktypeuint16" => Self::Unsigned(2),
            "short" | "vtktypeint16" => Self::Signed(2),
            "unsigned_int" | "vtktypeuint32" => Self::Unsigned(4),
            // numbers of points and cells are stored with 32 bits
            "int" | "vtkidtype" | "vtktypeint32" => Self::Signed(4),
            "unsigned_long" | "vtktypeuint64" => Self::Unsigned(8),
            "long" | "vtktypeint64" => Self::Signed(8),
            "float" => Self::Float,
            "double" => Self::Double,
            _ => return None,
        })
    }

    fn is_integer(self) -> bool {
        !matches!(self, Self::Float | Self::Double)
    }

    fn size(self) -> usize {
        match self {
            Self::Unsigned(size) | Self::Signed(size) => size.into(),
            Self::Float => 4,
            Self::Double => 8,
        }
    }

    fn read(self, cursor: &mut Cursor<'_>) -> Result<f64, MeshFileError> {
        if cursor.encoding == Encoding::Ascii {
            return cursor.parsed("a number");
        }
        Ok(match self {
            Self::Unsigned(1) => u8::from_le_bytes(cursor.binary()?).into(),
            Self::Signed(1) => i8::from_le_bytes(cursor.binary()?).into(),
            Self::Unsigned(2) => u16::from_le_bytes(cursor.binary()?).into(),
            Self::Signed(2) => i16::from_le_bytes(cursor.binary()?).into(),
            Self::Unsigned(4) => u32::from_le_bytes(cursor.binary()?).into(),
            Self::Signed(4) => i32::from_le_bytes(cursor.binary()?).into(),
            Self::Unsigned(_) => u64::from_le_bytes(cursor.binary()?) as f64,
            Self::Signed(_) => i64::from_le_bytes(cursor.binary()?) as f64,
            Self::Float => f32::from_le_bytes(cursor.binary()?).into(),
            Self::Double => f64::from_le_bytes(cursor.binary()?),
        })
    }
}

/// What the values of a field belong to.
#[derive(Clone, Copy, PartialEq)]
enum Owner {
    File,
    Points(u64),
    Cells(u64),
}

/// Reads a file.
///
/// # Errors
/// [`MeshFileError`] if the file is inconsistent, incomplete, or in a format that is not supported.
pub(crate) fn read(bytes: &[u8]) -> Result<Grid, MeshFileError> {
    let mut file = Cursor::new(bytes);
    file.skip_whitespace();
    file.line()?;
    // the title may be in any encoding
    file.skip_past("\n")?;
    let encoding = match file.line()?.to_ascii_uppercase().as_str() {
        "ASCII" => Encoding::Ascii,
        "BINARY" => Encoding::BigEndian,
        other => {
            return Err(file.error(format!("`{}` was found instead of ASCII or BINARY", shortened(other)), DAMAGED));
        }
    };
    let (mut grid, mut cells, mut owner) = (Grid::default(), 0, Owner::File);
    while !file.at_end() {
        file.encoding = Encoding::Ascii;
        let line = file.line()?;
        let words: Vec<&str> = line.split_whitespace().collect();
        let keyword = words.first().copied().unwrap_or_default().to_ascii_uppercase();
        let word = |at: usize| words.get(at).copied().unwrap_or_default();
        let whole = |at: usize| word(at).parse::<u64>().map_err(|_| damaged(&file, line));
        let scalar = |at: usize| Scalar::named(word(at)).ok_or_else(|| damaged(&file, line));
        match keyword.as_str() {
            "DATASET" if word(1).eq_ignore_ascii_case("UNSTRUCTURED_GRID") => {}
            "DATASET" => {
                let message = format!("the data set is {}", shortened(word(1)));
                return Err(file.error(message, "save it as an unstructured grid, for instance in ParaView as .vtu"));
            }
            "POINTS" => {
                let (count, of) = (whole(1)?, scalar(2)?);
                let values = numbers(&mut file, encoding, of, count, 3)?;
                grid.points = values.as_chunks().0.to_vec();
            }
            "CELLS" => {
                let sizes = [whole(1)?, whole(2)?];
                cells = read_cells(&mut file, encoding, sizes, &mut grid)?;
            }
            "CELL_TYPES" => {
                let count = whole(1)?;
                let types = numbers(&mut file, encoding, Scalar::Signed(4), count, 1)?;
                grid.types = types.iter().map(|&value| value as u8).collect();
            }
            "POINT_DATA" => owner = Owner::Points(whole(1)?),
            "CELL_DATA" => owner = Owner::Cells(whole(1)?),
            "METADATA" => while !file.line()?.is_empty() {},
            "FIELD" => {
                for _ in 0..whole(2)? {
                    file.encoding = Encoding::Ascii;
                    file.skip_whitespace();
                    read_field(&mut file, encoding, owner, &mut grid)?;
                }
            }
            "SCALARS" => {
                let of = scalar(2)?;
                let components = if words.len() > 3 { whole(3)? } else { 1 };
                let table = file.line()?;
                if !table.to_ascii_uppercase().starts_with("LOOKUP_TABLE") {
                    return Err(damaged(&file, table));
                }
                keep(&mut file, encoding, owner, (word(1), of, components), &mut grid)?;
            }
            // colours
            "LOOKUP_TABLE" => {
                let colours = whole(2)?;
                numbers(&mut file, encoding, Scalar::Unsigned(1), colours, 4)?;
            }
            "COLOR_SCALARS" => {
                let components = whole(2)?;
                keep(&mut file, encoding, owner, (word(1), Scalar::Unsigned(1), components), &mut grid)?;
            }
            "VECTORS" | "NORMALS" => {
                let of = scalar(2)?;
                keep(&mut file, encoding, owner, (word(1), of, 3), &mut grid)?;
            }
            "TENSORS" | "TENSORS6" => {
                let (of, components) = (scalar(2)?, if keyword == "TENSORS" { 9 } else { 6 });
                keep(&mut file, encoding, owner, (word(1), of, components), &mut grid)?;
            }
            "TEXTURE_COORDINATES" => {
                let (components, of) = (whole(2)?, scalar(3)?);
                keep(&mut file, encoding, owner, (word(1), of, components), &mut grid)?;
            }
            "GLOBAL_IDS" | "PEDIGREE_IDS" => {
                let of = scalar(2)?;
                numbers(&mut file, encoding, of, count_of(owner), 1)?;
            }
            _ => return Err(damaged(&file, line)),
        }
    }
    check(grid.points.len(), cells, &grid)?;
    Ok(grid)
}

fn damaged(file: &Cursor<'_>, line: &str) -> MeshFileError {
    file.error(format!("`{}` is not understood", shortened(line)), DAMAGED)
}

fn count_of(owner: Owner) -> u64 {
    match owner {
        Owner::File => 0,
        Owner::Points(count) | Owner::Cells(count) => count,
    }
}

/// The numbers of an array, which begin at the start of a line.
fn numbers(
    file: &mut Cursor<'_>,
    encoding: Encoding,
    of: Scalar,
    count: u64,
    components: u64,
) -> Result<Vec<f64>, MeshFileError> {
    let all = count.checked_mul(components).ok_or_else(|| file.error("the array is too large", DAMAGED))?;
    file.encoding = encoding;
    let size = if encoding == Encoding::Ascii { 1 } else { of.size() };
    let mut values = Vec::with_capacity(file.capacity(all, size));
    for _ in 0..all {
        values.push(of.read(file)?);
    }
    file.encoding = Encoding::Ascii;
    Ok(values)
}

/// Reads the cells; returns their number.
fn read_cells(
    file: &mut Cursor<'_>,
    encoding: Encoding,
    [first, second]: [u64; 2],
    grid: &mut Grid,
) -> Result<usize, MeshFileError> {
    let node = |file: &Cursor<'_>, value: f64| {
        let good = value.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&value);
        good.then_some(value as u32).ok_or_else(|| file.error(format!("{value} is not the number of a node"), DAMAGED))
    };
    let mut peek = file.clone();
    let offsets = peek.word().is_ok_and(|word| word.eq_ignore_ascii_case("OFFSETS"));
    if !offsets {
        let values = numbers(file, encoding, Scalar::Signed(4), second, 1)?;
        let mut rest = &values[..];
        while let Some((&count, after)) = rest.split_first() {
            let count = node(file, count)? as usize;
            let nodes = after.get(..count).ok_or_else(|| file.error("a cell is incomplete", DAMAGED))?;
            for &value in nodes {
                grid.connectivity.push(node(file, value)?);
            }
            grid.offsets.push(grid.connectivity.len());
            rest = &after[count..];
        }
        return Ok(usize::try_from(first).unwrap_or(usize::MAX));
    }
    let mut array = |name: &str, count: u64| {
        file.skip_whitespace();
        let line = file.line()?;
        let mut words = line.split_whitespace();
        let of = words.next().filter(|word| word.eq_ignore_ascii_case(name)).and(words.next()).and_then(Scalar::named);
        let of = of.ok_or_else(|| damaged(file, line))?;
        let values = numbers(file, encoding, of, count, 1)?;
        values.into_iter().map(|value| node(file, value)).collect::<Result<Vec<u32>, _>>()
    };
    let ends = array("OFFSETS", first)?;
    grid.connectivity = array("CONNECTIVITY", second)?;
    if ends.first().is_some_and(|&start| start != 0) {
        return Err(file.error("the first offset is not 0", DAMAGED));
    }
    grid.offsets = ends.iter().skip(1).map(|&end| end as usize).collect();
    Ok(grid.offsets.len())
}

/// Reads an array of a field: name, components, number of values, type.
fn read_field(file: &mut Cursor<'_>, encoding: Encoding, owner: Owner, grid: &mut Grid) -> Result<(), MeshFileError> {
    let line = file.line()?;
    let words: Vec<&str> = line.split_whitespace().collect();
    if words.first().is_some_and(|word| word.eq_ignore_ascii_case("METADATA")) {
        while !file.line()?.is_empty() {}
        file.skip_whitespace();
        return read_field(file, encoding, owner, grid);
    }
    let [name, components, count, of] = words[..] else { return Err(damaged(file, line)) };
    let whole = |word: &str| word.parse::<u64>().map_err(|_| damaged(file, line));
    let (components, count) = (whole(components)?, whole(count)?);
    if of.eq_ignore_ascii_case("string") {
        let cure = "leave texts out, or save the grid as .vtu";
        return Err(file.error(format!("the array `{}` consists of texts", shortened(name)), cure));
    }
    let of = Scalar::named(of).ok_or_else(|| damaged(file, line))?;
    if owner == Owner::File {
        numbers(file, encoding, of, count, components)?;
        return Ok(());
    }
    if count != count_of(owner) {
        return Err(damaged(file, line));
    }
    keep(file, encoding, owner, (name, of, components), grid)
}

/// Reads the values of a field on points or cells.
fn keep(
    file: &mut Cursor<'_>,
    encoding: Encoding,
    owner: Owner,
    (name, of, components): (&str, Scalar, u64),
    grid: &mut Grid,
) -> Result<(), MeshFileError> {
    let values = numbers(file, encoding, of, count_of(owner), components)?;
    let name = name.replace("%20", " ");
    let components = usize::try_from(components).unwrap_or(usize::MAX);
    let array = Array { name, components, integer: of.is_integer(), values };
    match owner {
        Owner::Points(count) if count == grid.points.len() as u64 => grid.point_data.push(array),
        Owner::Cells(count) if count == grid.offsets.len() as u64 => grid.cell_data.push(array),
        _ => return Err(file.error(format!("the number of values of `{}` is wrong", array.name), DAMAGED)),
    }
    Ok(())
}

//! VTK's XML file of an unstructured grid, with values appended as raw little-endian binary.
//!
//! The XML part lists the arrays with their offsets into the appended data; each array there is its
//! size in bytes (UInt64) and its values. Format: VTK User's Guide, "XML File Formats".

use std::io::{self, Write};
use std::path::Path;

use slipstick_mesh::Element;

use super::{OutputError, write_atomically, xml};

/// VTK's type numbers of the linear tetrahedron and hexahedron, whose node order is the same as in
/// the mesh, of the wedge and of the triangle.
const TETRAHEDRON: u8 = 10;
const HEXAHEDRON: u8 = 12;
const QUADRATIC_TETRAHEDRON: u8 = 24;
const TRIQUADRATIC_HEXAHEDRON: u8 = 29;
/// Numbered as in the mesh, unlike [`VTK_WEDGE`].
const BIQUADRATIC_WEDGE: u8 = 32;
const WEDGE: u8 = 13;
const TRIANGLE: u8 = 5;

/// The mesh's nodes of a wedge in the order of VTK's file format: its first triangle is
/// counter-clockwise seen from outside.
///
/// VTK 9.7 reversed this order without a new version of the format. Most viewers use an earlier
/// VTK, and 9.7 draws either order; only the cell volumes that it computes are then negative.
const VTK_WEDGE: [usize; 6] = [0, 2, 1, 3, 5, 4];

/// Values of a field, grouped by item.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Values<'a> {
    /// 64-bit floating point, written as Float64.
    F64(&'a [f64]),
    /// 32-bit floating point, written as Float32.
    F32(&'a [f32]),
    /// 64-bit integers, written as Int64.
    I64(&'a [i64]),
    /// Bytes, written as UInt8.
    U8(&'a [u8]),
}

impl Values<'_> {
    pub(super) fn len(&self) -> usize {
        match self {
            Self::F64(values) => values.len(),
            Self::F32(values) => values.len(),
            Self::I64(values) => values.len(),
            Self::U8(values) => values.len(),
        }
    }

    pub(super) fn type_name(&self) -> &'static str {
        match self {
            Self::F64(_) => "Float64",
            Self::F32(_) => "Float32",
            Self::I64(_) => "Int64",
            Self::U8(_) => "UInt8",
        }
    }

    fn bytes(&self) -> u64 {
        let size = match self {
            Self::F64(_) | Self::I64(_) => 8,
            Self::F32(_) => 4,
            Self::U8(_) => 1,
        };
        size * self.len() as u64
    }

    /// The first value that is not finite.
    fn not_finite(&self) -> Option<(usize, f64)> {
        let find = |values: &mut dyn Iterator<Item = f64>| values.enumerate().find(|(_, value)| !value.is_finite());
        match self {
            Self::F64(values) => find(&mut values.iter().copied()),
            Self::F32(values) => find(&mut values.iter().map(|&value| f64::from(value))),
            Self::I64(_) | Self::U8(_) => None,
        }
    }

    /// Writes the values' bytes, little-endian.
    pub(super) fn write(&self, writer: &mut dyn Write) -> io::Result<()> {
        match self {
            Self::F64(values) => write_all(writer, values.iter().map(|value| value.to_le_bytes())),
            Self::F32(values) => write_all(writer, values.iter().map(|value| value.to_le_bytes())),
            Self::I64(values) => write_all(writer, values.iter().map(|value| value.to_le_bytes())),
            Self::U8(values) => writer.write_all(values),
        }
    }
}

/// Writes in blocks of a few kilobytes: a call per value through the trait object would dominate
/// the time.
fn write_all<const N: usize>(writer: &mut dyn Write, values: impl Iterator<Item = [u8; N]>) -> io::Result<()> {
    let mut buffer = Vec::with_capacity(1 << 13);
    for value in values {
        buffer.extend_from_slice(&value);
        if buffer.len() >= (1 << 13) - N {
            writer.write_all(&buffer)?;
            buffer.clear();
        }
    }
    writer.write_all(&buffer)
}

#[derive(Debug, Clone)]
pub(super) struct Field<'a> {
    pub(super) name: String,
    pub(super) components: usize,
    pub(super) values: Values<'a>,
}

/// A mesh of elements or triangles with fields on points and cells.
#[derive(Debug, Clone)]
pub struct Vtu<'a> {
    pub(super) points: &'a [[f64; 3]],
    /// Points of the cells, cell by cell; the end of each cell's points, and VTK's number of its
    /// type.
    pub(super) connectivity: Vec<i64>,
    pub(super) offsets: Vec<i64>,
    pub(super) types: Vec<u8>,
    pub(super) point_fields: Vec<Field<'a>>,
    pub(super) cell_fields: Vec<Field<'a>>,
    pub(super) time: Option<f64>,
}

impl<'a> Vtu<'a> {
    /// A mesh without fields: coordinates \[L\] and elements.
    ///
    /// # Errors
    ///
    /// [`OutputError::NotFinite`] for coordinates, [`OutputError::NodeOutOfRange`].
    pub fn new(points: &'a [[f64; 3]], elements: &[Element]) -> Result<Self, OutputError> {
        let elements: Vec<(Element, u8)> = elements
            .iter()
            .map(|&element| match element {
                Element::Tet4(_) => (element, TETRAHEDRON),
                Element::Wedge6(nodes) => (VTK_WEDGE.map(|corner| nodes[corner]).into(), WEDGE),
                Element::Hex8(_) => (element, HEXAHEDRON),
                Element::Tet10(_) => (element, QUADRATIC_TETRAHEDRON),
                Element::Wedge18(_) => (element, BIQUADRATIC_WEDGE),
                Element::Hex27(_) => (element, TRIQUADRATIC_HEXAHEDRON),
            })
            .collect();
        Self::of_cells(points, elements.iter().map(|(element, cell_type)| (element.nodes(), *cell_type)))
    }

    /// A surface without fields: coordinates \[L\] and the point numbers of its triangles.
    ///
    /// # Errors
    ///
    /// As [`Vtu::new`].
    pub fn of_triangles(points: &'a [[f64; 3]], triangles: &[[u32; 3]]) -> Result<Self, OutputError> {
        Self::of_cells(points, triangles.iter().map(|triangle| (&triangle[..], TRIANGLE)))
    }

    fn of_cells<'b>(points: &'a [[f64; 3]], cells: impl Iterator<Item = (&'b [u32], u8)>) -> Result<Self, OutputError> {
        check_finite("points", Values::F64(points.as_flattened()))?;
        let (mut connectivity, mut offsets, mut types) = (Vec::new(), Vec::new(), Vec::new());
        for (element, (nodes, cell_type)) in cells.enumerate() {
            if let Some(&node) = nodes.iter().find(|&&node| node as usize >= points.len()) {
                return Err(OutputError::NodeOutOfRange { element, node, nodes: points.len() });
            }
            connectivity.extend(nodes.iter().map(|&node| i64::from(node)));
            offsets.push(connectivity.len() as i64);
            types.push(cell_type);
        }
        let (point_fields, cell_fields) = (Vec::new(), Vec::new());
        Ok(Self { points, connectivity, offsets, types, point_fields, cell_fields, time: None })
    }

    pub(super) fn cells(&self) -> usize {
        self.types.len()
    }

    /// Sets the time of the file, which viewers display.
    ///
    /// # Errors
    ///
    /// [`OutputError::NotFinite`].
    pub fn time(&mut self, time: f64) -> Result<&mut Self, OutputError> {
        check_finite("time", Values::F64(&[time]))?;
        self.time = Some(time);
        Ok(self)
    }

    /// Adds a field on the points: `components` values per point (3 for a vector).
    ///
    /// # Errors
    ///
    /// [`OutputError::Length`], [`OutputError::NotFinite`], [`OutputError::DuplicateField`].
    pub fn point_field(&mut self, name: &str, components: usize, values: Values<'a>) -> Result<&mut Self, OutputError> {
        let field = field(name, components, values, "points", self.points.len(), &self.point_fields)?;
        self.point_fields.push(field);
        Ok(self)
    }

    /// Adds a field on the cells: `components` values per element or triangle.
    ///
    /// # Errors
    ///
    /// [`OutputError::Length`], [`OutputError::NotFinite`], [`OutputError::DuplicateField`].
    pub fn cell_field(&mut self, name: &str, components: usize, values: Values<'a>) -> Result<&mut Self, OutputError> {
        let field = field(name, components, values, "cells", self.cells(), &self.cell_fields)?;
        self.cell_fields.push(field);
        Ok(self)
    }

    /// Writes the file through a temporary one ([`write_atomically`]).
    ///
    /// # Errors
    ///
    /// [`OutputError::Io`].
    pub fn save(&self, path: &Path) -> Result<(), OutputError> {
        write_atomically(path, |writer| self.write(writer))
    }

    /// Writes the file's bytes.
    ///
    /// # Errors
    ///
    /// Those of the writer.
    pub fn write(&self, writer: &mut dyn Write) -> io::Result<()> {
        let array = |name: &str, components, values| Field { name: name.to_owned(), components, values };
        let points = [array("Points", 3, Values::F64(self.points.as_flattened()))];
        let cells = [
            array("connectivity", 1, Values::I64(&self.connectivity)),
            array("offsets", 1, Values::I64(&self.offsets)),
            array("types", 1, Values::U8(&self.types)),
        ];
        let sections: [(&str, &[Field<'_>]); 4] = [
            ("Points", &points),
            ("Cells", &cells),
            ("PointData", &self.point_fields),
            ("CellData", &self.cell_fields),
        ];
        self.write_header(writer, &sections)?;
        writer.write_all(b"<AppendedData encoding=\"raw\">\n_")?;
        for field in sections.iter().flat_map(|(_, fields)| *fields) {
            writer.write_all(&field.values.bytes().to_le_bytes())?;
            field.values.write(writer)?;
        }
        writer.write_all(b"\n</AppendedData>\n</VTKFile>\n")
    }

    fn write_header(&self, writer: &mut dyn Write, sections: &[(&str, &[Field<'_>])]) -> io::Result<()> {
        writeln!(
            writer,
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" \
             byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<UnstructuredGrid>"
        )?;
        if let Some(time) = self.time {
            writeln!(
                writer,
                "<FieldData>\n<DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" \
                 format=\"ascii\">{time:?}</DataArray>\n</FieldData>"
            )?;
        }
        let (points, cells) = (self.points.len(), self.cells());
        writeln!(writer, "<Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{cells}\">")?;
        let mut offset = 0;
        for (section, fields) in sections {
            writeln!(writer, "<{section}{}>", shown_first(section, fields))?;
            for Field { name, components, values } in *fields {
                let (name, type_name) = (xml(name), values.type_name());
                // Without the attribute it is 1, and readers return a list of numbers instead of
                // lists of one number.
                let components = match components {
                    1 => String::new(),
                    n => format!(" NumberOfComponents=\"{n}\""),
                };
                writeln!(
                    writer,
                    "<DataArray type=\"{type_name}\" Name=\"{name}\"{components} \
                     format=\"appended\" offset=\"{offset}\"/>"
                )?;
                offset += size_of::<u64>() as u64 + values.bytes();
            }
            writeln!(writer, "</{section}>")?;
        }
        writeln!(writer, "</Piece>\n</UnstructuredGrid>")
    }
}

fn field<'a>(
    name: &str,
    components: usize,
    values: Values<'a>,
    what: &'static str,
    items: usize,
    others: &[Field<'_>],
) -> Result<Field<'a>, OutputError> {
    check_field(name, components, values, what, items)?;
    let name = name.to_owned();
    if others.iter().any(|other| other.name == name) {
        return Err(OutputError::DuplicateField { name, what });
    }
    Ok(Field { name, components, values })
}

/// Checks that a field has a value for every component of every item, and that they are finite.
pub(super) fn check_field(
    name: &str,
    components: usize,
    values: Values<'_>,
    what: &'static str,
    items: usize,
) -> Result<(), OutputError> {
    let found = values.len();
    if components == 0 || components.checked_mul(items) != Some(found) {
        return Err(OutputError::Length { name: name.to_owned(), components, what, items, found });
    }
    check_finite(name, values)
}

/// The roles of the fields that viewers show by default, and their numbers of components: a field
/// has a role if it is the first of its kind, scalar or vector, on the points or on the cells.
pub(super) const SHOWN_FIRST: [(&str, usize); 2] = [("Scalars", 1), ("Vectors", 3)];

/// The attributes of a section that name the fields to show ([`SHOWN_FIRST`]).
pub(super) fn shown_first(section: &str, fields: &[Field<'_>]) -> String {
    let first = |(attribute, components)| {
        let field = fields.iter().find(|field| field.components == components);
        field.map_or(String::new(), |field| format!(" {attribute}=\"{}\"", xml(&field.name)))
    };
    match section {
        "PointData" | "CellData" => SHOWN_FIRST.map(first).concat(),
        _ => String::new(),
    }
}

pub(super) fn check_finite(name: &str, values: Values<'_>) -> Result<(), OutputError> {
    match values.not_finite() {
        Some((entry, value)) => Err(OutputError::NotFinite { name: name.to_owned(), entry, value }),
        None => Ok(()),
    }
}

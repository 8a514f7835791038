//! A mesh in pieces: VTK's XML file of a partitioned unstructured grid, and a VTU file for each
//! piece.
//!
//! Viewers that run on several processes distribute the pieces over them. Format: VTK User's Guide,
//! "XML File Formats".

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use super::vtu::{Field, Values, Vtu, shown_first};
use super::{OutputError, write_atomically, xml};

/// Names of the fields in pieces that contain the numbers of their points and cells in the whole
/// mesh.
const NODE: &str = "node";
const ELEMENT: &str = "element";

/// A field that owns its numbers.
enum Owned {
    F64(Vec<f64>),
    F32(Vec<f32>),
    I64(Vec<i64>),
    U8(Vec<u8>),
}

impl Owned {
    /// The values of some of the items.
    fn of(values: Values<'_>, components: usize, items: &[usize]) -> Self {
        fn some<T: Copy>(values: &[T], components: usize, items: &[usize]) -> Vec<T> {
            items.iter().flat_map(|item| &values[item * components..][..components]).copied().collect()
        }
        match values {
            Values::F64(values) => Self::F64(some(values, components, items)),
            Values::F32(values) => Self::F32(some(values, components, items)),
            Values::I64(values) => Self::I64(some(values, components, items)),
            Values::U8(values) => Self::U8(some(values, components, items)),
        }
    }

    fn values(&self) -> Values<'_> {
        match self {
            Self::F64(values) => Values::F64(values),
            Self::F32(values) => Values::F32(values),
            Self::I64(values) => Values::I64(values),
            Self::U8(values) => Values::U8(values),
        }
    }
}

/// Removes the piece files of an earlier `{stem}.pvtu`.
fn remove_pieces(path: &Path) -> std::io::Result<()> {
    let (Some(folder), Some(stem)) = (path.parent(), path.file_stem().and_then(|stem| stem.to_str())) else {
        return Ok(());
    };
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        let piece = entry.file_name().to_str().and_then(|name| {
            name.strip_prefix(stem)?.strip_prefix('.')?.strip_suffix(".vtu").and_then(|piece| piece.parse::<u32>().ok())
        });
        if piece.is_some() {
            std::fs::remove_file(entry.path())?;
        }
    }
    Ok(())
}

/// The file of a piece of `{stem}.pvtu`: `{stem}.{piece}.vtu` in the same folder.
fn piece_file(path: &Path, piece: u32) -> PathBuf {
    path.with_extension(format!("{piece}.vtu"))
}

impl Vtu<'_> {
    /// Writes the mesh in pieces: `path`, which should end in `.pvtu`, and in the same folder a
    /// file for each piece that has cells. `piece_of` contains the piece of every cell; points
    /// belong to all pieces that use them. Fields `node` and `element` with the numbers in the
    /// whole mesh are added. Pieces of an earlier file with that name are removed.
    ///
    /// # Errors
    ///
    /// [`OutputError::Io`]; [`OutputError::Length`] if the number of entries of `piece_of` is not
    /// the number of cells; [`OutputError::DuplicateField`].
    pub fn save_pieces(&self, path: &Path, piece_of: &[u32]) -> Result<(), OutputError> {
        let (items, found) = (self.cells(), piece_of.len());
        if items != found {
            let name = "piece".to_owned();
            return Err(OutputError::Length { name, components: 1, what: "cells", items, found });
        }
        remove_pieces(path).map_err(OutputError::io("remove pieces of", path))?;
        let mut cells_of: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        piece_of.iter().enumerate().for_each(|(cell, &piece)| cells_of.entry(piece).or_default().push(cell));
        let mut number = vec![i64::MAX; self.points.len()];
        let mut sources = Vec::new();
        for (piece, cells) in &cells_of {
            let file = piece_file(path, *piece);
            self.save_piece(&file, cells, &mut number)?;
            sources.extend(file.file_name().and_then(|name| name.to_str()).map(str::to_owned));
        }
        let text = self.pieces_as_xml(&sources);
        write_atomically(path, |writer| writer.write_all(text.as_bytes()))
    }

    /// Writes some of the cells with their points; `number` is scratch space for one number per
    /// point.
    fn save_piece(&self, path: &Path, cells: &[usize], number: &mut [i64]) -> Result<(), OutputError> {
        let begin = |cell: usize| if cell == 0 { 0 } else { self.offsets[cell - 1] as usize };
        let of = |cell: usize| &self.connectivity[begin(cell)..self.offsets[cell] as usize];
        let mut nodes: Vec<usize> = cells.iter().flat_map(|&cell| of(cell)).map(|&node| node as usize).collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes.iter().enumerate().for_each(|(here, &node)| number[node] = here as i64);
        let points: Vec<[f64; 3]> = nodes.iter().map(|&node| self.points[node]).collect();
        let (mut connectivity, mut offsets) = (Vec::new(), Vec::with_capacity(cells.len()));
        for &cell in cells {
            connectivity.extend(of(cell).iter().map(|&node| number[node as usize]));
            offsets.push(connectivity.len() as i64);
        }
        let part = |fields: &[Field<'_>], items: &[usize]| -> Vec<(String, usize, Owned)> {
            let own = |field: &Field<'_>| {
                (field.name.clone(), field.components, Owned::of(field.values, field.components, items))
            };
            fields.iter().map(own).collect()
        };
        let (on_points, on_cells) = (part(&self.point_fields, &nodes), part(&self.cell_fields, cells));
        let numbers = |items: &[usize]| items.iter().map(|&item| item as i64).collect::<Vec<i64>>();
        let (node_numbers, element_numbers) = (numbers(&nodes), numbers(cells));
        let mut file = Vtu {
            points: &points,
            connectivity,
            offsets,
            types: cells.iter().map(|&cell| self.types[cell]).collect(),
            point_fields: Vec::new(),
            cell_fields: Vec::new(),
            time: self.time,
        };
        for (name, components, values) in &on_points {
            file.point_field(name, *components, values.values())?;
        }
        file.point_field(NODE, 1, Values::I64(&node_numbers))?;
        for (name, components, values) in &on_cells {
            file.cell_field(name, *components, values.values())?;
        }
        file.cell_field(ELEMENT, 1, Values::I64(&element_numbers))?;
        file.save(path)
    }

    /// The file that lists the pieces and their fields.
    fn pieces_as_xml(&self, sources: &[String]) -> String {
        let array = |name: &str, values: Values<'_>, components: usize| {
            let (type_name, name) = (values.type_name(), xml(name));
            format!("<PDataArray type=\"{type_name}\" Name=\"{name}\" NumberOfComponents=\"{components}\"/>\n")
        };
        let section = |kind: &str, fields: &[Field<'_>], number: &str| {
            let arrays: String =
                fields.iter().map(|field| array(&field.name, field.values, field.components)).collect();
            let shown = shown_first(kind, fields);
            format!("<P{kind}{shown}>\n{arrays}{}</P{kind}>\n", array(number, Values::I64(&[]), 1))
        };
        let mut text = String::from(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"PUnstructuredGrid\" version=\"1.0\" \
             byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<PUnstructuredGrid GhostLevel=\"0\">\n<PPoints>\n",
        );
        text += &array("Points", Values::F64(&[]), 3);
        text += "</PPoints>\n";
        text += &section("PointData", &self.point_fields, NODE);
        text += &section("CellData", &self.cell_fields, ELEMENT);
        for source in sources {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "<Piece Source=\"{}\"/>", xml(source));
        }
        text += "</PUnstructuredGrid>\n</VTKFile>\n";
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::read_fields;

    /// Two cells in pieces 2 and 0, none in 1: points at the cut are in both, the numbers refer to
    /// the whole mesh, and files from a different number of pieces are gone.
    #[test]
    fn pieces_have_the_fields_of_the_whole() {
        let folder = tempfile::tempdir().expect("a folder");
        let points: Vec<[f64; 3]> = (0..5).map(|i| [f64::from(i), f64::from(i * i), f64::from(i % 2)]).collect();
        let mut whole = Vtu::new(&points, &[[0, 1, 2, 3].into(), [1, 2, 3, 4].into()]).expect("a mesh");
        let displacement: Vec<f64> = (0..15).map(f64::from).collect();
        whole.point_field("displacement", 3, Values::F64(&displacement)).expect("fits");
        whole.cell_field("body", 1, Values::I64(&[7, 8])).expect("fits");
        let path = folder.path().join("path_0001.pvtu");
        whole.save_pieces(&path, &[3, 1]).expect("written");
        whole.save_pieces(&path, &[2, 0]).expect("written");
        let mut names: Vec<_> = std::fs::read_dir(folder.path())
            .expect("a folder")
            .map(|entry| entry.expect("a file").file_name())
            .collect();
        names.sort();
        assert_eq!(names, ["path_0001.0.vtu", "path_0001.2.vtu", "path_0001.pvtu"]);
        for (piece, nodes, body) in [(2, [0, 1, 2, 3], 7.0), (0, [1, 2, 3, 4], 8.0)] {
            let fields = read_fields(&folder.path().join(format!("path_0001.{piece}.vtu"))).expect("whole");
            let names: Vec<&str> = fields.iter().map(|field| field.name.as_str()).collect();
            assert_eq!(names, ["displacement", "node", "body", "element"]);
            assert_eq!(
                fields[0].values,
                nodes.map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).concat().into_iter().map(f64::from).collect::<Vec<_>>()
            );
            assert_eq!(fields[1].values, nodes.map(f64::from));
            assert_eq!((fields[2].values[0], fields[3].values[0]), (body, body - 7.0));
        }
        let text = std::fs::read_to_string(&path).expect("text");
        let sources: Vec<&str> =
            text.split("<Piece Source=\"").skip(1).filter_map(|rest| rest.split('"').next()).collect();
        assert_eq!(sources, ["path_0001.0.vtu", "path_0001.2.vtu"]);
        let wrong = whole.save_pieces(&path, &[0]).expect_err("one entry too few");
        assert!(matches!(wrong, OutputError::Length { items: 2, found: 1, .. }), "{wrong}");
    }
}

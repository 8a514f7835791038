//! VTK's XML files of unstructured grids (VTK file formats, "XML formats", vtkUnstructuredGrid).
//!
//! Arrays may be stored as text, as base64, or appended, raw or as base64; in either byte order,
//! with 32- or 64-bit headers, compressed with zlib, LZ4 or LZMA, or uncompressed.

mod data;
mod xml;

use slipstick_mesh::wedge_jacobian;

use crate::builder::Builder;
use crate::error::DAMAGED;
use crate::{CellKind, FileMesh, MeshFileError};
use xml::Section;

/// A named array of values on points or cells.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// Name.
    pub name: String,
    /// Values per point or cell.
    pub components: usize,
    /// Whether the file stores them as integers.
    pub integer: bool,
    /// The values, grouped by point or cell; they may be infinite or not a number, as in the file.
    pub values: Vec<f64>,
}

/// A grid: points, cells by their nodes, and fields.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Grid {
    /// Coordinates.
    pub points: Vec<[f64; 3]>,
    /// Nodes of all cells, one cell after the other.
    pub connectivity: Vec<u32>,
    /// Where each cell's nodes end in `connectivity`.
    pub offsets: Vec<usize>,
    /// VTK's number of each cell's type.
    pub types: Vec<u8>,
    /// Fields on the points.
    pub point_data: Vec<Array>,
    /// Fields on the cells.
    pub cell_data: Vec<Array>,
}

/// Reads a file.
///
/// # Errors
/// [`MeshFileError`] if the file is inconsistent, incomplete, or in a format that is not supported.
pub fn read(bytes: &[u8]) -> Result<Grid, MeshFileError> {
    let document = xml::document(bytes)?;
    let mut decoder = data::Decoder::new(&document);
    let mut grid = Grid::default();
    for source in &document.arrays {
        let array = decoder.array(source)?;
        let bad = |message: &str| MeshFileError::new(format!("array `{}`", source.name), message, DAMAGED);
        let fits = |items: usize| items.checked_mul(array.components) == Some(array.values.len());
        let whole = |value: &f64| value.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(value);
        match (source.section, source.name.as_str()) {
            (Section::Points, _) => {
                if array.components != 3 || !fits(document.points) {
                    return Err(bad("the points do not have three coordinates each"));
                }
                grid.points = array.values.as_chunks().0.to_vec();
            }
            (Section::Cells, "connectivity" | "offsets" | "types") if !array.values.iter().all(whole) => {
                return Err(bad("the values are not node numbers"));
            }
            (Section::Cells, "connectivity") => grid.connectivity = array.values.iter().map(|&v| v as u32).collect(),
            (Section::Cells, "offsets") => grid.offsets = array.values.iter().map(|&v| v as usize).collect(),
            (Section::Cells, "types") => grid.types = array.values.iter().map(|&v| v as u8).collect(),
            (Section::Cells, _) => {}
            (Section::PointData, _) if fits(document.points) => grid.point_data.push(array),
            (Section::CellData, _) if fits(document.cells) => grid.cell_data.push(array),
            (Section::PointData | Section::CellData, _) => return Err(bad("the number of values is wrong")),
        }
    }
    check(document.points, document.cells, &grid)?;
    Ok(grid)
}

/// Checks that points and cells are complete and refer to existing items.
pub(crate) fn check(points: usize, cells: usize, grid: &Grid) -> Result<(), MeshFileError> {
    let error = |message: &str| Err(MeshFileError::new("the file", message, DAMAGED));
    if grid.points.len() != points {
        return error("the number of points is wrong");
    }
    if grid.types.len() != cells || grid.offsets.len() != cells {
        return error("the number of cells is wrong");
    }
    if !grid.offsets.is_sorted() || grid.offsets.last().copied().unwrap_or(0) != grid.connectivity.len() {
        return error("offsets and connectivity are inconsistent");
    }
    if grid.connectivity.iter().any(|&node| node as usize >= grid.points.len()) {
        return error("a cell has a node that does not exist");
    }
    Ok(())
}

/// The mesh of a file. Integer fields on the cells define sets: the cells with `f` = 3 form the set
/// `f=3`.
pub(crate) fn mesh(bytes: &[u8]) -> Result<FileMesh, MeshFileError> {
    mesh_of(&read(bytes)?)
}

/// The mesh of a grid.
pub(crate) fn mesh_of(grid: &Grid) -> Result<FileMesh, MeshFileError> {
    let mut builder = Builder::default();
    for (number, &x) in grid.points.iter().enumerate() {
        if x.iter().any(|&x| crate::cursor::finite(x).is_none()) {
            let place = format!("point {number}");
            return Err(MeshFileError::new(place, "a coordinate is not finite", "coordinates must be finite"));
        }
        builder.point(number as u64, x);
    }
    let mut start = 0;
    for (number, (&end, &vtk)) in grid.offsets.iter().zip(&grid.types).enumerate() {
        let place = || format!("cell {number}");
        let kind = kind(vtk).ok_or_else(|| {
            let cure = "use lines, triangles, quadrilaterals and solids of first or second order";
            MeshFileError::new(place(), format!("cells of VTK's type {vtk} are not supported"), cure)
        })?;
        let nodes = &grid.connectivity[start..end];
        if nodes.len() != kind.node_count() {
            let message = format!("a {} has {} nodes", kind.name(), nodes.len());
            return Err(MeshFileError::new(place(), message, DAMAGED));
        }
        builder.cell(kind, number as u64);
        let turned = kind.first_order() == CellKind::Wedge6 && is_turned(nodes, &grid.points);
        let order = |i: usize| if turned { TURNED_WEDGE[i] } else { order(vtk, i) };
        builder.nodes.extend((0..nodes.len()).map(|i| u64::from(nodes[order(i)])));
        start = end;
    }
    let (mut mesh, _) = builder.finish()?;
    for field in grid.cell_data.iter().filter(|field| field.integer && field.components == 1) {
        for (cell, value) in (0..).zip(&field.values) {
            mesh.cell_sets.entry(format!("{}={value}", field.name)).or_default().push(cell);
        }
    }
    for cells in mesh.cell_sets.values_mut() {
        cells.sort_unstable();
        cells.dedup();
    }
    Ok(mesh)
}

/// Pixels and voxels are numbered row by row, the others around the perimeter.
fn order(vtk: u8, node: usize) -> usize {
    match (vtk, node) {
        (8 | 11, 2) => 3,
        (8 | 11, 3) => 2,
        (11, 6) => 7,
        (11, 7) => 6,
        _ => node,
    }
}

/// Nodes of a wedge with 6, 15 or 18 nodes in the opposite numbering: the second and third corner
/// of both triangles are exchanged, and the nodes on edges and faces accordingly.
const TURNED_WEDGE: [usize; 18] = [0, 2, 1, 3, 5, 4, 8, 7, 6, 11, 10, 9, 12, 14, 13, 17, 16, 15];

/// Whether a wedge is numbered as in VTK before version 9.7, with the first triangle
/// counter-clockwise seen from outside. Files of both kinds have the same format version, so only
/// the coordinates distinguish them.
fn is_turned(nodes: &[u32], points: &[[f64; 3]]) -> bool {
    let corners = std::array::from_fn(|corner| points[nodes[corner] as usize]);
    wedge_jacobian(&corners, [1.0 / 3.0, 1.0 / 3.0, 0.0]) < 0.0
}

fn kind(vtk: u8) -> Option<CellKind> {
    use CellKind::*;
    Some(match vtk {
        1 => Point,
        3 => Line2,
        5 => Triangle3,
        8 | 9 => Quad4,
        10 => Tet4,
        11 | 12 => Hex8,
        13 => Wedge6,
        14 => Pyramid5,
        21 => Line3,
        22 => Triangle6,
        23 => Quad8,
        24 => Tet10,
        25 => Hex20,
        26 => Wedge15,
        27 => Pyramid13,
        28 => Quad9,
        29 => Hex27,
        32 => Wedge18,
        _ => return None,
    })
}

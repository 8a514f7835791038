//! Meshes of users: from files to arrays, and volumes.

use std::collections::BTreeMap;
use std::path::PathBuf;

use numpy::ndarray::ArrayView1;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use slipstick::mesh::{Element, Mesh};
use slipstick::meshio::{CellKind, FileMesh};

use crate::arrays;
use crate::errors::{Error, detached};

/// The element with these nodes; `None` unless there are 4, 6, 8, 10, 18 or 27.
fn element(nodes: &[u32]) -> Option<Element> {
    match *nodes {
        [a, b, c, d] => Some(Element::Tet4([a, b, c, d])),
        [a, b, c, d, e, f] => Some(Element::Wedge6([a, b, c, d, e, f])),
        [a, b, c, d, e, f, g, h] => Some(Element::Hex8([a, b, c, d, e, f, g, h])),
        _ => <[u32; 10]>::try_from(nodes)
            .map(Element::Tet10)
            .or_else(|_| <[u32; 18]>::try_from(nodes).map(Element::Wedge18))
            .or_else(|_| <[u32; 27]>::try_from(nodes).map(Element::Hex27))
            .ok(),
    }
}

/// Coordinates of all nodes.
fn points(nodes: &PyReadonlyArray2<'_, f64>) -> Vec<[f64; 3]> {
    nodes.as_array().rows().into_iter().map(|row| [row[0], row[1], row[2]]).collect()
}

/// The nodes of each element. The package has checked their numbers; −1 stands for no node.
fn rows(elements: &PyReadonlyArray2<'_, i64>) -> Vec<Vec<u32>> {
    let of = |row: ArrayView1<'_, i64>| row.iter().filter_map(|&node| u32::try_from(node).ok()).collect();
    elements.as_array().rows().into_iter().map(of).collect()
}

/// Volumes of elements of one type. The package has checked the numbers of their nodes.
#[pyfunction]
pub fn volumes<'py>(
    py: Python<'py>,
    nodes: PyReadonlyArray2<'py, f64>,
    elements: PyReadonlyArray2<'py, i64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let found = rows(&elements).iter().map(|row| element(row)).collect::<Option<Vec<Element>>>();
    let elements = found.ok_or_else(|| Error::Internal("elements of an unknown type".into()).raise(py))?;
    Ok(Mesh { nodes: points(&nodes), elements, ..Mesh::default() }.element_volumes().into_pyarray(py))
}

/// Points, and the nodes of hexahedra and of wedges.
type Cells<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<i64>>, Bound<'py, PyArray2<i64>>);

/// All points, hexahedra of 27 nodes and wedges of 18 in the order of VTK, from hexahedra of 20 or 27 nodes
/// and wedges of 15 or 18, of which those at centres may be in any order. Elements without these have −1 in their
/// place, and get points that follow the others.
#[pyfunction]
pub fn second_order_elements<'py>(
    py: Python<'py>,
    nodes: PyReadonlyArray2<'py, f64>,
    hexahedra: PyReadonlyArray2<'py, i64>,
    wedges: PyReadonlyArray2<'py, i64>,
) -> PyResult<Cells<'py>> {
    let (mut points, [hexahedra, wedges]) = (points(&nodes), [rows(&hexahedra), rows(&wedges)]);
    let of = |rows: &[Vec<u32>], counts: [usize; 2]| rows.iter().all(|row| counts.contains(&row.len()));
    if !of(&hexahedra, [20, 27]) || !of(&wedges, [15, 18]) {
        return Err(Error::Internal("elements of unknown order".into()).raise(py));
    }
    let cells: Vec<&[u32]> = hexahedra.iter().chain(&wedges).map(Vec::as_slice).collect();
    let elements = slipstick::meshio::second_order_elements(&cells, &mut points);
    let entries = |elements: &[Element]| elements.iter().flat_map(|e| e.nodes()).map(|&n| i64::from(n)).collect();
    let (hexahedra, wedges) = elements.split_at(hexahedra.len());
    let (hexahedra, wedges) = (arrays::matrix(py, entries(hexahedra), 27), arrays::matrix(py, entries(wedges), 18));
    Ok((arrays::table(py, &points), hexahedra, wedges))
}

/// Cells of one kind: its name, their nodes, and their positions in the file.
type Block<'py> = (&'static str, Bound<'py, PyArray2<i64>>, Bound<'py, PyArray1<i64>>);

/// Points, cells, sets of cells, sets of nodes, and surfaces of a mesh file. The fourth node of a
/// triangle of a surface is −1.
type Contents<'py> = (
    Bound<'py, PyArray2<f64>>,
    Vec<Block<'py>>,
    Bound<'py, PyDict>,
    Bound<'py, PyDict>,
    Bound<'py, PyDict>,
    Vec<String>,
);

/// The contents of a mesh file.
#[pyfunction]
pub fn read_mesh(py: Python<'_>, file: PathBuf) -> PyResult<Contents<'_>> {
    let mesh = detached(py, || {
        let what = "cannot read the mesh file";
        let bytes = std::fs::read(&file).map_err(|error| Error::Os { what, path: file.clone(), error })?;
        FileMesh::parse(&bytes).map_err(|error| {
            Error::input(format!("{}: {}: {}", file.display(), error.place, error.message), error.cure)
        })
    })?;
    let mut kinds: BTreeMap<CellKind, (Vec<i64>, Vec<u32>)> = BTreeMap::new();
    for cell in 0..mesh.cells.len() {
        let (nodes, positions) = kinds.entry(mesh.cells.kind(cell)).or_default();
        nodes.extend(mesh.cells.nodes(cell).iter().map(|&node| i64::from(node)));
        positions.push(cell as u32);
    }
    let blocks = kinds.into_iter().map(|(kind, (nodes, positions))| {
        (kind.name(), arrays::matrix(py, nodes, kind.node_count()), arrays::numbers(py, positions))
    });
    let blocks = blocks.collect();
    let of_numbers = |sets: &BTreeMap<String, Vec<u32>>| -> PyResult<Bound<'_, PyDict>> {
        let dict = PyDict::new(py);
        for (name, members) in sets {
            dict.set_item(name, arrays::numbers(py, members.iter().copied()))?;
        }
        Ok(dict)
    };
    let surfaces = PyDict::new(py);
    for (name, faces) in &mesh.face_sets {
        let mut corners = Vec::with_capacity(4 * faces.len());
        for face in faces {
            let nodes = mesh.cells.nodes(face.cell as usize);
            let count = mesh.cells.kind(face.cell as usize).first_order().node_count();
            let side = element(&nodes[..count]).filter(|element| usize::from(face.side) < element.sides());
            let Some(side) = side.map(|element| element.side(face.side.into())) else { continue };
            corners.extend((0..4).map(|corner| side.get(corner).map_or(-1, |&node| i64::from(node))));
        }
        surfaces.set_item(name, arrays::matrix(py, corners, 4))?;
    }
    let points = arrays::table(py, &mesh.points);
    Ok((points, blocks, of_numbers(&mesh.cell_sets)?, of_numbers(&mesh.node_sets)?, surfaces, mesh.notices))
}

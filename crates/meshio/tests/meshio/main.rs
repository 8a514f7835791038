//! Mesh files of other programs, of `tests/data`, and what is wrong with files.

mod abaqus;
mod compressed;
mod damaged;
mod refused;
mod second_order;
mod written;

use slipstick_mesh::Mesh;
use slipstick_meshio::{FileMesh, MeshFileError, ReadBody};

/// A file of `tests/data`.
fn data(name: &str) -> Vec<u8> {
    let path = format!("{}/tests/data/{name}", env!("CARGO_MANIFEST_DIR"));
    std::fs::read(&path).unwrap_or_else(|error| panic!("{path}: {error}"))
}

fn parse(text: &str) -> FileMesh {
    FileMesh::parse(text.as_bytes()).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

fn refused(text: &str) -> MeshFileError {
    match FileMesh::parse(text.as_bytes()) {
        Err(error) => error,
        Ok(_) => panic!("no error in\n{text}"),
    }
}

/// A body that is fit for analysis.
fn sound(file: &FileMesh, name: &str, part: Option<&str>) -> ReadBody {
    let read = file.body(name, part, 1.0).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(read.mesh.check(), [], "{name}");
    read
}

/// Nodes in the order of their coordinates, rounded to far below the size of an element.
fn places(mesh: &Mesh, nodes: &[u32]) -> Vec<[i64; 3]> {
    let mut places: Vec<_> = nodes.iter().map(|&n| mesh.nodes[n as usize].map(|x| (x * 1e6).round() as i64)).collect();
    places.sort_unstable();
    places
}

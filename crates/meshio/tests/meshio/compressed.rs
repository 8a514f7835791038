//! Compressed arrays of VTU files.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use slipstick_meshio::{FileMesh, MeshFileError};

/// The corners of a tetrahedron as 12 numbers of 8 bytes, as Python's `lzma` compresses them with `FORMAT_XZ` and
/// `CHECK_CRC32`, as VTK does.
const XZ: &str = "/Td6WFoAAAFpIt42AgAhARYAAAB0L+Wj4ABfAAtdAABuFTfEGPHWOxAAAAAIGmJEAAEjYBKjndOQQpkNAQAAAAABWVo=";

/// A tetrahedron whose points are compressed in one block of `size` bytes.
fn tetrahedron(compressor: &str, size: u32, block: &[u8]) -> Result<FileMesh, MeshFileError> {
    let header: Vec<u8> = [1, size, size, block.len() as u32].iter().flat_map(|n| n.to_le_bytes()).collect();
    let text = format!(
        "<VTKFile type=\"UnstructuredGrid\" header_type=\"UInt32\" compressor=\"{compressor}\"><UnstructuredGrid>\
         <Piece NumberOfPoints=\"4\" NumberOfCells=\"1\"><Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" \
         format=\"binary\">{}{}</DataArray></Points><Cells>\
         <DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">0 1 2 3</DataArray>\
         <DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">4</DataArray>\
         <DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">10</DataArray></Cells></Piece></UnstructuredGrid>\
         </VTKFile>",
        STANDARD.encode(header),
        STANDARD.encode(block)
    );
    FileMesh::parse(text.as_bytes())
}

const CORNERS: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// A block of LZ4 by its specification: a token, the rest of the length, and literals alone.
fn lz4() -> Vec<u8> {
    let values: Vec<u8> = CORNERS.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    [&[0xf0, 96 - 15], &values[..]].concat()
}

#[test]
fn lz4_and_lzma_are_read() {
    let xz = STANDARD.decode(XZ).expect("base64");
    for (compressor, block) in [("vtkLZ4DataCompressor", lz4()), ("vtkLZMADataCompressor", xz)] {
        let mesh = tetrahedron(compressor, 96, &block).unwrap_or_else(|error| panic!("{compressor}: {error}"));
        assert_eq!(mesh.points, CORNERS, "{compressor}");
        let short = tetrahedron(compressor, 88, &block).expect_err("more values than announced");
        assert!(short.place.contains("Points") && short.message.contains("compressed"), "{short}");
    }
}

/// Only the array that needs the compressor is refused; the values may not be more than the points.
#[test]
fn other_compressors_and_too_many_values_are_refused() {
    let error = tetrahedron("vtkZstdDataCompressor", 96, &lz4()).expect_err("unknown");
    assert!(error.message.contains("vtkZstdDataCompressor") && error.message.contains("zlib, LZ4"), "{error}");
    let error = tetrahedron("vtkLZ4DataCompressor", 104, &lz4()).expect_err("13 numbers for 4 points");
    assert!(error.message.contains("more than the numbers of points and cells allow"), "{error}");
}

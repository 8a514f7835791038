//! Meshes from the files of other programs.
//!
//! | format | written by | read |
//! |---|---|---|
//! | `.msh` 2.2 and 4.1, ASCII and binary | Gmsh | nodes, elements, physical groups |
//! | `.inp` | Abaqus, CalculiX, Gmsh | `*NODE`, `*ELEMENT`, `*NSET`, `*ELSET`, `*SURFACE`, parts and instances |
//! | `.vtu` | ParaView, VTK, meshio, slipstick | ASCII, inline base64, appended raw or base64; zlib, LZ4, LZMA or no compression |
//! | `.vtk` | older programs, meshio, VTK | unstructured grids of versions 1 to 5, ASCII and binary |
//!
//! [`FileMesh::parse`] recognizes the format by the first character and keeps the contents of the
//! file, with its own numbers for messages. [`FileMesh::body`] extracts one body as a
//! [`slipstick_mesh::Mesh`]: the elements of one set, their nodes, and the sets of faces and nodes
//! on them as surfaces and node sets. [`FileMesh::first_order_body`] also drops the mid-side nodes
//! of second-order elements.
//!
//! The crate reads bytes, not files. Its memory use is proportional to the number of bytes,
//! whatever they contain.
//!
//! ```
//! let text = "*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,0,0,1\n6,1,0,1\n7,1,1,1\n8,0,1,1\n\
//!             *ELEMENT, TYPE=C3D8, ELSET=cube\n1, 1,2,3,4,5,6,7,8\n\
//!             *SURFACE, NAME=top\ncube, S2\n";
//! let file = slipstick_meshio::FileMesh::parse(text.as_bytes()).unwrap();
//! let read = file.body("die", Some("cube"), 0.001).unwrap();
//! assert_eq!(read.mesh.surfaces["die_top"].facets[0].nodes, [4, 5, 6, 7].into());
//! ```

pub mod abaqus;
mod body;
mod builder;
mod cell;
mod centres;
mod completed;
mod cursor;
mod error;
mod file_mesh;
mod gmsh;
mod legacy;
mod thickened;
mod unusable;
pub mod vtu;

pub use body::ReadBody;
pub use cell::CellKind;
pub use centres::second_order_elements;
pub use completed::Centre;
pub use error::MeshFileError;
pub use file_mesh::{Cells, ElementFace, FileMesh};

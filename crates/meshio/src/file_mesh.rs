//! The contents of a mesh file, in the file's own terms.

use std::collections::{BTreeMap, BTreeSet};

use crate::{CellKind, MeshFileError, abaqus, gmsh, legacy, vtu};

/// All cells of a file, of any kind.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Cells {
    pub(crate) kinds: Vec<CellKind>,
    /// Cell i has the nodes `nodes[offsets[i]..offsets[i + 1]]`; one more entry than cells.
    pub(crate) offsets: Vec<usize>,
    pub(crate) nodes: Vec<u32>,
    pub(crate) numbers: Vec<u64>,
}

impl Cells {
    /// Number of cells.
    pub fn len(&self) -> usize {
        self.kinds.len()
    }

    /// Whether there are no cells.
    pub fn is_empty(&self) -> bool {
        self.kinds.is_empty()
    }

    /// Shape and order of one cell.
    pub fn kind(&self, cell: usize) -> CellKind {
        self.kinds[cell]
    }

    /// Nodes of one cell, as positions in [`FileMesh::points`], in the file's order.
    pub fn nodes(&self, cell: usize) -> &[u32] {
        &self.nodes[self.offsets[cell]..self.offsets[cell + 1]]
    }

    /// The number of the cell in the file; for a VTU file, its position.
    pub fn number(&self, cell: usize) -> u64 {
        self.numbers[cell]
    }
}

/// One face of a solid cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct ElementFace {
    /// Position of the cell in [`FileMesh::cells`].
    pub cell: u32,
    /// Face number from 0: Abaqus' S1 … S6, which are the sides of [`slipstick_mesh::HEX_FACES`],
    /// S1 … S4 of [`slipstick_mesh::TET_FACES`], or S1 … S5 of a wedge, its
    /// [`slipstick_mesh::WEDGE_TRIANGLES`] first.
    pub side: u8,
}

/// A mesh as stored in a file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FileMesh {
    /// Coordinates of all nodes, in the file's unit of length.
    pub points: Vec<[f64; 3]>,
    /// The numbers of the nodes in the file; for a VTU file, their positions.
    pub point_numbers: Vec<u64>,
    /// All cells.
    pub cells: Cells,
    /// Named sets of cells (Gmsh: physical groups), each ascending and unique; the cells may be of
    /// any dimension.
    pub cell_sets: BTreeMap<String, Vec<u32>>,
    /// Named sets of nodes, each ascending and unique.
    pub node_sets: BTreeMap<String, Vec<u32>>,
    /// Named sets of faces of solid cells, each ascending and unique.
    pub face_sets: BTreeMap<String, Vec<ElementFace>>,
    /// Sets of solid cells to which an Abaqus deck assigns a material (`*SOLID SECTION`), in the
    /// order of the file.
    pub sections: Vec<String>,
    /// Sets of cells by whose faces an Abaqus deck defines surfaces.
    pub sets_of_faces: BTreeSet<String>,
    /// Data that were reinterpreted while reading, for the user's information.
    pub notices: Vec<String>,
}

/// The first characters of files with geometry that Gmsh meshes, and their formats.
const GEOMETRIES: [(&[u8], &str); 3] =
    [(b"ISO-10303-21", "STEP"), (b"DBRep_DrawableShape", "BREP"), (b"CASCADE Topology", "BREP")];

impl FileMesh {
    /// Reads a file's bytes; the first character determines the format: `$` Gmsh, `*` Abaqus, `<`
    /// VTU.
    ///
    /// # Errors
    /// [`MeshFileError`] at the first place that cannot be read.
    pub fn parse(bytes: &[u8]) -> Result<Self, MeshFileError> {
        let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        if let Some(format) = GEOMETRIES.iter().find(|(start, _)| text.trim_ascii_start().starts_with(start)) {
            let cure = "`slipstick new part.step` meshes a STEP file with Gmsh for Python; for other geometry, `gmsh \
                        part.brep -3 -clmax SIZE -o part.msh`, with physical groups as the names of bodies and surfaces";
            return Err(MeshFileError::new("the file", format!("this is geometry ({}), not a mesh", format.1), cure));
        }
        match text.iter().find(|byte| !byte.is_ascii_whitespace()) {
            Some(b'$') => gmsh::parse(text),
            Some(b'*') => abaqus::parse(text),
            Some(b'<') => vtu::mesh(text),
            Some(b'#') if legacy::recognises(text) => vtu::mesh_of(&legacy::read(text)?),
            _ => Err(MeshFileError::new(
                "line 1",
                "unknown mesh format",
                "supported mesh files are Gmsh's .msh (2.2 or 4.1), Abaqus' .inp, and VTK's .vtu and .vtk",
            )),
        }
    }

    /// The solid cells of a set, or of the whole file, ascending.
    pub fn solid_cells(&self, part: Option<&str>) -> Vec<u32> {
        let solid = |&cell: &u32| self.cells.kind(cell as usize).dimension() == 3;
        match part {
            None => (0..self.cells.len() as u32).filter(solid).collect(),
            Some(part) => self.cell_sets.get(part).into_iter().flatten().copied().filter(solid).collect(),
        }
    }

    /// The solid cells of a deck with sections that are in none of `parts`.
    pub fn left_out<'a>(&self, parts: impl IntoIterator<Item = Option<&'a str>>) -> Vec<u32> {
        if self.sections.is_empty() {
            return Vec::new();
        }
        let taken: BTreeSet<u32> = parts.into_iter().flat_map(|part| self.solid_cells(part)).collect();
        self.solid_cells(None).into_iter().filter(|cell| !taken.contains(cell)).collect()
    }

    /// The name of a set of the file on a body: `{body}_{set}`, or the set's own name if it begins so.
    pub fn name_on_body(body: &str, set: &str) -> String {
        match set.strip_prefix(body) {
            Some(rest) if rest.starts_with('_') => set.to_owned(),
            _ => format!("{body}_{set}"),
        }
    }

    /// Names of the sets that contain solid cells, which [`FileMesh::body`] accepts as parts.
    pub fn parts(&self) -> impl Iterator<Item = &str> {
        let solid = |cells: &Vec<u32>| cells.iter().any(|&cell| self.cells.kind(cell as usize).dimension() == 3);
        self.cell_sets.iter().filter(move |(_, cells)| solid(cells)).map(|(name, _)| name.as_str())
    }
}

//! Gmsh's MSH format, versions 2 and 4.1, ASCII and binary (Gmsh reference manual, "File formats").
//!
//! A file is a list of sections `$Name … $EndName`. Binary sections contain the same sequence of
//! numbers as ASCII sections, so one reader handles both; in version 2, counts and names are always
//! text.

mod v2;
mod v4;

use std::collections::BTreeMap;

use crate::builder::Builder;
use crate::cursor::{Cursor, Encoding, shortened};
use crate::error::DAMAGED;
use crate::{CellKind, FileMesh, MeshFileError};

/// The two supported layouts.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Version {
    V2,
    V4,
}

/// A physical group: dimension and tag.
type GroupKey = (u8, i64);

#[derive(Default)]
struct Parts {
    names: BTreeMap<GroupKey, String>,
    /// Physical tags of each entity, by dimension and tag (version 4).
    entities: BTreeMap<GroupKey, Vec<i64>>,
    groups: BTreeMap<GroupKey, Vec<u32>>,
    builder: Builder,
    has_nodes: bool,
    has_elements: bool,
}

/// Reads a file.
pub(crate) fn parse(bytes: &[u8]) -> Result<FileMesh, MeshFileError> {
    let mut cursor = Cursor::new(bytes);
    let mut version = None;
    let mut parts = Parts::default();
    while !cursor.at_end() {
        let heading = cursor.line()?;
        let Some(name) = heading.strip_prefix('$') else {
            let message = format!("`{}` was found where a section such as $Nodes is expected", shortened(heading));
            return Err(cursor.error(message, DAMAGED));
        };
        let end = format!("$End{name}");
        match (name, version) {
            ("MeshFormat", None) => version = Some(format(&mut cursor)?),
            ("PhysicalNames", Some(_)) => physical_names(&mut cursor, &mut parts)?,
            ("Entities", Some(Version::V4)) => v4::entities(&mut cursor, &mut parts)?,
            ("Nodes", Some(version)) if !parts.has_nodes => {
                parts.has_nodes = true;
                match version {
                    Version::V2 => v2::nodes(&mut cursor, &mut parts)?,
                    Version::V4 => v4::nodes(&mut cursor, &mut parts)?,
                }
            }
            ("Elements", Some(version)) if parts.has_nodes && !parts.has_elements => {
                parts.has_elements = true;
                match version {
                    Version::V2 => v2::elements(&mut cursor, &mut parts)?,
                    Version::V4 => v4::elements(&mut cursor, &mut parts)?,
                }
            }
            ("PartitionedEntities", _) => {
                return Err(cursor.error("the mesh is partitioned", "write it unpartitioned, in one piece"));
            }
            ("MeshFormat" | "PhysicalNames" | "Entities" | "Nodes" | "Elements", _) => {
                return Err(cursor.error(format!("the section ${name} is not expected here"), DAMAGED));
            }
            ("NOD", _) => return Err(version_error(&cursor, "1.0")),
            _ => {
                cursor.skip_past(&end)?;
                continue;
            }
        }
        let found = cursor.word()?;
        if found != end {
            return Err(cursor.error(format!("`{}` was found where {end} is expected", shortened(found)), DAMAGED));
        }
    }
    if !(parts.has_nodes && parts.has_elements) {
        return Err(cursor.error("the file has no nodes or no elements", DAMAGED));
    }
    finish(parts)
}

/// Gmsh's places of the nodes on the edges of a tetrahedron, in the order of the other formats.
const TET10_EDGES: [usize; 6] = [0, 1, 2, 3, 5, 4];

/// The same of a hexahedron. Gmsh: edges 0–1, 0–3, 0–4, 1–2, 1–5, 2–3, 2–6, 3–7, 4–5, 4–7, 5–6, 6–7.
const HEX_EDGES: [usize; 12] = [0, 3, 5, 1, 8, 10, 11, 9, 2, 4, 6, 7];

/// The same of a wedge. Gmsh: edges 0–1, 0–2, 0–3, 1–2, 1–4, 2–5, 3–4, 3–5, 4–5.
const WEDGE_EDGES: [usize; 9] = [0, 3, 1, 6, 8, 7, 2, 4, 5];

fn finish(parts: Parts) -> Result<FileMesh, MeshFileError> {
    let (mut mesh, _) = parts.builder.finish()?;
    for cell in 0..mesh.cells.kinds.len() {
        let first = mesh.cells.offsets[cell];
        let kind = mesh.cells.kinds[cell];
        let edges: &[usize] = match kind {
            CellKind::Tet10 => &TET10_EDGES,
            CellKind::Wedge15 | CellKind::Wedge18 => &WEDGE_EDGES,
            CellKind::Hex20 | CellKind::Hex27 => &HEX_EDGES,
            _ => continue,
        };
        let nodes = &mut mesh.cells.nodes[first + kind.first_order().node_count()..][..edges.len()];
        let before = nodes.to_vec();
        nodes.iter_mut().zip(edges).for_each(|(node, &place)| *node = before[place]);
    }
    for (key, cells) in parts.groups {
        let name = parts.names.get(&key).cloned().unwrap_or_else(|| key.1.to_string());
        mesh.cell_sets.entry(name).or_default().extend(cells);
    }
    for cells in mesh.cell_sets.values_mut() {
        cells.sort_unstable();
        cells.dedup();
    }
    Ok(mesh)
}

fn version_error(cursor: &Cursor<'_>, version: &str) -> MeshFileError {
    let message = format!("MSH format version {} is not supported; 2.2 and 4.1 are", shortened(version));
    cursor.error(message, "write the file again with Mesh.MshFileVersion = 4.1, or `gmsh -format msh41`")
}

/// `$MeshFormat`: version, ASCII or binary, and byte order.
fn format(cursor: &mut Cursor<'_>) -> Result<Version, MeshFileError> {
    let version = cursor.word()?;
    let version = match version {
        "2" | "2.0" | "2.1" | "2.2" => Version::V2,
        "4.1" => Version::V4,
        _ => return Err(version_error(cursor, version)),
    };
    let (binary, size): (u8, u8) = (cursor.parsed("0 or 1")?, cursor.parsed("the size of a number")?);
    if binary > 1 || size != 8 {
        let message = format!("unknown file type {binary} with numbers of {size} bytes");
        return Err(cursor.error(message, "write the file on a 64-bit machine"));
    }
    cursor.line()?;
    if binary == 1 {
        cursor.encoding = Encoding::LittleEndian;
        match cursor.int()? {
            1 => {}
            0x0100_0000 => cursor.encoding = Encoding::BigEndian,
            _ => return Err(cursor.error("unknown byte order", DAMAGED)),
        }
    }
    Ok(version)
}

/// `$PhysicalNames`: dimension, tag and name in quotes.
fn physical_names(cursor: &mut Cursor<'_>, parts: &mut Parts) -> Result<(), MeshFileError> {
    let count: u64 = cursor.parsed("the number of names")?;
    for _ in 0..count {
        let key = (cursor.parsed("a dimension")?, cursor.parsed("a tag")?);
        let line = cursor.line()?;
        let name = line.strip_prefix('"').and_then(|line| line.strip_suffix('"')).filter(|name| !name.is_empty());
        let name = name.ok_or_else(|| cursor.error("the name must be in quotes", DAMAGED))?;
        parts.names.insert(key, name.to_owned());
    }
    Ok(())
}

/// Gmsh's numbers of element types.
fn kind(cursor: &Cursor<'_>, number: i32) -> Result<CellKind, MeshFileError> {
    use CellKind::*;
    const KINDS: [CellKind; 19] = [
        Line2, Triangle3, Quad4, Tet4, Hex8, Wedge6, Pyramid5, Line3, Triangle6, Quad9, Tet10, Hex27, Wedge18,
        Pyramid14, Point, Quad8, Hex20, Wedge15, Pyramid13,
    ];
    let found = usize::try_from(number).ok().and_then(|number| KINDS.get(number.checked_sub(1)?));
    found.copied().ok_or_else(|| {
        let message = format!("elements of Gmsh's type {number} are not supported");
        cursor.error(message, "write linear elements: Mesh.ElementOrder = 1")
    })
}

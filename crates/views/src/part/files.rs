//! The files for Gmsh: the surfaces of a part, and the script that meshes their interior.

use std::path::Path;

use serde_json::json;
use slipstick_results::output::{OutputError, write_atomically};

use super::PartBody;

/// Name of the script.
pub const SCRIPT: &str = "mesh.py";

/// Writes the surface of a body in Gmsh's format, version 2.2. Each patch is an elementary surface
/// with the patch's number.
///
/// # Errors
/// [`OutputError::Io`].
pub fn write_surface(path: &Path, body: &PartBody) -> Result<(), OutputError> {
    let surface = &body.surface;
    write_atomically(path, |writer| {
        writeln!(writer, "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{}", surface.points.len())?;
        for (n, [x, y, z]) in (1..).zip(&surface.points) {
            writeln!(writer, "{n} {x:?} {y:?} {z:?}")?;
        }
        writeln!(writer, "$EndNodes\n$Elements\n{}", surface.triangles.len())?;
        for (t, (triangle, patch)) in (1..).zip(surface.triangles.iter().zip(&surface.patch)) {
            let ([a, b, c], patch) = (triangle.map(|n| n + 1), patch + 1);
            // triangle, two tags: no physical group, the elementary surface
            writeln!(writer, "{t} 2 2 0 {patch} {a} {b} {c}")?;
        }
        writeln!(writer, "$EndElements")
    })
}

/// Writes the points of the curved faces of a body between those of its surface: pairs of the middle
/// of an edge or a triangle, and its place on the smooth surface. \[L\]
///
/// # Errors
/// [`OutputError::Io`].
pub fn write_moves(path: &Path, body: &PartBody) -> Result<(), OutputError> {
    let lines: Vec<String> = body.moves.iter().map(|[from, to]| json!([from, to]).to_string()).collect();
    let text = format!("[{}]\n", lines.join(",\n"));
    write_atomically(path, |writer| writer.write_all(text.as_bytes()))
}

/// Writes the script that meshes all bodies.
///
/// # Errors
/// [`OutputError::Io`].
pub fn write_script(path: &Path, bodies: &[PartBody]) -> Result<(), OutputError> {
    let of_body = |body: &PartBody| {
        let faces = body.faces.iter().filter(|face| !face.patches.is_empty());
        let groups: serde_json::Map<String, serde_json::Value> =
            faces.filter_map(|face| Some((face.group.clone()?, json!(face.patches)))).collect();
        json!({
            "name": body.name, "surface": body.surface_file(), "mesh": body.mesh_file(), "size": body.size,
            "longest": body.edges[1],
            "curved": body.curved_file(), "pieces": body.pieces, "cut": body.cut, "groups": groups,
        })
    };
    let list: Vec<serde_json::Value> = bodies.iter().map(of_body).collect();
    let text = serde_json::to_string_pretty(&list).unwrap_or_default();
    // each list of numbers on one line
    let text = include_str!("mesh.py").replace("BODIES = []", &format!("BODIES = {}", one_line(&text)));
    write_atomically(path, |writer| writer.write_all(text.as_bytes()))
}

/// JSON with each innermost list of numbers on one line.
fn one_line(text: &str) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some(start) = rest.find('[') {
        let (before, from) = rest.split_at(start);
        out += before;
        let end = from.find(|c: char| !(c.is_ascii_digit() || c.is_whitespace() || ",[".contains(c)));
        match end.filter(|&end| from[end..].starts_with(']') && !from[1..end].contains('[')) {
            Some(end) => {
                out += &from[..end].split_whitespace().collect::<Vec<_>>().join(" ").replace("[ ", "[");
                rest = &from[end..];
            }
            None => {
                out.push('[');
                rest = &from[1..];
            }
        }
    }
    out + rest
}

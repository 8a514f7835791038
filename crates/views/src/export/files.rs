//! Writes triangle surfaces to files.

use std::collections::HashSet;
use std::io;
use std::path::Path;

use super::{ExportError, TriangleSurface};
use slipstick_results::output::{OutputError, Values, Vtu, write_atomically};

/// Writes binary STL: 80 bytes of header, the number of triangles, and per triangle its normal and
/// corners in 32 bits, outward. All bodies are in one solid; the format has no units.
///
/// # Errors
/// [`ExportError::TooFar`] if 32 bits merge points, so that the file would not be closed;
/// [`ExportError::Output`].
pub fn write_stl(path: &Path, surface: &TriangleSurface) -> Result<(), ExportError> {
    let points: Vec<[f32; 3]> = surface.points.iter().map(|p| p.map(|c| c as f32 + 0.0)).collect();
    let different: HashSet<[u32; 3]> = points.iter().map(|p| p.map(f32::to_bits)).collect();
    let count = u32::try_from(surface.triangles.len()).map_err(|_| too_many(path))?;
    if different.len() < points.len() {
        return Err(ExportError::TooFar);
    }
    let mut header = [b' '; 80];
    let text = b"slipstick design surface, binary STL";
    header[..text.len()].copy_from_slice(text);
    Ok(write_atomically(path, |writer| {
        writer.write_all(&header)?;
        writer.write_all(&count.to_le_bytes())?;
        for (t, triangle) in surface.triangles.iter().enumerate() {
            let mut record = [0u8; 50];
            let area = surface.area_vector(t);
            let length = area.iter().map(|c| c * c).sum::<f64>().sqrt();
            let normal = area.map(|c| if length > 0.0 { (c / length) as f32 } else { 0.0 });
            let corners = triangle.iter().flat_map(|&n| points[n as usize]);
            for (bytes, value) in record.chunks_exact_mut(4).zip(normal.into_iter().chain(corners)) {
                bytes.copy_from_slice(&value.to_le_bytes());
            }
            writer.write_all(&record)?;
        }
        Ok(())
    })?)
}

fn too_many(path: &Path) -> OutputError {
    let source = io::Error::other("STL counts triangles in 32 bits");
    OutputError::Io { action: "write", path: path.to_owned(), source }
}

/// Writes Wavefront OBJ: shared points in full precision, one object per body; `names` are the
/// names of all bodies of the mesh.
///
/// # Errors
/// [`ExportError::Output`].
pub fn write_obj(path: &Path, surface: &TriangleSurface, names: &[&str]) -> Result<(), ExportError> {
    Ok(write_atomically(path, |writer| {
        writeln!(writer, "# slipstick design surface")?;
        for [x, y, z] in &surface.points {
            writeln!(writer, "v {x:?} {y:?} {z:?}")?;
        }
        let mut current = None;
        for (triangle, body) in surface.triangles.iter().zip(&surface.bodies) {
            if current != Some(*body) {
                writeln!(writer, "o {}", names.get(*body as usize).unwrap_or(&"body"))?;
                current = Some(*body);
            }
            let [a, b, c] = triangle.map(|n| n + 1);
            writeln!(writer, "f {a} {b} {c}")?;
        }
        Ok(())
    })?)
}

/// Writes VTU: triangles with the fields `body` (number) and `outer` (1 on outer faces of the
/// body).
///
/// # Errors
/// [`ExportError::Output`].
pub fn write_vtu(path: &Path, surface: &TriangleSurface) -> Result<(), ExportError> {
    let bodies: Vec<i64> = surface.bodies.iter().map(|&b| i64::from(b)).collect();
    let outer: Vec<u8> = surface.outer.iter().map(|&o| u8::from(o)).collect();
    let mut file = Vtu::of_triangles(&surface.points, &surface.triangles)?;
    file.cell_field("body", 1, Values::I64(&bodies))?;
    file.cell_field("outer", 1, Values::U8(&outer))?;
    Ok(file.save(path)?)
}

//! Nodes and elements of version 2.

use super::{Parts, kind};
use crate::MeshFileError;
use crate::cursor::{Cursor, Encoding};
use crate::error::DAMAGED;

/// A number on a separate line, which is text even in binary files.
fn count(cursor: &mut Cursor<'_>, what: &str) -> Result<u64, MeshFileError> {
    let count = cursor.parsed(what)?;
    cursor.line()?;
    Ok(count)
}

/// `$Nodes`: number, x, y, z.
pub(super) fn nodes(cursor: &mut Cursor<'_>, parts: &mut Parts) -> Result<(), MeshFileError> {
    let count = count(cursor, "the number of nodes")?;
    parts.builder.points.reserve(cursor.capacity(count, 8));
    for _ in 0..count {
        let number = cursor.count()?;
        let x = cursor.point()?;
        parts.builder.point(number, x);
    }
    Ok(())
}

/// `$Elements`: number, type, number of tags, tags, nodes; in binary files, type and number of tags
/// precede a run of elements. An element in several physical groups appears once for each.
pub(super) fn elements(cursor: &mut Cursor<'_>, parts: &mut Parts) -> Result<(), MeshFileError> {
    let count = count(cursor, "the number of elements")?;
    let mut read = 0;
    while read < count {
        if cursor.encoding == Encoding::Ascii {
            let number = cursor.count()?;
            let (kind_number, tags) = (cursor.int()?, cursor.count()?);
            element(cursor, parts, number, kind_number, tags)?;
            read += 1;
        } else {
            let (kind_number, run, tags) = (cursor.int()?, cursor.count()?, cursor.count()?);
            if run == 0 || run > count - read {
                return Err(cursor.error(format!("a run of {run} elements exceeds the total of {count}"), DAMAGED));
            }
            for _ in 0..run {
                let number = cursor.count()?;
                element(cursor, parts, number, kind_number, tags)?;
            }
            read += run;
        }
    }
    Ok(())
}

fn element(
    cursor: &mut Cursor<'_>,
    parts: &mut Parts,
    number: u64,
    kind_number: i32,
    tags: u64,
) -> Result<(), MeshFileError> {
    let kind = kind(cursor, kind_number)?;
    let mut physical = 0;
    for tag in 0..tags {
        let value = cursor.int()?;
        if tag == 0 {
            physical = value;
        }
    }
    let cell = parts.builder.cell(kind, number);
    for _ in 0..kind.node_count() {
        let node = cursor.count()?;
        parts.builder.nodes.push(node);
    }
    if physical != 0 {
        parts.groups.entry((kind.dimension(), i64::from(physical.unsigned_abs()))).or_default().push(cell);
    }
    Ok(())
}

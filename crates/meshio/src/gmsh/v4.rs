//! Entities, nodes and elements of version 4.1.

use super::{GroupKey, Parts, kind};
use crate::MeshFileError;
use crate::cursor::Cursor;
use crate::error::DAMAGED;

/// `$Entities`: only the physical groups of each entity are used.
pub(super) fn entities(cursor: &mut Cursor<'_>, parts: &mut Parts) -> Result<(), MeshFileError> {
    let counts = [cursor.size()?, cursor.size()?, cursor.size()?, cursor.size()?];
    for (dimension, count) in (0_u8..).zip(counts) {
        for _ in 0..count {
            let tag = i64::from(cursor.int()?);
            // A point has its position here, the others have their bounding boxes.
            for _ in 0..if dimension == 0 { 3 } else { 6 } {
                cursor.double()?;
            }
            let mut groups = Vec::new();
            for _ in 0..cursor.size()? {
                groups.push(i64::from(cursor.int()?.unsigned_abs()));
            }
            if dimension > 0 {
                for _ in 0..cursor.size()? {
                    cursor.int()?;
                }
            }
            parts.entities.insert((dimension, tag), groups);
        }
    }
    Ok(())
}

/// Dimension and tag of the entity of a block.
fn entity(cursor: &mut Cursor<'_>) -> Result<GroupKey, MeshFileError> {
    let (dimension, tag) = (cursor.int()?, cursor.int()?);
    match u8::try_from(dimension) {
        Ok(dimension) if dimension <= 3 => Ok((dimension, i64::from(tag))),
        _ => Err(cursor.error(format!("an entity has dimension {dimension}"), DAMAGED)),
    }
}

/// `$Nodes`: blocks of numbers followed by coordinates.
pub(super) fn nodes(cursor: &mut Cursor<'_>, parts: &mut Parts) -> Result<(), MeshFileError> {
    let (blocks, count, _, _) = (cursor.size()?, cursor.size()?, cursor.size()?, cursor.size()?);
    parts.builder.points.reserve(cursor.capacity(count, 8));
    for _ in 0..blocks {
        let (dimension, _) = entity(cursor)?;
        let parameters = if cursor.int()? == 0 { 0 } else { dimension };
        let inside = cursor.size()?;
        let mut numbers = Vec::with_capacity(cursor.capacity(inside, 2));
        for _ in 0..inside {
            numbers.push(cursor.size()?);
        }
        for number in numbers {
            let x = cursor.point()?;
            parts.builder.point(number, x);
            for _ in 0..parameters {
                cursor.double()?;
            }
        }
    }
    agrees(cursor, "nodes", parts.builder.points.len(), count)
}

/// `$Elements`: blocks of elements of one type on one entity.
pub(super) fn elements(cursor: &mut Cursor<'_>, parts: &mut Parts) -> Result<(), MeshFileError> {
    let (blocks, count, _, _) = (cursor.size()?, cursor.size()?, cursor.size()?, cursor.size()?);
    for _ in 0..blocks {
        let entity = entity(cursor)?;
        let number = cursor.int()?;
        let kind = kind(cursor, number)?;
        let inside = cursor.size()?;
        let first = parts.builder.kinds.len();
        for _ in 0..inside {
            let number = cursor.size()?;
            parts.builder.cell(kind, number);
            for _ in 0..kind.node_count() {
                let node = cursor.size()?;
                parts.builder.nodes.push(node);
            }
        }
        let cells = first as u32..parts.builder.kinds.len() as u32;
        for &tag in parts.entities.get(&entity).into_iter().flatten() {
            parts.groups.entry((entity.0, tag)).or_default().extend(cells.clone());
        }
    }
    agrees(cursor, "elements", parts.builder.kinds.len(), count)
}

fn agrees(cursor: &Cursor<'_>, what: &str, found: usize, expected: u64) -> Result<(), MeshFileError> {
    if found as u64 == expected {
        return Ok(());
    }
    Err(cursor.error(format!("there are {found} {what}, but the file announces {expected}"), DAMAGED))
}

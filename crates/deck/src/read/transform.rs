//! Local axes of nodes.

use slipstick_meshio::abaqus::Card;

use super::{DAMAGED, Reader};
use crate::vector::{cross, dot, sub, unit};

/// `*TRANSFORM`: the axes in which conditions and forces at nodes of a set are given.
#[derive(Debug)]
pub struct Transform {
    pub set: String,
    /// Whether the axes are radial, tangential and axial, about the line through both points. Otherwise, the first
    /// point lies on the local x axis, and the second one in the plane of x and y, for axes at the origin.
    pub cylindrical: bool,
    pub points: [[f64; 3]; 2],
    pub line: usize,
}

impl Reader<'_> {
    pub(super) fn transform(&mut self, card: &Card<'_>) {
        self.allow(card, &["NSET", "TYPE"]);
        let (keyword, line) = (&card.keyword, card.keyword.line);
        let kind = keyword.parameter("TYPE").unwrap_or("R").to_ascii_uppercase();
        if !["R", "C"].contains(&kind.as_str()) {
            let why = format!("TYPE={kind} is not supported");
            return self.ledger.refuse("TRANSFORM", line, why, "use rectangular (R) or cylindrical (C) axes");
        }
        let Some(set) = keyword.parameter("NSET").map(str::to_owned) else {
            return self.ledger.wrong("TRANSFORM", [line; 2], "it needs NSET=…", "add the parameter");
        };
        let values = self.numbers(card).concat();
        let &[a, b, c, d, e, f] = &values[..] else {
            let why = "it needs the coordinates of two points: six numbers";
            return self.ledger.wrong("TRANSFORM", [line, line + 1], why, DAMAGED);
        };
        let how = "motions and forces of these nodes along these axes; a prescribed part of the components is an \
                   `[[equation]]`";
        self.ledger.translated("TRANSFORM", line, how);
        let (cylindrical, points) = (kind == "C", [[a, b, c], [d, e, f]]);
        self.deck.transforms.push(Transform { set, cylindrical, points, line });
    }
}

/// Places closer to the axis than this fraction of their distance from the points lie on it.
const ON_AXIS: f64 = 1e-9;

impl Transform {
    /// The local axes at a place, and whether it lies on the axis of cylindrical ones, where the first two are arbitrary;
    /// `None` if the points do not determine them.
    pub fn axes(&self, x: [f64; 3]) -> Option<([[f64; 3]; 3], bool)> {
        let [a, b] = self.points;
        if self.cylindrical {
            let axis = unit(sub(b, a))?;
            let arm = sub(x, a);
            let along = dot(arm, axis);
            let across = [0, 1, 2].map(|c| arm[c] - along * axis[c]);
            let is_off =
                dot(across, across).sqrt() > ON_AXIS * (dot(arm, arm).sqrt() + dot(sub(b, a), sub(b, a)).sqrt());
            let least = if axis[0].abs() < 0.6 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
            let radial = unit(if is_off { across } else { cross(axis, least) })?;
            return Some(([radial, cross(axis, radial), axis], !is_off));
        }
        let first = unit(a)?;
        let third = unit(cross(first, b))?;
        Some(([first, cross(third, first), third], false))
    }
}

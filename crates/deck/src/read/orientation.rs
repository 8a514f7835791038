//! Axes of materials.

use slipstick_meshio::abaqus::Card;

use super::{DAMAGED, Reader};
use crate::vector::{cross, sub, unit};

/// `*ORIENTATION`: axes 1 and 2 of the materials of sections.
#[derive(Debug)]
pub struct Orientation {
    /// Perpendicular unit vectors; `None` if they are refused.
    pub axes: Option<[[f64; 3]; 2]>,
    /// A point on the axis of cylindrical axes, and its direction; `axes` are then radial, tangential and axial.
    pub about: Option<[[f64; 3]; 2]>,
    pub line: usize,
}

impl Reader<'_> {
    pub(super) fn orientation(&mut self, card: &Card<'_>) {
        self.allow(card, &["NAME", "SYSTEM", "DEFINITION"]);
        let line = card.keyword.line;
        let Some(name) = card.keyword.parameter("NAME").map(str::to_ascii_uppercase) else {
            return self.ledger.wrong("ORIENTATION", [line; 2], "it needs NAME=…", "add the parameter");
        };
        if self.deck.orientations.contains_key(&name) {
            let why = format!("the orientation `{name}` is defined twice");
            return self.ledger.wrong("ORIENTATION", [line; 2], why, "give each orientation a name of its own");
        }
        self.ledger.ignored("ORIENTATION", line, "no section of an orthotropic material names it");
        let about = self.cylinder_axis(card);
        let axes = self.material_axes(card, about.is_some());
        self.deck.orientations.insert(name, Orientation { axes, about, line });
    }

    /// A point on the axis and the direction of cylindrical axes, from two points on it.
    fn cylinder_axis(&mut self, card: &Card<'_>) -> Option<[[f64; 3]; 2]> {
        let (keyword, line) = (&card.keyword, card.keyword.line);
        if !keyword.parameter("SYSTEM").is_some_and(|system| system.eq_ignore_ascii_case("CYLINDRICAL")) {
            return None;
        }
        let rows = self.numbers(card);
        let axis = match *rows.first().map_or(&[][..], Vec::as_slice) {
            // parts with their instances have an origin, too
            [a, b, c, d, e, f] | [a, b, c, d, e, f, _, _, _] => {
                unit(sub([d, e, f], [a, b, c])).map(|direction| [[a, b, c], direction])
            }
            _ => None,
        };
        if axis.is_none() {
            let why = "cylindrical axes need the coordinates of two different points on their axis: six numbers";
            self.ledger.wrong("ORIENTATION", [line, line + 1], why, DAMAGED);
        }
        axis
    }

    /// Rectangular axes: a point on the local x axis, one in the plane of x and y, and perhaps the origin; then perhaps
    /// a local axis and an angle in degrees, by which the axes turn about it.
    fn material_axes(&mut self, card: &Card<'_>, cylindrical: bool) -> Option<[[f64; 3]; 2]> {
        let (keyword, line) = (&card.keyword, card.keyword.line);
        let value = |name: &str, default: &str| keyword.parameter(name).unwrap_or(default).to_ascii_uppercase();
        let (system, definition) = (value("SYSTEM", "RECTANGULAR"), value("DEFINITION", "COORDINATES"));
        if !["RECTANGULAR", "CYLINDRICAL"].contains(&system.as_str()) {
            let why = format!("SYSTEM={system} is not supported");
            self.ledger.refuse("ORIENTATION", line, why, "use SYSTEM=RECTANGULAR or CYLINDRICAL");
            return None;
        }
        if definition != "COORDINATES" {
            let why = format!("DEFINITION={definition} is not supported");
            self.ledger.refuse("ORIENTATION", line, why, "give the coordinates of two points");
            return None;
        }
        let rows = self.numbers(card);
        if system == "CYLINDRICAL" && !cylindrical {
            return None;
        }
        let (a, b) = match *rows.first().map_or(&[][..], Vec::as_slice) {
            _ if cylindrical => ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
            [a, b, c, d, e, f] => ([a, b, c], [d, e, f]),
            [a, b, c, d, e, f, x, y, z] => (sub([a, b, c], [x, y, z]), sub([d, e, f], [x, y, z])),
            _ => {
                let why =
                    "it needs the coordinates of two points, and perhaps those of the origin: six or nine numbers";
                self.ledger.wrong("ORIENTATION", [line, line + 1], why, DAMAGED);
                return None;
            }
        };
        let Some([first, third]) = unit(a).and_then(|first| Some([first, unit(cross(first, b))?])) else {
            let why = "both points lie on one line through the origin";
            self.ledger.wrong("ORIENTATION", [line, line + 1], why, "name points in different directions");
            return None;
        };
        let mut axes = [first, cross(third, first), third];
        if let Some(turn) = rows.get(1) {
            let (axis, angle) = (turn[0], turn.get(1).copied().unwrap_or(0.0).to_radians());
            if ![1.0, 2.0, 3.0].contains(&axis) {
                let why = "the axis of the additional rotation must be 1, 2 or 3";
                self.ledger.wrong("ORIENTATION", [line, line + 2], why, DAMAGED);
                return None;
            }
            let (i, j) = (axis as usize % 3, (axis as usize + 1) % 3);
            let (u, v, [sin, cos]) = (axes[i], axes[j], [angle.sin(), angle.cos()]);
            axes[i] = [0, 1, 2].map(|c| cos * u[c] + sin * v[c]);
            axes[j] = [0, 1, 2].map(|c| cos * v[c] - sin * u[c]);
        }
        Some([axes[0], axes[1]])
    }
}

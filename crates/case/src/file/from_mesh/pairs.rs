//! Contact pairs by name: `a_touches_b` and `b_touches_a`.

use super::survey::{Face, Pair, Part, facing};

/// A side of smaller facets by more than this factor is the slave, as with `sides = "chosen"`.
const FINER: f64 = 1.5;

/// Minimum difference of two convexities that matters.
const CURVED: f64 = 0.1;

/// A side of smaller area by more than this factor is the slave.
const SMALLER: f64 = 1.02;

/// What a script measured between two surfaces on the true geometry.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// The names of the two surfaces.
    pub surfaces: [String; 2],
    /// Smallest and largest gap; negative where they overlap.
    pub gap: [f64; 2],
}

/// The pairs of surfaces whose names say that they touch, the one with the largest facing area first.
pub fn named(parts: &[Part], measured: &[Measured]) -> Vec<Pair> {
    let face = |body: usize, other: usize| -> Option<usize> {
        let name = format!("{}_touches_{}", parts[body].name, parts[other].name);
        parts[body].faces.iter().position(|face| face.name == name)
    };
    let mut pairs = Vec::new();
    for a in 0..parts.len() {
        for b in a + 1..parts.len() {
            let (Some(i), Some(j)) = (face(a, b), face(b, a)) else { continue };
            let (first, second) = (&parts[a].faces[i], &parts[b].faces[j]);
            let (second_is_slave, reason) = choose(first, second);
            let (slave, master) = if second_is_slave { ([b, j], [a, i]) } else { ([a, i], [b, j]) };
            let of = |[body, face]: [usize; 2]| &parts[body].faces[face];
            let (worth, gap) = facing(of(slave), of(master)).unwrap_or((0.0, 0.0));
            let is = |found: &&Measured| found.surfaces.contains(&first.name) && found.surfaces.contains(&second.name);
            let gap = measured.iter().find(is).map_or([gap; 2], |found| found.gap);
            pairs.push(Pair { slave, master, gap, reason: Some(reason), worth });
        }
    }
    pairs.sort_by(|a, b| b.worth.total_cmp(&a.worth));
    pairs
}

/// Whether the second surface is the better slave, and why: the finer one, otherwise the convex one, otherwise the
/// smaller one.
fn choose(first: &Face, second: &Face) -> (bool, &'static str) {
    let finer = first.facet_size() / second.facet_size();
    if !(1.0 / FINER..=FINER).contains(&finer) {
        return (finer > 1.0, "the finer side");
    }
    let convex = second.convexity() - first.convexity();
    if convex.abs() > CURVED {
        return (convex > 0.0, "the convex side");
    }
    let smaller = first.area() / second.area();
    if !(1.0 / SMALLER..=SMALLER).contains(&smaller) {
        return (smaller > 1.0, "the smaller side");
    }
    (true, "the side of the smaller body")
}

//! Parts as solids in a STEP file, for CAD.
//!
//! ```text
//! triangles, shapes ──facets──▶ regions ──settle, refine, seams──▶ ──brep──▶ faces, edges, vertices ──text──▶ STEP (AP214)
//! ```
//!
//! Triangles on one plane, cylinder, cone, sphere or torus of the outer faces become one face on exactly this surface. Of
//! the others, two beside each other become a bilinear face, or one a plane face. An edge is the exact intersection of the surfaces beside it, so
//! a facet beside a cylinder ends at an ellipse: lines, circles and ellipses as such, other intersections as cubic splines
//! close to the tolerance. Faces that close around an axis or a tube are divided in two, so that none contains the seam or a pole of
//! its surface. Where a facet is so inclined that its arc would come close to its other edges, the edge is divided.
//!
//! Crates that write STEP exist (`cadmpeg-codec-step` 0.6, `truck-stepio`): they write a solid whose surfaces and curves one
//! has; finding these is most of the work here, and the entities of a file are the 300 lines of `text`.
//!
//! Tests: `boundaries_are_closed_and_edges_on_both_surfaces`, `tori_are_exact`, `a_window_is_no_outer_loop`, and with Open CASCADE
//! `a_ring_is_exact`, `a_fillet_is_exact`, `facets_end_at_exact_surfaces`.

mod brep;
mod curve;
mod facets;
mod pairs;
mod seams;
mod simplify;
mod surface;
#[cfg(test)]
mod tests;
mod text;

use slipstick_mesh::Shape;

pub(crate) use simplify::simplified;

use brep::brep;
use facets::Facets;
use seams::seams;
use surface::Surface;
use text::{Named, Unit};

/// The triangulated boundary of a solid: a connected surface, and those of its cavities.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Source {
    /// Coordinates. \[L\]
    pub points: Vec<[f64; 3]>,
    /// Counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Whether each triangle lies on an outer face, of which neighbours in one plane become one face.
    pub outer: Vec<bool>,
    /// The curved surface on which each triangle lies.
    pub shapes: Vec<Option<Shape>>,
    /// The name of each triangle's face, empty for none; faces end where the name changes.
    pub names: Vec<String>,
}

/// How many faces of which kind a file has.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Faces {
    /// Plane faces of two or more triangles, or on an outer face.
    pub planes: usize,
    /// Faces on cylinders, cones, spheres and tori.
    pub curved: usize,
    /// Plane faces of one triangle, and bilinear faces of two.
    pub facets: usize,
    /// Curved surfaces of which triangles are written as facets, because points do not reach them.
    pub left: usize,
}

/// The text of a STEP file with bodies of one or more solids, and its faces; `unit` is the unit of length: micron,
/// millimeter, centimeter, meter, inch or foot.
pub fn step(bodies: &[(String, Vec<Source>)], unit: &str) -> (String, Faces) {
    let unit = match unit {
        "micron" => Unit::Metre(".MICRO."),
        "centimeter" => Unit::Metre(".CENTI."),
        "meter" => Unit::Metre("$"),
        "inch" => Unit::Other("INCH", 0.0254),
        "foot" => Unit::Other("FOOT", 0.3048),
        _ => Unit::Metre(".MILLI."),
    };
    let mut count = Faces::default();
    let solids: Vec<(String, Vec<Named>)> = bodies
        .iter()
        .map(|(name, sources)| (name.clone(), sources.iter().map(|source| solid(source, &mut count)).collect()))
        .collect();
    (text::text(&solids, unit), count)
}

/// How far points may move onto curved surfaces, relative to the shortest edge beside them.
/// Below one half, so that the ends of an edge do not meet.
const REACH: f64 = 0.4;

/// Coordinates are written to this fraction of the tolerance.
const WRITTEN: f64 = 0.2;

/// How often triangles around points that do not reach their curved surfaces become facets, before all triangles of these
/// surfaces do.
const PARTS: usize = 5;

fn solid(source: &Source, count: &mut Faces) -> Named {
    let mut shapes: Vec<Option<Surface>> =
        source.shapes.iter().map(|shape| shape.as_ref().and_then(Surface::of)).collect();
    let all = shapes.clone();
    let (mut left, mut loose): (Vec<Surface>, _) = (Vec::new(), vec![false; shapes.len()]);
    let mut round = 0;
    let mut facets = loop {
        let mut facets = Facets::new(source, &shapes, &loose);
        let mut unreached = facets.settle(REACH);
        if unreached.is_empty() {
            facets.refine();
            unreached = facets.settle(REACH);
        }
        if unreached.is_empty() {
            break facets;
        }
        for surface in unreached.iter().filter_map(|&t| facets.curved(t)) {
            if !left.contains(&surface) {
                left.push(surface);
            }
        }
        round += 1;
        if round > PARTS {
            for t in (0..all.len()).filter(|&t| all[t].is_some_and(|of| left.contains(&of))) {
                (shapes[t], loose[t]) = (None, false);
            }
        } else {
            unreached.iter().for_each(|&t| (shapes[facets.origin[t]], loose[facets.origin[t]]) = (None, true));
        }
    };
    count.left += left.len();
    let frames = seams(&mut facets);
    let brep = brep(&facets, &frames);
    for face in &brep.faces {
        match (face.region, face.surface) {
            (None, _) => count.facets += 1,
            (_, Surface::Plane { .. }) => count.planes += 1,
            _ => count.curved += 1,
        }
    }
    let names = facets.regions.into_iter().map(|region| region.name).collect();
    Named { brep, names, frames, quantum: WRITTEN * facets.tolerance }
}

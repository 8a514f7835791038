//! The gaps between the surfaces at the nodes of slave facets, along the facets' normals.
//!
//! Where a pressure follows from the gap at each integration point, initial gaps are closed at the nodes of each facet,
//! or of its quadratic face, and interpolated like positions: as if the nodes had been moved along the facet's normal.

use super::clip::Point;
use super::coupling::pressed::Factors;
use super::facet_pair::reversed;
use super::height::CurvedFacet;
use super::inverse_map::{POINTS, map_back};
use super::plane::{Plane, position};
use super::pressed_pair::functions;
use nalgebra::Vector3;
use slipstick_mesh::NodeGaps;

/// Points that lie outside of a facet by less than this fraction of its size lie on it.
const ON_FACET: f64 = 1e-6;

/// Masters face the slave where the product of the normals is below minus this.
const FACING: f64 = 0.1;

/// For each node of a slave facet, or of its face, the distance to the nearest of the masters that face it, along the
/// facet's normal and within `reach` of the node; negative: penetration. `None` where there is none. `x`: current
/// positions of the points of the surfaces, three per node. \[L\]
///
/// Test: `closed_gaps_of_nodes_are_interpolated_like_positions` (tests/pressed.rs).
pub(crate) fn node_gaps<'a>(
    slave: CurvedFacet<'_>,
    masters: impl Iterator<Item = CurvedFacet<'a>> + Clone,
    x: &[f64],
    reach: f64,
) -> NodeGaps {
    match slave.nodes[..] {
        [a, b, c] => of_facet(&[a, b, c].map(|node| position(x, node)), slave, masters, x, reach),
        [a, b, c, d] => of_facet(&[a, b, c, d].map(|node| position(x, node)), slave, masters, x, reach),
        _ => [None; 9],
    }
}

fn of_facet<'a, const S: usize>(
    corners: &[Vector3<f64>; S],
    slave: CurvedFacet<'_>,
    masters: impl Iterator<Item = CurvedFacet<'a>> + Clone,
    x: &[f64],
    reach: f64,
) -> NodeGaps {
    let mut out = [None; 9];
    let Some(plane) = Plane::of(corners) else { return out };
    let nodes = slave.face_nodes();
    for (s, gap) in out.iter_mut().enumerate().take(nodes.len()) {
        let place = match slave.face {
            Some(face) => {
                let weights = face.place_of_node(s);
                nodes.iter().zip(weights).map(|(&node, weight)| position(x, node) * weight).sum()
            }
            None => position(x, nodes[s]),
        };
        let (at, height) = (plane.project(&place), plane.height(&place));
        let above = |master: CurvedFacet<'a>| match master.nodes[..] {
            [a, b, c] => height_above(&plane, corners, &[a, b, c].map(|node| position(x, node)), master, x, at),
            [a, b, c, d] => height_above(&plane, corners, &[a, b, c, d].map(|node| position(x, node)), master, x, at),
            _ => None,
        };
        let gaps = masters.clone().filter_map(above).map(|other| other - height).filter(|gap| gap.abs() <= reach);
        *gap = gaps.min_by(|a, b| a.abs().total_cmp(&b.abs()));
    }
    out
}

/// Height of a master's surface above the plane at a point; `None` if it is not there, or looks away.
fn height_above<const S: usize, const M: usize>(
    plane: &Plane<S>,
    corners: &[Vector3<f64>; S],
    points: &[Vector3<f64>; M],
    master: CurvedFacet<'_>,
    x: &[f64],
    at: Point,
) -> Option<f64> {
    if plane.cosine(points) > -FACING {
        return None;
    }
    let order = reversed::<M>();
    let turned = order.map(|i| plane.project(&points[i]));
    let (turned_shape, turned_slope) = map_back(&turned, &at.map(|c| [c; POINTS])).ok()?.at(0);
    let (mut shape, mut slope) = ([0.0; 4], [[0.0; 2]; 4]);
    for (position, &own) in order.iter().enumerate() {
        (shape[own], slope[own]) = (turned_shape[position], turned_slope[position]);
    }
    if shape.iter().any(|&n| n < -ON_FACET) {
        return None;
    }
    let values = functions(master.face, &shape, &slope).0;
    let along = |(&node, value): (&u32, f64)| value * plane.height(&position(x, node));
    let mut height: f64 = master.face_nodes().iter().zip(values).map(along).sum();
    if let (Some(curved), None) = (master.height, master.face) {
        let factors = Factors::new(corners, points, [None, Some(curved)])?.value;
        let functions = curved.at(M, &shape, &slope);
        height -= (0..3).map(|k| factors[k + 1] * functions[k].0).sum::<f64>();
    }
    Some(height)
}

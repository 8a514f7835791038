//! Mid-side nodes of second-order elements on the smooth surface for which the facets of their corners
//! stand.

use super::facets::normal;
use super::{FacetHeights, Shape, SmoothSurface, control_points};
use crate::second_order::{hex27_jacobians, least, tet10_jacobians, wedge18_jacobians};
use crate::{Element, FaceNodes, FacetNodes, HEX_FACE_CENTRES, Mesh};
use nalgebra::Vector3;
use std::collections::{BTreeMap, BTreeSet};

/// Faces that meet at less than this angle bend smoothly from one to the other (10°).
const TANGENT: f64 = 0.985;

/// Ways below this fraction of an edge are errors of fitted shapes.
const LEAST_WAY: f64 = 1e-6;

/// An element keeps at least this part of its smallest Jacobian determinant.
const KEPT: f64 = 0.3;

/// The smallest part of its way that a node moves before it stays where it is.
const LEAST_PART: f64 = 0.05;

/// The middle between the corners of an edge or face, and the way from there to the surface. \[L\]
struct Move {
    from: Vector3<f64>,
    way: Vector3<f64>,
}

/// An outer face, and the surface above it.
struct Face {
    nodes: FaceNodes,
    corners: FacetNodes,
    normal: Vector3<f64>,
    /// None where the facet is the surface itself.
    heights: Option<FacetHeights>,
    shape: Option<Shape>,
}

impl Face {
    /// How far `x` is from the surface along the normal of the facet, for a point above `from`, where
    /// the facet's corners have these weights. \[L\]
    fn above(&self, x: &Vector3<f64>, from: &Vector3<f64>, weights: [f64; 4], reach: f64) -> Option<f64> {
        match (self.shape, self.heights) {
            (Some(shape), _) => shape.along(x, &self.normal, reach),
            (None, Some(heights)) => {
                let at = control_points(self.corners.len()).iter().position(|point| *point == weights)?;
                Some(heights[at] - self.normal.dot(&(x - from)))
            }
            (None, None) => Some(-self.normal.dot(&(x - from))),
        }
    }
}

impl Mesh {
    /// Moves the mid-side nodes of a body's outer faces from the middles between their corners onto the
    /// smooth surface for which the facets of these corners stand, computed by `smooth`, and the centres
    /// of hexahedra and of faces inside accordingly. Where two faces meet at an angle, the nodes of their
    /// common edge lie on the surfaces of both.
    ///
    /// A node moves only by a half, a quarter, … of its way, or not at all, where an element would
    /// otherwise keep less than 0.3 of its smallest Jacobian determinant at nodes and integration points. Returns
    /// these nodes and those beside which the surface is not found, ascending.
    ///
    /// Tests: `middles_lie_on_the_cylinder`, `middles_follow_a_surface_without_a_shape`,
    /// `flat_elements_do_not_fold`.
    pub fn curve_middles(&mut self, body: usize, smooth: impl FnOnce(&[FacetNodes]) -> SmoothSurface) -> Vec<u32> {
        let (moves, mut off) = self.moves_of_middles(body, smooth);
        let elements = self.bodies[body].elements.clone().map(|number| number as u32);
        let moved = |element: &Element| element.nodes().iter().any(|node| moves.contains_key(node));
        let elements: Vec<u32> = elements.filter(|&number| moved(&self.elements[number as usize])).collect();
        let smallest = |mesh: &Self, number: u32| match mesh.elements[number as usize] {
            Element::Tet10(nodes) => least(&tet10_jacobians(&mesh.coordinates(&nodes))),
            Element::Wedge18(nodes) => least(&wedge18_jacobians(&mesh.coordinates(&nodes))),
            Element::Hex27(nodes) => least(&hex27_jacobians(&mesh.coordinates(&nodes))),
            _ => f64::INFINITY,
        };
        let place = |mesh: &mut Self, parts: &BTreeMap<u32, f64>| {
            for (node, Move { from, way }) in &moves {
                mesh.nodes[*node as usize] = (from + way * parts[node]).into();
            }
            elements.iter().for_each(|&number| mesh.centre_inside(number, &moves));
        };
        let mut parts: BTreeMap<u32, f64> = moves.keys().map(|&node| (node, 0.0)).collect();
        place(self, &parts);
        let before: Vec<f64> = elements.iter().map(|&number| smallest(self, number)).collect();
        parts.values_mut().for_each(|part| *part = 1.0);
        loop {
            place(self, &parts);
            let folds =
                elements.iter().zip(&before).filter(|(number, before)| smallest(self, **number) < KEPT * **before);
            let folded: BTreeSet<u32> =
                folds.flat_map(|(number, _)| self.elements[*number as usize].nodes().to_vec()).collect();
            let too_far: Vec<_> =
                parts.iter_mut().filter(|(node, part)| folded.contains(node) && **part > 0.0).collect();
            if too_far.is_empty() {
                break;
            }
            too_far.into_iter().for_each(|(_, part)| *part = if *part > LEAST_PART { 0.5 * *part } else { 0.0 });
        }
        off.extend(parts.into_iter().filter(|(_, part)| *part < 1.0).map(|(node, _)| node));
        off.sort_unstable();
        off
    }

    /// Where the mid-side nodes of a body's curved outer faces move, and those for which no surface is found.
    fn moves_of_middles(
        &self,
        body: usize,
        smooth: impl FnOnce(&[FacetNodes]) -> SmoothSurface,
    ) -> (BTreeMap<u32, Move>, Vec<u32>) {
        let whole: Vec<FaceNodes> =
            self.faces_of_surface(&self.boundary(body)).into_iter().filter(|face| face.len() > 4).collect();
        let corners: Vec<FacetNodes> =
            whole.iter().filter_map(|face| FacetNodes::new(&face[..face.len().div_ceil(2).min(4)])).collect();
        let surface = smooth(&corners);
        let mut shapes = vec![None; corners.len()];
        for patch in &surface.patches {
            patch.facets.iter().for_each(|&facet| shapes[facet as usize] = patch.shape);
        }
        let heights = surface.heights.into_iter().chain(std::iter::repeat(None));
        let faces: Vec<Face> = whole
            .into_iter()
            .zip(corners)
            .zip(heights.zip(shapes))
            .map(|((nodes, corners), (heights, shape))| Face {
                nodes,
                corners,
                normal: normal(&corners, &self.nodes),
                heights,
                shape,
            })
            .collect();
        // the faces around each node that is not a corner, with the weights of their corners there
        let mut around: BTreeMap<u32, Vec<(&Face, [f64; 4])>> = BTreeMap::new();
        for face in &faces {
            let count = face.corners.len();
            for i in 0..count {
                let ends = [i, (i + 1) % count];
                let weights = std::array::from_fn(|corner| if ends.contains(&corner) { 0.5 } else { 0.0 });
                around.entry(face.nodes[count + i]).or_default().push((face, weights));
            }
            if let Some(&centre) = face.nodes.get(8) {
                around.entry(centre).or_default().push((face, [0.25; 4]));
            }
        }
        let curved = around.into_iter().filter(|(_, faces)| faces.iter().any(|(face, _)| face.heights.is_some()));
        let (mut moves, mut off) = (BTreeMap::new(), Vec::new());
        for (node, faces) in curved {
            match self.way_onto(&faces) {
                Some(of) if of.way.norm() > 0.0 => drop(moves.insert(node, of)),
                Some(_) => {}
                None => off.push(node),
            }
        }
        (moves, off)
    }

    /// The way of a point between corners onto the surfaces of the one or two faces on which it lies, which may be
    /// zero; `None` if there is no point of them near it.
    fn way_onto(&self, faces: &[(&Face, [f64; 4])]) -> Option<Move> {
        let at = |node: u32| Vector3::from(self.nodes[node as usize]);
        let &(first, weights) = faces.first()?;
        let from: Vector3<f64> = first.corners.iter().zip(weights).map(|(&node, w)| at(node) * w).sum();
        let reach = first.corners.iter().map(|&node| (at(node) - from).norm()).fold(0.0, f64::max);
        let above = |(face, weights): &(&Face, [f64; 4]), x: &Vector3<f64>| face.above(x, &from, *weights, reach);
        let mut x = from;
        for _ in 0..30 {
            let step = match faces {
                [one] => one.0.normal * above(one, &x)?,
                [one, other] => {
                    let (n, m) = (one.0.normal, other.0.normal);
                    let (p, q, c) = (above(one, &x)?, above(other, &x)?, n.dot(&m));
                    if c < TANGENT {
                        // the step in the plane of both normals with the projections p and q on them
                        (n * (p - c * q) + m * (q - c * p)) / (1.0 - c * c)
                    } else if one.0.heights.is_none() || other.0.heights.is_none() {
                        // a flat face that a curved one continues keeps its straight edge
                        Vector3::zeros()
                    } else {
                        (n + m) * ((p + q) / (2.0 + 2.0 * c))
                    }
                }
                _ => return None,
            };
            x += step;
            if step.norm() <= 1e-14 * reach {
                break;
            }
        }
        let way = x - from;
        let way = if way.norm() > LEAST_WAY * reach { way } else { Vector3::zeros() };
        (way.norm() < 0.5 * reach).then_some(Move { from, way })
    }

    /// Puts the centres of a hexahedron or wedge, and of its faces inside the body, where its edges and faces
    /// take them, if it has nodes that moved: onto the Coons patch of the edges, and the transfinite
    /// interpolation of the faces (Gordon and Hall, Numer. Math. 21 (1973), 109–129).
    fn centre_inside(&mut self, number: u32, moved: &BTreeMap<u32, Move>) {
        let element = self.elements[number as usize];
        let nodes = element.nodes();
        for (centre, weights) in element.serendipity_faces() {
            let inside = !moved.contains_key(&nodes[centre]);
            if inside && weights.iter().any(|(local, weight)| *weight > 0.0 && moved.contains_key(&nodes[*local])) {
                let sum = |c: usize| weights.iter().map(|&(i, weight)| weight * self.nodes[nodes[i] as usize][c]).sum();
                self.nodes[nodes[centre] as usize] = std::array::from_fn(sum);
            }
        }
        let Element::Hex27(nodes) = element else { return };
        let sum =
            |mesh: &Self, of: &[usize], c: usize| -> f64 { of.iter().map(|&i| mesh.nodes[nodes[i] as usize][c]).sum() };
        let (corners, edges): (Vec<usize>, Vec<usize>) = ((0..8).collect(), (8..20).collect());
        self.nodes[nodes[26] as usize] = std::array::from_fn(|c| {
            0.5 * sum(self, &HEX_FACE_CENTRES, c) - 0.25 * sum(self, &edges, c) + 0.125 * sum(self, &corners, c)
        });
    }
}

//! The overlap of two surfaces where contact transmits no force.
//!
//! The contact conditions hold for the mean gap over the facets around a slave node, weighted by its
//! multiplier. Where facets are coarse against the curvature, or a corner points into a facet, a
//! node may lie far below the other surface while this mean is still open. The measure here does
//! not use mortar rows: it is the distance of a node to the nearest point of the other surface's
//! facets, if it lies below them, plus the height of the true surface above that point, and above the
//! node: the points of edge midpoints of quadratic elements lie outside curved surfaces.

use crate::ContactInterface;
use crate::kinematics::height::FacetHeight;
use nalgebra::Vector3;
use rayon::prelude::*;
use slipstick_mesh::{FacetNodes, FacetTree};
use std::collections::{BTreeMap, BTreeSet};

type Point = Vector3<f64>;

/// Fraction of the smaller facet's size above which an overlap counts if the whole pair is open.
pub const COUNTED_OVERLAP: f64 = 0.02;

/// The same beside nodes that transmit a force: at the rim of every contact, the mean gap is open where the bodies
/// overlap a little.
pub const COUNTED_BESIDE_CONTACT: f64 = 0.05;

/// A node that lies below the other surface of its pair while contact there is open.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Overlap {
    /// Global node number.
    pub node: u32,
    /// Whether it is a node of the slave.
    pub on_slave: bool,
    /// Distance to the other surface, > 0. \[L\]
    pub depth: f64,
    /// Size of the larger facet there: the one above the node, or the largest around it. \[L\]
    pub facet_size: f64,
}

/// One of the two surfaces at current positions.
struct Side<'a> {
    facets: &'a [FacetNodes],
    heights: &'a [Option<FacetHeight>],
    x: &'a [f64],
    tree: FacetTree,
    /// Square roots of the facets' areas. \[L\]
    sizes: Vec<f64>,
    /// The facets around each node.
    around: BTreeMap<u32, Vec<u32>>,
    /// Edges of one facet only, lower node first.
    border: BTreeSet<[u32; 2]>,
    /// Their nodes.
    border_nodes: BTreeSet<u32>,
}

/// The nearest point of a surface.
struct Nearest {
    distance: f64,
    facet: usize,
    normal: Point,
    /// Height of the true surface above the point. \[L\]
    height: f64,
    /// Whether the point lies below all facets that meet there.
    below: bool,
}

/// Distances that differ by less than this fraction are equal.
const SAME: f64 = 1e-9;

/// Cosine of the angle by which a point may lie off the normal at the border of a surface.
const ABOVE_BORDER: f64 = 1.0 - 1e-6;

/// Surfaces face each other where the product of their normals is below minus this.
const FACING: f64 = 0.2;

impl ContactInterface {
    /// The deepest overlap of the two surfaces at positions `x` (3 per node) that exceeds
    /// [`COUNTED_OVERLAP`], or [`COUNTED_BESIDE_CONTACT`], of the size of the smaller facet there; `open` says for each of [`Self::slave_nodes`] whether
    /// it transmits no force, and `allowed` by how much the meshes may overlap. Of a slave node, all
    /// nodes of the facets around it must be open; of a master node, those of the slave facet above.
    ///
    /// An overlap is at most as deep as the larger facet there is wide, and the surfaces face each
    /// other, so that the far side of a body does not count. A surface that touches itself has none:
    /// its nodes lie below the facets on the other side of its own body.
    ///
    /// Test: `overlaps_by_hand`.
    ///
    /// # Panics
    /// If `open` does not have an entry for each slave node.
    pub fn deepest_overlap(&self, x: &[f64], open: &[bool], allowed: f64) -> Option<Overlap> {
        assert_eq!(open.len(), self.slave_nodes().len(), "a status for each slave node");
        if self.is_with_itself() || open.iter().all(|open| !open) {
            return None;
        }
        let [of_slave, of_master] = self.heights();
        let sides = [Side::new(self.slave_facets(), of_slave, x), Side::new(self.master_facets(), of_master, x)];
        let closed: BTreeSet<u32> =
            self.slave_nodes().iter().zip(open).filter(|(_, open)| !**open).map(|(slave, _)| slave.node).collect();
        let counted = if closed.is_empty() { COUNTED_OVERLAP } else { COUNTED_BESIDE_CONTACT };
        let is_open = |facet: &FacetNodes| facet.iter().all(|node| !closed.contains(node));
        let of_side = |own: usize| {
            let (side, other) = (&sides[own], &sides[1 - own]);
            let largest = other.sizes.iter().copied().fold(0.0, f64::max);
            let nodes: Vec<(&u32, &Vec<u32>)> = side.around.iter().collect();
            let found = nodes.into_par_iter().filter_map(|(&node, around)| {
                if own == 0 && !around.iter().all(|&f| is_open(&side.facets[f as usize])) {
                    return None;
                }
                let size = around.iter().map(|&f| side.sizes[f as usize]).fold(0.0, f64::max);
                let p = point(x, node);
                let nearest = other.nearest(&p, size.max(largest) + allowed).filter(|nearest| nearest.below)?;
                let (facet_size, smaller) =
                    (size.max(other.sizes[nearest.facet]), size.min(other.sizes[nearest.facet]));
                let depth = nearest.distance + nearest.height + side.height_at(node) - allowed;
                let counts = depth > counted * smaller && depth < facet_size;
                let transmits = own == 1 && !is_open(&other.facets[nearest.facet]);
                let facing = |&f: &u32| normal(&side.facets[f as usize], x).dot(&nearest.normal) < -FACING;
                let overlap = Overlap { node, on_slave: own == 0, depth, facet_size };
                (counts && !transmits && around.iter().any(facing)).then_some(overlap)
            });
            found.collect::<Vec<_>>()
        };
        // the first of equal ones, whatever the number of threads
        let all = (0..2).flat_map(of_side);
        all.reduce(|best, next| if next.depth > best.depth { next } else { best })
    }
}

impl<'a> Side<'a> {
    fn new(facets: &'a [FacetNodes], heights: &'a [Option<FacetHeight>], x: &'a [f64]) -> Self {
        let mut around: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        let mut border = BTreeSet::new();
        for (f, facet) in facets.iter().enumerate() {
            for (i, &node) in facet.iter().enumerate() {
                around.entry(node).or_default().push(f as u32);
                let edge = edge(node, facet[(i + 1) % facet.len()]);
                if !border.remove(&edge) {
                    border.insert(edge);
                }
            }
        }
        let sizes = facets.iter().map(|facet| (0.5 * area_vector(facet, x).norm()).sqrt()).collect();
        let border_nodes = border.iter().flatten().copied().collect();
        Self { facets, heights, x, tree: FacetTree::build(facets, x), sizes, around, border, border_nodes }
    }

    /// The nearest point within a distance.
    fn nearest(&self, p: &Point, within: f64) -> Option<Nearest> {
        let mut hits = Vec::new();
        self.tree.query(std::array::from_fn(|c| p[c] - within), std::array::from_fn(|c| p[c] + within), &mut hits);
        let mut best: Option<Nearest> = None;
        for facet in hits.into_iter().map(|hit| hit as usize) {
            let corners: Vec<Point> = self.facets[facet].iter().map(|&node| point(self.x, node)).collect();
            let centre = corners.iter().sum::<Point>() / corners.len() as f64;
            for i in 0..corners.len() {
                let next = (i + 1) % corners.len();
                let triangle = [corners[i], corners[next], centre];
                let area = (triangle[1] - triangle[0]).cross(&(centre - triangle[0]));
                let Some(normal) = area.try_normalize(0.0) else { continue };
                let weights = closest(p, &triangle);
                let away = p - triangle.iter().zip(weights).map(|(corner, weight)| *corner * weight).sum::<Point>();
                let distance = away.norm();
                if distance > within || best.as_ref().is_some_and(|best| distance > (1.0 + SAME) * best.distance) {
                    continue;
                }
                let nodes = [self.facets[facet][i], self.facets[facet][next]];
                let above = away.dot(&normal).abs() >= ABOVE_BORDER * distance;
                let below = away.dot(&normal) < 0.0 && (above || !self.on_border(nodes, weights));
                let same = best.as_ref().filter(|best| distance >= (1.0 - SAME) * best.distance);
                let below = below && same.is_none_or(|best| best.below);
                let height = self.height(facet, i, weights);
                best = Some(Nearest { distance, facet, normal, height, below });
            }
        }
        best
    }

    /// Height of the true surface above a node: the mean over its facets. \[L\]
    fn height_at(&self, node: u32) -> f64 {
        let around = &self.around[&node];
        let height = |&f: &u32| {
            let facet = &self.facets[f as usize];
            let corner = facet.iter().position(|&of| of == node).unwrap_or(0);
            self.height(f as usize, corner, [1.0, 0.0, 0.0])
        };
        around.iter().map(height).sum::<f64>() / around.len() as f64
    }

    /// Height of the true surface above a point with these weights of the corners of edge i and the centre. \[L\]
    fn height(&self, facet: usize, i: usize, [of_a, of_b, of_centre]: [f64; 3]) -> f64 {
        let Some(Some(height)) = self.heights.get(facet) else { return 0.0 };
        let count = self.facets[facet].len();
        let mut weights = [0.0; 4];
        weights[..count].fill(of_centre / count as f64);
        weights[i] += of_a;
        weights[(i + 1) % count] += of_b;
        height.value(count, &weights)
    }

    /// Whether a point with these weights of the corners of an edge and a facet's centre lies on the
    /// border of the surface.
    fn on_border(&self, [a, b]: [u32; 2], [of_a, of_b, of_centre]: [f64; 3]) -> bool {
        let ends = |node: u32| self.border_nodes.contains(&node);
        of_centre == 0.0
            && match (of_a == 0.0, of_b == 0.0) {
                (false, true) => ends(a),
                (true, false) => ends(b),
                _ => self.border.contains(&edge(a, b)),
            }
    }
}

fn edge(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

fn point(x: &[f64], node: u32) -> Point {
    Point::from_column_slice(&x[3 * node as usize..][..3])
}

/// Twice the area of a facet times its mean normal. \[L²\]
fn area_vector(facet: &FacetNodes, x: &[f64]) -> Point {
    let first = point(x, facet[0]);
    (1..facet.len() - 1).map(|i| (point(x, facet[i]) - first).cross(&(point(x, facet[i + 1]) - first))).sum()
}

/// Unit normal of a facet; zero for a collapsed one.
fn normal(facet: &FacetNodes, x: &[f64]) -> Point {
    area_vector(facet, x).try_normalize(0.0).unwrap_or_default()
}

/// Weights of the corners of a triangle at its point nearest to `p`.
///
/// Method: C. Ericson, Real-Time Collision Detection (2005), section 5.1.5.
fn closest(p: &Point, [a, b, c]: &[Point; 3]) -> [f64; 3] {
    let (u, v) = (b - a, c - a);
    let ends = |corner: &Point| (u.dot(&(p - corner)), v.dot(&(p - corner)));
    let ((d1, d2), (d3, d4), (d5, d6)) = (ends(a), ends(b), ends(c));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let [in_a, in_b, in_c] = [d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2];
    if in_c <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = d1 / (d1 - d3);
        return [1.0 - t, t, 0.0];
    }
    if in_b <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = d2 / (d2 - d6);
        return [1.0 - t, 0.0, t];
    }
    if in_a <= 0.0 && d4 >= d3 && d5 >= d6 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return [0.0, 1.0 - t, t];
    }
    let sum = in_a + in_b + in_c;
    [in_a / sum, in_b / sum, in_c / sum]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::InterfaceOptions;
    use crate::kinematics::{CellRule, MultiplierShape};

    /// A pyramid with its tip at `tip` and its square base of side 1 at the height `base`, as slave,
    /// over four facets of side 1 at z = 0, or the other way round.
    fn pyramid(tip: [f64; 3], base: f64, slave: bool) -> (ContactInterface, Vec<f64>) {
        let mut x: Vec<f64> = (0..9).flat_map(|k| [f64::from(k % 3), f64::from(k / 3), 0.0]).collect();
        let corners = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]];
        x.extend(corners.iter().flat_map(|[a, b]| [tip[0] + a, tip[1] + b, base]));
        x.extend(tip);
        let plane: Vec<FacetNodes> = [0, 1, 3, 4].map(|k| [k, k + 1, k + 4, k + 3].into()).to_vec();
        // outward: down, unless the tip lies above the base
        let outward = |facet: FacetNodes| if tip[2] > base { facet.reversed() } else { facet };
        let sides: Vec<FacetNodes> = (0..4).map(|i| outward([9 + i, 13, 9 + (i + 1) % 4].into())).collect();
        let options =
            InterfaceOptions { shape: MultiplierShape::Standard, rule: CellRule::Six, reach: 1.0, feature_angle: 3.0 };
        let [first, second] = if slave { [sides, plane] } else { [plane, sides] };
        (ContactInterface::new(first, second, &x, options).unwrap(), x)
    }

    fn depth(tip: [f64; 3], base: f64, slave: bool, allowed: f64) -> Option<(u32, f64)> {
        let (interface, x) = pyramid(tip, base, slave);
        let open = vec![true; interface.slave_nodes().len()];
        let found = interface.deepest_overlap(&x, &open, allowed)?;
        assert_eq!(found.on_slave, slave);
        Some((found.node, found.depth))
    }

    /// By hand: the tip of a pyramid lies below a plane, over a facet, an edge or a node of it, and
    /// shallow, too deep, beside the plane, facing away or above it.
    #[test]
    fn overlaps_by_hand() {
        for slave in [true, false] {
            for place in [[0.6, 1.3], [1.0, 0.4], [1.0, 1.0]] {
                let at = |z: f64| depth([place[0], place[1], z], 0.1, slave, 0.0);
                let (node, deep) = at(-0.3).expect("an overlap");
                assert!(node == 13 && (deep - 0.3).abs() < 1e-15, "{node} {deep}");
                // below 2 % of the size of the pyramid's facets, and above the plane
                assert_eq!((at(-0.008), at(0.01)), (None, None));
            }
            let allowed = depth([0.6, 1.3, -0.3], 0.1, slave, 0.2).expect("an overlap");
            assert!((allowed.1 - 0.1).abs() < 1e-15);
            assert_eq!(depth([-0.1, 1.5, -0.3], 0.1, slave, 0.0), None, "beside the plane");
            assert_eq!(depth([0.5, 0.5, -1.1], 0.1, slave, 0.0), None, "deeper than a facet is wide");
            assert_eq!(depth([2.4, 2.4, -0.3], 0.1, slave, 0.0), None, "beside a corner of the plane");
            assert_eq!(depth([0.6, 1.3, -0.3], -0.7, slave, 0.0), None, "it faces away from the plane");
        }
        // on the border itself, as on a plane of symmetry
        assert_eq!(depth([0.0, 1.3, -0.3], 0.1, true, 0.0), Some((13, 0.3)));
    }

    /// The plane's facets stand for a surface 0.2 above or below their centres, by the polynomials of the height at
    /// ξ = 0.2, η = −0.4.
    #[test]
    fn the_height_of_the_true_surface_counts() {
        for (sign, deep) in [(1.0, Some(0.1 + 0.2 * 0.96 * 0.84)), (-1.0, None)] {
            let (interface, x) = pyramid([0.6, 1.3, -0.1], 0.1, true);
            // sign · 0.2 (1 − ξ²)(1 − η²)
            let at = |i: usize| 0.25 * i as f64 * (1.0 - 0.25 * i as f64);
            let bubble = std::array::from_fn(|i| sign * 3.2 * at(i % 5) * at(i / 5));
            let unit = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| Vector3::new(x, y, 0.0));
            let height = FacetHeight::new(bubble, &unit);
            let heights = vec![Some(height); interface.master_facets().len()];
            let interface = interface.with_heights([Vec::new(), heights]);
            let open = vec![true; interface.slave_nodes().len()];
            let found = interface.deepest_overlap(&x, &open, 0.0).map(|overlap| overlap.depth);
            match (found, deep) {
                (Some(found), Some(deep)) => assert!((found - deep).abs() < 1e-14, "{found} {deep}"),
                _ => assert_eq!(found, deep),
            }
        }
    }

    /// The tip of the pyramid stands for a point of a surface that is 0.06 above or below it; its facets' heights are
    /// zero elsewhere.
    #[test]
    fn the_height_at_the_node_itself_counts() {
        for height in [0.06, -0.06] {
            let (interface, x) = pyramid([0.6, 1.3, -0.1], 0.1, true);
            // a triangle's values at the corners: 0, 1 and 0, by linear functions of ξ
            let bubble = std::array::from_fn(|i| height * 0.25 * (i % 5) as f64);
            let unit = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|[x, y]| Vector3::new(x, y, 0.0));
            let heights = vec![Some(FacetHeight::new(bubble, &unit)); interface.slave_facets().len()];
            let at_tip = heights[0].map_or(0.0, |of| of.value(3, &[0.0, 1.0, 0.0, 0.0]));
            let interface = interface.with_heights([heights, Vec::new()]);
            let open = vec![true; interface.slave_nodes().len()];
            let found = interface.deepest_overlap(&x, &open, 0.0).expect("an overlap");
            assert!((found.depth - (0.1 + at_tip)).abs() < 1e-14, "{found:?} {at_tip}");
            assert!((at_tip - height).abs() < 1e-14, "{at_tip}");
        }
    }

    /// A tip 0.012 deep, 2.3 % of the size of the pyramid's facets: counted if the whole pair is open, not beside a
    /// node that transmits a force.
    #[test]
    fn the_rim_of_a_contact_is_silent() {
        let (interface, x) = pyramid([0.6, 1.3, -0.012], 0.1, false);
        let mut open = vec![true; interface.slave_nodes().len()];
        assert_eq!(interface.deepest_overlap(&x, &open, 0.0).map(|overlap| overlap.node), Some(13));
        let far = interface.slave_nodes().iter().position(|slave| slave.node == 2).expect("a corner of the plane");
        open[far] = false;
        assert_eq!(interface.deepest_overlap(&x, &open, 0.0), None);
    }

    /// A force at any node of the facets involved, and at the slave nodes of the facet above.
    #[test]
    fn forces_close_the_overlap() {
        for slave in [true, false] {
            let (interface, x) = pyramid([0.6, 1.3, -0.3], 0.1, slave);
            let nodes = interface.slave_nodes();
            for closed in nodes.iter().map(|slave| slave.node) {
                let open: Vec<bool> = nodes.iter().map(|slave| slave.node != closed).collect();
                let involved = slave || [3, 4, 6, 7].contains(&closed);
                assert_eq!(interface.deepest_overlap(&x, &open, 0.0).is_none(), involved, "{closed}");
            }
        }
    }
}

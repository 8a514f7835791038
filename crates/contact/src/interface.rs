//! A contact interface: slave and master surfaces, and the evaluation of all its nodes.

use crate::cones::{self, Wanted};
use crate::enforcement::soft::Weight;
use crate::kinematics::cell_rule::CellPoint;
use crate::kinematics::coupling::{FacetCoupling, FoldedFacet, PointPressure, Settings};
use crate::kinematics::height::{CurvedFacet, FacetHeight};
use crate::kinematics::{CellRule, MultiplierShape, NodeKinematics};
use crate::slave_node::{SlaveNode, following, slave_topology};
use rayon::prelude::*;
use slipstick_mesh::{FacetNodes, FacetTree, QuadraticFacet};

/// Why a contact interface cannot be built or evaluated.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum InterfaceError {
    /// A surface has no facets.
    #[error("the {side} surface has no facets; name a surface of the body's boundary")]
    Empty {
        /// "slave" or "master".
        side: &'static str,
    },
    /// Slave and master share a node.
    #[error("node {node} lies on the slave and on the master surface; contact couples two separate surfaces")]
    SharedNode {
        /// Global node number.
        node: u32,
    },
    /// The averaged normal at a slave node vanished: the facets around it are folded or collapsed.
    #[error("the slave surface is folded or collapsed at node {node}: no averaged normal exists there")]
    Folded {
        /// Global node number.
        node: u32,
    },
    /// A slave facet, or a master facet close to one, is so distorted that its projection is
    /// folded.
    #[error("the facet of nodes {} is folded where surfaces may touch", list(.nodes))]
    FoldedFacet {
        /// Global node numbers of the facet.
        nodes: FacetNodes,
    },
}

fn list(nodes: &FacetNodes) -> String {
    let numbers: Vec<String> = nodes.iter().map(u32::to_string).collect();
    numbers.join(", ")
}

/// Discretization of an interface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InterfaceOptions {
    /// Shape functions of the multipliers.
    pub shape: MultiplierShape,
    /// Integration rule of the mortar cells.
    pub rule: CellRule,
    /// Distance along the slave normal within which facets are coupled; it must exceed the largest
    /// relative motion of one step, and be less than the thickness of the bodies. \[L\]
    pub reach: f64,
    /// Angle between the normals of neighbouring slave facets above which the edge between them is
    /// sharp, in the reference configuration. \[rad\]
    pub feature_angle: f64,
}

/// Slave and master surfaces with the data for the mortar integrals; positions are passed to the
/// evaluation.
#[derive(Debug, Clone)]
pub struct ContactInterface {
    slave_facets: Vec<FacetNodes>,
    master_facets: Vec<FacetNodes>,
    slave_nodes: Vec<SlaveNode>,
    /// The corners of each slave facet whose normal depends on the master's.
    sharp: Vec<[bool; 4]>,
    shape: MultiplierShape,
    rule: Vec<CellPoint>,
    reach: f64,
    trusted: f64,
    /// Whether slave and master are the same surface, which touches itself.
    with_itself: bool,
    /// The master facets at the reference coordinates.
    tree: FacetTree,
    /// For the facets of slave and master, the height of the true surface above them; empty where
    /// all facets of a side are the surface itself.
    heights: [Vec<Option<FacetHeight>>; 2],
    /// For the facets of slave and master, the quadratic face that a pressure at the points acts on; empty where a
    /// side has none.
    faces: [Vec<Option<QuadraticFacet>>; 2],
    /// For each slave facet, the initial gaps that do not count where a pressure follows from the gap at each
    /// integration point, at the points of the facet or of its face; empty: all count. \[L\]
    pub(crate) closed: Vec<[f64; 9]>,
}

/// Buffers of [`ContactInterface::evaluate`], and the slave nodes that it evaluates.
#[derive(Debug, Clone)]
pub struct InterfaceWorkspace {
    tree: FacetTree,
    couplings: Vec<FacetCoupling>,
    /// The slave nodes to evaluate, and the slave facets that are needed for them.
    nodes: Vec<bool>,
    facets: Vec<bool>,
}

impl ContactInterface {
    /// Builds the interface between two surfaces given by their facets' nodes (counter-clockwise
    /// from outside), triangles and quadrilaterals in any mixture, at the reference `coordinates`
    /// (3 per node). If both are the same, the surface touches itself: every facet is slave and
    /// master of all facets except its neighbours, and each side transmits half of the traction.
    ///
    /// # Errors
    /// If a surface is empty, or a node lies on both of two different surfaces.
    pub fn new(
        slave_facets: Vec<FacetNodes>,
        master_facets: Vec<FacetNodes>,
        coordinates: &[f64],
        options: InterfaceOptions,
    ) -> Result<Self, InterfaceError> {
        for (facets, side) in [(&slave_facets, "slave"), (&master_facets, "master")] {
            if facets.is_empty() {
                return Err(InterfaceError::Empty { side });
            }
        }
        let InterfaceOptions { shape, rule, reach, feature_angle } = options;
        let slave_nodes = slave_topology(&slave_facets, coordinates, feature_angle);
        let mut master: Vec<u32> = master_facets.iter().flatten().copied().collect();
        master.sort_unstable();
        let with_itself = slave_facets == master_facets;
        let shared = slave_nodes.iter().find(|s| master.binary_search(&s.node).is_ok());
        if let Some(shared) = shared.filter(|_| !with_itself) {
            return Err(InterfaceError::SharedNode { node: shared.node });
        }
        let sharp = following(&slave_nodes, slave_facets.len());
        let tree = FacetTree::build(&master_facets, coordinates);
        let (rule, trusted) = (rule.points(), f64::INFINITY);
        let (heights, faces) = ([Vec::new(), Vec::new()], [Vec::new(), Vec::new()]);
        Ok(Self {
            slave_facets,
            master_facets,
            slave_nodes,
            sharp,
            shape,
            rule,
            reach,
            trusted,
            with_itself,
            tree,
            heights,
            faces,
            closed: Vec::new(),
        })
    }

    /// The same interface with the heights of the true surfaces above the facets of slave and
    /// master, facet by facet, or none for a side whose facets are the surface itself.
    ///
    /// # Panics
    /// If a side has heights, but not for each of its facets.
    pub fn with_heights(mut self, heights: [Vec<Option<FacetHeight>>; 2]) -> Self {
        for (heights, facets) in heights.iter().zip([&self.slave_facets, &self.master_facets]) {
            assert!(heights.is_empty() || heights.len() == facets.len(), "a height for each facet");
        }
        self.heights = heights;
        self
    }

    /// The same interface, in which a pressure at the points acts on the quadratic faces of slave and master, facet by
    /// facet ([`slipstick_mesh::Mesh::quadratic_facets`]), or on the facets of a side that has none.
    ///
    /// # Panics
    /// If a side has faces, but not an entry for each of its facets.
    pub fn with_quadratic_faces(mut self, faces: [Vec<Option<QuadraticFacet>>; 2]) -> Self {
        for (faces, facets) in faces.iter().zip([&self.slave_facets, &self.master_facets]) {
            assert!(faces.is_empty() || faces.len() == facets.len(), "an entry for each facet");
        }
        for slave in &mut self.slave_nodes {
            for (facet, _) in &slave.facets {
                let face = faces[0].get(*facet as usize).and_then(Option::as_ref);
                for node in face.iter().flat_map(|face| face.nodes.iter()) {
                    if !slave.ring.contains(node) {
                        slave.ring.push(*node);
                    }
                }
            }
        }
        self.faces = faces;
        self
    }

    /// A facet of the slave (side 0) or the master (1) with the surface for which it stands.
    pub(crate) fn curved(&self, side: usize, number: usize) -> CurvedFacet<'_> {
        let nodes = if side == 0 { self.slave_facets[number] } else { self.master_facets[number] };
        let height = self.heights[side].get(number).and_then(Option::as_ref);
        CurvedFacet { nodes, height, face: self.faces[side].get(number).and_then(Option::as_ref) }
    }

    /// The same slave surface, opposite to other master facets with this tree.
    pub(crate) fn opposite(&self, master_facets: Vec<FacetNodes>, tree: FacetTree) -> Self {
        let faces = [Vec::new(), Vec::new()];
        let (trusted, with_itself, closed) = (f64::INFINITY, false, Vec::new());
        Self { master_facets, tree, trusted, with_itself, faces, closed, ..self.clone() }
    }

    /// The heights of the true surfaces above the facets of slave and master, as in
    /// [`Self::with_heights`].
    pub fn heights(&self) -> &[Vec<Option<FacetHeight>>; 2] {
        &self.heights
    }

    /// Buffers for evaluating the slave nodes that `has` selects by their global numbers.
    pub fn workspace(&self, has: impl Fn(u32) -> bool) -> InterfaceWorkspace {
        let around = |facet: &FacetNodes| facet.iter().any(|&node| has(node));
        InterfaceWorkspace {
            tree: self.tree.clone(),
            couplings: vec![FacetCoupling::default(); self.slave_facets.len()],
            nodes: self.slave_nodes.iter().map(|slave| has(slave.node)).collect(),
            facets: self.slave_facets.iter().map(around).collect(),
        }
    }

    /// The same interface with symmetry planes: for a node, `mirrored` returns the coordinate axes
    /// normal to the planes through it.
    pub fn with_symmetry(mut self, mirrored: impl Fn(u32) -> [bool; 3]) -> Self {
        self.slave_nodes.iter_mut().for_each(|slave| slave.mirrored = mirrored(slave.node));
        self
    }

    /// The same interface with other multipliers.
    pub fn with_shape(mut self, shape: MultiplierShape) -> Self {
        self.shape = shape;
        self
    }

    /// The same interface, which couples facets that penetrate more than `depth` only where the
    /// slave lies inside the master's body. `depth` is what the bodies may move towards each other
    /// in one step; without it, all facets within reach couple. \[L\]
    pub fn with_trusted_depth(mut self, depth: f64) -> Self {
        self.trusted = depth;
        self
    }

    /// The same interface, in which the normal of a slave node at an edge of its body follows the
    /// master: it is the direction opposite to the master's, projected onto the normal cone of the
    /// node ([`crate::kinematics::cone`]). `boundary` are all facets of the slave's bodies,
    /// including those outside of the slave surface, but not those that symmetry or supports hold
    /// in their plane. The same holds where slave facets meet at more than 10°, but less than the feature angle.
    /// Elsewhere the averaged normals remain. `coordinates` and `feature_angle` as in [`Self::new`].
    pub fn with_touched_normals(self, boundary: &[FacetNodes], coordinates: &[f64], feature_angle: f64) -> Self {
        self.with_cones(boundary, coordinates, feature_angle, &Wanted { kinks: Some(cones::KINK), at: &|_| true })
    }

    /// As [`Self::with_touched_normals`], but only where the slave surface ends at an edge, or has a kink of more than 30°, where the averaged
    /// normal is off by more than 15° (none if the feature angle is 180°); and only if no facet there, or none of the
    /// master's, stands for a curved surface ([`Self::with_heights`]).
    /// Edges that the surface surrounds follow the master anyway.
    pub fn with_touched_flat_edges(self, boundary: &[FacetNodes], coordinates: &[f64], feature_angle: f64) -> Self {
        let curved: Vec<bool> = self.heights()[0].iter().map(Option::is_some).collect();
        let is_curved = |facet: u32| curved.get(facet as usize).copied().unwrap_or(false);
        let flat_master = self.heights()[1].iter().all(Option::is_none);
        let on_curved = |slave: &SlaveNode| !flat_master && slave.facets.iter().any(|&(facet, _)| is_curved(facet));
        let flat = |slave: &SlaveNode| !slave.sharp && !on_curved(slave);
        // 180°: no edge of the surface counts
        let kinks = (feature_angle < std::f64::consts::PI).then_some(cones::SHARP_KINK);
        self.with_cones(boundary, coordinates, feature_angle, &Wanted { kinks, at: &flat })
    }

    /// As [`Self::with_touched_normals`], but at edges of the slave's bodies only, and not where facets of a smooth patch meet: between two
    /// polygons, facets of the master would determine the normals no better than averages do.
    pub fn with_touched_edges(self, boundary: &[FacetNodes], coordinates: &[f64], feature_angle: f64) -> Self {
        self.with_cones(boundary, coordinates, feature_angle, &Wanted { kinks: None, at: &|_| true })
    }

    /// The same interface with the master's normals at all slave nodes, or with averaged ones.
    pub(crate) fn with_frames(mut self, of_master: bool) -> Self {
        for slave in &mut self.slave_nodes {
            slave.sharp = of_master;
            slave.cone.clear();
        }
        self.sharp = following(&self.slave_nodes, self.slave_facets.len());
        self
    }

    fn with_cones(mut self, boundary: &[FacetNodes], x: &[f64], feature_angle: f64, wanted: &Wanted<'_>) -> Self {
        cones::add(&mut self.slave_nodes, &self.slave_facets, boundary, x, feature_angle, wanted);
        self.sharp = following(&self.slave_nodes, self.slave_facets.len());
        self
    }

    /// The slave nodes in the order of all nodal contact quantities: ascending by global number,
    /// and patch by patch at sharp edges.
    pub fn slave_nodes(&self) -> &[SlaveNode] {
        &self.slave_nodes
    }

    /// The facets of the slave surface.
    pub fn slave_facets(&self) -> &[FacetNodes] {
        &self.slave_facets
    }

    /// The facets of the master surface.
    pub fn master_facets(&self) -> &[FacetNodes] {
        &self.master_facets
    }

    /// Whether the surface touches itself.
    pub fn is_with_itself(&self) -> bool {
        self.with_itself
    }

    /// The search distance along the slave normal. \[L\]
    pub fn reach(&self) -> f64 {
        self.reach
    }

    /// Values of slave nodes at the corners of the slave facets.
    fn at_corners(&self, values: &[f64]) -> Vec<[f64; 4]> {
        let mut out = vec![[0.0; 4]; self.slave_facets.len()];
        for (slave, value) in self.slave_nodes.iter().zip(values) {
            for &(facet, corner) in &slave.facets {
                out[facet as usize][usize::from(corner)] = *value;
            }
        }
        out
    }

    /// Evaluates mortar rows and frames at the current positions `x` (3 per node of the mesh) of
    /// the slave nodes of the workspace, and leaves the others empty.
    ///
    /// The result depends only on `x`, not on earlier evaluations or the number of threads.
    ///
    /// # Errors
    /// [`InterfaceError::Folded`] if an averaged normal vanishes, [`InterfaceError::FoldedFacet`].
    pub fn evaluate(
        &self,
        x: &[f64],
        with_gradient: bool,
        workspace: &mut InterfaceWorkspace,
        out: &mut Vec<NodeKinematics>,
    ) -> Result<(), InterfaceError> {
        self.evaluate_pressed(x, with_gradient, None, workspace, out)
    }

    /// As [`Self::evaluate`], with a pressure, or the energy that it stores, at each integration point, whose gap is
    /// reduced by offsets (one for each slave node) interpolated from the nodes. \[L\]
    ///
    /// # Errors
    /// As for [`Self::evaluate`].
    pub fn evaluate_pressed(
        &self,
        x: &[f64],
        with_gradient: bool,
        pressure: Option<(Weight<'_>, &[f64])>,
        workspace: &mut InterfaceWorkspace,
        out: &mut Vec<NodeKinematics>,
    ) -> Result<(), InterfaceError> {
        let offsets = pressure.map(|(_, offsets)| self.at_corners(offsets));
        let InterfaceWorkspace { tree, couplings, nodes, facets } = workspace;
        tree.refit(x);
        let largest = self.master_facets.iter().map(|f| sphere(f, x).1).fold(0.0, f64::max);
        let Self { slave_facets, sharp, rule, .. } = self;
        let settings = Settings { x, rule, shape: self.shape, reach: self.reach, trusted: self.trusted, with_gradient };
        let tree = &*tree;
        let facets = couplings.par_iter_mut().zip(slave_facets).zip(sharp).zip(&*facets).enumerate();
        let folded = facets.map_init(Vec::new, |hits, (number, (((coupling, facet), sharp), &evaluated))| {
            if !evaluated {
                return Ok(());
            }
            let (centre, radius) = sphere(facet, x);
            // encloses every master facet that FacetCoupling may accept
            let margin = settings.reach + radius + 2.0 * largest;
            hits.clear();
            tree.query(centre.map(|c| c - margin), centre.map(|c| c + margin), hits);
            let neighbour = |master: &FacetNodes| self.with_itself && master.iter().any(|node| facet.contains(node));
            let candidates = hits.iter().map(|&h| self.curved(1, h as usize));
            let candidates = candidates.filter(|master| !neighbour(&master.nodes));
            let slave = self.curved(0, number);
            coupling.evaluate(slave, *sharp, candidates.clone(), settings)?;
            if let (Some((weight, _)), Some(offsets)) = (pressure, &offsets) {
                let closed = self.closed.get(number).copied().unwrap_or_default();
                coupling.press(slave, candidates, settings, PointPressure { weight, offsets: offsets[number], closed });
            }
            Ok(())
        });
        // the first one by facet number, regardless of which thread finishes first
        let folded: Vec<FacetNodes> =
            folded.filter_map(|result| result.err().map(|FoldedFacet(facet)| facet)).collect();
        if let Some(&nodes) = folded.first() {
            return Err(InterfaceError::FoldedFacet { nodes });
        }
        out.resize_with(self.slave_nodes.len(), NodeKinematics::default);
        let couplings = &*couplings;
        let folded = out
            .par_iter_mut()
            .zip(&self.slave_nodes)
            .zip(&*nodes)
            .filter_map(|((row, slave), &evaluated)| {
                let folded = evaluated && !row.gather(slave, couplings, x, with_gradient, pressure.is_some());
                folded.then_some(slave.node)
            })
            .min();
        match folded {
            Some(node) => Err(InterfaceError::Folded { node }),
            None => Ok(()),
        }
    }
}

/// Centre and radius of the sphere around a facet.
fn sphere(facet: &FacetNodes, x: &[f64]) -> ([f64; 3], f64) {
    let corner = |n: u32| -> [f64; 3] { std::array::from_fn(|c| x[3 * n as usize + c]) };
    let share = 1.0 / facet.len() as f64;
    let centre: [f64; 3] = std::array::from_fn(|c| share * facet.iter().map(|&n| corner(n)[c]).sum::<f64>());
    let radius = facet
        .iter()
        .map(|&n| corner(n).iter().zip(&centre).map(|(a, b)| (a - b) * (a - b)).sum::<f64>())
        .fold(0.0, f64::max)
        .sqrt();
    (centre, radius)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A slave square that faces up, at height zero, and below it a box
    /// although its body is below, as a ball's far side does: the box between the heights −3 and
    /// `top`. The slave couples with the bottom of the box if it lies inside the box, or if one
    /// step can move it there.
    #[test]
    fn a_slave_facet_does_not_touch_what_lies_behind_it() {
        let coupled = |top: f64, trusted: f64, reach: f64| {
            let square = |height: f64| [[0.0, 0.0, height], [1.0, 0.0, height], [1.0, 1.0, height], [0.0, 1.0, height]];
            let x = [square(0.0), square(-3.0), square(top)].concat();
            // the bottom of the box faces down, its top faces up
            let masters = vec![FacetNodes::from([4, 7, 6, 5]), FacetNodes::from([8, 9, 10, 11])];
            let shape = MultiplierShape::Standard;
            let options = InterfaceOptions { shape, rule: CellRule::Seven, reach, feature_angle: 0.5 };
            let interface = ContactInterface::new(vec![[0, 1, 2, 3].into()], masters, x.as_flattened(), options);
            let interface = interface.unwrap().with_trusted_depth(trusted);
            let mut rows = Vec::new();
            interface.evaluate(x.as_flattened(), false, &mut interface.workspace(|_| true), &mut rows).unwrap();
            rows.iter().all(|row| (row.area - 0.25).abs() < 1e-14)
        };
        for reach in [3.0, 60.0] {
            assert!(coupled(1.0, 0.0, reach), "the slave is inside the box");
            assert!(!coupled(-1.0, 0.0, reach), "the box ends below the slave");
            assert!(coupled(-1.0, 3.5, reach), "one step moves the slave through the box");
        }
        assert!(!coupled(1.0, 0.0, 1.0), "out of reach");
    }

    /// Facets that the tree excludes do not couple. The test compares the tree with a search
    /// through all masters: one slave facet and layers of parallel master squares over its centre
    /// and corners, near and far, for all proportions of slave, masters and reach.
    #[test]
    fn no_master_within_reach_is_missed() {
        let square = |half: f64| vec![[-half, -half], [half, -half], [half, half], [-half, half]];
        // far from the origin, and its first corner far from the others
        let needle = vec![[5.1, 0.3], [-9.9, 0.4], [-9.9, 0.2]];
        for (slave, half, reach) in [
            (square(1.0), 0.05, 0.1),
            (square(0.05), 10.0, 0.5),
            (square(0.05), 0.05, 2.0),
            (square(1.0), 1.0, 0.1),
            (needle, 3e-4, 0.1),
        ] {
            let mut x: Vec<f64> = slave.iter().flat_map(|&[a, b]| [a, b, 0.0]).collect();
            let corners = slave.len();
            let centre: [f64; 2] = std::array::from_fn(|c| slave.iter().map(|p| p[c]).sum::<f64>() / corners as f64);
            // the farthest layer that couples, with centres beyond the reach by the radius of a
            // square, and a farther one
            let farthest = reach + f64::sqrt(2.0) * half;
            let mut masters = Vec::new();
            for height in [0.0, 0.9 * reach, 0.999 * farthest, 1.001 * farthest].map(|h| [-h, h]).concat() {
                for at in slave.iter().chain([&centre]) {
                    let [a, b] = [0, 1].map(|c| centre[c] + 0.99 * (at[c] - centre[c]));
                    let first = (x.len() / 3) as u32;
                    // it faces down
                    x.extend(square(half).iter().flat_map(|p| [a + p[1], b + p[0], height]));
                    masters.push(FacetNodes::from([first, first + 1, first + 2, first + 3]));
                }
            }
            let slave = FacetNodes::new(&[0, 1, 2, 3][..corners]).unwrap();
            let shape = MultiplierShape::Standard;
            let options = InterfaceOptions { shape, rule: CellRule::Seven, reach, feature_angle: 0.5 };
            let interface = ContactInterface::new(vec![slave], masters.clone(), &x, options).unwrap();
            let mut workspace = interface.workspace(|_| true);
            interface.evaluate(&x, false, &mut workspace, &mut Vec::new()).unwrap();
            let settings = Settings { x: &x, rule: &interface.rule, shape, reach, trusted: 0.0, with_gradient: false };
            let mut all = FacetCoupling::default();
            all.evaluate(slave.into(), [false; 4], masters.iter().map(|&master| master.into()), settings).unwrap();
            // by counting: two of the eight layers are too far away
            assert_eq!(all.nodes.len(), corners + 6 * 4 * (corners + 1));
            assert_eq!(workspace.couplings[0].nodes, all.nodes);
            assert_eq!(workspace.couplings[0].coefficient, all.coefficient);
        }
    }
}

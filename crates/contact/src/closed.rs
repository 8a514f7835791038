//! Initial gaps that do not count where a pressure follows from the gap at each integration point.

use crate::ContactInterface;
use crate::kinematics::node_gaps::node_gaps;
use slipstick_mesh::{FacetNodes, FacetTree, NodeGaps};
use std::collections::BTreeMap;

impl ContactInterface {
    /// The same interface, in which initial gaps do not count where a pressure follows from the gap at each
    /// integration point: as if nodes of the slave had been moved. For a node and its smallest gap along the normals of
    /// the slave facets at the reference `coordinates` (3 per node), `remains` returns the gap that remains, or `None`
    /// if the node is not moved.
    ///
    /// Test: `closed_gaps_of_nodes_are_interpolated_like_positions` (tests/pressed.rs).
    pub fn with_closed_gaps(mut self, coordinates: &[f64], remains: impl Fn(u32, f64) -> Option<f64>) -> Self {
        let gaps = self.node_gaps(coordinates);
        let least = self.least(&gaps).into_iter();
        let rest: BTreeMap<u32, f64> = least.filter_map(|(node, gap)| Some((node, remains(node, gap)?))).collect();
        let closed = gaps.iter().enumerate().map(|(number, gaps)| {
            let mut out = [0.0; 9];
            for ((out, gap), node) in out.iter_mut().zip(gaps).zip(self.curved(0, number).face_nodes()) {
                *out = gap.zip(rest.get(node)).map_or(0.0, |(gap, rest)| gap - rest);
            }
            self.curved(0, number).face.map_or(out, |face| face.at_points(&out))
        });
        self.closed = closed.collect();
        self
    }

    /// The smallest gap of each node of the slave along the normals of the slave facets around it, at the reference
    /// `coordinates`; without nodes that face no master. \[L\]
    pub fn least_gaps(&self, coordinates: &[f64]) -> BTreeMap<u32, f64> {
        self.least(&self.node_gaps(coordinates))
    }

    /// The same from the [gaps of facets](Self::node_gaps).
    fn least(&self, gaps: &[NodeGaps]) -> BTreeMap<u32, f64> {
        let mut least: BTreeMap<u32, f64> = BTreeMap::new();
        for (number, gaps) in gaps.iter().enumerate() {
            for (&node, gap) in self.curved(0, number).face_nodes().iter().zip(gaps) {
                if let Some(gap) = gap {
                    let known = least.entry(node).or_insert(*gap);
                    *known = if gap.abs() < known.abs() { *gap } else { *known };
                }
            }
        }
        least
    }

    /// Whether initial gaps do not count, [`Self::with_closed_gaps`].
    pub fn has_closed_gaps(&self) -> bool {
        self.closed.iter().flatten().any(|&gap| gap != 0.0)
    }

    /// For each slave facet, the gaps of the nodes of the facet, or of its quadratic face.
    fn node_gaps(&self, coordinates: &[f64]) -> Vec<NodeGaps> {
        let tree = FacetTree::build(self.master_facets(), coordinates);
        let mut hits = Vec::new();
        let of = |(number, facet): (usize, &FacetNodes)| {
            let slave = self.curved(0, number);
            hits.clear();
            let along = |c: usize| slave.face_nodes().iter().map(move |&node| coordinates[3 * node as usize + c]);
            let least = std::array::from_fn(|c| along(c).fold(f64::INFINITY, f64::min) - self.reach());
            let most = std::array::from_fn(|c| along(c).fold(f64::NEG_INFINITY, f64::max) + self.reach());
            tree.query(least, most, &mut hits);
            let masters = hits.iter().map(|&hit| self.curved(1, hit as usize));
            let neighbour = |master: &FacetNodes| master.iter().any(|node| facet.contains(node));
            let masters = masters.filter(|master| !(self.is_with_itself() && neighbour(&master.nodes)));
            node_gaps(slave, masters, coordinates, self.reach())
        };
        self.slave_facets().iter().enumerate().map(of).collect()
    }
}

//! The gap that rows measure between curved surfaces at unit distance.
//!
//! A row measures gaps along the normals n₀ of slave facets and then along n_j, while two surfaces at a
//! distance are this far apart along their own normals. The mean gap of a node between surfaces at unit
//! distance is
//!
//! ```text
//! s_j = n_j · Σ_facets n₀ ∫ Φ_j √(1 + |∇h|²) dA / A_j
//! ```
//!
//! in the reference configuration, with the heights h of the slave's surface. An offset d thus changes
//! the weighted gap by s_j d A_j. On flat surfaces s = 1; next to a node in the middle of a quadratic
//! element, facets are more inclined than at its corners.

use crate::kinematics::height::FacetHeight;
use crate::{ContactInterface, InterfaceError};
use nalgebra::Vector3;
use slipstick_mesh::{FacetNodes, FacetTree};

impl ContactInterface {
    /// For each slave node, the mean gap at the reference `coordinates` (3 per node) that its row
    /// measures between its surface and one at unit distance; 1 on sharp edges and where the facets
    /// are the surface itself.
    ///
    /// # Errors
    /// If the surface is folded.
    ///
    /// Test: `gaps_between_arcs_do_not_depend_on_the_facets` (tests/suite/kinematics.rs).
    pub fn slants(&self, coordinates: &[f64]) -> Result<Vec<f64>, InterfaceError> {
        let [heights, _] = self.heights();
        let curved = |facet: u32| heights.get(facet as usize).is_some_and(Option::is_some);
        if !heights.iter().any(Option::is_some) {
            return Ok(vec![1.0; self.slave_nodes().len()]);
        }
        // the surface opposite to a copy of its own
        let first = (coordinates.len() / 3) as u32;
        let copy = |facet: &FacetNodes| {
            let nodes: Vec<u32> = facet.iter().map(|node| node + first).collect();
            FacetNodes::new(&nodes).map(|copy| copy.reversed())
        };
        let copies: Vec<FacetNodes> = self.slave_facets().iter().filter_map(copy).collect();
        let both = [coordinates, coordinates].concat();
        let slanted = self.slave_facets().iter().zip(heights).map(|(facet, height)| {
            let corners: Vec<Vector3<f64>> =
                facet.iter().map(|&node| Vector3::from_column_slice(&coordinates[3 * node as usize..][..3])).collect();
            Some(height.as_ref().map_or_else(|| FacetHeight::new([1.0; 25], &corners), |height| height.slant(&corners)))
        });
        let tree = FacetTree::build(&copies, &both);
        let opposite = self.opposite(copies, tree).with_heights([slanted.collect(), Vec::new()]);
        let mut rows = Vec::new();
        opposite.evaluate(&both, false, &mut opposite.workspace(|_| true), &mut rows)?;
        let slant = |(slave, row): (&crate::SlaveNode, &crate::kinematics::NodeKinematics)| {
            let counts = !slave.sharp && row.area > 0.0 && slave.facets.iter().any(|&(facet, _)| curved(facet));
            if counts { -row.gap() / row.area } else { 1.0 }
        };
        Ok(self.slave_nodes().iter().zip(&rows).map(slant).collect())
    }
}

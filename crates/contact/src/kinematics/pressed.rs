//! The row by which a pressure at the integration points acts on the nodes.
//!
//! ```text
//! b^p_js = ∫ N_j p N_s over both sides, + for slave and − for master nodes      Σ_s b^p_js = 0
//!          with the functions N_s of the whole face of a quadratic element
//! P_j    = Σ_k b^p_jk                                                          load of slave node j
//! b̂_js   = A_j b^p_js / P_j                                                    row of its forces, f_s = b̂_js z_j
//! ```
//!
//! With the mean pressure z_n = P/A, f_s = b^p_js n_j. The sum of the forces on each side, Σ_j P_j n_j,
//! and their moments are those of the pressure at the points, with the normals of the nodes.

use super::coupling::FacetCoupling;
use super::rows::NodeKinematics;
use crate::slave_node::SlaveNode;

/// The pressure at the integration points around a slave node.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PressedRow {
    /// b̂_js over the support of the node's row. \[L²\]
    pub coefficient: Vec<f64>,
    /// `gradient[s * 3 |support| + t]` = ∂b̂_js/∂x_t. \[L\]
    pub gradient: Vec<f64>,
    /// P_j, for a stiffness of 1 where the law is in proportion to the penetration. \[F\], or \[L³\] then
    pub load: f64,
    /// ∂P_j/∂x_t.
    pub load_gradient: Vec<f64>,
}

/// Loads below this fraction of the node's area are none: their row would overflow.
const LEAST: f64 = 1e-200;

impl NodeKinematics {
    /// The row of the node's forces, f_s = b̂_js z_j, and its gradient: that of the pressure at the points, where
    /// there is one, otherwise the mortar row.
    pub fn force_row(&self) -> (&[f64], &[f64]) {
        match &self.pressed {
            Some(pressed) => (&pressed.coefficient, &pressed.gradient),
            None => (&self.coefficient, &self.gradient),
        }
    }

    /// Collects the pressed rows of the facets around the node, after its other data.
    ///
    /// Test: `pressed_rows_match_finite_differences` (tests/pressed.rs).
    pub(super) fn gather_pressed(&mut self, slave: &SlaveNode, couplings: &[FacetCoupling], with_gradient: bool) {
        let (count, columns) = (self.support.len(), 3 * self.support.len());
        let mut row = PressedRow {
            coefficient: vec![0.0; count],
            gradient: vec![0.0; if with_gradient { count * columns } else { 0 }],
            load: 0.0,
            load_gradient: vec![0.0; if with_gradient { columns } else { 0 }],
        };
        for &(facet, corner) in &slave.facets {
            let coupling = &couplings[facet as usize];
            if coupling.pressed.is_empty() {
                continue;
            }
            let (n, corner) = (coupling.nodes.len(), usize::from(corner));
            let place = |(i, &node): (usize, &u32)| self.position_of(node, i < coupling.own);
            let local: Vec<usize> = coupling.nodes.iter().enumerate().map(place).collect();
            for (i, &s) in local.iter().enumerate() {
                let at = corner * n + i;
                row.coefficient[s] += coupling.pressed[at];
                if !with_gradient {
                    continue;
                }
                let from = &coupling.pressed_gradient[at * 3 * n..][..3 * n];
                for (k, &t) in local.iter().enumerate() {
                    (0..3).for_each(|c| row.gradient[s * columns + 3 * t + c] += from[3 * k + c]);
                }
            }
        }
        row.load = row.coefficient[..self.ring].iter().sum();
        if !(row.load > LEAST * self.area) {
            (row.coefficient, row.gradient, row.load) = (self.coefficient.clone(), self.gradient.clone(), 0.0);
            self.pressed = Some(row);
            return;
        }
        for s in 0..if with_gradient { self.ring } else { 0 } {
            let from = &row.gradient[s * columns..][..columns];
            row.load_gradient.iter_mut().zip(from).for_each(|(to, from)| *to += from);
        }
        // ∂b̂ = A/P ∂b + b (∂A/P − A ∂P/P²)
        let factor = self.area / row.load;
        for s in 0..count {
            let share = row.coefficient[s] / row.load;
            row.coefficient[s] = share * self.area;
            if with_gradient {
                let slopes = self.area_gradient.iter().zip(&row.load_gradient);
                for (to, (area, load)) in row.gradient[s * columns..][..columns].iter_mut().zip(slopes) {
                    *to = factor * *to + share * (area - factor * load);
                }
            }
        }
        self.pressed = Some(row);
    }
}

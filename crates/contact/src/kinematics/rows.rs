//! The data that the enforcement needs at a slave node: mortar row, frame and weighted gap.

use super::cone::{Projection, WIDENING};
use super::coupling::FacetCoupling;
use super::frame::{NodalFrame, RingCorner, averaged_normal, nodal_frame, normalisation_slope, within};
use super::pressed::PressedRow;
use crate::slave_node::SlaveNode;
use nalgebra::Vector3;

/// Mortar row and frame of one slave node at given positions, with gradients if requested.
///
/// The support lists first the node's ring (all nodes of the slave facets around it, or of its patch
/// at a sharp edge, and those of further facets that its normal depends on), then the master nodes. All gradients are with respect to the current
/// positions of the support, three coordinates per node.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct NodeKinematics {
    /// Global number of the slave node.
    pub node: u32,
    /// Global node numbers of the row: ring first, then masters ascending.
    pub support: Vec<u32>,
    /// Number of leading support nodes that belong to the slave surface.
    pub ring: usize,
    /// b_js: +D for slave, −M for master nodes. \[L²\]
    pub coefficient: Vec<f64>,
    /// `gradient[s * 3 |support| + t]` = ∂b_js/∂x_t. \[L\]
    pub gradient: Vec<f64>,
    /// Normal and tangents with their gradient over the ring, or at an edge over the whole support.
    pub frame: NodalFrame,
    /// The frame of the slave's own facets where `frame` follows the master.
    pub own_frame: Option<NodalFrame>,
    /// Tributary area of the overlap, Σ_k D_jk. Zero if nothing lies opposite. \[L²\]
    pub area: f64,
    /// ∂area/∂x_t. \[L\]
    pub area_gradient: Vec<f64>,
    /// Weighted relative position w_j = Σ_s b_js x_s. \[L³\]
    pub relative: Vector3<f64>,
    /// `relative_gradient[c * 3 |support| + t]` = ∂w_c/∂x_t. \[L²\]
    pub relative_gradient: Vec<f64>,
    /// Heights of the true surfaces above the facets, v_j ([`super::height`]); zero if there are
    /// none. \[L³\]
    pub height: Vector3<f64>,
    /// `height_gradient[c * 3 |support| + t]` = ∂v_c/∂x_t; empty if there are no heights. \[L²\]
    pub height_gradient: Vec<f64>,
    /// The pressure at the integration points, if the pair has one.
    pub pressed: Option<PressedRow>,
}

impl NodeKinematics {
    /// Memory of the row, nearly all of it for derivatives. \[bytes\]
    pub fn bytes(&self) -> usize {
        let lists = [
            &self.coefficient,
            &self.gradient,
            &self.frame.gradient,
            &self.area_gradient,
            &self.relative_gradient,
            &self.height_gradient,
            self.own_frame.as_ref().map_or(&self.frame.gradient, |own| &own.gradient),
        ];
        let lists = &lists[..if self.own_frame.is_some() { 7 } else { 6 }];
        let of_pressure = self.pressed.as_ref().map_or(0, |pressed| {
            8 * (pressed.coefficient.len() + pressed.gradient.len() + pressed.load_gradient.len())
        });
        size_of::<Self>()
            + 4 * self.support.len()
            + of_pressure
            + lists.iter().map(|list| 8 * list.len()).sum::<usize>()
    }

    /// Assembles the node's row from the facets around it. Coordinates `x`: 3 per node.
    ///
    /// Returns `false` if the frame is degenerate (facets folded onto each other).
    /// `pressed`: with the pressure at the integration points.
    pub fn gather(
        &mut self,
        slave: &SlaveNode,
        couplings: &[FacetCoupling],
        x: &[f64],
        with_gradient: bool,
        pressed: bool,
    ) -> bool {
        self.node = slave.node;
        self.ring = slave.ring.len();
        self.support.clear();
        for &(facet, _) in &slave.facets {
            let coupling = &couplings[facet as usize];
            self.support.extend(coupling.nodes.iter().skip(coupling.own));
        }
        self.support.sort_unstable();
        self.support.dedup();
        self.support.splice(0..0, slave.ring.iter().copied());

        let n = self.support.len();
        let columns = 3 * n;
        reset(&mut self.coefficient, n);
        reset(&mut self.gradient, if with_gradient { n * columns } else { 0 });
        reset(&mut self.area_gradient, if with_gradient { columns } else { 0 });
        reset(&mut self.relative_gradient, if with_gradient { 3 * columns } else { 0 });
        let mut local = Vec::with_capacity(32);
        for &(facet, corner) in &slave.facets {
            let coupling = &couplings[facet as usize];
            local.clear();
            local.extend(coupling.nodes.iter().enumerate().map(|(i, node)| self.position_of(*node, i < coupling.own)));
            for (i, &s) in local.iter().enumerate() {
                self.coefficient[s] += coupling.coefficient[corner as usize * local.len() + i];
                if with_gradient {
                    let from = coupling.gradient_row(corner as usize, i);
                    let to = &mut self.gradient[s * columns..][..columns];
                    for (k, &t) in local.iter().enumerate() {
                        for c in 0..3 {
                            to[3 * t + c] += from[3 * k + c];
                        }
                    }
                }
            }
        }
        let ring: Vec<Vector3<f64>> = slave.ring.iter().map(|&m| position(x, m)).collect();
        let frame = nodal_frame(&ring, &slave.corners, slave.edge, slave.mirrored, with_gradient, &mut self.frame);
        if frame.is_none() {
            return false;
        }
        self.own_frame = slave.follows_master().then(|| self.frame.clone());
        if slave.follows_master() && self.turn_to_master(slave, couplings, &ring, with_gradient).is_none() {
            return false;
        }
        self.form_relative(x, with_gradient);
        self.gather_height(slave, couplings, with_gradient);
        self.pressed = None;
        if pressed {
            self.gather_pressed(slave, couplings, with_gradient);
        }
        true
    }

    /// Sums the heights above the facets around the node.
    fn gather_height(&mut self, slave: &SlaveNode, couplings: &[FacetCoupling], with_gradient: bool) {
        let columns = 3 * self.support.len();
        self.height = Vector3::zeros();
        self.height_gradient.clear();
        for &(facet, corner) in &slave.facets {
            let coupling = &couplings[facet as usize];
            if coupling.height.is_empty() || coupling.nodes.is_empty() {
                continue;
            }
            if with_gradient {
                self.height_gradient.resize(3 * columns, 0.0);
            }
            let own = 3 * coupling.nodes.len();
            for c in 0..3 {
                let row = 3 * corner as usize + c;
                self.height[c] += coupling.height[row];
                if !with_gradient {
                    continue;
                }
                for (i, &node) in coupling.nodes.iter().enumerate() {
                    let at = c * columns + 3 * self.position_of(node, i < coupling.own);
                    let from = &coupling.height_gradient[row * own + 3 * i..][..3];
                    (0..3).for_each(|d| self.height_gradient[at + d] += from[d]);
                }
            }
        }
    }

    /// Sets the normal of the frame at an edge to that of the opposite master, or to its projection
    /// onto the normal cone; if there is no master, the normal of the patch is kept.
    fn turn_to_master(
        &mut self,
        slave: &SlaveNode,
        couplings: &[FacetCoupling],
        ring: &[Vector3<f64>],
        with_gradient: bool,
    ) -> Option<()> {
        let columns = 3 * self.support.len();
        let mut facing = Vector3::zeros();
        let mut gradient = vec![0.0; if with_gradient { 3 * columns } else { 0 }];
        for &(facet, corner) in &slave.facets {
            let coupling = &couplings[facet as usize];
            if coupling.nodes.is_empty() {
                continue;
            }
            let own = 3 * coupling.nodes.len();
            for c in 0..3 {
                let row = 3 * corner as usize + c;
                facing[c] += coupling.facing[row];
                if !with_gradient {
                    continue;
                }
                let from = &coupling.facing_gradient[row * own..][..own];
                for (i, &node) in coupling.nodes.iter().enumerate() {
                    let at = c * columns + 3 * self.position_of(node, i < coupling.own);
                    (0..3).for_each(|d| gradient[at + d] += from[3 * i + d]);
                }
            }
        }
        if facing == Vector3::zeros() {
            return Some(());
        }
        if !slave.cone.is_empty() {
            project(slave, ring, &mut facing, &mut gradient)?;
        }
        self.frame.turn_to(&facing, &gradient, slave.mirrored, with_gradient)
    }

    pub(super) fn position_of(&self, node: u32, on_slave: bool) -> usize {
        if on_slave {
            self.support[..self.ring].iter().position(|&s| s == node).expect("the ring holds its facets' corners")
        } else {
            self.ring + self.support[self.ring..].binary_search(&node).expect("gathered from the same facets")
        }
    }

    /// w_j and its gradient. Positions are relative to the node itself: this is exact because Σ_s
    /// b_js = 0, and avoids cancellation if the bodies are far from the origin.
    fn form_relative(&mut self, x: &[f64], with_gradient: bool) {
        let columns = 3 * self.support.len();
        let own = position(x, self.node);
        self.relative = Vector3::zeros();
        self.area = self.coefficient[..self.ring].iter().sum();
        for (s, &node) in self.support.iter().enumerate() {
            let arm = position(x, node) - own;
            self.relative += arm * self.coefficient[s];
            if !with_gradient {
                continue;
            }
            let slope = &self.gradient[s * columns..][..columns];
            for c in 0..3 {
                let row = &mut self.relative_gradient[c * columns..][..columns];
                for (r, g) in row.iter_mut().zip(slope) {
                    *r += g * arm[c];
                }
                row[3 * s + c] += self.coefficient[s];
            }
            if s < self.ring {
                for (a, g) in self.area_gradient.iter_mut().zip(slope) {
                    *a += g;
                }
            }
        }
    }

    /// This row and frame, held fixed, for surfaces that are bonded: w_j = Σ_s b_js d_s of
    /// displacements `d` (3 per node), relative to the state in which they were bonded.
    ///
    /// Test: `a_bonded_row_measures_displacements`.
    pub fn bonded(&self, d: &[f64]) -> Self {
        let columns = 3 * self.support.len();
        let mut out = Self {
            gradient: vec![0.0; self.support.len() * columns],
            area_gradient: vec![0.0; columns],
            relative_gradient: vec![0.0; 3 * columns],
            frame: NodalFrame { gradient: Vec::new(), ..self.frame.clone() },
            own_frame: None,
            height: Vector3::zeros(),
            height_gradient: Vec::new(),
            pressed: None,
            ..self.clone()
        };
        let own = position(d, self.node);
        out.relative = Vector3::zeros();
        for (s, (&node, b)) in self.support.iter().zip(&self.coefficient).enumerate() {
            out.relative += (position(d, node) - own) * *b;
            (0..3).for_each(|c| out.relative_gradient[c * columns + 3 * s + c] = *b);
        }
        out
    }

    /// Weighted gap g̃ = −n · (w + v) between the true surfaces, ≥ 0 open. \[L³\]
    ///
    /// Paper: (22) with the full row of D; the heights v are ours. Tests: `gap_and_slip_gradients`,
    /// `gaps_between_arcs_do_not_depend_on_the_facets`.
    pub fn gap(&self) -> f64 {
        -self.frame.vector(0).dot(&(self.relative + self.height))
    }

    /// Adds `weight` ∂area/∂x to the nodal vector `out` (3 per node).
    pub fn add_area_gradient(&self, weight: f64, out: &mut [f64]) {
        for (s, &node) in self.support.iter().enumerate() {
            for c in 0..3 {
                out[3 * node as usize + c] += weight * self.area_gradient[3 * s + c];
            }
        }
    }

    /// Weighted gap of this row and frame at other positions `x` (3 per node). \[L³\]
    ///
    /// Test: `a_step_beyond_the_search_radius_is_refused` (crate slipstick, tests/suite/derivatives.rs).
    pub fn gap_at(&self, x: &[f64]) -> f64 {
        let own = position(x, self.node);
        let row = self.support.iter().zip(&self.coefficient);
        let relative: Vector3<f64> = row.map(|(&s, &b)| (position(x, s) - own) * b).sum();
        -self.frame.vector(0).dot(&(relative + self.height))
    }

    /// ∂g̃/∂x_t over the support. \[L²\]
    pub fn gap_gradient(&self, out: &mut Vec<f64>) {
        self.project_gradient(0, 1.0, &(self.relative + self.height), out);
        let normal = self.frame.vector(0);
        let columns = out.len();
        for (c, slope) in self.height_gradient.chunks_exact(columns.max(1)).enumerate() {
            out.iter_mut().zip(slope).for_each(|(out, slope)| *out -= normal[c] * slope);
        }
    }

    /// −∂(basis vector b · v)/∂x_t with ∂v = `factor` ∂w: frame and row both move.
    pub(super) fn project_gradient(&self, b: usize, factor: f64, v: &Vector3<f64>, out: &mut Vec<f64>) {
        let columns = 3 * self.support.len();
        let vector = self.frame.vector(b);
        out.clear();
        out.extend((0..columns).map(|t| {
            -factor
                * (vector[0] * self.relative_gradient[t]
                    + vector[1] * self.relative_gradient[columns + t]
                    + vector[2] * self.relative_gradient[2 * columns + t])
        }));
        for (t, value) in out.iter_mut().take(self.frame.columns()).enumerate() {
            for c in 0..3 {
                *value -= self.frame.slope(b, c, t) * v[c];
            }
        }
    }
}

/// Replaces the direction `facing`, with its gradient over the support, by its projection onto the
/// normal cone of the node; `gradient` is empty if none is wanted.
///
/// Test: `gap_and_slip_gradients` (tests/suite/kinematics.rs).
fn project(slave: &SlaveNode, ring: &[Vector3<f64>], facing: &mut Vector3<f64>, gradient: &mut [f64]) -> Option<()> {
    let normal =
        |corners: &Vec<RingCorner>, gradient: &mut [f64]| averaged_normal(ring, corners, slave.mirrored, gradient);
    let generators: Option<Vec<Vector3<f64>>> = slave.cone.iter().map(|corners| normal(corners, &mut [])).collect();
    let within = within(slave.mirrored);
    let seen = within * *facing;
    let (length, unit) = (seen.norm(), seen.normalize());
    if !(length > 0.0) {
        return None;
    }
    let projection = Projection::onto_widened(&unit, &generators?, WIDENING);
    *facing = projection.value;
    if gradient.is_empty() {
        return Some(());
    }
    let columns = gradient.len() / 3;
    let by_facing = projection.by_vector * normalisation_slope(&unit, length) * within;
    for t in 0..columns {
        let slope = by_facing * Vector3::from_fn(|c, _| gradient[c * columns + t]);
        (0..3).for_each(|c| gradient[c * columns + t] = slope[c]);
    }
    let own = 3 * ring.len();
    for (generator, by) in projection.by_generator {
        let mut of_normal = vec![0.0; 3 * own];
        normal(&slave.cone[generator], &mut of_normal)?;
        for t in 0..own {
            let slope = by * Vector3::from_fn(|c, _| of_normal[c * own + t]);
            (0..3).for_each(|c| gradient[c * columns + t] += slope[c]);
        }
    }
    Some(())
}

fn reset(values: &mut Vec<f64>, length: usize) {
    values.clear();
    values.resize(length, 0.0);
}

pub(super) fn position(x: &[f64], node: u32) -> Vector3<f64> {
    let at = 3 * node as usize;
    Vector3::new(x[at], x[at + 1], x[at + 2])
}

#[cfg(test)]
mod tests {
    use super::super::slip::{PreviousRow, SlipIncrement};
    use super::*;
    use nalgebra::Vector2;

    /// A row over three nodes, by hand: w = 2 u₀ + u₁ − 3 u₂, relative to node 0.
    #[test]
    fn a_bonded_row_measures_displacements() {
        let row = NodeKinematics {
            node: 0,
            support: vec![0, 1, 2],
            ring: 2,
            coefficient: vec![2.0, 1.0, -3.0],
            gradient: vec![7.0; 27],
            area: 3.0,
            area_gradient: vec![7.0; 9],
            relative: Vector3::new(7.0, 7.0, 7.0),
            relative_gradient: vec![7.0; 27],
            frame: NodalFrame { basis: nalgebra::Matrix3::identity(), gradient: vec![7.0; 27], across: [false; 2] },
            own_frame: None,
            height: Vector3::new(7.0, 7.0, 7.0),
            height_gradient: vec![7.0; 27],
            pressed: None,
        };
        let d = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.5, 0.1, 0.2];
        let bonded = row.bonded(&d);
        let expected = Vector3::new(0.6 - 1.5, 0.9 - 0.3, 1.2 - 0.6);
        assert!((bonded.relative - expected).norm() < 1e-15);
        assert!((bonded.gap() + expected[0]).abs() < 1e-15);
        let mut slope = Vec::new();
        bonded.gap_gradient(&mut slope);
        assert_eq!(slope, [-2.0, 0.0, 0.0, -1.0, 0.0, 0.0, 3.0, 0.0, 0.0]);
        assert!(bonded.gradient.iter().chain(&bonded.area_gradient).all(|&v| v == 0.0));
        let mut slip = SlipIncrement::default();
        bonded.slip(&PreviousRow::default(), &d, &[], true, &mut slip);
        assert!((slip.value + Vector2::new(expected[1], expected[2])).norm() < 1e-15);
        assert_eq!(slip.gradient[9..12], [0.0, 0.0, -2.0]);
        assert!(slip.previous_gradient.is_empty());
    }
}

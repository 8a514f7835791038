//! One slave node in a load step: its kinematics against the previous step, and its blocks of force
//! and tangent.

use nalgebra::{Matrix3x2, Vector2, Vector3};
use slipstick_contact::ContactStatus;
use slipstick_contact::enforcement::lagrange::Complementarity;
use slipstick_contact::enforcement::{Freedom, NodeMeasures};
use slipstick_contact::kinematics::slip::SlipIncrement;
use slipstick_contact::kinematics::{NodeKinematics, PreviousRow};

/// Constants of a slave node that its contact law depends on.
#[derive(Debug, Clone, Copy)]
pub struct NodeSettings {
    /// Area of the slave surface around the node in the reference configuration. \[L²\]
    pub reference_area: f64,
    /// Facet size around the node. \[L\]
    pub size: f64,
    /// Stiffness of the contact condition while the node is partly covered; infinite:
    /// rigid. \[F/L³\]
    pub edge_stiffness: f64,
    /// Fraction of the reference area below which the condition is compliant.
    pub edge_cover: f64,
    /// Whether multipliers enforce it; prescribed displacements can leave these without an
    /// equation.
    pub multipliers: bool,
}

/// Prescribed slip increments below this fraction of the facet size count as zero: curved facets
/// cause slip of this size.
const RESTING: f64 = 1e-6;

/// Nodes whose coefficient is below this fraction of the row's largest do not affect its gap or
/// slip.
const MOVES: f64 = 1e-9;

/// Squared component along a normal or tangent plane below which an axis is perpendicular to it.
const PERPENDICULAR: f64 = 1e-12;

/// Distance below which two nodes lie on one plane, relative to the facet size.
const SAME_PLANE: f64 = 1e-6;

/// Component of the normal along an axis beyond which slip along the axis is mostly a change of the gap.
const ACROSS: f64 = 0.5;

/// Whether supports hold the node, and nodes opposite to it, on one plane across an axis, as in plane strain with
/// several elements along the axis. As on a plane of symmetry, nothing slips across the plane: a condition there would
/// be one too many for the nodes between two such planes, and the tangent would be singular. `largest` is the row's
/// largest coefficient.
fn held_on_plane(now: &NodeKinematics, largest: f64, axis: usize, x: &[f64], fixed: &[bool]) -> bool {
    let unknown = |node: u32| 3 * node as usize + axis;
    let own = unknown(now.node);
    if !fixed[own] || now.frame.vector(0)[axis].abs() > ACROSS {
        return false;
    }
    let masters = now.support[now.ring..].iter().zip(&now.coefficient[now.ring..]);
    let mut opposite = masters.filter(|(_, b)| b.abs() > MOVES * largest).map(|(&node, _)| unknown(node));
    opposite.any(|other| fixed[other] && (x[other] - x[own]).abs() <= SAME_PLANE * largest.sqrt())
}

/// Measures of a slave node in the current step with their gradients over the union of the current
/// and the previous mortar row's support.
#[derive(Debug, Clone, Default)]
pub struct NodeStep {
    /// Global nodes: the current support, then the nodes that only the previous row has.
    pub support: Vec<u32>,
    /// Slip increment over the step. \[L³\]
    pub slip: Vector2<f64>,
    /// ∂g̃/∂x over `support`. \[L²\]
    pub gap_gradient: Vec<f64>,
    /// ∂ũ_a/∂x over `support`, one vector per component. \[L²\]
    pub slip_gradient: [Vec<f64>; 2],
    /// Whether the pair is active in the step; otherwise the node counts as uncovered.
    pub active: bool,
    /// Distance by which the surfaces touch before their meshes do, with the initial gap that counts
    /// as closed. \[L\]
    pub offset: f64,
    /// Coordinate axes along which the displacements of the row's nodes are prescribed: those of all of them, or, if
    /// supports hold both sides on a plane across the axis, of those on the plane.
    pub prescribed: [bool; 3],
    /// The axis across such a plane.
    plane: Option<usize>,
    scratch: SlipIncrement,
}

impl NodeStep {
    /// A node of a pair that is active or not, with this offset.
    pub fn of(active: bool, offset: f64) -> Self {
        Self { active, offset, ..Self::default() }
    }

    /// Evaluates slip (and gradients) against the previous row, at current positions `x` and those
    /// before the step; `fixed` marks the prescribed displacements.
    pub fn evaluate(
        &mut self,
        now: &NodeKinematics,
        previous: &PreviousRow,
        [x, x_before]: [&[f64]; 2],
        fixed: &[bool],
        with_gradient: bool,
    ) {
        let largest = now.coefficient.iter().fold(0.0, |largest: f64, b| largest.max(b.abs()));
        let moving = |axis: usize| {
            let row = now.support.iter().zip(&now.coefficient);
            row.filter(|(_, b)| b.abs() > MOVES * largest).any(|(&node, _)| !fixed[3 * node as usize + axis])
        };
        self.prescribed = std::array::from_fn(|axis| !moving(axis));
        self.plane = (0..3).find(|&axis| !self.prescribed[axis] && held_on_plane(now, largest, axis, x, fixed));
        self.plane.into_iter().for_each(|axis| self.prescribed[axis] = true);
        now.slip(previous, x, x_before, with_gradient, &mut self.scratch);
        self.slip = self.scratch.value;
        self.support.clear();
        self.support.extend_from_slice(&now.support);
        if !with_gradient {
            return;
        }
        let own = 3 * now.support.len();
        let place: Vec<usize> = previous
            .support
            .iter()
            .map(|&node| {
                self.support.iter().position(|&s| s == node).unwrap_or_else(|| {
                    self.support.push(node);
                    self.support.len() - 1
                })
            })
            .collect();
        let columns = 3 * self.support.len();
        now.gap_gradient(&mut self.gap_gradient);
        if self.offset != 0.0 {
            self.gap_gradient.iter_mut().zip(&now.area_gradient).for_each(|(g, a)| *g -= self.offset * a);
        }
        self.gap_gradient.resize(columns, 0.0);
        let before = 3 * previous.support.len();
        for (a, row) in self.slip_gradient.iter_mut().enumerate() {
            row.clear();
            row.extend_from_slice(&self.scratch.gradient[a * own..][..own]);
            row.resize(columns, 0.0);
            for (i, &s) in place.iter().enumerate() {
                for c in 0..3 {
                    row[3 * s + c] += self.scratch.previous_gradient[a * before + 3 * i + c];
                }
            }
        }
    }

    /// Weighted gap between the offset surfaces. \[L³\]
    fn gap(&self, now: &NodeKinematics) -> f64 {
        now.gap() - self.offset * now.area
    }

    /// The measures that the contact laws use. The penalty method needs no [`Freedom`]: its
    /// traction follows from the slip, prescribed or not.
    pub fn measures(&self, now: &NodeKinematics, settings: &NodeSettings) -> NodeMeasures {
        let &NodeSettings { reference_area, size, edge_stiffness, edge_cover, multipliers } = settings;
        NodeMeasures {
            gap: self.gap(now),
            slip: self.slip,
            area: if self.active { now.area } else { 0.0 },
            reference_area,
            edge_stiffness,
            edge_cover,
            load: now.pressed.as_ref().map(|pressed| pressed.load),
            freedom: if multipliers { self.freedom(now, RESTING * size * now.area) } else { Freedom::Full },
        }
    }

    /// The measures that free displacements of the row's nodes can change. These change w_j along
    /// the axes that are not prescribed; the part of this change that leaves the gap closed is
    /// slip.
    ///
    /// With one prescribed axis k, this is the slip perpendicular to the tangential part of k; with
    /// two, there is no slip, unless the free axes do not change the gap. The prescribed slip is
    /// the remainder when the free axes close the present gap. If nothing slips at present, as in a
    /// step without motion, it is zero, whatever gap a compliant condition leaves. Across a plane on which supports
    /// hold both sides, nothing slips.
    fn freedom(&self, now: &NodeKinematics, resting: f64) -> Freedom {
        let normal = now.frame.vector(0);
        let count = self.prescribed.iter().filter(|&&p| p).count();
        let axis = |wanted: bool| self.prescribed.iter().position(|&p| p == wanted);
        match (count, axis(true), axis(false)) {
            (0, ..) => Freedom::Full,
            (1, Some(axis), _) => match self.prescribed_direction(now) {
                None => Freedom::None,
                Some((direction, length)) => {
                    let present = direction.dot(&self.slip);
                    let slip = present + self.gap(now) * normal[axis] / length;
                    let driven = self.plane.is_none() && slip.abs().min(present.abs()) > resting;
                    Freedom::SlipAcross { direction, driven }
                }
            },
            (2, _, Some(axis)) if normal[axis] * normal[axis] > PERPENDICULAR => {
                let along = Vector2::new(now.frame.vector(1)[axis], now.frame.vector(2)[axis]);
                let of_plane = |axis: usize| Vector2::new(now.frame.vector(1)[axis], now.frame.vector(2)[axis]);
                let across = self.plane.map_or_else(Vector2::zeros, |axis| of_plane(axis).normalize());
                let present = self.slip - across * across.dot(&self.slip);
                let slip = present - along * (self.gap(now) / normal[axis]);
                Freedom::Gap { driven: slip.norm().min(present.norm()) > resting }
            }
            _ => Freedom::None,
        }
    }

    /// Tangential part of the one prescribed axis, as a unit vector in the tangent basis, and its
    /// original length; `None` if the axis is normal to the surface.
    fn prescribed_direction(&self, now: &NodeKinematics) -> Option<(Vector2<f64>, f64)> {
        let axis = self.prescribed.iter().position(|&p| p)?;
        let along = Vector2::new(now.frame.vector(1)[axis], now.frame.vector(2)[axis]);
        let length = along.norm();
        (length * length > PERPENDICULAR).then(|| (along / length, length))
    }

    /// Adds `weight`ᵀ ∂a/∂x to a row over the support, where a is the direction of
    /// [`Freedom::SlipAcross`].
    fn add_direction_row(&self, now: &NodeKinematics, weight: Vector2<f64>, out: &mut [f64]) {
        let Some((direction, length)) = self.prescribed_direction(now).filter(|_| weight != Vector2::zeros()) else {
            return;
        };
        let axis = self.prescribed.iter().position(|&p| p).expect("it has a direction");
        let weight = (weight - direction * direction.dot(&weight)) / length;
        for (t, out) in out.iter_mut().enumerate().take(now.frame.columns()) {
            *out += weight[0] * now.frame.slope(1, axis, t) + weight[1] * now.frame.slope(2, axis, t);
        }
    }

    /// Row of ∂(law)/∂x for a law component with the given partial derivatives with respect to gap,
    /// slip, and area and load.
    fn law_row(
        &self,
        now: &NodeKinematics,
        by_gap: f64,
        by_slip: [f64; 2],
        [by_area, by_load]: [f64; 2],
        out: &mut Vec<f64>,
    ) {
        out.clear();
        if !self.active {
            return out.resize(self.gap_gradient.len(), 0.0);
        }
        out.extend((0..self.gap_gradient.len()).map(|t| {
            by_gap * self.gap_gradient[t]
                + by_slip[0] * self.slip_gradient[0][t]
                + by_slip[1] * self.slip_gradient[1][t]
        }));
        if by_area != 0.0 {
            out.iter_mut().zip(&now.area_gradient).for_each(|(o, g)| *o += by_area * g);
        }
        if let Some(pressed) = now.pressed.as_ref().filter(|_| by_load != 0.0) {
            out.iter_mut().zip(&pressed.load_gradient).for_each(|(o, g)| *o += by_load * g);
        }
    }
}

/// A node's traction in its frame, and how it depends on the measures. For the Lagrange method ζ is
/// a separate unknown and all partial derivatives vanish.
#[derive(Debug, Clone, Copy)]
pub struct NodeTraction {
    /// Status of the node.
    pub status: ContactStatus,
    /// ζ = (ζ_n, ζ_ξ, ζ_η). \[F/L²\]
    pub value: Vector3<f64>,
    /// ∂ζ/∂g̃.
    pub by_gap: Vector3<f64>,
    /// ∂ζ/∂ũ.
    pub by_slip: Matrix3x2<f64>,
    /// ∂ζ/∂A.
    pub by_area: Vector3<f64>,
    /// ∂ζ/∂P.
    pub by_load: Vector3<f64>,
    /// ∂ζ/∂a, where a is the direction of prescribed slip.
    pub by_direction: Matrix3x2<f64>,
}

/// Adds the node's contact force f_s = b_js z_j to `out`, with z_j assembled from its components.
///
/// Paper: (17), (19), (42), (43), (52). Test: `forces_balance` (tests/suite/invariance.rs).
pub fn add_force(now: &NodeKinematics, traction: &Vector3<f64>, out: &mut [f64]) {
    if *traction == Vector3::zeros() {
        return;
    }
    let z = now.frame.to_global(traction);
    for (&node, b) in now.support.iter().zip(now.force_row().0) {
        for c in 0..3 {
            out[3 * node as usize + c] += b * z[c];
        }
    }
}

/// ∂z_c/∂x_t of the node's traction z = Σ_b (frame)_b ζ_b, row by row over the step's support.
pub fn traction_slope(now: &NodeKinematics, step: &NodeStep, traction: &NodeTraction) -> Vec<f64> {
    let columns = 3 * step.support.len();
    let mut slope = vec![0.0; 3 * columns];
    let mut row = Vec::new();
    for b in 0..3 {
        step.law_row(
            now,
            traction.by_gap[b],
            [traction.by_slip[(b, 0)], traction.by_slip[(b, 1)]],
            [traction.by_area[b], traction.by_load[b]],
            &mut row,
        );
        step.add_direction_row(now, traction.by_direction.row(b).transpose(), &mut row);
        let vector = now.frame.vector(b);
        for c in 0..3 {
            let target = &mut slope[c * columns..][..columns];
            for t in 0..columns {
                target[t] += vector[c] * row[t];
            }
            for t in 0..now.frame.columns() {
                target[t] += now.frame.slope(b, c, t) * traction.value[b];
            }
        }
    }
    slope
}

/// ∂C/∂x_t through gap, slip, area and the direction of prescribed slip, one row per component of
/// C.
pub fn condition_slopes(now: &NodeKinematics, step: &NodeStep, law: &Complementarity) -> [Vec<f64>; 3] {
    let mut rows: [Vec<f64>; 3] = Default::default();
    for b in 0..3 {
        let by_slip = [law.by_slip[(b, 0)], law.by_slip[(b, 1)]];
        step.law_row(now, law.by_gap[b], by_slip, [law.by_area[b], 0.0], &mut rows[b]);
        step.add_direction_row(now, law.by_direction.row(b).transpose(), &mut rows[b]);
    }
    rows
}

/// The node's local relative adjoint displacement p_b = (frame)_b · Σ_s b_js λ_s: how λᵀ R depends
/// on ζ.
pub fn relative_adjoint(now: &NodeKinematics, lambda: &[f64]) -> Vector3<f64> {
    let mut relative = Vector3::zeros();
    for (&node, b) in now.support.iter().zip(now.force_row().0) {
        let at = 3 * node as usize;
        relative += Vector3::new(lambda[at], lambda[at + 1], lambda[at + 2]) * *b;
    }
    now.frame.basis * relative
}

/// Adds Σ_b weight_b ∂ζ_b/∂x: the pull-back of a traction through gap, slip and area.
pub fn add_traction_pull_back(
    now: &NodeKinematics,
    step: &NodeStep,
    traction: &NodeTraction,
    weight: &Vector3<f64>,
    out: &mut [f64],
) {
    let by_gap = weight.dot(&traction.by_gap);
    let by_slip = traction.by_slip.tr_mul(weight);
    let by = [weight.dot(&traction.by_area), weight.dot(&traction.by_load)];
    let mut row = Vec::new();
    step.law_row(now, by_gap, [by_slip[0], by_slip[1]], by, &mut row);
    step.add_direction_row(now, traction.by_direction.tr_mul(weight), &mut row);
    for (t, &node) in step.support.iter().enumerate() {
        for c in 0..3 {
            out[3 * node as usize + c] += row[3 * t + c];
        }
    }
}

/// Adds the pull-back of weighted gap, slip and area of a node with given weights.
pub fn add_measures_pull_back(
    now: &NodeKinematics,
    step: &NodeStep,
    by_gap: f64,
    by_slip: [f64; 2],
    by_area: f64,
    out: &mut [f64],
) {
    let mut row = Vec::new();
    step.law_row(now, by_gap, by_slip, [by_area, 0.0], &mut row);
    for (t, &node) in step.support.iter().enumerate() {
        for c in 0..3 {
            out[3 * node as usize + c] += row[3 * t + c];
        }
    }
}

/// Adds the pull-back of the vector z = Σ_b (frame)_b ζ_b with weights `by_vector`, through the
/// frame at fixed ζ.
pub fn add_frame_pull_back(now: &NodeKinematics, multiplier: &Vector3<f64>, by_vector: &Vector3<f64>, out: &mut [f64]) {
    for t in 0..now.frame.columns() {
        let node = now.support[t / 3] as usize;
        for b in 0..3 {
            for c in 0..3 {
                out[3 * node + t % 3] += by_vector[c] * now.frame.slope(b, c, t) * multiplier[b];
            }
        }
    }
}

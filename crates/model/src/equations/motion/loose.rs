//! Rigid motions that neither supports nor closed contact restrain.
//!
//! In a step that [holds](slipstick_path::HoldFreeMotions) such motions, springs tie as
//! many mean motions of the bodies as there are free motions to their values before the step:
//!
//! ```text
//! R = … + κ Σ_f ℓ_f ℓ_fᵀ (d − d_n−1)
//! ```
//!
//! ℓ_f d is the mean translation or rotation of a body, the rigid motion in the reference configuration
//! that is closest to the displacements of the nodes at the corners of the body. The free motions are known
//! from the status: with the rigid motions φ_k of the bodies, they are the null space of all
//! conditions of supports, springs, ties and closed nodes on Σ q_k φ_k. The mean motions f are those that
//! determine the free motions best (pivoted elimination). In equilibrium R has no component along a
//! free motion, so the springs carry no force: the original equations hold, whatever κ is, and ℓ_f d =
//! ℓ_f d_n−1, so a body stays where it was. Motions that are nearly free are held too, with a force that
//! is part of the equations. A state in which it is more than a small share of the forces is refused:
//! nothing would hold that body. As ℓ_f is constant, the derivatives are those of linear springs.

use crate::equations::dependent::Dependent;
use crate::equations::evaluated::{ContactState, Step};
use crate::equations::terms::{ForceTerm, TermState};
use crate::equations::{ContactModel, Design};
use nalgebra::{DMatrix, Vector3};
use slipstick_contact::ContactStatus;
use slipstick_linalg::BlockMatrix;
use slipstick_mesh::Mesh;
use slipstick_path::{Evaluated, StateError};
use std::ops::Range;

/// Fraction of the largest eigenvalue of the conditions below which a rigid motion counts as free.
const HELD: f64 = 1e-10;

/// Largest rate at which a nearly free motion violates a condition, relative to the motion: about the
/// slope of a dent in a flat surface. A slope does resist sliding, but so little that the state would be
/// ill-conditioned.
const NEARLY: f64 = 0.03;

/// κ relative to the product of modulus and element size.
const STIFFNESS: f64 = 1.0;

/// A displacement replaces another as the one that determines a motion best only if it is better by
/// this factor, so that round-off does not decide between equals.
const BETTER: f64 = 1.001;

/// Largest force on the springs, relative to the forces in equilibrium.
const BALANCED: f64 = 1e-3;

/// The bodies that supports alone do not hold.
#[derive(Debug, Clone, Default)]
pub(in crate::equations) struct LooseBodies {
    pub(in crate::equations) bodies: Vec<LooseBody>,
    /// κ. \[F/L\]
    stiffness: f64,
}

#[derive(Debug, Clone)]
pub(in crate::equations) struct LooseBody {
    pub(in crate::equations) name: String,
    pub(in crate::equations) nodes: Range<usize>,
    /// The unknowns that move it: those of its nodes, or the six of a rigid body.
    pub(in crate::equations) unknowns: Range<usize>,
    rigid: bool,
    /// Centre and extent in the reference configuration.
    centre: Vector3<f64>,
    length: f64,
    /// Nodes at its corners, or those with the unknowns of a rigid body.
    anchors: Vec<u32>,
    /// The anchors, and the nodes on which they depend.
    coupled: Vec<u32>,
    /// ℓ of its six mean motions: the weights of the anchors' displacements.
    means: [Vec<f64>; 6],
}

/// The free motions at a state.
#[derive(Debug, Clone, Default)]
pub(in crate::equations) struct FreeMotions {
    /// The mean motions that are held.
    held: Vec<usize>,
    /// An orthonormal basis of the free motions q, six rows for each loose body.
    pub(in crate::equations) basis: Option<DMatrix<f64>>,
}

impl LooseBodies {
    /// The loose bodies of a mesh; `force` is the product of modulus and element size. \[F/L\]
    pub(in crate::equations) fn new(mesh: &Mesh, dependent: &Dependent, fixed: &[bool], force: f64) -> Self {
        let fixed = &dependent.linear.truly_fixed(fixed);
        let mut bodies = Vec::new();
        for (b, body) in mesh.bodies.iter().enumerate() {
            let rigid = mesh.rigid.iter().find(|rigid| rigid.body == b).map(|rigid| rigid.reference as usize);
            let nodes = body.nodes.clone();
            let unknowns = rigid.map_or(3 * nodes.start..3 * nodes.end, |at| 3 * at..3 * at + 6);
            let points = || mesh.nodes[nodes.clone()].iter().map(|x| Vector3::from(*x));
            let centre = points().sum::<Vector3<f64>>() / nodes.len().max(1) as f64;
            let length = points().map(|x| (x - centre).norm()).fold(f64::MIN_POSITIVE, f64::max);
            let (name, rigid, means) = (body.name.clone(), rigid.is_some(), Default::default());
            let (anchors, coupled) = (Vec::new(), Vec::new());
            let mut loose = LooseBody { name, nodes, unknowns, rigid, centre, length, anchors, coupled, means };
            if loose.is_free(mesh, fixed) {
                loose.set_means(mesh);
                loose.coupled.clone_from(&loose.anchors);
                dependent.linear.add_sources(&mut loose.coupled);
                bodies.push(loose);
            }
        }
        Self { bodies, stiffness: STIFFNESS * force }
    }

    pub(in crate::equations) fn is_empty(&self) -> bool {
        self.bodies.is_empty()
    }
}

impl LooseBody {
    /// The end of the unknowns that are translations.
    pub(in crate::equations) fn translations_end(&self) -> usize {
        if self.rigid { self.unknowns.start + 3 } else { self.unknowns.end }
    }

    fn is_free(&self, mesh: &Mesh, fixed: &[bool]) -> bool {
        if self.rigid {
            return fixed[self.unknowns.clone()].contains(&false);
        }
        let mut gram = DMatrix::<f64>::zeros(6, 6);
        for i in self.unknowns.clone().filter(|&i| fixed[i]) {
            let x = Vector3::from(mesh.nodes[i / 3]);
            let row: Vec<f64> = (0..6).map(|k| self.mode(k, &x)[i % 3]).collect();
            add_condition(&mut gram, &row);
        }
        !free_of(gram, |_| false).is_empty()
    }

    fn set_means(&mut self, mesh: &Mesh) {
        if self.rigid {
            self.anchors = vec![self.unknowns.start as u32 / 3, self.unknowns.start as u32 / 3 + 1];
            self.means = std::array::from_fn(|k| (0..6).map(|l| f64::from(u8::from(k == l))).collect());
            return;
        }
        let at = |node: usize| Vector3::from(mesh.nodes[node]);
        let points = self.nodes.clone().map(at);
        let (low, high) = points.fold((self.centre, self.centre), |(low, high), x| (low.inf(&x), high.sup(&x)));
        let corner = |k: usize| Vector3::from_fn(|c, _| if k >> c & 1 == 0 { low[c] } else { high[c] });
        let distance = |node: usize, k: usize| (at(node) - corner(k)).norm();
        let nearest = |k: usize| {
            self.nodes.clone().fold(self.nodes.start, |best, node| {
                if BETTER * distance(node, k) < distance(best, k) { node } else { best }
            })
        };
        self.anchors = (0..8).map(|k| nearest(k) as u32).collect();
        self.anchors.sort_unstable();
        self.anchors.dedup();
        let rows = 3 * self.anchors.len();
        let phi = DMatrix::from_fn(rows, 6, |i, k| self.mode(k, &at(self.anchors[i / 3] as usize))[i % 3]);
        let inverse = phi.pseudo_inverse(HELD.sqrt()).unwrap_or_else(|_| DMatrix::zeros(6, rows));
        self.means = std::array::from_fn(|k| inverse.row(k).iter().copied().collect());
    }

    /// Rigid motion k of a point at `x`: a translation, or a rotation about the centre.
    fn mode(&self, k: usize, x: &Vector3<f64>) -> Vector3<f64> {
        let mut axis = Vector3::zeros();
        axis[k % 3] = 1.0;
        if k < 3 { axis } else { axis.cross(&((x - self.centre) / self.length)) }
    }
}

pub(in crate::equations) fn add_condition(gram: &mut DMatrix<f64>, row: &[f64]) {
    let filled: Vec<usize> = (0..row.len()).filter(|&k| row[k] != 0.0).collect();
    for &k in &filled {
        filled.iter().for_each(|&l| gram[(k, l)] += row[k] * row[l]);
    }
}

/// A basis of the null space of the conditions, and of the principal motions that are `nearly` in it.
pub(in crate::equations) fn free_of(gram: DMatrix<f64>, nearly: impl Fn(&[f64]) -> bool) -> DMatrix<f64> {
    let n = gram.nrows();
    let largest = gram.diagonal().iter().copied().fold(0.0, f64::max);
    if largest == 0.0 {
        return DMatrix::identity(n, n);
    }
    let eigen = gram.symmetric_eigen();
    let free = |i: &usize| {
        eigen.eigenvalues[*i] <= HELD * largest || nearly(eigen.eigenvectors.column(*i).into_owned().as_slice())
    };
    let free: Vec<usize> = (0..n).filter(free).collect();
    DMatrix::from_fn(n, free.len(), |row, column| eigen.eigenvectors[(row, free[column])])
}

impl LooseBodies {
    /// The displacements on which mean motion f depends, with their weights.
    fn weights(&self, f: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let body = &self.bodies[f / 6];
        let weights = &body.means[f % 6];
        let dofs = body.anchors.iter().flat_map(|&node| (0..3).map(move |c| 3 * node as usize + c));
        dofs.zip(weights.iter().copied()).filter(|(_, weight)| *weight != 0.0)
    }

    /// Mean motion f of displacements.
    fn mean(&self, f: usize, displacement: impl Fn(usize) -> f64) -> f64 {
        self.weights(f).map(|(i, weight)| weight * displacement(i)).sum()
    }

    /// Force of the spring that holds mean motion f.
    fn holding_force(&self, step: &Step, y: &[f64], f: usize) -> f64 {
        step.anchor.as_ref().map_or(0.0, |anchor| self.stiffness * self.mean(f, |i| y[i] - anchor[i]))
    }

    /// The mean motions that springs of this rank hold.
    fn held<'a>(at: &TermState<'a>) -> impl Iterator<Item = (&'a Step, usize)> {
        let held = at.step.filter(|_| at.model().share.has_rest());
        held.into_iter().flat_map(|(step, free)| free.held.iter().map(move |&f| (step, f)))
    }
}

/// The springs that hold free motions.
impl ForceTerm for LooseBodies {
    fn add_force(&self, at: TermState<'_>, out: &mut [f64]) {
        for (step, f) in Self::held(&at) {
            let force = self.holding_force(step, at.y, f);
            self.weights(f).for_each(|(i, weight)| out[i] += force * weight);
        }
    }

    fn add_tangent(&self, at: TermState<'_>, matrix: &mut BlockMatrix) {
        for (_, f) in Self::held(&at) {
            for (i, weight) in self.weights(f) {
                for (j, other) in self.weights(f) {
                    let mut block = [0.0; 9];
                    block[3 * (i % 3) + j % 3] = self.stiffness * weight * other;
                    matrix.add(i / 3, j / 3, &block);
                }
            }
        }
    }

    fn pull_back_previous(&self, at: TermState<'_>, lambda: &[f64], out: &mut [f64]) {
        for (_, f) in Self::held(&at) {
            let along = self.stiffness * self.mean(f, |i| lambda[i]);
            self.weights(f).for_each(|(i, weight)| out[i] -= along * weight);
        }
    }
}

impl ContactModel {
    /// The rigid motions of the loose bodies at y, six for each: the displacements of all nodes, and
    /// the unknowns of rigid bodies.
    pub(in crate::equations) fn rigid_motions(&self, y: &[f64]) -> Vec<Vec<f64>> {
        let x = self.positions(y);
        let mut modes = Vec::with_capacity(6 * self.loose.bodies.len());
        for body in &self.loose.bodies {
            for k in 0..6 {
                let mut mode = vec![0.0; self.displacement_count()];
                if body.rigid {
                    mode[body.unknowns.start + k] = 1.0;
                    self.dependent.rigid.spread(y, &mut mode);
                } else {
                    for node in body.nodes.clone() {
                        let at = Vector3::from_column_slice(&x[3 * node..][..3]);
                        mode[3 * node..][..3].copy_from_slice(body.mode(k, &at).as_slice());
                    }
                }
                modes.push(mode);
            }
        }
        modes
    }

    /// Whether there are bodies that supports alone do not hold. Viscosity holds them already.
    pub fn may_move_freely(&self) -> bool {
        !self.loose.is_empty() && self.viscosity.is_none()
    }

    /// The free motions at a state, also those that are nearly free if asked for.
    pub(in crate::equations) fn free_motions(
        &self,
        step: &Step,
        y: &[f64],
        contact: &ContactState,
        nearly: bool,
    ) -> FreeMotions {
        let modes = self.rigid_motions(y);
        let mut rows: Vec<Vec<f64>> = Vec::new();
        let at_points: Vec<_> = modes.iter().map(|mode| self.contact_vector(mode)).collect();
        for (_, now, node) in contact.nodes_here() {
            for direction in self.restrained(now.frame.vector(0), |b| now.frame.vector(b), node) {
                let along = |mode: &[f64]| -> f64 {
                    let terms = now.support.iter().zip(&now.coefficient);
                    terms.map(|(&s, b)| b * direction.dot(&vector(mode, s as usize))).sum::<f64>() / now.area
                };
                rows.push(at_points.iter().map(|mode| along(mode)).collect());
            }
        }
        if self.share.has_rest() {
            rows.extend(self.restraints(y, &modes, self.held_for_now(step)));
        }
        rows.retain(|row| row.iter().all(|value| value.is_finite()));
        let mut gram = DMatrix::zeros(modes.len(), modes.len());
        rows.iter().for_each(|row| add_condition(&mut gram, row));
        self.share.sum(&mut [gram.as_mut_slice()]);
        let violation = |q: &[f64]| {
            let rates = rows.iter().map(|row| row.iter().zip(q).map(|(r, q)| r * q).sum::<f64>().abs());
            self.share.largest(rates.fold(0.0, f64::max))
        };
        let basis = free_of(gram, |q| nearly && violation(q) <= NEARLY);
        if basis.ncols() == 0 {
            return FreeMotions::default();
        }
        let held = self.determining(&modes, &basis);
        FreeMotions { held, basis: Some(basis) }
    }

    /// The directions in which a slave node's condition restrains the relative motion.
    fn restrained(
        &self,
        normal: Vector3<f64>,
        vector: impl Fn(usize) -> Vector3<f64>,
        node: &crate::equations::NodeState,
    ) -> Vec<Vector3<f64>> {
        match node.law.status() {
            ContactStatus::Inactive => Vec::new(),
            ContactStatus::Stick => vec![normal, vector(1), vector(2)],
            ContactStatus::Slip => {
                // friction turns with the direction of slip
                let traction = node.law.value();
                let size = traction[1].hypot(traction[2]);
                let across = (vector(1) * -traction[2] + vector(2) * traction[1]) / size;
                if size > self.floors.multiplier { vec![normal, across] } else { vec![normal] }
            }
        }
    }

    /// As many mean motions as there are free motions, which they determine.
    fn determining(&self, modes: &[Vec<f64>], basis: &DMatrix<f64>) -> Vec<usize> {
        let means = 6 * self.loose.bodies.len();
        let m = basis.ncols();
        let mut rows: Vec<Vec<f64>> = (0..means)
            .map(|f| {
                let of_modes: Vec<f64> = modes.iter().map(|mode| self.loose.mean(f, |i| mode[i])).collect();
                (0..m).map(|c| of_modes.iter().enumerate().map(|(k, v)| v * basis[(k, c)]).sum()).collect()
            })
            .collect();
        let norm = |row: &[f64]| row.iter().map(|v| v * v).sum::<f64>().sqrt();
        let mut held = Vec::new();
        for _ in 0..m {
            let mut best = (0.0, None);
            for (at, row) in rows.iter().enumerate() {
                let size = norm(row);
                if size > BETTER * best.0 {
                    best = (size, Some(at));
                }
            }
            let (size, Some(at)) = best else { break };
            if size < HELD.sqrt() {
                break;
            }
            held.push(at);
            let pivot: Vec<f64> = rows[at].iter().map(|v| v / size).collect();
            for row in &mut rows {
                let along: f64 = row.iter().zip(&pivot).map(|(a, b)| a * b).sum();
                row.iter_mut().zip(&pivot).for_each(|(r, p)| *r -= along * p);
            }
        }
        held
    }

    /// The residual without the springs' forces.
    pub(in crate::equations) fn without_holding(&self, step: &Step, at: &Evaluated<Design>) -> Vec<f64> {
        let mut out = at.residual.clone();
        for &f in &at.state.free.held {
            let force = self.loose.holding_force(step, &at.unknowns, f);
            self.loose.weights(f).for_each(|(i, weight)| out[i] -= force * weight);
        }
        out
    }

    /// The nodes that the springs couple, body by body. The list is empty if the step holds no motion.
    pub(in crate::equations) fn holding_couplings(&self, free: &FreeMotions) -> Vec<&[u32]> {
        let bodies = self.loose.bodies.iter().filter(|_| !free.held.is_empty());
        bodies.map(|body| body.coupled.as_slice()).collect()
    }

    /// Norm of the springs' forces. \[F\]
    fn holding_size(&self, step: &Step, at: &Evaluated<Design>) -> f64 {
        let square = |&f: &usize| {
            let force = self.loose.holding_force(step, &at.unknowns, f);
            self.loose.weights(f).map(|(_, weight)| (force * weight).powi(2)).sum::<f64>()
        };
        at.state.free.held.iter().map(square).sum::<f64>().sqrt()
    }

    /// Norm of the springs' forces relative to the forces in equilibrium.
    pub(in crate::equations) fn holding_share(&self, step: &Step, at: &Evaluated<Design>) -> f64 {
        let size = self.holding_size(step, at);
        if size > 0.0 { size / at.scales.force } else { 0.0 }
    }

    /// Work that the springs take in the step, in which they move under their force at its end: they are
    /// attached again before the next step. \[F L\]
    pub(in crate::equations) fn holding_work(&self, step: &Step, at: &Evaluated<Design>) -> f64 {
        let work = |&f: &usize| self.loose.holding_force(step, &at.unknowns, f).powi(2) / self.loose.stiffness;
        at.state.free.held.iter().map(work).sum()
    }

    /// Checks that the springs carry almost no force.
    ///
    /// # Errors
    /// [`StateError::Unheld`].
    pub(in crate::equations) fn check_held(&self, step: &Step, at: &Evaluated<Design>) -> Result<(), StateError> {
        let free = &at.state.free;
        let Some(basis) = &free.basis else { return Ok(()) };
        if self.holding_size(step, at) <= BALANCED * at.scales.force {
            return Ok(());
        }
        let forces: Vec<(usize, f64)> =
            free.held.iter().map(|&f| (f, self.loose.holding_force(step, &at.unknowns, f))).collect();
        let modes = self.rigid_motions(&at.unknowns);
        let load: Vec<f64> = modes
            .iter()
            .map(|mode| forces.iter().map(|&(f, force)| force * self.loose.mean(f, |i| mode[i])).sum())
            .collect();
        let q = basis * (basis.transpose() * DMatrix::from_column_slice(load.len(), 1, &load));
        let of = |b: usize| q.rows(6 * b, 6).norm();
        let body = (0..self.loose.bodies.len()).fold(0, |best, b| if of(b) > 1.001 * of(best) { b } else { best });
        let part = |from: usize| Vector3::new(q[6 * body + from], q[6 * body + from + 1], q[6 * body + from + 2]);
        let (shift, turn) = (part(0), part(3));
        let motion = match shift.norm() >= 1e-3 * turn.norm() {
            true => format!("along {}", words(&shift)),
            false => format!("about {}", words(&turn)),
        };
        let (turns, body) = (shift.norm() < 1e-3 * turn.norm(), &self.loose.bodies[body]);
        let along = if turns { turn.iamax() } else { shift.iamax() };
        let unknown = 3 * body.anchors[usize::from(body.rigid && turns)] as usize + along;
        let slides = at.state.nodes_here().any(|(_, _, node)| {
            let traction = node.law.value();
            node.law.status() == ContactStatus::Slip && traction[1].hypot(traction[2]) > self.floors.multiplier
        });
        let slides = self.share.largest(f64::from(u8::from(slides))) > 0.0;
        Err(StateError::Unheld { body: body.name.clone(), motion, unknown, slides })
    }

    /// The motions of each loose body that are free at a state, in words: `x and rotation about y of body
    /// "block"`.
    pub fn motions_left_free(&self, at: &ContactState) -> Vec<String> {
        let Some(basis) = &at.free.basis else { return Vec::new() };
        let free = |k: usize| basis.row(k).norm() > 0.3;
        let of = |(b, body): (usize, &LooseBody)| {
            let axes = |from: usize| -> Vec<&str> {
                (0..3).filter(|c| free(6 * b + from + c)).map(|c| ["x", "y", "z"][c]).collect()
            };
            let (along, about) = (axes(0), axes(3));
            let parts = [("along", along), ("about", about)];
            let words: Vec<String> = parts
                .into_iter()
                .filter(|(_, axes)| !axes.is_empty())
                .map(|(how, axes)| format!("{how} {}", axes.join(", ")))
                .collect();
            (!words.is_empty()).then(|| format!("`{}` {}", body.name, words.join(" and ")))
        };
        self.loose.bodies.iter().enumerate().filter_map(of).collect()
    }
}

/// `−y`, or a unit vector.
fn words(direction: &Vector3<f64>) -> String {
    let unit = direction / direction.norm();
    match (0..3).find(|&c| unit[c].abs() > 1.0 - 1e-6) {
        Some(c) => format!("{}{}", if unit[c] < 0.0 { "−" } else { "" }, ["x", "y", "z"][c]),
        None => format!("({:.3}, {:.3}, {:.3})", unit[0], unit[1], unit[2]),
    }
}

fn vector(v: &[f64], node: usize) -> Vector3<f64> {
    Vector3::from_column_slice(&v[3 * node..][..3])
}

//! Bolts: the two parts of a body on both sides of a [cut](slipstick_mesh::Cut) are pulled together by a given
//! force; then the distance by which they overlap is kept.
//!
//! ```text
//! u_copy = u_node − δ n                     at the nodes of the section, as linear equations
//! R_δ = T − P(t)                            while the bolt is tightened, with the tension T of the section
//! R_δ = T − P_end + k (δ_n − δ_n−1)         afterwards
//! ```
//!
//! k is so large that δ changes by (P − T)/k in each step, a millionth of the distance by which P − T would stretch
//! the body. In equilibrium, T is the force of the bolt, and the derivatives are exact for this k.

use crate::equations::evaluated::Step;
use crate::equations::terms::{ForceTerm, TermState};
use crate::equations::{ContactModel, LoadTime, Share};
use schemars::JsonSchema;
use serde::Serialize;
use slipstick_linalg::BlockMatrix;
use slipstick_path::Span;

/// k, relative to E A/L of the body.
const STIFF: f64 = 1e6;

/// Pseudo-times closer than this are equal.
const SAME_TIME: f64 = 1e-9;

/// What happens to a bolt after its last waypoint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Keeps {
    /// The parts keep their distance: a bolt.
    Length,
    /// The force stays as it is: a hydraulic tensioner.
    Force,
}

/// The force of a bolt at a pseudo-time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct PreloadPoint {
    /// Pseudo-time, 0 < t ≤ 1, increasing.
    pub t: f64,
    /// Force, ≥ 0 in tension. \[F\]
    pub force: f64,
}

/// A bolt.
#[derive(Debug, Clone, PartialEq)]
pub struct Bolt {
    /// Its name.
    pub name: String,
    /// Number of its body.
    pub body: usize,
    /// The unknown δ: the first of the reference node of its cut.
    pub unknown: u32,
    /// E A/L: modulus times area of the section, over the length of the body along the bolt. \[F/L\]
    pub stiffness: f64,
    /// Waypoints of the force, linear in between, from 0 at t = 0.
    pub preload: Vec<PreloadPoint>,
    /// What happens after the last one.
    pub keeps: Keeps,
}

/// The force at pseudo-time `t`: piecewise linear through (0, 0) and the waypoints. \[F\]
pub fn preload_at(preload: &[PreloadPoint], t: f64) -> f64 {
    let mut last = PreloadPoint { t: 0.0, force: 0.0 };
    for &next in preload {
        if t <= next.t {
            let s = ((t - last.t) / (next.t - last.t)).clamp(0.0, 1.0);
            return if s == 1.0 { next.force } else { last.force + s * (next.force - last.force) };
        }
        last = next;
    }
    last.force
}

impl Bolt {
    /// P. \[F\]
    pub fn preload_at(&self, t: f64) -> f64 {
        preload_at(&self.preload, t)
    }

    /// Whether a step that starts at pseudo-time `t` keeps its length.
    fn is_kept(&self, t: f64) -> bool {
        self.keeps == Keeps::Length && self.preload.last().is_none_or(|last| t >= last.t - SAME_TIME)
    }

    fn kept_stiffness(&self) -> f64 {
        STIFF * self.stiffness
    }
}

/// The bolts of a model.
#[derive(Debug, Clone, Default)]
pub struct Bolts {
    all: Vec<Bolt>,
}

impl Bolts {
    /// These bolts.
    pub fn new(all: Vec<Bolt>) -> Self {
        Self { all }
    }

    /// The bolts.
    pub fn list(&self) -> &[Bolt] {
        &self.all
    }

    /// Whether an unknown is the δ of a bolt.
    pub fn has_unknown(&self, unknown: usize) -> bool {
        self.all.iter().any(|bolt| bolt.unknown as usize == unknown)
    }

    /// Adds the diagonal of their unknowns to the rows of a part of the model, if this part has the bolts.
    pub(in crate::equations) fn couple(&self, rows: &mut [Vec<u32>], share: &Share) {
        for node in self.all.iter().filter(|_| share.has_rest()).map(|bolt| bolt.unknown / 3) {
            rows[node as usize].push(node);
        }
    }

    /// Forces relative to their largest magnitudes, which say whether the path continues as before.
    pub(in crate::equations) fn factors(&self, time: LoadTime) -> impl Iterator<Item = f64> + '_ {
        let largest =
            |bolt: &Bolt| bolt.preload.iter().map(|point| point.force.abs()).fold(f64::MIN_POSITIVE, f64::max);
        self.all.iter().map(move |bolt| bolt.preload_at(time.t) / largest(bolt))
    }

    /// Largest force of all bolts. \[F\]
    pub(in crate::equations) fn largest(&self) -> f64 {
        self.all.iter().flat_map(|bolt| &bolt.preload).map(|point| point.force.abs()).fold(0.0, f64::max)
    }

    /// Force Σ k |δ| of the bolts that keep their length, whose round-off remains in their equations; not so large that
    /// a tension could lack a millionth of the largest preload. \[F\]
    pub(in crate::equations) fn rigidity(&self, y: &[f64]) -> f64 {
        const SHARE: f64 = 1e-6;
        let keeping = self.all.iter().filter(|bolt| bolt.keeps == Keeps::Length);
        let sum: f64 = keeping.map(|bolt| bolt.kept_stiffness() * y[bolt.unknown as usize].abs()).sum();
        sum.min(SHARE / f64::EPSILON * self.largest())
    }

    /// δ_n−1 of each bolt that keeps its length in a step.
    pub(in crate::equations) fn kept(&self, before: &[f64], span: Span) -> Vec<Option<f64>> {
        let of = |bolt: &Bolt| bolt.is_kept(span.from).then(|| before[bolt.unknown as usize]);
        self.all.iter().map(of).collect()
    }

    /// The bolts, each with its force on R_δ and the derivatives of this force with respect to δ_n and −δ_n−1.
    fn forces<'a>(&'a self, step: &'a Step, y: &'a [f64]) -> impl Iterator<Item = (&'a Bolt, f64, f64)> + 'a {
        self.all.iter().zip(&step.kept).map(move |(bolt, kept)| {
            let stiffness = kept.map_or(0.0, |_| bolt.kept_stiffness());
            let moved = kept.map_or(0.0, |before| y[bolt.unknown as usize] - before);
            (bolt, stiffness * moved - bolt.preload_at(step.time.t), stiffness)
        })
    }
}

impl ContactModel {
    /// The bolts.
    pub fn bolts(&self) -> &Bolts {
        &self.bolts
    }

    /// Moves the derivatives of a response with respect to the tension of bolts, T = R_δ − (force on R_δ), to those
    /// with respect to R, δ_n, δ_n−1 and, if there are any, parameters.
    pub(crate) fn pull_back_tension(
        &self,
        step: &Step,
        y: &[f64],
        weights: &[f64],
        [residual, now, before, parameters]: [&mut [f64]; 4],
    ) {
        let of = |bolt: &Bolt| weights.get(bolt.unknown as usize).copied().unwrap_or(0.0);
        for (bolt, _, stiffness) in self.bolts.forces(step, y).filter(|(bolt, ..)| of(bolt) != 0.0) {
            let (i, weight) = (bolt.unknown as usize, of(bolt));
            residual[i] += weight;
            now[i] -= weight * stiffness;
            before[i] += weight * stiffness;
        }
        if !parameters.is_empty() {
            self.pull_back_bolts(step, y, |bolt| -of(bolt), parameters);
        }
    }

    /// Adds the derivatives of Σ w (force on R_δ), with weights w of all bolts, with respect to parameters: factors
    /// on the forces, and moduli, of which k is a multiple.
    pub(in crate::equations) fn pull_back_bolts(
        &self,
        step: &Step,
        y: &[f64],
        weight: impl Fn(&Bolt) -> f64,
        out: &mut [f64],
    ) {
        let (bodies, bolts) = (self.interfaces.len(), self.preload_parameters());
        for ((bolt, force, _), k) in self.bolts.forces(step, y).zip(bolts) {
            let preload = bolt.preload_at(step.time.t);
            out[k] -= weight(bolt) * preload;
            out[bodies + bolt.body] += weight(bolt) * (force + preload) / self.modulus_of(bolt.body);
        }
    }

    fn own_bolts<'a>(&'a self, at: TermState<'a>) -> impl Iterator<Item = (&'a Bolt, f64, f64)> + 'a {
        let step = at.step.filter(|_| self.share.has_rest());
        step.into_iter().flat_map(move |(step, _)| self.bolts.forces(step, at.y))
    }
}

impl ForceTerm for Bolts {
    fn add_force(&self, at: TermState<'_>, out: &mut [f64]) {
        at.model().own_bolts(at).for_each(|(bolt, force, _)| out[bolt.unknown as usize] += force);
    }

    fn add_tangent(&self, at: TermState<'_>, matrix: &mut BlockMatrix) {
        for (bolt, _, stiffness) in at.model().own_bolts(at).filter(|(.., stiffness)| *stiffness != 0.0) {
            let node = bolt.unknown as usize / 3;
            let mut block = [0.0; 9];
            block[4 * (bolt.unknown as usize % 3)] = stiffness;
            matrix.add(node, node, &block);
        }
    }

    fn pull_back_previous(&self, at: TermState<'_>, lambda: &[f64], out: &mut [f64]) {
        at.model().own_bolts(at).for_each(|(bolt, _, stiffness)| {
            out[bolt.unknown as usize] -= stiffness * lambda[bolt.unknown as usize];
        });
    }
}

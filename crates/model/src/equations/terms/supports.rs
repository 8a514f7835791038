//! Supports that begin or end within the load path: springs that are so stiff that they hold, and let go.
//!
//! ```text
//! R_i = … + χ k (d_i − d̂_i)
//! ```
//!
//! k is a million times E h of the body, with the mean size h of its elements, so d_i deviates from the prescribed
//! d̂_i by a millionth of what the elements there deform; the derivatives are exact for this k. χ is 0 before the
//! support begins and after it has ended. In between it is 1; over the load step in which the support ends it falls
//! by 18 decades, beyond the stiffness of slender parts, so that the path can be halved where the bodies spring back
//! far. Until the first waypoint of a
//! support that begins at t_0, d̂ moves in equal shares of time from the position at t_0 to this waypoint. In a step
//! from t_n−1 to t_n, it is therefore
//!
//! ```text
//! d̂_n = d_n−1 + (ŵ(t_1) − d_n−1) (t_n − t_n−1)/(t_1 − t_n−1)
//! ```
//!
//! and d_n−1 if there is no waypoint. Tests: `tests/suite/temporary.rs`.

use crate::equations::evaluated::Step;
use crate::equations::motion::Dirichlet;
use crate::equations::prescribed::Temporary;
use crate::equations::terms::{ForceTerm, TermState};
use crate::equations::{ContactModel, Share};
use slipstick_linalg::BlockMatrix;
use slipstick_path::Span;

/// k, relative to E h of the body.
const STIFF: f64 = 1e6;

/// Pseudo-times closer than this are equal.
const SAME_TIME: f64 = 1e-9;

/// Decades by which χ falls while a support ends.
const DECADES: f64 = 18.0;

impl Dirichlet {
    /// Whether it holds its nodes over the whole path.
    pub fn is_permanent(&self) -> bool {
        self.from == 0.0 && self.until.is_none()
    }

    /// Whether it never moves component `c`.
    pub(in crate::equations) fn holds_still(&self, c: usize) -> bool {
        self.motion.iter().all(|point| point.u[c] == 0.0 && point.angle == 0.0)
    }

    /// 1 − log χ/log χ_min at the end of a step: 1 while the support holds, falling to 0 while it ends; `None` if χ is 0.
    pub(in crate::equations) fn level(&self, from: f64, to: f64) -> Option<f64> {
        if from < self.from - SAME_TIME {
            return None;
        }
        match self.until {
            Some(until) if to >= until.released - SAME_TIME => None,
            Some(until) if to > until.t + SAME_TIME => Some(1.0 - (to - until.t) / (until.released - until.t)),
            _ => Some(1.0),
        }
    }

    /// Whether it holds its nodes, or lets them go, at a state.
    pub fn acts_at(&self, t: f64) -> bool {
        let begun = self.from == 0.0 || t > self.from + SAME_TIME;
        begun && self.level(self.from, t).is_some()
    }
}

/// What a support demands in a step.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::equations) struct Demand {
    /// χ.
    share: f64,
    /// d̂. \[L\]
    at: f64,
    /// Its derivatives with respect to d_n−1 and to the factor on the motion.
    by_before: f64,
    by_factor: f64,
}

impl Demand {
    /// Of component `c`, that was `before` at the start of the step and is `rest` at rest. \[L\]
    pub fn of(motion: &Dirichlet, c: usize, [before, rest]: [f64; 2], span: Span) -> Self {
        let Some(level) = motion.level(span.from, span.to) else { return Self::default() };
        let share = 10_f64.powf(DECADES * (level - 1.0));
        let next = motion.motion.iter().find(|point| point.t > motion.from + SAME_TIME);
        match next.filter(|_| motion.from > 0.0) {
            Some(next) if span.from < next.t - SAME_TIME && span.to < next.t + SAME_TIME => {
                let part = ((span.to - span.from) / (next.t - span.from)).min(1.0);
                let (there, by_factor) = (rest + next.u[c], part * next.u[c]);
                Self { share, at: before + part * (there - before), by_before: 1.0 - part, by_factor }
            }
            None if motion.from > 0.0 => Self { share, at: before, by_before: 1.0, by_factor: 0.0 },
            _ => {
                let moved = motion.at(span.to).0[c];
                Self { share, at: rest + moved, by_before: 0.0, by_factor: moved }
            }
        }
    }
}

impl ContactModel {
    /// k. \[F/L\]
    fn temporary_stiffness(&self, support: &Temporary) -> f64 {
        STIFF * self.modulus_of(support.body as usize) * support.size
    }

    /// What the supports that begin or end demand in a step.
    pub(in crate::equations) fn demands(&self, before: &[f64], span: Span) -> Vec<Demand> {
        let of = |support: &Temporary| {
            let i = support.unknown as usize;
            let motion = self.prescribed.motion_of(support);
            Demand::of(motion, support.component.into(), [before[i], self.prescribed.at_rest(support.unknown)], span)
        };
        self.prescribed.temporary().iter().map(of).collect()
    }

    /// The supports that act in a step, each with its force on R and χ k.
    fn acting<'a>(
        &'a self,
        step: &'a Step,
        y: &'a [f64],
    ) -> impl Iterator<Item = (&'a Temporary, &'a Demand, f64, f64)> + 'a {
        let all = self.prescribed.temporary().iter().zip(&step.demands);
        all.filter(|(_, demand)| demand.share > 0.0).map(move |(support, demand)| {
            let stiffness = demand.share * self.temporary_stiffness(support);
            (support, demand, stiffness * (y[support.unknown as usize] - demand.at), stiffness)
        })
    }

    /// The unknowns that they hold, or are letting go, in a step.
    pub(in crate::equations) fn held_for_now<'a>(&'a self, step: &'a Step) -> impl Iterator<Item = usize> + 'a {
        let all = self.prescribed.temporary().iter().zip(&step.demands);
        all.filter(|(_, demand)| demand.share > 0.0).map(|(support, _)| support.unknown as usize)
    }

    /// Norm of χ k d in a step, whose round-off remains in their equations. \[F\]
    pub(in crate::equations) fn temporary_rigidity(&self, step: &Step, y: &[f64]) -> f64 {
        let square = |(support, _, _, stiffness): (&Temporary, &Demand, f64, f64)| {
            (stiffness * y[support.unknown as usize]).powi(2)
        };
        self.acting(step, y).map(square).sum::<f64>().sqrt()
    }

    /// Moves the derivatives of a response with respect to reactions, R_i − (force on R_i), to those with respect to
    /// R, d_n, d_n−1 and, if there are any, parameters.
    pub(crate) fn pull_back_temporary_reactions(
        &self,
        step: &Step,
        y: &[f64],
        weights: &[f64],
        [residual, now, before, parameters]: [&mut [f64]; 4],
    ) {
        let of = |support: &Temporary| weights.get(support.unknown as usize).copied().unwrap_or(0.0);
        for (support, demand, _, stiffness) in self.acting(step, y).filter(|(support, ..)| of(support) != 0.0) {
            let (i, weight) = (support.unknown as usize, of(support));
            residual[i] += weight;
            now[i] -= weight * stiffness;
            before[i] += weight * stiffness * demand.by_before;
        }
        if !parameters.is_empty() {
            self.pull_back_supports(step, y, |support| -of(support), parameters);
        }
    }

    /// Adds the derivatives of Σ w (force on R_i) with respect to parameters: factors on motions, and moduli, of
    /// which k is a multiple.
    pub(in crate::equations) fn pull_back_supports(
        &self,
        step: &Step,
        y: &[f64],
        weight: impl Fn(&Temporary) -> f64,
        out: &mut [f64],
    ) {
        let bodies = self.interfaces.len();
        let motions = bodies + self.bodies.len();
        for (support, demand, force, stiffness) in self.acting(step, y) {
            let (weight, body) = (weight(support), support.body as usize);
            out[bodies + body] += weight * force / self.modulus_of(body);
            out[motions + support.motion as usize] -= weight * stiffness * demand.by_factor;
        }
    }

    fn own_acting<'a>(&'a self, at: TermState<'a>) -> impl Iterator<Item = (&'a Temporary, &'a Demand, f64, f64)> + 'a {
        let step = at.step.filter(|_| self.share.has_rest());
        step.into_iter().flat_map(move |(step, _)| self.acting(step, at.y))
    }
}

/// The supports of a model that begin or end within the load path, as a term of its equations.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::equations) struct TemporarySupports;

impl TemporarySupports {
    /// Adds the diagonals of their unknowns to the rows of a part of the model, if this part has them.
    pub fn couple(supports: &[Temporary], rows: &mut [Vec<u32>], share: &Share) {
        for node in supports.iter().filter(|_| share.has_rest()).map(|support| support.unknown / 3) {
            rows[node as usize].push(node);
        }
    }
}

impl ForceTerm for TemporarySupports {
    fn add_force(&self, at: TermState<'_>, out: &mut [f64]) {
        at.model().own_acting(at).for_each(|(support, _, force, _)| out[support.unknown as usize] += force);
    }

    fn add_tangent(&self, at: TermState<'_>, matrix: &mut BlockMatrix) {
        for (support, _, _, stiffness) in at.model().own_acting(at) {
            let node = support.unknown as usize / 3;
            let mut block = [0.0; 9];
            block[4 * usize::from(support.component)] = stiffness;
            matrix.add(node, node, &block);
        }
    }

    fn pull_back_previous(&self, at: TermState<'_>, lambda: &[f64], out: &mut [f64]) {
        at.model().own_acting(at).for_each(|(support, demand, _, stiffness)| {
            out[support.unknown as usize] -= stiffness * demand.by_before * lambda[support.unknown as usize];
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::equations::motion::{Component, Until, Waypoint};

    fn motion(from: f64, until: Option<Until>, waypoints: &[(f64, f64)]) -> Dirichlet {
        Dirichlet {
            set: "end".into(),
            load_case: None,
            components: vec![Component::Y],
            rotations: Vec::new(),
            motion: waypoints.iter().map(|&(t, y)| Waypoint { t, u: [0.0, y, 0.0], angle: 0.0 }).collect(),
            rotation: None,
            from,
            until,
        }
    }

    /// The demand in a step of load case 0.
    fn demand(motion: &Dirichlet, before: f64, [from, to]: [f64; 2]) -> Demand {
        Demand::of(motion, 1, [before, 0.0], Span { case: 0, from, to })
    }

    /// From 0.3 at t = 0.5 to 1 at t = 1: in two halves, or with a cut, along the same line. Before, nothing is
    /// demanded.
    #[test]
    fn a_support_that_begins_moves_from_where_it_is() {
        let begins = motion(0.5, None, &[(1.0, 1.0)]);
        assert_eq!(demand(&begins, 0.3, [0.4, 0.5]).share, 0.0);
        let first = demand(&begins, 0.3, [0.5, 0.6]);
        assert!((first.at - 0.44).abs() < 1e-15 && first.share == 1.0, "{first:?}");
        assert!((first.by_before - 0.8).abs() < 1e-15 && (first.by_factor - 0.2).abs() < 1e-15, "{first:?}");
        let second = demand(&begins, first.at, [0.6, 1.0]);
        assert!((second.at - 1.0).abs() < 1e-15 && second.by_before.abs() < 1e-15, "{second:?}");
    }

    /// Without a waypoint, it stays where it is.
    #[test]
    fn a_support_without_a_motion_holds_where_it_begins() {
        let held = demand(&motion(0.5, None, &[]), 0.3, [0.7, 0.8]);
        assert_eq!((held.share, held.at, held.by_before), (1.0, 0.3, 1.0));
    }

    /// χ: 1 until t = 0.5, then 18 decades down to t = 0.6, and 0.
    #[test]
    fn a_support_that_ends_lets_go_in_one_load_step() {
        let ends = motion(0.0, Some(Until { t: 0.5, released: 0.6 }), &[(0.5, 1.0)]);
        let share = |to: f64| demand(&ends, 0.0, [0.5, to]).share;
        assert_eq!([share(0.5), share(0.6), share(0.7)], [1.0, 0.0, 0.0]);
        assert!((share(0.55) / 1e-9 - 1.0).abs() < 1e-6, "{}", share(0.55));
        assert!(ends.acts_at(0.0) && ends.acts_at(0.55) && !ends.acts_at(0.6));
    }
}

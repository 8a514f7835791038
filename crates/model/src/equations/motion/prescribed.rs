//! Prescribed displacements along the load path.

mod error;
mod positions;

use crate::equations::LoadTime;
use crate::equations::linear::LinearEquations;
use crate::equations::motion::{Component, Dirichlet};
use crate::equations::rigid::RigidBodies;
pub use error::{ConflictingMotion, OffThePlane};
use nalgebra::{Rotation3, Unit, Vector3};
use slipstick_mesh::{Mesh, Reference};
use std::borrow::Cow;

/// The prescribed unknowns and their motion.
#[derive(Debug, Clone, Default)]
pub struct Prescribed {
    motions: Vec<Dirichlet>,
    /// Number of each motion's load case; `None` if the motion acts in all.
    cases: Vec<Option<usize>>,
    entries: Vec<Entry>,
    /// Displacement unknowns of motions that begin or end within the path; they are solved for.
    temporary: Vec<Temporary>,
    /// Displacement unknowns that another motion also prescribes, with the same values, and the
    /// number of that motion.
    repeated: Vec<(u32, u32)>,
    fixed: Vec<bool>,
    /// Displacement unknowns normal to symmetry planes that no motion prescribes; they are zero.
    mirrored: Vec<u32>,
    /// Displacements at rest, to which motions are added; zero if empty.
    rest: Vec<f64>,
    /// Bodies whose nodes follow from other unknowns.
    rigid: RigidBodies,
    /// Displacements that follow from others.
    linear: LinearEquations,
}

/// A displacement unknown of a motion that begins or ends within the path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Temporary {
    /// Number of the unknown.
    pub unknown: u32,
    /// 0, 1, 2.
    pub component: u8,
    /// Number of its motion.
    pub motion: u32,
    /// Number of the body of its node.
    pub body: u32,
    /// Mean size of that body's elements. \[L\]
    pub size: f64,
}

/// A prescribed displacement unknown.
#[derive(Debug, Clone, Copy)]
struct Entry {
    /// Number of the unknown.
    dof: u32,
    /// 0, 1, 2.
    component: u8,
    /// Number of its motion.
    motion: u32,
    what: What,
}

#[derive(Debug, Clone, Copy)]
enum What {
    /// The displacement of a node with this reference position.
    Position([f64; 3]),
    /// The rotation vector of a rigid body, times this length.
    Rotation(f64),
}

/// The nodes that a motion moves: a set, or a rigid body.
#[derive(Debug, Clone, PartialEq)]
pub enum Moved {
    /// Nodes.
    Nodes(Vec<u32>),
    /// A rigid body or a coupling, by its reference point and the node with its rotation.
    Body(Reference),
}

impl Moved {
    /// The unknowns that a motion prescribes: node, component, and what the component is.
    fn unknowns(&self, motion: &Dirichlet, coordinates: &[f64]) -> Vec<(u32, usize, What)> {
        let position = |node: u32| What::Position(std::array::from_fn(|c| coordinates[3 * node as usize + c]));
        let of = |node: u32, what: What, components: &[Component]| -> Vec<(u32, usize, What)> {
            components.iter().map(|component| (node, component.index(), what)).collect()
        };
        match self {
            Self::Nodes(nodes) => nodes.iter().flat_map(|&node| of(node, position(node), &motion.components)).collect(),
            Self::Body(body) => {
                let mut all = of(body.node, position(body.node), &motion.components);
                all.extend(of(body.node + 1, What::Rotation(body.length), &motion.rotations));
                all
            }
        }
    }
}

impl Prescribed {
    /// `sets[i]` are the nodes or the rigid body that `motions[i]` moves; `coordinates` has three entries per node;
    /// `cases` are the names of the load cases. A component that a motion prescribes in one case is
    /// held in the others, unless another motion prescribes it there.
    ///
    /// # Errors
    /// [`ConflictingMotion`] if two tables prescribe different values of one unknown.
    pub fn new(
        motions: Vec<Dirichlet>,
        sets: &[Moved],
        coordinates: &[f64],
        cases: &[&str],
    ) -> Result<Self, ConflictingMotion> {
        let number =
            |motion: &Dirichlet| motion.load_case.as_ref().and_then(|name| cases.iter().position(|case| case == name));
        let cases: Vec<Option<usize>> = motions.iter().map(number).collect();
        let mut owners: Vec<Vec<u32>> = vec![Vec::new(); coordinates.len()];
        let (mut entries, mut repeated, mut temporary) = (Vec::new(), Vec::new(), Vec::new());
        let with_sets = |permanent: bool| {
            motions.iter().zip(sets).enumerate().filter(move |(_, (motion, _))| motion.is_permanent() == permanent)
        };
        for (m, (motion, moved)) in with_sets(true) {
            for (node, c, what) in moved.unknowns(motion, coordinates) {
                let dof = 3 * node as usize + c;
                let together = |&&other: &&u32| match (cases[other as usize], cases[m]) {
                    (Some(a), Some(b)) => a == b,
                    _ => true,
                };
                match owners[dof].iter().find(together) {
                    Some(&first) if !same(&motions[first as usize], motion, c) => {
                        let (first, set) = (first as usize, motions[first as usize].set.clone());
                        let component = c as u8;
                        return Err(ConflictingMotion { node, component, first, set, motion: m, temporary: false });
                    }
                    // identical in all cases of this motion
                    Some(&first) if cases[first as usize].is_none() || cases[first as usize] == cases[m] => {
                        repeated.push((dof as u32, m as u32));
                    }
                    _ => {
                        owners[dof].push(m as u32);
                        entries.push(Entry { dof: dof as u32, component: c as u8, motion: m as u32, what });
                    }
                }
            }
        }
        let fixed: Vec<bool> = owners.iter().map(|owners| !owners.is_empty()).collect();
        for (m, (motion, moved)) in with_sets(false) {
            for (node, c, _) in moved.unknowns(motion, coordinates) {
                let dof = 3 * node as usize + c;
                let Some(&first) = owners[dof].first() else {
                    owners[dof].push(m as u32);
                    let (unknown, component, motion) = (dof as u32, c as u8, m as u32);
                    temporary.push(Temporary { unknown, component, motion, body: 0, size: 0.0 });
                    continue;
                };
                let other = &motions[first as usize];
                // a node that is held all the time needs no other support
                if !(other.is_permanent() && other.holds_still(c) && motion.holds_still(c)) {
                    let (component, first, set) = (c as u8, first as usize, other.set.clone());
                    return Err(ConflictingMotion { node, component, first, set, motion: m, temporary: true });
                }
            }
        }
        Ok(Self {
            motions,
            cases,
            entries,
            temporary,
            repeated,
            fixed,
            mirrored: Vec::new(),
            rest: Vec::new(),
            rigid: RigidBodies::default(),
            linear: LinearEquations::default(),
        })
    }

    /// The same, with the components normal to symmetry planes fixed; `mirrored` has three entries
    /// per node.
    ///
    /// # Errors
    /// [`OffThePlane`] if a motion moves such a component.
    pub fn with_symmetry(mut self, mirrored: &[[bool; 3]]) -> Result<Self, OffThePlane> {
        let mut d = vec![0.0; self.fixed.len()];
        // at its waypoints, a rotation may happen to return to the plane
        let of = |(motion, case): (&Dirichlet, &Option<usize>)| {
            let case = case.unwrap_or(0);
            let times = motion.motion.iter().flat_map(|point| [point.t, 0.618 * point.t]);
            times.map(|t| LoadTime { case, t }).collect::<Vec<_>>()
        };
        let times: Vec<LoadTime> = self.motions.iter().zip(&self.cases).flat_map(of).collect();
        for time in times {
            self.apply(time, &mut d);
            let moved = |entry: &&Entry| {
                mirrored[entry.dof as usize / 3][usize::from(entry.component)] && d[entry.dof as usize] != 0.0
            };
            if let Some(&Entry { dof, component, motion, .. }) = self.entries.iter().find(moved) {
                return Err(OffThePlane { node: dof / 3, component, motion: motion as usize });
            }
        }
        let across = |support: &Temporary| mirrored[support.unknown as usize / 3][usize::from(support.component)];
        let moves = |support: &&Temporary| {
            let motion = &self.motions[support.motion as usize].motion;
            across(support) && motion.iter().any(|point| point.u[usize::from(support.component)] != 0.0)
        };
        if let Some(&Temporary { unknown, component, motion, .. }) = self.temporary.iter().find(moves) {
            return Err(OffThePlane { node: unknown / 3, component, motion: motion as usize });
        }
        self.temporary.retain(|support| !across(support));
        for (dof, across) in mirrored.iter().flatten().enumerate() {
            if *across && !std::mem::replace(&mut self.fixed[dof], true) {
                self.mirrored.push(dof as u32);
            }
        }
        Ok(self)
    }

    /// The same supports with a factor on each motion, and with displacements at rest (three per
    /// node; none if empty) from which the motions start. Axes of rotation do not move.
    pub(in crate::equations) fn varied(&self, factors: &[f64], rest: &[f64]) -> Self {
        let mut varied = self.clone();
        for (motion, factor) in varied.motions.iter_mut().zip(factors) {
            for point in &mut motion.motion {
                point.u.iter_mut().for_each(|u| *u *= factor);
                point.angle *= factor;
            }
        }
        if !rest.is_empty() {
            for Entry { dof, what, .. } in &mut varied.entries {
                let node = 3 * (*dof as usize / 3);
                if let What::Position(x) = what {
                    x.iter_mut().zip(&rest[node..]).for_each(|(x, rest)| *x += rest);
                }
            }
            varied.rest = rest.to_vec();
        }
        varied
    }

    /// The same with the bodies of a mesh: nodes of rigid ones, which follow from other unknowns, count as prescribed.
    #[must_use]
    pub fn with_bodies(mut self, mesh: &Mesh) -> Self {
        let volumes = if self.temporary.is_empty() { Vec::new() } else { mesh.element_volumes() };
        for support in &mut self.temporary {
            let of = |(_, body): &(usize, &slipstick_mesh::Body)| body.nodes.contains(&(support.unknown as usize / 3));
            let Some((number, body)) = mesh.bodies.iter().enumerate().find(of) else { continue };
            let volume: f64 = volumes[body.elements.clone()].iter().sum();
            support.body = number as u32;
            support.size = (volume / body.elements.len() as f64).cbrt();
        }
        self.rigid = RigidBodies::new(mesh);
        self.rigid.nodes().for_each(|node| self.fixed[3 * node..][..3].fill(true));
        self
    }

    /// The same with further unknowns held at zero.
    #[must_use]
    pub fn with_idle(mut self, unknowns: Vec<u32>) -> Self {
        unknowns.into_iter().for_each(|i| self.fixed[i as usize] = true);
        self
    }

    /// The same with the displacements that follow from others by equations counted as prescribed.
    #[must_use]
    pub fn with_equations(mut self, linear: LinearEquations) -> Self {
        linear.rows().iter().for_each(|(i, _)| self.fixed[*i as usize] = true);
        let fixed = &self.fixed;
        // dependent displacements follow those that are held
        self.temporary.retain(|support| !fixed[support.unknown as usize]);
        self.linear = linear;
        self
    }

    /// The equations among displacements.
    pub fn linear(&self) -> &LinearEquations {
        &self.linear
    }

    /// The unknowns of motions that begin or end within the path.
    pub fn temporary(&self) -> &[Temporary] {
        &self.temporary
    }

    /// The motion of such an unknown.
    pub fn motion_of(&self, support: &Temporary) -> &Dirichlet {
        &self.motions[support.motion as usize]
    }

    /// How far each motion that begins or ends holds its nodes at a state, from 0 to 1.
    pub(in crate::equations) fn levels(&self, t: f64) -> impl Iterator<Item = f64> + '_ {
        let own = self.motions.iter().filter(|motion| !motion.is_permanent());
        own.map(move |motion| if motion.acts_at(t) { motion.level(motion.from, t).unwrap_or(0.0) } else { 0.0 })
    }

    /// Which displacement unknowns supports hold at a state: those that are [fixed](Self::fixed), and those of motions
    /// that have begun and not ended.
    pub fn supported(&self, t: f64) -> Cow<'_, [bool]> {
        let mut supported = Cow::Borrowed(&self.fixed[..]);
        for support in self.temporary.iter().filter(|support| self.motion_of(support).acts_at(t)) {
            supported.to_mut()[support.unknown as usize] = true;
        }
        supported
    }

    /// Which displacement unknowns supports hold at some time.
    pub fn ever_supported(&self) -> Cow<'_, [bool]> {
        let mut supported = Cow::Borrowed(&self.fixed[..]);
        for support in &self.temporary {
            supported.to_mut()[support.unknown as usize] = true;
        }
        supported
    }

    pub(in crate::equations) fn at_rest(&self, dof: u32) -> f64 {
        self.rest.get(dof as usize).copied().unwrap_or(0.0)
    }

    /// Which displacement unknowns are prescribed.
    pub fn fixed(&self) -> &[bool] {
        &self.fixed
    }

    /// The sets whose motions prescribe displacement unknown `dof`, in the order of the case,
    /// without repetitions. A symmetry plane has no set.
    pub fn sets(&self, dof: usize) -> Vec<&str> {
        let entries = self.entries.iter().map(|entry| (entry.dof, entry.motion));
        let entries = entries.chain(self.temporary.iter().map(|support| (support.unknown, support.motion)));
        let mut motions: Vec<u32> = entries
            .chain(self.repeated.iter().copied())
            .filter(|&(at, _)| at as usize == dof)
            .map(|(_, m)| m)
            .collect();
        motions.sort_unstable();
        let mut names: Vec<&str> = Vec::new();
        for name in motions.into_iter().map(|motion| self.motions[motion as usize].set.as_str()) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    }

    /// The displacement unknowns that each set prescribes, in the order of the case. An unknown
    /// that several tables prescribe belongs to the first of them. For a rigid body, the unknowns
    /// are the displacements of its nodes.
    pub fn owned(&self) -> Vec<(&str, Vec<u32>)> {
        let mut owned: Vec<(&str, Vec<u32>)> = Vec::new();
        let mut taken = vec![false; self.fixed.len()];
        for &Entry { dof, motion, what, .. } in &self.entries {
            if std::mem::replace(&mut taken[dof as usize], true) {
                continue;
            }
            let set = self.motions[motion as usize].set.as_str();
            // the moment on a rotation is not a force
            let moved = if let What::Rotation(_) = what { Vec::new() } else { self.rigid.moved_by(dof) };
            match owned.iter_mut().find(|(name, _)| *name == set) {
                Some((_, unknowns)) => unknowns.extend(moved),
                None => owned.push((set, moved)),
            }
        }
        for &Temporary { unknown, motion, .. } in &self.temporary {
            let set = self.motions[motion as usize].set.as_str();
            match owned.iter_mut().find(|(name, _)| *name == set) {
                Some((_, unknowns)) => unknowns.push(unknown),
                None => owned.push((set, vec![unknown])),
            }
        }
        owned.iter_mut().for_each(|(_, unknowns)| unknowns.sort_unstable());
        owned
    }

    /// Displacement unknowns normal to symmetry planes that no set prescribes. For a rigid body,
    /// these are the displacements of its nodes.
    pub fn mirrored(&self) -> Vec<u32> {
        self.mirrored.iter().flat_map(|&dof| self.rigid.moved_by(dof)).collect()
    }

    /// Writes the prescribed displacements of a time into `d`: rotation about the axis, then translation.
    pub fn apply(&self, LoadTime { case, t: time }: LoadTime, d: &mut [f64]) {
        for &dof in &self.mirrored {
            d[dof as usize] = self.at_rest(dof);
        }
        let pose = |(motion, own): (&Dirichlet, &Option<usize>)| {
            own.is_none_or(|own| own == case).then(|| (motion.at(time), motion.rotation))
        };
        let poses: Vec<_> = self.motions.iter().zip(&self.cases).map(pose).collect();
        for &Entry { dof, motion, .. } in &self.entries {
            if poses[motion as usize].is_none() {
                d[dof as usize] = self.at_rest(dof);
            }
        }
        for &Entry { dof, component, motion, what } in &self.entries {
            let Some(((u, degrees), axis)) = &poses[motion as usize] else { continue };
            let c = usize::from(component);
            let turned = axis.filter(|_| *degrees != 0.0).map(|axis| {
                let direction = Unit::new_normalize(Vector3::from(axis.direction));
                match what {
                    What::Position(x) => {
                        let rotation = Rotation3::from_axis_angle(&direction, degrees.to_radians());
                        let arm = Vector3::from(x) - Vector3::from(axis.point);
                        (rotation * arm - arm)[c]
                    }
                    What::Rotation(length) => length * degrees.to_radians() * direction[c],
                }
            });
            let moved = if let What::Position(_) = what { u[c] } else { 0.0 };
            d[dof as usize] = self.at_rest(dof) + moved + turned.unwrap_or(0.0);
        }
        self.linear.place(d);
        self.rigid.place(d);
    }

    /// Number of motions.
    pub fn motions(&self) -> usize {
        self.motions.len()
    }

    /// Adds Σ μ ∂d/∂a of each motion at a time, where a = 1 is a factor on its
    /// translation and its angle θ: with the unit axis n, ∂/∂a (R(aθ) − I) r = θ n × R(θ) r.
    ///
    /// Test: `amplitudes_match_finite_differences`.
    pub fn pull_back_amplitudes(&self, LoadTime { case, t: time }: LoadTime, by_prescribed: &[f64], out: &mut [f64]) {
        for &Entry { dof, component, motion, what } in &self.entries {
            if self.cases[motion as usize].is_some_and(|own| own != case) {
                continue;
            }
            let moved = &self.motions[motion as usize];
            let (u, degrees) = moved.at(time);
            let c = usize::from(component);
            let mut slope = if let What::Position(_) = what { u[c] } else { 0.0 };
            if let (Some(axis), true) = (moved.rotation, degrees != 0.0) {
                let direction = Unit::new_normalize(Vector3::from(axis.direction));
                let angle = degrees.to_radians();
                slope += match what {
                    What::Position(x) => {
                        let arm = Vector3::from(x) - Vector3::from(axis.point);
                        angle * direction.cross(&(Rotation3::from_axis_angle(&direction, angle) * arm))[c]
                    }
                    What::Rotation(length) => length * angle * direction[c],
                };
            }
            out[motion as usize] += slope * by_prescribed[dof as usize];
        }
    }

    /// Largest prescribed displacement at any of the `times`. \[L\]
    pub fn largest(&self, times: &[LoadTime]) -> f64 {
        self.largest_of(times.iter().map(|&time| (LoadTime::start(time.case), time)))
    }

    /// Largest change of a prescribed displacement between consecutive `times`; each load case
    /// starts at rest. \[L\]
    pub fn largest_step(&self, times: &[LoadTime]) -> f64 {
        let starts = std::iter::once(LoadTime::default()).chain(times.iter().copied());
        let within =
            |(from, to): (LoadTime, LoadTime)| (if from.case == to.case { from } else { LoadTime::start(to.case) }, to);
        self.largest_of(starts.zip(times.iter().copied()).map(within))
    }

    fn largest_of(&self, spans: impl Iterator<Item = (LoadTime, LoadTime)>) -> f64 {
        let n = self.fixed.len();
        let (mut a, mut b) = (vec![0.0; n], vec![0.0; n]);
        let mut largest: f64 = 0.0;
        for (from, to) in spans {
            self.apply(from, &mut a);
            self.apply(to, &mut b);
            for support in &self.temporary {
                let motion = self.motion_of(support);
                for (time, d) in [(from, &mut a), (to, &mut b)] {
                    d[support.unknown as usize] = motion.at(time.t).0[usize::from(support.component)];
                }
            }
            for (p, q) in a.chunks_exact(3).zip(b.chunks_exact(3)) {
                let change: f64 = p.iter().zip(q).map(|(p, q)| (p - q) * (p - q)).sum();
                largest = largest.max(change.sqrt());
            }
        }
        largest
    }
}

/// Whether two motions prescribe the same displacement component `c` at all times.
fn same(a: &Dirichlet, b: &Dirichlet, c: usize) -> bool {
    let turns = |motion: &Dirichlet| motion.motion.iter().any(|point| point.angle != 0.0);
    if turns(a) || turns(b) {
        return a.motion == b.motion && a.rotation == b.rotation;
    }
    // both are piecewise linear between the waypoints
    a.motion.iter().chain(&b.motion).all(|point| a.at(point.t).0[c] == b.at(point.t).0[c])
}

#[cfg(test)]
mod tests;

//! External forces along the load path.

use crate::equations::dependent::Dependent;
use crate::equations::motion::{Centrifugal, Load, LoadKind};
use crate::equations::terms::{ForceTerm, TermState};
use crate::equations::{LoadTime, Share};
use slipstick_linalg::BlockMatrix;
use slipstick_mesh::{FaceNodes, Mesh, Reference};
use slipstick_solid::load::{add_pressure, nodal_areas, pressure_tangent};
use slipstick_solid::{Acceleration, Formulation, MassiveElements};
use std::ops::Range;
use std::sync::Arc;

/// The loads of a model.
#[derive(Debug, Clone, Default)]
pub struct Loads {
    loads: Vec<Applied>,
}

/// The target of a load.
#[derive(Debug, Clone)]
pub enum Loaded {
    /// Facets of a surface.
    Facets(Vec<FaceNodes>),
    /// A rigid body or a coupling: a force at its reference point, or a moment.
    Body(Reference),
    /// Nodes of a set.
    Nodes(Vec<u32>),
    /// The mass of elements: those of a body, or all.
    Mass(Range<usize>),
}

/// The state at which loads act, and the part of the model on which they are evaluated.
#[derive(Clone, Copy)]
pub(in crate::equations) struct LoadState<'a> {
    pub time: LoadTime,
    /// Positions.
    pub x: &'a [f64],
    /// Mass of each element per reference volume. \[M/L³\]
    pub masses: &'a [f64],
    /// Only the part of this rank; `None`: the whole model.
    pub part: Option<&'a Share>,
}

impl LoadState<'_> {
    fn has_surfaces(&self) -> bool {
        self.part.is_none_or(Share::has_rest)
    }

    fn has_element(&self, element: usize) -> bool {
        self.part.is_none_or(|share| share.has_element(element))
    }
}

#[derive(Debug, Clone)]
struct Applied {
    load: Load,
    /// Number of its load case; `None` if the load acts in all.
    case: Option<usize>,
    action: Action,
}

impl Applied {
    /// The factor on the load at a time.
    fn factor(&self, LoadTime { case, t }: LoadTime) -> f64 {
        if self.case.is_none_or(|own| own == case) { self.load.factor(t) } else { 0.0 }
    }
}

#[derive(Debug, Clone)]
enum Action {
    /// Forces on nodes at factor 1. \[F\]
    Dead(Vec<(u32, [f64; 3])>),
    /// Pressure at factor 1. \[F/L²\]
    Pressure(Vec<FaceNodes>, f64),
    /// Force on the mass of elements at factor 1.
    Mass(Arc<MassiveElements>, Acceleration),
}

impl Loads {
    /// `targets[i]` is the target of `loads[i]`; `formulations` are those of the elements, empty if all are fully
    /// integrated; `cases` are the names of the load cases.
    pub fn new(
        loads: Vec<Load>,
        targets: Vec<Loaded>,
        mesh: &Mesh,
        formulations: &[Formulation],
        cases: &[&str],
    ) -> Self {
        let coordinates: Vec<f64> = mesh.nodes.iter().flatten().copied().collect();
        let formulation = |element: usize| formulations.get(element).copied().unwrap_or_default();
        let mut massive: Vec<(Range<usize>, Arc<MassiveElements>)> = Vec::new();
        let mut of_mass = |range: Range<usize>, acceleration: Acceleration| {
            if !massive.iter().any(|(known, _)| *known == range) {
                massive.push((range.clone(), Arc::new(MassiveElements::new(mesh, range.clone(), formulation))));
            }
            let elements = massive.iter().find(|(known, _)| *known == range).map(|(_, elements)| elements.clone());
            Action::Mass(elements.expect("pushed above"), acceleration)
        };
        let dead = |facets: &[FaceNodes], traction: [f64; 3]| {
            let areas = nodal_areas(facets, &coordinates);
            Action::Dead(areas.into_iter().map(|(node, area)| (node, traction.map(|t| t * area))).collect())
        };
        let apply = |(load, target): (Load, Loaded)| {
            let action = match (load.kind, target) {
                (LoadKind::Pressure(pressure), Loaded::Facets(facets)) => Action::Pressure(facets, pressure),
                (LoadKind::Traction(traction), Loaded::Facets(facets)) => dead(&facets, traction),
                (LoadKind::Force(force), Loaded::Facets(facets)) => {
                    let area: f64 = nodal_areas(&facets, &coordinates).iter().map(|(_, area)| area).sum();
                    dead(&facets, force.map(|f| f / area))
                }
                (LoadKind::Force(force), Loaded::Body(body)) => Action::Dead(vec![(body.node, force)]),
                (LoadKind::Moment(moment), Loaded::Body(body)) => {
                    Action::Dead(vec![(body.node + 1, moment.map(|m| m / body.length))])
                }
                (LoadKind::NodalForce(force), Loaded::Nodes(nodes)) => {
                    Action::Dead(nodes.into_iter().map(|node| (node, force)).collect())
                }
                (LoadKind::Gravity(acceleration), Loaded::Mass(range)) => {
                    of_mass(range, Acceleration::Uniform(acceleration))
                }
                (LoadKind::Centrifugal(Centrifugal { point, direction, angular_velocity }), Loaded::Mass(range)) => {
                    of_mass(range, Acceleration::centrifugal(point, direction, angular_velocity))
                }
                // such cases are not built
                _ => Action::Dead(Vec::new()),
            };
            let case = load.load_case.as_ref().and_then(|name| cases.iter().position(|case| case == name));
            Applied { load, case, action }
        };
        Self { loads: loads.into_iter().zip(targets).map(apply).collect() }
    }

    /// The same loads, each multiplied by a factor.
    pub(in crate::equations) fn times(&self, factors: &[f64]) -> Self {
        let mut loads = self.clone();
        for (applied, factor) in loads.loads.iter_mut().zip(factors) {
            applied.load.amplitude.iter_mut().for_each(|point| point.factor *= factor);
        }
        loads
    }

    /// Number of loads.
    pub fn len(&self) -> usize {
        self.loads.len()
    }

    /// Whether there are no loads.
    pub fn is_empty(&self) -> bool {
        self.loads.is_empty()
    }

    /// Factors of all loads at a time.
    pub fn factors(&self, time: LoadTime) -> Vec<f64> {
        self.loads.iter().map(|applied| applied.factor(time)).collect()
    }

    /// Whether a load acts on mass.
    pub(in crate::equations) fn depend_on_mass(&self) -> bool {
        self.loads.iter().any(|applied| matches!(applied.action, Action::Mass(..)))
    }

    /// Whether forces depend on the reference positions of nodes other than through the current ones.
    pub(in crate::equations) fn depend_on_positions(&self) -> bool {
        let depends = |applied: &Applied| match applied.action {
            Action::Mass(..) => true,
            Action::Dead(_) => !matches!(applied.load.kind, LoadKind::NodalForce(_)),
            Action::Pressure(..) => false,
        };
        self.loads.iter().any(depends)
    }

    /// Adds the negative external force, which is its contribution to R. \[F\]
    pub(in crate::equations) fn add_residual(&self, at: LoadState<'_>, out: &mut [f64]) {
        for applied in &self.loads {
            applied.action.add(applied.factor(at.time), at, out);
        }
    }

    /// Calls `add` with the blocks of the derivative of [`add_residual`](Self::add_residual) with
    /// respect to the positions.
    fn tangent(&self, at: LoadState<'_>, mut add: impl FnMut(u32, u32, &[f64; 9])) {
        for applied in &self.loads {
            let factor = applied.factor(at.time);
            match &applied.action {
                Action::Pressure(facets, pressure) if at.has_surfaces() => {
                    pressure_tangent(facets, at.x, pressure * factor, &mut add);
                }
                Action::Mass(elements, acceleration) => {
                    elements.tangent(acceleration, at.masses, -factor, |e| at.has_element(e), &mut add);
                }
                Action::Pressure(..) | Action::Dead(_) => {}
            }
        }
    }

    /// Adds the couplings of that derivative to the rows of a part of the model, if this part has
    /// the loads. Nodes that an element couples are coupled already.
    pub(in crate::equations) fn couple(&self, mut rows: Vec<Vec<u32>>, share: &Share) -> Vec<Vec<u32>> {
        for applied in self.loads.iter().filter(|_| share.has_rest()) {
            if let Action::Pressure(facets, _) = &applied.action {
                for facet in facets {
                    facet.iter().for_each(|&node| rows[node as usize].extend(facet.iter()));
                }
            }
        }
        rows
    }

    /// Adds the transpose of that derivative times `weights`.
    pub(in crate::equations) fn add_transposed_product(&self, at: LoadState<'_>, weights: &[f64], out: &mut [f64]) {
        self.tangent(at, |row, column, block| {
            for (at, value) in block.iter().enumerate() {
                out[3 * column as usize + at % 3] += value * weights[3 * row as usize + at / 3];
            }
        });
    }

    /// Adds weightsᵀ ∂f_ext/∂φ of every element; `slopes` are the derivatives of the masses.
    pub(in crate::equations) fn pull_back_density(
        &self,
        at: LoadState<'_>,
        slopes: &[f64],
        weights: &[f64],
        out: &mut [f64],
    ) {
        for applied in &self.loads {
            if let Action::Mass(elements, acceleration) = &applied.action {
                let place = (applied.factor(at.time), at.x);
                elements.pull_back_density(acceleration, slopes, place, weights, |e| at.has_element(e), out);
            }
        }
    }

    /// Adds weightsᵀ ∂f_ext/∂a of every load, where a = 1 is a factor on the load.
    pub(in crate::equations) fn pull_back_amplitudes(&self, at: LoadState<'_>, weights: &[f64], out: &mut [f64]) {
        let mut residual = vec![0.0; at.x.len()];
        for (applied, out) in self.loads.iter().zip(out) {
            residual.fill(0.0);
            applied.action.add(applied.factor(at.time), at, &mut residual);
            *out -= residual.iter().zip(weights).map(|(r, w)| r * w).sum::<f64>();
        }
    }

    /// Numbers of the loads that act only on prescribed displacements, marked in `fixed`, or on no mass.
    pub(in crate::equations) fn idle(&self, fixed: &[bool], dependent: &Dependent, at: LoadState<'_>) -> Vec<usize> {
        let moves_nothing = |applied: &Applied| {
            let mut force = vec![0.0; at.x.len()];
            applied.action.add(1.0, at, &mut force);
            let largest = force.iter().fold(0.0, |m: f64, f| m.max(f.abs()));
            dependent.pull_back(&vec![0.0; at.x.len()], &mut force);
            force.iter().zip(fixed).all(|(f, fixed)| *fixed || f.abs() <= 1e-12 * largest)
        };
        (0..self.loads.len()).filter(|&load| moves_nothing(&self.loads[load])).collect()
    }

    /// Largest norm of the external force at any waypoint, on the undeformed bodies with these masses of
    /// elements. \[F\]
    pub(in crate::equations) fn largest(&self, coordinates: &[f64], masses: &[f64]) -> f64 {
        let norm = |time: LoadTime| {
            let mut force = vec![0.0; coordinates.len()];
            self.add_residual(LoadState { time, x: coordinates, masses, part: None }, &mut force);
            force.iter().map(|f| f * f).sum::<f64>().sqrt()
        };
        let times = self.loads.iter().flat_map(|applied| {
            let case = applied.case.unwrap_or(0);
            applied.load.amplitude.iter().map(move |point| LoadTime { case, t: point.t })
        });
        times.map(norm).fold(0.0, f64::max)
    }
}

impl ForceTerm for Loads {
    fn add_force(&self, at: TermState<'_>, out: &mut [f64]) {
        if !self.is_empty() {
            let x = at.model().positions(at.y);
            self.add_residual(at.design.load_state(at.time, &x, Some(&at.model().share)), out);
        }
    }

    fn add_tangent(&self, at: TermState<'_>, matrix: &mut BlockMatrix) {
        if !self.is_empty() {
            let x = at.model().positions(at.y);
            let state = at.design.load_state(at.time, &x, Some(&at.model().share));
            self.tangent(state, |row, column, block| matrix.add(row as usize, column as usize, block));
        }
    }

    fn pull_back_density(&self, at: TermState<'_>, lambda: &[f64], out: &mut [f64]) {
        // R contains minus the external force
        let weights: Vec<f64> = lambda.iter().map(|l| -l).collect();
        at.design.pull_back_masses(at.y, at.time, &weights, out);
    }
}

impl Action {
    fn add(&self, factor: f64, at: LoadState<'_>, out: &mut [f64]) {
        match self {
            Self::Mass(elements, acceleration) => {
                elements.add_forces(acceleration, at.masses, -factor, at.x, |e| at.has_element(e), out);
            }
            _ if !at.has_surfaces() => {}
            Self::Pressure(facets, pressure) => add_pressure(facets, at.x, factor * pressure, out),
            Self::Dead(forces) => {
                for (node, force) in forces {
                    for c in 0..3 {
                        out[3 * *node as usize + c] -= factor * force[c];
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::equations::motion::AmplitudePoint;
    use slipstick_mesh::{BoxShape, box_mesh};
    use slipstick_ranks::threads::on_ranks;

    /// Forces, and products with their derivative, of the parts of three ranks add up to those of the whole.
    #[test]
    fn parts_of_ranks_add_up() {
        let shape = BoxShape { min: [0.0; 3], max: [3.0, 2.0, 2.0], elements: [3, 2, 2], grading: [1.0; 3] };
        let mesh = box_mesh("box", &shape).unwrap();
        let load = |kind: LoadKind| Load {
            surface: String::new(),
            body: None,
            load_case: None,
            kind,
            amplitude: vec![AmplitudePoint { t: 1.0, factor: 1.0 }],
        };
        let rotation = Centrifugal { point: [1.0; 3], direction: [1.0, 0.0, 2.0], angular_velocity: 1.5 };
        let loads = [LoadKind::Pressure(2.0), LoadKind::Gravity([1.0, 2.0, 3.0]), LoadKind::Centrifugal(rotation)];
        let faces = mesh.faces_of_surface(&mesh.surfaces["box_xmax"]);
        let targets = vec![Loaded::Facets(faces), Loaded::Mass(0..6), Loaded::Mass(0..12)];
        let loads = Loads::new(loads.map(load).to_vec(), targets, &mesh, &[], &[]);
        let x: Vec<f64> = mesh.nodes.iter().flatten().enumerate().map(|(i, x)| x + 0.1 * (i as f64).sin()).collect();
        let masses: Vec<f64> = (0..12).map(|e| 1.0 + 0.1 * f64::from(e)).collect();
        let weights: Vec<f64> = (0..x.len()).map(|i| (0.7 * i as f64).cos()).collect();
        let of = |part: Option<&Share>| {
            let at = LoadState { time: LoadTime { case: 0, t: 0.6 }, x: &x, masses: &masses, part };
            let (mut forces, mut product) = (vec![0.0; x.len()], vec![0.0; x.len()]);
            loads.add_residual(at, &mut forces);
            loads.add_transposed_product(at, &weights, &mut product);
            [forces, product].concat()
        };
        let whole = of(None);
        let parts = on_ranks(3, |rank| of(Some(&Share::of(&mesh, &[], Arc::new(rank.clone())))));
        for (i, whole) in whole.iter().enumerate() {
            let sum: f64 = parts.iter().map(|part| part[i]).sum();
            assert!((sum - whole).abs() < 1e-12 * 100.0, "{i}: {sum} {whole}");
        }
        assert!(parts.iter().all(|part| part.iter().any(|x| *x != 0.0)));
    }
}

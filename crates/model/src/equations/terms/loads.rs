//! External forces along the load path.

use crate::equations::dependent::Dependent;
use crate::equations::motion::{Load, LoadKind};
use crate::equations::{LoadTime, Share};
use slipstick_linalg::BlockMatrix;
use slipstick_mesh::{FaceNodes, Reference};
use slipstick_solid::load::{add_pressure, nodal_areas, pressure_tangent};

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
}

impl Loads {
    /// `targets[i]` is the target of `loads[i]`; `coordinates` has three entries per node; `cases`
    /// are the names of the load cases.
    pub fn new(loads: Vec<Load>, targets: Vec<Loaded>, coordinates: &[f64], cases: &[&str]) -> Self {
        let dead = |facets: &[FaceNodes], traction: [f64; 3]| {
            let areas = nodal_areas(facets, coordinates);
            Action::Dead(areas.into_iter().map(|(node, area)| (node, traction.map(|t| t * area))).collect())
        };
        let apply = |(load, target): (Load, Loaded)| {
            let action = match (load.kind, target) {
                (LoadKind::Pressure(pressure), Loaded::Facets(facets)) => Action::Pressure(facets, pressure),
                (LoadKind::Traction(traction), Loaded::Facets(facets)) => dead(&facets, traction),
                (LoadKind::Force(force), Loaded::Facets(facets)) => {
                    let area: f64 = nodal_areas(&facets, coordinates).iter().map(|(_, area)| area).sum();
                    dead(&facets, force.map(|f| f / area))
                }
                (LoadKind::Force(force), Loaded::Body(body)) => Action::Dead(vec![(body.node, force)]),
                (LoadKind::Moment(moment), Loaded::Body(body)) => {
                    Action::Dead(vec![(body.node + 1, moment.map(|m| m / body.length))])
                }
                (LoadKind::NodalForce(force), Loaded::Nodes(nodes)) => {
                    Action::Dead(nodes.into_iter().map(|node| (node, force)).collect())
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

    /// Adds the negative external force at a time and positions `x`, which is its
    /// contribution to R. \[F\]
    pub fn add_residual(&self, time: LoadTime, x: &[f64], out: &mut [f64]) {
        for applied in &self.loads {
            applied.action.add(applied.factor(time), x, out);
        }
    }

    /// Calls `add` with the blocks of the derivative of [`add_residual`](Self::add_residual) with
    /// respect to the positions.
    fn tangent(&self, time: LoadTime, x: &[f64], mut add: impl FnMut(u32, u32, &[f64; 9])) {
        for applied in &self.loads {
            if let Action::Pressure(facets, pressure) = &applied.action {
                pressure_tangent(facets, x, pressure * applied.factor(time), &mut add);
            }
        }
    }

    /// Adds the couplings of that derivative to the rows of a part of the model, if this part has
    /// the loads.
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

    /// Adds that derivative to a matrix over all nodes.
    pub fn add_tangent(&self, time: LoadTime, x: &[f64], matrix: &mut BlockMatrix) {
        self.tangent(time, x, |row, column, block| matrix.add(row as usize, column as usize, block));
    }

    /// Adds the transpose of that derivative times `weights`.
    pub fn add_transposed_product(&self, time: LoadTime, x: &[f64], weights: &[f64], out: &mut [f64]) {
        self.tangent(time, x, |row, column, block| {
            for (at, value) in block.iter().enumerate() {
                out[3 * column as usize + at % 3] += value * weights[3 * row as usize + at / 3];
            }
        });
    }

    /// Adds weightsᵀ ∂f_ext/∂a of every load, where a = 1 is a factor on the load.
    pub fn pull_back_amplitudes(&self, time: LoadTime, x: &[f64], weights: &[f64], out: &mut [f64]) {
        let mut residual = vec![0.0; x.len()];
        for (applied, out) in self.loads.iter().zip(out) {
            residual.fill(0.0);
            applied.action.add(applied.factor(time), x, &mut residual);
            *out -= residual.iter().zip(weights).map(|(r, w)| r * w).sum::<f64>();
        }
    }

    /// Numbers of the loads that act only on prescribed displacements, marked in `fixed`.
    pub(in crate::equations) fn idle(&self, fixed: &[bool], dependent: &Dependent, coordinates: &[f64]) -> Vec<usize> {
        let moves_nothing = |applied: &Applied| {
            let mut force = vec![0.0; coordinates.len()];
            applied.action.add(1.0, coordinates, &mut force);
            let largest = force.iter().fold(0.0, |m: f64, f| m.max(f.abs()));
            dependent.pull_back(&vec![0.0; coordinates.len()], &mut force);
            force.iter().zip(fixed).all(|(f, fixed)| *fixed || f.abs() <= 1e-12 * largest)
        };
        (0..self.loads.len()).filter(|&load| moves_nothing(&self.loads[load])).collect()
    }

    /// Largest norm of the external force at any waypoint, on the undeformed bodies. \[F\]
    pub fn largest(&self, coordinates: &[f64]) -> f64 {
        let norm = |time: LoadTime| {
            let mut force = vec![0.0; coordinates.len()];
            self.add_residual(time, coordinates, &mut force);
            force.iter().map(|f| f * f).sum::<f64>().sqrt()
        };
        let times = self.loads.iter().flat_map(|applied| {
            let case = applied.case.unwrap_or(0);
            applied.load.amplitude.iter().map(move |point| LoadTime { case, t: point.t })
        });
        times.map(norm).fold(0.0, f64::max)
    }
}

impl Action {
    fn add(&self, factor: f64, x: &[f64], out: &mut [f64]) {
        match self {
            Self::Pressure(facets, pressure) => add_pressure(facets, x, factor * pressure, out),
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

//! Loaded bodies that nothing holds are moved up to their first contact before a step is solved.
//!
//! This is an initial guess only; it does not change a solution.

use crate::equations::evaluated::{Step, Workspace};
use crate::equations::{ContactModel, Design};
use nalgebra::{DMatrix, Vector3};
use slipstick_mesh::{FacetNodes, FacetTree};
use slipstick_path::{Evaluated, Iteration, StateError, StepProblem, Wanted};

/// Penetration after the approach, relative to the facet size, that closes the first nodes.
const TOUCH: f64 = 1e-4;

/// Corrections of the distance by the weighted gaps of curved surfaces.
const CORRECTIONS: usize = 10;

/// Unbalanced force, relative to the largest load, that counts as zero.
const UNLOADED: f64 = 1e-9;

impl Design {
    /// y with the loaded loose bodies moved along the resultant of their loads to the first contact;
    /// `None` if none can be moved.
    pub(in crate::equations) fn approached(
        &self,
        step: &Step,
        y: &[f64],
        workspace: &mut Workspace,
    ) -> Result<Option<Vec<f64>>, StateError> {
        let model = &*self.model;
        let at = self.evaluate(step, y, None, Iteration::default(), Wanted::Both, workspace)?;
        let Some(basis) = &at.state.free.basis else { return Ok(None) };
        let velocities = model.velocities(step, &at, basis);
        if velocities.iter().all(|v| *v == Vector3::zeros()) {
            return Ok(None);
        }
        let Some(distance) = model.distance_ahead(&at.unknowns, &velocities) else { return Ok(None) };
        let mut moved = model.shifted(&at.unknowns, &velocities, distance);
        for _ in 0..CORRECTIONS {
            let Some(missing) = self.missing(step, &moved, &velocities, workspace)? else { break };
            moved = model.shifted(&moved, &velocities, missing);
        }
        Ok(Some(moved))
    }

    /// Further distance after which the first slave node in front of a moving body closes, with the
    /// weighted gaps at `y`; `None` if one is closed.
    fn missing(
        &self,
        step: &Step,
        y: &[f64],
        velocities: &[Vector3<f64>],
        workspace: &mut Workspace,
    ) -> Result<Option<f64>, StateError> {
        let model = &*self.model;
        let at = self.evaluate(step, y, None, Iteration::default(), Wanted::Residual, workspace)?;
        let mut nearest = f64::INFINITY;
        for (j, now, node) in at.state.nodes_here() {
            let Some(&master) = now.support.get(now.ring).filter(|_| node.measures.covered()) else { continue };
            let relative = model.velocity_of(now.node, velocities) - model.velocity_of(master, velocities);
            let closing = now.frame.vector(0).dot(&relative);
            if closing > 0.1 * relative.norm() {
                let gap = node.measures.gap / node.measures.area + TOUCH * model.slaves[j].size;
                nearest = nearest.min(gap / closing);
            }
        }
        let nearest = -model.share.largest(-nearest);
        Ok((nearest > 0.0 && nearest.is_finite()).then_some(nearest))
    }
}

impl ContactModel {
    /// Velocity of each loose body: the translation, in proportion to the unbalanced force along free
    /// motions, with the largest of norm 1.
    fn velocities(&self, step: &Step, at: &Evaluated<Design>, basis: &DMatrix<f64>) -> Vec<Vector3<f64>> {
        let modes = self.rigid_motions(&at.unknowns);
        let unbalanced = self.without_holding(step, at);
        let bodies = &self.loose.bodies;
        // the residual of rigid bodies is gathered in their unknowns
        let load: Vec<f64> = modes
            .iter()
            .enumerate()
            .map(|(k, mode)| -bodies[k / 6].unknowns.clone().map(|i| mode[i] * unbalanced[i]).sum::<f64>())
            .collect();
        let q = basis * (basis.transpose() * DMatrix::from_column_slice(load.len(), 1, &load));
        let fastest = q.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let mut velocities: Vec<Vector3<f64>> = (0..bodies.len())
            .map(|b| Vector3::new(q[6 * b], q[6 * b + 1], q[6 * b + 2]))
            .map(|v| if v.norm() > 1e-3 * fastest { v } else { Vector3::zeros() })
            .collect();
        let norm = velocities.iter().map(Vector3::norm).fold(0.0, f64::max);
        let scale = load.iter().fold(self.floors.force, |m, v| m.max(v.abs()));
        if norm <= UNLOADED * scale {
            return vec![Vector3::zeros(); bodies.len()];
        }
        velocities.iter_mut().for_each(|v| *v /= norm);
        // the translation alone must be free
        let mut shift = DMatrix::zeros(modes.len(), 1);
        velocities.iter().enumerate().for_each(|(b, v)| (0..3).for_each(|c| shift[6 * b + c] = v[c]));
        let kept = basis * (basis.transpose() * &shift);
        for (b, v) in velocities.iter_mut().enumerate() {
            if (kept.rows(6 * b, 6) - shift.rows(6 * b, 6)).norm() > 1e-6 {
                *v = Vector3::zeros();
            }
        }
        velocities
    }

    fn velocity_of(&self, node: u32, velocities: &[Vector3<f64>]) -> Vector3<f64> {
        let bodies = self.loose.bodies.iter().zip(velocities);
        let mut of = bodies.filter(|(body, _)| body.nodes.contains(&(node as usize)));
        of.next().map_or_else(Vector3::zeros, |(_, v)| *v)
    }

    /// y with the bodies moved by `distance` times their velocities.
    fn shifted(&self, y: &[f64], velocities: &[Vector3<f64>], distance: f64) -> Vec<f64> {
        let (mut moved, fixed) = (y.to_vec(), self.prescribed.fixed());
        for (body, v) in self.loose.bodies.iter().zip(velocities) {
            let translated = body.unknowns.start..body.translations_end();
            for i in translated.filter(|&i| !fixed[i]) {
                moved[i] += distance * v[i % 3];
            }
        }
        self.placed(&moved).into_owned()
    }

    /// Distance, in multiples of the velocities, to the first contact of nodes with facets; `None` if
    /// there is none ahead.
    fn distance_ahead(&self, y: &[f64], velocities: &[Vector3<f64>]) -> Option<f64> {
        let x = self.contact_positions(y);
        let mut nearest = f64::INFINITY;
        for model in &self.interfaces {
            let sides = [model.interface.slave_facets(), model.interface.master_facets()];
            for (nodes, facets) in [(sides[0], sides[1]), (sides[1], sides[0])] {
                let tree = FacetTree::build(facets, &x);
                let mut list: Vec<u32> = nodes.iter().flatten().copied().collect();
                list.sort_unstable();
                list.dedup();
                for node in list {
                    nearest = nearest.min(self.node_ahead(node, facets, &tree, &x, velocities, nearest));
                }
            }
        }
        nearest.is_finite().then_some(nearest)
    }

    fn node_ahead(
        &self,
        node: u32,
        facets: &[FacetNodes],
        tree: &FacetTree,
        x: &[f64],
        velocities: &[Vector3<f64>],
        nearest: f64,
    ) -> f64 {
        let at = |node: u32| Vector3::from_column_slice(&x[3 * node as usize..][..3]);
        let (own, from) = (self.velocity_of(node, velocities), at(node));
        let mut nearest = nearest;
        let mut hits = Vec::new();
        // velocities of the facets' bodies, of which there are few
        let mut others: Vec<Vector3<f64>> = velocities.to_vec();
        others.push(Vector3::zeros());
        for other in others {
            let v = own - other;
            if v.norm() < 1e-9 {
                continue;
            }
            let reach = if nearest.is_finite() { nearest } else { self.extent(x) / v.norm() };
            let end = from + v * reach;
            hits.clear();
            let low = std::array::from_fn(|c| from[c].min(end[c]) - 1e-9 * reach);
            let high = std::array::from_fn(|c| from[c].max(end[c]) + 1e-9 * reach);
            tree.query(low, high, &mut hits);
            for &hit in &hits {
                let facet = &facets[hit as usize];
                let corners: Vec<u32> = facet.iter().copied().collect();
                if corners.contains(&node) || (self.velocity_of(corners[0], velocities) - other).norm() > 1e-12 {
                    continue;
                }
                let points: Vec<Vector3<f64>> = corners.iter().map(|&c| at(c)).collect();
                for k in 1..points.len() - 1 {
                    if let Some(s) = ray(&from, &v, [&points[0], &points[k], &points[k + 1]]) {
                        nearest = nearest.min(s);
                    }
                }
            }
        }
        nearest
    }

    /// Diagonal of the bounding box of all nodes.
    fn extent(&self, x: &[f64]) -> f64 {
        let range = |c: usize| {
            let along = x.iter().skip(c).step_by(3);
            along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &x| (low.min(x), high.max(x)))
        };
        (0..3).map(range).map(|(low, high)| (high - low).powi(2)).sum::<f64>().sqrt()
    }
}

/// Distance along v at which a ray meets the front of a triangle, if it does.
fn ray(from: &Vector3<f64>, v: &Vector3<f64>, [a, b, c]: [&Vector3<f64>; 3]) -> Option<f64> {
    let normal = (b - a).cross(&(c - a));
    let towards = normal.dot(v);
    // facets face outwards
    if towards >= -1e-9 * normal.norm() * v.norm() {
        return None;
    }
    let s = normal.dot(&(a - from)) / towards;
    let at = from + v * s;
    let near = -1e-9 * normal.norm_squared();
    let inside = |p: &Vector3<f64>, q: &Vector3<f64>| normal.dot(&(q - p).cross(&(at - p))) >= near;
    let ahead = s * v.norm() > -1e-9 * normal.norm().sqrt();
    (ahead && inside(a, b) && inside(b, c) && inside(c, a)).then_some(s.max(0.0))
}

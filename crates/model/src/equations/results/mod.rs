//! Contact results of a state: the traction at each slave node, and nodal fields whose integrals
//! are the forces.
//!
//! A multiplier ζ_j belongs to the mortar row of slave node j. It acts on the covered part of the
//! surface, over the tributary area A_j = Σ_k D_jk, while its shape function extends over whole
//! facets. On a partly covered facet, multipliers are therefore coefficients, not pressures at
//! their nodes, and their integral over the surface is not the force. The bodies are subject to the
//! nodal contact force f = Dᵀz. Divided by the whole area around the node, a_k = ∫ N_k dA, it is
//! the traction whose integral over the surface is the resultant, for any overlap:
//!
//! ```text
//! f_k = Σ_j D_jk z_j      f_l = −Σ_j M_jl z_j      t_k = −f_k / a_k      p_k = Σ_j D_jk ζ_nj / a_k
//! ```

pub(in crate::equations) mod element_fields;
pub(in crate::equations) mod observed;
pub(in crate::equations) mod stored;
pub(in crate::equations) mod thermal;

use crate::equations::evaluated::{ContactState, NodeState};
use crate::equations::{ContactModel, Design, ModelInterface};
use slipstick_contact::ContactStatus;
use slipstick_contact::kinematics::NodeKinematics;
use slipstick_mesh::{FacetCorners, FacetNodes, facet_corner_areas};
use slipstick_path::{LoadTime, StateError, StepState};
use std::collections::BTreeMap;

/// Contact results at the mortar row of a slave node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NodalContact {
    /// Global node number.
    pub node: u32,
    /// Open, stick or slip.
    pub status: ContactStatus,
    /// Multiplier ζ = (normal, ξ, η) in the node's frame, minus the slave traction on the covered
    /// part of the surface; normal ≥ 0 in compression. \[F/L²\]
    pub multiplier: [f64; 3],
    /// The multiplier as a vector z. \[F/L²\]
    pub global_multiplier: [f64; 3],
    /// Weighted gap over tributary area, ≥ 0 open; `None` if no master facet lies opposite. \[L\]
    pub gap: Option<f64>,
    /// Weighted gap g̃. \[L³\]
    pub weighted_gap: f64,
    /// Weighted slip increment ũ_τ of the last (sub-)step. \[L³\]
    pub weighted_slip: [f64; 2],
    /// Slip increment over tributary area. \[L\]
    pub slip: [f64; 2],
    /// Tributary area A_j of the overlap, over which the multiplier acts. \[L²\]
    pub covered_area: f64,
}

/// Contact results of a state. Nodal fields cover the whole mesh and are zero away from contact. With
/// second-order elements, traction and pressure are those at the points of the contact surfaces
/// ([`slipstick_mesh::ContactMap`]); forces act on the nodes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ContactResults {
    /// Mortar rows of all slave nodes, in the order of [`ContactModel::slave_nodes`].
    pub nodes: Vec<NodalContact>,
    /// Force that contact exerts on each node, slave or master: −Dᵀz and Mᵀz; three per node. Over
    /// each pair they add up to zero. \[F\]
    pub force: Vec<f64>,
    /// Traction on the slave surfaces per current area, friction included; three per node. Its
    /// integral over the deformed surface is the resultant force on the slave. \[F/L²\]
    pub traction: Vec<f64>,
    /// Contact pressure on the slave surfaces per current area, ≥ 0 in compression with standard
    /// shapes; one per node. Its integral over the deformed surface is the normal force, as a sum
    /// of magnitudes if the surface is curved. \[F/L²\]
    pub pressure: Vec<f64>,
    /// Largest pressure of each pair on its own slave surface, ≥ 0, and the node that has it. A node of
    /// several pairs has a pressure in each, and their sum in `pressure`. \[F/L²\]
    pub peaks: Vec<(f64, Option<u32>)>,
    /// Row of each slave node that transmits a force: points of the contact surfaces and weights b_jk,
    /// empty for the others. \[L²\]
    pub transfer: Vec<Vec<(u32, f64)>>,
}

/// Forces Σ_j b_jk z_j at the points k of the surfaces of a pair, from its slave nodes and their
/// [`transfer`](ContactResults::transfer): of slave and master with opposite signs. \[F\]
pub(crate) fn point_forces(nodes: &[NodalContact], rows: &[Vec<(u32, f64)>]) -> BTreeMap<u32, [f64; 3]> {
    let mut forces: BTreeMap<u32, [f64; 3]> = BTreeMap::new();
    for (at, row) in nodes.iter().zip(rows) {
        for &(point, b) in row {
            let force = forces.entry(point).or_default();
            (0..3).for_each(|c| force[c] += b * at.global_multiplier[c]);
        }
    }
    forces
}

impl Design {
    /// Contact results of all slave nodes at a state and its pseudo-time; any rank may call it without the others.
    ///
    /// # Errors
    /// If the state cannot be evaluated.
    pub fn contact_results(
        &self,
        previous: &StepState,
        state: &StepState,
        time: LoadTime,
    ) -> Result<ContactResults, StateError> {
        let contact = self.contact_at(previous, &state.unknowns, time, false)?;
        Ok(contact.results(&self.model, &self.model.contact_positions(&state.unknowns)))
    }
}

impl ContactState {
    /// Contact results at positions `x` of the points of the contact surfaces.
    pub(crate) fn results(&self, model: &ContactModel, x: &[f64]) -> ContactResults {
        let nodes: Vec<NodalContact> = self.nodes_here().map(|(_, now, node)| NodalContact::of(now, node)).collect();
        let mut force = vec![0.0; x.len()];
        let (mut traction, mut pressure) = (vec![0.0; x.len()], vec![0.0; x.len() / 3]);
        for (at, (j, now, _)) in nodes.iter().zip(self.nodes_here()) {
            // the other side of a surface that touches itself is a slave too
            let with_itself = model.pair(&model.slaves[j]).interface.is_with_itself();
            for (s, (&node, b)) in now.support.iter().zip(now.force_row().0).enumerate() {
                for (c, z) in at.global_multiplier.iter().enumerate() {
                    // minus: b z is the force of the slave's surroundings on the contact
                    force[3 * node as usize + c] -= b * z;
                    if s < now.ring || with_itself {
                        traction[3 * node as usize + c] -= b * z;
                    }
                }
                if s < now.ring || with_itself {
                    pressure[node as usize] += if s < now.ring { *b } else { -b } * at.multiplier[0];
                }
            }
        }
        for (node, area) in model.surface_areas(x).into_iter().enumerate().filter(|(_, area)| *area > 0.0) {
            pressure[node] /= area;
            traction[3 * node..3 * node + 3].iter_mut().for_each(|t| *t /= area);
        }
        model.pull_to_nodes(&mut force);
        let row = |(at, (_, now, _)): (&NodalContact, (usize, &NodeKinematics, &NodeState))| match at.multiplier {
            [0.0, 0.0, 0.0] => Vec::new(),
            _ => now.support.iter().copied().zip(now.force_row().0.iter().copied()).collect(),
        };
        let transfer = nodes.iter().zip(self.nodes_here()).map(row).collect();
        let peaks = self.peaks(model, x);
        ContactResults { nodes, force, traction, pressure, peaks, transfer }
    }

    /// [`ContactResults::peaks`].
    fn peaks(&self, model: &ContactModel, x: &[f64]) -> Vec<(f64, Option<u32>)> {
        let mut forces = vec![BTreeMap::<u32, f64>::new(); model.interfaces.len()];
        for (j, now, node) in self.nodes_here() {
            let (slave, normal) = (&model.slaves[j], node.law.value()[0]);
            let with_itself = model.pair(slave).interface.is_with_itself();
            for (s, (&point, b)) in now.support.iter().zip(now.force_row().0).enumerate() {
                let weight = if s < now.ring { *b } else { -b };
                if normal != 0.0 && (s < now.ring || with_itself) {
                    *forces[slave.interface as usize].entry(point).or_default() += weight * normal;
                }
            }
        }
        let peak = |(forces, pair): (BTreeMap<u32, f64>, &ModelInterface)| {
            let loaded = |facet: &&FacetNodes| facet.iter().any(|node| forces.contains_key(node));
            let mut areas = BTreeMap::<u32, f64>::new();
            let corners = areas_around(pair.interface.slave_facets().iter().filter(loaded), x);
            corners.for_each(|(node, area)| *areas.entry(node).or_default() += area);
            // a row may name points of the body beyond the surface, with coefficients of zero
            let pressures = forces.iter().filter_map(|(&node, force)| Some((force / areas.get(&node)?, node)));
            let larger =
                |(peak, at), (pressure, node)| if pressure > peak { (pressure, Some(node)) } else { (peak, at) };
            pressures.fold((0.0, None), larger)
        };
        forces.into_iter().zip(&model.interfaces).map(peak).collect()
    }
}

impl NodalContact {
    fn of(now: &NodeKinematics, node: &NodeState) -> Self {
        let (at, value) = (&node.measures, node.law.value());
        let per_area = |v: f64| if at.covered() { v / at.area } else { 0.0 };
        Self {
            node: now.node,
            status: node.law.status(),
            multiplier: value.into(),
            global_multiplier: now.frame.to_global(&value).into(),
            gap: at.covered().then(|| at.gap / at.area),
            weighted_gap: at.gap,
            weighted_slip: at.slip.into(),
            slip: [per_area(at.slip[0]), per_area(at.slip[1])],
            covered_area: at.area,
        }
    }
}

impl ContactModel {
    /// a_k = ∫ N_k dA over all slave surfaces at positions `x`, for every node; zero away from
    /// them. Facets that are slaves in several pairs count once. \[L²\]
    fn surface_areas(&self, x: &[f64]) -> Vec<f64> {
        let mut counted = std::collections::HashSet::new();
        let facets = self.interfaces.iter().flat_map(|model| model.interface.slave_facets());
        let mut areas = vec![0.0; x.len() / 3];
        areas_around(facets.filter(|facet| counted.insert(**facet)), x)
            .for_each(|(node, area)| areas[node as usize] += area);
        areas
    }
}

/// Areas ∫ N_k dA of facets, corner by corner, at positions `x`. \[L²\]
fn areas_around<'a>(facets: impl Iterator<Item = &'a FacetNodes>, x: &[f64]) -> impl Iterator<Item = (u32, f64)> {
    let position = |node: u32| std::array::from_fn(|c| x[3 * node as usize + c]);
    facets.flat_map(move |facet| {
        let corners = match facet[..] {
            [a, b, c] => Some(FacetCorners::Triangle([a, b, c].map(position))),
            [a, b, c, d] => Some(FacetCorners::Quadrilateral([a, b, c, d].map(position))),
            _ => None,
        };
        let areas = corners.into_iter().flat_map(|corners| facet_corner_areas(&corners).into_iter());
        facet.iter().copied().zip(areas).collect::<Vec<_>>()
    })
}

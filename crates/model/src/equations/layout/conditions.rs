//! Descriptions of unknowns, of nodes' supports and of nodes' contact conditions, for messages.

use crate::equations::ContactModel;
use crate::equations::evaluated::ContactState;
use slipstick_contact::ContactStatus;
use slipstick_contact::enforcement::Freedom;

/// An unknown of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unknown {
    /// A displacement.
    Displacement {
        /// Global node number.
        node: u32,
        /// 0, 1, 2: along x, y, z.
        axis: usize,
    },
    /// A multiplier component.
    Multiplier {
        /// Position in the order of [`ContactModel::slave_nodes`].
        row: usize,
        /// 0: normal; 1, 2: tangential.
        component: usize,
    },
}

/// How many conditions a contact pair has at a state, and how many displacements can satisfy them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct PairState {
    /// Slave nodes.
    pub nodes: usize,
    /// Those in contact.
    pub closed: usize,
    /// Equations of the closed nodes: one gap each, and the slip components of those that stick.
    pub conditions: usize,
    /// Free displacements in these equations.
    pub free: usize,
}

impl ContactModel {
    /// The unknown with number `index` of a step; `None` beyond the last one.
    pub fn unknown(&self, index: usize) -> Option<Unknown> {
        let (row, component) = (index / 3, index % 3);
        match row.checked_sub(self.displacement_count() / 3) {
            None => u32::try_from(row).ok().map(|node| Unknown::Displacement { node, axis: component }),
            Some(row) => (row < self.slaves.len()).then_some(Unknown::Multiplier { row, component }),
        }
    }

    /// The sets, in backquotes, symmetry planes and rigid bodies that prescribe all of `nodes` along each axis;
    /// empty if one of the nodes is free.
    pub fn holders(&self, nodes: &[u32], axis: usize) -> Vec<String> {
        let dof = |node: u32| 3 * node as usize + axis;
        let mut names: Vec<String> = Vec::new();
        if !nodes.iter().all(|&node| self.prescribed.fixed()[dof(node)]) {
            return names;
        }
        for &node in nodes {
            let sets = self.prescribed.sets(dof(node));
            let other = match self.dependent.rigid.nodes().any(|of| of == node as usize) {
                true => "a rigid body",
                false if self.dependent.linear.is_dependent(dof(node)) => "an equation",
                false => "a symmetry plane",
            };
            let plane = sets.is_empty().then(|| other.to_owned());
            for name in sets.iter().map(|set| format!("`{set}`")).chain(plane) {
                if !names.contains(&name) {
                    names.push(name);
                }
            }
        }
        names
    }

    /// Contact pairs that a node belongs to, and whether it is on the slave surface.
    pub fn pairs_of(&self, node: u32) -> Vec<(usize, bool)> {
        let mut pairs = Vec::new();
        for (i, model) in self.interfaces.iter().enumerate() {
            let on = |facets: &[slipstick_mesh::FacetNodes]| facets.iter().any(|facet| facet.contains(&node));
            if on(model.interface.slave_facets()) {
                pairs.push((i, true));
            } else if on(model.interface.master_facets()) {
                pairs.push((i, false));
            }
        }
        pairs
    }

    /// The pair of a slave node.
    pub fn pair_of_row(&self, row: usize) -> usize {
        self.slaves[row].interface as usize
    }

    /// Slave and master surface of a pair: `` `a` on `b` ``.
    pub fn pair_name(&self, pair: usize) -> String {
        let [slave, master] = &self.interfaces[pair].surfaces;
        format!("`{slave}` on `{master}`")
    }

    /// The conditions of a pair at a state.
    pub fn pair_state(&self, pair: usize, contact: &ContactState) -> PairState {
        let rows = (0..self.slaves.len()).filter(|&row| self.pair_of_row(row) == pair);
        let mut state = PairState { nodes: 0, closed: 0, conditions: 0, free: 0 };
        let mut free: Vec<usize> = Vec::new();
        for row in rows {
            state.nodes += 1;
            let status = contact.status(row);
            let Some(measures) = contact.measures(row).filter(|_| status.is_closed()) else { continue };
            state.closed += 1;
            let slips = match measures.freedom {
                Freedom::Full => 2,
                Freedom::SlipAcross { .. } => 1,
                Freedom::Gap { .. } | Freedom::None => 0,
            };
            state.conditions += 1 + if status == ContactStatus::Stick { slips } else { 0 };
            let support = self.points.map.parents(contact.kinematics.nodes[row].support.iter().copied());
            let dofs = support.into_iter().flat_map(|node| (0..3).map(move |c| 3 * node as usize + c));
            free.extend(dofs.filter(|&dof| !self.prescribed.fixed()[dof]));
        }
        free.sort_unstable();
        free.dedup();
        state.free = free.len();
        state
    }
}

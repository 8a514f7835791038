//! Constant data of the slave nodes, and the bodies' stiffness there at the start design.

use crate::equations::node::NodeSettings;
use crate::equations::{ContactModel, DEFAULT_STIFFNESS, ModelInterface};
use slipstick_mesh::{ContactMap, Mesh};

/// Constant data of a slave node.
#[derive(Debug, Clone, Copy)]
pub(in crate::equations) struct SlaveData {
    pub interface: u32,
    /// Reference area of the slave surface around the node. \[L²\]
    pub area: f64,
    /// Facet size around the node. \[L\]
    pub size: f64,
    /// Initial gap that counts as closed. \[L\]
    pub adjusted: f64,
    /// Mean gap between surfaces at unit distance.
    pub slant: f64,
    /// How many times the area counts, including its mirror images.
    pub images: f64,
}

/// Elements whose moduli determine the bodies' own stiffness at the contact.
#[derive(Debug, Clone, Default)]
pub(in crate::equations) struct ContactElements {
    /// At the facets of each slave node.
    pub of_slaves: Vec<Vec<u32>>,
    /// At the master facets of each interface.
    pub of_masters: Vec<Vec<u32>>,
}

/// The start design, and what it determines for all later ones.
#[derive(Debug, Clone, Default)]
pub(in crate::equations) struct StartDesign {
    /// The density of every element.
    pub density: Vec<f64>,
    /// The bodies' own stiffness E_eff/h at each slave node. \[F/L³\]
    pub local_stiffness: Vec<f64>,
    /// Its logarithmic derivative ∂ln/∂ln E for each body: one list per slave node.
    pub shares: Vec<Vec<f64>>,
    /// Constants of the law of each slave node; they do not change with the design.
    pub settings: Vec<NodeSettings>,
}

impl ContactModel {
    /// Takes these densities as the start design.
    pub(in crate::equations) fn start_at(&mut self, density: Vec<f64>) {
        let (scalings, _) = self.scale(&density);
        let (local_stiffness, shares) = (self.local_stiffness(&scalings), self.stiffness_shares(&scalings));
        let settings = (0..self.slaves.len()).map(|j| self.node_settings(j, local_stiffness[j])).collect();
        self.start = StartDesign { density, local_stiffness, shares, settings };
    }

    fn node_settings(&self, j: usize, local_stiffness: f64) -> NodeSettings {
        let SlaveData { area: reference_area, interface, size, .. } = self.slaves[j];
        let multipliers = self.method_of(j).has_multipliers();
        let edge_stiffness = if multipliers { DEFAULT_STIFFNESS * local_stiffness } else { f64::INFINITY };
        let edge_cover = self.interfaces[interface as usize].edge_cover;
        NodeSettings { reference_area, size, edge_stiffness, edge_cover, multipliers }
    }
}

/// Reference areas, sizes and adjacent elements of all slave nodes.
pub(in crate::equations) fn tables(
    mesh: &Mesh,
    map: &ContactMap,
    interfaces: &[ModelInterface],
) -> (Vec<SlaveData>, ContactElements) {
    let points = map.points(&mesh.nodes);
    let touching = mesh.node_elements();
    let elements_at = |nodes: &mut dyn Iterator<Item = u32>| {
        let mut all: Vec<u32> = nodes.flat_map(|n| touching.of(n as usize).iter().copied()).collect();
        all.sort_unstable();
        all.dedup();
        all
    };
    let (mut slaves, mut elements) = (Vec::new(), ContactElements::default());
    for (i, model) in interfaces.iter().enumerate() {
        let interface = &model.interface;
        let areas: Vec<f64> =
            interface.slave_facets().iter().map(|f| slipstick_mesh::facet_area(&f.corners(&points))).collect();
        for (k, slave) in interface.slave_nodes().iter().enumerate() {
            let around: f64 = slave.facets.iter().map(|&(f, _)| areas[f as usize]).sum();
            let share = |f: u32| areas[f as usize] / interface.slave_facets()[f as usize].len() as f64;
            slaves.push(SlaveData {
                interface: i as u32,
                area: slave.facets.iter().map(|&(f, _)| share(f)).sum(),
                size: (around / slave.facets.len() as f64).sqrt(),
                slant: model.slants.get(k).copied().unwrap_or(1.0),
                adjusted: model.adjusted.get(k).copied().unwrap_or(0.0),
                images: f64::from(1 << slave.mirrored.iter().filter(|&&across| across).count()),
            });
            elements.of_slaves.push(elements_at(&mut std::iter::once(slave.node)));
        }
        elements.of_masters.push(elements_at(&mut interface.master_facets().iter().flatten().copied()));
    }
    (slaves, elements)
}

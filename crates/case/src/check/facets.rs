//! Checks whether the slave facets of a contact pair are fine enough for the master.

use super::{Notice, NoticeKind};
use crate::file::Contact;
use slipstick_contact::ContactInterface;
use slipstick_mesh::{FacetNodes, Mesh, facet_area};
use slipstick_model::words::quantity;

/// Allowed ratio of the lengths of slave and master facets.
const COARSER: f64 = 2.0;

/// A notice if the slave facets are much coarser than the master facets: contact conditions are
/// enforced only at slave nodes, so master nodes between them can penetrate.
pub(super) fn coarse_slave(
    interface: &ContactInterface,
    pair: usize,
    contact: &Contact,
    mesh: &Mesh,
) -> Option<Notice> {
    let [slave, master] = [interface.slave_facets(), interface.master_facets()].map(|facets| median_size(facets, mesh));
    (slave > COARSER * master).then(|| Notice {
        kind: NoticeKind::CoarseSlave,
        path: format!("contact[{pair}].slave"),
        message: format!(
            "facets of the slave `{}` are coarser than those of the master `{}` (median size {} and {}): master nodes \
             can penetrate between slave nodes",
            contact.slave,
            contact.master,
            quantity(slave),
            quantity(master)
        ),
        help: "exchange slave and master, or refine the slave: the finer side should be the slave".into(),
    })
}

/// Median of the square roots of the facets' areas. \[L\]
fn median_size(facets: &[FacetNodes], mesh: &Mesh) -> f64 {
    let mut sizes: Vec<f64> = facets.iter().map(|facet| facet_area(&facet.corners(&mesh.nodes)).sqrt()).collect();
    sizes.sort_unstable_by(f64::total_cmp);
    sizes[sizes.len() / 2]
}

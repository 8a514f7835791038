//! Checks whether the slave facets of a contact pair are fine enough for the master.

use super::{Notice, NoticeKind};
use crate::construct::sides::Side;
use crate::file::Contact;
use slipstick_model::words::quantity;

/// Allowed ratio of the lengths of slave and master facets.
const COARSER: f64 = 2.0;

const HELP: &str = "exchange slave and master, or refine the slave: the finer side should be the slave \
                    (`sides = \"chosen\"` lets the program choose)";

/// A notice if the slave facets are too coarse for the master: much coarser, since contact conditions hold only at
/// slave nodes, so that master nodes between them can penetrate; or larger than those of a convex master on a slave
/// that is not, since it touches within a facet, over which the mean gap is still open; or facets that the rim of a
/// bore crosses (`at_rim`).
pub(super) fn coarse_slave(pair: usize, contact: &Contact, [slave, master]: [Side; 2], at_rim: bool) -> Option<Notice> {
    if at_rim {
        let Contact { slave, master, .. } = contact;
        return Some(Notice {
            kind: NoticeKind::CoarseSlave,
            path: format!("contact[{pair}].slave"),
            message: format!(
                "`{master}` ends at an edge on the inclined slave `{slave}`: the edge touches within slave facets before \
                 the mean gap closes"
            ),
            help: HELP.into(),
        });
    }
    let consequence = match (slave.size > COARSER * master.size, slave.misses(&master)) {
        (true, _) => "master nodes can penetrate between slave nodes",
        (false, true) => "the master is convex, and touches within a slave facet before the mean gap closes",
        (false, false) => return None,
    };
    Some(Notice {
        kind: NoticeKind::CoarseSlave,
        path: format!("contact[{pair}].slave"),
        message: format!(
            "facets of the slave `{}` are coarser than those of the master `{}` (median size {} and {}): {consequence}",
            contact.slave,
            contact.master,
            quantity(slave.size),
            quantity(master.size)
        ),
        help: HELP.into(),
    })
}

//! Supports that begin or end within the load path, for random problems.

use super::problem::{chance, one_of};
use crate::common::Random;
use std::fmt::Write as _;

/// Problems from this seed on are those of quantities with such supports.
pub const FIRST_OF_SUPPORTS: u64 = 12_000;

/// One or two supports: an end of the slab that is let go or held where it is, and nodes that are moved from where
/// they are.
pub fn supports(random: &mut Random) -> String {
    // times count as the ends of three to six load steps
    let mut text = String::new();
    let set = one_of(random, &["slab_xmin", "slab_xmax", "slab_zmax"]);
    let when = match one_of(random, &[0, 1, 2]) {
        0 => format!("until = {:?}", random.within(0.3, 0.6)),
        1 => format!("from = {:?}", random.within(0.2, 0.6)),
        _ => format!("from = {:?}\nuntil = {:?}", random.within(0.02, 0.15), random.within(0.5, 0.65)),
    };
    let components = one_of(random, &["[\"x\"]", "[\"y\", \"z\"]", "[\"x\", \"y\", \"z\"]"]);
    // nodes of the rim may belong to the end
    let end = chance(random, 0.7);
    if end {
        let _ = write!(text, "[[dirichlet]]\nset = \"{set}\"\ncomponents = {components}\n{when}\n");
    }
    for (name, within) in [("corner", "block_ymin"), ("rim", "slab_ymax")] {
        if name == "rim" && end {
            continue;
        }
        let (from, t) = (random.within(0.02, 0.15), random.within(0.5, 1.0));
        let (u, until) = (random.vector(3, 0.01), if chance(random, 0.4) { "until = 0.65\n" } else { "" });
        let _ = write!(
            text,
            "[[set]]\nname = \"{name}\"\nwithin = \"{within}\"\nnearest = [9, 3, 2]\n\
             [[dirichlet]]\nset = \"{name}\"\nfrom = {from:?}\n{until}motion = [{{ t = {t:?}, u = {u:?} }}]\n"
        );
    }
    text
}

//! Gravity, rotation and changes of temperature in random problems.

use std::fmt::Write as _;

use super::curved::FIRST_OF_CURVED;
use super::problem::{FIRST_OF_JOINTS, chance, direction, one_of};
use crate::common::Random;

/// From this place on in each thousand, problems from joints to rigid bodies have mass, under gravity and in a
/// rotation, and expand with temperature.
pub const FIRST_OF_FIELDS: u64 = 500;

pub fn has_fields(seed: u64) -> bool {
    (FIRST_OF_JOINTS..FIRST_OF_CURVED).contains(&seed) && seed % 1000 >= FIRST_OF_FIELDS
}

/// The same case with bodies that have mass and expand; one of both in some cases. Light elements of some designs
/// can be compressed.
pub fn with_fields(seed: u64, text: &str) -> String {
    let mut random = Random::new(!seed ^ 0x3a55);
    let r = &mut random;
    let isotropic = !text.contains("j2_") && !text.contains("orthotropic");
    let void = isotropic && chance(&mut Random::new(!seed ^ 0x701d), 0.3);
    let (heavy, warm) = one_of(r, &[(true, true), (true, false), (false, true)]);
    let mut out = String::new();
    for line in text.lines() {
        // a rigid block does not expand
        let name = out.rfind("name = ").map_or("", |at| &out[at..]);
        let rigid = text.contains("rigid = ") && name.starts_with("name = \"block\"");
        let _ = writeln!(out, "{line}");
        if line.starts_with("place = ") {
            let (density, expansion) = (r.within(0.2, 2.0), r.within(5e-4, 2e-3));
            if heavy {
                let _ = writeln!(out, "mass_density = {density:?}");
            }
            if warm && !rigid {
                let _ = writeln!(out, "thermal_expansion = {expansion:?}");
            }
        }
        if line == "[design]" && void {
            let _ = writeln!(out, "void_poisson_ratio = -0.2\nbulk_p = 2.0");
        }
        if line == "[design]" && heavy && chance(r, 0.5) {
            let _ = writeln!(out, "mass_p = {:?}", r.within(1.0, 3.0));
        }
    }
    if heavy {
        let gravity: [f64; 3] = (direction(r).into_inner() * r.within(3.0, 10.0)).into();
        let body = one_of(r, &["", "body = \"slab\"\n", "body = \"block\"\n"]);
        let (point, axis): (Vec<f64>, [f64; 3]) = (r.vector(3, 5.0), direction(r).into_inner().into());
        let _ = write!(
            out,
            "[[load]]\ngravity = {gravity:?}\namplitude = [{{ t = 0.4, factor = 1.0 }}, {{ t = 1.0, factor = {:?} }}]\n\
             [[load]]\n{body}centrifugal = {{ point = {point:?}, direction = {axis:?}, angular_velocity = {:?} }}\n",
            r.within(-1.0, 1.0),
            r.within(0.5, 2.0)
        );
    }
    if warm {
        let place = one_of(r, &["", "body = \"slab\"\n", "set = \"slab_xmax\"\n", "set = \"slab_ymax\"\n"]);
        let _ = write!(
            out,
            "[[temperature]]\n{place}change = {:?}\namplitude = [{{ t = 0.5, factor = 1.0 }}, {{ t = 1.0, factor = {:?} }}]\n",
            r.within(10.0, 40.0) * if chance(r, 0.5) { 1.0 } else { -1.0 },
            r.within(-0.5, 0.5)
        );
    }
    out
}

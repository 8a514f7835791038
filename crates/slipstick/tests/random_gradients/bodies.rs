//! Bodies that become rigid or plastic.

use std::fmt::Write as _;

use super::problem::chance;
use crate::common::Random;

/// Problems from this seed on have a rigid block, whose rotations are prescribed or free.
pub const FIRST_OF_RIGID: u64 = 7000;

/// The same case with a rigid block. Its reference point is somewhere near its middle. Where rotations are
/// free, a moment acts on it; `rests`: without this, nothing would hold it, so all are prescribed.
pub fn with_rigid_block(random: &mut Random, text: &str, centre: [f64; 3], rests: bool) -> String {
    let start = text.find("name = \"block\"").expect("a block");
    let start = start + text[start..].find("material").expect("a material");
    let end = start + text[start..].find("[[contact]]").expect("a pair");
    let reference = centre.map(|x| x + random.within(-0.1, 0.1));
    let mut out = text.to_owned();
    out.replace_range(start..end, &format!("rigid = {{ reference = {reference:?} }}\n"));
    let start = out.find("set = \"block_ymax\"").expect("a motion");
    let end = start + out[start..].find("[load_path]").expect("a path");
    let held: Vec<&str> =
        ["\"rx\"", "\"ry\"", "\"rz\""].into_iter().filter(|_| chance(random, 0.75) || !rests).collect();
    let motion = out[start..end].replacen("set = \"block_ymax\"", "set = \"block\"", 1);
    let motion = if held.len() == 3 {
        motion
    } else {
        let moves = motion.lines().find(|line| line.starts_with("motion")).expect("a motion");
        let turned: Vec<&str> = moves.split(", angle = ").collect();
        let straight: Vec<&str> =
            turned.iter().skip(1).map(|rest| rest.split_once(' ').expect("a waypoint").1).collect();
        let moves = turned[0].to_owned() + " " + &straight.join(" ");
        let components = [vec!["\"x\"", "\"y\"", "\"z\""], held].concat().join(", ");
        let moment = random.vector(3, 0.3);
        format!(
            "set = \"block\"\ncomponents = [{components}]\n{moves}\n[[load]]\nsurface = \"block\"\nmoment = {moment:?}\n"
        )
    };
    out.replace_range(start..end, &motion);
    let start = out.find("[design]\nbodies = ").expect("a design") + "[design]\n".len();
    let end = start + out[start..].find('\n').expect("a line");
    out.replace_range(start..end, "bodies = [\"slab\"]");
    // multipliers on the nodes of a rigid body may outnumber what they act on
    if !out.contains("penalty") {
        out = out.replace(
            "slave = \"block_ymin\"\nmaster = \"slab_ymax\"",
            "slave = \"slab_ymax\"\nmaster = \"block_ymin\"",
        );
    }
    // a placeholder for the objective that is drawn
    let start = out.find("contact_force = ").expect("an objective");
    let end = start + out[start..].find('\n').expect("a line");
    out.replace_range(start..end, "minimise = { quantity = \"press\" }");
    out + "[[quantity]]\nname = \"press\"\nreaction = { set = \"slab_ymin\", component = \"norm\" }\n"
}

/// Problems from this seed on have plastic bodies, with linear elements or, for odd seeds, quadratic ones.
pub const FIRST_OF_PLASTIC: u64 = 6000;

/// The same case with bodies that yield, and a yield stress with a power of its own in half of the cases.
pub fn with_plastic_bodies(random: &mut Random, text: &str) -> String {
    let mut own_power = chance(random, 0.5);
    let mut out = String::new();
    for line in text.lines().filter(|line| !line.starts_with("energy_interpolation")) {
        if line.starts_with("material") {
            let modulus = random.within(500.0, 2000.0);
            let (poisson, first) = (random.within(0.0, 0.45), modulus * random.within(0.01, 0.04));
            let hardening = modulus * random.within(0.0, 0.2);
            let law = match chance(random, 0.5) {
                true => format!("j2_linear = {{ hardening_modulus = {hardening:?}, "),
                false => format!(
                    "j2_voce = {{ saturation_stress = {:?}, saturation_rate = {:?}, hardening_modulus = {hardening:?}, ",
                    first * random.within(1.0, 2.0),
                    random.within(5.0, 20.0)
                ),
            };
            let elastic = format!("youngs_modulus = {modulus:?}, poisson_ratio = {poisson:?}");
            let _ = writeln!(out, "material = {{ {law}yield_stress = {first:?}, {elastic} }} }}");
            continue;
        }
        let _ = writeln!(out, "{line}");
        if line == "[design]" && std::mem::take(&mut own_power) {
            let _ = writeln!(out, "yield_p = {:?}", random.within(1.0, 4.0));
        }
    }
    out
}

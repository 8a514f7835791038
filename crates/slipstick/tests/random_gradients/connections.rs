//! What joins bodies besides contact: springs, equations and bolts.

use std::fmt::Write as _;

use super::problem::{chance, direction, one_of};
use crate::common::Random;

/// Problems from this seed on are those from [`FIRST_OF_QUANTITIES`] with springs.
pub const FIRST_OF_SPRINGS: u64 = 9000;

/// One to three springs on the bodies: to the ground or between them, in a direction, in all, or along a line.
pub fn springs(random: &mut Random) -> String {
    let mut text = String::new();
    for k in 0..one_of(random, &[1, 2, 3]) {
        let set = one_of(random, &["slab_xmin", "slab_xmax", "block_xmax", "block_zmin", "block_ymin"]);
        let other = if set.starts_with("slab") { "block_xmin" } else { "slab_zmax" };
        let to = one_of(random, &["", "other", "[9.0, -7.0, 8.0]"]).replace("other", &format!("\"{other}\""));
        let axis: [f64; 3] = direction(random).into_inner().into();
        let acts = match one_of(random, &[0, 1, 2]) {
            0 => String::new(),
            1 if !to.is_empty() => "direction = \"line\"\n".into(),
            _ => format!("direction = {axis:?}\n"),
        };
        let to = if to.is_empty() { to } else { format!("to = {to}\n") };
        let stiffness = match one_of(random, &["stiffness", "nodal_stiffness", "stiffness_per_area"]) {
            "nodal_stiffness" => format!("nodal_stiffness = {:?}", random.within(1.0, 30.0)),
            key => format!("{key} = {:?}", random.within(5.0, 200.0)),
        };
        let _ = writeln!(text, "[[spring]]\nname = \"spring_{k}\"\nset = \"{set}\"\n{to}{acts}{stiffness}");
    }
    text
}

/// Problems from this seed on are those from [`FIRST_OF_QUANTITIES`] with equations.
pub const FIRST_OF_EQUATIONS: u64 = 10_000;

/// The mean of a face follows a point, which is driven, sprung or free; that of another face follows a third one
/// in oblique directions; and two nodes move alike along an axis.
pub fn equations(random: &mut Random) -> String {
    let mut text = String::from("[[point]]\nname = \"p\"\nat = [1, 2, 3]\n");
    let axis: [f64; 3] = direction(random).into_inner().into();
    let set = one_of(random, &["slab_xmax", "slab_zmin", "block_xmax", "block_ymin", "slab_ymax"]);
    let _ = write!(
        text,
        "[[equation]]\nterms = [{{ set = \"p\", component = \"x\" }}, {{ set = \"{set}\", component = {axis:?}, factor = {:?}, \
         mean = true }}]\n",
        random.within(-1.5, -0.5)
    );
    match one_of(random, &[0, 1, 2]) {
        0 => {
            let u = random.within(-0.01, 0.01);
            let _ = write!(text, "[[dirichlet]]\nset = \"p\"\nmotion = [{{ t = 1, u = [{u:?}, 0, 0] }}]\n");
        }
        1 => text += "[[spring]]\nname = \"s\"\nset = \"p\"\nstiffness = 60\n",
        _ => {}
    }
    let [first, second] = [0, 1].map(|_| <[f64; 3]>::from(direction(random).into_inner()));
    if chance(random, 0.7) {
        let _ = write!(
            text,
            "[[point]]\nname = \"q\"\nat = [0, 0, 0]\n[[spring]]\nname = \"t\"\nset = \"q\"\nstiffness = 20\n\
             [[equation]]\nterms = [{{ set = \"block_zmax\", component = {first:?}, mean = true }}, {{ set = \"slab_xmin\", \
             component = {second:?}, factor = -0.4, mean = true }}, {{ set = \"q\", component = \"y\" }}]\n"
        );
    }
    if chance(random, 0.6) {
        let set = one_of(random, &["block_xmin", "slab_zmax"]);
        let (at, force, moment) = (random.vector(3, 2.0), random.vector(3, 0.3), random.vector(3, 0.1));
        let held = one_of(random, &["", "[[dirichlet]]\nset = \"end\"\ncomponents = [\"rx\"]\n"]);
        let _ = write!(
            text,
            "[[coupling]]\nname = \"end\"\nset = \"{set}\"\nat = {at:?}\nkind = \"distributing\"\n{held}\
             [[load]]\nsurface = \"end\"\nforce = {force:?}\n[[load]]\nsurface = \"end\"\nmoment = {moment:?}\n"
        );
    }
    if chance(random, 0.7) {
        let axis = one_of(random, &["x", "y", "z"]);
        let _ = write!(
            text,
            "[[set]]\nname = \"one\"\nwithin = \"slab_ymax\"\nnearest = [0, 9, 0]\n\
             [[set]]\nname = \"two\"\nwithin = \"slab_ymax\"\nnearest = [9, 0, 0]\n\
             [[equation]]\nterms = [{{ set = \"one\", component = \"{axis}\" }}, {{ set = \"two\", component = {first:?}, factor = -0.5 }}]\n"
        );
    }
    text
}

/// Problems from this seed on are those from [`FIRST_OF_QUANTITIES`] with a bolt.
pub const FIRST_OF_BOLTS: u64 = 11_000;

/// A rod beside the bodies, which a bolt pulls towards its support; springs join it to one of the bodies.
pub fn bolt(random: &mut Random) -> String {
    let normal = [1.0, random.within(-0.3, 0.3), random.within(-0.3, 0.3)];
    let (first, second) = (random.within(0.2, 3.0), random.within(0.0, 3.0));
    let force = match one_of(random, &[0, 1]) {
        0 => format!("[{{ t = 0.5, force = {first:?} }}]"),
        _ => format!("[{{ t = 0.25, force = {first:?} }}, {{ t = 0.75, force = {second:?} }}]"),
    };
    let (keeps, to) = (one_of(random, &["length", "length", "force"]), one_of(random, &["slab_xmax", "block_xmax"]));
    let stiffness = random.within(20.0, 200.0);
    format!(
        "[[body]]\nname = \"rod\"\nbox = {{ min = [20, 0, 0], max = [23, 1, 1], elements = [3, 1, 1] }}\n\
         material = {{ neo_hooke = {{ youngs_modulus = 150, poisson_ratio = 0.3 }} }}\n\
         [[dirichlet]]\nset = \"rod_xmax\"\n\
         [[spring]]\nname = \"link\"\nset = \"rod_xmin\"\nto = \"{to}\"\nstiffness = {stiffness:?}\n\
         [[bolt]]\nname = \"tie\"\nbody = \"rod\"\nsection = {{ point = [21.7, 0.5, 0.5], normal = {normal:?} }}\n\
         force = {force}\nkeeps = \"{keeps}\"\n"
    )
}

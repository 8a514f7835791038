//! Two bodies that stick to each other, rotated together by a full turn.

use crate::chapter::Chapter;
use crate::finding::Finding;
use crate::solved::{Scene, neo_hooke};
use nalgebra::{Rotation3, Vector3};
use slipstick_contact::ContactStatus;
use std::fmt::Write;

pub fn chapter() -> Chapter {
    Chapter {
        key: "objectivity",
        title: "Objectivity",
        about: "
A block is pressed onto a slab (neo-Hooke, μ = 2, everything sticks) and sheared; then the supports
of both rotate rigidly by 360° in 24 steps about an axis in the direction (1, 2, 3). Stresses and
tractions must rotate with the bodies: tractions in the nodal frames do not change, and after the
full rotation displacements and tractions return to their values. Deviations are relative to the
largest displacement and traction.",
        remarks: "",
        quick: true,
        run: || Some(run()),
    }
}

const TURNS: usize = 24;
/// Steps before the rotation.
const BEFORE: usize = 4;

fn run() -> Vec<Finding> {
    let mut findings = Vec::new();
    for (method, enforcement) in [
        ("Lagrange", "{ lagrange = {} }"),
        ("penalty", "{ penalty = { stiffness = 1e4 } }"),
        ("augmented", "{ augmented = { stiffness = 1e4, tolerance = 1e-11, max_uzawa = 400 } }"),
    ] {
        for shape in ["standard", "dual"] {
            let [on_the_way, tractions, displacements] = turn(enforcement, shape);
            let name = format!("{method}, {shape}");
            findings.push(Finding::at_most(
                format!("{name}: tractions during the rotation, in nodal frames"),
                1e-8,
                on_the_way,
            ));
            findings.push(Finding::at_most(format!("{name}: tractions after 360°, as vectors"), 1e-8, tractions));
            findings.push(Finding::at_most(format!("{name}: displacements after 360°"), 1e-8, displacements));
        }
    }
    findings
}

/// Deviations of tractions in nodal frames during the rotation, and of traction vectors and
/// displacements after it.
fn turn(enforcement: &str, shape: &str) -> [f64; 3] {
    let mut solved = Scene::from(text(enforcement, shape)).solve();
    let start = solved.contact(BEFORE);
    assert!(start.iter().all(|node| node.status == ContactStatus::Stick));
    assert!(
        start.iter().any(|node| node.multiplier[1].hypot(node.multiplier[2]) > 0.05 * node.multiplier[0]),
        "some shear"
    );
    let size = start.iter().map(|node| Vector3::from(node.multiplier).norm()).fold(0.0, f64::max);
    let mut on_the_way: f64 = 0.0;
    for step in BEFORE + 1..=BEFORE + TURNS {
        for (now, then) in solved.contact(step).iter().zip(&start) {
            assert_eq!(now.status, ContactStatus::Stick);
            on_the_way = on_the_way.max((Vector3::from(now.multiplier) - Vector3::from(then.multiplier)).norm() / size);
        }
    }
    let last = BEFORE + TURNS;
    let contact = solved.contact(last);
    let vector = |k: usize| Vector3::from(contact[k].global_multiplier) - Vector3::from(start[k].global_multiplier);
    let tractions = (0..start.len()).map(|k| vector(k).norm() / size).fold(0.0, f64::max);
    let (before, after) = (solved.displacements(BEFORE), solved.displacements(last));
    let largest = before.iter().fold(0.0f64, |a, b| a.max(b.abs()));
    let displacements = before.iter().zip(after).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / largest;
    [on_the_way, tractions, displacements]
}

fn text(enforcement: &str, shape: &str) -> String {
    let material = neo_hooke(1000.0, 0.3);
    let axis = nalgebra::Unit::new_normalize(Vector3::new(1.0, 2.0, 3.0));
    let pressed = Vector3::new(0.03, -0.1, 0.02);
    let steps = (BEFORE + TURNS) as f64;
    let (mut slab, mut block) = (String::new(), String::new());
    for k in 0..=TURNS {
        let t = (BEFORE + k) as f64 / steps;
        let angle = 360.0 * k as f64 / TURNS as f64;
        let u = Rotation3::from_axis_angle(&axis, angle.to_radians()) * pressed;
        let _ = write!(slab, "{{ t = {t:?}, angle = {angle:?} }}, ");
        let _ = write!(block, "{{ t = {t:?}, u = [{:?}, {:?}, {:?}], angle = {angle:?} }}, ", u.x, u.y, u.z);
    }
    format!(
        "[[body]]\nname = 'slab'\nbox = {{ min = [0, 0, 0], max = [2, 1, 1], elements = [3, 1, 2] }}\n{material}\n\
         [[body]]\nname = 'block'\nbox = {{ min = [0.5, 1, 0.1], max = [1.4, 1.8, 0.8], elements = [2, 1, 2] }}\n{material}\n\
         [[contact]]\nslave = 'block_ymin'\nmaster = 'slab_ymax'\nfriction = 2.0\nmultiplier_shape = '{shape}'\n\
         enforcement = {enforcement}\n\
         [[dirichlet]]\nset = 'slab_ymin'\nrotation = {{ point = [0.3, 0.2, 0.1], direction = [1, 2, 3] }}\n\
         motion = [{slab}]\n\
         [[dirichlet]]\nset = 'block_ymax'\nrotation = {{ point = [0.3, 0.2, 0.1], direction = [1, 2, 3] }}\n\
         motion = [{block}]\n\
         [load_path]\nsteps = {}\ntolerance = {{ relative = 1e-12 }}\n",
        BEFORE + TURNS
    )
}

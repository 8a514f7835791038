//! Kinks of the slave surface that are less sharp than its feature angle: the work of frictionless contact
//! there, and gradients.

use super::ends::{pressed, upper_arm};
use super::gradients::{check, methods};
use super::{even, grid};
use crate::common::problem_with;
use crate::common::scene::Scene;
use slipstick_mesh::Mesh;

/// Two elastic arms as in `ends.rs`, the bottom of the upper one with a chamfer of 40° over its last 0.4: the
/// arm bends by less than that, so that the kink touches. `pair`: slave and master. Returns the fraction of the
/// external work that contact takes, and the deflection of the lower arm's end.
fn chamfered(pair: [&str; 2], shape: &str, normals: &str) -> [f64; 2] {
    let mut up = upper_arm();
    for [x, y, _] in &mut up.nodes {
        *y += (*x - 2.6).max(0.0) * f64::to_radians(40.0).tan() * (1.6 - *y) / 0.4;
    }
    pressed(up, -0.9, pair, shape, normals)
}

/// The normal of the kink is that of the face on which it slides: contact takes no work, and the result is that
/// with the face as the slave. Averaged normals are off by up to 20°.
#[test]
fn frictionless_contact_at_a_kink_takes_no_work() {
    let pair = ["up_ymin", "low_ymax"];
    let face = chamfered(["low_ymax", "up_ymin"], "standard", "touched");
    for shape in ["standard", "dual"] {
        let [touched, averaged] = ["touched", "averaged"].map(|normals| chamfered(pair, shape, normals));
        let taken = [touched[0], averaged[0], face[0]].map(|taken| 100.0 * taken);
        let apart = [touched, averaged].map(|kink| 100.0 * (kink[1] / face[1] - 1.0));
        println!("{shape}: taken {taken:.2?} %, deflections {apart:.2?} % apart");
        assert_eq!(chamfered(pair, shape, ""), touched, "the default");
        assert!(touched[0].abs() < 1e-3 && face[0].abs() < 1e-3, "{shape}: {touched:?} {face:?}");
        assert!(averaged[0] > 7e-3, "{shape}: {averaged:?}");
        // the mean gap at the kink, and with it the deflection, depends on the shapes
        let [kink, mean] = apart.map(f64::abs);
        assert!(shape == "dual" || (kink < 0.3 && mean > 2.0), "{shape}: {apart:?}");
    }
}

/// A block whose bottom is a roof upside down, bent by 33° along its middle.
fn ridged() -> Mesh {
    let mut mesh = grid("block", [&even(0.0, 1.0, 2), &even(0.0, 0.8, 1), &even(0.0, 0.8, 1)]);
    for [x, y, _] in &mut mesh.nodes {
        *y -= 0.3 * (0.5 - (*x - 0.5).abs()) * (0.8 - *y) / 0.8;
    }
    mesh
}

/// The ridge is pressed into a slab and dragged along it: its normals depend on both bodies.
#[test]
fn gradient_where_a_kink_touches() {
    for (method, enforcement) in methods() {
        for shape in ["standard", "dual"] {
            let motion = "[{ t = 0.4, u = [0, -0.24, 0] }, { t = 1.0, u = [0.1, -0.25, 0.03] }]".into();
            let (enforcement, slab) = (enforcement.clone(), [3, 1, 2]);
            let scene = Scene { slab, enforcement, shape, friction: 0.3, motion, steps: 5, ..Scene::default() };
            let text = scene.text().replace("multiplier_shape", "normals = \"touched\"\nmultiplier_shape");
            // the block is read from a mesh
            let start = text.find("name = \"block\"\nbox").expect("the block") + "name = \"block\"\n".len();
            let end = start + text[start..].find("place").expect("its place");
            let after = text[end..].replacen("place = {}", "place = { translate = [0.6, 1.15, 0.1] }", 1);
            let text = format!("{}mesh = {{ file = 'block' }}\n{after}", &text[..start]);
            let mut problem = problem_with(&text, &[("block", ridged())]);
            let nodes = problem.analysis.model().interfaces()[0].interface.slave_nodes();
            assert!(nodes.len() == 6 && nodes.iter().all(|slave| !slave.sharp), "{method} {shape}");
            assert_eq!(nodes.iter().filter(|slave| slave.cone.len() == 4).count(), 2, "two parts and a side");
            let (statuses, _) = check(&format!("{method} {shape}"), &mut problem);
            let closed = |state: &Vec<char>| state.iter().any(|status| *status != 'o');
            assert!(statuses.last().is_some_and(closed), "{method} {shape}: {statuses:?}");
        }
    }
}

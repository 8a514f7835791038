//! The contact patch test of Taylor and Papadopoulos (1991) on warped meshes.

use crate::chapter::Chapter;
use crate::finding::Finding;
use crate::mapped::mapped_box;
use crate::solved::{Scene, Solved, neo_hooke};
use nalgebra::Vector3;
use slipstick_contact::ContactStatus;
use std::f64::consts::PI;

pub fn chapter() -> Chapter {
    Chapter {
        key: "patch",
        title: "Contact patch test",
        about: "
In the contact patch test of Taylor and Papadopoulos (1991), an interface between non-matching
meshes must transmit a uniform state of stress exactly. Two upper blocks, side by side, press on one
lower block, so each slave surface covers only part of the master, and slave facets cover only parts
of master facets. The material is neo-Hookean, the engineering strain 0.15. With walls at the sides
the state is uniaxial strain, and the pressure can be computed by hand from the material law. The
inclined interface y = 1 + 0.2 x − 0.1 z sticks and also transmits shear (ν = 0).
`tests/suite/patch.rs` contains further variants: other and graded meshes, two materials, free
sides. Displacements are relative to the prescribed 0.3, tractions to the exact one. In the warped
meshes, nodes of the interface are moved within it by up to 0.15.",
        remarks: "
On facets that are parallelograms, in any position relative to each other, slipstick passes the test
to within round-off. On other quadrilaterals the shape functions of master and slave are not
polynomials over the triangles of an overlap, so the mortar integrals contain the error of the
integration rule (`cell_rule`). This error decreases with the number of points and is small compared
to the discretization error. The same holds for every segment-based method that integrates with
Gauss points.",
        quick: true,
        run: || Some(run()),
    }
}

const PRESSED: f64 = 0.3;

fn run() -> Vec<Finding> {
    let mut findings = Vec::new();
    for shape in ["standard", "dual"] {
        for (name, solve) in [("level", level as fn(&Mesh) -> (f64, f64)), ("inclined, sticking", inclined)] {
            let (strain, traction) = solve(&Mesh { shape, warped: false, rule: 7 });
            findings.push(Finding::at_most(format!("{name}, {shape} shapes: displacements"), 1e-10, strain));
            findings.push(Finding::at_most(format!("{name}, {shape} shapes: nodal tractions"), 1e-10, traction));
        }
        for rule in [6, 7, 12] {
            let (strain, traction) = level(&Mesh { shape, warped: true, rule });
            let name = format!("level, facets warped, {shape} shapes, {rule} points");
            findings.push(Finding::shown(format!("{name}: displacements"), strain));
            findings.push(match rule {
                12 => Finding::at_most(format!("{name}: nodal tractions"), 1e-6, traction),
                _ => Finding::shown(format!("{name}: nodal tractions"), traction),
            });
        }
    }
    findings
}

/// Parameters that vary.
struct Mesh {
    shape: &'static str,
    /// Whether nodes within the faces are moved, so that facets are not parallelograms.
    warped: bool,
    /// Integration points per triangle.
    rule: usize,
}

/// A point of [0, 1]² moved within it; the boundary is unchanged.
fn warp(s: f64, t: f64, by: f64) -> [f64; 2] {
    let bump = by * (PI * s).sin() * (PI * t).sin();
    [s + bump, t - 0.7 * bump]
}

/// Neo-Hooke, stretch λ along one axis: P = 2c (λ − J^(−2β)/λ), c = E/(4(1+ν)), β = ν/(1−2ν).
fn axial_stress(modulus: f64, ratio: f64, stretch: f64) -> f64 {
    let (c, beta) = (modulus / (4.0 * (1.0 + ratio)), ratio / (1.0 - 2.0 * ratio));
    2.0 * c * (stretch - stretch.powf(-2.0 * beta) / stretch)
}

/// Largest deviation of the displacement from u_y = −0.15 y, relative to the prescribed
/// displacement.
fn strain_error(solved: &Solved) -> f64 {
    let last = solved.steps();
    let deviation = |n: usize| {
        let exact = Vector3::new(0.0, -0.5 * PRESSED * solved.problem.mesh.nodes[n][1], 0.0);
        (solved.displacement(n as u32, last) - exact).amax()
    };
    (0..solved.problem.mesh.nodes.len()).map(deviation).fold(0.0, f64::max) / PRESSED
}

fn tail(friction: f64, &Mesh { shape, rule, .. }: &Mesh, slaves: &[&str]) -> String {
    let pair = |slave: &&str| {
        format!(
            "[[contact]]\nslave = '{slave}'\nmaster = 'lower_ymax'\nfriction = {friction:?}\nmultiplier_shape = '{shape}'\ncell_rule = {rule}\n"
        )
    };
    slaves.iter().map(pair).collect::<String>() + "[load_path]\nsteps = 2\ntolerance = { relative = 1e-13 }\n"
}

fn level(mesh: &Mesh) -> (f64, f64) {
    const CUT: f64 = 0.45;
    let mut scene = Scene::default();
    let mut body = |name: &str, elements: [usize; 3], x: [f64; 2], y0: f64, by: f64| {
        let file = mapped_box(name, elements, |[s, y, t]| {
            let [s, t] = if mesh.warped { warp(s, t, by) } else { [s, t] };
            [x[0] + (x[1] - x[0]) * s, y0 + y, t]
        });
        scene.files.insert(format!("{name}.inp"), file);
        scene.text +=
            &format!("[[body]]\nname = '{name}'\nmesh = {{ file = '{name}.inp' }}\n{}\n", neo_hooke(1000.0, 0.3));
    };
    body("lower", [4, 2, 3], [0.0, 1.0], 0.0, 0.1);
    body("left", [2, 2, 4], [0.0, CUT], 1.0, -0.12);
    body("right", [3, 1, 2], [CUT, 1.0], 1.0, 0.15);
    for name in ["lower", "left", "right"] {
        for (component, face) in [("x", "xmin"), ("x", "xmax"), ("z", "zmin"), ("z", "zmax")] {
            scene.text += &format!("[[dirichlet]]\nset = '{name}_{face}'\ncomponents = ['{component}']\n");
        }
        let (face, motion) = match name {
            "lower" => ("ymin", String::new()),
            _ => ("ymax", format!("motion = [{{ t = 1.0, u = [0, -{PRESSED}, 0] }}]\n")),
        };
        scene.text += &format!("[[dirichlet]]\nset = '{name}_{face}'\ncomponents = ['y']\n{motion}");
    }
    scene.text += &tail(0.0, mesh, &["left_ymin", "right_ymin"]);
    let mut solved = scene.solve();
    let pressure = -axial_stress(1000.0, 0.3, 1.0 - 0.5 * PRESSED);
    let contact = solved.contact(2);
    assert!(contact.iter().all(|node| node.status != ContactStatus::Inactive));
    let traction = contact.iter().map(|node| (node.multiplier[0] / pressure - 1.0).abs()).fold(0.0, f64::max);
    (strain_error(&solved), traction)
}

fn inclined(mesh: &Mesh) -> (f64, f64) {
    let mut scene = Scene::default();
    for (name, elements, by, y0) in [("lower", [3, 2, 2], 0.1, 0.0), ("upper", [2, 1, 4], -0.12, 1.0)] {
        let file = mapped_box(name, elements, |[s, y, t]| {
            let [x, z] = if mesh.warped { warp(s, t, by) } else { [s, t] };
            let y = y0 + y;
            [x, y + (1.0 - (y - 1.0).abs()) * (0.2 * x - 0.1 * z), z]
        });
        scene.files.insert(format!("{name}.inp"), file);
        scene.text +=
            &format!("[[body]]\nname = '{name}'\nmesh = {{ file = '{name}.inp' }}\n{}\n", neo_hooke(1000.0, 0.0));
    }
    scene.text += &format!(
        "[[dirichlet]]\nset = 'lower_ymin'\n[[dirichlet]]\nset = 'upper_ymax'\nmotion = [{{ t = 1.0, u = [0, -{PRESSED}, 0] }}]\n"
    );
    scene.text += &tail(2.0, mesh, &["upper_ymin"]);
    let mut solved = scene.solve();
    // σ_yy = P_yy without lateral strain; the slave's outward normal is −n
    let axial = 1.0 - 0.5 * PRESSED;
    let normal = Vector3::new(-0.2 * axial, 1.0, 0.1 * axial).normalize();
    let expected = Vector3::new(0.0, axial_stress(1000.0, 0.0, axial) * normal.y, 0.0);
    let contact = solved.contact(2);
    assert!(contact.iter().all(|node| node.status == ContactStatus::Stick));
    let deviation = |z: [f64; 3]| (Vector3::from(z) - expected).norm() / expected.norm();
    let traction = contact.iter().map(|node| deviation(node.global_multiplier)).fold(0.0, f64::max);
    (strain_error(&solved), traction)
}

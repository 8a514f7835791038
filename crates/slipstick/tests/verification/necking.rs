//! A round bar of steel that necks, against CalculiX and a published load maximum.

use crate::chapter::Chapter;
use crate::finding::Finding;
use crate::solved::{Scene, straight_quadratic};
use std::collections::HashMap;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
use std::fmt::Write;

/// Half of the bar. \[mm\]
const RADIUS: f64 = 6.413;
const LENGTH: f64 = 26.667;
/// Elements along each side of a block of the cross-section, and along the half.
const ACROSS: usize = 2;
const ALONG: usize = 10;

pub fn chapter() -> Chapter {
    Chapter {
        key: "necking",
        title: "A bar of steel that necks, against CalculiX",
        about: "
A round bar (radius 6.413, length 53.334; E = 200,000 MPa, ν = 0.3, a table of yield stresses from
451 to 831 MPa) is held at its ends and stretched. Geometry, material and the elongation of 3.5 mm
per half at the largest force are those of the tutorial *neckingBar* of solids4foam (after Cardiff,
Tuković, De Jaeger, Clancy and Ivanković, IJNME 109, 2017), which reads the elongation from its
curve. CalculiX 2.20 uses the same law at finite strains; both programs use the same 120 elements
with straight edges on an eighth of the bar, CalculiX with 20 nodes and reduced integration
(`C3D20R`), slipstick with 27 nodes and F̄. The force is that on a quarter of the cross-section,
interpolated between CalculiX's increments; the radius is that in the neck.",
        remarks: "",
        quick: false,
        run: || Some(necking()),
    }
}

fn necking() -> Vec<Finding> {
    let fixed = |set: &str, c: &str| format!("[[dirichlet]]\nset = 'bar_{set}'\ncomponents = ['{c}']\n");
    let text = "[[body]]\nname = 'bar'\nmesh = { file = 'bar' }\nelement = 'f_bar'\n\
                material = { j2_table = { youngs_modulus = 200000, poisson_ratio = 0.3, \
                yield_stress = [451, 476, 525, 583, 642, 710, 777, 831], \
                plastic_strain = [0, 0.006, 0.019, 0.038, 0.066, 0.147, 0.5, 1] } }\n"
        .to_owned()
        + &fixed("X0", "x")
        + &fixed("Y0", "y")
        + &fixed("Z0", "z")
        + "[[dirichlet]]\nset = 'bar_TOP'\nmotion = [{ t = 1, u = [0, 0, 4.9] }]\n[load_path]\nsteps = 49\n";
    let solved = Scene { text, files: HashMap::from([("bar".to_owned(), straight_quadratic(&mesh(), "bar"))]) }.solve();
    let force = |step: usize| solved.reaction("bar_TOP", step).z;
    let largest = (1..=49).max_by(|&a, &b| force(a).total_cmp(&force(b))).expect("steps");
    let neck = solved.problem.mesh.nodes.iter().position(|x| (x[0] - RADIUS).abs() < 1e-9 && x[2] == 0.0);
    let radius = |step: usize| solved.position(neck.expect("a node in the neck") as u32, step).x;
    // ccx 2.20, C3D20R, increments of at most 0.07 mm: elongation of the half in 0.1 mm, force, radius
    let found = [(14, 18370.92, 6.236283), (28, 19154.66, 6.036599), (49, 16586.19, 5.070357)];
    let mut findings =
        vec![Finding::value("elongation of the half at the largest force", 3.5, 0.03, 0.1 * largest as f64)];
    for (step, ccx, narrow) in found {
        let at = 0.1 * step as f64;
        findings.push(Finding::value(format!("force at {at:.1}"), ccx, 1e-2, force(step)));
        findings.push(Finding::value(format!("radius at {at:.1}"), narrow, 1e-2, radius(step)));
    }
    findings
}

/// A deck of three blocks on a quarter of the cross-section, finer towards the neck.
fn mesh() -> String {
    let between = |a: [f64; 2], b: [f64; 2], s: f64| [0, 1].map(|c| a[c] + s * (b[c] - a[c]));
    let arc = |angle: f64| [RADIUS * angle.cos(), RADIUS * angle.sin()];
    let side = 0.55 * RADIUS;
    let (corner, right, top) = ([0.85 * side; 2], [side, 0.0], [0.0, side]);
    let block = |b: usize, s: f64, t: f64| match b {
        0 => between(between([0.0; 2], right, s), between(top, corner, s), t),
        1 => between(between(right, corner, t), arc(t * FRAC_PI_4), s),
        _ => between(between(top, corner, s), arc(FRAC_PI_2 - s * FRAC_PI_4), t),
    };
    let height = |k: usize| LENGTH * (k as f64 / ALONG as f64).powf(1.5);
    let mut nodes: Vec<[f64; 3]> = Vec::new();
    let mut node = |x: [f64; 2], z: f64| {
        let x = [x[0], x[1], z];
        let same = |y: &[f64; 3]| x.iter().zip(y).all(|(x, y)| (x - y).abs() < 1e-9);
        1 + nodes.iter().position(same).unwrap_or_else(|| {
            nodes.push(x.map(|x| if x.abs() < 1e-9 { 0.0 } else { x }));
            nodes.len() - 1
        })
    };
    let mut elements = String::new();
    let mut number = 0;
    for b in 0..3 {
        for (i, j) in (0..ACROSS).flat_map(|i| (0..ACROSS).map(move |j| (i, j))) {
            let at = |i: usize, j: usize| block(b, i as f64 / ACROSS as f64, j as f64 / ACROSS as f64);
            let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            for k in 0..ALONG {
                number += 1;
                let of = [k, k + 1].map(|k| corners.map(|x| node(x, height(k)).to_string()).join(", "));
                writeln!(elements, "{number}, {}", of.join(", ")).expect("a string");
            }
        }
    }
    let mut text = "*NODE\n".to_owned();
    for (n, [x, y, z]) in (1..).zip(&nodes) {
        writeln!(text, "{n}, {x:?}, {y:?}, {z:?}").expect("a string");
    }
    text += "*ELEMENT, TYPE=C3D8, ELSET=bar\n";
    text += &elements;
    for (name, axis, value) in [("X0", 0, 0.0), ("Y0", 1, 0.0), ("Z0", 2, 0.0), ("TOP", 2, height(ALONG))] {
        writeln!(text, "*NSET, NSET={name}").expect("a string");
        let on = (1..).zip(&nodes).filter(|(_, x)| x[axis] == value);
        on.for_each(|(n, _)| writeln!(text, "{n},").expect("a string"));
    }
    text
}

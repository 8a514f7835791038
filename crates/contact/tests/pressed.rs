//! Rows of a pressure at the integration points: their derivatives, and the resultants of their forces.

use nalgebra::Vector3;
use slipstick_contact::enforcement::soft::PressureLaw;
use slipstick_contact::kinematics::{CellRule, MultiplierShape, NodeKinematics};
use slipstick_contact::{ContactInterface, InterfaceOptions};

/// Two warped slave facets that face down, over four warped master facets.
fn scene() -> (ContactInterface, Vec<f64>) {
    let mut x = Vec::new();
    for (i, j) in (0..3).flat_map(|i| (0..2).map(move |j| (f64::from(i), f64::from(j)))) {
        x.extend([0.6 * i + 0.03 * j, j - 0.05 * i, 0.03 * (2.0 * i + 3.0 * j).sin() - 0.02]);
    }
    for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (f64::from(i), f64::from(j)))) {
        x.extend([0.13 + 0.7 * i + 0.02 * j, -0.2 + 0.71 * j, 0.02 * (i + 2.0 * j).cos()]);
    }
    let slaves = vec![[0, 1, 3, 2].into(), [2, 3, 5, 4].into()];
    let at = |i: u32, j: u32| 6 + 3 * i + j;
    let masters = (0..2).flat_map(|i| (0..2).map(move |j| (i, j)));
    let masters = masters.map(|(i, j)| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)].into()).collect();
    let (shape, rule) = (MultiplierShape::Dual, CellRule::Seven);
    let options = InterfaceOptions { shape, rule, reach: 0.5, feature_angle: 0.8 };
    (ContactInterface::new(slaves, masters, &x, options).unwrap(), x)
}

const OFFSETS: [f64; 6] = [0.02, 0.0, -0.01, 0.03, 0.01, 0.015];

fn rows(interface: &ContactInterface, x: &[f64], law: &PressureLaw, gradient: bool) -> Vec<NodeKinematics> {
    let mut rows = Vec::new();
    let mut workspace = interface.workspace(|_| true);
    interface.evaluate_pressed(x, gradient, Some((law, &OFFSETS)), &mut workspace, &mut rows).unwrap();
    rows
}

fn law() -> PressureLaw {
    PressureLaw::Exponential { contact_pressure: 2.0, clearance: 0.5 }
}

#[test]
fn pressed_rows_match_finite_differences() {
    let (interface, x) = scene();
    let base = rows(&interface, &x, &law(), true);
    let values = |row: &NodeKinematics| {
        let pressed = row.pressed.as_ref().expect("a pressure");
        [&pressed.coefficient[..], &[pressed.load]].concat()
    };
    let mut worst: f64 = 0.0;
    for (j, row) in base.iter().enumerate() {
        let pressed = row.pressed.as_ref().expect("a pressure");
        assert!(pressed.load > 0.01);
        let columns = 3 * row.support.len();
        for t in 0..columns {
            let at = |h: f64| {
                let mut x = x.clone();
                x[3 * row.support[t / 3] as usize + t % 3] += h;
                let moved = &rows(&interface, &x, &law(), false)[j];
                assert_eq!(moved.support, row.support);
                values(moved)
            };
            let (p1, m1, p2, m2) = (at(1e-4), at(-1e-4), at(2e-4), at(-2e-4));
            for e in 0..p1.len() {
                let difference = (8.0 * (p1[e] - m1[e]) - (p2[e] - m2[e])) / 12e-4;
                let exact = pressed.gradient.get(e * columns + t).unwrap_or(&pressed.load_gradient[t]);
                worst = worst.max((difference - exact).abs());
            }
        }
    }
    println!("{worst:.1e}");
    assert!(worst < 2e-8, "{worst:e}");
}

/// Forces of both sides balance, and so do their moments where the facets coincide with the auxiliary plane: the row
/// sums to zero, and its slave part to the area of the mortar row.
#[test]
fn pressed_rows_are_balanced() {
    let (interface, x) = scene();
    for row in rows(&interface, &x, &law(), false) {
        let pressed = row.pressed.as_ref().expect("a pressure");
        assert!(pressed.coefficient.iter().sum::<f64>().abs() < 1e-14);
        assert!((pressed.coefficient[..row.ring].iter().sum::<f64>() - row.area).abs() < 1e-14);
    }
}

/// A rigid unit square, tilted by a small angle about an axis through its middle into a flat master, with a stiffness
/// K: by hand, the load is K times the mean penetration, and the moment K/12 times the tilt.
#[test]
fn the_moment_of_a_tilted_facet_is_that_of_its_second_moment_of_area() {
    let (tilt, depth) = (1e-3, 0.01);
    let at = |x: f64, y: f64| [x, y, -depth - tilt * x];
    let slave = [at(-0.5, -0.5), at(-0.5, 0.5), at(0.5, 0.5), at(0.5, -0.5)];
    let master = [[-2.0, -2.0, 0.0], [2.0, -2.0, 0.0], [2.0, 2.0, 0.0], [-2.0, 2.0, 0.0]];
    let x = [slave, master].concat().concat();
    for shape in [MultiplierShape::Standard, MultiplierShape::Dual, MultiplierShape::Mean] {
        let options = InterfaceOptions { shape, rule: CellRule::Seven, reach: 0.5, feature_angle: 0.8 };
        let interface =
            ContactInterface::new(vec![[0, 1, 2, 3].into()], vec![[4, 5, 6, 7].into()], &x, options).unwrap();
        let mut out = Vec::new();
        let pressure = Some((&PressureLaw::Proportional, &[0.0; 4][..]));
        interface.evaluate_pressed(&x, false, pressure, &mut interface.workspace(|_| true), &mut out).unwrap();
        let [mut force, mut moment] = [0.0; 2];
        for row in &out {
            let pressed = row.pressed.as_ref().expect("a pressure");
            let z = row.frame.to_global(&Vector3::new(pressed.load / row.area, 0.0, 0.0));
            for (&node, b) in row.support.iter().zip(&pressed.coefficient).take(row.ring) {
                force -= b * z[2];
                moment += b * z[2] * x[3 * node as usize];
            }
        }
        assert!((force - depth).abs() < 1e-6 * depth, "{shape:?}: {force}");
        assert!((moment + tilt / 12.0).abs() < 1e-6 * tilt, "{shape:?}: {moment}");
    }
}

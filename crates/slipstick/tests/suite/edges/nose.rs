//! A body whose sharp edge slides on a flat face: Coulomb's ratio with either choice of sides, and
//! no jumps.

use super::overhang::largest;
use super::{body, even, grid, solve};
use crate::solved::{Solved, neo_hooke};
use nalgebra::{Rotation3, Vector3};
use slipstick_contact::ContactStatus;
use slipstick_mesh::{Mesh, Surface};

/// Coefficient of friction.
pub const FRICTION: f64 = 0.2;

/// A block (1.2 × 0.8 × `width`) whose bottom and front face meet at an interior angle in degrees,
/// rotated forward by `tilt` about this edge, which lies at x = 0 and y = 1. Its surface
/// `block_nose` consists of both faces.
pub fn nose(angle: f64, tilt: f64, width: f64, elements: [usize; 3]) -> Mesh {
    let [along, up, across] = elements;
    let ticks = [even(-1.2, 0.0, along), even(0.0, 0.8, up), even(0.0, width, across)];
    let mut mesh = grid("block", [&ticks[0], &ticks[1], &ticks[2]]);
    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), -tilt.to_radians());
    for node in &mut mesh.nodes {
        let [x, y, z] = *node;
        let leaning = x - y / angle.to_radians().tan() * (1.0 + x / 1.2);
        *node = (turn * Vector3::new(leaning, y, z) + Vector3::y()).into();
    }
    let faces = ["block_ymin", "block_xmax"].map(|face| mesh.surfaces[face].facets.clone());
    mesh.surfaces.insert("block_nose".into(), Surface { facets: faces.concat() });
    assert!(mesh.check().is_empty(), "{:?}", mesh.check());
    mesh
}

/// The nose pressed onto a plate (4 × 1 × 2, x from 0) at x = `start`, and dragged along it by
/// `slide`.
#[derive(Debug, Clone, Copy)]
pub struct Drag {
    pub angle: f64,
    pub tilt: f64,
    /// Whether the nose is the slave.
    pub nose_is_slave: bool,
    pub shape: &'static str,
    pub start: f64,
    pub slide: f64,
    pub steps: usize,
    /// In degrees.
    pub feature_angle: f64,
}

impl Default for Drag {
    fn default() -> Self {
        Self {
            angle: 90.0,
            tilt: 0.0,
            nose_is_slave: true,
            shape: "standard",
            start: 2.1,
            slide: 0.9,
            steps: 12,
            feature_angle: 45.0,
        }
    }
}

impl Drag {
    /// Solves: load step 1 presses, the other steps drag.
    pub fn solve(&self) -> Solved {
        let Self { angle, tilt, nose_is_slave, shape, start, slide, steps, feature_angle } = *self;
        let sides = ["block_nose", "plate_ymax"];
        let [slave, master] = if nose_is_slave { sides } else { [sides[1], sides[0]] };
        let press = if tilt > 10.0 { 0.08 } else { 0.02 };
        let facets = if nose_is_slave { [6, 3] } else { [40, 2] };
        let pressed = 1.0 / (1 + steps) as f64;
        let text = format!(
            "[[body]]\nname = 'block'\nmesh = {{ file = 'block' }}\nplace = {{ translate = [{start:?}, 0, 0.3] }}\n{}\n{}\
             [[contact]]\nslave = '{slave}'\nmaster = '{master}'\nfriction = {FRICTION:?}\nmultiplier_shape = '{shape}'\nfeature_angle = {feature_angle:?}\n\
             [[dirichlet]]\nset = 'plate_ymin'\n[[dirichlet]]\nset = 'block_ymax'\n\
             motion = [{{ t = {pressed:?}, u = [{:?}, -{press:?}, 0] }}, {{ t = 1, u = [{slide:?}, -{press:?}, 0] }}]\n\
             [load_path]\nsteps = {}\n",
            neo_hooke(1000.0, 0.3),
            body("plate", 1e5),
            0.05 * slide.signum(),
            1 + steps
        );
        let plate = grid("plate", [&even(0.0, 4.0, facets[0]), &even(0.0, 1.0, 1), &even(0.0, 2.0, facets[1])]);
        solve(&text, &[("block", nose(angle, tilt, 1.1, [8, 4, 2])), ("plate", plate)])
    }
}

/// Tangential and normal force on the driver after each load step.
pub fn forces(solved: &Solved) -> Vec<[f64; 2]> {
    (1..=solved.steps()).map(|step| solved.reaction("block_ymax", step)).map(|force| [force.x, -force.y]).collect()
}

fn jumps(forces: &[[f64; 2]], which: usize) -> f64 {
    let size = largest(forces.iter().map(|f| f[which]));
    largest(forces.windows(2).map(|pair| (pair[1][which] - pair[0][which]) / size))
}

/// Deviations of F_t/F_n from μ, while the nose slides.
fn deviation(forces: &[[f64; 2]], slide: f64) -> f64 {
    largest(forces[STEADY..].iter().map(|[t, n]| t / n / FRICTION * slide.signum() - 1.0))
}

/// Number of load steps after which the whole surface slips.
pub const STEADY: usize = 4;

/// Coulomb's law for the whole body, F_t = μ F_n, on a plate that is a hundred times as stiff:
/// flat, only on the edge, and with both faces of the edge inclined to the plate.
#[test]
fn a_sharp_slave_edge_slides_with_coulombs_ratio() {
    let (mut worst, mut jump) = (0.0f64, 0.0f64);
    for (angle, tilt) in [(90.0, 0.0), (90.0, 5.0), (60.0, 5.0), (75.0, 25.0)] {
        for (shape, slide) in [("standard", 0.9), ("standard", -0.9), ("dual", -0.9)] {
            let mut solved = Drag { angle, tilt, shape, slide, ..Drag::default() }.solve();
            let nodes = solved.problem.analysis.model().interfaces()[0].interface.slave_nodes();
            let sharp = nodes.iter().filter(|slave| slave.sharp);
            assert_eq!(sharp.count(), 2 * 3, "three nodes with two patches each");
            let last = solved.steps();
            assert!(solved.contact(last).iter().all(|at| at.status != ContactStatus::Stick), "all nodes slip");
            let all = forces(&solved);
            let off = deviation(&all, slide);
            let most = largest([0, 1].map(|which| jumps(&all[STEADY..], which)));
            println!("{angle} turned by {tilt}, {shape}, slide {slide}: off {off:.1e}, jumps {most:.1e}");
            (worst, jump) = (worst.max(off), jump.max(most));
        }
    }
    assert!(worst < 0.01, "{worst}");
    // over more than one facet of the plate, in steps of a ninth of it
    assert!(jump < 0.005, "{jump}");
}

/// The same with slave and master swapped, where the plate has the finer facets, as a slave
/// should: the flat nose, and a trailing edge.
#[test]
fn a_sharp_master_edge_slides_with_coulombs_ratio() {
    for (angle, tilt, slide) in [(90.0, 0.0, 0.9), (90.0, 0.0, -0.9), (90.0, 5.0, -0.9), (60.0, 5.0, -0.9)] {
        let drag = Drag { angle, tilt, nose_is_slave: false, slide: 0.5 * slide, steps: 14, ..Drag::default() };
        let off = deviation(&forces(&drag.solve()), slide);
        println!("{angle} turned by {tilt}, slide {slide}: off {off:.1e}");
        assert!(off < 0.01, "{angle} {tilt} {slide}: {off}");
    }
}

/// A leading master edge covers new slave nodes in every step: they carry its pressure and friction at once.
#[test]
fn a_leading_master_edge_has_friction_at_once() {
    for steps in [12, 24] {
        let drag = Drag { angle: 60.0, tilt: 5.0, nose_is_slave: false, slide: 0.45, steps, ..Drag::default() };
        let off = deviation(&forces(&drag.solve()), drag.slide);
        println!("60 turned by 5, leading master edge, {steps} steps: off {off:.1e}");
        assert!(off < 0.01, "{steps}: {off}");
    }
}

/// Forces do not jump, whether over two facets of the plate and nearly three of the nose slip by
/// slip, or off the plate's end, where all contact is lost within one facet of the nose; there,
/// half the step gives nearly half the change.
#[test]
fn a_sharp_edge_slides_over_facets_and_off_the_plate_without_jumps() {
    for (angle, shape) in [(90.0, "standard"), (60.0, "dual")] {
        let edge = Drag { angle, tilt: 5.0, shape, ..Drag::default() };
        let change = |start: f64, slide: f64, steps: usize| {
            let all = forces(&Drag { start, slide, steps, ..edge }.solve());
            [0, 1].map(|which| jumps(&all[STEADY..], which)).into_iter().fold(0.0, f64::max)
        };
        let on_plate = change(2.1, 1.3, 26);
        // starts at 3.85; the plate ends at 4
        let off = [14, 28].map(|steps| change(3.85, 0.35, steps));
        println!("{angle}, {shape}: on the plate {on_plate:.1e}, off it {off:.3?}");
        assert!(on_plate < 2e-3, "{on_plate}");
        assert!(off[0] < 0.35 && off[1] < 0.65 * off[0], "{off:?}");
    }
}

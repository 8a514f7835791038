//! A ring that is pressed onto another one and twisted.

use crate::chapter::Chapter;
use crate::finding::Finding;
use crate::solved::{Scene, neo_hooke};
use slipstick_contact::ContactStatus;
use std::f64::consts::PI;

pub fn chapter() -> Chapter {
    Chapter {
        key: "ring",
        title: "Ring under twist",
        about: "
A ring (R = 3 … 4, height 1, E = 1000, ν = 0, μ = 0.3) is pressed onto a fixed one by 0.01 and
rotated by 2° until its whole face slips. Under uniform pressure p the moment is M = (2/3) π μ p
(R_o³ − R_i³), or with the normal force F_n = π p (R_o² − R_i²): M = (2/3) μ F_n (R_o³ − R_i³)/(R_o²
− R_i²). F_n and M are reactions. The facets' chords converge to the circle with second order in
their number around the ring, so the moment must converge with second order, too. The meshes of the
two faces do not match (2 and 3 elements radially, N and 1.25 N around).",
        remarks: "
The ratio of moment to normal force converges to the analytic value with second order, as the chords
do to the circle.",
        quick: true,
        run: || Some(run()),
    }
}

fn run() -> Vec<Finding> {
    let (inner, outer, friction) = (3.0f64, 4.0f64, 0.3);
    let mut findings = Vec::new();
    let mut errors = Vec::new();
    for around in [16, 32, 64] {
        let mut solved = Scene::from(text(around)).solve();
        let last = solved.steps();
        assert!(solved.contact(last).iter().all(|node| node.status == ContactStatus::Slip));
        let force = -solved.reaction("upper_top", last).y;
        let moment = solved.moment("upper_top", last).y;
        let expected = 2.0 / 3.0 * friction * force * (outer.powi(3) - inner.powi(3)) / (outer.powi(2) - inner.powi(2));
        let what = format!("M/F_n, N = {around}");
        findings.push(if around == 64 {
            Finding::value(what, expected / force, 2e-3, moment / force)
        } else {
            Finding::compare(what, expected / force, moment / force)
        });
        if around == 64 {
            // ν = 0 and, to first order in the twist, uniaxial strain: p = −P_yy of the stretch
            // 1 − 0.01/2
            let stretch: f64 = 0.995;
            let pressure = 500.0 * (1.0 / stretch - stretch);
            let area = PI * (outer.powi(2) - inner.powi(2));
            findings.push(Finding::value("F_n, N = 64", pressure * area, 5e-3, force));
        }
        errors.push((moment / expected - 1.0).abs());
    }
    let order = |k: usize| (errors[k] / errors[k + 1]).log2();
    findings.push(Finding::value("order of convergence, N = 16 to 32", 2.0, 0.15, order(0)));
    findings.push(Finding::value("order of convergence, N = 32 to 64", 2.0, 0.15, order(1)));
    findings
}

fn text(around: usize) -> String {
    let material = neo_hooke(1000.0, 0.0);
    let ring = |name: &str, radial: usize, around: usize, y: f64| {
        format!(
            "[[body]]\nname = '{name}'\nhollow_cylinder = {{ inner_radius = 3, outer_radius = 4, height = 1, elements = \
             [{radial}, {around}, 1] }}\nplace = {{ translate = [0, {y:?}, 0] }}\n{material}\n"
        )
    };
    ring("lower", 3, around + around / 4, 0.0)
        + &ring("upper", 2, around, 1.0)
        + "[[contact]]\nslave = 'upper_bottom'\nmaster = 'lower_top'\nfriction = 0.3\n\
           [[dirichlet]]\nset = 'lower_bottom'\n\
           [[dirichlet]]\nset = 'upper_top'\nrotation = { point = [0, 0, 0], direction = [0, 1, 0] }\n\
           motion = [{ t = 0.2, u = [0, -0.01, 0], angle = 0 }, { t = 1.0, u = [0, -0.01, 0], angle = 2 }]\n\
           [load_path]\nsteps = 10\ntolerance = { relative = 1e-11 }\n"
}

//! The rubber roller of FElupe's discussions 800, 807 and 870: `cases/roller`.

use crate::chapter::Chapter;
use crate::common::{forward, problem};
use crate::finding::Finding;

pub fn chapter() -> Chapter {
    Chapter {
        key: "roller",
        title: "Rubber roller",
        about: "
A rubber-coated roller, 28 mm wide, is pressed onto a plate with 380 N
([case](../../cases/roller/README.md)); the source is FElupe's discussions 800, 807 and 870. The
reference of discussion 870 (finite elements and measurement) is a contact width of 30 mm and a peak
pressure of 0.62 MPa. The discussions state two moduli of the rubber: E = 1.4 MPa (807) and E =
0.275 MPa (870), for which FElupe, in plane strain, finds 49 mm and 0.43 MPa. ν = 0.475.",
        remarks: "
With E = 1.4 MPa, slipstick matches both reference values; with E = 0.275 MPa, it matches FElupe's
width (pressure: +5.5 %). The modulus behind the reference is not known.",
        quick: true,
        run: || Some(run()),
    }
}

fn run() -> Vec<Finding> {
    // modulus, depth, steps; width and pressure with their bounds
    let cases = [(1.4, 4.014, 9, (30.0, 0.05), (0.62, 0.05)), (0.275, 9.9, 11, (49.0, 0.01), (0.43, 0.06))];
    let mut findings = Vec::new();
    for (modulus, depth, steps, expected_width, expected_peak) in cases {
        let (c10, bulk) = rubber(modulus, 0.475);
        let [force, peak, width] = roller(c10, bulk, depth, steps);
        let name = format!("E = {modulus} MPa");
        findings.push(Finding::value(format!("{name}: force [N]"), 380.0, 2e-3, 28.0 * force));
        findings.push(Finding::value(format!("{name}: width [mm]"), expected_width.0, expected_width.1, width));
        findings.push(Finding::value(format!("{name}: peak pressure [MPa]"), expected_peak.0, expected_peak.1, peak));
    }
    findings
}

/// Force per width, largest pressure and width of the contact at the end of the path of the case with
/// these values. The width ends where the pressures of the outermost two closed nodes, extrapolated,
/// vanish, or at the next node.
fn roller(c10: f64, bulk_modulus: f64, depth: f64, steps: usize) -> [f64; 3] {
    let text = include_str!("../../../../cases/roller/case.toml")
        .replace("c10 = 0.237288", &format!("c10 = {c10:?}"))
        .replace("bulk_modulus = 9.333333", &format!("bulk_modulus = {bulk_modulus:?}"))
        .replace("-4.014", &format!("{:?}", -depth))
        .replace("steps = 9", &format!("steps = {steps}"));
    let mut problem = problem(&text);
    let density = problem.initial_density().clone();
    let forward = forward(&mut problem, &density);
    let [previous, last] = &forward.path.states[forward.path.states.len() - 2..] else { panic!("two states") };
    let results =
        problem.analysis.design.contact_results(&previous.state, &last.state, last.time).expect("a converged state");
    let unknowns = &last.state.unknowns;
    let mesh = &problem.mesh;
    let force: f64 = results.nodes.iter().map(|node| results.force[3 * node.node as usize + 1]).sum();
    // right half of one side of the slice, from the middle outwards
    let mut side: Vec<(f64, f64)> = results
        .nodes
        .iter()
        .map(|node| node.node as usize)
        .filter(|&node| mesh.nodes[node][2] == 0.0 && mesh.nodes[node][0] > -1e-9)
        .map(|node| (mesh.nodes[node][0] + unknowns[3 * node], results.pressure[node]))
        .collect();
    side.sort_by(|a, b| a.0.total_cmp(&b.0));
    let closed = side.iter().filter(|(_, p)| *p > 0.0).count();
    let [(a, p), (b, q), (next, _)] = side[closed - 2..=closed] else { panic!("an open node beyond the contact") };
    let edge = if p > q { (b + q * (b - a) / (p - q)).min(next) } else { b };
    let peak = side.iter().map(|(_, p)| *p).fold(0.0, f64::max);
    [force, peak, 2.0 * edge]
}

/// Bulk modulus and c₁₀ of neo-Hookean rubber.
fn rubber(e: f64, nu: f64) -> (f64, f64) {
    (e / (4.0 * (1.0 + nu)), e / (3.0 * (1.0 - 2.0 * nu)))
}

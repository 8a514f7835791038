//! The tables of `docs/measurements/edges.md`: how multipliers and nodal pressures at an edge vary with overlap,
//! mesh and χ.

use std::collections::BTreeMap;
use std::fmt::Write;

use super::nose::{Drag, FRICTION, STEADY};
use super::overhang::{LENGTH, Overhang, PRESSURE, forces, largest, projected};
use super::{nose, results, ssnp503};

/// Elements per length of the reference, which has matching meshes.
const FINE: usize = 32;

/// Fractions of the facet at the edge that the slab covers, in eighths.
const COVERED: [usize; 6] = [1, 2, 4, 6, 7, 8];

/// One state of a coarse mesh, with the corresponding values of the fine one.
struct State {
    /// Multipliers and pressures at the first two nodes, and the fine mesh's pressures there; all
    /// relative to the mean pressure.
    multiplier: [f64; 2],
    pressure: [f64; 2],
    exact: [f64; 2],
    /// Largest error of a nodal force relative to the largest nodal force, and peak pressure
    /// relative to that of the fine mesh.
    error: f64,
    peak: f64,
}

/// Nodal forces of reference solutions by their overhang, in 1/32.
type References = BTreeMap<usize, Vec<[f64; 2]>>;

fn fine(overhang: f64) -> Overhang {
    Overhang { fine: FINE, shape: "standard", friction: 0.0, edge_cover: None, overhang: [overhang; 2], steps: 0 }
}

fn state(mesh: usize, eighths: usize, shape: &'static str, edge_cover: f64, references: &mut References) -> State {
    let overhang = (8 - eighths) as f64 / (8 * mesh) as f64;
    let reference = fine(overhang);
    let key = (overhang * FINE as f64).round() as usize;
    assert!((key as f64 / FINE as f64 - overhang).abs() < 1e-12, "the reference has a line at the edge");
    let force = references.entry(key).or_insert_with(|| forces(&reference, &mut reference.solve(), 1).0);
    let coarse = Overhang { fine: mesh, shape, edge_cover: Some(edge_cover), ..reference };
    let mut solved = coarse.solve();
    let (found, area) = forces(&coarse, &mut solved, 1);
    let exact = projected(&reference, &coarse, force);
    let contact = results(&mut solved, 1);
    let multiplier = |k: usize| {
        let at = -overhang + k as f64 / mesh as f64;
        let here = |node: u32| (solved.problem.mesh.nodes[node as usize][0] - at).abs() < 1e-9;
        contact.nodes.iter().find(|row| here(row.node)).map_or(f64::NAN, |row| row.multiplier[0] / PRESSURE)
    };
    let per_area = |force: f64, k: usize| force / area[k] / PRESSURE;
    let highest = largest(exact.iter().copied());
    let peak = |force: &dyn Fn(usize) -> f64| largest((0..area.len()).map(|k| per_area(force(k), k)));
    State {
        multiplier: [0, 1].map(multiplier),
        pressure: [0, 1].map(|k| per_area(found[k][1], k)),
        exact: [0, 1].map(|k| per_area(exact[k], k)),
        error: largest((0..area.len()).map(|k| (found[k][1] - exact[k]) / highest)),
        peak: peak(&|k| found[k][1]) / peak(&|k| exact[k]),
    }
}

/// Takes minutes.
#[test]
#[ignore = "writes tables of docs/measurements/edges.md: docs/measure/edges/measure.sh"]
fn tables_of_overlaps() {
    let mut references = References::new();
    let variants = || [0.05, 0.5].into_iter().flat_map(|cover| ["standard", "dual"].map(|shape| (cover, shape)));
    let mut overlaps = String::from(
        "| χ | shapes | facet covered | multipliers z_0, z_1 | pressures p_0, p_1 | p_0, p_1 of the fine mesh | error of forces |\n\
         |---|---|---|---|---|---|---|\n",
    );
    for (cover, shape) in variants() {
        for eighths in COVERED {
            let at = state(1, eighths, shape, cover, &mut references);
            let pair = |pair: [f64; 2]| format!("{:.2}, {:.2}", pair[0], pair[1]);
            let (z, p, e) = (pair(at.multiplier), pair(at.pressure), pair(at.exact));
            let _ =
                writeln!(overlaps, "| {cover} | {shape} | {eighths}/8 | {z} | {p} | {e} | {:.1} % |", 100.0 * at.error);
        }
    }
    crate::table::publish("overlaps", &overlaps);
    let mut meshes = String::from(
        "| χ | shapes | elements per length | largest error of forces | peak pressure / that of the fine mesh |\n\
         |---|---|---|---|---|\n",
    );
    for (cover, shape) in variants() {
        for mesh in [1, 2, 4] {
            let all: Vec<State> =
                COVERED.iter().map(|&eighths| state(mesh, eighths, shape, cover, &mut references)).collect();
            let [low, high] =
                [f64::min, f64::max].map(|of| all.iter().map(|at| at.peak).reduce(of).unwrap_or(f64::NAN));
            let error = 100.0 * largest(all.iter().map(|at| at.error));
            let _ = writeln!(meshes, "| {cover} | {shape} | {mesh} | {error:.1} % | {low:.3} … {high:.3} |");
        }
    }
    crate::table::publish("meshes", &meshes);
}

/// The singularity: matching meshes with a mesh line at the edge.
#[test]
#[ignore = "writes tables of docs/measurements/edges.md: docs/measure/edges/measure.sh"]
fn table_of_refinement() {
    let mut refinement =
        String::from("| elements per length | peak / mean pressure | resultant / load |\n|---|---|---|\n");
    for mesh in [2, 4, 8, 16, 32] {
        let case = Overhang { fine: mesh, ..fine(0.5) };
        let (force, area) = forces(&case, &mut case.solve(), 1);
        let peak = largest(force.iter().zip(&area).map(|(f, a)| f[1] / a)) / PRESSURE;
        let resultant = force.iter().map(|f| f[1]).sum::<f64>() / (PRESSURE * LENGTH);
        let _ = writeln!(refinement, "| {mesh} | {peak:.2} | {resultant:.6} |");
    }
    crate::table::publish("refinement", &refinement);
}

/// Pressures of SSNP503 together with those of code_aster and of a mesh eight times as fine.
#[test]
#[ignore = "writes tables of docs/measurements/edges.md: docs/measure/edges/measure.sh"]
fn table_of_ssnp503() {
    let fine = 8;
    let (mut reference, mut rigid, mut default) =
        (ssnp503::solved(fine, 0.5), ssnp503::solved(1, 0.05), ssnp503::solved(1, 0.5));
    let mut text = String::from("| t | | x = 0 | 1 | 2 | 3 | 4 |\n|---|---|---|---|---|---|---|\n");
    let mut all = [ssnp503::MATCHED, ssnp503::BETWEEN].concat();
    all.sort_by_key(|(step, _)| *step);
    for (step, code_aster) in all {
        for (name, row) in [
            ("code_aster", code_aster),
            ("slipstick", ssnp503::pressures(&mut default, step)),
            ("slipstick, χ = 0.05", ssnp503::pressures(&mut rigid, step)),
            ("elements divided by 8", ssnp503::averaged(&mut reference, fine, step)),
        ] {
            let numbers: Vec<String> = row.iter().map(|p| format!("{:.0}", p.abs())).collect();
            let _ = writeln!(text, "| {} | {name} | {} |", 0.25 * step as f64, numbers.join(" | "));
        }
    }
    crate::table::publish("ssnp503", &text);
}

/// F_t/F_n of a sharp edge on a flat plate: as slave, as slave whose edge counts as smooth, as
/// master. Reports the value farthest from μ along the slide, and Newton's iterations per load
/// step.
#[test]
#[ignore = "writes tables of docs/measurements/edges.md: docs/measure/edges/measure.sh"]
fn table_of_sharp_edges() {
    let mut text = String::from(
        "| angle | rotated by | edge | edge on the slave | on the slave, `feature_angle = 180` | on the master, steps of 0.075 | on the master, steps of 0.0375 |\n\
         |---|---|---|---|---|---|---|\n",
    );
    for (angle, tilt, slide) in [
        (90.0, 0.0, 0.9),
        (90.0, 0.0, -0.9),
        (90.0, 5.0, 0.9),
        (90.0, 5.0, -0.9),
        (60.0, 5.0, 0.9),
        (60.0, 5.0, -0.9),
        (75.0, 25.0, 0.9),
        (75.0, 25.0, -0.9),
    ] {
        let slave = Drag { angle, tilt, slide, ..Drag::default() };
        let master = Drag { nose_is_slave: false, ..slave };
        let variants =
            [slave, Drag { feature_angle: 180.0, ..slave }, master, Drag { steps: 2 * master.steps, ..master }];
        let cells = variants.map(|drag| {
            let Ok(solved) = std::panic::catch_unwind(|| drag.solve()) else { return "no convergence".to_owned() };
            let ratios =
                nose::forces(&solved)[STEADY..].iter().map(|[t, n]| t / n * slide.signum()).collect::<Vec<_>>();
            let worst = ratios.into_iter().max_by(|a, b| (a - FRICTION).abs().total_cmp(&(b - FRICTION).abs()));
            let iterations: usize = solved.forward.path.states.iter().map(|state| state.report.iterations.len()).sum();
            let each = iterations as f64 / solved.steps() as f64;
            format!("{:.3} ({each:.1})", worst.unwrap_or(f64::NAN))
        });
        let edge = if slide > 0.0 { "leads" } else { "trails" };
        let _ = writeln!(text, "| {angle}° | {tilt}° | {edge} | {} |", cells.join(" | "));
    }
    crate::table::publish("sharp", &text);
}

//! A block slides off an edge: its nodal forces follow those of a fine mesh with a mesh line at the
//! edge, and do not jump.

use super::overhang::{LENGTH, Overhang, PRESSURE, forces, largest, projected};

const FINE: usize = 8;

/// Deviations along the slide, over all steps.
#[derive(Debug, Default)]
struct Course {
    /// Largest deviation of the peak pressure from that of the fine mesh, and of a nodal force
    /// relative to the largest one.
    peak: f64,
    force: f64,
    /// Largest deviation of the normal force from the load, and of the force along x from that of
    /// the fine mesh, relative to the load.
    normal: f64,
    tangential: f64,
    /// Largest deviation of the resultant's magnitude from that of the fine mesh.
    resultant: f64,
    /// Largest change of the peak pressure, and of a nodal pressure relative to the mean, between
    /// successive steps.
    peak_jump: f64,
    jump: f64,
}

fn course(shape: &'static str, friction: f64, edge_cover: Option<f64>) -> Course {
    let coarse = Overhang { fine: 1, shape, friction, edge_cover, overhang: [0.0, 1.25], steps: 20 };
    // the meshes match every 1/8; steps of the coarse one are half as long
    let fine = Overhang { fine: FINE, shape: "standard", steps: 10, ..coarse };
    let (mut found, mut reference) = (coarse.solve(), fine.solve());
    let mut course = Course::default();
    let mut before: Option<Vec<f64>> = None;
    for step in 1..=21 {
        let (force, area) = forces(&coarse, &mut found, step);
        let normal: f64 = force.iter().map(|f| f[1]).sum();
        let tangential: f64 = force.iter().map(|f| f[0]).sum();
        course.normal = course.normal.max((normal / (PRESSURE * LENGTH) - 1.0).abs());
        let pressure: Vec<f64> = force.iter().zip(&area).map(|(f, a)| f[1] / a).collect();
        let peak = largest(pressure.iter().copied());
        if let Some(before) = before.filter(|_| step > 2) {
            course.peak_jump = course.peak_jump.max((peak / largest(before.iter().copied()) - 1.0).abs());
            course.jump = course.jump.max(largest(pressure.iter().zip(&before).map(|(a, b)| (a - b) / PRESSURE)));
        }
        before = Some(pressure.clone());
        if step % 2 == 1 {
            let of_fine = forces(&fine, &mut reference, 1 + step / 2).0;
            let [along, upward] = [0, 1].map(|c| of_fine.iter().map(|f| f[c]).sum::<f64>());
            course.tangential = course.tangential.max((tangential - along).abs() / normal);
            course.resultant = course.resultant.max((tangential.hypot(normal) / along.hypot(upward) - 1.0).abs());
            let exact = projected(&fine, &coarse, &of_fine);
            let highest = largest(exact.iter().zip(&area).map(|(f, a)| f / a));
            course.peak = course.peak.max((peak / highest - 1.0).abs());
            let off = exact.iter().zip(&force).map(|(e, f)| (f[1] - e) / largest(exact.iter().copied()));
            course.force = course.force.max(largest(off));
        }
    }
    println!("{shape}, friction {friction}, cover {edge_cover:?}: {course:.4?}");
    course
}

/// The reference is the same block with eight times as many elements, with mesh lines at the slab's
/// edge at every comparison. The load is the resultant. A step is a sixteenth of a facet.
#[test]
fn pressure_follows_a_matched_mesh_over_the_edge() {
    for friction in [0.0, 0.2] {
        for shape in ["standard", "dual"] {
            let found = course(shape, friction, None);
            assert!(found.normal < 1e-6, "{shape}, {friction}: {found:?}");
            assert!(found.resultant < 0.01, "{shape}, {friction}: {found:?}");
            // its direction, with dual shapes: 0.6 degrees at an overhang of 1.25 without friction,
            // 1 degree with
            let along = if shape == "dual" { 0.02 } else { 0.01 };
            assert!(found.tangential < along, "{shape}, {friction}: {found:?}");
            assert!(found.peak < 0.12 && found.force < 0.12, "{shape}, {friction}: {found:?}");
            assert!(found.peak_jump < 0.09 && found.jump < 0.15, "{shape}, {friction}: {found:?}");
        }
    }
}

/// The purpose of the default of `edge_cover`: if conditions are rigid from a cover of 1/20 on, the
/// same slide is rougher.
#[test]
fn rigid_conditions_on_partly_covered_facets_jump() {
    let [smooth, rigid] = [None, Some(0.05)].map(|cover| course("standard", 0.0, cover));
    assert!(rigid.jump > 1.8 * smooth.jump && rigid.force > 1.8 * smooth.force, "{smooth:?} {rigid:?}");
}

//! Two problems that other programs have solved.

use crate::chapter::Chapter;
use crate::finding::Finding;
use crate::solved::{Scene, Solved, neo_hooke};

pub fn chapters() -> [Chapter; 2] {
    [
        Chapter {
            key: "cube",
            title: "Cube on cuboid, against other programs",
            about: "
A cube of one element (0.8³) on a slab of four (4 × 1 × 1, E = 500, ν = 0.3) is pressed down by 0.1,
then dragged by (1, 0, 0.03), in 10 steps. The reactions on the driven face at the end are compared
with the band of GetFEM 5.4.2 (augmented Lagrangian with ray tracing, the same law), Kratos 10.4.4
(dual mortar) and CalculiX 2.20 (mortar; its neo-Hookean law differs, which changes F_n by 0.8 %).
Each of them discretizes contact in a different way; the bands span their three values, widened by
half a unit of the last known digit.",
            remarks: "
With one element, the three programs differ by up to 4 % in F_n and 19 % in F_t, mostly because of
the discretization: four elements per edge change F_n by 12 to 16 %. At μ = 0 and
0.2, slipstick's F_n is 0.6 % and 0.5 % above the stiffest of the others. At μ = 0.5, the rear nodes
of the cube open with standard shapes but stay closed with dual shapes. With standard shapes, the
normal force lies 1.4 % above the band and the tangential force 1.6 % below it; with dual shapes,
both lie inside.",
            quick: true,
            run: || Some(cube()),
        },
        Chapter {
            key: "peers",
            title: "Ironing of a block, against other programs",
            about: "
A half-ring (R = 0.6 … 1, width 3, 16 × 3 × 6 elements, E = 1000) is pressed by 0.3 into a block (9
× 3 × 4, 30 × 8 × 10 elements, E = 100, ν = 0.3) and slides by 2, in 20 steps. The reactions on the
driven faces at the end are compared with the band of GetFEM 5.4.2, Kratos 10.4.4 (without friction;
with friction it failed at t = 0.6) and CalculiX 2.20 with its mortar contact.",
            remarks: "
The forces oscillate along the slide with the period of the block's facets (0.3), F_t by ± 2 %; for
standard shapes, the end of the path lies in a trough of the oscillation, which does not depend on
the number of steps. With dual shapes, which the mortar contacts of Kratos and CalculiX also use, or
with a finer die, both forces at the end are inside the bands, but then the end lies on a crest. On
this mesh, forces at a single step are only accurate to a few percent.
[Performance](performance.md#against-other-codes) lists the range of the tangential forces of GetFEM
and CalculiX along the slide.",
            quick: false,
            run: || Some(ironing()),
        },
    ]
}

fn cube() -> Vec<Finding> {
    let mut findings = Vec::new();
    for (friction, normal, tangential) in [
        (0.0, [29.665, 30.255], [-0.765, 0.005]),
        (0.2, [29.745, 30.315], [4.885, 5.815]),
        (0.5, [30.385, 31.565], [13.775, 14.535]),
    ] {
        for (shape, n) in [("dual", 1), ("standard", 1), ("standard", 2), ("standard", 4)] {
            let [pressed, drawn] = cube_forces(friction, shape, n);
            let name = format!("μ = {friction}, {shape} shapes");
            if n == 1 {
                let normal = Finding::band(format!("{name}: F_n"), normal, pressed);
                let tangential = Finding::band(format!("{name}: F_t"), tangential, drawn);
                let opens = friction == 0.5 && shape == "standard";
                findings.push(if friction < 0.5 || opens { normal.known() } else { normal });
                findings.push(if opens { tangential.known() } else { tangential });
            } else {
                findings.push(Finding::shown(format!("{name}, {n} elements per edge: F_n"), pressed));
                findings.push(Finding::shown(format!("{name}, {n} elements per edge: F_t"), drawn));
            }
        }
    }
    findings
}

/// Normal and tangential reaction with `n` elements along the cube's edges.
fn cube_forces(friction: f64, shape: &str, n: usize) -> [f64; 2] {
    let material = neo_hooke(500.0, 0.3);
    let solved = Scene::from(format!(
        "[[body]]\nname = 'slab'\nbox = {{ min = [0, 0, 0], max = [4, 1, 1], elements = [{}, {n}, {n}] }}\n{material}\n\
         [[body]]\nname = 'cube'\nbox = {{ min = [0.6, 1, 0.1], max = [1.4, 1.8, 0.9], elements = [{n}, {n}, {n}] }}\n{material}\n\
         [[contact]]\nslave = 'cube_ymin'\nmaster = 'slab_ymax'\nfriction = {friction:?}\nmultiplier_shape = '{shape}'\n\
         [[dirichlet]]\nset = 'slab_ymin'\n\
         [[dirichlet]]\nset = 'cube_ymax'\n\
         motion = [{{ t = 0.5, u = [0, -0.1, 0] }}, {{ t = 1.0, u = [1, -0.1, 0.03] }}]\n\
         [load_path]\nsteps = 10\n",
        4 * n
    ))
    .solve();
    let force = solved.reaction("cube_ymax", solved.steps());
    [-force.y, force.x]
}

/// The ironing problem with multiples of the die's elements and of the load steps.
fn block(friction: f64, shape: &str, finer_die: usize, more_steps: usize) -> Solved {
    let die = [16, 3, 6].map(|n| n * finer_die);
    Scene::from(format!(
        "[[body]]\nname = 'block'\nbox = {{ min = [0, -3, 0], max = [9, 0, 4], elements = [30, 8, 10] }}\n{}\n\
         [[body]]\nname = 'die'\nhalf_ring = {{ inner_radius = 0.6, outer_radius = 1.0, width = 3.0, elements = {die:?} }}\n\
         place = {{ translate = [2, 1, 2] }}\n{}\n\
         [[contact]]\nslave = 'die_outer'\nmaster = 'block_ymax'\nfriction = {friction:?}\nmultiplier_shape = '{shape}'\nsurfaces = 'faceted'\n\
         [[dirichlet]]\nset = 'block_ymin'\n\
         [[dirichlet]]\nset = 'die_ends'\n\
         motion = [{{ t = 0.5, u = [0, -0.3, 0] }}, {{ t = 1.0, u = [2, -0.3, 0] }}]\n\
         [load_path]\nsteps = {}\n",
        neo_hooke(100.0, 0.3),
        neo_hooke(1000.0, 0.3),
        20 * more_steps
    ))
    .solve()
}

fn ironing() -> Vec<Finding> {
    let mut findings = Vec::new();
    for (friction, shape, normal, tangential) in [
        (0.0, "standard", [58.0, 59.0], [-0.4, 0.4]),
        (0.2, "standard", [57.3, 57.9], [11.3, 12.1]),
        (0.2, "dual", [57.3, 57.9], [11.3, 12.1]),
    ] {
        let solved = block(friction, shape, 1, 1);
        let force = solved.reaction("die_ends", solved.steps());
        let name = format!("μ = {friction}, {shape} shapes");
        findings.push(Finding::band(format!("{name}: F_n"), normal, -force.y));
        let finding = Finding::band(format!("{name}: F_t"), tangential, force.x);
        findings.push(if friction > 0.0 && shape == "standard" { finding.known() } else { finding });
    }
    for (name, finer_die, more_steps) in [("80 steps", 1, 4), ("32 × 6 × 12 elements in the die", 2, 2)] {
        let solved = block(0.2, "standard", finer_die, more_steps);
        let last = solved.steps();
        // the sliding distance from 0.5 to 2
        let path: Vec<_> = (last * 5 / 8..=last).map(|step| solved.reaction("die_ends", step)).collect();
        for (part, of) in [("F_n", [0.0, -1.0]), ("F_t", [1.0, 0.0])] {
            let values = path.iter().map(|force| of[0] * force.x + of[1] * force.y);
            let end = values.clone().next_back().expect("steps");
            let mean = values.clone().sum::<f64>() / path.len() as f64;
            let (low, high) = values.fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
            for (what, value) in [("at the end", end), ("least", low), ("mean", mean), ("largest", high)] {
                findings.push(Finding::shown(format!("μ = 0.2, {name}: {part}, {what}"), value));
            }
        }
    }
    findings
}

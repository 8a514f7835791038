//! J2 plasticity: a bar by hand, a plate with a hole against CalculiX, elastoplastic arches with
//! friction against published curves.

use crate::chapter::Chapter;
use crate::finding::Finding;
use crate::solved::{Scene, Solved, straight_quadratic};
use std::collections::HashMap;
use std::fmt::Write;

pub fn chapters() -> [Chapter; 2] {
    [
        Chapter {
            key: "plate",
            title: "Plastic bar, by hand, and plate with a hole, against CalculiX",
            about: "
*Bar*: a cube (E = 700, ν = 0.32, σ_y = 30 + 260 α) is pulled to a logarithmic plastic strain of
0.3, and the force follows by hand from strains that add up: τ = σ_y(α), ε = τ/E + α along the bar
and −ν τ/E − α/2 across it. *Plate*: a quarter of a plate (20 × 36 × 2, hole of radius 5, E =
200,000, ν = 0.3, yield stress 200, 300, 350 at plastic strains 0, 0.1, 0.3) is stretched by 0.6 at
its end, to its largest force. CalculiX 2.20 uses the same law at finite strains; both programs use
the same 48 elements with straight edges, CalculiX with 20 nodes and reduced integration (`C3D20R`),
slipstick with 27 nodes and F̄. The number is the force on the quarter.",
            remarks: "",
            quick: true,
            run: || Some(bar().into_iter().chain(plate()).collect()),
        },
        Chapter {
            key: "arches",
            title: "Elastoplastic arches with friction, against published curves",
            about: "
Two half-rings in plane strain (radii 8 and 10, and 10 and 12; E = 689.56 MPa, ν = 0.32, σ_y = 31 +
261.2 α MPa, thickness 1 mm) interfere by 5 mm, and the upper one is dragged over the lower one by
31.5 mm, until it snaps off. The published curves are those of Neto, Oliveira and Menezes (CMAME
299, 2016), as digitized by the benchmarks of solids4foam. *RMS* is the root of the mean square
deviation of the reaction at 14 stations, as a fraction of the largest reaction; a station may lie
anywhere within the 0.4 mm to which its position is known. *peak* is the largest reaction, and
*coarse* has 40 × 3 elements in each arch with F̄, *fine* 100 × 5, and *27 nodes* 50 × 2 of second
order.",
            remarks: "
The coarse mesh reproduces the published curves within 1 % of their peaks (RMS), and finer meshes
have smaller horizontal reactions without friction. The published curves therefore seem to contain a
discretization error of a few per cent.",
            quick: false,
            run: || Some(arches()),
        },
    ]
}

fn bar() -> Vec<Finding> {
    let (e, nu, flow) = (700.0_f64, 0.32, 0.3);
    let stress: f64 = 30.0 + 260.0 * flow;
    let stretch = (stress / e + flow).exp();
    let across = (-nu * stress / e - 0.5 * flow).exp();
    let text = format!(
        "[[body]]\nname = 'bar'\nbox = {{ min = [0, 0, 0], max = [1, 1, 1], elements = [1, 1, 1] }}\n\
         material = {{ j2_linear = {{ youngs_modulus = {e}, poisson_ratio = {nu}, yield_stress = 30, \
         hardening_modulus = 260 }} }}\n\
         [[dirichlet]]\nset = 'bar_xmin'\ncomponents = ['x']\n[[dirichlet]]\nset = 'bar_ymin'\ncomponents = ['y']\n\
         [[dirichlet]]\nset = 'bar_zmin'\ncomponents = ['z']\n\
         [[dirichlet]]\nset = 'bar_xmax'\ncomponents = ['x']\nmotion = [{{ t = 1, u = [{}, 0, 0] }}]\n\
         [load_path]\nsteps = 5\ntolerance = {{ relative = 1e-12 }}\n",
        stretch - 1.0
    );
    let solved = Scene::from(text).solve();
    let force = solved.reaction("bar_xmax", 5).x;
    // force on the undeformed area: τ over the stretch
    let lateral = 1.0 + solved.displacement(last_node(&solved), 5).y;
    vec![
        Finding::value("bar: force", stress / stretch, 1e-8, force),
        Finding::value("bar: contraction", across, 1e-8, lateral),
    ]
}

/// The node at [1, 1, 1].
fn last_node(solved: &Solved) -> u32 {
    let nodes = &solved.problem.mesh.nodes;
    nodes.iter().position(|x| x.iter().all(|x| *x > 0.99)).expect("a corner") as u32
}

fn plate() -> Vec<Finding> {
    let files = HashMap::from([("plate".to_owned(), straight_quadratic(&plate_mesh(), "plate"))]);
    let fixed = |set: &str, c: &str| format!("[[dirichlet]]\nset = 'plate_{set}'\ncomponents = ['{c}']\n");
    let text = "[[body]]\nname = 'plate'\nmesh = { file = 'plate' }\nelement = 'f_bar'\n\
                material = { j2_table = { youngs_modulus = 200000, poisson_ratio = 0.3, yield_stress = [200, 300, 350], \
                plastic_strain = [0, 0.1, 0.3] } }\n"
        .to_owned()
        + &fixed("X0", "x")
        + &fixed("Y0", "y")
        + &fixed("Z0", "z")
        + &fixed("TOP", "y")
        + "motion = [{ t = 1, u = [0, 0.6, 0] }]\n[load_path]\nsteps = 20\n";
    let solved = Scene { text, files }.solve();
    let at = |step: usize| solved.reaction("plate_TOP", step).y;
    // ccx 2.20, C3D20R, with the same corners and straight edges
    let found = [(2, 1080.183), (10, 1265.168), (20, 1382.924)];
    found
        .map(|(step, force)| {
            Finding::value(format!("plate: force at {:.2}", 0.03 * step as f64), force, 2e-3, at(step))
        })
        .into()
}

/// A deck of 8 × 6 × 1 elements around a quarter of the hole, finer towards it.
fn plate_mesh() -> String {
    const AROUND: usize = 8;
    const RADIAL: usize = 6;
    let number = |k: usize, r: usize, t: usize| 1 + (k * (RADIAL + 1) + r) * 2 + t;
    let mut text = "*NODE\n".to_owned();
    let mut sets: [Vec<usize>; 4] = Default::default();
    for k in 0..=AROUND {
        let (part, angle) = (k as f64 / AROUND as f64, std::f64::consts::FRAC_PI_2 * k as f64 / AROUND as f64);
        let outer = if 2 * k <= AROUND { [10.0, 36.0 * part] } else { [10.0 * (1.0 - 2.0 * (part - 0.5)), 18.0] };
        let inner = [5.0 * angle.cos(), 5.0 * angle.sin()];
        for r in 0..=RADIAL {
            let s = (r as f64 / RADIAL as f64).powf(1.5);
            for t in 0..2 {
                let [x, y] = [0, 1].map(|c| inner[c] + s * (outer[c] - inner[c]));
                let n = number(k, r, t);
                writeln!(text, "{n}, {x:?}, {y:?}, {t}.0").expect("a string");
                let on = [k == AROUND, k == 0, t == 0, r == RADIAL && 2 * k >= AROUND];
                sets.iter_mut().zip(on).filter(|(_, on)| *on).for_each(|(set, _)| set.push(n));
            }
        }
    }
    text += "*ELEMENT, TYPE=C3D8, ELSET=plate\n";
    let mut element = 0;
    for k in 0..AROUND {
        for r in 0..RADIAL {
            element += 1;
            let ring = [(k, r), (k, r + 1), (k + 1, r + 1), (k + 1, r)];
            let nodes = [0, 1].map(|t| ring.map(|(k, r)| number(k, r, t).to_string()).join(", "));
            writeln!(text, "{element}, {}", nodes.join(", ")).expect("a string");
        }
    }
    for (name, nodes) in ["X0", "Y0", "Z0", "TOP"].iter().zip(sets) {
        writeln!(text, "*NSET, NSET={name}").expect("a string");
        nodes.iter().for_each(|n| writeln!(text, "{n},").expect("a string"));
    }
    text
}

/// Displacements of the stations \[mm\] and reactions on the feet of the lower arch, x and y \[N\].
const STATIONS: [f64; 14] = [1.95, 3.85, 5.73, 7.63, 10.1, 12.7, 15.2, 17.7, 20.3, 22.8, 25.0, 28.2, 28.8, 30.0];
const PUBLISHED: [(f64, [[f64; 14]; 2]); 2] = [
    (
        0.0,
        [
            [-4.97, -7.97, -9.27, -9.52, -9.03, -8.48, -7.75, -4.68, 4.54, 6.91, 7.46, 3.32, 1.89, 0.07],
            [7.06, 12.97, 17.16, 20.48, 23.96, 26.48, 29.95, 35.08, 29.38, 24.68, 17.52, 5.66, 2.63, 0.0],
        ],
    ),
    (
        0.3,
        [
            [-6.32, -10.41, -12.98, -14.41, -15.52, -16.17, -16.74, -17.28, -16.96, -15.36, -3.42, 3.46, 3.82, 1.37],
            [4.92, 9.03, 12.71, 15.43, 18.75, 21.54, 24.34, 27.38, 31.26, 36.54, 36.06, 19.12, 13.71, 5.33],
        ],
    ),
];

fn arches() -> Vec<Finding> {
    let mut findings = Vec::new();
    let solved = Scene::from(arch_text(0.0, [50, 2], 2, 63)).solve();
    let peak = (1..=63).map(|step| solved.reaction("lower_ends", step).x.abs()).fold(0.0, f64::max);
    findings.push(Finding::compare("27 nodes, μ = 0, F_x: peak", 9.54, peak));
    for (mesh, elements, steps) in [("coarse", [40, 3], 63), ("fine", [100, 5], 126)] {
        for (friction, published) in PUBLISHED {
            let solved = Scene::from(arch_text(friction, elements, 1, steps)).solve();
            for (axis, published) in published.iter().enumerate() {
                // the published reactions are those of the arch on its feet, upwards positive
                let curve: Vec<f64> = std::iter::once(0.0)
                    .chain((1..=steps).map(|step| solved.reaction("lower_ends", step)[axis]))
                    .collect();
                let at = |u: f64| {
                    let place = (u / 31.5 * steps as f64).clamp(0.0, steps as f64 - 1e-9);
                    let (step, part) = (place.floor() as usize, place.fract());
                    curve[step] + part * (curve[step + 1] - curve[step])
                };
                let largest = published.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
                let deviation = |(u, force): (&f64, &f64)| {
                    let shifts = (-20..=20).map(|k| (at(u + 0.02 * f64::from(k)) - force).powi(2));
                    shifts.fold(f64::INFINITY, f64::min)
                };
                let exactly = STATIONS.iter().zip(published).map(|(&u, force)| (at(u) - force).powi(2));
                let as_printed = (exactly.sum::<f64>() / STATIONS.len() as f64).sqrt() / largest;
                let squares: f64 = STATIONS.iter().zip(published).map(deviation).sum();
                let name = format!("{mesh}, μ = {friction}, F_{}", ["x", "y"][axis]);
                let rms = (squares / STATIONS.len() as f64).sqrt() / largest;
                findings.push(Finding::at_most(format!("{name}: RMS"), 0.02, rms));
                findings.push(Finding::shown(format!("{name}: RMS, stations as printed"), as_printed));
                let peak = curve.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
                let expected = match (friction == 0.0, axis) {
                    (true, 0) => 9.54,
                    (true, _) => 35.66,
                    (false, 0) => 17.28,
                    (false, _) => 39.00,
                };
                findings.push(Finding::compare(format!("{name}: peak"), expected, peak));
            }
        }
    }
    findings
}

fn arch_text(friction: f64, [around, radial]: [usize; 2], order: usize, steps: usize) -> String {
    let arch = |name: &str, inner: f64, place: &str| {
        format!(
            "[[body]]\nname = '{name}'\nhalf_ring = {{ inner_radius = {inner}, outer_radius = {}, width = 1, elements = \
             [{around}, {radial}, 1] }}\nplace = {place}\nelement = 'f_bar'\norder = {order}\nmaterial = {{ j2_linear = {{ youngs_modulus \
             = 689.56, poisson_ratio = 0.32, yield_stress = 31, hardening_modulus = 261.2 }} }}\n\
             [[dirichlet]]\nset = '{name}_zmin'\ncomponents = ['z']\n[[dirichlet]]\nset = '{name}_zmax'\ncomponents = ['z']\n",
            inner + 2.0
        )
    };
    arch("lower", 10.0, "{ rotate = { axis = [0, 0, 1], degrees = 180 }, translate = [12, 0, 0] }")
        + &arch("upper", 8.0, "{ translate = [-1.9642, 17, 0] }")
        + &format!(
            "[[contact]]\nslave = 'upper_outer'\nmaster = 'lower_outer'\nfriction = {friction}\n\
             [[dirichlet]]\nset = 'lower_ends'\n[[dirichlet]]\nset = 'upper_ends'\nmotion = [{{ t = 1, u = [31.5, 0, 0] }}]\n\
             [load_path]\nsteps = {steps}\n"
        )
}

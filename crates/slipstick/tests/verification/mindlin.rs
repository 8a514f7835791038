//! Two cylinders pressed together and sheared: Hertz, Cattaneo and Mindlin.

use crate::chapter::Chapter;
use crate::finding::Finding;
use crate::mapped::mapped_box;
use crate::solved::{Scene, Solved, neo_hooke};
use slipstick_contact::ContactStatus;
use std::f64::consts::{FRAC_PI_2, PI};

pub fn chapter() -> Chapter {
    Chapter {
        key: "mindlin",
        title: "Cattaneo and Mindlin: two cylinders",
        about: "
Two parallel cylinders in plane strain (R = 8, E = 200, ν = 0.3, μ = 0.2) are pressed together by P
= 10 per length, then sheared by Q = 0.93616 (often given as loads p = 0.625 and q = 0.05851 over
the width 16). The analytic solution, for half planes and small strains, is: half width b =
√(4PR*/πE*) = 0.68078, p₀ = 2P/πb = 9.3514; the middle |x| < c = b √(1 − Q/μP) = 0.72933 b sticks,
and the traction is μp₀ (√(1 − x²/b²) − c/b √(1 − x²/c²)). The bodies are half-rings (inner radius
1), driven at their inner faces; the driving displacements are iterated until P and Q are met within
0.2 % (the expected values are those for the computed forces). Dual shapes, augmented Lagrangian;
the slave has N facets around, refined towards the contact, the master 3/4 N. b and c are computed
from second moments of the tractions: ∫ p x² = P b²/4, ∫ q x² = μP b²/4 (1 − c⁴/b⁴); p₀ is the nodal
pressure next to the middle. Node statuses resolve c only to one facet length, so that is the bound
for that row.",
        remarks: "
At P = 10, p₀/E* is 0.085, and strains of a few percent are beyond the range of the theory: p₀
converges to a value about 2.5 % above it. At P/16, where all lengths and strains of the contact are
a quarter, the deviations fall below 2 % and still decrease as the mesh is refined.

With standard shapes, nodal multipliers oscillate about the pressure, from the edges of the contact
inwards, by 8 to 12 % of p₀ within 0.8 b; with dual shapes, by 1 to 3 %. Forces and displacements do
not oscillate. For tractions at nodes, use dual shapes.

With Lagrange multipliers and friction, this problem has no solution: all displacements normal to
the plane are prescribed, so the condition that a node sticks in this direction is redundant, and
the matrix is singular, as the program reports. The augmented Lagrangian and the penalty method are
not affected.",
        quick: false,
        run: || Some(run()),
    }
}

const RADIUS: f64 = 8.0;
const FRICTION: f64 = 0.2;
const WIDTH: f64 = 0.1;
const LOADS: [f64; 2] = [10.0, 0.93616];

/// Measurements after pressing and after shearing.
struct Measured {
    force: [f64; 2],
    half_width: f64,
    peak: f64,
    /// Largest deviation of a nodal pressure from the ellipse of these loads and width, within 0.8
    /// b, relative to p₀.
    roughness: f64,
    stick: f64,
    /// Half the width between the boundaries of stick, each taken in the middle of the facet that
    /// it crosses.
    boundary: f64,
    /// Length of those facets, the larger of the two.
    facet: f64,
}

fn run() -> Vec<Finding> {
    let modulus = 200.0 / (2.0 * (1.0 - 0.09));
    let mut findings = Vec::new();
    // fraction of the loads, grading of the nodes towards the contact, initial displacements
    for (share, pull, mut motion) in [(1.0, 0.12, [0.2339, 0.38]), (1.0 / 16.0, 0.03, [0.0192, 0.0196])] {
        for n in [24, 48, 64] {
            let found = iterated(LOADS.map(|load| load * share), &mut motion, n, pull);
            if n == 48 {
                let standard = solve(motion, n, pull, "standard");
                for (shape, rough) in [("dual", found.roughness), ("standard", standard.roughness)] {
                    let what =
                        format!("P = {}, N = {n}: nodal pressures off the ellipse, {shape} shapes", LOADS[0] * share);
                    findings.push(Finding::shown(what, rough));
                }
            }
            let [normal, tangential] = found.force;
            let b = (4.0 * normal * 0.5 * RADIUS / (PI * modulus)).sqrt();
            let c = b * (1.0 - tangential / (FRICTION * normal)).sqrt();
            let name = format!("P = {}, N = {n}", LOADS[0] * share);
            let fine = n == 64;
            let mut push = |name_of: &str, expected: f64, within: f64, value: f64| {
                let what = format!("{name}: {name_of}");
                // finite strain, see the remarks
                let known = share == 1.0 && name_of == "p₀";
                findings.push(if fine && known {
                    Finding::value(what, expected, within, value).known()
                } else if fine {
                    Finding::value(what, expected, within, value)
                } else {
                    Finding::compare(what, expected, value)
                });
            };
            push("b", b, 0.02, found.half_width);
            push("p₀", 2.0 * normal / (PI * b), 0.02, found.peak);
            push("c", c, 0.02, found.stick);
            // statuses determine it up to half a facet on either side
            push("c from statuses", c, found.facet / c, found.boundary);
        }
    }
    findings
}

/// Press and shear displacements that give the forces to 0.2 %, by the secant method; `motion` is
/// the initial guess and the result.
fn iterated(wanted: [f64; 2], motion: &mut [f64; 2], n: usize, pull: f64) -> Measured {
    for _ in 0..12 {
        let found = solve(*motion, n, pull, "dual");
        let off = [0, 1].map(|k| found.force[k] / wanted[k] - 1.0);
        if off.iter().all(|o| o.abs() < 2e-3) {
            return found;
        }
        // both forces are about proportional to their displacements
        (0..2).for_each(|k| motion[k] /= 1.0 + off[k]);
    }
    panic!("the displacements do not settle");
}

fn solve([press, shear]: [f64; 2], n: usize, pull: f64, shape: &str) -> Measured {
    let mut scene = Scene::default();
    for (name, n, place) in [
        ("upper", n, "place = { translate = [0, 8, 0] }\n"),
        ("lower", n * 3 / 4, "place = { rotate = { axis = [0, 0, 1], degrees = 180 }, translate = [0, -8, 0] }\n"),
    ] {
        scene.files.insert(format!("{name}.inp"), half_ring(name, n, pull));
        scene.text +=
            &format!("[[body]]\nname = '{name}'\nmesh = {{ file = '{name}.inp' }}\n{place}{}\n", neo_hooke(200.0, 0.3));
    }
    scene.text += &format!(
        "[[set]]\nname = 'all'\nboxes = [{{ min = [-20, -20, -20], max = [20, 20, 20] }}]\n\
         [[surface]]\nname = 'upper_tip'\nbody = 'upper'\nwithin = 'upper_ymin'\nboxes = [{{ min = [-4, -1, -1], max = [4, 2, 1] }}]\n\
         [[surface]]\nname = 'lower_tip'\nbody = 'lower'\nwithin = 'lower_ymin'\nboxes = [{{ min = [-4, -2, -1], max = [4, 1, 1] }}]\n\
         [[contact]]\nslave = 'upper_tip'\nmaster = 'lower_tip'\nfriction = {FRICTION}\nmultiplier_shape = '{shape}'\nenforcement = {{ augmented = {{ tolerance = 1e-5 }} }}\n\
         [[dirichlet]]\nset = 'all'\ncomponents = ['z']\n\
         [[dirichlet]]\nset = 'lower_ymax'\ncomponents = ['x', 'y']\n\
         [[dirichlet]]\nset = 'upper_ymax'\ncomponents = ['x', 'y']\n\
         motion = [{{ t = 0.4, u = [0, {:?}, 0] }}, {{ t = 1.0, u = [{shear:?}, {:?}, 0] }}]\n\
         [load_path]\nsteps = 10\n",
        -press, -press
    );
    measure(&mut scene.solve())
}

/// Half a ring, one element wide: angles are drawn towards the lowest point, radii towards the
/// outer side (ymin).
fn half_ring(name: &str, n: usize, pull: f64) -> String {
    mapped_box(name, [n, n / 4, 1], |[s, r, t]| {
        let u = 2.0 * s - 1.0;
        let angle = FRAC_PI_2 * (pull * u + (1.0 - pull) * u.powi(5));
        let radius = RADIUS - (RADIUS - 1.0) * (1.5 * pull * r + (1.0 - 1.5 * pull) * r.powi(3));
        [radius * angle.sin(), -radius * angle.cos(), WIDTH * t]
    })
}

fn measure(solved: &mut Solved) -> Measured {
    let last = solved.steps();
    let force = solved.reaction("upper_ymax", last) / WIDTH;
    let mut nodes: Vec<_> = solved.contact(last);
    // one line of nodes across
    nodes.retain(|node| solved.problem.mesh.nodes[node.node as usize][2] == 0.0);
    let place = |node: u32| solved.position(node, last).x;
    nodes.sort_by(|a, b| place(a.node).total_cmp(&place(b.node)));
    let side = -nodes.iter().map(|n| n.global_multiplier[1]).sum::<f64>().signum();
    let pressure = |k: usize| nodes[k].global_multiplier[1] * -side;
    let shear = |k: usize| nodes[k].global_multiplier[0] * side;
    // integrals of piecewise linear tractions; the contact moves with the shear displacement
    let integral = |f: &dyn Fn(usize) -> f64, weight: &dyn Fn(f64) -> f64| -> f64 {
        let simpson = |k: usize| {
            let (a, b) = (place(nodes[k].node), place(nodes[k + 1].node));
            let middle = 0.5 * (f(k) + f(k + 1)) * weight(0.5 * (a + b));
            (b - a) / 6.0 * (f(k) * weight(a) + 4.0 * middle + f(k + 1) * weight(b))
        };
        (0..nodes.len() - 1).map(simpson).sum()
    };
    let total = integral(&pressure, &|_| 1.0);
    let centre = integral(&pressure, &|x| x) / total;
    let half_width = 2.0 * (integral(&pressure, &|x| (x - centre).powi(2)) / total).sqrt();
    let total_shear = integral(&shear, &|_| 1.0);
    let shear_centre = integral(&shear, &|x| x) / total_shear;
    let moment = integral(&shear, &|x| (x - shear_centre).powi(2));
    let rest = 1.0 - 4.0 * moment / (FRICTION * total * half_width.powi(2));
    let middle = (0..nodes.len())
        .min_by(|&i, &j| (place(nodes[i].node) - centre).abs().total_cmp(&(place(nodes[j].node) - centre).abs()))
        .expect("nodes");
    let p0 = 2.0 * total / (PI * half_width);
    let ellipse = |k: usize| (1.0 - ((place(nodes[k].node) - centre) / half_width).powi(2)).sqrt();
    let inner = (0..nodes.len()).filter(|&k| (place(nodes[k].node) - centre).abs() < 0.8 * half_width);
    let stick: Vec<usize> = (0..nodes.len()).filter(|&k| nodes[k].status == ContactStatus::Stick).collect();
    let (first, last) = (stick[0], stick[stick.len() - 1]);
    let at = |k: usize| place(nodes[k].node);
    let (left, right) = ([at(first - 1), at(first)], [at(last), at(last + 1)]);
    Measured {
        force: [-force.y, force.x],
        half_width,
        peak: pressure(middle),
        roughness: inner.map(|k| (pressure(k) / p0 - ellipse(k)).abs()).fold(0.0, f64::max),
        stick: half_width * rest.max(0.0).powf(0.25),
        boundary: 0.25 * (right[0] + right[1] - left[0] - left[1]),
        facet: (right[1] - right[0]).max(left[1] - left[0]),
    }
}

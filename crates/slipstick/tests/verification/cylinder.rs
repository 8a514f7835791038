//! A hollow cylinder of nearly incompressible material under pressure: Lamé.

use crate::chapter::Chapter;
use crate::common::{forward, problem_with};
use crate::finding::Finding;
use slipstick::build::Problem;
use slipstick_mesh::{HollowCylinderShape, Mesh, hollow_cylinder};

pub fn chapter() -> Chapter {
    Chapter {
        key: "cylinder",
        title: "Nearly incompressible cylinder under pressure",
        about: "
A hollow cylinder (radius 1 … 2, plane strain, ν = 0.4999) under pressure from inside. Each row
gives the mean radial displacement of the inner surface divided by that of Lamé's solution, u(a) =
(1 + ν) p a ((1 − 2ν) a² + b²)/(E (b² − a²)). The strains are so small that the pressure acts on the
undeformed surface. There are two quadratic or four linear elements through the wall. The last row
is a convergence study with N quadratic elements through the wall.",
        remarks: "
Fully integrated linear hexahedra lock. With F̄ (mean dilatation), none of the elements does, and
the error of 27-node hexahedra falls by at least 2³, the factor of quadratic elements, when the mesh
is refined once.",
        quick: true,
        run: || Some(run()),
    }
}

fn run() -> Vec<Finding> {
    let mut findings = Vec::new();
    let elements = [
        (Kind::Hex8, "8 nodes", [4, 32, 1]),
        (Kind::Hex27, "27 nodes", [2, 16, 1]),
        (Kind::Tet10, "10 nodes", [2, 16, 1]),
    ];
    for (kind, name, elements) in elements {
        let full = relative(&mut cylinder(kind, elements, "full"));
        let f_bar = relative(&mut cylinder(kind, elements, "f_bar"));
        findings.push(match kind {
            // it locks, or the comparison would show nothing
            Kind::Hex8 => Finding::at_most(format!("{name}, full integration"), 0.5, full),
            _ => Finding::compare(format!("{name}, full integration"), 1.0, full),
        });
        findings.push(Finding::value(format!("{name}, F̄"), 1.0, 0.01, f_bar));
    }
    let error = |n: usize| (relative(&mut cylinder(Kind::Hex27, [n, 8 * n, 1], "f_bar")) - 1.0).abs();
    findings.push(Finding::at_most("27 nodes, F̄: error of N = 2 over that of N = 1", 0.125, error(2) / error(1)));
    findings
}

const INNER: f64 = 1.0;
const OUTER: f64 = 2.0;
const RATIO: f64 = 0.4999;
/// So large that the pressure, which follows the surface, acts on the undeformed one.
const MODULUS: f64 = 1e8;
const PRESSURE: f64 = 1.0;

/// What the hexahedra of the cylinder become.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Hex8,
    Hex27,
    Tet10,
}

/// A hollow cylinder under pressure from inside, in plane strain.
fn cylinder(kind: Kind, elements: [usize; 3], element: &str) -> Problem {
    let height = 0.25;
    let shape = HollowCylinderShape { inner_radius: INNER, outer_radius: OUTER, height, elements };
    let linear = hollow_cylinder("tube", &shape).unwrap();
    let round = |of: &[[f64; 3]]| -> [f64; 3] {
        let mean = |f: &dyn Fn(&[f64; 3]) -> f64| of.iter().map(f).sum::<f64>() / of.len() as f64;
        let [x, y, z] = [0, 1, 2].map(|c| mean(&|x| x[c]));
        let factor = mean(&|x| x[0].hypot(x[2])) / x.hypot(z);
        [factor * x, y, factor * z]
    };
    let mesh: Mesh = match kind {
        Kind::Hex8 => linear,
        Kind::Hex27 => linear.second_order(round).unwrap(),
        Kind::Tet10 => linear.divided(|_| true).second_order(round).unwrap(),
    };
    let set = |name: &str, normal: [f64; 3]| {
        format!("[[set]]\nname = \"{name}\"\nplane = {{ point = [0, 0, 0], normal = {normal:?} }}\n")
    };
    let text = format!(
        "[[body]]\nname = \"tube\"\nmesh = {{ file = 'tube' }}\nelement = \"{element}\"\n\
         material = {{ linear_elastic = {{ youngs_modulus = {MODULUS:?}, poisson_ratio = {RATIO:?} }} }}\n\
         {}{}[[set]]\nname = \"all\"\nboxes = [{{ min = [-3, -1, -3], max = [3, 1, 3] }}]\n\
         [[dirichlet]]\nset = \"x\"\ncomponents = [\"x\"]\n[[dirichlet]]\nset = \"z\"\ncomponents = [\"z\"]\n\
         [[dirichlet]]\nset = \"all\"\ncomponents = [\"y\"]\n\
         [[load]]\nsurface = \"tube_inner\"\npressure = {PRESSURE:?}\n[load_path]\nsteps = 1\n",
        set("x", [1.0, 0.0, 0.0]),
        set("z", [0.0, 0.0, 1.0])
    );
    problem_with(&text, &[("tube", mesh)])
}

/// Mean radial displacement of the inner surface over that of Lamé's solution in plane strain,
/// u(a) = (1 + ν) p a ((1 − 2ν) a² + b²)/(E (b² − a²)).
fn relative(problem: &mut Problem) -> f64 {
    let density = problem.initial_density().clone();
    let run = forward(problem, &density);
    let d = &run.path.states.last().unwrap().state.unknowns;
    let nodes = problem.mesh.surfaces["tube_inner"].nodes();
    let radial = |n: &u32| {
        let (x, at) = (problem.mesh.nodes[*n as usize], 3 * *n as usize);
        (x[0] * d[at] + x[2] * d[at + 2]) / x[0].hypot(x[2])
    };
    let mean = nodes.iter().map(radial).sum::<f64>() / nodes.len() as f64;
    let (a, b) = (INNER, OUTER);
    let exact = (1.0 + RATIO) * PRESSURE * a * ((1.0 - 2.0 * RATIO) * a * a + b * b) / (MODULUS * (b * b - a * a));
    mean / exact
}

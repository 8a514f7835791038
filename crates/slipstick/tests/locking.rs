//! Nearly incompressible material: elements with F̄ do not lock.

mod common;

use common::*;
use slipstick::build::Problem;
use slipstick_mesh::{HollowCylinderShape, Mesh, hollow_cylinder};

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

/// Two quadratic elements, or four linear ones, through the wall. With F̄, every element is within
/// 1 %; fully integrated linear hexahedra have a tenth of the displacement.
#[test]
fn a_cylinder_under_pressure_does_not_lock() {
    let mut found = Vec::new();
    for (kind, elements) in [(Kind::Hex8, [4, 32, 1]), (Kind::Hex27, [2, 16, 1]), (Kind::Tet10, [2, 16, 1])] {
        for element in ["full", "f_bar"] {
            let relative = relative(&mut cylinder(kind, elements, element));
            println!("{kind:?}, {element}: {relative:.6} of Lamé's displacement");
            found.push((kind, element, relative));
        }
    }
    for (kind, element, relative) in found {
        match (kind, element) {
            (Kind::Hex8, "full") => assert!(relative < 0.5, "{relative}"),
            (_, "f_bar") => assert!((relative - 1.0).abs() < 0.01, "{kind:?}: {relative}"),
            _ => {}
        }
    }
}

/// The displacement of hexahedra of 27 nodes with F̄ converges with the order of quadratic elements:
/// the error falls by more than a factor of 8 when the mesh is refined once.
#[test]
fn quadratic_hexahedra_converge_with_their_order() {
    let error = |n: usize| (relative(&mut cylinder(Kind::Hex27, [n, 8 * n, 1], "f_bar")) - 1.0).abs();
    let (coarse, fine) = (error(1), error(2));
    println!("errors {coarse:.2e} and {fine:.2e}");
    assert!(fine < coarse / 8.0, "{coarse:e} {fine:e}");
}

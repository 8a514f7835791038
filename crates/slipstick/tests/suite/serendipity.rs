//! Hexahedra of 20 nodes: `shape_functions = "serendipity"`.

use crate::common::*;
use nalgebra::{DMatrix, DVector, Matrix3};
use slipstick::build::Problem;
use slipstick_mesh::{BoxShape, Mesh, box_mesh};
use std::array::from_fn;

const E: f64 = 100.0;
const NU: f64 = 0.3;

/// One hexahedron of 27 nodes, distorted, with curved edges; its last seven nodes lie anywhere.
fn distorted_cube() -> Mesh {
    let shape = BoxShape { min: [0.0; 3], max: [1.0, 1.2, 0.9], elements: [1; 3], grading: [1.0; 3] };
    let mut mesh = box_mesh("b", &shape).unwrap();
    for (n, x) in mesh.nodes.iter_mut().enumerate() {
        (0..3).for_each(|c| x[c] += 0.08 * ((3 * n + c) as f64 * 1.7).sin());
    }
    let bent = |of: &[[f64; 3]]| {
        from_fn(|c| {
            let mean = of.iter().map(|x| x[c]).sum::<f64>() / of.len() as f64;
            mean + 0.04 * (9.0 * mean + 4.0 * c as f64).sin()
        })
    };
    mesh.second_order(bent).unwrap()
}

/// Corners, then the middles of edges, in the order of Abaqus' C3D20.
fn parent(node: usize) -> [f64; 3] {
    const C: [[f64; 3]; 8] = [
        [-1.0, -1.0, -1.0],
        [1.0, -1.0, -1.0],
        [1.0, 1.0, -1.0],
        [-1.0, 1.0, -1.0],
        [-1.0, -1.0, 1.0],
        [1.0, -1.0, 1.0],
        [1.0, 1.0, 1.0],
        [-1.0, 1.0, 1.0],
    ];
    let mean = |a: usize, b: usize| from_fn(|c| 0.5 * (C[a][c] + C[b][c]));
    match node {
        0..8 => C[node],
        8..12 => mean(node - 8, (node - 7) % 4),
        12..16 => mean(node - 8, 4 + (node - 11) % 4),
        _ => mean(node - 16, node - 12),
    }
}

/// Slopes of a serendipity function (Zienkiewicz and Taylor, The Finite Element Method, vol. 1) by the product rule.
fn slope(node: usize, at: [f64; 3]) -> [f64; 3] {
    let p = parent(node);
    if node < 8 {
        let factors: [f64; 3] = from_fn(|c| 1.0 + p[c] * at[c]);
        let sum = (0..3).map(|c| p[c] * at[c]).sum::<f64>() - 2.0;
        return from_fn(|c| {
            let others = factors[(c + 1) % 3] * factors[(c + 2) % 3];
            p[c] * others * (sum + factors[c]) / 8.0
        });
    }
    let value = |c: usize| if p[c] == 0.0 { 1.0 - at[c] * at[c] } else { 1.0 + p[c] * at[c] };
    let slope = |c: usize| if p[c] == 0.0 { -2.0 * at[c] } else { p[c] };
    from_fn(|c| 0.25 * slope(c) * value((c + 1) % 3) * value((c + 2) % 3))
}

/// The stiffness of a linear elastic hexahedron of 20 nodes, Σ w Bᵀ C B.
fn stiffness(x: &[[f64; 3]], points: usize) -> DMatrix<f64> {
    let line: Vec<(f64, f64)> = match points {
        2 => [-1.0, 1.0].map(|sign| (sign / 3.0_f64.sqrt(), 1.0)).to_vec(),
        _ => [(-1.0, 5.0), (0.0, 8.0), (1.0, 5.0)].map(|(sign, w)| (sign * 0.6_f64.sqrt(), w / 9.0)).to_vec(),
    };
    let (lambda, mu) = (E * NU / ((1.0 + NU) * (1.0 - 2.0 * NU)), E / (2.0 * (1.0 + NU)));
    let mut k = DMatrix::zeros(60, 60);
    for i in 0..points.pow(3) {
        let [a, b, c] = [i % points, i / points % points, i / points / points].map(|i| line[i]);
        let slopes: Vec<[f64; 3]> = (0..20).map(|node| slope(node, [a.0, b.0, c.0])).collect();
        let jacobian = Matrix3::from_fn(|r, s| (0..20).map(|n| x[n][r] * slopes[n][s]).sum::<f64>());
        let inverse = jacobian.try_inverse().unwrap();
        let weight: f64 = a.1 * b.1 * c.1 * jacobian.determinant();
        let gradient = |n: usize, r: usize| (0..3).map(|s| slopes[n][s] * inverse[(s, r)]).sum::<f64>();
        let g: Vec<[f64; 3]> = (0..20).map(|n| from_fn(|r| gradient(n, r))).collect();
        for (n, m) in (0..20).flat_map(|n| (0..20).map(move |m| (n, m))) {
            let dot: f64 = (0..3).map(|r| g[n][r] * g[m][r]).sum();
            for (r, s) in (0..3).flat_map(|r| (0..3).map(move |s| (r, s))) {
                let shear = if r == s { mu * dot } else { 0.0 };
                k[(3 * n + r, 3 * m + s)] += weight * (lambda * g[n][r] * g[m][s] + mu * g[n][s] * g[m][r] + shear);
            }
        }
    }
    k
}

fn loaded(element: &str) -> Problem {
    let text = format!(
        "[[body]]\nname = 'b'\nmesh = {{ file = 'b' }}\nshape_functions = 'serendipity'\nelement = '{element}'\n\
         material = {{ linear_elastic = {{ youngs_modulus = {E}, poisson_ratio = {NU} }} }}\n\
         [[dirichlet]]\nset = 'b_ymin'\ncomponents = ['x', 'y', 'z']\n\
         [[load]]\nsurface = 'b_ymax'\nnodal_force = [0.3, -0.2, 0.5]\n\
         [load_path]\nsteps = 1\ntolerance = {{ relative = 1e-12 }}\n"
    );
    problem_with(&text, &[("b", distorted_cube())])
}

/// A distorted element of which one face is held and another one loaded: the displacements are those of an element
/// that is programmed here, from textbook functions. The nodes at centres have no other effect than that forces on
/// them act on the others: −1/4 on corners, 1/2 on edges.
#[test]
fn an_element_of_20_nodes_is_that_of_textbooks() {
    for (element, points) in [("full", 3), ("reduced", 2)] {
        let mut problem = loaded(element);
        let nodes = problem.mesh.elements[0].nodes().to_vec();
        let x: Vec<[f64; 3]> = nodes[..20].iter().map(|&n| problem.mesh.nodes[n as usize]).collect();
        let set = |name: &str| problem.mesh.set_nodes(name).unwrap().to_vec();
        let (held, top) = (set("b_ymin"), set("b_ymax"));
        let k = stiffness(&x, points);
        let force = DVector::from_fn(60, |i, _| match top.contains(&nodes[i / 3]) {
            true => [0.3, -0.2, 0.5][i % 3] * if i / 3 < 8 { 0.75 } else { 1.5 },
            false => 0.0,
        });
        let free: Vec<usize> = (0..60).filter(|i| !held.contains(&nodes[i / 3])).collect();
        let reduced = DMatrix::from_fn(free.len(), free.len(), |i, j| k[(free[i], free[j])]);
        let expected = reduced.lu().solve(&DVector::from_fn(free.len(), |i, _| force[free[i]])).unwrap();
        let density = problem.initial_density().clone();
        let run = forward(&mut problem, &density);
        let last = run.path.states.last().unwrap().state.clone();
        let size = expected.amax();
        for (i, expected) in free.iter().zip(expected.iter()) {
            let found = last.unknowns[3 * nodes[i / 3] as usize + i % 3];
            assert!((found - expected).abs() < 1e-10 * size, "{element}: {found} for {expected}");
        }
    }
}

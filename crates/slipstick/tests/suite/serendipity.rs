//! Hexahedra of 20 nodes and wedges of 15: `shape_functions = "serendipity"`.

use crate::common::*;
use crate::solved::Scene;
use nalgebra::{DMatrix, DVector, Matrix3};
use slipstick::build::Problem;
use slipstick_mesh::second_order::WEDGE18_POINTS;
use slipstick_mesh::{BoxShape, Element, Mesh, box_mesh};
use slipstick_solid::{ElementScaling, LawKind, SolidModel};
use std::array::from_fn;

const E: f64 = 100.0;
const NU: f64 = 0.3;

/// A distorted box with curved edges as one hexahedron of 27 nodes or two wedges of 18; the nodes at centres lie
/// anywhere.
fn distorted_box(wedges: bool) -> Mesh {
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
    mesh.divided_into_wedges(|_| wedges.then_some(2)).second_order(bent).unwrap()
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
fn slope_of_20(node: usize, at: [f64; 3]) -> [f64; 3] {
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

/// The same of Abaqus' C3D15 (functions as in the manual of CalculiX 2.20): corners L ((2L − 1)(1 ± ζ) − (1 − ζ²))/2,
/// edges of triangles 2 L M (1 ± ζ), edges along the axis L (1 − ζ²).
fn slope_of_15(node: usize, [r, s, z]: [f64; 3]) -> [f64; 3] {
    const BY: [[f64; 2]; 3] = [[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]];
    let (i, k) = (node % 3, (node + 1) % 3);
    let (l, m) = ([1.0 - r - s, r, s][i], [1.0 - r - s, r, s][k]);
    let side = if matches!(node, 0..3 | 6..9) { -1.0 } else { 1.0 };
    let (by_l, by_m, by_z) = match node {
        0..6 => (
            0.5 * ((4.0 * l - 1.0) * (1.0 + side * z) - (1.0 - z * z)),
            0.0,
            0.5 * l * ((2.0 * l - 1.0) * side + 2.0 * z),
        ),
        6..12 => (2.0 * m * (1.0 + side * z), 2.0 * l * (1.0 + side * z), 2.0 * l * m * side),
        _ => (1.0 - z * z, 0.0, -2.0 * z * l),
    };
    [by_l * BY[i][0] + by_m * BY[k][0], by_l * BY[i][1] + by_m * BY[k][1], by_z]
}

/// The points of hexahedra and their weights, n along each direction.
fn cube(n: usize) -> Vec<([f64; 3], f64)> {
    let line: Vec<(f64, f64)> = match n {
        2 => [-1.0, 1.0].map(|sign| (sign / 3.0_f64.sqrt(), 1.0)).to_vec(),
        _ => [(-1.0, 5.0), (0.0, 8.0), (1.0, 5.0)].map(|(sign, w)| (sign * 0.6_f64.sqrt(), w / 9.0)).to_vec(),
    };
    let point = |i: usize| [i % n, i / n % n, i / n / n].map(|i| line[i]);
    (0..n.pow(3)).map(point).map(|[a, b, c]| ([a.0, b.0, c.0], a.1 * b.1 * c.1)).collect()
}

/// The stiffness of a linear elastic element, Σ w Bᵀ C B.
fn stiffness(x: &[[f64; 3]], points: &[([f64; 3], f64)], slope: impl Fn(usize, [f64; 3]) -> [f64; 3]) -> DMatrix<f64> {
    let nodes = x.len();
    let (lambda, mu) = (E * NU / ((1.0 + NU) * (1.0 - 2.0 * NU)), E / (2.0 * (1.0 + NU)));
    let mut k = DMatrix::zeros(3 * nodes, 3 * nodes);
    for &(at, weight) in points {
        let slopes: Vec<[f64; 3]> = (0..nodes).map(|node| slope(node, at)).collect();
        let jacobian = Matrix3::from_fn(|r, s| (0..nodes).map(|n| x[n][r] * slopes[n][s]).sum::<f64>());
        let inverse = jacobian.try_inverse().unwrap();
        let weight: f64 = weight * jacobian.determinant();
        let gradient = |n: usize, r: usize| (0..3).map(|s| slopes[n][s] * inverse[(s, r)]).sum::<f64>();
        let g: Vec<[f64; 3]> = (0..nodes).map(|n| from_fn(|r| gradient(n, r))).collect();
        for (n, m) in (0..nodes).flat_map(|n| (0..nodes).map(move |m| (n, m))) {
            let dot: f64 = (0..3).map(|r| g[n][r] * g[m][r]).sum();
            for (r, s) in (0..3).flat_map(|r| (0..3).map(move |s| (r, s))) {
                let shear = if r == s { mu * dot } else { 0.0 };
                k[(3 * n + r, 3 * m + s)] += weight * (lambda * g[n][r] * g[m][s] + mu * g[n][s] * g[m][r] + shear);
            }
        }
    }
    k
}

fn loaded(element: &str, wedges: bool) -> Problem {
    let text = format!(
        "[[body]]\nname = 'b'\nmesh = {{ file = 'b' }}\nshape_functions = 'serendipity'\nelement = '{element}'\n\
         material = {{ linear_elastic = {{ youngs_modulus = {E}, poisson_ratio = {NU} }} }}\n\
         [[dirichlet]]\nset = 'b_ymin'\ncomponents = ['x', 'y', 'z']\n\
         [[load]]\nsurface = 'b_ymax'\nnodal_force = [0.3, -0.2, 0.5]\n\
         [load_path]\nsteps = 1\ntolerance = {{ relative = 1e-12 }}\n"
    );
    problem_with(&text, &[("b", distorted_box(wedges))])
}

/// A distorted box of which one face is held and another one loaded, as a hexahedron and as two wedges: the
/// displacements are those of elements that are programmed here, from textbook functions. The nodes at centres have
/// no other effect than that forces on them act on the others: −1/4 on corners, 1/2 on edges.
#[test]
fn elements_of_20_and_15_nodes_are_those_of_textbooks() {
    for (element, points, wedges) in [("full", cube(3), false), ("reduced", cube(2), false), ("full", vec![], true)] {
        let mut problem = loaded(element, wedges);
        let mesh = &problem.mesh;
        let all = 3 * mesh.nodes.len();
        let mut k = DMatrix::zeros(all, all);
        let (mut corners, mut middles) = (Vec::new(), Vec::new());
        for element in &mesh.elements {
            let count = if wedges { 15 } else { 20 };
            let nodes = &element.nodes()[..count];
            corners.extend(element.corners());
            middles.extend(&nodes[element.corners().len()..]);
            let x: Vec<[f64; 3]> = nodes.iter().map(|&n| mesh.nodes[n as usize]).collect();
            let own = match element {
                Element::Wedge18(_) => stiffness(&x, &WEDGE18_POINTS, slope_of_15),
                _ => stiffness(&x, &points, slope_of_20),
            };
            let at = |i: usize| 3 * nodes[i / 3] as usize + i % 3;
            for (i, j) in (0..3 * count).flat_map(|i| (0..3 * count).map(move |j| (i, j))) {
                k[(at(i), at(j))] += own[(i, j)];
            }
        }
        let set = |name: &str| mesh.set_nodes(name).unwrap().to_vec();
        let (held, top) = (set("b_ymin"), set("b_ymax"));
        let weight = |node: u32| match (top.contains(&node), corners.contains(&node)) {
            (false, _) => 0.0,
            (_, true) => 0.75,
            _ => 1.5,
        };
        let moves = |node: u32| !held.contains(&node) && (corners.contains(&node) || middles.contains(&node));
        let free: Vec<usize> = (0..all).filter(|i| moves(*i as u32 / 3)).collect();
        let reduced = DMatrix::from_fn(free.len(), free.len(), |i, j| k[(free[i], free[j])]);
        let force = |i: usize| [0.3, -0.2, 0.5][i % 3] * weight(i as u32 / 3);
        let expected = reduced.lu().solve(&DVector::from_fn(free.len(), |i, _| force(free[i]))).unwrap();
        let density = problem.initial_density().clone();
        let run = forward(&mut problem, &density);
        let last = run.path.states.last().unwrap().state.clone();
        let size = expected.amax();
        for (&i, expected) in free.iter().zip(expected.iter()) {
            let found = last.unknowns[i];
            assert!((found - expected).abs() < 1e-10 * size, "{element}, wedges: {wedges}: {found} for {expected}");
        }
    }
}

/// Only the six rigid motions of a wedge of 18 nodes have no energy: nine points suffice.
#[test]
fn nine_points_hold_all_motions_of_a_wedge() {
    let mut mesh = distorted_box(true);
    mesh.elements.truncate(1);
    mesh.bodies[0].elements = 0..1;
    let model = SolidModel::new(&mesh, vec![LawKind::LinearElastic.like(E, NU).unwrap()]).unwrap();
    let n = 3 * mesh.nodes.len();
    let own: Vec<usize> =
        mesh.elements[0].nodes().iter().flat_map(|&n| (0..3).map(move |c| 3 * n as usize + c)).collect();
    let mut k = DMatrix::zeros(own.len(), own.len());
    for (column, &at) in own.iter().enumerate() {
        let (mut direction, mut product) = (vec![0.0; n], vec![0.0; n]);
        direction[at] = 1.0;
        model.add_tangent_product(&vec![0.0; n], &[ElementScaling::SOLID], &direction, &mut product).unwrap();
        own.iter().enumerate().for_each(|(row, &at)| k[(row, column)] = product[at]);
    }
    let mut found: Vec<f64> = k.symmetric_eigenvalues().iter().copied().collect();
    found.sort_by(f64::total_cmp);
    let largest = found[found.len() - 1];
    println!("{:e} … {:e}, {:e} … {largest:e}", found[0], found[5], found[6]);
    assert!(found[5].abs() < 1e-13 * largest && found[6] > 1e-4 * largest);
}

/// Displacements at the end of a curved beam of four `C3D15` in CalculiX 2.20 (`*NODE PRINT`), with small and with large
/// deformations, which bend it by more than its thickness. CalculiX' Newton iteration stops at a residual force of 0.5 %.
#[test]
fn a_ring_of_wedges_of_15_nodes_is_that_of_calculix() {
    // nodes 23, 27, 28 and 32: corners, and middles of edges
    let places = [[0.0, 1.0, 0.0], [0.0, 1.25, 0.8], [0.0, 1.25, 0.4], [0.0, 1.5, 0.0]];
    let small = [
        [-2.423355, -2.019297, 2.803615],
        [-1.011929, -2.984332, 2.944088],
        [-1.848232, -2.530902, 2.982432],
        [-3.356595, -2.050636, 3.428734],
    ];
    let large = [
        [-6.131847e-1, -8.026953e-1, 1.018274],
        [7.153043e-2, -1.558142, 5.698386e-1],
        [-1.950489e-1, -1.264662, 8.348139e-1],
        [-3.559554e-1, -1.158687, 1.541130],
    ];
    for (step, expected, tolerance) in [("*STEP", small, 3e-7), ("*STEP, NLGEOM", large, 5e-6)] {
        let deck = include_str!("../data/ring_of_wedges.inp").to_owned()
            + step
            + "\n*STATIC, DIRECT\n0.5, 1.\n*CLOAD\n23, 1, -4000.\n32, 3, 3000.\n27, 2, -2000.\n*END STEP\n";
        let text = "deck = { file = 'ring.inp' }\n".to_owned();
        let solved = Scene { text, files: [("ring.inp".to_owned(), deck)].into() }.solve();
        for (place, expected) in places.into_iter().zip(expected.map(nalgebra::Vector3::from)) {
            let node = solved.problem.mesh.nodes.iter().position(|x| *x == place).expect("a node");
            let found = solved.displacement(node as u32, solved.steps());
            let deviation = (found - expected).norm() / expected.norm();
            println!("{step} {place:?}: {deviation:e}");
            assert!(deviation < tolerance, "{step}: {found:?} instead of {expected:?}");
        }
    }
}

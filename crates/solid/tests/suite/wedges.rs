//! Wedges: uniform strains beside hexahedra and tetrahedra, the stiffness of one from its shape
//! functions, and bending.

use slipstick_linalg::{
    BlockMatrix, BlockPattern, LinearSolver, Reduction, RobustSolver, SolverChoice, solve_verified,
};
use slipstick_mesh::{Body, BoxShape, Mesh, box_mesh};
use slipstick_solid::{ElementScaling, Formulation, LawKind, NeoHooke, Section, SolidModel};
use std::sync::Arc;

/// Hexahedra, wedges along z, wedges along x and tetrahedra in the four quarters of a block; all
/// faces fit. Inner nodes are moved, so that quadrilaterals between elements are warped.
fn distorted() -> Mesh {
    let shape = BoxShape { min: [0.0; 3], max: [4.0, 2.0, 4.0], elements: [4, 2, 4], grading: [1.0; 3] };
    let mesh = box_mesh("block", &shape).unwrap();
    let quarter = |element: usize| mesh.centroid(element).map(|x| x > 2.0);
    let wedges = mesh.divided_into_wedges(|element| match quarter(element) {
        [true, _, false] => Some(2),
        [false, _, true] => Some(0),
        _ => None,
    });
    let mut mesh = wedges.divided(|element| wedges.centroid(element)[0] > 2.0 && wedges.centroid(element)[2] > 2.0);
    for node in inner(&mesh) {
        for c in 0..3 {
            mesh.nodes[node][c] += 0.2 * ((7 * node + 5 * c) as f64 * 1.7).sin();
        }
    }
    assert!(mesh.check().is_empty() && mesh.divided_quadrilaterals(0).is_empty());
    mesh
}

/// Nodes that are not on the boundary.
fn inner(mesh: &Mesh) -> Vec<usize> {
    let outer = mesh.boundary(0).nodes();
    (0..mesh.nodes.len()).filter(|n| outer.binary_search(&(*n as u32)).is_err()).collect()
}

/// The patch test: under displacements that are linear in X, no inner node feels a force, and the
/// energy is the law's times the volume.
#[test]
fn wedges_deform_uniformly() {
    let mesh = distorted();
    let laws = LawKind::ALL.iter().map(|law| law.like(100.0, 0.25).unwrap());
    let sections = laws.flat_map(|material| {
        [Formulation::Full, Formulation::FBar].map(|formulation| Section::new(material, formulation))
    });
    let h = [[-0.1, 0.2, 0.05], [0.1, 0.15, -0.1], [0.0, 0.1, 0.08]];
    let f = std::array::from_fn(|a| std::array::from_fn(|b| h[a][b] + f64::from(a == b)));
    let d: Vec<f64> =
        mesh.nodes.iter().flat_map(|x| h.map(|row| (0..3).map(|b| row[b] * x[b]).sum::<f64>() + 1.0)).collect();
    assert_eq!(inner(&mesh).len(), 9);
    for section in sections {
        let model = SolidModel::new(&mesh, vec![section]).unwrap();
        let scalings = vec![ElementScaling::SOLID; model.elements()];
        assert!((model.element_volumes().iter().sum::<f64>() - 32.0).abs() < 1e-12);
        let energy = model.energy(&d, &scalings).unwrap();
        assert!((energy / (32.0 * section.material.energy(&f)) - 1.0).abs() < 1e-13, "{section:?}: {energy}");
        let mut force = vec![0.0; d.len()];
        model.internal_force(&d, &scalings, &mut force).unwrap();
        let largest = force.iter().fold(0.0_f64, |largest, f| largest.max(f.abs()));
        for node in inner(&mesh) {
            let worst = force[3 * node..][..3].iter().fold(0.0_f64, |worst, f| worst.max(f.abs()));
            assert!(worst < 1e-14 * largest, "{section:?}, node {node}: {worst:e} of {largest}");
        }
    }
}

/// Shape functions N = L_i (1 ∓ ζ)/2 of a wedge, by their derivatives with respect to L₂, L₃ and ζ.
fn slopes([r, s, zeta]: [f64; 3]) -> [[f64; 3]; 6] {
    let area = [1.0 - r - s, r, s];
    let by_area = [[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]];
    std::array::from_fn(|node| {
        let (corner, sign) = (node % 3, if node < 3 { -1.0 } else { 1.0 });
        let along = 0.5 * (1.0 + sign * zeta);
        [by_area[corner][0] * along, by_area[corner][1] * along, 0.5 * sign * area[corner]]
    })
}

fn determinant(m: &[[f64; 3]; 3]) -> f64 {
    (0..3).map(|c| m[0][c] * (m[1][(c + 1) % 3] * m[2][(c + 2) % 3] - m[1][(c + 2) % 3] * m[2][(c + 1) % 3])).sum()
}

/// ∂N/∂X of all nodes and det ∂X/∂ξ at a point, by Cramer's rule.
fn gradients(corners: &[[f64; 3]; 6], at: [f64; 3]) -> ([[f64; 3]; 6], f64) {
    let slopes = slopes(at);
    let jacobian: [[f64; 3]; 3] =
        std::array::from_fn(|a| std::array::from_fn(|b| (0..6).map(|n| slopes[n][a] * corners[n][b]).sum()));
    let det = determinant(&jacobian);
    let gradient = |slope: [f64; 3]| {
        std::array::from_fn(|b| {
            let mut replaced = jacobian;
            (0..3).for_each(|a| replaced[a][b] = slope[a]);
            determinant(&replaced) / det
        })
    };
    (slopes.map(gradient), det)
}

/// The stiffness of linear elasticity, K_ia,kb = ∫ λ G_ia G_kb + μ (G_ib G_ka + δ_ab G_i·G_k), by
/// the three midpoints of the triangle's edges and three Gauss points along the axis: exact where
/// the gradients are linear.
fn stiffness(corners: &[[f64; 3]; 6], lambda: f64, mu: f64) -> [[f64; 18]; 18] {
    let root = 0.6_f64.sqrt();
    let mut k = [[0.0; 18]; 18];
    for (r, s) in [(0.5, 0.0), (0.5, 0.5), (0.0, 0.5)] {
        for (zeta, weight) in [(-root, 5.0 / 9.0), (0.0, 8.0 / 9.0), (root, 5.0 / 9.0)] {
            let (g, det) = gradients(corners, [r, s, zeta]);
            for (row, column) in (0..18).flat_map(|row| (0..18).map(move |column| (row, column))) {
                let ((i, a), (j, b)) = ((row / 3, row % 3), (column / 3, column % 3));
                let dot: f64 = (0..3).map(|c| g[i][c] * g[j][c]).sum();
                let shear = g[i][b] * g[j][a] + if a == b { dot } else { 0.0 };
                k[row][column] += weight / 6.0 * det * (lambda * g[i][a] * g[j][b] + mu * shear);
            }
        }
    }
    k
}

/// All entries of the tangent at rest of a sheared prism are those of its own shape functions,
/// whichever node comes first.
#[test]
fn a_wedge_has_the_stiffness_of_its_shape_functions() {
    let (e, nu) = (100.0, 0.3);
    let (lambda, mu) = (e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), e / (2.0 * (1.0 + nu)));
    let base = [[0.1, 0.0, 0.2], [1.3, 0.2, 0.0], [0.3, 0.9, 0.1]];
    for turned in 0..3 {
        let mut lower = base;
        lower.rotate_left(turned);
        let upper = lower.map(|[x, y, z]| [x + 0.3, y - 0.2, z + 0.8]);
        let corners: [[f64; 3]; 6] = std::array::from_fn(|n| if n < 3 { lower[n] } else { upper[n - 3] });
        let mesh = Mesh {
            nodes: corners.to_vec(),
            elements: vec![[0, 1, 2, 3, 4, 5].into()],
            bodies: vec![Body { name: "wedge".into(), elements: 0..1, nodes: 0..6 }],
            ..Mesh::default()
        };
        let model = SolidModel::new(&mesh, vec![NeoHooke::new(e, nu).unwrap()]).unwrap();
        let pattern = Arc::new(BlockPattern::from_rows(&mesh.node_neighbours()));
        let mut matrix = BlockMatrix::new(pattern.clone());
        let scalings = [ElementScaling::SOLID];
        model.add_tangent(&[0.0; 18], &scalings, &model.scatter(&pattern), &mut matrix).unwrap();
        let expected = stiffness(&corners, lambda, mu);
        for column in 0..18 {
            let (mut unit, mut found) = ([0.0; 18], [0.0; 18]);
            unit[column] = 1.0;
            matrix.mul(&unit, &mut found);
            for row in 0..18 {
                let (found, expected) = (found[row], expected[row][column]);
                assert!((found - expected).abs() < 1e-13 * e, "({row}, {column}): {found} for {expected}");
            }
        }
    }
}

/// Length, height and width of a bar along x, y and z.
const BAR: [f64; 3] = [2.0, 1.0, 0.5];

/// Linear strain energy of the bar at ν = 0, whose ends turn as in pure bending with the curvature
/// κ = 1: u = (−κ x y, κ x²/2, 0). `n` elements through the height, of wedges along a direction if
/// there is one.
fn bending_energy(n: usize, along: Option<usize>) -> f64 {
    let [length, height, width] = BAR;
    let (min, max) = ([-0.5 * length, -0.5 * height, 0.0], [0.5 * length, 0.5 * height, width]);
    let shape = BoxShape { min, max, elements: [2 * n, n, n.div_ceil(2)], grading: [1.0; 3] };
    let mesh = box_mesh("bar", &shape).unwrap().divided_into_wedges(|_| along);
    let model = SolidModel::new(&mesh, vec![NeoHooke::new(1.0, 0.0).unwrap()]).unwrap();
    let pattern = Arc::new(BlockPattern::from_rows(&mesh.node_neighbours()));
    let mut matrix = BlockMatrix::new(pattern.clone());
    let zero = vec![0.0; 3 * mesh.nodes.len()];
    let scalings = vec![ElementScaling::SOLID; model.elements()];
    model.add_tangent(&zero, &scalings, &model.scatter(&pattern), &mut matrix).unwrap();
    let at_end = |x: &[f64; 3]| x[0].abs() > 0.499 * length;
    let fixed: Vec<bool> = mesh.nodes.iter().flat_map(|x| [at_end(x); 3]).collect();
    let exact = mesh.nodes.iter().flat_map(|x| [-x[0] * x[1], 0.5 * x[0] * x[0], 0.0]);
    let mut u: Vec<f64> = exact.zip(&fixed).map(|(u, fixed)| if *fixed { u } else { 0.0 }).collect();
    let mut force = zero.clone();
    matrix.mul(&u, &mut force);
    let groups: Vec<u32> = (0..mesh.nodes.len() as u32).collect();
    let reduction = Reduction::new(&pattern, &fixed, &groups);
    let (system, rhs) = (reduction.reduce(&matrix), reduction.restrict(&force));
    let factors = RobustSolver::new(SolverChoice::Auto).analyse_and_factorize(&system).expect("factors");
    let mut step = vec![0.0; rhs.len()];
    solve_verified(&system, factors.as_ref(), false, &rhs, &mut step, 1e-12).expect("a solution");
    let mut change = zero;
    reduction.prolong(&step, &mut change);
    u.iter_mut().zip(change).for_each(|(u, change)| *u -= change);
    matrix.mul(&u, &mut force);
    0.5 * u.iter().zip(&force).map(|(u, f)| u * f).sum::<f64>()
}

/// Pure bending of a bar, E κ² I L/2 with I = w h³/12: wedges along any direction store more, as
/// conforming elements must, and their error falls with the square of their size, as that of
/// hexahedra.
#[test]
fn a_bent_bar_of_wedges_converges_to_the_beam() {
    let [length, height, width] = BAR;
    let exact = width * height.powi(3) / 12.0 * length / 2.0;
    for along in [None, Some(0), Some(1), Some(2)] {
        let errors = [2, 4, 8].map(|n| bending_energy(n, along) / exact - 1.0);
        println!("wedges along {along:?}: {errors:.4?}");
        for pair in errors.windows(2) {
            assert!(pair[1] > 0.0 && (pair[0] / pair[1]).log2() > 1.8, "{along:?}: {errors:?}");
        }
    }
}

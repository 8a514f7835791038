//! Traction and pressure integrate to the forces: checked with an independent quadrature over the
//! deformed slave surface.

use super::nose::Drag;
use super::{body, even, grid, results, solve};
use crate::solved::Solved;
use nalgebra::Vector3;
use slipstick::model::ContactResults;
use slipstick_mesh::Mesh;

/// Points and weights of Gauss' rule with five points on [−1, 1], exact up to degree 9.
fn gauss() -> [(f64, f64); 5] {
    let root = |sign: f64| (5.0 + sign * 2.0 * (10.0f64 / 7.0).sqrt()).sqrt() / 3.0;
    let weight = |sign: f64| (322.0 + sign * 13.0 * 70.0f64.sqrt()) / 900.0;
    let (a, b) = (root(-1.0), root(1.0));
    let (u, v) = (weight(1.0), weight(-1.0));
    [(-b, v), (-a, u), (0.0, 128.0 / 225.0), (a, u), (b, v)]
}

/// ∫ of a nodal field over the deformed facets of a surface.
fn integral<const N: usize>(
    solved: &Solved,
    surface: &str,
    step: usize,
    field: impl Fn(usize) -> [f64; N],
) -> [f64; N] {
    let mut sum = [0.0; N];
    let mut add = |nodes: &[u32], shape: &[f64], area: f64| {
        for (&node, n) in nodes.iter().zip(shape) {
            let value = field(node as usize);
            (0..N).for_each(|c| sum[c] += area * n * value[c]);
        }
    };
    for facet in &solved.problem.mesh.surfaces[surface].facets {
        let nodes = &facet.nodes[..];
        let x: Vec<Vector3<f64>> = nodes.iter().map(|&n| solved.position(n, step)).collect();
        if nodes.len() == 3 {
            add(nodes, &[1.0 / 3.0; 3], 0.5 * (x[1] - x[0]).cross(&(x[2] - x[0])).norm());
            continue;
        }
        for (xi, u) in gauss() {
            for (eta, v) in gauss() {
                let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
                let shape = corners.map(|(a, b)| 0.25 * (1.0 + a * xi) * (1.0 + b * eta));
                let along = |slope: [f64; 4]| -> Vector3<f64> { x.iter().zip(slope).map(|(x, s)| x * s).sum() };
                let by_xi = along(corners.map(|(a, b)| 0.25 * a * (1.0 + b * eta)));
                let by_eta = along(corners.map(|(a, b)| 0.25 * b * (1.0 + a * xi)));
                add(nodes, &shape, u * v * by_xi.cross(&by_eta).norm());
            }
        }
    }
    sum
}

/// Sums of the fields and forces of a state.
struct Sums {
    /// ∫ traction dA.
    traction: Vector3<f64>,
    /// Forces on the slave's nodes, and on the master's.
    slave: Vector3<f64>,
    master: Vector3<f64>,
    /// ∫ pressure dA, and Σ_j A_j ζ_nj.
    pressure: f64,
    normal: f64,
}

fn sums(solved: &mut Solved, step: usize, slave: &str, master: &str) -> Sums {
    let found: ContactResults = results(solved, step);
    let traction = integral(solved, slave, step, |n| std::array::from_fn::<_, 3, _>(|c| found.traction[3 * n + c]));
    let [pressure] = integral(solved, slave, step, |n| [found.pressure[n]]);
    let on = |surface: &str| -> Vector3<f64> {
        let nodes = solved.problem.mesh.surfaces[surface].nodes();
        nodes.iter().map(|&n| Vector3::from_column_slice(&found.force[3 * n as usize..][..3])).sum()
    };
    let normal = found.nodes.iter().map(|at| at.covered_area * at.multiplier[0]).sum();
    Sums { traction: traction.into(), slave: on(slave), master: on(master), pressure, normal }
}

/// A block from a mesh file, pressed by 40 onto a slab that begins under its first facets: the
/// fraction `overlap` of these is covered.
fn pressed(overlap: f64, shape: &str, friction: f64, tetrahedra: bool) -> Solved {
    let width = even(0.0, 1.0, 2);
    let start = 1.0 - overlap;
    let block = grid("block", [&even(0.0, 4.0, 4), &even(1.0, 2.0, 2), &width]);
    let slab = grid("slab", [&even(start, start + 4.0, 4), &even(0.0, 1.0, 2), &width]);
    let of = |mesh: Mesh| if tetrahedra { mesh.divided(|_| true) } else { mesh };
    let text = format!(
        "{}{}[[contact]]\nslave = 'block_ymin'\nmaster = 'slab_ymax'\nfriction = {friction:?}\n\
         multiplier_shape = '{shape}'\n[[dirichlet]]\nset = 'slab_ymin'\n\
         [[dirichlet]]\nset = 'block_ymax'\ncomponents = ['x', 'z']\n\
         motion = [{{ t = 0.5, u = [0, 0, 0] }}, {{ t = 1, u = [{:?}, 0, 0] }}]\n\
         [[load]]\nsurface = 'block_ymax'\npressure = 10.0\namplitude = [{{ t = 0.5, factor = 1 }}]\n\
         [load_path]\nsteps = 2\ntolerance = {{ relative = 1e-12 }}\n",
        body("block", 1000.0),
        body("slab", 1000.0),
        if friction > 0.0 { 0.02 } else { 0.0 },
    );
    solve(&text, &[("block", of(block)), ("slab", of(slab))])
}

/// The integral of the traction over the deformed surface is the sum of the nodal forces and equals
/// the load (for the master, its opposite); the integral of the pressure is the normal force.
#[test]
fn fields_integrate_to_the_resultant() {
    let mut worst = [0.0f64; 4];
    for overlap in [0.05, 0.3, 0.5, 0.8, 1.0] {
        for shape in ["standard", "dual"] {
            for friction in [0.0, 0.3] {
                for tetrahedra in [false, true] {
                    let what = format!("{overlap} covered, {shape}, friction {friction}, tetrahedra: {tetrahedra}");
                    let mut solved = pressed(overlap, shape, friction, tetrahedra);
                    let at = sums(&mut solved, 2, "block_ymin", "slab_ymax");
                    let size = at.slave.norm();
                    let errors = [
                        (at.traction - at.slave).norm() / size,
                        (at.slave + at.master).norm() / size,
                        (at.pressure / at.normal - 1.0).abs(),
                        (at.slave.y / 40.0 - 1.0).abs(),
                    ];
                    worst = std::array::from_fn(|i| worst[i].max(errors[i]));
                    assert!(errors.iter().all(|error| *error < 0.01), "{what}: {errors:?}");
                }
            }
        }
    }
    println!("traction, balance, pressure, load: {worst:.3?}");
    assert!(worst[0] < 1e-10 && worst[1] < 1e-12 && worst[2] < 1e-10, "{worst:?}");
    // the load acts on a surface with a constant projected area, so equilibrium is exact
    assert!(worst[3] < 1e-9, "{worst:?}");
}

/// The same if both faces at a sharp edge of the slave are in contact: fields are summed over the
/// patches of a node.
#[test]
fn fields_at_a_sharp_edge_integrate_to_the_resultant() {
    let mut solved = Drag { angle: 75.0, tilt: 25.0, steps: 3, ..Drag::default() }.solve();
    let at = sums(&mut solved, 4, "block_nose", "plate_ymax");
    let size = at.slave.norm();
    // the driver's reaction balances the contact force
    let driver = solved.reaction("block_ymax", 4);
    assert!((driver + at.slave).norm() < 1e-6 * size, "{driver} {}", at.slave);
    assert!((at.traction - at.slave).norm() < 1e-8 * size, "{} {}", at.traction, at.slave);
    assert!((at.slave + at.master).norm() < 1e-12 * size && (at.pressure / at.normal - 1.0).abs() < 1e-8);
}

//! Pairs of facets in random poses, in space: quadrilaterals, triangles, and one of each. Values
//! and all derivatives against dual numbers, coverage, partition of unity, projection, invariance.

mod dual;

use std::cell::Cell;

use nalgebra::{Rotation3, Unit, Vector3};
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use slipstick_contact::kinematics::coupling::{FacetCoupling, Settings};
use slipstick_contact::kinematics::{CellRule, MultiplierShape};
use slipstick_mesh::FacetNodes;

const RULE: CellRule = CellRule::Seven;
/// Numbers of corners of slave and master.
const KINDS: [(usize, usize); 4] = [(4, 4), (4, 3), (3, 4), (3, 3)];

/// Four corners of a distorted unit square that looks up (+z); the first three are a triangle.
fn square(jitter: &[f64], size: f64) -> Vec<Vector3<f64>> {
    let corners = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]];
    let moved =
        |i: usize| Vector3::new(corners[i][0], corners[i][1], 0.0) + Vector3::from_row_slice(&jitter[3 * i..][..3]);
    (0..4).map(|i| size * moved(i)).collect()
}

fn turn(axis: [f64; 3], angle: f64) -> Rotation3<f64> {
    let axis = Vector3::from(axis);
    let axis = if axis.norm() > 0.1 { axis } else { Vector3::z() };
    Rotation3::from_axis_angle(&Unit::new_normalize(axis), angle)
}

/// A slave facet and a master facet that faces it, both as four corners.
#[derive(Debug, Clone)]
struct Scene {
    slave: Vec<Vector3<f64>>,
    master: Vec<Vector3<f64>>,
}

impl Scene {
    /// Positions of the first corners of both.
    fn positions(&self, (s, m): (usize, usize)) -> Vec<Vector3<f64>> {
        self.slave[..s].iter().chain(&self.master[..m]).copied().collect()
    }
}

fn scenes() -> impl Strategy<Value = Scene> {
    let jitter = || prop::collection::vec(-0.12f64..0.12, 12);
    let vector = || prop::array::uniform3(-1.0f64..1.0);
    let master = (jitter(), 0.6f64..1.8, vector(), 0.0f64..0.5, -3.1f64..3.1, [-0.6f64..0.6, -0.6..0.6, -0.2..0.2]);
    (jitter(), master, vector(), 0.0f64..3.1, vector()).prop_map(|(jitter, master, axis, angle, shift)| {
        let (other, size, tilt, degree, spin, [x, y, gap]) = master;
        // the slave looks down on the master: turned about the x axis
        let over = Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        let pose = turn(tilt, degree) * Rotation3::from_axis_angle(&Vector3::z_axis(), spin);
        let common = turn(axis, angle);
        let place = |p: Vector3<f64>| common * p + 3.0 * Vector3::from(shift);
        let slave = square(&jitter, 1.0).iter().map(|p| place(over * p + Vector3::new(x, y, gap))).collect();
        Scene { slave, master: square(&other, size).iter().map(|p| place(pose * p)).collect() }
    })
}

fn facet(range: std::ops::Range<usize>) -> FacetNodes {
    FacetNodes::new(&range.map(|node| node as u32).collect::<Vec<_>>()).expect("three or four corners")
}

/// The coupling of a slave facet of the first `s` positions with masters; `None` where a projection
/// is folded.
fn couple(x: &[Vector3<f64>], s: usize, masters: &[FacetNodes], shape: MultiplierShape) -> Option<FacetCoupling> {
    let flat: Vec<f64> = x.iter().flat_map(|p| [p.x, p.y, p.z]).collect();
    let mut coupling = FacetCoupling::default();
    let settings =
        Settings { x: &flat, rule: &RULE.points(), shape, reach: 2.0, trusted: f64::INFINITY, with_gradient: true };
    let found =
        coupling.evaluate(facet(0..s).into(), [false; 4], masters.iter().map(|&master| master.into()), settings);
    found.ok().map(|()| coupling)
}

fn couple_pair(scene: &Scene, (s, m): (usize, usize), shape: MultiplierShape) -> Option<FacetCoupling> {
    couple(&scene.positions((s, m)), s, &[facet(s..s + m)], shape)
}

/// Compares b_js and all ∂b_js/∂x_t of one pair with dual numbers; returns the largest deviation,
/// relative to the largest entry.
fn deviation(scene: &Scene, (s, m): (usize, usize), shape: MultiplierShape) -> Option<[f64; 2]> {
    let coupling = couple_pair(scene, (s, m), shape)?;
    let x = scene.positions((s, m));
    let n = s + m;
    if coupling.nodes.is_empty() {
        return None;
    }
    let mut worst = [0.0f64; 2];
    let mut largest = [1e-3f64; 2];
    for t in 0..3 * n {
        let at = dual::positions(&x, Some(t));
        let mut rows = dual::pair(&at[..s], &at[s..], RULE).rows;
        if shape == MultiplierShape::Dual {
            rows = dual::dual_triangle(&rows, &at[..s]);
        }
        for (j, row) in rows.iter().enumerate() {
            for (k, exact) in row.iter().enumerate() {
                let found = [coupling.coefficient[j * n + k], coupling.gradient_row(j, k)[t]];
                for (i, exact) in [exact.re, exact.eps].into_iter().enumerate() {
                    worst[i] = worst[i].max((found[i] - exact).abs());
                    largest[i] = largest[i].max(exact.abs());
                }
            }
        }
    }
    Some([worst[0] / largest[0], worst[1] / largest[1]])
}

const CASES: u32 = 200;

/// Rows and their derivatives agree with an independent computation of the same integrals, which is
/// differentiated with dual numbers.
#[test]
fn rows_and_all_derivatives_are_those_of_dual_numbers() {
    let mut runner = TestRunner::new(ProptestConfig { cases: CASES, failure_persistence: None, ..Default::default() });
    let (compared, worst) = (Cell::new(0), Cell::new([0.0f64; 2]));
    let result = runner.run(&scenes(), |scene| {
        for kind in KINDS {
            let shapes = [MultiplierShape::Standard, MultiplierShape::Dual];
            for &shape in &shapes[..if kind.0 == 3 { 2 } else { 1 }] {
                let Some([value, slope]) = deviation(&scene, kind, shape) else { continue };
                prop_assert!(value < 1e-10, "{kind:?} {shape:?}: values off by {value:e}");
                prop_assert!(slope < 1e-9, "{kind:?} {shape:?}: derivatives off by {slope:e}");
                compared.set(compared.get() + 1);
                worst.set([worst.get()[0].max(value), worst.get()[1].max(slope)]);
            }
        }
        Ok(())
    });
    println!("{} pairs, worst {:?}", compared.get(), worst.get());
    result.unwrap_or_else(|error| panic!("{error}"));
    // four kinds of pairs, two of them with both shapes
    assert!(compared.get() > 5 * CASES, "only {} pairs overlap", compared.get());
}

/// Σ_s b_js = 0: D and M have the same row sums, since Σ N = 1 on both facets; Σ_jk D_jk is the
/// area of the overlap, since Σ Φ = 1. The derivatives of both agree too.
fn partition_of_unity(scene: &Scene) -> Result<(), TestCaseError> {
    for kind @ (s, m) in KINDS {
        let x = scene.positions(kind);
        let expected = |t| dual::pair(&dual::positions(&x, t)[..s], &dual::positions(&x, t)[s..], RULE).area;
        for shape in [MultiplierShape::Standard, MultiplierShape::Dual] {
            let Some(coupling) = couple_pair(scene, kind, shape) else { continue };
            if coupling.nodes.is_empty() {
                prop_assert!(expected(None).re < 1e-11, "{kind:?}: an overlap of {} is missed", expected(None).re);
                continue;
            }
            let n = s + m;
            let area: f64 = (0..s).map(|j| coupling.coefficient[j * n..][..s].iter().sum::<f64>()).sum();
            prop_assert!((area - expected(None).re).abs() < 1e-11, "{kind:?} {shape:?}: area {area}");
            for j in 0..s {
                let sum: f64 = coupling.coefficient[j * n..][..n].iter().sum();
                prop_assert!(sum.abs() < 1e-13, "{kind:?} {shape:?} corner {j}: Σ b = {sum:e}");
            }
            for t in 0..3 * n {
                let slope: f64 =
                    (0..s).flat_map(|j| (0..s).map(move |k| (j, k))).map(|(j, k)| coupling.gradient_row(j, k)[t]).sum();
                let exact = expected(Some(t)).eps;
                prop_assert!((slope - exact).abs() < 1e-9 * (1.0 + exact.abs()), "{kind:?} {shape:?}: {slope} {exact}");
                for j in 0..s {
                    let sum: f64 = (0..n).map(|k| coupling.gradient_row(j, k)[t]).sum();
                    prop_assert!(sum.abs() < 1e-9, "{kind:?} {shape:?} corner {j}: Σ ∂b/∂x_{t} = {sum:e}");
                }
            }
        }
    }
    Ok(())
}

/// The integrals pair points of both facets that lie on one line along n₀, so w_j = Σ_s b_js x_s is
/// parallel to n₀.
fn projection(scene: &Scene) -> Result<(), TestCaseError> {
    for kind @ (s, m) in KINDS {
        let x = scene.positions(kind);
        let at = dual::positions(&x, None);
        let normal = dual::pair(&at[..s], &at[s..], RULE).normal;
        for shape in [MultiplierShape::Standard, MultiplierShape::Dual] {
            let Some(coupling) = couple_pair(scene, kind, shape) else { continue };
            if coupling.nodes.is_empty() {
                continue;
            }
            let n = s + m;
            for j in 0..s {
                let w: Vector3<f64> = (0..n).map(|k| coupling.coefficient[j * n + k] * (x[k] - x[0])).sum();
                let across = (w - normal * normal.dot(&w)).norm();
                prop_assert!(across < 1e-12, "{kind:?} {shape:?} corner {j}: {across:e} across the normal");
            }
        }
    }
    Ok(())
}

/// A common motion of both facets changes nothing, scaling all lengths scales the results with the
/// square, and another first corner changes only the order.
fn invariance(scene: &Scene, motion: &Rotation3<f64>, size: f64) -> Result<(), TestCaseError> {
    for kind @ (s, m) in KINDS {
        let Some(base) = couple_pair(scene, kind, MultiplierShape::Standard) else { continue };
        let moved = |p: &Vector3<f64>| size * (motion * p + Vector3::new(0.3, -1.0, 0.7));
        let other =
            Scene { slave: scene.slave.iter().map(moved).collect(), master: scene.master.iter().map(moved).collect() };
        let x = other.positions(kind);
        let flat: Vec<f64> = x.iter().flat_map(|p| [p.x, p.y, p.z]).collect();
        // corners of both begin with the second one
        let nodes = |start: usize, count: usize| (0..count).map(move |i| (start + (i + 1) % count) as u32);
        let slave = FacetNodes::new(&nodes(0, s).collect::<Vec<_>>()).expect("a facet");
        let master = FacetNodes::new(&nodes(s, m).collect::<Vec<_>>()).expect("a facet");
        let mut coupling = FacetCoupling::default();
        let (rule, shape) = (&RULE.points(), MultiplierShape::Standard);
        let settings =
            Settings { x: &flat, rule, shape, reach: 2.0 * size, trusted: f64::INFINITY, with_gradient: false };
        let found = coupling.evaluate(slave.into(), [false; 4], std::iter::once(master.into()), settings);
        prop_assert!(found.is_ok());
        prop_assert_eq!(base.nodes.is_empty(), coupling.nodes.is_empty());
        let n = base.nodes.len();
        for j in 0..if n == 0 { 0 } else { s } {
            for k in 0..n {
                let (own, column) = (coupling.nodes[j] as usize, coupling.nodes[k] as usize);
                let (found, exact) =
                    (coupling.coefficient[j * n + k] / size.powi(2), base.coefficient[own * n + column]);
                prop_assert!((found - exact).abs() < 1e-9, "{kind:?}: {found} {exact}");
            }
        }
    }
    Ok(())
}

/// Nodes of 3 × 3 cells, moved within the plane z = 0, each by its own jitter and all by the last.
fn tiling(jitter: &[f64]) -> Vec<Vector3<f64>> {
    let at = |node: usize, c: usize| [node % 4, node / 4][c] as f64 - 1.5;
    let moved = |node: usize, c: usize| 1.2 * at(node, c) + jitter[2 * node + c] + 2.5 * jitter[32 + c];
    (0..16).map(|node| Vector3::new(moved(node, 0), moved(node, 1), 0.0)).collect()
}

/// Masters that tile a plane cover a slave facet in front of it: Σ_k D_jk = ∫ N_j over its whole
/// projection, integrated here by Gauss' rule with 2 × 2 points on the parent square, which is
/// exact for bilinear shapes. Dual shapes are biorthogonal there.
fn coverage(scene: &Scene, tiling: &[Vector3<f64>], kinds: u32) -> Result<(), TestCaseError> {
    let origin = scene.slave.iter().sum::<Vector3<f64>>() / 4.0;
    for s in [4, 3] {
        // the scene's slave brought back over the tiling, looking down on it
        let slave = &scene.slave[..s];
        let normal = if s == 4 {
            (slave[2] - slave[0]).cross(&(slave[3] - slave[1]))
        } else {
            (slave[1] - slave[0]).cross(&(slave[2] - slave[0]))
        };
        let down = Rotation3::rotation_between(&normal, &-Vector3::z())
            .unwrap_or(Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
        let slave: Vec<Vector3<f64>> = slave.iter().map(|p| 0.9 * (down * (p - origin))).collect();
        let x: Vec<Vector3<f64>> = slave.iter().chain(tiling).copied().collect();
        let mut masters = Vec::new();
        for cell in 0..9 {
            let [a, b, c, d] =
                [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| (s + cell % 3 + i + 4 * (cell / 3 + j)) as u32);
            match kinds >> cell & 1 {
                0 => masters.push([a, b, c, d].into()),
                _ => masters.extend([[a, b, c], [a, c, d]].map(FacetNodes::from)),
            }
        }
        let Some(standard) = couple(&x, s, &masters, MultiplierShape::Standard) else { continue };
        let flat: Vec<[f64; 2]> = slave.iter().map(|p| [p.x, -p.y]).collect();
        let (whole, parallelogram) = corner_integrals(&flat);
        let n = standard.nodes.len();
        let row = |j: usize| standard.coefficient[j * n..][..s].iter().sum::<f64>();
        let total: f64 = (0..s).map(row).sum();
        prop_assert!((total - whole.iter().sum::<f64>()).abs() < 1e-11, "{s}: {total} of {whole:?}");
        for (j, exact) in whole.iter().enumerate() {
            // on other quadrilaterals N_j is not a polynomial over the cells, and the rule is not
            // exact
            let bound = if parallelogram { 1e-11 } else { 1e-4 };
            prop_assert!((row(j) - exact).abs() < bound, "{s}, corner {j}: {} {exact}", row(j));
        }
        let Some(dual) = couple(&x, s, &masters, MultiplierShape::Dual) else { continue };
        let off = (0..s).flat_map(|j| (0..s).filter(move |&k| k != j).map(move |k| (j, k)));
        // biorthogonal as far as the facet is covered, by the rule
        let largest = off.map(|(j, k)| dual.coefficient[j * n + k].abs()).fold(0.0, f64::max);
        prop_assert!(largest < if parallelogram { 1e-11 } else { 1e-4 }, "{s}: {largest:e} beside the diagonal of D");
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: CASES, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn shapes_are_partitions_of_unity(scene in scenes()) {
        partition_of_unity(&scene)?;
    }

    #[test]
    fn projection_is_along_the_normal_of_the_slave_facet(scene in scenes()) {
        projection(&scene)?;
    }

    #[test]
    fn rows_are_invariant(
        scene in scenes(), axis in prop::array::uniform3(-1.0f64..1.0), angle in 0.0f64..3.1, size in 0.01f64..100.0,
    ) {
        invariance(&scene, &turn(axis, angle), size)?;
    }

    #[test]
    fn facets_before_a_tiling_are_covered(
        scene in scenes(), jitter in prop::collection::vec(-0.15f64..0.15, 34), kinds in 0u32..512,
    ) {
        coverage(&scene, &tiling(&jitter), kinds)?;
    }
}

/// ∫ N_j over a plane facet, and whether it is a triangle or a parallelogram.
fn corner_integrals(p: &[[f64; 2]]) -> (Vec<f64>, bool) {
    if p.len() == 3 {
        let twice = (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[1][1] - p[0][1]) * (p[2][0] - p[0][0]);
        return (vec![twice / 6.0; 3], true);
    }
    let signs = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let mut sums = vec![0.0; 4];
    let gauss = 1.0 / 3f64.sqrt();
    for at in signs.map(|s| s.map(|s| gauss * s)) {
        let mut jacobian = [[0.0; 2]; 2];
        for (sign, corner) in signs.iter().zip(p) {
            let slope = [0.25 * sign[0] * (1.0 + sign[1] * at[1]), 0.25 * sign[1] * (1.0 + sign[0] * at[0])];
            (0..2).for_each(|c| (0..2).for_each(|d| jacobian[c][d] += slope[d] * corner[c]));
        }
        let det = jacobian[0][0] * jacobian[1][1] - jacobian[0][1] * jacobian[1][0];
        for (sum, sign) in sums.iter_mut().zip(&signs) {
            *sum += det * 0.25 * (1.0 + sign[0] * at[0]) * (1.0 + sign[1] * at[1]);
        }
    }
    let skew = (0..2).map(|c| (p[0][c] + p[2][c] - p[1][c] - p[3][c]).abs()).fold(0.0, f64::max);
    (sums, skew < 1e-12)
}

use super::*;
use crate::enforcement::soft::{PressureLaw, Weight};
use crate::kinematics::CellRule;
use crate::kinematics::height::FacetHeight;

const SHAPES: [MultiplierShape; 3] = [MultiplierShape::Standard, MultiplierShape::Dual, MultiplierShape::Mean];

/// A warped slave facet (nodes 0–3) over a 2 × 2 patch of warped master facets (nodes 4–12)
/// whose normals point up; the slave extends over the patch's edge if `shift` is large.
/// Optionally, each master is replaced by two triangles.
fn scene(shift: f64, triangles: bool) -> (Vec<f64>, Vec<FacetNodes>) {
    let mut x = vec![
        0.10, -0.10, 0.02, 0.15, 0.90, -0.03, 1.05, 1.00, 0.05, 0.95, -0.05, -0.02, //
    ];
    for node in 0..4 {
        x[3 * node] += shift;
    }
    for j in 0..3 {
        for i in 0..3 {
            let (u, v) = (-0.2 + 0.7 * i as f64, -0.3 + 0.75 * j as f64);
            x.extend([u + 0.05 * v, v - 0.04 * u, -0.05 + 0.04 * (2.0 * u + v).sin()]);
        }
    }
    let at = |i: u32, j: u32| 4 + i + 3 * j;
    let mut facets = Vec::new();
    for j in 0..2 {
        for i in 0..2 {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            match triangles {
                true => facets.extend([[a, b, c], [a, c, d]].map(FacetNodes::from)),
                false => facets.push([a, b, c, d].into()),
            }
        }
    }
    (x, facets)
}

// the slave facet faces down: 0 → 1 → 2 → 3 has its normal along −z
const SLAVE: [u32; 4] = [0, 1, 2, 3];
/// One triangular half of `SLAVE`.
const HALF: [u32; 3] = [0, 1, 2];

/// The slave facet, and whether the masters are triangles.
fn mixtures() -> [(FacetNodes, bool); 4] {
    [(SLAVE.into(), false), (SLAVE.into(), true), (HALF.into(), false), (HALF.into(), true)]
}

/// Laws without a kink inside of the scene's gaps: exponential, and one in proportion to the penetration from a
/// gap on that exceeds all of them.
fn pressures() -> [PressureLaw; 2] {
    let exponential = PressureLaw::Exponential { contact_pressure: 2.0, clearance: 2.0 };
    [exponential, PressureLaw::Table(vec![[-50.0, 0.0], [50.0, 300.0]])]
}

fn pressed(
    slave: FacetNodes,
    x: &[f64],
    facets: &[FacetNodes],
    weight: Weight<'_>,
    curved: bool,
    gradient: bool,
) -> FacetCoupling {
    let heights = [0.7, 1.9].map(|step| {
        let unit = [[0.0, 0.0], [0.6, 0.0], [0.6, 0.7], [0.0, 0.7]].map(|[x, y]| Vector3::new(x, y, 0.0));
        FacetHeight::new(std::array::from_fn(|i| 0.1 * (step * i as f64).sin()), &unit[..slave.len()])
    });
    let of = |index: usize| heights.get(index).filter(|_| curved);
    let masters = facets.iter().enumerate().map(|(i, &nodes)| CurvedFacet { nodes, height: of(i % 3), face: None });
    let slave = CurvedFacet { nodes: slave, height: of(1), face: None };
    let (rule, shape) = (&CellRule::Seven.points(), MultiplierShape::Standard);
    let settings = Settings { x, rule, shape, reach: 1.0, trusted: 0.0, with_gradient: gradient };
    let mut coupling = FacetCoupling::default();
    coupling.evaluate(slave, [false; 4], masters.clone(), settings).unwrap();
    coupling.press(
        slave,
        masters,
        settings,
        PointPressure {
            weight,
            offsets: [0.01, 0.02, -0.03, 0.05],
            closed: [0.02, -0.01, 0.03, 0.01, 0.0, 0.0, 0.0, 0.0, 0.0],
        },
    );
    coupling
}

#[test]
fn pressed_coupling_matches_finite_differences() {
    let kinds = mixtures().into_iter().flat_map(|m| [(m, 0.0, false), (m, 0.6, false), (m, 0.6, true)]);
    let laws = pressures();
    let weights = [Weight::Pressure(&laws[0]), Weight::Pressure(&laws[1]), Weight::Energy(&laws[0])];
    for (((slave, triangles), shift, curved), weight) in kinds.flat_map(|kind| weights.map(|weight| (kind, weight))) {
        let (x, facets) = scene(shift, triangles);
        let base = pressed(slave, &x, &facets, weight, curved, true);
        let (n, scale) = (base.nodes.len(), base.pressed.iter().fold(0.0, |m: f64, c| m.max(c.abs())));
        assert!(scale > 0.05, "{scale}");
        let mut worst: f64 = 0.0;
        for t in 0..3 * n {
            let dof = 3 * base.nodes[t / 3] as usize + t % 3;
            let at = |h: f64| {
                let mut moved = x.clone();
                moved[dof] += h;
                pressed(slave, &moved, &facets, weight, curved, false).pressed
            };
            let (p1, m1, p2, m2) = (at(1e-4), at(-1e-4), at(2e-4), at(-2e-4));
            for e in 0..slave.len() * n {
                let fd = (8.0 * (p1[e] - m1[e]) - (p2[e] - m2[e])) / 12e-4;
                worst = worst.max((fd - base.pressed_gradient[e * 3 * n + t]).abs());
            }
        }
        println!("{slave:?} {triangles} {shift} {curved} {weight:?}: {worst:.1e} of {scale:.1e}");
        assert!(worst < 2e-7 * scale.max(1.0), "{slave:?} {triangles} {shift} {curved} {weight:?}: {worst:e}");
    }
}

/// Without heights, ∫ p dA of a pressure p = c + s (o − g), with an offset o, is c A + s (o A − Σ_j g̃_j): areas and
/// weighted gaps come from D and M, which other code integrates.
#[test]
fn the_resultant_of_an_affine_pressure_follows_from_the_weighted_gaps() {
    for (slave, triangles) in mixtures() {
        let (x, facets) = scene(0.6, triangles);
        let law = PressureLaw::Table(vec![[-50.0, 0.0], [50.0, 300.0]]);
        let mut coupling = FacetCoupling::default();
        let (rule, shape) = (&CellRule::Seven.points(), MultiplierShape::Standard);
        let settings = Settings { x: &x, rule, shape, reach: 1.0, trusted: 0.0, with_gradient: false };
        let masters = facets.iter().map(|&facet| CurvedFacet::from(facet));
        coupling.evaluate(slave.into(), [false; 4], masters.clone(), settings).unwrap();
        coupling.press(
            slave.into(),
            masters,
            settings,
            PointPressure { weight: Weight::Pressure(&law), offsets: [0.1; 4], closed: [0.0; 9] },
        );
        let (n, corners) = (coupling.nodes.len(), slave.len());
        let sum = |list: &[f64]| (0..corners).map(|j| list[j * n..][..corners].iter().sum::<f64>()).sum::<f64>();
        let points: Vec<Vector3<f64>> = slave.iter().map(|&node| position(&x, node)).collect();
        let normal = match points[..] {
            [a, b, c] => FacetNormal::of(&[a, b, c]).map(|of| of.normal),
            [a, b, c, d] => FacetNormal::of(&[a, b, c, d]).map(|of| of.normal),
            _ => None,
        };
        let normal = normal.expect("a facet");
        let along = |at: usize| position(&x, coupling.nodes[at % n]).dot(&normal);
        let gap: f64 = coupling.coefficient.iter().enumerate().map(|(at, b)| -b * along(at)).sum();
        let (found, expected) = (sum(&coupling.pressed), (150.0 + 3.0 * 0.1) * sum(&coupling.coefficient) - 3.0 * gap);
        assert!((found - expected).abs() < 1e-11 * expected, "{slave:?} {triangles}: {found} instead of {expected}");
    }
}

fn evaluate(
    slave: FacetNodes,
    x: &[f64],
    facets: &[FacetNodes],
    shape: MultiplierShape,
    gradient: bool,
) -> FacetCoupling {
    let mut coupling = FacetCoupling::default();
    let settings =
        Settings { x, rule: &CellRule::Seven.points(), shape, reach: 1.0, trusted: 0.0, with_gradient: gradient };
    // on some facets, heights of their own
    let heights = [0.7, 1.9].map(|step| {
        let unit = [[0.0, 0.0], [0.6, 0.0], [0.6, 0.7], [0.0, 0.7]].map(|[x, y]| Vector3::new(x, y, 0.0));
        FacetHeight::new(std::array::from_fn(|i| (step * i as f64).sin()), &unit[..slave.len()])
    });
    let curved = |(i, &nodes): (usize, &FacetNodes)| CurvedFacet { nodes, height: heights.get(i % 3), face: None };
    let slave = CurvedFacet { nodes: slave, height: Some(&heights[1]), face: None };
    coupling.evaluate(slave, [true; 4], facets.iter().enumerate().map(curved), settings).unwrap();
    coupling
}

#[test]
fn coupling_gradient_matches_finite_differences() {
    for ((slave, triangles), shift) in mixtures().into_iter().flat_map(|m| [(m, 0.0), (m, 0.6)]) {
        let (x, facets) = scene(shift, triangles);
        for shape in SHAPES {
            let base = evaluate(slave, &x, &facets, shape, true);
            let n = base.nodes.len();
            assert!(n > slave.len() + 3);
            let scale = base.coefficient.iter().fold(0.0, |m: f64, c| m.max(c.abs()));
            for t in 0..3 * n {
                let dof = 3 * base.nodes[t / 3] as usize + t % 3;
                let at = |h: f64| {
                    let mut moved = x.clone();
                    moved[dof] += h;
                    let moved = evaluate(slave, &moved, &facets, shape, false);
                    [moved.coefficient, moved.facing, moved.height].concat()
                };
                let (p1, m1, p2, m2) = (at(1e-4), at(-1e-4), at(2e-4), at(-2e-4));
                let slopes = [base.gradient.as_slice(), &base.facing_gradient, &base.height_gradient].concat();
                for e in 0..slave.len() * (n + 6) {
                    let fd = (8.0 * (p1[e] - m1[e]) - (p2[e] - m2[e])) / 12e-4;
                    let found = slopes[e * 3 * n + t];
                    assert!(
                        (fd - found).abs() < 2e-7 * scale.max(1.0),
                        "{slave:?} {triangles} {shape:?} entry {e} coordinate {t}: {fd} {found}"
                    );
                }
            }
        }
    }
}

#[test]
fn rows_of_slave_and_master_cancel() {
    for ((slave, triangles), shape) in mixtures().into_iter().flat_map(|m| SHAPES.map(|shape| (m, shape))) {
        let (x, facets) = scene(0.6, triangles);
        let coupling = evaluate(slave, &x, &facets, shape, true);
        let n = coupling.nodes.len();
        for j in 0..slave.len() {
            let sum: f64 = coupling.coefficient[j * n..(j + 1) * n].iter().sum();
            assert!(sum.abs() < 1e-14, "{shape:?} corner {j}: Σ b = {sum}");
            for t in 0..3 * n {
                let sum: f64 = (0..n).map(|s| coupling.gradient_row(j, s)[t]).sum();
                assert!(sum.abs() < 1e-12, "{shape:?} corner {j}: Σ ∂b/∂x_{t} = {sum}");
            }
            // the tributary area of every corner, covered or not
            let area: f64 = coupling.coefficient[j * n..][..slave.len()].iter().sum();
            assert!(area > 0.0, "{shape:?} corner {j}: {area}");
        }
    }
}

/// Over a covering master, D is diagonal. As the slave moves off the edge, Φ tends to N.
#[test]
fn dual_shapes_diagonalise_where_covered_and_tend_to_the_standard_ones() {
    let off_diagonal = |coupling: &FacetCoupling| {
        let (n, corners) = (coupling.nodes.len(), coupling.corners);
        let entries = (0..corners).flat_map(|j| (0..corners).filter(move |&k| k != j).map(move |k| j * n + k));
        entries.map(|at| coupling.coefficient[at].abs()).fold(0.0, f64::max)
    };
    for (slave, triangles) in mixtures() {
        let (x, facets) = scene(0.0, triangles);
        let covered = evaluate(slave, &x, &facets, MultiplierShape::Dual, false);
        assert!(off_diagonal(&covered) < 1e-15, "{}", off_diagonal(&covered));
    }
    let mut last = f64::INFINITY;
    for shift in [0.7, 0.9, 1.02] {
        let (x, facets) = scene(shift, false);
        let [dual, standard] = [MultiplierShape::Dual, MultiplierShape::Standard]
            .map(|shape| evaluate(SLAVE.into(), &x, &facets, shape, false));
        assert!(!standard.nodes.is_empty());
        let size = standard.coefficient.iter().fold(0.0, |m: f64, c| m.max(c.abs()));
        let difference = standard.coefficient.iter().zip(&dual.coefficient);
        let difference = difference.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / size;
        println!("shift {shift}: largest entry {size:.1e}, difference {difference:.1e}");
        assert!(difference < 0.6 * last, "{shift}: {difference}");
        last = difference;
    }
}

/// By hand, at corner 0 of a unit square and of half of it, with the height r² of the distance from that corner:
/// ∫ Φ r² is 1/12 on the square and 1/15 on the triangle with standard shapes, minus that with dual ones, and
/// vanishes with their mean.
#[test]
fn the_mean_gap_of_mean_shapes_is_that_at_the_node() {
    let corners = [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]];
    let around = [[-1.0, -1.0], [2.0, -1.0], [2.0, 2.0], [-1.0, 2.0]];
    let x: Vec<f64> = corners.iter().chain(&around).flat_map(|p| [p[0], p[1], 0.0]).collect();
    for (slave, moment) in [(FacetNodes::from(SLAVE), 1.0 / 12.0), (FacetNodes::from(HALF), 1.0 / 15.0)] {
        let corners: Vec<Vector3<f64>> = slave.iter().map(|&node| position(&x, node)).collect();
        let mut values = [0.0; 25];
        for (value, weights) in values.iter_mut().zip(slipstick_mesh::control_points(slave.len())) {
            let point: Vector3<f64> = corners.iter().zip(weights).map(|(corner, weight)| corner * weight).sum();
            *value = point.norm_squared();
        }
        let height = FacetHeight::new(values, &corners);
        for (shape, factor) in SHAPES.into_iter().zip([1.0, -1.0, 0.0]) {
            let rule = &CellRule::Twelve.points();
            let settings = Settings { x: &x, rule, shape, reach: 1.0, trusted: 0.0, with_gradient: false };
            let mut coupling = FacetCoupling::default();
            let masters = std::iter::once(FacetNodes::from([4, 5, 6, 7]).into());
            let curved = CurvedFacet { nodes: slave, height: Some(&height), face: None };
            coupling.evaluate(curved, [false; 4], masters, settings).unwrap();
            // along the normal of the facet, which points down, and times its stretch
            let found = -coupling.height[2];
            assert!((found - factor * moment).abs() < 1e-14, "{slave:?} {shape:?}: {found}");
        }
    }
}

/// Computed by hand: for corners of a unit square under a master plane that covers it, `facing`
/// is minus the plane's normal, each on a quarter of the square.
#[test]
fn corners_on_sharp_edges_see_the_master() {
    let mut x = vec![0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0, 0.0, 0.0];
    let (a, b) = (0.3, -0.2);
    x.extend(
        [[-1.0, -1.0], [2.0, -1.0], [2.0, 2.0], [-1.0, 2.0]].iter().flat_map(|p| [p[0], p[1], a * p[0] + b * p[1]]),
    );
    let coupling = evaluate(SLAVE.into(), &x, &[[4, 5, 6, 7].into()], MultiplierShape::Standard, false);
    let normal = Vector3::new(-a, -b, 1.0).normalize();
    for j in 0..4 {
        let seen = Vector3::from_row_slice(&coupling.facing[3 * j..][..3]);
        assert!((seen + 0.25 * normal).norm() < 1e-15, "corner {j}: {seen}");
    }
}

/// D and M are areas and their derivatives lengths, so they scale with the square and the first
/// power of the unit of length. The unit is a power of two, so that scaling the input does not
/// change its digits.
#[test]
fn rows_do_not_depend_on_the_unit_of_length() {
    let unit = 0.5f64.powi(14);
    for ((slave, triangles), shape) in mixtures().into_iter().flat_map(|m| SHAPES.map(|shape| (m, shape))) {
        let (x, facets) = scene(0.6, triangles);
        let small: Vec<f64> = x.iter().map(|x| unit * x).collect();
        let [one, other] = [x, small].map(|x| evaluate(slave, &x, &facets, shape, true));
        assert_eq!(one.nodes, other.nodes);
        let close = |a: &[f64], b: &[f64], factor: f64| {
            let size = a.iter().fold(0.0, |m: f64, a| m.max(a.abs()));
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b / factor).abs() <= 1e-13 * size)
        };
        assert!(close(&one.coefficient, &other.coefficient, unit * unit), "{slave:?} {triangles} {shape:?}");
        assert!(close(&one.gradient, &other.gradient, unit), "{slave:?} {triangles} {shape:?}");
        assert!(close(&one.facing, &other.facing, unit * unit), "{slave:?} {triangles} {shape:?}");
    }
}

/// A facet that is folded into an arrowhead is an error if it may touch, and is ignored if it
/// is farther away.
#[test]
fn a_folded_facet_is_named_where_it_may_touch() {
    let at = |height: f64| {
        // is counter-clockwise seen from above, so that its normal points up to the slave
        let arrow = [[-0.5, -0.5], [0.4, 0.4], [1.5, -0.5], [0.5, 1.5]];
        let mut x = scene(0.0, false).0[..12].to_vec();
        x.extend(arrow.iter().flat_map(|p| [p[0], p[1], height]));
        let mut coupling = FacetCoupling::default();
        let candidates = std::iter::once(FacetNodes::from([4, 5, 6, 7]).into());
        let rule = &CellRule::Seven.points();
        let settings =
            Settings { x: &x, rule, shape: MultiplierShape::Standard, reach: 10.0, trusted: 0.0, with_gradient: false };
        coupling.evaluate(FacetNodes::from(SLAVE).into(), [false; 4], candidates, settings)
    };
    assert_eq!(at(-0.1), Err(FoldedFacet([4, 5, 6, 7].into())));
    assert_eq!(at(-5.0), Ok(()));
}

/// Computed by hand: a master square of size 20 whose centre is offset sideways by 9 still
/// covers a slave square of size 0.1.
#[test]
fn a_large_master_couples_aside_of_its_centre() {
    let mut x = vec![0.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.1, 0.1, 0.0, 0.1, 0.0, 0.0];
    x.extend([[-1.0, -10.0], [19.0, -10.0], [19.0, 10.0], [-1.0, 10.0]].iter().flat_map(|p| [p[0], p[1], -0.2]));
    let coupling = evaluate(SLAVE.into(), &x, &[[4, 5, 6, 7].into()], MultiplierShape::Standard, false);
    assert_eq!(coupling.nodes.len(), 8);
    let area: f64 = (0..4).flat_map(|j| &coupling.coefficient[8 * j..][..4]).sum();
    assert!((area - 0.01).abs() < 1e-15, "{area}");
}

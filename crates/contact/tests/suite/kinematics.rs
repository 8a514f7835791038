//! Weighted gap, slip increment and tributary area: gradients against central differences,
//! objectivity under any common rotation.

use nalgebra::{Rotation3, Unit, Vector2, Vector3};
use slipstick_contact::kinematics::cone::WIDENING;
use slipstick_contact::kinematics::height::FacetHeight;
use slipstick_contact::kinematics::slip::SlipIncrement;
use slipstick_contact::kinematics::{CellRule, MultiplierShape, NodeKinematics, PreviousRow};
use slipstick_contact::{ContactInterface, InterfaceOptions};
use slipstick_mesh::{BoxShape, FacetNodes, Mesh, Placement, TorusShape, box_mesh, smooth_surface, torus};

const SHAPES: [MultiplierShape; 3] = [MultiplierShape::Standard, MultiplierShape::Dual, MultiplierShape::Mean];

/// A block over a slab, faces not matching, the block sticking out over the slab's edge; of
/// hexahedra, of tetrahedra, of both, or of wedges that stand on their triangles or lie on their
/// quadrilaterals, so that all facets meet each other.
fn meshes() -> [Mesh; 4] {
    let mesh = mesh();
    let (tetrahedra, mixed) = (mesh.divided(|_| true), mesh.divided(|element| element % 4 == 1));
    let wedges = mesh.divided_into_wedges(|element| Some(1 + element / 3 % 2));
    [mesh, tetrahedra, mixed, wedges]
}

fn mesh() -> Mesh {
    let shape = |min, max, elements| BoxShape { min, max, elements, grading: [1.0; 3] };
    let slab = box_mesh("slab", &shape([0.0; 3], [2.0, 0.5, 1.0], [3, 1, 2])).unwrap();
    let block = box_mesh("block", &shape([0.45, 0.5, 0.37], [1.25, 1.0, 1.17], [2, 1, 2])).unwrap();
    Mesh::merge(vec![slab, block]).unwrap()
}

/// The lower side of a torus of eight facets around its tube, which meet at 46° along an edge and at 45° across a
/// node, on a slab: its nodes have one entry each, so the edges are smooth and the slave is coarse, although they are
/// sharper than the feature angle.
#[test]
fn a_torus_of_eight_facets_around_its_tube_is_coarse() {
    let shape = TorusShape { radius: 0.8, tube_radius: 0.2, elements: [2, 1, 14] };
    let mut ring = torus("ring", &shape).unwrap();
    ring.transform(&Placement { rotate: None, translate: [0.0, 0.2, 0.0] }).unwrap();
    let slab = BoxShape { min: [-1.4, -0.3, -1.4], max: [1.4, 0.0, 1.4], elements: [5, 1, 5], grading: [1.0; 3] };
    let mesh = Mesh::merge(vec![ring, box_mesh("slab", &slab).unwrap()]).unwrap();
    let points = mesh.nodes.as_flattened();
    let below = |facet: &FacetNodes| facet.iter().all(|&node| mesh.nodes[node as usize][1] < 0.1);
    let slave: Vec<FacetNodes> = mesh.surfaces["ring_side"].facets.iter().map(|f| f.nodes).filter(below).collect();
    let master: Vec<FacetNodes> = mesh.surfaces["slab_ymax"].facets.iter().map(|f| f.nodes).collect();
    let is_coarse = |degrees: f64| {
        let feature_angle = f64::to_radians(degrees);
        let options =
            InterfaceOptions { shape: MultiplierShape::Standard, rule: CellRule::Six, reach: 0.5, feature_angle };
        let interface = ContactInterface::new(slave.clone(), master.clone(), points, options).unwrap();
        let smooth = smooth_surface(&slave, &mesh.nodes, &mesh.nodes, 0.9, &[], |_| [false; 3]);
        let heights = smooth.heights.into_iter().zip(&slave).map(|(heights, facet)| {
            let corners: Vec<_> = facet.iter().map(|&n| Vector3::from(mesh.nodes[n as usize])).collect();
            Some(FacetHeight::new(heights?, &corners))
        });
        let interface = interface.with_heights([heights.collect(), Vec::new()]);
        (interface.slave_nodes().len(), interface.is_coarse(points))
    };
    assert_eq!(slave.len(), 28);
    assert_eq!([50.0, 45.0, 44.0].map(is_coarse), [(42, true), (42, true), (56, false)]);
}

/// The same, with a block whose bottom is a roof upside down: along its middle, it is bent by 28°, or by 15° if
/// `depth` is 0.05.
fn ridged(depth: f64) -> Mesh {
    let mut mesh = mesh();
    for node in mesh.bodies[1].nodes.clone() {
        let [x, y, _] = &mut mesh.nodes[node];
        *y -= depth * (1.0 - (*x - 0.85).abs() / 0.4) * (1.0 - *y) / 0.5;
    }
    mesh
}

/// A mesh, and the faces of its block that are the slave: its bottom, flat or bent; or a block that
/// stands on its edge, or on a corner, with the two or three faces that meet there.
fn scenes() -> Vec<(Mesh, &'static [&'static str])> {
    const BOTTOM: &[&str] = &["block_ymin"];
    const EDGE: &[&str] = &["block_ymin", "block_xmax"];
    const CORNER: &[&str] = &["block_ymin", "block_xmax", "block_zmax"];
    let on_edge = |axis: Vector3<f64>, degrees: f64| {
        let mut mesh = mesh();
        let block = mesh.bodies[1].nodes.clone();
        let turn = Rotation3::from_axis_angle(&Unit::new_normalize(axis), f64::to_radians(degrees));
        let corner = Vector3::new(1.25, 0.5, 1.17);
        for x in &mut mesh.nodes[block] {
            *x = (corner + turn * (Vector3::from(*x) - corner)).into();
        }
        mesh
    };
    let mut scenes: Vec<_> = meshes().into_iter().map(|mesh| (mesh, BOTTOM)).collect();
    scenes.push((ridged(0.1), BOTTOM));
    scenes.push((on_edge(Vector3::z(), -40.0), EDGE));
    scenes.push((on_edge(Vector3::new(0.7, 0.0, -0.6), 45.0), CORNER));
    scenes
}

/// The interface of faces of the block with the top of the slab.
fn interface(mesh: &Mesh, slaves: &[&str], x: &[f64], shape: MultiplierShape) -> ContactInterface {
    let facets = |name: &str| mesh.surfaces[name].facets.iter().map(|f| f.nodes).collect::<Vec<_>>();
    let slave = slaves.iter().flat_map(|name| facets(name)).collect();
    let feature_angle = std::f64::consts::FRAC_PI_4;
    let options = InterfaceOptions { shape, rule: CellRule::Seven, reach: 1.0, feature_angle };
    ContactInterface::new(slave, facets("slab_ymax"), x, options).unwrap()
}

/// The same, with the normals of the master at the edges of the block.
fn touching(mesh: &Mesh, slaves: &[&str], x: &[f64], shape: MultiplierShape) -> ContactInterface {
    let boundary: Vec<FacetNodes> = mesh.boundary(1).facets.iter().map(|facet| facet.nodes).collect();
    interface(mesh, slaves, x, shape).with_touched_normals(&boundary, x, std::f64::consts::FRAC_PI_4)
}

/// Every scene with both shapes, with averaged normals and those of the master.
fn interfaces(seed: u64) -> Vec<(Mesh, MultiplierShape, Vec<f64>, ContactInterface)> {
    let mut all = Vec::new();
    for (mesh, slaves) in scenes() {
        for (shape, build) in SHAPES.into_iter().flat_map(|shape| [(shape, interface as Build), (shape, touching)]) {
            let x = disturbed(&mesh, seed);
            let built = build(&mesh, slaves, &x, shape);
            all.push((mesh.clone(), shape, x, built));
        }
    }
    all
}

type Build = fn(&Mesh, &[&str], &[f64], MultiplierShape) -> ContactInterface;

/// Deterministic noise in [−size, size) (linear congruential generator, Knuth's MMIX constants).
fn noise(length: usize, size: f64, seed: u64) -> Vec<f64> {
    let mut state = seed;
    (0..length)
        .map(|_| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            size * ((state >> 11) as f64 / (1u64 << 52) as f64 - 1.0)
        })
        .collect()
}

fn disturbed(mesh: &Mesh, seed: u64) -> Vec<f64> {
    let x = mesh.nodes.iter().flatten().copied();
    x.zip(noise(3 * mesh.nodes.len(), 0.02, seed)).map(|(x, d)| x + d).collect()
}

fn evaluate(interface: &ContactInterface, x: &[f64], gradient: bool) -> Vec<NodeKinematics> {
    let mut rows = Vec::new();
    interface.evaluate(x, gradient, &mut interface.workspace(|_| true), &mut rows).unwrap();
    rows
}

/// Areas of a node in the reference configuration of which the nodes' rows are all, a part of a
/// twentieth, and nearly nothing: the previous row measures the slip, both rows, or the current one.
const REFERENCES: [f64; 3] = [0.0, 4.0, 1e6];

/// Gap, the two slip components and tributary area of every slave node.
fn measures(
    rows: &[NodeKinematics],
    before: &[NodeKinematics],
    [x, x_before]: [&[f64]; 2],
    reference: f64,
) -> Vec<[f64; 4]> {
    let mut slip = SlipIncrement::default();
    rows.iter()
        .zip(before)
        .map(|(row, before)| {
            row.slip(&PreviousRow::of(before, reference), x, x_before, false, &mut slip);
            [row.gap(), slip.value[0], slip.value[1], row.area]
        })
        .collect()
}

/// `(8 (f₊₁ − f₋₁) − (f₊₂ − f₋₂))/12h` of all measures.
fn difference(mut at: impl FnMut(f64) -> Vec<[f64; 4]>) -> Vec<[f64; 4]> {
    let h = 1e-5;
    let (p1, m1, p2, m2) = (at(h), at(-h), at(2.0 * h), at(-2.0 * h));
    let entry = |j: usize, c: usize| -> f64 { (8.0 * (p1[j][c] - m1[j][c]) - (p2[j][c] - m2[j][c])) / (12.0 * h) };
    (0..p1.len()).map(|j| std::array::from_fn(|c| entry(j, c))).collect()
}

/// Largest deviation of any entry of any gradient, current and previous. Entries are of the size of
/// facet areas, 0.1.
#[test]
fn gap_and_slip_gradients() {
    let all = interfaces(1).into_iter().flat_map(|of| REFERENCES.map(|reference| (of.clone(), reference)));
    for ((mesh, shape, x, interface), reference) in all {
        let x_before = disturbed(&mesh, 2);
        let before = evaluate(&interface, &x_before, true);
        let now = evaluate(&interface, &x, true);
        let columns = x.len();
        let mut exact = vec![[[0.0; 4]; 2]; now.len() * columns];
        for (j, (row, before)) in now.iter().zip(&before).enumerate() {
            let (mut gap, mut slip) = (Vec::new(), SlipIncrement::default());
            row.gap_gradient(&mut gap);
            let previous = PreviousRow::of(before, reference);
            row.slip(&previous, &x, &x_before, true, &mut slip);
            for a in 0..2 {
                let mut scattered = vec![0.0; columns];
                let weight = if a == 0 { Vector2::x() } else { Vector2::y() };
                row.add_previous_slip_gradient(before, &previous, [&x, &x_before], weight, &mut scattered);
                for (t, value) in scattered.iter().enumerate() {
                    exact[j * columns + t][1][1 + a] = *value;
                }
            }
            let n = 3 * row.support.len();
            let m = 3 * before.support.len();
            for t in 0..n {
                let target = &mut exact[j * columns + 3 * row.support[t / 3] as usize + t % 3][0];
                target[0] += gap[t];
                target[1] += slip.gradient[t];
                target[2] += slip.gradient[n + t];
                target[3] += row.area_gradient[t];
            }
            for t in 0..m {
                let target = &mut exact[j * columns + 3 * before.support[t / 3] as usize + t % 3][0];
                target[1] += slip.previous_gradient[t];
                target[2] += slip.previous_gradient[m + t];
            }
        }
        let mut worst: f64 = 0.0;
        for t in 0..columns {
            let moved = |x: &[f64], h: f64| {
                let mut x = x.to_vec();
                x[t] += h;
                x
            };
            let current = difference(|h| {
                let x = moved(&x, h);
                measures(&evaluate(&interface, &x, false), &before, [&x, &x_before], reference)
            });
            let previous = difference(|h| {
                let x_before = moved(&x_before, h);
                measures(&now, &evaluate(&interface, &x_before, false), [&x, &x_before], reference)
            });
            for j in 0..now.len() {
                for c in 0..4 {
                    worst = worst.max((exact[j * columns + t][0][c] - current[j][c]).abs());
                    worst = worst.max((exact[j * columns + t][1][c] - previous[j][c]).abs());
                }
            }
        }
        println!("{shape:?}, {reference}: {worst:.1e}");
        assert!(worst < 1e-9, "{shape:?}, {reference}: {worst:e}");
    }
}

/// The bottom of a tilted block over the interior of a slab's face. The end that points down has the
/// slab's normal, which is between the normals of the bottom and of the block's front. The end that
/// points up has the border of its cone, and the sides have the normal of the bottom.
#[test]
fn normals_at_edges_are_those_of_the_face_that_is_touched() {
    let shape = |min, max, elements| BoxShape { min, max, elements, grading: [1.0; 3] };
    let slab = box_mesh("slab", &shape([0.0; 3], [2.0, 0.5, 1.0], [3, 1, 2])).unwrap();
    let block = box_mesh("block", &shape([0.6, 0.5, 0.3], [1.4, 1.0, 0.7], [2, 1, 2])).unwrap();
    let flat = Mesh::merge(vec![slab, block]).unwrap();
    for degrees in [-20.0, 20.0] {
        let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), f64::to_radians(degrees));
        let pivot = Vector3::new(1.0, 0.5, 0.0);
        let mut mesh = flat.clone();
        for x in &mut mesh.nodes[mesh.bodies[1].nodes.clone()] {
            *x = (pivot + turn * (Vector3::from(*x) - pivot)).into();
        }
        let x: Vec<f64> = mesh.nodes.iter().flatten().copied().collect();
        let rows = evaluate(&touching(&mesh, &["block_ymin"], &x, MultiplierShape::Standard), &x, false);
        assert_eq!(rows.len(), 9);
        for row in rows {
            let end = flat.nodes[row.node as usize][0] - 1.0;
            let points_down = end * f64::signum(-degrees) > 0.3;
            let corner = end.abs() > 0.3 && (flat.nodes[row.node as usize][2] - 0.5).abs() > 0.1;
            if corner && !points_down {
                continue; // its cone is wider
            }
            let points_up = end * f64::signum(degrees) > 0.3;
            let turned = f64::to_radians(20.0) - WIDENING.atan();
            let border = Rotation3::from_axis_angle(&Vector3::z_axis(), turned.copysign(degrees));
            let expected = match (points_down, points_up) {
                (true, _) => -Vector3::y(),
                (_, true) => border * -Vector3::y(),
                _ => turn * -Vector3::y(),
            };
            let normal = row.frame.vector(0);
            assert!((normal - expected).norm() < 1e-12, "{degrees}°, x = {end}: {normal}");
        }
    }
}

/// A block that rests on a slab, overlaps it or starts just above it lies on it; one that starts higher, or on its edge,
/// does not.
#[test]
fn a_block_that_rests_on_a_slab_is_seated() {
    let is_seated = |up: f64, degrees: f64| {
        let mut mesh = mesh();
        let (turn, corner) =
            (Rotation3::from_axis_angle(&Vector3::z_axis(), degrees.to_radians()), Vector3::new(1.25, 0.5, 1.17));
        for x in &mut mesh.nodes[mesh.bodies[1].nodes.clone()] {
            *x = (corner + turn * (Vector3::from(*x) - corner) + Vector3::y() * up).into();
        }
        let x: Vec<f64> = mesh.nodes.iter().flatten().copied().collect();
        interface(&mesh, &["block_ymin"], &x, MultiplierShape::Standard).is_seated(&x, |_, _| false)
    };
    // facets of 0.4 × 0.4
    assert!(is_seated(0.0, 0.0) && is_seated(-0.05, 0.0) && is_seated(0.01, 0.0) && is_seated(0.0, 1.0));
    assert!(!is_seated(0.1, 0.0) && !is_seated(0.0, -10.0) && !is_seated(2.0, 0.0));
    // overlaps, but stands on its edge
    assert!(!is_seated(-0.05, -10.0) && !is_seated(-0.05, 10.0));
}

/// The bottom of an arm that is bent upwards lies on the slab near its end only: the other half of what faces the slab,
/// and more, is far from it.
#[test]
fn a_bent_arm_whose_end_touches_is_not_seated() {
    let is_seated = |curvature: f64| {
        let mut mesh = mesh();
        let arm = mesh.bodies[1].nodes.clone();
        let end = mesh.nodes[arm.clone()].iter().map(|x| x[0]).fold(f64::INFINITY, f64::min);
        mesh.nodes[arm].iter_mut().for_each(|x| x[1] += 0.5 * curvature * (x[0] - end).powi(2));
        let x: Vec<f64> = mesh.nodes.iter().flatten().copied().collect();
        interface(&mesh, &["block_ymin"], &x, MultiplierShape::Standard).is_seated(&x, |_, _| false)
    };
    assert!(is_seated(0.0) && is_seated(0.01) && !is_seated(1.0));
}

/// A ridge that is less sharp than the feature angle, and rotated: its normal is that of the slab while
/// one of its sides does not lie on the slab; also if its facets stand for a curved surface.
#[test]
fn a_kink_has_the_normal_of_the_face_that_it_touches() {
    let half = 0.25_f64.atan().to_degrees();
    for (degrees, curved) in [-half, -10.0, 3.0, half + 2.0].into_iter().flat_map(|a| [(a, false), (a, true)]) {
        let mut mesh = ridged(0.1);
        let ridge: Vec<u32> = (0_u32..).zip(&mesh.nodes).filter(|(_, x)| x[1] == 0.4).map(|(node, _)| node).collect();
        assert_eq!(ridge.len(), 3);
        let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), f64::to_radians(degrees));
        let pivot = Vector3::new(0.85, 0.4, 0.0);
        for x in &mut mesh.nodes[mesh.bodies[1].nodes.clone()] {
            *x = (pivot + turn * (Vector3::from(*x) - pivot)).into();
        }
        let x: Vec<f64> = mesh.nodes.iter().flatten().copied().collect();
        let averaged = interface(&mesh, &["block_ymin"], &x, MultiplierShape::Standard);
        let height = |facet: &FacetNodes| {
            let corners = facet.iter().map(|&node| mesh.nodes[node as usize].into()).collect::<Vec<_>>();
            curved.then(|| FacetHeight::new([1e-3; 25], &corners))
        };
        let heights = averaged.slave_facets().iter().map(height).collect();
        let boundary: Vec<FacetNodes> = mesh.boundary(1).facets.iter().map(|facet| facet.nodes).collect();
        let touched = averaged.with_heights([heights, Vec::new()]);
        let touched = touched.with_touched_normals(&boundary, &x, std::f64::consts::FRAC_PI_4);
        let rows = evaluate(&touched, &x, false);
        // the ridge's ends are also at the sides of the block
        let row = rows.iter().find(|row| row.node == ridge[1]).unwrap();
        let expected = -Vector3::y();
        assert!((row.frame.vector(0) - expected).norm() < 1e-12, "{degrees}° {curved}: {}", row.frame.vector(0));
    }
}

fn rotated(x: &[f64], axis: Vector3<f64>, degrees: f64) -> Vec<f64> {
    let turn = Rotation3::from_axis_angle(&Unit::new_normalize(axis), f64::to_radians(degrees));
    let shift = Vector3::new(0.3, -0.2, 0.7);
    x.chunks_exact(3).flat_map(|p| <[f64; 3]>::from(turn * Vector3::new(p[0], p[1], p[2]) + shift)).collect()
}

/// A common rigid motion between two steps causes no slip, whatever its axis and angle; this
/// includes spin about the contact normal.
#[test]
fn slip_increment_is_objective() {
    for (_, shape, x, interface) in interfaces(3) {
        let before = evaluate(&interface, &x, false);
        for axis in [Vector3::y(), Vector3::x(), Vector3::new(1.0, 2.0, -0.5)] {
            for degrees in [1.0, 30.0, 90.0, 180.0] {
                let turned = rotated(&x, axis, degrees);
                let now = evaluate(&interface, &turned, false);
                for reference in REFERENCES {
                    let measures = measures(&now, &before, [&turned, &x], reference);
                    for (&[gap, xi, eta, _], before) in measures.iter().zip(&before) {
                        assert!(xi.hypot(eta) < 1e-14, "{shape:?} {degrees}°, {reference}: {xi}, {eta}");
                        assert!((gap - before.gap()).abs() < 1e-14);
                    }
                }
            }
        }
    }
}

/// The slip between two states does not change when the second one is seen from a turned frame.
#[test]
fn slip_of_a_sliding_pair_turns_with_the_body() {
    for (mesh, _, x, interface) in interfaces(5) {
        let x_before = disturbed(&mesh, 4);
        let before = evaluate(&interface, &x_before, false);
        let turned = rotated(&x, Vector3::new(0.4, 1.0, 0.2), 70.0);
        for reference in REFERENCES {
            let straight = measures(&evaluate(&interface, &x, false), &before, [&x, &x_before], reference);
            let seen = measures(&evaluate(&interface, &turned, false), &before, [&turned, &x_before], reference);
            for (a, b) in straight.iter().zip(&seen) {
                assert!((0..3).all(|c| (a[c] - b[c]).abs() < 1e-14), "{reference}: {a:?} {b:?}");
            }
        }
    }
}

/// A block slides on a slab from beside it, so that the row of its nodes was empty before: the slip is
/// the motion times the covered area; none if the block came down instead, and as before if it also came
/// down.
#[test]
fn slip_of_a_node_that_becomes_covered_is_that_of_the_bodies() {
    let mesh = mesh();
    let x: Vec<f64> = mesh.nodes.iter().flatten().copied().collect();
    let block = mesh.bodies[1].nodes.clone();
    for (motion, slides) in [([-1.7, 0.0, 0.0], true), ([0.0, 2.0, 0.0], false), ([-1.7, 0.3, 0.9], true)] {
        let same: Vec<_> = interfaces(1).into_iter().filter(|(of, ..)| of.nodes == mesh.nodes).collect();
        assert!(!same.is_empty());
        for (_, shape, _, interface) in same {
            let mut x_before = x.clone();
            block.clone().for_each(|node| (0..3).for_each(|c| x_before[3 * node + c] += motion[c]));
            let (before, now) = (evaluate(&interface, &x_before, false), evaluate(&interface, &x, false));
            assert!(now.iter().any(|row| row.area > 1e-6), "{shape:?} {motion:?}");
            for (row, before) in now.iter().zip(&before).filter(|(row, _)| row.area > 1e-6) {
                let mut slip = SlipIncrement::default();
                let previous = PreviousRow::of(before, row.area);
                assert!(before.area == 0.0 || !slides, "{motion:?}");
                row.slip(&previous, &x, &x_before, false, &mut slip);
                let along = |a: usize| -row.frame.vector(1 + a).dot(&Vector3::from(motion)) * row.area;
                assert!((slip.value - Vector2::new(along(0), along(1))).norm() < 1e-14, "{shape:?} {motion:?}");
            }
        }
    }
}

/// The gap between coaxial cylinders of radii 10 and 10.02 is 0.02 wherever facets and nodes lie,
/// although the facets of the coarser side leave their circle by 0.06.
#[test]
fn gaps_between_arcs_do_not_depend_on_the_facets() {
    for (divisions, shape) in [[7, 9], [9, 7], [8, 8], [7, 31]].into_iter().flat_map(|d| SHAPES.map(|shape| (d, shape)))
    {
        let mut x: Vec<[f64; 3]> = Vec::new();
        // an arc of 90°, two facets wide; `outward`: as seen from outside of the body
        let mut arc = |radius: f64, count: usize, outward: bool| -> Vec<FacetNodes> {
            let first = x.len() as u32;
            for i in 0..=count {
                let (sin, cos) = (std::f64::consts::FRAC_PI_2 * i as f64 / count as f64).sin_cos();
                x.extend([0.0, 0.4, 1.0].map(|z| [radius * cos, radius * sin, z]));
            }
            let at = |i: usize, j: usize| first + (3 * i + j) as u32;
            let facets = (0..count).flat_map(|i| (0..2).map(move |j| (i, j)));
            let corners = |(i, j)| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            facets.map(corners).map(|[a, b, c, d]| if outward { [a, b, c, d] } else { [a, d, c, b] }.into()).collect()
        };
        let (slave, master) = (arc(10.0, divisions[0], true), arc(10.02, divisions[1], false));
        let feature_angle = std::f64::consts::FRAC_PI_4;
        let options = InterfaceOptions { shape, rule: CellRule::Seven, reach: 1.0, feature_angle };
        let heights = [&slave, &master].map(|facets| {
            let smooth = smooth_surface(facets, &x, &x, feature_angle, &[], |_| [false; 3]);
            let corners = |facet: &FacetNodes| -> Vec<_> { facet.iter().map(|&n| x[n as usize].into()).collect() };
            let above = smooth.heights.into_iter().zip(facets);
            above.map(|(heights, facet)| Some(FacetHeight::new(heights?, &corners(facet)))).collect()
        });
        let interface = ContactInterface::new(slave, master, x.as_flattened(), options).unwrap().with_heights(heights);
        let slants = interface.slants(x.as_flattened()).unwrap();
        for (row, slant) in evaluate(&interface, x.as_flattened(), false).into_iter().zip(slants) {
            // the facets at the ends of the arc are partly covered, and end in other planes
            let angle = x[row.node as usize][1].atan2(x[row.node as usize][0]).to_degrees();
            let gap = row.gap() / row.area;
            // along the normals of the circles
            let error = gap / (slant * 0.02) - 1.0;
            assert!(
                !(15.0..75.0).contains(&angle) || error.abs() < 1e-3,
                "{divisions:?} {angle}°: {gap} {slant} {error:e}"
            );
        }
    }
}

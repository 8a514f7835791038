//! Rows of a pressure at the integration points: their derivatives, and the resultants of their forces.

use nalgebra::Vector3;
use slipstick_contact::enforcement::soft::{PressureLaw, Weight};
use slipstick_contact::kinematics::{CellRule, MultiplierShape, NodeKinematics};
use slipstick_contact::{ContactInterface, InterfaceOptions};
use slipstick_mesh::{ContactMap, Element, Mesh};

/// Two warped slave facets that face down, over four warped master facets.
fn scene() -> (ContactInterface, Vec<f64>) {
    let mut x = Vec::new();
    for (i, j) in (0..3).flat_map(|i| (0..2).map(move |j| (f64::from(i), f64::from(j)))) {
        x.extend([0.6 * i + 0.03 * j, j - 0.05 * i, 0.03 * (2.0 * i + 3.0 * j).sin() - 0.02]);
    }
    for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (f64::from(i), f64::from(j)))) {
        x.extend([0.13 + 0.7 * i + 0.02 * j, -0.2 + 0.71 * j, 0.02 * (i + 2.0 * j).cos()]);
    }
    let slaves = vec![[0, 1, 3, 2].into(), [2, 3, 5, 4].into()];
    let at = |i: u32, j: u32| 6 + 3 * i + j;
    let masters = (0..2).flat_map(|i| (0..2).map(move |j| (i, j)));
    let masters = masters.map(|(i, j)| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)].into()).collect();
    let (shape, rule) = (MultiplierShape::Dual, CellRule::Seven);
    let options = InterfaceOptions { shape, rule, reach: 0.5, feature_angle: 0.8 };
    (ContactInterface::new(slaves, masters, &x, options).unwrap(), x)
}

/// Two elements of second order with all nodes moved a little, the upper one as slave, turned and shifted; the points of
/// their faces.
fn quadratic_scene(tetrahedra: bool) -> (ContactInterface, Vec<f64>) {
    let place = |[x, y, z]: [f64; 3], k: f64| {
        let waves = [(7.3 * k).sin(), (3.1 * k + 0.4).cos(), (5.7 * k).sin()];
        [x + 0.02 * waves[0], y + 0.02 * waves[1], z + 0.01 * waves[2]]
    };
    let count: u32 = if tetrahedra { 10 } else { 27 };
    let corners: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.3, 0.3, -1.0]];
    let own = |k: usize| match tetrahedra {
        true if k < 4 => corners[k],
        true => {
            let [a, b] = slipstick_mesh::TET_EDGES[k - 4];
            std::array::from_fn(|c| 0.5 * (corners[a][c] + corners[b][c]))
        }
        false => slipstick_mesh::second_order::HEX27_NODES[k].map(|x| 0.5 * x),
    };
    // the lower element faces up at z = 0, the upper one faces down; both are right-handed
    let upper = |[x, y, z]: [f64; 3]| match tetrahedra {
        true => [0.1 + 0.9 * y, 0.05 + 0.8 * x, -z],
        false => [0.1 + 0.8 * x, -0.15 + 0.7 * y, 1.0 + z],
    };
    let lower = |[x, y, z]: [f64; 3]| if tetrahedra { [x, y, z] } else { [x, y, z - 0.5] };
    let upper = |x: [f64; 3]| if tetrahedra { upper(x) } else { upper([x[0], x[1], x[2] - 0.5]) };
    let numbers = |first: u32| (first..first + count).collect::<Vec<u32>>();
    let element = |nodes: Vec<u32>| match tetrahedra {
        true => Element::Tet10(nodes.try_into().unwrap()),
        false => Element::Hex27(nodes.try_into().unwrap()),
    };
    let of = |shape: &dyn Fn([f64; 3]) -> [f64; 3], first: u32| {
        (0..count as usize).map(|k| place(shape(own(k)), f64::from(first) + k as f64)).collect::<Vec<_>>()
    };
    let nodes = [of(&lower, 0), of(&upper, count)].concat();
    let mesh = Mesh { nodes, elements: vec![element(numbers(0)), element(numbers(count))], ..Mesh::default() };
    let points = ContactMap::new(&mesh).points(&mesh.nodes);
    // the faces that look at each other
    let facing = |element: usize, sign: f64| {
        let element = &mesh.elements[element];
        let faces = (0..element.faces()).map(|face| element.face(face));
        let up = |facets: &Vec<slipstick_mesh::FacetNodes>| {
            let [a, b, c] = [0, 1, 2].map(|i| Vector3::from(points[facets[0][i] as usize]));
            let normal = (b - a).cross(&(c - a)).normalize();
            normal[2] * sign > 0.8
        };
        faces.map(|face| face.facets()).find(up).expect("a face")
    };
    let (slaves, masters) = (facing(1, -1.0), facing(0, 1.0));
    let faces = [mesh.quadratic_facets(&slaves), mesh.quadratic_facets(&masters)];
    let x = points.concat();
    let (shape, rule) = (MultiplierShape::Standard, CellRule::Seven);
    let options = InterfaceOptions { shape, rule, reach: 0.5, feature_angle: 0.8 };
    (ContactInterface::new(slaves, masters, &x, options).unwrap().with_quadratic_faces(faces), x)
}

/// Offsets of slave nodes.
fn offsets(interface: &ContactInterface) -> Vec<f64> {
    let of = |k: usize| [0.02, 0.0, -0.01, 0.03, 0.01, 0.015, -0.02, 0.005, 0.01][k % 9];
    (0..interface.slave_nodes().len()).map(of).collect()
}

fn rows(interface: &ContactInterface, x: &[f64], law: &PressureLaw, gradient: bool) -> Vec<NodeKinematics> {
    let mut rows = Vec::new();
    let mut workspace = interface.workspace(|_| true);
    interface
        .evaluate_pressed(x, gradient, Some((Weight::Pressure(law), &offsets(interface))), &mut workspace, &mut rows)
        .unwrap();
    rows
}

fn law() -> PressureLaw {
    PressureLaw::Exponential { contact_pressure: 2.0, clearance: 0.5 }
}

#[test]
fn pressed_rows_match_finite_differences() {
    for (kind, (interface, x)) in
        [scene(), quadratic_scene(false), quadratic_scene(true), closed(scene()), closed(quadratic_scene(false))]
            .into_iter()
            .enumerate()
    {
        let worst = worst_difference(&interface, &x);
        println!("scene {kind}: {worst:.1e}");
        assert!(worst < 2e-8, "scene {kind}: {worst:e}");
    }
}

/// With half of the initial gaps of some nodes closed.
fn closed((interface, x): (ContactInterface, Vec<f64>)) -> (ContactInterface, Vec<f64>) {
    (interface.with_closed_gaps(&x, |node, gap| (node % 3 > 0).then_some(0.5 * gap)), x)
}

/// The largest difference between the derivatives of the rows and central differences of fourth order.
fn worst_difference(interface: &ContactInterface, x: &[f64]) -> f64 {
    let base = rows(interface, x, &law(), true);
    let values = |row: &NodeKinematics| {
        let pressed = row.pressed.as_ref().expect("a pressure");
        [&pressed.coefficient[..], &[pressed.load]].concat()
    };
    let mut worst: f64 = 0.0;
    for (j, row) in base.iter().enumerate() {
        let pressed = row.pressed.as_ref().expect("a pressure");
        assert!(pressed.load > 0.001);
        let columns = 3 * row.support.len();
        for t in 0..columns {
            let at = |h: f64| {
                let mut x = x.to_vec();
                x[3 * row.support[t / 3] as usize + t % 3] += h;
                let moved = &rows(interface, &x, &law(), false)[j];
                assert_eq!(moved.support, row.support);
                values(moved)
            };
            let (p1, m1, p2, m2) = (at(1e-4), at(-1e-4), at(2e-4), at(-2e-4));
            for e in 0..p1.len() {
                let difference = (8.0 * (p1[e] - m1[e]) - (p2[e] - m2[e])) / 12e-4;
                let exact = pressed.gradient.get(e * columns + t).unwrap_or(&pressed.load_gradient[t]);
                worst = worst.max((difference - exact).abs());
            }
        }
    }
    worst
}

/// Forces of both sides balance, and so do their moments where the facets coincide with the auxiliary plane: the row
/// sums to zero, and its slave part to the area of the mortar row.
#[test]
fn pressed_rows_are_balanced() {
    for (interface, x) in [scene(), quadratic_scene(false), quadratic_scene(true)] {
        for row in rows(&interface, &x, &law(), false) {
            let pressed = row.pressed.as_ref().expect("a pressure");
            assert!(pressed.coefficient.iter().sum::<f64>().abs() < 1e-14);
            assert!((pressed.coefficient[..row.ring].iter().sum::<f64>() - row.area).abs() < 1e-14);
        }
    }
}

/// A rigid unit square, tilted by a small angle about an axis through its middle into a flat master, with a stiffness
/// K: by hand, the load is K times the mean penetration, and the moment K/12 times the tilt.
#[test]
fn the_moment_of_a_tilted_facet_is_that_of_its_second_moment_of_area() {
    let (tilt, depth) = (1e-3, 0.01);
    let at = |x: f64, y: f64| [x, y, -depth - tilt * x];
    let slave = [at(-0.5, -0.5), at(-0.5, 0.5), at(0.5, 0.5), at(0.5, -0.5)];
    let master = [[-2.0, -2.0, 0.0], [2.0, -2.0, 0.0], [2.0, 2.0, 0.0], [-2.0, 2.0, 0.0]];
    let x = [slave, master].concat().concat();
    for shape in [MultiplierShape::Standard, MultiplierShape::Dual, MultiplierShape::Mean] {
        let options = InterfaceOptions { shape, rule: CellRule::Seven, reach: 0.5, feature_angle: 0.8 };
        let interface =
            ContactInterface::new(vec![[0, 1, 2, 3].into()], vec![[4, 5, 6, 7].into()], &x, options).unwrap();
        let mut out = Vec::new();
        let pressure = Some((Weight::Pressure(&PressureLaw::Proportional), &[0.0; 4][..]));
        interface.evaluate_pressed(&x, false, pressure, &mut interface.workspace(|_| true), &mut out).unwrap();
        let [mut force, mut moment] = [0.0; 2];
        for row in &out {
            let pressed = row.pressed.as_ref().expect("a pressure");
            let z = row.frame.to_global(&Vector3::new(pressed.load / row.area, 0.0, 0.0));
            for (&node, b) in row.support.iter().zip(&pressed.coefficient).take(row.ring) {
                force -= b * z[2];
                moment += b * z[2] * x[3 * node as usize];
            }
        }
        assert!((force - depth).abs() < 1e-6 * depth, "{shape:?}: {force}");
        assert!((moment + tilt / 12.0).abs() < 1e-6 * tilt, "{shape:?}: {moment}");
    }
}

/// A hex27, scaled and moved.
fn block(first: u32, centre: [f64; 3], size: f64) -> (Vec<[f64; 3]>, Element) {
    let place = |x: [f64; 3]| std::array::from_fn(|c| centre[c] + 0.5 * size * x[c]);
    let numbers: Vec<u32> = (first..first + 27).collect();
    (slipstick_mesh::second_order::HEX27_NODES.map(place).to_vec(), Element::Hex27(numbers.try_into().unwrap()))
}

/// A block of edge ½ on the middle of one of edge 1, with the points of their faces.
fn blocks() -> (Mesh, ContactInterface, Vec<f64>) {
    let ((lower, first), (upper, second)) = (block(0, [0.5, 0.5, -0.5], 1.0), block(27, [0.5, 0.5, 0.25], 0.5));
    let mesh = Mesh { nodes: [lower, upper].concat(), elements: vec![first, second], ..Mesh::default() };
    let facets = |element: usize| {
        let element = &mesh.elements[element];
        let flat = |face: &slipstick_mesh::FaceNodes| face.iter().all(|&node| mesh.nodes[node as usize][2] == 0.0);
        (0..element.faces()).map(|face| element.face(face)).find(flat).expect("a face").facets()
    };
    let (slaves, masters) = (facets(1), facets(0));
    let faces = [mesh.quadratic_facets(&slaves), mesh.quadratic_facets(&masters)];
    let x = ContactMap::new(&mesh).points(&mesh.nodes).concat();
    let (shape, rule) = (MultiplierShape::Standard, CellRule::Seven);
    let options = InterfaceOptions { shape, rule, reach: 0.5, feature_angle: 0.8 };
    let interface = ContactInterface::new(slaves, masters, &x, options).unwrap().with_quadratic_faces(faces);
    (mesh, interface, x)
}

/// The small block presses on the large one with a pressure of 1: by hand, the forces on the nodes of a face are products
/// of the integrals of quadratic shape functions, over all of the edge of the slave, 1/12, 1/3 and 1/12, and over the
/// middle half of that of the master, 1/48, 11/24 and 1/48.
#[test]
fn a_uniform_pressure_gives_the_forces_of_quadratic_shapes() {
    let (mesh, interface, x) = blocks();
    let law = PressureLaw::Table(vec![[-1.0, 0.0], [1.0, 2.0]]);
    let mut rows = Vec::new();
    let none = vec![0.0; interface.slave_nodes().len()];
    interface
        .evaluate_pressed(
            &x,
            false,
            Some((Weight::Pressure(&law), &none)),
            &mut interface.workspace(|_| true),
            &mut rows,
        )
        .unwrap();
    let mut force = vec![0.0; x.len()];
    for row in &rows {
        let pressed = row.pressed.as_ref().expect("a pressure");
        for (&node, b) in row.support.iter().zip(&pressed.coefficient) {
            force[3 * node as usize + 2] += b * pressed.load / row.area;
        }
    }
    let force = ContactMap::new(&mesh).apply_transposed(&force);
    let mut compared = 0;
    for (node, place) in mesh.nodes.iter().enumerate().filter(|(_, place)| place[2] == 0.0) {
        let on_slave = node >= 27;
        let along = |x: f64| match (on_slave, x == 0.5) {
            (true, true) => 1.0 / 3.0,
            (true, false) => 1.0 / 12.0,
            (false, true) => 11.0 / 24.0,
            (false, false) => 1.0 / 48.0,
        };
        let exact = along(place[0]) * along(place[1]) * if on_slave { 1.0 } else { -1.0 };
        let found = force[3 * node + 2];
        assert!((found - exact).abs() < 1e-13, "node {node} at {place:?}: {found} instead of {exact}");
        compared += 1;
    }
    assert_eq!(compared, 18);
}

/// The lower face of the small block is moved up by a quadratic function, and all gaps of its nodes closed: the gap is zero
/// everywhere, and the load that of the offset, whatever the curvature. If 0.004 of each gap is closed, by hand, the load
/// is that of the mean of the rest.
#[test]
fn closed_gaps_of_nodes_are_interpolated_like_positions() {
    let (mut mesh, interface, _) = blocks();
    for place in &mut mesh.nodes[27..] {
        if place[2] == 0.0 {
            place[2] = 0.004 + 0.04 * (place[0] - 0.5) * (place[0] - 0.5) + 0.01 * (place[1] - 0.5);
        }
    }
    let x = ContactMap::new(&mesh).points(&mesh.nodes).concat();
    let load = |interface: &ContactInterface, offset: f64| -> f64 {
        let (offsets, mut rows) = (vec![offset; interface.slave_nodes().len()], Vec::new());
        let pressure = Some((Weight::Pressure(&PressureLaw::Proportional), &offsets[..]));
        interface.evaluate_pressed(&x, false, pressure, &mut interface.workspace(|_| true), &mut rows).unwrap();
        rows.iter().map(|row| row.pressed.as_ref().expect("a pressure").load).sum()
    };
    let none = load(&interface, 1e-3);
    assert!(none == 0.0, "{none}");
    let all = interface.clone().with_closed_gaps(&x, |_, _| Some(0.0));
    let found = load(&all, 1e-3);
    // the facets are inclined by up to 0.03
    assert!((found - 0.25e-3).abs() < 1e-3 * 0.25e-3, "{found}");
    // gaps remain that the offset of 0.01 exceeds everywhere: the mean of x² on an edge of ½ is 1/48
    let remains = interface.clone().with_closed_gaps(&x, |_, gap| Some(gap - 0.004));
    let (found, exact) = (load(&remains, 0.01), 0.25 * (0.01 - 0.04 / 48.0));
    assert!((found - exact).abs() < 1e-3 * exact, "{found} instead of {exact}");
}

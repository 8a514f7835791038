//! Compares every law of the list, in every element, formulation and scaling, with the reference
//! element.

use super::parent::node_of_27;
use super::*;
use crate::{ElementScaling, LawKind, NeoHooke, SolidModel, hex8};
use slipstick_linalg::{BlockMatrix, BlockPattern};
use slipstick_mesh::{Body, Element, Mesh};
use std::sync::Arc;

type Vectors = [[f64; 3]];

/// Mixed derivatives of the energy: the derivative in the direction `w` of the displacements, and
/// its change in the directions `v` of the displacements and `slope` of the scaling.
fn work(
    section: &Section,
    x: &Vectors,
    [u, v, w]: [&Vectors; 3],
    scaling: ElementScaling,
    slope: ElementScaling,
) -> [f64; 3] {
    let dual = |value, first, second| Dual {
        value: Dual { value, slopes: [second] },
        slopes: [Dual { value: first, slopes: [0.0] }],
    };
    let u: Vec<[Dual<Dual<f64>>; 3]> = (0..x.len()).map(|i| from_fn(|a| dual(u[i][a], w[i][a], v[i][a]))).collect();
    let scaling = [dual(scaling.factor, 0.0, slope.factor), dual(scaling.gamma, 0.0, slope.gamma)];
    let energy = energy(section, x, &u, scaling);
    [energy.value.value, energy.slopes[0].value, energy.slopes[0].slopes[0]]
}

/// Force and tangent product.
fn force(section: &Section, x: &Vectors, u: &Vectors, v: &Vectors, scaling: ElementScaling) -> [Vec<f64>; 2] {
    let mut out = [vec![0.0; 3 * x.len()], vec![0.0; 3 * x.len()]];
    for i in 0..3 * x.len() {
        let mut unit = vec![[0.0; 3]; x.len()];
        unit[i / 3][i % 3] = 1.0;
        let none = ElementScaling::NONE;
        [_, out[0][i], out[1][i]] = work(section, x, [u, v, &unit], scaling, none);
    }
    out
}

/// All laws in all formulations.
pub(crate) fn sections() -> impl Iterator<Item = Section> {
    let formulations = [Formulation::Full, Formulation::FBar, Formulation::Reduced];
    let laws = LawKind::ALL.iter().map(|law| law.like(210.0, 0.3).unwrap());
    laws.flat_map(move |material| formulations.map(|formulation| Section::new(material, formulation)))
}

fn nodes() -> Vec<[f64; 3]> {
    let moved = |i: usize| from_fn(|a| node_of_27(i)[a] + 0.15 * ((5 * i + 2 * a) as f64 * 1.7).sin());
    (0..8).map(moved).chain((8..27).map(|i| from_fn(|a| moved_middle(i)[a]))).collect()
}

/// Nodes that are no corners, moved less: the element must not fold.
fn moved_middle(i: usize) -> [f64; 3] {
    from_fn(|a| node_of_27(i)[a] + 0.05 * ((5 * i + 2 * a) as f64 * 1.7).sin())
}

/// A vector per node, without any symmetry.
fn field(size: f64, frequency: f64) -> Vec<[f64; 3]> {
    let size = |i: usize| if i < 8 { size } else { 0.5 * size };
    (0..27).map(|i| from_fn(|a| size(i) * ((3 * i + a) as f64 * frequency).sin())).collect()
}

/// Solid, scaled, grey and empty.
const SCALINGS: [ElementScaling; 4] = [
    ElementScaling::SOLID,
    ElementScaling::stiffness(0.2),
    ElementScaling { factor: 0.3, gamma: 0.6, ..ElementScaling::SOLID },
    ElementScaling { factor: 0.1, gamma: 0.0, ..ElementScaling::SOLID },
];

fn assert_near(found: &[f64], expected: &[f64], what: &str) {
    let size = expected.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-12 * size, "{what}: {found} for {expected}");
    }
}

/// Force, tangent, product, pull-back to the density and energy.
#[test]
fn kernels_agree_with_the_reference_element() {
    let (u, v) = (field(0.15, 1.3), field(1.0, 0.77));
    // corners of the cube that make a tetrahedron, a wedge and a hexahedron, and the element of
    // these nodes
    let elements: [(&[usize], Element); 6] = [
        (&[0, 1, 3, 4], [0, 1, 2, 3].into()),
        (&[0, 1, 3, 4, 5, 7], [0, 1, 2, 3, 4, 5].into()),
        (&[0, 1, 2, 3, 4, 5, 6, 7], [0, 1, 2, 3, 4, 5, 6, 7].into()),
        (&[0, 1, 3, 4, 8, 24, 11, 16, 22, 20], from_fn::<u32, 10, _>(|i| i as u32).into()),
        (
            &[0, 1, 3, 4, 5, 7, 8, 24, 11, 12, 25, 15, 16, 17, 19, 22, 26, 20],
            from_fn::<u32, 18, _>(|i| i as u32).into(),
        ),
        (&from_fn::<usize, 27, _>(|i| i), from_fn::<u32, 27, _>(|i| i as u32).into()),
    ];
    for (corners, element) in elements {
        let [x, u, v] = [&nodes(), &u, &v].map(|field| corners.iter().map(|&i| field[i]).collect::<Vec<_>>());
        let number = corners.len() as u32;
        let mesh = Mesh {
            nodes: x.clone(),
            elements: vec![element],
            bodies: vec![Body { name: "element".into(), elements: 0..1, nodes: 0..corners.len() }],
            ..Mesh::default()
        };
        let pattern = Arc::new(BlockPattern::from_rows(&mesh.node_neighbours()));
        let (d, direction) = (u.as_flattened(), v.as_flattened());
        for (section, scaling) in sections().flat_map(|section| SCALINGS.map(|scaling| (section, scaling))) {
            let what = format!("{number} nodes, {section:?}, {scaling:?}");
            let model = SolidModel::new(&mesh, vec![section]).unwrap();
            let [expected_force, expected_product] = force(&section, &x, &u, &v, scaling);
            let mut found = vec![0.0; d.len()];
            model.internal_force(d, &[scaling], &mut found).unwrap();
            assert_near(&found, &expected_force, &what);
            let mut matrix = BlockMatrix::new(pattern.clone());
            model.add_tangent(d, &[scaling], &model.scatter(&pattern), &mut matrix).unwrap();
            matrix.mul(direction, &mut found);
            assert_near(&found, &expected_product, &what);
            found.fill(0.0);
            model.add_tangent_product(d, &[scaling], direction, &mut found).unwrap();
            assert_near(&found, &expected_product, &what);
            let by_factor = ElementScaling { factor: 1.5, ..ElementScaling::NONE };
            let by_both = ElementScaling { factor: 0.7, gamma: 2.3, ..ElementScaling::NONE };
            for slope in [by_factor, by_both] {
                let zero = vec![[0.0; 3]; x.len()];
                let [energy, _, expected] = work(&section, &x, [&u, &zero, &v], scaling, slope);
                let mut found = [0.0];
                model.pull_back_density(d, &[scaling], &[slope], direction, &mut found).unwrap();
                assert_near(&found, &[expected], &what);
                assert_near(&[model.energy(d, &[scaling]).unwrap()], &[energy], &what);
            }
        }
    }
}

/// Compares the reference element and the kernel with a third implementation that shares no source
/// with them.
#[test]
fn another_program_agrees() {
    let data: serde_json::Value = serde_json::from_str(include_str!("../../tests/data/unit_element.json")).unwrap();
    let read = |key: &str| -> [[f64; 3]; 8] { from_fn(|i| from_fn(|c| data[key][i][c].as_f64().unwrap())) };
    let (x, u, expected) = (read("X"), read("u"), read("f_int"));
    let section = NeoHooke::new(1000.0, 0.3).unwrap().into();
    let mut first = vec![[0.0; 3]; 8];
    first[0][0] = 1.0;
    let [found, row] = force(&section, &x, &u, &first, ElementScaling::SOLID);
    let energy = energy(&section, &x, &u, [1.0, 1.0]);
    assert!((energy / data["energy"].as_f64().unwrap() - 1.0).abs() < 1e-10);
    let geometry = hex8::ReferenceGeometry::new(&x).unwrap();
    let kernel = hex8::internal_force(&section, ElementScaling::SOLID, &geometry, &u).unwrap();
    for (n, expected) in expected.as_flattened().iter().enumerate() {
        assert!((found[n] - expected).abs() < 1e-10 * 17.0, "{} {expected}", found[n]);
        assert!((kernel[n / 3][n % 3] - expected).abs() < 1e-10 * 17.0, "{kernel:?} {expected}");
        assert!((row[n] - data["K_row0"][n].as_f64().unwrap()).abs() < 1e-10 * 215.0);
    }
}

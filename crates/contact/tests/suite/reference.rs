//! Mortar matrices, normals, gap and slip of one configuration against an independent
//! implementation (dual numbers, no shared source), standard and dual shapes.

use serde_json::Value;
use slipstick_contact::kinematics::slip::SlipIncrement;
use slipstick_contact::kinematics::{CellRule, MultiplierShape, NodeKinematics, PreviousRow};
use slipstick_contact::{ContactInterface, InterfaceOptions};

/// The reference divides overlaps at the mean of their vertices, slipstick at the centroid: on
/// these distorted facets the 7-point rule then differs by up to 4e-11. With the mean of the
/// vertices here too, it is 1e-16.
const BOUND: f64 = 1e-10;

struct Configuration {
    data: Value,
    slave: Vec<u32>,
    master: Vec<u32>,
    reference: Vec<f64>,
    current: Vec<f64>,
}

fn list(value: &Value) -> Vec<u32> {
    value.as_array().unwrap().iter().map(|v| v.as_u64().unwrap() as u32).collect()
}

fn facets(value: &Value) -> Vec<slipstick_mesh::FacetNodes> {
    value.as_array().unwrap().iter().map(|f| slipstick_mesh::FacetNodes::new(&list(f)).unwrap()).collect()
}

fn configuration() -> Configuration {
    let data: Value = serde_json::from_str(include_str!("../data/unit_mortar.json")).unwrap();
    let reference: Vec<f64> = data["setup_nodes"]
        .as_array()
        .unwrap()
        .iter()
        .flat_map(|x| x.as_array().unwrap())
        .map(|v| v.as_f64().unwrap())
        .collect();
    let (slave, master) = (list(&data["slave_nodes"]), list(&data["master_nodes"]));
    let mut current = reference.clone();
    for (nodes, key) in [(&slave, "u_slave"), (&master, "u_master")] {
        for (i, &node) in nodes.iter().enumerate() {
            for c in 0..3 {
                current[3 * node as usize + c] += data[key][i][c].as_f64().unwrap();
            }
        }
    }
    Configuration { data, slave, master, reference, current }
}

fn evaluate(at: &Configuration, x: &[f64], shape: MultiplierShape, gradient: bool) -> Vec<NodeKinematics> {
    let (slave, master) = (facets(&at.data["slave_facets"]), facets(&at.data["master_facets"]));
    let feature_angle = std::f64::consts::FRAC_PI_4;
    let options = InterfaceOptions { shape, rule: CellRule::Seven, reach: 1.0, feature_angle };
    let interface = ContactInterface::new(slave, master, x, options).unwrap();
    let mut rows = Vec::new();
    interface.evaluate(x, gradient, &mut interface.workspace(|_| true), &mut rows).unwrap();
    rows
}

fn entry(rows: &[NodeKinematics], row: u32, column: u32) -> f64 {
    let row = rows.iter().find(|r| r.node == row).unwrap();
    row.support.iter().position(|&s| s == column).map_or(0.0, |s| row.coefficient[s])
}

fn check_matrices(at: &Configuration, x: &[f64], shape: MultiplierShape, d: &str, m: &str) {
    let rows = evaluate(at, x, shape, false);
    for (j, &row) in at.slave.iter().enumerate() {
        for (k, &column) in at.slave.iter().enumerate() {
            let expected = at.data[d][j][k].as_f64().unwrap();
            assert!((entry(&rows, row, column) - expected).abs() < BOUND, "{d}[{j}][{k}]");
        }
        for (l, &column) in at.master.iter().enumerate() {
            let expected = at.data[m][j][l].as_f64().unwrap();
            assert!((-entry(&rows, row, column) - expected).abs() < BOUND, "{m}[{j}][{l}]");
        }
    }
}

#[test]
fn reference_mortar_matrices() {
    let at = configuration();
    check_matrices(&at, &at.reference, MultiplierShape::Standard, "D0", "M0");
    check_matrices(&at, &at.current, MultiplierShape::Standard, "D", "M");
    check_matrices(&at, &at.current, MultiplierShape::Dual, "D_dual", "M_dual");
}

#[test]
fn reference_normals_gap_and_slip() {
    let at = configuration();
    let before = evaluate(&at, &at.reference, MultiplierShape::Standard, false);
    let now = evaluate(&at, &at.current, MultiplierShape::Standard, true);
    let area: f64 = now.iter().map(|r| r.area).sum();
    assert!((area - at.data["integrated_area"].as_f64().unwrap()).abs() < BOUND);
    for (j, &node) in at.slave.iter().enumerate() {
        let place = now.iter().position(|r| r.node == node).unwrap();
        let row = &now[place];
        for c in 0..3 {
            assert!((row.frame.vector(0)[c] - at.data["normals"][j][c].as_f64().unwrap()).abs() < BOUND);
        }
        assert!((row.gap() - at.data["gap"][j].as_f64().unwrap()).abs() < BOUND);
        let mut slip = SlipIncrement::default();
        row.slip(&PreviousRow::of(&before[place], 0.0), &at.current, &at.reference, false, &mut slip);
        for a in 0..2 {
            let expected: f64 = (0..3)
                .map(|c| row.frame.vector(1 + a)[c] * at.data["slip_vector_from_reference"][j][c].as_f64().unwrap())
                .sum();
            assert!((slip.value[a] - expected).abs() < BOUND);
        }
    }
    // ∂g̃/∂x of the first slave node by its own position
    let row = now.iter().find(|r| r.node == at.slave[0]).unwrap();
    let own = row.support.iter().position(|&s| s == row.node).unwrap();
    let mut gradient = Vec::new();
    row.gap_gradient(&mut gradient);
    for c in 0..3 {
        assert!((gradient[3 * own + c] - at.data["dgap0_dxslave0"][c].as_f64().unwrap()).abs() < 1e-8);
    }
}

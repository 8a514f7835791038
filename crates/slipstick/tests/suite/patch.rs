//! The contact patch test: a uniform state of stress passes through an interface between
//! non-matching meshes.

use crate::common::*;
use nalgebra::{Matrix3, Vector3};
use slipstick::build::{Problem, build_mesh};
use slipstick::case::parse_case;
use slipstick::model::{ContactModel, Design, Loads, ModelParts, Share, Springs, Temperatures, Viscosity};
use slipstick_contact::ContactStatus;
use slipstick_mesh::{BoxShape, Element, Mesh, box_mesh};
use std::sync::Arc;

const LOWER: (f64, f64) = (1000.0, 0.3);
const UPPER: (f64, f64) = (300.0, 0.2);
const PRESSED: f64 = 0.3;

/// Replaces the hexahedra of a box by other elements.
type Divide = fn(&Mesh) -> Mesh;

/// Two boxes 1 × 1 × 1 on top of each other, the upper one pressed down by [`PRESSED`]. `confined`:
/// frictionless walls on all four sides, otherwise only symmetry planes at x = 0 and z = 0;
/// `clamped`: no walls, but ends held in all components.
struct Stack {
    lower: [usize; 3],
    upper: [usize; 3],
    grading: [f64; 3],
    shape: &'static str,
    slave_above: bool,
    confined: bool,
    clamped: bool,
    moduli: [(f64, f64); 2],
    friction: f64,
    /// More keys of both bodies.
    more: &'static str,
    /// How the hexahedra of the lower and of the upper box are divided.
    divided: [Option<Divide>; 2],
}

impl Default for Stack {
    fn default() -> Self {
        Self {
            lower: [2, 2, 2],
            upper: [3, 1, 3],
            grading: [1.0; 3],
            shape: "standard",
            slave_above: true,
            confined: true,
            clamped: false,
            moduli: [LOWER, UPPER],
            friction: 0.0,
            more: "",
            divided: [None; 2],
        }
    }
}

impl Stack {
    /// The problem, with tetrahedra and wedges if requested.
    fn problem(&self) -> Problem {
        let mut text = self.text();
        let mut meshes = Vec::new();
        let boxes = [("lower", self.lower, 0.0, self.grading), ("upper", self.upper, 1.0, [1.0; 3])];
        for ((name, elements, y, grading), divided) in boxes.into_iter().zip(self.divided) {
            let Some(divided) = divided else { continue };
            let shape = BoxShape { min: [0.0, y, 0.0], max: [1.0, y + 1.0, 1.0], elements, grading };
            meshes.push((name, divided(&box_mesh(name, &shape).unwrap())));
            let start = text.find(&format!("name = \"{name}\"\nbox")).unwrap() + format!("name = \"{name}\"\n").len();
            let end = start + text[start..].find('\n').unwrap();
            text.replace_range(start..end, &format!("mesh = {{ file = '{name}' }}"));
        }
        problem_with(&text, &meshes)
    }

    fn text(&self) -> String {
        let Self { lower, upper, grading, shape, moduli: [a, b], friction, more, .. } = self;
        let (slave, master) =
            if self.slave_above { ("upper_ymin", "lower_ymax") } else { ("lower_ymax", "upper_ymin") };
        let mut walls = String::new();
        for body in if self.clamped { vec![] } else { vec!["lower", "upper"] } {
            for (component, faces) in [("x", ["xmin", "xmax"]), ("z", ["zmin", "zmax"])] {
                for face in &faces[..if self.confined { 2 } else { 1 }] {
                    walls += &format!("[[dirichlet]]\nset = \"{body}_{face}\"\ncomponents = [\"{component}\"]\n");
                }
            }
        }
        let held = if self.clamped { "[\"x\", \"y\", \"z\"]" } else { "[\"y\"]" };
        format!(
            r#"
[[body]]
name = "lower"
box = {{ min = [0, 0, 0], max = [1, 1, 1], elements = {lower:?}, grading = {grading:?} }}
material = {{ neo_hooke = {{ youngs_modulus = {:?}, poisson_ratio = {:?} }} }}
{more}
[[body]]
name = "upper"
box = {{ min = [0, 1, 0], max = [1, 2, 1], elements = {upper:?} }}
material = {{ neo_hooke = {{ youngs_modulus = {:?}, poisson_ratio = {:?} }} }}
{more}
[[contact]]
slave = "{slave}"
master = "{master}"
friction = {friction:?}
multiplier_shape = "{shape}"
[[dirichlet]]
set = "lower_ymin"
components = {held}
[[dirichlet]]
set = "upper_ymax"
components = {held}
motion = [{{ t = 1.0, u = [0, -{PRESSED}, 0] }}]
{walls}
[load_path]
steps = 3
tolerance = {{ relative = 1e-13 }}
"#,
            a.0, a.1, b.0, b.1
        )
    }
}

/// Neo-Hooke (100): P_ii = 2c (λ_i − J^(−2β)/λ_i), c = E/(4(1+ν)), β = ν/(1−2ν).
fn stress([e, nu]: [f64; 2], stretch: [f64; 3]) -> [f64; 3] {
    let (c, beta) = (e / (4.0 * (1.0 + nu)), nu / (1.0 - 2.0 * nu));
    let j: f64 = stretch.iter().product();
    stretch.map(|l| 2.0 * c * (l - j.powf(-2.0 * beta) / l))
}

/// Root of an increasing function by bisection.
fn root(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if f(middle) < 0.0 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Axial stretches of both bodies and the common pressure in uniaxial strain: equal axial stress,
/// given total height.
fn uniaxial_strain(moduli: [(f64, f64); 2]) -> ([f64; 2], f64) {
    let axial = |body: usize, l: f64| stress([moduli[body].0, moduli[body].1], [1.0, l, 1.0])[1];
    let lower = root(1.0 - PRESSED, 1.0, |l| axial(0, l) - axial(1, 2.0 - PRESSED - l));
    ([lower, 2.0 - PRESSED - lower], -axial(0, lower))
}

/// Deformation gradients at the centre of an element, or at the integration points of a quadratic one,
/// from its nodes' displacements.
pub(crate) fn deformation_gradients(mesh: &Mesh, element: usize, d: &[f64]) -> Vec<Matrix3<f64>> {
    use slipstick_mesh::second_order::{
        HEX27_POINTS, TET10_POINTS, WEDGE18_POINTS, hex27_shapes, tet10_shapes, wedge18_shapes,
    };
    // gradients of the shape functions there, in coordinates of the parent cube or tetrahedron
    let cube = || slipstick_mesh::HEX_CORNERS.map(|corner| corner.map(|c| c / 8.0)).to_vec();
    let tetrahedron = vec![[-1.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let (points, nodes): (Vec<Vec<[f64; 3]>>, Vec<u32>) = match mesh.elements[element] {
        Element::Hex8(nodes) => (vec![cube()], nodes.to_vec()),
        Element::Wedge6(_) => (vec![cube()], mesh.elements[element].as_hex().unwrap().to_vec()),
        Element::Tet4(nodes) => (vec![tetrahedron], nodes.to_vec()),
        Element::Tet10(nodes) => {
            (TET10_POINTS.iter().map(|point| tet10_shapes(point.0).1.to_vec()).collect(), nodes.to_vec())
        }
        Element::Wedge18(nodes) => {
            (WEDGE18_POINTS.iter().map(|point| wedge18_shapes(point.0).1.to_vec()).collect(), nodes.to_vec())
        }
        Element::Hex27(nodes) => {
            (HEX27_POINTS.iter().map(|point| hex27_shapes(point.0).1.to_vec()).collect(), nodes.to_vec())
        }
    };
    let at = |gradients: &Vec<[f64; 3]>| {
        let (mut reference, mut current) = (Matrix3::zeros(), Matrix3::zeros());
        for (gradient, &node) in gradients.iter().zip(&nodes) {
            let gradient = Vector3::from(*gradient).transpose();
            let x = Vector3::from(mesh.nodes[node as usize]);
            let u = Vector3::from_column_slice(&d[3 * node as usize..][..3]);
            reference += x * gradient;
            current += (x + u) * gradient;
        }
        current * reference.try_inverse().unwrap()
    };
    points.iter().map(at).collect()
}

/// Largest deviation of any element's deformation gradient from diag(x, y of the body, x).
fn check_uniform(mesh: &Mesh, d: &[f64], lateral: [f64; 2], axial: [f64; 2]) -> f64 {
    let mut worst: f64 = 0.0;
    for (b, body) in mesh.bodies.iter().enumerate() {
        let exact = Matrix3::from_diagonal(&Vector3::new(lateral[b], axial[b], lateral[b]));
        for e in body.elements.clone() {
            for found in deformation_gradients(mesh, e, d) {
                worst = worst.max((found - exact).amax());
            }
        }
    }
    worst
}

fn check(name: &str, problem: &mut Problem, lateral: [f64; 2], axial: [f64; 2], pressure: f64) {
    let density = problem.initial_density().clone();
    let run = forward(problem, &density);
    assert_eq!(run.path.states.len(), 4, "{name}: no sub-steps");
    let last = run.path.states.last().unwrap().state.clone();
    let strain = check_uniform(&problem.mesh, &last.unknowns, lateral, axial);
    let contact = contact_path(problem, &run).pop().unwrap();
    let traction = contact.iter().map(|c| (c.multiplier[0] / pressure - 1.0).abs()).fold(0.0, f64::max);
    println!("{name}: F off by {strain:.1e}, pressure {pressure:.6} by {traction:.1e}");
    assert!(strain < 1e-10, "{name}: F off by {strain:e}");
    assert!(traction < 1e-10, "{name}: pressure off by {traction:e}");
    for node in contact {
        assert_ne!(node.status, ContactStatus::Inactive);
        assert!(node.gap.unwrap().abs() < 1e-11, "{name}: gap {:?}", node.gap);
        assert!(node.multiplier[1].hypot(node.multiplier[2]) < 1e-10 * pressure, "{name}: {:?}", node.multiplier);
    }
}

/// Two materials, uniaxial strain: equal axial stresses in both bodies, from (100) by hand.
#[test]
fn uniaxial_strain_passes_through_any_meshes() {
    let meshes = [
        ([2, 2, 2], [3, 1, 3], 1.0),
        ([3, 1, 2], [2, 1, 5], 1.0),
        ([3, 2, 3], [4, 1, 2], 3.0),
        ([1, 1, 1], [3, 1, 2], 1.0),
    ];
    for (lower, upper, ratio) in meshes {
        for shape in ["standard", "dual"] {
            for slave_above in [true, false] {
                let stack =
                    Stack { lower, upper, grading: [ratio, 1.0, 1.0 / ratio], shape, slave_above, ..Stack::default() };
                let (axial, pressure) = uniaxial_strain(stack.moduli);
                let name = format!("{lower:?} under {upper:?} graded {ratio}, {shape}, slave above: {slave_above}");
                check(&name, &mut problem(&stack.text()), [1.0, 1.0], axial, pressure);
            }
        }
    }
}

/// By hand: under uniaxial strain, linear elastic bodies carry the same pressure M ε with
/// M = λ + 2μ; the strains of both add up to [`PRESSED`]. With fully integrated elements and with
/// B̄.
#[test]
fn linear_elastic_bodies_share_a_pressure() {
    let stack = Stack::default();
    let [lower, upper] = stack.moduli.map(|(e, nu)| e * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu)));
    let pressure = PRESSED / (1.0 / lower + 1.0 / upper);
    for element in ["full", "f_bar"] {
        let text = stack.text().replace("neo_hooke", "linear_elastic");
        let text = text.replace("[[body]]", &format!("[[body]]\nelement = \"{element}\""));
        let axial = [1.0 - pressure / lower, 1.0 - pressure / upper];
        check(&format!("linear elastic, {element}"), &mut problem(&text), [1.0, 1.0], axial, pressure);
    }
}

/// The same with tetrahedra on one side or on both.
#[test]
fn uniaxial_strain_passes_through_tetrahedra() {
    let all: Divide = |mesh| mesh.divided(|_| true);
    for (what, divided) in [
        ("tetrahedra under hexahedra", [Some(all), None]),
        ("hexahedra under tetrahedra", [None, Some(all)]),
        ("tetrahedra under tetrahedra", [Some(all); 2]),
    ] {
        for shape in ["standard", "dual"] {
            for slave_above in [true, false] {
                let stack = Stack { grading: [2.0, 1.0, 0.5], shape, slave_above, divided, ..Stack::default() };
                let (axial, pressure) = uniaxial_strain(stack.moduli);
                let name = format!("{what}, {shape}, slave above: {slave_above}");
                check(&name, &mut stack.problem(), [1.0, 1.0], axial, pressure);
            }
        }
    }
}

/// The same with wedges on one side or on both: standing on their triangles, lying on their
/// quadrilaterals, or next to tetrahedra in one body, with inner nodes moved.
#[test]
fn uniaxial_strain_passes_through_wedges() {
    let standing: Divide = |mesh| distorted(mesh.divided_into_wedges(|_| Some(1)));
    let lying: Divide = |mesh| distorted(mesh.divided_into_wedges(|_| Some(2)));
    // wedges along y above and below tetrahedra, with shared triangles
    let layers: Divide = |mesh| {
        let middle = |element: usize, mesh: &Mesh| (mesh.centroid(element)[1].fract() - 0.5).abs() < 0.2;
        let wedges = mesh.divided_into_wedges(|element| (!middle(element, mesh)).then_some(1));
        let layers = wedges.divided(|_| true);
        assert!(layers.divided_quadrilaterals(0).is_empty());
        distorted(layers)
    };
    for (what, divided) in [
        ("standing wedges under hexahedra", [Some(standing), None]),
        ("lying wedges under standing ones", [Some(lying), Some(standing)]),
        ("layers under lying wedges", [Some(layers), Some(lying)]),
        ("hexahedra under layers", [None, Some(layers)]),
    ] {
        for shape in ["standard", "dual"] {
            for slave_above in [true, false] {
                let (lower, upper) = ([2, 3, 2], [3, 3, 3]);
                let stack =
                    Stack { lower, upper, grading: [2.0, 1.0, 0.5], shape, slave_above, divided, ..Stack::default() };
                let (axial, pressure) = uniaxial_strain(stack.moduli);
                let name = format!("{what}, {shape}, slave above: {slave_above}");
                check(&name, &mut stack.problem(), [1.0, 1.0], axial, pressure);
            }
        }
    }
}

/// The same with quadratic elements on one side or on both: 27-node hexahedra and ten-node tetrahedra
/// against each other and against linear ones, with inner nodes moved, so that inner edges are curved.
#[test]
fn uniaxial_strain_passes_through_quadratic_elements() {
    let hexahedra: Divide = |mesh| distorted(mesh.second_order(mean).unwrap());
    let tetrahedra: Divide = |mesh| distorted(mesh.divided(|_| true).second_order(mean).unwrap());
    let linear: Divide = |mesh| mesh.divided(|_| true);
    for (what, divided) in [
        ("27-node under linear hexahedra", [Some(hexahedra), None]),
        ("linear under 27-node hexahedra", [None, Some(hexahedra)]),
        ("27-node hexahedra", [Some(hexahedra); 2]),
        ("ten-node tetrahedra", [Some(tetrahedra); 2]),
        ("ten-node under linear tetrahedra", [Some(tetrahedra), Some(linear)]),
        ("linear hexahedra under ten-node tetrahedra", [None, Some(tetrahedra)]),
        ("27-node hexahedra under ten-node tetrahedra", [Some(hexahedra), Some(tetrahedra)]),
    ] {
        // the second case: matching meshes
        for (lower, upper) in [([2, 1, 2], [3, 1, 2]), ([2, 1, 2], [2, 1, 2])] {
            for shape in ["standard", "dual"] {
                for slave_above in [true, false] {
                    let grading = if lower == upper { [1.0; 3] } else { [2.0, 1.0, 0.5] };
                    let stack = Stack { lower, upper, grading, shape, slave_above, divided, ..Stack::default() };
                    let (axial, pressure) = uniaxial_strain(stack.moduli);
                    let name = format!("{what}, {lower:?} under {upper:?}, {shape}, slave above: {slave_above}");
                    check(&name, &mut stack.problem(), [1.0, 1.0], axial, pressure);
                }
            }
        }
    }
}

/// The same with hexahedra of 20 nodes; slave faces keep their centres. With eight points only for parallelepipeds: these
/// do not integrate the forces of a uniform stress on curved elements exactly.
#[test]
fn uniaxial_strain_passes_through_hexahedra_of_20_nodes() {
    let curved: Divide = |mesh| distorted(mesh.second_order(mean).unwrap());
    let straight: Divide = |mesh| mesh.second_order(mean).unwrap();
    let full = "shape_functions = 'serendipity'";
    for (more, divide) in [(full, curved), ("shape_functions = 'serendipity'\nelement = 'reduced'", straight)] {
        for (upper, shape) in [([3, 1, 2], "standard"), ([3, 1, 2], "dual"), ([2, 1, 2], "standard")] {
            for slave_above in [true, false] {
                let (lower, grading, divided) = ([2, 1, 2], [2.0, 1.0, 0.5], [Some(divide); 2]);
                let grading = if upper == lower { [1.0; 3] } else { grading };
                let stack = Stack { lower, upper, grading, shape, slave_above, divided, more, ..Stack::default() };
                let (axial, pressure) = uniaxial_strain(stack.moduli);
                let name = format!("{more}, {upper:?}, {shape}, slave above: {slave_above}");
                check(&name, &mut stack.problem(), [1.0, 1.0], axial, pressure);
            }
        }
    }
}

/// The same with wedges of 18 and of 15 nodes, lying on their curved quadrilaterals or standing on triangles; inner
/// nodes are moved, but the edges of triangles stay straight, as three points in a triangle require.
#[test]
fn uniaxial_strain_passes_through_quadratic_wedges() {
    let standing: Divide = |mesh| distorted(mesh.divided_into_wedges(|_| Some(1))).second_order(mean).unwrap();
    let lying: Divide = |mesh| distorted(mesh.divided_into_wedges(|_| Some(2))).second_order(mean).unwrap();
    let hexahedra: Divide = |mesh| distorted(mesh.second_order(mean).unwrap());
    for (what, divided, more) in [
        ("lying wedges under standing ones", [Some(lying), Some(standing)], ""),
        ("standing wedges under hexahedra", [Some(standing), Some(hexahedra)], ""),
        ("linear hexahedra under lying wedges", [None, Some(lying)], ""),
        ("wedges of 15 nodes", [Some(lying), Some(standing)], "shape_functions = 'serendipity'"),
        ("wedges of 15 and 20", [Some(lying), Some(hexahedra)], "shape_functions = 'serendipity'"),
    ] {
        for shape in ["standard", "dual"] {
            for slave_above in [true, false] {
                let (lower, upper, grading) = ([2, 2, 2], [3, 2, 2], [2.0, 1.0, 0.5]);
                let stack = Stack { lower, upper, grading, shape, slave_above, divided, more, ..Stack::default() };
                let (axial, pressure) = uniaxial_strain(stack.moduli);
                let name = format!("{what}, {shape}, slave above: {slave_above}");
                check(&name, &mut stack.problem(), [1.0, 1.0], axial, pressure);
            }
        }
    }
}

pub(crate) fn mean(of: &[[f64; 3]]) -> [f64; 3] {
    std::array::from_fn(|c| of.iter().map(|x| x[c]).sum::<f64>() / of.len() as f64)
}

/// The mesh with its inner nodes moved by up to a tenth of an element.
pub(crate) fn distorted(mut mesh: Mesh) -> Mesh {
    let outer = mesh.boundary(0).nodes();
    for node in (0..mesh.nodes.len()).filter(|n| outer.binary_search(&(*n as u32)).is_err()) {
        for c in 0..3 {
            mesh.nodes[node][c] += 0.03 * ((7 * node + 5 * c) as f64 * 1.7).sin();
        }
    }
    assert!(mesh.check().is_empty(), "{:?}", mesh.check());
    mesh
}

/// One material with free sides: uniaxial stress, P_xx = P_zz = 0.
#[test]
fn uniaxial_stress_passes_through_with_free_sides() {
    let (e, nu) = LOWER;
    let axial = 1.0 - PRESSED / 2.0;
    let lateral = root(1.0, 1.5, |l| stress([e, nu], [l, axial, l])[0]);
    // per current area
    let pressure = -stress([e, nu], [lateral, axial, lateral])[1] / (lateral * lateral);
    for shape in ["standard", "dual"] {
        for slave_above in [true, false] {
            let stack = Stack { confined: false, moduli: [LOWER; 2], shape, slave_above, ..Stack::default() };
            let name = format!("free sides, {shape}, slave above: {slave_above}");
            check(&name, &mut problem(&stack.text()), [lateral; 2], [axial; 2], pressure);
        }
    }
}

/// The same case with the interface moved to the inclined plane y = 1 + 0.2 x − 0.1 z.
fn inclined(stack: &Stack) -> Problem {
    let case = parse_case(&stack.text(), "patch.toml").unwrap().case;
    let mut mesh = build_mesh(&case).unwrap();
    for node in &mut mesh.nodes {
        node[1] += (1.0 - (node[1] - 1.0).abs()) * (0.2 * node[0] - 0.1 * node[2]);
    }
    let mut problem = problem(&stack.text());
    let model = &problem.analysis.model();
    let materials =
        stack.moduli.iter().map(|&(e, nu)| slipstick_solid::NeoHooke::new(e, nu).unwrap()).collect::<Vec<_>>();
    let solid = slipstick_solid::SolidModel::new(&mesh, materials).unwrap();
    let parts = ModelParts {
        share: Share::whole(),
        solid,
        designed: vec![false; mesh.elements.len()],
        interpolation: slipstick_solid::Simp { penalization: 1.0, minimum: 0.0 }.into(),
        interfaces: model.interfaces().to_vec(),
        uzawa: model.uzawa(),
        prescribed: model.prescribed().clone(),
        loads: Loads::default(),
        bolts: Default::default(),
        springs: Springs::default(),
        temperatures: Temperatures::default(),
        viscosity: Viscosity::default(),
    };
    let density = vec![1.0; mesh.elements.len()];
    let model = ContactModel::new(&mesh, parts, &density, PRESSED);
    problem.analysis.design = Design::new(Arc::new(model), &density.into());
    problem.mesh = mesh;
    problem
}

/// An inclined interface that sticks, one material without lateral strain (ν = 0): a uniform state
/// with normal and tangential traction, equal to that of the Cauchy stress on the current plane.
#[test]
fn an_inclined_sticking_interface_passes_shear_too() {
    let moduli = [(1000.0, 0.0); 2];
    let axial = 1.0 - PRESSED / 2.0;
    let [lateral, py, _] = stress([1000.0, 0.0], [1.0, axial, 1.0]);
    assert_eq!(lateral, 0.0);
    let cauchy = Matrix3::from_diagonal(&Vector3::new(0.0, py, 0.0));
    let normal = Vector3::new(-0.2 * axial, 1.0, 0.1 * axial).normalize();
    for shape in ["standard", "dual"] {
        for slave_above in [true, false] {
            let stack = Stack { moduli, shape, slave_above, friction: 2.0, clamped: true, ..Stack::default() };
            let mut problem = inclined(&stack);
            let density = problem.initial_density().clone();
            let run = forward(&mut problem, &density);
            let last = run.path.states.last().unwrap().state.clone();
            let strain = check_uniform(&problem.mesh, &last.unknowns, [1.0; 2], [axial; 2]);
            // outward normal of the slave; z is minus the traction on the slave
            let outward = if slave_above { -normal } else { normal };
            let expected = -(cauchy * outward);
            let mut worst: f64 = 0.0;
            for node in contact_path(&mut problem, &run).pop().unwrap() {
                assert_eq!(node.status, ContactStatus::Stick);
                worst = worst.max((Vector3::from(node.global_multiplier) - expected).norm() / expected.norm());
            }
            println!("inclined, {shape}, slave above {slave_above}: F off by {strain:.1e}, traction by {worst:.1e}");
            assert!(strain < 1e-10 && worst < 1e-10, "{shape} {slave_above}: {strain:e} {worst:e}");
        }
    }
}

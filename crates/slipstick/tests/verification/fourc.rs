//! Tests of 4C.

use crate::chapter::Chapter;
use crate::common::abaqus::abaqus;
use crate::finding::Finding;
use crate::solved::{Scene, neo_hooke};
use serde::Deserialize;
use slipstick_mesh::{Body, Element, Facet, FacetNodes, Mesh, Surface};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Environment variable with the folder of the cases.
const FOLDER: &str = "SLIPSTICK_4C_CASES";

pub fn chapter() -> Chapter {
    Chapter {
        key: "fourc",
        title: "Tests of 4C",
        about: "
This chapter repeats six tests of [4C](https://github.com/4C-multiphysics/4C)
(`tests/input_files/contact3D_{lin_stdlagr, lin_duallagr, lin_uzawa, lin_penalty, tet4_hex8,
patch_linstatic}.dat`, at commit 76590c6 of the fork maxfirmbach/4C). In the first four, a block of
E = 2100 is pressed by 1 into one of E = 210 and dragged by (0.2, 0.2), without friction (129
hexahedra, neo-Hooke, 30 steps). 4C solves the dynamic problem, with a mass density so small that a
quasi-static run agrees to about 1e-3 of the prescribed 1. In the fifth, a block of 70 tetrahedra is
pressed by 1 into a plate of 49 hexahedra and dragged by (2, 2) over it with μ = 0.1, in 50 steps.
The sixth is a patch test of linear elasticity: blocks of 843 hexahedra with non-matching meshes,
pressed by a traction of a tenth of E. Here it is run with a millionth of the traction, and its
displacements are multiplied by a million; the remaining difference is the contribution of the
nonlinear theory. The expected values are the displacements of a slave node that 4C's own tests
assert.

The files are not part of slipstick. The suite reads them, converted to JSON, from the folder in
`SLIPSTICK_4C_CASES`; if the variable is not set, it skips the chapter and prints a message.",
        remarks: "
The variants differ from one another in the same way as in 4C. What remains is a fiftieth of the
effect that 4C's dynamics may have. In `contact3D_tet4_hex8`, 4C integrates with nine points on each
slave facet (`INTTYPE elements`), not on the segments where facets overlap, which may explain the
6e-4 of u_z.",
        quick: false,
        run,
    }
}

#[derive(Deserialize)]
struct Case {
    nodes: Vec<[f64; 3]>,
    elements: Vec<CaseElement>,
    dirichlet_dofs: Vec<(usize, usize, f64, usize)>,
    #[serde(default)]
    neumann_surface: Vec<Neumann>,
    functions: BTreeMap<usize, Function>,
    materials: BTreeMap<String, Material>,
    contact: Contact,
    time: Time,
    expected_results: Vec<Expected>,
}

#[derive(Deserialize)]
struct CaseElement {
    r#type: String,
    nodes: Vec<usize>,
    mat: String,
}

#[derive(Deserialize)]
struct Function {
    /// Waypoints, linear in between; none: the pseudo-time itself, which the sixth test uses for
    /// its load.
    #[serde(default)]
    times: Vec<f64>,
    #[serde(default)]
    values: Vec<f64>,
}

#[derive(Deserialize)]
#[allow(non_snake_case)]
struct Material {
    E: f64,
    nu: f64,
}

#[derive(Deserialize)]
struct Contact {
    surfaces: Vec<Side>,
    /// `false` or the name of the law.
    friction_active: serde_json::Value,
}

#[derive(Deserialize)]
struct Side {
    side: String,
    friction_coefficient: Option<f64>,
    faces: Vec<Face>,
}

#[derive(Deserialize)]
struct Face {
    elem: usize,
    nodes: Vec<usize>,
}

#[derive(Deserialize)]
struct Time {
    steps_performed: usize,
    t_end: f64,
}

/// A traction per reference area.
#[derive(Deserialize)]
struct Neumann {
    traction: [f64; 3],
    faces: Vec<Face>,
}

#[derive(Deserialize)]
struct Expected {
    node: usize,
    quantity: String,
    value: f64,
}

fn run() -> Option<Vec<Finding>> {
    let Some(folder) = std::env::var_os(FOLDER) else {
        println!("{FOLDER} is not set: no tests of 4C");
        return None;
    };
    let folder = PathBuf::from(folder);
    let mut findings = Vec::new();
    for (test, method) in [
        ("lin_stdlagr", "multiplier_shape = 'standard'"),
        ("lin_duallagr", "multiplier_shape = 'dual'"),
        ("lin_uzawa", "enforcement = { augmented = { stiffness = 20000 } }"),
        ("lin_penalty", "enforcement = { penalty = { stiffness = 20000 } }"),
        ("tet4_hex8", "multiplier_shape = 'standard'"),
    ] {
        for (what, expected, found) in solve(&folder.join(format!("contact3D_{test}.json")), method) {
            findings.push(Finding::value(format!("contact3D_{test}: {what}"), expected, 1e-3, found));
        }
    }
    let linear = solve(&folder.join("contact3D_patch_linstatic.json"), "multiplier_shape = 'dual'");
    for (what, expected, found) in linear {
        let (what, found) = (format!("contact3D_patch_linstatic: {what}"), found / PART);
        findings.push(if expected.abs() < 1e-12 {
            Finding::at_most(what, 1e-6, found)
        } else {
            Finding::value(what, expected, 1e-5, found)
        });
    }
    Some(findings)
}

/// Fraction of the tractions that is applied, so that the problem is practically linear.
const PART: f64 = 1e-6;

/// Expected and found displacements.
fn solve(file: &Path, method: &str) -> Vec<(String, f64, f64)> {
    let text = std::fs::read_to_string(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    let case: Case = serde_json::from_str(&text).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    let (scene, places) = convert(&case, method);
    let solved = scene.solve();
    let components = ["dispx", "dispy", "dispz"];
    let of = |expected: &Expected| {
        let (body, node) = &places[expected.node];
        let start = solved.problem.mesh.body(body).expect("a body").nodes.start;
        let component = components.iter().position(|c| *c == expected.quantity).expect("a displacement");
        let found = solved.displacement((start + node) as u32, solved.steps())[component];
        (format!("u_{}", ["x", "y", "z"][component]), expected.value, found)
    };
    case.expected_results.iter().map(of).collect()
}

/// The case as a scene, with one body per material and element type; for every node, its body and
/// its number there.
fn convert(case: &Case, method: &str) -> (Scene, Vec<(String, usize)>) {
    let mut scene = Scene::default();
    let mut places = vec![(String::new(), 0); case.nodes.len()];
    let mut dirichlet = String::new();
    let parts = parts(case);
    let mut bodies: Vec<Part<'_>> = parts.clone();
    bodies.sort_unstable();
    bodies.dedup();
    for part in bodies {
        let (name, law) = (body_name(part), &case.materials[part.0]);
        let mut mesh = Mesh::default();
        let mut number: Vec<Option<u32>> = vec![None; case.nodes.len()];
        let mut elements = vec![usize::MAX; case.elements.len()];
        for (e, element) in case.elements.iter().enumerate().filter(|(e, _)| parts[*e] == part) {
            let nodes: Vec<u32> = element
                .nodes
                .iter()
                .map(|&n| {
                    *number[n].get_or_insert_with(|| {
                        mesh.nodes.push(case.nodes[n]);
                        places[n] = (name.clone(), mesh.nodes.len() - 1);
                        mesh.nodes.len() as u32 - 1
                    })
                })
                .collect();
            elements[e] = mesh.elements.len();
            mesh.elements.push(match part.1 {
                "TET4" => Element::Tet4(nodes.try_into().expect("four nodes")),
                _ => Element::Hex8(nodes.try_into().expect("eight nodes")),
            });
        }
        mesh.bodies = vec![Body { name: name.clone(), elements: 0..mesh.elements.len(), nodes: 0..mesh.nodes.len() }];
        let mut name_surface = |surface_name: &str, faces: &[Face]| {
            let of_body = faces.iter().filter(|face| elements[face.elem] != usize::MAX);
            let facets: Vec<Facet> = of_body
                .map(|face| Facet { nodes: facet_nodes(face, &number), element: elements[face.elem] as u32 })
                .collect();
            if facets.is_empty() {
                return false;
            }
            assert!(facets.iter().all(|f| is_face(&mesh, f)));
            mesh.surfaces.insert(surface_name.to_owned(), Surface { facets });
            true
        };
        for side in &case.contact.surfaces {
            name_surface(&side.side, &side.faces);
        }
        for (k, load) in case.neumann_surface.iter().enumerate() {
            if name_surface(&format!("load{k}"), &load.faces) {
                let traction = load.traction.map(|t| t * PART);
                let _ = writeln!(dirichlet, "[[load]]\nsurface = '{name}_load{k}'\ntraction = {traction:?}");
            }
        }
        supports(case, &name, &number, &mut mesh, &mut dirichlet);
        scene.files.insert(format!("{name}.inp"), abaqus(&mesh));
        scene.text +=
            &format!("[[body]]\nname = '{name}'\nmesh = {{ file = '{name}.inp' }}\n{}\n", neo_hooke(law.E, law.nu));
    }
    let on = |side: &str| {
        let first = case.contact.surfaces.iter().find(|s| s.side == side).expect("both sides");
        (format!("{}_{side}", body_name(parts[first.faces[0].elem])), first.friction_coefficient.unwrap_or(0.0))
    };
    let ((slave, coefficient), (master, _)) = (on("slave"), on("master"));
    let friction = if case.contact.friction_active == serde_json::Value::Bool(false) { 0.0 } else { coefficient };
    scene.text += &format!(
        "[[contact]]\nslave = '{slave}'\nmaster = '{master}'\nfriction = {friction:?}\n{method}\n{dirichlet}[load_path]\nsteps = {}\n",
        case.time.steps_performed
    );
    (scene, places)
}

fn is_face(mesh: &Mesh, facet: &Facet) -> bool {
    let element = &mesh.elements[facet.element as usize];
    (0..element.sides()).any(|side| element.side(side).sorted() == facet.nodes.sorted())
}

/// Material, type of element, and a node of the connected part.
type Part<'a> = (&'a str, &'a str, usize);

/// Material, element type and connected part of each element.
fn parts(case: &Case) -> Vec<Part<'_>> {
    let mut parent: Vec<usize> = (0..case.nodes.len()).collect();
    let root = |parent: &[usize], mut node: usize| {
        while parent[node] != node {
            node = parent[node];
        }
        node
    };
    for element in &case.elements {
        for &node in &element.nodes {
            let (a, b) = (root(&parent, node), root(&parent, element.nodes[0]));
            parent[a.max(b)] = a.min(b);
        }
    }
    case.elements.iter().map(|e| (&e.mat[..], &e.r#type[..], root(&parent, e.nodes[0]))).collect()
}

fn body_name((material, kind, node): Part<'_>) -> String {
    format!("mat{material}_{kind}_{node}")
}

fn facet_nodes(face: &Face, number: &[Option<u32>]) -> FacetNodes {
    let nodes: Vec<u32> = face.nodes.iter().map(|&n| number[n].expect("a node of the body")).collect();
    FacetNodes::new(&nodes).expect("three or four nodes")
}

/// Node sets with the same prescribed displacements, and their tables.
fn supports(case: &Case, body: &str, number: &[Option<u32>], mesh: &mut Mesh, dirichlet: &mut String) {
    // per node: component, factor's bits, function
    let mut of_node: BTreeMap<usize, Vec<(usize, u64, usize)>> = BTreeMap::new();
    for &(node, component, factor, function) in case.dirichlet_dofs.iter().filter(|dof| number[dof.0].is_some()) {
        of_node.entry(node).or_default().push((component, factor.to_bits(), function));
    }
    let mut groups: BTreeMap<Vec<(usize, u64, usize)>, Vec<u32>> = BTreeMap::new();
    for (node, mut dofs) in of_node {
        dofs.sort_unstable();
        groups.entry(dofs).or_default().extend(number[node]);
    }
    for (k, (dofs, nodes)) in groups.into_iter().enumerate() {
        mesh.node_sets.insert(format!("held{k}"), nodes);
        let components: Vec<&str> = dofs.iter().map(|d| ["x", "y", "z"][d.0]).collect();
        let _ = writeln!(dirichlet, "[[dirichlet]]\nset = '{body}_held{k}'\ncomponents = {components:?}");
        let moving: Vec<_> = dofs.iter().filter(|d| f64::from_bits(d.1) != 0.0).collect();
        if moving.is_empty() {
            continue;
        }
        let end = case.time.t_end;
        let mut knots: Vec<f64> = moving.iter().flat_map(|d| &case.functions[&d.2].times).copied().collect();
        knots.retain(|&t| t > 0.0 && t < end - 1e-12);
        knots.push(end);
        knots.sort_by(f64::total_cmp);
        knots.dedup();
        let point = |&t: &f64| {
            let mut u = [0.0; 3];
            moving.iter().for_each(|d| u[d.0] = f64::from_bits(d.1) * interpolate(&case.functions[&d.2], t));
            format!("{{ t = {:?}, u = {u:?} }}", if t == end { 1.0 } else { t / end })
        };
        let points: Vec<String> = knots.iter().map(point).collect();
        let _ = writeln!(dirichlet, "motion = [{}]", points.join(", "));
    }
}

fn interpolate(function: &Function, t: f64) -> f64 {
    let next = function.times.iter().position(|&knot| knot >= t - 1e-12).expect("a time of the function");
    if next == 0 {
        return function.values[0];
    }
    let (a, b) = (function.times[next - 1], function.times[next]);
    let s = (t - a) / (b - a);
    function.values[next - 1] + s * (function.values[next] - function.values[next - 1])
}

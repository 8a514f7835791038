//! Checks whether each body is connected.

use super::bodies::held_motions;
use super::{Notice, NoticeKind};
use crate::file::{Case, Shape};
use slipstick_mesh::Mesh;
use slipstick_model::words::counted;
use std::borrow::Cow;

/// Nodes closer to each other than this fraction of the body's size were meant to be the same node:
/// mesh files have at least single precision, and no element is that small.
const COINCIDENT: f64 = 1e-6;

/// A notice for each body that has unconnected parts, coincident nodes, or elements that do not
/// conform. Generators merge their nodes and make only hexahedra, so only mesh files are checked.
pub(super) fn notices(case: &Case, mesh: &Mesh, fixed: &[bool]) -> Vec<Notice> {
    // the parts of a cut body are joined
    let mesh = &if mesh.cuts.is_empty() { Cow::Borrowed(mesh) } else { Cow::Owned(mesh.joined()) };
    let bodies = case.bodies.iter().enumerate().filter(|(_, body)| matches!(body.shape, Shape::Mesh(_)));
    let promised = !case.promises.is_empty();
    let of_body = |b: usize| {
        let pairs = unmerged_nodes(mesh, b);
        [separate_parts(mesh, b, fixed, pairs.is_some(), promised), pairs, divided_faces(mesh, b)]
    };
    bodies.flat_map(|(b, _)| of_body(b)).flatten().collect()
}

fn notice(body: usize, message: String, help: &str) -> Notice {
    Notice { kind: NoticeKind::Disconnected, path: format!("body[{body}].mesh.file"), message, help: help.into() }
}

/// `touching`: whether the body has coincident nodes; `promised`: whether it comes from a design.
fn separate_parts(mesh: &Mesh, body: usize, fixed: &[bool], touching: bool, promised: bool) -> Option<Notice> {
    let copies = mesh.copies();
    let mut parts = mesh.connected_parts(body);
    parts.retain(|part| !copies.contains_key(&part[0]));
    if parts.len() < 2 {
        return None;
    }
    let loose = |part: &&Vec<u32>| held_motions(mesh, part.iter().map(|&node| node as usize), fixed) < 6;
    let free: Vec<&Vec<u32>> = parts.iter().filter(loose).collect();
    let free_ones = match free[..] {
        [] => "each part is supported".into(),
        [first, ..] => format!(
            "supports do not hold {} of them, for instance the one at {}; contact, ties or springs may",
            free.len(),
            place(mesh, first[0])
        ),
    };
    let message =
        format!("body `{}` consists of {} parts that share no nodes; {free_ones}", mesh.bodies[body].name, parts.len());
    let help = match (touching, promised) {
        (true, _) => {
            "merge the coincident nodes in the mesher (Gmsh: Coherence Mesh), or make each part a body, from a group of its \
             own (Gmsh: a physical volume; Abaqus, CalculiX: an ELSET)"
        }
        (false, true) => {
            "the design consists of these pieces: a lower --threshold of `export --case`, or a sharper `projection` in the \
             design's case, connects them if material below the threshold does"
        }
        (false, false) => {
            "the parts lie apart: join them in the geometry, or make each part a body, from a group of its own (Gmsh: a \
             physical volume; Abaqus, CalculiX: an ELSET), unless contact, a tie, a spring or a support holds each"
        }
    };
    Some(notice(body, message, help))
}

fn unmerged_nodes(mesh: &Mesh, body: usize) -> Option<Notice> {
    let nodes = &mesh.nodes[mesh.bodies[body].nodes.clone()];
    let extent = |c: usize| {
        let (low, high) = nodes.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x[c]), h.max(x[c])));
        high - low
    };
    let size = (0..3).map(|c| extent(c).powi(2)).sum::<f64>().sqrt();
    let copies = mesh.copies();
    let mut pairs = mesh.coincident_nodes(body, COINCIDENT * size);
    pairs.retain(|pair| pair.iter().all(|node| !copies.contains_key(node)));
    let [a, b] = *pairs.first()?;
    let message = format!(
        "body `{}` has {} of coincident nodes, for instance {a} and {b} at {}: elements are not connected there",
        mesh.bodies[body].name,
        counted(pairs.len(), "pair"),
        place(mesh, a)
    );
    Some(notice(body, message, "merge them in the mesher (Gmsh: Coherence Mesh), unless a slit is intended"))
}

fn divided_faces(mesh: &Mesh, body: usize) -> Option<Notice> {
    let divided = mesh.divided_quadrilaterals(body);
    let [whole, ..] = divided.first()?;
    let message = format!(
        "body `{}` has {} that meet two triangles, for instance at {}: the two sides distribute forces differently \
         over the nodes, so stresses are inaccurate there",
        mesh.bodies[body].name,
        counted(divided.len(), "quadrilateral face"),
        place(mesh, whole[0])
    );
    let help = "acceptable where stresses are low; otherwise mesh both parts alike, or make them two bodies in contact";
    Some(Notice { kind: NoticeKind::Divided, ..notice(body, message, help) })
}

fn place(mesh: &Mesh, node: u32) -> String {
    let [x, y, z] = mesh.nodes[node as usize];
    format!("({x:.4}, {y:.4}, {z:.4})")
}

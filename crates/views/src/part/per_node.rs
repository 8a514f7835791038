//! Forces, springs and equations that a case gives for each node of a set: the mesh of a part has other nodes there.

use slipstick_case::file::{Case, LoadKind, SpringStiffness};
use slipstick_mesh::Mesh;

use super::{PartBody, PartError, on_body};

/// A force or stiffness on each node of a surface or set of a remeshed body.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PerNode {
    /// The surface or set.
    pub name: String,
    /// What acts on it, for example "a load".
    pub used: String,
    /// Number of its nodes in the design; if it is `None`, the part's case still gives a value for each node, since the
    /// nodes do not make up faces. Otherwise, it gives the sum.
    pub summed: Option<usize>,
}

/// Replaces values for each node of faces by their sums, which are spread over the faces. `selects_one` says whether the
/// part has a single node in a set, as the design does.
///
/// # Errors
/// [`PartError::NodeToNode`] if an equation relates each node of a face to its counterpart.
pub(super) fn summed(
    part: &mut Case,
    mesh: &Mesh,
    bodies: &[PartBody],
    selects_one: impl Fn(&str) -> bool,
) -> Result<Vec<PerNode>, PartError> {
    let remeshed = |name: &str| {
        let number = |body: &PartBody| mesh.bodies.iter().position(|other| other.name == body.name);
        bodies.iter().filter_map(number).any(|body| on_body(mesh, name, body))
    };
    let count = |name: &str| mesh.set_nodes(name).map_or(0, |nodes| nodes.len());
    // the faces of a set, by their name in the mesh file
    let surface = |name: &str| {
        if mesh.surfaces.contains_key(name) {
            return Some(name.to_owned());
        }
        let faces = bodies.iter().flat_map(|body| &body.faces);
        faces.filter(|face| face.name == name && !face.patches.is_empty()).find_map(|face| face.group.clone())
    };
    let mut all = Vec::new();
    let mut sum = |name: &mut String, used: String| -> Option<f64> {
        if !remeshed(name) || selects_one(name) {
            return None;
        }
        let nodes = count(name);
        let of = surface(name);
        all.push(PerNode { name: name.clone(), used, summed: of.is_some().then_some(nodes) });
        *name = of?;
        Some(nodes as f64)
    };
    for load in &mut part.loads {
        if let LoadKind::NodalForce(force) = load.kind
            && let Some(nodes) = sum(&mut load.surface, "a load".into())
        {
            load.kind = LoadKind::Force(force.map(|f| nodes * f));
        }
    }
    for spring in &mut part.springs {
        if let SpringStiffness::NodalStiffness(stiffness) = spring.stiffness
            && let Some(nodes) = sum(&mut spring.set, format!("the spring `{}`", spring.name))
        {
            spring.stiffness = SpringStiffness::Stiffness(nodes * stiffness);
        }
    }
    for equation in &part.equations {
        let each: Vec<&String> =
            equation.terms.iter().filter(|term| !term.mean && count(&term.set) > 1).map(|term| &term.set).collect();
        let other = each.iter().copied().find(|&set| set != each[0]);
        if let Some(other) = other.filter(|other| remeshed(each[0]) || remeshed(other)) {
            return Err(PartError::NodeToNode { names: [each[0].clone(), other.clone()] });
        }
    }
    Ok(all)
}

//! From the springs of a case to those between nodes.

use super::select::nodes_of;
use super::{BuildError, surface_of};
use crate::file::{self, Case, SpringDirection, SpringEnd, SpringStiffness};
use slipstick_mesh::Mesh;
use slipstick_model::model::Springs;
use slipstick_solid::load::nodal_areas;
use slipstick_solid::spring::{Acts, Spring};

pub(super) fn build_springs(case: &Case, mesh: &Mesh, coordinates: &[f64]) -> Result<Springs, BuildError> {
    let mut springs = Springs::default();
    for (i, spring) in case.springs.iter().enumerate() {
        springs.add(&spring.name, of(spring, mesh, coordinates, &format!("spring[{i}]"))?);
    }
    Ok(springs)
}

/// The springs between nodes of each `[[spring]]` of a case; `mesh` is that of the case.
///
/// # Errors
/// [`BuildError`] at a spring whose ends do not exist or coincide.
pub fn springs_of(case: &Case, mesh: &Mesh) -> Result<Vec<Vec<Spring>>, BuildError> {
    let of = |(i, spring)| of(spring, mesh, mesh.nodes.as_flattened(), &format!("spring[{i}]"));
    case.springs.iter().enumerate().map(of).collect()
}

fn of(spring: &file::Spring, mesh: &Mesh, coordinates: &[f64], path: &str) -> Result<Vec<Spring>, BuildError> {
    let first = ends(mesh, &spring.set, &format!("{path}.set"))?;
    let second = match &spring.to {
        Some(SpringEnd::Set(to)) => Some(ends(mesh, to, &format!("{path}.to"))?),
        Some(SpringEnd::Point(_)) | None => None,
    };
    let mut all = Vec::with_capacity(first.len());
    for (node, stiffness) in stiffnesses(spring, mesh, &first, coordinates, path)? {
        let to = second.as_ref().map(|second| nearest(mesh, node, second));
        if to == Some(node) {
            let message = format!("node {node} belongs to both ends of the spring");
            return Err(BuildError::new(format!("{path}.to"), message, "name two sets without common nodes"));
        }
        let acts = match (spring.direction, to) {
            (Some(SpringDirection::Fixed(direction)), _) => Acts::Along(unit(direction)),
            (Some(SpringDirection::Word(_)), _) => {
                let from = match (&spring.to, to) {
                    (Some(SpringEnd::Point(point)), _) => *point,
                    (_, Some(to)) => mesh.nodes[to as usize],
                    (_, None) => mesh.nodes[node as usize],
                };
                let r = std::array::from_fn(|c| mesh.nodes[node as usize][c] - from[c]);
                if r == [0.0; 3] {
                    let message = format!("both ends of the spring at node {node} are at {from:?}: no line joins them");
                    let help = "give a direction [x, y, z], or omit the key for all directions";
                    return Err(BuildError::new(format!("{path}.direction"), message, help));
                }
                Acts::Line(r)
            }
            (None, _) => Acts::Everywhere,
        };
        all.push(Spring { node, to, stiffness, acts });
    }
    Ok(all)
}

/// The nodes of a set, or the reference point of a rigid body.
fn ends(mesh: &Mesh, set: &str, path: &str) -> Result<Vec<u32>, BuildError> {
    match mesh.rigid.iter().find(|rigid| mesh.bodies[rigid.body].name == set) {
        Some(rigid) => Ok(vec![rigid.reference]),
        None => nodes_of(mesh, set, path),
    }
}

/// The nodes at first ends, each with its stiffness; without those that have no area.
fn stiffnesses(
    spring: &file::Spring,
    mesh: &Mesh,
    nodes: &[u32],
    coordinates: &[f64],
    path: &str,
) -> Result<Vec<(u32, f64)>, BuildError> {
    let areas = |mesh: &Mesh| -> Result<Vec<(u32, f64)>, BuildError> {
        let surface = surface_of(mesh, &spring.set, &format!("{path}.set"))?;
        Ok(nodal_areas(&mesh.faces_of_surface(surface), coordinates))
    };
    let mut weighted = match spring.stiffness {
        SpringStiffness::NodalStiffness(k) => nodes.iter().map(|&node| (node, k)).collect(),
        SpringStiffness::StiffnessPerArea(k) => areas(mesh)?.into_iter().map(|(node, area)| (node, k * area)).collect(),
        SpringStiffness::Stiffness(k) if mesh.surfaces.contains_key(&spring.set) => {
            let areas = areas(mesh)?;
            let area: f64 = areas.iter().map(|(_, area)| area).sum();
            areas.into_iter().map(|(node, own)| (node, k * own / area)).collect::<Vec<_>>()
        }
        SpringStiffness::Stiffness(k) => nodes.iter().map(|&node| (node, k / nodes.len() as f64)).collect(),
    };
    // the corners of quadratic triangles have no area, up to round-off
    let largest = weighted.iter().map(|(_, k)| k.abs()).fold(0.0, f64::max);
    weighted.retain(|(_, k)| *k > 1e-12 * largest);
    Ok(weighted)
}

/// The node nearest to a node in the mesh; the first one of several.
fn nearest(mesh: &Mesh, node: u32, others: &[u32]) -> u32 {
    let distance = |other: u32| -> f64 {
        let [a, b] = [node, other].map(|node| mesh.nodes[node as usize]);
        (0..3).map(|c| (a[c] - b[c]).powi(2)).sum()
    };
    others.iter().copied().min_by(|&a, &b| distance(a).total_cmp(&distance(b))).expect("sets have nodes")
}

fn unit(direction: [f64; 3]) -> [f64; 3] {
    let length = direction[0].hypot(direction[1]).hypot(direction[2]);
    direction.map(|x| x / length)
}

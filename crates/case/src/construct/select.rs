//! The surfaces and node sets that a case selects by position and direction.

use std::collections::HashMap;

use super::BuildError;
use super::regions::to_facet;
use crate::file::{self, CaseCode};
use nalgebra::Vector3;
use slipstick_mesh::{self as mesh, Mesh, Surface};

/// The nodes of a set or surface; `path` is where the case names it.
pub(super) fn nodes_of(mesh: &Mesh, name: &str, path: &str) -> Result<Vec<u32>, BuildError> {
    mesh.set_nodes(name).map(|n| n.into_owned()).ok_or_else(|| {
        let known = mesh.names().join(", ");
        BuildError::new(path, format!("there is no set or surface `{name}`"), format!("known names: {known}"))
            .with_code(CaseCode::UnknownSet)
    })
}

/// The same nodes, none of which belongs to a rigid body; `help` says what to do with the one that is named.
pub(super) fn deformable_nodes(
    mesh: &Mesh,
    set: &str,
    path: &str,
    help: impl Fn(&str) -> String,
) -> Result<Vec<u32>, BuildError> {
    let nodes = nodes_of(mesh, set, path)?;
    let of_rigid =
        |rigid: &&mesh::Rigid| nodes.iter().any(|&node| mesh.bodies[rigid.body].nodes.contains(&(node as usize)));
    let Some(rigid) = mesh.rigid.iter().find(of_rigid) else { return Ok(nodes) };
    let body = &mesh.bodies[rigid.body].name;
    let message = format!("`{set}` has nodes of the rigid body `{body}`, which moves as a whole");
    Err(BuildError::new(path, message, help(body)))
}

/// Boundary facets of a body that meet all conditions of a surface.
pub(super) fn select_facets(mesh: &Mesh, surface: &file::SurfaceSet, path: &str) -> Result<Surface, BuildError> {
    let Some(name) = &surface.body else { return union(mesh, &surface.of, path) };
    let body = mesh.bodies.iter().position(|body| body.name == *name).ok_or_else(|| {
        BuildError::new(format!("{path}.body"), format!("there is no body `{name}`"), "name one of the case")
    })?;
    let considered = match &surface.within {
        None => mesh.boundary(body),
        Some(within) => mesh.surfaces.get(within).cloned().ok_or_else(|| {
            let message = format!("there is no surface `{within}`");
            BuildError::new(format!("{path}.within"), message, "name a surface of the body")
                .with_code(CaseCode::UnknownSet)
        })?,
    };
    let selected = facets_that_meet(mesh, considered, surface);
    if selected.facets.is_empty() {
        let message = format!("no facet of `{name}` fits surface `{}`", surface.name);
        let help = "facets lie in a box, cylinder or sphere with all their nodes, at positions after placement; widen \
                    the conditions";
        return Err(BuildError::new(path, message, help));
    }
    Ok(selected)
}

/// The facets that meet all conditions of a surface, except `within`.
pub(super) fn facets_that_meet(mesh: &Mesh, mut selected: Surface, surface: &file::SurfaceSet) -> Surface {
    let inside =
        |nodes: &[u32], region: &file::BoxRegion| nodes.iter().all(|&node| region.contains(mesh.nodes[node as usize]));
    let near = |facet: &mesh::Facet, cone: &file::NormalCone| {
        let area = mesh::facet_area_vector(&mesh.facet_coordinates(facet));
        angle(area, cone.direction) <= cone.degrees
    };
    let all = |facet: &mesh::Facet, has: &dyn Fn([f64; 3]) -> bool| {
        facet.nodes.iter().all(|&node| has(mesh.nodes[node as usize]))
    };
    selected.facets.retain(|facet| {
        (surface.boxes.is_empty() || surface.boxes.iter().any(|region| inside(&facet.nodes, region)))
            && surface.normal.as_ref().is_none_or(|cone| near(facet, cone))
            && surface.cylinder.is_none_or(|c| all(facet, &|x| c.contains(x)) && on_mantle(mesh, facet, &c))
            && surface.sphere.is_none_or(|sphere| all(facet, &|x| sphere.contains(x)))
    });
    if let Some(file::Connected { to, degrees }) = surface.connected {
        selected.facets = smooth_face(mesh, selected.facets, to, degrees);
    }
    mesh.whole_faces(selected)
}

/// Whether a facet with all nodes on the mantle of a cylinder is part of it, and not of an end face:
/// its normal is at least 45° from the axis.
fn on_mantle(mesh: &Mesh, facet: &mesh::Facet, cylinder: &file::Cylinder) -> bool {
    let angle = angle(mesh::facet_area_vector(&mesh.facet_coordinates(facet)), cylinder.axis().into());
    cylinder.tolerance.is_none() || angle.min(180.0 - angle) >= 45.0
}

/// The facet nearest to a point, and all that are connected to it across edges at which the normals
/// of both facets differ by at most `degrees`.
pub(super) fn smooth_face(mesh: &Mesh, facets: Vec<mesh::Facet>, to: [f64; 3], degrees: f64) -> Vec<mesh::Facet> {
    let at = |node: u32| Vector3::from(mesh.nodes[node as usize]);
    let distances = facets.iter().map(|facet| to_facet(&to.into(), &facet.nodes, at));
    let Some((first, _)) = distances.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)) else { return facets };
    let edges = |facet: &mesh::Facet| {
        let nodes = facet.nodes.to_vec();
        let edge = |k: usize| [nodes[k], nodes[(k + 1) % nodes.len()]];
        (0..nodes.len()).map(edge).map(|[a, b]| [a.min(b), a.max(b)]).collect::<Vec<_>>()
    };
    let mut at_edge: HashMap<[u32; 2], Vec<usize>> = HashMap::new();
    for (number, facet) in facets.iter().enumerate() {
        edges(facet).into_iter().for_each(|edge| at_edge.entry(edge).or_default().push(number));
    }
    let areas: Vec<_> = facets.iter().map(|facet| mesh::facet_area_vector(&mesh.facet_coordinates(facet))).collect();
    let mut reached = vec![false; facets.len()];
    reached[first] = true;
    let mut open = vec![first];
    while let Some(number) = open.pop() {
        for other in edges(&facets[number]).iter().flat_map(|edge| &at_edge[edge]) {
            if !reached[*other] && angle(areas[number], areas[*other]) <= degrees {
                reached[*other] = true;
                open.push(*other);
            }
        }
    }
    facets.into_iter().zip(reached).filter_map(|(facet, reached)| reached.then_some(facet)).collect()
}

/// The facets of several surfaces, each once.
fn union(mesh: &Mesh, of: &[String], path: &str) -> Result<Surface, BuildError> {
    let mut all = Surface { facets: Vec::new() };
    for (i, name) in of.iter().enumerate() {
        let part = mesh.surfaces.get(name).ok_or_else(|| {
            BuildError::new(
                format!("{path}.of[{i}]"),
                format!("there is no surface `{name}`"),
                "name surfaces of the case",
            )
            .with_code(CaseCode::UnknownSet)
        })?;
        let new = part.facets.iter().filter(|facet| !all.facets.contains(facet));
        let new: Vec<mesh::Facet> = new.cloned().collect();
        all.facets.extend(new);
    }
    Ok(all)
}

/// Angle between two directions, in degrees.
pub(super) fn angle(a: [f64; 3], b: [f64; 3]) -> f64 {
    let (a, b) = (Vector3::from(a), Vector3::from(b));
    a.cross(&b).norm().atan2(a.dot(&b)).to_degrees()
}

/// Nodes that meet all conditions of a set, ascending.
pub(super) fn select_nodes(mesh: &Mesh, set: &file::NodeSet, path: &str) -> Result<Vec<u32>, BuildError> {
    let mut selected: Vec<u32> = match &set.within {
        Some(name) => nodes_of(mesh, name, &format!("{path}.within"))?,
        None => (0..mesh.nodes.len() as u32).collect(),
    };
    if let Some(name) = &set.body {
        let body = mesh.body(name).ok_or_else(|| {
            BuildError::new(format!("{path}.body"), format!("there is no body `{name}`"), "name one of the case")
        })?;
        selected.retain(|&node| body.nodes.contains(&(node as usize)));
    }
    let empty = |key: &str, what: &str| {
        let message = format!("no node lies {what} of set `{}`", set.name);
        let help = "widen the conditions; a node must satisfy all of them at its reference position after placement";
        BuildError::new(format!("{path}.{key}"), message, help)
    };
    if !set.boxes.is_empty() {
        selected.retain(|&node| set.boxes.iter().any(|region| region.contains(mesh.nodes[node as usize])));
        if selected.is_empty() {
            return Err(empty("boxes", "in the boxes"));
        }
    }
    if let Some(plane) = set.plane {
        let tolerance = plane.tolerance.unwrap_or_else(|| default_tolerance(mesh));
        let found = mesh.nodes_on_plane(plane.point, plane.normal, tolerance, Some(&selected));
        selected = found.map_err(|e| BuildError::new(format!("{path}.plane"), e, "correct the plane"))?;
        if selected.is_empty() {
            return Err(empty("plane", &format!("within {tolerance:.3e} of the plane")));
        }
    }
    if let Some(cylinder) = set.cylinder {
        selected = match cylinder {
            file::Cylinder { start, end, radius, tolerance: None } => mesh
                .nodes_in_cylinder(start, end, radius, Some(&selected))
                .map_err(|e| BuildError::new(format!("{path}.cylinder"), e, "correct the cylinder"))?,
            mantle => selected.into_iter().filter(|&node| mantle.contains(mesh.nodes[node as usize])).collect(),
        };
        if selected.is_empty() {
            return Err(empty("cylinder", "in the cylinder"));
        }
    }
    if let Some(point) = set.nearest {
        selected = mesh.nearest_node(point, Some(&selected)).into_iter().collect();
    }
    match selected.is_empty() {
        true if set.nearest.is_none() => Err(empty("body", "in this body and the other set")),
        true => Err(empty("nearest", "near the point")),
        false => Ok(selected),
    }
}

/// A millionth of the size of all bodies: above the round-off of mesh files, below any
/// element. \[L\]
pub(super) fn default_tolerance(mesh: &Mesh) -> f64 {
    mesh.bounding_box().map_or(0.0, |(min, max)| 1e-6 * (0..3).map(|c| (max[c] - min[c]).powi(2)).sum::<f64>().sqrt())
}

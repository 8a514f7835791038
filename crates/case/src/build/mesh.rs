//! The mesh of a case: its bodies after placement, with the surfaces and node sets that the case
//! selects.

use super::{BuildError, ties};
use crate::case::{self, Case};
use slipstick_mesh::{self as mesh, Mesh, Surface};
use slipstick_model::words::counted;

/// The mesh of a case: all bodies after placement, with the case's surfaces and node sets.
///
/// # Errors
/// [`BuildError`] at the body, surface or set.
pub fn build_mesh(case: &Case) -> Result<Mesh, BuildError> {
    Ok(mesh_with_ties(case)?.0)
}

/// The same, with the mortar rows of each tied pair, [`ties::close`].
pub(super) fn mesh_with_ties(case: &Case) -> Result<(Mesh, ties::Rows), BuildError> {
    let mut mesh = open_mesh(case)?;
    let ties = ties::close(case, &mut mesh)?;
    Ok((mesh, ties))
}

/// The mesh before slave nodes of ties are moved onto their masters.
pub(super) fn open_mesh(case: &Case) -> Result<Mesh, BuildError> {
    let mut parts = Vec::with_capacity(case.bodies.len());
    for (b, body) in case.bodies.iter().enumerate() {
        let path = format!("body[{b}].{}", body.shape.key());
        let fail = |e: mesh::MeshError| BuildError::new(&path, e, "change the shape or its element counts");
        let mut part = generate(body).map_err(fail)?;
        if body.order == 2 && !part.has_second_order() {
            part = part.second_order(|of| middle(&body.shape, of)).map_err(fail)?;
        }
        let rotate = body.place.rotate.map(|r| mesh::Rotation { axis: r.axis, degrees: r.degrees });
        part.transform(&mesh::Placement { rotate, translate: body.place.translate }).map_err(|e| {
            BuildError::new(format!("body[{b}].place"), e, "give finite numbers and an axis that is not zero")
        })?;
        parts.push(part);
    }
    let mut all = Mesh::merge(parts)
        .map_err(|e| BuildError::new("body", e, "rename one of the bodies, or the sets of their mesh files"))?;
    for (s, surface) in case.surfaces.iter().enumerate() {
        let selected = select_facets(&all, surface, &format!("surface[{s}]"))?;
        all.surfaces.insert(surface.name.clone(), selected);
    }
    for (s, set) in case.sets.iter().enumerate() {
        let selected = select_nodes(&all, set, &format!("set[{s}]"))?;
        all.node_sets.insert(set.name.clone(), selected);
    }
    let defects = all.check();
    if let Some(first) = defects.first() {
        let message = format!(
            "{first}{}",
            if defects.len() > 1 {
                format!(" (and {})", counted(defects.len() - 1, "more defect"))
            } else {
                String::new()
            }
        );
        return Err(BuildError::new("body", message, "check shape, element counts, mesh file and placement"));
    }
    for (b, rigid) in case.bodies.iter().enumerate().filter_map(|(b, body)| Some((b, body.rigid?))) {
        let nodes = all.nodes[all.bodies[b].nodes.clone()].iter();
        let middle = |c: usize| {
            let (low, high) = nodes
                .clone()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x[c]), high.max(x[c])));
            0.5 * (low + high)
        };
        let reference = rigid.reference.unwrap_or_else(|| std::array::from_fn(middle));
        all.make_rigid(b, reference);
    }
    Ok(all)
}

fn generate(body: &case::Body) -> Result<Mesh, mesh::MeshError> {
    match body.shape {
        case::Shape::Box { min, max, elements, grading } => {
            mesh::box_mesh(&body.name, &mesh::BoxShape { min, max, elements, grading })
        }
        case::Shape::HalfBall { radius, elements } => {
            mesh::half_ball(&body.name, &mesh::HalfBallShape { radius, elements })
        }
        case::Shape::HollowCylinder { inner_radius, outer_radius, height, elements } => mesh::hollow_cylinder(
            &body.name,
            &mesh::HollowCylinderShape { inner_radius, outer_radius, height, elements },
        ),
        case::Shape::HalfRing { outer_radius, inner_radius, width, elements } => {
            mesh::half_ring(&body.name, &mesh::HalfRingShape { outer_radius, inner_radius, width, elements })
        }
        case::Shape::Ball { radius, elements } => mesh::ball(&body.name, &mesh::BallShape { radius, elements }),
        case::Shape::Cone { bottom_radius, top_radius, height, elements } => {
            mesh::cone(&body.name, &mesh::ConeShape { bottom_radius, top_radius, height, elements })
        }
        case::Shape::Torus { radius, tube_radius, elements } => {
            mesh::torus(&body.name, &mesh::TorusShape { radius, tube_radius, elements })
        }
        case::Shape::Mesh(ref file) => Ok(file.mesh.as_ref().clone()),
    }
}

/// The position of a new node between others of a shape: their mean, but on circles and spheres with
/// their mean radius.
fn middle(shape: &case::Shape, of: &[[f64; 3]]) -> [f64; 3] {
    let count = of.len() as f64;
    let mean: [f64; 3] = std::array::from_fn(|c| of.iter().map(|x| x[c]).sum::<f64>() / count);
    let size = |x: &[f64; 3], across: &[usize]| across.iter().map(|&c| x[c] * x[c]).sum::<f64>().sqrt();
    // `across`: coordinates that are perpendicular to the axis
    let scale = |across: &[usize], to: f64| {
        let factor = to / size(&mean, across);
        std::array::from_fn(|c| if across.contains(&c) { factor * mean[c] } else { mean[c] })
    };
    let mean_size = |across: &[usize]| of.iter().map(|x| size(x, across)).sum::<f64>() / count;
    let all = |radius: f64, on: &dyn Fn(&[f64; 3]) -> f64| of.iter().all(|x| on(x).abs() <= 1e-9 * radius);
    match *shape {
        case::Shape::HollowCylinder { .. } => scale(&[0, 2], mean_size(&[0, 2])),
        case::Shape::HalfRing { .. } => scale(&[0, 1], mean_size(&[0, 1])),
        // inside solid bodies, edges are straight
        case::Shape::Ball { radius, .. } | case::Shape::HalfBall { radius, .. } => {
            let across = [0, 1, 2];
            if all(radius, &|x| size(x, &across) - radius) { scale(&across, radius) } else { mean }
        }
        case::Shape::Cone { bottom_radius, top_radius, height, .. } => {
            let at = |y: f64| bottom_radius + y / height * (top_radius - bottom_radius);
            let on_side = all(bottom_radius.max(top_radius), &|x| size(x, &[0, 2]) - at(x[1]));
            if on_side { scale(&[0, 2], at(mean[1])) } else { mean }
        }
        case::Shape::Torus { radius, tube_radius, .. } => {
            let mean = scale(&[0, 2], mean_size(&[0, 2]));
            let tube = |x: &[f64; 3]| [size(x, &[0, 2]) - radius, x[1]];
            if !all(tube_radius, &|x| tube(x)[0].hypot(tube(x)[1]) - tube_radius) {
                return mean;
            }
            let [out, up] = tube(&mean);
            let factor = tube_radius / out.hypot(up);
            let outward = (radius + factor * out) / (radius + out);
            [outward * mean[0], factor * up, outward * mean[2]]
        }
        case::Shape::Box { .. } | case::Shape::Mesh(_) => mean,
    }
}

/// The nodes of a set or surface; `path` is where the case names it.
pub(super) fn nodes_of(mesh: &Mesh, name: &str, path: &str) -> Result<Vec<u32>, BuildError> {
    mesh.set_nodes(name).map(|n| n.into_owned()).ok_or_else(|| {
        let known = mesh.names().join(", ");
        BuildError::new(path, format!("there is no set or surface `{name}`"), format!("known names: {known}"))
    })
}

/// Boundary facets of a body that meet all conditions of a surface.
fn select_facets(mesh: &Mesh, surface: &case::SurfaceSet, path: &str) -> Result<Surface, BuildError> {
    let Some(name) = &surface.body else { return union(mesh, &surface.of, path) };
    let body = mesh.bodies.iter().position(|body| body.name == *name).ok_or_else(|| {
        BuildError::new(format!("{path}.body"), format!("there is no body `{name}`"), "name one of the case")
    })?;
    let mut selected = match &surface.within {
        None => mesh.boundary(body),
        Some(within) => mesh.surfaces.get(within).cloned().ok_or_else(|| {
            let message = format!("there is no surface `{within}`");
            BuildError::new(format!("{path}.within"), message, "name a surface of the body")
        })?,
    };
    let inside =
        |nodes: &[u32], region: &case::BoxRegion| nodes.iter().all(|&node| region.contains(mesh.nodes[node as usize]));
    let near = |facet: &mesh::Facet, cone: &case::NormalCone| {
        let area = mesh::facet_area_vector(&mesh.facet_coordinates(facet));
        angle(area, cone.direction) <= cone.degrees
    };
    selected.facets.retain(|facet| {
        (surface.boxes.is_empty() || surface.boxes.iter().any(|region| inside(&facet.nodes, region)))
            && surface.normal.as_ref().is_none_or(|cone| near(facet, cone))
    });
    let selected = mesh.whole_faces(selected);
    if selected.facets.is_empty() {
        let message = format!("no facet of `{name}` fits surface `{}`", surface.name);
        let help = "facets lie in a box with all their nodes, at positions after placement; widen the conditions";
        return Err(BuildError::new(path, message, help));
    }
    Ok(selected)
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
        })?;
        let new = part.facets.iter().filter(|facet| !all.facets.contains(facet));
        let new: Vec<mesh::Facet> = new.cloned().collect();
        all.facets.extend(new);
    }
    Ok(all)
}

/// Angle between two directions, in degrees.
fn angle(a: [f64; 3], b: [f64; 3]) -> f64 {
    let (a, b) = (nalgebra::Vector3::from(a), nalgebra::Vector3::from(b));
    a.cross(&b).norm().atan2(a.dot(&b)).to_degrees()
}

/// Nodes that meet all conditions of a set, ascending.
fn select_nodes(mesh: &Mesh, set: &case::NodeSet, path: &str) -> Result<Vec<u32>, BuildError> {
    let mut selected: Vec<u32> = match &set.within {
        Some(name) => nodes_of(mesh, name, &format!("{path}.within"))?,
        None => (0..mesh.nodes.len() as u32).collect(),
    };
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
    if let Some(case::Cylinder { start, end, radius }) = set.cylinder {
        let found = mesh.nodes_in_cylinder(start, end, radius, Some(&selected));
        selected = found.map_err(|e| BuildError::new(format!("{path}.cylinder"), e, "correct the cylinder"))?;
        if selected.is_empty() {
            return Err(empty("cylinder", "in the cylinder"));
        }
    }
    if let Some(point) = set.nearest {
        selected = mesh.nearest_node(point, Some(&selected)).into_iter().collect();
    }
    match selected.is_empty() {
        true => Err(empty("nearest", "near the point")),
        false => Ok(selected),
    }
}

/// A millionth of the size of all bodies: above the round-off of mesh files, below any
/// element. \[L\]
pub(super) fn default_tolerance(mesh: &Mesh) -> f64 {
    mesh.bounding_box().map_or(0.0, |(min, max)| 1e-6 * (0..3).map(|c| (max[c] - min[c]).powi(2)).sum::<f64>().sqrt())
}

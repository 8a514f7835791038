//! The mesh of a case: its bodies after placement, with the surfaces and node sets that the case
//! selects.

use super::select::{nodes_of, select_facets, select_nodes};
use super::{BuildError, bolts, centres, surfaces, ties};
use crate::file::{self, Case};
use slipstick_mesh::{self as mesh, Mesh};
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
    if ties.iter().any(Option::is_some) {
        let dependent = centres::dependent(case, &mesh)?;
        mesh.place_centres(&dependent);
    }
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
    let raised: Vec<usize> = (0..case.bodies.len()).filter(|&b| surfaces::is_raised(&case.bodies[b])).collect();
    if !raised.is_empty() {
        // Contact surfaces say which pairs a body belongs to. A selection may need the curved faces, and fails here.
        let mut straight = all.clone();
        let _ = select(case, &mut straight);
        for body in raised {
            let angle = surfaces::feature_angle(case, &straight, body);
            surfaces::curve_middles(case, &mut all, body, angle)?;
        }
    }
    centres::place(case, &mut all);
    select(case, &mut all)?;
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
    bolts::cut(case, &mut all)?;
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
    for (k, coupling) in case.couplings.iter().enumerate() {
        let nodes = nodes_of(&all, &coupling.set, &format!("coupling[{k}].set"))?;
        all.add_coupling(&coupling.name, coupling.at, &nodes);
    }
    case.points.iter().for_each(|point| all.add_point(&point.name, point.at));
    all.add_references();
    Ok(all)
}

/// Adds the surfaces and node sets that the case selects.
fn select(case: &Case, mesh: &mut Mesh) -> Result<(), BuildError> {
    for (s, surface) in case.surfaces.iter().enumerate() {
        let selected = select_facets(mesh, surface, &format!("surface[{s}]"))?;
        mesh.surfaces.insert(surface.name.clone(), selected);
    }
    for (s, set) in case.sets.iter().enumerate() {
        let selected = select_nodes(mesh, set, &format!("set[{s}]"))?;
        mesh.node_sets.insert(set.name.clone(), selected);
    }
    Ok(())
}

fn generate(body: &file::Body) -> Result<Mesh, mesh::MeshError> {
    match body.shape {
        file::Shape::Box { min, max, elements, grading } => {
            mesh::box_mesh(&body.name, &mesh::BoxShape { min, max, elements, grading })
        }
        file::Shape::HalfBall { radius, elements } => {
            mesh::half_ball(&body.name, &mesh::HalfBallShape { radius, elements })
        }
        file::Shape::HollowCylinder { inner_radius, outer_radius, height, elements } => mesh::hollow_cylinder(
            &body.name,
            &mesh::HollowCylinderShape { inner_radius, outer_radius, height, elements },
        ),
        file::Shape::HalfRing { outer_radius, inner_radius, width, elements } => {
            mesh::half_ring(&body.name, &mesh::HalfRingShape { outer_radius, inner_radius, width, elements })
        }
        file::Shape::Ball { radius, elements } => mesh::ball(&body.name, &mesh::BallShape { radius, elements }),
        file::Shape::Cone { bottom_radius, top_radius, height, elements } => {
            mesh::cone(&body.name, &mesh::ConeShape { bottom_radius, top_radius, height, elements })
        }
        file::Shape::Torus { radius, tube_radius, elements } => {
            mesh::torus(&body.name, &mesh::TorusShape { radius, tube_radius, elements })
        }
        file::Shape::Mesh(ref file) => Ok(file.mesh.as_ref().clone()),
    }
}

/// The position of a new node between others of a shape: their mean, but on circles and spheres with
/// their mean radius.
fn middle(shape: &file::Shape, of: &[[f64; 3]]) -> [f64; 3] {
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
        file::Shape::HollowCylinder { .. } => scale(&[0, 2], mean_size(&[0, 2])),
        file::Shape::HalfRing { .. } => scale(&[0, 1], mean_size(&[0, 1])),
        // inside solid bodies, edges are straight
        file::Shape::Ball { radius, .. } | file::Shape::HalfBall { radius, .. } => {
            let across = [0, 1, 2];
            if all(radius, &|x| size(x, &across) - radius) { scale(&across, radius) } else { mean }
        }
        file::Shape::Cone { bottom_radius, top_radius, height, .. } => {
            let at = |y: f64| bottom_radius + y / height * (top_radius - bottom_radius);
            let on_side = all(bottom_radius.max(top_radius), &|x| size(x, &[0, 2]) - at(x[1]));
            if on_side { scale(&[0, 2], at(mean[1])) } else { mean }
        }
        file::Shape::Torus { radius, tube_radius, .. } => {
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
        file::Shape::Box { .. } | file::Shape::Mesh(_) => mean,
    }
}

//! The models of load cases that differ from the rest of the case.

use nalgebra::{Rotation3, Unit, Vector3};
use slipstick_mesh::Mesh;
use slipstick_model::model::{ContactModel, Variation};

use super::BuildError;
use crate::file::{self, BodyInCase, Case, Dirichlet, LoadCase, Turn};

/// How each load case differs; `None`: not at all.
pub(super) fn variations(
    case: &Case,
    mesh: &Mesh,
    model: &ContactModel,
    mirrored: &[[bool; 3]],
) -> Result<Vec<Option<Variation>>, BuildError> {
    let of = |(number, load_case): (usize, &LoadCase)| -> Result<Option<Variation>, BuildError> {
        let none = Variation::none(model);
        let variation = Variation {
            rest: rest(case, mesh, (number, load_case), mirrored)?,
            friction: frictions(case, load_case),
            moduli: moduli(case, load_case),
            motions: {
                let factors = motions(case, load_case);
                check_shared(case, mesh, (number, load_case), &factors)?;
                factors
            },
            loads: loads(case, load_case),
        };
        Ok((variation != none).then_some(variation))
    };
    case.load_cases.iter().enumerate().map(of).collect()
}

/// The largest factor on a motion in any load case, at least 1.
pub(super) fn largest_motion_factor(case: &Case) -> f64 {
    let factors = case.load_cases.iter().flat_map(|load_case| motions(case, load_case));
    factors.fold(1.0, |largest: f64, factor| largest.max(factor.abs()))
}

fn frictions(case: &Case, load_case: &LoadCase) -> Vec<Option<f64>> {
    let of = |slave: &String| load_case.pairs.iter().find(|pair| pair.slave == *slave).map(|pair| pair.friction);
    case.contacts.iter().map(|contact| of(&contact.slave).or(load_case.friction)).collect()
}

fn moduli(case: &Case, load_case: &LoadCase) -> Vec<f64> {
    let own = |name: &str| load_case.bodies.iter().find(|body| body.body == name)?.modulus_factor;
    factors(case.bodies.iter().map(|body| body.name.as_str()), own, load_case.modulus_factor)
}

fn motions(case: &Case, load_case: &LoadCase) -> Vec<f64> {
    let own = |name: &str| load_case.motions.iter().find(|motion| motion.set == name).map(|motion| motion.factor);
    factors(case.dirichlet.iter().map(|dirichlet| dirichlet.set.as_str()), own, load_case.motion_factor)
}

fn loads(case: &Case, load_case: &LoadCase) -> Vec<f64> {
    let own = |name: &str| load_case.loads.iter().find(|load| load.surface == name).map(|load| load.factor);
    factors(case.loads.iter().map(file::Load::target), own, load_case.load_factor)
}

/// The factor on each of some names: its own, or that of all, or 1.
fn factors<'a>(
    names: impl Iterator<Item = &'a str>,
    own: impl Fn(&str) -> Option<f64>,
    of_all: Option<f64>,
) -> Vec<f64> {
    names.map(|name| own(name).or(of_all).unwrap_or(1.0)).collect()
}

/// Nodes that two sets move in the same way need the same factor for both.
fn check_shared(
    case: &Case,
    mesh: &Mesh,
    (number, load_case): (usize, &LoadCase),
    factors: &[f64],
) -> Result<(), BuildError> {
    let acts = |d: &&Dirichlet| !d.motion.is_empty() && d.load_case.as_ref().is_none_or(|of| *of == load_case.name);
    let moving: Vec<(&Dirichlet, f64)> =
        case.dirichlet.iter().zip(factors).filter(|(d, _)| acts(d)).map(|(d, factor)| (d, *factor)).collect();
    for (k, (a, of_a)) in moving.iter().enumerate() {
        for (b, _) in moving[..k].iter().filter(|(_, of_b)| of_a != of_b) {
            let nodes = |d: &Dirichlet| mesh.set_nodes(&d.set).unwrap_or_default().to_vec();
            let together = a.components.iter().any(|component| b.components.contains(component));
            let others = nodes(b);
            if together && nodes(a).iter().any(|node| others.contains(node)) {
                let message =
                    format!("`{}` and `{}` share nodes, but their motions have different factors", b.set, a.set);
                let path = format!("load_case[{number}].motions");
                return Err(BuildError::new(path, message, "give both the same factor"));
            }
        }
    }
    Ok(())
}

/// The mesh at the start of a load case; `None` if no body is moved.
///
/// # Errors
/// [`BuildError`] at a rotation of a body that must not turn.
pub fn moved_mesh(case: &Case, mesh: &Mesh, number: usize) -> Result<Option<Mesh>, BuildError> {
    let Some(load_case) = case.load_cases.get(number) else { return Ok(None) };
    let rest = rest(case, mesh, (number, load_case), &vec![[false; 3]; mesh.nodes.len()])?;
    if rest.is_empty() {
        return Ok(None);
    }
    let mut moved = mesh.clone();
    moved.nodes.as_flattened_mut().iter_mut().zip(&rest).for_each(|(x, u)| *x += u);
    for rigid in &mesh.rigid {
        // the node with the rotations is where the reference node is
        moved.nodes[rigid.rotation() as usize] = moved.nodes[rigid.reference as usize];
    }
    Ok(Some(moved))
}

/// Displacements of all nodes at the start of a load case; empty if no body is moved.
fn rest(
    case: &Case,
    mesh: &Mesh,
    (number, load_case): (usize, &LoadCase),
    mirrored: &[[bool; 3]],
) -> Result<Vec<f64>, BuildError> {
    let mut rest = Vec::new();
    for (entry, moved) in load_case.bodies.iter().enumerate() {
        let BodyInCase { body, offset, rotation, .. } = moved;
        if offset.is_none() && rotation.is_none() {
            continue;
        }
        let path = |key: &str| format!("load_case[{number}].bodies[{entry}].{key}");
        let Some(at) = case.bodies.iter().position(|known| known.name == *body) else { continue };
        if rotation.is_some() {
            check_rotation(case, at, &path("rotation"))?;
        }
        rest.resize(3 * mesh.nodes.len(), 0.0);
        let references = mesh.rigid.iter().filter(|rigid| rigid.body == at).map(|rigid| rigid.reference as usize);
        for node in mesh.bodies[at].nodes.clone().chain(references) {
            let place = Vector3::from(mesh.nodes[node]);
            let moved = rotation.map_or(place, |turn| turned(turn, place)) + Vector3::from(offset.unwrap_or_default());
            for c in 0..3 {
                rest[3 * node + c] = moved[c] - place[c];
                if mirrored[node][c] && rest[3 * node + c].abs() > 1e-12 * place.norm().max(1.0) {
                    let message = format!("`{body}` would leave its symmetry plane");
                    let help = "move it within the plane, or model the whole body";
                    return Err(BuildError::new(
                        path(if offset.is_some() { "offset" } else { "rotation" }),
                        message,
                        help,
                    ));
                }
                if mirrored[node][c] {
                    rest[3 * node + c] = 0.0;
                }
            }
        }
    }
    Ok(rest)
}

/// A rotated body must be free of stress.
fn check_rotation(case: &Case, body: usize, path: &str) -> Result<(), BuildError> {
    let file::Body { name, material, rigid, .. } = &case.bodies[body];
    if rigid.is_some() {
        let message = format!("`{name}` is rigid: in a load case it may be offset, but not rotated");
        let help = "rotate it by a motion, [[dirichlet]] with `load_case`, or by its `place`";
        return Err(BuildError::new(path, message, help));
    }
    if material.small_strains() {
        let message = format!("`{name}` has a law for small rotations: rotating it would strain it");
        return Err(BuildError::new(path, message, "choose another law, such as neo_hooke"));
    }
    let interpolated = |design: &file::Design| design.energy_interpolation.is_some() && design.bodies.contains(name);
    if case.design.as_ref().is_some_and(interpolated) {
        let message = format!("`{name}` is designed with energy interpolation: rotating it would strain its voids");
        return Err(BuildError::new(path, message, "rotate the other bodies, or omit `energy_interpolation`"));
    }
    Ok(())
}

fn turned(Turn { point, direction, angle }: Turn, place: Vector3<f64>) -> Vector3<f64> {
    let axis = Unit::new_normalize(Vector3::from(direction));
    let point = Vector3::from(point);
    point + Rotation3::from_axis_angle(&axis, angle.to_radians()) * (place - point)
}

//! Bolts: sections at which bodies are cut, and their equations.

use super::BuildError;
use crate::file::Case;
use slipstick_mesh::{CutError, Mesh};
use slipstick_model::model::linear::{LinearEquation, LinearEquations};
use slipstick_model::model::prescribed::Prescribed;
use slipstick_model::model::{Bolt, Bolts};
use slipstick_solid::SolidModel;

/// Cuts the bodies of all bolts.
pub(super) fn cut(case: &Case, mesh: &mut Mesh) -> Result<(), BuildError> {
    for (k, bolt) in case.bolts.iter().enumerate() {
        let number = case.bodies.iter().position(|body| body.name == bolt.body);
        let number = number.expect("the reader has checked the name");
        let section = &bolt.section;
        if case.design.as_ref().is_some_and(|design| design.bodies.contains(&bolt.body)) {
            let message = format!("`{}` is designed, and the section of a bolt cannot be", bolt.body);
            let help = "leave the body out of `design.bodies`";
            return Err(BuildError::new(format!("bolt[{k}].body"), message, help));
        }
        let radius = section.radius.unwrap_or(f64::INFINITY);
        let error = mesh.cut(&bolt.name, number, section.point, unit(section.normal), radius).err();
        let (message, help) = match error {
            None => continue,
            Some(CutError::Partial { distance }) => (
                format!("faces of the section lie partly beyond `radius`, up to {distance:.3} from the point"),
                "increase `radius` to that distance at least, or omit it: the section must go through the whole shank",
            ),
            Some(CutError::Nothing) => {
                let nodes = &mesh.nodes[mesh.bodies[number].nodes.clone()];
                let fold = |f: fn(f64, f64) -> f64, x: &[f64; 3], y: &[f64; 3]| std::array::from_fn(|c| f(x[c], y[c]));
                let first = nodes.first().copied().unwrap_or_default();
                let low: [f64; 3] = nodes.iter().fold(first, |low, x| fold(f64::min, &low, x));
                let high: [f64; 3] = nodes.iter().fold(first, |high, x| fold(f64::max, &high, x));
                (
                    format!("the plane does not divide `{}`, which lies between {low:?} and {high:?}", bolt.body),
                    "move `point` into the shank, with elements on both sides, and omit `radius` or increase it",
                )
            }
        };
        return Err(BuildError::new(format!("bolt[{k}].section"), message, help));
    }
    Ok(())
}

/// Refuses sections that cross slave surfaces: there, nodes and copies would have conditions of their own, although
/// they move together.
pub(super) fn check(case: &Case, mesh: &Mesh) -> Result<(), BuildError> {
    for (k, cut) in mesh.cuts.iter().enumerate() {
        let crossed = |slave: &&String| {
            let nodes = mesh.set_nodes(slave).unwrap_or_default();
            cut.nodes.iter().any(|[_, copy]| nodes.binary_search(copy).is_ok())
        };
        if let Some(slave) = case.contacts.iter().map(|contact| &contact.slave).find(crossed) {
            let message = format!("the section meets the slave surface `{slave}`");
            let help = "move the section to where nothing touches, or make this surface the master";
            return Err(BuildError::new(format!("bolt[{k}].section"), message, help));
        }
    }
    Ok(())
}

/// Refuses bolts whose parts supports hold where they are.
pub(super) fn check_free(mesh: &Mesh, prescribed: &Prescribed, linear: &LinearEquations) -> Result<(), BuildError> {
    let held = |unknown: usize| linear.is_dependent(unknown) || prescribed.fixed()[unknown];
    match mesh.cuts.iter().position(|cut| held(3 * cut.reference as usize)) {
        None => Ok(()),
        Some(k) => {
            let message =
                "supports or equations hold both sides of the section, so that no force can pull them together";
            let help = "move the section, or the supports, so that one side can move along the normal";
            Err(BuildError::new(format!("bolt[{k}].section"), message, help))
        }
    }
}

/// Adds the equations u_copy − u_node + δ n = 0 of all bolts, with numbers from `first`.
pub(super) fn add_equations(mesh: &Mesh, first: usize, equations: &mut Vec<LinearEquation>) {
    for (k, cut) in mesh.cuts.iter().enumerate() {
        for &[node, copy] in &cut.nodes {
            for c in 0..3 {
                let mut terms = vec![(3 * copy + c, 1.0), (3 * node + c, -1.0)];
                let n = cut.normal[c as usize];
                terms.extend((n != 0.0).then_some((3 * cut.reference, n)));
                equations.push(LinearEquation { terms, number: first + k });
            }
        }
    }
}

/// The bolts of a mesh that [`cut`] has cut.
pub(super) fn build_bolts(case: &Case, mesh: &Mesh, solid: &SolidModel) -> Bolts {
    let of = |(bolt, cut): (&crate::file::Bolt, &slipstick_mesh::Cut)| {
        let body = &mesh.bodies[cut.body];
        let along = |x: &[f64; 3]| (0..3).map(|c| x[c] * cut.normal[c]).sum::<f64>();
        let places = mesh.nodes[body.nodes.clone()].iter().map(along);
        let (low, high) = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        let modulus = solid.material(body.elements.start).youngs_modulus();
        Bolt {
            name: bolt.name.clone(),
            body: cut.body,
            unknown: 3 * cut.reference,
            stiffness: modulus * cut.area / (high - low),
            preload: bolt.force.clone(),
            keeps: bolt.keeps,
        }
    };
    Bolts::new(case.bolts.iter().zip(&mesh.cuts).map(of).collect())
}

fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = v[0].hypot(v[1]).hypot(v[2]);
    v.map(|x| x / length)
}

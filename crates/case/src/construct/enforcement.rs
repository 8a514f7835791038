//! Methods, stiffness and Uzawa's iteration of contact pairs.

use super::{BuildError, surface_of};
use crate::file::{self, Case};
use slipstick_contact::enforcement::Stiffness;
use slipstick_mesh::Mesh;
use slipstick_model::model::{DEFAULT_COMPLEMENTARITY, DEFAULT_STIFFNESS, Enforcement, GivenStiffness, Method, Uzawa};
use slipstick_path::UzawaOptions;

/// Checks that the stiffness of a pair is known: the default is that of the bodies, and rigid bodies
/// have none.
pub(super) fn check_stiffness(mesh: &Mesh, contact: &file::Contact, pair: usize) -> Result<(), BuildError> {
    let rigid = |name: &str, key: &str| -> Result<Vec<bool>, BuildError> {
        let surface = surface_of(mesh, name, &format!("contact[{pair}].{key}"))?;
        Ok(surface.facets.iter().map(|facet| mesh.is_rigid(facet.element as usize)).collect())
    };
    let (slave, master) = (rigid(&contact.slave, "slave")?, rigid(&contact.master, "master")?);
    let relative = matches!(given(&contact.enforcement).stiffness, GivenStiffness::Relative { .. });
    if contact.tied || !relative || !slave.contains(&true) || master.contains(&false) {
        return Ok(());
    }
    let method = match contact.enforcement {
        file::Enforcement::Lagrange { .. } => "lagrange",
        file::Enforcement::Penalty { .. } => "penalty",
        file::Enforcement::Augmented { .. } => "augmented",
    };
    Err(BuildError::new(
        format!("contact[{pair}].enforcement"),
        format!(
            "`{}` and `{}` belong to rigid bodies, so there is no modulus from which a default stiffness could follow",
            contact.slave, contact.master
        ),
        format!("give a stiffness per area [F/L³]: `enforcement = {{ {method} = {{ stiffness = … }} }}`"),
    ))
}

/// Settings of Uzawa's iteration, which updates all pairs with the augmented Lagrangian together.
pub(super) fn build_uzawa(case: &Case) -> Result<Option<Uzawa>, BuildError> {
    let settings = |contact: &file::Contact| match contact.enforcement {
        file::Enforcement::Augmented { tolerance, tolerance_scaling, max_uzawa, acceleration, .. } => Some(Uzawa {
            options: UzawaOptions { tolerance, max_iterations: max_uzawa, memory: acceleration },
            absolute: tolerance_scaling == file::ToleranceScaling::Absolute,
        }),
        file::Enforcement::Lagrange { .. } | file::Enforcement::Penalty { .. } => None,
    };
    let mut all = case.contacts.iter().map(settings).enumerate().filter_map(|(i, uzawa)| Some((i, uzawa?)));
    let Some((first, uzawa)) = all.next() else {
        return Ok(None);
    };
    // the iteration updates all pairs at once
    if let Some((i, _)) = all.find(|(_, other)| *other != uzawa) {
        let path = format!("contact[{i}].enforcement");
        let message = format!("the settings of Uzawa's iteration differ from those of contact[{first}]");
        let help = "give both pairs the same settings; only stiffness and its scaling may differ";
        return Err(BuildError::new(path, message, help));
    }
    Ok(Some(uzawa))
}

/// Method and stiffness of a contact pair; if no stiffness is given, the default of the method.
pub(super) fn given(enforcement: &file::Enforcement) -> Enforcement {
    let (method, stiffness, scaling, factor) = match *enforcement {
        file::Enforcement::Lagrange { stiffness, scaling, complementarity_parameter } => {
            let factor = complementarity_parameter.unwrap_or(DEFAULT_COMPLEMENTARITY);
            (Method::Lagrange, stiffness, scaling, factor)
        }
        file::Enforcement::Penalty { stiffness, scaling, .. } => {
            (Method::Penalty, stiffness, scaling, DEFAULT_STIFFNESS)
        }
        file::Enforcement::Augmented { stiffness, scaling, .. } => {
            (Method::Augmented, stiffness, scaling, DEFAULT_STIFFNESS)
        }
    };
    let stiffness = match stiffness {
        None => GivenStiffness::Relative { factor, scaling },
        Some(s) => GivenStiffness::Absolute(Stiffness { normal: s.normal, tangential: s.tangential, scaling }),
    };
    Enforcement { method, stiffness }
}

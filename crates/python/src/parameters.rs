//! Parameters: their names, and how they are set in a case.

use slipstick::analysis::Gradients;
use slipstick::case::Case;
use slipstick::model::Parameter;

use crate::errors::Error;

/// Sets a parameter in a case. An amplitude multiplies the motion or the load.
pub fn set_parameter(case: &mut Case, parameter: Parameter, value: f64) -> Result<(), Error> {
    match parameter {
        Parameter::Friction { interface } => case.contacts[interface].friction = value,
        Parameter::YoungsModulus { body } => {
            let body = &mut case.bodies[body];
            let factor = value / body.material.youngs_modulus();
            let wrong = |error: slipstick::solid::MaterialError| Error::input(error.to_string(), error.help);
            body.material = body.material.with_youngs_modulus(value).map_err(wrong)?;
            for section in &mut body.sections {
                section.material = section.material.stiffened(factor).map_err(wrong)?;
            }
        }
        Parameter::Amplitude { motion } => {
            for waypoint in &mut case.dirichlet[motion].motion {
                waypoint.u = waypoint.u.map(|u| value * u);
                waypoint.angle *= value;
            }
        }
        Parameter::Preload { bolt } => {
            case.bolts[bolt].force.iter_mut().for_each(|point| point.force *= value);
        }
        Parameter::Load { load } => {
            case.loads[load].amplitude.iter_mut().for_each(|point| point.factor *= value);
        }
        Parameter::Expansion { body } => {
            let body = &mut case.bodies[body];
            let factor = value / body.thermal_expansion.unwrap_or(1.0);
            body.thermal_expansion = Some(value);
            body.sections.iter_mut().filter_map(|of| of.thermal_expansion.as_mut()).for_each(|alpha| *alpha *= factor);
        }
        Parameter::Temperature { change } => {
            case.temperatures[change].amplitude.iter_mut().for_each(|point| point.factor *= value);
        }
    }
    Ok(())
}

/// Kind, place in the case and derivative of every parameter.
pub fn named(case: &Case, gradients: &Gradients) -> Vec<(&'static str, String, f64)> {
    let of = |&(parameter, derivative): &(Parameter, f64)| {
        let (kind, place) = name_of(case, parameter);
        (kind, place, derivative)
    };
    gradients.parameters.iter().map(of).collect()
}

/// Kind and place in the case of a parameter.
pub fn name_of(case: &Case, parameter: Parameter) -> (&'static str, String) {
    match parameter {
        Parameter::Friction { interface } => ("friction", format!("contact[{interface}].friction")),
        Parameter::YoungsModulus { body } => ("youngs_modulus", case.bodies[body].name.clone()),
        Parameter::Amplitude { motion } => ("amplitude", format!("dirichlet[{motion}].motion")),
        Parameter::Preload { bolt } => ("amplitude", format!("bolt[{bolt}].force")),
        Parameter::Load { load } => ("amplitude", format!("load[{load}]")),
        Parameter::Expansion { body } => ("thermal_expansion", case.bodies[body].name.clone()),
        Parameter::Temperature { change } => ("amplitude", format!("temperature[{change}]")),
    }
}

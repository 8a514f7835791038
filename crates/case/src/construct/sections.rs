//! Materials of bodies and regions.

use super::{BuildError, Regions};
use crate::file::{self, Case};
use slipstick_mesh::Mesh;
use slipstick_solid::{Section, Sections};

/// Materials and element formulations of the bodies, and of their regions.
///
/// # Errors
/// [`BuildError`] at a region without elements.
pub fn sections(case: &Case, mesh: &Mesh) -> Result<Sections, BuildError> {
    let section = |material, of: [Option<f64>; 2], body: &file::Body| Section {
        mass_density: of[0].or(body.mass_density).unwrap_or(0.0),
        thermal_expansion: of[1].or(body.thermal_expansion).unwrap_or(0.0),
        ..Section::new(material, body.element)
    };
    let own = |body: &file::Body| section(body.material, [None; 2], body);
    let mut all = Sections::from(case.bodies.iter().map(own).collect::<Vec<_>>());
    for (b, body) in case.bodies.iter().enumerate().filter(|(_, body)| !body.sections.is_empty()) {
        let elements: Vec<u32> = mesh.bodies[b].elements.clone().map(|e| e as u32).collect();
        let regions = Regions::new(mesh, &elements);
        for (i, of) in body.sections.iter().enumerate() {
            let inside = regions.each(std::slice::from_ref(&of.region)).concat();
            if inside.is_empty() {
                let (message, help) = match &of.region {
                    file::Region::Part { part } => {
                        let own = format!("{}_", body.name);
                        let has = mesh.element_sets.keys().filter(|name| name.starts_with(&own));
                        let has: Vec<&str> = has.map(String::as_str).collect();
                        let help = match has.is_empty() {
                            true => "give a set of its own mesh, a box, a cylinder or a ball".into(),
                            false => format!("sets of its own mesh: {}", has.join(", ")),
                        };
                        (format!("no element of `{part}` belongs to `{}`", body.name), help)
                    }
                    _ => (
                        format!("no element of `{}` has its centroid in this region", body.name),
                        "give a region of the body, at its position after `place`, or omit the section".into(),
                    ),
                };
                return Err(BuildError::new(format!("body[{b}].section[{i}]"), message, help));
            }
            all.list.push(section(of.material, [of.mass_density, of.thermal_expansion], body));
            all.regions.push((b, inside));
        }
    }
    Ok(all)
}

//! Materials of bodies and regions.

use super::{BuildError, Regions, centres};
use crate::file::{self, Case};
use slipstick_mesh::Mesh;
use slipstick_solid::{Formulation, Section, Sections};
use std::collections::BTreeSet;

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
    integrate_enriched(case, mesh, &mut all)?;
    Ok(all)
}

/// Integrates hexahedra with free centres of faces fully: eight points do not hold these.
fn integrate_enriched(case: &Case, mesh: &Mesh, all: &mut Sections) -> Result<(), BuildError> {
    let reduced = |body: &file::Body| body.element == Formulation::Reduced && body.rigid.is_none();
    for b in (0..case.bodies.len()).filter(|&b| reduced(&case.bodies[b])) {
        let enriched = centres::enriched(case, mesh, b)?;
        let (own, mut taken) = (all.regions.len(), BTreeSet::new());
        // where regions overlap, the last one counts
        for at in (0..own).rev().filter(|&at| all.regions[at].0 == b).collect::<Vec<_>>() {
            let inside: BTreeSet<u32> = all.regions[at].1.iter().copied().collect();
            let some: Vec<u32> = enriched.iter().copied().filter(|e| inside.contains(e) && taken.insert(*e)).collect();
            push_full(all, mesh.bodies.len() + at, b, some);
        }
        let rest = enriched.into_iter().filter(|e| !taken.contains(e)).collect();
        push_full(all, b, b, rest);
    }
    Ok(())
}

/// Adds elements of a body that are as a section, and fully integrated.
fn push_full(all: &mut Sections, section: usize, body: usize, elements: Vec<u32>) {
    if !elements.is_empty() {
        all.list.push(Section { formulation: Formulation::Full, ..all.list[section] });
        all.regions.push((body, elements));
    }
}

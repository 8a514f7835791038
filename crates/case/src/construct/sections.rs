//! Materials of bodies and regions.

use super::{BuildError, Regions, centres};
use crate::file::{self, Case};
use nalgebra::{Matrix3, Vector3};
use slipstick_mesh::Mesh;
use slipstick_solid::{Constant, Form, Formulation, Material, Section, Sections, Value};
use std::collections::{BTreeMap, BTreeSet};

/// Materials and element formulations of the bodies, and of their regions.
///
/// # Errors
/// [`BuildError`] at a region without elements, and where axes turn about a line through an element's centroid.
pub fn sections(case: &Case, mesh: &Mesh) -> Result<Sections, BuildError> {
    let section = |material, of: [Option<f64>; 2], body: &file::Body| Section {
        mass_density: of[0].or(body.mass_density).unwrap_or(0.0),
        thermal_expansion: of[1].or(body.thermal_expansion).unwrap_or(0.0),
        void_poisson_ratio: case
            .design
            .as_ref()
            .filter(|of| of.bodies.contains(&body.name))
            .and_then(|of| of.void_poisson_ratio),
        ..Section::new(material, body.element)
    };
    let own = |body: &file::Body| section(body.material, [None; 2], body);
    let mut all = Sections::from(case.bodies.iter().map(own).collect::<Vec<_>>());
    for (b, body) in case.bodies.iter().enumerate() {
        let elements = mesh.bodies[b].elements.clone().map(|e| e as u32);
        turn(&mut all, mesh, (b, b), elements.collect(), (body.axes_about.as_ref(), &format!("body[{b}].axes_about")))?;
    }
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
            all.regions.push((b, inside.clone()));
            let own = all.list.len() - 1;
            let path = format!("body[{b}].section[{i}].axes_about");
            turn(&mut all, mesh, (own, b), inside, (of.axes_about.as_ref(), &path))?;
        }
    }
    integrate_enriched(case, mesh, &mut all)?;
    Ok(all)
}

/// Radial directions that differ by less in each component are one.
const SAME_DIRECTION: f64 = 1e-9;

/// Adds regions for the elements of a section, one for each direction of the material axes, if these turn about a
/// line.
fn turn(
    all: &mut Sections,
    mesh: &Mesh,
    (section, body): (usize, usize),
    elements: Vec<u32>,
    (about, path): (Option<&file::AxesAbout>, &str),
) -> Result<(), BuildError> {
    let Some(file::AxesAbout { point, direction }) = about else { return Ok(()) };
    let axial = Vector3::from(*direction).normalize();
    let mut regions: BTreeMap<[i64; 3], Vec<u32>> = BTreeMap::new();
    for element in elements {
        let arm = Vector3::from(mesh.centroid(element as usize)) - Vector3::from(*point);
        let across = arm - axial * axial.dot(&arm);
        if across.norm() <= 1e-9 * arm.norm().max(mesh.element_volume(element as usize).cbrt()) {
            return Err(BuildError::new(
                path.to_owned(),
                format!(
                    "the line goes through the centroid {:?} of an element, where no direction is radial",
                    mesh.centroid(element as usize)
                ),
                "move the line, or mesh the body so that nodes or edges lie on it",
            ));
        }
        let key = (across / across.norm()).map(|x| (x / SAME_DIRECTION).round() as i64);
        regions.entry(key.into()).or_default().push(element);
    }
    for (radial, elements) in regions {
        let radial = Vector3::from(radial.map(|x| x as f64)).normalize();
        let frame = Matrix3::from_columns(&[radial, axial.cross(&radial), axial]);
        let turned = |material: &Material| {
            let value =
                |(constant, value): (&Constant, Value)| match (constant.form, <[f64; 3]>::try_from(value.numbers())) {
                    (Form::Direction(_), Ok(axis)) => Value::from((frame * Vector3::from(axis)).as_slice()),
                    _ => value,
                };
            let values: Vec<Value> = material.constants().map(value).collect();
            material.kind().with_values(&values).expect("turned axes remain at an angle")
        };
        all.list.push(Section { material: turned(&all.list[section].material), ..all.list[section] });
        all.regions.push((body, elements));
    }
    Ok(())
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

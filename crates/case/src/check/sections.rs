//! Which material is where in bodies of several materials.

use serde::Serialize;
use slipstick_mesh::Mesh;

use crate::construct::Regions;
use crate::file::Case;

/// A region of a body with its material.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SectionSummary {
    /// The body.
    pub body: String,
    /// The region in words; what remains of the body comes first.
    pub region: String,
    /// Its material as an inline table of the case file.
    pub material: String,
    /// Its elements, without those of later regions.
    pub elements: usize,
    /// Their volume. \[L³\]
    pub volume: f64,
}

/// The materials of the bodies with sections, each body's own material first.
pub fn sections(case: &Case, mesh: &Mesh) -> Vec<SectionSummary> {
    let volumes = mesh.element_volumes();
    let mut all = Vec::new();
    for (body, part) in case.bodies.iter().zip(&mesh.bodies).filter(|(body, _)| !body.sections.is_empty()) {
        let elements: Vec<u32> = part.elements.clone().map(|e| e as u32).collect();
        let regions: Vec<_> = body.sections.iter().map(|section| section.region.clone()).collect();
        // where regions overlap, the last one counts
        let mut of_element = vec![0; elements.len()];
        for (k, inside) in (1..).zip(Regions::new(mesh, &elements).each(&regions)) {
            inside.iter().for_each(|&e| of_element[e as usize - part.elements.start] = k);
        }
        for k in 0..=regions.len() {
            let own = of_element.iter().zip(&volumes[part.elements.clone()]).filter(|(of, _)| **of == k);
            let (elements, volume) = own.fold((0, 0.0), |(count, sum), (_, volume)| (count + 1, sum + volume));
            let (region, material) = match k.checked_sub(1) {
                None => ("elsewhere".to_owned(), body.material),
                Some(k) => (regions[k].to_string(), body.sections[k].material),
            };
            all.push(SectionSummary {
                body: body.name.clone(),
                region,
                material: material.to_string(),
                elements,
                volume,
            });
        }
    }
    all
}

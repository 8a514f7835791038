//! How stiff hard contact is in CalculiX, and how stiff it must be for the bodies of a pair.

use std::collections::HashMap;

use slipstick_case::file::Contact;
use slipstick_solid::{LawKind, Material, Section, Sections};

use super::Writer;

/// CalculiX replaces hard contact by a pressure per penetration: this factor times the first constant of the first
/// material of the deck, whatever the length of elements (`surfacebehaviors.f`; its log has the number).
const DEFAULT: f64 = 50.0;
/// Pressure per penetration of firm contact, over (λ + 2μ)/h of the softer body of a pair. An element of size h that is
/// pressed without sideways strain gives way by this factor more than its contact.
const FIRM: f64 = 100.0;
/// As [`FIRM`], below which CalculiX' own pressure per penetration is too soft: contact then gives way more than an
/// element. Firmer contact than that of CalculiX needs more iterations, and smaller increments with friction.
const LEAST: f64 = 1.0;

/// Materials of all elements.
pub(super) struct Moduli<'a> {
    sections: &'a Sections,
    /// Positions in the list of sections of the elements of regions.
    regions: HashMap<u32, usize>,
}

impl Moduli<'_> {
    fn of(&self, body: usize, element: u32) -> &Section {
        &self.sections.list[self.regions.get(&element).copied().unwrap_or(body)]
    }
}

/// λ + 2μ of the small-strain limit, at most that of ν = 0.4999. \[F/L²\]
fn compression_modulus(material: &Material) -> f64 {
    let (modulus, ratio) = (material.youngs_modulus(), material.poisson_ratio().min(0.4999));
    modulus * (1.0 - ratio) / ((1.0 + ratio) * (1.0 - 2.0 * ratio))
}

/// The first constant of a material in the deck. \[F/L²\]
fn first_constant(material: &Material) -> f64 {
    let number = |key: &str| {
        let known = material.constants().find(|(constant, _)| constant.key == key);
        known.and_then(|(_, value)| value.numbers().first().copied()).unwrap_or(0.0)
    };
    match material.kind() {
        LawKind::NeoHooke | LawKind::NeoHookeLn | LawKind::NeoHookeIsochoric => {
            number("youngs_modulus") / (4.0 * (1.0 + number("poisson_ratio")))
        }
        LawKind::MooneyRivlin | LawKind::Yeoh => number("c10"),
        LawKind::Ogden => 0.5 * number("mu") * number("alpha"),
        // CalculiX stores the stiffness along the first axis
        LawKind::Orthotropic => compression_modulus(material),
        _ => number("youngs_modulus"),
    }
}

impl<'a> Writer<'a> {
    pub(super) fn moduli(&self) -> Moduli<'a> {
        let (sections, count) = (self.sections, self.mesh.bodies.len());
        let of_region = |(r, (_, elements)): (usize, &(usize, Vec<u32>))| {
            elements.iter().map(|&element| (element, count + r)).collect::<Vec<_>>()
        };
        let regions = sections.regions.iter().enumerate().flat_map(of_region).collect();
        Moduli { sections, regions }
    }

    /// Pressure per penetration of hard contact in CalculiX. \[F/L³\]
    pub(super) fn hard(&self, moduli: &Moduli<'_>) -> f64 {
        let Some(body) = self.mesh.bodies.first() else { return 0.0 };
        // elements outside of all regions come first
        let outside = body.elements.clone().any(|element| !moduli.regions.contains_key(&(element as u32)));
        let first = if outside { 0 } else { moduli.regions.values().copied().min().unwrap_or(0) };
        DEFAULT * first_constant(&self.stiffened(0, moduli.sections.list[first].material))
    }

    /// Pressure per penetration that hides the penetration of a pair; `None` if hard contact in CalculiX, or nothing but
    /// rigid bodies, makes it unnecessary. \[F/L³\]
    pub(super) fn firm(&self, contact: &Contact, moduli: &Moduli<'_>) -> Option<f64> {
        let stiffest = |name: &String| {
            let facets = self.mesh.surfaces.get(name).map_or(&[][..], |of| &of.facets[..]);
            let of_element = |element: u32| {
                let body = self.mesh.body_of_element(element as usize)?;
                let rigid = self.case.bodies[body].rigid.is_some();
                let material = || self.stiffened(body, moduli.of(body, element).material);
                Some(if rigid { f64::INFINITY } else { compression_modulus(&material()) })
            };
            facets.iter().filter_map(|facet| of_element(facet.element)).fold(0.0, f64::max)
        };
        let softer = stiffest(&contact.slave).min(stiffest(&contact.master));
        let size = self.facet_size(&contact.slave);
        let unit = softer / size;
        (unit.is_finite() && unit > 0.0 && self.hard(moduli) < LEAST * unit).then_some(FIRM * unit)
    }
}

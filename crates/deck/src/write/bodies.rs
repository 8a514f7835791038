//! Bodies and their materials.

use super::{Writer, quoted, vector};
use crate::read::{Elastic, Hyperelastic, Material, Section};

impl Writer<'_> {
    pub(super) fn bodies(&mut self) {
        for index in 0..self.bodies.list.len() {
            self.body(index);
        }
    }

    fn body(&mut self, index: usize) {
        let body = &self.bodies.list[index];
        let part = body.part.as_ref().map_or(String::new(), |part| format!(", part = {}", quoted(part)));
        let mesh = format!("name = {}\nmesh = {{ file = {}{part} }}", quoted(&body.name), quoted(self.file));
        if let Some(rigid) = body.rigid.map(|rigid| &self.deck.rigids[rigid]) {
            self.table("body", "RIGID BODY", rigid.line);
            self.line(mesh);
            let at = self.bodies.position(rigid.reference).map_or([0.0; 3], |node| self.mesh.points[node as usize]);
            self.line(format!("rigid = {{ reference = {} }}", vector(&at)));
            if let Some(&(main, _)) = body.sections.first() {
                self.further_constants(&self.deck.sections[main].material, true);
            }
            return;
        }
        let Some(&(main, _)) = body.sections.first() else { return };
        let (section, deck) = (&self.deck.sections[main], self.deck);
        let soft = body.soft;
        self.table("body", "SOLID SECTION", section.line);
        self.line(mesh);
        let material = self.material(section);
        self.line(format!("material = {material}"));
        self.axes_about(section);
        self.further_constants(&section.material, false);
        let plastic = deck.materials.get(&section.material).is_some_and(|material| material.plastic.is_some());
        if body.hexahedra && (soft || plastic) {
            self.line("element = \"f_bar\"");
        } else if body.reduced {
            self.line("element = \"reduced\"");
        }
        if body.serendipity {
            self.line("shape_functions = \"serendipity\"");
        }
        for &(other, _) in &body.sections[1..] {
            let section = &deck.sections[other];
            let first = &deck.sections[main];
            let elastic = deck.materials.get(&section.material).and_then(|material| material.elastic.as_ref());
            let turned =
                matches!(elastic, Some((Elastic::Orthotropic(_), _))) && section.orientation != first.orientation;
            if section.material == first.material && !turned {
                continue;
            }
            let set = crate::bodies::find(&self.mesh.cell_sets, &section.set).unwrap_or(&section.set).to_owned();
            self.table("body.section", "SOLID SECTION", section.line);
            let region = quoted(&self.on(index, &set));
            let material = self.material(section);
            self.line(format!("region = {{ part = {region} }}\nmaterial = {material}"));
            self.axes_about(section);
            self.further_constants(&section.material, false);
        }
    }

    /// The constants of a material that do not belong to its law.
    fn further_constants(&mut self, material: &str, rigid: bool) {
        if let Some(density) = self.deck.materials.get(material).and_then(|material| material.density) {
            self.line(format!("mass_density = {density:?}"));
        }
        if let (Some(alpha), false) = (self.deck.materials.get(material).and_then(|of| of.expansion), rigid) {
            self.line(format!("thermal_expansion = {alpha:?}"));
        }
    }

    /// Axes 1 and 2 of the material of a section, if it names any.
    fn axes(&mut self, section: &Section) -> Option<[[f64; 3]; 2]> {
        let (deck, name) = (self.deck, section.orientation.as_ref()?);
        let Some(orientation) = deck.orientations.get(name) else {
            if !self.ledger.ignores("ORIENTATION") {
                let why = format!("there is no orientation `{name}`");
                self.ledger.wrong("SOLID SECTION", [section.line; 2], why, "define it with *ORIENTATION");
            }
            return None;
        };
        let elastic = deck.materials.get(&section.material).and_then(|material| material.elastic.as_ref());
        if orientation.axes.is_some() && matches!(elastic, Some((Elastic::Orthotropic(_), _))) {
            let how = match orientation.about {
                Some(_) => "`axes_about`: the directions at the centroid of each element",
                None => "`axis1` and `axis2` of the material",
            };
            self.ledger.translated("ORIENTATION", orientation.line, how);
        }
        orientation.axes
    }

    /// The line about which the axes of the orthotropic material of a section turn.
    fn axes_about(&mut self, section: &Section) {
        let deck = self.deck;
        let elastic = deck.materials.get(&section.material).and_then(|material| material.elastic.as_ref());
        let orientation = section.orientation.as_ref().and_then(|name| deck.orientations.get(name));
        if let (Some((Elastic::Orthotropic(_), _)), Some([point, direction])) =
            (elastic, orientation.and_then(|orientation| orientation.about))
        {
            self.line(format!("axes_about = {{ point = {}, direction = {} }}", vector(&point), vector(&direction)));
        }
    }

    /// The material of a section.
    fn material(&mut self, section: &Section) -> String {
        let (deck, name) = (self.deck, section.material.as_str());
        let axes = self.axes(section);
        let nothing = Material::default();
        let material = deck.materials.get(name).unwrap_or(&nothing);
        let large = deck.steps.iter().any(|step| step.nlgeom);
        if let Some((law, line)) = &material.hyperelastic {
            let (text, how) = hyperelastic(law);
            self.ledger.translated("HYPERELASTIC", *line, how);
            return text;
        }
        let Some((elastic, elastic_line)) = &material.elastic else {
            if deck.materials.contains_key(name) && !material.refused {
                let why = format!("the material `{name}` has no law");
                self.ledger.wrong("MATERIAL", [material.line; 2], why, "add *ELASTIC or *HYPERELASTIC");
            }
            return "{ }".into();
        };
        let (youngs_modulus, poisson_ratio) = match elastic {
            Elastic::Isotropic { youngs_modulus, poisson_ratio } => (youngs_modulus, poisson_ratio),
            Elastic::Orthotropic(constants) => {
                if let Some((_, line)) = &material.plastic {
                    let why = "plastic materials must be isotropic";
                    self.ledger.refuse("PLASTIC", *line, why, "give *ELASTIC two constants");
                }
                let how = "`orthotropic`, at any rotation: strains are those of Green and Lagrange, as in CalculiX with NLGEOM";
                self.ledger.translated("ELASTIC", *elastic_line, how);
                return orthotropic(constants, axes);
            }
        };
        let constants = format!("youngs_modulus = {youngs_modulus:?}, poisson_ratio = {poisson_ratio:?}");
        if let Some((table, plastic_line)) = &material.plastic {
            if table.len() > 32 {
                let why = format!("the table has {} rows, and at most 32 are supported", table.len());
                self.ledger.wrong("PLASTIC", [*plastic_line; 2], why, "keep the rows that matter");
            }
            self.ledger.translated("ELASTIC", *elastic_line, "the elastic part of `j2_table`, in logarithmic strains");
            let column = |c: usize| vector(&table.iter().map(|row| row[c]).collect::<Vec<_>>());
            return format!(
                "{{ j2_table = {{ {constants}, yield_stress = {}, plastic_strain = {} }} }}",
                column(0),
                column(1)
            );
        }
        let (law, how) = match large {
            true => ("st_venant_kirchhoff", "`st_venant_kirchhoff`, as in CalculiX: a step has NLGEOM"),
            false => ("linear_elastic", "`linear_elastic`: no step has NLGEOM"),
        };
        self.ledger.translated("ELASTIC", *elastic_line, how);
        format!("{{ {law} = {{ {constants} }} }}")
    }
}

/// An orthotropic material; its axes are x and y by default.
fn orthotropic(constants: &[f64; 9], axes: Option<[[f64; 3]; 2]>) -> String {
    let keys = ["e1", "e2", "e3", "nu12", "nu13", "nu23", "g12", "g13", "g23"];
    let constants: Vec<String> = keys.iter().zip(constants).map(|(key, value)| format!("{key} = {value:?}")).collect();
    let axes = axes
        .map_or(String::new(), |[first, second]| format!(", axis1 = {}, axis2 = {}", vector(&first), vector(&second)));
    format!("{{ orthotropic = {{ {}{axes} }} }}", constants.join(", "))
}

/// The law and how it is translated. Without compressibility, K = 20 μ, as in Abaqus and CalculiX.
fn hyperelastic(law: &Hyperelastic) -> (String, String) {
    let bulk = |mu: f64, d1: f64| if d1 > 0.0 { 2.0 / d1 } else { 20.0 * mu };
    let (text, name, d1) = match law {
        Hyperelastic::NeoHooke { c10, d1 } => {
            let mu = 2.0 * c10;
            let k = bulk(mu, *d1);
            let (e, nu) = (9.0 * k * mu / (3.0 * k + mu), (3.0 * k - 2.0 * mu) / (2.0 * (3.0 * k + mu)));
            let text =
                format!("neo_hooke = {{ youngs_modulus = {e:?}, poisson_ratio = {nu:?}, form = \"isochoric\" }}");
            (text, "neo_hooke", d1)
        }
        Hyperelastic::MooneyRivlin { c10, c01, d1 } => {
            let k = bulk(2.0 * (c10 + c01), *d1);
            (format!("mooney_rivlin = {{ c10 = {c10:?}, c01 = {c01:?}, bulk_modulus = {k:?} }}"), "mooney_rivlin", d1)
        }
        Hyperelastic::Yeoh { c: [c10, c20, c30], d1 } => {
            let k = bulk(2.0 * c10, *d1);
            let text = format!("yeoh = {{ c10 = {c10:?}, c20 = {c20:?}, c30 = {c30:?}, bulk_modulus = {k:?} }}");
            (text, "yeoh", d1)
        }
        Hyperelastic::Ogden { terms, d1 } => {
            let k = bulk(0.5 * terms.iter().map(|[mu, alpha]| mu * alpha).sum::<f64>(), *d1);
            let column = |c: usize| vector(&terms.iter().map(|term| term[c]).collect::<Vec<_>>());
            (format!("ogden = {{ mu = {}, alpha = {}, bulk_modulus = {k:?} }}", column(0), column(1)), "ogden", d1)
        }
    };
    let stiff = if *d1 > 0.0 { "K = 2/D1" } else { "D1 = 0: K = 20 μ" };
    (format!("{{ {text} }}"), format!("`{name}`, {stiff}"))
}

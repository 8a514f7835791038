//! Contact pairs, ties, couplings, springs and equations.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use slipstick_case::construct::{BuildError, equations_of, springs_of};
use slipstick_case::file::{Adjust, Contact, CouplingKind, Enforcement, Pressure, StiffnessScaling, Surfaces};
use slipstick_mesh::facet_area;
use slipstick_solid::spring::Acts;

use super::Writer;
use super::hardness::Moduli;
use super::text::{number, numbers};

/// Stiffness of contact where the case does not give one, over E/h of its bodies.
const AUTOMATIC: f64 = 10.0;
/// Distance within which ties are found, over the size of the largest facet of the pair.
const REACH: f64 = 2.0;

/// The bits of a stiffness and the component, `None` along the line between the ends; the ends of the springs.
type SpringSection = ((u64, Option<usize>), Vec<(u32, Option<u32>)>);

impl Writer<'_> {
    pub(super) fn contact(&mut self) {
        let moduli = self.moduli();
        for (i, contact) in self.case.contacts.iter().enumerate() {
            let at = |key: &str| format!("contact[{i}].{key}");
            let (slave, master) = (self.surface(&contact.slave), self.surface(&contact.master));
            let (Some(slave), Some(master)) = (slave, master) else {
                let message = format!("nothing is left of `{}` or `{}`", contact.slave, contact.master);
                self.refuse(
                    format!("contact[{i}]"),
                    message,
                    "choose a lower --threshold, or a solid skin at the surface",
                );
                continue;
            };
            let always = contact.active == Contact::ALWAYS;
            if contact.tied && always {
                let size = self.largest_facet(contact);
                let reach = number(contact.search_radius.unwrap_or(REACH * size));
                let name = self.names.fresh(&format!("tie_{}", i + 1));
                let _ =
                    writeln!(self.model, "*TIE, NAME={name}, POSITION TOLERANCE={reach}, ADJUST=NO\n{slave}, {master}");
                continue;
            }
            self.warn_of_divisions(contact, &at);
            let name = self.names.fresh(&format!("interaction_{}", i + 1));
            let _ = writeln!(self.model, "*SURFACE INTERACTION, NAME={name}");
            let automatic = AUTOMATIC * self.own_stiffness(contact);
            let [normal, tangential] = self.behavior(contact, automatic, &at);
            let friction = self.friction_of(contact);
            if contact.tied {
                let _ = writeln!(self.model, "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=TIED\n{}", number(automatic));
                let _ = writeln!(self.model, "*FRICTION\n0.5, {}", number(automatic));
            } else {
                let soft = match &contact.enforcement {
                    Enforcement::Penalty { pressure, .. } if self.options.contact_stiffness.is_none() => {
                        pressure.as_ref()
                    }
                    _ => None,
                };
                match (soft, normal.or_else(|| self.hardened(contact, &moduli, &at))) {
                    (Some(pressure), _) => {
                        self.warn_of_soft_contact(pressure, &at);
                        self.model.push_str(&soft_behavior(pressure));
                    }
                    (None, Some(slope)) => {
                        let _ =
                            writeln!(self.model, "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n{}", number(slope));
                    }
                    (None, None) => self.model.push_str("*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD\n"),
                }
                let limit = contact.shear_limit.map_or(String::new(), |limit| format!(", TAUMAX={}", number(limit)));
                let slope = tangential.unwrap_or(automatic);
                let first = self.friction_over_path(contact, friction, (&name, slope, &limit));
                if friction > 0.0 {
                    let _ = writeln!(self.model, "*FRICTION{limit}\n{}", numbers(&[first, slope]));
                    if !limit.is_empty() {
                        self.warn(
                            at("shear_limit"),
                            "CalculiX ignores TAUMAX",
                            "compare with Abaqus, or without the limit",
                        );
                    }
                }
            }
            let (adjust, clearance) = match &contact.adjust {
                None => (String::new(), None),
                Some(adjust @ Adjust::Chosen { nodes: None, distance, .. })
                    if adjust.gap() != 0.0 || distance.is_none() =>
                {
                    if adjust.distance().is_finite() {
                        let message = "in a deck, a clearance holds for all nodes, at any distance";
                        self.warn(at("adjust.distance"), message, "omit it to compare the same gaps");
                    }
                    if adjust.gap() < 0.0 {
                        let message = "CalculiX 2.20 applies a negative clearance again from zero in every step";
                        self.warn(
                            at("adjust.gap"),
                            message,
                            "use an `offset`, which is written as an overlap of the meshes",
                        );
                    }
                    (String::new(), Some(adjust.gap()))
                }
                Some(adjust) if adjust.nodes().is_none() && adjust.distance().is_finite() => {
                    (format!(", ADJUST={}", number(adjust.distance())), None)
                }
                Some(Adjust::Chosen { nodes: Some(nodes), distance: None, gap: 0.0 }) => {
                    match &self.node_sets(nodes)[..] {
                        [set] => (format!(", ADJUST={set}"), None),
                        _ => {
                            let message = format!("the nodes of `{nodes}` are not on one body");
                            self.refuse(at("adjust.nodes"), message, "name a set of nodes of the slave");
                            (String::new(), None)
                        }
                    }
                }
                Some(_) => {
                    let message = "a deck cannot give the nodes of a set a gap or a distance";
                    self.refuse(at("adjust"), message, "give `nodes` alone, a `distance` alone, or a `gap` alone");
                    (String::new(), None)
                }
            };
            let _ = writeln!(
                self.model,
                "*CONTACT PAIR, INTERACTION={name}, TYPE=SURFACE TO SURFACE{adjust}\n{slave}, {master}"
            );
            if !adjust.is_empty() {
                let message = "CalculiX and Abaqus move nodes of the slave, where here the gap is subtracted";
                self.warn(at("adjust"), message, "close the gaps in the mesh to compare the same geometry");
            }
            if let Some(gap) = clearance {
                let _ = writeln!(self.model, "*CLEARANCE, MASTER={master}, SLAVE={slave}, VALUE={}", number(gap));
            }
            self.offset(contact, &at);
            // facets of second-order elements are curved in a deck, those of linear ones flat
            let curved = self.is_curved(contact);
            if contact.surfaces == Surfaces::Smooth && !curved && !contact.tied {
                let message = "a deck has contact between the facets";
                self.warn(at("surfaces"), message, "set `surfaces = \"faceted\"` to compare the same gaps");
            }
            if contact.surfaces == Surfaces::Faceted && curved && !contact.tied {
                let message = "faces of second-order elements are curved in a deck";
                self.warn(at("surfaces"), message, "set `surfaces = \"smooth\"` to compare the same gaps");
            }
            if contact.slave == contact.master {
                self.warn(at("master"), "CalculiX has no contact of a surface with itself", "compare with Abaqus");
            }
            self.active(contact, &slave, &master);
        }
    }

    /// The slope of contact that CalculiX would soften if it were hard.
    fn hardened(&mut self, contact: &Contact, moduli: &Moduli<'_>, at: &dyn Fn(&str) -> String) -> Option<f64> {
        let hard = self.hard(moduli);
        let slope = self.firm(contact, moduli);
        if let Some(slope) = slope {
            let message = format!(
                "hard contact in CalculiX has the pressure per penetration {hard:.3e}, which is soft for these bodies: \
                 linear contact with {slope:.3e} is written"
            );
            self.warn(at("enforcement"), message, "`--contact-stiffness` sets another one");
        }
        let used = slope.unwrap_or(hard);
        self.slope = Some(self.slope.map_or(used, |known| known.max(used)));
        slope
    }

    /// The slopes of penalty, normal and tangential; none for hard contact.
    fn behavior(&mut self, contact: &Contact, automatic: f64, at: &dyn Fn(&str) -> String) -> [Option<f64>; 2] {
        if let Some(slope) = self.options.contact_stiffness {
            self.slope = Some(slope);
            return [Some(slope); 2];
        }
        let Enforcement::Penalty { pressure, stiffness, scaling, .. } = &contact.enforcement else { return [None; 2] };
        if !contact.enforcement.is_at_points() {
            let message = "a deck has pressures that follow from the gap at each integration point";
            let help = "set it to \"points\" to compare the same pressures";
            self.warn(at("enforcement.penalty.pressure_at"), message, help);
        }
        let Some(stiffness) = stiffness else {
            if pressure.is_some() && self.friction_of(contact) == 0.0 {
                return [Some(automatic); 2];
            }
            let message = format!("an automatic stiffness is written as one number, {automatic:.3e}");
            self.warn(at("enforcement.penalty.stiffness"), message, "give the stiffness to compare the same law");
            return [Some(automatic); 2];
        };
        match *scaling {
            StiffnessScaling::Area => {}
            StiffnessScaling::ReferenceArea => {
                let message = "a deck has pressure per penetration, with the current area";
                self.warn(at("enforcement.penalty.scaling"), message, "set it to \"area\" to compare the same law");
            }
            StiffnessScaling::Weighted => {
                let message = "the stiffness multiplies the weighted gap, which a deck does not have";
                self.refuse(
                    at("enforcement.penalty.scaling"),
                    message,
                    "set it to \"area\", with a stiffness per length",
                );
            }
        }
        [Some(stiffness.normal), Some(stiffness.tangential)]
    }

    /// The coefficient of friction in the load case.
    fn friction_of(&self, contact: &Contact) -> f64 {
        let load_case = self.case.load_cases.get(self.options.load_case);
        let own = load_case.and_then(|of| of.pairs.iter().find(|pair| pair.slave == contact.slave));
        own.map(|pair| pair.friction).or(load_case.and_then(|of| of.friction)).unwrap_or(contact.friction)
    }

    /// The steps in which a pair acts.
    fn active(&mut self, contact: &Contact, slave: &str, master: &str) {
        let steps = self.case.load_path.steps;
        let [from, to] = contact.active.map(|t| (t * steps as f64).round() as usize);
        let change = |what: &str| format!("*MODEL CHANGE, TYPE=CONTACT PAIR, {what}\n{slave}, {master}\n");
        if from > 0 {
            self.history.change(0, change("REMOVE"));
            self.history.change(from, change("ADD"));
        }
        if to < steps {
            self.history.change(to, change("REMOVE"));
        }
    }

    /// Whether a surface of a pair lies on second-order elements.
    pub(super) fn is_curved(&self, contact: &Contact) -> bool {
        let surfaces = [&contact.slave, &contact.master].into_iter().filter_map(|name| self.mesh.surfaces.get(name));
        let mut elements = surfaces.flat_map(|of| &of.facets).map(|facet| facet.element as usize);
        elements.any(|element| self.mesh.elements[element].is_second_order())
    }

    fn facet_areas(&self, surface: &str) -> Vec<f64> {
        let of = self.mesh.surfaces.get(surface).map_or(&[][..], |of| &of.facets[..]);
        of.iter().map(|facet| facet_area(&self.mesh.facet_coordinates(facet))).collect()
    }

    /// Root of the mean area of the facets. \[L\]
    pub(super) fn facet_size(&self, surface: &str) -> f64 {
        let areas = self.facet_areas(surface);
        (areas.iter().sum::<f64>() / areas.len().max(1) as f64).sqrt()
    }

    pub(super) fn largest_facet(&self, contact: &Contact) -> f64 {
        let areas = [&contact.slave, &contact.master].map(|name| self.facet_areas(name)).concat();
        areas.into_iter().fold(0.0, f64::max).sqrt()
    }

    /// E/h of the softer body of a pair, with the mean size h of the facets of the slave. \[F/L³\]
    fn own_stiffness(&self, contact: &Contact) -> f64 {
        let modulus = |name: &String| {
            let element = self.mesh.surfaces.get(name).and_then(|of| of.facets.first()).map(|facet| facet.element);
            let body = element.and_then(|element| self.mesh.body_of_element(element as usize));
            let body = body.map(|b| &self.case.bodies[b]).filter(|body| body.rigid.is_none());
            body.map_or(f64::INFINITY, |body| body.material.youngs_modulus())
        };
        let softer = modulus(&contact.slave).min(modulus(&contact.master));
        let size = self.facet_size(&contact.slave);
        if softer.is_finite() && size > 0.0 { softer / size } else { 1.0 }
    }

    pub(super) fn couplings(&mut self) {
        for (k, coupling) in self.case.couplings.iter().enumerate() {
            let Some(surface) = self.surface(&coupling.set) else {
                let message = format!("`{}` is not a surface; a coupling of a deck needs one", coupling.set);
                self.refuse(format!("coupling[{k}].set"), message, "couple a surface");
                continue;
            };
            let Some(of) = self.mesh.couplings.iter().find(|of| of.name == coupling.name) else { continue };
            let name = self.names.fresh(&coupling.name);
            // without components 4 to 6, CalculiX ignores moments
            let (kind, last) = match coupling.kind {
                CouplingKind::Distributing => ("DISTRIBUTING", 6),
                CouplingKind::Kinematic => ("KINEMATIC", 3),
            };
            let _ = writeln!(
                self.model,
                "*COUPLING, CONSTRAINT NAME={name}, REF NODE={}, SURFACE={surface}\n*{kind}\n1, {last}",
                of.reference + 1
            );
        }
    }

    /// Sections that are pulled together: the force, and the step that keeps the length.
    /// `touching` are the numbers of elements at each section that have no face there.
    pub(super) fn bolts(&mut self, touching: &[usize]) {
        let mesh = self.mesh;
        for (k, (bolt, cut)) in self.case.bolts.iter().zip(&mesh.cuts).enumerate() {
            if touching[k] > 0 {
                let message = format!(
                    "{} the section with an edge or a corner only, as tetrahedra do: CalculiX leaves both parts joined there",
                    if touching[k] == 1 {
                        "1 element touches".into()
                    } else {
                        format!("{} elements touch", touching[k])
                    }
                );
                let cure = "mesh the shank with layers of hexahedra or wedges at the section";
                self.refuse(format!("bolt[{k}].section"), message, cure);
            }
            let name = self.names.fresh(&cut.name);
            self.names.surfaces.insert(cut.surface(), name);
            let Some(surface) = self.surface(&cut.surface()) else { continue };
            // outward from the elements with the faces
            let (node, [x, y, z]) = (cut.reference + 1, cut.normal.map(|n| number(0.0 - n)));
            let _ = writeln!(self.model, "*PRE-TENSION SECTION, SURFACE={surface}, NODE={node}\n{x}, {y}, {z}");
            self.history.tighten(node, bolt);
        }
    }

    /// Notes couplings of nodes that are also held.
    pub(super) fn held_couplings(&mut self) {
        for (k, coupling) in self.case.couplings.iter().enumerate() {
            let nodes = self.mesh.set_nodes(&coupling.set).unwrap_or_default();
            let held = |node: &u32| (0..3).any(|c| self.history.supports.hold(&(*node, c)));
            if nodes.iter().any(held) {
                let message = "nodes of the face are held: CalculiX has no kinematic coupling of these, and counts the part \
                               of a force on them in no reaction";
                self.warn(format!("coupling[{k}].set"), message, "couple a face without held nodes");
            }
        }
    }

    pub(super) fn springs(&mut self) -> Result<(), BuildError> {
        let all = springs_of(self.case, self.mesh)?;
        for (i, springs) in all.iter().enumerate() {
            // springs with the same stiffness and components share a section
            let mut sections: Vec<SpringSection> = Vec::new();
            let mut oblique = false;
            for spring in springs {
                let mut components = match spring.acts {
                    Acts::Everywhere => vec![Some(0), Some(1), Some(2)],
                    Acts::Line(_) => vec![None],
                    Acts::Along(n) => match (0..3).find(|&c| n[c].abs() > 1.0 - 1e-12) {
                        Some(c) => vec![Some(c)],
                        None => {
                            oblique = true;
                            vec![]
                        }
                    },
                };
                let mut to = spring.to;
                if let (Acts::Line(r), None) = (spring.acts, to) {
                    // the ground is a node that does not move
                    let x = self.mesh.nodes[spring.node as usize];
                    let ground: [f64; 3] = std::array::from_fn(|c| x[c] - r[c]);
                    self.next_node += 1;
                    let node = self.next_node;
                    let _ = writeln!(self.model, "*NODE\n{node}, {}", numbers(&ground));
                    self.history.supports.ground(node);
                    to = Some(node - 1);
                }
                for component in components.drain(..) {
                    let key = (spring.stiffness.to_bits(), component);
                    match sections.iter_mut().find(|(known, _)| *known == key) {
                        Some((_, members)) => members.push((spring.node, to)),
                        None => sections.push((key, vec![(spring.node, to)])),
                    }
                }
            }
            if oblique {
                let message = "springs of a deck act along an axis, or along the line between their ends";
                self.refuse(format!("spring[{i}].direction"), message, "choose an axis, or \"line\"");
            }
            for ((stiffness, component), members) in sections {
                let set =
                    self.names.fresh(&format!("{}_{}", self.case.springs[i].name, component.map_or(0, |c| c + 1)));
                let kind = match (component, members[0].1) {
                    (None, _) => "SPRINGA",
                    (Some(_), Some(_)) => "SPRING2",
                    (Some(_), None) => "SPRING1",
                };
                let _ = writeln!(self.model, "*ELEMENT, TYPE={kind}, ELSET={set}");
                for (node, to) in members {
                    self.next_element += 1;
                    let to_text = to.map_or(String::new(), |to| format!(", {}", to + 1));
                    let _ = writeln!(self.model, "{}, {}{to_text}", self.next_element, node + 1);
                }
                let components = match (component, kind) {
                    (Some(c), "SPRING2") => format!("{}, {}", c + 1, c + 1),
                    (Some(c), _) => format!("{}", c + 1),
                    (None, _) => String::new(),
                };
                let stiffness = number(f64::from_bits(stiffness));
                let _ = writeln!(self.model, "*SPRING, ELSET={set}\n{components}\n{stiffness}");
            }
        }
        Ok(())
    }

    pub(super) fn equations(&mut self) -> Result<(), BuildError> {
        let all = equations_of(self.case, self.mesh)?;
        let mut dependent: BTreeSet<u32> = BTreeSet::new();
        let mut used: BTreeSet<u32> = BTreeSet::new();
        let rotations: BTreeSet<u32> = self.mesh.rigid.iter().map(|rigid| rigid.rotation()).collect();
        let centres = self.mesh.serendipity_centres(0..self.mesh.elements.len(), &BTreeSet::new());
        let centres: BTreeMap<u32, Vec<(u32, f64)>> = centres.into_iter().map(|of| (of.node, of.terms)).collect();
        let has_centre = |terms: &[(u32, f64)]| terms.iter().any(|(unknown, _)| centres.contains_key(&(unknown / 3)));
        let mut written: BTreeMap<u32, Vec<(u32, f64)>> = BTreeMap::new();
        // those of centres of faces, which the deck lacks, come last: most follow from those of the other nodes
        for last in [false, true] {
            let all = all.iter().enumerate().flat_map(|(i, of)| of.iter().map(move |terms| (i, terms)));
            for (i, terms) in all.filter(|(_, terms)| has_centre(terms) == last) {
                // one term for each unknown
                let mut merged: Vec<(u32, f64)> = Vec::new();
                for &(unknown, factor) in terms {
                    match centres.get(&(unknown / 3)) {
                        Some(of) => {
                            of.iter().for_each(|&(node, w)| add(&mut merged, 3 * node + unknown % 3, factor * w))
                        }
                        None => add(&mut merged, unknown, factor),
                    }
                }
                if last {
                    let size = merged.iter().fold(0.0, |size: f64, (_, factor)| size.max(factor.abs()));
                    while let Some(at) = merged.iter().position(|(unknown, _)| written.contains_key(unknown)) {
                        let (unknown, factor) = merged.swap_remove(at);
                        let of = &written[&unknown];
                        of[1..].iter().for_each(|&(other, own)| add(&mut merged, other, -factor * own / of[0].1));
                    }
                    merged.retain(|(_, factor)| factor.abs() > 1e-12 * size);
                }
                merged.retain(|(_, factor)| *factor != 0.0);
                let free = |&(unknown, _): &(u32, f64)| {
                    let key = (unknown / 3, (unknown % 3) as u8);
                    !self.history.supports.hold(&key) && !dependent.contains(&unknown) && !used.contains(&unknown)
                };
                let reference = |node: u32| {
                    self.mesh.rigid.iter().any(|rigid| rigid.reference == node) || rotations.contains(&node)
                };
                let first = merged
                    .iter()
                    .position(|term| free(term) && !reference(term.0 / 3))
                    .or_else(|| merged.iter().position(free));
                let Some(first) = first else {
                    if merged
                        .iter()
                        .any(|(unknown, _)| !self.history.supports.hold(&(unknown / 3, (unknown % 3) as u8)))
                    {
                        let message = "no term is left that the equation could determine in CalculiX";
                        self.refuse(
                            format!("equation[{i}]"),
                            message,
                            "order the equations so that each has an unknown of its own",
                        );
                    }
                    continue;
                };
                merged.swap(0, first);
                dependent.insert(merged[0].0);
                written.insert(merged[0].0, merged.clone());
                used.extend(merged[1..].iter().map(|(unknown, _)| *unknown));
                let _ = writeln!(self.model, "*EQUATION\n{}", merged.len());
                for line in merged.chunks(4) {
                    let term = |&(unknown, factor): &(u32, f64)| {
                        format!("{}, {}, {}", unknown / 3 + 1, unknown % 3 + 1, number(factor))
                    };
                    let _ = writeln!(self.model, "{}", line.iter().map(term).collect::<Vec<_>>().join(", "));
                }
            }
        }
        Ok(())
    }
}

/// Adds to the factor of an unknown.
fn add(terms: &mut Vec<(u32, f64)>, unknown: u32, factor: f64) {
    match terms.iter_mut().find(|(known, _)| *known == unknown) {
        Some((_, sum)) => *sum += factor,
        None => terms.push((unknown, factor)),
    }
}

/// A pressure that is not in proportion to the penetration.
fn soft_behavior(pressure: &Pressure) -> String {
    let (word, rows) = match pressure {
        &Pressure::Exponential { contact_pressure, clearance } => {
            ("EXPONENTIAL", vec![numbers(&[clearance, contact_pressure])])
        }
        Pressure::Table { penetration, pressure } => {
            let row = |(penetration, pressure): (&f64, &f64)| numbers(&[*pressure, *penetration]);
            ("TABULAR", penetration.iter().zip(pressure).map(row).collect())
        }
    };
    format!("*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE={word}\n{}\n", rows.join("\n"))
}

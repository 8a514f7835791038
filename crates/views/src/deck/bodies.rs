//! Nodes, elements, sets, surfaces, materials and sections.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fmt::Write as _;

use slipstick_case::file::Enforcement;
use slipstick_mesh::{Element, Mesh};
use slipstick_solid::{Formulation, LawKind, Material, Section, Value};

use super::Writer;
use super::text::{list, number, numbers, proper};

/// Names in the deck, and the sets that it needs.
pub(super) struct Names {
    /// Names that are taken, in capitals.
    taken: BTreeSet<String>,
    /// Name of each body.
    pub bodies: Vec<String>,
    /// Surfaces that are written: names in the mesh and in the deck.
    pub surfaces: BTreeMap<String, String>,
    /// Sets of nodes that are written, by name in the deck.
    pub nodes: BTreeMap<String, Vec<u32>>,
    /// The sets of nodes of each set or surface of the mesh, one for each body.
    pub sets: BTreeMap<String, Vec<String>>,
}

impl Names {
    pub fn new(mesh: &Mesh) -> Self {
        let mut names = Self {
            taken: BTreeSet::new(),
            bodies: vec![],
            surfaces: BTreeMap::new(),
            nodes: BTreeMap::new(),
            sets: BTreeMap::new(),
        };
        for body in &mesh.bodies {
            let name = names.fresh(&body.name);
            names.bodies.push(name);
        }
        names
    }

    /// A name that nothing has, similar to this one.
    pub fn fresh(&mut self, name: &str) -> String {
        let mut name = proper(name);
        while !self.taken.insert(name.to_ascii_uppercase()) {
            name.push('_');
        }
        name
    }

    /// A name on a body: read again, the set has this name in the case.
    fn on(&mut self, body: usize, name: &str) -> String {
        let body = self.bodies[body].clone();
        let has = name.strip_prefix(&body).is_some_and(|rest| rest.starts_with('_'));
        self.fresh(&if has { name.to_owned() } else { format!("{body}_{name}") })
    }
}

impl Writer<'_> {
    pub(super) fn heading(&self) -> String {
        let title = if self.case.title.is_empty() { "slipstick" } else { &self.case.title };
        let title: String = title.chars().map(|c| if c.is_ascii() && !c.is_control() { c } else { '_' }).collect();
        let units = &self.case.units;
        let mut text = format!("*HEADING\n{}\n** written by slipstick {}\n", title.trim(), env!("CARGO_PKG_VERSION"));
        if let (Some(length), Some(force)) = (&units.length, &units.force) {
            let _ = writeln!(text, "** units: {length}, {force}");
        }
        text
    }

    /// The body of a node of an element.
    pub(super) fn body_of(&self, node: u32) -> Option<usize> {
        self.mesh.bodies.iter().position(|body| body.nodes.contains(&(node as usize)))
    }

    /// The name of a surface in the deck, which then has it; `None` if there is no facet.
    pub(super) fn surface(&mut self, name: &str) -> Option<String> {
        if let Some(known) = self.names.surfaces.get(name) {
            return Some(known.clone());
        }
        let first = self.mesh.surfaces.get(name)?.facets.first()?;
        let bodies =
            self.mesh.surfaces[name].facets.iter().filter_map(|f| self.mesh.body_of_element(f.element as usize));
        let bodies: BTreeSet<usize> = bodies.collect();
        let own = match bodies.len() {
            1 => self.names.on(self.mesh.body_of_element(first.element as usize)?, name),
            _ => self.names.fresh(name),
        };
        self.names.surfaces.insert(name.to_owned(), own.clone());
        Some(own)
    }

    /// Names of the sets of nodes that a set or surface has in the deck, one for each body.
    pub(super) fn node_sets(&mut self, name: &str) -> Vec<String> {
        if let Some(known) = self.names.sets.get(name) {
            return known.clone();
        }
        let mut of_body: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
        for &node in self.mesh.set_nodes(name).unwrap_or_default().iter() {
            if let Some(body) = self.body_of(node) {
                of_body.entry(body).or_default().push(node);
            }
        }
        let surface = self.mesh.surfaces.contains_key(name);
        let mut all = Vec::new();
        for (body, nodes) in of_body {
            let base = if surface { format!("{name}_nodes") } else { name.to_owned() };
            let own = self.names.on(body, &base);
            self.names.nodes.insert(own.clone(), self.deck_nodes(nodes));
            all.push(own);
        }
        self.names.sets.insert(name.to_owned(), all.clone());
        all
    }

    /// A set of nodes that the case does not name.
    pub(super) fn new_set(&mut self, name: &str, nodes: Vec<u32>) -> String {
        let own = self.names.fresh(name);
        self.names.nodes.insert(own.clone(), self.deck_nodes(nodes));
        own
    }

    /// The nodes that the deck has: not those at the centres of faces and elements of second order.
    fn deck_nodes(&self, nodes: Vec<u32>) -> Vec<u32> {
        let dropped = self.dropped();
        nodes.into_iter().filter(|node| !dropped.contains(node)).collect()
    }

    /// Nodes at the centres of faces and elements of second order, which decks do not have.
    pub(super) fn dropped(&self) -> BTreeSet<u32> {
        let of = |element: &Element| match element {
            Element::Hex27(nodes) => nodes[20..].to_vec(),
            Element::Wedge18(nodes) => nodes[15..].to_vec(),
            _ => Vec::new(),
        };
        self.mesh.elements.iter().flat_map(of).collect()
    }

    /// Warns of slave faces of serendipity bodies whose centres are unknowns, which decks do not have.
    fn warn_of_free_centres(&mut self, dropped: &BTreeSet<u32>) {
        for (i, contact) in self.case.contacts.iter().enumerate() {
            let Some(slave) = self.mesh.surfaces.get(&contact.slave) else { continue };
            let free = contact.tied || !matches!(contact.enforcement, Enforcement::Penalty { .. });
            let serendipity = |node: &u32| {
                let body = self.body_of(*node).map(|body| &self.case.bodies[body]);
                body.is_some_and(|body| body.rigid.is_none() && !body.shape_functions.are_lagrange())
            };
            if free && slave.nodes().iter().any(|node| dropped.contains(node) && serendipity(node)) {
                let message = format!(
                    "the centres of the slave faces of `{}` are unknowns, which C3D20 and C3D15 lack",
                    contact.slave
                );
                let help = "use `penalty`, with which these centres follow from the other nodes, to compare the same \
                            elements";
                self.warn(format!("contact[{i}]"), message, help);
            }
        }
    }

    /// Nodes, elements, materials and sections.
    pub(super) fn bodies(&mut self) -> String {
        let mut text = String::from("*NODE\n");
        let dropped = self.dropped();
        let reduced = self.case.bodies.iter().zip(&self.mesh.bodies).any(|(body, of)| {
            let quadratic = |e: usize| matches!(self.mesh.elements[e], Element::Wedge18(_) | Element::Hex27(_));
            body.shape_functions.are_lagrange() && of.elements.clone().any(quadratic)
        });
        if reduced {
            let message = "hexahedra with 27 nodes are written with 20 (C3D20), and wedges with 18 nodes with 15 \
                           (C3D15), which are stiffer";
            let help = "use `shape_functions = \"serendipity\"`, tetrahedra (C3D10) or linear elements to compare the \
                        same elements";
            self.warn("body.order", message, help);
        }
        self.warn_of_free_centres(&dropped);
        for (node, x) in (0_u32..).zip(&self.mesh.nodes).filter(|(node, _)| !dropped.contains(node)) {
            let _ = writeln!(text, "{}, {}", node + 1, numbers(x));
        }
        let all = self.sections;
        for b in 0..self.mesh.bodies.len() {
            self.body(b, &all.list[b], &mut text);
        }
        let mut of_element: HashMap<u32, usize> = HashMap::new();
        for (r, (_, elements)) in all.regions.iter().enumerate() {
            of_element.extend(elements.iter().map(|&element| (element, r)));
        }
        let small = self.small();
        for b in 0..self.mesh.bodies.len() {
            let name = self.names.bodies[b].clone();
            let mut parts = Vec::new();
            if all.regions.iter().all(|(of, _)| *of != b) {
                parts.push((name.clone(), &all.list[b]));
            } else {
                let mut found: BTreeMap<Option<usize>, Vec<u32>> = BTreeMap::new();
                for element in self.mesh.bodies[b].elements.clone().map(|e| e as u32) {
                    found.entry(of_element.get(&element).copied()).or_default().push(element);
                }
                for (region, elements) in found {
                    let section = &all.list[region.map_or(b, |r| self.mesh.bodies.len() + r)];
                    let set = self.names.fresh(&format!("{name}_section_{}", parts.len() + 1));
                    let _ = writeln!(text, "*ELSET, ELSET={set}");
                    list(&mut text, elements);
                    parts.push((set, section));
                }
            }
            for (set, section) in parts {
                let material = self.names.fresh(&format!("{set}_material"));
                self.material(b, &material, section, small, &mut text);
                let turned = match section.material {
                    Material::Orthotropic(_) => self.orientation(&section.material, &material, &mut text),
                    _ => String::new(),
                };
                let _ = writeln!(text, "*SOLID SECTION, ELSET={set}, MATERIAL={material}{turned}");
            }
        }
        text
    }

    /// Mass per reference volume of all elements.
    pub(super) fn masses(&self) -> Vec<f64> {
        let all = self.sections;
        let mut masses = vec![0.0; self.mesh.elements.len()];
        for (body, section) in self.mesh.bodies.iter().zip(&all.list) {
            masses[body.elements.clone()].fill(section.mass_density);
        }
        for ((_, elements), section) in all.regions.iter().zip(&all.list[self.mesh.bodies.len()..]) {
            elements.iter().for_each(|&element| masses[element as usize] = section.mass_density);
        }
        masses
    }

    /// Whether all laws are linear elasticity, so that steps have no NLGEOM.
    pub(super) fn small(&self) -> bool {
        let deforms = self.case.bodies.iter().filter(|body| body.rigid.is_none());
        deforms.flat_map(|body| body.materials()).all(|of| matches!(of, Material::LinearElastic(_)))
    }

    fn body(&mut self, b: usize, section: &Section, text: &mut String) {
        let name = self.names.bodies[b].clone();
        let mut of_type: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
        for e in self.mesh.bodies[b].elements.clone() {
            let kind = match (&self.mesh.elements[e], section.formulation) {
                (Element::Tet4(_), _) => "C3D4",
                (Element::Wedge6(_), _) => "C3D6",
                (Element::Hex8(_), Formulation::Full | Formulation::Reduced) => "C3D8",
                (Element::Hex8(_), Formulation::FBar) => "C3D8I",
                (Element::Tet10(_), _) => "C3D10",
                (Element::Wedge18(_), _) => "C3D15",
                (Element::Hex27(_), Formulation::Reduced) => "C3D20R",
                (Element::Hex27(_), _) => "C3D20",
            };
            of_type.entry(kind).or_default().push(e);
        }
        if of_type.contains_key("C3D8I") {
            let message = format!(
                "hexahedra with F̄ of `{}` are written as C3D8I, with incompatible modes",
                self.case.bodies[b].name
            );
            self.warn(
                format!("body[{b}].element"),
                message,
                "compare with `element = \"full\"` where the material is not nearly incompressible",
            );
        }
        if section.formulation == Formulation::FBar && of_type.keys().any(|kind| *kind != "C3D8I") {
            let message = format!(
                "F̄ is lost in `{}`: tetrahedra, wedges and elements of second order of a deck have their plain formulation",
                self.case.bodies[b].name
            );
            self.warn(
                format!("body[{b}].element"),
                message,
                "compare with `element = \"full\"` where the material is not nearly incompressible",
            );
        }
        for (kind, elements) in of_type {
            let _ = writeln!(text, "*ELEMENT, TYPE={kind}, ELSET={name}");
            for e in elements {
                let nodes = self.mesh.elements[e].nodes();
                let count = match kind {
                    "C3D15" => 15,
                    "C3D20" | "C3D20R" => 20,
                    _ => nodes.len(),
                };
                let nodes = &nodes[..count];
                let fields: Vec<String> = nodes.iter().map(|node| (node + 1).to_string()).collect();
                let _ = write!(text, "{}, {}", e + 1, fields[..fields.len().min(10)].join(", "));
                if fields.len() > 10 {
                    let _ = write!(text, ",\n{}", fields[10..].join(", "));
                }
                text.push('\n');
            }
        }
        if let Some(rigid) = self.mesh.rigid.iter().find(|rigid| rigid.body == b) {
            let _ = writeln!(
                text,
                "*RIGID BODY, ELSET={name}, REF NODE={}, ROT NODE={}",
                rigid.reference + 1,
                rigid.rotation() + 1
            );
        }
    }

    /// A material with its constants.
    fn material(&mut self, b: usize, name: &str, section: &Section, small: bool, text: &mut String) {
        let _ = writeln!(text, "*MATERIAL, NAME={name}");
        let material = self.stiffened(b, section.material);
        let (word, kind) = (material.kind().word(), material.kind());
        let value: HashMap<&str, Value> = material.constants().map(|(constant, value)| (constant.key, value)).collect();
        let one = |key: &str| value.get(key).and_then(|value| value.numbers().first().copied()).unwrap_or(0.0);
        let many = |key: &str| value.get(key).map_or(Vec::new(), |value| value.numbers().to_vec());
        let key = format!("body[{b}].material.{word}");
        let rigid = self.case.bodies[b].rigid.is_some();
        let hooke = || format!("*ELASTIC\n{}\n", numbers(&[one("youngs_modulus"), one("poisson_ratio")]));
        let bulk = || number(2.0 / one("bulk_modulus"));
        match kind {
            LawKind::LinearElastic => {
                text.push_str(&hooke());
                if !small && !rigid {
                    let message = "other bodies need NLGEOM, with which this one is that of Saint-Venant and Kirchhoff";
                    self.warn(key, message, "use the same kind of law for all bodies");
                }
            }
            LawKind::StVenantKirchhoff => text.push_str(&hooke()),
            LawKind::Hencky => {
                text.push_str(&hooke());
                let message = "written as *ELASTIC: logarithmic strains in Abaqus, those of Green in CalculiX";
                self.warn(key, message, "the laws agree at small strains");
            }
            LawKind::NeoHooke | LawKind::NeoHookeLn | LawKind::NeoHookeIsochoric => {
                let (e, nu) = (one("youngs_modulus"), one("poisson_ratio"));
                let (mu, bulk) = (0.5 * e / (1.0 + nu), e / (3.0 * (1.0 - 2.0 * nu)));
                let _ = writeln!(text, "*HYPERELASTIC, NEO HOOKE\n{}", numbers(&[0.5 * mu, 2.0 / bulk]));
                if kind != LawKind::NeoHookeIsochoric && !rigid {
                    let message = "decks have only the isochoric form, which differs where the volume changes much";
                    self.warn(key, message, "set `form = \"isochoric\"` to compare the same law");
                }
            }
            LawKind::MooneyRivlin => {
                let _ =
                    writeln!(text, "*HYPERELASTIC, MOONEY-RIVLIN\n{}, {}", numbers(&[one("c10"), one("c01")]), bulk());
            }
            LawKind::Yeoh => {
                let c = numbers(&[one("c10"), one("c20"), one("c30")]);
                let _ = writeln!(text, "*HYPERELASTIC, YEOH\n{c}, {}, 0.0, 0.0", bulk());
            }
            LawKind::Ogden => {
                // the energy is μ/α (λ₁^α + …) here and 2μ/α² (λ₁^α + …) there
                let terms = many("mu").into_iter().zip(many("alpha"));
                let terms: Vec<f64> = terms.flat_map(|(mu, alpha)| [0.5 * mu * alpha, alpha]).collect();
                let count = terms.len() / 2;
                let fields: Vec<String> =
                    terms.iter().map(|x| number(*x)).chain([bulk()]).chain(vec!["0.0".into(); count - 1]).collect();
                let lines: Vec<String> = fields.chunks(8).map(|line| line.join(", ")).collect();
                let _ = writeln!(text, "*HYPERELASTIC, OGDEN, N={count}\n{}", lines.join("\n"));
            }
            LawKind::Orthotropic => {
                let keys = ["e1", "e2", "e3", "nu12", "nu13", "nu23", "g12", "g13", "g23"];
                let all = keys.map(one);
                let _ =
                    writeln!(text, "*ELASTIC, TYPE=ENGINEERING CONSTANTS\n{},\n{}", numbers(&all[..8]), number(all[8]));
            }
            LawKind::J2Linear | LawKind::J2Voce | LawKind::J2Swift | LawKind::J2Table => {
                let table = material.hardening().expect("laws of plasticity harden");
                text.push_str(&hooke());
                let rows =
                    table.stresses.iter().zip(&table.strains).map(|(stress, strain)| numbers(&[*stress, *strain]));
                let _ = writeln!(text, "*PLASTIC\n{}", rows.collect::<Vec<_>>().join("\n"));
                if !table.exact {
                    let count = table.strains.len();
                    let message = format!("the curve of hardening is written as a table of {count} rows");
                    self.warn(key, message, "between the rows, the table is slightly below the curve");
                }
            }
        }
        let hexahedra = self.mesh.bodies[b].elements.clone().any(|e| matches!(self.mesh.elements[e], Element::Hex8(_)));
        if kind.has_memory() && section.formulation == Formulation::Full && hexahedra {
            let message = "plastic hexahedra are integrated fully here, and read again with F̄";
            self.warn(format!("body[{b}].element"), message, "set `element = \"f_bar\"`");
        }
        if section.mass_density > 0.0 {
            let _ = writeln!(text, "*DENSITY\n{}", number(section.mass_density));
        }
        if section.thermal_expansion != 0.0 && !rigid {
            let _ = writeln!(text, "*EXPANSION\n{}", number(section.thermal_expansion));
        }
    }

    /// The axes of an orthotropic material; the parameter of its section.
    fn orientation(&mut self, material: &Material, name: &str, text: &mut String) -> String {
        let value: HashMap<&str, Value> = material.constants().map(|(constant, value)| (constant.key, value)).collect();
        let axis = |key: &str, default: [f64; 3]| {
            value.get(key).and_then(|value| <[f64; 3]>::try_from(value.numbers()).ok()).unwrap_or(default)
        };
        let axes = [axis("axis1", [1.0, 0.0, 0.0]), axis("axis2", [0.0, 1.0, 0.0])].concat();
        let name = self.names.fresh(&format!("{name}_axes"));
        let _ = writeln!(text, "*ORIENTATION, NAME={name}\n{}", numbers(&axes));
        format!(", ORIENTATION={name}")
    }

    /// The material with the factors of the load case on its modulus.
    pub(super) fn stiffened(&self, b: usize, material: Material) -> Material {
        let Some(load_case) = self.case.load_cases.get(self.options.load_case) else { return material };
        let own = load_case.bodies.iter().find(|of| of.body == self.case.bodies[b].name);
        let factor = own.and_then(|of| of.modulus_factor).unwrap_or(1.0) * load_case.modulus_factor.unwrap_or(1.0);
        if factor == 1.0 { material } else { material.stiffened(factor).unwrap_or(material) }
    }

    /// Sets of nodes and surfaces that something uses.
    pub(super) fn sets(&self) -> String {
        let mut text = String::new();
        for (name, nodes) in &self.names.nodes {
            let _ = writeln!(text, "*NSET, NSET={name}");
            list(&mut text, nodes.iter().copied());
        }
        for (of, name) in &self.names.surfaces {
            let _ = writeln!(text, "*SURFACE, NAME={name}, TYPE=ELEMENT");
            let mut seen = BTreeSet::new();
            for facet in &self.mesh.surfaces[of].facets {
                let element = &self.mesh.elements[facet.element as usize];
                let nodes = facet.nodes.sorted();
                let side = (0..element.sides()).find(|&side| element.side(side).sorted() == nodes);
                let face =
                    side.map(|side| if element.is_second_order() { side / slipstick_mesh::SUB_FACETS } else { side });
                if let Some(face) = face.filter(|&face| seen.insert((facet.element, face))) {
                    let _ = writeln!(text, "{}, S{}", facet.element + 1, face + 1);
                }
            }
        }
        text
    }
}

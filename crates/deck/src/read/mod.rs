//! Reads the keywords of a deck: what it says, before it meets a mesh.

mod bolt;
mod connector;
mod contact;
mod coupling;
mod equation;
mod general_contact;
mod material;
mod mpc;
mod node_names;
mod orientation;
mod refused;
mod spring;
mod step;
mod temperature;
mod transform;

use std::collections::BTreeMap;

use slipstick_meshio::abaqus::Card;

use crate::ledger::Ledger;

use connector::Connectors;
use general_contact::General;

pub use bolt::Pretension;
pub use contact::{Adjust, Behavior, Friction, Interaction, Pair, Rigid, Tie};
pub use coupling::Coupling;
pub use equation::{Equation, EquationTerm};
pub use material::{Elastic, Hyperelastic, Material, TableOf};
pub use mpc::{Mpc, MpcKind};
pub use orientation::Orientation;
pub use spring::{CONNECTOR, SpringElement, SpringSection};
#[cfg(test)]
pub use step::Change;
pub use step::{Condition, Field, NORMAL, On, Step, Target};
pub use transform::Transform;

/// A deck without its mesh. Names are in capitals where other keywords refer to them.
#[derive(Debug, Default)]
pub struct Deck {
    /// The first line of `*HEADING`.
    pub title: String,
    pub materials: BTreeMap<String, Material>,
    pub sections: Vec<Section>,
    /// By name; amplitudes by time in a step or in total.
    pub amplitudes: BTreeMap<String, Amplitude>,
    pub interactions: BTreeMap<String, Interaction>,
    pub pairs: Vec<Pair>,
    pub ties: Vec<Tie>,
    pub rigids: Vec<Rigid>,
    pub spring_elements: Vec<SpringElement>,
    pub springs: Vec<SpringSection>,
    pub equations: Vec<Equation>,
    pub mpcs: Vec<Mpc>,
    pub couplings: Vec<Coupling>,
    pub pretensions: Vec<Pretension>,
    pub transforms: Vec<Transform>,
    /// By name.
    pub orientations: BTreeMap<String, Orientation>,
    /// Conditions before the first step.
    pub conditions: Vec<Condition>,
    pub initial_temperatures: Vec<Condition>,
    pub steps: Vec<Step>,
    pub element_types: Vec<ElementType>,
    /// Sets or numbers of elements in surfaces of facets, and whether the side of their normals touches (`SPOS`), not the other (`SNEG`).
    pub shell_sides: Vec<(String, bool)>,
    /// Solids that are added behind rigid surfaces, ascending.
    pub thickened: Vec<u32>,
}

/// `*ELEMENT`, except springs.
#[derive(Debug)]
pub struct ElementType {
    /// In capitals.
    pub name: String,
    /// `ELSET`, as written.
    pub set: Option<String>,
    /// The elements' numbers, if they are facets of rigid surfaces without `ELSET`.
    pub facets: Vec<u64>,
    pub line: usize,
}

impl ElementType {
    /// Whether they are hexahedra of 8 nodes against locking: `C3D8R`, `C3D8I` and others.
    pub fn is_soft(&self) -> bool {
        self.name.len() > 4 && self.name.starts_with("C3D8")
    }

    /// Whether they are hexahedra of 20 nodes with reduced integration: `C3D20R`.
    pub fn is_reduced(&self) -> bool {
        self.name.starts_with("C3D20R")
    }
}

/// `*SOLID SECTION`.
#[derive(Debug)]
pub struct Section {
    pub set: String,
    pub material: String,
    pub orientation: Option<String>,
    pub line: usize,
}

/// `*AMPLITUDE`: times and factors.
#[derive(Debug)]
pub struct Amplitude {
    pub points: Vec<[f64; 2]>,
    /// Whether slope and curvature are zero at each time (`SMOOTH STEP`); otherwise, it is linear in between.
    pub smooth: bool,
    /// Whether times count from the start of the first step.
    pub total: bool,
}

/// Reads all keywords, each with an entry in the ledger.
pub fn deck(cards: &[Card<'_>], ledger: &mut Ledger) -> Deck {
    let mut reader = Reader {
        deck: Deck::default(),
        ledger,
        material: None,
        interaction: None,
        changes: false,
        unused_change: None,
        in_step: false,
        node_names: node_names::single(cards),
        connectors: Connectors::default(),
        general: General::default(),
        spring_sets: Vec::new(),
        masses: Vec::new(),
    };
    for card in cards {
        if !reader.changes {
            reader.refuse_unused_change();
        }
        reader.card(card);
        reader.changes &= card.keyword.name.starts_with("CHANGE ");
    }
    reader.refuse_unused_change();
    reader.connector_springs();
    reader.assign_properties();
    reader.refuse_loose_springs();
    reader.refuse_loaded_masses();
    reader.refuse_half_new();
    reader.deck
}

struct Reader<'l> {
    deck: Deck,
    ledger: &'l mut Ledger,
    /// The material that options belong to.
    material: Option<String>,
    interaction: Option<String>,
    /// Whether the last keyword was `*CHANGE …`.
    changes: bool,
    /// The last `*CHANGE …` and its line, until a keyword says what it changes.
    unused_change: Option<(String, usize)>,
    in_step: bool,
    /// The nodes of sets that have only one, by their names in capitals.
    node_names: BTreeMap<String, u64>,
    connectors: Connectors,
    general: General,
    /// The sets of spring elements, in capitals, that a section names, whether it is supported or not.
    spring_sets: Vec<String>,
    /// The lines of `*MASS`.
    masses: Vec<usize>,
}

const DAMAGED: &str = "correct the line";

impl Reader<'_> {
    fn refuse_unused_change(&mut self) {
        if let Some((name, line)) = self.unused_change.take() {
            let cure = "write *FRICTION or *SURFACE BEHAVIOR after it, or remove it";
            self.ledger.wrong(&name, [line; 2], "nothing after it says what changes", cure);
        }
    }

    fn card(&mut self, card: &Card<'_>) {
        let (name, line) = (card.keyword.name.as_str(), card.keyword.line);
        if self.ledger.ignores(name) {
            return self.ledger.ignored(name, line, "as requested");
        }
        match name {
            "HEADING" => {
                self.deck.title = card.first_line().unwrap_or_default().to_owned();
                self.ledger.translated(name, line, "`title`");
            }
            "NODE" | "NSET" | "ELSET" | "SURFACE" => {
                self.ledger.used(name, line);
                self.spring_set(card);
                let of_nodes = card.keyword.parameter("TYPE").is_some_and(|of| of.eq_ignore_ascii_case("NODE"));
                if name == "SURFACE" && !of_nodes {
                    let sided = |fields: &Vec<&str>, side: &str| {
                        fields.get(1).is_some_and(|of| of.is_empty() || of.eq_ignore_ascii_case(side))
                            || fields.len() == 1
                    };
                    for (_, fields) in card.data() {
                        for (side, positive) in [("SPOS", true), ("SNEG", false)] {
                            if sided(&fields, side) {
                                self.deck.shell_sides.push((fields[0].trim_matches('"').to_owned(), positive));
                            }
                        }
                    }
                }
            }
            "SPRING" => self.spring(card),
            "CONNECTOR SECTION" => self.connector_section(card),
            "CONNECTOR BEHAVIOR" => self.connector_behavior(card),
            "CONNECTOR ELASTICITY" => self.connector_elasticity(card),
            "CONTACT" => self.general_contact(card),
            "CONTACT INCLUSIONS" => self.inclusions(card),
            "CONTACT PROPERTY ASSIGNMENT" => self.properties(card),
            "EQUATION" => self.equations(card),
            "MPC" => self.mpc(card),
            "PRE-TENSION SECTION" => self.pretension(card),
            "TRANSFORM" => self.transform(card),
            "ORIENTATION" => self.orientation(card),
            "COUPLING" => self.coupling(card),
            "KINEMATIC" | "DISTRIBUTING" => self.coupled(card, name == "KINEMATIC"),
            "ELEMENT" => self.element(card),
            "SOLID SECTION" => self.section(card),
            "AMPLITUDE" => self.amplitude(card),
            _ => {
                let known = self.of_material(card) || self.of_contact(card) || self.of_step(card);
                if !(known || self.of_temperature(card)) {
                    self.refused(card);
                }
            }
        }
    }

    fn element(&mut self, card: &Card<'_>) {
        let keyword = &card.keyword;
        let kind = keyword.parameter("TYPE").unwrap_or_default().to_ascii_uppercase();
        if self.spring_elements(card, &kind) {
            return;
        }
        let set = keyword.parameter("ELSET").map(str::to_owned);
        let mut facets = Vec::new();
        if kind.starts_with("R3D") && set.is_none() {
            facets.extend(card.data().filter_map(|(_, fields)| fields[0].parse::<u64>().ok()));
        }
        self.deck.element_types.push(ElementType { name: kind.clone(), set, facets, line: keyword.line });
        let solid = kind.strip_prefix("C3D").unwrap_or_default();
        let how = match solid.split_at(solid.find(|c: char| !c.is_ascii_digit()).unwrap_or(solid.len())) {
            ("8", "") => None,
            ("8", _) => Some("8-node hexahedra: full integration, mean dilatation (F̄)"),
            ("20", rest) if rest.starts_with('R') => {
                Some("`serendipity` hexahedra with 2 × 2 × 2 points: added nodes at centres follow from the 20")
            }
            ("20", _) => Some("`serendipity` hexahedra: added nodes at centres follow from the 20"),
            ("10", rest) if !rest.is_empty() => Some("10-node tetrahedra, fully integrated"),
            ("15", rest) if !rest.starts_with('V') => {
                Some("`serendipity` wedges with 3 × 3 points: added nodes at centres of faces follow from the 15")
            }
            _ if kind.starts_with("R3D") => Some("rigid solids behind these facets, on the side that does not touch"),
            _ => None,
        };
        match how {
            Some(how) => self.ledger.translated("ELEMENT", keyword.line, how),
            None => self.ledger.used("ELEMENT", keyword.line),
        }
    }

    fn section(&mut self, card: &Card<'_>) {
        let keyword = &card.keyword;
        self.allow(card, &["ELSET", "MATERIAL", "ORIENTATION", "CONTROLS"]);
        let value = |name: &str| keyword.parameter(name).map(str::to_owned);
        let (Some(set), Some(material)) = (value("ELSET"), value("MATERIAL")) else {
            let why = "the section needs ELSET=… and MATERIAL=…";
            return self.ledger.wrong(&keyword.name, [keyword.line; 2], why, "add the parameter");
        };
        self.ledger.used(&keyword.name, keyword.line);
        let orientation = value("ORIENTATION").map(|name| name.to_ascii_uppercase());
        let material = material.to_ascii_uppercase();
        self.deck.sections.push(Section { set, material, orientation, line: keyword.line });
    }

    fn amplitude(&mut self, card: &Card<'_>) {
        let keyword = &card.keyword;
        self.allow(card, &["NAME", "TIME", "VALUE", "DEFINITION", "SMOOTH"]);
        let definition = keyword.parameter("DEFINITION").unwrap_or("TABULAR");
        let absolute = keyword.parameter("VALUE").is_some_and(|value| value.eq_ignore_ascii_case("ABSOLUTE"));
        let smooth = definition.to_ascii_uppercase().starts_with("SMOOTH");
        if !(smooth || definition.eq_ignore_ascii_case("TABULAR")) || absolute {
            let why = "only tables of relative values are supported, also with SMOOTH STEP";
            self.ledger.refuse("AMPLITUDE", keyword.line, why, "write the amplitude as a table of times and factors");
        }
        let mut points: Vec<[f64; 2]> = Vec::new();
        for (line, fields) in card.data() {
            let numbers: Vec<f64> = (0..fields.len()).filter_map(|at| self.number(card, line, &fields, at)).collect();
            for pair in numbers.chunks(2) {
                match (pair, points.last()) {
                    (&[t, _], Some(&[last, _])) if t <= last => {
                        let why = "the times of an amplitude must rise";
                        self.ledger.wrong("AMPLITUDE", [keyword.line, line], why, DAMAGED);
                    }
                    (&[t, value], _) => points.push([t, value]),
                    _ => self.ledger.wrong("AMPLITUDE", [keyword.line, line], "a time has no value", DAMAGED),
                }
            }
        }
        let total = keyword.parameter("TIME").is_some_and(|time| time.to_ascii_uppercase().starts_with("TOTAL"));
        let name = keyword.parameter("NAME").unwrap_or_default().to_ascii_uppercase();
        if points.is_empty() {
            self.ledger.wrong("AMPLITUDE", [keyword.line; 2], "the amplitude has no points", DAMAGED);
            points.push([0.0, 1.0]);
        }
        self.ledger.translated(
            "AMPLITUDE",
            keyword.line,
            "waypoints of the motions and loads that name it, at the load steps",
        );
        self.deck.amplitudes.insert(name, Amplitude { points, smooth, total });
    }

    /// Refuses parameters of a keyword other than these.
    fn allow(&mut self, card: &Card<'_>, known: &[&str]) {
        let keyword = &card.keyword;
        for (name, _) in keyword.parameters.iter().filter(|(name, _)| !known.contains(&name.as_str())) {
            let why = format!("the parameter {name} is not supported");
            self.ledger.refuse(&keyword.name, keyword.line, why, "remove the parameter if it does not matter");
        }
    }

    /// A number of a line of data; zero if the field is empty, `None` after an error.
    fn number(&mut self, card: &Card<'_>, line: usize, fields: &[&str], at: usize) -> Option<f64> {
        let field = fields.get(at).copied().unwrap_or_default();
        if field.is_empty() {
            return Some(0.0);
        }
        let value = field.replace(['d', 'D'], "e").parse().ok().filter(|x: &f64| x.is_finite());
        if value.is_none() {
            let shown: String = field.chars().take(30).collect();
            let why = format!("`{shown}` is not a number");
            self.ledger.wrong(&card.keyword.name, [card.keyword.line, line], why, DAMAGED);
        }
        value
    }

    /// All numbers of the data of a keyword, line after line.
    fn numbers(&mut self, card: &Card<'_>) -> Vec<Vec<f64>> {
        let rows = card.data().collect::<Vec<_>>();
        let row = |(line, fields): &(usize, Vec<&str>)| {
            (0..fields.len()).map(|at| self.number(card, *line, fields, at).unwrap_or(0.0)).collect()
        };
        rows.iter().map(row).collect()
    }
}

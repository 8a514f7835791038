//! Contact pairs, ties, rigid bodies and the laws of surfaces.

use slipstick_meshio::abaqus::{Card, Keyword};

use super::{DAMAGED, Reader, Target};

/// `*SURFACE INTERACTION`.
#[derive(Debug, Default)]
pub struct Interaction {
    pub behavior: Behavior,
    pub friction: Friction,
    /// What steps, counted from 0, change: ascending.
    pub behaviors: Vec<(usize, Behavior)>,
    pub frictions: Vec<(usize, Friction)>,
}

impl Interaction {
    /// The laws of pressure between steps `active[0]` and `active[1]`, each with its steps.
    pub fn phases(&self, active: [usize; 2]) -> Vec<([usize; 2], Behavior)> {
        let starts = [(0, self.behavior.clone())].into_iter().chain(self.behaviors.iter().cloned());
        let ends = self.behaviors.iter().map(|(step, _)| *step).chain([usize::MAX]);
        let phases =
            starts.zip(ends).map(|((from, behavior), to)| ([from.max(active[0]), to.min(active[1])], behavior));
        phases.filter(|([from, to], _)| from < to).collect()
    }
}

/// `*FRICTION`.
#[derive(Debug, Default, Clone, Copy, PartialEq)]
pub struct Friction {
    pub coefficient: f64,
    /// Stick slope: force per area and length.
    pub slope: Option<f64>,
    pub shear_limit: Option<f64>,
}

/// `*SURFACE BEHAVIOR`.
#[derive(Debug, Default, Clone, PartialEq)]
pub enum Behavior {
    #[default]
    Hard,
    /// Pressure per penetration.
    Linear(f64),
    /// The gap at which the pressure is 1 % of that without a gap, and this pressure.
    Exponential([f64; 2]),
    /// Pressures and penetrations.
    Tabular(Vec<[f64; 2]>),
    Tied,
}

/// What `ADJUST` of a contact pair says.
#[derive(Debug, Clone)]
pub enum Adjust {
    /// Gaps up to this distance are closed.
    Distance(f64),
    /// Those of the nodes of this set are, as written.
    Set(String),
    /// All gaps are this one: `*CLEARANCE`.
    Clearance(f64),
}

/// `*CONTACT PAIR`: names as written.
#[derive(Debug)]
pub struct Pair {
    pub slave: String,
    pub master: String,
    pub interaction: String,
    /// Whether `TIED`, whatever the interaction.
    pub tied: bool,
    /// `CPSET` in capitals.
    pub name: Option<String>,
    pub adjust: Option<Adjust>,
    /// Steps between which it acts, counted from 0, as `*MODEL CHANGE` says: ascending.
    pub active: Vec<[usize; 2]>,
    /// Steps with the penetration that they allow at their start and resolve: `*CONTACT INTERFERENCE`.
    pub interferences: Vec<(usize, f64)>,
    pub line: usize,
}

impl Pair {
    /// A pair that acts in all steps.
    pub(super) fn new(slave: String, master: String, interaction: &str, line: usize) -> Self {
        let (interaction, interferences) = (interaction.to_owned(), Vec::new());
        let (tied, name, adjust, active) = (false, None, None, vec![[0, usize::MAX]]);
        Self { slave, master, interaction, tied, name, adjust, active, interferences, line }
    }
}

/// `*TIE`.
#[derive(Debug)]
pub struct Tie {
    pub slave: String,
    pub master: String,
    pub line: usize,
}

/// `*RIGID BODY`: nodes or elements, reference node and rotation node.
#[derive(Debug)]
pub struct Rigid {
    pub nodes: Option<String>,
    pub elements: Option<String>,
    pub reference: u64,
    pub rotation: Option<u64>,
    pub line: usize,
}

const LAWS: &str = "use HARD, LINEAR with the slope, EXPONENTIAL, or TABULAR";

impl Reader<'_> {
    /// Reads a keyword of contact.
    pub(super) fn of_contact(&mut self, card: &Card<'_>) -> bool {
        match card.keyword.name.as_str() {
            "SURFACE INTERACTION" => self.surface_interaction(&card.keyword),
            "SURFACE BEHAVIOR" => self.surface_behavior(card),
            "FRICTION" => self.friction(card),
            "CONTACT PAIR" => self.contact_pair(card),
            "TIE" => self.tie(card),
            "RIGID BODY" => self.rigid_body(card),
            "MODEL CHANGE" => self.model_change(card),
            "CLEARANCE" => self.clearance(card),
            "CONTACT INTERFERENCE" if card.keyword.has("SHRINK") => {
                let (why, line) = ("SHRINK, with the penetration of each node, is not supported", card.keyword.line);
                let cure =
                    "omit SHRINK and give the deepest penetration: without friction, the step ends in the same state";
                self.ledger.refuse("CONTACT INTERFERENCE", line, why, cure);
            }
            "CONTACT INTERFERENCE" => self.interference(card),
            "CHANGE FRICTION" | "CHANGE SURFACE BEHAVIOR" => self.change(card),
            _ => return false,
        }
        true
    }

    fn surface_interaction(&mut self, keyword: &Keyword<'_>) {
        let name = keyword.parameter("NAME").unwrap_or_default().to_ascii_uppercase();
        self.ledger.used("SURFACE INTERACTION", keyword.line);
        self.deck.interactions.insert(name.clone(), Interaction::default());
        self.interaction = Some(name);
    }

    /// `*CHANGE …`: the keyword after it applies from this step on.
    fn change(&mut self, card: &Card<'_>) {
        self.allow(card, &["INTERACTION"]);
        let (keyword, line) = (&card.keyword, card.keyword.line);
        let name = keyword.parameter("INTERACTION").unwrap_or_default().to_ascii_uppercase();
        if !self.in_step || !self.deck.interactions.contains_key(&name) {
            let why = "it needs the INTERACTION=… that it changes, and a step";
            return self.ledger.wrong(&keyword.name, [line; 2], why, "name a *SURFACE INTERACTION, within a step");
        }
        self.ledger.translated(&keyword.name, line, "the keyword after it applies from the start of the step");
        self.interaction = Some(name);
        self.changes = true;
        self.unused_change = Some((keyword.name.clone(), line));
    }

    /// The step that `*FRICTION` or `*SURFACE BEHAVIOR` changes; `None` before the first one.
    ///
    /// # Errors
    /// In a step, without `*CHANGE …` before it.
    fn changed_step(&mut self, keyword: &Keyword<'_>) -> Result<Option<usize>, ()> {
        match (self.in_step, self.changes) {
            (false, _) => Ok(None),
            (true, true) => {
                self.unused_change = None;
                Ok(Some(self.deck.steps.len() - 1))
            }
            (true, false) => {
                let (why, cure) =
                    ("in a step, it does not say what it changes", "write *CHANGE … with INTERACTION=… before it");
                self.ledger.refuse(&keyword.name, keyword.line, why, cure);
                Err(())
            }
        }
    }

    fn own_interaction(&mut self, keyword: &Keyword<'_>) -> Option<&mut Interaction> {
        let own = self.interaction.as_ref().and_then(|name| self.deck.interactions.get_mut(name));
        if own.is_none() {
            let cure = "write *SURFACE INTERACTION before it";
            self.ledger.wrong(&keyword.name, [keyword.line; 2], "it belongs to no surface interaction", cure);
        }
        own
    }

    fn surface_behavior(&mut self, card: &Card<'_>) {
        self.allow(card, &["PRESSURE-OVERCLOSURE", "AUGMENTED LAGRANGE", "PENALTY", "DIRECT"]);
        let (keyword, line) = (&card.keyword, card.keyword.line);
        let Ok(step) = self.changed_step(keyword) else { return };
        let law = keyword.parameter("PRESSURE-OVERCLOSURE").unwrap_or("HARD").to_ascii_uppercase();
        let behavior = match law.as_str() {
            "HARD" => {
                self.ledger.translated("SURFACE BEHAVIOR", line, "hard contact: `lagrange`, without penetration");
                Behavior::Hard
            }
            "LINEAR" => {
                let slope = self.numbers(card).first().map_or(0.0, |row| row[0]);
                if !(slope > 0.0) {
                    return self.ledger.wrong("SURFACE BEHAVIOR", [line; 2], "the slope must be positive", DAMAGED);
                }
                self.ledger.translated("SURFACE BEHAVIOR", line, "`penalty` with this pressure per penetration");
                Behavior::Linear(slope)
            }
            "EXPONENTIAL" => {
                let rows = self.numbers(card);
                let (Some(&[clearance, pressure, ..]), true) = (rows.first().map(Vec::as_slice), rows.len() == 1)
                else {
                    let why = "it needs the gap at which the pressure is 1 % of that without a gap, and this pressure";
                    return self.ledger.wrong("SURFACE BEHAVIOR", [line; 2], why, DAMAGED);
                };
                if !(clearance > 0.0 && pressure > 0.0) {
                    return self.ledger.wrong("SURFACE BEHAVIOR", [line; 2], "both numbers must be positive", DAMAGED);
                }
                let how =
                    "`penalty` with an `exponential` pressure, as in CalculiX; that of Abaqus ends at the first number";
                self.ledger.translated("SURFACE BEHAVIOR", line, how);
                Behavior::Exponential([clearance, pressure])
            }
            "TABULAR" => {
                let rows = self.numbers(card);
                let table: Vec<[f64; 2]> = rows.iter().filter_map(|row| Some([*row.first()?, *row.get(1)?])).collect();
                if let Some(why) = table_fault(&table, rows.len()) {
                    return self.ledger.wrong("SURFACE BEHAVIOR", [line; 2], why, DAMAGED);
                }
                let how = "`penalty` with a `table` of pressures, constant beyond its ends, as in CalculiX";
                self.ledger.translated("SURFACE BEHAVIOR", line, how);
                Behavior::Tabular(table)
            }
            "TIED" => {
                self.ledger.translated("SURFACE BEHAVIOR", line, "`tied`: rigid, whatever the stiffness");
                Behavior::Tied
            }
            _ => {
                let why = format!("PRESSURE-OVERCLOSURE={law} is not supported; ignored, contact is hard");
                return self.ledger.refuse("SURFACE BEHAVIOR", line, why, LAWS);
            }
        };
        match (self.own_interaction(keyword), step) {
            (Some(own), Some(step)) => {
                own.behaviors.retain(|(at, _)| *at != step);
                own.behaviors.push((step, behavior));
            }
            (Some(own), None) => own.behavior = behavior,
            (None, _) => {}
        }
    }

    fn friction(&mut self, card: &Card<'_>) {
        self.allow(card, &["TAUMAX", "SLIP TOLERANCE", "ELASTIC SLIP", "LAGRANGE", "ROUGH"]);
        let (keyword, line) = (&card.keyword, card.keyword.line);
        if keyword.has("ROUGH") {
            let cure = "use a large coefficient, or *TIE";
            return self.ledger.refuse("FRICTION", line, "rough friction is not supported", cure);
        }
        let Ok(step) = self.changed_step(keyword) else { return };
        let rows = self.numbers(card);
        let row = rows.first().cloned().unwrap_or_default();
        let (coefficient, slope) =
            (row.first().copied().unwrap_or(0.0), row.get(1).copied().filter(|&slope| slope > 0.0));
        let limit = keyword.parameter("TAUMAX").and_then(|limit| limit.parse().ok());
        self.ledger.translated(
            "FRICTION",
            line,
            "Coulomb's law; a stick slope is the tangential stiffness of `penalty`, with hard contact sticking is rigid",
        );
        let friction = Friction { coefficient, slope, shear_limit: limit };
        let Some(own) = self.own_interaction(keyword) else { return };
        let Some(step) = step else {
            own.friction = friction;
            return;
        };
        let earlier = own.frictions.iter().map(|(_, friction)| *friction).chain([own.friction]);
        let same = |other: Friction| {
            let slides = other.coefficient > 0.0 && coefficient > 0.0;
            !slides || (other.slope, other.shear_limit) == (slope, limit)
        };
        let alike = earlier.into_iter().all(same);
        // the last of a step counts
        own.frictions.retain(|(at, _)| *at != step);
        own.frictions.push((step, friction));
        if !alike {
            let why = "a stick slope or TAUMAX that changes between steps is not supported";
            self.ledger.refuse("FRICTION", line, why, "change only the coefficient");
        }
    }

    fn contact_pair(&mut self, card: &Card<'_>) {
        let own = ["INTERACTION", "TYPE", "ADJUST", "TIED", "CPSET"];
        // how other programs find contact and integrate it
        let ways = [
            "EXTENSION ZONE",
            "MECHANICAL CONSTRAINT",
            "NO THICKNESS",
            "SMALL SLIDING",
            "SMOOTH",
            "SUPPLEMENTARY CONSTRAINTS",
            "TRACKING",
        ];
        self.allow(card, &[&own[..], &ways].concat());
        let (keyword, line) = (&card.keyword, card.keyword.line);
        let adjust = match keyword.parameter("ADJUST").map(str::parse::<f64>) {
            Some(Ok(distance)) => Some(Adjust::Distance(distance)),
            Some(Err(_)) => keyword.parameter("ADJUST").map(|set| Adjust::Set(plain(set))),
            None => None,
        };
        let interaction = keyword.parameter("INTERACTION").unwrap_or_default().to_ascii_uppercase();
        self.ledger.translated(
            "CONTACT PAIR",
            line,
            "mortar contact between the facets, with finite sliding, whatever TYPE",
        );
        for (data, fields) in card.data() {
            let [slave, master, ..] = fields[..] else {
                self.ledger.wrong("CONTACT PAIR", [line, data], "it needs a slave and a master", DAMAGED);
                continue;
            };
            let (slave, master) = (plain(slave), plain(master));
            let name = keyword.parameter("CPSET").map(str::to_ascii_uppercase);
            let (tied, adjust) = (keyword.has("TIED"), adjust.clone());
            self.deck.pairs.push(Pair { tied, name, adjust, ..Pair::new(slave, master, &interaction, line) });
        }
    }

    /// `*CLEARANCE`: the initial gap of a pair; replaces the gap in the mesh.
    fn clearance(&mut self, card: &Card<'_>) {
        self.allow(card, &["CPSET", "MASTER", "SLAVE", "VALUE"]);
        let (keyword, line) = (&card.keyword, card.keyword.line);
        let set = keyword.parameter("CPSET").map(str::to_ascii_uppercase);
        let side = |name: &str| keyword.parameter(name).map(plain).unwrap_or_default();
        let (slave, master) = (side("SLAVE"), side("MASTER"));
        let value = keyword.parameter("VALUE").and_then(|value| value.parse::<f64>().ok());
        let is = |pair: &&mut Pair| match &set {
            Some(_) => pair.name == set,
            None => pair.slave.eq_ignore_ascii_case(&slave) && pair.master.eq_ignore_ascii_case(&master),
        };
        match (self.deck.pairs.iter_mut().find(is), value) {
            (Some(pair), Some(value)) if value.is_finite() => {
                pair.adjust = Some(Adjust::Clearance(value));
                self.ledger.translated("CLEARANCE", line, "`adjust` with this `gap`");
            }
            (None, _) => {
                let pair = set.unwrap_or_else(|| format!("{slave}` and `{master}"));
                let why = format!("there is no *CONTACT PAIR of `{pair}` before it");
                self.ledger.wrong("CLEARANCE", [line; 2], why, "name CPSET, or SLAVE and MASTER, of a pair above");
            }
            _ => self.ledger.wrong("CLEARANCE", [line; 2], "it needs a VALUE", DAMAGED),
        }
    }

    /// `*CONTACT INTERFERENCE`: the penetration that a pair is allowed at the start of a step.
    fn interference(&mut self, card: &Card<'_>) {
        self.allow(card, &["OP", "TYPE"]);
        let (keyword, line) = (&card.keyword, card.keyword.line);
        let pairs = keyword.parameter("TYPE").is_none_or(|of| of.eq_ignore_ascii_case("CONTACT PAIR"));
        if !pairs || !self.in_step {
            let cure = "write it within a step, with slave, master and interference of a *CONTACT PAIR";
            return self.ledger.refuse("CONTACT INTERFERENCE", line, "only pairs in a step are supported", cure);
        }
        let step = self.deck.steps.len() - 1;
        for (data, fields) in card.data() {
            let value = self.number(card, data, &fields, 2).unwrap_or(0.0);
            if !(value > 0.0) || fields.len() > 3 {
                let why = "a line has slave, master and the penetration that the step allows at its start, above 0";
                self.ledger.refuse_at(
                    "CONTACT INTERFERENCE",
                    [line, data],
                    why,
                    "give the deepest penetration of the meshes",
                );
                continue;
            }
            let (slave, master) = (plain(fields[0]), plain(fields.get(1).copied().unwrap_or_default()));
            let is =
                |pair: &&mut Pair| pair.slave.eq_ignore_ascii_case(&slave) && pair.master.eq_ignore_ascii_case(&master);
            match self.deck.pairs.iter_mut().find(is) {
                // the last value in a step counts
                Some(pair) => match pair.interferences.last_mut().filter(|(known, _)| *known == step) {
                    Some((_, known)) => *known = value,
                    None => pair.interferences.push((step, value)),
                },
                None => {
                    let why = format!("there is no *CONTACT PAIR of `{slave}` and `{master}` before it");
                    self.ledger.wrong(
                        "CONTACT INTERFERENCE",
                        [line, data],
                        why,
                        "name slave and master of a pair above",
                    );
                }
            }
        }
        let how = "`offset`: the allowed penetration falls to zero over the step";
        self.ledger.translated("CONTACT INTERFERENCE", line, how);
    }

    fn tie(&mut self, card: &Card<'_>) {
        self.allow(card, &["NAME", "POSITION TOLERANCE", "ADJUST", "TYPE", "NO ROTATION"]);
        let line = card.keyword.line;
        self.ledger.translated("TIE", line, "`tied`: the surfaces move together on average");
        for (data, fields) in card.data() {
            let [slave, master, ..] = fields[..] else {
                self.ledger.wrong("TIE", [line, data], "it needs a slave and a master", DAMAGED);
                continue;
            };
            self.deck.ties.push(Tie { slave: plain(slave), master: plain(master), line });
        }
    }

    fn rigid_body(&mut self, card: &Card<'_>) {
        self.allow(card, &["NSET", "TIE NSET", "PIN NSET", "ELSET", "REF NODE", "ROT NODE", "POSITION"]);
        let (keyword, line) = (&card.keyword, card.keyword.line);
        let value = |name: &str| keyword.parameter(name).map(str::to_owned);
        let (reference, rotation) = (self.node_of(card, "REF NODE"), self.node_of(card, "ROT NODE"));
        let Some(reference) = reference.filter(|_| rotation.is_some() || !keyword.has("ROT NODE")) else {
            let cure = "write REF NODE=… with the number of a node, or a set of one node";
            return self.ledger.refuse("RIGID BODY", line, "it needs a reference node", cure);
        };
        // nodes of solid elements have no rotations that could be tied
        let sets: Vec<String> = ["NSET", "TIE NSET", "PIN NSET"].into_iter().filter_map(value).collect();
        let (nodes, elements) = (sets.first().cloned(), value("ELSET"));
        if sets.len() > 1 {
            let why = "it has several of NSET, TIE NSET and PIN NSET";
            self.ledger.refuse("RIGID BODY", line, why, "name one set of nodes");
        }
        self.ledger.used("RIGID BODY", line);
        self.deck.rigids.push(Rigid { nodes, elements, reference, rotation, line });
    }

    /// `REMOVE` or `ADD` of contact pairs, at the start of a step.
    fn model_change(&mut self, card: &Card<'_>) {
        let (keyword, line) = (&card.keyword, card.keyword.line);
        let pairs = keyword.parameter("TYPE").is_some_and(|of| of.eq_ignore_ascii_case("CONTACT PAIR"));
        if !pairs || !self.in_step {
            let cure = "only TYPE=CONTACT PAIR within a step";
            return self.ledger.refuse("MODEL CHANGE", line, "this change is not supported", cure);
        }
        let (step, adds) = (self.deck.steps.len() - 1, keyword.has("ADD"));
        for (data, fields) in card.data() {
            let is = |pair: &&mut Pair| {
                pair.slave.eq_ignore_ascii_case(fields[0].trim_matches('"'))
                    && fields.get(1).is_none_or(|master| pair.master.eq_ignore_ascii_case(master.trim_matches('"')))
            };
            let pair = self.deck.pairs.iter_mut().find(is);
            let acts = |pair: &Pair| pair.active.last().is_some_and(|[_, end]| *end == usize::MAX);
            match pair.map(|pair| (acts(pair), pair)) {
                Some((false, pair)) if adds => pair.active.push([step, usize::MAX]),
                Some((true, pair)) if !adds => {
                    pair.active.iter_mut().for_each(|[_, end]| *end = (*end).min(step));
                    pair.active.retain(|[start, end]| start < end);
                }
                _ => {
                    let why = "there is no such pair that could be added or removed";
                    self.ledger.refuse_at(
                        "MODEL CHANGE",
                        [line, data],
                        why,
                        "name slave and master of a *CONTACT PAIR",
                    );
                    continue;
                }
            }
        }
        self.ledger.translated("MODEL CHANGE", line, "`active`");
    }
}

/// What is wrong with a table of pressures and penetrations that has this number of lines.
fn table_fault(table: &[[f64; 2]], lines: usize) -> Option<String> {
    if table.is_empty() || table.len() < lines {
        return Some("each line of a table must have a pressure and a penetration".into());
    }
    if table[0][0] != 0.0 {
        return Some(format!("the first pressure of the table must be 0, not {}", table[0][0]));
    }
    table.windows(2).find_map(|two| match two {
        [[_, before], [_, after]] if !(after > before) => {
            Some(format!("the penetrations of a table must increase, but {after} follows {before}"))
        }
        [[before, _], [after, _]] if !(after >= before) => {
            Some(format!("the pressures of a table must not decrease, but {after} follows {before}"))
        }
        _ => None,
    })
}

/// A name without quotes.
fn plain(name: &str) -> String {
    name.trim_matches('"').to_owned()
}

impl Target {
    /// A node by number or a set by name.
    pub(super) fn new(field: &str) -> Self {
        field.parse().map_or_else(|_| Self::Set(plain(field)), Self::Node)
    }
}

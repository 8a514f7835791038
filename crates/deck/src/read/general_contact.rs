//! Pairs of Abaqus' general contact.

use slipstick_meshio::abaqus::Card;

use super::{DAMAGED, Pair, Reader};

/// The interaction of pairs to which none is assigned: hard contact without friction.
const DEFAULT: &str = "*CONTACT";

/// General contact, until all of its keywords are read.
#[derive(Debug, Default)]
pub struct General {
    /// The line of the first `*CONTACT`.
    line: Option<usize>,
    /// Whether `*CONTACT INCLUSIONS` is written.
    included: bool,
    /// Its pairs, by their positions in `Deck::pairs`.
    pairs: Vec<usize>,
    assignments: Vec<Assignment>,
}

/// A line of `*CONTACT PROPERTY ASSIGNMENT`.
#[derive(Debug)]
struct Assignment {
    /// Names of surfaces; empty for any.
    sides: [String; 2],
    interaction: String,
    /// Of the keyword and of the data.
    lines: [usize; 2],
}

impl Assignment {
    fn names(&self, pair: &Pair) -> bool {
        let same = |side: &str, own: &str| side.is_empty() || side.eq_ignore_ascii_case(own);
        let [first, second] = &self.sides;
        (same(first, &pair.slave) && same(second, &pair.master))
            || (same(first, &pair.master) && same(second, &pair.slave))
    }
}

impl Reader<'_> {
    /// Whether a keyword of general contact is in a step, where it is refused.
    fn refused_in_step(&mut self, card: &Card<'_>) -> bool {
        if self.in_step {
            let cure = "write it before the first step; *CHANGE FRICTION changes the coefficient in a step";
            let why = "general contact that a step changes is not supported";
            self.ledger.refuse(&card.keyword.name, card.keyword.line, why, cure);
        }
        self.in_step
    }

    /// `*CONTACT`.
    pub(super) fn general_contact(&mut self, card: &Card<'_>) {
        self.ledger.used("CONTACT", card.keyword.line);
        self.allow(card, &[]);
        if !self.refused_in_step(card) {
            self.general.line.get_or_insert(card.keyword.line);
        }
    }

    /// `*CONTACT INCLUSIONS` with pairs of surfaces.
    pub(super) fn inclusions(&mut self, card: &Card<'_>) {
        let (name, line) = (card.keyword.name.as_str(), card.keyword.line);
        self.general.included = true;
        if card.keyword.has("ALL EXTERIOR") {
            let cure = "write *CONTACT INCLUSIONS without ALL EXTERIOR, and on each line two surfaces that may touch";
            return self.ledger.refuse(name, line, "contact of everything with everything is not supported", cure);
        }
        self.allow(card, &[]);
        if self.refused_in_step(card) {
            return;
        }
        self.deck.interactions.entry(DEFAULT.to_owned()).or_default();
        let how = "mortar contact between the facets, with finite sliding; the first surface of a line is the slave; \
                   contact pushes overlaps of the mesh apart, where Abaqus moves nodes out of small ones without strain";
        self.ledger.translated(name, line, how);
        for (data, fields) in card.data() {
            match fields[..] {
                [slave, master] if !slave.is_empty() && !master.is_empty() && slave != master => {
                    let [slave, master] = [slave, master].map(|surface| surface.trim_matches('"').to_owned());
                    // a pair that several lines name is one
                    let pair =
                        Assignment { sides: [slave, master], interaction: DEFAULT.to_owned(), lines: [line, data] };
                    if self.general.pairs.iter().all(|&at| !pair.names(&self.deck.pairs[at])) {
                        let [slave, master] = pair.sides;
                        self.general.pairs.push(self.deck.pairs.len());
                        self.deck.pairs.push(Pair::new(slave, master, DEFAULT, line));
                    }
                }
                _ => {
                    let why = "a line must name two different surfaces";
                    self.ledger.refuse_at(name, [line, data], why, "name the surfaces of each pair that may touch");
                }
            }
        }
    }

    /// `*CONTACT PROPERTY ASSIGNMENT`: the interactions of all pairs, or of those with these surfaces.
    pub(super) fn properties(&mut self, card: &Card<'_>) {
        self.allow(card, &[]);
        if self.refused_in_step(card) {
            return;
        }
        let (name, line) = (card.keyword.name.as_str(), card.keyword.line);
        self.ledger.translated(name, line, "the laws of pairs of *CONTACT INCLUSIONS");
        for (data, fields) in card.data() {
            let [first, second, property] = fields[..] else {
                self.ledger.wrong(name, [line, data], "a line has two surfaces and a *SURFACE INTERACTION", DAMAGED);
                continue;
            };
            let sides = [first, second].map(|side| side.trim_matches('"').to_owned());
            let (interaction, lines) = (property.to_ascii_uppercase(), [line, data]);
            self.general.assignments.push(Assignment { sides, interaction, lines });
        }
    }

    /// Gives all pairs of general contact their interactions; the last line that names a pair counts.
    pub(super) fn assign_properties(&mut self) {
        let General { line, included, pairs, assignments } = std::mem::take(&mut self.general);
        if let Some(line) = line.filter(|_| !included && !self.ledger.ignores("CONTACT INCLUSIONS")) {
            let cure = "write *CONTACT INCLUSIONS, and on each line two surfaces that may touch";
            self.ledger.refuse("CONTACT", line, "nothing says which surfaces may touch", cure);
        }
        for assignment in assignments {
            let named = |&&at: &&usize| assignment.names(&self.deck.pairs[at]);
            let named: Vec<usize> = pairs.iter().filter(named).copied().collect();
            for &at in &named {
                self.deck.pairs[at].interaction.clone_from(&assignment.interaction);
            }
            if named.is_empty() {
                let [first, second] = assignment
                    .sides
                    .map(|side| if side.is_empty() { "any surface".to_owned() } else { format!("`{side}`") });
                let why = format!("no line of *CONTACT INCLUSIONS is a pair of {first} and {second}");
                let cure = "name surfaces as *CONTACT INCLUSIONS does; an empty field is any surface";
                self.ledger.refuse_at("CONTACT PROPERTY ASSIGNMENT", assignment.lines, why, cure);
            }
        }
    }
}

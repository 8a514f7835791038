//! Couplings of surfaces to reference nodes.

use slipstick_meshio::abaqus::Card;

use super::{DAMAGED, Reader};

/// `*COUPLING` with `*KINEMATIC` or `*DISTRIBUTING`.
#[derive(Debug)]
pub struct Coupling {
    pub name: String,
    pub reference: u64,
    pub surface: String,
    /// `None` until the keyword that says so.
    pub kinematic: Option<bool>,
    pub line: usize,
}

impl Reader<'_> {
    pub(super) fn coupling(&mut self, card: &Card<'_>) {
        self.allow(card, &["REF NODE", "SURFACE", "CONSTRAINT NAME", "INFLUENCE RADIUS"]);
        let (keyword, line) = (&card.keyword, card.keyword.line);
        if keyword.parameter("INFLUENCE RADIUS").is_some_and(|of| !of.eq_ignore_ascii_case("WHOLE SURFACE")) {
            let why = "a coupling of a part of its surface is not supported";
            self.ledger.refuse(
                "COUPLING",
                line,
                why,
                "write INFLUENCE RADIUS=WHOLE SURFACE, or name a smaller surface",
            );
        }
        let reference = self.node_of(card, "REF NODE");
        let (Some(reference), Some(surface)) = (reference, keyword.parameter("SURFACE").map(str::to_owned)) else {
            let why = "it needs REF NODE=…, a node or a set of one node, and SURFACE=…";
            return self.ledger.wrong("COUPLING", [line; 2], why, "add or correct the parameter");
        };
        let name = keyword.parameter("CONSTRAINT NAME").unwrap_or("coupling").to_owned();
        self.ledger.translated("COUPLING", line, "`[[coupling]]`, for small rotations");
        self.deck.couplings.push(Coupling { name, reference, surface, kinematic: None, line });
    }

    /// The kind of the last coupling.
    pub(super) fn coupled(&mut self, card: &Card<'_>, kinematic: bool) {
        let (name, line) = (card.keyword.name.clone(), card.keyword.line);
        // what Abaqus assumes: a face is weighted by area, and solid elements have no rotations
        let assumed = [("WEIGHTING METHOD", "UNIFORM"), ("COUPLING", "CONTINUUM")];
        let is_assumed = |of: &str, value: &str| assumed.iter().any(|&(n, v)| n == of && v.eq_ignore_ascii_case(value));
        let known: Vec<&str> = (card.keyword.parameters.iter())
            .filter(|(of, value)| !kinematic && value.is_some_and(|value| is_assumed(of, value)))
            .map(|(of, _)| of.as_str())
            .collect();
        self.allow(card, &known);
        let open = self.deck.couplings.last_mut().filter(|coupling| coupling.kinematic.is_none());
        let Some(coupling) = open else {
            return self.ledger.wrong(&name, [line; 2], "it follows no *COUPLING", "write *COUPLING before it");
        };
        coupling.kinematic = Some(kinematic);
        let rows = self.numbers(card);
        let mut has = [rows.is_empty(); 3];
        for row in &rows {
            let first = row.first().copied().unwrap_or(0.0);
            let last = row.get(1).copied().filter(|&last| last > 0.0).unwrap_or(first);
            if !(1.0..=6.0).contains(&first) || !(first..=6.0).contains(&last) {
                return self.ledger.wrong(
                    &name,
                    [line; 2],
                    "a line has a first and a last component from 1 to 6",
                    DAMAGED,
                );
            }
            (0..3).filter(|&c| (first..=last).contains(&f64::from(c + 1))).for_each(|c| has[c as usize] = true);
        }
        if has != [true; 3] {
            let why = "only couplings of all components 1 to 3 are supported";
            return self.ledger.refuse(&name, line, why, "couple components 1 to 3, or write *EQUATION");
        }
        let how = if kinematic { "`kind = \"kinematic\"`" } else { "`kind = \"distributing\"`, weighted by area" };
        self.ledger.translated(&name, line, how);
    }
}

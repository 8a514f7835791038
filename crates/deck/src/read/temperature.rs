//! Temperatures: `*INITIAL CONDITIONS, TYPE=TEMPERATURE`, `*TEMPERATURE`, `*EXPANSION`.

use slipstick_meshio::abaqus::Card;

use super::material::TableOf;
use super::step::Condition;
use super::{DAMAGED, Reader, Target};

impl Reader<'_> {
    /// Reads a keyword of temperatures.
    pub(super) fn of_temperature(&mut self, card: &Card<'_>) -> bool {
        let (name, line) = (card.keyword.name.as_str(), card.keyword.line);
        let of_temperature = || card.keyword.parameter("TYPE").is_some_and(|of| of.eq_ignore_ascii_case("TEMPERATURE"));
        match name {
            "INITIAL CONDITIONS" if of_temperature() => {
                self.allow(card, &["TYPE"]);
                let found = self.temperatures(card, None);
                self.ledger.translated(name, line, "where changes of the temperature begin");
                self.deck.initial_temperatures.extend(found);
            }
            "TEMPERATURE" => {
                self.allow(card, &["OP", "AMPLITUDE"]);
                let amplitude = card.keyword.parameter("AMPLITUDE").map(str::to_ascii_uppercase);
                let found = self.temperatures(card, amplitude);
                let earlier = self.deck.steps.iter().any(|step| !step.temperatures.is_empty());
                if earlier && card.keyword.parameter("OP").is_some_and(|op| op.eq_ignore_ascii_case("NEW")) {
                    let why = "temperatures that end with OP=NEW are not supported";
                    self.ledger.refuse(name, line, why, "write the temperatures of all nodes in the step");
                }
                self.ledger.translated(name, line, "`[[temperature]]`, linear over each step");
                match self.deck.steps.last_mut() {
                    Some(step) if self.in_step => step.temperatures.extend(found),
                    _ => self.ledger.wrong(name, [line, line], "it is outside of a step", "move it into a step"),
                }
            }
            _ => return false,
        }
        true
    }

    fn temperatures(&mut self, card: &Card<'_>, amplitude: Option<String>) -> Vec<Condition> {
        let mut found = Vec::new();
        for (data, fields) in card.data() {
            let lines = [card.keyword.line, data];
            if fields.len() < 2 || fields[1].is_empty() {
                let why = "a line has a node or set and a temperature";
                self.ledger.wrong(&card.keyword.name, lines, why, DAMAGED);
                continue;
            }
            let value = self.number(card, data, &fields, 1).unwrap_or(0.0);
            let (target, amplitude) = (Target::new(fields[0]), amplitude.clone());
            found.push(Condition { target, component: 0, value, amplitude, fixed: false, lines });
        }
        found
    }

    /// `*EXPANSION`: with one coefficient, the temperature of no expansion (`ZERO`) does not matter. One that depends on
    /// temperature is the secant from there.
    pub(super) fn expansion(&mut self, card: &Card<'_>) {
        self.allow(card, &["TYPE", "ZERO"]);
        let (line, of) = (card.keyword.line, card.keyword.parameter("TYPE").unwrap_or("ISO").to_ascii_uppercase());
        if !of.starts_with("ISO") {
            let why = format!("TYPE={of} is not supported");
            return self.ledger.refuse("EXPANSION", line, why, "give one coefficient of expansion");
        }
        let zero = card.keyword.parameter("ZERO").and_then(|zero| zero.parse().ok()).unwrap_or(0.0);
        let Some(row) = self.by_temperature(card, 1, TableOf::Expansion { zero }) else { return };
        self.ledger.translated("EXPANSION", line, "`thermal_expansion`");
        if let Some(material) = self.own(card) {
            material.expansion = Some(row[0]).filter(|&alpha| alpha != 0.0);
        }
    }
}

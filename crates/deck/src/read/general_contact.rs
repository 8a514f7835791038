//! Pairs of Abaqus' general contact.

use slipstick_meshio::abaqus::Card;

use super::{DAMAGED, Pair, Reader};

/// The interaction of pairs to which none is assigned: hard contact without friction.
const DEFAULT: &str = "*CONTACT";

impl Reader<'_> {
    /// `*CONTACT INCLUSIONS` with pairs of surfaces.
    pub(super) fn inclusions(&mut self, card: &Card<'_>) {
        let (name, line) = (card.keyword.name.as_str(), card.keyword.line);
        if card.keyword.has("ALL EXTERIOR") {
            let cure = "write *CONTACT INCLUSIONS without ALL EXTERIOR, and on each line two surfaces that may touch";
            return self.ledger.refuse(name, line, "contact of everything with everything is not supported", cure);
        }
        self.allow(card, &[]);
        self.deck.interactions.entry(DEFAULT.to_owned()).or_default();
        let how = "mortar contact between the facets, with finite sliding; the first surface of a line is the slave";
        self.ledger.translated(name, line, how);
        for (data, fields) in card.data() {
            match fields[..] {
                [slave, master] if !slave.is_empty() && !master.is_empty() && slave != master => {
                    let [slave, master] = [slave, master].map(|surface| surface.trim_matches('"').to_owned());
                    self.general.push(self.deck.pairs.len());
                    self.deck.pairs.push(Pair::new(slave, master, DEFAULT, line));
                }
                _ => {
                    let why = "a line must name two different surfaces";
                    self.ledger.refuse_at(name, [line, data], why, "name the surfaces of each pair that may touch");
                }
            }
        }
    }

    /// `*CONTACT PROPERTY ASSIGNMENT`: the interactions of all pairs, or of those with these surfaces; the last counts.
    pub(super) fn properties(&mut self, card: &Card<'_>) {
        self.allow(card, &[]);
        let (name, line) = (card.keyword.name.as_str(), card.keyword.line);
        self.ledger.translated(name, line, "the laws of pairs of *CONTACT INCLUSIONS");
        for (data, fields) in card.data() {
            let [first, second, property] = fields[..] else {
                self.ledger.wrong(name, [line, data], "a line has two surfaces and a *SURFACE INTERACTION", DAMAGED);
                continue;
            };
            let (sides, property) = ([first, second].map(|side| side.trim_matches('"')), property.to_ascii_uppercase());
            let is = |pair: &Pair| {
                let own = [&pair.slave, &pair.master];
                let same = |a: &str, b: &str| a.is_empty() || a.eq_ignore_ascii_case(b);
                [[0, 1], [1, 0]].iter().any(|&[a, b]| same(sides[0], own[a]) && same(sides[1], own[b]))
            };
            for &index in &self.general {
                if is(&self.deck.pairs[index]) {
                    self.deck.pairs[index].interaction.clone_from(&property);
                }
            }
        }
    }
}

//! Contact pairs and ties.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use super::{Writer, quoted};
use crate::bodies::find;
use crate::read::{Adjust, Behavior, Interaction, Pair};

impl Writer<'_> {
    pub(super) fn contact(&mut self) {
        let deck = self.deck;
        for pair in &deck.pairs {
            let nothing = Interaction::default();
            let interaction = deck.interactions.get(&pair.interaction).unwrap_or_else(|| {
                let why = format!("there is no surface interaction `{}`", pair.interaction);
                self.ledger.wrong(
                    "CONTACT PAIR",
                    [pair.line; 2],
                    why,
                    "name a *SURFACE INTERACTION with INTERACTION=…",
                );
                &nothing
            });
            let Some([slave, master]) = self.sides([&pair.slave, &pair.master], "CONTACT PAIR", pair.line) else {
                continue;
            };
            self.table("contact", "CONTACT PAIR", pair.line);
            self.line(format!("slave = {slave}\nmaster = {master}"));
            let start = |step: usize| {
                self.targets.counts.iter().take(step).sum::<usize>() as f64 / self.targets.load_steps as f64
            };
            let active = [start(pair.active[0]), start(pair.active[1])];
            if active != [0.0, 1.0] {
                self.line(format!("active = [{:?}, {:?}]", active[0], active[1]));
            }
            if let Some((Behavior::Tied, _)) = interaction.behavior {
                if let Some(Adjust::Clearance(_)) = pair.adjust {
                    let why = "the *CLEARANCE of surfaces that are tied, with the gap that they have in the mesh";
                    self.ledger.wrong("CONTACT PAIR", [pair.line; 2], why, "move a body in the mesh instead");
                }
                self.line("tied = true");
                continue;
            }
            let mut text = String::new();
            if !self.is_curved([&pair.slave, &pair.master]) {
                text.push_str("surfaces = \"faceted\"\n");
            }
            let (coefficient, slope) = interaction.friction.map_or((0.0, None), |(mu, slope, ..)| (mu, slope));
            let _ = writeln!(text, "friction = {coefficient:?}");
            if let Some((.., Some(limit), _)) = interaction.friction {
                let _ = writeln!(text, "shear_limit = {limit:?}");
            }
            match &pair.adjust {
                Some(Adjust::Distance(distance)) if *distance > 0.0 => {
                    let _ = writeln!(text, "adjust = {distance:?}");
                }
                Some(Adjust::Clearance(gap)) => {
                    let _ = writeln!(text, "adjust = {{ gap = {gap:?} }}");
                }
                Some(Adjust::Set(set)) => {
                    if let Some(nodes) = self.nodes_of_slave(pair, set) {
                        let _ = writeln!(text, "adjust = {{ nodes = {} }}", quoted(&nodes));
                    }
                }
                Some(Adjust::Distance(_)) | None => {}
            }
            if let Some((Behavior::Linear(normal), _)) = interaction.behavior {
                let stiffness = match slope {
                    Some(tangential) => format!("{{ normal = {normal:?}, tangential = {tangential:?} }}"),
                    None => format!("{normal:?}"),
                };
                let _ = writeln!(text, "enforcement = {{ penalty = {{ stiffness = {stiffness} }} }}");
            }
            self.text.push_str(&text);
        }
        for tie in &deck.ties {
            let Some([slave, master]) = self.sides([&tie.slave, &tie.master], "TIE", tie.line) else { continue };
            self.table("contact", "TIE", tie.line);
            self.line(format!("slave = {slave}\nmaster = {master}\ntied = true"));
        }
    }

    /// The name in the case of a node set, on the body of a pair's slave.
    fn nodes_of_slave(&mut self, pair: &Pair, set: &str) -> Option<String> {
        let known = |name| find(&self.mesh.face_sets, name).or_else(|| find(&self.mesh.cell_sets, name));
        let bodies: BTreeSet<usize> =
            known(&pair.slave).into_iter().flat_map(|name| self.bodies.under(self.mesh, name)).collect();
        let set = find(&self.mesh.node_sets, set);
        let (Some(set), Some(&body), 1) = (set, bodies.first(), bodies.len()) else {
            let why = match set {
                None => "ADJUST names neither a distance nor a node set of the deck",
                Some(_) => "ADJUST with a set is not supported for a slave surface on several bodies",
            };
            self.ledger.wrong("CONTACT PAIR", [pair.line; 2], why, "write the distance, ADJUST=0.01");
            return None;
        };
        Some(self.on(body, set))
    }

    /// Whether one of the surfaces lies on elements with nodes between corners. Facets of linear elements are
    /// flat in other programs too; those of second-order elements are curved.
    fn is_curved(&self, names: [&str; 2]) -> bool {
        let known = |name| find(&self.mesh.face_sets, name).or_else(|| find(&self.mesh.cell_sets, name));
        let bodies = names.into_iter().filter_map(known).flat_map(|name| self.bodies.under(self.mesh, name));
        bodies.into_iter().any(|body| self.bodies.list[body].second_order)
    }

    /// Both surfaces as TOML strings; a slave of an earlier pair gets another name.
    fn sides(&mut self, names: [&str; 2], keyword: &str, line: usize) -> Option<[String; 2]> {
        let slave = self.surface(names[0], keyword, line)?;
        let master = self.surface(names[1], keyword, line)?;
        let mut name = slave.clone();
        let mut k = 1;
        while !self.names.insert(format!("slave {name}")) {
            k += 1;
            name = format!("{slave}_{k}");
        }
        if k > 1 {
            self.table("surface", keyword, line);
            self.line(format!("name = {}\nof = [{}]", quoted(&name), quoted(&slave)));
        }
        Some([quoted(&name), quoted(&master)])
    }
}

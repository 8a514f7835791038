//! Contact pairs and ties.

use std::collections::BTreeSet;

use super::{Writer, quoted, vector};
use crate::bodies::find;
use crate::read::{Adjust, Behavior, Friction, Interaction, Pair};

impl Writer<'_> {
    pub(super) fn contact(&mut self) {
        let deck = self.deck;
        for pair in &deck.pairs {
            let nothing = Interaction::default();
            if pair.tied {
                pair.active.iter().for_each(|&steps| self.phase(pair, &nothing, steps, &Behavior::Tied));
                continue;
            }
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
            for (steps, behavior) in pair.active.iter().flat_map(|&active| interaction.phases(active)) {
                self.phase(pair, interaction, steps, &behavior);
            }
        }
        for tie in &deck.ties {
            let Some([slave, master]) = self.sides([&tie.slave, &tie.master], "TIE", tie.line) else { continue };
            self.table("contact", "TIE", tie.line);
            self.line(format!("slave = {slave}\nmaster = {master}\ntied = true"));
        }
    }

    /// A pair in the steps in which it has one law of pressure.
    fn phase(&mut self, pair: &Pair, interaction: &Interaction, steps: [usize; 2], behavior: &Behavior) {
        let Some([slave, master]) = self.sides([&pair.slave, &pair.master], "CONTACT PAIR", pair.line) else { return };
        self.table("contact", "CONTACT PAIR", pair.line);
        self.line(format!("slave = {slave}\nmaster = {master}"));
        let active = steps.map(|step| self.time(step, 0));
        if active != [0.0, 1.0] {
            self.line(format!("active = [{:?}, {:?}]", active[0], active[1]));
        }
        if *behavior == Behavior::Tied {
            if let Some(Adjust::Clearance(_)) = pair.adjust {
                let why = "the *CLEARANCE of surfaces that are tied, with the gap that they have in the mesh";
                self.ledger.wrong("CONTACT PAIR", [pair.line; 2], why, "move a body in the mesh instead");
            }
            if let Some((step, _)) = pair.interferences.iter().find(|(step, _)| (steps[0]..steps[1]).contains(step)) {
                let why =
                    format!("the *CONTACT INTERFERENCE in step {} of surfaces that are tied has no effect", step + 1);
                self.ledger.wrong(
                    "CONTACT PAIR",
                    [pair.line; 2],
                    why,
                    "remove it, or choose another *SURFACE BEHAVIOR",
                );
            }
            return self.line("tied = true");
        }
        if !self.is_curved([&pair.slave, &pair.master]) {
            self.line("surfaces = \"faceted\"");
        }
        let friction = self.friction(interaction);
        match &pair.adjust {
            Some(Adjust::Distance(distance)) if *distance > 0.0 => self.line(format!("adjust = {distance:?}")),
            Some(Adjust::Clearance(gap)) => self.line(format!("adjust = {{ gap = {gap:?} }}")),
            Some(Adjust::Set(set)) => {
                if let Some(nodes) = self.nodes_of_slave(pair, set) {
                    self.line(format!("adjust = {{ nodes = {} }}", quoted(&nodes)));
                }
            }
            Some(Adjust::Distance(_)) | None => {}
        }
        self.interferences(pair);
        if *behavior != Behavior::Hard {
            let law = self.penalty(behavior, &friction) + ", pressure_at = \"points\"";
            self.line(format!("enforcement = {{ penalty = {{ {law} }} }}"));
        }
    }

    /// The keys of the penalty method.
    fn penalty(&mut self, behavior: &Behavior, friction: &Friction) -> String {
        let pressure = match behavior {
            Behavior::Linear(normal) => {
                return match friction.slope {
                    Some(slope) => format!("stiffness = {{ normal = {normal:?}, tangential = {slope:?} }}"),
                    None => format!("stiffness = {normal:?}"),
                };
            }
            Behavior::Exponential([clearance, pressure]) => {
                format!("exponential = {{ contact_pressure = {pressure:?}, clearance = {clearance:?} }}")
            }
            Behavior::Tabular(table) => {
                let column = |c: usize| vector(&table.iter().map(|row| row[c]).collect::<Vec<_>>());
                format!("table = {{ penetration = {}, pressure = {} }}", column(1), column(0))
            }
            Behavior::Hard | Behavior::Tied => return String::new(),
        };
        let sticking = friction.slope.map_or(String::new(), |slope| format!(", stiffness = {slope:?}"));
        format!("pressure = {{ {pressure} }}{sticking}")
    }

    /// Penetrations that steps allow at their start and resolve. After the first step, they come within a load step.
    fn interferences(&mut self, pair: &Pair) {
        if pair.interferences.is_empty() {
            return;
        }
        let mut points: Vec<(f64, f64)> = Vec::new();
        for &(step, allowed) in &pair.interferences {
            let count = self.targets.counts.get(step).copied().unwrap_or(1);
            if step == 0 {
                points.push((0.0, -allowed));
            } else {
                points.push((self.time(step, 0), 0.0));
                if count > 1 {
                    points.push((self.time(step, 1), -allowed * (1.0 - 1.0 / count as f64)));
                }
            }
            points.push((self.time(step, count), 0.0));
        }
        points.dedup_by(|next, last| next.0 - last.0 < 1e-9);
        let points: Vec<String> =
            points.iter().map(|(t, offset)| format!("{{ t = {t:?}, offset = {offset:?} }}")).collect();
        self.line(format!("offset = [{}]", points.join(", ")));
    }

    /// The law of friction: the largest coefficient, and the factors on it where steps change it, within their first
    /// load step.
    fn friction(&mut self, interaction: &Interaction) -> Friction {
        let mut law = interaction.friction;
        // what a law without friction says of sticking does not count
        if law.coefficient == 0.0 && !interaction.frictions.is_empty() {
            (law.slope, law.shear_limit) = (None, None);
        }
        for (_, later) in interaction.frictions.iter().filter(|(_, later)| later.coefficient > 0.0) {
            law = Friction {
                coefficient: law.coefficient.max(later.coefficient),
                slope: law.slope.or(later.slope),
                shear_limit: law.shear_limit.or(later.shear_limit),
            };
        }
        self.line(format!("friction = {:?}", law.coefficient));
        if law.coefficient > 0.0 && !interaction.frictions.is_empty() {
            let (mut points, mut factor) = (Vec::new(), interaction.friction.coefficient / law.coefficient);
            for (step, later) in &interaction.frictions {
                points.push((self.time(*step, 0), factor));
                factor = later.coefficient / law.coefficient;
                points.push((self.time(*step, 1), factor));
            }
            // a step with one load step ends where the next one begins
            points.dedup_by(|next, last| next.0 - last.0 < 1e-9);
            let points = points.iter().map(|(t, factor)| format!("{{ t = {t:?}, factor = {factor:?} }}"));
            self.line(format!("friction_path = [{}]", points.collect::<Vec<_>>().join(", ")));
        }
        if let Some(limit) = law.shear_limit {
            self.line(format!("shear_limit = {limit:?}"));
        }
        law
    }

    /// The pseudo-time after some load steps of a step.
    fn time(&self, step: usize, count: usize) -> f64 {
        (self.targets.counts.iter().take(step).sum::<usize>() + count) as f64 / self.targets.load_steps as f64
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

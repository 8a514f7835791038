//! Points and equations.

use super::{Writer, quoted, vector};

impl Writer<'_> {
    pub(super) fn equations(&mut self) {
        let targets = self.targets;
        for coupling in &targets.couplings {
            self.table("coupling", coupling.keyword, coupling.line);
            let (set, at) =
                (self.on(coupling.body, &coupling.surface), vector(&self.mesh.points[coupling.node as usize]));
            let kind = if coupling.kinematic { "kinematic" } else { "distributing" };
            let name = quoted(&coupling.name);
            self.line(format!("name = {name}\nset = {}\nat = {at}\nkind = \"{kind}\"", quoted(&set)));
        }
        for (node, name) in &targets.points {
            let line = targets.equations.first().map_or(1, |(_, line)| *line);
            self.table("point", "EQUATION", line);
            let at = vector(&self.mesh.points[*node as usize]);
            self.line(format!("name = {}\nat = {at}", quoted(name)));
        }
        for (terms, line) in &targets.equations {
            self.table("equation", "EQUATION", *line);
            let term = |term: &crate::targets::Joined| {
                let set = match &term.set {
                    Some(set) => self.on(term.body, set),
                    None => self.bodies.list[term.body].name.clone(),
                };
                let component = ["x", "y", "z"][usize::from(term.component)];
                format!("{{ set = {}, component = \"{component}\", factor = {:?} }}", quoted(&set), term.factor)
            };
            let terms: Vec<String> = terms.iter().map(term).collect();
            self.line(format!("terms = [{}]", terms.join(", ")));
        }
    }
}

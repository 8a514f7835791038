//! Bolts.

use super::{Writer, quoted, vector};

impl Writer<'_> {
    pub(super) fn bolts(&mut self) {
        let targets = self.targets;
        for bolt in &targets.bolts {
            self.table("bolt", "PRE-TENSION SECTION", bolt.line);
            let body = quoted(&self.bodies.list[bolt.body].name);
            self.line(format!("name = {}\nbody = {body}", quoted(&bolt.name)));
            let (point, normal) = (vector(&bolt.point), vector(&bolt.normal));
            self.line(format!("section = {{ point = {point}, normal = {normal}, radius = {:?} }}", bolt.radius));
            let force = bolt.force.iter().map(|[t, force]| format!("{{ t = {t:?}, force = {force:?} }}"));
            self.line(format!("force = [{}]", force.collect::<Vec<_>>().join(", ")));
            if !bolt.keeps_length {
                self.line("keeps = \"force\"");
            }
        }
    }
}

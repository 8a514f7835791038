//! Surfaces of sets of nodes.

use std::collections::HashSet;

use super::Finder;
use crate::bodies::find;

impl Finder<'_> {
    /// Makes surfaces of the sets of nodes that contact pairs and ties name: the free faces between them.
    pub(super) fn faces_of_nodes(&mut self) {
        let pairs = self.deck.pairs.iter().map(|pair| ([&pair.slave, &pair.master], pair.line, "CONTACT PAIR"));
        let ties = self.deck.ties.iter().map(|tie| ([&tie.slave, &tie.master], tie.line, "TIE"));
        for (names, line, keyword) in pairs.chain(ties) {
            for name in names {
                if self.surface(name).is_some() {
                    continue;
                }
                let Some(set) = find(&self.mesh.node_sets, name).map(str::to_owned) else {
                    let why = format!("there is no surface `{name}`");
                    self.ledger.wrong(keyword, [line, line], why, "define it with *SURFACE");
                    continue;
                };
                let nodes: HashSet<u32> = self.mesh.node_sets[&set].iter().copied().collect();
                let faces = self.mesh.free_faces(&nodes);
                if faces.is_empty() {
                    let why = format!("no face of an element has all its nodes in `{name}`");
                    self.ledger.refuse(
                        keyword,
                        line,
                        why,
                        "name a surface of faces: mortar contact integrates over faces",
                    );
                    continue;
                }
                self.mesh.face_sets.insert(set, faces);
            }
        }
    }
}

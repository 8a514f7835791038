//! Surfaces and elements by their names.

use std::collections::HashSet;

use slipstick_meshio::ElementFace;

use super::Finder;
use crate::bodies::find;
use crate::read::Target;
use crate::vector::{dot, unit};

/// Cosine of the normals of faces that face each other, at most.
const FACING: f64 = -0.5;

/// Sum of area vectors over area, below which a master faces all sides.
const CLOSED: f64 = 1e-3;

impl Finder<'_> {
    /// Makes surfaces of the sets of nodes that contact pairs and ties name: the free faces between them.
    pub(super) fn faces_of_nodes(&mut self) {
        let pairs = self.deck.pairs.iter().map(|pair| ([&pair.slave, &pair.master], pair.line, "CONTACT PAIR"));
        let ties = self.deck.ties.iter().map(|tie| ([&tie.slave, &tie.master], tie.line, "TIE"));
        for (names, line, keyword) in pairs.chain(ties) {
            for name in names {
                let slave_of = (keyword == "CONTACT PAIR" && name == names[0]).then_some(names[1]);
                if self.surface(name).is_some() {
                    continue;
                }
                let Some(set) = find(&self.mesh.node_sets, name).map(str::to_owned) else {
                    let why = format!("there is no surface `{name}`");
                    self.ledger.wrong(keyword, [line, line], why, "define it with *SURFACE");
                    continue;
                };
                let nodes: HashSet<u32> = self.mesh.node_sets[&set].iter().copied().collect();
                let mut faces = self.mesh.free_faces(&nodes);
                if let (true, Some(master)) = (faces.is_empty(), slave_of) {
                    faces = self.faces_towards(&nodes, master);
                    if !faces.is_empty() {
                        let how = format!(
                            "mortar contact; no face has all its nodes in `{name}`: the faces around them touch, also \
                             beyond the nodes"
                        );
                        self.mesh.notices.push(format!("line {line}: {how}"));
                        self.ledger.translated(keyword, line, how);
                    }
                }
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

    /// The free faces around nodes that face a master surface; none if this is closed.
    fn faces_towards(&self, nodes: &HashSet<u32>, master: &str) -> Vec<ElementFace> {
        let faces = find(&self.mesh.face_sets, master).map_or(&[][..], |set| &self.mesh.face_sets[set]);
        let areas = || faces.iter().map(|&face| self.mesh.area_vector(face));
        let sum = areas().fold([0.0; 3], |sum, area| [0, 1, 2].map(|c| sum[c] + area[c]));
        let area: f64 = areas().map(|area| dot(area, area).sqrt()).sum();
        let Some(opposite) = unit(sum).filter(|_| dot(sum, sum).sqrt() > CLOSED * area) else {
            return Vec::new();
        };
        let facing = |face: &ElementFace| {
            unit(self.mesh.area_vector(*face)).is_some_and(|normal| dot(normal, opposite) < FACING)
        };
        self.mesh.free_faces_at(nodes).into_iter().filter(facing).collect()
    }

    /// The elements of a target; empty after an error.
    pub(super) fn cells(&mut self, target: &Target, keyword: &str, lines: [usize; 2]) -> Vec<u32> {
        let cells = match target {
            Target::Node(number) => (0..self.mesh.cells.len() as u32)
                .find(|&c| self.mesh.cells.number(c as usize) == *number)
                .map(|c| vec![c]),
            Target::Set(name) => find(&self.mesh.cell_sets, name).map(|set| self.mesh.cell_sets[set].clone()),
        };
        cells.unwrap_or_else(|| {
            self.ledger.wrong(
                keyword,
                lines,
                "there is no such element or set of elements",
                "name an element or an *ELSET",
            );
            vec![]
        })
    }

    /// The surface of the file with this name.
    pub(super) fn surface(&self, name: &str) -> Option<String> {
        find(&self.mesh.face_sets, name).or_else(|| find(&self.mesh.cell_sets, name)).map(str::to_owned)
    }
}

//! Bolts.

use slipstick_meshio::abaqus::Card;

use super::{DAMAGED, Reader};

/// `*PRE-TENSION SECTION`.
#[derive(Debug)]
pub struct Pretension {
    pub surface: String,
    /// The node whose first component is force and adjustment of the section.
    pub node: u64,
    /// The direction that its data give.
    pub normal: Option<[f64; 3]>,
    pub line: usize,
}

impl Reader<'_> {
    pub(super) fn pretension(&mut self, card: &Card<'_>) {
        self.allow(card, &["SURFACE", "NODE"]);
        let (keyword, line) = (&card.keyword, card.keyword.line);
        let node = self.node_of(card, "NODE");
        let (Some(node), Some(surface)) = (node, keyword.parameter("SURFACE").map(str::to_owned)) else {
            let why = "it needs SURFACE=… and NODE=…";
            return self.ledger.wrong(&keyword.name, [line; 2], why, "add the parameter");
        };
        let rows = self.numbers(card);
        let normal = match rows.first().map(Vec::as_slice) {
            None => None,
            Some(&[x, y, z]) if [x, y, z] != [0.0; 3] => Some([x, y, z]),
            Some(_) => {
                let why = "its line of data is a direction: three numbers that are not all zero";
                return self.ledger.wrong(&keyword.name, [line, line + 1], why, DAMAGED);
            }
        };
        self.ledger.translated(&keyword.name, line, "`[[bolt]]`, cut along the plane of the surface");
        self.deck.pretensions.push(Pretension { surface, node, normal, line });
    }
}

//! Multi-point constraints.

use slipstick_meshio::abaqus::Card;

use super::{DAMAGED, Reader, Target};

/// A constraint of `*MPC`.
#[derive(Debug)]
pub struct Mpc {
    pub kind: MpcKind,
    /// Nodes and sets, in the order of the deck.
    pub targets: Vec<Target>,
    /// Of the keyword and of its first line of data.
    pub lines: [usize; 2],
}

/// What a constraint keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MpcKind {
    /// All nodes in the plane of the first three that are not on one line.
    Plane,
    /// All nodes on the line through the first two.
    Straight,
    /// The first node on the line through the other two.
    Slider,
    /// The first node at the second.
    Pin,
    /// The distance of two nodes.
    Link,
    /// The first nodes rigidly on the last.
    Beam,
    /// The mean rotation of the first nodes is the first component of the last, whose position is the axis.
    MeanRotation,
}

const KINDS: &[(&str, MpcKind)] = &[
    ("PLANE", MpcKind::Plane),
    ("STRAIGHT", MpcKind::Straight),
    ("SLIDER", MpcKind::Slider),
    ("PIN", MpcKind::Pin),
    ("TIE", MpcKind::Pin),
    ("LINK", MpcKind::Link),
    ("BEAM", MpcKind::Beam),
    ("MEANROT", MpcKind::MeanRotation),
];

/// What to write instead of others.
const INSTEAD: &[(&str, &str)] =
    &[("DIST", "let surfaces touch with *CONTACT PAIR; LINK keeps the distance of two nodes")];

impl Reader<'_> {
    pub(super) fn mpc(&mut self, card: &Card<'_>) {
        self.allow(card, &[]);
        let line = card.keyword.line;
        let how = "`[[equation]]` or `[[coupling]]`, for small rotations";
        self.ledger.translated("MPC", line, how);
        for (data, fields) in card.data() {
            let name = fields.first().copied().unwrap_or_default().to_ascii_uppercase();
            let targets = fields.iter().skip(1).filter(|field| !field.is_empty()).map(|field| Target::new(field));
            // further nodes of the constraint above
            if name.is_empty() || name == "0" {
                match self.deck.mpcs.last_mut().filter(|last| last.lines[0] == line) {
                    Some(last) => last.targets.extend(targets),
                    None => self.ledger.wrong("MPC", [line, data], "the line continues no constraint", DAMAGED),
                }
                continue;
            }
            match KINDS.iter().find(|(kind, _)| *kind == name) {
                Some(&(_, kind)) => {
                    let targets = targets.collect();
                    self.deck.mpcs.push(Mpc { kind, targets, lines: [line, data] });
                }
                None => {
                    let instead = INSTEAD.iter().find(|(kind, _)| *kind == name).map(|(_, instead)| *instead);
                    let cure =
                        instead.unwrap_or("use PLANE, STRAIGHT, SLIDER, PIN, TIE, LINK, BEAM or MEANROT, or *EQUATION");
                    let shown: String = name.chars().take(30).collect();
                    self.ledger.refuse_at("MPC", [line, data], format!("{shown} is not supported"), cure);
                }
            }
        }
    }
}

//! Keywords that are not translated: those that do not matter, and those that would change the physics.

use slipstick_meshio::abaqus::Card;

use super::Reader;

/// Requests for output.
const OUTPUT: &[&str] = &[
    "CONTACT FILE",
    "CONTACT OUTPUT",
    "CONTACT PRINT",
    "EL FILE",
    "EL PRINT",
    "ELEMENT OUTPUT",
    "ENERGY FILE",
    "ENERGY OUTPUT",
    "ENERGY PRINT",
    "FACE PRINT",
    "FILE FORMAT",
    "FILE OUTPUT",
    "INTEGRATED OUTPUT",
    "MONITOR",
    "NODE FILE",
    "NODE OUTPUT",
    "NODE PRINT",
    "OUTPUT",
    "PREPRINT",
    "PRINT",
    "RESTART",
    "SECTION FILE",
    "SECTION PRINT",
];

/// Settings of solvers, and data that static steps at one temperature do not use.
const CONTROLS: &[(&str, &str)] = &[
    ("CONTACT CONTROLS", "a control"),
    ("CONTROLS", "a control"),
    ("FILTER", "a request for output"),
    ("GAP CONDUCTANCE", "no temperature changes"),
    ("HOURGLASS STIFFNESS", "elements are fully integrated"),
    ("MASS", "steps are static"),
    ("NO ANALYSIS", "a control"),
    ("PHYSICAL CONSTANTS", "no temperature changes"),
    ("SECTION CONTROLS", "elements are fully integrated"),
    ("SOLUTION TECHNIQUE", "a control"),
    ("TIME POINTS", "a control"),
];

/// What to do about others.
const CURES: &[(&str, &str)] = &[
    ("CONTACT EXCLUSIONS", "name only the surfaces that may touch, with *CONTACT INCLUSIONS or *CONTACT PAIR"),
    ("DISTRIBUTION", "give sections an *ORIENTATION each, or one with SYSTEM=CYLINDRICAL"),
    ("DISTRIBUTION TABLE", "remove it with its *DISTRIBUTION"),
    ("DISTRIBUTING COUPLING", "write *COUPLING with *DISTRIBUTING, or load the surface with *DSLOAD"),
    ("DASHPOT", "remove it: steps are static, without velocities"),
    ("DYNAMIC", "use *STATIC"),
    ("GAP", "let surfaces touch with *CONTACT PAIR"),
    ("INITIAL CONDITIONS", "start from the undeformed, unstressed state"),
    ("SHELL SECTION", "mesh the part with solid elements"),
    ("MEMBRANE SECTION", "remove the section: surfaces need none"),
    ("BEAM SECTION", "mesh the part with solid elements"),
];

impl Reader<'_> {
    /// A keyword that is not translated.
    pub(super) fn refused(&mut self, card: &Card<'_>) {
        let (name, line) = (card.keyword.name.as_str(), card.keyword.line);
        if OUTPUT.contains(&name) {
            return self.ledger.ignored(name, line, "a request for output");
        }
        if let Some((_, why)) = CONTROLS.iter().find(|(control, _)| *control == name) {
            return self.ledger.ignored(name, line, *why);
        }
        let cure = CURES.iter().find(|(keyword, _)| *keyword == name).map(|(_, cure)| *cure);
        self.ledger.refuse(
            name,
            line,
            "this keyword is not supported",
            cure.unwrap_or("remove it if it does not matter"),
        );
    }
}

//! Keywords that are not translated: those that do not matter, and those that would change the physics.

use slipstick_meshio::abaqus::Card;

use super::{On, Reader};

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
        if name == "MASS" {
            self.masses.push(line);
            return self.ledger.ignored(name, line, "steps are static, and no load acts on mass");
        }
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

    /// Refuses point masses if any load acts on mass.
    pub(super) fn refuse_loaded_masses(&mut self) {
        let mut loads = self.deck.steps.iter().flat_map(|step| &step.loads);
        let Some(load) = loads.find(|load| matches!(load.on, On::Mass(..))) else { return };
        let why =
            format!("the load on mass at line {} would act on a point mass, which is not supported", load.lines[1]);
        for &line in &self.masses {
            let cure = "give a solid body this mass with *DENSITY, or load the node with *CLOAD";
            self.ledger.refuse("MASS", line, why.as_str(), cure);
        }
    }
}

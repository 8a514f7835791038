//! Steps, boundary conditions and loads.

use slipstick_meshio::abaqus::Card;

use super::{DAMAGED, Reader};
use crate::vector::unit;

/// A step.
#[derive(Debug)]
pub struct Step {
    pub nlgeom: bool,
    pub period: f64,
    /// First increment, which a step without `DIRECT` may change.
    pub increment: f64,
    pub conditions: Change<Condition>,
    pub loads: Vec<Load>,
    /// The keywords of loads with `OP=NEW`, which ends those of the same keyword from earlier steps, and their lines.
    pub new: Vec<(&'static str, usize)>,
    pub temperatures: Vec<Condition>,
}

impl Step {
    /// Whether the loads of a keyword from earlier steps end.
    pub fn replaces(&self, keyword: &str) -> bool {
        self.new.iter().any(|new| new.0 == keyword)
    }
}

/// What a step changes.
#[derive(Debug)]
pub struct Change<T> {
    /// Whether everything that is not named ends (`OP=NEW`).
    pub replaces: bool,
    pub items: Vec<T>,
}

/// A node or a set.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Target {
    Node(u64),
    Set(String),
}

/// A line of `*BOUNDARY`: component from 0, 0 … 2 of the displacement, 3 … 5 of the rotation.
#[derive(Debug)]
pub struct Condition {
    pub target: Target,
    pub component: u8,
    pub value: f64,
    pub amplitude: Option<String>,
    /// Whether it keeps what the step before has reached (`FIXED`).
    pub fixed: bool,
    /// Of the keyword and of the data.
    pub lines: [usize; 2],
}

/// Instead of the direction of a traction: a pressure.
pub const NORMAL: [f64; 3] = [0.0; 3];

/// What a load acts on.
#[derive(Debug)]
pub enum On {
    /// A component of the force on nodes.
    Nodes(Target, u8),
    /// A face of elements, from 0.
    Face(Target, u8),
    /// A surface, and the direction of a traction, of length 1, or [`NORMAL`].
    Surface(String, [f64; 3]),
    /// The mass of elements.
    Mass(Target, Field),
}

/// A load on mass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Field {
    /// The direction of gravity, of length 1; the value is the acceleration.
    Gravity([f64; 3]),
    /// A point and the direction of the axis; the value is ω².
    Centrifugal([f64; 3], [f64; 3]),
}

/// A line of `*CLOAD`, `*DLOAD` or `*DSLOAD`: a force or a pressure.
#[derive(Debug)]
pub struct Load {
    pub on: On,
    pub value: f64,
    pub amplitude: Option<String>,
    pub keyword: &'static str,
    pub lines: [usize; 2],
}

/// Boundary conditions by name: the components from 0.
const NAMED: &[(&str, &[u8])] = &[
    ("ENCASTRE", &[0, 1, 2, 3, 4, 5]),
    ("PINNED", &[0, 1, 2]),
    ("XSYMM", &[0, 4, 5]),
    ("YSYMM", &[1, 3, 5]),
    ("ZSYMM", &[2, 3, 4]),
    ("XASYMM", &[1, 2, 3]),
    ("YASYMM", &[0, 2, 4]),
    ("ZASYMM", &[0, 1, 5]),
];

impl Reader<'_> {
    /// Reads a keyword of a step.
    pub(super) fn of_step(&mut self, card: &Card<'_>) -> bool {
        let line = card.keyword.line;
        match card.keyword.name.as_str() {
            "STEP" => self.step(card),
            "END STEP" => {
                self.in_step = false;
                self.ledger.used("END STEP", line);
            }
            "STATIC" => self.fixed(card),
            "BOUNDARY" => self.boundary(card),
            "CLOAD" => self.cload(card),
            "DLOAD" => self.dload(card),
            "DSLOAD" => self.dsload(card),
            _ => return false,
        }
        true
    }

    fn step(&mut self, card: &Card<'_>) {
        self.allow(card, &["NLGEOM", "INC", "NAME", "AMPLITUDE", "UNSYMM", "EXTRAPOLATION", "SOLVER", "CONVERT SDI"]);
        let (keyword, line) = (&card.keyword, card.keyword.line);
        let off = keyword.parameter("NLGEOM").is_some_and(|value| value.eq_ignore_ascii_case("NO"));
        // once on, it stays on
        let before = self.deck.steps.last().is_some_and(|step| step.nlgeom);
        let nlgeom = (keyword.has("NLGEOM") || before) && !off;
        if keyword.parameter("AMPLITUDE").is_some_and(|of| of.eq_ignore_ascii_case("STEP")) {
            let why = "loads that jump at the start of the step are not supported";
            self.ledger.refuse("STEP", line, why, "remove AMPLITUDE=STEP: loads then grow over the step");
        }
        self.ledger.translated("STEP", line, "a part of the load path; loads and motions grow linearly over it");
        let conditions = Change { replaces: false, items: vec![] };
        let (period, increment) = (1.0, 1.0);
        let (loads, new, temperatures) = (Vec::new(), Vec::new(), Vec::new());
        self.deck.steps.push(Step { nlgeom, period, increment, conditions, loads, new, temperatures });
        self.in_step = true;
    }

    fn fixed(&mut self, card: &Card<'_>) {
        let damping = ["STABILIZE", "ALLSDTOL", "CONTINUE", "FACTOR"];
        self.allow(card, &[&["DIRECT", "SOLVER", "TIME RESET", "TOTAL TIME AT START"], &damping[..]].concat());
        let line = card.keyword.line;
        if card.keyword.has("STABILIZE") {
            let why = "it is not needed for contact; for snap-through, see `viscosity`";
            self.ledger.refuse("STATIC", line, format!("STABILIZE is not supported: {why}"), "remove the parameter");
        }
        let rows = self.numbers(card);
        let row = rows.first().cloned().unwrap_or_default();
        let value = |at: usize| row.get(at).copied().filter(|&x| x > 0.0);
        let period = value(1).unwrap_or(1.0);
        let increment = value(0).unwrap_or(period).min(period);
        self.ledger.translated("STATIC", line, "load steps of the size of the first increment, halved where needed");
        match self.deck.steps.last_mut() {
            Some(step) if self.in_step => (step.period, step.increment) = (period, increment),
            _ => self.ledger.wrong("STATIC", [line, line], "it is outside of a step", "write *STEP before it"),
        }
    }

    /// Whether the keyword ends what its predecessors said.
    fn replaces(&mut self, card: &Card<'_>) -> bool {
        card.keyword.parameter("OP").is_some_and(|op| op.eq_ignore_ascii_case("NEW"))
    }

    fn boundary(&mut self, card: &Card<'_>) {
        self.allow(card, &["OP", "AMPLITUDE", "TYPE", "FIXED"]);
        let (keyword, line) = (&card.keyword, card.keyword.line);
        if keyword.parameter("TYPE").is_some_and(|of| !of.eq_ignore_ascii_case("DISPLACEMENT")) {
            self.ledger.refuse("BOUNDARY", line, "only displacements can be prescribed", "write TYPE=DISPLACEMENT");
        }
        self.ledger.translated(
            "BOUNDARY",
            line,
            "`[[dirichlet]]`, the motion linear over each step or along its amplitude",
        );
        let amplitude = keyword.parameter("AMPLITUDE").map(str::to_ascii_uppercase);
        let fixed = keyword.has("FIXED");
        let mut found = Vec::new();
        for (data, fields) in card.data() {
            let target = Target::new(fields[0]);
            let word = fields.get(1).copied().unwrap_or_default().to_ascii_uppercase();
            let (components, value): (Vec<u8>, f64) = match NAMED.iter().find(|(name, _)| *name == word) {
                Some((_, components)) => (components.to_vec(), 0.0),
                None => {
                    let last = fields.get(2).copied().filter(|field| !field.is_empty()).unwrap_or(&word);
                    let (Ok(first), Ok(last)) = (word.parse::<u8>(), last.parse::<u8>()) else {
                        let why = "a line has a node or set, the first and last component and a value";
                        self.ledger.wrong("BOUNDARY", [line, data], why, DAMAGED);
                        continue;
                    };
                    if first == 0 || last > 6 {
                        let why = format!("component {} is not one of a displacement or rotation", first.max(last));
                        self.ledger.refuse_at("BOUNDARY", [line, data], why, "use components 1 to 6");
                        continue;
                    }
                    ((first - 1..last).collect(), self.number(card, data, &fields, 3).unwrap_or(0.0))
                }
            };
            for component in components {
                let (target, amplitude) = (target.clone(), amplitude.clone());
                found.push(Condition { target, component, value, amplitude, fixed, lines: [line, data] });
            }
        }
        let replaces = self.replaces(card);
        match self.deck.steps.last_mut() {
            Some(step) => {
                step.conditions.replaces |= replaces;
                step.conditions.items.extend(found);
            }
            None => self.deck.conditions.extend(found),
        }
    }

    /// Adds the loads of a keyword to its step.
    fn loads(&mut self, card: &Card<'_>, keyword: &'static str, found: Vec<Load>) {
        let (replaces, line) = (self.replaces(card), card.keyword.line);
        match self.deck.steps.last_mut() {
            Some(step) if self.in_step => {
                step.new.extend(replaces.then_some((keyword, line)));
                step.loads.extend(found);
            }
            _ => self.ledger.wrong(keyword, [line, line], "it is outside of a step", "move it into a step"),
        }
    }

    /// Refuses `OP=NEW` with only one of the keywords of distributed loads where it matters: in Abaqus, it ends the
    /// loads of this keyword, in CalculiX those of both.
    pub(super) fn refuse_half_new(&mut self) {
        let kinds = ["DLOAD", "DSLOAD"];
        // the lines of loads that earlier steps have left
        let mut acting: [Option<usize>; 2] = [None, None];
        for step in &self.deck.steps {
            for (at, (keyword, other)) in [(0, (kinds[0], kinds[1])), (1, (kinds[1], kinds[0]))] {
                let new = step.new.iter().find(|new| new.0 == keyword);
                let (Some(&(_, line)), Some(of)) = (new, acting[1 - at]) else { continue };
                if !step.replaces(other) {
                    let why = format!(
                        "OP=NEW ends the *{other} of line {of} in CalculiX, but not in Abaqus: which is meant is not clear"
                    );
                    let cure = "write OP=NEW with *DLOAD and *DSLOAD in this step, and all loads that act in it";
                    self.ledger.refuse(keyword, line, why, cure);
                }
            }
            for (acting, keyword) in acting.iter_mut().zip(kinds) {
                let named = step.loads.iter().find(|load| load.keyword == keyword).map(|load| load.lines[1]);
                *acting = if step.replaces(keyword) { named } else { acting.or(named) };
            }
        }
    }

    fn cload(&mut self, card: &Card<'_>) {
        self.allow(card, &["OP", "AMPLITUDE"]);
        let line = card.keyword.line;
        self.ledger.translated("CLOAD", line, "`[[load]]` with `nodal_force`, or a load on a rigid body");
        let amplitude = card.keyword.parameter("AMPLITUDE").map(str::to_ascii_uppercase);
        let mut found = Vec::new();
        for (data, fields) in card.data() {
            let component = fields.get(1).and_then(|field| field.parse::<u8>().ok()).filter(|c| (1..=6).contains(c));
            let Some(component) = component else {
                let why = "a line has a node or set, a component from 1 to 6 and a force";
                self.ledger.wrong("CLOAD", [line, data], why, DAMAGED);
                continue;
            };
            let value = self.number(card, data, &fields, 2).unwrap_or(0.0);
            let (on, amplitude) = (On::Nodes(Target::new(fields[0]), component - 1), amplitude.clone());
            found.push(Load { on, value, amplitude, keyword: "CLOAD", lines: [line, data] });
        }
        self.loads(card, "CLOAD", found);
    }

    fn dload(&mut self, card: &Card<'_>) {
        self.allow(card, &["OP", "AMPLITUDE"]);
        let line = card.keyword.line;
        let amplitude = card.keyword.parameter("AMPLITUDE").map(str::to_ascii_uppercase);
        let mut found = Vec::new();
        for (data, fields) in card.data() {
            let kind = fields.get(1).copied().unwrap_or_default().to_ascii_uppercase();
            if let Some(field) = self.field(card, data, &fields, &kind) {
                let value = self.number(card, data, &fields, 2).unwrap_or(0.0);
                let (on, amplitude) = (On::Mass(Target::new(fields[0]), field), amplitude.clone());
                let how = "`gravity` or `centrifugal` on the mass of bodies";
                self.ledger.translated("DLOAD", line, how);
                found.push(Load { on, value, amplitude, keyword: "DLOAD", lines: [line, data] });
                continue;
            }
            let Some(face) =
                kind.strip_prefix('P').and_then(|face| face.parse::<u8>().ok()).filter(|f| (1..=6).contains(f))
            else {
                let why = format!("the load `{kind}` is not supported");
                let cure = "use a pressure P1 to P6 on faces, GRAV, CENTRIF, or forces";
                self.ledger.refuse_at("DLOAD", [line, data], why, cure);
                continue;
            };
            self.ledger.translated("DLOAD", line, "`pressure` on the deformed faces");
            let value = self.number(card, data, &fields, 2).unwrap_or(0.0);
            let (on, amplitude) = (On::Face(Target::new(fields[0]), face - 1), amplitude.clone());
            found.push(Load { on, value, amplitude, keyword: "DLOAD", lines: [line, data] });
        }
        self.loads(card, "DLOAD", found);
    }

    /// What a line says of a load on mass, if it is one.
    fn field(&mut self, card: &Card<'_>, data: usize, fields: &[&str], kind: &str) -> Option<Field> {
        let mut vector = |first: usize| [0, 1, 2].map(|c| self.number(card, data, fields, first + c).unwrap_or(0.0));
        let (point, direction) = match kind {
            "GRAV" => (None, vector(3)),
            "CENTRIF" | "CENTRIFUGAL" => (Some(vector(3)), vector(6)),
            _ => return None,
        };
        let length = direction.iter().map(|n| n * n).sum::<f64>().sqrt();
        if length == 0.0 {
            self.ledger.wrong("DLOAD", [card.keyword.line, data], "the direction is zero", DAMAGED);
            return Some(Field::Gravity([0.0, 0.0, 1.0]));
        }
        Some(match point {
            Some(point) => Field::Centrifugal(point, direction),
            None => Field::Gravity(direction.map(|n| n / length)),
        })
    }

    fn dsload(&mut self, card: &Card<'_>) {
        self.allow(card, &["OP", "AMPLITUDE", "FOLLOWER", "CONSTANT RESULTANT", "ORIENTATION"]);
        let (keyword, line) = (&card.keyword, card.keyword.line);
        let says = |name: &str, value: &str| keyword.parameter(name).is_some_and(|of| of.eq_ignore_ascii_case(value));
        let amplitude = keyword.parameter("AMPLITUDE").map(str::to_ascii_uppercase);
        let dead = says("FOLLOWER", "NO") && says("CONSTANT RESULTANT", "YES");
        let turns = self.deck.steps.last().is_some_and(|step| step.nlgeom) && !dead;
        let mut found = Vec::new();
        for (data, fields) in card.data() {
            let lines = [line, data];
            let direction = match fields.get(1).copied().unwrap_or_default().to_ascii_uppercase().as_str() {
                "P" => {
                    self.ledger.translated("DSLOAD", line, "`pressure` on the deformed surface");
                    NORMAL
                }
                "TRVEC" if turns || keyword.has("ORIENTATION") => {
                    let why = "with NLGEOM, only tractions with a fixed direction per undeformed area are supported";
                    let cure = "write FOLLOWER=NO, CONSTANT RESULTANT=YES, and the direction in global components";
                    self.ledger.refuse_at("DSLOAD", lines, why, cure);
                    continue;
                }
                "TRVEC" => {
                    let vector = [3, 4, 5].map(|at| self.number(card, data, &fields, at).unwrap_or(0.0));
                    let Some(direction) = unit(vector) else {
                        self.ledger.wrong("DSLOAD", lines, "the direction is zero", DAMAGED);
                        continue;
                    };
                    self.ledger.translated("DSLOAD", line, "`traction`: a fixed direction, per undeformed area");
                    direction
                }
                _ => {
                    let why = "only pressures P and tractions TRVEC are supported";
                    self.ledger.refuse_at("DSLOAD", lines, why, "use P or TRVEC, or forces on nodes");
                    continue;
                }
            };
            let value = self.number(card, data, &fields, 2).unwrap_or(0.0);
            let on = On::Surface(fields[0].trim_matches('"').to_owned(), direction);
            found.push(Load { on, value, amplitude: amplitude.clone(), keyword: "DSLOAD", lines });
        }
        self.loads(card, "DSLOAD", found);
    }
}

//! Springs and their elements.

use slipstick_meshio::abaqus::Card;

use super::{DAMAGED, Reader};

/// The kind of a connector, which is a spring along its line or between equal components.
pub const CONNECTOR: char = 'C';

/// An element of type `SPRING1`, `SPRING2`, `SPRINGA` or `CONN3D2`.
#[derive(Debug)]
pub struct SpringElement {
    /// `1`, `2`, `A` or [`CONNECTOR`].
    pub kind: char,
    /// Numbers of its nodes.
    pub nodes: Vec<u64>,
    /// The sets in capitals that have it: of `*ELEMENT` and of `*ELSET`.
    pub sets: Vec<String>,
    number: u64,
    line: usize,
}

/// `*SPRING` or `*CONNECTOR SECTION`: the stiffness of a set of elements.
#[derive(Debug)]
pub struct SpringSection {
    pub keyword: &'static str,
    /// In capitals.
    pub set: String,
    /// Components from 0 at the first and the second node, if they are given.
    pub components: Vec<u8>,
    /// The `*ORIENTATION` in capitals to which the components belong; `None`: global axes.
    pub orientation: Option<String>,
    pub stiffness: f64,
    pub line: usize,
}

impl Reader<'_> {
    /// Reads the elements of a keyword, if they are springs.
    pub(super) fn spring_elements(&mut self, card: &Card<'_>, kind: &str) -> bool {
        let (keyword, line) = (&card.keyword, card.keyword.line);
        let kind = match kind {
            "CONN3D2" => CONNECTOR,
            _ => match kind.strip_prefix("SPRING").and_then(|rest| rest.chars().next()) {
                Some(kind) => kind,
                None => return false,
            },
        };
        let ends = if kind == '1' { 1 } else { 2 };
        self.ledger.translated("ELEMENT", line, "`[[spring]]`");
        let sets: Vec<String> = keyword.parameter("ELSET").map(str::to_ascii_uppercase).into_iter().collect();
        for (data, fields) in card.data() {
            let numbers: Vec<u64> = fields.iter().filter_map(|field| field.parse().ok()).collect();
            if numbers.len() != 1 + ends || fields.iter().filter(|field| !field.is_empty()).count() != 1 + ends {
                let name = if kind == CONNECTOR { "CONN3D2".to_owned() } else { format!("SPRING{kind}") };
                let why = format!("an element of type {name} has a number and {ends} nodes");
                self.ledger.wrong("ELEMENT", [line, data], why, DAMAGED);
                continue;
            }
            let (number, nodes) = (numbers[0], numbers[1..].to_vec());
            self.deck.spring_elements.push(SpringElement { kind, nodes, sets: sets.clone(), number, line });
        }
        true
    }

    /// Adds the elements of a set that are springs.
    pub(super) fn spring_set(&mut self, card: &Card<'_>) {
        let (Some(set), false) = (card.keyword.parameter("ELSET"), self.deck.spring_elements.is_empty()) else {
            return;
        };
        let set = set.to_ascii_uppercase();
        for (_, fields) in card.data() {
            let numbers: Vec<u64> = fields.iter().filter_map(|field| field.parse().ok()).collect();
            let ranges: Vec<[u64; 3]> = match (card.keyword.has("GENERATE"), &numbers[..]) {
                (true, &[first, last, ref step @ ..]) => vec![[first, last, step.first().copied().unwrap_or(1).max(1)]],
                _ => numbers.iter().map(|&number| [number, number, 1]).collect(),
            };
            let names: Vec<String> = fields.iter().map(|field| field.to_ascii_uppercase()).collect();
            for element in &mut self.deck.spring_elements {
                let inside = |&[first, last, step]: &[u64; 3]| {
                    (first..=last).contains(&element.number) && (element.number - first).is_multiple_of(step)
                };
                if ranges.iter().any(inside) || names.iter().any(|name| element.sets.contains(name)) {
                    element.sets.push(set.clone());
                }
            }
        }
    }

    /// Refuses spring elements that no section names: they would have no stiffness.
    pub(super) fn refuse_loose_springs(&mut self) {
        for element in &self.deck.spring_elements {
            let keyword = if element.kind == CONNECTOR { "CONNECTOR SECTION" } else { "SPRING" };
            if self.ledger.ignores(keyword) || element.sets.iter().any(|set| self.spring_sets.contains(set)) {
                continue;
            }
            let why = format!("no *{keyword} gives these elements a stiffness");
            let cure = format!("name their ELSET in *{keyword}, or remove the elements");
            self.ledger.wrong("ELEMENT", [element.line; 2], why, &cure);
        }
    }

    pub(super) fn spring(&mut self, card: &Card<'_>) {
        self.allow(card, &["ELSET", "ORIENTATION"]);
        let line = card.keyword.line;
        let Some(set) = card.keyword.parameter("ELSET").map(str::to_ascii_uppercase) else {
            return self.ledger.wrong("SPRING", [line; 2], "the springs need ELSET=…", "add the parameter");
        };
        self.spring_sets.push(set.clone());
        self.ledger.translated("SPRING", line, "`[[spring]]`, with `nodal_stiffness`");
        // the line of components is empty for SPRINGA, and left out here
        let rows = self.numbers(card);
        let (components, stiffness) = match &rows[..] {
            [stiffness] => (Vec::new(), stiffness.first()),
            [components, stiffness] => (components.clone(), stiffness.first()),
            _ => (Vec::new(), None),
        };
        let Some(&stiffness) = stiffness.filter(|&&stiffness| stiffness > 0.0) else {
            let why =
                "a spring has a line with its components, which is empty for SPRINGA, and one with its stiffness > 0";
            return self.ledger.wrong("SPRING", [line; 2], why, DAMAGED);
        };
        if components.iter().any(|c| ![1.0, 2.0, 3.0].contains(c)) {
            let why = "a spring acts on components 1 to 3 of the displacement";
            return self.ledger.refuse("SPRING", line, why, "use components 1 to 3");
        }
        let components = components.iter().map(|&c| c as u8 - 1).collect();
        let orientation = card.keyword.parameter("ORIENTATION").map(str::to_ascii_uppercase);
        self.deck.springs.push(SpringSection { keyword: "SPRING", set, components, orientation, stiffness, line });
    }
}

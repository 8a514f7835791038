//! What the tables of several kinds of quantities contain: sets, bodies, slave surfaces, components.

use super::component::{ForceComponent, ForceWord, VectorComponent, VectorWord};
use crate::file::document::Table;
use crate::file::names::Names;
use crate::file::read::common;
use crate::file::reader::suggestion_or_list;
use crate::file::{BoxRegion, CaseCode, Contact, Sides};
use std::ops::Deref;

/// What the tables refer to.
pub(crate) struct Known<'a> {
    pub names: &'a Names,
    pub slaves: Slaves<'a>,
    /// The names of the springs.
    pub springs: Vec<&'a str>,
    /// The names of the bolts.
    pub bolts: Vec<&'a str>,
}

/// The slave surfaces of the contact pairs, by which pairs are named.
pub(crate) struct Slaves<'a> {
    names: Vec<&'a str>,
    /// For pairs whose sides the program chooses, the master, by which they may be named too.
    masters: Vec<Option<&'a str>>,
    /// Whether some slave is missing or is not a surface, which is reported elsewhere. Any surface may
    /// be the intended one.
    uncertain: bool,
}

impl<'a> Slaves<'a> {
    pub fn of(contacts: &'a [Contact], known: &Names) -> Self {
        let chosen = |contact: &'a Contact| (contact.sides == Sides::Chosen).then_some(contact.master.as_str());
        let names: Vec<&str> = contacts.iter().map(|contact| contact.slave.as_str()).collect();
        let uncertain = names.iter().any(|name| known.find(name).is_none());
        Self { names, masters: contacts.iter().map(chosen).collect(), uncertain }
    }

    pub fn is_empty(&self) -> bool {
        self.names.is_empty()
    }
}

/// The table of a quantity.
pub(crate) struct Reading<'r, 'a> {
    pub table: &'r Table<'a>,
    pub known: &'r Known<'r>,
}

impl<'a> Deref for Reading<'_, 'a> {
    type Target = Table<'a>;

    fn deref(&self) -> &Table<'a> {
        self.table
    }
}

/// The axes and the norm.
const VECTOR: &[(&str, VectorWord)] =
    &[("x", VectorWord::X), ("y", VectorWord::Y), ("z", VectorWord::Z), ("norm", VectorWord::Norm)];

const FORCE: &[(&str, ForceWord)] = &[
    ("x", ForceWord::X),
    ("y", ForceWord::Y),
    ("z", ForceWord::Z),
    ("norm", ForceWord::Norm),
    ("normal", ForceWord::Normal),
    ("tangential", ForceWord::Tangential),
    ("nodal", ForceWord::Nodal),
];

impl Reading<'_, '_> {
    /// The required key `set`.
    pub fn set(&self) -> String {
        let set = self.string("set").required(String::new(), "a surface or node set, for instance \"plate_ymin\"");
        self.known.names.check_set(self.reader, &self.path_of("set"), &set);
        set
    }

    /// A surface or node set.
    pub fn optional_set(&self, key: &'static str) -> Option<String> {
        let set = self.string(key).optional()?;
        self.known.names.check_set(self.reader, &self.path_of(key), &set);
        Some(set)
    }

    /// The slave surface of a pair.
    pub fn slave(&self) -> String {
        slave(self.table, self.known.names, &self.known.slaves)
    }

    /// A body, if only one counts.
    pub fn body(&self) -> Option<String> {
        let body = self.string("body").optional()?;
        self.known.names.check_body(self.reader, &self.path_of("body"), &body);
        Some(body)
    }

    /// A list of boxes.
    pub fn boxes(&self, key: &'static str) -> Vec<BoxRegion> {
        common::boxes(self.table, key)
    }

    /// A vector that is not zero.
    pub fn direction(&self, key: &'static str) -> [f64; 3] {
        common::direction(self.table, key)
    }

    /// How close a smooth measure is to the extreme value.
    pub fn sharpness(&self, default: f64) -> f64 {
        let at_least_one = |&p: &f64| p >= 1.0;
        let sharpness = self.number("sharpness");
        sharpness.check(CaseCode::OutOfRange, at_least_one, "must be at least 1", "8 to 30 are usual").or(default)
    }

    /// The same if the chosen measure is smooth, and 0 otherwise.
    pub fn sharpness_of(&self, smooth: bool, smooth_measures: &str, default: f64) -> f64 {
        if !smooth && self.has("sharpness") {
            let message = "`sharpness` has no effect on this measure";
            let help = format!("remove it, or choose the measure {smooth_measures}");
            self.reader.error(&self.path_of("sharpness"), CaseCode::ChooseOne, message, help);
        }
        if smooth { self.sharpness(default) } else { 0.0 * self.sharpness(default) }
    }

    /// An axis, the norm or a direction.
    pub fn vector_component(&self) -> VectorComponent {
        match self.component(VECTOR) {
            Some(Chosen::Direction(direction)) => VectorComponent::Direction(direction),
            Some(Chosen::Word(word)) => VectorComponent::Word(word),
            None => VectorComponent::Word(VectorWord::Norm),
        }
    }

    /// The same, or a sum over the nodes.
    pub fn force_component(&self) -> ForceComponent {
        self.component(FORCE).map_or(ForceComponent::Word(ForceWord::Norm), |chosen| match chosen {
            Chosen::Word(word) => ForceComponent::Word(word),
            Chosen::Direction(direction) => ForceComponent::Direction(direction),
        })
    }

    /// The required key `component`; `None` after an error.
    fn component<T: Copy>(&self, words: &[(&'static str, T)]) -> Option<Chosen<T>> {
        let names: Vec<&str> = words.iter().map(|(name, _)| *name).collect();
        self.require("component", &format!("one of {}, or a direction [x, y, z]", names.join(", ")));
        let value = self.value("component")?;
        if value.get_ref().as_array().is_some() {
            return Some(Chosen::Direction(self.direction("component")));
        }
        self.word("component", words).optional().map(Chosen::Word)
    }
}

/// A word, or a direction.
enum Chosen<T> {
    Word(T),
    Direction([f64; 3]),
}

/// The slave surface of a pair.
pub(crate) fn slave(table: &Table<'_>, known: &Names, slaves: &Slaves<'_>) -> String {
    let Slaves { names: slaves, masters, uncertain } = slaves;
    let slave = table.string("slave").required(String::new(), "the slave surface of a [[contact]]");
    if let Some(pair) = masters.iter().position(|master| *master == Some(slave.as_str()))
        && !slaves.contains(&slave.as_str())
    {
        return slaves[pair].to_owned();
    }
    let excused = *uncertain && known.find(&slave).is_some();
    if !slave.is_empty() && !excused && !slaves.contains(&slave.as_str()) {
        let message = format!("`{slave}` is not the slave of a contact pair");
        let help = if slaves.is_empty() {
            "add a [[contact]] with this slave".into()
        } else {
            suggestion_or_list(&slave, slaves)
        };
        table.reader.error(&table.path_of("slave"), CaseCode::UnknownSet, message, help);
    }
    slave
}

/// Whether a measure has no sharpness.
pub(super) fn is_unused(sharpness: &f64) -> bool {
    *sharpness == 0.0
}

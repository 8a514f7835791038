//! The runs of a study file.

use std::fmt;
use std::path::PathBuf;

use serde::Deserialize;
use serde::de::{Deserializer, MapAccess, Visitor};
use toml::Value;

/// One run.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// Its name, which is also the name of its directory.
    pub name: String,
    /// The command.
    pub command: Word,
    /// The case file, relative to the study file.
    pub case: PathBuf,
    /// Values to replace in it, after those of the study.
    #[serde(default)]
    pub set: Vec<String>,
    /// Lists of values: there is a run for each combination.
    #[serde(default)]
    pub grid: Lists,
    /// Numbers of a grid to print, by the names in its table.
    pub tabulate: Option<Vec<String>>,
    /// An earlier run whose design is used.
    pub design: Option<String>,
    /// Further options of the command.
    #[serde(default)]
    pub options: Vec<String>,
    /// Directions along which the design is mirrored, to measure its symmetry.
    #[serde(default)]
    pub mirror: Vec<Axis>,
    /// Axes about which the design is rotated by half a turn, to measure its symmetry.
    #[serde(default)]
    pub half_turn: Vec<Axis>,
}

/// A command that writes a directory of results.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Word {
    /// `optimize`.
    Optimize,
    /// `solve`.
    Solve,
    /// `gradient`.
    Gradient,
    /// `evaluate`.
    Evaluate,
    /// `verify gradient`.
    Verify,
}

impl Word {
    /// As on the command line.
    pub(super) fn words(self) -> &'static [&'static str] {
        match self {
            Self::Optimize => &["optimize"],
            Self::Solve => &["solve"],
            Self::Gradient => &["gradient"],
            Self::Evaluate => &["evaluate"],
            Self::Verify => &["verify", "gradient"],
        }
    }
}

/// A direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    /// Along x.
    X,
    /// Along y.
    Y,
    /// Along z.
    Z,
}

impl Axis {
    /// Its index among the coordinates.
    pub fn number(self) -> usize {
        match self {
            Self::X => 0,
            Self::Y => 1,
            Self::Z => 2,
        }
    }

    /// Its letter in the study file.
    pub fn letter(self) -> &'static str {
        ["x", "y", "z"][self.number()]
    }
}
/// Lists of values by key, in the order of the file. Keys are those of `--set`; `friction` is that
/// of all contact pairs.
#[derive(Debug, Clone, Default)]
pub struct Lists(pub(super) Vec<(String, Value)>);

impl<'de> Deserialize<'de> for Lists {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct InOrder;
        impl<'de> Visitor<'de> for InOrder {
            type Value = Lists;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a table with a list of values for each key")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Lists, A::Error> {
                let mut lists = Vec::new();
                while let Some((key, value)) = map.next_entry::<String, Value>()? {
                    flatten(key, value, &mut lists);
                }
                Ok(Lists(lists))
            }
        }
        deserializer.deserialize_map(InOrder)
    }
}

/// `load_path.steps = [4, 8]` is a table within a table, unless its key is quoted.
fn flatten(key: String, value: Value, lists: &mut Vec<(String, Value)>) {
    match value {
        Value::Table(table) => {
            table.into_iter().for_each(|(inner, value)| flatten(format!("{key}.{inner}"), value, lists));
        }
        value => lists.push((key, value)),
    }
}

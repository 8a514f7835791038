//! Amounts of memory.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Serialize, Serializer};

/// An amount of memory. \[bytes\]
///
/// ```
/// use slipstick_case::file::Memory;
/// assert_eq!(Memory::parse("1.5 GiB"), Some(Memory(1_610_612_736)));
/// assert_eq!(Memory::parse("500MB").map(|m| m.to_string()), Some("500000000 B".into()));
/// assert_eq!(Memory(8 << 30).to_string(), "8 GiB");
/// assert_eq!((Memory::parse("8 gibi"), Memory::parse("-1 GB"), Memory::parse("")), (None, None, None));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Memory(pub usize);

const UNITS: [(&str, f64); 9] = [
    ("TiB", (1u64 << 40) as f64),
    ("GiB", (1u64 << 30) as f64),
    ("MiB", (1u64 << 20) as f64),
    ("KiB", 1024.0),
    ("TB", 1e12),
    ("GB", 1e9),
    ("MB", 1e6),
    ("kB", 1e3),
    ("B", 1.0),
];

impl Memory {
    /// The default: the same on every machine, so that results are the same too.
    pub const DEFAULT: Self = Self(2 << 30);

    /// Parses a number with a unit of bytes, like `8 GiB`; `0` needs no unit.
    pub fn parse(text: &str) -> Option<Self> {
        let text = text.trim();
        if text == "0" {
            return Some(Self(0));
        }
        let (name, size) = UNITS.iter().find(|(name, _)| text.ends_with(name))?;
        let number: f64 = text.strip_suffix(name)?.trim_end().parse().ok()?;
        let bytes = number * size;
        (bytes.is_finite() && (0.0..=1e15).contains(&bytes)).then_some(Self(bytes.round() as usize))
    }
}

impl std::fmt::Display for Memory {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self(bytes) = *self;
        if bytes == 0 {
            return write!(f, "0");
        }
        match [("GiB", 1 << 30), ("MiB", 1 << 20), ("KiB", 1 << 10)].iter().find(|(_, size)| bytes % size == 0) {
            Some((name, size)) => write!(f, "{} {name}", bytes / size),
            None => write!(f, "{bytes} B"),
        }
    }
}

/// In the format of a case file.
impl Serialize for Memory {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl JsonSchema for Memory {
    fn schema_name() -> Cow<'static, str> {
        "Memory".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "A number with a unit of bytes, like \"8 GiB\" or \"500 MB\", or \"0\".",
            "type": "string",
            "pattern": "^ *([0-9.eE+]+ *(TiB|GiB|MiB|KiB|TB|GB|MB|kB|B)|0) *$",
        })
    }
}

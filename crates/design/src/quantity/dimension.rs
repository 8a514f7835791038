//! Dimensions of quantities.

use std::fmt;

/// Powers of force and length. The user chooses the units.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Dimension {
    /// Power of force.
    pub force: i32,
    /// Power of length.
    pub length: i32,
}

impl Dimension {
    /// A plain number.
    pub const NONE: Self = Self { force: 0, length: 0 };
    /// \[L\]
    pub const LENGTH: Self = Self { force: 0, length: 1 };
    /// \[L²\]
    pub const AREA: Self = Self { force: 0, length: 2 };
    /// \[L³\]
    pub const VOLUME: Self = Self { force: 0, length: 3 };
    /// \[F\]
    pub const FORCE: Self = Self { force: 1, length: 0 };
    /// \[F L\], also of moments
    pub const WORK: Self = Self { force: 1, length: 1 };
    /// \[F/L²\]
    pub const STRESS: Self = Self { force: 1, length: -2 };

    /// In the symbols F and L: `F/L²`; empty for plain numbers.
    pub fn symbol(self) -> &'static str {
        match (self.force, self.length) {
            (0, 0) => "",
            (0, 1) => "L",
            (0, 2) => "L²",
            (0, 3) => "L³",
            (1, 0) => "F",
            (1, 1) => "F L",
            (1, -2) => "F/L²",
            _ => "mixed",
        }
    }
}

impl fmt::Display for Dimension {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.symbol())
    }
}

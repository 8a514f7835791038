//! Dimensions of quantities.

use std::fmt;

/// Powers of force, length and mass. The user chooses the units; mass is separate from force, since
/// cases have no unit of time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Dimension {
    /// Power of force.
    pub force: i32,
    /// Power of length.
    pub length: i32,
    /// Power of mass.
    pub mass: i32,
}

impl Dimension {
    /// A plain number.
    pub const NONE: Self = Self::of(0, 0);
    /// \[L\]
    pub const LENGTH: Self = Self::of(0, 1);
    /// \[L²\]
    pub const AREA: Self = Self::of(0, 2);
    /// \[L³\]
    pub const VOLUME: Self = Self::of(0, 3);
    /// \[F\]
    pub const FORCE: Self = Self::of(1, 0);
    /// \[F L\], also of moments
    pub const WORK: Self = Self::of(1, 1);
    /// \[F/L²\]
    pub const STRESS: Self = Self::of(1, -2);
    /// \[M\]
    pub const MASS: Self = Self { mass: 1, ..Self::NONE };

    /// Powers of force and length.
    pub const fn of(force: i32, length: i32) -> Self {
        Self { force, length, mass: 0 }
    }

    /// In the symbols F, L and M: `F/L²`; empty for plain numbers.
    pub fn symbol(self) -> &'static str {
        if self == Self::MASS {
            return "M";
        }
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

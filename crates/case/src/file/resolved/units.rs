//! Names of the user's units.

use schemars::JsonSchema;
use serde::Serialize;

pub use slipstick_design::Dimension;

/// Names of units, for display: numbers do not depend on them.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Units {
    /// Unit of length, such as `mm`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length: Option<String>,
    /// Unit of force, such as `N`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force: Option<String>,
}

impl Units {
    /// Whether no unit has a name.
    pub fn is_empty(&self) -> bool {
        self.length.is_none() && self.force.is_none()
    }

    /// The unit of a quantity as written after its name, such as ` [N/mm²]`; empty if a unit has no
    /// name.
    pub fn bracket(&self, Dimension { force, length, mass }: Dimension) -> String {
        if mass != 0 {
            return String::new();
        }
        let (mut above, mut below) = (String::new(), String::new());
        for (power, unit) in [(force, &self.force), (length, &self.length)].into_iter().filter(|(power, _)| *power != 0)
        {
            let Some(unit) = unit else { return String::new() };
            let side = if power > 0 { &mut above } else { &mut below };
            if !side.is_empty() {
                side.push(' ');
            }
            side.push_str(unit);
            side.push_str(match power.abs() {
                2 => "²",
                3 => "³",
                _ => "",
            });
        }
        match (above.is_empty(), below.is_empty()) {
            (true, true) => String::new(),
            (false, true) => format!(" [{above}]"),
            (true, false) => format!(" [1/{below}]"),
            (false, false) => format!(" [{above}/{below}]"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_put_together() {
        let name = |text: &str| Some(text.to_owned());
        let both = Units { length: name("mm"), force: name("N") };
        let found =
            [Dimension::LENGTH, Dimension::VOLUME, Dimension::FORCE, Dimension::STRESS].map(|d| both.bracket(d));
        assert_eq!(found, [" [mm]", " [mm³]", " [N]", " [N/mm²]"]);
        assert_eq!(both.bracket(Dimension::NONE), "");
        let length = Units { length: name("m"), force: None };
        assert_eq!([length.bracket(Dimension::LENGTH), length.bracket(Dimension::STRESS)], [" [m]", ""]);
    }
}

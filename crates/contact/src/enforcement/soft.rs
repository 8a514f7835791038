//! Pressures of the penalty method that do not grow in proportion to the penetration.

/// Pressure as a function of the mean gap at a node.
#[derive(Debug, Clone, PartialEq)]
pub enum PressureLaw {
    /// p = p₀ 100^(−g/c₀), as in CalculiX: also across a gap. Beyond a gap of [`RANGE`] c₀ the pressure is
    /// zero, and beyond a penetration of [`RANGE`] c₀ it grows linearly, so that no trial state overflows.
    Exponential {
        /// The pressure p₀ without a gap. \[F/L²\]
        contact_pressure: f64,
        /// The gap c₀ at which the pressure is 1 % of p₀. \[L\]
        clearance: f64,
    },
    /// Linear between these penetrations and pressures, of which the first is 0; constant after the last.
    /// Penetrations ascend. \[L, F/L²\]
    Table(Vec<[f64; 2]>),
    /// The penetration itself: a stiffness of 1, which is known only where a node multiplies it by its own. \[L\]
    Proportional,
}

/// Gaps and penetrations of an exponential law at which it ends, over c₀: the pressure is 10⁻¹² and 10¹² of
/// the contact pressure there.
pub const RANGE: f64 = 6.0;

impl PressureLaw {
    /// The largest gap across which there may be a pressure. \[L\]
    pub fn reach(&self) -> f64 {
        match self {
            Self::Exponential { clearance, .. } => RANGE * clearance,
            Self::Table(points) => points.first().map_or(0.0, |[penetration, _]| (-penetration).max(0.0)),
            Self::Proportional => 0.0,
        }
    }

    /// The pressure at a gap, and its derivative with respect to it. \[F/L², F/L³\]
    ///
    /// Test: `pressures_match_finite_differences`.
    pub fn at(&self, gap: f64) -> (f64, f64) {
        match self {
            &Self::Exponential { contact_pressure, clearance } => {
                if gap > RANGE * clearance {
                    return (0.0, 0.0);
                }
                let rate = 100.0_f64.ln() / clearance;
                let inside = gap.max(-RANGE * clearance);
                let pressure = contact_pressure * (-rate * inside).exp();
                (pressure * (1.0 - rate * (gap - inside)), -rate * pressure)
            }
            Self::Table(points) => {
                let next = points.partition_point(|[penetration, _]| *penetration <= -gap);
                match (next.checked_sub(1).and_then(|last| points.get(last)), points.get(next)) {
                    (Some(&[from, low]), Some(&[to, high])) => {
                        let slope = (high - low) / (to - from);
                        (low + slope * (-gap - from), -slope)
                    }
                    (Some(&[_, only]), None) | (None, Some(&[_, only])) => (only, 0.0),
                    (None, None) => (0.0, 0.0),
                }
            }
            Self::Proportional if gap < 0.0 => (-gap, -1.0),
            Self::Proportional => (0.0, 0.0),
        }
    }

    /// The energy per area that the pressure stores at a gap, ∫ p over larger gaps; of a table, from its first point on.
    /// \[F/L\], or \[L²\] for a stiffness of 1
    ///
    /// Test: `pressures_match_finite_differences`.
    pub fn energy(&self, gap: f64) -> f64 {
        match self {
            &Self::Exponential { contact_pressure, clearance } => {
                let (rate, end) = (100.0_f64.ln() / clearance, RANGE * clearance);
                let pressure = |gap: f64| contact_pressure * (-rate * gap).exp();
                let inside = gap.clamp(-end, end);
                let deeper = (inside - gap).max(0.0);
                let beyond = pressure(inside) * deeper * (1.0 + 0.5 * rate * deeper);
                (pressure(inside) - pressure(end)) / rate + beyond
            }
            Self::Table(points) => {
                let first = points.first().map_or(0.0, |point| point[0]);
                let passed = points.iter().map(|point| point[0]).filter(|penetration| *penetration < -gap);
                let ends: Vec<f64> = passed.chain([(-gap).max(first)]).collect();
                let part = |ends: &[f64]| {
                    let [low, high] = [self.at(-ends[0]).0, self.at(-ends[1]).0];
                    0.5 * (low + high) * (ends[1] - ends[0])
                };
                ends.windows(2).map(part).sum()
            }
            Self::Proportional => 0.5 * gap.min(0.0).powi(2),
        }
    }
}

/// What is integrated over a contact surface, as a function of the gap at each point.
#[derive(Debug, Clone, Copy)]
pub enum Weight<'a> {
    /// The pressure of a law.
    Pressure(&'a PressureLaw),
    /// The energy per area that it stores.
    Energy(&'a PressureLaw),
}

impl Weight<'_> {
    /// The weight at a gap, and its derivative with respect to it.
    pub fn at(self, gap: f64) -> (f64, f64) {
        match self {
            Self::Pressure(law) => law.at(gap),
            Self::Energy(law) => (law.energy(gap), -law.at(gap).0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: p₀ at contact, 1 % of it at c₀, 100 times of it at the penetration c₀.
    #[test]
    fn pressures_match_finite_differences() {
        let law = PressureLaw::Exponential { contact_pressure: 3.0, clearance: 0.02 };
        for (gap, pressure) in [(0.0, 3.0), (0.02, 0.03), (-0.02, 300.0), (0.121, 0.0)] {
            assert!((law.at(gap).0 - pressure).abs() < 1e-12 * pressure.max(1.0), "{gap}");
        }
        let table = PressureLaw::Table(vec![[0.0, 1.0], [0.1, 5.0], [0.2, 25.0]]);
        for (gap, pressure) in [(0.5, 1.0), (-0.05, 3.0), (-0.15, 15.0), (-1.0, 25.0)] {
            assert!((table.at(gap).0 - pressure).abs() < 1e-12 * pressure, "{gap}");
        }
        // from penetrations of 0 to 0.3, by hand
        for (law, gap, energy) in [(&table, -0.3, 0.3 + 1.5 + 2.5), (&PressureLaw::Proportional, -0.2, 0.02)] {
            assert!((law.energy(gap) - energy).abs() < 1e-12, "{law:?}");
        }
        for law in [law, table] {
            for gap in [-0.3, -0.15, -0.11, -0.05, -0.01, 0.003, 0.05, 0.3] {
                let h = 1e-8;
                let expected = (law.at(gap + h).0 - law.at(gap - h).0) / (2.0 * h);
                let work = (law.energy(gap + h) - law.energy(gap - h)) / (2.0 * h);
                let (pressure, slope) = law.at(gap);
                assert!((slope - expected).abs() <= 1e-5 * (expected.abs() + pressure), "{law:?} {gap}");
                // the energy of a table begins at its first point
                if gap < 0.0 || matches!(law, PressureLaw::Exponential { .. }) {
                    assert!((work + pressure).abs() <= 1e-5 * pressure, "{law:?} {gap}: {work} {pressure}");
                }
            }
        }
    }
}

//! Results of CalculiX: displacements and reactions of the last increment in an `.frd` file, contact
//! forces in a `.dat` file.

use std::collections::HashMap;

use thiserror::Error;

use super::compare::ContactPart;
use super::{Compared, Source};

/// Why results cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum ResultsError {
    /// A file has no complete increment.
    #[error("{0} has no complete increment")]
    Empty(&'static str),
    /// A line cannot be read.
    #[error("{file}, line {line}: no finite numbers where CalculiX writes them")]
    Damaged {
        /// Which file.
        file: &'static str,
        /// The line, from 1.
        line: usize,
    },
}

/// Force of a contact pair.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct PairForce {
    /// On the slave. \[F\]
    total: [f64; 3],
    /// Tension is positive. \[F\]
    normal: f64,
}

/// The results of the last increment.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Values {
    /// Time at its end.
    pub time: f64,
    /// Displacement of each node. \[L\]
    pub displacements: HashMap<u32, [f64; 3]>,
    /// Reaction of each node. \[F\]
    pub reactions: HashMap<u32, [f64; 3]>,
    /// By the slave surface in capitals.
    pairs: HashMap<String, PairForce>,
}

impl Values {
    /// Reads the texts of both files.
    ///
    /// # Errors
    /// [`ResultsError`].
    pub fn parse(frd: &str, dat: &str) -> Result<Self, ResultsError> {
        let mut values = Self::default();
        values.frd(frd)?;
        values.dat(dat)?;
        Ok(values)
    }

    fn frd(&mut self, text: &str) -> Result<(), ResultsError> {
        let mut field = "";
        for (number, line) in text.lines().enumerate() {
            let damaged = ResultsError::Damaged { file: "the .frd file", line: number + 1 };
            if let Some(head) = line.strip_prefix("  100C") {
                let time = head.get(6..18).and_then(|time| time.trim().parse().ok());
                self.time = time.ok_or(damaged)?;
            } else if let Some(name) = line.strip_prefix(" -4  ") {
                field = name.split_whitespace().next().unwrap_or_default();
            } else if line.starts_with(" -3") {
                field = "";
            } else if line.starts_with(" -1") && ["DISP", "FORC"].contains(&field) {
                let node = line.get(3..13).and_then(|node| node.trim().parse::<u32>().ok());
                let component = |c: usize| line.get(13 + 12 * c..25 + 12 * c).and_then(|x| finite(x.trim()));
                let (Some(node), Some(x), Some(y), Some(z)) = (node, component(0), component(1), component(2)) else {
                    return Err(damaged);
                };
                let into = if field == "DISP" { &mut self.displacements } else { &mut self.reactions };
                into.insert(node, [x, y, z]);
            }
        }
        if self.displacements.is_empty() { Err(ResultsError::Empty("the .frd file")) } else { Ok(()) }
    }

    fn dat(&mut self, text: &str) -> Result<(), ResultsError> {
        let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
        while let Some((number, line)) = lines.next() {
            let damaged = |number: usize| ResultsError::Damaged { file: "the .dat file", line: number + 1 };
            let mut row = || -> Result<Vec<f64>, ResultsError> {
                let (number, line) = lines.next().ok_or_else(|| damaged(number))?;
                let all: Option<Vec<f64>> = line.split_whitespace().map(finite).collect();
                all.ok_or_else(|| damaged(number))
            };
            let line = line.trim();
            if let Some(rest) = line.strip_prefix("statistics for slave set ") {
                let slave = rest.split(',').next().unwrap_or_default().trim().to_ascii_uppercase();
                // each row of numbers has a line of names above it
                let mut next = |count: usize| -> Result<Vec<f64>, ResultsError> {
                    let _names = row();
                    let all = row()?;
                    if all.len() < count { Err(damaged(number)) } else { Ok(all) }
                };
                let total = next(6)?;
                next(6)?;
                next(3)?;
                let normal = next(3)?[1];
                self.pairs.insert(slave, PairForce { total: [total[0], total[1], total[2]], normal });
            }
        }
        Ok(())
    }

    /// The largest component of a displacement \[L\] and of a nodal force \[F\].
    pub fn largest(&self) -> [f64; 2] {
        [&self.displacements, &self.reactions].map(|of| of.values().flatten().fold(0.0, |a: f64, b| a.max(b.abs())))
    }

    /// The number that CalculiX has for what is compared; `None` if it did not report it.
    pub fn of(&self, compared: &Compared) -> Option<f64> {
        let measured = |v: [f64; 3], along: Option<[f64; 3]>| match along {
            Some(n) => v[0] * n[0] + v[1] * n[1] + v[2] * n[2],
            None => v.iter().map(|x| x * x).sum::<f64>().sqrt(),
        };
        match &compared.source {
            Source::Reaction { unknowns, loads, along } => {
                let mut sum = loads.map(|load| -load);
                for (node, c) in unknowns {
                    sum[usize::from(*c)] += self.reactions.get(node)?[usize::from(*c)];
                }
                Some(measured(sum, *along))
            }
            Source::Displacement { nodes, along } => {
                let mut sum = [0.0; 3];
                for (node, weight) in nodes.iter().filter(|(_, weight)| weight.abs() > 1e-12) {
                    let u = self.displacements.get(node)?;
                    (0..3).for_each(|c| sum[c] += weight * u[c]);
                }
                Some(measured(sum, *along))
            }
            Source::Contact { slave, part, .. } => {
                let pair = self.pairs.get(&slave.to_ascii_uppercase())?;
                Some(match part {
                    ContactPart::Normal => -pair.normal,
                    ContactPart::Along(n) => measured(pair.total, Some(*n)),
                    ContactPart::Norm => measured(pair.total, None),
                })
            }
        }
    }
}

/// A number that is neither infinite nor NaN, which CalculiX writes where it diverges.
fn finite(text: &str) -> Option<f64> {
    text.parse().ok().filter(|x: &f64| x.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lines as CalculiX 2.20 writes them: a displacement, and one that diverged.
    #[test]
    fn numbers_that_are_not_finite_are_errors() {
        let frd = |x: &str| {
            format!(
                "  100CL  101 1.00000E+00           1                     0    1           1\n -4  DISP        4    1\n\
                 -1         7{x} 2.00000E-01-3.00000E-01\n -3\n"
            )
            .replace("\n-1", "\n -1")
        };
        let values = Values::parse(&frd(" 1.50000E+00"), "").expect("a displacement");
        assert_eq!(values.displacements[&7], [1.5, 0.2, -0.3]);
        for bad in ["         NaN", "         inf", "        -nan"] {
            let error = Values::parse(&frd(bad), "").expect_err("not a number");
            assert_eq!(error, ResultsError::Damaged { file: "the .frd file", line: 3 }, "{bad}");
        }
    }
}

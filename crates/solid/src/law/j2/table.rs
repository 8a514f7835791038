//! Hardening from a table.

use super::Hardening;
use crate::law::constants::ELASTIC;
use crate::law::{Constant, Form, MaterialError, Real, Value};

/// Maximum number of rows.
const ROWS: usize = 32;

/// σ_y from a table of true stresses and plastic strains, linear between its rows and constant beyond
/// the last, as programs for decks read it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Table {
    rows: usize,
    stress: [f64; ROWS],
    strain: [f64; ROWS],
}

impl Table {
    /// The row at which the interval of a strain begins.
    fn row(&self, strain: f64) -> usize {
        self.strain[1..self.rows].iter().take_while(|&&end| end <= strain).count()
    }

    /// dσ_y/dα behind a row.
    fn slope_behind(&self, row: usize) -> f64 {
        if row + 1 == self.rows {
            return 0.0;
        }
        (self.stress[row + 1] - self.stress[row]) / (self.strain[row + 1] - self.strain[row])
    }
}

impl Hardening for Table {
    const CONSTANTS: &'static [Constant] = &[
        ELASTIC[0],
        ELASTIC[1],
        Constant {
            key: "yield_stress",
            about: "Yield stresses (true stresses), the first at plastic strain 0; they do not decrease. [F/L²]",
            help: "the true stresses of a tension test, for instance [250, 300, 340]",
            form: Form::Numbers { most: ROWS },
        },
        Constant {
            key: "plastic_strain",
            about: "Equivalent plastic strains of these stresses, ascending from 0; beyond the last, the yield \
                    stress is constant.",
            help: "logarithmic plastic strains of the stresses, for instance [0, 0.02, 0.1]",
            form: Form::Numbers { most: ROWS },
        },
    ];

    fn with_constants(values: &[Value]) -> Result<Self, MaterialError> {
        let [stresses, strains] = [values[0].numbers(), values[1].numbers()];
        let wrong = |key, problem: String, help| Err(MaterialError::new(key, problem, help));
        if stresses.len() != strains.len() {
            let problem = format!("there are {} yield stresses, but {} plastic strains", stresses.len(), strains.len());
            return wrong("plastic_strain", problem, "give one plastic strain for each stress");
        }
        if strains[0] != 0.0 {
            let problem = format!("the first plastic strain is {}", strains[0]);
            return wrong("plastic_strain", problem, "the table begins at 0, with the initial yield stress");
        }
        if let Some(pair) = strains.windows(2).find(|pair| pair[1] <= pair[0]) {
            let problem = format!("the plastic strain {} follows {}", pair[1], pair[0]);
            return wrong("plastic_strain", problem, "they must ascend");
        }
        if !(stresses[0] > 0.0) {
            let problem = format!("the initial yield stress is {}", stresses[0]);
            return wrong("yield_stress", problem, "it must be greater than zero");
        }
        if let Some(pair) = stresses.windows(2).find(|pair| pair[1] < pair[0]) {
            let problem = format!("the yield stress {} follows {}", pair[1], pair[0]);
            return wrong("yield_stress", problem, "softening has no unique solution");
        }
        Ok(Self { rows: stresses.len(), stress: values[0].padded(), strain: values[1].padded() })
    }

    fn values(&self) -> Vec<Value> {
        vec![self.stress[..self.rows].into(), self.strain[..self.rows].into()]
    }

    fn like(youngs_modulus: f64) -> Self {
        let [low, high] = [1e3, 2e3].map(|factor| factor * youngs_modulus);
        let (mut stress, mut strain) = ([0.0; ROWS], [0.0; ROWS]);
        stress[..2].copy_from_slice(&[low, high]);
        strain[1] = 0.1;
        Self { rows: 2, stress, strain }
    }

    fn yield_stress<R: Real>(&self, strain: R) -> R {
        let row = self.row(strain.value());
        R::from(self.stress[row]) + R::from(self.slope_behind(row)) * (strain - R::from(self.strain[row]))
    }

    fn slope(&self, strain: f64) -> f64 {
        self.slope_behind(self.row(strain))
    }

    fn work<R: Real>(&self, strain: R) -> R {
        let last = self.row(strain.value());
        let whole =
            |row: usize| 0.5 * (self.stress[row] + self.stress[row + 1]) * (self.strain[row + 1] - self.strain[row]);
        let before: f64 = (0..last).map(whole).sum();
        let rest = strain - R::from(self.strain[last]);
        R::from(before) + (R::from(self.stress[last]) + R::from(0.5 * self.slope_behind(last)) * rest) * rest
    }

    fn rows(&self) -> (Vec<f64>, bool) {
        (self.strain[..self.rows].to_vec(), true)
    }
}

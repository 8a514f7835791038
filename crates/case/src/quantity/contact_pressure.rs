//! `contact_pressure`: pressure between surfaces.

use super::building::Building;
use super::reading::Reading;
use super::reading::is_unused;
use super::{Dimension, Kind};
use crate::construct::BuildError;
use schemars::JsonSchema;
use serde::Serialize;
use slipstick_design::quantity::{self, PressureMeasure, Quantity};
use std::sync::Arc;

/// Pressure between the surfaces of a pair. \[F/L²\]
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(inline)]
pub struct ContactPressure {
    /// Slave surface of the pair.
    pub slave: String,
    /// The number that the nodal pressures become.
    pub measure: PressureWord,
    /// Exponent p of the peak, factor k of the minimum: the larger, the closer to the extreme
    /// value. 0 for the other measures.
    #[serde(skip_serializing_if = "is_unused")]
    pub sharpness: f64,
    /// Surface or node set; only slave nodes in it count. `None`: all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub within: Option<String>,
}

impl Kind for ContactPressure {
    fn dimension(&self) -> Dimension {
        match self.measure {
            PressureWord::Spread => Dimension::NONE,
            PressureWord::Peak | PressureWord::Mean | PressureWord::Minimum => Dimension::STRESS,
        }
    }

    fn read(table: &Reading<'_, '_>) -> Self {
        let words = [
            ("peak", PressureWord::Peak),
            ("mean", PressureWord::Mean),
            ("spread", PressureWord::Spread),
            ("minimum", PressureWord::Minimum),
        ];
        let measure = table.word("measure", &words);
        let measure = measure.required(PressureWord::Peak, "\"peak\", \"mean\", \"spread\" or \"minimum\"");
        let smooth = matches!(measure, PressureWord::Peak | PressureWord::Minimum);
        let slave = table.slave();
        let sharpness = table.sharpness_of(smooth, "\"peak\" or \"minimum\"", 12.0);
        Self { slave, measure, sharpness, within: table.optional_set("within") }
    }

    fn build(&self, name: &str, at: &Building<'_>) -> Result<Arc<dyn Quantity>, BuildError> {
        let sharpness = self.sharpness;
        let measure = match self.measure {
            PressureWord::Peak => PressureMeasure::Peak { p: sharpness },
            PressureWord::Mean => PressureMeasure::Mean,
            PressureWord::Spread => PressureMeasure::Spread,
            PressureWord::Minimum => PressureMeasure::Minimum { k: sharpness, modulus: at.softer_modulus(&self.slave) },
        };
        let patch = at.patch(&self.slave, self.within.as_deref())?;
        let pressure = quantity::ContactPressure::new(name, patch, measure);
        Ok(Arc::new(pressure.map_err(|error| at.error(error))?))
    }

    fn sets(&self) -> Vec<&String> {
        self.within.iter().collect()
    }
}

/// How nodal pressures are reduced to one number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PressureWord {
    /// p-norm of the nodal pressures, not below the largest.
    Peak,
    /// Mean over the area that faces the master.
    Mean,
    /// Standard deviation over that area, divided by the mean.
    Spread,
    /// Smooth minimum of the nodal pressures, between the smallest and the mean; open nodes count as
    /// negative.
    Minimum,
}

//! `gap`: gaps between surfaces.

use super::building::Building;
use super::reading::Reading;
use super::reading::is_unused;
use super::{Dimension, Kind};
use crate::construct::BuildError;
use schemars::JsonSchema;
use serde::Serialize;
use slipstick_design::quantity::{self, GapMeasure, Quantity};
use std::sync::Arc;

/// Gap between the surfaces of a pair, positive where open. \[L\]
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(inline)]
pub struct Gap {
    /// Slave surface of the pair.
    pub slave: String,
    /// The number that the nodal gaps become.
    pub measure: GapWord,
    /// Factor k of the minimum: the larger, the closer to the smallest gap. 0 for the mean.
    #[serde(skip_serializing_if = "is_unused")]
    pub sharpness: f64,
    /// Surface or node set; only slave nodes in it count. `None`: all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub within: Option<String>,
}

impl Kind for Gap {
    fn dimension(&self) -> Dimension {
        Dimension::LENGTH
    }

    fn read(table: &Reading<'_, '_>) -> Self {
        let measure = table.word("measure", &[("mean", GapWord::Mean), ("minimum", GapWord::Minimum)]);
        let measure = measure.required(GapWord::Minimum, "\"mean\" or \"minimum\"");
        let slave = table.slave();
        let sharpness = table.sharpness_of(measure == GapWord::Minimum, "\"minimum\"", 50.0);
        Self { slave, measure, sharpness, within: table.optional_set("within") }
    }

    fn build(&self, name: &str, at: &Building<'_>) -> Result<Arc<dyn Quantity>, BuildError> {
        let measure = match self.measure {
            GapWord::Mean => GapMeasure::Mean,
            GapWord::Minimum => GapMeasure::Minimum { k: self.sharpness },
        };
        let gap = quantity::Gap::new(name, at.patch(&self.slave, self.within.as_deref())?, measure);
        Ok(Arc::new(gap.map_err(|error| at.error(error))?))
    }

    fn sets(&self) -> Vec<&String> {
        self.within.iter().collect()
    }
}

/// How nodal gaps are reduced to one number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum GapWord {
    /// Mean over the area that faces the master.
    Mean,
    /// Smooth minimum of the nodal gaps, not above the smallest.
    Minimum,
}

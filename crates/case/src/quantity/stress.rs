//! `stress`: the largest stress.

use super::building::Building;
use super::reading::Reading;
use super::{Dimension, Kind};
use crate::construct::BuildError;
use crate::file::BoxRegion;
use schemars::JsonSchema;
use serde::Serialize;
use slipstick_design::quantity::{self, Quantity};
use std::sync::Arc;

/// Largest von Mises stress of the material: the p-norm over the Gauss points, relaxed for
/// intermediate densities. \[F/L²\]
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(inline)]
pub struct Stress {
    /// The body; `None`: all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body: Option<String>,
    /// Only elements whose centroid lies in one of these boxes count; empty: all.
    pub within: Vec<BoxRegion>,
    /// Exponent p of the norm: the larger, the closer to the largest stress.
    pub sharpness: f64,
}

impl Kind for Stress {
    fn dimension(&self) -> Dimension {
        Dimension::STRESS
    }

    fn read(table: &Reading<'_, '_>) -> Self {
        Self { body: table.body(), within: table.boxes("within"), sharpness: table.sharpness(12.0) }
    }

    fn build(&self, name: &str, at: &Building<'_>) -> Result<Arc<dyn Quantity>, BuildError> {
        let elements = at.elements_within(self.body.as_deref(), &self.within)?;
        Ok(Arc::new(quantity::Stress::new(name, elements, self.sharpness).map_err(|error| at.error(error))?))
    }
}

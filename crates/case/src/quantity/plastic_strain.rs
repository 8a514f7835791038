//! `plastic_strain`: the largest plastic strain.

use super::building::Building;
use super::reading::Reading;
use super::{Dimension, Kind};
use crate::construct::BuildError;
use crate::file::BoxRegion;
use schemars::JsonSchema;
use serde::Serialize;
use slipstick_design::quantity::{self, Quantity};
use std::sync::Arc;

/// Largest equivalent plastic strain: the p-norm over the Gauss points, relaxed for intermediate densities.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(inline)]
pub struct PlasticStrain {
    /// The body; `None`: all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body: Option<String>,
    /// Only elements whose centroid lies in one of these boxes count; empty: all.
    pub within: Vec<BoxRegion>,
    /// Exponent p of the norm: the larger, the closer to the largest strain.
    pub sharpness: f64,
}

impl Kind for PlasticStrain {
    fn dimension(&self) -> Dimension {
        Dimension::NONE
    }

    fn read(table: &Reading<'_, '_>) -> Self {
        Self { body: table.body(), within: table.boxes("within"), sharpness: table.sharpness(12.0) }
    }

    fn build(&self, name: &str, at: &Building<'_>) -> Result<Arc<dyn Quantity>, BuildError> {
        let elements = at.elements_within(self.body.as_deref(), &self.within)?;
        let has_memory = |e: &u32| at.model.solid().material(*e as usize).kind().has_memory();
        if !elements.iter().any(has_memory) {
            let message = "no element here has a law with plastic strain, so it is always 0".into();
            let help = "give the body a material whose name begins with `j2_`, or omit the quantity";
            return Err(at.constant(message, help));
        }
        Ok(Arc::new(quantity::PlasticStrain::new(name, elements, self.sharpness).map_err(|error| at.error(error))?))
    }
}

//! `volume`: the volume of the material.

use super::building::Building;
use super::reading::Reading;
use super::{Dimension, Kind};
use crate::construct::BuildError;
use schemars::JsonSchema;
use serde::Serialize;
use slipstick_design::quantity::Quantity;
use std::sync::Arc;

/// Volume of the material in the reference configuration, Σ φ_e V_e. \[L³\]
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(inline)]
pub struct Volume {
    /// The body; `None`: all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body: Option<String>,
}

impl Kind for Volume {
    fn dimension(&self) -> Dimension {
        Dimension::VOLUME
    }

    fn read(table: &Reading<'_, '_>) -> Self {
        Self { body: table.body() }
    }

    fn build(&self, name: &str, at: &Building<'_>) -> Result<Arc<dyn Quantity>, BuildError> {
        Ok(Arc::new(at.volume(name, self.body.as_deref())?))
    }

    fn depends_on_state(&self) -> bool {
        false
    }
}

//! `strain_energy`: elastic energy.

use super::building::Building;
use super::reading::Reading;
use super::{Dimension, Kind};
use crate::construct::BuildError;
use schemars::JsonSchema;
use serde::Serialize;
use slipstick_design::quantity::{self, Quantity};
use std::sync::Arc;

/// Elastic energy. \[F L\]
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(inline)]
pub struct StrainEnergy {
    /// The body; `None`: all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body: Option<String>,
}

impl Kind for StrainEnergy {
    fn dimension(&self) -> Dimension {
        Dimension::WORK
    }

    fn read(table: &Reading<'_, '_>) -> Self {
        Self { body: table.body() }
    }

    fn build(&self, name: &str, at: &Building<'_>) -> Result<Arc<dyn Quantity>, BuildError> {
        Ok(Arc::new(quantity::StrainEnergy::new(name, at.elements(self.body.as_deref()))))
    }
}

//! `compliance`: work of the loads.

use super::building::Building;
use super::reading::Reading;
use super::{Dimension, Kind};
use crate::construct::BuildError;
use schemars::JsonSchema;
use serde::Serialize;
use slipstick_design::quantity::{self, Quantity};
use std::sync::Arc;

/// Work of the loads on the displacements, f_ext · d. \[F L\]
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(inline)]
pub struct Compliance {}

impl Kind for Compliance {
    fn dimension(&self) -> Dimension {
        Dimension::WORK
    }

    fn read(table: &Reading<'_, '_>) -> Self {
        let _ = table;
        Self {}
    }

    fn build(&self, name: &str, at: &Building<'_>) -> Result<Arc<dyn Quantity>, BuildError> {
        if at.loaded.is_empty() {
            let message = "the case has no load, so its compliance is always 0".into();
            return Err(at.constant(message, "add a [[load]]"));
        }
        Ok(Arc::new(quantity::Compliance::named(name)))
    }
}

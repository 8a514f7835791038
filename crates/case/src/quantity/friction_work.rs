//! `friction_work`: energy lost to friction.

use super::building::Building;
use super::reading::Reading;
use super::{Dimension, Kind};
use crate::construct::BuildError;
use schemars::JsonSchema;
use serde::Serialize;
use slipstick_design::quantity::{self, Quantity};
use std::sync::Arc;

/// Work that friction has dissipated between the surfaces of a pair. \[F L\]
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(inline)]
pub struct FrictionWork {
    /// Slave surface of the pair.
    pub slave: String,
    /// Surface or node set; only slave nodes in it count. `None`: all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub within: Option<String>,
}

impl Kind for FrictionWork {
    fn dimension(&self) -> Dimension {
        Dimension::WORK
    }

    fn read(table: &Reading<'_, '_>) -> Self {
        Self { slave: table.slave(), within: table.optional_set("within") }
    }

    fn build(&self, name: &str, at: &Building<'_>) -> Result<Arc<dyn Quantity>, BuildError> {
        Ok(Arc::new(quantity::FrictionWork::new(name, at.patch(&self.slave, self.within.as_deref())?)))
    }

    fn sets(&self) -> Vec<&String> {
        self.within.iter().collect()
    }
}

//! `contact_share`: the part of a surface that is in contact.

use super::building::Building;
use super::reading::Reading;
use super::{Dimension, Kind};
use crate::construct::BuildError;
use schemars::JsonSchema;
use serde::Serialize;
use slipstick_design::quantity::{self, Quantity};
use std::sync::Arc;

/// Share of the slave surface of a pair that carries the contact force, from 0 to 1.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(inline)]
pub struct ContactShare {
    /// Slave surface of the pair.
    pub slave: String,
    /// Surface or node set; only slave nodes in it count. `None`: all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub within: Option<String>,
}

impl Kind for ContactShare {
    fn dimension(&self) -> Dimension {
        Dimension::NONE
    }

    fn read(table: &Reading<'_, '_>) -> Self {
        Self { slave: table.slave(), within: table.optional_set("within") }
    }

    fn build(&self, name: &str, at: &Building<'_>) -> Result<Arc<dyn Quantity>, BuildError> {
        Ok(Arc::new(quantity::ContactShare::new(name, at.patch(&self.slave, self.within.as_deref())?)))
    }

    fn sets(&self) -> Vec<&String> {
        self.within.iter().collect()
    }
}

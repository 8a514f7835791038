//! `bolt_force`: forces of bolts.

use super::building::Building;
use super::reading::Reading;
use super::{Dimension, Kind};
use crate::construct::BuildError;
use crate::file::CaseCode;
use crate::file::reader::suggestion_or_list;
use schemars::JsonSchema;
use serde::Serialize;
use slipstick_design::VectorMeasure;
use slipstick_design::quantity::{self, Quantity};
use std::sync::Arc;

/// Force of a bolt, positive in tension. \[F\]
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(inline)]
pub struct BoltForce {
    /// Name of a `[[bolt]]`.
    pub bolt: String,
}

impl Kind for BoltForce {
    fn dimension(&self) -> Dimension {
        Dimension::FORCE
    }

    fn read(table: &Reading<'_, '_>) -> Self {
        let bolt = table.string("bolt").required(String::new(), "the name of a [[bolt]]");
        let bolts = &table.known.bolts;
        if !bolt.is_empty() && bolts.iter().all(|name| !name.is_empty()) && !bolts.contains(&bolt.as_str()) {
            let help = match bolts.is_empty() {
                true => "add a [[bolt]] with this name".into(),
                false => suggestion_or_list(&bolt, bolts),
            };
            let message = format!("there is no bolt called `{bolt}`");
            table.reader.error(&table.path_of("bolt"), CaseCode::UnknownSet, message, help);
        }
        Self { bolt }
    }

    fn build(&self, name: &str, at: &Building<'_>) -> Result<Arc<dyn Quantity>, BuildError> {
        let bolts = at.model.bolts().list().iter();
        let unknowns = bolts.filter(|bolt| bolt.name == self.bolt).map(|bolt| bolt.unknown).collect();
        let along = VectorMeasure::Along([1.0, 0.0, 0.0]);
        Ok(Arc::new(quantity::Reaction::new(name, unknowns, along).map_err(|error| at.error(error))?))
    }
}

//! `reaction`: forces of supports and motions.

use super::building::Building;
use super::building::counts;
use super::component::VectorComponent;
use super::reading::Reading;
use super::{Dimension, Kind};
use crate::construct::BuildError;
use schemars::JsonSchema;
use serde::Serialize;
use slipstick_design::quantity::{self, Quantity};
use std::sync::Arc;

/// Force that supports and prescribed motions exert on a set. \[F\]
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(inline)]
pub struct Reaction {
    /// Surface or node set.
    pub set: String,
    /// Component or norm.
    pub component: VectorComponent,
}

impl Kind for Reaction {
    fn dimension(&self) -> Dimension {
        Dimension::FORCE
    }

    fn read(table: &Reading<'_, '_>) -> Self {
        Self { set: table.set(), component: table.vector_component() }
    }

    fn build(&self, name: &str, at: &Building<'_>) -> Result<Arc<dyn Quantity>, BuildError> {
        let Self { set, component } = self;
        let measure = component.measure().map_err(|error| at.error(error))?;
        let counts = |unknown: &u32| counts(measure, *unknown as usize % 3);
        let unknowns: Vec<u32> = at.prescribed(set).into_iter().filter(counts).collect();
        if unknowns.is_empty() {
            let message = format!("no such component is prescribed at `{set}`, so its reaction is always 0");
            let help = "name the set of a [[dirichlet]], and a component that it prescribes";
            return Err(at.constant(message, help));
        }
        Ok(Arc::new(quantity::Reaction::new(name, unknowns, measure).map_err(|error| at.error(error))?))
    }

    fn sets(&self) -> Vec<&String> {
        vec![&self.set]
    }
}

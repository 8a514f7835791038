//! `displacement`: mean displacements.

use super::building::Building;
use super::component::VectorComponent;
use super::reading::Reading;
use super::{Dimension, Kind};
use crate::construct::BuildError;
use schemars::JsonSchema;
use serde::Serialize;
use slipstick_design::quantity::{self, Quantity};
use std::sync::Arc;

/// Mean displacement of a set: over the reference area of a surface, over the nodes of a set.
/// \[L\]
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(inline)]
pub struct Displacement {
    /// Surface or node set.
    pub set: String,
    /// Component or norm.
    pub component: VectorComponent,
    /// Surface or node set whose mean displacement is subtracted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relative_to: Option<String>,
}

impl Kind for Displacement {
    fn dimension(&self) -> Dimension {
        Dimension::LENGTH
    }

    fn read(table: &Reading<'_, '_>) -> Self {
        Self { set: table.set(), component: table.vector_component(), relative_to: table.optional_set("relative_to") }
    }

    fn build(&self, name: &str, at: &Building<'_>) -> Result<Arc<dyn Quantity>, BuildError> {
        let Self { set, component, relative_to } = self;
        let component = component.measure().map_err(|error| at.error(error))?;
        if relative_to.as_ref() == Some(set) {
            let message = format!("`{set}` does not move relative to itself");
            return Err(at.constant(message, "name another set in `relative_to`"));
        }
        if self.sets().into_iter().all(|set| at.is_driven(set, component)) {
            let message = format!("the displacement of `{set}` is prescribed, so it does not depend on the design");
            return Err(at.constant(message, "name a set that can move"));
        }
        let count = at.mesh.nodes.len();
        let mean = quantity::Displacement::new(name, at.weighted(set), count, component);
        let mean = mean.map_err(|error| at.error(error))?;
        Ok(Arc::new(match relative_to {
            Some(other) => mean.relative_to(at.weighted(other), count).map_err(|error| at.error(error))?,
            None => mean,
        }))
    }

    fn sets(&self) -> Vec<&String> {
        [&self.set].into_iter().chain(&self.relative_to).collect()
    }
}

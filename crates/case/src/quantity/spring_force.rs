//! `spring_force`: forces of springs.

use super::building::Building;
use super::component::VectorComponent;
use super::reading::Reading;
use super::{Dimension, Kind};
use crate::construct::BuildError;
use crate::file::CaseCode;
use crate::file::reader::suggestion_or_list;
use schemars::JsonSchema;
use serde::Serialize;
use slipstick_design::quantity::Quantity;
use slipstick_model::quantities;
use std::sync::Arc;

/// Resultant force that springs exert on the nodes of their `set`. \[F\]
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(inline)]
pub struct SpringForce {
    /// Name of a `[[spring]]`.
    pub spring: String,
    /// Component or norm.
    pub component: VectorComponent,
}

impl Kind for SpringForce {
    fn dimension(&self) -> Dimension {
        Dimension::FORCE
    }

    fn read(table: &Reading<'_, '_>) -> Self {
        let spring = table.string("spring").required(String::new(), "the name of a [[spring]]");
        let springs = &table.known.springs;
        let readable = springs.iter().all(|name| !name.is_empty());
        if !spring.is_empty() && readable && !springs.contains(&spring.as_str()) {
            let help = match springs.is_empty() {
                true => "add a [[spring]] with this name".into(),
                false => suggestion_or_list(&spring, springs),
            };
            let message = format!("there is no spring called `{spring}`");
            table.reader.error(&table.path_of("spring"), CaseCode::UnknownSet, message, help);
        }
        Self { spring, component: table.vector_component() }
    }

    fn build(&self, name: &str, at: &Building<'_>) -> Result<Arc<dyn Quantity>, BuildError> {
        let measure = self.component.measure().map_err(|error| at.error(error))?;
        let springs = at.model.springs().of(&self.spring).to_vec();
        Ok(Arc::new(quantities::SpringForce::new(name, springs, measure)))
    }
}

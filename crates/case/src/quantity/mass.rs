//! `mass`: the mass of the material.

use super::building::Building;
use super::reading::Reading;
use super::{Dimension, Kind};
use crate::construct::BuildError;
use crate::file::CaseCode;
use schemars::JsonSchema;
use serde::Serialize;
use slipstick_design::quantity::Quantity;
use std::sync::Arc;

/// Mass of the material, ρ Σ φ_e V_e. \[M\]
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(inline)]
pub struct Mass {
    /// The body; `None`: all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body: Option<String>,
    /// ρ of the solid material. \[M/L³\]
    pub mass_density: f64,
}

impl Kind for Mass {
    fn dimension(&self) -> Dimension {
        Dimension::MASS
    }

    fn read(table: &Reading<'_, '_>) -> Self {
        let positive = |&rho: &f64| rho > 0.0;
        let mass_density = table.number("mass_density");
        let mass_density =
            mass_density.check(CaseCode::OutOfRange, positive, "must be positive", "such as 1.01e-6 [kg/mm³]");
        let body = table.body();
        Self { body, mass_density: mass_density.required(1.0, "mass per volume of the solid material") }
    }

    fn build(&self, name: &str, at: &Building<'_>) -> Result<Arc<dyn Quantity>, BuildError> {
        Ok(Arc::new(at.volume(name, self.body.as_deref())?.mass(self.mass_density)))
    }

    fn depends_on_state(&self) -> bool {
        false
    }
}

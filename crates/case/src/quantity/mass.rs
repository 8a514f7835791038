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
    /// ρ of the solid material; `None`: those of the bodies. \[M/L³\]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mass_density: Option<f64>,
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
        Self { body, mass_density: mass_density.optional() }
    }

    fn build(&self, name: &str, at: &Building<'_>) -> Result<Arc<dyn Quantity>, BuildError> {
        let body = self.body.as_deref();
        Ok(Arc::new(match self.mass_density {
            Some(density) => at.volume(name, body)?.mass(density),
            None => at.mass(name, body)?,
        }))
    }

    fn depends_on_state(&self) -> bool {
        false
    }
}

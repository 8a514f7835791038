//! `moment`: moments of supports and motions.

use super::building::Building;
use super::reading::Reading;
use super::{Dimension, Kind};
use crate::construct::BuildError;
use schemars::JsonSchema;
use serde::Serialize;
use slipstick_design::quantity::{self, Quantity};
use std::sync::Arc;

/// Moment of these forces about an axis, at the current positions. \[F L\]
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(inline)]
pub struct Moment {
    /// Surface or node set.
    pub set: String,
    /// A point on the axis. \[L\]
    pub point: [f64; 3],
    /// Direction of the axis; its length does not matter.
    pub direction: [f64; 3],
}

impl Kind for Moment {
    fn dimension(&self) -> Dimension {
        Dimension::WORK
    }

    fn read(table: &Reading<'_, '_>) -> Self {
        Self {
            set: table.set(),
            point: table.vector("point").required([0.0; 3], "a point on the axis"),
            direction: table.direction("direction"),
        }
    }

    fn build(&self, name: &str, at: &Building<'_>) -> Result<Arc<dyn Quantity>, BuildError> {
        let Self { set, point, direction } = self;
        let unknowns = at.prescribed(set);
        if unknowns.is_empty() {
            let message = format!("nothing is prescribed at `{set}`, so its moment is always 0");
            return Err(at.constant(message, "name the set of a [[dirichlet]]"));
        }
        let moment = quantity::Moment::new(name, &unknowns, &at.mesh.nodes, *point, *direction);
        Ok(Arc::new(moment.map_err(|error| at.error(error))?))
    }

    fn sets(&self) -> Vec<&String> {
        vec![&self.set]
    }
}

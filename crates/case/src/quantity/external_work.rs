//! `external_work`: work of loads and motions.

use super::building::Building;
use super::reading::Reading;
use super::{Dimension, Kind};
use crate::construct::BuildError;
use schemars::JsonSchema;
use serde::Serialize;
use slipstick_design::quantity::{self, Quantity};
use slipstick_model::quantities::external_work;
use std::sync::Arc;

/// Work that loads, supports and prescribed motions do on the bodies. \[F L\]
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(inline)]
pub struct ExternalWork {
    /// Surface or node set; only the work at its nodes counts. `None`: all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub set: Option<String>,
}

impl Kind for ExternalWork {
    fn dimension(&self) -> Dimension {
        Dimension::WORK
    }

    fn read(table: &Reading<'_, '_>) -> Self {
        Self { set: table.optional_set("set") }
    }

    fn build(&self, name: &str, at: &Building<'_>) -> Result<Arc<dyn Quantity>, BuildError> {
        let Some(set) = &self.set else { return Ok(Arc::new(external_work(name, at.mesh))) };
        let nodes = at.mesh.set_nodes(set).unwrap_or_default();
        let prescribed = at.prescribed(set);
        let loaded = at.loaded();
        if prescribed.is_empty() && !nodes.iter().any(|node| loaded.contains(node)) {
            let message = format!("no load and no prescribed motion acts on `{set}`, so their work is always 0");
            return Err(at.constant(message, "name the set of a [[dirichlet]] or [[load]], or omit `set`"));
        }
        let unknowns = |node: u32| (0..3).map(move |c| 3 * node + c);
        let work = quantity::ExternalWork::new(name);
        let bodies = |body: usize| &at.mesh.bodies[body];
        if let Some(rigid) = at.mesh.rigid.iter().find(|rigid| bodies(rigid.body).name == *set) {
            // loads and motions at the reference point act through the nodes
            let nodes = bodies(rigid.body).nodes.clone();
            return Ok(Arc::new(work.on(nodes.flat_map(|node| unknowns(node as u32)).collect())));
        }
        // a node of a rigid body counts as prescribed, but only loads act on it from outside
        let of_rigid =
            |node: u32| at.mesh.rigid.iter().any(|rigid| bodies(rigid.body).nodes.contains(&(node as usize)));
        let supported = at.model.prescribed().ever_supported();
        let driven = prescribed.into_iter().filter(|unknown| !of_rigid(unknown / 3));
        let free = nodes.iter().filter(|&&node| !of_rigid(node)).flat_map(|&node| unknowns(node));
        let free = free.filter(|&unknown| !supported[unknown as usize]);
        let loaded = nodes.iter().filter(|&&node| of_rigid(node)).flat_map(|&node| unknowns(node));
        Ok(Arc::new(work.on(driven.chain(free).collect()).of_loads_on(loaded.collect())))
    }

    fn sets(&self) -> Vec<&String> {
        self.set.iter().collect()
    }
}

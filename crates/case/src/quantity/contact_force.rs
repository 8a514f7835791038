//! `contact_force`: contact forces.

use super::building::Building;
use super::component::{ForceComponent, ForceWord};
use super::reading::Reading;
use super::{Dimension, Kind};
use crate::construct::BuildError;
use schemars::JsonSchema;
use serde::Serialize;
use slipstick_design::quantity::{self, ContactResultant, ForcePart, Quantity, VectorMeasure};
use std::collections::BTreeSet;
use std::sync::Arc;

/// Contact force on the slave of a pair. \[F\]
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(inline)]
pub struct ContactForce {
    /// Slave surface of the pair.
    pub slave: String,
    /// Component or norm of the resultant, or a sum over the nodes.
    pub component: ForceComponent,
    /// Surface or node set; only slave nodes in it count. `None`: all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub within: Option<String>,
}

impl Kind for ContactForce {
    fn dimension(&self) -> Dimension {
        Dimension::FORCE
    }

    fn read(table: &Reading<'_, '_>) -> Self {
        let (slave, component) = (table.slave(), table.force_component());
        let named = table.value("slave").and_then(|named| named.get_ref().as_str());
        // the force on the surface that the case names, which is the master if the sides are swapped
        let component = if named == Some(slave.as_str()) { component } else { component.reversed() };
        Self { slave, component, within: table.optional_set("within") }
    }

    fn build(&self, name: &str, at: &Building<'_>) -> Result<Arc<dyn Quantity>, BuildError> {
        let Self { slave, component, within } = self;
        let patch = at.patch(slave, within.as_deref())?;
        let along = |direction| VectorMeasure::along(direction).map(ForcePart::Resultant);
        let part = match component {
            ForceComponent::Direction(direction) => along(*direction).map_err(|error| at.error(error))?,
            ForceComponent::Word(ForceWord::X) => along([1.0, 0.0, 0.0]).map_err(|error| at.error(error))?,
            ForceComponent::Word(ForceWord::Y) => along([0.0, 1.0, 0.0]).map_err(|error| at.error(error))?,
            ForceComponent::Word(ForceWord::Z) => along([0.0, 0.0, 1.0]).map_err(|error| at.error(error))?,
            ForceComponent::Word(ForceWord::Norm) => ForcePart::Resultant(VectorMeasure::Norm),
            ForceComponent::Word(ForceWord::Normal) => ForcePart::Normal,
            ForceComponent::Word(ForceWord::Tangential) => ForcePart::Tangential,
            ForceComponent::Word(ForceWord::Nodal) if at.is_prescribed(slave, VectorMeasure::Norm) => {
                let message =
                    format!("all components of all nodes of `{slave}` are prescribed, and their forces do not count");
                return Err(at.constant(message, "exchange slave and master, or prescribe fewer components"));
            }
            ForceComponent::Word(ForceWord::Nodal) => {
                let mut nodes = at.mesh.set_nodes(slave).map(|nodes| nodes.to_vec()).unwrap_or_default();
                if let Some(within) = within.as_ref().and_then(|set| at.mesh.set_nodes(set)) {
                    let within: BTreeSet<u32> = within.iter().copied().collect();
                    nodes.retain(|node| within.contains(node));
                }
                let force = quantity::ContactForce::new(nodes, at.mesh.nodes.len(), 0.0);
                let force = force.map_err(|error| at.error(error))?;
                return Ok(Arc::new(force.named(name).without_reactions(&at.model.prescribed().ever_supported())));
            }
        };
        if matches!(part, ForcePart::Resultant(_)) && at.is_with_itself(slave) {
            let message = format!("`{slave}` touches itself, so the resultant of its contact forces is always 0");
            return Err(at.constant(message, "choose the component \"normal\", \"tangential\" or \"nodal\""));
        }
        Ok(Arc::new(ContactResultant::new(name, patch, part)))
    }

    fn sets(&self) -> Vec<&String> {
        self.within.iter().collect()
    }
}

//! The quantities of case files: for each, the keys of its table, its dimension, its reader and the
//! quantity of the library in one file, and a line in the [list](QuantityKind).
//!
//! The list makes the keys that a `[[quantity]]` may have, and their schema, reader and construction.

mod bolt_force;
mod building;
mod compliance;
mod component;
mod contact_force;
mod contact_pressure;
mod contact_share;
mod displacement;
mod external_work;
mod friction_work;
mod gap;
mod mass;
mod moment;
mod plastic_strain;
mod reaction;
mod reading;
mod spring_force;
mod strain_energy;
mod stress;
mod volume;

pub(crate) use building::{Building, all_fixed};
pub use component::{ForceComponent, ForceWord, VectorComponent, VectorWord};
pub use contact_pressure::PressureWord;
pub use gap::GapWord;
pub(crate) use reading::{Known, Reading, Slaves, slave};
pub use slipstick_design::quantity::Dimension;

use crate::construct::BuildError;
use schemars::JsonSchema;
use serde::Serialize;
use slipstick_design::quantity::Quantity;
use std::sync::Arc;

/// A kind of quantity.
trait Kind: Sized {
    /// The dimension of its values.
    fn dimension(&self) -> Dimension;

    /// Reads the keys of its table.
    fn read(table: &Reading<'_, '_>) -> Self;

    /// The quantity of the library.
    ///
    /// # Errors
    /// If a value is wrong, or the quantity would not vary.
    fn build(&self, name: &str, at: &Building<'_>) -> Result<Arc<dyn Quantity>, BuildError>;

    /// The surfaces and node sets that it names, besides slave surfaces.
    fn sets(&self) -> Vec<&String> {
        Vec::new()
    }

    /// Whether it depends on the state, and not only on the densities.
    fn depends_on_state(&self) -> bool {
        true
    }
}

/// The list: key, which is also the name of the file, and type.
macro_rules! quantities {
    ($($key:ident $kind:ident)*) => {
        $(pub use $key::$kind;)*

        /// What a quantity measures.
        #[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
        #[serde(rename_all = "snake_case")]
        pub enum QuantityKind {
            $(#[allow(missing_docs)] $kind($kind),)*
        }

        impl QuantityKind {
            /// Keys of all kinds.
            pub const KEYS: &'static [&'static str] = &[$(stringify!($key)),*];

            /// The key of the kind, one of [`Self::KEYS`].
            pub fn key(&self) -> &'static str {
                match self {
                    $(Self::$kind(_) => stringify!($key),)*
                }
            }

            /// The dimension of its values.
            pub fn dimension(&self) -> Dimension {
                match self {
                    $(Self::$kind(kind) => kind.dimension(),)*
                }
            }

            /// Whether it depends on the state, and not only on the densities.
            pub fn depends_on_state(&self) -> bool {
                match self {
                    $(Self::$kind(kind) => kind.depends_on_state(),)*
                }
            }

            /// The surfaces and node sets that it names, besides slave surfaces.
            pub fn sets(&self) -> Vec<&String> {
                match self {
                    $(Self::$kind(kind) => kind.sets(),)*
                }
            }

            /// Reads the table of the kind with this key.
            pub(crate) fn read(key: &str, table: &Reading<'_, '_>) -> Option<Self> {
                match key {
                    $(stringify!($key) => Some(Self::$kind($kind::read(table))),)*
                    _ => None,
                }
            }

            /// The quantity of the library.
            pub(crate) fn build(&self, name: &str, at: &Building<'_>) -> Result<Arc<dyn Quantity>, BuildError> {
                match self {
                    $(Self::$kind(kind) => kind.build(name, at),)*
                }
            }
        }
    };
}

quantities! {
    reaction Reaction
    moment Moment
    contact_force ContactForce
    contact_pressure ContactPressure
    contact_share ContactShare
    gap Gap
    friction_work FrictionWork
    external_work ExternalWork
    displacement Displacement
    strain_energy StrainEnergy
    stress Stress
    plastic_strain PlasticStrain
    spring_force SpringForce
    bolt_force BoltForce
    compliance Compliance
    volume Volume
    mass Mass
}

impl QuantityKind {
    /// Stands for a kind that could not be read.
    pub(crate) const PLACEHOLDER: Self = Self::Compliance(Compliance {});
}

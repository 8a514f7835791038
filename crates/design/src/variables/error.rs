//! Why a choice of design variables or an initial design is impossible.

use thiserror::Error;

/// Why a choice of design variables or an initial design is impossible.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum DesignError {
    /// No element is left to design.
    #[error("no element is designed: {domain} elements in the design domain, {passive} of them passive")]
    Empty {
        /// Elements of the design domain.
        domain: usize,
        /// Number of them that are passive.
        passive: usize,
    },
    /// An element that the mesh does not have.
    #[error("element {element} does not exist; the mesh has {element_count} elements, numbered from 0")]
    ElementOutOfRange {
        /// The element, from 0.
        element: u32,
        /// Number of elements of the mesh.
        element_count: usize,
    },
    /// An element is both solid and void.
    #[error("element {element} is both passive solid and passive void; the passive regions must not overlap")]
    Contradiction {
        /// The element, from 0.
        element: u32,
    },
    /// A passive element outside the design domain.
    #[error("element {element} is passive but not in the design domain; shrink the passive region or add its body")]
    PassiveOutside {
        /// The element, from 0.
        element: u32,
    },
    /// An initial density outside [0, 1].
    #[error("initial density {value} is outside [0, 1]")]
    Initial {
        /// The requested value.
        value: f64,
    },
    /// The passive elements leave no design with this volume fraction.
    #[error(
        "volume fraction {fraction} cannot be met: with its passive elements the design domain has at least \
         {smallest} and at most {largest}"
    )]
    Fraction {
        /// The requested fraction.
        fraction: f64,
        /// Fraction with all designed elements void.
        smallest: f64,
        /// Fraction with all designed elements solid.
        largest: f64,
    },
    /// The number of volumes does not match the mesh.
    #[error("{found} element volumes for {expected} elements")]
    VolumeCount {
        /// Number of elements.
        expected: usize,
        /// Number of volumes given.
        found: usize,
    },
    /// A volume is not a positive finite number.
    #[error("element {element} has volume {volume}; volumes of the design domain are finite and positive")]
    Volume {
        /// The element, from 0.
        element: usize,
        /// Its volume. \[L³\]
        volume: f64,
    },
}

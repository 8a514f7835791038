//! Filters: the neighbours of each element, and averages over them.

mod density;
mod extension;
mod neighbours;
mod overhang;
mod projection;
mod sensitivity;

pub use density::DensityFilter;
pub use extension::Triangle;
pub(crate) use neighbours::CellGrid;
pub use neighbours::Neighbours;
pub use overhang::{OverhangFilter, PrintedBox};
pub use projection::Projection;
pub use sensitivity::SensitivityFilter;

use thiserror::Error;

/// Why a filter cannot be built.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum FilterError {
    /// The filter radius is not a positive finite length.
    #[error("filter radius {radius} is not a positive finite length")]
    Radius {
        /// The given value. \[L\]
        radius: f64,
    },
    /// The numbers of volumes and centroids differ.
    #[error("{volumes} element volumes for {centroids} centroids")]
    Count {
        /// Number of centroids.
        centroids: usize,
        /// Number of volumes.
        volumes: usize,
    },
    /// More elements than the neighbour lists can address.
    #[error("{elements} elements are too many for a filter, which is limited to 2³²")]
    TooMany {
        /// Number of elements.
        elements: usize,
    },
    /// A centroid has a coordinate that is not finite.
    #[error("the centroid of element {element} is not finite")]
    Centroid {
        /// The element, from 0.
        element: usize,
    },
    /// A volume is not a positive finite number.
    #[error("element {element} has volume {volume}; a filter needs finite, positive volumes")]
    Volume {
        /// The element, from 0.
        element: usize,
        /// Its volume. \[L³\]
        volume: f64,
    },
    /// A parameter of the projection is out of range.
    #[error("projection {name} = {value}; it must be in {range}")]
    Projection {
        /// Name of the parameter.
        name: &'static str,
        /// The given value.
        value: f64,
        /// The allowed range.
        range: &'static str,
    },
}

fn check_volumes(centroids: usize, volumes: &[f64]) -> Result<(), FilterError> {
    if centroids != volumes.len() {
        return Err(FilterError::Count { centroids, volumes: volumes.len() });
    }
    match volumes.iter().position(|volume| !(volume.is_finite() && *volume > 0.0)) {
        Some(element) => Err(FilterError::Volume { element, volume: volumes[element] }),
        None => Ok(()),
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use crate::values::DomainValues;

    /// Centroids and volumes of a box of cubes of side `size`; the last index runs fastest.
    pub(crate) fn box_grid(cells: [usize; 3], size: f64) -> (Vec<[f64; 3]>, Vec<f64>) {
        let mut centroids = Vec::new();
        for i in 0..cells[0] {
            for j in 0..cells[1] {
                for k in 0..cells[2] {
                    centroids.push([i, j, k].map(|index| size * (index as f64 + 0.5)));
                }
            }
        }
        let volumes = vec![size.powi(3); centroids.len()];
        (centroids, volumes)
    }

    /// A row of elements of unit cross-section, each `ratio` times as long as the previous one; the
    /// first has length 0.1.
    pub(crate) fn graded_row(count: usize, ratio: f64) -> (Vec<[f64; 3]>, Vec<f64>) {
        let volumes: Vec<f64> = (0..count).map(|i| 0.1 * ratio.powi(i as i32)).collect();
        let mut start = 0.0;
        let mut centroids = Vec::new();
        for volume in &volumes {
            centroids.push([start + 0.5 * volume, 0.0, 0.0]);
            start += volume;
        }
        (centroids, volumes)
    }

    /// Numbers in [0.05, 1), the same in each run (a linear congruential generator).
    pub(crate) fn pseudo_random(count: usize, seed: u64) -> DomainValues {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            0.05 + 0.95 * (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..count).map(|_| next()).collect()
    }
}

//! Maps from design variables to densities, and their transposes for gradients.

use std::sync::Arc;

use crate::filter::FilterError;

/// A parameter of a map that a schedule or a realization of the design changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapParameter {
    /// Radius of a filter. \[L\]
    Radius,
    /// Sharpness of a projection.
    Sharpness,
    /// Threshold of a projection.
    Threshold,
}

/// A differentiable map from design variables `x` to densities `φ`, with its exact transpose.
///
/// `x` and `φ` may have different lengths, which each implementation documents. Both are
/// dimensionless.
///
/// # Panics
///
/// Implementations panic if a slice does not have the length for which the map was built: this is
/// an error in the calling program, never in its input.
pub trait DesignMap: Send + Sync {
    /// Densities `φ(x)`.
    fn apply(&self, x: &[f64]) -> Vec<f64>;

    /// Pulls a gradient back: `(∂φ/∂x)ᵀ dθ/dφ` at `x`, with the length of `x`.
    fn pull_back(&self, x: &[f64], d_phi: &[f64]) -> Vec<f64>;

    /// The value of a parameter, if the map has it.
    fn parameter(&self, which: MapParameter) -> Option<f64> {
        let _ = which;
        None
    }

    /// The map with another value of a parameter; `None` if it does not have this parameter. All ranks call
    /// it.
    ///
    /// # Errors
    ///
    /// A value outside the parameter's range.
    fn with(&self, which: MapParameter, value: f64) -> Result<Option<Arc<dyn DesignMap>>, FilterError> {
        let _ = (which, value);
        Ok(None)
    }

    /// The `x` that becomes the density `density` where all neighbours have the same `x`.
    fn inverse(&self, density: f64) -> f64 {
        density
    }
}

/// Several maps, the first applied first. An empty chain is the identity. Copies share the maps.
#[derive(Clone, Default)]
pub struct Chain {
    maps: Vec<Arc<dyn DesignMap>>,
}

impl Chain {
    /// The composition `maps[last] ∘ … ∘ maps[0]`.
    pub fn new(maps: Vec<Arc<dyn DesignMap>>) -> Self {
        Self { maps }
    }

    /// Appends a map.
    pub fn push(&mut self, map: Arc<dyn DesignMap>) {
        self.maps.push(map);
    }

    /// The same maps with another value of a parameter, as far as they have it. All ranks call it.
    ///
    /// # Errors
    ///
    /// A value outside the parameter's range.
    pub fn changed(&self, which: MapParameter, value: f64) -> Result<Self, FilterError> {
        let of = |map: &Arc<dyn DesignMap>| Ok(map.with(which, value)?.unwrap_or_else(|| map.clone()));
        self.maps.iter().map(of).collect::<Result<Vec<_>, _>>().map(Self::new)
    }

    /// The maps, the first applied first.
    pub fn maps(&self) -> &[Arc<dyn DesignMap>] {
        &self.maps
    }
}

impl DesignMap for Chain {
    fn apply(&self, x: &[f64]) -> Vec<f64> {
        self.maps.iter().fold(x.to_vec(), |value, map| map.apply(&value))
    }

    fn pull_back(&self, x: &[f64], d_phi: &[f64]) -> Vec<f64> {
        // Each map is differentiated at the point where it was applied, so the forward values are
        // computed and stored first.
        let mut inputs = Vec::with_capacity(self.maps.len());
        let mut value = x.to_vec();
        for map in &self.maps {
            let next = map.apply(&value);
            inputs.push(std::mem::replace(&mut value, next));
        }
        let maps_and_inputs = self.maps.iter().zip(&inputs).rev();
        maps_and_inputs.fold(d_phi.to_vec(), |gradient, (map, input)| map.pull_back(input, &gradient))
    }

    fn parameter(&self, which: MapParameter) -> Option<f64> {
        self.maps.iter().find_map(|map| map.parameter(which))
    }

    fn with(&self, which: MapParameter, value: f64) -> Result<Option<Arc<dyn DesignMap>>, FilterError> {
        match self.parameter(which) {
            Some(_) => Ok(Some(Arc::new(self.changed(which, value)?))),
            None => Ok(None),
        }
    }

    fn inverse(&self, density: f64) -> f64 {
        self.maps.iter().rev().fold(density, |density, map| map.inverse(density))
    }
}

/// Applies a map of the listed elements' densities to these entries of a longer vector; the others
/// are unchanged.
///
/// Restricts a filter to the design domain, so that densities do not leak into or out of bodies
/// that are not designed.
pub struct OnElements {
    elements: Arc<[u32]>,
    map: Arc<dyn DesignMap>,
}

impl OnElements {
    /// `map` takes and returns `elements.len()` densities in the order of `elements`.
    pub fn new(elements: Arc<[u32]>, map: Arc<dyn DesignMap>) -> Self {
        Self { elements, map }
    }

    fn gather(&self, all: &[f64]) -> Vec<f64> {
        self.elements.iter().map(|&element| all[element as usize]).collect()
    }

    fn scatter(&self, part: &[f64], all: &mut [f64]) {
        assert_eq!(part.len(), self.elements.len(), "the map changes the number of densities");
        for (&element, &value) in self.elements.iter().zip(part) {
            all[element as usize] = value;
        }
    }
}

impl DesignMap for OnElements {
    fn apply(&self, x: &[f64]) -> Vec<f64> {
        let mut densities = x.to_vec();
        self.scatter(&self.map.apply(&self.gather(x)), &mut densities);
        densities
    }

    fn pull_back(&self, x: &[f64], d_phi: &[f64]) -> Vec<f64> {
        let mut gradient = d_phi.to_vec();
        self.scatter(&self.map.pull_back(&self.gather(x), &self.gather(d_phi)), &mut gradient);
        gradient
    }
    fn parameter(&self, which: MapParameter) -> Option<f64> {
        self.map.parameter(which)
    }

    fn with(&self, which: MapParameter, value: f64) -> Result<Option<Arc<dyn DesignMap>>, FilterError> {
        let other = self.map.with(which, value)?;
        Ok(other.map(|map| Arc::new(Self { elements: self.elements.clone(), map }) as Arc<dyn DesignMap>))
    }

    fn inverse(&self, density: f64) -> f64 {
        self.map.inverse(density)
    }
}

//! Maps from design variables to densities, and their transposes for gradients.

use std::sync::Arc;

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
}

/// The identity: the densities are the design variables.
#[derive(Clone, Copy, Debug, Default)]
pub struct Identity;

impl DesignMap for Identity {
    fn apply(&self, x: &[f64]) -> Vec<f64> {
        x.to_vec()
    }

    fn pull_back(&self, _x: &[f64], d_phi: &[f64]) -> Vec<f64> {
        d_phi.to_vec()
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
}

/// Applies a map of the listed elements' densities to these entries of a longer vector; the others
/// are unchanged.
///
/// Restricts a filter to the design domain, so that densities do not leak into or out of bodies
/// that are not designed.
pub struct OnElements<M> {
    elements: Vec<u32>,
    map: M,
}

impl<M: DesignMap> OnElements<M> {
    /// `map` takes and returns `elements.len()` densities in the order of `elements`.
    pub fn new(elements: Vec<u32>, map: M) -> Self {
        Self { elements, map }
    }

    /// The map of the listed elements.
    pub fn map(&self) -> &M {
        &self.map
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

impl<M: DesignMap> DesignMap for OnElements<M> {
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
}

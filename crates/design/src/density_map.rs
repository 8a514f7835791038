//! The map from design variables to the densities of all elements.

use std::sync::Arc;

use crate::filter::{DensityFilter, FilterError, Projection};
use crate::map::{Chain, DesignMap, OnElements};
use crate::values::{ElementValues, VariableValues};
use crate::variables::{DesignError, DesignVariables, Passives};

/// From the design variables x to the densities φ of all elements:
///
/// `x → elements of the domain → density filter → projection → passive elements reset → φ`.
///
/// Filter and projection are optional; without both, x are the densities of the designed elements.
/// The filter sees passive elements with their fixed densities, so solid ones support their
/// neighbours; afterwards, they get these densities back. Elements outside the domain have no
/// influence on those inside, and the other way round. Copies share the filter.
///
/// Source: Wang, Lazarov, Sigmund, Struct. Multidiscip. Optim. 43 (2011) 767–784. Test:
/// `pull_back_agrees_with_central_differences`.
#[derive(Clone)]
pub struct DensityMap {
    variables: Arc<DesignVariables>,
    filter: Option<Arc<OnElements<DensityFilter>>>,
    projection: Option<Projection>,
    passives: Arc<Passives>,
    /// The links above, in order.
    chain: Chain,
}

impl DensityMap {
    /// The map of these variables; the filter is one of the elements of their domain.
    pub fn new(variables: DesignVariables, filter: Option<DensityFilter>, projection: Option<Projection>) -> Self {
        let filter = filter.map(|filter| Arc::new(OnElements::new(variables.domain().to_vec(), filter)));
        let passives = Arc::new(variables.passives());
        Self { variables: Arc::new(variables), filter, projection, passives, chain: Chain::default() }.linked()
    }

    fn linked(self) -> Self {
        let mut maps: Vec<Arc<dyn DesignMap>> = vec![self.variables.clone()];
        if let Some(filter) = &self.filter {
            maps.push(filter.clone());
        }
        if let Some(projection) = self.projection {
            maps.push(Arc::new(projection));
        }
        if !self.is_identity() {
            maps.push(self.passives.clone());
        }
        Self { chain: Chain::new(maps), ..self }
    }

    /// The variables of the map.
    pub fn variables(&self) -> &DesignVariables {
        &self.variables
    }

    /// The projection, if there is one.
    pub fn projection(&self) -> Option<Projection> {
        self.projection
    }

    /// Whether the variables are the densities of the designed elements.
    pub fn is_identity(&self) -> bool {
        self.filter.is_none() && self.projection.is_none()
    }

    /// The same map with another sharpness of the projection, if there is one; the rest is shared.
    ///
    /// # Errors
    ///
    /// As [`Projection::new`].
    pub fn with_sharpness(&self, sharpness: f64) -> Result<Self, FilterError> {
        let Some(before) = self.projection.filter(|projection| projection.sharpness() != sharpness) else {
            return Ok(self.clone());
        };
        let projection = Some(Projection::new(sharpness, before.threshold())?);
        Ok(Self { projection, ..self.clone() }.linked())
    }

    /// The same map with another threshold of the projection, if there is one; the rest is shared.
    ///
    /// # Errors
    ///
    /// As [`Projection::new`].
    pub fn with_threshold(&self, threshold: f64) -> Result<Self, FilterError> {
        let Some(before) = self.projection else { return Ok(self.clone()) };
        let projection = Some(Projection::new(before.sharpness(), threshold)?);
        Ok(Self { projection, ..self.clone() }.linked())
    }

    /// Densities of all elements.
    ///
    /// # Panics
    ///
    /// If there is not one variable per designed element.
    pub fn densities(&self, x: &VariableValues) -> ElementValues {
        self.chain.apply(x).into()
    }

    /// Pulls derivatives with respect to the densities of all elements back to the variables.
    ///
    /// # Panics
    ///
    /// If there is not one variable per designed element, or not one derivative per element.
    pub fn pull_back(&self, x: &VariableValues, gradient: &ElementValues) -> VariableValues {
        self.chain.pull_back(x, gradient).into()
    }

    /// Equal variables that give designed elements the density `density`, except within the
    /// filter's radius of passive elements and of faces in void.
    ///
    /// # Errors
    ///
    /// A density outside [0, 1].
    pub fn uniform(&self, density: f64) -> Result<VariableValues, DesignError> {
        let uniform = self.variables.uniform(density)?;
        let inverse = |projection: Projection| uniform.iter().map(|&density| projection.inverse(density)).collect();
        Ok(self.projection.map_or_else(|| uniform.clone(), inverse))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::tests::{box_grid, pseudo_random};

    /// 48 cubes: 0 to 5 outside, 6, 7 and 20 solid, 40 and 47 void.
    fn map(sharpness: Option<f64>) -> DensityMap {
        let (centroids, volumes) = box_grid([4, 4, 3], 1.0);
        let variables = DesignVariables::new(48, &(6..48).collect::<Vec<_>>(), &[6, 7, 20], &[40, 47]).unwrap();
        let domain: Vec<[f64; 3]> = variables.domain().iter().map(|&e| centroids[e as usize]).collect();
        let filter = DensityFilter::new(&domain, &volumes[..42], 1.8).unwrap();
        let projection = sharpness.map(|sharpness| Projection::new(sharpness, 0.45).unwrap());
        DensityMap::new(variables, Some(filter), projection)
    }

    /// Central differences of order 4 of Σ φ⁴.
    #[test]
    fn pull_back_agrees_with_central_differences() {
        for sharpness in [None, Some(4.0), Some(16.0)] {
            let map = map(sharpness);
            let x: VariableValues = pseudo_random(map.variables().count(), 9).iter().copied().collect();
            let value = |x: &VariableValues| map.densities(x).iter().map(|phi| phi.powi(4)).sum::<f64>();
            let densities = map.densities(&x);
            assert!(densities[..8].iter().all(|&phi| phi == 1.0));
            assert_eq!([densities[20], densities[40], densities[47]], [1.0, 0.0, 0.0]);
            let d_phi: ElementValues = densities.iter().map(|phi| 4.0 * phi.powi(3)).collect();
            let gradient = map.pull_back(&x, &d_phi);
            assert_eq!(gradient.len(), 37);
            for entry in 0..x.len() {
                let step = 1e-4;
                let at = |steps: f64| {
                    let mut moved = x.clone();
                    moved[entry] += steps * step;
                    value(&moved)
                };
                let difference = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * step);
                let error = (difference - gradient[entry]).abs();
                assert!(error < 2e-9 * gradient[entry].abs().max(1.0), "{sharpness:?} entry {entry}: {error:e}");
            }
        }
    }

    #[test]
    fn without_maps_the_variables_are_the_densities() {
        let variables = map(None).variables().clone();
        let map = DensityMap::new(variables.clone(), None, None);
        let x: VariableValues = pseudo_random(variables.count(), 3).iter().copied().collect();
        assert!(map.is_identity());
        assert_eq!(map.densities(&x), variables.densities(&x));
        let gradient: ElementValues = pseudo_random(48, 4).iter().copied().collect();
        assert_eq!(map.pull_back(&x, &gradient), variables.restrict(&gradient));
    }

    /// The thinnest plate that does not vanish with the threshold 0.75, in a filter of 8 elements: by
    /// the integrals of the cone, it is 0.8819 radii thick. The thickness is measured with the
    /// threshold 0.5, by linear interpolation along the normal.
    #[test]
    fn thickness_of_a_plate() {
        let (count, radius) = ([41, 17, 17], 8.0);
        let (centroids, volumes) = box_grid(count, 1.0);
        let filter = DensityFilter::new(&centroids, &volumes, radius).unwrap();
        // along the middle of the grid, where the filter sees only the plate
        let line: Vec<usize> = (0..41).map(|i| (i * 17 + 8) * 17 + 8).collect();
        assert!(line.iter().all(|&e| centroids[e][1] == 8.5 && centroids[e][2] == 8.5));
        // the density of the outermost layers refines the thickness of the plate
        let blurred = |thickness: f64| -> Vec<f64> {
            let inside = |c: &[f64; 3]| (0.5 * thickness - (c[0] - 20.5).abs() + 0.5).clamp(0.0, 1.0);
            let plate: Vec<f64> = centroids.iter().map(inside).collect();
            let all = filter.apply(&plate);
            line.iter().map(|&e| all[e]).collect()
        };
        let thinnest = (0..200).map(|k| 4.0 + 0.05 * f64::from(k)).find(|&t| blurred(t)[20] >= 0.75).unwrap();
        let along = blurred(thinnest);
        let outside = (20..41).find(|&i| along[i] < 0.5).unwrap();
        let half = (outside - 1) as f64 + (along[outside - 1] - 0.5) / (along[outside - 1] - along[outside]) - 20.0;
        assert!((2.0 * half / (0.8819 * radius) - 1.0).abs() < 0.02, "{}", 2.0 * half / radius);
    }

    #[test]
    fn another_sharpness_and_uniform_densities() {
        let soft = map(Some(1.0));
        let sharp = soft.with_sharpness(8.0).unwrap();
        assert_eq!(sharp.projection(), Some(Projection::new(8.0, 0.45).unwrap()));
        let x = sharp.uniform(0.3).unwrap();
        assert_eq!(sharp.densities(&x), map(Some(8.0)).densities(&x));
        // element 12 has no passive neighbours
        assert!((sharp.densities(&x)[12] - 0.3).abs() < 1e-12);
        assert!((soft.densities(&x)[12] - 0.3).abs() > 0.02);
        assert!(soft.with_sharpness(0.0).is_err() && soft.uniform(1.5).is_err());
    }
}

//! The map from design variables to the densities of all elements.

use std::sync::Arc;

use crate::filter::{DensityFilter, FilterError, OverhangFilter, PrintedBox, Projection};
use crate::map::{Chain, DesignMap, MapParameter, OnElements};
use crate::values::{ElementValues, VariableValues};
use crate::variables::{DesignError, DesignVariables, Role};

/// From the design variables x to the densities φ of all elements, through a list of maps, in the order
/// in which they were added. A case adds, as far as it names them:
///
/// `x → elements of the domain → density filter → projection → overhang filter → φ`.
///
/// Without maps, x are the densities of the designed elements. Every map but the overhang filter, which
/// knows passive elements, sees them with their fixed densities, so solid ones support their neighbours;
/// afterwards, they get these densities back. Elements outside the domain have no influence on those
/// inside, and the other way round. Tied elements have the same density up to the overhang filter: the
/// density filter alone would give elements at the end of a column other densities than those in its
/// middle, so their means follow it. Copies share the maps.
///
/// Source: Wang, Lazarov, Sigmund, Struct. Multidiscip. Optim. 43 (2011) 767–784. Test:
/// `pull_back_agrees_with_central_differences`.
#[derive(Clone)]
pub struct DensityMap {
    variables: Arc<DesignVariables>,
    /// From the densities of all elements to those of all elements.
    maps: Chain,
}

impl DensityMap {
    /// Without maps: the variables are the densities of the designed elements.
    pub fn new(variables: DesignVariables) -> Self {
        Self { variables: Arc::new(variables), maps: Chain::default() }
    }

    /// The same, then this filter of the elements of the domain.
    #[must_use]
    pub fn filtered(mut self, filter: DensityFilter) -> Self {
        let domain = self.variables.domain().into();
        self.maps.push(Arc::new(OnElements::new(domain, Arc::new(filter))));
        if self.variables.is_tied() {
            self.maps.push(Arc::new(self.variables.means()));
        }
        self.with_passives()
    }

    /// The same, then this projection.
    #[must_use]
    pub fn projected(mut self, projection: Projection) -> Self {
        self.maps.push(Arc::new(projection));
        self.with_passives()
    }

    /// The same, then an overhang filter of these boxes.
    ///
    /// # Panics
    ///
    /// As [`OverhangFilter::new`].
    #[must_use]
    pub fn printed(mut self, boxes: &[PrintedBox]) -> Self {
        let held = self.variables.roles().iter().map(|role| *role != Role::Designed).collect();
        self.maps.push(Arc::new(OverhangFilter::new(boxes, held)));
        self
    }

    /// Gives passive elements their densities back.
    fn with_passives(mut self) -> Self {
        self.maps.push(Arc::new(self.variables.passives()));
        self
    }

    /// The variables of the map.
    pub fn variables(&self) -> &DesignVariables {
        &self.variables
    }

    /// The value of a parameter, if a map has it.
    pub fn parameter(&self, which: MapParameter) -> Option<f64> {
        self.maps.parameter(which)
    }

    /// Whether the density of each designed element is its variable.
    pub fn is_identity(&self) -> bool {
        self.maps.maps().is_empty()
    }

    /// The same with another value of a parameter, if a map has it; the other maps are shared. All ranks
    /// call it.
    ///
    /// # Errors
    ///
    /// A value outside the parameter's range.
    pub fn with(&self, which: MapParameter, value: f64) -> Result<Self, FilterError> {
        if self.parameter(which).is_none_or(|before| before == value) {
            return Ok(self.clone());
        }
        let maps = self.maps.changed(which, value)?;
        Ok(Self { maps, ..self.clone() })
    }

    /// Densities of all elements.
    ///
    /// # Panics
    ///
    /// If the number of variables is not that of [`variables`](Self::variables).
    pub fn densities(&self, x: &VariableValues) -> ElementValues {
        self.maps.apply(&self.variables.densities(x)).into()
    }

    /// Pulls derivatives with respect to the densities of all elements back to the variables.
    ///
    /// # Panics
    ///
    /// If the number of variables is not that of [`variables`](Self::variables), or there is not one
    /// derivative per element.
    pub fn pull_back(&self, x: &VariableValues, gradient: &ElementValues) -> VariableValues {
        let gradient = self.maps.pull_back(&self.variables.densities(x), gradient);
        self.variables.restrict(&gradient.into())
    }

    /// Equal variables that give designed elements the density `density`, except within the
    /// filter's radius of passive elements and of faces in void; the overhang filter then changes it
    /// by its smoothing.
    ///
    /// # Errors
    ///
    /// A density outside [0, 1].
    pub fn uniform(&self, density: f64) -> Result<VariableValues, DesignError> {
        let uniform = self.variables.uniform(density)?;
        Ok(uniform.iter().map(|&density| self.maps.inverse(density)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::tests::{box_grid, pseudo_random};
    use crate::ties::Ties;

    /// 48 cubes: 0 to 5 outside, 6, 7 and 20 solid, 40 and 47 void.
    fn map(sharpness: Option<f64>) -> DensityMap {
        tied_map(sharpness, &[])
    }

    /// The same with ties between these elements.
    fn tied_map(sharpness: Option<f64>, pairs: &[(usize, usize)]) -> DensityMap {
        let (centroids, volumes) = box_grid([4, 4, 3], 1.0);
        let variables = DesignVariables::new(48, &(6..48).collect::<Vec<_>>(), &[6, 7, 20], &[40, 47]).unwrap();
        let mut ties = Ties::new(42);
        pairs.iter().for_each(|(a, b)| ties.join(a - 6, b - 6));
        let variables = variables.tied(ties);
        let domain: Vec<[f64; 3]> = variables.domain().iter().map(|&e| centroids[e as usize]).collect();
        let filter = DensityFilter::new(&domain, &volumes[..42], 1.8).unwrap();
        let map = DensityMap::new(variables).filtered(filter);
        match sharpness {
            Some(sharpness) => map.projected(Projection::new(sharpness, 0.45).unwrap()),
            None => map,
        }
    }

    /// Central differences of order 4 of Σ φ⁴.
    fn check(map: &DensityMap, step: f64) -> VariableValues {
        let x: VariableValues = pseudo_random(map.variables().count(), 9).iter().copied().collect();
        let value = |x: &VariableValues| map.densities(x).iter().map(|phi| phi.powi(4)).sum::<f64>();
        let densities = map.densities(&x);
        assert!(densities[..8].iter().all(|&phi| phi == 1.0));
        assert_eq!([densities[20], densities[40], densities[47]], [1.0, 0.0, 0.0]);
        let d_phi: ElementValues = densities.iter().map(|phi| 4.0 * phi.powi(3)).collect();
        let gradient = map.pull_back(&x, &d_phi);
        for entry in 0..x.len() {
            let at = |steps: f64| {
                let mut moved = x.clone();
                moved[entry] += steps * step;
                value(&moved)
            };
            let difference = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * step);
            let error = (difference - gradient[entry]).abs();
            assert!(error < 2e-9 * gradient[entry].abs().max(1.0), "entry {entry}: {error:e}");
        }
        gradient
    }

    #[test]
    fn pull_back_agrees_with_central_differences() {
        for sharpness in [None, Some(4.0), Some(16.0)] {
            assert_eq!(check(&map(sharpness), 1e-4).len(), 37);
        }
    }

    /// The same with ties, which hold exactly after filter and projection, and with printing.
    #[test]
    fn tied_and_printed_designs_have_exact_derivatives() {
        let pairs = [(8, 9), (9, 25), (20, 21), (21, 33), (40, 41)];
        for sharpness in [None, Some(4.0)] {
            let map = tied_map(sharpness, &pairs);
            assert_eq!(check(&map, 1e-4).len(), 34);
            let x: VariableValues = pseudo_random(34, 7).iter().copied().collect();
            let phi = map.densities(&x);
            assert!(phi[8] == phi[9] && phi[9] == phi[25] && phi[21] == phi[33] && phi[20] == 1.0);
            assert!(phi[8] != phi[10]);
        }
        // the last index of the grid runs fastest; the box is 3 × 4 × 4 in the order of the filter
        let box_of_all =
            PrintedBox { first: 0, cells: [3, 4, 4], axis: 1, downwards: false, mirrored: [[false; 2]; 3] };
        // the smooth minimum bends within 0.01
        let printed = tied_map(Some(4.0), &pairs).printed(&[box_of_all]);
        assert!(!printed.is_identity());
        assert_eq!(check(&printed, 2e-5).len(), 34);
        let unfiltered = DensityMap::new(printed.variables().clone()).printed(&[box_of_all]);
        assert!(!unfiltered.is_identity());
        check(&unfiltered, 2e-5);
    }

    #[test]
    fn another_radius_changes_the_filter_only() {
        let wide = map(Some(4.0)).with(MapParameter::Radius, 2.5).unwrap();
        let x = wide.uniform(0.4).unwrap();
        assert_ne!(wide.densities(&x), map(Some(4.0)).densities(&x));
        assert_eq!(wide.with(MapParameter::Radius, 1.8).unwrap().densities(&x), map(Some(4.0)).densities(&x));
        assert!(wide.with(MapParameter::Radius, -1.0).is_err());
        let projection = Projection::new(4.0, 0.45).unwrap();
        let unfiltered = DensityMap::new(wide.variables().clone()).projected(projection);
        assert_eq!(unfiltered.with(MapParameter::Radius, 1.0).unwrap().densities(&x), unfiltered.densities(&x));
    }

    #[test]
    fn without_maps_the_variables_are_the_densities() {
        let variables = map(None).variables().clone();
        let map = DensityMap::new(variables.clone());
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
        let sharp = soft.with(MapParameter::Sharpness, 8.0).unwrap();
        assert_eq!(sharp.parameter(MapParameter::Sharpness), Some(8.0));
        assert_eq!(sharp.parameter(MapParameter::Threshold), Some(0.45));
        let x = sharp.uniform(0.3).unwrap();
        assert_eq!(sharp.densities(&x), map(Some(8.0)).densities(&x));
        // element 12 has no passive neighbours
        assert!((sharp.densities(&x)[12] - 0.3).abs() < 1e-12);
        assert!((soft.densities(&x)[12] - 0.3).abs() > 0.02);
        assert!(soft.with(MapParameter::Sharpness, 0.0).is_err() && soft.uniform(1.5).is_err());
    }
}

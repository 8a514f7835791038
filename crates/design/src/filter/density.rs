//! The linear density filter.

use super::{FilterError, Neighbours, check_volumes};
use crate::map::DesignMap;

/// Density filter: `φ_e = Σ_i w_ei v_i x_i / Σ_i w_ei v_i`, `w_ei = max(0, r − ‖X_e − X_i‖)`.
///
/// It is a volume-weighted mean, so constants are preserved and local mesh refinement causes no
/// bias. Its [`pull_back`](DesignMap::pull_back) is the exact transpose.
///
/// Source: Bruns, Tortorelli, Comput. Methods Appl. Mech. Eng. 190 (2001) 3443–3459, with element
/// volumes as in Sigmund, Struct. Multidiscip. Optim. 33 (2007) 401–424.
#[derive(Clone, Debug)]
pub struct DensityFilter {
    neighbours: Neighbours,
    /// `Σ_i w_ei v_i` \[L⁴\]
    weight_sums: Vec<f64>,
    volumes: Vec<f64>,
}

impl DensityFilter {
    /// `centroids` \[L\] and `volumes` \[L³\] of the elements in the reference configuration,
    /// `radius` r \[L\].
    ///
    /// # Errors
    ///
    /// A radius or volume that is not positive and finite, a centroid that is not finite, lists of
    /// different length.
    pub fn new(centroids: &[[f64; 3]], volumes: &[f64], radius: f64) -> Result<Self, FilterError> {
        check_volumes(centroids.len(), volumes)?;
        let neighbours = Neighbours::new(centroids, radius)?;
        let weight_sums = neighbours.weighted_sums(volumes);
        Ok(Self { neighbours, weight_sums, volumes: volumes.to_vec() })
    }

    /// The neighbours of every element and their weights.
    pub fn neighbours(&self) -> &Neighbours {
        &self.neighbours
    }
}

impl DesignMap for DensityFilter {
    fn apply(&self, x: &[f64]) -> Vec<f64> {
        assert_eq!(x.len(), self.volumes.len(), "one density per element");
        let weighted: Vec<f64> = x.iter().zip(&self.volumes).map(|(x, volume)| x * volume).collect();
        let sums = self.neighbours.weighted_sums(&weighted);
        sums.iter().zip(&self.weight_sums).map(|(sum, weights)| sum / weights).collect()
    }

    /// Gathers instead of scattering, since the weights are symmetric:
    /// `dθ/dx_i = v_i Σ_e w_ie (dθ/dφ_e) / Σ_k w_ek v_k`.
    fn pull_back(&self, _x: &[f64], d_phi: &[f64]) -> Vec<f64> {
        assert_eq!(d_phi.len(), self.volumes.len(), "one derivative per element");
        let scaled: Vec<f64> = d_phi.iter().zip(&self.weight_sums).map(|(d, weights)| d / weights).collect();
        let sums = self.neighbours.weighted_sums(&scaled);
        sums.iter().zip(&self.volumes).map(|(sum, volume)| sum * volume).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::tests::{box_grid, graded_row, pseudo_random};
    use crate::map::{Chain, Identity, OnElements};
    use crate::{DesignVariables, Projection};

    fn dot(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| a * b).sum()
    }

    #[test]
    fn means_by_hand() {
        // Elements [0, 1], [1, 3], [3, 4]; r = 2: distance 1.5 between neighbours, 3 between the
        // ends.
        let centroids = [[0.5, 0.0, 0.0], [2.0, 0.0, 0.0], [3.5, 0.0, 0.0]];
        let filter = DensityFilter::new(&centroids, &[1.0, 2.0, 1.0], 2.0).unwrap();
        let filtered = filter.apply(&[1.0, 0.0, 0.5]);
        // φ_0 = 2·1·1/(2·1 + 0.5·2), φ_1 = (0.5·1·1 + 0.5·1·0.5)/(2·2 + 2·0.5·1), φ_2 = 2·0.5/3
        for (value, expected) in filtered.iter().zip([2.0 / 3.0, 0.75 / 5.0, 1.0 / 3.0]) {
            assert!((value - expected).abs() < 1e-15);
        }
    }

    #[test]
    fn constants_stay_and_the_pull_back_is_the_transpose() {
        let (centroids, volumes) = graded_row(50, 1.1);
        let filter = DensityFilter::new(&centroids, &volumes, 2.0).unwrap();
        assert!(filter.apply(&[0.37; 50]).iter().all(|value| (value - 0.37).abs() < 1e-15));
        let (x, d) = (pseudo_random(50, 1), pseudo_random(50, 2));
        let (left, right) = (dot(&filter.apply(&x), &d), dot(&x, &filter.pull_back(&x, &d)));
        assert!((left / right - 1.0).abs() < 1e-14);
    }

    /// Variables → domain filter → projection → passives, compared with central differences of Σ
    /// φ⁴.
    #[test]
    fn chain_agrees_with_central_differences() {
        let (centroids, volumes) = box_grid([4, 4, 3], 1.0);
        let variables = DesignVariables::new(48, &(6..48).collect::<Vec<_>>(), &[6, 7, 20], &[40, 47]).unwrap();
        let gather = |all: &[f64]| -> Vec<f64> { variables.domain().iter().map(|&e| all[e as usize]).collect() };
        let domain_centroids: Vec<[f64; 3]> = variables.domain().iter().map(|&e| centroids[e as usize]).collect();
        let filter = DensityFilter::new(&domain_centroids, &gather(&volumes), 1.8).unwrap();
        let projection = Projection::new(4.0, 0.45).unwrap();
        let chain = Chain::new(vec![
            Box::new(variables.clone()),
            Box::new(OnElements::new(variables.domain().to_vec(), filter)),
            Box::new(OnElements::new(variables.domain().to_vec(), projection)),
            Box::new(variables.passives()),
            Box::new(Identity),
        ]);
        let x = pseudo_random(variables.count(), 9);
        let value = |x: &[f64]| chain.apply(x).iter().map(|phi| phi.powi(4)).sum::<f64>();
        let densities = chain.apply(&x);
        assert!(densities[..8].iter().all(|&phi| phi == 1.0));
        let d_phi: Vec<f64> = densities.iter().map(|phi| 4.0 * phi.powi(3)).collect();
        let gradient = chain.pull_back(&x, &d_phi);
        assert_eq!(gradient.len(), 37);
        for entry in 0..x.len() {
            let step = 1e-5;
            let (mut forward, mut backward) = (x.clone(), x.clone());
            forward[entry] += step;
            backward[entry] -= step;
            let difference = (value(&forward) - value(&backward)) / (2.0 * step);
            assert!((difference - gradient[entry]).abs() < 2e-9 * gradient[entry].abs().max(1.0), "entry {entry}");
        }
    }

    #[test]
    fn an_empty_chain_is_the_identity() {
        assert_eq!(Chain::default().apply(&[0.1, 0.2]), [0.1, 0.2]);
        assert_eq!(Chain::default().pull_back(&[0.1, 0.2], &[3.0, 4.0]), [3.0, 4.0]);
    }
}

//! Sigmund's sensitivity filter.

use rayon::prelude::*;
use slipstick_ranks::{Alone, Ranks, own_range};
use std::ops::Range;
use std::sync::Arc;

use super::{FilterError, Neighbours, check_volumes};
use crate::values::DomainValues;

/// Densities below this do not increase the filtered gradient further. Sigmund (2007).
const SMALLEST_DENSITY: f64 = 1e-3;

/// Sensitivity filter for meshes with elements of different volume:
///
/// `∂θ̂/∂φ_e = Σ_i w_ei φ_i (∂θ/∂φ_i)/v_i / ( max(φ_e, 1e-3)/v_e · Σ_i w_ei )`,
/// `w_ei = max(0, r − ‖X_e − X_i‖)`.
///
/// It averages derivatives *per volume*, so that a large element next to small ones is not
/// overweighted. The weights themselves do not contain the volume: if part of a neighbourhood is
/// refined, its many small elements count more in the average, which only matters if the derivative
/// per volume varies within the radius.
///
/// The result is not the gradient of any function: use it only for the optimizer, after all checks
/// of derivatives. Elements that do not belong to the design domain should not be given to the
/// filter.
///
/// Source: O. Sigmund, Morphology-based black and white filters for topology optimization, Struct.
/// Multidiscip. Optim. 33 (2007) 401–424. Test: `uniform_mesh_is_the_classic_formula`.
#[derive(Clone, Debug)]
pub struct SensitivityFilter {
    ranks: Arc<dyn Ranks>,
    /// Range of elements whose lists this rank has.
    own: Range<usize>,
    neighbours: Neighbours,
    weight_sums: Vec<f64>,
    volumes: Vec<f64>,
}

impl SensitivityFilter {
    /// `centroids` \[L\] and `volumes` \[L³\] of the elements in the reference configuration,
    /// `radius` r \[L\].
    ///
    /// # Errors
    ///
    /// A radius or volume that is not positive and finite, a centroid that is not finite, lists of
    /// different length.
    pub fn new(centroids: &[[f64; 3]], volumes: &[f64], radius: f64) -> Result<Self, FilterError> {
        Self::mirrored(centroids, volumes, radius, &[])
    }

    /// The same for elements on one side of symmetry planes, as in [`Neighbours::mirrored`]: as if
    /// the images existed.
    ///
    /// # Errors
    ///
    /// As [`new`](Self::new).
    pub fn mirrored(
        centroids: &[[f64; 3]],
        volumes: &[f64],
        radius: f64,
        planes: &[(usize, f64)],
    ) -> Result<Self, FilterError> {
        Self::on_ranks(centroids, volumes, radius, planes, Arc::new(Alone))
    }

    /// The same with the lists distributed over ranks, which build and [`apply`](Self::apply) the
    /// filter collectively.
    ///
    /// # Errors
    ///
    /// As [`new`](Self::new), on all ranks.
    pub fn on_ranks(
        centroids: &[[f64; 3]],
        volumes: &[f64],
        radius: f64,
        planes: &[(usize, f64)],
        ranks: Arc<dyn Ranks>,
    ) -> Result<Self, FilterError> {
        check_volumes(centroids.len(), volumes)?;
        let own = own_range(centroids.len(), &*ranks);
        let neighbours = Neighbours::of_some(centroids, radius, planes, own.clone())?;
        let weight_sums = neighbours.weighted_sums(&vec![1.0; volumes.len()]);
        Ok(Self { ranks, own, neighbours, weight_sums, volumes: volumes.to_vec() })
    }

    /// The filtered gradient `∂θ̂/∂φ` for densities `density` (0 to 1) and their gradient `∂θ/∂φ`.
    ///
    /// # Panics
    ///
    /// If there is not one density and one derivative per element.
    pub fn apply(&self, density: &DomainValues, gradient: &DomainValues) -> DomainValues {
        assert_eq!(density.len(), self.volumes.len(), "one density per element");
        assert_eq!(gradient.len(), self.volumes.len(), "one derivative per element");
        let per_volume: Vec<f64> = (0..density.len()).map(|i| density[i] * gradient[i] / self.volumes[i]).collect();
        let mut filtered = self.neighbours.weighted_sums(&per_volume);
        filtered.par_iter_mut().zip(&self.weight_sums).zip(self.own.clone()).for_each(|((value, weights), element)| {
            let own = density[element].max(SMALLEST_DENSITY) / self.volumes[element];
            *value /= own * weights;
        });
        self.ranks.join(&filtered).into()
    }

    /// The neighbours of this rank's elements and their weights.
    pub fn neighbours(&self) -> &Neighbours {
        &self.neighbours
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::tests::{box_grid, graded_row, pseudo_random};
    use slipstick_ranks::threads::on_ranks;

    fn close(left: &[f64], right: &[f64], tolerance: f64) {
        assert_eq!(left.len(), right.len());
        for (element, (l, r)) in left.iter().zip(right).enumerate() {
            assert!((l - r).abs() <= tolerance * r.abs().max(1.0), "element {element}: {l} and {r}");
        }
    }

    /// The formula over all pairs of elements, without a neighbour search.
    #[test]
    fn agrees_with_all_pairs() {
        let (centroids, volumes) = graded_row(40, 1.15);
        let density = pseudo_random(40, 1);
        let gradient: DomainValues = pseudo_random(40, 2).iter().map(|g| g - 0.7).collect();
        let radius = 3.0;
        let filtered = SensitivityFilter::new(&centroids, &volumes, radius).unwrap().apply(&density, &gradient);
        let expected: Vec<f64> = (0..40)
            .map(|e| {
                let weight = |i: usize| (radius - (centroids[e][0] - centroids[i][0]).abs()).max(0.0);
                let top: f64 = (0..40).map(|i| weight(i) * density[i] * gradient[i] / volumes[i]).sum();
                let bottom: f64 = (0..40).map(weight).sum();
                top / (density[e].max(1e-3) / volumes[e] * bottom)
            })
            .collect();
        close(&filtered, &expected, 1e-13);
    }

    /// Sigmund's filter of 1997, `Σ w φ g / (φ_e Σ w)`, on 5 × 5 × 5 cubes of side ½: at the centre
    /// element with r = 0.6 the neighbours are itself (w = 0.6) and the six that share a face
    /// (w = 0.1).
    #[test]
    fn uniform_mesh_is_the_classic_formula() {
        let (centroids, volumes) = box_grid([5; 3], 0.5);
        let density = pseudo_random(125, 3);
        let gradient = pseudo_random(125, 4);
        let filter = SensitivityFilter::new(&centroids, &volumes, 0.6).unwrap();
        let filtered = filter.apply(&density, &gradient);
        let centre = 62;
        let faces = [centre - 25, centre - 5, centre - 1, centre + 1, centre + 5, centre + 25];
        let product = |i: usize| density[i] * gradient[i];
        let sum = 0.6 * product(centre) + 0.1 * faces.iter().map(|&i| product(i)).sum::<f64>();
        let expected = sum / (density[centre] * (0.6 + 6.0 * 0.1));
        assert!((filtered[centre] - expected).abs() < 1e-14);
        assert_eq!(filter.neighbours().of(centre).count(), 7);
        assert_eq!(filter.neighbours().of(0).count(), 4);
    }

    #[test]
    fn equal_densities_keep_a_gradient_that_is_proportional_to_volume() {
        let (centroids, volumes) = graded_row(60, 1.08);
        let gradient: DomainValues = volumes.iter().map(|volume| -2.5 * volume).collect();
        for density in [1.0, 0.2, 1e-3] {
            let filter = SensitivityFilter::new(&centroids, &volumes, 4.0).unwrap();
            close(&filter.apply(&[density; 60].into(), &gradient), &gradient, 1e-13);
        }
    }

    #[test]
    fn radius_below_the_element_size_is_the_identity() {
        let (centroids, volumes) = box_grid([4, 3, 2], 1.0);
        let density = pseudo_random(24, 5);
        let gradient = pseudo_random(24, 6);
        let filter = SensitivityFilter::new(&centroids, &volumes, 0.99).unwrap();
        close(&filter.apply(&density, &gradient), &gradient, 1e-15);
        // Below 1e-3 the density no longer cancels: φ g / 1e-3.
        let filtered = filter.apply(&[1e-4; 24].into(), &gradient);
        assert!((filtered[7] - 0.1 * gradient[7]).abs() < 1e-15);
        assert_eq!(filter.apply(&[0.0; 24].into(), &gradient)[..], [0.0; 24]);
    }

    /// Splitting half of the elements of a row in two preserves a constant filtered gradient per
    /// volume.
    #[test]
    fn refining_does_not_change_a_constant_gradient_per_volume() {
        let coarse: Vec<f64> = vec![1.0; 20];
        let refined: Vec<f64> = (0..30).map(|i| if i < 10 { 1.0 } else { 0.5 }).collect();
        for volumes in [coarse, refined] {
            let ends = volumes.iter().scan(0.0, |end, v| {
                *end += v;
                Some(*end)
            });
            let centroids: Vec<[f64; 3]> = ends.zip(&volumes).map(|(end, v)| [end - 0.5 * v, 0.0, 0.0]).collect();
            let gradient: DomainValues = volumes.iter().map(|v| -3.0 * v).collect();
            let filter = SensitivityFilter::new(&centroids, &volumes, 2.7).unwrap();
            let filtered = filter.apply(&vec![0.4; volumes.len()].into(), &gradient);
            for (value, volume) in filtered.iter().zip(&volumes) {
                assert!((value / volume + 3.0).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn ranks_filter_as_one_does() {
        let (centroids, volumes) = box_grid([5, 4, 3], 0.3);
        let (density, gradient) = (pseudo_random(60, 7), pseudo_random(60, 8));
        let planes = [(0, 0.0)];
        let alone = SensitivityFilter::mirrored(&centroids, &volumes, 0.8, &planes).unwrap();
        let all = on_ranks(3, |rank| {
            let filter = SensitivityFilter::on_ranks(&centroids, &volumes, 0.8, &planes, Arc::new(rank)).unwrap();
            assert_eq!(filter.neighbours().len(), 20);
            filter.apply(&density, &gradient)
        });
        assert!(all.iter().all(|filtered| *filtered == alone.apply(&density, &gradient)));
        // two elements for three ranks
        let two = |values: &DomainValues| DomainValues::from(values[..2].to_vec());
        let of_two = |ranks| SensitivityFilter::on_ranks(&centroids[..2], &volumes[..2], 0.8, &[], ranks).unwrap();
        let few = on_ranks(3, |rank| of_two(Arc::new(rank)).apply(&two(&density), &two(&gradient)));
        let alone = of_two(Arc::new(Alone)).apply(&two(&density), &two(&gradient));
        assert!(few.iter().all(|filtered| *filtered == alone));
    }

    #[test]
    fn same_bits_for_any_number_of_threads() {
        let (centroids, volumes) = box_grid([12, 11, 10], 0.3);
        let (density, gradient) = (pseudo_random(1320, 7), pseudo_random(1320, 8));
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| SensitivityFilter::new(&centroids, &volumes, 1.0).unwrap().apply(&density, &gradient))
        };
        assert_eq!(run(1), run(3));
    }

    #[test]
    fn a_derivative_that_is_not_a_number_stays_visible() {
        let (centroids, volumes) = box_grid([3, 1, 1], 1.0);
        let filter = SensitivityFilter::new(&centroids, &volumes, 1.5).unwrap();
        let filtered = filter.apply(&[0.5; 3].into(), &[1.0, 1.0, f64::NAN].into());
        assert!(filtered[1].is_nan() && filtered[2].is_nan());
    }

    #[test]
    fn errors() {
        let error = SensitivityFilter::new(&[[0.0; 3]; 2], &[1.0], 1.0).unwrap_err();
        assert_eq!(error, FilterError::Count { centroids: 2, volumes: 1 });
        let error = SensitivityFilter::new(&[[0.0; 3]; 2], &[1.0, 0.0], 1.0).unwrap_err();
        assert_eq!(error, FilterError::Volume { element: 1, volume: 0.0 });
    }
}

//! The linear density filter.

use slipstick_ranks::{Alone, Ranks, own_range};
use std::sync::Arc;

use super::extension::{Triangle, weights_beyond};
use super::{FilterError, Neighbours, check_volumes};
use crate::map::{DesignMap, MapParameter};

/// Density filter: `φ_e = Σ_i w_ei v_i x_i / Σ_i w_ei v_i`, `w_ei = max(0, r − ‖X_e − X_i‖)`.
///
/// It is a volume-weighted mean, so constants are preserved and local mesh refinement causes no
/// bias. At the edges of the domain, the mean is over the part of the ball that lies inside
/// (*truncated*); beyond faces that are [surrounded by void](Self::in_void), it includes the void.
/// Its [`pull_back`](DesignMap::pull_back) is the exact transpose.
///
/// Source: Bruns, Tortorelli, Comput. Methods Appl. Mech. Eng. 190 (2001) 3443–3459, with element
/// volumes as in Sigmund, Struct. Multidiscip. Optim. 33 (2007) 401–424.
#[derive(Clone, Debug)]
pub struct DensityFilter {
    ranks: Arc<dyn Ranks>,
    /// Neighbours of this rank's elements.
    neighbours: Neighbours,
    /// `Σ_i w_ei v_i` of all elements, and of the void beyond faces. \[L⁴\]
    weight_sums: Vec<f64>,
    volumes: Vec<f64>,
    region: Arc<Region>,
}

/// The region that a filter is applied to. \[L\]
#[derive(Debug)]
struct Region {
    centroids: Vec<[f64; 3]>,
    radius: f64,
    planes: Vec<(usize, f64)>,
    /// Faces beyond which there is void.
    faces: Vec<Triangle>,
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
        Self::on_ranks(centroids, volumes, radius, &[], Arc::new(Alone))
    }

    /// The same for elements on one side of symmetry planes, as in [`Neighbours::mirrored`], with
    /// the lists distributed over ranks, which build and apply the filter collectively.
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
        let neighbours = Neighbours::of_some(centroids, radius, planes, own)?;
        let weight_sums = ranks.join(&neighbours.weighted_sums(volumes));
        let (centroids, planes) = (centroids.to_vec(), planes.to_vec());
        let region = Arc::new(Region { centroids, radius, planes, faces: Vec::new() });
        Ok(Self { ranks, neighbours, weight_sums, volumes: volumes.to_vec(), region })
    }

    /// The same filter of a domain that void surrounds beyond these faces: the weight of the ball's
    /// part there is added to the denominator, with density 0. Constants are then preserved only at
    /// elements from which no such face is within the radius. None of the `faces` lies in a symmetry
    /// plane. All ranks call it.
    ///
    /// Source: Clausen, Andreassen, Struct. Multidiscip. Optim. 56 (2017) 1147–1155, whose domain
    /// extension has elements beyond the faces.
    pub fn in_void(mut self, faces: Vec<Triangle>) -> Self {
        let Region { centroids, radius, planes, .. } = &*self.region;
        let own = own_range(centroids.len(), &*self.ranks);
        let beyond = self.ranks.join(&weights_beyond(&centroids[own], *radius, planes, &faces));
        self.weight_sums.iter_mut().zip(beyond).for_each(|(sum, beyond)| *sum += beyond);
        let (centroids, planes) = (centroids.clone(), planes.clone());
        self.region = Arc::new(Region { centroids, radius: *radius, planes, faces });
        self
    }

    /// The same filter with another radius \[L\]. All ranks call it.
    ///
    /// # Errors
    ///
    /// As [`new`](Self::new), on all ranks.
    pub fn with_radius(&self, radius: f64) -> Result<Self, FilterError> {
        let Region { centroids, planes, faces, .. } = &*self.region;
        let other = Self::on_ranks(centroids, &self.volumes, radius, planes, self.ranks.clone())?;
        Ok(if faces.is_empty() { other } else { other.in_void(faces.clone()) })
    }

    /// The radius. \[L\]
    pub fn radius(&self) -> f64 {
        self.region.radius
    }

    /// The neighbours of this rank's elements and their weights.
    pub fn neighbours(&self) -> &Neighbours {
        &self.neighbours
    }

    /// `Σ_i w_ei a_i` for all elements.
    fn weighted_sums(&self, a: &[f64]) -> Vec<f64> {
        self.ranks.join(&self.neighbours.weighted_sums(a))
    }
}

impl DesignMap for DensityFilter {
    fn apply(&self, x: &[f64]) -> Vec<f64> {
        assert_eq!(x.len(), self.volumes.len(), "one density per element");
        let weighted: Vec<f64> = x.iter().zip(&self.volumes).map(|(x, volume)| x * volume).collect();
        let sums = self.weighted_sums(&weighted);
        sums.iter().zip(&self.weight_sums).map(|(sum, weights)| sum / weights).collect()
    }

    /// Gathers instead of scattering, since the weights are symmetric:
    /// `dθ/dx_i = v_i Σ_e w_ie (dθ/dφ_e) / Σ_k w_ek v_k`.
    fn pull_back(&self, _x: &[f64], d_phi: &[f64]) -> Vec<f64> {
        assert_eq!(d_phi.len(), self.volumes.len(), "one derivative per element");
        let scaled: Vec<f64> = d_phi.iter().zip(&self.weight_sums).map(|(d, weights)| d / weights).collect();
        let sums = self.weighted_sums(&scaled);
        sums.iter().zip(&self.volumes).map(|(sum, volume)| sum * volume).collect()
    }

    fn parameter(&self, which: MapParameter) -> Option<f64> {
        (which == MapParameter::Radius).then(|| self.radius())
    }

    fn with(&self, which: MapParameter, value: f64) -> Result<Option<Arc<dyn DesignMap>>, FilterError> {
        match which {
            MapParameter::Radius => Ok(Some(Arc::new(self.with_radius(value)?))),
            MapParameter::Sharpness | MapParameter::Threshold => Ok(None),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::extension::tests::surface;
    use crate::filter::tests::{box_grid, graded_row, pseudo_random};
    use crate::map::Chain;
    use slipstick_ranks::threads::on_ranks;

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

    /// With planes, a quarter is filtered as the whole is, and the pull-back is the transpose.
    #[test]
    fn images_act_as_the_whole_does() {
        let (whole, volumes) = box_grid([6, 4, 3], 0.5);
        let inside = |x: &[f64; 3]| x[0] > 1.5 && x[1] > 1.0;
        let quarter: Vec<usize> = (0..whole.len()).filter(|&e| inside(&whole[e])).collect();
        let centroids: Vec<[f64; 3]> = quarter.iter().map(|&e| whole[e]).collect();
        let image = |x: &[f64; 3]| [1.5 + (x[0] - 1.5).abs(), 1.0 + (x[1] - 1.0).abs(), x[2]];
        let distance = |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max);
        let owner = |x: &[f64; 3]| centroids.iter().position(|c| distance(c, &image(x)) < 1e-9).unwrap();
        let planes = [(0, 1.5), (1, 1.0)];
        let volumes_of_part = vec![volumes[0]; centroids.len()];
        let part = DensityFilter::on_ranks(&centroids, &volumes_of_part, 1.3, &planes, Arc::new(Alone)).unwrap();
        let x = pseudo_random(centroids.len(), 3);
        let mirrored: Vec<f64> = whole.iter().map(|at| x[owner(at)]).collect();
        let all = DensityFilter::new(&whole, &volumes, 1.3).unwrap().apply(&mirrored);
        for (value, &element) in part.apply(&x).iter().zip(&quarter) {
            assert!((value - all[element]).abs() < 1e-14);
        }
        let d = pseudo_random(centroids.len(), 4);
        let (left, right) = (dot(&part.apply(&x), &d), dot(&x, &part.pull_back(&x, &d)));
        assert!((left / right - 1.0).abs() < 1e-14);
    }

    /// In void, elements in the interior are filtered as before, those at a flat face have half of
    /// their weight in the void if the radius is large, and symmetry planes have no effect.
    #[test]
    fn void_beyond_the_faces() {
        let (centroids, volumes) = box_grid([12, 10, 8], 0.25);
        let faces = surface([3.0, 2.5, 2.0], &[]);
        let radius = 0.7;
        let truncated = DensityFilter::new(&centroids, &volumes, radius).unwrap();
        let filter = truncated.clone().in_void(faces.clone());
        let x = pseudo_random(centroids.len(), 5);
        let (before, after) = (truncated.apply(&x), filter.apply(&x));
        let full = filter.apply(&vec![1.0; centroids.len()]);
        for (element, at) in centroids.iter().enumerate() {
            let depth = (0..3).map(|k| at[k].min([3.0, 2.5, 2.0][k] - at[k])).fold(f64::INFINITY, f64::min);
            if depth > radius {
                assert_eq!(after[element], before[element]);
            } else {
                assert!(after[element] < before[element] && full[element] < 1.0);
            }
        }
        let wider = DensityFilter::new(&centroids, &volumes, 0.9).unwrap();
        for (narrow, wide) in [(&truncated, wider.clone()), (&filter, wider.in_void(faces))] {
            let found = narrow.with_radius(0.9).unwrap();
            assert_eq!((found.radius(), found.apply(&x)), (0.9, wide.apply(&x)));
            assert_eq!(found.with_radius(radius).unwrap().apply(&x), narrow.apply(&x));
            assert!(narrow.with_radius(0.0).is_err());
        }
        // inside, at a face: 0.68 of the ball's weight; at a corner: about the third power
        let (face, corner) = (full[5 * 8 + 4], full[0]);
        assert!((face - 0.68).abs() < 0.01 && (corner - 0.68_f64.powi(3)).abs() < 0.01, "{face} {corner}");
        let d = pseudo_random(centroids.len(), 6);
        let (left, right) = (dot(&filter.apply(&x), &d), dot(&x, &filter.pull_back(&x, &d)));
        assert!((left / right - 1.0).abs() < 1e-14);

        // a half in x and y with planes there
        let inside = |at: &[f64; 3]| at[0] < 1.5 && at[1] < 1.25;
        let part: Vec<usize> = (0..centroids.len()).filter(|&e| inside(&centroids[e])).collect();
        let mirrored: Vec<[f64; 3]> =
            part.iter().map(|&e| [1.5 - centroids[e][0], 1.25 - centroids[e][1], centroids[e][2]]).collect();
        let planes = [(0, 0.0), (1, 0.0)];
        let quarter = on_ranks(2, |rank| {
            DensityFilter::on_ranks(&mirrored, &volumes[..part.len()], radius, &planes, Arc::new(rank))
                .unwrap()
                .in_void(surface([1.5, 1.25, 2.0], &[0, 1]))
                .apply(&vec![1.0; part.len()])
        });
        for (value, &element) in quarter[0].iter().zip(&part) {
            assert!((value - full[element]).abs() < 1e-4, "{value} {}", full[element]);
        }
        assert_eq!(quarter[0], quarter[1]);
    }

    #[test]
    fn ranks_filter_as_one_does() {
        let (centroids, volumes) = box_grid([5, 4, 3], 0.3);
        let (x, d) = (pseudo_random(60, 7), pseudo_random(60, 8));
        let on = |ranks| DensityFilter::on_ranks(&centroids, &volumes, 0.8, &[(0, 0.0)], ranks).unwrap();
        let alone = on(Arc::new(Alone));
        let expected = (alone.apply(&x), alone.pull_back(&x, &d));
        let all = on_ranks(3, |rank| {
            let filter = on(Arc::new(rank));
            assert_eq!(filter.neighbours().len(), 20);
            (filter.apply(&x), filter.pull_back(&x, &d))
        });
        assert!(all.iter().all(|found| *found == expected));
    }

    #[test]
    fn an_empty_chain_is_the_identity() {
        assert_eq!(Chain::default().apply(&[0.1, 0.2]), [0.1, 0.2]);
        assert_eq!(Chain::default().pull_back(&[0.1, 0.2], &[3.0, 4.0]), [3.0, 4.0]);
    }
}

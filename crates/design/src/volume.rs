//! The volume constraint.

use thiserror::Error;

use crate::values::DomainValues;

/// Why a volume constraint cannot be built.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum VolumeError {
    /// A volume is negative, infinite or not a number.
    #[error("element {element} has volume {volume}; volumes of designed elements are finite and not negative")]
    Volume {
        /// Element, from 0.
        element: usize,
        /// Its volume. \[L³\]
        volume: f64,
    },
    /// There is nothing to constrain.
    #[error("the design domain has no volume; name at least one body with elements in it")]
    Empty,
    /// The limit is outside (0, 1].
    #[error("volume fraction {fraction} is outside (0, 1]")]
    Fraction {
        /// The requested limit.
        fraction: f64,
    },
}

/// Bounds the solid fraction of the design domain:
/// `g(φ) = Σ_e φ_e v_e / (V_design · V_max) − 1 ≤ 0`.
///
/// It is relative to the limit: `g = 0.01` means one per cent too much. Paper: (87).
#[derive(Clone, Debug)]
pub struct VolumeConstraint {
    volumes: DomainValues,
    design_volume: f64,
    fraction: f64,
}

impl VolumeConstraint {
    /// `volumes`: `v_e` of every element of the design domain \[L³\]; `fraction`: the limit `V_max`
    /// in (0, 1\], of the whole domain with its passive elements.
    ///
    /// # Errors
    ///
    /// A volume that is negative or not finite, a domain without volume, a fraction outside (0,
    /// 1\].
    pub fn new(volumes: DomainValues, fraction: f64) -> Result<Self, VolumeError> {
        if let Some(element) = volumes.iter().position(|v| !v.is_finite() || *v < 0.0) {
            return Err(VolumeError::Volume { element, volume: volumes[element] });
        }
        Self::check_limit(fraction)?;
        let design_volume: f64 = volumes.iter().sum();
        if design_volume <= 0.0 {
            return Err(VolumeError::Empty);
        }
        Ok(Self { volumes, design_volume, fraction })
    }

    /// `V_design`, the volume of the design domain. \[L³\]
    pub fn design_volume(&self) -> f64 {
        self.design_volume
    }

    /// `V_max`, the largest allowed solid fraction.
    pub fn limit(&self) -> f64 {
        self.fraction
    }

    /// Checks whether a fraction may be a limit.
    ///
    /// # Errors
    ///
    /// A fraction outside (0, 1\].
    pub fn check_limit(fraction: f64) -> Result<(), VolumeError> {
        if fraction > 0.0 && fraction <= 1.0 { Ok(()) } else { Err(VolumeError::Fraction { fraction }) }
    }

    /// Changes the limit.
    ///
    /// # Panics
    ///
    /// If [`check_limit`](Self::check_limit) refuses it.
    pub fn set_limit(&mut self, fraction: f64) {
        assert_eq!(Self::check_limit(fraction), Ok(()), "the limit has been checked");
        self.fraction = fraction;
    }

    /// `4 Σ v_e φ_e (1 − φ_e) / V_design`: 0 for densities of 0 and 1, 1 if all are 0.5. Source:
    /// Sigmund, Struct. Multidiscip. Optim. 33 (2007) 401–424.
    ///
    /// # Panics
    ///
    /// If there are not as many densities as volumes.
    pub fn discreteness(&self, densities: &DomainValues) -> f64 {
        assert_eq!(densities.len(), self.volumes.len(), "one density per element");
        let grey = |(density, volume): (&f64, &f64)| 4.0 * volume * density * (1.0 - density);
        densities.iter().zip(&self.volumes).map(grey).sum::<f64>() / self.design_volume
    }

    /// `V(φ) = Σ φ_e v_e / V_design`, the solid fraction of the design domain.
    ///
    /// # Panics
    ///
    /// If there are not as many densities as volumes.
    pub fn fraction(&self, densities: &DomainValues) -> f64 {
        assert_eq!(densities.len(), self.volumes.len(), "one density per element");
        let solid: f64 = densities.iter().zip(&self.volumes).map(|(density, volume)| density * volume).sum();
        solid / self.design_volume
    }

    /// `g(φ)`, not positive if the constraint is satisfied.
    ///
    /// # Panics
    ///
    /// If there are not as many densities as volumes.
    pub fn value(&self, densities: &DomainValues) -> f64 {
        self.fraction(densities) / self.fraction - 1.0
    }

    /// `∂g/∂φ_e = v_e / (V_design · V_max)`, the same for every design.
    pub fn gradient(&self) -> DomainValues {
        let limit_volume = self.design_volume * self.fraction;
        self.volumes.iter().map(|volume| volume / limit_volume).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn value_and_gradient_by_hand() {
        // 0.5·2 + 1·1 + 0.25·4 = 3 of 7.
        let constraint = VolumeConstraint::new([2.0, 1.0, 4.0, 0.0].into(), 0.4).unwrap();
        let densities = [0.5, 1.0, 0.25, 1.0].into();
        assert!((constraint.fraction(&densities) - 3.0 / 7.0).abs() < 1e-15);
        assert!((constraint.value(&densities) - (3.0 / 2.8 - 1.0)).abs() < 1e-15);
        // Linear: the value at the limit is zero, and the gradient maps one design to any other.
        assert!(constraint.value(&[0.4; 4].into()).abs() < 1e-15);
        let gradient = constraint.gradient();
        let change: f64 = gradient.iter().zip(&densities).map(|(g, density)| g * (density - 0.4)).sum();
        assert!((constraint.value(&densities) - change).abs() < 1e-15);
    }

    #[test]
    fn another_limit_changes_value_and_gradient_only() {
        let mut constraint = VolumeConstraint::new([1.0, 3.0].into(), 0.5).unwrap();
        let design = [0.5; 2].into();
        assert_eq!((constraint.value(&design), constraint.fraction(&design)), (0.0, 0.5));
        constraint.set_limit(0.25);
        assert_eq!((constraint.limit(), constraint.value(&design), constraint.fraction(&design)), (0.25, 1.0, 0.5));
        assert_eq!(constraint.gradient()[..], [1.0, 3.0]);
    }

    #[test]
    fn errors_name_the_place() {
        let volume = VolumeConstraint::new([1.0, f64::NAN].into(), 0.5).unwrap_err();
        assert!(matches!(volume, VolumeError::Volume { element: 1, .. }));
        let negative = VolumeConstraint::new([1.0, 1.0, -1.0].into(), 0.5).unwrap_err();
        assert_eq!(negative, VolumeError::Volume { element: 2, volume: -1.0 });
        assert_eq!(VolumeConstraint::new([0.0].into(), 0.5).unwrap_err(), VolumeError::Empty);
        assert_eq!(VolumeConstraint::new([].into(), 0.5).unwrap_err(), VolumeError::Empty);
        for fraction in [0.0, -0.1, 1.1, f64::NAN] {
            assert!(matches!(VolumeConstraint::new([1.0].into(), fraction), Err(VolumeError::Fraction { .. })));
        }
    }
}

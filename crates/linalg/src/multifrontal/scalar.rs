//! The number formats of the factors.

use faer::traits::RealField;

/// Single or double precision.
pub(super) trait Scalar: RealField + Copy + PartialOrd + Send + Sync + 'static {
    /// Pivots below this size are rejected; the scaled matrix has entries of about one. In double
    /// precision this is slightly above the round-off that remains for a singular matrix. In single
    /// precision, where even true pivots of ill-conditioned matrices can be smaller than round-off,
    /// it only detects zeros: such factors are still good preconditioners.
    const SMALLEST_PIVOT: f64;
    /// Largest difference between two entries of the scaled matrix that counts as round-off.
    const SYMMETRY: f64;
    const ZERO: Self;
    const ONE: Self;
    fn from_f64(x: f64) -> Self;
    fn to_f64(self) -> f64;
    fn absolute(self) -> Self;
}

impl Scalar for f64 {
    const SMALLEST_PIVOT: f64 = 1e-14;
    const SYMMETRY: f64 = 16.0 * f64::EPSILON;
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    fn from_f64(x: f64) -> Self {
        x
    }
    fn to_f64(self) -> f64 {
        self
    }
    #[inline(always)]
    fn absolute(self) -> Self {
        self.abs()
    }
}

impl Scalar for f32 {
    const SMALLEST_PIVOT: f64 = 1e-9;
    const SYMMETRY: f64 = 16.0 * f32::EPSILON as f64;
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    fn from_f64(x: f64) -> Self {
        x as f32
    }
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
    #[inline(always)]
    fn absolute(self) -> Self {
        self.abs()
    }
}

//! Constants of the laws, as given in a case file and as needed for the small-strain limit.
//!
//! A law declares its constants as a list of [`Constant`]s. Reading and writing cases, errors and
//! the JSON schema all follow from this list.

use super::{Material, MaterialError, Real};
use serde::Serialize;

/// A constant of a law: a key of case files.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Constant {
    /// The key in case files.
    pub key: &'static str,
    /// Meaning, range and unit.
    pub about: &'static str,
    /// Names the required input, for the message about a missing key.
    pub help: &'static str,
    /// Its values.
    pub form: Form,
}

/// The values of a constant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Form {
    /// A number to which stresses are proportional, if all such constants of the law change by the
    /// same factor. \[F/L²\]
    Modulus(Range),
    /// One to `most` such numbers.
    Moduli {
        /// Maximum number of entries.
        most: usize,
    },
    /// A number that does not change with the stiffness.
    Number(Range),
    /// One to `most` such numbers.
    Numbers {
        /// Maximum number of entries.
        most: usize,
    },
    /// A nonzero direction; it need not be a unit vector. The value is the default.
    Direction([f64; 3]),
}

/// The values that a number may have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Range {
    /// Every finite number.
    Any,
    /// Greater than zero.
    Positive,
    /// Zero or greater.
    NotNegative,
    /// Between two excluded bounds, with advice for values outside.
    Between(f64, f64, &'static str),
}

/// A value of a constant.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Value {
    /// A number.
    Number(f64),
    /// A list of numbers, or a direction.
    Numbers(Vec<f64>),
}

impl From<f64> for Value {
    fn from(value: f64) -> Self {
        Self::Number(value)
    }
}

impl From<&[f64]> for Value {
    fn from(values: &[f64]) -> Self {
        Self::Numbers(values.to_vec())
    }
}

impl Value {
    /// All numbers.
    pub fn numbers(&self) -> &[f64] {
        match self {
            Self::Number(value) => std::slice::from_ref(value),
            Self::Numbers(values) => values,
        }
    }

    /// The only number, or the first of a list.
    pub(super) fn number(&self) -> f64 {
        self.numbers()[0]
    }

    /// A list of numbers, padded with zeros.
    pub(super) fn padded<const N: usize>(&self) -> [f64; N] {
        std::array::from_fn(|i| self.numbers().get(i).copied().unwrap_or(0.0))
    }
}

impl Range {
    /// If the value is out of range: what it must be, and how to achieve that.
    pub fn problem(self, value: f64) -> Option<(String, &'static str)> {
        match self {
            Self::Positive if !(value > 0.0) => Some(("must be greater than zero".into(), "")),
            Self::NotNegative if !(value >= 0.0) => Some(("must not be negative".into(), "")),
            Self::Between(least, most, help) if !(least < value && value < most) => {
                Some((format!("must lie between {least} and {most}, bounds excluded"), help))
            }
            _ => None,
        }
    }
}

impl Constant {
    /// Whether stresses are proportional to it.
    pub fn is_modulus(&self) -> bool {
        matches!(self.form, Form::Modulus(_) | Form::Moduli { .. })
    }

    /// If the value is invalid: what it must be, and how to achieve that.
    pub fn problem(&self, value: &Value) -> Option<(String, &'static str)> {
        let numbers = value.numbers();
        if !numbers.iter().all(|number| number.is_finite()) {
            return Some(("must be finite".into(), ""));
        }
        match self.form {
            Form::Modulus(range) | Form::Number(range) => {
                debug_assert_eq!(numbers.len(), 1, "one number");
                range.problem(value.number())
            }
            Form::Moduli { most } | Form::Numbers { most } => (numbers.is_empty() || numbers.len() > most)
                .then(|| (format!("must list 1 to {most} numbers"), "one for each term of the energy")),
            Form::Direction(_) => (numbers.len() != 3 || numbers.iter().all(|&x| x == 0.0))
                .then(|| ("must not be zero".into(), "a direction [x, y, z] of any length")),
        }
    }
}

/// Rejects values for which [`Constant::problem`] reports a problem.
pub(super) fn check(constants: &[Constant], values: &[Value]) -> Result<(), MaterialError> {
    assert_eq!(constants.len(), values.len(), "one value for each constant");
    for (constant, value) in constants.iter().zip(values) {
        if let Some((problem, help)) = constant.problem(value) {
            return Err(MaterialError::new(constant.key, format!("`{}` {problem}", constant.key), help));
        }
    }
    Ok(())
}

impl Material {
    /// Its constants with their values, in the order of the documentation.
    pub fn constants(&self) -> impl Iterator<Item = (&'static Constant, Value)> {
        self.kind().constants().iter().zip(self.values())
    }

    /// The same law with all moduli, and therefore all elastic stresses, multiplied by one factor. Yield stresses and
    /// their hardening do not change, as in the derivative with respect to Young's modulus.
    ///
    /// # Errors
    /// If a modulus is no longer positive and finite.
    pub fn stiffened(&self, factor: f64) -> Result<Self, MaterialError> {
        self.with_moduli(|modulus| factor * modulus)
    }

    /// The same law with all moduli multiplied by one factor such that its small-strain limit has
    /// this Young's modulus.
    ///
    /// # Errors
    /// If it is not positive and finite.
    pub fn with_youngs_modulus(&self, youngs_modulus: f64) -> Result<Self, MaterialError> {
        let own = self.youngs_modulus();
        // without round-off if Young's modulus itself is a constant of the law
        self.with_moduli(|modulus| if modulus == own { youngs_modulus } else { youngs_modulus / own * modulus })
    }

    fn with_moduli(&self, change: impl Fn(f64) -> f64) -> Result<Self, MaterialError> {
        let changed = |(constant, value): (&Constant, Value)| match value {
            Value::Number(number) if constant.is_modulus() => Value::Number(change(number)),
            Value::Numbers(numbers) if constant.is_modulus() => {
                Value::Numbers(numbers.into_iter().map(&change).collect())
            }
            other => other,
        };
        self.kind().with_values(&self.constants().map(changed).collect::<Vec<_>>())
    }
}

/// Young's modulus E and Poisson's ratio ν, for laws that use them as constants.
pub(super) const ELASTIC: &[Constant] = &[
    Constant {
        key: "youngs_modulus",
        about: "Young's modulus E > 0. [F/L²]",
        help: "Young's modulus of the solid",
        form: Form::Modulus(Range::Positive),
    },
    Constant {
        key: "poisson_ratio",
        about: "Poisson's ratio, −1 < ν < 1/2.",
        help: "Poisson's ratio, for instance 0.3",
        form: Form::Number(Range::Between(-1.0, 0.5, "above about 0.45, use element = \"f_bar\" for the body")),
    },
];

/// The bulk modulus of laws that split the energy into a deviatoric and a volumetric part.
pub(super) const BULK_MODULUS: Constant = Constant {
    key: "bulk_modulus",
    about: "Bulk modulus K > 0 for small strains. [F/L²]",
    help: "the bulk modulus, for rubber about 1000 times the shear modulus",
    form: Form::Modulus(Range::Positive),
};

/// The isotropic small-strain law, which is the limit of every isotropic law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hooke {
    pub youngs_modulus: f64,
    pub poisson_ratio: f64,
    /// Lamé's constants λ and μ. \[F/L²\]
    pub lambda: f64,
    pub mu: f64,
}

impl Hooke {
    /// From Young's modulus E and Poisson's ratio ν.
    pub fn new(youngs_modulus: f64, poisson_ratio: f64) -> Self {
        let (e, nu) = (youngs_modulus, poisson_ratio);
        let lambda = e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
        Self { youngs_modulus, poisson_ratio, lambda, mu: e / (2.0 * (1.0 + nu)) }
    }

    /// From the bulk modulus K and the shear modulus μ.
    pub fn from_moduli(bulk: f64, mu: f64) -> Self {
        Self {
            youngs_modulus: 9.0 * bulk * mu / (3.0 * bulk + mu),
            poisson_ratio: (3.0 * bulk - 2.0 * mu) / (6.0 * bulk + 2.0 * mu),
            lambda: bulk - 2.0 * mu / 3.0,
            mu,
        }
    }

    /// Bulk modulus K = λ + 2μ/3. \[F/L²\]
    pub fn bulk(&self) -> f64 {
        self.lambda + 2.0 * self.mu / 3.0
    }

    /// Energy density λ/2 (tr ε)² + μ ε:ε at H = ∂u/∂X. \[F/L²\]
    pub fn energy<T: Real>(&self, h: &[[T; 3]; 3]) -> T {
        let trace = h[0][0] + h[1][1] + h[2][2];
        let strain = |n: usize| T::from(0.5) * (h[n / 3][n % 3] + h[n % 3][n / 3]);
        let squares = (0..9).fold(T::from(0.0), |sum, n| sum + strain(n) * strain(n));
        T::from(0.5 * self.lambda) * trace * trace + T::from(self.mu) * squares
    }
}

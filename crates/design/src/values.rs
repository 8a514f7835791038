//! Lists of numbers whose type says which index space they cover.
//!
//! A design has three index spaces: all elements of the mesh, the elements of the design domain,
//! and the design variables. A density or derivative over one of them is a different type from one
//! over another; [`DesignVariables`](crate::DesignVariables) converts between them. Conversions
//! from and to plain vectors are explicit.

use std::marker::PhantomData;
use std::ops::{Deref, DerefMut};

use serde::{Deserialize, Serialize};

/// All elements of the mesh, in the order of their numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Elements {}

/// The elements of the design domain, designed and passive, in ascending order of their numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Domain {}

/// The design variables, in ascending order of the number of the first element of each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variables {}

/// One number for each index of the space `S`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent, bound = "")]
pub struct Values<S> {
    numbers: Vec<f64>,
    #[serde(skip)]
    space: PhantomData<S>,
}

/// One number per element of the mesh.
pub type ElementValues = Values<Elements>;

/// One number per element of the design domain.
pub type DomainValues = Values<Domain>;

/// One number per design variable.
pub type VariableValues = Values<Variables>;

impl<S> From<Vec<f64>> for Values<S> {
    fn from(numbers: Vec<f64>) -> Self {
        Self { numbers, space: PhantomData }
    }
}

impl<S, const N: usize> From<[f64; N]> for Values<S> {
    fn from(numbers: [f64; N]) -> Self {
        numbers.to_vec().into()
    }
}

impl<S> From<Values<S>> for Vec<f64> {
    fn from(values: Values<S>) -> Self {
        values.numbers
    }
}

impl<S> FromIterator<f64> for Values<S> {
    fn from_iter<I: IntoIterator<Item = f64>>(numbers: I) -> Self {
        numbers.into_iter().collect::<Vec<f64>>().into()
    }
}

impl<S> Deref for Values<S> {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        &self.numbers
    }
}

impl<S> DerefMut for Values<S> {
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.numbers
    }
}

impl<'a, S> IntoIterator for &'a Values<S> {
    type Item = &'a f64;
    type IntoIter = std::slice::Iter<'a, f64>;

    fn into_iter(self) -> Self::IntoIter {
        self.numbers.iter()
    }
}

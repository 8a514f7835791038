//! Passive elements and ties as links of a [`Chain`](crate::Chain).

use super::DesignVariables;
use crate::map::DesignMap;

impl DesignVariables {
    /// The map that resets passive elements, for use after a filter that blurs them.
    pub fn passives(&self) -> Passives {
        Passives { fixed: self.roles.iter().map(|role| role.fixed_density()).collect() }
    }

    /// The map that makes tied elements equal, for use after a filter that treats them differently,
    /// such as one that is truncated at the ends of a column.
    pub fn means(&self) -> Means {
        Means { variables: self.clone() }
    }
}

/// Resets the densities of elements that are not designed; a [`DesignMap`] over all elements.
#[derive(Clone, Debug)]
pub struct Passives {
    fixed: Vec<Option<f64>>,
}

impl DesignMap for Passives {
    fn apply(&self, x: &[f64]) -> Vec<f64> {
        assert_eq!(x.len(), self.fixed.len(), "one density per element");
        self.fixed.iter().zip(x).map(|(fixed, &value)| fixed.unwrap_or(value)).collect()
    }

    fn pull_back(&self, _x: &[f64], d_phi: &[f64]) -> Vec<f64> {
        assert_eq!(d_phi.len(), self.fixed.len(), "one derivative per element");
        self.fixed.iter().zip(d_phi).map(|(fixed, &value)| if fixed.is_some() { 0.0 } else { value }).collect()
    }
}

/// Gives the elements that share a variable the mean of their densities; a [`DesignMap`] over all
/// elements. It is symmetric: each element counts alike.
#[derive(Clone, Debug)]
pub struct Means {
    variables: DesignVariables,
}

impl DesignMap for Means {
    fn apply(&self, x: &[f64]) -> Vec<f64> {
        let (variables, mut densities) = (&self.variables, x.to_vec());
        let mean = variables.mean(&densities.clone().into());
        variables.pairs().for_each(|(element, variable)| densities[element] = mean[variable]);
        densities
    }

    fn pull_back(&self, _x: &[f64], d_phi: &[f64]) -> Vec<f64> {
        self.apply(d_phi)
    }
}

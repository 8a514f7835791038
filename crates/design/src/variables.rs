//! The designed and the passive elements, and the initial design.

mod error;
mod links;

pub use error::DesignError;
pub use links::{Means, Passives};

use crate::ties::Ties;
use crate::values::{DomainValues, ElementValues, VariableValues};

/// The role of an element in the design.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Not in the design domain: full material, not part of the design volume.
    Outside,
    /// In the design domain, with a design variable, which it may share with others.
    Designed,
    /// In the design domain, always φ = 1.
    Solid,
    /// In the design domain, always φ = 0, so that only the minimum stiffness of the interpolation
    /// (86) remains.
    Void,
}

impl Role {
    /// The density of an element that has no variable.
    pub fn fixed_density(self) -> Option<f64> {
        match self {
            Self::Outside | Self::Solid => Some(1.0),
            Self::Void => Some(0.0),
            Self::Designed => None,
        }
    }
}

/// The maps between design variables, the design domain, and all elements.
///
/// Each designed element has its own variable, unless [ties](Self::tied) make elements share one.
#[derive(Clone, Debug)]
pub struct DesignVariables {
    roles: Vec<Role>,
    designed: Vec<u32>,
    domain: Vec<u32>,
    /// The variable of each designed element.
    variable: Vec<u32>,
    /// The first element of each variable.
    first: Vec<u32>,
    /// The number of elements of each variable.
    shared: Vec<u32>,
}

impl DesignVariables {
    /// `domain`: elements of the design domain of a mesh with `element_count` elements; `solid`,
    /// `void`: its passive elements. Lists may be in any order and may contain an element more than
    /// once.
    ///
    /// # Errors
    ///
    /// If an element is out of range, passive outside the domain, or both solid and void; or if the
    /// domain has no designed elements.
    pub fn new(element_count: usize, domain: &[u32], solid: &[u32], void: &[u32]) -> Result<Self, DesignError> {
        let mut roles = vec![Role::Outside; element_count];
        for &element in domain {
            let role = roles.get_mut(element as usize);
            *role.ok_or(DesignError::ElementOutOfRange { element, element_count })? = Role::Designed;
        }
        for (list, passive) in [(solid, Role::Solid), (void, Role::Void)] {
            for &element in list {
                match roles.get_mut(element as usize) {
                    None => {
                        return Err(DesignError::ElementOutOfRange { element, element_count });
                    }
                    Some(Role::Outside) => return Err(DesignError::PassiveOutside { element }),
                    Some(role) if *role != Role::Designed && *role != passive => {
                        return Err(DesignError::Contradiction { element });
                    }
                    Some(role) => *role = passive,
                }
            }
        }
        let elements_where = |wanted: fn(Role) -> bool| -> Vec<u32> {
            (0..element_count as u32).filter(|&element| wanted(roles[element as usize])).collect()
        };
        let designed = elements_where(|role| role == Role::Designed);
        let domain = elements_where(|role| role != Role::Outside);
        if designed.is_empty() {
            return Err(DesignError::Empty { domain: domain.len(), passive: domain.len() });
        }
        let (variable, shared) = ((0..designed.len() as u32).collect(), vec![1; designed.len()]);
        Ok(Self { roles, first: designed.clone(), designed, domain, variable, shared })
    }

    /// The same elements, of which those in a group of `ties` share one variable; `ties` are between
    /// positions in [`domain`](Self::domain). Passive elements keep their densities.
    ///
    /// # Panics
    ///
    /// If `ties` is not for as many elements as the domain has.
    pub fn tied(self, mut ties: Ties) -> Self {
        assert_eq!(ties.len(), self.domain.len(), "ties between the elements of the domain");
        let (mut of_group, mut variable) = (vec![None; ties.len()], Vec::with_capacity(self.designed.len()));
        let (mut first, mut shared): (Vec<u32>, Vec<u32>) = (Vec::new(), Vec::new());
        for (position, &element) in self.domain.iter().enumerate() {
            if self.roles[element as usize] != Role::Designed {
                continue;
            }
            let number = *of_group[ties.first(position)].get_or_insert_with(|| {
                first.push(element);
                shared.push(0);
                first.len() - 1
            });
            shared[number] += 1;
            variable.push(number as u32);
        }
        Self { variable, first, shared, ..self }
    }

    /// Number of design variables.
    pub fn count(&self) -> usize {
        self.first.len()
    }

    /// Whether some elements share a variable.
    pub fn is_tied(&self) -> bool {
        self.first.len() < self.designed.len()
    }

    /// Number of elements of the mesh.
    pub fn element_count(&self) -> usize {
        self.roles.len()
    }

    /// The role of every element.
    pub fn roles(&self) -> &[Role] {
        &self.roles
    }

    /// Designed elements in ascending order.
    pub fn designed(&self) -> &[u32] {
        &self.designed
    }

    /// The first element of each variable, in ascending order. Without ties, these are all designed
    /// elements.
    pub fn first_elements(&self) -> &[u32] {
        &self.first
    }

    /// The designed elements, each with its variable.
    fn pairs(&self) -> impl Iterator<Item = (usize, usize)> {
        self.designed.iter().zip(&self.variable).map(|(&element, &variable)| (element as usize, variable as usize))
    }

    /// Elements of the design domain, designed and passive, in ascending order.
    pub fn domain(&self) -> &[u32] {
        &self.domain
    }

    /// Densities of all elements: the variables of the designed ones, the fixed densities of
    /// [`Role`] elsewhere.
    ///
    /// # Panics
    ///
    /// If the number of variables is not [`count`](Self::count).
    pub fn densities(&self, x: &VariableValues) -> ElementValues {
        assert_eq!(x.len(), self.count(), "one value per variable");
        let mut densities: Vec<f64> = self.roles.iter().map(|role| role.fixed_density().unwrap_or(0.0)).collect();
        self.pairs().for_each(|(element, variable)| densities[element] = x[variable]);
        densities.into()
    }

    /// The sum of the entries of each variable's elements: the transpose of
    /// [`densities`](Self::densities), for derivatives.
    ///
    /// # Panics
    ///
    /// If there is not one entry per element.
    pub fn restrict(&self, all: &ElementValues) -> VariableValues {
        assert_eq!(all.len(), self.roles.len(), "one entry per element");
        let mut sums = vec![0.0; self.count()];
        self.pairs().for_each(|(element, variable)| sums[variable] += all[element]);
        sums.into()
    }

    /// The mean of the entries of each variable's elements: the inverse of
    /// [`densities`](Self::densities), to the last bit.
    ///
    /// # Panics
    ///
    /// If there is not one entry per element.
    pub fn mean(&self, all: &ElementValues) -> VariableValues {
        let mut mean = self.at_first(all);
        let from = mean.clone();
        for (element, variable) in self.pairs() {
            mean[variable] += (all[element] - from[variable]) / f64::from(self.shared[variable]);
        }
        mean
    }

    /// The entries of the first element of each variable.
    ///
    /// # Panics
    ///
    /// If there is not one entry per element.
    pub fn at_first(&self, all: &ElementValues) -> VariableValues {
        assert_eq!(all.len(), self.roles.len(), "one entry per element");
        self.first.iter().map(|&element| all[element as usize]).collect()
    }

    /// These entries at the first element of each variable, 0 elsewhere: the transpose of
    /// [`at_first`](Self::at_first).
    ///
    /// # Panics
    ///
    /// If the number of entries is not [`count`](Self::count).
    pub fn spread(&self, values: &VariableValues) -> ElementValues {
        spread(&self.first, values, self.roles.len())
    }

    /// These entries at the elements of the design domain, 0 elsewhere: the transpose of
    /// [`on_domain`](Self::on_domain).
    ///
    /// # Panics
    ///
    /// If there is not one entry per element of the domain.
    pub fn spread_domain(&self, values: &DomainValues) -> ElementValues {
        spread(&self.domain, values, self.roles.len())
    }

    /// The entries of the design domain.
    ///
    /// # Panics
    ///
    /// If there is not one entry per element.
    pub fn on_domain(&self, all: &ElementValues) -> DomainValues {
        assert_eq!(all.len(), self.roles.len(), "one entry per element");
        self.domain.iter().map(|&element| all[element as usize]).collect()
    }

    /// As [`restrict`](Self::restrict), for the entries of the design domain.
    ///
    /// # Panics
    ///
    /// If there is not one entry per element of the domain.
    pub fn restrict_domain(&self, values: &DomainValues) -> VariableValues {
        self.restrict(&self.spread_domain(values))
    }

    /// Volumes of the elements of the design domain. \[L³\]
    ///
    /// # Errors
    ///
    /// If there is not one volume per element, or a volume in the domain is not finite and
    /// positive.
    pub fn domain_volumes(&self, volumes: &[f64]) -> Result<DomainValues, DesignError> {
        if volumes.len() != self.roles.len() {
            return Err(DesignError::VolumeCount { expected: self.roles.len(), found: volumes.len() });
        }
        let volume = |&element: &u32| {
            let element = element as usize;
            let volume = volumes[element];
            let right = volume.is_finite() && volume > 0.0;
            if right { Ok(volume) } else { Err(DesignError::Volume { element, volume }) }
        };
        self.domain.iter().map(volume).collect::<Result<Vec<f64>, _>>().map(DomainValues::from)
    }

    /// Smallest and largest solid fraction of the design domain that the passive elements allow.
    ///
    /// # Errors
    ///
    /// As [`Self::domain_volumes`].
    pub fn fraction_range(&self, volumes: &[f64]) -> Result<(f64, f64), DesignError> {
        let volumes = self.domain_volumes(volumes)?;
        let volume_of = |role: Role| -> f64 {
            let of_role = |element: u32| self.roles[element as usize] == role;
            self.domain.iter().zip(&volumes).filter(|(element, _)| of_role(**element)).map(|(_, volume)| volume).sum()
        };
        let (designed, solid, void) = (volume_of(Role::Designed), volume_of(Role::Solid), volume_of(Role::Void));
        let all = designed + solid + void;
        Ok((solid / all, (solid + designed) / all))
    }

    /// Checks that a design with at most the solid fraction `limit` exists.
    ///
    /// # Errors
    ///
    /// [`DesignError::Fraction`] if the passive solid elements by themselves exceed it, and those
    /// of [`Self::domain_volumes`].
    pub fn check_limit(&self, volumes: &[f64], limit: f64) -> Result<(), DesignError> {
        let (smallest, largest) = self.fraction_range(volumes)?;
        if limit >= smallest { Ok(()) } else { Err(DesignError::Fraction { fraction: limit, smallest, largest }) }
    }

    /// Variables that are all equal to `value`.
    ///
    /// # Errors
    ///
    /// A value outside [0, 1].
    pub fn uniform(&self, value: f64) -> Result<VariableValues, DesignError> {
        if (0.0..=1.0).contains(&value) {
            Ok(vec![value; self.count()].into())
        } else {
            Err(DesignError::Initial { value })
        }
    }

    /// Equal variables for which the design domain, including passive elements, has the solid
    /// fraction `fraction`.
    ///
    /// # Errors
    ///
    /// [`DesignError::Fraction`] if the passive elements make this impossible, and those of
    /// [`Self::domain_volumes`].
    pub fn uniform_with_fraction(&self, volumes: &[f64], fraction: f64) -> Result<VariableValues, DesignError> {
        let (smallest, largest) = self.fraction_range(volumes)?;
        // `largest > smallest` holds: there is a designed element, and its volume is positive.
        let value = (fraction - smallest) / (largest - smallest);
        self.uniform(value).map_err(|_| DesignError::Fraction { fraction, smallest, largest })
    }
}

fn spread(elements: &[u32], values: &[f64], count: usize) -> ElementValues {
    assert_eq!(values.len(), elements.len(), "one entry per element of the list");
    let mut all = vec![0.0; count];
    for (&element, &value) in elements.iter().zip(values) {
        all[element as usize] = value;
    }
    all.into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::DesignMap;
    use crate::volume::VolumeConstraint;

    /// Elements 1 to 5 of seven are the domain; 2 is solid, 4 is void.
    fn example() -> DesignVariables {
        DesignVariables::new(7, &[5, 4, 3, 2, 1], &[2, 2], &[4]).unwrap()
    }

    const VOLUMES: [f64; 7] = [9.0, 1.0, 2.0, 3.0, 4.0, 10.0, 9.0];

    #[test]
    fn variables_to_elements_and_back() {
        let variables = example();
        assert_eq!(variables.designed(), [1, 3, 5]);
        assert_eq!(variables.domain(), [1, 2, 3, 4, 5]);
        assert_eq!((variables.count(), variables.element_count(), variables.roles().len()), (3, 7, 7));
        let x = [0.1, 0.3, 0.5].into();
        let densities = variables.densities(&x);
        assert_eq!(densities[..], [1.0, 0.1, 1.0, 0.3, 0.0, 0.5, 1.0]);
        assert_eq!(variables.restrict(&densities), x);
        assert_eq!(variables.on_domain(&densities)[..], [0.1, 1.0, 0.3, 0.0, 0.5]);
        assert_eq!(variables.restrict_domain(&variables.on_domain(&densities)), x);
        assert_eq!(variables.spread(&x)[..], [0.0, 0.1, 0.0, 0.3, 0.0, 0.5, 0.0]);
        assert_eq!(variables.spread_domain(&[1.0, 2.0, 3.0, 4.0, 5.0].into())[..], [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 0.0]);
        let blurred = [0.7; 7];
        assert_eq!(variables.passives().apply(&blurred), [1.0, 0.7, 1.0, 0.7, 0.0, 0.7, 1.0]);
        assert_eq!(variables.passives().pull_back(&blurred, &[2.0; 7]), [0.0, 2.0, 0.0, 2.0, 0.0, 2.0, 0.0]);
    }

    /// Elements 1, 2 and 5 share a variable, but 2 is solid; so do 3 and 4, but 4 is void.
    #[test]
    fn tied_elements_share_a_variable() {
        assert!(!example().is_tied());
        let mut ties = Ties::new(5);
        [(0, 1), (1, 4), (2, 3)].into_iter().for_each(|(a, b)| ties.join(a, b));
        let variables = example().tied(ties);
        assert!(variables.is_tied());
        assert_eq!(
            (variables.count(), variables.designed(), variables.first_elements()),
            (2, &[1, 3, 5][..], &[1, 3][..])
        );
        let x = [0.1, 0.3].into();
        let densities = variables.densities(&x);
        assert_eq!(densities[..], [1.0, 0.1, 1.0, 0.3, 0.0, 0.1, 1.0]);
        assert_eq!((variables.mean(&densities), variables.at_first(&densities)), (x.clone(), x.clone()));
        let derivatives = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0].into();
        assert_eq!(variables.restrict(&derivatives)[..], [34.0, 8.0]);
        assert_eq!(variables.mean(&derivatives)[..], [17.0, 8.0]);
        assert_eq!(variables.restrict_domain(&variables.on_domain(&derivatives))[..], [34.0, 8.0]);
        assert_eq!(variables.spread(&x)[..], [0.0, 0.1, 0.0, 0.3, 0.0, 0.0, 0.0]);
        let means = variables.means();
        assert_eq!(means.apply(&derivatives), [1.0, 17.0, 4.0, 8.0, 16.0, 17.0, 64.0]);
        assert_eq!(means.pull_back(&[0.0; 7], &derivatives), means.apply(&derivatives));
        assert_eq!(variables.uniform(0.5).unwrap().len(), 2);
    }

    #[test]
    fn initial_design_meets_the_fraction_with_passives() {
        let variables = example();
        // Solid 2 of 20, designed 14 of 20: 0.45 requires (9 − 2)/14 = 0.5.
        let x = variables.uniform_with_fraction(&VOLUMES, 0.45).unwrap();
        assert!(x.iter().all(|value| (value - 0.5).abs() < 1e-15));
        let constraint = VolumeConstraint::new(variables.domain_volumes(&VOLUMES).unwrap(), 0.45).unwrap();
        assert_eq!(constraint.design_volume(), 20.0);
        assert!(constraint.value(&variables.on_domain(&variables.densities(&x))).abs() < 1e-15);
        assert_eq!(variables.fraction_range(&VOLUMES).unwrap(), (0.1, 0.8));
        for fraction in [0.05, 0.9, f64::NAN] {
            let error = variables.uniform_with_fraction(&VOLUMES, fraction).unwrap_err();
            assert!(matches!(error, DesignError::Fraction { smallest: 0.1, largest: 0.8, .. }));
        }
        assert!(variables.check_limit(&VOLUMES, 0.1).is_ok());
        assert!(variables.check_limit(&VOLUMES, 0.95).is_ok());
        assert!(variables.check_limit(&VOLUMES, 0.09).is_err());
        assert!(variables.check_limit(&VOLUMES, f64::NAN).is_err());
    }

    #[test]
    fn errors_name_the_element() {
        let make =
            |domain: &[u32], solid: &[u32], void: &[u32]| DesignVariables::new(4, domain, solid, void).unwrap_err();
        assert_eq!(make(&[], &[], &[]), DesignError::Empty { domain: 0, passive: 0 });
        assert_eq!(make(&[1, 2], &[1], &[2]), DesignError::Empty { domain: 2, passive: 2 });
        assert_eq!(make(&[1, 2, 3], &[1, 3], &[2, 3]), DesignError::Contradiction { element: 3 });
        assert_eq!(make(&[1], &[0], &[]), DesignError::PassiveOutside { element: 0 });
        let out_of_range = DesignError::ElementOutOfRange { element: 4, element_count: 4 };
        assert_eq!(make(&[1, 4], &[], &[]), out_of_range);
        assert_eq!(make(&[1], &[], &[4]), out_of_range);

        let variables = example();
        assert_eq!(variables.uniform(1.5), Err(DesignError::Initial { value: 1.5 }));
        assert!(variables.uniform(f64::NAN).is_err());
        let few = variables.domain_volumes(&VOLUMES[..3]);
        assert_eq!(few, Err(DesignError::VolumeCount { expected: 7, found: 3 }));
        let mut flat = VOLUMES;
        flat[3] = 0.0;
        assert_eq!(variables.domain_volumes(&flat), Err(DesignError::Volume { element: 3, volume: 0.0 }));
        // An element outside the domain may have any volume.
        flat = VOLUMES;
        flat[0] = f64::NAN;
        assert!(variables.domain_volumes(&flat).is_ok());
    }
}

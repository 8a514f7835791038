//! What the elements of a state have that quantities can read: the one list of it.
//!
//! New data are a field of [`ElementData`] and a row of [`ElementData::LISTS`]. What remains is how
//! they follow from a state, and their pull-back (`model/src/analysis/chain.rs`). [`Reads`](super::Reads),
//! [`StateView`](super::StateView), [`StateDerivative`](super::StateDerivative), the checks of derivatives and the
//! Python package go through this list.

use super::STRESS_POINTS;

/// One entry for each kind of data of the elements: lists of numbers, their derivatives, or whether they are read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ElementData<T> {
    /// Strain energies. \[F L\]
    pub energy: T,
    /// Von Mises stresses of the solid material at the Gauss points; 0 for entries without a point. \[F/L²\]
    pub stress: T,
    /// Plastic work since rest; 0 for elastic elements, and empty without elements with memory. \[F L\]
    pub plastic_work: T,
    /// Equivalent plastic strains at the Gauss points, as for `stress`; 0 in elastic elements.
    pub plastic_strain: T,
}

/// A kind of data of the elements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ElementList {
    /// The field's name, also in Python.
    pub name: &'static str,
    /// In messages.
    pub words: &'static str,
    /// Numbers per element.
    pub width: usize,
    /// A usual size of the numbers, for the checks of derivatives at invented states.
    pub size: f64,
}

impl<T> ElementData<T> {
    /// All kinds, in the order of the fields.
    pub const LISTS: [ElementList; 4] = [
        ElementList { name: "energy", words: "strain energies", width: 1, size: 1.0 },
        ElementList { name: "stress", words: "stresses", width: STRESS_POINTS, size: 1.0 },
        ElementList { name: "plastic_work", words: "plastic work", width: 1, size: 1.0 },
        ElementList { name: "plastic_strain", words: "plastic strains", width: STRESS_POINTS, size: 0.1 },
    ];

    /// From one entry for each kind, in their order.
    pub fn of([energy, stress, plastic_work, plastic_strain]: [T; 4]) -> Self {
        Self { energy, stress, plastic_work, plastic_strain }
    }

    /// All entries, in the order of the kinds.
    pub fn each(&self) -> [&T; 4] {
        [&self.energy, &self.stress, &self.plastic_work, &self.plastic_strain]
    }

    /// All entries, to be changed.
    pub fn each_mut(&mut self) -> [&mut T; 4] {
        [&mut self.energy, &mut self.stress, &mut self.plastic_work, &mut self.plastic_strain]
    }

    /// The same function of every entry.
    pub fn map<'a, S>(&'a self, of: impl FnMut(&'a T) -> S) -> ElementData<S> {
        ElementData::of(self.each().map(of))
    }

    /// The entry with this name.
    pub fn named(&mut self, name: &str) -> Option<&mut T> {
        self.each_mut().into_iter().zip(Self::LISTS).find(|(_, list)| list.name == name).map(|(entry, _)| entry)
    }
}

impl ElementData<bool> {
    /// Whether any is read.
    pub fn any(&self) -> bool {
        self.each().into_iter().any(|read| *read)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every field under its own name, in the order of the list.
    #[test]
    fn names_are_those_of_the_fields() {
        let mut data = ElementData::of([0, 1, 2, 3]);
        assert_eq!([data.energy, data.stress, data.plastic_work, data.plastic_strain], [0, 1, 2, 3]);
        for (number, list) in (0..).zip(ElementData::<i32>::LISTS) {
            assert_eq!(data.named(list.name), Some(&mut { number }));
            // Debug prints the names of the fields
            let printed = format!("{data:?}");
            assert!(printed.contains(&format!("{}: {number}", list.name)), "{printed}");
        }
        assert_eq!(data.named("strain"), None);
    }
}

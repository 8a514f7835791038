//! Compares the derivatives of a quantity with differences, at invented states of the model.

use super::Analysis;
use crate::equations::ContactModel;
use slipstick_design::ContactStatus;
use slipstick_design::quantity::{
    ContactNode, ElementData, PreviousView, Quantity, StateView, WrongDerivative, check_derivatives,
};

impl Analysis {
    /// Compares a quantity's derivatives with differences of its values, at every load step: at
    /// small random displacements of all nodes, the internal forces of the bodies there (density as
    /// set), and made-up contact and reactions.
    ///
    /// # Errors
    /// The first wrong derivative.
    pub fn check_quantity(&self, quantity: &dyn Quantity) -> Result<(), WrongDerivative> {
        let (displacement, internal_force) = self.some_state();
        let steps = self.times.len();
        // of a load case
        let each = (steps / self.cases.count()).max(1);
        let model = self.model();
        let n = displacement.len();
        let reads = quantity.reads();
        // spread by the golden ratio, so that no two entries are alike
        let spread = |i: usize| (0.618_033_988_749_894_9 * (i + 1) as f64).fract() + 0.5;
        let contact = if reads.contact { some_contact(model, spread) } else { Vec::new() };
        let supported = model.prescribed().ever_supported();
        let reaction = |i: usize| if supported[i] { spread(i) - 1.0 } else { 0.0 };
        let reaction: Vec<f64> = if reads.reaction { (0..n).map(reaction).collect() } else { Vec::new() };
        let elements = model.solid().elements();
        let mut lists = ElementData::<f64>::LISTS.into_iter();
        let of_elements = reads.elements.map(|read| {
            let list = lists.next().filter(|_| *read);
            list.map_or_else(Vec::new, |list| (0..list.width * elements).map(|i| list.size * spread(i)).collect())
        });
        let before: Vec<f64> = displacement.iter().enumerate().map(|(i, d)| spread(3 * i) * d).collect();
        let loads: Vec<f64> = (0..n).map(|i| spread(5 * i) - 1.0).collect();
        let supports: Vec<f64> = reaction.iter().map(|force| 0.5 * force).collect();
        let multiplier = |j: usize| [spread(7 * j), spread(7 * j + 1) - 1.0, spread(7 * j + 2) - 1.0];
        let multipliers: Vec<[f64; 3]> = (0..contact.len()).map(|j| multiplier(j + 1)).collect();
        let previous = PreviousView {
            displacement: &before,
            external_force: &loads,
            reaction: &supports,
            multiplier: &multipliers,
        };
        let previous = if reads.previous { previous } else { PreviousView::default() };
        for (step, &time) in (1..=steps).zip(&self.times) {
            let mut external_force = vec![0.0; n];
            self.design.external_force(&displacement, time, &mut external_force);
            let state = StateView {
                step: (step - 1) % each + 1,
                steps: each,
                time: time.on_axis(),
                displacement: &displacement,
                internal_force: &internal_force,
                external_force: &external_force,
                reaction: &reaction,
                contact: &contact,
                density: self.design.density(),
                elements: of_elements.map(Vec::as_slice),
                previous,
            };
            check_derivatives(quantity, &state)?;
        }
        Ok(())
    }

    /// Displacements of all nodes that are small compared to the elements, and the internal forces
    /// there.
    fn some_state(&self) -> (Vec<f64>, Vec<f64>) {
        let n = self.model().prescribed().fixed().len();
        let size = self.model().smallest_element().cbrt();
        let mut force = vec![0.0; n];
        let mut amplitude = 1e-2 * size;
        loop {
            // spread by the golden ratio, so that no two entries are alike
            let spread = |i: usize| (0.618_033_988_749_894_9 * (i + 1) as f64).fract() - 0.5;
            let displacement: Vec<f64> = (0..n).map(|i| amplitude * spread(i)).collect();
            // at rest no element is inverted, so this loop ends
            if self.design.internal_force(&displacement, (0.0.into(), &[]), &mut force).is_ok() {
                return (displacement, force);
            }
            amplitude *= 0.1;
        }
    }
}

/// Slave nodes with invented data of arbitrary size, for the check of a quantity's derivatives.
fn some_contact(model: &ContactModel, spread: impl Fn(usize) -> f64) -> Vec<ContactNode> {
    let pairs = model.interfaces().iter().enumerate();
    let nodes =
        pairs.flat_map(|(pair, model)| model.interface.slave_nodes().iter().map(move |slave| (pair, slave.node)));
    let of = |(j, (pair, node)): (usize, (usize, u32))| ContactNode {
        node,
        pair: pair as u32,
        status: ContactStatus::Slip,
        multiplier: [spread(7 * j), spread(7 * j + 1) - 1.0, spread(7 * j + 2) - 1.0],
        vector: [spread(7 * j + 3) - 1.0, spread(7 * j + 4), spread(7 * j + 5) - 1.0],
        gap: 0.1 * spread(7 * j + 6),
        slip: [spread(5 * j) - 1.0, spread(5 * j + 1) - 1.0],
        area: 0.8 * spread(5 * j + 2),
        reference_area: 1.0,
        follows_pressure: true,
        friction_ratio: 1.0,
    };
    nodes.enumerate().map(of).collect()
}

//! The work of changes of temperature.

use crate::equations::{Design, inverted};
use slipstick_path::{LoadTime, StateError, StepState};
use slipstick_solid::ElementScaling;

impl Design {
    /// ∂W/∂θ of every element at a state, with its stretch θ of free expansion, at fixed displacements and
    /// history; complete on every rank, empty without changes of temperature. With the strain energies W,
    ///
    /// ```text
    /// ∂W/∂θ = (3 W − f·x)/θ,   for small strains −f·X
    /// ```
    ///
    /// Test: `thermal_work_is_stored` (tests/suite/temperature.rs).
    pub(crate) fn energies_by_stretch(
        &self,
        (time, state): (LoadTime, &StepState),
        energies: &[f64],
    ) -> Result<Vec<f64>, StateError> {
        let model = &*self.model;
        if !model.has_temperatures() {
            return Ok(Vec::new());
        }
        let (d, stretches) = (&state.unknowns[..model.displacement_count()], model.stretches(time));
        let step = self.solid_step(model.solid_history(state), &stretches);
        // forces are proportional to the factor
        let of = |scaling: &ElementScaling| ElementScaling { factor: scaling.factor, ..ElementScaling::NONE };
        let whole: Vec<ElementScaling> = self.scalings.iter().map(of).collect();
        let along = |places: &[f64]| {
            let mut products = vec![0.0; stretches.len()];
            model.share.add(&mut products, |out| {
                model.solid.pull_back_density(d, step, &whole, places, out).map_err(inverted)
            })?;
            Ok(products)
        };
        let (current, reference) = (along(&model.positions(d))?, along(&model.coordinates)?);
        let of = |e: usize| match model.solid.material(e).small_strains() {
            true => -reference[e],
            false => (3.0 * energies[e] - current[e]) / stretches[e],
        };
        Ok((0..stretches.len()).map(of).collect())
    }
}

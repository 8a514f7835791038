//! Derivatives with respect to coefficients of thermal expansion and to changes of temperature.
//!
//! Both enter only through the stretch θ = 1 + α ΔT of each element. An integral over an element is θ^m times a
//! function of v = (u − (θ − 1) X)/θ (see `solid/src/heat.rs`). With ∂v/∂θ = −x/θ², x = X + u, and ∂v/∂u = 1/θ,
//!
//! ```text
//! ds/dθ = (m s − ∂s/∂u · x)/θ,   for small strains −∂s/∂u · X
//! ```
//!
//! with m = 2 for forces, 3 for energies, and 0 for stresses and history. The products are linear in factors on
//! the elements, so the derivative with respect to a parameter p is one product, weighted by (∂θ/∂p)/θ.

use super::{ContactModel, Design, inverted};
use slipstick_design::quantity::StateView;
use slipstick_path::{LoadTime, StateError, StepState};
use slipstick_solid::stress::STRESS_POINTS;
use slipstick_solid::{ElementScaling, SolidStep};

/// Elements of one kind of strains, with which their derivatives are taken.
struct Group<'a> {
    /// x, or X for small strains.
    places: &'a [f64],
    /// (∂θ/∂p)/θ of each element, ∂θ/∂p for small strains; 0 for elements of the other kind.
    weights: Vec<f64>,
    /// Whether energies and forces depend on θ in other ways than through v.
    large: bool,
}

impl ContactModel {
    /// ∂θ/∂p of every element for the parameters that have an effect at a pseudo-time, with the places of these
    /// parameters in the list of all.
    fn stretch_slopes(&self, time: LoadTime) -> Vec<(usize, Vec<f64>)> {
        let alpha = |e: usize| self.solid.thermal_expansion(e);
        let changes = self.temperatures.of_elements(time);
        let first = self.load_parameters().end;
        let expansions = self.bodies.iter().enumerate().filter_map(|(body, elements)| {
            let own = Some(self.expansion_of(body)).filter(|own| *own != 0.0)?;
            let of = |(e, change): (usize, &f64)| if elements.contains(&e) { change * alpha(e) / own } else { 0.0 };
            Some((first + body, changes.iter().enumerate().map(of).collect()))
        });
        let first = first + self.bodies.len();
        let factors = self.temperatures.factors(time).into_iter().enumerate();
        let temperatures = factors.zip(self.temperatures.changes()).map(|((change, factor), of_elements)| {
            let slopes = of_elements.iter().enumerate().map(|(e, change)| alpha(e) * factor * change).collect();
            (first + change, slopes)
        });
        let acts = |(_, slopes): &(usize, Vec<f64>)| slopes.iter().any(|slope| *slope != 0.0);
        expansions.chain(temperatures).filter(acts).collect()
    }

    /// The elements of both kinds of strains, with positions `x`.
    fn groups<'a>(&'a self, x: &'a [f64], stretches: &[f64], slopes: &[f64]) -> Vec<Group<'a>> {
        let group = |large: bool| {
            let of = |(e, slope): (usize, &f64)| match (large, self.solid.material(e).small_strains()) {
                (true, false) => slope / stretches[e],
                (false, true) => *slope,
                _ => 0.0,
            };
            let weights: Vec<f64> = slopes.iter().enumerate().map(of).collect();
            let places = if large { x } else { &self.coordinates };
            weights.iter().any(|weight| *weight != 0.0).then_some(Group { places, weights, large })
        };
        [true, false].into_iter().filter_map(group).collect()
    }
}

impl Design {
    /// Adds λᵀ ∂f_int/∂p + (∂G/∂p)ᵀ η of coefficients of thermal expansion and of temperatures, as far as this rank
    /// contributes; without the second term if η is empty. Test: `every_input_is_pulled_back`
    /// (tests/suite/inputs.rs).
    pub(super) fn pull_back_own_expansion(
        &self,
        (d, time): (&[f64], LoadTime),
        step: SolidStep<'_>,
        lambda: &[f64],
        eta: &[f64],
        out: &mut [f64],
    ) -> Result<(), StateError> {
        let model = &*self.model;
        if !model.has_temperatures() {
            return Ok(());
        }
        let (solid, lambda) = (&model.solid, &lambda[..model.displacement_count()]);
        // forces are proportional to the factor
        let whole = |s: &ElementScaling| ElementScaling { factor: s.factor, ..ElementScaling::NONE };
        let whole: Vec<ElementScaling> = self.scalings.iter().map(whole).collect();
        let mut works = vec![0.0; solid.elements()];
        solid.pull_back_density(d, step, &whole, lambda, &mut works).map_err(inverted)?;
        let x = model.positions(d);
        for (parameter, slopes) in model.stretch_slopes(time) {
            for Group { places, weights, large } in model.groups(&x, step.stretches, &slopes) {
                if large {
                    out[parameter] += 2.0 * dot(&weights, &works);
                }
                let weighted =
                    |(s, weight): (&ElementScaling, &f64)| ElementScaling { factor: weight * s.factor, ..*s };
                let scalings: Vec<ElementScaling> = self.scalings.iter().zip(&weights).map(weighted).collect();
                let mut product = vec![0.0; d.len()];
                let step = SolidStep { scalings: &scalings, ..step };
                solid.add_tangent_product(d, step, places, &mut product).map_err(inverted)?;
                out[parameter] -= dot(lambda, &product);
                if model.has_memory() && !eta.is_empty() {
                    let step = SolidStep { scalings: &self.scalings, ..step };
                    let eta = solid.weighted_history(&eta[model.history.solid.clone()], &weights);
                    let mut by_current = vec![0.0; d.len()];
                    solid.pull_back_current(d, step, &eta, &mut by_current).map_err(inverted)?;
                    out[parameter] -= dot(places, &by_current);
                }
            }
        }
        Ok(())
    }

    /// Adds the derivatives of Σ_e (w_e W_e + v_e W_p,e), with the strain energies W and the plastic work W_p at
    /// a state, at fixed displacements and history. Test: `derivatives_of_all_quantities_match_differences`
    /// (tests/suite/heated.rs).
    ///
    /// # Errors
    /// If elements are inverted.
    pub(crate) fn pull_back_energies_by_expansion(
        &self,
        (time, state): (LoadTime, &StepState),
        view: &StateView<'_>,
        [elastic, plastic]: [&[f64]; 2],
        out: &mut [f64],
    ) -> Result<(), StateError> {
        let model = &*self.model;
        if !model.has_temperatures() {
            return Ok(());
        }
        let (stretches, mut by_stretch) = (model.stretches(time), vec![0.0; self.scalings.len()]);
        if elastic.iter().any(|weight| *weight != 0.0) {
            let energies = self.energies_by_stretch((time, state), view.elements.energy)?;
            by_stretch.iter_mut().zip(energies).zip(elastic).for_each(|((to, energy), weight)| *to += weight * energy);
        }
        for (e, weight) in plastic.iter().enumerate().filter(|(_, weight)| **weight != 0.0) {
            if !model.solid.material(e).small_strains() {
                by_stretch[e] += weight * 3.0 * view.elements.plastic_work[e] / stretches[e];
            }
        }
        for (parameter, slopes) in model.stretch_slopes(time) {
            out[parameter] += dot(&by_stretch, &slopes);
        }
        Ok(())
    }

    /// Adds the derivatives of a function of the stresses at a state with these slopes, at fixed displacements and
    /// history. Test: `derivatives_of_all_quantities_match_differences` (tests/suite/heated.rs).
    pub(crate) fn pull_back_stresses_by_expansion(
        &self,
        (time, state): (LoadTime, &StepState),
        by_stress: &[f64],
        out: &mut [f64],
    ) {
        let model = &*self.model;
        if !model.has_temperatures() {
            return;
        }
        let (d, stretches) = (&state.unknowns[..model.displacement_count()], model.stretches(time));
        let x = model.positions(d);
        let step = self.solid_step(model.solid_history(state), &stretches);
        for (parameter, slopes) in model.stretch_slopes(time) {
            for Group { places, weights, .. } in model.groups(&x, &stretches, &slopes) {
                let of = |(point, slope): (usize, &f64)| slope * weights[point / STRESS_POINTS];
                let weighted: Vec<f64> = by_stress.iter().enumerate().map(of).collect();
                let (mut force, mut history) = (vec![0.0; d.len()], vec![0.0; model.history.solid.len()]);
                let mut by_density = vec![0.0; self.scalings.len()];
                let into = (&mut force[..], &mut history[..]);
                let slopes = (step, self.scaling_slopes());
                model.solid.pull_back_stresses(d, slopes, &weighted, into, &mut by_density);
                model.share.sum(&mut [&mut force]);
                out[parameter] -= dot(places, &force);
            }
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

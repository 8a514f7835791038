//! The quantities that the density determines: the stiffness of every element, and the resulting
//! stiffness at the contact.

use super::enforcement::{Enforcement, GivenStiffness, Method, TANGENTIAL_COMPLEMENTARITY};
use super::terms::TermState;
use super::{ContactModel, LEAST_SHARE, SlaveData, Workspace, inverted};
use slipstick_contact::enforcement::{Stiffness, StiffnessScaling};
use slipstick_design::ElementValues;
use slipstick_path::{Evaluator, HistoryUpdate, LoadTime, StateError};
use slipstick_solid::{ElementScaling, SolidStep};
use std::sync::Arc;

/// A model with the density of every element. Its steps are those of
/// [`StepProblem`](slipstick_path::StepProblem).
#[derive(Debug, Clone)]
pub struct Design {
    pub(super) model: Arc<ContactModel>,
    density: ElementValues,
    pub(super) scalings: Vec<ElementScaling>,
    slopes: Vec<ElementScaling>,
    /// Mass of every element per reference volume, and its derivative with respect to the density; empty
    /// unless a load acts on mass. \[M/L³\]
    pub(super) masses: Vec<f64>,
    pub(super) mass_slopes: Vec<f64>,
    /// The bodies' own stiffness at each slave node: E_eff/h. \[F/L³\]
    local_stiffness: Vec<f64>,
    /// ε or c of each slave node.
    pub(super) stiffness: Vec<Stiffness>,
}

impl Design {
    /// A model with the density of every element, 1 outside the design. Values are not clamped; the
    /// caller keeps them in [0, 1].
    ///
    /// # Panics
    /// If there is not one density for each element.
    pub fn new(model: Arc<ContactModel>, density: &ElementValues) -> Self {
        assert_eq!(density.len(), model.solid.elements(), "one density for each element");
        let (scalings, slopes) = model.scale(density);
        let local_stiffness = model.local_stiffness(&scalings);
        let stiffness = model.node_stiffness(&local_stiffness);
        let (masses, mass_slopes) = model.masses(density);
        Self { model, density: density.clone(), scalings, slopes, masses, mass_slopes, local_stiffness, stiffness }
    }

    /// The same densities in the model as modified by `change`.
    pub(crate) fn of_changed_model(&mut self, change: impl FnOnce(&mut ContactModel)) {
        change(Arc::make_mut(&mut self.model));
    }

    /// Computes the history at the end of a step again; `None` without histories.
    pub(crate) fn history_update(&self) -> Option<Arc<dyn HistoryUpdate>> {
        let evaluator = || Evaluator::new(self.clone(), Workspace::default());
        (self.model.unknowns.history > 0).then(|| Arc::new(evaluator()) as _)
    }

    /// The data that do not depend on the density.
    pub fn model(&self) -> &Arc<ContactModel> {
        &self.model
    }

    /// The density of every element.
    pub fn density(&self) -> &ElementValues {
        &self.density
    }

    /// The scaling of every element by its density.
    pub fn scalings(&self) -> &[ElementScaling] {
        &self.scalings
    }

    /// Derivatives of [`scalings`](Self::scalings) with respect to the element's density: zero
    /// outside the design.
    pub fn scaling_slopes(&self) -> &[ElementScaling] {
        &self.slopes
    }

    /// A multiple of the bodies' own stiffness at slave node j.
    pub(super) fn own_stiffness(&self, j: usize, factor: f64) -> Stiffness {
        let both = factor * self.local_stiffness[j];
        Stiffness { normal: both, tangential: both, scaling: StiffnessScaling::Area }
    }

    /// Internal force at displacements `d` and a pseudo-time, springs included, with the history of elements with
    /// memory at the start of the step (or at its end: the result is the same). \[F\]
    ///
    /// # Errors
    /// If elements are inverted.
    pub fn internal_force(
        &self,
        d: &[f64],
        (time, history): (LoadTime, &[f64]),
        out: &mut [f64],
    ) -> Result<(), StateError> {
        let stretches = self.model.stretches(time);
        let solid = self.solid_step(history, &stretches);
        let result = self.model.solid.internal_force(d, solid, out).map_err(inverted);
        self.model.share.agree(result)?;
        TermState { design: self, time, y: d, step: None }.add_forces(true, out);
        self.model.share.sum(&mut [out]);
        Ok(())
    }

    /// Strain energy and plastic work of each element at displacements `d`, a pseudo-time and the history
    /// there, complete on every rank. \[F L\]
    ///
    /// # Errors
    /// If elements are inverted.
    pub fn energies(&self, d: &[f64], (time, history): (LoadTime, &[f64])) -> Result<[Vec<f64>; 2], StateError> {
        let stretches = self.model.stretches(time);
        let found = self.model.solid.elastic_and_plastic(d, self.solid_step(history, &stretches)).map_err(inverted);
        let (mut elastic, mut plastic): (Vec<f64>, Vec<f64>) =
            self.model.share.agree(found)?.into_iter().map(|of| (of.elastic, of.plastic)).unzip();
        self.model.share.sum(&mut [&mut elastic, &mut plastic]);
        Ok([elastic, plastic])
    }

    /// Adds K v with K = ∂f_int/∂d, which is symmetric.
    ///
    /// # Errors
    /// If elements are inverted.
    pub fn add_internal_tangent_product(
        &self,
        d: &[f64],
        (time, history): (LoadTime, &[f64]),
        v: &[f64],
        out: &mut [f64],
    ) -> Result<(), StateError> {
        let stretches = self.model.stretches(time);
        let (solid, step) = (&self.model.solid, self.solid_step(history, &stretches));
        self.model.share.add(out, |out| {
            self.model.add_spring_tangent_product(d, v, out);
            solid.add_tangent_product(d, step, v, out).map_err(inverted)
        })
    }

    /// Adds λᵀ ∂f_int/∂φ of every element.
    ///
    /// # Errors
    /// If elements are inverted.
    pub fn pull_back_density(
        &self,
        d: &[f64],
        (time, history): (LoadTime, &[f64]),
        lambda: &[f64],
        out: &mut [f64],
    ) -> Result<(), StateError> {
        let stretches = self.model.stretches(time);
        self.pull_back_own_density(d, self.solid_step(history, &stretches), lambda, out)
    }

    /// The same in a known step.
    pub(super) fn pull_back_own_density(
        &self,
        d: &[f64],
        step: SolidStep<'_>,
        lambda: &[f64],
        out: &mut [f64],
    ) -> Result<(), StateError> {
        let (solid, slopes) = (&self.model.solid, &self.slopes);
        self.model.share.add(out, |out| solid.pull_back_density(d, step, slopes, lambda, out).map_err(inverted))
    }

    /// Adds λᵀ ∂f_int/∂p of moduli, coefficients of thermal expansion and temperatures. Test:
    /// `every_input_is_pulled_back` (tests/suite/inputs.rs).
    ///
    /// # Errors
    /// If elements are inverted.
    pub fn pull_back_solid_parameters(
        &self,
        d: &[f64],
        (time, history): (LoadTime, &[f64]),
        lambda: &[f64],
        out: &mut [f64],
    ) -> Result<(), StateError> {
        let stretches = self.model.stretches(time);
        let step = self.solid_step(history, &stretches);
        self.model.share.add(out, |out| self.pull_back_own_solid_parameters((d, time), step, lambda, &[], out))
    }

    /// The contribution of this rank, with (∂G/∂p)ᵀ η unless η is empty.
    pub(super) fn pull_back_own_solid_parameters(
        &self,
        (d, time): (&[f64], LoadTime),
        step: SolidStep<'_>,
        lambda: &[f64],
        eta: &[f64],
        out: &mut [f64],
    ) -> Result<(), StateError> {
        self.pull_back_own_moduli(d, step, lambda, eta, out)?;
        self.pull_back_own_expansion((d, time), step, lambda, eta, out)
    }

    /// The contribution of this rank, with (∂G/∂E)ᵀ η unless η is empty.
    pub(super) fn pull_back_own_moduli(
        &self,
        d: &[f64],
        step: SolidStep<'_>,
        lambda: &[f64],
        eta: &[f64],
        out: &mut [f64],
    ) -> Result<(), StateError> {
        let model = &*self.model;
        // E scales the stiffness, but not the strength, which is relative to it
        let whole =
            |s: &ElementScaling| ElementScaling { factor: s.factor, strength: -s.strength, ..ElementScaling::NONE };
        let whole: Vec<ElementScaling> = self.scalings.iter().map(whole).collect();
        let mut works = vec![0.0; model.solid.elements()];
        let lambda = &lambda[..model.displacement_count()];
        model.solid.pull_back_density(d, step, &whole, lambda, &mut works).map_err(inverted)?;
        if model.has_memory() && !eta.is_empty() {
            let eta = &eta[model.history.solid.clone()];
            model.solid.pull_back_history_density(d, step, &whole, eta, &mut works).map_err(inverted)?;
        }
        let first = model.interfaces.len();
        for (body, elements) in model.bodies.iter().enumerate() {
            out[first + body] += works[elements.clone()].iter().sum::<f64>() / model.modulus_of(body);
        }
        Ok(())
    }
}

impl ContactModel {
    /// Scaling of every element by its density, and its derivative: zero outside the design.
    pub(super) fn scale(&self, density: &[f64]) -> (Vec<ElementScaling>, Vec<ElementScaling>) {
        let none = ElementScaling::NONE;
        let of = |(&density, &designed): (&f64, &bool)| match designed {
            true => {
                (self.penalization.interpolation.scaling(density), self.penalization.interpolation.derivative(density))
            }
            false => (ElementScaling::SOLID, none),
        };
        density.iter().zip(&self.penalization.designed).map(of).unzip()
    }

    /// Mass of every element per reference volume, and its derivative with respect to the density.
    fn masses(&self, density: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let of = |((&solid, &density), &designed): ((&f64, &f64), &bool)| match designed {
            true => self.penalization.interpolation.mass(density).map(|relative| solid * relative).into(),
            false => (solid, 0.0),
        };
        self.mass_densities.iter().zip(density).zip(&self.penalization.designed).map(of).unzip()
    }

    /// The bodies' own stiffness at each slave node, with these scalings: moduli of both sides in
    /// series over the facet size. \[F/L³\]
    pub(super) fn local_stiffness(&self, scalings: &[ElementScaling]) -> Vec<f64> {
        let modulus =
            |elements: &[u32]| elements.iter().map(|&e| self.modulus(e, scalings)).sum::<f64>() / elements.len() as f64;
        let master: Vec<f64> = self.contact_elements.of_masters.iter().map(|m| modulus(m)).collect();
        let of = |(slave, elements): (&SlaveData, &Vec<u32>)| {
            let (s, m) = (modulus(elements), master[slave.interface as usize]);
            in_series(s, m).0 / slave.size
        };
        self.slaves.iter().zip(&self.contact_elements.of_slaves).map(of).collect()
    }

    /// Young's modulus of an element with these scalings; infinite if it is rigid. \[F/L²\]
    pub(crate) fn modulus(&self, element: u32, scalings: &[ElementScaling]) -> f64 {
        let element = element as usize;
        if self.dependent.rigid.has_element(element) {
            return f64::INFINITY;
        }
        scalings[element].factor * self.solid.material(element).youngs_modulus()
    }

    /// ε or c of every slave node, as given or from the bodies' own stiffness: that of the present
    /// design, or for the penalty method that of the start design.
    fn node_stiffness(&self, local_stiffness: &[f64]) -> Vec<Stiffness> {
        let of = |(j, slave): (usize, &SlaveData)| {
            let Enforcement { method, stiffness } = self.interfaces[slave.interface as usize].enforcement;
            let local = if method == Method::Penalty { self.start.local_stiffness[j] } else { local_stiffness[j] };
            match stiffness {
                // the weighted measures of the modelled half are half of those of the whole body
                GivenStiffness::Absolute(Stiffness { normal, tangential, scaling: StiffnessScaling::Weighted }) => {
                    Stiffness {
                        normal: normal * slave.images,
                        tangential: tangential * slave.images,
                        scaling: StiffnessScaling::Weighted,
                    }
                }
                GivenStiffness::Absolute(stiffness) => stiffness,
                GivenStiffness::Relative { factor, scaling } => {
                    let both = match scaling {
                        StiffnessScaling::Area | StiffnessScaling::ReferenceArea => factor * local,
                        StiffnessScaling::Weighted => factor * local / slave.area,
                    };
                    let ratio = if method == Method::Lagrange { TANGENTIAL_COMPLEMENTARITY } else { 1.0 };
                    Stiffness { normal: both, tangential: ratio * both, scaling }
                }
            }
        };
        self.slaves.iter().enumerate().map(of).collect()
    }
}

/// Modulus of two sides that deform in series, and its logarithmic derivatives with respect to theirs.
/// With φ_min = 0 and φ = 0 it would be zero; it is at least a fraction of the stiffer side's, unless
/// this side is rigid.
pub(super) fn in_series(s: f64, m: f64) -> (f64, [f64; 2]) {
    if s.max(m).is_infinite() {
        return (s.min(m), if s < m { [1.0, 0.0] } else { [0.0, 1.0] });
    }
    let (series, least) = (s * m / (s + m), LEAST_SHARE * s.max(m));
    if series >= least {
        return (series, [m / (s + m), s / (s + m)]);
    }
    (least, if s > m { [1.0, 0.0] } else { [0.0, 1.0] })
}

//! Fields of the bodies at a state: deformation, stress and energy of every element, and reactions.

use crate::equations::{ContactResults, Design};
use slipstick_mesh::Mesh;
use slipstick_path::{LoadTime, StepState};
use slipstick_solid::stress::{stress_points, von_mises};
use std::borrow::Cow;

/// Fields of the bodies at a state, for output.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ElementFields {
    /// Smallest J of every element, regardless of its scaling.
    pub determinants: Vec<f64>,
    /// Cauchy stress of every element, the mean over its Gauss points: xx, yy, zz, xy, yz, xz.
    /// Scaled by the density, as in equilibrium; of interpolated energies, only the part with
    /// finite strains. Empty if an element is inverted. \[F/L²\]
    pub stress: Vec<f64>,
    /// Largest von Mises stress among the Gauss points of every element, scaled likewise. Empty
    /// likewise. \[F/L²\]
    pub von_mises: Vec<f64>,
    /// Strain energy of every element over its reference volume. Empty likewise. \[F/L²\]
    pub energy_density: Vec<f64>,
    /// Equivalent plastic strain of every element, the largest among its Gauss points. Empty without
    /// elements with memory.
    pub plastic_strain: Vec<f64>,
    /// Forces of supports and prescribed motions, three per node; zero where nothing is prescribed.
    /// Empty likewise. \[F\]
    pub reaction: Vec<f64>,
}

/// What is known of a state before its fields are computed. What is empty is not known.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StateResults {
    /// Contact results. Without them, reactions lack the forces of contact.
    pub contact: ContactResults,
    /// Internal forces, three per node. \[F\]
    pub internal_force: Vec<f64>,
    /// Strain energies of all elements. \[F L\]
    pub energies: Vec<f64>,
}

impl Design {
    /// Fields of the bodies at a state and its pseudo-time; any rank may call it without the others.
    ///
    /// Test: `fields_of_a_bar` (tests/suite/quantities.rs).
    pub fn element_fields(
        &self,
        mesh: &Mesh,
        state: &StepState,
        time: LoadTime,
        known: &StateResults,
    ) -> ElementFields {
        let model = &*self.model;
        let d = &state.unknowns[..model.displacement_count()];
        let stretches = model.stretches(time);
        let step = self.solid_step(model.solid_history(state), &stretches);
        let solid = model.whole_solid(mesh);
        let (mut determinants, volumes) = (solid.smallest_determinants(d), solid.element_volumes());
        // rigid elements have no part in the solid
        determinants.iter_mut().zip(&volumes).filter(|(_, volume)| **volume == 0.0).for_each(|(j, _)| *j = 1.0);
        let mut internal = Cow::Borrowed(&known.internal_force[..]);
        let equilibrium = match internal.is_empty() {
            true => {
                let internal = grown(internal.to_mut(), d.len());
                let result = solid.internal_force(d, step, internal);
                model.springs().list().iter().for_each(|spring| spring.add_force(d, internal));
                result
            }
            false => Ok(()),
        };
        let energies = match known.energies.is_empty() {
            true => solid.energies(d, step).map(Cow::Owned),
            false => Ok(Cow::Borrowed(&known.energies[..])),
        };
        let (mut stress, mut sizes) = (vec![0.0; 6 * mesh.elements.len()], vec![0.0; mesh.elements.len()]);
        let stresses = solid.visit_stresses(d, step, |element, of| {
            let (scaling, points) = (&self.scalings[element], stress_points(&mesh.elements[element]));
            let mean = |a: usize, b: usize| of[..points].iter().map(|s| s[a][b]).sum::<f64>() / points as f64;
            let places = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)];
            stress[6 * element..][..6].copy_from_slice(&places.map(|(a, b)| scaling.factor * mean(a, b)));
            sizes[element] = scaling.factor * of[..points].iter().map(von_mises).fold(0.0, f64::max);
        });
        let (Ok(()), Ok(()), Ok(energies)) = (equilibrium, stresses, energies) else {
            return ElementFields { determinants, ..ElementFields::default() };
        };
        let mut external = vec![0.0; d.len()];
        self.external_force(d, time, &mut external);
        let none = vec![0.0; d.len()];
        let contact_force = if known.contact.force.is_empty() { &none[..] } else { &known.contact.force[..] };
        let density = |(energy, volume): (&f64, &f64)| if *volume > 0.0 { energy / volume } else { 0.0 };
        ElementFields {
            determinants,
            stress,
            von_mises: sizes,
            energy_density: energies.iter().zip(&volumes).map(density).collect(),
            plastic_strain: if model.has_memory() {
                let largest = |points: &[f64; 8]| points.iter().copied().fold(0.0, f64::max);
                solid.plastic_strains(step.history).iter().map(largest).collect()
            } else {
                Vec::new()
            },
            reaction: model.reactions(time.t, &internal, &external, contact_force),
        }
    }
}

/// A vector of `length` zeros.
fn grown(of: &mut Vec<f64>, length: usize) -> &mut [f64] {
    of.resize(length, 0.0);
    of
}

//! What restrains rigid motions besides contact.

use crate::equations::ContactModel;
use crate::equations::loose::{add_condition, free_of};
use crate::equations::prescribed::Temporary;
use nalgebra::DMatrix;

/// Share of a free motion below which a body does not take part in it.
const APART: f64 = 1e-6;

impl ContactModel {
    /// The rates at which supports, springs and equations restrain motions of the bodies at y, a row for each
    /// condition: `modes` are displacements, and `held` are unknowns that supports hold for now.
    pub(in crate::equations) fn restraints(
        &self,
        y: &[f64],
        modes: &[Vec<f64>],
        held: impl Iterator<Item = usize>,
    ) -> Vec<Vec<f64>> {
        let mut rows = self.springs.restrained(y, modes);
        rows.extend(held.map(|i| modes.iter().map(|mode| mode[i]).collect::<Vec<f64>>()));
        rows.extend(self.restrained_by_equations(modes));
        let fixed = self.dependent.linear.truly_fixed(self.prescribed.fixed());
        for body in &self.loose.bodies {
            let prescribed = body.unknowns.clone().filter(|&i| fixed[i]);
            rows.extend(prescribed.map(|i| modes.iter().map(|mode| mode[i]).collect::<Vec<f64>>()));
        }
        rows
    }

    /// The rates at which motions violate the equations among displacements of bodies and prescribed ones. Those
    /// with free points do not restrain the bodies.
    fn restrained_by_equations(&self, modes: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let fixed = self.prescribed.fixed();
        let references: Vec<usize> = self.dependent.rigid.references().collect();
        let of_body = |i: u32| (i as usize) < 3 * self.solid_nodes || references.contains(&(i as usize / 3));
        let counts = |(i, terms): &&(u32, Vec<(u32, f64)>)| {
            of_body(*i) && terms.iter().all(|(i, _)| of_body(*i) || fixed[*i as usize])
        };
        let row = |(i, terms): &(u32, Vec<(u32, f64)>)| {
            let rate =
                |mode: &Vec<f64>| mode[*i as usize] - terms.iter().map(|(i, c)| c * mode[*i as usize]).sum::<f64>();
            modes.iter().map(rate).collect()
        };
        self.dependent.linear.rows().iter().filter(counts).map(row).collect()
    }

    /// Whether supports, springs and equations prevent all rigid motions of a body at rest, without contact.
    pub fn is_held_without_contact(&self, name: &str) -> bool {
        let Some(body) = self.loose.bodies.iter().position(|body| body.name == name) else { return true };
        let y = self.rest().unknowns;
        let modes = self.rigid_motions(&y);
        let mut gram = DMatrix::zeros(modes.len(), modes.len());
        let from_rest = |support: &&Temporary| self.prescribed.motion_of(support).acts_at(0.0);
        let held = self.prescribed.temporary().iter().filter(from_rest).map(|support| support.unknown as usize);
        self.restraints(&y, &modes, held).iter().for_each(|row| add_condition(&mut gram, row));
        free_of(gram, |_| false).rows(6 * body, 6).norm() < APART
    }
}

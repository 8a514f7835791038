//! What restrains rigid motions besides contact.

use crate::equations::ContactModel;
use crate::equations::loose::{add_condition, free_of};
use crate::equations::prescribed::Temporary;
use nalgebra::{DMatrix, Vector3};
use slipstick_contact::kinematics::NodeKinematics;
use slipstick_path::LoadTime;

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

    /// The rates at which motions of the bodies violate the ties that hold at a time.
    fn restrained_by_ties(&self, modes: &[Vec<f64>], time: LoadTime) -> Vec<Vec<f64>> {
        let tied = self.interfaces.iter().filter(|pair| pair.is_active(time));
        let at_points: Vec<_> = modes.iter().map(|mode| self.contact_vector(mode)).collect();
        let rows = tied.filter_map(|pair| pair.bond.as_deref()).flatten().filter(|row| row.area > 0.0);
        let conditions = rows.flat_map(|row| (0..3).map(move |b| (row, row.frame.vector(b))));
        let rate = |(row, direction): (&NodeKinematics, Vector3<f64>), mode: &[f64]| {
            let terms = row.support.iter().zip(&row.coefficient);
            let at = |node: u32| Vector3::from_column_slice(&mode[3 * node as usize..][..3]);
            terms.map(|(&node, b)| b * direction.dot(&at(node))).sum::<f64>() / row.area
        };
        conditions.map(|condition| at_points.iter().map(|mode| rate(condition, mode)).collect()).collect()
    }

    /// Whether supports, springs, equations and ties that act at a time prevent all rigid motions of a body from
    /// unknowns of a step, without contact.
    pub fn is_held_without_contact(&self, name: &str, y: &[f64], time: LoadTime) -> bool {
        let Some(body) = self.loose.bodies.iter().position(|body| body.name == name) else { return true };
        let modes = self.rigid_motions(y);
        let mut gram = DMatrix::zeros(modes.len(), modes.len());
        let acts = |support: &&Temporary| self.prescribed.motion_of(support).acts_at(time.t);
        let held = self.prescribed.temporary().iter().filter(acts).map(|support| support.unknown as usize);
        let mut rows = self.restraints(y, &modes, held);
        rows.extend(self.restrained_by_ties(&modes, time));
        rows.iter().for_each(|row| add_condition(&mut gram, row));
        free_of(gram, |_| false).rows(6 * body, 6).norm() < APART
    }
}

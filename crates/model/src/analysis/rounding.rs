//! Objectives that are only round-off.

use super::Analysis;
use super::forward::{ForwardNotice, in_words};
use crate::words::quantity;
use slipstick_design::quantity::Dimension;
use slipstick_path::LoadTime;
use std::fmt;

/// Values below this fraction of the problem's own scale are round-off. It is some hundred times
/// the machine precision, and far below the values of soft, slender or nearly void structures.
const ROUNDING: f64 = 1e-13;

/// A value of the objective that is only round-off: its derivatives give an optimizer no direction.
#[derive(Debug, Clone, PartialEq)]
pub struct Rounding {
    /// θ.
    pub value: f64,
    /// Characteristic force (or work) of the case's motions and loads, from E h u and the loads.
    pub scale: f64,
    /// The role of contact in it.
    pub notice: Option<ForwardNotice>,
}

impl fmt::Display for Rounding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let value = if self.value == 0.0 { "0".into() } else { format!("{:.1e}, which is only round-off", self.value) };
        write!(f, "the objective is {value}")?;
        match &self.notice {
            Some(ForwardNotice::ContactNeverCloses) => f.write_str(": contact never closes on the path"),
            Some(ForwardNotice::ContactOpenWhereObserved) => {
                f.write_str(": contact is open at every load step that the objective observes")
            }
            Some(ForwardNotice::ContactNeverClosesIn(names)) => {
                write!(f, ": contact never closes in {}", in_words(names))
            }
            None if self.value == 0.0 => Ok(()),
            None => write!(f, " compared to {}, the scale of the case's motions and loads", quantity(self.scale)),
        }
    }
}

impl Rounding {
    /// Suggested changes to the case.
    pub fn cures(&self) -> &'static [&'static str] {
        match &self.notice {
            Some(ForwardNotice::ContactNeverCloses | ForwardNotice::ContactNeverClosesIn(_)) => &[
                "make the motions close the gap (`place.translate`, `dirichlet.motion`): `slipstick check` shows gaps and \
                 motions",
                "inspect the end of the path: `slipstick render RESULTS --field displacement`",
            ],
            Some(ForwardNotice::ContactOpenWhereObserved) => &[
                "observe load steps with closed contact (`steps` in [objective]): newton.csv lists the number of open nodes",
                "make the motions keep the bodies pressed together until the end (`dirichlet.motion`)",
            ],
            None => &["apply motions or loads at the load steps that the objective observes"],
        }
    }
}

impl Analysis {
    /// Whether a value of the objective at the end of a whole path is only round-off.
    pub(super) fn rounding(&self, value: f64, notice: Option<&ForwardNotice>) -> Option<Rounding> {
        let objective = self.objective.as_ref()?;
        let (force, motion) = self.scales();
        // another objective may be nonzero with open contact
        let notice = notice.filter(|_| objective.needs_contact());
        let of = |dimension: Dimension| match dimension {
            Dimension::FORCE => force,
            Dimension::WORK => force * motion,
            Dimension::LENGTH => motion,
            Dimension::STRESS => force / self.model().smallest_element().powf(2.0 / 3.0),
            // of anything else, only zero itself is known to be round-off
            _ => 0.0,
        };
        let scale = match objective.dimension() {
            Some(dimension) => of(dimension),
            None if notice.is_some() => 0.0,
            None if objective.is_sum() => {
                objective.terms().iter().map(|term| term.weight.abs() * of(term.quantity.dimension())).sum()
            }
            None => return None,
        };
        let small = value.abs() <= ROUNDING * scale;
        let open = notice.filter(|notice| small || !matches!(notice, ForwardNotice::ContactNeverClosesIn(_)));
        (open.is_some() || small).then(|| Rounding { value, scale, notice: notice.cloned() })
    }

    /// Characteristic force and motion: the force with which motions and loads would compress one
    /// element, and the displacement.
    fn scales(&self) -> (f64, f64) {
        let model = self.model();
        let modulus =
            (0..model.solid().elements()).map(|e| model.solid().material(e).youngs_modulus()).fold(0.0, f64::max);
        let size = model.smallest_element().cbrt();
        let n = model.prescribed().fixed().len();
        let (still, mut force) = (vec![0.0; n], vec![0.0; n]);
        let load = |&time: &LoadTime| {
            self.design.external_force(&still, time, &mut force);
            force.iter().map(|f| f * f).sum::<f64>().sqrt()
        };
        let load = self.times.iter().map(load).fold(0.0, f64::max);
        let motion = model.prescribed().largest(&self.times) + load / (modulus * size) + model.thermal_motion();
        (modulus * size * motion, motion)
    }
}

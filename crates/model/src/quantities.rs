//! Quantities that every run reports at each load step: reactions and displacements of the
//! supports, forces of the contact pairs, energies.
//!
//! | name | of | unit | meaning |
//! |---|---|---|---|
//! | `displacement_SET_x` … | a support | L | mean displacement of the nodes of which it prescribes a component that no earlier table does |
//! | `reaction_SET_x` … | a support | F | force that it exerts on the body, for each prescribed component |
//! | `symmetry_reaction_x` … | a symmetry plane | F | force that it exerts on the bodies, along its normal |
//! | `bolt_force_BOLT` | a bolt | F | its force, positive in tension |
//! | `overlap_BOLT` | a bolt | L | distance by which its two parts overlap at the section |
//! | `SLAVE_force_x` … | a contact pair | F | resultant of the contact forces on the slave, friction included |
//! | `SLAVE_normal_force` | a contact pair | F | sum of the normal forces of the slave nodes, Σ A_j ζ_nj |
//! | `SLAVE_friction_force` | a contact pair | F | sum of the magnitudes of their friction forces, Σ A_j ‖ζ_τj‖ |
//! | `SLAVE_peak_pressure` | a contact pair | F/L² | largest contact pressure at a slave node |
//! | `SLAVE_contact_area` | a contact pair | L² | covered area of the slave nodes that are in contact |
//! | `SLAVE_open`, `_stick`, `_slip` | a contact pair | – | numbers of slave nodes |
//! | `SLAVE_friction_work` | a contact pair | F L | work dissipated by friction since the start of the load case |
//! | `SLAVE_force_on_void` | a contact pair, with a design | F | contact force on elements with a density below 0.1 ([`crate::void_contact`]) |
//! | `strain_energy_BODY` | a body | F L | elastic energy |
//! | `strain_energy`, `friction_work` | everything | F L | sums over bodies and pairs |
//! | `external_work` | everything | F L | work of loads and supports since the start of the load case |
//! | `contact_work` | everything | F L | work that contact takes from the bodies since the start of the load case |
//! | `offset_work` | everything, if a pair has an offset | F L | work of the offsets of contact pairs since the start of the load case, Σ ∫ F_n dd |
//! | `spring_energy` | everything, with springs | F L | energy stored in all springs |
//! | `thermal_work` | everything, if temperatures change | F L | work of changes of temperature since the start of the load case, Σ ∫ ∂W/∂θ dθ |
//! | `viscous_work` | everything, with viscosity | F L | energy that viscous forces have dissipated since the start of the load case |
//! | `holding_work` | everything, with bodies that only contact holds | F L | work that the springs on their free motions have taken since the start of the load case |
//! | `plastic_work` | everything, with plasticity | F L | plastic work of all bodies since rest |
//! | `energy_balance` | everything | F L | external work + offset work + thermal work − strain energy − spring energy − plastic work − friction work − viscous work − holding work |
//!
//! The [quantities of the problem](crate::problem::Problem::quantities), which a case names, follow
//! under their own names.
//!
//! `SET` is the set of a `[[dirichlet]]` table, `SLAVE` the slave surface. A displacement component
//! that several tables prescribe belongs to the first of them, so that the reactions of all
//! supports and symmetry planes and the loads add up to zero. Test:
//! `reactions_and_loads_are_in_equilibrium`.
//!
//! External work, offset work and contact work are integrated by the trapezoidal rule over the accepted
//! (sub-)steps: external work − strain energy − contact work is zero in the limit of small steps.
//! Friction work is the sum of the tractions at the end of each step times the objective slip
//! increments, Σ ζ_τj·ũ_τj. It differs from contact work by the energy of penalties; by the size of
//! the steps; and, at finite strains, by the discretization, where the normals of slave and master
//! are not opposite, as at the rim of a block that digs in. The energy balance shows that
//! difference. Tests: `work_is_stored_or_taken_by_contact`,
//! `friction_work_is_contact_work_at_small_strains`.

mod recording;
mod spring_force;
mod sums;

pub use recording::{Reached, Recording};
pub use spring_force::SpringForce;

use slipstick_design::quantity::ExternalWork;
use slipstick_mesh::{Mesh, Rigid};
use slipstick_path::{LoadTime, Path};

use crate::coarse_friction::CoarseFriction;
use crate::equations::{ContactModel, ModelInterface, NodalContact};
use crate::imbalance::Imbalance;
use crate::losses::LostWork;
use crate::overlaps::{OpenOverlap, overlaps};
use crate::problem::Problem;
use crate::releases::ReleasedEnergy;
use crate::rough_pressure::RoughPressure;
use crate::void_contact::VoidContact;

/// What a quantity belongs to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Subject {
    /// A support or prescribed motion, with its set.
    Support(String),
    /// A symmetry plane.
    SymmetryPlane,
    /// A bolt, with its name.
    Bolt(String),
    /// A contact pair, with its slave surface.
    Pair(String),
    /// A body, with its name.
    Body(String),
    /// The whole model.
    Whole,
    /// The case, which names it.
    Case,
    /// The extreme for which a smooth quantity of the case stands.
    Extreme,
}

/// A quantity's name, unit and subject.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct QuantityName {
    /// As in the [table](self) of names.
    pub name: String,
    /// What it belongs to.
    pub subject: Subject,
    /// The name without the subject, such as `reaction_x` or `normal_force`.
    pub what: String,
    /// In units of force F and length L; empty for numbers.
    pub unit: &'static str,
}

/// All quantities at the end of a load step.
#[derive(Debug, Clone, PartialEq)]
pub struct QuantityRow {
    /// Load step, counted through all load cases; 0 at rest.
    pub step: usize,
    /// When.
    pub time: LoadTime,
    /// One number per name; NaN from the first state on that cannot be evaluated, which is rare
    /// because states have converged.
    pub values: Vec<f64>,
    /// For every slave node of all pairs. Empty at the start of a load case.
    pub slipped: Vec<Slipped>,
}

/// Slip of a slave node since the start of the load case, through all sub-steps.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Slipped {
    /// Length of the path that the node has slipped. \[L\]
    pub distance: f64,
    /// Work that friction has dissipated at the node. Wear by Archard's law is proportional to work
    /// per area. \[F L\]
    pub work: f64,
    /// Area of the slave surface around the node in the reference configuration. \[L²\]
    pub area: f64,
}

/// Quantities of a path.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Quantities {
    /// Names, in the order of the values.
    pub names: Vec<QuantityName>,
    /// The state at rest and every completed load step.
    pub rows: Vec<QuantityRow>,
    /// Where bodies overlap without a contact force ([`overlaps`]); empty on all ranks but the first.
    pub overlaps: Vec<OpenOverlap>,
    /// Contact pairs that take or add energy without a mechanism ([`crate::losses`]), over the load case that
    /// loses most.
    pub losses: Vec<LostWork>,
    /// Contact pairs whose friction work needs finer load steps ([`crate::coarse_friction`]), over the load case
    /// that needs them most.
    pub coarse_friction: Vec<CoarseFriction>,
    /// The largest release of stored energy that nothing takes ([`crate::releases`]).
    pub released: Option<ReleasedEnergy>,
    /// Energies that do not balance for another reason ([`crate::imbalance`]).
    pub imbalance: Option<Imbalance>,
    /// Contact pairs whose largest pressures the facets do not resolve ([`crate::rough_pressure`]).
    pub rough_pressures: Vec<RoughPressure>,
    /// Contact pairs whose force acts on void ([`crate::void_contact`]).
    pub on_void: Vec<VoidContact>,
}

impl Quantities {
    /// A quantity at every row; `None` if there is none of this name.
    pub fn get(&self, name: &str) -> Option<Vec<f64>> {
        let column = self.names.iter().position(|known| known.name == name)?;
        Some(self.rows.iter().map(|row| row.values[column]).collect())
    }

    /// The first load step in which the strain energy rises by more than twice what was stored before
    /// and what loads, supports and offsets add. The state then probably lies on another branch of
    /// equilibria: Newton's method has left the neighbourhood of the path. The first step of a load case,
    /// and energies that are round-off of the largest one on the path, are not judged. Test: `energy_from_nowhere_is_noticed`.
    pub fn jump(&self) -> Option<EnergyJump> {
        let stored = self.get("strain_energy")?;
        let sources: Vec<Vec<f64>> = SOURCES.iter().filter_map(|name| self.get(name)).collect();
        let round_off = self.round_off();
        (1..self.rows.len()).find_map(|row| {
            let (before, rise) = (stored[row - 1], stored[row] - stored[row - 1]);
            let added: f64 = sources.iter().map(|sums| (sums[row] - sums[row - 1]).abs()).sum();
            let jumps = before > 0.0 && rise > JUMP * (before + added) && rise > round_off;
            jumps.then_some(EnergyJump { step: self.rows[row].step, before, rise, added })
        })
    }

    /// The first load step until which the springs on free motions have taken more than 0.1 % of the work of
    /// loads, supports and offsets, and that part. Test: `work_of_springs_is_judged`.
    pub fn holding(&self) -> Option<(usize, f64)> {
        let taken = self.get("holding_work")?;
        let done = SOURCES.iter().filter_map(|name| self.get(name));
        let done =
            done.fold(vec![0.0; taken.len()], |sum, work| sum.iter().zip(&work).map(|(a, b)| a + b.abs()).collect());
        let round_off = self.round_off();
        let at = (0..taken.len()).find(|&row| taken[row] > (COUNTED_HOLDING * done[row]).max(round_off))?;
        Some((self.rows[at].step, taken[at] / done[at]))
    }

    /// Energies up to this are round-off of the largest energy or work on the path. \[F L\]
    pub(crate) fn round_off(&self) -> f64 {
        let all = SOURCES.iter().chain(&["strain_energy", "friction_work"]).filter_map(|name| self.get(name));
        ROUND_OFF * all.flatten().map(f64::abs).fold(0.0, f64::max)
    }
}

/// Part of the work of loads, supports and offsets above which the work of the springs on free motions is
/// reported.
const COUNTED_HOLDING: f64 = 1e-3;

/// What adds energy to bodies.
const SOURCES: [&str; 3] = ["external_work", "offset_work", "thermal_work"];

/// Ratio of a rise of the strain energy to its sources that counts as a jump. It leaves room for the
/// trapezoidal rule, which integrates the work over the steps.
const JUMP: f64 = 2.0;

/// Fraction of the largest energy or work on a path below which an energy is round-off: those of bodies that
/// come apart again are squares of errors in their displacements.
const ROUND_OFF: f64 = 1e-10;

/// A rise of the strain energy that nothing explains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EnergyJump {
    /// Load step, counted through all load cases.
    pub step: usize,
    /// Strain energy before the step. \[F L\]
    pub before: f64,
    /// Its rise in the step. \[F L\]
    pub rise: f64,
    /// Work of loads, supports and offsets in the step. \[F L\]
    pub added: f64,
}

/// Computes the quantities of all completed load steps of a path. All ranks call it and receive the
/// same, except for the overlaps.
pub fn quantities(problem: &Problem, path: &Path) -> Quantities {
    let ranks = problem.analysis.model().share().ranks().clone();
    let mut recording = Recording::of(problem);
    for (index, at) in path.states.iter().enumerate() {
        recording.add(at.into(), path.state(index, &*ranks), None);
    }
    recording.finish(overlaps(problem, path))
}

/// Σ A_j ζ_nj. \[F\]
fn normal_force(nodes: &[NodalContact]) -> f64 {
    nodes.iter().map(|at| at.covered_area * at.multiplier[0]).sum()
}

/// Displacement unknowns that a support prescribes, and its name.
struct Support {
    set: Option<String>,
    unknowns: Vec<u32>,
    /// The rigid body that it is.
    rigid: Option<Rigid>,
}

/// Supports and motions, rigid bodies without them, and symmetry planes.
fn supports(mesh: &Mesh, model: &ContactModel) -> Vec<Support> {
    let prescribed = model.prescribed();
    let of = |set: &str| mesh.rigid.iter().find(|rigid| mesh.bodies[rigid.body].name == set).cloned();
    let mut owned = prescribed.owned();
    for rigid in &mesh.rigid {
        let name = mesh.bodies[rigid.body].name.as_str();
        if owned.iter().all(|(set, _)| *set != name) {
            owned.push((name, Vec::new()));
        }
    }
    let sets = owned.into_iter().map(|(set, unknowns)| Support { set: Some(set.to_owned()), unknowns, rigid: of(set) });
    let mirrored = prescribed.mirrored();
    let plane = |c: u32| mirrored.iter().copied().filter(|unknown| unknown % 3 == c).collect::<Vec<u32>>();
    let planes = (0..3).map(plane).filter(|unknowns| !unknowns.is_empty());
    sets.chain(planes.map(|unknowns| Support { set: None, unknowns, rigid: None })).collect()
}

/// The columns of a table of quantities that say where a row lies on the path: [`QuantityRow::step`], and the
/// load case with its own pseudo-time.
pub const PLACE: [&str; 3] = ["step", "load_case", "time"];

/// The first column of a table of several evaluations.
pub const FRICTION: &str = "friction";

/// The names of the columns that every run writes, apart from those of the case's own quantities.
pub fn column_names(mesh: &Mesh, model: &ContactModel) -> Vec<String> {
    built_in(mesh, model, &supports(mesh, model)).into_iter().map(|column| column.name).collect()
}

/// A name as the heading of a column: names from mesh files may contain characters that separate
/// cells or lines.
fn column_name(name: &str) -> String {
    name.replace([',', '"', '\n', '\r'], "_")
}

const AXES: [&str; 3] = ["x", "y", "z"];

impl Support {
    /// The nodes, and whether any unknown of each component is prescribed.
    fn nodes(&self) -> (Vec<u32>, [bool; 3]) {
        let mut nodes: Vec<u32> = self.unknowns.iter().map(|unknown| unknown / 3).collect();
        nodes.dedup();
        let mut components = [false; 3];
        self.unknowns.iter().for_each(|unknown| components[(unknown % 3) as usize] = true);
        (nodes, components)
    }
}

/// Names of all quantities except the case's own.
fn built_in(mesh: &Mesh, model: &ContactModel, supports: &[Support]) -> Vec<QuantityName> {
    let mut names = Vec::new();
    let mut push = |subject: Subject, what: String, name: String, unit| {
        let name = column_name(&name);
        names.push(QuantityName { name, subject, what, unit });
    };
    for support in supports {
        let (_, components) = support.nodes();
        let prescribed = (0..3).filter(|&c| components[c]);
        match &support.set {
            Some(set) => {
                let subject = || Subject::Support(set.clone());
                for axis in AXES {
                    push(subject(), format!("displacement_{axis}"), format!("displacement_{set}_{axis}"), "L");
                }
                for axis in AXES.iter().filter(|_| support.rigid.is_some()) {
                    push(subject(), format!("rotation_{axis}"), format!("rotation_{set}_{axis}"), "");
                }
                for axis in prescribed.map(|c| AXES[c]) {
                    push(subject(), format!("reaction_{axis}"), format!("reaction_{set}_{axis}"), "F");
                }
                for axis in AXES.iter().filter(|_| support.rigid.is_some()) {
                    push(subject(), format!("moment_{axis}"), format!("moment_{set}_{axis}"), "F L");
                }
            }
            None => prescribed.for_each(|c| {
                let name = format!("symmetry_reaction_{}", AXES[c]);
                push(Subject::SymmetryPlane, format!("reaction_{}", AXES[c]), name, "F");
            }),
        }
    }
    for bolt in model.bolts().list() {
        for (what, unit) in [("bolt_force", "F"), ("overlap", "L")] {
            push(Subject::Bolt(bolt.name.clone()), what.into(), format!("{what}_{}", bolt.name), unit);
        }
    }
    for pair in model.interfaces() {
        let slave = &pair.surfaces[0];
        let forces = AXES.map(|axis| (format!("force_{axis}"), "F"));
        let on_void = has_force_on_void(model, pair).then(|| ("force_on_void".to_owned(), "F"));
        for (what, unit) in forces.into_iter().chain(PAIR.map(|(what, unit)| (what.to_owned(), unit))).chain(on_void) {
            let name = format!("{slave}_{what}");
            push(Subject::Pair(slave.clone()), what, name, unit);
        }
    }
    for body in &mesh.bodies {
        let name = format!("strain_energy_{}", body.name);
        push(Subject::Body(body.name.clone()), "strain_energy".into(), name, "F L");
    }
    let offset = has_offset(model).then_some("offset_work");
    let thermal = model.has_temperatures().then_some("thermal_work");
    let work = ["strain_energy", "friction_work", "external_work", "contact_work"].into_iter();
    let springs = (!model.springs().is_empty()).then_some("spring_energy");
    let viscous = (!model.viscosity().is_none()).then_some("viscous_work");
    let holding = model.may_move_freely().then_some("holding_work");
    let plastic = model.has_memory().then_some("plastic_work");
    for name in work
        .chain(plastic)
        .chain(offset)
        .chain(thermal)
        .chain(springs)
        .chain(viscous)
        .chain(holding)
        .chain(["energy_balance"])
    {
        push(Subject::Whole, name.into(), name.into(), "F L");
    }
    names
}

/// Whether a pair has a column for its force on void.
fn has_force_on_void(model: &ContactModel, pair: &ModelInterface) -> bool {
    model.has_design() && !pair.is_bonded()
}

fn has_offset(model: &ContactModel) -> bool {
    model.interfaces().iter().any(|pair| !pair.offset.is_empty())
}

/// The work that loads, supports and prescribed motions do on all bodies. The forces at the
/// reference point of a rigid body do their work through the nodes of the body, so they do not count
/// a second time.
pub fn external_work(name: impl Into<String>, mesh: &Mesh) -> ExternalWork {
    let work = ExternalWork::new(name);
    if mesh.rigid.is_empty() {
        return work;
    }
    let references: Vec<u32> = mesh.rigid.iter().flat_map(|rigid| [rigid.reference, rigid.rotation()]).collect();
    let nodes = (0..mesh.nodes.len() as u32).filter(|node| !references.contains(node));
    work.on(nodes.flat_map(|node| (0..3).map(move |c| 3 * node + c)).collect())
}

/// Quantities of a pair after its resultant.
const PAIR: [(&str, &str); 8] = [
    ("normal_force", "F"),
    ("friction_force", "F"),
    ("peak_pressure", "F/L²"),
    ("contact_area", "L²"),
    ("open", ""),
    ("stick", ""),
    ("slip", ""),
    ("friction_work", "F L"),
];

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: a step that stores what is added, one that stores a little more than three times as
    /// much in total as there was and was added, and a path that starts with stored energy from nothing,
    /// as an interference fit without a record of its offset would.
    #[test]
    fn energy_from_nowhere_is_noticed() {
        let quantities = |rows: &[[f64; 2]]| {
            let name = |name: &str| QuantityName {
                name: name.into(),
                subject: Subject::Whole,
                what: name.into(),
                unit: "F L",
            };
            let row = |(step, values): (usize, &[f64; 2])| QuantityRow {
                step,
                time: (step as f64).into(),
                values: values.to_vec(),
                slipped: Vec::new(),
            };
            let names = vec![name("strain_energy"), name("external_work")];
            Quantities { names, rows: rows.iter().enumerate().map(row).collect(), ..Quantities::default() }
        };
        assert_eq!(quantities(&[[0.0, 0.0], [1.0, 1.0], [3.0, 3.0], [0.5, 2.0]]).jump(), None);
        assert_eq!(quantities(&[[0.0, 0.0], [5.0, 0.0], [6.0, 0.0]]).jump(), None);
        // apart again, after a work of 10
        assert_eq!(quantities(&[[0.0, 0.0], [4.0, 10.0], [1e-14, 6.0], [1e-12, 6.0]]).jump(), None);
        let jump = quantities(&[[0.0, 0.0], [1.0, 1.0], [4.5, 0.5], [14.25, 0.25]]).jump();
        assert_eq!(jump, Some(EnergyJump { step: 2, before: 1.0, rise: 3.5, added: 0.5 }));
        assert_eq!(quantities(&[[0.0, 0.0], [1.0, 1.0], [4.0, 0.5]]).jump(), None);
    }

    /// By hand: 0.05 % and 0.2 % of the sum of external work and work of offsets; round-off does not count.
    #[test]
    fn work_of_springs_is_judged() {
        let quantities = |last: f64| {
            let name = |name: &str| QuantityName {
                name: name.into(),
                subject: Subject::Whole,
                what: name.into(),
                unit: "F L",
            };
            let row = |(step, values): (usize, [f64; 3])| QuantityRow {
                step,
                time: (step as f64).into(),
                values: values.to_vec(),
                slipped: Vec::new(),
            };
            let names = ["holding_work", "external_work", "offset_work"].map(name).to_vec();
            // the first is round-off
            let rows = [[1e-12, -1e-16, 0.0], [0.0005, -0.4, 0.6], [last, 1.5, 0.5]]
                .into_iter()
                .enumerate()
                .map(row)
                .collect();
            Quantities { names, rows, ..Quantities::default() }
        };
        assert_eq!(quantities(0.001).holding(), None);
        assert_eq!(quantities(0.004).holding(), Some((2, 0.002)));
    }

    #[test]
    fn headings_of_columns_have_no_separators() {
        assert_eq!(column_name("reaction_top, \"left\"_x"), "reaction_top_ _left__x");
    }
}

//! Reads the designs and load steps that a run has written.

use serde::Serialize;
use slipstick_mesh::Mesh;

use super::model::Layout;
use super::origin::PathOf;
use super::pack::{Packed, base64};
use slipstick_case::file::Case;
use slipstick_model::model::LoadTime;
use slipstick_model::words::counted;
use slipstick_results::output::{StoredField, read_fields};
use slipstick_results::run::{RunDirectory, RunError, load_density};

/// Designs by iteration, load steps by number.
#[derive(Debug, Default, Serialize)]
pub(super) struct Frames {
    pub designs: Vec<Design>,
    pub steps: Vec<Step>,
    /// The design of the load steps.
    #[serde(skip)]
    pub path: PathOf,
    /// In words, if it is not the newest.
    #[serde(skip_serializing_if = "Option::is_none")]
    path_of: Option<String>,
}

impl Frames {
    /// The model before it runs: one state, without densities.
    pub fn of_model() -> Self {
        Self { designs: vec![Design { number: 0, density: None, derivative: None }], ..Self::default() }
    }
}

/// A design.
#[derive(Debug, Serialize)]
pub(super) struct Design {
    number: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    density: Option<Packed>,
    #[serde(skip_serializing_if = "Option::is_none")]
    derivative: Option<Packed>,
}

/// The state at the end of a load step.
#[derive(Debug, Serialize)]
pub(super) struct Step {
    number: usize,
    /// The load case, if it has a name, and pseudo-time within it.
    #[serde(skip_serializing_if = "Option::is_none")]
    load_case: Option<String>,
    time: f64,
    /// 3 per point. \[L\]
    displacement: Packed,
    /// At slave nodes, like the following fields. \[F/L²\]
    pressure: Packed,
    /// \[L\]
    gap: Packed,
    /// \[L\]
    slip: Packed,
    /// Base64 of one byte per node: 0 open, 1 stick, 2 slip.
    status: String,
    /// Von Mises stress of each element, then of the element behind each face of the skin. \[F/L²\]
    #[serde(skip_serializing_if = "Option::is_none")]
    stress: Option<Packed>,
    /// Largest equivalent plastic strain of each element, in the same order.
    #[serde(skip_serializing_if = "Option::is_none")]
    plastic: Option<Packed>,
}

/// Fields of one file.
struct Stored(Vec<StoredField>);

impl Stored {
    fn read(run: &RunDirectory, name: &str) -> Result<Self, RunError> {
        Ok(Self(read_fields(&run.file(name))?))
    }

    /// A field of this mesh.
    fn values(&self, name: &str, count: usize) -> Option<&[f64]> {
        let found = self.0.iter().find(|field| field.name == name)?;
        (found.values.len() == count).then_some(&found.values[..])
    }
}

/// Reads as many frames as fit into `budget` bytes, and the density of the load path.
pub(super) fn read(
    run: &RunDirectory,
    case: &Case,
    mesh: &Mesh,
    layout: &Layout,
    budget: usize,
    notes: &mut Vec<String>,
) -> Result<(Frames, Option<Packed>), RunError> {
    let (designs, steps) = (run.numbers("design")?, run.numbers("path")?);
    let design_bytes = (3 * layout.elements.len()).max(1);
    let step_bytes =
        (6 * layout.nodes.len() + 7 * layout.slaves.len() + 2 * layout.elements.len() + 2 * layout.behind.len()).max(1);
    let designs = thinned(&designs, budget / 2 / design_bytes, "designs", "design.pvd", notes);
    let steps = thinned(&steps, budget / 2 / step_bytes, "load steps", "path.pvd", notes);
    let mut frames = Frames::default();
    let mut of_path: Option<Vec<f64>> = None;
    let (times, mut earlier) = (run.path_times()?, 0);
    for number in steps {
        let name = RunDirectory::numbered("path", number);
        let stored = Stored::read(run, &name)?;
        let density = stored.values("density", mesh.elements.len());
        match (&of_path, density) {
            (None, Some(density)) => of_path = Some(density.to_vec()),
            // the path is being written
            (Some(first), Some(density)) if density != first => {
                earlier += 1;
                continue;
            }
            _ => {}
        }
        let time = times.iter().find(|(file, _)| *file == name).map_or(f64::NAN, |(_, time)| *time);
        frames.steps.extend(step(&stored, number, (&case.load_case_names(), time), mesh, layout));
    }
    if earlier > 0 {
        notes.push(format!("{} of an earlier design left out.", counted(earlier, "load step")));
    }
    let mut path_design = None;
    for number in designs {
        let stored = Stored::read(run, &RunDirectory::numbered("design", number))?;
        if of_path.is_some() && stored.values("density", mesh.elements.len()) == of_path.as_deref() {
            path_design = Some(number);
        }
        frames.designs.extend(design(&stored, number, mesh, layout));
    }
    if run.file("gradient.vtu").is_file() {
        frames.designs.extend(design(&Stored::read(run, "gradient.vtu")?, 0, mesh, layout));
    }
    let newest = if run.file("design.csv").is_file() { Some(load_density(run.path(), mesh)?) } else { None };
    // If the field of this design was not written, or the run has a single design, its table has
    // the densities.
    if let Some(density) = newest.as_ref().filter(|_| layout.is_designed() && frames.steps.is_empty())
        && frames.designs.is_empty()
    {
        frames.designs.push(Design { number: 0, density: Some(densities(density, layout)), derivative: None });
    }
    if let (Some(of_path), Some(newest)) = (&of_path, &newest)
        && of_path[..] != newest[..]
    {
        let what = path_design.map_or("an earlier design".into(), |number| format!("the design of iteration {number}"));
        notes.push(format!(
            "Load path, quantities and contact forces are those of {what}. An optimization writes them for every few \
             designs ([output] every) and at its end."
        ));
        frames.path_of = Some(what);
        frames.path = path_design.map_or(PathOf::Unknown, PathOf::Iteration);
    } else if of_path.is_some() && newest.is_some() {
        frames.path = PathOf::Newest;
    }
    Ok((frames, of_path.map(|density| densities(&density, layout))))
}

/// At most `most` of the numbers, evenly spaced, including the first and the last.
pub(super) fn thinned(numbers: &[usize], most: usize, what: &str, file: &str, notes: &mut Vec<String>) -> Vec<usize> {
    let (count, most) = (numbers.len(), most.max(2));
    if count <= most {
        return numbers.to_vec();
    }
    notes.push(format!("This page shows {most} of {count} {what}; {file} has all that were written."));
    (0..most).map(|k| numbers[k * (count - 1) / (most - 1)]).collect()
}

fn densities(values: &[f64], layout: &Layout) -> Packed {
    Packed::densities(layout.elements.iter().map(|&e| values[e as usize]))
}

fn design(stored: &Stored, number: usize, mesh: &Mesh, layout: &Layout) -> Option<Design> {
    let density = Some(densities(stored.values("density", mesh.elements.len())?, layout));
    let derivative = stored.values("objective_derivative", mesh.elements.len());
    let on_page = |values: &[f64]| layout.elements.iter().map(|&e| values[e as usize]).collect::<Vec<f64>>();
    Some(Design { number, density, derivative: derivative.map(|values| Packed::numbers(&on_page(values))) })
}

fn step(
    stored: &Stored,
    number: usize,
    (load_cases, time): (&[String], f64),
    mesh: &Mesh,
    layout: &Layout,
) -> Option<Step> {
    let nodes = mesh.nodes.len();
    let displacement = stored.values("displacement", 3 * nodes)?;
    let displacement: Vec<f64> =
        layout.nodes.iter().flat_map(|&n| &displacement[3 * n as usize..3 * n as usize + 3]).copied().collect();
    let of_slaves = |name: &str| -> Option<Vec<f64>> {
        let values = stored.values(name, nodes)?;
        Some(layout.slaves.iter().map(|&n| values[n as usize]).collect())
    };
    let status = of_slaves("contact_status")?.into_iter().map(|status| status.clamp(0.0, 2.0) as u8);
    let at = LoadTime::of_axis(time);
    let load_case = at.name(load_cases);
    let of_elements = |name: &str| {
        stored.values(name, mesh.elements.len()).map(|values| {
            let shown = layout.elements.iter().chain(&layout.behind);
            Packed::numbers(&shown.map(|&e| values[e as usize]).collect::<Vec<f64>>())
        })
    };
    Some(Step {
        number,
        load_case: load_case.map(str::to_owned),
        time: at.t,
        displacement: Packed::numbers(&displacement),
        pressure: Packed::numbers(&of_slaves("contact_pressure")?),
        gap: Packed::numbers(&of_slaves("contact_gap")?),
        slip: Packed::numbers(&of_slaves("slip_increment")?),
        status: base64(&status.collect::<Vec<u8>>()),
        stress: of_elements("von_mises_stress"),
        plastic: of_elements("plastic_strain"),
    })
}

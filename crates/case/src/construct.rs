//! From a resolved case to a problem that can be analysed.

mod bolts;
mod centres;
mod couplings;
mod cross_points;
mod edges;
mod enforcement;
mod equations;
mod error;
mod loads;
mod maps;
mod mesh;
mod motions;
mod names;
mod optimization;
pub mod pick;
mod quantities;
mod regions;
mod sections;
mod select;
pub(crate) mod sides;
mod springs;
pub(crate) mod surfaces;
pub(crate) mod symmetry;
pub(crate) mod ties;
mod variables;
mod variation;

pub use equations::{EquationsOfTable, equations_of};
pub use error::BuildError;
pub use mesh::build_mesh;
pub use optimization::optimization;
pub(crate) use regions::Regions;
pub use sections::sections;
pub use springs::springs_of;
pub use surfaces::smooth_faces;
pub use variation::moved_mesh;

use crate::file::{self, Case, CaseCode};
use enforcement::{build_uzawa, check_stiffness, given};
use names::NodeNames;
use quantities::Requested;
use slipstick_contact::kinematics::{CellRule, MultiplierShape, NodeKinematics};
use slipstick_contact::{ContactInterface, InterfaceError, InterfaceOptions};
use slipstick_linalg::Ranks;
use slipstick_mesh::{ContactMap, FacetNodes, Mesh, Surface, facet_area};
use slipstick_model::analysis::{Analysis, LoadCases};
use slipstick_model::model::LoadTime;
use slipstick_model::model::prescribed::Prescribed;
use slipstick_model::model::{
    ContactModel, Design, ModelInterface, ModelParts, OffsetPoint, Share, Temperatures, Viscosity, Workspace,
};
pub use slipstick_model::problem::Problem;
use slipstick_path::{LinearSystem, MarchOptions, NewtonOptions, StartValues, SweepOptions, Tolerance, Tolerances};
use slipstick_solid::{Interpolation, Simp, SolidModel};
use std::borrow::Cow;
use std::sync::Arc;

/// What a problem is solved on.
pub trait Platform {
    /// The ranks that share it.
    fn ranks(&self) -> Arc<dyn Ranks>;

    /// The linear solver that a case requests; `owners` has the rank of each node, `slaves` are the
    /// names of the slave surfaces.
    ///
    /// # Errors
    /// [`BuildError`] if it is not available.
    fn linear(
        &self,
        solver: &file::Solver,
        owners: &[u32],
        mesh: &Mesh,
        slaves: &[&str],
    ) -> Result<LinearSystem, BuildError>;
}

/// Builds mesh, model, load path, design and objective on a platform; all its ranks call this.
///
/// # Errors
/// [`BuildError`] at the place in the case that cannot be built.
pub fn build_on(case: &Case, platform: &dyn Platform) -> Result<Problem, BuildError> {
    if case.output.vtkhdf && !cfg!(feature = "vtkhdf") {
        let message = "this program was built without VTKHDF files";
        let help = "omit the key (path.pvd lists the same fields), or build the program with `--features vtkhdf`";
        return Err(BuildError::new("output.vtkhdf", message, help));
    }
    let (mesh, ties) = mesh::mesh_with_ties(case)?;
    let names = NodeNames::new(case, &mesh);
    assembled(case, platform, mesh, ties).map_err(|error| names.in_files(error))
}

/// The problem on the mesh of a case.
fn assembled(case: &Case, platform: &dyn Platform, mesh: Mesh, ties: ties::Rows) -> Result<Problem, BuildError> {
    let coordinates: Vec<f64> = mesh.nodes.iter().flatten().copied().collect();
    let mut sets = Vec::with_capacity(case.dirichlet.len());
    for (i, dirichlet) in case.dirichlet.iter().enumerate() {
        sets.push(motions::moved(&mesh, dirichlet, &format!("dirichlet[{i}].set"))?);
    }
    let load_cases: Vec<&str> = case.load_cases.iter().map(|load_case| load_case.name.as_str()).collect();
    let prescribed = Prescribed::new(case.dirichlet.clone(), &sets, &coordinates, &load_cases).map_err(|e| {
        let help = match e.temporary {
            true => "leave this node out of one of the two sets, or hold it over the whole path, without a motion",
            false => "omit this component in one of the two tables, or give both the same motion",
        };
        BuildError::new(format!("dirichlet[{}].set", e.motion), e, help)
    })?;
    let mirrored = symmetry::mirrored(case, &mesh)?;
    let prescribed = prescribed.with_bodies(&mesh).with_symmetry(&mirrored).map_err(|e| {
        let help = "move them only within the plane, or omit the plane";
        BuildError::new(format!("dirichlet[{}].motion", e.motion), e, help)
    })?;
    let times = LoadTime::ends(load_cases.len().max(1), case.load_path.steps);
    let (held, ever_supported) = (edges::Held::over(&prescribed, &times), prescribed.ever_supported().into_owned());
    let prescribed = equations::with_equations(prescribed, case, &mesh, &times)?;
    let sections = sections(case, &mesh)?;
    let pairs: Vec<(&str, &str)> = case.contacts.iter().map(|c| (c.slave.as_str(), c.master.as_str())).collect();
    let share = Share::of(&mesh, &pairs, platform.ranks());
    let slaves: Vec<&str> = pairs.iter().map(|(slave, _)| *slave).collect();
    let linear = platform.linear(&case.solver, share.owners(), &mesh, &slaves)?;
    let solid = SolidModel::part(&mesh, sections, |element| share.has_element(element) && !mesh.is_rigid(element))
        .map_err(|e| BuildError::new("body", e, "the mesh is folded in its reference configuration"))?;
    // two driven sets may move towards each other
    let driven = case.dirichlet.iter().filter(|d| !d.motion.is_empty()).count();
    let approach = prescribed.largest_step(&times) * driven.min(2) as f64 * variation::largest_motion_factor(case);
    let interfaces = build_interfaces(case, &mesh, &mirrored, &held, approach, ties)?;
    let uzawa = build_uzawa(case)?;
    let variables = variables::build_variables(case, &mesh)?;
    let designed: Vec<bool> = match &variables {
        Some(v) => v.roles().iter().map(|r| *r != slipstick_design::Role::Outside).collect(),
        None => vec![false; mesh.elements.len()],
    };
    let interpolation = interpolation(case.design.as_ref());
    let map = maps::build_map(case, &mesh, variables.as_ref(), &mirrored, share.ranks())?;
    let (start, initial_density) = match (map, &case.design) {
        (Some(map), Some(design)) => {
            let x = map
                .uniform(design.initial)
                .map_err(|e| BuildError::new("design.initial", e, "choose a density between 0 and 1"))?;
            let density = map.densities(&x);
            (Some((map, x)), density)
        }
        _ => (None, vec![1.0; mesh.elements.len()].into()),
    };
    let largest = prescribed.largest(&times);
    let loads = loads::build_loads(case, &mesh, &load_cases)?;
    let springs = springs::build_springs(case, &mesh, &coordinates)?;
    let viscosity = Viscosity::new(case.load_path.viscosity, &mesh, &ever_supported);
    let temperatures = Temperatures::new(case.temperatures.clone(), &mesh, &load_cases);
    bolts::check(case, &mesh)?;
    let bolts = bolts::build_bolts(case, &mesh, &solid);
    let parts = ModelParts {
        share,
        solid,
        designed,
        interpolation,
        interfaces,
        uzawa,
        prescribed,
        loads,
        springs,
        bolts,
        temperatures,
        viscosity,
    };
    let model = ContactModel::new(&mesh, parts, &initial_density, largest);
    if times.iter().any(|&time| model.stretches(time).iter().any(|&stretch| stretch <= 0.0)) {
        let message = "a change of temperature would shrink a body to nothing: 1 + α ΔT is not positive";
        return Err(BuildError::new("temperature", message, "correct `change` or `thermal_expansion`"));
    }
    let variations = variation::variations(case, &mesh, &model, &mirrored)?;
    let Requested { quantities, objective, constraints } = quantities::requested(case, &mesh, &model)?;
    let design = Design::new(Arc::new(model), &initial_density);
    let cases = LoadCases::new(&design, variations).map_err(|(number, error)| {
        let path = format!("load_case[{number}].modulus_factor");
        BuildError::new(path, error, "choose factors that keep the moduli positive")
    })?;
    let cases = cases.named(case.load_case_names());
    let analysis = Analysis {
        design,
        workspace: Workspace::default(),
        times,
        cases,
        objective,
        constraints,
        march: march_options(case),
        sweep: SweepOptions { linear_tolerance: linear_tolerance(case), ..SweepOptions::default() },
        linear,
        guide: None,
    };
    let load_cases = case.load_case_names();
    let mut problem = Problem::new(mesh, analysis, start);
    (problem.load_cases, problem.quantities) = (load_cases, quantities);
    Ok(problem)
}

/// How the stiffness of an element depends on its density.
fn interpolation(design: Option<&file::Design>) -> Interpolation {
    let Some(design) = design else {
        return Simp { penalization: 1.0, minimum: 0.0 }.into();
    };
    Interpolation {
        simp: design.simp,
        energy: design.energy_interpolation,
        strength: design.yield_p,
        bulk: design.bulk_p,
        mass: design.mass_p,
    }
}

/// Relative residual of linear solves, forward and transposed: a fraction of the tolerance of the
/// load path, so that both the states and the gradient are as accurate as requested.
fn linear_tolerance(case: &Case) -> f64 {
    (0.1 * case.load_path.tolerance.relative).min(SweepOptions::default().linear_tolerance)
}

fn march_options(case: &Case) -> MarchOptions {
    let tolerance = &case.load_path.tolerance;
    let bound = |absolute: Option<f64>| match absolute {
        Some(value) => Tolerance::Absolute(value),
        None => Tolerance::Relative(tolerance.relative),
    };
    MarchOptions {
        newton: NewtonOptions {
            tolerances: Tolerances {
                residual: bound(tolerance.residual),
                displacement: bound(tolerance.displacement),
                contact: bound(tolerance.contact),
                multiplier: bound(tolerance.multiplier),
            },
            max_iterations: case.load_path.max_newton_iterations,
            linear_tolerance: linear_tolerance(case),
        },
        max_cutbacks: u32::try_from(case.load_path.max_cutbacks).unwrap_or(u32::MAX),
        bounds_cost: case.load_path.max_cutbacks <= file::LoadPath::USUAL_CUTBACKS,
        start: match case.load_path.start_values {
            file::StartValues::PreviousDesign | file::StartValues::Extrapolated => StartValues::Extrapolated,
            file::StartValues::LastState => StartValues::Previous,
        },
        memory: case.adjoint.memory.0,
        keeps_factors: true,
    }
}

/// Facets of a surface that `path` names.
fn facets_of(mesh: &Mesh, name: &str, path: &str) -> Result<Vec<FacetNodes>, BuildError> {
    Ok(surface_of(mesh, name, path)?.facets.iter().map(|f| f.nodes).collect())
}

/// The surface that `path` names.
fn surface_of<'a>(mesh: &'a Mesh, name: &str, path: &str) -> Result<&'a Surface, BuildError> {
    mesh.surfaces.get(name).ok_or_else(|| {
        let known: Vec<&str> = mesh.surfaces.keys().map(String::as_str).collect();
        let help = format!("facets are needed here; known surfaces: {}", known.join(", "));
        BuildError::new(path, format!("there is no surface `{name}`"), help).with_code(CaseCode::UnknownSet)
    })
}

/// The facets of the slave and of the master surface of a pair.
fn sides(contact: &file::Contact, pair: usize, mesh: &Mesh) -> Result<[Vec<FacetNodes>; 2], BuildError> {
    let surface = |name: &str, key: &str| facets_of(mesh, name, &format!("contact[{pair}].{key}"));
    Ok([surface(&contact.slave, "slave")?, surface(&contact.master, "master")?])
}

/// Size of the largest facet of a pair. \[L\]
fn largest_facet(contact: &file::Contact, pair: usize, mesh: &Mesh, points: &[[f64; 3]]) -> Result<f64, BuildError> {
    let sides = sides(contact, pair, mesh)?;
    Ok(sides.iter().flatten().map(|facet| facet_area(&facet.corners(points)).sqrt()).fold(0.0, f64::max))
}

/// How far apart tied surfaces may be; they are compared where they lie in the mesh. \[L\]
fn tie_reach(contact: &file::Contact, pair: usize, mesh: &Mesh, points: &[[f64; 3]]) -> Result<f64, BuildError> {
    match contact.search_radius {
        Some(reach) => Ok(reach),
        None => Ok(2.0 * largest_facet(contact, pair, mesh, points)?),
    }
}

/// The mortar interface of a pair on contact points at the positions `points`.
fn interface_of(
    case: &Case,
    contact: &file::Contact,
    pair: usize,
    mesh: &Mesh,
    points: &[[f64; 3]],
    mirrored: &[[bool; 3]],
    reach: f64,
) -> Result<ContactInterface, BuildError> {
    let [slave, master] = sides(contact, pair, mesh)?;
    let rule = CellRule::with_points(contact.cell_rule).ok_or_else(|| {
        let message = format!("there is no rule with {} points", contact.cell_rule);
        BuildError::new(format!("contact[{pair}].cell_rule"), message, "choose 1, 3, 6, 7 or 12")
    })?;
    // the averaged normals of tied surfaces only orient the components of their traction
    let feature_angle = if contact.tied { std::f64::consts::PI } else { contact.feature_angle.to_radians() };
    let shape = contact.multiplier_shape.unwrap_or_default();
    let options = InterfaceOptions { shape, rule, reach, feature_angle };
    let interface = ContactInterface::new(slave, master, points.as_flattened(), options)
        .map_err(|e| BuildError::new(format!("contact[{pair}]"), e, "choose two surfaces of different bodies"))?;
    let interface = interface.with_symmetry(|node| mirrored[node as usize]);
    let heights = [interface.slave_facets(), interface.master_facets()].map(|facets| {
        let smooth = surfaces::smooth(case, contact, mesh, points, facets, mirrored);
        surfaces::heights(smooth, facets, points)
    });
    let interface = interface.with_heights(heights);
    let interface = if contact.enforcement.is_at_points() {
        let faces = [interface.slave_facets(), interface.master_facets()].map(|facets| mesh.quadratic_facets(facets));
        interface.with_quadratic_faces(faces)
    } else {
        interface
    };
    let mean = contact.multiplier_shape.is_none() && interface.is_coarse(points.as_flattened());
    Ok(if mean { interface.with_shape(MultiplierShape::Mean) } else { interface })
}

fn build_interfaces(
    case: &Case,
    mesh: &Mesh,
    mirrored: &[[bool; 3]],
    held: &edges::Held,
    approach: f64,
    ties: ties::Rows,
) -> Result<Vec<ModelInterface>, BuildError> {
    let mut interfaces = Vec::with_capacity(case.contacts.len());
    let points = ContactMap::new(mesh).points(&mesh.nodes);
    for ((i, contact), tie) in case.contacts.iter().enumerate().zip(ties) {
        let size = largest_facet(contact, i, mesh, &points)?;
        let largest_offset = contact.offset.iter().map(|point| point.offset.abs()).fold(0.0, f64::max);
        // at least as far as the bodies can approach each other in one step, so that no contact is
        // missed
        let adjust = contact.adjust.as_ref().map_or(0.0, |adjust| {
            let distance = adjust.distance();
            adjust.gap().abs() + if distance.is_finite() { distance } else { size }
        });
        let across = contact.enforcement.pressure_law().map_or(0.0, |law| law.reach());
        let reach = match contact.tied {
            true => tie_reach(contact, i, mesh, &points)?,
            false => contact.search_radius.unwrap_or(2.0 * size + 1.5 * approach + largest_offset + adjust + across),
        };
        if reach < approach && !contact.tied {
            let message = format!(
                "bodies may approach each other by {approach:.3e} in one load step, \
                 more than the search radius {reach:.3e}"
            );
            let help = "raise the search radius, omit it, or use more load steps; otherwise contact may be missed";
            return Err(BuildError::new(format!("contact[{i}].search_radius"), message, help));
        }
        check_stiffness(mesh, contact, i)?;
        if let Some(first) = case.contacts[..i].iter().position(|other| other.slave == contact.slave) {
            // quantities, load cases and tables name a pair by its slave surface
            let message =
                format!("`{}` is the slave of contact[{first}] too, and pairs are named by it", contact.slave);
            let help = format!(
                "swap slave and master of one of the pairs, or give the slave a second name: a [[surface]] with \
                 `of = [\"{}\"]`",
                contact.slave
            );
            return Err(BuildError::new(format!("contact[{i}].slave"), message, help));
        }
        let interface = interface_of(case, contact, i, mesh, &points, mirrored, reach)?;
        let interface = match contact.tied {
            true => interface,
            false => {
                let interface = interface.with_trusted_depth(1.5 * approach + largest_offset + adjust);
                edges::with_normals(interface, contact, &case.bodies, mesh, &points, mirrored, held)
            }
        };
        let interface = match &contact.adjust {
            Some(adjust) if contact.enforcement.is_at_points() => {
                interface.with_closed_gaps(points.as_flattened(), remaining_gap(contact, adjust, mesh))
            }
            _ => interface,
        };
        let slants = match contact.offset.is_empty() {
            true => Vec::new(),
            false => interface.slants(points.as_flattened()).map_err(|e| folded(&e, i))?,
        };
        interfaces.push(ModelInterface {
            surfaces: [contact.slave.clone(), contact.master.clone()],
            friction: contact.friction,
            friction_path: contact.friction_path.clone(),
            shear_limit: contact.shear_limit.unwrap_or(f64::INFINITY),
            offset: contact.offset.clone(),
            adjusted: adjusted(&interface, contact, mesh, &points, &slants, i)?,
            slants,
            active: contact.active,
            bond: tie.map(Arc::new),
            edge_cover: contact.edge_cover,
            enforcement: given(&contact.enforcement),
            pressure: contact.enforcement.pressure_law(),
            at_points: contact.enforcement.is_at_points(),
            interface,
        });
    }
    Ok(interfaces)
}

fn folded(error: &InterfaceError, pair: usize) -> BuildError {
    BuildError::new(format!("contact[{pair}]"), error, "choose surfaces without folds")
}

/// For each slave node, the part of its gap in the mesh that does not count: [`file::Contact::adjust`].
fn adjusted(
    interface: &ContactInterface,
    contact: &file::Contact,
    mesh: &Mesh,
    points: &[[f64; 3]],
    slants: &[f64],
    pair: usize,
) -> Result<Vec<f64>, BuildError> {
    let Some(adjust) = &contact.adjust else { return Ok(Vec::new()) };
    let nodes = set_to_adjust(adjust, mesh);
    let slaves = interface.slave_nodes();
    let chosen = |k: usize| nodes.as_ref().is_none_or(|nodes| nodes.binary_search(&slaves[k].node).is_ok());
    if let (Some(set), false) = (adjust.nodes(), (0..slaves.len()).any(chosen)) {
        let message = format!("no node of `{set}` is on the slave surface `{}`", contact.slave);
        return Err(BuildError::new(
            format!("contact[{pair}].adjust.nodes"),
            message,
            "name a set of nodes of the slave",
        ));
    }
    let coordinates = points.as_flattened();
    let offset = OffsetPoint::at(&contact.offset, contact.active[0]);
    let gaps = ModelInterface::gaps_of(interface, coordinates, offset, slants).map_err(|e| folded(&e, pair))?;
    let of = |(k, gap): (usize, Option<f64>)| {
        let within = |gap: &f64| gap.abs() <= adjust.distance() && chosen(k);
        gap.filter(within).map_or(0.0, |gap| gap - adjust.gap())
    };
    Ok(gaps.into_iter().enumerate().map(of).collect())
}

/// Where pressures follow from the gaps at points: the gap that remains of that of a node, if the node is adjusted.
pub(crate) fn remaining_gap<'a>(
    contact: &file::Contact,
    adjust: &'a file::Adjust,
    mesh: &'a Mesh,
) -> impl Fn(u32, f64) -> Option<f64> + 'a {
    let (set, offset) = (set_to_adjust(adjust, mesh), OffsetPoint::at(&contact.offset, contact.active[0]));
    move |node, gap| {
        let chosen = set.as_ref().is_none_or(|set| set.binary_search(&node).is_ok());
        (chosen && (gap - offset).abs() <= adjust.distance()).then_some(adjust.gap() + offset)
    }
}

/// The nodes that an `adjust` names; `None`: all.
fn set_to_adjust<'a>(adjust: &file::Adjust, mesh: &'a Mesh) -> Option<Cow<'a, [u32]>> {
    adjust.nodes().map(|set| mesh.set_nodes(set).unwrap_or_default())
}

/// The mortar rows of tied surfaces, which must lie opposite each other in the mesh.
fn bond(interface: &ContactInterface, coordinates: &[f64], pair: usize) -> Result<Vec<NodeKinematics>, BuildError> {
    let rows = ModelInterface::bond_of(interface, coordinates)
        .map_err(|e| BuildError::new(format!("contact[{pair}]"), e, "tie two surfaces that lie on each other"))?;
    if rows.iter().all(|row| row.area == 0.0) {
        let message = "the master surface lies nowhere opposite the slave surface, so nothing ties them";
        let help = "tie two surfaces that lie on each other, or raise `search_radius`";
        return Err(BuildError::new(format!("contact[{pair}]"), message, help));
    }
    Ok(rows)
}

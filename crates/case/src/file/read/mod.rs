//! Converts the parsed tables to the [`Case`]: one file per part of the case.

mod bodies;
mod bolt;
pub(crate) mod common;
mod contact;
mod design;
mod equation;
mod load;
mod load_case;
mod mesh_file;
mod motion;
mod promise;
mod quantity;
mod run;
mod schedule;
mod sets;
mod shaping;
mod spring;
mod symmetry;
mod temperature;

use super::document::Table;
use super::names::Names;
use super::resolved::Case;
use crate::quantity::{Known, Slaves};
pub use mesh_file::ReadFile;
pub(super) use schedule::late;

/// Reads the whole document, and the files that it refers to with `files`. After an error the
/// result is a placeholder that must not be used. The contact pairs whose numbers are in `exchanged` have
/// slave and master swapped.
pub(super) fn case(root: Table<'_>, files: ReadFile<'_>, exchanged: &[usize]) -> Case {
    let mut names = Names::default();
    let title = root.string("title").or(String::new());
    let units = run::units(&root);
    let bodies = bodies::bodies(&root, &mut names, &mesh_file::MeshFiles::new(files));
    let surfaces = sets::surfaces(&root, &mut names);
    let sets = sets::sets(&root, &mut names);
    let points = equation::points(&root, &mut names);
    let couplings = equation::couplings(&root, &mut names);
    // what has a rotation
    let rigid = bodies.iter().filter(|body| body.rigid.is_some()).map(|body| body.name.as_str());
    let turning: Vec<&str> = rigid.chain(couplings.iter().map(|coupling| coupling.name.as_str())).collect();
    let symmetries = symmetry::symmetries(&root);
    let load_path = motion::load_path(&root);
    let bolts = bolt::bolts(&root, &mut names, &bodies, load_path.steps);
    let contacts = contact::contacts(&root, &names, &bodies, load_path.steps, exchanged);
    let load_cases = load_case::load_cases(&root, &names, &contacts);
    let dirichlet = motion::dirichlet(&root, &names, &turning, &load_cases, load_path.steps);
    let loads = load::loads(&root, &names, (&turning, &bodies), &load_cases, load_path.steps);
    let springs = spring::springs(&root, &names);
    let equations = equation::equations(&root, &names);
    let temperatures = temperature::temperatures(&root, &names, &bodies, &load_cases, load_path.steps);
    let moving = dirichlet.iter().filter(|d| !d.motion.is_empty()).map(|d| (d.set.clone(), d.load_case.clone()));
    let (moving, loaded): (Vec<load_case::Named>, Vec<load_case::Named>) =
        (moving.collect(), loads.iter().map(|load| (load.target().to_owned(), load.load_case.clone())).collect());
    let heated = temperatures.iter().map(|temperature| temperature.load_case.clone());
    let tightened = bolts.iter().map(|_| None);
    let driven = moving.iter().chain(&loaded).map(|(_, of)| of.clone()).chain(heated).chain(tightened);
    let driven: Vec<Option<String>> = driven.collect();
    load_case::warn_idle(&root, &load_cases, &driven);
    load_case::check_differences(&root, &load_cases, &moving, &loaded);
    let design = design::design(&root, &names, &bodies);
    let springs_by_name = springs.iter().map(|spring| spring.name.as_str()).collect();
    let bolts_by_name = bolts.iter().map(|bolt| bolt.name.as_str()).collect();
    let known =
        Known { names: &names, slaves: Slaves::of(&contacts, &names), springs: springs_by_name, bolts: bolts_by_name };
    let quantities = quantity::quantities(&root, &known);
    let objective = quantity::objective(&root, &quantities, &known, load_path.steps);
    let constraints = quantity::constraints(&root, &quantities, load_path.steps);
    let promises = promise::promises(&root, load_cases.len().max(1), load_path.steps);
    let optimizer = design::optimizer(&root, design.as_ref());
    if let Some(design) = &design {
        design::warn_initial(root.reader, design, optimizer.as_ref());
    }
    let output = run::output(&root);
    let solver = run::solver(&root);
    let adjoint = run::adjoint(&root);
    // symmetry planes support bodies too, but which ones is only known with the mesh
    if symmetries.is_empty() && equations.is_empty() && couplings.is_empty() {
        motion::warn_unsupported(&root, &names, &bodies, &contacts, &dirichlet, &springs);
    }
    root.finish();
    Case {
        title,
        units,
        bodies,
        surfaces,
        sets,
        symmetries,
        contacts,
        load_cases,
        dirichlet,
        loads,
        springs,
        points,
        equations,
        couplings,
        bolts,
        temperatures,
        load_path,
        design,
        quantities,
        objective,
        constraints,
        promises,
        optimizer,
        output,
        solver,
        adjoint,
    }
}

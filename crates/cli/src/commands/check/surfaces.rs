//! The named surfaces of a case as a picture.

use std::path::Path;

use slipstick::case::{Case, Component, Dimension};
use slipstick::check::SurfaceSummary;
use slipstick::mesh::Mesh;
use slipstick::render::{Canvas, SurfaceLabel, surfaces_picture};
use slipstick::words::{counted, quantity};

use crate::commands::render::save;
use crate::console::Console;
use crate::setup::Setup;
use slipstick_service::failure::{Failure, Outcome};

/// The largest number of surfaces in one picture.
const MOST: usize = 60;

const PANEL: Canvas = Canvas { width: 480, height: 400, supersampling: 2 };

/// Draws all surfaces; if there are too many, those that the case uses.
pub fn draw(console: &Console, setup: &Setup, mesh: &Mesh, file: &Path) -> Outcome {
    let (all, case) = (&setup.checked.inspection.surfaces, &setup.checked.resolved.case);
    let mut shown: Vec<&SurfaceSummary> = all.iter().collect();
    let mut left_out = String::new();
    if shown.len() > MOST {
        shown.retain(|surface| !uses(case, &surface.name).is_empty());
        shown.truncate(MOST);
        left_out = format!(" of {}: those that the case uses", all.len());
    }
    let labels: Vec<SurfaceLabel> = shown.iter().map(|surface| label(case, surface)).collect();
    let picture =
        surfaces_picture(mesh, &labels, &PANEL).map_err(|error| Failure::input(error.to_string(), "omit --picture"))?;
    save(&picture, file)?;
    console.text(&format!("\n{}{left_out} in {}", counted(labels.len(), "surface"), file.display()));
    Ok(())
}

/// Body, size, normal and use of a surface.
fn label(case: &Case, surface: &SurfaceSummary) -> SurfaceLabel {
    let unit = case.units.bracket(Dimension::AREA).replace(['[', ']'], "");
    let area = format!("area {}{unit}", quantity(surface.area));
    let normal = surface.normal.map_or("all around".into(), |normal| {
        let [x, y, z] = normal.map(|x| (100.0 * x).round() / 100.0 + 0.0);
        format!("normal ({x}, {y}, {z})")
    });
    let facts = format!("{}: {area}, {normal}", surface.bodies.join(", "));
    let uses = uses(case, &surface.name);
    let lines = std::iter::once(facts).chain((!uses.is_empty()).then(|| uses.join(", ")));
    SurfaceLabel { name: surface.name.clone(), lines: lines.collect(), normal: surface.normal }
}

/// What contact, supports and loads do with a surface.
fn uses(case: &Case, name: &str) -> Vec<String> {
    let mut all: Vec<String> = Vec::new();
    for pair in &case.contacts {
        for (side, of, other) in [("slave", &pair.slave, &pair.master), ("master", &pair.master, &pair.slave)] {
            if of == name {
                all.push(format!("{side}, facing {other}"));
            }
        }
    }
    for support in case.dirichlet.iter().filter(|support| support.set == name) {
        let letter = |component: &Component| ["x", "y", "z"][component.index()];
        let components: String = support.components.iter().map(letter).collect();
        all.push(format!("{} in {components}", if support.motion.is_empty() { "held" } else { "moved" }));
    }
    if case.loads.iter().any(|load| load.surface == name) {
        all.push("loaded".into());
    }
    all.dedup();
    all
}

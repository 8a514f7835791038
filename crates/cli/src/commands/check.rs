//! `slipstick check`: checks a case without running it.

use serde_json::json;
use slipstick::build::Problem;
use slipstick::case::{Component, Dimension, Ledger, LoadKind, Severity, Units};
use slipstick::check::{Inspection, SectionSummary, StartGap, SurfaceKind, SurfacePart, SurfaceSummary};
use slipstick::words::{counted, rounded};
use slipstick_service::check::Checked;

use super::render::replaceable;
use crate::args::Check;
use crate::context::Context;
use crate::host::adjusted;
use crate::setup::{Setup, look, read};
use crate::summary::digits;
use crate::table::lines;
use slipstick_service::failure::{Failure, Outcome};
use slipstick_service::memory::bytes;
use slipstick_service::read::keywords;

mod surfaces;

/// Floating-point operations per second for the time estimate; about half of what one core of a
/// desktop machine reaches in the factorization.
const OPERATIONS_PER_SECOND: f64 = 15e9;

/// Prints sizes, sets, supports, contact pairs and initial gaps, with warnings at their place in
/// the file; or the case with all defaults filled in.
///
/// # Errors
/// [`Failure::Case`], [`Failure::Input`].
pub fn run(context: &Context, args: &Check) -> Outcome {
    let resolved = read(&args.case)?;
    if args.resolved {
        context.console.warnings(&resolved.warnings);
        let text = toml::to_string_pretty(&resolved.case).map_err(|error| {
            Failure::input(format!("the case cannot be written as TOML: {error}"), "keep numbers below 2⁶³")
        })?;
        if context.console.json() {
            context.console.event("result", json!({ "command": "check", "case": resolved.case }));
        } else {
            context.console.raw(&text);
        }
        return Ok(());
    }
    if let Some(file) = &args.picture {
        replaceable(file, "--picture")?;
    }
    let (setup, problem) = look(context, &args.case.case, resolved)?;
    let too_large = setup.checked.too_large(context, Severity::Warning, true);
    context.console.warnings(too_large.as_slice());
    let mut warnings = setup.checked.warnings.len() + usize::from(too_large.is_some());
    warnings += setup.warn_of_volume(context, &problem, setup.starts_above_bound());
    let seconds = setup.checked.forecast.factor_operations / OPERATIONS_PER_SECOND;
    let on = &setup.checked.forecast.on_ranks;
    let ranks = args.ranks.map(usize::from);
    let on_ranks = ranks.map(|ranks| json!({ "ranks": ranks, "each": on.of_each(ranks), "kept": on.kept(ranks) }));
    let of_deck = setup.checked.resolved.deck.as_ref().map(keywords);
    let told = json!({
        "command": "check", "deck": of_deck, "inspection": setup.checked.facts(), "factor_seconds": seconds, "bytes_on_ranks": on_ranks,
    });
    context.console.event("result", told);
    let console = &context.console;
    if !setup.checked.resolved.case.title.is_empty() {
        console.text(&setup.checked.resolved.case.title);
    }
    if let Some(ledger) = &setup.checked.resolved.deck {
        console.text("\ndeck");
        console.lines(&deck(ledger));
    }
    console.text("\nbodies");
    console.lines(&bodies(&setup.checked.inspection, &setup.checked.resolved.case.units));
    if !setup.checked.inspection.sections.is_empty() {
        console.text("\nmaterials of bodies with sections");
        console.lines(&sections(&setup.checked.inspection, &setup.checked.resolved.case.units));
    }
    console.text("\nsurfaces");
    console.lines(&named_surfaces(&setup.checked.inspection, &setup.checked.resolved.case.units));
    let sets = node_sets(&setup.checked.inspection);
    if !sets.is_empty() {
        console.text("\nnode sets");
        console.lines(&lines(&["name", "nodes"], &sets));
    }
    for plane in &setup.checked.resolved.case.symmetries {
        let letter = ["x", "y", "z"][plane.normal.index()];
        console.text(&format!("\nsymmetry plane {letter} = {}", plane.at));
    }
    if !setup.checked.resolved.case.load_cases.is_empty() {
        console.text("\nload cases");
        let rows =
            setup.checked.resolved.case.load_cases.iter().map(|case| vec![case.name.clone(), digits(case.weight)]);
        console.lines(&lines(&["name", "weight"], &rows.collect::<Vec<_>>()));
    }
    console.text("\nsupports and motions");
    console.lines(&supports(&setup, &problem));
    if !setup.checked.resolved.case.loads.is_empty() {
        console.text("\nloads");
        console.lines(&loads(&setup, &setup.checked.resolved.case.units));
    }
    if !setup.checked.inspection.contacts.is_empty() {
        console.text("\ncontact, at the start");
        console.lines(&contacts(&setup));
        sharp_edges(&setup).iter().for_each(|line| console.text(line));
        adjusted(&setup.checked.inspection).iter().for_each(|line| console.text(&format!("  {line}")));
        let curved = surfaces(&setup);
        if !curved.is_empty() {
            console.text("\nsurfaces for which the facets of contact pairs stand");
            console.lines(&curved);
        }
    }
    if let Some(objective) = setup.checked.resolved.case.objective_in_words() {
        console.text("\nobjective");
        console.text(&format!("  {objective}"));
    }
    console.text("\nsize");
    console.lines(&size(&setup.checked, seconds, args.ranks.map(usize::from)));
    if let Some(file) = &args.picture {
        surfaces::draw(console, &setup, &problem.mesh, file)?;
    }
    console.text(if warnings == 0 { "\nno warnings" } else { "\nsee the warnings" });
    Ok(())
}

/// How the keywords of a deck were treated.
pub(super) fn deck(ledger: &Ledger) -> Vec<String> {
    let rows = ledger.table();
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let [keyword, word, at] = [0, 1, 2].map(width);
    let line = |[a, b, c, d]: &[String; 4]| format!("  {a:keyword$}  {b:word$}  {c:at$}  {d}").trim_end().to_owned();
    let head = ["keyword", "", "lines", ""].map(str::to_owned);
    std::iter::once(&head).chain(&rows).map(line).collect()
}

fn bodies(inspection: &Inspection, units: &Units) -> Vec<String> {
    let rows: Vec<_> = inspection
        .bodies
        .iter()
        .map(|body| {
            vec![
                body.name.clone(),
                body.elements.to_string(),
                body.nodes.to_string(),
                digits(body.volume),
                format!("{:.3}", body.quality),
                body.free_motions.to_string(),
            ]
        })
        .collect();
    let volume = format!("volume{}", units.bracket(Dimension::VOLUME));
    lines(&["name", "elements", "nodes", &volume, "worst quality", "free rigid motions"], &rows)
}

fn sections(inspection: &Inspection, units: &Units) -> Vec<String> {
    let row = |of: &SectionSummary| {
        vec![of.body.clone(), of.region.clone(), of.elements.to_string(), digits(of.volume), of.material.clone()]
    };
    let rows: Vec<_> = inspection.sections.iter().map(row).collect();
    lines(&["body", "region", "elements", &format!("volume{}", units.bracket(Dimension::VOLUME)), "material"], &rows)
}

fn named_surfaces(inspection: &Inspection, units: &Units) -> Vec<String> {
    let direction = |normal: [f64; 3]| {
        let [x, y, z] = normal.map(|x| (100.0 * x).round() / 100.0 + 0.0);
        format!("({x}, {y}, {z})")
    };
    let row = |surface: &SurfaceSummary| {
        let (name, bodies) = (surface.name.clone(), surface.bodies.join(", "));
        let (facets, nodes) = (surface.facets.to_string(), surface.nodes.to_string());
        let normal = surface.normal.map_or("all around".into(), direction);
        vec![name, bodies, facets, nodes, digits(surface.area), normal]
    };
    let area = format!("area{}", units.bracket(Dimension::AREA));
    let rows: Vec<_> = inspection.surfaces.iter().map(row).collect();
    lines(&["name", "body", "facets", "nodes", &area, "mean normal"], &rows)
}

/// Node sets that are not surfaces.
fn node_sets(inspection: &Inspection) -> Vec<Vec<String>> {
    let is_surface = |name: &String| inspection.surfaces.iter().any(|surface| surface.name == *name);
    let sets = inspection.sets.iter().filter(|(name, _)| !is_surface(name));
    sets.map(|(name, nodes)| vec![name.clone(), nodes.to_string()]).collect()
}

fn supports(setup: &Setup, problem: &Problem) -> Vec<String> {
    let rows: Vec<_> = setup
        .checked
        .resolved
        .case
        .dirichlet
        .iter()
        .map(|condition| {
            let nodes = problem.mesh.set_nodes(&condition.set).map_or(0, |nodes| nodes.len());
            let letter = |component: &Component| ["x", "y", "z"][component.index()];
            let components: String = condition.components.iter().map(letter).collect();
            let (u, angle) = condition.at(1.0);
            let motion = match (condition.motion.is_empty(), angle == 0.0) {
                (true, _) => "held".into(),
                (false, true) => shown(u),
                (false, false) => format!("{}, {}°", shown(u), rounded(angle, 12)),
            };
            let from = (condition.from > 0.0).then(|| format!(", from t = {}", rounded(condition.from, 6)));
            let until = condition.until.map(|until| format!(", free after t = {}", rounded(until.t, 6)));
            let motion = format!("{motion}{}{}", from.unwrap_or_default(), until.unwrap_or_default());
            let case = condition.load_case.clone().unwrap_or_else(|| "all".into());
            vec![condition.set.clone(), nodes.to_string(), components, motion, case]
        })
        .collect();
    lines(columns(setup, &["set", "nodes", "components", "at the end", "load case"]), &rows)
}

/// A vector of the case times a factor, without round-off.
fn shown(v: [f64; 3]) -> String {
    format!("{:?}", v.map(|x| rounded(x, 12)))
}

fn loads(setup: &Setup, units: &Units) -> Vec<String> {
    let rows: Vec<_> = setup
        .checked
        .resolved
        .case
        .loads
        .iter()
        .map(|load| {
            let factor = load.factor(1.0);
            let (kind, value, dimension) = match load.kind {
                LoadKind::Pressure(p) => ("pressure", digits(factor * p), Dimension::STRESS),
                LoadKind::Traction(t) => ("traction", shown(t.map(|t| factor * t)), Dimension::STRESS),
                LoadKind::Force(f) => ("force", shown(f.map(|f| factor * f)), Dimension::FORCE),
                LoadKind::NodalForce(f) => ("force on each node", shown(f.map(|f| factor * f)), Dimension::FORCE),
                LoadKind::Gravity(g) => ("acceleration", shown(g.map(|g| factor * g)), Dimension::NONE),
                LoadKind::Centrifugal(about) => {
                    ("rotation, ω²", digits(factor * about.angular_velocity.powi(2)), Dimension::NONE)
                }
                LoadKind::Moment(m) => ("moment", shown(m.map(|m| factor * m)), Dimension::WORK),
            };
            let case = load.load_case.clone().unwrap_or_else(|| "all".into());
            vec![load.target().to_owned(), format!("{kind}{}", units.bracket(dimension)), value, case]
        })
        .collect();
    lines(columns(setup, &["surface", "load", "at the end", "load case"]), &rows)
}

/// The columns of a table; the last one, the load case, is left out if there are none.
fn columns<'a>(setup: &Setup, all: &'a [&'a str]) -> &'a [&'a str] {
    &all[..all.len() - usize::from(setup.checked.resolved.case.load_cases.is_empty())]
}

fn contacts(setup: &Setup) -> Vec<String> {
    let shown = |gap: Option<f64>, node: Option<u32>| match (gap, node) {
        (Some(gap), Some(node)) => format!("{:.3e} at node {node}", gap + 0.0),
        _ => "no node faces it".into(),
    };
    let rows: Vec<_> = setup
        .checked
        .inspection
        .contacts
        .iter()
        .zip(&setup.checked.resolved.case.contacts)
        .flat_map(|(pair, case)| {
            // a row for each load case, if bodies start elsewhere in any
            let of_case = |of: &StartGap| {
                let mut row = vec![String::new(); 6];
                row.push(format!("{} in {}", shown(of.smallest_gap, of.at_node), of.load_case));
                row
            };
            let mut gaps = pair.load_cases.iter().map(of_case);
            let first = gaps.next().and_then(|mut row| row.pop());
            let gap = first.unwrap_or_else(|| shown(pair.smallest_gap, pair.at_node));
            let row = vec![
                format!("{} on {}", pair.slave, pair.master),
                format!("{} / {}", pair.facets[0], pair.facets[1]),
                pair.slave_nodes.to_string(),
                pair.covered.to_string(),
                if case.tied { "tied".into() } else { case.friction.to_string() },
                format!("{:.3e}", pair.reach),
                gap,
            ];
            std::iter::once(row).chain(gaps).collect::<Vec<_>>()
        })
        .collect();
    let length = setup.checked.resolved.case.units.bracket(Dimension::LENGTH);
    let [searched, gap] = ["search radius", "smallest mean gap"].map(|name| format!("{name}{length}"));
    let header = ["slave on master", "facets", "slave nodes", "facing the master", "friction"];
    lines(&[&header[..], &[&searched, &gap]].concat(), &rows)
}

/// The parts of the sides of contact pairs that are not flat.
fn surfaces(setup: &Setup) -> Vec<String> {
    let mut rows = Vec::new();
    for pair in &setup.checked.inspection.contacts {
        for (side, (name, parts)) in
            ["slave", "master"].iter().zip([&pair.slave, &pair.master].iter().zip(&pair.surfaces))
        {
            for part in parts {
                let (facets, height) = (part.facets.to_string(), format!("{:.3e}", part.height));
                rows.push(vec![format!("{name}, {side}"), part.name.clone(), facets, height]);
            }
        }
    }
    let length = setup.checked.resolved.case.units.bracket(Dimension::LENGTH);
    let height = format!("largest height{length}");
    match setup.checked.inspection.contacts.iter().flat_map(|pair| pair.surfaces.iter().flatten()).all(is_flat) {
        true => Vec::new(),
        false => lines(&["side", "surface", "facets", &height], &rows),
    }
}

fn is_flat(part: &SurfacePart) -> bool {
    part.kind == SurfaceKind::Flat
}

/// One line for each contact pair whose slave surface has sharp edges.
fn sharp_edges(setup: &Setup) -> Vec<String> {
    let pairs = setup.checked.inspection.contacts.iter().zip(&setup.checked.resolved.case.contacts);
    let sharp = pairs.filter(|(pair, _)| pair.sharp_nodes > 0);
    sharp
        .map(|(pair, case)| {
            let (nodes, slave) = (counted(pair.sharp_nodes, "node"), &pair.slave);
            let lie = if pair.sharp_nodes == 1 { "lies" } else { "lie" };
            format!(
                "  {nodes} of {slave} {lie} on edges sharper than {}°: each side has its own normals",
                case.feature_angle
            )
        })
        .collect()
}

fn size(Checked { inspection, forecast, .. }: &Checked, seconds: f64, ranks: Option<usize>) -> Vec<String> {
    let row = |name: &str, value: String| vec![name.to_owned(), value];
    let on_gpu = forecast.factors_on_gpu;
    let designed = match inspection.variables {
        variables if variables == inspection.designed => inspection.designed.to_string(),
        variables => format!("{}, which share {}", inspection.designed, counted(variables, "variable")),
    };
    let mut rows = vec![
        row("load steps", inspection.steps.to_string()),
        row("unknowns of a step", forecast.unknowns.to_string()),
        row("designed elements", designed),
        row(if on_gpu { "factors on the GPU, predicted" } else { "factors, predicted" }, bytes(forecast.factor_bytes)),
        row("steps that keep them for the gradient", forecast.steps_with_factors.to_string()),
        row("predicted memory of a run", bytes(forecast.peak_bytes - forecast.kept_bytes)),
        row("plus kept factors, at most", bytes(forecast.kept_bytes)),
    ];
    if !on_gpu {
        rows.push(row("one factorization, roughly", format!("{seconds:.2} s on one core")));
    }
    if forecast.iterative {
        rows.push(row("linear solver", "iterative".to_owned()));
    }
    if let Some(ranks) = ranks {
        let on = &forecast.on_ranks;
        rows.push(row(&format!("memory on each of {}", counted(ranks, "rank")), bytes(on.of_each(ranks))));
        rows.push(row("plus kept factors, on each at most", bytes(on.kept(ranks))));
    }
    lines(&["", ""], &rows).split_off(1)
}

//! `slipstick export --case`: the design as a part, with a case that analyses it.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use serde_json::{Value, json};
use slipstick::case::{Case, Promise};
use slipstick::mesh::{Element, Mesh};
use slipstick::output::{read_fields, write_atomically};
use slipstick::part::{
    Acts, LoosePiece, NamedFace, Part, PartBody, PerNode, Reduced, SCRIPT, Scarce, Touching, write_moves, write_script,
    write_surface,
};
use slipstick::run::{RunDirectory, mesh_files, promises, unmet};
use slipstick::words::{self, counted, shell_word};

use super::super::solve::beyond;
use super::summary;
use crate::args::Export;
use crate::context::Context;
use crate::runs::refuse_shared;
use crate::summary::digits;
use crate::table::lines;
use slipstick_service::failure::{Failure, Outcome};

/// The file with all numbers of the part.
const RECORD: &str = "part.json";

/// Refuses the folder of a run, and a folder that has a case, unless it is the case of a part and may
/// be replaced.
pub(super) fn refuse(folder: &Path, force: bool) -> Outcome {
    refuse_shared(folder, "files of the part", "--case part")?;
    let case = folder.join("case.toml");
    let refused = |message: String, cure| Err(Failure::input(message, cure));
    if RunDirectory::open(folder).is_ok() {
        return refused(
            format!("{} holds a run, whose case would be replaced", folder.display()),
            "name another folder",
        );
    }
    if case.exists() && !folder.join(RECORD).exists() {
        return refused(format!("{} is not the case of a part", case.display()), "name another folder");
    }
    if case.exists() && !force {
        let cure = "name another folder, or give --force to replace its case";
        return refused(format!("{} already exists", case.display()), cure);
    }
    Ok(())
}

/// Writes the files of a part and says what they contain.
pub(super) fn write(
    context: &Context,
    args: &Export,
    run: &RunDirectory,
    design: &Case,
    (mesh, density): (&Mesh, &[f64]),
    mut part: Part,
    folder: &Path,
    measures: Option<Value>,
) -> Outcome {
    // the tables of a run belong to its last design
    let promised = if args.iteration.is_none() { promises(run, design)? } else { Vec::new() };
    part.case.promises.clone_from(&promised);
    let touched = if promised.is_empty() { Touched::new() } else { touched(run, mesh, &part)? };
    fs::create_dir_all(folder).map_err(|error| {
        Failure::input(format!("cannot create {}: {error}", folder.display()), "check its name and permissions")
    })?;
    let case_file = run.file("case.toml");
    let read = mesh_files(&case_file);
    let restore = |name: &String, error| Failure::input(format!("{name}: {error}"), "restore the file");
    let copies: Vec<(&String, Vec<u8>)> = part
        .copies
        .iter()
        .map(|(name, copy)| Ok((copy, read(name).map_err(|error| restore(name, error))?)))
        .collect::<Outcome<_>>()?;
    // what belongs to an earlier design would be taken for this one; the case is written last
    let meshes = part.bodies.iter().map(PartBody::mesh_file);
    for name in meshes.chain(["case.toml".to_owned()]) {
        match fs::remove_file(folder.join(&name)) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                let message = format!("cannot remove {}: {error}", folder.join(&name).display());
                return Err(Failure::input(message, "check the permissions of the folder"));
            }
            _ => {}
        }
    }
    for (copy, bytes) in copies {
        write_atomically(&folder.join(copy), |writer| writer.write_all(&bytes))?;
    }
    for body in &part.bodies {
        write_surface(&folder.join(body.surface_file()), body)?;
        write_moves(&folder.join(body.curved_file()), body)?;
    }
    if !part.bodies.is_empty() {
        write_script(&folder.join(SCRIPT), &part.bodies)?;
    }
    let record = json!({
        "threshold": part.export.threshold, "density_volume": part.export.density_volume,
        "crossings": part.export.surface.crossings(), "whole": part.whole, "bodies": part.bodies.iter().map(|body| of_body(body, &touched)).collect::<Vec<_>>(), "promises": promised,
        "measures": measures,
    });
    let text = format!("{record:#}\n");
    write_atomically(&folder.join(RECORD), |writer| writer.write_all(text.as_bytes()))?;
    let case = case_text(&part, &promised)?;
    write_atomically(&folder.join("case.toml"), |writer| writer.write_all(case.as_bytes()))?;
    context.console.event("part", json!({ "folder": folder, "part": record }));
    tell(context, folder, &part, &promised, &touched);
    for of in unmet(&promised, design) {
        let Some((bound, by)) = of.violation() else { continue };
        context.console.warning(&format!(
            "the design violates a bound: `{}` is {}, {} beyond {}; its part probably does so, too",
            of.name(),
            digits(of.promised),
            beyond(bound, by),
            words::bound(bound)
        ));
    }
    if !promised.is_empty() {
        expect(context, run, design, &part, (mesh, density));
    }
    Ok(())
}

/// For each face, the contact force of the design at the state where it is largest, the share of it on the part, and
/// the number of that state.
type Touched = BTreeMap<String, (Touching, usize)>;

/// The contact forces of the design on the faces of the part's contact pairs.
fn touched(run: &RunDirectory, mesh: &Mesh, part: &Part) -> Outcome<Touched> {
    let pairs = part.case.contacts.iter().filter(|pair| !pair.tied).flat_map(|pair| [&pair.slave, &pair.master]);
    let has = |body: &PartBody, name: &str| body.faces.iter().any(|face| face.name == name);
    let names: BTreeSet<&String> = pairs.filter(|name| part.bodies.iter().any(|body| has(body, name))).collect();
    let mut found = Touched::new();
    if names.is_empty() {
        return Ok(found);
    }
    for state in run.numbers("path")? {
        let fields = read_fields(&run.file(&RunDirectory::numbered("path", state)))?;
        let Some(forces) = fields.iter().find(|field| field.name == "contact_force") else { continue };
        for &name in &names {
            // a face may lie on several bodies
            let each = part.bodies.iter().filter_map(|body| body.touching(mesh, name, &forces.values));
            let Some(touching) = each.reduce(Touching::with) else { continue };
            if found.get(name).is_none_or(|(known, _)| touching.force > known.force) {
                found.insert(name.clone(), (touching, state));
            }
        }
    }
    Ok(found)
}

/// Discreteness from which a warning says that the part is stiffer than the grey design.
const GREY: f64 = 0.1;

/// Says why the promised values differ from those of the part: intermediate densities make a design too
/// soft, linear tetrahedra too stiff.
fn expect(context: &Context, run: &RunDirectory, design: &Case, part: &Part, (mesh, density): (&Mesh, &[f64])) {
    let volumes = mesh.element_volumes();
    for body in &part.bodies {
        let Some(of_mesh) = mesh.body(&body.name) else { continue };
        let elements = || of_mesh.elements.clone();
        let grey: f64 = elements().map(|e| 4.0 * volumes[e] * density[e] * (1.0 - density[e])).sum();
        let discreteness = grey / elements().map(|e| volumes[e]).sum::<f64>();
        if discreteness >= GREY && design.design.as_ref().is_some_and(|design| design.simp.penalization > 1.0) {
            context.console.warning(&format!(
                "`{}` of the design is grey (discreteness {discreteness:.2}): its intermediate densities are softer than \
                 the solid material of the part, so values may differ by tens of per cent; a sharper `projection` in [design] leaves \
                 fewer",
                body.name
            ));
        }
        let number = design.bodies.iter().position(|of| of.name == body.name);
        let linear = |e: usize| matches!(mesh.elements[e], Element::Tet4(_));
        if let Some(number) = number.filter(|_| elements().any(linear)) {
            let run = run.path().display();
            context.console.warning(&format!(
                "`{}` of the design consists of linear tetrahedra, which are too stiff in bending and where material \
                 flows plastically: the part may bear much less than the design promised; `slipstick solve \
                 {run}/case.toml --design {run}/design.csv --set 'body[{number}].order=2'` shows what the design bears \
                 with quadratic ones",
                body.name
            ));
        }
    }
}

/// The case with a heading.
fn case_text(part: &Part, promised: &[Promise]) -> Outcome<String> {
    let text = toml::to_string_pretty(&part.case)
        .map_err(|error| Failure::input(format!("the case cannot be written: {error}"), "report this as a bug"))?;
    let files: Vec<String> = part.bodies.iter().map(PartBody::mesh_file).collect();
    let promise = if promised.is_empty() {
        ""
    } else {
        " `solve` and `report` compare\n# the part with the values that the design promised."
    };
    let made =
        if files.is_empty() { String::new() } else { format!(" `python3 {SCRIPT}` makes {}.", files.join(", ")) };
    Ok(format!("# The part of a design, of solid material.{made}{promise}\n{text}"))
}

fn of_body(body: &PartBody, touched: &Touched) -> Value {
    let loose =
        |piece: &LoosePiece| json!({ "volume": piece.volume, "bounds": piece.bounds, "on_contact": piece.on_contact });
    let faces: serde_json::Map<String, Value> = body
        .faces
        .iter()
        .map(|face| {
            let NamedFace { group, share, area_change, distance, .. } = face;
            (
                face.name.clone(),
                json!({
                    "group": group, "share": share, "area_change": area_change, "distance": distance,
                    "contact_force": touched.get(&face.name).map(|(touching, _)| touching.kept),
                }),
            )
        })
        .collect();
    json!({
        "name": body.name, "size": body.size, "edges": body.edges, "triangles": body.triangles(),
        "tetrahedra": body.tetrahedra, "volume": body.volume,
        "crossings": body.crossings, "pieces": body.pieces.len(), "faces": faces, "loose": body.loose.iter().map(loose).collect::<Vec<_>>(),
        "by_contact": body.by_contact.iter().map(loose).collect::<Vec<_>>(),
    })
}

/// Share of a contact force that a part loses without a warning.
const LOST: f64 = 0.02;

fn lost(touching: &Touching) -> bool {
    touching.kept < 1.0 - LOST
}

/// A count with its two leading digits.
fn rounded(count: usize) -> usize {
    let unit = 10usize.pow(count.checked_ilog10().unwrap_or(0).saturating_sub(1));
    (count + unit / 2) / unit * unit
}

/// How to keep a face whole.
const SKIN: &str = "a solid skin there (`[[design.passive_solid]]` with `surface` and `within`, whose gaps `slipstick check` \
                    names) keeps it";

fn tell(context: &Context, folder: &Path, part: &Part, promised: &[Promise], touched: &Touched) {
    let console = &context.console;
    for name in &part.whole {
        console.text(&format!("part {name}: solid everywhere, so it keeps its mesh (--size remeshes it)"));
    }
    for body in &part.bodies {
        let (name, volume) = (&body.name, digits(body.volume));
        let edges = match body.edges {
            [shortest, longest] if shortest < longest => format!("{} to {}", digits(shortest), digits(longest)),
            _ => digits(body.size),
        };
        let triangles = counted(body.triangles(), "triangle");
        console.text(&format!("part {name}: {triangles} with edges of {edges}; volume {volume}"));
        console.text(&format!(
            "mesh.py fills it with about {} hexahedra, or {} tetrahedra (--tetrahedra); a larger --size gives fewer",
            rounded(4 * body.tetrahedra),
            rounded(body.tetrahedra)
        ));
        let row = |face: &NamedFace| {
            let solid = format!("{:.1} %", 100.0 * face.share);
            match face.patches.is_empty() {
                true => vec![face.name.clone(), solid, String::new(), String::new()],
                // no negative zero
                false => {
                    let change = format!("{:+.2} %", (1e4 * face.area_change).round() / 100.0 + 0.0);
                    vec![
                        face.name.clone(),
                        solid,
                        change,
                        if face.distance < 1e-9 * body.size { "0".into() } else { format!("{:.1e}", face.distance) },
                    ]
                }
            }
        };
        let rows: Vec<Vec<String>> = body.faces.iter().map(row).collect();
        console.lines(&lines(&["face", "solid", "area", "distance"], &rows));
        for face in body.faces.iter().filter(|face| !body.keeps(face)) {
            let away = match face.distance < 0.02 * body.size {
                true => String::new(),
                false => format!(" lies up to {} from that of the design and", digits(face.distance)),
            };
            console.warning(&format!(
                "`{}` of the part{away} differs by {:+.2} % in area: what acts there may differ; a smaller \
                 --size follows the face more closely",
                face.name,
                100.0 * face.area_change
            ));
        }
        if body.crossings > 0 {
            console.warning(&format!(
                "{} of `{name}` cross each other: elements of the design are inverted or flat there; `slipstick check` \
                 names them",
                counted(body.crossings, "pair") + " of triangles"
            ));
        }
        if let Some((pieces, volume, at)) = summary(&body.loose) {
            let touching = body.loose.iter().filter(|piece| piece.on_contact).count();
            let held = match touching {
                0 => "neither support nor contact holds".to_owned(),
                _ => format!("no support holds ({touching} on a contact face: contact there is lost)"),
            };
            console.warning(&format!(
                "{pieces} of `{name}` that {held}, with a volume of {volume}, left out; the largest is at ({at}). If \
                 elements below the threshold of {} connect them in the design, a lower --threshold or a sharper \
                 `projection` in [design] does so here",
                digits(part.export.threshold)
            ));
        }
        if let Some((pieces, volume, at)) = summary(&body.by_contact) {
            console.warning(&format!(
                "only contact holds {pieces} of `{name}` (volume {volume}, the largest at ({at})). If elements below the \
                 threshold of {} connect them in the design, the part is weaker than the design promises: use a sharper \
                 `projection` in [design], or a lower --threshold that connects them",
                digits(part.export.threshold)
            ));
        }
    }
    for Scarce { name, used, share } in &part.scarce {
        console.warning(&format!(
            "only {:.2} % of `{name}`, which {used} needs, is left: the part may not be held or loaded like the design; {SKIN}",
            100.0 * share
        ));
    }
    for (name, (touching, state)) in touched.iter().filter(|(_, (touching, _))| lost(touching)) {
        console.warning(&format!(
            "{:.1} % of the contact force on `{name}` acts on material that the part lacks (path_{state:04}.vtu): the rest \
             of the face carries that force; a lower --threshold keeps more, and {SKIN}",
            100.0 * (1.0 - touching.kept)
        ));
    }
    for Reduced { name, acts, share } in &part.reduced {
        let left = format!("{:.1} % of `{name}` is left", 100.0 * share);
        let smaller =
            "acts there per area: its resultant is that much smaller than in the design, unlike that of a `force`";
        let less = match acts {
            Acts::Pressure => format!("a pressure {smaller}"),
            Acts::Traction => format!("a traction {smaller}"),
            Acts::Spring => "a spring acts there per area: it is that much softer than in the design".into(),
            Acts::Contact => {
                let left = format!("{:.1} % of the contact face `{name}` is left", 100.0 * share);
                match touched.get(name) {
                    Some((touching, _)) if lost(touching) => {}
                    Some((touching, _)) => {
                        console.text(&format!("{left}, with {:.1} % of its contact force", 100.0 * touching.kept));
                    }
                    None => console.text(&format!("{left}: contact on the rest would be lost ({SKIN})")),
                }
                continue;
            }
            Acts::Tie => "the tie is that much smaller than in the design".into(),
            Acts::Measured => {
                "quantities of the case measure pressure or gap there: on the part, they and their bounds cover only what \
                 is left of the face"
                    .into()
            }
        };
        console.warning(&format!("{left}, and {less}; {SKIN}"));
    }
    for name in &part.reselected {
        console.warning(&format!(
            "the set `{name}` is not made of whole faces of one body: the case of the part selects its nodes again by \
             position"
        ));
    }
    for PerNode { name, used, summed } in &part.per_node {
        match summed {
            Some(nodes) => console.text(&format!(
                "{used} on `{name}`: the part gets the sum over the {} of the design, spread over the face",
                counted(*nodes, "node")
            )),
            None => console.warning(&format!(
                "{used} on `{name}` has a value for each node, and the mesh of the part may have another number of nodes \
                 there: in the case of the design, give the sum over a surface, or name a set with `nearest`"
            )),
        }
    }
    if !part.unused.is_empty() {
        let names: Vec<String> = part.unused.iter().map(|name| format!("`{name}`")).collect();
        console.text(&format!(
            "{} left out of the part's case: nothing uses {}, and material may be missing there",
            names.join(", "),
            if names.len() == 1 { "it" } else { "them" }
        ));
    }
    if promised.is_empty() {
        console.warning("there are no quantities of this design to compare with: solve it, and export that run");
    }
    let shown = folder.display();
    let file = |name: &str| shell_word(&folder.join(name).display().to_string());
    let solve = format!("slipstick solve {}", file("case.toml"));
    if part.bodies.is_empty() {
        console.text(&format!("written: {shown}/case.toml, {RECORD}"));
        console.text(&format!("next: {solve}"));
    } else {
        console.text(&format!("written: {shown}/case.toml, {SCRIPT}, {RECORD} and the surfaces"));
        console.text(&format!("next: pip install gmsh; python3 {}; {solve}", file(SCRIPT)));
    }
}

//! Models of texts as they are edited, and the faces that are picked in them.

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, TryLockError};
use std::time::Duration;

use serde_json::{Value, json};
use slipstick::build::build_mesh;
use slipstick::build::pick::{Picked, facets_of_faces, pick};
use slipstick::case::{Case, Resolved, sha256};
use slipstick::mesh::{Facet, Mesh, Surface};
use slipstick::report::{PageOptions, model_nodes, model_page};
use slipstick::words::counted;
use slipstick_service::failure::{Failure, Outcome};
use slipstick_service::forecast::bytes_to_build;
use slipstick_service::memory::{Budget, bytes};
use slipstick_service::read::edited;
use toml::de::DeTable;

use super::api::{lock, raw_text};
use super::http::Response;
use super::outline::marks;

/// Texts that are being edited, and the newest model.
#[derive(Default)]
pub struct Models {
    /// Texts that were checked last, the newest at the end, and of which page and case they are.
    drafts: Mutex<Vec<(Draft, String)>>,
    /// Held while a mesh is built, so that the memory of one is available in full.
    building: Mutex<Option<Built>>,
    /// Number of the newest request for a model.
    newest: AtomicUsize,
}

/// A page, of several in the browser, and a case.
type Draft = [String; 2];

/// Most texts that are kept. A page whose text is gone learns this, and checks it again.
const MOST_DRAFTS: usize = 16;

/// The model that the page shows.
pub struct Built {
    name: String,
    text: String,
    case: Case,
    mesh: Mesh,
}

/// Faces that are picked in the model.
pub struct Wanted<'a> {
    /// The case.
    pub case: &'a str,
    /// The hash of the text whose model the page shows.
    pub stamp: &'a str,
    /// The name for the surface.
    pub name: &'a str,
    /// What the surface is used for: nothing, `support`, `pressure`, `force` or `contact`.
    pub purpose: &'a str,
    /// The angle with which faces were picked.
    pub degrees: f64,
    /// Whether the tables are tried in the whole case, which is then built again.
    pub sure: bool,
    /// Points of the model's page, 4 for each face.
    pub points: Vec<u32>,
}

impl Models {
    /// Keeps a text that is being edited in a page.
    pub fn keep(&self, page: &str, name: &str, text: &str) {
        let of = [page.to_owned(), name.to_owned()];
        let mut drafts = lock(&self.drafts);
        drafts.retain(|(other, _)| *other != of);
        let most = drafts.len().saturating_sub(MOST_DRAFTS - 1);
        drafts.drain(..most);
        drafts.push((of, text.to_owned()));
    }

    fn draft(&self, of: &Draft) -> Option<String> {
        lock(&self.drafts).iter().find(|(other, _)| other == of).map(|(_, text)| text.clone())
    }

    /// Waits until no mesh is built; none is until this is dropped. The model that was built is forgotten, and its
    /// memory is free.
    pub fn alone(&self) -> MutexGuard<'_, Option<Built>> {
        let mut built = lock(&self.building);
        *built = None;
        built
    }

    /// The model of the text that a page checked last, otherwise of the file; with a stamp, only that of the text with
    /// this hash.
    ///
    /// # Errors
    /// [`Failure`] if the text is not valid, or its mesh cannot be built.
    pub fn page(&self, page: &str, name: &str, path: &Path, stamp: &str) -> Outcome<Response> {
        let turn = 1 + self.newest.fetch_add(1, Ordering::SeqCst);
        let of = [page.to_owned(), name.to_owned()];
        let draft = self.draft(&of);
        let Some(mut building) = self.turn_to_build(turn, &of, draft.as_ref()) else {
            return Ok(Response::plain(409, "the text has changed; its newer model replaces this one".into()));
        };
        let text = match draft {
            Some(text) => text,
            None => raw_text(path)?,
        };
        if !stamp.is_empty() && sha256(&text) != stamp {
            let message = "the text of this page is no longer in memory: press \u{201c}Model\u{201d} to check it again";
            return Ok(Response::plain(409, message.into()));
        }
        *building = None;
        let (case, mesh) = meshed(path, &text)?;
        let names = marks(&serde_json::to_value(&case).unwrap_or_default());
        let html = model_page(&case, &mesh, &names, &PageOptions::default()).html;
        *building = Some(Built { name: name.to_owned(), text, case, mesh });
        Ok(Response::framed(html))
    }

    /// Waits until no mesh is built; `None` if another text was checked meanwhile and its model was requested,
    /// because the page then no longer waits for this one.
    fn turn_to_build(&self, turn: usize, of: &Draft, draft: Option<&String>) -> Option<MutexGuard<'_, Option<Built>>> {
        loop {
            if self.newest.load(Ordering::SeqCst) != turn && self.draft(of).as_ref() != draft {
                return None;
            }
            match self.building.try_lock() {
                Ok(building) => return Some(building),
                Err(TryLockError::Poisoned(broken)) => return Some(broken.into_inner()),
                Err(TryLockError::WouldBlock) => std::thread::sleep(Duration::from_millis(20)),
            }
        }
    }

    /// The tables that select the picked faces in this mesh: `{ text, added, surface, facets,
    /// area }`.
    ///
    /// # Errors
    /// [`Failure::Input`] if no table selects exactly these faces, or the model is that of another text.
    pub fn pick(&self, path: &Path, wanted: &Wanted<'_>) -> Outcome<Value> {
        let building = lock(&self.building);
        let again = "press \u{201c}Model\u{201d} to load it again, and pick again";
        let Some(Built { text, case, mesh, .. }) = building.as_ref().filter(|built| built.name == wanted.case) else {
            return Err(Failure::input("the model is no longer in memory", again));
        };
        if sha256(text) != wanted.stamp {
            return Err(Failure::input("the model is not that of the text", again));
        }
        if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("inp")) {
            let cure = format!("use a case file with the line `deck = \"{}\"`, and pick there", wanted.case);
            return Err(Failure::input("a deck has no [[surface]] tables", cure));
        }
        let facets = facets_of(case, mesh, &wanted.points)?;
        let (sides, why) = match wanted.purpose {
            "contact" => sides(mesh, &facets)?,
            _ => (vec![(wanted.name.to_owned(), facets.clone())], ""),
        };
        let (mut added, mut surfaces) = (Vec::new(), Vec::new());
        for (end, facets) in &sides {
            let name = if sides.len() > 1 { format!("{}_{end}", wanted.name) } else { end.clone() };
            let Picked { tables, surface } = pick(mesh, facets, &name, &[wanted.degrees])
                .map_err(|error| Failure::input(error.message.clone(), error.help))?;
            added.extend(tables.iter().map(|table| table.toml()));
            surfaces.push(surface);
        }
        let known = added.is_empty();
        added.extend(purpose(wanted.purpose, &surfaces, why)?);
        can_follow(text, &added)?;
        if wanted.sure && !added.is_empty() {
            let (_, tried) = meshed(path, &joined(text, &added))?;
            let same = surfaces.iter().zip(&sides).all(|(surface, (_, facets))| {
                let found = tried.surfaces.get(surface);
                found.is_some_and(|found| keys(found) == keys(&Surface { facets: facets.clone() }))
            });
            if !same {
                let cure = "name the faces in the program that made the mesh";
                return Err(Failure::input("in the case, the tables select other faces", cure));
            }
        }
        let area = mesh.surface_area(&Surface { facets: facets.clone() });
        Ok(json!({
            "surfaces": surfaces, "known": known, "added": added.join("\n"), "text": joined(text, &added),
            "facets": counted(facets.len(), "facet"), "area": slipstick::words::quantity(area),
        }))
    }
}

/// The case and the mesh of a text, if there is memory for them.
fn meshed(path: &Path, text: &str) -> Outcome<(Case, Mesh)> {
    let Resolved { case, source_map, .. } = edited(path, text).map_err(|error| error.at(path))?;
    let needed = bytes_to_build(&case);
    if let Some(available) = Budget::of_machine().exceeded_by(needed) {
        let message = format!("the mesh needs about {}; {} is available", bytes(needed), bytes(available));
        return Err(Failure::input(message, "use fewer elements, or a machine with more memory"));
    }
    let mesh = build_mesh(&case).map_err(|error| Failure::build(&error, &source_map))?;
    Ok((case, mesh))
}

/// The facets behind faces of the page.
fn facets_of(case: &Case, mesh: &Mesh, points: &[u32]) -> Outcome<Vec<Facet>> {
    let wrong = || Failure::input("these are no faces of the model", "load the page again, and pick again");
    let nodes = model_nodes(case, mesh, &PageOptions::default());
    let (faces, rest) = points.as_chunks::<4>();
    let node = |point: u32| nodes.get(point as usize).copied();
    let faces: Option<Vec<[u32; 4]>> =
        faces.iter().map(|&[a, b, c, d]| Some([node(a)?, node(b)?, node(c)?, node(d)?])).collect();
    let faces = faces.filter(|_| rest.is_empty()).ok_or_else(wrong)?;
    facets_of_faces(mesh, &faces).ok_or_else(wrong)
}

fn keys(surface: &Surface) -> Vec<Vec<u32>> {
    let mut keys: Vec<Vec<u32>> = surface.facets.iter().map(|facet| facet.nodes.sorted().to_vec()).collect();
    keys.sort_unstable();
    keys
}

/// Names and facets of surfaces.
type Surfaces = Vec<(String, Vec<Facet>)>;

/// The picked facets of two bodies, those of the slave first: it deforms, and if both do, its facets are smaller in
/// the mean; and which of both it is.
fn sides(mesh: &Mesh, facets: &[Facet]) -> Outcome<(Surfaces, &'static str)> {
    let mut all: Vec<(usize, Vec<Facet>)> = Vec::new();
    for facet in facets {
        let body = mesh.body_of_element(facet.element as usize).unwrap_or(0);
        match all.iter_mut().find(|(other, _)| *other == body) {
            Some((_, own)) => own.push(*facet),
            None => all.push((body, vec![*facet])),
        }
    }
    all.sort_by_key(|(body, _)| *body);
    if all.len() != 2 {
        let bodies: Vec<String> = all.iter().map(|(body, _)| format!("`{}`", mesh.bodies[*body].name)).collect();
        let message = format!("a contact pair needs faces of two bodies; picked are those of {}", bodies.join(", "));
        let cure = "Shift-click on a face of the other body adds it, on a picked one removes it";
        return Err(Failure::input(message, cure));
    }
    let size = |of: &[Facet]| mesh.surface_area(&Surface { facets: of.to_vec() }) / of.len() as f64;
    let rigid = [0, 1].map(|k| mesh.rigid.iter().any(|rigid| rigid.body == all[k].0));
    let (swapped, why) = match rigid {
        [first, second] if first != second => (first, "the master is rigid"),
        // of equal sizes, the first one
        _ => (size(&all[1].1) < size(&all[0].1) * (1.0 - 1e-9), "smaller facets"),
    };
    if swapped {
        all.swap(0, 1);
    }
    Ok((["slave", "master"].map(str::to_owned).into_iter().zip(all.into_iter().map(|(_, own)| own)).collect(), why))
}

/// A table that uses surfaces: one, or the two of a contact pair, whose slave was chosen for a reason.
fn purpose(purpose: &str, surfaces: &[String], why: &str) -> Outcome<Option<String>> {
    let names: Vec<toml::Value> = surfaces.iter().map(|name| name.as_str().into()).collect();
    if let ("contact", [slave, master]) = (purpose, &names[..]) {
        return Ok(Some(format!("[[contact]]\nslave = {slave}   # {why}\nmaster = {master}\nfriction = 0.2\n")));
    }
    let name = &names[0];
    Ok(Some(match purpose {
        "" => return Ok(None),
        "support" => format!("[[dirichlet]]\nset = {name}\n"),
        "pressure" => format!("[[load]]\nsurface = {name}\npressure = 1.0\n"),
        "force" => format!("[[load]]\nsurface = {name}\nforce = [0.0, -1.0, 0.0]\n"),
        other => return Err(Failure::input(format!("there is no use {other:?}"), "choose one of the list")),
    }))
}

/// Refuses tables that cannot be added at the end of a text, because it has their list in one line.
fn can_follow(text: &str, tables: &[String]) -> Outcome {
    for header in tables.iter().filter_map(|table| table.lines().next()) {
        if DeTable::parse(&joined(text, &[header.to_owned()])).is_err() {
            let message = format!("`{}` is an inline list", header.trim_matches(['[', ']']));
            return Err(Failure::input(message, "add the entry there, or write the list as tables"));
        }
    }
    Ok(())
}

/// A text with tables at its end.
fn joined(text: &str, tables: &[String]) -> String {
    let mut all = text.trim_end().to_owned();
    for table in tables {
        all += "\n\n";
        all += table.trim_end();
    }
    all + "\n"
}

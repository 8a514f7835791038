//! The names of bodies, surfaces and sets that a case may refer to.

use std::collections::BTreeMap;

use super::CaseCode;
use super::reader::{Reader, suggestion_or_list};
use super::resolved::Shape;

/// What a name refers to.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Surface,
    Set,
}

/// All names of a case, collected before anything refers to them.
#[derive(Default)]
pub(crate) struct Names {
    bodies: Vec<String>,
    /// Surface or set, and the number of the body that it belongs to, if known.
    sets: Vec<(String, Kind, Option<usize>)>,
    /// Sets of elements.
    parts: Vec<String>,
    /// Surfaces of mesh files that no body can have, with message and remedy.
    unusable: BTreeMap<String, [String; 2]>,
    /// Bodies from mesh files without any surface or set.
    bare: Vec<usize>,
    /// Bodies whose shape cannot be read, so that their surfaces are unknown.
    shapeless: Vec<usize>,
    /// Whether some body or set has no readable name: any unknown name may refer to it.
    nameless: bool,
}

impl Names {
    /// Adds a body and its surfaces; `path` is the place of its name.
    pub(crate) fn add_body(&mut self, reader: &Reader, path: &str, name: &str, shape: Option<&Shape>) {
        if name.is_empty() {
            self.nameless = true;
        } else if self.bodies.iter().any(|other| other == name) {
            reader.error(
                path,
                CaseCode::DuplicateName,
                format!("two bodies are called `{name}`"),
                "give each body a different name",
            );
            self.nameless = true;
        }
        let body = self.bodies.len();
        self.bodies.push(name.to_owned());
        match shape {
            Some(shape) => {
                let surface = |face| (format!("{name}_{face}"), Kind::Surface, Some(body));
                self.sets.extend(shape.faces().iter().map(surface));
                if let Shape::Mesh(file) = shape {
                    if file.mesh.surfaces.is_empty() && file.mesh.node_sets.is_empty() && file.unusable.is_empty() {
                        self.bare.push(body);
                    }
                    let named = |kind| move |name: &String| (name.clone(), kind, Some(body));
                    self.sets.extend(file.mesh.surfaces.keys().map(named(Kind::Surface)));
                    self.sets.extend(file.mesh.node_sets.keys().map(named(Kind::Set)));
                    self.parts.extend(file.mesh.element_sets.keys().cloned());
                    self.unusable.extend(file.unusable.clone());
                }
            }
            None => self.shapeless.push(body),
        }
    }

    /// From now on, unknown names are not reported, since they may refer to something that cannot
    /// be read.
    pub(crate) fn excuse_all(&mut self) {
        self.nameless = true;
    }

    /// Adds a node set; `body`: the body to which all its nodes belong, if known.
    pub(crate) fn add_set(&mut self, reader: &Reader, path: &str, name: &str, body: Option<usize>) {
        self.add(reader, path, name, Kind::Set, body);
    }

    /// Adds a surface of a body.
    pub(crate) fn add_surface(&mut self, reader: &Reader, path: &str, name: &str, body: Option<usize>) {
        self.add(reader, path, name, Kind::Surface, body);
    }

    fn add(&mut self, reader: &Reader, path: &str, name: &str, kind: Kind, body: Option<usize>) {
        if name.is_empty() {
            self.nameless = true;
        } else if self.find(name).is_some() {
            reader.error(
                &format!("{path}.name"),
                CaseCode::DuplicateName,
                format!("there is already a surface or set called `{name}`"),
                "choose another name",
            );
            return;
        }
        self.sets.push((name.to_owned(), kind, body));
    }

    /// Whether the shape of a body, by its name, cannot be read, which is reported elsewhere.
    pub(crate) fn is_shapeless(&self, name: &str) -> bool {
        self.shapeless.iter().any(|&body| self.bodies[body] == name)
    }

    pub(crate) fn find(&self, name: &str) -> Option<(Kind, Option<usize>)> {
        let found = self.sets.iter().find(|(other, _, _)| other == name);
        found.map(|&(_, kind, body)| (kind, body))
    }

    pub(crate) fn body(&self, name: &str) -> Option<usize> {
        self.bodies.iter().position(|body| body == name)
    }

    /// Whether an unknown name may be a consequence of an error that is reported elsewhere.
    fn excusable(&self, name: &str) -> bool {
        let of_shapeless =
            |&body: &usize| name.strip_prefix(&self.bodies[body]).is_some_and(|rest| rest.starts_with('_'));
        name.is_empty() || self.nameless || self.shapeless.iter().any(of_shapeless)
    }

    /// Reports why a surface of a mesh file cannot be used; whether there is one of this name.
    fn tell_unusable(&self, reader: &Reader, path: &str, name: &str) -> bool {
        let Some([message, help]) = self.unusable.get(name) else { return false };
        reader.error(path, CaseCode::MeshFile, message.clone(), help.clone());
        true
    }

    /// The remedy for a name that belongs to a body whose mesh file has no names.
    fn of_bare(&self, name: &str) -> Option<String> {
        let of = |&body: &usize| name.strip_prefix(&self.bodies[body]).is_some_and(|rest| rest.starts_with('_'));
        let body = self.bodies.get(*self.bare.iter().find(|body| of(body))?)?;
        Some(format!(
            "the mesh file of `{body}` names neither surfaces nor sets: name them where the mesh is made (Gmsh: physical \
             groups), or select facets with a [[surface]] and nodes with a [[set]]"
        ))
    }

    /// Reports a name that is neither a surface nor a set.
    pub(crate) fn check_set(&self, reader: &Reader, path: &str, name: &str) {
        if self.find(name).is_none() && self.tell_unusable(reader, path, name) {
            return;
        }
        if self.find(name).is_none() && !self.excusable(name) {
            let names: Vec<&str> = self.sets.iter().map(|(name, _, _)| name.as_str()).collect();
            reader.error(
                path,
                CaseCode::UnknownSet,
                format!("there is no surface or set called `{name}`"),
                self.of_bare(name).unwrap_or_else(|| suggestion_or_list(name, &names)),
            );
        }
    }

    /// Reports a name that is not a surface.
    pub(crate) fn check_surface(&self, reader: &Reader, path: &str, name: &str) {
        let surfaces: Vec<&str> =
            self.sets.iter().filter(|(_, kind, _)| *kind == Kind::Surface).map(|(name, _, _)| name.as_str()).collect();
        match self.find(name) {
            Some((Kind::Surface, _)) => {}
            Some((Kind::Set, _)) => reader.error(
                path,
                CaseCode::NotASurface,
                format!("`{name}` is a node set; a surface is needed here"),
                format!("surfaces: {}", surfaces.join(", ")),
            ),
            None if self.excusable(name) || self.tell_unusable(reader, path, name) => {}
            None => reader.error(
                path,
                CaseCode::UnknownSet,
                format!("there is no surface called `{name}`"),
                self.of_bare(name).unwrap_or_else(|| suggestion_or_list(name, &surfaces)),
            ),
        }
    }

    /// Reports a name that is not the name of a set of elements.
    pub(crate) fn check_part(&self, reader: &Reader, path: &str, name: &str) {
        if self.parts.iter().any(|part| part == name) || self.excusable(name) {
            return;
        }
        let help = match self.parts.is_empty() {
            true => "bodies from mesh files have parts: their sets of solid elements, as `{body}_{set}`".to_owned(),
            false => suggestion_or_list(name, &self.parts),
        };
        let message = format!("there is no set of elements called `{name}`");
        reader.error(path, CaseCode::UnknownSet, message, help);
    }

    /// Reports a name that is not the name of a body.
    pub(crate) fn check_body(&self, reader: &Reader, path: &str, name: &str) {
        if self.body(name).is_none() && !self.nameless && !name.is_empty() {
            reader.error(
                path,
                CaseCode::UnknownBody,
                format!("there is no body called `{name}`"),
                suggestion_or_list(name, &self.bodies),
            );
        }
    }
}

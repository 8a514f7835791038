//! Places that failures name, and the conditions that meet there: supports, contact pairs, rigid
//! motions.

use std::fmt;

use serde::Serialize;
use slipstick_mesh::Mesh;
use slipstick_path::{StateError, StepFailureKind};

use slipstick_case::check::free_motions;
use slipstick_case::file::Formulation;
use slipstick_model::model::{ContactModel, ContactState, PairState, Unknown};
use slipstick_model::words::{counted, vector};

/// A model at the state at which it failed.
#[derive(Clone, Copy)]
pub(super) struct Trial<'a> {
    pub model: &'a ContactModel,
    /// `None` if that state cannot be evaluated or is not known.
    pub contact: Option<&'a ContactState>,
}

impl std::ops::Deref for Trial<'_> {
    type Target = ContactModel;

    fn deref(&self) -> &ContactModel {
        self.model
    }
}

impl Trial<'_> {
    fn opposite(&self, row: usize) -> &[u32] {
        self.contact.map_or(&[], |contact| contact.opposite(row))
    }

    fn direction(&self, row: usize, component: usize) -> Option<[f64; 3]> {
        self.contact?.direction(row, component)
    }

    fn pair(&self, pair: usize) -> PairState {
        self.contact.map_or_else(PairState::default, |contact| self.model.pair_state(pair, contact))
    }
}

/// A place of the model that a failure names.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Place {
    /// `element` or `node`.
    pub kind: &'static str,
    /// Its global number.
    pub number: u32,
    /// Its body.
    pub body: String,
    /// Reference position; for an element, its centroid. \[L\]
    pub position: [f64; 3],
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { kind, number, body, position } = self;
        let size = position.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
        let [x, y, z] = position.map(|x| coordinate(x, size));
        write!(f, "{kind} {number} of body `{body}` at ({x}, {y}, {z})")
    }
}

/// A coordinate in few digits; a value that is only round-off relative to this size is shown as
/// zero.
fn coordinate(value: f64, size: f64) -> String {
    match value.abs() {
        small if small <= 1e-9 * size => "0".into(),
        usual if (1e-2..1e6).contains(&usual) => format!("{value:.4}"),
        _ => format!("{value:.3e}"),
    }
}

/// Maximum number of listed places.
pub(super) const LISTED: usize = 5;

/// The first few places that a failure names.
pub(super) fn places(kind: &StepFailureKind, mesh: &Mesh, model: Trial<'_>) -> Vec<Place> {
    let node = |node: u32| node_place(mesh, node);
    let slaves = model.slave_nodes();
    match kind {
        StepFailureKind::State(StateError::InvertedElements { elements }) => {
            elements.iter().take(LISTED).filter_map(|&element| element_place(mesh, element)).collect()
        }
        StepFailureKind::State(
            StateError::FoldedSurface { node: at }
            | StateError::PassedThrough { node: at, .. }
            | StateError::TurnedTooFar { node: at, .. }
            | StateError::PrescribedPenetration { node: at, .. },
        ) => node(*at).into_iter().collect(),
        StepFailureKind::State(StateError::FoldedFacet { nodes }) => {
            nodes.iter().copied().take(LISTED).filter_map(node).collect()
        }
        StepFailureKind::State(StateError::NotFinite { index, .. } | StateError::Unheld { unknown: index, .. })
        | StepFailureKind::Singular { unknown: index, .. } => {
            let number = model.unknown(*index).and_then(|unknown| match unknown {
                Unknown::Displacement { node, .. } => Some(node),
                Unknown::Multiplier { row, .. } => slaves.get(row).copied(),
            });
            number.and_then(node).into_iter().collect()
        }
        StepFailureKind::Cycling { nodes } | StepFailureKind::TooManyIterations { changing: nodes, .. } => {
            let number = |position: &u32| slaves.get(*position as usize).copied();
            nodes.iter().filter_map(number).take(LISTED).filter_map(node).collect()
        }
        _ => Vec::new(),
    }
}

fn element_place(mesh: &Mesh, element: u32) -> Option<Place> {
    let body = mesh.body_of_element(element as usize)?;
    let (body, position) = (mesh.bodies[body].name.clone(), mesh.centroid(element as usize));
    Some(Place { kind: "element", number: element, body, position })
}

fn node_place(mesh: &Mesh, node: u32) -> Option<Place> {
    let body = mesh.bodies.iter().find(|body| body.nodes.contains(&(node as usize)))?;
    Some(Place { kind: "node", number: node, body: body.name.clone(), position: mesh.nodes[node as usize] })
}

/// Why a step failed, with the meaning of the unknown if there is one.
pub(super) fn reason(kind: &StepFailureKind, mesh: &Mesh, model: Trial<'_>) -> String {
    let along = |index: usize| model.unknown(index).map(|unknown| meaning(unknown, mesh, model));
    match kind {
        StepFailureKind::Singular { unknown, .. } => match along(*unknown) {
            Some(what) => format!("{kind}: nothing determines the {what}"),
            None => kind.to_string(),
        },
        StepFailureKind::State(StateError::NotFinite { index, .. }) => match along(*index) {
            Some(what) => format!("{kind}: {what}"),
            None => kind.to_string(),
        },
        _ => kind.to_string(),
    }
}

fn meaning(unknown: Unknown, mesh: &Mesh, model: Trial<'_>) -> String {
    match unknown {
        Unknown::Displacement { node, axis } => match RigidMotion::of(node, axis, mesh) {
            Some(motion) => format!("{} of the rigid body `{}`", motion.in_words(), motion.body),
            None => match mesh.cuts.iter().find(|cut| cut.reference == node && axis == 0) {
                Some(cut) => format!("overlap of the bolt `{}`: nothing resists its force", cut.name),
                None => format!("displacement along {}", AXES[axis]),
            },
        },
        Unknown::Multiplier { row, component } => {
            let what = if component == 0 { "normal contact traction" } else { "friction" };
            let pair = model.pair_name(model.pair_of_row(row));
            match model.direction(row, component) {
                Some(direction) => format!("{what} along {} of contact pair {pair}", direction_in_words(direction)),
                None => format!("{what} of contact pair {pair}"),
            }
        }
    }
}

/// `y` or a vector.
fn direction_in_words(direction: [f64; 3]) -> String {
    match direction.iter().position(|component| component.abs() > 1.0 - 1e-9) {
        Some(axis) => AXES[axis].into(),
        None => vector(direction),
    }
}

/// Conditions that meet at the place of a failure, and changes that may help.
#[derive(Default)]
pub(super) struct Conditions {
    /// The conditions that meet there.
    pub facts: Vec<String>,
    /// Cures, most promising first.
    pub cures: Vec<String>,
}

/// Names of the axes.
pub(super) const AXES: [&str; 3] = ["x", "y", "z"];

/// Smallest component of a direction along an axis for which a support along that axis counts as
/// one in that direction.
const ALONG: f64 = 0.1;

/// Conditions at the place of a failure, for a singular matrix and a prescribed penetration; none
/// for other failures.
pub(super) fn conditions(kind: &StepFailureKind, mesh: &Mesh, model: Trial<'_>) -> Conditions {
    match kind {
        StepFailureKind::Singular { unknown, .. } | StepFailureKind::State(StateError::Unheld { unknown, .. }) => {
            match model.unknown(*unknown) {
                Some(Unknown::Displacement { node, axis }) => of_displacement(node, axis, mesh, model),
                Some(Unknown::Multiplier { row, component }) => of_multiplier(row, component, model),
                None => Conditions::default(),
            }
        }
        StepFailureKind::State(StateError::PrescribedPenetration { node, .. }) => of_penetration(*node, model),
        _ => Conditions::default(),
    }
}

/// A component of the motion of a rigid body.
struct RigidMotion<'a> {
    body: &'a str,
    axis: &'static str,
    rotation: bool,
}

impl<'a> RigidMotion<'a> {
    /// The motion if the node has unknowns of a rigid body.
    fn of(node: u32, axis: usize, mesh: &'a Mesh) -> Option<Self> {
        let rigid = mesh.rigid.iter().find(|rigid| [rigid.reference, rigid.rotation()].contains(&node))?;
        Some(Self { body: &mesh.bodies[rigid.body].name, axis: AXES[axis], rotation: node != rigid.reference })
    }

    fn in_words(&self) -> String {
        format!("{} {}", if self.rotation { "rotation about" } else { "translation along" }, self.axis)
    }
}

/// The conditions if the node has the unknowns of a rigid body.
fn of_rigid_body(node: u32, axis: usize, mesh: &Mesh) -> Option<Conditions> {
    let motion = RigidMotion::of(node, axis, mesh)?;
    let (name, what, turn) = (motion.body, motion.in_words(), if motion.rotation { "r" } else { "" });
    let component = format!("{turn}{}", motion.axis);
    Some(Conditions {
        facts: vec![format!("neither a support nor contact determines the {what} of the rigid body `{name}`")],
        cures: vec![
            format!("a support (`[[dirichlet]]`) with `set = \"{name}\"` and \"{component}\" among its `components`"),
            format!("a position of `{name}` in which contact holds it from the start"),
        ],
    })
}

/// A displacement that nothing determines belongs to a motion that nothing resists.
fn of_displacement(node: u32, axis: usize, mesh: &Mesh, model: Trial<'_>) -> Conditions {
    if let Some(found) = of_rigid_body(node, axis, mesh) {
        return found;
    }
    let mut found = Conditions { facts: vec![node_support(node, model)], cures: Vec::new() };
    for (pair, slave) in model.pairs_of(node) {
        let side = if slave { "slave" } else { "master" };
        found.facts.push(format!("it is on the {side} surface of {}", pair_in_numbers(pair, model)));
    }
    let Some(body) = mesh.bodies.iter().position(|body| body.nodes.contains(&(node as usize))) else { return found };
    let parts = mesh.connected_parts(body);
    let nodes: Vec<usize> = match parts.iter().find(|part| part.contains(&node)) {
        Some(part) => part.iter().map(|&node| node as usize).collect(),
        None => mesh.bodies[body].nodes.clone().collect(),
    };
    let name = &mesh.bodies[body].name;
    let whose =
        if parts.len() > 1 { format!("the part of body `{name}` with this node") } else { format!("body `{name}`") };
    let free = free_motions(mesh, nodes.iter().copied(), model.prescribed().fixed());
    let Some(motions) = rigid(free) else {
        found.facts.push(format!("supports prevent every rigid motion of {whose}"));
        if model.solid().sections()[body].formulation == Formulation::Reduced {
            found
                .facts
                .push("elements with `element = \"reduced\"` have a motion without energy, which can spread".into());
            found.cures.push(format!("`element = \"full\"` of body `{name}`"));
        }
        return found;
    };
    found.facts.push(format!("no support prevents {motions} of {whose}"));
    let on_body = |node: &u32| mesh.bodies[body].nodes.contains(&(*node as usize));
    let (mut open, mut closed) = (Vec::new(), Vec::new());
    for (pair, interface) in model.interfaces().iter().enumerate() {
        let (slave, master) = (interface.interface.slave_facets(), interface.interface.master_facets());
        if ![slave, master].iter().any(|facets| facets.iter().flat_map(|facet| facet.iter()).any(on_body)) {
            continue;
        }
        if !model.pairs_of(node).iter().any(|&(own, _)| own == pair) {
            found.facts.push(format!("body `{name}` is in {}", pair_in_numbers(pair, model)));
        }
        if model.pair(pair).closed == 0 { open.push(pair) } else { closed.push(pair) }
    }
    // contact that is closed prevents some of these motions, but not that of the unknown
    let against = if closed.is_empty() { motions } else { format!("motion along {}", AXES[axis]) };
    found.cures.push(format!("a support (`[[dirichlet]]`) of body `{name}` against {against}"));
    let slides = |&&pair: &&usize| model.interfaces()[pair].friction == 0.0 && !model.interfaces()[pair].is_bonded();
    if let Some(&pair) = closed.iter().find(slides) {
        let pair = model.pair_name(pair);
        found.cures.push(format!(
            "friction (`contact.friction`) in contact pair {pair}, which holds the body only along its normal"
        ));
    }
    if let Some(&pair) = open.first() {
        let pair = model.pair_name(pair);
        found.cures.push(format!("bodies that touch from the start, if contact pair {pair} is to hold body `{name}`"));
    }
    found
}

/// Rigid motions as text; `None` if there are none.
fn rigid((moves, turns): ([bool; 3], [bool; 3])) -> Option<String> {
    if [moves, turns] == [[true; 3]; 2] {
        return Some("any rigid motion".into());
    }
    let motions =
        [("motion along", moves), ("rotation about", turns)].into_iter().filter(|(_, free)| free.contains(&true));
    let motions: Vec<String> = motions.map(|(what, free)| format!("{what} {}", axes(free))).collect();
    (!motions.is_empty()).then(|| motions.join(" and "))
}

/// A traction that nothing determines belongs to a contact condition that follows from others or
/// contradicts them.
fn of_multiplier(row: usize, component: usize, model: Trial<'_>) -> Conditions {
    let pair = model.pair_of_row(row);
    let name = model.pair_name(pair);
    let node = model.slave_nodes()[row];
    let mut found = Conditions { facts: vec![node_support(node, model)], cures: Vec::new() };
    let opposite = model.opposite(row);
    if let Some(held) = held(opposite, model).filter(|_| !opposite.is_empty()) {
        found.facts.push(format!("all opposite master nodes are held {held}"));
    }
    let PairState { conditions, free, .. } = model.pair(pair);
    let (sets, left) = (counted(conditions, "condition"), counted(free, "free displacement"));
    let tied = model.interfaces()[pair].is_bonded();
    if !tied && conditions > 0 {
        found.facts.push(format!("contact pair {name} imposes {sets} at its closed nodes, on {left}"));
    }
    let direction = model.direction(row, component).unwrap_or_default();
    for axis in (0..3).filter(|&axis| direction[axis].abs() > ALONG) {
        let sets = model.holders(&[node], axis);
        if !sets.is_empty() {
            let (sets, axis) = (sets.join(", "), AXES[axis]);
            let why = format!("contact pair {name} also constrains it along {axis}");
            found.cures.push(format!("slave nodes such as {node} not held along {axis} by {sets}: {why}"));
        }
    }
    found.cures.push(format!("slave and master of {name} exchanged (`contact.slave`, `contact.master`)"));
    if !tied {
        found.cures.push(format!("the penalty method for {name} (`enforcement = {{ penalty = {{}} }}`)"));
    }
    let both = "symmetry planes (`[[symmetry]]`) instead of supports on both sides";
    found.cures.push(format!("{both} of {name}, if there are any"));
    found
}

/// Prescribed displacements on both sides close the gap further than it is open.
fn of_penetration(node: u32, model: Trial<'_>) -> Conditions {
    let mut found = Conditions { facts: vec![node_support(node, model)], cures: Vec::new() };
    let Some(row) = model.slave_nodes().iter().position(|&slave| slave == node) else { return found };
    let name = model.pair_name(model.pair_of_row(row));
    if let Some(held) = held(model.opposite(row), model) {
        found.facts.push(format!("all opposite master nodes are held {held}"));
    }
    let normal = model.direction(row, 0).unwrap_or_default();
    found.facts.push(format!(
        "contact pair {name} acts along {}, where no displacement of either surface is free to close the gap",
        direction_in_words(normal)
    ));
    let mut sets: Vec<String> = Vec::new();
    for axis in (0..3).filter(|&axis| normal[axis].abs() > ALONG) {
        for set in model.holders(&[node], axis).into_iter().chain(model.holders(model.opposite(row), axis)) {
            if !sets.contains(&set) {
                sets.push(set);
            }
        }
    }
    if !sets.is_empty() {
        found.cures.push(format!("one surface of {name} left free along its normal ({})", sets.join(", ")));
    }
    found.cures.push("a smaller motion (`dirichlet.motion`), or bodies farther apart".into());
    found.cures.push(format!(
        "the penalty method for {name} (`enforcement = {{ penalty = {{}} }}`), whose force stays finite"
    ));
    found
}

/// A contact pair with the number of its closed nodes.
fn pair_in_numbers(pair: usize, model: Trial<'_>) -> String {
    let PairState { nodes, closed, .. } = model.pair(pair);
    let name = model.pair_name(pair);
    format!("contact pair {name}, closed at {closed} of {}", counted(nodes, "slave node"))
}

/// The supports that hold a node: `` node 7 is held along x and z by `a` ``.
fn node_support(node: u32, model: Trial<'_>) -> String {
    match held(&[node], model) {
        Some(held) => format!("node {node} is held {held}"),
        None => format!("no support holds node {node}"),
    }
}

/// The axes along which all of these nodes are held, and the supports that hold them; `None` if
/// there is no such axis.
fn held(nodes: &[u32], model: Trial<'_>) -> Option<String> {
    let mut groups: Vec<([bool; 3], Vec<String>)> = Vec::new();
    for axis in 0..3 {
        let names = model.holders(nodes, axis);
        match groups.iter_mut().find(|(_, same)| *same == names) {
            Some((held, _)) => held[axis] = true,
            None => groups.push((std::array::from_fn(|c| c == axis), names)),
        }
    }
    let named = groups.iter().filter(|(_, names)| !names.is_empty());
    let parts: Vec<String> =
        named.map(|(held, names)| format!("along {} by {}", axes(*held), names.join(", "))).collect();
    (!parts.is_empty()).then(|| parts.join(", "))
}

/// `x`, `x and y`, `x, y and z`.
fn axes(which: [bool; 3]) -> String {
    let names: Vec<&str> = (0..3).filter(|&c| which[c]).map(|c| AXES[c]).collect();
    match names[..] {
        [a, b, c] => format!("{a}, {b} and {c}"),
        _ => names.join(" and "),
    }
}

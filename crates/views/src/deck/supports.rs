//! Supports and motions: where and when they hold.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use nalgebra::{Rotation3, Unit, Vector3};
use slipstick_case::file::{Dirichlet, LoadCase};
use slipstick_solid::LawKind;

use super::Writer;
use super::history::bends;
use super::text::number;

/// A load step that counts as the end of a pseudo-time.
const SAME: f64 = 1e-6;

/// A line of `BOUNDARY`.
struct Support {
    /// Target and components.
    head: String,
    /// When it holds.
    span: Span,
    /// Values at the ends of load steps; those before `Span::first` are not used. `None`: it stays where it is.
    curve: Option<Vec<f64>>,
}

/// The load steps after which a support begins, reaches its first waypoint and ends.
#[derive(Debug, Clone, Copy)]
struct Span {
    from: usize,
    first: usize,
    until: usize,
    /// Position of its table in the case.
    table: Option<usize>,
}

/// What holds nodes over the path.
pub(super) struct Supports {
    /// Number of load steps.
    steps: usize,
    all: Vec<Support>,
    /// That of the lines to come, and whether they move at all.
    span: Span,
    stays: bool,
    /// Prescribed components of nodes, each with the position in `owners` of what prescribes it.
    prescribed: BTreeMap<(u32, u8), Owner>,
    /// Sets and nodes in the order in which the deck first prescribes a component of them.
    owners: Vec<String>,
}

/// What prescribes a component.
#[derive(Debug, Clone, Copy)]
struct Owner {
    /// Position in the list of owners.
    by: u32,
    /// Whether it does so over the whole path, and at its end.
    always: bool,
    last: bool,
}

impl Supports {
    pub fn new(steps: usize) -> Self {
        let (span, stays) = (Span { from: 0, first: 0, until: steps, table: None }, false);
        Self { steps, all: vec![], span, stays, prescribed: BTreeMap::new(), owners: vec![] }
    }

    /// Whether a component of a node is prescribed at some time.
    pub fn hold(&self, key: &(u32, u8)) -> bool {
        self.prescribed.contains_key(key)
    }

    /// Whether it is prescribed at the end of the path.
    pub fn hold_at_end(&self, key: &(u32, u8)) -> bool {
        self.prescribed.get(key).is_some_and(|owner| owner.last)
    }

    /// Whether a component of a node belongs to a set: of all sets of the deck that prescribe it, to the first.
    pub fn owns(&self, set: &str, key: &(u32, u8)) -> bool {
        self.prescribed.get(key).is_some_and(|owner| owner.last && self.owners[owner.by as usize] == set)
    }

    fn own(&mut self, target: &str, keys: impl IntoIterator<Item = (u32, u8)>) {
        let by = self.owners.iter().position(|known| known == target).unwrap_or_else(|| {
            self.owners.push(target.to_owned());
            self.owners.len() - 1
        }) as u32;
        let (always, last) = (self.is_permanent(), self.span.until == self.steps);
        for key in keys {
            let owner = self.prescribed.entry(key).or_insert(Owner { by, always, last });
            if (last && !owner.last) || (last == owner.last && by < owner.by) {
                (owner.by, owner.last) = (by, last);
            }
            owner.always |= always;
        }
    }

    fn is_permanent(&self) -> bool {
        (self.span.from, self.span.until) == (0, self.steps)
    }

    /// The following lines hold when this motion, the table `i` of the case, does.
    fn begin(&mut self, i: usize, motion: &Dirichlet) {
        let steps = self.steps as f64;
        let at = |t: f64| ((t * steps - SAME).ceil().max(0.0) as usize).min(self.steps);
        let from = at(motion.from);
        let first = motion.motion.iter().find(|point| motion.from > 0.0 && at(point.t) > from);
        self.stays = motion.from > 0.0 && first.is_none();
        let until =
            motion.until.map_or(self.steps, |until| ((until.t * steps + SAME).floor() as usize).min(self.steps));
        self.span = Span { from, first: first.map_or(from, |point| at(point.t)), until, table: Some(i) };
    }

    /// The following lines hold over the whole path.
    fn always(&mut self) {
        (self.span, self.stays) = (Span { from: 0, first: 0, until: self.steps, table: None }, false);
    }

    /// Keeps a node of a section where it is after a load step.
    pub fn keep(&mut self, node: u32, step: usize) {
        let span = Span { from: step, first: step, until: self.steps, table: None };
        self.all.push(Support { head: format!("{node}, 1, 1"), span, curve: None });
    }

    /// Holds a node, numbered from 1, that no support of the case holds.
    pub fn ground(&mut self, node: u32) {
        let span = Span { from: 0, first: 0, until: self.steps, table: None };
        self.all.push(Support { head: format!("{node}, 1, 3"), span, curve: Some(vec![0.0; self.steps + 1]) });
    }

    /// Load steps at which a support begins, bends or ends.
    pub fn ends(&self) -> Vec<usize> {
        let mut ends = Vec::new();
        for Support { span, curve, .. } in &self.all {
            let Some(curve) = curve else {
                ends.extend([span.from, span.until]);
                continue;
            };
            ends.extend([span.from, span.until]);
            ends.extend((span.first < span.until).then_some(span.first));
            ends.extend(bends(curve, span.first..span.until));
        }
        ends.retain(|&n| n > 0 && n < self.steps);
        ends
    }

    /// Tables of supports that begin within the path, on whose way to the first waypoint a step would end.
    fn interrupted(&self, ends: &[usize]) -> Vec<(usize, usize)> {
        let of = |support: &Support| {
            let Span { from, first, until, table } = support.span;
            let end = ends.iter().find(|&&end| end > from && end < first && end <= until);
            Some((table?, *end?))
        };
        let mut all: Vec<(usize, usize)> = self.all.iter().filter_map(of).collect();
        all.dedup();
        all
    }

    /// Supports from the start.
    pub fn before_the_steps(&self) -> String {
        let mut text = String::new();
        for support in self.all.iter().filter(|support| support.span.from == 0 && support.curve.is_some()) {
            let _ = writeln!(text, "*BOUNDARY\n{}", support.head);
        }
        text
    }

    /// What a step over these load steps says of supports: what moves and what begins, or everything if one ends.
    pub fn in_step(&self, start: usize, end: usize) -> String {
        let replaced = start > 0 && self.all.iter().any(|of| of.span.until == start);
        let acts = |of: &&Support| of.span.from <= start && of.span.until > start;
        let (mut text, mut lines, mut kept) = (String::new(), String::new(), String::new());
        for Support { head, span, curve } in self.all.iter().filter(acts) {
            let begins = span.from == start && (start > 0 || curve.is_none());
            match curve {
                None if begins || replaced => _ = writeln!(kept, "{head}"),
                Some(curve) if begins || replaced || curve[end] != curve[start] => {
                    let _ = writeln!(lines, "{head}, {}", number(curve[end]));
                }
                _ => {}
            }
        }
        if replaced {
            text.push_str("*BOUNDARY, OP=NEW\n");
        } else if !lines.is_empty() {
            text.push_str("*BOUNDARY\n");
        }
        text.push_str(&lines);
        if !kept.is_empty() {
            text.push_str("*BOUNDARY, FIXED\n");
            text.push_str(&kept);
        }
        text
    }
}

impl Writer<'_> {
    /// Supports, motions and symmetry planes.
    pub(super) fn motions(&mut self) {
        let load_case = self.case.load_cases.get(self.options.load_case).cloned().unwrap_or_default();
        self.moved_bodies(&load_case);
        // what acts comes first, and other load cases hold what it leaves
        let (acting, resting): (Vec<_>, Vec<_>) =
            self.case.dirichlet.iter().enumerate().partition(|(_, of)| self.acts(of.load_case.as_ref()));
        for (i, motion) in acting {
            let own = load_case.motions.iter().find(|of| of.set == motion.set).map_or(1.0, |of| of.factor);
            let factor = own * load_case.motion_factor.unwrap_or(1.0);
            self.motion(i, motion, factor);
        }
        for (i, motion) in resting {
            self.motion(i, motion, 0.0);
        }
        // as in the case, nodes that a support and a plane share belong to the support
        self.history.supports.always();
        self.symmetries();
    }

    fn motion(&mut self, i: usize, motion: &Dirichlet, factor: f64) {
        self.history.supports.begin(i, motion);
        let turns = motion.rotation.filter(|_| motion.motion.iter().any(|point| point.angle != 0.0) && factor != 0.0);
        let at = |t: f64| {
            let (u, angle) = motion.at(t);
            (u.map(|x| factor * x), (factor * angle).to_radians())
        };
        let components: Vec<usize> = motion.components.iter().map(|c| c.index()).collect();
        let rotations: Vec<usize> = motion.rotations.iter().map(|c| c.index()).collect();
        // displacement of a point at load step n
        let steps = self.case.load_path.steps;
        let displacement = |x: [f64; 3], n: usize| -> [f64; 3] {
            let (u, angle) = at(n as f64 / steps as f64);
            let Some(axis) = turns else { return u };
            let rotation = Rotation3::from_axis_angle(&Unit::new_normalize(Vector3::from(axis.direction)), angle);
            let arm = Vector3::from(x) - Vector3::from(axis.point);
            let moved = rotation * arm - arm;
            std::array::from_fn(|c| u[c] + moved[c])
        };
        let curve = |x: [f64; 3], c: usize| (0..=steps).map(|n| displacement(x, n)[c]).collect::<Vec<f64>>();
        if let Some(reference) = self.mesh.reference_of(&motion.set) {
            let coupled = self.mesh.couplings.iter().any(|of| of.name == motion.set);
            let (node, x) = (reference.node, self.mesh.nodes[reference.node as usize]);
            for &c in &components {
                self.prescribe(&[node], (node + 1).to_string(), c, c + 1, curve(x, c));
            }
            let direction = turns.map_or([0.0; 3], |axis| {
                let v = Vector3::from(axis.direction);
                (v / v.norm()).into()
            });
            for &c in &rotations {
                let angles = self.history.sampled(|t| at(t).1 * direction[c]);
                match coupled {
                    true => self.prescribe(&[node], (node + 1).to_string(), c + 3, c + 4, angles),
                    false => self.prescribe(&[node + 1], (node + 2).to_string(), c, c + 1, angles),
                }
            }
            return;
        }
        let nodes = self.mesh.set_nodes(&motion.set).unwrap_or_default().into_owned();
        if nodes.is_empty() {
            let message = format!("nothing is left of `{}`", motion.set);
            return self.refuse(
                format!("dirichlet[{i}].set"),
                message,
                "choose a lower --threshold, or a solid skin there",
            );
        }
        let point = self.case.points.iter().any(|point| point.name == motion.set);
        if turns.is_some() || point {
            let dropped = self.dropped();
            for &node in &nodes {
                for &c in &components {
                    if dropped.contains(&node) {
                        self.history.supports.own(&(node + 1).to_string(), [(node, c as u8)]);
                        continue;
                    }
                    self.prescribe(&[node], (node + 1).to_string(), c, c + 1, curve(self.mesh.nodes[node as usize], c));
                }
            }
            return;
        }
        for set in self.node_sets(&motion.set) {
            for &c in &components {
                self.prescribe(&nodes, set.clone(), c, c + 1, curve([0.0; 3], c));
            }
        }
    }

    /// Refuses moved bodies with what refers to the mesh before.
    fn moved_bodies(&mut self, load_case: &LoadCase) {
        for (k, of) in load_case.bodies.iter().enumerate() {
            if of.offset.is_none() && of.rotation.is_none() {
                continue;
            }
            let body = self.case.bodies.iter().find(|body| body.name == of.body);
            let oriented = body.is_some_and(|body| body.materials().any(|m| m.kind() == LawKind::Orthotropic));
            let why = if self.case.contacts.iter().any(|contact| contact.tied) {
                "ties, which join what is close in the mesh"
            } else if !self.case.springs.is_empty() {
                "springs, which the move stretches"
            } else if of.rotation.is_some() && oriented {
                "the axes of an orthotropic material"
            } else {
                continue;
            };
            let message = format!("the load case moves `{}` at its start, but not {why}", of.body);
            let key = format!("load_case[{}].bodies[{k}]", self.options.load_case);
            self.refuse(key, message, "place the body there in a case of its own");
        }
    }

    /// Prescribes a component (`key` from 0, `component` as in a deck) of a set, unless all of it is.
    pub(super) fn prescribe(&mut self, nodes: &[u32], target: String, key: usize, component: usize, curve: Vec<f64>) {
        let keys: Vec<(u32, u8)> = nodes.iter().map(|&node| (node, key as u8)).collect();
        let supports = &mut self.history.supports;
        let rests = curve.iter().all(|value| *value == 0.0);
        let always = |key| supports.prescribed.get(key).is_some_and(|owner| owner.always);
        if rests && keys.iter().all(always) {
            return;
        }
        supports.own(&target, keys);
        let (head, span) = (format!("{target}, {component}, {component}"), supports.span);
        let curve = (!supports.stays).then_some(curve);
        supports.all.push(Support { head, span, curve });
    }

    /// Refuses supports that move from where they are to a first waypoint while a step ends.
    pub(super) fn interrupted_supports(&mut self) {
        let count = self.case.load_path.steps as f64;
        for (table, end) in self.history.supports.interrupted(&self.history.ends()) {
            let message = format!(
                "a step of the deck ends at t = {}, before the support has moved from where it is to its first waypoint",
                number(end as f64 / count)
            );
            self.refuse(format!("dirichlet[{table}].motion"), message, "add a waypoint there");
        }
    }
}

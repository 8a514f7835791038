//! Loads and temperatures over pseudo-time, and the steps in which they and the supports are written.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::ops::Range;

use slipstick_case::file::{Bolt, Keeps, LoadKind};
use slipstick_model::model::preload_at;
use slipstick_solid::load::{add_pressure, nodal_areas};
use slipstick_solid::{Acceleration, MassiveElements};

use super::supports::Supports;
use super::text::{number, numbers};
use super::{DeckRecord, Source, Writer};

/// A line of data of a keyword with a value that changes over the steps.
struct Line {
    keyword: &'static str,
    /// Fields before the value.
    head: String,
    /// Fields after the value, with a comma in front.
    tail: String,
    /// Values at the ends of load steps, from 0.
    curve: Vec<f64>,
}

/// A component with the bits of its values at the ends of load steps.
type Course = (u8, Vec<u64>);

/// What changes along the path.
pub(super) struct History {
    /// Number of load steps.
    steps: usize,
    lines: Vec<Line>,
    /// Text at the start of the step that begins after this load step.
    changes: BTreeMap<usize, String>,
    /// What holds nodes.
    pub supports: Supports,
    /// Conditions before the first step.
    pub initial: String,
}

/// Second differences below this fraction of the largest value are those of a line.
const STRAIGHT: f64 = 1e-10;

impl History {
    pub fn new(steps: usize) -> Self {
        let supports = Supports::new(steps);
        Self { steps, lines: vec![], changes: BTreeMap::new(), supports, initial: String::new() }
    }

    /// Writes a text at the start of the step after load step `at`.
    pub fn change(&mut self, at: usize, text: String) {
        self.changes.entry(at).or_default().push_str(&text);
    }

    /// Values at the ends of load steps.
    pub fn sampled(&self, value: impl Fn(f64) -> f64) -> Vec<f64> {
        (0..=self.steps).map(|n| value(n as f64 / self.steps as f64)).collect()
    }

    /// Adds a line; one with the same fields gets the sum.
    fn add(&mut self, keyword: &'static str, head: String, tail: String, curve: Vec<f64>) {
        let same = |line: &&mut Line| line.keyword == keyword && line.head == head && line.tail == tail;
        if let Some(line) = self.lines.iter_mut().find(same) {
            line.curve.iter_mut().zip(curve).for_each(|(sum, value)| *sum += value);
            return;
        }
        self.lines.push(Line { keyword, head, tail, curve });
    }

    /// Loads the node of a section, and keeps the length of the bolt from the first load step that starts after its
    /// last waypoint.
    pub fn tighten(&mut self, node: u32, bolt: &Bolt) {
        let force = self.sampled(|t| preload_at(&bolt.force, t));
        self.add("CLOAD", format!("{node}, 1"), String::new(), force);
        let last = bolt.force.last().map_or(0.0, |point| point.t);
        let step = (last * self.steps as f64 - 1e-6).ceil() as usize;
        if bolt.keeps == Keeps::Length && step < self.steps {
            self.supports.keep(node, step);
        }
    }

    /// Load steps at which steps end.
    pub fn ends(&self) -> Vec<usize> {
        let mut ends: BTreeSet<usize> = self.changes.keys().copied().filter(|&n| n > 0 && n < self.steps).collect();
        self.lines.iter().for_each(|line| ends.extend(bends(&line.curve, 0..self.steps)));
        ends.extend(self.supports.ends());
        ends.into_iter().chain([self.steps]).collect()
    }
}

/// Load steps inside of a range at which a curve is not straight.
pub(super) fn bends(curve: &[f64], within: Range<usize>) -> Vec<usize> {
    let largest = curve.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
    let bend = |n: &usize| (curve[n + 1] - 2.0 * curve[*n] + curve[n - 1]).abs() > STRAIGHT * largest;
    (within.start + 1..within.end).filter(bend).collect()
}

impl Writer<'_> {
    /// The factor of the load case on a motion or a load.
    pub(super) fn acts(&self, load_case: Option<&String>) -> bool {
        let own = self.case.load_cases.get(self.options.load_case).map(|of| &of.name);
        load_case.is_none() || load_case == own
    }

    pub(super) fn loads(&mut self, masses: &[f64]) {
        let load_case = self.case.load_cases.get(self.options.load_case).cloned().unwrap_or_default();
        let mut nodal: BTreeMap<(u32, u8), Vec<f64>> = BTreeMap::new();
        let mut add = |node: u32, component: usize, value: f64, factors: &[f64]| {
            let curve = nodal.entry((node, component as u8)).or_insert_with(|| vec![0.0; factors.len()]);
            curve.iter_mut().zip(factors).for_each(|(sum, factor)| *sum += value * factor);
        };
        for (i, load) in self.case.loads.iter().enumerate() {
            if !self.acts(load.load_case.as_ref()) {
                continue;
            }
            let own = load_case.loads.iter().find(|of| of.surface == load.surface && !load.surface.is_empty());
            let scale = own.map_or(1.0, |of| of.factor) * load_case.load_factor.unwrap_or(1.0);
            let factors = self.history.sampled(|t| scale * load.factor(t));
            let reference = self.mesh.reference_of(&load.surface);
            let coupled = self.mesh.couplings.iter().any(|of| of.name == load.surface);
            let areas = || {
                let surface = self.mesh.surfaces.get(&load.surface)?;
                let areas = nodal_areas(&self.mesh.faces_of_surface(surface), self.mesh.nodes.as_flattened());
                let total: f64 = areas.iter().map(|(_, area)| area).sum();
                (total > 0.0).then_some((areas, total))
            };
            match (load.kind, reference) {
                (LoadKind::Force(force), Some(reference)) => {
                    (0..3).for_each(|c| add(reference.node, c, force[c], &factors));
                }
                (LoadKind::Moment(moment), Some(reference)) => match coupled {
                    true => (0..3).for_each(|c| add(reference.node, c + 3, moment[c], &factors)),
                    false => (0..3).for_each(|c| add(reference.node + 1, c, moment[c], &factors)),
                },
                (LoadKind::Moment(_), None) => {
                    self.refuse(
                        format!("load[{i}].moment"),
                        "it acts on no rigid body and no coupling",
                        "couple the face",
                    );
                }
                (LoadKind::NodalForce(force), _) => {
                    let nodes = self.mesh.set_nodes(&load.surface).unwrap_or_default();
                    nodes.iter().for_each(|&node| (0..3).for_each(|c| add(node, c, force[c], &factors)));
                }
                (LoadKind::Force(_) | LoadKind::Traction(_), _) => {
                    let Some((areas, total)) = areas() else {
                        let message = format!("nothing is left of `{}`", load.surface);
                        self.refuse(format!("load[{i}].surface"), message, "choose a lower --threshold");
                        continue;
                    };
                    let per_area = match load.kind {
                        LoadKind::Force(force) => force.map(|f| f / total),
                        LoadKind::Traction(traction) => traction,
                        _ => [0.0; 3],
                    };
                    areas
                        .iter()
                        .for_each(|&(node, area)| (0..3).for_each(|c| add(node, c, per_area[c] * area, &factors)));
                }
                (LoadKind::Pressure(pressure), _) => {
                    let Some(surface) = self.surface(&load.surface) else {
                        let message = format!("nothing is left of `{}`", load.surface);
                        self.refuse(format!("load[{i}].surface"), message, "choose a lower --threshold");
                        continue;
                    };
                    let last = pressure * factors[factors.len() - 1];
                    let faces = self.mesh.faces_of_surface(&self.mesh.surfaces[&load.surface]);
                    add_pressure(&faces, self.mesh.nodes.as_flattened(), -last, &mut self.external);
                    let curve = factors.iter().map(|factor| pressure * factor).collect();
                    self.history.add("DSLOAD", format!("{surface}, P"), String::new(), curve);
                }
                (LoadKind::Gravity(g), _) => {
                    let size = g.iter().map(|x| x * x).sum::<f64>().sqrt();
                    if size > 0.0 {
                        let tail = format!(", {}", numbers(&g.map(|x| x / size)));
                        self.weigh(load.body.as_ref(), Acceleration::Uniform(g), factors[factors.len() - 1], masses);
                        self.on_mass(load.body.as_ref(), "GRAV", &tail, factors.iter().map(|f| size * f).collect());
                    }
                }
                (LoadKind::Centrifugal(of), _) => {
                    let tail = format!(", {}, {}", numbers(&of.point), numbers(&of.direction));
                    let field = Acceleration::centrifugal(of.point, of.direction, of.angular_velocity);
                    self.weigh(load.body.as_ref(), field, factors[factors.len() - 1], masses);
                    let square = of.angular_velocity * of.angular_velocity;
                    self.on_mass(load.body.as_ref(), "CENTRIF", &tail, factors.iter().map(|f| square * f).collect());
                }
            }
        }
        self.move_from_centres(&mut nodal);
        // nodes with the same force share a set
        let mut groups: BTreeMap<Course, Vec<u32>> = BTreeMap::new();
        for ((node, component), curve) in nodal {
            if component < 3 {
                self.external[3 * node as usize + usize::from(component)] += curve[curve.len() - 1];
            }
            if curve.iter().all(|value| *value == 0.0) {
                continue;
            }
            groups.entry((component, curve.iter().map(|x| x.to_bits()).collect())).or_default().push(node);
        }
        let mut count = 0;
        // after the reference node of a coupling, CalculiX 2.20 skips lines with sets
        let mut groups: Vec<(Course, Vec<u32>)> = groups.into_iter().collect();
        groups.sort_by_key(|(_, nodes)| if nodes.len() > 1 { 0 } else { nodes[0] + 1 });
        for ((component, bits), nodes) in groups {
            let curve = bits.into_iter().map(f64::from_bits).collect();
            let target = match nodes[..] {
                [node] => (node + 1).to_string(),
                _ => {
                    count += 1;
                    self.new_set(&format!("loaded_{count}"), nodes)
                }
            };
            self.history.add("CLOAD", format!("{target}, {}", component + 1), String::new(), curve);
        }
    }

    /// Moves forces on the centres of faces and elements of second order, which decks do not have, to the nodes from
    /// which serendipity functions give their displacements: forces on faces become consistent with these functions.
    fn move_from_centres(&self, nodal: &mut BTreeMap<(u32, u8), Vec<f64>>) {
        for centre in self.mesh.serendipity_centres(0..self.mesh.elements.len(), &BTreeSet::new()) {
            for component in 0..3 {
                let Some(curve) = nodal.remove(&(centre.node, component)) else { continue };
                for &(node, weight) in &centre.terms {
                    let sum = nodal.entry((node, component)).or_insert_with(|| vec![0.0; curve.len()]);
                    sum.iter_mut().zip(&curve).for_each(|(sum, value)| *sum += weight * value);
                }
            }
        }
    }

    /// Adds a load on the mass of one body or of all to the loads at the end.
    fn weigh(&mut self, body: Option<&String>, field: Acceleration, factor: f64, masses: &[f64]) {
        let body = body.and_then(|name| self.mesh.body(name));
        let range = body.map_or(0..self.mesh.elements.len(), |body| body.elements.clone());
        let x = self.mesh.nodes.as_flattened();
        let formulations = self.sections.formulations(self.mesh);
        let elements = MassiveElements::new(self.mesh, range, |e| formulations.get(e).copied().unwrap_or_default());
        elements.add_forces(&field, masses, factor, x, |_| true, &mut self.external);
    }

    /// A load on the mass of one body or of all.
    fn on_mass(&mut self, body: Option<&String>, kind: &str, tail: &str, curve: Vec<f64>) {
        for b in 0..self.mesh.bodies.len() {
            let of = &self.case.bodies[b];
            if body.is_some_and(|name| *name != of.name) || !of.has_mass() {
                continue;
            }
            let head = format!("{}, {kind}", self.names.bodies[b]);
            self.history.add("DLOAD", head, tail.to_owned(), curve.clone());
        }
    }

    /// Changes of temperature, at the nodes.
    pub(super) fn temperatures(&mut self) {
        if self.case.temperatures.is_empty() {
            return;
        }
        let steps = self.case.load_path.steps;
        let mut curves: Vec<Option<Vec<f64>>> = vec![None; self.mesh.nodes.len()];
        for temperature in self.case.temperatures.iter().filter(|of| self.acts(of.load_case.as_ref())) {
            let nodes: Vec<u32> = match (&temperature.set, &temperature.body) {
                (Some(set), _) => self.mesh.set_nodes(set).unwrap_or_default().into_owned(),
                (None, Some(name)) => {
                    self.mesh.body(name).map_or(vec![], |body| body.nodes.clone().map(|n| n as u32).collect())
                }
                (None, None) => self.mesh.bodies.iter().flat_map(|body| body.nodes.clone()).map(|n| n as u32).collect(),
            };
            let factor = |n: usize| factor_at(temperature, n as f64 / steps as f64);
            let own: Vec<f64> = (0..=steps).map(|n| temperature.change * factor(n)).collect();
            for node in nodes {
                let curve = curves[node as usize].get_or_insert_with(|| vec![0.0; steps + 1]);
                curve.iter_mut().zip(&own).for_each(|(sum, value)| *sum += value);
            }
        }
        let all: Vec<u32> = self.mesh.bodies.iter().flat_map(|body| body.nodes.clone()).map(|n| n as u32).collect();
        let set = self.new_set("all_nodes", all);
        let _ = writeln!(self.history.initial, "*INITIAL CONDITIONS, TYPE=TEMPERATURE\n{set}, 0.0");
        let mut groups: BTreeMap<Vec<u64>, Vec<u32>> = BTreeMap::new();
        for (node, curve) in (0_u32..).zip(&curves).filter_map(|(node, curve)| Some((node, curve.as_ref()?))) {
            groups.entry(curve.iter().map(|x| x.to_bits()).collect()).or_default().push(node);
        }
        for (k, (bits, nodes)) in groups.into_iter().enumerate() {
            let set = self.new_set(&format!("heated_{}", k + 1), nodes);
            self.history.add("TEMPERATURE", set, String::new(), bits.into_iter().map(f64::from_bits).collect());
        }
        let second = self.mesh.elements.iter().any(|element| element.is_second_order());
        if second && self.case.temperatures.iter().any(|of| of.set.is_some()) {
            let message =
                "temperatures of nodes vary within elements of second order in CalculiX, and are averaged here";
            self.warn("temperature.set", message, "heat whole bodies to compare the same strains");
        }
    }

    /// The steps, with requests for what is compared.
    pub(super) fn steps(&mut self, record: &DeckRecord) -> String {
        let mut text = self.history.supports.before_the_steps();
        text.push_str(&std::mem::take(&mut self.history.initial));
        let count = self.case.load_path.steps;
        let nlgeom = if self.small() { "" } else { ", NLGEOM" };
        let mut start = 0;
        for end in self.history.ends() {
            let time = |n: usize| number(n as f64 / count as f64);
            let _ = writeln!(text, "*STEP{nlgeom}, INC=100000\n*STATIC");
            let _ = writeln!(text, "{}, {}, 1e-6, {}", time(1), time(end - start), time(1));
            if let Some(change) = self.history.changes.get(&start) {
                text.push_str(change);
            }
            text.push_str(&self.history.supports.in_step(start, end));
            let mut keyword = "";
            for line in &self.history.lines {
                if line.curve[end] == line.curve[start] {
                    continue;
                }
                if line.keyword != keyword {
                    keyword = line.keyword;
                    let _ = writeln!(text, "*{keyword}");
                }
                let _ = writeln!(text, "{}, {}{}", line.head, number(line.curve[end]), line.tail);
            }
            if start == 0 {
                text.push_str(&self.requests(record));
            }
            text.push_str("*END STEP\n");
            start = end;
        }
        text
    }

    /// Output at the ends of steps.
    fn requests(&self, record: &DeckRecord) -> String {
        let contact = self.case.contacts.iter().any(|contact| !contact.tied);
        let mut text = String::from("*NODE FILE, FREQUENCY=100000\nU, RF\n*EL FILE, FREQUENCY=100000\nS, E\n");
        if contact {
            text.push_str("*CONTACT FILE, FREQUENCY=100000\nCDIS, CSTR\n");
        }
        let mut seen = BTreeSet::new();
        for compared in &record.compared {
            match &compared.source {
                Source::Contact { slave, master, .. } if seen.insert(slave.clone()) => {
                    let _ = writeln!(text, "*CONTACT PRINT, SLAVE={slave}, MASTER={master}, FREQUENCY=100000\nCF");
                }
                _ => {}
            }
        }
        text
    }
}

/// The factor of a temperature at pseudo-time `t`: piecewise linear through (0, 0) and the waypoints.
fn factor_at(temperature: &slipstick_case::file::Temperature, t: f64) -> f64 {
    let mut last = (0.0, 0.0);
    for point in &temperature.amplitude {
        if t < point.t {
            return last.1 + (t - last.0) / (point.t - last.0) * (point.factor - last.1);
        }
        last = (point.t, point.factor);
    }
    last.1
}

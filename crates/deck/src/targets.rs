//! What motions, forces, pressures and contact act on: nodes and faces, grouped into sets of the file.

mod bolts;
mod centres;
mod equations;
mod heat;
mod mass;
mod mpcs;
mod pressures;
mod rigid;
mod springs;
mod surfaces;
mod temporary;
mod turned;

use std::collections::{BTreeMap, BTreeSet, HashSet};

use slipstick_meshio::{Centre, FileMesh};

use crate::bodies::{Bodies, find};
use crate::history::{Curve, Timeline, Track, Tracks};
use crate::ledger::Ledger;
use crate::read::{Deck, Equation, On, Target};
pub use bolts::Tightened;
pub use equations::{CoupledFace, EquationOfSets, Joined};
pub use heat::Heated;
pub use mass::MassLoad;
pub use pressures::Pressure;
pub use springs::{End, Sprung};

/// Nodes whose motion is prescribed alike.
#[derive(Debug)]
pub struct Held {
    /// The set of the file; `None`: the rigid body itself.
    pub set: Option<String>,
    pub bodies: Vec<usize>,
    /// Components from 0 with their curves: displacements, then rotations.
    pub components: Vec<(u8, Curve)>,
    pub line: usize,
    /// Pseudo-time at which it begins, and at which it ends if it does.
    pub from: f64,
    pub until: Option<f64>,
}

/// Forces on each node of a set, or on a rigid body.
#[derive(Debug)]
pub struct Forces {
    pub set: Option<String>,
    pub bodies: Vec<usize>,
    /// A component from 0: forces, then moments.
    pub component: u8,
    pub curve: Curve,
    pub line: usize,
}

/// All of them.
#[derive(Debug, Default)]
pub struct Targets {
    pub held: Vec<Held>,
    pub forces: Vec<Forces>,
    pub pressures: Vec<Pressure>,
    pub masses: Vec<MassLoad>,
    pub sprung: Vec<Sprung>,
    /// Nodes of no body that become points, with their names.
    pub points: Vec<(u32, String)>,
    pub equations: Vec<EquationOfSets>,
    pub couplings: Vec<CoupledFace>,
    pub bolts: Vec<Tightened>,
    pub heated: Vec<Heated>,
    /// Number of load steps of the case, and those of each step.
    pub load_steps: usize,
    pub counts: Vec<usize>,
}

struct Finder<'a> {
    mesh: &'a mut FileMesh,
    /// The nodes that the deck does not have: at the centres of hexahedra of 20 nodes and their faces.
    centres: &'a [Centre],
    deck: &'a Deck,
    bodies: &'a Bodies,
    ledger: &'a mut Ledger,
    points: Vec<(u32, String)>,
    couplings: Vec<CoupledFace>,
    /// Equations of multi-point constraints.
    constraints: Vec<Equation>,
    /// The names of the file's sets, in capitals.
    names: HashSet<String>,
    /// The last number in the names of new sets, by what comes before it.
    numbers: BTreeMap<String, usize>,
}

/// In place of a body: a point.
pub const POINT: usize = usize::MAX;

type OfNode = (u32, u8);

/// A curve that can be compared.
type Bits = Vec<[u64; 2]>;

/// Nodes with the same component and curve.
type Groups<'t> = BTreeMap<(u8, Bits), Vec<(u32, &'t Track)>>;

impl Targets {
    /// Groups nodes and faces; groups that are no set of the file become one.
    pub fn new(mesh: &mut FileMesh, centres: &[Centre], deck: &Deck, bodies: &Bodies, ledger: &mut Ledger) -> Self {
        let timeline = Timeline::new(deck);
        let (points, couplings) = (Vec::new(), Vec::new());
        let constraints = Vec::new();
        let names = mesh.node_sets.keys().chain(mesh.face_sets.keys()).chain(mesh.cell_sets.keys());
        let (names, numbers) = (names.map(|name| name.to_ascii_uppercase()).collect(), BTreeMap::new());
        let mut finder = Finder { mesh, centres, deck, bodies, ledger, points, couplings, constraints, names, numbers };
        finder.faces_of_nodes();
        let mut targets = Self { load_steps: timeline.total(), counts: timeline.counts.clone(), ..Self::default() };
        if deck.steps.is_empty() {
            finder.ledger.wrong("STEP", [1, 1], "the deck has no step", "add a *STEP with *STATIC");
            return targets;
        }
        finder.find_couplings();
        finder.couple_rigid_faces();
        finder.constraints = finder.multi_point();
        finder.find_points();
        targets.equations = finder.equations();
        let mut motions = finder.motions(&timeline);
        let mut forces = finder.forces(&timeline);
        let turned = finder.turned(&mut motions, &mut forces);
        targets.bolts = finder.bolts(&timeline, &mut motions, &mut forces);
        targets.sprung = finder.springs(&motions);
        targets.held = finder.held_in_their_steps(&timeline, motions);
        targets.forces = finder.loaded(forces);
        targets.pressures = finder.pressures(&timeline);
        targets.masses = finder.masses(&timeline);
        targets.heated = finder.heated(&timeline);
        (targets.points, targets.couplings) = (finder.points, finder.couplings);
        targets.equations.extend(turned.equations);
        targets.points.extend(turned.points);
        targets.held.extend(turned.held);
        targets
    }
}

impl Finder<'_> {
    /// The nodes of a target; empty after an error.
    fn nodes(&mut self, target: &Target, keyword: &str, lines: [usize; 2]) -> Vec<u32> {
        match target {
            Target::Node(number) => match self.bodies.position(*number) {
                Some(node) => vec![node],
                None => {
                    let why = format!("there is no node {number}");
                    self.ledger.wrong(keyword, lines, why, "name a node or a set of nodes");
                    vec![]
                }
            },
            Target::Set(name) => match find(&self.mesh.node_sets, name) {
                Some(set) => self.mesh.node_sets[set].clone(),
                None => {
                    let why = format!("there is no set of nodes `{name}`");
                    self.ledger.wrong(keyword, lines, why, "define it with *NSET");
                    vec![]
                }
            },
        }
    }

    /// Those of them that the deck has.
    fn own_nodes(&mut self, target: &Target, keyword: &str, lines: [usize; 2]) -> Vec<u32> {
        let mut nodes = self.nodes(target, keyword, lines);
        nodes.retain(|&node| self.centres.first().is_none_or(|first| node < first.node));
        nodes
    }

    fn amplitude<'d>(
        &mut self,
        deck: &'d Deck,
        name: &Option<String>,
        keyword: &str,
        lines: [usize; 2],
    ) -> Option<&'d crate::read::Amplitude> {
        let name = name.as_ref()?;
        let found = deck.amplitudes.get(name);
        if found.is_none() {
            let why = format!("there is no amplitude `{name}`");
            self.ledger.wrong(keyword, lines, why, "define it with *AMPLITUDE");
        }
        found
    }

    /// The prescribed components of all nodes, with the lines of their keywords.
    fn motions(&mut self, timeline: &Timeline) -> BTreeMap<OfNode, Track> {
        let deck = self.deck;
        let mut tracks = Tracks::new(timeline, deck, false);
        let mut kept = BTreeSet::new();
        for (k, step) in deck.steps.iter().enumerate() {
            let initial = if k == 0 { &deck.conditions[..] } else { &[] };
            kept.extend(initial.iter().filter(|of| of.fixed).map(|of| of.lines[0]));
            let first = step.conditions.items.iter().filter(|of| k == 0 && of.fixed && !self.is_of_sections(of));
            kept.extend(first.map(|of| of.lines[0]));
            for condition in initial.iter().chain(&step.conditions.items) {
                let of_section = condition.fixed && self.is_of_sections(condition);
                if of_section || (condition.fixed && kept.contains(&condition.lines[0])) {
                    continue;
                }
                let amplitude = self.amplitude(deck, &condition.amplitude, "BOUNDARY", condition.lines);
                let set = match &condition.target {
                    Target::Set(name) => find(&self.mesh.node_sets, name).map(str::to_owned),
                    Target::Node(_) => None,
                };
                for node in self.nodes(&condition.target, "BOUNDARY", condition.lines) {
                    let key = (node, condition.component);
                    if condition.fixed {
                        tracks.keep(key, condition.lines[0], set.as_deref());
                        continue;
                    }
                    tracks.say(key, condition.value, amplitude, condition.lines[0], set.as_deref());
                }
            }
            tracks.step(k, step.conditions.replaces);
        }
        for line in kept {
            let why = "FIXED keeps what the step before has reached: before and in the first step, there is nothing";
            self.ledger.refuse("BOUNDARY", line, why, "prescribe zero, or write it in a later step");
        }
        let mut tracks = self.with_rotations(tracks.tracks);
        self.check_temporary(&tracks);
        self.rigid_faces(&mut tracks);
        self.prescribe_centres(&mut tracks);
        tracks
    }

    /// The rigid body of which a node is the reference or rotation node, and the first of its components.
    fn reference(&self, node: u32) -> Option<(usize, u8)> {
        self.bodies.list.iter().enumerate().find_map(|(index, body)| {
            let rigid = &self.deck.rigids[body.rigid?];
            let is = |number: u64| self.bodies.position(number) == Some(node);
            if is(rigid.reference) { Some((index, 0)) } else { rigid.rotation.filter(|&n| is(n)).map(|_| (index, 3)) }
        })
    }

    /// Groups nodes with the same motion.
    fn held(&mut self, tracks: BTreeMap<OfNode, Track>) -> Vec<Held> {
        let mut rigid: BTreeMap<usize, (Vec<(u8, Curve)>, usize)> = BTreeMap::new();
        let mut of_node: BTreeMap<u32, Vec<(u8, &Track)>> = BTreeMap::new();
        for ((node, component), track) in &tracks {
            match self.reference(*node) {
                Some((body, first)) if *component < 3 || first == 0 => {
                    let entry = rigid.entry(body).or_insert_with(|| (Vec::new(), track.line));
                    entry.0.push((first + component, track.motion()));
                }
                Some(_) => {}
                None if (*component < 3 && self.bodies.of(*node).is_some())
                    || self.point(*node).is_some_and(|(_, components)| *component < components) =>
                {
                    of_node.entry(*node).or_default().push((*component, track));
                }
                None => {}
            }
        }
        let whole = |body: usize| self.bodies.list[body].rigid.is_some();
        of_node.retain(|&node, _| self.bodies.of(node).is_none_or(|body| !whole(body)));
        let mut held = self.held_points(&mut of_node);
        held.extend(self.held_sets(&mut of_node));
        let mut groups: BTreeMap<Vec<(u8, Bits)>, Vec<u32>> = BTreeMap::new();
        for (node, components) in &of_node {
            let key = components.iter().map(|(component, track)| (*component, bits(&track.motion()))).collect();
            groups.entry(key).or_default().push(*node);
        }
        for nodes in groups.into_values() {
            let components = &of_node[&nodes[0]];
            let line = components.iter().map(|(_, track)| track.line).max().unwrap_or(1);
            let sets: BTreeSet<&str> = components.iter().filter_map(|(_, track)| track.set.as_deref()).collect();
            let curves = components.iter().map(|(component, track)| (*component, track.motion())).collect();
            let sets: Vec<String> = sets.into_iter().map(str::to_owned).collect();
            held.push(Held {
                set: Some(String::new()),
                bodies: vec![],
                components: curves,
                line,
                from: 0.0,
                until: None,
            });
            let (set, bodies) = self.set_of(&nodes, &sets, "held");
            let last = held.len() - 1;
            (held[last].set, held[last].bodies) = (Some(set), bodies);
        }
        for (body, (components, line)) in rigid {
            held.push(Held { set: None, bodies: vec![body], components, line, from: 0.0, until: None });
        }
        held.sort_by_key(|held| held.line);
        held
    }

    /// Sets of the deck whose nodes all move as the deck says of the set; their components are taken from
    /// `of_node`.
    fn held_sets(&mut self, of_node: &mut BTreeMap<u32, Vec<(u8, &Track)>>) -> Vec<Held> {
        let mut said: Vec<(String, BTreeSet<u8>, usize)> = Vec::new();
        let steps = self.deck.steps.iter().flat_map(|step| &step.conditions.items);
        for condition in self.deck.conditions.iter().chain(steps) {
            let Target::Set(name) = &condition.target else { continue };
            let Some(set) = find(&self.mesh.node_sets, name).map(str::to_owned) else { continue };
            match said.iter_mut().find(|(known, ..)| *known == set) {
                Some((_, components, _)) => components.extend([condition.component]),
                None => said.push((set, BTreeSet::from([condition.component]), condition.lines[0])),
            }
        }
        let (mut held, mut taken): (Vec<Held>, Vec<OfNode>) = (Vec::new(), Vec::new());
        for (set, components, line) in said {
            if find(&self.mesh.face_sets, &set).is_some() || find(&self.mesh.cell_sets, &set).is_some() {
                continue;
            }
            let nodes: Vec<u32> =
                self.mesh.node_sets[&set].iter().copied().filter(|node| of_node.contains_key(node)).collect();
            let solid = self.mesh.node_sets[&set].iter().filter(|&&node| self.bodies.of(node).is_some()).count();
            let Some(&first) = nodes.first().filter(|_| nodes.len() == solid) else { continue };
            let curve = |node: u32, component: u8| {
                let (_, track) = of_node[&node].iter().find(|(own, _)| *own == component)?;
                Some(track.motion())
            };
            let alike = |component: &u8| {
                let curve_of_first = curve(first, *component)?;
                let alike = nodes.iter().all(|&node| curve(node, *component).as_ref() == Some(&curve_of_first));
                alike.then_some((*component, curve_of_first))
            };
            let components: Vec<(u8, Curve)> = components.iter().filter_map(alike).collect();
            if components.is_empty() {
                continue;
            }
            let bodies: BTreeSet<usize> = nodes.iter().filter_map(|&node| self.bodies.of(node)).collect();
            taken
                .extend(nodes.iter().flat_map(|&node| components.iter().map(move |(component, _)| (node, *component))));
            held.push(Held {
                set: Some(set),
                bodies: bodies.into_iter().collect(),
                components,
                line,
                from: 0.0,
                until: None,
            });
        }
        let taken: HashSet<OfNode> = taken.into_iter().collect();
        for (node, components) in of_node.iter_mut() {
            components.retain(|(component, _)| !taken.contains(&(*node, *component)));
        }
        of_node.retain(|_, components| !components.is_empty());
        held
    }

    /// The set with exactly these nodes of bodies, one of `named` or a new one, and their bodies.
    fn set_of(&mut self, nodes: &[u32], named: &[String], prefix: &str) -> (String, Vec<usize>) {
        let bodies: BTreeSet<usize> = nodes.iter().filter_map(|&node| self.bodies.of(node)).collect();
        let taken = |set: &str| find(&self.mesh.face_sets, set).is_some() || find(&self.mesh.cell_sets, set).is_some();
        let same = |set: &&String| {
            let solid =
                self.mesh.node_sets.get(*set).into_iter().flatten().filter(|&&node| self.bodies.of(node).is_some());
            !taken(set) && solid.eq(nodes)
        };
        let known = named.iter().find(same).cloned();
        let set = known.unwrap_or_else(|| {
            let number = self.numbers.entry(prefix.to_owned()).or_default();
            loop {
                *number += 1;
                let name = format!("{prefix}_{number}");
                let known = self.names.contains(&name.to_ascii_uppercase())
                    || self.mesh.face_sets.contains_key(&name)
                    || self.mesh.cell_sets.contains_key(&name);
                if !known && !self.mesh.node_sets.contains_key(&name) {
                    self.mesh.node_sets.insert(name.clone(), nodes.to_vec());
                    break name;
                }
            }
        });
        (set, bodies.into_iter().collect())
    }

    /// Forces on nodes over the steps.
    fn forces(&mut self, timeline: &Timeline) -> BTreeMap<OfNode, Track> {
        let deck = self.deck;
        let mut tracks = Tracks::new(timeline, deck, true);
        for (k, step) in deck.steps.iter().enumerate() {
            for load in &step.loads {
                let On::Nodes(target, component) = &load.on else { continue };
                let amplitude = self.amplitude(deck, &load.amplitude, load.keyword, load.lines);
                let set = match target {
                    Target::Set(name) => find(&self.mesh.node_sets, name).map(str::to_owned),
                    Target::Node(_) => None,
                };
                for node in self.own_nodes(target, load.keyword, load.lines) {
                    tracks.say((node, *component), load.value, amplitude, load.lines[0], set.as_deref());
                }
            }
            tracks.step(k, step.replaces("CLOAD"));
        }
        self.with_rotations(tracks.tracks)
    }

    fn loaded(&mut self, tracks: BTreeMap<OfNode, Track>) -> Vec<Forces> {
        let mut forces: Vec<Forces> = Vec::new();
        let mut groups = Groups::new();
        for ((node, component), track) in &tracks {
            let curve = track.simple();
            if curve.iter().all(|point| point[1] == 0.0) {
                continue;
            }
            if let Some((body, first)) = self.reference(*node) {
                let component = first + component;
                forces.push(Forces { set: None, bodies: vec![body], component, curve, line: track.line });
                continue;
            }
            if let Some((name, _)) = self.point(*node).filter(|(_, components)| component < components) {
                let (set, bodies, component) = (Some(name.to_owned()), vec![POINT], *component);
                forces.push(Forces { set, bodies, component, curve, line: track.line });
                continue;
            }
            if self.bodies.of(*node).is_none() || *component > 2 {
                let why = match component {
                    0..=2 => "a force acts on a node of no body",
                    _ => "moments act only on the reference nodes of rigid bodies",
                };
                self.ledger.refuse("CLOAD", track.line, why, "load nodes of solid elements or a rigid body");
                continue;
            }
            groups.entry((*component, bits(&curve))).or_default().push((*node, track));
        }
        for ((component, _), group) in groups {
            let nodes: Vec<u32> = group.iter().map(|(node, _)| *node).collect();
            let line = group[0].1.line;
            let sets: Vec<String> = group[0].1.set.iter().cloned().collect();
            let (set, bodies) = self.set_of(&nodes, &sets, "loaded");
            forces.push(Forces { set: Some(set), bodies, component, curve: group[0].1.simple(), line });
        }
        forces.sort_by_key(|force| force.line);
        forces
    }
}

fn bits(curve: &Curve) -> Bits {
    curve.iter().map(|point| point.map(f64::to_bits)).collect()
}

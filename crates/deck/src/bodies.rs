//! The bodies of a deck: its connected components of solid elements.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use slipstick_meshio::{CellKind, Centre, FileMesh};

use crate::ledger::Ledger;
use crate::read::Deck;

/// A connected component of solid elements.
#[derive(Debug)]
pub struct Body {
    /// Its name in the case.
    pub name: String,
    /// The set of elements in the file; `None`: all solid elements.
    pub part: Option<String>,
    /// Sections of its elements with the number of elements, the largest first; sections are positions in
    /// [`Deck::sections`].
    pub sections: Vec<(usize, usize)>,
    /// Position in [`Deck::rigids`], if it is rigid.
    pub rigid: Option<usize>,
    /// Whether it has hexahedra of 8 nodes.
    pub hexahedra: bool,
    /// Whether some of these are of a type against locking.
    pub soft: bool,
    /// Whether it has hexahedra of 20 nodes or wedges of 15.
    pub serendipity: bool,
    /// Whether all hexahedra of 20 nodes, if there are any, are of a type with reduced integration.
    pub reduced: bool,
    /// Whether it has elements with nodes between corners, whose facets may be curved.
    pub second_order: bool,
}

/// All bodies.
#[derive(Debug)]
pub struct Bodies {
    pub list: Vec<Body>,
    /// Body of each node of the file; [`NONE`] if no solid element has the node.
    of_node: Vec<u32>,
    /// Nodes by their numbers, ascending.
    numbers: Vec<(u64, u32)>,
}

const NONE: u32 = u32::MAX;

impl Bodies {
    /// Finds the bodies; those that no set names get one. `centres` are the nodes that complete elements of 15
    /// and 20.
    pub fn new(mesh: &mut FileMesh, centres: &[Centre], deck: &Deck, ledger: &mut Ledger) -> Self {
        let cells = mesh.solid_cells(None);
        let all = cells.len();
        let component = components(mesh, &cells);
        let sections = sections(mesh, deck, ledger);
        let mut numbers: Vec<(u64, u32)> = mesh.point_numbers.iter().copied().zip(0..).collect();
        numbers.sort_unstable();
        let mut of_component: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for &cell in &cells {
            of_component.entry(component[mesh.cells.nodes(cell as usize)[0] as usize]).or_default().push(cell);
        }
        drop(cells);
        let mut groups: Vec<(u32, Vec<u32>)> = of_component.into_iter().collect();
        groups.sort_by_key(|(_, cells)| cells[0]);
        let order: HashMap<u32, u32> = groups.iter().map(|(component, _)| *component).zip(0..).collect();
        let of_node = component.iter().map(|component| order.get(component).copied().unwrap_or(NONE)).collect();
        let mut bodies = Self { list: Vec::new(), of_node, numbers };
        let softened = softened(mesh, deck, all);
        let reduced = reduced(mesh, deck);
        let completed: BTreeSet<u32> = centres.iter().map(|centre| centre.node).collect();
        let (mut names, alone) = (BTreeSet::new(), groups.len() == 1);
        let mut without = 0;
        for (_, cells) in groups {
            let mut counts: BTreeMap<usize, usize> = BTreeMap::new();
            for cell in &cells {
                match sections[*cell as usize] {
                    NONE if deck.thickened.binary_search(cell).is_ok() => {}
                    NONE => without += 1,
                    section => *counts.entry(section as usize).or_default() += 1,
                }
            }
            let mut counts: Vec<(usize, usize)> = counts.into_iter().collect();
            counts.sort_by_key(|&(section, count)| (std::cmp::Reverse(count), section));
            let named = exact_set(mesh, &cells, deck);
            let base = named.clone().or_else(|| Some(deck.sections[counts.first()?.0].set.clone()));
            let mut name = proper(base.as_deref().unwrap_or("body"));
            if named.is_none() && !alone {
                name = (1..).map(|k| format!("{name}_{k}")).find(|name| !names.contains(name)).unwrap_or(name);
            }
            while !names.insert(name.clone()) {
                name.push('_');
            }
            let part = match named {
                Some(set) if cells.len() < all => Some(set),
                _ if cells.len() == all => None,
                _ => {
                    let mut set = format!("{name}_solids");
                    while mesh.cell_sets.contains_key(&set) {
                        set.push('_');
                    }
                    mesh.cell_sets.insert(set.clone(), cells.clone());
                    Some(set)
                }
            };
            let has = |kinds: &[CellKind]| cells.iter().any(|&cell| kinds.contains(&mesh.cells.kind(cell as usize)));
            let hexahedra = has(&[CellKind::Hex8]);
            let second_order = cells.iter().any(|&cell| mesh.cells.kind(cell as usize).is_second_order());
            let soft = hexahedra && cells.iter().any(|cell| softened.binary_search(cell).is_ok());
            let of = |kind: CellKind, cell: u32| {
                let last = mesh.cells.nodes(cell as usize).last();
                mesh.cells.kind(cell as usize) == kind && last.is_some_and(|node| completed.contains(node))
            };
            let of_20: Vec<u32> = cells.iter().filter(|&&cell| of(CellKind::Hex27, cell)).copied().collect();
            let serendipity = !of_20.is_empty() || cells.iter().any(|&cell| of(CellKind::Wedge18, cell));
            let reduced = !of_20.is_empty() && of_20.iter().all(|cell| reduced.binary_search(cell).is_ok());
            let (sections, rigid) = (counts, None);
            bodies.list.push(Body { name, part, sections, rigid, hexahedra, soft, serendipity, reduced, second_order });
        }
        bodies.find_rigid(mesh, deck, ledger);
        let line = deck.element_types.first().map_or(1, |of| of.line);
        if without > 0 {
            let why = format!("{without} solid elements have no *SOLID SECTION");
            ledger.wrong("ELEMENT", [line, line], why, "assign a material to every element");
        }
        if bodies.list.is_empty() {
            ledger.wrong("ELEMENT", [line, line], "there are no solid elements", "mesh the parts with solid elements");
        }
        bodies
    }

    /// Marks bodies all of whose nodes a `*RIGID BODY` names.
    fn find_rigid(&mut self, mesh: &FileMesh, deck: &Deck, ledger: &mut Ledger) {
        for (index, rigid) in deck.rigids.iter().enumerate() {
            let nodes = rigid_nodes(mesh, rigid);
            if self.position(rigid.reference).is_none() {
                let why = format!("there is no node {}", rigid.reference);
                ledger.wrong("RIGID BODY", [rigid.line; 2], why, "define the reference node");
            }
            let mut counts: BTreeMap<usize, usize> = BTreeMap::new();
            nodes.iter().filter_map(|&node| self.of(node)).for_each(|body| *counts.entry(body).or_default() += 1);
            if counts.is_empty() {
                let cure = "name a set of nodes or elements of a body";
                ledger.wrong("RIGID BODY", [rigid.line; 2], "it has no nodes of solid elements", cure);
            }
            let whole = |&(&body, &count): &(&usize, &usize)| {
                self.of_node.iter().filter(|&&of| of as usize == body).count() == count
            };
            let whole: Vec<usize> = counts.iter().filter(whole).map(|(&body, _)| body).collect();
            match whole[..] {
                [_] if counts.len() > 1 => ledger.refuse(
                    "RIGID BODY",
                    rigid.line,
                    "it has all nodes of one body, and some of another, which it would not move",
                    "leave out the nodes of the other body, and tie a surface of this body to the rigid one with *TIE",
                ),
                [body] => {
                    self.list[body].rigid = Some(index);
                    ledger.translated("RIGID BODY", rigid.line, "`rigid`, with this reference point");
                }
                [] => {}
                _ => ledger.refuse(
                    "RIGID BODY",
                    rigid.line,
                    "it joins bodies that do not touch",
                    "write one for each body",
                ),
            }
        }
    }

    /// The body of a node of the file.
    pub fn of(&self, node: u32) -> Option<usize> {
        self.of_node.get(node as usize).filter(|&&body| body != NONE).map(|&body| body as usize)
    }

    /// The bodies on which a surface of the file lies.
    pub fn under(&self, mesh: &FileMesh, surface: &str) -> Vec<usize> {
        let faces = mesh.face_sets.get(surface).into_iter().flatten().map(|face| face.cell);
        let facets = mesh.cell_sets.get(surface).into_iter().flatten().copied();
        let facets = facets.filter(|&cell| mesh.cells.kind(cell as usize).dimension() == 2);
        let nodes = faces.chain(facets).map(|cell| mesh.cells.nodes(cell as usize)[0]);
        nodes.filter_map(|node| self.of(node)).collect::<BTreeSet<_>>().into_iter().collect()
    }

    /// The position of the node with a number.
    pub fn position(&self, number: u64) -> Option<u32> {
        let at = self.numbers.binary_search_by_key(&number, |&(number, _)| number).ok()?;
        Some(self.numbers[at].1)
    }
}

/// The nodes that a rigid body has, ascending.
pub fn rigid_nodes(mesh: &FileMesh, rigid: &crate::read::Rigid) -> Vec<u32> {
    let mut nodes: Vec<u32> = Vec::new();
    if let Some(set) = rigid.nodes.as_ref().and_then(|set| find(&mesh.node_sets, set)) {
        nodes.extend(&mesh.node_sets[set]);
    }
    if let Some(set) = rigid.elements.as_ref().and_then(|set| find(&mesh.cell_sets, set)) {
        nodes.extend(mesh.cell_sets[set].iter().flat_map(|&cell| mesh.cells.nodes(cell as usize)));
    }
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}

/// For each node, the smallest node that elements connect it to; nodes of no element are alone.
fn components(mesh: &FileMesh, cells: &[u32]) -> Vec<u32> {
    let mut parent: Vec<u32> = (0..mesh.points.len() as u32).collect();
    fn root(parent: &mut [u32], mut node: u32) -> u32 {
        while parent[node as usize] != node {
            parent[node as usize] = parent[parent[node as usize] as usize];
            node = parent[node as usize];
        }
        node
    }
    for &cell in cells {
        let nodes = mesh.cells.nodes(cell as usize);
        for &node in &nodes[1..] {
            let (a, b) = (root(&mut parent, nodes[0]), root(&mut parent, node));
            let (low, high) = (a.min(b), a.max(b));
            parent[high as usize] = low;
        }
    }
    let roots: Vec<u32> = (0..parent.len() as u32).map(|node| root(&mut parent, node)).collect();
    // nodes of no solid element must not share the mark of a body
    let mut used = vec![false; parent.len()];
    cells.iter().flat_map(|&cell| mesh.cells.nodes(cell as usize)).for_each(|&node| used[node as usize] = true);
    roots.into_iter().zip(used).map(|(root, used)| if used { root } else { NONE }).collect()
}

/// Hexahedra of 20 nodes with reduced integration, ascending.
fn reduced(mesh: &FileMesh, deck: &Deck) -> Vec<u32> {
    let of_20 = || deck.element_types.iter().filter(|of| of.name.starts_with("C3D20"));
    if of_20().all(crate::read::ElementType::is_reduced) {
        return (0..mesh.cells.len() as u32).collect();
    }
    let cells = |reduced: bool| -> BTreeSet<u32> {
        let sets = of_20().filter(|of| of.is_reduced() == reduced).filter_map(|of| of.set.as_ref());
        sets.filter_map(|set| find(&mesh.cell_sets, set)).flat_map(|set| &mesh.cell_sets[set]).copied().collect()
    };
    cells(true).difference(&cells(false)).copied().collect()
}

/// Cells of types against locking, ascending; all, if elements of such a type belong to no set.
fn softened(mesh: &FileMesh, deck: &Deck, count: usize) -> Vec<u32> {
    let mut cells = Vec::new();
    for of in deck.element_types.iter().filter(|of| of.is_soft()) {
        match of.set.as_ref().and_then(|set| find(&mesh.cell_sets, set)) {
            // sets of several types must not soften the others
            Some(set) if deck.element_types.iter().all(|other| other.set != of.set || other.is_soft()) => {
                cells.extend(&mesh.cell_sets[set]);
            }
            _ => return (0..count.max(mesh.cells.len()) as u32).collect(),
        }
    }
    cells.sort_unstable();
    cells
}

/// The section of each cell; the last one counts.
fn sections(mesh: &FileMesh, deck: &Deck, ledger: &mut Ledger) -> Vec<u32> {
    let mut of_cell = vec![NONE; mesh.cells.len()];
    for (index, section) in deck.sections.iter().enumerate() {
        match find(&mesh.cell_sets, &section.set) {
            Some(set) => mesh.cell_sets[set].iter().for_each(|&cell| of_cell[cell as usize] = index as u32),
            None => {
                let why = format!("there is no set of elements `{}`", section.set);
                ledger.wrong("SOLID SECTION", [section.line; 2], why, "name an *ELSET");
            }
        }
        if !deck.materials.contains_key(&section.material) {
            let why = format!("there is no material `{}`", section.material);
            ledger.wrong("SOLID SECTION", [section.line; 2], why, "name a *MATERIAL");
        }
    }
    of_cell
}

/// A set with exactly these solid cells: one with a section, otherwise any.
fn exact_set(mesh: &FileMesh, cells: &[u32], deck: &Deck) -> Option<String> {
    let of_sections = deck.sections.iter().filter_map(|section| find(&mesh.cell_sets, &section.set));
    let all = mesh.cell_sets.keys().map(String::as_str);
    let same = |set: &&str| mesh.cell_sets[*set].len() >= cells.len() && mesh.solid_cells(Some(set)) == cells;
    of_sections.chain(all).find(same).map(str::to_owned)
}

/// The name of the set with this name: with the same case, otherwise ignoring case.
pub fn find<'a, T>(sets: &'a BTreeMap<String, T>, name: &str) -> Option<&'a str> {
    let same = sets.get_key_value(name).map(|(known, _)| known.as_str());
    same.or_else(|| sets.keys().map(String::as_str).find(|other| other.eq_ignore_ascii_case(name)))
}

/// A valid name for a body.
pub fn proper(set: &str) -> String {
    let allowed = |c: char| if c.is_ascii_alphanumeric() || c == '_' || c == '-' { c } else { '_' };
    let name: String = set.chars().map(allowed).collect();
    if name.is_empty() { "body".into() } else { name }
}

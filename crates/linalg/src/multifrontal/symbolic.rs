//! Elimination tree, supernodes, and positions of matrix entries in the fronts.

use super::ordering::QuotientGraph;
use super::trapezoid;
use super::tree::{children_of, inverse, inverse_of, postorder};
use crate::csr::CsrPattern;
use std::sync::Arc;

/// No parent.
const NONE: usize = usize::MAX;

/// A set of consecutive pivots with a common structure: one front.
#[derive(Debug)]
pub(super) struct Supernode {
    /// First pivot, in the permuted numbering.
    pub first: usize,
    /// Number of pivots, before any delay.
    pub pivots: usize,
    /// Permuted unknowns beyond the pivots that the front couples to, ascending.
    pub rows: Vec<u32>,
    pub parent: Option<usize>,
    /// In elimination order.
    pub children: Vec<usize>,
    /// First supernode of the subtree, which is contiguous in postorder.
    pub first_descendant: usize,
    /// Whether no unknown of the subtree lies in the contact zone, so that its fronts are expected to
    /// be symmetric.
    pub symmetric: bool,
    /// Operations of the whole subtree, if the expectation holds.
    pub subtree_operations: f64,
}

/// Position of a matrix entry in its front.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Entry {
    /// Index in the matrix values.
    pub source: u32,
    /// Index of the entry of the transposed matrix in the same place, or [`MISSING`].
    pub mirror: u32,
    /// Local row and column.
    pub row: u32,
    pub column: u32,
}

/// No such entry.
pub(super) const MISSING: u32 = u32::MAX;

/// Floating-point operations for the factors of a front with `p` pivots and `r` rows beyond: LU, or
/// Cholesky if it is symmetric.
pub(super) fn front_operations(p: f64, r: f64, symmetric: bool) -> f64 {
    let lu = 2.0 / 3.0 * p * p * p + 2.0 * p * p * r + 2.0 * p * r * r;
    if symmetric { 0.5 * lu } else { lu }
}

/// The fronts and their order, which depend only on the pattern.
#[derive(Debug)]
pub(super) struct Structure {
    pub n: usize,
    /// Original unknown of each permuted one.
    pub permutation: Vec<u32>,
    /// In postorder.
    pub supernodes: Vec<Supernode>,
    pub roots: Vec<usize>,
    pub operations: f64,
}

/// Where the entries of a matrix go. Factors do not keep this, because it can be as large as they are.
#[derive(Debug)]
pub(super) struct Places {
    /// Start of each supernode's entries, then their total number.
    offsets: Vec<usize>,
    entries: Vec<Entry>,
}

impl Places {
    /// The entries of a supernode.
    pub fn of(&self, supernode: usize) -> &[Entry] {
        &self.entries[self.offsets[supernode]..self.offsets[supernode + 1]]
    }
}

/// An elimination order that may be suitable for other patterns of the same unknowns.
#[derive(Debug)]
pub(super) struct Ordering {
    groups: Vec<u32>,
    vertices: Vec<u32>,
    /// Vertices of the contact zone that are eliminated last; none if that costs more.
    last: Option<Vec<bool>>,
    /// Number of operations for the pattern for which it was computed.
    operations: f64,
}

impl Ordering {
    /// Whether `pattern` has the same unknowns, by their elimination groups.
    pub fn has_unknowns_of(&self, pattern: &CsrPattern) -> bool {
        self.groups == pattern.groups()
    }
}

/// Growth of the operations beyond which a known order is replaced.
const WORN: f64 = 1.15;

impl Structure {
    /// Analyses with a `known` order if it is for the same unknowns and costs little more than for
    /// its original pattern, otherwise with a new one; returns the order used.
    ///
    /// A matrix is unsymmetric only in the contact zone, and so are the fronts that eliminate the zone,
    /// with all fronts above. If the zone is small, it costs least to eliminate it last: the fronts of
    /// the bodies are then symmetric. A known order is adapted to a zone that has grown since.
    pub fn analyse(
        pattern: &CsrPattern,
        known: Option<&Arc<Ordering>>,
    ) -> Result<(Self, Places, Arc<Ordering>), String> {
        let (structure, ordering) = Self::without_entries(pattern, known, true)?;
        let places = place_entries(pattern, &structure.permutation, &structure.supernodes);
        Ok((structure, places, ordering))
    }

    /// The same without the positions of the matrix entries, which need most of the memory;
    /// `use_symmetry` says whether symmetric fronts cost half as much as others.
    pub fn without_entries(
        pattern: &CsrPattern,
        known: Option<&Arc<Ordering>>,
        use_symmetry: bool,
    ) -> Result<(Self, Arc<Ordering>), String> {
        if u32::try_from(pattern.entries()).is_err() {
            return Err("more than 2^32 matrix entries".to_owned());
        }
        let graph = QuotientGraph::new(pattern);
        let zone = if use_symmetry { graph.contact_zone() } else { vec![false; graph.len()] };
        let in_order = |vertices: &[u32]| Self::in_order(pattern, &graph, &zone, vertices.to_vec());
        if let Some(known) = known.filter(|known| known.has_unknowns_of(pattern)) {
            let structure = match &known.last {
                None => in_order(&known.vertices),
                Some(last) => {
                    let is_last = |v: &u32| last[*v as usize] || zone[*v as usize];
                    let (mut order, end): (Vec<u32>, Vec<u32>) = known.vertices.iter().partition(|v| !is_last(v));
                    order.extend(end);
                    in_order(&order)
                }
            };
            if structure.operations <= WORN * known.operations {
                return Ok((structure, known.clone()));
            }
        }
        let none = vec![false; zone.len()];
        let mut vertices = graph.fill_reducing_order(&none)?;
        let (mut structure, mut last) = (in_order(&vertices), None);
        if zone.contains(&true) {
            let other = graph.fill_reducing_order(&zone)?;
            let with_zone_last = in_order(&other);
            if with_zone_last.operations < structure.operations {
                (vertices, structure, last) = (other, with_zone_last, Some(zone));
            }
        }
        let operations = structure.operations;
        Ok((structure, Arc::new(Ordering { groups: pattern.groups().to_vec(), vertices, last, operations })))
    }

    /// Entries of L and U, and floating-point operations.
    pub fn size(&self) -> (f64, f64) {
        let of_front = |s: &Supernode| {
            let trapezoid = trapezoid::entries(s.pivots, s.rows.len());
            if s.symmetric { trapezoid } else { 2 * trapezoid }
        };
        (self.supernodes.iter().map(of_front).sum::<usize>() as f64, self.operations)
    }

    /// Without the positions of the matrix entries.
    fn in_order(pattern: &CsrPattern, graph: &QuotientGraph, zone: &[bool], vertices: Vec<u32>) -> Self {
        let (order, parents) = postordered_tree(graph, vertices);
        let mut groups = fundamental_supernodes(graph, &order, &parents);
        amalgamate(&mut groups);
        number(pattern, graph, zone, &order, groups)
    }
}

/// Elimination tree of the permuted graph (Liu's algorithm with path compression), relabelled in
/// postorder. Returns the new order and the parent of each position.
fn postordered_tree(graph: &QuotientGraph, order: Vec<u32>) -> (Vec<u32>, Vec<usize>) {
    let n = graph.len();
    let position = inverse(&order);
    let mut parents = vec![NONE; n];
    let mut ancestor = vec![NONE; n];
    for j in 0..n {
        for &w in graph.adjacent(order[j] as usize) {
            let mut i = position[w as usize] as usize;
            while i < j {
                let next = ancestor[i];
                ancestor[i] = j;
                if next == NONE {
                    parents[i] = j;
                    break;
                }
                i = next;
            }
        }
    }
    let post = postorder(&children_of(&parents));
    let new: Vec<usize> = inverse_of(&post);
    let order = post.iter().map(|&j| order[j]).collect();
    let mut relabelled = vec![NONE; n];
    for j in (0..n).filter(|&j| parents[j] != NONE) {
        relabelled[new[j]] = new[parents[j]];
    }
    (order, relabelled)
}

/// A supernode under construction, in graph positions.
struct Group {
    columns: Vec<u32>,
    /// Positions beyond the columns, in no particular order.
    rows: Vec<u32>,
    parent: usize,
    /// Supernode that this one was merged into.
    merged_into: Option<usize>,
    /// Unknowns of the columns, and of the rows.
    pivots: f64,
    border: f64,
    /// Zeros stored because of merging.
    zeros: f64,
}

/// Columns j, j+1 share a supernode if j+1 is the parent of its only child j and has the structure
/// of j without j+1.
fn fundamental_supernodes(graph: &QuotientGraph, order: &[u32], parents: &[usize]) -> Vec<Group> {
    let n = graph.len();
    let position = inverse(order);
    let children = children_of(parents);
    let weight = |p: u32| graph.members[order[p as usize] as usize].len() as f64;
    let mut structure: Vec<Vec<u32>> = vec![Vec::new(); n];
    let mut mark = vec![usize::MAX; n];
    let mut owner = vec![0; n];
    let mut groups: Vec<Group> = Vec::new();
    for j in 0..n {
        let mut rows = Vec::new();
        let mut take = |i: u32| {
            if i as usize > j && mark[i as usize] != j {
                mark[i as usize] = j;
                rows.push(i);
            }
        };
        let neighbours = graph.adjacent(order[j] as usize);
        neighbours.iter().for_each(|&w| take(position[w as usize]));
        for &child in &children[j] {
            std::mem::take(&mut structure[child]).into_iter().for_each(&mut take);
        }
        let extends = children[j].len() == 1 && children[j][0] + 1 == j && {
            let last: &Group = &groups[owner[j - 1]];
            last.rows.len() == rows.len() + 1
        };
        let border = rows.iter().map(|&i| weight(i)).sum();
        if extends {
            owner[j] = owner[j - 1];
            let group = &mut groups[owner[j]];
            group.columns.push(j as u32);
            group.pivots += weight(j as u32);
            group.border = border;
            group.rows.clone_from(&rows);
        } else {
            owner[j] = groups.len();
            groups.push(Group {
                columns: vec![j as u32],
                rows: rows.clone(),
                parent: NONE,
                merged_into: None,
                pivots: weight(j as u32),
                border,
                zeros: 0.0,
            });
        }
        structure[j] = rows;
    }
    for group in &mut groups {
        let last = group.columns[group.columns.len() - 1] as usize;
        group.parent = if parents[last] == NONE { NONE } else { owner[parents[last]] };
    }
    groups
}

/// Merges supernodes into their parents if this introduces few zeros: larger dense blocks are
/// faster. The limits are based on measurements on contact problems of 30 000 to 300 000 unknowns.
fn amalgamate(groups: &mut [Group]) {
    for s in 0..groups.len() {
        let p = groups[s].parent;
        if p == NONE {
            continue;
        }
        let (child, parent) = (&groups[s], &groups[p]);
        let extra = child.pivots * (parent.pivots + parent.border - child.border);
        let zeros = child.zeros + parent.zeros + extra;
        let pivots = child.pivots + parent.pivots;
        let stored = 0.5 * pivots * (pivots + 1.0) + pivots * parent.border;
        let share = zeros / stored;
        let merge =
            pivots <= 16.0 || (pivots <= 48.0 && share < 0.6) || (pivots <= 96.0 && share < 0.2) || share < 0.06;
        if merge {
            let columns = std::mem::take(&mut groups[s].columns);
            groups[s].merged_into = Some(p);
            let parent = &mut groups[p];
            parent.columns.extend(columns);
            parent.pivots = pivots;
            parent.zeros = zeros;
        }
    }
}

/// Final postorder of the merged supernodes: children in the order that needs the least memory
/// for pending contributions (Liu, ACM Trans. Math. Softw. 12, 1986).
fn memory_postorder(groups: &[Group]) -> (Vec<usize>, Vec<usize>) {
    let survivors: Vec<usize> = (0..groups.len()).filter(|&s| groups[s].merged_into.is_none()).collect();
    let mut compact = vec![NONE; groups.len()];
    for (k, &s) in survivors.iter().enumerate() {
        compact[s] = k;
    }
    let parents: Vec<usize> = survivors
        .iter()
        .map(|&s| {
            let mut p = groups[s].parent;
            while p != NONE
                && let Some(target) = groups[p].merged_into
            {
                p = target;
            }
            if p == NONE { NONE } else { compact[p] }
        })
        .collect();
    let mut children = children_of(&parents);
    let mut peak = vec![0.0f64; survivors.len()];
    let left = |k: usize| groups[survivors[k]].border.powi(2);
    for k in 0..survivors.len() {
        children[k].sort_by(|&a, &b| (peak[b] - left(b)).total_cmp(&(peak[a] - left(a))));
        let mut pending = 0.0;
        for &c in &children[k] {
            peak[k] = peak[k].max(pending + peak[c]);
            pending += left(c);
        }
        let front = (groups[survivors[k]].pivots + groups[survivors[k]].border).powi(2);
        peak[k] = peak[k].max(pending + front);
    }
    let post = postorder(&children);
    let new = inverse_of(&post);
    let parents = post.iter().map(|&k| if parents[k] == NONE { NONE } else { new[parents[k]] });
    let parents = parents.collect();
    (post.iter().map(|&k| survivors[k]).collect(), parents)
}

/// Numbers the unknowns along the postorder. Without a contact zone, nothing is known about
/// symmetry, and none is expected.
fn number(
    pattern: &CsrPattern,
    graph: &QuotientGraph,
    zone: &[bool],
    order: &[u32],
    mut groups: Vec<Group>,
) -> Structure {
    let anywhere = zone.contains(&true);
    let (post, parents) = memory_postorder(&groups);
    let mut starts = vec![0u32; graph.len()];
    let mut permutation: Vec<u32> = Vec::with_capacity(pattern.n());
    for &s in &post {
        groups[s].columns.sort_unstable();
        for &column in &groups[s].columns {
            starts[column as usize] = permutation.len() as u32;
            permutation.extend(&graph.members[order[column as usize] as usize]);
        }
    }
    let mut supernodes: Vec<Supernode> = Vec::with_capacity(post.len());
    let mut roots = Vec::new();
    for (k, &s) in post.iter().enumerate() {
        let first = starts[groups[s].columns[0] as usize] as usize;
        let mut rows: Vec<u32> = Vec::with_capacity(groups[s].border as usize);
        for &row in &groups[s].rows {
            let members = graph.members[order[row as usize] as usize].len() as u32;
            let start = starts[row as usize];
            rows.extend(start..start + members);
        }
        rows.sort_unstable();
        let outside = |&column: &u32| !zone[order[column as usize] as usize];
        supernodes.push(Supernode {
            first,
            pivots: groups[s].pivots as usize,
            rows,
            parent: (parents[k] != NONE).then_some(parents[k]),
            children: Vec::new(),
            first_descendant: k,
            symmetric: anywhere && groups[s].columns.iter().all(outside),
            subtree_operations: 0.0,
        });
    }
    for k in 0..supernodes.len() {
        let Supernode { pivots, symmetric, .. } = supernodes[k];
        let own = front_operations(pivots as f64, supernodes[k].rows.len() as f64, symmetric);
        supernodes[k].subtree_operations += own;
        match supernodes[k].parent {
            None => roots.push(k),
            Some(parent) => {
                let (operations, first) = (supernodes[k].subtree_operations, supernodes[k].first_descendant);
                let parent = &mut supernodes[parent];
                parent.children.push(k);
                parent.symmetric &= symmetric;
                parent.subtree_operations += operations;
                parent.first_descendant = parent.first_descendant.min(first);
            }
        }
    }
    let operations = roots.iter().map(|&r| supernodes[r].subtree_operations).sum();
    Structure { n: pattern.n(), permutation, supernodes, roots, operations }
}

/// An entry belongs to the front that eliminates its row or column, whichever comes first.
fn place_entries(pattern: &CsrPattern, permutation: &[u32], supernodes: &[Supernode]) -> Places {
    let position = inverse(permutation);
    let mut owner = vec![0u32; pattern.n()];
    for (s, supernode) in supernodes.iter().enumerate() {
        owner[supernode.first..supernode.first + supernode.pivots].fill(s as u32);
    }
    let place = |i: usize, k: usize| {
        let (row, column) = (position[i], position[pattern.columns()[k] as usize]);
        (owner[row.min(column) as usize] as usize, row, column)
    };
    let mut offsets = vec![0usize; supernodes.len() + 1];
    for i in 0..pattern.n() {
        for k in pattern.row_range(i) {
            offsets[place(i, k).0 + 1] += 1;
        }
    }
    for s in 0..supernodes.len() {
        offsets[s + 1] += offsets[s];
    }
    let mut next = offsets.clone();
    let mut entries = vec![Entry::default(); pattern.entries()];
    let mut mirrors = pattern.row_offsets().to_vec();
    for i in 0..pattern.n() {
        for k in pattern.row_range(i) {
            let (s, row, column) = place(i, k);
            // the rows ascend, so the place of the mirror in row j only moves forward
            let j = pattern.columns()[k] as usize;
            let (at, end) = (&mut mirrors[j], pattern.row_offsets()[j + 1]);
            while *at < end && (pattern.columns()[*at] as usize) < i {
                *at += 1;
            }
            let found = *at < end && pattern.columns()[*at] as usize == i;
            let mirror = if found { *at as u32 } else { MISSING };
            let (row, column) = (local(&supernodes[s], row), local(&supernodes[s], column));
            entries[next[s]] = Entry { source: k as u32, mirror, row, column };
            next[s] += 1;
        }
    }
    Places { offsets, entries }
}

/// Index of a permuted unknown in a front: pivots first, then the rows beyond.
pub(super) fn local(supernode: &Supernode, unknown: u32) -> u32 {
    let past = supernode.first + supernode.pivots;
    if (unknown as usize) < past {
        unknown - supernode.first as u32
    } else {
        // The symbolic elimination put every neighbour of a pivot into the rows.
        let at = supernode.rows.partition_point(|&row| row < unknown);
        debug_assert_eq!(supernode.rows[at], unknown);
        (supernode.pivots + at) as u32
    }
}

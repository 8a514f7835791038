//! Pieces of a design that hang together with nothing.

use std::fmt;

use serde::Serialize;
use slipstick_design::ElementValues;

use crate::crushed::VOID;
use crate::problem::Problem;

/// Material that neither a support nor contact holds, nor anything that it hangs together with.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LoosePieces {
    /// Number of pieces.
    pub pieces: usize,
    /// Elements of the largest.
    pub elements: usize,
    /// Name of its body.
    pub body: String,
    /// Centroid of one of its elements. \[L\]
    pub at: [f64; 3],
}

impl fmt::Display for LoosePieces {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { pieces, elements, body, at: [x, y, z] } = self;
        let subject = match pieces {
            1 => "one piece".to_owned(),
            _ => format!("{pieces} pieces"),
        };
        write!(
            f,
            "neither a support nor contact holds {subject} of the design; the largest, of {elements} \
             element{} of body `{body}`, is at ({x:.4}, {y:.4}, {z:.4})",
            if *elements == 1 { "" } else { "s" }
        )
    }
}

/// What helps.
pub const CURE: &str = "only void holds them: a part made of this design would fall apart. A lower `simp.min`, a higher \
                        `simp.p` or a sharper projection make such designs cost more; a load on a loose piece needs material \
                        that joins it, such as `passive_solid`";

/// Elements from this density on are material.
const SOLID: f64 = 0.5;

impl Problem {
    /// Pieces of designed bodies that touch neither a support (a symmetry plane is none) nor a surface that is
    /// in contact without being tied. A piece consists of elements that are not void and share nodes or are joined, by a tie, a
    /// bolt or a linear equation, and includes at least one of material: a tie to a body that nothing holds
    /// holds nothing. `None` if there is none.
    pub fn loose_pieces(&self, density: &ElementValues) -> Option<LoosePieces> {
        let (mesh, model) = (&self.mesh, self.analysis.model());
        let mut held = vec![false; mesh.nodes.len()];
        // a symmetry plane holds only one direction
        let supported = model.prescribed().owned().into_iter().flat_map(|(_, unknowns)| unknowns);
        supported.for_each(|unknown| held[unknown as usize / 3] = true);
        let facets = model.interfaces().iter().filter(|of| of.bond.is_none()).map(|of| &of.interface);
        let facets = facets.flat_map(|interface| interface.slave_facets().iter().chain(interface.master_facets()));
        facets.flat_map(|facet| facet.iter()).for_each(|&node| held[node as usize] = true);
        let mut groups = Groups::new(mesh.nodes.len());
        let filled = |element: usize| density[element] >= VOID;
        let mut material = vec![false; mesh.nodes.len()];
        for (_, element) in mesh.elements.iter().enumerate().filter(|(e, _)| filled(*e)) {
            let nodes = element.nodes();
            for &node in nodes {
                groups.join(nodes[0], node);
                material[node as usize] = true;
            }
        }
        let mut join = |a: u32, b: u32| {
            if material[a as usize] && material[b as usize] {
                groups.join(a, b);
            }
        };
        for row in model.interfaces().iter().filter_map(|of| of.bond.as_ref()).flat_map(|rows| rows.iter()) {
            row.support[row.ring..].iter().for_each(|&master| join(row.node, master));
        }
        for (dependent, terms) in model.prescribed().linear().rows() {
            terms.iter().for_each(|(unknown, _)| join(dependent / 3, unknown / 3));
        }
        // of each group: whether it is held, has material and is designed
        let count = mesh.nodes.len();
        let (mut anchored, mut solid, mut designed) = (vec![false; count], vec![false; count], vec![false; count]);
        for (node, held) in held.iter().enumerate().filter(|(_, held)| **held) {
            anchored[groups.root(node as u32) as usize] |= *held;
        }
        let mut sizes = vec![0_usize; count];
        for (e, element) in mesh.elements.iter().enumerate().filter(|(e, _)| filled(*e)) {
            let root = groups.root(element.nodes()[0]) as usize;
            sizes[root] += 1;
            solid[root] |= density[e] >= SOLID;
            designed[root] |= model.is_designed(e as u32);
        }
        let loose = |root: &usize| sizes[*root] > 0 && solid[*root] && designed[*root] && !anchored[*root];
        let loose: Vec<usize> = (0..count).filter(loose).collect();
        // the first of the largest
        let largest = loose.iter().copied().reduce(|a, b| if sizes[b] > sizes[a] { b } else { a })?;
        let element = mesh.elements.iter().position(|element| groups.root(element.nodes()[0]) as usize == largest)?;
        let body = mesh.bodies.iter().find(|body| body.elements.contains(&element))?;
        Some(LoosePieces {
            pieces: loose.len(),
            elements: sizes[largest],
            body: body.name.clone(),
            at: mesh.centroids()[element],
        })
    }
}

/// Disjoint groups of nodes; the root of a group is its smallest node.
struct Groups(Vec<u32>);

impl Groups {
    fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    fn root(&mut self, mut node: u32) -> u32 {
        while self.0[node as usize] != node {
            self.0[node as usize] = self.0[self.0[node as usize] as usize];
            node = self.0[node as usize];
        }
        node
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

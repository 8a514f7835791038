//! Bodies obtained by bending one block of elements.

use std::collections::BTreeMap;

use crate::error::count32;
use crate::{Body, Element, Facet, Mesh, MeshError, Surface};

/// A block of elements along three right-handed directions a, b, c.
pub(super) struct Lattice<'a> {
    /// Name of the body.
    pub name: &'a str,
    /// Elements along a, b, c.
    pub elements: [usize; 3],
    /// Whether b closes on itself; the block then has no sides b− and b+.
    pub closed: bool,
    /// Names of the sides a−, a+, b−, b+, c−, c+; sides with the same name form one surface.
    pub sides: [&'a str; 6],
}

/// The side in [`HEX_FACES`](crate::HEX_FACES) that faces a−, a+, b−, b+, c−, c+.
const SIDE_FACES: [usize; 6] = [5, 3, 2, 4, 0, 1];

impl Lattice<'_> {
    /// Nodes along a, b, c, if all numbers fit 32 bits.
    pub fn points(&self) -> Result<[usize; 3], MeshError> {
        let product = |counts: [usize; 3]| counts[0].checked_mul(counts[1])?.checked_mul(counts[2]);
        count32("elements", product(self.elements))?;
        let [a, b, c] = self.elements;
        let points = [a.saturating_add(1), if self.closed { b } else { b.saturating_add(1) }, c.saturating_add(1)];
        count32("nodes", product(points))?;
        Ok(points)
    }

    /// The mesh with the node of index (i, j, k) at `position`, whose Jacobian must be positive.
    pub fn mesh(&self, position: impl Fn([usize; 3]) -> [f64; 3]) -> Result<Mesh, MeshError> {
        let [a, b, c] = self.elements;
        let [along_a, along_b, along_c] = self.points()?;
        let mut nodes = Vec::with_capacity(along_a * along_b * along_c);
        for index in 0..along_a * along_b * along_c {
            nodes.push(position([index % along_a, index / along_a % along_b, index / (along_a * along_b)]));
        }
        let number = |i: usize, j: usize, k: usize| (i + along_a * (j % along_b + along_b * k)) as u32;
        let mut elements = Vec::with_capacity(a * b * c);
        let mut surfaces: BTreeMap<String, Surface> = BTreeMap::new();
        for element in 0..a * b * c {
            let place = [element % a, element / a % b, element / (a * b)];
            let [i, j, k] = place;
            let corners = |k| [number(i, j, k), number(i + 1, j, k), number(i + 1, j + 1, k), number(i, j + 1, k)];
            let (low, high) = (corners(k), corners(k + 1));
            let hex = Element::Hex8([low[0], low[1], low[2], low[3], high[0], high[1], high[2], high[3]]);
            for side in 0..6 {
                let direction = side / 2;
                let last = if side % 2 == 0 { 0 } else { self.elements[direction] - 1 };
                if place[direction] == last && !(self.closed && direction == 1) {
                    let facet = Facet { nodes: hex.side(SIDE_FACES[side]), element: element as u32 };
                    surfaces.entry(format!("{}_{}", self.name, self.sides[side])).or_default().facets.push(facet);
                }
            }
            elements.push(hex);
        }
        let body = Body { name: self.name.to_owned(), elements: 0..elements.len(), nodes: 0..nodes.len() };
        Ok(Mesh { nodes, elements, bodies: vec![body], surfaces, ..Mesh::default() })
    }
}

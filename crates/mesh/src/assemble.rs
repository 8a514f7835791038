//! Places bodies and merges meshes.

use std::collections::BTreeMap;
use std::ops::Range;

use crate::error::count32;
use crate::vector::{cross, dot, norm};
use crate::{Mesh, MeshError};

/// A rotation about an axis through the origin, counter-clockwise seen from the tip of the axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rotation {
    /// Direction of the axis; any length but zero.
    pub axis: [f64; 3],
    /// Angle in degrees.
    pub degrees: f64,
}

/// A rigid motion: the rotation about the origin first, then the translation.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Placement {
    /// The rotation, if any.
    pub rotate: Option<Rotation>,
    /// The translation. \[L\]
    pub translate: [f64; 3],
}

impl Rotation {
    /// The rotation matrix, rows first: x ↦ R x (Rodrigues' formula).
    ///
    /// Exact for multiples of 90° about a coordinate axis, so that planes stay planes to the last
    /// bit.
    ///
    /// # Errors
    /// [`MeshError::Parameter`] if the axis has no direction or a number is not finite.
    pub fn matrix(&self) -> Result<[[f64; 3]; 3], MeshError> {
        // Scaled by the largest component first: otherwise squares of tiny or huge components would
        // under- or overflow.
        let largest = self.axis.iter().fold(0.0_f64, |most, c| most.max(c.abs()));
        let scaled = self.axis.map(|c| c / largest);
        if !(largest > 0.0 && scaled.iter().all(|c| c.is_finite())) {
            let value = format!("{:?}", self.axis);
            return Err(MeshError::parameter("rotate.axis", value, "give a finite, nonzero direction"));
        }
        if !self.degrees.is_finite() {
            return Err(MeshError::parameter("rotate.degrees", self.degrees, "give a finite angle in degrees"));
        }
        let length = norm(scaled);
        let axis = scaled.map(|c| c / length);
        let (sine, cosine) = sine_cosine_of_degrees(self.degrees);
        let mut columns = [[0.0; 3]; 3];
        for c in 0..3 {
            let unit: [f64; 3] = std::array::from_fn(|d| if d == c { 1.0 } else { 0.0 });
            let turned = cross(axis, unit);
            let along = dot(axis, unit) * (1.0 - cosine);
            columns[c] = std::array::from_fn(|d| cosine * unit[d] + sine * turned[d] + along * axis[d]);
        }
        Ok(std::array::from_fn(|row| std::array::from_fn(|column| columns[column][row])))
    }
}

/// (sin, cos) of an angle in degrees, exact at multiples of 90°.
fn sine_cosine_of_degrees(degrees: f64) -> (f64, f64) {
    let turn = degrees.rem_euclid(360.0);
    let quarter = (turn / 90.0).round();
    let (sine, cosine) = (turn - 90.0 * quarter).to_radians().sin_cos();
    match quarter as u8 % 4 {
        0 => (sine, cosine),
        1 => (cosine, -sine),
        2 => (-sine, -cosine),
        _ => (-cosine, sine),
    }
}

impl Mesh {
    /// Moves all nodes: the rotation about the origin first, then the translation.
    ///
    /// # Errors
    /// [`MeshError::Parameter`] if the axis has no direction or a number is not finite; the mesh is
    /// then unchanged.
    pub fn transform(&mut self, placement: &Placement) -> Result<(), MeshError> {
        let shift = placement.translate;
        if !shift.iter().all(|c| c.is_finite()) {
            return Err(MeshError::parameter("translate", format!("{shift:?}"), "give three finite lengths"));
        }
        if let Some(rotation) = &placement.rotate {
            let matrix = rotation.matrix()?;
            for x in &mut self.nodes {
                *x = matrix.map(|row| dot(row, *x));
            }
        }
        for x in &mut self.nodes {
            *x = std::array::from_fn(|c| x[c] + shift[c]);
        }
        Ok(())
    }

    /// Merges meshes into one, in the given order; nodes and elements are renumbered, and no nodes
    /// are joined.
    ///
    /// # Errors
    /// [`MeshError::DuplicateName`] if two meshes have bodies, or node sets or surfaces, with the
    /// same name (sets and surfaces share one namespace across meshes, because [`Mesh::set_nodes`]
    /// finds both); [`MeshError::TooLarge`] if the numbers do not fit 32 bits.
    pub fn merge(meshes: Vec<Mesh>) -> Result<Mesh, MeshError> {
        let mut whole = Mesh::default();
        for mesh in meshes {
            whole.append(mesh)?;
        }
        Ok(whole)
    }

    fn append(&mut self, other: Mesh) -> Result<(), MeshError> {
        self.refuse_duplicates(&other)?;
        let (node_count, element_count) = (self.nodes.len(), self.elements.len());
        count32("nodes", node_count.checked_add(other.nodes.len()))?;
        count32("elements", element_count.checked_add(other.elements.len()))?;
        // Cannot overflow: the sums with `other` were just checked.
        let (first_node, first_element) = (node_count as u32, element_count as u32);
        let shift = |range: Range<usize>, by: usize| range.start + by..range.end + by;

        // Saturating: a number far out of range must not wrap around into the valid range.
        self.nodes.extend(other.nodes);
        self.elements.extend(other.elements.iter().map(|element| element.map(|n| n.saturating_add(first_node))));
        for mut body in other.bodies {
            body.nodes = shift(body.nodes, node_count);
            body.elements = shift(body.elements, element_count);
            self.bodies.push(body);
        }
        for (name, mut nodes) in other.node_sets {
            nodes.iter_mut().for_each(|n| *n = n.saturating_add(first_node));
            self.node_sets.insert(name, nodes);
        }
        for (name, mut surface) in other.surfaces {
            for facet in &mut surface.facets {
                facet.nodes = facet.nodes.map(|n| n.saturating_add(first_node));
                facet.element = facet.element.saturating_add(first_element);
            }
            self.surfaces.insert(name, surface);
        }
        for (name, mut elements) in other.element_sets {
            elements.iter_mut().for_each(|e| *e = e.saturating_add(first_element));
            self.element_sets.insert(name, elements);
        }
        Ok(())
    }

    fn refuse_duplicates(&self, other: &Mesh) -> Result<(), MeshError> {
        fn common<A, B>(kind: &'static str, a: &BTreeMap<String, A>, b: &BTreeMap<String, B>) -> Result<(), MeshError> {
            match b.keys().find(|name| a.contains_key(*name)) {
                Some(name) => Err(MeshError::DuplicateName { kind, name: name.clone() }),
                None => Ok(()),
            }
        }
        if let Some(body) = other.bodies.iter().find(|body| self.body(&body.name).is_some()) {
            return Err(MeshError::DuplicateName { kind: "body", name: body.name.clone() });
        }
        common("node set", &self.node_sets, &other.node_sets)?;
        common("surface", &self.surfaces, &other.surfaces)?;
        common("set of elements", &self.element_sets, &other.element_sets)?;
        common("set or surface", &self.node_sets, &other.surfaces)?;
        common("set or surface", &self.surfaces, &other.node_sets)
    }
}

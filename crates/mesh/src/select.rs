//! Selection of bodies, sets and nodes by name or position.

use std::borrow::Cow;

use crate::vector::{dot, norm, subtract};
use crate::{Body, Mesh, MeshError};

impl Mesh {
    /// The nodes of a node set or, if there is none with this name, of a surface; ascending and
    /// unique. `None` if there is neither.
    pub fn set_nodes(&self, name: &str) -> Option<Cow<'_, [u32]>> {
        match self.node_sets.get(name) {
            Some(nodes) => Some(Cow::Borrowed(nodes)),
            None => self.surfaces.get(name).map(|surface| Cow::Owned(surface.nodes())),
        }
    }

    /// The names that [`Mesh::set_nodes`] knows, ascending and unique: for suggestions.
    pub fn names(&self) -> Vec<&str> {
        let mut names: Vec<&str> = self.node_sets.keys().chain(self.surfaces.keys()).map(String::as_str).collect();
        names.sort_unstable();
        names.dedup();
        names
    }

    /// The body with the given name.
    pub fn body(&self, name: &str) -> Option<&Body> {
        self.bodies.iter().find(|body| body.name == name)
    }

    /// Index in [`Mesh::bodies`] of the body that the element belongs to.
    pub fn body_of_element(&self, element: usize) -> Option<usize> {
        self.bodies.iter().position(|body| body.elements.contains(&element))
    }

    /// Nodes (of `within`, if given) with min ≤ X ≤ max in each direction, ascending.
    ///
    /// Bounds are included, but there is no tolerance: leave a margin for rounded coordinates.
    pub fn nodes_in_box(&self, min: [f64; 3], max: [f64; 3], within: Option<&[u32]>) -> Vec<u32> {
        self.nodes_where(within, |x| (0..3).all(|c| min[c] <= x[c] && x[c] <= max[c]))
    }

    /// Nodes (of `within`, if given) at most `tolerance` \[L\] from a plane, ascending.
    ///
    /// # Errors
    /// [`MeshError::Parameter`] if the normal has no direction or the tolerance is negative or not
    /// finite.
    pub fn nodes_on_plane(
        &self,
        point: [f64; 3],
        normal: [f64; 3],
        tolerance: f64,
        within: Option<&[u32]>,
    ) -> Result<Vec<u32>, MeshError> {
        let length = norm(normal);
        if !(length > 0.0 && length.is_finite()) {
            return Err(MeshError::parameter("normal", format!("{normal:?}"), "give a nonzero direction"));
        }
        not_negative("tolerance", tolerance)?;
        Ok(self.nodes_where(within, |x| dot(subtract(x, point), normal).abs() <= tolerance * length))
    }

    /// Nodes (of `within`, if given) in the solid cylinder of the given radius \[L\] between two
    /// points of its axis, ends and mantle included, ascending.
    ///
    /// # Errors
    /// [`MeshError::Parameter`] if the two points coincide or the radius is negative or not finite.
    pub fn nodes_in_cylinder(
        &self,
        start: [f64; 3],
        end: [f64; 3],
        radius: f64,
        within: Option<&[u32]>,
    ) -> Result<Vec<u32>, MeshError> {
        let axis = subtract(end, start);
        let length = norm(axis);
        if !(length > 0.0 && length.is_finite()) {
            return Err(MeshError::parameter("end", format!("{end:?}"), "give a point different from `start`"));
        }
        not_negative("radius", radius)?;
        let axis = axis.map(|c| c / length);
        Ok(self.nodes_where(within, |x| {
            let arm = subtract(x, start);
            let along = dot(arm, axis);
            let across: [f64; 3] = std::array::from_fn(|c| arm[c] - along * axis[c]);
            0.0 <= along && along <= length && norm(across) <= radius
        }))
    }

    /// The node (of `within`, if given) nearest to a point; if there are several, the one with the
    /// lowest number. `None` if there is none.
    pub fn nearest_node(&self, point: [f64; 3], within: Option<&[u32]>) -> Option<u32> {
        let mut nearest: Option<(f64, u32)> = None;
        self.visit(within, |node, x| {
            let distance = norm(subtract(x, point));
            if nearest.is_none_or(|best| (distance, node) < best) && !distance.is_nan() {
                nearest = Some((distance, node));
            }
        });
        nearest.map(|(_, node)| node)
    }

    fn nodes_where(&self, within: Option<&[u32]>, keep: impl Fn([f64; 3]) -> bool) -> Vec<u32> {
        let mut kept = Vec::new();
        self.visit(within, |node, x| {
            if keep(x) {
                kept.push(node);
            }
        });
        // `within` may be in any order.
        kept.sort_unstable();
        kept.dedup();
        kept
    }

    /// Calls `see` for each node (of `within`, if given); numbers that the mesh does not have are
    /// skipped.
    fn visit(&self, within: Option<&[u32]>, mut see: impl FnMut(u32, [f64; 3])) {
        match within {
            Some(nodes) => {
                for &node in nodes {
                    if let Some(&x) = self.nodes.get(node as usize) {
                        see(node, x);
                    }
                }
            }
            None => (0..).zip(&self.nodes).for_each(|(node, &x)| see(node, x)),
        }
    }
}

fn not_negative(parameter: &str, value: f64) -> Result<(), MeshError> {
    if value.is_finite() && value >= 0.0 {
        Ok(())
    } else {
        Err(MeshError::parameter(parameter, value, "give a finite length that is not negative"))
    }
}

//! Symmetry planes.

use super::Writer;

impl Writer<'_> {
    /// Nodes on the planes, and rigid bodies there, whose nodes CalculiX does not let anything else hold.
    pub(super) fn symmetries(&mut self) {
        let mesh = self.mesh;
        let size = mesh
            .bounding_box()
            .map_or(1.0, |(low, high)| (0..3).map(|c| (high[c] - low[c]).powi(2)).sum::<f64>().sqrt());
        let rests = vec![0.0; self.case.load_path.steps + 1];
        for (s, symmetry) in self.case.symmetries.iter().enumerate() {
            let axis = symmetry.normal.index();
            let on = |node: &usize| (mesh.nodes[*node][axis] - symmetry.at).abs() <= 1e-6 * size;
            let mut nodes: Vec<u32> = Vec::new();
            for (b, body) in mesh.bodies.iter().enumerate() {
                let Some(rigid) = mesh.rigid.iter().find(|rigid| rigid.body == b) else {
                    nodes.extend(body.nodes.clone().filter(on).map(|node| node as u32));
                    continue;
                };
                if !body.nodes.clone().any(|node| on(&node)) {
                    continue;
                }
                // it moves in the plane and turns about its normal
                let (reference, rotation) = (rigid.reference, rigid.rotation());
                self.prescribe(&[reference], (reference + 1).to_string(), axis, axis + 1, rests.clone());
                for c in (0..3).filter(|&c| c != axis) {
                    self.prescribe(&[rotation], (rotation + 1).to_string(), c, c + 1, rests.clone());
                }
            }
            if !nodes.is_empty() {
                let set = self.new_set(&format!("symmetry_{}", ["x", "y", "z"][axis]), nodes.clone());
                self.prescribe(&nodes, set, axis, axis + 1, rests.clone());
            }
            if !self.case.contacts.is_empty() {
                let message = "a deck holds the plane, but its contact does not know the mirror image";
                self.warn(
                    format!("symmetry[{s}]"),
                    message,
                    "compare with the whole bodies if contact crosses the plane",
                );
            }
        }
    }
}

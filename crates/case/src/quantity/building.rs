//! What quantities are built from: the mesh, the model, and what a case says about surfaces and bodies.

use crate::construct::BuildError;
use crate::file::BoxRegion;
use slipstick_design::quantity::{Patch, QuantityError, VectorMeasure, Volume};
use slipstick_mesh::Mesh;
use slipstick_model::model::ContactModel;
use std::collections::BTreeSet;

/// A quantity that is being built.
pub(crate) struct Building<'a> {
    pub mesh: &'a Mesh,
    pub model: &'a ContactModel,
    /// Slave and master of each contact pair.
    pub pairs: Vec<[&'a str; 2]>,
    /// The surfaces on which loads act; the empty name is for loads on mass.
    pub loaded: Vec<&'a str>,
    /// The bodies that are designed; `None`: all.
    pub designed: Option<Vec<&'a str>>,
    /// Its table in the case file, such as `quantity[0].gap`.
    pub path: String,
}

impl Building<'_> {
    /// A value of the table is wrong.
    pub fn error(&self, error: QuantityError) -> BuildError {
        BuildError::new(self.path.clone(), error, "change the value")
    }

    /// The quantity would not vary.
    pub fn constant(&self, message: String, help: &str) -> BuildError {
        BuildError::new(self.path.clone(), message, help)
    }

    /// The volume of a body, or of all.
    ///
    /// # Errors
    /// If the body is not designed.
    pub fn volume(&self, name: &str, body: Option<&str>) -> Result<Volume, BuildError> {
        let undesigned = |body: &&str| self.designed.as_ref().is_some_and(|designed| !designed.contains(body));
        if let Some(body) = body.filter(undesigned) {
            let message = format!("`{body}` is not designed, so its volume does not change");
            return Err(self.constant(message, "name a body of [design], or omit `body`"));
        }
        let elements = self.elements(body);
        let volumes = self.mesh.element_volumes().into_iter().enumerate();
        let of = |(e, volume): (usize, f64)| if elements.contains(&e) { volume } else { 0.0 };
        Ok(Volume::new(name, volumes.map(of).collect()))
    }

    /// The mass of a body, or of all, with the mass densities of the bodies.
    ///
    /// # Errors
    /// If the body is not designed, or has no mass.
    pub fn mass(&self, name: &str, body: Option<&str>) -> Result<Volume, BuildError> {
        self.volume(name, body)?;
        let (elements, solid) = (self.elements(body), self.model.solid());
        let volumes = self.mesh.element_volumes().into_iter().enumerate();
        let of = |(e, volume): (usize, f64)| if elements.contains(&e) { solid.mass_density(e) * volume } else { 0.0 };
        let masses: Vec<f64> = volumes.map(of).collect();
        if masses.iter().all(|&mass| mass == 0.0) {
            let message = format!("{} no `mass_density`", body.map_or("no body has".into(), |b| format!("`{b}` has")));
            return Err(self.constant(
                message.replace("no body has no", "no body has a"),
                "add the key to the [[body]], or to this table",
            ));
        }
        Ok(Volume::new(name, masses).mass(1.0))
    }

    /// The slave nodes of a pair, or those of them in a set.
    pub fn patch(&self, slave: &str, within: Option<&str>) -> Result<Patch, BuildError> {
        let pair = self.pairs.iter().position(|[known, _]| *known == slave).unwrap_or(0) as u32;
        let Some(within) = within else { return Ok(Patch::whole(pair)) };
        let slaves = self.mesh.set_nodes(slave).unwrap_or_default();
        let region: BTreeSet<u32> = self.mesh.set_nodes(within).unwrap_or_default().iter().copied().collect();
        let nodes: Vec<u32> = slaves.iter().copied().filter(|node| region.contains(node)).collect();
        Patch::within(pair, nodes).map_err(|_| {
            let message = format!("no node of `{slave}` lies in `{within}`");
            BuildError::new(format!("{}.within", self.path), message, "name a set on the slave surface")
        })
    }

    /// The smallest Young's modulus at the surfaces of a pair, rigid bodies left out; infinite if all are
    /// rigid. \[F/L²\]
    pub fn softer_modulus(&self, slave: &str) -> f64 {
        let pairs = self.pairs.iter().filter(|[known, _]| *known == slave);
        let solid = self.model.solid();
        let rigid = |e: usize| self.mesh.rigid.iter().any(|of| self.mesh.bodies[of.body].elements.contains(&e));
        let surfaces = pairs.flatten().filter_map(|name| self.mesh.surfaces.get(*name));
        let elements = surfaces.flat_map(|surface| &surface.facets).map(|facet| facet.element as usize);
        let moduli = elements.filter(|&e| !rigid(e)).map(|e| solid.material(e).youngs_modulus());
        moduli.fold(f64::INFINITY, f64::min)
    }

    /// The prescribed unknowns of a set: those that belong to its `[[dirichlet]]`, or else all of
    /// its nodes.
    pub fn prescribed(&self, set: &str) -> Vec<u32> {
        let prescribed = self.model.prescribed();
        if let Some((_, unknowns)) = prescribed.owned().into_iter().find(|(name, _)| *name == set) {
            return unknowns;
        }
        let nodes = self.mesh.set_nodes(set).unwrap_or_default();
        let unknowns = nodes.iter().flat_map(|node| (0..3).map(move |c| 3 * node + c));
        let supported = prescribed.ever_supported();
        unknowns.filter(|&unknown| supported[unknown as usize]).collect()
    }

    /// Whether the slave surface of a pair is its own master.
    pub fn is_with_itself(&self, slave: &str) -> bool {
        self.pairs.contains(&[slave; 2])
    }

    /// The nodes of all surfaces on which loads act; with loads on mass, all nodes.
    pub fn loaded(&self) -> BTreeSet<u32> {
        if self.loaded.contains(&"") {
            return (0..self.mesh.nodes.len() as u32).collect();
        }
        let surfaces = self.loaded.iter().filter_map(|surface| self.mesh.set_nodes(surface));
        surfaces.flat_map(|nodes| nodes.to_vec()).collect()
    }

    /// Whether nothing but motions and supports moves a set along a direction, or in any direction for a
    /// norm.
    pub fn is_driven(&self, set: &str, measure: VectorMeasure) -> bool {
        all_fixed(&self.mesh.set_nodes(set).unwrap_or_default(), measure, self.model.contact_fixed())
    }

    /// Whether no displacement of a set along a direction is solved for; that of rigid bodies never is.
    pub fn is_prescribed(&self, set: &str, measure: VectorMeasure) -> bool {
        all_fixed(&self.mesh.set_nodes(set).unwrap_or_default(), measure, self.model.prescribed().fixed())
    }

    /// The nodes of a surface with the reference areas around them, or those of a set with equal
    /// weights.
    pub fn weighted(&self, set: &str) -> Vec<(u32, f64)> {
        if let Some(surface) = self.mesh.surfaces.get(set) {
            let areas = surface.node_areas(&self.mesh.nodes);
            return areas.into_iter().filter(|(_, area)| *area > 0.0).collect();
        }
        self.mesh.set_nodes(set).unwrap_or_default().iter().map(|&node| (node, 1.0)).collect()
    }

    /// Elements of a body, or of all, whose centroid lies in one of the boxes, if there are any.
    pub fn elements_within(&self, body: Option<&str>, within: &[BoxRegion]) -> Result<Vec<u32>, BuildError> {
        let centroids = self.mesh.centroids();
        let inside = |e: &usize| within.is_empty() || within.iter().any(|region| region.contains(centroids[*e]));
        let elements: Vec<u32> = self.elements(body).filter(inside).map(|e| e as u32).collect();
        if elements.is_empty() {
            let path = format!("{}.within", self.path);
            let message = "no element has its centroid in these boxes";
            return Err(BuildError::new(path, message, "`slipstick check` shows the extent of the bodies"));
        }
        Ok(elements)
    }

    /// Elements of a body, or of all.
    pub fn elements(&self, body: Option<&str>) -> std::ops::Range<usize> {
        let found = body.and_then(|name| self.mesh.bodies.iter().find(|body| body.name == name));
        found.map_or(0..self.mesh.elements.len(), |body| body.elements.clone())
    }
}

/// Whether all components of nodes that count in a measure are `fixed`.
pub(crate) fn all_fixed(nodes: &[u32], measure: VectorMeasure, fixed: &[bool]) -> bool {
    let fixed = |node: u32| (0..3).filter(|&c| counts(measure, c)).all(|c| fixed[3 * node as usize + c]);
    !nodes.is_empty() && nodes.iter().all(|&node| fixed(node))
}

/// Whether a component of a vector counts in a measure of it.
pub(crate) fn counts(measure: VectorMeasure, component: usize) -> bool {
    match measure {
        VectorMeasure::Along(direction) => direction[component] != 0.0,
        VectorMeasure::Norm => true,
    }
}

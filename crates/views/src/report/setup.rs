//! The model of a case that has not run.

use serde::Serialize;
use slipstick_case::file::Case;
use slipstick_mesh::{Facet, Mesh};
use slipstick_model::words::counted;

use super::frames::Frames;
use super::model::{Layout, four};
use super::pack::integers;
use super::{Data, Page, PageOptions, html, units};

/// A surface or a node set that the view can mark.
#[derive(Debug, Serialize)]
pub(super) struct Mark {
    name: String,
    /// Corners of the faces, 4 each, as points of the page.
    #[serde(skip_serializing_if = "Option::is_none")]
    quads: Option<String>,
    /// Points of a set that is not a surface: the faces between them are marked.
    #[serde(skip_serializing_if = "Option::is_none")]
    points: Option<String>,
}

/// The mesh of a case as a view in a colour for each body. Pages that contain it mark surfaces and sets
/// with a message `{ mark: [[name, colour], …] }`; `names` are those that they may mark.
pub fn model_page(case: &Case, mesh: &Mesh, names: &[String], options: &PageOptions) -> Page {
    let layout = Layout::new(case, mesh, options.whole_elements);
    let mut notes = Vec::new();
    let marks = marks(mesh, &layout, names);
    let model = (layout.bytes() <= options.model_bytes).then(|| layout.model(mesh, None));
    if model.is_none() {
        let elements = counted(mesh.elements.len(), "element");
        notes.push(format!("The mesh has {elements}, which is too large for this page."));
    }
    let data = Data {
        title: case.title.clone(),
        notes: notes.clone(),
        frames: Frames::of_model(),
        model,
        units: units(case),
        view_only: true,
        setup: true,
        marks,
        ..Data::default()
    };
    Page { html: html(&data, None), frames: [0, 0], notes }
}

/// The mesh's nodes that are points of this page, in its order.
pub fn model_nodes(case: &Case, mesh: &Mesh, options: &PageOptions) -> Vec<u32> {
    Layout::new(case, mesh, options.whole_elements).nodes
}

/// Corners of the face of which a facet of a second-order element is a part: the view draws elements without their
/// mid-side nodes, but skins as facets.
fn whole_face(mesh: &Mesh, facet: &Facet) -> Option<[u32; 4]> {
    let element = &mesh.elements[facet.element as usize];
    if !element.is_second_order() {
        return None;
    }
    let sorted = facet.nodes.sorted();
    let side = (0..element.sides()).find(|&side| element.side(side).sorted() == sorted)?;
    let face = element.face((0..element.faces()).find(|&face| element.sides_of(face).contains(&side))?);
    let corners = if face.len() == 6 { 3 } else { 4 };
    Some(std::array::from_fn(|k| face[k.min(corners - 1)]))
}

fn marks(mesh: &Mesh, layout: &Layout, names: &[String]) -> Vec<Mark> {
    let point = |node: &u32| layout.nodes.binary_search(node).ok().map(|point| point as u32);
    let mark = |name: &String| {
        if let Some(surface) = mesh.surfaces.get(name) {
            let drawn = surface.facets.iter().flat_map(|facet| [Some(four(&facet.nodes)), whole_face(mesh, facet)]);
            let corners = drawn.flatten().flatten();
            let quads = integers(corners.map(|node| point(&node).unwrap_or(u32::MAX)));
            return Some(Mark { name: name.clone(), quads: Some(quads), points: None });
        }
        let points = integers(mesh.set_nodes(name)?.iter().filter_map(point));
        Some(Mark { name: name.clone(), quads: None, points: Some(points) })
    };
    names.iter().filter_map(mark).collect()
}

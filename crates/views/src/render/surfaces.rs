//! Pictures of named surfaces: one of all, and one of each.

use std::collections::BTreeSet;

use slipstick_mesh::{Mesh, Surface, facet_area_vector};

use super::RenderError;
use super::colour::Colour;
use super::picture::{Canvas, Picture};
use super::scene::{Layer, Paint, Scene, Style};
use super::view::View;

/// A surface and what its picture says.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceLabel {
    /// Name of a surface of the mesh.
    pub name: String,
    /// Lines below the name.
    pub lines: Vec<String>,
    /// Direction of an arrow at the surface.
    pub normal: Option<[f64; 3]>,
}

/// Colours that are easily told apart: Okabe and Ito (2008), without black, and darker ones.
const COLOURS: [Colour; 12] = [
    Colour([230, 159, 0]),
    Colour([86, 180, 233]),
    Colour([0, 158, 115]),
    Colour([240, 228, 66]),
    Colour([0, 114, 178]),
    Colour([213, 94, 0]),
    Colour([204, 121, 167]),
    Colour([140, 86, 20]),
    Colour([106, 61, 154]),
    Colour([128, 177, 40]),
    Colour([178, 34, 34]),
    Colour([70, 110, 110]),
];

/// Directions to the eye, of which a surface is seen from the one that shows most of its area.
const EYES: [[f64; 3]; 8] = [
    [0.8, 0.75, 1.0],
    [-0.8, 0.75, 1.0],
    [-0.8, 0.75, -1.0],
    [0.8, 0.75, -1.0],
    [0.8, -0.75, 1.0],
    [-0.8, -0.75, 1.0],
    [-0.8, -0.75, -1.0],
    [0.8, -0.75, -1.0],
];

/// How far surfaces are drawn above their bodies, relative to the size of the bodies; a surface that
/// shares facets with a larger one, by as much above that.
const LIFT: f64 = 2e-3;

/// All surfaces from two opposite sides, then each one on its own, with its lines of text and its
/// normal: its bodies as glass, the others as outlines. Each picture has the size of `panel`; they are
/// arranged in a grid.
///
/// Surfaces that the mesh does not have are left out.
///
/// # Errors
/// [`RenderError::Size`] if there are too many; [`RenderError::NotFinite`] for coordinates.
pub fn surfaces_picture(mesh: &Mesh, labels: &[SurfaceLabel], panel: &Canvas) -> Result<Picture, RenderError> {
    let known: Vec<(&SurfaceLabel, &Surface, Colour)> = labels
        .iter()
        .enumerate()
        .filter_map(|(n, label)| Some((label, mesh.surfaces.get(&label.name)?, COLOURS[n % COLOURS.len()])))
        .collect();
    let count = known.len() + 2;
    let columns = ((1.3 * count as f64).sqrt().ceil() as usize).min(count);
    // before anything is drawn
    super::picture::check_size(panel.width * columns as u32, panel.height * count.div_ceil(columns) as u32)?;
    let mut pictures = Vec::with_capacity(count);
    let all: Vec<(&Surface, Colour)> = known.iter().map(|(_, surface, colour)| (*surface, *colour)).collect();
    for (eye, from) in [(EYES[0], "+x, +y and +z"), (EYES[6], "-x, -y and -z")] {
        let caption = format!("all surfaces, seen from {from}");
        pictures.push(drawn(mesh, &all, (eye, caption, None), panel)?);
    }
    for (label, surface, colour) in known {
        let caption = std::iter::once(&label.name).chain(&label.lines).cloned().collect::<Vec<_>>().join("\n");
        pictures.push(drawn(mesh, &[(surface, colour)], (best_eye(mesh, surface), caption, label.normal), panel)?);
    }
    Picture::grid(&pictures, columns)
}

/// The direction from which most of a surface's area is seen.
fn best_eye(mesh: &Mesh, surface: &Surface) -> [f64; 3] {
    let areas: Vec<[f64; 3]> =
        surface.facets.iter().map(|facet| facet_area_vector(&mesh.facet_coordinates(facet))).collect();
    let seen = |eye: &[f64; 3]| areas.iter().map(|a| (0..3).map(|c| a[c] * eye[c]).sum::<f64>().max(0.0)).sum::<f64>();
    let mut best = (EYES[0], seen(&EYES[0]));
    for eye in &EYES[1..] {
        let area = seen(eye);
        // by more than round-off, so that the first of equal ones stays
        if area > best.1 * (1.0 + 1e-9) {
            best = (*eye, area);
        }
    }
    best.0
}

/// A picture of some surfaces.
fn drawn(
    mesh: &Mesh,
    surfaces: &[(&Surface, Colour)],
    (eye, caption, normal): ([f64; 3], String, Option<[f64; 3]>),
    panel: &Canvas,
) -> Result<Picture, RenderError> {
    let size = size(mesh);
    let (mut points, mut lifted) = (mesh.nodes.clone(), Vec::new());
    for ((surface, colour), level) in surfaces.iter().zip(levels(mesh, surfaces)) {
        let lift = LIFT * size * (1 + level) as f64;
        let nodes: Vec<u32> = surface.nodes();
        let at = |node: u32| nodes.binary_search(&node).unwrap_or(0);
        let mut normals = vec![[0.0; 3]; nodes.len()];
        for facet in &surface.facets {
            let area = facet_area_vector(&mesh.facet_coordinates(facet));
            facet.nodes.iter().for_each(|&node| (0..3).for_each(|c| normals[at(node)][c] += area[c]));
        }
        let first = points.len() as u32;
        points.extend(nodes.iter().zip(&normals).map(|(&node, normal)| {
            let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
            std::array::from_fn(|c| mesh.nodes[node as usize][c] + lift * normal[c] / length)
        }));
        let triangles = surface.facets.iter().flat_map(|facet| {
            let corner = |k: usize| first + at(facet.nodes[k]) as u32;
            (1..facet.nodes.len() - 1).map(move |k| [corner(0), corner(k), corner(k + 1)]).collect::<Vec<_>>()
        });
        lifted.push((triangles.collect::<Vec<[u32; 3]>>(), *colour));
    }
    let owns = |body: &slipstick_mesh::Body| {
        surfaces.iter().any(|(of, _)| of.facets.iter().any(|facet| body.elements.contains(&(facet.element as usize))))
    };
    let mut scene = Scene::new(&points, &mesh.elements)?;
    for body in &mesh.bodies {
        let cells = body.elements.clone().map(|e| e as u32).collect();
        let (style, colour) =
            if owns(body) { (Style::Translucent(0.25), Colour::GLASS) } else { (Style::Outline, Colour::GREY) };
        scene.add(Layer { cells, paint: Paint::Plain(colour), style, edges: false })?;
        if owns(body) {
            let cells = body.elements.clone().map(|e| e as u32).collect();
            scene.add(Layer { cells, paint: Paint::Plain(Colour::GREY), style: Style::Outline, edges: false })?;
        }
    }
    for (triangles, colour) in &lifted {
        scene.add_surface(triangles, *colour)?;
    }
    if let (Some(normal), [(surface, _)]) = (normal, surfaces)
        && let Some(from) = middle(mesh, surface)
    {
        scene.add_arrow(from, std::array::from_fn(|c| from[c] + 0.15 * size * normal[c]), Colour::INK)?;
    }
    scene.view = View::from_directions(eye, [0.0, 1.0, 0.0])?;
    scene.caption = Some(caption);
    scene.picture(panel)
}

/// The number of surfaces below each surface: of those that share facets, the smallest one is on top, and
/// of those of the same area the last one.
fn levels(mesh: &Mesh, surfaces: &[(&Surface, Colour)]) -> Vec<usize> {
    let length = |a: [f64; 3]| a.iter().map(|x| x * x).sum::<f64>().sqrt();
    let area = |of: &Surface| -> f64 {
        of.facets.iter().map(|facet| length(facet_area_vector(&mesh.facet_coordinates(facet)))).sum()
    };
    let keys = |of: &Surface| -> BTreeSet<(u32, Vec<u32>)> {
        let sorted = |facet: &slipstick_mesh::Facet| {
            let mut nodes = facet.nodes.to_vec();
            nodes.sort_unstable();
            (facet.element, nodes)
        };
        of.facets.iter().map(sorted).collect()
    };
    let all: Vec<(f64, BTreeSet<_>)> = surfaces.iter().map(|(of, _)| (area(of), keys(of))).collect();
    let mut order: Vec<usize> = (0..all.len()).collect();
    order.sort_by(|&a, &b| all[b].0.total_cmp(&all[a].0));
    let mut levels = vec![0; all.len()];
    for (place, &upper) in order.iter().enumerate() {
        let below = order[..place].iter().filter(|&&lower| !all[lower].1.is_disjoint(&all[upper].1));
        levels[upper] = below.map(|&lower| levels[lower] + 1).max().unwrap_or(0);
    }
    levels
}

/// The diagonal of the box around all bodies.
fn size(mesh: &Mesh) -> f64 {
    let nodes = || mesh.bodies.iter().flat_map(|body| &mesh.nodes[body.nodes.clone()]);
    let side = |c: usize| {
        let [low, high] =
            nodes().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], node| [low.min(node[c]), high.max(node[c])]);
        high - low
    };
    (0..3).map(|c| side(c).powi(2)).sum::<f64>().sqrt()
}

/// The centroid of the facet that is closest to the mean of all of them.
fn middle(mesh: &Mesh, surface: &Surface) -> Option<[f64; 3]> {
    let centroid = |facet: &slipstick_mesh::Facet| -> [f64; 3] {
        let sum = |c: usize| facet.nodes.iter().map(|&node| mesh.nodes[node as usize][c]).sum::<f64>();
        std::array::from_fn(|c| sum(c) / facet.nodes.len() as f64)
    };
    let all: Vec<[f64; 3]> = surface.facets.iter().map(centroid).collect();
    let mean: [f64; 3] = std::array::from_fn(|c| all.iter().map(|x| x[c]).sum::<f64>() / all.len() as f64);
    let distance = |x: &[f64; 3]| (0..3).map(|c| (x[c] - mean[c]).powi(2)).sum::<f64>();
    all.into_iter().min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

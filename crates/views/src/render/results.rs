//! Pictures of designs and states.

use slipstick_mesh::Mesh;

use super::RenderError;
use super::colour::{Colour, ColourMap, ColourScale};
use super::error::{check_field, check_finite};
use super::follow::displaced;
use super::marks::{Mark, diagonal};
use super::picture::{Canvas, Picture};
use super::scene::{Layer, Paint, Scene, Style};
use super::view::View;
use crate::export::TriangleSurface;

/// Options for showing results.
#[derive(Debug, Clone, PartialEq)]
pub struct RenderOptions {
    /// Size and smoothness.
    pub canvas: Canvas,
    /// The view.
    pub view: View,
    /// Colours of the field.
    pub colour_map: ColourMap,
    /// Values at the ends of the colours; `None`: 0 to 1 for a density, the range over the shown
    /// elements for another field.
    pub range: Option<[f64; 2]>,
    /// Bodies that show the field; `None`: those of the design, that is, with a density below 1
    /// somewhere, or all if there are none.
    pub bodies: Option<Vec<String>>,
    /// Appearance of the other bodies in the picture of a state; the picture of a design omits
    /// them.
    pub others: Style,
    /// Removes a part of all bodies to show the inside.
    pub cut: Option<Cut>,
    /// Whether element edges are drawn.
    pub edges: bool,
    /// Whether the box around the undeformed bodies that show the field is drawn.
    pub domain: bool,
    /// Factor on displacements.
    pub displacement_factor: f64,
    /// Caption.
    pub caption: Option<String>,
    /// Symbols for what holds and moves the bodies.
    pub marks: Vec<Mark>,
    /// Whether the undeformed shape of what shows the field or the design is drawn behind the deformed one.
    pub undeformed: bool,
    /// Name of the unit of length, with which a scale bar is drawn.
    pub length_unit: Option<String>,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self {
            canvas: Canvas::default(),
            view: View::default(),
            colour_map: ColourMap::default(),
            range: None,
            bodies: None,
            others: Style::Translucent(0.5),
            cut: None,
            edges: true,
            domain: false,
            displacement_factor: 1.0,
            caption: None,
            marks: Vec::new(),
            undeformed: false,
            length_unit: None,
        }
    }
}

/// Removes the elements whose centroid X in the reference configuration has `normal · X > offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cut {
    /// Normal, pointing to the removed side.
    pub normal: [f64; 3],
    /// \[L\] times the normal's length.
    pub offset: f64,
}

/// A scalar result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Field<'a> {
    /// Title of the colour bar.
    pub title: &'a str,
    /// One value per element or per node.
    pub values: FieldValues<'a>,
}

/// Location of a field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FieldValues<'a> {
    /// One value per element of the mesh.
    Elements(&'a [f64]),
    /// One value per node of the mesh.
    Nodes(&'a [f64]),
}

impl<'a> Field<'a> {
    /// The density as a field.
    pub fn density(density: &'a [f64]) -> Self {
        Self { title: DENSITY, values: FieldValues::Elements(density) }
    }
}

const DENSITY: &str = "density";

/// A design: the undeformed elements of the design whose density exceeds the threshold, coloured by
/// density.
///
/// `density` has one value per element of the mesh. If no element exceeds the threshold, the
/// picture says so.
///
/// # Errors
/// [`RenderError::Length`], [`RenderError::NotFinite`]; [`RenderError::UnknownBody`],
/// [`RenderError::Range`], [`RenderError::Size`] or [`RenderError::Supersampling`] for the options.
pub fn design_picture(
    mesh: &Mesh,
    density: &[f64],
    threshold: f64,
    options: &RenderOptions,
) -> Result<Picture, RenderError> {
    let options = RenderOptions { others: Style::Hidden, ..options.clone() };
    show(mesh, None, density, threshold, &Field::density(density), &options)
}

/// A state: the deformed elements of the design whose density exceeds the threshold, coloured by a
/// field, with the other bodies as context.
///
/// `displacement` has 3 components per node \[L\], `density` one value per element.
///
/// # Errors
/// As for [`design_picture`].
pub fn state_picture(
    mesh: &Mesh,
    displacement: &[f64],
    density: &[f64],
    threshold: f64,
    field: &Field<'_>,
    options: &RenderOptions,
) -> Result<Picture, RenderError> {
    show(mesh, Some(displacement), density, threshold, field, options)
}

/// A design as the surface that [`design_surface`](crate::export::design_surface) extracts, in the colour of a
/// material, with the other bodies as context; with displacements, 3 per node \[L\], deformed.
///
/// The options about fields, cuts and edges are not used.
///
/// # Errors
/// [`RenderError::NotFinite`], [`RenderError::Length`]; [`RenderError::Size`] or
/// [`RenderError::Supersampling`] for the options.
pub fn surface_picture(
    mesh: &Mesh,
    surface: &TriangleSurface,
    displacement: Option<&[f64]>,
    options: &RenderOptions,
) -> Result<Picture, RenderError> {
    let mut bodies = surface.bodies.clone();
    bodies.sort_unstable();
    bodies.dedup();
    let mut points = surface.points.clone();
    if let Some(displacement) = displacement {
        check_field("displacement", displacement, 3 * mesh.nodes.len())?;
        for &body in &bodies {
            let of = surface.triangles.iter().zip(&surface.bodies).filter(|(_, of)| **of == body);
            let mut chosen: Vec<u32> = of.flat_map(|(triangle, _)| *triangle).collect();
            chosen.sort_unstable();
            chosen.dedup();
            let factor = options.displacement_factor;
            displaced(mesh, &mesh.bodies[body as usize], displacement, factor, &mut points, &chosen);
        }
    }
    let first = mesh.nodes.len() as u32;
    let mut all = mesh.nodes.clone();
    if let Some(displacement) = displacement {
        for (point, by) in all.iter_mut().zip(displacement.as_chunks::<3>().0) {
            (0..3).for_each(|c| point[c] += options.displacement_factor * by[c]);
        }
    }
    all.extend(points);
    let mut scene = Scene::new(&all, &mesh.elements)?;
    scene.view = options.view;
    scene.caption = options.caption.clone();
    if options.undeformed && moves(mesh, displacement, options) {
        scene.add_ghost_surface(&surface.points, &surface.triangles)?;
    }
    let triangles: Vec<[u32; 3]> = surface.triangles.iter().map(|t| t.map(|n| first + n)).collect();
    scene.add_surface(&triangles, Colour::MATERIAL)?;
    let others = mesh.bodies.iter().enumerate().filter(|(body, _)| !bodies.contains(&(*body as u32)));
    let cells: Vec<u32> = others.flat_map(|(_, body)| body.elements.clone()).map(|e| e as u32).collect();
    scene.add(Layer { cells, paint: Paint::Plain(Colour::GLASS), style: options.others, edges: false })?;
    mark(&mut scene, mesh, options)?;
    for body in bodies.into_iter().filter(|_| options.domain).map(|body| &mesh.bodies[body as usize]) {
        if let Some([min, max]) = bounds(&mesh.nodes[body.nodes.clone()]) {
            scene.add_box(min, max)?;
        }
    }
    scene.picture(&options.canvas)
}

/// Adds symbols and the scale bar.
fn mark(scene: &mut Scene<'_>, mesh: &Mesh, options: &RenderOptions) -> Result<(), RenderError> {
    let size = extent(mesh);
    options.marks.iter().try_for_each(|one| scene.add_mark(one, size))?;
    scene.length_unit.clone_from(&options.length_unit);
    Ok(())
}

/// The diagonal of the box around all bodies.
fn extent(mesh: &Mesh) -> f64 {
    diagonal(mesh.bodies.iter().flat_map(|body| mesh.nodes[body.nodes.clone()].iter().copied()))
}

/// Whether displacements are so large that the undeformed shape is worth its lines.
fn moves(mesh: &Mesh, displacement: Option<&[f64]>, options: &RenderOptions) -> bool {
    let size = extent(mesh);
    let largest = displacement.unwrap_or(&[]).iter().fold(0.0f64, |largest, u| largest.max(u.abs()));
    options.displacement_factor * largest > 0.004 * size
}

fn show(
    mesh: &Mesh,
    displacement: Option<&[f64]>,
    density: &[f64],
    threshold: f64,
    field: &Field<'_>,
    options: &RenderOptions,
) -> Result<Picture, RenderError> {
    check_field(DENSITY, density, mesh.elements.len())?;
    check_finite("threshold", [threshold])?;
    let bears = bearing_bodies(mesh, density, options)?;
    let mut scene = Scene::new(&mesh.nodes, &mesh.elements)?;
    if let Some(displacement) = displacement {
        scene.displace(displacement, options.displacement_factor)?;
    }
    let (mut cells, mut context) = (Vec::new(), Vec::new());
    for (body, bears) in mesh.bodies.iter().zip(&bears) {
        let kept = body.elements.clone().filter(|&e| density[e] > threshold && stays(mesh, e, options.cut));
        if *bears { &mut cells } else { &mut context }.extend(kept.map(|e| e as u32));
    }
    let paint = match field.values {
        FieldValues::Elements(values) => {
            check_field(field.title, values, mesh.elements.len())?;
            Paint::Cells(values)
        }
        FieldValues::Nodes(values) => {
            check_field(field.title, values, mesh.nodes.len())?;
            Paint::Points(values)
        }
    };
    scene.scale = Some(scale(mesh, &cells, field, options)?);
    scene.note = format!("no element with density > {threshold}");
    scene.view = options.view;
    scene.caption = options.caption.clone();
    if cells.is_empty() {
        // Context alone would be mistaken for a result.
        context.clear();
    }
    if options.undeformed && moves(mesh, displacement, options) {
        scene.add_ghost(&mesh.nodes, &cells)?;
    }
    scene.add(Layer { cells, paint, style: Style::Solid, edges: options.edges })?;
    let paint = if options.others == Style::Solid { paint } else { Paint::Plain(Colour::GLASS) };
    scene.add(Layer { cells: context, paint, style: options.others, edges: options.edges })?;
    mark(&mut scene, mesh, options)?;
    if options.domain {
        for (body, _) in mesh.bodies.iter().zip(&bears).filter(|(_, bears)| **bears) {
            if let Some([min, max]) = bounds(&mesh.nodes[body.nodes.clone()]) {
                scene.add_box(min, max)?;
            }
        }
    }
    scene.picture(&options.canvas)
}

/// For each body, whether it shows the field.
fn bearing_bodies(mesh: &Mesh, density: &[f64], options: &RenderOptions) -> Result<Vec<bool>, RenderError> {
    if let Some(names) = &options.bodies {
        if let Some(name) = names.iter().find(|name| mesh.body(name).is_none()) {
            let known: Vec<&str> = mesh.bodies.iter().map(|body| body.name.as_str()).collect();
            return Err(RenderError::UnknownBody { name: name.clone(), known: known.join(", ") });
        }
        return Ok(mesh.bodies.iter().map(|body| names.contains(&body.name)).collect());
    }
    let designed: Vec<bool> =
        mesh.bodies.iter().map(|body| density[body.elements.clone()].iter().any(|d| *d < 1.0)).collect();
    Ok(if designed.contains(&true) { designed } else { vec![true; mesh.bodies.len()] })
}

fn stays(mesh: &Mesh, element: usize, cut: Option<Cut>) -> bool {
    cut.is_none_or(|Cut { normal, offset }| {
        let x = mesh.centroid(element);
        normal[0] * x[0] + normal[1] * x[1] + normal[2] * x[2] <= offset
    })
}

fn scale(mesh: &Mesh, cells: &[u32], field: &Field<'_>, options: &RenderOptions) -> Result<ColourScale, RenderError> {
    let range = options.range.or((field.title == DENSITY).then_some([0.0, 1.0]));
    if let Some(range) = range {
        return ColourScale::new(field.title, options.colour_map, range);
    }
    let shown: Vec<f64> = match field.values {
        FieldValues::Elements(values) => cells.iter().map(|&e| values[e as usize]).collect(),
        FieldValues::Nodes(values) => {
            cells.iter().flat_map(|&e| mesh.elements[e as usize].nodes()).map(|&n| values[n as usize]).collect()
        }
    };
    ColourScale::covering(field.title, options.colour_map, shown)
}

fn bounds(points: &[[f64; 3]]) -> Option<[[f64; 3]; 2]> {
    let (first, rest) = points.split_first()?;
    Some(rest.iter().fold([*first; 2], |[min, max], p| {
        [std::array::from_fn(|c| min[c].min(p[c])), std::array::from_fn(|c| max[c].max(p[c]))]
    }))
}

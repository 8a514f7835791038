//! A scene: cells in layers, with colours and a view.

use slipstick_mesh::Element;

use super::colour::{Colour, ColourScale};
use super::error::{check_field, check_finite};
use super::marks::Label;
use super::picture::{Canvas, Picture};
use super::skin::{SkinFace, skin};
use super::view::View;
use super::{RenderError, compose};

/// The colour of a layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Paint<'a> {
    /// One colour.
    Plain(Colour),
    /// One value per cell of the mesh, coloured by the scene's scale.
    Cells(&'a [f64]),
    /// One value per point of the mesh, coloured by the scene's scale and linear in between.
    Points(&'a [f64]),
}

/// The appearance of a layer.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Style {
    /// Hidden.
    Hidden,
    /// As an opaque body.
    #[default]
    Solid,
    /// As glass: its nearest face is blended with the objects behind, with this opacity from 0
    /// to 1.
    Translucent(f64),
    /// As the edges of the element faces that point towards the eye.
    Wire,
    /// As sharp edges and contours.
    Outline,
}

/// Cells with the same appearance.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer<'a> {
    /// Numbers of the cells. Only their skin is drawn: faces that no other cell of the layer has.
    pub cells: Vec<u32>,
    /// Their colour.
    pub paint: Paint<'a>,
    /// Their appearance.
    pub style: Style,
    /// Whether edges of the element faces are drawn; they fade where faces are smaller than a few
    /// pixels.
    pub edges: bool,
}

/// Cells, their appearance, and the view.
///
/// ```
/// use slipstick_views::render::{Canvas, Colour, Layer, Paint, Scene, Style, View};
/// let points = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.],
///               [0., 0., 1.], [1., 0., 1.], [1., 1., 1.], [0., 1., 1.]];
/// let elements = [slipstick_mesh::Element::Hex8([0, 1, 2, 3, 4, 5, 6, 7])];
/// let mut scene = Scene::new(&points, &elements)?;
/// scene.add(Layer { cells: vec![0], paint: Paint::Plain(Colour::GLASS), style: Style::Solid, edges: true })?;
/// scene.view = View::named("top")?;
/// let picture = scene.picture(&Canvas { width: 120, height: 90, supersampling: 2 })?;
/// assert_ne!(picture.pixel(50, 45), Some([255; 3]));
/// # Ok::<(), slipstick_views::render::RenderError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Scene<'a> {
    pub(super) points: Vec<[f64; 3]>,
    pub(super) elements: &'a [Element],
    pub(super) layers: Vec<Layer<'a>>,
    pub(super) surfaces: Vec<(Vec<SkinFace>, Colour)>,
    pub(super) boxes: Vec<[[f64; 3]; 2]>,
    pub(super) arrows: Vec<([f64; 3], [f64; 3], Colour)>,
    /// Dash-dotted lines.
    pub(super) chains: Vec<[[f64; 3]; 2]>,
    pub(super) labels: Vec<Label>,
    /// Bodies behind everything else, as outlines.
    pub(super) ghosts: Vec<(Vec<[f64; 3]>, Vec<SkinFace>)>,
    /// Colour scale for fields; it is shown as a colour bar.
    pub scale: Option<ColourScale>,
    /// The view.
    pub view: View,
    /// Caption, of one or several lines.
    pub caption: Option<String>,
    /// Text in the centre if no layer has cells.
    pub note: String,
    /// Whether faces are shaded: by their angles to lights, of which the strongest comes from the upper left
    /// behind the eye, and by surfaces close to them.
    pub shaded: bool,
    /// Whether the directions of x, y and z are shown.
    pub axes: bool,
    /// Name of the unit of length, with which a scale bar is shown.
    pub length_unit: Option<String>,
}

impl<'a> Scene<'a> {
    /// A scene without layers: coordinates \[L\] and elements (numbered as in VTK).
    ///
    /// # Errors
    /// [`RenderError::NotFinite`] for coordinates, [`RenderError::NodeOutOfRange`].
    pub fn new(points: &[[f64; 3]], elements: &'a [Element]) -> Result<Self, RenderError> {
        check_finite("points", points.as_flattened().iter().copied())?;
        for (element, cell) in elements.iter().enumerate() {
            if let Some(&node) = cell.nodes().iter().find(|&&node| node as usize >= points.len()) {
                return Err(RenderError::NodeOutOfRange { element, node, nodes: points.len() });
            }
        }
        Ok(Self {
            points: points.to_vec(),
            elements,
            layers: Vec::new(),
            surfaces: Vec::new(),
            boxes: Vec::new(),
            arrows: Vec::new(),
            chains: Vec::new(),
            labels: Vec::new(),
            ghosts: Vec::new(),
            scale: None,
            view: View::default(),
            caption: None,
            note: "no cells to show".into(),
            shaded: true,
            axes: true,
            length_unit: None,
        })
    }

    /// Moves the points by displacements \[L\], 3 per point, times a factor.
    ///
    /// # Errors
    /// [`RenderError::Length`], [`RenderError::NotFinite`].
    pub fn displace(&mut self, displacement: &[f64], factor: f64) -> Result<(), RenderError> {
        check_field("displacement", displacement, 3 * self.points.len())?;
        check_finite("displacement factor", [factor])?;
        for (point, by) in self.points.iter_mut().zip(displacement.as_chunks::<3>().0) {
            (0..3).for_each(|c| point[c] += factor * by[c]);
        }
        check_finite("displaced points", self.points.as_flattened().iter().copied())
    }

    /// Adds a layer.
    ///
    /// # Errors
    /// [`RenderError::CellOutOfRange`]; [`RenderError::Length`] or [`RenderError::NotFinite`] for
    /// its field or opacity.
    pub fn add(&mut self, layer: Layer<'a>) -> Result<(), RenderError> {
        let cells = self.elements.len();
        if let Some(&cell) = layer.cells.iter().find(|&&cell| cell as usize >= cells) {
            return Err(RenderError::CellOutOfRange { cell, cells });
        }
        match layer.paint {
            Paint::Plain(_) => {}
            Paint::Cells(values) => check_field("cell field", values, cells)?,
            Paint::Points(values) => check_field("point field", values, self.points.len())?,
        }
        if let Style::Translucent(opacity) = layer.style {
            check_finite("opacity", [opacity])?;
        }
        self.layers.push(layer);
        Ok(())
    }

    /// Adds a surface of triangles between given points, counter-clockwise seen from outside,
    /// without edges.
    ///
    /// # Errors
    /// [`RenderError::NodeOutOfRange`] with the number of the triangle.
    pub fn add_surface(&mut self, triangles: &[[u32; 3]], colour: Colour) -> Result<(), RenderError> {
        let nodes = self.points.len();
        for (element, triangle) in triangles.iter().enumerate() {
            if let Some(&node) = triangle.iter().find(|&&node| node as usize >= nodes) {
                return Err(RenderError::NodeOutOfRange { element, node, nodes });
            }
        }
        let faces = triangles.iter().map(|&t| SkinFace { nodes: t.into(), cell: 0 }).collect();
        self.surfaces.push((faces, colour));
        Ok(())
    }

    /// Adds the edges of a box between two corners, for instance an undeformed domain.
    ///
    /// # Errors
    /// [`RenderError::NotFinite`].
    pub fn add_box(&mut self, min: [f64; 3], max: [f64; 3]) -> Result<(), RenderError> {
        check_finite("box", min.into_iter().chain(max))?;
        self.boxes.push([min, max]);
        Ok(())
    }

    /// Adds an arrow between two positions.
    ///
    /// # Errors
    /// [`RenderError::NotFinite`].
    pub fn add_arrow(&mut self, from: [f64; 3], to: [f64; 3], colour: Colour) -> Result<(), RenderError> {
        check_finite("arrow", from.into_iter().chain(to))?;
        self.arrows.push((from, to, colour));
        Ok(())
    }

    /// Adds cells, with points at other positions \[L\], as outlines behind everything else: the undeformed
    /// shape of bodies.
    ///
    /// # Errors
    /// [`RenderError::CellOutOfRange`]; [`RenderError::Length`] or [`RenderError::NotFinite`] for the points.
    pub fn add_ghost(&mut self, points: &[[f64; 3]], cells: &[u32]) -> Result<(), RenderError> {
        check_finite("ghost", points.as_flattened().iter().copied())?;
        let count = self.elements.len();
        if let Some(&cell) = cells.iter().find(|&&cell| cell as usize >= count) {
            return Err(RenderError::CellOutOfRange { cell, cells: count });
        }
        let faces = skin(self.elements, cells);
        if faces.iter().flat_map(|face| &face.nodes).any(|&node| node as usize >= points.len()) {
            return Err(RenderError::Length { name: "ghost".into(), expected: self.points.len(), found: points.len() });
        }
        self.ghosts.push((points.to_vec(), faces));
        Ok(())
    }

    /// Adds a surface of triangles as [`add_ghost`](Self::add_ghost) adds cells.
    ///
    /// # Errors
    /// [`RenderError::NodeOutOfRange`] with the number of the triangle; [`RenderError::NotFinite`].
    pub fn add_ghost_surface(&mut self, points: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<(), RenderError> {
        check_finite("ghost", points.as_flattened().iter().copied())?;
        let nodes = points.len();
        for (element, triangle) in triangles.iter().enumerate() {
            if let Some(&node) = triangle.iter().find(|&&node| node as usize >= nodes) {
                return Err(RenderError::NodeOutOfRange { element, node, nodes });
            }
        }
        let faces = triangles.iter().map(|&t| SkinFace { nodes: t.into(), cell: 0 }).collect();
        self.ghosts.push((points.to_vec(), faces));
        Ok(())
    }

    /// Draws the scene: the visible cells fill the picture next to the colour bar and below the
    /// caption.
    ///
    /// A scene without cells gives a picture with the note.
    ///
    /// # Errors
    /// [`RenderError::Size`], [`RenderError::Supersampling`]; [`RenderError::NoScale`] if a field
    /// has no scale.
    pub fn picture(&self, canvas: &Canvas) -> Result<Picture, RenderError> {
        canvas.check()?;
        Ok(Picture::draw(&compose::drawing(self, canvas)?))
    }
}

/// Numbers of the cells whose value exceeds a threshold.
pub fn cells_above(values: &[f64], threshold: f64) -> Vec<u32> {
    values.iter().enumerate().filter(|(_, value)| **value > threshold).map(|(cell, _)| cell as u32).collect()
}

//! Rasterizes faces, lines and ink: a depth buffer per band of rows, several samples per pixel.
//!
//! Bands are independent of each other, and within a band everything is drawn in the given order,
//! so the picture does not depend on the number of threads. Faces are drawn first: how much they shade each
//! other ([`occlusion`]) follows from their depths, of all bands.

use rayon::prelude::*;

use super::colour::{Palette, to_byte};
use super::ink::Ink;
use super::occlusion::{self, Depths};

/// A triangle or quadrilateral; positions are samples to the right, downwards and away from the
/// eye.
#[derive(Debug, Clone)]
pub(super) struct Face {
    /// Positions; the first `count` are corners.
    pub corners: [[f64; 3]; 4],
    pub count: usize,
    /// Values at the corners, which the palette converts to colours.
    pub values: [f64; 4],
    /// Light intensity at the corners, 0 to 1.
    pub shades: [f64; 4],
    /// Strength with which its edges are drawn, 0 to 1.
    pub edge: f32,
}

impl Face {
    /// Depth at the place of a point in the picture; `None` beside the face.
    pub fn depth(&self, at: [f64; 3]) -> Option<f64> {
        (1..self.count - 1).find_map(|k| {
            let [a, b, c] = [self.corners[0], self.corners[k], self.corners[k + 1]];
            let cross = |p: [f64; 3], q: [f64; 3]| (q[0] - p[0]) * (at[1] - p[1]) - (at[0] - p[0]) * (q[1] - p[1]);
            let weights = [cross(b, c), cross(c, a), cross(a, b)];
            let sum: f64 = weights.iter().sum();
            let inside = sum != 0.0 && weights.iter().all(|weight| weight / sum >= 0.0);
            inside.then(|| (weights[0] * a[2] + weights[1] * b[2] + weights[2] * c[2]) / sum)
        })
    }
}

/// A line in space, drawn in front of the faces on which it lies.
#[derive(Debug, Clone)]
pub(super) struct Line {
    pub from: [f64; 3],
    pub to: [f64; 3],
    pub radius: f64,
    pub light: [f32; 3],
}

/// Faces and lines with the same appearance.
#[derive(Debug, Clone)]
pub(super) struct Sheet {
    pub palette: Palette,
    /// 1 hides everything behind; below 1, only the nearest face is shown.
    pub opacity: f32,
    /// Behind all other sheets, wherever it is.
    pub behind: bool,
    /// Half the width of the edges of faces. \[samples\]
    pub edge_radius: f64,
    pub faces: Vec<Face>,
    pub lines: Vec<Line>,
}

/// The complete input of a picture.
#[derive(Debug, Clone)]
pub(super) struct Drawing {
    /// \[pixels\]
    pub width: usize,
    /// \[pixels\]
    pub height: usize,
    /// Samples per pixel and direction.
    pub samples: usize,
    pub sheets: Vec<Sheet>,
    /// Depth offset of lines towards the eye. \[samples\]
    pub lift: f64,
    /// How far surfaces shade each other; 0: they do not. \[pixels\]
    pub occlusion: f64,
    pub inks: Vec<Ink>,
}

/// Number of rows of pixels in a band.
const BAND: usize = 16;

impl Drawing {
    /// Red, green, blue of all pixels, row by row.
    pub fn pixels(&self) -> Vec<u8> {
        let bands = self.bin();
        let bodies: Vec<Layer> = bands.par_iter().enumerate().map(|(b, content)| self.bodies(b, content)).collect();
        let open = (self.occlusion > 0.0).then(|| {
            let depth = bodies.iter().enumerate().flat_map(|(b, layer)| self.pixel_depths(b, layer)).collect();
            occlusion::openness(&Depths { columns: self.width, depth }, self.occlusion)
        });
        let parts: Vec<Vec<u8>> = bodies
            .into_par_iter()
            .zip(&bands)
            .enumerate()
            .map(|(b, (layer, content))| self.band(b, layer, content, open.as_deref()))
            .collect();
        parts.concat()
    }

    /// The items that each band has to draw.
    fn bin(&self) -> Vec<Content> {
        let count = self.height.div_ceil(BAND);
        let mut bands = vec![Content { sheets: vec![Part::default(); self.sheets.len()], inks: Vec::new() }; count];
        let reach = |low: f64, high: f64, rows: f64| {
            let last = (high / rows).floor();
            // `as` maps positions above the picture to 0 and positions below it to the end.
            let range = if last < 0.0 { 0..0 } else { (low / rows).floor() as usize..(last as usize + 1).min(count) };
            range.start.min(range.end)..range.end
        };
        let rows = (BAND * self.samples) as f64;
        for (s, sheet) in self.sheets.iter().enumerate() {
            for (f, face) in sheet.faces.iter().enumerate() {
                let (low, high) = extent(face.corners.iter().map(|c| c[1]));
                bands[reach(low, high, rows)].iter_mut().for_each(|band| band.sheets[s].faces.push(f as u32));
            }
            for (l, line) in sheet.lines.iter().enumerate() {
                let (low, high) = extent([line.from[1], line.to[1]]);
                bands[reach(low - line.radius, high + line.radius, rows)]
                    .iter_mut()
                    .for_each(|band| band.sheets[s].lines.push(l as u32));
            }
        }
        for (i, ink) in self.inks.iter().enumerate() {
            let bounds = ink.bounds();
            bands[reach(bounds.top, bounds.bottom, BAND as f64)].iter_mut().for_each(|band| band.inks.push(i as u32));
        }
        bands
    }

    fn window(&self, number: usize) -> Window {
        let first = number * BAND;
        let rows = (self.height - first).min(BAND);
        Window { columns: self.width * self.samples, first: first * self.samples, rows: rows * self.samples }
    }

    /// The opaque faces of a band.
    fn bodies(&self, number: usize, content: &Content) -> Layer {
        let window = self.window(number);
        let mut picture = Layer::new(&window);
        for (sheet, part) in
            self.sheets.iter().zip(&content.sheets).filter(|(sheet, _)| sheet.opacity >= 1.0 && !sheet.behind)
        {
            for &f in &part.faces {
                fill(&sheet.faces[f as usize], sheet, &window, &mut picture);
            }
        }
        picture
    }

    /// Depth of the nearest face in each pixel of a band. \[pixels\]
    fn pixel_depths(&self, number: usize, layer: &Layer) -> Vec<f32> {
        let (window, s) = (self.window(number), self.samples);
        let sample = |row: usize, x: usize, k: usize| layer.depth[(row * s + k / s) * window.columns + x * s + k % s];
        let nearest =
            |row: usize, x: usize| (0..s * s).map(|k| sample(row, x, k)).fold(f32::INFINITY, f32::min) / s as f32;
        (0..window.rows / s)
            .flat_map(|row| (0..self.width).map(move |x| (row, x)))
            .map(|(row, x)| nearest(row, x))
            .collect()
    }

    /// Completes a band: the light that reaches its faces, then lines, glass and ink.
    fn band(&self, number: usize, mut picture: Layer, content: &Content, open: Option<&[f32]>) -> Vec<u8> {
        let window = self.window(number);
        if let Some(open) = open {
            for (i, light) in picture.light.iter_mut().enumerate().filter(|(i, _)| picture.depth[*i].is_finite()) {
                let (row, column) = (window.first + i / window.columns, i % window.columns);
                let open = open[row / self.samples * self.width + column / self.samples];
                light.iter_mut().for_each(|v| *v *= open);
            }
        }
        let (mut glass, mut ghost) = (Vec::new(), Layer::new(&window));
        for (sheet, part) in self.sheets.iter().zip(&content.sheets) {
            if sheet.behind {
                self.draw(sheet, part, &window, &mut ghost);
            } else if sheet.opacity >= 1.0 {
                for &l in &part.lines {
                    trace(&sheet.lines[l as usize], self.lift, &window, &mut picture);
                }
            } else if !(part.faces.is_empty() && part.lines.is_empty()) {
                let mut layer = Layer::new(&window);
                self.draw(sheet, part, &window, &mut layer);
                glass.push((sheet.opacity, layer));
            }
        }
        for (i, light) in picture.light.iter_mut().enumerate().filter(|(i, _)| picture.depth[*i] == f32::INFINITY) {
            *light = ghost.light[i];
        }
        look_through(&mut picture, &glass);
        for &i in &content.inks {
            self.print(&self.inks[i as usize], &window, &mut picture);
        }
        let mut pixels = self.resolve(window.rows / self.samples, &picture);
        for &i in &content.inks {
            self.inks[i as usize].blend(&mut pixels, self.width, number * BAND);
        }
        pixels
    }

    fn draw(&self, sheet: &Sheet, part: &Part, window: &Window, layer: &mut Layer) {
        for &f in &part.faces {
            fill(&sheet.faces[f as usize], sheet, window, layer);
        }
        for &l in &part.lines {
            trace(&sheet.lines[l as usize], self.lift, window, layer);
        }
    }

    fn print(&self, ink: &Ink, window: &Window, picture: &mut Layer) {
        let s = self.samples as f64;
        let bounds = ink.bounds();
        let (columns, rows) =
            (window.span_x(bounds.left * s, bounds.right * s), window.span_y(bounds.top * s, bounds.bottom * s));
        for y in rows {
            for x in columns.clone() {
                if let Some(light) = ink.light((x as f64 + 0.5) / s, (y as f64 + 0.5) / s) {
                    picture.light[window.index(x, y)] = light;
                }
            }
        }
    }

    /// Means of the samples of each pixel, in linear light, so that edges have the correct
    /// brightness.
    fn resolve(&self, rows: usize, picture: &Layer) -> Vec<u8> {
        let (s, columns) = (self.samples, self.width * self.samples);
        let weight = 1.0 / (s * s) as f32;
        let mut bytes = Vec::with_capacity(3 * self.width * rows);
        for y in 0..rows {
            for x in 0..self.width {
                let mut sum = [0f32; 3];
                for sample in 0..s * s {
                    let light = picture.light[(y * s + sample / s) * columns + x * s + sample % s];
                    (0..3).for_each(|c| sum[c] += light[c]);
                }
                bytes.extend(sum.map(|v| to_byte(v * weight)));
            }
        }
        bytes
    }
}

/// Numbers of the items that touch a band.
#[derive(Clone)]
struct Content {
    sheets: Vec<Part>,
    inks: Vec<u32>,
}

#[derive(Clone, Default)]
struct Part {
    faces: Vec<u32>,
    lines: Vec<u32>,
}

/// The samples of a band.
struct Window {
    columns: usize,
    first: usize,
    rows: usize,
}

impl Window {
    fn index(&self, x: usize, y: usize) -> usize {
        (y - self.first) * self.columns + x
    }

    /// Columns whose centres may lie between two positions.
    fn span_x(&self, low: f64, high: f64) -> std::ops::Range<usize> {
        span(low, high, 0, self.columns)
    }

    fn span_y(&self, low: f64, high: f64) -> std::ops::Range<usize> {
        span(low, high, self.first, self.first + self.rows)
    }
}

fn span(low: f64, high: f64, first: usize, end: usize) -> std::ops::Range<usize> {
    let a = ((low - 0.5).ceil().max(0.0) as usize).clamp(first, end);
    let b = ((high - 0.5).floor() + 1.0).max(0.0) as usize;
    a..b.clamp(a, end)
}

/// Nearest light and depth of each sample.
struct Layer {
    light: Vec<[f32; 3]>,
    depth: Vec<f32>,
}

impl Layer {
    fn new(window: &Window) -> Self {
        let n = window.columns * window.rows;
        Self { light: vec![[1.0; 3]; n], depth: vec![f32::INFINITY; n] }
    }
}

fn extent(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    values.into_iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)))
}

/// Fills a face with triangles around its centre, which shows a warped face and its values without
/// a preferred diagonal.
fn fill(face: &Face, sheet: &Sheet, window: &Window, layer: &mut Layer) {
    let (corners, values) = (&face.corners[..face.count], &face.values[..face.count]);
    let share = 1.0 / face.count as f64;
    let c: [f64; 3] = std::array::from_fn(|i| share * corners.iter().map(|p| p[i]).sum::<f64>());
    let middle_value = share * values.iter().sum::<f64>();
    let shades = &face.shades[..face.count];
    let middle_shade = share * shades.iter().sum::<f64>();
    for k in 0..face.count {
        let next = (k + 1) % face.count;
        let (a, b) = (corners[k], corners[next]);
        let cross = |p: [f64; 3], q: [f64; 3], x: f64, y: f64| (q[0] - p[0]) * (y - p[1]) - (x - p[0]) * (q[1] - p[1]);
        let area = cross(a, b, c[0], c[1]);
        if area.abs() < 1e-12 {
            continue;
        }
        // Distance from the face's edge, which is this triangle's side opposite the centre.
        let edge_distance = area.abs() / (b[0] - a[0]).hypot(b[1] - a[1]);
        let values = [values[k], values[next], middle_value];
        let shades = [shades[k], shades[next], middle_shade];
        let (left, right) = extent([a[0], b[0], c[0]]);
        let (top, bottom) = extent([a[1], b[1], c[1]]);
        for y in window.span_y(top, bottom) {
            for x in window.span_x(left, right) {
                let (px, py) = (x as f64 + 0.5, y as f64 + 0.5);
                let w = [cross(b, c, px, py) / area, cross(c, a, px, py) / area, cross(a, b, px, py) / area];
                // The tolerance avoids gaps between neighbouring triangles.
                if w.iter().any(|w| *w < -1e-9) {
                    continue;
                }
                let depth = (w[0] * a[2] + w[1] * b[2] + w[2] * c[2]) as f32;
                let i = window.index(x, y);
                if depth < layer.depth[i] {
                    layer.depth[i] = depth;
                    let on_edge = w[2] * edge_distance < sheet.edge_radius;
                    let value = w[0] * values[0] + w[1] * values[1] + w[2] * values[2];
                    let shade = (w[0] * shades[0] + w[1] * shades[1] + w[2] * shades[2]) as f32;
                    let light = sheet.palette.light(value).map(|v| v * shade);
                    layer.light[i] = if on_edge { mark(light, face.edge) } else { light };
                }
            }
        }
    }
}

/// The light on an edge: dimmed, or brightened if the face is too dark for dimming to be visible.
fn mark(light: [f32; 3], strength: f32) -> [f32; 3] {
    // Weights of luminance, ITU-R BT.709.
    let luminance = 0.2126 * light[0] + 0.7152 * light[1] + 0.0722 * light[2];
    if luminance > 0.06 { light.map(|v| v * (1.0 - 0.7 * strength)) } else { light.map(|v| v + 0.08 * strength) }
}

fn trace(line: &Line, lift: f64, window: &Window, layer: &mut Layer) {
    let (a, d) = (line.from, [line.to[0] - line.from[0], line.to[1] - line.from[1], line.to[2] - line.from[2]]);
    let square = d[0] * d[0] + d[1] * d[1];
    let (left, right) = extent([line.from[0], line.to[0]]);
    let (top, bottom) = extent([line.from[1], line.to[1]]);
    for y in window.span_y(top - line.radius, bottom + line.radius) {
        for x in window.span_x(left - line.radius, right + line.radius) {
            let p = [x as f64 + 0.5 - a[0], y as f64 + 0.5 - a[1]];
            let t = if square > 0.0 { ((p[0] * d[0] + p[1] * d[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
            if (p[0] - t * d[0]).hypot(p[1] - t * d[1]) > line.radius {
                continue;
            }
            let depth = (a[2] + t * d[2] - lift) as f32;
            let i = window.index(x, y);
            if depth < layer.depth[i] {
                layer.depth[i] = depth;
                layer.light[i] = line.light;
            }
        }
    }
}

/// Blends translucent layers over the picture, the farthest first.
fn look_through(picture: &mut Layer, glass: &[(f32, Layer)]) {
    let mut order: Vec<usize> = Vec::with_capacity(glass.len());
    for i in 0..picture.light.len() {
        order.clear();
        order.extend((0..glass.len()).filter(|&g| glass[g].1.depth[i] < picture.depth[i]));
        order.sort_by(|&a, &b| glass[b].1.depth[i].total_cmp(&glass[a].1.depth[i]));
        for &g in &order {
            let (opacity, layer) = &glass[g];
            for c in 0..3 {
                picture.light[i][c] += opacity * (layer.light[i][c] - picture.light[i][c]);
            }
        }
    }
}

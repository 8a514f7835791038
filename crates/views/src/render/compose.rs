//! Converts a scene to faces, lines and ink.

use super::RenderError;
use super::colour::{Colour, Palette};
use super::ink::{Align, Ink, Type};
use super::legend::{ColourBar, number, round_step};
use super::picture::Canvas;
use super::raster::{Drawing, Face, Line, Sheet};
use super::scene::{Layer, Paint, Scene, Style};
use super::skin::{SkinFace, corner_normals, outline, skin, wire};
use super::space::{Vector, cross, dot, subtract, unit};
use super::view::{Camera, Rectangle};

/// Edges of a box as corner numbers, whose bits indicate which coordinates are the larger ones.
const BOX_EDGES: [[usize; 2]; 12] =
    [[0, 1], [0, 2], [0, 4], [1, 3], [1, 5], [2, 3], [2, 6], [3, 7], [4, 5], [4, 6], [5, 7], [6, 7]];

/// Directions to the lights, to the right, up and towards the eye, and their shares: a key light, and a weaker one
/// from the other side.
const LIGHTS: [(Vector, f64); 2] = [([-0.35, 0.6, 0.75], 0.5), ([0.8, 0.1, 0.5], 0.15)];

/// Light from everywhere, and from above.
const AMBIENT: [f64; 2] = [0.2, 0.25];

/// How far surfaces shade each other, relative to the shorter side of the picture.
const OCCLUSION: f64 = 0.06;

/// The faces of the undeformed shape behind the deformed one.
const GHOST: Colour = Colour([246, 247, 249]);

pub(super) fn drawing(scene: &Scene<'_>, canvas: &Canvas) -> Result<Drawing, RenderError> {
    let mut drawing = canvas.drawing();
    let text = Type { unit: canvas.unit(), colour: Colour::INK };
    let frame = furnish(scene, canvas, text, &mut drawing.inks);
    let shown: Vec<&Layer<'_>> =
        scene.layers.iter().filter(|l| l.style != Style::Hidden && !l.cells.is_empty()).collect();
    let surfaces: Vec<&(Vec<SkinFace>, Colour)> =
        scene.surfaces.iter().filter(|(faces, _)| !faces.is_empty()).collect();
    if shown.is_empty() && surfaces.is_empty() {
        text.fitting(&scene.note, frame.width()).write(&scene.note, frame.centre(), Align::Centre, &mut drawing.inks);
    }
    let skins: Vec<Vec<SkinFace>> = shown.iter().map(|layer| skin(scene.elements, &layer.cells)).collect();
    let all = skins.iter().chain(surfaces.iter().map(|(faces, _)| faces));
    let visible = all.flatten().flat_map(|face| &face.nodes).map(|&n| scene.points[n as usize]);
    let corners = scene.boxes.iter().flat_map(|b| (0..8).map(|k| corner(b, k)));
    let s = f64::from(canvas.supersampling);
    let samples =
        Rectangle { left: s * frame.left, top: s * frame.top, right: s * frame.right, bottom: s * frame.bottom };
    let tips = scene.arrows.iter().flat_map(|(from, to, _)| [*from, *to]).chain(scene.chains.iter().flatten().copied());
    let ghosts = scene
        .ghosts
        .iter()
        .flat_map(|(points, faces)| faces.iter().flat_map(|face| &face.nodes).map(|&node| points[node as usize]));
    let Some(camera) = Camera::framing(scene.view, visible.chain(corners).chain(tips).chain(ghosts), samples) else {
        return Ok(drawing);
    };
    // Large enough for a line on a face seen at a grazing angle, small enough not to show through a
    // plate.
    drawing.lift = 0.004 * samples.width().max(samples.height());
    if scene.shaded {
        drawing.occlusion = OCCLUSION * f64::from(canvas.width.min(canvas.height));
    }
    let brush = Brush { scene, camera, samples: s, unit: s * text.unit };
    for (layer, skin) in shown.iter().zip(&skins) {
        drawing.sheets.push(brush.sheet(layer, skin)?);
    }
    for (faces, colour) in surfaces {
        let layer = Layer { cells: Vec::new(), paint: Paint::Plain(*colour), style: Style::Solid, edges: false };
        drawing.sheets.push(brush.sheet(&layer, faces)?);
    }
    for (points, faces) in &scene.ghosts {
        drawing.sheets.push(brush.ghost(points, faces));
    }
    drawing.sheets.push(brush.chains());
    drawing.sheets.push(brush.boxes());
    drawing.sheets.push(brush.arrows());
    let whole = Rectangle { left: 0.0, top: 0.0, right: f64::from(canvas.width), bottom: f64::from(canvas.height) };
    brush.labels(whole, text, &drawing.sheets, &mut drawing.inks);
    if let Some(unit) = &scene.length_unit {
        let at = [frame.left, f64::from(canvas.height) - 9.0 * text.unit];
        scale_bar(brush.camera.scale / s, unit, at, text, &mut drawing.inks);
    }
    Ok(drawing)
}

/// Draws caption, colour bar and axes; returns the remaining frame for the cells. \[pixels\]
fn furnish(scene: &Scene<'_>, canvas: &Canvas, text: Type, inks: &mut Vec<Ink>) -> Rectangle {
    let margin = 7.0 * text.unit;
    let mut frame = Rectangle {
        left: margin,
        top: margin,
        right: f64::from(canvas.width) - margin,
        bottom: f64::from(canvas.height) - margin,
    };
    for caption in scene.caption.iter().flat_map(|caption| caption.split('\n')) {
        let centre = [frame.centre()[0], frame.top + 0.5 * text.height()];
        text.fitting(caption, frame.width()).write(caption, centre, Align::Centre, inks);
        frame.top += text.height() + margin;
    }
    let bar = scene.scale.as_ref().map(|scale| ColourBar::new(scale, text));
    let axes = if scene.axes { 30.0 * text.unit } else { 0.0 };
    let column = bar.as_ref().map_or(0.0, ColourBar::width).max(axes);
    let inner = Rectangle { left: frame.right - column, ..frame };
    if let Some(bar) = bar {
        let bottom = frame.bottom - 1.6 * axes;
        let height = (0.75 * (bottom - frame.top)).max(0.0);
        bar.draw(Rectangle { top: bottom - height, bottom, ..inner }, inks);
    }
    if scene.axes {
        let origin = [inner.left + 0.5 * axes, frame.bottom - 0.5 * axes];
        draw_axes(scene, origin, text, inks);
    }
    if column > 0.0 {
        frame.right = inner.left - margin;
    }
    if scene.length_unit.is_some() {
        frame.bottom -= text.height() + margin;
    }
    if !scene.labels.is_empty() {
        // labels stand at the start of arrows, of which many are at the border of what is shown
        frame.top += text.height() + margin;
        frame.left += 2.0 * margin;
        frame.right -= 2.0 * margin;
    }
    frame
}

/// A line of a round length, near 60 units of the text's size, with its name.
fn scale_bar(pixels: f64, unit: &str, [left, middle]: [f64; 2], text: Type, inks: &mut Vec<Ink>) {
    let length = round_step(60.0 * text.unit / pixels);
    let right = left + length * pixels;
    let half = 2.0 * text.unit;
    for [from, to] in [
        [[left, middle], [right, middle]],
        [[left, middle - half], [left, middle + half]],
        [[right, middle - half], [right, middle + half]],
    ] {
        inks.push(Ink::stroke(from, to, 1.2 * text.unit, text.colour));
    }
    let name = format!("{} {unit}", number(length, length, length));
    text.write(&name, [right + 5.0 * text.unit, middle], Align::Left, inks);
}

/// Arrows along x, y and z, the farthest first; an axis parallel to the view direction is left out.
fn draw_axes(scene: &Scene<'_>, origin: [f64; 2], text: Type, inks: &mut Vec<Ink>) {
    let mut axes: Vec<(&str, Vector)> = [("x", [1.0, 0.0, 0.0]), ("y", [0.0, 1.0, 0.0]), ("z", [0.0, 0.0, 1.0])]
        .map(|(name, direction)| (name, scene.view.components(direction)))
        .into_iter()
        .filter(|(_, at)| at[0].hypot(at[1]) > 0.2)
        .collect();
    axes.sort_by(|a, b| a.1[2].total_cmp(&b.1[2]));
    let at = |direction: Vector, length: f64| [origin[0] + length * direction[0], origin[1] - length * direction[1]];
    for (name, direction) in axes {
        let long = direction[0].hypot(direction[1]);
        inks.push(Ink::stroke(origin, at(direction, 11.0 * text.unit), 0.8 * text.unit, text.colour));
        text.write(name, at(direction, (11.0 + 5.0 / long) * text.unit), Align::Centre, inks);
    }
}

fn corner(bounds: &[Vector; 2], number: usize) -> Vector {
    std::array::from_fn(|c| bounds[number >> c & 1][c])
}

/// Draws layers of a scene.
struct Brush<'a> {
    scene: &'a Scene<'a>,
    camera: Camera,
    /// Samples per pixel and direction.
    samples: f64,
    /// Size of a unit of the font. \[samples\]
    unit: f64,
}

impl Brush<'_> {
    fn sheet(&self, layer: &Layer<'_>, skin: &[SkinFace]) -> Result<Sheet, RenderError> {
        let filled = matches!(layer.style, Style::Solid | Style::Translucent(_));
        let palette = match (layer.paint, &self.scene.scale) {
            (Paint::Plain(colour), _) => Palette::plain(colour),
            (_, Some(scale)) => Palette::scale(scale),
            (_, None) if filled => return Err(RenderError::NoScale),
            (_, None) => Palette::plain(Colour::GREY),
        };
        let colour = if let Paint::Plain(colour) = layer.paint { colour } else { Colour::GREY };
        let eye = self.eye();
        let (pairs, width) = match layer.style {
            Style::Wire => (wire(skin, &self.scene.points, eye), 0.35),
            Style::Outline => (outline(skin, &self.scene.points, eye), 0.6),
            _ => (Vec::new(), 0.0),
        };
        let lines = pairs.iter().map(|pair| {
            let [from, to] = pair.map(|n| self.scene.points[n as usize]);
            self.line(from, to, width, colour)
        });
        let smooth = (filled && self.scene.shaded && !layer.edges).then(|| corner_normals(skin, &self.scene.points));
        let shaded = skin.iter().enumerate().filter(|_| filled);
        let faces = shaded.filter_map(|(f, face)| self.face(layer, face, smooth.as_ref().map(|all| &all[f])));
        let opacity = if let Style::Translucent(opacity) = layer.style { opacity.clamp(0.0, 1.0) } else { 1.0 };
        Ok(Sheet {
            palette,
            opacity: opacity as f32,
            behind: false,
            edge_radius: 0.25 * self.unit,
            faces: faces.collect(),
            lines: lines.collect(),
        })
    }

    fn eye(&self) -> Vector {
        let toward = |direction| self.camera.view.components(direction)[2];
        [toward([1.0, 0.0, 0.0]), toward([0.0, 1.0, 0.0]), toward([0.0, 0.0, 1.0])]
    }

    /// The projected face, lit by its own normal or by those at its corners; `None` if it points away from the eye.
    fn face(&self, layer: &Layer<'_>, face: &SkinFace, normals: Option<&[Vector; 4]>) -> Option<Face> {
        let flat = face.normal(&self.scene.points);
        if self.camera.view.components(flat)[2] <= 0.0 {
            return None;
        }
        let count = face.nodes.len();
        let node = |k: usize| face.nodes[k.min(count - 1)];
        let corners = std::array::from_fn(|k| self.camera.project(self.scene.points[node(k) as usize]));
        let values = match layer.paint {
            Paint::Plain(_) => [0.0; 4],
            Paint::Cells(values) => [values[face.cell as usize]; 4],
            Paint::Points(values) => std::array::from_fn(|k| values[node(k) as usize]),
        };
        let shade = |k: usize| if self.scene.shaded { self.light(normals.map_or(flat, |all| all[k])) } else { 1.0 };
        let edge = if layer.edges { self.edge_strength(&corners[..count]) } else { 0.0 };
        Some(Face { corners, count, values, shades: std::array::from_fn(shade), edge: edge as f32 })
    }

    /// The light on a face with this normal, 0 to 1: Lambert's law for each light, and a part that no face lacks.
    fn light(&self, normal: Vector) -> f64 {
        let normal = self.camera.view.components(normal);
        let up = self.camera.view.components([0.0, 1.0, 0.0]);
        let lights = LIGHTS.iter().map(|(direction, share)| share * dot(normal, unit(*direction)).max(0.0));
        let light = AMBIENT[0] + AMBIENT[1] * 0.5 * (1.0 + dot(normal, up)) + lights.sum::<f64>();
        light.min(1.0)
    }

    /// From 0 for faces of 3 pixels to 1 for those of 12 and more.
    fn edge_strength(&self, corners: &[Vector]) -> f64 {
        let count = corners.len();
        let side = |k: usize| subtract(corners[(k + 1) % count], corners[k]);
        let mean = (0..count).map(side).map(|d| d[0].hypot(d[1])).sum::<f64>() / count as f64;
        ((mean / self.samples - 3.0) / 9.0).clamp(0.0, 1.0)
    }

    fn line(&self, from: Vector, to: Vector, width: f64, colour: Colour) -> Line {
        Line {
            from: self.camera.project(from),
            to: self.camera.project(to),
            radius: 0.5 * width * self.unit,
            light: colour.linear(),
        }
    }

    /// A shaft, and a head of four strokes.
    fn arrows(&self) -> Sheet {
        let mut lines = Vec::new();
        for &(from, to, colour) in &self.scene.arrows {
            let along = subtract(to, from);
            let length = dot(along, along).sqrt();
            let axis = if along[0].abs() < 0.5 * length { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
            let across = unit(cross(along, axis));
            let other = unit(cross(along, across));
            lines.push(self.line(from, to, 1.2, colour));
            for (side, sign) in [(across, 1.0), (across, -1.0), (other, 1.0), (other, -1.0)] {
                let barb = std::array::from_fn(|c| to[c] - 0.25 * along[c] + 0.12 * sign * length * side[c]);
                lines.push(self.line(to, barb, 1.2, colour));
            }
        }
        Sheet {
            palette: Palette::plain(Colour::INK),
            opacity: 1.0,
            behind: false,
            edge_radius: 0.0,
            faces: Vec::new(),
            lines,
        }
    }

    /// Pale faces and their outline, behind everything else.
    fn ghost(&self, points: &[Vector], skin: &[SkinFace]) -> Sheet {
        let lines = outline(skin, points, self.eye()).into_iter().map(|pair| {
            let [from, to] = pair.map(|n| points[n as usize]);
            self.line(from, to, 0.45, Colour::GREY)
        });
        let lines = lines.collect();
        let faces = skin.iter().filter(|face| self.camera.view.components(face.normal(points))[2] > 0.0);
        let face = |face: &SkinFace| {
            let count = face.nodes.len();
            let corner = |k: usize| self.camera.project(points[face.nodes[k.min(count - 1)] as usize]);
            Face { corners: std::array::from_fn(corner), count, values: [0.0; 4], shades: [1.0; 4], edge: 0.0 }
        };
        let faces = faces.map(face).collect();
        Sheet { palette: Palette::plain(GHOST), opacity: 1.0, behind: true, edge_radius: 0.0, faces, lines }
    }

    /// Dash-dotted lines, behind the bodies where these hide them.
    fn chains(&self) -> Sheet {
        let mut lines = Vec::new();
        for [from, to] in &self.scene.chains {
            let [a, b] = [from, to].map(|end| self.camera.project(*end));
            let length = (b[0] - a[0]).hypot(b[1] - a[1]);
            let mut done = 0.0;
            for part in [10.0, 3.0, 1.0, 3.0].iter().map(|part| part * self.unit).cycle().enumerate() {
                if done >= length {
                    break;
                }
                let end = (done + part.1).min(length);
                let at = |s: f64| std::array::from_fn(|c| a[c] + s / length * (b[c] - a[c]));
                if part.0 % 2 == 0 {
                    let light = Colour::GREY.linear();
                    lines.push(Line { from: at(done), to: at(end), radius: 0.3 * self.unit, light });
                }
                done = end;
            }
        }
        Sheet {
            palette: Palette::plain(Colour::GREY),
            opacity: 1.0,
            behind: false,
            edge_radius: 0.0,
            faces: Vec::new(),
            lines,
        }
    }

    /// Texts at the starts of arrows, at their ends or beside them, within the picture: where neither another arrow or
    /// text nor a body is, or at least no other arrow and text, or no text. Arrows that a body hides have no text.
    fn labels(&self, whole: Rectangle, text: Type, sheets: &[Sheet], inks: &mut Vec<Ink>) {
        let faces = || sheets.iter().filter(|sheet| !sheet.behind).flat_map(|sheet| &sheet.faces);
        // farther than the radius of an arrow
        let margin = 0.02 * self.samples * whole.width();
        let arrows: Vec<[Vector; 2]> =
            self.scene.labels.iter().map(|label| [label.at, label.from].map(|end| self.camera.project(end))).collect();
        let mut written: Vec<([f64; 2], f64)> = Vec::new();
        for (own, label) in self.scene.labels.iter().enumerate() {
            let [at, from] = [label.at, label.from].map(|end| self.camera.project(end));
            let middle: Vector = std::array::from_fn(|c| 0.5 * (at[c] + from[c]));
            let solid = sheets.iter().filter(|sheet| sheet.opacity >= 1.0 && !sheet.behind);
            if solid
                .flat_map(|sheet| &sheet.faces)
                .any(|face| face.depth(middle).is_some_and(|z| z < middle[2] - margin))
            {
                continue;
            }
            let half = 0.5 * text.width(&label.text);
            let place = |at: Vector, from: Vector| {
                let d = [at[0] - from[0], at[1] - from[1]];
                let length = d[0].hypot(d[1]).max(1e-9);
                let away = [half + 5.0 * text.unit, 0.5 * text.height() + 5.0 * text.unit];
                // as far from the end as the text needs in this direction
                let reach = (0..2).map(|c| away[c] / (d[c] / length).abs().max(1e-9)).fold(f64::INFINITY, f64::min);
                let [x, y] = [0, 1].map(|c| at[c] / self.samples + reach * d[c] / length);
                let high = text.height();
                [
                    x.clamp(whole.left + half, (whole.right - half).max(whole.left + half)),
                    y.clamp(whole.top + high, (whole.bottom - high).max(whole.top + high)),
                ]
            };
            // a point beside the middle of the arrow
            let beside =
                |side: f64| [middle[0] + side * (at[1] - from[1]), middle[1] - side * (at[0] - from[0]), middle[2]];
            let places = [place(at, from), place(from, at), place(middle, beside(1.0)), place(middle, beside(-1.0))];
            let [width, high] = [half + 6.0 * text.unit, 0.5 * text.height() + 6.0 * text.unit];
            let apart = |[x, y]: &[f64; 2]| {
                !written.iter().any(|(at, other)| {
                    (at[0] - x).abs() < half + other + 2.0 * text.unit && (at[1] - y).abs() < 1.2 * text.height()
                })
            };
            let alone = |place: &[f64; 2]| {
                let [x, y] = place;
                let covers = |arrow: &[Vector; 2]| {
                    (0..=20).any(|k| {
                        let part = f64::from(k) / 20.0;
                        let on = [0, 1].map(|c| (arrow[0][c] + part * (arrow[1][c] - arrow[0][c])) / self.samples);
                        (on[0] - x).abs() < width && (on[1] - y).abs() < high
                    })
                };
                let others = arrows.iter().enumerate().filter(|(other, _)| *other != own);
                apart(place) && !others.into_iter().any(|(_, arrow)| covers(arrow))
            };
            let clear = |[x, y]: &[f64; 2]| {
                let ends = [-1.0, 0.0, 1.0].map(|side| [self.samples * (x + side * half), self.samples * y, 0.0]);
                !faces().any(|face| ends.iter().any(|end| face.depth(*end).is_some()))
            };
            let chosen = places.iter().find(|place| alone(place) && clear(place));
            let chosen = chosen.or_else(|| places.iter().find(|place| alone(place)));
            let chosen = *chosen.or_else(|| places.iter().find(|place| apart(place))).unwrap_or(&places[0]);
            written.push((chosen, half));
            Type { colour: label.colour, ..text }.write(&label.text, chosen, Align::Centre, inks);
        }
    }

    fn boxes(&self) -> Sheet {
        let edges = self.scene.boxes.iter().flat_map(|b| BOX_EDGES.iter().map(move |e| e.map(|k| corner(b, k))));
        let lines = edges.map(|[from, to]| self.line(from, to, 0.5, Colour::GREY)).collect();
        Sheet {
            palette: Palette::plain(Colour::GREY),
            opacity: 1.0,
            behind: false,
            edge_radius: 0.0,
            faces: Vec::new(),
            lines,
        }
    }
}

//! Writes the case file for a survey.

use std::fmt::Write as _;

use nalgebra::Vector3;

use super::Step;
use super::survey::{Face, Part, Survey};
use slipstick_model::words::counted;

/// How far the bodies are pressed together, as a fraction of their extent along the contact normal.
const PRESS: f64 = 0.01;

/// How far the smaller body slides, as a fraction of its extent in that direction.
const SLIDE: f64 = 0.05;

/// Minimum cosine of the angle between a direction and the normal of a surface that faces that
/// direction.
const FACING: f64 = 0.5;

/// Side length of the block that is pressed onto a single body, as a fraction of the body's extent.
const BLOCK: f64 = 0.4;

const MATERIAL: &str = "material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }   # adapt";

/// What the case does with the bodies.
pub(super) struct Plan<'a> {
    pub(super) survey: &'a Survey,
    /// The body that is held and designed.
    pub(super) held: usize,
    /// The body that is moved; `None`: a block that the case adds.
    pub(super) driven: Option<usize>,
    /// Contact normal from the driven body towards the held one.
    pub(super) normal: Vector3<f64>,
    /// Whether the driven body has no pair with the held one that gives the direction, as a pin in a bore.
    pub(super) closed: bool,
    /// Tables `[[surface]]` and `[[set]]` that the other tables refer to.
    selections: String,
}

/// The text of the case.
pub fn case(survey: &Survey, file: &str, step: Option<&Step>) -> String {
    let mut plan = Plan::new(survey);
    let rest = plan.meeting();
    let mut text = head(file, step);
    for part in &survey.parts {
        body(&mut text, part, file);
    }
    if plan.driven.is_none() {
        plan.block(&mut text);
    }
    text + &plan.selections + &rest + &plan.design()
}

fn head(file: &str, step: Option<&Step>) -> String {
    let printable = |name: &str| name.replace(['"', '\\', '\n'], "_");
    let of = match step {
        None => {
            let name = printable(file);
            format!("the mesh {name}. Contact, supports and motion are guesses based on its geometry: correct them.")
        }
        Some(step) => format!(
            "{}, meshed in mm by {}. Contact, supports and motion are\n# guesses based on its geometry: correct them, and \
             set the materials.",
            printable(&step.file),
            printable(&step.script)
        ),
    };
    let units = match step {
        None => "# [units]                         # for display\n# length = \"mm\"\n# force = \"N\"\n",
        Some(_) => "[units]\nlength = \"mm\"\nforce = \"N\"\n",
    };
    let title = step.map_or(file, |step| &step.file);
    format!(
        "# A case for {of}\n#\n\
         #   slipstick check CASE       checks the case without running it; `check CASE --resolved` shows all defaults\n\
         #   slipstick optimize CASE    runs the optimization\n#\n\
         # Use any consistent system of units. y is up. All keys: docs/case_file.md, or `slipstick schema` for editors.\n\
         title = {}\n\n{units}",
        quoted(title.rsplit('/').next().unwrap_or(title))
    )
}

fn body(text: &mut String, part: &Part, file: &str) {
    let of = part.part.as_ref().map_or(String::new(), |part| format!(", part = {}", quoted(part)));
    let size = part.bounds.iter().fold(0.0, |size: f64, corner| size.max(corner.amax()));
    let [low, high] = part.bounds.map(|corner| corner.map(|x| rounded(short(x, size))));
    let elements = part.mesh.elements.len();
    let _ = write!(
        text,
        "\n# {} from ({}, {}, {}) to ({}, {}, {})\n",
        counted(elements, "element"),
        low.x,
        low.y,
        low.z,
        high.x,
        high.y,
        high.z
    );
    for face in part.faces.iter().filter(|face| face.selected.is_none()) {
        let direction = face.direction().map(|x| (100.0 * x).round() / 100.0 + 0.0);
        let [x, y, z] = [direction.x, direction.y, direction.z];
        let towards = if direction.norm() > 0.5 { format!(", normal ({x}, {y}, {z})") } else { String::new() };
        let _ = writeln!(
            text,
            "#   surface {}: {}, area {}{towards}",
            face.name,
            counted(face.facets(), "facet"),
            rounded(face.area())
        );
    }
    for (name, nodes) in &part.mesh.node_sets {
        let _ = writeln!(text, "#   node set {name}: {}", counted(nodes.len(), "node"));
    }
    let _ =
        write!(text, "[[body]]\nname = {}\nmesh = {{ file = {}{of} }}\n{MATERIAL}\n", quoted(&part.name), quoted(file));
}

impl<'a> Plan<'a> {
    fn new(survey: &'a Survey) -> Self {
        let normal = -Vector3::y();
        let mut plan = Self { survey, held: 0, driven: None, normal, closed: false, selections: String::new() };
        if !survey.pairs.is_empty() {
            plan.roles();
        } else if survey.parts.len() > 1 {
            plan.driven = Some(1);
            plan.normal = main_axis(plan.centre(0) - plan.centre(1));
        }
        // ignore deviations from an axis that are round-off of the mesh
        let axis = main_axis(plan.normal);
        if plan.normal.dot(&axis) > 0.999 {
            plan.normal = axis;
        }
        plan
    }

    pub(super) fn centre(&self, body: usize) -> Vector3<f64> {
        (self.survey.parts[body].bounds[0] + self.survey.parts[body].bounds[1]) / 2.0
    }

    /// The name of the block that is pressed onto a single body.
    pub(super) fn tool(&self) -> &'static str {
        if self.survey.parts[self.held].name == "block" { "tool" } else { "block" }
    }

    /// The surface of a single body that faces upward the most.
    pub(super) fn top(&self) -> Option<&'a Face> {
        let part = &self.survey.parts[self.held];
        let upwards = |face: &Face| face.centre().y + face.direction().y * self.extent();
        let top = best(part.faces.iter(), upwards);
        top.filter(|face| self.driven.is_none() && face.direction().y > 0.5)
    }

    /// The block that is pressed onto a single body from above: over its whole top, or over the
    /// named surface that it touches.
    fn block(&self, text: &mut String) {
        let part = &self.survey.parts[self.held];
        let [low, high] = match self.top().filter(|face| face.selected.is_none()) {
            Some(face) => part.bounds_of(face),
            None => part.bounds,
        };
        let (centre, extent) = ((low + high) / 2.0, high - low);
        let half = BLOCK / 2.0 * extent;
        let height = 0.5 * (half.x + half.z);
        let size = part.bounds.iter().fold(0.0, |size: f64, corner| size.max(corner.amax()));
        let count = |length: f64| (length / part.element_size()).ceil().clamp(2.0, 12.0) as usize;
        let _ = write!(
            text,
            "\n# The file has one body. This block is pressed onto it; replace it by your tool.\n[[body]]\nname = \"{}\"\n\
             box = {{ min = [{:?}, {:?}, {:?}], max = [{:?}, {:?}, {:?}], elements = [{}, {}, {}] }}\n{MATERIAL}\n",
            self.tool(),
            rounded(centre.x - half.x),
            short(high.y, size),
            rounded(centre.z - half.z),
            rounded(centre.x + half.x),
            short(high.y + rounded(height), size),
            rounded(centre.z + half.z),
            count(2.0 * half.x),
            count(height),
            count(2.0 * half.z),
        );
    }

    /// Contact, supports, motion and load path.
    fn meeting(&mut self) -> String {
        let mut text = self.contact();
        let far = self.far_side(self.held, self.normal);
        let _ =
            write!(text, "\n[[dirichlet]]                     # no motion given: held fixed\nset = {}\n", quoted(&far));
        let (held, driven) = (self.held, self.driven);
        for further in (0..self.survey.parts.len()).filter(|&body| body != held && Some(body) != driven) {
            let why = match self.survey.pairs.iter().filter(|pair| pair.has(further)).count() {
                0 => "another body, which may need a [[contact]]",
                1 => "another body",
                // only contact holds a body between others, such as the pin of a clevis
                _ => continue,
            };
            let set = self.far_side(further, self.normal);
            let _ = write!(text, "\n[[dirichlet]]                     # {why}\nset = {}\n", quoted(&set));
        }
        let driven = match self.driven {
            Some(body) if self.closed => self.driven_sides(body),
            Some(body) => vec![self.far_side(body, -self.normal)],
            None => vec![format!("{}_ymax", self.tool())],
        };
        let [press, slide] = self.motion();
        let shown = |u: Vector3<f64>| vector(u, u.amax());
        for set in driven {
            let _ = write!(
                text,
                "\n[[dirichlet]]                     # waypoints in pseudo-time 0 … 1\nset = {}\n",
                quoted(&set)
            );
            let _ = match slide == Vector3::zeros() {
                true => writeln!(text, "motion = [{{ t = 1.0, u = {} }}]   # pressed together", shown(press)),
                false => writeln!(
                    text,
                    "motion = [\n    {{ t = 0.5, u = {} }},   # pressed together,\n    {{ t = 1.0, u = {} }},   # then \
                     slid\n]",
                    shown(press),
                    shown(press + slide),
                ),
            };
        }
        text + "\n[load_path]\nsteps = 10\n"
    }

    pub(super) fn extent(&self) -> f64 {
        let [low, high] = self.survey.parts[self.held].bounds;
        (high - low).norm()
    }

    /// The name of a surface; the case selects it if the file does not name it.
    pub(super) fn use_face(&mut self, [body, face]: [usize; 2]) -> String {
        let part = &self.survey.parts[body];
        let face = &part.faces[face];
        match face.selected {
            Some(direction) => self.skin(body, direction.into()),
            None => face.name.clone(),
        }
    }

    /// A `[[surface]]`: the skin of a body that faces a direction.
    pub(super) fn skin(&mut self, body: usize, direction: Vector3<f64>) -> String {
        let part = &self.survey.parts[body];
        let towards = ["x", "y", "z"][direction.iamax()];
        let end = if direction[direction.iamax()] > 0.0 { "max" } else { "min" };
        let mut name = format!("{}_{towards}{end}", part.name);
        while part.mesh.surfaces.contains_key(&name) || part.mesh.node_sets.contains_key(&name) {
            name.push_str("_skin");
        }
        let table = format!("name = {}\n", quoted(&name));
        if !self.selections.contains(&table) {
            let [x, y, z] = [direction.x, direction.y, direction.z].map(rounded);
            let _ = write!(
                self.selections,
                "\n[[surface]]\n{table}body = {}\nnormal = {{ direction = [{x:?}, {y:?}, {z:?}], degrees = 45.0 }}\n",
                quoted(&part.name)
            );
        }
        name
    }

    /// A named surface at which the body is probably held or moved: the one furthest along a
    /// direction and facing it, otherwise the largest plane one; if there is none, the nodes
    /// furthest along that direction.
    pub(super) fn far_side(&mut self, body: usize, direction: Vector3<f64>) -> String {
        let part = &self.survey.parts[body];
        let [low, high] = part.range(&direction);
        let mut contact = self.contact_faces(body);
        if self.survey.pairs.is_empty() {
            contact.extend(self.top().into_iter().filter(|_| body == self.held));
        }
        let apart = |face: &&Face| {
            let shares = |other: &&Face| other.nodes.iter().any(|node| face.nodes.binary_search(node).is_ok());
            face.selected.is_none() && !contact.iter().any(shares)
        };
        let along = |face: &Face| face.centre().dot(&direction);
        let far = |face: &&Face| along(face) > 0.25 * low + 0.75 * high && face.direction().dot(&direction) > FACING;
        let named = || part.faces.iter().filter(apart);
        let plane = named().filter(|face| face.is_plane());
        // faces that have an edge in common with the contact, such as the end of a rod
        let within = |face: &Face| contact.iter().any(|other| face.is_within(other));
        let beside = || part.faces.iter().filter(|face| face.selected.is_none() && face.is_plane() && !within(face));
        let chosen = best(named().filter(far), along).or_else(|| best(plane, Face::area));
        if let Some(face) = chosen.or_else(|| best(beside().filter(far), along)) {
            return face.name.clone();
        }
        let mut name = format!("{}_far", part.name);
        while part.mesh.surfaces.contains_key(&name) || part.mesh.node_sets.contains_key(&name) {
            name.push_str("_side");
        }
        let [x, y, z] = [direction.x, direction.y, direction.z].map(|x| rounded(short(x, 1.0)));
        let point = direction * high;
        let tolerance = rounded((0.1 * (high - low)).min(0.6 * part.element_size()));
        let size = part.bounds.iter().fold(0.0, |size: f64, corner| size.max(corner.amax()));
        let _ = write!(
            self.selections,
            "\n# the nodes on the far side of {}\n[[set]]\nname = {}\nbody = {}\n\
             plane = {{ point = {}, normal = [{x:?}, {y:?}, {z:?}], tolerance = {tolerance:?} }}\n",
            part.name,
            quoted(&name),
            quoted(&part.name),
            vector(point, size)
        );
        name
    }

    /// Displacements: first to close the gap and press, then to slide.
    fn motion(&self) -> [Vector3<f64>; 2] {
        let parts = &self.survey.parts;
        let extent = |body: usize, direction: &Vector3<f64>| {
            let [low, high] = parts[body].range(direction);
            high - low
        };
        let gap = match (self.survey.pairs.first(), self.driven) {
            (Some(_), Some(driven)) => self.gap(driven).max(0.0),
            (None, Some(driven)) => {
                let [near, far] = [parts[self.held].range(&self.normal)[0], parts[driven].range(&self.normal)[1]];
                (near - far).max(0.0)
            }
            (_, None) => 0.0,
        };
        // slide along the longest direction of the held body that is perpendicular to the normal
        let across = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| axis - axis.dot(&self.normal) * self.normal);
        let lengths = across.map(|direction| direction.norm() * extent(self.held, &direction));
        let longest = (0..3).fold(0, |best, c| if lengths[c] > 1.000_001 * lengths[best] { c } else { best });
        let along = across[longest].try_normalize(1e-9).unwrap_or_else(Vector3::x);
        let (thickness, width) = match self.driven {
            Some(driven) => (extent(driven, &self.normal).min(extent(self.held, &self.normal)), extent(driven, &along)),
            None => (extent(self.held, &self.normal), BLOCK * extent(self.held, &along)),
        };
        let slide = if self.blocked(&along) { 0.0 } else { SLIDE * width };
        let round = |u: Vector3<f64>| u.map(rounded);
        [round((gap + PRESS * thickness) * self.normal), round(slide * along)]
    }

    fn design(&self) -> String {
        let part = &self.survey.parts[self.held];
        format!(
            "\n[design]\nbodies = [{}]\nvolume_fraction = 0.4\n\
             density_filter = {{ radius = {:?} }}     # averages the variables over about 1.6 elements\n\
             projection = {{}}     # pushes the averages towards 0 and 1; the schedule below raises its sharpness\n\
             # passive_solid = [{{ min = [0, 0, 0], max = [1, 1, 1] }}]   # elements with their centroid in here stay solid\n\n\
             [objective]\n# θ is minus the sum of the magnitudes of the nodal contact forces, friction included.\n\
             contact_force = {{ steps = \"last\" }}     # or \"all\", or a list of steps\n\n[optimizer]\niterations = 40\n\
             schedule = {{ sharpness = [[0, 1], [10, 2], [17, 4], [24, 8], [31, 16]] }}     # from these iterations on\n",
            quoted(&part.name),
            rounded(1.6 * part.element_size())
        )
    }
}

pub(super) fn face_index(part: &Part, face: &Face) -> usize {
    part.faces.iter().position(|other| std::ptr::eq(other, face)).unwrap_or(0)
}

fn best<'f>(faces: impl Iterator<Item = &'f Face>, worth: impl Fn(&Face) -> f64) -> Option<&'f Face> {
    faces.max_by(|a, b| worth(a).total_cmp(&worth(b)))
}

/// The axis that a direction is nearest to.
pub(super) fn main_axis(direction: Vector3<f64>) -> Vector3<f64> {
    let c = direction.iamax();
    let mut axis = Vector3::zeros();
    axis[c] = if direction[c] < 0.0 { -1.0 } else { 1.0 };
    axis
}

/// Rounded to three digits.
pub(super) fn rounded(x: f64) -> f64 {
    let rounded = format!("{x:.2e}").parse().unwrap_or(x);
    if rounded == 0.0 { 0.0 } else { rounded }
}

/// A number rounded to a billionth of `size`, which is less than the smallest penetration that
/// counts.
fn short(x: f64, size: f64) -> f64 {
    let decimals = (9.0 - size.log10().ceil()).clamp(0.0, 60.0) as usize;
    let rounded = format!("{x:.decimals$}").parse().unwrap_or(x);
    if rounded == 0.0 { 0.0 } else { rounded }
}

/// A TOML vector, each component as [`short`] writes it.
fn vector(v: Vector3<f64>, size: f64) -> String {
    let [x, y, z] = [v.x, v.y, v.z].map(|x| short(x, size));
    format!("[{x:?}, {y:?}, {z:?}]")
}

/// A TOML string.
pub(super) fn quoted(text: &str) -> String {
    toml::Value::from(text).to_string()
}

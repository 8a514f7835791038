//! Writes a short case for a deck: the design, objective and quantities that a deck does not have.

use std::fmt::Write as _;

use super::{Body, Case, Shape};

/// A case that refers to the deck `file` from which `case` was read.
pub fn design_of_deck(case: &Case, file: &str, ignored: &[String]) -> String {
    let quoted = |text: &str| toml::Value::from(text).to_string();
    let list = |names: &[String]| names.iter().map(|name| quoted(name)).collect::<Vec<_>>().join(", ");
    let ignore = if ignored.is_empty() { String::new() } else { format!(", ignore = [{}]", list(ignored)) };
    let mut text = format!(
        "# A design for the deck {}. Design, objective and quantities are guesses: adapt them.\n#\n\
         #   slipstick check CASE              shows how each keyword of the deck is treated\n\
         #   slipstick check CASE --resolved   prints the case with all tables of the deck, to be edited\n\
         #   slipstick solve CASE              analyses the solid parts\n\
         #   slipstick optimize CASE           runs the optimization\n#\n\
         # Tables of this file are added to those of the deck; `--set 'contact[0].friction = 0.1'` changes\n\
         # one of these for a run. All keys: docs/case_file.md\n\
         deck = {{ file = {}{ignore} }}\n",
        file.replace(['"', '\\', '\n'], "_"),
        quoted(file)
    );
    let _ = writeln!(
        text,
        "\n# load steps, instead of the {} that the deck asks for\n# [load_path]\n# steps = {}",
        case.load_path.steps,
        2 * case.load_path.steps
    );
    for set in case.dirichlet.iter().filter(|held| !held.motion.is_empty()).take(1).map(|held| &held.set) {
        let moving = case.dirichlet.iter().find(|held| held.set == *set && !held.motion.is_empty());
        let end = moving.and_then(|held| held.motion.last()).map_or([0.0; 3], |point| point.u);
        let c = (0..3).fold(0, |best, c| if end[c].abs() > end[best].abs() { c } else { best });
        let _ = write!(
            text,
            "\n[[quantity]]\nname = \"reaction\"\nreaction = {{ set = {}, component = \"{}\" }}\n",
            quoted(set),
            ["x", "y", "z"][c]
        );
    }
    for pair in case.contacts.iter().filter(|pair| !pair.tied).take(1) {
        let slave = quoted(&pair.slave);
        let _ = write!(
            text,
            "\n[[quantity]]\nname = \"contact_force\"\ncontact_force = {{ slave = {slave}, component = \"normal\" }}\n"
        );
    }
    let Some(body) = largest(case) else { return text };
    let size = body.element_size();
    let _ = write!(
        text,
        "\n[design]\nbodies = [{}]\nvolume_fraction = 0.5\n\
         density_filter = {{ radius = {:?} }}     # averages the variables over about 1.6 elements\n\
         projection = {{}}\n\
         # passive_solid = [{{ min = [0, 0, 0], max = [1, 1, 1] }}]   # elements with their centroid in here stay solid\n",
        quoted(body.name),
        rounded(1.6 * size)
    );
    let objective = match (case.loads.is_empty(), case.contacts.iter().any(|pair| !pair.tied)) {
        (false, _) => "compliance = {}     # the work of the loads; the stiffest part",
        (true, true) => "maximise = { quantity = \"contact_force\" }",
        (true, false) => "maximise = { quantity = \"reaction\" }",
    };
    let _ = write!(
        text,
        "\n[objective]\n{objective}\n\n[optimizer]\niterations = 40\n\
         schedule = {{ sharpness = [[0, 1], [10, 2], [17, 4], [24, 8], [31, 16]] }}\n"
    );
    text
}

/// A body to be designed.
struct Designed<'a> {
    name: &'a str,
    volume: f64,
    elements: usize,
}

impl Designed<'_> {
    fn element_size(&self) -> f64 {
        (self.volume / self.elements.max(1) as f64).cbrt()
    }
}

/// The largest deformable body.
fn largest(case: &Case) -> Option<Designed<'_>> {
    let designed = |body: &Body| body.rigid.is_none() && !body.material.kind().has_memory();
    let of = |body: &'_ Body| match &body.shape {
        Shape::Mesh(mesh) => Some((mesh.mesh.element_volumes().iter().sum(), mesh.mesh.elements.len())),
        _ => None,
    };
    let bodies = case.bodies.iter().filter(|body| designed(body));
    let bodies =
        bodies.filter_map(|body| of(body).map(|(volume, elements)| Designed { name: &body.name, volume, elements }));
    bodies.max_by(|a, b| a.volume.total_cmp(&b.volume))
}

/// Rounded to three digits.
fn rounded(x: f64) -> f64 {
    format!("{x:.2e}").parse().unwrap_or(x)
}

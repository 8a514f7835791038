//! Bodies (`[[body]]`).

use super::super::CaseCode;
use super::super::document::Table;
use super::super::names::Names;
use super::super::resolved::{
    AxesAbout, Body, BodySection, Formulation, LawKind, Material, Placement, Rigid, Rotate, Shape, ShapeFunctions,
};
use super::common::{direction, name};
use super::mesh_file::{MeshFiles, mesh_file};
use super::shaping::{OF_BODY, region};
use slipstick_mesh as mesh;
use slipstick_solid::{Constant, Form, MaterialError, Range, Value};

const SHAPES: &[&str] = &["box", "ball", "half_ball", "cone", "hollow_cylinder", "half_ring", "torus", "mesh"];
/// Placeholder for a shape that cannot be read.
const STAND_IN: Shape = Shape::Box { min: [0.0; 3], max: [1.0; 3], elements: [1; 3], grading: [1.0; 3] };
/// Limit on the number of elements; no run can hold more.
const MOST_ELEMENTS: usize = 1_000_000;

pub(super) fn bodies(root: &Table<'_>, names: &mut Names, files: &MeshFiles<'_>) -> Vec<Body> {
    let tables = root.tables("body");
    let help = "add a [[body]] with a name, a shape and a material";
    root.require("body", help);
    if tables.is_empty() {
        if root.value("body").is_some_and(|value| value.get_ref().as_array().is_some_and(|list| list.is_empty())) {
            root.reader.error("body", CaseCode::Empty, "`body` lists no body", help);
        }
        names.excuse_all();
    }
    let mut bodies: Vec<Body> = tables.into_iter().map(|table| body(table, names, files)).collect();
    // the designed bodies of a part have files of their own
    if root.value("promise").is_none() {
        files.warn_of_unused(root.reader);
    }
    // nothing but the default stiffness of contact depends on the material of a rigid body
    let deformable = bodies.iter().filter(|body| body.rigid.is_none()).map(|body| body.material);
    let stiffest = deformable.max_by(|a, b| a.youngs_modulus().total_cmp(&b.youngs_modulus()));
    match stiffest {
        Some(stiffest) => {
            bodies.iter_mut().filter(|body| body.rigid.is_some()).for_each(|body| body.material = stiffest);
        }
        None if !bodies.is_empty() => {
            let help = "at least one body needs a `material`; a rigid body has no stiffness";
            root.reader.error("body", CaseCode::Empty, "all bodies are rigid", help);
        }
        None => {}
    }
    bodies
}

fn body(table: Table<'_>, names: &mut Names, files: &MeshFiles<'_>) -> Body {
    let name = name(&table);
    let shape = shape(&table, &name, files);
    names.add_body(table.reader, &table.path_of("name"), &name, shape.as_ref());
    let place = table.table("place").map(place).unwrap_or_default();
    let rigid = table.table("rigid").map(|table| {
        let reference = table.vector("reference").optional();
        table.finish();
        Rigid { reference }
    });
    if rigid.is_some() {
        let body = names.body(&name);
        names.add_set(table.reader, table.path(), &name, body);
    }
    let (material, sections) = match rigid {
        Some(_) => (none_of_rigid(&table), Vec::new()),
        None => (material(&table), sections(&table, names)),
    };
    let mass_density = mass_density(&table);
    let thermal_expansion = if rigid.is_none() { table.number("thermal_expansion").optional() } else { None };
    let axes_about = if rigid.is_none() { axes_about(&table, &material) } else { None };
    let formulations = [("full", Formulation::Full), ("f_bar", Formulation::FBar), ("reduced", Formulation::Reduced)];
    let element = table.word("element", &formulations).or(Formulation::Full);
    let shape_functions = shape_functions(&table);
    let order = table
        .integer("order")
        .check(
            CaseCode::OutOfRange,
            |order| matches!(order, 1 | 2),
            "must be 1 or 2",
            "1: linear elements, or those of a mesh file; 2: hexahedra of 27, wedges of 18 and tetrahedra of 10 nodes",
        )
        .or(1) as u8;
    // whether there are hexahedra, and wedges, of second order
    let [hexahedra, wedges] = match &shape {
        Some(Shape::Mesh(file)) => {
            let any = |is: fn(&mesh::Element) -> [bool; 2]| {
                file.mesh.elements.iter().map(is).any(|[linear, quadratic]| quadratic || linear && order == 2)
            };
            [
                any(|e| [matches!(e, mesh::Element::Hex8(_)), matches!(e, mesh::Element::Hex27(_))]),
                any(|e| [matches!(e, mesh::Element::Wedge6(_)), matches!(e, mesh::Element::Wedge18(_))]),
            ]
        }
        shape => [order == 2 || shape.is_none(), false],
    };
    if element == Formulation::Reduced && shape_functions.are_lagrange() && rigid.is_none() && hexahedra {
        let message = "eight integration points do not hold all motions of hexahedra of 27 nodes";
        let help = "add `shape_functions = \"serendipity\"`, or omit `element`";
        table.reader.error(&table.path_of("element"), CaseCode::OutOfRange, message, help);
    }
    if rigid.is_none() {
        let reduced = element == Formulation::Reduced && !hexahedra;
        let shapes = !shape_functions.are_lagrange() && !hexahedra && !wedges;
        for (key, _) in [("element", reduced), ("shape_functions", shapes)].into_iter().filter(|(_, idle)| *idle) {
            let of = if key == "element" { "hexahedra" } else { "hexahedra or wedges" };
            let message = format!("the key has no effect on this body, which has no {of} of second order");
            table.reader.warning(
                &table.path_of(key),
                CaseCode::OutOfRange,
                message,
                "add `order = 2`, or omit the key",
            );
        }
    }
    let element = if hexahedra || element != Formulation::Reduced { element } else { Formulation::Full };
    if rigid.is_none() {
        warn_of_locking(&table, "material", shape.as_ref(), &material, element, order);
        for (i, section) in sections.iter().enumerate() {
            let key = format!("section[{i}].material");
            warn_of_locking(&table, &key, shape.as_ref(), &section.material, element, order);
        }
    }
    table.finish();
    let shape = shape.unwrap_or(STAND_IN);
    Body {
        name,
        shape,
        place,
        rigid,
        mass_density,
        thermal_expansion,
        material,
        axes_about,
        sections,
        element,
        shape_functions,
        order,
    }
}

/// The shape functions of hexahedra of second order.
fn shape_functions(table: &Table<'_>) -> ShapeFunctions {
    let known = [("lagrange", ShapeFunctions::Lagrange), ("serendipity", ShapeFunctions::Serendipity)];
    table.word("shape_functions", &known).or(ShapeFunctions::Lagrange)
}

/// The shape; `None` only if it is unknown which shape is meant, or which surfaces it has.
fn shape(table: &Table<'_>, body: &str, files: &MeshFiles<'_>) -> Option<Shape> {
    let key = table.choose("the body's shape", SHAPES)?;
    let Some(inner) = table.table(key) else {
        // Even with a value of the wrong type, the key determines the faces.
        return stand_in(key);
    };
    let shape = match key {
        "box" => box_shape(&inner),
        "half_ball" => Shape::HalfBall {
            radius: length(&inner, "radius"),
            elements: elements(&inner, [1; 3], "[n, h, m]: a core of n × n × h in m layers"),
        },
        "ball" => Shape::Ball {
            radius: length(&inner, "radius"),
            elements: elements(&inner, [1; 3], "[n, h, m] of each half: a core of n × n × h in m layers"),
        },
        "cone" => Shape::Cone {
            bottom_radius: length(&inner, "bottom_radius"),
            top_radius: length(&inner, "top_radius"),
            height: length(&inner, "height"),
            elements: elements(&inner, [1; 3], "[n, m, k]: a core of n × n in m rings, in k layers"),
        },
        "torus" => {
            let radius = length(&inner, "radius");
            let most = if inner.has("radius") { radius } else { f64::INFINITY };
            let tube_radius = inner
                .number("tube_radius")
                .positive(CaseCode::BadShape)
                .check(CaseCode::BadShape, |&tube| tube < most, "must be less than `radius`", "")
                .required(0.5 * radius, "a length");
            let elements = elements(&inner, [1, 1, 3], "[n, m, k]: a core of n × n in m rings, k times around");
            Shape::Torus { radius, tube_radius, elements }
        }
        "hollow_cylinder" => {
            let (inner_radius, outer_radius) = radii(&inner);
            let height = length(&inner, "height");
            let elements = elements(&inner, [1, 3, 1], "[radial, around, axial]");
            Shape::HollowCylinder { inner_radius, outer_radius, height, elements }
        }
        "mesh" => {
            let mesh = mesh_file(&inner, body, files).map(Shape::Mesh);
            let Some(mesh) = mesh else {
                inner.finish();
                return None;
            };
            mesh
        }
        _ => {
            let (inner_radius, outer_radius) = radii(&inner);
            let width = length(&inner, "width");
            let elements = elements(&inner, [2, 1, 1], "[around, radial, across]");
            Shape::HalfRing { outer_radius, inner_radius, width, elements }
        }
    };
    if shape.element_count().is_none_or(|count| count > MOST_ELEMENTS) {
        inner.reader.error(
            &inner.path_of(if key == "mesh" { "file" } else { "elements" }),
            CaseCode::Elements,
            format!("more than {MOST_ELEMENTS} elements"),
            "",
        );
    }
    inner.finish();
    Some(shape)
}

fn stand_in(key: &str) -> Option<Shape> {
    let elements = [2, 3, 1];
    Some(match key {
        "mesh" => return None,
        "half_ball" => Shape::HalfBall { radius: 1.0, elements },
        "ball" => Shape::Ball { radius: 1.0, elements },
        "cone" => Shape::Cone { bottom_radius: 1.0, top_radius: 1.0, height: 1.0, elements },
        "torus" => Shape::Torus { radius: 2.0, tube_radius: 1.0, elements: [1, 1, 3] },
        "hollow_cylinder" => Shape::HollowCylinder { inner_radius: 1.0, outer_radius: 2.0, height: 1.0, elements },
        "half_ring" => Shape::HalfRing { outer_radius: 2.0, inner_radius: 1.0, width: 1.0, elements },
        _ => STAND_IN,
    })
}

fn box_shape(table: &Table<'_>) -> Shape {
    let min = table.vector("min").required([0.0; 3], "the box's lowest corner [x, y, z]");
    let above = |max: &[f64; 3]| (0..3).all(|i| min[i] < max[i]);
    let max = table
        .vector("max")
        .check(
            CaseCode::BadShape,
            above,
            "must lie above `min` in every direction",
            "`min` is the lowest corner, `max` the highest",
        )
        .required(min.map(|x| x + 1.0), "the box's highest corner [x, y, z]");
    let grading = table
        .vector("grading")
        .check(
            CaseCode::OutOfRange,
            |grading| grading.iter().all(|&ratio| ratio > 0.0),
            "must be greater than zero",
            "the ratio of the last to the first element size, per direction; 1 is uniform",
        )
        .or([1.0; 3]);
    Shape::Box { min, max, elements: elements(table, [1; 3], "along [x, y, z]"), grading }
}

fn length(table: &Table<'_>, key: &'static str) -> f64 {
    table.number(key).positive(CaseCode::BadShape).required(1.0, "a length")
}

/// Inner and outer radius.
fn radii(table: &Table<'_>) -> (f64, f64) {
    let inner = length(table, "inner_radius");
    // A placeholder inner radius is not compared.
    let least = if table.has("inner_radius") { inner } else { 0.0 };
    let outer = table
        .number("outer_radius")
        .positive(CaseCode::BadShape)
        .check(CaseCode::BadShape, |&outer| outer > least, "must be greater than `inner_radius`", "")
        .required(inner + 1.0, "a length");
    (inner, outer)
}

fn elements(table: &Table<'_>, least: [i64; 3], help: &str) -> [usize; 3] {
    let help = format!("the numbers of elements {help}");
    let stand_in = least.map(|n| n as usize);
    table.integers("elements").counts(CaseCode::Elements, least).required(stand_in, &help)
}

fn place(table: Table<'_>) -> Placement {
    let rotate = table.table("rotate").map(|rotate| {
        let axis = direction(&rotate, "axis");
        let degrees = rotate.number("degrees").required(0.0, "the angle, for instance 90");
        rotate.finish();
        Rotate { axis, degrees }
    });
    let translate = table.vector("translate").or([0.0; 3]);
    table.finish();
    Placement { rotate, translate }
}

/// A placeholder for the material of a rigid body, which must not have one.
fn none_of_rigid(table: &Table<'_>) -> Material {
    for key in ["material", "section", "element"] {
        if table.has(key) {
            let message = format!("`{key}` has no meaning for a rigid body");
            let help = format!("omit `{key}`, or `rigid`");
            table.reader.error(&table.path_of(key), CaseCode::UnknownKey, message, help);
        }
        table.value(key);
    }
    example()
}

fn material(table: &Table<'_>) -> Material {
    let example = example();
    table.require("material", &format!("for instance material = {example}"));
    let Some(material) = table.table("material") else {
        return example;
    };
    let read = material.choose("the material", LawKind::WORDS).and_then(|word| constants(material.table(word)?, word));
    material.finish();
    read.unwrap_or(example)
}

/// The line about which the axes of an orthotropic material turn.
fn axes_about(table: &Table<'_>, material: &Material) -> Option<AxesAbout> {
    let inner = table.table("axes_about")?;
    let point = inner.vector("point").or([0.0; 3]);
    let direction = inner.vector("direction").required([0.0, 0.0, 1.0], "the direction [x, y, z] of the line");
    if direction == [0.0; 3] {
        let message = "the direction of the line has no length";
        inner.reader.error(&inner.path_of("direction"), CaseCode::OutOfRange, message, "for instance [0, 0, 1]");
    }
    if material.kind() != LawKind::Orthotropic {
        let message = format!("`{}` has the same stiffness in all directions", material.kind().word());
        table.reader.error(&table.path_of("axes_about"), CaseCode::Unsupported, message, "omit `axes_about`");
    }
    inner.finish();
    Some(AxesAbout { point, direction })
}

/// Mass per volume of the solid, if it is given.
fn mass_density(table: &Table<'_>) -> Option<f64> {
    table.number("mass_density").positive(CaseCode::OutOfRange).optional()
}

/// Regions with other materials.
fn sections(table: &Table<'_>, names: &Names) -> Vec<BodySection> {
    let section = |table: Table<'_>| {
        table.require("region", "for instance region = { min = [0, 0, 0], max = [1, 1, 1] }");
        let region = table.table("region").and_then(|table| region(table, OF_BODY, names));
        let (material, mass_density) = (material(&table), mass_density(&table));
        let thermal_expansion = table.number("thermal_expansion").optional();
        let axes_about = axes_about(&table, &material);
        table.finish();
        Some(BodySection { region: region?, material, mass_density, thermal_expansion, axes_about })
    };
    table.tables("section").into_iter().filter_map(section).collect()
}

/// An example of a material, also a placeholder.
fn example() -> Material {
    LawKind::ALL[0].like(1000.0, 0.3).expect("a positive modulus and a ratio below 1/2")
}

/// The law with its constants; `None` if one of them is missing or wrong.
fn constants(table: Table<'_>, word: &str) -> Option<Material> {
    let forms = LawKind::forms(word);
    let law = match forms.is_empty() {
        true => LawKind::from_word(word),
        false => Some(table.word("form", &forms).or(LawKind::from_word(word)?)),
    };
    let law = law?;
    let values: Vec<Option<Value>> = law.constants().iter().map(|constant| value(&table, constant)).collect();
    let (reader, path) = (table.reader, table.path().to_owned());
    table.finish();
    let built = law.with_values(&values.into_iter().collect::<Option<Vec<_>>>()?);
    let report = |error: MaterialError| {
        reader.error(&format!("{path}.{}", error.key), CaseCode::MaterialConstants, error.problem, error.help);
    };
    built.map_err(report).ok()
}

fn value(table: &Table<'_>, constant: &Constant) -> Option<Value> {
    let Constant { key, form, help, .. } = *constant;
    let code = match key {
        "youngs_modulus" => CaseCode::YoungsModulus,
        "poisson_ratio" => CaseCode::PoissonRatio,
        _ => CaseCode::OutOfRange,
    };
    let possible = |value: Value| -> Option<Value> {
        let Some((problem, help)) = constant.problem(&value) else { return Some(value) };
        table.reader.error(&table.path_of(key), code, format!("`{key}` {problem}"), help);
        None
    };
    match form {
        Form::Modulus(range) | Form::Number(range) => {
            table.require(key, help);
            let number = table.number(key);
            let number = if range == Range::Positive { number.positive(code) } else { number };
            possible(number.optional()?.into())
        }
        Form::Moduli { .. } | Form::Numbers { .. } => {
            table.require(key, help);
            let numbers = table.list(key, |value, path| table.reader.number(value, &format!("`{path}`")));
            let numbers = numbers.optional()?;
            let listed = table.value(key)?.get_ref().as_array()?.len();
            if numbers.len() < listed { None } else { possible(Value::Numbers(numbers)) }
        }
        Form::Direction(default) => {
            if !table.has(key) {
                table.value(key);
                return Some(Value::Numbers(default.to_vec()));
            }
            possible(Value::Numbers(table.vector(key).optional()?.to_vec()))
        }
    }
}

/// Poisson's ratio above which fully integrated elements are noticeably too stiff.
const LOCKING: f64 = 0.45;

/// How to avoid locking.
const UNLOCKED: &str = "use element = \"f_bar\" and hexahedra, or order = 2 for tetrahedra; or a ratio below 0.45";

fn warn_of_locking(
    table: &Table<'_>,
    key: &str,
    shape: Option<&Shape>,
    material: &Material,
    element: Formulation,
    order: u8,
) {
    let (law, ratio) = (material.kind(), material.poisson_ratio());
    let count = |is: fn(&mesh::Element) -> bool| match shape {
        Some(Shape::Mesh(file)) => file.mesh.elements.iter().filter(|&element| is(element)).count(),
        _ => 0,
    };
    let tetrahedra = if order == 2 { 0 } else { count(|element| matches!(element, mesh::Element::Tet4(_))) };
    let quadratic = order == 2 || count(|element| element.is_second_order()) > 0;
    let wedges = if order == 2 { 0 } else { count(|element| matches!(element, mesh::Element::Wedge6(_))) };
    let warn = |key: &str, message: String, help: &str| {
        table.reader.warning(&table.path_of(key), CaseCode::Locking, message, help);
    };
    if element == Formulation::FBar && tetrahedra > 0 && key == "material" {
        let message = format!(
            "F\u{304} has no effect on the body's {tetrahedra} tetrahedra: their volume change is already uniform"
        );
        warn("element", message, "keep it if the body also has hexahedra; otherwise omit it");
    }
    // the constant that makes the material nearly incompressible
    let stiff = |constant: &&Constant| ["poisson_ratio", "bulk_modulus"].contains(&constant.key);
    let ratio_key = match law.constants().iter().find(stiff) {
        Some(constant) => format!("{key}.{}.{}", law.word(), constant.key),
        None => format!("{key}.{}", law.word()),
    };
    let ratio_key = &ratio_key;
    // 0.4995 rather than 0.49949999999999994
    let shown = (1e6 * ratio).round() / 1e6;
    if ratio >= LOCKING && tetrahedra > 0 {
        let message = format!("tetrahedra lock at a Poisson's ratio of {shown}: they are too stiff");
        warn(ratio_key, message, UNLOCKED);
    } else if ratio >= LOCKING && wedges > 0 {
        let message = format!(
            "wedges lock at a Poisson's ratio of {shown}: they are too stiff in the plane of their triangles, even \
             with F\u{304}"
        );
        warn(ratio_key, message, UNLOCKED);
    } else if ratio >= LOCKING && element == Formulation::Full {
        let kind = if quadratic { "elements" } else { "hexahedra" };
        let message = format!("fully integrated {kind} lock at a Poisson's ratio of {shown}: they are too stiff");
        warn(ratio_key, message, "give the body element = \"f_bar\", or a ratio below 0.45");
    }
}

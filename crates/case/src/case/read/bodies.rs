//! Bodies (`[[body]]`).

use super::super::names::Names;
use super::super::resolved::{Body, Formulation, LawKind, Material, Placement, Rotate, Shape};
use super::super::typed::Table;
use super::mesh_file::{MeshFiles, mesh_file};
use super::{CaseCode, direction, name};
use slipstick_mesh as mesh;

const SHAPES: &[&str] = &["box", "half_ball", "hollow_cylinder", "half_ring", "mesh"];
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
    tables.into_iter().map(|table| body(table, names, files)).collect()
}

fn body(table: Table<'_>, names: &mut Names, files: &MeshFiles<'_>) -> Body {
    let name = name(&table);
    let shape = shape(&table, &name, files);
    names.add_body(table.reader, &table.path_of("name"), &name, shape.as_ref());
    let place = table.table("place").map(place).unwrap_or_default();
    let material = material(&table);
    let formulations = [("full", Formulation::Full), ("f_bar", Formulation::FBar)];
    let element = table.word("element", &formulations).or(Formulation::Full);
    warn_of_locking(&table, shape.as_ref(), &material, element);
    table.finish();
    Body { name, shape: shape.unwrap_or(STAND_IN), place, material, element }
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

fn material(table: &Table<'_>) -> Material {
    let stand_in = Material { law: LawKind::ALL[0], youngs_modulus: 1.0, poisson_ratio: 0.3 };
    table.require(
        "material",
        "for instance material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }",
    );
    let Some(material) = table.table("material") else {
        return stand_in;
    };
    let read = material.choose("the material", LawKind::WORDS).and_then(|word| {
        let (youngs_modulus, poisson_ratio) = elastic_constants(material.table(word)?);
        Some(Material { law: LawKind::from_word(word)?, youngs_modulus, poisson_ratio })
    });
    material.finish();
    read.unwrap_or(stand_in)
}

/// Poisson's ratio above which fully integrated elements are noticeably too stiff.
const LOCKING: f64 = 0.45;

/// How to avoid locking.
const UNLOCKED: &str = "mesh the body with hexahedra and use element = \"f_bar\", or use a ratio below 0.45";

fn warn_of_locking(table: &Table<'_>, shape: Option<&Shape>, material: &Material, element: Formulation) {
    let (law, ratio) = (material.law.word(), material.poisson_ratio);
    let count = |is: fn(&mesh::Element) -> bool| match shape {
        Some(Shape::Mesh(file)) => file.mesh.elements.iter().filter(|&element| is(element)).count(),
        _ => 0,
    };
    let tetrahedra = count(|element| matches!(element, mesh::Element::Tet4(_)));
    let wedges = count(|element| matches!(element, mesh::Element::Wedge6(_)));
    let warn = |key: &str, message: String, help: &str| {
        table.reader.warning(&table.path_of(key), CaseCode::Locking, message, help);
    };
    if element == Formulation::FBar && tetrahedra > 0 {
        let message = format!(
            "F\u{304} has no effect on the body's {tetrahedra} tetrahedra: their volume change is already uniform"
        );
        warn("element", message, "keep it if the body also has hexahedra; otherwise omit it");
    }
    let ratio_key = format!("material.{law}.poisson_ratio");
    if ratio >= LOCKING && tetrahedra > 0 {
        let message = format!("tetrahedra lock at a Poisson's ratio of {ratio}: they are too stiff");
        warn(&ratio_key, message, UNLOCKED);
    } else if ratio >= LOCKING && wedges > 0 {
        let message = format!(
            "wedges lock at a Poisson's ratio of {ratio}: they are too stiff in the plane of their triangles, even \
             with F\u{304}"
        );
        warn(&ratio_key, message, UNLOCKED);
    } else if ratio >= LOCKING && element == Formulation::Full {
        let message = format!("fully integrated hexahedra lock at a Poisson's ratio of {ratio}: they are too stiff");
        warn(&ratio_key, message, "give the body element = \"f_bar\", or a ratio below 0.45");
    }
}

fn elastic_constants(table: Table<'_>) -> (f64, f64) {
    let youngs_modulus =
        table.number("youngs_modulus").positive(CaseCode::YoungsModulus).required(1.0, "Young's modulus of the solid");
    let poisson_ratio = table
        .number("poisson_ratio")
        .check(
            CaseCode::PoissonRatio,
            |&nu| nu > -1.0 && nu < 0.5,
            "must lie between -1 and 0.5, bounds excluded",
            "above about 0.45, use element = \"f_bar\" for the body",
        )
        .required(0.3, "Poisson's ratio, for instance 0.3");
    table.finish();
    (youngs_modulus, poisson_ratio)
}

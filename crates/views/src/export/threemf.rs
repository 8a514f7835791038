//! Writes triangle surfaces as 3MF, the 3D printing format with units and closed bodies.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{Cursor, Write as _};
use std::path::Path;

use quick_xml::escape::escape;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use super::{ExportError, TriangleSurface};
use slipstick_results::output::write_atomically;

/// 3MF's names for units of length, and the usual ones.
const UNITS: [(&str, &[&str]); 6] = [
    ("micron", &["micron", "µm", "μm", "um"]),
    ("millimeter", &["millimeter", "millimetre", "mm"]),
    ("centimeter", &["centimeter", "centimetre", "cm"]),
    ("inch", &["inch", "in", "\""]),
    ("foot", &["foot", "ft", "'"]),
    ("meter", &["meter", "metre", "m"]),
];

const CONTENT_TYPES: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
 <Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
 <Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
</Types>
"#;

const RELATIONS: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
 <Relationship Target="/3D/3dmodel.model" Id="model" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>
"#;

/// 3MF's name for a unit of length in the case file; without a unit, 3MF's default, the millimetre.
///
/// # Errors
/// [`ExportError::Unit`] for a unit that 3MF does not have.
pub fn unit_of_3mf(length: Option<&str>) -> Result<&'static str, ExportError> {
    unit_of_length(length, "3MF")
}

/// The same for another `format` with these units.
///
/// # Errors
/// [`ExportError::Unit`].
pub fn unit_of_length(length: Option<&str>, format: &'static str) -> Result<&'static str, ExportError> {
    let Some(length) = length else { return Ok("millimeter") };
    let found = UNITS.iter().find(|(_, names)| names.contains(&length.trim()));
    found.map(|(unit, _)| *unit).ok_or_else(|| ExportError::Unit { unit: length.to_owned(), format })
}

/// Writes 3MF (core specification 1.3): one named object per body, with shared points; `names` are
/// the names of all bodies of the mesh, `length` is the name of the case's unit of length. The same
/// surface gives the same bytes.
///
/// # Errors
/// [`ExportError::Unit`]; [`ExportError::Output`].
pub fn write_3mf(
    path: &Path,
    surface: &TriangleSurface,
    names: &[&str],
    length: Option<&str>,
) -> Result<(), ExportError> {
    let model = model(surface, names, unit_of_3mf(length)?);
    Ok(write_atomically(path, |writer| {
        // writing a zip archive needs seeking, which the output file does not support
        let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
        for (name, text) in
            [("[Content_Types].xml", CONTENT_TYPES), ("_rels/.rels", RELATIONS), ("3D/3dmodel.model", &model)]
        {
            archive.start_file(name, SimpleFileOptions::default())?;
            archive.write_all(text.as_bytes())?;
        }
        writer.write_all(archive.finish()?.get_ref())
    })?)
}

/// The model part: objects and build items.
fn model(surface: &TriangleSurface, names: &[&str], unit: &str) -> String {
    let mut bodies: BTreeMap<u32, Vec<[u32; 3]>> = BTreeMap::new();
    for (&triangle, &body) in surface.triangles.iter().zip(&surface.bodies) {
        bodies.entry(body).or_default().push(triangle);
    }
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model unit=\"{unit}\" xml:lang=\"en-US\" \
         xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\">\n\
         <metadata name=\"Application\">slipstick</metadata>\n<resources>\n"
    );
    let mut items = String::new();
    for (number, (body, triangles)) in bodies.iter().enumerate() {
        let (id, name) = (number + 1, escape(*names.get(*body as usize).unwrap_or(&"body")));
        object(&mut text, surface, triangles, id, &name);
        let _ = writeln!(items, "<item objectid=\"{id}\"/>");
    }
    text + "</resources>\n<build>\n" + &items + "</build>\n</model>\n"
}

/// One body: its renumbered points, and its triangles.
fn object(text: &mut String, surface: &TriangleSurface, triangles: &[[u32; 3]], id: usize, name: &str) {
    let mut used: Vec<u32> = triangles.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    let mut local = vec![0; surface.points.len()];
    let _ = write!(text, "<object id=\"{id}\" type=\"model\" name=\"{name}\">\n<mesh>\n<vertices>\n");
    for (number, &point) in used.iter().enumerate() {
        local[point as usize] = number;
        let [x, y, z] = surface.points[point as usize];
        let _ = writeln!(text, "<vertex x=\"{x}\" y=\"{y}\" z=\"{z}\"/>");
    }
    text.push_str("</vertices>\n<triangles>\n");
    for triangle in triangles {
        let [a, b, c] = triangle.map(|point| local[point as usize]);
        let _ = writeln!(text, "<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\"/>");
    }
    text.push_str("</triangles>\n</mesh>\n</object>\n");
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    /// Two tetrahedra, of two bodies.
    fn two() -> TriangleSurface {
        let corner = |shift: f64| {
            [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
                .map(|p: [f64; 3]| [p[0] + shift, p[1], p[2]])
        };
        let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
        TriangleSurface {
            points: [corner(0.0), corner(2.5)].concat(),
            triangles: [faces, faces.map(|t| t.map(|n| n + 4))].concat(),
            outer: vec![true; 8],
            bodies: vec![1, 1, 1, 1, 0, 0, 0, 0],
            labels: vec![0; 8],
        }
    }

    /// The zip crate reads the archive and an XML reader its parts: names, unit, numbers of points
    /// and triangles, and volumes computed by hand (a sixth each).
    #[test]
    fn objects_are_closed_bodies_in_the_cases_unit() {
        let folder = tempfile::tempdir().expect("a folder");
        let (path, again) = (folder.path().join("two.3mf"), folder.path().join("again.3mf"));
        for path in [&path, &again] {
            write_3mf(path, &two(), &["a<b", "second"], Some("cm")).expect("written");
        }
        let bytes = std::fs::read(&path).expect("there");
        assert_eq!(bytes, std::fs::read(&again).expect("there"), "the same bytes");
        let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).expect("an archive");
        let names: Vec<String> = archive.file_names().map(|name| name.expect("a name").into_owned()).collect();
        assert_eq!(names, ["[Content_Types].xml", "_rels/.rels", "3D/3dmodel.model"]);
        let mut text = String::new();
        archive.by_name("3D/3dmodel.model").expect("there").read_to_string(&mut text).expect("text");
        assert!(text.contains("<model unit=\"centimeter\"") && text.contains("name=\"a&lt;b\""), "{text}");
        let found = volumes(&text);
        let sixth = |volume: &f64| (volume - 1.0 / 6.0).abs() < 1e-15;
        assert!(found.len() == 2 && found.iter().all(sixth), "{found:?}");
        assert_eq!(text.matches("<item objectid=").count(), 2);
    }

    /// Volume of every object of a model.
    fn volumes(text: &str) -> Vec<f64> {
        use quick_xml::events::Event;
        let mut reader = quick_xml::Reader::from_str(text);
        let (mut points, mut volumes) = (Vec::<[f64; 3]>::new(), Vec::new());
        loop {
            let event = reader.read_event().expect("XML");
            let numbers = |keys: [&str; 3], of: &quick_xml::events::BytesStart| {
                keys.map(|key| {
                    let value = of.try_get_attribute(key).expect("XML").expect("there");
                    value.value.parse::<f64>().expect("a number")
                })
            };
            match event {
                Event::Start(of) if of.name().as_ref() == "object" => {
                    points.clear();
                    volumes.push(0.0);
                }
                Event::Empty(of) if of.name().as_ref() == "vertex" => points.push(numbers(["x", "y", "z"], &of)),
                Event::Empty(of) if of.name().as_ref() == "triangle" => {
                    let [a, b, c] = numbers(["v1", "v2", "v3"], &of).map(|n| points[n as usize]);
                    let cross = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
                    *volumes.last_mut().expect("an object") += (0..3).map(|k| a[k] * cross[k]).sum::<f64>() / 6.0;
                }
                Event::Eof => return volumes,
                _ => {}
            }
        }
    }

    #[test]
    fn units_have_their_names() {
        for (case, expected) in
            [(Some("mm"), "millimeter"), (None, "millimeter"), (Some("µm"), "micron"), (Some("m"), "meter")]
        {
            assert_eq!(unit_of_3mf(case).expect("known"), expected);
        }
        let refused = unit_of_3mf(Some("km")).expect_err("unknown").to_string();
        assert!(refused.contains("`km`"), "{refused}");
    }
}

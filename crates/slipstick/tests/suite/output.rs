//! Result files, read back by a small independent reader of their formats.

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Write};

use slipstick::output::{Cell, Csv, OutputError, Pvd, Values, Vtu, write_atomically};
use slipstick_mesh::Element;
use slipstick_meshio::FileMesh;

const POINTS: [[f64; 3]; 12] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [1.0, 1.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [1.0, 0.0, 1.0],
    [1.0, 1.0, 1.0],
    [0.0, 1.0, 1.0],
    [0.0, 0.0, 2.5],
    [1.0, 0.0, 2.5],
    [1.0, 1.0, 2.5],
    [0.0, 1.0, 2.5],
];
const HEXES: [Element; 2] = [Element::Hex8([0, 1, 2, 3, 4, 5, 6, 7]), Element::Hex8([4, 5, 6, 7, 8, 9, 10, 11])];

/// An array as stored in the file.
#[derive(Debug)]
struct Array {
    section: String,
    type_name: String,
    components: usize,
    bytes: Vec<u8>,
}

impl Array {
    fn f64(&self) -> Vec<f64> {
        assert_eq!(self.type_name, "Float64");
        self.bytes.as_chunks().0.iter().map(|&bytes| f64::from_le_bytes(bytes)).collect()
    }

    fn i64(&self) -> Vec<i64> {
        assert_eq!(self.type_name, "Int64");
        self.bytes.as_chunks().0.iter().map(|&bytes| i64::from_le_bytes(bytes)).collect()
    }
}

fn attribute<'a>(tag: &'a str, name: &str) -> Option<&'a str> {
    let start = tag.find(&format!(" {name}=\""))? + name.len() + 3;
    tag[start..].split('"').next()
}

/// Arrays by name, from the XML part and the appended data.
fn read_vtu(bytes: &[u8]) -> BTreeMap<String, Array> {
    let marker = b"<AppendedData encoding=\"raw\">\n_";
    let split = bytes.windows(marker.len()).position(|w| w == marker).expect("appended data");
    let header = std::str::from_utf8(&bytes[..split]).expect("text");
    let data = &bytes[split + marker.len()..];
    assert!(data.ends_with(b"\n</AppendedData>\n</VTKFile>\n"));
    assert!(header.contains("byte_order=\"LittleEndian\" header_type=\"UInt64\""));
    let mut section = String::new();
    let mut arrays = BTreeMap::new();
    for tag in header.split('<').skip(1) {
        let name = tag.split([' ', '>']).next().unwrap_or_default();
        if ["Points", "Cells", "PointData", "CellData"].contains(&name) {
            section = name.to_owned();
        }
        let Some(offset) = attribute(tag, "offset") else {
            continue;
        };
        let offset: usize = offset.parse().expect("an offset");
        let (size, rest) = data[offset..].split_first_chunk().expect("a size");
        let array = Array {
            section: section.clone(),
            type_name: attribute(tag, "type").expect("a type").to_owned(),
            components: attribute(tag, "NumberOfComponents").unwrap_or("1").parse().expect("a number"),
            bytes: rest[..u64::from_le_bytes(*size) as usize].to_vec(),
        };
        arrays.insert(attribute(tag, "Name").expect("a name").to_owned(), array);
    }
    arrays
}

#[test]
fn a_vtu_reads_back_bit_for_bit() {
    let displacement: Vec<f64> = (0..36).map(|i| (f64::from(i) * 0.7).sin() / 3.0).collect();
    let density = [0.1, f64::MIN_POSITIVE];
    let (error, body, status) = ([1.5f32, -2.25], [-7i64, i64::MAX], [0u8, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1, 255]);
    let mut vtu = Vtu::new(&POINTS, &HEXES).expect("a mesh");
    vtu.point_field("displacement", 3, Values::F64(&displacement)).expect("fits");
    vtu.point_field("status", 1, Values::U8(&status)).expect("fits");
    vtu.cell_field("density", 1, Values::F64(&density)).expect("fits");
    vtu.cell_field("a<b & \"c\"", 1, Values::F32(&error)).expect("fits");
    vtu.cell_field("body", 1, Values::I64(&body)).expect("fits");
    vtu.time(0.1).expect("finite");
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("step.vtu");
    vtu.save(&path).expect("written");

    let bytes = fs::read(&path).expect("readable");
    let header = String::from_utf8_lossy(&bytes);
    assert!(header.contains("<PointData Scalars=\"status\" Vectors=\"displacement\">"), "what viewers show first");
    assert!(header.contains("<CellData Scalars=\"density\">"));
    let arrays = read_vtu(&bytes);
    assert_eq!(arrays["Points"].f64(), POINTS.as_flattened());
    assert_eq!(arrays["Points"].components, 3);
    let nodes: Vec<i64> = HEXES.iter().flat_map(|hex| hex.nodes()).map(|&node| i64::from(node)).collect();
    assert_eq!(arrays["connectivity"].i64(), nodes);
    assert_eq!(arrays["offsets"].i64(), [8, 16]);
    assert_eq!(arrays["types"].bytes, [12, 12]);
    assert_eq!(arrays["displacement"].f64(), displacement);
    assert_eq!(arrays["displacement"].section, "PointData");
    assert_eq!(arrays["status"].bytes, status);
    assert_eq!(arrays["density"].f64(), density);
    assert_eq!(arrays["density"].section, "CellData");
    assert_eq!(arrays["body"].i64(), body);
    let escaped = &arrays["a&lt;b &amp; &quot;c&quot;"];
    assert_eq!((escaped.type_name.as_str(), escaped.bytes.len()), ("Float32", 8));
    let text = String::from_utf8_lossy(&bytes);
    assert!(text.contains("NumberOfPoints=\"12\" NumberOfCells=\"2\""));
    assert!(text.contains("Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">0.1<"));
    // Only the file itself remains.
    assert_eq!(fs::read_dir(folder.path()).expect("readable").count(), 1);
}

/// Types and offsets according to VTK's file format: 10 is the tetrahedron, 12 the hexahedron, 13
/// the wedge, whose first triangle is counter-clockwise seen from outside.
#[test]
fn elements_of_all_types_are_written() {
    let elements = [Element::Tet4([8, 9, 10, 4]), HEXES[0], Element::Wedge6([0, 1, 3, 4, 5, 7])];
    let mut bytes = Vec::new();
    Vtu::new(&POINTS, &elements).expect("a mesh").write(&mut bytes).expect("memory");
    let arrays = read_vtu(&bytes);
    assert_eq!(arrays["connectivity"].i64(), [8, 9, 10, 4, 0, 1, 2, 3, 4, 5, 6, 7, 0, 3, 1, 4, 7, 5]);
    assert_eq!((arrays["offsets"].i64(), &arrays["types"].bytes[..]), (vec![4, 12, 18], &[10, 12, 13][..]));
    let read = FileMesh::parse(&bytes).expect("readable").body("a", None, 1.0).expect("a body");
    assert_eq!(read.mesh.elements[1..], elements[1..], "read back as they were");
}

/// Type 32 of VTK's file format: the biquadratic quadratic wedge, with the nodes on its edges before those at the
/// centres of its quadrilaterals.
#[test]
fn wedges_of_18_nodes_are_written() {
    let shape = slipstick_mesh::BoxShape { min: [0.0; 3], max: [1.0; 3], elements: [1; 3], grading: [1.0; 3] };
    let wedges = slipstick_mesh::box_mesh("a", &shape).unwrap().divided_into_wedges(|_| Some(2));
    let mesh = wedges.second_order(crate::patch::mean).unwrap();
    let mut bytes = Vec::new();
    Vtu::new(&mesh.nodes, &mesh.elements).expect("a mesh").write(&mut bytes).expect("memory");
    assert_eq!(read_vtu(&bytes)["types"].bytes, [32, 32]);
    let read = FileMesh::parse(&bytes).expect("readable").body("a", None, 1.0).expect("a body");
    assert_eq!((&read.mesh.nodes, &read.mesh.elements), (&mesh.nodes, &mesh.elements), "read back as they were");
    assert!(read.notices.is_empty(), "{:?}", read.notices);
}

#[test]
fn wrong_fields_are_refused() {
    let mut vtu = Vtu::new(&POINTS, &HEXES).expect("a mesh");
    let error = vtu.cell_field("density", 1, Values::F64(&[0.5])).map(|_| ()).expect_err("too short");
    assert_eq!(error.to_string(), "field `density` has 1 values; 1 components on 2 cells need 2");
    let error = vtu.cell_field("density", 1, Values::F64(&[0.5, f64::NAN])).map(|_| ());
    assert!(matches!(error, Err(OutputError::NotFinite { entry: 1, .. })), "{error:?}");
    let error = vtu.point_field("status", 0, Values::U8(&[])).map(|_| ());
    assert!(matches!(error, Err(OutputError::Length { .. })), "{error:?}");
    vtu.cell_field("density", 1, Values::F64(&[0.5, 0.5])).expect("fits");
    let error = vtu.cell_field("density", 1, Values::F64(&[0.5, 0.5])).map(|_| ());
    assert!(matches!(error, Err(OutputError::DuplicateField { .. })), "{error:?}");
    let error = Vtu::new(&POINTS[..11], &HEXES).map(|_| ());
    assert!(matches!(error, Err(OutputError::NodeOutOfRange { element: 1, node: 11, .. })));
    let error = Vtu::new(&[[0.0, f64::INFINITY, 0.0]], &[]).map(|_| ());
    assert!(matches!(error, Err(OutputError::NotFinite { entry: 1, .. })));
}

#[test]
fn a_failed_write_leaves_the_old_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("state.bin");
    write_atomically(&path, |writer| writer.write_all(b"old")).expect("written");
    let error = write_atomically(&path, |writer| {
        writer.write_all(b"new, but")?;
        Err(io::Error::other("the disk is full"))
    })
    .expect_err("failed");
    assert!(error.to_string().contains("state.bin: the disk is full"), "{error}");
    assert_eq!(fs::read(&path).expect("readable"), b"old");
    assert_eq!(fs::read_dir(folder.path()).expect("readable").count(), 1);
    let missing = folder.path().join("none").join("state.bin");
    assert!(matches!(write_atomically(&missing, |_| Ok(())), Err(OutputError::Io { .. })));
}

#[test]
fn a_collection_lists_times_and_parts() {
    let mut pvd = Pvd::default();
    pvd.add(0.1, "a.vtu").expect("finite");
    pvd.add(1e-9, "b&c.vtu").expect("finite");
    pvd.add(1e-9, "d.vtu").expect("finite");
    assert!(pvd.add(f64::NAN, "e.vtu").is_err());
    let text = pvd.to_xml();
    let sets: Vec<&str> = text.lines().filter(|line| line.starts_with("<DataSet")).collect();
    assert_eq!(
        sets,
        [
            "<DataSet timestep=\"0.1\" group=\"\" part=\"0\" file=\"a.vtu\"/>",
            "<DataSet timestep=\"1e-9\" group=\"\" part=\"0\" file=\"b&amp;c.vtu\"/>",
            "<DataSet timestep=\"1e-9\" group=\"\" part=\"1\" file=\"d.vtu\"/>",
        ]
    );
}

#[test]
fn a_table_keeps_every_digit() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("history.csv");
    let values = [1.0 / 3.0, -8.30829169, 1e-300, f64::MAX, -0.0];
    let mut csv = Csv::create(&path, &["i", "value", "note, or none"]).expect("created");
    for (i, value) in values.into_iter().enumerate() {
        csv.row(&[i.into(), value.into(), None::<f64>.into()]).expect("written");
    }
    csv.row(&[Cell::Integer(-1), 2.0.into(), "say \"a,b\"".into()]).expect("written");
    let text = fs::read_to_string(&path).expect("readable");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], "i,value,\"note, or none\"");
    assert_eq!(lines[6], "-1,2.0,\"say \"\"a,b\"\"\"");
    for (line, value) in lines[1..].iter().zip(values) {
        let read: f64 = line.split(',').nth(1).expect("a value").parse().expect("a number");
        assert_eq!(read.to_bits(), value.to_bits(), "{line}");
    }
    let error = csv.row(&[1.0.into()]).expect_err("too short");
    assert!(error.to_string().starts_with("a row of 1 values does not match the 3 columns"), "{error}");
    let error = csv.row(&[1usize.into(), f64::NAN.into(), Cell::Empty]).expect_err("not finite");
    assert!(error.to_string().starts_with("`value` is NaN at entry 1"), "{error}");
    assert_eq!(fs::read_to_string(&path).expect("readable"), text);
}

#[test]
fn a_table_goes_on_where_the_run_does() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("history.csv");
    let columns = ["i", "note"];
    let resume = |rows| Csv::resume(&path, &columns, rows);
    let text = || fs::read_to_string(&path).expect("readable");
    assert!(resume(1).is_err());
    let mut csv = resume(0).expect("created");
    csv.row(&[1usize.into(), "two\nlines".into()]).expect("written");
    csv.row(&[2usize.into(), "b".into()]).expect("written");
    // A third row, cut short by a crash.
    let mut file = fs::OpenOptions::new().append(true).open(&path).expect("open");
    file.write_all(b"3,half a li").expect("written");
    let error = resume(3).expect_err("two whole rows");
    assert!(error.to_string().contains("has 2 complete rows, not 3"), "{error}");
    let mut csv = resume(2).expect("resumed");
    csv.row(&[3usize.into(), "c".into()]).expect("written");
    assert_eq!(text(), "i,note\n1,\"two\nlines\"\n2,b\n3,c\n");
    let mut csv = resume(1).expect("resumed");
    csv.row(&[2usize.into(), "again".into()]).expect("written");
    assert_eq!(text(), "i,note\n1,\"two\nlines\"\n2,again\n");
    resume(0).expect("resumed");
    assert_eq!(text(), "i,note\n");
    let error = Csv::resume(&path, &["i", "other"], 0).expect_err("another table");
    assert!(error.to_string().contains("has different columns"), "{error}");
}

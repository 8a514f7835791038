//! The VTKHDF file of a load path, read back by a small independent reader of HDF5.
//!
//! `crates/cli/tests/pyvista.rs` compares a file with VTK's reader and with h5py, on demand.

mod common;

use std::fs;

use common::scene::Scene;
use slipstick::build::Problem;
use slipstick::case::Output;
use slipstick::output::{OutputError, VtkHdf, read_fields};
use slipstick::run::{RunDirectory, write_path};
use slipstick_path::Silent;

/// An object of a file: its header messages, by type.
struct Object<'a> {
    file: &'a [u8],
    messages: Vec<(u8, &'a [u8])>,
}

fn number(bytes: &[u8]) -> u64 {
    bytes.iter().rev().fold(0, |number, &byte| number << 8 | u64::from(byte))
}

impl<'a> Object<'a> {
    /// The root group, which the superblock names.
    fn root(file: &'a [u8]) -> Self {
        assert_eq!(&file[..11], b"\x89HDF\r\n\x1a\n\x02\x08\x08");
        assert_eq!(number(&file[28..36]), file.len() as u64, "end of file");
        Self::at(file, number(&file[36..44]))
    }

    fn at(file: &'a [u8], address: u64) -> Self {
        let header = &file[address as usize..];
        assert_eq!(&header[..6], b"OHDR\x02\x02");
        let mut rest = &header[10..10 + number(&header[6..10]) as usize];
        let mut messages = Vec::new();
        while let [kind, low, high, _, data @ ..] = rest {
            let (message, next) = data.split_at(number(&[*low, *high]) as usize);
            messages.push((*kind, message));
            rest = next;
        }
        Self { file, messages }
    }

    fn message(&self, kind: u8) -> &'a [u8] {
        self.messages.iter().find(|message| message.0 == kind).expect("the message").1
    }

    /// Names of the members, in the order of the file.
    fn names(&self) -> Vec<&'a str> {
        let links = self.messages.iter().filter(|message| message.0 == 6);
        links.map(|(_, link)| std::str::from_utf8(&link[3..3 + usize::from(link[2])]).expect("ASCII")).collect()
    }

    fn member(&self, path: &str) -> Self {
        let (name, rest) = path.split_once('/').unwrap_or((path, ""));
        let here = self.names().iter().position(|other| *other == name).unwrap_or_else(|| panic!("{name}"));
        let (_, link) = self.messages.iter().filter(|message| message.0 == 6).nth(here).expect("the link");
        let member = Self::at(self.file, number(&link[3 + name.len()..]));
        if rest.is_empty() { member } else { member.member(rest) }
    }

    fn shape(&self) -> Vec<u64> {
        let space = self.message(1);
        space[4..].chunks(8).take(usize::from(space[1])).map(number).collect()
    }

    /// The bytes of a value, for datasets in one piece.
    fn words(&self) -> Vec<u64> {
        let (size, layout) = (self.message(3)[4], self.message(8));
        assert_eq!(layout[..2], [3, 1]);
        let (start, length) = (number(&layout[2..10]) as usize, number(&layout[10..18]) as usize);
        assert_eq!(self.shape().iter().product::<u64>() * u64::from(size), length as u64);
        self.file[start..start + length].chunks(size.into()).map(number).collect()
    }

    fn is_float(&self) -> bool {
        self.message(3)[0] & 0xf == 1
    }
}

fn small() -> Problem {
    common::problem(&Scene { steps: 3, ..Scene::default() }.text())
}

fn directory(folder: &tempfile::TempDir) -> RunDirectory {
    let output = Output { directory: None, every: 10, pieces: false, vtkhdf: true };
    RunDirectory::create(&folder.path().join("run"), false).expect("a directory").writing(&output)
}

/// Every array of every step has the bits of the VTU file of that step.
#[test]
fn the_file_has_the_fields_of_the_series() {
    let mut problem = small();
    let density = problem.initial_density().clone();
    let forward = problem.analysis.forward(&density, &mut Silent).expect("converges");
    let folder = tempfile::tempdir().expect("a folder");
    let run = directory(&folder);
    write_path(Some(&run), &problem, &forward.path).expect("written");
    let bytes = fs::read(run.file("path.vtkhdf")).expect("the file");
    let file = Object::root(&bytes).member("VTKHDF");
    let (nodes, elements) = (problem.mesh.nodes.len(), problem.mesh.elements.len());
    assert_eq!(file.member("NumberOfPoints").words(), [nodes as u64]);
    assert_eq!(file.member("NumberOfCells").words(), [elements as u64]);
    let points: Vec<u64> = problem.mesh.nodes.as_flattened().iter().map(|x| x.to_bits()).collect();
    assert_eq!(file.member("Points").words(), points);
    assert_eq!(file.member("Points").shape(), [nodes as u64, 3]);
    let connectivity: Vec<u64> = problem.mesh.elements.iter().flat_map(|e| e.nodes()).map(|&n| n.into()).collect();
    assert_eq!(file.member("Connectivity").words(), connectivity);
    assert_eq!(file.member("Offsets").words().len(), elements + 1);
    let steps = file.member("Steps");
    let times: Vec<u64> = forward.path.states.iter().map(|at| at.time.on_axis().to_bits()).collect();
    assert_eq!(steps.member("Values").words(), times);
    for name in ["PartOffsets", "PointOffsets", "CellOffsets", "ConnectivityIdOffsets"] {
        assert_eq!(steps.member(name).words(), vec![0; times.len()], "{name}: the mesh is there once");
    }
    for step in 0..times.len() {
        let stored = read_fields(&run.file(&format!("path_{step:04}.vtu"))).expect("the file of the step");
        for (data, on_points, items) in [("PointData", true, nodes), ("CellData", false, elements)] {
            let expected: Vec<_> = stored.iter().filter(|field| field.on_points == on_points).collect();
            let names: Vec<&str> = expected.iter().map(|field| field.name.as_str()).collect();
            assert_eq!(file.member(data).names(), names);
            for field in expected {
                let array = file.member(&format!("{data}/{}", field.name));
                let start = steps.member(&format!("{data}Offsets/{}", field.name)).words()[step] as usize;
                assert_eq!(array.shape().get(1).copied().unwrap_or(1), field.components as u64, "{}", field.name);
                let found = &array.words()[start * field.components..][..items * field.components];
                let expected = field.values.iter().map(|value| match array.is_float() {
                    true => value.to_bits(),
                    false => *value as i64 as u64,
                });
                assert!(found.iter().copied().eq(expected), "{} at step {step}", field.name);
            }
        }
    }
}

/// A file that is not complete leaves nothing behind; steps that do not fit are refused.
#[test]
fn incomplete_files_leave_nothing_behind() {
    let problem = small();
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("path.vtkhdf");
    let entries = || fs::read_dir(&folder).expect("the folder").count();
    let mut file = VtkHdf::create(&path, &problem.mesh, 1).expect("created");
    file.step(0.0, &[]).expect("a step");
    let error = file.step(1.0, &[]).expect_err("one too many");
    assert!(matches!(error, OutputError::Series { .. }), "{error}");
    assert!(!path.exists() && entries() == 1, "only the temporary file");
    drop(file);
    assert_eq!(entries(), 0);
    let file = VtkHdf::create(&path, &problem.mesh, 1).expect("created");
    let error = file.finish().expect_err("a step is missing");
    assert!(error.to_string().contains("has 0 steps instead of 1"), "{error}");
    assert_eq!(entries(), 0);
}

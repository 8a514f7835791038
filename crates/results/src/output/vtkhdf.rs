//! A load path as one temporal VTKHDF file: the mesh once, the fields of every step.
//!
//! Format: VTK's documentation, "VTKHDF format specification", version 2.6. A step's fields follow
//! those of the step before in the same array; the group `Steps` has their offsets, and for every
//! step the offset 0 into the mesh.

use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;

use slipstick_mesh::Mesh;

use super::atomic::AtomicFile;
use super::fields::{Field, Place};
use super::hdf5::{Attribute, Dataset, Group, Hdf5, Object};
use super::vtu::{SHOWN_FIRST, check_field, check_finite};
use super::{OutputError, Values, Vtu};

/// The version of the format: 2.6 added attributes of datasets, which earlier readers ignore.
const VERSION: [i64; 2] = [2, 6];

/// A temporal file for ParaView and PyVista, written step by step; one step is in memory at a time.
///
/// The number of steps is fixed at the start, because each array lies in one piece. The file gets
/// its name when it is complete ([`VtkHdf::finish`]); if the value is dropped before, nothing is
/// left of it.
#[derive(Debug)]
pub struct VtkHdf<'a> {
    mesh: &'a Mesh,
    steps: usize,
    file: AtomicFile,
    hdf5: Hdf5<BufWriter<File>>,
    /// The arrays of the fields, in the order of the first step.
    arrays: Vec<Array>,
    times: Vec<f64>,
}

/// The array of a field over all steps.
#[derive(Debug)]
struct Array {
    name: &'static str,
    place: Place,
    type_name: &'static str,
    components: usize,
    dataset: Dataset,
}

impl<'a> VtkHdf<'a> {
    /// A file for `steps` states of a mesh.
    ///
    /// # Errors
    ///
    /// [`OutputError::Io`].
    pub fn create(path: &Path, mesh: &'a Mesh, steps: usize) -> Result<Self, OutputError> {
        let (file, writer) = AtomicFile::create(path)?;
        let hdf5 = Hdf5::new(BufWriter::with_capacity(1 << 16, writer));
        Ok(Self { mesh, steps, file, hdf5, arrays: Vec::new(), times: Vec::new() })
    }

    /// Appends a state: its pseudo-time and its fields, which are the same at every step.
    ///
    /// # Errors
    ///
    /// [`OutputError::Length`], [`OutputError::NotFinite`], [`OutputError::Series`] for a step too
    /// many or other fields than those of the first step, [`OutputError::Io`].
    pub fn step(&mut self, time: f64, fields: &[Field<'_>]) -> Result<(), OutputError> {
        let step = self.times.len();
        if step == self.steps {
            return Err(self.refused(format!("has {step} steps; this would be one too many")));
        }
        check_finite("time", Values::F64(&[time]))?;
        for field in fields {
            check_field(field.name, field.components, field.values(), field.place.name(), self.items(field.place))?;
        }
        if step == 0 {
            self.arrays = fields.iter().map(|field| self.array(field)).collect();
        }
        let same = |(array, field): (&Array, &Field<'_>)| {
            let of_array = (array.name, array.place, array.components, array.type_name);
            of_array == (field.name, field.place, field.components, field.values().type_name())
        };
        if self.arrays.len() != fields.len() || !self.arrays.iter().zip(fields).all(same) {
            return Err(self.refused(format!("has other fields at step {step} than at its first")));
        }
        for (array, field) in self.arrays.iter().zip(fields) {
            let values = field.values();
            let written = self.hdf5.write(&array.dataset, step * values.len(), values);
            written.map_err(OutputError::io("write", self.file.path()))?;
        }
        self.times.push(time);
        Ok(())
    }

    /// Completes the file and gives it its name.
    ///
    /// # Errors
    ///
    /// [`OutputError::Series`] if steps are missing; [`OutputError::NodeOutOfRange`],
    /// [`OutputError::NotFinite`] for the mesh; [`OutputError::Io`].
    pub fn finish(mut self) -> Result<(), OutputError> {
        if self.times.len() != self.steps {
            return Err(self.refused(format!("has {} steps instead of {}", self.times.len(), self.steps)));
        }
        let vtu = Vtu::new(&self.mesh.nodes, &self.mesh.elements)?;
        let written = self.root(&vtu).and_then(|root| self.hdf5.finish(&root)?.into_inner().map_err(Into::into));
        let file = written.map_err(OutputError::io("write", self.file.path()))?;
        self.file.complete(&file)
    }

    fn items(&self, place: Place) -> usize {
        match place {
            Place::Points => self.mesh.nodes.len(),
            Place::Cells => self.mesh.elements.len(),
        }
    }

    fn array(&mut self, field: &Field<'_>) -> Array {
        let &Field { name, place, components, .. } = field;
        let values = field.values();
        let items = self.steps * self.items(place);
        let shape = [items, components];
        let dataset = self.hdf5.dataset(values, if components == 1 { &shape[..1] } else { &shape });
        Array { name, place, type_name: values.type_name(), components, dataset }
    }

    /// Writes the mesh and the offsets of the steps; returns the groups that list all arrays.
    fn root(&mut self, vtu: &Vtu<'_>) -> io::Result<Group> {
        let steps = self.times.len();
        let mut file = Group { attributes: vec![Attribute::integers("Version", &VERSION)], ..Group::default() };
        file.attributes.push(Attribute::text("Type", "UnstructuredGrid"));
        let counts = [
            ("NumberOfPoints", vtu.points.len()),
            ("NumberOfCells", vtu.cells()),
            ("NumberOfConnectivityIds", vtu.connectivity.len()),
        ];
        for (name, count) in counts {
            file.add(name, self.hdf5.array(Values::I64(&[count as i64]), &[1])?);
        }
        file.add("Points", self.hdf5.array(Values::F64(vtu.points.as_flattened()), &[vtu.points.len(), 3])?);
        file.add("Connectivity", self.hdf5.array(Values::I64(&vtu.connectivity), &[vtu.connectivity.len()])?);
        let offsets: Vec<i64> = [0].into_iter().chain(vtu.offsets.iter().copied()).collect();
        file.add("Offsets", self.hdf5.array(Values::I64(&offsets), &[offsets.len()])?);
        file.add("Types", self.hdf5.array(Values::U8(&vtu.types), &[vtu.types.len()])?);
        let mut of_steps = Group { attributes: vec![Attribute::integer("NSteps", steps as i64)], ..Group::default() };
        of_steps.add("Values", self.hdf5.array(Values::F64(&self.times), &[steps])?);
        // the same part and the same cells at every step; a grid has one kind of connectivity
        let (zero, one) = (vec![0; steps], vec![1; steps]);
        of_steps.add("PartOffsets", self.hdf5.array(Values::I64(&zero), &[steps])?);
        of_steps.add("NumberOfParts", self.hdf5.array(Values::I64(&one), &[steps])?);
        of_steps.add("PointOffsets", self.hdf5.array(Values::I64(&zero), &[steps])?);
        of_steps.add("CellOffsets", self.hdf5.array(Values::I64(&zero), &[steps, 1])?);
        of_steps.add("ConnectivityIdOffsets", self.hdf5.array(Values::I64(&zero), &[steps, 1])?);
        for (place, data, starts) in
            [(Place::Points, "PointData", "PointDataOffsets"), (Place::Cells, "CellData", "CellDataOffsets")]
        {
            let items = self.items(place) as i64;
            let offsets: Vec<i64> = (0..steps as i64).map(|step| step * items).collect();
            let (mut arrays, mut of_arrays) = (Group::default(), Group::default());
            let here: Vec<&Array> = self.arrays.iter().filter(|array| array.place == place).collect();
            for array in &here {
                let mut dataset = array.dataset.clone();
                for (attribute, components) in SHOWN_FIRST {
                    let first = here.iter().find(|array| array.components == components);
                    if first.is_some_and(|first| first.name == array.name) {
                        dataset.attribute(Attribute::text("Attribute", attribute));
                    }
                }
                arrays.add(array.name, dataset);
                of_arrays.add(array.name, self.hdf5.array(Values::I64(&offsets), &[steps])?);
            }
            file.members.push((data, Object::Group(arrays)));
            of_steps.members.push((starts, Object::Group(of_arrays)));
        }
        file.members.push(("Steps", Object::Group(of_steps)));
        Ok(Group { members: vec![("VTKHDF", Object::Group(file))], ..Group::default() })
    }

    fn refused(&self, reason: String) -> OutputError {
        OutputError::Series { path: self.file.path().to_owned(), reason }
    }
}

impl Group {
    fn add(&mut self, name: &'static str, dataset: Dataset) {
        self.members.push((name, Object::Dataset(dataset)));
    }
}

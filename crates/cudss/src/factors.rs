//! Matrices and factors of cuDSS, with their lifetimes.

use crate::device::{Calls, Device, DeviceArray, Plain};
use crate::dissection::Dissection;
use crate::error::CudssError;
use crate::library::{Object, datum, number, phase, setting};
use slipstick_linalg::{CsrPattern, PatternId, Precision};
use std::ffi::c_void;
use std::sync::Arc;

/// The places of a matrix's entries, on a device.
#[derive(Debug)]
pub(crate) struct Places {
    pub(crate) id: PatternId,
    n: usize,
    entries: usize,
    offsets: DeviceArray,
    columns: DeviceArray,
}

impl Places {
    /// Those of `pattern`, which has less than 2³¹ entries.
    pub(crate) fn new(device: &Arc<Device>, pattern: &CsrPattern) -> Result<Self, CudssError> {
        let offsets: Vec<i32> = pattern.row_offsets().iter().map(|&offset| offset as i32).collect();
        let columns: Vec<i32> = pattern.columns().iter().map(|&column| column as i32).collect();
        let (offsets, columns) = (DeviceArray::of(device, &offsets)?, DeviceArray::of(device, &columns)?);
        Ok(Self { id: pattern.id(), n: pattern.n(), entries: pattern.entries(), offsets, columns })
    }
}

/// Factors of the latest matrix, with cuDSS's own analysis of its pattern.
#[derive(Debug)]
pub(crate) struct Factors {
    pub(crate) places: Arc<Places>,
    pub(crate) precision: Precision,
    values: DeviceArray,
    matrix: Matrix,
    objects: Objects,
}

/// The factors and the settings of cuDSS.
#[derive(Debug)]
struct Objects {
    device: Arc<Device>,
    config: Object,
    data: Object,
}

// SAFETY: the pointers are used only under the device's lock.
unsafe impl Send for Objects {}
// SAFETY: as above.
unsafe impl Sync for Objects {}

/// A matrix or vectors as cuDSS describes them.
#[derive(Debug)]
struct Matrix {
    device: Arc<Device>,
    raw: Object,
}

// SAFETY: the pointer is used only under the device's lock.
unsafe impl Send for Matrix {}
// SAFETY: as above.
unsafe impl Sync for Matrix {}

impl Factors {
    /// Analyses the pattern. The factors are not computed yet.
    pub(crate) fn new(
        device: &Arc<Device>,
        places: &Arc<Places>,
        precision: Precision,
        dissection: &Dissection,
    ) -> Result<Self, CudssError> {
        let values = match precision {
            Precision::F32 => DeviceArray::new::<f32>(device, places.entries)?,
            Precision::F64 => DeviceArray::new::<f64>(device, places.entries)?,
        };
        let matrix = Matrix::square(device, places, precision, &values)?;
        let factors = Self { places: places.clone(), precision, values, matrix, objects: Objects::new(device)? };
        let calls = device.calls()?;
        let Objects { config, data, .. } = factors.objects;
        let give = |call: &'static str, datum: i32, numbers: &[i32]| {
            let bytes = size_of_val(numbers);
            // SAFETY: live objects; cuDSS copies the numbers, whose count it knows.
            calls.cudss(call, |cudss| unsafe {
                (cudss.data_set)(calls.handle(), data, datum, numbers.as_ptr().cast(), bytes)
            })
        };
        // the order has no zero pivots that a matching of rows and columns would have to avoid
        set(&calls, config, setting::MATCHING, 0)?;
        set(&calls, config, setting::LEVELS, dissection.levels)?;
        give("setting the elimination order", datum::ORDER, &dissection.order)?;
        give("setting the parts of the dissection", datum::PARTS, &dissection.parts)?;
        drop(calls);
        factors.execute("analysing the pattern", phase::ANALYSIS, None)?;
        Ok(factors)
    }

    /// Computes factors of the matrix with these entries.
    pub(crate) fn renew<T: Plain>(&self, values: &[T]) -> Result<(), CudssError> {
        self.values.write(values)?;
        self.execute("factorizing", phase::FACTORIZATION, None)?;
        let mut info = 0i32;
        self.get("asking for the outcome", datum::INFO, &mut info)?;
        match info {
            0 => Ok(()),
            info => Err(CudssError::Call { call: "factorizing", code: format!("info {info}") }),
        }
    }

    /// Overwrites the vectors in `rhs`, one after the other, with A⁻¹ `rhs` or A⁻ᵀ `rhs`.
    pub(crate) fn solve<T: Plain>(&self, transpose: bool, rhs: &mut [T]) -> Result<(), CudssError> {
        let device = &self.objects.device;
        let columns = rhs.len() / self.places.n.max(1);
        let (b, x) = (DeviceArray::of(device, rhs)?, DeviceArray::new::<T>(device, rhs.len())?);
        let dense =
            |array: &DeviceArray| Matrix::dense(device, self.places.n, columns, self.precision, array.pointer());
        let vectors = [dense(&x)?, dense(&b)?];
        self.execute("solving", phase::SOLVE, Some((transpose, &vectors)))?;
        x.read(rhs)
    }

    /// Memory on the device that the factors occupy. \[bytes\]
    pub(crate) fn bytes(&self) -> Result<usize, CudssError> {
        // the first of cuDSS's estimates is that of the memory it holds on the device
        let mut estimates = [0i64; 16];
        self.get("asking for the memory", datum::MEMORY, &mut estimates)?;
        Ok(estimates[0] as usize + self.values.bytes())
    }

    /// Runs phases; for a solve, with or without the transpose, they need vectors.
    fn execute(&self, call: &'static str, phase: i32, solve: Option<(bool, &[Matrix; 2])>) -> Result<(), CudssError> {
        let device = &self.objects.device;
        // the other phases read only the shape of the vectors
        let shapes;
        let [x, b] = match solve {
            Some((_, vectors)) => vectors,
            None => {
                let dense = || Matrix::dense(device, self.places.n, 1, self.precision, std::ptr::null());
                shapes = [dense()?, dense()?];
                &shapes
            }
        };
        let (Objects { config, data, .. }, calls) = (&self.objects, device.calls()?);
        if let Some((transpose, _)) = solve {
            set(&calls, *config, setting::SOLVE_MODE, i32::from(transpose))?;
        }
        // SAFETY: live objects with arrays of their sizes, on the device.
        calls.cudss(call, |cudss| unsafe {
            (cudss.execute)(calls.handle(), phase, *config, *data, self.matrix.raw, x.raw, b.raw)
        })
    }

    fn get<T>(&self, call: &'static str, datum: i32, value: &mut T) -> Result<(), CudssError> {
        let calls = self.objects.device.calls()?;
        let (mut written, place): (usize, *mut c_void) = (0, std::ptr::from_mut(value).cast());
        // SAFETY: live objects, and a place of the given size.
        calls.cudss(call, |cudss| unsafe {
            (cudss.data_get)(calls.handle(), self.objects.data, datum, place, size_of::<T>(), &mut written)
        })
    }
}

/// Sets an integer.
fn set(calls: &Calls<'_>, config: Object, setting: i32, value: i32) -> Result<(), CudssError> {
    let place: *const c_void = std::ptr::from_ref(&value).cast();
    // SAFETY: a live object; cuDSS copies the number.
    calls.cudss("changing a setting", |cudss| unsafe { (cudss.config_set)(config, setting, place, size_of::<i32>()) })
}

impl Objects {
    fn new(device: &Arc<Device>) -> Result<Self, CudssError> {
        let mut objects = Self { device: device.clone(), config: std::ptr::null_mut(), data: std::ptr::null_mut() };
        let calls = device.calls()?;
        // SAFETY: places for the objects, which `Drop` destroys.
        calls.cudss("making the settings", |cudss| unsafe { (cudss.config_create)(&mut objects.config) })?;
        // SAFETY: as above.
        calls.cudss("making the factors", |cudss| unsafe { (cudss.data_create)(calls.handle(), &mut objects.data) })?;
        drop(calls);
        Ok(objects)
    }
}

impl Drop for Objects {
    fn drop(&mut self) {
        let Ok(calls) = self.device.calls() else { return };
        if !self.data.is_null() {
            // SAFETY: made by cuDSS, and destroyed once.
            let _ =
                calls.cudss("freeing the factors", |cudss| unsafe { (cudss.data_destroy)(calls.handle(), self.data) });
        }
        if !self.config.is_null() {
            // SAFETY: as above.
            let _ = calls.cudss("freeing the settings", |cudss| unsafe { (cudss.config_destroy)(self.config) });
        }
    }
}

impl Matrix {
    /// A general sparse matrix whose entries are in `values`.
    fn square(
        device: &Arc<Device>,
        places: &Places,
        precision: Precision,
        values: &DeviceArray,
    ) -> Result<Self, CudssError> {
        let (n, entries, kind) = (places.n as i64, places.entries as i64, number_type(precision));
        let (offsets, columns) = (places.offsets.pointer(), places.columns.pointer());
        let (general, whole, from_zero) = (0, 0, 0);
        let mut raw = std::ptr::null_mut();
        let calls = device.calls()?;
        // SAFETY: a place for the object; arrays on the device that live as long as the factors.
        calls.cudss("describing the matrix", |cudss| unsafe {
            (cudss.matrix_csr)(
                &mut raw,
                n,
                n,
                entries,
                offsets,
                std::ptr::null(),
                columns,
                values.pointer(),
                number::INT32,
                number::INT32,
                kind,
                general,
                whole,
                from_zero,
            )
        })?;
        drop(calls);
        Ok(Self { device: device.clone(), raw })
    }

    /// Vectors of `n` entries, one after the other in `values`.
    fn dense(
        device: &Arc<Device>,
        n: usize,
        columns: usize,
        precision: Precision,
        values: *const c_void,
    ) -> Result<Self, CudssError> {
        let (n, columns, column_major) = (n as i64, columns as i64, 0);
        let mut raw = std::ptr::null_mut();
        let calls = device.calls()?;
        // SAFETY: a place for the object; an array on the device with these entries, or none.
        calls.cudss("describing vectors", |cudss| unsafe {
            (cudss.matrix_dense)(&mut raw, n, columns, n, values, number_type(precision), column_major)
        })?;
        drop(calls);
        Ok(Self { device: device.clone(), raw })
    }
}

impl Drop for Matrix {
    fn drop(&mut self) {
        let Ok(calls) = self.device.calls() else { return };
        // SAFETY: made by cuDSS, and destroyed once.
        let _ = calls.cudss("freeing a description", |cudss| unsafe { (cudss.matrix_destroy)(self.raw) });
    }
}

fn number_type(precision: Precision) -> i32 {
    match precision {
        Precision::F32 => number::SINGLE,
        Precision::F64 => number::DOUBLE,
    }
}

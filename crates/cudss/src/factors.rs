//! Matrices and factors of cuDSS, with their lifetimes.

use crate::device::{Calls, Device, DeviceArray, Plain};
use crate::dissection::Dissection;
use crate::error::CudssError;
use crate::library::{Cudss, Object, datum, number, phase, setting};
use slipstick_linalg::{CsrPattern, PatternId, Precision};
use std::ffi::c_void;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

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
    /// Those of `pattern`, which has fewer than 2³¹ entries.
    pub(crate) fn new(device: &Arc<Device>, pattern: &CsrPattern) -> Result<Self, CudssError> {
        let offsets: Vec<i32> = pattern.row_offsets().iter().map(|&offset| offset as i32).collect();
        let columns: Vec<i32> = pattern.columns().iter().map(|&column| column as i32).collect();
        let (offsets, columns) = (DeviceArray::of(device, &offsets)?, DeviceArray::of(device, &columns)?);
        Ok(Self { id: pattern.id(), n: pattern.n(), entries: pattern.entries(), offsets, columns })
    }
}

/// Numbers in which factors can be computed.
pub(crate) trait Number: Plain + Send {
    const PRECISION: Precision;
}

impl Number for f32 {
    const PRECISION: Precision = Precision::F32;
}

impl Number for f64 {
    const PRECISION: Precision = Precision::F64;
}

/// Factors of the latest matrix, with cuDSS's own analysis of its pattern.
#[derive(Debug)]
pub(crate) struct Factors {
    pub(crate) precision: Precision,
    // the objects are dropped before the arrays to which they refer
    objects: Objects,
    matrix: Matrix,
    vectors: Mutex<Vectors>,
    values: DeviceArray,
    pub(crate) places: Arc<Places>,
}

/// A right-hand side and its solution, for one solve at a time.
#[derive(Debug)]
struct Vectors {
    described: [Matrix; 2],
    solution: DeviceArray,
    rhs: DeviceArray,
}

/// The factors and the settings of cuDSS.
#[derive(Debug)]
struct Objects {
    device: Arc<Device>,
    precision: Precision,
    config: Object,
    data: Object,
}

// SAFETY: the pointers are used only under the device's lock.
unsafe impl Send for Objects {}
// SAFETY: as above.
unsafe impl Sync for Objects {}

/// The description of a matrix or of a vector for cuDSS.
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
    pub(crate) fn new<T: Number>(
        device: &Arc<Device>,
        places: &Arc<Places>,
        dissection: &Dissection,
    ) -> Result<Self, CudssError> {
        let values = DeviceArray::new::<T>(device, places.entries)?;
        let factors = Self {
            precision: T::PRECISION,
            objects: Objects::new(device, T::PRECISION)?,
            matrix: Matrix::square::<T>(device, places, &values)?,
            vectors: Mutex::new(Vectors::new::<T>(device, places.n)?),
            values,
            places: places.clone(),
        };
        let Objects { config, data, .. } = factors.objects;
        let calls = device.calls()?;
        let give = |call: &'static str, datum: i32, numbers: &[i32]| {
            let bytes = size_of_val(numbers);
            // SAFETY: live objects; cuDSS copies the numbers, whose count it knows.
            calls.cudss(call, |cudss| unsafe {
                (cudss.data_set)(calls.handle(T::PRECISION), data, datum, numbers.as_ptr().cast(), bytes)
            })
        };
        // the order has no zero pivots that a matching of rows and columns would have to avoid
        set(&calls, config, setting::MATCHING, 0)?;
        set(&calls, config, setting::LEVELS, dissection.levels)?;
        give("setting the elimination order", datum::ORDER, &dissection.order)?;
        give("setting the parts of the dissection", datum::PARTS, &dissection.parts)?;
        drop(calls);
        factors.execute("analysing the pattern", phase::ANALYSIS, &factors.vectors(), None)?;
        Ok(factors)
    }

    /// Computes factors of the matrix with these entries.
    ///
    /// # Panics
    /// If they are of another precision or number.
    pub(crate) fn renew<T: Number>(&self, values: &[T]) -> Result<(), CudssError> {
        assert_eq!((T::PRECISION, values.len()), (self.precision, self.places.entries));
        self.values.write(values)?;
        self.execute("factorizing", phase::FACTORIZATION, &self.vectors(), None)?;
        let mut info = 0i32;
        self.get("asking for the outcome", datum::INFO, &mut info)?;
        match info {
            0 => Ok(()),
            info => Err(CudssError::Call { call: "factorizing", code: format!("info {info}") }),
        }
    }

    /// Overwrites `rhs` with A⁻¹ `rhs` or A⁻ᵀ `rhs`.
    ///
    /// # Panics
    /// If it has another precision or length.
    pub(crate) fn solve<T: Number>(&self, transpose: bool, rhs: &mut [T]) -> Result<(), CudssError> {
        assert_eq!((T::PRECISION, rhs.len()), (self.precision, self.places.n));
        let vectors = self.vectors();
        vectors.rhs.write(rhs)?;
        self.execute("solving", phase::SOLVE, &vectors, Some(transpose))?;
        vectors.solution.read(rhs)
    }

    /// Memory on the device that the factors occupy. \[bytes\]
    pub(crate) fn bytes(&self) -> Result<usize, CudssError> {
        // the first of cuDSS's estimates is that of the memory it holds on the device
        let mut estimates = [0i64; 16];
        self.get("asking for the memory", datum::MEMORY, &mut estimates)?;
        Ok(usize::try_from(estimates[0]).unwrap_or(0) + self.values.bytes())
    }

    fn vectors(&self) -> MutexGuard<'_, Vectors> {
        self.vectors.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Runs a phase; of the vectors, all but a solve read only the shape. A solve must know whether
    /// it is that of the transpose.
    fn execute(
        &self,
        call: &'static str,
        phase: i32,
        vectors: &Vectors,
        transpose: Option<bool>,
    ) -> Result<(), CudssError> {
        let Objects { device, config, data, .. } = &self.objects;
        let [x, b] = &vectors.described;
        let calls = device.calls()?;
        if let Some(transpose) = transpose {
            set(&calls, *config, setting::SOLVE_MODE, i32::from(transpose))?;
        }
        // SAFETY: live objects with arrays of their sizes, on the device.
        calls.cudss(call, |cudss| unsafe {
            (cudss.execute)(calls.handle(self.precision), phase, *config, *data, self.matrix.raw, x.raw, b.raw)
        })
    }

    fn get<T: Plain>(&self, call: &'static str, datum: i32, value: &mut T) -> Result<(), CudssError> {
        let calls = self.objects.device.calls()?;
        let (mut written, place): (usize, *mut c_void) = (0, std::ptr::from_mut(value).cast());
        // SAFETY: live objects, and a place of the given size; any bits are a `T`.
        calls.cudss(call, |cudss| unsafe {
            let handle = calls.handle(self.precision);
            (cudss.data_get)(handle, self.objects.data, datum, place, size_of::<T>(), &mut written)
        })
    }
}

impl Vectors {
    fn new<T: Number>(device: &Arc<Device>, n: usize) -> Result<Self, CudssError> {
        let [solution, rhs] = [DeviceArray::new::<T>(device, n)?, DeviceArray::new::<T>(device, n)?];
        let described = [Matrix::dense::<T>(device, n, &solution)?, Matrix::dense::<T>(device, n, &rhs)?];
        Ok(Self { described, solution, rhs })
    }
}

/// Sets an integer.
fn set(calls: &Calls<'_>, config: Object, setting: i32, value: i32) -> Result<(), CudssError> {
    let place: *const c_void = std::ptr::from_ref(&value).cast();
    // SAFETY: a live object; cuDSS copies the number.
    calls.cudss("changing a setting", |cudss| unsafe { (cudss.config_set)(config, setting, place, size_of::<i32>()) })
}

impl Objects {
    fn new(device: &Arc<Device>, precision: Precision) -> Result<Self, CudssError> {
        let (config, data) = (std::ptr::null_mut(), std::ptr::null_mut());
        let mut objects = Self { device: device.clone(), precision, config, data };
        let calls = device.calls()?;
        // SAFETY: places for the objects, which `Drop` destroys.
        calls.cudss("making the settings", |cudss| unsafe { (cudss.config_create)(&mut objects.config) })?;
        // SAFETY: as above.
        calls.cudss("making the factors", |cudss| unsafe {
            (cudss.data_create)(calls.handle(precision), &mut objects.data)
        })?;
        drop(calls);
        Ok(objects)
    }
}

impl Drop for Objects {
    fn drop(&mut self) {
        let Ok(calls) = self.device.calls() else { return };
        if !self.data.is_null() {
            // SAFETY: made by cuDSS, and destroyed once.
            let _ = calls.cudss("freeing the factors", |cudss| unsafe {
                (cudss.data_destroy)(calls.handle(self.precision), self.data)
            });
        }
        if !self.config.is_null() {
            // SAFETY: as above.
            let _ = calls.cudss("freeing the settings", |cudss| unsafe { (cudss.config_destroy)(self.config) });
        }
    }
}

impl Matrix {
    /// A general sparse matrix whose entries are in `values`.
    fn square<T: Number>(device: &Arc<Device>, places: &Places, values: &DeviceArray) -> Result<Self, CudssError> {
        let (n, entries, values) = (places.n as i64, places.entries as i64, values.pointer());
        let (offsets, columns) = (places.offsets.pointer(), places.columns.pointer());
        let (general, whole, from_zero) = (0, 0, 0);
        Self::described(device, "describing the matrix", |cudss, raw| {
            // SAFETY: a place for the object; arrays on the device that live as long as the factors.
            unsafe {
                (cudss.matrix_csr)(
                    raw,
                    n,
                    n,
                    entries,
                    offsets,
                    std::ptr::null(),
                    columns,
                    values,
                    number::INT32,
                    number::INT32,
                    number_type(T::PRECISION),
                    general,
                    whole,
                    from_zero,
                )
            }
        })
    }

    /// A vector of `n` entries.
    fn dense<T: Number>(device: &Arc<Device>, n: usize, values: &DeviceArray) -> Result<Self, CudssError> {
        let (n, values, column_major) = (n as i64, values.pointer(), 0);
        Self::described(device, "describing a vector", |cudss, raw| {
            // SAFETY: a place for the object; an array on the device with these entries.
            unsafe { (cudss.matrix_dense)(raw, n, 1, n, values, number_type(T::PRECISION), column_major) }
        })
    }

    fn described(
        device: &Arc<Device>,
        call: &'static str,
        describe: impl FnOnce(&Cudss, *mut Object) -> i32,
    ) -> Result<Self, CudssError> {
        let mut matrix = Self { device: device.clone(), raw: std::ptr::null_mut() };
        let calls = device.calls()?;
        calls.cudss(call, |cudss| describe(cudss, &mut matrix.raw))?;
        drop(calls);
        Ok(matrix)
    }
}

impl Drop for Matrix {
    fn drop(&mut self) {
        if self.raw.is_null() {
            return;
        }
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

//! A GPU: its context, the handle of cuDSS, and memory.

use crate::error::CudssError;
use crate::library::{Cudss, Driver, Object, property, result, status};
use slipstick_linalg::Precision;
use std::ffi::{CStr, OsStr, c_char, c_void};
use std::fmt;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Names of the two libraries where the system's loader finds them.
#[cfg(not(windows))]
const NAMES: [&[&str]; 2] = [&["libcuda.so.1", "libcuda.so"], &["libcudss.so.1", "libcudss.so"]];
#[cfg(windows)]
const NAMES: [&[&str]; 2] = [&["nvcuda.dll"], &["cudss64_1.dll"]];

/// The major version of cuDSS whose interface is used, and the first with transposed solves.
const MAJOR: i32 = 1;

/// A GPU with the CUDA driver and cuDSS. Calls from different threads are serialized.
///
/// It is the first of the devices that the environment variable `CUDA_VISIBLE_DEVICES` shows.
pub struct Device {
    driver: Driver,
    cudss: Cudss,
    context: Object,
    /// The driver's number of the device.
    number: i32,
    /// Locked during every call of the libraries.
    handles: Mutex<Handles>,
    name: String,
    version: String,
}

/// Handles of cuDSS for factors in single and in double precision: version 0.7 could not use one for
/// both. Null only while the device is opened.
struct Handles([Object; 2]);

// SAFETY: the handles are used only under the lock, while the context is that of the thread.
unsafe impl Send for Handles {}
// SAFETY: the context is only passed to the driver, which accepts it from any thread.
unsafe impl Send for Device {}
// SAFETY: as above; everything else is protected by the lock or never changes.
unsafe impl Sync for Device {}

/// The place of the device among those that CUDA shows.
const FIRST: i32 = 0;

impl Device {
    /// Loads the libraries and opens the device.
    ///
    /// # Errors
    /// [`CudssError::Library`] if a library cannot be loaded, [`CudssError::Version`] if the major
    /// version of cuDSS is not 1, [`CudssError::NoDevice`] without a GPU.
    pub fn open() -> Result<Self, CudssError> {
        let [driver, cudss] = NAMES.map(|names| names.iter().map(OsStr::new).collect::<Vec<_>>());
        // SAFETY: libraries with these names are NVIDIA's.
        unsafe { Self::load(&driver, &cudss) }
    }

    /// The same with libraries at these places.
    ///
    /// # Safety
    /// The libraries have the functions of the CUDA driver and of cuDSS, as NVIDIA documents them.
    ///
    /// # Errors
    /// As [`Device::open`].
    pub unsafe fn with_libraries(driver: &Path, cudss: &Path) -> Result<Self, CudssError> {
        // SAFETY: as for this function.
        unsafe { Self::load(&[driver.as_os_str()], &[cudss.as_os_str()]) }
    }

    /// # Safety
    /// As [`Device::with_libraries`].
    unsafe fn load(driver: &[&OsStr], cudss: &[&OsStr]) -> Result<Self, CudssError> {
        // SAFETY: as for this function; any version of the driver has these functions.
        let driver = unsafe { Driver::load(driver) }?;
        // SAFETY: as for this function; the version is checked before any other call.
        let cudss = unsafe { Cudss::load(cudss) }?;
        let mut version = [0; 3];
        for (part, number) in version.iter_mut().zip([property::MAJOR, property::MINOR, property::PATCH]) {
            // SAFETY: a place for an `int`.
            check("asking for cuDSS's version", unsafe { (cudss.property)(number, part) })?;
        }
        let [major, minor, patch] = version;
        let version = format!("{major}.{minor}.{patch}");
        if major != MAJOR {
            return Err(CudssError::Version { found: version, needed: "1" });
        }
        let mut count = 0;
        // SAFETY: no conditions; a place for an `int`.
        let started = unsafe {
            match (driver.init)(0) {
                0 => (driver.device_count)(&mut count),
                code => code,
            }
        };
        if started == result::NO_DEVICE || started == 0 && count == 0 {
            return Err(CudssError::NoDevice);
        }
        let called = |call: &'static str, code: i32| driver_check(&driver, call, code);
        called("starting CUDA", started)?;
        let (mut number, mut context, mut name) = (0, std::ptr::null_mut(), [0 as c_char; 256]);
        // SAFETY: the driver has started; places for its results.
        unsafe {
            called("finding the device", (driver.device)(&mut number, FIRST))?;
            called("asking for the device's name", (driver.device_name)(name.as_mut_ptr(), name.len() as i32, number))?;
            called("opening the device", (driver.retain_context)(&mut context, number))?;
        }
        // SAFETY: the driver ends the name with a zero, within its length.
        let name = unsafe { CStr::from_ptr(name.as_ptr()) }.to_string_lossy().into_owned();
        let handles = Mutex::new(Handles([std::ptr::null_mut(); 2]));
        let device = Self { driver, cudss, context, number, handles, name, version };
        let mut calls = device.calls()?;
        for precision in 0..2 {
            // cuDSS asks to destroy handles even of failed calls, which `Drop` does
            let mut handle = std::ptr::null_mut();
            // SAFETY: the context is that of this thread; a place for the handle.
            let created = calls.cudss("starting cuDSS", |cudss| unsafe { (cudss.create)(&mut handle) });
            calls.handles.0[precision] = handle;
            created?;
        }
        drop(calls);
        Ok(device)
    }

    /// Name of the GPU.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Version of cuDSS.
    pub fn version(&self) -> &str {
        &self.version
    }

    /// Free and total memory of the device. \[bytes\]
    ///
    /// # Errors
    /// [`CudssError::Call`] if the driver fails.
    pub fn memory(&self) -> Result<[usize; 2], CudssError> {
        self.calls()?.memory()
    }

    /// The right to call the libraries, with the device's context as that of the thread. It must be
    /// dropped before it is asked for again.
    pub(crate) fn calls(&self) -> Result<Calls<'_>, CudssError> {
        let handles = self.handles.lock().unwrap_or_else(PoisonError::into_inner);
        // SAFETY: a context of the driver.
        driver_check(&self.driver, "choosing the device", unsafe { (self.driver.push_context)(self.context) })?;
        Ok(Calls { device: self, handles })
    }
}

impl fmt::Debug for Device {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Device").field("name", &self.name).field("cudss", &self.version).finish_non_exhaustive()
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        if let Ok(calls) = self.calls() {
            for handle in calls.handles.0.into_iter().filter(|handle| !handle.is_null()) {
                // SAFETY: created by cuDSS and destroyed once; factors keep the device alive.
                unsafe { (self.cudss.destroy)(handle) };
            }
        }
        // SAFETY: retained once.
        unsafe { (self.driver.release_context)(self.number) };
    }
}

/// The right to call the libraries.
pub(crate) struct Calls<'a> {
    device: &'a Device,
    handles: MutexGuard<'a, Handles>,
}

impl Drop for Calls<'_> {
    /// Gives the thread back the context that it had.
    fn drop(&mut self) {
        let mut context = std::ptr::null_mut();
        // SAFETY: a place for the context that `calls` has pushed.
        unsafe { (self.device.driver.pop_context)(&mut context) };
    }
}

impl Calls<'_> {
    /// The handle of cuDSS for factors of the given precision.
    pub(crate) fn handle(&self, precision: Precision) -> Object {
        self.handles.0[usize::from(precision == Precision::F64)]
    }

    /// Calls the driver.
    pub(crate) fn driver(&self, call: &'static str, run: impl FnOnce(&Driver) -> i32) -> Result<(), CudssError> {
        match run(&self.device.driver) {
            result::OUT_OF_MEMORY => Err(self.full(call)),
            code => driver_check(&self.device.driver, call, code),
        }
    }

    /// Calls cuDSS.
    pub(crate) fn cudss(&self, call: &'static str, run: impl FnOnce(&Cudss) -> i32) -> Result<(), CudssError> {
        match run(&self.device.cudss) {
            status::OUT_OF_MEMORY => Err(self.full(call)),
            code => check(call, code),
        }
    }

    fn memory(&self) -> Result<[usize; 2], CudssError> {
        let [mut free, mut total] = [0; 2];
        // SAFETY: the context is that of this thread; places for two sizes.
        self.driver("asking for free memory", |driver| unsafe { (driver.memory)(&mut free, &mut total) })?;
        Ok([free, total])
    }

    fn full(&self, call: &'static str) -> CudssError {
        let [mut free, mut total] = [0; 2];
        // SAFETY: as in `memory`; if this fails too, the sizes stay zero.
        unsafe { (self.device.driver.memory)(&mut free, &mut total) };
        let [free, total] = [free, total].map(|bytes| bytes / 1_000_000);
        CudssError::Memory { call, device: self.device.name.clone(), free, total }
    }
}

fn check(call: &'static str, code: i32) -> Result<(), CudssError> {
    let meaning = || status::MEANING.get(code as usize).copied().unwrap_or("unknown error");
    if code == 0 { Ok(()) } else { Err(CudssError::Call { call, code: format!("code {code} ({})", meaning()) }) }
}

fn driver_check(driver: &Driver, call: &'static str, code: i32) -> Result<(), CudssError> {
    if code == 0 {
        return Ok(());
    }
    let mut name = std::ptr::null();
    // SAFETY: a place for a pointer to a constant string.
    let known = unsafe { (driver.error_name)(code, &mut name) } == 0 && !name.is_null();
    // SAFETY: the driver's constant ends with a zero.
    let meaning = || unsafe { CStr::from_ptr(name) }.to_string_lossy().into_owned();
    let code = if known { format!("code {code} ({})", meaning()) } else { format!("code {code}") };
    Err(CudssError::Call { call, code })
}

/// An array in the memory of a device.
#[derive(Debug)]
pub(crate) struct DeviceArray {
    device: Arc<Device>,
    address: u64,
    bytes: usize,
}

/// Numbers.
///
/// # Safety
/// They have no padding, and any bits are a value.
pub(crate) unsafe trait Plain: Copy {}
// SAFETY: integers and floating-point numbers are such.
unsafe impl Plain for i32 {}
// SAFETY: as above.
unsafe impl Plain for i64 {}
// SAFETY: as above.
unsafe impl Plain for f32 {}
// SAFETY: as above.
unsafe impl Plain for f64 {}
// SAFETY: an array has no padding between its elements.
unsafe impl<T: Plain, const N: usize> Plain for [T; N] {}

impl DeviceArray {
    /// An array of `count` numbers, not initialized.
    pub(crate) fn new<T: Plain>(device: &Arc<Device>, count: usize) -> Result<Self, CudssError> {
        let bytes = size_of::<T>() * count.max(1);
        let mut address = 0;
        let calls = device.calls()?;
        // SAFETY: the context is that of this thread; a place for the address.
        calls.driver("allocating an array", |driver| unsafe { (driver.allocate)(&mut address, bytes) })?;
        drop(calls);
        Ok(Self { device: device.clone(), address, bytes })
    }

    /// A copy of `values`.
    pub(crate) fn of<T: Plain>(device: &Arc<Device>, values: &[T]) -> Result<Self, CudssError> {
        let array = Self::new::<T>(device, values.len())?;
        array.write(values)?;
        Ok(array)
    }

    /// Copies `values` to the beginning of the array.
    ///
    /// # Panics
    /// If the array is smaller.
    pub(crate) fn write<T: Plain>(&self, values: &[T]) -> Result<(), CudssError> {
        let bytes = size_of_val(values);
        assert!(bytes <= self.bytes, "the array has room for the values");
        let source: *const c_void = values.as_ptr().cast();
        let calls = self.device.calls()?;
        // SAFETY: `bytes` bytes can be read, and written to the array.
        calls.driver("copying to the device", |driver| unsafe { (driver.to_device)(self.address, source, bytes) })
    }

    /// Copies from the beginning of the array to `values`, after everything that the device is
    /// doing.
    ///
    /// # Panics
    /// If the array is smaller.
    pub(crate) fn read<T: Plain>(&self, values: &mut [T]) -> Result<(), CudssError> {
        let bytes = size_of_val(values);
        assert!(bytes <= self.bytes, "the array has the values");
        let target: *mut c_void = values.as_mut_ptr().cast();
        let calls = self.device.calls()?;
        // SAFETY: `bytes` bytes can be written, and read from the array; any bits are a `T`.
        calls.driver("copying from the device", |driver| unsafe { (driver.to_host)(target, self.address, bytes) })
    }

    /// For cuDSS, which takes addresses of the device as pointers.
    pub(crate) fn pointer(&self) -> *const c_void {
        self.address as usize as *const c_void
    }

    pub(crate) fn bytes(&self) -> usize {
        self.bytes
    }
}

impl Drop for DeviceArray {
    fn drop(&mut self) {
        let Ok(calls) = self.device.calls() else { return };
        // SAFETY: allocated by the driver and freed once. It waits until the device has finished
        // using it.
        let _ = calls.driver("freeing an array", |driver| unsafe { (driver.free)(self.address) });
    }
}

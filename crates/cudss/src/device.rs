//! A GPU: its context, the handle of cuDSS, and memory.

use crate::error::CudssError;
use crate::library::{Cudss, Driver, Object, property, result, status};
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
    /// Null only while the device is opened. Whoever holds the lock may call the libraries.
    handle: Mutex<Handle>,
    name: String,
    version: String,
}

struct Handle(Object);

// SAFETY: the handle is used only under the lock, after the context has been made that of the
// thread.
unsafe impl Send for Handle {}
// SAFETY: the context is only passed to the driver, which accepts it from any thread.
unsafe impl Send for Device {}
// SAFETY: as above; everything else is protected by the lock or never changes.
unsafe impl Sync for Device {}

/// The number of the only device that is used.
const FIRST: i32 = 0;

impl Device {
    /// Loads the libraries and opens the device.
    ///
    /// # Errors
    /// [`CudssError::Library`] if a library cannot be loaded, [`CudssError::Version`] if cuDSS is
    /// another one, [`CudssError::NoDevice`] without a GPU.
    pub fn open() -> Result<Self, CudssError> {
        let [driver, cudss] = NAMES.map(|names| names.iter().map(OsStr::new).collect::<Vec<_>>());
        Self::load(&driver, &cudss)
    }

    /// The same with libraries at these places.
    ///
    /// # Errors
    /// As [`Device::open`].
    pub fn with_libraries(driver: &Path, cudss: &Path) -> Result<Self, CudssError> {
        Self::load(&[driver.as_os_str()], &[cudss.as_os_str()])
    }

    fn load(driver: &[&OsStr], cudss: &[&OsStr]) -> Result<Self, CudssError> {
        // SAFETY: these are the documented functions of the driver, which any version has.
        let driver = unsafe { Driver::load(driver) }?;
        // SAFETY: these are the documented functions of cuDSS 1; the version is checked before any
        // other call.
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
        let handle = Mutex::new(Handle(std::ptr::null_mut()));
        let mut device = Self { driver, cudss, context, handle, name, version };
        let mut handle = std::ptr::null_mut();
        let calls = device.calls()?;
        // SAFETY: the context is that of this thread; a place for the handle.
        let created = calls.cudss("starting cuDSS", |cudss| unsafe { (cudss.create)(&mut handle) });
        drop(calls);
        // cuDSS asks to destroy handles even of failed calls, which `Drop` does
        device.handle.get_mut().unwrap_or_else(PoisonError::into_inner).0 = handle;
        created.map(|()| device)
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

    /// The right to call the libraries, with the device's context as that of the thread.
    pub(crate) fn calls(&self) -> Result<Calls<'_>, CudssError> {
        let handle = self.handle.lock().unwrap_or_else(PoisonError::into_inner);
        let calls = Calls { device: self, handle };
        // SAFETY: a context of the driver.
        calls.driver("choosing the device", |driver| unsafe { (driver.set_context)(self.context) })?;
        Ok(calls)
    }
}

impl fmt::Debug for Device {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Device").field("name", &self.name).field("cudss", &self.version).finish_non_exhaustive()
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        let Ok(calls) = self.calls() else { return };
        let handle = calls.handle();
        if !handle.is_null() {
            // SAFETY: created by cuDSS and destroyed once; factors keep the device alive.
            unsafe { (self.cudss.destroy)(handle) };
        }
        drop(calls);
        // SAFETY: retained once.
        unsafe { (self.driver.release_context)(FIRST) };
    }
}

/// The right to call the libraries.
pub(crate) struct Calls<'a> {
    device: &'a Device,
    handle: MutexGuard<'a, Handle>,
}

impl Calls<'_> {
    /// The handle of cuDSS.
    pub(crate) fn handle(&self) -> Object {
        self.handle.0
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
        let [free, total] = self.memory().unwrap_or_default().map(|bytes| bytes / 1_000_000);
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

/// Numbers without padding, of which any bits are a value.
pub(crate) trait Plain: Copy {}
impl Plain for i32 {}
impl Plain for f32 {}
impl Plain for f64 {}

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

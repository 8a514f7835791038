//! The functions of the CUDA driver and of cuDSS, found at run time.

use crate::error::CudssError;
use libloading::Library;
use std::error::Error;
use std::ffi::{OsStr, c_char, c_void};

/// A table of C functions that return an error code.
macro_rules! functions {
    ($(#[$doc:meta])* $table:ident from $library:literal { $($name:ident = $symbol:literal($($argument:ty),*);)* }) => {
        $(#[$doc])*
        pub(crate) struct $table {
            $(pub(crate) $name: unsafe extern "C" fn($($argument),*) -> i32,)*
        }

        impl $table {
            /// From the first of the libraries `names` that can be loaded.
            ///
            /// # Safety
            /// The library has these functions, with these arguments.
            pub(crate) unsafe fn load(names: &[&OsStr]) -> Result<Self, CudssError> {
                let failed = |error: libloading::Error| {
                    let reason = error.source().map_or(error.to_string(), ToString::to_string);
                    CudssError::Library { library: $library, reason }
                };
                // SAFETY: as for this function.
                let mut attempts = names.iter().map(|&name| unsafe { Library::new(name) });
                let first = attempts.next().expect("a name is given");
                let library = first.or_else(|error| attempts.find_map(Result::ok).ok_or(error)).map_err(failed)?;
                // SAFETY: as for this function.
                $(let $name = *unsafe {
                    library.get::<unsafe extern "C" fn($($argument),*) -> i32>($symbol).map_err(failed)?
                };)*
                // CUDA cannot be unloaded safely: its threads run until the process ends
                std::mem::forget(library);
                Ok(Self { $($name,)* })
            }
        }
    };
}

/// A pointer to an opaque object of a library.
pub(crate) type Object = *mut c_void;

functions! {
    /// The CUDA driver, with the functions whose names have ended in `_v2` since CUDA 4.
    Driver from "the CUDA driver" {
        init = b"cuInit\0"(u32);
        device_count = b"cuDeviceGetCount\0"(*mut i32);
        device = b"cuDeviceGet\0"(*mut i32, i32);
        device_name = b"cuDeviceGetName\0"(*mut c_char, i32, i32);
        retain_context = b"cuDevicePrimaryCtxRetain\0"(*mut Object, i32);
        release_context = b"cuDevicePrimaryCtxRelease_v2\0"(i32);
        push_context = b"cuCtxPushCurrent_v2\0"(Object);
        pop_context = b"cuCtxPopCurrent_v2\0"(*mut Object);
        memory = b"cuMemGetInfo_v2\0"(*mut usize, *mut usize);
        allocate = b"cuMemAlloc_v2\0"(*mut u64, usize);
        free = b"cuMemFree_v2\0"(u64);
        to_device = b"cuMemcpyHtoD_v2\0"(u64, *const c_void, usize);
        to_host = b"cuMemcpyDtoH_v2\0"(*mut c_void, u64, usize);
        error_name = b"cuGetErrorName\0"(i32, *mut *const c_char);
    }
}

functions! {
    /// cuDSS. Reference: NVIDIA cuDSS 1.0 documentation, "cuDSS Functions".
    Cudss from "cuDSS" {
        property = b"cudssGetProperty\0"(i32, *mut i32);
        create = b"cudssCreate\0"(*mut Object);
        destroy = b"cudssDestroy\0"(Object);
        config_create = b"cudssConfigCreate\0"(*mut Object);
        config_destroy = b"cudssConfigDestroy\0"(Object);
        config_set = b"cudssConfigSet\0"(Object, i32, *const c_void, usize);
        data_create = b"cudssDataCreate\0"(Object, *mut Object);
        data_destroy = b"cudssDataDestroy\0"(Object, Object);
        data_set = b"cudssDataSet\0"(Object, Object, i32, *const c_void, usize);
        data_get = b"cudssDataGet\0"(Object, Object, i32, *mut c_void, usize, *mut usize);
        matrix_dense = b"cudssMatrixCreateDn\0"(*mut Object, i64, i64, i64, *const c_void, i32, i32);
        matrix_csr = b"cudssMatrixCreateCsr\0"(
            *mut Object, i64, i64, i64, *const c_void, *const c_void, *const c_void, *const c_void,
            i32, i32, i32, i32, i32, i32
        );
        matrix_destroy = b"cudssMatrixDestroy\0"(Object);
        execute = b"cudssExecute\0"(Object, i32, Object, Object, Object, Object, Object);
    }
}

/// Codes of the CUDA driver (`CUresult`).
pub(crate) mod result {
    pub(crate) const OUT_OF_MEMORY: i32 = 2;
    pub(crate) const NO_DEVICE: i32 = 100;
}

/// Codes of cuDSS (`cudssStatus_t`) and their meaning.
pub(crate) mod status {
    pub(crate) const OUT_OF_MEMORY: i32 = 2;
    pub(crate) const MEANING: [&str; 8] = [
        "success",
        "not initialized",
        "allocation failed",
        "invalid value",
        "not supported",
        "execution failed",
        "internal error",
        "iterative refinement failed",
    ];
}

/// Number types (`cudaDataType_t`).
pub(crate) mod number {
    pub(crate) const SINGLE: i32 = 0;
    pub(crate) const DOUBLE: i32 = 1;
    pub(crate) const INT32: i32 = 10;
}

/// Parts of the version (`libraryPropertyType`).
pub(crate) mod property {
    pub(crate) const MAJOR: i32 = 0;
    pub(crate) const MINOR: i32 = 1;
    pub(crate) const PATCH: i32 = 2;
}

/// Settings (`cudssConfigParam_t` of version 1), each an `int`.
pub(crate) mod setting {
    pub(crate) const MATCHING: i32 = 3;
    pub(crate) const SOLVE_MODE: i32 = 4;
    pub(crate) const LEVELS: i32 = 17;
}

/// Properties of factors (`cudssDataParam_t` of version 1).
pub(crate) mod datum {
    pub(crate) const INFO: i32 = 0;
    pub(crate) const ORDER: i32 = 9;
    pub(crate) const MEMORY: i32 = 13;
    pub(crate) const PARTS: i32 = 21;
}

/// Parts of a solution (`cudssPhase_t`).
pub(crate) mod phase {
    pub(crate) const ANALYSIS: i32 = 1 | 2;
    pub(crate) const FACTORIZATION: i32 = 1 << 2;
    /// Permutations and substitutions, without refinement.
    pub(crate) const SOLVE: i32 = 1 << 4 | 1 << 5 | 1 << 6 | 1 << 7 | 1 << 8;
}

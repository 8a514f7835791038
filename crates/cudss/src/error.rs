//! Errors of the CUDA driver and of cuDSS.

/// An error of the CUDA driver or of cuDSS.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CudssError {
    /// A library or one of its functions was not found.
    #[error("{library} cannot be loaded: {reason}")]
    Library {
        /// The library.
        library: &'static str,
        /// The reason, as the system reports it.
        reason: String,
    },
    /// The major version of cuDSS is not supported.
    #[error("found cuDSS {found}, but version {needed} is required")]
    Version {
        /// The version found.
        found: String,
        /// The version required.
        needed: &'static str,
    },
    /// The driver reports no GPU.
    #[error("there is no NVIDIA GPU that CUDA can use")]
    NoDevice,
    /// The memory of the device is too small.
    #[error("{device} has too little memory for {call}: {free} of {total} MB are free")]
    Memory {
        /// The attempted operation.
        call: &'static str,
        /// Name of the device.
        device: String,
        /// Free memory. \[MB\]
        free: usize,
        /// Memory of the device. \[MB\]
        total: usize,
    },
    /// A call failed.
    #[error("{call} failed with {code}")]
    Call {
        /// The attempted operation.
        call: &'static str,
        /// The library's error code, with its meaning if that is known.
        code: String,
    },
}

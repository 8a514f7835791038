//! Fuzz targets of slipstick, and the allocator that makes a huge allocation a finding.

pub mod targets;

use std::alloc::{GlobalAlloc, Layout, System};

/// No reader of a file of some kilobytes has a use for as much at once. \[bytes\]
const LARGEST: usize = 256 << 20;

/// The system's allocator, which ends the process at a single request for more than [`LARGEST`].
struct Bounded;

#[global_allocator]
static ALLOCATOR: Bounded = Bounded;

fn bound(size: usize) {
    if size > LARGEST {
        eprintln!("an allocation of {size} bytes");
        std::process::abort();
    }
}

// SAFETY: all calls go to the system's allocator unchanged.
unsafe impl GlobalAlloc for Bounded {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        bound(layout.size());
        // SAFETY: the caller's layout.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        bound(layout.size());
        // SAFETY: the caller's layout.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        bound(size);
        // SAFETY: the caller's pointer and layout.
        unsafe { System.realloc(pointer, layout, size) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's pointer and layout.
        unsafe { System.dealloc(pointer, layout) }
    }
}

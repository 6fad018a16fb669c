//! What all targets share: an allocator that ends the process when a reader asks for far more than its input is worth.
//!
//! libFuzzer's own limit for one allocation needs a sanitizer, hence a nightly compiler; this one does not.

use std::alloc::{GlobalAlloc, Layout, System};

/// No input of a target is longer than some 100 KB; nothing that it holds is worth this much in one piece [bytes].
pub const LARGEST: usize = 64 << 20;

struct Capped;

// SAFETY: all is handed on to the system's allocator, unchanged, or the process ends.
unsafe impl GlobalAlloc for Capped {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        check(layout.size());
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        check(layout.size());
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        check(size);
        unsafe { System.realloc(pointer, layout, size) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }
}

fn check(size: usize) {
    if size > LARGEST {
        eprintln!("an allocation of {size} bytes for a small input");
        std::process::abort();
    }
}

#[global_allocator]
static ALLOCATOR: Capped = Capped;

/// Makes sure that this crate, and with it the allocator, is linked.
pub fn watch() {}

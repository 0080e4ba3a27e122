//! Memory: an allocator that lets the process outlive an allocation that fails, and what Python hears of it.
//!
//! Rust aborts the process where a vector cannot grow. The large arrays of the engine are asked for and may be refused; for all the
//! small ones a reserve is kept, which is given back to the system when the first of them fails. The work then has room to end.

use std::alloc::{GlobalAlloc, Layout, System};
use std::hint::spin_loop;
use std::ptr;
use std::sync::atomic::{AtomicPtr, AtomicUsize, Ordering::SeqCst};

use pyo3::import_exception;
use pyo3::prelude::*;

import_exception!(photogram.errors, OutOfMemoryError);

/// Kept for allocations that fail: addresses only, no page of it is ever touched.
const RESERVE: usize = 64 << 20;
/// Left free beside the reserve when threads are started, for their stacks.
const MARGIN: usize = 16 << 20;
/// A larger allocation is not saved by the reserve: whoever asks for so much asks whether it is there.
const LARGE: usize = 16 << 20;
/// Rounds that a thread waits for another one that is just giving the reserve back.
const PATIENCE: usize = 1 << 16;

static KEPT: AtomicPtr<u8> = AtomicPtr::new(ptr::null_mut());
/// Bytes of the last allocation that failed since the work began; 0 where none did.
static FAILED: AtomicUsize = AtomicUsize::new(0);

/// The allocator of the system, with a reserve.
pub struct Reserved;

// SAFETY: every call is passed on to the allocator of the system, with the arguments that it was made with.
unsafe impl GlobalAlloc for Reserved {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller keeps the contract of `alloc`.
        or_again(layout.size(), || unsafe { System.alloc(layout) })
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller keeps the contract of `alloc_zeroed`.
        or_again(layout.size(), || unsafe { System.alloc_zeroed(layout) })
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: the caller keeps the contract of `realloc`; a failure leaves the old block as it was.
        or_again(size, || unsafe { System.realloc(pointer, layout, size) })
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps the contract of `dealloc`.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[inline(always)]
fn or_again(size: usize, allocate: impl Fn() -> *mut u8) -> *mut u8 {
    let pointer = allocate();
    if pointer.is_null() { again(size, allocate) } else { pointer }
}

/// Gives the reserve back and tries once more.
#[cold]
fn again(size: usize, allocate: impl Fn() -> *mut u8) -> *mut u8 {
    FAILED.store(size.max(1), SeqCst);
    if size > LARGE {
        return ptr::null_mut();
    }
    let kept = KEPT.swap(ptr::null_mut(), SeqCst);
    if !kept.is_null() {
        // SAFETY: it was allocated with this layout, and nobody else has it any more.
        unsafe { System.dealloc(kept, reserve()) };
        return allocate();
    }
    for _ in 0..PATIENCE {
        let pointer = allocate();
        if !pointer.is_null() {
            return pointer;
        }
        spin_loop();
    }
    ptr::null_mut()
}

const fn reserve() -> Layout {
    match Layout::from_size_align(RESERVE, 4096) {
        Ok(layout) => layout,
        Err(_) => Layout::new::<u8>(),
    }
}

/// Puts the reserve in its place before work begins.
///
/// # Errors
/// There is no memory for it, nor for the stacks of threads beside it.
pub fn arm() -> PyResult<()> {
    FAILED.store(0, SeqCst);
    // SAFETY: the layout is not empty.
    let fresh = || unsafe { System.alloc(reserve()) };
    if KEPT.load(SeqCst).is_null() {
        let reserve_kept = fresh();
        let other = KEPT.swap(reserve_kept, SeqCst);
        if !other.is_null() {
            // SAFETY: another thread allocated it with this layout, and nobody has it any more.
            unsafe { System.dealloc(other, reserve()) };
        }
    }
    let mut margin: Vec<u8> = Vec::new();
    if KEPT.load(SeqCst).is_null() || margin.try_reserve_exact(MARGIN).is_err() {
        return Err(exhausted("there is no memory left to begin with"));
    }
    // Or the compiler would see that nobody needs it.
    std::hint::black_box(margin.as_mut_ptr());
    Ok(())
}

/// Whether an allocation has failed since the work began.
pub fn failed() -> bool {
    FAILED.load(SeqCst) > 0
}

/// What Python hears when one has failed.
pub fn failure() -> PyErr {
    exhausted(&format!("an allocation of {} bytes failed: there is not enough memory", FAILED.load(SeqCst)))
}

/// An error of memory.
pub fn exhausted(message: &str) -> PyErr {
    OutOfMemoryError::new_err(message.to_owned())
}

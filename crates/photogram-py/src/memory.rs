//! Memory: an allocator that reports failed allocations to Python and prevents an abort.
//!
//! Rust aborts the process if a vector cannot grow. Large arrays of the engine are allocated fallibly. For small arrays the allocator holds
//! a reserve, which it releases at the first failure so that the computation can end regularly.
//!
//! Matrix products use buffers per thread, twice the size of the last-level cache. The library allocates them with the first large product
//! and aborts if this fails. They are therefore allocated before the computation, so that a failure is an error.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::fs::read_to_string;
use std::hint::{black_box, spin_loop};
use std::ptr;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicPtr, AtomicUsize, Ordering::SeqCst};

use photocore::normals::preallocate_product_buffers;
use pyo3::import_exception;
use pyo3::prelude::*;

import_exception!(photogram.errors, OutOfMemoryError);

/// Size of the modules that Python loads with the first adjustment, and of memory retained by the allocator.
pub const LOADED: usize = 40 << 20;
/// Size of the reserve for failed allocations: address space only, its pages are never touched.
const RESERVE: usize = 64 << 20;
/// Free address space in addition to the reserve when threads are started, for their stacks.
const MARGIN: usize = 16 << 20;
/// Size above which an allocation does not use the reserve: callers of large allocations handle failures.
const LARGE: usize = 16 << 20;
/// Number of spins while another thread releases the reserve.
const PATIENCE: usize = 1 << 16;

static KEPT: AtomicPtr<u8> = AtomicPtr::new(ptr::null_mut());
/// Number of failed allocations. It increases monotonically: each job compares it with the value at its start.
static FAILURES: AtomicUsize = AtomicUsize::new(0);
/// Size in bytes of the last failed allocation.
static LAST: AtomicUsize = AtomicUsize::new(0);

/// System allocator with a reserve.
pub struct Reserved;

// SAFETY: every call is forwarded to the system allocator with unchanged arguments.
unsafe impl GlobalAlloc for Reserved {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller satisfies the contract of `alloc`.
        or_again(layout.size(), || unsafe { System.alloc(layout) })
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller satisfies the contract of `alloc_zeroed`.
        or_again(layout.size(), || unsafe { System.alloc_zeroed(layout) })
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: the caller satisfies the contract of `realloc`; a failure leaves the old block unchanged.
        or_again(size, || unsafe { System.realloc(pointer, layout, size) })
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller satisfies the contract of `dealloc`.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[inline(always)]
fn or_again(size: usize, allocate: impl Fn() -> *mut u8) -> *mut u8 {
    let pointer = allocate();
    if pointer.is_null() { again(size, allocate) } else { pointer }
}

/// Releases the thread's room or the reserve, and retries.
#[cold]
fn again(size: usize, allocate: impl Fn() -> *mut u8) -> *mut u8 {
    if let Some(room) = ROOM.take() {
        room.give_back();
        let pointer = allocate();
        if !pointer.is_null() {
            return pointer;
        }
    }
    LAST.store(size, SeqCst);
    FAILURES.fetch_add(1, SeqCst);
    if size > LARGE {
        return ptr::null_mut();
    }
    let kept = KEPT.swap(ptr::null_mut(), SeqCst);
    if !kept.is_null() {
        // SAFETY: it was allocated with this layout, and the swap made this thread its only owner.
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

/// Number of failed allocations at the start of a job.
#[derive(Clone, Copy)]
pub struct Failures(usize);

impl Failures {
    /// Returns whether an allocation of any job has failed since.
    pub fn more(self) -> bool {
        FAILURES.load(SeqCst) != self.0
    }
}

/// Allocates the reserve before a computation.
///
/// # Errors
/// Insufficient memory for the reserve, or for the stacks of threads.
pub fn arm() -> PyResult<Failures> {
    let before = Failures(FAILURES.load(SeqCst));
    // SAFETY: the layout is not empty.
    let fresh = || unsafe { System.alloc(reserve()) };
    if KEPT.load(SeqCst).is_null() {
        let reserve_kept = fresh();
        let other = KEPT.swap(reserve_kept, SeqCst);
        if !other.is_null() {
            // SAFETY: another thread allocated it with this layout, and the swap made this thread its only owner.
            unsafe { System.dealloc(other, reserve()) };
        }
    }
    let mut margin: Vec<u8> = Vec::new();
    if KEPT.load(SeqCst).is_null() || margin.try_reserve_exact(MARGIN).is_err() {
        return Err(exhausted("there is no memory left to begin with"));
    }
    // Prevents the compiler from removing the unused allocation.
    black_box(margin.as_mut_ptr());
    Ok(before)
}

/// Address space reserved by a thread until its buffers are allocated.
#[derive(Clone, Copy)]
struct Room(*mut u8, Layout);

impl Room {
    fn give_back(self) {
        // SAFETY: it was allocated with this layout, and is released once.
        unsafe { System.dealloc(self.0, self.1) }
    }
}

thread_local! {
    static ROOM: Cell<Option<Room>> = const { Cell::new(None) };
    static HAS_BUFFERS: Cell<bool> = const { Cell::new(false) };
}

/// Allocates the buffers for matrix products on this thread, once; returns whether memory was sufficient.
pub fn take_buffers() -> bool {
    if HAS_BUFFERS.get() {
        return true;
    }
    let Ok(layout) = Layout::from_size_align(buffers(), 4096) else { return false };
    // SAFETY: the layout is not empty.
    let pointer = unsafe { System.alloc(layout) };
    if pointer.is_null() {
        return false;
    }
    // If memory is insufficient for both, the room is released for the buffers.
    ROOM.set(Some(Room(pointer, layout)));
    preallocate_product_buffers();
    if let Some(room) = ROOM.take() {
        room.give_back();
    }
    HAS_BUFFERS.set(true);
    true
}

/// Default size of the last-level cache, if the system does not report one.
const CACHE: usize = 4 << 20;

/// Returns the size in bytes of the buffers of a thread: twice the last-level cache of all processors, as computed by the library.
fn buffers() -> usize {
    static BYTES: OnceLock<usize> = OnceLock::new();
    *BYTES.get_or_init(|| {
        let columns = |name: &str| read_to_string(format!("/sys/devices/system/cpu/{name}")).ok();
        let size =
            columns("cpu0/cache/index3/size").and_then(|size| size.trim().strip_suffix('K')?.parse().ok());
        let last = columns("present").and_then(|all| all.trim().rsplit(['-', ',']).next()?.parse().ok());
        let sharing = columns("cpu0/cache/index3/shared_cpu_map")
            .map_or(1, |map| map.chars().filter_map(|digit| digit.to_digit(16)).map(u32::count_ones).sum());
        let caches = (last.unwrap_or(0) + 1usize).div_ceil(sharing.max(1) as usize);
        2 * size.map_or(CACHE, |kibibytes: usize| 1024 * kibibytes).max(CACHE) * caches
    })
}

/// Returns freed memory to the system, if this is supported. The allocator otherwise retains smaller blocks for later allocations, which
/// may have other sizes.
#[pyfunction]
pub fn give_back() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        unsafe extern "C" {
            safe fn malloc_trim(pad: usize) -> i32;
        }
        malloc_trim(0);
    }
}

/// Returns the exception for insufficient memory for the buffers.
pub fn no_buffers() -> PyErr {
    exhausted(&format!(
        "products of matrices take {} MiB of addresses for each thread, and there are not so many: fewer threads, or a higher limit",
        buffers() >> 20
    ))
}

/// Returns the exception for a failed allocation.
pub fn failure() -> PyErr {
    exhausted(&format!("an allocation of {} bytes failed: there is not enough memory", LAST.load(SeqCst)))
}

/// Returns a memory exception with a message.
pub fn exhausted(message: &str) -> PyErr {
    OutOfMemoryError::new_err(message.to_owned())
}

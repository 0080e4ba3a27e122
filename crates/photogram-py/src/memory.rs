//! Memory: an allocator that lets the process outlive an allocation that fails, and what Python hears of it.
//!
//! Rust aborts the process where a vector cannot grow. The large arrays of the engine are asked for and may be refused; for all the
//! small ones a reserve is kept, which is given back to the system when the first of them fails. The work then has room to end.
//!
//! Products of matrices have buffers for each thread, twice the last cache, which the library takes with the first larger product and
//! ends the process where it gets none. They are taken before work begins, where a failure is an error.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::fs::read_to_string;
use std::hint::{black_box, spin_loop};
use std::ptr;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicPtr, AtomicUsize, Ordering::SeqCst};

use photocore::normals::take_product_buffers;
use pyo3::import_exception;
use pyo3::prelude::*;

import_exception!(photogram.errors, OutOfMemoryError);

/// What Python loads with the first adjustment, and room that the allocator keeps.
pub const LOADED: usize = 40 << 20;
/// Kept for allocations that fail: addresses only, no page of it is ever touched.
const RESERVE: usize = 64 << 20;
/// Left free beside the reserve when threads are started, for their stacks.
const MARGIN: usize = 16 << 20;
/// A larger allocation is not saved by the reserve: whoever asks for so much asks whether it is there.
const LARGE: usize = 16 << 20;
/// Rounds that a thread waits for another one that is just giving the reserve back.
const PATIENCE: usize = 1 << 16;

static KEPT: AtomicPtr<u8> = AtomicPtr::new(ptr::null_mut());
/// How many allocations have failed so far. It only ever rises: each job compares it with what it was when the job began.
static FAILURES: AtomicUsize = AtomicUsize::new(0);
/// Bytes of the last of them.
static LAST: AtomicUsize = AtomicUsize::new(0);

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

/// How many allocations had failed when a job began.
#[derive(Clone, Copy)]
pub struct Failures(usize);

impl Failures {
    /// Whether an allocation, of whichever job, has failed since.
    pub fn more(self) -> bool {
        FAILURES.load(SeqCst) != self.0
    }
}

/// Puts the reserve in its place before work begins.
///
/// # Errors
/// There is no memory for it, nor for the stacks of threads beside it.
pub fn arm() -> PyResult<Failures> {
    let before = Failures(FAILURES.load(SeqCst));
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
    black_box(margin.as_mut_ptr());
    Ok(before)
}

/// Addresses that a thread holds until its buffers, which need them, are taken.
#[derive(Clone, Copy)]
struct Room(*mut u8, Layout);

impl Room {
    fn give_back(self) {
        // SAFETY: it was allocated with this layout, and is given back once.
        unsafe { System.dealloc(self.0, self.1) }
    }
}

thread_local! {
    static ROOM: Cell<Option<Room>> = const { Cell::new(None) };
    static HAS_BUFFERS: Cell<bool> = const { Cell::new(false) };
}

/// Takes the buffers that products of matrices need on this thread, once; whether there was room for them.
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
    // Where there is no room beside it, the buffers take its place.
    ROOM.set(Some(Room(pointer, layout)));
    take_product_buffers();
    if let Some(room) = ROOM.take() {
        room.give_back();
    }
    HAS_BUFFERS.set(true);
    true
}

/// What the library takes the last cache for where the system does not tell.
const CACHE: usize = 4 << 20;

/// Bytes of the buffers of a thread: twice the last cache of all processors, as the library finds it.
fn buffers() -> usize {
    static BYTES: OnceLock<usize> = OnceLock::new();
    *BYTES.get_or_init(|| {
        let told = |name: &str| read_to_string(format!("/sys/devices/system/cpu/{name}")).ok();
        let size =
            told("cpu0/cache/index3/size").and_then(|size| size.trim().strip_suffix('K')?.parse().ok());
        let last = told("present").and_then(|all| all.trim().rsplit(['-', ',']).next()?.parse().ok());
        let sharing = told("cpu0/cache/index3/shared_cpu_map")
            .map_or(1, |map| map.chars().filter_map(|digit| digit.to_digit(16)).map(u32::count_ones).sum());
        let caches = (last.unwrap_or(0) + 1usize).div_ceil(sharing.max(1) as usize);
        2 * size.map_or(CACHE, |kibibytes: usize| 1024 * kibibytes).max(CACHE) * caches
    })
}

/// Has the allocator give back to the system what was freed, where it can be told to: it keeps what is not huge for the next ones, and those may
/// be of other sizes.
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

/// What Python hears when there is no room for them.
pub fn no_buffers() -> PyErr {
    exhausted(&format!(
        "products of matrices take {} MiB of addresses for each thread, and there are not so many: fewer threads, or a higher limit",
        buffers() >> 20
    ))
}

/// What Python hears when one has failed.
pub fn failure() -> PyErr {
    exhausted(&format!("an allocation of {} bytes failed: there is not enough memory", LAST.load(SeqCst)))
}

/// An error of memory.
pub fn exhausted(message: &str) -> PyErr {
    OutOfMemoryError::new_err(message.to_owned())
}

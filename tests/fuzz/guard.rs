//! Limits of an input: memory, time, and no panic. An input that breaks a limit ends the process with a line about it;
//! its file stays where it was written.

use std::alloc::{GlobalAlloc, Layout, System};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering::Relaxed};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// Four times the memory of a scene by the loader's own count ([`crate::targets`]): counts are estimates from above,
/// and the rest, tables and the file itself, is small.
const MOST_BYTES: usize = 256 << 20;
/// Processor time of one input. Small inputs take milliseconds; the limit detects unbounded growth, also where another
/// program takes the processor.
const MOST_TIME: Duration = Duration::from_secs(2);

/// The exit code of a process that ended at a limit or a fault.
pub const FAULT: i32 = 3;
/// The start of the line with the reason.
pub const BECAUSE: &str = "fault: ";

/// Bytes in use, by the whole process.
static LIVE: AtomicUsize = AtomicUsize::new(0);
/// The largest number since the last input began.
static PEAK: AtomicUsize = AtomicUsize::new(0);
/// Processor time at the start of the present input, in nanoseconds; 0 between inputs.
static SINCE: AtomicU64 = AtomicU64::new(0);

pub struct GuardedAllocator;

#[global_allocator]
static ALLOCATOR: GuardedAllocator = GuardedAllocator;

impl GuardedAllocator {
    fn add(bytes: usize) {
        let live = LIVE.fetch_add(bytes, Relaxed).saturating_add(bytes);
        PEAK.fetch_max(live, Relaxed);
        if live > MOST_BYTES && SINCE.load(Relaxed) > 0 {
            end("took more memory than it may");
        }
    }
}

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for GuardedAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        Self::add(layout.size());
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        Self::add(layout.size());
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, place: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        Self::add(size);
        LIVE.fetch_sub(layout.size(), Relaxed);
        unsafe { System.realloc(place, layout, size) }
    }

    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        LIVE.fetch_sub(layout.size(), Relaxed);
        unsafe { System.dealloc(place, layout) }
    }
}

/// Prints the reason and ends the process, without allocating.
fn end(why: &str) -> ! {
    for part in [BECAUSE, why, "\n"] {
        // SAFETY: a pointer with its length. A failure to write is ignored.
        let _ = unsafe { libc::write(2, part.as_ptr().cast(), part.len()) };
    }
    // SAFETY: nothing runs after this.
    unsafe { libc::_exit(FAULT) }
}

/// Processor time of the process, in nanoseconds.
fn now() -> u64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the pointer is to a value of this function.
    unsafe { libc::clock_gettime(libc::CLOCK_PROCESS_CPUTIME_ID, &mut time) };
    time.tv_sec as u64 * 1_000_000_000 + time.tv_nsec as u64
}

/// Position and message of the last panic.
static PANIC: Mutex<String> = Mutex::new(String::new());

/// Starts to watch time, and keeps panics from being printed.
pub fn start() {
    std::panic::set_hook(Box::new(|panic| {
        let place = panic.location().map(|l| format!("{}:{}", l.file(), l.line())).unwrap_or_default();
        let payload = panic.payload();
        let text = payload.downcast_ref::<&str>().copied().or(payload.downcast_ref::<String>().map(String::as_str));
        let said = text.and_then(|text| text.lines().next()).unwrap_or_default();
        *PANIC.lock().unwrap_or_else(PoisonError::into_inner) = format!("panicked at {place}: {said}");
    }));
    std::thread::spawn(|| {
        loop {
            std::thread::sleep(Duration::from_millis(50));
            let since = SINCE.load(Relaxed);
            if since > 0 && now().saturating_sub(since) > MOST_TIME.as_nanos() as u64 {
                end("took more time than it may");
            }
        }
    });
}

/// Time and memory of an input.
#[derive(Clone, Copy, Default)]
pub struct Cost {
    pub seconds: f64,
    pub bytes: usize,
}

/// Runs under the limits. The error names the position of a panic.
pub fn watched<T>(run: impl FnOnce() -> T) -> (Result<T, String>, Cost) {
    let (before, since) = (LIVE.load(Relaxed), now());
    PEAK.store(before, Relaxed);
    SINCE.store(since, Relaxed);
    let outcome = catch_unwind(AssertUnwindSafe(run));
    SINCE.store(0, Relaxed);
    let cost = Cost { seconds: (now() - since) as f64 / 1e9, bytes: PEAK.load(Relaxed).saturating_sub(before) };
    (outcome.map_err(|_| PANIC.lock().unwrap_or_else(PoisonError::into_inner).clone()), cost)
}

//! Limits of the system at which it would kill the program: the program ends by itself with a sentence and exit code 2.

/// The minimum stack of the program in bytes; parsing the command line alone takes more than 64 KiB.
#[cfg(unix)]
const STACK: libc::rlim_t = 1 << 20;

/// Makes exceeding `ulimit -f` an error of the writer instead of a signal. If addresses are limited, threads share a
/// heap, because each would reserve 64 MiB. It must be called before threads start. The error is a stack that is too
/// small.
pub fn begin() -> Result<(), &'static str> {
    // SAFETY: the signal is ignored, so that no code runs in it; the other call only takes numbers.
    #[cfg(unix)]
    unsafe {
        libc::signal(libc::SIGXFSZ, libc::SIG_IGN);
        #[cfg(target_env = "gnu")]
        if twobounce::memory::addresses().is_some() {
            libc::mallopt(libc::M_ARENA_MAX, 1);
        }
    }
    #[cfg(unix)]
    {
        let mut stack = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
        // SAFETY: the pointer is valid.
        if unsafe { libc::getrlimit(libc::RLIMIT_STACK, &raw mut stack) } == 0 && stack.rlim_cur < STACK {
            return Err("the limit on the stack is below 1024 KiB: raise ulimit -s");
        }
    }
    Ok(())
}

#[cfg(unix)]
mod memory {
    use std::alloc::{GlobalAlloc, Layout, System};

    #[global_allocator]
    static ALLOCATOR: OrEnd = OrEnd;

    /// The system's allocator. If it has no memory left, the program ends; Rust would print a backtrace, which needs
    /// memory.
    struct OrEnd;

    // SAFETY: all calls are passed to the system's allocator.
    unsafe impl GlobalAlloc for OrEnd {
        unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
            // SAFETY: the caller guarantees this.
            or_end(unsafe { System.alloc(layout) })
        }

        unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
            // SAFETY: the caller guarantees this.
            or_end(unsafe { System.alloc_zeroed(layout) })
        }

        unsafe fn realloc(&self, block: *mut u8, layout: Layout, bytes: usize) -> *mut u8 {
            // SAFETY: the caller guarantees this.
            or_end(unsafe { System.realloc(block, layout, bytes) })
        }

        unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
            // SAFETY: the caller guarantees this.
            unsafe { System.dealloc(block, layout) };
        }
    }

    fn or_end(block: *mut u8) -> *mut u8 {
        const SENTENCE: &[u8] =
            b"twobounce: memory ran out: ask for less, such as a smaller --size or --max-texture, or raise the \
                                  limit of this process (ulimit -v) or of its container\n";
        if block.is_null() {
            // SAFETY: the pointer is valid; neither call needs memory or a lock.
            unsafe {
                libc::write(2, SENTENCE.as_ptr().cast(), SENTENCE.len());
                libc::_exit(2);
            }
        }
        block
    }
}

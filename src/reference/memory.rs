//! Memory hints for large arrays with scattered reads: huge pages and prefetching. They change nothing but speed.

/// An empty vector with room for `count` elements, in memory for which huge pages are requested.
pub fn huge_page_vec<T>(count: usize) -> Vec<T> {
    let vec = Vec::with_capacity(count);
    #[cfg(target_os = "linux")]
    {
        const PAGE: usize = 4096;
        let start = (vec.as_ptr() as usize).next_multiple_of(PAGE);
        let end = (vec.as_ptr() as usize + vec.capacity() * size_of::<T>()) / PAGE * PAGE;
        if start < end {
            // SAFETY: the range is whole pages of the vector's own memory; the system may ignore the hint.
            unsafe { libc::madvise(start as *mut libc::c_void, end - start, libc::MADV_HUGEPAGE) };
        }
    }
    vec
}

/// A copy of `values` in such memory.
pub fn huge_page_copy<T: Copy>(values: &[T]) -> Vec<T> {
    let mut copy = huge_page_vec(values.len());
    copy.extend_from_slice(values);
    copy
}

/// Starts loading `value` into the cache.
#[inline(always)]
pub fn prefetch<T>(value: &T) {
    #[cfg(target_arch = "x86_64")]
    for offset in (0..size_of::<T>()).step_by(64) {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: within `value`; every x86-64 processor has the instruction, and it cannot fault.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(value).cast::<i8>().add(offset)) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = value;
}

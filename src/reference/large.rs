//! Large arrays that are read all over: on large pages, where the system has them, the processor finds them sooner, and
//! sooner still what was announced a while before it is read.

/// An empty vector with room for `count`, whose memory asks for large pages.
pub fn vec<T>(count: usize) -> Vec<T> {
    let vec = Vec::with_capacity(count);
    #[cfg(target_os = "linux")]
    {
        const PAGE: usize = 4096;
        let start = (vec.as_ptr() as usize).next_multiple_of(PAGE);
        let end = (vec.as_ptr() as usize + vec.capacity() * size_of::<T>()) / PAGE * PAGE;
        if start < end {
            // SAFETY: whole pages of the vector's own memory; the advice changes nothing but speed, and may be refused.
            unsafe { libc::madvise(start as *mut libc::c_void, end - start, libc::MADV_HUGEPAGE) };
        }
    }
    vec
}

/// A copy in such memory.
pub fn copy<T: Copy>(of: &[T]) -> Vec<T> {
    let mut copy = vec(of.len());
    copy.extend_from_slice(of);
    copy
}

/// Announces that `soon` will be read. Changes nothing but speed.
#[inline(always)]
pub fn announce<T>(soon: &T) {
    #[cfg(target_arch = "x86_64")]
    for offset in (0..size_of::<T>()).step_by(64) {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: within `soon`; every x86-64 processor has the instruction, and it cannot fault.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(soon).cast::<i8>().add(offset)) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = soon;
}

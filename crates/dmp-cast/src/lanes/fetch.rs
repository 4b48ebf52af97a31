//! Prefetches memory into the cache.

#![cfg_attr(target_arch = "x86_64", expect(unsafe_code, reason = "the processor's instruction for it"))]

/// Prefetches a value into the cache, if there is an instruction for that; nothing waits for it.
#[inline(always)]
pub(crate) fn fetch<T>(value: &T) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        const CACHE_LINE_BYTES: usize = 64;
        let start: *const T = value;
        for line in 0..size_of::<T>().div_ceil(CACHE_LINE_BYTES) {
            // SAFETY: every x86-64 has the instruction, and it accesses nothing, whatever the address.
            unsafe {
                _mm_prefetch::<_MM_HINT_T0>(start.cast::<i8>().wrapping_add(line * CACHE_LINE_BYTES));
            }
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = value;
}

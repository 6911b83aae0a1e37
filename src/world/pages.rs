//! Memory in large pages, and prefetching.
//!
//! A ray reads scattered addresses of a large tree, and with pages of 4 KiB most reads miss the TLB. On Linux, large
//! tables are kept in pages of 2 MiB if the system has them.
//!
//! # Safety
//! The two blocks below pass addresses to the system or the processor as hints, which change neither memory nor the
//! program's meaning. Each comment says why its addresses are valid.
#![allow(unsafe_code, reason = "hints to the system and the processor")]

/// The minimum size in bytes for which large pages are worthwhile.
const WORTH_IT: usize = 1 << 22;

/// An empty vector with room for `count` values, in large pages if it is large. Pages are allocated when values are
/// written.
pub(super) fn with_capacity<T>(count: usize) -> Vec<T> {
    #[cfg_attr(not(target_os = "linux"), allow(unused_mut))]
    let mut vec = Vec::with_capacity(count);
    #[cfg(target_os = "linux")]
    advise(vec.spare_capacity_mut());
    vec
}

#[cfg(target_os = "linux")]
fn advise<T>(room: &mut [std::mem::MaybeUninit<T>]) {
    let bytes = size_of_val(room);
    if bytes < WORTH_IT {
        return;
    }
    // Whole pages within the allocation: other data on its first and last page is left alone.
    const PAGE: usize = 4096;
    let start = room.as_mut_ptr().cast::<libc::c_void>();
    let skipped = start.align_offset(PAGE);
    let length = bytes.saturating_sub(skipped) & !(PAGE - 1);
    // SAFETY: the range lies within one allocation that we own and that no other thread reads meanwhile. MADV_HUGEPAGE
    // changes no stored data; kernels without it return an error, which is ignored.
    unsafe {
        libc::madvise(start.byte_add(skipped), length, libc::MADV_HUGEPAGE);
    }
}

/// Tells the processor that a value will be read soon.
#[inline(always)]
#[cfg_attr(not(target_arch = "x86_64"), allow(unused_variables))]
pub(super) fn prefetch<T>(value: &T) {
    #[cfg(target_arch = "x86_64")]
    for line in 0..size_of::<T>().div_ceil(64) {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        let start = std::ptr::from_ref(value).cast::<i8>();
        // SAFETY: prefetching reads nothing and cannot fault for any address; this one is within `value`.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(start.wrapping_add(64 * line)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vectors_in_large_pages_work_as_others() {
        for count in [0, 1, 1000, WORTH_IT / 4 - 1, WORTH_IT / 4, WORTH_IT] {
            let mut words: Vec<u32> = with_capacity(count);
            assert!(words.is_empty() && words.capacity() >= count);
            let from = words.as_ptr();
            words.extend(0..count as u32);
            assert_eq!(words.as_ptr(), from, "{count} words moved");
            words.iter().step_by(1 << 14).for_each(prefetch);
            assert!(words.iter().enumerate().all(|(i, &word)| word as usize == i));
        }
    }
}

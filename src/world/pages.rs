//! Memory in large pages, and prefetching.
//!
//! The reads of a ray in a large tree are scattered, and with pages of 4 KiB most of them miss the cache of page
//! addresses. On Linux, large tables are kept in pages of 2 MiB, if the system has them.
//!
//! # Safety
//! The two blocks below hand addresses to the system or the processor as hints, which change no byte of memory and
//! no meaning of the program: each says why its addresses may be named.
#![allow(unsafe_code, reason = "hints to the system and the processor")]

/// The fewest bytes for which large pages are worth it.
const WORTH_IT: usize = 1 << 22;

/// An empty vector with room for so many values, in large pages if it is large. The pages come when values are
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
    // Whole pages within the room: whatever else lives on its first and its last page is left alone.
    const PAGE: usize = 4096;
    let start = room.as_mut_ptr().cast::<libc::c_void>();
    let skipped = start.align_offset(PAGE);
    let length = bytes.saturating_sub(skipped) & !(PAGE - 1);
    // SAFETY: the range lies within one allocation that we own and nobody reads meanwhile. MADV_HUGEPAGE changes
    // nothing that is stored; where the kernel knows no such advice it says so, and the answer is not needed.
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
        // SAFETY: prefetching reads nothing and cannot fault, whatever the address, which is within `value`.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(start.wrapping_add(64 * line)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn room_is_room_however_large_its_pages_are() {
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

//! Memory for whole frames in large pages, where the system has them.
//!
//! A frame of 61 million pixels is 60 000 pages of 4 kB, each to be handed out, filled with zeros and found again in the
//! tables of the processor; in pages of 2 MB all stages over a frame take 7 to 9 % less time (docs/speed.md). Leaves out
//! small buffers, and systems other than Linux: there memory stays as it comes.
#![allow(unsafe_code)]

/// A large page \[bytes\]; a multiple of any small one.
const LARGE_PAGE: usize = 2 << 20;

/// `len` zeros, as `vec![0; len]` makes them.
pub(crate) fn zeros<T: Copy + Default>(len: usize) -> Vec<T> {
    let values = vec![T::default(); len];
    in_large_pages(&values);
    values
}

/// Asks the system to hold what lies on whole large pages in such; it may refuse.
#[cfg(target_os = "linux")]
fn in_large_pages<T>(values: &[T]) {
    let start = (values.as_ptr() as usize).next_multiple_of(LARGE_PAGE);
    let end = (values.as_ptr() as usize + size_of_val(values)) / LARGE_PAGE * LARGE_PAGE;
    if start < end {
        let within = start - values.as_ptr() as usize;
        // SAFETY: the range lies inside an allocation that `values` borrows and begins and ends on pages; the advice
        // says how the system may back it with memory and changes neither its contents nor who may use it.
        let _ = unsafe {
            let first = values.as_ptr().cast::<u8>().add(within).cast_mut().cast();
            rustix::mm::madvise(first, end - start, rustix::mm::Advice::LinuxHugepage)
        };
    }
}

#[cfg(not(target_os = "linux"))]
fn in_large_pages<T>(_: &[T]) {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_and_small_buffers_are_zeros_that_keep_what_is_written() {
        for len in [0, 1, 1000, LARGE_PAGE / 4 - 1, LARGE_PAGE, 3 * LARGE_PAGE + 7] {
            let mut values: Vec<f32> = zeros(len);
            assert!(values.len() == len && values.iter().all(|v| *v == 0.0));
            values.iter_mut().enumerate().for_each(|(k, v)| *v = k as f32);
            in_large_pages(&values);
            assert!(values.iter().enumerate().all(|(k, v)| *v == k as f32), "{len}");
            let marks: Vec<u8> = zeros(len);
            assert!(marks.len() == len && marks.iter().all(|m| *m == 0));
        }
    }
}

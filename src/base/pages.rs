//! Memory for whole frames in large pages, where the system has them.
//!
//! A frame of 61 million pixels is 60 000 pages of 4 kB, each to be handed out, filled with zeros and found again in the
//! tables of the processor; in pages of 2 MB all stages over a frame take 7 to 9 % less time (docs/speed.md). Not
//! covered: small buffers, and systems other than Linux, where memory is used as the system gives it.
#![allow(unsafe_code)]

use std::path::Path;

use super::error::{Error, Result};

/// A large page \[bytes\]; a multiple of any small one.
const LARGE_PAGE: usize = 2 << 20;

/// `len` zeros for what the file at `path` promises, as `vec![0; len]` makes them.
///
/// # Errors
/// [`Error::Fits`] with the size, if the system does not give so much memory.
pub(crate) fn zeros<T: Copy + Default>(path: &Path, len: usize) -> Result<Vec<T>> {
    // requested and given back first: `vec![0; len]` would end the program
    grow(&mut Vec::<T>::new(), len, false).map_err(|problem| Error::Fits { path: path.to_path_buf(), problem })?;
    let values = vec![T::default(); len];
    in_large_pages(&values);
    Ok(values)
}

/// Makes `values` as long as a header promises; the error says the size, if the system does not give so much memory.
pub(crate) fn resize<T: Copy + Default>(values: &mut Vec<T>, len: usize) -> std::result::Result<(), String> {
    grow(values, len, true)
}

fn grow<T: Copy + Default>(values: &mut Vec<T>, len: usize, filled: bool) -> std::result::Result<(), String> {
    values.try_reserve_exact(len.saturating_sub(values.len())).map_err(|_| {
        let gigabytes = len as f64 * size_of::<T>() as f64 / 1e9;
        format!("it needs {gigabytes:.1} GB in one piece, which the system does not give; is its header right?")
    })?;
    if filled {
        values.resize(len, T::default());
    }
    Ok(())
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
            let mut values: Vec<f32> = zeros(Path::new(""), len).unwrap();
            assert!(values.len() == len && values.iter().all(|v| *v == 0.0));
            values.iter_mut().enumerate().for_each(|(k, v)| *v = k as f32);
            in_large_pages(&values);
            assert!(values.iter().enumerate().all(|(k, v)| *v == k as f32), "{len}");
            let marks: Vec<u8> = zeros(Path::new(""), len).unwrap();
            assert!(marks.len() == len && marks.iter().all(|m| *m == 0));
        }
    }

    #[test]
    fn what_the_system_does_not_give_is_an_error_with_its_size() {
        let refused = zeros::<f32>(Path::new("large.fits"), 1 << 60).unwrap_err().to_string();
        assert!(refused.starts_with("large.fits: it needs 4611686018.4 GB"), "{refused}");
        assert!(resize(&mut vec![1u8; 3], usize::MAX).is_err());
    }
}

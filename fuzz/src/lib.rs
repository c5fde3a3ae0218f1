//! What the fuzz targets share: bytes as a file, and text as the header of a FITS file.

use std::path::PathBuf;

/// The name of the file of this process; in memory where the system has a folder for that.
pub fn scratch(extension: &str) -> PathBuf {
    let memory = PathBuf::from("/dev/shm");
    let folder = if memory.is_dir() { memory } else { std::env::temp_dir() };
    folder.join(format!("satphot-fuzz-{}.{extension}", std::process::id()))
}

/// Writes `bytes` over the scratch file and returns its path.
pub fn as_file(extension: &str, bytes: &[u8]) -> PathBuf {
    let path = scratch(extension);
    std::fs::write(&path, bytes).expect("the scratch file can be written");
    path
}

/// Lines as the cards of a FITS file, each at 80 columns, with END, whole blocks and `data` behind; the bytes as they are
/// where they begin as a FITS file does.
pub fn as_fits(bytes: &[u8], data: &[u8]) -> Vec<u8> {
    if bytes.starts_with(b"SIMPLE  =") && bytes.len() >= 2880 {
        return bytes.to_vec();
    }
    let mut file = Vec::with_capacity(5760 + data.len());
    for line in bytes.split(|b| *b == b'\n') {
        let card = &line[..line.len().min(80)];
        file.extend_from_slice(card);
        file.resize(file.len().next_multiple_of(80), b' ');
    }
    file.extend_from_slice(b"END");
    file.resize(file.len().next_multiple_of(2880), b' ');
    file.extend_from_slice(data);
    file
}

#[doc(hidden)]
pub mod entry {
    use std::ffi::{c_char, c_int};

    unsafe extern "C" {
        fn LLVMFuzzerRunDriver(
            argc: *mut c_int,
            argv: *mut *mut *mut c_char,
            test: unsafe extern "C" fn(*const u8, usize) -> c_int,
        ) -> c_int;
        fn LLVMFuzzerTestOneInput(bytes: *const u8, len: usize) -> c_int;
    }

    pub fn run(mut argc: c_int, mut argv: *mut *mut c_char) -> c_int {
        // SAFETY: what the system hands to main is handed on.
        unsafe { LLVMFuzzerRunDriver(&mut argc, &mut argv, LLVMFuzzerTestOneInput) }
    }
}

/// The entry of a target, in its own object: one of ERFA's test programs is in our libraries, and the linker would take its
/// `main` before that of libFuzzer.
#[macro_export]
macro_rules! entry {
    () => {
        #[unsafe(no_mangle)]
        extern "C" fn main(argc: std::ffi::c_int, argv: *mut *mut std::ffi::c_char) -> std::ffi::c_int {
            $crate::entry::run(argc, argv)
        }
    };
}

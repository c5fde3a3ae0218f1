//! What every room stands on: the error, constants, vectors, time as text, statistics, quadrature, atomic files.

pub mod constants;
pub mod error;
pub mod file;
pub mod foreign;
pub mod hash;
pub mod instant;
pub(crate) mod pages;
pub mod path_text;
pub mod progress;
pub(crate) mod quadrature;
pub(crate) mod search;
pub mod stats;
pub mod stop;
pub mod threads;
pub mod time;
pub(crate) mod utc;
pub mod vector;

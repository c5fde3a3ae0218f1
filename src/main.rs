//! The program: parse, run a verb, print what went wrong with its exit code.

fn main() {}

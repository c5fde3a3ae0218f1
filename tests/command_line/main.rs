//! The program as its users call it, its messages and its documentation.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../support/mod.rs"]
mod support;

mod accuracy_cli;
mod check_table;
mod cli;
mod config_model;
mod docs_book;
mod docs_columns;
mod docs_configuration;
mod docs_run;
mod inspect_cli;
mod messages;
mod output;
mod published;
mod skipped;
mod times;
mod typical_mistakes;

//! Elements and stars from the network: the only room that uses it.
//!
//! query (what is requested) -> [`Client`] (cache, then the network) -> checked answer -> elements, catalogue.
//! An answer is used only after satphot's own reader took it; only then it enters the cache. Times are arguments: the
//! clock is the program's. It does not cover logins (Space-Track), bulk downloads and every other catalogue.

mod answers;
mod apass;
mod cache;
mod client;
mod elements;
mod fields;
mod http;
mod query;
mod stars;

pub use cache::Cache;
pub use client::{Answer, Client, Hooks};
pub use elements::{FetchedElements, Wanted, WhichService, element_queries, fetch_elements};
pub use fields::{Field, fields_of_night, fields_of_passes, one_query_each};
pub use query::{Object, Query, Service, apass_query, celestrak_query, satchecker_query};
pub use stars::{FetchedStars, fetch_stars};

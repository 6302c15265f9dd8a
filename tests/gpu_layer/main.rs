//! The GPU layer itself: transfers, scans, hazards, limits, errors, and that validation is really listening.

#[path = "../common/mod.rs"]
mod common;

mod basics;
mod errors;
mod images;
mod misuse;
mod passes;
mod pipeline_cache;
mod planted;
mod transfers;

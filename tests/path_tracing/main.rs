//! The reference against closed forms, against itself, and against pictures made by another program.

mod brdf;
#[path = "../common/mod.rs"]
mod common;
mod physics;
mod references;
mod render;

//! The hierarchy and ray casting: structure, refit, agreement with brute force, watertightness, bad input.

#[path = "../common/mod.rs"]
mod common;
mod masks;
mod meshes;
mod ray_query;
mod structure;
mod trace;

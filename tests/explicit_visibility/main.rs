//! Explicit visibility: every pass against a plain twin, the links' invariants, physics, determinism, deformation.

#[path = "../common/mod.rs"]
mod common;
mod fixture;
mod physics;

//! Explicit visibility: every pass against a plain twin, the links' invariants, physics, determinism, deformation.

mod asynchronous;
#[path = "../common/mod.rs"]
mod common;
mod dynamics;
mod fixture;
mod form_factors;
mod invariants;
mod kernels_elements;
mod kernels_light;
mod kernels_links;
mod meshes;
mod physics;
mod twins;

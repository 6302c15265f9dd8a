//! Face-cluster radiosity: clusters and their bounds, bases, transport, closed forms, energy.
#[path = "../common/mod.rs"]
mod common;

mod bases;
mod clusters;
mod fixture;
mod physics;

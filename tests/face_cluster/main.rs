//! Face-cluster radiosity: clusters and their bounds, bases, kernels against twins, closed forms, energy.
#[path = "../common/mod.rs"]
mod common;

mod bases;
mod clusters;
mod energy;
mod fixture;
mod grown;
mod kernels;
mod leaves;
mod pair_twins;
mod pairs;
mod physics;
mod twins;
mod way_twins;

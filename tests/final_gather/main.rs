//! The sender tree and the per-pixel final gather: against plain twins, the sum over all leaves, and the furnace.

mod bound;
#[path = "../common/mod.rs"]
mod common;
mod fixture;
mod gather;
mod gloss;
mod methods;
mod pack;
mod shiny;
mod tree;
mod twins;

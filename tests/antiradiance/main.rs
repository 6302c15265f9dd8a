//! Antiradiance: passes against plain twins, what holds of hierarchies and links, physics, the operator identity,
//! convergence, motion.

#[path = "../common/mod.rs"]
mod common;
mod dynamics;
#[path = "../explicit_visibility/fixture.rs"]
#[allow(dead_code, reason = "its own method's part is not needed here")]
mod fixture;
mod gloss;
mod identity;
mod invariants;
mod kernels;
mod physics;
mod places;
mod schemes;
mod splatting;
mod support;
mod twins;

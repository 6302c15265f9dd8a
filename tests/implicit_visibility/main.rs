//! Implicit visibility: its passes against plain twins, the hierarchy against all pairs, physics, what moves.

#[path = "../common/mod.rs"]
mod common;
#[path = "../kernels/compare.rs"]
#[allow(dead_code, reason = "each test file uses its own part")]
mod compare;
mod dynamics;
mod fixture;
mod folded;
mod gather_twin;
mod gloss_twins;
mod glossy;
mod glossy_picture;
mod holes;
mod lobe_light;
mod oracle;
mod outlines;
mod passes;
mod physics;
mod shadows;
mod sky;
mod sky_spots;
mod sweep;
mod trees;
mod twins;

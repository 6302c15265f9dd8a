//! Implicit visibility: its passes against plain twins, the hierarchy against all pairs, physics, what moves.

#[path = "../common/mod.rs"]
mod common;
mod dynamics;
mod fixture;
mod glossy;
mod oracle;
mod passes;
mod physics;
mod sky;
mod sweep;
mod trees;
mod twins;

//! The reference against closed forms, against itself, and against pictures made by another program.

mod brdf;
mod camera;
#[path = "../common/mod.rs"]
mod common;
mod consistency;
mod lights;
#[path = "../scene_data/made.rs"]
#[allow(dead_code, reason = "shared with other tests")]
mod made;
mod physics;
mod references;
mod render;
mod surfaces;

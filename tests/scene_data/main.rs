//! The plain-data side of the scene beyond the loader, on hand-made scenes: pose, geometry, tessellation,
//! environment, camera.

mod camera;
mod environment;
mod geometry;
mod made;
mod pose;
mod tessellation;

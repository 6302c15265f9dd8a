//! What the methods share: each stage is a few passes over buffers, and knows nothing of any method.

pub mod bvh;
pub mod film;
pub mod scan;
pub mod trace;
pub mod world;

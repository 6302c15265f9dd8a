//! What the methods share: each stage is a few passes over buffers, and knows nothing of any method.

pub mod arriving_light;
pub mod bvh;
pub mod clusters;
pub mod direction_bins;
pub mod elements;
pub mod emissive_triangles;
pub mod emitters;
pub mod false_color;
pub mod film;
pub mod gather;
pub mod hidden_parts;
pub mod hierarchy;
pub mod irradiance_vector;
pub mod levels;
pub mod links;
pub mod pair_queue;
pub mod punctual;
pub mod quadtree;
pub mod scan;
pub mod sender_tree;
pub mod surface_maps;
pub mod texels;
pub mod trace;
pub mod view;
pub mod work;
pub mod world;

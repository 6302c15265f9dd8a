//! Kernels against their twins: plain CPU code over plain slices in binding order, with the kernel's order of
//! statements. Inputs come from twins of earlier stages, so that one broken kernel fails one test.

#[path = "../common/mod.rs"]
mod common;

mod arriving_light;
mod compare;
mod deform;
mod display;
mod environment_irradiance;
mod g_buffer;
mod irradiance_display;
mod irradiance_vector;
mod lightmap;
mod materials;
mod pair_queue;
mod punctual_irradiance;
mod texel_light;
mod texel_materials;
mod texel_parts;

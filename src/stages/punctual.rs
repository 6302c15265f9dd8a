//! Point, spot and directional lights on elements: visibility by shadow rays, then irradiance.
//!
//! Visibility depends on where lights and surfaces are, irradiance on how bright lights are as well: a light that only
//! changes colour needs no rays.

use super::elements::Elements;
use super::trace::{self, Tracer};
use super::world::World;
use crate::gpu::shaders::elements as passes;
use crate::gpu::shaders::types::Ray;
use crate::gpu::{Buffer, Recorder};
use glam::Vec3;

/// Casts the shadow rays of every light and element, in batches that fit `rays`, and writes the mean visibility to
/// `visibility[light * element_count + element]`. Returns the number of rays.
pub fn trace_visibility(
    recorder: &mut Recorder<'_>,
    tracer: &Tracer<'_>,
    world: &World,
    elements: &Elements,
    rays: &Buffer<Ray>,
    is_free: &Buffer<u32>,
    visibility: &Buffer<f32>,
) -> u64 {
    let offsets = &elements.topology.shadow_offsets;
    let capacity = rays.len().min(is_free.len()) as u32;
    let mut first_element = 0;
    while first_element < elements.count && world.light_count > 0 {
        // As many elements as fit; one always does.
        let before = offsets[first_element as usize];
        let end = offsets.partition_point(|&rays| rays - before.min(rays) <= capacity) as u32 - 1;
        let batch_count = end.max(first_element + 1) - first_element;
        let ray_count = offsets[(first_element + batch_count) as usize] - before;
        for light in 0..world.light_count {
            recorder.dispatch(
                &passes::PunctualRays {
                    element_vertices: &elements.vertices,
                    element_normals: &elements.normals,
                    ray_origins: &elements.ray_origins,
                    shadow_offsets: &elements.shadow_offsets,
                    positions: &world.positions,
                    triangles: &world.triangles,
                    incident_offsets: &elements.incident_offsets,
                    incident_triangles: &elements.incident_triangles,
                    lights: &world.lights,
                    rays,
                    params: passes::PunctualRaysParams {
                        first_element,
                        batch_count,
                        light,
                        ray_offset: elements.ray_offset,
                    },
                },
                batch_count,
            );
            trace::any_hit(recorder, tracer, rays, is_free, ray_count as usize);
            recorder.dispatch(
                &passes::PunctualVisibility {
                    shadow_offsets: &elements.shadow_offsets,
                    rays,
                    is_free,
                    visibility,
                    params: passes::PunctualVisibilityParams {
                        first_element,
                        batch_count,
                        element_count: elements.count,
                        light,
                    },
                },
                batch_count,
            );
        }
        first_element += batch_count;
    }
    u64::from(offsets.last().copied().unwrap_or(0)) * u64::from(world.light_count)
}

/// Irradiance from all lights through their visibility, W/m2.
pub fn irradiance(
    recorder: &mut Recorder<'_>,
    world: &World,
    elements: &Elements,
    visibility: &Buffer<f32>,
    irradiance: &Buffer<Vec3>,
) {
    let pass = passes::PunctualIrradiance {
        element_positions: &elements.positions,
        element_normals: &elements.normals,
        lights: &world.lights,
        visibility,
        irradiance,
        params: passes::PunctualIrradianceParams { element_count: elements.count, light_count: world.light_count },
    };
    recorder.dispatch(&pass, elements.count);
}

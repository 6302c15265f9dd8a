//! What methods on elements read of a scene.

use crate::gpu::Context;
use crate::scene::Scene;
use crate::scene::environment::Environment;
use crate::scene::geometry::Geometry;
use crate::stages::bvh::{Bvh, BvhError};
use crate::stages::elements::{ElementTopology, Elements};
use crate::stages::hidden_parts::HiddenPartsError;
use crate::stages::open_places::{self, AtRest};
use crate::stages::trace::Tracer;
use crate::stages::work::Watch;
use crate::stages::world::World;
use glam::Vec3;

/// What the method reads of the scene: plain data, and its form on the device in the present pose.
#[derive(Clone, Copy)]
pub struct Stage<'a> {
    pub scene: &'a Scene,
    pub geometry: &'a Geometry,
    /// World space, one per vertex; equal where vertices stand at one place.
    pub rest_positions: &'a [Vec3],
    pub environment: &'a Environment,
    pub world: &'a World,
    pub tracer: Tracer<'a>,
    /// Hears how far link generation is.
    pub watch: &'a dyn Watch,
}

impl Stage<'_> {
    /// The elements, placed; those inside of other things look from the open beside them.
    pub fn elements(
        &self,
        context: &Context,
        topology: ElementTopology,
        relative_ray_offset: f32,
    ) -> Result<Elements, HiddenPartsError> {
        let mut elements = Elements::new(context, topology, self.rest_positions, self.world, relative_ray_offset)?;
        // The present hierarchy may stand otherwise: what is decided here must not depend on the time that is shown.
        let at_rest = match Bvh::build(context, self.rest_positions, &self.geometry.triangles) {
            Ok(at_rest) => at_rest,
            Err(BvhError::Gpu(error)) => return Err(error.into()),
            Err(_) => return Ok(elements),
        };
        let surface = AtRest {
            triangles: &self.geometry.triangles,
            positions: self.rest_positions,
            tracer: Tracer::compute(&at_rest, self.world),
            ray_offset: elements.ray_offset,
        };
        let places = open_places::find(context, &surface, &elements.topology, self.watch)?;
        elements.look_from(context, &places)?;
        let mut recorder = context.recorder("elements")?;
        elements.place(&mut recorder, self.world);
        recorder.submit()?;
        Ok(elements)
    }
}

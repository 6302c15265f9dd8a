//! What methods on elements read of a scene.

use crate::gpu::Context;
use crate::scene::Scene;
use crate::scene::environment::Environment;
use crate::scene::geometry::Geometry;
use crate::stages::bvh::{Bvh, BvhError};
use crate::stages::elements::{ElementTopology, Elements};
use crate::stages::hidden_parts::HiddenPartsError;
use crate::stages::open_places::{self, AtRest};
use crate::stages::stand_ins::StandIns;
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
        let find = |surface: &AtRest<'_>| open_places::find(context, surface, &elements.topology, self.watch);
        let Some(places) = self.at_rest(context, elements.ray_offset, find)? else { return Ok(elements) };
        elements.look_from(context, &places)?;
        let mut recorder = context.recorder("elements")?;
        elements.place(&mut recorder, self.world);
        recorder.submit()?;
        Ok(elements)
    }

    /// The elements inside of other things, and which show their light in their place.
    pub fn stand_ins(&self, context: &Context, elements: &Elements) -> Result<StandIns, HiddenPartsError> {
        let find = |surface: &AtRest<'_>| StandIns::find(context, surface, &elements.topology, self.watch);
        match self.at_rest(context, elements.ray_offset, find)? {
            Some(stand_ins) => Ok(stand_ins),
            None => Ok(StandIns::none(context)?),
        }
    }

    /// Per part: whether an animation moves it.
    pub fn moving_parts(&self) -> Vec<bool> {
        let scene = self.scene;
        let mut moves = vec![false; scene.nodes.len()];
        for channel in scene.clips.iter().flat_map(|clip| &clip.channels) {
            if let Some(node) = moves.get_mut(channel.node as usize) {
                *node = true;
            }
        }
        let is_moved = |mut node: u32| {
            // As many steps up as there are nodes, at most.
            for _ in 0..moves.len() {
                if moves[node as usize] {
                    return true;
                }
                match scene.nodes[node as usize].parent {
                    Some(parent) => node = parent,
                    None => break,
                }
            }
            false
        };
        let parts = self.geometry.parts.iter();
        parts.map(|part| is_moved(part.node) || part.skin_offset.is_some()).collect()
    }

    /// What `find` finds by rays at the surface at rest, if a hierarchy of it can be made. The present one may stand
    /// otherwise: what is decided once must not depend on the time that is shown.
    fn at_rest<T>(
        &self,
        context: &Context,
        ray_offset: f32,
        find: impl Fn(&AtRest<'_>) -> Result<T, HiddenPartsError>,
    ) -> Result<Option<T>, HiddenPartsError> {
        let at_rest = match Bvh::build(context, self.rest_positions, &self.geometry.triangles) {
            Ok(at_rest) => at_rest,
            Err(BvhError::Gpu(error)) => return Err(error.into()),
            Err(_) => return Ok(None),
        };
        let (triangles, positions) = (&self.geometry.triangles[..], self.rest_positions);
        let tracer = Tracer::compute(&at_rest, self.world);
        find(&AtRest { triangles, positions, tracer, ray_offset }).map(Some)
    }
}

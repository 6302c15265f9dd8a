//! Objects that move rigidly: their maps are made once, at rest and apart, and hold in every pose.   [Ritschel2008 3.3]
//!
//! A pose moves the texels, builds the tree anew over them, and finds the pairs of objects whose hulls overlap; ways past
//! those are asked by rays. What deforms has no such maps: it is prepared anew for each pose.

use super::{Settings, Stage, SurfaceShadowMaps, SurfaceShadowMapsError, TexelVisibility};
use crate::gpu::Context;
use crate::scene::atlas::Atlas;
use crate::scene::pose::Pose;
use crate::scene::rigid::RigidObjects;
use crate::stages::bvh::{Bvh, BvhError};
use crate::stages::sender_tree::SenderTree;
use crate::stages::surface_maps::{Ball, MovingMaps, MovingTables, SurfaceMaps};
use crate::stages::texels;
use crate::stages::trace::Tracer;
use glam::Vec3;

/// A scene's objects at rest, each with a hierarchy over it alone.
pub(super) struct Apart {
    pub objects: RigidObjects,
    bvhs: Vec<Bvh>,
    balls: Vec<Ball>,
}

/// What the texels were before anything moved.
pub(super) struct Rest {
    atlas: Atlas,
    pose: Pose,
}

impl Apart {
    /// None where maps are not asked for, or the scene has nothing that moves rigidly.
    pub fn of(context: &Context, stage: &Stage<'_>, settings: &Settings) -> Result<Option<Self>, BvhError> {
        let (geometry, positions) = (stage.geometry, stage.rest_positions);
        if settings.visibility != TexelVisibility::Maps {
            return Ok(None);
        }
        let Some(objects) = RigidObjects::of(stage.scene, geometry) else { return Ok(None) };
        if objects.world_from_rest(&Pose::rest(stage.scene), stage.pose).is_none() {
            return Ok(None);
        }
        let mut apart = Self { bvhs: Vec::new(), balls: Vec::new(), objects };
        for object in 0..apart.objects.count() as u32 {
            // Triangles keep their indices, which tell their holes; those of other objects shrink to points.
            let is_own = |triangle: usize| apart.objects.triangle_objects[triangle] == object;
            let triangles = geometry.triangles.iter().enumerate();
            let alone: Vec<[u32; 3]> = triangles.map(|(index, t)| if is_own(index) { *t } else { [t[0]; 3] }).collect();
            apart.bvhs.push(Bvh::build(context, positions, &alone)?);
            let own = geometry.triangles.iter().enumerate().filter(|(index, _)| is_own(*index));
            apart.balls.push(Ball::around(own.flat_map(|(_, t)| t.map(|v| positions[v as usize]))));
        }
        Ok(Some(apart))
    }

    pub fn tracers<'a>(&'a self, stage: &Stage<'a>) -> Vec<Tracer<'a>> {
        let (Tracer::Compute(_, surfaces) | Tracer::RayQuery(_, surfaces)) = stage.tracer;
        self.bvhs.iter().map(|bvh| Tracer::Compute(bvh, surfaces)).collect()
    }

    /// The outside maps, and the tables by which objects are told apart.
    pub fn maps(
        &self,
        context: &Context,
        stage: &Stage<'_>,
        atlas: &Atlas,
        maps: &SurfaceMaps,
    ) -> Result<MovingMaps, SurfaceShadowMapsError> {
        let tables = MovingTables { atlas, places: &maps.places };
        let (objects, balls) = (self.objects.clone(), self.balls.clone());
        Ok(MovingMaps::new(context, objects, balls, &self.tracers(stage), &tables, stage.watch)?)
    }
}

impl Rest {
    pub fn of(stage: &Stage<'_>, atlas: &Atlas) -> Self {
        Self { atlas: atlas.clone(), pose: Pose::rest(stage.scene) }
    }
}

impl SurfaceShadowMaps {
    /// Takes over a new pose. False where the maps do not hold in it: prepare anew.
    pub fn place(&mut self, context: &Context, stage: &Stage<'_>) -> Result<bool, SurfaceShadowMapsError> {
        let (Some(rest), Some(placed)) = (&self.rest, &mut self.maps) else { return Ok(false) };
        let Some(moving) = &mut placed.moving else { return Ok(false) };
        let Some(world_from_rest) = moving.objects.world_from_rest(&rest.pose, stage.pose) else { return Ok(false) };
        let of_texel = |texel: usize| world_from_rest[moving.texel_objects[texel] as usize];
        self.atlas = rest.atlas.moved(of_texel);
        self.texels.move_to(context, &self.atlas)?;
        let options = self.settings.tree_options();
        self.tree =
            SenderTree::with_shiny(context, &texels::leaves(&self.atlas), self.gloss.shiny.as_leaves(), options)?;
        let leaf_order = &self.tree.topology.leaf_order;
        let before = std::mem::take(&mut moving.overlaps);
        moving.place(context, &rest.atlas, leaf_order, &world_from_rest)?;
        for &(hull, inside) in moving.overlaps.iter().filter(|pair| !before.contains(pair)) {
            let [hull, inside] = [hull, inside].map(|object| match moving.objects.name(stage.scene, object) {
                "" => "what stands still",
                name => name,
            });
            tracing::info!("{inside} reaches into the hull of {hull}: ways past it are asked by rays");
        }
        placed.reorder(context, &rest.atlas, leaf_order)?;
        Ok(true)
    }
}

/// Plain data of what the maps of objects apart depend on.
pub(super) fn content(apart: &Apart, positions: &[Vec3]) -> Vec<u8> {
    let mut content = bytemuck::cast_slice(positions).to_vec();
    content.extend_from_slice(bytemuck::cast_slice(&apart.objects.triangle_objects));
    content
}

//! Maps of moving objects from outside, and what look-ups between objects read.                    [Ritschel2008 3.3]
//!
//! Every object sees itself by the surface shadow maps of its texels. Whether it stands between two points elsewhere its
//! outside maps tell: depths along directions over half a sphere, compressed along a walk over the directions. That holds
//! for points outside its hull: where the surface of another object reaches into it, ways from there are asked by rays.
//!
//! [Ritschel2008]: crate::methods::PAPERS

use super::{CHUNK_RAYS, CompressedMaps, Compressor, SurfaceMapError};
use crate::gpu::shaders::surface_maps as passes;
use crate::gpu::shaders::types::{Hit, Ray, RigidObject};
use crate::gpu::{Buffer, Context, GpuError};
use crate::scene::atlas::Atlas;
use crate::scene::rigid::{Hull, RigidObjects};
use crate::stages::trace::{self, Tracer};
use crate::stages::work::Watch;
use glam::{Mat4, Vec3};

/// Directions a side of a face of the cube; three faces are kept.
const DIRECTIONS: u32 = 16;
/// Pixels a side of an outside map.
const RESOLUTION: u32 = 64;
/// Words before the tables.
const HEADER: usize = 13;
/// Of the scene's size: hulls that share less than this do not overlap.
const SLACK: f32 = 1e-4;

/// An object's ball at rest, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball {
    pub centre: Vec3,
    pub radius: f32,
}

impl Ball {
    pub fn around(points: impl Iterator<Item = Vec3> + Clone) -> Self {
        let bounds = points.clone().fold((Vec3::MAX, Vec3::MIN), |(low, high), p| (low.min(p), high.max(p)));
        let centre = bounds.0.midpoint(bounds.1);
        let radius = points.map(|p| p.distance(centre)).fold(0.0, f32::max);
        Self { centre, radius: 1.001 * radius.max(1e-6) }
    }
}

/// What moves, as the gathers by maps read it.
pub struct MovingMaps {
    pub objects: RigidObjects,
    pub balls: Vec<Ball>,
    /// Texel after texel: whose it is.
    pub texel_objects: Vec<u32>,
    /// Bytes of the outside maps.
    pub outside_bytes: u64,
    /// Bytes uncompressed, in 16 bits a pixel, for each byte of runs.
    pub outside_ratio: f64,
    /// Header of offsets, then tables: `glsl/lib/rigid_objects.glsl`.
    pub words: Buffer<u32>,
    host_words: Vec<u32>,
    /// Of the present pose.
    pub present: Buffer<RigidObject>,
    /// Of the present pose: pairs (hull, object) of which the second reaches into the first's hull.
    pub overlaps: Vec<(usize, usize)>,
}

/// The texels of the objects.
pub struct MovingTables<'a> {
    pub atlas: &'a Atlas,
    /// Place in the sequence of each texel.
    pub places: &'a [u32],
}

impl MovingMaps {
    /// Makes the outside maps of each object, seen alone by its own tracer, at rest.
    pub fn new(
        context: &Context,
        objects: RigidObjects,
        balls: Vec<Ball>,
        tracers: &[Tracer<'_>],
        tables: &MovingTables<'_>,
        watch: &dyn Watch,
    ) -> Result<Self, SurfaceMapError> {
        let mut maps = CompressedMaps { offsets: vec![0], ..CompressedMaps::default() };
        let mut ratio_bytes = 0;
        for (ball, tracer) in balls.iter().zip(tracers) {
            let of_object = make(context, *ball, tracer, watch)?;
            ratio_bytes += of_object.pixel_count() as u64 * u64::from(of_object.place_count) * 2;
            let first = maps.runs.len() as u32;
            maps.offsets.extend(of_object.offsets[1..].iter().map(|offset| first + offset));
            maps.runs.extend(of_object.runs);
        }
        let texel_objects = texel_objects(tables.atlas, &objects);
        let words = words(&objects, &texel_objects, &maps, tables);
        let present: Vec<RigidObject> = vec![bytemuck::Zeroable::zeroed(); objects.count()];
        let outside_bytes = maps.size_bytes();
        Ok(Self {
            objects,
            balls,
            texel_objects,
            outside_bytes,
            outside_ratio: ratio_bytes as f64 / outside_bytes.max(1) as f64,
            words: context.upload("surface_maps/rigid words", &words)?,
            host_words: words,
            present: context.upload("surface_maps/rigid objects", &present)?,
            overlaps: Vec::new(),
        })
    }

    /// Takes over where the objects are now, and the order of the tree's leaves; `atlas` is that of the rest.
    pub fn place(
        &mut self,
        context: &Context,
        atlas: &Atlas,
        leaf_order: &[u32],
        world_from_rest: &[Mat4],
    ) -> Result<(), GpuError> {
        for (leaf, &texel) in leaf_order.iter().enumerate() {
            self.host_words[HEADER + leaf] = self.texel_objects[texel as usize];
        }
        context.write(&self.words, &self.host_words)?;
        self.overlaps = overlaps(atlas, &self.texel_objects, world_from_rest);
        let present: Vec<RigidObject> = (self.balls.iter().zip(world_from_rest).enumerate())
            .map(|(object, (ball, world_from_rest))| {
                let rows = world_from_rest.inverse().transpose();
                RigidObject {
                    rest_from_world_x: rows.x_axis.to_array(),
                    rest_from_world_y: rows.y_axis.to_array(),
                    rest_from_world_z: rows.z_axis.to_array(),
                    centre: ball.centre,
                    radius: ball.radius,
                    asks_rays: asks_rays(object, self.objects.count(), &self.overlaps),
                }
            })
            .collect();
        context.write(&self.present, &present)
    }
}

/// Bit k: on ways to object k some third object has one of the two in its hull.
fn asks_rays(object: usize, count: usize, overlaps: &[(usize, usize)]) -> u32 {
    let is_bad = |other: usize| {
        overlaps.iter().any(|&(hull, inside)| hull != object && hull != other && (inside == object || inside == other))
    };
    (0..count).filter(|&other| is_bad(other)).fold(0, |bits, other| bits | 1 << other)
}

/// Which objects' surfaces reach into which hulls.
fn overlaps(atlas: &Atlas, texel_objects: &[u32], world_from_rest: &[Mat4]) -> Vec<(usize, usize)> {
    let quads: Vec<(usize, [Vec3; 4])> = (atlas.texels.iter().zip(texel_objects))
        .map(|(texel, &object)| {
            let at = |u: f32, v: f32| texel.position + u * texel.side_u + v * texel.side_v;
            let corners = [at(-0.5, -0.5), at(0.5, -0.5), at(0.5, 0.5), at(-0.5, 0.5)];
            (object as usize, corners.map(|corner| world_from_rest[object as usize].transform_point3(corner)))
        })
        .collect();
    let all = quads.iter().flat_map(|(_, corners)| corners);
    let (low, high) = all.fold((Vec3::MAX, Vec3::MIN), |(low, high), &p| (low.min(p), high.max(p)));
    let slack = SLACK * (high - low).length();
    let mut found = Vec::new();
    for hull_of in 0..world_from_rest.len() {
        let own =
            quads.iter().filter(|(object, _)| *object == hull_of).flat_map(|(_, corners)| corners.iter().copied());
        let hull = Hull::of(own);
        for object in (0..world_from_rest.len()).filter(|&object| object != hull_of) {
            if quads.iter().any(|(of, corners)| *of == object && hull.meets(corners, slack)) {
                found.push((hull_of, object));
            }
        }
    }
    found
}

/// Of each texel; a texel's chart belongs to one part, and so to one object.
pub fn texel_objects(atlas: &Atlas, objects: &RigidObjects) -> Vec<u32> {
    let of =
        |texel: usize| atlas.parts_of(texel).first().map_or(0, |part| objects.triangle_objects[part.triangle as usize]);
    (0..atlas.texels.len()).map(of).collect()
}

/// In the order of the header.
fn words(objects: &RigidObjects, texel_objects: &[u32], maps: &CompressedMaps, tables: &MovingTables<'_>) -> Vec<u32> {
    let mut words = vec![0; HEADER];
    let MovingTables { atlas, places } = tables;
    let mut table = |entry: usize, values: &mut dyn Iterator<Item = u32>| {
        words[entry] = words.len() as u32;
        words.extend(values);
    };
    // Of the leaves: in the order of the tree, as soon as there is one.
    table(1, &mut texel_objects.iter().copied());
    table(2, &mut texel_objects.iter().copied());
    table(3, &mut places.iter().copied());
    table(4, &mut maps.offsets.iter().copied());
    table(5, &mut maps.runs.iter().map(|run| u32::from(run.depth) | u32::from(run.first) << 16));
    table(8, &mut atlas.texel_at.iter().copied());
    let corners = atlas.corner_places.iter().flatten().flatten();
    table(9, &mut corners.flat_map(|place| [place.x.to_bits(), place.y.to_bits()]));
    table(12, &mut objects.triangle_objects.iter().copied());
    words[0] = objects.count() as u32;
    words[6] = RESOLUTION;
    words[7] = DIRECTIONS;
    words[10] = atlas.resolution;
    words[11] = atlas.corner_places[0].len() as u32;
    words
}

/// The outside maps of one object.
fn make(
    context: &Context,
    ball: Ball,
    tracer: &Tracer<'_>,
    watch: &dyn Watch,
) -> Result<CompressedMaps, SurfaceMapError> {
    let pixels = (RESOLUTION * RESOLUTION) as usize;
    let place_count = 3 * DIRECTIONS * DIRECTIONS;
    let chunk = (CHUNK_RAYS / (2 * pixels)) as u32;
    let rays: Buffer<Ray> = context.buffer("outside maps/rays", 2 * chunk as usize * pixels)?;
    let hits: Buffer<Hit> = context.buffer("outside maps/hits", rays.len())?;
    let intervals: Buffer<u32> = context.buffer("outside maps/intervals", chunk as usize * pixels)?;
    let mut compressor = Compressor::new(pixels, None);
    for first_direction in (0..place_count).step_by(chunk as usize) {
        watch.step("outside maps", first_direction.into(), place_count.into())?;
        let chunk_count = chunk.min(place_count - first_direction);
        let count = chunk_count as usize * pixels;
        let mut recorder = context.recorder("outside maps")?;
        let params = passes::OutsideRaysParams {
            centre: ball.centre,
            radius: ball.radius,
            first_direction,
            chunk_count,
            directions: DIRECTIONS,
            resolution: RESOLUTION,
        };
        recorder.dispatch(&passes::OutsideRays { rays: &rays, params }, 2 * count);
        trace::closest_hit(&mut recorder, tracer, &rays, &hits, 2 * count);
        let params = passes::OutsideIntervalsParams { pixel_count: count as u32, radius: ball.radius };
        recorder.dispatch(&passes::OutsideIntervals { hits: &hits, intervals: &intervals, params }, count);
        recorder.submit()?;
        let words = context.download_range(&intervals, 0..count)?;
        compressor.push(bytemuck::cast_slice(&words));
    }
    watch.step("outside maps", place_count.into(), place_count.into())?;
    Ok(compressor.finish())
}

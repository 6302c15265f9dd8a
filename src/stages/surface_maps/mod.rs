//! Coherent surface shadow maps: from every texel of an atlas, depth in all directions, compressed; whether a texel sees
//! a point is a look-up.                                                                   [Ritschel2008 3]
//!
//! Two rays per pixel find the first surface and the next; any depth in between answers every query right. The texels
//! are walked so that neighbours see nearly the same ([`sequence`]), and along the walk each pixel keeps one depth for as
//! long as it holds. The maps are made chunk by chunk, can be interrupted between chunks, and are kept on disk.
//!
//! | paper | here | unit |
//! |---|---|---|
//! | sequence | place of a texel in the walk | – |
//! | q | pixel of a cube map | – |
//! | z | depth code: distance times `codes_per_metre` | 1 / 65534 of the scene's extent |
//!
//! Objects that move rigidly keep their maps: [`MovingMaps`] tells what is between points of different ones.
//!
//! What it does not do: it knows the shapes it was made of, and nothing that bends.
//!
//! [Ritschel2008]: crate::methods::PAPERS

pub mod cache;
mod compress;
mod outside;
mod packed;
mod placed;
pub mod sequence;
mod sharing;
mod sight;

pub use cache::{Found, Key};
pub use compress::{CompressedMaps, Compressor, Interval, MAX_PLACES, Run};
pub use outside::{Ball, MovingMaps, MovingTables, texel_objects};
pub use packed::{Fetch, PackedRuns, RunLayout};
pub use placed::PlacedMaps;
pub use sequence::Sequence;
pub use sharing::Sharing;

use super::trace::{self, Tracer};
use super::work::{Interrupted, Watch};
use crate::gpu::shaders::surface_maps as passes;
use crate::gpu::shaders::types::{Hit, Ray, SurfaceMapFrame, SurfaceMapQuery};
use crate::gpu::{Buffer, Context, GpuError, Recorder, TexelBuffer};
use crate::scene::atlas::Atlas;
use glam::Vec3;
use packed::Packing;
use std::ops::Range;
use std::path::Path;

/// How far behind the first surface depths stand where the next lit one is farther, of its distance.
const LIT_BEHIND: f32 = 1.0 / 64.0;
/// Rays that are cast together.
const CHUNK_RAYS: usize = 1 << 19;

/// Why there are no maps.
#[derive(Debug, thiserror::Error)]
pub enum SurfaceMapError {
    #[error("{texels} texels; maps can be made of {MAX_PLACES} at most: lower atlas_resolution or raise map_sharing")]
    TooManyTexels { texels: usize },
    #[error(
        "compressed maps take {bytes} bytes after {done} of {texels} maps, {allowed} are allowed; lower map_resolution or \
         atlas_resolution, or raise map_sharing"
    )]
    OutOfMemory { bytes: u64, done: usize, texels: usize, allowed: u64 },
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

crate::choice! {
    /// How look-ups are filtered between pixels of a map.
    pub enum MapFilter {
        /// Not at all
        None = "none",
        /// One of the four pixels around, drawn by its share: as fast, with noise
        Drawn = "drawn",
        /// All four pixels around
        Four = "four",
    }
}

crate::choice! {
    /// How far behind the first surface a depth may be.
    pub enum MapUntil {
        /// The next surface
        Next = "next",
        /// The next that is lit from this side, and so can be asked for: fewer runs; thin things beside a pixel's ray leak more
        Lit = "lit",
    }
}

/// How maps are made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapOptions {
    /// Pixels a side of a face.
    pub resolution: u32,
    pub sequence: Sequence,
    /// How far depths keep from the surfaces they tell apart, in widths of a pixel.
    pub bias: f32,
    pub until: MapUntil,
    /// Texels that share maps are less than so many texels apart; 0: none does.
    pub sharing: f32,
}

/// The maps on the device.
pub struct SurfaceMaps {
    pub options: MapOptions,
    pub maps: CompressedMaps,
    /// Place in the sequence of the map that each texel looks through.
    pub places: Vec<u32>,
    /// Where the maps stand, by place.
    pub origins: Buffer<Vec3>,
    pub run_offsets: TexelBuffer,
    pub runs: TexelBuffer,
    /// How the runs lie in both.
    packing: Packing,
    pub codes_per_metre: f32,
    /// Rays that were cast; 0 when read from disk.
    pub ray_count: u64,
}

/// What maps are made of.
#[derive(Clone, Copy)]
pub struct MapInput<'a> {
    pub atlas: &'a Atlas,
    pub tracer: Tracer<'a>,
    /// Objects that move against each other see themselves alone; `None`: all see all, by `tracer`.
    pub apart: Option<Apart<'a>>,
    /// World-space corners of the scene.
    pub bounds: [Vec3; 2],
    /// What the rays may hit, as plain data: goes into the key on disk.
    pub content: &'a [&'a [u8]],
    /// Where maps are kept; `None` keeps none.
    pub cache: Option<&'a Path>,
}

/// Objects that move against each other.
#[derive(Clone, Copy)]
pub struct Apart<'a> {
    /// How rays are cast at each object alone.
    pub tracers: &'a [Tracer<'a>],
    /// Of each texel.
    pub texel_objects: &'a [u32],
}

impl SurfaceMaps {
    /// Makes the maps, or reads them where they were made before.
    pub fn new(
        context: &Context,
        input: MapInput<'_>,
        options: MapOptions,
        watch: &dyn Watch,
    ) -> Result<Self, SurfaceMapError> {
        let mut order = sequence::walk(input.atlas, options.sequence);
        let texel_objects = input.apart.map(|apart| apart.texel_objects);
        if let Some(objects) = texel_objects {
            // One object after the other.
            order.sort_by_key(|&texel| objects[texel as usize]);
        }
        let mut shared = Sharing::new(input.atlas, &order, texel_objects, options.sharing);
        if shared.order.len() > MAX_PLACES {
            return Err(SurfaceMapError::TooManyTexels { texels: shared.order.len() });
        }
        if options.sequence == Sequence::Sight {
            let mut order = sight::order(context, &input, options, &shared.order, watch)?;
            if let Some(objects) = texel_objects {
                order.sort_by_key(|&texel| objects[texel as usize]);
            }
            shared.reorder(order);
        }
        let Sharing { order, places } = shared;
        let Placement { origins, normals, offset, codes_per_metre } = Placement::new(&input, &order);

        let is_lit = options.until == MapUntil::Lit;
        let settings = [options.resolution, options.bias.to_bits(), codes_per_metre.to_bits(), u32::from(is_lit)];
        let mut parts: Vec<&[u8]> =
            vec![bytemuck::cast_slice(&settings), bytemuck::cast_slice(&origins), bytemuck::cast_slice(&normals)];
        parts.extend(input.content);
        let key = Key::over(&parts);
        let mut ray_count = 0;
        let counts = (origins.len(), 6 * (options.resolution as usize).pow(2));
        let maps = match input.cache.map(|folder| cache::read(folder, &key)) {
            Some(Found::Maps(maps)) if (maps.place_count as usize, maps.pixel_count()) == counts => maps,
            found => {
                if let (Some(Found::Damaged(reason)), Some(folder)) = (&found, input.cache) {
                    tracing::warn!("{} is damaged ({reason}); made anew", key.file_in(folder).display());
                }
                let lit_only = is_lit && input.apart.is_none();
                let maker =
                    Maker { context, legs: legs(&input, &order), options, codes_per_metre, gap: offset, lit_only };
                let maps = maker.make(&origins, &normals, watch)?;
                ray_count = 2 * maps.pixel_count() as u64 * u64::from(maps.place_count);
                if let Some(folder) = input.cache
                    && let Err(error) = cache::write(folder, &key, &maps)
                {
                    tracing::warn!("the maps are not kept: {error}");
                }
                maps
            }
        };
        let packed = PackedRuns::best(&maps);
        Ok(Self {
            options,
            places,
            origins: context.upload("surface_maps/origins", &origins)?,
            run_offsets: texels(context, "surface_maps/run offsets", &packed.offsets)?,
            runs: texels(context, "surface_maps/runs", &packed.words)?,
            packing: Packing::of(&packed),
            maps,
            codes_per_metre,
            ray_count,
        })
    }

    /// Bytes on the device.
    pub fn size_bytes(&self) -> u64 {
        self.run_offsets.size_bytes() + self.runs.size_bytes()
    }

    /// Bytes of the maps in 16 bits a pixel, for each byte on the device.
    pub fn ratio(&self) -> f64 {
        let plain = self.maps.pixel_count() as u64 * u64::from(self.maps.place_count) * size_of::<u16>() as u64;
        plain as f64 / self.size_bytes() as f64
    }

    /// How the runs lie on the device.
    pub fn layout(&self) -> RunLayout {
        self.packing.layout
    }

    /// The same maps laid out otherwise.
    pub fn repack(&mut self, context: &Context, layout: RunLayout) -> Result<(), GpuError> {
        let packed = PackedRuns::of(&self.maps, layout);
        self.run_offsets = texels(context, "surface_maps/run offsets", &packed.offsets)?;
        self.runs = texels(context, "surface_maps/runs", &packed.words)?;
        self.packing = Packing::of(&packed);
        Ok(())
    }

    /// How shaders read the maps.
    pub fn frame(&self, filter: MapFilter, sender_filter: MapFilter) -> SurfaceMapFrame {
        let code = |filter| match filter {
            MapFilter::None => 0,
            MapFilter::Drawn => 1,
            MapFilter::Four => 2,
        };
        SurfaceMapFrame {
            resolution: self.options.resolution,
            codes_per_metre: self.codes_per_metre,
            filter_mode: code(filter),
            sender_filter: code(sender_filter),
            block_bits: self.packing.layout.block_bits(),
            block_count: self.packing.block_count,
            firsts_at: self.packing.firsts_at,
            near_share: 0.0,
        }
    }

    /// What of each point its texel sees, 0..1; the first `count` queries.
    pub fn query(
        &self,
        recorder: &mut Recorder<'_>,
        queries: &Buffer<SurfaceMapQuery>,
        visibility: &Buffer<f32>,
        count: usize,
        filter: MapFilter,
    ) {
        let pass = passes::Query {
            queries,
            map_origins: &self.origins,
            run_offsets: &self.run_offsets,
            runs: &self.runs,
            visibility,
            params: passes::QueryParams { query_count: count as u32, frame: self.frame(filter, MapFilter::None) },
        };
        recorder.dispatch(&pass, count);
    }
}

/// The words as texels of four, zeros behind the last.
fn texels(context: &Context, name: &str, words: &[u32]) -> Result<TexelBuffer, GpuError> {
    let texels: Vec<[u32; 4]> =
        words.chunks(4).map(|words| std::array::from_fn(|k| words.get(k).copied().unwrap_or(0))).collect();
    let buffer = context.texel_buffer(name, texels.len().max(1))?;
    context.write(buffer.buffer(), &texels)?;
    Ok(buffer)
}

/// The maps of all places before compression, one after the other: what tests hold the compressed ones against.
pub fn uncompressed(
    context: &Context,
    input: MapInput<'_>,
    options: MapOptions,
    order: &[u32],
    watch: &dyn Watch,
) -> Result<Vec<Interval>, SurfaceMapError> {
    let frame = Placement::new(&input, order);
    let mut all = Vec::new();
    let (legs, codes_per_metre) = (legs(&input, order), frame.codes_per_metre);
    let lit_only = options.until == MapUntil::Lit && input.apart.is_none();
    let maker = Maker { context, legs, options, codes_per_metre, gap: frame.offset, lit_only };
    maker.intervals(&frame.origins, &frame.normals, watch, |maps, _| {
        all.extend_from_slice(maps);
        Ok(())
    })?;
    Ok(all)
}

/// Where maps stand, by place.
struct Placement {
    origins: Vec<Vec3>,
    normals: Vec<Vec3>,
    offset: f32,
    codes_per_metre: f32,
}

impl Placement {
    fn new(input: &MapInput<'_>, order: &[u32]) -> Self {
        let [low, high] = input.bounds;
        let offset = map_offset(input.bounds);
        let texels = || order.iter().map(|&texel| input.atlas.texels[texel as usize]);
        Self {
            origins: texels().map(|texel| texel.position + offset * texel.normal).collect(),
            normals: texels().map(|texel| texel.normal).collect(),
            offset,
            codes_per_metre: 65_533.0 / (high - low).length().max(f32::MIN_POSITIVE),
        }
    }
}

/// How far maps stand off their surface, metres.
pub fn map_offset([low, high]: [Vec3; 2]) -> f32 {
    let reach = low.abs().max(high.abs()).max_element().max((high - low).length());
    1e-5 * reach
}

/// Places of the sequence, one part after the other, with what each is seen by.
fn legs<'a>(input: &MapInput<'a>, order: &[u32]) -> Vec<(Range<usize>, Tracer<'a>)> {
    let Some(Apart { tracers, texel_objects }) = input.apart else { return vec![(0..order.len(), input.tracer)] };
    let object = |place: usize| texel_objects[order[place] as usize] as usize;
    let mut first = 0;
    let legs = order.chunk_by(|&a, &b| texel_objects[a as usize] == texel_objects[b as usize]);
    legs.map(|leg| {
        let places = first..first + leg.len();
        first = places.end;
        (places.clone(), tracers[object(places.start)])
    })
    .collect()
}

/// Casts and compresses.
struct Maker<'a> {
    context: &'a Context,
    legs: Vec<(Range<usize>, Tracer<'a>)>,
    options: MapOptions,
    codes_per_metre: f32,
    /// How far behind a surface the next is sought, metres.
    gap: f32,
    /// The next is one that is lit from this side: what stands apart may be anywhere else, and is asked for too.
    lit_only: bool,
}

/// Buffers of a chunk.
struct Chunk {
    intervals: Buffer<u32>,
    /// What the device's own traversal is asked by; ours needs no lists.
    lists: Option<RayLists>,
}

struct RayLists {
    rays: Buffer<Ray>,
    hits: Buffer<Hit>,
    second_hits: Buffer<Hit>,
}

impl Maker<'_> {
    fn make(&self, origins: &[Vec3], normals: &[Vec3], watch: &dyn Watch) -> Result<CompressedMaps, SurfaceMapError> {
        let allowed = self.context.limits().storage_buffer_bytes;
        let resolution = self.options.resolution;
        // Where a pixel's own ray meets a slope that it is wide enough to see differs by its width.
        let behind = if self.lit_only { LIT_BEHIND } else { 2.0 / resolution as f32 };
        let mut compressor = Compressor::new(6 * (resolution as usize).pow(2), Some(behind));
        let mut done = 0;
        self.intervals(origins, normals, watch, |maps, count| {
            compressor.push(maps);
            done += count;
            let bytes = compressor.size_bytes();
            if bytes > allowed {
                return Err(SurfaceMapError::OutOfMemory { bytes, done, texels: origins.len(), allowed });
            }
            Ok(())
        })?;
        Ok(compressor.finish())
    }

    /// Hands on the maps of all places, chunk by chunk, with how many they are.
    fn intervals(
        &self,
        origins: &[Vec3],
        normals: &[Vec3],
        watch: &dyn Watch,
        mut hand_on: impl FnMut(&[Interval], usize) -> Result<(), SurfaceMapError>,
    ) -> Result<(), SurfaceMapError> {
        let context = self.context;
        let pixel_count = 6 * (self.options.resolution as usize).pow(2);
        let chunk_places = (CHUNK_RAYS / pixel_count).clamp(1, origins.len().max(1));
        let map_origins = context.upload("surface_maps/origins", origins)?;
        let map_normals = context.upload("surface_maps/normals", normals)?;
        let ray_count = chunk_places * pixel_count;
        let has_lists = self.legs.iter().any(|(_, tracer)| matches!(tracer, Tracer::RayQuery(..)));
        let lists = || -> Result<RayLists, GpuError> {
            Ok(RayLists {
                rays: context.buffer("surface_maps/rays", ray_count)?,
                hits: context.buffer("surface_maps/hits", ray_count)?,
                second_hits: context.buffer("surface_maps/second hits", ray_count)?,
            })
        };
        let chunk = Chunk {
            intervals: context.buffer("surface_maps/intervals", ray_count)?,
            lists: has_lists.then(lists).transpose()?,
        };
        let chunks = self.legs.iter().flat_map(|(places, tracer)| {
            let end = places.end;
            places.clone().step_by(chunk_places).map(move |first| (first, chunk_places.min(end - first), tracer))
        });
        for (first, count, tracer) in chunks {
            watch.step("surface shadow maps", first as u64, origins.len() as u64)?;
            let mut recorder = context.recorder("surface maps")?;
            self.cast(&mut recorder, tracer, &chunk, (&map_origins, &map_normals), first as u32, count as u32);
            recorder.submit()?;
            let words = context.download_range(&chunk.intervals, 0..count * pixel_count)?;
            hand_on(bytemuck::cast_slice(&words), count)?;
        }
        watch.step("surface shadow maps", origins.len() as u64, origins.len() as u64)?;
        Ok(())
    }

    /// First and second surfaces of a chunk's pixels, as intervals of depths.
    fn cast(
        &self,
        recorder: &mut Recorder<'_>,
        tracer: &Tracer<'_>,
        chunk: &Chunk,
        (map_origins, map_normals): (&Buffer<Vec3>, &Buffer<Vec3>),
        first_place: u32,
        chunk_count: u32,
    ) {
        let (resolution, intervals) = (self.options.resolution, &chunk.intervals);
        let (codes_per_metre, bias) = (self.codes_per_metre, self.options.bias);
        let ray_count = 6 * resolution * resolution * chunk_count;
        match (tracer, &chunk.lists) {
            (Tracer::RayQuery(..), Some(RayLists { rays, hits, second_hits })) => {
                let params = passes::CubeRaysParams { first_place, chunk_count, resolution };
                recorder.dispatch(&passes::CubeRays { map_origins, map_normals, rays, params }, ray_count);
                trace::closest_hit(recorder, tracer, rays, hits, ray_count as usize);
                let params = passes::SecondRaysParams { ray_count, gap: self.gap };
                recorder.dispatch(&passes::SecondRays { hits, rays, params }, ray_count);
                trace::closest_hit(recorder, tracer, rays, second_hits, ray_count as usize);
                let params = passes::IntervalsParams { first_place, chunk_count, resolution, codes_per_metre, bias };
                recorder.dispatch(&passes::Intervals { map_normals, hits, second_hits, intervals, params }, ray_count);
            }
            (Tracer::Compute(bvh, surfaces), _) => {
                let pass = passes::Depths {
                    bvh_nodes: bvh.nodes(),
                    bvh_triangles: bvh.triangles(),
                    map_origins,
                    triangles: surfaces.triangles,
                    triangle_materials: surfaces.triangle_materials,
                    attributes: surfaces.attributes,
                    materials: surfaces.materials,
                    textures: surfaces.textures,
                    map_normals,
                    intervals,
                    params: passes::DepthsParams {
                        first_place,
                        chunk_count,
                        resolution,
                        codes_per_metre,
                        bias,
                        gap: self.gap,
                        lit_only: u32::from(self.lit_only),
                    },
                    constants: passes::DepthsConstants { alpha_test: surfaces.has_holes },
                };
                recorder.dispatch(&pass, ray_count);
            }
            (Tracer::RayQuery(..), None) => debug_assert!(false, "a chunk for the device's traversal has lists"),
        }
    }
}

//! Coherent surface shadow maps [Ritschel2008]: visibility as a look-up, hierarchical radiosity over the texels of an
//! atlas, and a final gather per pixel from the same tree.
//!
//! Every texel holds a compressed depth cube map. In each bounce every texel finds its own cut through a tree over all
//! texels and gathers from its nodes in one walk without a stack, asking the senders' maps whether they see it; then the
//! tree's inner nodes are summed up anew. The picture is one more such walk, per pixel.
//!
//! | paper | here | unit | buffer |
//! |---|---|---|---|
//! | D, depth cube maps | [`SurfaceMaps`] | codes | `surface_maps/runs` |
//! | atlas | [`Atlas`], [`Texels`] | – | `texels/texels` |
//! | N_s, N_r | node of the tree, texel | – | [`SenderTree`] |
//! | L_max | `largest_radiance` of `lib/receiver.glsl` | W m^-2 sr^-1 | – |
//! | L of a texel | irradiance, `reflected` | W/m2 | `surface_shadow_maps/irradiance` ... |
//! | threshold | [`Settings::threshold`] | of white | – |
//!
//! **Per frame without new maps:** lights, emission, albedo, environment, objects that move rigidly
//! ([`SurfaceShadowMaps::place`]). **With new maps:** surfaces that bend or scale.
//!
//! **Shiny texels** send their lobes' light by direction, along bins over their hemispheres ([`Settings::glossy_bins`]): no
//! lobe between texels is narrower than a bin, and what mirrors throw on walls is blurred so far. Texels below
//! [`Settings::gloss_threshold`] send evenly what both lobes reflect. The last bounce, towards the eye, has the exact lobe:
//! at pixels, and at the texels of the lightmap.
//!
//! Differs from [Ritschel2008]: light of near senders is measured by exact form factors of the texels' parallelograms, so
//! that nothing is clamped; leaves of a node are drawn by chance, so that the error of a cut is noise without a mean; the
//! direct light of emissive texels comes by the same walk; texels receive at points drawn all over their surface, since
//! those of small charts are large; where a map sees, a ray looks over the last stretch before the receiver, where its pixels
//! are too wide to tell what lies before an edge from what lies behind it ([`Settings::map_stretch`]); maps may be
//! ordered by what they see ([`Settings::sequence`]); texels that stand close together may share a map ([`Settings::map_sharing`]).
//!
//! [Ritschel2008]: crate::methods::PAPERS

mod gathering;
mod gloss;
mod moving;
mod views;

pub use views::{FlatPicture, Shown};

use crate::gpu::shaders::methods::surface_shadow_maps as passes;
use crate::gpu::{Buffer, Context, GpuError, Recorder};
use crate::methods::pick::Pick;
use crate::report::tonemap::ToneSettings;
use crate::scene::Scene;
use crate::scene::atlas::{Atlas, AtlasError, Size};
use crate::scene::geometry::Geometry;
use crate::scene::pose::Pose;
use crate::stages::bvh::{Bvh, BvhError};
use crate::stages::hidden_parts::{self, HiddenPartsError, Seen};
use crate::stages::sender_tree::{NodeLayout, SenderTree, SenderTreeError, TreeOptions};
use crate::stages::shiny_texels::{ShinyTexels, ShinyTexelsError};
use crate::stages::surface_maps::{
    self, MapFilter, MapInput, MapOptions, MapUntil, PlacedMaps, Sequence, SurfaceMapError, SurfaceMaps, map_offset,
    texel_objects,
};
use crate::stages::texels::{self, Texels};
use crate::stages::trace::Tracer;
use crate::stages::work::Watch;
use crate::stages::world::World;
use glam::Vec3;
use gloss::{Filled, Gloss};
use moving::{Apart, Rest};
use serde::Serialize;
use std::path::Path;

crate::choice! {
    /// What decides whether texels see each other.
    pub enum TexelVisibility {
        /// The surface shadow maps of the senders
        Maps = "maps",
        /// Rays by our own traversal; no maps are made
        Rays = "rays",
    }
}

crate::settings! {
    /// What surface shadow maps let the user choose.
    pub struct Settings {
        /// Texels a side of the atlas; 0 takes as many as the scene's charts ask for, from 64 to 256.
        atlas_resolution: u32 = 0, range 0..=2048, unit "texels", paper "32 to 128";
        /// Free texels between charts, for other programs that filter the atlas; nothing here needs any.
        atlas_gutter: u32 = 0, range 0..=8, unit "texels", paper "not given";
        /// Pixels a side of a depth cube map's face.
        map_resolution: u32 = 32, range 4..=256, unit "pixels", paper "32 or 64";
        /// How the texels are walked when maps are compressed.
        sequence: Sequence = Sequence::Spiral, paper "spiral is best";
        /// How far depths keep from the surfaces they tell apart.
        map_bias: f32 = 0.05, range 0.0..=16.0, unit "widths of a pixel", paper "a depth bias, not given";
        /// How far behind the first surface a depth of a map may be: what lets it hold for longer.
        map_until: MapUntil = MapUntil::Next, paper "next";
        /// Texels that face alike less than so many texels apart look through one map: fewer maps where charts are small.
        map_sharing: f32 = 0.0, range 0.0..=8.0, unit "texels", paper "0: one each";
        /// What maps see is looked over by rays within so many widths of their pixels of the texel that sees; 0 asks maps
        /// alone.
        map_stretch: f32 = 1.0, range 0.0..=100.0, unit "pixels of a map", paper "not done";
        /// How look-ups are filtered between pixels of a map.
        map_filter: MapFilter = MapFilter::Drawn, paper "not given";
        /// How look-ups are filtered between a sender's texel and those beside it, where points on senders are drawn.
        sender_filter: MapFilter = MapFilter::Drawn, paper "not given";
        /// What decides whether texels see each other.
        visibility: TexelVisibility = TexelVisibility::Maps, paper "maps";
        /// A node is opened where its light, gone wrong, would change what is shown by more than this.
        threshold: f32 = 0.02, range 0.0..=1.0, unit "of white", paper "user-defined";
        /// Draw leaves of a node, and points on them, by chance.
        jitter: bool = true, paper "not in bounces";
        /// Senders that would change what is shown by less than this share of the threshold are asked by chance, and count
        /// for those that are not; needs jitter.
        chance: f32 = 0.0, range 0.0..=100.0, unit "of threshold", paper "not done";
        /// Points of each texel that shadow rays to punctual lights start from.
        light_samples: u32 = 8, range 1..=1024, unit "points", paper "shadow maps";
        /// Rays of each texel to the environment.
        environment_rays: u32 = 128, range 1..=65536, unit "rays", paper "not given";
        /// Shown by the lightmap, texels that shine gather a bounce of their own towards the eye; else they reflect as if light
        /// came evenly from all sides.
        glossy_bounce: bool = true, paper "Fig. 17";
        /// Texels whose lobes reflect this share of even light, and more, send it by direction; others evenly.
        gloss_threshold: f32 = 0.1, range 0.0..=2.0, paper "all texels send evenly";
        /// Bins a side of the hemisphere of a texel that sends by direction, no lobe narrower than one; 0: all send evenly.
        glossy_bins: u32 = 8, range 0..=16, unit "bins", paper "none; future work";
        /// How nodes of the tree lie in memory.
        tree_layout: NodeLayout = NodeLayout::Wide, paper "compact";
        /// How much a difference of normals counts beside distance when the tree is cut.
        tree_normal_weight: f32 = 0.25, range 0.0..=10.0, paper "0: by position alone";
        /// What the picture shows.
        show: Shown = Shown::Light, paper "Figs. 6 and 7";
        /// Whose depth map is shown.
        pick: Pick = Pick::Nothing, paper "not given";
        /// Keep the maps on disk, in the user's cache folder.
        keep_maps: bool = true, paper "not given";
    }
}

/// Why the method cannot be prepared.
#[derive(Debug, thiserror::Error)]
pub enum SurfaceShadowMapsError {
    #[error(transparent)]
    Atlas(#[from] AtlasError),
    #[error(transparent)]
    HiddenParts(#[from] HiddenPartsError),
    #[error(transparent)]
    Tree(#[from] SenderTreeError),
    #[error(transparent)]
    Shiny(#[from] ShinyTexelsError),
    #[error(transparent)]
    Maps(#[from] SurfaceMapError),
    #[error(transparent)]
    Bvh(#[from] BvhError),
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

impl Settings {
    /// How the tree over the texels is built.
    fn tree_options(&self) -> TreeOptions {
        TreeOptions { normal_weight: self.tree_normal_weight, layout: self.tree_layout, ..TreeOptions::default() }
    }
}

/// What the method reads of the scene.
#[derive(Clone, Copy)]
pub struct Stage<'a> {
    pub scene: &'a Scene,
    pub geometry: &'a Geometry,
    /// World space, in the present pose.
    pub positions: &'a [Vec3],
    /// World space, before anything moved.
    pub rest_positions: &'a [Vec3],
    pub pose: &'a Pose,
    pub bounds: [Vec3; 2],
    pub world: &'a World,
    pub tracer: Tracer<'a>,
    /// What the picture will be shown with: it says where errors show.
    pub tone: ToneSettings,
    pub seed: u32,
    /// Where maps are kept between runs.
    pub cache: Option<&'a Path>,
    pub watch: &'a dyn Watch,
}

/// The scene in the pose that is lit.
#[derive(Clone, Copy)]
pub struct Lit<'a> {
    pub world: &'a World,
    pub tracer: Tracer<'a>,
    /// What maps do not tell is traced by this.
    pub bvh: &'a Bvh,
}

/// The method on one scene.
pub struct SurfaceShadowMaps {
    settings: Settings,
    pub atlas: Atlas,
    pub texels: Texels,
    pub tree: SenderTree,
    pub maps: Option<PlacedMaps>,
    gloss: Gloss,
    rest: Option<Rest>,
    tone: ToneSettings,
    seed: u32,
    state: State,
}

/// Light of the texels, W/m2, `texel_count` entries each.
struct State {
    emitted: Buffer<Vec3>,
    /// Nothing: what reflects, or emits, when only the other counts.
    dark: Buffer<Vec3>,
    /// Of the last bounce.
    irradiance: Buffer<Vec3>,
    reflected: Buffer<Vec3>,
    reflected_sum: Buffer<Vec3>,
    /// Of the sum, what left before the last bounce.
    sent_before: Buffer<Vec3>,
    /// From emitters and the environment.
    direct: Buffer<Vec3>,
    indirect: Buffer<Vec3>,
    cut_sizes: Buffer<u32>,
}

/// What was made, in numbers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Report {
    pub texels: u32,
    pub charts: u32,
    pub atlas_resolution: u32,
    pub nodes: u32,
    pub tree_bytes: u64,
    pub maps: u32,
    pub map_bytes: u64,
    /// Bytes of the maps uncompressed for each byte of runs; 0 without maps.
    pub ratio: f64,
    /// Cast for the maps; 0 where they were read from disk.
    pub map_rays: u64,
    /// Of the maps from outside of objects that move; 0 where nothing does.
    pub outside_bytes: u64,
    /// Pairs (hull, object) of which the second reaches into the first's hull: rays are cast past them.
    pub overlaps: u32,
}

impl std::fmt::Display for Report {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { texels, charts, atlas_resolution, nodes, .. } = self;
        write!(f, "{texels} texels in {charts} charts ({atlas_resolution} x {atlas_resolution}), {nodes} nodes")?;
        if self.map_bytes > 0 {
            let source = if self.map_rays > 0 { format!("{} rays", self.map_rays) } else { "read from disk".into() };
            write!(f, "; {} maps of {} bytes, compressed {:.1} : 1, {source}", self.maps, self.map_bytes, self.ratio)?;
        }
        if self.outside_bytes > 0 {
            write!(f, "; maps from outside of {} bytes, {} hulls are reached into", self.outside_bytes, self.overlaps)?;
        }
        Ok(())
    }
}

impl SurfaceShadowMaps {
    /// Unwraps the scene, builds the tree and makes the maps.
    pub fn prepare(context: &Context, stage: &Stage<'_>, settings: Settings) -> Result<Self, SurfaceShadowMapsError> {
        let apart = Apart::of(context, stage, &settings)?;
        let positions = if apart.is_some() { stage.rest_positions } else { stage.positions };
        let mut atlas = make_atlas(stage, positions, &settings)?;
        // Maps of objects apart hold in every pose, and so must all that they are measured by.
        let bounds = if apart.is_some() { bounds_of(stage.rest_positions) } else { stage.bounds };
        let ray_offset = map_offset(bounds);
        let tracers = apart.as_ref().map_or(vec![stage.tracer], |apart| apart.tracers(stage));
        let triangle_objects = apart.as_ref().map_or(&[][..], |apart| &apart.objects.triangle_objects);
        let seen = Seen { tracers: &tracers, triangle_objects, ray_offset };
        hidden_parts::leave_out(context, &seen, stage.geometry, positions, &mut atlas, stage.watch)?;
        let texels = Texels::new(context, &atlas, stage.world, ray_offset)?;
        let shiny = [settings.glossy_bins as f32, settings.gloss_threshold];
        let gloss = Gloss::new(context, ShinyTexels::find(context, &texels, &atlas, shiny)?)?;
        let options = settings.tree_options();
        let tree = SenderTree::with_shiny(context, &texels::leaves(&atlas), gloss.shiny.as_leaves(), options)?;
        let maps = match settings.visibility {
            TexelVisibility::Maps => {
                Some(make_maps(context, &Stage { bounds, ..*stage }, &atlas, &tree, &settings, apart.as_ref())?)
            }
            TexelVisibility::Rays => None,
        };
        let state = State::new(context, texels.count as usize)?;
        let rest = apart.is_some().then(|| Rest::of(stage, &atlas));
        let (tone, seed) = (stage.tone, stage.seed);
        let mut method = Self { settings, atlas, texels, tree, maps, gloss, rest, tone, seed, state };
        method.place(context, stage)?;
        Ok(method)
    }

    /// Direct light of the texels and `bounces` more; leaves the tree filled with all of it, ready to be gathered from.
    ///                                                                                       [Ritschel2008 4.1, Fig. 8]
    pub fn solve(&self, recorder: &mut Recorder<'_>, lit: Lit<'_>, bounces: u32) {
        let Lit { world, tracer, .. } = lit;
        let (texels, s) = (&self.texels, &self.state);
        for sum in [&s.reflected_sum, &s.sent_before, &s.indirect, &s.dark] {
            recorder.fill(sum, 0);
        }
        let pass = passes::Emit {
            emission: &texels.emission,
            emitted: &s.emitted,
            params: passes::EmitParams { texel_count: texels.count },
        };
        recorder.dispatch(&pass, texels.count);
        texels.update_shapes(recorder, world);
        self.gloss.begin(recorder, texels);
        let shiny = Some(&self.gloss.shiny);
        recorder.scope("direct", |recorder| {
            self.fill(recorder, Filled::Emitted);
            self.gather(recorder, &lit, 0);
            texels.add_environment(recorder, &tracer, world, self.settings.environment_rays, &s.irradiance, shiny);
            recorder.copy(&s.irradiance, &s.direct);
            texels.add_lights(recorder, &tracer, world, self.settings.light_samples, &s.irradiance, shiny);
            self.reflect(recorder, false);
        });
        for bounce in 1..=bounces {
            recorder.scope(format_args!("bounce {bounce}"), |recorder| {
                self.fill(recorder, Filled::Bounce);
                recorder.copy(&s.reflected_sum, &s.sent_before);
                self.gloss.keep_sum(recorder);
                self.gather(recorder, &lit, bounce);
                self.reflect(recorder, true);
            });
        }
        self.fill(recorder, Filled::All);
    }

    /// Fills the tree with what the texels' own irradiance came from: for a last bounce of theirs towards the eye.
    pub fn send_before_last(&self, recorder: &mut Recorder<'_>) {
        self.fill(recorder, Filled::BeforeLast);
    }

    /// Fills the tree with what emits alone: what is shown without bounces.
    pub fn emit_only(&self, recorder: &mut Recorder<'_>) {
        self.fill(recorder, Filled::Emitted);
    }

    /// What arrived leaves again, and is kept.
    fn reflect(&self, recorder: &mut Recorder<'_>, is_indirect: bool) {
        let s = &self.state;
        let pass = passes::Reflect {
            irradiance: &s.irradiance,
            even_albedo: &self.gloss.even_albedo,
            reflected: &s.reflected,
            reflected_sum: &s.reflected_sum,
            indirect: &s.indirect,
            params: passes::ReflectParams { texel_count: self.texels.count, is_indirect: u32::from(is_indirect) },
        };
        recorder.dispatch(&pass, self.texels.count);
        self.gloss.reflect(recorder, &self.texels);
    }

    /// Of the last bounce alone, W/m2 per texel.
    pub fn last_irradiance(&self) -> &Buffer<Vec3> {
        &self.state.irradiance
    }

    /// From emitters and the environment, unreflected; W/m2 per texel.
    pub fn direct_irradiance(&self) -> &Buffer<Vec3> {
        &self.state.direct
    }

    /// Sum over bounces, W/m2 per texel.
    pub fn indirect_irradiance(&self) -> &Buffer<Vec3> {
        &self.state.indirect
    }

    /// Nodes that each texel gathered from in the last bounce.
    pub fn cut_sizes(&self) -> &Buffer<u32> {
        &self.state.cut_sizes
    }

    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    pub fn report(&self) -> Report {
        let maps = self.maps.as_ref().map(|placed| &placed.maps);
        let moving = self.maps.as_ref().and_then(|placed| placed.moving.as_ref());
        Report {
            texels: self.texels.count,
            charts: self.atlas.chart_count,
            atlas_resolution: self.atlas.resolution,
            nodes: self.tree.node_count(),
            tree_bytes: self.tree.size_bytes(),
            maps: maps.map_or(0, |maps| maps.maps.place_count),
            map_bytes: maps.map_or(0, SurfaceMaps::size_bytes),
            ratio: maps.map_or(0.0, SurfaceMaps::ratio),
            map_rays: maps.map_or(0, |maps| maps.ray_count),
            outside_bytes: moving.map_or(0, |moving| moving.outside_bytes),
            overlaps: moving.map_or(0, |moving| moving.overlaps.len() as u32),
        }
    }
}

fn bounds_of(positions: &[Vec3]) -> [Vec3; 2] {
    positions.iter().fold([Vec3::MAX, Vec3::MIN], |[low, high], &p| [low.min(p), high.max(p)])
}

fn make_atlas(stage: &Stage<'_>, positions: &[Vec3], settings: &Settings) -> Result<Atlas, AtlasError> {
    let size = |resolution| Size { resolution, gutter: settings.atlas_gutter };
    match settings.atlas_resolution {
        0 => Atlas::fitting(stage.scene, stage.geometry, positions, size(64), 256),
        given => Atlas::new(stage.scene, stage.geometry, positions, size(given)),
    }
}

fn make_maps(
    context: &Context,
    stage: &Stage<'_>,
    atlas: &Atlas,
    tree: &SenderTree,
    settings: &Settings,
    apart: Option<&Apart>,
) -> Result<PlacedMaps, SurfaceShadowMapsError> {
    let options = MapOptions {
        resolution: settings.map_resolution,
        sequence: settings.sequence,
        bias: settings.map_bias,
        until: settings.map_until,
        sharing: settings.map_sharing,
    };
    let sides = side_content(stage);
    let shapes = apart.map_or_else(
        || bytemuck::cast_slice(stage.positions).to_vec(),
        |apart| moving::content(apart, stage.rest_positions),
    );
    let content = [&shapes[..], bytemuck::cast_slice(&stage.geometry.triangles), &sides];
    let tracers = apart.map(|apart| apart.tracers(stage)).unwrap_or_default();
    let texel_objects = apart.map(|apart| texel_objects(atlas, &apart.objects)).unwrap_or_default();
    let input = MapInput {
        atlas,
        tracer: stage.tracer,
        apart: apart.map(|_| surface_maps::Apart { tracers: &tracers, texel_objects: &texel_objects }),
        bounds: stage.bounds,
        content: &content,
        cache: stage.cache.filter(|_| settings.keep_maps),
    };
    let maps = SurfaceMaps::new(context, input, options, stage.watch)?;
    let moving = apart.map(|apart| apart.maps(context, stage, atlas, &maps)).transpose()?;
    let placed = PlacedMaps::new(
        context,
        maps,
        atlas,
        &tree.topology.leaf_order,
        [settings.map_filter, settings.sender_filter],
    )?;
    Ok(PlacedMaps { moving, ..placed })
}

/// What decides which rays pass through holes, and which sides of surfaces reflect light: materials, and where they are.
fn side_content(stage: &Stage<'_>) -> Vec<u8> {
    let mut content = Vec::new();
    for material in &stage.scene.materials {
        content.extend([u8::from(material.double_sided), u8::from(material.unlit)]);
        content.extend(material.alpha_cutoff.unwrap_or(-1.0).to_le_bytes());
        if material.alpha_cutoff.is_some() {
            content.extend(format!("{material:?}").bytes());
        }
    }
    let of_triangle = |&part: &u32| stage.geometry.parts[part as usize].material.to_le_bytes();
    content.extend(stage.geometry.triangle_part.iter().flat_map(of_triangle));
    content
}

impl State {
    fn new(context: &Context, count: usize) -> Result<Self, GpuError> {
        let light = |name: &str| context.buffer(&format!("surface_shadow_maps/{name}"), count);
        Ok(Self {
            emitted: light("emitted")?,
            dark: light("dark")?,
            irradiance: light("irradiance")?,
            reflected: light("reflected")?,
            reflected_sum: light("reflected sum")?,
            sent_before: light("sent before")?,
            direct: light("direct")?,
            indirect: light("indirect")?,
            cut_sizes: context.buffer("surface_shadow_maps/cut sizes", count)?,
        })
    }
}

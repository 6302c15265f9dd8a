//! Per-pixel final gather: every pixel finds its own cut through a sender tree and gathers from it, with visibility.
//!
//! It shows the solution of any method that fills a [`SenderTree`]; the light it adds is one bounce, so a method solves
//! one bounce less than it is asked for. Senders near the pixel are measured exactly, as polygons, so that nothing has
//! to be clamped; the leaves of a node and the points on them are drawn by chance, anew in every sample, so that a
//! picture of many samples has no trace of the tree.
//!
//! Differs from [Ritschel2008]: a compute pass stands for the fragment shader, since the film is a set of buffers.
//!
//! [Ritschel2008]: crate::methods::PAPERS

use super::PixelView;
use super::direct::{Lighting, Sample};
use super::g_buffer::GBuffer;
use super::shadow_maps::ShadowMaps;
use crate::gpu::shaders::display as passes;
use crate::gpu::shaders::types::{GatherCount, KeptSender};
use crate::gpu::{Buffer, Context, GpuError, Recorder, Sampled};
use crate::report::tonemap::{Operator, ToneSettings};
use crate::scene::camera::View;
use crate::stages::bvh::Bvh;
use crate::stages::false_color;
use crate::stages::film::Film;
use crate::stages::sender_tree::{NodeLayout, Representative, SenderTree, TreeOptions};
use crate::stages::surface_maps::PlacedMaps;
use crate::stages::trace::Tracer;
use crate::stages::world::World;
use bytemuck::Zeroable as _;
use glam::{UVec2, Vec3};

/// Of [`KeptSender::leaf`]: the environment.
pub use crate::stages::sender_tree::NO_SENDER;

crate::choice! {
    /// What decides whether a sender is seen.
    pub enum Visibility {
        /// Surface shadow maps where the method has them, else rays
        Auto = "auto",
        /// Surface shadow maps of the senders
        Maps = "maps",
        /// Surface shadow maps where the method has them, and rays where they leave doubt: to senders close by and where
        /// the four pixels around disagree
        Checked = "checked",
        /// Rays, as `--rays` says
        Rays = "rays",
        /// Nothing: all are seen
        None = "none",
    }
}

crate::choice! {
    /// What the picture shows.
    pub enum Shows {
        /// Light
        Light = "light",
        /// How many nodes each pixel gathered from: blue none, red as many as any
        CutSize = "cut-size",
    }
}

crate::settings! {
    /// What `--display final-gather` lets the user choose.
    pub struct Settings {
        /// A node is opened where its light, gone wrong, would change what is shown by more than this.
        gather_threshold: f32 = 0.05, range 0.0..=1.0, unit "of white", paper "user-defined";
        /// Senders that would change what is shown by less than this share of the threshold are asked by chance, and count
        /// for those that are not; needs jitter.
        gather_chance: f32 = 0.0, range 0.0..=100.0, unit "of gather_threshold", paper "not done";
        /// What decides whether a sender is seen.
        gather_visibility: Visibility = Visibility::Rays, paper "surface shadow maps";
        /// Checked maps are not asked of senders nearer than so many of their radii, rays are.
        gather_map_reach: f32 = 4.0, range 0.0..=1000.0, unit "radii", paper "not done";
        /// What maps see is looked over by rays within so many widths of their pixels of the surface that sees: closer than
        /// that they cannot tell what lies before an edge from what lies behind it. 0 asks maps alone.
        gather_map_stretch: f32 = 0.0, range 0.0..=100.0, unit "pixels of a map", paper "not done";
        /// Draw leaves, and points on them, by chance and anew in every sample.
        gather_jitter: bool = true, paper "for glossy surfaces";
        /// Take senders for at least so many of their radii away; 0 measures near ones exactly.
        gather_clamp: f32 = 0.0, range 0.0..=100.0, unit "radii", paper "clamped, distance not given";
        /// Rays to the environment of every sample of a pixel.
        environment_samples: u32 = 16, range 1..=1024, unit "rays", paper "not given";
        /// Which leaf stands for an inner node without jitter.
        representative: Representative = Representative::Intensity, paper "not given";
        /// What the picture shows.
        gather_shows: Shows = Shows::Light, paper "both, Fig. 11";
        /// How nodes of the tree lie in memory.
        node_layout: NodeLayout = NodeLayout::Wide, paper "compact";
        /// How much a difference of normals counts beside distance when the tree is cut.
        normal_weight: f32 = 0.25, range 0.0..=10.0, paper "0: by position alone";
    }
}

impl Settings {
    /// How a tree for this display is built.
    pub fn tree_options(&self) -> TreeOptions {
        TreeOptions { normal_weight: self.normal_weight, representative: self.representative, layout: self.node_layout }
    }
}

/// What the gather needs beside the tree: how it is told what a change is worth, and its counts.
pub struct FinalGather {
    pub settings: Settings,
    tone: ToneSettings,
    seed: u32,
    /// One per pixel, row by row; means over the samples.
    pub counts: Buffer<GatherCount>,
    kept: Option<Buffer<KeptSender>>,
}

/// Means over all pixels that gathered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GatherReport {
    pub pixels: u64,
    /// Nodes gathered from, per pixel and sample.
    pub mean_cut: f64,
    pub largest_cut: f32,
    /// Nodes looked at.
    pub mean_visited: f64,
    /// Rays cast, per pixel and sample.
    pub mean_rays: f64,
    /// Radiance that clamping took, mean over the picture, W m^-2 sr^-1.
    pub lost: Vec3,
}

impl std::fmt::Display for GatherReport {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "final gather: {} pixels, cut {:.1} nodes in the mean and {:.0} at most, {:.1} nodes visited, {:.1} rays",
            self.pixels, self.mean_cut, self.largest_cut, self.mean_visited, self.mean_rays
        )?;
        if self.lost != Vec3::ZERO {
            write!(f, "; clamping took {:.3e} W/(m2 sr) in the mean", self.lost.element_sum() / 3.0)?;
        }
        Ok(())
    }
}

/// What a picture is gathered from.
#[derive(Clone, Copy)]
pub struct Gathered<'a> {
    pub world: &'a World,
    pub tree: &'a SenderTree,
    pub tracer: Tracer<'a>,
    /// Surface shadow maps of the tree's leaves, where there are any.
    pub maps: Option<&'a PlacedMaps>,
    /// What maps do not tell is traced by this.
    pub bvh: &'a Bvh,
    pub shadow_maps: &'a ShadowMaps,
    pub g_buffer: &'a GBuffer,
    pub view: &'a View,
}

impl FinalGather {
    /// `tone` is what the picture will be shown with: it says where errors show.
    pub fn new(
        context: &Context,
        [width, height]: [u32; 2],
        settings: Settings,
        tone: ToneSettings,
        seed: u32,
    ) -> Result<Self, GpuError> {
        let counts = context.buffer("final_gather/counts", width as usize * height as usize)?;
        Ok(Self { settings, tone, seed, counts, kept: None })
    }

    /// From now on `pixel` (row by row) keeps what it takes from each sender, at most so many; `None` ends that. Such a
    /// gather sees by our own rays, or through everything.
    pub fn keep(&mut self, context: &Context, pixel: Option<u32>, most: usize) -> Result<(), GpuError> {
        self.kept = None;
        if let Some(leaf) = pixel {
            let mut head = vec![KeptSender::zeroed(); most + 1];
            head[0].leaf = leaf;
            self.kept = Some(context.upload("final_gather/kept", &head)?);
        }
        Ok(())
    }

    /// What was kept since then.
    pub fn kept(&self, context: &Context) -> Result<Vec<KeptSender>, GpuError> {
        let Some(kept) = &self.kept else { return Ok(Vec::new()) };
        let count = context.download_range(kept, 0..1)?[0].sample_index as usize;
        if count >= kept.len() {
            let most = kept.len() - 1;
            return Err(GpuError::Refused(format!("a pixel took light {count} times, {most} are kept; lower --spp")));
        }
        context.download_range(kept, 1..count + 1)
    }

    /// Adds sample `sample` to `film`; the first clears it.
    pub fn draw(&self, recorder: &mut Recorder<'_>, from: Gathered<'_>, sample: Sample, film: &Film) {
        let size = UVec2::new(film.width, film.height);
        let pixel_view = PixelView::new(from.view, size, sample.index, sample.samples);
        recorder.scope("sample", |recorder| {
            let Gathered { world, shadow_maps, tracer, g_buffer, .. } = from;
            g_buffer.draw(recorder, world, &pixel_view);
            let lighting = Lighting { world, shadow_maps, tracer, g_buffer };
            lighting.shade(recorder, &pixel_view, sample, world.light_count, film);
            self.gather(recorder, &from, &pixel_view, sample, film);
        });
    }

    /// Adds what the surfaces of a G-buffer gather to `film`.
    pub(super) fn gather(
        &self,
        recorder: &mut Recorder<'_>,
        from: &Gathered<'_>,
        pixel_view: &PixelView,
        sample: Sample,
        film: &Film,
    ) {
        let Gathered { world, tree, g_buffer, .. } = *from;
        let environment = &world.environment;
        let (operator, key) = match self.tone.operator {
            Operator::Reinhard => (0, self.tone.key),
            Operator::Filmic => (1, self.tone.key),
            Operator::None => (2, 0.0),
        };
        let settings = &self.settings;
        let (nodes, compact) = tree.nodes();
        macro_rules! gather {
            ($pass:ident, $params:ident, $surfaces:expr, $constants:expr $(, $field:ident: $value:expr)*) => {{
                let surfaces = $surfaces;
                let pass = passes::$pass {
                    $($field: $value,)*
                    triangles: surfaces.triangles,
                    triangle_materials: surfaces.triangle_materials,
                    attributes: surfaces.attributes,
                    materials: surfaces.materials,
                    textures: surfaces.textures,
                    visible_triangles: g_buffer.sampled(&g_buffer.visible_triangles),
                    g_position: g_buffer.sampled(&g_buffer.position),
                    g_normal: g_buffer.sampled(&g_buffer.normal),
                    g_albedo: g_buffer.sampled(&g_buffer.albedo),
                    g_specular: g_buffer.sampled(&g_buffer.specular),
                    g_emission: g_buffer.sampled(&g_buffer.emission),
                    sender_nodes: nodes,
                    sender_light: &tree.light,
                    sender_leaves: &tree.leaves,
                    sender_branches: &tree.branches,
                    adaptation: &tree.adaptation,
                    tree_frame: &tree.frame,
                    positions: &world.positions,
                    environment_info: &environment.info_buffer,
                    environment_map: Sampled { image: &environment.map, sampler: &environment.sampler },
                    environment_cells: &environment.cells,
                    direct: &film.direct,
                    indirect: &film.indirect,
                    gather_counts: &self.counts,
                    params: passes::$params {
                        eye: pixel_view.eye,
                        weight: 1.0 / sample.samples as f32,
                        sample_index: sample.index,
                        seed: self.seed,
                        node_count: tree.node_count(),
                        threshold: settings.gather_threshold,
                        exposure: self.tone.exposure.exp2(),
                        key,
                        white: self.tone.white,
                        operator,
                        clamp_radii: settings.gather_clamp,
                        jitter: u32::from(settings.gather_jitter),
                        environment_samples: if environment.info.is_black != 0 { 0 } else { settings.environment_samples },
                        chance_below: if settings.gather_jitter { settings.gather_chance } else { 0.0 },
                        map_reach: settings.gather_map_reach,
                        map_stretch: settings.gather_map_stretch,
                    },
                    constants: $constants,
                };
                recorder.dispatch(&pass, [film.width, film.height]);
            }};
        }
        let sees_through = settings.gather_visibility == Visibility::None;
        let by_maps = matches!(settings.gather_visibility, Visibility::Auto | Visibility::Maps | Visibility::Checked);
        let checked = settings.gather_visibility == Visibility::Checked;
        let (Tracer::Compute(_, surfaces) | Tracer::RayQuery(_, surfaces)) = from.tracer;
        if let Some(kept) = &self.kept {
            let alpha_test = surfaces.has_holes;
            gather!(
                FinalGatherExplain,
                FinalGatherExplainParams,
                surfaces,
                passes::FinalGatherExplainConstants { alpha_test, sees_through, compact },
                bvh_nodes: from.bvh.nodes(),
                bvh_triangles: from.bvh.triangles(),
                kept: kept
            );
            return;
        }
        match (from.tracer, from.maps.filter(|_| by_maps)) {
            (_, Some(PlacedMaps { maps, leaf_maps, frame, moving: Some(moving), .. })) => gather!(
                FinalGatherMoving,
                FinalGatherMovingParams,
                surfaces,
                passes::FinalGatherMovingConstants { alpha_test: surfaces.has_holes, compact, checked },
                bvh_nodes: from.bvh.nodes(),
                bvh_triangles: from.bvh.triangles(),
                map_frame: frame,
                run_offsets: &maps.run_offsets,
                runs: &maps.runs,
                map_origins: &maps.origins,
                leaf_maps: leaf_maps,
                rigid_words: &moving.words,
                rigid_objects: &moving.present
            ),
            (_, Some(placed)) => gather!(
                FinalGatherMaps,
                FinalGatherMapsParams,
                surfaces,
                passes::FinalGatherMapsConstants { alpha_test: surfaces.has_holes, compact, checked },
                bvh_nodes: from.bvh.nodes(),
                bvh_triangles: from.bvh.triangles(),
                map_frame: &placed.frame,
                run_offsets: &placed.maps.run_offsets,
                runs: &placed.maps.runs,
                map_origins: &placed.maps.origins,
                leaf_maps: &placed.leaf_maps
            ),
            (Tracer::Compute(bvh, surfaces), None) => gather!(
                FinalGather,
                FinalGatherParams,
                surfaces,
                passes::FinalGatherConstants {
                    alpha_test: surfaces.has_holes,
                    sees_through,
                    compact,
                },
                bvh_nodes: bvh.nodes(),
                bvh_triangles: bvh.triangles()
            ),
            (Tracer::RayQuery(structure, surfaces), None) => gather!(
                FinalGatherRayQuery,
                FinalGatherRayQueryParams,
                surfaces,
                passes::FinalGatherRayQueryConstants { alpha_test: surfaces.has_holes, sees_through, compact },
                acceleration_structure: structure
            ),
        }
    }

    /// Replaces the picture by false colours of the sizes of its cuts, where the settings ask for it; waits for the
    /// device.                                                                              [Ritschel2008 Fig. 11]
    pub fn show_cut_sizes(&self, context: &Context, film: &Film) -> Result<(), GpuError> {
        if self.settings.gather_shows != Shows::CutSize {
            return Ok(());
        }
        let counts = context.download(&self.counts)?;
        let largest = counts.iter().map(|count| count.cut_size).fold(1.0, f32::max);
        let color = |count: &GatherCount| match count.visited > 0.0 {
            true => false_color::of_amount(count.cut_size / largest),
            false => false_color::NEUTRAL,
        };
        context.write(&film.direct, &counts.iter().map(color).collect::<Vec<_>>())?;
        context.write(&film.indirect, &vec![Vec3::ZERO; counts.len()])
    }

    /// What the last picture took; waits for the device.
    pub fn report(&self, context: &Context) -> Result<GatherReport, GpuError> {
        let counts = context.download(&self.counts)?;
        let gathered: Vec<_> = counts.iter().filter(|count| count.visited > 0.0).collect();
        let pixels = gathered.len().max(1) as f64;
        Ok(GatherReport {
            pixels: gathered.len() as u64,
            mean_cut: gathered.iter().map(|count| f64::from(count.cut_size)).sum::<f64>() / pixels,
            largest_cut: gathered.iter().map(|count| count.cut_size).fold(0.0, f32::max),
            mean_rays: gathered.iter().map(|count| f64::from(count.rays)).sum::<f64>() / pixels,
            mean_visited: gathered.iter().map(|count| f64::from(count.visited)).sum::<f64>() / pixels,
            lost: counts.iter().map(|count| count.lost).sum::<Vec3>() / counts.len().max(1) as f32,
        })
    }
}

//! From rays to links: batches of elements cast, trace and merge, within the memory there is.

use super::{Helper, RayCount, Settings, Stage, devices};
use crate::gpu::shaders::methods::explicit_visibility as passes;
use crate::gpu::shaders::types::{Hit, Ray};
use crate::gpu::{Buffer, Context, GpuError};
use crate::scene::environment::Environment;
use crate::stages::bvh::BvhError;
use crate::stages::elements::{ElementTopology, Elements};
use crate::stages::hidden_parts::HiddenPartsError;
use crate::stages::links::{LinkBuilder, LinkCounts, LinkError, LinkFormat, Links, Outcomes};
use crate::stages::trace;
use crate::stages::work::Interrupted;
use crate::stages::world::WorldEnvironment;
use std::ops::Range;

/// Rays of a batch, where memory allows.
const BATCH_RAYS: u64 = 1 << 19;

/// Why the method cannot be prepared.
#[derive(Debug, thiserror::Error)]
pub enum ExplicitError {
    #[error(transparent)]
    Gpu(#[from] GpuError),
    #[error(transparent)]
    Link(#[from] LinkError),
    #[error(transparent)]
    Bvh(#[from] BvhError),
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
    #[error(transparent)]
    HiddenParts(#[from] HiddenPartsError),
    #[error(
        "explicit visibility needs {needed} bytes beside its links for {elements} elements, {available} are available; \
         lower --elements or rays_per_element"
    )]
    OutOfMemory { needed: u64, available: u64, elements: u64 },
}

/// What will be allocated, counted before.
pub(super) struct Sizes {
    ray_count: u32,
    /// Elements of a batch.
    batch: u32,
    /// Bytes that links may take.
    link_budget: u64,
}

impl Sizes {
    /// Refuses what does not fit the device or `budget` bytes, links not yet counted.
    pub fn new(
        context: &Context,
        topology: &ElementTopology,
        light_count: u32,
        settings: &Settings,
        budget: u64,
    ) -> Result<Self, ExplicitError> {
        let ray_count = settings.rays_per_element.get();
        let elements = topology.vertices.len() as u64;
        let limit = context.limits().storage_buffer_bytes;
        let per_element = (u64::from(ray_count) * size_of::<Ray>() as u64).max(LinkBuilder::batch_bytes(ray_count));
        let batch = (BATCH_RAYS / u64::from(ray_count)).min(limit / per_element).clamp(1, elements.max(1));
        let mut sizes = Self { ray_count, batch: batch as u32, link_budget: 0 };

        let per_ray = (size_of::<Ray>() + size_of::<Hit>()) as u64;
        let batch_bytes = batch * (u64::from(ray_count) * per_ray + LinkBuilder::batch_bytes(ray_count));
        let shadow_bytes = sizes.shadow_rays() as u64 * (size_of::<Ray>() + size_of::<u32>()) as u64;
        let light_words = 6 * 3 + u64::from(light_count);
        // Links under way have offsets, and room for what is sent along them, of their own.
        let idle_words = 3;
        let bit_words = idle_words + u64::from(ray_count.div_ceil(32) + settings.emitter_samples.div_ceil(32) + 1);
        let needed =
            Elements::bytes_needed(topology) + batch_bytes + shadow_bytes + 4 * elements * (light_words + bit_words);
        let available = budget.min(context.available_bytes());
        if needed > available {
            return Err(ExplicitError::OutOfMemory { needed, available, elements });
        }
        sizes.link_budget = budget - needed;
        Ok(sizes)
    }

    /// Elements of a batch.
    pub fn elements_at_once(&self) -> u32 {
        self.batch
    }

    /// Elements whose rays are at most `rays`, at least one.
    pub fn elements_of(&self, rays: u32) -> u32 {
        (rays / self.ray_count).max(1)
    }

    /// Rays of a batch of shadow rays: one element's rays to every emitter sample fit in any case.
    pub fn shadow_rays(&self) -> usize {
        (self.batch * self.ray_count).max(1024) as usize
    }
}

/// What links are made of.
#[derive(Clone, Copy)]
pub(super) struct Linked<'a> {
    pub settings: &'a Settings,
    pub elements: &'a Elements,
    pub outcomes: &'a Outcomes,
    pub sizes: &'a Sizes,
}

/// Links under way, batch after batch of receivers.
pub(super) struct Linking {
    rays: Buffer<Ray>,
    hits: Buffer<Hit>,
    pub builder: LinkBuilder,
    /// The first element without links.
    next: u32,
}

impl Linking {
    pub fn new(context: &Context, linked: Linked<'_>) -> Result<Self, ExplicitError> {
        let Linked { settings, elements, sizes: &Sizes { ray_count, batch, link_budget }, .. } = linked;
        let rays = context.buffer("links/rays", (batch * ray_count) as usize)?;
        let hits = context.buffer("links/hits", rays.len())?;
        let format = if settings.packed_links { LinkFormat::Packed } else { LinkFormat::Full };
        let counts = LinkCounts { receivers: elements.count, senders: elements.count, rays: ray_count, batch };
        let builder = LinkBuilder::new(context, format, counts, link_budget)?;
        Ok(Self { rays, hits, builder, next: 0 })
    }

    /// Leaves out what was made so far, and goes on from element `first`.
    pub fn start_at(&mut self, first: u32) {
        self.next = first;
        self.builder.start_over();
    }

    /// Hands the links over in place of `links`, whose memory the next ones are made in.
    pub fn swap(&mut self, links: &mut Links) {
        self.next = 0;
        self.builder.swap(links);
    }

    pub fn is_done(&self, elements: &Elements) -> bool {
        self.next >= elements.count
    }

    /// Casts the rays of the next batch, of at most `most` elements, and makes their links; which elements those were.
    pub fn step(
        &mut self,
        context: &Context,
        stage: &Stage<'_>,
        linked: Linked<'_>,
        most: u32,
    ) -> Result<Range<u32>, ExplicitError> {
        let Linked { settings, elements, outcomes, sizes } = linked;
        let first_element = self.next;
        stage.watch.step("links", first_element.into(), elements.count.into())?;
        let range = first_element..elements.count.min(first_element + sizes.batch.min(most).max(1));
        let batch_rays = range.len() * sizes.ray_count as usize;
        let mut recorder = context.recorder("links")?;
        let pass = passes::Rays {
            ray_origins: &elements.ray_origins,
            element_normals: &elements.normals,
            rays: &self.rays,
            params: passes::RaysParams {
                first_element,
                batch_count: range.len() as u32,
                side: settings.rays_per_element.side(),
                is_rotated: u32::from(settings.rotate_rays),
            },
        };
        recorder.dispatch(&pass, batch_rays);
        trace::closest_hit(&mut recorder, &stage.tracer, &self.rays, &self.hits, batch_rays);
        let world = stage.world;
        let (triangles, backs) = (&world.triangles, &elements.back_elements);
        self.builder.merge(&mut recorder, range.clone(), &self.hits, triangles, backs, outcomes);
        recorder.submit()?;
        self.builder.append(context, range.clone())?;
        self.next = range.end;
        Ok(range)
    }
}

/// Casts the rays of all elements and makes their links, which `linking` holds then. How many elements each device had;
/// empty where this one had all.                                                            [Schmitz2008 3.2]
pub(super) fn build(
    context: &Context,
    stage: &Stage<'_>,
    linked: Linked<'_>,
    linking: &mut Linking,
    helpers: &mut [Helper],
) -> Result<Vec<u32>, ExplicitError> {
    if !helpers.is_empty() {
        return devices::build(context, stage, linked, linking, helpers);
    }
    linking.start_at(0);
    while !linking.is_done(linked.elements) {
        linking.step(context, stage, linked, u32::MAX)?;
    }
    stage.watch.step("links", linked.elements.count.into(), linked.elements.count.into())?;
    Ok(Vec::new())
}

/// The environment at the density of the rays, so that none of its light falls between them.
pub(super) fn averaged_environment(
    context: &Context,
    environment: &Environment,
    rays: RayCount,
) -> Result<WorldEnvironment, GpuError> {
    // 2 side^2 texels over the sphere: as many as there are rays over the two halves of it.
    WorldEnvironment::new(context, &environment.averaged(2 * rays.side(), rays.side()))
}

//! Elements and their light while it is shot: a pool that grows as light asks for more elements.

use super::{BATCH, FaceClusterError, Placement, Settings};
use crate::gpu::shaders::types::{CubatureNode, FaceElement, PoolCounters};
use crate::gpu::{Buffer, Context, GpuError};
use crate::stages::scan::ScanScratch;
use glam::{UVec2, Vec3};

/// Elements of a new pool beyond those of the roots.
const FIRST: u32 = 1 << 12;

/// `capacity` entries each unless said otherwise.
pub struct State {
    pub(super) capacity: u32,
    /// What `capacity` may become: by the settings, by the clusters there are, by what one buffer holds.
    pub(super) most: u32,
    /// Of the receiver's rule, then of the shooter's; on the square, then on a triangle.
    pub(super) rules: Buffer<CubatureNode>,
    pub elements: Buffer<FaceElement>,
    /// Per element and rule node, metres.
    pub(super) nodes: Buffer<Vec3>,
    /// Per element and rule node: of the face there, a signed byte an axis.
    pub(super) normals: Buffer<u32>,
    /// Per element: of each irradiance function and receiver node, how much of what arrives there the function gets; then of
    /// each shooter node, what the places around it are of all.
    pub(super) fits: Buffer<f32>,
    /// Per element and irradiance function: its mean over the element's faces.
    pub(super) function_means: Buffer<f32>,
    /// Per element and radiosity function, W/m2.
    pub(super) unshot: Buffer<Vec3>,
    pub(super) next_unshot: Buffer<Vec3>,
    /// Per element and irradiance function; a column a channel.
    pub(super) direct: Buffer<[[f32; 3]; 3]>,
    pub(super) indirect: Buffer<[[f32; 3]; 3]>,
    /// Per element, irradiance function, channel and axis.
    pub(super) arriving: Buffer<i32>,
    /// Per element, and one more; of leaves: their number.
    pub(super) leaf_indices: Buffer<u32>,
    pub(super) scan: ScanScratch,
    /// One entry.
    pub(super) pool: Buffer<PoolCounters>,
    /// Of each pair of a step.
    pub(super) decisions: Buffer<u32>,
    /// Per triangle: the leaves of its front and back.
    pub(super) triangle_leaves: Buffer<UVec2>,
}

/// Entries of the tables of an element: rule nodes, those of the receiver, radiosity functions, irradiance functions.
#[derive(Clone, Copy)]
struct Shape {
    nodes: usize,
    receiver_nodes: usize,
    radiosity: usize,
    irradiance: usize,
}

impl Shape {
    fn of(settings: &Settings) -> Self {
        Self {
            nodes: settings.receiver_rule.nodes().len() + settings.shooter_rule.nodes().len(),
            receiver_nodes: settings.receiver_rule.nodes().len(),
            radiosity: settings.radiosity_basis.functions() as usize,
            irradiance: settings.irradiance_basis.functions() as usize,
        }
    }

    /// Of receiver nodes to functions, and of shooter nodes.
    fn fits(self) -> usize {
        self.irradiance * self.receiver_nodes + self.nodes - self.receiver_nodes
    }

    /// Of the largest table, and of all, an element.
    fn bytes(self) -> (u64, u64) {
        let element = size_of::<FaceElement>();
        let fits = 4 * self.fits();
        let widest = (12 * self.nodes).max(36 * self.irradiance).max(element).max(fits);
        let all = element + 16 * self.nodes + 24 * self.radiosity + 112 * self.irradiance + fits + 4;
        (widest as u64, all as u64)
    }
}

impl State {
    /// Room for the roots and some elements more.
    pub(super) fn new(
        context: &Context,
        settings: &Settings,
        placement: &Placement,
        triangle_count: u32,
    ) -> Result<Self, FaceClusterError> {
        let mut rules = settings.receiver_rule.nodes();
        rules.extend(settings.shooter_rule.nodes());
        rules.extend(settings.receiver_rule.triangle_nodes());
        rules.extend(settings.shooter_rule.triangle_nodes());
        let shape = Shape::of(settings);
        let roots = placement.instance_count;
        let allowed = context.limits().storage_buffer_bytes / shape.bytes().0;
        let wanted = placement.placed_clusters.min(settings.max_elements.into()).min(allowed);
        let most = u32::try_from(wanted).unwrap_or(u32::MAX).max(roots);
        let capacity = round(roots + FIRST, roots, most);
        check(context, shape, capacity)?;
        let pool = Tables::new(context, shape, capacity as usize)?;
        Ok(Self {
            capacity,
            most: round(most, roots, most),
            rules: context.upload("face-cluster/rules", &rules)?,
            elements: pool.elements,
            nodes: pool.nodes,
            normals: pool.normals,
            fits: pool.fits,
            function_means: pool.function_means,
            unshot: pool.unshot,
            next_unshot: pool.next_unshot,
            direct: pool.direct,
            indirect: pool.indirect,
            arriving: pool.arriving,
            leaf_indices: pool.leaf_indices,
            scan: pool.scan,
            pool: context.buffer("face-cluster/pool", 1)?,
            decisions: context.buffer("face-cluster/decisions", BATCH as usize)?,
            triangle_leaves: context.buffer("face-cluster/triangle leaves", triangle_count as usize)?,
        })
    }

    /// Twice the room, as far as allowed; all elements keep their places and light.
    pub(super) fn grow(&mut self, context: &Context, settings: &Settings, roots: u32) -> Result<(), FaceClusterError> {
        if self.capacity >= self.most {
            return Err(FaceClusterError::PoolFull { capacity: self.most, threshold: settings.threshold });
        }
        let (shape, capacity) = (Shape::of(settings), round(self.capacity.saturating_mul(2), roots, self.most));
        check(context, shape, capacity)?;
        let larger = Tables::new(context, shape, capacity as usize)?;
        let mut recorder = context.recorder("face-cluster")?;
        recorder.copy(&self.elements, &larger.elements);
        recorder.copy(&self.nodes, &larger.nodes);
        recorder.copy(&self.normals, &larger.normals);
        recorder.copy(&self.fits, &larger.fits);
        recorder.copy(&self.function_means, &larger.function_means);
        recorder.copy(&self.unshot, &larger.unshot);
        recorder.copy(&self.next_unshot, &larger.next_unshot);
        recorder.copy(&self.direct, &larger.direct);
        recorder.copy(&self.indirect, &larger.indirect);
        recorder.copy(&self.arriving, &larger.arriving);
        recorder.submit()?;
        let mut counters = context.download(&self.pool)?[0];
        // Claims beyond the end were not granted.
        (counters.element_count, counters.made_count, counters.is_full) = (self.capacity, self.capacity, 0);
        context.write(&self.pool, &[counters])?;
        self.replace(larger, capacity);
        Ok(())
    }

    /// Gives back all room beyond that of a new pool: what was solved is no longer there.
    pub(super) fn shrink(&mut self, context: &Context, settings: &Settings, roots: u32) -> Result<(), GpuError> {
        let capacity = round(roots + FIRST, roots, self.most);
        if self.capacity > capacity {
            let small = Tables::new(context, Shape::of(settings), capacity as usize)?;
            self.replace(small, capacity);
        }
        Ok(())
    }

    fn replace(&mut self, tables: Tables, capacity: u32) {
        self.capacity = capacity;
        self.elements = tables.elements;
        self.nodes = tables.nodes;
        self.normals = tables.normals;
        self.fits = tables.fits;
        self.function_means = tables.function_means;
        self.unshot = tables.unshot;
        self.next_unshot = tables.next_unshot;
        self.direct = tables.direct;
        self.indirect = tables.indirect;
        self.arriving = tables.arriving;
        self.leaf_indices = tables.leaf_indices;
        self.scan = tables.scan;
    }

    /// Of so many elements with all their tables.
    pub(super) fn bytes(settings: &Settings, elements: u32) -> u64 {
        Shape::of(settings).bytes().1 * u64::from(elements)
    }

    /// Per element and irradiance function: its mean over the faces that are not hidden.
    pub fn function_means(&self) -> &Buffer<f32> {
        &self.function_means
    }

    /// From emitters and the environment, per element and function; of leaves.
    pub fn direct(&self) -> &Buffer<[[f32; 3]; 3]> {
        &self.direct
    }

    /// Reflected at least once, per element and function; of leaves.
    pub fn indirect(&self) -> &Buffer<[[f32; 3]; 3]> {
        &self.indirect
    }

    /// Per triangle: the numbers of its front's and its back's leaf, u32::MAX where there is none. Leaves are numbered
    /// in the order of elements.
    pub fn triangle_leaves(&self) -> &Buffer<UVec2> {
        &self.triangle_leaves
    }
}

/// Children come in pairs: the last one fills the pool.
fn round(capacity: u32, roots: u32, most: u32) -> u32 {
    let capacity = capacity.clamp(roots, most);
    capacity - (capacity - roots) % 2
}

fn check(context: &Context, shape: Shape, capacity: u32) -> Result<(), FaceClusterError> {
    let (needed, available) = (u64::from(capacity) * shape.bytes().1, context.available_bytes());
    if needed > available { Err(FaceClusterError::OutOfMemory { needed, available }) } else { Ok(()) }
}

/// The tables of [`State`] that grow with its capacity.
struct Tables {
    elements: Buffer<FaceElement>,
    nodes: Buffer<Vec3>,
    normals: Buffer<u32>,
    fits: Buffer<f32>,
    function_means: Buffer<f32>,
    unshot: Buffer<Vec3>,
    next_unshot: Buffer<Vec3>,
    direct: Buffer<[[f32; 3]; 3]>,
    indirect: Buffer<[[f32; 3]; 3]>,
    arriving: Buffer<i32>,
    leaf_indices: Buffer<u32>,
    scan: ScanScratch,
}

impl Tables {
    fn new(context: &Context, shape: Shape, capacity: usize) -> Result<Self, GpuError> {
        let buffer = |name: &str| format!("face-cluster/{name}");
        Ok(Self {
            elements: context.buffer(&buffer("elements"), capacity)?,
            nodes: context.buffer(&buffer("nodes"), capacity * shape.nodes)?,
            normals: context.buffer(&buffer("normals"), capacity * shape.nodes)?,
            fits: context.buffer(&buffer("fits"), capacity * shape.fits())?,
            function_means: context.buffer(&buffer("function means"), capacity * shape.irradiance)?,
            unshot: context.buffer(&buffer("unshot"), capacity * shape.radiosity)?,
            next_unshot: context.buffer(&buffer("next unshot"), capacity * shape.radiosity)?,
            direct: context.buffer(&buffer("direct"), capacity * shape.irradiance)?,
            indirect: context.buffer(&buffer("indirect"), capacity * shape.irradiance)?,
            arriving: context.buffer(&buffer("arriving"), capacity * shape.irradiance * 9)?,
            leaf_indices: context.buffer(&buffer("leaf indices"), capacity + 1)?,
            scan: ScanScratch::new(context, "face-cluster", capacity + 1)?,
        })
    }
}

//! What is kept of a solve: the light of its leaves. All else that shooting needs is given back.
//!
//! Differs from [Gobbetti2003]: irradiance with a shared exponent, in a common unit, and inner elements go altogether, since
//! nothing is shot from a solution that is shown.
//!
//! [Gobbetti2003]: crate::methods::PAPERS

use super::{FaceClusterError, FaceClusters, Stage};
use crate::gpu::shaders::methods::face_cluster as passes;
use crate::gpu::shaders::types::{LeafElement, SharedVectors};
use crate::gpu::{Buffer, Context, Recorder};
use crate::stages::scan;
use glam::Vec3;

/// What all light together may come to in units: the most that a shared exponent holds is twice that.
const MOST_UNITS: f32 = 16384.0;

/// Light on leaves; their number is that of [`super::State::triangle_leaves`].
pub struct Solution {
    pub leaves: Buffer<LeafElement>,
    /// Per leaf and function, in units: from emitters and the environment.
    pub direct: Buffer<SharedVectors>,
    /// Reflected at least once.
    pub indirect: Buffer<SharedVectors>,
    /// W/m2.
    pub unit: f32,
    /// Per leaf, and one more: where the row of leaves whose light reaches it starts.
    pub neighbour_offsets: Buffer<u32>,
    /// One entry, not looked at, where light reaches over no border.
    pub neighbours: Buffer<u32>,
    /// False colours per leaf; one entry, not looked at, where the picture shows light.
    pub colors: Buffer<Vec3>,
}

impl Solution {
    /// Without what tells triangles their leaves, which is the model's.
    pub fn size_bytes(&self) -> u64 {
        let rows = self.neighbour_offsets.size_bytes() + self.neighbours.size_bytes();
        self.leaves.size_bytes() + self.direct.size_bytes() + self.indirect.size_bytes() + rows
    }
}

impl FaceClusters {
    /// Numbers the leaves, finds that of every triangle, and counts. After an interruption too.
    pub fn locate(&mut self, context: &Context, stage: &Stage<'_>) -> Result<(), FaceClusterError> {
        let (s, p) = (&self.state, &self.placement);
        let counters = context.download(&s.pool)?[0];
        let element_count = counters.element_count.min(s.capacity);
        let mut recorder = context.recorder("face-cluster")?;
        let flag = passes::FlagLeaves {
            elements: &s.elements,
            leaf_indices: &s.leaf_indices,
            params: passes::FlagLeavesParams { element_count },
        };
        recorder.dispatch(&flag, element_count);
        scan::exclusive(&mut recorder, &s.leaf_indices, element_count as usize, &s.scan);
        let pass = passes::Locate {
            elements: &s.elements,
            triangle_places: &p.places,
            triangle_roots: &p.triangle_roots,
            leaf_indices: &s.leaf_indices,
            triangle_leaves: &s.triangle_leaves,
            params: passes::LocateParams { triangle_count: stage.world.triangle_count },
        };
        recorder.dispatch(&pass, stage.world.triangle_count);
        recorder.submit()?;
        self.report.elements = element_count;
        // Every split makes one leaf more.
        self.report.leaves = (element_count + p.instance_count) / 2;
        self.report.element_depth = counters.deepest_level;
        self.report.working_bytes = super::State::bytes(&self.settings, element_count);
        Ok(())
    }

    /// What is to be shown of what was solved and located; everything else is given back.
    pub fn keep(&mut self, context: &Context) -> Result<Solution, FaceClusterError> {
        let (s, functions) = (&self.state, self.settings.irradiance_basis.functions());
        let leaves = self.report.leaves as usize;
        let unit = (self.most_light / MOST_UNITS).max(f32::MIN_POSITIVE);
        let (neighbour_offsets, neighbours) = self.neighbours(context)?;
        let solution = Solution {
            leaves: context.buffer("face-cluster/leaves", leaves)?,
            direct: context.buffer("face-cluster/leaf direct", leaves * functions as usize)?,
            indirect: context.buffer("face-cluster/leaf indirect", leaves * functions as usize)?,
            unit,
            neighbour_offsets,
            neighbours,
            colors: self.colors(context)?,
        };
        let mut recorder = context.recorder("face-cluster")?;
        let pass = passes::KeepLeaves {
            elements: &s.elements,
            leaf_indices: &s.leaf_indices,
            direct_irradiance: &s.direct,
            indirect_irradiance: &s.indirect,
            leaves: &solution.leaves,
            leaf_direct: &solution.direct,
            leaf_indirect: &solution.indirect,
            params: passes::KeepLeavesParams {
                element_count: self.report.elements,
                functions,
                inverse_unit: 1.0 / unit,
            },
        };
        recorder.dispatch(&pass, self.report.elements);
        recorder.submit()?;
        self.report.solution_bytes = solution.size_bytes();
        self.state.shrink(context, &self.settings, self.placement.instance_count)?;
        Ok(solution)
    }

    /// Rows of the leaves whose light reaches each leaf: where they start, and they.
    fn neighbours(&self, context: &Context) -> Result<(Buffer<u32>, Buffer<u32>), FaceClusterError> {
        let (s, leaves) = (&self.state, self.report.leaves as usize);
        let (offsets, none) = (
            context.buffer("face-cluster/neighbour offsets", leaves + 1)?,
            context.upload("face-cluster/neighbours", &[0])?,
        );
        let reach = self.settings.leaf_reach;
        if reach <= 0.0 {
            return Ok((offsets, none));
        }
        let find = |recorder: &mut Recorder<'_>, neighbours: &Buffer<u32>, writes: u32| {
            let pass = passes::FindNeighbours {
                elements: &s.elements,
                leaf_indices: &s.leaf_indices,
                neighbour_offsets: &offsets,
                neighbours,
                params: passes::FindNeighboursParams { element_count: self.report.elements, reach, writes },
            };
            recorder.dispatch(&pass, self.report.elements);
        };
        let mut recorder = context.recorder("face-cluster")?;
        find(&mut recorder, &none, 0);
        scan::exclusive(&mut recorder, &offsets, leaves + 1, &s.scan);
        recorder.submit()?;
        let count = context.download_range(&offsets, leaves..leaves + 1)?[0];
        let neighbours = context.buffer("face-cluster/neighbours", count.max(1) as usize)?;
        let mut recorder = context.recorder("face-cluster")?;
        find(&mut recorder, &neighbours, 1);
        recorder.submit()?;
        Ok((offsets, neighbours))
    }
}

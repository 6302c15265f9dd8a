//! The bounded queue of dual-tree refinement: pairs of nodes, refined into pairs of their children until a kernel
//! accepts or drops them (`lib/pair_queue.glsl` says what such a kernel binds).
//!
//! Pairs wait on a stack and are taken from its top, a step of at most [`PairQueuePlan::batch`] pairs at a time, so the
//! stack grows with the depth of the trees and not with the number of pairs. A step never takes more pairs than there
//! is room for their children; where there is not room for one pair's, [`PairQueueError::Full`] says so.
//! What it does not do: keep any order. What kernels make must not depend on it.

use crate::gpu::shaders::pair_queue as passes;
use crate::gpu::shaders::types::PairCounters;
use crate::gpu::{Buffer, Context, GpuError, GroupCounts, Recorder};
use glam::UVec2;

/// Steps recorded before the host looks whether all is done. A step over nothing costs microseconds.
const STEPS_PER_SUBMISSION: u32 = 32;

/// Why a refinement stopped.
#[derive(Debug, thiserror::Error)]
pub enum PairQueueError {
    #[error(transparent)]
    Gpu(#[from] GpuError),
    #[error(
        "the stack of {capacity} node pairs is full at {highest}, and {max_children} children of one pair have no room; \
         give the queue more levels or a larger batch"
    )]
    Full { capacity: u32, highest: u32, max_children: u32 },
    #[error("{seeds} pairs to start from, the stack holds {capacity}; give the queue more seeds")]
    Seeds { seeds: usize, capacity: u32 },
}

/// What decides the memory of a queue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PairQueuePlan {
    /// Pairs of one step, at most.
    pub batch: u32,
    /// Pairs that one pair is refined into, at most.
    pub max_children: u32,
    /// Refinements between a pair to start from and the last of its descendants, at most.
    pub levels: u32,
    /// Pairs to start from.
    pub seeds: u32,
}

impl PairQueuePlan {
    /// Pairs on the stack: the seeds, on each level what is left of a step's children, and as much again for one step
    /// more as it takes to never run short.
    pub fn capacity(&self) -> u32 {
        let growth = u64::from(self.max_children.saturating_sub(1));
        let room = growth * u64::from(self.batch) * (u64::from(self.levels) + 2);
        u32::try_from(u64::from(self.seeds) + room.max(1)).unwrap_or(u32::MAX)
    }

    /// Bytes of the tables of [`PairQueue::new`].
    pub fn bytes_needed(&self) -> u64 {
        (u64::from(self.capacity()) + u64::from(self.batch)) * size_of::<UVec2>() as u64
    }
}

/// The stack and the pairs of the present step.
pub struct PairQueue {
    plan: PairQueuePlan,
    pub stack: Buffer<UVec2>,
    pub taken: Buffer<UVec2>,
    /// One entry.
    pub counters: Buffer<PairCounters>,
    /// Threads of the present step: one a pair.
    thread_count: Buffer<u32>,
    /// Their workgroups, of 64 threads, for [`Recorder::dispatch_indirect`].
    pub groups: GroupCounts,
}

impl PairQueue {
    pub fn new(context: &Context, owner: &str, plan: PairQueuePlan) -> Result<Self, GpuError> {
        Ok(Self {
            stack: context.buffer(&format!("{owner}/pair stack"), plan.capacity() as usize)?,
            taken: context.buffer(&format!("{owner}/taken pairs"), plan.batch as usize)?,
            counters: context.buffer(&format!("{owner}/pair counters"), 1)?,
            thread_count: context.buffer(&format!("{owner}/pair threads"), 1)?,
            groups: context.group_counts(&format!("{owner}/pair groups"), 64)?,
            plan,
        })
    }

    /// Refines `seeds` until nothing is left. `step` dispatches the kernel that refines the taken pairs, indirectly over
    /// [`Self::groups`]; it is called many times, and must do nothing for a step of no pairs.
    pub fn refine(
        &self,
        context: &Context,
        name: &str,
        seeds: &[UVec2],
        step: impl FnMut(&mut Recorder<'_>),
    ) -> Result<PairCounters, PairQueueError> {
        self.refine_while(context, name, seeds, step, |_| true)
    }

    /// As [`Self::refine`], as long as `goes_on` says so after each submission; what is left then is dropped.
    pub fn refine_while(
        &self,
        context: &Context,
        name: &str,
        seeds: &[UVec2],
        step: impl FnMut(&mut Recorder<'_>),
        goes_on: impl FnMut(&PairCounters) -> bool,
    ) -> Result<PairCounters, PairQueueError> {
        self.start(context, seeds)?;
        self.go_on_while(context, name, step, goes_on)
    }

    /// Puts the pairs to start from on the stack, and nothing else.
    pub fn start(&self, context: &Context, seeds: &[UVec2]) -> Result<(), PairQueueError> {
        let capacity = self.plan.capacity();
        if seeds.len() > capacity as usize {
            return Err(PairQueueError::Seeds { seeds: seeds.len(), capacity });
        }
        context.write(&self.stack, seeds)?;
        let start = PairCounters { top: seeds.len() as u32, taken: 0, visited: 0, accepted: 0, highest: 0, is_full: 0 };
        Ok(context.write(&self.counters, &[start])?)
    }

    /// Refines what is on the stack, as [`Self::refine_while`]; what is left stays there.
    pub fn go_on_while(
        &self,
        context: &Context,
        name: &str,
        mut step: impl FnMut(&mut Recorder<'_>),
        mut goes_on: impl FnMut(&PairCounters) -> bool,
    ) -> Result<PairCounters, PairQueueError> {
        let capacity = self.plan.capacity();
        loop {
            let mut recorder = context.recorder(name)?;
            for _ in 0..STEPS_PER_SUBMISSION {
                self.take(&mut recorder);
                step(&mut recorder);
            }
            recorder.submit()?;
            let counters = context.download(&self.counters)?[0];
            if counters.is_full != 0 {
                let PairQueuePlan { max_children, .. } = self.plan;
                return Err(PairQueueError::Full { capacity, highest: counters.highest, max_children });
            }
            if counters.top == 0 || !goes_on(&counters) {
                return Ok(counters);
            }
        }
    }

    /// The next step's pairs: off the stack, and their number to `counters` and `groups`.
    fn take(&self, recorder: &mut Recorder<'_>) {
        let PairQueuePlan { batch, max_children, .. } = self.plan;
        let params = passes::ChooseParams { batch, capacity: self.plan.capacity(), max_children };
        let choose = passes::Choose { counters: &self.counters, thread_counts: &self.thread_count, params };
        recorder.dispatch(&choose, 1u32);
        recorder.count_groups(&self.groups, &self.thread_count, 0);
        let take = passes::Take { counters: &self.counters, pair_stack: &self.stack, taken_pairs: &self.taken };
        recorder.dispatch_indirect(&take, &self.groups);
    }
}
